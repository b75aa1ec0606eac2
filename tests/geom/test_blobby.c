// Blobby models: the table of docs/references.md, derivatives compared with central differences and their order, the closest surface point compared with
// spheres (exact) and with sampling.
#include "geom/blobby.h"
#include "random_numbers.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>

#include <cmocka.h>

#include "mean_curvature.h"
#include "near.h"

static void radius_table(void **state)
{
    (void)state;
    static const double r[] = {0.25, 0.5, 1, 1.25, 2, 4}, rho[] = {0.18566883, 0.27536409, 0.43108082, 0.50193365, 0.69800814, 1.15504028};
    for (int i = 0; i < 6; i++) {
        assert_near(blob_width_for_radius(r[i], 0.1), rho[i], 5.1e-9);   // the table has 8 digits
        assert_near(blob_radius(rho[i], 0.1), r[i], 1e-7);
    }
    for (double radius = 1e-4; radius < 1e4; radius *= 1.7)
        assert_near(blob_radius(blob_width_for_radius(radius, 0.1), 0.1) / radius, 1, 1e-9);
    assert_true(blob_radius(0.1, 0.1) == 0 && blob_radius(0.05, 0.1) == 0);
}

// Two concentric blobs with the width after splitting have the same iso-surface as the blob before.
static void split_table(void **state)
{
    (void)state;
    static const double rho[] = {0.15, 0.3, 0.5, 1, 2, 4}, twin[] = {0.10561251, 0.23671169, 0.40798317, 0.83649164, 1.69658477, 3.42242596};
    for (int i = 0; i < 6; i++) {
        Vec3 center[2] = {{1, 2, 3}, {1, 2, 3}};
        double width[2] = {twin[i], twin[i]}, r = blob_radius(rho[i], 0.1);
        Blobby two = {.count = 2, .center = center, .width = width, .iso_level = 0.1};
        Vec3 g, x = vec3_add_scaled(center[0], r, vec3_unit(vec3(1, -2, 0.5)));
        double f = blobby_gradient(&two, x, &g);
        assert_true(fabs(f) / vec3_norm(g) < 2e-7);   // widths have 8 digits
    }
}

enum { BLOBS = 7 };
static Blobby random_model(uint64_t *seed, Vec3 *center, double *width)
{
    for (int j = 0; j < BLOBS; j++) {
        center[j] = random_in_box(seed, 1);
        width[j] = random_in(seed, 0.15, 0.6);
    }
    return (Blobby){.count = BLOBS, .center = center, .width = width, .iso_level = 0.1};
}

static double gradient_error(const Blobby *m, Vec3 x, double h)
{
    Vec3 g, d;
    blobby_gradient(m, x, &g);
    d.x = (blobby_field(m, vec3(x.x + h, x.y, x.z)) - blobby_field(m, vec3(x.x - h, x.y, x.z))) / (2 * h);
    d.y = (blobby_field(m, vec3(x.x, x.y + h, x.z)) - blobby_field(m, vec3(x.x, x.y - h, x.z))) / (2 * h);
    d.z = (blobby_field(m, vec3(x.x, x.y, x.z + h)) - blobby_field(m, vec3(x.x, x.y, x.z - h))) / (2 * h);
    return vec3_distance(g, d);
}

static double hessian_error(const Blobby *m, Vec3 x, double h)
{
    Vec3 g, a, b, e;
    Sym3 s;
    double worst = 0;
    blobby_hessian(m, x, &g, &s);
    for (int k = 0; k < 3; k++) {
        e = vec3(k == 0, k == 1, k == 2);
        blobby_gradient(m, vec3_add_scaled(x, h, e), &a);
        blobby_gradient(m, vec3_add_scaled(x, -h, e), &b);
        double err = vec3_distance(sym3_mul_vec(&s, e), vec3_scale(vec3_sub(a, b), 1 / (2 * h)));
        worst = err > worst ? err : worst;
    }
    return worst;
}

