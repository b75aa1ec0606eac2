// The C-arm's projection, without GL.
#include "sim/c_arm.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "../geom/near.h"
#include "../geom/random_numbers.h"

static CArm place(double lao, double cra, const PatientAxes *axes)
{
    XrayControl xray = xray_default_control();
    xray.lao_deg = (float)lao;
    xray.cra_deg = (float)cra;
    return c_arm_place(&xray, axes);
}

static void views_are_those_of_the_angio_suite(void **state)
{
    (void)state;
    PatientAxes lps = patient_axes_lps();
    // LPS: x left, y posterior, z superior. Frontal view: the patient's left on the right, head up, the front nearer to the detector
    CArm c = place(0, 0, &lps);
    Vec3 left = c_arm_project(&c, vec3(10, 0, 0)), front = c_arm_project(&c, vec3(0, -10, 0)), head = c_arm_project(&c, vec3(0, 0, 10));
    assert_near(left.x, 10.0 / 160, 1e-12);
    assert_near(head.y, 10.0 / 160, 1e-12);
    assert_near(front.z, 10, 1e-12);
    // LAO 90: the detector is at the left side; the front is on the left of the picture
    c = place(90, 0, &lps);
    assert_near(c_arm_project(&c, vec3(10, 0, 0)).z, 10, 1e-6);
    assert_near(c_arm_project(&c, vec3(0, -10, 0)).x, -10.0 / 160, 1e-8);
    assert_near(c_arm_project(&c, vec3(0, 0, 10)).y, 10.0 / 160, 1e-12);
    // RAO 90 is the view from the other side; CRA from the head, CAU from the feet
    c = place(-90, 0, &lps);
    assert_near(c_arm_project(&c, vec3(10, 0, 0)).z, -10, 1e-6);
    c = place(0, 45, &lps);
    assert_true(c_arm_project(&c, vec3(0, 0, 10)).z > 7 && c_arm_project(&c, vec3(0, -10, 0)).y < -0.04);
    c = place(0, -45, &lps);
    assert_true(c_arm_project(&c, vec3(0, 0, 10)).z < -7);
    // values out of range are clamped, NaN becomes 0
    CArm far = place(1000, 1000, &lps), most = place(90, 45, &lps);
    assert_near(vec3_distance(far.towards, most.towards), 0, 1e-12);
    CArm lost = place(NAN, 0, &lps), frontal = place(0, 0, &lps);
    assert_near(vec3_distance(lost.towards, frontal.towards), 0, 1e-12);
}

static void a_quarter_turn_is_the_other_plane(void **state)
{
    (void)state;
    // rotating the C-arm by 90 degrees or the patient by -90 gives the same
    PatientAxes lps = patient_axes_lps();
    CArm frontal = place(0, 0, &lps), lateral = place(90, 0, &lps);
    uint64_t seed = 3;
    for (int i = 0; i < 100; i++) {
        Vec3 p = random_in_box(&seed, 60), turned = vec3(p.y, -p.x, p.z);   // left to the front, the front to the right
        assert_near(vec3_distance(c_arm_project(&lateral, p), c_arm_project(&frontal, turned)), 0, 1e-6);
    }
}

static void frames_and_mirrors_agree(void **state)
{
    (void)state;
    PatientAxes lps = patient_axes_lps(), ras = patient_axes_ras(), mirrored = lps;
    mirrored.right = vec3_negate(mirrored.right);
    uint64_t seed = 5;
    for (int i = 0; i < 100; i++) {
        double lao = random_in(&seed, -90, 90), cra = random_in(&seed, -45, 45);
        Vec3 p = random_in_box(&seed, 80);
        CArm a = place(lao, cra, &lps), b = place(lao, cra, &ras), c = place(lao, cra, &mirrored), d = place(-lao, cra, &lps);
        Vec3 q = c_arm_project(&a, p), other = vec3(-p.x, p.y, p.z);
        // the same patient in the other frame
        assert_near(vec3_distance(q, c_arm_project(&b, vec3(-p.x, -p.y, p.z))), 0, 1e-12);
        // a mirrored patient with mirrored axes: the same picture; with the same axes and the angle mirrored: the mirrored picture
        assert_near(vec3_distance(q, c_arm_project(&c, other)), 0, 1e-12);
        Vec3 m = c_arm_project(&d, other);
        assert_near(fabs(m.x + q.x) + fabs(m.y - q.y) + fabs(m.z - q.z), 0, 1e-9);
        assert_near(a.handedness, 1, 0);
        assert_near(c.handedness, -1, 0);
    }
    assert_true(patient_axes_are_sound(&lps) && patient_axes_are_sound(&ras) && patient_axes_are_sound(&mirrored));
    mirrored.anterior.z = 0.1;
    assert_false(patient_axes_are_sound(&mirrored));
}

static void rays_matrix_and_magnification_agree(void **state)
{
    (void)state;
    PatientAxes lps = patient_axes_lps();
    uint64_t seed = 7;
    for (int i = 0; i < 200; i++) {
        float lao = (float)random_in(&seed, -90, 90), cra = (float)random_in(&seed, -45, 45), field = (float)random_in(&seed, 40, 400);
        XrayControl xray = {.lao_deg = lao, .cra_deg = cra, .field_mm = field, .table_mm = {300, -200, 100}};
        CArm c = c_arm_place(&xray, &lps);
        Vec3 p = vec3_add(vec3(300, -200, 100), random_in_box(&seed, 100)), q = c_arm_project(&c, p);
        // the ray of the projected position passes through the point
        Vec3 from = vec3_sub(p, c_arm_source(&c));
        assert_near(vec3_norm(vec3_cross(c_arm_ray(&c, q.x, q.y), from)), 0, 1e-9 * vec3_norm(from));
        // the matrix gives the same, in clip space of the square
        float m[16];
        Vec3 origin = vec3(290, -190, 90), d = vec3_sub(p, origin);
        c_arm_matrix(&c, origin, 10, 8000, m);
        double clip[4];
        for (int k = 0; k < 4; k++)
            clip[k] = (double)m[k] * d.x + (double)m[4 + k] * d.y + (double)m[8 + k] * d.z + (double)m[12 + k];
        assert_near(clip[0] / clip[3] / 2, q.x, 1e-5);
        assert_near(clip[1] / clip[3] / 2, q.y, 1e-5);
        assert_near(clip[3], C_ARM_SOURCE_MM + q.z, 1e-3);
    }
    // magnification by the ratio of distances to the source
    CArm c = place(0, 0, &lps);
    double near = c_arm_project(&c, vec3(10, 100, 0)).x, far = c_arm_project(&c, vec3(10, -100, 0)).x;
    assert_near(near / far, (C_ARM_SOURCE_MM + 100) / (C_ARM_SOURCE_MM - 100), 1e-12);
}

static void angles_are_written_as_on_the_screen(void **state)
{
    (void)state;
    char text[32];
    XrayControl xray = {.lao_deg = 20, .cra_deg = -10.4f};
    c_arm_label(&xray, text);
    assert_string_equal(text, "LAO 20  CAU 10");
    xray = (XrayControl){.lao_deg = -90, .cra_deg = 45};
    c_arm_label(&xray, text);
    assert_string_equal(text, "RAO 90  CRA 45");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(views_are_those_of_the_angio_suite),
        cmocka_unit_test(a_quarter_turn_is_the_other_plane),
        cmocka_unit_test(frames_and_mirrors_agree),
        cmocka_unit_test(rays_matrix_and_magnification_agree),
        cmocka_unit_test(angles_are_written_as_on_the_screen),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
