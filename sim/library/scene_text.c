// Numbers are written with 17 digits, so that they are read back bit for bit.
#include "sim/library/scene_text.h"

#include "sim/library/context.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

typedef struct Writer {
    FILE *stream;
    const char *trouble;
} Writer;

static const char *const tool_kind[] = {"wire", "microcatheter", "catheter", "guide_catheter"};

void sel_vessel_options_init(SelVesselOptions *options, size_t size)
{
    SelVesselOptions own = {.direction = {1, 0, 0}, .normal = {0, 1, 0}};
    result_give(options, size, &own, sizeof own);
}

void sel_tool_options_init(SelToolOptions *options, size_t size)
{
    SelToolOptions own = {.length_mm = -1,
                          .inserted_mm = -1,
                          .elements = -1,
                          .damping_mass_1_s = -1,
                          .damping_stiffness_s = -1,
                          .hand_limit_n = -1,
                          .valve_n = -1,
                          .friction_inside = -1};
    result_give(options, size, &own, sizeof own);
}

void sel_scene_options_init(SelSceneOptions *options, size_t size)
{
    SelSceneOptions own = {.path = "scene.yaml", .is_at_inlet = 1, .direction = {1, 0, 0}, .step_ms = 1};
    result_give(options, size, &own, sizeof own);
}

// --- YAML ---

static void put(Writer *w, const char *format, ...) __attribute__((format(printf, 2, 3)));
static void put(Writer *w, const char *format, ...)
{
    va_list list;
    va_start(list, format);
    vfprintf(w->stream, format, list);
    va_end(list);
}

// Any text can be in double quotes; control characters become spaces.
static void put_text(Writer *w, const char *text)
{
    fputc('"', w->stream);
    for (; *text; text++) {
        if (*text == '"' || *text == '\\')
            fputc('\\', w->stream);
        fputc((unsigned char)*text < ' ' ? ' ' : *text, w->stream);
    }
    fputc('"', w->stream);
}

static void put_number(Writer *w, const char *key, double value)
{
    if (!isfinite(value))
        w->trouble = "a number is not finite";
    put(w, "%s: %.17g", key, value);
}

// A number below 0 means "not given".
static void put_given(Writer *w, const char *key, double value)
{
    if (value >= 0)
        put_number(w, key, value);
    else if (!(value < 0))
        w->trouble = "a number is not finite";
}

static void put_vector(Writer *w, const char *key, const double v[3])
{
    if (!(isfinite(v[0]) && isfinite(v[1]) && isfinite(v[2])))
        w->trouble = "a number is not finite";
    put(w, "%s: [%.17g, %.17g, %.17g]", key, v[0], v[1], v[2]);
}

// --- the parts of a scene ---

static void put_piece(Writer *w, const SelPiece *piece)
{
    if (piece->angle_deg > 0 || piece->angle_deg < 0) {
        put_number(w, "{arc: {radius_mm", piece->radius_mm);
        put_number(w, ", angle_deg", piece->angle_deg);
        put_number(w, ", plane_deg", piece->plane_deg);
        put(w, "}}");
        return;
    }
    put_number(w, "{line_mm", piece->length_mm);
    put(w, "}");
}

static void put_tube(Writer *w, const SelVesselOptions *v)
{
    put_vector(w, "  tube: {start_mm", v->start_mm);
    put_vector(w, ", direction", v->direction);
    put_vector(w, ", normal", v->normal);
    put_number(w, ", radius_mm", v->radius_mm);
    put(w, ", ends: %s, path: [", v->has_closed_ends ? "closed" : "open");
    for (int i = 0; v->piece && i < v->piece_count; i++) {
        put(w, "%s", i ? ", " : "");
        put_piece(w, &v->piece[i]);
    }
    put(w, "]}\n");
}

static void put_named_source(Writer *w, const char *key, const SelVesselOptions *v, const char *end)
{
    if (!v->name)
        w->trouble = "the vessel has no name";
    put(w, "  %s", key);
    put_text(w, v->name ? v->name : "");
    put(w, "%s\n", end);
}

