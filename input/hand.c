#include "input/hand.h"

#include "input/hand_slot.h"

#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { DEVICES_LISTED = 64, MOST_MAPS = 16 };

// A device that cannot be used: reported once, and forgotten when unplugged.
typedef struct Refusal {
    HidDeviceInfo device;
    int attempts;
    bool is_listed;
} Refusal;

struct Hands {
    HandShared shared;
    HidTransport *own_transport;
    UsbContext *usb;
    bool has_reported_usb;
    DeviceMap *map[MOST_MAPS], *built_in[BUILT_IN_COUNT];
    int map_count, rescan_ms;
    bool use_built_in, use_usb;
    HandSlot slot[HANDS_MOST];
    Refusal refusal[DEVICES_LISTED];
    HidDeviceInfo listed[DEVICES_LISTED];
    pthread_t scanner;
    bool has_scanner;
};

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

// The refusal of this device, added if there is none yet; NULL if too many are stored.
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
    int length = hands->shared.transport.descriptor(hands->shared.transport.context, device->path, bytes, (int)sizeof bytes);
    if (length <= 0) {
        faults_add(faults, name, 0, 0, "its report descriptor cannot be read");
        return NULL;
    }
    return hid_descriptor_parse(bytes, (size_t)length, name, faults);
}

// A slot for the device: its previous one, else a free one; NULL if all are in use.
static HandSlot *slot_for(Hands *hands, const HidDeviceInfo *device)
{
    for (int i = 0; i < HANDS_MOST; i++) {
        HandSlot *slot = &hands->slot[i];
        if (slot->is_used && !slot->has_thread && same_device(&slot->identity, device))
            return slot;
    }
    for (int i = 0; i < HANDS_MOST; i++)
        if (!hands->slot[i].is_used)
            return &hands->slot[i];
    return NULL;
}

// Keeps the displacements of the slot if the device has returned with the same map, and starts a thread. Returns false with a fault if no thread can be
// started.
static bool start_slot(HandSlot *slot, const HidDeviceInfo *device, const DeviceMap *map, const MapState *fresh, const char *name, Faults *faults)
{
    HandShared *shared = slot->shared;
    bool is_back = slot->is_used;
    MapState state = *fresh;
    if (is_back && slot->map == map) {
        memcpy(state.axis_state, slot->state.axis_state, sizeof state.axis_state);
        state.reports = slot->state.reports;
        state.bad_reports = slot->state.bad_reports;
    }
    slot->state = state;
    slot->identity = *device;
    slot->map = map;
    slot->is_used = true;
    map_publish(map, &slot->state, slot->port);      // sets the tool for force feedback before the first report
    atomic_store(&slot->has_ended, false);
    pthread_mutex_lock(&shared->lock);
    snprintf(slot->info.name, sizeof slot->info.name, "%s", name);
    snprintf(slot->info.map, sizeof slot->info.map, "%s", map->name);
    slot->info.hand_count = map->hand_count;
    slot->info.vendor_id = device->vendor_id;
    slot->info.product_id = device->product_id;
    pthread_mutex_unlock(&shared->lock);
    slot->encoder_runs = slot->encoder != NULL;
    slot->has_thread = pthread_create(&slot->thread, NULL, slot->encoder ? hand_run_encoder : hand_run_hid, slot) == 0;
    if (slot->has_thread)
        hand_report(shared, is_back ? "%s is back (map '%s')" : "%s drives the tool (map '%s')", name, map->name);
    else
        faults_add(faults, name, 0, 0, "cannot start a thread for it");
    return slot->has_thread;
}

static bool connect_hid(Hands *hands, HandSlot *slot, const HidDeviceInfo *device, const DeviceMap *map, const char *name, Faults *faults)
{
    const HidTransport *transport = &hands->shared.transport;
    char why[320] = "";
    MapState state;
    HidDescriptor *descriptor = read_descriptor(hands, device, name, faults);
    if (descriptor && map == hands->built_in[BUILT_IN_HID_JOYSTICK] && pid_is_haptic(descriptor))
        map = hands->built_in[BUILT_IN_HID_HAPTIC];
    if (!descriptor || !map_bind_hid(map, descriptor, name, &state, faults)) {
        free(descriptor);
        return false;
    }
    void *opened = transport->open(transport->context, device->path, why, sizeof why);
    if (!opened) {
        faults_add(faults, name, 0, 0, "%s", why);
        free(descriptor);
        return false;
    }
    free(slot->descriptor);
    slot->descriptor = descriptor;
    slot->device = opened;
    if (start_slot(slot, device, map, &state, name, faults))
        return true;
    transport->close(transport->context, opened);
    slot->device = NULL;
    return false;
}

