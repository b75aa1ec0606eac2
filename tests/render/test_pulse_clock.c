// X-ray pulses in simulated time: the first at once, then at the rate, for any step of time; last image hold; the dose counts all pulses.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "render/pulse_clock.h"

#include <math.h>

static XrayControl held(double pulses_s)
{
    XrayControl xray = xray_default_control();
    xray.pedal = 1;
    xray.pulses_s = (float)pulses_s;
    return xray;
}

static void pulses_come_at_their_rate(void **state)
{
    (void)state;
    const double rates[] = {7.5, 10, 15, 30};
    for (int r = 0; r < 4; r++) {
        XrayControl xray = held(rates[r]), up = xray_default_control();
        PulseClock clock = pulse_clock_start(0);
        assert_false(pulse_clock_advance(&clock, 0.05, &up));
        assert_true(clock.last_s == -1);
        int step = 51;
        assert_true(pulse_clock_advance(&clock, 0.001 * step, &xray));
        double first = clock.last_s;
        for (step++; step <= 51 + 10000; step++)
            if (pulse_clock_advance(&clock, 0.001 * step, &xray)) {
                // with the step that reaches it
                double ideal = first + (double)(clock.count - 1) / rates[r];
                assert_true(clock.last_s > ideal - 1e-6 && clock.last_s < ideal + 0.001);
            }
        assert_int_equal(clock.count, 10 * rates[r] + 1);
        assert_true(fabs(clock.pedal_s - 10) < 1e-9);
    }
}

// Ten seconds in intervals of 1, 7, 10, 33.3 or 100 ms give the same dose; a late call draws once and counts all pulses.
static void the_dose_does_not_depend_on_who_looks(void **state)
{
    (void)state;
    const double looks[] = {0.001, 0.007, 0.01, 1.0 / 30, 0.1};
    for (int k = 0; k < 5; k++) {
        XrayControl xray = held(30);
        PulseClock clock = pulse_clock_start(0);
        int drawn = 0;
        for (int i = 0; i * looks[k] < 9.99; i++)
            drawn += pulse_clock_advance(&clock, i * looks[k], &xray);
        pulse_clock_advance(&clock, 9.99, &xray);
        assert_int_equal(clock.count, 300);
        assert_true(drawn <= 300 && drawn >= (looks[k] > 0.05 ? 99 : 299));
    }
}

static void the_last_image_holds(void **state)
{
    (void)state;
    XrayControl xray = held(15), up = xray_default_control();
    PulseClock clock = pulse_clock_start(0);
    assert_true(pulse_clock_advance(&clock, 1, &xray));
    assert_false(pulse_clock_advance(&clock, 1.01, &xray));
    for (int i = 0; i < 1000; i++)
        assert_false(pulse_clock_advance(&clock, 1.02 + 0.01 * i, &up));
    assert_true(clock.last_s == 1 && clock.count == 1);
    // pressed again: at once
    assert_true(pulse_clock_advance(&clock, 12, &xray));
    assert_false(pulse_clock_advance(&clock, 12.06, &xray));
    assert_true(pulse_clock_advance(&clock, 12.07, &xray));
    assert_int_equal(clock.count, 3);
}

static void a_new_rate_begins_at_once(void **state)
{
    (void)state;
    XrayControl slow = held(10), fast = held(30);
    PulseClock clock = pulse_clock_start(0);
    assert_true(pulse_clock_advance(&clock, 0, &slow));
    assert_false(pulse_clock_advance(&clock, 0.099, &slow));
    assert_true(pulse_clock_advance(&clock, 0.1, &slow));
    assert_true(pulse_clock_advance(&clock, 0.12, &fast));
    assert_false(pulse_clock_advance(&clock, 0.153, &fast));
    assert_true(pulse_clock_advance(&clock, 0.154, &fast));
    assert_int_equal(clock.count, 4);
    assert_true(fabs(clock.pedal_s - 0.154) < 1e-12);
}

static void a_step_back_is_a_new_press(void **state)
{
    (void)state;
    XrayControl xray = held(15);
    PulseClock clock = pulse_clock_start(0);
    assert_true(pulse_clock_advance(&clock, 5, &xray));
    assert_true(pulse_clock_advance(&clock, 2, &xray));
    assert_false(pulse_clock_advance(&clock, 2.01, &xray));
    assert_true(clock.pedal_s < 0.011);
}

static void rates_stay_within_what_tubes_do(void **state)
{
    (void)state;
    const double asked[] = {-5, 0, 7.5, 12, 30, 1e9, NAN}, got[] = {7.5, 7.5, 7.5, 12, 30, 30, 15};
    for (int i = 0; i < 7; i++) {
        XrayControl xray = held(asked[i]);
        assert_true(pulse_clock_rate(&xray) == got[i]);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(pulses_come_at_their_rate),  cmocka_unit_test(the_dose_does_not_depend_on_who_looks),
        cmocka_unit_test(the_last_image_holds),       cmocka_unit_test(a_new_rate_begins_at_once),
        cmocka_unit_test(a_step_back_is_a_new_press), cmocka_unit_test(rates_stay_within_what_tubes_do),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
