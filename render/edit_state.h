// What the editor's window works on: the editor, the place on a branch that is looked at, its contour, and the mesh that follows. Without OpenGL. Lengths mm.
#ifndef SELDINGER_RENDER_EDIT_STATE_H
#define SELDINGER_RENDER_EDIT_STATE_H

#include "recon/recon.h"
#include "render/edit_mesh.h"

enum { EDIT_CONTOUR = 32, EDIT_HANDLES = 16, EDIT_STROKE = 2000, EDIT_DRAWN = 64 };

typedef struct EditState {
    SweepEditor *editor;
    EditMesh *mesh;
    Vec3 looked_low, looked_high;    // box of the edit that is looked at [mm]
    bool mesh_is_new;        // to be drawn anew
    int branch;              // the place looked at …
    double t;                // … [mm]
    Vec3 wall;               // the point of the wall that was clicked, or that lies at the place
    bool snaps;              // moving along t stops at stations
    SweepContour outline;    // the section there as the model has it; count 0: it has no closed contour
    Vec3 contour[EDIT_CONTOUR];      // points of it (n, b, 0), or as they were moved
    int handle;              // the point of the contour that is moved, 0 to EDIT_HANDLES - 1
    bool is_moved;           // the contour differs from the model's
    bool looks;              // the surface shows an edit that is not kept yet
    int stroke_count;        // a contour that is being drawn
    Vec3 stroke[EDIT_STROKE];
    float strength;          // of smoothing
    SmoothShape shape;
    SmoothExtent extent;     // section, branch or tree
    float blend;             // of the branch's fork, as the slider shows it
    bool draws_contour;      // the pen adds points of the stroke
    bool draws_branch;       // clicks, or the pen, add points of a new branch
    Vec3 pen;                // where keys draw: in space for a branch, (n, b, 0) for a contour
    int drawn_count;
    Vec3 drawn[EDIT_DRAWN];
    float drawn_radius;      // [mm]
    double update_ms, worst_ms;      // time of the last change of the surface, and the longest
    int saved_count;         // edits in the saved file; -1: none saved
    char message[FAULT_LENGTH];
    bool message_is_fault;
} EditState;

// Takes an editor of a model, which it does not own. False if out of memory.
bool edit_state_begin(EditState *state, SweepEditor *editor);
void edit_state_end(EditState *state);
void edit_state_say(EditState *state, bool is_fault, const char *format, ...) __attribute__((format(printf, 3, 4)));

// Goes to a place; the contour is then the model's there.
void edit_state_go(EditState *state, int branch, double t);
// To the next station (steps of stations), or by a distance.
void edit_state_step(EditState *state, int stations);
void edit_state_move(EditState *state, double by_mm);
// To another branch's middle.
void edit_state_branch(EditState *state, int by);
// The point of the present section's plane in space.
Vec3 edit_state_in_space(const EditState *state, Vec3 nb);
bool edit_state_at_station(const EditState *state);

// Makes this edit.
void edit_state_do(EditState *state, const SweepEdit *edit);
// Moves a handle and its neighbours to go through (n, b); the surface follows. edit_state_keep makes the contour an edit.
void edit_state_drag(EditState *state, Vec3 nb);
void edit_state_scale(EditState *state, double factor);
void edit_state_keep(EditState *state);
void edit_state_stroke_end(EditState *state);        // the stroke becomes the section
// Chooses a handle; a new branch begins at the wall there.
void edit_state_handle(EditState *state, int handle);
// The same by keys: the stroke goes from point to point of a pen, which begins at the handle.
void edit_state_contour_begin(EditState *state);
bool edit_state_draws(const EditState *state);       // a contour, or a branch
void edit_state_pen_move(EditState *state, Vec3 by);
void edit_state_pen_add(EditState *state);           // a point at the pen
void edit_state_pen_back(EditState *state);          // takes the last point back
void edit_state_pen_end(EditState *state, bool is_kept);
void edit_state_delete(EditState *state);
void edit_state_smooth(EditState *state, bool is_kept);      // not kept: shows what it would be
void edit_state_blend(EditState *state, bool is_kept);
void edit_state_flip(EditState *state);              // tag of the nearer open end
void edit_state_cut(EditState *state);
void edit_state_draw_begin(EditState *state);
void edit_state_draw_add(EditState *state, Vec3 x);
void edit_state_draw_end(EditState *state, bool is_kept);
void edit_state_undo(EditState *state);
void edit_state_redo(EditState *state);

#endif
