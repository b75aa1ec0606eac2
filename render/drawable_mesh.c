#include "render/drawable_mesh.h"

#include "render/message.h"

#include <stdlib.h>
#include <string.h>

bool drawable_mesh_check(const TriangleMesh *mesh, char *message, size_t capacity)
{
    bool good = mesh->vertex_count >= 0 && mesh->triangle_count >= 0;
    for (int i = 0; good && i < mesh->vertex_count; i++)
        good = vec3_is_finite(mesh->vertex[i]) && vec3_is_finite(mesh->normal[i]);
    for (int i = 0; good && i < mesh->triangle_count; i++)
        for (int k = 0; k < 3; k++)
            good &= mesh->triangle[i][k] >= 0 && mesh->triangle[i][k] < mesh->vertex_count;
    return good || message_fail(message, capacity, "the surface to draw has indices out of range or numbers that are not finite");
}

float *drawable_mesh_floats(const TriangleMesh *mesh, Vec3 origin, char *message, size_t capacity)
{
    size_t count = (size_t)mesh->vertex_count;
    float *value = malloc((6 * count + 1) * sizeof *value);
    if (!value) {
        message_fail(message, capacity, "not enough memory for a surface of %d triangles", mesh->triangle_count);
        return NULL;
    }
    for (size_t i = 0; i < count; i++) {
        Vec3 p = vec3_sub(mesh->vertex[i], origin), n = mesh->normal[i];
        const float entry[6] = {(float)p.x, (float)p.y, (float)p.z, (float)n.x, (float)n.y, (float)n.z};
        memcpy(value + 6 * i, entry, sizeof entry);
    }
    return value;
}
