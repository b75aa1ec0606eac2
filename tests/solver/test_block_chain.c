// Block-tridiagonal systems compared with dense Cholesky: random chains of many sizes and condition numbers, and laws of the chain. Compiled for every block
// size N.
#include "base/simd.h"
#include "solver/block_chain.h"
#include "solver/block_condense.h"
#include "solver/block_lu.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include <cmocka.h>

#include "tests/short_run.h"

static SimdLevel level_given;
static bool exact;

static uint64_t seed_state = 12345;
static double uniform(void) // [-1, 1)
{
    seed_state ^= seed_state << 13;
    seed_state ^= seed_state >> 7;
    seed_state ^= seed_state << 17;
    return (double)(seed_state >> 11) * 0x1p-52 - 1;
}

// A = B B^T of a random lower block-bidiagonal B, well conditioned except that its columns are scaled over decades/2: cond(A) is about 10^decades.
static void random_chain(BlockChain *a, double decades)
{
    int m = a->count;
    double *low = calloc((size_t)m * N * N, sizeof *low), *off = calloc((size_t)m * N * N, sizeof *off);
    for (int i = 0; i < m; i++)
        for (int c = 0; c < N; c++) {
            double scale = pow(10, decades / 4 * uniform());
            for (int r = 0; r < N; r++) {
                low[N * N * i + N * r + c] = r > c ? 0.3 * scale * uniform() : r == c ? scale * (1 + 0.3 * uniform()) : 0;
                off[N * N * i + N * r + c] = scale * 0.15 * uniform();
            }
        }
    for (int i = 0; i < m; i++)
        for (int r = 0; r < N; r++)
            for (int c = 0; c < N; c++) {
                double d = 0, l = 0;
                for (int k = 0; k < N; k++) {
                    d += low[N * N * i + N * r + k] * low[N * N * i + N * c + k];
                    if (i > 0)
                        d += off[N * N * (i - 1) + N * r + k] * off[N * N * (i - 1) + N * c + k];
                    l += off[N * N * i + N * r + k] * low[N * N * i + N * c + k];
                }
                a->diag[N * N * i + N * r + c] = d;
                if (i + 1 < m)
                    a->lower[N * N * i + N * r + c] = l;
            }
    free(low);
    free(off);
}

static double *dense(const BlockChain *a)
{
    size_t n = (size_t)a->count * N;
    double *d = calloc(n * n, sizeof *d);
    for (size_t i = 0; i < (size_t)a->count; i++)
        for (size_t r = 0; r < N; r++)
            for (size_t c = 0; c < N; c++) {
                d[(N * i + r) * n + N * i + c] = a->diag[N * N * i + N * r + c];
                if (i + 1 < (size_t)a->count)
                    d[(N * i + N + r) * n + N * i + c] = d[(N * i + c) * n + N * i + N + r] = a->lower[N * N * i + N * r + c];
            }
    return d;
}

static bool dense_cholesky(double *d, size_t n)
{
    for (size_t j = 0; j < n; j++) {
        for (size_t k = 0; k < j; k++)
            d[j * n + j] -= d[j * n + k] * d[j * n + k];
        if (!(d[j * n + j] > 0))
            return false;
        d[j * n + j] = sqrt(d[j * n + j]);
        for (size_t i = j + 1; i < n; i++) {
            for (size_t k = 0; k < j; k++)
                d[i * n + j] -= d[i * n + k] * d[j * n + k];
            d[i * n + j] /= d[j * n + j];
        }
    }
    return true;
}

static void dense_solve(const double *l, size_t n, double *x)
{
    for (size_t i = 0; i < n; i++) {
        for (size_t k = 0; k < i; k++)
            x[i] -= l[i * n + k] * x[k];
        x[i] /= l[i * n + i];
    }
    for (size_t i = n; i-- > 0;) {
        for (size_t k = i + 1; k < n; k++)
            x[i] -= l[k * n + i] * x[k];
        x[i] /= l[i * n + i];
    }
}

