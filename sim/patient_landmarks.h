// Where vessels lie in a patient: segments that a scene's `anatomy:` can name, and landmarks along them.
//
// The body's frame [mm]: x to the patient's right, y anterior, z superior; the origin is the sella turcica (render/patient_body.h has the bones).
#ifndef SELDINGER_SIM_PATIENT_LANDMARKS_H
#define SELDINGER_SIM_PATIENT_LANDMARKS_H

#include "geom/geom.h"

typedef struct PatientSegment {
    const char *name;
    Vec3 middle;                 // of the segment as angiograms show it
    int side;                    // 1 right, -1 left, 0 neither
} PatientSegment;

// Each list ends with NULL. Landmarks are named without a side.
extern const PatientSegment patient_segment[];
extern const char *const patient_segment_name[];
extern const char *const patient_landmark_name[];

// A landmark by name: of paired ones `left_` or `right_` in front gives the side, which otherwise is that of the segment. False if there is no such landmark, or
// if its side is open.
bool patient_landmark_at(const char *name, int segment, Vec3 *at);

#endif
