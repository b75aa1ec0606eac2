// The tools of a scene: `wire:`, or `tools:` from the outermost to the innermost, each with its own keys or those of a device file.
//
// Two tools, one in the other, both measured from the sheath's mouth (or the rig's start): the inner one, of length L_i, has a_i beyond the mouth and L_i - a_i
// behind it, where the hand holds it. That hand is behind the outer tool's hub: L_i - a_i >= L_o - a_o. In a rig the first tool lies beyond the start with its
// whole length, a_o = L_o.
#include "sim/scene_reading.h"

#include "base/base.h"
#include "sim/rest_shape.h"

#include <ctype.h>
#include <stdlib.h>
#include <stdio.h>
#include <string.h>

// Attenuation of a catheter: polymer with 20 % by weight of barium sulphate, 1.24 g/cm3, at 60 keV 5.10 cm2/g for the salt and 0.20 for the polymer (NIST
// XCOM): 0.15 /mm. With 30 % it is 0.23; with tungsten or bismuth it is higher.
static const double catheter_attenuation = 0.15;
static const double wire_attenuation = 0.55, marker_attenuation = 1.2,
                    marker_length = 3; // [1/mm], [1/mm], [mm]: chosen by appearance (docs/design.md, "X-ray attenuation")
static const double hand_limit_n = 20;       // about the grip of two fingers
static const double valve_n = 0.2;           // friction of a haemostatic valve opened so that a tool can slide: an assumption
// A lumen lined with PTFE. Handbooks give PTFE on steel 0.04 to 0.1; of the wires that Schroeder measured (Cardiovasc Intervent Radiol 1993;16:93-97) a
// PTFE coat halved the friction of bare steel and a hydrophilic one brought it to a sixth.
static const double friction_inside = 0.05;

// Where a tool's keys come from: the keys given in the scene override those of its device file.
typedef struct ToolSource {
    YamlMap own, device;     // device.value.node 0: none
} ToolSource;

static YamlValue tool_get(const ToolSource *source, const char *key, bool required)
{
    if (!yaml_has(&source->own, key) && yaml_has(&source->device, key))
        return yaml_get(&source->device, key, false);
    return yaml_get(&source->own, key, required);
}

static bool tool_number(const ToolSource *source, const char *key, NumberRange range, double *number)
{
    return yaml_number(tool_get(source, key, false), range, number);
}

// --- one tool ---

static void read_section(YamlValue value, ToolKind kind, WireSection *section)
{
    static const char *const keys[] = {"length_mm",
                                       "diameter_mm",
                                       "inner_diameter_mm",
                                       "young_modulus_gpa",
                                       "poisson_ratio",
                                       "density_g_cm3",
                                       "rest_curvature_1_mm",
                                       "rest_curvature_plane_deg",
                                       "friction",
                                       "attenuation_1_mm",
                                       NULL};
    YamlMap map = yaml_map(value, keys);
    double young = 0, density = 6.45, plane = 0;
    *section = (WireSection){.poisson_ratio = 0.3, .friction = -1, .attenuation = kind == TOOL_WIRE ? wire_attenuation : catheter_attenuation};
    yaml_map_number(&map, "length_mm", true, length_range, &section->length);
    yaml_map_number(&map, "diameter_mm", true, (NumberRange){0, 1000, true}, &section->diameter);
    bool tubular = yaml_map_number(&map, "inner_diameter_mm", false, (NumberRange){0, 1000, false}, &section->inner_diameter);
    if (!tubular && yaml_has(&map, "inner_diameter_mm"))
        section->inner_diameter = NAN;   // unknown rather than solid
    if (tubular && section->diameter > 0 && section->inner_diameter >= section->diameter)
        yaml_fault(yaml_get(&map, "inner_diameter_mm", false), "'inner_diameter_mm' %g is not below 'diameter_mm' %g", section->inner_diameter,
                   section->diameter);
    yaml_map_number(&map, "young_modulus_gpa", true, (NumberRange){0, 1e5, true}, &young);
    yaml_map_number(&map, "poisson_ratio", false, (NumberRange){-0.99, 0.5, false}, &section->poisson_ratio);
    yaml_map_number(&map, "density_g_cm3", false, (NumberRange){0, 100, true}, &density);
    bool bent = yaml_map_number(&map, "rest_curvature_1_mm", false, (NumberRange){-10, 10, false}, &section->rest_curvature);
    if (bent && fabs(section->rest_curvature) * section->diameter / 2 >= 1)
        yaml_fault(yaml_get(&map, "rest_curvature_1_mm", false),
                   "a rest bend of radius %g mm is tighter than the tool's own radius %g mm; expected a curvature below %g 1/mm",
                   1 / fabs(section->rest_curvature), section->diameter / 2, 2 / section->diameter);
    yaml_map_number(&map, "rest_curvature_plane_deg", false, (NumberRange){-36000, 36000, false}, &plane);
    yaml_map_number(&map, "friction", false, friction_range, &section->friction);
    yaml_map_number(&map, "attenuation_1_mm", false, (NumberRange){0, 100, false}, &section->attenuation);
    section->young_modulus = young * per_gpa;
    section->density = density * per_g_cm3;
    section->rest_plane = plane * per_deg;
}

