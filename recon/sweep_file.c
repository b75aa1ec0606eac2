#include "recon/sweep_file.h"

#include "base/base.h"
#include "recon/edit/edit_list.h"
#include "recon/hdf5_reader.h"
#include "recon/hdf5_writer.h"

#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

static const char profile[] = "polar";

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
    COLUMNS
};
// what only edited models have
static const Hdf5Dataset branch_blend = {"/sweep/branch/blend", HDF5_DOUBLE, 1, {0}, true};
static const Hdf5Dataset branch_tag = {"/sweep/branch/tag", HDF5_UINT8, 2, {0, 2}, false};
static const char edits_path[] = "/sweep/edits";

static const Hdf5Dataset columns[COLUMNS] = {
    // as docs/file-formats.md specifies
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
};

// --- reading ---

typedef struct Reader {
    Hdf5Reader *file;
    const char *name;
    const VesselTree *tree;
    Faults *faults;
    Hdf5Dataset found[COLUMNS];
    bool has_sac;
} Reader;

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
    char *text = hdf5_text_attribute(r->file, "/sweep", "profile");
    if (!text || strcmp(text, profile))
        faults_add(r->faults, r->name, 0, 0, "attribute profile of /sweep is '%.40s'; expected %s", text ? text : "", profile);
    free(text);
}

// Shapes of all arrays. Returns false with faults.
static bool check_shapes(Reader *r)
{
    enum { MOST = 1 << 24 };
    int before = r->faults->count;
    memcpy(r->found, columns, sizeof r->found);
    r->has_sac = hdf5_has(r->file, "/sweep/sac");
    for (int i = 0; i < (r->has_sac ? COLUMNS : SHARED); i++)
        hdf5_inspect(r->file, &r->found[i]);
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
    if (!check_offsets(r, columns[KNOT_OFFSET].path, c->knot_offset, m->branch_count, m->knot_count) ||
        !check_offsets(r, columns[BREAK_OFFSET].path, c->break_offset, m->branch_count, m->break_count))
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
    good = good && take_branches(r, &c, m) && check_nodes(r, columns[KNOT_NODE].path, m->knot_node, m->knot_count);
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
    void *const target[COLUMNS] = {[SAC_CENTER] = s->center,
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
    for (int i = SAC_CENTER; i < COLUMNS; i++)
        good = hdf5_read_into(r->file, &r->found[i], target[i]) && good;
    good = good && vessel_tree_validate(s, r->name, r->faults) && check_nodes(r, columns[SAC_NODE].path, m->sac_node, nodes);
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
    if (!hdf5_has(r->file, column->path))
        return NULL;
    found.size[0] = (uint64_t)m->branch_count;
    return hdf5_read(r->file, &found);
}

static bool read_edits(const Reader *r, SweepModel *m)
{
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
    m->edits = hdf5_text(r->file, edits_path);
    EditList *list = m->edits ? edit_list_parse(m->edits, strlen(m->edits), r->name, r->faults) : NULL;
    edit_list_free(list);
    return r->faults->count == before;
}

static SweepModel *read_model(Reader *r)
{
    if (!hdf5_has(r->file, "/sweep")) {
        faults_add(r->faults, r->name, 0, 0, "has no swept model (/sweep); `seldinger fit %s --model sweep -o OUT.h5` makes one", r->name);
        return NULL;
    }
    if (!check_shapes(r))
        return NULL;
    SweepModel *m = sweep_model_create((int)size_of(r, PARENT), (int)size_of(r, KNOT), (int)size_of(r, BREAK_T), (int)size_of(r, ROW));
    if (!m) {
        faults_add(r->faults, r->name, 0, 0, "needs more memory than is available (%" PRIu64 " rows of sections)", size_of(r, ROW));
        return NULL;
    }
    bool good = read_branches(r, m) && (!r->has_sac || read_sacs(r, m)) && read_edits(r, m) && sweep_model_validate(m, r->name, r->faults);
    if (good)
        return m;
    sweep_model_free(m);
    return NULL;
}

static SweepModel *parse(const void *bytes, size_t length, bool has_rehearsal, const char *name, const VesselTree *tree, Faults *faults)
{
    Reader reader = {.name = name, .tree = tree, .faults = faults};
    reader.file = hdf5_reader_parse(bytes, length, has_rehearsal, name, "a swept model has it", faults);
    SweepModel *model = reader.file ? read_model(&reader) : NULL;
    hdf5_reader_close(reader.file);
    return model;
}

SweepModel *sweep_file_parse(const void *bytes, size_t length, const char *name, const VesselTree *tree, Faults *faults)
{
    return parse(bytes, length, false, name, tree, faults);
}

SweepModel *sweep_file_load(const char *path, const VesselTree *tree, Faults *faults)
{
    size_t length;
    char *bytes = whole_file_read(path, &length, faults);
    SweepModel *model = bytes ? parse(bytes, length, true, path, tree, faults) : NULL;
    free(bytes);
    return model;
}

bool sweep_file_is_in(const char *path, Faults *faults)
{
    Hdf5Reader *file = hdf5_reader_open(path, "a swept model has it", faults);
    bool is_in = file && hdf5_has(file, "/sweep");
    hdf5_reader_close(file);
    return is_in;
}

// --- writing ---

static bool write_at(hid_t file, int column, int64_t rows, const void *data)
{
    static const Hdf5Type types[] = {HDF5_UINT8, HDF5_INT32, HDF5_INT64, HDF5_DOUBLE};
    const hid_t native[] = {H5T_NATIVE_UINT8, H5T_NATIVE_INT32, H5T_NATIVE_INT64, H5T_NATIVE_DOUBLE};
    int type = 0;
    while (types[type] != columns[column].type)
        type++;
    return hdf5_write_column(file, columns[column].path, native[type], rows, columns[column].rank == 2 ? (int)columns[column].size[1] : 0, data);
}

static bool write_profile(hid_t file)
{
    hid_t group = H5Gopen2(file, "/sweep", H5P_DEFAULT);
    bool good = group >= 0 && hdf5_write_text(group, "profile", profile);
    if (group >= 0)
        H5Gclose(group);
    return good;
}

static bool write_branches(hid_t file, const SweepModel *m)
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
        good = write_at(file, PARENT, m->branch_count, number) && write_at(file, KNOT_OFFSET, m->branch_count + 1, number + n) &&
               write_at(file, BREAK_OFFSET, m->branch_count + 1, number + 2 * n + 1) && write_at(file, PARENT_T, m->branch_count, length) &&
               write_at(file, RADIUS, m->branch_count, length + n) && write_at(file, OPEN_START, m->branch_count, open);
    }
    free(number);
    free(length);
    free(open);
    return good;
}

