// GLFW's gamepads and joysticks, with their values as plain arrays, so that this module needs no window. Call from the window thread only.
#ifndef SELDINGER_INPUT_GAMEPAD_H
#define SELDINGER_INPUT_GAMEPAD_H

#include "input/map_state.h"

typedef struct Gamepad {
    const DeviceMap *map;            // NULL: not bound
    MapState state;
} Gamepad;

// Returns the first of `map` for a gamepad (a device with a GLFW gamepad layout) or for a joystick of this name; NULL if none fits.
const DeviceMap *gamepad_choose_map(const DeviceMap *const *map, int count, bool is_gamepad, const char *name);
// Returns false with faults if the map needs controls that the device does not have.
bool gamepad_bind(Gamepad *gamepad, const DeviceMap *map, int axis_count, int button_count, const char *name, Faults *faults);
// Call once per frame: axes -1 to 1 (GLFWgamepadstate.axes or glfwGetJoystickAxes), buttons 0 or 1. `port`: MAP_HANDS ports; the state of the first becomes
// HAND_READY.
void gamepad_update(Gamepad *gamepad, const float *axes, int axis_count, const unsigned char *buttons, int button_count, HandPort *port);
// Call when unplugged: sets rates and buttons to zero, and the state to HAND_LOST.
void gamepad_lost(Gamepad *gamepad, HandPort *port);
// Vendor and product id from glfwGetJoystickGUID; false if it contains none (virtual devices).
bool gamepad_ids_of_guid(const char *guid, int *vendor_id, int *product_id);

#endif
