// The trainer's window: a session driven by keys, gamepads and devices and shown in three views, until the user quits.
#ifndef SELDINGER_RENDER_TRAINER_H
#define SELDINGER_RENDER_TRAINER_H

#include "base/base.h"
#include "input/input.h"
#include "render/panel.h"
#include "sim/sim.h"

enum { TRAINER_MAPS = 8 };

typedef struct TrainerOptions {
    const char *folder;              // where recordings, session files, films and screenshots go; created if it does not exist
    bool is_recorded;
    const char *trainee;             // "" if not known yet
    int map_count;
    DeviceMap *const *map;           // (map_count) the user's device maps
    bool has_built_in_maps;
    const RecordedRun *resume;       // NULL, or a recording to resume …
    double resume_s;
    const char *library;             // folder of devices for the tray; NULL: scenes/tools beside the program's build folder
    const char *cine;                // NULL, or a cine loop to begin with
    int width, height;
    PanelView view;
    bool is_full_screen;
    double duration_s;               // ends by itself after this much real time; 0: never
    int threads;
    NoteFunction note;               // receives remarks on the vessel of a recovered session; may be NULL
} TrainerOptions;

// Performance of a session on this machine, for `nav --figures`.
typedef struct TrainerFigures {
    double first_picture_s;          // from the call to the first frame on the screen
    int64_t frames, frames_skipped;
    double frame_cpu_ms[3];          // CPU time of a frame, all threads of drawing: median, p99, worst
    double step_us[3], late_us[3];   // see RealtimeFigures
    int64_t deadline_misses;
    double slowed_s;
    bool real_time_priority;
    double resident_mb[2];           // of the process, after the first minute (or the first frame of a shorter session) and at the end
    int64_t reports;                 // of devices
    char hash[17];                   // of the last state
    char recording[4096];
} TrainerFigures;

// An exit code; faults are added. `scene` and `open` are the caller's.
int trainer_run(Scene *scene, OpenVessel *open, const TrainerOptions *options, TrainerFigures *figures, Faults *faults);

#endif
