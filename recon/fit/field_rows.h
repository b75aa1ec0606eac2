// The rows of the whole-tree fit, node by node: the target values of the field at data points and guards. Internal to recon; see field_fit.h.
//
// A row belongs to the node in whose power cell it lies, because that node's field is evaluated there. Single precision, relative to the node's
// centre, structure of arrays; data and guards are each padded to whole lanes by rows of weight 0.
#ifndef SELDINGER_RECON_FIT_FIELD_ROWS_H
#define SELDINGER_RECON_FIT_FIELD_ROWS_H

#include "geom/geom.h"
#include "recon/fit/fit_lanes.h"

enum { FIELD_TILE = 64, GUARD_TILE = 128 };

typedef struct RowTile {     // neighbouring rows of one node: up to FIELD_TILE data, GUARD_TILE guards
    int node;
    int data, data_padded;   // D: points on the wall, f = 0
    int guards, guards_padded;   // G: f within [low, high]
    float *x, *y, *z;        // (padded D + padded G) [mm] from the node's centre
    float *weight;           // (padded D) of a point: 1, or 0 in the padding
    float *low, *high;       // (padded G)
    float middle[3], radius; // [mm] a ball about all of them
} RowTile;

typedef struct FieldRows {
    int node_count;          // N
    int *first;              // (N+1) node i has tiles first[i] … first[i+1]-1
    RowTile *tile;
    float *memory;           // of all tiles
    int64_t dropped;         // data points left out because they lie in another tube's lumen
} FieldRows;

// A link of the tree is lumen if its two balls meet; an aneurysm is not a ball and may reach half as far again.
bool field_link_is_lumen(const VesselTree *tree, int node);
// How far the wall is continued upstream of an open inlet, in the root's radii.
#define FIELD_INLET_RADII 2.2
bool field_rows_create(FieldRows *rows, const VesselTree *tree, int threads);
void field_rows_free(FieldRows *rows);

#endif
