// The surface of a model coloured by its distance to the data, and the paper's Table 4 as a histogram.
#include "base/base.h"
#include "render/message.h"
#include "render/picture_page.h"

#include <stdlib.h>

enum { BINS = 50 };

static Color map_diverging(double x) { return color_diverging(x); }

// The end of the colour scale: the 98th percentile of |error|, rounded up.
static double find_scale(const PictureOptions *options, int count, const double *error)
{
    double *sorted = malloc(((size_t)count + 1) * sizeof *sorted), scale = 0;
    int finite = 0;
    for (int i = 0; sorted && i < count; i++)
        if (isfinite(error[i]))
            sorted[finite++] = fabs(error[i]);
    if (finite > 0) {
        sort_doubles(sorted, (size_t)finite);
        scale = sorted[(int)(0.98 * (finite - 1))];
    }
    free(sorted);
    return options->distance_full_scale > 0 ? options->distance_full_scale : scale > 0 ? picture_page_scale_end(scale) : 0.1;
}

bool picture_page_error_surface(PicturePage *page, const PictureOptions *options, const TriangleMesh *mesh, const double *error, double scale, double x,
                                double y, int width, int height)
{
    Camera camera = {0};
    camera_orient(&camera, options->view, options->up, mesh->vertex_count, mesh->vertex);
    camera_frame(&camera, width, height, 28 * page->scale, mesh->vertex_count, mesh->vertex, 0);
    if (options->focus_radius > 0)
        camera_frame_sphere(&camera, width, height, 8 * page->scale, options->focus, options->focus_radius);
    GlCanvas *panel = picture_page_begin_panel(page, width, height);
    ViewPoint *point = malloc((size_t)mesh->vertex_count * sizeof *point);
    if (!panel || !point) {
        free(point);
        return panel ? message_fail(page->message, page->capacity, "out of memory for a picture") : false;
    }
    double edge = 0;
    for (int t = 0; t < mesh->triangle_count; t++)
        edge += vec3_distance(mesh->vertex[mesh->triangle[t][0]], mesh->vertex[mesh->triangle[t][1]]) / mesh->triangle_count;
    double size = fmax(1.8 * edge / camera.mm_per_pixel, 1.5 * page->scale);
    for (int v = 0; v < mesh->vertex_count; v++) {
        Vec3 d = vec3_sub(mesh->vertex[v], camera.center);
        Color color = isfinite(error[v]) ? color_diverging(error[v] / scale) : color_rgb(150, 154, 160);
        point[v] = (ViewPoint){{(float)d.x, (float)d.y, (float)d.z}, color, (float)size};
    }
    surface_view_draw_points(page->view, &camera, camera.center, mesh->vertex_count, point);
    picture_page_end_panel(page, panel, x, y);
    picture_page_scale_bar(page, x + 16 * page->scale, y + height - 14 * page->scale, 0.22 * width, camera.mm_per_pixel, PAGE_INK);
    free(point);
    return true;
}

// The paper's Table 4 as a histogram: `count` values `error` [mm] in voxels, classes C1 to C4 with their limits and shares; ticks below the box.
static void picture_page_class_chart(PicturePage *page, double x, double y, double width, double height, int count, const double *error, double voxel)
{
    static const double border[5] = {0, 0.5, 1, 2, 2.5};
    static const Color color[4] = {{0, 114, 90, 255}, {11, 95, 165, 255}, {213, 94, 0, 255}, {179, 0, 27, 255}};
    int bin[BINS] = {0}, in_class[4] = {0}, most = 1;
    double s = page->scale, end = border[4];
    for (int i = 0; i < count; i++) {
        double part = error[i] / voxel;
        if (!isfinite(part) || part < 0)
            continue;
        in_class[part < 0.5 ? 0 : part < 1 ? 1 : part < 2 ? 2 : 3]++;
        bin[part < end ? (int)(part / end * BINS) : BINS - 1]++;
    }
    for (int k = 0; k < BINS; k++)
        most = bin[k] > most ? bin[k] : most;
    overlay_fill(page->overlay, x, y, width, height, PAGE_PANEL);
    for (int k = 0; k < BINS; k++) {
        double from = end * k / BINS, tall = bin[k] > 0 ? fmax((height - 30 * s) * bin[k] / most, 1.5 * s) : 0;
        overlay_fill(page->overlay, x + width * k / BINS, y + height - tall, width / BINS - 1, tall, color[from < 0.5 ? 0 : from < 1 ? 1 : from < 2 ? 2 : 3]);
    }
    for (int k = 0; k < 4; k++) {
        double left = x + width * border[k] / end, right = x + width * border[k + 1] / end;
        char text[64];
        if (k > 0)
            overlay_line(page->overlay, left, y, left, y + height, PAGE_INK, s);
        snprintf(text, sizeof text, "C%d %.1f %%", k + 1, count > 0 ? 100.0 * in_class[k] / count : 0);
        picture_page_text_anchored(page, 0.5 * (left + right), y + 4 * s, 0.5, TEXT_SMALL, color[k], text);
        snprintf(text, sizeof text, "%g", border[k]);
        picture_page_text_anchored(page, left, y + height + 4 * s, 0.5, TEXT_SMALL, PAGE_INK, text);
    }
    char text[96];
    snprintf(text, sizeof text, "d_a [voxels of %g mm], %d nodes, tallest bar %d", voxel, count, most);
    picture_page_text(page, x, y + height + 24 * s, TEXT_SMALL, PAGE_MUTED, "%s", text);
}

bool picture_of_error(const char *path, const PictureOptions *options, const ModelField *model, const TriangleMesh *mesh, const double *error, double voxel_mm,
                      char *message, size_t capacity)
{
    if (!model_field_exists(model) || !mesh || mesh->vertex_count < 1 || !error)
        return message_fail(message, capacity, "the model has no surface to draw");
    if (!(voxel_mm > 0) || !isfinite(voxel_mm))
        return message_fail(message, capacity, "the voxel size is %g mm; expected above 0", voxel_mm);
    for (int v = 0; v < mesh->vertex_count; v++)
        if (!vec3_is_finite(mesh->vertex[v]))
            return message_fail(message, capacity, "vertex %d is not a finite number: nothing is drawn", v);
    PicturePage page;
    if (!picture_page_open(&page, options, options->height, message, capacity))
        return false;
    double s = page.scale, gap = 20 * s, top = 62 * s, column = 0.3 * page.width, left = page.width - gap - column;
    double scale = find_scale(options, mesh->vertex_count, error);
    bool drawn = picture_page_error_surface(&page, options, mesh, error, scale, gap, top, (int)(left - 2 * gap), (int)(page.height - top - gap));
    if (drawn) {
        picture_page_title(&page, gap, 18 * s, page.width - 2 * gap, options->title ? options->title : "distance of the surface to the data");
        picture_page_color_bar(&page, left, top + 4 * s, column, 12 * s, map_diverging, -1, -scale, scale,
                               "data to surface [mm]: blue outside the model, red inside");
        picture_page_text(&page, left, top + 90 * s, TEXT_NORMAL, PAGE_INK, "nodes by distance to their data (Table 4)");
        picture_page_class_chart(&page, left, top + 120 * s, column, 240 * s, model->tree->node_count, model->tree->error, voxel_mm);
        drawn = picture_page_save(&page, path);
    }
    picture_page_close(&page);
    return drawn;
}
