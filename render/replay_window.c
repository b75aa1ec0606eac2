#include "render/replay_window.h"

#include "base/base.h"
#include "render/playback.h"
#include "render/redraw.h"
#include "render/replay_keys.h"
#include "render/replay_side.h"
#include "render/scene_views.h"
#include "render/timeline.h"
#include "render/trainer_panel.h"
#include "render/window.h"
#include "sim/sim.h"

#include <stdio.h>
#include <stdlib.h>

// Real time per frame for simulating the recordings again, and simulated seconds per second for a held arrow key.
static const double rescore_budget_s = 0.01, rescore_behind_s = 0.025, scrub_s_s = 4;

typedef struct ReplayWindow {
    const ReplayWindowOptions *options;
    const RecordedRun *run;
    Scene *scene;
    Window *window;
    Panel *panel;
    Timeline *timeline;
    Views *views;
    OperatorControls controls;
    Playback *playback;
    Rescore *rescore;
    Session *session;                // of the recording's session file: all errors are known at once. NULL: they come with the repeated simulation
    RunMarks marks;
    int marked_events;
    double marked_reached_s;
    ReplaySide *side;                // NULL: none
    TrainerPanel shown;
    TimelineState line;
    bool resumes, has_reported_difference;
    double begun_s;
} ReplayWindow;

static void seek(ReplayWindow *replay, double time_s)
{
    if (playback_seek(replay->playback, fmax(0, fmin(time_s, replay->line.end_s))))
        panel_forget_samples(replay->panel);
    if (replay->side)
        replay_side_follow(replay->side, playback_time_s(replay->playback));
}

// The session file beside the recording, if it belongs to it.
static Session *load_session(const ReplayWindowOptions *options, const RecordedRun *run)
{
    char path[4096];
    Faults *ignored = calloc(1, sizeof *ignored);
    Session *session = calloc(1, sizeof *session);
    session_file_beside(options->name, ".json", path, sizeof path);
    bool good = ignored && session && session_load(path, session, ignored) && session_is_of(session, run);
    free(ignored);
    if (good)
        return session;
    free(session);
    return NULL;
}

// Makes the marks again if an error was found or the target was held since.
static void refresh_marks(ReplayWindow *replay)
{
    int count = 0;
    const ScoreEvent *event = score_events(rescore_score(replay->rescore), &count);
    double reached_s = score_figures(rescore_score(replay->rescore)).reached_s;
    if (replay->session) {
        count = replay->session->event_count, event = replay->session->event;
        reached_s = replay->session->figures.reached_s;
    }
    replay->line.known_s = replay->session ? replay->line.end_s : (double)rescore_steps(replay->rescore) * replay->run->step_ms / 1000;
    if (replay->line.marks && count == replay->marked_events && reached_s == replay->marked_reached_s)
        return;
    run_marks_free(&replay->marks);
    replay->line.marks = run_marks_make(&replay->marks, replay->run, event, count, reached_s) ? &replay->marks : NULL;
    replay->marked_events = count;
    replay->marked_reached_s = reached_s;
}

static bool replay_open(ReplayWindow *replay, OpenVessel *open, Faults *faults)
{
    char message[512] = "", title[300];
    int before = faults->count;
    const ReplayWindowOptions *options = replay->options;
    snprintf(title, sizeof title, "Seldinger replay: %.200s", options->name);
    bool good = (replay->window = window_create(title, options->width, options->height, 0, message, sizeof message)) &&
                (replay->panel = panel_create(message, sizeof message)) && (replay->timeline = timeline_create(message, sizeof message)) &&
                (replay->views = scene_views_create(replay->scene, open, &replay->controls, message, sizeof message, faults)) &&
                (replay->rescore = rescore_create(replay->run, replay->scene, open, faults));
    if (good) {
        XrayControl watched = replay->controls.xray;
        watched.pedal = 1;
        if (!isnan(options->lao_deg))
            watched.lao_deg = (float)options->lao_deg;
        if (!isnan(options->cra_deg))
            watched.cra_deg = (float)options->cra_deg;
        replay->playback = playback_open(replay->run, replay->scene, open->tree, &watched);
        snprintf(message, sizeof message, "the recording contains no frame");
        good = replay->playback != NULL;
    }
    if (good && options->beside)
        good = (replay->side = replay_side_create(options->beside, replay->run, faults)) != NULL;
    if (!good && faults->count == before)
        faults_add(faults, options->name, 0, 0, "no window: %s", message);
    if (!good)
        return false;
    replay->controls.view = options->view;
    panel_show_hints(replay->panel, false);
    panel_show_replay(replay->panel);
    trainer_panel_begin(&replay->shown, replay->scene, "");
    replay->line = (TimelineState){.end_s = playback_end_s(replay->playback), .is_playing = true, .speed = 1, .note = options->name};
    replay->session = load_session(options, replay->run);
    seek(replay, options->at_s);
    return true;
}

