#include "recon/sweep_file.h"

#include "base/base.h"
#include "recon/edit/edit_list.h"
#include "recon/hdf5_reader.h"
#include "recon/hdf5_writer.h"

#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

const char *sweep_file_group(SectionKind kind) { return kind == SECTION_POLAR ? "sweep" : section_kind_name[kind]; }

// Those of every model; of sacs; of stretches.
enum { PARENT, PARENT_T, OPEN_START, RADIUS, KNOT_OFFSET, BREAK_OFFSET, KNOT, KNOT_NODE, BREAK_T, ROW, BLEND, SHARED };
enum {
    SAC_CENTER = SHARED,
    SAC_RADIUS,
    SAC_DIRECTION,
    SAC_HEIGHT,
    SAC_PARENT,
    SAC_KIND,
    SAC_NODE,
    BLOB_OFFSET,
    BLOB_CENTER,
    BLOB_WIDTH,
    BLOB_AMPLITUDE,
    SACS_END,
    STRETCH_BRANCH = SACS_END,
    STRETCH_RANGE,
    STRETCH_KIND,
    STRETCH_PARAMETER,
    STATION_OFFSET,
    STATION_T,
    CONTOUR_OFFSET,
    CONTOUR,
    COLUMNS
};
// what only edited models have; the paths are within the group
static const Hdf5Dataset branch_blend = {"/branch/blend", HDF5_DOUBLE, 1, {0}, true};
static const Hdf5Dataset branch_tag = {"/branch/tag", HDF5_UINT8, 2, {0, 2}, false};
static const char edits_rest[] = "/edits";

// Columns of stretch/range, stretch/kind and stretch/parameter.
enum { FROM, TO, FADE, RANGES };
enum { KIND, FORM, HARMONICS, WEIGHTS, IS_STRAIGHT, KINDS };
enum { STIFFNESS, DELTA, VOXEL, TENSION, WIDTH, PARAMETERS };
static const Hdf5Dataset columns[COLUMNS] = {
    // as docs/file-formats.md specifies; the first part is the group's name
    [PARENT] = {"/sweep/branch/parent", HDF5_INT32, 1, {0}, false},
    [PARENT_T] = {"/sweep/branch/parent_t", HDF5_DOUBLE, 1, {0}, true},
    [OPEN_START] = {"/sweep/branch/open_start", HDF5_UINT8, 1, {0}, false},
    [RADIUS] = {"/sweep/branch/radius", HDF5_DOUBLE, 1, {0}, true},
    [KNOT_OFFSET] = {"/sweep/branch/knot_offset", HDF5_INT32, 1, {0}, false},
    [BREAK_OFFSET] = {"/sweep/branch/break_offset", HDF5_INT32, 1, {0}, false},
    [KNOT] = {"/sweep/curve/knot", HDF5_DOUBLE, 2, {0, 3}, true},
    [KNOT_NODE] = {"/sweep/curve/node", HDF5_INT32, 1, {0}, false},
    [BREAK_T] = {"/sweep/section/break_t", HDF5_DOUBLE, 1, {0}, true},
    [ROW] = {"/sweep/section/row", HDF5_DOUBLE, 2, {0, SWEEP_TERMS}, true},
    [BLEND] = {"/sweep/blend", HDF5_DOUBLE, 1, {1}, true},
    [SAC_CENTER] = {"/sweep/sac/center", HDF5_DOUBLE, 2, {0, 3}, true},
    [SAC_RADIUS] = {"/sweep/sac/radius", HDF5_DOUBLE, 1, {0}, true},
    [SAC_DIRECTION] = {"/sweep/sac/direction", HDF5_DOUBLE, 2, {0, 3}, true},
    [SAC_HEIGHT] = {"/sweep/sac/height", HDF5_DOUBLE, 1, {0}, true},
    [SAC_PARENT] = {"/sweep/sac/parent", HDF5_INT32, 1, {0}, false},
    [SAC_KIND] = {"/sweep/sac/kind", HDF5_UINT8, 1, {0}, false},
    [SAC_NODE] = {"/sweep/sac/node", HDF5_INT32, 1, {0}, false},
    [BLOB_OFFSET] = {"/sweep/sac/blob_offset", HDF5_INT64, 1, {0}, false},
    [BLOB_CENTER] = {"/sweep/sac/blob_center", HDF5_DOUBLE, 2, {0, 3}, true},
    [BLOB_WIDTH] = {"/sweep/sac/blob_width", HDF5_DOUBLE, 1, {0}, true},
    [BLOB_AMPLITUDE] = {"/sweep/sac/blob_amplitude", HDF5_DOUBLE, 1, {0}, true},
    [STRETCH_BRANCH] = {"/sweep/stretch/branch", HDF5_INT32, 1, {0}, false},
    [STRETCH_RANGE] = {"/sweep/stretch/range", HDF5_DOUBLE, 2, {0, RANGES}, true},
    [STRETCH_KIND] = {"/sweep/stretch/kind", HDF5_INT32, 2, {0, KINDS}, false},
    [STRETCH_PARAMETER] = {"/sweep/stretch/parameter", HDF5_DOUBLE, 2, {0, PARAMETERS}, true},
    [STATION_OFFSET] = {"/sweep/stretch/station_offset", HDF5_INT32, 1, {0}, false},
    [STATION_T] = {"/sweep/stretch/station_t", HDF5_DOUBLE, 1, {0}, true},
    [CONTOUR_OFFSET] = {"/sweep/stretch/contour_offset", HDF5_INT32, 1, {0}, false},
    [CONTOUR] = {"/sweep/stretch/contour", HDF5_DOUBLE, 2, {0, 2}, true},
};

