// The raw values of one HID device as they arrive, their range so far, and the commands that its map makes of them: for `devices --watch` and the page of devices.
#ifndef SELDINGER_INPUT_WATCHED_H
#define SELDINGER_INPUT_WATCHED_H

#include "input/device_list.h"
#include "input/hand_port.h"
#include "input/map_state.h"

enum { WATCHED_CONTROLS = 24 };

typedef struct WatchedControl {
    HidField field;
    int index;                       // among the controls of the same usage
    int64_t value, least, most, sum; // `sum`: of relative controls
    bool has_value;
} WatchedControl;

typedef struct Watched {
    const HidListing *listing;       // the caller's, must outlive it
    void *device;                    // NULL: gone
    int control_count;
    WatchedControl control[WATCHED_CONTROLS];
    MapState state;
    HandPort port[MAP_HANDS];        // written by watched_publish
    bool is_mapped;
    long reports, bad_reports;
} Watched;

// Opens the device. False, with an empty *watched, if it has no descriptor or cannot be opened.
bool watched_open(const HidTransport *transport, const HidListing *listing, Watched *watched);
// Reads the reports that are there, waiting at most `wait_ms` for the first. Afterwards `device` is NULL if it was unplugged. `bytes` (HID_REPORT_BYTES): scratch.
void watched_read(const HidTransport *transport, Watched *watched, int wait_ms, uint8_t *bytes);
// Forgets the ranges and sums of the controls.
void watched_forget(Watched *watched);
// Brings `port` up to date; does nothing without a map.
void watched_publish(Watched *watched);
void watched_close(const HidTransport *transport, Watched *watched);

#endif
