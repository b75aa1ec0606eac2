// Synthetic vessels with known truth: capsule, open-capsule, arc, bifurcation, spiral, phantom.
//
// A shape is a set of parts: tubes (the union of spheres of smoothly varying radius along a smooth curve) and ellipsoids (sacs). Each
// part's field is its signed distance, > 0 inside; parts that belong together are joined by a smooth maximum of width `blend_mm`, parts
// that only lie side by side (kissing vessels) are not. The surface is the zero of that field; it is C1, and its distance is
// found by projection to 1e-10 mm, so truth is exact also at the joints. Lengths mm.
//
// Options come as text pairs, from a scene's `shape: {name: …, key: value}` or from `synth --key value`:
//   points       samples per node of a vessel (default 108)
//   sac_points   samples per aneurysm node (default 1500)
//   noise_mm     standard deviation of the normal noise of samples (0)
//   seed         of noise and of the samples' phase (1)
//   spacing      node spacing in local radii (0.5)
//   blend_mm     width of the joints (0.6 times the smaller radius where 0)
//   length_mm    capsule: segment (4)
//   radius_mm    capsule, arc, bifurcation: tube (1); bend_radius_mm: arc, bifurcation (4)
//   rise_mm      spiral: how far it winds out of its plane (0, the paper's)
//   scale        the whole shape is scaled by it (1)
#ifndef SELDINGER_RECON_PHANTOM_H
#define SELDINGER_RECON_PHANTOM_H

#include "geom/isosurface.h"
#include "geom/vessel_tree.h"
#include "recon/volume.h"

#include <stdint.h>

typedef struct Shape Shape;

// The names, separated by ", ", for messages and help.
const char *shape_names(void);
// NULL with a fault for each unknown key, value out of range or unknown name; `file` is what messages begin with.
Shape *shape_create(const char *name, int option_count, const char (*option)[2][64], const char *file, Faults *faults);
void shape_free(Shape *shape);
// The voxel size that stands for the samples' accuracy when a shape is fitted (LimFitOptions.voxel_mm): 0.05 mm, or twice the noise.
double shape_voxel_mm(const Shape *shape);
// The same from a scene's text options, before or without a shape (unknown or bad values count as absent).
double shape_options_voxel_mm(int option_count, const char (*option)[2][64]);

// The field whose zero is the surface: > 0 inside, gradient of length <= 1, the distance itself away from joints.
double shape_field(const Shape *shape, Vec3 x, Vec3 *gradient);
// The same with open ends cut off flat: the field of the closed body that is meshed.
double shape_field_cut(const Shape *shape, Vec3 x);
// Signed distance to the true surface [mm], > 0 inside; `foot` (may be NULL) is the closest surface point. Near the medial axis the
// local one that projection finds, never less than the field.
double shape_distance(const Shape *shape, Vec3 x, Vec3 *foot);
// Whether x lies beyond an open end (open-capsule, arc, bifurcation, spiral and phantom are open at the inlet; open-capsule at both
// ends): the surface there is no truth, the tube goes on.
bool shape_beyond_open_end(const Shape *shape, Vec3 x);
// Axis-aligned box around the surface.
void shape_bounds(const Shape *shape, Vec3 *low, Vec3 *high);

// Centreline nodes with surface samples, no model. Linked and valid.
VesselTree *shape_sample(const Shape *shape, Faults *faults);
// shape_create and shape_sample in one: what a scene's `shape:` needs.
VesselTree *shape_tree(const char *name, int option_count, const char (*option)[2][64], const char *file, Faults *faults);
// The surface as a closed mesh (open ends flat), marching tetrahedra with vertices projected onto it; every node is 0.
TriangleMesh *shape_surface(const Shape *shape, double cell_mm, Faults *faults);
// A contrast volume: 1 inside, 0 outside, partial voxels by the field, then Gaussian blur `psf_mm` (standard deviation) and
// white noise `noise` (fraction of contrast).
Volume *shape_volume(const Shape *shape, double voxel_mm, double psf_mm, double noise, uint64_t seed, Faults *faults);

#endif
