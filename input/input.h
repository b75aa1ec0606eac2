// input: the operator's commands (push, twist) for each tool, from a script, or from a gamepad, HID or USB device through a device map. Uses base only. Reading
// order:
// command.h, script.h; hand.h (an open device), hand_port.h (what the simulation reads from it).
#ifndef SELDINGER_INPUT_INPUT_H
#define SELDINGER_INPUT_INPUT_H

#include "input/command.h"
#include "input/learned_map.h"
#include "input/own_maps.h"
#include "input/script.h"
#include "input/device_map.h"
#include "input/device_report.h"
#include "input/devices_watch.h"
#include "input/gamepad.h"
#include "input/hand.h"
#include "input/hand_port.h"
#include "input/watched.h"

#endif
