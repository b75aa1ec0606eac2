#include "render/trainer_tray.h"
#include "render/translation.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static const double at_hub_mm = 1;       // solver/step_exchange.c
static const double per_degree = PI / 180;

// --- display of a device ---

// Length of the distal part shown: from slightly proximal of its first bend, at least 40 mm and at most all of it.
static double shown_length(const WireOptions *wire)
{
    double total = wire_length(wire), begin = 0;
    for (int i = 0; i < wire->section_count; begin += wire->section[i++].length)
        if (wire->section[i].rest_curvature != 0)
            break;
    return fmin(total, fmax(20, 1.2 * (total - begin)));
}

static const WireSection *section_at(const WireOptions *wire, double s)
{
    int i = 0;
    for (double end = wire->section[0].length; i + 1 < wire->section_count && s > end; end += wire->section[++i].length)
        ;
    return &wire->section[i];
}

// The rest shape, seen perpendicular to the plane of its first bend.
static void draw_rest_shape(PanelTrayDevice *shown, const WireOptions *wire)
{
    double total = wire_length(wire), length = shown_length(wire), plane = 0;
    Vec3 x = vec3(0, 0, 0), along = vec3(1, 0, 0), normal = vec3(0, 1, 0);
    for (int i = wire->section_count - 1; i >= 0; i--)
        plane = wire->section[i].rest_curvature != 0 ? wire->section[i].rest_plane : plane;
    shown->point_count = 0;
    for (int i = 0; i < TRAY_POINTS; i++) {
        memcpy(shown->point[shown->point_count++], (double[]){x.x, x.y}, sizeof shown->point[0]);
        // a section of constant curvature, as short chords
        enum { CHORDS = 16 };
        double step = length / (TRAY_POINTS - 1) / CHORDS;
        for (int k = 0; k < CHORDS && i + 1 < TRAY_POINTS; k++) {
            const WireSection *section = section_at(wire, total - length + (i * CHORDS + k + 0.5) * step);
            double turn = section->rest_curvature * step, angle = section->rest_plane - plane;
            Vec3 side = vec3_add(vec3_scale(normal, cos(angle)), vec3_scale(vec3_cross(along, normal), sin(angle)));
            Vec3 axis = vec3_cross(along, side), before = along;
            along = vec3_unit(vec3_add_scaled(vec3_scale(along, cos(turn)), sin(turn), side));
            normal = vec3_add(vec3_add(vec3_scale(normal, cos(turn)), vec3_scale(vec3_cross(axis, normal), sin(turn))),
                              vec3_scale(axis, vec3_dot(axis, normal) * (1 - cos(turn))));
            x = vec3_add_scaled(x, step, vec3_unit(vec3_add(before, along)));
        }
    }
}

static void draw_stiffness(PanelTrayDevice *shown, const WireOptions *wire)
{
    double end = 0;
    shown->step_count = 0;
    for (int i = 0; i < wire->section_count; i++) {
        double bending = wire_stiffness(&wire->section[i]).bending;
        int last = shown->step_count - 1;
        end += wire->section[i].length;
        bool is_same = last >= 0 && fabs(bending - shown->bending_n_mm2[last]) < 1e-9 * bending;
        if (!is_same && shown->step_count < TRAY_STEPS)
            shown->bending_n_mm2[last = shown->step_count++] = bending;
        shown->end_mm[last] = end;
    }
}

// Writes "0.8" or, for a tapered device, "0.8 to 0.6".
static void print_range(char *text, size_t capacity, const WireOptions *wire, bool is_inner)
{
    double first = is_inner ? wire->section[0].inner_diameter : wire->section[0].diameter;
    const WireSection *end = &wire->section[wire->section_count - 1];
    double last = is_inner ? end->inner_diameter : end->diameter;
    if (fabs(first - last) < 5e-4)
        snprintf(text, capacity, "%.3g", first);
    else
        snprintf(text, capacity, "%.3g to %.3g", first, last);
}

