// The table of `bench step --tools`: steps with one to four coaxial tools in three vessels, with 50 to 400 nodes.
#ifndef SELDINGER_BENCH_TOOLS_H
#define SELDINGER_BENCH_TOOLS_H

#include "bench/bench.h"

enum { TOOLS_VESSELS = 3, TOOLS_NODES = 4 };

typedef struct ToolsRow {
    int tools, chain_nodes;              // at the end
    StepFigures run;
    double push_most;                    // [N] of any hand
} ToolsRow;

typedef struct ToolsBench {
    bool present[TOOLS_VESSELS];
    ToolsRow row[TOOLS_VESSELS][TOOLS_NODES][TOOLS_MOST];
} ToolsBench;

bool bench_tools(const BenchOptions *options, ToolsBench *bench, Faults *faults);
void bench_tools_print(FILE *out, const ToolsBench *bench);
void bench_tools_json(cJSON *list, const ToolsBench *bench);

#endif
