// The similarity (rotation, scale, shift) that takes points to points with the least sum of squared distances.
#ifndef SELDINGER_GEOM_SIMILARITY_H
#define SELDINGER_GEOM_SIMILARITY_H

#include "geom/linear.h"

typedef struct Similarity {      // x -> shift + scale turn x
    Mat3 turn;
    double scale;
    Vec3 shift;
} Similarity;

static inline Vec3 similarity_of(const Similarity *s, Vec3 x) { return vec3_add_scaled(s->shift, s->scale, mat3_mul_vec(&s->turn, x)); }

// `turn` NULL: found too, which takes three pairs of points that are not on a line. One pair has no scale: 1. False if the points do not determine a similarity.
bool similarity_fit(int count, const Vec3 *from, const Vec3 *to, const Mat3 *turn, Similarity *fit);

#endif
