// The inlet of a surface without given centrelines: open tubes with a stenosis near the inlet, tapered, flared, cut obliquely, rotated and mirrored have an
// open root; a capsule's rounded end is closed.
#include "recon/phantom/phantom.h"
#include "recon/surface/import_surface.h"
#include "recon/surface/mesh_centreline.h"
#include "tests/short_run.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

enum { RING = 28, RINGS = 97 };

typedef struct Tube {
    const char *name;
    double stenosis_at, stenosis;    // [radii] distance from the inlet; least radius as a fraction of the normal one; 1: no stenosis
    double taper, flare;             // relative radius at the far end; at the inlet, over the first 1.5 radii
    double oblique_deg;              // angle of the inlet's cut
    int first, last;                 // range of variants: bit 0 rotated, bit 1 mirrored
} Tube;

static Faults faults;

static Vec3 placed(Vec3 p, int variant)
{
    if (variant & 1)
        p = vec3(17 - (0.8 * p.y - 0.6 * p.z), 5 + 0.6 * p.y + 0.8 * p.z, -3 + p.x);   // rotated about an axis oblique to the grid
    if (variant & 2)
        p.x = -p.x;
    return p;
}

static double radius_at(const Tube *t, double s, double length)
{
    double r = 1 + (t->taper - 1) * s / length, d = (s - t->stenosis_at) / 0.8;
    r *= 1 - (1 - t->stenosis) * exp(-d * d);
    r *= s < 1.5 ? 1 + (t->flare - 1) * (1 - s / 1.5) * (1 - s / 1.5) : 1;
    return 2 * r;    // mm
}

// A tube along a gentle arc with the inlet at s = 0, open at both ends.
static SurfaceMesh *make_tube(const Tube *t, int variant)
{
    double length = 12, bend = 30, slope = tan(t->oblique_deg * 3.14159265358979 / 180);
    SurfaceMesh *mesh = calloc(1, sizeof *mesh);
    mesh->vertex = malloc((RING * RINGS + 1) * sizeof *mesh->vertex);
    mesh->triangle = malloc((2 * RING * RINGS + RING) * sizeof *mesh->triangle);
    for (int i = 0; i < RINGS; i++)
        for (int k = 0; k < RING; k++) {
            double s = length * i / (RINGS - 1), a = 2 * 3.14159265358979 * k / RING, r = radius_at(t, s, length);
            double shift = slope * r / 2 * cos(a) * fmax(0, 1 - s / 4), way = 2 * (s + shift);   // [mm]; the oblique cut fades out along the tube
            double angle = way / bend;
            Vec3 c = vec3(bend * (1 - cos(angle)), 0, bend * sin(angle)), e1 = vec3(cos(angle), 0, -sin(angle));
            mesh->vertex[mesh->vertex_count++] = placed(vec3_add(vec3_add_scaled(c, r * cos(a), e1), vec3(0, r * sin(a), 0)), variant);
        }
    for (int i = 0; i + 1 < RINGS; i++)
        for (int k = 0; k < RING; k++) {
            int a = i * RING + k, b = i * RING + (k + 1) % RING, c = a + RING, d = b + RING;
            memcpy(mesh->triangle[mesh->triangle_count++], (int[3]){a, b, c}, sizeof(int[3]));
            memcpy(mesh->triangle[mesh->triangle_count++], (int[3]){b, d, c}, sizeof(int[3]));
        }
    MeshCheck check;
    assert_true(mesh_repair(mesh, &check));
    return mesh;
}

static void check_tube(const Tube *t, int variant, int *wrong)
{
    SurfaceMesh *mesh = make_tube(t, variant);
    ImportOptions options = import_default_options();
    ImportReport report = {0};
    faults_clear(&faults);
    options.has_root = true;
    options.root = placed(vec3(0, 0, 0), variant);
    CurveSet *set = mesh_centreline(mesh, &options, &report, t->name, &faults);
    VesselTree *tree = set ? import_surface(mesh, set, &options, &report, t->name, &faults) : NULL;
    double off = tree ? vec3_distance(tree->center[0], options.root) / 2 : INFINITY;
    bool good = tree && report.root_is_open && off < 1.5 && report.open_end_count == 2;
    print_message("%-46s %d: %s, root %.2f radii off, radius %.2f mm, %d open ends, %d nodes%s\n", t->name, variant,
                  !tree                 ? faults.text[0]
                  : report.root_is_open ? "open"
                                        : "closed",
                  off, tree ? tree->radius[0] : 0, report.open_end_count, tree ? tree->node_count : 0, good ? "" : "  <-- wrong");
    *wrong += !good;
    vessel_tree_free(tree);
    curve_set_free(set);
    surface_free(mesh);
}

