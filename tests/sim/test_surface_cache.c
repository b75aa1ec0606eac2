// A cached surface is that of the function, bit for bit, whatever the folder holds: nothing, damage, another version, no permission, other programs at work.
#define _DEFAULT_SOURCE   // mkdtemp
#include "sim/surface_cache.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static char folder[] = "/tmp/seldinger-surfaces-XXXXXX";

#include "recon/recon.h"
#include "tests/folder.h"
#include "tests/geom/small_meshes.h"
#include "tests/recon/fitted_shape.h"

#include <dirent.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

enum { FEW = 300 };

static TriangleMesh ball;

static int set_up(void **state)
{
    strcpy(folder + strlen(folder) - 6, "XXXXXX");
    ball = sphere_mesh(20);
    ball.node = calloc((size_t)ball.vertex_count, sizeof *ball.node);
    return make_folder_with_cache(state);
}

static int tear_down(void **state)
{
    free(ball.node);
    mesh_clear(&ball);
    return remove_folder(state);
}

static bool same_meshes(const TriangleMesh *a, const TriangleMesh *b)
{
    return a && b && a->vertex_count == b->vertex_count && a->triangle_count == b->triangle_count &&
           memcmp(a->vertex, b->vertex, (size_t)a->vertex_count * sizeof *a->vertex) == 0 &&
           memcmp(a->normal, b->normal, (size_t)a->vertex_count * sizeof *a->normal) == 0 &&
           memcmp(a->node, b->node, (size_t)a->vertex_count * sizeof *a->node) == 0 &&
           memcmp(a->triangle, b->triangle, (size_t)a->triangle_count * sizeof *a->triangle) == 0;
}

static bool gives_the_decimation(const TriangleMesh *mesh, int triangles)
{
    TriangleMesh *made = mesh_decimate(mesh, triangles, HUGE_VAL), *cached = cached_decimation(mesh, triangles);
    bool same = same_meshes(made, cached);
    triangle_mesh_free(made);
    triangle_mesh_free(cached);
    return same;
}

// The number of surfaces in the folder, and the path of one of them.
static int count_files(char path[400])
{
    DIR *directory = opendir(folder);
    int count = 0;
    assert_non_null(directory);
    for (const struct dirent *entry; (entry = readdir(directory)) != NULL;)
        if (strstr(entry->d_name, ".mesh")) {
            snprintf(path, 400, "%.100s/%.250s", folder, entry->d_name);
            count++;
        }
    closedir(directory);
    return count;
}

static uint8_t *bytes_of(const char *path, size_t *length)
{
    faults_clear(&faults);
    uint8_t *bytes = (uint8_t *)whole_file_read(path, length, &faults);
    assert_non_null(bytes);
    return bytes;
}

static void write_bytes(const char *path, const uint8_t *bytes, size_t length) { assert_true(whole_file_write(path, bytes, length, &faults)); }

static void a_second_call_reads_the_file(void **state)
{
    (void)state;
    char path[400];
    size_t length;
    ContentDigest key;
    assert_true(gives_the_decimation(&ball, FEW));
    assert_int_equal(count_files(path), 1);
    uint8_t *bytes = bytes_of(path, &length);
    memcpy(&key, bytes + 24, sizeof key);
    // another mesh under the same key shows that the file is used
    TriangleMesh *planted = mesh_decimate(&ball, FEW / 2, HUGE_VAL);
    size_t planted_length;
    uint8_t *planted_bytes = mesh_pack(planted, &key, &planted_length);
    write_bytes(path, planted_bytes, planted_length);
    TriangleMesh *found = cached_decimation(&ball, FEW);
    assert_true(same_meshes(found, planted));
    triangle_mesh_free(found);
    triangle_mesh_free(planted);
    free(planted_bytes);
    free(bytes);
}

static void everything_that_it_is_made_of_counts(void **state)
{
    (void)state;
    char path[400];
    assert_true(gives_the_decimation(&ball, FEW));
    assert_true(gives_the_decimation(&ball, FEW + 50));
    ball.vertex[5].z += 1e-9;
    assert_true(gives_the_decimation(&ball, FEW));
    ball.node[3] = 1;
    assert_true(gives_the_decimation(&ball, FEW));
    assert_int_equal(count_files(path), 4);
}

static void damaged_and_foreign_files_are_replaced(void **state)
{
    (void)state;
    enum { VERSION_AT = 8 };
    char path[400];
    size_t length, again;
    assert_true(gives_the_decimation(&ball, FEW));
    assert_int_equal(count_files(path), 1);
    uint8_t *good = bytes_of(path, &length), *bad = malloc(length);
    const size_t cut[] = {0, 10, length / 2, length};
    for (size_t i = 0; i < 4; i++) {
        memcpy(bad, good, length);
        bad[i < 3 ? length / 3 : VERSION_AT]--;      // whole, it is a file of an older version
        write_bytes(path, bad, cut[i]);
        assert_true(gives_the_decimation(&ball, FEW));
        uint8_t *now = bytes_of(path, &again);
        assert_int_equal(again, length);
        assert_memory_equal(now, good, length);
        free(now);
    }
    free(good);
    free(bad);
}

