// The values of runs: a grid combines all levels once, distributions have their quantiles, and a run's values do not depend on the number of runs.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "study/points.h"
#include "study/queue_model.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static Faults faults;

static Study *parsed(const char *text)
{
    faults_clear(&faults);
    Study *study = study_parse(text, strlen(text), "spec.yaml", &faults);
    if (!study)
        fail_msg("%s", faults.text[0]);
    return study;
}

static void refused(const char *text, const char *words)
{
    faults_clear(&faults);
    Study *study = study_parse(text, strlen(text), "spec.yaml", &faults);
    assert_null(study);
    if (!strstr(faults.text[0], words))
        fail_msg("'%s' lacks '%s'", faults.text[0], words);
}

static void a_grid_has_every_combination_once(void **state)
{
    (void)state;
    Study *study = parsed("sweep: 1\nscene: s.yaml\nvary:\n  a.b: {values: [x, [1, 2], \"y, z\"]}\n  c: {uniform: [0, 1], levels: 5}\n  d: {integer: [-1, 2]}\n"
                          "hands: {count: 2}\nsampling: grid\n");
    static const char *const a[] = {"x", "[1, 2]", "\"y, z\""}, *const c[] = {"0", "0.25", "0.5", "0.75", "1"}, *const d[] = {"-1", "0", "1", "2"};
    char text[VARY_TEXT];
    assert_true(study->runs == 3 * 5 * 4 * 2);
    for (int64_t run = 0; run < 120; run++) {
        assert_string_equal(study_value(study, run, 0, text), a[run / 40]);
        assert_string_equal(study_value(study, run, 1, text), c[run / 8 % 5]);
        assert_string_equal(study_value(study, run, 2, text), d[run / 2 % 4]);
        assert_int_equal(study_hand_seed(study, run), 1 + run % 2);
    }
    study_free(study);
}

// Standard normal quantiles from tables (Abramowitz and Stegun 26.2), and P(quantile(u)) = u.
static void normal_quantiles_are_exact(void **state)
{
    (void)state;
    assert_true(fabs(normal_quantile(0.975) - 1.959963984540054) < 1e-12);
    assert_true(fabs(normal_quantile(0.0013498980316300933) + 3) < 1e-11);
    assert_true(fabs(normal_quantile(0.5)) < 1e-15);
    for (double u = 0.001; u < 1; u += 0.007)
        assert_true(fabs(0.5 * (1 + erf(normal_quantile(u) / sqrt(2))) - u) < 1e-14);
}

static void moments(const char *distribution, const char *kind, double mean, double deviation, double tolerance)
{
    char text[400];
    snprintf(text, sizeof text, "sweep: 1\nscene: s.yaml\nvary: {a: {%s}}\nsampling: {kind: %s, runs: 4096}\n", distribution, kind);
    Study *study = parsed(text);
    double sum = 0, squares = 0;
    char value[VARY_TEXT];
    for (int64_t run = 0; run < 4096; run++) {
        double x = strtod(study_value(study, run, 0, value), NULL);
        sum += x;
        squares += x * x;
    }
    double found = sum / 4096, spread = sqrt(squares / 4096 - found * found);
    if (fabs(found - mean) > tolerance * deviation || fabs(spread - deviation) > tolerance * deviation)
        fail_msg("%s of %s: mean %g (%g), deviation %g (%g)", kind, distribution, found, mean, spread, deviation);
    study_free(study);
}

// Of n random numbers the mean strays by 1/sqrt(n) of the deviation: at most four times that. Sobol's points: at most 1e-3.
static void samples_have_their_moments(void **state)
{
    (void)state;
    const double log_mean = (200 - 5) / log(40), log_square = (200.0 * 200 - 5 * 5) / (2 * log(40));
    for (int i = 0; i < 2; i++) {
        const char *kind = i ? "random" : "sobol";
        double tolerance = i ? 4 / sqrt(4096.0) : 1e-3;
        moments("uniform: [-1, 3]", kind, 1, 4 / sqrt(12), tolerance);
        moments("loguniform: [5, 200]", kind, log_mean, sqrt(log_square - log_mean * log_mean), tolerance);
        moments("normal: [3, 0.5]", kind, 3, 0.5, tolerance);
        moments("integer: [1, 4]", kind, 2.5, sqrt(1.25), tolerance);
        moments("values: [10, 20]", kind, 15, 5, tolerance);
    }
}

