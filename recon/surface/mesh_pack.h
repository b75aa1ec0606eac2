// A triangle mesh as bytes, bit for bit: the format of the cache of surfaces (sim/surface_cache.h), not one for exchange (surface_file.h has those). In the byte
// order of the machine; a file from a machine with another one has another version.
//   0 "SELDMESH"   8 u32 version 1   12 u32 vertices V   16 u32 triangles T   20 u32 zero   24 key, 4 u64
//   56 vertex (V,3) f64, normal (V,3) f64, node (V) i32, triangle (T,3) i32, then the content digest (base/content_digest.h) of all bytes before it, 4 u64
#ifndef SELDINGER_RECON_SURFACE_MESH_PACK_H
#define SELDINGER_RECON_SURFACE_MESH_PACK_H

#include "base/base.h"
#include "geom/geom.h"

// `key`: what the mesh was made of and how. The caller frees the bytes. NULL if out of memory, or if the mesh lacks an array or has 2^28 vertices or triangles or more.
uint8_t *mesh_pack(const TriangleMesh *mesh, const ContentDigest *key, size_t *length);
// NULL unless the bytes are exactly a mesh of this key: version, size, checksum, finite vertices and the indices of triangles are checked. A damaged or foreign
// file is not an error; the caller makes the mesh again.
TriangleMesh *mesh_unpack(const uint8_t *bytes, size_t length, const ContentDigest *key);

#endif
