// The operator's controls without a window: the effect of keys, sliders, mouse and the buttons of a hand.
#include "render/operator_controls.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "../geom/near.h"
#include "../geom/random_numbers.h"

static const PanelLayout layout = {.view = {{0, 0, 0, 600, 400}, {0, 600, 0, 500, 500}, {0, 600, 400, 200, 200}}};

static OperatorControls controls_in_front(void)
{
    return (OperatorControls){.xray = xray_default_control(),
                              .patient = patient_axes_lps(),
                              .contrast_ml_s = 3,
                              .push_mm_s = 10,
                              .twist_deg_s = 120,
                              .sideways_deg_s = 25,
                              .tilt_deg_s = 25,
                              .look.camera = {.focus = {1, 2, 3},
                                              .turn = {1, 0, 0, 0},
                                              .width_mm = 100,
                                              .height_mm = 80,
                                              .home_focus = {4, 5, 6},
                                              .home_turn = {1, 0, 0, 0},
                                              .home_width_mm = 100,
                                              .home_height_mm = 80}};
}

static void obey(OperatorControls *controls, const PanelActions *actions, double seconds) { controls_obey(controls, NULL, actions, &layout, seconds); }

static void hold(OperatorControls *controls, ActionId action, double seconds, int frames)
{
    PanelActions actions = {.mouse.view = -1};
    actions.held[action] = true;
    for (int i = 0; i < frames; i++)
        obey(controls, &actions, seconds / frames);
}

static void press(OperatorControls *controls, ActionId action, int times)
{
    PanelActions actions = {.mouse.view = -1};
    actions.pressed[action] = times;
    obey(controls, &actions, 0.02);
}

static void the_c_arm_stops_at_its_limits(void **state)
{
    (void)state;
    OperatorControls controls = controls_in_front();
    hold(&controls, ACTION_LAO, 1, 50);
    double turned = (double)controls.xray.lao_deg;
    assert_true(turned > 5 && turned < 90);
    hold(&controls, ACTION_RAO, 1, 10);   // the same path back, for any frame rate
    assert_near((double)controls.xray.lao_deg, 0, 1e-4);
    hold(&controls, ACTION_LAO, 100, 100);
    assert_true(controls.xray.lao_deg == 90 && controls.xray.cra_deg == 0);
    hold(&controls, ACTION_RAO, 1000, 3);
    assert_true(controls.xray.lao_deg == -90);
    hold(&controls, ACTION_CRA, 100, 100);
    assert_true(controls.xray.cra_deg == 45);
    hold(&controls, ACTION_CAU, 100, 100);
    assert_true(controls.xray.cra_deg == -45 && controls.xray.lao_deg == -90);
    press(&controls, ACTION_AP, 1);
    assert_true(controls.xray.cra_deg == 0 && controls.xray.lao_deg == 0);
    // faster and slower; opposite keys cancel
    PanelActions both = {.mouse.view = -1};
    both.held[ACTION_LAO] = both.held[ACTION_FAST] = true;
    obey(&controls, &both, 1);
    assert_near((double)controls.xray.lao_deg, 3 * turned, 1e-3);
    both.held[ACTION_RAO] = true;
    obey(&controls, &both, 1);
    assert_near((double)controls.xray.lao_deg, 3 * turned, 1e-3);
    press(&controls, ACTION_AP, 1);
    both.held[ACTION_RAO] = both.held[ACTION_FAST] = false;
    both.held[ACTION_SLOW] = true;
    obey(&controls, &both, 1);
    assert_near((double)controls.xray.lao_deg, turned / 5, 1e-3);
}

// Projection of a point that was in the picture's middle after the table moved for a second.
static void table_moves_by(const OperatorControls *before, ActionId action, double x, double y)
{
    OperatorControls controls = *before;
    Vec3 middle = vec3((double)controls.xray.table_mm[0], (double)controls.xray.table_mm[1], (double)controls.xray.table_mm[2]);
    hold(&controls, action, 1, 20);
    CArm arm = c_arm_place(&controls.xray, &controls.patient);
    Vec3 seen = c_arm_project(&arm, middle);
    double way = hypot(seen.x, seen.y);
    assert_true(way > 0.2 && way < 1);
    assert_near(seen.x, x * way, 1e-4);
    assert_near(seen.y, y * way, 1e-4);
    assert_near(seen.z, 0, 1e-3);   // in the picture's plane
}

