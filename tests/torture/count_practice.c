// Prints the activity in a recording in one line: simulated s, motion of all tools [mm], rotation of all [deg], X-rays [s], contrast [ml], exchanges, shaped
// tips, bookmarks. usage: count_practice RECORDING. tests/torture/practice sums the lines, so that a soak test without activity is noticed.
#include "sim/recording.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static int occurrences(const char *text, const char *word)
{
    int count = 0;
    for (const char *at = text; at && (at = strstr(at, word)); at += strlen(word))
        count++;
    return count;
}

int main(int argc, char **argv)
{
    static Faults faults;
    RecordedRun *run = argc == 2 ? recorded_run_load_series(argv[1], &faults) : NULL;
    if (!run || run->step_count < 1) {
        fprintf(stderr, "usage: count_practice RECORDING, which must hold a step\n");
        return 2;
    }
    const double step_s = run->step_ms / 1000;
    double way = 0, turns = 0, pedal = 0, contrast = 0;
    int exchanges = 0;
    for (int64_t i = 0; i < run->step_count; i++) {
        const ToolCommands now = recorded_run_commands(run, i);
        for (int k = 0; k < run->tool_count; k++) {
            way += fabs(now.tool[k].push_mm_s) * step_s;
            turns += fabs(now.tool[k].twist_deg_s) * step_s;
            exchanges += i > 0 && recorded_run_fitted(run, k, i) != recorded_run_fitted(run, k, i - 1);
        }
        if (run->xray) {
            pedal += run->xray[i].pedal > 0 ? step_s : 0;
            contrast += (double)run->xray[i].contrast_ml_s * step_s;
        }
    }
    printf("%.3f %.1f %.0f %.1f %.1f %d %d %.0f\n", (double)run->step_count * step_s, way, turns, pedal, contrast, exchanges,
           occurrences(run->scene_text, "shaped_tip:"), run->xray ? (double)run->xray[run->step_count - 1].bookmark : 0);
    recorded_run_free(run);
    return 0;
}
