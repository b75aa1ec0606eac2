// The linear system of coaxial tools: the counterpart of step_assemble.c with coaxial elements (coaxial.c). Unknowns of a node: position and rotation, then for
// each tool i inside, material coordinate and angle, at 6 + 2 i and 7 + 2 i. In the sheath, as for one tool, axial displacement (0) and rotation (3).
//
// Mass: all tools at a node move together across the tangent t. Along it each has its own velocity, t . dx/dt - dS/dt for a tool inside, and its own spin,
// t . omega + dphi/dt. Convection, the momentum carried from node to node with S, is neglected: it is of order v^2 dm/ds.
#include "solver/coaxial_lanes.h"
#include "base/base.h"
#include "solver/tools_internal.h"

#include <string.h>

enum { NODAL = 12 };
static const double SHORTEST = 0.01;     // of an element: least length assumed outside a mouth or a tip
static const double SOFT = 0.02;         // … over which, to either side, a border of one tool passes one of another; less than JOIN of step_tools.c

// Does the section of the tool that carries node c change there, or end?
static bool is_border(const Stepper *s, int c)
{
    if (c + 1 == s->state.node_count || is_at_tip(s, c))
        return true;
    return c > 0 && !is_at_tip(s, c - 1) && s->wire.section[c - 1] != s->wire.section[c];
}

// [mm] The distance to either side of node c over which an inner tool's borders pass the carrier's, the same in both elements. The carrier's own border is not
// spread: if both were, the two would pass each other in each element, and the kink would reappear there.
static double soft_at(const Stepper *s, int c)
{
    double before = c > 0 ? s->wire.length[c - 1] : HUGE_VAL, after = c + 1 < s->state.node_count ? s->wire.length[c] : HUGE_VAL;
    if (!is_border(s, c))
        return 0;
    // a share of the longer neighbour; at a nearly flush tip the short element limits it
    double near = fmin(before, after), far = fmax(before < HUGE_VAL ? before : 0, after < HUGE_VAL ? after : 0), soft = fmin(SOFT * far, 0.4 * near);
    // zero in the sheath; it grows from where the node leaves the sheath's line
    return c > s->first_free ? soft : fmax(0, fmin(soft, stepper_sheath_coordinate(s, c) - sheath_border_share * before));
}

// Lists the tools in element c, carrier first, and returns their number. tool: their indices.
static int spans(const Stepper *s, int c, CoaxialSpan *span, int *tool)
{
    int count = 0, first = s->tools.carrier[c + 1];
    double soft[2] = {soft_at(s, c), soft_at(s, c + 1)};
    for (int k = first; k < s->tools.count; k++) {
        CoaxialSpan *p = &span[count];
        bool carries = k == first, from_node = s->tools.carrier[c] == k;
        if (!carries && !is_inside(s, c, k))
            continue;
        *p = (CoaxialSpan){.tool = &s->tools.tool[k].coaxial, .is_fixed = carries && from_node};
        if (!carries)
            p->soft[0] = soft[0], p->soft[1] = soft[1];
        p->s1 = from_node ? s->wire.s[c] : slide_at(s, c, k);
        p->phi1 = from_node ? 0 : angle_at(s, c, k);
        if (carries) {
            p->s2 = s->wire.s[c + 1];
            p->s1 = fmin(p->s1, p->s2 - SHORTEST * s->wire.length[c]);
            p->spread = s->wire.length[c];
        } else if (is_inside(s, c + 1, k)) {
            p->s2 = slide_at(s, c + 1, k);
            p->phi2 = angle_at(s, c + 1, k);
            p->spread = s->wire.length[c];
        } else {
            p->has_tip = true;
        }
        tool[count++] = k;
    }
    // tools that emerge from the tip at node c and end before node c + 1 bend there with the tool that continues
    for (int k = s->tools.carrier[c] + 1; k < first; k++)
        if (is_inside(s, c, k)) {
            span[count] = (CoaxialSpan){.tool = &s->tools.tool[k].coaxial, .s1 = slide_at(s, c, k), .phi1 = angle_at(s, c, k), .has_tip = true};
            tool[count++] = k;
        }
    return count;
}

// For the friction between tools: stores the moment and tension at the middle of the element, each summed over a tool and all tools inside it.
static void keep_inner(const Stepper *s, int c, const CoaxialInput *in, const CoaxialOutput *out, const int *tool)
{
    int inner = s->state.inner_count;
    Vec3 m = vec3_scale(vec3_sub(out->end_moment[1], out->end_moment[0]), 0.5), rest[STEP_TOOLS_MAX], total = m;
    double bending = 0, own[STEP_TOOLS_MAX];
    for (int i = 0; i < in->count; i++) {
        const CoaxialSpan *p = &in->span[i];
        double middle = p->s1 + 0.5 * out->rest.length, phi = p->has_tip ? p->phi1 : 0.5 * (p->phi1 + p->phi2);
        bool ends = i > 0 && middle > p->tool->section[p->tool->count - 1].end;
        const CoaxialSection *section = coaxial_section_at(p->tool, middle);
        own[i] = ends ? 0 : section->bending;
        rest[i] = vec3_scale(quat_rotate(quat_mul(in->q1, quat_from_rotation_vector(vec3(phi, 0, 0))), vec3(0, -section->curve[1], section->curve[0])), own[i]);
        total = vec3_add(total, rest[i]);
        bending += own[i];
    }
    Vec3 curvature = vec3_scale(total, 1 / bending);
    s->tools.bent[c] = vec3_norm(curvature);
    for (int k = 1; k <= inner; k++) {
        Vec3 *moment = &s->tools.moment[c * inner + k - 1];
        double *tension = &s->tools.tension[c * inner + k - 1];
        *moment = vec3(0, 0, 0);
        *tension = 0;
        for (int i = 0; i < in->count; i++)
            if (tool[i] >= k) {
                *moment = vec3_add(*moment, vec3_sub(vec3_scale(curvature, own[i]), rest[i]));
                *tension += out->tension[i];
            }
    }
}

// Beyond a tip, the frames of the element's two nodes belong to two tools; node 1 is then given the frame of the tool that continues.
static CoaxialInput input_at(const Stepper *s, int c, int *tool)
{
    const WireState *w = &s->state;
    CoaxialInput in = {.x1 = w->position[c], .x2 = w->position[c + 1], .q1 = w->orientation[c], .q2 = w->orientation[c + 1]};
    in.count = spans(s, c, in.span, tool);
    if (!is_at_tip(s, c))
        return in;
    double phi = in.span[0].phi1;
    in.q1 = quat_mul(in.q1, quat_from_rotation_vector(vec3(phi, 0, 0)));
    for (int i = 0; i < in.count; i++)
        in.span[i].phi1 -= phi;
    return in;
}

// Is the element a single tool between two of its own nodes?
static bool is_plain(const Stepper *s, int c)
{
    if (s->tools.carrier[c] != s->tools.carrier[c + 1])
        return false;
    for (int k = s->tools.carrier[c] + 1; k < s->tools.count; k++)
        if (is_inside(s, c, k))
            return false;
    return true;
}

