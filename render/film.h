// Renders the trainer's window off screen: a moment of a recording as a picture, or the frames of a film.
#ifndef SELDINGER_RENDER_FILM_H
#define SELDINGER_RENDER_FILM_H

#include "render/panel.h"
#include "sim/sim.h"

typedef struct FilmOptions {
    int width, height;               // [pixel]
    PanelView view;
    bool has_panels;                 // figures and controls around the views
    double from_s, to_s;             // of a film; simulated time
    double fps, speed;               // frames per second; simulated seconds per second of film
    bool is_quiet;
    double lao_deg, cra_deg;         // for a recording without a viewer; NaN: as in the scene
    double close_up_mm;              // field around the tools' tips at `from_s`: in 3D, and for a recording without a viewer in fluoroscopy; 0: everything
} FilmOptions;
FilmOptions film_default_options(void);  // 1280x720, fluoroscopy with panels, all of it, 30 a second

// The moment `from_s`. False with faults, also where EGL is missing.
bool film_picture(const char *path, const FilmOptions *options, const RecordedRun *run, Scene *scene, OpenVessel *open, Faults *faults);
// H.264 through ffmpeg.
bool film_movie(const char *path, const FilmOptions *options, const RecordedRun *run, Scene *scene, OpenVessel *open, Faults *faults);

#endif