// `rest`: the tool's shape by lines and arcs, as a tube's path; its last piece ends at the tip.
static void read_rest(Reading *reading, YamlValue list, SceneTool *tool, double total)
{
    WireOptions *wire = &tool->wire;
    int before = reading->faults->count, count = yaml_count(list, 1, MOST_PIECES);
    TubePiece *piece = count > 0 ? scene_zeroed(reading, count, sizeof *piece) : NULL;
    double thickest = 0;
    for (int i = 0; i < wire->section_count; i++) {
        thickest = fmax(thickest, wire->section[i].diameter);
        if (wire->section[i].rest_curvature != 0)
            yaml_fault(list, "'rest' and 'rest_curvature_1_mm' of section %d both give a shape; expected only one", i);
    }
    for (int i = 0; piece && i < count; i++)
        if (scene_read_piece(yaml_item(list, i), &piece[i]) && piece[i].angle > 0 && piece[i].arc_radius < thickest)
            yaml_fault(yaml_item(list, i), "an arc of radius %g mm is smaller than the tool's diameter, %g mm; use a larger radius", piece[i].arc_radius,
                       thickest);
    double length = piece ? rest_shape_length(piece, count) : 0;
    if (total > 0 && length > total + 0.01)
        yaml_fault(list, "'rest' is %g mm long, the %s %g mm; expected at most the tool's length (the rest of it stays straight)", length,
                   tool->kind == TOOL_WIRE ? "wire" : "tool", total);
    if (piece && wire->section_count > 0 && reading->faults->count == before) {
        WireSection *cut = rest_shape_sections(wire->section, wire->section_count, piece, count, &wire->section_count);
        free((void *)wire->section);
        wire->section = cut;
        if (!cut)
            faults_add(reading->faults, reading->path, 0, 0, "out of memory");
    }
    free(piece);
}

// `length_mm`: the first section is shortened or lengthened so that the whole tool has this length.
static bool read_length(YamlValue value, WireSection *first, double *total)
{
    double wanted, beyond = *total - first->length;
    if (!yaml_number(value, length_range, &wanted))
        return !value.node;
    if (wanted <= beyond) {
        yaml_fault(value, "'%s' is %g, but the sections beyond the first are %g mm long; expected more than that, since it sets the first one's length",
                   value.name, wanted, beyond);
        return false;
    }
    first->length = wanted - beyond;
    *total = wanted;
    return true;
}

// `shaped_tip`: bent by hand while the wire is outside; the last part of its sections is replaced.
static void read_shaped_tip(YamlValue value, SceneTool *tool)
{
    static const char *const keys[] = {"length_mm", "angle_deg", "mandrel_mm", NULL};
    YamlMap map = yaml_map(value, keys);
    WireOptions *wire = &tool->wire;
    TipShaping tip = {0};
    double angle = 0;
    char why[FAULT_LENGTH / 2];
    bool good = yaml_map_number(&map, "length_mm", true, length_range, &tip.length) &&
                yaml_map_number(&map, "angle_deg", true, (NumberRange){0, 360, true}, &angle) &&
                yaml_map_number(&map, "mandrel_mm", true, (NumberRange){0, 100, true}, &tip.mandrel);
    if (tool->kind != TOOL_WIRE) {
        yaml_fault(value, "'%s' of a %s; only a wire's tip can be shaped by hand; a catheter's shape is given by 'rest'", value.name,
                   tool_kind_name[tool->kind]);
        return;
    }
    if (tool->core == CORE_NITINOL) {
        yaml_fault(value, "'%s' of a core of nitinol, which springs back from any such bend; expected 'core: steel', or a preshaped tip by 'rest'", value.name);
        return;
    }
    if (!good || wire->section_count == 0)
        return;
    tip.angle = angle * per_deg;
    int count;
    WireSection *shaped = tip_shaped_sections(wire->section, wire->section_count, &tip, &count, &tool->tip_shaped, why, sizeof why);
    if (!shaped) {
        yaml_fault(value, "'%s': %s", value.name, why);
        return;
    }
    free((void *)wire->section);
    wire->section = shaped;
    wire->section_count = count;
    tool->tip = tip;
}

