// The cine loop of a session: recorded while the X-ray is on, replayed in place of the live picture, saved as a loop and as a video.
#ifndef SELDINGER_RENDER_TRAINER_CINE_H
#define SELDINGER_RENDER_TRAINER_CINE_H

#include "render/cine.h"
#include "render/panel.h"
#include "render/views.h"

typedef struct TrainerCine {
    Cine *cine;
    CinePlayer player;
    bool is_shown;                   // shown in place of the live picture
    int tree_nodes;                  // the first contrast values of an image belong to the tree, this many; the others to the lumens of the tools
} TrainerCine;

// Allocates a loop for half a minute at 30 images a second, or loads the one in the file `path` if that is not NULL. Returns false with faults.
bool trainer_cine_open(TrainerCine *cine, const CineShape *shape, const char *path, Faults *faults);
void trainer_cine_close(TrainerCine *cine);
// Records and replays according to the actions. Returns true if the picture jumps, so that the held one must be forgotten. `remark` receives a message, "" if
// none.
bool trainer_cine_obey(TrainerCine *cine, const PanelActions *actions, char *remark, size_t capacity);
// During replay, replaces the pose, controls, contrast and pulse of `frame` by those of the loop's image; otherwise adds `frame` to the loop with this
// concentration.
void trainer_cine_frame(TrainerCine *cine, double passed_s, const float *concentration, ViewsFrame *frame);
// Writes STEM.cine and STEM.mp4. Returns true with both names in `remark`, or false with the reason.
bool trainer_cine_save(TrainerCine *cine, Views *views, const char *stem, char *remark, size_t capacity, Faults *faults);

#endif
