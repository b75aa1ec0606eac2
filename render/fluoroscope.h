// Fluoroscopy: the first view of the trainer, drawn from a Pose and the settings of the X-ray system.
//
// Along each ray I = exp(-(anatomy + contrast + tools)); the brightness is 1.75 I^0.72, as after automatic exposure; quantum noise with a sigma that follows
// from I, softened by the detector; four collimator blades with a rounded soft edge. The picture is the largest square in the middle of the ViewPort; the rest
// is dark. It is drawn in layers, each only when its input changes (docs/design.md, "Fluoroscopy"):
//   anatomy and vessel thickness -> baked base (brightness, noise sigma) -> tools multiplied in -> noise by pulse.
// While `xray.pedal` is 0, or `pulse` is unchanged, the last picture is kept whatever else changes (last image hold).
//
// Needs a current OpenGL 3.3 context, the same in every call; one thread.
#ifndef SELDINGER_RENDER_FLUOROSCOPE_H
#define SELDINGER_RENDER_FLUOROSCOPE_H

#include "render/fluoroscope_options.h"
#include "render/pulse_memory.h"
#include "render/view_port.h"
#include "sim/sim.h"

typedef struct Fluoroscope Fluoroscope;

FluoroscopeOptions fluoroscope_default_options(void);

// Returns NULL with the reason in `message`. Otherwise `message` is empty or says what is missing in the picture (for example because a mesh is not closed).
Fluoroscope *fluoroscope_create(const FluoroscopeOptions *options, char *message, size_t capacity);
// A second one of the same patient and tools, with its own pictures: a second plane, or a reference image. `first` must outlive it. `pose`: any of the tools, NULL
// without tools. NULL if out of memory.
Fluoroscope *fluoroscope_create_beside(const Fluoroscope *first, const Pose *pose);
// Takes over the picture that `from`, of the same patient, shows; fluoroscope_draw() without pedal then shows it.
void fluoroscope_take_picture(Fluoroscope *f, const Fluoroscope *from);
void fluoroscope_destroy(Fluoroscope *fluoroscope);

typedef struct FluoroscopeFrame {
    const Pose *pose;              // the nodes of its tools are read, at most as many as the pose in the options has. NULL: no tools
    const float *filling;          // (nodes of all tools, one tool after the other, each with the number of nodes in the options' pose) fraction of contrast
                                   // agent in the whole lumen around each node, including anything inside it: 0 to 1; NULL: none
    XrayControl xray;
    const float *contrast;         // (N of the tree) concentration of contrast agent, 0 to 1; NULL: none
    uint32_t pulse;                // number of the X-ray pulse: the seed of the noise; the same pulse gives the same picture
    bool leaves_surroundings;      // the area outside the square is already cleared: saves 1 ms of CPU without a GPU
} FluoroscopeFrame;

void fluoroscope_draw(Fluoroscope *fluoroscope, const FluoroscopeFrame *frame, ViewPort port);
// The pulses of a recording up to a moment. `pulse` numbers must be those of the recording: a number that is already drawn is not drawn again.
typedef struct FluoroscopePast {
    FluoroscopeFrame last, mask;   // the last pulse; the mask's, if the memory has one
    const PulseMemory *memory;
    bool is_held;                  // the pedal is off
} FluoroscopePast;
// Draws the picture that these pulses leave, in full detail. It depends on them alone, not on what was drawn before.
void fluoroscope_recall(Fluoroscope *fluoroscope, const FluoroscopePast *past, ViewPort port, bool leaves_surroundings);
// Forgets held picture, mask and roadmap: call where other pulses begin. The next draw makes a picture even with the pedal off.
void fluoroscope_forget(Fluoroscope *fluoroscope);

typedef struct FluoroscopeState {
    bool is_held;                  // with the pedal off, the last draw showed the picture of an earlier pulse
    bool has_mask;                 // DSA: there is a mask …
    bool mask_has_moved;           // … but C-arm, table or field have moved since, so bones do not cancel
    bool has_roadmap;              // there is an opacified lumen to overlay
    bool is_out_of_beam;           // part of the vessel lies beside or behind the source at this position of C-arm and table: no contrast is drawn
    XrayControl shown;             // settings of the picture on the screen
    int square[3];                 // x, y (from the port's lower left corner), side [pixel]: the position of the picture in the port
} FluoroscopeState;
FluoroscopeState fluoroscope_state(const Fluoroscope *fluoroscope);
// Where a point of the model lies in the picture that is shown, as fractions of its side from its middle, y up. Returns the fraction of a millimetre at the
// isocentre; 0: the point is outside the picture, or there is none.
double fluoroscope_locate(const Fluoroscope *fluoroscope, Vec3 point, double at[2]);

#endif
