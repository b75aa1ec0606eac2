// Residual and balance of the contacts.
//
// Residual of a contact (natural map of Alart and Curnier), with the stiffness k_n, k_t of its node alone as the factor of the violation:
//   normal      f_n - (f_n - k_n (gap + d_n))+
//   tangential  f_t - P(f_t - k_t d_t), P the projection onto the disc of radius mu f_n, or of a slide's bound
// The node's own stiffness is the strictest reasonable scale: the operator W from forces to motion is never smaller than 1/(4 k), so that a residual
// of 1e-6 means a force error of about 1e-6 even where a stiff straight wire has many contacts and W is nearly singular.
#include "solver/contact_forms.h"

#include <string.h>

double contact_residual(const ContactRow *row, int count, const Vec3 *motion, ContactReport *report)
{
    double worst = 0, top = LEAST_FORCE * LEAST_FORCE, cone = 0; // the first two are squares
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
    SEL_ASSERT(s->matrix.count > 0 && s->matrix.count <= s->node_count, "the solver was made for a chain of this length");
    SEL_ASSERT(u != s->rhs, "u does not overwrite the right-hand side");
    memcpy(s->rhs, b, (size_t)(s->matrix.count * s->matrix.size) * sizeof *b);
    for (int i = 0; i < count; i++)
        contact_row_push(&s->row[i], s->row[i].force, s->rhs);
    block_factor_solve(factor, s->rhs, u);
    for (int i = 0; i < count; i++)
        s->motion[i] = contact_row_motion(&s->row[i], u);
}
