#include "sim/score.h"

#include "geom/geom.h"
#include "sim/score_points.h"
#include "sim/score_path.h"
#include "sim/score_tool.h"
#include "sim/xray_tube.h"

#include <stdlib.h>

const char *const score_error_name[ERROR_COUNT + 1] = {"wrong_branch", "tip_force", "wall_force",  "buckling",   "blind", "contrast", "wire_lost",
                                                       "kick",         "tip_moved", "perforation", "dissection", "spasm", "clot",     NULL};
const char *const score_error_words[ERROR_COUNT] = {"wrong branch",
                                                    "tip force above the limit",
                                                    "wall force above the limit",
                                                    "buckling at the sheath",
                                                    "tool moved without X-rays",
                                                    "too much contrast agent",
                                                    "wire lost in the catheter",
                                                    "tip jumped while its hand rested",
                                                    "tip left its required place",
                                                    "vessel perforated",
                                                    "wall dissected",
                                                    "vessel in spasm",
                                                    "clot on the tools"};
const char *const score_state_name[5] = {"waiting", "running", "reached", "time_out", NULL};

static const double LOOK_MS = 10;            // interval between locations of the tips in the tree
static const double CHORD_MM = 0.2;          // of the tip's path
static const double QUIET_MS = 500;          // duration after which an episode is over
static const double FORCE_AGAIN = 0.8, AGAIN = 0.5;      // fraction of a limit below which an episode may end
static const double FRESH_MS = 200;          // an image older than this does not show where a moving tool is: five pulses a second are enough
static const double PULLED = 0.5;            // what a movement backwards counts as blind: a tip that is pulled follows its own shaft
static const double GLANCE_MS = 2000;        // for how long a view is remembered, so that glances between movements do not come free
enum { HOPS = 8 };
static const double LEAKS = 0.1;             // part of the injected agent that leaves through a perforation
// What makes a hint (sim/hints.h).
static const double SAC_PRESS = 0.3, FIRM = 0.15, FIRM_N = 0.05;     // force on a tip as part of a perforation's, or at most
static const double RISING = 1.05, SLOW_MS = 500;    // of the force's own mean over that time
static const double HELD_MM = 3, COILED_MM = 6, OFF_MM = 3, UNSEEN_MM = 5, NO_CONTRAST_S = 20;
static const double EARLY = 0.6;             // part of a rule's limit at which a hint warns of the error

struct Score {
    const Scene *scene;
    Exercise exercise;           // the scene's, or the default; its text is the scene's
    ScoreFigures figures;
    ScorePath path;
    int tool_count;
    ScoreTool tool[TOOLS_MOST];
    double dt;                   // [ms]
    double since_look;           // [ms]
    Vec3 path_from;              // end of the last chord of the tip's path
    double wall_force;           // [N] mean
    ScoreEpisode episode[ERROR_COUNT];       // of errors that belong to no single tool
    XrayPatient patient;
    DoseMeter dose;
    double fed[TOOLS_MOST];      // [mm] in this step
    double since_shown[TOOLS_MOST];      // [ms] since a pulse showed the tool's tip
    double since_glance;         // [ms] since the 3D view or angioscopy was in sight
    float looks;                 // of the last step
    int64_t held_steps, stood_steps;         // within the target; of the tool that must stay, within its own target
    double slow_n[TOOLS_MOST];   // slow mean of the force on each tip
    Hints hints;
    bool stands;                 // the tool has reached the target in which it must stay …
    Vec3 stood_at;               // … at this place
    int event_count;
    ScoreEvent event[SCORE_EVENTS_MOST];
};

// The tool that has to reach the target; of tools with coinciding tips the outermost.
static int leader(const Score *score, const Stepper *stepper)
{
    int foremost = 0;
    if (score->exercise.tool >= 0)
        return score->exercise.tool;
    for (int k = 1; k < score->tool_count; k++)
        if (stepper_tool_inserted(stepper, k) > stepper_tool_inserted(stepper, foremost))
            foremost = k;
    return foremost;
}

