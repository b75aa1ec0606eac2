#include "render/trainer_panel.h"
#include "render/translation.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

// Further outside the wall than in any valid run (cli/run.c).
static const double outside_mm = 0.2;
// Below this fraction of real time the operator notices that the tool moves slowly.
static const double slow_factor = 0.97;

static void name_device(TrainerPanel *panel, const Scene *scene, int k, int which)
{
    const WireOptions wire = scene_device_wire(scene, k, which);
    const WireSection *tip = wire.section_count ? &wire.section[wire.section_count - 1] : NULL;
    const char *title = scene_device(scene, k, which)->title;
    snprintf(panel->tool[k], sizeof panel->tool[k], "%s%s%s %.2f mm x %.0f mm%s", title, title[0] ? ": " : "",
             tip && tip->inner_diameter > 0 ? "catheter" : "wire", tip ? tip->diameter : 0, wire_length(&wire),
             tip && tip->rest_curvature != 0 ? tr(", curved tip") : "");
    panel->fitted[k] = which;
}

void trainer_panel_begin(TrainerPanel *panel, const Scene *scene, const char *trainee)
{
    memset(panel, 0, sizeof *panel);
    PanelState *state = &panel->state;
    ToolKind kind[TOOLS_MOST];
    Color color[TOOLS_MOST];
    state->tool_count = scene->tool_count;
    for (int k = 0; k < scene->tool_count; k++)
        kind[k] = scene->tool[k].kind;
    tool_colors(scene->tool_count, kind, false, color);
    for (int k = 0; k < scene->tool_count; k++) {
        name_device(panel, scene, k, 0);
        state->tool[k] = (PanelTool){.name = scene->tool[k].name, .what = panel->tool[k], .color = color[k]};
    }
    state->trainee = trainee;
    state->title = scene->exercise ? scene->exercise->title : "Free practice";
    state->instructions =
        key_table_fill(scene->exercise ? scene->exercise->instructions : tr("This scene has no exercise: navigate freely."), panel->task, sizeof panel->task);
    if (scene->exercise) {
        state->guide = &scene->exercise->guide;
        snprintf(panel->target, sizeof panel->target, "%s", scene->target[scene->exercise->target].name);
        state->target = panel->target;
        state->hold_needed_s = scene->exercise->hold_s;
    }
}

static void add_figure(TrainerPanel *panel, const char *label, double value, const char *unit, int decimals, PanelMark mark)
{
    if (panel->state.figure_count < PANEL_FIGURES)
        panel->figure[panel->state.figure_count++] = (PanelFigure){label, value, unit, decimals, mark};
}

static PanelMark mark_of_part(const Scene *scene, const ScoreFigures *score, ScorePart part)
{
    if (!scene->exercise || scene->exercise->par[part] <= 0)
        return MARK_NONE;
    return score->part[part] >= 1 ? MARK_GOOD : score->part[part] > 0.6 ? MARK_WARNING : MARK_BAD;
}

__attribute__((format(printf, 3, 4))) static void add_line(char *text, size_t capacity, const char *format, ...)
{
    size_t used = strlen(text);
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text + used, capacity - used, format, arguments);
    va_end(arguments);
}

