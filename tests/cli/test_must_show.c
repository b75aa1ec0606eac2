// Properties of the whole program: bit-identical results for any number of threads, and no preferred direction in space: the mirror image of a vessel and its
// scene gives the mirrored path, and the rotated and shifted one the rotated and shifted path.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <cJSON.h>
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include "geom/linear.h"
#include "recon/tree_file.h"
#include "sim/recording.h"

static char folder[] = "/tmp/seldinger-must-XXXXXX";
static Faults faults;
#include "tests/folder.h"
#include "tests/cli/program.h"

// Runs `seldinger ARGUMENTS` in the folder with its output in `output`. Fails if the exit code is not 0.
static void run(const char *arguments)
{
    int code = run_in("", arguments);
    if (code != 0)
        fail_msg("`%s` ended with %d: %s", arguments, code, output);
}

static VesselTree *load(const char *name)
{
    faults_clear(&faults);
    VesselTree *tree = tree_file_load(in_folder(name), NULL, &faults);
    assert_non_null(tree);
    return tree;
}

// --- threads ---

static void assert_same_tree(const char *one, const char *two)
{
    VesselTree *a = load(one), *b = load(two);
    size_t n = (size_t)a->node_count, p = (size_t)a->point_count, k = (size_t)a->blob_count;
    assert_true(a->node_count == b->node_count && a->point_count == b->point_count && a->blob_count == b->blob_count && n > 3 && p > 100);
    assert_memory_equal(a->center, b->center, n * sizeof(Vec3));
    assert_memory_equal(a->radius, b->radius, n * sizeof(double));
    assert_memory_equal(a->direction, b->direction, n * sizeof(Vec3));
    assert_memory_equal(a->height, b->height, n * sizeof(double));
    assert_memory_equal(a->parent, b->parent, n * sizeof(int32_t));
    assert_memory_equal(a->point, b->point, p * sizeof(Vec3));
    assert_memory_equal(a->point_offset, b->point_offset, (n + 1) * sizeof(int64_t));
    if (k) {
        assert_memory_equal(a->blob_center, b->blob_center, k * sizeof(Vec3));
        assert_memory_equal(a->blob_width, b->blob_width, k * sizeof(double));
        assert_memory_equal(a->blob_offset, b->blob_offset, (n + 1) * sizeof(int64_t));
        assert_memory_equal(a->error, b->error, n * sizeof(double));
    }
    vessel_tree_free(a);
    vessel_tree_free(b);
}

static void segment_and_fit_do_not_depend_on_threads(void **state)
{
    (void)state;
    run("synth arc --radius-mm 1.2 --bend-radius-mm 6 --voxel-mm 0.3 --psf-mm 0.25 -o arc.nrrd");
    VesselTree *truth = load("arc-truth.h5");
    Vec3 a = truth->center[truth->node_count / 3], b = truth->center[2 * truth->node_count / 3];
    FILE *trace = fopen(in_folder("arc.yaml"), "w");
    assert_non_null(trace);
    fprintf(trace, "branches: [{start_mm: [%.6f, %.6f, %.6f], toward_mm: [%.6f, %.6f, %.6f], radius_mm: 1.2}]\n", a.x, a.y, a.z, b.x, b.y, b.z);
    assert_int_equal(fclose(trace), 0);
    vessel_tree_free(truth);
    for (int threads = 1; threads <= 3; threads++) {
        char arguments[200];
        snprintf(arguments, sizeof arguments, "segment arc.nrrd --trace arc.yaml -o tree%d.h5 --threads %d", threads, threads);
        run(arguments);
        snprintf(arguments, sizeof arguments, "fit tree1.h5 -o model%d.h5 --threads %d", threads, threads);
        run(arguments);
    }
    for (int threads = 2; threads <= 3; threads++) {
        char tree[20], model[20];
        snprintf(tree, sizeof tree, "tree%d.h5", threads);
        snprintf(model, sizeof model, "model%d.h5", threads);
        assert_same_tree("tree1.h5", tree);
        assert_same_tree("model1.h5", model);
    }
}

// --- symmetry ---

typedef struct Motion {      // x -> turn x + shift; a mirror image if the determinant is negative
    Mat3 turn;
    Vec3 shift;
    double sign;             // determinant
} Motion;

static Vec3 moved(const Motion *m, Vec3 x) { return vec3_add(mat3_mul_vec(&m->turn, x), m->shift); }

static Motion mirror(int axis)
{
    Motion m = {.turn = mat3_identity(), .sign = -1};
    m.turn.m[axis][axis] = -1;
    return m;
}