// "/rbf" and the rest of a column's path; `path` holds it.
enum { PATH = 64 };
static const char *path_in(SectionKind kind, const char *rest, char path[PATH])
{
    snprintf(path, PATH, "/%s%s", sweep_file_group(kind), rest);
    return path;
}
static const char *column_rest(int column) { return columns[column].path + strlen("/sweep"); }

// --- reading ---

typedef struct Reader {
    Hdf5Reader *file;
    const char *name;
    const VesselTree *tree;
    Faults *faults;
    SectionKind kind;
    Hdf5Dataset found[COLUMNS];
    char path[COLUMNS][PATH];
    bool has_sac, has_stretch;
} Reader;

static bool has_group(const Reader *r, const char *rest)
{
    char path[PATH];
    return hdf5_has(r->file, path_in(r->kind, rest, path));
}

static uint64_t size_of(const Reader *r, int column) { return r->found[column].size[0]; }

static void expect_rows(const Reader *r, int column, uint64_t rows, const char *meaning)
{
    if (size_of(r, column) != rows)
        faults_add(r->faults, r->name, 0, 0, "%s has %" PRIu64 " rows; expected %" PRIu64 ", %s", r->found[column].path, size_of(r, column), rows, meaning);
}

static void expect_some(const Reader *r, int column, uint64_t most)
{
    if (size_of(r, column) < 1 || size_of(r, column) > most)
        faults_add(r->faults, r->name, 0, 0, "%s has %" PRIu64 " rows; expected 1 to %" PRIu64, r->found[column].path, size_of(r, column), most);
}

static void check_profile(const Reader *r)
{
    char path[PATH];
    const char *profile = section_kind_name[r->kind];
    char *text = hdf5_text_attribute(r->file, path_in(r->kind, "", path), "profile");
    if (!text || strcmp(text, profile))
        faults_add(r->faults, r->name, 0, 0, "attribute profile of %s is '%.40s'; expected %s", path, text ? text : "", profile);
    free(text);
}

