// YAML text to a Scene in internal units: mm, g, ms (N, MPa, mJ), rad. The only place where a scene's units are converted.
// One function a part of the file; each reads on after a fault, so one pass finds all.
#include "sim/scene.h"

#include "input/number_table.h"
#include "input/text_file.h"
#include "input/yaml_reader.h"
#include "sim/rest_shape.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double per_gpa = 1000;            // MPa
static const double per_g_cm3 = 1e-3;          // g/mm3
static const double per_second = 1000;         // ms
static const double per_deg = PI / 180;        // rad
static const double per_m_s2 = 1e-3;           // mm/ms2

static const double farthest_mm = 1e5;
enum { MOST_SECTIONS = 1000, MOST_PIECES = 10000, MOST_LOADS = 1000, MOST_TARGETS = 1000, MOST_ROWS = 100000, MOST_ELEMENTS = 10000 };

typedef struct Reading {
    Scene *scene;
    YamlReader *reader;
    const char *path;
    Faults *faults;
    double total_length;     // of the wire; 0 until known
} Reading;

static const NumberRange length_range = {0, 1e5, true}, friction_range = {0, 10, false};

static void *zeroed(Reading *reading, int count, size_t size)
{
    void *memory = calloc((size_t)count + 1, size);
    if (!memory)
        faults_add(reading->faults, reading->path, 0, 0, "no memory");
    return memory;
}

static char *resolved(Reading *reading, const char *name)
{
    char *path = text_file_beside(reading->path, name);
    if (!path)
        faults_add(reading->faults, reading->path, 0, 0, "no memory");
    return path;
}

// --- vessel ---

static void read_shape(Reading *reading, YamlValue value)
{
    Scene *scene = reading->scene;
    YamlMap map = yaml_map(value, NULL);
    const char *text, *key;
    if (!map.value.node)
        return;
    if (yaml_text(yaml_get(&map, "name", true), &text)) {
        if (strlen(text) < sizeof scene->shape_name)
            strcpy(scene->shape_name, text);
        else
            yaml_fault(yaml_get(&map, "name", false), "a shape's name has at most %zu letters", sizeof scene->shape_name - 1);
    }
    YamlValue option;
    int count = 0;
    while (yaml_pair(&map, count, &key, &option))
        count++;
    scene->shape_option = zeroed(reading, count, sizeof *scene->shape_option);
    for (int i = 0; scene->shape_option && i < count; i++) {
        yaml_pair(&map, i, &key, &option);
        if (!key || !strcmp(key, "name") || !yaml_text(option, &text))
            continue;
        if (strlen(key) >= 64 || strlen(text) >= 64) {
            yaml_fault(option, "option and value have at most 63 letters");
            continue;
        }
        strcpy(scene->shape_option[scene->shape_option_count][0], key);
        strcpy(scene->shape_option[scene->shape_option_count++][1], text);
    }
}

static bool read_piece(YamlValue value, TubePiece *piece)
{
    static const char *const kinds[] = {"line_mm", "arc", NULL};
    static const char *const arc_keys[] = {"radius_mm", "angle_deg", "plane_deg", NULL};
    YamlMap map = yaml_map(value, kinds);
    if (!map.value.node)
        return false;
    bool line = yaml_has(&map, "line_mm"), arc = yaml_has(&map, "arc");
    if (line == arc) {
        yaml_fault(value, "'%s' is one piece: either {line_mm: 10} or {arc: {radius_mm: 15, angle_deg: 90}}", value.name);
        return false;
    }
    if (line)
        return yaml_map_number(&map, "line_mm", true, length_range, &piece->length);
    YamlMap bend = yaml_map(yaml_get(&map, "arc", true), arc_keys);
    double angle = 0, plane = 0;
    bool good = yaml_map_number(&bend, "radius_mm", true, length_range, &piece->arc_radius);
    good &= yaml_map_number(&bend, "angle_deg", true, (NumberRange){0, 36000, true}, &angle);
    yaml_map_number(&bend, "plane_deg", false, (NumberRange){-36000, 36000, false}, &plane);
    piece->angle = angle * per_deg;
    piece->plane = plane * per_deg;
    return good;
}

