// Edits of a swept model (geom/sweep_model.h) as lines of YAML, after Kretschmer et al. 2013, section 5: the same list replays to the same model.
//   edits:
//   - {edit: section, branch: 3, t_mm: 12.5, contour_nb_mm: [[1.1, 0], [0.9, 0.4], …]}      replaces the section there, or inserts one; or contour_mm: [[x, y, z], …]
//   - {edit: delete_section, branch: 3, t_mm: 12.5}
//   - {edit: smooth, to: circle, strength: 0.5, branch: 3, t_mm: 12.5}      or from_mm and to_mm, or the branch alone, or no branch: the tree; to: ellipse
//   - {edit: blend, branch: 3, width: 0.4}       width of the blend at its fork, in radii of the branch
//   - {edit: branch, parent: 0, t_mm: 20, points_mm: [[x, y, z], …], radii_mm: [1.1, …]}
//   - {edit: cut, branch: 3, t_mm: 30}
//   - {edit: tag, branch: 3, end: end, as: out}      end: start or end; as: in, out or flip
// Branches are numbered as they are when the edit is applied. Lengths mm.
#ifndef SELDINGER_RECON_EDIT_EDIT_LIST_H
#define SELDINGER_RECON_EDIT_EDIT_LIST_H

#include "geom/geom.h"

enum { EDIT_MOST_POINTS = 4096, EDIT_MOST_EDITS = 100000 };

typedef enum { EDIT_SECTION, EDIT_DELETE_SECTION, EDIT_SMOOTH, EDIT_BLEND, EDIT_BRANCH, EDIT_CUT, EDIT_TAG, EDIT_KINDS } EditKind;
typedef enum { SMOOTH_SECTION, SMOOTH_RANGE, SMOOTH_BRANCH, SMOOTH_TREE } SmoothExtent;
typedef enum { SMOOTH_CIRCLE, SMOOTH_ELLIPSE } SmoothShape;
typedef enum { EDIT_TAG_IN, EDIT_TAG_OUT, EDIT_TAG_FLIP } EditTag;

typedef struct SweepEdit {
    EditKind kind;
    int line, column;        // in the file; 0: made in a window
    int branch;              // the parent of a new branch; unused for the whole tree
    double t;                // [mm] on the branch
    double from, to;         // [mm] of SMOOTH_RANGE
    SmoothExtent extent;
    SmoothShape shape;
    double amount;           // strength of smoothing, 0 to 1; width of a blend, 0 to 2
    bool in_space;           // the contour's points are (x, y, z), not (n, b, 0)
    int count;               // points of a contour (>= 3) or of a new branch (>= 1)
    Vec3 *point;             // (count) [mm] owned
    double *radius;          // (count) [mm] of a new branch, owned
    int end;                 // of a tag: 0 the start, 1 the end
    EditTag tag;
} SweepEdit;

typedef struct EditList {
    int count, capacity;
    SweepEdit *edit;         // (count)
} EditList;

// Reads a file of edits. Returns NULL with all faults of the file, each with its line and what is valid.
EditList *edit_list_load(const char *path, Faults *faults);
// The same from memory; `name` is used in messages.
EditList *edit_list_parse(const char *text, size_t length, const char *name, Faults *faults);
// The same of a text that has other keys too, which its own reader checks; without the key `edits` an empty list.
EditList *edit_list_parse_within(const char *text, size_t length, const char *name, Faults *faults);
void edit_list_free(EditList *list);

// The edit as its line of YAML, without the dash: numbers have as few digits as read back to the same bits. NULL if out of memory; the caller frees it.
char *edit_line(const SweepEdit *edit);
// Appends the edit's item ("- {…}\n") to a text of edits (NULL: starts one with "edits:\n"), which is freed. NULL if out of memory.
char *edit_text_add(char *text, const SweepEdit *edit);
// A copy with its own points. False if out of memory.
bool edit_copy(const SweepEdit *edit, SweepEdit *copy);
void edit_clear(SweepEdit *edit);

#endif
