// The exact tube: derivatives of the gap by central differences, distances compared with sampled centrelines, ends, frames, rigid motion and mirroring, coils
// that cross, and the messages about bad tubes.
#include "geom/vessel.h"
#include "random_numbers.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "near.h"

static Vessel *make(const TubeOptions *o)
{
    static Faults faults;
    faults_clear(&faults);
    Vessel *v = tube_vessel_create(o, "scene.yaml", &faults);
    if (!v)
        print_message("%s\n", faults.text[0]);
    assert_non_null(v);
    return v;
}

static VesselHit ask(const Vessel *v, Vec3 x, int from)
{
    VesselMemory memory = {.node = from};
    VesselHit hit;
    vessel_query(v, 1, &x, 1, &memory, &hit);
    return hit;
}

// Line, arc, arc out of plane, line: an S-bend in space.
static const TubePiece bend[] = {{10, 0, 0, 0}, {0, 15, PI / 2, 0}, {0, 6, 2, PI / 3}, {8, 0, 0, 0}};
static TubeOptions bend_options(void)
{
    return (TubeOptions){.start = {1, 2, 3}, .direction = {1, 0, 0}, .normal = {0, 1, 0}, .radius = 0.8, .piece_count = 4, .piece = bend};
}

// The same centreline by small steps of a rotating frame, independent of the tube's code.
enum { SAMPLES_A_PIECE = 4000 };
static int sample_bend(Vec3 *out)
{
    Vec3 p = {1, 2, 3}, t = {1, 0, 0}, n = {0, 1, 0};
    int count = 0;
    for (int i = 0; i < 4; i++) {
        bool arc = bend[i].angle > 0;
        double length = arc ? bend[i].arc_radius * bend[i].angle : bend[i].length, k = arc ? 1 / bend[i].arc_radius : 0;
        if (arc)
            n = quat_rotate(quat_from_rotation_vector(vec3_scale(t, bend[i].plane)), n);
        for (int j = 0; j < SAMPLES_A_PIECE; j++) {
            double ds = length / SAMPLES_A_PIECE;
            out[count++] = p;
            Quat half = quat_from_rotation_vector(vec3_scale(vec3_cross(t, n), 0.5 * k * ds));
            Vec3 mid = quat_rotate(half, t);
            p = vec3_add_scaled(p, ds, mid);
            t = quat_rotate(half, mid);
            n = quat_rotate(half, quat_rotate(half, n));
        }
    }
    out[count++] = p;
    return count;
}

static void distance_to_the_centreline(void **state)
{
    (void)state;
    static Vec3 line[4 * SAMPLES_A_PIECE + 1];
    int count = sample_bend(line);
    TubeOptions o = bend_options();
    o.closed_ends = true;
    Vessel *v = make(&o);
    uint64_t seed = 6;
    for (int trial = 0; trial < 300; trial++) {
        int k = (int)random_in(&seed, 0, count - 0.001);
        Vec3 x = vec3_add(line[k], random_in_box(&seed, 0.9));
        double least = HUGE_VAL;
        for (int i = 0; i < count; i++)
            least = fmin(least, vec3_norm2(vec3_sub(line[i], x)));
        // samples are at most 6 um apart: the sampling error is (3 um)^2 over twice the distance; the integrated line drifts by 1e-6
        double tolerance = fmin(3e-3, 0.5 * 9e-6 / sqrt(least)) + 1e-6;
        assert_near(ask(v, x, -1).gap, 0.8 - sqrt(least), tolerance);
        assert_near(ask(v, x, v->locate(v, x, 0)).gap, 0.8 - sqrt(least), tolerance);
    }
    v->destroy(v);
}

// The curvature jumps where line and arc meet and where a corner's sphere begins; differences across such a plane are meaningless.
static bool same_kind(const VesselHit *a, const VesselHit *b) { return a->node == b->node && fabs(sym3_trace(&a->hessian) - sym3_trace(&b->hessian)) < 1e-2; }

