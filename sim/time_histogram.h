// A histogram of fixed size for durations [ns] or counts: 128 equal bins an octave, so a quantile is exact below 256 and within 0.4 % above. Adding a
// value allocates nothing and takes a few ns.
#ifndef SELDINGER_SIM_TIME_HISTOGRAM_H
#define SELDINGER_SIM_TIME_HISTOGRAM_H

#include <stdint.h>

enum { HISTOGRAM_BINS = 128 * 42 };   // up to 2^48

typedef struct TimeHistogram {
    int64_t total;
    int64_t largest;
    uint32_t bin[HISTOGRAM_BINS];
} TimeHistogram;

static inline int histogram_bin(int64_t value)
{
    uint64_t v = value > 0 ? (uint64_t)value : 0;
    if (v < 256)
        return (int)v;
    int shift = 56 - __builtin_clzll(v);   // leaves v >> shift in [128, 256)
    int bin = 128 * shift + (int)(v >> shift);
    return bin < HISTOGRAM_BINS ? bin : HISTOGRAM_BINS - 1;
}

static inline void histogram_add(TimeHistogram *histogram, int64_t value)
{
    histogram->bin[histogram_bin(value)]++;
    histogram->total++;
    if (value > histogram->largest)
        histogram->largest = value;
}

// The smallest value that at least `fraction` (0 to 1) of all entries do not exceed (middle of its bin); 0 without entries.
double histogram_quantile(const TimeHistogram *histogram, double fraction);

#endif
