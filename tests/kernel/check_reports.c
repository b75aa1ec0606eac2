// Whether a recorded run took every report that a swinging uhid joystick sent (uhid_joystick.c, `swing`), and how old the newest was at each step.
//   - each report turns the dial by one count, so step i's turn so far is N_i counts: N_i reports had been read by then, the last N the number sent;
//   - the push of a step is the axis of report N_i, or of a neighbour, as rate and way are published one after the other;
//   - report k was sent at t_k on the kernel's clock. A step ends i * dT after the first, and later where simulated time slowed down, never earlier. So
//     t_{N_j} - j dT of every earlier step j is a lower bound of the time that passed in between, and with the largest of them comes a lower bound of a
//     report's age in step i, measured from the freshest that any step had: max_{j <= i} (t_{N_j} - j dT) - (t_{N_i} - i dT).
// usage: check_reports RECORDING LOG MM_S DEG_PER_COUNT. Prints what it found; exit status 1 where something is wrong.
#include "sim/recording.h"

#include <inttypes.h>
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { AXIS = 32767 };   // of the joystick's descriptor

typedef struct { double t_ms; int axis; } Report;
typedef struct { int64_t count, capacity, faults; Report *report; } Sent;

static int wrong;
#define CHECK(condition, ...)                                             \
    do {                                                                  \
        if (!(condition)) { printf("WRONG: " __VA_ARGS__); printf("\n"); wrong++; } \
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

static bool is_axis(const Sent *sent, int64_t report, double push, double mm_s)
{
    return report >= 1 && report <= sent->count && fabs(sent->report[report - 1].axis * mm_s / AXIS - push) <= 1e-9 * mm_s;
}

static void check(const RecordedRun *run, const Sent *sent, double mm_s, double deg_per_count)
{
    double turned = 0, freshest = -HUGE_VAL, latest_ms = 0, gap_ms = 0;
    int64_t taken = 0, most_at_once = 0, still = 0, longest_still = 0, other = 0, aged = 0;
    for (int64_t i = 0; i < run->step_count; i++) {
        const int64_t before = taken;
        turned += run->command[2 * i + 1] * run->step_ms / 1000;
        taken = llround(turned / deg_per_count);
        if (taken > before)
            longest_still = still > longest_still && before > 0 ? still : longest_still;
        still = taken > before ? 0 : still + 1;
        most_at_once = taken - before > most_at_once ? taken - before : most_at_once;
        if (taken == 0)
            continue;
        const double push = run->command[2 * i];
        if (!is_axis(sent, taken, push, mm_s) && !is_axis(sent, taken - 1, push, mm_s) && !is_axis(sent, taken + 1, push, mm_s))
            CHECK(other++ > 0, "step %" PRId64 " was told %.6f mm/s, which is not what report %" PRId64 " says, nor its neighbours", i, push, taken);
        if (taken >= sent->count)
            continue;            // the joystick rests: no newer report was there
        const double lead = sent->report[taken - 1].t_ms - (double)i * run->step_ms;
        freshest = fmax(freshest, lead);
        latest_ms = fmax(latest_ms, freshest - lead);
        aged++;
    }
    for (int64_t k = 1; k < sent->count; k++)
        gap_ms = fmax(gap_ms, sent->report[k].t_ms - sent->report[k - 1].t_ms);
    printf("reports: %" PRId64 " sent, %" PRId64 " received, %" PRId64 " lost; latest age %.1f ms in %" PRId64 " steps; longest gap %.1f ms as sent, %.0f ms as used, at most %"
           PRId64 " in one step\n", sent->count, taken, sent->count - taken, latest_ms, aged, gap_ms, (double)(longest_still + 1) * run->step_ms, most_at_once);
    CHECK(sent->count > 0 && taken == sent->count, "%" PRId64 " reports were sent and %" PRId64 " taken", sent->count, taken);
    CHECK(fabs(turned / deg_per_count - (double)taken) < 1e-3, "the turn of %.6f degrees is no whole number of counts", turned);
    CHECK(other == 0, "%" PRId64 " steps were told what no report says", other);
    CHECK(sent->faults == 0, "%" PRId64 " faults found by the device", sent->faults);
}

int main(int argc, char **argv)
{
    static Faults faults;
    Sent sent = {0};
    RecordedRun *run = argc == 5 ? recorded_run_load_series(argv[1], &faults) : NULL;
    if (!run || !read_log(argv[2], &sent)) {
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
