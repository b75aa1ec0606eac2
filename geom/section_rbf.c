// Sections of radial functions with an ellipse, Hong et al. 2018, section 3:
//   C(p) = sum_i lambda_i phi(|p - p_i|) + A n^2 + 2 B n b + C b^2 + 2 E n + 2 F b + G,  AC - B^2 > 0 (eq. 3)
// The paper gives neither phi nor the equations. Here phi(r) = (1 - s)^4 (4 s + 1), s = r/c < 1 (Wendland 1995, C2), with c two mean radii, and the unknowns minimise
//   lambda' (Phi + mu I) lambda   with   C(p_i) = -mu lambda_i   and   AC - B^2 = 1
// (mu = 0: the curve passes through the points). So lambda = -(Phi + mu I)^-1 P a with P's rows (n^2, 2nb, b^2, 2n, 2b, 1), and a is the vector with
// AC - B^2 > 0 among the solutions of S a = kappa K a, S = P' (Phi + mu I)^-1 P, a'Ka = AC - B^2 (Fitzgibbon, Pilu and Fisher 1999). K acts on the first three
// alone; with the last three eliminated (Halir and Flusser 1998), M a_1 = kappa K_1 a_1 is solved by M = L L' and the one positive eigenvalue of L^-1 K_1 L^-T.
// Mended: coordinates are divided by the mean radius, and C by the mean |grad C| over the points, without which sections of different scale cannot be summed.
#include "geom/section_kinds.h"

#include <stdlib.h>

enum { QUADRATIC = 6 };
// values: [0] number of points, [1] 1/c, [2] mean radius; the quadratic; then n, b and lambda of each point, all in mean radii
enum { COUNT, SUPPORT, SCALE, A, B, C, E, F, G, POINTS };

static SectionJet evaluate_scaled(const double *v, double n, double b)
{
    SectionJet jet = {.value = v[A] * n * n + 2 * v[B] * n * b + v[C] * b * b + 2 * v[E] * n + 2 * v[F] * b + v[G],
                      .n = 2 * (v[A] * n + v[B] * b + v[E]),
                      .b = 2 * (v[B] * n + v[C] * b + v[F]),
                      .nn = 2 * v[A],
                      .nb = 2 * v[B],
                      .bb = 2 * v[C]};
    double per = v[SUPPORT];
    for (int i = 0; i < (int)v[COUNT]; i++) {
        const double *p = v + POINTS + 3 * i;
        double x = n - p[0], y = b - p[1], r = same_hypot(x, y), s = r * per, left = 1 - s;
        if (!(left > 0))
            continue;
        double slope = -20 * left * left * left * per * per * p[2], bend = r > 0 ? 60 * left * left * per * per * per / r * p[2] : 0;
        jet.value += p[2] * left * left * left * left * (4 * s + 1);
        jet.n += slope * x, jet.b += slope * y;
        jet.nn += slope + bend * x * x, jet.nb += bend * x * y, jet.bb += slope + bend * y * y;
    }
    return jet;
}

static SectionJet evaluate_rbf(const Section *section, double n, double b)
{
    const double *v = section->values;
    double f = 1 / v[SCALE];
    SectionJet jet = evaluate_scaled(v, n * f, b * f);
    jet.value *= v[SCALE];
    jet.nn *= f, jet.nb *= f, jet.bb *= f;
    return jet;
}

// The eigenvector of the largest eigenvalue of a symmetric matrix with one positive eigenvalue, by Jacobi's rotations.
static void positive_eigenvector(double m[3][3], double vector[3])
{
    double q[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    for (int sweep = 0; sweep < 30; sweep++)
        for (int i = 0; i < 2; i++)
            for (int j = i + 1; j < 3; j++) {
                if (m[i][j] == 0)
                    continue;
                double theta = 0.5 * (m[j][j] - m[i][i]) / m[i][j], t = (theta >= 0 ? 1 : -1) / (fabs(theta) + sqrt(theta * theta + 1)),
                       c = 1 / sqrt(t * t + 1), s = t * c;
                for (int k = 0; k < 3; k++) {
                    double a = m[k][i], b = m[k][j];
                    m[k][i] = c * a - s * b, m[k][j] = s * a + c * b;
                }
                for (int k = 0; k < 3; k++) {
                    double a = m[i][k], b = m[j][k];
                    m[i][k] = c * a - s * b, m[j][k] = s * a + c * b;
                    a = q[k][i], b = q[k][j];
                    q[k][i] = c * a - s * b, q[k][j] = s * a + c * b;
                }
            }
    int best = m[1][1] > m[0][0] ? 1 : 0;
    best = m[2][2] > m[best][best] ? 2 : best;
    for (int k = 0; k < 3; k++)
        vector[k] = q[k][best];
}

// Solves S a = kappa K a for the vector with AC - B^2 > 0. False if S is singular beyond repair.
static bool solve_ellipse(double s[QUADRATIC][QUADRATIC], double a[QUADRATIC])
{
    // eliminate the last three: a_2 = -S_22^-1 S_12' a_1, M = S_11 - S_12 S_22^-1 S_12'
    double low[9], back[3][3], m[9], trace = 0;
    for (int i = 0; i < 9; i++)
        low[i] = s[3 + i / 3][3 + i % 3];
    if (!cholesky_factor(3, low))
        return false;
    for (int j = 0; j < 3; j++) {
        for (int i = 0; i < 3; i++)
            back[j][i] = s[j][3 + i];
        cholesky_solve(3, low, back[j]);
    }
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            m[3 * i + j] = s[i][j];
            for (int k = 0; k < 3; k++)
                m[3 * i + j] -= s[i][3 + k] * back[j][k];
        }
    for (int i = 0; i < 3; i++)
        trace += s[i][i];
    for (int i = 0; i < 3; i++)      // points on an exact ellipse leave M singular
        m[3 * i + i] += 1e-13 * trace;
    if (!cholesky_factor(3, m))
        return false;
    // L^-1 K_1 L^-T, with K_1 = (0 0 1/2; 0 -1 0; 1/2 0 0)
    double inverse[3][3] = {{0}}, turned[3][3], vector[3];      // columns of L^-1
    for (int j = 0; j < 3; j++)
        for (int i = j; i < 3; i++) {
            double sum = i == j;
            for (int k = j; k < i; k++)
                sum -= m[3 * i + k] * inverse[k][j];
            inverse[i][j] = sum / m[3 * i + i];
        }
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            turned[i][j] = 0.5 * (inverse[i][0] * inverse[j][2] + inverse[i][2] * inverse[j][0]) - inverse[i][1] * inverse[j][1];
    positive_eigenvector(turned, vector);
    for (int i = 0; i < 3; i++)
        a[i] = inverse[0][i] * vector[0] + inverse[1][i] * vector[1] + inverse[2][i] * vector[2];
    for (int i = 0; i < 3; i++)
        a[3 + i] = -(back[0][i] * a[0] + back[1][i] * a[1] + back[2][i] * a[2]);
    return a[0] * a[2] - a[1] * a[1] > 0;
}

