#include "sim/recording.h"

#include "sim/ordered_file.h"
#include "sim/sha256.h"

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
    const char *name;
    int rank;                // of a row: 0 scalar, 1, 2
    hsize_t shape[2];
    size_t row_bytes;
    unsigned char *ring;     // (ring length, row_bytes)
    hid_t type, dataset;
} Column;

enum { TIME, COMMAND, PROXIMAL, HASH, INSERTED, PENETRATION, CONTACTS, ITERATIONS, RESIDUAL, LINEARISATIONS, WALL_FORCE, FLAGS, XRAY, STEP_COLUMNS };
enum { FRAME_STEP, POSITION, QUATERNION, FORCE, GAP, VESSEL_NODE, FRAME_COLUMNS };

// Rows of all columns of one kind: written by the simulation thread at `head`, drained by the writer at `tail`; both only grow.
typedef struct Ring {
    int length, column_count;
    Column *column;
    atomic_llong head, tail;
    hsize_t chunk_rows;
} Ring;

struct Recording {
    char *path, *part;
    RecordingOptions options;
    int node_count;
    NodeReport *node;        // (M) scratch of the simulation thread
    int64_t frame_every, last_frame_step;
    Column step_column[STEP_COLUMNS], frame_column[FRAME_COLUMNS];
    Ring steps, frames;
    hid_t file;
    OrderedFile *ordered;
    int half_rank;           // of the chunk indices
    bool named;              // renamed to its path
    pthread_t writer;
    bool started;
    atomic_bool finish, failed;
    char reason[200];        // set by the writer before `failed`
};

RecordingOptions recording_default_options(void) { return (RecordingOptions){.frame_ms = 10, .flush_s = 0.2}; }

void recording_prepare_process(void)
{
    H5dont_atexit();
    H5Eset_auto2(H5E_DEFAULT, NULL, NULL);
}

// --- making the file ---

static Column column_of(const char *name, hid_t type, int rank, hsize_t first, hsize_t second)
{
    Column column = {.name = name, .type = type, .rank = rank, .shape = {first, second}, .dataset = -1};
    column.row_bytes = H5Tget_size(type) * (size_t)first * (size_t)second;
    return column;
}

