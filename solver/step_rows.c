// Unknowns whose value is given, and what holding them takes.
#include "solver/step_internal.h"

void stepper_prescribe(Stepper *s, int node, int dof, double value)
{
    SEL_ASSERT(node >= 0 && node < s->chain.count && dof >= 0 && dof < s->chain.size, "an unknown is one of the chain's");
    SEL_ASSERT(isfinite(value), "an unknown is given a number");
    int n = s->chain.size;
    double *d = s->chain.diag + block_of(s, node), *b = s->b + row_of(s, node);
    for (int r = 0; r < n; r++) {
        b[r] -= d[n * r + dof] * value;
        d[n * r + dof] = d[n * dof + r] = 0;
    }
    if (node + 1 < s->chain.count) {
        double *l = s->chain.lower + block_of(s, node);
        for (int r = 0; r < n; r++) {
            b[n + r] -= l[n * r + dof] * value;
            l[n * r + dof] = 0;
        }
    }
    if (node > 0) {
        double *l = s->chain.lower + block_of(s, node - 1);
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
    SEL_ASSERT(dof >= 0 && dof < s->chain.size, "an unknown of the first node holds it");
    int n = s->chain.size;
    double sum = -s->grip_b[dof];
    for (int c = 0; c < n; c++) {
        sum += s->grip_diag[n * dof + c] * s->u[c];
        if (s->chain.count > 1)
            sum += s->grip_lower[n * c + dof] * s->u[n + c];
    }
    return sum;
}

double stepper_wanted(const Stepper *s)
{
    // to where the command says, whatever has been lost to rounding before
    double coordinate = s->state.inserted + s->command.advance - s->wire.total_length;
    return coordinate - vec3_dot(vec3_sub(s->start_position[0], s->mouth), s->axis[0]);
}
