// Random numbers: SplitMix64 (Steele, Lea and Flood 2014), the same on every machine. Series of neighbouring seeds are uncorrelated.
#ifndef SELDINGER_GEOM_RANDOM_H
#define SELDINGER_GEOM_RANDOM_H

#include "base/base.h"
#include "geom/linear.h"

#include <stdint.h>

typedef struct Random {
    uint64_t state;          // any value; at the start, the seed
} Random;

#define RANDOM_STEP UINT64_C(0x9e3779b97f4a7c15)

static inline uint64_t random_next(Random *random)
{
    uint64_t z = random->state += RANDOM_STEP;
    z = (z ^ (z >> 30)) * UINT64_C(0xbf58476d1ce4e5b9);
    z = (z ^ (z >> 27)) * UINT64_C(0x94d049bb133111eb);
    return z ^ (z >> 31);
}

// Sets the state that `numbers` calls of random_next() would leave.
static inline void random_skip(Random *random, int numbers) { random->state += (uint64_t)numbers * RANDOM_STEP; }

static inline int random_index(Random *random, int count) { return (int)(((random_next(random) >> 32) * (uint64_t)count) >> 32); }   // 0 … count-1, count >= 1
static inline double random_unit(Random *random) { return (double)(random_next(random) >> 11) * 0x1p-53; }              // [0, 1)
static inline double random_open(Random *random) { return ((double)(random_next(random) >> 11) + 0.5) * 0x1p-53; }      // (0, 1)

// Mean 0, variance 1 (Box and Muller 1958, one of the pair).
static inline double random_normal(Random *random)
{
    double u = random_open(random), v = random_open(random);
    return sqrt(-2 * same_log(u)) * same_cos(2 * PI * v);
}

#endif
