// Candidates at the iterate: free nodes whose gap could close in this step. A node that is certainly further away is not asked again
// before it has travelled that far (DESIGN section 5).
#include "solver/step_internal.h"

static const double REACH = 0.3;         // [mm] candidates beyond what the nodes' speed asks for: contact forces can push neighbours about
static const double REACH_MAX = 5;       // [mm]
static const double STEP_OUT_MAX = 0.2;  // [mm] a deep node is brought back by this much a step, not thrown
static const double DEEP = 0.2;          // [mm] STEP_DEEP
static const double OVERSHOOT_TRAVEL = 0.05;   // [mm] a node that the solution moves less is where its linearised wall is

// [mm] by which the solution moves a node from the iterate.
static double travel(const Stepper *s, int node)
{
    const double *u = s->u + 6 * (size_t)node, *k = s->linearised + 6 * (size_t)node;
    return vec3_norm(vec3(u[0] - k[0], u[1] - k[1], u[2] - k[2]));
}

bool stepper_escapes(const Stepper *s)
{
    if (!s->vessel)
        return false;
    for (int i = s->first_free; i < s->state.node_count; i++)
        if (travel(s, i) > s->room[i])
            return true;
    return false;
}

// How far beyond its present gap a node is looked after.
static double reach_of(const Stepper *s, int node)
{
    if (s->knows_motion)
        return fmin(REACH_MAX, REACH + 1.5 * travel(s, node));
    return fmin(REACH_MAX, REACH + fabs(s->command.advance) + 2 * s->dt * vec3_norm(s->state.velocity[node]));
}

static void locate(Stepper *s, int node)
{
    VesselMemory *place = s->place;
    int from = -1;
    if (node > s->first_free && place[node - 1].node >= 0)
        from = place[node - 1].node;
    else if (node + 1 < s->state.node_count && place[node + 1].node >= 0)
        from = place[node + 1].node;
    place[node] = (VesselMemory){.node = s->vessel->locate(s->vessel, s->state.position[node], from)};
}

double stepper_overshoot(Stepper *s)
{
    int count = 0;
    double deepest = 0;
    for (int i = s->first_free; s->vessel && i < s->state.node_count; i++) {
        if (s->place[i].node < 0 || s->clearance[i] > travel(s, i) || travel(s, i) < OVERSHOOT_TRAVEL)
            continue;
        const double *u = s->u + 6 * (size_t)i, *k = s->linearised + 6 * (size_t)i;
        s->query_node[count] = i;
        s->query_point[count] = vec3_add(s->state.position[i], vec3(u[0] - k[0], u[1] - k[1], u[2] - k[2]));
        s->query_place[count++] = s->place[i];
    }
    if (count > 0)
        vessel_query(s->vessel, count, s->query_point, 0.5, s->query_place, s->query_hit);
    for (int k = 0; k < count; k++)
        if (!(s->query_hit[k].flags & (VESSEL_FAR | VESSEL_OPEN_END)))
            deepest = fmax(deepest, s->wire.radius[s->query_node[k]] - s->query_hit[k].gap);
    return deepest;
}

static int query(Stepper *s)
{
    int count = 0, nodes = s->state.node_count;
    double reach = 0;
    for (int i = 0; i < s->first_free; i++) {
        s->place[i].node = -1;
        s->place[i].has_foot = false;
        s->clearance[i] = 0;
    }
    for (int i = s->first_free; i < nodes; i++) {
        s->room[i] = HUGE_VAL;
        if (s->clearance[i] > 0 && s->knows_motion && travel(s, i) > s->clearance[i])
            s->clearance[i] = 0;
        if (s->clearance[i] > 0)
            s->room[i] = s->clearance[i];
        if (s->clearance[i] > 0 || (s->fixed[i] & DOF_POSITION) == DOF_POSITION)
            continue;
        if (s->place[i].node < 0)
            locate(s, i);
        s->query_node[count] = i;
        s->query_point[count] = s->state.position[i];
        s->query_place[count++] = s->place[i];
        reach = fmax(reach, reach_of(s, i) + s->wire.radius[i]);
    }
    // distances grow with what is asked for: twice the reach lets most far nodes sleep for a while
    if (count > 0)
        vessel_query(s->vessel, count, s->query_point, 2 * reach, s->query_place, s->query_hit);
    return count;
}

static void add_candidate(Stepper *s, int node, const VesselHit *hit, double gap)
{
    double friction = s->wire.friction[node] >= 0 ? s->wire.friction[node] : s->wall_friction, radius = s->wire.radius[node];
    double target = fmax(gap, -STEP_OUT_MAX);
    if (s->is_iterate) {
        // unknowns are displacements from x_n: take off what has been done already
        const double *u = s->linearised + 6 * (size_t)node;
        Vec3 arm = vec3_scale(hit->normal, -radius);
        Vec3 moved = vec3_add(vec3(u[0], u[1], u[2]), vec3_cross(vec3(u[3], u[4], u[5]), arm));
        target -= vec3_dot(moved, hit->normal);
    }
    s->set.point[s->set.count++] = (ContactPoint){.node = node, .normal = hit->normal, .gap = target, .hessian = hit->hessian,
                                                  .friction = friction, .tool_radius = radius, .force = s->force[node]};
}

void stepper_detect(Stepper *s)
{
    s->set.count = 0;
    if (!s->vessel)
        return;
    int count = query(s);
    bool was_inside = false;
    unsigned flags = 0;
    int next = s->first_free;
    for (int k = 0; k < count; k++) {
        int i = s->query_node[k];
        const VesselHit *hit = &s->query_hit[k];
        s->place[i] = s->query_place[k];
        was_inside |= next < i;
        next = i + 1;
        double gap = hit->gap - s->wire.radius[i], reach = reach_of(s, i);
        if (hit->flags & VESSEL_OPEN_END) {
            if (was_inside)
                flags |= STEP_OUT_OF_VESSEL;
            s->force[i] = vec3(0, 0, 0);
            continue;
        }
        was_inside = true;
        if (hit->flags & VESSEL_UNSURE)
            flags |= STEP_DETECTION_UNSURE;
        if (!s->is_iterate) {
            s->report.penetration = fmax(s->report.penetration, -gap);
            flags |= gap < -DEEP ? STEP_DEEP : 0;
        }
        if ((hit->flags & VESSEL_FAR) || !(gap < reach) || !vec3_is_finite(hit->normal)) {
            s->force[i] = vec3(0, 0, 0);
            s->room[i] = gap;
            if (gap > reach)
                s->clearance[i] = gap - reach;
            continue;
        }
        add_candidate(s, i, hit, gap);
    }
    s->report.candidates = s->set.count;
    if (!s->is_iterate)      // an iterate may be anywhere
        s->report.flags |= flags;
}
