// Contact with a field of shared blobs. A foot is the closest point on the wall. Tests: exact walls; the lanes compared with a plain implementation on every
// instruction set; derivatives; tracked feet compared with feet found without a start; the same wall across cells; touching vessels; the inlet; motion and
// mirroring of the scene; places without a field; no heap calls.
#include "blob_tube.h"
#include "field_line.h"
#include "geom/field_lanes.h"
#include "geom/power_walk.h"
#include "geom/vessel.h"
#include "random_numbers.h"
#include "tests/short_run.h"

#include <malloc.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "near.h"

enum { NODES = 60, OVER = 3 };

static VesselTree *helix(int extra)
{
    Vec3 line[NODES + 2 * OVER];
    helix_line(line, NODES + 2 * OVER, 6, 9, 0.7);
    return field_tree_along(line, NODES, OVER, 1, extra, 21);
}

static VesselTree *straight(int nodes, double spacing)
{
    Vec3 line[128];
    for (int i = 0; i < nodes + 2 * OVER; i++)
        line[i] = vec3(spacing * (i - OVER), 0, 0);
    return field_tree_along(line, nodes, OVER, 1, 0, 1);
}

static Vessel *make(const VesselTree *tree, int isa)
{
    Vessel *v = field_vessel_create_with(tree, isa);
    assert_non_null(v);
    return v;
}

static VesselHit ask(const Vessel *v, Vec3 x, int from, double reach)
{
    VesselMemory memory = {.node = from};
    VesselHit hit;
    vessel_query(v, 1, &x, reach, &memory, &hit);
    return hit;
}

static bool same_hit(const VesselHit *a, const VesselHit *b)
{
    return memcmp(&a->gap, &b->gap, sizeof a->gap) == 0 && memcmp(&a->normal, &b->normal, sizeof a->normal) == 0 &&
           memcmp(&a->hessian, &b->hessian, sizeof a->hessian) == 0 && a->node == b->node && a->flags == b->flags;
}

// A tool of points that move along the tree, at most about `aside` from its axis.
static Vec3 wander(const VesselTree *t, uint64_t *seed, int step, int steps, Vec3 x, double stride)
{
    double s = (double)step / steps * (t->node_count - 6.001) + 3;
    int k = (int)s;
    Vec3 axis = vec3_mix(t->center[k], t->center[k + 1], s - k), out = vec3_scale(vec3_sub(x, axis), 0.98);
    return vec3_add(vec3_add(axis, out), random_in_box(seed, stride));
}

// --- exact walls ---

static void one_blob_is_a_sphere(void **state)
{
    (void)state;
    VesselTree *t = vessel_tree_create_shared(1, 0, 1);
    t->center[0] = t->blob_center[0] = vec3(1, 2, 3);
    t->radius[0] = 2;
    t->direction[0] = vec3(-1, 0, 0);
    t->parent[0] = -1;
    t->blob_width[0] = 4;
    t->blob_amplitude[0] = 1 / (0.75 * 0.75 * 0.75);     // u = 3/4 at d = 2
    t->blob_offset[1] = 1;
    assert_true(vessel_tree_link(t));
    Vessel *v = make(t, 0);
    uint64_t seed = 14;
    for (int trial = 0; trial < 1000; trial++) {
        Vec3 u = random_unit_vector(&seed);
        double d = random_in(&seed, 0.3, trial % 2 ? 2.5 : 30);
        u.x = u.x > -0.6 ? -0.6 - fabs(u.x) : u.x;   // downstream of the inlet, which looks along -x
        u = vec3_unit(u);
        VesselHit hit = ask(v, vec3_add_scaled(t->center[0], d, u), 0, 100);
        assert_int_equal(hit.flags, 0);
        assert_near(hit.gap, 2 - d, 1e-8 * (1 + d) * (1 + d));    // at large distances the error of the normal counts
        assert_true(vec3_distance(hit.normal, vec3_negate(u)) < 1e-5);
        if (d > 0.4)
            assert_near(sym3_quadratic(&hit.hessian, vec3_normal_to(u)) * d, -1, 1e-4);   // of the last evaluation
    }
    v->destroy(v);
    vessel_tree_free(t);
}

// A straight row of equal blobs is a tube with waves, whose amplitude falls quickly as the blobs get closer.
static void row_becomes_a_tube(void **state)
{
    (void)state;
    double worst[3] = {0};
    static const double spacing[] = {1, 0.75, 0.5};
    for (int k = 0; k < 3; k++) {
        VesselTree *t = straight(60, spacing[k]);
        Vessel *v = make(t, 0);
        for (int i = 0; i < 300; i++) {
            double s = 5 + 0.05 * i, angle = 0.7 * i;
            VesselHit hit = ask(v, vec3(s, 0.8 * cos(angle), 0.8 * sin(angle)), -1, 5);
            assert_int_equal(hit.flags, 0);
            worst[k] = fmax(worst[k], fabs(hit.gap - 0.2));
        }
        v->destroy(v);
        vessel_tree_free(t);
    }
    print_message("a row of blobs 1, 0.75, 0.5 r apart is a tube to %.1e, %.1e, %.1e r\n", worst[0], worst[1], worst[2]);
    assert_true(worst[0] < 5e-2 && worst[1] < 0.5 * worst[0] && worst[2] < 0.3 * worst[1]);
}

// --- the plain implementation ---

// The expected result of a query, computed simply: feet from many starts by damped steps on the field of the foot's cell; the closest of them.
typedef struct Twin {
    double gap;
    Vec3 foot, normal;
    Sym3 hessian;
    int node;
} Twin;

static int twin_cell(const VesselTree *t, Vec3 q, int node)
{
    for (;;) {
        int best = node;
        for (int k = t->near_offset[node]; k < t->near_offset[node + 1]; k++)
            if (power_distance(q, t->center[t->near[k]], t->radius[t->near[k]]) < power_distance(q, t->center[best], t->radius[best]))
                best = t->near[k];
        if (best == node)
            return node;
        node = best;
    }
}

