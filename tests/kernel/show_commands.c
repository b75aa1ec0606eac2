// The commands of a recording's steps, as runs of equal commands, one per line: `PUSH_MM_S STEPS`, the push rounded to 0.001 mm/s; then `inserted
// FIRST_MM LAST_MM twisted DEG`. The recording may still be written. usage: show_commands RECORDING
#include "sim/recording.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>

int main(int argc, char **argv)
{
    static Faults faults;
    RecordedRun *run = argc == 2 ? recorded_run_load_series(argv[1], &faults) : NULL;
    if (!run || run->step_count < 1) {
        fprintf(stderr, "usage: show_commands RECORDING, which must be there\n");
        return 1;
    }
    double twisted = 0, now = 0;
    int64_t steps = 0;
    for (int64_t i = 0; i < run->step_count; i++) {
        double push = round(run->command[2 * i] * 1000) / 1000 + 0.0;
        if (steps > 0 && push != now) {
            printf("%.3f %" PRId64 "\n", now, steps);
            steps = 0;
        }
        now = push;
        steps++;
        twisted += run->command[2 * i + 1] * run->step_ms / 1000;
    }
    printf("%.3f %" PRId64 "\ninserted %.6f %.6f twisted %.6f\n", now, steps, run->inserted[0], run->inserted[run->step_count - 1], twisted);
    recorded_run_free(run);
    return 0;
}
