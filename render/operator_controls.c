#include "render/operator_controls.h"

// Speeds of changes while a key is held.
static const double arm_deg_s = 25, table_fields_s = 0.4, blade_s = 0.5, orbit_px_s = 220, section_mm_s = 15;
static const float pulse_rates[] = {7.5F, 10, 15, 30};
static const double field_step = 1.25;

static OperatorSpeeds speeds_in_force = {1, 1, 1, 1};

void controls_use_speeds(const OperatorSpeeds *speeds) { speeds_in_force = *speeds; }

OperatorSpeeds controls_speeds(void) { return speeds_in_force; }

void controls_take_speeds(OperatorControls *controls)
{
    controls->push_mm_s = 10 * speeds_in_force.push;
    controls->twist_deg_s = 120 * speeds_in_force.twist;
    controls->sideways_deg_s = arm_deg_s * speeds_in_force.sideways;
    controls->tilt_deg_s = arm_deg_s * speeds_in_force.tilt;
}

static float clamped(double value, double least, double most) { return (float)fmax(least, fmin(most, value)); }

OperatorControls controls_create(const VesselScene *scene, int tool_count, int count, const Vec3 *point)
{
    OperatorControls controls = {.xray = xray_default_control(),
                                 .contrast_ml_s = 3,
                                 .view = VIEW_FLUOROSCOPY,
                                 .look = vessel_scene_default_look(scene),
                                 .patient = patient_axes_lps(),
                                 .tool_count = tool_count};
    controls_take_speeds(&controls);
    Vec3 low = vec3(0, 0, 0), high = low;
    for (int i = 0; i < count; i++)
        for (int k = 0; k < 3; k++) {
            double x = (&point[i].x)[k];
            (&low.x)[k] = i ? fmin((&low.x)[k], x) : x;
            (&high.x)[k] = i ? fmax((&high.x)[k], x) : x;
        }
    for (int k = 0; k < 3; k++)
        controls.xray.table_mm[k] = (float)(((&low.x)[k] + (&high.x)[k]) / 2);
    // the largest extent with a margin, so that the points are in the field for every angle of the C-arm
    controls.xray.field_mm = clamped(1.15 * vec3_distance(low, high), 40, 400);
    return controls;
}

void controls_look_from_arm(OperatorControls *controls)
{
    const CArm arm = c_arm_place(&controls->xray, &controls->patient);
    free_camera_look_along(&controls->look.camera, vec3_negate(arm.towards), arm.up);
    free_camera_set_home(&controls->look.camera);
}

static double held(const PanelActions *actions, ActionId more, ActionId less) { return (double)actions->held[more] - (double)actions->held[less]; }

static void obey_sliders(XrayControl *xray, const PanelActions *actions)
{
    float pedal = xray->pedal, contrast = xray->contrast_ml_s;   // these two apply only while held
    *xray = actions->xray;
    xray->pedal = pedal;
    xray->contrast_ml_s = contrast;
}

static void obey_arm(OperatorControls *controls, const PanelActions *actions, double seconds)
{
    XrayControl *xray = &controls->xray;
    double time = seconds * (actions->held[ACTION_SLOW] ? 0.2 : actions->held[ACTION_FAST] ? 3 : 1);
    xray->lao_deg = clamped((double)xray->lao_deg + controls->sideways_deg_s * time * held(actions, ACTION_LAO, ACTION_RAO), -90, 90);
    xray->cra_deg = clamped((double)xray->cra_deg + controls->tilt_deg_s * time * held(actions, ACTION_CRA, ACTION_CAU), -45, 45);
    if (actions->pressed[ACTION_AP])
        xray->lao_deg = xray->cra_deg = 0;
    if (actions->pressed[ACTION_LATERAL]) {
        xray->lao_deg = 90;
        xray->cra_deg = 0;
    }
    // the patient moves in the direction of the key, so the isocentre moves in the opposite direction
    CArm arm = c_arm_place(xray, &controls->patient);
    double distance = table_fields_s * (double)xray->field_mm * seconds;
    Vec3 moved = vec3_add(vec3_scale(arm.right, distance * held(actions, ACTION_TABLE_LEFT, ACTION_TABLE_RIGHT)),
                          vec3_scale(arm.up, distance * held(actions, ACTION_TABLE_DOWN, ACTION_TABLE_UP)));
    for (int k = 0; k < 3; k++)
        xray->table_mm[k] += (float)(&moved.x)[k];
    double sides = blade_s * seconds * held(actions, ACTION_SIDES_CLOSE, ACTION_SIDES_OPEN);
    double ends = blade_s * seconds * held(actions, ACTION_ENDS_CLOSE, ACTION_ENDS_OPEN);
    for (int i = 0; i < 4; i++)
        xray->collimator[i] = clamped((double)xray->collimator[i] + (i < 2 ? sides : ends), 0, 0.95);
}

