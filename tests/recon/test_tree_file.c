// Tree files: a saved tree is loaded unchanged, the same content gives the same bytes, and every violated rule is reported.
#include "base/whole_file.h"
#include "recon/tree_file.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <fcntl.h>
#include <glob.h>
#include <hdf5.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

static Faults faults;
static char folder[] = "/tmp/seldinger-tree-file-XXXXXX";
#include "tests/folder.h"

static VesselTree *make_tree(bool model)
{
    VesselTree *tree = vessel_tree_create(4, 10, model ? 6 : 0);
    assert_non_null(tree);
    static const int32_t parent[4] = {-1, 0, 1, 1};
    for (int i = 0; i < 4; i++) {
        tree->center[i] = vec3(1.25 * i, 0.1 * i * i, -3);
        tree->radius[i] = 1 + 0.3 * i;
        tree->direction[i] = vec3(0.6, 0, 0.8);
        tree->height[i] = 2.5;
        tree->parent[i] = parent[i];
        tree->kind[i] = i == 3 ? NODE_ANEURYSM : NODE_VESSEL;
        tree->point_offset[i + 1] = i == 3 ? 10 : 3 * (i + 1) - (i == 2 ? 3 : 0);   // node 2 has no points
    }
    for (int i = 0; i < 10; i++)
        tree->point[i] = vec3(sin(i), cos(i), 1.0 / (i + 1));
    for (int i = 0; i < 6 && model; i++) {
        tree->blob_center[i] = vec3(i, 0.5, 1e-3 * i);
        tree->blob_width[i] = 0.2 + 0.1 * i;
    }
    for (int i = 0; i < 4 && model; i++) {
        tree->blob_offset[i + 1] = i == 3 ? 6 : i + 1;
        tree->error[i] = 0.01 * i;
    }
    tree->iso_level = 0.125;
    vessel_tree_link(tree);
    return tree;
}

static const TreeFileInfo some_info = {
    .source = (char *)(uintptr_t) "a.nrrd", .parameters = (char *)(uintptr_t) "rays: 162\n  voxel_mm: 0.25\nx: 1\n", .created_by = (char *)(uintptr_t) "test"};

static void assert_same(const VesselTree *a, const VesselTree *b)
{
    size_t n = (size_t)a->node_count;
    assert_int_equal(a->node_count, b->node_count);
    assert_int_equal(a->point_count, b->point_count);
    assert_int_equal(a->blob_count, b->blob_count);
    assert_memory_equal(a->center, b->center, n * sizeof(Vec3));
    assert_memory_equal(a->radius, b->radius, n * sizeof(double));
    assert_memory_equal(a->direction, b->direction, n * sizeof(Vec3));
    assert_memory_equal(a->height, b->height, n * sizeof(double));
    assert_memory_equal(a->parent, b->parent, n * sizeof(int32_t));
    assert_memory_equal(a->kind, b->kind, n);
    assert_memory_equal(a->point, b->point, (size_t)a->point_count * sizeof(Vec3));
    assert_memory_equal(a->point_offset, b->point_offset, (n + 1) * sizeof(int64_t));
    assert_true(a->iso_level == b->iso_level);
    if (a->blob_count > 0) {
        assert_memory_equal(a->blob_center, b->blob_center, (size_t)a->blob_count * sizeof(Vec3));
        assert_memory_equal(a->blob_width, b->blob_width, (size_t)a->blob_count * sizeof(double));
        assert_memory_equal(a->blob_offset, b->blob_offset, (n + 1) * sizeof(int64_t));
        assert_memory_equal(a->error, b->error, n * sizeof(double));
    }
}

static void save_load_is_equality(void **state)
{
    (void)state;
    for (int model = 0; model < 2; model++) {
        faults_clear(&faults);
        VesselTree *tree = make_tree(model);
        TreeFileInfo info = {0};
        assert_true(tree_file_save(tree, &some_info, in_folder("a.h5"), &faults));
        VesselTree *back = tree_file_load(in_folder("a.h5"), &info, &faults);
        assert_non_null(back);
        assert_int_equal(faults.count, 0);
        assert_same(tree, back);
        assert_string_equal(info.source, some_info.source);
        assert_string_equal(info.parameters, some_info.parameters);
        assert_string_equal(info.created_by, some_info.created_by);
        assert_true(tree_file_number(&info, "voxel_mm", 7) == 0.25);
        assert_true(tree_file_number(&info, "voxel", 7) == 7);
        // the same bytes again
        assert_true(tree_file_save(back, &info, in_folder("b.h5"), &faults));
        size_t na, nb;
        char *a = whole_file_read(in_folder("a.h5"), &na, &faults), *b = whole_file_read(in_folder("b.h5"), &nb, &faults);
        assert_int_equal(na, nb);
        assert_memory_equal(a, b, na);
        free(a);
        free(b);
        tree_file_info_free(&info);
        vessel_tree_free(back);
        vessel_tree_free(tree);
    }
}

