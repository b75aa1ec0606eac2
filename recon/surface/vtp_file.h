// Reads VTK XML PolyData (.vtp), as far as surfaces and centrelines need it: points, lines, polygons, strips and the scalar point arrays of all pieces.
// Arrays may be ascii, base64 or appended (raw or base64), uncompressed or compressed by zlib; lz4 and lzma are refused with advice. Source: VTK File
// Formats, "XML file formats" (VTK user's guide). The caller owns the data.
#ifndef SELDINGER_RECON_SURFACE_VTP_FILE_H
#define SELDINGER_RECON_SURFACE_VTP_FILE_H

#include "base/base.h"
#include "geom/geom.h"

typedef struct VtpCells {
    int count;               // C
    int *offset;             // (C+1)
    int *index;              // (offset[C]) indices of points
} VtpCells;

typedef struct VtpData {
    int point_count;         // P
    Vec3 *point;             // (P) finite
    double *radius;          // (P) values of a scalar point array MaximumInscribedSphereRadius, Radius or radius; NULL if a piece has none of them
    VtpCells line, polygon, strip;
} VtpData;

// Returns NULL with faults.
VtpData *vtp_parse(const void *bytes, size_t length, const char *name, Faults *faults);
void vtp_free(VtpData *data);

#endif
