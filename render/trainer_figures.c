#include "render/trainer_figures.h"

#include "base/base.h"

#include <cJSON.h>

bool trainer_figures_write(const char *path, const TrainerFigures *figures, Faults *faults)
{
    cJSON *out = cJSON_CreateObject();
    cJSON_AddNumberToObject(out, "first_picture_s", figures->first_picture_s);
    cJSON_AddNumberToObject(out, "first_picture_cpu_s", figures->first_picture_cpu_s);
    cJSON_AddNumberToObject(out, "frames", (double)figures->frames);
    cJSON_AddNumberToObject(out, "frames_skipped", (double)figures->frames_skipped);
    cJSON_AddNumberToObject(out, "longest_gap_s", figures->longest_gap_s);
    static const char *const quantile[] = {"median", "p99", "max"}, *const step_quantile[] = {"median", "p999", "max"};
    cJSON *frame = cJSON_AddObjectToObject(out, "frame_cpu_ms"), *step = cJSON_AddObjectToObject(out, "step_us"),
          *late = cJSON_AddObjectToObject(out, "late_us");
    for (int i = 0; i < 3; i++) {
        cJSON_AddNumberToObject(frame, quantile[i], figures->frame_cpu_ms[i]);
        cJSON_AddNumberToObject(step, step_quantile[i], figures->step_us[i]);
        cJSON_AddNumberToObject(late, quantile[i], figures->late_us[i]);
    }
    cJSON_AddNumberToObject(out, "deadline_misses", (double)figures->deadline_misses);
    cJSON_AddNumberToObject(out, "slowed_s", figures->slowed_s);
    cJSON_AddBoolToObject(out, "real_time_priority", figures->real_time_priority);
    cJSON_AddNumberToObject(out, "resident_mb_after_first_minute", figures->resident_mb[0]);
    cJSON_AddNumberToObject(out, "resident_mb_at_end", figures->resident_mb[1]);
    cJSON_AddNumberToObject(out, "device_reports", (double)figures->reports);
    cJSON_AddStringToObject(out, "state_hash", figures->hash);
    cJSON_AddStringToObject(out, "recording", figures->recording);
    char *text = cJSON_Print(out);
    cJSON_Delete(out);
    return output_write_line(path, text, faults);
}
