// A = L U, eliminated from both ends towards the middle node as in block_chain.c, which see.
//
//   left:  C = A(i+1, i), B = A(i, i+1);  right: C = A(i-1, i), B = A(i, i-1)
//   D_i = T V (T unit lower, V upper), Z = C V^-1, Y = T^-1 B, and the neighbour towards the middle loses Z Y.
// The right-hand side travels as a seventh column of B. Backward: x = V^-1 (T^-1 b - Y x'), x' of the neighbour towards the middle.
#include "solver/block_lu.h"

#include "solver/block_lanes.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

// Per node, all by columns of eight.
typedef struct Node {
    double t[6][COLUMN], v[6][COLUMN], z[6][COLUMN], y[7][COLUMN]; // of t the lanes below the diagonal count
    double inverse[COLUMN];
} Node;

struct BlockLu {
    int count;
    Node *node;
};

typedef struct End {
    Lanes d[6], c[6], y[7], n[7];
    Node *node;
} End;

BlockLu *block_lu_create(int count)
{
    BlockLu *lu = count < 1 ? NULL : calloc(1, sizeof *lu);
    if (!lu)
        return NULL;
    lu->count = count;
    lu->node = aligned_alloc(64, (size_t)count * sizeof *lu->node);
    if (!lu->node) {
        block_lu_destroy(lu);
        return NULL;
    }
    memset(lu->node, 0, (size_t)count * sizeof *lu->node);
    return lu;
}

void block_lu_destroy(BlockLu *lu)
{
    if (!lu)
        return;
    free(lu->node);
    free(lu);
}

INLINE void load_side(Lanes *v, const double *b, int i)
{
    b += 6 * (size_t)i;
    *v = (Lanes){b[0], b[1], b[2], b[3], b[4], b[5], 0, 0};
}

// Pivot k: row k of V and of Y is finished and kept entry by entry, so that lanes up to k need not be masked.
INLINE int pivot(End *e, int k)
{
    Node *o = e->node;
    double p = e->d[k][k], inverse = 1 / p;
    o->inverse[k] = inverse;
    Lanes t = e->d[k] * inverse, z = e->c[k] * inverse;
    *(Lanes *)o->t[k] = t;
    *(Lanes *)o->z[k] = z;
    UNROLL
    for (int j = k + 1; j < 6; j++) {
        double s = e->d[j][k];
        o->v[j][k] = s;
        e->d[j] -= t * s;
        e->c[j] -= z * s;
    }
    UNROLL
    for (int j = 0; j < 7; j++) {
        double s = e->y[j][k];
        o->y[j][k] = s;
        if (k < 5)
            e->y[j] -= t * s;
    }
    return p != 0 && fabs(p) <= DBL_MAX;
}

INLINE void advance(End *e)
{
    Node *o = e->node;
    UNROLL
    for (int j = 0; j < 7; j++) {
        Lanes sum = e->n[j];
        UNROLL
        for (int k = 0; k < 6; k++)
            sum -= *(const Lanes *)o->z[k] * o->y[j][k];
        e->n[j] = sum;
    }
    UNROLL
    for (int j = 0; j < 6; j++)
        e->d[j] = e->n[j];
}

