// Coaxial tools on one chain of nodes. The chain consists of the nodes of the outermost tool from its hub to its tip, then those of the next tool that extends
// beyond it, and so on; each node belongs to its carrier. A tool that lies inside another has two unknowns at a node, its material coordinate and its angle. As
// tools slide, nodes are added and removed at the tips (where a tool emerges from the one around it), and unknowns where an inner tip passes a node.
#include "solver/tools_internal.h"

#include "base/base.h"

#include <stdlib.h>
#include <string.h>

// A node that has emerged from the tip around it joins the chain at this share of its element from the tip, and leaves the chain when closer than that.
static const double JOIN = 0.05, LEAVE = 0.04;
// Exceptions: a tool's last node that presses on the wall leaves only here, and it joins from here on if it emerges far within one step, because no other part
// of the tool touches the wall.
static const double LEAST_OUT = 0.01;
// A tip past the end of its element would be cut off there. It is therefore assigned to the next element this share of the element early, and back to the
// previous one that much late; this is more than strain and friction can move it from the position that the hands give. The part of a span past its tip does
// not bend.
static const double EARLY = 0.01;
static const double MOUTH_BORDER = 0.1;          // of a tool's shortest element: the distance over which a border of its rest shape passes the sheath's mouth
static const double TAKE_BACK = 0.002;           // of an element's length past the tip around it: a node that would end closer to it leaves the chain

// --- creation ---

static bool make_tool(Tool *t, const WireOptions *o, char *why, int capacity)
{
    if (!wire_create(&t->wire, o, why, capacity))
        return false;
    size_t e = (size_t)t->wire.element_count, padded = e + 1 + BEAM_PADDING;
    int sections = o->section_count;
    t->rest_memory = calloc(BEAM_REST_ARRAYS * padded, sizeof *t->rest_memory);
    t->section = calloc((size_t)sections, sizeof *t->section);
    t->line_mass = calloc(2 * (size_t)sections, sizeof *t->line_mass);
    t->slot_start = calloc(e + 1, sizeof *t->slot_start);
    if (!t->rest_memory || !t->section || !t->line_mass || !t->slot_start)
        return false;
    t->line_inertia = t->line_mass + sections;
    double *at = t->rest_memory;
    double **array[] = {&t->rest.length, &t->rest.extend, &t->rest.axial,  &t->rest.near,      &t->rest.far,     &t->rest.twist,
                        &t->rest.half_w, &t->rest.half_y, &t->rest.half_z, &t->rest.curvature, &t->rest.bending, &t->rest.shear};
    for (size_t k = 0; k < sizeof array / sizeof *array; k++, at += padded)
        *array[k] = at;
    wire_rest(&t->wire, o, &t->rest);
    double end = 0;
    for (int i = 0; i < sections; i++) {
        const WireSection *section = &o->section[i];
        WireStiffness stiffness = wire_stiffness(section);
        end += section->length;
        t->section[i] = (CoaxialSection){end,
                                         stiffness.bending,
                                         stiffness.axial,
                                         stiffness.torsion,
                                         stiffness.shear,
                                         {section->rest_curvature * same_cos(section->rest_plane), section->rest_curvature * same_sin(section->rest_plane)}};
        t->line_mass[i] = stiffness.line_mass;
        t->line_inertia[i] = stiffness.line_inertia;
    }
    t->coaxial = (CoaxialTool){sections, t->section};
    for (size_t i = 0; i < e; i++)
        t->slot_start[i + 1] = t->slot_start[i] + slot_count_of(t->wire.length[i]);
    t->slot = calloc((size_t)t->slot_start[e] + 1, sizeof *t->slot);
    for (size_t i = 0; t->slot && i < e; i++) {
        const WireSection *section = &o->section[t->wire.section[i]];
        int count = t->slot_start[i + 1] - t->slot_start[i];
        for (int k = 0; k < count; k++)
            t->slot[t->slot_start[i] + k] = slot_make((int)i, t->wire.length[i], k, count, section->diameter / 2, section->friction);
    }
    double shortest = HUGE_VAL;
    for (size_t i = 0; i < e; i++)
        shortest = fmin(shortest, t->wire.length[i]);
    t->border = MOUTH_BORDER * shortest;
    t->inserted = fmin(o->inserted, t->wire.total_length);
    t->hand_limit = o->hand_limit;
    t->valve_friction = o->valve_friction;
    t->lumen = HUGE_VAL;
    for (int i = 0; i < sections; i++) {
        t->lumen = fmin(t->lumen, o->section[i].inner_diameter);
        t->widest = fmax(t->widest, o->section[i].diameter);
    }
    return t->slot != NULL;
}

