// The table of a finished sweep, RESULTS/table.csv and RESULTS/table.h5: docs/sweeps.md describes both. A row for each run, by run, made from the journal and
// the specification alone, so that the same runs give the same bytes in whatever order they finished.
#ifndef SELDINGER_STUDY_TABLE_H
#define SELDINGER_STUDY_TABLE_H

#include "study/journal.h"
#include "study/spec.h"

// Every run has a result in the journal. Both files appear whole or not at all. False with faults.
bool table_write(const char *folder, const Study *study, Journal *journal, int64_t runs, Faults *faults);

#endif