static void keep_plain(const Stepper *s, int c, const BeamInput *in, const BeamOutput *out)
{
    int inner = s->state.inner_count;
    Vec3 m = vec3_scale(vec3_sub(out->angle2, out->angle1), 0.5 * (in->near - in->far));
    s->tools.bent[c] = vec3_norm(vec3_sub(out->turn2, out->turn1)) / in->length;
    for (int k = 0; k < inner; k++) {
        bool bears = k < s->tools.carrier[c + 1];
        s->tools.moment[c * inner + k] = bears ? m : vec3(0, 0, 0);
        s->tools.tension[c * inner + k] = bears ? out->tension : 0;
    }
}

// --- free elements ---

// Gradient and tangent of an element in the unknowns of its two nodes, [2 n] and [2 n][2 n].
typedef struct Local {
    int n;
    double gradient[2 * BLOCK_LARGEST], tangent[2 * BLOCK_LARGEST][2 * BLOCK_LARGEST];
} Local;

// The positions of the element's unknowns among those of its nodes; -1: absent.
static void places(const CoaxialInput *in, const int *tool, int n, int place[NODAL + COAXIAL_COLUMNS])
{
    for (int i = 0; i < 6; i++)
        place[i] = i, place[6 + i] = n + i;
    for (int i = 0; i < in->count; i++) {
        int at = unknown_of(tool[i]), *p = place + NODAL + 4 * i;
        bool is_free = !in->span[i].is_fixed, ends = i == 0 || in->span[i].has_tip;
        p[COAXIAL_S1] = is_free ? at : -1;
        p[COAXIAL_PHI1] = is_free ? at + 1 : -1;
        p[COAXIAL_S2] = is_free && !ends ? n + at : -1;
        p[COAXIAL_PHI2] = is_free && !ends ? n + at + 1 : -1;
    }
}

static void clear(Local *local, int n)
{
    local->n = n;
    memset(local->gradient, 0, sizeof local->gradient);
    for (int r = 0; r < 2 * n; r++)
        memset(local->tangent[r], 0, (size_t)(2 * n) * sizeof(double));
}

// One of an element's own unknowns (12 of the nodes, 4 per tool) as a linear combination of at most two unknowns of its two nodes, [2 n].
typedef struct UnknownMap {
    int count;
    int at[2];
    double by[2];
} UnknownMap;

static void put_nodes(const BeamTangent *t, double full[NODAL][NODAL])
{
    for (int r = 0; r < 6; r++)
        for (int c = 0; c < 6; c++) {
            full[r][c] = t->k11[6 * r + c];
            full[6 + r][c] = full[c][6 + r] = t->k21[6 * r + c];
            full[6 + r][6 + c] = t->k22[6 * r + c];
        }
}

static void add_mapped(const UnknownMap *map, const CoaxialTangent *t, int columns, Local *local)
{
    double nodes[NODAL][NODAL];
    put_nodes(&t->nodes, nodes);
    int all = NODAL + columns;
    for (int r = 0; r < all; r++)
        for (int c = 0; c < all; c++) {
            double value = r < NODAL ? c < NODAL ? nodes[r][c] : t->cross[r][c - NODAL] : c < NODAL ? t->cross[c][r - NODAL] : t->own[r - NODAL][c - NODAL];
            for (int i = 0; i < map[r].count; i++)
                for (int j = 0; j < map[c].count; j++)
                    local->tangent[map[r].at[i]][map[c].at[j]] += value * map[r].by[i] * map[c].by[j];
        }
}

static void put(double *at, Vec3 v) { at[0] = v.x, at[1] = v.y, at[2] = v.z; }

// Assembles an element whose own unknowns differ from those of its nodes.
static void mapped_element(const Stepper *s, int c, const CoaxialInput *in, const UnknownMap *map, const int *tool, double scale, Local *local)
{
    int columns = 4 * in->count;
    CoaxialOutput out;
    CoaxialTangent t;
    coaxial_element(in, &out);
    keep_inner(s, c, in, &out, tool);
    coaxial_tangent(in, &out, scale, &t);
    clear(local, s->system.chain.size);
    add_mapped(map, &t, columns, local);
    double own[NODAL + COAXIAL_COLUMNS];
    put(own, vec3_negate(out.beam.force2));
    put(own + 3, out.beam.moment1);
    put(own + 6, out.beam.force2);
    put(own + 9, out.beam.moment2);
    memcpy(own + NODAL, out.gradient, (size_t)columns * sizeof *own);
    for (int r = 0; r < NODAL + columns; r++)
        for (int i = 0; i < map[r].count; i++)
            local->gradient[map[r].at[i]] += own[r] * map[r].by[i];
}

// Node 2 contributes as in any element; only node 1 differs.
static void map_far_node(const CoaxialInput *in, const int *tool, int n, UnknownMap map[NODAL + COAXIAL_COLUMNS])
{
    for (int i = 0; i < 6; i++)
        map[6 + i] = (UnknownMap){1, {n + i, 0}, {1, 0}};
    for (int i = 0; i < in->count; i++) {
        int at = n + unknown_of(tool[i]);
        bool ends = i == 0 || in->span[i].has_tip;
        map[NODAL + 4 * i + COAXIAL_S2] = ends ? (UnknownMap){0} : (UnknownMap){1, {at, 0}, {1, 0}};
        map[NODAL + 4 * i + COAXIAL_PHI2] = ends ? (UnknownMap){0} : (UnknownMap){1, {at + 1, 0}, {1, 0}};
    }
}

// At a tip, node 1 has the frame of the tool that continues, so that tool's angle is part of the node's rotation about the tangent.
static void map_tip_node(const Stepper *s, int c, const CoaxialInput *in, const int *tool, UnknownMap map[NODAL + COAXIAL_COLUMNS])
{
    int on = unknown_of(tool[0]);
    Vec3 t = quat_rotate(s->state.orientation[c], vec3(1, 0, 0));
    const double tangent[3] = {t.x, t.y, t.z};
    map_far_node(in, tool, s->system.chain.size, map);
    for (int i = 0; i < 3; i++) {
        map[i] = (UnknownMap){1, {i, 0}, {1, 0}};
        map[3 + i] = (UnknownMap){2, {3 + i, on + 1}, {1, tangent[i]}};
    }
    for (int i = 0; i < in->count; i++) {
        int at = unknown_of(tool[i]);
        UnknownMap *w = map + NODAL + 4 * i;
        w[COAXIAL_S1] = (UnknownMap){1, {at, 0}, {1, 0}};
        w[COAXIAL_PHI1] = i == 0 ? (UnknownMap){0} : (UnknownMap){2, {at + 1, on + 1}, {1, -1}};
    }
}

static void tip_element(const Stepper *s, int c, double scale, Local *local)
{
    int tool[STEP_TOOLS_MAX];
    CoaxialInput in = input_at(s, c, tool);
    UnknownMap map[NODAL + COAXIAL_COLUMNS];
    map_tip_node(s, c, &in, tool, map);
    mapped_element(s, c, &in, map, tool, scale, local);
}

