// The values of each run: a function of the specification and the run's number alone, so that any process can compute any run.
#ifndef SELDINGER_STUDY_POINTS_H
#define SELDINGER_STUDY_POINTS_H

#include "input/input.h"
#include "study/spec.h"

// The value of a factor in a run, as text of a scene in flow style: a number in `text`, or one of the listed values.
const char *study_value(const Study *study, int64_t run, int factor, char text[VARY_TEXT]);
const char *study_scene(const Study *study, int64_t run);      // path of its scene
uint64_t study_hand_seed(const Study *study, int64_t run);     // with random hands
// The text of the scene with the run's values; the caller frees it. NULL with faults, at the value's place in the specification. `scene_text` is the scene's
// own text.
char *study_scene_text(const Study *study, int64_t run, const char *scene_text, Faults *faults);
// The same with one factor at a value, the others as in the scene.
char *study_changed_text(const Study *study, int factor, const char *value, const char *scene_text, Faults *faults);
// A script (CSV) of random hands; the caller frees it. `tools`: those of the scene.
char *study_hands(const RandomHands *hands, uint64_t seed, const ToolNames *tools);

#endif
