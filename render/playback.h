// Playback of a recording: its state at any moment, forwards and backwards. Poses come from its frames, controls from its steps; contrast agent and
// X-ray pulses are simulated again from the nearest checkpoint. Lengths in mm, times in simulated seconds.
#ifndef SELDINGER_RENDER_PLAYBACK_H
#define SELDINGER_RENDER_PLAYBACK_H

#include "render/fluoroscope.h"
#include "render/pulse_clock.h"
#include "sim/sim.h"

typedef struct Playback Playback;

// All arguments are borrowed. `tree` NULL: contrast only in the lumens of the tools. A recording without a viewer (`run --record`) is shown with the controls
// `unseen` in all steps, except for the injections of its script. Returns NULL if out of memory or if there is no frame.
Playback *playback_open(const RecordedRun *run, const Scene *scene, const VesselTree *tree, const XrayControl *unseen);
void playback_close(Playback *playback);

// Moves to the last step at or before a time, clamped to the recording. Returns true for a jump: anything except a move forward by less than a second.
bool playback_seek(Playback *playback, double time_s);
double playback_time_s(const Playback *playback);
double playback_end_s(const Playback *playback);
// The pose at the current moment: the last frame before it with the controls and forces of the current step.
const Pose *playback_pose(const Playback *playback);
const float *playback_contrast(const Playback *playback);        // (N of the tree); NULL without tree
const float *playback_filling(const Playback *playback);         // (nodes of all tools) of their lumens
double playback_injected_ml(const Playback *playback);
int playback_contrast_tool(const Playback *playback);            // tool that injects the requested contrast agent, -1: none
double playback_flow_ml_s(const Playback *playback);             // its actual flow
const PulseClock *playback_pulses(const Playback *playback);
// The pulses so far, for fluoroscope_recall; valid until the next seek. The first step is shown without a pulse.
const FluoroscopePast *playback_past(const Playback *playback);

#endif
