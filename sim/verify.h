// The `verify:` key of a scene: quantities that a run must reproduce against an independent reference, at several numbers of elements. `seldinger
// check` runs it and prints the table (cli/check_verify.c). The format, quantity by quantity: scenes/verify/README.md.
//
// A case is one quantity (what is measured at a moment) and how it is taken over time (at the end, its mean, its frequency, …). Numbers
// here are in the file's units: mm, s, N, N mm, mJ, deg; they are compared with references as they are printed.
#ifndef SELDINGER_SIM_VERIFY_H
#define SELDINGER_SIM_VERIFY_H

#include "base/base.h"
#include "geom/geom.h"
#include "input/input.h"

enum { VERIFY_MOST_ELEMENTS = 8, VERIFY_MOST_CASES = 100, VERIFY_NAME = 64 };

typedef enum {               // names in the file: verify_quantity_name
    VERIFY_POSITION,
    VERIFY_TANGENT,
    VERIFY_TWIST,
    VERIFY_PUSH_FORCE,
    VERIFY_PUSH_TORQUE,
    VERIFY_ELASTIC_ENERGY,
    VERIFY_KINETIC_ENERGY,
    VERIFY_WALL_FORCE,
    VERIFY_WALL_MOMENT,
    VERIFY_WALL_CENTRE,
    VERIFY_CONTACTS,
    VERIFY_PENETRATION,
    VERIFY_SPEED
} VerifyQuantity;
extern const char *const verify_quantity_name[];     // NULL-terminated

typedef enum { TAKE_LAST, TAKE_CHANGE, TAKE_MEAN, TAKE_LEAST, TAKE_MOST, TAKE_JUMP, TAKE_FREQUENCY, TAKE_DECAY } VerifyTake;
extern const char *const verify_take_name[];

typedef struct VerifyCase {
    char name[VERIFY_NAME];
    VerifyQuantity quantity;
    VerifyTake take;
    int tool;                // tool; the first unless named
    double s_mm;             // where along the tool; the end of a range for quantities of a range …
    double from_s_mm;        // … which begins here
    bool has_axis;
    Vec3 axis;               // unit
    Vec3 origin;             // [mm]
    double t_s, from_t_s;    // the moment, or the end and the begin of the time it is taken over; t_s HUGE_VAL: the end of the run
    double level;            // level of oscillation
    double scale;            // the result is the measured value divided by it
    double reference;
    int tolerance_count;     // 1, or one for each number of elements
    double tolerance[VERIFY_MOST_ELEMENTS];      // of the result, absolute
    double order;            // least order of convergence; 0: not judged
    double floor;            // of the result: errors below it do not fall any further
} VerifyCase;

typedef struct VerifyPlan {  // case_count 0: the scene has none
    int element_count;       // 0: the tools' own
    int element[VERIFY_MOST_ELEMENTS];           // rising; of the first tool, of the others in proportion
    double duration_s;       // < 0: the script's
    double rest_s;           // afterwards at most this long until nothing is faster than …
    double rest_speed_mm_s;
    int case_count;
    VerifyCase *cases;
} VerifyPlan;

// What is known of the scene's tools; lengths [mm] are 0 if unknown.
typedef struct VerifyTools {
    ToolNames names;
    double length[TOOLS_MOST];
} VerifyTools;
// Reads the value of `verify:`; `has_script`: the scene has one. The caller frees plan->cases.
void verify_read(YamlValue value, const VerifyTools *tools, bool has_script, VerifyPlan *plan);

// --- measuring: one for each run ---

struct Simulator;
typedef struct VerifyMeasure VerifyMeasure;
VerifyMeasure *verify_measure_create(const VerifyPlan *plan, struct Simulator *simulator);   // NULL if out of memory
void verify_measure_free(VerifyMeasure *measure);
// Before the first step, after each, and once more with `is_end` after the last.
void verify_measure_step(VerifyMeasure *measure, bool is_end);
// The result of a case, divided by its scale; NAN if its moment was not reached or nothing oscillated.
double verify_measure_result(const VerifyMeasure *measure, int index);

#endif
