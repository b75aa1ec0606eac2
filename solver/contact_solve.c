// Dispatches a contact solve to one of its two forms and owns their work space.
#include "solver/contact_solve.h"

#include "base/base.h"

#include "solver/contact_forms.h"

#include <stdlib.h>

ContactOptions contact_default_options(void) { return (ContactOptions){.form = CONTACT_BLOCK, .max_iterations = 200, .tolerance = 1e-6}; }

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
    if (!s->row || !s->spare || !s->motion || !s->law || !s->best || !s->best_u || !s->flag || !s->wall || !s->rhs || !s->delta || !s->turned || !s->lu ||
        !s->factor || !ok) {
        contact_solver_destroy(s);
        return NULL;
    }
    return s;
}

bool contact_solver_reserve_pairs(ContactSolver *s, int pairs)
{
    SEL_ASSERT(pairs >= 0, "the number of pairs is not negative");
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

bool contact_needs_factor(const ContactSet *set, const ContactOptions *options)
{
    return set->count + set->slide_count + set->pair_count == 0 || options->form == CONTACT_POINTWISE;
}

static void take_forces(const ContactSolver *solver, int count, ContactSet *set)
{
    for (int i = 0; i < count; i++) {
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
}

// Fills the rows of the set: wall contacts and pairs first, slides after them. Returns the number of the former.
static int fill_rows(const ContactProblem *problem, bool by_points, int all)
{
    ContactSolver *solver = problem->solver;
    const ContactSet *set = problem->set;
    int count = contact_rows_fill(set, problem->chain, !by_points, solver->row, contact_pairs_far(solver->pairs));
    solver->banded = count - set->pair_count;
    solver->wall_count = 0;
    for (int i = 0; i < solver->banded; i++)
        if (!solver->row[i].slide)
            solver->wall[solver->wall_count++] = i;
    for (int i = count; i < all; i++) {
        const double *slip = set->slide[solver->row[i].point].slip;
        bool known = isfinite(slip[0]) && isfinite(slip[1]);
        solver->motion[i] = vec3(known && solver->row[i].mask[0] & 1 ? slip[0] : 0, known && solver->row[i].mask[0] & 2 ? slip[1] : 0, 0);
    }
    return count;
}

ContactReport contact_solve(const ContactProblem *problem)
{
    ContactSolver *solver = problem->solver;
    ContactSet *set = problem->set;
    const BlockChain *chain = problem->chain;
    SEL_REQUIRE(set->count + set->slide_count <= solver->capacity, "the solver has room for all contacts and slides");
    SEL_REQUIRE(chain->count <= solver->node_count && chain->size == solver->matrix.size, "the solver was made for such a chain");
    SEL_ASSERT(problem->options->max_iterations > 0 && problem->options->tolerance > 0, "the iteration limit and the tolerance are positive");
    ContactReport report = {.converged = true};
    int all = set->count + set->slide_count + set->pair_count;
    if (!problem->factor)
        return (ContactReport){.singular = true};
    if (all == 0) {
        block_factor_solve(problem->factor, problem->b, problem->u);
        return report;
    }
    const ContactOptions *options = problem->options;
    const BlockFactor *factor = problem->factor;
    const double *b = problem->b;
    double *u = problem->u;
    bool by_points = options->form == CONTACT_POINTWISE;
    int count = fill_rows(problem, by_points, all);
    if (!by_points)
        block_condenser_survey(solver->condenser, chain);
    if (by_points)
        report = contact_pointwise(solver, chain, factor, b, count, options, u);
    else if (count < all)
        report = contact_slides(solver, chain, b, count, all, options, u);
    else if (!contact_walls(solver, chain, b, count, options, u, &report))
        return (ContactReport){.singular = true};
    if (!by_points)
        contact_cut(solver, count, &report);
    take_forces(solver, all, set);
    return report;
}
