// Every junction of a model in a small cell, the narrowest first: a section through the axis of the parent and the first nodes of the branch.
//
// The plane contains the joining line (to the right) and, as far as possible, the direction of the parent (up). The wall is the zero of the field as a tool
// meets it:
// each pixel corner is evaluated with the node reached by walking from the nearest node.
#include "render/message.h"
#include "geom/geom.h"
#include "render/picture_page.h"

#include <stdlib.h>
#include <string.h>

enum { CELLS = 96, COLUMNS = 6, ROWS = 4, NEAR_MOST = 400, GREY = 128 };

static const Color CAPPED = {200, 30, 30, 255}, NARROW = {225, 140, 20, 255}, OPEN = {150, 154, 160, 255}, LINE = {20, 110, 190, 255},
                   DATA = {214, 120, 0, 255}, LUMEN = {70, 160, 230, 60};

typedef struct JunctionCell {
    const ModelField *model;
    const VesselTree *tree;  // its nodes
    int near_count, near[NEAR_MOST];         // nodes whose balls may lie in the picture
    Vec3 center, along, across, normal;
    double half;             // [mm] half of the side
    double x, y, side;       // on the page
} JunctionCell;

typedef struct JunctionDrawing {
    PicturePage *page;
    const PictureJunctions *what;
    float low, high;         // values of the volume drawn black and white
    float *field;            // (CELLS + 1)^2
    uint8_t *grey;           // GREY^2
} JunctionDrawing;

// --- The plane ---

static void find_plane(const VesselTree *tree, const ReachJunction *junction, JunctionCell *cell)
{
    Vec3 from = tree->center[junction->parent], to = tree->center[junction->last];
    double length = vec3_distance(from, to), r = tree->radius[junction->node];
    cell->along = vec3_unit_or(vec3_sub(to, from), tree->direction[junction->node]);
    Vec3 up = tree->direction[junction->parent];
    up = vec3_add_scaled(up, -vec3_dot(up, cell->along), cell->along);
    cell->across = vec3_norm(up) > 0.1 ? vec3_unit(up) : vec3_normal_to(cell->along);
    cell->normal = vec3_cross(cell->along, cell->across);
    cell->half = fmax(3 * r, 0.6 * length + 1.5 * r);
    cell->center = vec3_add_scaled(from, 0.55 * length, cell->along);
}

static void find_near(const ModelField *model, JunctionCell *cell)
{
    const VesselTree *tree = model->tree;
    cell->model = model, cell->tree = tree;
    cell->near_count = 0;
    for (int i = 0; i < tree->node_count && cell->near_count < NEAR_MOST; i++)
        if (vec3_distance(tree->center[i], cell->center) < 1.5 * cell->half + 1.5 * tree->radius[i])
            cell->near[cell->near_count++] = i;
}

static int nearest_node(const JunctionCell *cell, Vec3 x)
{
    int best = -1;
    double least = HUGE_VAL;
    for (int k = 0; k < cell->near_count; k++) {
        double d = power_distance(x, cell->tree->center[cell->near[k]], cell->tree->radius[cell->near[k]]);
        if (d < least)
            least = d, best = cell->near[k];
    }
    return best;
}

// The field at (u, v) of the plane; below 0 if there is no node nearby.
static double field_in_plane(const JunctionCell *cell, double u, double v)
{
    Vec3 x = vec3_add_scaled(vec3_add_scaled(cell->center, u, cell->along), v, cell->across);
    int node = nearest_node(cell, x);
    return node < 0 ? -1 : reach_field(cell->model, x, &node);
}

static void place(const JunctionCell *cell, Vec3 point, double *x, double *y, double *off)
{
    Vec3 d = vec3_sub(point, cell->center);
    double scale = cell->side / (2 * cell->half);
    *x = cell->x + cell->side / 2 + scale * vec3_dot(d, cell->along);
    *y = cell->y + cell->side / 2 - scale * vec3_dot(d, cell->across);
    *off = vec3_dot(d, cell->normal);
}

// --- Layers of a cell ---

