// Makes a case: a folder with everything that a session needs, which can be copied. model.h5 is the tree with its model, scene.yaml the scene (sim/case_scene.h),
// trace.yaml, for a case from a volume, what was clicked (sim/case_acts.h): the same volume and trace give the same bytes.
//
// case_make() does it all at once. In steps: case_work_track(), case_work_fit(), case_work_edit(), case_work_write(), from any one thread at a time.
#ifndef SELDINGER_SIM_CASE_MAKE_H
#define SELDINGER_SIM_CASE_MAKE_H

#include "recon/recon.h"
#include "sim/case_acts.h"
#include "sim/case_scene.h"

typedef struct CaseOptions {
    const char *input;           // a volume with `trace`, or a file of a tree, with or without a model
    const char *trace;           // YAML text of the trace (recon/track/trace.h); NULL: the input is a tree
    const char *trace_path;      // for messages
    bool has_kind;               // `kind` is given; else it is as the trace says
    int kind;                    // of the model, index in model_names (recon/model_file.h); fitted unless the tree's file has it
    bool is_behind;              // the volume lies behind the vessel in fluoroscopy
    bool has_target, has_entry;
    Vec3 target, entry;          // [mm]
    const char *device;          // a file of the device library, without its folder; NULL: as the trace says
    const char *catheter;        // the same of a catheter around the wire
    const char *anatomy;         // a segment of the body (sim/patient_landmarks.h); NULL: as the trace says
    const char *library;         // folder of device files; NULL: none
    int threads;                 // 0: all cores; the result does not depend on them
    const Progress *progress;    // may be NULL
    Words words;             // translates the texts of marks, in the builder's thread; NULL: English
} CaseOptions;

typedef struct CaseFigures {
    int nodes, branches;         // branches: ends of vessels
    double length, track_s, fit_s;   // [mm], [s] wall time
} CaseFigures;

// A case that is being made.
typedef struct CaseWork {
    Trace *trace;                // NULL: the input is a tree
    ModelFile file;              // the tree, and the models that its file had
    RbtReport report;            // of the tracking
    char frame[32];              // of the patient: "LPS", "RAS", …
    TreeFitOptions how;
    TreeFit made;                // the model, unless the file had it
    bool has_it;                 // it had
    SweepEditor *editor;         // NULL: the trace has no edits
    const SweepModel *edited;    // its result
} CaseWork;

// Whether `folder` is a case. Its scene is written last.
bool case_is_there(const char *folder);
// Creates `folder`, unless it exists and is no case yet. Returns false with faults: nothing is written, unless writing itself fails.
bool case_make(const char *folder, const CaseOptions *options, CaseFigures *figures, Faults *faults);

// Reads the trace and tracks the volume (borrowed; NULL: the input is a tree, which is loaded). Without an entry the widest end of a vessel
// becomes the root, unless the trace gives the first branch's direction; without such an end the root stays.
bool case_work_track(CaseWork *work, const CaseOptions *options, const Volume *volume, const RbtWatch *watch, Faults *faults);
// Fits the kind of model that the options or the trace say; again after case_work_choose().
bool case_work_fit(CaseWork *work, const CaseOptions *options, Faults *faults);
// Reads the choices and the edits of `options->trace` again; tree and model stay.
bool case_work_choose(CaseWork *work, const CaseOptions *options, Faults *faults);
// Applies the edits of the trace to the fitted model, which stays.
bool case_work_edit(CaseWork *work, const CaseOptions *options, Faults *faults);
// The swept model as it was fitted; NULL if the model is of another kind.
const SweepModel *case_work_sweep(const CaseWork *work);
// The wall of the model with its edits; to be freed by model_field_free(). Returns false if out of memory.
bool case_work_wall(const CaseWork *work, ModelField *wall);
// The tree after the fit, or before it.
const VesselTree *case_work_tree(const CaseWork *work);
bool case_work_write(const CaseWork *work, const char *folder, const CaseOptions *options, Faults *faults);
void case_work_measure(const CaseWork *work, CaseFigures *figures);
void case_work_free(CaseWork *work);

// The ends of vessels, where tools may enter: nodes with one neighbour. Returns the one nearest to x.
bool case_tree_is_end(const VesselTree *tree, int node);
int case_tree_end_near(const VesselTree *tree, Vec3 x);
// The widest end; one at the border of the volume counts twice as wide. -1: no vessel has an end.
int case_tree_widest_end(const VesselTree *tree, const Volume *volume);

#endif
