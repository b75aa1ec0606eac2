// The anatomy around the vessel in fluoroscopy: bone and soft tissue from a volume, or a simple head or trunk made of ellipsoids.
#ifndef SELDINGER_RENDER_FLUOROSCOPE_ANATOMY_H
#define SELDINGER_RENDER_FLUOROSCOPE_ANATOMY_H

#include "geom/geom.h"
#include "render/fluoroscope_options.h"

enum { ELLIPSOIDS_MOST = 40 };

typedef struct Ellipsoid {
    Vec3 center;             // [mm] from Anatomy.middle, along right, anterior, superior
    Vec3 semi;               // [mm] semi-axes along the same directions
    double attenuation;      // [1/mm], added to that of the others: a cavity is an ellipsoid with negative attenuation
} Ellipsoid;

typedef struct Anatomy {
    PatientAxes axes;
    Vec3 middle;
    int ellipsoid_count;
    Ellipsoid ellipsoid[ELLIPSOIDS_MOST];
    // attenuation of the volume on a grid of at most ANATOMY_GRID cells a side; level NULL: none
    int size[3];
    Vec3 origin;             // [mm] corner of the grid
    Mat3 to_grid;            // (x - origin) to 0..1 along each side of the grid
    uint8_t *level;          // (size[2], size[1], size[0]): attenuation in 255ths of `most`
    double most;             // [1/mm]
} Anatomy;

enum { ANATOMY_GRID = 128 };

// The lumen of `vessel` (closed by `lids`) is removed from the volume, because it may be full of contrast agent there. Returns false with a message.
bool anatomy_create(Anatomy *anatomy, const FluoroscopeOptions *options, const MeshLids *lids, char *message, size_t capacity);
void anatomy_free(Anatomy *anatomy);
// Integral of the attenuation along a ray, in double precision (slow: for exposure and tests).
double anatomy_along(const Anatomy *anatomy, Vec3 source, Vec3 direction);

#endif
