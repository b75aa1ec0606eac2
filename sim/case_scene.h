// The scene of a case: a model with a wire that suits its vessels, and a target. `seldinger case` writes it; it is a text to be read and changed by hand.
#ifndef SELDINGER_SIM_CASE_SCENE_H
#define SELDINGER_SIM_CASE_SCENE_H

#include "geom/geom.h"
#include "sim/scene.h"

typedef struct CaseScene {
    const char *model;           // file of the model, relative to the scene's folder
    ContactKind contact;
    const char *frame;           // of the patient: "LPS", "RAS", …; "": not known
    const char *behind;          // volume whose bone and soft tissue lie behind the vessel in fluoroscopy; NULL: a plain head
    const char *device;          // of the wire, relative to the scene's folder; NULL: one that suits the vessels
    const char *catheter;        // of a catheter around it; NULL: none
    bool is_micro;               // the catheter is a microcatheter, which takes a wire of 0.014 inch
    const char *anatomy;         // segment of the body (sim/patient_landmarks.h); NULL: not said
    bool has_target;
    Vec3 target;                 // [mm]
} CaseScene;

// Returns the YAML text of the scene; the caller frees it. The wire has 0.014 inch, or 0.035 where the vessels are wide; it is long enough for every branch. A target is
// part of an exercise with time and path in proportion to the distance along the vessels. Returns NULL with a fault if the target lies in no vessel or if out of
// memory.
char *case_scene_text(const VesselTree *tree, const CaseScene *options, Faults *faults);

#endif
