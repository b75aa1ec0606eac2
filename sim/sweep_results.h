// The results of a sweep, for its report: the table RESULTS/table.csv (docs/sweeps.md). Columns in this order: run, the varied keys, perhaps hand_seed, status,
// message, then figures.
#ifndef SELDINGER_SIM_SWEEP_RESULTS_H
#define SELDINGER_SIM_SWEEP_RESULTS_H

#include "base/base.h"

typedef struct SweepColumn {
    const char *name;
    bool is_number;          // every cell that is not empty is a finite number
    double *value;           // (row_count) NAN: empty. Of text: its number in the order of the alphabet
    const char **text;       // (row_count) as in the file
    double least, most;      // of runs that are done; NAN: none
    bool varies;             // among runs that are done
} SweepColumn;

typedef struct SweepResults {
    char *path;              // of the table
    int column_count, row_count;
    SweepColumn *column;     // (column_count)
    int run, status, message;        // their columns
    int key_first, key_count;        // the varied keys
    int figure_first;        // figures from here on; those that are not numbers are not shown
    bool *is_done;           // (row_count) the status is `done`
    char *bytes;             // holds the texts
} SweepResults;

enum { SWEEP_COLUMNS_MOST = 4096 };

// CSV as in RFC 4180, UTF-8. NULL with faults (file and line): no such columns, a row of another length, a run that is not the row's number, an unknown status.
SweepResults *sweep_results_parse(const char *text, size_t length, const char *path, Faults *faults);
// Of a folder RESULTS.
SweepResults *sweep_results_load(const char *folder, Faults *faults);
void sweep_results_free(SweepResults *results);
int sweep_results_find(const SweepResults *results, const char *name);   // -1: no such column
int sweep_results_count(const SweepResults *results, const char *status);
bool sweep_results_is_figure(const SweepResults *results, int column);   // a figure with numbers

typedef enum { RUN_DONE, RUN_DIVERGED, RUN_LEFT, RUN_FAILED, RUN_STATUS_COUNT } RunStatus;
extern const char *const run_status_name[RUN_STATUS_COUNT + 1];      // NULL at the end

#endif