static double largest(const double *x, size_t n)
{
    double top = 0;
    for (size_t i = 0; i < n; i++)
        top = fmax(top, fabs(x[i]));
    return top;
}

static double relative_residual(const BlockChain *a, const double *x, const double *b)
{
    size_t n = (size_t)a->count * N;
    double *r = malloc(n * sizeof *r), top = fmax(largest(a->diag, n * N), largest(a->lower, n * N - N * N));
    block_chain_multiply(a, x, r);
    for (size_t i = 0; i < n; i++)
        r[i] -= b[i];
    double value = largest(r, n) / (top * largest(x, n) + largest(b, n));
    free(r);
    return value;
}

static const int counts[] = {1, 2, 3, 4, 5, 6, 7, 10, 23, 40};

static void solves_as_dense(void **state)
{
    (void)state;
    for (size_t t = 0; t < sizeof counts / sizeof *counts; t++)
        for (int hard = 0; hard < 4; hard++) {
            int m = counts[t];
            size_t n = (size_t)m * N;
            BlockChain a;
            assert_true(block_chain_create(&a, m, N));
            BlockFactor *f = block_factor_create(m, N);
            random_chain(&a, 4.0 * hard); // condition 1, 1e4, 1e8, 1e12
            double *b = malloc(n * sizeof *b), *x = malloc(n * sizeof *x), *y = malloc(n * sizeof *y), *fused = malloc(n * sizeof *x);
            for (size_t i = 0; i < n; i++)
                y[i] = b[i] = uniform();
            assert_true(block_chain_factor(&a, f));
            block_factor_solve(f, b, x);
            assert_true(relative_residual(&a, x, b) < 1e-13);
            assert_true(block_chain_factor_solve(&a, f, b, fused));
            assert_true(relative_residual(&a, fused, b) < 1e-13);
            double *d = dense(&a);
            assert_true(dense_cholesky(d, n));
            dense_solve(d, n, y);
            // the forward error grows with the condition number: compare only if that is small
            for (size_t i = 0; hard == 0 && i < n; i++) {
                assert_true(fabs(x[i] - y[i]) < 1e-9 * largest(y, n));
                assert_true(fabs(fused[i] - y[i]) < 1e-9 * largest(y, n));
            }
            memcpy(fused, b, n * sizeof *b); // in place
            block_factor_solve(f, fused, fused);
            assert_memory_equal(fused, x, n * sizeof *x);
            free(d);
            free(b);
            free(x);
            free(y);
            free(fused);
            block_factor_destroy(f);
            block_chain_destroy(&a);
        }
}

// Unsymmetric blocks: a symmetric positive definite chain plus a skew part and different upper blocks, checked by the residual.
static void lu_solves_unsymmetric(void **state)
{
    (void)state;
    for (size_t t = 0; t < sizeof counts / sizeof *counts; t++) {
        int m = counts[t];
        size_t n = (size_t)m * N;
        BlockChain a;
        assert_true(block_chain_create(&a, m, N));
        BlockLu *lu = block_lu_create(m, N);
        random_chain(&a, 2);
        double *upper = calloc(n * N + 8, sizeof *upper), *diag = calloc(n * N + 8, sizeof *upper), *lower = calloc(n * N + 8, sizeof *upper);
        double *b = malloc(n * sizeof *b), *x = malloc(n * sizeof *x), *y = malloc(n * sizeof *y);
        memcpy(upper, a.lower, n * N * sizeof *upper);
        for (int i = 0; i < m; i++)
            for (int r = 0; r < N; r++)
                for (int c = 0; c < N; c++) {
                    double skew = c > r ? 0.05 * uniform() : 0;
                    a.diag[N * N * i + N * r + c] += skew;
                    a.diag[N * N * i + N * c + r] -= skew;
                    if (i + 1 < m)
                        upper[N * N * i + N * r + c] += 0.02 * uniform();
                }
        for (int round = 0; round < 2; round++) {
            for (size_t i = 0; i < n; i++)
                b[i] = uniform();
            if (round == 0) {
                block_lu_transpose(m, N, a.diag, diag);
                block_lu_transpose(m, N, a.lower, lower);
                assert_true(block_lu_factor_solve(lu, m, diag, lower, upper, b, x, NULL, &exact));
            }
            if (round == 1)
                block_lu_solve(lu, b, x);
            double worst = 0;
            for (int i = 0; i < m; i++)
                for (int r = 0; r < N; r++) {
                    double sum = -b[N * i + r];
                    for (int c = 0; c < N; c++) {
                        sum += a.diag[N * N * i + N * r + c] * x[N * i + c];
                        sum += i > 0 ? a.lower[N * N * (i - 1) + N * r + c] * x[N * (i - 1) + c] : 0;
                        sum += i + 1 < m ? upper[N * N * i + N * c + r] * x[N * (i + 1) + c] : 0;
                    }
                    worst = fmax(worst, fabs(sum));
                }
            assert_true(worst < 1e-13 * (1 + largest(a.diag, n * N) * largest(x, n)));
        }
        free(upper);
        free(diag);
        free(lower);
        free(b);
        free(x);
        free(y);
        block_lu_destroy(lu);
        block_chain_destroy(&a);
    }
}

