// `seldinger devices --watch`: prints raw values of HID devices as they arrive.
#ifndef SELDINGER_INPUT_DEVICES_WATCH_H
#define SELDINGER_INPUT_DEVICES_WATCH_H

#include "input/device_list.h"

// Prints the values of all readable devices until the user stops it or `duration_s` has passed (0: no limit). Returns false with a message if there is none.
bool devices_watch(const HidTransport *transport, const HidListing *listing, int count, double duration_s);

#endif