// The result: a first line, then the points of each part with the reason for those that were lost, then what the sum is multiplied by and the errors.
// A recording has no keys that restart or end it.
static void tell_result(char *text, size_t capacity, const Scene *scene, const ScoreFigures *score, bool is_live)
{
    snprintf(text, capacity, tr("%s: %.0f points in %.0f s with %d handling error%s."),
             score->state == SCORE_REACHED ? tr("Target reached and held") : tr("Time is up"), score->points, score->time_s, score->error_total,
             score->error_total == 1 ? "" : "s");
    add_line(text, capacity, "%s\n", is_live ? tr(" {Restart} restarts; {Quit} ends.") : "");
    for (int i = 0; i < PART_COUNT; i++) {
        const ScorePartFigures *part = &score->judged[i];
        const ScorePartWords *words = &score_part_words[i];
        char why[120];
        if (!(part->most > 0))
            continue;
        score_part_reason(score, (ScorePart)i, why, sizeof why);
        add_line(text, capacity, tr("- %s: %.1f of %.1f points"), tr(words->title), part->points, part->most);
        if (*why)
            add_line(text, capacity, tr(" (%.3g %s, full points up to %.3g): %s"), part->measured, tr(words->unit), part->par, tr(why));
        add_line(text, capacity, ".\n");
    }
    if (score->state != SCORE_REACHED)
        add_line(text, capacity, tr("- Only %.0f %% of these points count: the target was not held.\n"), 100 * score_share(score));
    for (int i = 0; i < ERROR_COUNT; i++)
        if (score->error[i].count > 0)
            add_line(text, capacity, tr("- %d \u00d7 %s: %.1f points lost.\n"), score->error[i].count, tr(score_error_words[i]),
                     score_error_points(scene->exercise, (ScoreError)i) * score->error[i].count);
    const Guide *guide = &scene->exercise->guide;
    for (int i = 0; i < guide->count; i++)
        if (i < score->guide.done)
            add_line(text, capacity, tr("- Step %d done at %.1f s: %s\n"), i + 1, score->guide.done_s[i], guide->step[i].text);
        else
            add_line(text, capacity, tr("- Step %d not done: %s\n"), i + 1, guide->step[i].text);
}

// Names of the places of consequences, for the views.
static void name_spots(TrainerPanel *panel, const ScoreFigures *score)
{
    panel->mark_count = score->mark_count;
    memcpy(panel->mark, score->mark, sizeof panel->mark);
    for (int i = 0; i < score->mark_count; i++) {
        const ScoreMark *mark = &score->mark[i];
        if (mark->kind == ERROR_SPASM)
            snprintf(panel->spot_text[i], sizeof panel->spot_text[i], tr("%s: radius %.0f %%"), tr(score_error_words[mark->kind]), 100 * score->narrowest);
        else
            snprintf(panel->spot_text[i], sizeof panel->spot_text[i], "%s", tr(score_error_words[mark->kind]));
    }
}

static void show_score(TrainerPanel *panel, const Scene *scene, const ScoreFigures *score, bool is_live)
{
    PanelState *state = &panel->state;
    state->figure_count = state->error_count = 0;
    state->figure = panel->figure;
    if (scene->exercise)
        add_figure(panel, "Points", score->points, "", 0, MARK_NONE);
    add_figure(panel, "Time", score->time_s, "s", 0, mark_of_part(scene, score, PART_TIME));
    add_figure(panel, "X-ray time", score->fluoroscopy_s, "s", 0, mark_of_part(scene, score, PART_FLUOROSCOPY));
    add_figure(panel, "Contrast", score->contrast_ml, "ml", 1, mark_of_part(scene, score, PART_CONTRAST));
    add_figure(panel, "Tip path", score->path_mm, "mm", 0, mark_of_part(scene, score, PART_PATH));
    if (scene->exercise) {
        add_figure(panel, "To target, along vessel", score->remaining_mm, "mm", 0, MARK_NONE);
        add_figure(panel, "Efficiency", 100 * score->efficiency, "%", 0, MARK_NONE);
    }
    add_figure(panel, "Wall force, peak", score->wall_force_peak_n, "N", 2, mark_of_part(scene, score, PART_WALL_FORCE));
    add_figure(panel, "Wall impulse", score->wall_impulse_n_s, "N s", 1, mark_of_part(scene, score, PART_WALL_IMPULSE));
    add_figure(panel, "Tip force", score->tip_force_n, "N", 2, score->error[ERROR_TIP_FORCE].is_on ? MARK_BAD : MARK_NONE);
    state->error = panel->error;
    for (int i = 0; i < ERROR_COUNT && state->error_count < PANEL_ERRORS; i++) {
        const ScoreErrorFigures *error = &score->error[i];
        if (error->count == 0)
            continue;
        char *text = panel->error_text[state->error_count];
        snprintf(text, sizeof panel->error_text[0], tr("%s%s: %d, last at %.1f s"), error->is_on ? tr("NOW ") : "", tr(score_error_words[i]), error->count,
                 error->last_s);
        panel->error[state->error_count++] = text;
    }
    state->hint = score->hint;
    state->hint_value = score->hint_value;
    state->steps_done = score->guide.done;
    name_spots(panel, score);
    state->hold_s = score->held_s;
    state->is_finished = score->state == SCORE_REACHED || score->state == SCORE_TIME_OUT;
    if (state->is_finished) {
        char result[sizeof panel->result];
        tell_result(result, sizeof result, scene, score, is_live);
        key_table_fill(result, panel->result, sizeof panel->result);
    }
    state->instructions = state->is_finished ? panel->result : panel->task;
    state->fluoro_s = score->fluoroscopy_s;
    state->contrast_ml = score->contrast_ml;
    state->tube_kv = score->pulse.kv;
    state->tube_ma = score->pulse.ma;
    state->kerma_mgy = score->air_kerma_mgy;
    state->kerma_area_gy_cm2 = score->kerma_area_gy_cm2;
    state->second_kv = score->second_pulse.kv;
    state->second_ma = score->second_pulse.ma;
    state->second_kerma_mgy = score->second_kerma_mgy;
    state->second_kerma_area_gy_cm2 = score->second_kerma_area_gy_cm2;
}

