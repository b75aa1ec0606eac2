// The connected parts of a tree's surface: which bound the lumen that is connected to the inlet, and which are isolated.
#ifndef SELDINGER_GEOM_SURFACE_PARTS_H
#define SELDINGER_GEOM_SURFACE_PARTS_H

#include "geom/isosurface.h"
#include "geom/reach.h"

typedef enum {
    PART_INLET,              // wall of the lumen that the inlet opens into
    PART_BUBBLE,             // faces inwards: a wall inside lumen
    PART_SHUT,               // holds nodes of the tree, but no point reaches them from the inlet
    PART_GHOST,              // holds no node
    PART_KINDS
} PartKind;

typedef struct SurfacePart {
    PartKind kind;
    int triangles, nodes;    // nodes: nodes of the tree whose centre is connected, through lumen, to vertices of the part by straight lines
    double volume;           // [mm3] enclosed; < 0 if it faces inwards
    Vec3 place;              // a vertex
    int node;                // the node of that vertex
} SurfacePart;
typedef struct SurfaceParts {
    int count;
    SurfacePart *part;       // largest volume first
    int *of_vertex;          // (V) part of each vertex
} SurfaceParts;

// Returns the parts of a surface of `tree` (isosurface_of_tree). A part that holds a node which a point reaches belongs to the inlet's lumen, even if the neck
// is finer than the lattice. If the inlet itself is blocked, the largest part counts as its lumen. Returns NULL if out of memory.
SurfaceParts *surface_parts_create(const TriangleMesh *mesh, const VesselTree *tree, const Reach *reach);
void surface_parts_free(SurfaceParts *parts);
// Keeps the parts with kinds[kind]; `parts` does not describe the mesh afterwards. Returns false, with the mesh unchanged, if out of memory.
bool surface_parts_keep(TriangleMesh *mesh, const SurfaceParts *parts, const bool kinds[PART_KINDS]);

#endif