static bool write_for_branches(hid_t file, const SweepModel *m)
{
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
        good = hdf5_write_column(file, branch_blend.path, H5T_NATIVE_DOUBLE, m->branch_count, 0, blend);
    if (good && has_tag)
        good = hdf5_write_column(file, branch_tag.path, H5T_NATIVE_UINT8, m->branch_count, 2, tag);
    free(blend);
    free(tag);
    return good;
}

bool sweep_file_write(int64_t at, const SweepModel *m)
{
    hid_t file = (hid_t)at;
    const VesselTree *s = m->sac;
    bool good = hdf5_make_group(file, "/sweep") && write_profile(file) && hdf5_make_group(file, "/sweep/branch") && hdf5_make_group(file, "/sweep/curve") &&
                hdf5_make_group(file, "/sweep/section") && write_branches(file, m);
    good = good && write_at(file, KNOT, m->knot_count, m->knot) && write_at(file, KNOT_NODE, m->knot_count, m->knot_node) &&
           write_at(file, BREAK_T, m->break_count, m->break_t) && write_at(file, ROW, m->row_count, m->row) && write_at(file, BLEND, 1, &m->blend) &&
           write_for_branches(file, m) && (!m->edits || hdf5_write_long_text(file, edits_path, m->edits));
    if (!good || !s)
        return good;
    int64_t n = s->node_count, b = s->blob_count;
    return hdf5_make_group(file, "/sweep/sac") && write_at(file, SAC_CENTER, n, s->center) && write_at(file, SAC_RADIUS, n, s->radius) &&
           write_at(file, SAC_DIRECTION, n, s->direction) && write_at(file, SAC_HEIGHT, n, s->height) && write_at(file, SAC_PARENT, n, s->parent) &&
           write_at(file, SAC_KIND, n, s->kind) && write_at(file, SAC_NODE, n, m->sac_node) && write_at(file, BLOB_OFFSET, n + 1, s->blob_offset) &&
           write_at(file, BLOB_CENTER, b, s->blob_center) && write_at(file, BLOB_WIDTH, b, s->blob_width) &&
           write_at(file, BLOB_AMPLITUDE, b, s->blob_amplitude);
}
