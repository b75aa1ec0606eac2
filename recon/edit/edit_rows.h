// Rows of one branch under edit: places, insertion and removal of breaks, and the smallest change that gives sections at stations. Internal to recon.
#ifndef SELDINGER_RECON_EDIT_EDIT_ROWS_H
#define SELDINGER_RECON_EDIT_EDIT_ROWS_H

#include "geom/geom.h"

// Breaks and rows of a branch, owned.
typedef struct EditRows {
    int breaks;              // rows: breaks + 2
    double *at;
    double *row;
} EditRows;

enum { EDIT_MOST_HELD = 6 };
// Sections to hold: c(t[i]) = target[i].
typedef struct HeldSections {
    int count;
    double t[EDIT_MOST_HELD], target[EDIT_MOST_HELD][SWEEP_TERMS];
} HeldSections;

// A copy of a branch's breaks and rows with room for one more of each. False if out of memory.
bool edit_rows_take(const SweepModel *model, int branch, EditRows *rows);
void edit_rows_free(EditRows *rows);
void edit_rows_section(const EditRows *rows, double t, double term[SWEEP_TERMS]);
// Index of the break nearest to t, and a quarter of the spacing at t: how near an edit at t has to be to replace it.
int edit_rows_station(const EditRows *rows, double t, double *within);
// Inserts a break; no section changes (Boehm 1980).
void edit_rows_insert(EditRows *rows, double t);
// Removes an interior break and its middle row; the sections nearby change.
void edit_rows_remove(EditRows *rows, int at);
// The smallest change of the rows first … last (sum of squares, term by term) that holds the sections. False if they cannot be held.
bool edit_rows_hold(EditRows *rows, int first, int last, const HeldSections *held);
// Mean of the three knots inside a row's support: where the row acts.
double edit_rows_place(const EditRows *rows, int row);

#endif
