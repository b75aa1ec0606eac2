// The pointwise form: Gauss-Seidel sweeps over the contacts along the chain, forward and backward (Kerrien 2017, 6.3; Duriez 2006).
//
// W = J A^-1 J^T is never formed. At node i the chain to its left and to its right enters through two vectors of n unknowns:
//   u_i = S_i (p_i + q_i + r_i),  r_i = b_i + (J^T f)_i,  S_i = (A^-1)_ii
//   p_(i+1) = -E_i (p_i + r_i),     E_i = L_i D_i^-1,            D_i the pivots of an elimination from the left
//   q_(i-1) = -F_i (q_i + r_i),     F_i = L_(i-1)^T B_i^-1,      B_i those of one from the right,   S_i = (D_i + B_i - A_ii)^-1
// In a sweep from left to right p depends only on forces already updated and q only on forces not yet visited; the reverse holds in a sweep back.
// A sweep therefore costs one block product per node and one local problem per contact. A contact between nodes i and i+1 depends on both:
//   u_j = S_j (p_j + q_j + r_j),  u_i = D_i^-1 (p_i + r_i) - E_i^T u_j,  j = i+1
//
// The local problem has three unknowns and is solved exactly: open, stick, or slip with f_t = -(W_tt' + g)^-1 c, the scalar g > 0 such that
// |f_t| = mu f_n. At least one such g exists for any mu (the difference of both sides changes sign between 0 and infinity).
// A slide has two unknowns and a given bound: g is unique.
#include "solver/contact_forms.h"

#include <stdlib.h>
#include <string.h>

// Data of a contact for a sweep.
typedef struct Local {
    Vec3 axis[3];            // normal, two tangents
    Mat3 w;                  // its own 3x3 block of W on these axes
    double response[3][2 * BLOCK_LARGEST];  // motion of its one or two nodes per unit force along an axis
    double g;                // of its last slip: start of the next search
    Vec3 offset;             // rounding difference between the recursion and the solution by the factor
} Local;

struct PointwiseWork {
    int size;                // n
    double *left, *right;    // (M, n, n) E_i, F_i
    double *inverse, *pivot; // (M, n, n) S_i, D_i^-1
    double *p, *q, *r;       // (M, n)
    Local *local;            // (capacity)
};

PointwiseWork *pointwise_work_create(int node_count, int size, int capacity)
{
    SEL_ASSERT(node_count > 0 && block_size_is_known(size) && capacity >= 0, "there is a chain of a size that the solver knows");
    PointwiseWork *w = calloc(1, sizeof *w);
    if (!w)
        return NULL;
    size_t n = (size_t)size, m = (size_t)node_count;
    w->size = size;
    double **block[] = {&w->left, &w->right, &w->inverse, &w->pivot}, **vector[] = {&w->p, &w->q, &w->r};
    bool ok = true;
    for (int i = 0; i < 4; i++)
        ok &= (*block[i] = calloc(m * n * n, sizeof(double))) != NULL;
    for (int i = 0; i < 3; i++)
        ok &= (*vector[i] = calloc(m * n, sizeof(double))) != NULL;
    w->local = calloc((size_t)capacity + 1, sizeof *w->local);
    if (!ok || !w->local) {
        pointwise_work_destroy(w);
        return NULL;
    }
    return w;
}

void pointwise_work_destroy(PointwiseWork *w)
{
    if (!w)
        return;
    free(w->left);
    free(w->right);
    free(w->inverse);
    free(w->pivot);
    free(w->p);
    free(w->q);
    free(w->r);
    free(w->local);
    free(w);
}

