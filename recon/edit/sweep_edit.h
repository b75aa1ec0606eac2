// Applies edits (edit_list.h) to a swept model.
//
// Section. The contour's terms are the Fourier terms of least squares at its points (see contour_terms.h). If a station (a break) is within a quarter of the
// spacing there, it is replaced; otherwise a break is inserted first, which changes no section. Then the rows around t change by the smallest amount (sum of
// squares) that gives the section at t and keeps those at the next two stations on both sides: at most five rows, so nothing changes beyond four stations.
// A contour that polar terms cannot hold becomes a station of a stretch with raster sections, which reaches to the stations beside it; the rows there get the
// terms of its outermost points.
// Deleting removes a break; the rows there are settled in the same way, so that the two stations on both sides keep their sections.
// Smoothing by s of a row: c_k (1 - s) for k >= 1, and c_0 such that the area pi (c_0^2 + sum |c_k|^2 / 2) stays. Towards an ellipse: (1 - s) c + s e, with e the
// terms of the ellipse that has the same centre, directions and ratio of second moments, and area; c_0 again keeps the area. A branch or the tree: every row;
// a range: the rows whose place (the mean of their three knots) is within it; one section: the section at t, as above.
// A new branch springs from the parent's curve at t and passes through the points; its sections are circles, the radius linear between the points.
// Cut: the branch ends at t; its children beyond and their descendants are removed. At t = 0 it is removed itself.
#ifndef SELDINGER_RECON_EDIT_SWEEP_EDIT_H
#define SELDINGER_RECON_EDIT_SWEEP_EDIT_H

#include "recon/edit/edit_list.h"

// What an edit changed: of one branch the part from … to, or everything. The wall can differ only within the box.
typedef struct EditChange {
    int branch;              // -1: all branches
    double from, to;         // [mm] on the branch
    Vec3 low, high;          // [mm] before and after, blends included
    double misfit;           // [mm] of a contour: its largest distance to the section, along rays from the curve
} EditChange;

// Returns a new model that borrows the sacs of `model`, or NULL with a fault. `field` is that of the model. `name`: of the file of edits, for messages. Fills all
// of `change` except the box.
SweepModel *sweep_edit_apply(const SweepModel *model, const SweepField *field, const SweepEdit *edit, const char *name, EditChange *change, Faults *faults);

// A model under edit: the edits applied, and those undone. Not thread-safe.
typedef struct SweepEditor SweepEditor;
// `model` is borrowed and lives longer; it may have edits already, which can't be undone. NULL if out of memory.
SweepEditor *sweep_editor_create(const SweepModel *model);
void sweep_editor_free(SweepEditor *editor);
// Applies an edit and remembers it; those that were undone are forgotten. False with a fault: nothing changed. `change` may be NULL.
bool sweep_editor_do(SweepEditor *editor, const SweepEdit *edit, const char *name, EditChange *change, Faults *faults);
// Applies an edit for a look: sweep_editor_model is then the result until the next call. `edit` NULL: ends the look.
bool sweep_editor_try(SweepEditor *editor, const SweepEdit *edit, EditChange *change, Faults *faults);
// Applies all edits of a list, past those with faults. True if there was none.
bool sweep_editor_replay(SweepEditor *editor, const EditList *list, const char *name, Faults *faults);
// False if there is nothing to undo (redo), or if out of memory.
bool sweep_editor_undo(SweepEditor *editor, EditChange *change);
bool sweep_editor_redo(SweepEditor *editor, EditChange *change);
const SweepModel *sweep_editor_model(const SweepEditor *editor);
const SweepField *sweep_editor_field(const SweepEditor *editor);
const EditList *sweep_editor_list(const SweepEditor *editor);   // the edits applied here, without those of the model as it was given
// Sets the model's text of edits for saving: the earlier ones and those applied here. NULL if out of memory.
const SweepModel *sweep_editor_result(SweepEditor *editor);

// Where a point of the wall is: the branch and t that it belongs to. False: on a sac, whose blobs cannot be edited.
bool sweep_edit_place(const SweepField *field, Vec3 x, int *branch, double *t);
// The section at t as a closed contour of `count` points (n, b, 0), at equal angles from the direction n.
void sweep_edit_contour(const SweepModel *model, int branch, double t, int count, Vec3 *point);
// The terms of the section at 0 <= t <= length.
void sweep_edit_terms(const SweepModel *model, int branch, double t, double term[SWEEP_TERMS]);
// Nearest station to t, and how far an edit at t may be from it to replace it instead of inserting another [mm].
double sweep_edit_station(const SweepModel *model, int branch, double t, double *within);

#endif
