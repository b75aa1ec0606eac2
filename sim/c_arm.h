// The C-arm: the positions of X-ray source and detector around the patient, and the projection of points into the picture.
//
// A point source at C_ARM_SOURCE_MM from the isocentre projects a cone onto the detector, so objects nearer to the source appear larger, as in the
// angio suite. The picture shows what the detector sees, in the usual orientation: in the frontal view the patient's right is on the left and the head is up;
// LAO
// rotates the detector to the patient's left about the long axis, CRA towards the head.
//
// Models use the frame of their volume, which their files do not record: the caller gives the patient's axes; default LPS.
#ifndef SELDINGER_SIM_C_ARM_H
#define SELDINGER_SIM_C_ARM_H

#include "geom/geom.h"
#include "sim/xray.h"
#include "sim/xray_tube.h"

#define C_ARM_SOURCE_MM XRAY_SOURCE_MM // source to isocentre
#define C_ARM_NEAREST_MM 20.0          // visible points must be further than this from the plane of the source

typedef struct PatientAxes {           // unit vectors in the model's frame, mutually perpendicular; left-handed for a mirrored patient
    Vec3 right, anterior, superior;
} PatientAxes;
PatientAxes patient_axes_lps(void);    // x to the left, y posterior, z superior (DICOM)
PatientAxes patient_axes_ras(void);    // x to the right, y anterior, z superior
bool patient_axes_are_sound(const PatientAxes *axes);

typedef struct CArm {
    Vec3 isocentre;                    // [mm] model frame
    Vec3 right, up;                    // of the picture, unit
    Vec3 towards;                      // unit, from the source through the isocentre to the detector
    double handedness;                 // +1 if (right, up, towards) is right-handed, -1 for a mirrored patient
    double field_mm;                   // side of the visible square at the isocentre
} CArm;

// Computes the C-arm from angles, table and field, clamped to LAO/RAO 90, CRA/CAU 45 degrees, field 40 to 400 mm (NaN: the default).
CArm c_arm_place(const XrayControl *xray, const PatientAxes *axes);
// Projects a point: x, y in units of the field from the middle of the square (-0.5 to 0.5 inside, y up); z: depth [mm] from the plane of the isocentre
// towards the detector.
Vec3 c_arm_project(const CArm *c_arm, Vec3 point);
Vec3 c_arm_source(const CArm *c_arm);
// Unit direction of the ray from the source that hits the detector at x, y [field].
Vec3 c_arm_ray(const CArm *c_arm, double x, double y);
// Column-major matrix from the model's frame relative to `origin` to clip space of the square; depths between near and far [mm] from the plane of the source.
void c_arm_matrix(const CArm *c_arm, Vec3 origin, double near_mm, double far_mm, float matrix[16]);
// "LAO 20 CRA 10", "RAO 5 CAU 0" …: whole degrees, as shown on the screen.
void c_arm_label(const XrayControl *xray, char text[32]);

#endif
