// The port of one hand and the thread that serves its device. input/hand.c starts one for each device it finds. Internal to input.
#ifndef SELDINGER_INPUT_HAND_SLOT_H
#define SELDINGER_INPUT_HAND_SLOT_H

#include "base/base.h"
#include "input/force_feedback.h"
#include "input/hand_info.h"
#include "input/map_state.h"
#include "input/usb_encoder.h"

#include <pthread.h>

enum { MESSAGES_KEPT = 32 };

// Shared by all threads of a session.
typedef struct HandShared {
    HidTransport transport;
    pthread_mutex_t lock;            // HandInfo of each slot, and messages
    pthread_cond_t wake;
    ATOMIC(bool) quit, paused;
    char message[MESSAGES_KEPT][HAND_MESSAGE_LENGTH];
    int message_first, message_count;
} HandShared;

typedef struct HandSlot {
    HandShared *shared;
    HandPort port[MAP_HANDS];
    bool is_used;                    // has had a device
    HidDeviceInfo identity;          // of a USB encoder: path, ids and serial
    const DeviceMap *map;
    MapState state;
    HidDescriptor *descriptor;       // of a HID device
    void *device;                    // while its thread runs; NULL for an encoder
    UsbEncoder *encoder;             // the same of an encoder
    ForceFeedback force;
    int64_t report_from_us;          // when the watchdog may be reported again
    pthread_t thread;
    bool has_thread, encoder_runs;   // the scanner's: the thread is there, and for an encoder
    ATOMIC(bool) has_ended;          // the device was removed; the scanner joins the thread
    HandInfo info;                   // under the lock
} HandSlot;

int64_t hand_now_us(void);
void hand_report(HandShared *shared, const char *format, ...) __attribute__((format(printf, 2, 3)));
// Thread functions; the argument is a HandSlot with its device opened. They close it.
void *hand_run_hid(void *slot);
void *hand_run_encoder(void *slot);

#endif
