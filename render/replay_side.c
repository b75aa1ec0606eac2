#include "render/replay_side.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

struct ReplaySide {
    const ReplayRecording *recording;
    OperatorControls controls;
    Views *views;
    Playback *playback;
    Rescore *rescore;
    bool has_same_scene;
    double first_s, main_first_s;    // the first action in it, and in the recording beside which it is shown
    double shift_s;                  // its time minus that of the other
    TimelineSide state;
};

ReplaySide *replay_side_create(const ReplayRecording *recording, const RecordedRun *main, Faults *faults)
{
    char message[512] = "";
    int before = faults->count;
    ReplaySide *side = calloc(1, sizeof *side);
    bool good = side && (side->views = scene_views_create(recording->scene, recording->open, &side->controls, message, sizeof message, faults)) &&
                (side->rescore = rescore_create(recording->run, recording->scene, recording->open, faults));
    if (good) {
        XrayControl watched = side->controls.xray;
        watched.pedal = 1;
        side->recording = recording;
        side->playback = playback_open(recording->run, recording->scene, recording->open->tree, &watched);
        good = side->playback != NULL;
    }
    if (!good) {
        if (faults->count == before)
            faults_add(faults, recording->name, 0, 0, side && side->rescore ? "contains no frame" : "cannot be shown: out of memory");
        replay_side_free(side);
        return NULL;
    }
    side->has_same_scene = main->scene_text && recording->run->scene_text && !strcmp(main->scene_text, recording->run->scene_text);
    side->first_s = run_first_action_s(recording->run);
    side->main_first_s = run_first_action_s(main);
    side->shift_s = side->first_s - side->main_first_s;
    side->state = (TimelineSide){.name = recording->name, .end_s = playback_end_s(side->playback), .is_in_step = true};
    return side;
}

void replay_side_free(ReplaySide *side)
{
    if (!side)
        return;
    playback_close(side->playback);
    rescore_free(side->rescore);
    views_destroy(side->views);
    free(side);
}

void replay_side_follow(ReplaySide *side, double main_s) { playback_seek(side->playback, fmax(0, fmin(main_s + side->shift_s, side->state.end_s))); }

void replay_side_toggle_step(ReplaySide *side, double main_s)
{
    side->state.is_in_step = !side->state.is_in_step;
    if (side->state.is_in_step)
        side->shift_s = side->first_s - side->main_first_s;
    replay_side_follow(side, main_s);
}

void replay_side_seek(ReplaySide *side, double time_s, double main_s)
{
    side->state.is_in_step = false;
    side->shift_s = fmax(0, fmin(time_s, side->state.end_s)) - main_s;
    replay_side_follow(side, main_s);
}

bool replay_side_compute(ReplaySide *side, double budget_s)
{
    const RecordedRun *run = side->recording->run;
    rescore_advance(side->rescore, run->step_count, budget_s);
    return rescore_steps(side->rescore) >= run->step_count || rescore_first_different(side->rescore) >= 0;
}

void replay_side_draw(ReplaySide *side, PanelView view, ViewPort port, const VesselSceneLook *look, int width, int height, unsigned framebuffer)
{
    const Pose *pose = playback_pose(side->playback);
    PanelLayout layout = {.main = view};
    ViewsFrame frame = {.pose = pose,
                        .xray = &pose->xray,
                        .contrast = playback_contrast(side->playback),
                        .filling = playback_filling(side->playback),
                        .past = playback_past(side->playback),
                        .look = side->has_same_scene ? look : &side->controls.look,
                        .leaves_surroundings = true};
    layout.view[view] = port;
    views_draw(side->views, &frame, &layout, width, height, framebuffer);
}

const TimelineSide *replay_side_state(ReplaySide *side)
{
    side->state.time_s = playback_time_s(side->playback);
    side->state.behind_s = side->first_s - side->main_first_s - side->shift_s;
    side->state.figures = rescore_at(side->rescore, side->state.time_s);
    return &side->state;
}

void replay_side_split(const PanelLayout *layout, PanelLayout *left, ViewPort *right)
{
    const int gap = 4;
    PanelRect whole = layout->view_rect[layout->main], half = whole;
    half.width = floorf((whole.width - (float)gap) / 2);
    *left = *layout;
    left->view_rect[layout->main] = half;
    left->view[layout->main].width = (int)half.width;
    *right = layout->view[layout->main];
    right->x += (int)half.width + gap;
    right->width -= (int)half.width + gap;
}