static void read_sections(Reading *reading, const ToolSource *source, SceneTool *tool, ToolReading *read)
{
    int before = reading->faults->count;
    YamlValue list = tool_get(source, "sections", true);
    int count = yaml_count(list, 1, MOST_SECTIONS);
    WireSection *section = count > 0 ? scene_zeroed(reading, count, sizeof *section) : NULL;
    tool->wire.section = section;
    tool->wire.section_count = section ? count : 0;
    read->length_known = section != NULL;
    for (int i = 0; section && i < count; i++) {
        read_section(yaml_item(list, i), tool->kind, &section[i]);
        read->length += section[i].length;
        read->length_known &= section[i].length > 0;
    }
    if (read->length_known)
        read->length_known = read_length(yaml_get(&source->own, "length_mm", false), section, &read->length);
    YamlValue rest = tool_get(source, "rest", false);
    if (rest.node)
        read_rest(reading, rest, tool, read->length);
    YamlValue tip = tool_get(source, "shaped_tip", false);
    if (tip.node && read->length_known && reading->faults->count == before)
        read_shaped_tip(tip, tool);
    read->sound = reading->faults->count == before;
}

static void read_title(const ToolSource *source, SceneTool *tool)
{
    YamlValue value = tool_get(source, "title", false);
    const char *title;
    if (value.node && yaml_text(value, &title))
        snprintf(tool->title, sizeof tool->title, "%s", title);
}

// Keys common to `wire:` and an entry of `tools:`.
static void read_tool(Reading *reading, const ToolSource *source, SceneTool *tool, ToolReading *read)
{
    static const char *const marker_keys[] = {"length_mm", "attenuation_1_mm", NULL};
    static const char *const damping_keys[] = {"mass_1_s", "stiffness_s", NULL};
    WireOptions *wire = &tool->wire;
    wire->elements = 200;
    wire->hand_limit = hand_limit_n;
    wire->valve_friction = valve_n;
    tool->marker_length = marker_length;
    tool->marker_attenuation = marker_attenuation;
    tool->friction_inside = friction_inside;
    read_title(source, tool);
    YamlValue core = tool_get(source, "core", false);
    int metal = core.node ? yaml_choice(core, tool_core_name) : -1;
    tool->core = metal >= 0 ? (ToolCore)metal : CORE_STEEL;
    YamlValue elements = tool_get(source, "elements", false);
    if (elements.node)
        yaml_integer(elements, 1, MOST_ELEMENTS, &wire->elements);
    YamlMap damping = yaml_map(tool_get(source, "damping", false), damping_keys);
    double mass = 0, stiffness = 0;
    yaml_map_number(&damping, "mass_1_s", false, (NumberRange){0, 1e6, false}, &mass);
    yaml_map_number(&damping, "stiffness_s", false, (NumberRange){0, 1000, false}, &stiffness);
    wire->damping_mass = mass / per_second;
    wire->damping_stiffness = stiffness * per_second;
    tool_number(source, "hand_limit_n", (NumberRange){0, 1e6, false}, &wire->hand_limit);
    tool_number(source, "valve_n", (NumberRange){0, 1e6, false}, &wire->valve_friction);
    YamlMap marker = yaml_map(tool_get(source, "tip_marker", false), marker_keys);
    yaml_map_number(&marker, "length_mm", false, (NumberRange){0, 1000, false}, &tool->marker_length);
    yaml_map_number(&marker, "attenuation_1_mm", false, (NumberRange){0, 100, false}, &tool->marker_attenuation);
    read_sections(reading, source, tool, read);
}

