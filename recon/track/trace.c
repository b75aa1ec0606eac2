// Reads YAML by libyaml's document interface, which keeps the line and column of every node. This reader refuses things that libyaml accepts (duplicate and
// unknown keys, several documents).
#include "recon/track/trace.h"
#include "base/base.h"
#include "recon/model_file.h"
#include "recon/track/cast_rays.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <yaml.h>

enum { TRACE_BYTES_MOST = 1 << 20 };

enum { MAX_ENTRIES = 4096 };

typedef struct Walk {
    yaml_document_t *document;
    const char *path;
    Faults *faults;
} Walk;

#define FAULT(WALK, NODE, ...) faults_add((WALK)->faults, (WALK)->path, (int)(NODE)->start_mark.line + 1, (int)(NODE)->start_mark.column + 1, __VA_ARGS__)

static yaml_node_t *node_at(const Walk *w, int index) { return yaml_document_get_node(w->document, index); }

static const char *scalar_of(const yaml_node_t *node) { return node->type == YAML_SCALAR_NODE ? (const char *)node->data.scalar.value : NULL; }

static int pair_count(const yaml_node_t *map) { return (int)(map->data.mapping.pairs.top - map->data.mapping.pairs.start); }

static int item_count(const yaml_node_t *list) { return (int)(list->data.sequence.items.top - list->data.sequence.items.start); }

// Returns the key of pair `i`, or NULL with a fault if it is not a string or is a duplicate.
static const char *key_of(const Walk *w, const yaml_node_t *map, int i, yaml_node_t **value)
{
    yaml_node_t *key = node_at(w, map->data.mapping.pairs.start[i].key);
    *value = node_at(w, map->data.mapping.pairs.start[i].value);
    const char *name = key ? scalar_of(key) : NULL;
    if (!key || !*value || !name) {
        FAULT(w, map, "a key is not a string; expected `name: value`");
        return NULL;
    }
    for (int k = 0; k < i; k++) {
        yaml_node_t *other = node_at(w, map->data.mapping.pairs.start[k].key);
        const char *text = other ? scalar_of(other) : NULL;
        if (text && !strcmp(text, name)) {
            FAULT(w, key, "duplicate key '%.40s'; the first is on line %d", name, (int)other->start_mark.line + 1);
            return NULL;
        }
    }
    return name;
}

static bool read_number(const Walk *w, const yaml_node_t *node, const char *name, double least, double most, bool is_whole, double *out)
{
    const char *text = scalar_of(node);
    char *end = NULL;
    double x = text ? strtod(text, &end) : 0;
    if (!text || end == text || *end || !(x >= least && x <= most) || (is_whole && floor(x) != x)) {
        FAULT(w, node, "%s '%.40s' is not valid; expected a%s number from %g to %g", name, text ? text : "(no number)", is_whole ? " whole" : "", least, most);
        return false;
    }
    *out = x;
    return true;
}

static bool read_vector(const Walk *w, const yaml_node_t *node, const char *name, Vec3 *out)
{
    double x[3];
    if (node->type != YAML_SEQUENCE_NODE || item_count(node) != 3) {
        FAULT(w, node, "%s is not valid; expected a list of three numbers [x, y, z]", name);
        return false;
    }
    for (int i = 0; i < 3; i++) {
        yaml_node_t *item = node_at(w, node->data.sequence.items.start[i]);
        if (!item || !read_number(w, item, name, -1e6, 1e6, false, &x[i]))
            return false;
    }
    *out = vec3(x[0], x[1], x[2]);
    return true;
}

static void read_name(const Walk *w, const yaml_node_t *node, char out[32])
{
    const char *text = scalar_of(node);
    if (!text || strlen(text) > 31)
        FAULT(w, node, "the name is not valid; expected at most 31 bytes");
    else
        memcpy(out, text, strlen(text) + 1);
}

// Reads a position given in mm or in voxels. It is a fault if both are given.
static void read_place(const Walk *w, const yaml_node_t *node, const char *key, bool is_voxel, bool *given, Vec3 *out, bool *out_is_voxel)
{
    if (*given)
        FAULT(w, node, "'%s' is given twice, in mm and in voxels; expected one of them", key);
    *given = true;
    *out_is_voxel = is_voxel;
    read_vector(w, node, key, out);
}

