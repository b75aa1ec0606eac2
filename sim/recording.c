#include "sim/recording.h"

#include "base/base.h"

#include "recon/recon.h"
#include "sim/ordered_file.h"

#include <errno.h>
#include <hdf5.h>
#include <limits.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>
#include <zlib.h>

enum { STEP_RING = 4096, FRAME_RING = 128, LEVEL_OF_SESSIONS = 6, LEVEL_OF_RUNS = 1 /* many times faster, and exact data hardly compress better */ };

// Rounding units of the values of a session's recording: powers of two, so that rounding is exact and the remaining bits of a double are zero.
static const double length_grid_mm = 1.0 / 128, turn_grid = 1.0 / 512, node_force_grid_n = 1.0 / 2048, radius_grid_mm = 1.0 / 1024,
                    figure_grid = 1.0 / 16384 /* of step figures in mm, N and N mm */, eight_bits = -8 /* of each value */;

// A dataset that grows by rows; rows are buffered in a ring, then in a chunk.
typedef struct Column {
    char name[48];
    int rank;                // of a row: 0 scalar, 1, 2
    hsize_t shape[2];
    size_t value_bytes, row_bytes;
    double grid;             // rounding unit of the values; 0: exact; < 0: number of bits kept
    unsigned char *ring;     // (ring length, row_bytes); NULL if rows come from another column
    unsigned char *chunk;    // (chunk_rows, row_bytes)
    hsize_t chunk_rows, rows;        // rows: number taken so far
    int32_t *before;         // for motion: the previous row, in units
    hid_t type, dataset;
    haddr_t header;
    int set;                 // data set of the ordered file
} Column;

// Per-step values of each tool come first: the first tool's are at the root, the others' after all other columns.
enum { COMMAND, PROXIMAL, INSERTED, RELEASED, TOOL_STEP_COLUMNS };
enum { TIME = TOOL_STEP_COLUMNS, HASH, PENETRATION, CONTACTS, ITERATIONS, RESIDUAL, LINEARISATIONS, WALL_FORCE, FLAGS, XRAY, STEP_COLUMNS };
// Follows those of all tools if a tool may be exchanged: the last column that fits on the page with those of four tools.
static const char *const tool_step_name[TOOL_STEP_COLUMNS] = {"command", "proximal", "inserted_mm", "released"};
// Per frame; from COUNT on with several tools only, then for each tool …
enum { FRAME_STEP, POSITION, QUATERNION, FORCE, GAP, VESSEL_NODE, ONE_TOOL_COLUMNS, COUNT = ONE_TOOL_COLUMNS, ARC, RADIUS, FRAME_COLUMNS };
enum { OWN_POSITION, OWN_QUATERNION, OWN_CARRIER, TOOL_FRAME_COLUMNS };      // … these
enum {
    MOST_STEP_COLUMNS = STEP_COLUMNS + (STEP_TOOLS_MAX - 1) * TOOL_STEP_COLUMNS + 1,
    MOST_FRAME_COLUMNS = FRAME_COLUMNS + STEP_TOOLS_MAX * TOOL_FRAME_COLUMNS
};

static int step_column_of(int tool, int which)
{
    SEL_ASSERT(tool >= 0 && tool <= STEP_TOOLS_MAX && which >= 0 && which < TOOL_STEP_COLUMNS,
               "a tool has columns of its own, and what is exchanged stands behind all");
    return tool == 0 ? which : STEP_COLUMNS + (tool - 1) * TOOL_STEP_COLUMNS + which;
}

static int frame_column_of(int tool, int which)
{
    SEL_ASSERT(tool >= 0 && tool <= STEP_TOOLS_MAX && which >= 0 && which < TOOL_FRAME_COLUMNS, "a tool has columns of its own");
    return FRAME_COLUMNS + tool * TOOL_FRAME_COLUMNS + which;
}

// Rows of all columns of one kind: written by the simulation thread at `head`, drained by the writer at `tail`; both only grow.
typedef struct Ring {
    int length, column_count;
    Column *column;
    atomic_llong head, tail;
} Ring;

struct Recording {
    char *path;
    PartFile part;           // until it has its final name
    RecordingOptions options;
    int tool_count, tool_nodes[STEP_TOOLS_MAX];      // the most for any device
    bool has_exchanges;
    int node_count;          // the most
    NodeReport *node;        // (M) scratch of the simulation thread
    ToolNode *own;           // the same for a tool's nodes
    int64_t frame_every, last_frame_step;
    int64_t key_every;       // number of a session's poses per frame; 0: not a session, so each pose is a frame
    Column step_column[MOST_STEP_COLUMNS], frame_column[MOST_FRAME_COLUMNS], motion_column[MOST_FRAME_COLUMNS];
    Ring steps, frames;
    hid_t file;              // while HDF5 builds it
    OrderedFile *ordered;    // afterwards
    int half_fan;            // of the chunk indices
    unsigned char *shuffled, *packed;        // scratch of the writer, for the largest chunk
    size_t packed_bytes;
    hsize_t stated_steps;    // of the last flush
    bool named;              // renamed to its final path
    pthread_t writer;
    bool started;
    atomic_bool finish, failed, abandoned;
    char reason[200];        // set by the writer before `failed`
};

RecordingOptions recording_default_options(void) { return (RecordingOptions){.frame_ms = 10, .flush_s = 0.2}; }
RecordingOptions recording_session_options(void) { return (RecordingOptions){.frame_ms = 1000, .pose_ms = 10, .flush_s = 0.2}; }

void recording_prepare_process(void)
{
    if (!heap_can_allocate(HEAP_RESERVE_OF_HDF5))
        heap_is_empty(HEAP_RESERVE_OF_HDF5, __FILE__);
    H5dont_atexit();
    H5Eset_auto2(H5E_DEFAULT, NULL, NULL);
}

// --- making the file ---

static Column column_of(const char *group, const char *name, hid_t type, int rank, hsize_t first, hsize_t second)
{
    Column column = {.type = type, .rank = rank, .shape = {first, second}, .dataset = -1};
    int length = snprintf(column.name, sizeof column.name, "%s/%s", group, name);
    SEL_REQUIRE(length > 0 && length < (int)sizeof column.name, "a dataset's name fits");
    column.value_bytes = H5Tget_size(type);
    column.row_bytes = column.value_bytes * (size_t)first * (size_t)second;
    SEL_ASSERT(column.row_bytes > 0, "a row has values");
    return column;
}

enum { GROUP_NAME = 24 };
static void tool_group(int tool, char group[GROUP_NAME]) { snprintf(group, GROUP_NAME, "/tools/%d", tool); }

