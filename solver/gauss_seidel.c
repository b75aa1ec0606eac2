// What both forms of the contact solve share: the contacts in the order of the chain, and the measure of how well they are solved.
//
// Residual of a contact (Alart and Curnier's map), with its own stiffness k_n, k_t of the node alone in front of the violation:
//   normal      f_n - (f_n - k_n (gap + d_n))+
//   tangential  f_t - P(f_t - k_t d_t), P onto the disc of radius mu f_n, or of a slide's bound
// The node's own stiffness is the strictest sensible scale: the operator W between forces and motion is never smaller than 1/(4 k), so a
// residual of 1e-6 is a force error of about 1e-6 also where a stiff straight wire carries many contacts and W is nearly singular.
#include "solver/gauss_seidel.h"

#include "solver/contact_forms.h"

#include <stdlib.h>
#include <string.h>

// Condensing costs about as much as two factorisations of what goes: it pays unless nearly all nodes stay.
static const double FULL_SHARE = 1.25;
static const double LEAST_FORCE = 1e-3;  // [N] that errors are measured against

ContactOptions contact_default_options(void)
{
    return (ContactOptions){.form = CONTACT_BLOCK, .max_iterations = 200, .tolerance = 1e-6};
}

static Sym3 block_at(const double *d, int n) { return (Sym3){d[0], d[n], d[2 * n], d[n + 1], d[2 * n + 1], d[2 * n + 2]}; }

// The stiffness that a contact sees: its node's own, or of two nodes and their turns in series, each with its share.
static void own_stiffness(const BlockChain *chain, ContactRow *c)
{
    double kn = 0, kt = 0, yields = 0, give_n = 0, give_t = 0;
    Vec3 n = c->normal;
    for (int e = 0; e < c->nodes; e++) {
        const int size = chain->size;
        const double *d = chain->diag + (size_t)(size * size) * (size_t)(c->node + e), w = c->weight[e];
        unsigned mask = c->mask[e] = contact_free_dofs(chain, c->node + e);
        Sym3 k = block_at(d, size), turn = block_at(d + 3 * (size + 1), size);
        double normal = sym3_quadratic(&k, n), free = (mask & 1 ? n.x * n.x : 0) + (mask & 2 ? n.y * n.y : 0) + (mask & 4 ? n.z * n.z : 0);
        yields += w * w * free;
        kn += normal;
        kt += (sym3_trace(&k) - normal) / 2;
        double levered = mask >> 3 == 7 ? 3 * vec3_norm2(c->lever[e]) / sym3_trace(&turn) : 0;
        give_n += w * w * free / normal + levered;
        give_t += w * w * 2 / (sym3_trace(&k) - normal) + levered;
    }
    c->stiffness_n = c->nodes == 1 ? kn : 1 / give_n;
    c->stiffness_t = c->nodes == 1 ? kt : 1 / give_t;
    c->inert = !(yields > 1e-8) || !isfinite(c->gap) || !vec3_is_finite(n);
}

// The mean over the directions in which it can move, as along a wall.
static void slide_stiffness(const BlockChain *chain, double give, ContactRow *c)
{
    const size_t n = (size_t)chain->size, at = (size_t)c->slide;
    const double *d = chain->diag + n * n * (size_t)c->node + (n + 1) * at;
    c->mask[0] = (contact_is_free(chain, c->node, c->slide) ? 1u : 0) | (c->radius > 0 && contact_is_free(chain, c->node, c->slide + 1) ? 2u : 0);
    double s = c->mask[0] & 1 ? d[0] : 0, phi = c->mask[0] & 2 ? d[n + 1] / (c->radius * c->radius) : 0;
    c->stiffness_n = c->stiffness_t = (s + phi) / (c->mask[0] == 3 ? 2 : 1);
    c->inert = c->mask[0] == 0 || !(c->bound > 0) || !isfinite(c->bound) || !isfinite(c->radius);
    c->spring = c->inert ? 0 : c->bound / give;
}

// Both ends give way.
static void pair_stiffness(const BlockChain *chain, ContactRow *c, ContactRow *far)
{
    double give_n = 0, give_t = 0;
    ContactRow *end[2] = {c, far};
    for (int e = 0; e < 2; e++) {
        own_stiffness(chain, end[e]);
        give_n += end[e]->inert ? 0 : 1 / end[e]->stiffness_n;
        give_t += end[e]->inert ? 0 : 1 / end[e]->stiffness_t;
    }
    c->inert &= far->inert;
    c->stiffness_n = 1 / give_n;
    c->stiffness_t = 1 / give_t;
}