// inverse = d^-1 of a symmetric positive definite block; returns false if it is not positive definite.
static bool invert(int n, const double *d, double *inverse)
{
    SEL_ASSERT(n <= BLOCK_LARGEST, "a block fits the arrays on the stack");
    double l[BLOCK_LARGEST][BLOCK_LARGEST], y[BLOCK_LARGEST][BLOCK_LARGEST];
    for (int j = 0; j < n; j++)
        for (int i = j; i < n; i++) {
            double sum = d[n * i + j];
            for (int k = 0; k < j; k++)
                sum -= l[i][k] * l[j][k];
            if (i == j && !(sum > 0))
                return false;
            l[i][j] = i == j ? sqrt(sum) : sum / l[j][j];
        }
    for (int c = 0; c < n; c++) // y = l^-1 by columns
        for (int i = c; i < n; i++) {
            double sum = i == c;
            for (int k = c; k < i; k++)
                sum -= l[i][k] * y[k][c];
            y[i][c] = sum / l[i][i];
        }
    for (int i = 0; i < n; i++)
        for (int j = 0; j <= i; j++) {
            double sum = 0;
            for (int k = i; k < n; k++)
                sum += y[k][i] * y[k][j];
            inverse[n * i + j] = inverse[n * j + i] = sum;
        }
    return true;
}

// y += s a x, or y += s a^T x
static void add_product(int n, const double *a, double s, const double *x, double *y)
{
    SEL_ASSERT(n >= 2 && n % 2 == 0, "a block has an even number of columns: they are added in pairs");
    for (int i = 0; i < n; i++) {
        const double *r = a + n * i;
        double sum = r[0] * x[0] + r[1] * x[1];
        for (int k = 2; k < n; k += 2)
            sum += r[k] * x[k] + r[k + 1] * x[k + 1];
        y[i] += s * sum;
    }
}

static void add_product_transposed(int n, const double *a, double s, const double *x, double *y)
{
    for (int j = 0; j < n; j++)
        for (int i = 0; i < n; i++)
            y[j] += s * a[n * i + j] * x[i];
}

// Eliminates from both ends to obtain E, F, S and D^-1.
static bool prepare(PointwiseWork *w, const BlockChain *a)
{
    SEL_ASSERT(a->count > 0 && a->size == w->size, "the work space was made for blocks of this size");
    const int m = a->count, n = w->size, block = n * n;
    const size_t bytes = (size_t)block * sizeof(double);
    double d[BLOCK_LARGEST * BLOCK_LARGEST], inverse[BLOCK_LARGEST * BLOCK_LARGEST];
    for (int i = 0; i < m; i++) { // d = A_ii - L_(i-1) D_(i-1)^-1 L_(i-1)^T
        memcpy(d, a->diag + (size_t)block * (size_t)i, bytes);
        for (int r = 0; i > 0 && r < n; r++)
            for (int c = 0; c < n; c++)
                for (int k = 0; k < n; k++)
                    d[n * r + c] -= w->left[block * (i - 1) + n * r + k] * a->lower[block * (i - 1) + n * c + k];
        memcpy(w->inverse + (size_t)block * (size_t)i, d, bytes);
        if (!invert(n, d, w->pivot + (size_t)block * (size_t)i))
            return false;
        for (int r = 0; i + 1 < m && r < n; r++)
            for (int c = 0; c < n; c++) {
                double sum = 0;
                for (int k = 0; k < n; k++)
                    sum += a->lower[block * i + n * r + k] * w->pivot[block * i + n * k + c];
                w->left[block * i + n * r + c] = sum;
            }
    }
    for (int i = m - 1; i >= 0; i--) { // d = A_ii - L_i^T B_(i+1)^-1 L_i
        memcpy(d, a->diag + (size_t)block * (size_t)i, bytes);
        for (int r = 0; i + 1 < m && r < n; r++)
            for (int c = 0; c < n; c++)
                for (int k = 0; k < n; k++)
                    d[n * r + c] -= w->right[block * (i + 1) + n * r + k] * a->lower[block * i + n * k + c];
        if (!invert(n, d, inverse))
            return false;
        for (int r = 0; i > 0 && r < n; r++)
            for (int c = 0; c < n; c++) {
                double sum = 0;
                for (int k = 0; k < n; k++)
                    sum += a->lower[block * (i - 1) + n * k + r] * inverse[n * k + c];
                w->right[block * i + n * r + c] = sum;
            }
        for (int k = 0; k < block; k++)
            d[k] += w->inverse[block * i + k] - a->diag[block * i + k];
        if (!invert(n, d, w->inverse + (size_t)block * (size_t)i))
            return false;
    }
    return true;
}

