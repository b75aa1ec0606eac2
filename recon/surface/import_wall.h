// The wall, i.e. the surface without the flat lids over its vessels' ends. Internal to the import.
#ifndef SELDINGER_RECON_SURFACE_IMPORT_WALL_H
#define SELDINGER_RECON_SURFACE_IMPORT_WALL_H

#include "recon/surface/centreline_file.h"
#include "recon/surface/mesh_check.h"
#include "recon/surface/mesh_tree.h"

typedef struct Opening {     // a loop of open edges of the wall
    Vec3 center, normal;     // normal: unit vector out of the vessel
    double radius;           // [mm] radius of the circle of the same area
} Opening;

typedef struct Wall {        // the surface without lids
    SurfaceMesh mesh;
    MeshTree *tree;
    Opening *opening;
    int opening_count, lid_count;
} Wall;

// Creates the wall: removes flat lids at which a curve's end points. Returns false if out of memory.
bool wall_open(const SurfaceMesh *mesh, const CurveSet *set, Wall *wall);
void wall_close(Wall *wall);
// Returns the opening at which a vessel of that radius ends that runs to `end` along `outward`, or -1.
int wall_opening_near(const Wall *wall, Vec3 end, Vec3 outward, double radius);

#endif