static void derivatives_of_second_order(void **state)
{
    (void)state;
    uint64_t seed = 1;
    for (int trial = 0; trial < 50; trial++) {
        Vec3 center[BLOBS], x = random_in_box(&seed, 2), g1, g2, g3;
        double width[BLOBS];
        Blobby m = random_model(&seed, center, width);
        Sym3 s;
        double f1 = blobby_field(&m, x), f2 = blobby_gradient(&m, x, &g1), f3 = blobby_hessian(&m, x, &g2, &s);
        assert_true(f1 == f2 && f2 == f3);
        blobby_gradient(&m, x, &g3);
        assert_true(vec3_distance(g1, g2) == 0);
        double coarse = gradient_error(&m, x, 2e-3), fine = gradient_error(&m, x, 1e-3);
        assert_true(fine < 1e-4);
        assert_true(fine < 1e-9 || fabs(coarse / fine - 4) < 0.2);   // central differences: error falls fourfold
        coarse = hessian_error(&m, x, 2e-3), fine = hessian_error(&m, x, 1e-3);
        assert_true(fine < 1e-3);
        assert_true(fine < 1e-9 || fabs(coarse / fine - 4) < 0.2);
    }
}

static void curvature_of_a_sphere(void **state)
{
    (void)state;
    for (double r = 0.3; r < 5; r *= 1.5) {
        Vec3 c = {0.1, -0.2, 0.3}, g;
        double rho = blob_width_for_radius(r, 0.1);
        Blobby one = {.count = 1, .center = &c, .width = &rho, .iso_level = 0.1};
        Sym3 h;
        blobby_hessian(&one, vec3_add_scaled(c, r, vec3_unit(vec3(1, 2, -3))), &g, &h);
        assert_near(mean_curvature(g, &h) * r, 1, 1e-10);
    }
}

static void check_on_surface(const Blobby *m, Vec3 x, const SurfacePoint *s)
{
    Vec3 g, away = vec3_sub(x, s->foot);
    double f = blobby_gradient(m, s->foot, &g);
    assert_true(fabs(f) / vec3_norm(g) < 1e-9);
    assert_true(vec3_norm(vec3_add_scaled(away, -s->distance, s->normal)) <= 1e-6 + 1e-4 * vec3_norm(away));
    assert_near(vec3_norm(s->normal), 1, 1e-12);
}

static void sphere_is_exact(void **state)
{
    (void)state;
    uint64_t seed = 2;
    for (int trial = 0; trial < 500; trial++) {
        Vec3 c = random_in_box(&seed, 5), u = random_unit_vector(&seed);
        double r = random_in(&seed, 0.2, 3), rho = blob_width_for_radius(r, 0.1), d = random_in(&seed, 0.001, 40) * (trial % 2 ? 1 : 0.02 * r);
        Blobby one = {.count = 1, .center = &c, .width = &rho, .iso_level = 0.1};
        Vec3 x = vec3_add_scaled(c, d, u);
        // without a start, and from a last contact elsewhere on the sphere
        for (int warm = 0; warm < 2; warm++) {
            SurfacePoint s = blobby_project(&one, x, warm ? vec3_add_scaled(c, r, random_unit_vector(&seed)) : x);
            assert_true(s.converged);
            check_on_surface(&one, x, &s);
            assert_near(s.distance, r - d, 1e-9 * (1 + d));
            assert_true(vec3_distance(s.normal, vec3_negate(u)) < 1e-6);
            Vec3 t = vec3_normal_to(u);
            assert_near(sym3_quadratic(&s.shape, t), -1 / r, 1e-8 / r);
            assert_true(fabs(sym3_quadratic(&s.shape, u)) < 1e-8);
        }
    }
}

static void centre_and_far_away(void **state)
{
    (void)state;
    Vec3 c = {1, 2, 3};
    double rho = blob_width_for_radius(1, 0.1);
    Blobby one = {.count = 1, .center = &c, .width = &rho, .iso_level = 0.1};
    SurfacePoint a = blobby_project(&one, c, c), b = blobby_project(&one, c, c);
    assert_true(a.converged && fabs(a.distance - 1) < 1e-9);
    assert_true(vec3_distance(a.foot, b.foot) == 0);
    static const double far[] = {1e2, 1e4, 1e8, 1e60};
    for (int i = 0; i < 4; i++) {
        Vec3 x = vec3_add_scaled(c, far[i], vec3_unit(vec3(1, 1, 0)));
        SurfacePoint s = blobby_project(&one, x, x);
        assert_true(vec3_is_finite(s.foot) && vec3_is_finite(s.normal) && isfinite(s.distance));
        assert_true(s.distance < 0 && fabs(s.distance / (1 - far[i]) - 1) < 1e-6);
    }
    static const double bad[] = {NAN, INFINITY, 1e200};
    for (int i = 0; i < 3; i++) {
        SurfacePoint s = blobby_project(&one, vec3(bad[i], 0, 0), vec3(bad[i], 0, 0));
        assert_true(!s.converged && vec3_is_finite(s.foot) && vec3_is_finite(s.normal) && isfinite(s.distance));
        s = blobby_project(&one, vec3(0, 0, 0), vec3(bad[i], 0, 0));   // invalid memory does no harm
        assert_true(s.converged);
    }
    double tiny = 0.05;   // below T there is no surface
    Blobby none = {.count = 1, .center = &c, .width = &tiny, .iso_level = 0.1}, empty = {.iso_level = 0.1};
    SurfacePoint s = blobby_project(&none, vec3(0, 0, 0), vec3(0, 0, 0));
    assert_true(!s.converged && s.distance < 0 && vec3_is_finite(s.normal));
    s = blobby_project(&empty, vec3(0, 0, 0), vec3(0, 0, 0));
    assert_true(!s.converged && vec3_is_finite(s.foot));
}