static void publish_first(Reading *reading)
{
    Scene *scene = reading->scene;
    scene->wire = scene->tool[0].wire;
    scene->wire.direction = vec3(1, 0, 0);
    scene->marker_length = scene->tool[0].marker_length;
    scene->marker_attenuation = scene->tool[0].marker_attenuation;
    reading->total_length = reading->tool[0].length;
}

void scene_read_wire(Reading *reading, YamlValue value)
{
    static const char *const keys[] = {"title", "core", "elements", "sections", "rest", "shaped_tip", "damping", "tip_marker", "hand_limit_n", "valve_n", NULL};
    ToolSource source = {.own = yaml_map(value, keys)};
    SceneTool *tool = &reading->scene->tool[0];
    reading->scene->tool_count = 1;
    reading->tool[0].whole = value;
    strcpy(tool->name, "wire");
    tool->kind = TOOL_WIRE;
    read_tool(reading, &source, tool, &reading->tool[0]);
    publish_first(reading);
}

// --- several tools ---

static YamlMap device_map_of(YamlReader *reader)
{
    static const char *const keys[] = {"seldinger", "title", "kind",       "source",  "uncertainty", "bending_n_mm2", "goes_through", "elements",        "core",
                                       "sections",  "rest",  "shaped_tip", "damping", "tip_marker",  "hand_limit_n",  "valve_n",      "friction_inside", NULL};
    YamlValue root = yaml_root(reader);
    strcpy(root.name, "device");
    return yaml_map(root, keys);
}

bool scene_device_kind(const char *text, size_t length, const char *path, ToolKind *kind, Faults *faults)
{
    YamlReader *reader = yaml_reader_open(text, length, path, faults);
    YamlMap map = reader ? device_map_of(reader) : (YamlMap){0};
    YamlValue value = map.value.node ? yaml_get(&map, "kind", true) : (YamlValue){0};
    int choice = value.node ? yaml_choice(value, tool_kind_name) : -1;
    yaml_reader_close(reader);
    *kind = choice >= 0 ? (ToolKind)choice : TOOL_WIRE;
    return choice >= 0;
}

// Keys of a device file that describe the device. `bending_n_mm2` is the bending stiffness that its source gives for the first section: the section's modulus
// and diameters must reproduce it.
static void check_device(const ToolSource *source, const SceneTool *tool, bool sound)
{
    static const char *const texts[] = {"source", "uncertainty", "goes_through", NULL};
    const YamlMap *device = &source->device;
    const char *text;
    int version;
    double quoted;
    if (!device->value.node)
        return;
    yaml_integer(yaml_get(device, "seldinger", true), 1, 1, &version);
    for (int i = 0; texts[i]; i++)
        yaml_text(yaml_get(device, texts[i], false), &text);
    if (!yaml_map_number(device, "bending_n_mm2", false, (NumberRange){0, 1e9, true}, &quoted) || !sound || yaml_has(&source->own, "sections"))
        return;
    double bending = wire_stiffness(&tool->wire.section[0]).bending;
    if (fabs(bending - quoted) > 0.01 * quoted)
        yaml_fault(yaml_get(device, "bending_n_mm2", false),
                   "'bending_n_mm2' is %g, but modulus and diameters of the first section give %.4g; expected agreement within 1 %%", quoted, bending);
}

static void read_name(Reading *reading, YamlValue value, int index)
{
    Scene *scene = reading->scene;
    const char *name;
    if (!yaml_text(value, &name))
        return;
    if (strlen(name) >= TOOL_NAME_SIZE) {
        yaml_fault(value, "a tool's name has at most %d letters", TOOL_NAME_SIZE - 1);
        return;
    }
    for (const char *c = name; *c; c++)
        if (*c == '.' || *c == ',' || isspace((unsigned char)*c) || iscntrl((unsigned char)*c)) {
            yaml_fault(value,
                       "the tool's name '%s' has a dot, a comma or a space; scripts head their columns NAME.push_mm_s, so write 'guide_catheter', not 'guide "
                       "catheter'",
                       name);
            return;
        }
    for (int k = 0; k < index; k++)
        if (!strcmp(name, scene->tool[k].name)) {
            int line, column;
            yaml_place(reading->tool[k].whole, &line, &column);
            yaml_fault(value, "the name '%s' is already used on line %d; expected distinct names", name, line);
            return;
        }
    strcpy(scene->tool[index].name, name);
}

