// The lock-free interface between one input device ("hand": half a keyboard, a stick, a HID or USB device) and the 1 kHz thread: atomic values
// written by one side and read by the other. A hand moves one tool. It gives rates (a stick, a key), displacements (the counts of an encoder), or both;
// displacements are totals since the port was opened, so none is lost or counted twice, however often either side reads. Each direction has one writer; a port
// outlives both sides.
#ifndef SELDINGER_INPUT_HAND_PORT_H
#define SELDINGER_INPUT_HAND_PORT_H

#include "base/base.h"

#include <stdint.h>

typedef enum { HAND_ABSENT, HAND_READY, HAND_LOST } HandState;   // LOST: unplugged or silent after it was ready; may return

// Bits of `buttons`. X-ray pedal, injection, stop all tools, set a bookmark; on press: select the next tool outwards or inwards, lock or unlock the pair,
// release the
// selected tool or hold it again, open the tray. While the tray is open, choose_outer and choose_inner move up and down in it, exchange inserts the selected
// device,
// and let_go closes it.
enum {
    HAND_PEDAL = 1,
    HAND_CONTRAST = 2,
    HAND_STOP = 4,
    HAND_MARK = 8,
    HAND_CHOOSE_OUTER = 16,
    HAND_CHOOSE_INNER = 32,
    HAND_LOCK = 64,
    HAND_RELEASE = 128,
    HAND_EXCHANGE = 256
};

// The tool that a hand moves. The pair is the selected tool and its partner: the next tool inside it or, for the innermost, the next one around it.
typedef enum {
    DRIVES_CHOSEN,
    DRIVES_PARTNER,
    DRIVES_OUTER,                    // of the pair …
    DRIVES_INNER,
    DRIVES_TOOL                      // plus an index, outermost first: that tool, whichever is selected
} HandDrives;

typedef struct HandPort {
    // from the hand
    ATOMIC(int) drives;              // HandDrives
    ATOMIC(double) push_mm_s;        // requested rate, > 0 into the patient
    ATOMIC(double) twist_deg_s;
    ATOMIC(double) advanced_mm;      // total displacement
    ATOMIC(double) turned_deg;
    ATOMIC(unsigned) buttons;        // HAND_ bits of the buttons pressed now
    ATOMIC(int) state;               // HandState
    ATOMIC(int64_t) reports;         // number of reports read so far
    // to the hand, after each step
    ATOMIC(double) force_n;          // the reaction of the tool that the hand moves, > 0 if the tool resists a push; for locked tools the sum
    ATOMIC(double) torque_n_mm;
    ATOMIC(int64_t) step;            // increases while the simulation runs, for a watchdog
} HandPort;

#endif
