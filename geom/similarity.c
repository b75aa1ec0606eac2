// Horn, Closed-form solution of absolute orientation using unit quaternions, JOSA A 4 (1987): with a, b the points from their means and S = sum a b^T, the
// rotation is the eigenvector of the greatest eigenvalue of a symmetric 4 x 4 matrix of sums of S. The scale is that of least squares:
// sum b . R a / sum a . a (Umeyama 1991).
#include "geom/similarity.h"

#include <string.h>

static Vec3 mean_of(int count, const Vec3 *point)
{
    Vec3 sum = {0};
    for (int i = 0; i < count; i++)
        sum = vec3_add(sum, point[i]);
    return vec3_scale(sum, 1.0 / count);
}

// Points on a line leave a turn about it open.
static bool spans_a_plane(int count, const Vec3 *point)
{
    double longest = 0, area = 0;
    for (int i = 1; i < count; i++)
        longest = fmax(longest, vec3_distance(point[i], point[0]));
    for (int i = 1; i < count; i++)
        for (int k = 1; k < i; k++)
            area = fmax(area, vec3_norm(vec3_cross(vec3_sub(point[i], point[0]), vec3_sub(point[k], point[0]))));
    return area > 1e-3 * longest * longest;
}

// Eigenvector of the greatest eigenvalue by Jacobi's rotations.
static Quat greatest_eigenvector(double m[4][4])
{
    double v[4][4] = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}};
    for (int sweep = 0; sweep < 50; sweep++)
        for (int p = 0; p < 3; p++)
            for (int q = p + 1; q < 4; q++) {
                if (m[p][q] == 0)
                    continue;
                double theta = (m[q][q] - m[p][p]) / (2 * m[p][q]), t = copysign(1, theta) / (fabs(theta) + sqrt(theta * theta + 1));
                double c = 1 / sqrt(t * t + 1), s = t * c;
                for (int k = 0; k < 4; k++) {
                    double a = m[k][p], b = m[k][q];
                    m[k][p] = c * a - s * b, m[k][q] = s * a + c * b;
                }
                for (int k = 0; k < 4; k++) {
                    double a = m[p][k], b = m[q][k], x = v[k][p], y = v[k][q];
                    m[p][k] = c * a - s * b, m[q][k] = s * a + c * b;
                    v[k][p] = c * x - s * y, v[k][q] = s * x + c * y;
                }
            }
    int best = 0;
    for (int k = 1; k < 4; k++)
        best = m[k][k] > m[best][best] ? k : best;
    return quat_unit((Quat){v[0][best], v[1][best], v[2][best], v[3][best]});
}

static Mat3 best_turn(double s[3][3])
{
    double m[4][4] = {
        {s[0][0] + s[1][1] + s[2][2], s[1][2] - s[2][1], s[2][0] - s[0][2], s[0][1] - s[1][0]},
        {s[1][2] - s[2][1], s[0][0] - s[1][1] - s[2][2], s[0][1] + s[1][0], s[2][0] + s[0][2]},
        {s[2][0] - s[0][2], s[0][1] + s[1][0], s[1][1] - s[0][0] - s[2][2], s[1][2] + s[2][1]},
        {s[0][1] - s[1][0], s[2][0] + s[0][2], s[1][2] + s[2][1], s[2][2] - s[0][0] - s[1][1]},
    };
    return quat_to_mat3(greatest_eigenvector(m));
}

bool similarity_fit(int count, const Vec3 *from, const Vec3 *to, const Mat3 *turn, Similarity *fit)
{
    if (count < 1 || (!turn && (count < 3 || !spans_a_plane(count, from) || !spans_a_plane(count, to))))
        return false;
    Vec3 a0 = mean_of(count, from), b0 = mean_of(count, to);
    double s[3][3] = {{0}}, square = 0, along = 0;
    for (int i = 0; i < count; i++) {
        Vec3 d = vec3_sub(from[i], a0), e = vec3_sub(to[i], b0);
        const double a[3] = {d.x, d.y, d.z}, b[3] = {e.x, e.y, e.z};
        for (int r = 0; r < 3; r++)
            for (int c = 0; c < 3; c++)
                s[r][c] += a[r] * b[c];
        square += vec3_norm2(d);
    }
    Mat3 found = turn ? *turn : best_turn(s);
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++)
            along += found.m[c][r] * s[r][c];
    double scale = count == 1 ? 1 : along / square;
    if (!(scale > 0) || !isfinite(scale))
        return false;
    *fit = (Similarity){.turn = found, .scale = scale};
    fit->shift = vec3_add_scaled(b0, -scale, mat3_mul_vec(&found, a0));
    return true;
}
