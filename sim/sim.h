// sim: builds a simulator from a scene, drives it by input, records and compares runs. Uses geom, solver and input. Reading order: scene.h (what is
// simulated), simulator.h (one step), drive.h (many steps), recording.h, compare.h; for a hand: hand_set.h, realtime.h.
#ifndef SELDINGER_SIM_SIM_H
#define SELDINGER_SIM_SIM_H

#include "sim/compare.h"
#include "sim/drive.h"
#include "sim/pose.h"
#include "sim/realtime.h"
#include "sim/recording.h"
#include "sim/scene.h"
#include "sim/simulator.h"

#endif
