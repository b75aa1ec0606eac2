#include "input/hand.h"

#include "input/force_feedback.h"
#include "input/hid_report.h"
#include "input/map_state.h"

#include <pthread.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { MESSAGES_KEPT = 32, MESSAGE_LENGTH = 400, DEVICES_LISTED = 64, MOST_MAPS = 16 };
enum { READ_WAIT_MS = 50, FORCE_WAIT_MS = 1, DRAIN_MOST = 512, INFO_US = 50000, COUNT_RATE_US = 1000000 };

// One port and the device that drives it now or did before.
typedef struct Slot {
    Hands *hands;
    HandPort port;
    bool is_used;                    // has had a device
    HidDeviceInfo identity;
    const DeviceMap *map;
    HidDescriptor *descriptor;
    MapState state;
    ForceFeedback force;
    void *device;                    // while the thread runs
    pthread_t thread;
    bool has_thread;
    _Atomic bool has_ended;          // the device went; the scanner joins the thread
    HandInfo info;                   // under the lock
} Slot;

// A device that cannot be used: told once, forgotten when it is unplugged.
typedef struct Refusal {
    HidDeviceInfo device;
    int attempts;
    bool is_listed;
} Refusal;

struct Hands {
    HidTransport transport;
    HidTransport *own_transport;
    DeviceMap *map[MOST_MAPS], *built_in[BUILT_IN_COUNT];
    int map_count, rescan_ms;
    bool use_built_in;
    Slot slot[HANDS_MOST];
    Refusal refusal[DEVICES_LISTED];
    HidDeviceInfo listed[DEVICES_LISTED];
    pthread_mutex_t lock;            // info and messages
    pthread_cond_t wake;
    pthread_t scanner;
    bool has_scanner;
    _Atomic bool quit, paused;
    char message[MESSAGES_KEPT][MESSAGE_LENGTH];
    int message_first, message_count;
};

static int64_t now_us(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000000 + now.tv_nsec / 1000;
}

static void say(Hands *hands, const char *format, ...) __attribute__((format(printf, 2, 3)));
static void say(Hands *hands, const char *format, ...)
{
    va_list arguments;
    pthread_mutex_lock(&hands->lock);
    if (hands->message_count == MESSAGES_KEPT) {    // the oldest gives way
        hands->message_first = (hands->message_first + 1) % MESSAGES_KEPT;
        hands->message_count--;
    }
    char *text = hands->message[(hands->message_first + hands->message_count++) % MESSAGES_KEPT];
    va_start(arguments, format);
    vsnprintf(text, MESSAGE_LENGTH, format, arguments);
    va_end(arguments);
    pthread_mutex_unlock(&hands->lock);
}

// --- one device's thread ---

static void update_info(Slot *slot, HandState state, double report_hz)
{
    atomic_store(&slot->port.state, state);
    pthread_mutex_lock(&slot->hands->lock);
    slot->info.state = state;
    slot->info.reports = slot->state.reports;
    slot->info.bad_reports = slot->state.bad_reports;
    slot->info.report_hz = report_hz;
    slot->info.force_n = state == HAND_READY ? slot->force.guard.sent[0] : 0;
    pthread_mutex_unlock(&slot->hands->lock);
}

// All that has come, at most DRAIN_MOST reports, so that a flood cannot keep the thread from its other work. How many; -1: the device is gone.
static int drain(Slot *slot, int wait_ms)
{
    const HidTransport *transport = &slot->hands->transport;
    uint8_t bytes[HID_REPORT_BYTES];
    int count = 0, length = transport->read(transport->context, slot->device, bytes, (int)sizeof bytes, wait_ms);
    while (length > 0) {
        map_take_report(slot->map, slot->descriptor, bytes, (size_t)length, &slot->state);
        if (++count == DRAIN_MOST)
            break;
        length = transport->read(transport->context, slot->device, bytes, (int)sizeof bytes, 0);
    }
    if (count > 0)
        map_publish(slot->map, &slot->state, &slot->port);
    return length < 0 ? -1 : count;
}

