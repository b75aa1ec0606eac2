// The fused single-precision loops against a plain double-precision reference written from eq. (3) to (7), and the derivatives against central differences of
// the reference. Tolerances: sums of some hundred terms in single precision, 1e-5 of the energy; derivatives 1e-4 of the largest.
#include "recon/fit/lim_energy.h"

#include "base/simd.h"
#include "geom/blobby.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <stdlib.h>
#include <string.h>

#include "tests/geom/mean_curvature.h"

enum { BLOBS = 5, POINTS = 137 };

static const double ISO_LEVEL = 0.1;

typedef struct Case {
    LimPoints points;
    LimBlob blob[BLOBS];
} Case;

static double next_uniform(uint64_t *state)
{
    *state = *state * 6364136223846793005u + 1442695040888963407u;
    return (double)(*state >> 11) / 9007199254740992.0;
}

// Blobs along a bent line, points about 1 mm around it, guards inside and outside.
static void make_case(Case *c, uint64_t seed)
{
    assert_true(lim_points_create(&c->points, POINTS));
    for (int j = 0; j < BLOBS; j++)
        c->blob[j] = (LimBlob){{-1.6 + 0.8 * j, 0.1 * j * j - 0.3, 0.2 * next_uniform(&seed)}, 0.35 + 0.1 * next_uniform(&seed)};
    for (int i = 0; i < POINTS; i++) {
        double angle = 2 * PI * next_uniform(&seed), radius = 0.8 + 0.5 * next_uniform(&seed);
        c->points.x[i] = (float)(-2 + 4 * next_uniform(&seed));
        c->points.y[i] = (float)(radius * cos(angle));
        c->points.z[i] = (float)(radius * sin(angle));
        c->points.weight[i] = (float)((0.5 + next_uniform(&seed)) / POINTS);
        c->points.bend[i] = i % 10 < 8 ? 1.0f / POINTS : 0;
        if (i % 10 == 8)
            c->points.low[i] = 0.05f, c->points.high[i] = 1e30f;
        if (i % 10 == 9)
            c->points.low[i] = -1e30f, c->points.high[i] = -0.02f;
    }
}

// The sums without a blob: -T.
static void lim_points_reset(LimPoints *points, double iso_level)
{
    size_t bytes = (size_t)points->padded * sizeof(float);
    for (int i = 0; i < points->padded; i++)
        points->f[i] = (float)-iso_level;
    for (int k = 0; k < 3; k++)
        memset(points->g[k], 0, bytes);
    for (int k = 0; k < 6; k++)
        memset(points->h[k], 0, bytes);
}

static void sums_without(Case *c, int moving)
{
    lim_points_reset(&c->points, ISO_LEVEL);
    for (int j = 0; j < BLOBS; j++)
        if (j != moving)
            lim_points_add(&c->points, &c->blob[j], 1);
}

// The reference.
static void plain_energy(const Case *c, double *distance, double *bend)
{
    Vec3 center[BLOBS];
    double width[BLOBS];
    for (int j = 0; j < BLOBS; j++) {
        center[j] = vec3(c->blob[j].center[0], c->blob[j].center[1], c->blob[j].center[2]);
        width[j] = c->blob[j].width;
    }
    Blobby model = {.count = BLOBS, .center = center, .width = width, .iso_level = ISO_LEVEL};
    *distance = *bend = 0;
    for (int i = 0; i < POINTS; i++) {
        Vec3 g;
        Sym3 h;
        double f = blobby_hessian(&model, vec3((double)c->points.x[i], (double)c->points.y[i], (double)c->points.z[i]), &g, &h);
        double kappa = mean_curvature(g, &h), e = f - fmin(fmax(f, (double)c->points.low[i]), (double)c->points.high[i]);
        *distance += (double)c->points.weight[i] * e * e;
        *bend += (double)c->points.bend[i] * kappa * kappa;
    }
}

static double *parameter(LimBlob *blob, int k) { return k < 3 ? &blob->center[k] : &blob->width; }

static void the_fused_loop_equals_the_plain_one(void **state)
{
    (void)state;
    for (uint64_t seed = 1; seed <= 5; seed++) {
        Case c;
        make_case(&c, seed);
        double distance, bend, whole_distance, whole_bend;
        plain_energy(&c, &distance, &bend);
        for (int j = 0; j < BLOBS; j++) {
            sums_without(&c, j);
            LimEnergy energy = lim_energy(&c.points, &c.blob[j]);
            assert_true(fabs(energy.distance - distance) < 1e-5 * distance);
            assert_true(fabs(energy.bend - bend) < 1e-4 * bend);
        }
        sums_without(&c, -1);
        lim_energy_total(&c.points, &whole_distance, &whole_bend);
        assert_true(fabs(whole_distance - distance) < 1e-5 * distance);
        assert_true(fabs(whole_bend - bend) < 1e-4 * bend);
        // a single pass over all blobs gives the same bits
        float f = c.points.f[33], h = c.points.h[4][120];
        lim_points_sum(&c.points, c.blob, BLOBS, ISO_LEVEL);
        assert_true(f == c.points.f[33] && h == c.points.h[4][120]);
        lim_points_free(&c.points);
    }
}