static void read_polyline(Reading *reading, YamlValue value)
{
    TubeOptions *tube = &reading->scene->tube;
    const char *name;
    if (!yaml_text(value, &name))
        return;
    char *path = resolved(reading, name);
    size_t length;
    char *text = path ? text_file_read(path, &length, reading->faults) : NULL;
    NumberTable *table = text ? number_table_parse(text, length, path, "x_mm,y_mm,z_mm", reading->faults) : NULL;
    if (table && table->row_count < 2)
        faults_add(reading->faults, path, 1, 1, "has %d points; a polyline has at least 2", table->row_count);
    Vec3 *point = table ? zeroed(reading, table->row_count, sizeof *point) : NULL;
    if (point) {
        for (int i = 0; i < table->row_count; i++) {
            const double *row = table->value + (size_t)i * 3;
            point[i] = vec3(row[0], row[1], row[2]);
            if (fabs(row[0]) > farthest_mm || fabs(row[1]) > farthest_mm || fabs(row[2]) > farthest_mm)
                faults_add(reading->faults, path, table->line[i], 1, "a coordinate is beyond +-%g mm", farthest_mm);
            if (i && vec3_distance(point[i], point[i - 1]) < 1e-9)
                faults_add(reading->faults, path, table->line[i], 1, "the point repeats the one before it; neighbours differ");
        }
        tube->point = point;
        tube->point_count = table->row_count;
    }
    number_table_free(table);
    free(text);
    free(reading->scene->tube_points_path);
    reading->scene->tube_points_path = path;
}

static void read_tube(Reading *reading, YamlValue value)
{
    static const char *const keys[] = {"start_mm", "direction", "normal", "radius_mm", "path", "points", "ends", NULL};
    static const char *const ends[] = {"open", "closed", NULL};
    TubeOptions *tube = &reading->scene->tube;
    YamlMap map = yaml_map(value, keys);
    tube->direction = vec3(1, 0, 0);
    yaml_map_vector(&map, "start_mm", false, farthest_mm, &tube->start);
    yaml_map_unit_vector(&map, "direction", false, &tube->direction);
    tube->normal = vec3_normal_to(tube->direction);
    if (yaml_map_unit_vector(&map, "normal", false, &tube->normal) && vec3_norm(vec3_cross(tube->normal, tube->direction)) < 1e-6)
        yaml_fault(yaml_get(&map, "normal", false), "'normal' lies along 'direction'; arcs turn towards it, so it points elsewhere");
    yaml_map_number(&map, "radius_mm", true, length_range, &tube->radius);
    tube->closed_ends = yaml_has(&map, "ends") && yaml_choice(yaml_get(&map, "ends", false), ends) == 1;
    if (map.value.node && yaml_has(&map, "path") == yaml_has(&map, "points")) {
        yaml_fault(value, "'%s' has one of 'path' (lines and arcs) and 'points' (a polyline file)", value.name);
        return;
    }
    if (yaml_has(&map, "points")) {
        read_polyline(reading, yaml_get(&map, "points", false));
        return;
    }
    YamlValue list = yaml_get(&map, "path", false);
    int count = yaml_count(list, 1, MOST_PIECES);
    TubePiece *piece = count > 0 ? zeroed(reading, count, sizeof *piece) : NULL;
    tube->piece = piece;
    tube->piece_count = piece ? count : 0;
    for (int i = 0; piece && i < count; i++) {
        YamlValue item = yaml_item(list, i);
        if (read_piece(item, &piece[i]) && piece[i].angle > 0 && tube->radius > 0 && piece[i].arc_radius <= tube->radius)
            yaml_fault(item, "an arc of radius %g mm is tighter than the lumen's radius %g mm; make it larger", piece[i].arc_radius, tube->radius);
    }
}

static void read_plane(Reading *reading, YamlValue value)
{
    static const char *const keys[] = {"point_mm", "normal", NULL};
    YamlMap map = yaml_map(value, keys);
    reading->scene->plane_normal = vec3(0, 0, 1);
    yaml_map_vector(&map, "point_mm", false, farthest_mm, &reading->scene->plane_point);
    yaml_map_unit_vector(&map, "normal", true, &reading->scene->plane_normal);
}

const char *const contact_name[CONTACT_COUNT + 1] = {"lim", "mesh", "tube", "smooth_mesh", "flat_mesh", "grid", "lim_blend", "lim_switch", NULL};