// The lumen's radius at the mouth: that of the tree or the tube, else the free space around the first free node; HUGE_VAL if unknown.
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

// The next node towards the target; past the target or without one, the next node into the widest branch; -1 at an end.
static int follow(const Score *score, const VesselTree *tree, int node)
{
    if (score->exercise.target >= 0 && node != score->path.goal)
        return score->path.toward[node];
    int next = -1;
    for (int i = node + 1; i < tree->node_count; i++)
        if (tree->parent[i] == node && (next < 0 || tree->radius[i] > tree->radius[next]))
            next = i;
    return next;
}

// Determines the vessel's turn behind the mouth, which is where a tube begins. Returns false if out of memory.
static bool find_turn(Score *score, ScoreSheath *sheath, const VesselTree *tree)
{
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

static bool create_tools(Score *score, Simulator *simulator, const VesselTree *tree)
{
    double lumen = lumen_radius(score->scene, simulator, tree);
    score->tool_count = score->figures.tool_count = stepper_tool_count(simulator_stepper(simulator));
    for (int k = 0; k < score->tool_count; k++) {
        ScoreTool *tool = &score->tool[k];
        ScoreToolFigures *f = &score->figures.tool[k];
        if (!score_tool_create(tool, simulator, k, lumen, score->exercise.rules.tip_length_mm, f) || !find_turn(score, &tool->sheath, tree))
            return false;
        f->tip_node = tree ? power_nearest(tree, tool->at) : -1;
    }
    return true;
}

Score *score_create(Simulator *simulator, const VesselTree *tree)
{
    const Scene *scene = simulator_scene(simulator);
    Score *score = calloc(1, sizeof *score);
    if (!score)
        return NULL;
    score->scene = scene;
    score->exercise = scene->exercise ? *scene->exercise : exercise_default();
    score->dt = scene->dt;
    score->patient = xray_patient_around(tree, scene->patient_anterior, scene->patient_superior);
    int at = score->exercise.target, led = leader(score, simulator_stepper(simulator));
    Vec3 tip = stepper_tool_place(simulator_stepper(simulator), led, stepper_tool_length(simulator_stepper(simulator), led)).position;
    Vec3 target = at >= 0 ? scene->target[at].point : tip;
    // the path first: the vessel's turn behind the mouth is measured along it
    if (!score_path_create(&score->path, tree, scene->wire.start, target, at >= 0 ? scene->target[at].radius : 0) || !create_tools(score, simulator, tree)) {
        score_free(score);
        return NULL;
    }
    ScoreFigures *f = &score->figures;
    f->has_exercise = scene->exercise != NULL;
    f->tip_node = f->tool[led].tip_node;
    f->way_mm = f->remaining_mm = f->least_remaining_mm = score_path_left(&score->path, tip, f->tip_node);
    f->target_distance_mm = vec3_distance(tip, target);
    for (int i = 0; i < PART_COUNT; i++)
        f->part[i] = 1;
    f->narrowest = 1;
    score->path_from = tip;
    score->since_glance = HUGE_VAL;
    for (int k = 0; k < TOOLS_MOST; k++)
        score->since_shown[k] = HUGE_VAL;
    return score;
}

void score_free(Score *score)
{
    if (!score)
        return;
    score_path_destroy(&score->path);
    free(score);
}

// An episode of `kind` begins when the measure is `over` its limit and ends once it was `back` for `quiet_ms`. Caused by `tool`, or by no single tool (-1).
// Returns true if it begins.
static bool judge(Score *score, ScoreError kind, int tool, bool over, bool back, double quiet_ms, double elapsed_ms, double now_s)
{
    ScoreEpisode *episode = tool < 0 ? &score->episode[kind] : &score->tool[tool].episode[kind];
    ScoreErrorFigures *error = &score->figures.error[kind];
    const bool begins = over && !episode->is_on;
    if (episode->is_on) {
        episode->quiet = back ? episode->quiet + elapsed_ms : 0;
        episode->is_on = !back || episode->quiet < quiet_ms;
    } else if (over) {
        *episode = (ScoreEpisode){.is_on = true};
        error->count++;
        error->last_s = now_s;
        score->figures.error_total++;
        if (score->event_count < SCORE_EVENTS_MOST)
            score->event[score->event_count++] = (ScoreEvent){kind, tool, now_s};
    }
    error->is_on = score->episode[kind].is_on;
    for (int k = 0; k < score->tool_count; k++)
        error->is_on |= score->tool[k].episode[kind].is_on;
    return begins;
}

static void judge_limit(Score *score, ScoreError kind, int tool, double measure, double limit, double again, double elapsed_ms, double now_s)
{
    if (limit > 0)
        judge(score, kind, tool, measure > limit, measure < again * limit, QUIET_MS, elapsed_ms, now_s);
}

// --- X-rays and contrast ---

// Returns the number of pulses in this step.
static int64_t count_pulses(Score *score, const XrayControl *xray, double seconds)
{
    ScoreFigures *f = &score->figures;
    int64_t pulses = dose_meter_step(&score->dose, &score->patient, xray, seconds);
    f->fluoroscopy_s = score->dose.fluoroscopy_s;
    f->pulses = score->dose.pulses;
    f->dose_area_cm2 = score->dose.area_cm2;
    f->air_kerma_mgy = score->dose.kerma_mgy;
    f->kerma_area_gy_cm2 = score->dose.kerma_area_gy_cm2;
    f->second_kerma_mgy = score->dose.second_kerma_mgy;
    f->second_kerma_area_gy_cm2 = score->dose.second_kerma_area_gy_cm2;
    f->mean_kv = f->pulses > 0 ? score->dose.kv_sum / (double)f->pulses : 0;
    f->mean_ma = f->pulses > 0 ? score->dose.ma_sum / (double)f->pulses : 0;
    f->pulse = score->dose.last;
    f->second_pulse = score->dose.second;
    return pulses;
}

// A pulse shows the tips that lie in the open field, if the trainee's window shows the live image.
static void see_pulses(Score *score, const XrayControl *xray, int64_t pulses)
{
    const int seen = (int)xray->seen;
    for (int k = 0; k < score->tool_count; k++) {
        bool is_open = !(seen & SEEN_KNOWN) || (seen & SEEN_XRAY && seen & SEEN_TIP << k);
        score->since_shown[k] = pulses > 0 && is_open ? 0 : score->since_shown[k] + score->dt;
    }
}

// A tool's movement is seen by its own tip or by that of a tool that reaches further, e.g. of the wire over which a catheter is exchanged.
static bool is_seen(const Score *score, const Stepper *stepper, int tool)
{
    double inserted = stepper_tool_inserted(stepper, tool) - 1e-9;
    for (int k = 0; k < score->tool_count && score->dose.had_pedal; k++)
        if (stepper_tool_inserted(stepper, k) >= inserted && score->since_shown[k] <= FRESH_MS)
            return true;
    return false;
}

// Of tools that move together the one that counts most is taken.
static void watch_blind(Score *score, const Stepper *stepper)
{
    ScoreFigures *f = &score->figures;
    double unseen = 0, counted = 0;
    bool all_seen = true;
    for (int k = 0; k < score->tool_count; k++) {
        const double fed = score->fed[k];
        if (is_seen(score, stepper, k))
            continue;
        all_seen = false;
        unseen = fmax(unseen, fabs(fed));
        counted = fmax(counted, fed > 0 ? fed : -PULLED * fed);
    }
    f->blind_mm = all_seen ? 0 : f->blind_mm + unseen;
    f->blind_total_mm += counted;
}

// Also before the clock runs, so that only looks from then on count as new.
static void watch_glances(Score *score, const XrayControl *xray)
{
    const bool is_glance = xray && ((int)xray->seen & (SEEN_3D | SEEN_ANGIOSCOPY) || xray->looks != score->looks);
    score->since_glance = is_glance ? 0 : score->since_glance + score->dt;
    score->looks = xray ? xray->looks : 0;
}

static void watch_xrays(Score *score, const Stepper *stepper, const XrayControl *xray, bool is_moved, double now_s)
{
    ScoreFigures *f = &score->figures;
    const ExerciseRules *rules = &score->exercise.rules;
    double seconds = score->dt / 1000;
    if (!xray)
        return;
    f->has_xray = true;
    see_pulses(score, xray, count_pulses(score, xray, seconds));
    watch_blind(score, stepper);
    f->guided_s += is_moved && score->since_glance <= GLANCE_MS ? seconds : 0;
    f->contrast_ml += fmax((double)xray->contrast_ml_s, 0) * seconds;
    f->dwell_s = xray->contrast_ml_s > 0 ? 0 : f->dwell_s + seconds;
    for (int i = 0; i < f->mark_count; i++)
        f->mark[i].leaked_ml += f->mark[i].kind == ERROR_PERFORATION ? LEAKS * fmax((double)xray->contrast_ml_s, 0) * seconds : 0;
    if (rules->contrast_ml > 0)
        judge(score, ERROR_CONTRAST, -1, f->contrast_ml > rules->contrast_ml * (1 + 1e-9), false, QUIET_MS, score->dt, now_s);
    if (rules->blind_mm > 0)
        judge(score, ERROR_BLIND, -1, f->blind_mm > rules->blind_mm, f->blind_mm <= 0, 0, score->dt, now_s);
}

// --- the tool ---

static bool has_its_devices(const Score *score)
{
    for (int k = 0; k < score->tool_count; k++)
        if (score->exercise.device[k] >= 0 && score->exercise.device[k] != score->tool[k].fitted)
            return false;
    return true;
}

// For the tool that must stay: once its tip has reached its target, checks whether it remains there.
static void watch_stay(Score *score, double now_s)
{
    int k = score->exercise.stays;
    if (k < 0)
        return;
    const SceneTarget *place = &score->scene->target[score->exercise.stays_at];
    ScoreToolFigures *f = &score->figures.tool[k];
    Vec3 tip = score->tool[k].at;
    bool is_there = vec3_distance(tip, place->point) <= place->radius;
    score->stood_steps = is_there ? score->stood_steps + 1 : 0;
    if (!score->stands && (double)score->stood_steps * score->dt / 1000 >= score->exercise.hold_s - 1e-9) {
        score->stands = true;
        score->stood_at = tip;
    }
    if (!score->stands)
        return;
    f->strayed_mm = fmax(f->strayed_mm, vec3_distance(tip, score->stood_at));
    judge(score, ERROR_TIP_MOVED, k, !is_there, is_there, QUIET_MS, score->dt, now_s);
}

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
    score->held_steps = f->target_distance_mm <= target->radius && has_its_devices(score) ? score->held_steps + 1 : 0;
    f->held_s = (double)score->held_steps * score->dt / 1000;
}

