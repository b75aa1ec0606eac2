// Opens what a scene's `vessel:` names: loads a model, fits a shape (cached), builds a tube or plane, reads a mesh.
#ifndef SELDINGER_SIM_OPEN_VESSEL_H
#define SELDINGER_SIM_OPEN_VESSEL_H

#include "base/parallel.h"
#include "geom/isosurface.h"
#include "sim/contact_surface.h"

typedef struct OpenVessel {
    Vessel *vessel;          // NULL for SOURCE_NONE
    VesselTree *tree;        // LIM only
    TriangleMesh *mesh;      // the wall where that is triangles, else filled on demand by open_vessel_mesh
} OpenVessel;

typedef struct OpenVesselOptions {
    int threads;             // of a fit; 0: all cores
    const Progress *progress;        // of a fit; NULL: nobody asks
    NoteFunction note;       // told what was found wrong with a mesh and mended, and what is lost where one is made; NULL: nobody asks
} OpenVesselOptions;

// False with faults; open_vessel_close frees what is open then too.
bool open_vessel(const Scene *scene, const OpenVesselOptions *options, OpenVessel *out, Faults *faults);
// The vessel's surface for pictures; NULL where it has none or memory lacks.
const TriangleMesh *open_vessel_mesh(const Scene *scene, OpenVessel *open);
// Where the scene says `inlet: root`: start and direction of the tool from the vessel's inlet. False with a fault where it has none.
bool open_vessel_inlet(Scene *scene, const OpenVessel *open, Faults *faults);
void open_vessel_close(OpenVessel *open);

#endif
