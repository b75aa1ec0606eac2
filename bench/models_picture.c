// The wall is the zero line of the distance on a grid, by marching squares.
#include "bench/models_picture.h"

#include "geom/power_walk.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

enum { CELL = 176, GAP = 8, LEFT = 96, HEAD = 40, GRID = 110, MOST_ROWS = 8 };

// --- Planes ---

static int neighbours(const VesselTree *tree, int node) { return tree->neighbour_offset[node + 1] - tree->neighbour_offset[node]; }

static void span_plane(Vec3 right, Vec3 other, PictureView *out)
{
    out->right = vec3_unit(right);
    Vec3 up = vec3_add_scaled(other, -vec3_dot(other, out->right), out->right);
    out->up = vec3_norm(up) > 1e-3 * vec3_norm(other) ? vec3_unit(up) : vec3_normal_to(out->right);
}

bool picture_view_across(const VesselTree *tree, PictureView *out)
{
    int node = tree->node_count / 2;
    out->center = tree->center[node], out->half = 1.7 * tree->radius[node];
    out->right = vec3_normal_to(tree->direction[node]), out->up = vec3_cross(tree->direction[node], out->right);
    return tree->kind[node] == NODE_VESSEL;
}

bool picture_view_fork(const VesselTree *tree, PictureView *out)
{
    for (int i = 1; i + 1 < tree->node_count; i++) {
        int fork = tree->parent[i];
        if (tree->kind[i] != NODE_VESSEL || fork <= 0 || fork == i - 1 || neighbours(tree, fork) < 3 || tree->kind[fork] != NODE_VESSEL)
            continue;
        int along = i;       // some radii down the branch
        while (along + 1 < tree->node_count && tree->parent[along + 1] == along &&
               vec3_distance(tree->center[along], tree->center[fork]) < 3 * tree->radius[fork])
            along++;
        out->center = vec3_mix(tree->center[fork], tree->center[along], 0.5), out->half = 3 * tree->radius[fork];
        span_plane(tree->direction[fork], vec3_sub(tree->center[along], tree->center[fork]), out);
        return true;
    }
    return false;
}

bool picture_view_sac(const VesselTree *tree, PictureView *out)
{
    for (int i = 1; i < tree->node_count; i++) {
        int neck = tree->parent[i];
        if (tree->kind[i] != NODE_ANEURYSM || tree->kind[neck] != NODE_VESSEL)
            continue;
        out->center = vec3_mix(tree->center[neck], tree->center[i], 0.6), out->half = 1.2 * tree->radius[i] + 1.2 * tree->radius[neck];
        span_plane(tree->direction[neck], vec3_sub(tree->center[i], tree->center[neck]), out);
        return true;
    }
    return false;
}

// --- Cells ---

typedef struct Cell {
    const PictureView *view;
    const VesselTree *tree;
    const FittedModel *model;
    double *value;           // (GRID + 1)^2
} Cell;

static Vec3 point_of(const PictureView *view, double i, double j)
{
    double u = view->half * (2 * i / GRID - 1), v = view->half * (1 - 2 * j / GRID);
    return vec3_add_scaled(vec3_add_scaled(view->center, u, view->right), v, view->up);
}

static void look_at_row(void *context, long j)
{
    Cell *cell = context;
    int node = 0;
    for (int i = 0; i <= GRID; i++) {
        Vec3 x = point_of(cell->view, i, (double)j);
        node = power_nearest(cell->tree, x);
        double gap = fitted_model_look(cell->model, cell->tree, node, x).gap;
        cell->value[j * (GRID + 1) + i] = isfinite(gap) ? gap : -1;
    }
}

// Where the zero line crosses the side from a to b.
static void side_point(double x, double y, const double value[4], int side, double out[2])
{
    static const int from[4] = {0, 1, 3, 2}, to[4] = {1, 3, 2, 0};       // corners: 0 upper left, 1 upper right, 2 lower left, 3 lower right
    int a = from[side], b = to[side];
    double share = value[a] / (value[a] - value[b]);
    out[0] = x + (a & 1) + share * ((b & 1) - (a & 1)), out[1] = y + (a >> 1) + share * ((b >> 1) - (a >> 1));
}

