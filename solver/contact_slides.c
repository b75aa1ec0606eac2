// Slides: Newton's method on their forces as functions of the motion, with the wall contacts solved within every iteration.
//
// f(d) = P(t), t = held - k d, k = bound / give, P the projection onto the disc of radius `bound`. Linearised about a motion e, with t evaluated there and f0
// the force of the last iterate:
//   |t| <= bound   f = t - k (d - e)
//   otherwise      f = bound p - C (d - e),  p = t / |t|,  C = k / |t| (bound I - (f0 p^T + p f0^T) / 2)
// The second case linearises f |t| = bound t in force and motion together (Chan, Golub and Mulet 1999, for total variation). With p in place of f0 / bound a
// slide that is pushed past its turning point meets no resistance and the iteration alternates indefinitely; with f0, full steps converge from any start.
//
// C changes little in the last iterations. The same condensed and factored matrix is then reused, with the missing part of the forces as right-hand side.
//
// C is symmetric and positive semi-definite and is added to the node's diagonal block whether or not the slide slips. The result is a symmetric chain
// A + J^T C J with wall contacts only, condensed to their nodes: the many slides cost one elimination, and the wall contacts little more. Contacts far from the
// loaded ones are excluded until the motion of an iteration violates them. Starting from the slip of the preceding step, one or two iterations are typical,
// and up to ten where the hands reverse.
#include "solver/contact_forms.h"

#include <limits.h>
#include <string.h>

// The matrix is reused once the error, relative to the largest force, is below the first value, while each step leaves at most the second fraction of it.
static const double NEAR = 1e-4, STAYS = 0.3;
// Tolerance of the wall contacts in intermediate iterations: this fraction of the last error of the slides, and its upper limit.
static const double WALLS_SHARE = 0.03, WALLS_ROUGH = 1e-2;

static Vec3 force_at(const ContactRow *c, Vec3 d) { return contact_project(c, vec3_add_scaled(c->held, -c->spring, d)); }

// C at motion e.
static Mat3 resistance(const ContactRow *c, Vec3 e)
{
    SEL_ASSERT(c->bound > 0 && c->spring > 0, "a loaded slide has a positive bound and a positive stiffness");
    Vec3 t = vec3_add_scaled(c->held, -c->spring, e), f0 = contact_project(c, c->force);
    double size = vec3_norm(t);
    if (size <= c->bound)
        return (Mat3){{{c->spring, 0, 0}, {0, c->spring, 0}, {0, 0, 0}}};
    Vec3 p = vec3_scale(t, 1 / size);
    double k = c->spring / size, xy = -0.5 * k * (p.x * f0.y + p.y * f0.x);
    return (Mat3){{{k * (c->bound - p.x * f0.x), xy, 0}, {xy, k * (c->bound - p.y * f0.y), 0}, {0, 0, 0}}};
}

static double *slide_block(const BlockChain *chain, const ContactRow *c)
{
    SEL_ASSERT(c->slide >= 6 && c->slide + 1 < chain->size, "the unknowns of a slide follow the first six");
    const size_t n = (size_t)chain->size;
    return chain->diag + n * n * (size_t)c->node + (n + 1) * (size_t)c->slide;
}

// Saves the chain's entries without the slides' laws, or restores them.
static void keep_own(ContactSolver *s, const BlockChain *chain, int from, int to, bool back)
{
    const int n = chain->size;
    for (int i = from; i < to; i++) {
        double *at = slide_block(chain, &s->row[i]), *own = s->law[i].own;
        for (int k = 0; k < 4; k++)
            *(back ? &at[n * (k / 2) + k % 2] : &own[k]) = back ? own[k] : at[n * (k / 2) + k % 2];
    }
}

// Writes the slides' laws, linearised about their motions: C to the diagonal of the chain, the forces at zero motion to the right-hand side.
static void write_laws(ContactSolver *s, const BlockChain *chain, const double *b, int from, int to)
{
    SEL_ASSERT(b != s->side, "b is not overwritten, because each iteration starts from it");
    const int n = chain->size;
    memcpy(s->side, b, (size_t)(chain->count * n) * sizeof *b);
    for (int i = from; i < to; i++) {
        const ContactRow *c = &s->row[i];
        ContactLaw *law = &s->law[i];
        law->force = vec3(0, 0, 0);
        if (c->inert)
            continue;
        law->c = resistance(c, s->motion[i]);
        law->force = vec3_add(force_at(c, s->motion[i]), mat3_mul_vec(&law->c, s->motion[i]));
        contact_row_push(c, law->force, s->side);
        const double arm[2] = {c->mask[0] & 1 ? 1 : 0, c->mask[0] & 2 ? c->radius : 0};
        double *at = slide_block(chain, c);
        for (int q = 0; q < 2; q++)
            for (int r = 0; r < 2; r++)
                at[n * r + q] = law->own[2 * r + q] + arm[r] * law->c.m[r][q] * arm[q];
    }
}

