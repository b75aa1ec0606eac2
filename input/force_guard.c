#include "input/force_guard.h"

#include <math.h>

enum { LONGEST_GAP_US = 50000 };    // a longer interval between two calls counts as this long for the slew limit

static double clamp(double value, double most) { return fmax(-most, fmin(most, value)); }

static const char *why_zero(ForceGuard *guard, const MapForce *map, const double wanted[2], int64_t step, int64_t now_us, int64_t report_us, bool paused)
{
    if (!guard->has_started || step != guard->step) {
        // the first call only stores the step: the simulation must be seen to advance
        guard->step_grew_us = guard->has_started ? now_us : now_us - 1000 * (int64_t)map->stall_ms;
        guard->step = step;
        guard->has_started = true;
    }
    if (paused)
        return "paused";
    if (now_us - guard->step_grew_us >= 1000 * (int64_t)map->stall_ms)
        return "the simulation stalls";
    if (map->quiet_ms > 0 && now_us - report_us >= 1000 * (int64_t)map->quiet_ms)
        return "the device is silent";
    if (!isfinite(wanted[0]) || !isfinite(wanted[1]))
        return "the simulation's force is not finite";
    return "";
}

void force_guard(ForceGuard *guard, const MapForce *map, const double wanted[2], int64_t step, int64_t now_us, int64_t report_us, bool paused)
{
    bool first = !guard->has_started;
    int64_t gap = first ? 0 : now_us - guard->last_us;
    gap = gap < 0 ? 0 : gap > LONGEST_GAP_US ? LONGEST_GAP_US : gap;
    guard->why_zero = why_zero(guard, map, wanted, step, now_us, report_us, paused);
    guard->last_us = now_us;
    for (int i = 0; i < 2; i++) {
        // a torque has the same relative limits as the force, scaled to its own full scale
        double unit = i == 0 ? 1 : map->full_scale_n_mm / map->full_scale_n;
        double most = map->max_n * unit, change = map->slew_n_s * unit * 1e-6 * (double)gap;
        if (guard->why_zero[0])
            guard->sent[i] = 0;
        else
            guard->sent[i] += clamp(clamp(wanted[i], most) - guard->sent[i], change);
    }
}
