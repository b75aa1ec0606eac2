#include "sim/recording.h"

#include "base/heap.h"
#include "base/part_file.h"
#include "base/sha256.h"
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

enum { STEP_RING = 4096, FRAME_RING = 128, MOST_STEP_ROWS = 32768, FRAME_CHUNK_BYTES = 8 << 20 };

// A dataset's chunk index is one node that never splits: twice as many chunks as this. Known: 256 times what is expected; unknown: hours.
enum { HALF_RANK_KNOWN = 128, HALF_RANK_UNKNOWN = 2048 };

// A dataset that grows by rows, with its ring.
typedef struct Column {
    char name[40];
    int rank;                // of a row: 0 scalar, 1, 2
    hsize_t shape[2];
    size_t row_bytes;
    unsigned char *ring;     // (ring length, row_bytes)
    hid_t type, dataset;
} Column;

// What each tool has in every step comes first: the first tool's stands at the root, that of the others behind all else.
enum { COMMAND, PROXIMAL, INSERTED, RELEASED, TOOL_STEP_COLUMNS };
enum { TIME = TOOL_STEP_COLUMNS, HASH, PENETRATION, CONTACTS, ITERATIONS, RESIDUAL, LINEARISATIONS, WALL_FORCE, FLAGS, XRAY, STEP_COLUMNS };
// Behind those of all tools where any may be exchanged: the last that fits the page beside those of four.
static const char *const tool_step_name[TOOL_STEP_COLUMNS] = {"command", "proximal", "inserted_mm", "released"};
// Of a frame; from COUNT on of several tools only, then for each of them …
enum { FRAME_STEP, POSITION, QUATERNION, FORCE, GAP, VESSEL_NODE, ONE_TOOL_COLUMNS, COUNT = ONE_TOOL_COLUMNS, ARC, RADIUS, FRAME_COLUMNS };
enum { OWN_POSITION, OWN_QUATERNION, OWN_CARRIER, TOOL_FRAME_COLUMNS };      // … these
enum { MOST_STEP_COLUMNS = STEP_COLUMNS + (STEP_TOOLS_MAX - 1) * TOOL_STEP_COLUMNS + 1, MOST_FRAME_COLUMNS = FRAME_COLUMNS + STEP_TOOLS_MAX * TOOL_FRAME_COLUMNS };

static int step_column_of(int tool, int which) { return tool == 0 ? which : STEP_COLUMNS + (tool - 1) * TOOL_STEP_COLUMNS + which; }
static int frame_column_of(int tool, int which) { return FRAME_COLUMNS + tool * TOOL_FRAME_COLUMNS + which; }

// Rows of all columns of one kind: written by the simulation thread at `head`, drained by the writer at `tail`; both only grow.
typedef struct Ring {
    int length, column_count;
    Column *column;
    atomic_llong head, tail;
    hsize_t chunk_rows;
} Ring;

struct Recording {
    char *path;
    PartFile part;           // until it is named
    RecordingOptions options;
    int tool_count, tool_nodes[STEP_TOOLS_MAX];      // at most, whichever device is in
    bool has_exchanges;
    int node_count;          // at most
    NodeReport *node;        // (M) scratch of the simulation thread
    ToolNode *own;           // of a tool's nodes, the same
    int64_t frame_every, last_frame_step;
    Column step_column[MOST_STEP_COLUMNS], frame_column[MOST_FRAME_COLUMNS];
    Ring steps, frames;
    hid_t file;
    OrderedFile *ordered;
    int half_rank;           // of the chunk indices
    bool named;              // renamed to its path
    pthread_t writer;
    bool started;
    atomic_bool finish, failed, abandoned;
    char reason[200];        // set by the writer before `failed`
};

RecordingOptions recording_default_options(void) { return (RecordingOptions){.frame_ms = 10, .flush_s = 0.2}; }