static double radial(double r, double per)
{
    double s = r * per, left = 1 - s;
    return left > 0 ? left * left * left * left * (4 * s + 1) : 0;
}

// Fills the quadratic and the weights; `matrix` (count, count) and `column` (QUADRATIC, count) are working memory.
static bool solve(double *v, int count, double mu, double *matrix, double *column)
{
    double s[QUADRATIC][QUADRATIC], a[QUADRATIC];
    for (int i = 0; i < count; i++)
        for (int j = 0; j < count; j++) {
            const double *p = v + POINTS + 3 * i, *q = v + POINTS + 3 * j;
            matrix[i * count + j] = radial(same_hypot(p[0] - q[0], p[1] - q[1]), v[SUPPORT]) + (i == j ? mu + 1e-12 : 0);
        }
    if (!cholesky_factor(count, matrix))
        return false;
    double *row[QUADRATIC], *solved[QUADRATIC];
    for (int k = 0; k < QUADRATIC; k++)
        row[k] = column + k * count, solved[k] = column + (QUADRATIC + k) * count;
    for (int i = 0; i < count; i++) {
        double n = v[POINTS + 3 * i], b = v[POINTS + 3 * i + 1], term[QUADRATIC] = {n * n, 2 * n * b, b * b, 2 * n, 2 * b, 1};
        for (int k = 0; k < QUADRATIC; k++)
            row[k][i] = solved[k][i] = term[k];
    }
    for (int k = 0; k < QUADRATIC; k++)
        cholesky_solve(count, matrix, solved[k]);
    for (int i = 0; i < QUADRATIC; i++)
        for (int j = 0; j < QUADRATIC; j++) {
            s[i][j] = 0;
            for (int k = 0; k < count; k++)
                s[i][j] += 0.5 * (row[i][k] * solved[j][k] + row[j][k] * solved[i][k]);
        }
    if (!solve_ellipse(s, a))
        return false;
    for (int k = 0; k < QUADRATIC; k++)
        v[A + k] = a[k];
    for (int i = 0; i < count; i++) {
        v[POINTS + 3 * i + 2] = 0;
        for (int k = 0; k < QUADRATIC; k++)
            v[POINTS + 3 * i + 2] -= solved[k][i] * a[k];
    }
    return true;
}

// Turns C > 0 to the inside and divides by the mean slope over the points.
static void normalise(double *v, int count)
{
    double slope = 0;
    for (int i = 0; i < count; i++) {
        SectionJet jet = evaluate_scaled(v, v[POINTS + 3 * i], v[POINTS + 3 * i + 1]);
        slope += same_hypot(jet.n, jet.b) / count;
    }
    // an ellipse with A > 0 is negative inside
    double factor = (v[A] > 0 ? -1 : 1) / fmax(slope, 1e-12);
    for (int k = 0; k < QUADRATIC; k++)
        v[A + k] *= factor;
    for (int i = 0; i < count; i++)
        v[POINTS + 3 * i + 2] *= factor;
}

Section *section_rbf_create(const SectionOptions *options, int count, const SectionPoint *contour, double radius)
{
    enum { MOST = 512 };     // points: the equations are dense
    if (count > MOST || !(radius > 0))
        return NULL;
    size_t n = (size_t)count;
    Section *section = section_allocate(SECTION_RBF, POINTS + 3 * n, radius);
    double *matrix = malloc((n * n + 2 * QUADRATIC * n) * sizeof *matrix);
    bool good = section && matrix;
    if (good) {
        double *v = section->values;
        v[COUNT] = count, v[SUPPORT] = 0.5, v[SCALE] = radius;
        for (int i = 0; i < count; i++)
            v[POINTS + 3 * i] = contour[i].n / radius, v[POINTS + 3 * i + 1] = contour[i].b / radius;
        section->numbers = POINTS - A + 3 * count;
        section->evaluate = evaluate_rbf;
        good = solve(v, count, options->stiffness, matrix, matrix + n * n);
        if (good)
            normalise(v, count);
    }
    free(matrix);
    if (!good) {
        section_free(section);
        section = NULL;
    }
    return section;
}