static void watch_forces(Score *score, const StepReport *report, double now_s)
{
    ScoreFigures *f = &score->figures;
    f->wall_force_peak_n = fmax(f->wall_force_peak_n, report->wall_force_max);
    f->wall_impulse_n_s += report->wall_force_sum * score->dt / 1000;
    score->wall_force = score_mean(score->wall_force, report->wall_force_max, score->dt);
    judge_limit(score, ERROR_WALL_FORCE, -1, score->wall_force, score->exercise.rules.wall_force_n, FORCE_AGAIN, score->dt, now_s);
}

static void watch_tools(Score *score, const Stepper *stepper, const ToolCommands *commands, double now_s)
{
    ScoreFigures *f = &score->figures;
    const ExerciseRules *rules = &score->exercise.rules;
    f->tip_force_n = 0;
    for (int k = 0; k < score->tool_count; k++) {
        ScoreTool *tool = &score->tool[k];
        ScoreToolFigures *own = &f->tool[k];
        score_tool_watch(tool, stepper, commands, score->dt, own);
        f->tip_force_n = fmax(f->tip_force_n, own->tip_force_n);
        judge_limit(score, ERROR_TIP_FORCE, k, own->tip_force_n, rules->tip_force_n, FORCE_AGAIN, score->dt, now_s);
        judge_limit(score, ERROR_KICK, k, own->kick_mm_s, rules->kick_mm_s, AGAIN, score->dt, now_s);
        if (k == 0)
            continue;
        // an exchangeable tool is withdrawn on purpose; the error is to advance the tool around it without it
        bool judged = rules->wire_behind_mm > 0 &&
                      (scene_device_count(score->scene, k) == 1 || tool->episode[ERROR_WIRE_LOST].is_on || commands->tool[k - 1].push_mm_s > 0);
        judge(score, ERROR_WIRE_LOST, k, own->spare_mm < tool->hub_limit || (judged && own->behind_mm > rules->wire_behind_mm),
              own->spare_mm > tool->hub_limit && !(judged && own->behind_mm > AGAIN * rules->wire_behind_mm), QUIET_MS, score->dt, now_s);
    }
    f->tip_force_peak_n = fmax(f->tip_force_peak_n, f->tip_force_n);
}

