// Reading a recording back. Every dataset's type, rank and extent is checked before memory is taken; rows that one dataset has
// more than another (a file still being written) are left out.
#include "sim/recording.h"

#include <hdf5.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

typedef struct Reader {
    hid_t file;
    const char *path;
    Faults *faults;
} Reader;

static const hsize_t most_values = (hsize_t)1 << 29;

// Reads a dataset of `rank` dimensions whose trailing ones are shape[1 …] (0: any, filled in); shape[0] is filled in. NULL with a fault.
static void *read_dataset(const Reader *reader, const char *name, hid_t type, int rank, hsize_t *shape)
{
    hid_t set = H5Dopen2(reader->file, name, H5P_DEFAULT);
    if (set < 0) {
        faults_add(reader->faults, reader->path, 0, 0, "lacks the dataset '%s' of a recording", name);
        return NULL;
    }
    hid_t space = H5Dget_space(set), stored = H5Dget_type(set);
    hsize_t extent[3] = {0, 0, 0}, values = 1;
    bool good = H5Sget_simple_extent_ndims(space) == rank && H5Sget_simple_extent_dims(space, extent, NULL) == rank;
    for (int i = 0; good && i < rank; i++) {
        good = i == 0 || shape[i] == 0 || shape[i] == extent[i];
        good = good && (extent[i] == 0 || values <= most_values / extent[i]);
        values *= extent[i];
    }
    H5T_class_t class = H5Tget_class(stored);
    void *data = NULL;
    if (!good || (class != H5T_FLOAT && class != H5T_INTEGER)) {
        faults_add(reader->faults, reader->path, 0, 0, "dataset '%s' does not have the shape or type of a recording's", name);
    } else if (!(data = calloc((size_t)values + 1, H5Tget_size(type)))) {
        faults_add(reader->faults, reader->path, 0, 0, "no memory for dataset '%s'", name);
    } else if (values > 0 && H5Dread(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, data) < 0) {
        faults_add(reader->faults, reader->path, 0, 0, "dataset '%s' cannot be read; the file is damaged", name);
        free(data);
        data = NULL;
    }
    memcpy(shape, extent, (size_t)rank * sizeof *shape);
    H5Tclose(stored);
    H5Sclose(space);
    H5Dclose(set);
    return data;
}

static char *read_scene_text(hid_t file)
{
    hid_t set = H5Dopen2(file, "/scene", H5P_DEFAULT);
    if (set < 0)
        return NULL;
    hid_t type = H5Dget_type(set);
    char *text = NULL;
    size_t size = H5Tget_size(type);
    if (H5Tget_class(type) == H5T_STRING && H5Tis_variable_str(type) <= 0 && size < ((size_t)1 << 27) && H5Dget_storage_size(set) == size) {
        text = calloc(size + 1, 1);
        if (text && H5Dread(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, text) < 0) {
            free(text);
            text = NULL;
        }
    }
    H5Tclose(type);
    H5Dclose(set);
    return text;
}

// A text attribute of /scene; NULL where there is none.
static char *read_scene_attribute(hid_t file, const char *name)
{
    hid_t set = H5Dopen2(file, "/scene", H5P_DEFAULT), attribute = set >= 0 ? H5Aopen(set, name, H5P_DEFAULT) : -1;
    char *text = NULL;
    if (attribute >= 0) {
        hid_t type = H5Aget_type(attribute);
        size_t size = H5Tget_size(type);
        if (H5Tget_class(type) == H5T_STRING && H5Tis_variable_str(type) <= 0 && size < 1 << 20 && H5Aget_storage_size(attribute) == size &&
            (text = calloc(size + 1, 1)) && H5Aread(attribute, type, text) < 0) {
            free(text);
            text = NULL;
        }
        H5Tclose(type);
        H5Aclose(attribute);
    }
    if (set >= 0)
        H5Dclose(set);
    return text;
}

static double read_step_ms(hid_t file)
{
    double value = 1;
    hid_t attribute = H5Aexists(file, "step_ms") > 0 ? H5Aopen(file, "step_ms", H5P_DEFAULT) : -1;
    if (attribute >= 0) {
        hid_t type = H5Aget_type(attribute);
        if (H5Tget_class(type) == H5T_FLOAT && H5Aget_storage_size(attribute) == H5Tget_size(type))
            H5Aread(attribute, H5T_NATIVE_DOUBLE, &value);
        H5Tclose(type);
        H5Aclose(attribute);
    }
    return value;
}

