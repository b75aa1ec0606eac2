// Maximum-intensity projections of an angiogram with the tracked tree drawn over them.
//
// A point X is drawn at pixel ((X - O) . a / |a|^2, (X - O) . b / |b|^2) with a, b the steps across and up: correct for orthogonal voxel axes, oblique or
// not. The images are darkened so that the lines over them stand out.
#include "render/message.h"
#include "render/picture_page.h"
#include "render/tick_step.h"

#include <float.h>
#include <stdlib.h>
#include <string.h>

typedef struct Panel {
    const PictureProjection *image;
    double x, y, width, height;   // on the page
    double pixels_per_mm;
} Panel;

static bool check_projections(int count, const PictureProjection *projection, int polyline_count, const PicturePolyline *polyline, char *message,
                              size_t capacity)
{
    if (count < 1 || count > 6)
        return message_fail(message, capacity, "cannot draw %d projections; expected 1 to 6", count);
    for (int k = 0; k < count; k++) {
        const PictureProjection *p = &projection[k];
        if (p->width < 1 || p->height < 1 || p->width > 16384 || p->height > 16384 || !p->value)
            return message_fail(message, capacity, "projection %d has %d x %d pixels; expected 1 to 16384 per side", k, p->width, p->height);
        if (!vec3_is_finite(p->origin) || !vec3_is_finite(p->across) || !vec3_is_finite(p->up) || !(vec3_norm(p->across) > 0) || !(vec3_norm(p->up) > 0))
            return message_fail(message, capacity, "projection %d has no pixel size; expected steps above 0 mm", k);
    }
    for (int k = 0; k < polyline_count; k++)
        for (int i = 0; i < polyline[k].count; i++)
            if (!vec3_is_finite(polyline[k].point[i]))
                return message_fail(message, capacity, "point %d of line %d is not a finite number: nothing is drawn", i, k);
    return true;
}