static void describe_tool_steps(Column *step, const char *group)
{
    step[COMMAND] = column_of(group, tool_step_name[COMMAND], H5T_NATIVE_DOUBLE, 1, 2, 1);
    step[PROXIMAL] = column_of(group, tool_step_name[PROXIMAL], H5T_NATIVE_DOUBLE, 1, 2, 1);
    step[INSERTED] = column_of(group, tool_step_name[INSERTED], H5T_NATIVE_DOUBLE, 0, 1, 1);
    step[RELEASED] = column_of(group, tool_step_name[RELEASED], H5T_NATIVE_UINT8, 0, 1, 1);
}

static bool has_several(const Recording *recording) { return recording->tool_count > 1; }
static int exchange_column(const Recording *recording) { return step_column_of(recording->tool_count, 0); }
static int step_columns(const Recording *recording) { return exchange_column(recording) + recording->has_exchanges; }
static int frame_columns(const Recording *recording) { return has_several(recording) ? frame_column_of(recording->tool_count, 0) : ONE_TOOL_COLUMNS; }

static void describe_columns(Recording *recording)
{
    hsize_t nodes = (hsize_t)recording->node_count;
    Column *step = recording->step_column, *frame = recording->frame_column;
    describe_tool_steps(step, "");
    step[TIME] = column_of("", "time_s", H5T_NATIVE_DOUBLE, 0, 1, 1);
    step[HASH] = column_of("", "state_hash", H5T_NATIVE_UINT64, 0, 1, 1);
    step[PENETRATION] = column_of("/report", "penetration_mm", H5T_NATIVE_DOUBLE, 0, 1, 1);
    step[CONTACTS] = column_of("/report", "contacts", H5T_NATIVE_INT32, 0, 1, 1);
    step[ITERATIONS] = column_of("/report", "iterations", H5T_NATIVE_INT32, 0, 1, 1);
    step[RESIDUAL] = column_of("/report", "residual", H5T_NATIVE_DOUBLE, 0, 1, 1);
    step[LINEARISATIONS] = column_of("/report", "linearisations", H5T_NATIVE_INT32, 0, 1, 1);
    step[WALL_FORCE] = column_of("/report", "wall_force_n", H5T_NATIVE_DOUBLE, 1, 2, 1);
    step[FLAGS] = column_of("/report", "flags", H5T_NATIVE_UINT32, 0, 1, 1);
    step[XRAY] = column_of("", "xray", H5T_NATIVE_FLOAT, 1, XRAY_VALUES, 1);
    frame[FRAME_STEP] = column_of("/wire", "step", H5T_NATIVE_INT64, 0, 1, 1);
    frame[POSITION] = column_of("/wire", "position", H5T_NATIVE_DOUBLE, 2, nodes, 3);
    frame[QUATERNION] = column_of("/wire", "quaternion", H5T_NATIVE_DOUBLE, 2, nodes, 4);
    frame[FORCE] = column_of("/contact", "force_n", H5T_NATIVE_FLOAT, 2, nodes, 3);
    frame[GAP] = column_of("/contact", "gap_mm", H5T_NATIVE_FLOAT, 1, nodes, 1);
    frame[VESSEL_NODE] = column_of("/contact", "vessel_node", H5T_NATIVE_INT32, 1, nodes, 1);
    frame[COUNT] = column_of("/wire", "count", H5T_NATIVE_INT32, 0, 1, 1);
    frame[ARC] = column_of("/wire", "s_mm", H5T_NATIVE_DOUBLE, 1, nodes, 1);
    frame[RADIUS] = column_of("/wire", "radius_mm", H5T_NATIVE_DOUBLE, 1, nodes, 1);
    for (int k = 0; k < recording->tool_count; k++) {
        char group[GROUP_NAME];
        hsize_t own = (hsize_t)recording->tool_nodes[k];
        tool_group(k, group);
        if (k > 0)
            describe_tool_steps(step + step_column_of(k, 0), group);
        frame[frame_column_of(k, OWN_POSITION)] = column_of(group, "position", H5T_NATIVE_DOUBLE, 2, own, 3);
        frame[frame_column_of(k, OWN_QUATERNION)] = column_of(group, "quaternion", H5T_NATIVE_DOUBLE, 2, own, 4);
        frame[frame_column_of(k, OWN_CARRIER)] = column_of(group, "carrier", H5T_NATIVE_INT8, 1, own, 1);
    }
    if (recording->has_exchanges)
        step[exchange_column(recording)] = column_of("", "exchange", H5T_NATIVE_UINT8, 2, (hsize_t)recording->tool_count, 2);
}

// Sets the rounding of a session's columns; for frames, also the units of motion.
static void round_columns(Recording *recording)
{
    Column *step = recording->step_column, *frame = recording->frame_column;
    step[PENETRATION].grid = step[WALL_FORCE].grid = figure_grid;
    step[RESIDUAL].grid = eight_bits;
    frame[POSITION].grid = frame[GAP].grid = frame[ARC].grid = length_grid_mm;
    frame[QUATERNION].grid = turn_grid;
    frame[FORCE].grid = node_force_grid_n;
    frame[RADIUS].grid = radius_grid_mm;
    for (int k = 0; k < recording->tool_count; k++) {
        step[step_column_of(k, PROXIMAL)].grid = step[step_column_of(k, INSERTED)].grid = figure_grid;
        frame[frame_column_of(k, OWN_POSITION)].grid = length_grid_mm;
        frame[frame_column_of(k, OWN_QUATERNION)].grid = turn_grid;
    }
}

// For each frame column, adds a column of the same name below /motion: its changes, with the values of each coordinate stored consecutively.
static void describe_motion(Recording *recording)
{
    for (int i = 0; i < frame_columns(recording); i++) {
        const Column *from = &recording->frame_column[i];
        Column *to = &recording->motion_column[i];
        const char *name = from->name;
        *to = i == FRAME_STEP ? column_of("/motion", name + 1, from->type, 0, 1, 1)
                              : column_of("/motion", name + 1, H5T_STD_U32LE, from->rank, from->shape[from->rank == 2], from->shape[from->rank != 2]);
    }
}

static bool make_ring(Ring *ring, int length, int column_count, Column *column)
{
    SEL_ASSERT(length > 0 && column_count > 0 && column_count <= MOST_FRAME_COLUMNS + MOST_STEP_COLUMNS, "a ring has rows and columns");
    ring->length = length;
    ring->column_count = column_count;
    ring->column = column;
    for (int i = 0; i < column_count; i++)
        if (!(column[i].ring = calloc((size_t)length, column[i].row_bytes)))
            return false;
    return true;
}

static bool make_chunks(Recording *recording, Column *column, int count, hsize_t chunk_rows)
{
    bool good = true;
    for (int i = 0; good && i < count; i++) {
        size_t bytes = column[i].row_bytes * chunk_rows;
        SEL_ASSERT(bytes > 0, "a chunk has rows");
        column[i].chunk_rows = chunk_rows;
        column[i].chunk = calloc(1, bytes);
        column[i].before = calloc(column[i].row_bytes / column[i].value_bytes, sizeof *column->before);
        good = column[i].chunk && column[i].before;
        recording->packed_bytes = bytes > recording->packed_bytes ? bytes : recording->packed_bytes;
    }
    return good;
}

