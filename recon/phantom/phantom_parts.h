// The parts of a synthetic shape (phantom.h defines a shape). Internal to recon.
//
// A part is the union of spheres of radius r(t) along a curve C(t), both cubic splines of arc length (chord length at the knots), straight beyond
// open ends:
//   f_part(X) = max_t r(t) - |X - C(t)|      exact signed distance of the swept surface (outside everywhere, inside up to the medial axis)
#ifndef SELDINGER_RECON_PHANTOM_PHANTOM_PARTS_H
#define SELDINGER_RECON_PHANTOM_PHANTOM_PARTS_H

#include "geom/geom.h"
#include "recon/phantom/phantom_block.h"

#include <stdint.h>

enum { KNOTS = 128 };

typedef struct Spline {      // one coordinate: value and second derivative at each knot
    double value[KNOTS], bend[KNOTS];
} Spline;

typedef struct Part {
    int knot_count;
    double at[KNOTS];        // knot parameter [mm of chord]
    Spline coordinate[4];    // x, y, z, r
    bool open_start, open_end;   // continued straight, without a cap
    double low, high;        // parameter range including the straight pieces
    int parent;              // parent part, or -1
    uint8_t kind;            // kind of its nodes
    int sample_count;        // coarse samples from which the search starts
    Vec3 *sample;
    double *sample_radius, *sample_at;
    int block_count;         // spheres, each around eight samples
    Vec3 *block_center;
    int *block_sample;       // the middle sample; its radius and parameter
    double *block_radius, *block_at;
    double *block_reach;     // largest |C - center| + r in the block: f <= reach - |X - center|
} Part;

typedef struct Cell {        // a cell of the octree over the shape: the parts that can affect the field anywhere in it
    int child;               // first of eight consecutive children, or -1
    int first, count;        // range of its parts in `cell_part`
} Cell;

typedef struct Shape Shape;
struct Shape {
    char name[32];
    int part_count, part_capacity;
    Part *part;
    double widest_joint;
    double blend;            // 0: 0.6 times the child's first radius
    int points, sac_points;
    double noise, spacing;
    uint64_t seed;
    Shape *neighbour;        // vessels visible in the volume but not part of the truth, or NULL
    int block_count;         // number of bone blocks
    ShapeBlock *block;

    Vec3 cell_low;           // octree: a cube of edge `cell_edge` with its low corner here
    double cell_edge;
    int cell_count, cell_capacity, cell_part_count, cell_part_capacity;
    Cell *cell;
    int *cell_part;
};

typedef struct Station {     // a point of a part's centreline at parameter t
    Vec3 center, tangent;    // tangent is dC/dt, nearly unit
    double radius, taper;    // taper is dr/dt; radius is constant beyond open ends
} Station;

Station part_at(const Part *part, double t);
void part_free(Part *part);
// Scales a part about the origin. Returns false if out of memory.
bool part_scale(Part *part, double scale);
// Returns f_part, its gradient and the parameter of the sphere that determines it. `enough`: if f is below it, any upper bound below `enough` may be
// returned. `cut`: without the straight pieces beyond open ends.
double part_field(const Part *part, Vec3 x, double enough, bool cut, Vec3 *gradient, double *at);

// Appends a part. Returns false if out of memory.
bool shape_add(Shape *shape, const double (*knot)[4], int count, bool open_start, bool open_end, int parent, uint8_t kind, const double (*end_slope)[4]);
// Adds the parts of the shape `aorta`.
bool aorta_grow(Shape *shape);
typedef struct ArchOptions {
    int type;                // 1, 2, 4, 5, 6, 7: variant of the branches
    double spread;           // factor of all standard deviations; 0: the mean arch
    double diameter_scale;   // factor of all diameters
    uint64_t seed;
} ArchOptions;
// Adds the parts of the shape `arch`: the aorta first.
bool arch_grow(Shape *shape, const ArchOptions *options);
// Completes the shape after the last part: joints and octree. Returns false if out of memory.
bool shape_finish(Shape *shape);
// Like shape_field; also returns the part with the largest value there and its parameter.
double shape_field_of_part(const Shape *shape, Vec3 x, int *part, double *at);

#endif