static int skipped;
static void check_derivatives(const Vessel *v, Vec3 x)
{
    double h = 1e-5;
    VesselHit hit = ask(v, x, -1);
    Vec3 slope = {0, 0, 0};
    if (hit.gap > 0.85 * 0.8)
        return;   // near the axis the Hessian is held
    for (int k = 0; k < 3; k++) {
        Vec3 e = vec3(k == 0, k == 1, k == 2);
        VesselHit a = ask(v, vec3_add_scaled(x, h, e), hit.node), b = ask(v, vec3_add_scaled(x, -h, e), hit.node);
        if (!same_kind(&a, &hit) || !same_kind(&b, &hit)) {
            skipped++;
            return;
        }
        slope = vec3_add_scaled(slope, (a.gap - b.gap) / (2 * h), e);
        Vec3 bends = vec3_scale(vec3_sub(a.normal, b.normal), 1 / (2 * h));
        assert_true(vec3_distance(bends, sym3_mul_vec(&hit.hessian, e)) < 1e-6);   // h^2 / d^3
    }
    assert_true(vec3_distance(slope, hit.normal) < 1e-8);
    assert_near(vec3_norm(hit.normal), 1, 1e-12);
    assert_true(vec3_norm(sym3_mul_vec(&hit.hessian, hit.normal)) < 1e-9);
}

static void derivatives(void **state)
{
    (void)state;
    static Vec3 line[4 * SAMPLES_A_PIECE + 1];
    int count = sample_bend(line);
    TubeOptions o = bend_options();
    o.closed_ends = true;
    Vessel *v = make(&o);
    uint64_t seed = 7;
    for (int trial = 0; trial < 500; trial++) {
        int k = trial < 20 ? 0 : trial < 40 ? count - 1 : (int)random_in(&seed, 0, count - 0.001);
        Vec3 d = random_unit_vector(&seed);
        check_derivatives(v, vec3_add_scaled(line[k], random_in(&seed, 0.3, 1.2), d));
    }
    v->destroy(v);
    Vec3 corner[] = {{0, 0, 0}, {5, 0, 0}, {8, 3, 0}, {8, 4, 5}};
    TubeOptions poly = {.radius = 1, .point_count = 4, .point = corner};
    v = make(&poly);
    for (int trial = 0; trial < 300; trial++) {
        Vec3 at = vec3_mix(corner[trial % 3], corner[trial % 3 + 1], random_in(&seed, 0.2, 0.8));
        check_derivatives(v, vec3_add_scaled(at, random_in(&seed, 0.3, 0.9), random_unit_vector(&seed)));
    }
    // about a corner, on its convex side: a sphere
    VesselHit hit = ask(v, vec3(5.05, -0.5, 0), -1);
    assert_near(hit.gap, 1 - hypot(0.05, 0.5), 1e-12);
    check_derivatives(v, vec3(5.05, -0.5, 0));
    assert_near(sym3_trace(&hit.hessian), -2 / hypot(0.05, 0.5), 1e-9);
    // on the inner side: the nearer of both lines
    assert_near(ask(v, vec3(4.5, 0.5, 0), -1).gap, 0.5, 1e-12);
    v->destroy(v);
    assert_true(skipped < 10);   // of 801
}

// Straight and toroidal walls: the curvatures of references, -1/rho about, and along the bend -(1/(R - d)) inside, +1/(R + d) outside.
static void curvatures(void **state)
{
    (void)state;
    TubePiece piece[] = {{10, 0, 0, 0}, {0, 15, PI / 2, 0}};
    TubeOptions o = {.direction = {1, 0, 0}, .normal = {0, 1, 0}, .radius = 1, .piece_count = 2, .piece = piece};
    Vessel *v = make(&o);
    VesselHit line = ask(v, vec3(5, 0, 0.5), -1);
    assert_near(line.hessian.yy, -2, 1e-12);
    assert_true(fabs(line.hessian.xx) < 1e-12);
    Vec3 out = {sin(0.7), -cos(0.7), 0}, along = {cos(0.7), sin(0.7), 0}, c = {10, 15, 0};
    VesselHit inner = ask(v, vec3_add_scaled(c, 14.5, out), -1), outer = ask(v, vec3_add_scaled(c, 15.5, out), -1);
    assert_true(vec3_distance(inner.normal, out) < 1e-12 && vec3_distance(outer.normal, vec3_negate(out)) < 1e-12);
    assert_near(sym3_quadratic(&inner.hessian, along), 1 / 14.5, 1e-12);    // the wall bulges into the lumen
    assert_near(sym3_quadratic(&outer.hessian, along), -1 / 15.5, 1e-12);
    assert_near(outer.hessian.zz, -2, 1e-12);
    // on the axis: some transverse unit normal, the same each time, and bounded curvature
    VesselHit axis = ask(v, vec3(5, 0, 0), -1);
    assert_near(axis.gap, 1, 1e-12);
    assert_near(vec3_norm(axis.normal), 1, 1e-12);
    assert_true(fabs(axis.normal.x) < 1e-12 && fabs(sym3_trace(&axis.hessian)) < 11);
    v->destroy(v);
}