static bool create_dataset(hid_t file, Column *column)
{
    hsize_t none[3] = {0, column->shape[0], column->shape[1]}, most[3] = {H5S_UNLIMITED, column->shape[0], column->shape[1]};
    hsize_t chunk[3] = {column->chunk_rows, column->shape[0], column->shape[1]};
    H5O_info_t info;
    hid_t space = H5Screate_simple(column->rank + 1, none, most), creation = H5Pcreate(H5P_DATASET_CREATE), access = H5Pcreate(H5P_DATASET_ACCESS);
    H5Pset_chunk(creation, column->rank + 1, chunk);
    H5Pset_shuffle(creation);
    H5Pset_deflate(creation, LEVEL_OF_SESSIONS);
    H5Pset_fill_time(creation, H5D_FILL_TIME_NEVER);
    H5Pset_obj_track_times(creation, false);
    H5Pset_dset_no_attrs_hint(creation, true);   // small headers: all of them share a page
    column->dataset = H5Dcreate_anon(file, column->type, space, creation, access);
    H5Pclose(access);
    H5Pclose(creation);
    H5Sclose(space);
    bool good = column->dataset >= 0 && H5Oget_info(column->dataset, &info) >= 0;
    column->header = good ? info.addr : HADDR_UNDEF;
    return good;
}