static double trilinear(const PictureJunctions *what, const Mat3 *to_voxel, Vec3 x, bool *inside)
{
    Vec3 p = mat3_mul_vec(to_voxel, vec3_sub(x, what->origin));
    double c[3] = {p.x, p.y, p.z}, sum = 0;
    int at[3];
    *inside = true;
    for (int a = 0; a < 3; a++) {
        at[a] = (int)floor(c[a]);
        c[a] -= at[a];
        *inside = *inside && at[a] >= 0 && at[a] + 1 < what->size[a];
    }
    for (int k = 0; *inside && k < 8; k++) {
        size_t i = (size_t)(at[0] + (k & 1)), j = (size_t)(at[1] + (k >> 1 & 1)), l = (size_t)(at[2] + (k >> 2));
        double weight = (k & 1 ? c[0] : 1 - c[0]) * (k & 2 ? c[1] : 1 - c[1]) * (k & 4 ? c[2] : 1 - c[2]);
        sum += weight * (double)what->value[(l * (size_t)what->size[1] + j) * (size_t)what->size[0] + i];
    }
    return sum;
}

static Mat3 inverse_of(const Vec3 axis[3])
{
    Vec3 x = vec3_cross(axis[1], axis[2]), y = vec3_cross(axis[2], axis[0]), z = vec3_cross(axis[0], axis[1]);
    double s = 1 / vec3_dot(axis[0], x);
    return (Mat3){{{s * x.x, s * x.y, s * x.z}, {s * y.x, s * y.y, s * y.z}, {s * z.x, s * z.y, s * z.z}}};
}

static void draw_image(JunctionDrawing *drawing, const JunctionCell *cell)
{
    const PictureJunctions *what = drawing->what;
    if (!what->value)
        return;
    Mat3 to_voxel = inverse_of(what->axis);
    for (int j = 0; j < GREY; j++)
        for (int i = 0; i < GREY; i++) {
            double u = cell->half * ((2 * i + 1.0) / GREY - 1), v = cell->half * ((2 * j + 1.0) / GREY - 1);
            bool inside;
            double value = trilinear(what, &to_voxel, vec3_add_scaled(vec3_add_scaled(cell->center, u, cell->along), v, cell->across), &inside);
            double share = (value - (double)drawing->low) / (double)(drawing->high - drawing->low);
            share = share > 0 ? share < 1 ? share : 1 : 0;
            drawing->grey[j * GREY + i] = (uint8_t)(inside ? 225 * pow(share, 0.6) + 0.5 : 0);   // gamma below 1, because thin branches are faint
        }
    unsigned texture = picture_page_grey_texture(drawing->page, GREY, GREY, drawing->grey);
    if (texture)
        overlay_image(drawing->page->overlay, texture, cell->x, cell->y, cell->side, cell->side, true);
}

static void draw_wall(JunctionDrawing *drawing, const JunctionCell *cell)
{
    const int n = CELLS + 1;
    Overlay *overlay = drawing->page->overlay;
    double s = drawing->page->scale, pixel = cell->side / CELLS;
    bool over_image = drawing->what->value != NULL;
    for (int j = 0; j < n; j++)
        for (int i = 0; i < n; i++)
            drawing->field[j * n + i] = (float)field_in_plane(cell, cell->half * (2.0 * i / CELLS - 1), cell->half * (1 - 2.0 * j / CELLS));
    for (int j = 0; j < CELLS; j++)
        for (int i = 0; i < CELLS; i++) {
            const double corner[4][2] = {{cell->x + i * pixel, cell->y + j * pixel},
                                         {cell->x + (i + 1) * pixel, cell->y + j * pixel},
                                         {cell->x + (i + 1) * pixel, cell->y + (j + 1) * pixel},
                                         {cell->x + i * pixel, cell->y + (j + 1) * pixel}};
            const double f[4] = {drawing->field[j * n + i], drawing->field[j * n + i + 1], drawing->field[(j + 1) * n + i + 1],
                                 drawing->field[(j + 1) * n + i]};
            double cut[4][2];
            int cuts = 0;
            for (int k = 0; k < 4; k++) {
                int next = (k + 1) % 4;
                if ((f[k] > 0) == (f[next] > 0))
                    continue;
                double t = f[k] / (f[k] - f[next]);
                cut[cuts][0] = corner[k][0] + t * (corner[next][0] - corner[k][0]);
                cut[cuts++][1] = corner[k][1] + t * (corner[next][1] - corner[k][1]);
            }
            if (!over_image && f[0] > 0)
                overlay_fill(overlay, corner[0][0], corner[0][1], pixel, pixel, LUMEN);
            for (int k = 0; k + 1 < cuts; k += 2)
                overlay_line(overlay, cut[k][0], cut[k][1], cut[k + 1][0], cut[k + 1][1], over_image ? (Color){80, 220, 255, 255} : PAGE_INK, 1.6 * s);
        }
}

