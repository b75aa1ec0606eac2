// The true surface of a shape as triangles: the zero of the field of its closed body (geom/isosurface.h).
#include "recon/phantom/phantom.h"

#include "recon/phantom/phantom_parts.h"

#include <stdlib.h>

static const double FINER = 0.6;             // cells of marching cubes for as many triangles as tetrahedra in cells of cell_mm, which `import` was tuned with

typedef struct Body {
    const Shape *shape;
    Vec3 shift;              // of the lattice: an odd one keeps its points off the planes of flat ends
} Body;

static double field(const void *of, Vec3 x)
{
    const Body *body = of;
    return shape_field_cut(body->shape, vec3_add(x, body->shift));
}

TriangleMesh *shape_surface(const Shape *shape, double cell_mm, Faults *faults)
{
    Body body = {.shape = shape};
    Vec3 high, margin = vec3_scale(vec3(1, 1, 1), 1.377 * cell_mm);
    int count = 0, balls = 0;
    shape_bounds(shape, &body.shift, &high);
    body.shift = vec3_sub(body.shift, margin);
    for (int p = 0; p < shape->part_count; p++)
        balls += shape->part[p].block_count;
    Vec3 *center = malloc(((size_t)balls + 1) * sizeof *center);
    double *reach = malloc(((size_t)balls + 1) * sizeof *reach);
    for (int p = 0; center && reach && p < shape->part_count; p++)
        for (int k = 0; k < shape->part[p].block_count; k++) {
            const Part *part = &shape->part[p];
            center[count] = vec3_sub(part->block_center[k], body.shift);
            // what lies between two samples, and by how much a joint swells
            reach[count++] = part->block_reach[k] + part->sample_at[1] - part->sample_at[0] + shape->widest_joint / 6;
        }
    TriangleMesh *mesh = center && reach ? isosurface_of_field(field, &body, count, center, reach, FINER * cell_mm) : NULL;
    for (int v = 0; mesh && v < mesh->vertex_count; v++)
        mesh->vertex[v] = vec3_add(mesh->vertex[v], body.shift);
    if (!mesh)
        faults_add(faults, "surface", 0, 0, "not enough memory for cells of %g mm; use larger ones", cell_mm);
    free(center);
    free(reach);
    return mesh;
}
