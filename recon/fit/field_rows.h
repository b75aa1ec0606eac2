// The rows of the whole-tree fit, node by node: the target values of the field at data points and guards. Internal to recon; see field_fit.h.
//
// A row belongs to the node in whose power cell it lies, because that node's field is evaluated there. Single precision, relative to the node's
// centre, structure of arrays; data and guards are each padded to whole lanes by rows of weight 0, or without bounds.
#ifndef SELDINGER_RECON_FIT_FIELD_ROWS_H
#define SELDINGER_RECON_FIT_FIELD_ROWS_H

#include "geom/geom.h"
#include "recon/fit/fit_lanes.h"

enum { FIELD_TILE = 64, GUARD_TILE = 128 };

typedef struct RowTile {     // neighbouring rows of one node: at most FIELD_TILE data and GUARD_TILE guards
    int node;
    int data, data_padded;   // D: number of points on the wall, target f = 0
    int guards, guards_padded;   // G: number of guards, target f within [low, high]
    float *x, *y, *z;        // (padded D + padded G) [mm] from the node's centre
    float *weight;           // (padded D + padded G) number of points for which a row stands; 0 in the padding
    float *low, *high;       // (padded G) infinite in the padding
    float middle[3], radius; // [mm] a ball around all rows
} RowTile;

typedef struct FieldRows {
    int node_count;          // N
    int *first;              // (N+1) node i has tiles first[i] … first[i+1]-1
    RowTile *tile;
    float *memory;           // memory of all tiles
    int64_t dropped;         // number of data points omitted because they lie in another tube's lumen
} FieldRows;

// Returns true if the link of a node to its parent is lumen: its two balls overlap. An aneurysm is not a ball, so a link to or from it may be half as long
// again.
bool field_link_is_lumen(const VesselTree *tree, int node);
// Length of the wall's continuation upstream of an open inlet, in the root's radii.
#define FIELD_INLET_RADII 2.2
// Also makes `few`, a selection in which each row stands for several points, if the voxel size is known (0: unknown) and less than half of the points are
// enough; else few->first is NULL. Returns false if out of memory; the rows must be freed even then.
bool field_rows_create(FieldRows *rows, FieldRows *few, const VesselTree *tree, double voxel_mm, int threads);
void field_rows_free(FieldRows *rows);

#endif