// Adds the tangent of an element between two nodes of the same tool.
static void add_tangent(const Stepper *s, int c, const CoaxialTangent *t, int columns, const int *place)
{
    int n = s->system.chain.size;
    double *d = s->system.chain.diag + block_of(s, c), *next = s->system.chain.diag + block_of(s, c + 1), *l = s->system.chain.lower + block_of(s, c);
    for (int r = 0; r < 6; r++)
        for (int k = 0; k < 6; k++) {
            d[n * r + k] += t->nodes.k11[6 * r + k];
            l[n * r + k] += t->nodes.k21[6 * r + k];
            next[n * r + k] += t->nodes.k22[6 * r + k];
        }
    for (int p = 0; p < columns; p++) {
        int at = place[NODAL + p], far = at - n;
        if (at < 0)
            continue;
        for (int r = 0; r < 6; r++) {
            double near_row = t->cross[r][p], far_row = t->cross[6 + r][p];
            if (far < 0) {
                d[n * r + at] += near_row;
                d[n * at + r] += near_row;
                l[n * r + at] += far_row;
            } else {
                l[n * far + r] += near_row;
                next[n * r + far] += far_row;
                next[n * far + r] += far_row;
            }
        }
        for (int q = 0; q < columns; q++) {
            int to = place[NODAL + q];
            if (to >= 0 && to < n && far < 0)
                d[n * at + to] += t->own[p][q];
            else if (to >= 0 && to < n)
                l[n * far + to] += t->own[p][q];
            else if (to >= n && far >= 0)
                next[n * far + to - n] += t->own[p][q];
        }
    }
}

// y = T u, both [2 n].
static void multiply_tangent(const CoaxialTangent *t, int columns, const int *place, int n, const double *u, double *y)
{
    memset(y, 0, 2 * (size_t)n * sizeof *y);
    for (int r = 0; r < 6; r++)
        for (int c = 0; c < 6; c++) {
            y[r] += t->nodes.k11[6 * r + c] * u[c] + t->nodes.k21[6 * c + r] * u[n + c];
            y[n + r] += t->nodes.k21[6 * r + c] * u[c] + t->nodes.k22[6 * r + c] * u[n + c];
        }
    for (int p = 0; p < columns; p++) {
        int at = place[NODAL + p];
        for (int r = 0; at >= 0 && r < NODAL; r++) {
            y[place[r]] += t->cross[r][p] * u[at];
            y[at] += t->cross[r][p] * u[place[r]];
        }
        for (int q = 0; at >= 0 && q < columns; q++)
            y[at] += place[NODAL + q] >= 0 ? t->own[p][q] * u[place[NODAL + q]] : 0;
    }
}

// Element c between two nodes of the same tool, as element().
static void inner_element(const Stepper *s, int c, double scale, bool adds, double *gradient, const double *u, double *product)
{
    int n = s->system.chain.size, tool[STEP_TOOLS_MAX], place[NODAL + COAXIAL_COLUMNS], columns = 0;
    BeamOutput own;
    CoaxialInput in;
    CoaxialOutput out;
    CoaxialTangent t;
    const BeamOutput *o = &own;
    in.count = 0;
    if (is_plain(s, c)) {
        BeamInput beam = stepper_beam(s, c);
        beam_element(&beam, &own);
        keep_plain(s, c, &beam, &own);
        beam_tangent(&beam, &own, scale, &t.nodes);
    } else {
        in = input_at(s, c, tool);
        columns = 4 * in.count;
        coaxial_element(&in, &out);
        keep_inner(s, c, &in, &out, tool);
        coaxial_tangent(&in, &out, scale, &t);
        o = &out.beam;
    }
    places(&in, tool, n, place);
    if (adds)
        add_tangent(s, c, &t, columns, place);
    if (product)
        multiply_tangent(&t, columns, place, n, u, product);
    memset(gradient, 0, 2 * (size_t)n * sizeof *gradient);
    put(gradient, vec3_negate(o->force2));
    put(gradient + 3, o->moment1);
    put(gradient + n, o->force2);
    put(gradient + n + 3, o->moment2);
    for (int p = 0; p < columns; p++)
        if (place[NODAL + p] >= 0)
            gradient[place[NODAL + p]] += out.gradient[p];
}

static void add_to_chain(const Stepper *s, int c, const Local *local)
{
    int n = local->n;
    double *d = s->system.chain.diag + block_of(s, c), *next = s->system.chain.diag + block_of(s, c + 1), *l = s->system.chain.lower + block_of(s, c);
    for (int r = 0; r < n; r++)
        for (int k = 0; k < n; k++) {
            d[n * r + k] += local->tangent[r][k];
            next[n * r + k] += local->tangent[n + r][n + k];
            l[n * r + k] += local->tangent[n + r][k];
        }
}

// --- the sheath ---

static double density(const CoaxialSection *p) { return 0.5 * p->bending * (p->curve[0] * p->curve[0] + p->curve[1] * p->curve[1]); }

// [mJ mm] The energy per length to straighten a tool, integrated twice over S from the hub to s; beyond either end, the value per length at that end applies.
static double straightened_twice(const Tool *t, double s)
{
    const CoaxialSection *p = t->section, *last = p + t->coaxial.count - 1;
    double sum = 0, once = 0, from = 0;
    for (;; from = p->end, p++) {
        double map = (p < last ? fmin(s, p->end) : s) - from;
        sum += once * map + 0.5 * density(p) * map * map;
        once += density(p) * map;
        if (p == last || s <= p->end)
            return sum;
    }
}

// [mJ] The same energy integrated once, averaged over the width of a border: a border that passes the mouth changes the push over that distance instead of
// within one step.
static double straightened_before(const Tool *t, double s)
{
    return (straightened_twice(t, s + 0.5 * t->border) - straightened_twice(t, s - 0.5 * t->border)) / t->border;
}

static double straightened(const Tool *t, double a, double b)
{
    double end = fmin(b, t->wire.total_length);
    return a < end ? straightened_before(t, end) - straightened_before(t, a) : 0;
}

// [N] The force to straighten a tool, and *slope [N/mm], its derivative with S.
static double straightening(const Tool *t, double s, double *slope)
{
    const CoaxialSection *from = coaxial_section_at(&t->coaxial, s - 0.5 * t->border), *to = coaxial_section_at(&t->coaxial, s + 0.5 * t->border);
    *slope = 0;
    if (s >= t->wire.total_length)
        return 0;
    double sum = 0, at = s - 0.5 * t->border;
    for (const CoaxialSection *p = from; p < to; at = p->end, p++)
        sum += density(p) * (p->end - at);
    *slope = (density(to) - density(from)) / t->border;
    return (sum + density(to) * (s + 0.5 * t->border - at)) / t->border;
}