// On the axis of a tube all closest points are equally near; the result is the radius, and the same each time.
static void tube_axis(void **state)
{
    (void)state;
    enum { N = 21 };
    Vec3 center[N];
    double width[N];
    for (int j = 0; j < N; j++) {
        center[j] = vec3(0.5 * (j - N / 2), 0, 0);
        width[j] = 0.3;
    }
    Blobby tube = {.count = N, .center = center, .width = width, .iso_level = 0.1};
    SurfacePoint off = blobby_project(&tube, vec3(0, 0.3, 0), vec3(0, 0.3, 0));
    SurfacePoint on = blobby_project(&tube, vec3(0, 0, 0), vec3(0, 0, 0)), again = blobby_project(&tube, vec3(0, 0, 0), vec3(0, 0, 0));
    assert_true(off.converged && on.converged);
    assert_near(on.distance, off.distance + 0.3, 1e-9);
    assert_true(vec3_distance(on.foot, again.foot) == 0);
}

// The smallest distance over a dense sampling of the surface: all crossings of rays from the centre of every blob.
static double sampled_distance(const Blobby *m, Vec3 x)
{
    enum { RAYS = 900, STEPS = 60 };
    double best = HUGE_VAL, reach = 4;
    for (int j = 0; j < m->count; j++)
        for (int k = 0; k < RAYS; k++) {
            double z = 1 - (2 * k + 1.0) / RAYS, a = 2.399963229728653 * k, r = sqrt(1 - z * z);
            Vec3 u = {r * cos(a), r * sin(a), z};
            double before = blobby_field(m, m->center[j]);
            for (int i = 1; i <= STEPS; i++) {
                double t = reach * i / STEPS, now = blobby_field(m, vec3_add_scaled(m->center[j], t, u));
                if ((now > 0) != (before > 0)) {
                    double ta = t - (reach / STEPS) * (now / (now - before));
                    double d = vec3_distance(vec3_add_scaled(m->center[j], ta, u), x);
                    best = d < best ? d : best;
                }
                before = now;
            }
        }
    return best;
}

static void closest_against_sampling(void **state)
{
    (void)state;
    uint64_t seed = 3;
    int trials = 120;
    for (int trial = 0; trial < trials; trial++) {
        Vec3 center[BLOBS], x = random_in_box(&seed, trial % 3 == 0 ? 4 : 1.5);
        double width[BLOBS];
        Blobby m = random_model(&seed, center, width);
        SurfacePoint s = blobby_project(&m, x, x);
        double sampled = sampled_distance(&m, x), f = blobby_field(&m, x);
        assert_true(s.converged);
        check_on_surface(&m, x, &s);
        assert_true((s.distance > 0) == (f > 0));
        assert_true(sampled > fabs(s.distance) - 5e-3);   // crossings are interpolated
    }
}

// Inside, at a maximum of the field (no gradient) or anywhere, for any start: the sign of the distance is that of f, and there is no wall before the foot.
static void own_side_from_any_start(void **state)
{
    (void)state;
    uint64_t seed = 5;
    int inside = 0;
    for (int trial = 0; trial < 6000; trial++) {
        Vec3 center[BLOBS], x, g;
        double width[BLOBS];
        Blobby m = random_model(&seed, center, width);
        for (int j = 0; j < BLOBS; j++)
            width[j] *= 0.6;   // lobes and bridges
        x = center[trial % BLOBS];
        for (int i = 0; i < 300 && trial % 2; i++) {
            blobby_gradient(&m, x, &g);
            x = vec3_add_scaled(x, 0.1, g);
        }
        double f = blobby_field(&m, x);
        SurfacePoint s = blobby_project(&m, x, vec3_add(x, random_in_box(&seed, 2)));
        if (!(f > 0))
            continue;
        inside++;
        assert_true(s.converged);
        check_on_surface(&m, x, &s);
        assert_true(s.distance > 0);
    }
    assert_true(inside > 4000);
}

