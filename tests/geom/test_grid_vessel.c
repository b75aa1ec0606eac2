// A sampled distance compared with the sampled vessel: orders of convergence; the side of a point at any distance; open ends; memory; rotated, mirrored and
// scaled vessels; touching walls; bad options.
#include "geom/grid_vessel.h"
#include "random_numbers.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include <cmocka.h>

#include "near.h"

enum { BALLS = 40 };
typedef struct Sampled {
    Vessel *exact, *grid;
    TriangleMesh *surface;
    double radius;
    Vec3 center[BALLS];
} Sampled;

static Vessel *grid_of(const Vessel *exact, const TriangleMesh *surface, double cell, double band)
{
    Faults faults = {0};
    GridVesselOptions o = {.cell_mm = cell, .band_mm = band};
    Vessel *grid = grid_vessel_create(exact, surface, &o, "test", &faults);
    assert_int_equal(faults.count, 0);
    assert_non_null(grid);
    assert_true(grid->primitives > 0 && grid->bytes > (size_t)grid->primitives * sizeof(float));
    return grid;
}

// A quarter turn between two straights.
static Sampled *sample_bend(Vec3 direction, Vec3 normal, bool closed, double scale, double cell, double band)
{
    Faults faults = {0};
    Sampled *s = malloc(sizeof *s);
    TubePiece piece[3] = {{3 * scale, 0, 0, 0}, {0, 3 * scale, PI / 2, 0}, {3 * scale, 0, 0, 0}};
    Vec3 t = vec3_unit(direction), n = vec3_unit(vec3_add_scaled(normal, -vec3_dot(normal, t), t)), p = vec3_scale(vec3(0.13, -0.21, 0.34), scale);
    TubeOptions o = {.start = p, .direction = t, .normal = n, .radius = scale, .piece_count = 3, .piece = piece, .closed_ends = closed};
    s->exact = tube_vessel_create(&o, "test", &faults);
    assert_non_null(s->exact);
    double reach[BALLS], arc = 3 * PI / 2, length = 6 + arc;
    s->radius = scale;
    for (int i = 0; i < BALLS; i++) {
        double at = length * i / (BALLS - 1), angle = fmin(fmax((at - 3) / 3, 0), PI / 2), before = fmin(at, 3), after = fmax(at - 3 - arc, 0);
        s->center[i] = vec3_add_scaled(vec3_add_scaled(p, scale * (before + 3 * sin(angle)), t), scale * (3 * (1 - cos(angle)) + after), n);
        reach[i] = 1.4 * scale;
    }
    s->surface = isosurface_of_vessel(s->exact, BALLS, s->center, reach, NULL, 0.2 * scale);
    assert_non_null(s->surface);
    s->grid = grid_of(s->exact, s->surface, cell * scale, band * scale);
    return s;
}

static void free_sampled(Sampled *s)
{
    s->exact->destroy(s->exact);
    s->grid->destroy(s->grid);
    triangle_mesh_free(s->surface);
    free(s);
}

static VesselHit ask(const Vessel *vessel, Vec3 x, double reach)
{
    VesselMemory memory = {.node = -1};
    VesselHit hit;
    vessel_query(vessel, 1, &x, reach, &memory, &hit);
    return hit;
}

typedef struct Errors {
    double gap, normal, rms_gap, rms_normal;     // largest, and root mean square
    int count;
} Errors;

// At points within `within` of the wall, some radii from the ends.
static Errors errors_of(const Sampled *s, double within)
{
    Errors e = {0};
    uint64_t seed = 11;
    while (e.count < 20000) {
        int k = (int)random_in(&seed, 6, BALLS - 6);
        Vec3 x = vec3_add(s->center[k], random_in_box(&seed, 1.4 * s->radius));
        VesselHit exact = ask(s->exact, x, 1e9), hit;
        if (fabs(exact.gap) > within)
            continue;
        hit = ask(s->grid, x, 1e9);
        assert_int_equal(hit.flags, 0);
        assert_near(vec3_norm(hit.normal), 1, 1e-12);
        double gap = fabs(hit.gap - exact.gap), normal = vec3_distance(hit.normal, exact.normal);
        e.gap = fmax(e.gap, gap);
        e.normal = fmax(e.normal, normal);
        e.rms_gap += gap * gap;
        e.rms_normal += normal * normal;
        e.count++;
    }
    e.rms_gap = sqrt(e.rms_gap / e.count);
    e.rms_normal = sqrt(e.rms_normal / e.count);
    return e;
}

