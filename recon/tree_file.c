// Reads and writes trees and models in HDF5. Both directions go through memory (the core driver writes, and we keep its image): a full disk is then an error
// of our own write, not one inside the library; the fuzz target uses the same code; and the file cannot change while it is read. Metadata are written in the
// 1.8 format, whose checksums make the library refuse damaged headers.
#include "recon/tree_file.h"

#include "base/base.h"
#include "recon/hdf5_reader.h"
#include "recon/hdf5_silence.h"
#include "recon/hdf5_writer.h"
#include "recon/sweep_file.h"

#include <hdf5.h>
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

enum { FORMAT_VERSION = 1 };

typedef struct Reader {
    Hdf5Reader *file;
    const char *name;
    Faults *faults;
} Reader;

enum { CENTER, RADIUS, DIRECTION, HEIGHT, PARENT, KIND, POINT, POINT_OFFSET, BLOB_CENTER, BLOB_WIDTH, BLOB_OFFSET, ERROR_MM, BLOB_AMPLITUDE, COLUMN_COUNT };
static const Hdf5Dataset columns[COLUMN_COUNT] = {
    // as docs/file-formats.md specifies
    [CENTER] = {"/nodes/center", HDF5_DOUBLE, 2, {0, 3}, false},
    [RADIUS] = {"/nodes/radius", HDF5_DOUBLE, 1, {0}, false},
    [DIRECTION] = {"/nodes/direction", HDF5_DOUBLE, 2, {0, 3}, false},
    [HEIGHT] = {"/nodes/height", HDF5_DOUBLE, 1, {0}, false},
    [PARENT] = {"/nodes/parent", HDF5_INT32, 1, {0}, false},
    [KIND] = {"/nodes/kind", HDF5_UINT8, 1, {0}, false},
    [POINT] = {"/points/xyz", HDF5_DOUBLE, 2, {0, 3}, false},
    [POINT_OFFSET] = {"/points/offset", HDF5_INT64, 1, {0}, false},
    [BLOB_CENTER] = {"/blobs/center", HDF5_DOUBLE, 2, {0, 3}, false},
    [BLOB_WIDTH] = {"/blobs/width", HDF5_DOUBLE, 1, {0}, false},
    [BLOB_OFFSET] = {"/blobs/offset", HDF5_INT64, 1, {0}, false},
    [ERROR_MM] = {"/blobs/error_mm", HDF5_DOUBLE, 1, {0}, false},
    [BLOB_AMPLITUDE] = {"/blobs/amplitude", HDF5_DOUBLE, 1, {0}, false},
};

// --- reading ---

static bool expect_rows(const Reader *reader, const Hdf5Dataset *column, uint64_t rows, const char *meaning)
{
    if (column->size[0] == rows)
        return true;
    faults_add(reader->faults, reader->name, 0, 0, "%s has %" PRIu64 " rows; expected %" PRIu64 ", %s", column->path, column->size[0], rows, meaning);
    return false;
}

// Returns an empty string if the attribute is absent.
static char *read_text(const Reader *reader, const char *key)
{
    char *text = hdf5_text_attribute(reader->file, "/", key);
    return text ? text : HEAP_TEXT("");
}

enum { KERNEL_CAUCHY, KERNEL_COMPACT, KERNELS };
static const char *const kernel_name[KERNELS] = {"cauchy", "compact"};   // kernel of local models, kernel of shared blobs

static int read_kernel(const Reader *reader)
{
    char *text = read_text(reader, "kernel");
    int kernel = text && strcmp(text, kernel_name[KERNEL_COMPACT]) == 0 ? KERNEL_COMPACT : KERNEL_CAUCHY;
    if (text && text[0] && strcmp(text, kernel_name[kernel]))
        faults_add(reader->faults, reader->name, 0, 0, "attribute kernel is '%.40s'; expected cauchy (one local model per node) or compact (shared blobs)",
                   text);
    free(text);
    return kernel;
}

static double read_attributes(const Reader *reader, TreeFileInfo *info)
{
    info->source = read_text(reader, "source");
    info->parameters = read_text(reader, "parameters");
    info->created_by = read_text(reader, "created_by");
    double version = hdf5_number(reader->file, "version", FORMAT_VERSION), iso_level = hdf5_number(reader->file, "iso_level", 0.1);
    if (version != FORMAT_VERSION)
        faults_add(reader->faults, reader->name, 0, 0, "attribute version is %g; expected %d", version, FORMAT_VERSION);
    if (!(iso_level > 0 && iso_level < 1e6)) {
        faults_add(reader->faults, reader->name, 0, 0, "attribute iso_level is %g; expected a positive number", iso_level);
        iso_level = 0.1;
    }
    return iso_level;
}