// Derivatives against central differences of the reference.
static void slopes_equal_differences(void **state)
{
    (void)state;
    for (uint64_t seed = 1; seed <= 5; seed++) {
        Case c;
        make_case(&c, seed);
        for (int j = 0; j < BLOBS; j++) {
            sums_without(&c, j);
            LimEnergy energy = lim_energy(&c.points, &c.blob[j]);
            double numeric[2][4], scale[2] = {0};
            for (int k = 0; k < 4; k++) {
                double *p = parameter(&c.blob[j], k), kept = *p, step = 1e-5, up[2], down[2];
                *p = kept + step;
                plain_energy(&c, &up[0], &up[1]);
                *p = kept - step;
                plain_energy(&c, &down[0], &down[1]);
                *p = kept;
                for (int e = 0; e < 2; e++) {
                    numeric[e][k] = (up[e] - down[e]) / (2 * step);
                    scale[e] = fmax(scale[e], fabs(numeric[e][k]));
                }
            }
            for (int k = 0; k < 4; k++) {
                assert_true(fabs(energy.distance_slope[k] - numeric[0][k]) < 1e-4 * scale[0]);
                assert_true(fabs(energy.bend_slope[k] - numeric[1][k]) < 1e-3 * scale[1]);
            }
        }
        lim_points_free(&c.points);
    }
}

// Columns are the derivatives of the residuals, including those of E_a.
static void columns_equal_differences(void **state)
{
    (void)state;
    const double beta = 0.01;
    Case c;
    make_case(&c, 9);
    int n = c.points.padded, both = 2 * n;
    float *column = calloc((size_t)(4 * both), sizeof *column), *up = calloc((size_t)both, sizeof *up), *down = calloc((size_t)both, sizeof *down);
    sums_without(&c, -1);
    lim_energy_columns(&c.points, &c.blob[2], beta, column);
    for (int k = 0; k < 4; k++) {
        double *p = parameter(&c.blob[2], k), kept = *p, step = 2e-3;
        *p = kept + step;
        sums_without(&c, -1);
        lim_energy_residuals(&c.points, beta, up);
        *p = kept - step;
        sums_without(&c, -1);
        lim_energy_residuals(&c.points, beta, down);
        *p = kept;
        double bend_scale = 0, bend_error = 0;
        for (int i = 0; i < POINTS; i++) {
            double bend = ((double)up[n + i] - (double)down[n + i]) / (2 * step);
            bend_scale = fmax(bend_scale, fabs(bend));
            bend_error = fmax(bend_error, fabs(bend - (double)column[k * both + n + i]));
            if ((up[i] == 0) != (down[i] == 0))   // a guard's bound lies between the two values
                continue;
            double numeric = ((double)up[i] - (double)down[i]) / (2 * step);
            assert_true(fabs(numeric - (double)column[k * both + i]) < 3e-4);
        }
        assert_true(bend_scale > 0 && bend_error < 2e-3 * bend_scale);
    }
    double dot = 0, gram[4][8];
    for (int i = 0; i < both; i++)
        dot += (double)column[i] * (double)column[both + i];
    lim_energy_gram(column, column, (size_t)both, both, gram[0], 8);
    assert_true(fabs(lim_energy_dot(column, column + both, both) - dot) < 1e-5 * (fabs(dot) + 1e-3));
    for (int k = 0; k < 16; k++)
        assert_true(gram[k / 4][k % 4] == lim_energy_dot(column + k / 4 * both, column + k % 4 * both, both));
    // without E_a only the columns of E_d are computed, with the same bits
    float *alone = calloc((size_t)(4 * n), sizeof *alone);
    sums_without(&c, -1);
    lim_energy_columns(&c.points, &c.blob[2], 0, alone);
    for (int k = 0; k < 4; k++)
        assert_memory_equal(alone + k * n, column + k * both, (size_t)n * sizeof *alone);
    free(alone);
    free(column);
    free(up);
    free(down);
    lim_points_free(&c.points);
}