double tools_clearance(const Tool *around, const Tool *inner) { return fmax(0.5 * (around->lumen - inner->widest), 1e-3 * inner->widest); }

static Tool *make_device(Stepper *s, int k, const WireOptions *options, char *why, int capacity)
{
    WireOptions own = *options;
    if (k > 0)       // its start and supports are those of the outermost tool
        own.has_sheath = true, own.fix_count = own.load_count = 0, own.start = own.normal = vec3(0, 0, 0), own.direction = vec3(1, 0, 0);
    if (k == 0 && !own.has_sheath)
        own.inserted = wire_length(&own);
    Tool *t = calloc(1, sizeof *t);
    s->tools.device[k][s->tools.spare_count[k]] = t;
    return t && make_tool(t, &own, why, capacity) ? t : NULL;
}

static bool make_spares(Stepper *s, const StepperOptions *o, char *why, int capacity)
{
    for (int i = 0; i < o->spare_count; i++) {
        const StepperSpare *spare = &o->spare[i];
        int k = spare->tool;
        if (k < 0 || k >= s->tools.count || s->tools.spare_count[k] == STEP_SPARES_MAX) {
            snprintf(why, (size_t)capacity, "spare %d is for tool %d; 0 to %d, at most %d for each", i + 1, k, s->tools.count - 1, STEP_SPARES_MAX);
            return false;
        }
        s->tools.spare_count[k]++;
        Tool *t = make_device(s, k, &spare->wire, why, capacity);
        if (!t)
            return false;
        t->friction_inside = spare->friction_inside;
    }
    return true;
}

// Computes the capacity for the longest chain that the tools and their spares can form.
static void measure_chain(Stepper *s)
{
    for (int k = 0; k < s->tools.count; k++) {
        int nodes = 0, slots = 0;
        for (int i = 0; i <= s->tools.spare_count[k]; i++) {
            const Tool *t = s->tools.device[k][i];
            int own = t->slot_start[t->wire.element_count];
            nodes = t->wire.node_count > nodes ? t->wire.node_count : nodes;
            slots = own > slots ? own : slots;
        }
        s->tools.capacity += nodes;
        s->points.slot_count += slots;
    }
}

bool tools_create(Stepper *s, const StepperOptions *o, char *why, int capacity)
{
    why[0] = '\0';
    for (int k = 0; k < s->tools.count; k++) {
        Tool *t = make_device(s, k, k == 0 ? &o->wire : &o->inner[k - 1], why, capacity);
        if (!t)
            return false;
        t->friction_inside = k + 1 < s->tools.count ? o->inner_friction[k] : 0;
        s->tools.tool[k] = *t;
    }
    if (!make_spares(s, o, why, capacity))
        return false;
    measure_chain(s);
    s->tools.inside = calloc((size_t)s->tools.capacity, sizeof *s->tools.inside);
    if (!s->tools.inside)
        return false;
    for (int k = 1; k < s->tools.count; k++) {
        const Tool *around = &s->tools.tool[k - 1];
        Tool *t = &s->tools.tool[k];
        t->friction = around->friction_inside;
        t->clearance = tools_clearance(around, t);
        if (t->wire.total_length - t->inserted < around->wire.total_length - around->inserted - 1e-9) {
            snprintf(why, (size_t)capacity, "tool %d is too short: its proximal end would lie %g mm inside the hub of the tool around it; it must not", k + 1,
                     around->wire.total_length - around->inserted - (t->wire.total_length - t->inserted));
            return false;
        }
    }
    return true;
}

void tools_destroy(Stepper *s)
{
    free(s->tools.inside);
    for (int k = 0; k < STEP_TOOLS_MAX; k++)
        for (int i = 0; i <= STEP_SPARES_MAX && s->tools.device[k][i]; i++) {
            Tool *t = s->tools.device[k][i];
            wire_destroy(&t->wire);
            free(t->rest_memory);
            free(t->section);
            free(t->line_mass);
            free(t->slot);
            free(t->slot_start);
            free(t);
        }
}