static void move_model(const char *from, const Motion *m, const char *to)
{
    VesselTree *tree = load(from);
    for (int i = 0; i < tree->node_count; i++) {
        tree->center[i] = moved(m, tree->center[i]);
        tree->direction[i] = vec3_unit(mat3_mul_vec(&m->turn, tree->direction[i]));
    }
    for (int64_t i = 0; i < tree->point_count; i++)
        tree->point[i] = moved(m, tree->point[i]);
    for (int64_t i = 0; i < tree->blob_count; i++)
        tree->blob_center[i] = moved(m, tree->blob_center[i]);
    char text[] = "";
    TreeFileInfo info = {.source = text, .parameters = text, .created_by = text};
    assert_true(tree_file_save(tree, &info, in_folder(to), &faults));
    vessel_tree_free(tree);
}

typedef enum { AT_ROOT, AT_ENTRY, AT_ENTRY_WITH_NORMAL } Place;

// A wire with a J tip whose plane is rotated by 40 degrees, pushed and twisted into the moved model.
static RecordedRun *run_moved(const char *name, const Motion *m, Place place, double duration_s)
{
    VesselTree *tree = load("phantom.h5");
    Vec3 entry = moved(m, tree->center[0]), direction = mat3_mul_vec(&m->turn, tree->direction[0]);
    Vec3 normal = mat3_mul_vec(&m->turn, vec3_normal_to(tree->direction[0]));
    vessel_tree_free(tree);
    char file[100];
    snprintf(file, sizeof file, "%s-model.h5", name);
    move_model("phantom.h5", m, file);
    snprintf(file, sizeof file, "%s.yaml", name);
    FILE *scene = fopen(in_folder(file), "w");
    assert_non_null(scene);
    fprintf(scene,
            "seldinger: 1\nvessel: {model: %s-model.h5, friction: 0.04}\nwire:\n  elements: 70\n  sections:\n"
            "    - {length_mm: 110, diameter_mm: 0.36, young_modulus_gpa: 80}\n"
            "    - {length_mm: 30, diameter_mm: 0.36, young_modulus_gpa: 5, rest_curvature_1_mm: 0.1, rest_curvature_plane_deg: %g}\n"
            "  damping: {mass_1_s: 0.1, stiffness_s: 0.0002}\n",
            name, 40 * m->sign);
    if (place == AT_ROOT)
        fprintf(scene, "sheath: {inlet: root, inserted_mm: 2}\n");
    else
        fprintf(scene, "sheath: {entry_mm: [%.17g, %.17g, %.17g], direction: [%.17g, %.17g, %.17g], inserted_mm: 2", entry.x, entry.y, entry.z, direction.x,
                direction.y, direction.z);
    if (place == AT_ENTRY_WITH_NORMAL)
        fprintf(scene, ", normal: [%.17g, %.17g, %.17g]", normal.x, normal.y, normal.z);
    fprintf(scene, "%sscript: [[0, 20, %g], [1, 25, %g], [3, 10, %g], [4, 0, %g], [4.6, 0, 0], [5, 0, 0]]\n", place == AT_ROOT ? "" : "}\n", 30 * m->sign,
            -90 * m->sign, 120 * m->sign, 60 * m->sign);
    assert_int_equal(fclose(scene), 0);
    char arguments[300];
    snprintf(arguments, sizeof arguments, "run %s.yaml --duration-s %g --record %s-run.h5 --summary %s.json", name, duration_s, name, name);
    run(arguments);
    printf("%s", output);
    snprintf(file, sizeof file, "%s-run.h5", name);
    faults_clear(&faults);
    RecordedRun *recorded = recorded_run_load(in_folder(file), &faults);
    assert_non_null(recorded);
    assert_true(recorded->step_count == (int64_t)llround(duration_s * 1000) && recorded->frame_count > 1);
    for (int64_t i = 0; i < recorded->frame_count * recorded->node_count; i++)
        assert_true(vec3_is_finite(recorded->position[i]));
    return recorded;
}

// Largest distance between a node of `b` and the moved node of `a` in the frames up to `until_s`.
static double parting(const RecordedRun *a, const Motion *m, const RecordedRun *b, double until_s)
{
    double worst = 0;
    assert_int_equal(a->node_count, b->node_count);
    assert_int_equal(a->frame_count, b->frame_count);
    for (int64_t k = 0; k < a->frame_count && a->time_s[a->frame_step[k]] < until_s + 1e-9; k++)
        for (int i = 0; i < a->node_count; i++)
            worst = fmax(worst, vec3_distance(moved(m, a->position[k * a->node_count + i]), b->position[k * a->node_count + i]));
    return worst;
}

static Vec3 last_tip(const RecordedRun *run_) { return run_->position[run_->frame_count * run_->node_count - 1]; }

static const Motion still = {.turn = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}, .sign = 1};

