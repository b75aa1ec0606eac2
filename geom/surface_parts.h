// The connected parts of a tree's surface: which of them bound the lumen that hangs together with the inlet, and which hang on nothing.
#ifndef SELDINGER_GEOM_SURFACE_PARTS_H
#define SELDINGER_GEOM_SURFACE_PARTS_H

#include "geom/isosurface.h"
#include "geom/reach.h"

typedef enum {
    PART_INLET,              // the lumen of the inlet
    PART_BUBBLE,             // faces inwards: wall in the midst of lumen
    PART_SHUT,               // holds nodes of the tree, but no point gets there from the inlet
    PART_GHOST,              // holds no node
    PART_KINDS
} PartKind;

typedef struct SurfacePart {
    PartKind kind;
    int triangles, nodes;    // nodes of the tree whose centre it holds: from there some of its vertices are seen through lumen
    double volume;           // [mm3] enclosed; < 0: faces inwards
    Vec3 place;              // a vertex
    int node;                // that vertex's
} SurfacePart;
typedef struct SurfaceParts {
    int count;
    SurfacePart *part;       // largest volume first
    int *of_vertex;          // (V) its part
} SurfaceParts;

// Parts of a surface of `tree` (isosurface_of_tree). A part that holds a node which a point reaches belongs to the inlet's lumen, also where the neck is
// finer than the lattice. Where the inlet itself is shut the largest part counts as its lumen. NULL where there is no memory.
SurfaceParts *surface_parts_create(const TriangleMesh *mesh, const VesselTree *tree, const Reach *reach);
void surface_parts_free(SurfaceParts *parts);
// Keeps the parts of kinds[kind]; `parts` no longer fits the mesh after that. False, with the mesh as it was, where there is no memory.
bool surface_parts_keep(TriangleMesh *mesh, const SurfaceParts *parts, const bool kinds[PART_KINDS]);

#endif