static void long_parameters_survive(void **state)
{
    (void)state;
    faults_clear(&faults);
    VesselTree *tree = make_tree(true);
    size_t length = 300000;
    char *text = malloc(length + 1);
    memset(text, 'y', length);
    text[length] = '\0';
    TreeFileInfo info = {.parameters = text}, back_info = {0};
    assert_true(tree_file_save(tree, &info, in_folder("long.h5"), &faults));
    VesselTree *back = tree_file_load(in_folder("long.h5"), &back_info, &faults);
    assert_non_null(back);
    assert_string_equal(back_info.parameters, text);
    free(text);
    tree_file_info_free(&back_info);
    vessel_tree_free(back);
    vessel_tree_free(tree);
}

// --- broken files ---

static void expect_fault(const char *path, const char *words)
{
    faults_clear(&faults);
    VesselTree *tree = tree_file_load(path, NULL, &faults);
    assert_null(tree);
    assert_true(faults.count > 0);
    bool found = false;
    for (int i = 0; i < faults.count && i < FAULTS_CAPACITY; i++)
        found = found || strstr(faults.text[i], words);
    if (!found)
        print_error("wanted '%s', got '%s'\n", words, faults.text[0]);
    assert_true(found);
}

static hid_t fresh_file(const char *path)
{
    faults_clear(&faults);
    VesselTree *tree = make_tree(true);
    assert_true(tree_file_save(tree, &some_info, path, &faults));
    vessel_tree_free(tree);
    hid_t file = H5Fopen(path, H5F_ACC_RDWR, H5P_DEFAULT);
    assert_true(file >= 0);
    return file;
}

static void put_data(hid_t file, const char *path, hid_t type, int rank, const hsize_t *size, const void *data)
{
    if (H5Lexists(file, path, H5P_DEFAULT) > 0)
        H5Ldelete(file, path, H5P_DEFAULT);
    hid_t space = H5Screate_simple(rank, size, NULL), dataset = H5Dcreate2(file, path, type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    assert_true(dataset >= 0);
    if (data)
        H5Dwrite(dataset, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, data);
    H5Dclose(dataset);
    H5Sclose(space);
}

static void missing_datasets_are_named(void **state)
{
    (void)state;
    static const char *const names[] = {"/nodes/center", "/nodes/radius",  "/nodes/direction", "/nodes/height", "/nodes/parent", "/nodes/kind",
                                        "/points/xyz",   "/points/offset", "/blobs/center",    "/blobs/width",  "/blobs/offset", "/blobs/error_mm"};
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
        hid_t file = fresh_file(in_folder("m.h5"));
        H5Ldelete(file, names[i], H5P_DEFAULT);
        H5Fclose(file);
        expect_fault(in_folder("m.h5"), names[i]);
    }
    // all faults in one pass
    hid_t file = fresh_file(in_folder("m.h5"));
    H5Ldelete(file, "/nodes", H5P_DEFAULT);
    H5Ldelete(file, "/points", H5P_DEFAULT);
    H5Fclose(file);
    expect_fault(in_folder("m.h5"), "/nodes/kind");
    assert_true(faults.count >= 8);
}

static void lies_are_found(void **state)
{
    (void)state;
    const char *path = in_folder("lie.h5");
    const double number[12] = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12}, negative[4] = {1, -1, 1, 1}, nan[4] = {1, 1, NAN, 1};
    const int64_t down[5] = {0, 5, 3, 8, 10}, open_ended[5] = {0, 3, 6, 8, 11};
    const int32_t loop[4] = {-1, 2, 1, 1};
    const struct {
        const char *dataset, *words;
        hid_t type;
        int rank;
        hsize_t size[2];
        const void *data;
    } lie[] = {
        {"/nodes/center", "shape", H5T_NATIVE_DOUBLE, 1, {12, 0}, number},      {"/nodes/center", "shape", H5T_NATIVE_DOUBLE, 2, {6, 2}, number},
        {"/nodes/radius", "rows", H5T_NATIVE_DOUBLE, 1, {3, 0}, number},        {"/nodes/radius", "type", H5T_NATIVE_INT32, 1, {4, 0}, NULL},
        {"/nodes/parent", "type", H5T_NATIVE_DOUBLE, 1, {4, 0}, number},        {"/nodes/radius", "radius", H5T_NATIVE_DOUBLE, 1, {4, 0}, negative},
        {"/nodes/radius", "radius", H5T_NATIVE_DOUBLE, 1, {4, 0}, nan},         {"/nodes/parent", "parent", H5T_NATIVE_INT32, 1, {4, 0}, loop},
        {"/points/offset", "offset", H5T_NATIVE_INT64, 1, {5, 0}, down},        {"/points/offset", "offset", H5T_NATIVE_INT64, 1, {5, 0}, open_ended},
        {"/points/xyz", "promises", H5T_NATIVE_DOUBLE, 2, {1u << 31, 3}, NULL},   // nothing stored
        {"/blobs/width", "rows", H5T_NATIVE_DOUBLE, 1, {4, 0}, number},
    };
    for (size_t i = 0; i < sizeof lie / sizeof lie[0]; i++) {
        hid_t file = fresh_file(path);
        put_data(file, lie[i].dataset, lie[i].type, lie[i].rank, lie[i].size, lie[i].data);
        H5Fclose(file);
        expect_fault(path, lie[i].words);
    }
}