static void replay_close(ReplayWindow *replay)
{
    run_marks_free(&replay->marks);
    free(replay->session);
    replay_side_free(replay->side);
    playback_close(replay->playback);
    rescore_free(replay->rescore);
    views_destroy(replay->views);
    timeline_destroy(replay->timeline);
    if (replay->panel)
        panel_destroy(replay->panel);
    if (replay->window)
        window_destroy(replay->window);
}

static void obey(ReplayWindow *replay, const PanelActions *actions, double passed_s)
{
    TimelineState *line = &replay->line;
    double now = playback_time_s(replay->playback), held = (double)actions->held[ACTION_TWIST_RIGHT] - (double)actions->held[ACTION_TWIST_LEFT];
    if (actions->pressed[ACTION_PAUSE] & 1)
        line->is_playing = !line->is_playing;
    if (actions->pressed[ACTION_FULL_SCREEN] & 1)
        window_set_full_screen(replay->window, !window_is_full_screen(replay->window));
    replay->resumes |= actions->pressed[ACTION_SAVE] > 0;
    if (held != 0 && replay->side && actions->held[ACTION_SLOW])
        replay_side_seek(replay->side, replay_side_state(replay->side)->time_s + held * scrub_s_s * passed_s, now);
    else if (held != 0)
        seek(replay, now + held * scrub_s_s * passed_s);
    else if (line->is_playing)
        seek(replay, now + passed_s * (double)line->speed);
    if (playback_time_s(replay->playback) >= line->end_s)
        line->is_playing = false;
}

static void obey_timeline(ReplayWindow *replay, const TimelineActions *actions)
{
    TimelineState *line = &replay->line;
    line->is_playing ^= actions->toggle_play;
    line->speed = actions->speed;
    line->has_parts ^= actions->toggle_parts;
    replay->resumes |= actions->resume;
    line->is_playing &= !actions->stop;
    if (actions->seek)
        seek(replay, actions->seek_s);
    if (actions->seek_side)
        replay_side_seek(replay->side, actions->seek_side_s, playback_time_s(replay->playback));
    if (actions->toggle_step)
        replay_side_toggle_step(replay->side, playback_time_s(replay->playback));
}

// Both scores are computed to their ends, whatever is shown, so that a jump finds them; in haste while a shown moment has none yet. Returns the moment up to
// which the score beside that moment is known [s].
static double compute_scores(ReplayWindow *replay)
{
    const double step_s = replay->run->step_ms / 1000;
    const bool is_behind = (double)rescore_steps(replay->rescore) * step_s < playback_time_s(replay->playback);
    const double budget = is_behind ? rescore_behind_s : rescore_budget_s;
    const bool is_done = !replay->side || replay_side_compute(replay->side, budget / 2);
    rescore_advance(replay->rescore, replay->run->step_count, is_done ? budget : budget / 2);
    int64_t different = rescore_first_different(replay->rescore);
    if (different >= 0 && !replay->has_reported_difference) {
        replay->has_reported_difference = true;
        panel_message(replay->panel, clock_s(CLOCK_MONOTONIC) - replay->begun_s, MARK_WARNING,
                      "the repeated simulation differs from the recording: the score is not updated after that step");
    }
    int64_t steps = rescore_steps(replay->rescore);
    return steps < replay->run->step_count ? (double)steps * step_s : INFINITY;
}