// --- the chain ---

static void chain_node(Stepper *s, int c, int k, int j)
{
    const Tool *t = &s->tools.tool[k];
    Wire *w = &s->wire;
    s->tools.carrier[c] = k;
    w->s[c] = t->wire.s[j];
    w->mass[c] = t->wire.mass[j];
    w->inertia_axial[c] = t->wire.inertia_axial[j];
    w->inertia_lateral[c] = t->wire.inertia_lateral[j];
    w->radius[c] = t->wire.radius[j];
    w->friction[c] = t->wire.friction[j];
}

// Copies the element before chain node c.
static void chain_element(Stepper *s, int c, int k, int j)
{
    const Tool *t = &s->tools.tool[k];
    s->wire.length[c] = t->wire.length[j];
    s->wire.section[c] = t->wire.section[j];
    const BeamRest *from = &t->rest;
    BeamRest *to = &s->beam.rest;
    to->length[c] = from->length[j], to->extend[c] = from->extend[j], to->axial[c] = from->axial[j], to->near[c] = from->near[j], to->far[c] = from->far[j];
    to->twist[c] = from->twist[j], to->half_w[c] = from->half_w[j], to->half_y[c] = from->half_y[j], to->half_z[c] = from->half_z[j];
    to->curvature[c] = from->curvature[j], to->bending[c] = from->bending[j], to->shear[c] = from->shear[j];
    int first = s->points.slot_start[c], count = t->slot_start[j + 1] - t->slot_start[j];
    for (int i = 0; i < count; i++) {
        s->points.slot[first + i] = t->slot[t->slot_start[j] + i];
        s->points.slot[first + i].element = c;
    }
    s->points.slot_start[c + 1] = first + count;
}

// Builds the chain from the nodes at which each tool begins to carry it.
void tools_chain(Stepper *s)
{
    int c = 0;
    s->points.slot_start[0] = 0;
    for (int k = 0; k < s->tools.count; k++) {
        Tool *t = &s->tools.tool[k];
        t->start = c;
        for (int j = t->first; j < t->wire.node_count; j++, c++) {
            chain_node(s, c, k, j);
            if (c > 0)
                chain_element(s, c - 1, k, j - 1);
        }
    }
    s->wire.node_count = s->state.node_count = s->system.chain.count = c;
    s->wire.element_count = c - 1;
    s->wire.total_length = s->tools.tool[0].wire.total_length;
    s->points.slot_count = s->points.slot_start[c - 1];
    s->points.count = c + s->points.slot_count;
    for (int k = 1; k < s->tools.count; k++)
        if (tools_carries(&s->tools.tool[k]))
            s->tools.tool[k].inside = s->tools.tool[k].start;
}

void tools_place(Stepper *s)
{
    double tip = s->tools.tool[0].inserted;
    s->tools.tool[0].first = 0;
    for (int k = 1; k < s->tools.count; k++) {
        Tool *t = &s->tools.tool[k];
        double behind = t->wire.total_length - t->inserted;
        t->first = t->wire.node_count;
        if (!(t->inserted > tip))
            continue;
        for (int j = t->wire.node_count - 1; j > 0 && t->wire.s[j] - behind > tip + JOIN * t->wire.length[j - 1]; j--)
            t->first = j;
        tip = t->inserted;
    }
    tools_chain(s);
    for (int c = 0; c < s->state.node_count; c++) {
        const Tool *own = &s->tools.tool[s->tools.carrier[c]];
        double x = s->wire.s[c] - own->wire.total_length + own->inserted;
        s->state.position[c] = vec3_add_scaled(s->entry.mouth, x, s->entry.axis[0]);
        s->state.orientation[c] = s->entry.frame;
        for (int k = 1; k < s->tools.count; k++)
            s->state.slide[c * s->state.inner_count + k - 1] = s->tools.tool[k].wire.total_length - s->tools.tool[k].inserted + x;
    }
    for (int k = 1; k < s->tools.count; k++) {
        Tool *t = &s->tools.tool[k];
        for (t->inside = 0; t->inside < (tools_carries(t) ? t->start : s->state.node_count); t->inside++)
            if (slide_at(s, t->inside, k) >= t->wire.total_length)
                break;
    }
}

// --- adding and removing nodes ---