static void start_force(Slot *slot)
{
    Hands *hands = slot->hands;
    bool plays = force_start(&slot->force, slot->map, slot->descriptor, &hands->transport, slot->device, now_us());
    pthread_mutex_lock(&hands->lock);
    snprintf(slot->info.force, sizeof slot->info.force, "%s", slot->force.text);
    pthread_mutex_unlock(&hands->lock);
    if (slot->map->force.is_wanted && !plays)
        say(hands, "%s: force: %s", slot->info.name, slot->force.text);
}

// A force that the watchdog took away is told, once each time.
static void tell_watchdog(Slot *slot, double sent_before)
{
    const char *why = slot->force.guard.why_zero;
    if (sent_before != 0 && slot->force.guard.sent[0] == 0 && why && why[0] && strcmp(why, "paused") != 0)
        say(slot->hands, "%s: force to zero, %s%s", slot->info.name, why,
            strstr(why, "silent") ? " (force: {quiet_ms: 0} in its map where it reports only changes)" : "");
}

static void *run_device(void *argument)
{
    Slot *slot = argument;
    Hands *hands = slot->hands;
    int64_t report_us = now_us(), counted_from = report_us, informed = 0, reports_then = slot->state.reports;
    bool is_there = true, has_told_bad = slot->state.bad_reports > 0;
    double hz = 0;
    start_force(slot);
    int wait_ms = slot->force.block[0] ? FORCE_WAIT_MS : READ_WAIT_MS;
    while (is_there && !atomic_load(&hands->quit)) {
        int count = drain(slot, wait_ms);
        int64_t now = now_us();
        double sent_before = slot->force.guard.sent[0];
        is_there = count >= 0;
        report_us = count > 0 ? now : report_us;
        if (is_there)
            force_tick(&slot->force, &slot->port, now, report_us, atomic_load(&hands->paused), &hands->transport, slot->device);
        tell_watchdog(slot, sent_before);
        if (now - counted_from >= COUNT_RATE_US) {
            hz = 1e6 * (double)(slot->state.reports - reports_then) / (double)(now - counted_from);
            counted_from = now;
            reports_then = slot->state.reports;
        }
        if (!has_told_bad && slot->state.bad_reports > 0) {
            say(hands, "%s sends reports that its descriptor does not describe (too short or of unknown id); they are left out", slot->info.name);
            has_told_bad = true;
        }
        if (now - informed >= INFO_US) {
            update_info(slot, HAND_READY, hz);
            informed = now;
        }
    }
    map_release(slot->map, &slot->state);
    map_publish(slot->map, &slot->state, &slot->port);
    if (is_there)
        force_stop(&slot->force, &hands->transport, slot->device);
    update_info(slot, HAND_LOST, 0);
    hands->transport.close(hands->transport.context, slot->device);
    slot->device = NULL;
    if (!is_there)
        say(hands, "%s was unplugged: the tool stops; plug it in again to go on", slot->info.name);
    atomic_store(&slot->has_ended, true);
    return NULL;
}

// --- looking for devices ---

static bool same_device(const HidDeviceInfo *a, const HidDeviceInfo *b)
{
    return a->vendor_id == b->vendor_id && a->product_id == b->product_id && a->interface_number == b->interface_number && !strcmp(a->serial, b->serial);
}

static bool has_usage(const HidDeviceInfo *device, uint32_t usage)
{
    for (int i = 0; i < device->usage_count; i++)
        if (device->usage[i] == usage)
            return true;
    return false;
}