static void the_table_carries_the_patient_where_the_key_says(void **state)
{
    (void)state;
    Quat turn = quat_unit((Quat){0.3, -0.5, 0.7, 0.4});
    PatientAxes lps = patient_axes_lps();
    const PatientAxes patients[] = {lps,
                                    patient_axes_ras(),
                                    {quat_rotate(turn, lps.right), quat_rotate(turn, lps.anterior), quat_rotate(turn, lps.superior)},
                                    {vec3_negate(lps.right), lps.anterior, lps.superior}};   // the last one mirrored
    uint64_t seed = 1;
    for (size_t i = 0; i < sizeof patients / sizeof patients[0]; i++)
        for (int trial = 0; trial < 10; trial++) {
            OperatorControls controls = controls_in_front();
            controls.patient = patients[i];
            controls.xray.lao_deg = trial ? (float)(random_in(&seed, -90, 90)) : 0;
            controls.xray.cra_deg = trial ? (float)(random_in(&seed, -45, 45)) : 0;
            controls.xray.field_mm = (float)random_in(&seed, 40, 400);
            for (int k = 0; k < 3; k++)
                controls.xray.table_mm[k] = (float)random_in(&seed, -300, 300);
            table_moves_by(&controls, ACTION_TABLE_LEFT, -1, 0);
            table_moves_by(&controls, ACTION_TABLE_RIGHT, 1, 0);
            table_moves_by(&controls, ACTION_TABLE_UP, 0, 1);
            table_moves_by(&controls, ACTION_TABLE_DOWN, 0, -1);
        }
}

static void blades_and_field_keep_their_ranges(void **state)
{
    (void)state;
    OperatorControls controls = controls_in_front();
    hold(&controls, ACTION_SIDES_CLOSE, 0.5, 10);
    assert_true(controls.xray.collimator[0] > 0.1F && controls.xray.collimator[0] == controls.xray.collimator[1]);
    assert_true(controls.xray.collimator[2] == 0 && controls.xray.collimator[3] == 0);
    hold(&controls, ACTION_SIDES_CLOSE, 100, 1000);
    hold(&controls, ACTION_ENDS_CLOSE, 100, 2);
    for (int i = 0; i < 4; i++)
        assert_true(controls.xray.collimator[i] == 0.95F);
    hold(&controls, ACTION_ENDS_OPEN, 100, 2);
    assert_true(controls.xray.collimator[0] == 0.95F && controls.xray.collimator[2] == 0 && controls.xray.collimator[3] == 0);
    hold(&controls, ACTION_SIDES_OPEN, 100, 2);
    assert_true(controls.xray.collimator[0] == 0 && controls.xray.collimator[1] == 0);

    float before = controls.xray.field_mm;
    press(&controls, ACTION_MAGNIFY, 1);
    float once = controls.xray.field_mm;
    assert_true(once < before);
    press(&controls, ACTION_DEMAGNIFY, 1);
    assert_near((double)controls.xray.field_mm, (double)before, 1e-3);
    press(&controls, ACTION_MAGNIFY, 2);   // twice in one frame counts twice
    assert_near((double)controls.xray.field_mm, (double)once * (double)once / (double)before, 1e-3);
    press(&controls, ACTION_MAGNIFY, 100);
    assert_true(controls.xray.field_mm == 40);
    press(&controls, ACTION_DEMAGNIFY, 100);
    assert_true(controls.xray.field_mm == 400);
}

static void pulse_rates_go_round(void **state)
{
    (void)state;
    OperatorControls controls = controls_in_front();
    static const float round[] = {30, 7.5F, 10, 15, 30};   // 15 at first
    assert_true(controls.xray.pulses_s == 15);
    for (int i = 0; i < 5; i++) {
        press(&controls, ACTION_PULSES, 1);
        assert_true(controls.xray.pulses_s == round[i]);
    }
    press(&controls, ACTION_PULSES, 2);   // twice in one frame
    assert_true(controls.xray.pulses_s == 10);
    controls.xray.pulses_s = 12;   // not in the list: the next above
    press(&controls, ACTION_PULSES, 1);
    assert_true(controls.xray.pulses_s == 15);
}

static void subtraction_and_roadmap_take_masks(void **state)
{
    (void)state;
    OperatorControls controls = controls_in_front();
    press(&controls, ACTION_DSA, 1);
    assert_true(controls.xray.mode == (float)XRAY_DSA && controls.xray.mask == 1);
    press(&controls, ACTION_MASK, 2);
    assert_true(controls.xray.mode == (float)XRAY_DSA && controls.xray.mask == 3);
    press(&controls, ACTION_ROADMAP, 1);
    assert_true(controls.xray.mode == (float)XRAY_ROADMAP && controls.xray.mask == 4);
    press(&controls, ACTION_ROADMAP, 1);   // off takes none
    assert_true(controls.xray.mode == (float)XRAY_LIVE && controls.xray.mask == 4);
    press(&controls, ACTION_DSA, 1);
    press(&controls, ACTION_DSA, 1);
    assert_true(controls.xray.mode == (float)XRAY_LIVE && controls.xray.mask == 5);
}