// The tip's node, starting from its last one. A tip that snaps from one branch's mouth into another may leave its node's reach between two locations: it is
// then outside that node's ball by half the radius, and inside another's.
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

// Position of a tool's tip in the vessel; a withdrawn tool is at the sheath's mouth.
static Vec3 place_in_vessel(const Score *score, const Stepper *stepper, int k)
{
    const WireOptions *wire = &score->scene->wire;
    return wire->has_sheath && stepper_tool_inserted(stepper, k) < 0 ? wire->start : score->tool[k].at;
}

// Locates the tips in the tree, every 10 ms: a tool at 100 mm/s moves 1 mm in that time.
static void look(Score *score, const Stepper *stepper, int led, double now_s)
{
    ScoreFigures *f = &score->figures;
    double elapsed = score->since_look;
    score->since_look = 0;
    for (int k = 0; k < score->tool_count; k++) {
        ScoreToolFigures *own = &f->tool[k];
        score_sheath_look(&score->tool[k].sheath, stepper, k);
        if (!score->path.tree)
            continue;
        own->tip_node = find_node(score->path.tree, place_in_vessel(score, stepper, k), own->tip_node);
        own->off_way_mm = score->exercise.target >= 0 ? score->path.off[own->tip_node] : 0;
    }
    f->tip_node = f->tool[led].tip_node;
    if (score->exercise.target < 0)
        return;
    f->remaining_mm = score_path_left(&score->path, place_in_vessel(score, stepper, led), f->tip_node);
    f->least_remaining_mm = fmin(f->least_remaining_mm, f->remaining_mm);
    for (int k = 0; k < score->tool_count; k++)
        judge_limit(score, ERROR_WRONG_BRANCH, k, f->tool[k].off_way_mm, score->exercise.rules.wrong_branch_mm, AGAIN, elapsed, now_s);
}

