// A fitted tree: its surface coloured by the distance to the points (without a mesh only the points), a histogram, and slices through the worst local models.
//
// A slice through node i contains the centre of the node, its axis (to the right) and its worst point. Contour: f_i = 0 by marching squares on bilinear
// cells; the contours of its neighbours, faint, show where the wall is discontinuous between local models.
#include "base/base.h"
#include "render/message.h"
#include "render/picture_page.h"

#include <stdlib.h>
#include <string.h>

enum { SLICE_CELLS = 140, WORST_MOST = 12, BINS = 60 };

typedef struct FitDrawing {
    PicturePage *page;
    const PictureOptions *options;
    const ModelField *model;
    const VesselTree *tree;    // its nodes
    const TriangleMesh *mesh;
    double *distance;          // (P) [mm] > 0 inside; NaN if the node has no model
    double *sorted;            // |distance|, ascending, finite values only
    int64_t finite_count;
    double full_scale;         // [mm] ends of the colour map
    float *field;              // (SLICE_CELLS + 1)^2 scratch memory
} FitDrawing;

static Color map_diverging(double x) { return color_diverging(x); }

static bool find_distances(FitDrawing *drawing, const double *distance)
{
    const VesselTree *tree = drawing->tree;
    size_t points = (size_t)tree->point_count;
    drawing->distance = malloc((points + 1) * sizeof *drawing->distance);
    drawing->sorted = malloc((points + 1) * sizeof *drawing->sorted);
    drawing->field = malloc((SLICE_CELLS + 1) * (SLICE_CELLS + 1) * sizeof *drawing->field);
    if (!drawing->distance || !drawing->sorted || !drawing->field)
        return false;
    for (int i = 0; i < tree->node_count; i++)
        for (int64_t k = tree->point_offset[i]; k < tree->point_offset[i + 1]; k++) {
            double d = drawing->distance[k] = distance ? distance[k] : model_field_distance(drawing->model, i, tree->point[k]);
            if (isfinite(d))
                drawing->sorted[drawing->finite_count++] = fabs(d);
        }
    sort_doubles(drawing->sorted, (size_t)drawing->finite_count);
    return true;
}

static double percentile(const FitDrawing *drawing, double part)
{
    return drawing->finite_count > 0 ? drawing->sorted[(int64_t)(part * (double)(drawing->finite_count - 1) + 0.5)] : 0;
}

static bool draw_surface(FitDrawing *drawing, double x, double y, int width, int height)
{
    PicturePage *page = drawing->page;
    const VesselTree *tree = drawing->tree;
    double s = page->scale;
    if (drawing->mesh && drawing->mesh->vertex_count > 0 && tree->point_count > 0) {
        double *error = malloc((size_t)drawing->mesh->vertex_count * sizeof *error);
        bool drawn = error && surface_point_error(drawing->mesh, drawing->model, error, NULL) &&
                     picture_page_error_surface(page, drawing->options, drawing->mesh, error, drawing->full_scale, x, y, width, height);
        free(error);
        return drawn || message_fail(page->message, page->capacity, "out of memory for a picture");
    }
    const Vec3 *shown = tree->point_count > 0 ? tree->point : tree->center;
    int shown_count = shown == tree->center ? tree->node_count : (int)tree->point_count;
    Camera camera = {0};
    camera_orient(&camera, drawing->options->view, drawing->options->up, shown_count, shown);
    camera_frame(&camera, width, height, 28 * s, shown_count, shown, 0);
    if (drawing->options->focus_radius > 0)
        camera_frame_sphere(&camera, width, height, 8 * s, drawing->options->focus, drawing->options->focus_radius);
    GlCanvas *panel = picture_page_begin_panel(page, width, height);
    ViewPoint *point = malloc(((size_t)tree->point_count + 1) * sizeof *point);
    if (!panel || !point) {
        free(point);
        return panel ? message_fail(page->message, page->capacity, "out of memory for a picture") : false;
    }
    // half the point spacing on a vessel of mean size, so that single points are visible and none hides its neighbours
    double size = fmin(fmax(0.22 / camera.mm_per_pixel, 1.6 * s), 9 * s);
    int count = 0;
    for (int64_t k = 0; k < tree->point_count; k++) {
        if (!isfinite(drawing->distance[k]) || !vec3_is_finite(tree->point[k]))
            continue;
        Vec3 d = vec3_sub(tree->point[k], camera.center);
        point[count++] = (ViewPoint){{(float)d.x, (float)d.y, (float)d.z}, color_diverging(drawing->distance[k] / drawing->full_scale), (float)size};
    }
    surface_view_draw_points(page->view, &camera, camera.center, count, point);
    picture_page_end_panel(page, panel, x, y);
    picture_page_scale_bar(page, x + 16 * s, y + height - 14 * s, 0.22 * width, camera.mm_per_pixel, PAGE_INK);
    free(point);
    return true;
}