static Twin twin_of(const VesselTree *t, Vec3 x, int node)
{
    Twin best = {.gap = HUGE_VAL};
    uint64_t seed = 77;
    for (int trial = 0; trial < 60; trial++) {
        int cell = node;
        Vec3 start = vec3_add_scaled(x, trial == 0 ? 1e-3 : 1.2, random_unit_vector(&seed));
        SurfacePoint s = {.foot = start};
        for (int k = 0; k < 5; k++) {
            Blobby blobs = blobby_of(t, cell);
            s = blobby_project(&blobs, x, s.foot);
            int next = twin_cell(t, s.foot, cell);
            if (!s.converged || next == cell)
                break;
            cell = next;
        }
        if (!s.converged || fabs(s.distance) >= fabs(best.gap) - 1e-12)
            continue;
        Sym3 h = s.shape;
        // S (I + gap S)^-1 by its series' closed form in the plane across the normal
        Vec3 t1 = vec3_normal_to(s.normal), t2 = vec3_cross(s.normal, t1);
        double a = sym3_quadratic(&h, t1), c = sym3_quadratic(&h, t2), b = vec3_dot(t1, sym3_mul_vec(&h, t2)), g = s.distance;
        double det = (1 + g * a) * (1 + g * c) - g * g * b * b, flat = a * c - b * b;
        double ga = (a + g * flat) / det, gc = (c + g * flat) / det, gb = b / det;
        Sym3 hess = {0, 0, 0, 0, 0, 0};
        sym3_add_outer(&hess, ga, t1), sym3_add_outer(&hess, gc, t2);
        Vec3 plus = vec3_scale(vec3_add(t1, t2), sqrt(0.5)), minus = vec3_scale(vec3_sub(t1, t2), sqrt(0.5));
        sym3_add_outer(&hess, gb, plus), sym3_add_outer(&hess, -gb, minus);
        best = (Twin){s.distance, s.foot, s.normal, hess, cell};
    }
    return best;
}

// Points that move slowly along the wall; each result is compared with the plain implementation.
static void walks_against_twin(void **state)
{
    (void)state;
    VesselTree *t = helix(3);
    Vessel *v = make(t, 0);
    uint64_t seed = 15;
    int compared = 0, farther = 0, nearer = 0, fast[3] = {0};
    double worst = 0, turned = 0;
    for (int run = 0; run < 3; run++) {
        VesselMemory memory = {.node = -1};
        Vec3 x = t->center[3];
        for (int step = 0; step < 600; step++) {
            VesselHit hit;
            x = wander(t, &seed, step, 600, x, run == 0 ? 0.02 : run == 1 ? 0.08 : 0.3);
            vessel_query(v, 1, &x, 5, &memory, &hit);
            assert_true((hit.flags & (VESSEL_UNSURE | VESSEL_DISAGREE)) == 0);
            if (hit.flags & VESSEL_FAR || fabs(hit.gap) > 0.6)
                continue;
            Twin twin = twin_of(t, x, hit.node);
            compared++;
            fast[run]++;
            double differs = fabs(hit.gap) - fabs(twin.gap);
            farther += differs > 1e-6;
            nearer += differs < -1e-6;
            if (fabs(differs) > 1e-6)
                continue;
            worst = fmax(worst, fabs(differs));
            turned = fmax(turned, vec3_distance(hit.normal, twin.normal));
            Vec3 rest = vec3_sub(vec3_sub(x, memory.foot), vec3_scale(hit.normal, hit.gap));
            assert_true(vec3_norm(rest) < 1e-5);
        }
    }
    print_message("%d answers against the twin: %d farther, %d nearer, else gap to %.1e mm and normal to %.1e\n", compared, farther, nearer, worst, turned);
    assert_true(compared > 400 && farther == 0 && nearer <= 2);
    assert_true(worst < 1e-8 && turned < 1e-4);
    v->destroy(v);
    vessel_tree_free(t);
}

// --- bits ---

static void same_bits_on_every_isa(void **state)
{
    (void)state;
    enum { POINTS = 37 };
    VesselTree *t = helix(4);
    Vessel *v[3];
    static VesselMemory memory[3][POINTS];
    VesselHit hit[3][POINTS];
    Vec3 x[POINTS];
    uint64_t seed = 13;
    for (int i = 0; i < 3; i++)
        v[i] = make(t, i + 1);
    for (int k = 0; k < POINTS; k++) {
        x[k] = t->center[3];
        for (int i = 0; i < 3; i++)
            memory[i][k] = (VesselMemory){.node = -1};
    }
    for (int step = 0; step < 300; step++) {
        for (int k = 0; k < POINTS; k++)
            x[k] = wander(t, &seed, step, 300, x[k], k % 3 == 0 ? 0.3 : 0.08);
        for (int i = 0; i < 3; i++)
            vessel_query(v[i], POINTS, x, 0.5, memory[i], hit[i]);
        for (int k = 0; k < POINTS; k++)
            for (int i = 1; i < 3; i++) {
                assert_true(same_hit(&hit[0][k], &hit[i][k]));
                assert_true(memory[0][k].blobs == memory[i][k].blobs && memory[0][k].trust == memory[i][k].trust);
            }
    }
    for (int i = 0; i < 3; i++)
        v[i]->destroy(v[i]);
    vessel_tree_free(t);
}

