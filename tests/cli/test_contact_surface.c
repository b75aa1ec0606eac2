// A mesh as the vessel (`vessel: {mesh: F}`), and vessels converted to meshes and grids (`--contact`): defects of a mesh are reported and repaired, or the mesh
// is refused; the wire has the same position as in the exact tube.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>

static char folder[] = "/tmp/seldinger-surface-XXXXXX";
#include "tests/folder.h"
#include "tests/cli/program.h"

enum { AROUND = 36, RINGS = 81, VERTICES = AROUND * RINGS + 2, TRIANGLES = 2 * AROUND * RINGS };

static int run(const char *arguments) { return run_in("", arguments); }

// --- A closed tube of radius 1 about the x axis, 40 mm long, normals out of the lumen ---

typedef struct Pipe {
    double vertex[VERTICES][3];
    int triangle[TRIANGLES + 10][3], count;
} Pipe;

static void pipe_make(Pipe *p)
{
    int first = AROUND * RINGS;
    p->count = 0;
    for (int i = 0; i < RINGS; i++)
        for (int k = 0; k < AROUND; k++) {
            double angle = 2 * 3.14159265358979 * k / AROUND, *v = p->vertex[i * AROUND + k];
            v[0] = 0.5 * i, v[1] = cos(angle), v[2] = sin(angle);
        }
    memcpy(p->vertex[first], (double[3]){0, 0, 0}, sizeof p->vertex[0]);
    memcpy(p->vertex[first + 1], (double[3]){0.5 * (RINGS - 1), 0, 0}, sizeof p->vertex[0]);
    for (int k = 0; k < AROUND; k++) {
        int next = (k + 1) % AROUND, last = (RINGS - 1) * AROUND;
        memcpy(p->triangle[p->count++], (int[3]){first, next, k}, sizeof p->triangle[0]);
        memcpy(p->triangle[p->count++], (int[3]){first + 1, last + k, last + next}, sizeof p->triangle[0]);
        for (int i = 0; i + 1 < RINGS; i++) {
            int a = i * AROUND + k, b = i * AROUND + next, c = a + AROUND, d = b + AROUND;
            memcpy(p->triangle[p->count++], (int[3]){a, b, d}, sizeof p->triangle[0]);
            memcpy(p->triangle[p->count++], (int[3]){a, d, c}, sizeof p->triangle[0]);
        }
    }
}

static void turn(int *triangle)
{
    int swap = triangle[1];
    triangle[1] = triangle[2];
    triangle[2] = swap;
}

static void pipe_write(const Pipe *p, double scale)
{
    FILE *file = fopen(in_folder("pipe.obj"), "w");
    assert_non_null(file);
    for (int i = 0; i < VERTICES; i++)
        fprintf(file, "v %.17g %.17g %.17g\n", scale * p->vertex[i][0], scale * p->vertex[i][1], scale * p->vertex[i][2]);
    for (int t = 0; t < p->count; t++)
        fprintf(file, "f %d %d %d\n", p->triangle[t][0] + 1, p->triangle[t][1] + 1, p->triangle[t][2] + 1);
    assert_int_equal(fclose(file), 0);
}

static void scene_write(const char *vessel, const char *entry)
{
    FILE *file = fopen(in_folder("scene.yaml"), "w");
    assert_non_null(file);
    fprintf(file,
            "seldinger: 1\nvessel: {%s, friction: 0.1}\n"
            "wire: {elements: 60, sections: [{length_mm: 30, diameter_mm: 0.4, young_modulus_gpa: 60, rest_curvature_1_mm: 0.05}]}\n"
            "sheath: {entry_mm: %s, direction: [0.98, 0.2, 0], inserted_mm: 1}\nscript: [{t_s: 0, push_mm_s: 40, twist_deg_s: 30}, [0.5, 0, 0]]\n",
            vessel, entry);
    assert_int_equal(fclose(file), 0);
}

static bool without_embree(void)
{
    if (!strstr(output, "built without"))
        return false;
    print_message("built without Embree: skipped\n");
    return true;
}

static void tip_of(double tip[3])
{
    char *text = text_of(in_folder("s.json")), *at = strstr(text, "\"tip_mm\"");
    assert_non_null(at);
    assert_int_equal(sscanf(strchr(at, '['), "[ %lf , %lf , %lf", &tip[0], &tip[1], &tip[2]), 3);
    free(text);
}

static double between(const double a[3], const double b[3])
{
    return sqrt((a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]) + (a[2] - b[2]) * (a[2] - b[2]));
}

// Runs the tube as it was written; the output must contain `words`.
static void run_reports(const char *words, double tip[3])
{
    assert_int_equal(run("run scene.yaml --quiet --summary s.json"), 0);
    if (*words && !strstr(output, words))
        fail_msg("printed: %s\n(expected '%s')", output, words);
    tip_of(tip);
}