// Bound for linear interpolation of a distance whose curvatures are at most 1 / (r - gap), r = 1, at one cell more depth.
static void check_bounds(const Errors *e, double cell, double within)
{
    double curvature = 1 / (1 - within - cell);
    assert_true(e->gap < 0.5 * cell * cell * curvature);
    assert_true(e->normal < cell * curvature);
}

static void converges(void **state)
{
    (void)state;
    Errors e[3];
    for (int i = 0; i < 3; i++) {
        Sampled *s = sample_bend(vec3(1, 0.4, -0.3), vec3(0, 1, 0.2), true, 1, 0.2 / (1 << i), 0.5);
        e[i] = errors_of(s, 0.45);
        check_bounds(&e[i], 0.2 / (1 << i), 0.45);
        free_sampled(s);
    }
    for (int i = 0; i < 2; i++) {   // half the cell: a quarter of the gap's error, half of the normal's
        assert_true(fabs(e[i].rms_gap / e[i + 1].rms_gap - 4) < 0.4);
        assert_true(fabs(e[i].rms_normal / e[i + 1].rms_normal - 2) < 0.2);
    }
}

static void turned_and_scaled(void **state)
{
    (void)state;
    uint64_t seed = 5;
    for (int trial = 0; trial < 8; trial++) {
        double scale = trial % 4 == 1 ? 0.01 : trial % 4 == 2 ? 1000 : 1;
        Vec3 n = trial == 3 ? vec3(0, -1, 0) : trial == 0 ? vec3(0, 1, 0) : random_unit_vector(&seed);
        Sampled *s = sample_bend(trial % 4 == 0 || trial == 3 ? vec3(1, 0, 0) : random_unit_vector(&seed), n, true, scale, 0.1, 0.5);
        Errors e = errors_of(s, 0.45 * scale);
        e.gap /= scale;
        check_bounds(&e, 0.1, 0.45);
        free_sampled(s);
    }
}

// Where the exact gap is far from zero, the grid always gives the right side, and its value is a bound.
static void sides_are_right(void **state)
{
    (void)state;
    uint64_t seed = 7;
    for (int trial = 0; trial < 4; trial++) {
        // cells so small that whole blocks lie within the lumen
        double cell = trial % 2 ? 0.03 : 0.11, band = trial % 2 ? 0.1 : 0.3, reach = trial < 2 ? 1e9 : 0.05;
        Sampled *s = sample_bend(random_unit_vector(&seed), random_unit_vector(&seed), true, 1, cell, band);
        int inside = 0, outside = 0, far = 0, unsure = 0;
        for (int i = 0; i < 40000; i++) {
            Vec3 x = vec3_add(s->center[(int)random_in(&seed, 0, BALLS)], random_in_box(&seed, i % 3 ? 1.1 : i % 2 ? 5 : 200));
            VesselHit exact = ask(s->exact, x, 1e9), hit = ask(s->grid, x, reach);
            inside += exact.gap > 0, outside += exact.gap < 0, far += (hit.flags & VESSEL_FAR) != 0, unsure += (hit.flags & VESSEL_UNSURE) != 0;
            assert_int_equal(hit.flags & VESSEL_OPEN_END, 0);
            if (hit.flags & VESSEL_FAR)
                assert_true(hit.gap <= exact.gap + cell * cell && hit.gap >= fmin(band, reach));
            else if (hit.flags & VESSEL_UNSURE)
                assert_true(hit.gap == -band && exact.gap < -band + cell * cell);
            else
                assert_near(hit.gap, exact.gap, cell);   // up to the kink on the centreline
        }
        assert_true(inside > 1000 && outside > 10000 && unsure > 10000 && far > (trial == 0 ? -1 : 300));
        free_sampled(s);
    }
}

