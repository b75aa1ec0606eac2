// The devices available for a tool: those in the scene, and those of a folder that fit. A device that is not yet in the scene, or whose tip is shaped by hand,
// is written into the scene's text under `exchange:`, so that a session's recording holds all its inputs.
#ifndef SELDINGER_SIM_TRAY_DEVICES_H
#define SELDINGER_SIM_TRAY_DEVICES_H

#include "sim/scene.h"

enum { TRAY_DEVICES = 48, TRAY_TITLE = 120 };

typedef struct TrayDevice {
    SceneTool tool;          // its sections are the tray's
    int which;               // 0: the scene's own, 1, 2, …: those under its `exchange:`; -1: not yet in the scene
    char title[TRAY_TITLE];
} TrayDevice;

typedef struct TrayDevices {
    int tool;                // of the scene, outermost first
    int count;
    TrayDevice device[TRAY_DEVICES];
} TrayDevices;

// Finds the devices. `library`: a folder of device files (*.yaml), or NULL for the scene's own devices only. Each is cut to the length and divided into the
// elements of the scene's tool; it is left out if it is of another kind, does not fit the tools around it and within it, or cannot be read. Returns false if
// out of memory.
bool tray_devices_find(TrayDevices *tray, const Scene *scene, int tool, const char *library);
void tray_devices_free(TrayDevices *tray);
// `from` with its tip shaped. False with the reason in `why` if it cannot keep that shape.
bool tray_device_shape(const TrayDevice *from, const TipShaping *tip, TrayDevice *shaped, char *why, size_t capacity);
void tray_device_free(TrayDevice *device);
// The scene with this device as the last one that may replace `tool`; `tip` (length 0: none) is written with it. NULL with faults.
Scene *tray_scene_with(const Scene *scene, int tool, const TrayDevice *device, const TipShaping *tip, Faults *faults);

#endif