static void refused(const char *words)
{
    int code = run("run scene.yaml --quiet --summary out.json");
    if (code != 2 || !strstr(output, words))
        fail_msg("ended with %d and printed: %s\n(expected 2 and '%s')", code, output, words);
    assert_null(fopen(in_folder("out.json"), "r"));
}

// Writes the tube without defects and its scene; skips the test if the build has no mesh contact.
static void start_with(Pipe *good)
{
    pipe_make(good);
    pipe_write(good, 1);
    scene_write("mesh: pipe.obj", "[0.5, 0, 0]");
    run("run scene.yaml --quiet");
    if (without_embree())
        skip();
}

static void a_bad_mesh_is_reported_and_repaired_or_refused(void **state)
{
    (void)state;
    static Pipe good, bad;
    double tip[3], other[3];
    start_with(&good);
    run_reports("", tip);
    assert_string_equal(output, "");
    assert_true(tip[0] > 19);

    bad = good;
    for (int t = 0; t < bad.count; t += 7)
        turn(bad.triangle[t]);
    pipe_write(&bad, 1);
    run_reports("oriented against their neighbours", other);
    assert_true(between(tip, other) < 1e-6);

    bad = good;
    for (int t = 0; t < bad.count; t++)
        turn(bad.triangle[t]);
    pipe_write(&bad, 1);
    run_reports("normals point into the lumen: all flipped", other);
    assert_true(between(tip, other) < 1e-6);

    bad = good;
    memcpy(bad.triangle[bad.count++], good.triangle[100], sizeof good.triangle[0]);
    memcpy(bad.triangle[bad.count++], (int[3]){5, 5, 6}, sizeof good.triangle[0]);
    pipe_write(&bad, 1);
    run_reports("1 triangles repeat others", other);
    assert_non_null(strstr(output, "1 triangles have no area"));
    assert_true(between(tip, other) < 1e-6);

    bad = good;
    memcpy(bad.triangle[bad.count++], (int[3]){200, 201, 900}, sizeof good.triangle[0]);
    pipe_write(&bad, 1);
    refused("edges of three triangles or more");

    bad = good;
    bad.count -= 2 * AROUND / 3;     // removes part of the wall in the last third
    pipe_write(&bad, 1);
    run_reports("edges are open", other);

    pipe_write(&good, 0.001);
    refused("mesh_scale: 1000 for metres");
    scene_write("mesh: pipe.obj, mesh_scale: 1000", "[0.5, 0, 0]");
    run_reports("", other);
    assert_true(between(tip, other) < 1e-6);
}

static void a_mesh_that_cannot_be_the_vessel_is_refused(void **state)
{
    (void)state;
    static Pipe good;
    start_with(&good);
    scene_write("mesh: pipe.obj", "[0.5, 3, 0]");
    refused("is not inside the mesh");
    scene_write("mesh: nothing.obj", "[0.5, 0, 0]");
    refused("nothing.obj");
    scene_write("mesh: pipe.obj, contact: lim", "[0.5, 0, 0]");
    refused("contact 'lim' needs a fitted model");
    scene_write("mesh: pipe.obj, contact: tube", "[0.5, 0, 0]");
    refused("contact 'tube' needs the source 'tube'");
    scene_write("mesh: pipe.obj, plane: {normal: [0, 0, 1]}", "[0.5, 0, 0]");
    refused("a second source 'mesh'");
    scene_write("mesh: pipe.obj, mesh_scale: -1", "[0.5, 0, 0]");
    refused("mesh_scale");
    scene_write("plane: {normal: [0, 0, 1]}, contact: mesh", "[0.5, 0, 0]");
    refused("needs a bounded wall");
}

// With each contact surface of one tube the wire has the position of the exact tube, within the error of the cells.
static void all_surfaces_of_a_tube_hold_the_same_wire(void **state)
{
    (void)state;
    static const char *const kinds[] = {"lim", "mesh", "smooth_mesh", "flat_mesh", "grid"};
    double tip[3], other[3];
    scene_write("tube: {start_mm: [0, 0, 0], direction: [1, 0, 0], normal: [0, 0, 1], radius_mm: 1, "
                "path: [{line_mm: 8}, {arc: {radius_mm: 12, angle_deg: 90}}, {line_mm: 12}]}",
                "[0.5, 0, 0]");
    run_reports("", tip);
    for (size_t k = 0; k < sizeof kinds / sizeof kinds[0]; k++) {
        char arguments[100];
        snprintf(arguments, sizeof arguments, "run scene.yaml --quiet --contact %s --summary s.json", kinds[k]);
        int code = run(arguments);
        if (without_embree())
            continue;
        assert_int_equal(code, 0);
        tip_of(other);
        print_message("%s: tip %.4f mm from the exact tube's\n", kinds[k], between(tip, other));
        assert_true(between(tip, other) < 0.1);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_bad_mesh_is_reported_and_repaired_or_refused),
        cmocka_unit_test(a_mesh_that_cannot_be_the_vessel_is_refused),
        cmocka_unit_test(all_surfaces_of_a_tube_hold_the_same_wire),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
