// Mean curvature of an implicit surface by Kerrien et al. 2017, eq. (5): +1/r on a sphere with f > 0 inside.
#ifndef SELDINGER_TESTS_GEOM_MEAN_CURVATURE_H
#define SELDINGER_TESTS_GEOM_MEAN_CURVATURE_H

#include "geom/linear.h"

static inline double mean_curvature(Vec3 gradient, const Sym3 *hessian)
{
    double g2 = vec3_norm2(gradient);
    return (sym3_quadratic(hessian, gradient) - g2 * sym3_trace(hessian)) / (2 * g2 * sqrt(g2));
}

#endif
