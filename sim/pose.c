#include "sim/pose.h"

#include <stdlib.h>
#include <string.h>

Pose *pose_create(int node_count)
{
    Pose *pose = calloc(1, sizeof *pose);
    if (!pose)
        return NULL;
    *pose = (Pose){.node_count = node_count,
                   .position = calloc((size_t)node_count, sizeof *pose->position),
                   .quaternion = calloc((size_t)node_count, sizeof *pose->quaternion),
                   .node = calloc((size_t)node_count, sizeof *pose->node)};
    if (pose->position && pose->quaternion && pose->node)
        return pose;
    pose_free(pose);
    return NULL;
}

void pose_free(Pose *pose)
{
    if (!pose)
        return;
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
}

void pose_take(Pose *pose, Simulator *simulator, Command command, const XrayControl *xray)
{
    const WireState *state = simulator_state(simulator);
    size_t count = (size_t)state->node_count;
    pose->step = simulator_totals(simulator)->steps;
    pose->time_s = simulator_time_s(simulator);
    pose->command = command;
    pose->xray = *xray;
    pose->inserted_mm = state->inserted;
    pose->turned_deg = state->twist * 180 / PI;
    pose->report = *simulator_last(simulator);
    memcpy(pose->position, state->position, count * sizeof *pose->position);
    memcpy(pose->quaternion, state->orientation, count * sizeof *pose->quaternion);
    stepper_node_report(simulator_stepper(simulator), pose->node);
    double hidden = simulator_scene(simulator)->wire.has_sheath ? pose->node[count - 1].s - pose->inserted_mm : 0;
    pose->first_free_node = 0;
    while (pose->first_free_node < state->node_count - 1 && pose->node[pose->first_free_node].s < hidden)
        pose->first_free_node++;
}