// In a child without root's rights, to which every folder is writable.
static bool works_without_permission(void)
{
    int status;
    pid_t child = fork();
    if (child == 0) {
        bool is_weak = geteuid() != 0 || setuid(65534) == 0, known = gives_the_decimation(&ball, FEW), new = gives_the_decimation(&ball, FEW + 50);
        _exit(is_weak && access(folder, W_OK) != 0 && known && new ? 0 : 1);
    }
    return waitpid(child, &status, 0) == child && WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

static void a_folder_that_cannot_be_written_is_no_error(void **state)
{
    (void)state;
    char path[400];
    assert_true(gives_the_decimation(&ball, FEW));
    assert_int_equal(chmod(folder, 0555), 0);
    assert_true(works_without_permission());
    assert_int_equal(chmod(folder, 0000), 0);
    assert_true(works_without_permission());
    assert_int_equal(chmod(folder, 0755), 0);
    assert_int_equal(count_files(path), 1);
    static const char *const none[] = {"/proc/self/task", "/dev/null", "/dev/null/below"};
    for (int i = 0; i < 3; i++) {
        assert_int_equal(setenv("SELDINGER_CACHE", none[i], 1), 0);
        assert_true(gives_the_decimation(&ball, FEW));
    }
}

static void programs_that_start_together_agree(void **state)
{
    (void)state;
    enum { PROGRAMS = 6, ROUNDS = 10 };
    char path[400];
    for (int i = 0; i < PROGRAMS; i++)
        if (fork() == 0) {
            bool good = true;
            for (int k = 0; k < ROUNDS; k++)
                good &= gives_the_decimation(&ball, FEW + 40 * k);
            _exit(good ? 0 : 1);
        }
    for (int i = 0, status; i < PROGRAMS; i++) {
        assert_true(wait(&status) > 0);
        assert_true(WIFEXITED(status) && WEXITSTATUS(status) == 0);
    }
    assert_int_equal(count_files(path), ROUNDS);
    // nothing unfinished remains
    DIR *directory = opendir(folder);
    int entries = 0;
    while (readdir(directory))
        entries++;
    closedir(directory);
    assert_int_equal(entries, ROUNDS + 2);
}

static void put_sparse(const char *name, off_t size, time_t age_s)
{
    int file = open(in_folder(name), O_CREAT | O_WRONLY | O_CLOEXEC, 0666);
    assert_true(file >= 0 && ftruncate(file, size) == 0 && close(file) == 0);
    const struct timespec then = {.tv_sec = time(NULL) - age_s};
    assert_int_equal(utimensat(AT_FDCWD, in_folder(name), (const struct timespec[]){then, then}, 0), 0);
}

static void the_files_used_least_recently_go(void **state)
{
    (void)state;
    char path[400];
    const off_t third = ((off_t)SURFACE_CACHE_MB << 20) / 3;
    assert_true(gives_the_decimation(&ball, FEW));
    assert_int_equal(count_files(path), 1);
    const struct timespec long_ago = {.tv_sec = time(NULL) - 1000};
    assert_int_equal(utimensat(AT_FDCWD, path, (const struct timespec[]){long_ago, long_ago}, 0), 0);
    assert_true(gives_the_decimation(&ball, FEW));       // used now, so it stays
    put_sparse("surface-oldest.mesh", third, 300);
    put_sparse("surface-older.mesh", third, 200);
    put_sparse("surface-old.mesh", third, 100);
    put_sparse("fit-other.h5", third, 400);
    assert_true(gives_the_decimation(&ball, FEW + 50));
    assert_int_equal(access(path, R_OK), 0);
    assert_int_equal(access(in_folder("fit-other.h5"), R_OK), 0);
    assert_int_equal(access(in_folder("surface-old.mesh"), R_OK), 0);
    assert_int_equal(access(in_folder("surface-older.mesh"), R_OK), 0);
    assert_int_not_equal(access(in_folder("surface-oldest.mesh"), R_OK), 0);
}

static void an_isosurface_follows_its_tree(void **state)
{
    (void)state;
    const double cell = 0.3;
    char path[400];
    Shape *shape = make("capsule", 0, NULL);
    VesselTree *tree = fit_of(shape, lim_fit_default_options());
    double *const value[] = {&tree->blob_width[0], &tree->blob_center[0].x, &tree->radius[0], &tree->iso_level};
    for (int i = -1; i < 4; i++) {
        if (i >= 0)
            *value[i] *= 1 + 1e-9;
        for (int again = 0; again < 2; again++) {
            TriangleMesh *made = isosurface_of_tree(tree, cell), *cached = cached_isosurface_of_tree(tree, cell);
            assert_true(same_meshes(made, cached));
            triangle_mesh_free(made);
            triangle_mesh_free(cached);
        }
        assert_int_equal(count_files(path), i + 2);
    }
    assert_null(cached_isosurface_of_tree(tree, 0));
    vessel_tree_free(tree);
    shape_free(shape);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(a_second_call_reads_the_file, set_up, tear_down),
        cmocka_unit_test_setup_teardown(everything_that_it_is_made_of_counts, set_up, tear_down),
        cmocka_unit_test_setup_teardown(damaged_and_foreign_files_are_replaced, set_up, tear_down),
        cmocka_unit_test_setup_teardown(a_folder_that_cannot_be_written_is_no_error, set_up, tear_down),
        cmocka_unit_test_setup_teardown(programs_that_start_together_agree, set_up, tear_down),
        cmocka_unit_test_setup_teardown(the_files_used_least_recently_go, set_up, tear_down),
        cmocka_unit_test_setup_teardown(an_isosurface_follows_its_tree, set_up, tear_down),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
