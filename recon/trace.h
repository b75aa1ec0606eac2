// The trace file of `segment` (YAML): where branches start, where aneurysms are, and parameters of the tracking by name.
// shared/CONTRACT.md "Trace". Every fault of a file is reported in one pass, with line and column.
#ifndef SELDINGER_RECON_TRACE_H
#define SELDINGER_RECON_TRACE_H

#include "recon/rbt_track.h"

typedef struct Trace {
    RbtParameters parameters;
    int branch_count;
    RbtSeed *branch;
    int aneurysm_count;
    RbtAneurysm *aneurysm;
} Trace;

// `text` need not end in NUL; `path` is for messages. NULL with faults.
Trace *trace_parse(const char *text, size_t length, const char *path, Faults *faults);
Trace *trace_load(const char *path, Faults *faults);
void trace_free(Trace *trace);

#endif
