// Mutants of each kind of HDF5 file that the program reads: trees, models, recordings of one tool and of several, sessions (the last three are compressed).
// Each is changed in its structure (links, shapes, types, storage, attributes, values) through the HDF5 library, or in its bytes, and read in a separate
// process with little memory and time. Reading must end with faults, or with data of which each byte can be accessed; never by a signal, nor with more memory
// than the reader declares. usage: hdf5_mutants [COUNT [SEED]]; COUNT mutants of each kind, default 150.
#include "base/whole_file.h"
#include "recon/tree_file.h"
#include "sim/drive.h"
#include "sim/recording.h"

#include <hdf5.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

static char folder[] = "/tmp/seldinger-mutants-XXXXXX";
static Faults faults;

static const char *in_folder(const char *name)
{
    static char path[8][200];
    static int turn;
    turn = (turn + 1) % 8;
    snprintf(path[turn], sizeof path[turn], "%s/%s", folder, name);
    return path[turn];
}

static void need(bool is_good, const char *what)
{
    if (is_good)
        return;
    fprintf(stderr, "hdf5_mutants: cannot %s%s%s\n", what, faults.count ? ": " : "", faults.count ? faults.text[0] : "");
    exit(2);
}

// --- random numbers ---
static uint64_t state;
static uint64_t next(void)
{
    state ^= state << 13;
    state ^= state >> 7;
    state ^= state << 17;
    return state * 0x2545F4914F6CDD1DULL >> 16;
}
static int below(int count) { return (int)(next() % (uint64_t)count); }

// --- the files ---
enum { TREE, MODEL, RECORDING, TOOLS_RECORDING, SESSION, KINDS };
static const char *const kind_name[KINDS] = {"tree", "model", "recording", "recording of tools", "session"};
static const char *const file_name[KINDS] = {"tree.h5", "model.h5", "run.h5", "tools.h5", "session.h5"};

static const char one_tool[] = "seldinger: 1\n"
                               "wire: {elements: 10, sections: [{length_mm: 40, diameter_mm: 0.36, young_modulus_gpa: 80}]}\n"
                               "sheath: {entry_mm: [0, 0, 0], direction: [1, 0, 0], inserted_mm: 20}\n"
                               "script: [[0, 10, 90], [0.05, 0, 0]]\n";
static const char two_tools[] =
    "seldinger: 1\n"
    "tools:\n"
    "  - {name: catheter, kind: catheter, elements: 8, inserted_mm: 10, sections: [{length_mm: 40, diameter_mm: 1, inner_diameter_mm: 0.8, young_modulus_gpa: "
    "1}],\n"
    "     exchange: [{elements: 9, sections: [{length_mm: 40, diameter_mm: 1, inner_diameter_mm: 0.8, young_modulus_gpa: 1}]}]}\n"
    "  - {name: wire, kind: wire, elements: 10, inserted_mm: 12, sections: [{length_mm: 60, diameter_mm: 0.36, young_modulus_gpa: 20}]}\n"
    "sheath: {entry_mm: [0, 0, 0], direction: [1, 0, 0]}\n"
    "script: [[0, 10, 90], [0.05, 0, 0]]\n";

static bool record_step(void *recording, Simulator *simulator, const ToolCommands *commands) { return recording_step(recording, simulator, commands, NULL); }

static void make_recording(const char *text, RecordingOptions options, const char *path)
{
    Scene *scene = scene_parse(text, strlen(text), "r.yaml", &faults);
    Simulator *simulator = scene ? simulator_create(scene, NULL, &faults) : NULL;
    need(simulator, "make a simulator");
    options.flush_s = 0.02;          // shorter than the run: several chunks
    options.expected_steps = 60;
    Recording *recording = recording_create(path, simulator, &options, &faults);
    need(recording, "make a recording");
    DriveOptions drive = drive_default_options();
    drive.script = scene->script;
    drive.duration_s = 0.06;
    drive.after_step = record_step;
    drive.context = recording;
    need(simulator_drive(simulator, &drive).end == DRIVE_DONE && recording_close(recording, simulator, &faults), "record");
    simulator_destroy(simulator);
    scene_free(scene);
}