// Steps towards the foot end on the surface, and the line back to the point is along the normal.
static void feet_are_on_the_surface(void **state)
{
    (void)state;
    Case c;
    make_case(&c, 6);
    double radius = 1, width = blob_width_for_radius(radius, ISO_LEVEL);
    LimBlob ball = {{0.1, -0.2, 0.05}, width};
    for (int i = 0; i < POINTS; i++)
        c.points.given[0][i] = c.points.x[i], c.points.given[1][i] = c.points.y[i], c.points.given[2][i] = c.points.z[i];
    for (int step = 0; step < 12; step++) {
        lim_points_sum(&c.points, &ball, 1, ISO_LEVEL);
        lim_points_approach(&c.points, 0.4, 0.7);
    }
    float *offset = calloc(2 * (size_t)c.points.padded, sizeof *offset), *slope = offset + c.points.padded;
    lim_points_sum(&c.points, &ball, 1, ISO_LEVEL);
    lim_points_feet(&c.points, radius, offset, slope);
    for (int i = 0; i < POINTS; i++) {
        Vec3 center = vec3(0.1, -0.2, 0.05), p = vec3((double)c.points.given[0][i], (double)c.points.given[1][i], (double)c.points.given[2][i]);
        Vec3 foot = vec3_add_scaled(center, radius, vec3_unit(vec3_sub(p, center)));
        assert_true(vec3_distance(foot, vec3((double)c.points.x[i], (double)c.points.y[i], (double)c.points.z[i])) < 1e-4);
        double inside = radius - vec3_distance(p, center);
        if (fabs(inside) > 0.59)   // too far: no foot
            continue;
        assert_true(fabs((double)offset[i] - inside) < 1e-4 && slope[i] > 0);
        assert_true(fabsf(c.points.low[i] + offset[i] * slope[i]) < 1e-6f && c.points.high[i] == c.points.low[i]);
    }
    c.points.given[0][3] += 2;
    lim_points_feet(&c.points, radius, offset, slope);
    assert_true(slope[3] == -1 && offset[3] == 0 && c.points.low[3] == 0);
    free(offset);
    lim_points_free(&c.points);
}

// A system of 20 unknowns: the product of its matrix with the solution must give the right-hand side.
static void solve_one(double solution[20])
{
    enum { SIZE = 20, STRIDE = 23 };
    double matrix[SIZE][SIZE], factor[SIZE * STRIDE], side[SIZE], wide[SIZE][SIZE];
    uint64_t state = 5;
    for (int i = 0; i < SIZE; i++) {
        side[i] = solution[i] = next_uniform(&state) - 0.5;
        for (int k = 0; k < SIZE; k++)
            wide[i][k] = next_uniform(&state) - 0.5;
    }
    for (int i = 0; i < SIZE; i++)
        for (int k = 0; k < SIZE; k++) {
            matrix[i][k] = i == k ? 0.1 : 0;
            for (int m = 0; m < SIZE; m++)
                matrix[i][k] += wide[i][m] * wide[k][m];
            factor[i * STRIDE + k] = k < i ? NAN : matrix[i][k];   // the lower triangle is not read
        }
    assert_true(lim_solve(factor, SIZE, STRIDE, solution));
    for (int i = 0; i < SIZE; i++) {
        double sum = 0;
        for (int k = 0; k < SIZE; k++)
            sum += matrix[i][k] * solution[k];
        assert_true(fabs(sum - side[i]) < 1e-12);
    }
    factor[0] = -1;
    assert_false(lim_solve(factor, SIZE, STRIDE, side));
}

