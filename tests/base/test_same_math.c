// Our own elementary functions: their error compared with 80-bit arithmetic, special values, laws, and their bits: one checksum over a million results, which
// is the same with each compiler and on each machine.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "base/same_math.h"
#include "tests/short_run.h"

#include <float.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

static uint64_t seed;

static double uniform(double low, double high)
{
    seed ^= seed << 13, seed ^= seed >> 7, seed ^= seed << 17;
    return low + (high - low) * (double)(seed >> 11) * 0x1p-53;
}

// 2^low to 2^high with either sign, computed without any of the tested functions.
static double of_any_size(int low, int high)
{
    double size = uniform(1, 2), exponent = uniform(0, high - low), sign = uniform(0, 1) < 0.5 ? -1 : 1;
    return sign * ldexp(size, low + (int)exponent);
}

static double between(int low, int high) { return uniform(low, high); }

typedef struct Function {
    const char *name;
    double (*own)(double);
    long double (*reference)(long double);
    double (*draw)(int low, int high);
    int low, high;
    double error;            // largest error in units in the last place, as stated in base/same_math.h
} Function;

static const Function function[] = {
    {"sin", same_sin, sinl, between, -10, 10, 0.8},
    {"sin", same_sin, sinl, of_any_size, -1000, 1023, 0.8},
    {"cos", same_cos, cosl, between, -10, 10, 0.8},
    {"cos", same_cos, cosl, of_any_size, -1000, 1023, 0.8},
    {"atan", same_atan, atanl, between, -3, 3, 0.6},
    {"atan", same_atan, atanl, of_any_size, -1000, 1000, 0.6},
    {"asin", same_asin, asinl, between, -1, 1, 2},
    {"asin", same_asin, asinl, of_any_size, -1000, -1, 2},
    {"acos", same_acos, acosl, between, -1, 1, 1.4},
    {"exp", same_exp, expl, between, -700, 709, 0.8},
    {"exp", same_exp, expl, of_any_size, -60, 1, 0.8},
    {"expm1", same_expm1, expm1l, between, -50, 700, 1.2},
    {"expm1", same_expm1, expm1l, of_any_size, -1000, 1, 1.2},
    {"log", same_log, logl, between, 0, 3, 0.9},
    {"log", same_log, logl, of_any_size, -1050, 1023, 0.9},
    {"cbrt", same_cbrt, cbrtl, of_any_size, -1070, 1023, 0.6},
    {"erf", same_erf, erfl, between, -7, 7, 12},
    {"erf", same_erf, erfl, of_any_size, -1000, 1, 12},
};
enum { FUNCTIONS = sizeof function / sizeof *function };

// |own - true| in units of the last place of the true value.
static double error_of(double own, long double reference)
{
    int exponent;
    if (isnan(own) || isnan(reference))
        return isnan(own) && isnan(reference) ? 0 : INFINITY;
    frexpl(reference, &exponent);
    return (double)(fabsl((long double)own - reference) / ldexpl(1, (exponent < -1021 ? -1021 : exponent) - 53));
}

static void need_wide_reference(void)
{
#if LDBL_MANT_DIG < 64
    print_message("skipped: no arithmetic of more than 53 bits to compare with\n");
    skip();
#endif
}

static void errors_are_as_stated(void **state)
{
    (void)state;
    need_wide_reference();
    seed = 1;
    for (int i = 0; i < FUNCTIONS; i++) {
        const Function *f = &function[i];
        double worst = 0, at = 0;
        for (int k = 0; k < WHOLE_OR_SHORT(100000, 2000); k++) {
            double x = f->draw(f->low, f->high);
            if (f->own == same_log)
                x = fabs(x);
            double error = error_of(f->own(x), f->reference(x));
            if (error > worst)
                worst = error, at = x;
        }
        print_message("%-6s %-6s %.3f units in the last place, at %.17g\n", f->name, f->draw == between ? "even" : "sizes", worst, at);
        if (!(worst <= f->error))
            fail_msg("%s(%.17g) is %.3f units off", f->name, at, worst);
    }
}

static void errors_of_two_arguments_are_as_stated(void **state)
{
    (void)state;
    need_wide_reference();
    double arc = 0, power = 0;
    seed = 2;
    for (int k = 0; k < WHOLE_OR_SHORT(200000, 4000); k++) {
        double x = of_any_size(-1020, 1000), y = k & 1 ? x * uniform(-2, 2) : of_any_size(-1020, 1000);
        long double true_arc = atan2l(y, x);
        if (fabsl(true_arc) > DBL_MIN)
            arc = fmax(arc, error_of(same_atan2(y, x), true_arc));
        double base = k & 1 ? uniform(0, 3) : fabs(of_any_size(-60, 60)), exponent = uniform(-400, 400) / (k & 1 ? 1 : 40);
        long double true_power = powl(base, exponent);
        if (true_power > DBL_MIN && true_power < DBL_MAX)
            power = fmax(power, error_of(same_pow(base, exponent), true_power));
    }
    print_message("atan2 %.3f, pow %.3f units in the last place\n", arc, power);
    assert_true(arc <= 0.7);
    assert_true(power <= 0.7);
}

// Where the reduced argument is smallest and bits of pi are lost first: at the doubles nearest to multiples of pi / 2.
static void zeros_of_sine_and_cosine(void **state)
{
    (void)state;
    need_wide_reference();
    for (int k = 1; k < 1000000; k = k * 5 / 4 + 1) {
        double x = (double)(k * 1.57079632679489661923L);
        assert_true(error_of(same_sin(x), sinl(x)) <= 0.8);
        assert_true(error_of(same_cos(x), cosl(x)) <= 0.8);
    }
    // 6381956970095103 2^797 is the double nearest to a multiple of pi / 2
    assert_true(error_of(same_cos(0x1.6ac5b262ca1ffp+849), -4.68716592425462761112e-19L) <= 0.8);
}

