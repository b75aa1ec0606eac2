// The operator's desk: what keys, buttons and mouse of the panel do to the tool's speed, the X-ray system and the views. Pure: no window, no GL, no clock.
#ifndef SELDINGER_RENDER_DESK_H
#define SELDINGER_RENDER_DESK_H

#include "input/input.h"
#include "render/c_arm.h"
#include "render/panel.h"
#include "render/vessel_scene.h"
#include "sim/hand_grip.h"

typedef struct Desk {
    XrayControl xray;            // pedal and contrast as the desk's own; a hand's buttons are added by desk_xray
    PatientAxes patient;         // in the model's frame
    bool pedal_latched;
    PanelView view;
    VesselSceneLook look;        // of the 3D view
    double contrast_ml_s;        // while injected, default 3
    double push_mm_s, twist_deg_s;   // of the keys at ordinary speed, default 10 and 120
    int tool_count;
    HandGrip grip;               // the keys' choice: which tool, which are locked or let go
} Desk;

// Isocentre in the middle of `points` (what is to be seen), the field around them.
Desk desk_create(const VesselScene *scene, int tool_count, int count, const Vec3 *point);

// One frame of `seconds`: obeys what is held and pressed. `layout`: where the mouse's views are.
void desk_obey(Desk *desk, const VesselScene *scene, const PanelActions *actions, const PanelLayout *layout, double seconds);
// What the held keys ask of the chosen tool, and of its partner (0 where there is none): fast is 3 times, slow a fifth of the ordinary speed.
Command desk_command(const Desk *desk, const PanelActions *actions);
Command desk_partner_command(const Desk *desk, const PanelActions *actions);
// The controls with what hands (HAND_ bits) and held keys add for now: pedal, contrast through the chosen tool.
XrayControl desk_xray(const Desk *desk, const PanelActions *actions, unsigned hand_buttons);

#endif
