// First-order Sobol indices from given data: the share of a figure's variance that one input explains alone, S_i = Var(E[Y | X_i]) / Var(Y), from any table of
// runs: a grid, random or quasi-random points. No special design of runs is needed.
//
// The runs are sorted by the input and divided into about sqrt(N) classes of equal size; equal inputs stay in one class, so the levels of a grid or names are
// classes. The estimate is the correlation ratio of these classes (K. Pearson 1905) without the bias of small classes (epsilon squared: T. L. Kelley, PNAS 21,
// 1935), as a given-data estimator: E. Plischke, E. Borgonovo, C. L. Smith, Eur. J. Oper. Res. 226, 2013. With sqrt(N) classes the error by the width of a class
// falls as 1/N, below the statistical one. A fixed number of classes would leave an error; more would only add noise. On evenly spread points (grids, Sobol)
// chance adds nothing, and the correction makes the index too low, by at most (classes - 1) / (runs - classes).
#ifndef SELDINGER_SIM_FIRST_ORDER_H
#define SELDINGER_SIM_FIRST_ORDER_H

#include <stdbool.h>

typedef struct FirstOrder {
    double index;            // the estimate; as any unbiased one it may be below 0 or above 1
    double low, high;        // interval of at least 95 % by the jackknife over 20 groups
    int runs, classes;
} FirstOrder;

// `x`, `y` (count): input and figure of each run, finite. `is_name`: x numbers names, which are not merged into classes. False if the figure or the input is
// constant, or fewer than 8 runs or fewer than two runs a class are given. Deterministic.
bool first_order(int count, const double *x, const double *y, bool is_name, FirstOrder *out);

#endif
