// A plain X-ray picture of vessel and tools for programs that look at a run, such as agents: transmission exp(-a) without anatomy, noise or display curve,
// computed on the CPU in less than a millisecond. The trainer's picture is render/fluoroscope.h.
//
// Tools: each piece of a tool adds the attenuation of its material, volume times attenuation over the area of a pixel at its depth, to the pixels around
// its projection: the sum over the picture is exact at any resolution, and the picture moves with the tool without steps. Vessels: at each pixel the longest
// chord among the spheres of the tree, between nodes too, filled with contrast agent.
#ifndef SELDINGER_SIM_XRAY_IMAGE_H
#define SELDINGER_SIM_XRAY_IMAGE_H

#include "sim/c_arm.h"
#include "sim/simulator.h"

typedef struct XrayView {
    XrayControl xray;        // angles, field and table (the isocentre) are used
    int pixels;              // side of the picture
} XrayView;

// The patient's axes of a scene: its own, or those of LPS.
PatientAxes xray_patient_axes(const Scene *scene);
// A view in which the whole tree lies, its isocentre in the middle of the tree; the sheath's mouth where there is none. `xray` gives the angles.
XrayControl xray_view_all(const VesselTree *tree, const Scene *scene, const XrayControl *xray);
// Attenuation, (pixels, pixels), the top row first. Vessels filled with undiluted contrast agent: replaces what is there.
void xray_image_vessels(const VesselTree *tree, const Scene *scene, const XrayView *view, float *attenuation);
// Adds tool `tool`. `node`: (count) of the tool; those in the sheath are left out.
void xray_image_tool(const Scene *scene, int tool, int which, const ToolNode *node, int count, const XrayView *view, float *attenuation);

#endif