static void put_source(Writer *w, const SelVesselOptions *v)
{
    switch (v->source) {
    case SEL_VESSEL_SHAPE: put_named_source(w, "shape: {name: ", v, "}"); return;
    case SEL_VESSEL_MODEL: put_named_source(w, "model: ", v, ""); return;
    case SEL_VESSEL_MESH: put_named_source(w, "mesh: ", v, ""); return;
    case SEL_VESSEL_TUBE: put_tube(w, v); return;
    case SEL_VESSEL_PLANE:
        put_vector(w, "  plane: {point_mm", v->start_mm);
        put_vector(w, ", normal", v->normal);
        put(w, "}\n");
        return;
    case SEL_VESSEL_NONE: break;
    }
    w->trouble = "the vessel has no known source";
}

static void put_vessel(Writer *w, const SelVesselOptions *given)
{
    SelVesselOptions vessel;
    sel_vessel_options_init(&vessel, sizeof vessel);
    if (!options_take(&vessel, sizeof vessel, given)) {
        w->trouble = "the vessel's size is not set; begin with sel_vessel_defaults()";
        return;
    }
    if (!given || vessel.source == SEL_VESSEL_NONE)
        return;
    put(w, "vessel:\n");
    put_source(w, &vessel);
    if (vessel.contact) {
        put(w, "  contact: ");
        put_text(w, vessel.contact);
        put(w, "\n");
    }
    put_number(w, "  friction", vessel.friction);
    put(w, "\n");
}

static void put_section(Writer *w, const SelSection *s)
{
    put_number(w, "      - {length_mm", s->length_mm);
    put_number(w, ", diameter_mm", s->diameter_mm);
    put_number(w, ", inner_diameter_mm", s->inner_diameter_mm);
    put_number(w, ", young_modulus_gpa", s->young_modulus_gpa);
    put_number(w, ", poisson_ratio", s->poisson_ratio);
    put_number(w, ", density_g_cm3", s->density_g_cm3);
    put_number(w, ", rest_curvature_1_mm", s->rest_curvature_1_mm);
    put_number(w, ", rest_curvature_plane_deg", s->rest_plane_deg);
    put(w, "}\n");
}

static void put_tool_name(Writer *w, const SelToolOptions *tool, int index, const char *end)
{
    char name[2 * TOOL_NAME_SIZE];
    if (tool->name)
        snprintf(name, sizeof name, "%.32s%s", tool->name, end);      // a name that is one letter too long is refused by the reader
    else
        snprintf(name, sizeof name, "tool%d%s", index + 1, end);
    put_text(w, name);
}

static void put_damping(Writer *w, const SelToolOptions *tool)
{
    if (tool->damping_mass_1_s < 0 && tool->damping_stiffness_s < 0)
        return;
    put_number(w, "\n    damping: {mass_1_s", fmax(tool->damping_mass_1_s, 0));
    put_number(w, ", stiffness_s", fmax(tool->damping_stiffness_s, 0));
    put(w, "}");
}

static void put_tool(Writer *w, const SelToolOptions *tool, int index)
{
    bool is_known = (size_t)tool->kind < sizeof tool_kind / sizeof *tool_kind;
    if (!is_known)
        w->trouble = "a tool's kind is not known";
    put(w, "  - name: ");
    put_tool_name(w, tool, index, "");
    put(w, "\n    kind: %s", is_known ? tool_kind[tool->kind] : "wire");
    if (tool->device) {
        put(w, "\n    device: ");
        put_text(w, tool->device);
    }
    put_given(w, "\n    length_mm", tool->length_mm);
    put_given(w, "\n    inserted_mm", tool->inserted_mm);
    if (tool->elements >= 0)
        put(w, "\n    elements: %d", tool->elements);
    put_damping(w, tool);
    put_given(w, "\n    hand_limit_n", tool->hand_limit_n);
    put_given(w, "\n    valve_n", tool->valve_n);
    put_given(w, "\n    friction_inside", tool->friction_inside);
    put(w, tool->section_count > 0 ? "\n    sections:\n" : "\n");
    for (int i = 0; tool->section && i < tool->section_count; i++)
        put_section(w, &tool->section[i]);
}