static void ends(void **state)
{
    (void)state;
    TubePiece piece[] = {{10, 0, 0, 0}, {0, 5, PI / 2, 0}};
    TubeOptions o = {.start = {2, 0, 0}, .direction = {3, 0, 0}, .normal = {0, 1, 0}, .radius = 0.5, .piece_count = 2, .piece = piece};
    Vessel *open = make(&o);
    o.closed_ends = true;
    Vessel *closed = make(&o);
    // upstream the first section continues
    VesselHit before = ask(open, vec3(-50, 0.2, 0.3), -1), after = ask(open, vec3(17, 6.01, 0), -1);
    assert_true(before.flags == VESSEL_BEYOND);
    assert_near(before.gap, 0.5 - hypot(0.2, 0.3), 1e-12);
    assert_true(before.normal.x == 0 && before.hessian.xx == 0 && before.normal.y < 0);
    assert_near(sym3_trace(&before.hessian), -1 / hypot(0.2, 0.3), 1e-9);
    // downstream the bell, and no wall two radii further
    assert_true(after.flags == VESSEL_OPEN_END && after.gap == HUGE_VAL && vec3_norm(after.normal) == 0);
    assert_true(ask(open, vec3(17, 5.5, 0), -1).flags == VESSEL_BEYOND);
    assert_near(ask(open, vec3(17, 5.5, 0), -1).gap, hypot(0.5, 1) - 0.5, 1e-12);
    assert_near(vec3_norm(ask(open, vec3(17, 5.5, 0), -1).normal), 1, 1e-12);        // on the axis too, behind an arc
    assert_near(ask(open, vec3(17.9, 5.5, 0), -1).gap, hypot(0.5, 0.1) - 0.5, 1e-12);
    assert_true(ask(open, vec3(18.3, 5.2, 0), -1).flags == VESSEL_BEYOND);   // beside the flange
    assert_near(ask(open, vec3(2, 0.2, 0), -1).gap, 0.3, 1e-12);
    assert_true(ask(open, vec3(2.01, 0.2, 0), -1).flags == 0 && ask(open, vec3(17, 4.99, 0), -1).flags == 0);
    assert_near(ask(closed, vec3(1.7, 0.3, 0), -1).gap, 0.5 - hypot(0.3, 0.3), 1e-12);
    assert_near(ask(closed, vec3(17, 5.4, 0), -1).gap, 0.1, 1e-12);
    assert_near(ask(closed, vec3(0, 0, 0), -1).gap, -1.5, 1e-12);
    Vec3 p, d;
    assert_true(open->inlet(open, &p, &d));
    assert_true(vec3_distance(p, vec3(2, 0, 0)) == 0 && vec3_distance(d, vec3(1, 0, 0)) < 1e-15);
    // a smooth joint is not a corner
    assert_true(fabs(ask(open, vec3(12, 0.2, 0), -1).hessian.xx) < 0.3);
    static const double bad[] = {NAN, INFINITY, 1e200};
    for (int i = 0; i < 3; i++) {
        VesselHit hit = ask(open, vec3(bad[i], 0, 0), 0);
        assert_true(hit.flags == VESSEL_UNSURE && isfinite(hit.gap) && vec3_is_finite(hit.normal));
        (void)open->locate(open, vec3(bad[i], 0, 0), -1);
    }
    VesselHit far = ask(open, vec3(5, 1e6, 0), -1);
    assert_true(far.flags == VESSEL_OPEN_END || far.gap < -9e5);
    open->destroy(open);
    closed->destroy(closed);
}

