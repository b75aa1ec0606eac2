// The figures of a golden run beside its path: X.golden-figures.csv beside X.golden.csv, with one row at each of the path's times, and in comments the times at
// which targets were reached. A golden run without this file is compared by its path alone.
//
//   # seldinger golden figures; made by `seldinger check --update`
//   # target 1 reached_s: 5.433
//   t_s,inserted_mm,push_n,torque_n_mm,contacts,wall_force_n,penetration_mm
//
// Push and torque are those of the first tool's hand.
#ifndef SELDINGER_SIM_GOLDEN_FIGURES_H
#define SELDINGER_SIM_GOLDEN_FIGURES_H

#include "sim/simulator.h"
#include "sim/tolerances.h"

// The quantities of a row are TOLERANCE_INSERTED to TOLERANCE_PENETRATION.
enum { FIGURE_FIRST = TOLERANCE_INSERTED, FIGURE_COUNT = TOLERANCE_PENETRATION - TOLERANCE_INSERTED + 1 };

typedef struct FigureRow {
    double t_s, value[FIGURE_COUNT];
} FigureRow;

typedef struct GoldenFigures {
    int row_count, row_capacity;
    FigureRow *row;          // (row_count) by time
    int target_count;
    double *reached_s;       // (target_count) -1: not reached
    double end_s;            // of the run; not in the file
} GoldenFigures;

void golden_figures_sample(GoldenFigures *figures, Simulator *simulator);
// At the end of the run: the targets.
void golden_figures_end(GoldenFigures *figures, const Simulator *simulator);
void golden_figures_free(GoldenFigures *figures);        // what it points to

// False with faults.
bool golden_figures_parse(const char *text, size_t length, const char *file, GoldenFigures *out, Faults *faults);
bool golden_figures_load(const char *path, GoldenFigures *out, Faults *faults);
bool golden_figures_save(const char *path, const GoldenFigures *figures, Faults *faults);
// X.golden-figures.csv of X.golden.csv; the caller frees it.
char *golden_figures_path(const char *golden_path);

typedef struct FigureDifference {
    bool is_compared;        // both runs have the quantity
    double worst, tolerance;
    double first_t_s, first; // first time above the tolerance and the difference there; time < 0: never
} FigureDifference;

// Fills the differences of all quantities but TOLERANCE_POSITION. Returns whether any is above its tolerance, or rows or targets are missing; `remark`: what is
// missing, else "".
bool golden_figures_compare(const GoldenFigures *golden, const GoldenFigures *run, const Tolerances *tolerances, FigureDifference difference[TOLERANCE_COUNT],
                            char *remark, size_t capacity);

#endif
