// Between one hand (half a keyboard, a stick, a HID or USB device) and the 1 kHz thread, without locks: single values that one side writes and the other
// reads. A hand moves one tool. It gives rates (a stick, a key), ways (an encoder's counts), or both; ways are totals since the port was opened, so that none is
// lost or taken twice however often either side looks. One writer for each direction; a port outlives both.
#ifndef SELDINGER_INPUT_HAND_PORT_H
#define SELDINGER_INPUT_HAND_PORT_H

#include <stdatomic.h>
#include <stdint.h>

typedef enum { HAND_ABSENT, HAND_READY, HAND_LOST } HandState;   // LOST: was there, unplugged or silent; may come back

// Bits of `buttons`: X-ray pedal, injection, stop all tools, set a bookmark; and when pressed choose the next tool outwards or inwards, lock the pair or open
// its lock, let the chosen tool go or take it again, open the tray. While that is open choose_outer and choose_inner go up and down in it, exchange puts in
// what is chosen, let_go closes it.
enum {
    HAND_PEDAL = 1, HAND_CONTRAST = 2, HAND_STOP = 4, HAND_MARK = 8,
    HAND_CHOOSE_OUTER = 16, HAND_CHOOSE_INNER = 32, HAND_LOCK = 64, HAND_LET_GO = 128, HAND_EXCHANGE = 256
};

// Which tool a hand moves. The pair: the chosen tool and its partner, the next one inside it; of the innermost the next one around it.
typedef enum {
    DRIVES_CHOSEN,
    DRIVES_PARTNER,
    DRIVES_OUTER,                    // of the pair …
    DRIVES_INNER,
    DRIVES_TOOL                      // plus an index, outermost first: that tool, whichever is chosen
} HandDrives;

typedef struct HandPort {
    // from the hand
    _Atomic int drives;              // HandDrives
    _Atomic double push_mm_s;        // rate it asks for now, > 0 into the patient
    _Atomic double twist_deg_s;
    _Atomic double advanced_mm;      // way it has gone in all
    _Atomic double turned_deg;
    _Atomic unsigned buttons;        // HAND_ bits held now
    _Atomic int state;               // HandState
    _Atomic int64_t reports;         // read so far
    // to the hand, after each step
    _Atomic double force_n;          // the reaction of the tool that it moves, > 0 where the tool pushes back against a push; of locked tools their sum
    _Atomic double torque_n_mm;
    _Atomic int64_t step;            // grows while the simulation lives: a watchdog looks at it
} HandPort;

#endif