static void draw_wall(FILE *out, double x0, double y0, const double *value)
{
    const double scale = (double)CELL / GRID;
    static const int from[4] = {0, 1, 3, 2}, to[4] = {1, 3, 2, 0};
    fprintf(out, "<path class='wall' d='");
    for (int j = 0; j < GRID; j++)
        for (int i = 0; i < GRID; i++) {
            const double *v = value + j * (GRID + 1) + i, corner[4] = {v[0], v[1], v[GRID + 1], v[GRID + 2]};
            double end[4][2];
            int found = 0;
            for (int side = 0; side < 4; side++)
                if ((corner[from[side]] > 0) != (corner[to[side]] > 0))
                    side_point(i, j, corner, side, end[found++]);
            for (int k = 0; k + 1 < found; k += 2)
                fprintf(out, "M%.1f %.1fL%.1f %.1f", x0 + scale * end[k][0], y0 + scale * end[k][1], x0 + scale * end[k + 1][0], y0 + scale * end[k + 1][1]);
        }
    fprintf(out, "'/>\n");
}

static void draw_points(FILE *out, double x0, double y0, const PictureView *view, const VesselTree *tree)
{
    static const double NEAR = 0.06;         // [half sides] distance from the plane
    Vec3 normal = vec3_cross(view->right, view->up);
    fprintf(out, "<g class='point'>");
    for (int64_t p = 0; p < tree->point_count; p++) {
        Vec3 d = vec3_sub(tree->point[p], view->center);
        double u = vec3_dot(d, view->right) / view->half, v = vec3_dot(d, view->up) / view->half;
        if (fabs(vec3_dot(d, normal)) < NEAR * view->half && fabs(u) < 1 && fabs(v) < 1)
            fprintf(out, "<circle cx='%.1f' cy='%.1f' r='1.3'/>", x0 + 0.5 * CELL * (1 + u), y0 + 0.5 * CELL * (1 - v));
    }
    fprintf(out, "</g>\n");
}

// --- File ---

// The head has the same length for every number of rows, so that it can be written again at the end.
static void write_head(FILE *out, int rows)
{
    int width = LEFT + MODEL_KINDS * (CELL + GAP), height = HEAD + rows * (CELL + GAP);
    fprintf(out, "<svg xmlns='http://www.w3.org/2000/svg' width='%d' height='%5d' viewBox='0 0 %d %5d'>\n<rect width='%d' height='%5d' fill='#f4f4f4'/>\n",
            width, height, width, height, width, height);
}

bool models_picture_open(ModelsPicture *picture, const char *path, Faults *faults)
{
    *picture = (ModelsPicture){.out = fopen(path, "w")};
    if (!picture->out) {
        faults_add(faults, path, 0, 0, "cannot be written: %s", strerror(errno));
        return false;
    }
    write_head(picture->out, 0);
    fprintf(picture->out, "<style>text{font:14px sans-serif;fill:#222}.wall{fill:none;stroke:#0072b2;stroke-width:1.6}.point{fill:#d55e00;fill-opacity:.55}"
                          ".cell{fill:#fff;stroke:#bbb}</style>\n");
    for (int i = 0; i < MODEL_KINDS; i++)
        fprintf(picture->out, "<text x='%d' y='26' text-anchor='middle'>%s</text>\n", LEFT + i * (CELL + GAP) + CELL / 2, model_kind[i].name);
    return true;
}

bool models_picture_row(ModelsPicture *picture, const PictureView *view, const VesselTree *tree, const FittedModel *models, int threads)
{
    int y = HEAD + picture->rows * (CELL + GAP);
    double *value = malloc((size_t)(GRID + 1) * (GRID + 1) * sizeof *value);
    if (!value || picture->rows == MOST_ROWS) {
        free(value);
        return false;
    }
    picture->rows++;
    fprintf(picture->out, "<text x='8' y='%d'>%s</text><text x='8' y='%d'>%.1f mm</text>\n", y + CELL / 2, view->name, y + CELL / 2 + 20, 2 * view->half);
    for (int i = 0; i < MODEL_KINDS; i++) {
        int x = LEFT + i * (CELL + GAP);
        Cell cell = {view, tree, &models[i], value};
        if (!models[i].vessel)
            continue;
        fprintf(picture->out, "<rect class='cell' x='%d' y='%d' width='%d' height='%d'/>\n", x, y, CELL, CELL);
        parallel_for(threads, GRID + 1, look_at_row, &cell, NULL);
        draw_points(picture->out, x, y, view, tree);
        draw_wall(picture->out, x, y, value);
    }
    free(value);
    return true;
}

bool models_picture_close(ModelsPicture *picture, const char *path, Faults *faults)
{
    fprintf(picture->out, "</svg>\n");
    rewind(picture->out);
    write_head(picture->out, picture->rows);
    bool good = !ferror(picture->out);
    good = fclose(picture->out) == 0 && good;
    if (!good)
        faults_add(faults, path, 0, 0, "cannot be written completely: %s", strerror(errno));
    return good;
}
