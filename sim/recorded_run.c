// Reading a recording back. Every dataset's type, rank and extent is checked before memory is taken, and that the file holds what they promise; nothing is read
// from other files. Rows that one dataset has more than another (a file still being written) are left out.
#include "sim/recording.h"

#include <ctype.h>
#include <hdf5.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

typedef struct Reader {
    hid_t file, access;      // to datasets, groups and links
    const char *path;
    Faults *faults;
} Reader;

static const hsize_t most_values = (hsize_t)1 << 29;

// A link into another file is not followed.
static herr_t refuse_link(const char *file, const char *group, const char *other, const char *object, unsigned *flags, hid_t access, void *context)
{
    (void)file, (void)group, (void)other, (void)object, (void)flags, (void)access, (void)context;
    return -1;
}

// Whether each chunk is there with all its bytes. The library takes as many as the index says, and reads as many as the shape says.
static bool has_chunks(hid_t set, hid_t creation, int rank, const hsize_t *extent, size_t value_bytes)
{
    hsize_t chunk[3] = {0}, at[3] = {0}, bytes = value_bytes;
    if (H5Pget_chunk(creation, 3, chunk) != rank)
        return false;
    for (int i = 0; i < rank; i++) {
        if (chunk[i] == 0 || bytes > UINT32_MAX / chunk[i])
            return false;
        bytes *= chunk[i];
    }
    for (;;) {
        hsize_t stored = 0;
        haddr_t address = HADDR_UNDEF;
        if (H5Dget_chunk_info_by_coord(set, at, NULL, &address, &stored) < 0 || address == HADDR_UNDEF || stored != bytes)
            return false;
        int i = rank - 1;
        while (i >= 0 && (at[i] += chunk[i]) >= extent[i])
            at[i--] = 0;
        if (i < 0)
            return true;
    }
}

// Whether a dataset's bytes lie in this file, as a recording's do: plain.
static bool is_stored(hid_t set, int rank, const hsize_t *extent, hsize_t values, size_t value_bytes)
{
    hid_t creation = H5Dget_create_plist(set);
    H5D_layout_t layout = H5Pget_layout(creation);
    bool good = H5Pget_nfilters(creation) == 0 && H5Pget_external_count(creation) == 0;
    if (layout == H5D_CHUNKED)
        good = good && (values == 0 || has_chunks(set, creation, rank, extent, value_bytes));
    else
        good = good && (layout == H5D_COMPACT || layout == H5D_CONTIGUOUS) && H5Dget_storage_size(set) == values * value_bytes;
    H5Pclose(creation);
    return good;
}

