#include "render/film.h"

#include "base/base.h"
#include "render/gl_canvas.h"
#include "render/gl_context.h"
#include "render/movie_file.h"
#include "render/playback.h"
#include "render/png_file.h"
#include "render/scene_views.h"
#include "render/trainer_panel.h"
#include "sim/sim.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

typedef struct Film {
    const FilmOptions *options;
    Scene *scene;
    const RecordedRun *run;
    GlContext *context;
    GlCanvas canvas;
    Views *views;
    Panel *panel;
    OperatorControls controls;
    Playback *playback;
    TrainerPanel shown;
    Rescore *rescore;
    bool has_reported_difference;
    double sampled_s;                // time up to which the plots have samples
    uint8_t *rgb;                    // (height, width, 3)
} Film;

FilmOptions film_default_options(void)
{
    return (FilmOptions){
        .width = 1280, .height = 720, .view = VIEW_FLUOROSCOPY, .has_panels = true, .to_s = HUGE_VAL, .fps = 30, .speed = 1, .lao_deg = NAN, .cra_deg = NAN};
}

static void film_close(Film *film)
{
    playback_close(film->playback);
    views_destroy(film->views);
    if (film->panel)
        panel_destroy(film->panel);
    if (film->context)
        gl_canvas_destroy(&film->canvas);
    gl_context_destroy(film->context);
    rescore_free(film->rescore);
    free(film->rgb);
}

// The centre of the tips of the tools at the beginning.
static Vec3 middle_of_tips(Film *film)
{
    Vec3 sum = {0, 0, 0};
    playback_seek(film->playback, film->options->from_s);
    const Pose *pose = playback_pose(film->playback);
    for (int k = 0; k < pose->tool_count; k++)
        sum = vec3_add(sum, pose->tool[k].node[pose->tool[k].node_count - 1].position);
    return vec3_scale(sum, 1.0 / pose->tool_count);
}

static bool open_playback(Film *film, const VesselTree *tree)
{
    const FilmOptions *options = film->options;
    XrayControl watched = film->controls.xray;
    watched.pedal = 1;
    if (!isnan(options->lao_deg))
        watched.lao_deg = (float)options->lao_deg;
    if (!isnan(options->cra_deg))
        watched.cra_deg = (float)options->cra_deg;
    film->playback = playback_open(film->run, film->scene, tree, &watched);
    if (!film->playback || !(options->close_up_mm > 0))
        return film->playback != NULL;
    Vec3 middle = middle_of_tips(film);
    watched.field_mm = (float)options->close_up_mm;
    for (int k = 0; k < 3; k++)
        watched.table_mm[k] = (float)(&middle.x)[k];
    film->controls.look.camera.focus = middle;
    film->controls.look.camera.width_mm = film->controls.look.camera.height_mm = options->close_up_mm;
    playback_close(film->playback);
    film->playback = playback_open(film->run, film->scene, tree, &watched);
    return film->playback != NULL;
}

static bool film_open(Film *film, const char *path, const FilmOptions *options, const RecordedRun *run, Scene *scene, OpenVessel *open, Faults *faults)
{
    char message[512] = "";
    int before = faults->count;
    *film = (Film){.options = options, .scene = scene, .run = run};
    film->rgb = malloc((size_t)options->width * (size_t)options->height * 3);
    film->context = gl_context_create(message, sizeof message);
    film->rescore = rescore_create(run, scene, open, faults);
    bool good = film->rgb && film->rescore && film->context && gl_canvas_create(&film->canvas, options->width, options->height, 1, message, sizeof message) &&
                (film->panel = panel_create(message, sizeof message)) &&
                (film->views = scene_views_create(scene, open, &film->controls, message, sizeof message, faults));
    if (good) {
        good = open_playback(film, open->tree);
        snprintf(message, sizeof message, "the recording contains no frame");
    }
    if (good) {
        film->controls.look.full_detail = true;
        film->controls.view = options->view;
        panel_show_hints(film->panel, false);
        trainer_panel_begin(&film->shown, scene, "");
        return true;
    }
    if (faults->count == before)
        faults_add(faults, path, 0, 0, "cannot draw: %s", *message ? message : "out of memory");
    film_close(film);
    return false;
}

static const ScoreFigures *score_now(Film *film)
{
    rescore_advance(film->rescore, playback_pose(film->playback)->step, HUGE_VAL);
    int64_t different = rescore_first_different(film->rescore);
    if (different >= 0 && !film->has_reported_difference) {
        film->has_reported_difference = true;
        fprintf(stderr, "the simulation differs from the recording from step %lld on: the score is not updated after that step\n", (long long)different);
    }
    return rescore_at(film->rescore, playback_time_s(film->playback));
}

