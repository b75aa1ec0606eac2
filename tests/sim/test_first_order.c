// First-order Sobol indices from given data against exact ones: the Ishigami function (T. Ishigami, T. Homma, ISUMA 1990) and a linear function, on random,
// quasi-random and grid points; their intervals; the table that they are computed from.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "sim/first_order.h"
#include "sim/sweep_results.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MOST = 16384, INPUTS = 3 };
static double x[INPUTS][MOST], y[MOST];

static uint64_t state;

static double uniform(void)
{
    uint64_t z = state += 0x9E3779B97F4A7C15U;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9U;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBU;
    return (double)((z ^ (z >> 31)) >> 11) * 0x1p-53;
}

// Sobol's points in three dimensions, direction numbers of S. Joe, F. Y. Kuo, SIAM J. Sci. Comput. 30, 2008.
static double sobol(unsigned index, int dimension)
{
    unsigned m[14] = {1, 1, 1}, value = 0;
    if (dimension == 1)
        for (int k = 1; k < 14; k++)
            m[k] = 2 * m[k - 1] ^ m[k - 1];
    if (dimension == 2) {
        m[1] = 3;
        for (int k = 2; k < 14; k++)
            m[k] = 2 * m[k - 1] ^ 4 * m[k - 2] ^ m[k - 2];
    }
    for (int k = 0; k < 14; k++)
        if (index >> k & 1)
            value ^= (dimension == 0 ? 1 : m[k]) << (13 - k);
    return value / 16384.0;
}

typedef enum { RANDOM, QUASI, GRID } Points;

// Points in the unit cube; `seed` shifts the quasi-random ones.
static void fill(Points points, int count, uint64_t seed)
{
    int side = (int)lround(cbrt(count));
    state = seed;
    double shift[INPUTS] = {uniform(), uniform(), uniform()};
    for (int i = 0; i < count; i++)
        for (int k = 0; k < INPUTS; k++) {
            int place = k == 0 ? i % side : k == 1 ? i / side % side : i / side / side;
            x[k][i] = points == RANDOM ? uniform() : points == QUASI ? fmod(shift[k] + sobol((unsigned)i, k), 1) : (place + 0.5) / side;
        }
}

static const double pi = 3.14159265358979323846;
static double ishigami_exact[INPUTS], linear_exact[INPUTS] = {16.0 / 21, 4.0 / 21, 1.0 / 21};

static void ishigami(int count)
{
    const double a = 7, b = 0.1;
    for (int i = 0; i < count; i++) {
        double u = pi * (2 * x[0][i] - 1), v = pi * (2 * x[1][i] - 1), w = pi * (2 * x[2][i] - 1);
        y[i] = sin(u) + a * sin(v) * sin(v) + b * w * w * w * w * sin(u);
    }
    double first = 0.5 * pow(1 + b * pow(pi, 4) / 5, 2), second = a * a / 8, total = a * a / 8 + b * pow(pi, 4) / 5 + b * b * pow(pi, 8) / 18 + 0.5;
    ishigami_exact[0] = first / total;
    ishigami_exact[1] = second / total;
    ishigami_exact[2] = 0;
}

static void linear(int count)
{
    for (int i = 0; i < count; i++)
        y[i] = 5 + 4 * x[0][i] - 2 * x[1][i] + x[2][i];
}

// The root mean square error of all three indices over `repeats` sets of points.
static double error_of(Points points, int count, void (*function)(int), const double exact[INPUTS], int repeats)
{
    double sum = 0;
    for (int r = 0; r < repeats; r++) {
        fill(points, count, 1000 + (uint64_t)r);
        function(count);
        for (int k = 0; k < INPUTS; k++) {
            FirstOrder index;
            assert_true(first_order(count, x[k], y, false, &index));
            sum += pow(index.index - exact[k], 2);
        }
    }
    return sqrt(sum / repeats / INPUTS);
}

static void indices_converge_to_the_exact_ones(void **unused)
{
    (void)unused;
    // order 1/2: chance with random points, the correction of small classes with evenly spread ones
    static const struct {
        Points points;
        void (*function)(int);
        const double *exact;
        double order, last;
    } c[] = {{RANDOM, ishigami, ishigami_exact, 0.4, 0.01},
             {RANDOM, linear, linear_exact, 0.4, 0.01},
             {QUASI, ishigami, ishigami_exact, 0.4, 0.01},
             {QUASI, linear, linear_exact, 0.4, 0.01}};
    for (size_t i = 0; i < sizeof c / sizeof *c; i++) {
        double few = error_of(c[i].points, 256, c[i].function, c[i].exact, 12), many = error_of(c[i].points, MOST, c[i].function, c[i].exact, 4);
        double order = log(few / many) / log(MOST / 256.0);
        print_message("points %d, function %zu: error %.4f with 256 runs, %.5f with %d, order %.2f\n", c[i].points, i % 2, few, many, MOST, order);
        assert_true(order > c[i].order);
        assert_true(many < c[i].last);
    }
}

// On a grid nothing is left to chance, so the correction of small classes is all of the error: (M - 1) / (N - M) (1 - S) for M levels.
static void a_grid_has_the_error_of_the_correction_alone(void **unused)
{
    (void)unused;
    for (int side = 8; side <= 16; side *= 2) {
        int count = side * side * side;
        fill(GRID, count, 0);
        linear(count);
        for (int k = 0; k < INPUTS; k++) {
            FirstOrder index;
            assert_true(first_order(count, x[k], y, false, &index));
            assert_int_equal(index.classes, side);
            double correction = (side - 1.0) / (count - side) * (1 - linear_exact[k]);
            assert_true(fabs(index.index + correction - linear_exact[k]) < 1e-12);
            assert_true(index.low <= linear_exact[k] && linear_exact[k] <= index.high);
        }
    }
}