static void pedal_and_contrast_come_from_latch_keys_and_hands(void **state)
{
    (void)state;
    OperatorControls controls = controls_in_front();
    PanelActions none = {.mouse.view = -1}, pedal = none, contrast = none;
    pedal.held[ACTION_PEDAL] = true;
    contrast.held[ACTION_CONTRAST] = true;
    XrayControl xray = controls_xray(&controls, &none, 0);
    assert_true(xray.pedal == 0 && xray.contrast_ml_s == 0);
    assert_true(controls_xray(&controls, &pedal, 0).pedal == 1 && controls_xray(&controls, &pedal, 0).contrast_ml_s == 0);
    assert_true(controls_xray(&controls, &none, HAND_PEDAL).pedal == 1);
    assert_true(controls_xray(&controls, &contrast, 0).contrast_ml_s == 3 && controls_xray(&controls, &contrast, 0).pedal == 0);
    assert_true(controls_xray(&controls, &none, 0).contrast_tool == 1);   // through the selected tool
    controls.grip.chosen = 2;
    assert_true(controls_xray(&controls, &contrast, 0).contrast_tool == 3);
    controls.contrast_ml_s = 15;
    assert_true(controls_xray(&controls, &none, HAND_CONTRAST | HAND_MARK).contrast_ml_s == 15);
    xray = controls_xray(&controls, &none, HAND_STOP | HAND_MARK);
    assert_true(xray.pedal == 0 && xray.contrast_ml_s == 0);
    press(&controls, ACTION_PEDAL_LATCH, 1);
    assert_true(controls_xray(&controls, &none, 0).pedal == 1);
    assert_true(controls_xray(&controls, &pedal, HAND_PEDAL).pedal == 1);
    press(&controls, ACTION_PEDAL_LATCH, 1);
    assert_true(controls_xray(&controls, &none, 0).pedal == 0);
    // the requested value is not kept: everything else is unchanged
    controls.xray.lao_deg = 12;
    xray = controls_xray(&controls, &pedal, HAND_CONTRAST);
    assert_true(xray.lao_deg == 12 && controls.xray.pedal == 0 && controls.xray.contrast_ml_s == 0);
}

static void a_slider_sets_what_it_shows_and_no_more(void **state)
{
    (void)state;
    // the panel shows a moment with the pedal down and contrast agent flowing; the value of a slider includes both
    OperatorControls controls = controls_in_front();
    PanelActions actions = {.mouse.view = -1, .xray_set = true};
    actions.held[ACTION_PEDAL] = actions.held[ACTION_CONTRAST] = true;
    actions.xray = controls_xray(&controls, &actions, 0);
    actions.xray.lao_deg = -33;
    actions.xray.collimator[2] = 0.5F;
    obey(&controls, &actions, 0.02);
    assert_true(controls.xray.lao_deg == -33 && controls.xray.collimator[2] == 0.5F);
    XrayControl xray = controls_xray(&controls, &actions, 0);
    assert_true(xray.pedal == 1 && xray.contrast_ml_s == 3);
    // released later: the slider keeps neither on
    PanelActions none = {.mouse.view = -1};
    xray = controls_xray(&controls, &none, 0);
    assert_true(xray.pedal == 0 && xray.contrast_ml_s == 0 && xray.lao_deg == -33);
    // nor does it release the latch, with the pedal shown as before
    actions = none;
    actions.pressed[ACTION_PEDAL_LATCH] = 1;
    actions.xray_set = true;
    actions.xray = xray;
    obey(&controls, &actions, 0.02);
    assert_true(controls_xray(&controls, &none, 0).pedal == 1);
    // keys of the same frame are added to it
    actions = none;
    actions.xray_set = true;
    actions.xray = controls.xray;
    actions.xray.field_mm = 200;
    actions.pressed[ACTION_MASK] = 1;
    actions.pressed[ACTION_DSA] = 1;
    obey(&controls, &actions, 0.02);
    assert_true(controls.xray.field_mm == 200 && controls.xray.mode == (float)XRAY_DSA && controls.xray.mask == 2);
}