static bool map_fits(const DeviceMap *map, const HidDeviceInfo *device)
{
    const MapDevice *wanted = &map->device;
    return wanted->kind == MAP_HID && (wanted->vendor_id < 0 || wanted->vendor_id == device->vendor_id) &&
           (wanted->product_id < 0 || wanted->product_id == device->product_id) && (!wanted->serial[0] || !strcmp(wanted->serial, device->serial)) &&
           (!wanted->usage || has_usage(device, wanted->usage));
}

const DeviceMap *hands_choose_map(const DeviceMap *const *map, int count, const HidDeviceInfo *device)
{
    for (int i = 0; i < count; i++)
        if (map[i] && map_fits(map[i], device))
            return map[i];
    return NULL;
}

static const DeviceMap *choose_map(const Hands *hands, const HidDeviceInfo *device)
{
    const DeviceMap *map = hands_choose_map((const DeviceMap *const *)hands->map, hands->map_count, device);
    return map || !hands->use_built_in ? map : hands_choose_map((const DeviceMap *const *)hands->built_in, BUILT_IN_COUNT, device);
}

static void device_name(const HidDeviceInfo *device, char *out, size_t capacity)
{
    if (device->product[0])
        snprintf(out, capacity, "%s", device->product);
    else
        snprintf(out, capacity, "device %04x:%04x", device->vendor_id, device->product_id);
}

// The refusal of this device, a new one where there is none yet; NULL where too many are kept.
static Refusal *refusal_of(Hands *hands, const HidDeviceInfo *device)
{
    Refusal *free_one = NULL;
    for (int i = 0; i < DEVICES_LISTED; i++) {
        Refusal *refusal = &hands->refusal[i];
        if (refusal->attempts > 0 && !strcmp(refusal->device.path, device->path) && same_device(&refusal->device, device))
            return refusal;
        if (refusal->attempts == 0 && !free_one)
            free_one = refusal;
    }
    if (free_one)
        *free_one = (Refusal){.device = *device};
    return free_one;
}

static HidDescriptor *read_descriptor(const Hands *hands, const HidDeviceInfo *device, const char *name, Faults *faults)
{
    uint8_t bytes[HID_DESCRIPTOR_LIMIT];
    int length = hands->transport.descriptor(hands->transport.context, device->path, bytes, (int)sizeof bytes);
    if (length <= 0) {
        faults_add(faults, name, 0, 0, "its report descriptor cannot be read");
        return NULL;
    }
    return hid_descriptor_parse(bytes, (size_t)length, name, faults);
}

// A slot for the device: the one it had, else a fresh one; NULL where all are taken.
static Slot *slot_for(Hands *hands, const HidDeviceInfo *device)
{
    for (int i = 0; i < HANDS_MOST; i++) {
        Slot *slot = &hands->slot[i];
        if (slot->is_used && !slot->has_thread && same_device(&slot->identity, device))
            return slot;
    }
    for (int i = 0; i < HANDS_MOST; i++)
        if (!hands->slot[i].is_used)
            return &hands->slot[i];
    return NULL;
}