static VesselTree *read_tree(const Reader *reader, TreeFileInfo *info)
{
    int before = reader->faults->count;
    Hdf5Dataset found[COLUMN_COUNT];
    memcpy(found, columns, sizeof found);
    bool is_model = hdf5_has(reader->file, "/blobs");
    bool is_shared = is_model && read_kernel(reader) == KERNEL_COMPACT;
    int used = is_shared ? COLUMN_COUNT : is_model ? BLOB_AMPLITUDE : BLOB_CENTER;
    bool seen[COLUMN_COUNT] = {false};
    for (int i = 0; i < used; i++)
        seen[i] = hdf5_inspect(reader->file, &found[i]);
    double iso_level = read_attributes(reader, info);
    uint64_t nodes = found[CENTER].size[0], points = found[POINT].size[0], blobs = is_model ? found[BLOB_CENTER].size[0] : 0;
    for (int i = 0; i < used && seen[CENTER]; i++) {
        if (seen[i] && (i <= KIND || i == ERROR_MM))
            expect_rows(reader, &found[i], nodes, "the number of nodes");
        else if (seen[i] && (i == POINT_OFFSET || i == BLOB_OFFSET))
            expect_rows(reader, &found[i], nodes + 1, "the number of nodes and one");
    }
    for (int i = 0; i < used && is_model && seen[BLOB_CENTER]; i++)
        if (seen[i] && (i == BLOB_WIDTH || i == BLOB_AMPLITUDE))
            expect_rows(reader, &found[i], blobs, "the number of blobs");
    if (seen[CENTER] && (nodes < 1 || nodes > INT32_MAX - 1))
        faults_add(reader->faults, reader->name, 0, 0, "/nodes/center has %llu rows; expected 1 to %d", (unsigned long long)nodes, INT32_MAX - 1);
    if (is_model && seen[BLOB_CENTER] && blobs < 1)
        faults_add(reader->faults, reader->name, 0, 0, "/blobs/center is empty; expected blobs (a model), or no /blobs at all (a tree)");
    if (reader->faults->count > before)
        return NULL;

    VesselTree *tree = (is_shared ? vessel_tree_create_shared : vessel_tree_create)((int)nodes, (int64_t)points, (int64_t)blobs);
    if (!tree) {
        faults_add(reader->faults, reader->name, 0, 0, "needs more memory than is available (%llu nodes, %llu points)", (unsigned long long)nodes,
                   (unsigned long long)points);
        return NULL;
    }
    tree->iso_level = iso_level;
    void *const target[COLUMN_COUNT] = {
        [CENTER] = tree->center,
        [RADIUS] = tree->radius,
        [DIRECTION] = tree->direction,
        [HEIGHT] = tree->height,
        [PARENT] = tree->parent,
        [KIND] = tree->kind,
        [POINT] = tree->point,
        [POINT_OFFSET] = tree->point_offset,
        [BLOB_CENTER] = tree->blob_center,
        [BLOB_WIDTH] = tree->blob_width,
        [BLOB_OFFSET] = tree->blob_offset,
        [ERROR_MM] = tree->error,
        [BLOB_AMPLITUDE] = tree->blob_amplitude,
    };
    bool good = true;
    for (int i = 0; i < used; i++)
        good = hdf5_read_into(reader->file, &found[i], target[i]) && good;
    if (good && vessel_tree_validate(tree, reader->name, reader->faults)) {
        if (vessel_tree_link(tree))
            return tree;
        faults_add(reader->faults, reader->name, 0, 0,
                   "not enough memory for the links of %d nodes and their lists of %lld blobs; free some, or fit the tree again", tree->node_count,
                   (long long)tree->blob_count);
    }
    vessel_tree_free(tree);
    return NULL;
}

static VesselTree *parse(const void *bytes, size_t length, bool has_rehearsal, const char *name, TreeFileInfo *info, Faults *faults)
{
    TreeFileInfo held = {0};
    Reader reader = {.file = hdf5_reader_parse(bytes, length, has_rehearsal, name, "expected a tree (/nodes and /points) or a model (/blobs too)", faults),
                     .name = name,
                     .faults = faults};
    VesselTree *tree = reader.file ? read_tree(&reader, &held) : NULL;
    hdf5_reader_close(reader.file);
    if (tree && info)
        *info = held;
    else
        tree_file_info_free(&held);
    return tree;
}