// A text of variable length, as other programs write it: it is stored in a heap without a checksum.
static void put_variable_text(const char *path)
{
    const char *text = "from another writer";
    hid_t file = H5Fopen(path, H5F_ACC_RDWR, H5P_DEFAULT), type = H5Tcopy(H5T_C_S1), space = H5Screate(H5S_SCALAR);
    H5Tset_size(type, H5T_VARIABLE);
    H5Adelete(file, "source");
    hid_t attribute = H5Acreate2(file, "source", type, space, H5P_DEFAULT, H5P_DEFAULT);
    need(attribute >= 0 && H5Awrite(attribute, type, &text) >= 0, "write a text");
    H5Aclose(attribute);
    H5Sclose(space);
    H5Tclose(type);
    H5Fclose(file);
}

static void make_trees(void)
{
    VesselTree *model = tree_file_load(SOURCE_DIR "/tests/fuzz/corpus/tree_file/model.h5", NULL, &faults);
    VesselTree *tree = model ? vessel_tree_create(model->node_count, model->point_count, 0) : NULL;
    need(tree, "read the corpus");
    size_t n = (size_t)model->node_count;
    memcpy(tree->center, model->center, n * sizeof *tree->center);
    memcpy(tree->radius, model->radius, n * sizeof *tree->radius);
    memcpy(tree->direction, model->direction, n * sizeof *tree->direction);
    memcpy(tree->height, model->height, n * sizeof *tree->height);
    memcpy(tree->parent, model->parent, n * sizeof *tree->parent);
    memcpy(tree->kind, model->kind, n);
    memcpy(tree->point, model->point, (size_t)model->point_count * sizeof *tree->point);
    memcpy(tree->point_offset, model->point_offset, (n + 1) * sizeof *tree->point_offset);
    need(tree_file_save(tree, NULL, in_folder(file_name[TREE]), &faults) && tree_file_save(model, NULL, in_folder(file_name[MODEL]), &faults),
         "write the trees");
    put_variable_text(in_folder(file_name[TREE]));
    vessel_tree_free(tree);
    vessel_tree_free(model);
}

// --- changes of structure ---
enum { MOST_OBJECTS = 64 };
typedef struct Objects {
    int count;
    char path[MOST_OBJECTS][80];
} Objects;

static herr_t note_dataset(hid_t file, const char *name, const H5O_info_t *info, void *context)
{
    (void)file;
    Objects *objects = context;
    if (info->type == H5O_TYPE_DATASET && objects->count < MOST_OBJECTS)
        snprintf(objects->path[objects->count++], 80, "/%s", name);
    return 0;
}

static hid_t any_type(void)
{
    switch (below(12)) {
    case 0: return H5Tcopy(H5T_STD_I8LE);
    case 1: return H5Tcopy(H5T_STD_U64BE);
    case 2: return H5Tcopy(H5T_IEEE_F32BE);
    case 3: return H5Tcopy(H5T_STD_REF_OBJ);
    case 4: return H5Tcopy(H5T_STD_B32LE);
    case 5: return H5Tvlen_create(H5T_IEEE_F64LE);
    case 6: {
        hid_t text = H5Tcopy(H5T_C_S1);
        H5Tset_size(text, below(2) ? H5T_VARIABLE : 1 + (size_t)below(1000));
        return text;
    }
    case 7: {
        hid_t pair = H5Tcreate(H5T_COMPOUND, 16);
        H5Tinsert(pair, "a", 0, H5T_IEEE_F64LE);
        return pair;
    }
    case 8: {
        hid_t odd = H5Tcopy(H5T_IEEE_F64LE);
        H5Tset_ebias(odd, (size_t)below(3000));
        return odd;
    }
    case 9: {
        hid_t odd = H5Tcopy(H5T_STD_I64LE);
        H5Tset_precision(odd, 1 + (size_t)below(64));
        return odd;
    }
    case 10: return H5Tarray_create2(H5T_IEEE_F64LE, 1, (const hsize_t[]){3});
    default: return H5Tcopy(H5T_IEEE_F64LE);
    }
}