// Where the field is flat, the first foot may be on any wall: the nearest one is found nevertheless.
static void nearest_from_a_top_of_the_field(void **state)
{
    (void)state;
    uint64_t seed = 6;
    for (int trial = 0; trial < 60; trial++) {
        Vec3 center[BLOBS], g;
        double width[BLOBS];
        Blobby m = random_model(&seed, center, width);
        Vec3 x = center[trial % BLOBS];
        for (int i = 0; i < 300; i++) {
            blobby_gradient(&m, x, &g);
            x = vec3_add_scaled(x, 0.1, g);
        }
        SurfacePoint s = blobby_project(&m, x, x);
        assert_true(s.converged && s.distance > 0 && blobby_field(&m, x) > 0);
        assert_true(sampled_distance(&m, x) > s.distance - 5e-3);
    }
}

// A row of blobs that becomes thinner: at its middle the field falls fastest along the row, but the nearest wall is at the side.
static void tapered_row(void **state)
{
    (void)state;
    enum { N = 13 };
    for (int turn = 0; turn < 12; turn++) {
        Vec3 center[N], axis = vec3_unit(vec3(cos(turn), sin(turn), 0.3 * turn - 1.5));
        double width[N];
        for (int j = 0; j < N; j++) {
            center[j] = vec3_scale(axis, 0.5 * (j - N / 2));
            width[j] = 0.25 + 0.008 * j;
        }
        Blobby m = {.count = N, .center = center, .width = width, .iso_level = 0.1};
        for (double s = -2; s <= 2; s += 0.25) {
            Vec3 x = vec3_scale(axis, s);
            SurfacePoint p = blobby_project(&m, x, x);
            assert_true(p.converged);
            double wide = 0;   // radius of the section here: the nearest wall may not be further away
            for (double step = 1; step > 1e-10; step /= 2)
                if (blobby_field(&m, vec3_add_scaled(x, wide + step, vec3_normal_to(axis))) > 0)
                    wide += step;
            assert_true(p.distance <= wide + 1e-9);
        }
    }
}

// Near the surface there is only one lobe: the foot is the closest point for any model.
static void closest_near_the_surface(void **state)
{
    (void)state;
    uint64_t seed = 4;
    for (int trial = 0; trial < 3000; trial++) {
        Vec3 center[BLOBS];
        double width[BLOBS];
        Blobby m = random_model(&seed, center, width);
        SurfacePoint on = blobby_project(&m, random_in_box(&seed, 2), vec3(0, 0, 0));
        assert_true(on.converged);
        // within a third of the radius of curvature, the foot of foot + d n is the foot again
        double stiff = fabs(on.shape.xx) + fabs(on.shape.yy) + fabs(on.shape.zz) + 2 * (fabs(on.shape.xy) + fabs(on.shape.xz) + fabs(on.shape.yz));
        double d = random_in(&seed, -0.3, 0.3) * fmin(1 / stiff, 0.2);
        Vec3 x = vec3_add_scaled(on.foot, d, on.normal);
        SurfacePoint s = blobby_project(&m, x, x);
        assert_true(s.converged);
        assert_true(fabs(s.distance) <= fabs(d) + 1e-9 && s.distance * d > 0);
        if (vec3_distance(s.foot, on.foot) < 0.1 / stiff)
            assert_near(s.distance, d, 1e-9);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(radius_table),
        cmocka_unit_test(split_table),
        cmocka_unit_test(derivatives_of_second_order),
        cmocka_unit_test(curvature_of_a_sphere),
        cmocka_unit_test(sphere_is_exact),
        cmocka_unit_test(centre_and_far_away),
        cmocka_unit_test(tube_axis),
        cmocka_unit_test(tapered_row),
        cmocka_unit_test(closest_against_sampling),
        cmocka_unit_test(closest_near_the_surface),
        cmocka_unit_test(own_side_from_any_start),
        cmocka_unit_test(nearest_from_a_top_of_the_field),
    };
    return cmocka_run_group_tests_name("blobby", tests, NULL, NULL);
}
