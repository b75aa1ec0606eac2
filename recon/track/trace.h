// The trace file of `segment` (YAML): starts of branches, aneurysms, points where the tree ends, corrections, and tracking parameters by name. `automatic`
// defaults to 1 if the file gives no branch after the first. Format: docs/file-formats.md, "Trace files". At most 1 MB. All faults of a file are reported in
// one pass, with line and column.
#ifndef SELDINGER_RECON_TRACK_TRACE_H
#define SELDINGER_RECON_TRACK_TRACE_H

#include "recon/edit/edit_list.h"
#include "recon/track/rbt_track.h"

typedef struct TraceCase {   // the key `case`: what `seldinger case` makes of the tree; `segment` ignores it
    bool has_entry, has_target, is_behind;
    Vec3 entry;              // [mm] the end of a vessel where the tools enter
    Vec3 target;             // [mm] where the tip of the tool has to go
    char device[80];         // a file of the device library, without its folder; "": a wire that suits the vessels
    char catheter[80];       // the same of a catheter around it; "": none
    int model;               // of the wall, index in model_names (recon/model_file.h)
    char anatomy[80];        // the segment of the body that the vessel is (`anatomy:` of a scene); "": not said
} TraceCase;

typedef struct Trace {
    RbtParameters parameters;
    int branch_count;
    RbtSeed *branch;
    int aneurysm_count;
    RbtAneurysm *aneurysm;
    int forbid_count, cut_count, until_count, rival_count;   // `parameters` points into these arrays
    RbtRegion *forbid, *cut, *until, *rival;                 // `rival`: the key `not`
    TraceCase made;
    EditList *edits;         // the key `edits`, of a case whose model is swept (recon/edit/edit_list.h); `segment` ignores it. NULL: none
} Trace;

// Whether a text can be the name of a device file, or of a segment: letters, digits and . - _ only, so that it can be written into a scene and into a path.
bool trace_is_device_name(const char *text);
// Parses a trace file. `text` need not be NUL-terminated; `path` is used in messages. Returns NULL with faults.
Trace *trace_parse(const char *text, size_t length, const char *path, Faults *faults);
Trace *trace_load(const char *path, Faults *faults);
// Adds a point [mm] given on the command line to `until` or `not` (`key`). Returns false if out of memory.
bool trace_add_point(Trace *trace, const char *key, Vec3 point);
void trace_free(Trace *trace);

#endif