// A consequence is announced for some seconds.
static const char *announce(const ScoreFigures *score, double time_s)
{
    static const double shown_s = 8;
    static const char *const of[ERROR_COUNT] = {[ERROR_PERFORATION] = "The tip has perforated the vessel: stop, leave the tool where it is, and call for help",
                                                [ERROR_DISSECTION] = "The tip has dissected the wall: pull it back, and do not inject there",
                                                [ERROR_SPASM] = "The vessel is in spasm after repeated force: wait, and touch it less",
                                                [ERROR_CLOT] = "A clot has formed on the tools: inject to flush them before you go on"};
    const ScoreMark *last = score->mark_count > 0 ? &score->mark[score->mark_count - 1] : NULL;
    return last && time_s - last->time_s < shown_s ? of[last->kind] : NULL;
}

static void warn(TrainerPanel *panel, const Pose *pose, const ScoreFigures *score, const RealtimeFigures *figures)
{
    PanelState *state = &panel->state;
    const StepReport *report = &pose->report;
    state->warnings = 0;
    state->warning = NULL;
    if (report->penetration > outside_mm || (report->flags & (STEP_DEEP | STEP_OUT_OF_VESSEL)))
        state->warnings |= WARN_OUTSIDE;
    if (report->flags & STEP_NOT_CONVERGED)
        state->warnings |= WARN_NOT_CONVERGED;
    const char *line = report->flags & STEP_FULLY_INSERTED ? "The tool is fully inserted and cannot be pushed further"
                       : report->flags & STEP_HAND_SLIPS   ? "The hand slips along the tool: the tool needs more force than the grip holds"
                       : report->flags & STEP_LIMITED      ? "The tool advances less than the hand pushes: it is jammed, or it snaps"
                                                           : announce(score, pose->time_s);
    if (figures) {
        if (figures->state == REALTIME_RUNNING && figures->real_time_factor > 0 && figures->real_time_factor < slow_factor)
            state->warnings |= WARN_SLOW;
        if (!figures->real_time_priority && pose->step > 0)
            state->warnings |= WARN_NO_FIFO;
        if (figures->state == REALTIME_DIVERGED)
            line = "The simulation diverged: the session has ended with the last good state. {Restart} restarts";
        else if (figures->state == REALTIME_UNRECORDED)
            line = "The recording could not be written (disk full?): the session has ended. {Restart} restarts";
    }
    if (line) {
        key_table_fill(tr(line), panel->warning, sizeof panel->warning);
        state->warning = panel->warning;
    }
}

