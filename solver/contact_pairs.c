// Contacts of the tool with itself join places that are far apart on the chain and would fill its band. Their forces are therefore separate unknowns. With M
// the matrix of the chain with all other contacts, r its right-hand side, and a law f = g - C J du for each pair (contact_newton.c),
//   M du = r + sum_p J_p^T (f_p - f_p0),   W_pq = J_p M^-1 J_q^T,   f - f0 + C (J du_0 + W (f - f0)) = g - f0,   M du_0 = r
// where f0 are the forces already in r. W takes three solves of the chain per pair; the remaining three equations per pair are eliminated with row pivoting.
#include "solver/contact_forms.h"

#include "base/base.h"

#include <stdlib.h>
#include <string.h>

struct ContactPairs {
    int capacity;
    ContactRow *far;         // (capacity)
    int count, *list;        // (capacity) rows of the pairs in W
    int *pivot;              // (3 capacity)
    double *w;               // (3 capacity, 3 capacity), rows of 3 count
    double *matrix;          // (3 capacity, 3 capacity) 1 + C W, then its factors L and U
    double *scale;           // (3 capacity) scale factors of its rows
    double *force;           // (3 capacity)
    double *push, *response; // (M, n)
};

ContactPairs *contact_pairs_create(int node_count, int size, int capacity)
{
    SEL_ASSERT(node_count > 0 && size > 0 && capacity >= 0, "the chain has nodes and the capacity is not negative");
    ContactPairs *p = calloc(1, sizeof *p);
    if (!p)
        return NULL;
    size_t k = (size_t)capacity + 1, unknowns = (size_t)node_count * (size_t)size;
    p->capacity = capacity;
    p->far = calloc(k, sizeof *p->far);
    p->list = calloc(k, sizeof *p->list);
    p->pivot = calloc(3 * k, sizeof *p->pivot);
    p->w = calloc(9 * k * k, sizeof *p->w);
    p->matrix = calloc(9 * k * k, sizeof *p->matrix);
    p->scale = calloc(6 * k, sizeof *p->scale);
    p->push = calloc(2 * unknowns, sizeof *p->push);
    if (!p->far || !p->list || !p->pivot || !p->w || !p->matrix || !p->scale || !p->push) {
        contact_pairs_destroy(p);
        return NULL;
    }
    p->force = p->scale + 3 * k;
    p->response = p->push + unknowns;
    return p;
}

void contact_pairs_destroy(ContactPairs *p)
{
    if (!p)
        return;
    free(p->far);
    free(p->list);
    free(p->pivot);
    free(p->w);
    free(p->matrix);
    free(p->scale);
    free(p->push);
    free(p);
}

ContactRow *contact_pairs_far(ContactPairs *p) { return p ? p->far : NULL; }

static Vec3 axis_of(int k) { return vec3(k == 0, k == 1, k == 2); }

void contact_pairs_compliance(ContactSolver *s, const BlockFactor *factor, ContactSolve solve, const int *list, int count)
{
    ContactPairs *p = s->pairs;
    SEL_REQUIRE(p && count >= 0 && count <= p->capacity, "there is room for all pairs that press");
    const size_t n = 3 * (size_t)count, bytes = (size_t)(s->matrix.count * s->matrix.size) * sizeof(double);
    p->count = count;
    for (size_t k = 0; k < n; k++) {
        memset(p->push, 0, bytes);
        contact_row_push(&s->row[list[k / 3]], axis_of((int)(k % 3)), p->push);
        solve(s, factor, p->push, p->response);
        for (int l = 0; l < count; l++) {
            Vec3 d = contact_row_motion(&s->row[list[l]], p->response);
            double *w = p->w + 3 * (size_t)l * n + k;
            w[0] = d.x, w[n] = d.y, w[2 * n] = d.z;
        }
    }
}

Mat3 contact_pairs_block(const ContactPairs *p, int k, int l)
{
    SEL_ASSERT(k >= 0 && k < p->count && l >= 0 && l < p->count, "the pairs are of the list");
    Mat3 m;
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++)
            m.m[r][c] = p->w[(3 * k + r) * 3 * p->count + 3 * l + c];
    return m;
}