// The `size` of the first tool applies to all: it is the stride of the array.
static bool tool_at(const SelSceneOptions *options, int index, SelToolOptions *tool)
{
    sel_tool_options_init(tool, sizeof *tool);
    return options_take(tool, sizeof *tool, (const char *)options->tool + (size_t)index * options->tool->size);
}

static void put_tools(Writer *w, const SelSceneOptions *options)
{
    if (options->tool_count < 1 || options->tool_count > SEL_TOOLS_MOST || !options->tool) {
        w->trouble = "a scene has 1 to 4 tools";
        return;
    }
    put(w, "tools:\n");
    for (int k = 0; k < options->tool_count; k++) {
        SelToolOptions tool;
        if (tool_at(options, k, &tool))
            put_tool(w, &tool, k);
        else
            w->trouble = "a tool's size is not set; begin with sel_tool_defaults()";
    }
}

static void put_sheath(Writer *w, const SelSceneOptions *options)
{
    if (options->is_at_inlet) {
        put(w, "sheath: {inlet: root}\n");
        return;
    }
    put_vector(w, "sheath: {entry_mm", options->entry_mm);
    put_vector(w, ", direction", options->direction);
    put(w, "}\n");
}

static void put_row(Writer *w, const SelSceneOptions *options, const SelScriptRow *row)
{
    put_number(w, "  - {t_s", row->t_s);
    for (int k = 0; k < options->tool_count; k++) {
        static const char *const key[] = {".push_mm_s", ".twist_deg_s"};
        const double value[] = {row->tool[k].push_mm_s, row->tool[k].twist_deg_s};
        SelToolOptions tool;
        tool_at(options, k, &tool);
        for (int i = 0; i < 2; i++) {
            put(w, ", ");
            put_tool_name(w, &tool, k, key[i]);
            put_number(w, "", value[i]);
        }
        put(w, ", ");
        put_tool_name(w, &tool, k, ".released");
        put(w, ": %d", row->tool[k].released != 0);
    }
    put(w, "}\n");
}

static void put_script(Writer *w, const SelSceneOptions *options)
{
    if (options->row_count <= 0 || !options->row)
        return;
    put(w, "script:\n");
    for (int i = 0; i < options->row_count; i++)
        put_row(w, options, &options->row[i]);
}

static void put_targets(Writer *w, const SelSceneOptions *options)
{
    if (options->target_count <= 0 || !options->target)
        return;
    put(w, "targets:\n");
    for (int i = 0; i < options->target_count; i++) {
        const SelTarget *target = &options->target[i];
        put(w, "  - {name: ");
        put_text(w, target->name ? target->name : "target");
        put_vector(w, ", point_mm", target->point_mm);
        put_number(w, ", radius_mm", target->radius_mm);
        put(w, "}\n");
    }
}

char *scene_text(const SelSceneOptions *options, size_t *length, const char **trouble)
{
    char *text = NULL;
    Writer w = {.stream = open_memstream(&text, length)};
    if (!w.stream)
        return NULL;
    put(&w, "seldinger: 1\n");
    put_vessel(&w, options->vessel);
    put_tools(&w, options);
    if (!w.trouble) {
        put_sheath(&w, options);
        put_number(&w, "simulation: {step_ms", options->step_ms);
        put(&w, "}\n");
        put_script(&w, options);
        put_targets(&w, options);
    }
    bool is_whole = fclose(w.stream) == 0;
    *trouble = w.trouble;
    if (is_whole && !w.trouble)
        return text;
    free(text);
    return NULL;
}