static void read_branch(const Walk *w, const yaml_node_t *map, RbtSeed *out)
{
    *out = (RbtSeed){.line = (int)map->start_mark.line + 1, .column = (int)map->start_mark.column + 1};
    bool has_start = false;
    if (map->type != YAML_MAPPING_NODE) {
        FAULT(w, map, "a branch is not valid; expected {start_mm: [x, y, z], toward_mm: [x, y, z], radius_mm: r}");
        return;
    }
    for (int i = 0; i < pair_count(map); i++) {
        yaml_node_t *value;
        const char *key = key_of(w, map, i, &value);
        if (!key)
            continue;
        if (!strcmp(key, "start_mm") || !strcmp(key, "start_voxel"))
            read_place(w, value, key, key[6] == 'v', &has_start, &out->start, &out->start_is_voxel);
        else if (!strcmp(key, "toward_mm") || !strcmp(key, "toward_voxel"))
            read_place(w, value, key, key[7] == 'v', &out->has_toward, &out->toward, &out->toward_is_voxel);
        else if (!strcmp(key, "radius_mm"))
            read_number(w, value, key, 1e-3, 1e3, false, &out->radius);
        else if (!strcmp(key, "name"))
            read_name(w, value, out->name);
        else
            FAULT(w, value, "unknown key '%.40s' in a branch; expected start_mm or start_voxel, toward_mm or toward_voxel, radius_mm, name", key);
    }
    if (!has_start)
        FAULT(w, map, "the branch has no start; expected start_mm (or start_voxel)");
}

static void read_aneurysm(const Walk *w, const yaml_node_t *map, RbtAneurysm *out)
{
    *out = (RbtAneurysm){.line = (int)map->start_mark.line + 1, .column = (int)map->start_mark.column + 1};
    if (map->type != YAML_MAPPING_NODE) {
        FAULT(w, map, "an aneurysm is not valid; expected {centers_mm: [[x, y, z], ...]}");
        return;
    }
    for (int i = 0; i < pair_count(map); i++) {
        yaml_node_t *value;
        const char *key = key_of(w, map, i, &value);
        if (!key)
            continue;
        if (!strcmp(key, "name")) {
            read_name(w, value, out->name);
        } else if (strcmp(key, "centers_mm") && strcmp(key, "centers_voxel")) {
            FAULT(w, value, "unknown key '%.40s' in an aneurysm; expected centers_mm or centers_voxel, name", key);
        } else if (out->center) {
            FAULT(w, value, "the centres are given twice, in mm and in voxels; expected one of them");
        } else if (value->type != YAML_SEQUENCE_NODE || item_count(value) < 1 || item_count(value) > MAX_ENTRIES) {
            FAULT(w, value, "%s is not valid; expected a list of points [[x, y, z], ...], 1 to %d of them", key, MAX_ENTRIES);
        } else {
            int n = item_count(value);
            out->is_voxel = key[8] == 'v';
            out->center = calloc((size_t)n, sizeof *out->center);
            out->center_count = out->center ? n : 0;
            for (int k = 0; k < out->center_count; k++) {
                yaml_node_t *item = node_at(w, value->data.sequence.items.start[k]);
                if (item)
                    read_vector(w, item, key, &out->center[k]);
            }
        }
    }
    if (!out->center)
        FAULT(w, map, "the aneurysm has no centres; expected centers_mm (or centers_voxel), points inside the sac");
}

static void read_list(const Walk *w, const yaml_node_t *list, bool is_branches, Trace *trace)
{
    const char *what = is_branches ? "branches" : "aneurysms";
    if (list->type != YAML_SEQUENCE_NODE || item_count(list) > MAX_ENTRIES) {
        FAULT(w, list, "%s is not valid; expected a list of at most %d entries", what, MAX_ENTRIES);
        return;
    }
    int n = item_count(list);
    void *memory = HEAP_ZEROED((size_t)n, is_branches ? sizeof *trace->branch : sizeof *trace->aneurysm);
    if (is_branches) {
        trace->branch = memory;
        trace->branch_count = n;
    } else {
        trace->aneurysm = memory;
        trace->aneurysm_count = n;
    }
    for (int i = 0; i < n; i++) {
        yaml_node_t *item = node_at(w, list->data.sequence.items.start[i]);
        if (item && is_branches)
            read_branch(w, item, &trace->branch[i]);
        else if (item)
            read_aneurysm(w, item, &trace->aneurysm[i]);
    }
}

// Lists of positions: `forbid` holds balls, the others points.
typedef struct PlaceKind {
    const char *key, *what, *mm, *voxel;
    bool has_radius;
} PlaceKind;

enum { PLACE_FORBID, PLACE_CUT, PLACE_UNTIL, PLACE_RIVAL, PLACE_KINDS };
static const PlaceKind place_kinds[PLACE_KINDS] = {{"forbid", "forbidden region", "center_mm", "center_voxel", true},
                                                   {"cut", "cut", "point_mm", "point_voxel", false},
                                                   {"until", "point of `until`", "point_mm", "point_voxel", false},
                                                   {"not", "point of `not`", "point_mm", "point_voxel", false}};