// Computes the forces by the laws, and the motion of a solution. Returns the largest error of these forces [N]; *largest: maximum including these forces.
static double read_solution(ContactSolver *s, const double *u, int from, int to, double *largest)
{
    double worst = 0, top = 0;
    for (int i = from; i < to; i++) {
        ContactRow *c = &s->row[i];
        ContactLaw *law = &s->law[i];
        law->step = contact_row_motion(c, u);
        if (c->inert)
            continue;
        c->force = vec3_sub(law->force, mat3_mul_vec(&law->c, law->step));
        worst = fmax(worst, vec3_norm2(vec3_sub(c->force, force_at(c, law->step))));
        top = fmax(top, vec3_norm2(c->force));
    }
    *largest = fmax(*largest, sqrt(top));
    return sqrt(worst);
}

static bool comes_before(const ContactRow *a, const ContactRow *b)
{
    if (a->far || b->far)        // pairs are last
        return a->far && b->far ? a->point < b->point : b->far != NULL;
    if (a->chain_node != b->chain_node)
        return a->chain_node < b->chain_node;
    return contact_row_place(a) != contact_row_place(b) ? contact_row_place(a) < contact_row_place(b) : a->point < b->point;
}

// Sorts the wall contacts and pairs [0, to) along the chain, active ones first, then excluded ones; up to `before` they were sorted. Returns the number of
// active ones.
static int put_in_order(ContactSolver *s, int before, int to)
{
    SEL_ASSERT(before >= 0 && before <= to, "sorted rows precede the others");
    ContactRow *row = s->row;
    int a = 0, b = before, count = 0, waiting = 0;
    for (int i = 0; i < to; i++) {
        s->spare[i] = b == to || (a < before && comes_before(&row[a], &row[b])) ? row[a++] : row[b++];
        SEL_ASSERT(i == 0 || !comes_before(&s->spare[i], &s->spare[i - 1]), "both parts were in the order of the chain");
    }
    for (int i = 0; i < to; i++)
        count += !s->spare[i].waits;
    s->wall_count = s->banded = 0;
    for (int i = 0, at = 0; i < to; i++) {
        bool waits = s->spare[i].waits, pair = s->spare[i].far != NULL;
        s->banded += !waits && !pair;
        if (!waits && !pair)
            s->wall[s->wall_count++] = at;
        row[waits ? count + waiting++ : at++] = s->spare[i];
    }
    return count;
}

// Initially excludes contacts that neither carry load nor overlap and have no such neighbour at their node or an adjacent one.
static int first_contacts(ContactSolver *s, int to)
{
    int last = -2;           // last node with a loaded contact
    for (int i = 0; i < to; i++) {
        ContactRow *c = &s->row[i];
        c->waits = false;
        if (c->far)
            continue;
        bool presses = vec3_norm2(c->force) > 0 || c->gap < 0;
        c->waits = !presses && c->chain_node > last + 1;
        last = presses ? c->chain_node + c->nodes - 1 : last;
    }
    last = INT_MAX - 1;
    for (int i = to - 1; i >= 0; i--) {
        ContactRow *c = &s->row[i];
        if (c->far)
            continue;
        bool presses = vec3_norm2(c->force) > 0 || c->gap < 0;
        c->waits &= c->chain_node + c->nodes - 1 < last - 1;
        last = presses ? c->chain_node : last;
    }
    return put_in_order(s, to, to);
}

// Includes the excluded contacts that the motion violates. Returns the largest error among them [N].
static double look_at_waiting(ContactSolver *s, const double *u, int from, int to, double most)
{
    double worst = 0;
    for (int i = from; i < to; i++) {
        ContactRow *c = &s->row[i];
        double error = -c->stiffness_n * (c->gap + vec3_dot(contact_row_motion(c, u), c->normal));
        c->waits = c->inert || !(error > most);
        worst = c->inert ? worst : fmax(worst, error);
    }
    return worst;
}

// The forces of the preceding step do not balance the new loads and would move slipping contacts arbitrarily in the first iteration. The contacts' motion is
// therefore estimated from u, which is the caller's estimate and later the last solution.
static void expect_motion(ContactSolver *s, int walls, const double *u)
{
    for (int i = 0; i < walls; i++) {
        ContactRow *c = &s->row[i];
        c->node = c->chain_node;
        if (c->far)
            c->far->node = c->far->chain_node;
        s->motion[i] = contact_row_motion(c, u);
    }
    s->knows_motion = walls > 0;
}

typedef struct Errors {      // [N]
    double wall, slide, passed;  // largest errors of wall contacts, of slides, and of excluded wall contacts
    double allowed;
} Errors;

