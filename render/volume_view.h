// Pictures of a volume, computed without graphics: slices and maximum projections through any parallel projection, in the patient's orientation.
#ifndef SELDINGER_RENDER_VOLUME_VIEW_H
#define SELDINGER_RENDER_VOLUME_VIEW_H

#include "recon/recon.h"
#include "render/camera.h"

// The directions of the patient in the volume's space. If the header does not say them, those of LPS are assumed and letters are of the axes.
typedef struct VolumeAxes {
    Vec3 left, posterior, superior;      // unit
    bool is_known;
} VolumeAxes;
VolumeAxes patient_axes(const char *frame);
// The letter of the patient's side in this direction, and of a second one if it is oblique: "L", "RA"; without orientation "+x".
void patient_letters(const VolumeAxes *axes, Vec3 direction, char out[4]);

typedef enum { SLICE_AXIAL, SLICE_CORONAL, SLICE_SAGITTAL } SliceView;
// As radiologists look: axial from the feet, coronal from the front, sagittal from the left. The volume fills a view of this size; `zoom` 1: whole.
Camera slice_camera(const VolumeAxes *axes, SliceView view, const Volume *volume, Vec3 center, double zoom, int width, int height);
Vec3 volume_middle(const Volume *volume);
// The point [mm] of a pixel in the plane through `through` that is parallel to the picture.
Vec3 camera_point(const Camera *camera, double x, double y, Vec3 through);

// Brightness as grey: 0 to 255 from `low` to `high`, (height, width) rows from the top. Outside the volume 0.
void volume_slice(const Volume *volume, const Camera *camera, Vec3 through, double low, double high, uint8_t *grey);
void volume_projection(const Volume *volume, const Camera *camera, double low, double high, int threads, uint8_t *grey);
// The place of the vessel that is seen in a projection, drawn from `low` to `high`, at a pixel or up to six pixels beside it: the middle of the bright stretch nearest
// to the eye. Brighter and nearer pixels come first. False if nothing there is brighter than dark grey.
bool volume_pick(const Volume *volume, const Camera *camera, double low, double high, double x, double y, Vec3 *place);
double volume_value_at(const Volume *volume, Vec3 x);        // trilinear; the least value outside

// The lines in which a plane cuts triangles. `call` for each: its ends and the triangle's first vertex.
void mesh_cut(const TriangleMesh *mesh, Vec3 point, Vec3 normal, void (*call)(void *context, Vec3 a, Vec3 b, int vertex), void *context);

#endif