// Motion of a contact's nodes (2 n; for a contact at a node the second half is 0) under loads g on them.
static void respond(const PointwiseWork *w, const ContactRow *c, const double *g, double *v)
{
    SEL_ASSERT(!c->far, "pairs are solved separately");
    const int n = w->size;
    const size_t i = (size_t)c->node, block = (size_t)(n * n), bytes = (size_t)n * sizeof *v;
    memset(v, 0, 2 * bytes);
    if (c->nodes == 1) {
        add_product(n, w->inverse + block * i, 1, g, v);
        return;
    }
    double load[BLOCK_LARGEST];
    memcpy(load, g + n, bytes);
    add_product(n, w->left + block * i, -1, g, load);
    add_product(n, w->inverse + block * (i + 1), 1, load, v + n);
    add_product(n, w->pivot + block * i, 1, g, v);
    add_product_transposed(n, w->left + block * i, -1, v + n, v);
}

static void prepare_local(const PointwiseWork *w, const ContactRow *c, Local *l)
{
    SEL_ASSERT(fabs(vec3_norm2(c->normal) - 1) < 1e-6, "a contact's normal is a unit vector");
    l->g = 0;
    l->axis[0] = c->normal;
    l->axis[1] = c->slide ? vec3(1, 0, 0) : vec3_normal_to(c->normal);
    l->axis[2] = vec3_cross(c->normal, l->axis[1]);
    ContactRow here = *c;
    here.node = 0;
    for (int a = 0; a < 3; a++) {
        double g[2 * BLOCK_LARGEST] = {0};
        contact_row_push(&here, l->axis[a], g);
        respond(w, c, g, l->response[a]);
        Vec3 d = contact_row_motion(&here, l->response[a]);
        for (int k = 0; k < 3; k++)
            l->w.m[k][a] = vec3_dot(d, l->axis[k]);
    }
}

// f_t = -(a + g)^-1 c of the condensed tangential problem, f_n from the normal row.
static void slide_force(const Mat3 *w, const double *d, const double a[3], const double *c, double g, double *f)
{
    double xx = a[0] + g, yy = a[2] + g, det = xx * yy - a[1] * a[1];
    f[1] = -(yy * c[0] - a[1] * c[1]) / det;
    f[2] = -(xx * c[1] - a[1] * c[0]) / det;
    f[0] = -(d[0] + w->m[0][1] * f[1] + w->m[0][2] * f[2]) / w->m[0][0];
}

static double slide_excess(const double *f, double mu) { return sqrt(f[1] * f[1] + f[2] * f[2]) - mu * f[0]; }

// Signorini and Coulomb conditions of one contact with motion d + w f; d[0] includes the gap.
static void solve_local(const Mat3 *w, const double *d, double mu, double *start, double *f)
{
    SEL_ASSERT(w->m[0][0] > 0, "a contact that is not inert has a compliance along its normal");
    f[0] = f[1] = f[2] = 0;
    if (d[0] >= 0)
        return;
    f[0] = -d[0] / w->m[0][0];
    const double a[3] = {w->m[1][1] - w->m[1][0] * w->m[0][1] / w->m[0][0], w->m[1][2] - w->m[1][0] * w->m[0][2] / w->m[0][0],
                         w->m[2][2] - w->m[2][0] * w->m[0][2] / w->m[0][0]};
    const double c[2] = {d[1] - w->m[1][0] * d[0] / w->m[0][0], d[2] - w->m[2][0] * d[0] / w->m[0][0]};
    double scale = a[0] + a[2];
    if (!(mu > 0) || !(scale > 0))
        return;
    double low = 1e-13 * scale; // constrained tangential directions have no compliance: keeps the 2x2 matrix regular
    slide_force(w, d, a, c, low, f);
    double h_low = slide_excess(f, mu);
    if (h_low <= 0)
        return;
    double high = *start > 0 ? *start : scale * 1e-3, h_high = 1, grow = 1e-4;
    for (int k = 0; k < 80 && h_high > 0; k++) {
        if (k > 0) {
            low = high;
            h_low = h_high;
            high *= 1 + grow;
            grow = fmin(3, 8 * grow);
        }
        slide_force(w, d, a, c, high, f);
        h_high = slide_excess(f, mu);
        if (k == 0 && h_high < 0) { // the last g is beyond the root: try just below it first
            double near = high * (1 - 1e-4);
            slide_force(w, d, a, c, near, f);
            double h = slide_excess(f, mu);
            if (h > 0) {
                low = near;
                h_low = h;
            }
        }
    }
    for (int k = 0; k < 80 && high - low > 1e-14 * high; k++) { // false position, halving the value at an end that stays fixed (Illinois)
        double mid = (low * h_high - high * h_low) / (h_high - h_low);
        if (!(mid > low && mid < high))
            mid = (low + high) / 2;
        slide_force(w, d, a, c, mid, f);
        double h = slide_excess(f, mu);
        *start = mid;
        if (fabs(h) <= 4e-16 * fabs(mu * f[0]))
            break;
        if (h > 0) {
            low = mid;
            h_low = h;
            h_high /= 2;
        } else {
            high = mid;
            h_high = h;
            h_low /= 2;
        }
    }
    f[0] = fmax(0, f[0]);
    double size = sqrt(f[1] * f[1] + f[2] * f[2]);
    if (size > 0) {
        f[1] *= mu * f[0] / size;
        f[2] *= mu * f[0] / size;
    }
}