static void refuses_indefinite(void **state)
{
    (void)state;
    for (size_t t = 0; t < sizeof counts / sizeof *counts; t++) {
        int m = counts[t];
        BlockChain a;
        assert_true(block_chain_create(&a, m, N));
        BlockFactor *f = block_factor_create(m, N);
        double *b = calloc((size_t)m * N, sizeof *b), *x = calloc((size_t)m * N, sizeof *b);
        for (int node = 0; node < m; node++) {
            random_chain(&a, 0);
            assert_true(block_chain_factor(&a, f));
            double keep = a.diag[N * N * node + 3 * (N + 1)];
            a.diag[N * N * node + 3 * (N + 1)] = -1e-3;
            assert_false(block_chain_factor(&a, f));
            assert_false(block_chain_factor_solve(&a, f, b, x));
            a.diag[N * N * node + 3 * (N + 1)] = NAN;
            assert_false(block_chain_factor(&a, f));
            a.diag[N * N * node + 3 * (N + 1)] = keep;
        }
        memset(a.diag, 0, (size_t)m * N * N * sizeof *b);
        assert_false(block_chain_factor(&a, f));
        free(b);
        free(x);
        block_factor_destroy(f);
        block_chain_destroy(&a);
    }
    BlockChain none;
    assert_false(block_chain_create(&none, 0, N));
    assert_null(block_factor_create(-1, N));
}

// The factorisation reads the lower half of a diagonal block, and unit rows stay exact: a constrained degree of freedom gets exactly its value.
static void unit_rows_are_exact(void **state)
{
    (void)state;
    for (int m = 1; m < 8; m++) {
        BlockChain a;
        assert_true(block_chain_create(&a, m, N));
        BlockFactor *f = block_factor_create(m, N);
        random_chain(&a, 2);
        int node = m / 2, dof = 4;
        for (int k = 0; k < N; k++) {
            a.diag[N * N * node + N * dof + k] = a.diag[N * N * node + N * k + dof] = k == dof;
            if (node > 0)
                a.lower[N * N * (node - 1) + N * dof + k] = 0;
            if (node + 1 < m)
                a.lower[N * N * node + N * k + dof] = 0;
        }
        double b[8 * N], x[8 * N];
        for (int i = 0; i < N * m; i++)
            b[i] = uniform();
        assert_true(block_chain_factor_solve(&a, f, b, x));
        assert_true(x[N * node + dof] == b[N * node + dof]);
        block_factor_solve(f, b, x);
        assert_true(x[N * node + dof] == b[N * node + dof]);
        block_factor_destroy(f);
        block_chain_destroy(&a);
    }
}

