// Friction between coaxial tools.
//
// At a node, tool k presses on the one around it with N = |dM'/ds - T kappa|, where M and T are the moment and tension of tool k and all tools inside it. A
// length h of the line takes the jump of M' over it, minus T times the turn of the line. Tools with clearance do not follow a jump of curvature at once: M is
// averaged over l = 7.3 sqrt(c / kappa), a length derived from two rods in contact. Without this average, a couple at the end of a bend would cause friction
// that grows without bound as elements shrink.

#include "base/base.h"
#include "solver/tools_internal.h"

static const double FOLLOWS = 7.3;
static const double GIVE = 1e-4;         // [mm] elastic displacement of sticking tools under a force

// M averaged over l has the slope (M(s + l/2) - M(s - l/2)) / l. M at a place is that of its element, which is searched from element *c on.
static Vec3 moment_at(const Stepper *s, int k, double place, int *c)
{
    int last = s->state.node_count - 2;
    while (*c < last && 0.5 * (s->tools.middle[*c] + s->tools.middle[*c + 1]) <= place)
        ++*c;
    while (*c > 0 && 0.5 * (s->tools.middle[*c - 1] + s->tools.middle[*c]) > place)
        --*c;
    double end = s->tools.middle[last] + 0.5 * tools_span_length(s, last);
    return place > end || place < 0 ? vec3(0, 0, 0) : s->tools.moment[*c * s->state.inner_count + k - 1];
}

// `turn`: that of the line at node c, the cross product of the chord directions before and after it.
static double pressure_at(const Stepper *s, int c, int k, double window, Vec3 turn, int at[2])
{
    SEL_ASSERT(c > 0 && c + 1 < s->state.node_count, "tools press on each other between two elements");
    double h = s->tools.middle[c] - s->tools.middle[c - 1], l = fmax(window, h), half = 0.5 * l;
    Vec3 right = vec3_sub(moment_at(s, k, s->tools.middle[c] + half, &at[1]), moment_at(s, k, s->tools.middle[c] - half, &at[0]));
    Vec3 left = vec3_sub(moment_at(s, k, s->tools.middle[c - 1] + half, &at[1]), moment_at(s, k, s->tools.middle[c - 1] - half, &at[0]));
    Vec3 jump = vec3_scale(vec3_sub(right, left), 1 / l);
    int inner = s->state.inner_count;
    double tension = 0.5 * (s->tools.tension[(c - 1) * inner + k - 1] + s->tools.tension[c * inner + k - 1]);
    return vec3_norm(vec3_add_scaled(jump, -tension, turn));
}

// The next tool around tool k at node c that is an unknown there too; 0: none.
int tools_around(const Stepper *s, int c, int k)
{
    SEL_ASSERT(k > 0 && k < s->tools.count, "an inner tool has one around it");
    for (k--; k > 0 && !is_inside(s, c, k); k--)
        ;
    return k;
}

// Slip of tool k in this step if it continues as in the last one. t: the node's tangent.
static void last_slip(const Stepper *s, int c, int k, Vec3 t, double slip[2])
{
    const WireState *w = &s->state;
    const double *speed = w->slide_velocity + c * w->inner_count - 1, *spin = w->slide_spin + c * w->inner_count - 1;
    int out = tools_around(s, c, k);
    slip[0] = s->dt * ((out > 0 ? speed[out] : vec3_dot(w->velocity[c], t)) - speed[k]);
    slip[1] = s->dt * (spin[k] - (out > 0 ? spin[out] : vec3_dot(w->spin[c], t)));
}

