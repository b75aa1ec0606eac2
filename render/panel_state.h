// Input and output of the trainer's panels: the data that they show, and the user's actions. Plain data.
#ifndef SELDINGER_RENDER_PANEL_STATE_H
#define SELDINGER_RENDER_PANEL_STATE_H

#include "input/input.h"
#include "render/key_table.h"
#include "render/panel_layout.h"
#include "sim/sim.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef enum { PANEL_LIVE, PANEL_LIH, PANEL_DSA, PANEL_ROADMAP, PANEL_CINE } PanelMode;   // LIH: last image hold
typedef enum { MARK_NONE, MARK_GOOD, MARK_WARNING, MARK_BAD } PanelMark;                  // shown by a sign and a colour

typedef enum { SECOND_NONE, SECOND_REFERENCE, SECOND_PLANE } SecondImage;                 // a second X-ray image: a held one, or that of a second detector

enum { PANEL_TOOLS = 4 };
enum { WARN_OUTSIDE = 1, WARN_NOT_CONVERGED = 2, WARN_SLOW = 4, WARN_NO_FIFO = 8, WARN_DEVICE_LOST = 16, WARN_STALLED = 32 }; // bits of `warnings`

typedef struct PanelFigure {       // one line of the score or of the exercise
    const char *label;
    double value;                  // NaN: not known yet, shown as a dash
    const char *unit;              // "s", "ml", "" …
    int decimals;
    PanelMark mark;
} PanelFigure;

typedef struct PanelTool {         // one of the coaxial tools
    const char *name;              // one word, if there are several tools
    const char *what;              // "catheter 0.70 mm x 160 mm"
    Color color;                   // as in the 3D view
    double inserted_mm, turned_deg, push_mm_s, twist_deg_s;
    double force_n, torque_n_mm;   // speed of its hand, friction of the sheath, force on it
    PanelMark mark;                // of the note
    const char *note;              // "released" …, or NULL
} PanelTool;

typedef struct PanelDevice {
    const char *name;
    HandState state;
    const char *note;              // its state or problem; may be NULL
} PanelDevice;

typedef struct PanelLabel {        // a label in the 3D view; pixels from the view's upper left corner
    double x, y, radius;           // its centre, and the radius of the object drawn there
    const char *text;
} PanelLabel;

// Where a consequence happened.
typedef struct PanelSpot {
    const char *text;
    bool is_in_xray, is_in_3d;
    double xray[2];                // in the X-ray image, as fractions of its side from its middle, y up …
    double blot;                   // … with the radius of the contrast agent that has leaked there
    double space[2];               // in the 3D view, pixels from its upper left corner
} PanelSpot;

// A device on the tray: one of the scene, or one that may be added to it.
enum { TRAY_POINTS = 160, TRAY_STEPS = 64 };
typedef struct PanelTrayDevice {
    const char *name;
    const char *what;              // kind, diameters, length
    const char *note;              // why it cannot be inserted, or NULL
    const char *remark;            // an additional note, or NULL
    bool is_in;                    // it is inserted now
    int point_count;
    double point[TRAY_POINTS][2];  // [mm] (x, y) of its distal part in its unloaded shape, the tip last; y up
    int step_count;
    double end_mm[TRAY_STEPS];     // ascending: the end of each stretch, from the proximal end
    double bending_n_mm2[TRAY_STEPS];   // of each stretch
    bool can_be_shaped;            // a wire whose core can be bent permanently
} PanelTrayDevice;

typedef struct PanelTray {         // the devices of the selected tool, while the tray is open
    const char *tool;
    const char *note;              // what to do before a device can be inserted, or NULL
    int device_count;
    const PanelTrayDevice *device; // (device_count)
    const PanelTrayDevice *shaped; // the selected device with its tip shaped as in PanelActions.tray, or NULL; its note says why if it cannot keep that shape
} PanelTray;

