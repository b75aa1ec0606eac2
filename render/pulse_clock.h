// The timing of X-ray pulses in simulated time, from the recorded pedal and rate, so that window, video and replay show the same images. The first
// pulse comes at once when the pedal is pressed, the next ones at the pulse rate; between pulses and after release the last image is shown (last image hold).
// An
// image shows the state at its pulse. Deterministic.
#ifndef SELDINGER_RENDER_PULSE_CLOCK_H
#define SELDINGER_RENDER_PULSE_CLOCK_H

#include "sim/sim.h"

#include <stdbool.h>
#include <stdint.h>

typedef struct PulseClock {
    bool was_down;           // state of the pedal at the last call
    double rate;             // [1/s] pulse rate since `start_s`
    double start_s;          // time of the first pulse of this press, or of this rate
    int64_t since;           // pulses since then
    int64_t count;           // number of pulses so far: the dose
    double last_s;           // simulated time of the last pulse, -1 before the first
    double pedal_s;          // total time with the pedal pressed
    double now_s;            // time of the last call
} PulseClock;

PulseClock pulse_clock_start(double time_s);
// Advances to `time_s` (going back restarts the press of the pedal, as after a seek). Returns true if a pulse was due by then: draw the present state. Several
// pulses (a call every 100 ms at 30/s) are all counted.
bool pulse_clock_advance(PulseClock *clock, double time_s, const XrayControl *xray);
// The requested rate [1/s], clamped to 7.5 to 30.
double pulse_clock_rate(const XrayControl *xray);

#endif
