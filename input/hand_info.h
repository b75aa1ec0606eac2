// Information about one device of a session.
#ifndef SELDINGER_INPUT_HAND_INFO_H
#define SELDINGER_INPUT_HAND_INFO_H

#include "input/device_map.h"
#include "input/hand_port.h"

#include <stdint.h>

enum { HAND_MESSAGE_LENGTH = 400 };

typedef struct HandInfo {
    HandState state;
    char name[96];                   // product, "" while absent
    int vendor_id, product_id;
    char map[MAP_NAME];
    int hand_count;                  // ports in use (hands_port)
    char force[160];                 // "constant force, 255 steps for 8 N", or why there is none
    int64_t reports, bad_reports;    // reports read; reports too short or of unknown id
    double report_hz;                // over about the last second
    double force_n;                  // force sent now
} HandInfo;

#endif
