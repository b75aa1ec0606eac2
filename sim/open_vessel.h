// Opens a scene's `vessel:`: loads a model, fits a shape (cached), builds a tube or plane, reads a mesh.
#ifndef SELDINGER_SIM_OPEN_VESSEL_H
#define SELDINGER_SIM_OPEN_VESSEL_H

#include "base/base.h"
#include "geom/geom.h"
#include "sim/contact_surface.h"

typedef struct OpenVessel {
    Vessel *vessel;          // NULL for SOURCE_NONE
    VesselTree *tree;        // LIM and swept models only
    SweepModel *sweep;       // contact 'sweep' only
    TriangleMesh *mesh;      // the wall if it consists of triangles, else filled on demand by open_vessel_mesh
} OpenVessel;

typedef struct OpenVesselOptions {
    int threads;             // of a fit; 0: all cores
    const Progress *progress;        // of a fit; may be NULL
    NoteFunction note;       // receives the defects found and repaired in a mesh, and what is lost in making one; may be NULL
} OpenVesselOptions;

// Whether the scene's contact goes with its vessel, without opening it. Returns false with faults.
bool open_vessel_suits(const Scene *scene, Faults *faults);
// Returns false with faults; call open_vessel_close in either case.
bool open_vessel(const Scene *scene, const OpenVesselOptions *options, OpenVessel *out, Faults *faults);
// The vessel's surface for pictures; NULL if it has none or memory runs out.
const TriangleMesh *open_vessel_mesh(const Scene *scene, OpenVessel *open);
// If the scene has `inlet: root`, sets start and direction of the tool from the vessel's inlet. Returns false with a fault if the vessel has none.
bool open_vessel_inlet(Scene *scene, const OpenVessel *open, Faults *faults);
// For a wall that another scene opened: its sheath's mouth must lie in a mesh, as open_vessel() demands. Returns false with a fault.
bool open_vessel_holds_entry(const Scene *scene, const OpenVessel *open, Faults *faults);
void open_vessel_close(OpenVessel *open);

#endif
