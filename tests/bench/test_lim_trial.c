// Section 5.3.2 in small: each shape at three levels of noise, five runs. Medians of 15 runs; the whole table is `seldinger bench fit --table3`.
#include "base/sort_doubles.h"
#include "bench/lim_trial.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <stdlib.h>
#include <string.h>

enum { RUNS = 5, LEVELS = 3, ALL = RUNS * LEVELS };

static double median(double *value, int count)
{
    sort_doubles(value, (size_t)count);
    return value[count / 2];
}

// Few blobs (the paper's medians), the wall nearer than the noise, no bias: distances are fitted, so that noise along the normal averages out
// (its second order, sigma^2 / 2 r, would be 0.01 mm here).
static void few_blobs_near_the_truth(void **state)
{
    (void)state;
    static const int limit[LIM_TRIAL_SHAPES] = {7, 9, 15, 15};
    LimFitOptions options = lim_fit_default_options();
    for (int s = 0; s < LIM_TRIAL_SHAPES; s++) {
        LimTrialShape *shape = lim_trial_create(s);
        assert_non_null(shape);
        double ratio[ALL], blobs[ALL], bias = 0, known = 0;
        for (int i = 0; i < ALL; i++) {
            double sigma = 0.05 + 0.075 * (i / RUNS);
            LimTrial trial;
            assert_true(lim_trial_run(shape, sigma, (uint64_t)(100 * s + i), &options, &trial));
            ratio[i] = trial.d / sigma;
            blobs[i] = trial.blobs;
            bias += trial.bias / ALL;
            known += trial.d_shape / sigma / ALL;
            // free blobs hold the shape's own freedom and more
            assert_true(trial.d_shape > 0 && trial.d_shape < trial.d_blobs);
        }
        double middle = median(ratio, ALL), count = median(blobs, ALL);
        print_message("%-13s d %.2f sigma (shape known: %.2f), %.0f blobs, bias %+.4f mm\n", lim_trial_name[s], middle, known, count, bias);
        assert_true(middle < 1 && middle > known);
        assert_true(count <= limit[s]);
        assert_true(bias < 0.01 && bias > -0.01);
        lim_trial_free(shape);
    }
}

static void a_seed_is_a_run(void **state)
{
    (void)state;
    LimFitOptions options = lim_fit_default_options();
    LimTrialShape *shape = lim_trial_create(0);
    LimTrial a, b, c;
    assert_true(lim_trial_run(shape, 0.1, 5, &options, &a) && lim_trial_run(shape, 0.1, 5, &options, &b) && lim_trial_run(shape, 0.1, 6, &options, &c));
    assert_true(a.d == b.d && a.blobs == b.blobs && a.worst == b.worst && a.d_blobs == b.d_blobs);
    assert_true(a.d != c.d);
    lim_trial_free(shape);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(few_blobs_near_the_truth), cmocka_unit_test(a_seed_is_a_run)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
