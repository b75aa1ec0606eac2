// Measures the cases of a VerifyPlan while a simulator runs.
#include "sim/simulator.h"
#include "base/base.h"
#include "sim/verify.h"

#include <stdlib.h>

static const double deg = 180 / PI;

typedef struct Trace {       // one case over its time
    int count;               // samples
    double first, last, before, sum, least, most, jump;
    Vec3 first_point;
    // crossings of the level, and turning points around it
    int crossings, peaks;
    double first_cross_s, last_cross_s, first_peak, last_peak;
} Trace;

struct VerifyMeasure {
    const VerifyPlan *plan;
    Simulator *simulator;
    NodeReport *node;        // (M) of the centreline, as of node_step
    int64_t node_step;
    int own_count[STEP_TOOLS_MAX];
    ToolNode *own[STEP_TOOLS_MAX];       // of each tool, as of own_step
    int64_t own_step[STEP_TOOLS_MAX];
    Trace *trace;            // (case_count)
};

VerifyMeasure *verify_measure_create(const VerifyPlan *plan, Simulator *simulator)
{
    VerifyMeasure *m = calloc(1, sizeof *m);
    if (!m)
        return NULL;
    *m = (VerifyMeasure){.plan = plan, .simulator = simulator, .node_step = -1};
    const Stepper *stepper = simulator_stepper(simulator);
    m->node = calloc((size_t)stepper_node_capacity(stepper), sizeof *m->node);
    m->trace = calloc((size_t)plan->case_count + 1, sizeof *m->trace);
    bool good = m->node && m->trace;
    for (int k = 0; k < stepper_tool_count(stepper); k++) {
        m->own_step[k] = -1;
        m->own[k] = calloc((size_t)scene_most_nodes(simulator_scene(simulator), k), sizeof *m->own[k]);
        good = good && m->own[k];
    }
    if (good)
        return m;
    verify_measure_free(m);
    return NULL;
}

void verify_measure_free(VerifyMeasure *m)
{
    for (int k = 0; m && k < STEP_TOOLS_MAX; k++)
        free(m->own[k]);
    if (m) {
        free(m->node);
        free(m->trace);
    }
    free(m);
}

// Arc lengths, forces and gaps of the nodes at the present state: queried at most once per step, and only if a case needs them.
static const NodeReport *nodes_now(VerifyMeasure *m)
{
    int64_t step = simulator_totals(m->simulator)->steps;
    if (m->node_step != step)
        stepper_node_report(simulator_stepper(m->simulator), m->node);
    m->node_step = step;
    return m->node;
}

// The own nodes of a tool, queried in the same way.
static const ToolNode *own_now(VerifyMeasure *m, int tool)
{
    int64_t step = simulator_totals(m->simulator)->steps;
    if (m->own_step[tool] != step)
        m->own_count[tool] = stepper_tool_nodes(simulator_stepper(m->simulator), tool, m->own[tool]);
    m->own_step[tool] = step;
    return m->own[tool];
}

// The element that contains s and the fraction of it up to s, 0 to 1.
static int element_at(const ToolNode *node, int count, double s, double *part)
{
    int i = 0;
    while (i + 2 < count && node[i + 1].s <= s)
        i++;
    *part = fmin(1, fmax(0, (s - node[i].s) / (node[i + 1].s - node[i].s)));
    return i;
}

// Position and tangent between nodes: the cubic through both positions and tangents.
static void point_at(VerifyMeasure *m, const VerifyCase *c, Vec3 *point, Vec3 *tangent)
{
    double x;
    const ToolNode *node = own_now(m, c->tool);
    int i = element_at(node, m->own_count[c->tool], c->s_mm, &x);
    double length = node[i + 1].s - node[i].s;
    Vec3 t1 = quat_rotate(node[i].orientation, vec3(1, 0, 0)), t2 = quat_rotate(node[i + 1].orientation, vec3(1, 0, 0));
    Vec3 chord = vec3_sub(node[i + 1].position, node[i].position);
    *point = vec3_add_scaled(node[i].position, x * x * (3 - 2 * x), chord);
    *point = vec3_add_scaled(*point, length * x * (1 - x) * (1 - x), t1);
    *point = vec3_add_scaled(*point, -length * x * x * (1 - x), t2);
    *tangent = vec3_scale(chord, 6 * x * (1 - x) / length);
    *tangent = vec3_add_scaled(*tangent, 1 - 4 * x + 3 * x * x, t1);
    *tangent = vec3_unit(vec3_add_scaled(*tangent, x * (3 * x - 2), t2));
}

// Rotation about the tool's axis from one arc length to another, summed over elements, so that it counts whole turns.
static double twist_between(VerifyMeasure *m, const VerifyCase *c)
{
    const ToolNode *node = own_now(m, c->tool);
    double sum = 0;
    for (int i = 0; i + 1 < m->own_count[c->tool]; i++) {
        double length = node[i + 1].s - node[i].s, part = (fmin(c->s_mm, node[i + 1].s) - fmax(c->from_s_mm, node[i].s)) / length;
        Quat p = quat_mul(quat_conjugate(node[i].orientation), node[i + 1].orientation);
        if (part > 0)
            sum += part * 2 * same_atan2(p.w < 0 ? -p.x : p.x, fabs(p.w));
    }
    return sum;
}

