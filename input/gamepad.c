#include "input/gamepad.h"

#include <stdlib.h>
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

// SDL's form: 16 bytes in hexadecimal, each pair little-endian: bus, 0, vendor, 0, product, 0, version, 0
static int word_of_guid(const char *guid, int byte)
{
    char text[5] = {guid[2 * byte + 2], guid[2 * byte + 3], guid[2 * byte], guid[2 * byte + 1], 0}, *end;
    long value = strtol(text, &end, 16);
    return *end || text[0] == '-' || text[0] == '+' || text[0] == ' ' ? -1 : (int)value;
}

bool gamepad_ids_of_guid(const char *guid, int *vendor_id, int *product_id)
{
    if (strlen(guid) != 32)
        return false;
    int vendor = word_of_guid(guid, 4), product = word_of_guid(guid, 8);
    // GUIDs that contain a name instead of ids use the bytes that are 0 here
    if (word_of_guid(guid, 2) != 0 || word_of_guid(guid, 6) != 0 || word_of_guid(guid, 10) != 0 || vendor <= 0 || product < 0)
        return false;
    *vendor_id = vendor;
    *product_id = product;
    return true;
}