// Shapes of all arrays. Returns false with faults.
static bool check_sizes(Reader *r)
{
    enum { MOST = 1 << 24 };
    int before = r->faults->count;
    memcpy(r->found, columns, sizeof r->found);
    r->has_sac = has_group(r, "/sac"), r->has_stretch = has_group(r, "/stretch");
    for (int i = 0; i < COLUMNS; i++) {
        r->found[i].path = path_in(r->kind, column_rest(i), r->path[i]);
        if (i < SHARED || (i < SACS_END ? r->has_sac : r->has_stretch))
            hdf5_inspect(r->file, &r->found[i]);
    }
    check_profile(r);
    if (r->faults->count > before)
        return false;
    uint64_t branches = size_of(r, PARENT), nodes = size_of(r, SAC_CENTER), blobs = size_of(r, BLOB_CENTER);
    expect_some(r, PARENT, MOST);
    expect_some(r, KNOT, MOST);
    expect_some(r, BREAK_T, MOST);
    for (int i = PARENT_T; i <= RADIUS; i++)
        expect_rows(r, i, branches, "the number of branches");
    expect_rows(r, KNOT_OFFSET, branches + 1, "the number of branches and one");
    expect_rows(r, BREAK_OFFSET, branches + 1, "the number of branches and one");
    expect_rows(r, KNOT_NODE, size_of(r, KNOT), "the number of knots");
    expect_rows(r, ROW, size_of(r, BREAK_T) + 2 * branches, "the number of breaks and two for each branch");
    if (r->has_sac) {
        expect_some(r, SAC_CENTER, MOST);
        expect_some(r, BLOB_CENTER, INT32_MAX);
        for (int i = SAC_RADIUS; i <= SAC_NODE; i++)
            expect_rows(r, i, nodes, "the number of the sacs' nodes");
        expect_rows(r, BLOB_OFFSET, nodes + 1, "the number of the sacs' nodes and one");
        expect_rows(r, BLOB_WIDTH, blobs, "the number of blobs");
        expect_rows(r, BLOB_AMPLITUDE, blobs, "the number of blobs");
    }
    if (r->has_stretch) {
        uint64_t stretches = size_of(r, STRETCH_BRANCH), stations = size_of(r, STATION_T);
        expect_some(r, STRETCH_BRANCH, MOST);
        expect_some(r, STATION_T, MOST);
        expect_some(r, CONTOUR, MOST);
        for (int i = STRETCH_RANGE; i <= STRETCH_PARAMETER; i++)
            expect_rows(r, i, stretches, "the number of stretches");
        expect_rows(r, STATION_OFFSET, stretches + 1, "the number of stretches and one");
        expect_rows(r, CONTOUR_OFFSET, stations + 1, "the number of stations and one");
    }
    return r->faults->count == before;
}

typedef struct BranchColumns {
    int32_t *parent, *knot_offset, *break_offset;
    double *parent_t, *radius;
    uint8_t *open_start;
} BranchColumns;

static bool check_offsets(const Reader *r, const char *path, const int32_t *offset, int count, int total)
{
    bool good = offset[0] == 0 && offset[count] == total;
    for (int i = 0; i < count; i++)
        good = good && offset[i] <= offset[i + 1];
    if (!good)
        faults_add(r->faults, r->name, 0, 0, "%s is no list of offsets; expected numbers that do not decrease from 0 to the number of rows, %d", path, total);
    return good;
}

static bool take_branches(const Reader *r, const BranchColumns *c, SweepModel *m)
{
    if (!check_offsets(r, r->path[KNOT_OFFSET], c->knot_offset, m->branch_count, m->knot_count) ||
        !check_offsets(r, r->path[BREAK_OFFSET], c->break_offset, m->branch_count, m->break_count))
        return false;
    for (int i = 0; i < m->branch_count; i++)
        m->branch[i] = (SweepBranch){.parent = c->parent[i],
                                     .parent_t = c->parent_t[i],
                                     .open_start = c->open_start[i] != 0,
                                     .radius = c->radius[i],
                                     .first_knot = c->knot_offset[i],
                                     .knot_count = c->knot_offset[i + 1] - c->knot_offset[i],
                                     .first_break = c->break_offset[i],
                                     .break_count = c->break_offset[i + 1] - c->break_offset[i],
                                     .first_row = c->break_offset[i] + 2 * i};
    return true;
}

static bool check_nodes(const Reader *r, const char *path, const int32_t *node, int count)
{
    for (int i = 0; i < count; i++)
        if (node[i] < 0 || node[i] >= r->tree->node_count) {
            faults_add(r->faults, r->name, 0, 0, "%s[%d] is %d; expected a node of the tree, 0 to %d", path, i, (int)node[i], r->tree->node_count - 1);
            return false;
        }
    return true;
}