static void read_contact(const YamlMap *map, Scene *scene)
{
    bool exact = scene->source == SOURCE_TUBE || scene->source == SOURCE_PLANE;
    scene->contact = exact ? CONTACT_TUBE : scene->source == SOURCE_MESH ? CONTACT_MESH : CONTACT_LIM;
    YamlValue contact = yaml_get(map, "contact", false);
    int choice = contact.node ? yaml_choice(contact, contact_name) : -1;
    if (choice >= 0)
        scene->contact = (ContactKind)choice;
    if (choice == CONTACT_TUBE && (scene->source == SOURCE_MODEL || scene->source == SOURCE_SHAPE || scene->source == SOURCE_MESH))
        yaml_fault(contact, "contact 'tube' needs the source 'tube'; a model or shape has lim, lim_blend, lim_switch, mesh, "
                            "smooth_mesh, flat_mesh or grid");
    else if (choice >= 0 && contact_is_fitted((ContactKind)choice) && scene->source == SOURCE_MESH)
        yaml_fault(contact, "contact '%s' needs a fitted model: make it with `seldinger import` and `fit`; a mesh has mesh, smooth_mesh, flat_mesh or grid",
                   contact_name[choice]);
}

static void read_vessel(Reading *reading, YamlValue value)
{
    static const char *const keys[] = {"model", "shape", "tube", "plane", "mesh", "mesh_scale", "mesh_cell_mm", "contact", "friction", NULL};
    static const VesselSourceKind source[] = {SOURCE_MODEL, SOURCE_SHAPE, SOURCE_TUBE, SOURCE_PLANE, SOURCE_MESH};
    Scene *scene = reading->scene;
    YamlMap map = yaml_map(value, keys);
    scene->source = SOURCE_NONE;
    if (!map.value.node)
        return;
    int sources = 0;
    for (int i = 0; i < 5; i++) {
        if (!yaml_has(&map, keys[i]))
            continue;
        if (++sources > 1)
            yaml_fault(yaml_get(&map, keys[i], false), "a second source '%s'; a vessel has exactly one of model, shape, tube, plane, mesh", keys[i]);
        scene->source = source[i];
    }
    if (sources == 0)
        yaml_fault(value, "'vessel' has no source; exactly one of model, shape, tube, plane, mesh");
    const char *text;
    if (yaml_has(&map, "model") && yaml_text(yaml_get(&map, "model", false), &text))
        scene->model_path = resolved(reading, text);
    if (yaml_has(&map, "shape"))
        read_shape(reading, yaml_get(&map, "shape", false));
    if (yaml_has(&map, "tube"))
        read_tube(reading, yaml_get(&map, "tube", false));
    if (yaml_has(&map, "plane"))
        read_plane(reading, yaml_get(&map, "plane", false));
    if (yaml_has(&map, "mesh") && yaml_text(yaml_get(&map, "mesh", false), &text))
        scene->mesh_path = resolved(reading, text);
    if (yaml_has(&map, "mesh_scale") && scene->source != SOURCE_MESH)
        yaml_fault(yaml_get(&map, "mesh_scale", false), "'mesh_scale' goes with the source 'mesh'");
    yaml_map_number(&map, "mesh_scale", false, (NumberRange){0, 1e9, true}, &scene->mesh_scale);
    yaml_map_number(&map, "mesh_cell_mm", false, (NumberRange){0, 100, true}, &scene->mesh_cell);
    read_contact(&map, scene);
    yaml_map_number(&map, "friction", false, friction_range, &scene->friction);
}

// --- wire, sheath, rig ---

static const double wire_attenuation = 0.55, marker_attenuation = 1.2, marker_length = 3;   // DESIGN section 8, what convinced

