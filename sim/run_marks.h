// What happened in a recording and when, for a timeline: errors, bookmarks, injections and the moment at which the target was held, in order of time; and the spans
// in which the X-ray pedal was down. Times are simulated seconds.
#ifndef SELDINGER_SIM_RUN_MARKS_H
#define SELDINGER_SIM_RUN_MARKS_H

#include "sim/words.h"
#include "sim/recording.h"
#include "sim/score.h"

#include <stddef.h>

typedef enum { RUN_MARK_ERROR, RUN_MARK_BOOKMARK, RUN_MARK_INJECTION, RUN_MARK_TARGET } RunMarkKind;

typedef struct RunMark {
    RunMarkKind kind;
    double time_s;               // when it began
    ScoreError error;            // of errors: their kind …
    int tool;                    // … and the tool, -1: no single one
    int number;                  // of bookmarks and injections: 1, 2, …
    double seconds, requested_ml;    // of injections
} RunMark;

typedef struct RunSpan {
    double from_s, to_s;
} RunSpan;

typedef struct RunMarks {
    int count;
    RunMark *mark;               // (count) by time
    int xray_count;
    RunSpan *xray;               // (xray_count) the pedal was down
    const RecordedRun *run;      // borrowed
} RunMarks;

// `event`: (event_count) the errors of its score; `reached_s`: when the target had been held, 0: never. Returns false if out of memory; run_marks_free then too.
bool run_marks_make(RunMarks *marks, const RecordedRun *run, const ScoreEvent *event, int event_count, double reached_s);
void run_marks_free(RunMarks *marks);
// The first mark after a time, the last before it, the one at it; -1: none. Times less than half a millisecond apart are the same.
int run_marks_after(const RunMarks *marks, double time_s);
int run_marks_before(const RunMarks *marks, double time_s);
int run_marks_at(const RunMarks *marks, double time_s);
// "12.30 s: tip force above the limit (wire)"; `words` translates.
void run_mark_text(const RunMarks *marks, int mark, Words words, char *text, size_t capacity);
// When the clock of the score begins: with the first step in which a tool is moved, the pedal is down or contrast agent is injected; the end if there is none.
double run_first_action_s(const RecordedRun *run);

#endif
