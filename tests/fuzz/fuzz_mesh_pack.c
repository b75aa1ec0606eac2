// A mesh that is accepted has indices within range and is packed again to the same bytes. The target replaces the checksum at the end of the input by the right
// one, which a fuzzer could not find, and asks for the key in the input.
// Covers: recon/surface/mesh_pack.c
#include "recon/surface/mesh_pack.h"

#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void check(const TriangleMesh *mesh)
{
    for (int v = 0; v < mesh->vertex_count; v++)
        if (!vec3_is_finite(mesh->vertex[v]))
            abort();
    for (int t = 0; t < mesh->triangle_count; t++)
        for (int k = 0; k < 3; k++)
            if (mesh->triangle[t][k] < 0 || mesh->triangle[t][k] >= mesh->vertex_count)
                abort();
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    enum { KEY_AT = 24 };
    uint8_t *copy = malloc(size + 1);
    ContentDigest key = {{0}}, digest = content_digest_begin();
    memcpy(copy, data, size);
    if (size >= KEY_AT + sizeof key)
        memcpy(&key, data + KEY_AT, sizeof key);
    if (size > sizeof digest) {
        content_digest_add(&digest, data, size - sizeof digest);
        memcpy(copy + size - sizeof digest, &digest, sizeof digest);
    }
    TriangleMesh *mesh = mesh_unpack(copy, size, &key);
    if (mesh) {
        size_t length = 0;
        check(mesh);
        uint8_t *again = mesh_pack(mesh, &key, &length);
        if (!again || length != size || memcmp(again, copy, size) != 0)
            abort();
        free(again);
    }
    triangle_mesh_free(mesh);
    free(copy);
    return 0;
}
