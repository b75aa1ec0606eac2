// The patient made of solids: exact lengths of rays, the same on both sides, bones where the landmarks say.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "../geom/near.h"
#include "../geom/random_numbers.h"
#include "render/patient_body.h"
#include "sim/clock.h"
#include "sim/patient_landmarks.h"

static Vec3 random_point(uint64_t *seed, double size) { return vec3(random_in(seed, -size, size), random_in(seed, -size, size), random_in(seed, -size, size)); }

// The attenuation that a solid adds at a point.
static double shape_at(const BodyShape *shape, Vec3 x)
{
    double square = vec3_norm2(mat3_mul_vec(&shape->to_unit, vec3_sub(x, shape->center)));
    bool inside = square <= 1;
    for (int k = 0; k < 2; k++)
        inside &= vec3_dot(shape->plane[k], x) <= shape->offset[k];
    return !inside ? 0 : square <= shape->hollow * shape->hollow ? shape->filling : shape->wall;
}

static double body_at(const Body *body, Vec3 x)
{
    double sum = 0;
    for (int i = 0; i < body->count; i++)
        sum += shape_at(&body->shape[i], x);
    return sum;
}

static double body_along(const Body *body, Vec3 from, Vec3 direction)
{
    double sum = 0;
    for (int i = 0; i < body->count; i++)
        sum += body_shape_along(&body->shape[i], from, direction);
    return sum;
}

// --- lengths ---

static void chords_are_exact(void **state)
{
    (void)state;
    uint64_t seed = 3;
    for (int round = 0; round < 100; round++) {
        const double radius = random_in(&seed, 0.5, 80), inner = random_in(&seed, 0, 0.95), off = random_in(&seed, 0, 1) * radius,
                     cap = random_in(&seed, -1, 1) * radius;
        const Vec3 center = random_point(&seed, 200), along = vec3_unit(random_point(&seed, 1)), aside = vec3_normal_to(along);
        Vec3 from = vec3_add_scaled(vec3_add_scaled(center, off, aside), -700, along);
        Body body = {0};
        BodyShape *ball = body_add_ellipsoid(&body, &(BodyEllipsoid){.center = center, .semi = {radius, radius, radius}, .attenuation = 2});
        double chord = 2 * sqrt(radius * radius - off * off);
        assert_near(body_shape_along(ball, from, along), 2 * chord, 1e-9);
        assert_near(body_shape_along(ball, vec3_add_scaled(from, 700, along), along), chord, 1e-9);      // from within: what lies ahead
        assert_near(body_shape_along(ball, vec3_add_scaled(from, 1500, along), along), 0, 0);
        // hollow
        body_shape_hollow(ball, inner, -1);
        double hole = inner * radius > off ? 2 * sqrt(inner * radius * inner * radius - off * off) : 0;
        assert_near(body_shape_along(ball, from, along), 2 * (chord - hole) - hole, 1e-9);
        // cut across the ray, and along it
        body_shape_hollow(ball, 0, 0);
        body_shape_clip(ball, 0, along, vec3_dot(along, center) + cap);
        assert_near(body_shape_along(ball, from, along), 2 * fmin(fmax(cap + chord / 2, 0), chord), 1e-9);
        body_shape_clip(ball, 1, aside, vec3_dot(aside, center) + off + (round % 2 ? 1e-6 : -1e-6));
        assert_near(body_shape_along(ball, from, along), round % 2 ? 2 * fmin(fmax(cap + chord / 2, 0), chord) : 0, 1e-9);
        body_free(&body);
        // a round tube, obliquely: its chord over the sine of the angle
        const Vec3 point[2] = {vec3_add_scaled(center, -1000, aside), vec3_add_scaled(center, 1000, aside)};
        const TubeSize semi[2] = {{radius, radius}, {radius, radius}};
        body_add_tube(&body, &(BodyTube){.wall = 1, .filling = 1}, 2, point, semi);
        double slope = random_in(&seed, -1, 1);
        Vec3 ray = vec3_unit(vec3_add_scaled(along, slope, aside)), beside = vec3_cross(aside, along);
        assert_near(body_shape_along(&body.shape[0], vec3_add_scaled(vec3_add_scaled(center, off, beside), -300, ray), ray), chord * sqrt(1 + slope * slope),
                    1e-8);
        body_free(&body);
    }
}

