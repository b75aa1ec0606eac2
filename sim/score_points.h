// The points of a score: what each of its parts measures, how many points it gives, and why it lost some. Files, screens and reports list what is judged here.
#ifndef SELDINGER_SIM_SCORE_POINTS_H
#define SELDINGER_SIM_SCORE_POINTS_H

#include "sim/score_figures.h"

#include <stddef.h>

// Sets measure, par and points of each part from the figures; the mean of the parts, 0 to 1 (1 if none is judged), is returned.
double score_parts_judge(ScoreFigures *figures, const Exercise *exercise);
// Why a part lost points, in one line: "" if it lost less than is shown, or is not judged.
void score_part_reason(const ScoreFigures *figures, ScorePart part, char *text, size_t capacity);
// What multiplies the sum of the parts: 1 once the target was held, before that half of the fraction of the path to it that was covered.
double score_share(const ScoreFigures *figures);
// What an error of this kind costs: error_points, or what the consequence costs; and all errors together.
double score_error_points(const Exercise *exercise, ScoreError kind);
double score_lost_to_errors(const ScoreFigures *figures, const Exercise *exercise);

#endif