// The result for a point depends neither on the other points of the query nor on the blobs in its memory.
static void alone_as_in_company(void **state)
{
    (void)state;
    enum { POINTS = 100 };
    VesselTree *t = helix(4);
    Vessel *v = make(t, 0);
    static VesselMemory together[POINTS], alone[POINTS];
    VesselHit hit[POINTS], one;
    Vec3 x[POINTS];
    uint64_t seed = 19;
    for (int k = 0; k < POINTS; k++) {
        x[k] = t->center[3];
        together[k] = alone[k] = (VesselMemory){.node = -1};
    }
    for (int step = 0; step < 200; step++) {
        for (int k = 0; k < POINTS; k++)
            x[k] = wander(t, &seed, step, 200, x[k], k % 3 == 0 ? 0.3 : 0.05);
        vessel_query(v, POINTS, x, 0.5, together, hit);
        for (int k = POINTS - 1; k >= 0; k--) {
            vessel_query(v, 1, &x[k], 0.5, &alone[k], &one);
            assert_true(same_hit(&hit[k], &one));
        }
    }
    // the same foot with a list from elsewhere within the skin
    for (int k = 0; k < POINTS; k++) {
        VesselMemory a = together[k], b = together[k];
        if (!a.has_foot || a.blobs < 0)
            continue;
        b.held_for2 = -1;    // the list must be made again
        VesselHit ha, hb;
        vessel_query(v, 1, &x[k], 0.5, &a, &ha);
        vessel_query(v, 1, &x[k], 0.5, &b, &hb);
        assert_true(same_hit(&ha, &hb) || ha.node != hb.node);
        assert_true(ha.gap == hb.gap);
    }
    v->destroy(v);
    vessel_tree_free(t);
}

// --- derivatives ---

static void derivatives_of_the_gap(void **state)
{
    (void)state;
    VesselTree *t = helix(3);
    Vessel *v = make(t, 0);
    uint64_t seed = 16;
    int checked = 0;
    double worst_normal = 0, worst_bend = 0;
    for (int trial = 0; trial < 1500; trial++) {
        Vec3 c = t->center[5 + trial % 50], x = vec3_add_scaled(c, random_in(&seed, 0.6, 1.2), random_unit_vector(&seed));
        VesselMemory memory = {.node = -1};
        VesselHit hit;
        for (int k = 0; k < 2; k++)    // the Hessian is that of the last evaluation; in a second query it is that of the foot
            vessel_query(v, 1, &x, 5, &memory, &hit);
        double bend = sqrt(sym3_quadratic(&hit.hessian, vec3(1, 0, 0)) * sym3_quadratic(&hit.hessian, vec3(1, 0, 0))) + fabs(sym3_trace(&hit.hessian));
        if (fabs(hit.gap) > 0.4 || bend > 4)
            continue;
        double h = 1e-4;
        Vec3 slope = {0, 0, 0};
        bool same = true;
        double bends = 0;
        for (int k = 0; k < 3 && same; k++) {
            Vec3 e = vec3(k == 0, k == 1, k == 2);
            VesselHit side[2];
            for (int s = 0; s < 2; s++) {
                VesselMemory m = memory;
                Vec3 y = vec3_add_scaled(x, s ? -h : h, e);
                for (int again = 0; again < 2; again++)
                    vessel_query(v, 1, &y, 5, &m, &side[s]);
                same &= vec3_distance(m.foot, memory.foot) < 0.01;
            }
            slope = vec3_add_scaled(slope, (side[0].gap - side[1].gap) / (2 * h), e);
            Vec3 turn = vec3_scale(vec3_sub(side[0].normal, side[1].normal), 1 / (2 * h));
            bends = fmax(bends, vec3_distance(turn, sym3_mul_vec(&hit.hessian, e)));
        }
        if (!same)
            continue;
        checked++;
        worst_normal = fmax(worst_normal, vec3_distance(slope, hit.normal));
        worst_bend = fmax(worst_bend, bends);
        assert_true(vec3_norm(sym3_mul_vec(&hit.hessian, hit.normal)) < 1e-9);
    }
    print_message("%d places: gradient of the gap is the normal to %.1e, of the normal the Hessian to %.1e\n", checked, worst_normal, worst_bend);
    assert_true(checked > 300 && worst_normal < 1e-6 && worst_bend < 1e-5);
    v->destroy(v);
    vessel_tree_free(t);
}

// --- one wall ---

// Along the wall in steps of 2 um: a change of the gap beyond the motion is a jump of the wall.
static void no_jump_between_cells(void **state)
{
    (void)state;
    VesselTree *t = helix(4);
    Vessel *v = make(t, 0);
    double worst = 0, turn = 0;
    int changes = 0;
    for (int way = 0; way < 4; way++) {
        VesselMemory memory = {.node = 5};
        VesselHit last = {.gap = HUGE_VAL};
        for (int k = 0; k < 8000; k++) {
            double s = 5 + 0.003 * k, angle = 1.57 * way;
            int i = (int)s;
            Vec3 c = vec3_mix(t->center[i], t->center[i + 1], s - i), d = vec3_unit(vec3_sub(t->center[i + 1], t->center[i]));
            Vec3 e1 = vec3_normal_to(vec3(0, 0, 1)), e2 = vec3_unit(vec3_cross(d, e1)),
                 out = vec3_add(vec3_scale(vec3_cross(e2, d), cos(angle)), vec3_scale(e2, sin(angle)));
            Vec3 x = vec3_add_scaled(c, 0.85, out);
            VesselHit hit;
            vessel_query(v, 1, &x, 5, &memory, &hit);
            assert_int_equal(hit.flags, 0);
            // another node for the same foot: query the former node, too
            if (last.gap < HUGE_VAL && last.node != hit.node) {
                Blobby a = blobby_of(t, last.node), b = blobby_of(t, hit.node);
                Vec3 ga, gb;
                double fa = blobby_gradient(&a, memory.foot, &ga), fb = blobby_gradient(&b, memory.foot, &gb);
                worst = fmax(worst, fabs(fa - fb) / vec3_norm(gb));
                turn = fmax(turn, vec3_distance(vec3_unit(ga), vec3_unit(gb)));
                changes++;
            }
            last = hit;
        }
    }
    print_message("%d changes of node: walls differ by %.1e mm, normals by %.1e\n", changes, worst, turn);
    assert_true(changes > 50 && worst < 1e-12 && turn < 1e-12);
    v->destroy(v);
    vessel_tree_free(t);
}

