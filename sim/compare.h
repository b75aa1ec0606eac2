// Golden tool paths: positions of some of the tool's nodes every 50 ms of simulated time, as a CSV file next to the scene (X.yaml: X.golden.csv), and
// the comparison of a run with it, point by point over time.
//
//   # seldinger golden tool path
//   # nodes: 201
//   # duration_s: 5
//   t_s,node,x_mm,y_mm,z_mm
//   0.05,0,-12.0000000,0.0000000,0.0000000
//
// Of several tools each has its own nodes, 0 the outermost; tools and nodes, those at the start, are counted in comments "# tools: 2", "# nodes of
// tool 0: 31", … After an exchange the rows are those of the device that is inserted:
//
//   t_s,tool,node,x_mm,y_mm,z_mm
//   0.05,1,60,0.5000000,0.0000000,0.0000000
//
// Positions have seven decimals: the rounding, 1e-7 mm, is far below the tolerance.
#ifndef SELDINGER_SIM_COMPARE_H
#define SELDINGER_SIM_COMPARE_H

#include "sim/simulator.h"

typedef struct PathRow {
    double t_s;
    int tool, node;
    Vec3 position;
} PathRow;

typedef struct ToolPath {
    int tool_count;
    int node_count[STEP_TOOLS_MAX];  // node count of each tool at the start
    double duration_s;       // requested duration of the run
    int row_count, row_capacity;
    PathRow *row;            // by time, then by tool, then by node
    ToolNode *node;          // scratch for sampling
} ToolPath;

// Default. Measured on wires pushed, turned and pulled back through bent tubes for 0.4 and 3.5 s: a change of parameters in the last bits (1e-13 to 1e-10, as
// from another mathematics library) moves the path by at most 1e-7 mm; one per cent of friction moves it by 0.00004 and 0.0008 mm, of stiffness by 0.003 and
// 0.009 mm, of the lumen's radius by 0.027 and 0.016 mm.
#define COMPARE_TOLERANCE_MM 1e-5

ToolPath *tool_path_parse(const char *text, size_t length, const char *file, Faults *faults);
// The text of the file; the caller frees it. NULL if out of memory.
char *tool_path_print(const ToolPath *path, size_t *length);
void tool_path_free(ToolPath *path);
// The number in a comment line "# NAME: NUMBER" of a golden file; `missing` if no line has this form.
double golden_comment(const char *text, size_t length, const char *name, double missing);
// `X.golden.csv` of `X.yaml` (or .yml); the caller frees it.
char *golden_path_of(const char *scene_path);

// Collects a path from a run: create, call after each step, and once more with `last` at the end. False if out of memory.
ToolPath *tool_path_create(Simulator *simulator, double duration_s);
bool tool_path_sample(ToolPath *path, Simulator *simulator, bool last);

typedef struct PathDifference {
    double worst_mm;         // the largest distance between golden and run
    bool differs;            // beyond the tolerance, other node counts, or missing rows
    double first_t_s;        // the first time, tool, node and distance beyond the tolerance
    int first_tool, first_node;
    double first_mm;
    char remark[160];        // other differences; "" if none
} PathDifference;

PathDifference tool_path_compare(const ToolPath *golden, const ToolPath *run, double tolerance_mm);

#endif