static int64_t least(int64_t a, hsize_t b) { return (hsize_t)a < b ? a : (int64_t)b; }

// What every step has.
static int64_t read_series(const Reader *reader, RecordedRun *run)
{
    hsize_t time[1] = {0}, command[2] = {0, 2}, proximal[2] = {0, 2}, hash[1] = {0}, inserted[1] = {0}, flags[1] = {0}, wall[2] = {0, 2},
            xray[2] = {0, XRAY_VALUES};
    run->time_s = read_dataset(reader, "/time_s", H5T_NATIVE_DOUBLE, 1, time);
    run->command = read_dataset(reader, "/command", H5T_NATIVE_DOUBLE, 2, command);
    run->proximal = read_dataset(reader, "/proximal", H5T_NATIVE_DOUBLE, 2, proximal);
    run->state_hash = read_dataset(reader, "/state_hash", H5T_NATIVE_UINT64, 1, hash);
    run->inserted = read_dataset(reader, "/inserted_mm", H5T_NATIVE_DOUBLE, 1, inserted);
    run->flags = read_dataset(reader, "/report/flags", H5T_NATIVE_UINT32, 1, flags);
    run->wall_force = read_dataset(reader, "/report/wall_force_n", H5T_NATIVE_DOUBLE, 2, wall);
    bool was_seen = H5Lexists(reader->file, "/xray", H5P_DEFAULT) > 0;   // not in recordings of before the trainer
    run->xray = was_seen ? read_dataset(reader, "/xray", H5T_NATIVE_FLOAT, 2, xray) : NULL;
    int64_t count = least(least(least(least(least(least((int64_t)time[0], command[0]), proximal[0]), hash[0]), inserted[0]), flags[0]), wall[0]);
    return run->xray ? least(count, xray[0]) : count;
}

static void read_run(const Reader *reader, RecordedRun *run, bool with_frames)
{
    int before = reader->faults->count;
    hsize_t step[1] = {0}, position[3] = {0, 0, 3}, quaternion[3] = {0, 0, 4}, radius[1] = {0}, force[3] = {0, 0, 3}, gap[2] = {0, 0},
            node[2] = {0, 0}, s[1] = {0};
    int64_t step_count = read_series(reader, run);
    if (reader->faults->count == before)
        run->step_count = step_count;
    if (reader->faults->count > before || !with_frames)
        return;
    run->frame_step = read_dataset(reader, "/wire/step", H5T_NATIVE_INT64, 1, step);
    run->position = read_dataset(reader, "/wire/position", H5T_NATIVE_DOUBLE, 3, position);
    quaternion[1] = position[1];
    run->quaternion = read_dataset(reader, "/wire/quaternion", H5T_NATIVE_DOUBLE, 3, quaternion);
    run->radius = read_dataset(reader, "/wire/radius_mm", H5T_NATIVE_DOUBLE, 1, radius);
    force[1] = gap[1] = node[1] = position[1];
    run->force = read_dataset(reader, "/contact/force_n", H5T_NATIVE_FLOAT, 3, force);
    run->gap = read_dataset(reader, "/contact/gap_mm", H5T_NATIVE_FLOAT, 2, gap);
    run->vessel_node = read_dataset(reader, "/contact/vessel_node", H5T_NATIVE_INT32, 2, node);
    run->s = read_dataset(reader, "/wire/s_mm", H5T_NATIVE_DOUBLE, 1, s);
    if (reader->faults->count > before)
        return;
    if (position[1] < 2 || position[1] > 100000 || radius[0] != position[1] || s[0] != position[1]) {
        faults_add(reader->faults, reader->path, 0, 0, "holds %llu nodes and %llu radii; 2 to 100000 of each", (unsigned long long)position[1],
                   (unsigned long long)radius[0]);
        return;
    }
    run->node_count = (int)position[1];
    run->frame_count = least(least(least(least(least((int64_t)step[0], position[0]), quaternion[0]), force[0]), gap[0]), node[0]);
    while (run->frame_count > 0 && run->frame_step[run->frame_count - 1] >= run->step_count)
        run->frame_count--;
    for (int64_t i = 0; i < run->frame_count; i++)
        if (i ? run->frame_step[i] <= run->frame_step[i - 1] : run->frame_step[i] < 0) {
            faults_add(reader->faults, reader->path, 0, 0, "frame %lld names step %lld; steps grow from 0", (long long)i, (long long)run->frame_step[i]);
            return;
        }
}