static void read_section(YamlValue value, WireSection *section)
{
    static const char *const keys[] = {"length_mm",     "diameter_mm",          "inner_diameter_mm",        "young_modulus_gpa", "poisson_ratio",
                                       "density_g_cm3", "rest_curvature_1_mm", "rest_curvature_plane_deg", "friction",
                                       "attenuation_1_mm", NULL};
    YamlMap map = yaml_map(value, keys);
    double young = 0, density = 6.45, plane = 0;
    *section = (WireSection){.poisson_ratio = 0.3, .friction = -1, .attenuation = wire_attenuation};
    yaml_map_number(&map, "length_mm", true, (NumberRange){0, 1e5, true}, &section->length);
    yaml_map_number(&map, "diameter_mm", true, (NumberRange){0, 1000, true}, &section->diameter);
    bool tubular = yaml_map_number(&map, "inner_diameter_mm", false, (NumberRange){0, 1000, false}, &section->inner_diameter);
    if (tubular && section->diameter > 0 && section->inner_diameter >= section->diameter)
        yaml_fault(yaml_get(&map, "inner_diameter_mm", false), "'inner_diameter_mm' %g is not below 'diameter_mm' %g", section->inner_diameter,
                   section->diameter);
    yaml_map_number(&map, "young_modulus_gpa", true, (NumberRange){0, 1e5, true}, &young);
    yaml_map_number(&map, "poisson_ratio", false, (NumberRange){-0.99, 0.5, false}, &section->poisson_ratio);
    yaml_map_number(&map, "density_g_cm3", false, (NumberRange){0, 100, true}, &density);
    yaml_map_number(&map, "rest_curvature_1_mm", false, (NumberRange){-10, 10, false}, &section->rest_curvature);
    yaml_map_number(&map, "rest_curvature_plane_deg", false, (NumberRange){-36000, 36000, false}, &plane);
    yaml_map_number(&map, "friction", false, friction_range, &section->friction);
    yaml_map_number(&map, "attenuation_1_mm", false, (NumberRange){0, 100, false}, &section->attenuation);
    section->young_modulus = young * per_gpa;
    section->density = density * per_g_cm3;
    section->rest_plane = plane * per_deg;
}

// `rest`: the tool's shape by lines and arcs, as a tube's path; its last piece ends at the tip.
static void read_rest(Reading *reading, YamlValue list)
{
    WireOptions *wire = &reading->scene->wire;
    int before = reading->faults->count, count = yaml_count(list, 1, MOST_PIECES);
    TubePiece *piece = count > 0 ? zeroed(reading, count, sizeof *piece) : NULL;
    double thickest = 0;
    for (int i = 0; i < wire->section_count; i++) {
        thickest = fmax(thickest, wire->section[i].diameter);
        if (wire->section[i].rest_curvature != 0)
            yaml_fault(list, "'rest' and 'rest_curvature_1_mm' of section %d both give a shape; one of them", i);
    }
    for (int i = 0; piece && i < count; i++)
        if (read_piece(yaml_item(list, i), &piece[i]) && piece[i].angle > 0 && piece[i].arc_radius < thickest)
            yaml_fault(yaml_item(list, i), "an arc of radius %g mm is tighter than the tool is thick, %g mm; make it larger", piece[i].arc_radius, thickest);
    double length = piece ? rest_shape_length(piece, count) : 0;
    if (reading->total_length > 0 && length > reading->total_length + 0.01)
        yaml_fault(list, "'rest' is %g mm long, the wire %g mm; at most as long, what it leaves at the proximal end is straight", length,
                   reading->total_length);
    if (piece && wire->section_count > 0 && reading->faults->count == before) {
        WireSection *cut = rest_shape_sections(wire->section, wire->section_count, piece, count, &wire->section_count);
        free((void *)wire->section);
        wire->section = cut;
        if (!cut)
            faults_add(reading->faults, reading->path, 0, 0, "no memory");
    }
    free(piece);
}

static const double hand_limit_n = 20;       // about what two fingers hold

static void read_wire(Reading *reading, YamlValue value)
{
    static const char *const keys[] = {"elements", "sections", "rest", "damping", "tip_marker", "hand_limit_n", NULL};
    static const char *const marker_keys[] = {"length_mm", "attenuation_1_mm", NULL};
    static const char *const damping_keys[] = {"mass_1_s", "stiffness_s", NULL};
    WireOptions *wire = &reading->scene->wire;
    YamlMap map = yaml_map(value, keys);
    wire->elements = 200;
    if (yaml_has(&map, "elements"))
        yaml_integer(yaml_get(&map, "elements", false), 1, MOST_ELEMENTS, &wire->elements);
    YamlMap damping = yaml_map(yaml_get(&map, "damping", false), damping_keys);
    double mass = 0, stiffness = 0;
    yaml_map_number(&damping, "mass_1_s", false, (NumberRange){0, 1e6, false}, &mass);
    yaml_map_number(&damping, "stiffness_s", false, (NumberRange){0, 1000, false}, &stiffness);
    wire->damping_mass = mass / per_second;
    wire->damping_stiffness = stiffness * per_second;
    wire->hand_limit = hand_limit_n;
    yaml_map_number(&map, "hand_limit_n", false, (NumberRange){0, 1e6, false}, &wire->hand_limit);
    YamlMap marker = yaml_map(yaml_get(&map, "tip_marker", false), marker_keys);
    yaml_map_number(&marker, "length_mm", false, (NumberRange){0, 1000, false}, &reading->scene->marker_length);
    yaml_map_number(&marker, "attenuation_1_mm", false, (NumberRange){0, 100, false}, &reading->scene->marker_attenuation);

    YamlValue list = yaml_get(&map, "sections", true);
    int count = yaml_count(list, 1, MOST_SECTIONS);
    WireSection *section = count > 0 ? zeroed(reading, count, sizeof *section) : NULL;
    wire->section = section;
    wire->section_count = section ? count : 0;
    for (int i = 0; section && i < count; i++) {
        read_section(yaml_item(list, i), &section[i]);
        reading->total_length += section[i].length;
    }
    if (yaml_has(&map, "rest"))
        read_rest(reading, yaml_get(&map, "rest", false));
}

