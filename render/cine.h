// A cine loop: the last X-ray images, stored as the data from which they were drawn (tools, X-ray settings, pulse number, contrast agent), so that they can be
// redrawn
// exactly, at any size, and also in the 3D view. An image takes 200 bytes per tool node and 4 per vessel node: 30 s at 30 images/s with 300 and 1,400 nodes
// take 60 MB, allocated once; the pixels at 1024 x 1024 would take 900 MB. A view that subtracts (DSA) uses the first image of the loop as
// its mask: call fluoroscope_forget() when a loop begins. Uses no OpenGL and no files. One thread.
#ifndef SELDINGER_RENDER_CINE_H
#define SELDINGER_RENDER_CINE_H

#include "base/base.h"
#include "sim/sim.h"

typedef struct CineFrame {
    const Pose *pose;            // at the pulse, with its own X-ray settings and time
    const float *contrast;       // (contrast_count of the shape) at the nodes of the vessel, then in the lumens of the tools at theirs; NULL if the count is 0
    uint32_t pulse;              // number of the X-ray pulse
} CineFrame;

typedef struct Cine Cine;

typedef struct CineShape {       // of each image
    int tool_count;              // 1 to 4
    int tool_nodes[STEP_TOOLS_MAX];      // upper limit for each tool; the shared centreline has at most their sum
    int contrast_count;          // number of contrast values: nodes of the vessel tree (0 without a tree) and of all tools; 0: none
} CineShape;
CineShape cine_shape_for(const Pose *pose, int contrast_count);
bool cine_shapes_same(const CineShape *a, const CineShape *b);
// Memory of a loop [bytes]; 0 if it is above 8 GB or a count is out of range: 1 to 100,000 nodes per tool, 0 to 10,000,000 vessel nodes, 1 to
// 1,000,000 images.
size_t cine_bytes(const CineShape *shape, int capacity);
// Returns NULL if cine_bytes() is 0 or if out of memory.
Cine *cine_create(const CineShape *shape, int capacity);
void cine_free(Cine *cine);

// --- recording --- Empties the loop and starts recording. Returns false while it is locked.
bool cine_record(Cine *cine);
void cine_stop(Cine *cine);
bool cine_is_recording(const Cine *cine);
// Call with every picture; known pulses are ignored, and all calls are ignored while not recording. When the loop is full, the oldest image is dropped; while
// it is
// locked, no image is dropped or added. Returns true if the image was stored. Allocates nothing.
bool cine_add(Cine *cine, const CineFrame *frame);
// Locks the loop while it is replayed or saved: the images do not change.
void cine_lock(Cine *cine, bool locked);

CineShape cine_shape(const Cine *cine);
int cine_capacity(const Cine *cine);
int cine_count(const Cine *cine);
int64_t cine_dropped(const Cine *cine);                  // images dropped since cine_record
CineFrame cine_frame(const Cine *cine, int index);       // 0 (oldest) to cine_count - 1; valid until the next cine_add
// Duration [s] of an image: to the next pulse, or, if the pedal was released in between, the period of the pulse rate.
double cine_frame_s(const Cine *cine, int index);
double cine_duration_s(const Cine *cine);

// --- replay, at the original times of the pulses ---
typedef struct CinePlayer {
    bool is_playing, loops;
    double speed;                // 1: original speed; 0.1 to 4
    int frame;                   // index of the image shown, -1: the loop is empty
    double shown_s;              // how long it has been shown, in the time of the loop
} CinePlayer;
CinePlayer cine_player_start(const Cine *cine);          // starts at the first image, at original speed, and repeats
// Advances by `dt_s` of real time and returns the image to show. If `loops` is false it stops at the last one.
int cine_player_advance(CinePlayer *player, const Cine *cine, double dt_s);

// --- files --- Returns the loop as bytes, `*length` of them; the caller frees them. NULL if out of memory.
uint8_t *cine_pack(const Cine *cine, size_t *length);
// Returns NULL with a fault. All bytes are checked: sizes, ranges, checksum.
Cine *cine_unpack(const uint8_t *bytes, size_t length, const char *name, Faults *faults);
// Writes a video at the highest pulse rate of the loop; images at a lower rate are repeated. `draw` renders an image, (height, width, 3), rows from the top, or
// returns false with its reason in the message. Returns false with a reason in `message`; then no video is written.
typedef bool (*CineDraw)(void *context, const CineFrame *frame, uint8_t *rgb, char *message, size_t capacity);
bool cine_movie(const Cine *cine, const char *path, int width, int height, CineDraw draw, void *context, char *message, size_t capacity);

#endif