// One slide with motion d + w f. Newton's method on 1/|f|, which is concave in g, converges to the root from below, in one step where both directions
// have the same compliance. The elastic displacement of a slide is a spring in series.
static void solve_slide(const ContactRow *c, const Mat3 *own, const double *motion, double *f)
{
    SEL_ASSERT(c->bound > 0 && c->spring > 0, "a loaded slide has a positive bound and a positive stiffness");
    const double bound = c->bound, soft = 1 / c->spring;
    const double d[3] = {0, motion[1] - soft * c->held.x, motion[2] - soft * c->held.y};
    Mat3 spring = *own, *w = &spring;
    spring.m[1][1] += soft, spring.m[2][2] += soft;
    double scale = w->m[1][1] + w->m[2][2], g = 1e-13 * scale; // a constrained direction has no compliance: keeps the 2x2 matrix regular
    f[0] = f[1] = f[2] = 0;
    for (int k = 0; k < 50 && scale > 0; k++) {
        double xx = w->m[1][1] + g, xy = w->m[1][2], yy = w->m[2][2] + g, det = xx * yy - xy * xy;
        f[1] = -(yy * d[1] - xy * d[2]) / det;
        f[2] = -(xx * d[2] - xy * d[1]) / det;
        double size2 = f[1] * f[1] + f[2] * f[2], size = sqrt(size2), excess = size / bound - 1;
        if (!(excess > 1e-15))
            return;
        double fall = (yy * f[1] * f[1] - 2 * xy * f[1] * f[2] + xx * f[2] * f[2]) / det; // f (w + g)^-1 f
        g += size2 / fall * excess;
        f[1] *= bound / size;
        f[2] *= bound / size;
    }
}

// Motion of the one or two nodes of a place under all forces.
static void place_motion(const PointwiseWork *w, const ContactRow *first, double *v)
{
    const size_t i = (size_t)first->node, n = (size_t)w->size, block = n * n;
    const int size = w->size;
    double load[BLOCK_LARGEST], left[BLOCK_LARGEST];
    memset(v, 0, 2 * n * sizeof *v);
    for (size_t k = 0; k < n; k++) {
        left[k] = w->p[n * i + k] + w->r[n * i + k];
        load[k] = first->nodes == 1 ? left[k] + w->q[n * i + k] : w->q[n * i + n + k] + w->r[n * i + n + k];
    }
    if (first->nodes == 1) {
        add_product(size, w->inverse + block * i, 1, load, v);
        return;
    }
    add_product(size, w->left + block * i, -1, left, load);
    add_product(size, w->inverse + block * (i + 1), 1, load, v + n);
    add_product(size, w->pivot + block * i, 1, left, v);
    add_product_transposed(size, w->left + block * i, -1, v + n, v);
}