// The data shown. Strings are borrowed for the call; NULL is an empty string. NaN is shown as a dash.
typedef struct PanelState {
    double now_s;                  // wall clock of the session, for messages and hints
    double time_s;                 // simulated
    bool is_paused;
    bool is_examination;           // only the X-ray image is shown
    // exercise
    const char *title;
    const char *instructions;      // its first line is always shown, the whole text in a box at the start and on request
    HintKind hint;                 // what is happening, shown instead of a hint about the keys …
    double hint_value;             // … and its value
    const Guide *guide;            // steps of a guided exercise, or NULL …
    int steps_done;                // … and how many are done
    const char *trainee;
    const char *target;            // name of the target to reach now
    double hold_s, hold_needed_s;  // progress of holding the target; hold_needed_s 0: no target
    bool is_finished;              // the exercise is over; `instructions` holds the result
    int figure_count, error_count;
    const PanelFigure *figure;     // (figure_count) score so far
    const char *const *error;      // (error_count) handling errors so far, newest last
    // tools
    int tool_count, chosen_tool;   // outermost first; the one shown with all its figures
    PanelTool tool[PANEL_TOOLS];
    bool is_pair_locked, is_released; // the selected tool and its partner; the selected tool
    const PanelTray *tray;         // NULL: closed, or not known yet
    double wall_max_n, wall_sum_n; // over all tools
    // X-ray
    XrayControl xray;
    SecondImage second;
    XrayControl second_xray;       // with which it was taken
    PanelMode mode;
    bool is_pedal_latched, is_roadmap_ready, is_recording_cine;
    double fluoro_s, contrast_ml;
    double tube_kv, tube_ma, kerma_rate_mgy_min;   // of the last pulse (kv 0: none yet); the rate, of both planes, is 0 while the pedal is up
    double kerma_mgy, kerma_area_gy_cm2;
    double second_kv, second_ma;   // of the second plane's tube; 0: it is off
    double second_kerma_mgy, second_kerma_area_gy_cm2;     // its part of the dose
    int cine_frame, cine_frames;
    // views
    PanelView view;
    bool is_following, is_following_arm, has_section, has_model, has_arrows;
    int label_count;
    const PanelLabel *label;       // (label_count) of the 3D view
    bool has_way;                  // the tip and the target to reach are in that view, at these pixels from its upper left corner
    double tip[2], goal[2];
    int spot_count;
    PanelSpot spot[SCORE_MARKS_MOST];
    double bar_mm, bar_pixels;     // its scale bar; 0: none
    double force_full_scale_n;     // top of its colours; 0: no legend
    // machine
    double step_median_us, step_p999_us, real_time_factor, frame_ms;
    int drawn_side, shown_side;    // [pixel] of the X-ray image; 0: not known
    int64_t missed_deadlines;
    unsigned warnings;             // WARN_ bits
    const char *warning;           // one more warning line, or NULL
    int device_count;
    const PanelDevice *device;
} PanelState;

// Mouse input in a view (a drag belongs to the view where it began).
typedef struct PanelMouse {
    int view;                      // PanelView, or -1 outside all
    double x, y;                   // [0, 1] in the view, y up
    double drag_x, drag_y;         // since the last frame, as fractions of the view's height, y up
    unsigned buttons;              // WINDOW_MOUSE_ bits of a press that began in the view
    double scroll;
} PanelMouse;

// The user's choice in the tray, while it is open.
typedef struct PanelTrayChoice {
    bool is_open;
    int device;                    // index in PanelTray.device
    bool is_shaped;                // with a shaped tip: distance of the bend from the tip, remaining angle, radius of the mandrel
    double length_mm, angle_deg, mandrel_mm;
    bool is_taken;                 // in this frame: insert it
} PanelTrayChoice;

typedef struct PanelActions {
    bool held[ACTION_COUNT];       // by key or by the mouse on a button
    int pressed[ACTION_COUNT];     // times since the last frame. RESTART and QUIT only when confirmed; SIGINT, SIGTERM: QUIT at once
    bool xray_set;                 // a slider was moved: `xray` is that of the state with the new value
    XrayControl xray;
    bool trainee_set;
    char trainee[64];              // UTF-8, printable, no control characters, trimmed
    PanelMouse mouse;
    PanelTrayChoice tray;
    int answer;                    // to panel_ask(): 1 yes, -1 no, 0 none in this frame
} PanelActions;

// The texts belong to the caller and must live until the question is answered.
typedef struct PanelQuestion {
    const char *title, *text, *yes, *no;
} PanelQuestion;

#endif