// Two arms of a hairpin whose walls touch: from five radii behind the bend on, each is a tube as if the other did not exist.
static void kissing_vessels_keep_apart(void **state)
{
    (void)state;
    enum { ARM = 40, BEND = 20, ALL = 2 * ARM + BEND };
    Vec3 line[ALL + 2 * OVER];
    double r = 2.1, spacing = PI * r / BEND;     // arms 4.2 apart, walls 2 mm each: 0.2 mm between
    for (int i = 0; i < ALL + 2 * OVER; i++) {
        int k = i - OVER;
        double angle = PI * (k - ARM) / BEND;
        line[i] = k < ARM          ? vec3(spacing * (k - ARM), 0, 0)
                  : k < ARM + BEND ? vec3(r * sin(angle), r - r * cos(angle), 0)
                                   : vec3(-spacing * (k - ARM - BEND), 2 * r, 0);
    }
    VesselTree *t = field_tree_along(line, ALL, OVER, 2, 0, 1);
    Vessel *v = make(t, 0);
    double worst = 0;
    for (int k = 0; k < 100; k++) {
        double s = -12.6 + 0.02 * k;
        VesselHit hit = ask(v, vec3(s, 1.8, 0), 3, 5), far_side = ask(v, vec3(s, -1.8, 0), 3, 5);
        assert_int_equal(hit.flags | far_side.flags, 0);
        assert_true(hit.node < ARM);
        worst = fmax(worst, fabs(hit.gap - far_side.gap));
    }
    print_message("kissing arms: the wall differs by %.1e mm from one without neighbour\n", worst);
    assert_true(worst < 1e-9);
    v->destroy(v);
    vessel_tree_free(t);
}

static void inlet_is_open(void **state)
{
    (void)state;
    VesselTree *t = straight(30, 0.75);
    Vessel *v = make(t, 0);
    Vec3 p, d;
    assert_true(v->inlet(v, &p, &d) && vec3_norm(p) == 0 && vec3_distance(d, vec3(1, 0, 0)) < 1e-12);
    for (double x = -5; x < -0.5; x += 0.3) {
        VesselHit hit = ask(v, vec3(x, 0.3, 0.2), 0, 1), root = ask(v, vec3(-20, 0.3, 0.2), 0, 1);
        assert_int_equal(hit.flags, VESSEL_BEYOND);
        assert_near(hit.gap, root.gap, 1e-8);
        assert_true(vec3_distance(hit.normal, root.normal) < 1e-6 && fabs(hit.normal.x) < 1e-9);
        assert_near(hit.hessian.xx, 0, 1e-9);
        assert_true(ask(v, vec3(x, 2, 0), 0, 1).gap < -0.5);
    }
    VesselMemory memory = {.node = -1};
    VesselHit last = {.gap = HUGE_VAL};
    for (double x = 3; x >= -3; x -= 0.01) {
        VesselHit hit;
        Vec3 at = {x, 0.7, 0};
        vessel_query(v, 1, &at, 0.5, &memory, &hit);
        assert_int_equal(hit.flags, x < 0 ? VESSEL_BEYOND : 0);
        if (last.gap < 1) {      // smooth across the plane: the gap changes according to the normal, the normal according to the Hessian
            assert_near(last.gap - hit.gap, 0.01 * 0.5 * (hit.normal.x + last.normal.x), 2e-5);
            Vec3 bends = vec3_scale(vec3_sub(last.normal, hit.normal), 100);
            assert_true(vec3_distance(bends, sym3_mul_vec(&hit.hessian, vec3(1, 0, 0))) < 0.1);
        }
        last = hit;
        assert_near(hit.gap, 0.3, 0.02);
    }
    v->destroy(v);
    vessel_tree_free(t);
}

static Vec3 mirrored(Vec3 v) { return vec3(v.x, -v.y, v.z); }

static void moved_and_mirrored_scenes(void **state)
{
    (void)state;
    Quat q = quat_from_rotation_vector(vec3(0.7, 0.2, -1.5));
    Vec3 shift = {100, -50, 20};
    VesselTree *t[3] = {helix(3), helix(3), helix(3)};
    for (int i = 0; i < t[0]->node_count; i++) {
        t[1]->center[i] = vec3_add(quat_rotate(q, t[0]->center[i]), shift);
        t[1]->direction[i] = quat_rotate(q, t[0]->direction[i]);
        t[2]->center[i] = mirrored(t[0]->center[i]);
        t[2]->direction[i] = mirrored(t[0]->direction[i]);
    }
    for (int64_t j = 0; j < t[0]->blob_count; j++) {
        t[1]->blob_center[j] = vec3_add(quat_rotate(q, t[0]->blob_center[j]), shift);
        t[2]->blob_center[j] = mirrored(t[0]->blob_center[j]);
    }
    Vessel *v[3];
    VesselMemory memory[3] = {{.node = 3}, {.node = 3}, {.node = 3}};
    for (int i = 0; i < 3; i++) {
        assert_true(vessel_tree_link(t[i]));
        v[i] = make(t[i], 0);
    }
    uint64_t seed = 18;
    Vec3 x = t[0]->center[3];
    int compared = 0;
    for (int step = 0; step < 1500; step++) {
        x = wander(t[0], &seed, step, 1500, x, 0.2);
        VesselHit hit[3];
        vessel_query(v[0], 1, &x, 0.5, &memory[0], &hit[0]);
        Vec3 moved = vec3_add(quat_rotate(q, x), shift), flipped = mirrored(x);
        vessel_query(v[1], 1, &moved, 0.5, &memory[1], &hit[1]);
        vessel_query(v[2], 1, &flipped, 0.5, &memory[2], &hit[2]);
        if (hit[0].flags || hit[0].gap > 0.4)
            continue;
        compared++;
        assert_near(hit[0].gap, hit[1].gap, 1e-8);
        assert_near(hit[0].gap, hit[2].gap, 1e-8);
        assert_true(vec3_distance(quat_rotate(q, hit[0].normal), hit[1].normal) < 1e-6);
        assert_true(vec3_distance(mirrored(hit[0].normal), hit[2].normal) < 1e-6);
    }
    assert_true(compared > 300);
    // about the inlet, where the fields are those of the section at the root; the helix starts obliquely to all axes
    Vec3 d = t[0]->direction[0], e1 = vec3_normal_to(d), e2 = vec3_cross(d, e1);
    int near = 0;
    for (int trial = 0; trial < 400; trial++) {
        double z = random_in(&seed, -1.5, 0.6), rho = random_in(&seed, 0.6, 1), angle = random_in(&seed, 0, 2 * PI);
        Vec3 at = vec3_add_scaled(t[0]->center[0], z, d);
        at = vec3_add(at, vec3_add_scaled(vec3_scale(e1, rho * cos(angle)), rho * sin(angle), e2));
        VesselHit hit[3] = {ask(v[0], at, 0, 0.5), ask(v[1], vec3_add(quat_rotate(q, at), shift), 0, 0.5), ask(v[2], mirrored(at), 0, 0.5)};
        if (hit[0].flags & ~(unsigned)VESSEL_BEYOND || hit[0].gap > 0.4)
            continue;
        near++;
        Vec3 u = random_unit_vector(&seed);
        assert_true(hit[1].flags == hit[0].flags && hit[2].flags == hit[0].flags);
        assert_near(hit[0].gap, hit[1].gap, 1e-8);
        assert_near(sym3_quadratic(&hit[0].hessian, u), sym3_quadratic(&hit[1].hessian, quat_rotate(q, u)), 1e-3);
        assert_near(sym3_quadratic(&hit[0].hessian, u), sym3_quadratic(&hit[2].hessian, mirrored(u)), 1e-3);
    }
    assert_true(near > 200);
    for (int i = 0; i < 3; i++) {
        v[i]->destroy(v[i]);
        vessel_tree_free(t[i]);
    }
}