// Inserts a gap of so many entries at a position, or removes that many (< 0).
static void change_gap(void *base, size_t size, int count, int at, int gap)
{
    char *p = (char *)base + (size_t)at * size;
    if (gap < 0) {
        memmove(p, p + (size_t)-gap * size, (size_t)(count - at + gap) * size);
        return;
    }
    memmove(p + (size_t)gap * size, p, (size_t)(count - at) * size);
    memset(p, 0, (size_t)gap * size);
}

// Inserts or removes entries in the arrays of the state and of the wall, which are indexed by nodes or by points; arrays of points hold the nodes first, then
// the slots.
static void shift_at(Stepper *s, int node, int nodes, int slot, int slots)
{
    WireState *w = &s->state;
    int count = w->node_count, points = s->points.count, first = count + slot;
    size_t inner = (size_t)w->inner_count * sizeof(double);
    struct {
        void *base;
        size_t size;
    } by_node[] = {{w->position, sizeof(Vec3)}, {w->orientation, sizeof(Quat)}, {w->velocity, sizeof(Vec3)}, {w->spin, sizeof(Vec3)},    {w->slide, inner},
                   {w->angle, inner},           {w->slide_velocity, inner},     {w->slide_spin, inner},      {w->slide_force, 3 * inner}},
      by_point[] = {{s->points.force, sizeof(Vec3)},
                    {s->points.start_force, sizeof(Vec3)},
                    {s->points.clearance, sizeof(double)},
                    {s->points.met, sizeof(WallMet)},
                    {s->points.place, sizeof(VesselMemory)}};
    for (size_t i = 0; i < sizeof by_node / sizeof *by_node; i++)
        change_gap(by_node[i].base, by_node[i].size, count, node, nodes);
    for (size_t i = 0; i < sizeof by_point / sizeof *by_point; i++) {
        change_gap(by_point[i].base, by_point[i].size, points, first, slots);
        change_gap(by_point[i].base, by_point[i].size, points + slots, node, nodes);
    }
}

// Inserts or removes chain node c with its element, which is the one before it.
static void shift(Stepper *s, int c, int slots, bool opens) { shift_at(s, c, opens ? 1 : -1, s->points.slot_start[c - 1], opens ? slots : -slots); }

// --- the outermost tool's exchange ---

// `turn` [rad]: the rotation of the node about the line relative to the hub.
static Inside inside_at_node(const Stepper *s, int c, double turn)
{
    Inside at = {
        .x = stepper_sheath_coordinate(s, c),
    };
    const WireState *w = &s->state;
    for (int k = 0; k < w->inner_count; k++) {
        int i = c * w->inner_count + k;
        const double value[4] = {w->slide[i], w->angle[i] + turn, w->slide_velocity[i], w->slide_spin[i]};
        memcpy(at.value[k], value, sizeof value);
    }
    return at;
}

// The state at x [mm]: interpolated between two nodes, or extrapolated behind the hub with the same strain.
static Inside inside_between(const Inside *a, const Inside *b, double x, int inner_count)
{
    double xi = (x - a->x) / (b->x - a->x);
    Inside at = {.x = x};
    for (int k = 0; k < inner_count; k++)
        for (int i = 0; i < 4; i++)
            at.value[k][i] = a->value[k][i] + xi * (b->value[k][i] - a->value[k][i]);
    return at;
}