static void intervals_hold_the_exact_index(void **unused)
{
    (void)unused;
    enum { REPEATS = 200, RUNS = 500 };
    int held = 0;
    double width = 0;
    for (int r = 0; r < REPEATS; r++) {
        fill(RANDOM, RUNS, 77 + (uint64_t)r);
        ishigami(RUNS);
        for (int k = 0; k < INPUTS; k++) {
            FirstOrder index;
            assert_true(first_order(RUNS, x[k], y, false, &index));
            held += index.low <= ishigami_exact[k] && ishigami_exact[k] <= index.high;
            width += (index.high - index.low) / REPEATS / INPUTS;
        }
    }
    print_message("intervals of 95 %% hold the index in %.1f %%; mean width %.3f\n", 100.0 * held / REPEATS / INPUTS, width);
    // at least 95 %; the jackknife also moves the classes, which makes it wider than needed
    assert_in_range(1000 * held / REPEATS / INPUTS, 950, 1000);
    assert_true(width < 0.2);
}

static void names_and_constants(void **unused)
{
    (void)unused;
    FirstOrder index;
    state = 5;
    // three names, of which the middle one decides: the index is 1 if nothing else varies
    for (int i = 0; i < 300; i++) {
        x[0][i] = i % 3;
        y[i] = i % 3 == 1 ? 4 : 1;
    }
    assert_true(first_order(300, x[0], y, true, &index));
    assert_int_equal(index.classes, 3);
    assert_true(fabs(index.index - 1) < 1e-12);
    // a quarter by names, the rest by chance: var of 0 or 1 with share 1/3 is 2/9, of the noise 2/3
    for (int i = 0; i < MOST; i++) {
        x[0][i] = i % 3;
        y[i] = (i % 3 == 1) + sqrt(8) * uniform();
    }
    assert_true(first_order(MOST, x[0], y, true, &index));
    assert_true(fabs(index.index - 0.25) < 0.02);
    for (int i = 0; i < 300; i++)
        y[i] = 7;
    assert_false(first_order(300, x[0], y, true, &index));           // the figure is constant
    for (int i = 0; i < 300; i++) {
        x[1][i] = 2;
        y[i] = i;
    }
    assert_false(first_order(300, x[1], y, false, &index));          // the input is
    assert_false(first_order(7, x[0], y, false, &index));
}

// --- the table ---

static Faults faults;

static SweepResults *table(const char *text)
{
    faults_clear(&faults);
    return sweep_results_parse(text, strlen(text), "t.csv", &faults);
}

static void refuses(const char *text, const char *message)
{
    assert_null(table(text));
    if (!strstr(faults.text[0], message))
        fail_msg("'%s' instead of '%s'", faults.text[0], message);
}

static void a_table_is_read(void **unused)
{
    (void)unused;
    SweepResults *results =
        table("run,k[0].a,device,hand_seed,status,message,state_hash,force,flag\n0,1.5,b,7,done,,c4,2,1\n1,2,\"a, \"\"x\"\"\",8,left,\"out\nhere\",,,\n"
              "2,3,a,9,done,,d1,4,1\r\n");
    assert_non_null(results);
    assert_int_equal(results->row_count, 3);
    assert_int_equal(results->key_first, 1);
    assert_int_equal(results->key_count, 2);
    assert_string_equal(results->column[2].text[1], "a, \"x\"");
    assert_string_equal(results->column[results->message].text[1], "out\nhere");
    assert_true(results->column[1].is_number && !results->column[2].is_number);
    assert_true(results->column[2].value[0] == 2 && results->column[2].value[1] == 1 && results->column[2].value[2] == 0);
    int force = sweep_results_find(results, "force"), flag = sweep_results_find(results, "flag");
    assert_true(sweep_results_is_figure(results, force) && results->column[force].varies && isnan(results->column[force].value[1]));
    assert_true(results->column[force].least == 2 && results->column[force].most == 4);
    assert_false(results->column[flag].varies);
    assert_false(sweep_results_is_figure(results, sweep_results_find(results, "state_hash")));
    assert_int_equal(sweep_results_count(results, "left"), 1);
    sweep_results_free(results);
}

static void a_bad_table_is_refused_by_line(void **unused)
{
    (void)unused;
    refuses("", "t.csv:1: is empty");
    refuses("a,b\n", "t.csv:1:1: is no table of a sweep");
    refuses("run,k,message,status\n", "is no table of a sweep");
    refuses("run,k,status,message\n0,1,done\n", "t.csv:2: has 3 cells; the heading has 4 columns");
    refuses("run,k,status,message\n0,1,done,\n2,1,done,\n", "t.csv:3:1: run is '2'; expected 1");
    refuses("run,k,status,message\n0,1,fine,\n", "t.csv:2: status is 'fine'; valid: done, diverged, left, failed");
    refuses("run,k,status,message\n0,1,done,\"\n", "a quotation mark is not closed");
    refuses("run,k,status,message\n0,1,done,\"a\"b\n", "a quoted cell is followed by 'b'");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(indices_converge_to_the_exact_ones),
        cmocka_unit_test(a_grid_has_the_error_of_the_correction_alone),
        cmocka_unit_test(intervals_hold_the_exact_index),
        cmocka_unit_test(names_and_constants),
        cmocka_unit_test(a_table_is_read),
        cmocka_unit_test(a_bad_table_is_refused_by_line),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
