// The trainer's window: a session driven by keys, gamepads and devices and shown in three views, until the user quits.
#ifndef SELDINGER_RENDER_TRAINER_H
#define SELDINGER_RENDER_TRAINER_H

#include "base/base.h"
#include "input/input.h"
#include "render/panel.h"
#include "sim/sim.h"

enum { TRAINER_MAPS = 8 };

typedef struct TrainerOptions {
    const char *folder;              // folder of recordings, session files, videos and screenshots; created if it does not exist
    bool is_recorded;
    bool is_examination;             // hides 3D view and angioscopy; an exercise may require it
    const char *trainee;             // "" if not known yet
    int map_count;
    DeviceMap *const *map;           // (map_count) the user's device maps
    bool has_built_in_maps;
    const RecordedRun *resume;       // NULL, or a recording to resume …
    double resume_s;
    const char *library;             // folder of devices for the tray; NULL: scenes/tools in the source folder of the program
    const char *cine;                // a cine loop to begin with, or NULL
    int width, height;
    PanelView view;
    bool is_full_screen;
    double duration_s;               // ends after this much real time; 0: never
    int instructor_port;             // of 127.0.0.1, for a browser that watches (render/instructor_view.h); 0: none
    int threads;
    NoteFunction note;               // receives remarks on the vessel of a recovered session; may be NULL
} TrainerOptions;

// Performance of a session on this machine, for `nav --figures`.
typedef struct TrainerFigures {
    double first_picture_s;          // from the call to the first frame on the screen
    double first_picture_cpu_s;      // CPU time of the process until then, from its start
    int64_t frames, frames_skipped;
    double longest_gap_s;            // between two frames on the screen, also while a session is saved
    double frame_cpu_ms[3];          // CPU time of a frame, all threads of drawing: median, p99, worst
    double step_us[3], late_us[3];   // see RealtimeFigures
    int64_t deadline_misses;
    double slowed_s;
    bool real_time_priority;
    double resident_mb[2];           // memory of the process, after the first minute (or the first frame of a shorter session) and at the end
    int64_t reports;                 // number of reports from devices
    char hash[17];                   // hash of the last state
    char recording[4096];
} TrainerFigures;

// Returns an exit code; adds faults. `scene` and `open` belong to the caller.
int trainer_run(Scene *scene, OpenVessel *open, const TrainerOptions *options, TrainerFigures *figures, Faults *faults);

#endif