static bool connect_encoder(Hands *hands, HandSlot *slot, const HidDeviceInfo *device, const DeviceMap *map, const char *name, Faults *faults)
{
    char why[320] = "";
    MapState state;
    if (!map_bind_plain(map, map->serial.count_count, 0, name, &state, faults))
        return false;
    slot->encoder = usb_encoder_open(hands->usb, device->path, &map->serial, why, sizeof why);
    if (!slot->encoder) {
        faults_add(faults, name, 0, 0, "%s", why);
        return false;
    }
    if (start_slot(slot, device, map, &state, name, faults))
        return true;
    usb_encoder_close(slot->encoder);
    slot->encoder = NULL;
    return false;
}

static bool is_connected(const Hands *hands, const HidDeviceInfo *device)
{
    for (int i = 0; i < HANDS_MOST; i++)
        if (hands->slot[i].has_thread && !strcmp(hands->slot[i].identity.path, device->path))
            return true;
    return false;
}

static void report_refusal(Hands *hands, const HidDeviceInfo *device, const Faults *faults)
{
    Refusal *refusal = refusal_of(hands, device);
    if (!refusal)
        return;
    refusal->is_listed = true;
    refusal->attempts += refusal->attempts < 3;
    // udev sets permissions shortly after the device appears: retry at each scan, report at the second
    for (int i = 0; refusal->attempts == 2 && i < faults->count && i < 4; i++)
        hand_report(&hands->shared, "not used: %s", faults->text[i]);
}

static void try_device(Hands *hands, const HidDeviceInfo *device, const DeviceMap *map, bool is_encoder)
{
    if (!map || is_connected(hands, device))
        return;
    Faults faults;
    char name[96];
    faults_clear(&faults);
    device_name(device, name, sizeof name);
    HandSlot *slot = slot_for(hands, device);
    if (!slot)
        faults_add(&faults, name, 0, 0, "is not used: at most %d devices can drive the tools", HANDS_MOST);
    else if (is_encoder ? connect_encoder(hands, slot, device, map, name, &faults) : connect_hid(hands, slot, device, map, name, &faults))
        return;
    report_refusal(hands, device, &faults);
}

static const DeviceMap *encoder_map(const Hands *hands, const UsbDeviceInfo *device)
{
    for (int i = 0; i < hands->map_count; i++)
        if (usb_encoder_fits(hands->map[i], device))
            return hands->map[i];
    return NULL;
}

static void look_for_encoders(Hands *hands)
{
    UsbDeviceInfo found[HANDS_MOST * 2];
    bool is_wanted = false, is_one_open = false;
    for (int i = 0; i < hands->map_count; i++)
        is_wanted |= hands->map[i]->device.kind == MAP_FTDI;
    if (!hands->use_usb || !is_wanted)
        return;
    // libusb learns of new devices from udevd; without udevd (in a container) only a new libusb context sees them, which requires all devices to be closed
    for (int i = 0; i < HANDS_MOST; i++)
        is_one_open |= hands->slot[i].has_thread && hands->slot[i].encoder_runs;
    if (!is_one_open) {
        usb_context_close(hands->usb);
        hands->usb = usb_context_open();
    }
    if (!hands->usb && !hands->has_reported_usb)
        hand_report(&hands->shared, "USB encoders cannot be used: libusb does not start");
    hands->has_reported_usb |= !hands->usb;
    int count = hands->usb ? usb_encoder_list(hands->usb, found, HANDS_MOST * 2) : 0;
    for (int i = 0; i < count; i++) {
        HidDeviceInfo device = {.vendor_id = found[i].vendor_id, .product_id = found[i].product_id, .interface_number = -1};
        snprintf(device.path, sizeof device.path, "%.31s", found[i].path);
        snprintf(device.serial, sizeof device.serial, "%.63s", found[i].serial);
        snprintf(device.product, sizeof device.product, "%.95s", found[i].product);
        try_device(hands, &device, encoder_map(hands, &found[i]), true);
    }
}

static void look_for_devices(Hands *hands)
{
    for (int i = 0; i < HANDS_MOST; i++) {
        HandSlot *slot = &hands->slot[i];
        if (slot->has_thread && atomic_load(&slot->has_ended)) {
            pthread_join(slot->thread, NULL);
            slot->has_thread = false;
        }
    }
    for (int i = 0; i < DEVICES_LISTED; i++)
        hands->refusal[i].is_listed = false;
    int count = hands->shared.transport.list(hands->shared.transport.context, hands->listed, DEVICES_LISTED);
    for (int i = 0; i < count; i++)
        try_device(hands, &hands->listed[i], choose_map(hands, &hands->listed[i]), false);
    look_for_encoders(hands);
    for (int i = 0; i < DEVICES_LISTED; i++)
        if (!hands->refusal[i].is_listed)
            hands->refusal[i].attempts = 0;
}

