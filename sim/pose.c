#include "sim/pose.h"

#include <stdlib.h>
#include <string.h>

Pose *pose_create(int node_capacity, int tool_count, const int *tool_nodes)
{
    Pose *pose = calloc(1, sizeof *pose);
    if (!pose)
        return NULL;
    *pose = (Pose){.node_capacity = node_capacity,
                   .node_count = node_capacity,
                   .tool_count = tool_count,
                   .position = calloc((size_t)node_capacity, sizeof *pose->position),
                   .quaternion = calloc((size_t)node_capacity, sizeof *pose->quaternion),
                   .node = calloc((size_t)node_capacity, sizeof *pose->node)};
    bool good = pose->position && pose->quaternion && pose->node;
    for (int k = 0; k < tool_count; k++) {
        pose->tool[k].node_capacity = pose->tool[k].node_count = tool_nodes[k];
        pose->tool[k].node = calloc((size_t)tool_nodes[k], sizeof *pose->tool[k].node);
        good = good && pose->tool[k].node;
    }
    if (good)
        return pose;
    pose_free(pose);
    return NULL;
}

Pose *pose_create_for(Simulator *simulator)
{
    const Stepper *stepper = simulator_stepper(simulator);
    int nodes[STEP_TOOLS_MAX], count = stepper_tool_count(stepper);
    for (int k = 0; k < count; k++)
        nodes[k] = scene_most_nodes(simulator_scene(simulator), k);
    return pose_create(stepper_node_capacity(stepper), count, nodes);
}

Pose *pose_create_for_run(const RecordedRun *run)
{
    int nodes[STEP_TOOLS_MAX] = {run->node_count};
    for (int k = 0; run->tool_count > 1 && k < run->tool_count; k++)
        nodes[k] = run->tool[k].node_count;
    return pose_create(run->node_count, run->tool_count, nodes);
}

void pose_free(Pose *pose)
{
    if (!pose)
        return;
    for (int k = 0; k < STEP_TOOLS_MAX; k++)
        free(pose->tool[k].node);
    free(pose->position);
    free(pose->quaternion);
    free(pose->node);
    free(pose);
}

void pose_copy(Pose *to, const Pose *from)
{
    Pose arrays = *to;
    size_t count = (size_t)from->node_count;
    *to = *from;
    to->position = arrays.position;
    to->quaternion = arrays.quaternion;
    to->node = arrays.node;
    memcpy(to->position, from->position, count * sizeof *to->position);
    memcpy(to->quaternion, from->quaternion, count * sizeof *to->quaternion);
    memcpy(to->node, from->node, count * sizeof *to->node);
    to->tool_count = arrays.tool_count;
    for (int k = 0; k < to->tool_count; k++) {
        to->tool[k].node = arrays.tool[k].node;
        memcpy(to->tool[k].node, from->tool[k].node, (size_t)from->tool[k].node_count * sizeof *to->tool[k].node);
    }
}

// Nodes of the centreline at arc lengths below (`length` of the first tool [mm] - its inserted length) lie behind the mouth; s increases along the centreline,
// also from a tool to the one within. Without a sheath all nodes are free.
static void find_first_free(Pose *pose, bool has_sheath, double length)
{
    double hidden = has_sheath ? length - pose->inserted_mm : 0;
    pose->first_free_node = 0;
    while (pose->first_free_node < pose->node_count - 1 && pose->node[pose->first_free_node].s < hidden)
        pose->first_free_node++;
}

void pose_take(Pose *pose, Simulator *simulator, const ToolCommands *commands, const XrayControl *xray)
{
    const WireState *state = simulator_state(simulator);
    Stepper *stepper = simulator_stepper(simulator);
    size_t count = (size_t)state->node_count;
    pose->step = simulator_totals(simulator)->steps;
    pose->time_s = simulator_time_s(simulator);
    pose->command = commands->tool[0];
    pose->xray = *xray;
    pose->inserted_mm = state->inserted;
    pose->turned_deg = state->twist * 180 / PI;
    pose->report = *simulator_last(simulator);
    pose->node_count = state->node_count;
    memcpy(pose->position, state->position, count * sizeof *pose->position);
    memcpy(pose->quaternion, state->orientation, count * sizeof *pose->quaternion);
    stepper_node_report(stepper, pose->node);
    for (int k = 0; k < pose->tool_count; k++) {
        PoseTool *tool = &pose->tool[k];
        tool->command = commands->tool[k];
        tool->inserted_mm = stepper_tool_inserted(stepper, k);
        tool->turned_deg = stepper_tool_turned(stepper, k) * 180 / PI;
        tool->is_released = commands->released >> k & 1;
        tool->fitted = stepper_fitted(stepper, k);
        tool->push_n = pose->report.push[k];
        tool->torque_n_mm = pose->report.torque[k];
        tool->node_count = stepper_tool_nodes(stepper, k, tool->node);
    }
    pose->refused_exchanges = simulator_totals(simulator)->refused_exchanges;
    pose->refusal = simulator_totals(simulator)->refusal;
    find_first_free(pose, simulator_scene(simulator)->wire.has_sheath, pose->tool[0].node[pose->tool[0].node_count - 1].s);
}

void pose_fill_single_tool(Pose *pose)
{
    PoseTool *tool = &pose->tool[0];
    tool->command = pose->command;
    tool->inserted_mm = pose->inserted_mm;
    tool->push_n = pose->report.proximal_force;
    tool->torque_n_mm = pose->report.proximal_torque;
    for (int j = 0; j < pose->node_count; j++)
        tool->node[j] = (ToolNode){.s = pose->node[j].s,
                                   .position = pose->position[j],
                                   .orientation = pose->quaternion[j],
                                   .radius = pose->node[j].radius,
                                   .carrier = j < pose->first_free_node ? -1 : 0};
}

