// The anatomy around the vessel in fluoroscopy: bone and soft tissue from a volume, or a patient made of solids.
#ifndef SELDINGER_RENDER_FLUOROSCOPE_ANATOMY_H
#define SELDINGER_RENDER_FLUOROSCOPE_ANATOMY_H

#include "geom/geom.h"
#include "render/fluoroscope_options.h"
#include "render/patient_body.h"

typedef struct Anatomy {
    Similarity place;        // from the body's frame (render/patient_body.h) to the model's
    Body body;               // empty if the volume has the tissue
    bool has_tissue;         // the volume has CT numbers
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

// What the display makes of it. A range of attenuations from air to the base of the skull, 0 to 7, is more than a screen can show: as in angiography systems the
// differences from the mean are reduced, those of brighter places more and more, so that the edges of soft tissue are not burnt out.
#define SHOWN_SLOPE 0.6
#define SHOWN_SHIFT 0.6          // so much darker than a picture without anatomy
#define SHOWN_BRIGHTEST 1.3      // at most so much brighter than the mean
double anatomy_shown(double attenuation, double mean);

// The solids as seen from one position of the C-arm: a rectangle for each, two triangles of the picture's square from 0 to 1, with the numbers from which a pixel
// finds the length of its ray in the solid. A ray is ray[0] + fx ray[1] + fy ray[2], fx and fy from -0.5 to 0.5; all in the solid's unit space.
enum { SHADOW_VERTICES = 6 };
typedef struct ShadowVertex {
    float place[2];
    float from[3], ray[3][3];
    float plane[2][4];       // rate of (plane . x - offset) along the three rays; its value at the source
    float solid[3];          // attenuation of the wall, that of the filling minus it, square of the hollow
} ShadowVertex;
typedef struct ShapeShadows {    // zeroed: empty
    int count, capacity;         // vertices; shapes
    ShadowVertex *vertex;
    float (*box)[4];             // of each solid that is seen: least x and y, most x and y, 0 to 1
    int *shape;                  // and which it is of the body
} ShapeShadows;
bool shape_shadows_cast(ShapeShadows *shadows, const Anatomy *anatomy, const CArm *c_arm);   // false if out of memory
void shape_shadows_free(ShapeShadows *shadows);
// As anatomy_along() for the ray at fx, fy (-0.5 to 0.5) of the picture for which the shadows were cast: only solids whose rectangle contains it are visited.
double shape_shadows_along(const ShapeShadows *shadows, const Anatomy *anatomy, const CArm *c_arm, double fx, double fy);

#endif
