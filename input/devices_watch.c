// devices --watch: raw values as they arrive, with minimum and maximum, and the commands that the map makes from them.
#include "input/devices_watch.h"

#include "input/watched.h"

#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

enum { MOST_WATCHED = 8, SHOW_MS = 100 };

static volatile sig_atomic_t stopped;

static void stop(int number)
{
    (void)number;
    stopped = 1;
}

static int64_t now_ms(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000 + now.tv_nsec / 1000000;
}

static void show(Watched *watched)
{
    printf("%s  %s  %ld reports", watched->listing->info.path, watched->listing->info.product, watched->reports);
    if (watched->bad_reports)
        printf(", %ld not described by the descriptor", watched->bad_reports);
    printf("%s\n", watched->device ? "" : ", unplugged");
    for (int i = 0; i < watched->control_count; i++) {
        const WatchedControl *control = &watched->control[i];
        char name[32];
        hid_usage_name(control->field.usage, name, sizeof name);
        if (!control->has_value)
            continue;
        if (control->field.flags & HID_RELATIVE)
            printf("  %-14s %8lld counts in total (last %lld)\n", name, (long long)control->sum, (long long)control->value);
        else
            printf("  %-14s %8lld  logical_min %lld, logical_max %lld so far (descriptor: %lld to %lld)\n", name, (long long)control->value,
                   (long long)control->least, (long long)control->most, (long long)control->field.logical_min, (long long)control->field.logical_max);
    }
    if (watched->is_mapped) {
        const DeviceMap *map = watched->listing->map;
        watched_publish(watched);
        for (int h = 0; h < map->hand_count; h++) {
            HandPort *port = &watched->port[h];
            unsigned buttons = atomic_load(&port->buttons);
            printf("  -> tool %s: push %.2f mm/s, twist %.1f deg/s, advanced %.3f mm, turned %.2f deg%s%s%s%s\n", map->hand[h].tool,
                   atomic_load(&port->push_mm_s), atomic_load(&port->twist_deg_s), atomic_load(&port->advanced_mm), atomic_load(&port->turned_deg),
                   buttons & HAND_PEDAL ? ", pedal" : "", buttons & HAND_CONTRAST ? ", contrast" : "", buttons & HAND_STOP ? ", stop" : "",
                   buttons & HAND_MARK ? ", mark" : "");
        }
    }
}

bool devices_watch(const HidTransport *transport, const HidListing *listing, int count, double duration_s)
{
    Watched *watched = calloc(MOST_WATCHED, sizeof *watched);
    uint8_t *bytes = malloc(HID_REPORT_BYTES);
    int open_count = 0;
    struct sigaction former;
    for (int i = 0; watched && bytes && i < count && open_count < MOST_WATCHED; i++)
        open_count += watched_open(transport, &listing[i], &watched[open_count]);
    sigaction(SIGINT, &(struct sigaction){.sa_handler = stop}, &former);
    bool clears = isatty(STDOUT_FILENO);
    int64_t start = now_ms(), shown = 0;
    long reports_shown = -1;
    for (stopped = 0; open_count > 0 && !stopped && (duration_s <= 0 || (double)(now_ms() - start) < 1000 * duration_s);) {
        long reports = 0;
        for (int i = 0; i < open_count; i++) {
            // the first device waits, so that the loop does not spin
            bool was_there = watched[i].device != NULL;
            watched_read(transport, &watched[i], 10, bytes);
            if (was_there && !watched[i].device)
                reports_shown = -1;
            reports += watched[i].reports + watched[i].bad_reports;
        }
        if (now_ms() - shown >= SHOW_MS && reports != reports_shown) {
            printf(clears ? "\033[H\033[J" : "");
            for (int i = 0; i < open_count; i++)
                show(&watched[i]);
            fflush(stdout);
            shown = now_ms();
            reports_shown = reports;
        }
    }
    sigaction(SIGINT, &former, NULL);
    for (int i = 0; i < open_count; i++)
        watched_close(transport, &watched[i]);
    free(watched);
    free(bytes);
    return open_count > 0;
}