static void the_tool_goes_at_three_speeds_and_stops(void **state)
{
    (void)state;
    OperatorControls controls = controls_in_front();
    PanelActions actions = {.mouse.view = -1};
    Command command = controls_command(&controls, &actions);
    assert_true(command.push_mm_s == 0 && command.twist_deg_s == 0);
    actions.held[ACTION_PUSH] = actions.held[ACTION_TWIST_LEFT] = true;
    command = controls_command(&controls, &actions);
    assert_near(command.push_mm_s, 10, 1e-12);
    assert_near(command.twist_deg_s, -120, 1e-12);
    actions.held[ACTION_FAST] = true;
    command = controls_command(&controls, &actions);
    assert_near(command.push_mm_s, 30, 1e-12);
    assert_near(command.twist_deg_s, -360, 1e-12);
    actions.held[ACTION_FAST] = false;
    actions.held[ACTION_SLOW] = true;
    assert_near(controls_command(&controls, &actions).push_mm_s, 2, 1e-12);
    actions.held[ACTION_PULL] = true;   // both directions cancel
    assert_near(controls_command(&controls, &actions).push_mm_s, 0, 0);
    actions.held[ACTION_PUSH] = false;
    assert_near(controls_command(&controls, &actions).push_mm_s, -2, 1e-12);
    actions.held[ACTION_STOP] = true;
    command = controls_command(&controls, &actions);
    assert_true(command.push_mm_s == 0 && command.twist_deg_s == 0);
}

static void the_keys_choose_lock_and_let_go(void **state)
{
    (void)state;
    OperatorControls controls = controls_in_front();
    controls.tool_count = 3;
    press(&controls, ACTION_TOOL_3, 1);
    assert_int_equal(controls.grip.chosen, 2);
    press(&controls, ACTION_TOOL_4, 1);           // there is none
    assert_int_equal(controls.grip.chosen, 2);
    press(&controls, ACTION_LOCK, 1);             // locks the innermost tool and the one around it
    assert_true(hand_grip_lead(&controls.grip, 2) == 1 && hand_grip_lead(&controls.grip, 1) == 1);
    press(&controls, ACTION_LOCK, 2);             // twice in one frame: as before
    assert_int_equal(controls.grip.locked, 4);
    press(&controls, ACTION_RELEASE, 1);
    assert_true(controls.grip.released == 4 && controls.grip.locked == 0);
    press(&controls, ACTION_TOOL_1, 1);
    assert_true(controls.grip.chosen == 0 && controls.grip.released == 4);
    // selected and locked in one frame: the newly selected one
    PanelActions actions = {.mouse.view = -1};
    actions.pressed[ACTION_TOOL_2] = actions.pressed[ACTION_LOCK] = 1;
    obey(&controls, &actions, 0.02);
    assert_true(controls.grip.chosen == 1 && controls.grip.locked == 4 && controls.grip.released == 0);
}

static void a_second_hand_moves_the_other_of_the_pair(void **state)
{
    (void)state;
    OperatorControls controls = controls_in_front();
    controls.tool_count = 2;
    PanelActions actions = {.mouse.view = -1};
    actions.held[ACTION_PULL] = actions.held[ACTION_OTHER_PUSH] = actions.held[ACTION_OTHER_TWIST_RIGHT] = actions.held[ACTION_SLOW] = true;
    Command chosen = controls_command(&controls, &actions), partner = controls_partner_command(&controls, &actions);
    assert_near(chosen.push_mm_s, -2, 1e-12);
    assert_near(chosen.twist_deg_s, 0, 0);
    assert_near(partner.push_mm_s, 2, 1e-12);
    assert_near(partner.twist_deg_s, 24, 1e-12);
    controls.tool_count = 1;                      // there is no other tool: its keys must not move the one
    partner = controls_partner_command(&controls, &actions);
    assert_true(partner.push_mm_s == 0 && partner.twist_deg_s == 0);
    controls.tool_count = 2;
    actions.held[ACTION_STOP] = true;
    partner = controls_partner_command(&controls, &actions);
    assert_true(partner.push_mm_s == 0 && partner.twist_deg_s == 0);
}

static void the_mouse_turns_the_c_arm_and_magnifies(void **state)
{
    (void)state;
    OperatorControls controls = controls_in_front();
    PanelActions actions = {.mouse = {.view = VIEW_FLUOROSCOPY, .buttons = WINDOW_MOUSE_LEFT, .drag_x = 0.2, .drag_y = -0.1}};
    obey(&controls, &actions, 0.02);
    assert_true(controls.xray.lao_deg > 5 && controls.xray.cra_deg < -2);
    for (int i = 0; i < 20; i++)
        obey(&controls, &actions, 0.02);
    assert_true(controls.xray.lao_deg == 90 && controls.xray.cra_deg == -45);
    actions.mouse = (PanelMouse){.view = VIEW_FLUOROSCOPY, .drag_x = 0.2};   // no button: no effect
    OperatorControls before = controls;
    obey(&controls, &actions, 0.02);
    assert_memory_equal(&controls.xray, &before.xray, sizeof controls.xray);
    actions.mouse = (PanelMouse){.view = VIEW_FLUOROSCOPY, .scroll = 1};
    obey(&controls, &actions, 0.02);
    assert_true(controls.xray.field_mm < before.xray.field_mm && controls.xray.lao_deg == 90);
    actions.mouse.scroll = 1000;
    obey(&controls, &actions, 0.02);
    assert_true(controls.xray.field_mm == 40);
    actions.mouse.scroll = -1000;
    obey(&controls, &actions, 0.02);
    assert_true(controls.xray.field_mm == 400);
    // other views do not affect the X-ray system
    static const int others[] = {VIEW_3D, VIEW_ANGIOSCOPY, -1, VIEW_COUNT, 99};
    for (size_t i = 0; i < sizeof others / sizeof others[0]; i++) {
        before = controls;
        actions.mouse = (PanelMouse){.view = others[i], .buttons = WINDOW_MOUSE_LEFT, .drag_x = 0.1, .scroll = 1, .x = 0.5, .y = 0.5};
        obey(&controls, &actions, 0.02);
        assert_memory_equal(&controls.xray, &before.xray, sizeof controls.xray);
    }
}

