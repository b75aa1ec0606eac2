#include "sim/pose.h"

#include <stdlib.h>
#include <string.h>

Pose *pose_create_tools(int node_capacity, int tool_count, const int *tool_nodes)
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
        pose->tool[k].node_count = tool_nodes[k];
        pose->tool[k].node = calloc((size_t)tool_nodes[k], sizeof *pose->tool[k].node);
        good = good && pose->tool[k].node;
    }
    if (good)
        return pose;
    pose_free(pose);
    return NULL;
}

Pose *pose_create(int node_count) { return pose_create_tools(node_count, 1, &node_count); }

Pose *pose_create_for(Simulator *simulator)
{
    const Stepper *stepper = simulator_stepper(simulator);
    int nodes[STEP_TOOLS_MAX], count = stepper_tool_count(stepper);
    for (int k = 0; k < count; k++)
        nodes[k] = stepper_tool_nodes(stepper, k, NULL);
    return pose_create_tools(stepper_node_capacity(stepper), count, nodes);
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

// Behind the mouth lies what is not inserted. Without a sheath all of the tool is.
static void find_first_free(Pose *pose, bool has_sheath)
{
    double hidden = has_sheath ? pose->node[pose->node_count - 1].s - pose->inserted_mm : 0;
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
    find_first_free(pose, simulator_scene(simulator)->wire.has_sheath);
    for (int k = 0; k < pose->tool_count; k++) {
        PoseTool *tool = &pose->tool[k];
        tool->command = commands->tool[k];
        tool->inserted_mm = stepper_tool_inserted(stepper, k);
        tool->push_n = pose->report.push[k];
        tool->torque_n_mm = pose->report.torque[k];
        stepper_tool_nodes(stepper, k, tool->node);
    }
}

void pose_from_run(Pose *pose, const Scene *scene, const RecordedRun *run, int64_t frame)
{
    int64_t row = run->frame_step[frame];
    size_t nodes = (size_t)run->node_count, first = (size_t)frame * nodes;
    pose->step = row + 1;
    pose->time_s = run->time_s[row];
    pose->command = (Command){run->command[2 * row], run->command[2 * row + 1]};
    pose->xray = run->xray ? run->xray[row] : xray_default_control();
    pose->inserted_mm = run->inserted[row];
    pose->turned_deg = run->turned[row];
    pose->report = (StepReport){.flags = run->flags[row], .proximal_force = run->proximal[2 * row], .proximal_torque = run->proximal[2 * row + 1],
                                .wall_force_max = run->wall_force[2 * row], .wall_force_sum = run->wall_force[2 * row + 1]};
    memcpy(pose->position, run->position + first, nodes * sizeof *pose->position);
    memcpy(pose->quaternion, run->quaternion + first, nodes * sizeof *pose->quaternion);
    for (size_t i = 0; i < nodes; i++) {
        const float *force = run->force + 3 * (first + i);
        pose->node[i] = (NodeReport){.s = run->s[i], .radius = run->radius[i], .force = vec3((double)force[0], (double)force[1], (double)force[2]),
                                     .gap = (double)run->gap[first + i], .vessel_node = run->vessel_node[first + i]};
    }
    find_first_free(pose, scene->wire.has_sheath);
    PoseTool *tool = &pose->tool[0];
    tool->command = pose->command;
    tool->inserted_mm = pose->inserted_mm;
    tool->push_n = pose->report.proximal_force;
    tool->torque_n_mm = pose->report.proximal_torque;
    for (int j = 0; j < pose->node_count; j++)
        tool->node[j] = (ToolNode){.s = pose->node[j].s, .position = pose->position[j], .orientation = pose->quaternion[j], .radius = pose->node[j].radius,
                                   .carrier = j < pose->first_free_node ? -1 : 0};
}