static bool read_branches(const Reader *r, SweepModel *m)
{
    size_t n = (size_t)m->branch_count;
    BranchColumns c = {.parent = calloc(n, sizeof(int32_t)),
                       .knot_offset = calloc(n + 1, sizeof(int32_t)),
                       .break_offset = calloc(n + 1, sizeof(int32_t)),
                       .parent_t = calloc(n, sizeof(double)),
                       .radius = calloc(n, sizeof(double)),
                       .open_start = calloc(n, 1)};
    void *const target[SHARED] = {[PARENT] = c.parent,
                                  [PARENT_T] = c.parent_t,
                                  [OPEN_START] = c.open_start,
                                  [RADIUS] = c.radius,
                                  [KNOT_OFFSET] = c.knot_offset,
                                  [BREAK_OFFSET] = c.break_offset,
                                  [KNOT] = m->knot,
                                  [KNOT_NODE] = m->knot_node,
                                  [BREAK_T] = m->break_t,
                                  [ROW] = m->row,
                                  [BLEND] = &m->blend};
    bool good = c.parent && c.knot_offset && c.break_offset && c.parent_t && c.radius && c.open_start;
    if (!good)
        faults_add(r->faults, r->name, 0, 0, "needs more memory than is available (%d branches)", m->branch_count);
    for (int i = 0; i < SHARED && good; i++)
        good = hdf5_read_into(r->file, &r->found[i], target[i]);
    good = good && take_branches(r, &c, m) && check_nodes(r, r->path[KNOT_NODE], m->knot_node, m->knot_count);
    free(c.parent);
    free(c.knot_offset);
    free(c.break_offset);
    free(c.parent_t);
    free(c.radius);
    free(c.open_start);
    return good;
}

static bool read_sacs(const Reader *r, SweepModel *m)
{
    int nodes = (int)size_of(r, SAC_CENTER);
    VesselTree *s = m->sac = vessel_tree_create_shared(nodes, 0, (int64_t)size_of(r, BLOB_CENTER));
    m->sac_node = calloc((size_t)nodes, sizeof *m->sac_node);
    if (!s || !m->sac_node) {
        faults_add(r->faults, r->name, 0, 0, "needs more memory than is available (%d nodes of sacs)", nodes);
        return false;
    }
    void *const target[SACS_END] = {[SAC_CENTER] = s->center,
                                    [SAC_RADIUS] = s->radius,
                                    [SAC_DIRECTION] = s->direction,
                                    [SAC_HEIGHT] = s->height,
                                    [SAC_PARENT] = s->parent,
                                    [SAC_KIND] = s->kind,
                                    [SAC_NODE] = m->sac_node,
                                    [BLOB_OFFSET] = s->blob_offset,
                                    [BLOB_CENTER] = s->blob_center,
                                    [BLOB_WIDTH] = s->blob_width,
                                    [BLOB_AMPLITUDE] = s->blob_amplitude};
    bool good = true;
    for (int i = SAC_CENTER; i < SACS_END; i++)
        good = hdf5_read_into(r->file, &r->found[i], target[i]) && good;
    good = good && vessel_tree_validate(s, r->name, r->faults) && check_nodes(r, r->path[SAC_NODE], m->sac_node, nodes);
    if (good && !vessel_tree_link(s)) {
        faults_add(r->faults, r->name, 0, 0, "not enough memory for the links of %d nodes of sacs", nodes);
        return false;
    }
    return good;
}

// A dataset with a row for each branch. Returns NULL if the file lacks it, or with a fault.
static void *read_for_branches(const Reader *r, const SweepModel *m, const Hdf5Dataset *column)
{
    Hdf5Dataset found = *column;
    char path[PATH];
    found.path = path_in(r->kind, column->path, path);
    if (!hdf5_has(r->file, path))
        return NULL;
    found.size[0] = (uint64_t)m->branch_count;
    return hdf5_read(r->file, &found);
}

