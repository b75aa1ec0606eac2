#include "sim/score.h"

#include "geom/power_walk.h"
#include "sim/score_sheath.h"
#include "sim/score_tip.h"
#include "sim/score_way.h"

#include <stdlib.h>

const char *const score_error_name[ERROR_COUNT + 1] = {"wrong_branch", "tip_force", "wall_force", "buckling", "blind", "contrast", NULL};
const char *const score_error_words[ERROR_COUNT] = {"wrong branch",          "tip force above the limit", "wall force above the limit",
                                                    "buckling at the sheath", "tool moved without X-rays", "too much contrast agent"};
const char *const score_state_name[5] = {"waiting", "running", "reached", "time_out", NULL};

static const double LOOK_MS = 10;            // between looks at where in the tree the tip is
static const double CHORD_MM = 0.2;          // of the tip's path
static const double FORCE_MEAN_MS = 20;
static const double QUIET_MS = 500;          // until an episode is over
static const double FORCE_AGAIN = 0.8, AGAIN = 0.5;      // parts of a limit below which a measure is back
enum { HOPS = 8 };

struct Score {
    const Scene *scene;
    Exercise exercise;           // the scene's, or the default; its text is the scene's
    ScoreFigures figures;
    ScoreWay way;
    ScoreSheath sheath;
    double dt;                   // [ms]
    int node_count;              // of the first tool
    double *s;                   // (node_count) [mm] arc length of its nodes
    ScoreTip tip;
    double since_look;           // [ms]
    Vec3 path_from;              // where the last chord of the tip's path ended
    double wall_force;           // [N] mean
    double quiet[ERROR_COUNT];   // [ms] that an episode's measure has been back
    double pulse_phase;          // of the next X-ray pulse, 1: now
    bool had_pedal;
    int64_t held_steps;
    int event_count;
    ScoreEvent event[SCORE_EVENTS_MOST];
};

static Vec3 tip_of(const Simulator *simulator)
{
    const WireState *state = simulator_state(simulator);
    return state->position[state->node_count - 1];
}

// The lumen's radius at the mouth: the tree's, the tube's, or as much room as the first free node has; HUGE_VAL where nothing says it.
static double lumen_radius(const Scene *scene, Simulator *simulator, const VesselTree *tree)
{
    if (scene->source == SOURCE_TUBE)
        return scene->tube.radius;
    if (tree)
        return tree->radius[power_nearest(tree, scene->wire.start)];
    int count = simulator_state(simulator)->node_count;
    double radius = HUGE_VAL;
    NodeReport *node = calloc((size_t)count, sizeof *node);
    if (node)
        stepper_node_report(simulator_stepper(simulator), node);
    for (int i = 0; node && i < count && radius == HUGE_VAL; i++)
        if (node[i].vessel_node >= 0)
            radius = node[i].gap + node[i].radius;
    free(node);
    return radius;
}

// The next node towards the target, past it or without one into the widest branch; -1 at an end.
static int follow(const Score *score, const VesselTree *tree, int node)
{
    if (score->exercise.target >= 0 && node != score->way.goal)
        return score->way.toward[node];
    int next = -1;
    for (int i = node + 1; i < tree->node_count; i++)
        if (tree->parent[i] == node && (next < 0 || tree->radius[i] > tree->radius[next]))
            next = i;
    return next;
}

// By how much the vessel turns behind the mouth, which is where a tube begins. False where memory lacks.
static bool find_turn(Score *score, const VesselTree *tree)
{
    ScoreSheath *sheath = &score->sheath;
    const TubeOptions *tube = &score->scene->tube;
    if (score->scene->source == SOURCE_TUBE && tube->point_count > 0)
        score_sheath_set_line(sheath, tube->point, tube->point_count);
    else if (score->scene->source == SOURCE_TUBE)
        score_sheath_set_pieces(sheath, tube->piece, tube->piece_count);
    if (score->scene->source == SOURCE_TUBE || !tree || !sheath->is_judged)
        return true;
    Vec3 *line = calloc((size_t)tree->node_count, sizeof *line);
    int count = 0, node = power_nearest(tree, score->scene->wire.start);
    for (double length = 0; line && node >= 0 && count < tree->node_count && length < 1.5 * sheath->reach;) {
        line[count++] = tree->center[node];
        node = follow(score, tree, node);
        length += node >= 0 ? vec3_distance(line[count - 1], tree->center[node]) : 0;
    }
    if (line)
        score_sheath_set_line(sheath, line, count);
    free(line);
    return line != NULL;
}

