// Slides: Newton's method on their forces, which are functions of the motion, with the wall's contacts solved inside every iteration.
//
// f(d) = P(t), t = held - k d, k = bound / give, P onto the disc of radius `bound`. About a motion e, with t there and the last iterate's force f0:
//   |t| <= bound   f = t - k (d - e)
//   beyond         f = bound p - C (d - e),  p = t / |t|,  C = k / |t| (bound I - (f0 p^T + p f0^T) / 2)
// The second linearises f |t| = bound t in force and motion together (Chan, Golub and Mulet 1999, for total variation). With p in place of f0 / bound a
// slide that is pushed past its turning point is not resisted, and goes to and fro for ever; so whole steps find the answer from anywhere.
//
// C changes little between the last iterations. Then the same matrix, condensed and factored, serves once more: the right-hand side has what forces lack.
//
// C is symmetric and positive and goes to the node's diagonal block whether or not the slide slips. So an iteration leaves a symmetric chain A + J^T C J
// on which the wall's contacts are alone, condensed to their nodes: the many slides cost one elimination, and what the wall does costs little more. Contacts
// far from those that press wait until an iteration's motion goes through them. From the slip of the step before one or two iterations are the rule, up to ten
// where hands turn round.
#include "solver/contact_forms.h"

#include <limits.h>
#include <string.h>

// The same matrix is tried again from this error on, as a share of the largest force, and as long as no more than this part of an error stays.
static const double NEAR = 1e-4, STAYS = 0.3;
// Walls need not be solved much better than slides are meanwhile: to this share of the last round's error.
static const double WALLS_SHARE = 0.03, WALLS_ROUGH = 1e-2;

static Vec3 force_at(const ContactRow *c, Vec3 d) { return contact_project(c, vec3_add_scaled(c->held, -c->spring, d)); }

// C about motion e.
static Mat3 resistance(const ContactRow *c, Vec3 e)
{
    SEL_ASSERT(c->bound > 0 && c->spring > 0, "a slide that bears has a bound, and gives before it slips");
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
    SEL_ASSERT(c->slide >= 6 && c->slide + 1 < chain->size, "a slide's unknowns stand behind the first six");
    const size_t n = (size_t)chain->size;
    return chain->diag + n * n * (size_t)c->node + (n + 1) * (size_t)c->slide;
}

// What the chain has without the laws, aside, or back again.
static void keep_own(ContactSolver *s, const BlockChain *chain, int from, int to, bool back)
{
    const int n = chain->size;
    for (int i = from; i < to; i++) {
        double *at = slide_block(chain, &s->row[i]), *own = s->law[i].own;
        for (int k = 0; k < 4; k++)
            *(back ? &at[n * (k / 2) + k % 2] : &own[k]) = back ? own[k] : at[n * (k / 2) + k % 2];
    }
}

// The laws about each slide's motion: into the chain's diagonal, and their forces on what does not move into the right-hand side.
static void write_laws(ContactSolver *s, const BlockChain *chain, const double *b, int from, int to)
{
    SEL_ASSERT(b != s->side, "the right-hand side without slides is kept: each round begins with it");
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

// Forces by the laws and motion of a solution; returns how far these forces are from those due at the motion [N]. *largest: of the forces.
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
    if (a->far || b->far)        // pairs behind all
        return a->far && b->far ? a->point < b->point : b->far != NULL;
    if (a->chain_node != b->chain_node)
        return a->chain_node < b->chain_node;
    return contact_row_place(a) != contact_row_place(b) ? contact_row_place(a) < contact_row_place(b) : a->point < b->point;
}

// The walls' contacts and the pairs [0, to), those that wait behind the others, both in the order of the chain; they were so up to `before`. Returns how many do not wait.
static int put_in_order(ContactSolver *s, int before, int to)
{
    SEL_ASSERT(before >= 0 && before <= to, "rows that were in order stand before the others");
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

// At first a contact that neither presses nor overlaps, with none that does at its node or next to it, waits.
static int first_contacts(ContactSolver *s, int to)
{
    int last = -2;           // the last node where one presses
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

// Those of the waiting ones that the motion goes through do not wait any longer. Returns the largest error among them [N].
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

// Forces of the step before do not balance the new loads, and would send contacts that slide anywhere at first: those are taken to move as in u, which is what
// the caller expects, and then the last solution.
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
    double wall, slide, passed;  // of walls, of slides, of walls that wait
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

// What slides' forces lack, to s->side; their laws have it from now on.
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

// Forces of an iterate and slides' motion, aside, or back again.
static void keep_forces(ContactSolver *s, int walls, int from, int to, bool back)
{
    SEL_ASSERT(walls <= from && from <= to, "slides stand behind the contacts with walls");
    for (int i = 0; i < to; i = i + 1 == walls ? from : i + 1) {
        *(back ? &s->row[i].force : &s->best[i]) = back ? s->best[i] : s->row[i].force;
        if (i >= from)
            *(back ? &s->law[i].step : &s->motion[i]) = back ? s->motion[i] : s->law[i].step;
    }
}

// Near the answer the matrix hardly changes any more: it serves again, for what forces still lack, as long as most of that goes each time. Where that does
// not lead to the end everything is as before: a force between two iterations' would be a bad f0, which sends slides to and fro.
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
    SEL_ASSERT(from >= 0 && from < to, "there are slides, behind the contacts with walls");
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