static ContactRow pair_end(const ContactPair *p, int e, int stride)
{
    const ContactEnd *end = &p->end[e];
    double sign = e ? -1 : 1;
    ContactRow c = {.node = end->node, .chain_node = end->node, .stride = stride, .nodes = 2, .normal = p->normal, .gap = p->gap, .radius = sign * end->radius,
                    .friction = fmax(0, p->friction)};
    for (int k = 0; k < 2; k++) {
        c.weight[k] = sign * end->weight[k];
        c.lever[k] = vec3_scale(end->lever[k], sign);
    }
    return c;
}

static void insert(ContactRow *row, int k, const ContactRow *c)
{
    for (; k > 0 && (row[k - 1].node > c->node || (row[k - 1].node == c->node && row[k - 1].weight[1] > c->weight[1])); k--)
        row[k] = row[k - 1];
    row[k] = *c;
}

int contact_rows_fill(const ContactSet *set, const BlockChain *chain, bool slides_apart, ContactRow *row, ContactRow *far)
{
    const Vec3 none = {0, 0, 0};
    int count = set->count, behind = set->count + set->pair_count;
    for (int i = 0; i < set->count; i++) {
        const ContactPoint *p = &set->point[i];
        ContactRow c = {.node = p->node, .chain_node = p->node, .stride = chain->size, .point = i, .nodes = p->xi > 0 && p->node + 1 < chain->count ? 2 : 1, .weight = {1, 0},
                        .normal = p->normal, .gap = p->gap, .radius = p->tool_radius, .friction = fmax(0, p->friction)};
        if (c.nodes == 2)
            for (int e = 0; e < 2; e++) {
                c.weight[e] = e ? p->xi : 1 - p->xi;
                c.lever[e] = p->lever[e];
            }
        own_stiffness(chain, &c);
        if (c.inert)
            c.gap = HUGE_VAL;
        c.force = c.inert || !vec3_is_finite(p->force) ? none : contact_project(&c, p->force);
        insert(row, i, &c);
    }
    for (int i = 0; i < set->slide_count; i++) {
        const ContactSlide *p = &set->slide[i];
        ContactRow c = {.node = p->node, .chain_node = p->node, .stride = chain->size, .slide = p->unknown, .point = i, .nodes = 1, .weight = {1, 0},
                        .normal = {0, 0, 1}, .radius = p->radius, .bound = p->bound};
        slide_stiffness(chain, p->give, &c);
        Vec3 force = vec3(c.mask[0] & 1 ? p->force[0] : 0, c.mask[0] & 2 ? p->force[1] : 0, 0);
        c.force = c.inert || !vec3_is_finite(force) ? none : contact_project(&c, force);
        Vec3 held = vec3(c.mask[0] & 1 ? p->held[0] : 0, c.mask[0] & 2 ? p->held[1] : 0, 0);
        c.held = c.inert || !vec3_is_finite(held) ? none : contact_project(&c, held);
        if (slides_apart)
            row[behind++] = c;
        else
            insert(row, count++, &c);
    }
    for (int i = 0; i < set->pair_count; i++) {
        const ContactPair *p = &set->pair[i];
        far[i] = pair_end(p, 1, chain->size);
        ContactRow c = pair_end(p, 0, chain->size);
        c.point = i;
        c.far = &far[i];
        pair_stiffness(chain, &c, &far[i]);
        if (c.inert)
            c.gap = HUGE_VAL;
        c.force = c.inert || !vec3_is_finite(p->force) ? none : contact_project(&c, p->force);
        row[count + i] = c;
    }
    return count + set->pair_count;
}

double contact_residual(const ContactRow *row, int count, const Vec3 *motion, ContactReport *report)
{
    double worst = 0, top = LEAST_FORCE * LEAST_FORCE, cone = 0; // squares, the first two
    int active = 0, pairs = 0;
    for (int i = 0; i < count; i++) {
        const ContactRow *c = &row[i];
        if (c->inert || contact_row_is_idle(c, motion[i]))
            continue;
        double fn = vec3_dot(c->force, c->normal);
        Vec3 error = contact_error(c, c->force, motion[i], 1);
        double off = vec3_norm2(error), force = vec3_norm2(c->force);
        worst = off > worst ? off : worst;
        top = force > top ? force : top;
        *(c->far ? &pairs : &active) += fn > 0;
        if (fn > 0 || c->slide)
            cone = fmax(cone, contact_row_excess(c));
    }
    report->active = active;
    report->pairs = pairs;
    report->largest = sqrt(top);
    report->cone_violation = cone;
    return report->residual = sqrt(worst) / report->largest;
}

void contact_balance(ContactSolver *s, const BlockFactor *factor, const double *b, int count, double *u)
{
    memcpy(s->rhs, b, (size_t)(s->matrix.count * s->matrix.size) * sizeof *b);
    for (int i = 0; i < count; i++)
        contact_row_push(&s->row[i], s->row[i].force, s->rhs);
    block_factor_solve(factor, s->rhs, u);
    for (int i = 0; i < count; i++)
        s->motion[i] = contact_row_motion(&s->row[i], u);
}