static void draw_histogram(FitDrawing *drawing, double x, double y, double width, double height)
{
    PicturePage *page = drawing->page;
    int64_t bin[BINS] = {0}, most = 1, beyond = 0;
    for (int64_t k = 0; k < drawing->tree->point_count; k++) {
        double place = (drawing->distance[k] / drawing->full_scale + 1) / 2 * BINS;
        if (!isfinite(place))
            continue;
        beyond += place < 0 || place >= BINS;
        bin[place < 0 ? 0 : place >= BINS ? BINS - 1 : (int)place]++;
    }
    for (int i = 0; i < BINS; i++)
        most = bin[i] > most ? bin[i] : most;
    overlay_fill(page->overlay, x, y, width, height, PAGE_PANEL);
    for (int i = 0; i < BINS; i++) {
        double tall = (height - 6 * page->scale) * (double)bin[i] / (double)most;
        Color color = color_diverging((i + 0.5) / BINS * 2 - 1);
        overlay_fill(page->overlay, x + width * i / BINS, y + height - tall, width / BINS - 1, tall, color);
        overlay_rectangle(page->overlay, x + width * i / BINS, y + height - tall, width / BINS - 1, tall, color_with_alpha(PAGE_MUTED, 0.5), 1);
    }
    overlay_line(page->overlay, x + width / 2, y, x + width / 2, y + height, PAGE_MUTED, page->scale);
    if (beyond > 0)
        picture_page_text(page, x + 6 * page->scale, y + 4 * page->scale, TEXT_SMALL, PAGE_MUTED, "%lld outside this range", (long long)beyond);
}

// The zero of the field on the edge between two corners.
static void crossing(const double a[2], double fa, const double b[2], double fb, double out[2])
{
    double t = fa / (fa - fb);
    out[0] = a[0] + t * (b[0] - a[0]);
    out[1] = a[1] + t * (b[1] - a[1]);
}

typedef struct Slice {
    Vec3 center, along, across, normal;
    double half;               // [mm] half of the side
    double x, y, side;         // on the page
} Slice;

static void draw_contour(FitDrawing *drawing, const Slice *slice, int node, Color color, double thickness)
{
    if (!drawing->model->swept && blobby_of(drawing->tree, node).count < 1)
        return;
    const int n = SLICE_CELLS + 1;
    for (int j = 0; j < n; j++)
        for (int i = 0; i < n; i++) {
            double u = slice->half * (2.0 * i / SLICE_CELLS - 1), v = slice->half * (1 - 2.0 * j / SLICE_CELLS);
            Vec3 x = vec3_add_scaled(vec3_add_scaled(slice->center, u, slice->along), v, slice->across);
            drawing->field[j * n + i] = (float)model_field_at(drawing->model, node, x, NULL);
        }
    double cell = slice->side / SLICE_CELLS;
    for (int j = 0; j < SLICE_CELLS; j++)
        for (int i = 0; i < SLICE_CELLS; i++) {
            const double corner[4][2] = {{slice->x + i * cell, slice->y + j * cell},
                                         {slice->x + (i + 1) * cell, slice->y + j * cell},
                                         {slice->x + (i + 1) * cell, slice->y + (j + 1) * cell},
                                         {slice->x + i * cell, slice->y + (j + 1) * cell}};
            const double f[4] = {drawing->field[j * n + i], drawing->field[j * n + i + 1], drawing->field[(j + 1) * n + i + 1],
                                 drawing->field[(j + 1) * n + i]};
            double cut[4][2];
            int cuts = 0;
            for (int k = 0; k < 4; k++)
                if ((f[k] > 0) != (f[(k + 1) % 4] > 0))
                    crossing(corner[k], f[k], corner[(k + 1) % 4], f[(k + 1) % 4], cut[cuts++]);
            for (int k = 0; k + 1 < cuts; k += 2)
                overlay_line(drawing->page->overlay, cut[k][0], cut[k][1], cut[k + 1][0], cut[k + 1][1], color, thickness);
        }
}