// Keys common to an entry of `tools:` and one of `exchange:`, from the scene or a device file.
static void read_device(Reading *reading, ToolSource *source, SceneTool *tool, ToolReading *read, bool needs_kind)
{
    YamlReader *device = NULL;
    const char *file;
    if (yaml_has(&source->own, "device")) {
        if (yaml_text(yaml_get(&source->own, "device", false), &file))
            tool->device_path = scene_resolved(reading, file);
        size_t length;
        char *text = tool->device_path ? text_file_read(tool->device_path, &length, reading->faults) : NULL;
        device = text ? yaml_reader_open(text, length, tool->device_path, reading->faults) : NULL;
        free(text);
        if (!device)
            return;          // its keys may be missing
        source->device = device_map_of(device);
    }
    YamlValue kind = tool_get(source, "kind", needs_kind);
    int choice = kind.node ? yaml_choice(kind, tool_kind_name) : -1;
    if (choice >= 0)
        tool->kind = (ToolKind)choice;
    read_tool(reading, source, tool, read);
    check_device(source, tool, read->sound);
    tool_number(source, "friction_inside", friction_range, &tool->friction_inside);
    yaml_reader_close(device);
}

static void read_exchange(Reading *reading, YamlValue list, int index)
{
    static const char *const keys[] = {"device", "title",      "core",    "length_mm",  "friction_inside", "elements", "sections",
                                       "rest",   "shaped_tip", "damping", "tip_marker", "hand_limit_n",    "valve_n",  NULL};
    Scene *scene = reading->scene;
    int count = list.node ? yaml_count(list, 1, EXCHANGES_MOST) : 0;
    for (int i = 0; i < count; i++) {
        SceneExchange *e = &scene->exchange[scene->exchange_count];
        ToolReading *read = &reading->exchange[scene->exchange_count];
        ToolSource source = {.own = yaml_map(yaml_item(list, i), keys)};
        *read = (ToolReading){.whole = yaml_item(list, i)};
        if (!source.own.value.node)
            continue;
        scene->exchange_count++;
        e->tool = index;
        e->device.kind = scene->tool[index].kind;
        snprintf(e->device.name, sizeof e->device.name, "%s", scene->tool[index].name);
        read_device(reading, &source, &e->device, read, false);
    }
}

static void read_entry(Reading *reading, YamlValue value, int index)
{
    static const char *const keys[] = {"name",     "title", "kind",       "device",  "core",       "length_mm",    "inserted_mm", "friction_inside", "elements",
                                       "sections", "rest",  "shaped_tip", "damping", "tip_marker", "hand_limit_n", "valve_n",     "exchange",        NULL};
    ToolReading *read = &reading->tool[index];
    ToolSource source = {.own = yaml_map(value, keys)};
    read->whole = value;
    if (!source.own.value.node)
        return;
    read_name(reading, yaml_get(&source.own, "name", true), index);
    read_device(reading, &source, &reading->scene->tool[index], read, true);
    read->inserted = yaml_get(&source.own, "inserted_mm", false);
    read->inserted_known = yaml_number(read->inserted, (NumberRange){0, read->length_known ? read->length : 1e5, false}, &read->inserted_mm);
    read_exchange(reading, yaml_get(&source.own, "exchange", false), index);
}

void scene_read_tools(Reading *reading, YamlValue value)
{
    Scene *scene = reading->scene;
    int count = yaml_count(value, 1, 1000);
    if (count > TOOLS_MOST)
        yaml_fault(yaml_item(value, TOOLS_MOST), "'%s' has %d tools; expected at most %d, from the outermost to the innermost", value.name, count, TOOLS_MOST);
    scene->tool_count = count < 0 ? 0 : count < TOOLS_MOST ? count : TOOLS_MOST;
    scene->exchange = scene_zeroed(reading, TOOLS_MOST * EXCHANGES_MOST, sizeof *scene->exchange);
    if (!scene->exchange)
        return;
    for (int k = 0; k < scene->tool_count; k++)
        read_entry(reading, yaml_item(value, k), k);
    if (scene->tool_count > 0)
        publish_first(reading);
}

// --- one tool in another ---

static const char *called(const SceneTool *tool, const ToolReading *read) { return tool->name[0] ? tool->name : read->whole.name; }