static int place_kind_of(const char *key)
{
    for (int i = 0; i < PLACE_KINDS; i++)
        if (!strcmp(key, place_kinds[i].key))
            return i;
    return -1;
}

static void read_region(const Walk *w, const yaml_node_t *map, const PlaceKind *kind, RbtRegion *out)
{
    *out = (RbtRegion){.line = (int)map->start_mark.line + 1, .column = (int)map->start_mark.column + 1};
    bool has_center = false;
    if (map->type != YAML_MAPPING_NODE) {
        FAULT(w, map, "a %s is not valid; expected {%s: [x, y, z]%s}", kind->what, kind->mm, kind->has_radius ? ", radius_mm: r" : "");
        return;
    }
    for (int i = 0; i < pair_count(map); i++) {
        yaml_node_t *value;
        const char *key = key_of(w, map, i, &value);
        if (!key)
            continue;
        if (!strcmp(key, kind->mm) || !strcmp(key, kind->voxel))
            read_place(w, value, key, !strcmp(key, kind->voxel), &has_center, &out->center, &out->is_voxel);
        else if (kind->has_radius && !strcmp(key, "radius_mm"))
            read_number(w, value, key, 1e-3, 1e3, false, &out->radius);
        else
            FAULT(w, value, "unknown key '%.40s' in a %s; expected %s or %s%s", key, kind->what, kind->mm, kind->voxel, kind->has_radius ? ", radius_mm" : "");
    }
    if (!has_center)
        FAULT(w, map, "the %s has no position; expected %s (or %s)", kind->what, kind->mm, kind->voxel);
    if (kind->has_radius && !(out->radius > 0))
        FAULT(w, map, "the %s has no radius; expected radius_mm", kind->what);
}

// The trace's array for a kind of position.
static RbtRegion **places_of(Trace *trace, int kind, int **count)
{
    RbtRegion **list[PLACE_KINDS] = {&trace->forbid, &trace->cut, &trace->until, &trace->rival};
    int *counts[PLACE_KINDS] = {&trace->forbid_count, &trace->cut_count, &trace->until_count, &trace->rival_count};
    *count = counts[kind];
    return list[kind];
}

static void read_regions(const Walk *w, const yaml_node_t *list, int kind, Trace *trace)
{
    if (list->type != YAML_SEQUENCE_NODE || item_count(list) > MAX_ENTRIES) {
        FAULT(w, list, "%s is not valid; expected a list of at most %d entries", place_kinds[kind].key, MAX_ENTRIES);
        return;
    }
    int n = item_count(list), *count;
    RbtRegion *region = calloc((size_t)n + 1, sizeof *region);
    if (!region) {
        FAULT(w, list, "out of memory");
        return;
    }
    for (int i = 0; i < n; i++) {
        yaml_node_t *item = node_at(w, list->data.sequence.items.start[i]);
        if (item)
            read_region(w, item, &place_kinds[kind], &region[i]);
    }
    *places_of(trace, kind, &count) = region;
    *count = n;
}

static void read_retry_steps(const Walk *w, const yaml_node_t *list, RbtParameters *p)
{
    if (list->type != YAML_SEQUENCE_NODE || item_count(list) > RBT_MAX_RETRIES) {
        FAULT(w, list, "retry_steps is not valid; expected a list of at most %d multiples of the step", RBT_MAX_RETRIES);
        return;
    }
    p->retry_count = item_count(list);
    for (int i = 0; i < p->retry_count; i++) {
        yaml_node_t *item = node_at(w, list->data.sequence.items.start[i]);
        if (item)
            read_number(w, item, "retry_steps", 0.1, 20, false, &p->retry_steps[i]);
    }
}

// Checks that ray and direction counts are those of a subdivided icosahedron.
static void check_counts(const Walk *w, const yaml_node_t *node, const char *name, double value)
{
    if ((!strcmp(name, "N_r") || !strcmp(name, "aneurysm_rays")) && sphere_level_of((int)value) < 1)
        FAULT(w, node, "%s %g is not valid; expected 42, 162, 642 or 2562 (a subdivided icosahedron)", name, value);
    if (!strcmp(name, "N_d") && sphere_level_of(2 * (int)value) < 1)
        FAULT(w, node, "%s %g is not valid; expected 21, 81 or 321 (half of a subdivided icosahedron)", name, value);
}