static void draw(ReplayWindow *replay, const WindowInput *input, const PanelLayout *layout)
{
    const Pose *pose = playback_pose(replay->playback);
    ViewsFrame frame = {.pose = pose,
                        .xray = &pose->xray,
                        .contrast = playback_contrast(replay->playback),
                        .filling = playback_filling(replay->playback),
                        .past = playback_past(replay->playback),
                        .look = &replay->controls.look,
                        .scope_tool = replay->controls.grip.chosen + 1};
    PanelLayout left = *layout;
    ViewPort right = {0};
    if (replay->side)
        replay_side_split(layout, &left, &right);
    views_draw(replay->views, &frame, &left, input->width, input->height, 0);
    if (replay->side)
        replay_side_draw(replay->side, layout->main, right, frame.look, input->width, input->height, 0);
    const ScoreFigures *figures = rescore_at(replay->rescore, playback_time_s(replay->playback));
    refresh_marks(replay);
    trainer_panel_show(&replay->shown, replay->scene, pose, figures, NULL, &pose->xray);
    PanelState *state = &replay->shown.state;
    state->now_s = clock_s(CLOCK_MONOTONIC) - replay->begun_s;
    trainer_panel_views(&replay->shown, &replay->controls, replay->views, &pose->xray);
    trainer_panel_injection(&replay->shown, replay->scene, playback_contrast_tool(replay->playback), playback_flow_ml_s(replay->playback), &pose->xray);
    state->is_paused = !replay->line.is_playing;
    state->step_median_us = state->step_p999_us = state->real_time_factor = NAN;
    panel_draw(replay->panel, input, state, 0);
    replay->line.time_s = pose->time_s;
    replay->line.figures = figures;
    replay->line.side = replay->side ? replay_side_state(replay->side) : NULL;
    replay->line.main = layout->view_rect[layout->main];
    TimelineActions actions = timeline_draw(replay->timeline, input, &replay->line, layout->scale, layout->bottom, 0);
    obey_timeline(replay, &actions);
}

static void run_window(ReplayWindow *replay)
{
    const WindowInput *input;
    PanelActions actions = {0};
    Redraw redraw = {0};
    double last = clock_s(CLOCK_MONOTONIC);
    for (bool is_running = true; is_running;) {
        bool visible = window_next_frame(replay->window, &input);
        double now = clock_s(CLOCK_MONOTONIC), passed = fmin(now - last, 0.1);
        last = now;
        panel_take_input(replay->panel, input, &actions);
        for (int i = 0; i < ACTION_COUNT; i++)
            if (replay_keys_claim(input, (ActionId)i))
                actions.held[i] = 0, actions.pressed[i] = 0;
        PanelLayout layout = panel_layout(input->width, input->height, input->scale, replay->controls.view, true);
        controls_obey(&replay->controls, views_scene(replay->views), &actions, &layout, passed);
        obey(replay, &actions, passed);
        if (!panel_is_asking(replay->panel)) {
            TimelineActions keys = timeline_take_keys(input, &replay->line);
            obey_timeline(replay, &keys);
        }
        is_running = !replay->resumes && !actions.pressed[ACTION_QUIT] && input->close != WINDOW_ENDED &&
                     !(replay->options->duration_s > 0 && now - replay->begun_s > replay->options->duration_s);
        if (!is_running)
            continue;
        const double scored_s = replay->line.scored_s = compute_scores(replay);
        if (!visible)
            continue;
        layout = panel_layout(input->width, input->height, input->scale, replay->controls.view, true);
        // the jump of a click changes the moment; the score may still be computed
        const double time_s = playback_time_s(replay->playback), whole_s = floor(fmin(scored_s, time_s));
        uint64_t settings = redraw_hash(redraw_hash(0, &time_s, sizeof time_s), &replay->controls, sizeof replay->controls);
        settings = redraw_hash(settings, &whole_s, sizeof whole_s);
        if (!redraw_is_due(&redraw, input, playback_pose(replay->playback), settings, now, 0.25))
            continue;
        draw(replay, input, &layout);
        window_swap(replay->window);
    }
    redraw_free(&redraw);
}

bool replay_window_run(const ReplayWindowOptions *options, const RecordedRun *run, Scene *scene, OpenVessel *open, bool *resumes, double *resume_s,
                       Faults *faults)
{
    ReplayWindow replay = {.options = options, .run = run, .scene = scene, .begun_s = clock_s(CLOCK_MONOTONIC)};
    bool good = replay_open(&replay, open, faults);
    if (good) {
        run_window(&replay);
        *resumes = replay.resumes;
        *resume_s = playback_time_s(replay.playback);
    }
    replay_close(&replay);
    return good;
}
