// What a user should look at before steering in a model: sacs, narrow places, places where no tool goes on, what the tree does not hold, and doubts of the tracking, each with its reason.
#ifndef SELDINGER_SIM_CASE_MARKS_H
#define SELDINGER_SIM_CASE_MARKS_H

#include "sim/case_make.h"
#include "sim/case_missed.h"

typedef enum { MARK_SAC, MARK_NARROW_PLACE, MARK_NO_ENTRY, MARK_MISSED, MARK_DOUBT, MARK_KINDS } CaseMarkKind;

typedef struct CaseMark {
    CaseMarkKind kind;
    bool has_place;
    Vec3 place;              // [mm]
    char text[200];
} CaseMark;

enum { CASE_MARKS = 64 };
// Writes at most CASE_MARKS marks: of each kind the most important ones first. `tool_radius` [mm]; `words` translates, NULL: English. Returns their number; -1: out of memory.
int case_marks_find(const CaseWork *work, const ModelField *wall, const Missed *missed, double tool_radius, Words words, CaseMark *mark);

#endif
