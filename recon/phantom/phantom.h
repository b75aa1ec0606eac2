// Synthetic vessels with known truth: capsule, open-capsule, arc, bifurcation, spiral, phantom; helix, y, kissing, bone, twig, tree, aorta.
//
// A shape is a set of parts: tubes (the union of spheres of smoothly varying radius along a smooth curve) and ellipsoids (sacs). Each part's field is
// its signed distance, > 0 inside; parts that belong together are joined by a smooth maximum of width `blend_mm`, parts that only lie side by side
// (touching vessels) are not. The surface is the zero of that field; it is C1, and its distance is found by projection to 1e-10 mm, so truth is exact
// also at the joints. Lengths mm.
//
// Options come as text pairs, from a scene's `shape: {name: …, key: value}` or from `synth --key value`:
//   points       samples per node of a vessel (default 108)
//   sac_points   samples per aneurysm node (default 1500)
//   noise_mm     standard deviation of the normal noise of samples (0)
//   seed         of noise and of the samples' phase (1)
//   spacing      node spacing in local radii (0.5)
//   blend_mm     width of the joints (0.6 times the smaller radius where 0)
//   length_mm    capsule: segment (4); y: trunk and daughters, twig: the vessel, at least 4 and 12 radii
//   radius_mm    capsule, arc, bifurcation, helix, y, kissing, bone, twig: tube (1); tree: trunk (1.6)
//   bend_radius_mm  arc, bifurcation, helix: of the centreline (4)
//   rise_mm      spiral: how far it winds out of its plane (0, the paper's); helix: whole rise (12)
//   turns        helix (2)
//   angle_deg    y: of each daughter against the trunk (37.5, Murray's)
//   twig_radius_mm  twig: the tiny vessel, 0.6 lengths long (0.2)
//   branches     tree: segments between bifurcations, or bifurcation and end, up to 200 (51; odd)
//   sacs         tree: aneurysms on its branches (0)
//   blocks       bone, tree: dense blocks beside the vessels (6, 0)
//   gap_mm       kissing: from wall to wall (0.2); bone, tree: from wall to block (0: they touch)
//   crossing_deg kissing: angle of the two vessels, 0: they run side by side for twelve radii (0)
//   scale        the whole shape is scaled by it (1)
#ifndef SELDINGER_RECON_PHANTOM_PHANTOM_H
#define SELDINGER_RECON_PHANTOM_PHANTOM_H

#include "geom/geom.h"
#include "recon/phantom/phantom_block.h"
#include "recon/phantom/phantom_field.h"
#include "recon/volume/volume.h"

#include <stdint.h>

// The names, separated by ", ", for messages and help.
const char *shape_names(void);
// NULL with a fault for each unknown key, value out of range or unknown name; `file` is the prefix of messages.
Shape *shape_create(const char *name, int option_count, const char (*option)[2][64], const char *file, Faults *faults);
void shape_free(Shape *shape);
// The voxel size that represents the samples' accuracy when a shape is fitted (LimFitOptions.voxel_mm): 0.05 mm, or twice the noise.
double shape_voxel_mm(const Shape *shape);
// The same from a scene's text options, before or without a shape (unknown or bad values count as absent).
double shape_options_voxel_mm(int option_count, const char (*option)[2][64]);

// Objects visible in an angiogram but not part of the truth: a touching neighbour (NULL: none), and bone.
const Shape *shape_neighbour(const Shape *shape);
const ShapeBlock *shape_blocks(const Shape *shape, int *count);

// Centreline nodes with surface samples, no model. Linked and valid.
VesselTree *shape_sample(const Shape *shape, Faults *faults);
// shape_create and shape_sample in one: for a scene's `shape:`.
VesselTree *shape_tree(const char *name, int option_count, const char (*option)[2][64], const char *file, Faults *faults);
// The surface as a closed mesh (open ends flat), vertices on it, edges of 0.6 cells and less on the average; every node is 0.
TriangleMesh *shape_surface(const Shape *shape, double cell_mm, Faults *faults);
// Options of the simulated angiogram. Vessels are 1, background 0.
typedef struct VolumeOptions {
    double voxel_mm[3];      // edges along the grid's axes
    double psf_mm;           // standard deviation of the Gaussian blur
    double noise;            // standard deviation of the white noise, in contrasts
    uint64_t seed;           // of the noise
    double rotate_deg;       // the grid is turned by this much about (1, 2, 3); patient coordinates stay the shape's
    double clip, saturate;   // values below and above are cut, after the noise; -HUGE_VAL, HUGE_VAL: none
    double fade;             // fraction of the brightness lost between the root and the furthest tip
    double bone;             // brightness of blocks (1.2)
    double band;             // a slab across the trunk is brighter by so many contrasts (0: none), vessels in it too …
    double band_mm;          // … its thickness [mm]; its place and direction come from the seed
    double contrast_grey;    // > 0: whole grey values 0 to 255, vessels this much brighter than the background
    double background_grey;  // 0 to 255
    int threads;             // 0: all cores; results do not depend on them
} VolumeOptions;
VolumeOptions volume_default_options(void);
// Share of each voxel inside (partial voxels by the field), then blur, noise and clipping. NULL with a fault.
Volume *shape_volume_with(const Shape *shape, const VolumeOptions *options, Faults *faults);
// The same with cubic voxels and nothing else.
Volume *shape_volume(const Shape *shape, double voxel_mm, double psf_mm, double noise, uint64_t seed, Faults *faults);

#endif
