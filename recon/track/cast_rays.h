// Finds candidate points on a vessel's surface: rays from a centre, each with the point at which the image falls most steeply along it. Kerrien et al. 2017,
// 3.1.1 and 3.2. No state is kept; the caller owns the arrays.
#ifndef SELDINGER_RECON_TRACK_CAST_RAYS_H
#define SELDINGER_RECON_TRACK_CAST_RAYS_H

#include "recon/volume/volume.h"

enum { MAX_RAY_SAMPLES = 1024 };

typedef struct RayOptions {
    double length;           // [mm] length of a ray
    int samples;             // samples along a ray, 8 … MAX_RAY_SAMPLES
    double smoothing;        // [mm] width of the moving average along the ray; 0: none
    double edge;             // least fall per voxel, as a fraction of the brightness range around the centre; 0 keeps every ray
} RayOptions;

// Writes the vertices of an icosahedron subdivided `level` times (0 to 4): 12, 42, 162, 642 or 2562 unit vectors. `out` must have space for all of them.
int sphere_direction_count(int level);
void sphere_directions(int level, Vec3 *out);
// Returns the level that has `count` vertices, or -1.
int sphere_level_of(int count);

// Finds the steepest fall along each ray, to a fraction of a sample. Writes the points of the rays that have an edge, in the order of the rays, and returns
// their number.
int cast_rays(const Volume *volume, Vec3 center, const Vec3 *direction, int count, const RayOptions *options, Vec3 *point);
// Finds on each ray the first fall below the brightness `level`, moved to the steepest point within a voxel: distance[i] [mm], 0 if ray i has none.
void cast_rays_level_edge(const Volume *volume, Vec3 center, const Vec3 *direction, int count, const RayOptions *options, double level, double *distance);
// The same, with the level halfway between the centre's brightness and the volume's minimum. Used for aneurysms, whose rays may continue into other vessels.
void cast_rays_first_edge(const Volume *volume, Vec3 center, const Vec3 *direction, int count, const RayOptions *options, double *distance);

#endif