static void watch_sheath(Score *score, const Stepper *stepper, const ToolCommands *commands, double now_s)
{
    ScoreFigures *f = &score->figures;
    f->inserted_mm = f->withdrawn_mm = 0;
    for (int k = 0; k < score->tool_count; k++) {
        ScoreToolFigures *own = &f->tool[k];
        score->fed[k] = score_tool_feed(&score->tool[k], stepper, score->dt, own);
        f->inserted_mm += own->inserted_mm;
        f->withdrawn_mm += own->withdrawn_mm;
        if (score->exercise.rules.buckling && own->lost_limit_mm > 0)
            judge(score, ERROR_BUCKLING, k, own->lost_mm > own->lost_limit_mm && commands->tool[k].push_mm_s > 0, own->lost_mm < AGAIN * own->lost_limit_mm,
                  QUIET_MS, score->dt, now_s);
    }
}

// --- consequences ---

static ConsequenceWall wall_at(const Score *score, int k)
{
    const VesselTree *tree = score->path.tree;
    const int node = score->figures.tool[k].tip_node;
    if (tree && node >= 0)
        return (ConsequenceWall){tree->radius[node], tree->kind[node] == NODE_ANEURYSM};
    return (ConsequenceWall){score->scene->source == SOURCE_TUBE ? score->scene->tube.radius : HUGE_VAL, false};
}

