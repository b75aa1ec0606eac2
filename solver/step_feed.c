// Applies the hands' commands of a step, and updates which nodes are in the sheath.
#include "solver/tools_internal.h"

#include <string.h>

// Elements do not describe a tool that is compressed by more than this share of its length (a real one would have yielded), so the hand stalls.
static const double SQUEEZE_MAX = 0.03;
static const double RELEASE_TURN_MAX = 0.1;      // [rad] a node released at the mouth is turned by at most this much
static const double SPRUNG = 0.1;                // of an element's length: with several tools, a node released further out than this stays on the line

// The frame turned by the smallest rotation that aligns e1 with the line's direction.
static Quat on_line(const Stepper *s, Quat q)
{
    Vec3 e = quat_rotate(q, vec3(1, 0, 0)), axis = vec3_cross(e, s->entry.axis[0]);
    return quat_unit(quat_mul((Quat){1 + vec3_dot(e, s->entry.axis[0]), axis.x, axis.y, axis.z}, q));
}

// A node that returns into the sheath is placed on the line. A node that is released, a fiftieth of an element from the mouth, takes the position that the
// short piece behind it, which becomes the element across the mouth, has under the moment there. With the curvature of its own former element, which at a
// section's border may be ten times as soft, the piece would spring.
void stepper_hold(Stepper *s, int node)
{
    SEL_ASSERT(s->entry.has_sheath && node >= 0 && node < s->state.node_count, "the sheath holds a node of the chain");
    WireState *w = &s->state;
    double along = stepper_sheath_coordinate(s, node);
    w->position[node] = vec3_add_scaled(s->entry.mouth, along, s->entry.axis[0]);
    w->orientation[node] = on_line(s, w->orientation[node]);
}

static Vec3 mouth_curvature(const Stepper *s, int node)
{
    SEL_ASSERT(node > 0 && node + 1 < s->state.node_count, "a node that is let go has an element on either side, or is the tip");
    const WireState *w = &s->state;
    const BeamRest *r = &s->beam.rest;
    SheathElement e;
    sheath_element(r, node, s->entry.mouth, s->entry.axis[0], stepper_sheath_coordinate(s, node), w->orientation[node], w->position[node + 1],
                   w->orientation[node + 1], 0, &e);
    Vec3 moment = vec3_add_scaled(e.out.moment1, -vec3_dot(e.out.moment1, s->entry.axis[0]), s->entry.axis[0]);
    return vec3_add_scaled(sheath_rest_curvature(r, node - 1, w->orientation[node]), -1 / r->bending[node - 1], moment);
}

static void release_node(Stepper *s, int node)
{
    WireState *w = &s->state;
    bool is_tip = node + 1 >= s->state.node_count;
    double along = stepper_sheath_coordinate(s, node);
    if (s->tools.count > 1 && !is_tip) {
        if (along > SPRUNG * s->wire.length[node - 1])
            return;
        ToolNode further = tools_further(s, node, along, false);
        w->position[node] = further.position;
        w->orientation[node] = further.orientation;
        return;
    }
    Vec3 curvature = is_tip ? stepper_tip_curvature(s) : mouth_curvature(s, node);
    double bend = vec3_norm(curvature) * along;
    if (bend > RELEASE_TURN_MAX)     // it sprang out of the sheath: the curve is not known that far
        curvature = vec3_scale(curvature, RELEASE_TURN_MAX / bend);
    w->position[node] = vec3_add_scaled(w->position[node], 0.5 * along * along, vec3_cross(curvature, s->entry.axis[0]));
    w->orientation[node] = quat_unit(quat_mul(quat_from_rotation_vector(vec3_scale(curvature, along)), w->orientation[node]));
}

// Nodes up to the mouth and a little beyond it (sheath_border_share) are held; a node that the hand brings back in this step is held from now on.
int stepper_count_held(const Stepper *s, double advance)
{
    if (!s->entry.has_sheath)
        return 0;
    int k = 1;
    while (k < s->state.node_count && stepper_sheath_coordinate(s, k) + fmin(advance, 0) <= sheath_border_share * s->wire.length[k - 1])
        k++;
    return k;
}

// The compression of the tool between hand and mouth, where it slides freely, as a share of its length.
double stepper_squeeze(const Stepper *s, const Vec3 *position) { return 1 - vec3_distance(position[1], position[0]) / s->wire.length[0]; }