static bool read_edits(const Reader *r, SweepModel *m)
{
    char path[PATH];
    int before = r->faults->count;
    double *blend = read_for_branches(r, m, &branch_blend);
    uint8_t *tag = read_for_branches(r, m, &branch_tag);
    for (int i = 0; i < m->branch_count; i++) {
        SweepBranch *b = &m->branch[i];
        if (blend && blend[i] != -1)
            b->has_blend = true, b->blend = blend[i];
        if (tag)
            b->tag[0] = tag[2 * i], b->tag[1] = tag[2 * i + 1];
    }
    free(blend);
    free(tag);
    m->edits = hdf5_text(r->file, path_in(r->kind, edits_rest, path));
    EditList *list = m->edits ? edit_list_parse(m->edits, strlen(m->edits), r->name, r->faults) : NULL;
    edit_list_free(list);
    return r->faults->count == before;
}

typedef struct StretchColumns {
    int32_t *branch, *kind, *station_offset, *contour_offset;
    double *range, *parameter, *t;
    SectionPoint *contour;
} StretchColumns;

static bool take_stretches(const Reader *r, const StretchColumns *c, SweepModel *m)
{
    int stretches = (int)size_of(r, STRETCH_BRANCH), stations = (int)size_of(r, STATION_T), contours = (int)size_of(r, CONTOUR);
    SweepStretch *stretch = calloc((size_t)stretches, sizeof *stretch);
    SweepStation *station = calloc((size_t)stations, sizeof *station);
    bool good = stretch && station;
    if (!good)
        faults_add(r->faults, r->name, 0, 0, "needs more memory than is available (%d stations)", stations);
    good = good && check_offsets(r, r->path[STATION_OFFSET], c->station_offset, stretches, stations) &&
           check_offsets(r, r->path[CONTOUR_OFFSET], c->contour_offset, stations, contours);
    for (int i = 0; good && i < stretches; i++) {
        const double *range = c->range + (size_t)i * RANGES, *number = c->parameter + (size_t)i * PARAMETERS;
        const int32_t *kind = c->kind + (size_t)i * KINDS;
        stretch[i] = (SweepStretch){.branch = c->branch[i],
                                    .from = range[FROM],
                                    .to = range[TO],
                                    .fade = range[FADE],
                                    .first_station = c->station_offset[i],
                                    .station_count = c->station_offset[i + 1] - c->station_offset[i],
                                    .section = {.kind = (SectionKind)kind[KIND],
                                                .form = (SectionForm)kind[FORM],
                                                .harmonics = kind[HARMONICS],
                                                .stiffness = number[STIFFNESS],
                                                .delta_mm = number[DELTA],
                                                .voxel_mm = number[VOXEL]},
                                    .weights = (SectionWeights)kind[WEIGHTS],
                                    .tension = number[TENSION],
                                    .width = number[WIDTH],
                                    .is_straight = kind[IS_STRAIGHT] != 0};
    }
    for (int i = 0; good && i < stations; i++)
        station[i] = (SweepStation){c->t[i], c->contour_offset[i], c->contour_offset[i + 1] - c->contour_offset[i]};
    good = good && sweep_model_set_stretches(m, stretches, stretch, stations, station, contours, c->contour, r->name, r->faults);
    free(stretch);
    free(station);
    return good;
}

static bool read_stretches(const Reader *r, SweepModel *m)
{
    size_t stretches = (size_t)size_of(r, STRETCH_BRANCH), stations = (size_t)size_of(r, STATION_T);
    StretchColumns c = {.branch = calloc(stretches, sizeof(int32_t)),
                        .kind = calloc(stretches * KINDS, sizeof(int32_t)),
                        .station_offset = calloc(stretches + 1, sizeof(int32_t)),
                        .contour_offset = calloc(stations + 1, sizeof(int32_t)),
                        .range = calloc(stretches * RANGES, sizeof(double)),
                        .parameter = calloc(stretches * PARAMETERS, sizeof(double)),
                        .t = calloc(stations, sizeof(double)),
                        .contour = calloc((size_t)size_of(r, CONTOUR), sizeof(SectionPoint))};
    void *const target[COLUMNS] = {[STRETCH_BRANCH] = c.branch,
                                   [STRETCH_RANGE] = c.range,
                                   [STRETCH_KIND] = c.kind,
                                   [STRETCH_PARAMETER] = c.parameter,
                                   [STATION_OFFSET] = c.station_offset,
                                   [STATION_T] = c.t,
                                   [CONTOUR_OFFSET] = c.contour_offset,
                                   [CONTOUR] = c.contour};
    bool good = c.branch && c.kind && c.station_offset && c.contour_offset && c.range && c.parameter && c.t && c.contour;
    if (!good)
        faults_add(r->faults, r->name, 0, 0, "needs more memory than is available (%zu stations)", stations);
    for (int i = SACS_END; good && i < COLUMNS; i++)
        good = hdf5_read_into(r->file, &r->found[i], target[i]);
    good = good && take_stretches(r, &c, m);
    free(c.branch);
    free(c.kind);
    free(c.station_offset);
    free(c.contour_offset);
    free(c.range);
    free(c.parameter);
    free(c.t);
    free(c.contour);
    return good;
}

