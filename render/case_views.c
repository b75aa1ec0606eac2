// See case_views.h.
#include "render/case_views.h"

#include "render/gl_canvas.h"
#include "render/key_sheet.h"
#include "render/message.h"
#include "render/surface_view.h"
#include "render/translation.h"

#include <epoxy/gl.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { SLICE_SIDE = 380, PROJECTION_SIDE = 400, MOVING_SIDE = 220 };     // samples along the longer side of a picture

typedef struct Picture {
    unsigned texture, framebuffer;
    int width, height;           // of the texture
    int rect_width, rect_height; // of the view, when it was drawn
    int number;                  // CaseState.pictures when it was drawn
    bool is_coarse;
    uint8_t *grey, *rgba;
    uint8_t *soft;               // grey without bone, of a slice of a CT
} Picture;

typedef struct CutLine {
    Vec3 a, b;
    int vertex;
} CutLine;

typedef struct Cut {             // of the wall by a slice
    const TriangleMesh *mesh;
    int number, count, capacity;
    CutLine *line;
} Cut;

struct CaseViews {
    Picture picture[CASE_VIEWS];
    Cut cut[3];
    SurfaceView *wall;
    GlCanvas canvas;
    const TriangleMesh *wall_mesh;       // drawn on the canvas
    int wall_number;
    ViewPoint *point;
    int point_count;
    double point_size;           // [mm]
};

static const float background[3] = {12 / 255.0f, 14 / 255.0f, 18 / 255.0f};

CaseViews *case_views_create(char *message, size_t capacity)
{
    CaseViews *v = calloc(1, sizeof *v);
    if (!v) {
        message_fail(message, capacity, "out of memory");
        return NULL;
    }
    for (int i = 0; i < CASE_VIEWS; i++) {
        v->picture[i].number = -1;
        glGenTextures(1, &v->picture[i].texture);
        glGenFramebuffers(1, &v->picture[i].framebuffer);
    }
    if (!(v->wall = surface_view_create(message, capacity))) {
        case_views_destroy(v);
        return NULL;
    }
    return v;
}

void case_views_destroy(CaseViews *v)
{
    if (!v)
        return;
    for (int i = 0; i < CASE_VIEWS; i++) {
        glDeleteFramebuffers(1, &v->picture[i].framebuffer);
        glDeleteTextures(1, &v->picture[i].texture);
        free(v->picture[i].grey);
        free(v->picture[i].soft);
        free(v->picture[i].rgba);
    }
    for (int i = 0; i < 3; i++)
        free(v->cut[i].line);
    if (v->wall)
        surface_view_destroy(v->wall);
    gl_canvas_destroy(&v->canvas);
    free(v->point);
    free(v);
}

// Grows with each change of what a view shows.
static int number_of(const CaseState *s, int view) { return s->pictures + (view == CASE_PROJECTION ? s->turned : 0); }

// --- pictures ---

static bool fit_picture(Picture *p, int width, int height)
{
    if (p->width == width && p->height == height)
        return true;
    free(p->grey);
    free(p->soft);
    free(p->rgba);
    p->grey = malloc((size_t)width * (size_t)height);
    p->soft = malloc((size_t)width * (size_t)height);
    p->rgba = malloc((size_t)width * (size_t)height * 4);
    p->width = width, p->height = height;
    glBindTexture(GL_TEXTURE_2D, p->texture);
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, width, height, 0, GL_RGBA, GL_UNSIGNED_BYTE, NULL);
    glBindTexture(GL_TEXTURE_2D, 0);
    glBindFramebuffer(GL_FRAMEBUFFER, p->framebuffer);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, p->texture, 0);
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    return p->grey && p->soft && p->rgba;
}

// Colours what is brighter in the volume than without bone, so that a user sees what is left out.
static void tint_bone(Picture *p, const CaseState *s, const Camera *camera)
{
    const Color tint = {150, 105, 60, 255};
    volume_slice(s->soft, camera, s->cursor, s->low, s->high, p->soft);
    for (int i = 0; i < p->width * p->height; i++) {
        const int grey = p->grey[i], more = grey > p->soft[i] ? grey - p->soft[i] : 0;
        uint8_t *out = p->rgba + 4 * (size_t)i;
        out[0] = (uint8_t)(grey - more + more * tint.r / 255);
        out[1] = (uint8_t)(grey - more + more * tint.g / 255);
        out[2] = (uint8_t)(grey - more + more * tint.b / 255);
    }
}