static void draw_tree(JunctionDrawing *drawing, const JunctionCell *cell)
{
    const VesselTree *tree = cell->tree;
    Overlay *overlay = drawing->page->overlay;
    double s = drawing->page->scale, x, y, off, x1, y1, off1;
    for (int k = 0; k < cell->near_count; k++) {
        int node = cell->near[k], parent = tree->parent[node];
        for (int64_t i = tree->point_offset[node]; i < tree->point_offset[node + 1]; i++) {
            place(cell, tree->point[i], &x, &y, &off);
            if (fabs(off) < 0.04 * cell->half)
                overlay_disc(overlay, x, y, 1.3 * s, DATA);
        }
        place(cell, tree->center[node], &x, &y, &off);
        if (fabs(off) > 0.5 * tree->radius[node])
            continue;
        if (parent >= 0) {
            place(cell, tree->center[parent], &x1, &y1, &off1);
            overlay_line(overlay, x, y, x1, y1, LINE, 1.2 * s);
        }
        overlay_disc(overlay, x, y, 1.8 * s, LINE);
    }
}

static void draw_cell(JunctionDrawing *drawing, const ModelField *of, const ReachJunction *junction, const ModelField *in, double clearance, Vec3 where,
                      const char *label, double x, double y, double side)
{
    PicturePage *page = drawing->page;
    double s = page->scale, head = 20 * s, tool = drawing->what->tool_radius, px, py, off;
    JunctionCell cell = {.x = x, .y = y + head, .side = side - head};
    Color color = clearance < 0 ? CAPPED : clearance < tool ? NARROW : OPEN;
    find_plane(of->tree, junction, &cell);
    find_near(in, &cell);
    picture_page_text(page, x, y, TEXT_SMALL, PAGE_INK, "%s%d: %s%.2f mm%s", label, model_field_file_node(of, junction->node), clearance < 0 ? "capped, " : "",
                      clearance, junction->apart ? ", apart" : "");
    overlay_fill(page->overlay, cell.x, cell.y, cell.side, cell.side, PAGE_PANEL);
    overlay_push_clip(page->overlay, cell.x, cell.y, cell.side, cell.side);
    draw_image(drawing, &cell);
    draw_wall(drawing, &cell);
    draw_tree(drawing, &cell);
    place(&cell, where, &px, &py, &off);
    overlay_circle(page->overlay, px, py, 6 * s, color, 2 * s);
    overlay_pop_clip(page->overlay);
    overlay_rectangle(page->overlay, cell.x, cell.y, cell.side, cell.side, color, (clearance < tool ? 3 : 1) * s);
    if (drawing->what->value)
        overlay_fill(page->overlay, cell.x + 2 * s, cell.y + cell.side - 32 * s, 0.35 * cell.side + 12 * s, 30 * s, (Color){0, 0, 0, 130});
    picture_page_scale_bar(page, cell.x + 6 * s, cell.y + cell.side - 6 * s, 0.35 * cell.side, 2 * cell.half / cell.side,
                           drawing->what->value ? (Color){255, 255, 255, 255} : PAGE_INK);
}

// --- Pages ---