VesselTree *tree_file_parse(const void *bytes, size_t length, const char *name, TreeFileInfo *info, Faults *faults)
{
    return parse(bytes, length, false, name, info, faults);
}

// Whether this is the folder of a case (sim/case_make.h), which users may name instead of the file in it.
static bool is_case(const char *path)
{
    struct stat status;
    char *model = text_file_in(path, "model.h5");
    bool has_model = model && stat(model, &status) == 0;
    free(model);
    return has_model;
}

VesselTree *tree_file_load(const char *path, TreeFileInfo *info, Faults *faults)
{
    size_t length;
    if (is_case(path)) {
        faults_add(faults, path, 0, 0, "is the folder of a case, which keeps its tree and model in the file model.h5; expected %s/model.h5", path);
        return NULL;
    }
    char *bytes = whole_file_read(path, &length, faults);
    VesselTree *tree = bytes ? parse(bytes, length, true, path, info, faults) : NULL;
    free(bytes);
    return tree;
}

// --- writing ---

static bool write_tree(hid_t file, const VesselTree *tree, const SweepModels *sweep, const TreeFileInfo *info)
{
    const int32_t version = FORMAT_VERSION;
    int64_t n = tree->node_count, p = tree->point_count, b = tree->blob_count;
    bool has_sweep = false;
    for (int i = 0; sweep && i < SECTION_KINDS; i++)
        has_sweep |= sweep->of[i] != NULL;
    bool good = hdf5_make_group(file, "/nodes") && hdf5_make_group(file, "/points") &&
                hdf5_write_text(file, "format", b > 0 || has_sweep ? "seldinger-model" : "seldinger-tree") &&
                hdf5_write_scalar(file, "version", H5T_NATIVE_INT32, &version) && hdf5_write_scalar(file, "iso_level", H5T_NATIVE_DOUBLE, &tree->iso_level) &&
                hdf5_write_text(file, "kernel", kernel_name[vessel_tree_is_shared(tree) ? KERNEL_COMPACT : KERNEL_CAUCHY]) &&
                hdf5_write_text(file, "source", info ? info->source : "") && hdf5_write_text(file, "parameters", info ? info->parameters : "") &&
                hdf5_write_text(file, "created_by", info && info->created_by ? info->created_by : "seldinger " SELDINGER_VERSION);
    good = good && hdf5_write_column(file, "/nodes/center", H5T_NATIVE_DOUBLE, n, 3, tree->center) &&
           hdf5_write_column(file, "/nodes/radius", H5T_NATIVE_DOUBLE, n, 0, tree->radius) &&
           hdf5_write_column(file, "/nodes/direction", H5T_NATIVE_DOUBLE, n, 3, tree->direction) &&
           hdf5_write_column(file, "/nodes/height", H5T_NATIVE_DOUBLE, n, 0, tree->height) &&
           hdf5_write_column(file, "/nodes/parent", H5T_NATIVE_INT32, n, 0, tree->parent) &&
           hdf5_write_column(file, "/nodes/kind", H5T_NATIVE_UINT8, n, 0, tree->kind) &&
           hdf5_write_column(file, "/points/xyz", H5T_NATIVE_DOUBLE, p, 3, tree->point) &&
           hdf5_write_column(file, "/points/offset", H5T_NATIVE_INT64, n + 1, 0, tree->point_offset);
    if (good && b > 0)
        good = hdf5_make_group(file, "/blobs") && hdf5_write_column(file, "/blobs/center", H5T_NATIVE_DOUBLE, b, 3, tree->blob_center) &&
               hdf5_write_column(file, "/blobs/width", H5T_NATIVE_DOUBLE, b, 0, tree->blob_width) &&
               hdf5_write_column(file, "/blobs/offset", H5T_NATIVE_INT64, n + 1, 0, tree->blob_offset) &&
               hdf5_write_column(file, "/blobs/error_mm", H5T_NATIVE_DOUBLE, n, 0, tree->error) &&
               (!vessel_tree_is_shared(tree) || hdf5_write_column(file, "/blobs/amplitude", H5T_NATIVE_DOUBLE, b, 0, tree->blob_amplitude));
    return good && (!sweep || sweep_models_write(file, sweep));
}