// A ray's length in any solid is that of its points which lie inside.
static void rays_see_what_points_are_in(void **state)
{
    (void)state;
    uint64_t seed = 9;
    enum { STEPS = 20000 };
    for (int round = 0; round < 60; round++) {
        Body body = {0};
        BodyEllipsoid egg = {random_point(&seed, 10),
                             {random_in(&seed, 3, 30), random_in(&seed, 3, 30), random_in(&seed, 3, 30)},
                             quat_from_rotation_vector(random_point(&seed, 2)),
                             1};
        BodyShape *shape = body_add_ellipsoid(&body, &egg);
        body_shape_hollow(shape, random_in(&seed, 0, 0.9), 0.3);
        for (int k = 0; k < 2; k++)
            body_shape_clip(shape, k, vec3_unit(random_point(&seed, 1)), random_in(&seed, -2, 10));
        const Vec3 bend[4] = {random_point(&seed, 30), random_point(&seed, 30), random_point(&seed, 30), random_point(&seed, 30)};
        const TubeSize semi[4] = {{5, 2}, {4, 3}, {4, 4}, {2, 1}};
        body_add_tube(&body, &(BodyTube){.width = random_point(&seed, 1), .hollow = 0.6, .wall = 1, .filling = 0.2, .is_closed = round % 2}, 4, bend, semi);
        Vec3 from = vec3_scale(vec3_unit(random_point(&seed, 1)), 200), along = vec3_unit(vec3_sub(random_point(&seed, 12), from));
        for (int i = 0; i < body.count; i++) {
            double sum = 0;
            for (int k = 0; k < STEPS; k++)
                sum += shape_at(&body.shape[i], vec3_add_scaled(from, (k + 0.5) * 400 / STEPS, along)) * 400 / STEPS;
            assert_near(body_shape_along(&body.shape[i], from, along), sum, 4 * 400.0 / STEPS);     // up to four borders, each within a step
            // and the box contains it
            if (sum > 0)
                for (int k = 0; k < STEPS; k += 7) {
                    Vec3 x = vec3_add_scaled(from, (k + 0.5) * 400 / STEPS, along), d = vec3_sub(x, body.shape[i].center);
                    for (int j = 0; j < 3 && shape_at(&body.shape[i], x) > 0; j++)
                        assert_true(fabs(vec3_dot(d, body.shape[i].reach[j])) <= 1.0001 * vec3_norm2(body.shape[i].reach[j]));
                }
        }
        body_free(&body);
    }
}

// A straight tube in two pieces is the same as in one: mitres neither overlap nor gape.
static void pieces_join(void **state)
{
    (void)state;
    uint64_t seed = 21;
    const Vec3 whole[2] = {{-30, 0, 0}, {30, 0, 0}}, halves[3] = {{-30, 0, 0}, {4, 0, 0}, {30, 0, 0}}, bent[3] = {{-30, 0, 0}, {0, 0, 0}, {0, 30, 0}};
    const TubeSize semi[3] = {{4, 4}, {4, 4}, {4, 4}};
    const BodyTube tube = {.hollow = 0.7, .wall = 1, .filling = 0.4};
    Body one = {0}, two = {0}, elbow = {0};
    body_add_tube(&one, &tube, 2, whole, semi);
    body_add_tube(&two, &tube, 3, halves, semi);
    body_add_tube(&elbow, &tube, 3, bent, semi);
    for (int i = 0; i < 2000; i++) {
        Vec3 from = vec3_scale(vec3_unit(random_point(&seed, 1)), 100), along = vec3_unit(vec3_sub(random_point(&seed, 8), from));
        assert_near(body_along(&two, from, along), body_along(&one, from, along), 1e-9);
        // around the elbow, no point is counted twice
        Vec3 x = random_point(&seed, 6);
        assert_true(body_at(&elbow, x) <= 1);
    }
    body_free(&one);
    body_free(&two);
    body_free(&elbow);
}

