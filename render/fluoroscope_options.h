// Inputs of a Fluoroscope: vessel, tools, anatomy, patient, detector. Lengths in mm.
#ifndef SELDINGER_RENDER_FLUOROSCOPE_OPTIONS_H
#define SELDINGER_RENDER_FLUOROSCOPE_OPTIONS_H

#include "geom/geom.h"
#include "render/tool_look.h"
#include "sim/sim.h"

#include <stdbool.h>

typedef struct FluoroscopeOptions {
    // vessel; all borrowed during create only
    const TriangleMesh *vessel;    // the wall. NULL: contrast agent is not visible. Open rims are closed by flat lids, which the message reports; a surface
                                   // whose triangles are not consistently oriented is refused: the message reports it and no contrast is drawn
    const int *vertex_node;        // (V) tree node of each vertex; NULL: mesh->node if there is a `tree` and it fits, else the nearest node
    const VesselTree *tree;        // NULL: the whole lumen is one node, 0
    const ToolLooks *tools;        // borrowed; NULL: none
    const Pose *pose;              // any pose of these tools; gives their largest numbers of nodes. Borrowed during create only
    SheathLook sheath;             // default: none
    // anatomy: a volume (recon/volume/volume.h); value NULL: a patient made of solids (render/patient_body.h)
    int anatomy_size[3];
    Vec3 anatomy_origin;           // [mm] centre of voxel (0,0,0)
    Vec3 anatomy_axis[3];          // [mm] step from voxel to voxel
    const float *anatomy_value;    // (size[2], size[1], size[0]); CT numbers [HU] if the minimum is below -200, else the brightness of an angiogram
    int segment;                   // what the vessel is: 1 + index in patient_segment; 0: not known
    bool has_place;                // the vessel's place in the patient is known:
    Similarity place;              // from the body's frame to the model's
    bool has_no_anatomy;           // true: only air around vessel and tool (for tests)

    PatientAxes patient;           // default: LPS
    double contrast_attenuation;   // [1/mm] of undiluted contrast agent in blood, 0.105
    double quanta;                 // quanta detected per pixel in the open beam, 550; 0: no noise
    double dsa_gain;               // exponent of the brightness of DSA, 2.2; above 0.5
    double dsa_dose;               // quanta of a DSA pulse relative to a fluoroscopy pulse, 16
} FluoroscopeOptions;

#endif