static void the_mouse_moves_the_free_camera(void **state)
{
    (void)state;
    // a drag to the right by a tenth of the view's height moves the scene to the right by as much
    OperatorControls controls = controls_in_front();
    const ViewPort *port = &layout.view[VIEW_3D];
    Camera view = free_camera_projection(&controls.look.camera, port->width, port->height, 1);
    Vec3 point = controls.look.camera.focus, at = camera_project(&view, point);
    PanelActions actions = {.mouse = {.view = VIEW_3D, .buttons = WINDOW_MOUSE_RIGHT, .drag_x = 0.1, .drag_y = 0.04}};
    obey(&controls, &actions, 0.02);
    view = free_camera_projection(&controls.look.camera, port->width, port->height, 1);
    Vec3 moved = vec3_sub(camera_project(&view, point), at);
    assert_near(moved.x, 0.1 * port->height, 1e-6);
    assert_near(moved.y, -0.04 * port->height, 1e-6);   // pixels count downwards, the drag upwards
    // the point under the mouse stays there while zooming
    actions.mouse = (PanelMouse){.view = VIEW_3D, .x = 0.8, .y = 0.3, .scroll = 2};
    Camera before = view;
    double right_mm = 0.3 * port->width * before.mm_per_pixel, up_mm = -0.2 * port->height * before.mm_per_pixel;
    Vec3 under = vec3_add_scaled(vec3_add_scaled(before.center, right_mm, before.right), up_mm, before.up);
    obey(&controls, &actions, 0.02);
    view = free_camera_projection(&controls.look.camera, port->width, port->height, 1);
    assert_true(view.mm_per_pixel < before.mm_per_pixel);
    at = camera_project(&view, under);
    assert_near(at.x, 0.8 * port->width, 1e-6);
    assert_near(at.y, 0.7 * port->height, 1e-6);
    // rotated about its focus, and back to the home view
    actions.mouse = (PanelMouse){.view = VIEW_3D, .buttons = WINDOW_MOUSE_LEFT, .drag_x = 0.1};
    Vec3 focus = controls.look.camera.focus;
    obey(&controls, &actions, 0.02);
    assert_near(vec3_distance(focus, controls.look.camera.focus), 0, 1e-12);
    assert_true(fabs(controls.look.camera.turn.w) < 1 - 1e-6);
    press(&controls, ACTION_CAMERA_RESET, 1);
    assert_near(vec3_distance(controls.look.camera.focus, vec3(4, 5, 6)), 0, 0);
    assert_near(controls.look.camera.width_mm, 100, 0);
}

static void keys_choose_what_is_seen(void **state)
{
    (void)state;
    OperatorControls controls = controls_in_front();
    press(&controls, ACTION_VIEW_3D, 1);
    assert_int_equal(controls.view, VIEW_3D);
    press(&controls, ACTION_VIEW_ALL, 1);
    assert_int_equal(controls.view, VIEW_ALL);
    press(&controls, ACTION_VIEW_ANGIOSCOPY, 1);
    assert_int_equal(controls.view, VIEW_ANGIOSCOPY);
    press(&controls, ACTION_SECTION, 1);
    press(&controls, ACTION_MODEL, 1);
    press(&controls, ACTION_ARROWS, 3);
    assert_true(controls.look.section && controls.look.show_model && controls.look.show_arrows && !controls.look.section_at_tip);
    press(&controls, ACTION_CAMERA_FOLLOW, 1);
    assert_true(controls.look.follow_tip && controls.look.section_at_tip);
    hold(&controls, ACTION_SECTION_NEARER, 1, 10);
    assert_true(controls.look.section_offset_mm > 1);
    hold(&controls, ACTION_SECTION_FARTHER, 1, 3);
    assert_near(controls.look.section_offset_mm, 0, 1e-9);
    double width = controls.look.camera.width_mm;
    hold(&controls, ACTION_CAMERA_NEARER, 0.5, 10);
    assert_true(controls.look.camera.width_mm < width);
}

