// Contact with a fitted tree: the lanes compared with a plain implementation on every instruction set, gaps compared with the slow projection, derivatives,
// points that must not be flagged as far, the return from outside, the inlet, motion and mirroring of the scene, the jump of the wall between nodes.
#include "base/simd.h"
#include "blob_tube.h"
#include "geom/foot_lanes.h"
#include "geom/power_blocks.h"
#include "geom/power_walk.h"
#include "geom/vessel.h"
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

enum { NODES = 60, OVERLAP = 3, BLOBS = 10 };

static VesselTree *helix_tree(void)
{
    Vec3 line[NODES + 2 * OVERLAP];
    helix_line(line, NODES + 2 * OVERLAP, 6, 9, 0.7);
    return blob_tube(line, NODES, OVERLAP, BLOBS, 1);
}

// Every node has its own random blobs about the helix: neighbours agree only roughly, as in a poor fit.
static VesselTree *rough_tree(double roughness)
{
    VesselTree *t = helix_tree();
    uint64_t seed = 11;
    for (int64_t j = 0; j < t->blob_count; j++) {
        t->blob_center[j] = vec3_add(t->blob_center[j], random_in_box(&seed, roughness));
        t->blob_width[j] *= random_in(&seed, 1 - roughness, 1 + roughness);
    }
    return t;
}