static void mark(Score *score, ScoreError kind, int tool, Vec3 at, double limit_n, double now_s)
{
    ScoreFigures *f = &score->figures;
    if (f->mark_count < SCORE_MARKS_MOST)
        f->mark[f->mark_count++] =
            (ScoreMark){.kind = kind, .at = at, .time_s = now_s, .force_n = tool < 0 ? 0 : vec3_norm(score->tool[tool].wall.press), .limit_n = limit_n};
}

// They happen if the exercise says so, or if it does not say and the session is an examination.
static bool has_consequences(const Score *score, const XrayControl *xray)
{
    const bool is_examination = score->exercise.is_examination || (xray && (int)xray->seen & SEEN_EXAMINATION);
    return score->exercise.consequences.mode == CONSEQUENCES_ON || (score->exercise.consequences.mode == CONSEQUENCES_IN_EXAMINATION && is_examination);
}

static void watch_walls(Score *score, const Stepper *stepper, const XrayControl *xray, int led, double now_s)
{
    ScoreFigures *f = &score->figures;
    const ConsequenceRules *rules = &score->exercise.consequences;
    f->has_consequences = has_consequences(score, xray);
    for (int k = 0; k < score->tool_count; k++) {
        ScoreTool *tool = &score->tool[k];
        const ConsequenceTip *tip = &tool->wall;
        score_tool_press(tool, stepper, rules, wall_at(score, k), score->dt);
        if (!f->has_consequences)
            continue;
        f->tool[k].narrowed = tip->narrowed;
        f->narrowest = fmin(f->narrowest, 1 - tip->narrowed);
        const bool eased = consequence_has_eased(tip);
        if (judge(score, ERROR_PERFORATION, k, consequence_perforates(tip), eased, QUIET_MS, score->dt, now_s))
            mark(score, ERROR_PERFORATION, k, tool->at, tip->limit, now_s);
        if (judge(score, ERROR_DISSECTION, k, consequence_dissects(tip), eased, QUIET_MS, score->dt, now_s))
            mark(score, ERROR_DISSECTION, k, tool->at, tip->dissection_limit, now_s);
        if (judge(score, ERROR_SPASM, k, consequence_is_spasm(tip), consequence_has_relaxed(tip), QUIET_MS, score->dt, now_s))
            mark(score, ERROR_SPASM, k, tool->at, tip->limit, now_s);
    }
    if (f->has_consequences && xray && judge(score, ERROR_CLOT, -1, f->dwell_s > rules->clot_s, f->dwell_s <= 0, 0, score->dt, now_s))
        mark(score, ERROR_CLOT, -1, score->tool[led].at, 0, now_s);
}

// --- hints and steps ---

static void note(HintSigns *signs, HintKind kind, double sign, double value)
{
    if (sign > signs->sign[kind]) {
        signs->sign[kind] = sign;
        signs->value[kind] = value;
    }
}

