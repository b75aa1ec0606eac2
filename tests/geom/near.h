// |a - b| <= tolerance in double precision (cmocka's own comparison rounds to float). Include after cmocka.h.
#ifndef SELDINGER_TESTS_NEAR_H
#define SELDINGER_TESTS_NEAR_H

#include <math.h>

static inline void assert_near_at(double a, double b, double tolerance, const char *what, const char *file, int line)
{
    if (!(fabs(a - b) <= tolerance)) {
        print_error("%s: %.17g and %.17g differ by %.3g, allowed %.3g\n", what, a, b, a - b, tolerance);
        _fail(file, line);
    }
}
#define assert_near(a, b, tolerance) assert_near_at((a), (b), (tolerance), #a, __FILE__, __LINE__)

#endif