static void slice_place(const Slice *slice, Vec3 point, double *x, double *y, double *off)
{
    Vec3 d = vec3_sub(point, slice->center);
    double scale = slice->side / (2 * slice->half);
    *x = slice->x + slice->side / 2 + scale * vec3_dot(d, slice->along);
    *y = slice->y + slice->side / 2 - scale * vec3_dot(d, slice->across);
    *off = vec3_dot(d, slice->normal);
}

static void draw_slice(FitDrawing *drawing, int node, double x, double y, double side)
{
    PicturePage *page = drawing->page;
    const VesselTree *tree = drawing->tree;
    double s = page->scale, r = tree->radius[node], worst = -1;
    Slice slice = {.center = tree->center[node], .along = tree->direction[node], .half = 3 * r, .x = x, .y = y + 20 * s, .side = side - 20 * s};
    Vec3 aside = vec3_normal_to(slice.along);
    for (int64_t k = tree->point_offset[node]; k < tree->point_offset[node + 1]; k++) {
        Vec3 d = vec3_sub(tree->point[k], slice.center), off = vec3_add_scaled(d, -vec3_dot(d, slice.along), slice.along);
        if (fabs(drawing->distance[k]) > worst && vec3_norm(off) > 0.1 * r) {
            worst = fabs(drawing->distance[k]);
            aside = vec3_unit(off);
        }
    }
    slice.across = aside;
    slice.normal = vec3_cross(slice.along, aside);
    picture_page_text(page, x, y, TEXT_SMALL, PAGE_INK, "%d: r %.2f, error %.2f mm", model_field_file_node(drawing->model, node), r,
                      tree->error ? tree->error[node] : NAN);
    overlay_fill(page->overlay, slice.x, slice.y, slice.side, slice.side, PAGE_PANEL);
    overlay_push_clip(page->overlay, slice.x, slice.y, slice.side, slice.side);
    double px, py, off, scale = slice.side / (2 * slice.half);
    for (int64_t b = tree->blob_offset[node]; b < tree->blob_offset[node + 1]; b++) {
        slice_place(&slice, tree->blob_center[b], &px, &py, &off);
        double radius = blob_radius(tree->blob_width[b], tree->iso_level) * scale;
        if (radius > 0)
            overlay_circle(page->overlay, px, py, radius, (Color){0, 158, 115, 70}, 1.2 * s);
        overlay_line(page->overlay, px - 3 * s, py, px + 3 * s, py, (Color){0, 120, 90, 200}, s);
        overlay_line(page->overlay, px, py - 3 * s, px, py + 3 * s, (Color){0, 120, 90, 200}, s);
    }
    for (int i = 0; i < tree->node_count; i++)
        if (tree->parent[i] == node || tree->parent[node] == i)
            draw_contour(drawing, &slice, i, (Color){150, 154, 160, 150}, s);
    draw_contour(drawing, &slice, node, PAGE_INK, 1.8 * s);
    for (int64_t k = tree->point_offset[node]; k < tree->point_offset[node + 1]; k++) {
        slice_place(&slice, tree->point[k], &px, &py, &off);
        if (fabs(off) > 0.3 * r || !isfinite(drawing->distance[k]))
            continue;
        overlay_disc(page->overlay, px, py, 3.2 * s, color_with_alpha(PAGE_INK, 0.7));
        overlay_disc(page->overlay, px, py, 2.5 * s, color_diverging(drawing->distance[k] / drawing->full_scale));
    }
    overlay_pop_clip(page->overlay);
    overlay_rectangle(page->overlay, slice.x, slice.y, slice.side, slice.side, PAGE_FAINT, s);
    char blobs[32] = "";
    if (!drawing->model->swept)
        snprintf(blobs, sizeof blobs, "%d blobs", blobby_of(tree, node).count);
    picture_page_label(page, slice.x + slice.side - 6 * s, slice.y + slice.side - 22 * s, 1, TEXT_SMALL, PAGE_MUTED, blobs);
    picture_page_scale_bar(page, slice.x + 8 * s, slice.y + slice.side - 6 * s, 0.3 * slice.side, 1 / scale, PAGE_INK);
}