// Gap, normal and Hessian are consistent along a path out of either end, and gap and normal do not jump.
static void ends_are_smooth(void **state)
{
    (void)state;
    TubePiece piece[] = {{0, 5, PI / 2, 0}, {4, 0, 0, 0}, {0, 5, PI / 2, 0}};
    TubeOptions o = {.start = {2, 0, 0}, .direction = {3, 0, 0}, .normal = {0, 1, 0}, .radius = 0.5, .piece_count = 3, .piece = piece};
    Vessel *v = make(&o);
    Vec3 p = {2, 0, 0}, d = {1, 0, 0}, end = {2, 14, 0}, along = {-1, 0, 0};
    uint64_t seed = 31;
    int checked = 0;
    for (int trial = 0; trial < 400; trial++) {
        bool inlet = trial % 2 == 0;
        Vec3 t = inlet ? d : along, at = inlet ? p : end, out = random_unit_vector(&seed);
        out = vec3_unit(vec3_add_scaled(out, -vec3_dot(out, t), t));
        double rho = random_in(&seed, 0.15, inlet ? 0.6 : 0.9), h = 1e-5;
        VesselHit last = {.flags = VESSEL_OPEN_END};
        for (double z = -0.3; z < 0.8; z += 0.0173) {
            Vec3 here = vec3_add_scaled(vec3_add_scaled(at, rho, out), inlet ? -z : z, t), slope = {0, 0, 0};
            int node = inlet ? 0 : v->locate(v, end, -1);
            VesselHit hit = ask(v, here, node);
            assert_true((hit.flags & ~(unsigned)VESSEL_BEYOND) == 0);
            if (last.flags != VESSEL_OPEN_END) {
                assert_true(fabs(hit.gap - last.gap) < 0.0174);
                assert_true(rho < 0.3 || vec3_distance(hit.normal, last.normal) < 0.0174 * 10);   // curvature below 10 / mm
            }
            last = hit;
            bool same = true;
            for (int k = 0; k < 3; k++) {
                Vec3 e = vec3(k == 0, k == 1, k == 2);
                VesselHit a = ask(v, vec3_add_scaled(here, h, e), node), b = ask(v, vec3_add_scaled(here, -h, e), node);
                same = same && same_kind(&a, &hit) && same_kind(&b, &hit);
                slope = vec3_add_scaled(slope, (a.gap - b.gap) / (2 * h), e);
                if (same)
                    assert_true(vec3_distance(vec3_scale(vec3_sub(a.normal, b.normal), 1 / (2 * h)), sym3_mul_vec(&hit.hessian, e)) < 1e-5);
            }
            assert_true(vec3_distance(slope, hit.normal) < (same ? 1e-7 : 1e-3));
            checked += same;
        }
    }
    assert_true(checked > 20000);
    v->destroy(v);
}

static Vec3 mirrored(Vec3 v) { return vec3(v.x, v.y, -v.z); }

