// Compares a recorded run with the log of the uhid joystick, i.e. with the motion of the hand and the force on it (uhid_joystick.c). The two clocks differ, so:
//   - the commands of the steps must be the values of the axis times MM_S, in the order in which they were sent, in at least LED_STEPS steps; the tool must have
//     moved by their sum;
//   - the force must have the direction of the tool's push, stay within MAX_N, grow by at most SLEW_N_S, and end at the recorded value;
//   - it must be zero at the end, and the device must have found no fault in any report.
// usage: check_hand_run RECORDING LOG LED_STEPS MM_S FULL_SCALE_N MAX_N SLEW_N_S. Prints the results; exit status 1 if a check fails.
#include "sim/recording.h"

#include <inttypes.h>
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { LARGEST = 10000, AXIS = 32767 };   // of the joystick's descriptor

typedef struct {
    double t;
    int value;
} Entry;
typedef struct {
    int count;
    Entry *entry;
} Series;
typedef struct {
    Series axis, force, sent;
    int faults;
    char first_fault[160];
    double ended;
} Log; // times in s

static int wrong;
#define CHECK(condition, ...)                                                                                                                                  \
    do {                                                                                                                                                       \
        if (!(condition)) {                                                                                                                                    \
            printf("WRONG: " __VA_ARGS__);                                                                                                                     \
            printf("\n");                                                                                                                                      \
            wrong++;                                                                                                                                           \
        }                                                                                                                                                      \
    } while (0)

static void append(Series *series, double t, int value)
{
    series->entry = realloc(series->entry, (size_t)(series->count + 1) * sizeof *series->entry);
    if (!series->entry)
        exit(2);
    series->entry[series->count++] = (Entry){t, value};
}

static bool read_log(const char *path, Log *log)
{
    FILE *file = fopen(path, "r");
    char line[256], kind[32];
    while (file && fgets(line, sizeof line, file)) {
        long long us;
        int value = 0;
        if (sscanf(line, "%lld %31s %d", &us, kind, &value) < 2)
            continue;
        double t = (double)us / 1e6;
        log->ended = t;
        if (!strcmp(kind, "axis"))
            append(&log->axis, t, value);
        else if (!strcmp(kind, "force"))
            append(&log->force, t, value);
        else if (!strcmp(kind, "magnitude"))
            append(&log->sent, t, value);
        else if (!strcmp(kind, "fault") && log->faults++ == 0)
            snprintf(log->first_fault, sizeof log->first_fault, "%.150s", line);
    }
    if (file)
        fclose(file);
    return file != NULL;
}

