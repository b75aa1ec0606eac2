// Makes a case in a thread of its own, while a window shows how it grows: loads the volume, tracks, fits, looks for marks and makes the wall's triangles. A new
// request stops the one that is running. All functions are called from one thread, the owner's, and none waits for the work, except case_builder_wait().
#ifndef SELDINGER_SIM_CASE_BUILDER_H
#define SELDINGER_SIM_CASE_BUILDER_H

#include "sim/case_marks.h"

typedef enum {
    BUILD_LOADING,           // the volume
    BUILD_IDLE,              // the volume is there, and nothing is wanted
    BUILD_TRACKING,
    BUILD_FITTING,
    BUILD_LOOKING,           // the case can be saved; marks and triangles are still being made
    BUILD_DONE,
    BUILD_FAILED             // with a message; another request may succeed, unless the volume is missing
} BuildStage;

typedef struct BuildProgress {
    BuildStage stage;
    double part;             // 0 to 1, of loading and fitting
    int seen;                // grows with each new picture of the tree
    double load_s, track_s, fit_s, look_s;   // [s] wall time of what is finished, of the last request
    double held;             // at BUILD_DONE: see Missed
    char message[600];       // of BUILD_FAILED
} BuildProgress;

typedef struct CaseBuilder CaseBuilder;

// Begins to load `options->input`. `options`: all but the trace; copied, the texts in it are borrowed. NULL if out of memory or without a thread.
CaseBuilder *case_builder_create(const CaseOptions *options);
// Stops what is running. A thread that cannot be stopped soon is left behind and frees everything when it ends.
void case_builder_free(CaseBuilder *builder);
BuildProgress case_builder_progress(CaseBuilder *builder);
const Volume *case_builder_volume(const CaseBuilder *builder);      // NULL until it is loaded
// Of a CT what is not bone (ct_soft_tissue()); NULL: no CT, or not loaded yet.
const Volume *case_builder_soft(const CaseBuilder *builder);
// A small copy for projections, of a CT without bone, and the brightness range to show. NULL until the volume is loaded.
const Volume *case_builder_reduced(const CaseBuilder *builder, float *low, float *high);
// Makes the case of this trace (copied); NULL: of none.
void case_builder_request(CaseBuilder *builder, const char *trace);
// Only the kind of the model and its edits change: the tree stays, if it is there; else as a request.
void case_builder_refit(CaseBuilder *builder, const char *trace);
// Only the edits of the model change, if it is there; else as a request.
void case_builder_edit(CaseBuilder *builder, const char *trace);
// Only the scene changes: the next save takes this trace. The tree and the wall stay.
void case_builder_retitle(CaseBuilder *builder, const char *trace);
// Copies the nodes seen so far into *node, which grows (and is freed by the caller). Returns their number.
int case_builder_seen(CaseBuilder *builder, RbtSeen **node);
// From BUILD_LOOKING on: the work, and its wall. From BUILD_DONE on: marks and triangles (NULL: none). All stay until the next request.
const CaseWork *case_builder_work(const CaseBuilder *builder);
const ModelField *case_builder_wall(const CaseBuilder *builder);
int case_builder_marks(const CaseBuilder *builder, const CaseMark **mark);
const TriangleMesh *case_builder_mesh(const CaseBuilder *builder);
// From BUILD_LOOKING on: writes the case of the last request. Returns false with faults.
bool case_builder_save(CaseBuilder *builder, const char *folder, Faults *faults);
// Waits until nothing is left to do, at most so long [s]. For tests and measurements.
void case_builder_wait(CaseBuilder *builder, double longest_s);

#endif