// --- places without a field ---

static void nowhere_is_survived(void **state)
{
    (void)state;
    VesselTree *t = helix(2);
    Vessel *v = make(t, 0);
    uint64_t seed = 17;
    static const double bad[] = {NAN, INFINITY, 1e100, 1e70, 1e30, 1e8, 1e3};
    VesselMemory memory = {.node = 10};
    for (int i = 0; i < 14; i++) {       // with and without history, and back again
        VesselHit hit = ask(v, vec3(bad[i % 7], i % 2, 0), i % 2 ? -1 : 5, 1);
        assert_true(hit.gap == hit.gap && vec3_is_finite(hit.normal));
        Vec3 x = vec3(1, bad[i % 7], 0);
        vessel_query(v, 1, &x, 1, &memory, &hit);
        assert_true(hit.gap == hit.gap && vec3_is_finite(hit.normal));
        (void)v->locate(v, x, -1);
        x = vec3_add_scaled(t->center[10], 0.8, random_unit_vector(&seed));
        vessel_query(v, 1, &x, 5, &memory, &hit);
        VesselHit fresh = ask(v, x, 10, 5);
        assert_true(fabs(hit.gap - fresh.gap) < 1e-6);
    }
    for (int trial = 0; trial < 200; trial++) {      // on the axis, at nodes and between
        int i = 5 + trial % 50;
        VesselHit hit = ask(v, vec3_mix(t->center[i], t->center[i + 1], 0.005 * trial), -1, 5);
        assert_int_equal(hit.flags, 0);
        assert_true(hit.gap > 0.6 && hit.gap < 1.2);
        assert_near(vec3_norm(hit.normal), 1, 1e-9);
    }
    for (int trial = 0; trial < 300; trial++) {      // from outside, even outside all supports, the result leads back
        int node = 5 + trial % 50, steps = 0;
        Vec3 x = vec3_add_scaled(t->center[node], random_in(&seed, 1.5, 6), random_unit_vector(&seed));
        VesselMemory m = {.node = node};
        VesselHit hit;
        do {
            vessel_query(v, 1, &x, 0.5, &m, &hit);
            assert_true(isfinite(hit.gap) && vec3_is_finite(hit.normal));
            if (hit.gap < 0)
                x = vec3_add_scaled(x, fmin(-hit.gap, 0.5) + 1e-3, hit.normal);
        } while (hit.gap < 0 && ++steps < 40);
        assert_true(steps < 40);
    }
    v->destroy(v);
    vessel_tree_free(t);
}

// VESSEL_FAR is a bound: no wall of the point's part is nearer, and it is set only beyond reach.
static void far_is_far(void **state)
{
    (void)state;
    VesselTree *t = helix(3);
    Vessel *v = make(t, 0);
    uint64_t seed = 23;
    VesselMemory memory = {.node = -1};
    Vec3 x = t->center[3];
    int far = 0;
    for (int step = 0; step < 4000; step++) {
        x = wander(t, &seed, step, 4000, x, step % 7 == 0 ? 0.2 : 0.03);
        VesselHit hit;
        vessel_query(v, 1, &x, 0.3, &memory, &hit);
        if (!(hit.flags & VESSEL_FAR))
            continue;
        far++;
        VesselHit exact = ask(v, x, hit.node, 100);
        assert_true(hit.gap > 0.3 && exact.gap >= hit.gap - 1e-6);
    }
    print_message("far: %d of 4000\n", far);
    assert_true(far > 300);
    v->destroy(v);
    vessel_tree_free(t);
}

