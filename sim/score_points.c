#include "sim/score_points.h"

#include <math.h>
#include <stdio.h>

double score_parts_judge(ScoreFigures *f, const Exercise *exercise)
{
    const double measured[PART_COUNT] = {[PART_TIME] = f->time_s,
                                         [PART_FLUOROSCOPY] = f->fluoroscopy_s,
                                         [PART_CONTRAST] = f->contrast_ml,
                                         [PART_PATH] = f->way_mm > 0 ? f->path_mm / f->way_mm : 0,
                                         [PART_WALL_FORCE] = f->wall_force_peak_n,
                                         [PART_WALL_IMPULSE] = f->wall_impulse_n_s,
                                         [PART_BLIND] = f->blind_total_mm,
                                         [PART_GUIDANCE] = f->guided_s};
    double sum = 0, weights = 0;
    for (int i = 0; i < PART_COUNT; i++)
        weights += exercise->par[i] > 0 ? exercise->weight[i] : 0;
    for (int i = 0; i < PART_COUNT; i++) {
        const double par = exercise->par[i];
        const bool is_judged = par > 0 && exercise->weight[i] > 0;
        f->part[i] = par > 0 ? par / fmax(par, measured[i]) : 1;
        const double most = is_judged ? 100 * exercise->weight[i] / weights : 0;
        f->judged[i] = (ScorePartFigures){.measured = measured[i], .par = par, .most = most, .points = most * f->part[i]};
        sum += par > 0 ? exercise->weight[i] * f->part[i] : 0;
    }
    return weights > 0 ? sum / weights : 1;
}

void score_part_reason(const ScoreFigures *f, ScorePart part, char *text, size_t capacity)
{
    const double visible = 0.05, lost = f->judged[part].most - f->judged[part].points;
    if (lost >= visible)
        snprintf(text, capacity, "%s", score_part_words[part].why);
    else if (capacity > 0)
        text[0] = 0;
}

double score_share(const ScoreFigures *f)
{
    double covered = f->way_mm > 0 ? fmax(1 - f->least_remaining_mm / f->way_mm, 0) : 0;
    return f->state == SCORE_REACHED ? 1 : 0.5 * covered;
}

double score_error_points(const Exercise *exercise, ScoreError kind)
{
    return kind >= ERROR_PERFORATION ? exercise->consequences.points[kind - ERROR_PERFORATION] : exercise->error_points;
}

double score_lost_to_errors(const ScoreFigures *f, const Exercise *exercise)
{
    double lost = 0;
    for (int i = 0; i < ERROR_COUNT; i++)
        lost += f->error[i].count * score_error_points(exercise, (ScoreError)i);
    return lost;
}