// Replaces a dataset by one of another shape, type and storage.
static void put_other_dataset(hid_t file, const char *path)
{
    int rank = 1 + below(4), rows = 1 << below(22);
    hsize_t size[4] = {(hsize_t)below(rows) + 1, (hsize_t)below(5), (hsize_t)below(5), 1}, chunk[4];
    hid_t space = below(9) == 0 ? H5Screate(below(2) ? H5S_NULL : H5S_SCALAR) : H5Screate_simple(rank, size, NULL), creation = H5Pcreate(H5P_DATASET_CREATE);
    for (int i = 0; i < 4; i++)
        chunk[i] = 1 + (hsize_t)below((int)size[i] + 1);
    switch (below(7)) {
    case 0: H5Pset_external(creation, "/etc/passwd", 0, H5F_UNLIMITED); break;
    case 1: H5Pset_chunk(creation, rank, chunk); break;
    case 2:
        H5Pset_chunk(creation, rank, chunk);
        H5Pset_deflate(creation, 9);
        break;
    case 3:
        H5Pset_chunk(creation, rank, chunk);
        H5Pset_shuffle(creation);
        H5Pset_fletcher32(creation);
        break;
    case 4: H5Pset_virtual(creation, space, below(2) ? "." : "/tmp/other.h5", "/other", space); break;
    case 5: H5Pset_layout(creation, H5D_COMPACT); break;
    default: break;
    }
    if (below(2))
        H5Pset_alloc_time(creation, H5D_ALLOC_TIME_LATE);
    hid_t type = any_type(), set = -1;
    H5Ldelete(file, path, H5P_DEFAULT);
    set = H5Dcreate2(file, path, type, space, H5P_DEFAULT, creation, H5P_DEFAULT);
    if (set >= 0 && below(2) && size[0] < 5000) {
        double value[5000] = {0};
        hsize_t count = 5000;
        hid_t memory = H5Screate_simple(1, &count, NULL);
        if (H5Sget_simple_extent_npoints(space) == 5000)
            H5Dwrite(set, H5T_NATIVE_DOUBLE, memory, space, H5P_DEFAULT, value);
        H5Sclose(memory);
    }
    if (set >= 0)
        H5Dclose(set);
    H5Tclose(type);
    H5Pclose(creation);
    H5Sclose(space);
}

// The same data with another extent.
static void stretch(hid_t file, const char *path)
{
    hid_t set = H5Dopen2(file, path, H5P_DEFAULT), space = set >= 0 ? H5Dget_space(set) : -1;
    hsize_t size[H5S_MAX_RANK] = {0};
    if (space >= 0 && H5Sget_simple_extent_dims(space, size, NULL) > 0) {
        size[0] = below(3) ? (hsize_t)below(200) : (hsize_t)1 << below(50);
        H5Dset_extent(set, size);
    }
    if (space >= 0)
        H5Sclose(space);
    if (set >= 0)
        H5Dclose(set);
}

static void change_value(hid_t file, const char *path)
{
    static const double odd[] = {0, -1, 1e300, -1e300, 5e50, 4e9, 1e-300, 0.5};
    hid_t set = H5Dopen2(file, path, H5P_DEFAULT), space = set >= 0 ? H5Dget_space(set) : -1;
    hssize_t values = space >= 0 ? H5Sget_simple_extent_npoints(space) : 0;
    if (values > 0 && values < 100000 && H5Tget_class(H5Dget_type(set)) != H5T_STRING) {
        double *data = calloc((size_t)values, sizeof *data);
        int pick = below(10);
        if (data && H5Dread(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, data) >= 0) {
            data[below((int)values)] = pick == 8 ? (double)NAN : pick == 9 ? (double)INFINITY : odd[pick];
            H5Dwrite(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, data);
        }
        free(data);
    }
    if (space >= 0)
        H5Sclose(space);
    if (set >= 0)
        H5Dclose(set);
}