// --- the patient ---

static Body whole_patient(void)
{
    Body body = {0};
    assert_true(body_add_patient(&body));
    return body;
}

static void the_head_is_the_same_on_both_sides(void **state)
{
    (void)state;
    Body body = {0};
    body_add_head_tissue(&body);
    body_add_skull(&body);
    body_add_jaws(&body);
    body_add_neck(&body);
    uint64_t seed = 1;
    double most = 0;
    for (int i = 0; i < 3000; i++) {
        Vec3 from = vec3_scale(vec3_unit(random_point(&seed, 1)), 700), along = vec3_unit(vec3_sub(random_point(&seed, 80), from));
        double a = body_along(&body, from, along), b = body_along(&body, vec3(-from.x, from.y, from.z), vec3(-along.x, along.y, along.z));
        assert_near(a, b, 1e-9);
        most = fmax(most, a);
    }
    assert_true(most > 4);
    body_free(&body);
}

// Nothing is more transparent than air: cavities lie in tissue.
static void tissue_is_tissue(void **state)
{
    (void)state;
    Body body = whole_patient();
    uint64_t seed = 8;
    double least = HUGE_VAL, most = 0;
    int thin = 0;
    for (int i = 0; i < 60000; i++) {
        Vec3 x = vec3(random_in(&seed, -200, 200), random_in(&seed, -150, 100), random_in(&seed, -720, 110));
        double a = body_at(&body, x);
        thin += a < -1e-9;
        if (a < least) {
            least = a;
            if (a < -1e-9)
                print_message("%.4f at %.1f %.1f %.1f\n", a, x.x, x.y, x.z);
        }
        most = fmax(most, a);
    }
    print_message("attenuation %.4f to %.4f / mm, %d points below air\n", least, most, thin);
    assert_true(least > -1.01 * ATTENUATION_SOFT && thin < 60);      // where two bronchi overlap, at most one is too much
    assert_true(most < 2 * ATTENUATION_TOOTH);
    body_free(&body);
}

static double mean_at(const Body *body, Vec3 x, double size)
{
    uint64_t seed = 2;
    double sum = 0;
    for (int i = 0; i < 400; i++)
        sum += body_at(body, vec3_add(x, random_point(&seed, size)));
    return sum / 400;
}

static void organs_are_where_they_belong(void **state)
{
    (void)state;
    Body body = whole_patient();
    static const struct {
        const char *name;
        Vec3 at;
        double size, low, high;
    } places[] = {
        {"brain", {20, -30, 50}, 8, 0.9 * ATTENUATION_SOFT, 1.1 * ATTENUATION_SOFT},
        {"outer table", {0, -19.5, 97.3}, 0.4, 0.8 * ATTENUATION_BONE, ATTENUATION_BONE * 1.05},
        {"outside", {0, 120, 0}, 5, 0, 0},
        {"sphenoid sinus", {7, 17, -13}, 3, -0.002, 0.3 * ATTENUATION_SOFT},
        {"maxillary sinus", {28, 42, -38}, 8, -0.002, 0.3 * ATTENUATION_SOFT},
        {"frontal sinus", {8, 64, 20}, 2, -0.002, 0.3 * ATTENUATION_SOFT},
        {"trachea", {0, -16, -200}, 3, -0.002, 0.3 * ATTENUATION_SOFT},
        {"labyrinth", {36, -28, -15}, 2, ATTENUATION_BONE, 2 * ATTENUATION_BONE},
        {"crown of an incisor", {4.2, 71, -63}, 0.8, 0.8 * ATTENUATION_TOOTH, 1.3 * ATTENUATION_TOOTH},
        {"right lung", {80, 10, -330}, 8, 0.5 * ATTENUATION_LUNG, 0.8 * ATTENUATION_SOFT},
        {"left lung", {-100, -60, -300}, 8, 0.5 * ATTENUATION_LUNG, 0.8 * ATTENUATION_SOFT},
        {"heart", {-50, 20, -345}, 8, 0.8 * ATTENUATION_SOFT, 1.2 * ATTENUATION_SOFT},
        {"liver", {80, -20, -430}, 8, 0.8 * ATTENUATION_SOFT, 1.2 * ATTENUATION_SOFT},
        {"body of T7", {0, -75, -297}, 5, 1.02 * ATTENUATION_SOFT, ATTENUATION_BONE},
    };
    for (size_t i = 0; i < sizeof places / sizeof *places; i++) {
        double a = mean_at(&body, places[i].at, places[i].size);
        if (!(a >= places[i].low && a <= places[i].high))
            fail_msg("%s: %.4f / mm, expected %.4f to %.4f", places[i].name, a, places[i].low, places[i].high);
    }
    body_free(&body);
}

