#include "render/volume_view.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

// --- orientation ---

static bool axis_of(const char *frame, char positive, char negative, Vec3 *out)
{
    for (int k = 0; k < 3; k++)
        if (frame[k] == positive || frame[k] == negative) {
            double sign = frame[k] == positive ? 1 : -1;
            *out = vec3(k == 0 ? sign : 0, k == 1 ? sign : 0, k == 2 ? sign : 0);
            return true;
        }
    return false;
}

VolumeAxes patient_axes(const char *frame)
{
    VolumeAxes a = {.is_known = true};
    if (strlen(frame) == 3 && axis_of(frame, 'L', 'R', &a.left) && axis_of(frame, 'P', 'A', &a.posterior) && axis_of(frame, 'S', 'I', &a.superior))
        return a;
    return (VolumeAxes){vec3(1, 0, 0), vec3(0, 1, 0), vec3(0, 0, 1), false};
}

void patient_letters(const VolumeAxes *axes, Vec3 direction, char out[4])
{
    const double oblique = 0.4;
    static const char letter[3][2] = {{'L', 'R'}, {'P', 'A'}, {'S', 'I'}};
    double part[3] = {vec3_dot(direction, axes->left), vec3_dot(direction, axes->posterior), vec3_dot(direction, axes->superior)};
    int first = 0, second = -1;
    for (int k = 1; k < 3; k++)
        if (fabs(part[k]) > fabs(part[first]))
            first = k;
    for (int k = 0; k < 3; k++)
        if (k != first && fabs(part[k]) > oblique && (second < 0 || fabs(part[k]) > fabs(part[second])))
            second = k;
    if (!axes->is_known)
        snprintf(out, 4, "%c%c", part[first] > 0 ? '+' : '-', "xyz"[first]);
    else if (second >= 0)
        snprintf(out, 4, "%c%c", letter[first][part[first] < 0], letter[second][part[second] < 0]);
    else
        snprintf(out, 4, "%c", letter[first][part[first] < 0]);
}

Vec3 volume_middle(const Volume *v) { return volume_point_of(v, vec3(0.5 * (v->size[0] - 1), 0.5 * (v->size[1] - 1), 0.5 * (v->size[2] - 1))); }

static double extent_along(const Volume *v, Vec3 direction)
{
    double sum = 0;
    for (int k = 0; k < 3; k++)
        sum += v->size[k] * fabs(vec3_dot(v->axis[k], direction));
    return sum;
}

Camera slice_camera(const VolumeAxes *a, SliceView view, const Volume *volume, Vec3 center, double zoom, int width, int height)
{
    Camera c = {.center = center, .width = width, .height = height};
    c.right = view == SLICE_SAGITTAL ? a->posterior : a->left;
    c.up = view == SLICE_AXIAL ? vec3_negate(a->posterior) : a->superior;
    c.back = view == SLICE_AXIAL ? vec3_negate(a->superior) : view == SLICE_CORONAL ? vec3_negate(a->posterior) : a->left;
    c.mm_per_pixel = fmax(extent_along(volume, c.right) / fmax(width, 1), extent_along(volume, c.up) / fmax(height, 1)) * 1.02 / zoom;
    return c;
}

Vec3 camera_point(const Camera *c, double x, double y, Vec3 through)
{
    Vec3 p = vec3_add_scaled(c->center, (x - 0.5 * c->width) * c->mm_per_pixel, c->right);
    p = vec3_add_scaled(p, (0.5 * c->height - y) * c->mm_per_pixel, c->up);
    return vec3_add_scaled(p, vec3_dot(vec3_sub(through, p), c->back), c->back);
}

// --- pictures ---

double volume_value_at(const Volume *v, Vec3 x)
{
    Vec3 p = volume_voxel_of(v, x);
    double at[3] = {p.x, p.y, p.z}, part[3], sum = 0;
    int low[3];
    for (int k = 0; k < 3; k++) {
        if (!(at[k] >= -0.5 && at[k] <= v->size[k] - 0.5))
            return (double)v->minimum;
        at[k] = fmin(fmax(at[k], 0), v->size[k] - 1);
        low[k] = (int)fmin(floor(at[k]), v->size[k] > 1 ? v->size[k] - 2 : 0);
        part[k] = at[k] - low[k];
    }
    for (int c = 0; c < 8; c++) {
        double weight = 1;
        size_t index = 0;
        for (int k = 2; k >= 0; k--) {
            int upper = c >> k & 1, i = low[k] + upper < v->size[k] ? low[k] + upper : low[k];
            weight *= upper ? part[k] : 1 - part[k];
            index = index * (size_t)v->size[k] + (size_t)i;
        }
        sum += weight * (double)v->value[index];
    }
    return sum;
}

static uint8_t grey_of(double value, double low, double high)
{
    double part = (value - low) / fmax(high - low, 1e-12);
    return (uint8_t)(255 * fmin(fmax(part, 0), 1) + 0.5);
}

void volume_slice(const Volume *v, const Camera *c, Vec3 through, double low, double high, uint8_t *grey)
{
    for (int j = 0; j < c->height; j++)
        for (int i = 0; i < c->width; i++)
            *grey++ = grey_of(volume_value_at(v, camera_point(c, i + 0.5, j + 0.5, through)), low, high);
}

