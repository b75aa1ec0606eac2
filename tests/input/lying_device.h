// A simulated SideWinder Force Feedback 2 with its own clock that plays what it accepts and may report false results: for tests and for the fuzz target.
#ifndef SELDINGER_TESTS_LYING_DEVICE_H
#define SELDINGER_TESTS_LYING_DEVICE_H

#include "input/force_feedback.h"

#include <stdlib.h>
#include <string.h>

// What happens to a report: accepted; refused; accepted but reported as refused; only its first byte was sent.
typedef enum DeviceAnswer { ANSWER_TAKES, ANSWER_REFUSES, ANSWER_TAKES_AND_DENIES, ANSWER_SHORT } DeviceAnswer;
enum { LYING_BLOCKS = 4, LYING_LOG = 8192 };
enum { REPORT_EFFECT = 1, REPORT_FORCE = 5, REPORT_OPERATION = 10, REPORT_CONTROL = 12 };    // its report ids
enum { OPERATION_START = 1, OPERATION_STOP = 3, CONTROL_STOP_ALL = 3, CONTROL_RESET = 4 };

typedef struct LyingReport {
    uint8_t bytes[PID_MESSAGE_BYTES];
    int length;
    bool is_said_taken;
} LyingReport;

typedef struct LyingDevice {
    int64_t now_us;
    DeviceAnswer (*answer)(void *context);    // NULL: accepts all
    void *answer_context;
    int magnitude[LYING_BLOCKS];
    bool plays[LYING_BLOCKS];
    int64_t ends_us[LYING_BLOCKS], duration_us[LYING_BLOCKS];
    int blocks;                               // assigned
    LyingReport log[LYING_LOG];
    int log_count;
} LyingDevice;

static inline int lying_block(const uint8_t *bytes) { return bytes[1] < LYING_BLOCKS ? bytes[1] : 0; }

static inline void lying_take(LyingDevice *device, const uint8_t *bytes)
{
    int block = lying_block(bytes);
    if (bytes[0] == REPORT_EFFECT) {
        device->duration_us[block] = 1000 * (int64_t)(bytes[3] | bytes[4] << 8);
    } else if (bytes[0] == REPORT_FORCE) {
        device->magnitude[block] = (int16_t)(bytes[2] | bytes[3] << 8);
    } else if (bytes[0] == REPORT_OPERATION) {
        device->plays[block] = bytes[2] == OPERATION_START;
        device->ends_us[block] = device->now_us + device->duration_us[block];
    } else if (bytes[0] == REPORT_CONTROL && (bytes[1] == CONTROL_STOP_ALL || bytes[1] == CONTROL_RESET)) {
        memset(device->plays, 0, sizeof device->plays);
    }
}

static inline int lying_write(void *context, void *opened, const uint8_t *bytes, int length)
{
    (void)context;
    LyingDevice *device = opened;
    DeviceAnswer answer = device->answer ? device->answer(device->answer_context) : ANSWER_TAKES;
    if (device->log_count < LYING_LOG) {
        LyingReport *report = &device->log[device->log_count++];
        report->length = length;
        report->is_said_taken = answer == ANSWER_TAKES;
        memcpy(report->bytes, bytes, (size_t)length);
    }
    if (answer == ANSWER_TAKES || answer == ANSWER_TAKES_AND_DENIES)
        lying_take(device, bytes);
    return answer == ANSWER_TAKES ? length : answer == ANSWER_SHORT ? 1 : -1;
}

static inline int lying_send_feature(void *context, void *opened, const uint8_t *bytes, int length)
{
    (void)context;
    LyingDevice *device = opened;
    if (bytes[0] == 1 && device->blocks + 1 < LYING_BLOCKS)    // Create New Effect
        device->blocks++;
    return length;
}

static inline int lying_get_feature(void *context, void *opened, uint8_t *bytes, int capacity)
{
    (void)context;
    const LyingDevice *device = opened;
    if (bytes[0] != 2 || capacity < 5)
        return -1;
    memcpy(bytes, (const uint8_t[]){2, (uint8_t)device->blocks, 1, 0, 1}, 5);    // Block Load: the effect's number, success
    return 5;
}

static inline HidTransport lying_transport(void)
{
    return (HidTransport){.write = lying_write, .send_feature = lying_send_feature, .get_feature = lying_get_feature};
}

// Force of effect `block` that the hand feels now, in counts of 255 in each direction.
static inline int lying_felt(const LyingDevice *device, int block)
{
    return device->plays[block] && device->now_us < device->ends_us[block] ? device->magnitude[block] : 0;
}

#endif