static void the_wheel_magnifies_towards_the_pointer(void **state)
{
    (void)state;
    OperatorControls controls = controls_in_front();
    controls.xray.lao_deg = 30;
    controls.xray.cra_deg = 20;
    // the view is 600 x 400: the pointer is at a quarter of the square's side to the right of its middle and an eighth above
    PanelActions actions = {.mouse = {.view = VIEW_FLUOROSCOPY, .x = 0.5 + 100 / 600.0, .y = 0.625, .scroll = 2}};
    CArm arm = c_arm_place(&controls.xray, &controls.patient);
    Vec3 under = vec3_add_scaled(vec3_add_scaled(arm.isocentre, 0.25 * arm.field_mm, arm.right), 0.125 * arm.field_mm, arm.up);
    obey(&controls, &actions, 0.02);
    CArm after = c_arm_place(&controls.xray, &controls.patient);
    assert_near(after.field_mm, arm.field_mm / 1.25, 1e-4);
    Vec3 at = c_arm_project(&after, under);
    assert_near(at.x, 0.25, 1e-5);
    assert_near(at.y, 0.125, 1e-5);
    actions.mouse.scroll = -2;               // and back
    obey(&controls, &actions, 0.02);
    assert_near(vec3_distance(c_arm_place(&controls.xray, &controls.patient).isocentre, arm.isocentre), 0, 1e-4);
}

static void positions_are_stored_and_found_again(void **state)
{
    (void)state;
    OperatorControls controls = controls_in_front();
    press(&controls, ACTION_RECALL, 1);      // nothing is stored
    assert_true(controls.xray.lao_deg == 0);
    press(&controls, ACTION_LATERAL, 1);
    assert_true(controls.xray.lao_deg == 90 && controls.xray.cra_deg == 0);
    press(&controls, ACTION_STORE, 1);
    press(&controls, ACTION_AP, 1);
    controls.xray.field_mm = 100;
    controls.xray.table_mm[1] = 7;
    press(&controls, ACTION_STORE, 1);
    press(&controls, ACTION_RECALL, 1);
    assert_true(controls.xray.lao_deg == 90 && controls.xray.field_mm == 160 && controls.xray.table_mm[1] == 0);
    press(&controls, ACTION_RECALL, 1);
    assert_true(controls.xray.lao_deg == 0 && controls.xray.field_mm == 100 && controls.xray.table_mm[1] == 7);
    for (int i = 0; i < STORED_POSITIONS; i++) {     // the oldest are replaced
        controls.xray.lao_deg = (float)i;
        press(&controls, ACTION_STORE, 1);
    }
    assert_int_equal(controls.stored_count, STORED_POSITIONS);
    bool found[STORED_POSITIONS] = {false};
    for (int i = 0; i < STORED_POSITIONS; i++) {
        press(&controls, ACTION_RECALL, 1);
        found[(int)controls.xray.lao_deg] = true;
    }
    for (int i = 0; i < STORED_POSITIONS; i++)
        assert_true(found[i]);
}

static void a_second_image_has_its_place(void **state)
{
    (void)state;
    OperatorControls controls = controls_in_front();
    press(&controls, ACTION_BIPLANE, 1);
    assert_int_equal(controls.second, SECOND_PLANE);
    press(&controls, ACTION_REFERENCE, 1);
    assert_int_equal(controls.second, SECOND_REFERENCE);
    press(&controls, ACTION_REFERENCE, 1);
    assert_int_equal(controls.second, SECOND_NONE);
    for (int lao = -90; lao <= 90; lao += 15) {      // perpendicular to the first plane, within the C-arm's range
        controls.xray.lao_deg = (float)lao;
        XrayControl second = xray_second_plane(&controls.xray);
        CArm a = c_arm_place(&controls.xray, &controls.patient), b = c_arm_place(&second, &controls.patient);
        assert_near(vec3_dot(a.towards, b.towards), 0, 1e-6);
        assert_true(second.lao_deg >= -90 && second.lao_deg <= 90);
    }
    for (int k = 0; k < 4; k++) {
        PanelLayout beside = k == 3 ? panel_layout_xray_alone(1280, 720, 1, true) : panel_layout(1280, 720, 1, k == 1 ? VIEW_ALL : VIEW_FLUOROSCOPY, k < 2);
        panel_layout_add_second(&beside, 720);
        const PanelRect *first = &beside.view_rect[VIEW_FLUOROSCOPY], *at = &beside.second_rect;
        assert_true(at->width > 250 && at->height > 250);
        assert_true(at->x >= first->x + first->width || at->y >= first->y + first->height);
        assert_true(at->x + at->width <= 1280 && at->y + at->height <= 720);
        assert_true(beside.right.width <= 0 || at->y + at->height <= beside.right.y || at->x + at->width <= beside.right.x);
        assert_int_equal(beside.second.y, 720 - (int)(at->y + at->height));
        assert_true(beside.view[VIEW_3D].width == 0 && beside.view[VIEW_ANGIOSCOPY].width == 0);
    }
    PanelLayout other = panel_layout(1280, 720, 1, VIEW_3D, true);
    panel_layout_add_second(&other, 720);
    assert_int_equal(other.second.width, 0);
}