void recording_prepare_process(void)
{
    if (!heap_has_room(HEAP_ROOM_OF_HDF5))
        heap_is_empty(HEAP_ROOM_OF_HDF5, __FILE__);
    H5dont_atexit();
    H5Eset_auto2(H5E_DEFAULT, NULL, NULL);
}

// --- making the file ---

static Column column_of(const char *group, const char *name, hid_t type, int rank, hsize_t first, hsize_t second)
{
    Column column = {.type = type, .rank = rank, .shape = {first, second}, .dataset = -1};
    snprintf(column.name, sizeof column.name, "%s/%s", group, name);
    column.row_bytes = H5Tget_size(type) * (size_t)first * (size_t)second;
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

static bool make_ring(Ring *ring, int length, int column_count, Column *column, hsize_t chunk_rows)
{
    ring->length = length;
    ring->column_count = column_count;
    ring->column = column;
    ring->chunk_rows = chunk_rows;
    for (int i = 0; i < column_count; i++)
        if (!(column[i].ring = calloc((size_t)length, column[i].row_bytes)))
            return false;
    return true;
}

static bool create_dataset(hid_t file, Column *column, hsize_t chunk_rows)
{
    hsize_t none[3] = {0, column->shape[0], column->shape[1]}, most[3] = {H5S_UNLIMITED, column->shape[0], column->shape[1]};
    hsize_t chunk[3] = {chunk_rows, column->shape[0], column->shape[1]};
    hid_t space = H5Screate_simple(column->rank + 1, none, most), creation = H5Pcreate(H5P_DATASET_CREATE), access = H5Pcreate(H5P_DATASET_ACCESS);
    H5Pset_chunk(creation, column->rank + 1, chunk);
    H5Pset_fill_time(creation, H5D_FILL_TIME_NEVER);
    H5Pset_obj_track_times(creation, false);
    H5Pset_chunk_cache(access, 0, 0, 0);
    H5Pset_dset_no_attrs_hint(creation, true);   // small headers: all of them share a page
    column->dataset = H5Dcreate_anon(file, column->type, space, creation, access);
    H5Pclose(access);
    H5Pclose(creation);
    H5Sclose(space);
    return column->dataset >= 0;
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

// Arc lengths and radii of a tool's nodes, (count) or of its devices (devices, count).
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

// Of the device that is in, and of those that may be: each a row, filled up with what is no number.
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
        memcpy(s + i * count, wire.s, (size_t)wire.node_count * sizeof *s);
        memcpy(s + values + i * count, wire.radius, (size_t)wire.node_count * sizeof *s);
        wire_destroy(&wire);
    }
    good = good && write_profile(recording->file, group, devices, count, (const double *[]){s, s + values});
    free(s);
    return good;
}

// What does not change during the run.
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

// A file as it is named from anywhere: a recording is replayed in other folders than the one it was made in.
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

// /scene: the text, and path and sha256 of every file that the run was made from, one a line.
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
    H5Pset_istore_k(creation, (unsigned)recording->half_rank);
    H5Pset_libver_bounds(access, H5F_LIBVER_EARLIEST, H5F_LIBVER_V18);
    H5Pset_file_locking(access, false, true);
    recording->file = ordered_file_create(recording->part.name, creation, access);
    recording->ordered = recording->file >= 0 ? ordered_file_of(recording->file) : NULL;
    H5Pclose(access);
    H5Pclose(creation);
    return recording->ordered != NULL;
}

static bool create_ring_datasets(Recording *recording, Ring *ring)
{
    bool good = true;
    for (int i = 0; good && i < ring->column_count; i++)
        good = create_dataset(recording->file, &ring->column[i], ring->chunk_rows);
    return good;
}

static bool link_ring_datasets(Recording *recording, const Ring *ring)
{
    bool good = true;
    for (int i = 0; good && i < ring->column_count; i++)
        good = H5Olink(ring->column[i].dataset, recording->file, ring->column[i].name, H5P_DEFAULT, H5P_DEFAULT) >= 0;
    return good;
}