static bool is_good(const Errors *e) { return e->wall <= e->allowed && e->slide <= e->allowed && e->passed <= e->allowed; }

static Errors look(ContactSolver *s, const double *u, int walls, int from, int to, double tolerance, ContactReport *report)
{
    Errors e = {.wall = report->residual * report->largest};
    e.slide = read_solution(s, u, from, to, &report->largest);
    e.allowed = tolerance * report->largest;
    e.passed = look_at_waiting(s, u, walls, from, e.allowed);
    report->residual = fmax(e.wall, fmax(e.slide, e.passed)) / report->largest;
    return e;
}

// Writes the part that is missing in the slides' forces to s->side and adds it to their laws.
static void add_missing(ContactSolver *s, const BlockChain *chain, int from, int to)
{
    memset(s->side, 0, (size_t)(chain->count * chain->size) * sizeof *s->side);
    for (int i = from; i < to; i++) {
        ContactRow *c = &s->row[i];
        ContactLaw *law = &s->law[i];
        if (c->inert)
            continue;
        Vec3 missing = vec3_sub(force_at(c, law->step), c->force);
        contact_row_push(c, missing, s->side);
        law->force = vec3_add(law->force, missing);
    }
}

// Saves the forces of an iterate and the slides' motion, or restores them.
static void keep_forces(ContactSolver *s, int walls, int from, int to, bool back)
{
    SEL_ASSERT(walls <= from && from <= to, "slides follow the wall contacts");
    for (int i = 0; i < to; i = i + 1 == walls ? from : i + 1) {
        *(back ? &s->row[i].force : &s->best[i]) = back ? s->best[i] : s->row[i].force;
        if (i >= from)
            *(back ? &s->law[i].step : &s->motion[i]) = back ? s->motion[i] : s->law[i].step;
    }
}

// Near the solution the matrix hardly changes: it is reused for the missing part of the forces as long as each step removes most of it. If this does not
// converge, the initial state is restored: a force between those of two iterations would be a poor f0 and make slides alternate.
static Errors refine(ContactSolver *s, const BlockChain *chain, int walls, int from, int to, double tolerance, double *u, Errors e, ContactReport *report)
{
    const ContactReport first_report = *report;
    const Errors first = e;
    if (is_good(&e) || e.slide > NEAR * report->largest || e.passed > e.allowed)
        return e;
    double before = HUGE_VAL;
    keep_forces(s, walls, from, to, false);
    while (!is_good(&e) && e.slide < STAYS * before) {
        before = e.slide;
        add_missing(s, chain, from, to);
        if (!contact_walls_again(s, chain, s->side, walls, u, report))
            break;
        e = look(s, u, walls, from, to, tolerance, report);
    }
    if (is_good(&e))
        return e;
    keep_forces(s, walls, from, to, true);
    *report = first_report;
    return first;
}

ContactReport contact_slides(ContactSolver *s, const BlockChain *chain, const double *b, int from, int to, const ContactOptions *options, double *u)
{
    SEL_ASSERT(from >= 0 && from < to, "there are slides, and they follow the wall contacts");
    ContactReport report = {0};
    keep_own(s, chain, from, to, false);
    ContactOptions round = *options;
    int most = options->max_iterations / CONTACT_SWEEPS_PER_FACTOR, iterations = 0, walls = first_contacts(s, from);
    for (int i = 0; i < most || i == 0; i++) {
        write_laws(s, chain, b, from, to);
        expect_motion(s, walls, u);
        s->is_positive = i > 0 && walls > 0;
        report.singular = !contact_walls(s, chain, s->side, walls, &round, u, &report);
        if (report.singular)
            break;
        iterations += 1 + report.iterations;
        Errors e = look(s, u, walls, from, to, options->tolerance, &report);
        if (report.converged)
            e = refine(s, chain, walls, from, to, options->tolerance, u, e, &report);
        report.converged &= is_good(&e);
        if (fmax(e.slide, e.passed) <= e.allowed && (is_good(&e) || round.tolerance == options->tolerance))
            break;
        round.tolerance = fmax(options->tolerance, fmin(WALLS_ROUGH, WALLS_SHARE * e.slide / report.largest));
        if (e.passed > e.allowed)
            walls = put_in_order(s, walls, from);
        for (int k = from; k < to; k++)
            s->motion[k] = s->law[k].step;
    }
    s->is_positive = false;
    keep_own(s, chain, from, to, true);
    if (report.singular)
        return report;
    report.iterations = iterations;
    for (int i = from; i < to; i++) {
        ContactRow *c = &s->row[i];
        s->motion[i] = s->law[i].step;
        c->force = contact_project(c, c->force);
    }
    return report;
}
