// Simulated HID devices: a transport with queues, so that plugging, unplugging, floods and forces are tested with the real threads.
#ifndef SELDINGER_TESTS_FAKE_HID_H
#define SELDINGER_TESTS_FAKE_HID_H

#include "input/hid_device.h"

#include <pthread.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

enum { FAKE_DEVICES = 4, FAKE_QUEUE = 4096, FAKE_REPORT = 64, FAKE_WRITTEN = 20000 };

typedef struct FakeReport {
    int length;
    uint8_t bytes[FAKE_REPORT];
} FakeReport;

typedef struct FakeDevice {
    HidDeviceInfo info;
    const uint8_t *descriptor;
    int descriptor_length;
    bool is_plugged, is_open, may_not_open, is_gone, takes_no_writes;    // is_gone: was unplugged while it was open
    FakeReport queue[FAKE_QUEUE];
    long first, last;                // reports written and read so far
    FakeReport written[FAKE_WRITTEN];
    int64_t written_us[FAKE_WRITTEN];
    int written_count, features_sent;
    uint8_t last_feature[FAKE_REPORT];
    FakeReport feature_answer;       // the result of get_feature; its byte 1 grows by `feature_grows` with each feature report sent
    int feature_grows;
    int flood_hz;                    // > 0: produces reports without end
    FakeReport flood;
} FakeDevice;

typedef struct FakeHid {
    pthread_mutex_t lock;
    pthread_cond_t changed;
    FakeDevice device[FAKE_DEVICES];
} FakeHid;

static inline int64_t fake_now_us(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000000 + now.tv_nsec / 1000;
}

static inline void fake_sleep_us(long us) { nanosleep(&(struct timespec){.tv_sec = us / 1000000, .tv_nsec = us % 1000000 * 1000}, NULL); }

static inline int fake_list(void *context, HidDeviceInfo *out, int capacity)
{
    FakeHid *hid = context;
    int count = 0;
    pthread_mutex_lock(&hid->lock);
    for (int i = 0; i < FAKE_DEVICES && count < capacity; i++)
        if (hid->device[i].is_plugged)
            out[count++] = hid->device[i].info;
    pthread_mutex_unlock(&hid->lock);
    return count;
}

static inline FakeDevice *fake_at(FakeHid *hid, const char *path)
{
    for (int i = 0; i < FAKE_DEVICES; i++)
        if (hid->device[i].is_plugged && !strcmp(hid->device[i].info.path, path))
            return &hid->device[i];
    return NULL;
}

static inline void *fake_open(void *context, const char *path, char *why, size_t capacity)
{
    FakeHid *hid = context;
    pthread_mutex_lock(&hid->lock);
    FakeDevice *device = fake_at(hid, path);
    if (device && device->may_not_open)
        snprintf(why, capacity, "no permission"), device = NULL;
    if (device)
        device->is_open = true, device->is_gone = false;
    pthread_mutex_unlock(&hid->lock);
    return device;
}

static inline int fake_descriptor(void *context, const char *path, uint8_t *bytes, int capacity)
{
    FakeHid *hid = context;
    int length = -1;
    pthread_mutex_lock(&hid->lock);
    const FakeDevice *device = fake_at(hid, path);
    if (device && device->descriptor_length <= capacity) {
        length = device->descriptor_length;
        memcpy(bytes, device->descriptor, (size_t)length);
    }
    pthread_mutex_unlock(&hid->lock);
    return length;
}

static inline int fake_read(void *context, void *opened, uint8_t *bytes, int capacity, int timeout_ms)
{
    FakeHid *hid = context;
    FakeDevice *device = opened;
    int64_t until = fake_now_us() + 1000 * (int64_t)timeout_ms;
    struct timespec wake = {.tv_sec = until / 1000000, .tv_nsec = until % 1000000 * 1000};
    int length = 0;
    pthread_mutex_lock(&hid->lock);
    while (!device->is_gone && device->first == device->last && !device->flood_hz && timeout_ms > 0 &&
           pthread_cond_timedwait(&hid->changed, &hid->lock, &wake) == 0)
        continue;
    const FakeReport *report = device->flood_hz ? &device->flood : device->first < device->last ? &device->queue[device->first % FAKE_QUEUE] : NULL;
    if (device->is_gone) {
        length = -1;
    } else if (report) {
        length = report->length < capacity ? report->length : capacity;
        memcpy(bytes, report->bytes, (size_t)length);
        device->first += !device->flood_hz;
    }
    pthread_mutex_unlock(&hid->lock);
    return length;
}