// Opens a device and starts its thread. False with a fault where that cannot be.
static bool connect_device(Hands *hands, const HidDeviceInfo *device, const DeviceMap *map, Faults *faults)
{
    char name[96], why[320] = "";
    MapState state;
    device_name(device, name, sizeof name);
    Slot *slot = slot_for(hands, device);
    if (!slot) {
        faults_add(faults, name, 0, 0, "at most %d devices drive the tool", HANDS_MOST);
        return false;
    }
    HidDescriptor *descriptor = read_descriptor(hands, device, name, faults);
    if (descriptor && map == hands->built_in[BUILT_IN_HID_JOYSTICK] && pid_is_haptic(descriptor))
        map = hands->built_in[BUILT_IN_HID_HAPTIC];
    if (!descriptor || !map_bind_hid(map, descriptor, name, &state, faults)) {
        free(descriptor);
        return false;
    }
    void *opened = hands->transport.open(hands->transport.context, device->path, why, sizeof why);
    if (!opened) {
        faults_add(faults, name, 0, 0, "%s", why);
        free(descriptor);
        return false;
    }
    bool is_back = slot->is_used;
    if (is_back) {    // ways and numbers go on
        memcpy(state.axis_state, slot->state.axis_state, sizeof state.axis_state);
        state.reports = slot->state.reports;
        state.bad_reports = slot->state.bad_reports;
    }
    free(slot->descriptor);
    slot->descriptor = descriptor;
    slot->state = state;
    slot->identity = *device;
    slot->map = map;
    slot->device = opened;
    slot->is_used = true;
    atomic_store(&slot->has_ended, false);
    pthread_mutex_lock(&hands->lock);
    snprintf(slot->info.name, sizeof slot->info.name, "%s", name);
    snprintf(slot->info.map, sizeof slot->info.map, "%s", map->name);
    pthread_mutex_unlock(&hands->lock);
    slot->has_thread = pthread_create(&slot->thread, NULL, run_device, slot) == 0;
    if (!slot->has_thread) {
        hands->transport.close(hands->transport.context, opened);
        faults_add(faults, name, 0, 0, "no thread for it");
        return false;
    }
    say(hands, is_back ? "%s is back (map '%s')" : "%s drives the tool (map '%s')", name, map->name);
    return true;
}

static bool is_connected(const Hands *hands, const HidDeviceInfo *device)
{
    for (int i = 0; i < HANDS_MOST; i++)
        if (hands->slot[i].has_thread && !strcmp(hands->slot[i].identity.path, device->path))
            return true;
    return false;
}

static void try_device(Hands *hands, const HidDeviceInfo *device)
{
    const DeviceMap *map = is_connected(hands, device) ? NULL : choose_map(hands, device);
    if (!map)
        return;
    Faults faults;
    faults_clear(&faults);
    if (connect_device(hands, device, map, &faults))
        return;
    // permissions come a moment after the device: it is tried at each look and told at the second
    Refusal *refusal = refusal_of(hands, device);
    if (!refusal)
        return;
    refusal->is_listed = true;
    if (++refusal->attempts == 2)
        for (int i = 0; i < faults.count && i < 4; i++)
            say(hands, "not used: %s", faults.text[i]);
    else if (refusal->attempts > 1000)
        refusal->attempts = 3;
}

static void look_for_devices(Hands *hands)
{
    for (int i = 0; i < HANDS_MOST; i++) {
        Slot *slot = &hands->slot[i];
        if (slot->has_thread && atomic_load(&slot->has_ended)) {
            pthread_join(slot->thread, NULL);
            slot->has_thread = false;
        }
    }
    int count = hands->transport.list(hands->transport.context, hands->listed, DEVICES_LISTED);
    for (int i = 0; i < DEVICES_LISTED; i++)
        hands->refusal[i].is_listed = false;
    for (int i = 0; i < count; i++)
        try_device(hands, &hands->listed[i]);
    for (int i = 0; i < DEVICES_LISTED; i++)
        if (!hands->refusal[i].is_listed)
            hands->refusal[i].attempts = 0;
}

static void *run_scanner(void *argument)
{
    Hands *hands = argument;
    while (!atomic_load(&hands->quit)) {
        look_for_devices(hands);
        int64_t wake = now_us() + 1000 * (int64_t)hands->rescan_ms;
        struct timespec until = {.tv_sec = wake / 1000000, .tv_nsec = wake % 1000000 * 1000};
        pthread_mutex_lock(&hands->lock);
        while (!atomic_load(&hands->quit) && pthread_cond_timedwait(&hands->wake, &hands->lock, &until) == 0)
            continue;
        pthread_mutex_unlock(&hands->lock);
    }
    return NULL;
}

// --- the session ---

HandsOptions hands_default_options(void) { return (HandsOptions){.use_built_in = true, .use_usb = true, .rescan_ms = 500}; }