static int compare(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double median(double *values, int count)
{
    qsort(values, (size_t)count, sizeof *values, compare);
    return values[count / 2];
}

// The command of each step is a value of the axis that was sent before, never older than that of the previous step.
static void check_commands(const RecordedRun *run, const Log *log, double mm_s, int steps_wanted)
{
    int at = -1, steps_led = 0, values_used = 0;
    double way = 0;
    for (int64_t i = 0; i < run->step_count; i++) {
        double command = run->command[2 * i];
        way += command * run->step_ms / 1000;
        int next = at;
        if (at < 0 && command == 0)
            continue;   // before the first report
        while (next < 0 || (next < log->axis.count && fabs(log->axis.entry[next].value * mm_s / AXIS - command) > 1e-9 * mm_s))
            next++;
        if (next >= log->axis.count) {
            CHECK(false, "step %" PRId64 " was commanded %.9g mm/s, which the axis did not give, or gave before step %" PRId64, i, command, i - 1);
            return;
        }
        values_used += next != at;
        at = next;
        steps_led++;
    }
    double moved = run->inserted[run->step_count - 1] - run->inserted[0] + run->command[0] * run->step_ms / 1000;
    printf("%d of %" PRId64 " steps led by the axis, by %d of the %d values it took; commands sum to %.6f mm, the tool moved %.6f mm\n", steps_led,
           run->step_count, values_used, log->axis.count, way, moved);
    CHECK(steps_led >= steps_wanted, "the axis led only %d steps", steps_led);
    CHECK(fabs(way - moved) <= 1e-6, "the tool did not move as commanded");
    CHECK(moved > 0.1, "the tool hardly moved");
}

static double force_at(const Series *force, double t)
{
    int value = 0;
    for (int i = 0; i < force->count && force->entry[i].t <= t; i++)
        value = force->entry[i].value;
    return value;
}

static void check_force(const RecordedRun *run, const Log *log, double full_scale_n, double max_n, double slew_n_s)
{
    const double unit = full_scale_n / LARGEST, lateness_s = 0.1;   // largest delay of reports on a busy machine
    const Series *force = &log->force;
    double first = -1, last = -1, largest = 0, steepest = 0;
    for (int i = 0; i < force->count; i++) {
        const Entry *now = &force->entry[i];
        if (now->value && first < 0)
            first = now->t;
        if (now->value)
            last = i + 1 < force->count ? force->entry[i + 1].t : log->ended;
        largest = fmax(largest, abs(now->value));
    }
    // of the sent force, as the device releases by itself if a renewal is late
    for (int i = 0; i < log->sent.count; i++) {
        for (int j = 0; j < i; j++) {
            double rise = (abs(log->sent.entry[i].value) - abs(log->sent.entry[j].value)) * unit;
            if (rise > 0)
                steepest = fmax(steepest, rise / (log->sent.entry[i].t - log->sent.entry[j].t + lateness_s));
        }
    }
    enum { SAMPLES = 400 };
    double felt[SAMPLES], *recorded = malloc((size_t)run->step_count * sizeof *recorded);
    int64_t tail = run->step_count * 7 / 10;
    if (!recorded)
        exit(2);
    for (int64_t i = tail; i < run->step_count; i++)
        recorded[i - tail] = fmax(-max_n, fmin(max_n, run->proximal[2 * i]));
    for (int i = 0; i < SAMPLES; i++)
        felt[i] = force_at(force, last - (last - first) * 0.3 * (i + 0.5) / SAMPLES) * unit;
    double expected = median(recorded, (int)(run->step_count - tail)), got = median(felt, SAMPLES);
    free(recorded);
    printf("%d forces, largest %.4f N, steepest rise %.3f N/s, at last %.4f N where %.4f N were recorded; %.3f s of force\n", force->count, largest * unit,
           steepest, got, expected, last - first);
    CHECK(force->count >= 3, "only %d changes of force", force->count);
    CHECK(largest * unit <= max_n + unit, "more force than %.4f N", max_n);
    CHECK(steepest <= slew_n_s, "the force grew faster than %.3f N/s", slew_n_s);
    CHECK(expected > 0, "no push force to feel was recorded");
    // towards smaller X, from where the hand came; 5 %: the force of a real run varies by 2 % about its median
    CHECK(fabs(got + expected) <= 0.05 * expected + 2 * unit, "felt %.4f N instead of %.4f N", got, -expected);
    CHECK(force->count && force->entry[force->count - 1].value == 0, "the force did not end");
}

int main(int argc, char **argv)
{
    static Faults faults;
    Log log = {0};
    if (argc != 8) {
        fprintf(stderr, "usage: check_hand_run RECORDING LOG LED_STEPS MM_S FULL_SCALE_N MAX_N SLEW_N_S\n");
        return 2;
    }
    RecordedRun *run = recorded_run_load_series(argv[1], &faults);
    if (!run || !read_log(argv[2], &log)) {
        char text[2048] = "";
        faults_print(&faults, text, sizeof text);
        fprintf(stderr, "check_hand_run: %s %s: cannot be read\n%s", argv[1], argv[2], text);
        return 2;
    }
    CHECK(log.faults == 0, "%d faults found by the device, the first: %s", log.faults, log.first_fault);
    check_commands(run, &log, atof(argv[4]), atoi(argv[3]));
    check_force(run, &log, atof(argv[5]), atof(argv[6]), atof(argv[7]));
    recorded_run_free(run);
    free(log.axis.entry);
    free(log.force.entry);
    free(log.sent.entry);
    return wrong > 0;
}
