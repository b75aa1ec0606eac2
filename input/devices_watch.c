// devices --watch: raw values as they arrive, with minimum and maximum, and the commands that the map makes from them.
#include "input/devices_watch.h"

#include "input/map_state.h"

#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

enum { MOST_WATCHED = 8, MOST_SHOWN = 24, SHOW_MS = 100 };

typedef struct WatchedControl {
    HidField field;
    int64_t value, least, most, sum;     // `sum`: of relative controls
    bool has_value;
} WatchedControl;

typedef struct Watched {
    const HidListing *listing;
    void *device;                    // NULL: gone
    WatchedControl control[MOST_SHOWN];
    int control_count;
    MapState state;
    HandPort port[MAP_HANDS];
    bool is_mapped;
    long reports, bad_reports;
} Watched;

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

static bool open_watched(const HidTransport *transport, const HidListing *listing, Watched *watched)
{
    char why[320];
    Faults faults;
    *watched = (Watched){.listing = listing};
    if (!listing->descriptor || !(watched->device = transport->open(transport->context, listing->info.path, why, sizeof why)))
        return false;
    for (int i = 0; i < listing->descriptor->field_count && watched->control_count < MOST_SHOWN; i++) {
        const HidField *field = &listing->descriptor->field[i];
        if (field->kind == HID_INPUT && field->flags & HID_VARIABLE && !(field->flags & HID_CONSTANT) && field->usage && field->usage >> 16 < 0xff00)
            watched->control[watched->control_count++].field = *field;
    }
    faults_clear(&faults);
    watched->is_mapped = listing->map && map_bind_hid(listing->map, listing->descriptor, "", &watched->state, &faults);
    return true;
}

static void take(Watched *watched, const uint8_t *bytes, size_t length)
{
    const HidReport *report;
    const uint8_t *payload;
    size_t payload_length;
    const HidDescriptor *descriptor = watched->listing->descriptor;
    if (hid_report_open(descriptor, HID_INPUT, bytes, length, &report, &payload, &payload_length) != HID_REPORT_GOOD) {
        watched->bad_reports++;
        return;
    }
    watched->reports++;
    for (int i = 0; i < watched->control_count; i++) {
        WatchedControl *control = &watched->control[i];
        int64_t value;
        if (control->field.report_id != report->id || !hid_field_read(&control->field, 0, payload, payload_length, &value))
            continue;
        control->least = !control->has_value || value < control->least ? value : control->least;
        control->most = !control->has_value || value > control->most ? value : control->most;
        control->value = value;
        control->sum += value;
        control->has_value = true;
    }
    if (watched->is_mapped)
        map_take_report(watched->listing->map, descriptor, bytes, length, &watched->state);
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
        map_publish(map, &watched->state, watched->port);
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
        open_count += open_watched(transport, &listing[i], &watched[open_count]);
    sigaction(SIGINT, &(struct sigaction){.sa_handler = stop}, &former);
    bool clears = isatty(STDOUT_FILENO);
    int64_t start = now_ms(), shown = 0;
    long reports_shown = -1;
    for (stopped = 0; open_count > 0 && !stopped && (duration_s <= 0 || (double)(now_ms() - start) < 1000 * duration_s);) {
        long reports = 0;
        for (int i = 0; i < open_count; i++) {
            int length = 0;
            for (int k = 0; watched[i].device && k < 64; k++) {
                // the first device waits, so that the loop does not spin
                length = transport->read(transport->context, watched[i].device, bytes, HID_REPORT_BYTES, k == 0 ? 10 : 0);
                if (length <= 0)
                    break;
                take(&watched[i], bytes, (size_t)length);
            }
            if (length < 0 && !stopped) {
                transport->close(transport->context, watched[i].device);
                watched[i].device = NULL;
                reports_shown = -1;
            }
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
        if (watched[i].device)
            transport->close(transport->context, watched[i].device);
    free(watched);
    free(bytes);
    return open_count > 0;
}
