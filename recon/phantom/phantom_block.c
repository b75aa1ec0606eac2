#include "recon/phantom/phantom_block.h"

// Signed distance: exact outside, inside the distance to the nearest face.
double shape_block_distance(const ShapeBlock *block, Vec3 x)
{
    Vec3 d = vec3_sub(x, block->center);
    double q[3] = {fabs(vec3_dot(d, block->axis[0])) - block->half.x, fabs(vec3_dot(d, block->axis[1])) - block->half.y,
                   fabs(vec3_dot(d, block->axis[2])) - block->half.z};
    double within = fmax(q[0], fmax(q[1], q[2]));
    if (within < 0)
        return -within;
    return -sqrt(same_square(fmax(q[0], 0)) + same_square(fmax(q[1], 0)) + same_square(fmax(q[2], 0)));
}