// All instruction sets give bit-identical results.
static void same_bits_everywhere(void **state)
{
    (void)state;
    for (int m = 1; m < 60; m += 7) {
        size_t n = (size_t)m * N;
        BlockChain a;
        assert_true(block_chain_create(&a, m, N));
        BlockFactor *f = block_factor_create(m, N);
        BlockLu *lu = block_lu_create(m, N);
        random_chain(&a, 8);
        double *x = calloc(9 * n, sizeof *x), *b = malloc(n * sizeof *b), *lower = calloc(n * N + 8, sizeof *b);
        block_lu_transpose(m, N, a.lower, lower);
        for (size_t i = 0; i < n; i++)
            b[i] = uniform();
        for (int level = 0; level < SIMD_COUNT; level++) {
            double *y = x + (size_t)level * 3 * n;
            simd_force((SimdLevel)level);
            assert_true(block_chain_factor_solve(&a, f, b, y));
            block_factor_solve(f, b, y + n);
            assert_true(block_lu_factor_solve(lu, a.count, a.diag, lower, a.lower, b, y + 2 * n, NULL, &exact));
        }
        simd_force(level_given);
        assert_memory_equal(x, x + 3 * n, 3 * n * sizeof *x);
        assert_memory_equal(x, x + 6 * n, 3 * n * sizeof *x);
        free(x);
        free(b);
        free(lower);
        block_lu_destroy(lu);
        block_factor_destroy(f);
        block_chain_destroy(&a);
    }
}

static void load_kept(BlockCondenser *k, int m, int offset, int every)
{
    for (int i = offset; i < m; i += every)
        block_condenser_side(k)[N * block_condenser_place(k, i) + 4] += 2;
}

// Another right-hand side and then the first one again, without condensing again: x is bit-identical.
static void turns_to_the_same(BlockCondenser *k, const BlockFactor *f, const BlockChain *a, const double *b, int offset, int every, const double *x)
{
    size_t n = (size_t)a->count * N;
    double *y = malloc(3 * n * sizeof *y);
    for (size_t i = 0; i < n; i++)
        y[2 * n + i] = 1 - b[i];
    for (int turn = 0; turn < 2; turn++) {
        block_condenser_turn_to(k, turn ? b : y + 2 * n);
        load_kept(k, a->count, offset, every);
        block_factor_solve(f, block_condenser_side(k), y);
        block_condenser_expand(k, y, y + n);
    }
    for (size_t i = 0; i < n; i++)
        assert_true(fabs(y[n + i] - x[i]) <= 1e-13 * largest(x, n));
    free(y);
}

// A chain condensed to a few, many or all nodes, changed there (matrix and load) and expanded again gives the solution of the changed chain, bit-identical at
// every SIMD level.
static void condensed_solves_as_whole(void **state)
{
    (void)state;
    const int sizes[] = {1, 2, 3, 7, 40, 121};
    for (size_t t = 0; t < sizeof sizes / sizeof *sizes; t++)
        for (int every = 1; every < 50; every += every < 4 ? 1 : 11)
            for (int offset = 0; offset < WHOLE_OR_SHORT(3, 1); offset++) {
                int m = sizes[t];
                size_t n = (size_t)m * N;
                BlockChain a;
                assert_true(block_chain_create(&a, m, N));
                BlockFactor *f = block_factor_create(m, N);
                BlockCondenser *k = block_condenser_create(m, N);
                random_chain(&a, 2);
                double *b = malloc(n * sizeof *b), *x = malloc(n * sizeof *x), *y = malloc(3 * n * sizeof *y), *small = malloc(n * sizeof *small);
                for (size_t i = 0; i < n; i++)
                    b[i] = uniform();
                for (int level = 0; level < SIMD_COUNT; level++) {
                    simd_force((SimdLevel)level);
                    bool *keep = block_condenser_keep(k);
                    for (int i = 0; i < m; i++)
                        assert_false(keep[i]);
                    for (int i = offset; i < m; i += every)
                        keep[i] = true;
                    block_condenser_survey(k, &a);
                    const BlockChain *s = block_condense(k, &a, b);
                    assert_non_null(s);
                    for (int i = offset; i < m; i += every) {
                        int p = block_condenser_place(k, i);
                        assert_true(p >= 0);
                        s->diag[N * N * p] += 3;
                        s->diag[N * N * p + 3 * (N + 1)] += 100;
                    }
                    load_kept(k, m, offset, every);
                    assert_true(block_chain_factor_solve(s, f, block_condenser_side(k), small));
                    block_condenser_expand(k, small, y + (size_t)level % 3 * n);
                    if (level > 0)
                        assert_memory_equal(y, y + (size_t)level % 3 * n, n * sizeof *y);
                    turns_to_the_same(k, f, &a, b, offset, every, y);
                }
                simd_force(level_given);
                for (int i = offset; i < m; i += every) {
                    a.diag[N * N * i] += 3;
                    a.diag[N * N * i + 3 * (N + 1)] += 100;
                    b[N * i + 4] += 2;
                }
                assert_true(block_chain_factor_solve(&a, f, b, x));
                for (size_t i = 0; i < n; i++)
                    assert_true(fabs(x[i] - y[i]) < 1e-11 * largest(x, n));
                free(b);
                free(x);
                free(y);
                free(small);
                block_condenser_destroy(k);
                block_factor_destroy(f);
                block_chain_destroy(&a);
            }
}