// `normal` of a sheath or rig: the direction to which a rest curvature with plane 0 bends; default vec3_normal_to(direction).
static void read_normal(const YamlMap *map, WireOptions *wire)
{
    if (yaml_map_unit_vector(map, "normal", false, &wire->normal) && vec3_norm(vec3_cross(wire->normal, wire->direction)) < 1e-6)
        yaml_fault(yaml_get(map, "normal", false), "'normal' lies along 'direction'; it points across the tool");
}

static void read_sheath(Reading *reading, YamlValue value)
{
    static const char *const keys[] = {"entry_mm", "inlet", "direction", "normal", "inserted_mm", NULL};
    static const char *const inlets[] = {"root", NULL};
    WireOptions *wire = &reading->scene->wire;
    YamlMap map = yaml_map(value, keys);
    wire->has_sheath = true;
    if (!map.value.node)
        return;
    if (yaml_has(&map, "inlet") && yaml_has(&map, "entry_mm"))
        yaml_fault(yaml_get(&map, "inlet", false), "'sheath' has one of 'entry_mm' with 'direction', and 'inlet: root'");
    else if (yaml_has(&map, "inlet"))
        reading->scene->inlet_is_root = yaml_choice(yaml_get(&map, "inlet", false), inlets) == 0;
    else if (!yaml_has(&map, "entry_mm"))
        yaml_fault(value, "'sheath' lacks its place; 'entry_mm' with 'direction', or 'inlet: root'");
    if (yaml_has(&map, "inlet") && yaml_has(&map, "direction"))
        yaml_fault(yaml_get(&map, "direction", false), "'direction' goes with 'entry_mm'; 'inlet: root' brings its own");
    yaml_map_vector(&map, "entry_mm", false, farthest_mm, &wire->start);
    yaml_map_unit_vector(&map, "direction", yaml_has(&map, "entry_mm"), &wire->direction);
    read_normal(&map, wire);
    double most = reading->total_length > 0 ? reading->total_length : 1e5;
    yaml_map_number(&map, "inserted_mm", false, (NumberRange){0, most, false}, &wire->inserted);
    if (reading->scene->inlet_is_root && (reading->scene->source == SOURCE_NONE || reading->scene->source == SOURCE_PLANE))
        yaml_fault(yaml_get(&map, "inlet", false), "'inlet: root' needs a vessel with an inlet; a plane or nothing has none");
}

// s_mm: a number from 0 to the wire's length, or `end`.
static void read_arc_length(Reading *reading, const YamlMap *map, double *s)
{
    YamlValue value = yaml_get(map, "s_mm", true);
    const char *text = yaml_scalar(value);
    double most = reading->total_length > 0 ? reading->total_length : 1e5;
    if (text && !strcmp(text, "end"))
        *s = most;
    else
        yaml_number(value, (NumberRange){0, most, false}, s);
}

static void read_dof(YamlValue value, uint8_t *dof)
{
    static const char *const names[] = {"x", "y", "z", "rx", "ry", "rz", "position", "all", NULL};
    static const uint8_t masks[] = {DOF_X, DOF_Y, DOF_Z, DOF_RX, DOF_RY, DOF_RZ, DOF_POSITION, DOF_ALL};
    int count = yaml_is_list(value) ? yaml_count(value, 1, 8) : 1;
    for (int i = 0; i < count; i++) {
        int choice = yaml_choice(yaml_is_list(value) ? yaml_item(value, i) : value, names);
        *dof = (uint8_t)(*dof | (choice >= 0 ? masks[choice] : 0));
    }
}

