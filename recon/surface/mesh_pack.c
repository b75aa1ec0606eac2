#include "recon/surface/mesh_pack.h"

#include <stdlib.h>
#include <string.h>

enum { MAGIC = 8, VERSION = 1, COUNT_MOST = (1 << 28) - 1 };

typedef struct PackHead {
    char magic[MAGIC];
    uint32_t version, vertices, triangles, zero;
    ContentDigest key;
} PackHead;

_Static_assert(sizeof(PackHead) == 56 && sizeof(Vec3) == 24 && sizeof(int) == 4, "the format has no gaps");

typedef struct PackLayout {
    size_t vertex, normal, node, triangle, checksum, length;     // offsets
} PackLayout;

static PackLayout layout_of(size_t vertices, size_t triangles)
{
    PackLayout at = {.vertex = sizeof(PackHead)};
    at.normal = at.vertex + vertices * sizeof(Vec3);
    at.node = at.normal + vertices * sizeof(Vec3);
    at.triangle = at.node + vertices * sizeof(int);
    at.checksum = at.triangle + 3 * triangles * sizeof(int);
    at.length = at.checksum + sizeof(ContentDigest);
    return at;
}

static PackHead head_of(uint32_t vertices, uint32_t triangles, const ContentDigest *key)
{
    return (PackHead){{'S', 'E', 'L', 'D', 'M', 'E', 'S', 'H'}, VERSION, vertices, triangles, 0, *key};
}

static ContentDigest digest_of(const uint8_t *bytes, size_t length)
{
    ContentDigest digest = content_digest_begin();
    content_digest_add(&digest, bytes, length);
    return digest;
}

uint8_t *mesh_pack(const TriangleMesh *mesh, const ContentDigest *key, size_t *length)
{
    const bool is_whole = mesh->vertex && mesh->normal && mesh->node && mesh->triangle;
    if (!is_whole || mesh->vertex_count > COUNT_MOST || mesh->triangle_count > COUNT_MOST)
        return NULL;
    const size_t vertices = (size_t)mesh->vertex_count, triangles = (size_t)mesh->triangle_count;
    const PackLayout at = layout_of(vertices, triangles);
    const PackHead head = head_of((uint32_t)vertices, (uint32_t)triangles, key);
    uint8_t *bytes = malloc(at.length);
    if (!bytes)
        return NULL;
    memcpy(bytes, &head, sizeof head);
    memcpy(bytes + at.vertex, mesh->vertex, vertices * sizeof *mesh->vertex);
    memcpy(bytes + at.normal, mesh->normal, vertices * sizeof *mesh->normal);
    memcpy(bytes + at.node, mesh->node, vertices * sizeof *mesh->node);
    memcpy(bytes + at.triangle, mesh->triangle, triangles * sizeof *mesh->triangle);
    const ContentDigest checksum = digest_of(bytes, at.checksum);
    memcpy(bytes + at.checksum, &checksum, sizeof checksum);
    *length = at.length;
    return bytes;
}

static void *copy_of(const uint8_t *from, size_t bytes)
{
    void *copy = malloc(bytes + 1);
    if (copy)
        memcpy(copy, from, bytes);
    return copy;
}

static bool is_sound(const TriangleMesh *mesh)
{
    bool good = true;
    for (int v = 0; v < mesh->vertex_count; v++)
        good &= vec3_is_finite(mesh->vertex[v]);
    for (int t = 0; t < mesh->triangle_count; t++)
        for (int k = 0; k < 3; k++)
            good &= mesh->triangle[t][k] >= 0 && mesh->triangle[t][k] < mesh->vertex_count;
    return good;
}

TriangleMesh *mesh_unpack(const uint8_t *bytes, size_t length, const ContentDigest *key)
{
    PackHead head;
    if (length < sizeof head)
        return NULL;
    memcpy(&head, bytes, sizeof head);
    if (head.vertices > COUNT_MOST || head.triangles > COUNT_MOST)
        return NULL;
    const PackHead expected = head_of(head.vertices, head.triangles, key);
    const PackLayout at = layout_of(head.vertices, head.triangles);
    if (memcmp(&head, &expected, sizeof head) != 0 || length != at.length)
        return NULL;
    const ContentDigest checksum = digest_of(bytes, at.checksum);
    TriangleMesh *mesh = memcmp(bytes + at.checksum, &checksum, sizeof checksum) == 0 ? calloc(1, sizeof *mesh) : NULL;
    if (!mesh)
        return NULL;
    mesh->vertex_count = (int)head.vertices;
    mesh->triangle_count = (int)head.triangles;
    mesh->vertex = copy_of(bytes + at.vertex, at.normal - at.vertex);
    mesh->normal = copy_of(bytes + at.normal, at.node - at.normal);
    mesh->node = copy_of(bytes + at.node, at.triangle - at.node);
    mesh->triangle = copy_of(bytes + at.triangle, at.checksum - at.triangle);
    if (mesh->vertex && mesh->normal && mesh->node && mesh->triangle && is_sound(mesh))
        return mesh;
    triangle_mesh_free(mesh);
    return NULL;
}