static void show_device(PanelTrayDevice *shown, const TrayDevice *device, char *what, size_t capacity)
{
    static const char *const kind[TOOL_KIND_COUNT] = {"guide catheter", "catheter", "microcatheter", "wire"};
    const WireOptions *wire = &device->tool.wire;
    char outer[40], inner[40];
    bool is_wire = device->tool.kind == TOOL_WIRE;
    print_range(outer, sizeof outer, wire, false);
    print_range(inner, sizeof inner, wire, true);
    if (is_wire)
        snprintf(what, capacity, tr("wire, %s core, %s mm thick, %.0f mm long"), tool_core_name[device->tool.core], outer, wire_length(wire));
    else
        snprintf(what, capacity, tr("%s, outside %s mm, lumen %s mm, %.0f mm long"), kind[device->tool.kind], outer, inner, wire_length(wire));
    *shown = (PanelTrayDevice){
        .name = device->title,
        .what = what,
        .can_be_shaped = is_wire && device->tool.core == CORE_STEEL,
        .remark = is_wire && device->tool.core == CORE_NITINOL ? "Nitinol springs back completely when bent by hand: this tip cannot be shaped" : NULL};
    draw_rest_shape(shown, wire);
    draw_stiffness(shown, wire);
}

// --- obstacles ---

static double length_of(const Pose *pose, int tool)
{
    const PoseTool *it = &pose->tool[tool];
    return it->node_count > 0 ? it->node[it->node_count - 1].s : 0;
}

// Length [mm] of a tool beyond the hub of the outermost one; for the outermost one, beyond the mouth of the sheath.
static double beyond_hub(const Pose *pose, int tool) { return pose->tool[tool].inserted_mm + (tool > 0 ? length_of(pose, 0) - pose->tool[0].inserted_mm : 0); }

// Returns NULL if the tool is withdrawn.
static const char *why_still_in(char *text, const Scene *scene, const Pose *pose, int tool)
{
    double beyond = beyond_hub(pose, tool), to_withdraw = tool > 0 ? beyond - at_hub_mm : beyond;
    if (!scene->wire.has_sheath && tool == 0) {
        snprintf(text, TRAY_WORDS, tr("'%s' is held by a test rig and cannot be removed"), scene->tool[tool].name);
        return text;
    }
    if (to_withdraw <= 0)
        return NULL;
    snprintf(text, TRAY_WORDS, tr("'%s' is still inserted: pull it back %.0f mm, to %s; then another can be inserted"), scene->tool[tool].name,
             fmax(1, ceil(to_withdraw)), tool > 0 ? "the hub" : "the sheath's mouth");
    return text;
}

// The same condition as in the solver once the tool is withdrawn: proximal ends stay behind the hub.
static const char *why_too_long_or_short(char *text, const Scene *scene, const Pose *pose, int tool, double length)
{
    for (int m = tool + 1; m < scene->tool_count; m++) {
        // after the outermost tool has been withdrawn to the mouth, this length is outside
        double outside = length_of(pose, m) - (tool > 0 ? beyond_hub(pose, m) : pose->tool[m].inserted_mm);
        if (outside < length) {
            snprintf(
                text, TRAY_WORDS,
                tr("'%s' inside is too short for it: %.0f mm of that are outside, and this device is %.0f mm long. An exchange needs a wire of that length"),
                scene->tool[m].name, outside, length);
            return text;
        }
    }
    for (int m = tool - 1; m > 0; m--) {
        double outside = length_of(pose, m) - beyond_hub(pose, m);
        if (length < outside) {
            snprintf(text, TRAY_WORDS, tr("it is %.0f mm long, but '%s' around it has %.0f mm outside"), length, scene->tool[m].name, outside);
            return text;
        }
    }
    return NULL;
}

static const char *why_not(TrainerTray *tray, int index, const TrayDevice *device, bool is_new, const Scene *scene, const Pose *pose)
{
    char *text = tray->note[index];
    int tool = tray->devices.tool;
    if (!is_new && device->which == pose->tool[tool].fitted)
        return "this device is already inserted";
    if (is_new && scene_device_count(scene, tool) > EXCHANGES_MOST) {
        snprintf(text, TRAY_WORDS, tr("a session has room for %d devices in addition to the first one of '%s'; the existing ones can be inserted again"),
                 EXCHANGES_MOST, scene->tool[tool].name);
        return text;
    }
    return why_too_long_or_short(text, scene, pose, tool, wire_length(&device->tool.wire));
}

// --- each frame ---