static void rigid_motion_and_mirror(void **state)
{
    (void)state;
    TubeOptions o = bend_options();
    Vessel *v = make(&o);
    Quat q = quat_from_rotation_vector(vec3(0.3, -1.2, 0.8));
    Vec3 shift = {-5, 40, 7};
    TubeOptions turned = o, flipped = o;
    turned.start = vec3_add(quat_rotate(q, o.start), shift);
    turned.direction = quat_rotate(q, o.direction);
    turned.normal = quat_rotate(q, o.normal);
    TubePiece other[4];
    memcpy(other, bend, sizeof bend);
    for (int i = 0; i < 4; i++)
        other[i].plane = -other[i].plane;   // a turn about the tangent changes its sense
    flipped.start = mirrored(o.start), flipped.direction = mirrored(o.direction), flipped.normal = mirrored(o.normal);
    flipped.piece = other;
    Vessel *w = make(&turned), *m = make(&flipped);
    uint64_t seed = 8;
    for (int trial = 0; trial < 500; trial++) {
        Vec3 x = vec3_add(vec3(12, 6, 3), random_in_box(&seed, 16));
        VesselHit a = ask(v, x, -1), b = ask(w, vec3_add(quat_rotate(q, x), shift), -1), c = ask(m, mirrored(x), -1);
        assert_true(a.flags == b.flags && a.flags == c.flags && a.node == b.node && a.node == c.node);
        if (a.flags)
            continue;
        assert_near(a.gap, b.gap, 1e-11);
        assert_near(a.gap, c.gap, 1e-13);
        assert_true(vec3_distance(quat_rotate(q, a.normal), b.normal) < 1e-10 && vec3_distance(mirrored(a.normal), c.normal) < 1e-12);
        Vec3 u = random_unit_vector(&seed);
        double scale = 1 + fabs(sym3_trace(&a.hessian));
        assert_near(sym3_quadratic(&a.hessian, u), sym3_quadratic(&b.hessian, quat_rotate(q, u)), 1e-9 * scale);
        assert_near(sym3_quadratic(&a.hessian, u), sym3_quadratic(&c.hessian, mirrored(u)), 1e-11 * scale);
    }
    v->destroy(v);
    w->destroy(w);
    m->destroy(m);
}

// Three turns of one circle at the same place: a point that moves along them counts its turns and does not fall back to the first.
static void coils_that_coincide(void **state)
{
    (void)state;
    TubePiece coil = {0, 5, 6 * PI, 0};
    TubeOptions o = {.direction = {1, 0, 0}, .normal = {0, 1, 0}, .radius = 1, .piece_count = 1, .piece = &coil};
    Vessel *v = make(&o);
    VesselMemory memory = {.node = v->locate(v, vec3(0, 0, 0), -1)};
    assert_int_equal(memory.node, 0);
    for (double a = 0.01; a < 6 * PI; a += 0.05) {
        Vec3 x = {5.5 * sin(a), 5 - 5.5 * cos(a), 0.1};
        VesselHit hit;
        vessel_query(v, 1, &x, 1, &memory, &hit);
        assert_int_equal(hit.flags, 0);
        assert_int_equal(hit.node, (int)(a / (PI / 2)));
        assert_near(hit.gap, 1 - hypot(0.5, 0.1), 1e-9);
    }
    v->destroy(v);
}

// A polyline helix of 540 points whose turns nearly touch, as dense as the peer tubes: a point that moves along the wall facing the next turn stays in its own
// turn, its gap equals that of the exact tube within the sag of the chords, and its nodes increase one by one.
static void turns_that_nearly_touch(void **state)
{
    (void)state;
    enum { N = 540 };
    static Vec3 line[N];
    double a = 5, pitch = 2.05, turns = 6, step = 2 * PI * turns / (N - 1);
    for (int i = 0; i < N; i++)
        line[i] = vec3(a * cos(step * i), a * sin(step * i), pitch * step * i / (2 * PI));
    TubeOptions o = {.radius = 1, .point_count = N, .point = line};
    Vessel *v = make(&o);
    for (int side = -1; side <= 1; side += 2)
        for (double out = 0.3; out < 1.2; out += 0.2) {
            VesselMemory memory = {.node = 0};
            int last = 0;
            for (double t = 0.5; t < N - 1.5; t += 0.5) {
                Vec3 tangent = vec3_unit(vec3(-a * sin(step * t), a * cos(step * t), pitch / (2 * PI))), up = vec3(0, 0, 1);
                up = vec3_unit(vec3_add_scaled(up, -tangent.z, tangent));
                Vec3 x = vec3_add_scaled(vec3(a * cos(step * t), a * sin(step * t), pitch * step * t / (2 * PI)), side * out, up);
                VesselHit hit;
                vessel_query(v, 1, &x, 1, &memory, &hit);
                assert_true(hit.node == (int)t || hit.node == (int)(t + 0.01) || fabs(hit.node + 0.5 - t) <= 1);
                assert_true(hit.node >= last);
                assert_near(hit.gap, 1 - out, 3e-3);   // sag of a chord: step^2 a / 8
                last = hit.node;
            }
            assert_true(last >= N - 4);
        }
    v->destroy(v);
}

