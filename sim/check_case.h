// The cases of `seldinger check`: one for each golden run and one for each row of a verification table. Lists of them become JSON, JUnit XML
// (render/check_junit.h) and a page (render/check_page.h).
#ifndef SELDINGER_SIM_CHECK_CASE_H
#define SELDINGER_SIM_CHECK_CASE_H

#include "sim/golden.h"

#include <cJSON.h>

typedef enum { CHECK_PASSED, CHECK_FAILED, CHECK_ERROR, CHECK_SKIPPED, CHECK_STATUS_COUNT } CheckStatus;
extern const char *const check_status_name[CHECK_STATUS_COUNT];    // passed; failed: beyond a tolerance; error: not compared; skipped: a file is missing

// The vessel's silhouette as thick lines; with both ends equal, a dot.
typedef struct CheckWall {
    int count;
    Vec3 *from, *to;         // (count)
    double *radius;          // (count) [mm]
} CheckWall;

typedef struct GoldenComparison {
    PathDifference path;
    FigureDifference quantity[TOLERANCE_COUNT];
    char remark[160];        // of the figures
    // Both runs, for the page; NULL unless they differ and a page is wanted.
    ToolPath *golden, *run;
    GoldenFigures figures;   // of the run
    CheckWall wall;
} GoldenComparison;

typedef struct CheckCase {
    const char *scene;       // its path
    const char *name;        // "golden run", or the verification case with its number of elements
    CheckStatus status;
    const char *message;     // what is wrong, one line; "" if it passed
    double time_s;           // wall-clock time that the run took
    int code;                // exit code
    GoldenComparison *comparison;    // NULL: none was made
} CheckCase;

typedef struct CheckLog {    // its texts are its own
    int count, capacity;
    CheckCase *at;           // (count) in the order of the scenes
} CheckLog;

// Adds a case; copies the texts (what is not UTF-8 is kept) and takes over the comparison. Returns its code.
int check_log_add(CheckLog *log, const CheckCase *one);
void check_log_free(CheckLog *log);
int check_log_count(const CheckLog *log, const char *scene, CheckStatus status);       // scene NULL: of all scenes
void golden_comparison_free(GoldenComparison *comparison);

// The cases, with differences and tolerances by quantity; the caller deletes it. NULL if out of memory.
cJSON *check_log_json(const CheckLog *log);

// Copies what a figure needs of an open vessel.
void check_wall_copy(CheckWall *wall, const Scene *scene, OpenVessel *open);
void check_wall_free(CheckWall *wall);

#endif
