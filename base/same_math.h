// Elementary functions that give the same bits with every compiler, instruction set, processor and C library. The C library's functions do not: glibc uses
// different code on processors with fused multiply-add. These use only +, -, *, / and sqrt, whose rounding IEEE 754 defines, without fused multiply-add
// and without reassociation (-ffp-contract=off). All code that determines a state, a model or a score must use them;
// tests/cli/test_same_builds.c finds calls to the C library's.
//
// Arguments and results are in radians. Special values are as in C17, annex F, but floating-point exceptions and errno are unspecified. All functions are pure.
// The comments give the largest error seen against 80-bit arithmetic (tests/base/test_same_math.c), in units in the last place of the result.
#ifndef SELDINGER_BASE_SAME_MATH_H
#define SELDINGER_BASE_SAME_MATH_H

#include <math.h>

#ifdef __cplusplus
extern "C" {
#endif

double same_sin(double x);                 // 0.8, for any x
double same_cos(double x);                 // 0.8, for any x
double same_atan(double x);                // 0.6
double same_atan2(double y, double x);     // 0.7
double same_asin(double x);                // 2; NaN outside -1 … 1
double same_acos(double x);                // 1.4; NaN outside -1 … 1
double same_exp(double x);                 // 0.8
double same_expm1(double x);               // 1.2; exp(x) - 1
double same_log(double x);                 // 0.9
double same_pow(double x, double y);       // 0.7
double same_cbrt(double x);                // 0.6
double same_erf(double x);                 // 12
// For lengths: squares that overflow or underflow (values beyond 1e150 or below 1e-150) are not handled.
static inline double same_hypot(double x, double y) { return sqrt(x * x + y * y); }
static inline double same_square(double x) { return x * x; }

#ifdef __cplusplus
}
#endif

#endif