// Uses only what is known of both tools: a section with a fault counts neither as thick nor as narrow.
static void check_lumen(const ToolReading *read, const SceneTool *inner, const ToolReading *around, const SceneTool *outer)
{
    const char *inner_name = called(inner, read), *outer_name = called(outer, around);
    double thickest = 0, narrowest = HUGE_VAL;
    for (int i = 0; i < inner->wire.section_count; i++)
        thickest = fmax(thickest, inner->wire.section[i].diameter);
    for (int i = 0; i < outer->wire.section_count; i++)
        narrowest = fmin(narrowest, outer->wire.section[i].inner_diameter);
    if (narrowest <= 0)
        yaml_fault(read->whole, "'%s' lies in '%s', which is solid; give each section of '%s' an 'inner_diameter_mm' above %g", inner_name, outer_name,
                   outer_name, thickest);
    else if (thickest >= narrowest)
        yaml_fault(read->whole, "'%s' is up to %g mm thick, but the lumen of '%s' around it is only %g mm wide; expected a thinner tool, or a wider lumen",
                   inner_name, thickest, outer_name, narrowest);
}

// Checks that the inner tool's proximal end lies behind the outer tool's hub.
static void check_hub(const ToolReading *read, const SceneTool *inner, const ToolReading *around, const SceneTool *outer, double outer_inserted)
{
    const char *inner_name = called(inner, read), *outer_name = called(outer, around);
    double behind = around->length - outer_inserted, least = inner->wire.inserted + behind, rounding = 1e-9 * around->length;
    if (read->length >= least - rounding)
        return;
    YamlValue place = read->inserted.node ? read->inserted : read->whole;
    if (read->length > behind)
        yaml_fault(place,
                   "'%s' is %g mm long with %g mm inserted, so its proximal end lies within '%s', which has %g mm outside; make it at least %g mm long or "
                   "insert at most %g mm",
                   inner_name, read->length, inner->wire.inserted, outer_name, behind, least, read->length - behind);
    else
        yaml_fault(place, "'%s' is %g mm long, but '%s' around it has %g mm outside; make it at least %g mm long", inner_name, read->length, outer_name, behind,
                   least);
}

// Checks that each device fits into all that may be around it, and around all that may be within it.
static void check_exchanges(const Reading *reading)
{
    const Scene *scene = reading->scene;
    if (scene->exchange_count > 0 && scene->tool_count == 1)
        yaml_fault(reading->exchange[0].whole,
                   "the scene has one tool; an exchange needs two or more, since a tool is exchanged over the one within it or inside the one around it");
    for (int i = 0; i < scene->exchange_count; i++) {
        const SceneExchange *e = &scene->exchange[i];
        if (e->tool > 0)
            check_lumen(&reading->exchange[i], &e->device, &reading->tool[e->tool - 1], &scene->tool[e->tool - 1]);
        if (e->tool + 1 < scene->tool_count)
            check_lumen(&reading->tool[e->tool + 1], &scene->tool[e->tool + 1], &reading->exchange[i], &e->device);
        for (int j = 0; j < scene->exchange_count; j++)
            if (scene->exchange[j].tool == e->tool + 1)
                check_lumen(&reading->exchange[j], &scene->exchange[j].device, &reading->exchange[i], &e->device);
    }
}

void scene_settle_tools(Reading *reading, bool placed)
{
    Scene *scene = reading->scene;
    ToolReading *first = &reading->tool[0];
    if (scene->tool_count == 0)
        return;
    if (first->inserted_known && scene->wire.has_sheath)
        scene->wire.inserted = first->inserted_mm;
    else if (first->inserted.node && placed && !scene->wire.has_sheath)
        yaml_fault(first->inserted, "'%s' needs a sheath; in a rig the whole first tool lies beyond the start", first->inserted.name);
    scene->tool[0].wire = scene->wire;
    double around = scene->wire.has_sheath ? scene->wire.inserted : first->length;
    for (int k = 1; k < scene->tool_count; k++) {
        ToolReading *read = &reading->tool[k];
        scene->tool[k].wire.inserted = read->inserted_known ? read->inserted_mm : around;
        scene->tool[k].wire = scene_tool_wire(scene, k);
        check_lumen(read, &scene->tool[k], read - 1, &scene->tool[k - 1]);
        if (placed && read->length_known && read[-1].length_known && (read->inserted_known || !read->inserted.node))
            check_hub(read, &scene->tool[k], read - 1, &scene->tool[k - 1], around);
        around = scene->tool[k].wire.inserted;
    }
    check_exchanges(reading);
}