void tools_exchange_outermost(Stepper *s, const Tool *next)
{
    WireState *w = &s->state;
    int old_nodes = s->tools.tool[0].wire.node_count, nodes = next->wire.node_count, more = nodes - old_nodes;
    int old_slots = s->points.slot_start[old_nodes - 1], slots = next->slot_start[next->wire.element_count], more_slots = slots - old_slots;
    double tip = stepper_sheath_coordinate(s, old_nodes - 1), turn = 0;
    Inside *old = s->tools.inside;
    for (int c = 0; c < old_nodes; c++) {
        Quat p = c > 0 ? quat_mul(quat_conjugate(w->orientation[c - 1]), w->orientation[c]) : (Quat){1, 0, 0, 0};
        old[c] = inside_at_node(s, c, turn += 2 * same_atan2(p.x, p.w));
    }
    Quat hub = w->orientation[0];
    Vec3 velocity = w->velocity[0], spin = w->spin[0];
    shift_at(s, 0, more, 0, more_slots);
    for (int c = 0, i = 0; c < nodes; c++) {
        double x = tip + next->wire.s[c] - next->wire.total_length;
        while (i + 2 < old_nodes && old[i + 1].x < x)
            i++;
        Inside at = inside_between(&old[i], &old[i + 1], x, w->inner_count);
        w->position[c] = vec3_add_scaled(s->entry.mouth, x, s->entry.axis[0]);
        w->orientation[c] = hub;
        w->velocity[c] = velocity;
        w->spin[c] = spin;
        for (int k = 0; k < w->inner_count; k++) {
            int j = c * w->inner_count + k;
            w->slide[j] = at.value[k][0], w->angle[j] = at.value[k][1], w->slide_velocity[j] = at.value[k][2], w->slide_spin[j] = at.value[k][3];
            memset(w->slide_force + 3 * j, 0, 3 * sizeof(double));
        }
    }
    for (int k = 1; k < s->tools.count; k++) {
        Tool *t = &s->tools.tool[k];
        if (tools_carries(t))
            continue;
        if (t->inside > old_nodes) {
            t->inside += more;
            continue;
        }
        for (t->inside = 1; t->inside < nodes && slide_at(s, t->inside, k) < t->wire.total_length; t->inside++)
            ;
    }
    s->first_free += more;
}

static int slots_of(const Tool *t, int element) { return t->slot_start[element + 1] - t->slot_start[element]; }

static double *slide_of(const Stepper *s, int c, int k) { return &s->state.slide[c * s->state.inner_count + k - 1]; }
static double *angle_of(const Stepper *s, int c, int k) { return &s->state.angle[c * s->state.inner_count + k - 1]; }

static bool lies_at(const Stepper *s, int c, int k) { return s->tools.carrier[c] == k || c < s->tools.tool[k].inside; }
static double material_at(const Stepper *s, int c, int k) { return s->tools.carrier[c] == k ? s->wire.s[c] : slide_at(s, c, k); }
static double turned_at(const Stepper *s, int c, int k) { return s->tools.carrier[c] == k ? 0 : angle_at(s, c, k); }

static void between_nodes(const Stepper *s, int c, int k, double at, ToolNode *node)
{
    const WireState *w = &s->state;
    double s1 = material_at(s, c, k), span = c + 1 < w->node_count && lies_at(s, c + 1, k) ? material_at(s, c + 1, k) - s1 : tools_span_length(s, c);
    double xi = fmin(1, fmax(0, (at - s1) / span)), phi1 = turned_at(s, c, k),
           phi2 = c + 1 < w->node_count && lies_at(s, c + 1, k) ? turned_at(s, c + 1, k) : phi1;
    Vec3 t1 = quat_rotate(w->orientation[c], vec3(1, 0, 0)), t2 = quat_rotate(w->orientation[c + 1], vec3(1, 0, 0));
    Slot slot = slot_shifted(&(Slot){.element = c}, span, xi);
    node->position = slot_place(&slot, span, w->position[c], t1, w->position[c + 1], t2).position;
    Quat a = quat_mul(w->orientation[c], quat_from_rotation_vector(vec3(phi1, 0, 0))),
         b = quat_mul(w->orientation[c + 1], quat_from_rotation_vector(vec3(phi2, 0, 0)));
    double same = a.w * b.w + a.x * b.x + a.y * b.y + a.z * b.z < 0 ? -1 : 1;
    node->orientation =
        quat_unit((Quat){a.w + xi * (same * b.w - a.w), a.x + xi * (same * b.x - a.x), a.y + xi * (same * b.y - a.y), a.z + xi * (same * b.z - a.z)});
    node->carrier = c + 1 < s->first_free ? -1 : s->tools.carrier[c + 1];
}