static bool update_picture(Picture *p, const CaseState *s, int view, GuiRect at, bool is_moving)
{
    bool is_projection = view == CASE_PROJECTION, is_coarse = is_projection && is_moving;
    int side = !is_projection ? SLICE_SIDE : is_coarse ? MOVING_SIDE : PROJECTION_SIDE;
    double scale = fmin(1, side / fmax((double)at.width, (double)at.height));
    int width = (int)fmax(1, (double)at.width * scale), height = (int)fmax(1, (double)at.height * scale);
    bool is_same = p->number == number_of(s, view) && p->rect_width == (int)at.width && p->rect_height == (int)at.height && p->is_coarse == is_coarse;
    if (is_same)
        return true;
    if (!fit_picture(p, width, height))
        return false;
    Camera camera = case_state_camera(s, view, width, height);
    // all voxels in the time that a user does not notice, once the picture stands still
    const size_t voxels_most = (size_t)1 << 25;
    const int *size = s->volume->size;
    bool is_whole = !is_coarse && (size_t)size[0] * (size_t)size[1] * (size_t)size[2] <= voxels_most;
    if (is_projection)
        volume_projection(is_whole || s->shows_bone ? case_state_projected(s) : s->reduced, &camera, s->low, s->high, 2, p->grey);
    else
        volume_slice(s->volume, &camera, s->cursor, s->low, s->high, p->grey);
    for (int i = 0; i < width * height; i++) {
        memset(p->rgba + 4 * (size_t)i, p->grey[i], 3);
        p->rgba[4 * (size_t)i + 3] = 255;
    }
    if (!is_projection && case_state_forbids_bone(s))
        tint_bone(p, s, &camera);
    glBindTexture(GL_TEXTURE_2D, p->texture);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
    glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, width, height, GL_RGBA, GL_UNSIGNED_BYTE, p->rgba);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
    glBindTexture(GL_TEXTURE_2D, 0);
    p->number = number_of(s, view), p->rect_width = (int)at.width, p->rect_height = (int)at.height, p->is_coarse = is_coarse;
    return true;
}

static void show_picture(const Picture *p, GuiRect at, int height)
{
    int left = (int)at.x, top = height - (int)at.y, bottom = height - (int)(at.y + at.height);
    glBindFramebuffer(GL_READ_FRAMEBUFFER, p->framebuffer);
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, 0);
    // its first row is the top one
    glBlitFramebuffer(0, 0, p->width, p->height, left, top, left + (int)at.width, bottom, GL_COLOR_BUFFER_BIT, GL_LINEAR);
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
}

// --- the wall ---

// From good over middling to bad, at none, a half and a whole voxel.
static Color error_color(double voxels)
{
    const Color stop[3] = {gui_colors.good, gui_colors.warning, gui_colors.bad};
    double at = fmin(fmax(2 * voxels, 0), 2);
    int low = at < 1 ? 0 : 1;
    double part = at - low;
    Color a = stop[low], b = stop[low + 1];
    return (Color){(uint8_t)(a.r + part * (b.r - a.r)), (uint8_t)(a.g + part * (b.g - a.g)), (uint8_t)(a.b + part * (b.b - a.b)), 255};
}

static Color node_color(const CaseState *s, const VesselTree *tree, int node)
{
    return tree->error && node >= 0 ? error_color(tree->error[node] / volume_voxel_size(s->volume)) : gui_colors.accent;
}

static bool set_points(CaseViews *v, const CaseState *s, const TriangleMesh *mesh, const VesselTree *tree)
{
    free(v->point);
    v->point_count = mesh->vertex_count;
    v->point = malloc(((size_t)mesh->vertex_count + 1) * sizeof *v->point);
    double edge = 0;
    for (int t = 0; t < mesh->triangle_count; t++)
        edge += vec3_distance(mesh->vertex[mesh->triangle[t][0]], mesh->vertex[mesh->triangle[t][1]]) / mesh->triangle_count;
    v->point_size = 1.8 * edge;
    for (int i = 0; v->point && i < mesh->vertex_count; i++) {
        Vec3 d = vec3_sub(mesh->vertex[i], s->camera.home_focus), n = mesh->normal[i];
        Color c = node_color(s, tree, mesh->node[i]);
        // lit from the front, above
        double light = 0.55 + 0.45 * fmax(0, vec3_dot(n, vec3_unit(vec3_sub(s->axes.superior, vec3_scale(s->axes.posterior, 2)))));
        v->point[i] = (ViewPoint){{(float)d.x, (float)d.y, (float)d.z}, {(uint8_t)(c.r * light), (uint8_t)(c.g * light), (uint8_t)(c.b * light), 255}, 1};
    }
    return v->point != NULL;
}