// Made without names one after the other, so that their headers lie side by side; then named.
static bool create_datasets(Recording *recording)
{
    ordered_file_start_page(recording->ordered);
    bool good = create_ring_datasets(recording, &recording->steps);
    if (has_several(recording))
        ordered_file_start_page(recording->ordered);     // those of both kinds do not fit one page
    good = good && create_ring_datasets(recording, &recording->frames);
    good = good && link_ring_datasets(recording, &recording->steps) && link_ring_datasets(recording, &recording->frames);
    for (int i = 0; good && has_several(recording) && i < TOOL_STEP_COLUMNS; i++) {
        char name[40];
        snprintf(name, sizeof name, "/tools/0/%s", tool_step_name[i]);
        good = H5Olink(recording->step_column[i].dataset, recording->file, name, H5P_DEFAULT, H5P_DEFAULT) >= 0;
    }
    return good;
}

static bool create_group(hid_t file, const char *name)
{
    hid_t group = H5Gcreate2(file, name, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    return group >= 0 && H5Gclose(group) >= 0;
}

static bool create_groups(const Recording *recording)
{
    bool good = create_group(recording->file, "/wire") && create_group(recording->file, "/contact") && create_group(recording->file, "/report");
    if (has_several(recording))
        good = good && create_group(recording->file, "/tools");
    for (int k = 0; good && has_several(recording) && k < recording->tool_count; k++) {
        char group[GROUP_NAME];
        tool_group(k, group);
        good = create_group(recording->file, group);
    }
    return good;
}

static bool build_file(Recording *recording, const Scene *scene)
{
    if (!open_part(recording))
        return false;
    hid_t file = recording->file;
    bool good = write_text(file, "format", NULL, "seldinger-recording") && write_number(file, "version", 1) &&
                write_text(file, "created_by", NULL, "seldinger " SELDINGER_VERSION) && write_number(file, "step_ms", scene->dt) &&
                write_number(file, "frame_ms", recording->options.frame_ms);
    return good && create_groups(recording) && create_datasets(recording) && write_tools(recording, scene) && write_scene(recording, scene);
}

// --- the writer's thread ---

static bool append_rows(Column *column, hsize_t from, hsize_t count, const void *data)
{
    hsize_t extent[3] = {from + count, column->shape[0], column->shape[1]}, start[3] = {from, 0, 0}, size[3] = {count, column->shape[0], column->shape[1]};
    if (H5Dset_extent(column->dataset, extent) < 0)
        return false;
    hid_t target = H5Dget_space(column->dataset), memory = H5Screate_simple(column->rank + 1, size, NULL);
    bool good = H5Sselect_hyperslab(target, H5S_SELECT_SET, start, NULL, size, NULL) >= 0 &&
                H5Dwrite(column->dataset, column->type, memory, target, H5P_DEFAULT, data) >= 0;
    H5Sclose(memory);
    H5Sclose(target);
    return good;
}

static bool drain(Ring *ring, long long head)
{
    long long tail = atomic_load_explicit(&ring->tail, memory_order_relaxed);
    while (tail < head) {
        // up to the end of the ring, where the rows stop being contiguous
        long long slot = tail % ring->length, part = ring->length - slot < head - tail ? ring->length - slot : head - tail;
        for (int i = 0; i < ring->column_count; i++) {
            Column *column = &ring->column[i];
            if (!append_rows(column, (hsize_t)tail, (hsize_t)part, column->ring + (size_t)slot * column->row_bytes))
                return false;
        }
        tail += part;
        atomic_store_explicit(&ring->tail, tail, memory_order_release);
    }
    return true;
}

// Of a chunk of each column.
static hsize_t chunk_bytes(const Ring *ring)
{
    hsize_t bytes = 0;
    for (int i = 0; i < ring->column_count; i++)
        bytes += ring->chunk_rows * ring->column[i].row_bytes + 8;
    return bytes;
}

static bool flush(Recording *recording)
{
    if (H5Fflush(recording->file, H5F_SCOPE_LOCAL) < 0)
        return false;
    if (recording->named)
        return ordered_file_commit(recording->ordered);
    hsize_t ahead = 2 * (chunk_bytes(&recording->steps) + chunk_bytes(&recording->frames));
    if (!ordered_file_seal(recording->ordered, 2 * recording->half_rank, ahead) || !part_file_finish(&recording->part))
        return false;
    recording->named = true;
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
    H5Eset_auto2(H5E_DEFAULT, NULL, NULL);   // each thread has its own
    for (bool last = false; !last;) {
        last = atomic_load(&recording->finish);
        if (atomic_load(&recording->abandoned))
            break;
        // frames first: the rows that they name were pushed before them
        long long frames = atomic_load_explicit(&recording->frames.head, memory_order_acquire);
        long long steps = atomic_load_explicit(&recording->steps.head, memory_order_acquire);
        errno = 0;
        bool good = drain(&recording->steps, steps) && drain(&recording->frames, frames);
        if (good && (last || (frames > 0 && (double)(now_ns() - flushed) >= recording->options.flush_s * 1e9))) {
            good = flush(recording);
            flushed = now_ns();
        }
        if (!good) {
            const char *fault = ordered_file_fault(recording->ordered);
            snprintf(recording->reason, sizeof recording->reason, "%s", fault ? fault : errno ? strerror(errno) : "the HDF5 library could not write");
            atomic_store(&recording->failed, true);
            break;
        }
        if (!last)
            nap(10);
    }
    return NULL;
}

// --- the simulation thread ---

static void *slot_of(Ring *ring, int column)
{
    long long head = atomic_load_explicit(&ring->head, memory_order_relaxed);
    return ring->column[column].ring + (size_t)(head % ring->length) * ring->column[column].row_bytes;
}

static bool wait_for_room(Recording *recording, Ring *ring)
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
    for (int j = stepper_tool_nodes(stepper, tool, recording->own); j < recording->tool_nodes[tool]; j++)
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
    if (!wait_for_room(recording, &recording->frames))
        return false;
    static const NodeReport unused = {.force = {NAN, NAN, NAN}, .gap = NAN, .vessel_node = -1};
    const WireState *state = simulator_state(simulator);
    Stepper *stepper = simulator_stepper(simulator);
    Ring *ring = &recording->frames;
    int nodes = state->node_count;
    int64_t row = simulator_totals(simulator)->steps - 1;
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
        row[2 * k] = (uint8_t)commands->fitted[k];
        row[2 * k + 1] = (uint8_t)stepper_fitted(stepper, k);
    }
}