// A memory that is saved and restored gives bit-identical results; queries allocate nothing.
static void copies_repeat_and_heap_rests(void **state)
{
    (void)state;
    enum { POINTS = 20 };
    VesselTree *t = helix(4);
    Vessel *v = make(t, 0);
    static VesselMemory memory[POINTS], kept[POINTS];
    static Vec3 path[100][POINTS];
    static VesselHit first[100][POINTS];
    uint64_t seed = 29;
    for (int k = 0; k < POINTS; k++)
        memory[k] = (VesselMemory){.node = -1};
    for (int step = 0; step < 100; step++)
        for (int k = 0; k < POINTS; k++)
            path[step][k] = wander(t, &seed, step, 100, step ? path[step - 1][k] : t->center[3], 0.1);
    struct mallinfo2 before = mallinfo2();
    for (int step = 0; step < 100; step++) {
        if (step == 50)
            memcpy(kept, memory, sizeof kept);
        vessel_query(v, POINTS, path[step], 0.5, memory, first[step]);
    }
    memcpy(memory, kept, sizeof kept);
    for (int step = 50; step < 100; step++) {
        VesselHit hit[POINTS];
        vessel_query(v, POINTS, path[step], 0.5, memory, hit);
        for (int k = 0; k < POINTS; k++)
            assert_true(same_hit(&hit[k], &first[step][k]));
    }
    struct mallinfo2 after = mallinfo2();
    assert_true(before.uordblks == after.uordblks && before.fordblks == after.fordblks);
    v->destroy(v);
    vessel_tree_free(t);
}

// If there are more blobs around a point than a memory can hold, the whole list is used, with the same result.
static void crowded_places(void **state)
{
    (void)state;
    VesselTree *t = helix(60);
    for (int64_t j = 0; j < t->blob_count; j++)
        if (t->blob_width[j] < 1.9)
            t->blob_amplitude[j] *= 0.1;
    Vessel *v = make(t, 0);
    uint64_t seed = 31;
    VesselMemory memory = {.node = -1};
    Vec3 x = t->center[3];
    int crowded = 0;
    for (int step = 0; step < 800; step++) {
        x = wander(t, &seed, step, 800, x, 0.05);
        VesselHit hit;
        vessel_query(v, 1, &x, 5, &memory, &hit);
        crowded += memory.blobs < 0;
        assert_true((hit.flags & VESSEL_UNSURE) == 0);
        Blobby blobs = blobby_of(t, hit.node);
        Vec3 g;
        double f = blobby_gradient(&blobs, memory.foot, &g);
        assert_true(fabs(f) < 1e-7 * vec3_norm(g));
    }
    assert_true(crowded > 400);
    v->destroy(v);
    vessel_tree_free(t);
}

// A thin lumen beside a wide one, in the same cells, but hidden from their centres by the wall of the wide one: a point that crosses it finds the opposite
// wall.
static void cleft_behind_the_wall(void **state)
{
    (void)state;
    enum { N = 60, THIN = 5 };
    const double wide = 0.6, thin = 0.15, aside = 1.55, pitch = 0.5;
    VesselTree *t = vessel_tree_create_shared(N, 0, N * (1 + THIN));
    for (int i = 0, at = 0; i < N; i++) {
        t->center[i] = vec3(pitch * i, 0, 0);
        t->radius[i] = 1;
        t->direction[i] = vec3(1, 0, 0);
        t->height[i] = pitch;
        t->parent[i] = i - 1;
        for (int k = 0; k <= THIN; k++, at++) {
            double radius = k == 0 ? wide : thin, x = pitch * (i + (k == 0 ? 0 : (k - 3.0) / THIN));
            t->blob_center[at] = vec3(x, k == 0 ? 0 : aside, 0);
            t->blob_width[at] = 2 * radius;
            t->blob_amplitude[at] = field_row_amplitude(k == 0 ? pitch : pitch / THIN, radius);
        }
        t->blob_offset[i + 1] = at;
    }
    assert_true(vessel_tree_link(t));
    Vessel *v = make(t, 0);
    VesselMemory memory = {.node = -1};
    double worst = 0;
    for (int step = 0; step <= 40; step++) {
        double off = 0.1 * (1 - step / 20.0);
        Vec3 x = {15, aside + off, 0};
        VesselHit hit;
        vessel_query(v, 1, &x, 0.5, &memory, &hit);
        worst = fmax(worst, hit.gap - (thin - fabs(off)));
    }
    print_message("across a thin lumen: at most %.4f mm farther than its wall\n", worst);
    assert_true(worst < 0.02);
    v->destroy(v);
    vessel_tree_free(t);
}

// A vessel like a sponge: blobs at random places of a wide tube, which form ridges, septa and pockets.
static VesselTree *sponge(void)
{
    enum { LONG = 60, EACH = 12 };
    uint64_t seed = 9;
    VesselTree *t = vessel_tree_create_shared(LONG, 0, LONG * EACH);
    for (int i = 0; i < LONG; i++) {
        t->center[i] = vec3(0.5 * i, 0, 0);
        t->radius[i] = 1.5;
        t->direction[i] = vec3(1, 0, 0);
        t->height[i] = 0.5;
        t->parent[i] = i - 1;
        for (int k = 0; k < EACH; k++) {
            int at = i * EACH + k;
            t->blob_center[at] = vec3_add_scaled(t->center[i], random_in(&seed, 0, 1.3), random_unit_vector(&seed));
            t->blob_width[at] = random_in(&seed, 0.5, 1.1);
            t->blob_amplitude[at] = random_in(&seed, -0.4, 1.2);
        }
        t->blob_offset[i + 1] = (i + 1) * EACH;
    }
    assert_true(vessel_tree_link(t));
    return t;
}

