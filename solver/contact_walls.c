// Block form of the wall contacts, on the chain condensed to their nodes where these are few.
#include "solver/contact_forms.h"

#include <string.h>

// Condensation costs about as much as two factorisations of the eliminated part: it pays unless nearly all nodes are kept.
static const double FULL_SHARE = 1.25;

// Applies the block form to the chain condensed to the contacts' nodes. Returns false if these are too many or the chain is not positive definite.
static bool solve_condensed(ContactSolver *s, const BlockChain *chain, const double *b, int count, const ContactOptions *options, double *u,
                            ContactReport *report)
{
    SEL_ASSERT(s->banded >= 0 && s->banded <= count, "pairs follow all other rows");
    bool *keep = block_condenser_keep(s->condenser);
    int kept = 0;
    for (int i = 0; i < count; i++)
        for (int e = 0; e < s->row[i].nodes; e++) {
            SEL_ASSERT(s->row[i].chain_node + e < chain->count, "a contact is at nodes of the chain");
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
    for (int i = 0; i < count; i++) {
        s->row[i].node = block_condenser_place(s->condenser, s->row[i].chain_node);
        SEL_ASSERT(s->row[i].nodes == 1 || s->row[i].node + 1 == block_condenser_place(s->condenser, s->row[i].chain_node + 1),
                   "neighbours are neighbours in the condensed chain too");
    }
    for (int i = s->banded; i < count; i++)
        s->row[i].far->node = block_condenser_place(s->condenser, s->row[i].far->chain_node);
    // an iteration costs only as much as the condensed chain: up to twice as many are within the same bound
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
    SEL_ASSERT(change != s->best_u && u != s->best_u, "the arguments are not the saved iterate, which serves as work space");
    double *more = s->best_u;    // unused between solves
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