// For segments that fold back, cross or are tiny, and for points far away, results stay finite and normals stay unit vectors.
static void strange_tubes(void **state)
{
    (void)state;
    Vec3 fold[] = {{0, 0, 0}, {5, 0, 0}, {0, 0, 0}, {0, 5, 0}, {0, 5, 1e-8}, {-3, -4, 2}, {4, 0, 0}};
    TubeOptions o = {.radius = 1, .point_count = 7, .point = fold};
    for (int closed = 0; closed < 2; closed++) {
        o.closed_ends = closed == 1;
        Vessel *v = make(&o);
        uint64_t seed = 51;
        for (int trial = 0; trial < 3000; trial++) {
            Vec3 x = trial % 3 ? random_in_box(&seed, trial % 3 == 1 ? 6 : 1e8) : vec3_mix(fold[trial % 6], fold[trial % 6 + 1], random_in(&seed, 0, 1));
            VesselHit hit = ask(v, x, trial % 7 - 1);
            if (hit.flags & VESSEL_OPEN_END)
                continue;
            assert_true(isfinite(hit.gap) && fabs(vec3_norm(hit.normal) - 1) < 1e-9 && isfinite(sym3_trace(&hit.hessian)));
        }
        v->destroy(v);
    }
}

static void refuse(const TubeOptions *o, const char *words)
{
    static Faults faults;
    faults_clear(&faults);
    assert_null(tube_vessel_create(o, "scene.yaml", &faults));
    assert_true(faults.count >= 1);
    assert_non_null(strstr(faults.text[0], words));
    assert_non_null(strstr(faults.text[0], "scene.yaml"));
}

static void bad_tubes(void **state)
{
    (void)state;
    TubePiece line = {10, 0, 0, 0}, arc = {0, 5, 1, 0}, bad;
    TubeOptions good = {.direction = {1, 0, 0}, .normal = {0, 1, 0}, .radius = 1, .piece_count = 1, .piece = &line}, o;
    Vec3 points[3] = {{0, 0, 0}, {1, 0, 0}, {1, 0, 0}};
    o = good, o.radius = 0, refuse(&o, "radius_mm is 0");
    o = good, o.radius = NAN, refuse(&o, "radius_mm");
    o = good, o.piece_count = 0, refuse(&o, "neither");
    o = good, o.point = points, o.point_count = 2, refuse(&o, "exactly one");
    o = good, bad = line, bad.length = -1, o.piece = &bad, refuse(&o, "path[0] is -1 mm");
    o = good, bad = arc, bad.arc_radius = 1, o.piece = &bad, refuse(&o, "larger than the lumen");
    o = good, bad = arc, bad.angle = -1, o.piece = &bad, refuse(&o, "angle above 0");
    o = good, bad = arc, bad.angle = 1e9, o.piece = &bad, refuse(&o, "quarter turns");
    o = good, bad = arc, bad.plane = NAN, o.piece = &bad, refuse(&o, "plane");
    o = good, o.direction = vec3(0, 0, 0), refuse(&o, "direction");
    o = good, o.start = vec3(0, NAN, 0), refuse(&o, "start_mm");
    o = good, o.piece = &arc, o.normal = vec3(2, 0, 0), refuse(&o, "normal");
    o = good, o.piece_count = 0, o.point = points, o.point_count = 1, refuse(&o, "2 to");
    o.point_count = 3, refuse(&o, "points 1 and 2 coincide");
    points[2].z = NAN, refuse(&o, "point 2");
    o = good, o.normal = vec3(0, 0, 0);   // a straight tube needs no normal
    Vessel *v = make(&o);
    v->destroy(v);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(distance_to_the_centreline),
        cmocka_unit_test(derivatives),
        cmocka_unit_test(curvatures),
        cmocka_unit_test(ends),
        cmocka_unit_test(ends_are_smooth),
        cmocka_unit_test(rigid_motion_and_mirror),
        cmocka_unit_test(coils_that_coincide),
        cmocka_unit_test(turns_that_nearly_touch),
        cmocka_unit_test(strange_tubes),
        cmocka_unit_test(bad_tubes),
    };
    return cmocka_run_group_tests_name("tube_vessel", tests, NULL, NULL);
}