// A ball that rolls along a rough wall with septa and ridges: the tracked wall is as near as the wall found by a search without a start.
static void rough_walls_are_met(void **state)
{
    (void)state;
    enum { WALKS = WHOLE_OR_SHORT(40, 8), STEPS = 1000, EVERY = 10 };
    VesselTree *t = sponge();
    Vessel *v = make(t, 0);
    uint64_t seed = 5;
    int asked = 0, missed = 0;
    double worst = 0;
    for (int w = 0; w < WALKS; w++) {
        Vec3 x = t->center[5 + w % (NODES - 10)], way = {0, 0, 0};
        double radius = random_in(&seed, 0.15, 0.8), stride = random_in(&seed, 0.01, 0.05);
        VesselMemory memory = {.node = -1};
        for (int step = 0; step < STEPS; step++) {
            way = step % 40 == 0 ? random_unit_vector(&seed) : way;
            x = vec3_add_scaled(x, stride, way);
            VesselHit hit;
            vessel_query(v, 1, &x, radius + 0.5, &memory, &hit);
            if (hit.flags & (VESSEL_OPEN_END | VESSEL_BEYOND | VESSEL_UNSURE))
                break;
            if (hit.flags & VESSEL_FAR)
                continue;
            if (step % EVERY == 0) {
                VesselHit fresh = ask(v, x, memory.node, radius + 0.5);
                double miss = fresh.gap < radius + 0.05 ? hit.gap - fresh.gap : 0;
                asked++;
                missed += miss > 0.05;
                worst = fmax(worst, miss);
            }
            if (hit.gap < radius)
                x = vec3_add_scaled(x, fmin(radius - hit.gap, 0.05), hit.normal);
        }
    }
    print_message("rough walls: %d of %d missed by more than 0.05 mm, %.3f mm at most\n", missed, asked, worst);
    assert_true(asked == WALKS * STEPS / EVERY && missed == 0);
    v->destroy(v);
    vessel_tree_free(t);
}

// Is the foot within 0.01 mm of the zero of the field of all blobs? Not required where no node knows the whole lumen: its field ends there without a wall.
static bool is_on_whole_wall(const VesselTree *t, Vec3 foot)
{
    double f = -1;
    Vec3 g = {0, 0, 0};
    for (int64_t k = 0; k < t->blob_count; k++) {
        Vec3 d = vec3_sub(foot, t->blob_center[k]);
        double square = t->blob_width[k] * t->blob_width[k], u = fmax(0, 1 - vec3_norm2(d) / square);
        f += t->blob_amplitude[k] * u * u * u;
        g = vec3_add_scaled(g, -6 * t->blob_amplitude[k] * u * u / square, d);
    }
    return fabs(f) < 0.01 * vec3_norm(g) + 1e-6;
}

// A fork of small blobs, with arms of uneven widths.
static VesselTree *fork(uint64_t *seed)
{
    enum { TRUNK = 6, ARM = 5, ALL = TRUNK + 2 * ARM, EACH = 40 };
    const double pitch = 2.4;
    VesselTree *t = vessel_tree_create_shared(ALL, 0, ALL * EACH);
    for (int i = 0; i < ALL; i++) {
        bool starts = i == TRUNK || i == TRUNK + ARM;
        t->parent[i] = i == TRUNK + ARM ? TRUNK - 1 : i - 1;
        t->direction[i] = i < TRUNK ? vec3(1, 0, 0) : starts ? vec3_unit(vec3(1, i == TRUNK ? 1.5 : -1.5, random_in(seed, -1, 1))) : t->direction[i - 1];
        t->center[i] = i == 0 ? vec3(0, 0, 0) : vec3_add_scaled(t->center[t->parent[i]], pitch, t->direction[i]);
        t->radius[i] = random_in(seed, 3, 7);
        t->height[i] = pitch;
        for (int k = i * EACH; k < (i + 1) * EACH; k++) {
            t->blob_center[k] = vec3_add_scaled(t->center[i], random_in(seed, 0, 0.8) * t->radius[i], random_unit_vector(seed));
            t->blob_width[k] = random_in(seed, 0.4, 0.6) * t->radius[i];
            t->blob_amplitude[k] = 0.9;
        }
        t->blob_offset[i + 1] = (i + 1) * EACH;
    }
    assert_true(vessel_tree_link(t));
    return t;
}

// Far from its cell a node does not know the whole lumen, and its field ends where there is no wall: a foot may not be there.
static void no_wall_where_a_field_ends(void **state)
{
    (void)state;
    enum { FORKS = WHOLE_OR_SHORT(60, 5), PLACES = 500 };
    uint64_t seed = 3;
    int asked = 0, ends = 0;
    for (int n = 0; n < FORKS; n++) {
        VesselTree *t = fork(&seed);
        Vessel *v = make(t, 0);
        for (int k = 0; k < PLACES; k++) {
            int node = 3 + (int)random_in(&seed, 0, t->node_count - 3);
            Vec3 x = vec3_add_scaled(t->center[node], random_in(&seed, 0, 0.9) * t->radius[node], random_unit_vector(&seed));
            VesselHit hit = ask(v, x, -1, 30);
            Vec3 foot = vec3_add_scaled(x, -hit.gap, hit.normal);
            if (hit.flags || foot.x < t->radius[0])
                continue;    // the inlet bends the field
            asked++;
            ends += !is_on_whole_wall(t, foot);
        }
        v->destroy(v);
        vessel_tree_free(t);
    }
    print_message("%d feet in forks: %d not on the wall\n", asked, ends);
    assert_true(asked > FORKS * PLACES / 2 && ends == 0);
}

// A model that contradicts itself: from the middle on, every second blob of the nodes is missing, so that their wall is narrower. This is flagged, and no tool jumps.
static void contradiction_is_reported(void **state)
{
    (void)state;
    enum { N = 60, CUT = 30 };
    VesselTree *t = straight(N, 0.5);
    int64_t kept = 0;
    for (int i = 0; i < N; i++) {
        int64_t first = t->seen_offset[i], end = t->seen_offset[i + 1];
        t->seen_offset[i] = kept;
        for (int64_t k = first; k < end; k++)
            if (i < CUT || t->seen[k] % 2 == 0)
                t->seen[kept++] = t->seen[k];
    }
    t->seen_offset[N] = kept;
    Vessel *v = make(t, 0);
    VesselMemory memory = {.node = -1};
    int flagged = 0, first = -1;
    double last = 0.2;
    for (int k = 0; k < 1000; k++) {
        Vec3 x = {10 + 0.01 * k, 0.8, 0};
        VesselHit hit;
        vessel_query(v, 1, &x, 5, &memory, &hit);
        if (hit.flags & VESSEL_DISAGREE) {
            first = first < 0 ? k : first;
            flagged++;
        }
        assert_true(fabs(hit.gap - last) < 0.015);
        last = hit.gap;
    }
    print_message("the narrower wall is %.3f mm away; marked in %d of 1000 places, from x = %.2f\n", last, flagged, 10 + 0.01 * first);
    assert_true(last < 0 && flagged > 50 && flagged < 400);
    v->destroy(v);
    vessel_tree_free(t);
}