static void obey_stored(OperatorControls *controls, const PanelActions *actions)
{
    XrayControl *xray = &controls->xray;
    for (int i = 0; i < actions->pressed[ACTION_STORE]; i++) {
        controls->recalled = controls->stored_next;
        controls->stored[controls->recalled] =
            (StoredPosition){xray->lao_deg, xray->cra_deg, xray->field_mm, {xray->table_mm[0], xray->table_mm[1], xray->table_mm[2]}};
        controls->stored_next = (controls->stored_next + 1) % STORED_POSITIONS;
        controls->stored_count += controls->stored_count < STORED_POSITIONS;
    }
    for (int i = 0; i < actions->pressed[ACTION_RECALL] && controls->stored_count > 0; i++) {
        controls->recalled = (controls->recalled + 1) % controls->stored_count;
        const StoredPosition *position = &controls->stored[controls->recalled];
        xray->lao_deg = position->lao_deg;
        xray->cra_deg = position->cra_deg;
        xray->field_mm = position->field_mm;
        for (int k = 0; k < 3; k++)
            xray->table_mm[k] = position->table_mm[k];
    }
}

// The point of the isocentre's plane under the mouse stays there; x, y: from the middle of the square, in its sides.
static void zoom_field(XrayControl *xray, const PatientAxes *patient, double notch, double x, double y)
{
    double before = (double)xray->field_mm;
    xray->field_mm = clamped(before * pow(field_step, -notch / 2), 40, 400);
    CArm arm = c_arm_place(xray, patient);
    double shrunk = before - (double)xray->field_mm;
    Vec3 moved = vec3_add(vec3_scale(arm.right, x * shrunk), vec3_scale(arm.up, y * shrunk));
    for (int k = 0; k < 3; k++)
        xray->table_mm[k] += (float)(&moved.x)[k];
}

static void obey_xray(OperatorControls *controls, const PanelActions *actions)
{
    XrayControl *xray = &controls->xray;
    for (int i = 0; i < actions->pressed[ACTION_MAGNIFY]; i++)
        xray->field_mm = clamped((double)xray->field_mm / field_step, 40, 400);
    for (int i = 0; i < actions->pressed[ACTION_DEMAGNIFY]; i++)
        xray->field_mm = clamped((double)xray->field_mm * field_step, 40, 400);
    for (int i = 0; i < actions->pressed[ACTION_PULSES]; i++) {
        int next = 0;
        while (next < 3 && pulse_rates[next] <= xray->pulses_s)
            next++;
        xray->pulses_s = xray->pulses_s >= pulse_rates[3] ? pulse_rates[0] : pulse_rates[next];
    }
    if (actions->pressed[ACTION_PEDAL_LATCH] & 1)
        controls->pedal_latched = !controls->pedal_latched;
    if (actions->pressed[ACTION_REFERENCE] & 1)
        controls->second = controls->second == SECOND_REFERENCE ? SECOND_NONE : SECOND_REFERENCE;
    if (actions->pressed[ACTION_BIPLANE] & 1)
        controls->second = controls->second == SECOND_PLANE ? SECOND_NONE : SECOND_PLANE;
    if (actions->pressed[ACTION_DSA] & 1) {
        xray->mode = xray->mode == XRAY_DSA ? XRAY_LIVE : XRAY_DSA;
        xray->mask += xray->mode == XRAY_DSA;   // subtraction starts with a new mask
    }
    if (actions->pressed[ACTION_ROADMAP] & 1) {
        xray->mode = xray->mode == XRAY_ROADMAP ? XRAY_LIVE : XRAY_ROADMAP;
        xray->mask += xray->mode == XRAY_ROADMAP;   // the roadmap starts with the vessels of the last injection
    }
    xray->mask += (float)actions->pressed[ACTION_MASK];
}

