// Accessors and destruction of a scene; scene_read.c creates it.
#include "sim/scene.h"

#include "base/base.h"

#include <stdlib.h>

const char *const contact_name[CONTACT_COUNT + 1] = {"lim",        "mesh",  "tube",   "smooth_mesh", "flat_mesh", "grid", "lim_blend",
                                                     "lim_switch", "sweep", "raster", "rbf",         "pas",       NULL};

const char *const tool_kind_name[TOOL_KIND_COUNT + 1] = {"guide_catheter", "catheter", "microcatheter", "wire", NULL};
const char *const tool_core_name[CORE_COUNT + 1] = {"steel", "nitinol", NULL};

void scene_free(Scene *scene)
{
    if (!scene)
        return;
    free((void *)scene->tube.piece);
    free((void *)scene->tube.point);
    free((void *)scene->wire.section);
    for (int k = 0; k < scene->tool_count; k++) {
        if (k > 0)
            free((void *)scene->tool[k].wire.section);
        free(scene->tool[k].device_path);
    }
    for (int i = 0; i < scene->exchange_count; i++) {
        free((void *)scene->exchange[i].device.wire.section);
        free(scene->exchange[i].device.device_path);
    }
    free(scene->exchange);
    free((void *)scene->wire.fix);
    free((void *)scene->wire.load);
    script_free(scene->script);
    free(scene->shape_option);
    free(scene->target);
    exercise_free(scene->exercise);
    free(scene->exercise);
    free(scene->verify.cases);
    free(scene->model_path);
    free(scene->mesh_path);
    free(scene->script_path);
    free(scene->tube_points_path);
    free(scene->anatomy_path);
    free(scene->text);
    free(scene->path);
    free(scene);
}

WireOptions scene_tool_wire(const Scene *scene, int tool) { return tool == 0 ? scene->wire : scene_placed_wire(scene, &scene->tool[tool].wire); }

WireOptions scene_placed_wire(const Scene *scene, const WireOptions *own)
{
    WireOptions wire = *own;
    wire.has_sheath = scene->wire.has_sheath;
    wire.start = scene->wire.start;
    wire.direction = scene->wire.direction;
    wire.normal = scene->wire.normal;
    wire.gravity = scene->wire.gravity;
    return wire;
}

const SceneTool *scene_device(const Scene *scene, int tool, int which)
{
    if (which == 0)
        return tool < scene->tool_count ? &scene->tool[tool] : NULL;
    for (int i = 0; i < scene->exchange_count; i++)
        if (scene->exchange[i].tool == tool && --which == 0)
            return &scene->exchange[i].device;
    return NULL;
}

WireOptions scene_device_wire(const Scene *scene, int tool, int which)
{
    return which == 0 ? scene_tool_wire(scene, tool) : scene_placed_wire(scene, &scene_device(scene, tool, which)->wire);
}

int scene_device_count(const Scene *scene, int tool)
{
    int count = 0;
    while (scene_device(scene, tool, count))
        count++;
    return count;
}

int scene_most_nodes(const Scene *scene, int tool)
{
    int most = 0;
    for (int i = 0; i < scene_device_count(scene, tool); i++) {
        int nodes = scene_device_wire(scene, tool, i).elements + 1;
        most = nodes > most ? nodes : most;
    }
    return most;
}

bool scene_use_script(Scene *scene, const char *path, Faults *faults)
{
    ToolNames tools = scene ? scene_tool_names(scene) : (ToolNames){0};
    Script *script = script_load(path, scene ? &tools : NULL, faults);
    if (!scene || !script) {
        script_free(script);
        return false;
    }
    script_free(scene->script);
    free(scene->script_path);
    scene->script = script;
    scene->script_path = HEAP_TEXT(path);
    return true;
}

ToolNames scene_tool_names(const Scene *scene)
{
    ToolNames names = {.count = scene->tool_count};
    for (int k = 0; k < scene->tool_count; k++)
        names.name[k] = scene->tool[k].name, names.kind[k] = tool_kind_name[scene->tool[k].kind];
    return names;
}

double scene_device_marker(const Scene *scene, int tool, int which)
{
    return tool == 0 && which == 0 ? scene->marker_length : scene_device(scene, tool, which)->marker_length;
}

double scene_device_attenuation(const Scene *scene, int tool, int which, double s)
{
    const WireOptions wire = scene_device_wire(scene, tool, which);
    double marked = tool == 0 && which == 0 ? scene->marker_attenuation : scene_device(scene, tool, which)->marker_attenuation, total = 0;
    int at = -1;
    for (int i = 0; i < wire.section_count; i++) {
        total += wire.section[i].length;
        if (at < 0 && (s < total || i == wire.section_count - 1))
            at = i;
    }
    return at < 0 ? 0 : s > total - scene_device_marker(scene, tool, which) ? marked : wire.section[at].attenuation;
}

double scene_tool_attenuation(const Scene *scene, int tool, double s) { return scene_device_attenuation(scene, tool, 0, s); }
