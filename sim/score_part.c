#include "sim/score_part.h"

#include <stddef.h>

// name, key of its par, title, unit, why it costs points. Title and reason fit on a line of the window's result.
#define PARTS(PART)                                                                                                                                            \
    PART(TIME, "time", "time_s", "Time", "s", "slower than the time for full points")                                                                          \
    PART(FLUOROSCOPY, "fluoroscopy", "fluoroscopy_s", "X-ray time", "s", "the X-ray pedal was down for longer than needed")                                    \
    PART(CONTRAST, "contrast", "contrast_ml", "Contrast agent", "ml", "more contrast agent than needed")                                                       \
    PART(PATH, "path", "path_ratio", "Path of the tip", "times the shortest", "the tip made detours")                                                          \
    PART(WALL_FORCE, "wall_force", "wall_force_n", "Largest wall force", "N", "a tool was pressed hard against the wall")                                      \
    PART(WALL_IMPULSE, "wall_impulse", "wall_impulse_n_s", "Wall force over time", "N s", "tools pressed against the wall for long")                           \
    PART(BLIND, "blind", "blind_mm", "Moved without X-rays", "mm", "tools were moved without a fresh X-ray image of their tip")                                \
    PART(GUIDANCE, "guidance", "guidance_s", "Use of 3D views", "s", "tools were moved with the 3D view or angioscopy in sight")

#define NAME(part, name, par, title, unit, why) [PART_##part] = (name),
const char *const score_part_name[PART_COUNT + 1] = {PARTS(NAME)};
#define PAR(part, name, par, title, unit, why) [PART_##part] = (par),
const char *const score_part_par_name[PART_COUNT + 1] = {PARTS(PAR)};
#define WORDS(part, name, par, title, unit, why) [PART_##part] = {title, unit, why},
const ScorePartWords score_part_words[PART_COUNT] = {PARTS(WORDS)};