// The part of a line in voxels, from p along d, within the volume. False if there is none.
static bool clip(const Volume *v, Vec3 p, Vec3 d, double *from, double *to)
{
    double at[3] = {p.x, p.y, p.z}, step[3] = {d.x, d.y, d.z};
    *from = -1e9, *to = 1e9;
    for (int k = 0; k < 3; k++) {
        double first = -0.499, last = v->size[k] - 0.501;
        if (fabs(step[k]) < 1e-12) {
            if (at[k] < first || at[k] > last)
                return false;
            continue;
        }
        double a = (first - at[k]) / step[k], b = (last - at[k]) / step[k];
        *from = fmax(*from, fmin(a, b));
        *to = fmin(*to, fmax(a, b));
    }
    return *from < *to;
}

typedef struct Projection {
    const Volume *volume;
    const Camera *camera;
    double low, high;
    uint8_t *grey;
} Projection;

static void project_row(void *context, long row)
{
    const Projection *p = context;
    const Volume *v = p->volume;
    const Camera *c = p->camera;
    Vec3 origin = vec3(0, 0, 0), d = vec3_sub(volume_voxel_of(v, vec3_negate(c->back)), volume_voxel_of(v, origin));
    d = vec3_scale(d, 1 / fmax(fmax(fabs(d.x), fabs(d.y)), fabs(d.z)));      // a voxel a step
    size_t nx = (size_t)v->size[0], ny = (size_t)v->size[1];
    for (int i = 0; i < c->width; i++) {
        Vec3 at = volume_voxel_of(v, camera_point(c, i + 0.5, (double)row + 0.5, c->center));
        double from, to;
        float most = v->minimum;
        if (clip(v, at, d, &from, &to)) {
            float x = (float)(at.x + from * d.x) + 0.5f, y = (float)(at.y + from * d.y) + 0.5f, z = (float)(at.z + from * d.z) + 0.5f;
            float dx = (float)d.x, dy = (float)d.y, dz = (float)d.z;
            for (int n = (int)(to - from); n > 0; n--, x += dx, y += dy, z += dz) {
                float value = v->value[((size_t)z * ny + (size_t)y) * nx + (size_t)x];
                most = value > most ? value : most;
            }
        }
        p->grey[(size_t)row * (size_t)c->width + (size_t)i] = grey_of((double)most, p->low, p->high);
    }
}

void volume_projection(const Volume *volume, const Camera *camera, double low, double high, int threads, uint8_t *grey)
{
    Projection p = {volume, camera, low, high, grey};
    parallel_for(threads, camera->height, project_row, &p, NULL);
}

typedef struct SightLine {       // of a pixel: start + t direction [mm], within the volume
    Vec3 start, direction;
    double from, to;
} SightLine;

static bool sight_line(const Volume *v, const Camera *c, double x, double y, SightLine *line)
{
    line->start = camera_point(c, x, y, c->center);
    line->direction = vec3_negate(c->back);
    const Vec3 at = volume_voxel_of(v, line->start), step = vec3_sub(volume_voxel_of(v, vec3_add(line->start, line->direction)), at);
    return clip(v, at, step, &line->from, &line->to);
}

static double brightest_on(const Volume *v, const SightLine *line)
{
    double most = (double)v->minimum;
    for (double t = line->from; t <= line->to; t += 0.5 * volume_voxel_size(v))
        most = fmax(most, volume_value_at(v, vec3_add_scaled(line->start, t, line->direction)));
    return most;
}

// The middle of the first stretch of the line that is nearly as bright as `most`.
static Vec3 first_bright(const Volume *v, const SightLine *line, double most)
{
    const double bright = 0.85, level = (double)v->minimum + bright * (most - (double)v->minimum);
    double first = 0, last = 0;
    bool is_within = false;
    for (double t = line->from; t <= line->to; t += 0.5 * volume_voxel_size(v)) {
        bool is_bright = volume_value_at(v, vec3_add_scaled(line->start, t, line->direction)) >= level;
        if (is_bright && !is_within)
            first = t, is_within = true;
        if (is_bright)
            last = t;
        else if (is_within)
            break;
    }
    return vec3_add_scaled(line->start, 0.5 * (first + last), line->direction);
}

bool volume_pick(const Volume *v, const Camera *c, double low, double high, double x, double y, Vec3 *place)
{
    enum { REACH = 6 };              // pixels
    const double least = 0.3;        // of the range from black to white
    double best = 0;
    for (int j = -REACH; j <= REACH; j++)
        for (int i = -REACH; i <= REACH; i++) {
            SightLine line;
            const double away = hypot(i, j);
            if (away > REACH || !sight_line(v, c, x + i, y + j, &line))
                continue;
            const double most = brightest_on(v, &line), seen = (fmin(most, high) - low) / (high - low), score = seen * (1 - 0.5 * away / REACH);
            if (seen >= least && score > best)
                best = score, *place = first_bright(v, &line, most);
        }
    return best > 0;
}

void mesh_cut(const TriangleMesh *mesh, Vec3 point, Vec3 normal, void (*call)(void *context, Vec3 a, Vec3 b, int vertex), void *context)
{
    for (int t = 0; t < mesh->triangle_count; t++) {
        Vec3 x[3], cut[3];
        double side[3];
        int count = 0;
        for (int k = 0; k < 3; k++) {
            x[k] = mesh->vertex[mesh->triangle[t][k]];
            side[k] = vec3_dot(vec3_sub(x[k], point), normal);
        }
        if ((side[0] > 0) == (side[1] > 0) && (side[1] > 0) == (side[2] > 0))
            continue;
        for (int k = 0; k < 3; k++) {
            int n = (k + 1) % 3;
            if ((side[k] > 0) != (side[n] > 0))
                cut[count++] = vec3_mix(x[k], x[n], side[k] / (side[k] - side[n]));
        }
        call(context, cut[0], cut[1], mesh->triangle[t][0]);
    }
}
