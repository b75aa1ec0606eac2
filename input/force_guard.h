// Limits the force sent to a haptic device: scale, clamp, slew limit, and zero if the simulation stalls or the device is silent.
#ifndef SELDINGER_INPUT_FORCE_GUARD_H
#define SELDINGER_INPUT_FORCE_GUARD_H

#include "input/device_map.h"

#include <stdbool.h>
#include <stdint.h>

typedef struct ForceGuard {
    double sent[2];                  // force [N], torque [N mm]
    int64_t last_us, step, step_grew_us;
    bool has_started;
    const char *why_zero;            // "" if forces may be sent
} ForceGuard;

// Computes from `wanted` (force [N], torque [N mm]) the force that may be sent now, guard->sent. `step`: HandPort.step. `report_us`: time of the device's last
// report.
void force_guard(ForceGuard *guard, const MapForce *map, const double wanted[2], int64_t step, int64_t now_us, int64_t report_us, bool paused);

#endif