// Running plots at `time_s`: 20 samples a second from the recorded steps.
static void sample_plots(Film *film, double time_s)
{
    const RecordedRun *run = film->run;
    int64_t every = (int64_t)fmax(1, floor(50 / run->step_ms));
    for (int64_t i = 0; i < run->step_count; i += every)
        if (run->time_s[i] > film->sampled_s && run->time_s[i] <= time_s && run->time_s[i] > time_s - 60)
            for (int k = 0; k < run->tool_count; k++)
                panel_sample(film->panel, k, run->time_s[i], run->tool[k].proximal[2 * i], run->tool[k].proximal[2 * i + 1], run->wall_force[2 * i]);
    film->sampled_s = time_s;
}

static void film_draw(Film *film, double time_s)
{
    const FilmOptions *options = film->options;
    playback_seek(film->playback, time_s);
    const Pose *pose = playback_pose(film->playback);
    PanelLayout layout = panel_layout(options->width, options->height, 1, options->view, options->has_panels);
    ViewsFrame frame = {.pose = pose,
                        .xray = &pose->xray,
                        .contrast = playback_contrast(film->playback),
                        .filling = playback_filling(film->playback),
                        .past = playback_past(film->playback),
                        .look = &film->controls.look,
                        .is_still = true};
    views_draw(film->views, &frame, &layout, options->width, options->height, film->canvas.framebuffer);
    if (options->has_panels) {
        WindowInput input = {.width = options->width, .height = options->height, .scale = 1, .mouse_x = -1, .mouse_y = -1, .has_focus = true};
        sample_plots(film, pose->time_s);   // the pose of a time beyond the end is the last one
        trainer_panel_show(&film->shown, film->scene, pose, score_now(film), NULL, &pose->xray);
        film->shown.state.now_s = pose->time_s;
        trainer_panel_views(&film->shown, &film->controls, film->views, &pose->xray);
        trainer_panel_injection(&film->shown, film->scene, playback_contrast_tool(film->playback), playback_flow_ml_s(film->playback), &pose->xray);
        film->shown.state.step_median_us = film->shown.state.step_p999_us = film->shown.state.real_time_factor = NAN;
        panel_draw(film->panel, &input, &film->shown.state, film->canvas.framebuffer);
    }
    gl_canvas_read(&film->canvas, film->rgb);
}

bool film_picture(const char *path, const FilmOptions *options, const RecordedRun *run, Scene *scene, OpenVessel *open, Faults *faults)
{
    Film film;
    char message[256];
    if (!film_open(&film, path, options, run, scene, open, faults))
        return false;
    film_draw(&film, options->from_s);
    film_draw(&film, options->from_s);   // drawn twice: the layout of a panel is known only from the previous frame
    bool good = png_file_write(path, options->width, options->height, film.rgb, message, sizeof message);
    if (!good)
        faults_add(faults, "--picture", 0, 0, "%s", message);
    film_close(&film);
    return good;
}

bool film_movie(const char *path, const FilmOptions *options, const RecordedRun *run, Scene *scene, OpenVessel *open, Faults *faults)
{
    Film film;
    char message[512] = "";
    MovieFile *movie = movie_file_create(path, options->width, options->height, options->fps, message, sizeof message);
    if (!movie) {
        faults_add(faults, "--movie", 0, 0, "%s", message);
        return false;
    }
    if (!film_open(&film, path, options, run, scene, open, faults)) {
        movie_file_abandon(movie);
        return false;
    }
    double end = fmin(options->to_s, playback_end_s(film.playback));
    long count = (long)fmax(1, floor((end - options->from_s) / options->speed * options->fps + 1e-6) + 1);
    ProgressBar bar;
    Progress progress = progress_bar(&bar, "film", options->is_quiet);
    bool good = true;
    film_draw(&film, options->from_s);
    for (long i = 0; good && i < count; i++) {
        film_draw(&film, options->from_s + (double)i * options->speed / options->fps);
        good = movie_file_add(movie, film.rgb);
        if (progress.call)
            progress.call(progress.context, i + 1, count);
    }
    good = movie_file_close(movie, message, sizeof message) && good;
    if (!good)
        faults_add(faults, "--movie", 0, 0, "%s", *message ? message : "the video could not be written completely");
    film_close(&film);
    return good;
}