static void read_fix(Reading *reading, YamlValue value, WireFix *fix)
{
    static const char *const keys[] = {"s_mm", "dof", NULL};
    YamlMap map = yaml_map(value, keys);
    read_arc_length(reading, &map, &fix->s);
    read_dof(yaml_get(&map, "dof", true), &fix->dof);
}

static void read_load(Reading *reading, YamlValue value, WireLoad *load)
{
    static const char *const keys[] = {"s_mm", "force_n", "moment_n_mm", "ramp_s", "follower", NULL};
    YamlMap map = yaml_map(value, keys);
    double ramp = 0;
    read_arc_length(reading, &map, &load->s);
    yaml_map_vector(&map, "force_n", false, 1e6, &load->force);
    yaml_map_vector(&map, "moment_n_mm", false, 1e9, &load->moment);
    yaml_map_number(&map, "ramp_s", false, (NumberRange){0, 1e5, false}, &ramp);
    load->ramp = ramp * per_second;
    if (yaml_has(&map, "follower"))
        yaml_boolean(yaml_get(&map, "follower", false), &load->follower);
    if (map.value.node && !yaml_has(&map, "force_n") && !yaml_has(&map, "moment_n_mm"))
        yaml_fault(value, "'%s' has neither 'force_n' nor 'moment_n_mm'", value.name);
}

// With a sheath a rig's start_mm, direction and normal say nothing: the sheath's line is where the wire starts. Its fixes, loads and
// gravity count.
static void read_rig(Reading *reading, YamlValue value)
{
    static const char *const keys[] = {"start_mm", "direction", "normal", "fix", "loads", "gravity_m_s2", NULL};
    WireOptions *wire = &reading->scene->wire, unused = {0}, *place = wire->has_sheath ? &unused : wire;
    YamlMap map = yaml_map(value, keys);
    place->direction = vec3(1, 0, 0);
    yaml_map_vector(&map, "start_mm", false, farthest_mm, &place->start);
    yaml_map_unit_vector(&map, "direction", false, &place->direction);
    read_normal(&map, place);
    Vec3 gravity = {0, 0, 0};
    yaml_map_vector(&map, "gravity_m_s2", false, 1e6, &gravity);
    wire->gravity = vec3_scale(gravity, per_m_s2);

    YamlValue fixes = yaml_get(&map, "fix", false), loads = yaml_get(&map, "loads", false);
    int fix_count = yaml_count(fixes, 0, MOST_LOADS), load_count = yaml_count(loads, 0, MOST_LOADS);
    WireFix *fix = fix_count > 0 ? zeroed(reading, fix_count, sizeof *fix) : NULL;
    WireLoad *load = load_count > 0 ? zeroed(reading, load_count, sizeof *load) : NULL;
    wire->fix = fix;
    wire->load = load;
    wire->fix_count = fix ? fix_count : 0;
    wire->load_count = load ? load_count : 0;
    for (int i = 0; i < wire->fix_count; i++)
        read_fix(reading, yaml_item(fixes, i), &fix[i]);
    for (int i = 0; i < wire->load_count; i++)
        read_load(reading, yaml_item(loads, i), &load[i]);
}

// --- the rest ---

static void read_simulation(Reading *reading, YamlValue value)
{
    static const char *const keys[] = {"step_ms", "contact_iterations", "contact_tolerance", "contact_form", NULL};
    static const char *const forms[] = {"block", "pointwise", NULL};
    Scene *scene = reading->scene;
    YamlMap map = yaml_map(value, keys);
    yaml_map_number(&map, "step_ms", false, (NumberRange){0.001, 100, false}, &scene->dt);
    if (yaml_has(&map, "contact_iterations"))
        yaml_integer(yaml_get(&map, "contact_iterations", false), 1, 1000000, &scene->contact_options.max_iterations);
    yaml_map_number(&map, "contact_tolerance", false, (NumberRange){0, 1, true}, &scene->contact_options.tolerance);
    int form = yaml_has(&map, "contact_form") ? yaml_choice(yaml_get(&map, "contact_form", false), forms) : -1;
    if (form >= 0)
        scene->contact_options.form = form == 1 ? CONTACT_POINTWISE : CONTACT_BLOCK;
}