void tools_slides(Stepper *s)
{
    s->system.set.slide_count = 0;
    int nodes = s->state.node_count, inner = s->state.inner_count;
    double at = 0, most = 0;
    int near[2] = {0, 0};     // the elements where the last averages began and ended
    for (int c = 0; c + 1 < nodes; c++) {
        double length = tools_span_length(s, c);
        s->tools.middle[c] = at + 0.5 * length;
        at += length;
        most = fmax(most, s->tools.bent[c]);
    }
    double window[STEP_TOOLS_MAX];
    for (int k = 1; k < s->tools.count; k++)
        window[k] = most > 0 ? FOLLOWS * sqrt(s->tools.tool[k].clearance / most) : 0;
    const Vec3 *x = s->state.position;
    Vec3 before, after = vec3_unit_or(vec3_sub(x[1], x[0]), s->entry.axis[0]);
    for (int c = 1; c + 1 < nodes; c++) {
        before = after;
        after = vec3_unit_or(vec3_sub(x[c + 1], x[c]), before);
        Vec3 turn = vec3_cross(before, after), tangent = quat_rotate(s->state.orientation[c], vec3(1, 0, 0));
        for (int k = 1; k < s->tools.count; k++) {
            const Tool *t = &s->tools.tool[k];
            if (!is_inside(s, c, k) || !(t->friction > 0))
                continue;
            const double *last = s->state.slide_force + 3 * (c * inner + k - 1), bound = t->friction * pressure_at(s, c, k, window[k], turn, near);
            // a slide that was slipping is assumed to keep slipping, at the new bound
            bool slid = same_hypot(last[0], last[1]) > 0.999999 * last[2];
            double change = slid && last[2] > 0 ? bound / last[2] : 1;
            double slip[2], radius = t->wire.radius[0];
            last_slip(s, c, k, tangent, slip);
            double force[2] = {change * last[0], change * last[1]};
            SEL_REQUIRE(s->system.set.slide_count < s->tools.capacity * s->state.inner_count, "there is room for a slide of each inner tool at each node");
            SEL_ASSERT(bound >= 0 && radius > 0, "a slide has a friction bound and a contact radius");
            s->system.set.slide[s->system.set.slide_count++] = (ContactSlide){.node = c,
                                                                              .unknown = unknown_of(k),
                                                                              .radius = radius,
                                                                              .bound = bound,
                                                                              .give = GIVE,
                                                                              .slip = {slip[0], radius * slip[1]},
                                                                              .held = {force[0], force[1]},
                                                                              .force = {force[0], force[1]}};
        }
    }
}

// S of tool k is its slip plus S of the tool around it: rows and columns of tool k are added to those of that tool, from the innermost outwards.
void tools_to_slips(Stepper *s)
{
    int n = s->system.chain.size;
    for (int c = 1; c < s->system.chain.count && s->tools.count > 2; c++)
        for (int k = s->tools.count - 1; k > 1; k--) {
            int out = is_inside(s, c, k) ? tools_around(s, c, k) : 0;
            for (int i = 0; out > 0 && i < 2; i++) {
                int from = unknown_of(k) + i, to = unknown_of(out) + i;
                double *d = s->system.chain.diag + block_of(s, c), *l = s->system.chain.lower + block_of(s, c), *before = l - n * n;
                for (int j = 0; j < n; j++)
                    d[n * to + j] += d[n * from + j];
                for (int j = 0; j < n; j++)
                    d[n * j + to] += d[n * j + from];
                for (int j = 0; c + 1 < s->system.chain.count && j < n; j++)
                    l[n * j + to] += l[n * j + from];
                for (int j = 0; j < n; j++)
                    before[n * to + j] += before[n * from + j];
                s->system.b[row_of(s, c) + (size_t)to] += s->system.b[row_of(s, c) + (size_t)from];
            }
        }
}

void tools_from_slips(Stepper *s)
{
    for (int c = 1; c < s->system.chain.count; c++)
        for (int k = 2; k < s->tools.count; k++) {
            int out = is_inside(s, c, k) ? tools_around(s, c, k) : 0;
            for (int i = 0; out > 0 && i < 2; i++)
                s->system.u[row_of(s, c) + (size_t)(unknown_of(k) + i)] += s->system.u[row_of(s, c) + (size_t)(unknown_of(out) + i)];
        }
}

void tools_keep_slides(Stepper *s)
{
    for (int i = 0; i < s->system.set.slide_count; i++) {
        const ContactSlide *slide = &s->system.set.slide[i];
        SEL_ASSERT(slide->node >= 0 && slide->node < s->state.node_count && slide->unknown >= 6, "a slide belongs to an inner tool at a node");
        double *force = s->state.slide_force + 3 * (slide->node * s->state.inner_count + (slide->unknown - 6) / 2);
        force[0] = slide->force[0], force[1] = slide->force[1], force[2] = slide->bound;
    }
}

double tools_slipped(const Stepper *s, int c, int k, int about)
{
    const double *u = s->iterate.moved + row_of(s, c);
    int out = tools_around(s, c, k);
    return u[unknown_of(k) + about] - (out > 0 ? u[unknown_of(out) + about] : 0);
}

static double friction_work(const Stepper *s, bool at_start)
{
    double work = 0;
    for (int i = 0; s->tools.count > 1 && i < s->system.set.slide_count; i++) {
        const ContactSlide *slide = &s->system.set.slide[i];
        const double *force = at_start ? slide->held : slide->force;
        for (int j = 0; j < 2; j++)
            work -= force[j] * (j ? slide->radius : 1) * tools_slipped(s, slide->node, 1 + (slide->unknown - 6) / 2, j);
    }
    return work;
}

double tools_friction_work(const Stepper *s) { return friction_work(s, false); }
double tools_friction_start_work(const Stepper *s) { return friction_work(s, true); }
