// `seldinger devices --watch`: raw values of HID devices as they come.
#ifndef SELDINGER_INPUT_DEVICES_WATCH_H
#define SELDINGER_INPUT_DEVICES_WATCH_H

#include "input/device_list.h"

// Prints values of all readable devices until the user stops it or `duration_s` has passed (0: no end). False with a message where there is none.
bool devices_watch(const HidTransport *transport, const HidListing *listing, int count, double duration_s);

#endif
