#include "sim/score_tool.h"

#include "base/base.h"

#include <string.h>

static const double MEAN_MS = 20;
static const double REST_MS = 100;           // a hand counts as resting after this time, when the effects of its own motion have died down
static const double HUB_MM = 1;

double score_mean(double mean, double value, double elapsed_ms) { return mean + (value - mean) * -same_expm1(-elapsed_ms / MEAN_MS); }

// Distances of its proximal end behind the hub of the tool around it, and of its tip behind that tool's tip.
static void measure_ends(const ScoreTool *tool, const Stepper *stepper, ScoreToolFigures *f)
{
    if (tool->index == 0)
        return;
    double around = stepper_tool_inserted(stepper, tool->index - 1), own = stepper_tool_inserted(stepper, tool->index);
    f->behind_mm = fmax(around - own, 0);
    f->spare_mm = fmax(tool->length - own - (stepper_tool_length(stepper, tool->index - 1) - around), 0);
}

static double tip_diameter(const WireOptions *wire) { return wire->section_count > 0 ? wire->section[wire->section_count - 1].diameter : 0; }

// Finds its tip, and how close its proximal end may come to the hub.
static void find_ends(ScoreTool *tool, const Stepper *stepper, ScoreToolFigures *figures)
{
    tool->at = stepper_tool_place(stepper, tool->index, tool->length).position;
    measure_ends(tool, stepper, figures);
    tool->hub_limit = tool->index > 0 ? fmin(HUB_MM, figures->spare_mm / 2) : 0;
}

bool score_tool_create(ScoreTool *tool, Simulator *simulator, int index, double lumen_radius, double tip_length, ScoreToolFigures *figures)
{
    const Scene *scene = simulator_scene(simulator);
    const Stepper *stepper = simulator_stepper(simulator);
    WireOptions wire = scene_tool_wire(scene, index);
    *tool = (ScoreTool){.index = index, .length = stepper_tool_length(stepper, index), .tip_length = tip_length};
    *figures = (ScoreToolFigures){.tip_node = -1};
    memcpy(figures->name, scene->tool[index].name, sizeof figures->name);
    tool->diameter = tip_diameter(&wire);
    score_sheath_start(&tool->sheath, &wire, lumen_radius, stepper_tool_inserted(stepper, index));
    find_ends(tool, stepper, figures);
    tool->stall.from = tool->at;
    return score_tip_create(&tool->tip, stepper, index, &wire, tip_length);
}

void score_tool_refit(ScoreTool *tool, Simulator *simulator, ScoreToolFigures *figures)
{
    const Stepper *stepper = simulator_stepper(simulator);
    int fitted = stepper_fitted(stepper, tool->index);
    double inserted = stepper_tool_inserted(stepper, tool->index);
    if (fitted != tool->fitted) {
        WireOptions wire = scene_device_wire(simulator_scene(simulator), tool->index, fitted);
        tool->fitted = fitted;
        tool->length = stepper_tool_length(stepper, tool->index);
        tool->drift = vec3(0, 0, 0);
        tool->rested = 0;
        tool->diameter = tip_diameter(&wire);
        tool->wall = (ConsequenceTip){0};
        score_sheath_refit(&tool->sheath, &wire, inserted);
        score_tip_create(&tool->tip, stepper, tool->index, &wire, tool->tip_length);     // allocates nothing with several tools
    }
    tool->sheath.last_inserted = inserted;
    find_ends(tool, stepper, figures);
}

double score_tool_feed(ScoreTool *tool, const Stepper *stepper, double dt, ScoreToolFigures *f)
{
    double fed = score_sheath_step(&tool->sheath, stepper, tool->index, dt);
    Vec3 before = tool->at;
    tool->at = stepper_tool_place(stepper, tool->index, tool->length).position;
    Vec3 velocity = vec3_scale(vec3_sub(tool->at, before), 1 / dt);
    tool->drift = vec3(score_mean(tool->drift.x, velocity.x, dt), score_mean(tool->drift.y, velocity.y, dt), score_mean(tool->drift.z, velocity.z, dt));
    tip_stall_step(&tool->stall, tool->at, fed);
    f->inserted_mm += fmax(fed, 0);
    f->withdrawn_mm += fmax(-fed, 0);
    f->lost_mm = tool->sheath.lost;
    f->lost_limit_mm = score_sheath_limit(&tool->sheath);
    measure_ends(tool, stepper, f);
    return fed;
}

void score_tool_watch(ScoreTool *tool, const Stepper *stepper, const ToolCommands *commands, double dt, ScoreToolFigures *f)
{
    Command command = commands->tool[tool->index];
    bool rests = command.push_mm_s == 0 && command.twist_deg_s == 0 && !(commands->released >> tool->index & 1);
    tool->rested = rests ? tool->rested + dt : 0;
    f->kick_mm_s = tool->rested > REST_MS ? vec3_norm(tool->drift) * 1000 : 0;
    f->kick_peak_mm_s = fmax(f->kick_peak_mm_s, f->kick_mm_s);
    f->tip_force_n = score_mean(f->tip_force_n, score_tip_force(&tool->tip, stepper, tool->index), dt);
    f->tip_force_peak_n = fmax(f->tip_force_peak_n, f->tip_force_n);
}

void score_tool_press(ScoreTool *tool, const Stepper *stepper, const ConsequenceRules *rules, ConsequenceWall wall, double dt)
{
    const ToolPlace end = stepper_tool_place(stepper, tool->index, tool->length);
    consequence_tip_step(&tool->wall, rules, wall, tool->diameter, end, stepper_tool_wall_force(stepper, tool->index, tool->length - CONSEQUENCE_TIP_MM), dt);
}
