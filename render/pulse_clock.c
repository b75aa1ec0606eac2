#include "render/pulse_clock.h"

#include <math.h>

PulseClock pulse_clock_start(double time_s) { return (PulseClock){.last_s = -1, .now_s = time_s}; }

double pulse_clock_rate(const XrayControl *xray)
{
    double rate = (double)xray->pulses_s;
    return isfinite(rate) ? fmax(7.5, fmin(30, rate)) : 15;
}

bool pulse_clock_advance(PulseClock *clock, double time_s, const XrayControl *xray)
{
    double rate = pulse_clock_rate(xray), passed = time_s - clock->now_s;
    bool is_down = xray->pedal > 0;
    if (is_down && clock->was_down && passed > 0)
        clock->pedal_s += passed;
    // a press, a new rate and a step back in time each start a series of pulses, the first of them at once
    if (is_down && (!clock->was_down || passed < 0 || rate != clock->rate)) {
        clock->rate = rate;
        clock->start_s = time_s;
        clock->since = 0;
    }
    clock->was_down = is_down;
    clock->now_s = time_s;
    if (!is_down)
        return false;
    int64_t due = (int64_t)floor((time_s - clock->start_s) * rate + 1e-6) + 1;
    if (due <= clock->since)
        return false;
    clock->count += due - clock->since;
    clock->since = due;
    clock->last_s = time_s;
    return true;
}