// A sign that can keep a hint but not bring it.
static double kept(bool is_now, double sign) { return is_now ? sign : fmin(sign, 0.99); }

static void sign_tip(Score *score, const Stepper *stepper, const ToolCommands *commands, int k, HintSigns *signs)
{
    const ScoreTool *tool = &score->tool[k];
    const ScoreToolFigures *own = &score->figures.tool[k];
    const double press = vec3_norm(tool->wall.press), fed = tool->stall.fed;
    const bool is_pushed = commands->tool[k].push_mm_s > 0, is_firm = press > fmin(FIRM * tool->wall.limit, FIRM_N);
    score->slow_n[k] += (press - score->slow_n[k]) * -same_expm1(-score->dt / SLOW_MS);
    if (wall_at(score, k).is_sac)
        note(signs, HINT_SAC, kept(press > RISING * score->slow_n[k], press / (SAC_PRESS * tool->wall.limit)), press);
    if (own->lost_limit_mm > 0)
        note(signs, HINT_BUCKLES, kept(is_pushed, own->lost_mm / (EARLY * own->lost_limit_mm)), own->lost_mm);
    if (stepper_tool_inserted(stepper, k) > 0 && is_firm)
        note(signs, HINT_PRESSES, kept(is_pushed, fed / HELD_MM), fed);
    else if (stepper_tool_inserted(stepper, k) > 0 && own->lost_mm < AGAIN * own->lost_limit_mm)
        note(signs, HINT_COILS, kept(is_pushed, fed / COILED_MM), fed);
    const double off = score->exercise.rules.wrong_branch_mm > 0 ? EARLY * score->exercise.rules.wrong_branch_mm : OFF_MM;
    note(signs, HINT_WRONG_BRANCH, own->off_way_mm / off, own->off_way_mm);
}

static void watch_hints(Score *score, const Stepper *stepper, const ToolCommands *commands, const XrayControl *xray, const StepReport *report, bool moves)
{
    ScoreFigures *f = &score->figures;
    const ExerciseRules *rules = &score->exercise.rules;
    HintSigns signs = {0};
    bool is_pushed = false;
    for (int k = 0; k < score->tool_count; k++) {
        sign_tip(score, stepper, commands, k, &signs);
        is_pushed |= commands->tool[k].push_mm_s > 0;
    }
    if (report->self_contacts > 0)
        note(&signs, HINT_COILS, kept(is_pushed, 1), 0);
    note(&signs, HINT_WIRE_LOST, f->error[ERROR_WIRE_LOST].is_on, 0);
    note(&signs, HINT_UNSEEN, kept(moves, f->blind_mm / (rules->blind_mm > 0 ? EARLY * rules->blind_mm : UNSEEN_MM)), f->blind_mm);
    const bool may_inject = rules->contrast_ml <= 0 || f->contrast_ml < AGAIN * rules->contrast_ml;
    if (xray && xray->pedal > 0.5F && xray->mode != XRAY_ROADMAP && score->path.tree && may_inject)
        note(&signs, HINT_NO_CONTRAST, kept(is_pushed, f->dwell_s / NO_CONTRAST_S), f->dwell_s);
    f->hint = hints_step(&score->hints, &signs, score->dt);
    f->hint_value = signs.value[f->hint];
}

static void watch_guide(Score *score, const Stepper *stepper, int led, double now_s)
{
    ScoreFigures *f = &score->figures;
    const GuideStep *step = guide_now(&score->exercise.guide, &f->guide);
    if (!step)
        return;
    const int k = step->tool >= 0 ? step->tool : led;
    const SceneTarget *target = step->target >= 0 ? &score->scene->target[step->target] : NULL;
    GuideSigns signs = {.xray_s = f->fluoroscopy_s,
                        .contrast_ml = f->contrast_ml,
                        .held_s = f->held_s,
                        .turned_deg = stepper_tool_turned(stepper, k) * 180 / PI,
                        .inserted_mm = stepper_tool_inserted(stepper, k),
                        .is_tip_in = target && vec3_distance(score->tool[k].at, target->point) <= target->radius};
    guide_watch(&score->exercise.guide, &f->guide, &signs, now_s);
}