static Vessel *make(const VesselTree *tree, LimField field, int isa)
{
    LimVesselOptions o = lim_vessel_default_options();
    o.field = field;
    o.isa = isa;
    Vessel *v = lim_vessel_create_with(tree, &o);
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

static void lanes_against_twin(void **state)
{
    (void)state;
    uint64_t seed = 12;
    for (int count = 1; count <= 27; count++) {
        Vec3 center[27];
        double width[27] = {0};
        for (int j = 0; j < count; j++) {
            center[j] = random_in_box(&seed, 2);
            width[j] = random_in(&seed, 0.1, 1);
        }
        Blobby m = {.count = count, .center = center, .width = width, .iso_level = 0.1};
        int groups = blob_groups_needed(count);
        BlobGroup *group = aligned_alloc(BLOB_GROUP_ALIGNMENT, (size_t)groups * sizeof *group);
        blob_groups_fill(group, &m);
        for (int trial = 0; trial < 20; trial++) {
            Vec3 x = random_in_box(&seed, trial == 0 ? 1e20 : 3), g;
            Sym3 h;
            double f = blobby_hessian(&m, x, &g, &h), scale = 0;
            for (int j = 0; j < count; j++)
                scale += 1 / (width[j] * width[j]) + 1;
            double first[10] = {0};
            for (int isa = 1; isa <= 3; isa++) {
                const LaneKernels *kernels = lane_kernels(isa);
                FootSample a = {0}, c = {0};
                int lane = (trial * 7) % FOOT_BATCH;
                a.group[lane] = group, a.groups[lane] = groups, a.x[lane] = x.x, a.y[lane] = x.y, a.z[lane] = x.z;
                c = a;
                kernels->hessian(&a, &lane, 1, 0.1);
                kernels->gradient(&c, &lane, 1, 0.1);
                double sum[10] = {a.f[lane], a.gx[lane], a.gy[lane], a.gz[lane], a.hxx[lane], a.hxy[lane], a.hxz[lane], a.hyy[lane], a.hyz[lane], a.hzz[lane]};
                double twin[10] = {f, g.x, g.y, g.z, h.xx, h.xy, h.xz, h.yy, h.yz, h.zz};
                assert_true(c.f[lane] == sum[0] && c.gx[lane] == sum[1] && c.gy[lane] == sum[2] && c.gz[lane] == sum[3]);
                for (int e = 0; e < 10; e++)   // sums in another order: rounding of some tens of terms
                    assert_near(sum[e], twin[e], 1e-14 * scale);
                if (isa == 1)
                    memcpy(first, sum, sizeof first);
                assert_memory_equal(first, sum, sizeof first);
            }
        }
        free(group);
    }
}

// A tool of points that move in and out of the lumen along the tree.
static Vec3 wander(const VesselTree *t, uint64_t *seed, int step, int steps, Vec3 x, double reach)
{
    double s = (double)step / steps * (t->node_count - 1.001);
    int k = (int)s;
    Vec3 axis = vec3_mix(t->center[k], t->center[k + 1], s - k), drift = vec3_scale(vec3_sub(x, axis), 0.98);
    return vec3_add(vec3_add(axis, drift), random_in_box(seed, reach));
}

static void same_bits_on_every_isa(void **state)
{
    (void)state;
    VesselTree *t = rough_tree(0.05);
    for (int field = 0; field < 2; field++) {
        Vessel *v[3];
        VesselMemory memory[3] = {{.node = -1}, {.node = -1}, {.node = -1}};
        for (int i = 0; i < 3; i++)
            v[i] = make(t, (LimField)field, i + 1);
        uint64_t seed = 13;
        Vec3 x = t->center[2];
        for (int step = 0; step < 2000; step++) {
            VesselHit hit[3];
            memset(hit, 0, sizeof hit);
            x = wander(t, &seed, step, 2000, x, 0.1);
            for (int i = 0; i < 3; i++)
                vessel_query(v[i], 1, &x, 0.5, &memory[i], &hit[i]);
            for (int i = 1; i < 3; i++) {
                assert_true(hit[0].gap == hit[i].gap && hit[0].node == hit[i].node && hit[0].flags == hit[i].flags);
                assert_memory_equal(&hit[0].normal, &hit[i].normal, sizeof(Vec3));
                assert_memory_equal(&hit[0].hessian, &hit[i].hessian, sizeof(Sym3));
            }
        }
        for (int i = 0; i < 3; i++)
            v[i]->destroy(v[i]);
    }
    vessel_tree_free(t);
}

// Without an explicit choice the program's SIMD level is used.
static void kernels_follow_the_level(void **state)
{
    (void)state;
    SimdLevel usual = simd_level();
    for (int level = 0; level < SIMD_COUNT; level++) {
        simd_force((SimdLevel)level);
        assert_ptr_equal(lane_kernels(0), lane_kernels((int)simd_level() + 1));
    }
    simd_force(usual);
    assert_ptr_equal(lane_kernels(3), lane_kernels((int)simd_widest() + 1));
}

static void one_blob_is_a_sphere(void **state)
{
    (void)state;
    VesselTree *t = vessel_tree_create(1, 0, 1);
    t->center[0] = t->blob_center[0] = vec3(1, 2, 3);
    t->radius[0] = 2;
    t->direction[0] = vec3(-1, 0, 0);
    t->parent[0] = -1;
    t->blob_width[0] = blob_width_for_radius(2, 0.1);
    t->blob_offset[1] = 1;
    vessel_tree_link(t);
    Vessel *v = lim_vessel_create(t);
    uint64_t seed = 14;
    for (int trial = 0; trial < 1000; trial++) {
        Vec3 u = random_unit_vector(&seed);
        double d = random_in(&seed, 0.3, trial % 2 ? 2.5 : 30);
        if (u.x > -0.6)
            u.x = -0.6 - fabs(u.x);   // downstream of the inlet, which faces -x, and of the zone in which the section there is continued
        u = vec3_unit(u);
        VesselHit hit = ask(v, vec3_add_scaled(t->center[0], d, u), 0, 100);
        assert_int_equal(hit.flags, 0);
        assert_near(hit.gap, 2 - d, 1e-9 * (1 + d));
        assert_true(vec3_distance(hit.normal, vec3_negate(u)) < 1e-5);
        // S (I + gap S)^-1 = -1/(r (1 - gap/r)) = -1/d
        Vec3 across = vec3_normal_to(u);
        if (d > 0.4)
            assert_near(sym3_quadratic(&hit.hessian, across) * d, -1, 1e-4);
    }
    v->destroy(v);
    vessel_tree_free(t);
}

// Queries of a moving point with memory: never worse than the slow projection without a start; the foot is on the surface and hardly depends on the history.
static void gaps_against_slow_projection(void **state)
{
    (void)state;
    for (int rough = 0; rough < 2; rough++) {
        VesselTree *t = rough_tree(rough ? 0.1 : 0);
        Vessel *v = make(t, LIM_SWITCH, 0);
        uint64_t seed = 15;
        int farther = 0, compared = 0;
        for (int run = 0; run < 3; run++) {
            Vec3 x = t->center[2];
            VesselMemory memory = {.node = -1};
            for (int step = 0; step < 1500; step++) {
                VesselHit hit;
                x = wander(t, &seed, step, 1500, x, run == 0 ? 0.02 : run == 1 ? 0.1 : 0.4);
                vessel_query(v, 1, &x, 0.7, &memory, &hit);
                if (vec3_distance(x, t->center[0]) < 3)
                    continue;   // near the inlet the wall is not the blobs' own
                Blobby m = blobby_of(t, hit.node);
                SurfacePoint s = blobby_project(&m, x, x);
                assert_true(s.converged);
                if (hit.flags & VESSEL_FAR) {
                    assert_true(s.distance > 0.7 && s.distance >= hit.gap);   // a bound, and beyond reach
                    continue;
                }
                assert_int_equal(hit.flags, 0);
                assert_true((hit.gap > 0) == (s.distance > 0) || fabs(hit.gap) < 1e-7);
                Vec3 g;
                double f = blobby_gradient(&m, memory.foot, &g);
                assert_true(fabs(f) < 1e-7 * vec3_norm(g));
                assert_near(vec3_norm(hit.normal), 1, 1e-12);
                Vec3 rest = vec3_sub(vec3_sub(x, memory.foot), vec3_scale(hit.normal, hit.gap));
                assert_true(vec3_norm(rest) < (hit.gap < 0.4 ? 1e-5 : 1e-3));   // the last step leaves 1e-6 mm over 1 - gap / radius
                // near the axis two sides are equally far and the remembered one may be kept a little longer
                compared++;
                farther += fabs(hit.gap) > fabs(s.distance) + 1e-6;
                if (fabs(hit.gap) < 0.4)
                    assert_near(hit.gap, s.distance, 1e-6);
            }
        }
        print_message("roughness %g: %d of %d feet farther than the closest, none within 0.4 mm of the wall\n", rough ? 0.1 : 0, farther, compared);
        assert_true(farther < compared / 50);
        v->destroy(v);
        vessel_tree_free(t);
    }
}

static void derivatives_of_the_gap(void **state)
{
    (void)state;
    VesselTree *t = rough_tree(0.1);
    Vessel *v = make(t, LIM_SWITCH, 0);
    uint64_t seed = 16;
    int checked = 0;
    for (int trial = 0; trial < 2000; trial++) {
        Vec3 c = t->center[5 + trial % 50], x = vec3_add_scaled(c, random_in(&seed, 0.6, 1.2), random_unit_vector(&seed));
        VesselHit hit = ask(v, x, -1, 5);
        // well inside its own focal distance, so that differences stay with one side
        if (fabs(hit.gap) > 0.4 || fabs(sym3_trace(&hit.hessian)) > 6)
            continue;
        double h = 1e-4;
        Vec3 slope = {0, 0, 0};
        bool same = true;
        for (int k = 0; k < 3 && same; k++) {
            Vec3 e = vec3(k == 0, k == 1, k == 2);
            VesselHit a = ask(v, vec3_add_scaled(x, h, e), hit.node, 5), b = ask(v, vec3_add_scaled(x, -h, e), hit.node, 5);
            same = a.node == hit.node && b.node == hit.node;
            if (!same)
                break;
            slope = vec3_add_scaled(slope, (a.gap - b.gap) / (2 * h), e);
            Vec3 bends = vec3_scale(vec3_sub(a.normal, b.normal), 1 / (2 * h));
            // the Hessian is that of the last evaluation: at most 1e-3 mm from the foot
            assert_true(vec3_distance(bends, sym3_mul_vec(&hit.hessian, e)) < 2e-2);
        }
        if (!same)
            continue;
        checked++;
        assert_true(vec3_distance(slope, hit.normal) < 1e-4);
        assert_true(vec3_norm(sym3_mul_vec(&hit.hessian, hit.normal)) < 1e-9);
    }
    assert_true(checked > 500);
    v->destroy(v);
    vessel_tree_free(t);
}

// From several millimetres outside, the result still points towards the lumen, and following it leads back.
static void back_from_outside(void **state)
{
    (void)state;
    VesselTree *t = rough_tree(0.05);
    for (int field = 0; field < 2; field++) {
        Vessel *v = make(t, (LimField)field, 0);
        uint64_t seed = 17;
        for (int trial = 0; trial < 300; trial++) {
            int node = 5 + trial % 50;
            Vec3 x = vec3_add_scaled(t->center[node], random_in(&seed, 1.5, 6), random_unit_vector(&seed));
            VesselMemory memory = {.node = node};
            VesselHit hit;
            int steps = 0;
            do {
                vessel_query(v, 1, &x, 0.5, &memory, &hit);
                if (hit.flags == VESSEL_FAR || hit.flags == VESSEL_OPEN_END)
                    break;
                assert_true(isfinite(hit.gap) && vec3_is_finite(hit.normal));
                if (hit.gap < 0)
                    x = vec3_add_scaled(x, fmin(-hit.gap, 0.5) + 1e-3, hit.normal);
            } while (hit.gap < 0 && ++steps < 40);
            assert_true(steps < 40);
        }
        static const double bad[] = {NAN, INFINITY, 1e70, 1e30};
        for (int i = 0; i < 4; i++) {
            VesselHit hit = ask(v, vec3(bad[i], 0, 0), i % 2 ? -1 : 5, 1);
            assert_true(hit.gap == hit.gap);   // no NaN
            assert_true(vec3_is_finite(hit.normal));
            (void)v->locate(v, vec3(bad[i], 0, 0), -1);
        }
        v->destroy(v);
    }
    vessel_tree_free(t);
}

static void inlet_is_open(void **state)
{
    (void)state;
    // a straight tube whose blobs end right at the root: the model closes inside the lumen, the vessel does not
    for (int extrapolated = 0; extrapolated < 2; extrapolated++) {
        enum { N = 20, O = 2 };
        Vec3 line[N + 2 * O];
        for (int i = 0; i < N + 2 * O; i++)
            line[i] = vec3(0.8 * (i - O), 0, 0);
        VesselTree *t = blob_tube(line, N, O, 11, 1);
        for (int64_t j = 0; j < t->blob_count && !extrapolated; j++)
            if (t->blob_center[j].x < 0)
                t->blob_center[j].x = 0;   // as in a fit without points upstream: all blobs are at the end
        Vessel *v = make(t, LIM_SWITCH, 0);
        Vec3 p, d;
        assert_true(v->inlet(v, &p, &d));
        assert_true(vec3_norm(p) == 0 && vec3_distance(d, vec3(1, 0, 0)) < 1e-12);
        // upstream the section at the root continues as a cylinder
        for (double x = -5; x < -0.5; x += 0.3) {
            VesselHit hit = ask(v, vec3(x, 0.3, 0.2), 0, 1), root = ask(v, vec3(-20, 0.3, 0.2), 0, 1);
            assert_true(hit.flags == VESSEL_BEYOND && hit.node == 0);
            assert_near(hit.gap, root.gap, 1e-9);
            assert_true(vec3_distance(hit.normal, root.normal) < 1e-7 && fabs(hit.normal.x) < 1e-9);
            assert_near(hit.hessian.xx, 0, 1e-9);
            assert_true(ask(v, vec3(x, 2, 0), 0, 1).gap < -0.5);
        }
        // from just inside outwards along the wall: there is no cap, and the normal stays transverse
        VesselMemory memory = {.node = -1};
        VesselHit last = {.gap = HUGE_VAL};
        for (double x = 3; x >= -3; x -= 0.01) {
            VesselHit hit;
            Vec3 at = {x, 0.7, 0};
            vessel_query(v, 1, &at, 0.5, &memory, &hit);
            assert_int_equal(hit.flags, x < 0 ? VESSEL_BEYOND : 0);
            if (hit.node == 0 && last.node == 0 && last.gap < 1) {
                // smooth across the plane: the gap changes according to the normal, the normal according to the Hessian
                assert_near(last.gap - hit.gap, 0.01 * 0.5 * (hit.normal.x + last.normal.x), 2e-5);
                Vec3 bends = vec3_scale(vec3_sub(last.normal, hit.normal), 100);
                assert_true(vec3_distance(bends, sym3_mul_vec(&hit.hessian, vec3(1, 0, 0))) < 0.1);
            }
            last = hit;
            if (extrapolated)
                assert_near(hit.gap, 0.3, 0.05);   // blobs in a row: the wall waves
            assert_true(hit.gap > 0.1 && hit.normal.y < -0.9);
        }
        v->destroy(v);
        vessel_tree_free(t);
    }
}

static Vec3 mirrored(Vec3 v) { return vec3(v.x, -v.y, v.z); }

static void moved_and_mirrored_scenes(void **state)
{
    (void)state;
    Quat q = quat_from_rotation_vector(vec3(0.7, 0.2, -1.5));
    Vec3 shift = {100, -50, 20};
    VesselTree *t[3] = {rough_tree(0.05), rough_tree(0.05), rough_tree(0.05)};
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
    for (int field = 0; field < 2; field++) {
        Vessel *v[3];
        VesselMemory memory[3] = {{.node = 3}, {.node = 3}, {.node = 3}};
        for (int i = 0; i < 3; i++)
            v[i] = make(t[i], (LimField)field, 0);
        uint64_t seed = 18;
        Vec3 x = t[0]->center[3];
        for (int step = 0; step < 2000; step++) {
            x = wander(t[0], &seed, step + 100, 2200, x, 0.1);
            VesselHit hit[3];
            vessel_query(v[0], 1, &x, 0.5, &memory[0], &hit[0]);
            Vec3 moved = vec3_add(quat_rotate(q, x), shift), flipped = mirrored(x);
            vessel_query(v[1], 1, &moved, 0.5, &memory[1], &hit[1]);
            vessel_query(v[2], 1, &flipped, 0.5, &memory[2], &hit[2]);
            assert_true(hit[0].flags == hit[1].flags && hit[0].flags == hit[2].flags && hit[0].node == hit[1].node && hit[0].node == hit[2].node);
            if (hit[0].flags || hit[0].gap > 0.4)
                continue;
            assert_near(hit[0].gap, hit[1].gap, field == LIM_BLEND ? 1e-8 : 1e-9);   // weights of single precision, 1e-7 of what the models differ by
            assert_near(hit[0].gap, hit[2].gap, 1e-11);
            assert_true(vec3_distance(quat_rotate(q, hit[0].normal), hit[1].normal) < 1e-7);
            assert_true(vec3_distance(mirrored(hit[0].normal), hit[2].normal) < 1e-10);
            Vec3 u = random_unit_vector(&seed);
            assert_near(sym3_quadratic(&hit[0].hessian, u), sym3_quadratic(&hit[1].hessian, quat_rotate(q, u)), 1e-4);   // of the last evaluation
            assert_near(sym3_quadratic(&hit[0].hessian, u), sym3_quadratic(&hit[2].hessian, mirrored(u)), 1e-8);
        }
        // about the inlet, where the fields are those of the section at the root; the helix starts obliquely to all axes
        Vec3 d = t[0]->direction[0], e1 = vec3_normal_to(d), e2 = vec3_cross(d, e1);
        int near = 0;
        for (int trial = 0; trial < 400; trial++) {
            double z = random_in(&seed, -1.5, 0.6), rho = random_in(&seed, 0.5, 1), angle = random_in(&seed, 0, 2 * PI);
            Vec3 at = vec3_add_scaled(t[0]->center[0], z, d);
            at = vec3_add(at, vec3_add_scaled(vec3_scale(e1, rho * cos(angle)), rho * sin(angle), e2));
            VesselHit hit[3] = {ask(v[0], at, 0, 0.5), ask(v[1], vec3_add(quat_rotate(q, at), shift), 0, 0.5), ask(v[2], mirrored(at), 0, 0.5)};
            assert_true(hit[0].flags == hit[1].flags && hit[0].flags == hit[2].flags && !(hit[0].flags & VESSEL_UNSURE));
            if ((hit[0].flags & VESSEL_FAR) || hit[0].gap > 0.4)
                continue;
            near++;
            Vec3 u = random_unit_vector(&seed);
            assert_near(hit[0].gap, hit[1].gap, 1e-8);
            assert_true(vec3_distance(quat_rotate(q, hit[0].normal), hit[1].normal) < 1e-6);
            assert_near(sym3_quadratic(&hit[0].hessian, u), sym3_quadratic(&hit[1].hessian, quat_rotate(q, u)), 1e-3);
            assert_near(sym3_quadratic(&hit[0].hessian, u), sym3_quadratic(&hit[2].hessian, mirrored(u)), 1e-3);
        }
        assert_true(near > 200);
        for (int i = 0; i < 3; i++)
            v[i]->destroy(v[i]);
    }
    for (int i = 0; i < 3; i++)
        vessel_tree_free(t[i]);
}

// Slides points along the wall by 1 um: a change of the gap beyond the motion is the jump of the wall between neighbouring models.
static double worst_jump(const VesselTree *t, LimField field)
{
    Vessel *v = make(t, field, 0);
    double worst = 0, ds = 1e-3;
    for (int turn = 0; turn < 8; turn++) {
        VesselMemory memory = {.node = 5};
        double before = 0;
        for (int i = 5; i < 30; i++) {
            int steps = (int)(vec3_distance(t->center[i], t->center[i + 1]) / ds);
            for (int k = 0; k < steps; k++) {
                Vec3 axis = vec3_mix(t->center[i], t->center[i + 1], (double)k / steps);
                double a = turn * PI / 4;
                Vec3 out = vec3_unit(vec3(cos(a) * axis.x, cos(a) * axis.y, 6 * sin(a)));
                Vec3 x = vec3_add_scaled(axis, 0.9, out);
                VesselHit hit;
                vessel_query(v, 1, &x, 1, &memory, &hit);
                assert_int_equal(hit.flags, 0);
                if (i > 5 && k > 0)
                    worst = fmax(worst, fabs(hit.gap - before));
                before = hit.gap;
            }
        }
    }
    v->destroy(v);
    return worst;
}

static void blend_has_no_jump(void **state)
{
    (void)state;
    VesselTree *t = rough_tree(0.02);
    double paper = worst_jump(t, LIM_SWITCH), blend = worst_jump(t, LIM_BLEND);
    print_message("the wall's worst change over 1 um of travel: switch %.4f mm, blend %.5f mm\n", paper, blend);
    assert_true(paper > 0.005);            // the test can detect jumps
    assert_true(blend < 0.1 * paper);
    vessel_tree_free(t);
}

static void nodes_without_blobs(void **state)
{
    (void)state;
    VesselTree *t = helix_tree(), *u = helix_tree();
    // u: node 0 and 7 have lost theirs to nobody
    int64_t kept = 0;
    for (int i = 0; i < u->node_count; i++) {
        u->blob_offset[i] = kept;
        for (int64_t j = t->blob_offset[i]; j < t->blob_offset[i + 1] && i != 0 && i != 7; j++) {
            u->blob_center[kept] = t->blob_center[j];
            u->blob_width[kept++] = t->blob_width[j];
        }
    }
    u->blob_offset[u->node_count] = u->blob_count = kept;
    Vessel *v = lim_vessel_create(u);
    assert_non_null(v);
    VesselHit hit = ask(v, vec3_add(u->center[7], vec3(0, 0, 0.8)), -1, 1);
    assert_true(hit.node == 7 && hit.flags == 0 && fabs(hit.gap - 0.2) < 0.1);
    v->destroy(v);
    u->blob_count = 0;
    assert_null(lim_vessel_create(u));
    assert_null(lim_vessel_create(NULL));
    vessel_tree_free(t);
    vessel_tree_free(u);
}

// One model of a fork: a point that follows the outer wall of one arm and then crosses to the carina finds that wall in time, although the remembered foot
// stays the locally closest one; the same on the return path.
static void another_wall_comes_closer(void **state)
{
    (void)state;
    enum { A = 12 };
    VesselTree *t = vessel_tree_create(1, 0, 3 * A);
    double rho = blob_row_width(2 * A, 0.5, 1);
    for (int i = 0; i < A; i++) {
        double s = 0.5 * (i + 1);
        t->blob_center[i] = vec3(-s, 0, 0);
        t->blob_center[A + i] = vec3(s * cos(0.6), s * sin(0.6), 0);
        t->blob_center[2 * A + i] = vec3(s * cos(0.6), -s * sin(0.6), 0);
    }
    for (int j = 0; j < 3 * A; j++)
        t->blob_width[j] = rho;
    t->blob_offset[1] = 3 * A;
    t->center[0] = vec3(-5, 0, 0);
    t->radius[0] = 1;
    t->direction[0] = vec3(1, 0, 0);
    t->parent[0] = -1;
    vessel_tree_link(t);
    Vessel *v = lim_vessel_create(t);
    Blobby m = blobby_of(t, 0);
    VesselMemory memory = {.node = 0};
    int sides = 0;
    double last = 0;
    for (int step = 0; step <= 2000; step++) {
        double a = step <= 1000 ? step * 1e-3 : (2000 - step) * 1e-3;
        Vec3 x = vec3_mix(vec3(3.23, 3.24, 0.05), vec3(4.33, 1.63, 0.05), a);   // from the upper arm's outer wall across it into the carina
        VesselHit hit;
        vessel_query(v, 1, &x, 2, &memory, &hit);
        SurfacePoint s = blobby_project(&m, x, x);
        assert_true(s.converged && hit.flags == 0);
        if (fabs(s.distance) < 0.6)
            assert_near(hit.gap, s.distance, 1e-6);
        double side = vec3_dot(hit.normal, vec3(1.1, -1.61, 0));   // in the direction of the crossing, or against it
        sides += step > 0 && side * last < 0;
        last = side;
    }
    assert_int_equal(sides, 2);   // the side changed on both paths
    v->destroy(v);
    vessel_tree_free(t);
}

// A long box with a flat end. A point goes from that end along the axis, and the foot in the middle of the end stays the locally closest: no step of Newton
// leaves it. The looks around the point find the side walls before they are nearer than 0.7 of its distance, and no clearance reaches through them.
static void nearer_side_walls_are_found(void **state)
{
    (void)state;
    enum { LONG = 25, WIDE = 5, ALL = LONG * WIDE * WIDE };
    VesselTree *t = vessel_tree_create(1, 0, ALL);
    for (int i = 0; i < ALL; i++) {
        t->blob_center[i] = vec3(0.5 * (i % LONG - LONG / 2), 0.5 * (i / LONG % WIDE - WIDE / 2), 0.5 * (i / LONG / WIDE - WIDE / 2));
        t->blob_width[i] = 0.15;
    }
    t->blob_offset[1] = ALL;
    t->center[0] = vec3(-5, 0, 0);
    t->radius[0] = 2;
    t->direction[0] = vec3(1, 0, 0);
    t->parent[0] = -1;
    vessel_tree_link(t);
    Blobby m = blobby_of(t, 0);
    Vessel *v = lim_vessel_create(t);
    VesselMemory memory = {.node = 0};
    for (int k = 0; k <= 80; k++) {
        Vec3 x = vec3(6 - 0.1 * k, 0, 0);
        VesselHit hit;
        vessel_query(v, 1, &x, 100, &memory, &hit);
        double nearest = blobby_project(&m, x, x).distance;
        assert_int_equal(hit.flags, 0);
        assert_true(0.7 * hit.gap < nearest);
        assert_true(memory.clearance - vec3_distance(x, memory.clear_place) < nearest);
        if (k == 0)
            assert_near(hit.normal.x, -1, 1e-6);    // from the end …
        if (k == 80)
            assert_near(hit.gap, nearest, 1e-6);    // … to a side wall
    }
    v->destroy(v);
    vessel_tree_free(t);
}

// The clearance stored by a query is valid only around its place: in a flat lumen, 2.38 mm from the middle to either wall, a point is queried there and then
// beside a wall.
static void clearance_holds_about_its_place(void **state)
{
    (void)state;
    enum { SIDE = 25 };
    VesselTree *t = vessel_tree_create(1, 0, SIDE * SIDE);
    for (int i = 0; i < SIDE * SIDE; i++) {
        t->blob_center[i] = vec3(0.5 * (i % SIDE - SIDE / 2), 0.5 * (i / SIDE - SIDE / 2), 2);
        t->blob_width[i] = blob_row_width(SIDE, 0.5, 1);
    }
    t->blob_offset[1] = SIDE * SIDE;
    t->center[0] = vec3(0, 0, 2);
    t->radius[0] = 1;
    t->direction[0] = vec3(1, 0, 0);
    t->parent[0] = -1;
    vessel_tree_link(t);
    Blobby m = blobby_of(t, 0);
    Vessel *v = lim_vessel_create(t);
    VesselMemory memory = {.node = 0};
    const Vec3 middle = {2, 0, 2}, low = {0.25, 0, 0};
    VesselHit hit;
    vessel_query(v, 1, &middle, 10, &memory, &hit);
    assert_true(hit.flags == 0 && hit.gap > 2.3 && memory.clearance > 1);
    double away = blobby_project(&m, low, vec3(0.25, 0, -0.5)).distance;
    assert_true(away > 0.3 && away < 0.5);
    vessel_query(v, 1, &low, 0.2, &memory, &hit);
    assert_true(hit.gap > 0 && hit.gap < away + 1e-3);
    v->destroy(v);
    vessel_tree_free(t);
}

// A vessel whose blobs grow along it: from its axis the field falls fastest towards the thin end. A foot there once made points near the wall sleep. For any
// history of a point, a wall that is flagged as far must be far.
static void far_is_far_in_a_taper(void **state)
{
    (void)state;
    enum { N = 12, B = 13 };
    VesselTree *t = vessel_tree_create(N, 0, N * B);
    for (int i = 0; i < N; i++) {
        t->center[i] = vec3(i, 0, 0);
        t->radius[i] = 0.9;
        t->direction[i] = vec3(1, 0, 0);
        t->parent[i] = i - 1;
        t->blob_offset[i + 1] = (i + 1) * B;
        for (int j = 0; j < B; j++) {
            t->blob_center[i * B + j] = vec3(i + 0.5 * (j - B / 2), 0, 0);
            t->blob_width[i * B + j] = 0.25 + 0.008 * (j + i);
        }
    }
    vessel_tree_link(t);
    for (int field = 0; field < 2; field++) {
        Vessel *v = make(t, (LimField)field, 0);
        uint64_t seed = 23;
        int far = 0;
        for (int run = 0; run < 400; run++) {
            Vec3 x = vec3(random_in(&seed, 2, N - 3), 0, 0), way = vec3_scale(random_unit_vector(&seed), random_in(&seed, 0.01, 0.3));
            VesselMemory memory = {.node = -1};
            double reach = random_in(&seed, 0.1, 1);
            for (int step = 0; step < 30; step++, x = vec3_add(x, way)) {
                VesselHit hit;
                vessel_query(v, 1, &x, reach, &memory, &hit);
                if (x.x < 2)
                    break;   // near the inlet the wall is not the blobs' own
                Blobby m = blobby_of(t, hit.node);
                SurfacePoint s = blobby_project(&m, x, x);
                // blended neighbours differ from the own model by less than 0.05 mm here
                if (hit.flags & VESSEL_FAR)
                    assert_true(s.distance > reach && ++far);
                else
                    assert_true(hit.gap < 0.4 ? fabs(hit.gap - s.distance) < 0.05 : hit.gap < s.distance / 0.7 + 0.05);
            }
        }
        assert_true(far > 100);
        v->destroy(v);
    }
    vessel_tree_free(t);
}

// The search by boxes finds the same node as a search over all nodes (of equal ones the first), for any query.
static void nearest_through_boxes(void **state)
{
    (void)state;
    static const int sizes[] = {1, 2, 16, 17, 256, 257, 5000};
    uint64_t seed = 31;
    for (int s = 0; s < 7; s++) {
        VesselTree *t = vessel_tree_create(sizes[s], 0, 0);
        for (int i = 0; i < sizes[s]; i++) {
            bool leap = i == 0 || random_in(&seed, 0, 1) < 0.05;   // branches
            t->center[i] = leap ? random_in_box(&seed, 50) : vec3_add(t->center[i - 1], random_in_box(&seed, 1));
            t->radius[i] = random_in(&seed, 0, 1) < 0.01 ? 12 : random_in(&seed, 0.1, 3);
            if (i > 0 && random_in(&seed, 0, 1) < 0.1)
                t->center[i] = t->center[i / 2], t->radius[i] = t->radius[i / 2];
        }
        PowerBlocks blocks;
        assert_true(power_blocks_create(&blocks, t));
        for (int trial = 0; trial < 2000; trial++) {
            Vec3 x = trial % 3 == 0 ? t->center[trial % sizes[s]] : random_in_box(&seed, trial % 3 == 1 ? 60 : 1e4);
            assert_int_equal(power_blocks_nearest(&blocks, x), power_nearest(t, x));
        }
        static const double bad[] = {NAN, INFINITY, -INFINITY, 1e200, 1e70};
        for (int i = 0; i < 5; i++)
            assert_int_equal(power_blocks_nearest(&blocks, vec3(0, bad[i], 1)), power_nearest(t, vec3(0, bad[i], 1)));
        power_blocks_free(&blocks);
        vessel_tree_free(t);
    }
}

// Within a node's ball the few planes stored for it give the same result as all near nodes: points get the node that power_walk finds. For a vessel with a
// bend, varying width and a branch.
static void planes_against_walk(void **state)
{
    (void)state;
    enum { TRUNK = 50, ALL = 70 };
    VesselTree *t = vessel_tree_create(ALL, 0, ALL);
    uint64_t seed = 37;
    for (int i = 0; i < ALL; i++) {
        bool trunk = i < TRUNK;
        double s = 0.4 * (trunk ? i : i - TRUNK + 1);
        t->parent[i] = i == TRUNK ? 25 : i - 1;
        t->center[i] = trunk ? vec3(3 * cos(0.3 * s), 3 * sin(0.3 * s), 0.2 * s) : vec3_add(t->center[25], vec3(0.2 * s, 0.3 * s, s));
        t->center[i] = vec3_add(t->center[i], random_in_box(&seed, 0.05));
        t->radius[i] = (trunk ? 1 : 0.6) * random_in(&seed, 0.8, 1.2);
        t->direction[i] = vec3(0, 0, 1);
        t->blob_center[i] = t->center[i];
        t->blob_width[i] = blob_width_for_radius(t->radius[i], 0.1);
        t->blob_offset[i + 1] = i + 1;
    }
    vessel_tree_link(t);
    Vessel *v = make(t, LIM_BLEND, 0);
    int moved = 0;
    for (int trial = 0; trial < 20000; trial++) {
        int node = 1 + trial % (ALL - 1), hops = lim_vessel_default_options().hops;
        Vec3 x = vec3_add_scaled(t->center[node], t->radius[node] * random_in(&seed, 0, 1.19), random_unit_vector(&seed));
        int walked = power_walk(t, x, node, hops), asked = ask(v, x, node, 0.5).node;
        double d = power_distance(x, t->center[walked], t->radius[walked]) - power_distance(x, t->center[asked], t->radius[asked]);
        assert_true(asked == walked || fabs(d) < 1e-5);   // planes are of single precision
        moved += asked != node;
    }
    assert_true(moved > 5000);
    v->destroy(v);
    vessel_tree_free(t);
}

static double now_us(void)
{
    struct timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return 1e6 * (double)t.tv_sec + 1e-3 * (double)t.tv_nsec;
}

// Points that oscillate about the axis, where all sides are nearly equally close: their time compared with points that oscillate as much near the wall, and the
// fraction of results that are unsure or more than a hundredth further away than the closest side.
static double swing(const VesselTree *t, double aside, int *bad)
{
    enum { P = 40, ROUNDS = 300 };
    Vessel *v = make(t, LIM_SWITCH, 0);
    VesselMemory memory[P];
    VesselHit hit[P];
    Vec3 x[P];
    double used[ROUNDS], middle = 0;
    uint64_t seed = 29;
    *bad = 0;
    for (int i = 0; i < P; i++)
        memory[i] = (VesselMemory){.node = -1};
    for (int r = 0; r < ROUNDS; r++) {
        for (int i = 0; i < P; i++) {
            int k = 8 + i;
            Vec3 axis = vec3_mix(t->center[k], t->center[k + 1], fabs(r - 0.5 * ROUNDS) * 2 / ROUNDS), out = vec3_unit(vec3(axis.x, axis.y, 0));
            x[i] = vec3_add(vec3_add_scaled(axis, aside, out), random_in_box(&seed, 0.02));
        }
        double start = now_us();
        vessel_query(v, P, x, 5, memory, hit);
        used[r] = now_us() - start;
        for (int i = 0; i < P && r % 10 == 9; i++) {
            Blobby m = blobby_of(t, hit[i].node);
            *bad += hit[i].flags != 0 || hit[i].gap > 1.01 * blobby_project(&m, x[i], x[i]).distance;
        }
    }
    v->destroy(v);
    for (int k = 0; k <= ROUNDS / 2; k++) {     // the median, by repeatedly selecting the smallest
        int least = k;
        for (int j = k; j < ROUNDS; j++)
            least = used[j] < used[least] ? j : least;
        middle = used[least], used[least] = used[k], used[k] = middle;
    }
    return middle;
}

static void near_the_axis(void **state)
{
    (void)state;
    for (int rough = 0; rough < 2; rough++) {
        VesselTree *t = rough_tree(rough ? 0.02 : 0);
        int bad_axis, bad_wall;
        double axis = swing(t, 0, &bad_axis), wall = swing(t, 0.7, &bad_wall);
        print_message("roughness %g: 40 points about the axis %.1f us, beside the wall %.1f us; bad answers %d and %d of 1200\n", rough ? 0.02 : 0, axis, wall,
                      bad_axis, bad_wall);
        assert_true(axis < 6 * wall);
        assert_int_equal(bad_axis, 0);
        assert_int_equal(bad_wall, 0);
        vessel_tree_free(t);
    }
}

// A tool fed exactly along the axis of a straight vessel, where no side is the closest.
static void on_the_axis(void **state)
{
    (void)state;
    enum { N = 40, P = 20, ROUNDS = 40 };
    Vec3 line[N + 8], along = vec3_unit(vec3(3, -1, 2)), across = vec3_normal_to(along);
    for (int i = 0; i < N + 8; i++)
        line[i] = vec3_scale(along, 0.5 * i);
    VesselTree *t = blob_tube(line, N, 4, 9, 1);
    uint64_t seed = 7;
    for (int64_t j = 0; j < t->blob_count; j++)      // as round as a fitted tube
        t->blob_center[j] = vec3_add(t->blob_center[j], random_in_box(&seed, 1e-4));
    Vessel *v = make(t, LIM_SWITCH, 0);
    double used[2] = {HUGE_VAL, HUGE_VAL};
    for (int off = 0; off < 2; off++) {      // on it, and well beside it
        VesselMemory memory[P];
        VesselHit hit[P];
        for (int i = 0; i < P; i++)
            memory[i] = (VesselMemory){.node = -1};
        for (int r = 0; r < ROUNDS; r++) {
            Vec3 x[P];
            for (int i = 0; i < P; i++)
                x[i] = vec3_add_scaled(vec3_scale(along, 6 + 0.3 * i + 0.05 * r), 0.5 * off, across);
            double start = now_us();
            vessel_query(v, P, x, 2, memory, hit);
            used[off] = r > 0 ? fmin(used[off], now_us() - start) : used[off];
            for (int i = 0; i < P; i++) {
                Blobby m = blobby_of(t, hit[i].node);
                assert_int_equal(hit[i].flags, 0);
                assert_true(fabs(hit[i].gap - blobby_project(&m, x[i], x[i]).distance) < 1e-4);
            }
        }
    }
    print_message("%d points on the axis %.1f us, beside it %.1f us\n", P, used[0], used[1]);
    assert_true(used[0] < 40 * used[1]);
    v->destroy(v);
    vessel_tree_free(t);
}

// Not a check: prints the time for 80 points near the wall (all projected) and for a tool in the lumen, 10 blobs per node.
static void cost(void **state)
{
    (void)state;
    enum { P = 80, ROUNDS = 400 };
    VesselTree *t = rough_tree(0.01);
    for (int field = 0; field < 2; field++)
        for (int near_wall = 0; near_wall < 2; near_wall++) {
            Vessel *v = make(t, (LimField)field, 0);
            Vec3 x[P], out[P];
            VesselMemory memory[P];
            VesselHit hit[P];
            uint64_t seed = 19;
            for (int i = 0; i < P; i++) {
                double s = 3 + 50.0 * i / P;
                int k = (int)s;
                Vec3 axis = vec3_mix(t->center[k], t->center[k + 1], s - k);
                out[i] = vec3_unit(vec3(axis.x, axis.y, random_in(&seed, -9, 9)));
                x[i] = vec3_add_scaled(axis, near_wall ? 0.82 : random_in(&seed, 0, 0.85), out[i]);
                memory[i] = (VesselMemory){.node = -1};
            }
            double best = HUGE_VAL, sum = 0;
            for (int r = 0; r < ROUNDS; r++) {
                for (int i = 0; i < P; i++)   // 10 mm/s along, 1 mm/s across
                    x[i] = vec3_add(x[i], vec3(r % 2 ? 0.01 : -0.01, 0.001 * (r % 3 - 1), 0));
                double start = now_us();
                vessel_query(v, P, x, 0.5, memory, hit);
                double used = now_us() - start;
                best = fmin(best, used);
                for (int i = 0; i < P; i++)
                    sum += hit[i].flags ? 0 : hit[i].gap;
            }
            print_message("%s, %s: %.2f us per query of %d points (sum of gaps %.6f)\n", field ? "blend" : "switch",
                          near_wall ? "all near the wall" : "spread in the lumen", best, P, sum);
            v->destroy(v);
        }
    vessel_tree_free(t);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(lanes_against_twin),
        cmocka_unit_test(same_bits_on_every_isa),
        cmocka_unit_test(kernels_follow_the_level),
        cmocka_unit_test(one_blob_is_a_sphere),
        cmocka_unit_test(gaps_against_slow_projection),
        cmocka_unit_test(derivatives_of_the_gap),
        cmocka_unit_test(back_from_outside),
        cmocka_unit_test(inlet_is_open),
        cmocka_unit_test(moved_and_mirrored_scenes),
        cmocka_unit_test(blend_has_no_jump),
        cmocka_unit_test(nodes_without_blobs),
        cmocka_unit_test(another_wall_comes_closer),
        cmocka_unit_test(nearer_side_walls_are_found),
        cmocka_unit_test(clearance_holds_about_its_place),
        cmocka_unit_test(far_is_far_in_a_taper),
        cmocka_unit_test(nearest_through_boxes),
        cmocka_unit_test(planes_against_walk),
        cmocka_unit_test(near_the_axis),
        cmocka_unit_test(on_the_axis),
        cmocka_unit_test(cost),
    };
    return cmocka_run_group_tests_name("lim_vessel", tests, NULL, NULL);
}
