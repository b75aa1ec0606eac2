#include "sim/score.h"

#include <cjson/cJSON.h>
#include <stdlib.h>

static bool add(cJSON *to, const char *name, double value) { return cJSON_AddNumberToObject(to, name, value) != NULL; }

static bool add_figures(cJSON *json, const ScoreFigures *f)
{
    return cJSON_AddStringToObject(json, "state", score_state_name[f->state]) && add(json, "points", f->points) && add(json, "start_s", f->start_s) &&
           add(json, "time_s", f->time_s) && add(json, "fluoroscopy_s", f->fluoroscopy_s) && add(json, "pulses", (double)f->pulses) &&
           add(json, "dose_area_cm2", f->dose_area_cm2) && add(json, "contrast_ml", f->contrast_ml) && add(json, "path_mm", f->path_mm) &&
           add(json, "way_mm", f->way_mm) && add(json, "least_remaining_mm", f->least_remaining_mm) && add(json, "efficiency", f->efficiency) &&
           add(json, "inserted_mm", f->inserted_mm) && add(json, "withdrawn_mm", f->withdrawn_mm) && add(json, "wall_force_peak_n", f->wall_force_peak_n) &&
           add(json, "wall_impulse_n_s", f->wall_impulse_n_s) && add(json, "tip_force_peak_n", f->tip_force_peak_n) &&
           add(json, "target_distance_mm", f->target_distance_mm) && add(json, "held_s", f->held_s) && add(json, "reached_s", f->reached_s) &&
           add(json, "error_total", f->error_total);
}

static bool add_parts(cJSON *json, const ScoreFigures *f)
{
    cJSON *parts = cJSON_AddObjectToObject(json, "parts"), *errors = cJSON_AddObjectToObject(json, "errors");
    bool good = parts && errors;
    for (int i = 0; good && i < PART_COUNT; i++)
        good = add(parts, score_part_name[i], f->part[i]);
    for (int i = 0; good && i < ERROR_COUNT; i++) {
        cJSON *error = cJSON_AddObjectToObject(errors, score_error_name[i]);
        good = error && add(error, "count", f->error[i].count) && add(error, "last_s", f->error[i].last_s);
    }
    return good;
}

char *score_json(const ScoreFigures *figures, const Scene *scene)
{
    cJSON *json = cJSON_CreateObject();
    const Exercise *exercise = scene->exercise;
    bool good = json && cJSON_AddBoolToObject(json, "has_exercise", figures->has_exercise) && cJSON_AddBoolToObject(json, "has_xray", figures->has_xray);
    if (good && exercise)
        good = cJSON_AddStringToObject(json, "title", exercise->title) && cJSON_AddStringToObject(json, "target", scene->target[exercise->target].name);
    char *text = good && add_figures(json, figures) && add_parts(json, figures) ? cJSON_Print(json) : NULL;
    cJSON_Delete(json);
    return text;
}