double tools_tip_straightening(const Stepper *s)
{
    const Tool *t = &s->tools.tool[s->tools.carrier[s->state.node_count - 1]];
    return density(coaxial_section_at(&t->coaxial, t->wire.s[t->wire.node_count - 2]));
}

Vec3 tools_tip_curvature(const Stepper *s)
{
    int last = s->state.node_count - 1;
    const Tool *t = &s->tools.tool[s->tools.carrier[last]];
    const CoaxialSection *p = coaxial_section_at(&t->coaxial, t->wire.s[t->wire.node_count - 2]);
    return quat_rotate(s->state.orientation[last], vec3(0, -p->curve[1], p->curve[0]));
}

// Between two nodes in the sheath, each tool is one spring along the line and one about it. The spring acts on the difference of w = side x_b - x_a between the
// two nodes: x_a is the node's position or rotation, x_b the tool's S or angle there.
typedef struct Spring {
    int a, b[2];             // unknowns of the two nodes; b < 0: none
    double side, stiffness, force;   // 1 or -1, [N/mm] or [N mm], [N] or [N mm]
    double drawn;            // [N] along S at node 1: a section border of the tool inside changes the stiffness as it moves
} Spring;

// Returns the number of springs, at most two per tool. spring: NULL if only the energy is wanted.
static int sheath_springs(const Stepper *s, int c, double scale, Spring *spring, double *energy)
{
    int tool[STEP_TOOLS_MAX], inner = s->state.inner_count, count = 0;
    CoaxialInput in = input_at(s, c, tool);
    // relative to node 1 as input_at() rotated it at a tip
    double length = stepper_sheath_coordinate(s, c + 1) - stepper_sheath_coordinate(s, c);
    double psi = tools_twist(s, c) - (is_at_tip(s, c) ? angle_at(s, c, s->tools.carrier[c + 1]) : 0);
    *energy = 0;
    for (int k = 0; spring && k < inner; k++)
        s->tools.moment[c * inner + k] = vec3(0, 0, 0), s->tools.tension[c * inner + k] = 0, s->tools.bent[c] = 0;
    for (int i = 0; i < in.count; i++) {
        const CoaxialSpan *p = &in.span[i];
        *energy += straightened(&s->tools.tool[tool[i]], p->s1, p->has_tip ? s->tools.tool[tool[i]].wire.total_length : p->s2);
        if (p->has_tip)
            continue;
        CoaxialSprings own = coaxial_springs(p);
        int at = unknown_of(tool[i]);
        double strain = length - own.length, turn = psi + p->phi2 - p->phi1;
        *energy += 0.5 * (own.axial * strain * strain + own.torsion * turn * turn);
        if (!spring)
            continue;
        for (int k = 0; k < tool[i]; k++)
            s->tools.tension[c * inner + k] += own.axial * strain;
        double tension = own.axial * strain, torque = own.torsion * turn, drawn = -0.5 * (tension * tension * own.drawn[0] + torque * torque * own.drawn[1]);
        int b = p->is_fixed ? -1 : at, beyond = i == 0 ? -1 : at;     // at node 2 the carrier's S and angle are the node's own
        spring[count++] = (Spring){0, {b, beyond}, 1, scale * own.axial, own.axial * strain, drawn};
        spring[count++] = (Spring){3, {b < 0 ? -1 : b + 1, beyond < 0 ? -1 : beyond + 1}, -1, scale * own.torsion, own.torsion * turn, 0};
    }
    return count;
}

// stiffness times the product of w's derivatives at nodes `row` and `column`, 0 or 1
static void add_products(double *block, int n, const Spring *p, int row, int column, double stiffness)
{
    int r = p->b[row], c = p->b[column];
    block[(n + 1) * p->a] += stiffness;
    if (r >= 0)
        block[n * r + p->a] -= p->side * stiffness;
    if (c >= 0)
        block[n * p->a + c] -= p->side * stiffness;
    if (r >= 0 && c >= 0)
        block[n * r + c] += stiffness;
}

static void add_slopes(double *x, const Spring *p, int node, double by)
{
    x[p->a] -= by;
    if (p->b[node] >= 0)
        x[p->b[node]] += p->side * by;
}

// The same interface as element().
static void sheath_element_of_tools(const Stepper *s, int c, double scale, bool adds, double *gradient, const double *u, double *product)
{
    Spring spring[2 * STEP_TOOLS_MAX];
    double energy;
    int n = s->system.chain.size, count = sheath_springs(s, c, scale, spring, &energy);
    memset(gradient, 0, 2 * (size_t)n * sizeof *gradient);
    if (product)
        memset(product, 0, 2 * (size_t)n * sizeof *product);
    for (const Spring *p = spring; p < spring + count; p++) {
        add_slopes(gradient, p, 0, p->force);
        add_slopes(gradient + n, p, 1, -p->force);
        if (p->b[1] >= 0)
            gradient[n + p->b[1]] += p->drawn;
        if (product) {
            double more = u[n + p->a] - u[p->a] + (p->b[0] >= 0 ? p->side * u[p->b[0]] : 0) - (p->b[1] >= 0 ? p->side * u[n + p->b[1]] : 0);
            add_slopes(product, p, 0, p->stiffness * more);
            add_slopes(product + n, p, 1, -p->stiffness * more);
        }
        if (!adds)
            continue;
        add_products(s->system.chain.diag + block_of(s, c), n, p, 0, 0, p->stiffness);
        add_products(s->system.chain.diag + block_of(s, c + 1), n, p, 1, 1, p->stiffness);
        add_products(s->system.chain.lower + block_of(s, c), n, p, 1, 0, -p->stiffness);
    }
}

// The element across the mouth: from the mouth to the next node. A tool's coordinate at the mouth is S at the node behind it minus that node's coordinate.
static CoaxialInput mouth_input(const Stepper *s, int *tool)
{
    int c = s->first_free - 1;
    CoaxialInput in = input_at(s, c, tool);
    double place = stepper_sheath_coordinate(s, c);
    in.x1 = s->entry.mouth;
    for (int i = 0; i < in.count; i++) {
        CoaxialSpan *p = &in.span[i];
        p->s1 -= place;
        p->is_fixed = false;
        p->spread = s->wire.length[c];
        p->spreads_twist = true;
        p->soft[0] = 0;
        double end = p->has_tip ? s->tools.tool[tool[i]].wire.total_length : p->s2;
        if (!p->has_tip)
            p->s1 = fmin(p->s1, end - SHORTEST * s->wire.length[c]);
    }
    return in;
}

