// Force ticks with a lying device: each byte is a tick (its time, the desired force, whether the simulation and the device are alive) and the result of the
// reports sent in it. For any bytes: an effect is started only at a known zero or while it plays, and never while the guard requires zero; a force never grows
// faster than its slew, nor beyond its limit; the reports that end a session are always tried.
// Covers: input/force_feedback.c input/force_guard.c
#include "tests/input/hid_recordings.h"
#include "tests/input/lying_device.h"

#include <math.h>

enum { MOST_COUNTS = 128, SLEW_COUNTS_MS = 7, REPORTS_A_TICK = 24 };    // 4 of 8 N of 255 counts; 200 N/s

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

typedef struct Chance {
    uint8_t bits;
    int used;
} Chance;

static DeviceAnswer answer(void *context)
{
    Chance *chance = context;
    static const DeviceAnswer how[] = {ANSWER_TAKES, ANSWER_REFUSES, ANSWER_TAKES_AND_DENIES, ANSWER_SHORT};
    return chance->bits >> (chance->used++ & 3) & 1 ? how[1 + chance->used % 3] : ANSWER_TAKES;
}

static void require(bool good)
{
    if (!good)
        abort();
}

// The host's knowledge: the last acknowledged magnitude, -1 after one that was not acknowledged.
typedef struct Known {
    int magnitude[LYING_BLOCKS];
    int64_t started_us[LYING_BLOCKS];    // 0: at rest
} Known;

static void check_reports(LyingDevice *device, Known *known, bool is_allowed)
{
    require(device->log_count <= REPORTS_A_TICK);
    for (int i = 0; i < device->log_count; i++) {
        const LyingReport *report = &device->log[i];
        int block = lying_block(report->bytes);
        if (report->bytes[0] == REPORT_FORCE) {
            int magnitude = abs((int16_t)(report->bytes[2] | report->bytes[3] << 8));
            require(magnitude <= MOST_COUNTS && (is_allowed || magnitude == 0));
            known->magnitude[block] = report->is_said_taken ? magnitude : -1;
        } else if (report->bytes[0] == REPORT_OPERATION && report->bytes[2] == OPERATION_START) {
            bool plays = known->started_us[block] && device->now_us - known->started_us[block] < 500000;
            require(is_allowed && known->magnitude[block] >= 0 && (plays || known->magnitude[block] == 0));
            known->started_us[block] = device->now_us;
        } else if (report->bytes[0] == REPORT_OPERATION && report->bytes[2] == OPERATION_STOP) {
            known->started_us[block] = 0;
        }
    }
    device->log_count = 0;
}

static void run(const HidDescriptor *stick, const DeviceMap *map, const uint8_t *data, size_t size)
{
    static LyingDevice device;
    static const int64_t gaps_us[] = {1000, 1000, 1000, 1000, 600, 5000, 60000, 3000000};
    static const double forces[] = {0, 3, -3, 100, -100, 1, NAN, INFINITY};
    const HidTransport transport = lying_transport();
    Chance chance = {0};
    Known known = {{0}, {0}};
    ForceFeedback force;
    HandPort port = {0};
    memset(&device, 0, sizeof device);
    device.now_us = 1000000;
    device.answer = answer;
    device.answer_context = &chance;
    if (!force_start(&force, map, stick, &transport, &device, device.now_us))
        abort();
    check_reports(&device, &known, false);
    int64_t report_us = device.now_us;
    for (size_t i = 0; i + 1 < size; i += 2) {
        int before[3] = {0, abs(lying_felt(&device, 1)), abs(lying_felt(&device, 2))};
        int64_t gap_us = gaps_us[data[i] & 7];
        device.now_us += gap_us;
        report_us = data[i] & 64 ? report_us : device.now_us;
        atomic_store(&port.force_n, forces[data[i] >> 3 & 7]);
        atomic_store(&port.torque_n_mm, 5 * forces[data[i + 1] >> 4 & 7]);
        atomic_fetch_add(&port.step, !(data[i] & 128));
        chance = (Chance){.bits = data[i + 1] & 15};
        bool paused = (data[i + 1] & 128) != 0, was_given_up = force.block[0] == 0;
        double sign = map->force.invert ? -1 : 1;
        ForceGuard guard = force.guard;
        force_guard(&guard, &map->force, (const double[]){sign * port.force_n, sign * port.torque_n_mm}, port.step, device.now_us, report_us, paused);
        force_tick(&force, &port, device.now_us, report_us, paused, &transport, &device);
        require(force.block[0] || (!(fabs(force.guard.sent[0]) > 0) && !(fabs(force.guard.sent[1]) > 0)));
        check_reports(&device, &known, !guard.why_zero[0] && !was_given_up);
        for (int block = 1; block <= 2; block++)
            require(abs(lying_felt(&device, block)) <= before[block] + 1 + SLEW_COUNTS_MS * (gap_us < 50000 ? (int)(gap_us / 1000) + 1 : 50));
    }
    force_stop(&force, &transport, &device);
    check_reports(&device, &known, false);
    // an effect that could not be stopped has ended by itself
    device.now_us += 500000;
    require(lying_felt(&device, 1) == 0 && lying_felt(&device, 2) == 0);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static const char map_text[] = "seldinger_device: 1\ndevice: {usage: joystick}\npush: {source: Y, mm_s: 40, invert: true}\n"
                                   "twist: {source: X, deg_s: 90}\n"
                                   "force: {full_scale_n: 8, max_n: 4, slew_n_s: 200, full_scale_n_mm: 40, stall_ms: 50, quiet_ms: 200}\n";
    static uint8_t bytes[HID_DESCRIPTOR_LIMIT];
    static HidDescriptor *stick;
    static DeviceMap *map;
    static Faults faults;
    if (!stick) {
        faults_clear(&faults);
        stick = hid_descriptor_parse(bytes, hid_bytes(sidewinder_2, bytes), "stick", &faults);
        map = device_map_parse(map_text, sizeof map_text - 1, "map", &faults);
    }
    if (!stick || !map)
        abort();
    run(stick, map, data, size);
    return 0;
}
