// What the case window knows, without a window: the volume's builder, what the user did, where he looks, and what a click does. Tests drive it as the window
// does. Lengths in mm, in the volume's frame.
#ifndef SELDINGER_RENDER_CASE_STATE_H
#define SELDINGER_RENDER_CASE_STATE_H

#include "render/edit_state.h"
#include "render/vessel_scene_camera.h"
#include "render/volume_view.h"
#include "sim/sim.h"

// The views: the three slices (SliceView), and a projection that turns.
enum { CASE_PROJECTION = 3, CASE_VIEWS, CASE_NAMES = 48 };
// Lists of which the user chooses one name: an act each.
typedef enum { CASE_WIRES, CASE_CATHETERS, CASE_SEGMENTS, CASE_MODELS, CASE_LISTS } CaseListId;
// What a click does: a CaseActKind at that point, or only to look there.
enum { CASE_LOOK = CASE_ACTS };

typedef struct CaseState {
    CaseOptions made;            // all but the trace
    CaseBuilder *builder;
    CaseActs acts;
    BuildProgress progress;      // of the last frame
    bool has_volume;             // and all below is set
    const Volume *volume, *reduced;
    const Volume *soft;          // of a CT, without bone; else NULL
    VolumeAxes axes;
    double low, high;            // brightness shown as black and white
    double full_low, full_high;  // at first
    Vec3 cursor;                 // where the three slices cross
    Vec3 middle[3];              // of each slice's view …
    double zoom[3];              // … and how much it is magnified
    FreeCamera camera;           // of the projection
    bool turns;                  // the projection, by itself
    bool shows_wall;             // instead of the projection
    bool shows_bone;             // of a CT, in the projection
    int view;                    // that has the keys
    int mode;                    // what a click does
    double forbid_radius;        // [mm]
    RbtSeen *seen;               // the tree as it grows
    int seen_count, seen_number;
    int chosen_mark;             // -1: none
    struct {
        int count, chosen;           // 0: "", none, a wire that suits the vessels, or local models
        char name[CASE_NAMES][80];
    } list[CASE_LISTS];
    SweepEditor *editor;         // of the model, while its sections are edited; else NULL
    EditState edit;              // with an editor
    int pictures;                // grows with each change of what all views show …
    int turned;                  // … and of how the projection is seen
    char message[600];
    bool message_is_fault;
} CaseState;

// Begins to load the volume. Returns false if out of memory.
bool case_state_begin(CaseState *state, const CaseOptions *made);
void case_state_end(CaseState *state);
// Takes what the builder has done since the last frame. True if something changed.
bool case_state_frame(CaseState *state);

// Does `kind` at a point: a new act, and what follows from it.
void case_state_act(CaseState *state, CaseActKind kind, Vec3 place);
// A click at a point of the volume: the act of the mode, or looks there.
void case_state_click(CaseState *state, Vec3 place);
// A click in a view that meets no place of the volume: says why it does nothing.
void case_state_click_nowhere(CaseState *state, int view);
void case_state_mode(CaseState *state, int mode);
void case_state_undo(CaseState *state);
void case_state_redo(CaseState *state);
// Stops what is being made, and undoes the act that it follows from.
void case_state_cancel(CaseState *state);
void case_state_next(CaseState *state, CaseListId list, int by);
void case_state_turn_background(CaseState *state);
// Bone of a CT is tracked from now on, or left out again. Without a CT: says that there is none.
void case_state_turn_bone(CaseState *state);
bool case_state_forbids_bone(const CaseState *state);
void case_state_choose_mark(CaseState *state, int mark);

// Begins to edit the sections of a swept model. False with a message if there is none. The edits are acts …
bool case_state_edit_begin(CaseState *state);
void case_state_edit_end(CaseState *state);
// … once this has taken them, after anything that may have changed `edit`.
void case_state_edit_take(CaseState *state);

// What the projection shows and a click in it meets: of a CT what is not bone, unless the user wants it.
const Volume *case_state_projected(const CaseState *state);
// A view of this size; the projection at CASE_PROJECTION.
Camera case_state_camera(const CaseState *state, int view, int width, int height);
// Moves the slice of a view by voxels, and the cross-hair within a view by voxels to the right and up.
void case_state_scroll(CaseState *state, int view, double voxels);
void case_state_move(CaseState *state, int view, double right, double up);
void case_state_zoom(CaseState *state, int view, double notches);
// Brightness range: wider by a factor, higher by a part of its width.
void case_state_window(CaseState *state, double wider, double higher);
// What the user may do now, in a sentence.
const char *case_state_hint(const CaseState *state);
// Writes the case. `folder` NULL: one of the user's data, named after the volume. `out`: the folder.
bool case_state_save(CaseState *state, const char *folder, char *out, size_t capacity, Faults *faults);

#endif