// A wire that leaves through the bell finds no wall outside; upstream the lumen continues.
static void open_ends(void **state)
{
    (void)state;
    Sampled *s = sample_bend(vec3(1, 0.2, 0.1), vec3(0, 1, 0.3), false, 1, 0.1, 0.3);
    Vec3 in = vec3_unit(vec3_sub(s->center[0], s->center[1])), out = vec3_unit(vec3_sub(s->center[BALLS - 1], s->center[BALLS - 2]));
    for (double step = 0; step < 60; step += 0.05) {
        VesselHit hit = ask(s->grid, vec3_add_scaled(s->center[BALLS - 1], step, out), 0.2);
        assert_true(hit.gap > 0.2);
        assert_int_equal(hit.flags & VESSEL_UNSURE, 0);
        if (step > 10)
            assert_int_equal(hit.flags, VESSEL_OPEN_END);
    }
    for (double step = 0; step < 2; step += 0.05) {
        VesselHit hit = ask(s->grid, vec3_add_scaled(s->center[0], step, in), 0.2);
        assert_true(hit.gap > 0.2);
    }
    // a point beside the tube is outside
    Vec3 aside = vec3_normal_to(in);
    for (double step = 1.4; step < 5; step += 0.1) {
        VesselHit hit = ask(s->grid, vec3_add_scaled(s->center[5], step, aside), 0.2);
        assert_true(hit.gap <= -0.3 + 0.01);
    }
    free_sampled(s);
}

// The memory of a point saves time and changes only results that are bounds; bounds stay bounds.
static void memory_changes_nothing(void **state)
{
    (void)state;
    Sampled *s = sample_bend(vec3(0.3, 1, 0.1), vec3(1, 0, 0), true, 1, 0.1, 0.4);
    uint64_t seed = 2;
    Vec3 x = s->center[10];
    VesselMemory memory = {.node = -1};
    int far = 0, near = 0;
    for (int i = 0; i < 50000; i++) {
        Vec3 step = vec3_scale(random_unit_vector(&seed), i % 50 ? 0.01 : 0.3), next = vec3_add(x, step);
        if (ask(s->exact, next, 1e9).gap > -0.2)
            x = next;
        VesselHit warm, fresh = ask(s->grid, x, 0.15), exact = ask(s->exact, x, 1e9);
        vessel_query(s->grid, 1, &x, 0.15, &memory, &warm);
        far += (warm.flags & VESSEL_FAR) != 0, near += warm.flags == 0;
        if (warm.flags & VESSEL_FAR) {
            assert_true(warm.gap > 0.15 - 1e-12 && warm.gap < exact.gap + 0.01);
            continue;
        }
        assert_int_equal(warm.flags, fresh.flags);
        assert_true(warm.gap == fresh.gap && vec3_distance(warm.normal, fresh.normal) == 0);
    }
    assert_true(far > 1000 && near > 1000);
    VesselHit hit = ask(s->grid, vec3(NAN, 0, 0), 1);
    assert_int_equal(hit.flags, VESSEL_UNSURE);
    hit = ask(s->grid, vec3(1e300, -1e300, 3), 1);
    assert_true(hit.flags == VESSEL_UNSURE && hit.gap == -0.4);
    Vec3 p, d;
    assert_false(s->grid->inlet(s->grid, &p, &d));
    Faults faults = {0};
    GridVesselOptions o = {.cell_mm = 0.2, .band_mm = 0.4, .has_inlet = true, .inlet = {1, 2, 3}, .direction = {0, 1, 0}};
    Vessel *grid = grid_vessel_create(s->exact, s->surface, &o, "test", &faults);
    assert_true(grid->inlet(grid, &p, &d) && p.y == 2 && d.y == 1);
    assert_int_equal(grid->locate(grid, p, -1), 0);
    grid->destroy(grid);
    free_sampled(s);
}

// Two legs of a hairpin, 0.2 mm from wall to wall: each side has its own wall.
static void kissing_legs(void **state)
{
    (void)state;
    Faults faults = {0};
    TubePiece piece[3] = {{4, 0, 0, 0}, {0, 1.1, PI, 0}, {4, 0, 0, 0}};
    TubeOptions o = {.direction = {0.3, 1, 0.2}, .normal = {1, 0, 0.4}, .radius = 1, .piece_count = 3, .piece = piece, .closed_ends = true};
    Vessel *exact = tube_vessel_create(&o, "test", &faults);
    Vec3 t = vec3_unit(o.direction), n = vec3_unit(vec3_add_scaled(o.normal, -vec3_dot(o.normal, t), t)), center[30];
    double reach[30];
    for (int i = 0; i < 30; i++) {
        center[i] = i < 15 ? vec3_scale(t, 0.38 * i) : vec3_add_scaled(vec3_scale(t, 0.38 * (i - 15)), 2.2, n);
        reach[i] = 1.5;
    }
    TriangleMesh *surface = isosurface_of_vessel(exact, 30, center, reach, NULL, 0.1);
    Vessel *grid = grid_of(exact, surface, 0.05, 0.3);
    for (double at = 0.2; at < 3.8; at += 0.01)
        for (double across = 0.5; across < 1.7; across += 0.013) {
            Vec3 x = vec3_add_scaled(vec3_scale(t, at), across, n);
            double gap = across < 1.1 ? 1 - across : across - 1.2;
            assert_near(ask(grid, x, 1e9).gap, gap, 0.03);   // at the middle of the wall the distance has a kink: half a cell
        }
    grid->destroy(grid);
    exact->destroy(exact);
    triangle_mesh_free(surface);
}