static void inlets(void **state)
{
    (void)state;
    static const Tube tubes[] = {
        {"plain", 0, 1, 1, 1, 0, 0, 1},
        {"stenosis to a half, 2 radii in", 2, 0.5, 1, 1, 0, 2, 3},
        {"stenosis to a tenth, 2 radii in", 2, 0.1, 1, 1, 0, 3, 3},
        {"stenosis to a tenth, 2 radii in", 2, 0.1, 1, 1, 0, 0, 0},
        {"tapered to a third", 0, 1, 0.33, 1, 0, 1, 2},
        {"flared to twice", 0, 1, 1, 2, 0, 1, 1},
        {"cut at 50 degrees", 0, 1, 1, 1, 50, 1, 1},
        {"stenosis to a fifth, flared, cut at 30 degrees", 2.5, 0.2, 1, 1.6, 30, 0, 0},
        {"stenosis to a tenth, tapered, cut at 45 degrees", 2.5, 0.1, 0.5, 1, 45, 3, 3},
    };
    int wrong = 0;
    for (size_t i = WHOLE_OR_SHORT(0, 1); i < sizeof tubes / sizeof tubes[0]; i += WHOLE_OR_SHORT(1, 3))
        for (int variant = tubes[i].first; variant <= WHOLE_OR_SHORT(tubes[i].last, tubes[i].first); variant++)
            check_tube(&tubes[i], variant, &wrong);
    assert_int_equal(wrong, 0);
}

static void a_rounded_end_is_closed(void **state)
{
    (void)state;
    static const char *const names[] = {"capsule", "open-capsule"};
    for (int i = 0; i < 2; i++) {
        faults_clear(&faults);
        VesselTree *tree = shape_tree(names[i], 0, NULL, "test", &faults);
        assert_non_null(tree);
        assert_int_equal(vessel_tree_root_is_open(tree), i);
        vessel_tree_free(tree);
    }
}

// A cone along z, 4 mm wide and rounded at one end, `narrow` and open at the other.
static SurfaceMesh *make_cone(double narrow)
{
    const double wide = 4, length = 60;
    SurfaceMesh *mesh = calloc(1, sizeof *mesh);
    mesh->vertex = malloc((RING * RINGS + 1) * sizeof *mesh->vertex);
    mesh->triangle = malloc((2 * RING * RINGS + RING) * sizeof *mesh->triangle);
    mesh->vertex[mesh->vertex_count++] = vec3(0, 0, -wide);
    for (int i = 0; i < RINGS; i++) {
        enum { ROUND = 12 };         // rings of the hemisphere
        const double angle = 0.5 * 3.14159265358979 * (i + 1) / ROUND, part = (double)(i - ROUND + 1) / (RINGS - ROUND);
        const double r = i < ROUND ? wide * sin(angle) : wide + (narrow - wide) * part, z = i < ROUND ? -wide * cos(angle) : length * part;
        for (int k = 0; k < RING; k++) {
            const double a = 2 * 3.14159265358979 * k / RING;
            mesh->vertex[mesh->vertex_count++] = vec3(r * cos(a), r * sin(a), z);
            const int at = 1 + i * RING + k, next = 1 + i * RING + (k + 1) % RING;
            if (i == 0)
                memcpy(mesh->triangle[mesh->triangle_count++], (int[3]){0, next, at}, sizeof(int[3]));
            else {
                memcpy(mesh->triangle[mesh->triangle_count++], (int[3]){at - RING, next - RING, at}, sizeof(int[3]));
                memcpy(mesh->triangle[mesh->triangle_count++], (int[3]){next - RING, next, at}, sizeof(int[3]));
            }
        }
    }
    MeshCheck check;
    assert_true(mesh_repair(mesh, &check));
    return mesh;
}

static VesselTree *tree_of(SurfaceMesh *mesh, const ImportOptions *options, ImportReport *report)
{
    faults_clear(&faults);
    *report = (ImportReport){0};
    CurveSet *set = mesh_centreline(mesh, options, report, "cone", &faults);
    VesselTree *tree = set ? import_surface(mesh, set, options, report, "cone", &faults) : NULL;
    if (!tree)
        fail_msg("%s", faults.text[0]);
    curve_set_free(set);
    return tree;
}

// The only open end is the root, and the report says where a wider closed one is; --root there opens it.
static void a_wider_closed_end_is_reported(void **state)
{
    (void)state;
    ImportReport report;
    ImportOptions options = import_default_options();
    SurfaceMesh *mesh = make_cone(2);
    vessel_tree_free(tree_of(mesh, &options, &report));
    assert_true(report.root_is_open && fabs(report.root.z - 60) < 2);
    assert_true(fabs(report.root_radius - 2) < 0.2 && fabs(report.closed_radius - 4) < 0.4);
    assert_true(hypot(report.closed.x, report.closed.y) < 1 && report.closed.z < 4);      // in the rounded end
    options.has_root = true;
    options.root = report.closed;
    vessel_tree_free(tree_of(mesh, &options, &report));
    assert_true(report.root_is_open && report.root_is_cut && report.root.z < 5 && report.closed_radius <= 0);
    surface_free(mesh);
    // as wide: nothing to say
    options.has_root = false;
    mesh = make_cone(3.6);
    vessel_tree_free(tree_of(mesh, &options, &report));
    assert_true(report.root_is_open && report.closed_radius <= 0);
    surface_free(mesh);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(inlets), cmocka_unit_test(a_rounded_end_is_closed), cmocka_unit_test(a_wider_closed_end_is_reported)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
