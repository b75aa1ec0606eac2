// Framing. Eye coordinates: e = (right . d, up . d, back . d), d = X - center; pixels: w/2 + e_x / s, h/2 - e_y / s, s mm per pixel.
#include "render/camera.h"

#include <float.h>

void camera_principal_axes(const Sym3 *matrix, double value[3], Vec3 axis[3])
{
    double a[3][3] = {{matrix->xx, matrix->xy, matrix->xz}, {matrix->xy, matrix->yy, matrix->yz}, {matrix->xz, matrix->yz, matrix->zz}};
    double v[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    for (int sweep = 0; sweep < 30; sweep++)
        for (int p = 0; p < 2; p++)
            for (int q = p + 1; q < 3; q++) {
                if (fabs(a[p][q]) <= 1e-15 * (fabs(a[p][p]) + fabs(a[q][q])))
                    continue;
                double theta = (a[q][q] - a[p][p]) / (2 * a[p][q]);
                double t = (theta < 0 ? -1 : 1) / (fabs(theta) + sqrt(theta * theta + 1)), c = 1 / sqrt(t * t + 1), s = t * c;
                for (int k = 0; k < 3; k++) {
                    double kp = a[k][p], kq = a[k][q];
                    a[k][p] = c * kp - s * kq;
                    a[k][q] = s * kp + c * kq;
                }
                for (int k = 0; k < 3; k++) {
                    double pk = a[p][k], qk = a[q][k], vp = v[k][p], vq = v[k][q];
                    a[p][k] = c * pk - s * qk;
                    a[q][k] = s * pk + c * qk;
                    v[k][p] = c * vp - s * vq;
                    v[k][q] = s * vp + c * vq;
                }
            }
    int order[3] = {0, 1, 2};
    for (int i = 0; i < 2; i++)
        for (int j = 0; j < 2 - i; j++)
            if (a[order[j]][order[j]] > a[order[j + 1]][order[j + 1]]) {
                int swap = order[j];
                order[j] = order[j + 1];
                order[j + 1] = swap;
            }
    for (int i = 0; i < 3; i++) {
        value[i] = a[order[i]][order[i]];
        axis[i] = vec3(v[0][order[i]], v[1][order[i]], v[2][order[i]]);
    }
}

// Chooses the sign for which the axis is closest to +y, -z or -x.
static Vec3 signed_view(Vec3 axis)
{
    double ax = fabs(axis.x), ay = fabs(axis.y), az = fabs(axis.z);
    double along = ay >= ax && ay >= az ? axis.y : az >= ax ? -axis.z : -axis.x;
    return along < 0 ? vec3_negate(axis) : axis;
}

static Vec3 face_on(int count, const Vec3 *point)
{
    const Vec3 front = {0, 1, 0};
    Vec3 mean = {0, 0, 0};
    for (int i = 0; i < count; i++)
        mean = vec3_add_scaled(mean, 1.0 / count, point[i]);
    Sym3 spread = {0};
    for (int i = 0; i < count; i++) {
        Vec3 d = vec3_sub(point[i], mean);
        spread.xx += d.x * d.x, spread.xy += d.x * d.y, spread.xz += d.x * d.z;
        spread.yy += d.y * d.y, spread.yz += d.y * d.z, spread.zz += d.z * d.z;
    }
    double value[3];
    Vec3 axis[3];
    camera_principal_axes(&spread, value, axis);
    const double alike = 0.15;   // relative to the largest: a ratio of extents of 0.39
    if (!(value[2] > 0) || value[2] - value[0] < alike * value[2])
        return front;
    if (value[1] - value[0] < alike * alike * value[2]) {
        // a line: any direction perpendicular to it may be chosen
        Vec3 across = vec3_add_scaled(front, -vec3_dot(front, axis[2]), axis[2]);
        if (vec3_norm(across) < 0.3)
            across = vec3_add_scaled(vec3(-1, 0, 0), axis[2].x, axis[2]);
        return vec3_unit(across);
    }
    return signed_view(axis[0]);
}

void camera_orient(Camera *camera, Vec3 view, Vec3 up, int count, const Vec3 *point)
{
    if (!(vec3_norm(view) > 0))
        view = face_on(count, point);
    view = vec3_unit(view);
    if (!(vec3_norm(vec3_cross(view, up)) > 1e-6 * vec3_norm(up))) {
        const Vec3 candidate[3] = {{0, 0, 1}, {0, 1, 0}, {1, 0, 0}};
        up = candidate[0];
        for (int i = 0; i < 3; i++)
            if (fabs(vec3_dot(candidate[i], view)) < 0.9) {
                up = candidate[i];
                break;
            }
    }
    camera->back = vec3_negate(view);
    camera->right = vec3_unit(vec3_cross(up, camera->back));
    camera->up = vec3_cross(camera->back, camera->right);
}

void camera_frame(Camera *camera, int width, int height, double border, int count, const Vec3 *point, double margin)
{
    double low[3] = {DBL_MAX, DBL_MAX, DBL_MAX}, high[3] = {-DBL_MAX, -DBL_MAX, -DBL_MAX};
    for (int i = 0; i < count; i++) {
        double e[3] = {vec3_dot(camera->right, point[i]), vec3_dot(camera->up, point[i]), vec3_dot(camera->back, point[i])};
        for (int k = 0; k < 3; k++) {
            low[k] = fmin(low[k], e[k] - margin);
            high[k] = fmax(high[k], e[k] + margin);
        }
    }
    if (count < 1)
        for (int k = 0; k < 3; k++)
            low[k] = -1, high[k] = 1;
    Vec3 middle = {(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, (low[2] + high[2]) / 2};
    camera->center = vec3_add_scaled(vec3_add_scaled(vec3_scale(camera->right, middle.x), middle.y, camera->up), middle.z, camera->back);
    double room_x = fmax(1, width - 2 * border), room_y = fmax(1, height - 2 * border);
    camera->mm_per_pixel = fmax(fmax((high[0] - low[0]) / room_x, (high[1] - low[1]) / room_y), 1e-9);
    double half = (high[2] - low[2]) / 2 + 10 * margin + 1e-6;
    camera->near_depth = half;
    camera->far_depth = -half;
    camera->width = width;
    camera->height = height;
}

double camera_height_of(const Camera *camera, int count, const Vec3 *point)
{
    double low = DBL_MAX, high = -DBL_MAX;
    for (int i = 0; i < count; i++) {
        double e = vec3_dot(camera->up, point[i]);
        low = fmin(low, e);
        high = fmax(high, e);
    }
    return count > 0 ? (high - low) / camera->mm_per_pixel : 0;
}

void camera_frame_sphere(Camera *camera, int width, int height, double border, Vec3 center, double radius)
{
    double shift = vec3_dot(camera->back, vec3_sub(camera->center, center));
    camera->near_depth += shift;
    camera->far_depth += shift;
    camera->center = center;
    camera->width = width;
    camera->height = height;
    camera->mm_per_pixel = fmax(2 * radius / fmax(1, fmin(width, height) - 2 * border), 1e-9);
}

Vec3 camera_project(const Camera *camera, Vec3 point)
{
    Vec3 d = vec3_sub(point, camera->center);
    return vec3(camera->width / 2.0 + vec3_dot(camera->right, d) / camera->mm_per_pixel, camera->height / 2.0 - vec3_dot(camera->up, d) / camera->mm_per_pixel,
                vec3_dot(camera->back, d));
}

void camera_matrix(const Camera *camera, Vec3 origin, float matrix[16])
{
    double sx = 2 / (camera->width * camera->mm_per_pixel), sy = 2 / (camera->height * camera->mm_per_pixel);
    double depth = camera->near_depth - camera->far_depth, sz = depth > 0 ? -2 / depth : -1;
    double mid = (camera->near_depth + camera->far_depth) / 2;
    Vec3 offset = vec3_sub(origin, camera->center);
    const Vec3 row[3] = {vec3_scale(camera->right, sx), vec3_scale(camera->up, sy), vec3_scale(camera->back, sz)};
    for (int i = 0; i < 3; i++) {
        matrix[i] = (float)row[i].x;
        matrix[4 + i] = (float)row[i].y;
        matrix[8 + i] = (float)row[i].z;
        matrix[12 + i] = (float)(vec3_dot(row[i], offset) - (i == 2 ? sz * mid : 0));
        matrix[4 * i + 3] = 0;
    }
    matrix[15] = 1;
}

void camera_axes(const Camera *camera, float matrix[9])
{
    const Vec3 row[3] = {camera->right, camera->up, camera->back};
    for (int i = 0; i < 3; i++) {
        matrix[i] = (float)row[i].x;
        matrix[3 + i] = (float)row[i].y;
        matrix[6 + i] = (float)row[i].z;
    }
}
