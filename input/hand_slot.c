#include "input/hand_slot.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

enum { READ_WAIT_MS = 50, FORCE_WAIT_MS = 1, DRAIN_MOST = 512, INFO_US = 50000, COUNT_RATE_US = 1000000, REPORT_INTERVAL_US = 10000000 };

int64_t hand_now_us(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000000 + now.tv_nsec / 1000;
}

void hand_report(HandShared *shared, const char *format, ...)
{
    va_list arguments;
    pthread_mutex_lock(&shared->lock);
    if (shared->message_count == MESSAGES_KEPT) {    // drop the oldest
        shared->message_first = (shared->message_first + 1) % MESSAGES_KEPT;
        shared->message_count--;
    }
    char *text = shared->message[(shared->message_first + shared->message_count++) % MESSAGES_KEPT];
    va_start(arguments, format);
    vsnprintf(text, HAND_MESSAGE_LENGTH, format, arguments);
    va_end(arguments);
    pthread_mutex_unlock(&shared->lock);
}

static void update_info(HandSlot *slot, HandState state, double report_hz)
{
    atomic_store(&slot->port->state, state);
    pthread_mutex_lock(&slot->shared->lock);
    slot->info.state = state;
    slot->info.reports = slot->state.reports;
    slot->info.bad_reports = slot->state.bad_reports;
    slot->info.report_hz = report_hz;
    slot->info.force_n = state == HAND_READY ? slot->force.guard.sent[0] : 0;
    pthread_mutex_unlock(&slot->shared->lock);
}

// Reads all pending reports, at most DRAIN_MOST, so that a flood cannot block the thread. Returns their number; -1: the device is gone.
static int drain(HandSlot *slot, int wait_ms)
{
    const HidTransport *transport = &slot->shared->transport;
    uint8_t bytes[HID_REPORT_BYTES];
    int count = 0, length = transport->read(transport->context, slot->device, bytes, (int)sizeof bytes, wait_ms);
    while (length > 0) {
        map_take_report(slot->map, slot->descriptor, bytes, (size_t)length, &slot->state);
        if (++count == DRAIN_MOST)
            break;
        length = transport->read(transport->context, slot->device, bytes, (int)sizeof bytes, 0);
    }
    if (count > 0)
        map_publish(slot->map, &slot->state, slot->port);
    return length < 0 ? -1 : count;
}

static void show_force(HandSlot *slot)
{
    pthread_mutex_lock(&slot->shared->lock);
    snprintf(slot->info.force, sizeof slot->info.force, "%s", slot->force.text);
    pthread_mutex_unlock(&slot->shared->lock);
}

// Reports arrive at any time. Waits for a force due within the next millisecond; otherwise it would be sent only after the report following the next one.
static int64_t wait_for_force(const HandSlot *slot, int64_t now)
{
    int64_t left = slot->force.block[0] ? slot->force.due_us - now : 0;
    if (left <= 0 || left > 1000)
        return now;
    nanosleep(&(struct timespec){.tv_nsec = (long)left * 1000}, NULL);
    return hand_now_us();
}

static void start_force(HandSlot *slot)
{
    HandShared *shared = slot->shared;
    bool plays = force_start(&slot->force, slot->map, slot->descriptor, &shared->transport, slot->device, hand_now_us());
    show_force(slot);
    if (slot->map->force.is_wanted && !plays)
        hand_report(shared, "%s: force: %s", slot->info.name, slot->force.text);
}

// Reports when the watchdog has set the force to zero, at most once per REPORT_INTERVAL_US, and once when the device accepts nothing any more.
static void report_watchdog(HandSlot *slot, double sent_before, bool played_before, int64_t now)
{
    if (played_before && !slot->force.block[0]) {
        show_force(slot);
        hand_report(slot->shared, "%s: force: %s", slot->info.name, slot->force.text);
        return;
    }
    const char *why = slot->force.guard.why_zero;
    if (sent_before != 0 && slot->force.guard.sent[0] == 0 && why && why[0] && strcmp(why, "paused") != 0 && now >= slot->report_from_us) {
        hand_report(slot->shared, "%s: force to zero, %s%s", slot->info.name, why,
                    strstr(why, "silent") ? "(if the device reports only changes, set force: {quiet_ms: 0} in its map)" : "");
        slot->report_from_us = now + REPORT_INTERVAL_US;
    }
}