static int compare_floats(const void *a, const void *b)
{
    float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

// Black at the median, white at the 99.7th percentile of a sample of all images.
static bool find_window(int count, const PictureProjection *projection, float *low, float *high)
{
    enum { SAMPLE = 200000 };
    float *sample = malloc(SAMPLE * sizeof *sample);
    if (!sample)
        return false;
    size_t total = 0, n = 0;
    for (int k = 0; k < count; k++)
        total += (size_t)projection[k].width * (size_t)projection[k].height;
    size_t stride = total / SAMPLE + 1;
    for (int k = 0; k < count; k++)
        for (size_t i = 0; i < (size_t)projection[k].width * (size_t)projection[k].height && n < SAMPLE; i += stride)
            if (isfinite(projection[k].value[i]))
                sample[n++] = projection[k].value[i];
    *low = 0;
    *high = 1;
    if (n > 0) {
        qsort(sample, n, sizeof *sample, compare_floats);
        *low = sample[n / 2];
        *high = sample[(size_t)(0.997 * (double)(n - 1))];
        if (!(*high > *low))
            *high = sample[n - 1];
        if (!(*high > *low))
            *high = *low + 1;
    }
    free(sample);
    return true;
}

static unsigned upload(PicturePage *page, const PictureProjection *p, float low, float high)
{
    size_t count = (size_t)p->width * (size_t)p->height;
    uint8_t *grey = malloc(count);
    if (!grey)
        return 0;
    for (size_t i = 0; i < count; i++) {
        float x = (p->value[i] - low) / (high - low);
        x = x > 0 ? x < 1 ? x : 1 : 0;   // NaN is black
        grey[i] = (uint8_t)(8 + 165 * sqrtf(x) * (0.4f + 0.6f * x) + 0.5f);
    }
    unsigned texture = picture_page_grey_texture(page, p->width, p->height, grey);
    free(grey);
    return texture;
}

static void place(const Panel *panel, Vec3 point, double *x, double *y)
{
    const PictureProjection *p = panel->image;
    Vec3 d = vec3_sub(point, p->origin);
    *x = panel->x + panel->width * (vec3_dot(d, p->across) / vec3_norm2(p->across) + 0.5) / p->width;
    *y = panel->y + panel->height * (1 - (vec3_dot(d, p->up) / vec3_norm2(p->up) + 0.5) / p->height);
}

static void draw_outline(PicturePage *page, const Panel *panel, const PicturePolyline *line, const float (*at)[2], float (*side)[2], Color color)
{
    for (int sign = -1; sign <= 1; sign += 2) {
        for (int i = 0; i < line->count; i++) {
            int a = i > 0 ? i - 1 : 0, b = i + 1 < line->count ? i + 1 : i;
            double dx = at[b][0] - at[a][0], dy = at[b][1] - at[a][1], length = hypot(dx, dy), r = sign * line->radius[i] * panel->pixels_per_mm;
            side[i][0] = at[i][0] - (float)(length > 0 ? r * dy / length : 0);
            side[i][1] = at[i][1] + (float)(length > 0 ? r * dx / length : 0);
        }
        overlay_polyline(page->overlay, line->count, (const float(*)[2])side, color_with_alpha(color, 0.6), 0.8 * page->scale);
    }
}

static void draw_axes(PicturePage *page, const Panel *panel)
{
    const PictureProjection *p = panel->image;
    double s = page->scale;
    for (int direction = 0; direction < 2; direction++) {
        Vec3 step = direction ? p->up : p->across;
        int pixels = direction ? p->height : p->width;
        double size = vec3_norm(step), low = vec3_dot(p->origin, step) / size - size / 2, high = low + pixels * size, tick = tick_step(high - low, 6);
        for (double k = ceil(low / tick); k * tick <= high; k++) {
            char text[32];
            tick_format(text, sizeof text, k * tick, tick);
            double part = (k * tick - low) / (high - low);
            if (direction) {
                double y = panel->y + panel->height * (1 - part), height;
                overlay_text_size(page->overlay, TEXT_SMALL, text, NULL, &height);
                overlay_line(page->overlay, panel->x - 4 * s, y, panel->x, y, PAGE_INK, s);
                picture_page_text_anchored(page, panel->x - 6 * s, y - height / 2, 1, TEXT_SMALL, PAGE_INK, text);
            } else {
                double x = panel->x + panel->width * part;
                overlay_line(page->overlay, x, panel->y + panel->height, x, panel->y + panel->height + 4 * s, PAGE_INK, s);
                picture_page_text_anchored(page, x, panel->y + panel->height + 5 * s, 0.5, TEXT_SMALL, PAGE_INK, text);
            }
        }
    }
    char text[128];
    if (p->across_name) {
        snprintf(text, sizeof text, "%s [mm]", p->across_name);
        picture_page_text_anchored(page, panel->x + panel->width / 2, panel->y + panel->height + 23 * s, 0.5, TEXT_SMALL, PAGE_INK, text);
    }
    if (p->up_name) {
        snprintf(text, sizeof text, "%s [mm]", p->up_name);
        picture_page_text_anchored(page, panel->x, panel->y - 20 * s, 0.5, TEXT_SMALL, PAGE_INK, text);
    }
}

static bool draw_projection(PicturePage *page, const Panel *panel, float low, float high, int polyline_count, const PicturePolyline *polyline, int mark_count,
                            const PictureMark *mark)
{
    unsigned texture = upload(page, panel->image, low, high);
    int longest = 1;
    for (int k = 0; k < polyline_count; k++)
        longest = polyline[k].count > longest ? polyline[k].count : longest;
    float(*at)[2] = malloc(2 * (size_t)longest * sizeof *at);
    if (!texture || !at) {
        free(at);
        return message_fail(page->message, page->capacity, "out of memory for a picture");
    }
    double s = page->scale;
    overlay_image(page->overlay, texture, panel->x, panel->y, panel->width, panel->height, true);
    overlay_push_clip(page->overlay, panel->x, panel->y, panel->width, panel->height);
    for (int k = 0; k < polyline_count; k++) {
        const PicturePolyline *line = &polyline[k];
        for (int i = 0; i < line->count; i++) {
            double x, y;
            place(panel, line->point[i], &x, &y);
            at[i][0] = (float)x;
            at[i][1] = (float)y;
        }
        Color color = color_qualitative(line->color);
        if (line->radius)
            draw_outline(page, panel, line, (const float(*)[2])at, at + longest, color);
        overlay_polyline(page->overlay, line->count, (const float(*)[2])at, color, 1.7 * s);
    }
    for (int i = 0; i < mark_count; i++) {
        double x, y, width, height;
        place(panel, mark[i].point, &x, &y);
        overlay_disc(page->overlay, x, y, 5.5 * s, color_rgb(20, 20, 20));
        overlay_disc(page->overlay, x, y, 4 * s, color_rgb(255, 255, 255));
        if (!mark[i].label)
            continue;
        overlay_text_size(page->overlay, TEXT_SMALL, mark[i].label, &width, &height);
        bool fits = x + 9 * s + width < panel->x + panel->width;
        double left = fits ? x + 9 * s : x - 9 * s - width;
        overlay_fill(page->overlay, left - 2 * s, y - height / 2 - s, width + 4 * s, height + 2 * s, (Color){0, 0, 0, 150});
        overlay_text(page->overlay, left, y - height / 2, TEXT_SMALL, color_rgb(255, 255, 255), mark[i].label);
    }
    overlay_pop_clip(page->overlay);
    draw_axes(page, panel);
    free(at);
    return true;
}

static double length_of(int count, const PicturePolyline *polyline)
{
    double length = 0;
    for (int k = 0; k < count; k++)
        for (int i = 1; i < polyline[k].count; i++)
            length += vec3_distance(polyline[k].point[i - 1], polyline[k].point[i]);
    return length;
}

// Arranges all panels at one scale, in the number of rows that makes them largest. Returns the height that they need.
static double lay_out(const PictureOptions *page, int count, const PictureProjection *projection, double top, Panel *panel)
{
    double s = picture_page_scale_of(page), left = 52 * s, between = 14 * s, foot = 48 * s, head = 26 * s, best = 0;
    int best_columns = count;
    for (int columns = count; columns >= 1; columns--) {
        int rows = (count + columns - 1) / columns;
        double widest = 0, tallest = 0;   // [mm] of a full row, and of all rows together
        for (int r = 0; r < rows; r++) {
            double width = 0, height = 0;
            for (int k = r * columns; k < count && k < (r + 1) * columns; k++) {
                width += projection[k].width * vec3_norm(projection[k].across);
                height = fmax(height, projection[k].height * vec3_norm(projection[k].up));
            }
            widest = fmax(widest, width);
            tallest += height;
        }
        double scale = fmin((page->width - columns * left - between * columns) / widest, (page->height - top - rows * (head + foot)) / tallest);
        if (scale > best) {
            best = scale;
            best_columns = columns;
        }
    }
    double y = top;
    for (int first = 0; first < count; first += best_columns) {
        double x = left, tallest = 0;
        for (int k = first; k < count && k < first + best_columns; k++) {
            panel[k] = (Panel){.image = &projection[k],
                               .x = x,
                               .y = y + head,
                               .pixels_per_mm = best,
                               .width = best * projection[k].width * vec3_norm(projection[k].across),
                               .height = best * projection[k].height * vec3_norm(projection[k].up)};
            x += panel[k].width + left + between;
            tallest = fmax(tallest, panel[k].height);
        }
        y += tallest + head + foot;
    }
    return y;
}

// `low`, `high`: values drawn black and white; equal (0, 0): taken from the percentiles of the images.
static bool picture_of_projections(const char *path, const PictureOptions *options, int projection_count, const PictureProjection *projection, float low,
                                   float high, int polyline_count, const PicturePolyline *polyline, int mark_count, const PictureMark *mark, char *message,
                                   size_t capacity)
{
    if (!check_projections(projection_count, projection, polyline_count, polyline, message, capacity))
        return false;
    if (!(high > low) && !find_window(projection_count, projection, &low, &high))
        return message_fail(message, capacity, "out of memory for a picture");
    PicturePage page;
    Panel panel[6];
    double s = picture_page_scale_of(options), needed = lay_out(options, projection_count, projection, 46 * s, panel);
    if (!picture_page_open(&page, options, (int)ceil(needed), message, capacity))
        return false;
    char text[160];
    snprintf(text, sizeof text, "maximum intensity %.4g to %.4g; %d branch%s, %.0f mm", (double)low, (double)high, polyline_count,
             polyline_count == 1 ? "" : "es", length_of(polyline_count, polyline));
    double wide = picture_page_text_anchored(&page, page.width - 20 * s, 17 * s, 1, TEXT_NORMAL, PAGE_MUTED, text);
    picture_page_title(&page, 20 * s, 12 * s, page.width - wide - 60 * s, options->title);
    bool drawn = true;
    for (int k = 0; k < projection_count && drawn; k++)
        drawn = draw_projection(&page, &panel[k], low, high, polyline_count, polyline, mark_count, mark);
    drawn = drawn && picture_page_save(&page, path);
    picture_page_close(&page);
    return drawn;
}

// --- from a voxel grid and a tree ---

enum { SAC_COLOR = 5 };      // purple; orders above 5 use it too

typedef struct Branches {
    int count;
    PicturePolyline *line;
    Vec3 *point;
    double *radius;
} Branches;

static void free_branches(Branches *branches)
{
    free(branches->line);
    free(branches->point);
    free(branches->radius);
}

// Each branch (vessel_branches.h) becomes a line starting at its parent node, and each aneurysm node a line of its own; the colour is the order of the branch.
static bool cut_into_branches(const VesselTree *tree, Branches *branches)
{
    size_t n = (size_t)tree->node_count;
    VesselBranches *cut = vessel_branches_create(tree);
    branches->line = calloc(n, sizeof *branches->line);
    branches->point = malloc(2 * n * sizeof *branches->point);
    branches->radius = malloc(2 * n * sizeof *branches->radius);
    int used = 0;
    bool good = cut && branches->line && branches->point && branches->radius;
    for (int b = 0; good && b < cut->count; b++) {
        const VesselBranch *branch = &cut->branch[b];
        const int *node = cut->node + branch->first;
        PicturePolyline *line = &branches->line[branches->count++];
        *line = (PicturePolyline){.point = branches->point + used, .radius = branches->radius + used, .color = branch->order - 1};
        for (int k = branch->from_node >= 0 ? -1 : 0; k < branch->count; k++, line->count++) {
            branches->point[used] = tree->center[k < 0 ? branch->from_node : node[k]];
            branches->radius[used++] = tree->radius[node[k < 0 ? 0 : k]];
        }
    }
    for (int i = 1; good && i < tree->node_count; i++) {
        if (cut->of_node[i] >= 0)
            continue;
        branches->line[branches->count++] =
            (PicturePolyline){.count = 2, .point = branches->point + used, .radius = branches->radius + used, .color = SAC_COLOR};
        branches->point[used] = tree->center[tree->parent[i]];
        branches->radius[used++] = tree->radius[i];
        branches->point[used] = tree->center[i];
        branches->radius[used++] = tree->radius[i];
    }
    vessel_branches_free(cut);
    return good;
}

static const char *axis_name(Vec3 step)
{
    double n = vec3_norm(step);
    const double part[3] = {step.x / n, step.y / n, step.z / n};
    static const char *const name[3][2] = {{"x", "-x"}, {"y", "-y"}, {"z", "-z"}};
    for (int k = 0; k < 3; k++)
        if (fabs(part[k]) > 0.999)
            return name[k][part[k] < 0];
    return "oblique";
}

bool picture_of_tree(const char *path, const PictureOptions *options, const int size[3], Vec3 origin, const Vec3 axis[3], const float *value, float low,
                     float high, const VesselTree *tree, int mark_count, const PictureMark *mark, char *message, size_t capacity)
{
    static const int plane[3][2] = {{0, 1}, {0, 2}, {1, 2}};
    PictureProjection projection[3];
    float *image[3] = {NULL, NULL, NULL};
    Branches branches = {0};
    bool drawn = true;
    for (int k = 0; k < 3; k++)
        if (size[k] < 1 || size[k] > 16384)
            return message_fail(message, capacity, "the volume has %d x %d x %d voxels; expected 1 to 16384 per side", size[0], size[1], size[2]);
    for (int k = 0; k < 3; k++) {
        int a = plane[k][0], b = plane[k][1];
        size_t pixels = (size_t)size[a] * (size_t)size[b];
        image[k] = malloc(pixels * sizeof *image[k]);
        for (size_t i = 0; image[k] && i < pixels; i++)
            image[k][i] = -FLT_MAX;
        drawn = drawn && image[k];
        projection[k] = (PictureProjection){.width = size[a],
                                            .height = size[b],
                                            .value = image[k],
                                            .origin = origin,
                                            .across = axis[a],
                                            .up = axis[b],
                                            .across_name = axis_name(axis[a]),
                                            .up_name = axis_name(axis[b])};
    }
    drawn = drawn && (!tree || tree->node_count < 1 || cut_into_branches(tree, &branches));
    if (!drawn)
        message_fail(message, capacity, "out of memory for a picture");
    for (int z = 0; drawn && z < size[2]; z++)
        for (int y = 0; y < size[1]; y++) {
            const float *row = value + ((size_t)z * (size_t)size[1] + (size_t)y) * (size_t)size[0];
            float *across_z = image[0] + (size_t)y * (size_t)size[0], *across_y = image[1] + (size_t)z * (size_t)size[0], most = -FLT_MAX;
            for (int x = 0; x < size[0]; x++) {
                across_z[x] = row[x] > across_z[x] ? row[x] : across_z[x];
                across_y[x] = row[x] > across_y[x] ? row[x] : across_y[x];
                most = row[x] > most ? row[x] : most;
            }
            image[2][(size_t)z * (size_t)size[1] + (size_t)y] = most;
        }
    PictureMark root = {{0, 0, 0}, "start"};
    if (drawn && mark_count == 0 && tree && tree->node_count > 0) {
        root.point = tree->center[0];
        mark = &root;
        mark_count = 1;
    }
    drawn = drawn && picture_of_projections(path, options, 3, projection, low, high, branches.count, branches.line, mark_count, mark, message, capacity);
    for (int k = 0; k < 3; k++)
        free(image[k]);
    free_branches(&branches);
    return drawn;
}