static void obey_mouse(OperatorControls *controls, const VesselScene *scene, const PanelActions *actions, const PanelLayout *layout)
{
    const PanelMouse *mouse = &actions->mouse;
    if (mouse->view < 0 || mouse->view >= VIEW_COUNT)
        return;
    const ViewPort *port = &layout->view[mouse->view];
    double dx = mouse->drag_x * port->height, dy = -mouse->drag_y * port->height;
    if (mouse->view == VIEW_3D) {
        FreeCamera *camera = &controls->look.camera;
        controls->follows_arm &= !(mouse->buttons & WINDOW_MOUSE_LEFT) || (mouse->drag_x == 0 && mouse->drag_y == 0);
        if (mouse->buttons & WINDOW_MOUSE_LEFT)
            free_camera_orbit(camera, dx, dy);
        else if (mouse->buttons && (mouse->drag_x != 0 || mouse->drag_y != 0)) {
            if (controls->look.follow_tip)
                *camera = vessel_scene_camera(scene);   // continue from the present view
            controls->look.follow_tip = false;
            free_camera_pan(camera, dx, dy, port->width, port->height);
        }
        if (mouse->scroll != 0)
            free_camera_zoom(camera, mouse->scroll, mouse->x * port->width, (1 - mouse->y) * port->height, port->width, port->height);
    } else if (mouse->view == VIEW_FLUOROSCOPY) {
        // dragging rotates the C-arm as if the mouse held the detector
        if (mouse->buttons & WINDOW_MOUSE_LEFT) {
            controls->xray.lao_deg = clamped((double)controls->xray.lao_deg + copysign(90, controls->sideways_deg_s) * mouse->drag_x, -90, 90);
            controls->xray.cra_deg = clamped((double)controls->xray.cra_deg + copysign(90, controls->tilt_deg_s) * mouse->drag_y, -45, 45);
        }
        double side = port->width < port->height ? port->width : port->height;
        if (mouse->scroll != 0 && side > 0)
            zoom_field(&controls->xray, &controls->patient, mouse->scroll, (mouse->x - 0.5) * port->width / side, (mouse->y - 0.5) * port->height / side);
    }
}

// The plane starts at the tool, and stays there until it is moved or switched on again.
static void obey_section(VesselSceneLook *look, const VesselScene *scene, const PanelActions *actions, double seconds)
{
    Vec3 tip;
    if (actions->pressed[ACTION_SECTION] & 1) {
        look->section = !look->section;
        look->section_offset_mm = 0;
        look->section_through = scene && vessel_scene_tip(scene, &tip) ? tip : vec3(NAN, NAN, NAN);
    }
    look->section_at_tip = look->follow_tip;
    look->section_offset_mm += section_mm_s * seconds * held(actions, ACTION_SECTION_NEARER, ACTION_SECTION_FARTHER);
}

static void obey_views(OperatorControls *controls, const VesselScene *scene, const PanelActions *actions, double seconds)
{
    static const ActionId view[] = {ACTION_VIEW_FLUOROSCOPY, ACTION_VIEW_3D, ACTION_VIEW_ANGIOSCOPY, ACTION_VIEW_ALL};
    VesselSceneLook *look = &controls->look;
    for (int i = 0; i < 4; i++)
        if (actions->pressed[view[i]])
            controls->view = (PanelView)i;
    if (actions->pressed[ACTION_CAMERA_RESET]) {
        free_camera_reset(&look->camera);
        controls->follows_arm = false;
    }
    controls->follows_arm ^= actions->pressed[ACTION_CAMERA_C_ARM] & 1;
    look->follow_tip ^= actions->pressed[ACTION_CAMERA_FOLLOW] & 1;
    obey_section(look, scene, actions, seconds);
    look->show_model ^= actions->pressed[ACTION_MODEL] & 1;
    look->show_arrows ^= actions->pressed[ACTION_ARROWS] & 1;
    double across = held(actions, ACTION_ORBIT_RIGHT, ACTION_ORBIT_LEFT), along = held(actions, ACTION_ORBIT_DOWN, ACTION_ORBIT_UP),
           orbit = orbit_px_s * seconds;
    controls->follows_arm &= across == 0 && along == 0;
    free_camera_orbit(&look->camera, orbit * across, orbit * along);
    free_camera_zoom(&look->camera, 8 * seconds * held(actions, ACTION_CAMERA_NEARER, ACTION_CAMERA_FARTHER), 50, 50, 100, 100);
}

// The last selection of a frame applies; other presses apply to that tool.
static void obey_grip(OperatorControls *controls, const PanelActions *actions)
{
    for (int k = 0; k < controls->tool_count; k++)
        if (actions->pressed[ACTION_TOOL_1 + k])
            hand_grip_choose(&controls->grip, controls->tool_count, k);
    if (actions->pressed[ACTION_LOCK] & 1)
        hand_grip_lock(&controls->grip, controls->tool_count);
    if (actions->pressed[ACTION_RELEASE] & 1)
        hand_grip_release(&controls->grip);
}