static void a_mirrored_scene_gives_the_mirrored_path(void **state)
{
    (void)state;
    RecordedRun *plain = run_moved("plain", &still, AT_ENTRY, 5);
    for (int axis = 0; axis < 3; axis++) {
        Motion m = mirror(axis);
        RecordedRun *image = run_moved("image", &m, AT_ENTRY, 5);
        double first = parting(plain, &m, image, 1), tip = vec3_distance(moved(&m, last_tip(plain)), last_tip(image));
        printf("mirrored in %c: first second %.3g mm, whole run %.3g mm, tip at the end %.3g mm\n", "xyz"[axis], first, parting(plain, &m, image, 5), tip);
        assert_true(first < 1e-6);
        assert_true(tip < 0.05);
        recorded_run_free(image);
    }
    recorded_run_free(plain);
}

static void an_inlet_mirrors_too(void **state)
{
    (void)state;
    RecordedRun *plain = run_moved("plain", &still, AT_ROOT, 0.6);
    for (int axis = 0; axis < 3; axis++) {
        Motion m = mirror(axis);
        RecordedRun *image = run_moved("image", &m, AT_ROOT, 0.6);
        assert_true(parting(plain, &m, image, 0.6) < 1e-6);
        recorded_run_free(image);
    }
    recorded_run_free(plain);
}

static void a_turned_and_shifted_scene_gives_the_same_path_there(void **state)
{
    (void)state;
    Vec3 e1 = vec3_unit(vec3(0.3, -0.8, 0.52)), e2 = vec3_unit(vec3_cross(e1, vec3(0.1, 0.2, 0.9)));
    Motion m = {.turn = mat3_from_columns(e1, e2, vec3_cross(e1, e2)), .shift = {-17.3, 41.1, 8.9}, .sign = 1};
    RecordedRun *plain = run_moved("plain", &still, AT_ENTRY_WITH_NORMAL, 1), *image = run_moved("image", &m, AT_ENTRY_WITH_NORMAL, 1);
    double first = parting(plain, &m, image, 0.5);
    printf("turned: half a second %.3g mm, a second %.3g mm\n", first, parting(plain, &m, image, 1));
    assert_true(first < 1e-6);
    recorded_run_free(plain);
    recorded_run_free(image);
}

// --- numbers ---

// All numbers of a text are finite; the gap of a node outside any vessel (in the sheath: its vessel_node is -1) is `inf`.
static void all_numbers_are_finite(const char *name)
{
    char *text = calloc(1, 1 << 20), *next = text;
    FILE *file = fopen(in_folder(name), "r");
    assert_true(text && file);
    assert_true(fread(text, 1, (1 << 20) - 1, file) > 100);
    fclose(file);
    while (next) {
        char *line = next, *end = strchr(line, '\n');
        next = end ? end + 1 : NULL;
        if (end)
            *end = 0;
        size_t length = strlen(line);
        bool held = length > 7 && !strcmp(line + length - 7, ",inf,-1");
        if (held)
            line[length - 7] = 0;
        if (strstr(line, "nan") || strstr(line, "inf,") || strstr(line, ": null"))
            fail_msg("%s holds what is no number: %s", name, line);
    }
    free(text);
}

static void the_same_run_has_the_same_hash_and_finite_figures(void **state)
{
    (void)state;
    recorded_run_free(run_moved("twice", &still, AT_ROOT, 0.5));
    run("run twice.yaml --duration-s 0.5 --summary first.json --final first.csv");
    run("run twice.yaml --duration-s 0.5 --summary second.json --final second.csv --threads 2");
    char hash[2][64] = {"", ""};
    for (int i = 0; i < 2; i++) {
        char text[1 << 14] = "";
        FILE *file = fopen(in_folder(i ? "second.json" : "first.json"), "r");
        assert_non_null(file);
        assert_true(fread(text, 1, sizeof text - 1, file) > 0);
        fclose(file);
        cJSON *json = cJSON_Parse(text);
        assert_non_null(json);
        snprintf(hash[i], sizeof hash[i], "%s", cJSON_GetStringValue(cJSON_GetObjectItem(json, "state_hash")));
        printf("real-time factor %.2f\n", cJSON_GetObjectItem(json, "real_time_factor")->valuedouble);
        cJSON_Delete(json);
    }
    assert_int_equal(strlen(hash[0]), 16);
    assert_string_equal(hash[0], hash[1]);
    all_numbers_are_finite("first.json");
    all_numbers_are_finite("first.csv");
}

static int set_up(void **state)
{
    if (make_folder_with_cache(state) != 0)
        return -1;
    run("synth phantom -o tree.h5 --quiet");
    run("fit tree.h5 -o phantom.h5 --quiet");
    return 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(segment_and_fit_do_not_depend_on_threads),
        cmocka_unit_test(a_mirrored_scene_gives_the_mirrored_path),
        cmocka_unit_test(an_inlet_mirrors_too),
        cmocka_unit_test(a_turned_and_shifted_scene_gives_the_same_path_there),
        cmocka_unit_test(the_same_run_has_the_same_hash_and_finite_figures),
    };
    return cmocka_run_group_tests_name("must_show", tests, set_up, remove_folder);
}