static SweepModel *read_model(Reader *r)
{
    if (!has_group(r, "")) {
        const char *group = sweep_file_group(r->kind);
        faults_add(r->faults, r->name, 0, 0, "has no swept model /%s; `seldinger fit %s --model %s -o OUT.h5` makes one", group, r->name, group);
        return NULL;
    }
    if (!check_sizes(r))
        return NULL;
    SweepModel *m = sweep_model_create((int)size_of(r, PARENT), (int)size_of(r, KNOT), (int)size_of(r, BREAK_T), (int)size_of(r, ROW));
    if (!m) {
        faults_add(r->faults, r->name, 0, 0, "needs more memory than is available (%" PRIu64 " rows of sections)", size_of(r, ROW));
        return NULL;
    }
    bool good = read_branches(r, m) && (!r->has_sac || read_sacs(r, m)) && read_edits(r, m) && sweep_model_validate(m, r->name, r->faults) &&
                (!r->has_stretch || read_stretches(r, m));
    if (good)
        return m;
    sweep_model_free(m);
    return NULL;
}

static SweepModel *parse(const void *bytes, size_t length, bool has_rehearsal, const char *name, SectionKind kind, const VesselTree *tree, Faults *faults)
{
    SEL_ASSERT((int)kind >= 0 && kind < SECTION_KINDS, "a model's sections are of a kind that exists");
    Reader reader = {.name = name, .tree = tree, .faults = faults, .kind = kind};
    reader.file = hdf5_reader_parse(bytes, length, has_rehearsal, name, "a swept model has it", faults);
    SweepModel *model = reader.file ? read_model(&reader) : NULL;
    hdf5_reader_close(reader.file);
    return model;
}

SweepModel *sweep_file_parse(const void *bytes, size_t length, const char *name, SectionKind kind, const VesselTree *tree, Faults *faults)
{
    return parse(bytes, length, false, name, kind, tree, faults);
}

SweepModel *sweep_file_load(const char *path, SectionKind kind, const VesselTree *tree, Faults *faults)
{
    size_t length;
    char *bytes = whole_file_read(path, &length, faults);
    SweepModel *model = bytes ? parse(bytes, length, true, path, kind, tree, faults) : NULL;
    free(bytes);
    return model;
}

bool sweep_models_load(const char *path, const VesselTree *tree, SweepModels *models, Faults *faults)
{
    int before = faults->count;
    bool is_in[SECTION_KINDS];
    *models = (SweepModels){{NULL}};
    Hdf5Reader *file = hdf5_reader_open(path, "a swept model has it", faults);
    for (int i = 0; file && i < SECTION_KINDS; i++) {
        char group[PATH];
        is_in[i] = hdf5_has(file, path_in((SectionKind)i, "", group));
    }
    hdf5_reader_close(file);
    for (int i = 0; faults->count == before && i < SECTION_KINDS; i++)
        models->of[i] = is_in[i] ? sweep_file_load(path, (SectionKind)i, tree, faults) : NULL;
    if (faults->count > before)
        sweep_models_free(models);
    return faults->count == before;
}

void sweep_models_free(SweepModels *models)
{
    for (int i = 0; i < SECTION_KINDS; i++)
        sweep_model_free(models->of[i]);
    *models = (SweepModels){{NULL}};
}