ContactSolver *contact_solver_create(int node_count, int size, int contact_capacity)
{
    ContactSolver *s = calloc(1, sizeof *s);
    if (!s || node_count < 1 || !block_size_is_known(size) || contact_capacity < 0) {
        free(s);
        return NULL;
    }
    size_t n = (size_t)node_count * (size_t)size, blocks = block_doubles(node_count, size), k = (size_t)contact_capacity + 1;
    s->node_count = node_count;
    s->capacity = contact_capacity;
    s->row = calloc(k, sizeof *s->row);
    s->spare = calloc(k, sizeof *s->spare);
    s->motion = calloc(k, sizeof *s->motion);
    s->law = calloc(k, sizeof *s->law);
    s->best = calloc(k, sizeof *s->best);
    s->best_u = calloc(n, sizeof *s->best_u);
    s->flag = calloc(k, sizeof *s->flag);
    s->wall = calloc(k, sizeof *s->wall);
    s->rhs = calloc(n, sizeof *s->rhs);
    s->delta = calloc(n, sizeof *s->delta);
    s->turned = calloc(blocks, sizeof *s->turned);
    s->turned_chain = calloc(blocks, sizeof *s->turned_chain);
    s->small_u = calloc(n, sizeof *s->small_u);
    s->side = calloc(n, sizeof *s->side);
    s->braced_factor = block_factor_create(node_count, size);
    s->lu = block_lu_create(node_count, size);
    s->condenser = block_condenser_create(node_count, size);
    s->factor = block_factor_create(node_count, size);
    s->pointwise = pointwise_work_create(node_count, size, contact_capacity);
    bool ok = block_chain_create(&s->matrix, node_count, size) && s->pointwise && s->condenser && s->small_u && s->turned_chain && s->side && s->braced_factor;
    if (!s->row || !s->spare || !s->motion || !s->law || !s->best || !s->best_u || !s->flag || !s->wall || !s->rhs || !s->delta || !s->turned || !s->lu || !s->factor || !ok) {
        contact_solver_destroy(s);
        return NULL;
    }
    return s;
}

bool contact_solver_reserve_pairs(ContactSolver *s, int pairs)
{
    size_t k = (size_t)s->capacity + (size_t)pairs + 1;
    free(s->row), free(s->motion), free(s->law), free(s->best), free(s->flag), free(s->wall);
    pointwise_work_destroy(s->pointwise);
    s->row = calloc(k, sizeof *s->row);
    s->motion = calloc(k, sizeof *s->motion);
    s->law = calloc(k, sizeof *s->law);
    s->best = calloc(k, sizeof *s->best);
    s->flag = calloc(k, sizeof *s->flag);
    s->wall = calloc(k, sizeof *s->wall);
    s->pointwise = pointwise_work_create(s->node_count, s->matrix.size, s->capacity + pairs);
    contact_pairs_destroy(s->pairs);
    s->pairs = contact_pairs_create(s->node_count, s->matrix.size, pairs);
    return s->row && s->motion && s->law && s->best && s->flag && s->wall && s->pointwise && s->pairs;
}

void contact_solver_destroy(ContactSolver *s)
{
    if (!s)
        return;
    free(s->row);
    free(s->spare);
    free(s->motion);
    free(s->law);
    free(s->best);
    free(s->best_u);
    free(s->flag);
    free(s->wall);
    free(s->rhs);
    free(s->delta);
    free(s->turned);
    free(s->small_u);
    free(s->side);
    block_factor_destroy(s->braced_factor);
    free(s->turned_chain);
    block_condenser_destroy(s->condenser);
    block_lu_destroy(s->lu);
    pointwise_work_destroy(s->pointwise);
    contact_pairs_destroy(s->pairs);
    block_factor_destroy(s->factor);
    block_chain_destroy(&s->matrix);
    free(s);
}

