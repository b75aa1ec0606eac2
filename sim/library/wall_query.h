// A wall asked at points: what scenes and models share.
#ifndef SELDINGER_SIM_LIBRARY_WALL_QUERY_H
#define SELDINGER_SIM_LIBRARY_WALL_QUERY_H

#include "geom/geom.h"
#include "seldinger/base.h"

// `normal` may be NULL; the other pointers are not.
SelStatus wall_query(SelContext *context, const Vessel *vessel, int count, const double *point_mm, double *gap_mm, double *normal);

#endif
