// Renders the trainer's window off screen: a moment of a recording as a picture, or a part of it as a video.
#ifndef SELDINGER_RENDER_FILM_H
#define SELDINGER_RENDER_FILM_H

#include "render/panel.h"
#include "sim/sim.h"

typedef struct FilmOptions {
    int width, height;               // [pixel]
    PanelView view;
    bool has_panels;                 // figures and controls around the views
    double from_s, to_s;             // range of a video; simulated time
    double fps, speed;               // frames per second; simulated seconds per second of video
    bool is_quiet;
    double lao_deg, cra_deg;         // for a recording without a viewer; NaN: as in the scene
    double close_up_mm;              // field around the tool tips at `from_s`: in 3D, and, for a recording without a viewer, in fluoroscopy; 0: everything
} FilmOptions;
FilmOptions film_default_options(void);  // 1280x720, fluoroscopy with panels, the whole recording, 30 frames per second

// Draws the moment `from_s`. Returns false with faults, also if EGL is missing.
bool film_picture(const char *path, const FilmOptions *options, const RecordedRun *run, Scene *scene, OpenVessel *open, Faults *faults);
// Writes H.264 through ffmpeg.
bool film_movie(const char *path, const FilmOptions *options, const RecordedRun *run, Scene *scene, OpenVessel *open, Faults *faults);

#endif
