// The zero level of a field as triangles: marching cubes with vertices where the edges of the lattice cross it (isosurface.h).
#include "geom/isosurface.h"
#include "geom/sparse_march.h"

#include <stdlib.h>

typedef struct FieldMarch {
    March march;             // must be first: callbacks convert their March * to FieldMarch *
    double (*field)(const void *of, Vec3 x);
    const void *of;
} FieldMarch;

static const double LEAST_SHARE = 1e-6;      // [cell] a vertex stays this far from lattice points, so that it shows the direction of its edge

// Finds the zero on the edge of the lattice through p, along the only coordinate that is not a multiple of the cell (Illinois method).
static void place(March *march, const MarchBlock *block, Vec3 p, int owner, Vec3 *vertex, Vec3 *normal, int *node)
{
    const FieldMarch *job = (const FieldMarch *)march;
    double cell = march->cell;
    Vec3 a = vec3(cell * floor(p.x / cell + 1e-7), cell * floor(p.y / cell + 1e-7), cell * floor(p.z / cell + 1e-7)), far = vec3_sub(p, a);
    double along = fmax(far.x, fmax(far.y, far.z)), low = 0, high = 1, t = 0.5;
    Vec3 b = vec3(a.x + cell * (far.x == along), a.y + cell * (far.y == along), a.z + cell * (far.z == along));
    double fa = job->field(job->of, a), fb = job->field(job->of, b);
    for (int i = 0; i < 60 && high - low > 1e-14; i++) {
        t = low + (high - low) * fa / (fa - fb);
        double f = job->field(job->of, vec3_mix(a, b, t));
        if (fabs(f) < 1e-11)
            break;
        if ((f > 0) == (fa > 0))
            low = t, fa = f, fb *= 0.5;
        else
            high = t, fb = f, fa *= 0.5;
    }
    (void)block, (void)owner;
    *vertex = vec3_mix(a, b, t);
    *normal = vec3(0, 0, 0);
    *node = 0;
}

TriangleMesh *isosurface_of_field(double (*field)(const void *of, Vec3 x), const void *of, int count, const Vec3 *center, const double *reach, double cell_mm)
{
    FieldMarch *job = isfinite(cell_mm) && cell_mm > 0 ? calloc(1, sizeof *job) : NULL;
    if (!job)
        return NULL;
    March *march = &job->march;
    job->field = field;
    job->of = of;
    march->place = place;
    bool good = march_begin(march, cell_mm, LEAST_SHARE);
    for (int i = 0; good && i < count; i++)
        good = vec3_is_finite(center[i]) && isfinite(reach[i]) && march_add_ball(march, i, center[i], reach[i]);
    for (int n = 0; good && n < march->block_count; n++) {
        MarchBlock *b = &march->block[n];
        double radius;
        Vec3 middle = march_block_ball(march, b, &radius);
        if (fabs(field(of, middle)) > radius)
            continue;
        for (int i = 0; i < MARCH_SIDE; i++)
            for (int j = 0; j < MARCH_SIDE; j++)
                for (int k = 0; k < MARCH_SIDE; k++)
                    march->value[march_index(i, j, k)] = field(of, march_point(march, b, i, j, k));
        good = march_block(march, b);
    }
    TriangleMesh *mesh = march->mesh;
    march_end(march);
    free(job);
    if (good && march_repair_normals(mesh))
        return mesh;
    triangle_mesh_free(mesh);
    return NULL;
}