// Fraction (0 to 1) between a and b of the point closest to `x`; -1 if that is no closer than sqrt(*least2).
static double nearest_between(Vec3 a, Vec3 b, Vec3 x, double *least2)
{
    Vec3 d = vec3_sub(b, a);
    double length2 = vec3_norm2(d), u = length2 > 0 ? fmin(fmax(vec3_dot(vec3_sub(x, a), d) / length2, 0), 1) : 1;
    double away2 = vec3_norm2(vec3_sub(x, vec3_add_scaled(a, u, d)));
    if (!(away2 < *least2))
        return -1;
    *least2 = away2;
    return u;
}

static Vec3 tip_of(const PoseTool *tool) { return tool->node[tool->node_count - 1].position; }

double pose_tool_end(const Pose *pose, int tool)
{
    Vec3 tip = tip_of(&pose->tool[tool]);
    double least2 = HUGE_VAL, end = pose->node_count - 1;
    for (int i = pose->node_count - 1; i > 0; i--) {
        double u = nearest_between(pose->position[i - 1], pose->position[i], tip, &least2);
        end = u >= 0 ? i - 1 + u : end;
    }
    return end;
}

double pose_tool_passes(const Pose *pose, int tool, int other)
{
    const PoseTool *t = &pose->tool[tool];
    Vec3 tip = tip_of(&pose->tool[other]);
    double least2 = HUGE_VAL, s = t->node[t->node_count - 1].s;
    for (int j = t->node_count - 1; j > 0; j--) {
        double u = nearest_between(t->node[j - 1].position, t->node[j].position, tip, &least2);
        s = u >= 0 ? t->node[j - 1].s + u * (t->node[j].s - t->node[j - 1].s) : s;
    }
    return s;
}

int pose_most_distal(const Pose *pose)
{
    int furthest = 0;
    double most = pose_tool_end(pose, 0);
    for (int k = 1; k < pose->tool_count; k++) {
        double end = pose_tool_end(pose, k);
        furthest = end >= most ? k : furthest;
        most = fmax(most, end);
    }
    return furthest;
}

void pose_figures_from_run(Pose *pose, const RecordedRun *run, int64_t step)
{
    ToolCommands commands = recorded_run_commands(run, step);
    pose->step = step + 1;
    pose->time_s = run->time_s[step];
    pose->command = commands.tool[0];
    pose->xray = run->xray ? run->xray[step] : xray_default_control();
    pose->report = (StepReport){.flags = run->flags[step],
                                .proximal_force = run->proximal[2 * step],
                                .proximal_torque = run->proximal[2 * step + 1],
                                .wall_force_max = run->wall_force[2 * step],
                                .wall_force_sum = run->wall_force[2 * step + 1]};
    for (int k = 0; k < pose->tool_count; k++) {
        PoseTool *tool = &pose->tool[k];
        tool->command = commands.tool[k];
        tool->is_released = commands.released >> k & 1;
        tool->push_n = pose->report.push[k] = run->tool[k].proximal[2 * step];
        tool->torque_n_mm = pose->report.torque[k] = run->tool[k].proximal[2 * step + 1];
    }
}

static void own_nodes_from_run(PoseTool *tool, const RecordedRun *run, int index, int64_t frame)
{
    RecordedToolFrame at = recorded_run_tool_frame(run, index, frame);
    tool->fitted = recorded_run_fitted(run, index, run->frame_step[frame]);
    tool->node_count = at.node_count;
    for (int j = 0; j < tool->node_count; j++)
        tool->node[j] = (ToolNode){.s = at.s[j], .radius = at.radius[j], .position = at.position[j], .orientation = at.quaternion[j], .carrier = at.carrier[j]};
}

void pose_from_run(Pose *pose, const Scene *scene, const RecordedRun *run, int64_t frame)
{
    int64_t row = run->frame_step[frame];
    RecordedFrame at = recorded_run_frame(run, frame);
    pose_figures_from_run(pose, run, row);
    pose->inserted_mm = run->inserted[row];
    pose->turned_deg = run->tool[0].turned[row];
    pose->node_count = at.node_count;
    memcpy(pose->position, at.position, (size_t)at.node_count * sizeof *pose->position);
    memcpy(pose->quaternion, at.quaternion, (size_t)at.node_count * sizeof *pose->quaternion);
    for (int i = 0; i < at.node_count; i++) {
        const float *force = at.force + 3 * i;
        pose->node[i] = (NodeReport){.s = at.s[i],
                                     .radius = at.radius[i],
                                     .force = vec3((double)force[0], (double)force[1], (double)force[2]),
                                     .gap = (double)at.gap[i],
                                     .vessel_node = at.vessel_node[i]};
    }
    for (int k = 0; k < pose->tool_count; k++) {
        pose->tool[k].inserted_mm = run->tool[k].inserted[row];
        pose->tool[k].turned_deg = run->tool[k].turned[row];
        if (pose->tool_count > 1)
            own_nodes_from_run(&pose->tool[k], run, k, frame);
    }
    const PoseTool *first = &pose->tool[0];
    find_first_free(pose, scene->wire.has_sheath, pose->tool_count > 1 ? first->node[first->node_count - 1].s : at.s[at.node_count - 1]);
    if (pose->tool_count == 1)
        pose_fill_single_tool(pose);
}
