// GLFW's gamepads and joysticks: their values as plain arrays, so that nothing here needs a window. Window thread only.
#ifndef SELDINGER_INPUT_GAMEPAD_H
#define SELDINGER_INPUT_GAMEPAD_H

#include "input/map_state.h"

typedef struct Gamepad {
    const DeviceMap *map;            // NULL: not bound
    MapState state;
} Gamepad;

// The first of `map` for a gamepad (GLFW has a layout for it) or for a joystick of this name; NULL if none is.
const DeviceMap *gamepad_choose_map(const DeviceMap *const *map, int count, bool is_gamepad, const char *name);
// False with faults if the map needs controls that the device lacks.
bool gamepad_bind(Gamepad *gamepad, const DeviceMap *map, int axis_count, int button_count, const char *name, Faults *faults);
// Once a frame: axes -1 to 1 (GLFWgamepadstate.axes or glfwGetJoystickAxes), buttons 0 or 1. `port`: MAP_HANDS of them; the first one's state becomes HAND_READY.
void gamepad_update(Gamepad *gamepad, const float *axes, int axis_count, const unsigned char *buttons, int button_count, HandPort *port);
// Unplugged: rates and buttons zero, HAND_LOST.
void gamepad_lost(Gamepad *gamepad, HandPort *port);
// Vendor and product id from glfwGetJoystickGUID; false if it names none (devices that are on no bus).
bool gamepad_ids_of_guid(const char *guid, int *vendor_id, int *product_id);

#endif
