// The operator's controls: how keys, buttons and mouse change the speed of the tool, the X-ray system and the views. No window, no GL, no clock.
#ifndef SELDINGER_RENDER_OPERATOR_CONTROLS_H
#define SELDINGER_RENDER_OPERATOR_CONTROLS_H

#include "input/input.h"
#include "render/panel.h"
#include "render/vessel_scene.h"
#include "sim/sim.h"

enum { STORED_POSITIONS = 4 };
typedef struct StoredPosition {  // of the X-ray system
    float lao_deg, cra_deg, field_mm, table_mm[3];
} StoredPosition;

typedef struct OperatorControls {
    XrayControl xray;            // pedal and contrast from keys and panel; controls_xray adds the buttons of input devices
    PatientAxes patient;         // in the model's frame
    SecondImage second;
    bool pedal_latched;
    PanelView view;
    bool is_examination;         // only the X-ray image is shown
    VesselSceneLook look;        // settings of the 3D view
    bool follows_arm;            // its camera turns with the C-arm
    int stored_count, stored_next, recalled; // number stored so far; the place of the next one; the last place stored or returned to
    StoredPosition stored[STORED_POSITIONS];
    double contrast_ml_s;        // during injection, default 3
    double push_mm_s, twist_deg_s;   // of the keys at normal speed, 10 and 120 times OperatorSpeeds
    double sideways_deg_s, tilt_deg_s;   // of the C-arm, 25 times OperatorSpeeds
    int tool_count;
    HandGrip grip;               // the selected tool, and the locked and released ones
} OperatorControls;

// Factors of the usual speeds; a negative one inverts the axis.
typedef struct OperatorSpeeds {
    double push, twist, sideways, tilt;
} OperatorSpeeds;
// Of all controls created afterwards in this process; default 1. Call before a window opens, or from the thread of the windows.
void controls_use_speeds(const OperatorSpeeds *speeds);
OperatorSpeeds controls_speeds(void);
void controls_take_speeds(OperatorControls *controls);   // sets its four speeds; controls_create does

// Sets the isocentre to the middle of `points`, and the field so that they are visible.
OperatorControls controls_create(const VesselScene *scene, int tool_count, int count, const Vec3 *point);
// Turns the camera of the 3D view as the C-arm stands, and makes that its home.
void controls_look_from_arm(OperatorControls *controls);

// In an examination, takes the actions for hidden views out of `actions`. Returns whether there was one.
bool controls_refuse_hidden(const OperatorControls *controls, PanelActions *actions);
// One frame of `seconds`: applies held and pressed actions. `layout`: positions of the views, for the mouse.
void controls_obey(OperatorControls *controls, const VesselScene *scene, const PanelActions *actions, const PanelLayout *layout, double seconds);
// The speeds that held keys request for the selected tool and its partner (0 if there is none): fast is three times and slow a fifth of the normal speed.
Command controls_command(const OperatorControls *controls, const PanelActions *actions);
Command controls_partner_command(const OperatorControls *controls, const PanelActions *actions);
// The X-ray controls including input devices (HAND_ bits) and held keys: pedal, contrast through the selected tool.
XrayControl controls_xray(const OperatorControls *controls, const PanelActions *actions, unsigned hand_buttons);
// Records in `xray` what a window shows (XrayControl.seen) and counts looks at the 3D view and angioscopy; `before`: the controls of the last frame. `pose` NULL:
// none yet. `is_live`: the X-ray view shows the live image, not a cine loop.
void controls_note_sight(const OperatorControls *controls, const PanelLayout *layout, const Pose *pose, bool is_live, const XrayControl *before,
                         XrayControl *xray);

#endif
