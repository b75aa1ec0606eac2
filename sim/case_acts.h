// What a user did to make a case, in order; and the trace that says the same (recon/track/trace.h), from which the case comes out again without a window.
#ifndef SELDINGER_SIM_CASE_ACTS_H
#define SELDINGER_SIM_CASE_ACTS_H

#include "recon/recon.h"
#include "sim/words.h"

#include <stdbool.h>

typedef enum {
    CASE_START,              // a vessel was clicked: all acts before it count no longer
    CASE_BRANCH,             // a further vessel
    CASE_FORBID,             // nothing is tracked in this ball
    CASE_CUT,                // the branch here is cut, with what hangs on it
    CASE_END,                // the tree ends here
    CASE_SAC,                // an aneurysm, from a point within
    CASE_ENTRY,              // tools enter at the end of a vessel near this point
    CASE_TARGET,             // where the tip has to go
    CASE_DEVICE,             // the wire
    CASE_CATHETER,           // a catheter around it
    CASE_ANATOMY,            // which vessel of the body it is
    CASE_BEHIND,             // the volume lies behind the vessels in fluoroscopy, or no longer
    CASE_MODEL,              // the kind of the wall's model
    CASE_BONE,               // bone of a CT is left out (as it is without this act), or tracked as anything else
    CASE_EDIT,               // an edit of a swept model: those after the last act that changes the tree count
    CASE_ACTS
} CaseActKind;

typedef struct CaseAct {
    CaseActKind kind;
    Vec3 place;              // [mm]
    double radius;           // [mm] of CASE_FORBID
    bool is_on;              // of CASE_BEHIND and CASE_BONE
    // of CASE_DEVICE and CASE_CATHETER: a file of the device library; "": a wire that suits the vessels, no catheter. Of CASE_ANATOMY: a segment
    // (sim/patient_landmarks.h); "": not said. Of CASE_MODEL: one of model_names; "": the first
    char name[80];
    SweepEdit edit;          // of CASE_EDIT; the acts own their copy
} CaseAct;

typedef struct CaseActs {
    int count, capacity;
    int undone;              // acts after `count` that can be done again
    CaseAct *act;
    const char *model;       // the kind of the wall's model without a CASE_MODEL, one of model_names; NULL: the first
} CaseActs;

void case_acts_free(CaseActs *acts);
// Forgets the acts that were undone. Returns false if out of memory.
bool case_acts_add(CaseActs *acts, const CaseAct *act);
bool case_acts_undo(CaseActs *acts);     // false: nothing to undo
bool case_acts_redo(CaseActs *acts);
// The last act of the kind that counts; NULL if there is none.
const CaseAct *case_acts_last(const CaseActs *acts, CaseActKind kind);
// The edits that count are the acts of this kind from here on.
int case_acts_first_edit(const CaseActs *acts);
int case_acts_edits(const CaseActs *acts);   // their number
const char *case_acts_model(const CaseActs *acts);       // one of model_names; "": the first
// Whether an act changes the tree or its model, so that they have to be made again.
bool case_act_changes_tree(CaseActKind kind);
// One line for people, in their language: `words` translates; NULL: English.
void case_act_describe(const CaseAct *act, Words words, char *out, size_t capacity);
// The trace as YAML; the caller frees it. NULL if no start is given, or out of memory.
char *case_acts_trace(const CaseActs *acts);

#endif
