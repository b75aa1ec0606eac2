// Synthetic vessels whose geometry is known exactly: capsule, open-capsule, arc, bifurcation, spiral, phantom; helix, y, kissing, bone, twig, tree, aorta, arch.
//
// A shape is a set of parts: tubes (the union of spheres of smoothly varying radius along a smooth curve) and ellipsoids (sacs). Each part's field is
// its signed distance, > 0 inside; connected parts are joined by a smooth maximum of width `blend_mm`, parts that only lie side by side
// (touching vessels) are not. The surface is the zero level of that field; it is C1. Distances are found by projection to 1e-10 mm, so they are exact
// at the joints too. Lengths in mm.
//
// Options are pairs of strings, from a scene's `shape: {name: …, key: value}` or from `synth --key value` (defaults in parentheses):
//   points       samples per node of a vessel (default 108)
//   sac_points   samples per aneurysm node (default 1500)
//   noise_mm     standard deviation of the normal noise of samples (0)
//   seed         of noise and of the samples' phase (1)
//   spacing      node spacing in local radii (0.5)
//   blend_mm     width of the joints (0: 0.6 times the smaller radius)
//   length_mm    length; capsule: of the segment (4); y: of trunk and daughters, at least 4 radii; twig: of the vessel, at least 12 radii
//   radius_mm    capsule, arc, bifurcation, helix, y, kissing, bone, twig: radius of the tube (1); tree: of the trunk (1.6)
//   bend_radius_mm  arc, bifurcation, helix: radius of the centreline's bend (4)
//   rise_mm      spiral: its rise out of the plane (0, as in the paper); helix: its total rise (12)
//   turns        helix: number of turns (2)
//   angle_deg    y: angle of each daughter to the trunk (37.5, Murray's)
//   twig_radius_mm  twig: radius of the tiny branch, which is 0.6 lengths long (0.2)
//   branches     tree: number of segments between bifurcations, or bifurcation and end, at most 200 (51; odd)
//   sacs         tree: number of aneurysms on its branches (0)
//   blocks       bone, tree: number of dense blocks beside the vessels (6, 0)
//   gap_mm       kissing: distance from wall to wall (0.2); bone, tree: from wall to block (0: they touch)
//   crossing_deg kissing: angle between the two vessels; 0: they run side by side for twelve radii (0)
//   arch_type    arch: variant of its branches: 1 (usual), 2, 4, 5, 6 or 7 (1)
//   spread       arch: factor of the standard deviations; 0: the mean arch of its type (1)
//   diameter_scale  arch: factor of its diameters (1)
//   scale        scale factor of the whole shape (1)
#ifndef SELDINGER_RECON_PHANTOM_PHANTOM_H
#define SELDINGER_RECON_PHANTOM_PHANTOM_H

#include "geom/geom.h"
#include "recon/phantom/phantom_block.h"
#include "recon/phantom/phantom_field.h"
#include "recon/volume/volume.h"

#include <stdint.h>

// The names of all shapes, for messages and help.
#define SHAPE_NAMES "capsule, open-capsule, arc, bifurcation, spiral, phantom, helix, y, kissing, bone, twig, tree, aorta, arch"

// Creates a shape. Returns NULL with a fault for each unknown key, value out of range or unknown name; `file` is the prefix of messages.
Shape *shape_create(const char *name, int option_count, const char (*option)[2][64], const char *file, Faults *faults);
void shape_free(Shape *shape);
// Returns the voxel size [mm] that represents the samples' accuracy when a shape is fitted (LimFitOptions.voxel_mm): 0.05 mm, or twice the noise.
double shape_voxel_mm(const Shape *shape);
// The same from a scene's options, without a shape. Unknown keys and invalid values count as absent.
double shape_options_voxel_mm(int option_count, const char (*option)[2][64]);

// Objects that are visible in an angiogram but not part of the vessel: a touching neighbour (NULL: none), and bone.
const Shape *shape_neighbour(const Shape *shape);
const ShapeBlock *shape_blocks(const Shape *shape, int *count);

// Returns a tree of centreline nodes with samples of the surface, without a model; linked and valid. Returns NULL with a fault if out of memory.
VesselTree *shape_sample(const Shape *shape, Faults *faults);
// Does shape_create and shape_sample in one call, for a scene's `shape:`.
VesselTree *shape_tree(const char *name, int option_count, const char (*option)[2][64], const char *file, Faults *faults);
// Returns the surface as a closed mesh (open ends are flat). Vertices lie on the surface; edges are at most 0.6 cells long on average. Each vertex has node 0.
TriangleMesh *shape_surface(const Shape *shape, double cell_mm, Faults *faults);
// Options of the simulated angiogram. Vessels are 1, background 0.
typedef struct VolumeOptions {
    double voxel_mm[3];      // edges of a voxel along the grid's axes
    double psf_mm;           // standard deviation of the Gaussian blur (point spread function)
    double noise;            // standard deviation of the white noise, in units of the contrast
    uint64_t seed;           // seed of the noise
    double rotate_deg;       // rotation of the grid about the axis (1, 2, 3); patient coordinates stay those of the shape
    double clip, saturate;   // values below and above are clipped, after the noise; -HUGE_VAL, HUGE_VAL: none
    double fade;             // fraction of the brightness lost between the root and the furthest tip
    double bone;             // brightness of blocks; default 1.2
    double band;             // contrast by which a slab across the trunk, and the vessels in it, are brighter; 0: no slab
    double band_mm;          // thickness of the slab; its position and direction are random, from the seed
    double contrast_grey;    // > 0: integer grey values 0 to 255; vessels are brighter than the background by this much
    double background_grey;  // grey value of the background, 0 to 255
    int threads;             // 0: all cores; results do not depend on them
} VolumeOptions;
VolumeOptions volume_default_options(void);
// Computes the fraction of each voxel inside the vessel (partial voxels from the field), then applies blur, noise and clipping. Returns NULL with a fault.
Volume *shape_volume(const Shape *shape, const VolumeOptions *options, Faults *faults);

#endif