// Does the block form on the chain of the contacts' nodes, where these are few. False where it cannot.
static bool solve_condensed(ContactSolver *s, const BlockChain *chain, const double *b, int count, const ContactOptions *options, double *u,
                            ContactReport *report)
{
    bool *keep = block_condenser_keep(s->condenser);
    int kept = 0;
    for (int i = 0; i < count; i++)
        for (int e = 0; e < s->row[i].nodes; e++) {
            bool *flag = &keep[s->row[i].chain_node + e];
            kept += !*flag;
            *flag = true;
        }
    for (int i = s->banded; i < count; i++)
        for (int e = 0; e < 2; e++) {
            bool *flag = &keep[s->row[i].far->chain_node + e];
            kept += !*flag;
            *flag = true;
        }
    if (FULL_SHARE * kept > chain->count) {
        memset(keep, 0, (size_t)chain->count * sizeof *keep);
        return false;
    }
    const BlockChain *small = block_condense(s->condenser, chain, b);
    if (!small || !(s->is_positive || block_chain_factor(small, s->factor)))
        return false;
    for (int i = 0; i < count; i++)
        s->row[i].node = block_condenser_place(s->condenser, s->row[i].chain_node);
    for (int i = s->banded; i < count; i++)
        s->row[i].far->node = block_condenser_place(s->condenser, s->row[i].far->chain_node);
    // an iteration costs what is left of the chain: up to twice as many are in the same bound
    ContactOptions longer = *options;
    longer.max_iterations = (int)(options->max_iterations * fmin(2, (double)chain->count / small->count));
    s->small = small;
    *report = contact_newton(s, small, s->factor, block_condenser_side(s->condenser), count, &longer, s->small_u);
    block_condenser_expand(s->condenser, s->small_u, u);
    return true;
}

bool contact_walls(ContactSolver *s, const BlockChain *chain, const double *b, int count, const ContactOptions *options, double *u, ContactReport *report)
{
    *report = (ContactReport){.converged = true, .largest = LEAST_FORCE};
    s->small = NULL;
    if (count == 0)
        return block_chain_factor_solve(chain, s->factor, b, u);
    if (solve_condensed(s, chain, b, count, options, u, report))
        return true;
    if (!block_chain_factor(chain, s->braced_factor))
        return false;
    for (int i = 0; i < count; i++)
        s->row[i].node = s->row[i].chain_node;
    for (int i = s->banded; i < count; i++)
        s->row[i].far->node = s->row[i].far->chain_node;
    *report = contact_newton(s, chain, s->braced_factor, b, count, options, u);
    return true;
}

bool contact_walls_again(ContactSolver *s, const BlockChain *chain, const double *change, int count, double *u, ContactReport *report)
{
    double *more = s->best_u;    // not in use between solves
    if (!s->small && count > 0)
        return false;
    if (!s->small) {
        block_factor_solve(s->factor, change, more);
        report->residual = 0;
    } else {
        block_condenser_turn_to(s->condenser, change);
        if (!contact_newton_again(s, s->small, block_condenser_side(s->condenser), count, s->small_u, report))
            return false;
        block_condenser_expand(s->condenser, s->delta, more);
    }
    for (int i = 0; i < chain->size * chain->count; i++)
        u[i] += more[i];
    return true;
}

bool contact_needs_factor(const ContactSet *set, const ContactOptions *options)
{
    return set->slide_count == 0 || options->form == CONTACT_POINTWISE;
}

ContactReport contact_solve(ContactSolver *solver, const BlockChain *chain, const BlockFactor *factor, const double *b, ContactSet *set,
                            const ContactOptions *options, double *u)
{
    bool by_points = options->form == CONTACT_POINTWISE;
    int count = contact_rows_fill(set, chain, !by_points, solver->row, contact_pairs_far(solver->pairs)), all = set->count + set->slide_count + set->pair_count;
    solver->banded = count - set->pair_count;
    solver->wall_count = 0;
    for (int i = 0; i < solver->banded; i++)
        if (!solver->row[i].slide)
            solver->wall[solver->wall_count++] = i;
    ContactReport report;
    if (!by_points)
        block_condenser_survey(solver->condenser, chain);
    for (int i = count; i < all; i++) {
        const double *slip = set->slide[solver->row[i].point].slip;
        bool known = isfinite(slip[0]) && isfinite(slip[1]);
        solver->motion[i] = vec3(known && solver->row[i].mask[0] & 1 ? slip[0] : 0, known && solver->row[i].mask[0] & 2 ? slip[1] : 0, 0);
    }
    if (by_points)
        report = contact_pointwise(solver, chain, factor, b, count, options, u);
    else if (count < all)
        report = contact_slides(solver, chain, b, count, all, options, u);
    else if (!solve_condensed(solver, chain, b, count, options, u, &report))
        report = contact_newton(solver, chain, factor, b, count, options, u);
    if (!by_points)
        contact_cut(solver, count, &report);
    for (int i = 0; i < all; i++) {
        const ContactRow *c = &solver->row[i];
        if (c->far) {
            set->pair[c->point].force = c->force;
        } else if (c->slide) {
            set->slide[c->point].slip[0] = solver->motion[i].x;
            set->slide[c->point].slip[1] = solver->motion[i].y;
            set->slide[c->point].force[0] = c->force.x;
            set->slide[c->point].force[1] = c->force.y;
        } else {
            set->point[c->point].force = c->force;
        }
    }
    return report;
}