void controls_obey(OperatorControls *controls, const VesselScene *scene, const PanelActions *actions, const PanelLayout *layout, double seconds)
{
    // first, because sliders contain all controls as shown; keys are applied on top
    if (actions->xray_set)
        obey_sliders(&controls->xray, actions);
    obey_arm(controls, actions, seconds);
    obey_stored(controls, actions);
    obey_xray(controls, actions);
    obey_grip(controls, actions);
    obey_views(controls, scene, actions, seconds);
    obey_mouse(controls, scene, actions, layout);
    if (controls->follows_arm) {
        const CArm arm = c_arm_place(&controls->xray, &controls->patient);
        free_camera_turn_along(&controls->look.camera, vec3_negate(arm.towards), arm.up);
    }
}

bool controls_refuse_hidden(const OperatorControls *controls, PanelActions *actions)
{
    bool is_refused = false;
    for (int i = 0; controls->is_examination && i < ACTION_COUNT; i++)
        if (key_table_is_of_3d((ActionId)i)) {
            is_refused |= actions->pressed[i] > 0;
            actions->held[i] = false;
            actions->pressed[i] = 0;
        }
    return is_refused;
}

// Whether the tip lies in the open field: the blades cover parts of half the field, from its borders.
static bool is_in_open_field(const CArm *arm, const XrayControl *xray, Vec3 tip)
{
    const float *blade = xray->collimator;
    Vec3 at = c_arm_project(arm, tip);
    return at.z > C_ARM_NEAREST_MM - C_ARM_SOURCE_MM && 2 * at.x >= (double)blade[0] - 1 && 2 * at.x <= 1 - (double)blade[1] &&
           2 * at.y >= (double)blade[2] - 1 && 2 * at.y <= 1 - (double)blade[3];
}

static bool is_shown(const PanelLayout *layout, PanelView view) { return layout->view[view].width > 0 && layout->view[view].height > 0; }

void controls_note_sight(const OperatorControls *controls, const PanelLayout *layout, const Pose *pose, bool is_live, const XrayControl *before,
                         XrayControl *xray)
{
    const int guides = SEEN_3D | SEEN_ANGIOSCOPY;
    const CArm arm = c_arm_place(xray, &controls->patient);
    int seen = SEEN_KNOWN | (controls->is_examination ? SEEN_EXAMINATION : 0) | (controls->second == SECOND_PLANE ? SEEN_BIPLANE : 0);
    seen |= is_live && is_shown(layout, VIEW_FLUOROSCOPY) ? SEEN_XRAY : 0;
    seen |= is_shown(layout, VIEW_3D) ? SEEN_3D : 0;
    seen |= is_shown(layout, VIEW_ANGIOSCOPY) ? SEEN_ANGIOSCOPY : 0;
    for (int k = 0; pose && k < pose->tool_count; k++) {
        const PoseTool *tool = &pose->tool[k];
        seen |= tool->node_count > 0 && is_in_open_field(&arm, xray, tool->node[tool->node_count - 1].position) ? SEEN_TIP << k : 0;
    }
    xray->looks = before->looks + (float)(seen & guides && !((int)before->seen & guides));
    xray->seen = (float)seen;
}

static Command command_by(const OperatorControls *controls, const PanelActions *actions, ActionId push, ActionId pull, ActionId left, ActionId right)
{
    if (actions->held[ACTION_STOP])
        return (Command){0, 0};
    double speed = actions->held[ACTION_FAST] ? 3 : actions->held[ACTION_SLOW] ? 0.2 : 1;
    return (Command){speed * controls->push_mm_s * held(actions, push, pull), speed * controls->twist_deg_s * held(actions, right, left)};
}

Command controls_command(const OperatorControls *controls, const PanelActions *actions)
{
    return command_by(controls, actions, ACTION_PUSH, ACTION_PULL, ACTION_TWIST_LEFT, ACTION_TWIST_RIGHT);
}

Command controls_partner_command(const OperatorControls *controls, const PanelActions *actions)
{
    return controls->tool_count < 2 ? (Command){0, 0}
                                    : command_by(controls, actions, ACTION_OTHER_PUSH, ACTION_OTHER_PULL, ACTION_OTHER_TWIST_LEFT, ACTION_OTHER_TWIST_RIGHT);
}

XrayControl controls_xray(const OperatorControls *controls, const PanelActions *actions, unsigned hand_buttons)
{
    XrayControl xray = controls->xray;
    xray.pedal = controls->pedal_latched || actions->held[ACTION_PEDAL] || (hand_buttons & HAND_PEDAL);
    xray.contrast_ml_s = actions->held[ACTION_CONTRAST] || (hand_buttons & HAND_CONTRAST) ? (float)controls->contrast_ml_s : 0;
    xray.contrast_tool = (float)(controls->grip.chosen + 1);
    return xray;
}
