#include "sim/time_histogram.h"

#include <math.h>

static double bin_middle(int bin)
{
    if (bin < 256)
        return bin;
    int shift = bin / 128 - 1;
    double low = ldexp(bin % 128 + 128, shift), width = ldexp(1, shift);
    return low + (width - 1) / 2;
}

double histogram_quantile(const TimeHistogram *histogram, double fraction)
{
    if (histogram->total == 0)
        return 0;
    int64_t wanted = (int64_t)ceil(fraction * (double)histogram->total), seen = 0;
    if (wanted < 1)
        wanted = 1;
    for (int bin = 0; bin < HISTOGRAM_BINS; bin++) {
        seen += histogram->bin[bin];
        if (seen >= wanted) {
            double value = bin_middle(bin);
            return value < (double)histogram->largest ? value : (double)histogram->largest;
        }
    }
    return (double)histogram->largest;
}