static void change_attribute(hid_t file, const Objects *objects)
{
    static const char *const name[] = {"version", "iso_level", "kernel", "source", "parameters", "created_by", "step_ms",
                                       "path",    "contact",   "files",  "sha256", "name",       "kind"};
    const char *which = name[below(13)], *place = below(3)                                                 ? "/"
                                                  : below(2) && H5Lexists(file, "/tools", H5P_DEFAULT) > 0 ? "/tools/1"
                                                                                                           : objects->path[below(objects->count)];
    static const char bytes[1 << 16];
    H5Adelete_by_name(file, place, which, H5P_DEFAULT);
    if (below(4) == 0)
        return;
    hsize_t count = below(3) ? 1 : (hsize_t)below(100);
    hid_t space = H5Screate_simple(1, &count, NULL), type = any_type();
    hid_t attribute = H5Acreate_by_name(file, place, which, type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    if (attribute >= 0 && below(2) && H5Tis_variable_str(type) <= 0 && H5Tget_class(type) != H5T_VLEN && H5Tget_size(type) * count < sizeof bytes)
        H5Awrite(attribute, type, bytes);
    if (attribute >= 0)
        H5Aclose(attribute);
    H5Tclose(type);
    H5Sclose(space);
}

static void change_link(hid_t file, const char *path, const char *other)
{
    int how = below(6);
    H5Ldelete(file, path, H5P_DEFAULT);
    if (how == 0)
        H5Lcreate_soft(other, file, path, H5P_DEFAULT, H5P_DEFAULT);
    else if (how == 1)
        H5Lcreate_soft(path, file, path, H5P_DEFAULT, H5P_DEFAULT);
    else if (how == 2)
        H5Lcreate_external("run.h5", other, file, path, H5P_DEFAULT, H5P_DEFAULT);
    else if (how == 3)
        H5Lcreate_hard(file, other, file, path, H5P_DEFAULT, H5P_DEFAULT);
    else if (how == 4)
        H5Gclose(H5Gcreate2(file, path, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT));
    if (below(8) == 0) {     // a whole group
        char group[80];
        snprintf(group, sizeof group, "%s", path);
        char *slash = strrchr(group, '/');
        if (slash > group) {
            *slash = '\0';
            H5Ldelete(file, group, H5P_DEFAULT);
            if (below(2))
                H5Lcreate_hard(file, "/", file, group, H5P_DEFAULT, H5P_DEFAULT);
        }
    }
}

static void change_structure(const char *path)
{
    hid_t access = H5Pcreate(H5P_FILE_ACCESS);
    H5Pset_libver_bounds(access, below(2) ? H5F_LIBVER_EARLIEST : H5F_LIBVER_LATEST, H5F_LIBVER_LATEST);
    hid_t file = H5Fopen(path, H5F_ACC_RDWR, access);
    H5Pclose(access);
    need(file >= 0, "open a file to be changed");
    static Objects objects;
    objects.count = 0;
    H5Ovisit(file, H5_INDEX_NAME, H5_ITER_INC, note_dataset, &objects);
    for (int changes = 1 + below(3); changes > 0; changes--) {
        const char *one = objects.path[below(objects.count)], *other = objects.path[below(objects.count)];
        switch (below(5)) {
        case 0: put_other_dataset(file, one); break;
        case 1: stretch(file, one); break;
        case 2: change_value(file, one); break;
        case 3: change_attribute(file, &objects); break;
        default: change_link(file, one, other); break;
        }
    }
    H5Fclose(file);
}

// --- changes of bytes ---

// At the start of the library's structures, or anywhere: data is most of a file, and rarely causes errors.
static size_t any_place(const unsigned char *bytes, size_t length)
{
    static const char *const sign[] = {"TREE", "SNOD", "HEAP", "OHDR", "OCHK", "FRHP", "GCOL"};
    if (below(4) == 0)
        return next() % length;
    if (below(4) == 0)
        return next() % (length < 2048 ? length : 2048);
    for (int tries = 0; tries < 50; tries++) {
        const char *wanted = sign[below(7)];
        size_t from = next() % length, end = from + 20000 < length ? from + 20000 : length;
        for (size_t i = from; i + 4 < end; i++)
            if (!memcmp(bytes + i, wanted, 4))
                return i + (size_t)below(200) < length ? i + (size_t)below(200) : i;
    }
    return next() % (length < 4096 ? length : 4096);
}

static size_t change_bytes(unsigned char *bytes, size_t length)
{
    for (int changes = 1 + below(6); changes > 0; changes--) {
        size_t at = any_place(bytes, length) % length, rest = length - at, run = 1 + (size_t)below(16);
        run = run < rest ? run : rest;
        switch (below(6)) {
        case 0: bytes[at] ^= (unsigned char)(1 << below(8)); break;
        case 1: bytes[at] = (unsigned char)below(256); break;
        case 2: memset(bytes + at, 0xff, run); break;
        case 3: memset(bytes + at, 0, run); break;
        case 4: memmove(bytes + at, bytes + next() % (length - run + 1), run); break;
        default: bytes[at] = (unsigned char)(bytes[at] + (below(2) ? 1 : 255)); break;
        }
    }
    return below(20) == 0 ? next() % length : length;
}

// --- reading in a separate process ---
enum { REFUSED = 0, READ = 1, WITHOUT_REASON = 2 };
enum { SECONDS = 20 };
#define ADDRESS_SPACE ((rlim_t)1 << 30)

static volatile double sink;
static void look_at(const void *values, size_t bytes)
{
    const unsigned char *at = values;
    for (size_t i = 0; at && i < bytes; i++)
        sink += at[i];
}

static bool read_tree(const char *path)
{
    TreeFileInfo info = {0};
    VesselTree *tree = tree_file_load(path, &info, &faults);
    if (tree && !vessel_tree_validate(tree, path, &faults))
        _exit(WITHOUT_REASON);
    tree_file_info_free(&info);
    bool is_read = tree != NULL;
    vessel_tree_free(tree);
    return is_read;
}

static bool read_recording(const char *path)
{
    RecordedRun *run = recorded_run_load(path, &faults);
    if (!run)
        return false;
    size_t steps = (size_t)run->step_count, frames = (size_t)run->frame_count, nodes = (size_t)run->node_count;
    look_at(run->time_s, steps * sizeof *run->time_s);
    look_at(run->wall_force, steps * 2 * sizeof *run->wall_force);
    look_at(run->xray, run->xray ? steps * sizeof *run->xray : 0);
    look_at(run->position, frames * nodes * sizeof *run->position);
    look_at(run->vessel_node, frames * nodes * sizeof *run->vessel_node);
    for (int k = 0; k < run->tool_count; k++) {
        look_at(run->tool[k].command, steps * 2 * sizeof(double));
        look_at(run->tool[k].released, run->tool[k].released ? steps : 0);
    }
    for (int64_t i = 0; i < run->frame_count; i++) {
        RecordedFrame at = recorded_run_frame(run, i);
        look_at(at.s, (size_t)at.node_count * sizeof *at.s);
        for (int k = 0; run->tool_count > 1 && k < run->tool_count; k++) {
            RecordedToolFrame own = recorded_run_tool_frame(run, k, i);
            look_at(own.position, (size_t)own.node_count * sizeof *own.position);
        }
    }
    recorded_run_free(run);
    return true;
}

static void read_and_exit(int kind, const char *path)
{
#if !defined(__SANITIZE_ADDRESS__)
    setrlimit(RLIMIT_AS, &(struct rlimit){ADDRESS_SPACE, ADDRESS_SPACE});
#endif
    setrlimit(RLIMIT_CORE, &(struct rlimit){0, 0});
    alarm(SECONDS);
    faults_clear(&faults);
    bool is_read = kind <= MODEL ? read_tree(path) : read_recording(path);
    _exit(is_read ? READ : faults.count > 0 ? REFUSED : WITHOUT_REASON);
}

typedef struct Tally {
    int made, refused, read, signals, late, silent;
    long most_kb;
} Tally;

static bool try_mutant(int kind, const char *path, Tally *tally)
{
    int status;
    struct rusage used;
    fflush(NULL);
    pid_t child = fork();
    need(child >= 0, "start a process");
    if (child == 0)
        read_and_exit(kind, path);
    need(wait4(child, &status, 0, &used) == child, "wait for a process");
    int code = WIFEXITED(status) ? WEXITSTATUS(status) : -1, by = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
    tally->made++;
    tally->refused += code == REFUSED;
    tally->read += code == READ;
    tally->late += by == SIGALRM;
    tally->signals += by > 0 && by != SIGALRM;
    tally->silent += code > READ;
    tally->most_kb = used.ru_maxrss > tally->most_kb ? used.ru_maxrss : tally->most_kb;
    return code == REFUSED || code == READ;
}

static Tally torture(int kind, bool is_structure, int count, uint64_t seed)
{
    Tally tally = {0};
    size_t length;
    char *whole = whole_file_read(in_folder(file_name[kind]), &length, &faults);
    unsigned char *bytes = malloc(length);
    need(whole && bytes, "read a file");
    for (int i = 0; i < count; i++) {
        state = (seed + (uint64_t)i + 1) * 0x9E3779B97F4A7C15ULL + (uint64_t)kind * 77 + is_structure;
        for (int warm = 0; warm < 4; warm++)
            next();
        memcpy(bytes, whole, length);
        size_t left = is_structure ? length : change_bytes(bytes, length);
        const char *path = in_folder("mutant.h5");
        FILE *file = fopen(path, "wb");
        need(file && fwrite(bytes, 1, left, file) == left && fclose(file) == 0, "write a mutant");
        if (is_structure)
            change_structure(path);
        if (!try_mutant(kind, path, &tally)) {
            printf("FAULT: %s, %s, seed %llu\n", kind_name[kind], is_structure ? "structure" : "bytes", (unsigned long long)(seed + (uint64_t)i));
            char kept[300];
            snprintf(kept, sizeof kept, "/tmp/mutant-%d-%d-%llu.h5", kind, is_structure, (unsigned long long)(seed + (uint64_t)i));
            if (getenv("KEEP_MUTANTS"))
                rename(path, kept);
        }
    }
    free(bytes);
    free(whole);
    return tally;
}

int main(int argument_count, char **argument)
{
    int count = argument_count > 1 ? atoi(argument[1]) : 150, wrong = 0, made = 0;
    uint64_t seed = argument_count > 2 ? strtoull(argument[2], NULL, 10) : 1;
    need(mkdtemp(folder), "make a folder");
    recording_prepare_process();
    H5Eset_auto2(H5E_DEFAULT, NULL, NULL);
    make_trees();
    make_recording(one_tool, recording_default_options(), in_folder(file_name[RECORDING]));
    make_recording(two_tools, recording_default_options(), in_folder(file_name[TOOLS_RECORDING]));
    make_recording(two_tools, recording_session_options(), in_folder(file_name[SESSION]));
    printf("%-20s %-10s %7s %8s %7s %8s %6s %7s %10s\n", "kind", "change", "mutants", "refused", "read", "signals", "late", "silent", "most MB");
    for (int kind = 0; kind < KINDS; kind++)
        for (int structure = 1; structure >= 0; structure--) {
            Tally t = torture(kind, structure, (count + structure) / 2, seed);
            printf("%-20s %-10s %7d %8d %7d %8d %6d %7d %10.1f\n", kind_name[kind], structure ? "structure" : "bytes", t.made, t.refused, t.read, t.signals,
                   t.late, t.silent, (double)t.most_kb / 1000);
            wrong += t.signals + t.late + t.silent;
            made += t.made;
        }
    printf("hdf5_mutants: %d cases, %d found (signals, too late, without a reason)\n", made, wrong);
    char command[300];
    snprintf(command, sizeof command, "rm -rf '%s'", folder);
    return system(command) == 0 && wrong == 0 ? 0 : 1;
}