static int compare_floats(const void *a, const void *b)
{
    float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

// Black: the median of the whole volume; white: its 99.9th percentile.
static bool choose_window(JunctionDrawing *drawing)
{
    const PictureJunctions *what = drawing->what;
    drawing->low = 0, drawing->high = 1;
    if (!what->value)
        return true;
    size_t count = (size_t)what->size[0] * (size_t)what->size[1] * (size_t)what->size[2], every = count / 200000 + 1, n = 0;
    float *sample = malloc((count / every + 1) * sizeof *sample);
    if (!sample)
        return false;
    for (size_t i = 0; i < count; i += every)
        sample[n++] = what->value[i];
    qsort(sample, n, sizeof *sample, compare_floats);
    drawing->low = sample[n / 2];
    drawing->high = sample[(size_t)(0.999 * (double)(n - 1))];
    if (!(drawing->high > drawing->low))
        drawing->high = drawing->low + 1;
    free(sample);
    return true;
}

static void page_path(const char *path, int page, char *out, size_t capacity)
{
    const char *dot = strrchr(path, '.'), *slash = strrchr(path, '/');
    int stem = (int)(dot && (!slash || dot > slash) ? (size_t)(dot - path) : strlen(path));
    if (page == 0)
        snprintf(out, capacity, "%s", path);
    else
        snprintf(out, capacity, "%.*s-%d%s", stem, path, page + 1, path + stem);
}

static void draw_head(JunctionDrawing *drawing, const char *title, int first, int end, int count)
{
    PicturePage *page = drawing->page;
    double s = page->scale;
    picture_page_title(page, 20 * s, 14 * s, page->width - 40 * s, title);
    picture_page_text(
        page, 20 * s, 42 * s, TEXT_SMALL, PAGE_MUTED,
        "junctions %d to %d of %d, narrowest first: section through parent's axis and branch; wall %s, centreline blue, data orange; frame red: capped, "
        "orange: less than %.2f mm",
        first + 1, end, count, drawing->what->value ? "light blue over the image" : "black, lumen tinted", drawing->what->tool_radius);
}

static bool draw_page(JunctionDrawing *drawing, const PictureOptions *options, int first, int end, int count)
{
    const PictureJunctions *what = drawing->what;
    PicturePage *page = drawing->page;
    double s = page->scale, gap = 12 * s, top = 66 * s, width = (page->width - gap) / COLUMNS - gap, height = (options->height - top) / ROWS - gap;
    double side = fmin(width + 20 * s, height);
    draw_head(drawing, options->title, first, end, count);
    for (int k = first; k < end; k++) {
        const ReachJunction *j = &what->junction[k];
        int slot = what->before ? 2 * (k - first) : k - first;
        double x = gap + (slot % COLUMNS) * (width + gap), y = top + (slot / COLUMNS) * (height + gap);
        if (what->before) {
            Vec3 where;
            double most = fmax(what->model->tree->radius[j->node], 2 * what->tool_radius),
                   before = reach_on_line(what->model->tree, j, what->before, most, &where);
            draw_cell(drawing, what->model, j, what->before, before, where, "before, ", x, y, side);
            x += width + gap;
        }
        draw_cell(drawing, what->model, j, what->model, j->clearance, j->place, what->before ? "after, " : "node ", x, y, side);
    }
    return true;
}

bool picture_of_junctions(const char *path, const PictureOptions *options, const PictureJunctions *what, int *pages, char *message, size_t capacity)
{
    enum { PATH = 4096 };
    char name[PATH];
    int each = what->before ? COLUMNS * ROWS / 2 : COLUMNS * ROWS;
    *pages = 0;
    if (what->junction_count < 1)
        return message_fail(message, capacity, "the tree has no junction");
    if (strlen(path) + 16 > PATH)
        return message_fail(message, capacity, "the path is too long");
    for (int first = 0; first < what->junction_count; first += each, ++*pages) {
        int end = first + each < what->junction_count ? first + each : what->junction_count;
        PicturePage page;
        int slots = (end - first) * (what->before ? 2 : 1), rows = (slots + COLUMNS - 1) / COLUMNS;
        double top = 66 * picture_page_scale_of(options);
        if (!picture_page_open(&page, options, (int)(top + (options->height - top) * rows / ROWS), message, capacity))
            return false;
        JunctionDrawing drawing = {.page = &page, .what = what, .field = malloc((CELLS + 1) * (CELLS + 1) * sizeof(float)), .grey = malloc(GREY * GREY)};
        page_path(path, *pages, name, sizeof name);
        bool drawn = (drawing.field && drawing.grey && choose_window(&drawing)) || message_fail(message, capacity, "out of memory for a picture");
        drawn = drawn && draw_page(&drawing, options, first, end, what->junction_count) && picture_page_save(&page, name);
        free(drawing.field);
        free(drawing.grey);
        picture_page_close(&page);
        if (!drawn)
            return false;
    }
    return true;
}