// The three compilations of the kernel give the same bits; those that the machine supports are tested.
static void every_instruction_set_gives_the_same_bits(void **state)
{
    (void)state;
    SimdLevel before = simd_level();
    LimEnergy energy[SIMD_COUNT];
    double total[SIMD_COUNT][2], gram[SIMD_COUNT][16], solved[SIMD_COUNT][20];
    float *column[SIMD_COUNT], *sums[SIMD_COUNT];
    size_t columns_size = 0, sums_size = 0;
    memset(energy, 0, sizeof energy);
    for (int isa = 0; isa <= (int)simd_widest(); isa++) {
        simd_force((SimdLevel)isa);
        Case c;
        make_case(&c, 11);
        int both = 2 * c.points.padded;
        columns_size = (size_t)(4 * both) * sizeof(float);
        sums_size = (size_t)(4 * both) * sizeof(float);
        column[isa] = calloc(1, columns_size);
        sums[isa] = calloc(1, sums_size);
        sums_without(&c, 2);
        energy[isa] = lim_energy(&c.points, &c.blob[2]);
        lim_points_sum(&c.points, c.blob, BLOBS, ISO_LEVEL);
        lim_energy_total(&c.points, &total[isa][0], &total[isa][1]);
        lim_energy_columns(&c.points, &c.blob[1], 0.01, column[isa]);
        lim_energy_gram(column[isa], column[isa], (size_t)both, both, gram[isa], 4);
        lim_energy_residuals(&c.points, 0.01, sums[isa]);
        memcpy(sums[isa] + both, c.points.h[2], (size_t)c.points.padded * sizeof(float));
        lim_points_approach(&c.points, 0.4, 0.7);
        memcpy(sums[isa] + both + c.points.padded, c.points.y, (size_t)c.points.padded * sizeof(float));
        lim_points_taubin(&c.points, sums[isa] + 2 * both);
        lim_points_feet(&c.points, 1, sums[isa] + 3 * both, sums[isa] + 3 * both + c.points.padded);
        solve_one(solved[isa]);
        lim_points_free(&c.points);
    }
    simd_force(before);
    for (int isa = 1; isa <= (int)simd_widest(); isa++) {
        assert_memory_equal(&energy[isa], &energy[0], sizeof energy[0]);
        assert_memory_equal(total[isa], total[0], sizeof total[0]);
        assert_memory_equal(gram[isa], gram[0], sizeof gram[0]);
        assert_memory_equal(solved[isa], solved[0], sizeof solved[0]);
        assert_memory_equal(column[isa], column[0], columns_size);
        assert_memory_equal(sums[isa], sums[0], sums_size);
    }
    for (int isa = 0; isa <= (int)simd_widest(); isa++) {
        free(column[isa]);
        free(sums[isa]);
    }
}

static double plain_cohesion(const LimBlob *blob, int count, double s)
{
    double sum = 0;
    for (int j = 0; j < count; j++)
        for (int k = 0; k < count; k++) {
            if (j == k)
                continue;
            double d = sqrt(pow(blob[j].center[0] - blob[k].center[0], 2) + pow(blob[j].center[1] - blob[k].center[1], 2) +
                            pow(blob[j].center[2] - blob[k].center[2], 2));
            double x = s * sqrt(blob[j].width * blob[k].width) / d;
            sum += pow(x, 12) - 2 * pow(x, 6);
        }
    return sum / (count * (count - 1));
}

static void cohesion_equals_eq_7(void **state)
{
    (void)state;
    Case c;
    make_case(&c, 3);
    double slope[4], all = plain_cohesion(c.blob, BLOBS, 2);
    assert_true(fabs(lim_cohesion_total(c.blob, BLOBS, 2) - all) < 1e-9 * fabs(all));
    for (int j = 0; j < BLOBS; j++) {
        lim_cohesion(c.blob, BLOBS, j, 2, slope);
        for (int k = 0; k < 4; k++) {
            double *p = parameter(&c.blob[j], k), kept = *p, step = 1e-6;
            *p = kept + step;
            double up = plain_cohesion(c.blob, BLOBS, 2);
            *p = kept - step;
            double down = plain_cohesion(c.blob, BLOBS, 2);
            *p = kept;
            assert_true(fabs((up - down) / (2 * step) - slope[k]) < 1e-5 * (1 + fabs(slope[k])));
        }
    }
    // the minimum: two equal blobs 2 rho apart, energy -1
    LimBlob pair[2] = {{{0, 0, 0}, 0.5}, {{1, 0, 0}, 0.5}};
    assert_true(fabs(lim_cohesion(pair, 2, 0, 2, slope) + 1) < 1e-9);
    for (int k = 0; k < 4; k++)
        assert_true(fabs(slope[k]) < 1e-9);
    lim_points_free(&c.points);
}

// Adding and then removing a blob restores the previous sums.
static void adding_and_removing_cancels(void **state)
{
    (void)state;
    Case c;
    make_case(&c, 4);
    sums_without(&c, 1);
    float before = c.points.h[3][17];
    lim_points_add(&c.points, &c.blob[1], 1);
    assert_true(c.points.h[3][17] != before);
    lim_points_add(&c.points, &c.blob[1], -1);
    assert_true(fabs((double)(c.points.h[3][17] - before)) < 1e-6);
    lim_points_free(&c.points);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_fused_loop_equals_the_plain_one),
        cmocka_unit_test(slopes_equal_differences),
        cmocka_unit_test(columns_equal_differences),
        cmocka_unit_test(feet_are_on_the_surface),
        cmocka_unit_test(every_instruction_set_gives_the_same_bits),
        cmocka_unit_test(cohesion_equals_eq_7),
        cmocka_unit_test(adding_and_removing_cancels),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
