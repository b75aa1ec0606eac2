// The dose against computations by hand: inverse square law, size of the field, pulses, automatic exposure.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "sim/xray_tube.h"

#include <math.h>

#define assert_near(a, b, tolerance) assert_true(fabs((a) - (b)) <= (tolerance))

static XrayControl pedal_down(void)
{
    XrayControl xray = xray_default_control();
    xray.pedal = 1;
    return xray;
}

static void the_output_falls_with_the_square_of_the_distance(void **state)
{
    (void)state;
    // 0.008373 80^1.983 at 1016 mm
    assert_near(xray_output_ugy_mas(80, 1016), 49.74, 0.01);
    assert_near(xray_output_ugy_mas(80, 508) / xray_output_ugy_mas(80, 1016), 4, 1e-12);
    assert_near(XRAY_SOURCE_MM - XRAY_REFERENCE_MM, 150, 0);
}

static void a_head_from_the_front_is_computed_by_hand(void **state)
{
    (void)state;
    XrayPatient head = xray_patient_head();
    XrayControl xray = pedal_down();
    XrayExposure e = xray_expose(&head, &xray);
    const double water = 2 * 98 * 1.05, kv = 50 + 0.13 * water;      // 205.8 mm, 76.754 kV
    assert_near(e.kv, kv, 1e-9);
    // at 53.73 keV water attenuates by 0.2184 / cm: log-log between 0.2269 at 50 and 0.2059 at 60 keV
    const double mu = 0.02269 * pow(0.02059 / 0.02269, log(0.7 * kv / 50) / log(60.0 / 50));
    assert_near(mu, 0.02184, 1e-5);
    const double detector_ugy = 0.03 * 220 / (160 * 1100 / 785.0), kerma_ugy = detector_ugy / (2 / 3.0 * exp(-mu * water)) * pow(1100 / 635.0, 2);
    assert_near(1000 * e.kerma_mgy, kerma_ugy, 1e-9 * kerma_ugy);
    assert_near(e.rate_mgy_min, kerma_ugy / 1000 * 15 * 60, 1e-6);
    // the current by the inverse square law from the focal spot to 1016 mm
    const double mas = kerma_ugy * pow(635 / 1016.0, 2) / (0.008373 * pow(kv, 1.983));
    assert_near(e.ma, mas / 0.008, 1e-9);
}

static void the_dose_area_product_is_the_same_at_any_distance(void **state)
{
    (void)state;
    XrayPatient head = xray_patient_head();
    XrayControl xray = pedal_down();
    XrayExposure e = xray_expose(&head, &xray);
    const double at_isocentre = e.kerma_mgy / 1000 * pow(635 / 785.0, 2) * 16 * 16;      // Gy cm2 of 16 x 16 cm
    assert_near(e.kerma_area_gy_cm2, at_isocentre, 1e-12);
    xray.collimator[0] = xray.collimator[1] = 0.5F;      // half the width
    assert_near(xray_expose(&head, &xray).kerma_area_gy_cm2, at_isocentre / 2, 1e-12);
    assert_near(xray_expose(&head, &xray).kerma_mgy, e.kerma_mgy, 0);
    xray = pedal_down();
    xray.field_mm = 80;                                  // twice the air kerma on a quarter of the area
    assert_near(xray_expose(&head, &xray).kerma_mgy, 2 * e.kerma_mgy, 1e-12);
    assert_near(xray_expose(&head, &xray).kerma_area_gy_cm2, at_isocentre / 2, 1e-12);
}

static void thicker_parts_need_more(void **state)
{
    (void)state;
    XrayPatient head = xray_patient_head(), trunk = xray_patient_trunk();
    assert_near(xray_patient_water_mm(&head, 0, 0), 2 * 98 * 1.05, 1e-9);
    assert_near(xray_patient_water_mm(&head, 90, 0), 2 * 78 * 1.05, 1e-9);
    XrayControl front = pedal_down(), side = front, steep = front;
    side.lao_deg = 90;
    steep.cra_deg = 40;
    assert_true(xray_expose(&head, &side).kerma_mgy < xray_expose(&head, &front).kerma_mgy);     // a head is narrower than it is deep
    assert_true(xray_expose(&trunk, &side).kerma_mgy > xray_expose(&trunk, &front).kerma_mgy);
    assert_true(xray_expose(&head, &steep).kv > xray_expose(&head, &front).kv);
    // 289 mm of water and a magnified field would need more than fluoroscopy may give
    side.field_mm = 60;
    assert_near(xray_expose(&trunk, &side).rate_mgy_min, 88, 1e-9);
    side.mode = XRAY_DSA;
    XrayExposure limited = xray_expose(&trunk, &side);
    assert_true(limited.rate_mgy_min > 88);
    assert_true(limited.kv * limited.ma <= 80e3 * (1 + 1e-12));
}

