#include "sim/tray_devices.h"

#include "base/base.h"

#include <dirent.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double per_degree = PI / 180;

static bool copy_device(TrayDevice *to, const SceneTool *tool, WireSection *section, int count, int which, const char *title)
{
    *to = (TrayDevice){.tool = *tool, .which = which};
    to->tool.device_path = NULL;
    to->tool.wire.section = section;
    to->tool.wire.section_count = count;
    snprintf(to->title, sizeof to->title, "%.*s", TRAY_TITLE - 1, title);
    return section != NULL;
}

static WireSection *copy_sections(const WireOptions *wire)
{
    WireSection *copy = calloc((size_t)wire->section_count + 1, sizeof *copy);
    if (copy)
        memcpy(copy, wire->section, (size_t)wire->section_count * sizeof *copy);
    return copy;
}

static bool add_device(TrayDevices *tray, const SceneTool *tool, const WireOptions *wire, int which, const char *title)
{
    if (tray->count == TRAY_DEVICES)
        return true;
    return copy_device(&tray->device[tray->count++], tool, copy_sections(wire), wire->section_count, which, title);
}

static bool add_own(TrayDevices *tray, const Scene *scene)
{
    bool good = true;
    for (int i = 0; good && i < scene_device_count(scene, tray->tool); i++) {
        const SceneTool *tool = scene_device(scene, tray->tool, i);
        const WireOptions wire = scene_device_wire(scene, tray->tool, i);
        char title[TRAY_TITLE];
        if (tool->title[0])
            snprintf(title, sizeof title, "%s", tool->title);
        else if (i == 0)
            snprintf(title, sizeof title, "%s, as the scene has it", tool->name);
        else
            snprintf(title, sizeof title, "%s, the scene's spare %d", tool->name, i);
        good = add_device(tray, tool, &wire, i, title);
    }
    return good;
}

// --- a folder of devices ---

static bool is_known(const TrayDevices *tray, const char *title)
{
    for (int i = 0; i < tray->count; i++)
        if (!strcmp(tray->device[i].title, title))
            return true;
    return false;
}

static Scene *scene_with_entry(const Scene *scene, int tool, const char *entry, Faults *faults)
{
    char path[40];
    snprintf(path, sizeof path, "tools.%d.exchange", tool);
    char *text = yaml_edit_append(scene->text, path, entry);
    Scene *extended = text ? scene_parse(text, strlen(text), scene->path, faults) : NULL;
    if (!text)
        faults_add(faults, scene->path, 0, 0, "cannot add a device to '%s' in this scene's text; write it under its 'exchange:'", scene->tool[tool].name);
    free(text);
    return extended;
}

// Reading it as part of the scene applies all rules that relate one tool to another.
static bool add_file(TrayDevices *tray, const Scene *scene, const char *path)
{
    static Faults faults;
    char entry[4600];
    const WireOptions own = scene_tool_wire(scene, tray->tool);
    faults_clear(&faults);
    snprintf(entry, sizeof entry, "{device: \"%s\", length_mm: %.17g, elements: %d}", path, wire_length(&own), own.elements);
    Scene *with = strpbrk(path, "\"\\") ? NULL : scene_with_entry(scene, tray->tool, entry, &faults);
    int which = with ? scene_device_count(with, tray->tool) - 1 : 0;
    const SceneTool *tool = with ? scene_device(with, tray->tool, which) : NULL;
    bool good = true;
    if (tool && tool->kind == scene->tool[tray->tool].kind && !is_known(tray, tool->title))
        good = add_device(tray, tool, &tool->wire, -1, tool->title[0] ? tool->title : strrchr(path, '/') + 1);
    scene_free(with);
    return good;
}

static int is_device(const struct dirent *entry)
{
    size_t length = strlen(entry->d_name);
    return length > 5 && entry->d_name[0] != '.' && !strcmp(entry->d_name + length - 5, ".yaml");
}

static bool add_library(TrayDevices *tray, const Scene *scene, const char *folder)
{
    struct dirent **entry = NULL;
    int count = scandir(folder, &entry, is_device, alphasort);
    bool good = true;
    for (int i = 0; i < count; i++) {
        char path[4400];
        if (good && snprintf(path, sizeof path, "%s/%s", folder, entry[i]->d_name) < (int)sizeof path)
            good = add_file(tray, scene, path);
        free(entry[i]);
    }
    free(entry);
    return good;
}

bool tray_devices_find(TrayDevices *tray, const Scene *scene, int tool, const char *library)
{
    *tray = (TrayDevices){.tool = tool};
    if (add_own(tray, scene) && (!library || add_library(tray, scene, library)))
        return true;
    tray_devices_free(tray);
    return false;
}

void tray_device_free(TrayDevice *device)
{
    free((void *)device->tool.wire.section);
    *device = (TrayDevice){0};
}