static bool write_text(hid_t place, const char *attribute, const char *dataset, const char *text)
{
    hid_t type = H5Tcopy(H5T_C_S1), space = H5Screate(H5S_SCALAR);
    H5Tset_size(type, strlen(text) + 1);
    H5Tset_cset(type, H5T_CSET_UTF8);
    hid_t target = attribute ? H5Acreate2(place, attribute, type, space, H5P_DEFAULT, H5P_DEFAULT)
                             : H5Dcreate2(place, dataset, type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    bool good = target >= 0 && (attribute ? H5Awrite(target, type, text) : H5Dwrite(target, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, text)) >= 0;
    if (target >= 0)
        (void)(attribute ? H5Aclose(target) : H5Dclose(target));
    H5Sclose(space);
    H5Tclose(type);
    return good;
}

static bool write_number(hid_t place, const char *attribute, double value)
{
    hid_t space = H5Screate(H5S_SCALAR), target = H5Acreate2(place, attribute, H5T_NATIVE_DOUBLE, space, H5P_DEFAULT, H5P_DEFAULT);
    bool good = target >= 0 && H5Awrite(target, H5T_NATIVE_DOUBLE, &value) >= 0;
    if (target >= 0)
        H5Aclose(target);
    H5Sclose(space);
    return good;
}

// Arc lengths and radii of a tool's nodes (count), or of its devices' nodes (devices, count).
static bool write_profile(hid_t file, const char *group, int devices, int count, const double *profile[2])
{
    const hsize_t size[2] = {(hsize_t)devices, (hsize_t)count};
    hid_t space = devices > 0 ? H5Screate_simple(2, size, NULL) : H5Screate_simple(1, size + 1, NULL);
    bool good = true;
    for (int which = 0; good && which < 2; which++) {
        char name[40];
        snprintf(name, sizeof name, "%s/%s", group, which ? "radius_mm" : "s_mm");
        hid_t set = H5Dcreate2(file, name, H5T_NATIVE_DOUBLE, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
        good = set >= 0 && H5Dwrite(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, profile[which]) >= 0;
        if (set >= 0)
            H5Dclose(set);
    }
    H5Sclose(space);
    return good;
}

// Profiles of the scene's device and of its alternatives: one row each, padded with NaN.
static bool write_profiles(const Recording *recording, const Scene *scene, int tool, const char *group)
{
    int devices = recording->has_exchanges ? scene_device_count(scene, tool) : 0, rows = devices > 0 ? devices : 1, count = recording->tool_nodes[tool];
    size_t values = (size_t)rows * (size_t)count;
    double *s = malloc(2 * values * sizeof *s);
    bool good = s != NULL;
    for (size_t i = 0; s && i < 2 * values; i++)
        s[i] = NAN;
    for (int i = 0; good && i < rows; i++) {
        char why[256];
        Wire wire;
        const WireOptions options = scene_device_wire(scene, tool, i);
        if (!(good = wire_create(&wire, &options, why, (int)sizeof why)))
            break;
        SEL_REQUIRE(wire.node_count <= count, "the profile has room for the longest device");
        memcpy(s + i * count, wire.s, (size_t)wire.node_count * sizeof *s);
        memcpy(s + values + i * count, wire.radius, (size_t)wire.node_count * sizeof *s);
        wire_destroy(&wire);
    }
    good = good && write_profile(recording->file, group, devices, count, (const double *[]){s, s + values});
    free(s);
    return good;
}

// Writes what does not change during the run.
static bool write_tools(Recording *recording, const Scene *scene)
{
    bool good = true;
    for (int k = 0; good && k < recording->tool_count; k++) {
        char group[GROUP_NAME] = "/wire";
        if (has_several(recording)) {
            tool_group(k, group);
            hid_t place = H5Gopen2(recording->file, group, H5P_DEFAULT);
            good = place >= 0 && write_text(place, "name", NULL, scene->tool[k].name) && write_text(place, "kind", NULL, tool_kind_name[scene->tool[k].kind]);
            if (place >= 0)
                H5Gclose(place);
        }
        good = good && write_profiles(recording, scene, k, group);
    }
    return good;
}

enum { MOST_FILES = 64 };

// An absolute path, because a recording may be replayed in another folder.
static void write_whole_path(FILE *stream, const char *path)
{
    char here[PATH_MAX];
    if (*path != '/' && getcwd(here, sizeof here))
        fprintf(stream, "%s/", here);
    fputs(path, stream);
}

static char *whole_path(const char *path)
{
    char *whole = NULL;
    size_t length;
    FILE *stream = open_memstream(&whole, &length);
    if (!stream)
        return NULL;
    write_whole_path(stream, path);
    if (fclose(stream) == 0)
        return whole;
    free(whole);
    return NULL;
}

static bool write_session(hid_t place, const RecordingOptions *options)
{
    return !options->trainee || (write_text(place, "trainee", NULL, options->trainee) && write_text(place, "date", NULL, options->date));
}

// The patient of the tube model: with /xray they give tube voltage, current and dose of each step (sim/xray_tube.h).
static bool write_patient(hid_t file, const XrayPatient *patient)
{
    return !patient || (write_number(file, "patient_half_side_mm", patient->half_mm[0]) && write_number(file, "patient_half_front_mm", patient->half_mm[1]) &&
                        write_number(file, "patient_half_head_mm", patient->half_mm[2]) && write_number(file, "patient_water", patient->water));
}

// /scene: the text, and path and sha256 of every input file of the run, one per line.
static bool write_scene(Recording *recording, const Scene *scene)
{
    const char *file[MOST_FILES];
    int count = 0;
    if (scene->model_path)
        file[count++] = scene->model_path;
    if (scene->mesh_path)
        file[count++] = scene->mesh_path;
    if (scene->tube_points_path)
        file[count++] = scene->tube_points_path;
    if (scene->script_path)
        file[count++] = scene->script_path;
    for (int k = 0; k < scene->tool_count; k++)
        if (scene->tool[k].device_path)
            file[count++] = scene->tool[k].device_path;
    for (int i = 0; i < scene->exchange_count; i++)
        if (scene->exchange[i].device.device_path)
            file[count++] = scene->exchange[i].device.device_path;
    SEL_REQUIRE(count <= MOST_FILES, "there is room for the files that a scene refers to");
    for (int i = 0; i < recording->options.file_count && count < MOST_FILES; i++)
        file[count++] = recording->options.file[i];
    char *paths = NULL, *sums = NULL, *path = whole_path(scene->path);
    size_t paths_length, sums_length;
    FILE *path_stream = open_memstream(&paths, &paths_length), *sum_stream = open_memstream(&sums, &sums_length);
    for (int i = 0; path_stream && sum_stream && i < count; i++) {
        char hex[65] = "unreadable";
        sha256_of_file(file[i], hex);
        fputs(i ? "\n" : "", path_stream);
        write_whole_path(path_stream, file[i]);
        fprintf(sum_stream, "%s%s", i ? "\n" : "", hex);
    }
    bool good = path_stream && sum_stream && path;
    if (path_stream)
        good &= fclose(path_stream) == 0;
    if (sum_stream)
        good &= fclose(sum_stream) == 0;
    good = good && write_text(recording->file, NULL, "/scene", scene->text);
    hid_t place = good ? H5Dopen2(recording->file, "/scene", H5P_DEFAULT) : -1;
    good = good && write_text(place, "path", NULL, path) && write_text(place, "contact", NULL, contact_name[scene->contact]) &&
           write_text(place, "files", NULL, paths) && write_text(place, "sha256", NULL, sums) && write_session(place, &recording->options);
    if (place >= 0)
        H5Dclose(place);
    free(path);
    free(paths);
    free(sums);
    return good;
}

static bool open_part(Recording *recording)
{
    hid_t creation = H5Pcreate(H5P_FILE_CREATE), access = H5Pcreate(H5P_FILE_ACCESS);
    H5Pset_istore_k(creation, (unsigned)recording->half_fan);
    H5Pset_libver_bounds(access, H5F_LIBVER_EARLIEST, H5F_LIBVER_V18);
    H5Pset_file_locking(access, false, true);
    recording->file = ordered_file_create(recording->part.name, creation, access);
    H5Pclose(access);
    H5Pclose(creation);
    return recording->file >= 0;
}

static bool create_all(hid_t file, Column *column, int count)
{
    bool good = true;
    for (int i = 0; good && i < count; i++)
        good = create_dataset(file, &column[i]);
    return good;
}

static bool link_all(hid_t file, const Column *column, int count)
{
    bool good = true;
    for (int i = 0; good && i < count; i++)
        good = H5Olink(column[i].dataset, file, column[i].name, H5P_DEFAULT, H5P_DEFAULT) >= 0;
    return good;
}

static int motion_columns(const Recording *recording) { return recording->key_every > 0 ? frame_columns(recording) : 0; }

// Creates the datasets anonymously one after the other, so that their headers are adjacent; then links them.
static bool create_datasets(Recording *recording)
{
    hid_t file = recording->file;
    int steps = step_columns(recording), frames = frame_columns(recording), motions = motion_columns(recording);
    ordered_file_start_page(file);
    bool good = create_all(file, recording->step_column, steps);
    ordered_file_start_page(file);
    good = good && create_all(file, recording->frame_column, frames) && create_all(file, recording->motion_column, motions);
    good = good && link_all(file, recording->step_column, steps) && link_all(file, recording->frame_column, frames) &&
           link_all(file, recording->motion_column, motions);
    for (int i = 0; good && has_several(recording) && i < TOOL_STEP_COLUMNS; i++) {
        char name[40];
        snprintf(name, sizeof name, "/tools/0/%s", tool_step_name[i]);
        good = H5Olink(recording->step_column[i].dataset, file, name, H5P_DEFAULT, H5P_DEFAULT) >= 0;
    }
    return good;
}

static bool create_group(hid_t file, const char *name)
{
    hid_t group = H5Gcreate2(file, name, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    return group >= 0 && H5Gclose(group) >= 0;
}

static bool create_groups(const Recording *recording, const char *above)
{
    static const char *const always[] = {"/wire", "/contact", "/report"};
    char group[48];
    bool good = true;
    for (int i = 0; good && i < 3; i++) {
        snprintf(group, sizeof group, "%s%s", above, always[i]);
        good = (*above && i == 2) || create_group(recording->file, group);
    }
    snprintf(group, sizeof group, "%s/tools", above);
    if (has_several(recording))
        good = good && create_group(recording->file, group);
    for (int k = 0; good && has_several(recording) && k < recording->tool_count; k++) {
        snprintf(group, sizeof group, "%s/tools/%d", above, k);
        good = create_group(recording->file, group);
    }
    return good;
}

static bool create_motion(const Recording *recording)
{
    hid_t file = recording->file;
    return recording->key_every == 0 ||
           (create_group(file, "/motion") && create_groups(recording, "/motion") && write_number(file, "motion_ms", recording->options.pose_ms) &&
            write_number(file, "motion_length_mm", length_grid_mm) && write_number(file, "motion_turn", turn_grid) &&
            write_number(file, "motion_force_n", node_force_grid_n) && write_number(file, "motion_radius_mm", radius_grid_mm));
}

static bool build_file(Recording *recording, const Scene *scene)
{
    if (!open_part(recording))
        return false;
    hid_t file = recording->file;
    bool good = write_text(file, "format", NULL, "seldinger-recording") && write_number(file, "version", 2) &&
                write_text(file, "created_by", NULL, "seldinger " SELDINGER_VERSION) && write_number(file, "step_ms", scene->dt) &&
                write_number(file, "frame_ms", recording->options.frame_ms) && write_patient(file, recording->options.patient);
    return good && create_groups(recording, "") && create_motion(recording) && create_datasets(recording) && write_tools(recording, scene) &&
           write_scene(recording, scene);
}

// --- the writer's thread ---

// Like the HDF5 filter `shuffle`: the first bytes of all values, then the second bytes, …
static void shuffle(const unsigned char *from, size_t count, size_t value_bytes, unsigned char *to)
{
    for (size_t byte = 0; byte < value_bytes; byte++)
        for (size_t i = 0; i < count; i++)
            *to++ = from[i * value_bytes + byte];
}

static bool pack_chunk(Recording *recording, const Column *column)
{
    size_t bytes = column->chunk_rows * column->row_bytes;
    SEL_REQUIRE(bytes <= recording->packed_bytes, "the scratch has room for the largest chunk");
    uLongf length = compressBound(recording->packed_bytes);
    shuffle(column->chunk, bytes / column->value_bytes, column->value_bytes, recording->shuffled);
    return compress2(recording->packed, &length, recording->shuffled, bytes, recording->key_every > 0 ? LEVEL_OF_SESSIONS : LEVEL_OF_RUNS) == Z_OK &&
           ordered_file_append(recording->ordered, column->set, recording->packed, length);
}

static double rounded(double value, double grid)
{
    int exponent;
    if (grid > 0 || value == 0 || !isfinite(value))
        return grid > 0 ? rint(value / grid) * grid : value;
    frexp(value, &exponent);
    double unit = ldexp(1, exponent + (int)grid);
    return rint(value / unit) * unit;
}

static void round_row(const Column *column, unsigned char *row)
{
    size_t count = column->row_bytes / column->value_bytes;
    for (size_t i = 0; i < count && column->value_bytes == sizeof(double); i++)
        ((double *)(void *)row)[i] = rounded(((double *)(void *)row)[i], column->grid);
    for (size_t i = 0; i < count && column->value_bytes == sizeof(float); i++)
        ((float *)(void *)row)[i] = (float)rounded((double)((float *)(void *)row)[i], column->grid);
}

// Position of the next row in the chunk.
static unsigned char *next_row(const Column *column) { return column->chunk + column->rows % column->chunk_rows * column->row_bytes; }

static bool end_row(Recording *recording, Column *column) { return ++column->rows % column->chunk_rows != 0 || pack_chunk(recording, column); }

static bool take_row(Recording *recording, Column *column, const unsigned char *row)
{
    SEL_ASSERT(column->chunk && column->chunk_rows > 0, "the column has a chunk");
    unsigned char *to = next_row(column);
    memcpy(to, row, column->row_bytes);
    if (column->grid != 0)
        round_row(column, to);
    return end_row(recording, column);
}

// A value in units. NaN (the node does not exist) is replaced by the previous node's value, which compresses to nothing.
static int32_t in_units(const Column *column, const unsigned char *row, size_t i, int32_t otherwise)
{
    double value = column->value_bytes == 1                ? (double)((const int8_t *)row)[i]
                   : column->grid == 0                     ? (double)((const int32_t *)(const void *)row)[i]
                   : column->value_bytes == sizeof(double) ? ((const double *)(const void *)row)[i] / column->grid
                                                           : (double)((const float *)(const void *)row)[i] / column->grid;
    return isnan(value) ? otherwise : (int32_t)fmax(-MOTION_MOST, fmin(MOTION_MOST, rint(value)));
}

// Changes since the previous row, minus the change of the previous node, because adjacent nodes move nearly alike. Encoded as unsigned integers: 0, -1, 1, -2,
// 2 … become 0, 1, 2, 3, 4 …
static bool take_motion(Recording *recording, const Column *from, Column *to, const unsigned char *row)
{
    uint32_t *change = (uint32_t *)(void *)next_row(to);
    SEL_ASSERT(to->row_bytes / to->value_bytes == from->row_bytes / from->value_bytes, "motion has one value for each value of the frame");
    size_t parts = from->rank == 2 ? from->shape[1] : 1, nodes = from->rank == 0 ? 1 : from->shape[0];
    for (size_t part = 0; part < parts; part++) {
        uint32_t neighbours = 0;
        for (size_t node = 0; node < nodes; node++) {
            size_t at = part * nodes + node;
            int32_t now = in_units(from, row, node * parts + part, node > 0 ? to->before[at - 1] : 0);
            uint32_t moved = (uint32_t)now - (uint32_t)to->before[at], relative = moved - neighbours;
            to->before[at] = now;
            neighbours = moved;
            change[at] = relative << 1 ^ (relative >> 31 ? UINT32_MAX : 0);
        }
    }
    return end_row(recording, to);
}

static const unsigned char *row_in_ring(const Ring *ring, const Column *column, long long row)
{
    SEL_ASSERT(row >= 0 && column->ring, "the row was put into the ring");
    return column->ring + (size_t)(row % ring->length) * column->row_bytes;
}

static bool take_steps(Recording *recording, long long row)
{
    const Ring *ring = &recording->steps;
    bool good = true;
    for (int i = 0; good && i < ring->column_count; i++)
        good = take_row(recording, &ring->column[i], row_in_ring(ring, &ring->column[i], row));
    return good;
}

// In a session each pose is added to /motion, and every key_every-th pose is also a frame.
static bool take_frame(Recording *recording, long long row)
{
    const Ring *ring = &recording->frames;
    bool good = true, is_key = recording->key_every == 0 || row % recording->key_every == 0;
    for (int i = 0; good && i < ring->column_count; i++) {
        Column *frame = &ring->column[i], *motion = &recording->motion_column[i];
        const unsigned char *values = row_in_ring(ring, frame, row);
        if (recording->key_every > 0)
            good = i == FRAME_STEP ? take_row(recording, motion, values) : take_motion(recording, frame, motion, values);
        good = good && (!is_key || take_row(recording, frame, values));
    }
    return good;
}

static void set_tail(Ring *ring, long long tail) { atomic_store_explicit(&ring->tail, tail, memory_order_release); }

static bool drain(Recording *recording, long long steps, long long frames)
{
    SEL_REQUIRE(steps - atomic_load(&recording->steps.tail) <= STEP_RING && frames - atomic_load(&recording->frames.tail) <= FRAME_RING,
                "no row was overwritten before it was taken");
    bool good = true;
    for (long long i = atomic_load_explicit(&recording->steps.tail, memory_order_relaxed); good && i < steps; i++) {
        good = take_steps(recording, i);
        set_tail(&recording->steps, i + 1);
    }
    for (long long i = atomic_load_explicit(&recording->frames.tail, memory_order_relaxed); good && i < frames; i++) {
        good = take_frame(recording, i);
        set_tail(&recording->frames, i + 1);
    }
    return good;
}

// The step, from 0, that a row of a column shows; `every`: steps per row.
static hsize_t step_of(hsize_t row, int64_t every) { return row == 0 ? 0 : row * (hsize_t)every - 1; }

// Number of rows in whole chunks that show steps before `steps`.
static hsize_t whole_rows(const Column *column, int64_t every, hsize_t steps)
{
    hsize_t rows = column->rows / column->chunk_rows * column->chunk_rows;
    while (rows > 0 && step_of(rows - 1, every) >= steps)
        rows -= column->chunk_rows;
    return rows;
}

static void state_rows(const Recording *recording, const Column *column, int count, hsize_t rows)
{
    SEL_ASSERT(recording->ordered && count >= 0, "the file is open");
    for (int i = 0; i < count; i++)
        ordered_file_set_rows(recording->ordered, column[i].set, rows);
}

// Writes the partial chunk.
static bool end_chunks(Recording *recording, Column *column, int count)
{
    bool good = true;
    for (int i = 0; good && i < count; i++) {
        size_t used = column[i].rows % column[i].chunk_rows * column[i].row_bytes;
        SEL_ASSERT(used < column[i].chunk_rows * column[i].row_bytes, "a chunk that has begun has room");
        memset(column[i].chunk + used, 0, column[i].chunk_rows * column[i].row_bytes - used);
        good = used == 0 || pack_chunk(recording, &column[i]);
    }
    return good;
}

static bool name_file(Recording *recording)
{
    recording->named = recording->named || part_file_finish(&recording->part);
    return recording->named;
}

// Commits the rows of all whole chunks; at the end also those of partial chunks. Does nothing if there is no new chunk.
static bool flush(Recording *recording, bool is_last)
{
    Column *step = recording->step_column, *frame = recording->frame_column, *motion = recording->motion_column;
    int steps = step_columns(recording), frames = frame_columns(recording), motions = motion_columns(recording);
    int64_t key_every = recording->key_every > 0 ? recording->key_every : 1;
    if (is_last && !(end_chunks(recording, step, steps) && end_chunks(recording, frame, frames) && end_chunks(recording, motion, motions)))
        return false;
    hsize_t step_rows = is_last ? step->rows : step->rows / step->chunk_rows * step->chunk_rows;
    hsize_t frame_rows = is_last ? frame->rows : whole_rows(frame, recording->frame_every * key_every, step_rows);
    hsize_t motion_rows = motions == 0 ? 0 : is_last ? motion->rows : whole_rows(motion, recording->frame_every, step_rows);
    if (!is_last && (step_rows == recording->stated_steps || frame_rows == 0 || (motions > 0 && motion_rows == 0)))
        return true;
    state_rows(recording, step, steps, step_rows);
    state_rows(recording, frame, frames, frame_rows);
    state_rows(recording, motion, motions, motion_rows);
    if (!ordered_file_commit(recording->ordered) || !name_file(recording))
        return false;
    recording->stated_steps = step_rows;
    return true;
}

static int64_t now_ns(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return now.tv_sec * INT64_C(1000000000) + now.tv_nsec;
}

static void nap(long milliseconds) { nanosleep(&(struct timespec){.tv_nsec = milliseconds * 1000000}, NULL); }

static void *write_rings(void *argument)
{
    Recording *recording = argument;
    int64_t flushed = 0;
    for (bool last = false; !last;) {
        last = atomic_load(&recording->finish);
        if (atomic_load(&recording->abandoned))
            break;
        // frames first: the rows they refer to were pushed before them
        long long frames = atomic_load_explicit(&recording->frames.head, memory_order_acquire);
        long long steps = atomic_load_explicit(&recording->steps.head, memory_order_acquire);
        const bool is_quiet = steps - atomic_load_explicit(&recording->steps.tail, memory_order_relaxed) < STEP_RING / 64;
        errno = 0;
        bool good = drain(recording, steps, frames);
        if (good && (last || (double)(now_ns() - flushed) >= recording->options.flush_s * 0.5e9)) {
            good = flush(recording, last);
            flushed = now_ns();
        }
        if (!good) {
            const char *fault = ordered_file_fault(recording->ordered);
            snprintf(recording->reason, sizeof recording->reason, "%s", fault ? fault : errno ? strerror(errno) : "a chunk could not be packed");
            atomic_store(&recording->failed, true);
            break;
        }
        if (!last)
            nap(is_quiet ? 30 : 10);     // in real time 30 steps come in 30 ms
    }
    return NULL;
}

// --- the simulation thread ---

static void *slot_of(Ring *ring, int column)
{
    long long head = atomic_load_explicit(&ring->head, memory_order_relaxed);
    SEL_ASSERT(column >= 0 && column < ring->column_count, "the column is one of the ring's");
    SEL_ASSERT(head - atomic_load(&ring->tail) < ring->length, "wait_for_room() was called");
    return ring->column[column].ring + (size_t)(head % ring->length) * ring->column[column].row_bytes;
}

static bool wait_for_space(Recording *recording, Ring *ring)
{
    long long head = atomic_load_explicit(&ring->head, memory_order_relaxed);
    while (head - atomic_load_explicit(&ring->tail, memory_order_acquire) >= ring->length && !atomic_load(&recording->failed))
        nap(1);
    return !atomic_load(&recording->failed);
}

static void publish(Ring *ring) { atomic_fetch_add_explicit(&ring->head, 1, memory_order_release); }

static void put(Ring *ring, int column, const void *row) { memcpy(slot_of(ring, column), row, ring->column[column].row_bytes); }

static void put_doubles(Ring *ring, int column, double first, double second) { put(ring, column, (const double[2]){first, second}); }
static void put_count(Ring *ring, int column, int32_t count) { put(ring, column, &count); }

static void put_tool_frame(Recording *recording, const Stepper *stepper, int tool)
{
    Ring *ring = &recording->frames;
    Vec3 *position = slot_of(ring, frame_column_of(tool, OWN_POSITION));
    Quat *quaternion = slot_of(ring, frame_column_of(tool, OWN_QUATERNION));
    int8_t *carrier = slot_of(ring, frame_column_of(tool, OWN_CARRIER));
    static const ToolNode unused = {.position = {NAN, NAN, NAN}, .orientation = {NAN, NAN, NAN, NAN}, .carrier = -1};
    int nodes = stepper_tool_nodes(stepper, tool, recording->own);
    SEL_REQUIRE(nodes <= recording->tool_nodes[tool], "there is room for the longest device");
    for (int j = nodes; j < recording->tool_nodes[tool]; j++)
        recording->own[j] = unused;
    for (int j = 0; j < recording->tool_nodes[tool]; j++) {
        position[j] = recording->own[j].position;
        quaternion[j] = recording->own[j].orientation;
        carrier[j] = (int8_t)recording->own[j].carrier;
    }
}

static void put_tools_frame(Recording *recording, const Stepper *stepper, int nodes)
{
    Ring *ring = &recording->frames;
    double *s = slot_of(ring, ARC), *radius = slot_of(ring, RADIUS);
    put_count(ring, COUNT, nodes);
    for (int i = 0; i < recording->node_count; i++) {
        s[i] = i < nodes ? recording->node[i].s : NAN;
        radius[i] = i < nodes ? recording->node[i].radius : NAN;
    }
    for (int k = 0; k < recording->tool_count; k++)
        put_tool_frame(recording, stepper, k);
}

static bool push_frame(Recording *recording, Simulator *simulator)
{
    if (!wait_for_space(recording, &recording->frames))
        return false;
    static const NodeReport unused = {.force = {NAN, NAN, NAN}, .gap = NAN, .vessel_node = -1};
    const WireState *state = simulator_state(simulator);
    Stepper *stepper = simulator_stepper(simulator);
    Ring *ring = &recording->frames;
    int nodes = state->node_count;
    SEL_REQUIRE(nodes <= recording->node_count, "a frame has room for all nodes");
    int64_t row = simulator_totals(simulator)->steps - 1;
    SEL_ASSERT(row >= 0 && row > recording->last_frame_step, "frames are added after steps, in the order of steps");
    stepper_node_report(stepper, recording->node);
    put(ring, FRAME_STEP, &row);
    Vec3 *position = slot_of(ring, POSITION);
    Quat *quaternion = slot_of(ring, QUATERNION);
    float *force = slot_of(ring, FORCE), *gap = slot_of(ring, GAP);
    int32_t *vessel_node = slot_of(ring, VESSEL_NODE);
    memcpy(position, state->position, (size_t)nodes * sizeof *position);
    memcpy(quaternion, state->orientation, (size_t)nodes * sizeof *quaternion);
    for (int i = 0; i < recording->node_count; i++) {
        const NodeReport *node = i < nodes ? &recording->node[i] : &unused;
        force[3 * i] = (float)node->force.x;
        force[3 * i + 1] = (float)node->force.y;
        force[3 * i + 2] = (float)node->force.z;
        gap[i] = (float)node->gap;
        vessel_node[i] = node->vessel_node;
        if (i >= nodes) {
            position[i] = vec3(NAN, NAN, NAN);
            quaternion[i] = (Quat){NAN, NAN, NAN, NAN};
        }
    }
    if (has_several(recording))
        put_tools_frame(recording, stepper, nodes);
    publish(ring);
    recording->last_frame_step = row;
    return true;
}

static void put_exchange(Recording *recording, const Stepper *stepper, const ToolCommands *commands)
{
    uint8_t *row = slot_of(&recording->steps, exchange_column(recording));
    for (int k = 0; k < recording->tool_count; k++) {
        SEL_ASSERT(commands->fitted[k] >= 0 && commands->fitted[k] <= UINT8_MAX, "the index of a device fits one byte");
        row[2 * k] = (uint8_t)commands->fitted[k];
        row[2 * k + 1] = (uint8_t)stepper_fitted(stepper, k);
    }
}

bool recording_step(Recording *recording, Simulator *simulator, const ToolCommands *commands, const XrayControl *xray)
{
    if (!wait_for_space(recording, &recording->steps))
        return false;
    const StepReport *report = simulator_last(simulator);
    Ring *ring = &recording->steps;
    double time = simulator_time_s(simulator);
    uint64_t hash = simulator_hash(simulator);
    uint32_t flags = report->flags;
    const XrayControl unseen = {.contrast_ml_s = (float)commands->contrast_ml_s, .contrast_tool = (float)commands->contrast_tool};
    for (int k = 0; k < recording->tool_count; k++) {
        double inserted = stepper_tool_inserted(simulator_stepper(simulator), k);
        uint8_t released = commands->released >> k & 1;
        put_doubles(ring, step_column_of(k, COMMAND), commands->tool[k].push_mm_s, commands->tool[k].twist_deg_s);
        put_doubles(ring, step_column_of(k, PROXIMAL), report->push[k], report->torque[k]);
        put(ring, step_column_of(k, INSERTED), &inserted);
        put(ring, step_column_of(k, RELEASED), &released);
    }
    if (recording->has_exchanges)
        put_exchange(recording, simulator_stepper(simulator), commands);
    put(ring, TIME, &time);
    put(ring, HASH, &hash);
    put(ring, PENETRATION, &report->penetration);
    put_count(ring, CONTACTS, report->active);
    put_count(ring, ITERATIONS, report->iterations);
    put(ring, RESIDUAL, &report->residual);
    put_count(ring, LINEARISATIONS, 1 + report->newton);
    put_doubles(ring, WALL_FORCE, report->wall_force_max, report->wall_force_sum);
    put(ring, FLAGS, &flags);
    put(ring, XRAY, xray ? xray : &unseen);
    publish(ring);
    int64_t step = simulator_totals(simulator)->steps;
    SEL_ASSERT(step > 0, "a step has been made");
    return step % recording->frame_every != 0 && step != 1 ? true : push_frame(recording, simulator);
}

static void free_columns(Column *column, int count)
{
    for (int i = 0; i < count; i++) {
        free(column[i].ring);
        free(column[i].chunk);
        free(column[i].before);
    }
}

static void recording_free(Recording *recording)
{
    free_columns(recording->step_column, MOST_STEP_COLUMNS);
    free_columns(recording->frame_column, MOST_FRAME_COLUMNS);
    free_columns(recording->motion_column, MOST_FRAME_COLUMNS);
    free(recording->shuffled);
    free(recording->packed);
    free(recording->node);
    free(recording->own);
    free(recording->path);
    part_file_drop(&recording->part);
    free(recording);
}

static bool close_datasets(Column *column, int count)
{
    bool good = true;
    for (int i = 0; i < count; i++) {
        good &= column[i].dataset <= 0 || H5Dclose(column[i].dataset) >= 0;
        column[i].dataset = -1;
    }
    return good;
}

// Phase 1: the library builds the file.
static bool close_built(Recording *recording)
{
    bool good = close_datasets(recording->step_column, MOST_STEP_COLUMNS);
    good &= close_datasets(recording->frame_column, MOST_FRAME_COLUMNS);
    good &= close_datasets(recording->motion_column, MOST_FRAME_COLUMNS);
    good &= recording->file < 0 || H5Fclose(recording->file) >= 0;
    recording->file = -1;
    return good;
}

static bool add_sets(Recording *recording, Column *column, int count)
{
    for (int i = 0; i < count; i++)
        if ((column[i].set = ordered_file_add(recording->ordered, column[i].header, column[i].rank + 1, column[i].chunk_rows)) < 0)
            return false;
    return true;
}

static size_t chunk_bytes(const Column *column, int count)
{
    size_t bytes = 0;
    for (int i = 0; i < count; i++)
        bytes += column[i].chunk_rows * column[i].row_bytes;
    return bytes;
}

// Phase 2: the file grows.
static bool open_built(Recording *recording)
{
    enum { INDICES_AHEAD = 1 << 17, SHORT_STEPS = 10000 };
    bool is_short = recording->options.expected_steps > 1 && recording->options.expected_steps < SHORT_STEPS;
    size_t late = is_short ? 2 : 64;     // number of chunks of each dataset by which a reader may lag
    Column *step = recording->step_column, *frame = recording->frame_column, *motion = recording->motion_column;
    int steps = step_columns(recording), frames = frame_columns(recording), motions = motion_columns(recording);
    size_t ahead = late * (chunk_bytes(step, steps) + chunk_bytes(frame, frames) + chunk_bytes(motion, motions)) + INDICES_AHEAD;
    recording->ordered = ordered_file_open(recording->part.name, recording->half_fan, ahead);
    return recording->ordered && add_sets(recording, step, steps) && add_sets(recording, frame, frames) && add_sets(recording, motion, motions);
}

// A chunk covers one flush interval, so that a flush writes whole chunks only. An index has space for four times the expected length, or for hours.
static void size_chunks(Recording *recording, int64_t expected_steps, double dt, hsize_t *step_rows, hsize_t *frame_rows)
{
    static const int half_fans[] = {8, 24, 96, 256};
    hsize_t due = (hsize_t)fmax(1, rint(recording->options.flush_s * 1000 / dt)), expected = expected_steps > 1 ? (hsize_t)expected_steps : 0;
    const hsize_t most_chunks = 4 * 256 * 256;
    *step_rows = expected > 0 && expected < due ? expected : due;
    if (expected > 0 && 2 * expected / *step_rows > most_chunks)
        *step_rows = 2 * expected / most_chunks + 1;
    *frame_rows = *step_rows / (hsize_t)recording->frame_every;
    *frame_rows = *frame_rows > 0 ? *frame_rows : 1;
    SEL_ASSERT(*step_rows > 0, "a chunk has a row");
    hsize_t chunks = expected / *step_rows + 1, frames = expected / (hsize_t)recording->frame_every / *frame_rows + 2;
    chunks = frames > chunks ? frames : chunks;
    int i = expected > 0 ? 0 : 3;
    while (i < 3 && 4 * (hsize_t)half_fans[i] * (hsize_t)half_fans[i] < 4 * chunks)
        i++;
    recording->half_fan = half_fans[i];
}

static bool make_buffers(Recording *recording, hsize_t step_rows, hsize_t frame_rows)
{
    bool good = make_ring(&recording->steps, STEP_RING, step_columns(recording), recording->step_column) &&
                make_ring(&recording->frames, FRAME_RING, frame_columns(recording), recording->frame_column) &&
                make_chunks(recording, recording->step_column, step_columns(recording), step_rows) &&
                make_chunks(recording, recording->frame_column, frame_columns(recording), recording->key_every > 0 ? 1 : frame_rows) &&
                make_chunks(recording, recording->motion_column, motion_columns(recording), frame_rows);
    recording->shuffled = malloc(recording->packed_bytes);
    recording->packed = malloc(compressBound(recording->packed_bytes));
    return good && recording->shuffled && recording->packed;
}

static Recording *create(const char *path, Simulator *simulator, const RecordingOptions *options, Faults *faults)
{
    const Scene *scene = simulator_scene(simulator);
    Recording *recording = calloc(1, sizeof *recording);
    if (!recording || !(recording->path = strdup(path))) {
        faults_add(faults, path, 0, 0, "cannot be recorded: out of memory");
        if (recording)
            recording_free(recording);
        return NULL;
    }
    recording->options = *options;
    recording->file = -1;
    recording->last_frame_step = -1;
    const Stepper *stepper = simulator_stepper(simulator);
    int most_own = 0;
    recording->node_count = stepper_node_capacity(stepper);
    recording->tool_count = stepper_tool_count(stepper);
    SEL_REQUIRE(recording->tool_count > 0 && recording->tool_count <= STEP_TOOLS_MAX && recording->node_count > 1, "the simulator has a tool of some nodes");
    recording->has_exchanges = scene->exchange_count > 0;
    for (int k = 0; k < recording->tool_count; k++) {
        recording->tool_nodes[k] = scene_most_nodes(scene, k);
        most_own = recording->tool_nodes[k] > most_own ? recording->tool_nodes[k] : most_own;
    }
    double every_ms = options->pose_ms > 0 ? options->pose_ms : options->frame_ms;
    recording->frame_every = (int64_t)fmax(1, floor(every_ms / scene->dt + 0.5));
    recording->key_every = options->pose_ms > 0 ? (int64_t)fmax(1, floor(options->frame_ms / options->pose_ms + 0.5)) : 0;
    describe_columns(recording);
    if (recording->key_every > 0) {
        round_columns(recording);
        describe_motion(recording);
    }
    hsize_t step_rows, frame_rows;
    size_chunks(recording, options->expected_steps, scene->dt, &step_rows, &frame_rows);
    recording->node = calloc((size_t)recording->node_count, sizeof *recording->node);
    recording->own = calloc((size_t)most_own, sizeof *recording->own);
    bool good = recording->node && recording->own && make_buffers(recording, step_rows, frame_rows);
    errno = 0;
    good = good && part_file_begin(&recording->part, path) && build_file(recording, scene);
    good = close_built(recording) && good && open_built(recording);
    int reason = errno;
    recording->started = good && pthread_create(&recording->writer, NULL, write_rings, recording) == 0;
    if (!recording->started) {
        faults_add(faults, path, 0, 0, "cannot be recorded: %s; expected a writable folder with free space",
                   reason ? strerror(reason) : "the HDF5 library could not make the file");
        if (recording->ordered)
            ordered_file_close(recording->ordered, false);
        recording_free(recording);
        return NULL;
    }
    return recording;
}

// HDF5 only builds the file; the writer thread does not use it.
Recording *recording_create(const char *path, Simulator *simulator, const RecordingOptions *options, Faults *faults)
{
    Hdf5Silence silence = hdf5_silence_begin();
    Recording *recording = create(path, simulator, options, faults);
    hdf5_silence_end(silence);
    return recording;
}

bool recording_close(Recording *recording, Simulator *simulator, Faults *faults)
{
    int64_t steps = simulator_totals(simulator)->steps;
    if (steps > 0 && recording->last_frame_step != steps - 1)
        push_frame(recording, simulator);
    atomic_store(&recording->finish, true);
    pthread_join(recording->writer, NULL);
    bool failed = atomic_load(&recording->failed);
    if (!ordered_file_close(recording->ordered, !failed) && !failed) {
        failed = true;
        snprintf(recording->reason, sizeof recording->reason, "%s", strerror(errno));
    }
    if (failed) {
        faults_add(faults, recording->path, 0, 0, "recording stopped after %.3f s: %s; %s, free some space or record elsewhere",
                   (double)recording->stated_steps * simulator_scene(simulator)->dt / 1000, recording->reason,
                   recording->named ? "the file is complete up to its last flush" : "no file was made");
    }
    recording_free(recording);
    return !failed;
}

void recording_abandon(Recording *recording)
{
    if (!recording)
        return;
    atomic_store(&recording->abandoned, true);
    pthread_join(recording->writer, NULL);
    ordered_file_close(recording->ordered, false);
    if (recording->named)
        unlink(recording->path);
    recording_free(recording);
}