static void *run_scanner(void *argument)
{
    Hands *hands = argument;
    while (!atomic_load(&hands->shared.quit)) {
        look_for_devices(hands);
        int64_t wake = hand_now_us() + 1000 * (int64_t)hands->rescan_ms;
        struct timespec until = {.tv_sec = wake / 1000000, .tv_nsec = wake % 1000000 * 1000};
        pthread_mutex_lock(&hands->shared.lock);
        while (!atomic_load(&hands->shared.quit) && pthread_cond_timedwait(&hands->shared.wake, &hands->shared.lock, &until) == 0)
            continue;
        pthread_mutex_unlock(&hands->shared.lock);
    }
    return NULL;
}

// --- the session ---

HandsOptions hands_default_options(void) { return (HandsOptions){.use_built_in = true, .push = 1, .twist = 1, .use_usb = true, .rescan_ms = 500}; }

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
        if ((hands->built_in[i] = device_map_built_in((BuiltInMap)i)))
            device_map_scale(hands->built_in[i], options->push, options->twist);
        else
            return false;
    return true;
}

// The threads block all signals, because a signal delivered to a device thread would look like an unplugged device.
static bool start_scanner(Hands *hands)
{
    sigset_t all, before;
    sigfillset(&all);
    pthread_sigmask(SIG_BLOCK, &all, &before);
    bool good = pthread_create(&hands->scanner, NULL, run_scanner, hands) == 0;
    pthread_sigmask(SIG_SETMASK, &before, NULL);
    return good;
}

Hands *hands_open(const HandsOptions *options, Faults *faults)
{
    Hands *hands = calloc(1, sizeof *hands);
    pthread_condattr_t attributes;
    if (!hands) {
        faults_add(faults, "devices", 0, 0, "out of memory");
        return NULL;
    }
    // the monotonic clock: waits must not depend on changes of the wall clock
    pthread_condattr_init(&attributes);
    pthread_condattr_setclock(&attributes, CLOCK_MONOTONIC);
    pthread_mutex_init(&hands->shared.lock, NULL);
    pthread_cond_init(&hands->shared.wake, &attributes);
    pthread_condattr_destroy(&attributes);
    hands->rescan_ms = options->rescan_ms > 0 ? options->rescan_ms : 500;
    hands->use_built_in = options->use_built_in;
    hands->use_usb = options->use_usb;
    for (int i = 0; i < HANDS_MOST; i++)
        hands->slot[i].shared = &hands->shared;
    if (!options->transport)
        hands->own_transport = hid_transport_hidapi();
    const HidTransport *transport = options->transport ? options->transport : hands->own_transport;
    if (transport)
        hands->shared.transport = *transport;
    hands->has_scanner = transport && copy_maps(hands, options) && start_scanner(hands);
    if (!hands->has_scanner) {
        faults_add(faults, "devices", 0, 0, "%s", transport ? "out of memory, or cannot start a thread" : "hidapi cannot be started");
        hands_close(hands);
        return NULL;
    }
    return hands;
}

void hands_close(Hands *hands)
{
    if (!hands)
        return;
    pthread_mutex_lock(&hands->shared.lock);
    atomic_store(&hands->shared.quit, true);
    pthread_cond_broadcast(&hands->shared.wake);
    pthread_mutex_unlock(&hands->shared.lock);
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
    usb_context_close(hands->usb);
    pthread_cond_destroy(&hands->shared.wake);
    pthread_mutex_destroy(&hands->shared.lock);
    free(hands);
}

HandPort *hands_port(Hands *hands, int index) { return index >= 0 && index < HANDS_MOST ? hands->slot[index].port : NULL; }

void hands_pause(Hands *hands, bool paused) { atomic_store(&hands->shared.paused, paused); }

void hands_info(Hands *hands, int index, HandInfo *info)
{
    *info = (HandInfo){.state = HAND_ABSENT};
    if (index < 0 || index >= HANDS_MOST)
        return;
    pthread_mutex_lock(&hands->shared.lock);
    *info = hands->slot[index].info;
    pthread_mutex_unlock(&hands->shared.lock);
}

bool hands_drives(Hands *hands, int vendor_id, int product_id)
{
    bool drives = false;
    pthread_mutex_lock(&hands->shared.lock);
    for (int i = 0; i < HANDS_MOST; i++) {
        const HandInfo *info = &hands->slot[i].info;
        drives |= info->state != HAND_ABSENT && info->vendor_id == vendor_id && info->product_id == product_id;
    }
    pthread_mutex_unlock(&hands->shared.lock);
    return drives;
}

bool hands_message(Hands *hands, char *text, size_t capacity)
{
    pthread_mutex_lock(&hands->shared.lock);
    bool any = hands->shared.message_count > 0;
    if (any) {
        snprintf(text, capacity, "%s", hands->shared.message[hands->shared.message_first]);
        hands->shared.message_first = (hands->shared.message_first + 1) % MESSAGES_KEPT;
        hands->shared.message_count--;
    }
    pthread_mutex_unlock(&hands->shared.lock);
    return any;
}
