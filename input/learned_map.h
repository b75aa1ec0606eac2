// Learns from a movement which control of a HID device shall push or twist, and writes the map.
#ifndef SELDINGER_INPUT_LEARNED_MAP_H
#define SELDINGER_INPUT_LEARNED_MAP_H

#include "input/watched.h"

typedef struct LearnedAxis {
    bool is_learned;
    uint32_t usage;
    int index;                       // among the controls of that usage
    bool is_relative, is_inverted;   // inverted: the control falls when the user moves it forward or to the right
} LearnedAxis;

// The control that has moved most since watched_forget(), if that was far enough: two fifths of its range, or 40 counts of a relative one. False until then.
bool learned_axis_find(const Watched *watched, LearnedAxis *axis);
// The axis of the first control of push or twist in a map; is_learned is false if there is none of a HID device.
LearnedAxis learned_axis_of(const DeviceMap *map, bool is_twist);
// The map for devices with these ids: push and twist as learned, pedal, contrast, stop and mark on the first four buttons. The caller frees it; NULL: nothing
// was learned, or out of memory.
char *learned_map_text(const HidDeviceInfo *device, const LearnedAxis *push, const LearnedAxis *twist);

#endif