// A chunk that decompresses to less than its shape needs: the library would read the memory after it.
static void what_unpacks_to_less_is_refused(void **state)
{
    (void)state;
    static const unsigned char stream[] = {0x78, 0x9c, 0x63, 0x60, 0x80, 0x00, 0x00, 0x00, 0x08, 0x00, 0x01};     // eight zero bytes instead of 32
    const hsize_t rows = 4;
    hid_t file = fresh_file(in_folder("packed.h5")), space = H5Screate_simple(1, &rows, NULL), creation = H5Pcreate(H5P_DATASET_CREATE);
    H5Pset_chunk(creation, 1, &rows);
    H5Pset_deflate(creation, 6);
    H5Ldelete(file, "/blobs/error_mm", H5P_DEFAULT);
    hid_t set = H5Dcreate2(file, "/blobs/error_mm", H5T_NATIVE_DOUBLE, space, H5P_DEFAULT, creation, H5P_DEFAULT);
    assert_true(H5Dwrite_chunk(set, H5P_DEFAULT, 0, &(hsize_t){0}, sizeof stream, stream) >= 0);
    H5Dclose(set);
    H5Sclose(space);
    H5Pclose(creation);
    H5Fclose(file);
    expect_fault(in_folder("packed.h5"), "/blobs/error_mm cannot be read");
}

static void damaged_bytes_are_refused(void **state)
{
    (void)state;
    const char *path = in_folder("cut.h5");
    H5Fclose(fresh_file(path));
    size_t length;
    char *bytes = whole_file_read(path, &length, &faults);
    assert_non_null(bytes);
    for (size_t n = 0; n < length; n += 97) {
        faults_clear(&faults);
        assert_null(tree_file_parse(bytes, n, "cut.h5", NULL, &faults));
        assert_true(faults.count > 0);
    }
    bytes[1] ^= 1;
    faults_clear(&faults);
    assert_null(tree_file_parse(bytes, length, "magic.h5", NULL, &faults));
    free(bytes);
    expect_fault(in_folder("none.h5"), "cannot be opened");
    // the folder of a case, instead of the file in it
    assert_int_equal(mkdir(in_folder("case"), 0777), 0);
    expect_fault(in_folder("case"), "not a regular file but a folder");
    assert_int_equal(close(open(in_folder("case/model.h5"), O_CREAT | O_WRONLY, 0666)), 0);
    expect_fault(in_folder("case"), "case/model.h5");
    expect_fault(folder, "regular file");
}

static void a_full_disk_leaves_what_was_there(void **state)
{
    (void)state;
    VesselTree *tree = make_tree(true);
    const char *path = in_folder("full.h5");
    faults_clear(&faults);
    assert_true(tree_file_save(tree, NULL, path, &faults));
    struct stat before, after;
    assert_int_equal(stat(path, &before), 0);
    struct rlimit kept, small;
    getrlimit(RLIMIT_FSIZE, &kept);
    small = kept;
    small.rlim_cur = 1000;
    signal(SIGXFSZ, SIG_IGN);
    setrlimit(RLIMIT_FSIZE, &small);
    bool saved = tree_file_save(tree, &some_info, path, &faults);
    setrlimit(RLIMIT_FSIZE, &kept);
    assert_false(saved);
    assert_int_equal(faults.count, 1);
    assert_int_equal(stat(path, &after), 0);
    assert_int_equal(before.st_size, after.st_size);
    assert_true(before.st_ino == after.st_ino);
    char part[256];
    glob_t found;
    snprintf(part, sizeof part, "%s.part*", path);
    assert_int_equal(glob(part, 0, NULL, &found), GLOB_NOMATCH);
    faults_clear(&faults);
    assert_false(tree_file_save(tree, NULL, "/nonexistent/folder/x.h5", &faults));
    assert_int_equal(faults.count, 1);
    vessel_tree_free(tree);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(save_load_is_equality),           cmocka_unit_test(long_parameters_survive),
        cmocka_unit_test(missing_datasets_are_named),      cmocka_unit_test(lies_are_found),
        cmocka_unit_test(damaged_bytes_are_refused),       cmocka_unit_test(a_full_disk_leaves_what_was_there),
        cmocka_unit_test(what_unpacks_to_less_is_refused),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