// Unit rows for unknown r of a node.
static void leave_out(BlockChain *a, int node, int r)
{
    for (int c = 0; c < N; c++) {
        double *d = a->diag + N * N * node;
        d[N * r + c] = d[N * c + r] = r == c;
        if (node > 0)
            a->lower[N * N * (node - 1) + N * r + c] = 0;
        if (node + 1 < a->count)
            a->lower[N * N * node + N * c + r] = 0;
    }
}

// Unknowns as in chains of coaxial tools: in the sheath only some unknowns of a node are coupled to others; further on there are fewer and fewer tools.
static void condensed_with_unknowns_left_out(void **state)
{
    (void)state;
    enum { M = 61 };
    static const int straight[] = {1, 2, 4, 5};
    BlockChain a;
    assert_true(block_chain_create(&a, M, N));
    BlockFactor *f = block_factor_create(M, N);
    BlockCondenser *k = block_condenser_create(M, N);
    static double b[M * N], x[M * N], small[M * N], y[SIMD_COUNT][M * N];
    for (int trial = 0; trial < WHOLE_OR_SHORT(60, 18); trial++) {
        random_chain(&a, 2);
        int parts = 1 + (N - 6) / 2;
        for (int i = 0; i < M; i++) {
            for (int q = 0; i < M / 5 && q < 4; q++)
                leave_out(&a, i, straight[q]);
            for (int r = 6; r < N; r++)      // every third time the tools end in the opposite order
                if (trial % 3 ? r < 6 + i * parts / M * 2 : r >= N - i * parts / M * 2)
                    leave_out(&a, i, r);
        }
        for (int i = 0; i < M * N; i++)
            b[i] = uniform();
        for (int run = 0; run < 2 * SIMD_COUNT; run++) {
            int level = run / 2;
            simd_force((SimdLevel)level);
            a.slim = N == 6 && run % 2 ? M / 5 - 1 : 0;      // the same bits
            for (int i = trial % 7; i < M; i += 1 + trial % 9)
                block_condenser_keep(k)[i] = true;
            block_condenser_survey(k, &a);
            const BlockChain *s = block_condense(k, &a, trial % 2 ? x : b);
            assert_non_null(s);
            if (trial % 2)
                block_condenser_turn_to(k, b);
            for (int p = 0; p < s->count; p++)
                for (int r = block_condenser_live(k)[p]; r < N; r++)
                    for (int c = 0; c < N; c++)
                        assert_true(s->diag[N * N * p + N * r + c] == (r == c) && (p == 0 || s->lower[N * N * (p - 1) + N * r + c] == 0));
            assert_true(block_chain_factor_solve(s, f, block_condenser_side(k), small));
            block_condenser_expand(k, small, y[level]);
            assert_memory_equal(y[0], y[level], sizeof y[0]);
        }
        a.slim = 0;
        simd_force(level_given);
        assert_true(block_chain_factor_solve(&a, f, b, x));
        for (int i = 0; i < M * N; i++)
            assert_true(fabs(x[i] - y[0][i]) < 1e-11 * largest(x, M * N));
    }
    block_condenser_destroy(k);
    block_factor_destroy(f);
    block_chain_destroy(&a);
}

