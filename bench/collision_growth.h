// The part of `seldinger bench collision` about size: meshes with increasing numbers of triangles, trees with increasing numbers of nodes, blobs and triangles
// for the same error, and memory per millimetre of vessel.
#ifndef SELDINGER_BENCH_COLLISION_GROWTH_H
#define SELDINGER_BENCH_COLLISION_GROWTH_H

#include "base/faults.h"

#include <cJSON.h>
#include <stdbool.h>
#include <stdio.h>

// Prints four tables and adds to `into`
//   growth: [{surface, search: full|warm|cached|grid|lim, triangles, ns_per_query: {wire, spread}, gap_error_um: {rms, max}, normal_error_deg: {rms, max},
//     flagged, bytes, surface_s, build_s}]: triangles is 0 for grids (with the last mesh's edge as cell) and LIM; errors relative to the meshed wall
//   sizes: [{field: switch|blend, nodes, blobs, ns_warm, ns_cold, ns_one_strand, first_us, next_us, bytes, build_s}]: one wire of 80 points; 250 wires all over
//     the tree in turn, which use more memory the larger the tree; the same within 1000 nodes; the first location of a point in the whole tree and then that
//     of its neighbour
//   blobs_to_match: [{gap_error_um, normal_error_deg, target_mm, blobs, bytes, ns_per_query, fit_s, mesh: {triangles, bytes, as growth}}]: rms relative to the
//     true shape
//   memory: [{tree, representation, length_mm, edge_mm, primitives, bytes, bytes_per_mm, build_s, as growth}]
// `quick`: meshes to 64,000 triangles, trees to 10,000 nodes, the last two lists empty. `threads` (0: all cores) are for the fits. Without Embree there
// are no meshes, and the text says so. False with a fault if memory runs out or a fit fails.
bool collision_growth(FILE *out, cJSON *into, bool quick, int threads, Faults *faults);

#endif