// Reads a dataset of `rank` dimensions whose trailing ones are shape[1 …] (0: any, filled in); shape[0] is filled in. NULL with a fault.
static void *read_dataset(const Reader *reader, const char *name, hid_t type, int rank, hsize_t *shape)
{
    hid_t set = H5Dopen2(reader->file, name, reader->access);
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
    size_t value_bytes = H5Tget_size(stored);
    if (!good || (class != H5T_FLOAT && class != H5T_INTEGER) || value_bytes > 8) {
        faults_add(reader->faults, reader->path, 0, 0, "dataset '%s' does not have the shape or type of a recording's", name);
    } else if (!is_stored(set, rank, extent, values, value_bytes)) {
        faults_add(reader->faults, reader->path, 0, 0, "dataset '%s' promises %llu values that the file does not hold plainly: they lack, are packed or lie elsewhere",
                   name, (unsigned long long)values);
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

static bool is_one_text(hid_t type, hid_t space, size_t most)
{
    return H5Tget_class(type) == H5T_STRING && H5Tis_variable_str(type) <= 0 && H5Tget_size(type) < most && H5Sget_simple_extent_npoints(space) == 1;
}

static char *read_scene_text(const Reader *reader)
{
    hid_t set = H5Dopen2(reader->file, "/scene", reader->access);
    if (set < 0)
        return NULL;
    hid_t type = H5Dget_type(set), space = H5Dget_space(set);
    char *text = NULL;
    size_t size = H5Tget_size(type);
    if (is_one_text(type, space, (size_t)1 << 27) && is_stored(set, 0, NULL, 1, size)) {
        text = calloc(size + 1, 1);
        if (text && H5Dread(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, text) < 0) {
            free(text);
            text = NULL;
        }
    }
    H5Sclose(space);
    H5Tclose(type);
    H5Dclose(set);
    return text;
}

// A text attribute of a dataset or group; NULL where there is none.
static char *read_attribute(const Reader *reader, const char *object, const char *name)
{
    hid_t place = H5Oopen(reader->file, object, reader->access), attribute = place >= 0 ? H5Aopen(place, name, H5P_DEFAULT) : -1;
    char *text = NULL;
    if (attribute >= 0) {
        hid_t type = H5Aget_type(attribute), space = H5Aget_space(attribute);
        size_t size = H5Tget_size(type);
        if (is_one_text(type, space, (size_t)1 << 20) && H5Aget_storage_size(attribute) == size &&
            (text = calloc(size + 1, 1)) && H5Aread(attribute, type, text) < 0) {
            free(text);
            text = NULL;
        }
        H5Sclose(space);
        H5Tclose(type);
        H5Aclose(attribute);
    }
    if (place >= 0)
        H5Oclose(place);
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

static bool has(const Reader *reader, const char *name) { return H5Lexists(reader->file, name, reader->access) > 0; }

// --- several tools ---

// As in a scene (sim/scene_tools.c): what a script's head, a CSV and a terminal can hold.
static bool is_name(const char *text)
{
    bool good = *text && strlen(text) < TOOL_NAME_SIZE;
    for (const char *c = text; good && *c; c++)
        good = *c != '.' && *c != ',' && !isspace((unsigned char)*c) && !iscntrl((unsigned char)*c);
    return good;
}

static void copy_attribute(const Reader *reader, const char *group, const char *name, char text[TOOL_NAME_SIZE])
{
    char *read = read_attribute(reader, group, name);
    if (read && is_name(read))
        strcpy(text, read);
    else
        faults_add(reader->faults, reader->path, 0, 0, "%s lacks its text attribute '%s', a word of at most %d letters", group, name, TOOL_NAME_SIZE - 1);
    free(read);
}

enum { GROUP_NAME = 24 };
static void tool_group(int tool, char group[GROUP_NAME]) { snprintf(group, GROUP_NAME, "/tools/%d", tool); }

static bool count_tools(const Reader *reader, RecordedRun *run)
{
    char group[GROUP_NAME] = "/tools/0";
    run->tool_count = 1;
    if (!has(reader, "/tools"))
        return true;
    for (run->tool_count = 0; run->tool_count <= STEP_TOOLS_MAX && has(reader, group);)
        tool_group(++run->tool_count, group);
    if (run->tool_count < 2 || run->tool_count > STEP_TOOLS_MAX) {
        faults_add(reader->faults, reader->path, 0, 0, "/tools does not hold the groups 0 to 1 and up to 3 of several tools");
        run->tool_count = 1;
        return false;
    }
    return true;
}

// What a tool has in every step; the first one's stands at the root too, where that of a single tool does.
static int64_t read_tool_series(const Reader *reader, const char *group, RecordedTool *tool)
{
    hsize_t command[2] = {0, 2}, proximal[2] = {0, 2}, inserted[1] = {0}, released[1] = {0};
    char name[4][40];
    static const char *const what[] = {"command", "proximal", "inserted_mm", "released"};
    for (int i = 0; i < 4; i++)
        snprintf(name[i], sizeof name[i], "%s/%s", group, what[i]);
    tool->command = read_dataset(reader, name[0], H5T_NATIVE_DOUBLE, 2, command);
    tool->proximal = read_dataset(reader, name[1], H5T_NATIVE_DOUBLE, 2, proximal);
    tool->inserted = read_dataset(reader, name[2], H5T_NATIVE_DOUBLE, 1, inserted);
    bool knows_release = *group || has(reader, name[3]);      // not in recordings from before hands could let go
    tool->released = knows_release ? read_dataset(reader, name[3], H5T_NATIVE_UINT8, 1, released) : NULL;
    int64_t count = least(least((int64_t)command[0], proximal[0]), inserted[0]);
    return knows_release ? least(count, released[0]) : count;
}

// Which device was asked for and which was in, in every step, where there were tools to exchange.
static int64_t read_exchanges(const Reader *reader, RecordedRun *run)
{
    hsize_t size[3] = {0, (hsize_t)run->tool_count, 2};
    run->exchange = read_dataset(reader, "/exchange", H5T_NATIVE_UINT8, 3, size);
    for (hsize_t i = 0; run->exchange && i < 2 * size[0] * size[1]; i++)
        if (run->exchange[i] > EXCHANGES_MOST) {
            faults_add(reader->faults, reader->path, 0, 0, "/exchange names device %d in step %llu; 0 to %d", run->exchange[i], (unsigned long long)(i / size[1] / 2),
                       EXCHANGES_MOST);
            break;
        }
    return (int64_t)size[0];
}

// How many nodes each device has: the profile holds no number beyond them.
static void count_device_nodes(const Reader *reader, const char *group, RecordedTool *tool)
{
    for (int i = 0; i < tool->device_count; i++) {
        const double *s = tool->s + (size_t)i * (size_t)tool->node_count;
        int *count = &tool->device_nodes[i];
        while (*count < tool->node_count && !isnan(s[*count]))
            ++*count;
        if (*count < 2)
            faults_add(reader->faults, reader->path, 0, 0, "%s/s_mm holds %d nodes of device %d; at least 2", group, *count, i);
    }
}

// What a tool has in every frame, and its devices' profiles: of one that is not to be exchanged one, as a plain list.
static int64_t read_tool_frames(const Reader *reader, const char *group, bool is_exchanged, RecordedTool *tool)
{
    int rank = is_exchanged ? 2 : 1;
    hsize_t s[2] = {0, 0}, radius[2] = {0, 0}, position[3] = {0, 0, 3}, quaternion[3] = {0, 0, 4}, carrier[2] = {0, 0};
    char name[5][40];
    static const char *const what[] = {"s_mm", "radius_mm", "position", "quaternion", "carrier"};
    for (int i = 0; i < 5; i++)
        snprintf(name[i], sizeof name[i], "%s/%s", group, what[i]);
    tool->s = read_dataset(reader, name[0], H5T_NATIVE_DOUBLE, rank, s);
    tool->radius = read_dataset(reader, name[1], H5T_NATIVE_DOUBLE, rank, radius);
    hsize_t nodes = s[rank - 1], devices = is_exchanged ? s[0] : 1;
    position[1] = quaternion[1] = carrier[1] = nodes;
    tool->position = read_dataset(reader, name[2], H5T_NATIVE_DOUBLE, 3, position);
    tool->quaternion = read_dataset(reader, name[3], H5T_NATIVE_DOUBLE, 3, quaternion);
    tool->carrier = read_dataset(reader, name[4], H5T_NATIVE_INT8, 2, carrier);
    if (nodes < 2 || nodes > 100000 || radius[rank - 1] != nodes || radius[0] != s[0]) {
        faults_add(reader->faults, reader->path, 0, 0, "%s holds %llu nodes and %llu radii; 2 to 100000 of each", group, (unsigned long long)nodes,
                   (unsigned long long)radius[rank - 1]);
    } else if (devices < 1 || devices > 1 + EXCHANGES_MOST) {
        faults_add(reader->faults, reader->path, 0, 0, "%s/s_mm has %llu devices; 1 to %d", group, (unsigned long long)devices, 1 + EXCHANGES_MOST);
    } else if (tool->s) {
        tool->node_count = (int)nodes;
        tool->device_count = (int)devices;
        count_device_nodes(reader, group, tool);
    }
    return least(least((int64_t)position[0], quaternion[0]), carrier[0]);
}

static int64_t smaller(int64_t a, int64_t b) { return a < b ? a : b; }

// What was set at each step; rows from before contrast agent had a tool are one value shorter.
static XrayControl *read_xray(const Reader *reader, hsize_t *count)
{
    hsize_t shape[2] = {0, 0};
    float *value = read_dataset(reader, "/xray", H5T_NATIVE_FLOAT, 2, shape);
    *count = shape[0];
    if (!value || shape[1] == XRAY_VALUES)
        return (XrayControl *)value;
    XrayControl *xray = shape[1] == XRAY_VALUES_BEFORE_TOOLS ? calloc((size_t)shape[0] + 1, sizeof *xray) : NULL;
    if (!xray)
        faults_add(reader->faults, reader->path, 0, 0, "/xray has rows of %llu values; %d, or %d in older recordings", (unsigned long long)shape[1], XRAY_VALUES,
                   XRAY_VALUES_BEFORE_TOOLS);
    for (hsize_t i = 0; xray && i < shape[0]; i++)
        memcpy(&xray[i], value + i * XRAY_VALUES_BEFORE_TOOLS, XRAY_VALUES_BEFORE_TOOLS * sizeof *value);
    free(value);
    return xray;
}

// What every step has.
static int64_t read_series(const Reader *reader, RecordedRun *run)
{
    hsize_t time[1] = {0}, hash[1] = {0}, flags[1] = {0}, wall[2] = {0, 2}, watched = 0;
    run->time_s = read_dataset(reader, "/time_s", H5T_NATIVE_DOUBLE, 1, time);
    int64_t count = smaller((int64_t)time[0], read_tool_series(reader, "", &run->tool[0]));
    run->command = run->tool[0].command;
    run->proximal = run->tool[0].proximal;
    run->inserted = run->tool[0].inserted;
    run->state_hash = read_dataset(reader, "/state_hash", H5T_NATIVE_UINT64, 1, hash);
    run->flags = read_dataset(reader, "/report/flags", H5T_NATIVE_UINT32, 1, flags);
    run->wall_force = read_dataset(reader, "/report/wall_force_n", H5T_NATIVE_DOUBLE, 2, wall);
    bool was_seen = has(reader, "/xray");   // not in recordings of before the trainer
    run->xray = was_seen ? read_xray(reader, &watched) : NULL;
    count = least(least(least(count, hash[0]), flags[0]), wall[0]);
    bool several = count_tools(reader, run) && run->tool_count > 1;
    for (int k = 0; several && k < run->tool_count; k++) {
        char group[GROUP_NAME];
        tool_group(k, group);
        copy_attribute(reader, group, "name", run->tool[k].name);
        copy_attribute(reader, group, "kind", run->tool[k].kind);
        if (k > 0)
            count = smaller(count, read_tool_series(reader, group, &run->tool[k]));
    }
    if (several && has(reader, "/exchange"))
        count = smaller(count, read_exchanges(reader, run));
    return run->xray ? least(count, watched) : count;
}

static int64_t read_tools_frames(const Reader *reader, hsize_t nodes, RecordedRun *run)
{
    hsize_t count[1] = {0}, s[2] = {0, nodes}, radius[2] = {0, nodes};
    run->frame_nodes = read_dataset(reader, "/wire/count", H5T_NATIVE_INT32, 1, count);
    run->s = read_dataset(reader, "/wire/s_mm", H5T_NATIVE_DOUBLE, 2, s);
    run->radius = read_dataset(reader, "/wire/radius_mm", H5T_NATIVE_DOUBLE, 2, radius);
    int64_t frames = least(least((int64_t)count[0], s[0]), radius[0]);
    for (int k = 0; k < run->tool_count; k++) {
        char group[GROUP_NAME];
        tool_group(k, group);
        frames = smaller(frames, read_tool_frames(reader, group, run->exchange != NULL, &run->tool[k]));
    }
    return frames;
}

static int64_t read_nodes(const Reader *reader, hsize_t nodes, RecordedRun *run)
{
    hsize_t s[1] = {0}, radius[1] = {0};
    run->s = read_dataset(reader, "/wire/s_mm", H5T_NATIVE_DOUBLE, 1, s);
    run->radius = read_dataset(reader, "/wire/radius_mm", H5T_NATIVE_DOUBLE, 1, radius);
    if (run->s && run->radius && (radius[0] != nodes || s[0] != nodes))
        faults_add(reader->faults, reader->path, 0, 0, "holds %llu nodes and %llu radii; as many of each", (unsigned long long)nodes, (unsigned long long)radius[0]);
    return INT64_MAX;
}

// What a reader takes for granted: steps that grow, counts and carriers that are there.
static void check_frames(const Reader *reader, const RecordedRun *run)
{
    for (int64_t i = 0; i < run->frame_count; i++) {
        if (i ? run->frame_step[i] <= run->frame_step[i - 1] : run->frame_step[i] < 0) {
            faults_add(reader->faults, reader->path, 0, 0, "frame %lld names step %lld; steps grow from 0", (long long)i, (long long)run->frame_step[i]);
            return;
        }
        if (run->frame_nodes && (run->frame_nodes[i] < 2 || run->frame_nodes[i] > run->node_count)) {
            faults_add(reader->faults, reader->path, 0, 0, "frame %lld has %d nodes; 2 to %d", (long long)i, run->frame_nodes[i], run->node_count);
            return;
        }
    }
    for (int k = 0; run->exchange && k < run->tool_count; k++)
        for (int64_t i = 0; i < run->frame_count; i++)
            if (recorded_run_fitted(run, k, run->frame_step[i]) >= run->tool[k].device_count) {
                faults_add(reader->faults, reader->path, 0, 0, "/exchange has device %d of tool %d in step %lld; the file holds %d of them",
                           recorded_run_fitted(run, k, run->frame_step[i]), k, (long long)run->frame_step[i], run->tool[k].device_count);
                return;
            }
    for (int k = 0; run->frame_nodes && k < run->tool_count; k++)
        for (int64_t i = 0; i < run->frame_count * run->tool[k].node_count; i++)
            if (run->tool[k].carrier[i] < -1 || run->tool[k].carrier[i] >= run->tool_count) {
                faults_add(reader->faults, reader->path, 0, 0, "/tools/%d/carrier names tool %d; -1 to %d", k, run->tool[k].carrier[i],
                           run->tool_count - 1);
                return;
            }
}

static void read_frames(const Reader *reader, RecordedRun *run)
{
    int before = reader->faults->count;
    hsize_t step[1] = {0}, position[3] = {0, 0, 3}, quaternion[3] = {0, 0, 4}, force[3] = {0, 0, 3}, gap[2] = {0, 0}, node[2] = {0, 0};
    run->frame_step = read_dataset(reader, "/wire/step", H5T_NATIVE_INT64, 1, step);
    run->position = read_dataset(reader, "/wire/position", H5T_NATIVE_DOUBLE, 3, position);
    quaternion[1] = force[1] = gap[1] = node[1] = position[1];
    run->quaternion = read_dataset(reader, "/wire/quaternion", H5T_NATIVE_DOUBLE, 3, quaternion);
    run->force = read_dataset(reader, "/contact/force_n", H5T_NATIVE_FLOAT, 3, force);
    run->gap = read_dataset(reader, "/contact/gap_mm", H5T_NATIVE_FLOAT, 2, gap);
    run->vessel_node = read_dataset(reader, "/contact/vessel_node", H5T_NATIVE_INT32, 2, node);
    if (reader->faults->count == before && (position[1] < 2 || position[1] > 100000))
        faults_add(reader->faults, reader->path, 0, 0, "holds %llu nodes; 2 to 100000", (unsigned long long)position[1]);
    if (reader->faults->count > before)
        return;
    int64_t others = run->tool_count > 1 ? read_tools_frames(reader, position[1], run) : read_nodes(reader, position[1], run);
    if (reader->faults->count > before)
        return;
    run->node_count = (int)position[1];
    run->frame_count = smaller(others, least(least(least(least(least((int64_t)step[0], position[0]), quaternion[0]), force[0]), gap[0]), node[0]));
    while (run->frame_count > 0 && run->frame_step[run->frame_count - 1] >= run->step_count)
        run->frame_count--;
    check_frames(reader, run);
}

static void read_run(const Reader *reader, RecordedRun *run, bool with_frames)
{
    int before = reader->faults->count;
    int64_t step_count = read_series(reader, run);
    if (reader->faults->count > before)
        return;
    run->step_count = step_count;
    if (with_frames)
        read_frames(reader, run);
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
    bool good = true;
    for (int k = 0; k < run->tool_count; k++) {
        RecordedTool *tool = &run->tool[k];
        double turned = 0;
        tool->turned = malloc(((size_t)run->step_count + 1) * sizeof *tool->turned);
        for (int64_t i = 0; tool->turned && i < run->step_count; i++)
            tool->turned[i] = turned += tool->command[2 * i + 1] * run->step_ms / 1000;
        good &= tool->turned != NULL;
    }
    return good;
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
    Reader reader = {.path = path, .faults = faults, .file = H5Fopen(path, H5F_ACC_RDONLY, access), .access = H5Pcreate(H5P_DATASET_ACCESS)};
    H5Pset_elink_cb(reader.access, refuse_link, NULL);
    H5Pclose(access);
    if (reader.file < 0) {
        H5Pclose(reader.access);
        faults_add_at_byte(faults, path, 0, "is no HDF5 file; a recording that `seldinger run --record` wrote is expected");
        return NULL;
    }
    RecordedRun *run = calloc(1, sizeof *run);
    if (run) {
        read_run(&reader, run, with_frames);
        run->scene_text = read_scene_text(&reader);
        run->scene_path = read_attribute(&reader, "/scene", "path");
        run->files = read_attribute(&reader, "/scene", "files");
        run->sha256 = read_attribute(&reader, "/scene", "sha256");
        run->contact = contact_of(read_attribute(&reader, "/scene", "contact"));
        run->step_ms = read_step_ms(reader.file);
        if (!(run->step_ms >= 0.001 && run->step_ms <= 100))
            faults_add(faults, path, 0, 0, "has steps of %g ms; 0.001 to 100", run->step_ms);
        else if (faults->count == before && !sum_turns(run))
            faults_add(faults, path, 0, 0, "no memory");
    } else {
        faults_add(faults, path, 0, 0, "no memory");
    }
    H5Pclose(reader.access);
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
    for (int k = 0; k < STEP_TOOLS_MAX; k++) {
        RecordedTool *tool = &run->tool[k];
        free(tool->command);
        free(tool->proximal);
        free(tool->inserted);
        free(tool->released);
        free(tool->turned);
        free(tool->position);
        free(tool->quaternion);
        free(tool->carrier);
        free(tool->s);
        free(tool->radius);
    }
    free(run->exchange);
    free(run->time_s);
    free(run->state_hash);
    free(run->frame_step);
    free(run->frame_nodes);
    free(run->position);
    free(run->quaternion);
    free(run->radius);
    free(run->force);
    free(run->gap);
    free(run->vessel_node);
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
    ToolCommands commands = {0};
    for (int k = 0; k < run->tool_count; k++) {
        const RecordedTool *tool = &run->tool[k];
        commands.tool[k] = (Command){tool->command[2 * step], tool->command[2 * step + 1]};
        commands.released |= tool->released && tool->released[step] ? 1u << k : 0;
        commands.fitted[k] = run->exchange ? run->exchange[2 * (step * run->tool_count + k)] : 0;
    }
    if (run->xray && run->xray[step].contrast_ml_s > 0 && run->xray[step].contrast_tool > 0) {
        commands.contrast_ml_s = (double)run->xray[step].contrast_ml_s;
        commands.contrast_tool = (int)fminf(run->xray[step].contrast_tool, TOOLS_MOST);
    }
    return commands;
}

RecordedFrame recorded_run_frame(const RecordedRun *run, int64_t frame)
{
    size_t nodes = (size_t)run->node_count, first = (size_t)frame * nodes;
    RecordedFrame at = {.node_count = run->frame_nodes ? run->frame_nodes[frame] : run->node_count, .s = run->s, .radius = run->radius,
                        .position = run->position + first, .quaternion = run->quaternion + first, .force = run->force + 3 * first, .gap = run->gap + first,
                        .vessel_node = run->vessel_node + first};
    if (run->frame_nodes) {
        at.s += first;
        at.radius += first;
    }
    return at;
}

int recorded_run_fitted(const RecordedRun *run, int tool, int64_t step)
{
    return run->exchange ? run->exchange[2 * (step * run->tool_count + tool) + 1] : 0;
}

RecordedToolFrame recorded_run_tool_frame(const RecordedRun *run, int tool, int64_t frame)
{
    const RecordedTool *t = &run->tool[tool];
    int device = recorded_run_fitted(run, tool, run->frame_step[frame]);
    size_t profile = (size_t)device * (size_t)t->node_count, first = (size_t)frame * (size_t)t->node_count;
    return (RecordedToolFrame){.node_count = t->device_nodes[device], .s = t->s + profile, .radius = t->radius + profile, .position = t->position + first,
                               .quaternion = t->quaternion + first, .carrier = t->carrier + first};
}
