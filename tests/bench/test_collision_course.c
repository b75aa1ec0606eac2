// Points that creep along a wall, on an exact tube: gaps, steps and places as promised; the error that is found is the one that was put in.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "bench/bench.h"
#include "bench/collision_course.h"
#include "sim/tube_tree.h"

#include <stdlib.h>

enum { POINTS = 60, STEPS = 25 };
static const TubePiece piece[] = {{.length = 15}, {.arc_radius = 6, .angle = 2}, {.arc_radius = 7, .angle = 2.5, .plane = 1}, {.length = 12}};

int64_t bench_cpu_ns(void)
{
    static int64_t now;      // courses are timed with it: here a query takes what the number of calls says
    return now += 1000000;
}

static Vessel *tube(double radius, bool closed)
{
    static Faults faults;
    TubeOptions options = {.direction = {1, 0, 0}, .normal = {0, 1, 0}, .radius = radius, .piece_count = 4, .piece = piece, .closed_ends = closed};
    Vessel *v = tube_vessel_create(&options, "test", &faults);
    assert_non_null(v);
    return v;
}

static VesselTree *nodes_of(const Vessel *v, double radius, bool closed)
{
    static Faults faults;
    TubeOptions options = {.direction = {1, 0, 0}, .normal = {0, 1, 0}, .radius = radius, .piece_count = 4, .piece = piece, .closed_ends = closed};
    VesselTree *tree = tube_tree(v, &options, "test", &faults);
    assert_non_null(tree);
    return tree;
}

static const Vec3 *places(const Course *c, int step) { return c->place + (size_t)step * (size_t)c->points; }

static void check_course(const Vessel *v, const Course *c)
{
    for (int s = 0; s < c->steps; s++)
        for (int p = 0; p < c->points; p++) {
            Vec3 x = places(c, s)[p];
            VesselMemory memory = {.node = v->locate(v, x, -1)};
            VesselHit hit;
            vessel_query(v, 1, &x, 1, &memory, &hit);
            assert_true(hit.gap > 0.048 && hit.gap < 0.152);
            assert_true(fabs(hit.gap - c->truth[s * c->points + p].gap) < 1e-9);
            assert_true(vec3_distance(hit.normal, c->truth[s * c->points + p].normal) < 1e-9);
            double step = s > 0 ? vec3_distance(x, places(c, s - 1)[p]) : 0.05;
            assert_true(step > 0.04 && step < 0.06);
        }
}

static void a_wire_creeps_along_the_wall(void **state)
{
    (void)state;
    Vessel *v = tube(1.5, false);
    VesselTree *tree = nodes_of(v, 1.5, false);
    Course c;
    assert_true(course_wire(v, tree, vec3(4, 1.2, 0.3), -1, POINTS, STEPS, &c));
    assert_true(c.points == POINTS && c.steps == STEPS && c.in_line);
    check_course(v, &c);
    for (int p = 0; p + 1 < POINTS; p++) {
        double apart = vec3_distance(places(&c, 0)[p], places(&c, 0)[p + 1]);
        assert_true(apart > 0.4 && apart < 0.55);
        assert_memory_equal(&places(&c, 10)[p], &places(&c, 0)[p + 1], sizeof(Vec3));    // half a millimetre on
    }
    // down the tube: the axis's place next to the points moves on
    assert_true(places(&c, 0)[0].x < 4.5 && places(&c, 0)[20].x > 12);
    course_free(&c);
    assert_null(c.place);
    vessel_tree_free(tree);
    v->destroy(v);
}

static void a_wire_turns_at_a_blind_end(void **state)
{
    (void)state;
    Vessel *v = tube(1.5, true);
    VesselTree *tree = nodes_of(v, 1.5, true);
    Course c;
    assert_true(course_wire(v, tree, vec3(4, 1.2, 0.3), -1, 160, 5, &c));     // 80 mm of wire in 56 mm of tube
    check_course(v, &c);
    course_free(&c);
    vessel_tree_free(tree);
    v->destroy(v);
}

static void points_start_all_over(void **state)
{
    (void)state;
    Vessel *v = tube(1.5, false);
    VesselTree *tree = nodes_of(v, 1.5, false);
    // the samples of the tree as the vertices of a mesh
    TriangleMesh mesh = {.vertex_count = (int)tree->point_count, .vertex = tree->point};
    Course c;
    assert_true(course_all_over(v, tree, &mesh, POINTS, 5, &c));
    assert_false(c.in_line);
    check_course(v, &c);
    bool first = false, last = false;
    for (int p = 0; p < POINTS; p++) {
        first |= vec3_distance(places(&c, 0)[p], tree->center[0]) < 5;
        last |= vec3_distance(places(&c, 0)[p], tree->center[tree->node_count - 1]) < 5;
    }
    assert_true(first && last);
    course_free(&c);
    vessel_tree_free(tree);
    v->destroy(v);
}

static void the_error_is_what_was_put_in(void **state)
{
    (void)state;
    Vessel *v = tube(1.5, false), *wider = tube(1.51, false);
    VesselTree *tree = nodes_of(v, 1.5, false);
    Course c;
    CourseError e;
    assert_true(course_wire(v, tree, vec3(4, 1.2, 0.3), -1, POINTS, STEPS, &c));
    assert_true(course_error(v, &c, &e));
    assert_true(e.gap_max_um < 1e-9 && e.normal_max_deg < 1e-9 && e.flagged == 0);
    assert_true(course_error(wider, &c, &e));
    assert_true(fabs(e.gap_rms_um - 10) < 1e-6 && fabs(e.gap_max_um - 10) < 1e-6 && e.normal_max_deg < 1e-6);
    // half of the truth turned by a tenth of a degree
    for (int k = 0; k < POINTS * STEPS; k += 2) {
        Vec3 *n = &c.truth[k].normal, across = vec3_normal_to(*n);
        *n = vec3_unit(vec3_add_scaled(*n, tan(0.1 * PI / 180), across));
    }
    assert_true(course_error(v, &c, &e));
    assert_true(fabs(e.normal_max_deg - 0.1) < 1e-6 && fabs(e.normal_rms_deg - 0.1 * sqrt(0.5)) < 1e-6);
    course_free(&c);
    vessel_tree_free(tree);
    wider->destroy(wider);
    v->destroy(v);
}

static void time_is_shared_by_all_queries(void **state)
{
    (void)state;
    Vessel *v = tube(1.5, false);
    VesselTree *tree = nodes_of(v, 1.5, false);
    Course c[2];
    for (int k = 0; k < 2; k++)
        assert_true(course_wire(v, tree, vec3(4 + 3 * k, 1.2, 0.3), -1, POINTS, STEPS, &c[k]));
    // a pass lies between two calls of the clock, a millisecond
    assert_true(fabs(course_ns(v, 1, c, 3) - 1e6 / (POINTS * STEPS)) < 1e-6);
    assert_true(fabs(course_ns(v, 2, c, 3) - 1e6 / (2 * POINTS * STEPS)) < 1e-6);
    course_free(&c[0]);
    course_free(&c[1]);
    vessel_tree_free(tree);
    v->destroy(v);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(a_wire_creeps_along_the_wall), cmocka_unit_test(a_wire_turns_at_a_blind_end),
                                       cmocka_unit_test(points_start_all_over), cmocka_unit_test(the_error_is_what_was_put_in),
                                       cmocka_unit_test(time_is_shared_by_all_queries)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