// The core driver frees the file's memory when the file is closed. The file is complete by then, so we take ownership of the memory. (H5Fget_file_image of an
// open file clears the superblock's flags without updating its checksum; no program opens what it returns.)
typedef struct Image {
    unsigned char *bytes;
    size_t capacity;
} Image;

static void *image_malloc(size_t size, H5FD_file_image_op_t operation, void *image)
{
    (void)operation;
    ((Image *)image)->capacity = size;
    return malloc(size);
}
static void *image_realloc(void *bytes, size_t size, H5FD_file_image_op_t operation, void *image)
{
    (void)operation;
    ((Image *)image)->capacity = size;
    return realloc(bytes, size);
}
static void *image_copy(void *to, const void *from, size_t size, H5FD_file_image_op_t operation, void *image)
{
    (void)operation, (void)image;
    return memcpy(to, from, size);
}
static herr_t image_free(void *bytes, H5FD_file_image_op_t operation, void *image)
{
    if (operation == H5FD_FILE_IMAGE_OP_FILE_CLOSE)
        ((Image *)image)->bytes = bytes;
    else
        free(bytes);
    return 0;
}
static void *image_keep(void *image) { return image; }
static herr_t image_forget(void *image)
{
    (void)image;
    return 0;
}

// The end of the file according to its superblock, little-endian (version 2: after the signature, four bytes and two addresses).
static size_t image_length(const Image *image)
{
    enum { END_ADDRESS = 28, SUPERBLOCK = 48 };
    uint64_t end = 0;
    if (!image->bytes || image->capacity < SUPERBLOCK || (image->bytes[8] != 2 && image->bytes[8] != 3))
        return 0;
    for (int i = 7; i >= 0; i--)
        end = end << 8 | image->bytes[END_ADDRESS + i];
    return end <= image->capacity ? (size_t)end : 0;
}

bool tree_file_save(const VesselTree *tree, const TreeFileInfo *info, const char *path, Faults *faults)
{
    return tree_file_save_with(tree, NULL, info, path, faults);
}

bool tree_file_save_with(const VesselTree *tree, const SweepModels *sweep, const TreeFileInfo *info, const char *path, Faults *faults)
{
    if (!heap_can_allocate(HEAP_RESERVE_OF_HDF5)) {
        faults_add(faults, path, 0, 0, "cannot be written: the HDF5 library is out of memory");
        return false;
    }
    Hdf5Silence kept = hdf5_silence_begin();
    Image image = {0};
    H5FD_file_image_callbacks_t callbacks = {image_malloc, image_copy, image_realloc, image_free, image_keep, image_forget, &image};
    hid_t access = H5Pcreate(H5P_FILE_ACCESS), create = H5Pcreate(H5P_FILE_CREATE);
    H5Pset_fapl_core(access, 1 << 18, 0);
    H5Pset_file_image_callbacks(access, &callbacks);
    H5Pset_libver_bounds(access, H5F_LIBVER_V18, H5F_LIBVER_V18);
    H5Pset_obj_track_times(create, false);
    hid_t file = H5Fcreate("/dev/null/image", H5F_ACC_TRUNC, create, access);
    bool built = file >= 0 && write_tree(file, tree, sweep, info);
    if (file >= 0)
        built = H5Fclose(file) >= 0 && built;
    H5Pclose(create);
    H5Pclose(access);
    hdf5_silence_end(kept);
    size_t length = built ? image_length(&image) : 0;
    if (length == 0)
        faults_add(faults, path, 0, 0, "cannot be written: the HDF5 library failed (out of memory?)");
    built = length > 0 && whole_file_write(path, image.bytes, length, faults);
    free(image.bytes);
    return built;
}

void tree_file_info_free(TreeFileInfo *info)
{
    free(info->source);
    free(info->parameters);
    free(info->created_by);
    *info = (TreeFileInfo){0};
}

double tree_file_number(const TreeFileInfo *info, const char *key, double otherwise)
{
    size_t length = strlen(key);
    for (const char *line = info && info->parameters ? info->parameters : NULL; line; line = strchr(line, '\n')) {
        line += strspn(line, "\n \t{,");
        if (strncmp(line, key, length) == 0 && line[length] == ':') {
            char *end;
            double value = strtod(line + length + 1, &end);
            if (end != line + length + 1 && isfinite(value))
                return value;
        }
    }
    return otherwise;
}