// Solves the contacts [from, to) at one place in turn; their nodes' motion is computed once and then updated.
static void visit(PointwiseWork *w, ContactRow *row, int from, int to, bool reverse)
{
    SEL_ASSERT(from >= 0 && from < to, "a place has at least one contact");
    double v[2 * BLOCK_LARGEST];
    place_motion(w, &row[from], v);
    for (int n = 0; n < to - from; n++) {
        int k = reverse ? to - 1 - n : from + n;
        ContactRow *c = &row[k];
        Local *l = &w->local[k];
        if (c->inert)
            continue;
        ContactRow here = *c;
        here.node = 0;
        Vec3 motion = vec3_add(contact_row_motion(&here, v), l->offset);
        double old[3], d[3], f[3];
        for (int a = 0; a < 3; a++)
            old[a] = vec3_dot(c->force, l->axis[a]);
        for (int a = 0; a < 3; a++)
            d[a] = vec3_dot(motion, l->axis[a]) - l->w.m[a][0] * old[0] - l->w.m[a][1] * old[1] - l->w.m[a][2] * old[2];
        d[0] += c->gap;
        if (c->slide)
            solve_slide(c, &l->w, d, f);
        else
            solve_local(&l->w, d, c->friction, &l->g, f);
        Vec3 force = vec3_add_scaled(vec3_add_scaled(vec3_scale(l->axis[0], f[0]), f[1], l->axis[1]), f[2], l->axis[2]);
        contact_row_push(c, vec3_sub(force, c->force), w->r);
        for (int a = 0; a < 3; a++)
            for (int e = 0; e < w->size * c->nodes; e++)
                v[e] += l->response[a][e] * (f[a] - old[a]);
        c->force = force;
    }
}

// End of the contacts at one place: at the same node, or between it and the next.
static int place_end(const ContactRow *row, int count, int from)
{
    int to = from + 1;
    while (to < count && row[to].node == row[from].node && row[to].nodes == row[from].nodes)
        to++;
    return to;
}

static void pass_forth(PointwiseWork *w, ContactRow *row, int count, int m)
{
    const int n = w->size;
    int k = 0;
    memset(w->p, 0, (size_t)n * sizeof *w->p);
    for (int i = 0; i < m; i++) {
        while (k < count && row[k].node == i) {
            int to = place_end(row, count, k);
            visit(w, row, k, to, false);
            k = to;
        }
        if (i + 1 == m)
            break;
        double sum[BLOCK_LARGEST], *next = w->p + n * (i + 1);
        for (int e = 0; e < n; e++) {
            sum[e] = w->p[n * i + e] + w->r[n * i + e];
            next[e] = 0;
        }
        add_product(n, w->left + (ptrdiff_t)(n * n) * i, -1, sum, next);
    }
}

static void pass_back(PointwiseWork *w, ContactRow *row, int count, int m)
{
    const int n = w->size;
    int k = count;
    memset(w->q + n * (m - 1), 0, (size_t)n * sizeof *w->q);
    for (int i = m - 1; i >= 0; i--) {
        bool moved = i + 1 == m;
        for (;;) {
            int from = k;
            while (from > 0 && row[from - 1].node == i && row[from - 1].nodes == row[k - 1].nodes)
                from--;
            bool node = from < k && row[from].nodes == 1;
            if ((from == k || node) && !moved) { // contacts between i and i+1 see q_(i+1); those at i need q_i
                double sum[BLOCK_LARGEST], *next = w->q + n * i;
                for (int e = 0; e < n; e++) {
                    sum[e] = w->q[n * (i + 1) + e] + w->r[n * (i + 1) + e];
                    next[e] = 0;
                }
                add_product(n, w->right + (ptrdiff_t)(n * n) * (i + 1), -1, sum, next);
                moved = true;
            }
            if (from == k)
                break;
            visit(w, row, from, k, true);
            k = from;
        }
    }
}

// Recomputes p and q for the present forces, and the rounding offset of the resulting motion.
static void refresh(ContactSolver *s, int count, int m)
{
    PointwiseWork *w = s->pointwise;
    double v[2 * BLOCK_LARGEST];
    memcpy(w->r, s->rhs, (size_t)(m * w->size) * sizeof *w->r);
    pass_forth(w, s->row, 0, m);
    pass_back(w, s->row, 0, m);
    for (int k = 0; k < count; k++) {
        ContactRow here = s->row[k];
        place_motion(w, &here, v);
        here.node = 0;
        w->local[k].offset = vec3_sub(s->motion[k], contact_row_motion(&here, v));
    }
}