static bool draw_wall(CaseViews *v, const CaseState *s, GuiRect at, int height, char *message, size_t capacity)
{
    const TriangleMesh *mesh = case_builder_mesh(s->builder);
    const ModelField *field = case_builder_wall(s->builder);
    int width = (int)at.width, tall = (int)at.height, left = (int)at.x, bottom = height - (int)(at.y + at.height);
    if (!mesh || !field)
        return true;
    if (v->canvas.width != width || v->canvas.height != tall) {
        gl_canvas_destroy(&v->canvas);
        v->wall_number = -1;
        if (!gl_canvas_create(&v->canvas, width, tall, 1, message, capacity))
            return false;
    }
    if (v->wall_mesh != mesh && !set_points(v, s, mesh, field->tree))
        return message_fail(message, capacity, "out of memory");
    if (v->wall_mesh != mesh || v->wall_number != number_of(s, CASE_PROJECTION)) {
        Camera camera = case_state_camera(s, CASE_PROJECTION, width, tall);
        for (int i = 0; i < v->point_count; i++)
            v->point[i].size = (float)fmax(v->point_size / camera.mm_per_pixel, 1.5);
        gl_canvas_begin(&v->canvas, background);
        surface_view_draw_points(v->wall, &camera, s->camera.home_focus, v->point_count, v->point);
        gl_canvas_resolve(&v->canvas);
        v->wall_mesh = mesh;
        v->wall_number = number_of(s, CASE_PROJECTION);
    }
    glBindFramebuffer(GL_READ_FRAMEBUFFER, v->canvas.resolved);
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, 0);
    glBlitFramebuffer(0, 0, width, tall, left, bottom, left + width, bottom + tall, GL_COLOR_BUFFER_BIT, GL_NEAREST);
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    return true;
}

bool case_views_draw(CaseViews *v, const CaseState *s, const GuiRect *at, int height, bool is_moving, char *message, size_t capacity)
{
    if (!s->has_volume)
        return true;
    for (int i = 0; i < CASE_VIEWS; i++) {
        if (i == CASE_PROJECTION && s->shows_wall) {
            if (!draw_wall(v, s, at[i], height, message, capacity))
                return false;
            continue;
        }
        if (!update_picture(&v->picture[i], s, i, at[i], is_moving))
            return message_fail(message, capacity, "out of memory");
        show_picture(&v->picture[i], at[i], height);
    }
    return true;
}

// --- over the pictures ---

typedef struct Over {            // what is drawn over one view
    Gui *gui;
    const CaseState *s;
    GuiRect at;
    Camera camera;
    int view;
    float k;                     // scale
} Over;

static void place_of(const Over *o, Vec3 x, float *px, float *py)
{
    Vec3 p = camera_project(&o->camera, x);
    *px = o->at.x + (float)p.x;
    *py = o->at.y + (float)p.y;
}

// How far a point lies in front of the slice [mm]; 0 in the projection.
static double depth_of(const Over *o, Vec3 x) { return o->view == CASE_PROJECTION ? 0 : vec3_dot(vec3_sub(x, o->s->cursor), o->camera.back); }

static void line(const Over *o, Vec3 a, Vec3 b, Color color, float thick)
{
    float x0, y0, x1, y1;
    place_of(o, a, &x0, &y0);
    place_of(o, b, &x1, &y1);
    gui_draw_line(o->gui, x0, y0, x1, y1, color, thick);
}

static void ring(const Over *o, Vec3 x, double radius_mm, Color color, float thick)
{
    enum { SIDES = 16 };
    float cx, cy, r = (float)(radius_mm / o->camera.mm_per_pixel);
    place_of(o, x, &cx, &cy);
    for (int i = 0; i < SIDES; i++) {
        float a = (float)(2 * PI * i / SIDES), b = (float)(2 * PI * (i + 1) / SIDES);
        gui_draw_line(o->gui, cx + r * cosf(a), cy + r * sinf(a), cx + r * cosf(b), cy + r * sinf(b), color, thick);
    }
}

// A node in a slice: the circle in which the slice cuts its ball.
static void node_over_slice(const Over *o, Vec3 x, double radius, Color color)
{
    double depth = depth_of(o, x);
    if (fabs(depth) < radius)
        ring(o, x, sqrt(radius * radius - depth * depth), color, 1.2f * o->k);
}

