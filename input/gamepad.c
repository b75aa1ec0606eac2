#include "input/gamepad.h"

#include <string.h>

const DeviceMap *gamepad_choose_map(const DeviceMap *const *map, int count, bool is_gamepad, const char *name)
{
    for (int i = 0; i < count; i++) {
        const MapDevice *device = &map[i]->device;
        if ((device->kind == MAP_GAMEPAD && is_gamepad) || (device->kind == MAP_JOYSTICK && strstr(name, device->joystick)))
            return map[i];
    }
    return NULL;
}

bool gamepad_bind(Gamepad *gamepad, const DeviceMap *map, int axis_count, int button_count, const char *name, Faults *faults)
{
    MapState state;
    if (!map_bind_plain(map, axis_count, button_count, name, &state, faults))
        return false;
    if (gamepad->map == map)
        state.reports = gamepad->state.reports;
    *gamepad = (Gamepad){.map = map, .state = state};
    return true;
}

void gamepad_update(Gamepad *gamepad, const float *axes, int axis_count, const unsigned char *buttons, int button_count, HandPort *port)
{
    if (!gamepad->map)
        return;
    map_take_plain(gamepad->map, axes, axis_count, buttons, button_count, &gamepad->state);
    map_publish(gamepad->map, &gamepad->state, port);
    atomic_store(&port->state, HAND_READY);
}

void gamepad_lost(Gamepad *gamepad, HandPort *port)
{
    if (!gamepad->map)
        return;
    map_release(gamepad->map, &gamepad->state);
    map_publish(gamepad->map, &gamepad->state, port);
    atomic_store(&port->state, HAND_LOST);
}