// Node c joins the chain after node c - 1, which is the tip around it, at a distance d [mm] along the curve there.
static void join(Stepper *s, int k, double d)
{
    Tool *t = &s->tools.tool[k];
    WireState *w = &s->state;
    bool carries = tools_carries(t);
    int c = carries ? t->start : 0, j = carries ? t->first - 1 : t->wire.node_count - 1;
    if (!carries)       // after all tools that precede it in the chain
        for (c = w->node_count; c > 0 && s->tools.carrier[c - 1] > k; c--)
            ;
    int before = c - 1;
    double phi = *angle_of(s, before, k);
    Vec3 tangent = quat_rotate(w->orientation[before], vec3(1, 0, 0));
    ToolNode further = tools_further(s, before, d, true);
    shift(s, c, slots_of(t, j - 1), true);
    w->position[c] = further.position;
    // with whole turns: they determine the quaternion's sign, and elements distinguish p from -p
    w->orientation[c] = quat_unit(quat_mul(further.orientation, quat_from_rotation_vector(vec3(phi, 0, 0))));
    // its material keeps the velocity that it had inside
    int i = before * w->inner_count + k - 1;
    w->velocity[c] = vec3_add_scaled(w->velocity[before], w->slide_velocity[i] - vec3_dot(w->velocity[before], tangent), tangent);
    w->spin[c] = vec3_add_scaled(w->spin[before], w->slide_spin[i] - vec3_dot(w->spin[before], tangent), tangent);
    for (int m = k + 1; m < s->tools.count; m++) {
        *slide_of(s, c, m) = *slide_of(s, before, m) + d;
        *angle_of(s, c, m) = *angle_of(s, before, m) - phi;
        w->slide_velocity[c * w->inner_count + m - 1] = w->slide_velocity[before * w->inner_count + m - 1];
        w->slide_spin[c * w->inner_count + m - 1] = w->slide_spin[before * w->inner_count + m - 1];
        if (!tools_carries(&s->tools.tool[m]) && s->tools.tool[m].inside > before)
            s->tools.tool[m].inside++;
    }
    t->first = j;
    tools_chain(s);
    stepper_forget(s, c);
}

static void leave(Stepper *s, int k)
{
    Tool *t = &s->tools.tool[k];
    int c = t->start;
    shift(s, c, slots_of(t, t->first - 1), false);
    for (int m = k + 1; m < s->tools.count; m++)
        if (!tools_carries(&s->tools.tool[m]) && s->tools.tool[m].inside > c)
            s->tools.tool[m].inside--;
    t->first++;
    t->inside = c;
    tools_chain(s);
}

// [mm/ms] The rate at which S of tool k grew at node c in the last step.
static double slide_rate(const Stepper *s, int c, int k)
{
    return vec3_dot(s->state.velocity[c], quat_rotate(s->state.orientation[c], vec3(1, 0, 0))) - s->state.slide_velocity[c * s->state.inner_count + k - 1];
}

bool tools_leave_back(Stepper *s)
{
    for (int k = 1; k < s->tools.count && !s->progress.has_failed; k++) {
        const Tool *t = &s->tools.tool[k];
        int tip = t->start - 1;
        if (!tools_carries(t))
            continue;
        double ends = s->start.slide[tip * s->state.inner_count + k - 1] + s->system.u[row_of(s, tip) + (size_t)unknown_of(k)];
        if (t->wire.s[t->first] - ends > TAKE_BACK * t->wire.length[t->first - 1])
            continue;
        s->progress.tips_changed |= 1u << k;
        stepper_go_back(s);
        s->first_free -= t->start < s->first_free;
        leave(s, k);
        return true;
    }
    return false;
}

// The next node of tool k to emerge: returns the chain's node at the tip around it (-1: the tool ends before that tip); *own is the node's number in the tool.
static int next_out(const Stepper *s, int k, int *own)
{
    const Tool *t = &s->tools.tool[k];
    bool carries = tools_carries(t);
    *own = carries ? t->first - 1 : t->wire.node_count - 1;
    if (carries)
        return t->start - 1;
    int tip = s->state.node_count - 1;
    while (tip > 0 && s->tools.carrier[tip] > k)
        tip--;
    return t->inside > tip ? tip : -1;
}

bool tools_come_out(Stepper *s)
{
    for (int k = 1; k < s->tools.count && !s->progress.has_failed; k++) {
        int j, tip = next_out(s, k, &j);
        if (tools_carries(&s->tools.tool[k]) || tip < s->first_free || j < 1 || s->progress.tips_changed & 1u << k)
            continue;
        size_t i = (size_t)tip * (size_t)s->state.inner_count + (size_t)k - 1;
        double end = s->tools.tool[k].wire.s[j], length = s->tools.tool[k].wire.length[j - 1];
        double began = end - s->start.slide[i], ends = began - s->system.u[row_of(s, tip) + (size_t)unknown_of(k)];
        if (ends < JOIN * length || began < LEAST_OUT * length)
            continue;
        s->progress.tips_changed |= 1u << k;
        stepper_go_back(s);
        join(s, k, began);
        return true;
    }
    return false;
}