void trainer_panel_show(TrainerPanel *panel, const Scene *scene, const Pose *pose, const ScoreFigures *score, const RealtimeFigures *figures,
                        const XrayControl *xray)
{
    PanelState *state = &panel->state;
    state->time_s = pose->time_s;
    for (int k = 0; k < state->tool_count && k < pose->tool_count; k++) {
        const PoseTool *from = &pose->tool[k];
        PanelTool *tool = &state->tool[k];
        if (from->fitted != panel->fitted[k])
            name_device(panel, scene, k, from->fitted);
        tool->inserted_mm = from->inserted_mm;
        tool->turned_deg = from->turned_deg;
        tool->push_mm_s = from->command.push_mm_s;
        tool->twist_deg_s = from->command.twist_deg_s;
        tool->force_n = from->push_n;
        tool->torque_n_mm = from->torque_n_mm;
        bool is_in = from->node_count > 0 && from->inserted_mm >= from->node[from->node_count - 1].s - 1e-6;
        tool->note = from->is_released ? "released" : is_in && scene->wire.has_sheath ? "fully inserted" : NULL;
        tool->mark = tool->note ? MARK_WARNING : MARK_NONE;
    }
    state->wall_max_n = pose->report.wall_force_max;
    state->wall_sum_n = pose->report.wall_force_sum;
    state->xray = *xray;
    state->mode = xray->mode == XRAY_DSA ? PANEL_DSA : xray->mode == XRAY_ROADMAP ? PANEL_ROADMAP : xray->pedal > 0 ? PANEL_LIVE : PANEL_LIH;
    if (figures) {
        state->is_paused = figures->state == REALTIME_PAUSED;
        state->step_median_us = figures->step_us[0];
        state->step_p999_us = figures->step_us[1];
        state->real_time_factor = figures->real_time_factor;
        state->missed_deadlines = figures->deadline_misses;
    }
    show_score(panel, scene, score, figures != NULL);
    state->kerma_rate_mgy_min = xray->pedal > 0 ? score->pulse.rate_mgy_min + score->second_pulse.rate_mgy_min : 0;
    warn(panel, pose, score, figures);
}

// Labels of the 3D view: targets with their distance from the tip, and the mouth of the sheath.
static void label_scene(TrainerPanel *panel, const OperatorControls *controls, const Views *views)
{
    const VesselScene *scene = views_scene(views);
    const double enlargement = views_enlargement(views, VIEW_3D);
    PanelState *state = &panel->state;
    VesselSceneLabel found[PANEL_LABELS];
    int count = vessel_scene_labels(scene, found, PANEL_LABELS);
    for (int i = 0; i < count; i++)
        found[i].x *= enlargement, found[i].y *= enlargement, found[i].radius *= enlargement;
    state->label_count = 0;
    state->label = panel->label;
    state->has_way = false;
    const VesselSceneLabel *tip = NULL, *goal = NULL;
    for (int i = 0; i < count; i++) {
        bool is_goal = found[i].kind == LABEL_TARGET && strcmp(found[i].name, panel->target) == 0;
        tip = found[i].kind == LABEL_TIP && found[i].is_in_view ? &found[i] : tip;
        goal = is_goal && found[i].is_in_view && controls->look.show_targets ? &found[i] : goal;
    }
    if (tip && goal) {
        state->has_way = true;
        state->tip[0] = tip->x, state->tip[1] = tip->y;
        state->goal[0] = goal->x, state->goal[1] = goal->y;
    }
    for (int i = 0; i < count && i < PANEL_LABELS; i++) {
        const VesselSceneLabel *it = &found[i];
        if (!it->is_in_view || (it->kind == LABEL_TIP && state->tool_count < 2) || (it->kind == LABEL_TARGET && !controls->look.show_targets))
            continue;
        char *text = panel->label_text[state->label_count];
        if (it->kind == LABEL_TARGET && isfinite(it->distance_mm))
            snprintf(text, sizeof panel->label_text[0], tr("%.63s, %.0f mm in a straight line"), it->name, it->distance_mm);
        else
            snprintf(text, sizeof panel->label_text[0], "%.63s", it->name);
        panel->label[state->label_count++] = (PanelLabel){it->x, it->y, it->radius, text};
    }
    ScaleBar bar = vessel_scene_scale_bar(scene, 140 / enlargement);
    state->bar_mm = bar.length_mm;
    state->bar_pixels = bar.pixels * enlargement;
    state->force_full_scale_n = controls->look.force_full_scale_n;
}

// Places the marks of consequences in the X-ray image and in the 3D view.
static void place_spots(TrainerPanel *panel, const Views *views, const Fluoroscope *fluoroscope)
{
    const Camera *camera = vessel_scene_projection(views_scene(views));
    const double enlargement = views_enlargement(views, VIEW_3D);
    panel->state.spot_count = panel->mark_count;
    for (int i = 0; i < panel->mark_count; i++) {
        PanelSpot *spot = &panel->state.spot[i];
        const ScoreMark *mark = &panel->mark[i];
        const double scale = fluoroscope_locate(fluoroscope, mark->at, spot->xray), volume = 1000 * mark->leaked_ml;
        const Vec3 p = camera_project(camera, mark->at);
        spot->text = panel->spot_text[i];
        spot->is_in_xray = scale > 0;
        spot->blot = scale * cbrt(3 * volume / (4 * PI));
        spot->space[0] = p.x * enlargement;
        spot->space[1] = p.y * enlargement;
        spot->is_in_3d = p.x > 0 && p.y > 0 && p.x < camera->width && p.y < camera->height;
    }
}