static void bad_options(void **state)
{
    (void)state;
    Sampled *s = sample_bend(vec3(1, 0, 0), vec3(0, 1, 0), true, 1, 0.2, 0.4);
    GridVesselOptions good = {.cell_mm = 0.2, .band_mm = 0.4, .has_inlet = true, .direction = {1, 0, 0}}, bad[9];
    for (int i = 0; i < 9; i++)
        bad[i] = good;
    bad[0].cell_mm = 0, bad[1].cell_mm = NAN, bad[2].cell_mm = -1, bad[3].band_mm = 0.39, bad[4].band_mm = NAN, bad[5].band_mm = HUGE_VAL;
    bad[6].direction = vec3(1, 1, 0), bad[7].inlet.x = NAN, bad[8].cell_mm = 1e-7;   // the last: more cells than the lattice has
    for (int i = 0; i < 9; i++) {
        Faults faults = {0};
        assert_null(grid_vessel_create(s->exact, s->surface, &bad[i], "test", &faults));
        assert_int_equal(faults.count, 1);
    }
    Faults faults = {0};
    TriangleMesh empty = {0};
    assert_null(grid_vessel_create(s->exact, &empty, &good, "test", &faults));
    assert_int_equal(faults.count, 1);
    Vec3 was = s->surface->vertex[3];
    s->surface->vertex[3].y = NAN;
    assert_null(grid_vessel_create(s->exact, s->surface, &good, "test", &faults));
    for (int axis = 0; axis < 3; axis++) {      // beyond the lattice along one axis
        double far[3] = {1, 1, 1};
        far[axis] = axis == 1 ? -1e9 : 1e9;
        s->surface->vertex[3] = vec3(far[0], far[1], far[2]);
        assert_null(grid_vessel_create(s->exact, s->surface, &good, "test", &faults));
    }
    s->surface->vertex[3] = was;
    int v = s->surface->triangle[7][1];
    s->surface->triangle[7][1] = s->surface->vertex_count;
    assert_null(grid_vessel_create(s->exact, s->surface, &good, "test", &faults));
    s->surface->triangle[7][1] = v;
    assert_int_equal(faults.count, 6);
    free_sampled(s);
}

static double seconds(void)
{
    struct timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void cost(void **state)
{
    (void)state;
    double a = seconds();
    Sampled *s = sample_bend(vec3(0.3, 1, 0.1), vec3(1, 0, 0), true, 1, 0.05, 0.3);
    double b = seconds();
    enum { POINTS = 80, STEPS = 2000 };
    Vec3 x[POINTS];
    VesselMemory memory[POINTS];
    VesselHit hit[POINTS];
    for (int i = 0; i < POINTS; i++) {
        x[i] = vec3_add(s->center[i / 2], vec3(0.3, -0.4, 0.7 * (i & 1)));
        memory[i] = (VesselMemory){.node = -1};
    }
    double c = seconds();
    for (int k = 0; k < STEPS; k++) {
        for (int i = 0; i < POINTS; i++)
            x[i].x += 1e-4;
        vessel_query(s->grid, POINTS, x, 1e9, memory, hit);
    }
    double d = seconds();
    print_message("%lld lattice points, %.1f MB, made in %.2f s; a query %.0f ns\n", (long long)s->grid->primitives, 1e-6 * (double)s->grid->bytes, b - a,
                  1e9 * (d - c) / (POINTS * STEPS));
    free_sampled(s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(converges),
        cmocka_unit_test(turned_and_scaled),
        cmocka_unit_test(sides_are_right),
        cmocka_unit_test(open_ends),
        cmocka_unit_test(memory_changes_nothing),
        cmocka_unit_test(kissing_legs),
        cmocka_unit_test(bad_options),
        cmocka_unit_test(cost),
    };
    return cmocka_run_group_tests_name("grid_vessel", tests, NULL, NULL);
}