// Chooses the largest errors first, and none next to one already chosen.
static int choose_worst(const ModelField *model, int most, int chosen[WORST_MOST])
{
    const VesselTree *tree = model->tree;
    int count = 0;
    while (tree->error && count < most && count < WORST_MOST) {
        int best = -1;
        for (int i = 0; i < tree->node_count; i++) {
            bool near_other = (!model->swept && blobby_of(tree, i).count < 1) || !isfinite(tree->error[i]);
            for (int k = 0; k < count; k++)
                near_other = near_other || vec3_distance(tree->center[i], tree->center[chosen[k]]) < 1.5 * tree->radius[chosen[k]];
            if (!near_other && (best < 0 || tree->error[i] > tree->error[best]))
                best = i;
        }
        if (best < 0)
            break;
        chosen[count++] = best;
    }
    return count;
}

static bool draw_fit(FitDrawing *drawing)
{
    PicturePage *page = drawing->page;
    const VesselTree *tree = drawing->tree;
    int chosen[WORST_MOST], worst = choose_worst(drawing->model, drawing->options->worst_count, chosen);
    double s = page->scale, gap = 20 * s, top = 62 * s, column = (worst > 0 ? 0.42 : 0.28) * page->width, left = page->width - gap - column;
    if (!draw_surface(drawing, gap, top, (int)(left - 2 * gap), (int)(page->height - top - gap)))
        return false;
    picture_page_title(page, gap, 18 * s, page->width - 2 * gap, drawing->options->title);

    double tall = 120 * s, y = top;
    draw_histogram(drawing, left, y, column, tall);
    y += tall + 8 * s;
    char title[128];
    snprintf(title, sizeof title, "signed distance [mm]: blue outside the model, red inside");
    picture_page_color_bar(page, left, y, column, 12 * s, map_diverging, -1, -drawing->full_scale, drawing->full_scale, title);
    y += 66 * s;
    picture_page_text(page, left, y, TEXT_NORMAL, PAGE_INK, "%lld points, |distance| median %.3f, 90 %% %.3f, 99 %% %.3f, max %.2f mm",
                      (long long)drawing->finite_count, percentile(drawing, 0.5), percentile(drawing, 0.9), percentile(drawing, 0.99), percentile(drawing, 1));
    if (drawing->model->swept)
        picture_page_text(page, left, y + 23 * s, TEXT_NORMAL, PAGE_INK, "%d branches, %d sections", drawing->model->swept->branch_count,
                          drawing->model->swept->break_count);
    else
        picture_page_text(page, left, y + 23 * s, TEXT_NORMAL, PAGE_INK, "%d nodes, %lld blobs, %.1f per node", tree->node_count, (long long)tree->blob_count,
                          (double)tree->blob_count / tree->node_count);
    y += 56 * s;
    if (worst < 1)
        return true;
    picture_page_text(page, left, y, TEXT_NORMAL, PAGE_MUTED, "nodes with the largest errors, cut through axis and worst point; walls of neighbours grey");
    y += 28 * s;
    int best_columns = 1;
    double room = page->height - gap - y, best = 0;
    for (int columns = 1; columns <= worst; columns++) {
        int rows = (worst + columns - 1) / columns;
        double side = fmin((column + 10 * s) / columns - 10 * s + 20 * s, room / rows - 6 * s);
        if (side > best) {
            best = side;
            best_columns = columns;
        }
    }
    double pitch = (column - (best - 20 * s)) / fmax(1, best_columns - 1);
    for (int k = 0; k < worst; k++)
        draw_slice(drawing, chosen[k], left + (k % best_columns) * pitch, y + (k / best_columns) * (best + 6 * s), best);
    return true;
}

bool picture_of_fit(const char *path, const PictureOptions *options, const ModelField *model, const TriangleMesh *mesh, const double *distance, char *message,
                    size_t capacity)
{
    if (!model_field_exists(model) || model->tree->node_count < 1)
        return message_fail(message, capacity, "the tree has no fitted model to draw");
    PicturePage page;
    if (!picture_page_open(&page, options, options->height, message, capacity))
        return false;
    FitDrawing drawing = {.page = &page, .options = options, .model = model, .tree = model->tree, .mesh = mesh};
    bool drawn = find_distances(&drawing, distance) || message_fail(message, capacity, "out of memory for a picture");
    if (drawn) {
        double wide = percentile(&drawing, 0.98);
        drawing.full_scale = options->distance_full_scale > 0 ? options->distance_full_scale : wide > 0 ? picture_page_scale_end(wide) : 0.1;
    }
    drawn = drawn && draw_fit(&drawing) && picture_page_save(&page, path);
    free(drawing.distance);
    free(drawing.sorted);
    free(drawing.field);
    picture_page_close(&page);
    return drawn;
}
