// The options of `segment`.
#ifndef SELDINGER_CLI_SEGMENT_OPTIONS_H
#define SELDINGER_CLI_SEGMENT_OPTIONS_H

#include "base/base.h"
#include "geom/geom.h"

enum { SEGMENT_POINTS = 64 };

typedef struct SegmentCommand {
    const char *volume, *trace, *start, *out, *json, *picture;
    Vec3 start_mm, until[SEGMENT_POINTS], rival[SEGMENT_POINTS];
    int until_count, rival_count;
    int threads;
    double seed;             // -1: that of the trace
    bool quiet;
} SegmentCommand;
extern const OptionTable segment_options;

#endif
