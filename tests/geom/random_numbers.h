// Random numbers for the tests: splitmix64, which gives the same numbers on every machine.
#ifndef SELDINGER_TESTS_RANDOM_NUMBERS_H
#define SELDINGER_TESTS_RANDOM_NUMBERS_H

#include "geom/linear.h"

#include <stdint.h>

static inline double random_in(uint64_t *state, double low, double high)
{
    uint64_t z = (*state += 0x9e3779b97f4a7c15u);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    z ^= z >> 31;
    return low + (high - low) * ((double)(z >> 11) * 0x1p-53);
}

static inline Vec3 random_in_box(uint64_t *state, double half)
{
    double x = random_in(state, -half, half), y = random_in(state, -half, half), z = random_in(state, -half, half);
    return vec3(x, y, z);
}

static inline Vec3 random_unit_vector(uint64_t *state)
{
    for (;;) {
        Vec3 v = random_in_box(state, 1);
        double n = vec3_norm(v);
        if (n > 0.1 && n < 1)
            return vec3_scale(v, 1 / n);
    }
}

#endif
