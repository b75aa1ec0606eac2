#include "render/tool_look.h"

#include <stdlib.h>

// Blue, sky blue, bluish green, and grey for wires; then colours for repeated kinds. Any two are distinguishable without red and green, and stand out from
// their background. Orange and yellow, also from Okabe and Ito, are reserved for wall force.
enum { COLORS = 7 };
static const Color palette[2][COLORS] = {
    {{64, 119, 227, 255}, {97, 212, 255, 255}, {30, 155, 124, 255}, {196, 203, 214, 255}, {175, 128, 189, 255}, {68, 213, 76, 255}, {68, 131, 74, 255}},
    {{0, 68, 151, 255}, {85, 163, 224, 255}, {0, 146, 105, 255}, {74, 62, 79, 255}, {164, 80, 170, 255}, {50, 156, 42, 255}, {146, 16, 203, 255}}};
_Static_assert((int)COLORS >= (int)TOOL_KIND_COUNT + TOOLS_MOST - 1, "four tools of one kind have different colours");

void tool_colors(int count, const ToolKind *kind, bool is_on_paper, Color *color)
{
    bool used[COLORS] = {false};
    int next = TOOL_KIND_COUNT;
    for (int k = 0; k < count; k++) {
        int choice = used[kind[k]] ? next++ : (int)kind[k];
        used[choice] = true;
        color[k] = palette[is_on_paper][choice];
    }
}

static bool is_same_tube(const TubeStretch *a, const TubeStretch *b)
{
    return !(a->radius < b->radius || a->radius > b->radius || a->lumen < b->lumen || a->lumen > b->lumen || a->attenuation < b->attenuation ||
             a->attenuation > b->attenuation);
}

// Adds a stretch; sections that look the same, such as those of a rest shape, become one stretch.
static void add_stretch(ToolLook *look, TubeStretch stretch)
{
    TubeStretch *last = look->stretch_count > 0 ? &look->stretch[look->stretch_count - 1] : NULL;
    if (last && is_same_tube(last, &stretch))
        last->end = stretch.end;
    else
        look->stretch[look->stretch_count++] = stretch;
}

static bool make_look(ToolLook *look, const Scene *scene, int k, int which)
{
    const WireOptions wire = scene_device_wire(scene, k, which);
    double marker = wire_length(&wire) - scene_device_marker(scene, k, which), begin = 0;
    look->name = scene->tool[k].name;
    look->stretch = malloc(((size_t)wire.section_count + 1) * sizeof *look->stretch);
    for (int i = 0; look->stretch && i < wire.section_count; i++) {
        double end = begin + wire.section[i].length;
        TubeStretch stretch = {.radius = wire.section[i].diameter / 2, .lumen = wire.section[i].inner_diameter / 2};
        const double cut[3] = {begin, fmin(fmax(marker, begin), end), end};
        for (int part = 0; part < 2; part++) {
            if (!(cut[part + 1] > cut[part]))
                continue;
            stretch.end = cut[part + 1];
            stretch.attenuation = scene_device_attenuation(scene, k, which, (cut[part] + cut[part + 1]) / 2);
            add_stretch(look, stretch);
        }
        begin = end;
    }
    return look->stretch != NULL;
}

bool tool_looks_make(ToolLooks *looks, const Scene *scene)
{
    ToolKind kind[TOOLS_MOST];
    Color color[2][TOOLS_MOST];
    bool good = true;
    *looks = (ToolLooks){.count = scene->tool_count};
    for (int k = 0; k < looks->count; k++)
        kind[k] = scene->tool[k].kind;
    for (int paper = 0; paper < 2; paper++)
        tool_colors(looks->count, kind, paper, color[paper]);
    for (int k = 0; good && k < looks->count; k++)
        for (int which = 0; good && which < scene_device_count(scene, k); which++) {
            ToolLook *look = which == 0 ? &looks->tool[k] : &looks->spare[k][which - 1];
            look->color = color[0][k];
            look->on_paper = color[1][k];
            good = make_look(look, scene, k, which);
        }
    return good;
}

void tool_looks_free(ToolLooks *looks)
{
    for (int k = 0; k < looks->count; k++) {
        free(looks->tool[k].stretch);
        for (int i = 0; i < EXCHANGES_MOST; i++)
            free(looks->spare[k][i].stretch);
    }
    *looks = (ToolLooks){0};
}

const ToolLook *tool_looks_of(const ToolLooks *looks, int tool, int fitted)
{
    const ToolLook *spare = fitted > 0 && fitted <= EXCHANGES_MOST ? &looks->spare[tool][fitted - 1] : NULL;
    return spare && spare->stretch_count > 0 ? spare : &looks->tool[tool];
}

const TubeStretch *tool_look_at(const ToolLook *look, double s)
{
    int i = 0;
    while (i + 1 < look->stretch_count && s > look->stretch[i].end)
        i++;
    return &look->stretch[i];
}

SheathLook sheath_look_make(const Scene *scene, const ToolLooks *tools)
{
    const double play = 0.1, wall = 0.3;
    SheathLook sheath = {.is_there = scene->wire.has_sheath && vec3_is_finite(scene->wire.start) && vec3_norm(scene->wire.direction) > 0,
                         .mouth = scene->wire.start,
                         .direction = vec3_unit_or(scene->wire.direction, vec3(1, 0, 0)),
                         .attenuation = 0.15};
    for (int k = 0; k < tools->count; k++)
        for (int which = 0; which <= EXCHANGES_MOST; which++) {
            const ToolLook *look = tool_looks_of(tools, k, which);
            for (int i = 0; i < look->stretch_count; i++)
                sheath.lumen = fmax(sheath.lumen, look->stretch[i].radius + play);
        }
    sheath.radius = sheath.lumen + wall;
    return sheath;
}