static void read_parameter(const Walk *w, const char *key, const yaml_node_t *value, RbtParameters *p)
{
    for (int i = 0; i < rbt_parameter_count; i++) {
        const RbtParameterName *known = &rbt_parameter_table[i];
        if (strcmp(known->name, key))
            continue;
        double x;
        if (read_number(w, value, key, known->least, known->most, known->is_whole, &x)) {
            check_counts(w, value, key, x);
            *(double *)(void *)((char *)p + known->offset) = x;
        }
        return;
    }
    FAULT(w, value,
          "unknown key '%.40s' in a trace; expected branches, aneurysms, forbid, cut, until, not, case, edits, parameters (default or paper), or a parameter "
          "that "
          "`segment "
          "--help` lists",
          key);
}

bool trace_is_device_name(const char *text)
{
    static const char signs[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789._-";
    return text[0] && text[0] != '.' && text[strspn(text, signs)] == 0;
}

static void read_case_name(const Walk *w, const yaml_node_t *value, const char *key, char out[80])
{
    const char *text = scalar_of(value);
    if (!text || !trace_is_device_name(text) || strlen(text) >= 80)
        FAULT(w, value, "%s is not valid; expected a name of letters, digits and . - _, of a device file without its folder", key);
    else
        snprintf(out, 80, "%s", text);
}

// The key `case`.
static void read_case(const Walk *w, const yaml_node_t *map, TraceCase *out)
{
    if (map->type != YAML_MAPPING_NODE) {
        FAULT(
            w, map,
            "the case is not valid; expected {entry_mm: [x, y, z], target_mm: [x, y, z], device: FILE.yaml, catheter: FILE.yaml, anatomy: NAME, behind: true, "
            "model: sweep}");
        return;
    }
    for (int i = 0; i < pair_count(map); i++) {
        yaml_node_t *value;
        const char *key = key_of(w, map, i, &value);
        const char *text = key ? scalar_of(value) : NULL;
        if (!key)
            continue;
        if (!strcmp(key, "entry_mm")) {
            out->has_entry = true;
            read_vector(w, value, key, &out->entry);
        } else if (!strcmp(key, "target_mm")) {
            out->has_target = true;
            read_vector(w, value, key, &out->target);
        } else if (!strcmp(key, "behind")) {
            out->is_behind = text && !strcmp(text, "true");
            if (!text || (!out->is_behind && strcmp(text, "false")))
                FAULT(w, value, "behind is not valid; expected true or false");
        } else if (!strcmp(key, "device")) {
            read_case_name(w, value, key, out->device);
        } else if (!strcmp(key, "catheter")) {
            read_case_name(w, value, key, out->catheter);
        } else if (!strcmp(key, "anatomy")) {
            read_case_name(w, value, key, out->anatomy);
        } else if (!strcmp(key, "model")) {
            for (out->model = 0; model_names[out->model] && (!text || strcmp(model_names[out->model], text));)
                out->model++;
            if (!model_names[out->model])
                FAULT(w, value, "model is not valid; expected lim, sweep, raster, rbf or pas");
        } else {
            FAULT(w, value, "unknown key '%.40s' in a case; expected entry_mm, target_mm, device, catheter, anatomy, behind, model", key);
        }
    }
}

// The list of `edits` has a reader of its own.
static void read_root(const Walk *w, const yaml_node_t *root, Trace *trace, bool *has_edits)
{
    if (root->type != YAML_MAPPING_NODE) {
        FAULT(w, root, "the trace is not a map; expected `branches: [...]`");
        return;
    }
    bool has_branches = false, has_automatic = false;
    // read the parameter set first, wherever it is, because single parameters override it
    for (int i = 0; i < pair_count(root); i++) {
        yaml_node_t *key = node_at(w, root->data.mapping.pairs.start[i].key), *value = node_at(w, root->data.mapping.pairs.start[i].value);
        const char *name = key ? scalar_of(key) : NULL, *set = value ? scalar_of(value) : NULL;
        if (!name || strcmp(name, "parameters"))
            continue;
        if (set && !strcmp(set, "paper"))
            trace->parameters = rbt_paper_parameters();
        else if (!set || strcmp(set, "default"))
            FAULT(w, (value ? value : root), "the parameter set is not valid; expected default or paper");
    }
    for (int i = 0; i < pair_count(root); i++) {
        yaml_node_t *value;
        const char *key = key_of(w, root, i, &value);
        double version;
        if (!key || !strcmp(key, "parameters"))
            continue;
        *has_edits |= !strcmp(key, "edits");
        if (!strcmp(key, "edits"))
            continue;
        if (!strcmp(key, "seldinger"))
            read_number(w, value, key, 1, 1, true, &version);
        else if (!strcmp(key, "branches") || !strcmp(key, "aneurysms"))
            read_list(w, value, key[0] == 'b', trace);
        else if (place_kind_of(key) >= 0)
            read_regions(w, value, place_kind_of(key), trace);
        else if (!strcmp(key, "case"))
            read_case(w, value, &trace->made);
        else if (!strcmp(key, "retry_steps"))
            read_retry_steps(w, value, &trace->parameters);
        else
            read_parameter(w, key, value, &trace->parameters);
        has_branches = has_branches || !strcmp(key, "branches");
        has_automatic = has_automatic || !strcmp(key, "automatic");
    }
    if (!has_automatic)
        trace->parameters.automatic = trace->branch_count == 1;
    if (!has_branches || trace->branch_count < 1)
        FAULT(w, root, "there is no branch; expected `branches` with at least one start");
    if (trace->parameters.n_max < trace->parameters.n_min)
        FAULT(w, root, "N_max %g is less than N_min %g; expected at least as many", trace->parameters.n_max, trace->parameters.n_min);
}

void trace_free(Trace *trace)
{
    if (!trace)
        return;
    for (int i = 0; i < trace->aneurysm_count; i++)
        free(trace->aneurysm[i].center);
    free(trace->aneurysm);
    free(trace->branch);
    free(trace->forbid);
    free(trace->cut);
    free(trace->until);
    free(trace->rival);
    edit_list_free(trace->edits);
    free(trace);
}

static void report_yaml_error(const yaml_parser_t *parser, const char *path, Faults *faults)
{
    faults_add(faults, path, (int)parser->problem_mark.line + 1, (int)parser->problem_mark.column + 1,
               "is not YAML: %s; expected a map such as `branches: [...]`", parser->problem ? parser->problem : "unreadable");
}

static void point_to_places(Trace *trace)
{
    RbtParameters *p = &trace->parameters;
    p->forbid = trace->forbid;
    p->forbid_count = trace->forbid_count;
    p->cut = trace->cut;
    p->cut_count = trace->cut_count;
    p->until = trace->until;
    p->until_count = trace->until_count;
    p->rival = trace->rival;
    p->rival_count = trace->rival_count;
}

bool trace_add_point(Trace *trace, const char *key, Vec3 point)
{
    int *count, kind = place_kind_of(key);
    RbtRegion **list = places_of(trace, kind, &count), *grown = realloc(*list, ((size_t)*count + 2) * sizeof *grown);
    if (!grown)
        return false;
    *list = grown;
    grown[(*count)++] = (RbtRegion){.center = point};
    point_to_places(trace);
    return true;
}

Trace *trace_parse(const char *text, size_t length, const char *path, Faults *faults)
{
    yaml_parser_t parser;
    yaml_document_t document;
    int before = faults->count;
    bool has_edits = false;
    Trace *trace = calloc(1, sizeof *trace);
    if (!trace || !yaml_parser_initialize(&parser)) {
        free(trace);
        faults_add(faults, path, 0, 0, "out of memory");
        return NULL;
    }
    trace->parameters = rbt_default_parameters();
    yaml_parser_set_input_string(&parser, (const unsigned char *)text, length);
    if (!yaml_parser_load(&parser, &document)) {
        report_yaml_error(&parser, path, faults);
    } else {
        Walk walk = {&document, path, faults};
        yaml_node_t *root = yaml_document_get_root_node(&document);
        if (root)
            read_root(&walk, root, trace, &has_edits);
        else
            faults_add(faults, path, 1, 1, "the file is empty; expected a map such as `branches: [...]`");
        bool has_root = root != NULL;
        yaml_document_delete(&document);
        if (has_root && !yaml_parser_load(&parser, &document)) {
            report_yaml_error(&parser, path, faults);
        } else if (has_root) {
            root = yaml_document_get_root_node(&document);
            if (root)
                FAULT(&walk, root, "a second document begins; expected one");
            yaml_document_delete(&document);
        }
    }
    yaml_parser_delete(&parser);
    point_to_places(trace);
    if (has_edits)
        trace->edits = edit_list_parse_within(text, length, path, faults);
    if (faults->count == before)
        return trace;
    trace_free(trace);
    return NULL;
}

Trace *trace_load(const char *path, Faults *faults)
{
    size_t length;
    char *text = whole_file_read_most(path, TRACE_BYTES_MOST, &length, faults);
    Trace *trace = text ? trace_parse(text, length, path, faults) : NULL;
    free(text);
    return trace;
}
