// What a trainee saw, off screen: a moment of a recording as the trainer's window shows it, to a picture or to the frames of a film.
#ifndef SELDINGER_RENDER_FILM_H
#define SELDINGER_RENDER_FILM_H

#include "render/panel.h"
#include "sim/open_vessel.h"
#include "sim/recording.h"

typedef struct FilmOptions {
    int width, height;               // [pixel]
    PanelView view;
    bool has_panels;                 // figures and controls around the views
    double from_s, to_s;             // of a film; simulated time
    double fps, speed;               // frames a second; simulated seconds a second of film
    bool is_quiet;
    double lao_deg, cra_deg;         // of a recording that nobody looked at; NaN: as the scene says
    double close_up_mm;              // this much around the tools' tips at `from_s`: in 3D, and of a recording that nobody looked at in fluoroscopy; 0: all
} FilmOptions;
FilmOptions film_default_options(void);  // 1280x720, fluoroscopy with panels, all of it, 30 a second

// The moment `from_s`. False with faults, also where EGL is missing.
bool film_picture(const char *path, const FilmOptions *options, const RecordedRun *run, Scene *scene, OpenVessel *open, Faults *faults);
// H.264 through ffmpeg.
bool film_movie(const char *path, const FilmOptions *options, const RecordedRun *run, Scene *scene, OpenVessel *open, Faults *faults);

#endif
