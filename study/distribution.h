// The values that a varied key takes.
#ifndef SELDINGER_STUDY_DISTRIBUTION_H
#define SELDINGER_STUDY_DISTRIBUTION_H

#include <stdbool.h>

typedef enum { VARY_UNIFORM, VARY_LOGUNIFORM, VARY_NORMAL, VARY_INTEGER, VARY_VALUES } VaryKind;
extern const char *const vary_name[VARY_VALUES + 2];   // as written in files; NULL at the end

enum { VARY_TEXT = 32 };

typedef struct Distribution {
    VaryKind kind;
    double a, b;             // least and most; VARY_NORMAL: mean and standard deviation
    int levels;              // in a grid; 0: not given
    int value_count;         // VARY_VALUES
    char **value;            // (value_count) YAML in flow style; owned
} Distribution;

// Number of levels in a grid: those given, all integers, all values. 0: a continuous distribution without `levels`.
long distribution_levels(const Distribution *d);
// The value at the share u of the distribution, 0 < u < 1: a number in `text`, or one of the values. The same bits on every machine.
const char *distribution_at(const Distribution *d, double u, char text[VARY_TEXT]);
// Level 0 … distribution_levels()-1: from a to b with both, evenly (of VARY_LOGUNIFORM: in the logarithm); of VARY_NORMAL the quantiles (level + 1/2) / levels.
const char *distribution_level(const Distribution *d, long level, char text[VARY_TEXT]);
// The least value, or the greatest; of VARY_NORMAL: those outside of which are 2^-32 of it each, 6.2 deviations away. Not of VARY_VALUES.
const char *distribution_end(const Distribution *d, bool is_greatest, char text[VARY_TEXT]);
// x with the share u of a normal distribution of mean 0 and variance 1 below it; |x| <= 9.
double normal_quantile(double u);

#endif