static void read_script(Reading *reading, YamlValue value)
{
    static const char *const keys[] = {"t_s", "push_mm_s", "twist_deg_s", NULL};
    const NumberRange any = {-1e9, 1e9, false};
    Scene *scene = reading->scene;
    const char *name;
    if (!value.node)
        return;
    if (!yaml_is_list(value)) {
        if (yaml_text(value, &name) && (scene->script_path = resolved(reading, name)))
            scene->script = script_load(scene->script_path, reading->faults);
        return;
    }
    int count = yaml_count(value, 1, MOST_ROWS);
    Script *script = count > 0 ? zeroed(reading, 1, sizeof *script) : NULL;
    if (!script)
        return;
    scene->script = script;
    script->row = zeroed(reading, count, sizeof *script->row);
    for (int i = 0; script->row && i < count; i++) {
        YamlValue item = yaml_item(value, i);
        ScriptRow *row = &script->row[i];
        bool good;
        if (yaml_is_list(item)) {
            good = yaml_count(item, 3, 3) == 3 && yaml_number(yaml_item(item, 0), any, &row->t_s);
            good = good && yaml_number(yaml_item(item, 1), any, &row->command.push_mm_s) && yaml_number(yaml_item(item, 2), any, &row->command.twist_deg_s);
        } else {
            YamlMap map = yaml_map(item, keys);
            good = yaml_map_number(&map, "t_s", true, any, &row->t_s);
            yaml_map_number(&map, "push_mm_s", false, any, &row->command.push_mm_s);
            yaml_map_number(&map, "twist_deg_s", false, any, &row->command.twist_deg_s);
        }
        int line, column;
        yaml_place(item, &line, &column);
        if (good)
            script_check_row(row, i ? row - 1 : NULL, reading->path, line, column, reading->faults);
        script->count = i + 1;
    }
}

static void read_targets(Reading *reading, YamlValue value)
{
    static const char *const keys[] = {"name", "point_mm", "radius_mm", NULL};
    Scene *scene = reading->scene;
    int count = yaml_count(value, 0, MOST_TARGETS);
    if (count <= 0 || !(scene->target = zeroed(reading, count, sizeof *scene->target)))
        return;
    scene->target_count = count;
    for (int i = 0; i < count; i++) {
        YamlMap map = yaml_map(yaml_item(value, i), keys);
        SceneTarget *target = &scene->target[i];
        const char *name;
        if (yaml_text(yaml_get(&map, "name", true), &name)) {
            if (strlen(name) < sizeof target->name)
                strcpy(target->name, name);
            else
                yaml_fault(yaml_get(&map, "name", false), "a target's name has at most %zu letters", sizeof target->name - 1);
        }
        yaml_map_vector(&map, "point_mm", true, farthest_mm, &target->point);
        yaml_map_number(&map, "radius_mm", true, length_range, &target->radius);
    }
}

static void read_exercise(Reading *reading, YamlValue value)
{
    Scene *scene = reading->scene;
    const char **name = zeroed(reading, scene->target_count, sizeof *name);
    scene->exercise = zeroed(reading, 1, sizeof *scene->exercise);
    for (int i = 0; name && i < scene->target_count; i++)
        name[i] = scene->target[i].name;
    if (name && scene->exercise)
        exercise_read(value, scene->target_count, name, scene->exercise);
    free(name);
}

// What lies behind the vessel in the X-ray picture.
static void read_fluoroscopy(Reading *reading, YamlValue value)
{
    static const char *const keys[] = {"volume", "anterior", "superior", "lao_deg", "cra_deg", NULL};
    YamlMap map = yaml_map(value, keys);
    Scene *scene = reading->scene;
    const char *name;
    Vec3 anterior = {0}, superior = {0};
    bool has_anterior = yaml_map_unit_vector(&map, "anterior", false, &anterior), has_superior = yaml_map_unit_vector(&map, "superior", false, &superior);
    if (yaml_has(&map, "anterior") != yaml_has(&map, "superior"))
        yaml_fault(value, "'anterior' and 'superior' say together how the patient lies; both of them, or none");
    else if (has_anterior && has_superior && fabs(vec3_dot(anterior, superior)) > 0.01)
        yaml_fault(value, "'anterior' and 'superior' are not perpendicular");
    else if (has_anterior && has_superior) {
        scene->patient_superior = superior;
        scene->patient_anterior = vec3_unit(vec3_add_scaled(anterior, -vec3_dot(anterior, superior), superior));
    }
    yaml_map_number(&map, "lao_deg", false, (NumberRange){-90, 90, false}, &scene->lao);
    yaml_map_number(&map, "cra_deg", false, (NumberRange){-45, 45, false}, &scene->cra);
    if (yaml_has(&map, "volume") && yaml_text(yaml_get(&map, "volume", false), &name))
        reading->scene->anatomy_path = resolved(reading, name);
}