void trainer_panel_views(TrainerPanel *panel, const OperatorControls *controls, Views *views, const XrayControl *xray)
{
    PanelState *state = &panel->state;
    FluoroscopeState fluoroscope = fluoroscope_state(views_fluoroscope(views));
    label_scene(panel, controls, views);
    place_spots(panel, views, views_fluoroscope(views));
    views_xray_sides(views, &state->drawn_side, &state->shown_side);
    state->second = controls->second;
    state->second_xray = controls->second == SECOND_PLANE ? xray_second_plane(xray) : views_reference(views);
    state->chosen_tool = controls->grip.chosen;
    state->view = controls->view;
    state->is_examination = controls->is_examination;
    state->is_following = controls->look.follow_tip;
    state->is_following_arm = controls->follows_arm;
    state->has_section = controls->look.section;
    state->has_model = controls->look.show_model;
    state->has_arrows = controls->look.show_arrows;
    state->is_pedal_latched = controls->pedal_latched;
    const char *line = fluoroscope.is_out_of_beam ? "Part of the vessel lies outside the beam: no contrast is drawn. Move the table or the C-arm back"
                       : xray->mode == XRAY_DSA && fluoroscope.mask_has_moved ? "C-arm, table or field have moved since the mask was taken: M takes a new one"
                                                                              : NULL;
    if (line && !state->warning) {
        key_table_fill(tr(line), panel->warning, sizeof panel->warning);
        state->warning = panel->warning;
    }
    state->is_roadmap_ready = xray->mode == XRAY_DSA ? fluoroscope.has_mask : fluoroscope.has_roadmap;
}

void trainer_panel_injection(TrainerPanel *panel, const Scene *scene, int tool, double flow_ml_s, const XrayControl *xray)
{
    const double well = 0.9;     // fraction of the requested flow
    double requested = (double)xray->contrast_ml_s;
    if (!(requested > 0) || tool < 0 || flow_ml_s >= well * requested || panel->state.warning)
        return;
    const char *name = scene->tool[tool].name, *advice = tool + 1 < scene->tool_count ? tr("; more after the tool inside it is withdrawn") : "";
    if (flow_ml_s < 0.01 * requested)
        snprintf(panel->warning, sizeof panel->warning, tr("Almost no contrast agent flows through %s: its lumen is filled%s"), name, advice);
    else
        snprintf(panel->warning, sizeof panel->warning, tr("At the injector's pressure only %.2g of %.2g ml/s flow through the lumen of %s%s"), flow_ml_s,
                 requested, name, advice);
    panel->state.warning = panel->warning;
}

void trainer_panel_grip(TrainerPanel *panel, const HandGrip *grip)
{
    PanelState *state = &panel->state;
    double force[PANEL_TOOLS], torque[PANEL_TOOLS];
    for (int k = 0; k < state->tool_count; k++)
        force[k] = state->tool[k].force_n, torque[k] = state->tool[k].torque_n_mm;
    for (int k = 0; k < state->tool_count; k++) {
        int first = hand_grip_lead(grip, k), last = k;
        while (last + 1 < state->tool_count && hand_grip_lead(grip, last + 1) == first)
            last++;
        if (last == first || state->tool[k].note)
            continue;
        snprintf(panel->tool_note[k], sizeof panel->tool_note[k], tr("locked %d%s%d"), first + 1, last > first + 1 ? " to " : tr(" and "), last + 1);
        state->tool[k].note = panel->tool_note[k];
        state->tool[k].force_n = hand_grip_sum(grip, state->tool_count, k, force);
        state->tool[k].torque_n_mm = hand_grip_sum(grip, state->tool_count, k, torque);
    }
    state->is_pair_locked = hand_grip_pair_is_locked(grip, state->tool_count);
    state->is_released = grip->released >> grip->chosen & 1;
}