// The axes of the 3D view, right, up and towards the eye, are those of the X-ray image.
static void expect_view_of_arm(const OperatorControls *controls)
{
    CArm arm = c_arm_place(&controls->xray, &controls->patient);
    Camera view = free_camera_projection(&controls->look.camera, 100, 100, 1);
    assert_near(vec3_distance(view.right, arm.right), 0, 1e-9);
    assert_near(vec3_distance(view.up, arm.up), 0, 1e-9);
    assert_near(vec3_distance(view.back, arm.towards), 0, 1e-9);
}

static void the_3d_view_starts_and_turns_with_the_c_arm(void **state)
{
    (void)state;
    OperatorControls controls = controls_in_front();
    controls.xray.lao_deg = -25;
    controls.look.camera.high = vec3(10, 20, 30);
    controls_look_from_arm(&controls);
    expect_view_of_arm(&controls);
    hold(&controls, ACTION_LAO, 1, 10);
    Camera still = free_camera_projection(&controls.look.camera, 100, 100, 1);
    press(&controls, ACTION_CAMERA_C_ARM, 1);
    hold(&controls, ACTION_CRA, 1, 10);
    expect_view_of_arm(&controls);
    assert_true(vec3_distance(free_camera_projection(&controls.look.camera, 100, 100, 1).back, still.back) > 0.1);
    hold(&controls, ACTION_ORBIT_LEFT, 0.1, 1);      // the hand on the camera ends it
    assert_false(controls.follows_arm);
    press(&controls, ACTION_CAMERA_RESET, 1);
    controls.xray.lao_deg = -25;
    controls.xray.cra_deg = 0;
    expect_view_of_arm(&controls);           // front is as the C-arm stood at the start
}

// A tip is in the open field until a blade, the table or the magnification takes it out; views count only if they have a place.
static void what_a_window_shows_is_noted(void **state)
{
    (void)state;
    OperatorControls controls = controls_in_front();
    Pose *pose = pose_create(4, 1, &(int){4});
    assert_non_null(pose);
    pose->tool[0].node_count = 4;
    pose->tool[0].node[3].position = vec3(-30, 0, 0);        // in the left half of the image, on the patient's right
    PanelLayout alone = layout;
    alone.view[VIEW_3D].width = alone.view[VIEW_ANGIOSCOPY].width = 0;
    XrayControl before = controls.xray, xray = controls.xray;
    controls_note_sight(&controls, &alone, pose, true, &before, &xray);
    assert_near(xray.seen, SEEN_KNOWN | SEEN_XRAY | SEEN_TIP, 0);
    assert_near(xray.looks, 0, 0);
    controls.second = SECOND_PLANE;
    controls_note_sight(&controls, &alone, pose, true, &before, &xray);
    assert_near(xray.seen, SEEN_KNOWN | SEEN_XRAY | SEEN_TIP | SEEN_BIPLANE, 0);
    controls.second = SECOND_REFERENCE;          // a held image costs no dose
    controls_note_sight(&controls, &alone, pose, true, &before, &xray);
    assert_near(xray.seen, SEEN_KNOWN | SEEN_XRAY | SEEN_TIP, 0);
    controls.second = SECOND_NONE;
    controls_note_sight(&controls, &alone, pose, false, &before, &xray);        // a cine loop
    assert_near(xray.seen, SEEN_KNOWN | SEEN_TIP, 0);
    controls_note_sight(&controls, &alone, NULL, true, &before, &xray);
    assert_near(xray.seen, SEEN_KNOWN | SEEN_XRAY, 0);
    xray.collimator[0] = 0.7F;   // left blade: from -80 to -24 mm
    controls_note_sight(&controls, &alone, pose, true, &before, &xray);
    assert_near(xray.seen, SEEN_KNOWN | SEEN_XRAY, 0);
    xray.collimator[0] = 0.5F;
    xray.collimator[1] = xray.collimator[2] = xray.collimator[3] = 0.9F;
    controls_note_sight(&controls, &alone, pose, true, &before, &xray);
    assert_near(xray.seen, SEEN_KNOWN | SEEN_XRAY | SEEN_TIP, 0);
    xray.field_mm = 50;
    controls_note_sight(&controls, &alone, pose, true, &before, &xray);
    assert_near(xray.seen, SEEN_KNOWN | SEEN_XRAY, 0);
    // a view that comes into sight is a look, one that stays is none
    controls_note_sight(&controls, &layout, NULL, true, &before, &xray);
    assert_near(xray.seen, SEEN_KNOWN | SEEN_XRAY | SEEN_3D | SEEN_ANGIOSCOPY, 0);
    assert_near(xray.looks, 1, 0);
    before = xray;
    controls_note_sight(&controls, &layout, NULL, true, &before, &xray);
    assert_near(xray.looks, 1, 0);
    pose_free(pose);
}