static void dsa_has_its_own_dose(void **state)
{
    (void)state;
    XrayPatient head = xray_patient_head();
    XrayControl xray = pedal_down();
    double live = xray_expose(&head, &xray).kerma_mgy;
    xray.mode = XRAY_DSA;
    assert_near(xray_expose(&head, &xray).kerma_mgy, XRAY_DSA_DOSE * live, 1e-12);
    xray.mode = XRAY_ROADMAP;
    assert_near(xray_expose(&head, &xray).kerma_mgy, live, 0);
}

static void a_meter_adds_up_pulses(void **state)
{
    (void)state;
    XrayPatient head = xray_patient_head();
    XrayControl xray = pedal_down();
    DoseMeter meter = {0};
    for (int i = 0; i < 2000; i++)
        dose_meter_step(&meter, &head, &xray, 0.001);
    XrayExposure e = xray_expose(&head, &xray);
    assert_int_equal(meter.pulses, 30);
    assert_near(meter.kerma_mgy, 30 * e.kerma_mgy, 1e-12);
    assert_near(meter.kerma_area_gy_cm2, 30 * e.kerma_area_gy_cm2, 1e-12);
    assert_near(meter.kerma_mgy, e.rate_mgy_min * 2 / 60, 1e-12);
    xray.pedal = 0;
    for (int i = 0; i < 1000; i++)
        assert_int_equal(dose_meter_step(&meter, &head, &xray, 0.001), 0);
    xray.pedal = 1;
    xray.pulses_s = 30;
    for (int i = 0; i < 1000; i++)
        dose_meter_step(&meter, &head, &xray, 0.001);
    assert_int_equal(meter.pulses, 60);
    assert_near(meter.kerma_mgy, 60 * e.kerma_mgy, 1e-12);
}

// With the second plane on, the same pulses come from two tubes: from the side a trunk is thicker, and the sum is that of both.
static void two_planes_give_the_sum(void **state)
{
    (void)state;
    XrayPatient trunk = xray_patient_trunk();
    XrayControl xray = pedal_down();
    DoseMeter one = {0}, two = {0};
    xray.lao_deg = xray.cra_deg = 0;
    for (int i = 0; i < 2000; i++)
        dose_meter_step(&one, &trunk, &xray, 0.001);
    assert_near(one.second_kerma_mgy + one.second_kerma_area_gy_cm2 + one.second.kv, 0, 0);
    xray.seen = SEEN_KNOWN | SEEN_BIPLANE;
    for (int i = 0; i < 2000; i++)
        dose_meter_step(&two, &trunk, &xray, 0.001);
    xray.lao_deg = 90;
    XrayExposure side = xray_expose(&trunk, &xray);
    assert_int_equal(two.pulses, one.pulses);
    assert_near(two.second_kerma_mgy, (double)two.pulses * side.kerma_mgy, 1e-9);
    assert_near(two.kerma_mgy, one.kerma_mgy + two.second_kerma_mgy, 1e-9);
    assert_near(two.kerma_area_gy_cm2, one.kerma_area_gy_cm2 + (double)two.pulses * side.kerma_area_gy_cm2, 1e-9);
    assert_near(two.area_cm2, 2 * one.area_cm2, 1e-9);
    assert_true(two.second_kerma_mgy > one.kerma_mgy && side.kv > one.last.kv);
    assert_near(two.kv_sum, one.kv_sum, 0);
}

static void the_tree_tells_which_part_it_is(void **state)
{
    (void)state;
    Vec3 center[2] = {{0, 0, 0}, {0, 0, 200}};
    double radius[2] = {2, 2};
    VesselTree tree = {.node_count = 2, .center = center, .radius = radius};
    const Vec3 none = {0, 0, 0};
    assert_near(xray_patient_around(&tree, none, none).half_mm[0], xray_patient_head().half_mm[0], 0);
    assert_near(xray_patient_around(&tree, vec3(0, 0, 1), vec3(1, 0, 0)).half_mm[0], xray_patient_trunk().half_mm[0], 0);   // 204 mm to the front
    center[1].z = 300;
    assert_near(xray_patient_around(&tree, none, none).half_mm[0], xray_patient_trunk().half_mm[0], 0);
    assert_near(xray_patient_around(NULL, none, none).half_mm[0], xray_patient_head().half_mm[0], 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_output_falls_with_the_square_of_the_distance),
        cmocka_unit_test(a_head_from_the_front_is_computed_by_hand),
        cmocka_unit_test(the_dose_area_product_is_the_same_at_any_distance),
        cmocka_unit_test(thicker_parts_need_more),
        cmocka_unit_test(dsa_has_its_own_dose),
        cmocka_unit_test(a_meter_adds_up_pulses),
        cmocka_unit_test(two_planes_give_the_sum),
        cmocka_unit_test(the_tree_tells_which_part_it_is),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