static void draw_growing(const Over *o)
{
    const CaseState *s = o->s;
    for (int i = 0; i < s->seen_count; i++) {
        const RbtSeen *n = &s->seen[i];
        Color color = n->kind == NODE_ANEURYSM ? gui_colors.warning : gui_colors.accent;
        if (o->view != CASE_PROJECTION)
            node_over_slice(o, n->center, n->radius, color);
        else if (n->kind == NODE_ANEURYSM)
            ring(o, n->center, n->radius, color, 1.2f * o->k);
        else if (n->parent >= 0)
            line(o, n->center, s->seen[n->parent].center, color, 1.6f * o->k);
    }
}

static void draw_fitted(const Over *o, const VesselTree *tree)
{
    for (int i = 0; i < tree->node_count; i++) {
        Color color = node_color(o->s, tree, i);
        if (o->view != CASE_PROJECTION)
            node_over_slice(o, tree->center[i], tree->radius[i], color);
        else if (tree->kind[i] == NODE_ANEURYSM)
            ring(o, tree->center[i], tree->radius[i], color, 1.2f * o->k);
        else if (tree->parent[i] >= 0)
            line(o, tree->center[i], tree->center[tree->parent[i]], color, 1.8f * o->k);
    }
}

static void take_cut(void *context, Vec3 a, Vec3 b, int vertex)
{
    Cut *cut = context;
    if (cut->count == cut->capacity) {
        int capacity = 2 * cut->capacity + 1024;
        CutLine *grown = realloc(cut->line, (size_t)capacity * sizeof *grown);
        if (!grown)
            return;
        cut->line = grown, cut->capacity = capacity;
    }
    cut->line[cut->count++] = (CutLine){a, b, vertex};
}

static void draw_cut(const Over *o, Cut *cut, const TriangleMesh *mesh, const VesselTree *tree)
{
    if (cut->mesh != mesh || cut->number != o->s->pictures) {
        cut->count = 0;
        mesh_cut(mesh, o->s->cursor, o->camera.back, take_cut, cut);
        cut->mesh = mesh, cut->number = o->s->pictures;
    }
    for (int i = 0; i < cut->count; i++)
        line(o, cut->line[i].a, cut->line[i].b, node_color(o->s, tree, mesh->node[cut->line[i].vertex]), 1.5f * o->k);
}

static void draw_marks(const Over *o)
{
    static const char sign[MARK_KINDS] = {[MARK_SAC] = 'S', [MARK_NARROW_PLACE] = 'N', [MARK_NO_ENTRY] = 'X', [MARK_MISSED] = 'M', [MARK_DOUBT] = 'D'};
    const CaseMark *mark;
    int count = case_builder_marks(o->s->builder, &mark);
    const double near = 1.5;         // [mm] from a slice
    for (int i = 0; i < count; i++) {
        if (!mark[i].has_place || fabs(depth_of(o, mark[i].place)) > near)
            continue;
        float x, y, size = (i == o->s->chosen_mark ? 7 : 4) * o->k;
        Color color = mark[i].kind == MARK_NO_ENTRY ? gui_colors.bad : gui_colors.warning;
        char text[2] = {sign[mark[i].kind], 0};
        place_of(o, mark[i].place, &x, &y);
        gui_draw_line(o->gui, x - size, y - size, x + size, y + size, color, 2 * o->k);
        gui_draw_line(o->gui, x - size, y + size, x + size, y - size, color, 2 * o->k);
        gui_draw_text(o->gui, x + size + 2 * o->k, y - 8 * o->k, GUI_SMALL, color, text);
    }
}

static void draw_acts(const Over *o)
{
    static const char *const name[CASE_ACTS] = {"start", "branch", "forbidden", "cut", "end", "sac", "entry", "target"};
    const CaseActs *acts = &o->s->acts;
    int first = 0;
    for (int i = 0; i < acts->count; i++)
        if (acts->act[i].kind == CASE_START)
            first = i;
    for (int i = first; i < acts->count; i++) {
        const CaseAct *act = &acts->act[i];
        double least = 1.2, radius = fmax(act->radius, least);
        if (!name[act->kind] || fabs(depth_of(o, act->place)) > radius)
            continue;
        if ((act->kind == CASE_ENTRY || act->kind == CASE_TARGET) && case_acts_last(acts, act->kind) != act)
            continue;
        float x, y;
        place_of(o, act->place, &x, &y);
        ring(o, act->place, fmax(radius, 5 * o->camera.mm_per_pixel), gui_colors.text, 1.5f * o->k);
        gui_draw_text(o->gui, x + 8 * o->k, y + 4 * o->k, GUI_SMALL, gui_colors.text, name[act->kind]);
    }
}

