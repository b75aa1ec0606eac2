// When a window is drawn and at which resolution: a time budget, what counts as a change, enlargement on the CPU.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "render/enlarge.h"
#include "render/redraw.h"
#include "render/time_budget.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// --- the time budget ---

// The cost of a picture: a constant part, and one in proportion to the pixels.
static double cost(const TimeBudget *budget, double constant, double full) { return constant + full * pow(time_budget_share(budget), 2); }

static void draw_pictures(TimeBudget *budget, int count, double constant, double full)
{
    for (int i = 0; i < count; i++)
        time_budget_spend(budget, cost(budget, constant, full));
}

static void the_resolution_falls_until_the_budget_is_kept(void **state)
{
    (void)state;
    TimeBudget budget = {.most_ms = 26};
    draw_pictures(&budget, 300, 5, 20);
    assert_true(time_budget_share(&budget) >= 1);
    draw_pictures(&budget, 100, 5, 60);      // 65, 39, then 20 ms
    assert_true(time_budget_share(&budget) == 0.5);
    assert_true(cost(&budget, 5, 60) < 26);
    int finer = 0;
    for (int i = 0; i < 20000; i++) {        // 39 ms at the next: it is tried seldom, and more and more so
        draw_pictures(&budget, 1, 5, 60);
        finer += time_budget_share(&budget) > 0.5;
    }
    assert_in_range(finer, 12, 120);
    draw_pictures(&budget, 20, 5, 60);
    assert_true(time_budget_share(&budget) == 0.5);
    draw_pictures(&budget, 200, 1, 8);       // cheap again
    assert_true(time_budget_share(&budget) >= 1);
    draw_pictures(&budget, 500, 300, 0);     // no resolution is cheap enough
    assert_true(time_budget_share(&budget) == 0.25);
}

static void one_slow_picture_changes_nothing(void **state)
{
    (void)state;
    TimeBudget budget = {.most_ms = 26}, none = {0};
    draw_pictures(&budget, 50, 10, 0);
    time_budget_spend(&budget, 200);
    draw_pictures(&budget, 50, 10, 0);
    assert_true(time_budget_share(&budget) >= 1);
    draw_pictures(&none, 100, 1000, 0);
    assert_true(time_budget_share(&none) >= 1);
}

// --- changes ---

static WindowInput quiet(void) { return (WindowInput){.width = 800, .height = 600, .scale = 1, .mouse_x = 3, .mouse_y = 4, .has_focus = true}; }

// Draws at 30 pictures a second for `seconds`; returns the number of pictures due.
static int pictures(Redraw *redraw, const WindowInput *input, const Pose *pose, uint64_t settings, double *now_s, double seconds)
{
    int count = 0;
    for (double end = *now_s + seconds; *now_s < end; *now_s += 1 / 30.0)
        count += redraw_is_due(redraw, input, pose, settings, *now_s, 0.5);
    return count;
}

static void a_window_at_rest_is_drawn_twice_a_second(void **state)
{
    (void)state;
    Redraw redraw = {0};
    WindowInput input = quiet();
    Vec3 place[2] = {{0, 0, 0}, {1, 0, 0}};
    Pose pose = {.node_count = 2, .position = place};
    double now_s = 0;
    pictures(&redraw, &input, &pose, 7, &now_s, 1);
    int still = pictures(&redraw, &input, &pose, 7, &now_s, 10);
    assert_in_range(still, 18, 21);
    place[1].y = 0.01;                       // less than a pixel
    assert_in_range(pictures(&redraw, &input, &pose, 7, &now_s, 10), 18, 21);
    place[1].y = 0.1;                        // once, and the pictures in which views refine
    assert_in_range(pictures(&redraw, &input, &pose, 7, &now_s, 0.4), 11, 12);
    input.mouse_x = 9;
    assert_in_range(pictures(&redraw, &input, &pose, 7, &now_s, 0.4), 11, 12);
    assert_in_range(pictures(&redraw, &input, &pose, 8, &now_s, 0.4), 11, 12);
    input.mouse_buttons = 1;                 // held
    assert_in_range(pictures(&redraw, &input, &pose, 8, &now_s, 1), 29, 31);
    redraw_free(&redraw);
}

static void a_slow_drift_is_shown(void **state)
{
    (void)state;
    Redraw redraw = {0};
    WindowInput input = quiet();
    Vec3 place[2] = {{0, 0, 0}, {1, 0, 0}};
    Pose pose = {.node_count = 2, .position = place};
    double now_s = 0, drawn = 0;
    pictures(&redraw, &input, &pose, 0, &now_s, 1);
    for (int i = 0; i < 300; i++, now_s += 1 / 30.0) {
        place[0].z += 0.003;                 // 0.09 mm/s
        drawn = redraw_is_due(&redraw, &input, &pose, 0, now_s, 100) ? place[0].z : drawn;
        assert_true(place[0].z - drawn < 0.02 + 0.003);
    }
    place[0].z = NAN;
    assert_true(redraw_is_due(&redraw, &input, &pose, 0, now_s, 100));
    redraw_free(&redraw);
}

// Views are drawn again when something changed and while they refine, not in the pictures that only refresh figures; what they show is compared with what they
// showed when they were drawn, so that a drift too slow for one picture adds up.
static void views_are_not_drawn_again_for_figures(void **state)
{
    (void)state;
    Redraw redraw = {0};
    WindowInput input = quiet();
    Vec3 place[1] = {{0, 0, 0}};
    Pose pose = {.node_count = 1, .position = place};
    double shown = 0, now_s = 0;
    int repeats = 0, drawn = 0;
    for (int i = 0; i < 30 * 20; i++, now_s += 1 / 30.0) {
        place[0].x = 0.03 * fmax(0, now_s - 10);     // 0.015 mm from one refreshed picture to the next
        if (!redraw_is_due(&redraw, &input, &pose, 0, now_s, 0.5))
            continue;
        repeats += redraw.is_repeat;
        drawn += !redraw.is_repeat;
        shown = redraw.is_repeat ? shown : place[0].x;
        assert_true(fabs(place[0].x - shown) <= 0.02);
        if (now_s < 10)
            assert_int_equal(drawn, i < 11 ? i + 1 : 11);     // the first one, and ten in which views refine
    }
    assert_true(repeats >= 18);
    assert_true(drawn > 11);
    redraw_free(&redraw);
}