bool recording_step(Recording *recording, Simulator *simulator, const ToolCommands *commands, const XrayControl *xray)
{
    if (!wait_for_room(recording, &recording->steps))
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
    return step % recording->frame_every != 0 && step != 1 ? true : push_frame(recording, simulator);
}

static void recording_free(Recording *recording)
{
    for (int i = 0; i < MOST_STEP_COLUMNS; i++)
        free(recording->step_column[i].ring);
    for (int i = 0; i < MOST_FRAME_COLUMNS; i++)
        free(recording->frame_column[i].ring);
    free(recording->node);
    free(recording->own);
    free(recording->path);
    part_file_drop(&recording->part);
    free(recording);
}

static bool close_datasets(const Ring *ring)
{
    bool good = true;
    for (int i = 0; i < ring->column_count; i++)
        good &= ring->column[i].dataset < 0 || H5Dclose(ring->column[i].dataset) >= 0;
    return good;
}

static bool close_file(Recording *recording)
{
    bool good = close_datasets(&recording->steps) & close_datasets(&recording->frames);
    return (recording->file < 0 || H5Fclose(recording->file) >= 0) && good;
}

// One chunk for a run of known length, so that no unused tail is left; half the index holds what is expected, however long.
static void size_chunks(Recording *recording, int64_t expected_steps, hsize_t *step_rows, hsize_t *frame_rows)
{
    *step_rows = MOST_STEP_ROWS;
    *frame_rows = (hsize_t)(FRAME_CHUNK_BYTES / recording->frame_column[POSITION].row_bytes) + 1;
    recording->half_rank = HALF_RANK_UNKNOWN;
    if (expected_steps <= 1)
        return;
    hsize_t steps = (hsize_t)expected_steps, frames = steps / (hsize_t)recording->frame_every + 2;
    if (steps <= *step_rows * HALF_RANK_KNOWN && frames <= *frame_rows * HALF_RANK_KNOWN)
        recording->half_rank = HALF_RANK_KNOWN;
    hsize_t half = (hsize_t)recording->half_rank, most_steps = *step_rows, most_frames = *frame_rows;
    *step_rows = steps < most_steps ? steps : most_steps > steps / half + 1 ? most_steps : steps / half + 1;
    *frame_rows = frames < most_frames ? frames : most_frames > frames / half + 1 ? most_frames : frames / half + 1;
}