static void draw_cross_hair(const Over *o)
{
    float x, y;
    Color color = color_with_alpha(gui_colors.accent, 0.6);
    place_of(o, o->s->cursor, &x, &y);
    float long_way = o->view == CASE_PROJECTION ? 10 * o->k : 1e4f, hole = 6 * o->k;
    gui_draw_line(o->gui, x - long_way, y, x - hole, y, color, o->k);
    gui_draw_line(o->gui, x + hole, y, x + long_way, y, color, o->k);
    gui_draw_line(o->gui, x, y - long_way, x, y - hole, color, o->k);
    gui_draw_line(o->gui, x, y + hole, x, y + long_way, color, o->k);
}

static void letter(const Over *o, Vec3 direction, float x, float y)
{
    char text[4];
    float width, height;
    patient_letters(&o->s->axes, direction, text);
    gui_text_extent(o->gui, GUI_LARGE, text, &width, &height);
    float left = fminf(fmaxf(x - width / 2, o->at.x + 4 * o->k), o->at.x + o->at.width - 4 * o->k - width);
    gui_draw_text(o->gui, left, y - height / 2, GUI_LARGE, gui_colors.warning, text);
}

static void draw_frame(const Over *o)
{
    static const char *const name[CASE_VIEWS] = {"axial, from the feet", "coronal, from the front", "sagittal, from the left", "projection"};
    const GuiRect at = o->at;
    float k = o->k, inset = 14 * k;
    const Camera *c = &o->camera;
    letter(o, vec3_negate(c->right), at.x + inset, at.y + at.height / 2);
    letter(o, c->right, at.x + at.width - inset, at.y + at.height / 2);
    letter(o, c->up, at.x + at.width / 2, at.y + inset);
    letter(o, vec3_negate(c->up), at.x + at.width / 2, at.y + at.height - inset);
    char without[80];
    const char *title = !o->s->axes.is_known && o->view < CASE_PROJECTION ? "slice"
                        : o->view == CASE_PROJECTION && o->s->shows_wall  ? "wall, by error"
                        : o->view == CASE_PROJECTION && case_state_projected(o->s) != o->s->volume
                            ? key_sheet_fill(SHEET_CASE, tr("projection without bone ({bone})"), without, sizeof without)
                            : name[o->view];
    gui_draw_text(o->gui, at.x + 8 * k, at.y + 6 * k, GUI_SMALL, gui_colors.dim, title);
    if (o->view < CASE_PROJECTION && case_state_forbids_bone(o->s))
        gui_draw_text(o->gui, at.x + 8 * k, at.y + 22 * k, GUI_SMALL, gui_colors.dim, "brown: bone, left out");
    // a scale of 10 mm, or a tenth or ten times that
    double bar = 10;
    while (bar / c->mm_per_pixel > 0.4 * (double)at.width)
        bar /= 10;
    while (bar / c->mm_per_pixel < 0.04 * (double)at.width)
        bar *= 10;
    char text[20];
    float low = at.y + at.height - 8 * k, left = at.x + 8 * k;
    snprintf(text, sizeof text, "%g mm", bar);
    gui_draw_line(o->gui, left, low, left + (float)(bar / c->mm_per_pixel), low, gui_colors.text, 2 * k);
    gui_draw_text(o->gui, left, low - 18 * k, GUI_SMALL, gui_colors.text, text);
    Color edge = o->view == o->s->view ? gui_colors.accent : gui_colors.line;
    gui_draw_line(o->gui, at.x + 1, at.y + 1, at.x + at.width - 1, at.y + 1, edge, k);
    gui_draw_line(o->gui, at.x + 1, at.y + at.height - 1, at.x + at.width - 1, at.y + at.height - 1, edge, k);
    gui_draw_line(o->gui, at.x + 1, at.y + 1, at.x + 1, at.y + at.height - 1, edge, k);
    gui_draw_line(o->gui, at.x + at.width - 1, at.y + 1, at.x + at.width - 1, at.y + at.height - 1, edge, k);
}

void case_views_draw_over(CaseViews *v, Gui *gui, const CaseState *s, int view, GuiRect at)
{
    if (!s->has_volume)
        return;
    const ModelField *field = case_builder_wall(s->builder);
    const TriangleMesh *mesh = case_builder_mesh(s->builder);
    Over o = {gui, s, at, case_state_camera(s, view, (int)at.width, (int)at.height), view, gui_scale(gui)};
    if (view < CASE_PROJECTION && mesh && field)
        draw_cut(&o, &v->cut[view], mesh, field->tree);
    else if (field && !(view == CASE_PROJECTION && s->shows_wall && mesh))
        draw_fitted(&o, field->tree);
    else if (!field)
        draw_growing(&o);
    draw_cross_hair(&o);
    draw_marks(&o);
    draw_acts(&o);
    draw_frame(&o);
}