static void map_mouth_node(const Stepper *s, const CoaxialInput *in, const int *tool, UnknownMap map[NODAL + COAXIAL_COLUMNS])
{
    const double d[3] = {s->entry.axis[0].x, s->entry.axis[0].y, s->entry.axis[0].z};
    bool at_tip = is_at_tip(s, s->first_free - 1);       // then the continuing tool has S and an angle at that node too
    int on = unknown_of(tool[0]) + 1;
    map_far_node(in, tool, s->system.chain.size, map);
    for (int i = 0; i < 3; i++) {
        map[i] = (UnknownMap){0};
        map[3 + i] = at_tip ? (UnknownMap){2, {3, on}, {d[i], d[i]}} : (UnknownMap){1, {3, 0}, {d[i], 0}};
    }
    for (int i = 0; i < in->count; i++) {
        int at = unknown_of(tool[i]);
        UnknownMap *w = map + NODAL + 4 * i;
        w[COAXIAL_S1] = i == 0 && !at_tip ? (UnknownMap){1, {0, 0}, {-1, 0}} : (UnknownMap){2, {at, 0}, {1, -1}};
        w[COAXIAL_PHI1] = i == 0 ? (UnknownMap){0} : at_tip ? (UnknownMap){2, {at + 1, on}, {1, -1}} : (UnknownMap){1, {at + 1, 0}, {1, 0}};
    }
}

static void mouth_element_of_tools(const Stepper *s, double scale, Local *local)
{
    int c = s->first_free - 1, tool[STEP_TOOLS_MAX];
    CoaxialInput in = mouth_input(s, tool);
    UnknownMap map[NODAL + COAXIAL_COLUMNS];
    map_mouth_node(s, &in, tool, map);
    mapped_element(s, c, &in, map, tool, scale, local);
}

// The straightened length of a tool behind the mouth grows with S there. The tangent is scaled as for elements; it omits a negative slope, where a border would
// push the tool forwards.
static void add_straightening(const Stepper *s, double scale, double *gradient)
{
    int n = s->system.chain.size;
    double *d = s->system.chain.diag + block_of(s, s->first_free - 1);
    int tool[STEP_TOOLS_MAX];
    CoaxialInput in = mouth_input(s, tool);
    UnknownMap map[NODAL + COAXIAL_COLUMNS];
    map_mouth_node(s, &in, tool, map);
    for (int i = 0; i < in.count; i++) {
        const UnknownMap *w = &map[NODAL + 4 * i + COAXIAL_S1];
        double slope, force = straightening(&s->tools.tool[tool[i]], in.span[i].s1, &slope);
        for (int j = 0; j < w->count; j++) {
            gradient[w->at[j]] += force * w->by[j];
            for (int k = 0; k < w->count; k++)
                d[n * w->at[j] + w->at[k]] += scale * fmax(0, slope) * w->by[j] * w->by[k];
        }
    }
}

// --- mass ---

// [mm] The length of the curve that belongs to node c.
static double tributary(const Stepper *s, int c)
{
    double length = 0;
    if (c > 0)
        length += tools_span_length(s, c - 1);
    if (c + 1 < s->state.node_count)
        length += tools_span_length(s, c);
    return 0.5 * length;
}

typedef struct Lump {        // of one tool at one node
    double mass, about, across;    // [g], [g mm2]
} Lump;

static Lump lump_at(const Stepper *s, int c, int k)
{
    const Tool *t = &s->tools.tool[k];
    if (k == s->tools.carrier[c])
        return (Lump){s->wire.mass[c], s->wire.inertia_axial[c], s->wire.inertia_lateral[c]};
    double at = slide_at(s, c, k), length = fmin(tributary(s, c), fmax(0, t->wire.total_length - at));
    int section = (int)(coaxial_section_at(&t->coaxial, at) - t->section);
    // never zero, so that the rows of S and phi stay positive definite
    length = fmax(length, SHORTEST * tributary(s, c));
    return (Lump){t->line_mass[section] * length, 2 * t->line_inertia[section] * length, t->line_inertia[section] * length};
}

// The momentum of one motion of a tool at a node, along its tangent or about it. The node's unknowns contribute from `first` on, and if the tool is inside, its
// own unknown `at` (0: not inside) with the sign `own`. It moves at `speed` [per ms] and is driven by `push` [per ms2].
typedef struct Motion {
    int first, at;
    double own, speed, push;
} Motion;

static void add_along(Stepper *s, int c, double inertia, double mass, Vec3 t, bool held, const Motion *m)
{
    int n = s->system.chain.size, at = m->at;
    double *d = s->system.chain.diag + block_of(s, c), *b = s->system.b + row_of(s, c);
    const double *u = s->iterate.moved + row_of(s, c) + m->first;
    const double g[3] = {held ? 1 : t.x, held ? 0 : t.y, held ? 0 : t.z};
    double done = g[0] * u[0] + g[1] * u[1] + g[2] * u[2] + (at > 0 ? m->own * s->iterate.moved[row_of(s, c) + (size_t)at] : 0);
    double force = mass * (m->speed / s->dt + m->push - inertia * done), stiff = inertia * mass;
    for (int r = 0; r < 3; r++) {
        int row = m->first + r;
        b[row] += g[r] * force;
        for (int k = 0; k < 3; k++)
            d[n * row + m->first + k] += stiff * g[r] * g[k];
        if (at > 0) {
            d[n * row + at] += stiff * m->own * g[r];
            d[n * at + row] += stiff * m->own * g[r];
        }
    }
    if (at > 0) {
        d[(n + 1) * at] += stiff;
        b[at] += m->own * force;
    }
}

// The same for all tools together, across the tangent.
static void add_across(Stepper *s, int c, double inertia, double mass, Vec3 t, int first, Vec3 speed, Vec3 push)
{
    int n = s->system.chain.size;
    double *d = s->system.chain.diag + block_of(s, c) + (n + 1) * first, *b = s->system.b + row_of(s, c) + first;
    const double *u = s->iterate.moved + row_of(s, c) + first, g[3] = {t.x, t.y, t.z};
    Vec3 force = vec3_add_scaled(vec3_add_scaled(push, 1 / s->dt, speed), -inertia, vec3(u[0], u[1], u[2]));
    put(b, vec3_add_scaled(vec3(b[0], b[1], b[2]), mass, vec3_add_scaled(force, -vec3_dot(force, t), t)));
    for (int r = 0; r < 3; r++)
        for (int k = 0; k < 3; k++)
            d[n * r + k] += inertia * mass * ((r == k) - g[r] * g[k]);
}

static void node_inertia(Stepper *s, int c, double inertia)
{
    const WireState *w = &s->state;
    bool held = c < s->first_free;
    Vec3 t = held ? s->entry.axis[0] : quat_rotate(w->orientation[c], vec3(1, 0, 0)), v = w->velocity[c], spin = w->spin[c];
    Lump all = {0};
    for (int k = s->tools.carrier[c]; k < s->tools.count; k++) {
        bool own = k == s->tools.carrier[c];
        if (!own && !is_inside(s, c, k))
            continue;
        Lump lump = lump_at(s, c, k);
        int at = own ? 0 : unknown_of(k), i = c * w->inner_count + k - 1;
        add_along(s, c, inertia, lump.mass, t, held, &(Motion){0, at, -1, own ? vec3_dot(v, t) : w->slide_velocity[i], vec3_dot(s->rig.gravity, t)});
        add_along(s, c, inertia, lump.about, t, held, &(Motion){3, own ? 0 : at + 1, 1, own ? vec3_dot(spin, t) : w->slide_spin[i], 0});
        all.mass += lump.mass;
        all.across += lump.across;
    }
    if (held)
        return;
    add_across(s, c, inertia, all.mass, t, 0, v, s->rig.gravity);
    add_across(s, c, inertia, all.across, t, 3, spin, vec3(0, 0, 0));
}