// Adds or removes nodes of tool k at the tip around it, when its material advances by `ahead` [mm] in this step.
static void pass_tip(Stepper *s, int k, double ahead)
{
    Tool *t = &s->tools.tool[k];
    for (;;) {
        int j, tip = next_out(s, k, &j);
        if (tip < 0)
            return;
        bool carries = tools_carries(t);
        bool is_held = carries && t->first + 1 == t->wire.node_count && vec3_norm2(s->points.force[t->start]) > 0;
        // by the hand's command or by its last motion, whichever leaves it further back: friction may hold the tool against its hand
        double out = *slide_of(s, tip, k), at = out - fmin(ahead, -slide_rate(s, tip, k) * s->dt);
        if (j > 0 && t->wire.s[j] - fmax(at, out) > JOIN * t->wire.length[j - 1])
            join(s, k, t->wire.s[j] - out);
        else if (carries && t->wire.s[t->first] - at < (is_held ? LEAST_OUT : LEAVE) * t->wire.length[t->first - 1])
            leave(s, k);
        else
            return;
    }
}

// [mm] How early a tip passes a node.
static double pass_early(const Stepper *s, int last, double ahead) { return EARLY * s->wire.length[last > 0 ? last - 1 : 0] + fabs(ahead); }

// The inner tip of tool k passes nodes backwards …
static bool pass_nodes_back(Stepper *s, int k, double ahead)
{
    Tool *t = &s->tools.tool[k];
    int before = t->inside;
    for (int last = t->inside - 1; last > 0 && *slide_of(s, last, k) - ahead >= t->wire.total_length + 2 * pass_early(s, last, ahead); last--)
        t->inside--;
    return t->inside < before;
}

// … or forwards. Not both in one step: a tool that is compressed in its last element would alternate for ever.
static void pass_nodes(Stepper *s, int k, double ahead)
{
    Tool *t = &s->tools.tool[k];
    WireState *w = &s->state;
    if (tools_carries(t) || pass_nodes_back(s, k, ahead))
        return;
    for (int last = t->inside - 1; last >= 0 && t->inside < w->node_count && s->tools.carrier[t->inside] <= k; last++) {
        double next = *slide_of(s, last, k) + tools_strained_length(s, last);
        if (next - ahead >= t->wire.total_length + pass_early(s, last, ahead))
            return;
        *slide_of(s, t->inside, k) = next;
        // unstretched and untwisted: rotated relative to the node by the carrier's twist
        *angle_of(s, t->inside, k) = *angle_of(s, last, k) - tools_twist(s, last);
        w->slide_velocity[t->inside * w->inner_count + k - 1] = w->slide_velocity[last * w->inner_count + k - 1];
        w->slide_spin[t->inside * w->inner_count + k - 1] = w->slide_spin[last * w->inner_count + k - 1];
        t->inside++;
    }
}

static void pass(Stepper *s)
{
    for (int k = 1; k < s->tools.count; k++) {
        double ahead = s->hands.command[k].advance - s->hands.command[0].advance;
        pass_nodes(s, k, ahead);
        pass_tip(s, k, ahead);
    }
}

void tools_feed(Stepper *s)
{
    // the future positions of the hubs: a tool's proximal end stays behind that of the tool around it, and its tip beyond the outermost hub
    double outermost = s->state.inserted + s->command.advance - s->tools.tool[0].wire.total_length, around = outermost;
    for (int k = 1; k < s->tools.count; k++) {
        Tool *t = &s->tools.tool[k];
        StepCommand *command = &s->hands.command[k];
        double most = t->wire.total_length + around - t->inserted, least = fmin(most, outermost - t->inserted);
        if (command->advance > most || command->advance < least)
            s->report.flags |= command->advance > most ? STEP_FULLY_INSERTED : STEP_FULLY_WITHDRAWN;
        command->advance = fmin(most, fmax(least, command->advance));
        around = t->inserted + command->advance - t->wire.total_length;
    }
    pass(s);
}

// --- motion ---