Score *score_create(Simulator *simulator, const VesselTree *tree)
{
    const Scene *scene = simulator_scene(simulator);
    const WireState *state = simulator_state(simulator);
    Score *score = calloc(1, sizeof *score);
    if (!score)
        return NULL;
    score->scene = scene;
    score->exercise = scene->exercise ? *scene->exercise : exercise_default();
    score->dt = scene->dt;
    score->node_count = stepper_tool_nodes(simulator_stepper(simulator), 0, NULL);
    score->s = calloc((size_t)score->node_count, sizeof *score->s);
    int at = score->exercise.target;
    Vec3 tip = tip_of(simulator), target = at >= 0 ? scene->target[at].point : tip;
    if (!score->s || !score_tip_create(&score->tip, &scene->wire, score->exercise.rules.tip_length_mm, score->s) ||
        !score_way_create(&score->way, tree, scene->wire.start, target, at >= 0 ? scene->target[at].radius : 0)) {
        score_free(score);
        return NULL;
    }
    score_sheath_start(&score->sheath, &scene->wire, score->node_count, lumen_radius(scene, simulator, tree), state->inserted);
    if (!find_turn(score, tree)) {
        score_free(score);
        return NULL;
    }
    ScoreFigures *f = &score->figures;
    f->has_exercise = scene->exercise != NULL;
    f->tip_node = tree ? power_nearest(tree, tip) : -1;
    f->way_mm = f->remaining_mm = f->least_remaining_mm = score_way_left(&score->way, tip, f->tip_node);
    f->target_distance_mm = vec3_distance(tip, target);
    for (int i = 0; i < PART_COUNT; i++)
        f->part[i] = 1;
    score->path_from = tip;
    return score;
}

void score_free(Score *score)
{
    if (!score)
        return;
    score_way_destroy(&score->way);
    free(score->s);
    free(score);
}

// An episode of `kind` begins when it is `over` its limit and ends once it was `back` for `quiet_ms`.
static void judge(Score *score, ScoreError kind, bool over, bool back, double quiet_ms, double elapsed_ms, double now_s)
{
    ScoreErrorFigures *error = &score->figures.error[kind];
    if (error->is_on) {
        score->quiet[kind] = back ? score->quiet[kind] + elapsed_ms : 0;
        error->is_on = !back || score->quiet[kind] < quiet_ms;
    } else if (over) {
        *error = (ScoreErrorFigures){error->count + 1, true, now_s};
        score->quiet[kind] = 0;
        score->figures.error_total++;
        if (score->event_count < SCORE_EVENTS_MOST)
            score->event[score->event_count++] = (ScoreEvent){kind, now_s};
    }
}

static void judge_limit(Score *score, ScoreError kind, double measure, double limit, double again, double elapsed_ms, double now_s)
{
    if (limit > 0)
        judge(score, kind, measure > limit, measure < again * limit, QUIET_MS, elapsed_ms, now_s);
}

// --- X-rays and contrast ---

static double open_area_cm2(const XrayControl *xray)
{
    const float *blade = xray->collimator;
    double wide = fmax(1 - 0.5 * ((double)blade[0] + blade[1]), 0), high = fmax(1 - 0.5 * ((double)blade[2] + blade[3]), 0);
    return (double)xray->field_mm * xray->field_mm * wide * high / 100;
}

static void count_pulses(Score *score, const XrayControl *xray, double seconds)
{
    ScoreFigures *f = &score->figures;
    bool pedal = xray->pedal > 0.5F;
    if (pedal) {
        double rate = fmin(fmax((double)xray->pulses_s, 0), 1000);
        f->fluoroscopy_s += seconds;
        score->pulse_phase = score->had_pedal ? score->pulse_phase + rate * seconds : 1;
        int64_t pulses = (int64_t)(score->pulse_phase + 1e-9);
        score->pulse_phase -= (double)pulses;
        f->pulses += pulses;
        f->dose_area_cm2 += (double)pulses * open_area_cm2(xray);
    }
    score->had_pedal = pedal;
}