static void an_examination_refuses_the_keys_of_hidden_views(void **state)
{
    (void)state;
    OperatorControls controls = controls_in_front();
    for (int examined = 0; examined < 2; examined++) {
        PanelActions actions = {.mouse.view = -1};
        controls.is_examination = examined;
        actions.held[ACTION_ORBIT_LEFT] = actions.held[ACTION_PUSH] = true;
        actions.pressed[ACTION_VIEW_FLUOROSCOPY] = 1;
        assert_false(controls_refuse_hidden(&controls, &actions));
        actions.pressed[ACTION_VIEW_3D] = 1;
        assert_int_equal(controls_refuse_hidden(&controls, &actions), examined);
        assert_true(actions.held[ACTION_PUSH] && actions.pressed[ACTION_VIEW_FLUOROSCOPY] == 1);
        assert_int_equal(actions.held[ACTION_ORBIT_LEFT], !examined);
        assert_int_equal(actions.pressed[ACTION_VIEW_3D], !examined);
    }
}

// The user's settings: factors of the speeds of all controls created afterwards; negative ones invert.
static void speeds_and_inverted_axes_of_the_user_apply(void **unused)
{
    (void)unused;
    const OperatorSpeeds usual = controls_speeds();
    OperatorControls before = controls_in_front(), controls = before;
    controls_take_speeds(&before);
    controls_use_speeds(&(OperatorSpeeds){0.5, -2, -1, 3});
    controls_take_speeds(&controls);
    PanelActions actions = {.mouse.view = -1};
    actions.held[ACTION_PUSH] = actions.held[ACTION_TWIST_RIGHT] = actions.held[ACTION_LAO] = actions.held[ACTION_CRA] = true;
    Command command = controls_command(&controls, &actions), usual_command = controls_command(&before, &actions);
    assert_true(command.push_mm_s == 0.5 * usual_command.push_mm_s && command.twist_deg_s == -2 * usual_command.twist_deg_s);
    obey(&controls, &actions, 0.1);
    obey(&before, &actions, 0.1);
    assert_true(before.xray.lao_deg > 0 && controls.xray.lao_deg == -before.xray.lao_deg);
    assert_true(fabs((double)controls.xray.cra_deg - 3 * (double)before.xray.cra_deg) < 1e-4);      // floats
    controls_use_speeds(&usual);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(the_c_arm_stops_at_its_limits),
                                       cmocka_unit_test(speeds_and_inverted_axes_of_the_user_apply),
                                       cmocka_unit_test(the_table_carries_the_patient_where_the_key_says),
                                       cmocka_unit_test(blades_and_field_keep_their_ranges),
                                       cmocka_unit_test(pulse_rates_go_round),
                                       cmocka_unit_test(subtraction_and_roadmap_take_masks),
                                       cmocka_unit_test(pedal_and_contrast_come_from_latch_keys_and_hands),
                                       cmocka_unit_test(a_slider_sets_what_it_shows_and_no_more),
                                       cmocka_unit_test(the_tool_goes_at_three_speeds_and_stops),
                                       cmocka_unit_test(the_keys_choose_lock_and_let_go),
                                       cmocka_unit_test(a_second_hand_moves_the_other_of_the_pair),
                                       cmocka_unit_test(the_mouse_turns_the_c_arm_and_magnifies),
                                       cmocka_unit_test(the_mouse_moves_the_free_camera),
                                       cmocka_unit_test(keys_choose_what_is_seen),
                                       cmocka_unit_test(the_wheel_magnifies_towards_the_pointer),
                                       cmocka_unit_test(positions_are_stored_and_found_again),
                                       cmocka_unit_test(a_second_image_has_its_place),
                                       cmocka_unit_test(the_3d_view_starts_and_turns_with_the_c_arm),
                                       cmocka_unit_test(what_a_window_shows_is_noted),
                                       cmocka_unit_test(an_examination_refuses_the_keys_of_hidden_views)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