void *hand_run_hid(void *argument)
{
    HandSlot *slot = argument;
    HandShared *shared = slot->shared;
    int64_t report_us = hand_now_us(), counted_from = report_us, informed = 0, reports_then = slot->state.reports;
    bool is_there = true, has_reported_bad = slot->state.bad_reports > 0;
    double hz = 0;
    start_force(slot);
    int wait_ms = slot->force.block[0] ? FORCE_WAIT_MS : READ_WAIT_MS;
    while (is_there && !atomic_load(&shared->quit)) {
        int count = drain(slot, wait_ms);
        int64_t now = hand_now_us();
        double sent_before = slot->force.guard.sent[0];
        bool played_before = slot->force.block[0] != 0;
        is_there = count >= 0;
        report_us = count > 0 ? now : report_us;
        now = is_there ? wait_for_force(slot, now) : now;
        if (is_there)
            force_tick(&slot->force, slot->port, now, report_us, atomic_load(&shared->paused), &shared->transport, slot->device);
        report_watchdog(slot, sent_before, played_before, now);
        if (now - counted_from >= COUNT_RATE_US) {
            hz = 1e6 * (double)(slot->state.reports - reports_then) / (double)(now - counted_from);
            counted_from = now;
            reports_then = slot->state.reports;
        }
        if (!has_reported_bad && slot->state.bad_reports > 0) {
            hand_report(shared, "%s sends reports that its descriptor does not describe (too short or of unknown id); they are ignored", slot->info.name);
            has_reported_bad = true;
        }
        if (now - informed >= INFO_US) {
            update_info(slot, HAND_READY, hz);
            informed = now;
        }
    }
    map_release(slot->map, &slot->state);
    map_publish(slot->map, &slot->state, slot->port);
    // also after a read failure: a device that is still connected must stop pushing
    force_stop(&slot->force, &shared->transport, slot->device);
    update_info(slot, HAND_LOST, 0);
    shared->transport.close(shared->transport.context, slot->device);
    slot->device = NULL;
    if (!is_there)
        hand_report(shared, "%s was unplugged: the tool stops; plug it in again to continue", slot->info.name);
    atomic_store(&slot->has_ended, true);
    return NULL;
}

static void take_line(void *context, const EncoderLine *line)
{
    HandSlot *slot = context;
    map_take_counts(slot->map, line->count, line->fresh, ENCODER_COUNTS, &slot->state);
}

void *hand_run_encoder(void *argument)
{
    HandSlot *slot = argument;
    HandShared *shared = slot->shared;
    int64_t counted_from = hand_now_us(), informed = 0, reports_then = slot->state.reports, bad_before = slot->state.bad_reports;
    bool is_there = true, has_reported_bad = false;
    double hz = 0;
    while (is_there && !atomic_load(&shared->quit)) {
        int64_t lines = slot->state.reports;
        is_there = usb_encoder_read(slot->encoder, &slot->map->serial, READ_WAIT_MS, take_line, slot) >= 0;
        const FtdiStream *stream = usb_encoder_stream(slot->encoder);
        int64_t now = hand_now_us();
        slot->state.bad_reports = bad_before + stream->bad_lines + stream->errors;
        if (slot->state.reports > lines)
            map_publish(slot->map, &slot->state, slot->port);
        if (!has_reported_bad && stream->bad_lines > 3 && stream->lines == 0) {
            hand_report(shared, "%s sends no lines of counts as described in its map; check serial: {baud, counts}", slot->info.name);
            has_reported_bad = true;
        }
        if (now - counted_from >= COUNT_RATE_US) {
            hz = 1e6 * (double)(slot->state.reports - reports_then) / (double)(now - counted_from);
            counted_from = now;
            reports_then = slot->state.reports;
        }
        if (now - informed >= INFO_US) {
            update_info(slot, HAND_READY, hz);
            informed = now;
        }
    }
    map_release(slot->map, &slot->state);
    map_publish(slot->map, &slot->state, slot->port);
    update_info(slot, HAND_LOST, 0);
    usb_encoder_close(slot->encoder);
    slot->encoder = NULL;
    if (!is_there)
        hand_report(shared, "%s was unplugged: the tool stops; plug it in again to continue", slot->info.name);
    atomic_store(&slot->has_ended, true);
    return NULL;
}