static bool same_bits(double a, double b) { return (isnan(a) && isnan(b)) || memcmp(&a, &b, sizeof a) == 0; }

// The C standard prescribes these results and their signs.
static void special_values(void **state)
{
    (void)state;
    const double at[] = {0.0, -0.0, 1, -1, HUGE_VAL, -HUGE_VAL, (double)NAN, 2, -2, 3, -3, 0.5, -0.5, -1e308, 1e308, 5e-324, -5e-324, 0x1p53, -0x1p53};
    enum { COUNT = sizeof at / sizeof *at };
    for (int i = 0; i < COUNT; i++) {
        for (int j = 0; j < COUNT; j++) {
            double x = at[i], y = at[j], power = pow(x, y), arc = atan2(x, y);
            if (power == 0 || power == 1 || !isfinite(power))
                assert_true(same_bits(same_pow(x, y), power));
            assert_int_equal(signbit(same_pow(x, y)) != 0, isnan(power) ? signbit(same_pow(x, y)) != 0 : signbit(power) != 0);
            if (arc == 0 || isnan(arc))
                assert_true(same_bits(same_atan2(x, y), arc));
            assert_true(isnan(arc) || fabs(same_atan2(x, y) - arc) <= 0x1p-51);
        }
        for (int f = 0; f < FUNCTIONS; f++) {
            double reference = (double)function[f].reference(at[i]);
            if (reference == 0 || !isfinite(reference))
                assert_true(same_bits(function[f].own(at[i]), reference));
        }
    }
    assert_true(same_bits(same_exp(-746), 0) && same_bits(same_exp(710), HUGE_VAL) && same_exp(-745) > 0);
    assert_true(same_bits(same_expm1(-800), -1) && same_bits(same_expm1(800), HUGE_VAL));
}

static void laws(void **state)
{
    (void)state;
    seed = 3;
    for (int k = 0; k < 10000; k++) {
        double x = uniform(-20, 20), y = uniform(-20, 20);
        assert_true(same_bits(same_sin(-x), -same_sin(x)) && same_bits(same_cos(-x), same_cos(x)));
        assert_true(same_bits(same_atan2(-y, x), -same_atan2(y, x)) && same_bits(same_erf(-x), -same_erf(x)) && same_bits(same_cbrt(-x), -same_cbrt(x)));
        assert_true(fabs(same_square(same_sin(x)) + same_square(same_cos(x)) - 1) < 4e-16);
        assert_true(same_bits(same_pow(fabs(x), 2), x * x) || fabs(same_pow(fabs(x), 2) / (x * x) - 1) < 3e-16);
    }
    for (int k = -1022; k < 1024; k++)
        assert_true(same_bits(same_pow(2, k), ldexp(1, k)));
}

// Other compilers, instruction sets and machines must give the same. The number is that of gcc 12, -O3, on x86-64; it changes only with the formulas.
static void every_machine_gives_these_bits(void **state)
{
    (void)state;
    uint64_t sum = 0;
    seed = 4;
    for (int i = 0; i < FUNCTIONS; i++)
        for (int k = 0; k < 60000; k++) {
            double x = function[i].draw(function[i].low, function[i].high), y = of_any_size(-30, 30), power = uniform(-9, 9);
            double value[3] = {function[i].own(function[i].own == same_log ? fabs(x) : x), same_atan2(y, x), same_pow(fabs(y), power)};
            for (int v = 0; v < 3; v++) {
                uint64_t bits;
                memcpy(&bits, &value[v], sizeof bits);
                sum = (sum ^ bits) * UINT64_C(0x9e3779b97f4a7c15);
                sum ^= sum >> 29;
            }
        }
    print_message("sum %016llx\n", (unsigned long long)sum);
    assert_true(sum == UINT64_C(0xcabc29630118161c));
}

static double seconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

// Prints the cost of a call compared with the C library's; there is no limit.
static void what_they_cost(void **state)
{
    (void)state;
    NEED_WHOLE_RUNS();
    enum { CALLS = 200000 };
    static double argument[CALLS];
    static const struct {
        const char *name;
        double (*own)(double), (*library)(double);
    } pair[] = {{"sin", same_sin, sin}, {"cos", same_cos, cos}, {"atan", same_atan, atan},
                {"exp", same_exp, exp}, {"log", same_log, log}, {"cbrt", same_cbrt, cbrt}};
    seed = 5;
    for (int k = 0; k < CALLS; k++)
        argument[k] = uniform(0, 3);
    for (size_t p = 0; p < sizeof pair / sizeof *pair; p++) {
        volatile double sink;
        double begin = seconds();
        for (int k = 0; k < CALLS; k++)
            sink = pair[p].own(argument[k]);
        double middle = seconds();
        for (int k = 0; k < CALLS; k++)
            sink = pair[p].library(argument[k]);
        double end = seconds();
        (void)sink;
        print_message("%-5s %5.1f ns, the C library's %5.1f ns\n", pair[p].name, 1e9 * (middle - begin) / CALLS, 1e9 * (end - middle) / CALLS);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(errors_are_as_stated),
        cmocka_unit_test(errors_of_two_arguments_are_as_stated),
        cmocka_unit_test(zeros_of_sine_and_cosine),
        cmocka_unit_test(special_values),
        cmocka_unit_test(laws),
        cmocka_unit_test(every_machine_gives_these_bits),
        cmocka_unit_test(what_they_cost),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