// Computes 1 + C W, each row scaled to a largest entry of 1.
static void fill_matrix(ContactSolver *s)
{
    ContactPairs *p = s->pairs;
    const int n = 3 * p->count;
    for (int row = 0; row < n; row++) {
        const double *c = s->law[p->list[row / 3]].c.m[row % 3];
        double *to = p->matrix + (size_t)n * (size_t)row, largest = 0;
        const double *w = p->w + (size_t)n * (size_t)(row / 3 * 3);
        for (int k = 0; k < n; k++) {
            to[k] = (k == row) + c[0] * w[k] + c[1] * w[n + k] + c[2] * w[2 * n + k];
            largest = fmax(largest, fabs(to[k]));
        }
        p->scale[row] = largest > 0 ? 1 / largest : 1;
        for (int k = 0; k < n; k++)
            to[k] *= p->scale[row];
    }
}

static bool eliminate(ContactPairs *p)
{
    const int n = 3 * p->count;
    SEL_ASSERT(p->count <= p->capacity, "there is room for all pairs that press");
    double *a = p->matrix;
    for (int k = 0; k < n; k++) {
        int best = k;
        for (int i = k + 1; i < n; i++)
            if (fabs(a[n * i + k]) > fabs(a[n * best + k]))
                best = i;
        p->pivot[k] = best;
        if (!(fabs(a[n * best + k]) > 0))
            return false;
        for (int j = 0; j < n && best != k; j++) {
            double other = a[n * k + j];
            a[n * k + j] = a[n * best + j];
            a[n * best + j] = other;
        }
        for (int i = k + 1; i < n; i++) {
            double l = a[n * i + k] /= a[n * k + k];
            for (int j = k + 1; l != 0 && j < n; j++)
                a[n * i + j] -= l * a[n * k + j];
        }
    }
    return true;
}

static void substitute(const ContactPairs *p, double *x)
{
    const int n = 3 * p->count;
    const double *a = p->matrix;
    for (int k = 0; k < n; k++) {
        double other = x[k];
        x[k] = x[p->pivot[k]];
        x[p->pivot[k]] = other;
    }
    for (int i = 1; i < n; i++)
        for (int k = 0; k < i; k++)
            x[i] -= a[n * i + k] * x[k];
    for (int i = n - 1; i >= 0; i--) {
        for (int k = i + 1; k < n; k++)
            x[i] -= a[n * i + k] * x[k];
        x[i] /= a[n * i + i];
    }
}

bool contact_pairs_step(ContactSolver *s, int count, bool reuse, bool whole, ContactSolve solve)
{
    ContactPairs *p = s->pairs;
    if (!reuse) {
        int active = 0;
        for (int i = s->banded; i < count; i++)
            if (s->law[i].state != 0) {
                SEL_REQUIRE(active < p->capacity, "there is room for all pairs that press");
                p->list[active++] = i;
            }
        contact_pairs_compliance(s, s->factor, solve, p->list, active);
        fill_matrix(s);
        if (!eliminate(p))
            return false;
    }
    if (p->count == 0)
        return true;
    for (int k = 0; k < p->count; k++) {
        int i = p->list[k];
        const ContactLaw *law = &s->law[i];
        SEL_ASSERT(s->row[i].far, "a pair has a second end");
        Vec3 r = vec3_sub(law->force, mat3_mul_vec(&law->c, contact_row_motion(&s->row[i], s->delta)));
        if (!whole)
            r = vec3_sub(r, s->row[i].force);
        double *to = p->force + 3 * k;
        const double *scale = p->scale + 3 * k;
        to[0] = scale[0] * r.x, to[1] = scale[1] * r.y, to[2] = scale[2] * r.z;
    }
    substitute(p, p->force);
    const size_t unknowns = (size_t)(s->matrix.count * s->matrix.size);
    memset(p->push, 0, unknowns * sizeof *p->push);
    for (int k = 0; k < p->count; k++) {
        const double *f = p->force + 3 * k;
        contact_row_push(&s->row[p->list[k]], vec3(f[0], f[1], f[2]), p->push);
    }
    solve(s, s->factor, p->push, p->response);
    for (size_t k = 0; k < unknowns; k++)
        s->delta[k] += p->response[k];
    return true;
}
