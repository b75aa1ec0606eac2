// The trace file of `segment` (YAML): where branches start, where aneurysms are, where the tree ends, corrections, and parameters of the tracking by name. `automatic` is
// 1 where no branch beyond the first is named and the file does not say.
// shared/CONTRACT.md "Trace". A file has at most 1 MB. Every fault of a file is reported in one pass, with line and column.
#ifndef SELDINGER_RECON_TRACK_TRACE_H
#define SELDINGER_RECON_TRACK_TRACE_H

#include "recon/track/rbt_track.h"

typedef struct Trace {
    RbtParameters parameters;
    int branch_count;
    RbtSeed *branch;
    int aneurysm_count;
    RbtAneurysm *aneurysm;
    int forbid_count, cut_count, until_count, rival_count;   // corrections and where the tree ends; the parameters point to them
    RbtRegion *forbid, *cut, *until, *rival;                 // `rival`: the key `not`
} Trace;

// `text` need not end in NUL; `path` is for messages. NULL with faults.
Trace *trace_parse(const char *text, size_t length, const char *path, Faults *faults);
Trace *trace_load(const char *path, Faults *faults);
// Adds a point [mm] to `until` or `not` (key), as the command line has them. False: out of memory.
bool trace_add_point(Trace *trace, const char *key, Vec3 point);
void trace_free(Trace *trace);

#endif