// Unit rows after a node's live rows, whose number is passed to the factorisation: the solution is the same.
static void unsymmetric_with_unknowns_left_out(void **state)
{
    (void)state;
    enum { M = 23 };
    BlockChain a;
    assert_true(block_chain_create(&a, M, N));
    BlockLu *lu = block_lu_create(M, N);
    double *diag = calloc(block_doubles(M, N), sizeof *diag), *lower = calloc(block_doubles(M, N), sizeof *lower);
    static double b[M * N], x[M * N], z[M * N], y[SIMD_COUNT][M * N];
    for (int trial = 0; trial < 40; trial++) {
        int m = 1 + trial % M;
        unsigned char live[M];
        random_chain(&a, 2);
        for (int i = 0; i < M; i++) {
            live[i] = (unsigned char)(trial % 2 ? 6 + 2 * (i * (N - 4) / 2 / M) : N - 2 * ((i + trial) % ((N - 4) / 2)));
            for (int r = live[i]; r < N; r++)
                leave_out(&a, i, r);
        }
        block_lu_transpose(M - 1, N, a.lower, lower);
        memcpy(diag, a.diag, (size_t)(M * N * N) * sizeof *diag);
        for (int i = 0; i < M; i++)
            for (int c = 0; c < live[i]; c++)    // not symmetric, and still well conditioned
                diag[N * N * i + N * c] += 0.1 * uniform();
        for (int i = 0; i < M * N; i++)
            b[i] = uniform();
        assert_true(block_lu_factor_solve(lu, m, diag, lower, a.lower, b, x, NULL, &exact));
        for (int level = 0; level < SIMD_COUNT; level++) {
            simd_force((SimdLevel)level);
            assert_true(block_lu_factor_solve(lu, m, diag, lower, a.lower, b, y[level], live, &exact));
            assert_memory_equal(y[0], y[level], (size_t)(m * N) * sizeof y[0][0]);
            block_lu_solve(lu, b, z);
            for (int i = 0; i < m * N; i++)
                assert_true(fabs(x[i] - y[level][i]) < 1e-12 * largest(x, (size_t)(m * N)) && fabs(x[i] - z[i]) < 1e-12 * largest(x, (size_t)(m * N)));
        }
        simd_force(level_given);
    }
    free(diag);
    free(lower);
    block_lu_destroy(lu);
    block_chain_destroy(&a);
}

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return (double)t.tv_sec * 1e6 + (double)t.tv_nsec * 1e-3;
}