static void bad_specifications_are_refused(void **state)
{
    (void)state;
#define HEAD "sweep: 1\nscene: s.yaml\n"
#define TAIL "sampling: {kind: sobol, runs: 4}\n"
    refused(HEAD "vary: {a: {uniform: [2, 2]}}\n" TAIL, "spec.yaml:3:21: the range from 2 to 2 is empty");
    refused(HEAD "vary: {a: {loguniform: [0, 2]}}\n" TAIL, "out of range");
    refused(HEAD "vary: {a: {normal: [0, 0]}}\n" TAIL, "deviation above 0");
    refused(HEAD "vary: {a: {values: []}}\n" TAIL, "has 0 entries");
    refused(HEAD "vary: {a: {uniform: [0, 1], values: [1]}}\n" TAIL, "2 distributions");
    refused(HEAD "vary: {a: {unifrom: [0, 1]}}\n" TAIL, "did you mean 'uniform'");
    refused(HEAD "vary: {\"a b\": {uniform: [0, 1]}}\n" TAIL, "not the path");
    refused(HEAD "vary: {a: {uniform: [0, 1]}}\nsampling: grid\n", "has no levels");
    refused(HEAD "vary: {a: {uniform: [0, 1]}}\nsampling: {kind: sobol}\n", "no key 'runs'");
    refused(HEAD "vary: {a: {integer: [0, 1]}}\nsampling: {kind: grid, runs: 3}\n", "as many runs as combinations");
    refused(HEAD TAIL, "nothing varies");
    refused(HEAD "vary: {\"a[00].b\": {values: [1]}}\n" TAIL, "not the path");
    refused(HEAD "vary: {a: {uniform: [.nan, 1]}}\n" TAIL, "spec.yaml:3:22: 'sweep.vary.a.uniform[0]' is '.nan', not a number");
    refused(HEAD "vary: {a: {uniform: [0, .inf]}}\n" TAIL, "is '.inf', not a number");
    refused(HEAD "vary: {a: {uniform: [0, 1], levels: 0}}\n" TAIL, "'sweep.vary.a.levels' is 0; expected a whole number from 1");
    refused(HEAD "vary: {a: {values: [1]}, a: {values: [2]}}\n" TAIL, "duplicate key 'a'");
    refused(HEAD "vary: &x {a: *x}\n" TAIL, "unknown key 'a'");
    refused(HEAD "vary: {\"a.b[0]\": {values: [1]}, a.b: {values: [[2]]}}\n" TAIL, "spec.yaml:3:38: 'a.b' replaces 'a.b[0]'");
    refused(HEAD "vary: {script: {values: [a.csv]}}\nhands: {}\n" TAIL, "'script' is varied, but random 'hands' replace the script");
    refused("sweep: 2\nscene: s.yaml\nhands: {}\n" TAIL, "expected a whole number from 1 to 1");
}

// With one rank all time is work and service. With runs of equal length and many ranks the manager, which serves one at a time, is the limit: its time for all
// results.
static void the_queue_model_has_its_limits(void **state)
{
    (void)state;
    enum { RUNS = 10000 };
    static double run_s[RUNS];
    for (int i = 0; i < RUNS; i++)
        run_s[i] = 0.5;
    QueueModel model = {.runs = RUNS, .measured = RUNS, .run_s = run_s, .service_s = 1e-3, .ranks = 1};
    assert_true(fabs(queue_forecast(&model).wall_s - RUNS * 0.501) < 1e-6);
    model.ranks = 100;       // 100 ranks ask every 0.5 s: 200 a second, a fifth of what the manager can
    assert_true(fabs(queue_forecast(&model).wall_s - RUNS / 100 * 0.501) < 0.2);
    model.ranks = 5000;
    assert_true(fabs(queue_forecast(&model).wall_s - (RUNS * 1e-3 + 0.5)) < 1e-6);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(a_grid_has_every_combination_once), cmocka_unit_test(normal_quantiles_are_exact),
                                       cmocka_unit_test(samples_have_their_moments), cmocka_unit_test(bad_specifications_are_refused),
                                       cmocka_unit_test(the_queue_model_has_its_limits)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