// --- points ---

static void give_points(Score *score)
{
    ScoreFigures *f = &score->figures;
    const Exercise *exercise = &score->exercise;
    double mean = score_parts_judge(f, exercise), covered = f->way_mm > 0 ? fmax(1 - f->least_remaining_mm / f->way_mm, 0) : 0;
    f->efficiency = f->path_mm > 0 ? fmin(f->way_mm * covered / f->path_mm, 1) : 0;
    if (f->has_exercise)
        f->points = fmax(100 * score_share(f) * mean - score_lost_to_errors(f, exercise), 0);
}

static bool is_moved(const Score *score, const ToolCommands *commands)
{
    bool moves = false;
    for (int k = 0; k < score->tool_count; k++)
        moves |= commands->tool[k].push_mm_s != 0 || commands->tool[k].twist_deg_s != 0;
    return moves;
}

// A tool exchanged in this step is a different device, and the other tools' hubs have moved.
static void refit_tools(Score *score, Simulator *simulator)
{
    bool was_exchanged = false;
    for (int k = 0; k < score->tool_count; k++)
        was_exchanged |= stepper_fitted(simulator_stepper(simulator), k) != score->tool[k].fitted;
    for (int k = 0; was_exchanged && k < score->tool_count; k++)
        score_tool_refit(&score->tool[k], simulator, &score->figures.tool[k]);
}

void score_step(Score *score, Simulator *simulator, const ToolCommands *commands, const XrayControl *xray)
{
    ScoreFigures *f = &score->figures;
    if (f->state == SCORE_REACHED || f->state == SCORE_TIME_OUT)
        return;
    const Stepper *stepper = simulator_stepper(simulator);
    double now_s = simulator_time_s(simulator);
    const bool moves = is_moved(score, commands);
    bool acts = moves || (xray && (xray->pedal > 0.5F || xray->contrast_ml_s > 0));
    if (f->state == SCORE_WAITING && acts) {
        f->state = SCORE_RUNNING;
        f->start_s = now_s - score->dt / 1000;
    }
    refit_tools(score, simulator);
    watch_sheath(score, stepper, commands, now_s);
    watch_glances(score, xray);
    if (f->state == SCORE_WAITING)       // while waiting, initial settling of the tools is not an error of the trainee
        return;
    int led = leader(score, stepper);
    f->time_s = now_s - f->start_s;
    watch_xrays(score, stepper, xray, moves, now_s);
    watch_tip(score, score->tool[led].at);
    watch_tools(score, stepper, commands, now_s);
    watch_stay(score, now_s);
    watch_forces(score, simulator_last(simulator), now_s);
    score->since_look += score->dt;
    if (score->since_look >= LOOK_MS * (1 - 1e-9))
        look(score, stepper, led, now_s);
    watch_walls(score, stepper, xray, led, now_s);
    watch_hints(score, stepper, commands, xray, simulator_last(simulator), moves);
    watch_guide(score, stepper, led, now_s);
    if (f->has_exercise && score->held_steps > 0 && f->held_s >= score->exercise.hold_s - 1e-9) {
        f->state = SCORE_REACHED;
        f->reached_s = now_s;
    } else if (f->has_exercise && f->time_s >= score->exercise.time_limit_s - 1e-9) {
        f->state = SCORE_TIME_OUT;
    }
    if (f->state != SCORE_RUNNING)
        f->hint = HINT_NONE;
    give_points(score);
}

ScoreFigures score_figures(const Score *score) { return score->figures; }

const ScoreEvent *score_events(const Score *score, int *count)
{
    *count = score->event_count;
    return score->event;
}
