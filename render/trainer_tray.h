// The tray in the trainer's window: the devices of the selected tool as the panel shows them, and what prevents inserting one.
#ifndef SELDINGER_RENDER_TRAINER_TRAY_H
#define SELDINGER_RENDER_TRAINER_TRAY_H

#include "render/panel.h"
#include "sim/sim.h"

enum { TRAY_WORDS = 320 };

typedef struct TrainerTray {
    PanelTray shown;             // the input of panel_draw; its strings are stored below
    TrayDevices devices;
    TrayDevice shaped;           // the selected device as set by the sliders; without sections: none
    PanelTrayDevice device[TRAY_DEVICES], shaped_shown;
    char what[TRAY_DEVICES + 1][160], note[TRAY_DEVICES + 2][TRAY_WORDS];
    char remark[160];
    PanelTrayChoice choice;      // choice of the last frame
} TrainerTray;

// Fills the tray for a tool and marks the inserted device. `library`: as in tray_devices_find. Returns false if out of memory.
bool trainer_tray_open(TrainerTray *tray, const Scene *scene, int tool, const char *library, const Pose *pose, int *in);
void trainer_tray_close(TrainerTray *tray);
// Call in each frame while it is open, with the user's choice and the present pose.
void trainer_tray_show(TrainerTray *tray, const Scene *scene, const Pose *pose, const PanelTrayChoice *choice);
// Why the selected device cannot be inserted now, or NULL.
const char *trainer_tray_obstacle(const TrainerTray *tray);
// The requested shape of the tip; length 0 if it is left unchanged.
TipShaping trainer_tray_tip(const TrainerTray *tray);

#endif