// The command plus what earlier steps still owe, without advance into a tool that is compressed too much.
static StepCommand stalled(Stepper *s, StepCommand command)
{
    if (!s->entry.has_sheath)
        return command;
    double actual = s->wire.total_length + stepper_sheath_coordinate(s, 0), missing = s->state.inserted - actual;
    if (fabs(missing) > 1e-9) {
        command.advance += missing;
        s->state.inserted = actual;
    }
    if (command.advance > 0 && stepper_squeeze(s, s->state.position) > SQUEEZE_MAX) {
        command.advance = 0;
        s->report.flags |= STEP_LIMITED;
    }
    return command;
}

// With coaxial tools, a contact solve starts from the expected motion: that of the previous step.
static void expect_last_motion(Stepper *s)
{
    memset(s->system.u, 0, row_of(s, s->state.node_count) * sizeof *s->system.u);
    for (int i = s->first_free; i < s->state.node_count; i++) {
        double *u = s->system.u + row_of(s, i);
        Vec3 moves = vec3_scale(s->state.velocity[i], s->dt), turns = vec3_scale(s->state.spin[i], s->dt);
        u[0] = moves.x, u[1] = moves.y, u[2] = moves.z;
        u[3] = turns.x, u[4] = turns.y, u[5] = turns.z;
    }
}

// Starts the step at the state's pose.
void stepper_begin(Stepper *s)
{
    size_t nodes = (size_t)s->state.node_count;
    memcpy(s->start.position, s->state.position, nodes * sizeof *s->start.position);
    memcpy(s->start.orientation, s->state.orientation, nodes * sizeof *s->start.orientation);
    size_t inner = nodes * (size_t)s->state.inner_count * sizeof(double);
    memcpy(s->start.slide, s->state.slide, inner);
    memcpy(s->start.angle, s->state.angle, inner);
    memset(s->iterate.moved, 0, row_of(s, s->state.node_count) * sizeof *s->iterate.moved);
    memset(s->iterate.seen, 0, row_of(s, s->state.node_count) * sizeof *s->iterate.seen);
    s->iterate.is_moved = s->progress.overshoots = s->progress.makes_energy = s->progress.is_blocked = false;
    s->progress.hand_tries = s->progress.looks = 0;
    s->start.knows_energy = false;
    s->iterate.mouth_ahead = s->command.advance;
    s->iterate.slides = stepper_slides(s);
    if (s->tools.count > 1)
        expect_last_motion(s);
}

static void feed(Stepper *s, unsigned released)
{
    hands_feed(s, released);
    StepCommand command = s->hands.command[0];
    s->start.wall_force_max = s->report.wall_force_max;
    s->start.wall_force_sum = s->report.wall_force_sum;
    s->report = (StepReport){0};
    s->iterate.knows_motion = false;
    s->progress = (StepProgress){0};
    if (!s->entry.has_sheath)
        command = (StepCommand){0};
    double inserted = s->state.inserted + command.advance, total = s->wire.total_length;
    if (inserted > total) {
        s->report.flags |= STEP_FULLY_INSERTED;
        command.advance = total - s->state.inserted;
    } else if (inserted < 0) {
        s->report.flags |= STEP_FULLY_WITHDRAWN;
        command.advance = -s->state.inserted;
    }
    s->command = stalled(s, command);
    command = s->command;
    s->hands.command[0] = command;
    if (s->tools.count > 1)
        tools_feed(s);
    int held = stepper_count_held(s, command.advance);
    SEL_ASSERT(held >= 0 && held <= s->state.node_count, "the sheath holds nodes of the chain");
    for (int i = s->first_free; i < held; i++) {
        stepper_hold(s, i);
        stepper_forget(s, i);
    }
    for (int i = s->first_free - 1; i >= held; i--)
        release_node(s, i);
    s->first_free = held;
    memcpy(s->points.start_force, s->points.force, (size_t)s->points.count * sizeof *s->points.force);
    stepper_begin(s);
}

void step_feed_tools(Stepper *s, const StepCommand *command, unsigned released)
{
    rest_feed(s, command, released);
    memcpy(s->hands.command, command, (size_t)s->tools.count * sizeof *command);
    feed(s, released);
}

void step_feed(Stepper *s, StepCommand command)
{
    StepCommand all[STEP_TOOLS_MAX] = {command};
    step_feed_tools(s, all, 0);
}