// --- writing ---

typedef struct Writer {
    hid_t file;
    SectionKind kind;
} Writer;

static bool write_at(const Writer *w, int column, int64_t rows, const void *data)
{
    static const Hdf5Type types[] = {HDF5_UINT8, HDF5_INT32, HDF5_INT64, HDF5_DOUBLE};
    const hid_t native[] = {H5T_NATIVE_UINT8, H5T_NATIVE_INT32, H5T_NATIVE_INT64, H5T_NATIVE_DOUBLE};
    char path[PATH];
    int type = 0;
    while (types[type] != columns[column].type)
        type++;
    return hdf5_write_column(w->file, path_in(w->kind, column_rest(column), path), native[type], rows,
                             columns[column].rank == 2 ? (int)columns[column].size[1] : 0, data);
}

static bool make_group(const Writer *w, const char *rest)
{
    char path[PATH];
    return hdf5_make_group(w->file, path_in(w->kind, rest, path));
}

static bool write_profile(const Writer *w)
{
    char path[PATH];
    hid_t group = H5Gopen2(w->file, path_in(w->kind, "", path), H5P_DEFAULT);
    bool good = group >= 0 && hdf5_write_text(group, "profile", section_kind_name[w->kind]);
    if (group >= 0)
        H5Gclose(group);
    return good;
}

static bool write_branches(const Writer *w, const SweepModel *m)
{
    size_t n = (size_t)m->branch_count;
    int32_t *number = calloc(3 * n + 2, sizeof *number);
    double *length = calloc(2 * n, sizeof *length);
    uint8_t *open = calloc(n, 1);
    bool good = number && length && open;
    for (size_t i = 0; good && i < n; i++) {
        const SweepBranch *b = &m->branch[i];
        number[i] = b->parent, number[n + i] = b->first_knot, number[2 * n + 1 + i] = b->first_break;
        length[i] = b->parent_t, length[n + i] = b->radius, open[i] = b->open_start;
    }
    if (good) {
        number[2 * n] = m->knot_count, number[3 * n + 1] = m->break_count;
        good = write_at(w, PARENT, m->branch_count, number) && write_at(w, KNOT_OFFSET, m->branch_count + 1, number + n) &&
               write_at(w, BREAK_OFFSET, m->branch_count + 1, number + 2 * n + 1) && write_at(w, PARENT_T, m->branch_count, length) &&
               write_at(w, RADIUS, m->branch_count, length + n) && write_at(w, OPEN_START, m->branch_count, open);
    }
    free(number);
    free(length);
    free(open);
    return good;
}

static bool write_for_branches(const Writer *w, const SweepModel *m)
{
    char path[PATH];
    size_t n = (size_t)m->branch_count;
    double *blend = calloc(n, sizeof *blend);
    uint8_t *tag = calloc(2 * n, 1);
    bool good = blend && tag, has_blend = false, has_tag = false;
    for (size_t i = 0; good && i < n; i++) {
        const SweepBranch *b = &m->branch[i];
        blend[i] = b->has_blend ? b->blend : -1;
        memcpy(tag + 2 * i, b->tag, 2);
        has_blend |= b->has_blend, has_tag |= b->tag[0] || b->tag[1];
    }
    if (good && has_blend)
        good = hdf5_write_column(w->file, path_in(w->kind, branch_blend.path, path), H5T_NATIVE_DOUBLE, m->branch_count, 0, blend);
    if (good && has_tag)
        good = hdf5_write_column(w->file, path_in(w->kind, branch_tag.path, path), H5T_NATIVE_UINT8, m->branch_count, 2, tag);
    free(blend);
    free(tag);
    return good;
}

static bool write_edits(const Writer *w, const SweepModel *m)
{
    char path[PATH];
    return write_for_branches(w, m) && (!m->edits || hdf5_write_long_text(w->file, path_in(w->kind, edits_rest, path), m->edits));
}