static void read_scene(Reading *reading)
{
    static const char *const keys[] = {"seldinger", "vessel", "wire", "sheath", "rig", "simulation", "script", "targets", "exercise", "fluoroscopy",
                                       "verify", NULL};
    YamlValue root = yaml_root(reading->reader);
    YamlMap map = yaml_map(root, keys);
    int version;
    if (!map.value.node)
        return;
    yaml_integer(yaml_get(&map, "seldinger", true), 1, 1, &version);
    if (yaml_has(&map, "vessel"))
        read_vessel(reading, yaml_get(&map, "vessel", false));
    read_wire(reading, yaml_get(&map, "wire", true));
    if (yaml_has(&map, "sheath"))
        read_sheath(reading, yaml_get(&map, "sheath", false));
    if (yaml_has(&map, "rig"))
        read_rig(reading, yaml_get(&map, "rig", false));
    if (!yaml_has(&map, "sheath") && !yaml_has(&map, "rig"))
        yaml_fault(root, "the scene has neither 'sheath' nor 'rig'; one of them says where the wire starts");
    read_simulation(reading, yaml_get(&map, "simulation", false));
    read_script(reading, yaml_get(&map, "script", false));
    if (yaml_has(&map, "targets"))
        read_targets(reading, yaml_get(&map, "targets", false));
    if (yaml_has(&map, "exercise"))
        read_exercise(reading, yaml_get(&map, "exercise", false));
    if (yaml_has(&map, "fluoroscopy"))
        read_fluoroscopy(reading, yaml_get(&map, "fluoroscopy", false));
    if (yaml_has(&map, "verify"))
        verify_read(yaml_get(&map, "verify", false), reading->total_length, yaml_has(&map, "script"), &reading->scene->verify);
}

Scene *scene_parse(const char *text, size_t length, const char *path, Faults *faults)
{
    int before = faults->count;
    if (length > TEXT_FILE_LIMIT) {
        faults_add(faults, path, 0, 0, "is %zu bytes long; at most %d are read", length, TEXT_FILE_LIMIT);
        return NULL;
    }
    YamlReader *reader = yaml_reader_open(text, length, path, faults);
    if (!reader)
        return NULL;
    Scene *scene = calloc(1, sizeof *scene);
    if (scene) {
        scene->path = strdup(path);
        scene->text = malloc(length + 1);
    }
    if (!scene || !scene->path || !scene->text) {
        faults_add(faults, path, 0, 0, "no memory");
    } else {
        memcpy(scene->text, text, length);
        scene->text[length] = 0;
        scene->source = SOURCE_NONE;
        scene->dt = 1;
        scene->marker_length = marker_length;
        scene->marker_attenuation = marker_attenuation;
        scene->contact_options = (ContactOptions){.form = CONTACT_BLOCK, .max_iterations = 200, .tolerance = 1e-6};
        scene->wire.direction = vec3(1, 0, 0);
        Reading reading = {.scene = scene, .reader = reader, .path = path, .faults = faults};
        read_scene(&reading);
    }
    yaml_reader_close(reader);
    if (faults->count > before) {
        scene_free(scene);
        return NULL;
    }
    return scene;
}

Scene *scene_load(const char *path, Faults *faults)
{
    size_t length;
    char *text = text_file_read(path, &length, faults);
    Scene *scene = text ? scene_parse(text, length, path, faults) : NULL;
    free(text);
    return scene;
}

void scene_free(Scene *scene)
{
    if (!scene)
        return;
    free((void *)scene->tube.piece);
    free((void *)scene->tube.point);
    free((void *)scene->wire.section);
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

double scene_attenuation(const Scene *scene, double s)
{
    const WireOptions *wire = &scene->wire;
    double total = 0;
    int at = -1;
    for (int i = 0; i < wire->section_count; i++) {
        total += wire->section[i].length;
        if (at < 0 && (s < total || i == wire->section_count - 1))
            at = i;
    }
    return at < 0 ? 0 : s > total - scene->marker_length ? scene->marker_attenuation : wire->section[at].attenuation;
}