static void watch_xrays(Score *score, const XrayControl *xray, double fed, double now_s)
{
    ScoreFigures *f = &score->figures;
    const ExerciseRules *rules = &score->exercise.rules;
    double seconds = score->dt / 1000;
    if (!xray)
        return;
    f->has_xray = true;
    count_pulses(score, xray, seconds);
    f->contrast_ml += fmax((double)xray->contrast_ml_s, 0) * seconds;
    f->blind_mm = score->had_pedal ? 0 : f->blind_mm + fabs(fed);
    if (rules->contrast_ml > 0)
        judge(score, ERROR_CONTRAST, f->contrast_ml > rules->contrast_ml * (1 + 1e-9), false, QUIET_MS, score->dt, now_s);
    if (rules->blind_mm > 0)
        judge(score, ERROR_BLIND, f->blind_mm > rules->blind_mm, f->blind_mm <= 0, 0, score->dt, now_s);
}

// --- the tool ---

static void watch_tip(Score *score, Vec3 tip)
{
    ScoreFigures *f = &score->figures;
    double chord = vec3_distance(tip, score->path_from);
    if (chord >= CHORD_MM) {
        f->path_mm += chord;
        score->path_from = tip;
    }
    if (score->exercise.target < 0)
        return;
    const SceneTarget *target = &score->scene->target[score->exercise.target];
    f->target_distance_mm = vec3_distance(tip, target->point);
    score->held_steps = f->target_distance_mm <= target->radius ? score->held_steps + 1 : 0;
    f->held_s = (double)score->held_steps * score->dt / 1000;
}

static double low_pass(double mean, double value, double elapsed_ms) { return mean + (value - mean) * -expm1(-elapsed_ms / FORCE_MEAN_MS); }

static void watch_forces(Score *score, const WireState *state, const StepReport *report, double now_s)
{
    ScoreFigures *f = &score->figures;
    const ExerciseRules *rules = &score->exercise.rules;
    double hidden = score->scene->wire.has_sheath ? score->s[score->node_count - 1] - state->inserted : 0;
    f->wall_force_peak_n = fmax(f->wall_force_peak_n, report->wall_force_max);
    f->wall_impulse_n_s += report->wall_force_sum * score->dt / 1000;
    f->tip_force_n = low_pass(f->tip_force_n, score_tip_force(&score->tip, state, hidden), score->dt);
    f->tip_force_peak_n = fmax(f->tip_force_peak_n, f->tip_force_n);
    score->wall_force = low_pass(score->wall_force, report->wall_force_max, score->dt);
    judge_limit(score, ERROR_TIP_FORCE, f->tip_force_n, rules->tip_force_n, FORCE_AGAIN, score->dt, now_s);
    judge_limit(score, ERROR_WALL_FORCE, score->wall_force, rules->wall_force_n, FORCE_AGAIN, score->dt, now_s);
}

// The tip's node, from its last one. A tip that snaps from one branch's mouth into another may leave its node's reach between two looks: it is outside
// of that node's ball then by half the radius, and inside another's.
static int find_node(const VesselTree *tree, Vec3 tip, int node)
{
    if (!tree->near)
        return power_nearest(tree, tip);
    node = power_walk(tree, tip, node, HOPS);
    if (vec3_distance(tip, tree->center[node]) < 1.5 * tree->radius[node])
        return node;
    int nearest = power_nearest(tree, tip);
    return vec3_distance(tip, tree->center[nearest]) < tree->radius[nearest] ? nearest : node;
}

// Where in the tree the tip is, every 10 ms: a tool at 100 mm/s goes 1 mm in that time.
static void look(Score *score, const WireState *state, Vec3 tip, double now_s)
{
    ScoreFigures *f = &score->figures;
    double elapsed = score->since_look;
    score->since_look = 0;
    score_sheath_look(&score->sheath, state, score->s);
    if (score->way.tree)
        f->tip_node = find_node(score->way.tree, tip, f->tip_node);
    if (score->exercise.target < 0)
        return;
    f->remaining_mm = score_way_left(&score->way, tip, f->tip_node);
    f->least_remaining_mm = fmin(f->least_remaining_mm, f->remaining_mm);
    f->off_way_mm = score->way.tree ? score->way.off[f->tip_node] : 0;
    judge_limit(score, ERROR_WRONG_BRANCH, f->off_way_mm, score->exercise.rules.wrong_branch_mm, AGAIN, elapsed, now_s);
}