static bool write_sacs(const Writer *w, const SweepModel *m)
{
    const VesselTree *s = m->sac;
    int64_t n = s->node_count, b = s->blob_count;
    return make_group(w, "/sac") && write_at(w, SAC_CENTER, n, s->center) && write_at(w, SAC_RADIUS, n, s->radius) &&
           write_at(w, SAC_DIRECTION, n, s->direction) && write_at(w, SAC_HEIGHT, n, s->height) && write_at(w, SAC_PARENT, n, s->parent) &&
           write_at(w, SAC_KIND, n, s->kind) && write_at(w, SAC_NODE, n, m->sac_node) && write_at(w, BLOB_OFFSET, n + 1, s->blob_offset) &&
           write_at(w, BLOB_CENTER, b, s->blob_center) && write_at(w, BLOB_WIDTH, b, s->blob_width) && write_at(w, BLOB_AMPLITUDE, b, s->blob_amplitude);
}

static bool write_stretches(const Writer *w, const SweepModel *m)
{
    size_t stretches = (size_t)m->stretch_count, stations = (size_t)m->station_count;
    int32_t *number = calloc(stretches * (KINDS + 2) + stations + 2, sizeof *number);
    double *length = calloc(stretches * (RANGES + PARAMETERS), sizeof *length);
    bool good = number && length && make_group(w, "/stretch");
    int32_t *kind = number + stretches, *station = kind + stretches * KINDS, *contour = station + stretches + 1;
    double *parameter = length + stretches * RANGES;
    for (size_t i = 0; good && i < stretches; i++) {
        const SweepStretch *s = &m->stretch[i];
        const int32_t kinds[KINDS] = {
            [KIND] = s->section.kind, [FORM] = s->section.form, [HARMONICS] = s->section.harmonics, [WEIGHTS] = s->weights, [IS_STRAIGHT] = s->is_straight};
        const double ranges[RANGES] = {[FROM] = s->from, [TO] = s->to, [FADE] = s->fade};
        const double parameters[PARAMETERS] = {
            [STIFFNESS] = s->section.stiffness, [DELTA] = s->section.delta_mm, [VOXEL] = s->section.voxel_mm, [TENSION] = s->tension, [WIDTH] = s->width};
        number[i] = s->branch, station[i] = s->first_station;
        memcpy(kind + i * KINDS, kinds, sizeof kinds);
        memcpy(length + i * RANGES, ranges, sizeof ranges);
        memcpy(parameter + i * PARAMETERS, parameters, sizeof parameters);
    }
    for (size_t i = 0; good && i < stations; i++)
        contour[i] = m->station[i].first_point;
    if (good) {
        station[stretches] = m->station_count, contour[stations] = m->contour_count;
        good = write_at(w, STRETCH_BRANCH, m->stretch_count, number) && write_at(w, STRETCH_RANGE, m->stretch_count, length) &&
               write_at(w, STRETCH_KIND, m->stretch_count, kind) && write_at(w, STRETCH_PARAMETER, m->stretch_count, parameter) &&
               write_at(w, STATION_OFFSET, m->stretch_count + 1, station) && write_at(w, STATION_T, m->station_count, m->station_t) &&
               write_at(w, CONTOUR_OFFSET, m->station_count + 1, contour) && write_at(w, CONTOUR, m->contour_count, m->contour);
    }
    free(number);
    free(length);
    return good;
}

static bool write_model(const Writer *w, const SweepModel *m)
{
    return make_group(w, "") && write_profile(w) && make_group(w, "/branch") && make_group(w, "/curve") && make_group(w, "/section") && write_branches(w, m) &&
           write_at(w, KNOT, m->knot_count, m->knot) && write_at(w, KNOT_NODE, m->knot_count, m->knot_node) &&
           write_at(w, BREAK_T, m->break_count, m->break_t) && write_at(w, ROW, m->row_count, m->row) && write_at(w, BLEND, 1, &m->blend) &&
           write_edits(w, m) && (!m->sac || write_sacs(w, m)) && (m->stretch_count == 0 || write_stretches(w, m));
}

bool sweep_models_write(int64_t file, const SweepModels *models)
{
    bool good = true;
    for (int i = 0; good && i < SECTION_KINDS; i++) {
        Writer writer = {(hid_t)file, (SectionKind)i};
        good = !models->of[i] || write_model(&writer, models->of[i]);
    }
    return good;
}