static double of_range(VerifyMeasure *m, const VerifyCase *c)
{
    const WireState *w = simulator_state(m->simulator);
    const NodeReport *node = nodes_now(m);
    Vec3 sum = vec3(0, 0, 0), moment = vec3(0, 0, 0);
    double size = 0, size_s = 0, deepest = 0, slack = 1e-9 * (1 + fmin(c->s_mm, 1e5));
    int contacts = 0;
    for (int i = 0; i < w->node_count; i++) {
        if (node[i].s < c->from_s_mm - slack || node[i].s > c->s_mm + slack)
            continue;
        double force = vec3_norm(node[i].force);
        sum = vec3_add(sum, node[i].force);
        moment = vec3_add(moment, vec3_cross(vec3_sub(w->position[i], c->origin), node[i].force));
        size += force;
        size_s += force * node[i].s;
        contacts += force > 0;
        deepest = fmax(deepest, -node[i].gap);
    }
    switch (c->quantity) {
    case VERIFY_WALL_FORCE: return c->has_axis ? vec3_dot(sum, c->axis) : size;
    case VERIFY_WALL_MOMENT: return vec3_dot(moment, c->axis);
    case VERIFY_WALL_CENTRE: return size > 0 ? size_s / size : NAN;
    case VERIFY_CONTACTS: return contacts;
    default: return deepest;
    }
}

// `point`: set to the place, for a change of position without an axis.
static double value_now(VerifyMeasure *m, const VerifyCase *c, Vec3 *point)
{
    Stepper *stepper = simulator_stepper(m->simulator);
    Vec3 tangent;
    switch (c->quantity) {
    case VERIFY_POSITION: {
        point_at(m, c, point, &tangent);
        Vec3 away = vec3_sub(*point, c->origin);
        return c->has_axis ? vec3_dot(away, c->axis) : vec3_norm(away);
    }
    case VERIFY_TANGENT: point_at(m, c, point, &tangent); return vec3_angle(tangent, c->axis) * deg;
    case VERIFY_TWIST: return twist_between(m, c) * deg;
    case VERIFY_PUSH_FORCE: return simulator_last(m->simulator)->push[c->tool];
    case VERIFY_PUSH_TORQUE: return simulator_last(m->simulator)->torque[c->tool];
    case VERIFY_ELASTIC_ENERGY: return stepper_elastic_energy(stepper);
    case VERIFY_KINETIC_ENERGY: return stepper_kinetic_energy(stepper);
    case VERIFY_SPEED: return simulator_fastest_mm_s(m->simulator);
    default: return of_range(m, c);
    }
}

// A crossing is found by linear interpolation between two samples, a turning point by a parabola through three.
static void oscillate(Trace *trace, double level, double value, double time_s, double step_s)
{
    double now = value - level, last = trace->last - level, before = trace->before - level;
    if (trace->count > 0 && (now > 0) != (last > 0)) {
        double at = time_s - step_s * now / (now - last);
        if (trace->crossings++ == 0)
            trace->first_cross_s = at;
        trace->last_cross_s = at;
    }
    if (trace->count > 1 && (now - last) * (last - before) < 0) {
        double slope = (now - before) / 2, bend = now - 2 * last + before, peak = fabs(last - slope * slope / (2 * bend));
        if (trace->peaks++ == 0)
            trace->first_peak = peak;
        trace->last_peak = peak;
    }
}

static void sample(VerifyMeasure *m, const VerifyCase *c, Trace *trace, double time_s, double step_s)
{
    Vec3 point = vec3(0, 0, 0);
    double value = value_now(m, c, &point);
    if (trace->count == 0) {
        trace->first = trace->least = trace->most = value;
        trace->first_point = point;
    } else {
        trace->jump = fmax(trace->jump, fabs(value - trace->last));
    }
    if (c->take == TAKE_CHANGE)
        value = c->quantity == VERIFY_POSITION && !c->has_axis ? vec3_distance(point, trace->first_point) : value - trace->first;
    oscillate(trace, c->level, value, time_s, step_s);
    trace->least = fmin(trace->least, value);
    trace->most = fmax(trace->most, value);
    trace->sum += value;
    trace->before = trace->last;
    trace->last = value;
    trace->count++;
}

void verify_measure_step(VerifyMeasure *m, bool is_end)
{
    double time_s = simulator_time_s(m->simulator), step_s = simulator_scene(m->simulator)->dt / 1000, slack = 1e-6 * step_s;
    for (int i = 0; i < m->plan->case_count; i++) {
        const VerifyCase *c = &m->plan->cases[i];
        Trace *trace = &m->trace[i];
        if (time_s > c->t_s + slack || time_s < c->from_t_s - slack)
            continue;
        // a single moment
        if (c->take == TAKE_LAST && (c->t_s < HUGE_VAL ? time_s < c->t_s - step_s * 0.999 : !is_end))
            continue;
        if (is_end && c->take != TAKE_LAST)
            continue;
        sample(m, c, trace, time_s, step_s);
    }
}

double verify_measure_result(const VerifyMeasure *m, int index)
{
    const VerifyCase *c = &m->plan->cases[index];
    const Trace *t = &m->trace[index];
    double step_s = simulator_scene(m->simulator)->dt / 1000, value = t->last;
    bool reached = t->count > 0 && (c->t_s == HUGE_VAL || simulator_time_s(m->simulator) > c->t_s - step_s * 0.999);
    if (!reached)
        return NAN;
    switch (c->take) {
    case TAKE_LAST:
    case TAKE_CHANGE: break;
    case TAKE_MEAN: value = t->sum / t->count; break;
    case TAKE_LEAST: value = t->least; break;
    case TAKE_MOST: value = t->most; break;
    case TAKE_JUMP: value = t->jump; break;
    case TAKE_FREQUENCY: value = t->crossings > 1 ? 0.5 * (t->crossings - 1) / (t->last_cross_s - t->first_cross_s) : NAN; break;
    case TAKE_DECAY: value = t->peaks > 1 ? same_pow(t->last_peak / t->first_peak, 2.0 / (t->peaks - 1)) : NAN; break;
    }
    return value / c->scale;
}
