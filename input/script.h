// Commands over time, read from a CSV file.
#ifndef SELDINGER_INPUT_SCRIPT_H
#define SELDINGER_INPUT_SCRIPT_H

#include "base/base.h"
#include "input/command.h"

#include <stdbool.h>
#include <stddef.h>

typedef struct ToolNames {   // tools of the scene that a script is for, outermost first; NULL after the last
    int count;
    const char *name[TOOLS_MOST + 1];
    const char *kind[TOOLS_MOST];    // "wire", "microcatheter" …
} ToolNames;

typedef struct ScriptRow {
    double t_s;
    Command command;                 // of the first tool
    Command inner[TOOLS_MOST - 1];   // of the tools inside it
    unsigned released;               // as in ToolCommands
    int fitted[TOOLS_MOST];          // as in ToolCommands
    double contrast_ml_s[TOOLS_MOST];    // for each tool; at most one is not 0
} ScriptRow;

typedef struct Script {      // each row applies from its time until the next row; the time of the last row ends the script
    int count;
    ScriptRow *row;
} Script;

enum { SCRIPT_FASTEST_MM_S = 1000, SCRIPT_FASTEST_DEG_S = 36000, SCRIPT_LONGEST_S = 86400, SCRIPT_MOST_ML_S = 50 };

// Parses a script: CSV with the header t_s,push_mm_s,twist_deg_s and `#` comments. A fourth column, released, is 1 while the tool is released and 0 (default)
// while it is held. Returns NULL with faults: wrong header, not a number, times that decrease, negative first time, |push| > 1000 mm/s,
// |twist| > 36,000 deg/s, no row. `tools`: the tools of a scene, NULL for one without a name. The header above is that of the first tool; others have t_s and,
// for any of the tools and in any order, NAME.push_mm_s with NAME.twist_deg_s, NAME.released, NAME.exchange and NAME.contrast_ml_s (contrast agent through that
// tool, 0 to 50 ml/s, one tool at a time).
Script *script_parse(const char *text, size_t length, const char *file, const ToolNames *tools, Faults *faults);
// Reads the file (at most 64 MiB) and parses it.
Script *script_load(const char *path, const ToolNames *tools, Faults *faults);
// For use without a scene: the tools are those in the header, in its order, or a single unnamed one if the header has no names.
typedef struct ScriptTools {
    ToolNames names;         // pointing into `text`
    char text[TOOLS_MOST][TOOL_NAME_SIZE];
} ScriptTools;
Script *script_load_any(const char *path, ScriptTools *tools, Faults *faults);
void script_free(Script *script);
Command *script_row_command(ScriptRow *row, int tool);
// Checks one row, including rows from elsewhere (a scene's inline script). `before`: the previous row or NULL; `tools`: NULL if there is only one tool.
bool script_check_row(const ScriptRow *row, const ScriptRow *before, const ToolNames *tools, const char *file, int line, int column, Faults *faults);
// Checks that the script ends after time 0; a fault stands at the last row. `script` has a row.
bool script_check_end(const Script *script, const char *file, int line, int column, Faults *faults);
double script_duration_s(const Script *script);
// Commands at simulated time t_s: zero before the first row and after the end, except `fitted`, which keeps its value. `cursor` stores the row between calls;
// start with 0.
ToolCommands script_tools_at(const Script *script, double t_s, int *cursor);
Command script_at(const Script *script, double t_s, int *cursor);      // the first tool's

#endif