double tools_kinetic_energy(const Stepper *s)
{
    const WireState *w = &s->state;
    double twice = 0;
    for (int c = 0; c < w->node_count; c++) {
        Vec3 t = quat_rotate(w->orientation[c], vec3(1, 0, 0));
        double along = vec3_dot(w->velocity[c], t), about = vec3_dot(w->spin[c], t);
        double across2 = vec3_norm2(w->velocity[c]) - along * along, turning2 = vec3_norm2(w->spin[c]) - about * about;
        for (int k = s->tools.carrier[c]; k < s->tools.count; k++) {
            bool own = k == s->tools.carrier[c];
            if (!own && !is_inside(s, c, k))
                continue;
            Lump lump = lump_at(s, c, k);
            double v = own ? along : w->slide_velocity[c * w->inner_count + k - 1], spin = own ? about : w->slide_spin[c * w->inner_count + k - 1];
            twice += lump.mass * (v * v + across2) + lump.about * spin * spin + lump.across * turning2;
        }
    }
    return 0.5 * twice;
}

// --- tips ---

// The tools that continue from node c, in the element there or, at a free end, beyond it; and the strains of that element.
static CoaxialInput going_on(const Stepper *s, int c, CoaxialOutput *out)
{
    int tool[STEP_TOOLS_MAX];
    if (c + 1 < s->state.node_count) {
        CoaxialInput in = c + 1 == s->first_free ? mouth_input(s, tool) : input_at(s, c, tool);
        coaxial_element(&in, out);
        return in;
    }
    *out = (CoaxialOutput){0};
    CoaxialInput in = {.x1 = s->state.position[c], .q1 = s->state.orientation[c]};
    for (int k = s->tools.carrier[c] + 1; k < s->tools.count; k++)
        if (is_inside(s, c, k))
            in.span[in.count++] = (CoaxialSpan){.tool = &s->tools.tool[k].coaxial, .s1 = slide_at(s, c, k), .phi1 = angle_at(s, c, k)};
    return in;
}

// Bending and shear stiffness of the tools at a distance d [mm] from node 1 of an element, where its frame is q; returns the moment of their rest shapes.
static Vec3 stiffness_at(const CoaxialInput *in, double d, Quat q, double *bending, double *shear)
{
    Vec3 sum = vec3(0, 0, 0);
    *bending = *shear = 0;
    for (int i = 0; i < in->count; i++) {
        const CoaxialSpan *p = &in->span[i];
        if (i > 0 && p->s1 + d > p->tool->section[p->tool->count - 1].end)
            continue;
        const CoaxialSection *section = coaxial_section_at(p->tool, p->s1 + d);
        Quat own = quat_mul(q, quat_from_rotation_vector(vec3(p->phi1, 0, 0)));
        sum = vec3_add_scaled(sum, section->bending, quat_rotate(own, vec3(0, -section->curve[1], section->curve[0])));
        *bending += section->bending;
        *shear += section->shear;
    }
    return sum;
}

ToolNode tools_further(const Stepper *s, int c, double d, bool strains)
{
    enum { PARTS = 8 };
    CoaxialOutput out;
    CoaxialInput in = going_on(s, c, &out);
    ToolNode node = {.position = in.x1, .orientation = in.q1};
    if (in.count == 0)
        return node;
    const CoaxialSection *first = coaxial_section_at(in.span[0].tool, in.span[0].s1);
    double length = fmax(out.rest.length, d), ds = d / PARTS, strain = strains ? 1 : 0;
    double stretch = strain * out.tension[0] / first->axial, twist = strain * ds * out.torque[0] / first->torsion;
    for (int i = 0; i < PARTS; i++) {
        double at = (i + 0.5) * ds, x = at / length, bending, shear;
        Vec3 moment = vec3_add_scaled(stiffness_at(&in, at, node.orientation, &bending, &shear), x - 1, out.end_moment[0]);
        Vec3 half = vec3_scale(vec3_add_scaled(moment, x, out.end_moment[1]), 0.5 * ds / bending);
        node.orientation = quat_mul(quat_from_rotation_vector(half), node.orientation);
        Vec3 tangent = quat_rotate(node.orientation, vec3(1, 0, 0)), force = out.beam.force2;
        Vec3 slant = vec3_scale(vec3_add_scaled(force, -vec3_dot(force, tangent), tangent), 1 / shear);
        node.position = vec3_add_scaled(node.position, ds, vec3_add_scaled(slant, 1 + stretch, tangent));
        node.orientation = quat_mul(quat_mul(quat_from_rotation_vector(half), node.orientation), quat_from_rotation_vector(vec3(twist, 0, 0)));
    }
    double turned = c + 1 < s->state.node_count && is_at_tip(s, c) ? angle_at(s, c, s->tools.carrier[c + 1]) : 0;      // by which input_at() rotated node 1
    node.orientation = quat_unit(quat_mul(node.orientation, quat_from_rotation_vector(vec3(-turned, 0, 0))));
    return node;
}

double tools_strained_length(const Stepper *s, int c)
{
    if (c + 1 < s->first_free)
        return stepper_sheath_coordinate(s, c + 1) - stepper_sheath_coordinate(s, c);
    CoaxialOutput out;
    going_on(s, c, &out);
    return tools_span_length(s, c) + out.tension[0] / out.rest.axial[0];
}

// --- assembly ---

// Computes the gradient of element c [2 n]. Its tangent, with the main stiffness times `scale`, is added to the chain if `adds`; the tangent times u is stored
// in `product` unless that is NULL.
static void element(const Stepper *s, int c, double scale, bool adds, double *gradient, const double *u, double *product)
{
    Local local;
    if (c + 1 > s->first_free && !is_at_tip(s, c)) {
        inner_element(s, c, scale, adds, gradient, u, product);
        return;
    }
    if (c + 1 < s->first_free) {
        sheath_element_of_tools(s, c, scale, adds, gradient, u, product);
        return;
    }
    if (c + 1 == s->first_free)
        mouth_element_of_tools(s, scale, &local);
    else
        tip_element(s, c, scale, &local);
    if (adds)
        add_to_chain(s, c, &local);
    for (int r = 0; product && r < 2 * local.n; r++) {
        product[r] = 0;
        for (int k = 0; k < 2 * local.n; k++)
            product[r] += local.tangent[r][k] * u[k];
    }
    memcpy(gradient, local.gradient, 2 * (size_t)s->system.chain.size * sizeof *gradient);
}

