// The cine loop of a session: recorded while the X-ray is on, replayed in place of the live picture, saved as a loop and as a film.
#ifndef SELDINGER_RENDER_TRAINER_CINE_H
#define SELDINGER_RENDER_TRAINER_CINE_H

#include "render/cine.h"
#include "render/panel.h"
#include "render/views.h"

typedef struct TrainerCine {
    Cine *cine;
    CinePlayer player;
    bool is_shown;                   // in the place of the live picture
    int tree_nodes;                  // of an image's contrast, the first ones; the others are the tools' lumens
} TrainerCine;

// Room for half a minute at 30 images a second, or the loop in the file `path` where it is not NULL. False with faults.
bool trainer_cine_open(TrainerCine *cine, const CineShape *shape, const char *path, Faults *faults);
void trainer_cine_close(TrainerCine *cine);
// Record and replay as pressed; true if the picture jumps, so that the held one must be forgotten. `told` receives a message, "" if none.
bool trainer_cine_obey(TrainerCine *cine, const PanelActions *actions, char *told, size_t capacity);
// During replay, replaces `frame`'s pose, controls, contrast and pulse by those of the loop's image; otherwise adds `frame` to the loop with this
// concentration.
void trainer_cine_frame(TrainerCine *cine, double passed_s, const float *concentration, ViewsFrame *frame);
// STEM.cine and STEM.mp4. True with both names in `told`, false with the reason.
bool trainer_cine_save(TrainerCine *cine, Views *views, const char *stem, char *told, size_t capacity, Faults *faults);

#endif