static inline int fake_write(void *context, void *opened, const uint8_t *bytes, int length)
{
    FakeHid *hid = context;
    FakeDevice *device = opened;
    pthread_mutex_lock(&hid->lock);
    bool gone = device->is_gone || device->takes_no_writes;
    if (!gone && device->written_count < FAKE_WRITTEN && length <= FAKE_REPORT) {
        device->written[device->written_count].length = length;
        memcpy(device->written[device->written_count].bytes, bytes, (size_t)length);
        device->written_us[device->written_count++] = fake_now_us();
    }
    pthread_mutex_unlock(&hid->lock);
    return gone ? -1 : length;
}

static inline int fake_send_feature(void *context, void *opened, const uint8_t *bytes, int length)
{
    FakeHid *hid = context;
    FakeDevice *device = opened;
    pthread_mutex_lock(&hid->lock);
    device->features_sent++;
    device->feature_answer.bytes[1] = (uint8_t)(device->feature_answer.bytes[1] + device->feature_grows);
    memcpy(device->last_feature, bytes, (size_t)(length < FAKE_REPORT ? length : FAKE_REPORT));
    pthread_mutex_unlock(&hid->lock);
    return length;
}

static inline int fake_get_feature(void *context, void *opened, uint8_t *bytes, int capacity)
{
    FakeHid *hid = context;
    FakeDevice *device = opened;
    pthread_mutex_lock(&hid->lock);
    int length = device->feature_answer.length < capacity ? device->feature_answer.length : capacity;
    memcpy(bytes, device->feature_answer.bytes, (size_t)length);
    pthread_mutex_unlock(&hid->lock);
    return length > 0 ? length : -1;
}

static inline void fake_close(void *context, void *opened)
{
    FakeHid *hid = context;
    pthread_mutex_lock(&hid->lock);
    ((FakeDevice *)opened)->is_open = false;
    pthread_mutex_unlock(&hid->lock);
}

static inline HidTransport fake_transport(FakeHid *hid)
{
    pthread_condattr_t attributes;
    pthread_condattr_init(&attributes);
    pthread_condattr_setclock(&attributes, CLOCK_MONOTONIC);
    pthread_mutex_init(&hid->lock, NULL);
    pthread_cond_init(&hid->changed, &attributes);
    pthread_condattr_destroy(&attributes);
    return (HidTransport){.context = hid,
                          .list = fake_list,
                          .open = fake_open,
                          .descriptor = fake_descriptor,
                          .read = fake_read,
                          .write = fake_write,
                          .send_feature = fake_send_feature,
                          .get_feature = fake_get_feature,
                          .close = fake_close};
}

// Plugs in device `index`; its usages are those of `usage`.
static inline FakeDevice *fake_plug(FakeHid *hid, int index, int vendor, int product, const char *serial, uint32_t usage, const uint8_t *descriptor, int length)
{
    FakeDevice *device = &hid->device[index];
    pthread_mutex_lock(&hid->lock);
    device->info = (HidDeviceInfo){.vendor_id = (uint16_t)vendor, .product_id = (uint16_t)product, .interface_number = 0, .usage_count = 1, .usage = {usage}};
    snprintf(device->info.path, sizeof device->info.path, "/dev/fake%d", index);
    snprintf(device->info.serial, sizeof device->info.serial, "%s", serial);
    snprintf(device->info.product, sizeof device->info.product, "Fake %d", index);
    device->descriptor = descriptor;
    device->descriptor_length = length;
    device->first = device->last = 0;
    device->is_plugged = true;
    pthread_mutex_unlock(&hid->lock);
    return device;
}

static inline void fake_unplug(FakeHid *hid, int index)
{
    pthread_mutex_lock(&hid->lock);
    hid->device[index].is_plugged = false;
    hid->device[index].is_gone = true;
    pthread_cond_broadcast(&hid->changed);
    pthread_mutex_unlock(&hid->lock);
}

// Waits if the queue is full, as a polled device does.
static inline void fake_report(FakeHid *hid, int index, const uint8_t *bytes, int length)
{
    FakeDevice *device = &hid->device[index];
    pthread_mutex_lock(&hid->lock);
    while (device->last - device->first >= FAKE_QUEUE) {
        pthread_mutex_unlock(&hid->lock);
        fake_sleep_us(100);
        pthread_mutex_lock(&hid->lock);
    }
    FakeReport *report = &device->queue[device->last++ % FAKE_QUEUE];
    report->length = length;
    memcpy(report->bytes, bytes, (size_t)length);
    pthread_cond_broadcast(&hid->changed);
    pthread_mutex_unlock(&hid->lock);
}

#endif