// Takes `name` over. CONTACT_COUNT where it is not known: then the scene's own.
static ContactKind contact_of(char *name)
{
    int kind = 0;
    while (kind < CONTACT_COUNT && (!name || strcmp(name, contact_name[kind])))
        kind++;
    free(name);
    return (ContactKind)kind;
}

static bool sum_turns(RecordedRun *run)
{
    double turned = 0;
    run->turned = malloc(((size_t)run->step_count + 1) * sizeof *run->turned);
    for (int64_t i = 0; run->turned && i < run->step_count; i++)
        run->turned[i] = turned += run->command[2 * i + 1] * run->step_ms / 1000;
    return run->turned != NULL;
}

static RecordedRun *load(const char *path, bool with_frames, Faults *faults)
{
    int before = faults->count;
    H5Eset_auto2(H5E_DEFAULT, NULL, NULL);
    struct stat status;
    if (stat(path, &status) != 0 || !S_ISREG(status.st_mode)) {
        faults_add(faults, path, 0, 0, "cannot be opened; a recording that `seldinger run --record` wrote is expected");
        return NULL;
    }
    hid_t access = H5Pcreate(H5P_FILE_ACCESS);
    H5Pset_file_locking(access, false, true);
    Reader reader = {.path = path, .faults = faults, .file = H5Fopen(path, H5F_ACC_RDONLY, access)};
    H5Pclose(access);
    if (reader.file < 0) {
        faults_add_at_byte(faults, path, 0, "is no HDF5 file; a recording that `seldinger run --record` wrote is expected");
        return NULL;
    }
    RecordedRun *run = calloc(1, sizeof *run);
    if (run) {
        read_run(&reader, run, with_frames);
        run->scene_text = read_scene_text(reader.file);
        run->scene_path = read_scene_attribute(reader.file, "path");
        run->files = read_scene_attribute(reader.file, "files");
        run->sha256 = read_scene_attribute(reader.file, "sha256");
        run->contact = contact_of(read_scene_attribute(reader.file, "contact"));
        run->step_ms = read_step_ms(reader.file);
        if (!(run->step_ms >= 0.001 && run->step_ms <= 100))
            faults_add(faults, path, 0, 0, "has steps of %g ms; 0.001 to 100", run->step_ms);
        else if (faults->count == before && !sum_turns(run))
            faults_add(faults, path, 0, 0, "no memory");
    } else {
        faults_add(faults, path, 0, 0, "no memory");
    }
    H5Fclose(reader.file);
    if (faults->count > before) {
        recorded_run_free(run);
        return NULL;
    }
    return run;
}

RecordedRun *recorded_run_load(const char *path, Faults *faults) { return load(path, true, faults); }
RecordedRun *recorded_run_load_series(const char *path, Faults *faults) { return load(path, false, faults); }

void recorded_run_free(RecordedRun *run)
{
    if (!run)
        return;
    free(run->time_s);
    free(run->command);
    free(run->proximal);
    free(run->state_hash);
    free(run->frame_step);
    free(run->position);
    free(run->quaternion);
    free(run->radius);
    free(run->force);
    free(run->gap);
    free(run->vessel_node);
    free(run->inserted);
    free(run->turned);
    free(run->xray);
    free(run->flags);
    free(run->wall_force);
    free(run->s);
    free(run->scene_path);
    free(run->files);
    free(run->sha256);
    free(run->scene_text);
    free(run);
}

bool recorded_run_was_watched(const RecordedRun *run)
{
    for (int64_t i = 0; run->xray && i < run->step_count; i++)
        if (run->xray[i].field_mm > 0)
            return true;
    return false;
}

ToolCommands recorded_run_commands(const RecordedRun *run, int64_t step)
{
    return (ToolCommands){.tool = {{run->command[2 * step], run->command[2 * step + 1]}}};
}