static void solve_chain(const ContactSolver *s, const BlockFactor *factor, double *b, double *x)
{
    (void)s;
    block_factor_solve(factor, b, x);
}

// Solves the pairs in turn with the known W; only the motions of pairs are updated.
static void visit_pairs(ContactSolver *s, const int *pair, int count)
{
    for (int k = 0; k < count; k++) {
        ContactRow *c = &s->row[pair[k]];
        Local *l = &s->pointwise->local[pair[k]];
        if (c->inert)
            continue;
        double d[3], f[3];
        for (int a = 0; a < 3; a++)
            d[a] = vec3_dot(s->motion[pair[k]], l->axis[a]);
        for (int a = 0; a < 3; a++)
            for (int b = 0; b < 3; b++)
                d[a] -= l->w.m[a][b] * vec3_dot(c->force, l->axis[b]);
        d[0] += c->gap;
        solve_local(&l->w, d, c->friction, &l->g, f);
        Vec3 force = vec3_add_scaled(vec3_add_scaled(vec3_scale(l->axis[0], f[0]), f[1], l->axis[1]), f[2], l->axis[2]);
        Vec3 change = vec3_sub(force, c->force);
        for (int j = 0; j < count; j++) {
            Mat3 w = contact_pairs_block(s->pairs, j, k);
            s->motion[pair[j]] = vec3_add(s->motion[pair[j]], mat3_mul_vec(&w, change));
        }
        c->force = force;
    }
}

static int prepare_pairs(ContactSolver *s, const BlockFactor *factor, int count, int *pair)
{
    int pairs = 0;
    for (int i = s->banded; i < count; i++)
        pair[pairs++] = i;
    if (pairs > 0)
        contact_pairs_compliance(s, factor, solve_chain, pair, pairs);
    for (int k = 0; k < pairs; k++) {
        Local *l = &s->pointwise->local[pair[k]];
        l->g = 0;
        l->axis[0] = s->row[pair[k]].normal;
        l->axis[1] = vec3_normal_to(l->axis[0]);
        l->axis[2] = vec3_cross(l->axis[0], l->axis[1]);
        Mat3 w = contact_pairs_block(s->pairs, k, k);
        for (int a = 0; a < 3; a++)
            for (int b = 0; b < 3; b++)
                l->w.m[a][b] = vec3_dot(l->axis[a], mat3_mul_vec(&w, l->axis[b]));
    }
    return pairs;
}

ContactReport contact_pointwise(ContactSolver *s, const BlockChain *chain, const BlockFactor *factor, const double *b, int count, const ContactOptions *options,
                                double *u)
{
    ContactReport report = {0};
    PointwiseWork *w = s->pointwise;
    int m = s->matrix.count = chain->count;
    contact_balance(s, factor, b, count, u);
    contact_residual(s->row, count, s->motion, &report);
    report.converged = report.residual <= options->tolerance;
    if (report.converged || count == 0 || !prepare(w, chain))
        return report;
    int banded = s->banded, *pair = s->wall + s->wall_count, pairs = prepare_pairs(s, factor, count, pair);
    for (int k = 0; k < banded; k++)
        if (!s->row[k].inert)
            prepare_local(w, &s->row[k], &w->local[k]);
    refresh(s, banded, m);
    while (report.iterations < options->max_iterations && !report.converged) {
        if (report.iterations % 2 == 0)
            pass_forth(w, s->row, banded, m);
        else
            pass_back(w, s->row, banded, m);
        report.iterations++;
        if (pairs > 0) {         // pairs couple through the whole chain
            contact_balance(s, factor, b, count, u);
            for (int k = 0; k < 4; k++)
                visit_pairs(s, pair, pairs);
            contact_balance(s, factor, b, count, u);
            refresh(s, banded, m);
        }
        // the residual costs two sweeps: evaluate it rarely
        if (report.iterations % 16 && report.iterations < options->max_iterations)
            continue;
        contact_balance(s, factor, b, count, u);
        refresh(s, banded, m);
        contact_residual(s->row, count, s->motion, &report);
        report.converged = report.residual <= options->tolerance;
    }
    return report;
}
