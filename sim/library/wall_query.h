// Queries a wall at points; shared by scenes and models.
#ifndef SELDINGER_SIM_LIBRARY_WALL_QUERY_H
#define SELDINGER_SIM_LIBRARY_WALL_QUERY_H

#include "geom/geom.h"
#include "seldinger/base.h"

// `normal` may be NULL; the other pointers must not be.
SelStatus wall_query(SelContext *context, const Vessel *vessel, int count, const double *point_mm, double *gap_mm, double *normal);

#endif