Recording *recording_create(const char *path, Simulator *simulator, const RecordingOptions *options, Faults *faults)
{
    const Scene *scene = simulator_scene(simulator);
    Recording *recording = calloc(1, sizeof *recording);
    if (!recording || !(recording->path = strdup(path))) {
        faults_add(faults, path, 0, 0, "cannot be recorded: no memory");
        if (recording)
            recording_free(recording);
        return NULL;
    }
    H5Eset_auto2(H5E_DEFAULT, NULL, NULL);
    recording->options = *options;
    recording->file = -1;
    recording->last_frame_step = -1;
    const Stepper *stepper = simulator_stepper(simulator);
    int most_own = 0;
    recording->node_count = stepper_node_capacity(stepper);
    recording->tool_count = stepper_tool_count(stepper);
    recording->has_exchanges = scene->exchange_count > 0;
    for (int k = 0; k < recording->tool_count; k++) {
        recording->tool_nodes[k] = scene_most_nodes(scene, k);
        most_own = recording->tool_nodes[k] > most_own ? recording->tool_nodes[k] : most_own;
    }
    recording->frame_every = (int64_t)fmax(1, floor(options->frame_ms / scene->dt + 0.5));
    describe_columns(recording);
    hsize_t step_rows, frame_rows;
    size_chunks(recording, options->expected_steps, &step_rows, &frame_rows);
    recording->node = calloc((size_t)recording->node_count, sizeof *recording->node);
    recording->own = calloc((size_t)most_own, sizeof *recording->own);
    bool good = recording->node && recording->own && make_ring(&recording->steps, STEP_RING, step_columns(recording), recording->step_column, step_rows) &&
                make_ring(&recording->frames, FRAME_RING, frame_columns(recording), recording->frame_column, frame_rows);
    errno = 0;
    good = good && part_file_begin(&recording->part, path) && build_file(recording, scene);
    int reason = errno;
    recording->started = good && pthread_create(&recording->writer, NULL, write_rings, recording) == 0;
    if (!recording->started) {
        faults_add(faults, path, 0, 0, "cannot be recorded: %s; a folder with write permission and free space is needed",
                   reason ? strerror(reason) : "the HDF5 library could not make the file");
        close_file(recording);
        recording_free(recording);
        return NULL;
    }
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
    // after a failed write the library's view is ahead of the disk's: closing would publish rows that are not there
    if (!failed && !close_file(recording)) {
        failed = true;
        snprintf(recording->reason, sizeof recording->reason, "%s", strerror(errno));
    }
    if (failed) {
        faults_add(faults, recording->path, 0, 0, "recording stopped after %.3f s: %s; %s, free some space or record elsewhere",
                   (double)atomic_load(&recording->steps.tail) * simulator_scene(simulator)->dt / 1000, recording->reason,
                   recording->named ? "the file is whole up to its last flush" : "no file was made");
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
    close_file(recording);
    if (recording->named)
        unlink(recording->path);
    recording_free(recording);
}
