// Prescribes unknowns, and computes their reactions.
#include "solver/step_internal.h"

void stepper_prescribe(Stepper *s, int node, int dof, double value)
{
    SEL_ASSERT(node >= 0 && node < s->system.chain.count && dof >= 0 && dof < s->system.chain.size, "an unknown is one of the chain's");
    SEL_ASSERT(isfinite(value), "the prescribed value is finite");
    int n = s->system.chain.size;
    double *d = s->system.chain.diag + block_of(s, node), *b = s->system.b + row_of(s, node);
    for (int r = 0; r < n; r++) {
        b[r] -= d[n * r + dof] * value;
        d[n * r + dof] = d[n * dof + r] = 0;
    }
    if (node + 1 < s->system.chain.count) {
        double *l = s->system.chain.lower + block_of(s, node);
        for (int r = 0; r < n; r++) {
            b[n + r] -= l[n * r + dof] * value;
            l[n * r + dof] = 0;
        }
    }
    if (node > 0) {
        double *l = s->system.chain.lower + block_of(s, node - 1);
        for (int c = 0; c < n; c++) {
            b[c - n] -= l[n * dof + c] * value;
            l[n * dof + c] = 0;
        }
    }
    d[(n + 1) * dof] = 1;
    b[dof] = value;
}

double stepper_reaction(const Stepper *s, int dof)
{
    SEL_ASSERT(dof >= 0 && dof < s->system.chain.size, "the unknown is one of the first node's");
    int n = s->system.chain.size;
    double sum = -s->system.grip_b[dof];
    for (int c = 0; c < n; c++) {
        sum += s->system.grip_diag[n * dof + c] * s->system.u[c];
        if (s->system.chain.count > 1)
            sum += s->system.grip_lower[n * c + dof] * s->system.u[n + c];
    }
    return sum;
}

double stepper_wanted(const Stepper *s)
{
    // to the position that the command gives, so that rounding errors of earlier steps do not accumulate
    double coordinate = s->state.inserted + s->command.advance - s->wire.total_length;
    return coordinate - vec3_dot(vec3_sub(s->start.position[0], s->entry.mouth), s->entry.axis[0]);
}
