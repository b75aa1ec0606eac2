// Internal to import: curves joined to one rooted tree of fine samples, its ends at the openings of the wall.
#ifndef SELDINGER_RECON_SURFACE_IMPORT_SKELETON_H
#define SELDINGER_RECON_SURFACE_IMPORT_SKELETON_H

#include "recon/surface/import_surface.h"
#include "recon/surface/mesh_tree.h"

typedef struct Opening {     // a loop of open edges of the wall
    Vec3 center, normal;     // normal: unit, out of the vessel
    double radius;           // [mm] of the circle of the same area
} Opening;

typedef struct Wall {        // the surface without lids
    SurfaceMesh mesh;
    MeshTree *tree;
    Opening *opening;
    int opening_count, lid_count;
} Wall;

typedef struct Skeleton {
    int count;
    Vec3 *point;
    double *radius;          // inscribed [mm]
    double *given;           // the curve's own [mm], 0 where it has none
    int *parent;             // -1 at 0, parents before children
    bool *is_open_end;       // at an opening
} Skeleton;

enum { SECTION_RAYS = 16 };
// Median distance of the wall from p square to unit `tangent` [mm] within `reach`, the least, and the section's centroid; 0 where little wall is there.
double section_radius(const MeshTree *tree, Vec3 p, Vec3 tangent, double reach, double *least, Vec3 *centroid);
// The curves, sampled, what leaves the lumen or grazes its wall mended (import_curves.c). NULL where memory lacks.
CurveSet *curves_in_lumen(const SurfaceMesh *mesh, const MeshTree *tree, const CurveSet *set, ImportReport *report);

// Takes flat lids off where a curve's end points at one. False where memory lacks.
bool wall_open(const SurfaceMesh *mesh, const CurveSet *set, Wall *wall);
void wall_close(Wall *wall);
// NULL with faults.
Skeleton *skeleton_join(const CurveSet *set, const Wall *wall, const ImportOptions *options, ImportReport *report, const char *name, Faults *faults);
void skeleton_free(Skeleton *skeleton);
// The opening at which a vessel of that radius ends that runs to `end` along `outward`; -1 where there is none.
int wall_opening_near(const Wall *wall, Vec3 end, Vec3 outward, double radius);

#endif