void tools_leave_out(Stepper *s)
{
    for (int c = 0; c < s->system.chain.count; c++)
        for (int k = 1; k < s->tools.count; k++)
            for (int i = 0; !is_inside(s, c, k) && i < 2; i++)       // these rows and columns are empty
                s->system.chain.diag[block_of(s, c) + (size_t)((s->system.chain.size + 1) * (unknown_of(k) + i))] = 1;
}

double tools_largest_part(const Stepper *s)
{
    double part = 1;
    for (int k = 1; k < s->tools.count; k++) {
        const Tool *t = &s->tools.tool[k];
        int last = t->inside - 1;
        if (last < 0)
            continue;
        double end = tools_carries(t) ? t->wire.s[t->first] : t->wire.total_length, most = end + s->wire.length[last > 0 ? last - 1 : 0];
        double from = slide_at(s, last, k), to = s->start.slide[last * s->state.inner_count + k - 1] + s->system.u[row_of(s, last) + (size_t)unknown_of(k)];
        if (to > most && to > from)
            part = fmin(part, fmax(0, most - from) / (to - from));
    }
    return part;
}

void tools_move(Stepper *s, double part)
{
    for (int c = 0; c < s->state.node_count; c++)
        for (int k = 1; k < s->tools.count; k++) {
            if (!is_inside(s, c, k))
                continue;
            int at = unknown_of(k), i = c * s->state.inner_count + k - 1;
            const double *u = s->system.u + row_of(s, c) + at;
            double *done = s->iterate.moved + row_of(s, c) + at;
            done[0] = part < 1 ? done[0] + part * (u[0] - done[0]) : u[0];
            done[1] = part < 1 ? done[1] + part * (u[1] - done[1]) : u[1];
            s->state.slide[i] = s->start.slide[i] + done[0];
            s->state.angle[i] = s->start.angle[i] + done[1];
        }
}

void tools_set_velocities(Stepper *s)
{
    WireState *w = &s->state;
    for (int c = 0; c < w->node_count; c++) {
        Vec3 t = c < s->first_free ? s->entry.axis[0] : quat_rotate(s->start.orientation[c], vec3(1, 0, 0));
        for (int k = 1; k < s->tools.count; k++) {
            if (!is_inside(s, c, k))
                continue;
            const double *u = s->iterate.moved + row_of(s, c) + unknown_of(k);
            int i = c * w->inner_count + k - 1;
            w->slide_velocity[i] = vec3_dot(w->velocity[c], t) - u[0] / s->dt;
            w->slide_spin[i] = vec3_dot(w->spin[c], t) + u[1] / s->dt;
        }
    }
}

// --- reports ---

int stepper_node_capacity(const Stepper *s) { return s->tools.count > 1 ? s->tools.capacity : s->state.node_count; }

int stepper_tool_count(const Stepper *s) { return s->tools.count; }

double stepper_tool_inserted(const Stepper *s, int tool) { return s->tools.count > 1 && tool > 0 ? s->tools.tool[tool].inserted : s->state.inserted; }

double stepper_tool_turned(const Stepper *s, int tool) { return s->tools.count > 1 && tool > 0 ? s->tools.tool[tool].twist : s->state.twist; }

int stepper_tool_nodes(const Stepper *s, int k, ToolNode *node)
{
    const WireState *w = &s->state;
    const Wire *own = s->tools.count > 1 ? &s->tools.tool[k].wire : &s->wire;
    if (!node)
        return own->node_count;
    int c = 0;
    for (int j = 0; j < own->node_count; j++) {
        node[j] = (ToolNode){.s = own->s[j], .radius = own->radius[j]};
        if (s->tools.count == 1) {
            node[j].position = w->position[j];
            node[j].orientation = w->orientation[j];
            node[j].carrier = j < s->first_free ? -1 : 0;
            continue;
        }
        double first = material_at(s, 0, k);
        if (own->s[j] <= first) {
            node[j].position = vec3_add_scaled(w->position[0], own->s[j] - first, quat_rotate(w->orientation[0], vec3(1, 0, 0)));
            node[j].orientation = quat_mul(w->orientation[0], quat_from_rotation_vector(vec3(turned_at(s, 0, k), 0, 0)));
            node[j].carrier = -1;
            continue;
        }
        while (c + 2 < w->node_count && lies_at(s, c + 1, k) && material_at(s, c + 1, k) < own->s[j])
            c++;
        between_nodes(s, c, k, own->s[j], &node[j]);
    }
    return own->node_count;
}
