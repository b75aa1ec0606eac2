// Writes the performance figures of a session as JSON.
#ifndef SELDINGER_RENDER_TRAINER_FIGURES_H
#define SELDINGER_RENDER_TRAINER_FIGURES_H

#include "render/trainer.h"

// "-": standard output. Returns false with a fault.
bool trainer_figures_write(const char *path, const TrainerFigures *figures, Faults *faults);

#endif