static bool copy_maps(Hands *hands, const HandsOptions *options)
{
    for (int i = 0; i < options->map_count && i < MOST_MAPS; i++) {
        hands->map[i] = malloc(sizeof(DeviceMap));
        if (!hands->map[i])
            return false;
        *hands->map[i] = *options->map[i];
        hands->map_count = i + 1;
    }
    for (int i = 0; i < BUILT_IN_COUNT; i++)
        if (!(hands->built_in[i] = device_map_built_in((BuiltInMap)i)))
            return false;
    return true;
}

Hands *hands_open(const HandsOptions *options, Faults *faults)
{
    Hands *hands = calloc(1, sizeof *hands);
    pthread_condattr_t attributes;
    if (!hands) {
        faults_add(faults, "devices", 0, 0, "no memory");
        return NULL;
    }
    // waits must not depend on the wall clock being set
    pthread_condattr_init(&attributes);
    pthread_condattr_setclock(&attributes, CLOCK_MONOTONIC);
    pthread_mutex_init(&hands->lock, NULL);
    pthread_cond_init(&hands->wake, &attributes);
    pthread_condattr_destroy(&attributes);
    hands->rescan_ms = options->rescan_ms > 0 ? options->rescan_ms : 500;
    hands->use_built_in = options->use_built_in;
    for (int i = 0; i < HANDS_MOST; i++)
        hands->slot[i].hands = hands;
    if (!options->transport)
        hands->own_transport = hid_transport_hidapi();
    const HidTransport *transport = options->transport ? options->transport : hands->own_transport;
    if (transport)
        hands->transport = *transport;
    hands->has_scanner = transport && copy_maps(hands, options) && pthread_create(&hands->scanner, NULL, run_scanner, hands) == 0;
    if (!hands->has_scanner) {
        faults_add(faults, "devices", 0, 0, "%s", transport ? "no memory or no thread to look for them" : "hidapi cannot be started");
        hands_close(hands);
        return NULL;
    }
    return hands;
}

void hands_close(Hands *hands)
{
    if (!hands)
        return;
    pthread_mutex_lock(&hands->lock);
    atomic_store(&hands->quit, true);
    pthread_cond_broadcast(&hands->wake);
    pthread_mutex_unlock(&hands->lock);
    if (hands->has_scanner)
        pthread_join(hands->scanner, NULL);
    for (int i = 0; i < HANDS_MOST; i++) {
        if (hands->slot[i].has_thread)
            pthread_join(hands->slot[i].thread, NULL);
        free(hands->slot[i].descriptor);
    }
    for (int i = 0; i < MOST_MAPS; i++)
        free(hands->map[i]);
    for (int i = 0; i < BUILT_IN_COUNT; i++)
        free(hands->built_in[i]);
    hid_transport_hidapi_free(hands->own_transport);
    pthread_cond_destroy(&hands->wake);
    pthread_mutex_destroy(&hands->lock);
    free(hands);
}

HandPort *hands_port(Hands *hands, int index) { return index >= 0 && index < HANDS_MOST ? &hands->slot[index].port : NULL; }

void hands_pause(Hands *hands, bool paused) { atomic_store(&hands->paused, paused); }

void hands_info(Hands *hands, int index, HandInfo *info)
{
    *info = (HandInfo){.state = HAND_ABSENT};
    if (index < 0 || index >= HANDS_MOST)
        return;
    pthread_mutex_lock(&hands->lock);
    *info = hands->slot[index].info;
    pthread_mutex_unlock(&hands->lock);
}

bool hands_message(Hands *hands, char *text, size_t capacity)
{
    pthread_mutex_lock(&hands->lock);
    bool any = hands->message_count > 0;
    if (any) {
        snprintf(text, capacity, "%s", hands->message[hands->message_first]);
        hands->message_first = (hands->message_first + 1) % MESSAGES_KEPT;
        hands->message_count--;
    }
    pthread_mutex_unlock(&hands->lock);
    return any;
}
