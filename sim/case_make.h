// Makes a case: a folder with everything that a session needs, which can be copied. model.h5 is the tree with its model, scene.yaml the scene (sim/case_scene.h),
// trace.yaml, for a case from a volume, what was clicked: the same volume and trace give the same bytes.
#ifndef SELDINGER_SIM_CASE_MAKE_H
#define SELDINGER_SIM_CASE_MAKE_H

#include "sim/case_scene.h"

typedef struct CaseOptions {
    const char *input;           // a volume with `trace`, or a file of a tree, with or without a model
    const char *trace;           // YAML text of the trace (recon/track/trace.h); NULL: the input is a tree
    const char *trace_path;      // for messages
    int kind;                    // of the model, index in model_names (recon/model_file.h); fitted unless the tree's file has it
    bool is_behind;              // the volume lies behind the vessel in fluoroscopy
    bool has_target;
    Vec3 target;                 // [mm]
    int threads;                 // 0: all cores; the result does not depend on them
    const Progress *progress;    // may be NULL
} CaseOptions;

typedef struct CaseFigures {
    int nodes, branches;         // branches: ends of vessels
    double length, track_s, fit_s;   // [mm], [s] wall time
} CaseFigures;

// Whether `folder` is a case. Its scene is written last.
bool case_is_there(const char *folder);
// Creates `folder`, unless it exists and is no case yet. Returns false with faults; files that were written before remain.
bool case_make(const char *folder, const CaseOptions *options, CaseFigures *figures, Faults *faults);

#endif