CLONES static bool eliminate(BlockLu *f, const double *diag, const double *lower, const double *upper, const double *b)
{
    int count = f->count, m = count / 2, ok = 1;
    End left = {0}, right = {0};
    load_rows(left.d, diag);
    load_side(&left.n[6], b, 0);
    if (count > 2) {
        load_rows(right.d, diag + (size_t)(count - 1) * BLOCK);
        load_side(&right.n[6], b, count - 1);
    }
    for (int i = 0; i < m; i++) {
        int j = count - 1 - i;
        left.node = f->node + i;
        load_rows(left.c, lower + (size_t)i * BLOCK);
        load_rows(left.y, upper + (size_t)i * BLOCK);
        left.y[6] = left.n[6];
        load_rows(left.n, diag + (size_t)(i + 1) * BLOCK);
        load_side(&left.n[6], b, i + 1);
        if (j <= m) { // even count: the left end has one node more
            UNROLL
            for (int k = 0; k < 6; k++)
                ok &= pivot(&left, k);
            advance(&left);
            break;
        }
        right.node = f->node + j;
        load_rows(right.c, upper + (size_t)(j - 1) * BLOCK);
        load_rows(right.y, lower + (size_t)(j - 1) * BLOCK);
        right.y[6] = right.n[6];
        if (j - 1 > m) {
            load_rows(right.n, diag + (size_t)(j - 1) * BLOCK);
            load_side(&right.n[6], b, j - 1);
        } else { // the middle node's own block comes with the left end; this end brings its loss alone
            UNROLL
            for (int k = 0; k < 7; k++)
                right.n[k] = (Lanes){0};
        }
        UNROLL
        for (int k = 0; k < 6; k++)
            ok &= pivot(&left, k) & pivot(&right, k);
        advance(&left);
        advance(&right);
    }
    if (count > 2) {
        UNROLL
        for (int k = 0; k < 6; k++)
            left.d[k] += right.d[k];
        left.n[6] += right.n[6];
    }
    left.node = f->node + m;
    UNROLL
    for (int k = 0; k < 6; k++)
        left.c[k] = left.y[k] = (Lanes){0};
    left.y[6] = left.n[6];
    UNROLL
    for (int k = 0; k < 6; k++)
        ok &= pivot(&left, k);
    return ok;
}

INLINE void back(const Node *o, const double *next, double *x)
{
    Lanes r = *(const Lanes *)o->y[6];
    UNROLL
    for (int j = 0; j < 6; j++)
        r -= *(const Lanes *)o->y[j] * next[j];
    double q[COLUMN];
    UNROLL
    for (int k = 5; k >= 0; k--) {
        q[k] = r[k] * o->inverse[k];
        r -= *(const Lanes *)o->v[k] * q[k]; // lanes below k; the others are done
    }
    UNROLL
    for (int k = 0; k < 6; k++)
        x[k] = q[k];
}

static const double zeros[6];

CLONES static void back_all(const BlockLu *f, double *x)
{
    int count = f->count, m = count / 2;
    back(f->node + m, zeros, x + 6 * (size_t)m);
    for (int i = m - 1; i >= 0; i--) {
        int r = 2 * m - i;
        back(f->node + i, x + 6 * (size_t)(i + 1), x + 6 * (size_t)i);
        if (r < count)
            back(f->node + r, x + 6 * (size_t)(r - 1), x + 6 * (size_t)r);
    }
}

// y = T^-1 b, and what the neighbour loses: Z y.
INLINE void forward(Node *o, const double *side, Lanes *loss)
{
    Lanes b = (Lanes){side[0], side[1], side[2], side[3], side[4], side[5], 0, 0} - *loss, sum = {0};
    UNROLL
    for (int k = 0; k < 6; k++) {
        double s = b[k];
        o->y[6][k] = s;
        b -= *(const Lanes *)o->t[k] * s;
        sum += *(const Lanes *)o->z[k] * s;
    }
    *loss = sum;
}

CLONES static void forward_all(const BlockLu *f, const double *b)
{
    int count = f->count, m = count / 2;
    Lanes left = {0}, right = {0};
    for (int i = 0; i < m; i++) {
        int j = count - 1 - i;
        forward(f->node + i, b + 6 * (size_t)i, &left);
        if (j > m)
            forward(f->node + j, b + 6 * (size_t)j, &right);
    }
    left += right;
    forward(f->node + m, b + 6 * (size_t)m, &left);
}

bool block_lu_factor_solve(BlockLu *lu, const double *diag, const double *lower, const double *upper, const double *b, double *x)
{
    if (!eliminate(lu, diag, lower, upper, b))
        return false;
    back_all(lu, x);
    return true;
}

void block_lu_solve(const BlockLu *lu, const double *b, double *x)
{
    forward_all(lu, b);
    back_all(lu, x);
}

void block_lu_transpose(int count, const double *from, double *to)
{
    for (int i = 0; i < count; i++, from += BLOCK, to += BLOCK)
        for (int r = 0; r < 6; r++)
            for (int c = 0; c < 6; c++)
                to[6 * c + r] = from[6 * r + c];
}