bool trainer_tray_open(TrainerTray *tray, const Scene *scene, int tool, const char *library, const Pose *pose, int *in)
{
    trainer_tray_close(tray);
    *in = 0;
    if (!tray_devices_find(&tray->devices, scene, tool, library))
        return false;
    for (int i = 0; i < tray->devices.count; i++) {
        show_device(&tray->device[i], &tray->devices.device[i], tray->what[i], sizeof tray->what[i]);
        if (tray->devices.device[i].which == pose->tool[tool].fitted)
            *in = i;
    }
    tray->shown = (PanelTray){.tool = scene->tool[tool].name, .device_count = tray->devices.count, .device = tray->device};
    return true;
}

void trainer_tray_close(TrainerTray *tray)
{
    tray_devices_free(&tray->devices);
    tray_device_free(&tray->shaped);
    tray->shown = (PanelTray){0};
    tray->choice = (PanelTrayChoice){0};
}

TipShaping trainer_tray_tip(const TrainerTray *tray)
{
    const PanelTrayChoice *choice = &tray->choice;
    if (!choice->is_shaped)
        return (TipShaping){0};
    return (TipShaping){.length = choice->length_mm, .angle = choice->angle_deg * per_degree, .mandrel = choice->mandrel_mm};
}

static bool is_same_tip(const PanelTrayChoice *a, const PanelTrayChoice *b)
{
    return a->device == b->device && a->is_shaped == b->is_shaped &&
           fabs(a->length_mm - b->length_mm) + fabs(a->angle_deg - b->angle_deg) + fabs(a->mandrel_mm - b->mandrel_mm) < 1e-9;
}

// The selected wire as set by the sliders; if it cannot keep that shape, it is unchanged, with the reason.
static void shape_chosen(TrainerTray *tray)
{
    char *why = tray->note[TRAY_DEVICES];
    const TipShaping tip = trainer_tray_tip(tray);
    const TrayDevice *from = &tray->devices.device[tray->choice.device];
    tray_device_free(&tray->shaped);
    bool is_kept = tray_device_shape(from, &tip, &tray->shaped, why, TRAY_WORDS);
    show_device(&tray->shaped_shown, is_kept ? &tray->shaped : from, tray->what[TRAY_DEVICES], sizeof tray->what[TRAY_DEVICES]);
    const TipShaped *how = &tray->shaped.tool.tip_shaped;
    tray->shaped_shown.note = is_kept ? NULL : why;
    tray->shaped_shown.remark = is_kept ? tray->remark : NULL;
    snprintf(tray->remark, sizeof tray->remark, tr("Bent by %.0f\u00b0 around the mandrel it springs back to %.0f\u00b0, with a radius of %.1f mm"),
             how->bent_angle / per_degree, tip.angle / per_degree, how->rest_radius);
}

void trainer_tray_show(TrainerTray *tray, const Scene *scene, const Pose *pose, const PanelTrayChoice *choice)
{
    bool is_changed = !is_same_tip(choice, &tray->choice);
    tray->choice = *choice;
    tray->shown.note = why_still_in(tray->note[TRAY_DEVICES + 1], scene, pose, tray->devices.tool);
    for (int i = 0; i < tray->devices.count; i++) {
        const TrayDevice *device = &tray->devices.device[i];
        tray->device[i].note = why_not(tray, i, device, device->which < 0, scene, pose);
        tray->device[i].is_in = device->which == pose->tool[tray->devices.tool].fitted;
    }
    tray->shown.shaped = NULL;
    if (!choice->is_shaped || choice->device >= tray->devices.count)
        return;
    if (is_changed)
        shape_chosen(tray);
    if (tray->shaped.tool.wire.section)
        tray->shaped_shown.note = why_not(tray, TRAY_DEVICES, &tray->shaped, true, scene, pose);
    tray->shown.shaped = &tray->shaped_shown;
}

// A tool that is still inserted is reported last: permanent obstacles come first.
const char *trainer_tray_obstacle(const TrainerTray *tray)
{
    const PanelTrayChoice *choice = &tray->choice;
    if (choice->device >= tray->devices.count)
        return "unknown device";
    const char *note = choice->is_shaped ? tray->shaped_shown.note : tray->device[choice->device].note;
    return note ? note : tray->shown.note;
}
