// Checks that a recorded run used every report that a swinging uhid joystick sent (uhid_joystick.c, `swing`), and how old the newest was at each step.
//   - each report turns the dial by one count, so the rotation N_i up to step i is the number of reports read by then; the last N is the number sent;
//   - the push of a step is the axis of a report from N_{i-1} to N_{i+1}: several are read at once, and rate and distance are published one after the other;
//   - report k was sent at t_k on the kernel's clock. A step ends i * dT after the first, and later where simulated time slowed down, never earlier. So
//     t_{N_j} - j dT of every earlier step j is a lower bound of the time that passed in between, and with the largest of them comes a lower bound of a
//     report's age in step i, measured from the freshest that any step had: max_{j <= i} (t_{N_j} - j dT) - (t_{N_i} - i dT).
// usage: check_reports RECORDING LOG MM_S DEG_PER_COUNT. Prints the results; exit status 1 if a check fails.
#include "sim/recording.h"

#include <inttypes.h>
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { AXIS = 32767 };   // of the joystick's descriptor

typedef struct {
    double t_ms;
    int axis;
} Report;
typedef struct {
    int64_t count, capacity, faults;
    Report *report;
} Sent;

static int wrong;
#define CHECK(condition, ...)                                                                                                                                  \
    do {                                                                                                                                                       \
        if (!(condition)) {                                                                                                                                    \
            printf("WRONG: " __VA_ARGS__);                                                                                                                     \
            printf("\n");                                                                                                                                      \
            wrong++;                                                                                                                                           \
        }                                                                                                                                                      \
    } while (0)

static bool read_log(const char *path, Sent *sent)
{
    FILE *file = fopen(path, "r");
    char line[256], kind[32];
    while (file && fgets(line, sizeof line, file)) {
        long long us;
        int value = 0;
        int found = sscanf(line, "%lld %31s %d", &us, kind, &value);
        sent->faults += found >= 2 && !strcmp(kind, "fault");
        if (found != 3 || strcmp(kind, "sent") != 0)
            continue;
        if (sent->count == sent->capacity) {
            sent->capacity = 2 * sent->capacity + 1024;
            sent->report = realloc(sent->report, (size_t)sent->capacity * sizeof *sent->report);
            if (!sent->report)
                exit(2);
        }
        sent->report[sent->count++] = (Report){(double)us / 1000, value};
    }
    if (file)
        fclose(file);
    return file != NULL;
}

// True if one of these reports has this push.
static bool is_said(const Sent *sent, int64_t first, int64_t last, double push, double mm_s)
{
    for (int64_t k = first < 1 ? 1 : first; k <= last && k <= sent->count; k++)
        if (fabs(sent->report[k - 1].axis * mm_s / AXIS - push) <= 1e-9 * mm_s)
            return true;
    return false;
}

// The number of reports read by each step.
static int64_t *count_taken(const RecordedRun *run, double deg_per_count)
{
    double turned = 0;
    int64_t *taken = malloc((size_t)run->step_count * sizeof *taken);
    if (!taken)
        exit(2);
    for (int64_t i = 0; i < run->step_count; i++) {
        turned += run->command[2 * i + 1] * run->step_ms / 1000;
        taken[i] = llround(turned / deg_per_count);
    }
    CHECK(fabs(turned / deg_per_count - (double)taken[run->step_count - 1]) < 1e-3, "the turn of %.6f degrees is no whole number of counts", turned);
    return taken;
}

static void check(const RecordedRun *run, const Sent *sent, double mm_s, double deg_per_count)
{
    double freshest = -HUGE_VAL, latest_ms = 0, gap_ms = 0;
    int64_t most_at_once = 0, still = 0, longest_still = 0, other = 0, aged = 0;
    int64_t *taken = count_taken(run, deg_per_count), all = taken[run->step_count - 1];
    for (int64_t i = 0; i < run->step_count; i++) {
        const int64_t before = i > 0 ? taken[i - 1] : 0, after = i + 1 < run->step_count ? taken[i + 1] : taken[i];
        if (taken[i] > before && before > 0)
            longest_still = still > longest_still ? still : longest_still;
        still = taken[i] > before ? 0 : still + 1;
        most_at_once = taken[i] - before > most_at_once ? taken[i] - before : most_at_once;
        if (taken[i] == 0)
            continue;
        const double push = run->command[2 * i];
        if (!is_said(sent, before, after, push, mm_s))
            CHECK(other++ > 0, "step %" PRId64 " was commanded %.6f mm/s, which none of the reports %" PRId64 " to %" PRId64 " gives", i, push, before, after);
        if (taken[i] >= sent->count)
            continue;            // the joystick rests: no newer report was there
        const double lead = sent->report[taken[i] - 1].t_ms - (double)i * run->step_ms;
        freshest = fmax(freshest, lead);
        latest_ms = fmax(latest_ms, freshest - lead);
        aged++;
    }
    for (int64_t k = 1; k < sent->count; k++)
        gap_ms = fmax(gap_ms, sent->report[k].t_ms - sent->report[k - 1].t_ms);
    printf("reports: %" PRId64 " sent, %" PRId64 " received, %" PRId64 " lost; latest age %.1f ms in %" PRId64
           " steps; longest gap %.1f ms as sent, %.0f ms as used, at most %" PRId64 " in one step\n",
           sent->count, all, sent->count - all, latest_ms, aged, gap_ms, (double)(longest_still + 1) * run->step_ms, most_at_once);
    CHECK(sent->count > 0 && all == sent->count, "%" PRId64 " reports were sent and %" PRId64 " taken", sent->count, all);
    CHECK(other == 0, "%" PRId64 " steps were commanded what no report gives", other);
    CHECK(sent->faults == 0, "%" PRId64 " faults found by the device", sent->faults);
    free(taken);
}

int main(int argc, char **argv)
{
    static Faults faults;
    Sent sent = {0};
    RecordedRun *run = argc == 5 ? recorded_run_load_series(argv[1], &faults) : NULL;
    if (!run || run->step_count < 1 || !read_log(argv[2], &sent)) {
        char text[2048] = "";
        faults_print(&faults, text, sizeof text);
        fprintf(stderr, "usage: check_reports RECORDING LOG MM_S DEG_PER_COUNT\n%s", text);
        return 2;
    }
    check(run, &sent, atof(argv[3]), atof(argv[4]));
    recorded_run_free(run);
    free(sent.report);
    return wrong > 0;
}