static int by_value(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

// The same right-hand side of a mirrored chain (signs of some degrees of freedom flipped everywhere) gives the mirrored solution to the bit.
static void mirrored_signs_to_the_bit(void **state)
{
    (void)state;
    enum { M = 9 };
    const double sign[BLOCK_LARGEST] = {1, -1, 1, -1, 1, -1, 1, -1, 1, -1, 1, -1}; // mirror in xz: y of a vector, x and z of a rotation
    BlockChain a, mirrored;
    assert_true(block_chain_create(&a, M, N) && block_chain_create(&mirrored, M, N));
    BlockFactor *f = block_factor_create(M, N);
    random_chain(&a, 6);
    double b[N * M], x[N * M], c[N * M], y[N * M];
    for (int i = 0; i < N * M; i++) {
        b[i] = uniform();
        c[i] = sign[i % N] * b[i];
    }
    for (int i = 0; i < N * N * M; i++) {
        mirrored.diag[i] = sign[i / N % N] * sign[i % N] * a.diag[i];
        if (i < N * N * (M - 1))
            mirrored.lower[i] = sign[i / N % N] * sign[i % N] * a.lower[i];
    }
    assert_true(block_chain_factor_solve(&a, f, b, x));
    assert_true(block_chain_factor_solve(&mirrored, f, c, y));
    for (int i = 0; i < N * M; i++)
        assert_true(y[i] == sign[i % N] * x[i]);
    block_factor_destroy(f);
    block_chain_destroy(&a);
    block_chain_destroy(&mirrored);
}

static void prints_timings(void **state)
{
    (void)state;
    NEED_WHOLE_RUNS();
    const int sizes[] = {51, 101, 201, 401, 801, 201, 201};
    for (size_t t = 0; t < sizeof sizes / sizeof *sizes; t++) {
        int m = sizes[t];
        simd_force(t < 5 ? level_given : t == 5 ? SIMD_AVX2 : SIMD_SSE2);
        print_message("%-8s ", simd_name[simd_level()]);
        enum { RUNS = 300 };
        BlockChain a;
        assert_true(block_chain_create(&a, m, N));
        BlockFactor *f = block_factor_create(m, N);
        random_chain(&a, 4);
        double *b = malloc((size_t)m * N * sizeof *b), *x = malloc((size_t)m * N * sizeof *b);
        for (int i = 0; i < N * m; i++)
            b[i] = uniform();
        BlockLu *lu = block_lu_create(m, N);
        double *lower = calloc((size_t)m * N * N + 8, sizeof *lower);
        block_lu_transpose(m, N, a.lower, lower);
        BlockCondenser *condenser = block_condenser_create(m, N);
        static double condense[RUNS], factor[RUNS], solve[RUNS], fused[RUNS], unsymmetric[RUNS];
        for (int i = 0; i < RUNS; i++) {
            double t0 = now();
            assert_true(block_chain_factor(&a, f));
            double t1 = now();
            block_factor_solve(f, b, x);
            double t2 = now();
            assert_true(block_chain_factor_solve(&a, f, b, x));
            double t3 = now();
            assert_true(block_lu_factor_solve(lu, a.count, a.diag, lower, a.lower, b, x, NULL, &exact));
            unsymmetric[i] = now() - t3;
            for (int j = 5; j < m; j += 10)
                block_condenser_keep(condenser)[j] = true;
            block_condenser_survey(condenser, &a);
            double t5 = now();
            assert_non_null(block_condense(condenser, &a, b));
            condense[i] = now() - t5;
            factor[i] = t1 - t0, solve[i] = t2 - t1, fused[i] = t3 - t2;
        }
        qsort(factor, RUNS, sizeof *factor, by_value);
        qsort(solve, RUNS, sizeof *solve, by_value);
        qsort(fused, RUNS, sizeof *fused, by_value);
        qsort(condense, RUNS, sizeof *condense, by_value);
        qsort(unsymmetric, RUNS, sizeof *unsymmetric, by_value);
        print_message("%4d blocks: factor %6.2f us, solve %6.2f us, factor and solve fused %6.2f us, unsymmetric %6.2f us, condense to a tenth %6.2f us "
                      "(medians)\n",
                      m, factor[RUNS / 2], solve[RUNS / 2], fused[RUNS / 2], unsymmetric[RUNS / 2], condense[RUNS / 2]);
        block_condenser_destroy(condenser);
        block_lu_destroy(lu);
        free(lower);
        free(b);
        free(x);
        block_factor_destroy(f);
        block_chain_destroy(&a);
    }
    simd_force(level_given);
}

int main(void)
{
    level_given = simd_level();
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(solves_as_dense),
        cmocka_unit_test(refuses_indefinite),
        cmocka_unit_test(lu_solves_unsymmetric),
        cmocka_unit_test(unit_rows_are_exact),
        cmocka_unit_test(mirrored_signs_to_the_bit),
        cmocka_unit_test(same_bits_everywhere),
        cmocka_unit_test(condensed_solves_as_whole),
        cmocka_unit_test(condensed_with_unknowns_left_out),
        cmocka_unit_test(unsymmetric_with_unknowns_left_out),
        cmocka_unit_test(prints_timings),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
