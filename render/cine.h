// A cine loop: the last X-ray images, stored as the data they were drawn from (tools, X-ray settings, pulse number, contrast agent), so that they can
// be redrawn exactly, at any size, and in the 3D view too. An image is 200 bytes a tool node and 4 a vessel node: 30 s at 30/s with 300 and 1,400 of
// them take 60 MB, allocated once; the pictures themselves at 1024 x 1024 would take 900. A view that subtracts (DSA) takes the loop's first image as
// its mask: forget the held picture (fluoroscope_forget) when a loop begins. Uses no OpenGL and no files. One thread.
#ifndef SELDINGER_RENDER_CINE_H
#define SELDINGER_RENDER_CINE_H

#include "base/base.h"
#include "sim/sim.h"

typedef struct CineFrame {
    const Pose *pose;            // at the pulse; X-ray settings and time are its own
    const float *contrast;       // (contrast_count of the shape) at the vessel's nodes, then in the tools' lumens at theirs; NULL if that is 0
    uint32_t pulse;              // number of the X-ray pulse
} CineFrame;

typedef struct Cine Cine;

typedef struct CineShape {       // of each image
    int tool_count;              // 1 to 4
    int tool_nodes[STEP_TOOLS_MAX];      // at most, of each; the shared centreline has at most their sum
    int contrast_count;          // values of contrast agent: nodes of the vessel tree (0 without) and of all tools; 0: none
} CineShape;
CineShape cine_shape_for(const Pose *pose, int contrast_count);
bool cine_shapes_same(const CineShape *a, const CineShape *b);
// [bytes] that a loop takes; 0 if more than 8 GB or a count is out of range: 1 to 100,000 nodes of a tool, 0 to 10,000,000 vessel nodes, 1 to
// 1,000,000 images.
size_t cine_bytes(const CineShape *shape, int capacity);
// NULL if cine_bytes() is 0 or memory runs out.
Cine *cine_create(const CineShape *shape, int capacity);
void cine_free(Cine *cine);

// --- recording --- Empties the loop and starts recording. False while it is locked.
bool cine_record(Cine *cine);
void cine_stop(Cine *cine);
bool cine_is_recording(const Cine *cine);
// To be called with every picture; known pulses are ignored, and so is everything while not recording. When the loop is full the oldest image is
// dropped; while it is locked no image is dropped or added. True if the image was stored. Allocates nothing.
bool cine_add(Cine *cine, const CineFrame *frame);
// Locks the loop while it is replayed or saved: images stay in place.
void cine_lock(Cine *cine, bool locked);

CineShape cine_shape(const Cine *cine);
int cine_capacity(const Cine *cine);
int cine_count(const Cine *cine);
int64_t cine_dropped(const Cine *cine);                  // images dropped since cine_record
CineFrame cine_frame(const Cine *cine, int index);       // 0 (oldest) to cine_count - 1; valid until the next cine_add
// [s] that an image is shown: to the next pulse, but where the pedal was up between only as long as the pulses' rate says.
double cine_frame_s(const Cine *cine, int index);
double cine_duration_s(const Cine *cine);

// --- replay, at the pulses' own times ---
typedef struct CinePlayer {
    bool is_playing, loops;
    double speed;                // 1: as it was; 0.1 to 4
    int frame;                   // shown now, -1: the loop is empty
    double shown_s;              // how long it has been, in the loop's time
} CinePlayer;
CinePlayer cine_player_start(const Cine *cine);          // plays in a loop, at its speed, from the first image
// Advances by `dt_s` of real time. Returns the image to show. Without `loops` it stops at the last one.
int cine_player_advance(CinePlayer *player, const Cine *cine, double dt_s);

// --- files --- The loop as bytes, `*length` of them; free() them. NULL if out of memory.
uint8_t *cine_pack(const Cine *cine, size_t *length);
// NULL with a fault. All bytes are checked: sizes, ranges, checksum.
Cine *cine_unpack(const uint8_t *bytes, size_t length, const char *name, Faults *faults);
// As a movie at the fastest of its pulse rates; slower images are repeated. `draw` renders an image, (height, width, 3), rows from the top, or
// returns false with its reason in the message. False with a reason in `message`; then there is no movie.
typedef bool (*CineDraw)(void *context, const CineFrame *frame, uint8_t *rgb, char *message, size_t capacity);
bool cine_movie(const Cine *cine, const char *path, int width, int height, CineDraw draw, void *context, char *message, size_t capacity);

#endif
