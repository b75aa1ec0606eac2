// The timing of X-ray pulses in simulated time, from the recorded pedal and rate, so that window, movie and replay show the same images. The first
// pulse comes at once with the pedal, the next ones at its rate; between pulses and after the pedal the last image stays (last image hold). The image
// shows the state at its pulse. Deterministic.
#ifndef SELDINGER_RENDER_PULSE_CLOCK_H
#define SELDINGER_RENDER_PULSE_CLOCK_H

#include "sim/sim.h"

#include <stdbool.h>
#include <stdint.h>

typedef struct PulseClock {
    bool was_down;           // pedal at the last call
    double rate;             // [1/s] of the pulses counted from `start_s`
    double start_s;          // first pulse of this press, or of this rate
    int64_t since;           // pulses since then
    int64_t count;           // pulses so far: the dose
    double last_s;           // simulated time of the last one, -1 before the first
    double pedal_s;          // time with the pedal held, so far
    double now_s;            // of the last call
} PulseClock;

PulseClock pulse_clock_start(double time_s);
// Advances to `time_s` (going back restarts the pedal's press, as after a seek). True if a pulse was due by then: draw the present state. Several
// pulses (a call every 100 ms at 30/s) are all counted.
bool pulse_clock_advance(PulseClock *clock, double time_s, const XrayControl *xray);
// [1/s] the requested rate, clamped to 7.5 to 30.
double pulse_clock_rate(const XrayControl *xray);

#endif