// --- walls full of hollows ---

enum { HOLLOWS = 14, WALL_POINTS = 3000 };

// A spherical vessel with hollows and humps at random places.
static VesselTree *hollow_ball(uint64_t *seed)
{
    VesselTree *t = vessel_tree_create_shared(1, 0, HOLLOWS);
    t->center[0] = t->blob_center[0] = vec3(0, 0, 0);
    t->radius[0] = 1.8;
    t->direction[0] = vec3(-1, 0, 0);
    t->parent[0] = -1;
    t->blob_width[0] = 3.6;
    t->blob_amplitude[0] = 1 / (0.75 * 0.75 * 0.75);
    for (int k = 1; k < HOLLOWS; k++) {
        Vec3 d = random_unit_vector(seed);
        d.x = -fabs(d.x);
        t->blob_center[k] = vec3_scale(d, random_in(seed, 1.4, 2.6));
        t->blob_width[k] = random_in(seed, 0.8, 1.6);
        t->blob_amplitude[k] = random_in(seed, 0, 1) < 0.3 ? -random_in(seed, 0.3, 0.9) : random_in(seed, 0.3, 0.9);
    }
    t->blob_offset[1] = HOLLOWS;
    assert_true(vessel_tree_link(t));
    return t;
}

// Points of the wall on rays from the middle, away from the inlet.
static void find_wall(const VesselTree *t, uint64_t *seed, Vec3 *wall)
{
    Blobby blobs = blobby_of(t, 0);
    for (int k = 0; k < WALL_POINTS;) {
        Vec3 d = random_unit_vector(seed);
        double far = 0.3;
        while (blobby_field(&blobs, vec3_scale(d, far)) > 0)
            far += 0.05;
        double near = far - 0.05;
        for (int i = 0; i < 40; i++) {
            double middle = 0.5 * (near + far);
            if (blobby_field(&blobs, vec3_scale(d, middle)) > 0)
                near = middle;
            else
                far = middle;
        }
        wall[k] = vec3_scale(d, far);
        k += wall[k].x < -0.5 * t->radius[0];
    }
}

static Vec3 nearest_of(const Vec3 *wall, Vec3 x)
{
    int best = 0;
    for (int k = 1; k < WALL_POINTS; k++)
        best = vec3_norm2(vec3_sub(wall[k], x)) < vec3_norm2(vec3_sub(wall[best], x)) ? k : best;
    return wall[best];
}

// The gap is the distance to the nearest point of the wall: no point of the wall is nearer. A ball moves along a wall in whose hollows it has two feet. Its
// path is given by points of the wall, not by the results; a tracked foot must be replaced by the nearer one.
static void no_wall_is_nearer(void **state)
{
    (void)state;
    static Vec3 wall[WALL_POINTS];
    int asked = 0, off = 0, far_off = 0;
    double worst = 0;
    // the seeds of 100 to 159 with the largest errors before rings were searched: up to 0.126 mm
    static const uint64_t from[] = {109, 110, 111, 151};
    for (size_t n = 0; n < sizeof from / sizeof from[0]; n++) {
        uint64_t seed = from[n];
        VesselTree *t = hollow_ball(&seed);
        Vessel *v = make(t, 0);
        find_wall(t, &seed, wall);
        for (int walk = 0; walk < 6; walk++) {
            VesselMemory memory = {.node = 0};
            Vec3 x = vec3(-0.6, 0, 0), d = random_unit_vector(&seed);
            double radius = random_in(&seed, 0.5, 0.9), stride = random_in(&seed, 0.02, 0.06);
            for (int step = 0; step < 250; step++) {
                d = vec3_unit(vec3_add_scaled(d, 0.3, random_unit_vector(&seed)));
                d.x = x.x > -0.5 ? -fabs(d.x) : d.x;
                x = vec3_add_scaled(x, stride, d);
                Vec3 in = vec3_sub(x, nearest_of(wall, x));
                double gap = vec3_norm(in);
                if (gap < radius)
                    x = vec3_add_scaled(x, radius / gap - 1, in);
                VesselHit hit;
                vessel_query(v, 1, &x, 5, &memory, &hit);
                if (hit.flags)
                    continue;
                double more = hit.gap - vec3_distance(x, nearest_of(wall, x));
                asked++;
                off += more > 0.02;
                far_off += more > 0.05;
                worst = fmax(worst, more);
            }
        }
        v->destroy(v);
        vessel_tree_free(t);
    }
    print_message("%d answers among hollows: %d say more than 0.02 mm more than there is, %d more than 0.05, %.3f mm at most\n", asked, off, far_off, worst);
    assert_true(asked > 4000 && far_off == 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(one_blob_is_a_sphere),
        cmocka_unit_test(row_becomes_a_tube),
        cmocka_unit_test(walks_against_twin),
        cmocka_unit_test(same_bits_on_every_isa),
        cmocka_unit_test(alone_as_in_company),
        cmocka_unit_test(derivatives_of_the_gap),
        cmocka_unit_test(no_jump_between_cells),
        cmocka_unit_test(kissing_vessels_keep_apart),
        cmocka_unit_test(inlet_is_open),
        cmocka_unit_test(moved_and_mirrored_scenes),
        cmocka_unit_test(nowhere_is_survived),
        cmocka_unit_test(far_is_far),
        cmocka_unit_test(copies_repeat_and_heap_rests),
        cmocka_unit_test(crowded_places),
        cmocka_unit_test(rough_walls_are_met),
        cmocka_unit_test(no_wall_where_a_field_ends),
        cmocka_unit_test(contradiction_is_reported),
        cmocka_unit_test(cleft_behind_the_wall),
        cmocka_unit_test(no_wall_is_nearer),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
