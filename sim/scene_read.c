// YAML text to a Scene in internal units: mm, g, ms (N, MPa, mJ), rad. The only place where a scene's units are converted. One function per part of
// the file; each continues after a fault, so one pass finds all.
#include "sim/scene_reading.h"
#include "sim/tolerances.h"

#include "base/base.h"
#include "sim/yaml_vector.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static const double per_m_s2 = 1e-3;           // mm/ms2
static const double farthest_mm = 1e5;
enum { MOST_LOADS = 1000, MOST_TARGETS = 1000, MOST_ROWS = 100000 };

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
    scene->shape_option = scene_zeroed(reading, count, sizeof *scene->shape_option);
    for (int i = 0; scene->shape_option && i < count; i++) {
        yaml_pair(&map, i, &key, &option);
        if (!key || !strcmp(key, "name") || !yaml_text(option, &text))
            continue;
        if (strlen(key) >= 64 || strlen(text) >= 64) {
            yaml_fault(option, "option and value must have at most 63 letters");
            continue;
        }
        strcpy(scene->shape_option[scene->shape_option_count][0], key);
        strcpy(scene->shape_option[scene->shape_option_count++][1], text);
    }
}

static void read_polyline(Reading *reading, YamlValue value)
{
    TubeOptions *tube = &reading->scene->tube;
    const char *name;
    if (!yaml_text(value, &name))
        return;
    char *path = scene_resolved(reading, name);
    size_t length;
    char *text = path ? text_file_read(path, &length, reading->faults) : NULL;
    NumberTable *table = text ? number_table_parse(text, length, path, "x_mm,y_mm,z_mm", reading->faults) : NULL;
    if (table && table->row_count < 2)
        faults_add(reading->faults, path, 1, 1, "has %d points; expected at least 2", table->row_count);
    Vec3 *point = table ? scene_zeroed(reading, table->row_count, sizeof *point) : NULL;
    if (point) {
        for (int i = 0; i < table->row_count; i++) {
            const double *row = table->value + (size_t)i * 3;
            point[i] = vec3(row[0], row[1], row[2]);
            if (fabs(row[0]) > farthest_mm || fabs(row[1]) > farthest_mm || fabs(row[2]) > farthest_mm)
                faults_add(reading->faults, path, table->line[i], 1, "a coordinate is beyond +-%g mm", farthest_mm);
            if (i && vec3_distance(point[i], point[i - 1]) < 1e-9)
                faults_add(reading->faults, path, table->line[i], 1, "the point repeats the one before it; expected distinct points");
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
        yaml_fault(yaml_get(&map, "normal", false), "'normal' is parallel to 'direction'; arcs bend towards it, so expected another direction");
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
    TubePiece *piece = count > 0 ? scene_zeroed(reading, count, sizeof *piece) : NULL;
    tube->piece = piece;
    tube->piece_count = piece ? count : 0;
    for (int i = 0; piece && i < count; i++) {
        YamlValue item = yaml_item(list, i);
        if (scene_read_piece(item, &piece[i]) && piece[i].angle > 0 && tube->radius > 0 && piece[i].arc_radius <= tube->radius)
            yaml_fault(item, "an arc of radius %g mm is tighter than the lumen's radius %g mm; use a larger radius", piece[i].arc_radius, tube->radius);
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

static void read_contact(const YamlMap *map, Scene *scene)
{
    bool exact = scene->source == SOURCE_TUBE || scene->source == SOURCE_PLANE;
    scene->contact = exact ? CONTACT_TUBE : scene->source == SOURCE_MESH ? CONTACT_MESH : CONTACT_LIM;
    YamlValue contact = yaml_get(map, "contact", false);
    int choice = contact.node ? yaml_choice(contact, contact_name) : -1;
    if (choice >= 0)
        scene->contact = (ContactKind)choice;
    if (choice == CONTACT_TUBE && (scene->source == SOURCE_MODEL || scene->source == SOURCE_SHAPE || scene->source == SOURCE_MESH))
        yaml_fault(contact, "contact 'tube' needs the source 'tube'; a model or shape has lim, lim_blend, lim_switch, sweep, raster, rbf, pas, mesh, "
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
            yaml_fault(yaml_get(&map, keys[i], false), "a second source '%s'; expected exactly one of model, shape, tube, plane, mesh", keys[i]);
        scene->source = source[i];
    }
    if (sources == 0)
        yaml_fault(value, "'vessel' has no source; expected exactly one of model, shape, tube, plane, mesh");
    const char *text;
    if (yaml_has(&map, "model") && yaml_text(yaml_get(&map, "model", false), &text))
        scene->model_path = scene_resolved(reading, text);
    if (yaml_has(&map, "shape"))
        read_shape(reading, yaml_get(&map, "shape", false));
    if (yaml_has(&map, "tube"))
        read_tube(reading, yaml_get(&map, "tube", false));
    if (yaml_has(&map, "plane"))
        read_plane(reading, yaml_get(&map, "plane", false));
    if (yaml_has(&map, "mesh") && yaml_text(yaml_get(&map, "mesh", false), &text))
        scene->mesh_path = scene_resolved(reading, text);
    if (yaml_has(&map, "mesh_scale") && scene->source != SOURCE_MESH)
        yaml_fault(yaml_get(&map, "mesh_scale", false), "'mesh_scale' applies only to the source 'mesh'");
    yaml_map_number(&map, "mesh_scale", false, (NumberRange){0, 1e9, true}, &scene->mesh_scale);
    yaml_map_number(&map, "mesh_cell_mm", false, (NumberRange){0, 100, true}, &scene->mesh_cell);
    read_contact(&map, scene);
    yaml_map_number(&map, "friction", false, friction_range, &scene->friction);
}

// --- sheath, rig ---

// `normal` of a sheath or rig: direction towards which a rest curvature with plane 0 bends; default vec3_normal_to(direction).
static void read_normal(const YamlMap *map, WireOptions *wire)
{
    if (yaml_map_unit_vector(map, "normal", false, &wire->normal) && vec3_norm(vec3_cross(wire->normal, wire->direction)) < 1e-6)
        yaml_fault(yaml_get(map, "normal", false), "'normal' is parallel to 'direction'; expected a direction across the tool");
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
        yaml_fault(value, "'sheath' has no position; expected 'entry_mm' with 'direction', or 'inlet: root'");
    if (yaml_has(&map, "inlet") && yaml_has(&map, "direction"))
        yaml_fault(yaml_get(&map, "direction", false), "'direction' belongs to 'entry_mm'; 'inlet: root' sets its own");
    yaml_map_vector(&map, "entry_mm", false, farthest_mm, &wire->start);
    yaml_map_unit_vector(&map, "direction", yaml_has(&map, "entry_mm"), &wire->direction);
    read_normal(&map, wire);
    double most = reading->total_length > 0 ? reading->total_length : 1e5;
    yaml_map_number(&map, "inserted_mm", false, (NumberRange){0, most, false}, &wire->inserted);
    if (reading->scene->inlet_is_root && (reading->scene->source == SOURCE_NONE || reading->scene->source == SOURCE_PLANE))
        yaml_fault(yaml_get(&map, "inlet", false), "'inlet: root' needs a vessel with an inlet; a plane has none");
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

// With a sheath a rig's start_mm, direction and normal have no effect: the wire starts on the sheath's line. Its fixes, loads and gravity count.
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
    WireFix *fix = fix_count > 0 ? scene_zeroed(reading, fix_count, sizeof *fix) : NULL;
    WireLoad *load = load_count > 0 ? scene_zeroed(reading, load_count, sizeof *load) : NULL;
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
    static const char *const keys[] = {"step_ms", "contact_iterations", "contact_tolerance", "contact_form", "contact_points", "self_contact", NULL};
    static const char *const forms[] = {"block", "pointwise", NULL}, *const points[] = {"fixed", "follow", NULL}, *const self[] = {"auto", "on", "off", NULL};
    Scene *scene = reading->scene;
    YamlMap map = yaml_map(value, keys);
    yaml_map_number(&map, "step_ms", false, (NumberRange){0.001, 100, false}, &scene->dt);
    if (yaml_has(&map, "contact_iterations"))
        yaml_integer(yaml_get(&map, "contact_iterations", false), 1, 1000000, &scene->contact_options.max_iterations);
    yaml_map_number(&map, "contact_tolerance", false, (NumberRange){0, 1, true}, &scene->contact_options.tolerance);
    int form = yaml_has(&map, "contact_form") ? yaml_choice(yaml_get(&map, "contact_form", false), forms) : -1;
    if (form >= 0)
        scene->contact_options.form = form == 1 ? CONTACT_POINTWISE : CONTACT_BLOCK;
    scene->follows_touch = yaml_has(&map, "contact_points") && yaml_choice(yaml_get(&map, "contact_points", false), points) == 1;
    int choice = yaml_has(&map, "self_contact") ? yaml_choice(yaml_get(&map, "self_contact", false), self) : 0;
    scene->self_contact = choice == 1 ? SELF_CONTACT_ON : choice == 2 ? SELF_CONTACT_OFF : SELF_CONTACT_AUTO;
}

// The valid keys of a script's row: t_s, the first tool's keys without a name, and each tool's keys with its name.
enum { KEYS_OF_TOOL = 5, NAMED_KEYS = 1 + KEYS_OF_TOOL };
typedef struct RowKeys {
    const char *key[NAMED_KEYS + KEYS_OF_TOOL * TOOLS_MOST + 1];
    char text[KEYS_OF_TOOL * TOOLS_MOST][TOOL_NAME_SIZE + 16];
} RowKeys;

static void list_row_keys(const ToolNames *tools, RowKeys *keys)
{
    static const char *const bare[] = {"t_s", "push_mm_s", "twist_deg_s", "released", "exchange", "contrast_ml_s"};
    *keys = (RowKeys){.key = {bare[0], bare[1], bare[2], bare[3], bare[4], bare[5]}};
    for (int i = 0; i < KEYS_OF_TOOL * tools->count; i++) {
        snprintf(keys->text[i], sizeof keys->text[i], "%s.%s", tools->name[i / KEYS_OF_TOOL], bare[1 + i % KEYS_OF_TOOL]);
        keys->key[NAMED_KEYS + i] = keys->text[i];
    }
}

// Reads `released` (1: the tool is released). Returns whether the key is present.
static bool read_released(const YamlMap *map, const char *key, int tool, ScriptRow *row)
{
    YamlValue value = yaml_get(map, key, false);
    int released = 0;
    if (value.node && yaml_integer(value, 0, 1, &released) && released)
        row->released |= 1u << tool;
    return value.node != 0;
}

static bool read_row(YamlValue item, const RowKeys *keys, int tools, ScriptRow *row)
{
    const NumberRange any = {-1e9, 1e9, false};
    if (yaml_is_list(item))
        return yaml_count(item, 3, 3) == 3 && yaml_number(yaml_item(item, 0), any, &row->t_s) &&
               yaml_number(yaml_item(item, 1), any, &row->command.push_mm_s) && yaml_number(yaml_item(item, 2), any, &row->command.twist_deg_s);
    YamlMap map = yaml_map(item, keys->key);
    bool good = yaml_map_number(&map, "t_s", true, any, &row->t_s);
    bool bare = yaml_map_number(&map, "push_mm_s", false, any, &row->command.push_mm_s);
    bare |= yaml_map_number(&map, "twist_deg_s", false, any, &row->command.twist_deg_s);
    bare |= read_released(&map, "released", 0, row);
    bare |= yaml_map_number(&map, "contrast_ml_s", false, any, &row->contrast_ml_s[0]);
    for (int k = 0; k < tools; k++) {
        const char *const *key = keys->key + NAMED_KEYS + KEYS_OF_TOOL * k, *push = key[0], *twist = key[1];
        Command *command = script_row_command(row, k);
        bool has_push = yaml_map_number(&map, push, false, any, &command->push_mm_s),
             has_twist = yaml_map_number(&map, twist, false, any, &command->twist_deg_s);
        if (yaml_has(&map, push) != yaml_has(&map, twist))
            yaml_fault(item, "'%s' needs '%s' too", yaml_has(&map, push) ? push : twist, yaml_has(&map, push) ? twist : push);
        bool has_release = read_released(&map, key[2], k, row);
        bool has_contrast = yaml_map_number(&map, key[4], false, any, &row->contrast_ml_s[k]);
        YamlValue exchange = yaml_get(&map, key[3], false);
        if (exchange.node)
            yaml_integer(exchange, 0, EXCHANGES_MOST, &row->fitted[k]);
        if (bare && (has_push || has_twist || has_release || has_contrast))
            yaml_fault(item, "a row names its tools or moves the first by bare 'push_mm_s' and 'twist_deg_s', not both; write '%s' and '%s'",
                       keys->key[NAMED_KEYS], keys->key[NAMED_KEYS + 1]);
    }
    return good;
}

static void read_script(Reading *reading, YamlValue value)
{
    Scene *scene = reading->scene;
    ToolNames tools = scene_tool_names(scene);
    const char *name;
    if (!value.node || tools.count == 0)
        return;
    if (!yaml_is_list(value)) {
        if (yaml_text(value, &name) && (scene->script_path = scene_resolved(reading, name)))
            scene->script = script_load(scene->script_path, &tools, reading->faults);
        return;
    }
    int count = yaml_count(value, 1, MOST_ROWS);
    Script *script = count > 0 ? scene_zeroed(reading, 1, sizeof *script) : NULL;
    RowKeys keys;
    if (!script)
        return;
    scene->script = script;
    script->row = scene_zeroed(reading, count, sizeof *script->row);
    list_row_keys(&tools, &keys);
    int line = 0, column = 0, before = reading->faults->count;
    for (int i = 0; script->row && i < count; i++) {
        YamlValue item = yaml_item(value, i);
        ScriptRow *row = &script->row[i];
        yaml_place(item, &line, &column);
        if (read_row(item, &keys, tools.count, row))
            script_check_row(row, i ? row - 1 : NULL, &tools, reading->path, line, column, reading->faults);
        script->count = i + 1;
    }
    if (script->row && reading->faults->count == before)
        script_check_end(script, reading->path, line, column, reading->faults);
}

static void read_targets(Reading *reading, YamlValue value)
{
    static const char *const keys[] = {"name", "point_mm", "radius_mm", NULL};
    Scene *scene = reading->scene;
    int count = yaml_count(value, 0, MOST_TARGETS);
    if (count <= 0 || !(scene->target = scene_zeroed(reading, count, sizeof *scene->target)))
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
    const char **name = scene_zeroed(reading, scene->target_count, sizeof *name);
    ExerciseScene named = {.target_count = scene->target_count, .tool_count = scene->tool_count, .target = name};
    scene->exercise = scene_zeroed(reading, 1, sizeof *scene->exercise);
    for (int i = 0; name && i < scene->target_count; i++)
        name[i] = scene->target[i].name;
    for (int k = 0; k < scene->tool_count; k++)
        named.tool[k] = scene->tool[k].name, named.device_count[k] = scene_device_count(scene, k);
    if (name && scene->exercise)
        exercise_read(value, &named, scene->exercise);
    free(name);
}

static void read_verify(Reading *reading, YamlValue value, bool has_script)
{
    VerifyTools tools = {.names = scene_tool_names(reading->scene)};
    for (int k = 0; k < tools.names.count; k++)
        tools.length[k] = reading->tool[k].length;
    verify_read(value, &tools, has_script, &reading->scene->verify);
}

// The anatomy behind the vessel in the X-ray picture.
static void read_fluoroscopy(Reading *reading, YamlValue value)
{
    static const char *const keys[] = {"volume", "anterior", "superior", "lao_deg", "cra_deg", NULL};
    YamlMap map = yaml_map(value, keys);
    Scene *scene = reading->scene;
    const char *name;
    Vec3 anterior = {0}, superior = {0};
    bool has_anterior = yaml_map_unit_vector(&map, "anterior", false, &anterior), has_superior = yaml_map_unit_vector(&map, "superior", false, &superior);
    if (yaml_has(&map, "anterior") != yaml_has(&map, "superior"))
        yaml_fault(value, "'anterior' and 'superior' together give the patient's orientation; expected both or neither");
    else if (has_anterior && has_superior && fabs(vec3_dot(anterior, superior)) > 0.01)
        yaml_fault(value, "'anterior' and 'superior' are not perpendicular");
    else if (has_anterior && has_superior) {
        scene->patient_superior = superior;
        scene->patient_anterior = vec3_unit(vec3_add_scaled(anterior, -vec3_dot(anterior, superior), superior));
    }
    yaml_map_number(&map, "lao_deg", false, (NumberRange){-90, 90, false}, &scene->lao);
    yaml_map_number(&map, "cra_deg", false, (NumberRange){-45, 45, false}, &scene->cra);
    if (yaml_has(&map, "volume") && yaml_text(yaml_get(&map, "volume", false), &name))
        reading->scene->anatomy_path = scene_resolved(reading, name);
}

static void read_scene(Reading *reading)
{
    static const char *const keys[] = {"seldinger", "vessel",   "wire",        "tools",   "sheath", "rig",   "simulation", "script",
                                       "targets",   "exercise", "fluoroscopy", "anatomy", "verify", "check", NULL};
    YamlValue root = yaml_root(reading->reader);
    YamlMap map = yaml_map(root, keys);
    int version;
    if (!map.value.node)
        return;
    yaml_integer(yaml_get(&map, "seldinger", true), 1, 1, &version);
    if (yaml_has(&map, "vessel"))
        read_vessel(reading, yaml_get(&map, "vessel", false));
    bool several = yaml_has(&map, "tools");
    if (several && yaml_has(&map, "wire"))
        yaml_fault(yaml_get(&map, "tools", false), "the scene has 'wire' and 'tools'; expected either 'wire' (one tool) or 'tools' (up to %d)", TOOLS_MOST);
    else if (!several && !yaml_has(&map, "wire"))
        yaml_fault(root, "'%s' has neither 'wire' (one tool) nor 'tools' (several)", root.name);
    if (several)
        scene_read_tools(reading, yaml_get(&map, "tools", false));
    else
        scene_read_wire(reading, yaml_get(&map, "wire", false));
    if (yaml_has(&map, "sheath"))
        read_sheath(reading, yaml_get(&map, "sheath", false));
    if (yaml_has(&map, "rig"))
        read_rig(reading, yaml_get(&map, "rig", false));
    bool placed = yaml_has(&map, "sheath") || yaml_has(&map, "rig");
    scene_settle_tools(reading, placed);
    if (!placed)
        yaml_fault(root, "the scene has neither 'sheath' nor 'rig'; expected one of them to give the wire's start");
    read_simulation(reading, yaml_get(&map, "simulation", false));
    read_script(reading, yaml_get(&map, "script", false));
    if (yaml_has(&map, "targets"))
        read_targets(reading, yaml_get(&map, "targets", false));
    if (yaml_has(&map, "exercise"))
        read_exercise(reading, yaml_get(&map, "exercise", false));
    if (yaml_has(&map, "fluoroscopy"))
        read_fluoroscopy(reading, yaml_get(&map, "fluoroscopy", false));
    if (yaml_has(&map, "anatomy"))
        scene_read_anatomy(reading, yaml_get(&map, "anatomy", false));
    if (yaml_has(&map, "verify"))
        read_verify(reading, yaml_get(&map, "verify", false), yaml_has(&map, "script"));
    // only checked here: tolerances_of_scene() reads them for the one verb that needs them
    if (yaml_has(&map, "check"))
        tolerances_read(yaml_get(&map, "check", false), &(Tolerances){0});
}

Scene *scene_parse(const char *text, size_t length, const char *path, Faults *faults)
{
    int before = faults->count;
    if (length > TEXT_FILE_LIMIT) {
        faults_add(faults, path, 0, 0, "is %zu bytes long; expected at most %d", length, TEXT_FILE_LIMIT);
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
        faults_add(faults, path, 0, 0, "out of memory");
    } else {
        memcpy(scene->text, text, length);
        scene->text[length] = 0;
        scene->source = SOURCE_NONE;
        scene->dt = 1;
        scene->contact_options = (ContactOptions){.form = CONTACT_BLOCK, .max_iterations = 200, .tolerance = 1e-6};
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

// The scene of a case's folder, otherwise `path` itself; NULL with a fault. The caller frees it.
static char *scene_file(const char *path, Faults *faults)
{
    struct stat status;
    bool is_folder = stat(path, &status) == 0 && S_ISDIR(status.st_mode);
    char *file = is_folder ? text_file_in(path, "scene.yaml") : text_file_beside("", path);
    if (!file)
        faults_add(faults, path, 0, 0, "out of memory");
    if (!file || !is_folder || access(file, F_OK) == 0)
        return file;
    faults_add(faults, path, 0, 0, "is a folder without scene.yaml; expected a scene, or a case (`seldinger case`)");
    free(file);
    return NULL;
}

Scene *scene_load(const char *path, Faults *faults)
{
    size_t length;
    char *file = scene_file(path, faults), *text = file ? text_file_read(file, &length, faults) : NULL;
    Scene *scene = text ? scene_parse(text, length, file, faults) : NULL;
    free(text);
    free(file);
    return scene;
}