static void describe_columns(Recording *recording)
{
    hsize_t nodes = (hsize_t)recording->node_count;
    Column *step = recording->step_column, *frame = recording->frame_column;
    step[TIME] = column_of("/time_s", H5T_NATIVE_DOUBLE, 0, 1, 1);
    step[COMMAND] = column_of("/command", H5T_NATIVE_DOUBLE, 1, 2, 1);
    step[PROXIMAL] = column_of("/proximal", H5T_NATIVE_DOUBLE, 1, 2, 1);
    step[HASH] = column_of("/state_hash", H5T_NATIVE_UINT64, 0, 1, 1);
    step[INSERTED] = column_of("/inserted_mm", H5T_NATIVE_DOUBLE, 0, 1, 1);
    step[PENETRATION] = column_of("/report/penetration_mm", H5T_NATIVE_DOUBLE, 0, 1, 1);
    step[CONTACTS] = column_of("/report/contacts", H5T_NATIVE_INT32, 0, 1, 1);
    step[ITERATIONS] = column_of("/report/iterations", H5T_NATIVE_INT32, 0, 1, 1);
    step[RESIDUAL] = column_of("/report/residual", H5T_NATIVE_DOUBLE, 0, 1, 1);
    step[LINEARISATIONS] = column_of("/report/linearisations", H5T_NATIVE_INT32, 0, 1, 1);
    step[WALL_FORCE] = column_of("/report/wall_force_n", H5T_NATIVE_DOUBLE, 1, 2, 1);
    step[FLAGS] = column_of("/report/flags", H5T_NATIVE_UINT32, 0, 1, 1);
    step[XRAY] = column_of("/xray", H5T_NATIVE_FLOAT, 1, XRAY_VALUES, 1);
    frame[FRAME_STEP] = column_of("/wire/step", H5T_NATIVE_INT64, 0, 1, 1);
    frame[POSITION] = column_of("/wire/position", H5T_NATIVE_DOUBLE, 2, nodes, 3);
    frame[QUATERNION] = column_of("/wire/quaternion", H5T_NATIVE_DOUBLE, 2, nodes, 4);
    frame[FORCE] = column_of("/contact/force_n", H5T_NATIVE_FLOAT, 2, nodes, 3);
    frame[GAP] = column_of("/contact/gap_mm", H5T_NATIVE_FLOAT, 1, nodes, 1);
    frame[VESSEL_NODE] = column_of("/contact/vessel_node", H5T_NATIVE_INT32, 1, nodes, 1);
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

static bool write_node_figures(Recording *recording)
{
    hsize_t count = (hsize_t)recording->node_count;
    hid_t space = H5Screate_simple(1, &count, NULL);
    double *value = calloc((size_t)count, sizeof *value);
    bool good = value != NULL;
    for (int which = 0; good && which < 2; which++) {
        hid_t set = H5Dcreate2(recording->file, which ? "/wire/radius_mm" : "/wire/s_mm", H5T_NATIVE_DOUBLE, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
        for (hsize_t i = 0; i < count; i++)
            value[i] = which ? recording->node[i].radius : recording->node[i].s;
        good = set >= 0 && H5Dwrite(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, value) >= 0;
        if (set >= 0)
            H5Dclose(set);
    }
    free(value);
    H5Sclose(space);
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
           write_text(place, "files", NULL, paths) && write_text(place, "sha256", NULL, sums);
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
    recording->file = ordered_file_create(recording->part, creation, access);
    recording->ordered = recording->file >= 0 ? ordered_file_of(recording->file) : NULL;
    H5Pclose(access);
    H5Pclose(creation);
    return recording->ordered != NULL;
}

// Made without names one after the other, so that their headers lie side by side; then named.
static bool create_datasets(Recording *recording)
{
    bool good = true;
    ordered_file_start_page(recording->ordered);
    for (int i = 0; good && i < STEP_COLUMNS; i++)
        good = create_dataset(recording->file, &recording->step_column[i], recording->steps.chunk_rows);
    for (int i = 0; good && i < FRAME_COLUMNS; i++)
        good = create_dataset(recording->file, &recording->frame_column[i], recording->frames.chunk_rows);
    for (int i = 0; good && i < STEP_COLUMNS + FRAME_COLUMNS; i++) {
        const Column *column = i < STEP_COLUMNS ? &recording->step_column[i] : &recording->frame_column[i - STEP_COLUMNS];
        good = H5Olink(column->dataset, recording->file, column->name, H5P_DEFAULT, H5P_DEFAULT) >= 0;
    }
    return good;
}

static bool build_file(Recording *recording, const Scene *scene)
{
    static const char *const groups[] = {"/wire", "/contact", "/report"};
    if (!open_part(recording))
        return false;
    hid_t file = recording->file;
    bool good = write_text(file, "format", NULL, "seldinger-recording") && write_number(file, "version", 1) &&
                write_text(file, "created_by", NULL, "seldinger " SELDINGER_VERSION) && write_number(file, "step_ms", scene->dt) &&
                write_number(file, "frame_ms", recording->options.frame_ms);
    for (int i = 0; good && i < 3; i++) {
        hid_t group = H5Gcreate2(file, groups[i], H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
        good = group >= 0;
        if (good)
            H5Gclose(group);
    }
    return good && create_datasets(recording) && write_node_figures(recording) && write_scene(recording, scene);
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
    if (!ordered_file_seal(recording->ordered, 2 * recording->half_rank, ahead) || rename(recording->part, recording->path) != 0)
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

static bool push_frame(Recording *recording, Simulator *simulator)
{
    if (!wait_for_room(recording, &recording->frames))
        return false;
    const WireState *state = simulator_state(simulator);
    int nodes = recording->node_count;
    int64_t row = simulator_totals(simulator)->steps - 1;
    stepper_node_report(simulator_stepper(simulator), recording->node);
    memcpy(slot_of(&recording->frames, FRAME_STEP), &row, sizeof row);
    memcpy(slot_of(&recording->frames, POSITION), state->position, (size_t)nodes * sizeof(Vec3));
    memcpy(slot_of(&recording->frames, QUATERNION), state->orientation, (size_t)nodes * sizeof(Quat));
    float *force = slot_of(&recording->frames, FORCE), *gap = slot_of(&recording->frames, GAP);
    int32_t *vessel_node = slot_of(&recording->frames, VESSEL_NODE);
    for (int i = 0; i < nodes; i++) {
        const NodeReport *node = &recording->node[i];
        force[3 * i] = (float)node->force.x;
        force[3 * i + 1] = (float)node->force.y;
        force[3 * i + 2] = (float)node->force.z;
        gap[i] = (float)node->gap;
        vessel_node[i] = node->vessel_node;
    }
    publish(&recording->frames);
    recording->last_frame_step = row;
    return true;
}

bool recording_step(Recording *recording, Simulator *simulator, const ToolCommands *commands, const XrayControl *xray)
{
    if (!wait_for_room(recording, &recording->steps))
        return false;
    const StepReport *report = simulator_last(simulator);
    Ring *ring = &recording->steps;
    double time = simulator_time_s(simulator), inserted = simulator_state(simulator)->inserted, penetration = report->penetration;
    double commanded[2] = {commands->tool[0].push_mm_s, commands->tool[0].twist_deg_s}, proximal[2] = {report->proximal_force, report->proximal_torque};
    uint64_t hash = simulator_hash(simulator);
    double residual = report->residual, wall_force[2] = {report->wall_force_max, report->wall_force_sum};
    int32_t contacts = report->active, iterations = report->iterations, linearisations = 1 + report->newton;
    uint32_t flags = report->flags;
    memcpy(slot_of(ring, TIME), &time, sizeof time);
    memcpy(slot_of(ring, COMMAND), commanded, sizeof commanded);
    memcpy(slot_of(ring, PROXIMAL), proximal, sizeof proximal);
    memcpy(slot_of(ring, HASH), &hash, sizeof hash);
    memcpy(slot_of(ring, INSERTED), &inserted, sizeof inserted);
    memcpy(slot_of(ring, PENETRATION), &penetration, sizeof penetration);
    memcpy(slot_of(ring, CONTACTS), &contacts, sizeof contacts);
    memcpy(slot_of(ring, ITERATIONS), &iterations, sizeof iterations);
    memcpy(slot_of(ring, RESIDUAL), &residual, sizeof residual);
    memcpy(slot_of(ring, LINEARISATIONS), &linearisations, sizeof linearisations);
    memcpy(slot_of(ring, WALL_FORCE), wall_force, sizeof wall_force);
    memcpy(slot_of(ring, FLAGS), &flags, sizeof flags);
    XrayControl unseen = {0};
    memcpy(slot_of(ring, XRAY), xray ? xray : &unseen, sizeof unseen);
    publish(ring);
    int64_t step = simulator_totals(simulator)->steps;
    return step % recording->frame_every != 0 && step != 1 ? true : push_frame(recording, simulator);
}

static void recording_free(Recording *recording)
{
    for (int i = 0; i < STEP_COLUMNS; i++)
        free(recording->step_column[i].ring);
    for (int i = 0; i < FRAME_COLUMNS; i++)
        free(recording->frame_column[i].ring);
    free(recording->node);
    free(recording->path);
    free(recording->part);
    free(recording);
}

static bool close_file(Recording *recording)
{
    bool good = true;
    for (int i = 0; i < STEP_COLUMNS + FRAME_COLUMNS; i++) {
        Column *column = i < STEP_COLUMNS ? &recording->step_column[i] : &recording->frame_column[i - STEP_COLUMNS];
        good &= column->dataset < 0 || H5Dclose(column->dataset) >= 0;
    }
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
    size_t room = strlen(path) + 32;
    if (!recording || !(recording->path = strdup(path)) || !(recording->part = malloc(room))) {
        faults_add(faults, path, 0, 0, "cannot be recorded: no memory");
        if (recording)
            recording_free(recording);
        return NULL;
    }
    snprintf(recording->part, room, "%s.part-%ld", path, (long)getpid());
    H5Eset_auto2(H5E_DEFAULT, NULL, NULL);
    recording->options = *options;
    recording->file = -1;
    recording->last_frame_step = -1;
    recording->node_count = simulator_state(simulator)->node_count;
    recording->frame_every = (int64_t)fmax(1, floor(options->frame_ms / scene->dt + 0.5));
    describe_columns(recording);
    hsize_t step_rows, frame_rows;
    size_chunks(recording, options->expected_steps, &step_rows, &frame_rows);
    bool good = (recording->node = calloc((size_t)recording->node_count, sizeof *recording->node)) != NULL;
    good = good && make_ring(&recording->steps, STEP_RING, STEP_COLUMNS, recording->step_column, step_rows) &&
           make_ring(&recording->frames, FRAME_RING, FRAME_COLUMNS, recording->frame_column, frame_rows);
    if (good)
        stepper_node_report(simulator_stepper(simulator), recording->node);
    errno = 0;
    good = good && build_file(recording, scene);
    int reason = errno;
    recording->started = good && pthread_create(&recording->writer, NULL, write_rings, recording) == 0;
    if (!recording->started) {
        faults_add(faults, path, 0, 0, "cannot be recorded: %s; a folder with write permission and free space is needed",
                   reason ? strerror(reason) : "the HDF5 library could not make the file");
        close_file(recording);
        unlink(recording->part);
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
        if (!recording->named)
            unlink(recording->part);
    }
    recording_free(recording);
    return !failed;
}