void tray_devices_free(TrayDevices *tray)
{
    for (int i = 0; i < tray->count; i++)
        tray_device_free(&tray->device[i]);
    tray->count = 0;
}

// --- a shaped tip ---

// "0.014 inch wire, tip 45° over 10 mm": a device shaped before is named by its new shape only.
static void name_shaped(char *title, size_t capacity, const TrayDevice *from, const TipShaping *tip)
{
    static const char word[] = ", tip shaped to ";
    const char *shaped = strstr(from->title, word);
    int length = shaped ? (int)(shaped - from->title) : (int)strlen(from->title);
    length = length < 56 ? length : 56;      // SceneTool.title can hold all of it
    while (length > 0 && ((unsigned char)from->title[length] & 0xC0) == 0x80)
        length--;
    snprintf(title, capacity, "%.*s%s%.0f\u00b0", length, from->title, word, tip->angle / per_degree);
}

bool tray_device_shape(const TrayDevice *from, const TipShaping *tip, TrayDevice *shaped, char *why, size_t capacity)
{
    char title[TRAY_TITLE];
    int count;
    TipShaped how;
    *shaped = (TrayDevice){0};
    if (from->tool.kind != TOOL_WIRE || from->tool.core != CORE_STEEL) {
        snprintf(why, capacity, "only a wire with a steel core keeps a bend that is made by hand");
        return false;
    }
    WireSection *section = tip_shaped_sections(from->tool.wire.section, from->tool.wire.section_count, tip, &count, &how, why, capacity);
    name_shaped(title, sizeof title, from, tip);
    if (!section || !copy_device(shaped, &from->tool, section, count, -1, title))
        return false;
    shaped->tool.tip = *tip;
    shaped->tool.tip_shaped = how;
    return true;
}

// --- as text ---

static void print_quoted(FILE *stream, const char *text)
{
    fputc('"', stream);
    for (; *text; text++) {
        if (*text == '"' || *text == '\\')
            fputc('\\', stream);
        fputc(*text, stream);
    }
    fputc('"', stream);
}

static void print_section(FILE *stream, const WireSection *s)
{
    fprintf(stream,
            "{length_mm: %.17g, diameter_mm: %.17g, inner_diameter_mm: %.17g, young_modulus_gpa: %.17g, poisson_ratio: %.17g, density_g_cm3: %.17g, "
            "attenuation_1_mm: %.17g",
            s->length, s->diameter, s->inner_diameter, s->young_modulus / 1000, s->poisson_ratio, s->density * 1000, s->attenuation);
    if (s->rest_curvature != 0)
        fprintf(stream, ", rest_curvature_1_mm: %.17g, rest_curvature_plane_deg: %.17g", s->rest_curvature, s->rest_plane / per_degree);
    if (s->friction >= 0)
        fprintf(stream, ", friction: %.17g", s->friction);
    fputc('}', stream);
}

// All keys of an entry of `exchange:`, on one line and without a device file.
static char *print_device(const TrayDevice *device, const TipShaping *tip)
{
    const SceneTool *tool = &device->tool;
    const WireOptions *wire = &tool->wire;
    char *text = NULL, title[TRAY_TITLE];
    size_t length;
    FILE *stream = open_memstream(&text, &length);
    if (!stream)
        return NULL;
    snprintf(title, sizeof title, "%s", device->title);
    if (tip->length > 0)
        name_shaped(title, sizeof title, device, tip);
    fputs("{title: ", stream);
    print_quoted(stream, title);
    fprintf(stream,
            ", core: %s, elements: %d, friction_inside: %.17g, hand_limit_n: %.17g, valve_n: %.17g, damping: {mass_1_s: %.17g, stiffness_s: %.17g}, "
            "tip_marker: {length_mm: %.17g, attenuation_1_mm: %.17g}, ",
            tool_core_name[tool->core], wire->elements, tool->friction_inside, wire->hand_limit, wire->valve_friction, wire->damping_mass * 1000,
            wire->damping_stiffness / 1000, tool->marker_length, tool->marker_attenuation);
    if (tip->length > 0)
        fprintf(stream, "shaped_tip: {length_mm: %.17g, angle_deg: %.17g, mandrel_mm: %.17g}, ", tip->length, tip->angle / per_degree, tip->mandrel);
    fputs("sections: [", stream);
    for (int i = 0; i < wire->section_count; i++) {
        fputs(i ? ", " : "", stream);
        print_section(stream, &wire->section[i]);
    }
    fputs("]}", stream);
    if (fclose(stream) == 0)
        return text;
    free(text);
    return NULL;
}

Scene *tray_scene_with(const Scene *scene, int tool, const TrayDevice *device, const TipShaping *tip, Faults *faults)
{
    char *entry = print_device(device, tip);
    if (!entry) {
        faults_add(faults, scene->path, 0, 0, "not enough memory for a device");
        return NULL;
    }
    Scene *with = scene_with_entry(scene, tool, entry, faults);
    free(entry);
    return with;
}