// The rotation of element c as a whole in this step; at the mouth it is clamped.
static Quat turned_as_a_whole(const Stepper *s, int c)
{
    if (c < s->first_free)
        return (Quat){1, 0, 0, 0};
    const Quat *q = s->state.orientation + c, *p = s->start.orientation + c;
    Quat turn[2] = {quat_mul(q[0], quat_conjugate(p[0])), quat_mul(q[1], quat_conjugate(p[1]))};
    double same = turn[0].w * turn[1].w + turn[0].x * turn[1].x + turn[0].y * turn[1].y + turn[0].z * turn[1].z < 0 ? -1 : 1;
    return quat_unit((Quat){turn[0].w + same * turn[1].w, turn[0].x + same * turn[1].x, turn[0].y + same * turn[1].y, turn[0].z + same * turn[1].z});
}

// The displacement of element c's unknowns in this step without its rotation as a whole: this part strains the element, in the linearised sense, however far it
// has turned.
static void strained(const Stepper *s, int c, double *u)
{
    int n = s->system.chain.size;
    const WireState *w = &s->state;
    memcpy(u, s->iterate.moved + row_of(s, c), 2 * (size_t)n * sizeof *u);
    if (c < s->first_free)
        return;
    Quat turn = turned_as_a_whole(s, c);
    Vec3 was = vec3_sub(s->start.position[c + 1], s->start.position[c]), is = vec3_sub(w->position[c + 1], w->position[c]),
         stretch = vec3_sub(is, quat_rotate(turn, was));
    for (int node = 0; node < 2; node++) {
        put(u + node * n, vec3_scale(stretch, node ? 0.5 : -0.5));
        Quat q = quat_mul(w->orientation[c + node], quat_conjugate(quat_mul(turn, s->start.orientation[c + node])));
        put(u + node * n + 3, vec3_scale(vec3(q.x, q.y, q.z), q.w < 0 ? -2 : 2));
    }
}

// The damping force at an iterate: the difference between the element's tangent with damping and its elastic one, times the displacement.
static void add_damping(const Stepper *s, int c, double scale, double *force)
{
    double u[2 * BLOCK_LARGEST], with[2 * BLOCK_LARGEST], without[2 * BLOCK_LARGEST], unused[2 * BLOCK_LARGEST];
    strained(s, c, u);
    element(s, c, scale, false, unused, u, with);
    element(s, c, 1, false, unused, u, without);
    for (int i = 0; i < 2 * s->system.chain.size; i++)
        force[i] += with[i] - without[i];
}

// --- elements of straight tools ---

typedef struct Batch {       // the elements of a tile, and the tools in them
    CoaxialTile tile;
    int element[COAXIAL_LANES], tool[COAXIAL_LANES][STEP_TOOLS_MAX];
} Batch;

static void add_lane(const Stepper *s, const Batch *batch, int l)
{
    const CoaxialTile *t = &batch->tile;
    int n = s->system.chain.size, c = batch->element[l];
    double *d = s->system.chain.diag + block_of(s, c), *next = s->system.chain.diag + block_of(s, c + 1), *low = s->system.chain.lower + block_of(s, c);
    for (int r = 0, at = 0; r < 6; r++) {
        for (int k = 0; k < r; k++, at++) {
            d[n * r + k] += t->k11[at][l], d[n * k + r] += t->k11[at][l];
            next[n * r + k] += t->k22[at][l], next[n * k + r] += t->k22[at][l];
        }
        d[(n + 1) * r] += t->k11[at][l];
        next[(n + 1) * r] += t->k22[at++][l];
        for (int k = 0; k < 6; k++)
            low[n * r + k] += t->k21[6 * r + k][l];
    }
    for (int i = 0; i + 1 < t->count; i++) {
        int at = unknown_of(batch->tool[l][i + 1]);
        for (int r = 0; r < 6; r++) {
            double near = t->by_slide[i][r][l], far = t->by_slide[i][6 + r][l];
            d[n * r + at] -= near, d[n * at + r] -= near;
            next[n * r + at] += far, next[n * at + r] += far;
            low[n * at + r] += near, low[n * r + at] -= far;
        }
        for (int r = 0; r < 3; r++) {
            double turn = t->by_turn[i][r][l];
            int row = 3 + r, phi = at + 1;
            d[n * row + phi] += turn, d[n * phi + row] += turn;
            next[n * row + phi] += turn, next[n * phi + row] += turn;
            low[n * phi + row] -= turn, low[n * row + phi] -= turn;
        }
        const double turn_turn = t->turn_turn[i][l], slide_turn = t->slide_turn[i][l];
        double *const block[3] = {d, next, low};
        for (int q = 0; q < 3; q++) {
            double sign = q < 2 ? 1 : -1;
            block[q][(n + 1) * (at + 1)] += sign * turn_turn;
            block[q][n * at + at + 1] += sign * slide_turn;
            block[q][n * (at + 1) + at] += sign * slide_turn;
            for (int j = 0; j + 1 < t->count; j++)
                block[q][n * at + unknown_of(batch->tool[l][j + 1])] += sign * t->slide_slide[i][j][l];
        }
    }
}

// y += `sign` times the tangent times u; u and y are [2 n].
static void multiply_lane(const Batch *batch, int l, int n, double sign, const double *u, double *y)
{
    const CoaxialTile *t = &batch->tile;
    int place[12];
    for (int r = 0; r < 6; r++)
        place[r] = r, place[6 + r] = n + r;
    for (int r = 0; r < 6; r++)
        for (int k = 0; k < 6; k++) {
            int at = r >= k ? r * (r + 1) / 2 + k : k * (k + 1) / 2 + r;
            y[r] += sign * (t->k11[at][l] * u[k] + t->k21[6 * k + r][l] * u[n + k]);
            y[n + r] += sign * (t->k21[6 * r + k][l] * u[k] + t->k22[at][l] * u[n + k]);
        }
    for (int i = 0; i + 1 < t->count; i++) {
        int at = unknown_of(batch->tool[l][i + 1]);
        double slides = u[n + at] - u[at], turns = u[n + at + 1] - u[at + 1];
        double by_slide = t->slide_turn[i][l] * turns, by_turn = t->slide_turn[i][l] * slides + t->turn_turn[i][l] * turns;
        for (int r = 0; r < 12; r++) {
            y[place[r]] += sign * t->by_slide[i][r][l] * slides;
            by_slide += t->by_slide[i][r][l] * u[place[r]];
        }
        for (int r = 0; r < 3; r++) {
            double turn = t->by_turn[i][r][l];
            y[3 + r] -= sign * turn * turns;
            y[n + 3 + r] += sign * turn * turns;
            by_turn += turn * (u[n + 3 + r] - u[3 + r]);
        }
        for (int j = 0; j + 1 < t->count; j++) {
            int other = unknown_of(batch->tool[l][j + 1]);
            by_slide += t->slide_slide[i][j][l] * (u[n + other] - u[other]);
        }
        y[n + at] += sign * by_slide, y[at] -= sign * by_slide;
        y[n + at + 1] += sign * by_turn, y[at + 1] -= sign * by_turn;
    }
}