static int segment_of(const char *name)
{
    for (int i = 0; patient_segment_name[i]; i++)
        if (!strcmp(patient_segment_name[i], name))
            return i;
    fail_msg("no segment %s", name);
    return -1;
}

// The siphon lies beside the sella, the arch before the fourth thoracic vertebra, the petrous part of the carotid in the pyramid.
static void vessels_run_beside_their_bones(void **state)
{
    (void)state;
    Vec3 at, mirrored;
    assert_true(patient_landmark_at("siphon", segment_of("right_internal_carotid"), &at));
    assert_true(at.x > 7 && at.x < 16 && vec3_norm(at) < 16);
    assert_true(patient_landmark_at("siphon", segment_of("left_internal_carotid"), &mirrored));
    assert_near(vec3_distance(mirrored, vec3(-at.x, at.y, at.z)), 0, 0);
    assert_true(patient_landmark_at("left_siphon", segment_of("right_internal_carotid"), &at));
    assert_near(vec3_distance(mirrored, at), 0, 0);
    assert_false(patient_landmark_at("siphon", segment_of("aortic_arch"), &at));
    assert_false(patient_landmark_at("left_aortic_valve", segment_of("aortic_arch"), &at));
    assert_false(patient_landmark_at("left_", segment_of("aortic_arch"), &at));
    assert_true(patient_landmark_at("arch_top", segment_of("aortic_arch"), &at));
    Vec3 fourth = vertebra_center[FIRST_THORACIC + 3];
    assert_true(fabs(at.x) < 14 && fabs(at.z - fourth.z) < 12 && at.y > fourth.y + 12 && at.y < fourth.y + 45);
    // in the pyramid there is bone around the artery
    Body body = whole_patient();
    assert_true(patient_landmark_at("petrous_bend", segment_of("right_internal_carotid"), &at));
    assert_true(mean_at(&body, at, 5) > 1.3 * ATTENUATION_SOFT);
    body_free(&body);
    for (int i = 0; patient_segment_name[i]; i++) {
        assert_string_equal(patient_segment_name[i], patient_segment[i].name);
        assert_int_equal(patient_segment[i].side, !strncmp(patient_segment[i].name, "left_", 5) ? -1 : !strncmp(patient_segment[i].name, "right_", 6) ? 1 : 0);
    }
}

static void it_is_made_at_once(void **state)
{
    (void)state;
    double begin = clock_s(CLOCK_PROCESS_CPUTIME_ID);
    Body body = whole_patient();
    double spent = clock_s(CLOCK_PROCESS_CPUTIME_ID) - begin;
    print_message("%d solids in %.1f ms of CPU time\n", body.count, 1000 * spent);
    assert_true(spent < 0.25);
    body_free(&body);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(chords_are_exact),
        cmocka_unit_test(rays_see_what_points_are_in),
        cmocka_unit_test(pieces_join),
        cmocka_unit_test(the_head_is_the_same_on_both_sides),
        cmocka_unit_test(tissue_is_tissue),
        cmocka_unit_test(organs_are_where_they_belong),
        cmocka_unit_test(vessels_run_beside_their_bones),
        cmocka_unit_test(it_is_made_at_once),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
