// The summary of a run (sim/run_summary.h) and its score (sim/score_json.h) as a flat list of named numbers: columns of the table.
#ifndef SELDINGER_STUDY_FIGURES_H
#define SELDINGER_STUDY_FIGURES_H

#include <cJSON.h>
#include <stdbool.h>

// Adds the numbers of `from`, an object of objects, lists and numbers, to the flat object `to`, by their path: "contacts.max", "tip_mm[0]"; true is 1; each of a
// list of words ("flags") is "flags.WORD": 1. Other texts, and times that depend on the computer, are left out. `prefix` ("" or "score.") begins each name.
void figures_add(cJSON *to, const cJSON *from, const char *prefix);
// Whether a figure or key is `whole` or below it: "tip_mm[0]" of "tip_mm", "vessel.tube.radius_mm" of "vessel.tube".
bool path_is_part_of(const char *path, const char *whole);

#endif