static void lane_gradient(const Batch *batch, int l, int n, double *gradient)
{
    const CoaxialTile *t = &batch->tile;
    memset(gradient, 0, 2 * (size_t)n * sizeof *gradient);
    for (int r = 0; r < 6; r++)
        gradient[r] = t->force[r][l], gradient[n + r] = t->force[6 + r][l];
    for (int i = 0; i + 1 < t->count; i++) {
        int at = unknown_of(batch->tool[l][i + 1]);
        gradient[n + at] = t->slide_force[i][l], gradient[at] = -t->slide_force[i][l];
        gradient[n + at + 1] = t->turn_force[i][l], gradient[at + 1] = -t->turn_force[i][l];
    }
}

// As keep_inner(), for one lane.
static void keep_lane(const Stepper *s, const Batch *batch, int l)
{
    const CoaxialTile *t = &batch->tile;
    int c = batch->element[l], inner = s->state.inner_count;
    Vec3 *moment = s->tools.moment + c * inner;
    double *tension = s->tools.tension + c * inner;
    s->tools.bent[c] = t->bent[l];
    for (int k = 0; k < inner; k++)
        moment[k] = vec3(0, 0, 0), tension[k] = 0;
    for (int i = 0; i < t->count; i++)
        for (int k = batch->tool[l][i]; k > (i > 0 ? batch->tool[l][i - 1] : 0); k--) {
            moment[k - 1] = vec3(t->moment[i][0][l], t->moment[i][1][l], t->moment[i][2][l]);
            tension[k - 1] = t->tension[i][l];
        }
}

// Adds the elements of the tile to the system and empties the tile.
static void add_batch(Stepper *s, Batch *batch, double scale)
{
    CoaxialTile *t = &batch->tile;
    int n = s->system.chain.size;
    bool damps = s->iterate.is_moved && scale != 1;
    double u[2 * BLOCK_LARGEST], force[COAXIAL_LANES][2 * BLOCK_LARGEST];
    if (t->lanes == 0)
        return;
    coaxial_tile_find(t, scale);
    for (int l = 0; l < t->lanes; l++) {
        add_lane(s, batch, l);
        keep_lane(s, batch, l);
        lane_gradient(batch, l, n, force[l]);
        if (damps) {
            strained(s, batch->element[l], u);
            multiply_lane(batch, l, n, 1, u, force[l]);
        }
    }
    if (damps)               // minus the elastic part
        coaxial_tile_find(t, 1);
    for (int l = 0; l < t->lanes; l++) {
        double *b = s->system.b + row_of(s, batch->element[l]);
        if (damps) {
            strained(s, batch->element[l], u);
            multiply_lane(batch, l, n, -1, u, force[l]);
        }
        for (int i = 0; i < 2 * n; i++)
            b[i] -= force[l][i];
    }
    t->lanes = 0;
}

static bool takes_element(Stepper *s, int c, double scale, Batch *batch)
{
    if (c < s->first_free || is_at_tip(s, c))
        return false;
    int tool[STEP_TOOLS_MAX], l = batch->tile.lanes;
    CoaxialInput in = input_at(s, c, tool);
    if (l > 0 && in.count != batch->tile.count) {
        add_batch(s, batch, scale);
        l = 0;
    }
    if (!coaxial_tile_take(&batch->tile, &in))
        return false;
    batch->element[l] = c;
    memcpy(batch->tool[l], tool, sizeof tool);
    if (batch->tile.lanes == COAXIAL_LANES)
        add_batch(s, batch, scale);
    return true;
}

static void add_element(Stepper *s, int c, double scale)
{
    double *b = s->system.b + row_of(s, c), gradient[2 * BLOCK_LARGEST];
    element(s, c, scale, true, gradient, NULL, NULL);
    if (s->iterate.is_moved && scale != 1)
        add_damping(s, c, scale, gradient);
    if (c + 1 == s->first_free)
        add_straightening(s, scale, gradient);
    for (int i = 0; i < 2 * s->system.chain.size; i++)
        b[i] -= gradient[i];
}

void tools_assemble(Stepper *s, double scale, double inertia)
{
    int nodes = s->state.node_count;
    memset(s->system.chain.diag, 0, block_of(s, nodes) * sizeof(double));
    memset(s->system.chain.lower, 0, block_of(s, nodes - 1) * sizeof(double));
    memset(s->system.b, 0, row_of(s, nodes) * sizeof(double));
    for (int c = 0; c < nodes; c++)
        node_inertia(s, c, inertia);
    Batch batch;
    batch.tile.lanes = 0;
    for (int c = 0; c + 1 < nodes; c++)
        if (!takes_element(s, c, scale, &batch))
            add_element(s, c, scale);
    add_batch(s, &batch, scale);
    if (!s->iterate.is_moved)
        tools_slides(s);
    static const int lateral[4] = {1, 2, 4, 5};      // in the sheath these rows and columns are empty
    for (int c = 0; c < s->first_free; c++)
        for (int i = 0; i < 4; i++)
            s->system.chain.diag[block_of(s, c) + (size_t)((s->system.chain.size + 1) * lateral[i])] = 1;
}

double tools_elastic_energy(const Stepper *s)
{
    double energy = 0;
    int tool[STEP_TOOLS_MAX];
    // behind the hub all tools are held straight by the hands
    for (int k = 1; s->first_free > 0 && k < s->tools.count; k++)
        energy += straightened(&s->tools.tool[k], 0, slide_at(s, 0, k));
    for (int c = 0; c + 1 < s->state.node_count; c++) {
        if (c + 1 < s->first_free) {
            double own;
            sheath_springs(s, c, 1, NULL, &own);
            energy += own;
        } else if (c + 1 == s->first_free) {
            CoaxialInput in = mouth_input(s, tool);
            CoaxialOutput out;
            coaxial_element(&in, &out);
            energy += out.energy;
            for (int i = 0; i < in.count; i++) {
                double from = s->tools.carrier[c] == tool[i] ? s->wire.s[c] : slide_at(s, c, tool[i]);
                energy += straightened(&s->tools.tool[tool[i]], from, in.span[i].s1) - straightened(&s->tools.tool[tool[i]], in.span[i].s1, from);
            }
        } else if (is_plain(s, c)) {
            BeamInput in = stepper_beam(s, c);
            BeamOutput out;
            beam_element(&in, &out);
            energy += out.energy;
        } else {
            CoaxialInput in = input_at(s, c, tool);
            CoaxialOutput out;
            coaxial_element(&in, &out);
            energy += out.energy;
        }
    }
    return energy;
}

double tools_stiffness_damping(const Stepper *s)
{
    int n = s->system.chain.size;
    double work = 0, scale = 1 + s->damping_stiffness / s->dt;
    for (int c = 0; c + 1 < s->state.node_count; c++) {
        const double *done = s->iterate.moved + row_of(s, c);
        double force[2 * BLOCK_LARGEST] = {0};
        add_damping(s, c, scale, force);
        for (int i = 0; i < 2 * n; i++)
            work += force[i] * done[i];
    }
    return work;
}