static double watch_sheath(Score *score, const WireState *state, Command command, double now_s)
{
    ScoreFigures *f = &score->figures;
    double fed = score_sheath_step(&score->sheath, state, score->s, score->dt), limit = score_sheath_limit(&score->sheath);
    f->inserted_mm += fmax(fed, 0);
    f->withdrawn_mm += fmax(-fed, 0);
    f->lost_mm = score->sheath.lost;
    f->lost_limit_mm = limit;
    if (score->exercise.rules.buckling && limit > 0)
        judge(score, ERROR_BUCKLING, f->lost_mm > limit && command.push_mm_s > 0, f->lost_mm < AGAIN * limit, QUIET_MS, score->dt, now_s);
    return fed;
}

// --- points ---

static void give_points(Score *score)
{
    ScoreFigures *f = &score->figures;
    const Exercise *exercise = &score->exercise;
    double figure[PART_COUNT] = {[PART_TIME] = f->time_s,
                                 [PART_FLUOROSCOPY] = f->fluoroscopy_s,
                                 [PART_CONTRAST] = f->contrast_ml,
                                 [PART_PATH] = f->way_mm > 0 ? f->path_mm / f->way_mm : 0,
                                 [PART_WALL_FORCE] = f->wall_force_peak_n,
                                 [PART_WALL_IMPULSE] = f->wall_impulse_n_s};
    double sum = 0, weights = 0;
    for (int i = 0; i < PART_COUNT; i++) {
        if (!(exercise->par[i] > 0))
            continue;
        f->part[i] = exercise->par[i] / fmax(exercise->par[i], figure[i]);
        sum += exercise->weight[i] * f->part[i];
        weights += exercise->weight[i];
    }
    double covered = f->way_mm > 0 ? fmax(1 - f->least_remaining_mm / f->way_mm, 0) : 0;
    f->efficiency = f->path_mm > 0 ? fmin(f->way_mm * covered / f->path_mm, 1) : 0;
    double share = f->state == SCORE_REACHED ? 1 : 0.5 * covered;
    if (f->has_exercise)
        f->points = fmax(100 * share * (weights > 0 ? sum / weights : 1) - exercise->error_points * f->error_total, 0);
}

void score_step(Score *score, Simulator *simulator, const ToolCommands *commands, const XrayControl *xray)
{
    Command command = commands->tool[0];
    ScoreFigures *f = &score->figures;
    if (f->state == SCORE_REACHED || f->state == SCORE_TIME_OUT)
        return;
    const WireState *state = simulator_state(simulator);
    double now_s = simulator_time_s(simulator);
    bool acts = xray && (xray->pedal > 0.5F || xray->contrast_ml_s > 0);
    for (int k = 0; k < score->scene->tool_count; k++)
        acts |= commands->tool[k].push_mm_s != 0 || commands->tool[k].twist_deg_s != 0;
    if (f->state == SCORE_WAITING && acts) {
        f->state = SCORE_RUNNING;
        f->start_s = now_s - score->dt / 1000;
    }
    Vec3 tip = tip_of(simulator);
    double fed = watch_sheath(score, state, command, now_s);
    if (f->state == SCORE_WAITING)       // a tool that settles by itself is nobody's doing
        return;
    f->time_s = now_s - f->start_s;
    watch_xrays(score, xray, fed, now_s);
    watch_tip(score, tip);
    watch_forces(score, state, simulator_last(simulator), now_s);
    score->since_look += score->dt;
    if (score->since_look >= LOOK_MS * (1 - 1e-9))
        look(score, state, tip, now_s);
    if (f->has_exercise && score->held_steps > 0 && f->held_s >= score->exercise.hold_s - 1e-9) {
        f->state = SCORE_REACHED;
        f->reached_s = now_s;
    } else if (f->has_exercise && f->time_s >= score->exercise.time_limit_s - 1e-9) {
        f->state = SCORE_TIME_OUT;
    }
    give_points(score);
}

ScoreFigures score_figures(const Score *score) { return score->figures; }

const ScoreEvent *score_events(const Score *score, int *count)
{
    *count = score->event_count;
    return score->event;
}

void score_copy(Score *to, const Score *from)
{
    Score own = *to;
    *to = *from;
    to->way = own.way;
    to->s = own.s;
}