// --- enlargement ---

static void enlarging_interpolates(void **state)
{
    (void)state;
    Enlarger e = {0};
    assert_true(enlarger_fit(&e, 2, 2, 4, 4));
    e.picture[0] = e.picture[2] = 0xff000000u;
    e.picture[1] = e.picture[3] = 0xff640a64u;       // 100, 10, 100
    uint32_t enlarged[16];
    enlarger_begin(&e);
    enlarger_rows(&e, 0, 4, false, enlarged);
    static const uint32_t row[4] = {0xff000000u, 0xff190319u, 0xff4b084bu, 0xff640a64u};      // 0, 1/4, 3/4, 1
    for (int i = 0; i < 16; i++)
        assert_int_equal(enlarged[i], row[i % 4]);
    enlarger_free(&e);
}

static void a_turned_picture_has_its_rows_and_channels_exchanged(void **state)
{
    (void)state;
    Enlarger e = {0};
    assert_true(enlarger_fit(&e, 3, 2, 5, 3));
    for (uint32_t i = 0; i < 6; i++)
        e.picture[i] = 0x01020304u * (i + 1);
    uint32_t upright[15], turned[15];
    enlarger_begin(&e);
    enlarger_rows(&e, 0, 3, false, upright);
    enlarger_begin(&e);
    enlarger_rows(&e, 0, 3, true, turned);
    for (int y = 0; y < 3; y++)
        for (int x = 0; x < 5; x++) {
            uint32_t p = upright[5 * (2 - y) + x], exchanged = (p & 0xff00ff00u) | (p & 0xff) << 16 | (p >> 16 & 0xff);
            assert_int_equal(turned[5 * y + x], exchanged);
        }
    enlarger_free(&e);
}

static uint32_t random_bits(uint32_t *seed) { return *seed = *seed * 1664525u + 1013904223u; }

// In strips of any height, on every instruction set, the same bits; within a grey level of the interpolation in floating point, for two roundings.
static void strips_and_instruction_sets_agree(void **state)
{
    (void)state;
    enum { WIDTH = 37, HEIGHT = 23, TO_WIDTH = 90, TO_HEIGHT = 61 };
    static uint32_t whole[TO_HEIGHT][TO_WIDTH], strip[TO_HEIGHT][TO_WIDTH];
    Enlarger e = {0};
    uint32_t seed = 1;
    assert_true(enlarger_fit(&e, WIDTH, HEIGHT, TO_WIDTH, TO_HEIGHT));
    for (int i = 0; i < WIDTH * HEIGHT; i++)
        e.picture[i] = random_bits(&seed) ^ random_bits(&seed) >> 16;
    simd_force(SIMD_SSE2);
    enlarger_begin(&e);
    enlarger_rows(&e, 0, TO_HEIGHT, false, whole[0]);
    for (int level = 0; level < SIMD_COUNT; level++)
        for (int rows = 1; rows < TO_HEIGHT; rows += 7) {
            simd_force((SimdLevel)level);
            enlarger_begin(&e);
            memset(strip, 0, sizeof strip);
            for (int y = 0; y < TO_HEIGHT; y += rows)
                enlarger_rows(&e, y, y + rows < TO_HEIGHT ? rows : TO_HEIGHT - y, false, strip[y]);
            assert_memory_equal(strip, whole, sizeof whole);
        }
    simd_force(simd_widest());
    for (int y = 0; y < TO_HEIGHT; y++)
        for (int x = 0; x < TO_WIDTH; x++)
            for (int channel = 0; channel < 4; channel++) {
                double at[2] = {(x + 0.5) * WIDTH / TO_WIDTH - 0.5, (y + 0.5) * HEIGHT / TO_HEIGHT - 0.5}, sum = 0;
                at[0] = fmin(fmax(at[0], 0), WIDTH - 1), at[1] = fmin(fmax(at[1], 0), HEIGHT - 1);
                for (int corner = 0; corner < 4; corner++) {
                    int i = (int)at[0] + (corner & 1), j = (int)at[1] + (corner >> 1);
                    double share = (corner & 1 ? at[0] - (int)at[0] : 1 - at[0] + (int)at[0]) * (corner >> 1 ? at[1] - (int)at[1] : 1 - at[1] + (int)at[1]);
                    sum += share > 0 ? share * (e.picture[j * WIDTH + i] >> 8 * channel & 0xff) : 0;
                }
                // the weights are rounded to 1/256, by half of that at most: half a level each way, and half a level for each rounding
                assert_true(fabs((whole[y][x] >> 8 * channel & 0xff) - sum) <= 2);
            }
    enlarger_free(&e);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_resolution_falls_until_the_budget_is_kept),
        cmocka_unit_test(one_slow_picture_changes_nothing),
        cmocka_unit_test(a_window_at_rest_is_drawn_twice_a_second),
        cmocka_unit_test(a_slow_drift_is_shown),
        cmocka_unit_test(views_are_not_drawn_again_for_figures),
        cmocka_unit_test(enlarging_interpolates),
        cmocka_unit_test(a_turned_picture_has_its_rows_and_channels_exchanged),
        cmocka_unit_test(strips_and_instruction_sets_agree),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
