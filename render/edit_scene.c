// See edit_scene.h. The wall is opaque, so that its triangles need no sorting; the picture is kept until something changes.
#include "render/edit_scene.h"

#include "render/gl_canvas.h"
#include "render/message.h"
#include "render/surface_view.h"

#include <epoxy/gl.h>
#include <stdlib.h>
#include <string.h>

struct EditScene {
    SurfaceView *view;
    FreeCamera camera;
    GlCanvas canvas;
    Primitives primitives;
    bool is_stale;
    double depth;            // [mm] of the scene
};

static const Color in_color = {40, 190, 145, 255}, out_color = {255, 90, 60, 255}, section_color = {86, 180, 233, 255}, drawn_color = {240, 172, 30, 255};
static const float background[3] = {12 / 255.0f, 14 / 255.0f, 18 / 255.0f};

EditScene *edit_scene_create(const EditState *state, char *message, size_t capacity)
{
    EditScene *scene = calloc(1, sizeof *scene);
    if (!scene) {
        message_fail(message, capacity, "out of memory");
        return NULL;
    }
    const TriangleMesh *mesh = state->mesh->surface;
    scene->view = surface_view_create(message, capacity);
    if (!scene->view) {
        edit_scene_destroy(scene);
        return NULL;
    }
    scene->camera = free_camera_framing(mesh->vertex_count, mesh->vertex);
    // room for the arrows
    static const double room = 1.1;
    scene->camera.width_mm *= room, scene->camera.height_mm *= room;
    scene->camera.home_width_mm *= room, scene->camera.home_height_mm *= room;
    scene->depth = vec3_distance(scene->camera.low, scene->camera.high) + 10;
    scene->is_stale = true;
    return scene;
}

void edit_scene_destroy(EditScene *scene)
{
    if (!scene)
        return;
    surface_view_destroy(scene->view);
    gl_canvas_destroy(&scene->canvas);
    primitives_free(&scene->primitives);
    free(scene);
}

FreeCamera *edit_scene_camera(EditScene *scene) { return &scene->camera; }
void edit_scene_redraw(EditScene *scene) { scene->is_stale = true; }

void edit_scene_focus(EditScene *scene, Vec3 x)
{
    scene->camera.focus = x;
    scene->is_stale = true;
}

Camera edit_scene_projection(const EditScene *scene, GuiRect at) { return free_camera_projection(&scene->camera, (int)at.width, (int)at.height, scene->depth); }

static void add_ends(EditScene *scene, const EditState *s)
{
    const SweepModel *m = sweep_editor_model(s->editor);
    const SweepField *field = sweep_editor_field(s->editor);
    double least = 0.006 * vec3_distance(scene->camera.low, scene->camera.high);
    for (int i = 0; i < m->branch_count; i++)
        for (int end = 0; end < 2; end++) {
            SweepTag tag = sweep_model_tag(m, i, end);
            if (tag == SWEEP_TAG_NONE)
                continue;
            double length = field->curve[i]->length, r = fmax(least, sweep_field_mean(field, i, end ? length : 0));
            SweepJet j = sweep_curve_at(field->curve[i], end ? length : 0);
            Vec3 out = vec3_scale(vec3_unit(j.s1), end ? 1 : -1), near = vec3_add_scaled(j.s, 1.6 * r, out), far = vec3_add_scaled(j.s, 7.5 * r, out);
            primitives_arrow(&scene->primitives, tag == SWEEP_TAG_IN ? far : near, tag == SWEEP_TAG_IN ? near : far, 0.35 * r,
                             tag == SWEEP_TAG_IN ? in_color : out_color);
        }
}

static void add_section(EditScene *scene, const EditState *s, double pixel)
{
    enum { POINTS = EDIT_CONTOUR + 1 };
    Vec3 point[POINTS];
    SectionPoint fine[EDIT_CONTOUR], way[EDIT_CONTOUR];
    double radius[POINTS], outside = 0.03 * sweep_field_mean(sweep_editor_field(s->editor), s->branch, s->t);
    Color color[POINTS];
    if (s->outline.count > 0)
        sweep_contour_sample(&s->outline, EDIT_CONTOUR, fine, way);
    for (int i = 0; i < POINTS && s->outline.count > 0; i++) {
        int k = i % EDIT_CONTOUR;
        point[i] = edit_state_in_space(s, vec3(fine[k].n + outside * way[k].b, fine[k].b - outside * way[k].n, 0));
        radius[i] = 2 * pixel, color[i] = section_color;
    }
    primitives_tube(&scene->primitives, s->outline.count > 0 ? POINTS : 0, point, radius, color);
    // the points, and the pen after them
    for (int i = 0; s->draws_branch && i <= s->drawn_count; i++) {
        bool is_pen = i == s->drawn_count;
        Vec3 line[2] = {s->drawn[i > 0 ? i - 1 : 0], is_pen ? s->pen : s->drawn[i]};
        primitives_sphere(&scene->primitives, line[1], is_pen ? 3 * pixel : fmax(4 * pixel, 0.5 * (double)s->drawn_radius),
                          is_pen ? section_color : drawn_color);
        double thin[2] = {2 * pixel, 2 * pixel};
        Color both[2] = {drawn_color, drawn_color};
        if (i > 0)
            primitives_tube(&scene->primitives, 2, line, thin, both);
    }
}

static bool fit_canvas(EditScene *scene, int width, int height, char *message, size_t capacity)
{
    if (scene->canvas.width == width && scene->canvas.height == height)
        return true;
    gl_canvas_destroy(&scene->canvas);
    scene->is_stale = true;
    return gl_canvas_create(&scene->canvas, width, height, 4, message, capacity);
}

bool edit_scene_draw(EditScene *scene, EditState *s, GuiRect at, int height, char *message, size_t capacity)
{
    int width = (int)at.width, tall = (int)at.height, left = (int)at.x, bottom = height - (int)(at.y + at.height);
    if (!fit_canvas(scene, width, tall, message, capacity))
        return false;
    if (s->mesh_is_new) {
        if (!surface_view_set_mesh(scene->view, s->mesh->surface, message, capacity))
            return false;
        s->mesh_is_new = false;
        scene->is_stale = true;
    }
    if (scene->is_stale) {
        Camera camera = edit_scene_projection(scene, at);
        ShellStyle style = shell_style_glass();
        style.front_opacity = style.back_opacity = style.rim = 1;
        memcpy(style.haze, background, sizeof style.haze);
        primitives_clear(&scene->primitives);
        scene->primitives.origin = scene->camera.focus;
        add_ends(scene, s);
        add_section(scene, s, camera.mm_per_pixel);
        gl_canvas_begin(&scene->canvas, background);
        surface_view_draw_primitives(scene->view, &camera, &scene->primitives, &style);
        surface_view_draw_shell(scene->view, &camera, &style);
        gl_canvas_resolve(&scene->canvas);
        scene->is_stale = false;
    }
    glBindFramebuffer(GL_READ_FRAMEBUFFER, scene->canvas.resolved);
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, 0);
    glBlitFramebuffer(0, 0, width, tall, left, bottom, left + width, bottom + tall, GL_COLOR_BUFFER_BIT, GL_NEAREST);
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    return true;
}

// --- picking ---

// Whether a pixel is in a projected triangle; its weights.
static bool weights(const Vec3 p[3], double x, double y, double w[3])
{
    double area = (p[1].x - p[0].x) * (p[2].y - p[0].y) - (p[1].y - p[0].y) * (p[2].x - p[0].x);
    if (fabs(area) < 1e-12)
        return false;
    for (int k = 0; k < 3; k++) {
        const Vec3 *a = &p[(k + 1) % 3], *b = &p[(k + 2) % 3];
        w[k] = ((b->x - a->x) * (y - a->y) - (b->y - a->y) * (x - a->x)) / area;
    }
    return w[0] >= 0 && w[1] >= 0 && w[2] >= 0;
}

bool edit_scene_pick(const EditScene *scene, const EditState *s, GuiRect at, double x, double y, Vec3 *wall, int *branch, double *t)
{
    const TriangleMesh *mesh = s->mesh->surface;
    Camera camera = edit_scene_projection(scene, at);
    double nearest = -HUGE_VAL;
    for (int i = 0; i < mesh->triangle_count; i++) {
        Vec3 p[3];
        double w[3];
        for (int k = 0; k < 3; k++)
            p[k] = camera_project(&camera, mesh->vertex[mesh->triangle[i][k]]);
        if (!weights(p, x - (double)at.x, y - (double)at.y, w))
            continue;
        double depth = w[0] * p[0].z + w[1] * p[1].z + w[2] * p[2].z;
        if (depth <= nearest)
            continue;
        nearest = depth;
        int best = w[0] >= w[1] && w[0] >= w[2] ? 0 : w[1] >= w[2] ? 1 : 2, vertex = mesh->triangle[i][best];
        *branch = s->mesh->branch[vertex], *t = 0, *wall = vec3(0, 0, 0);
        for (int k = 0; k < 3; k++) {
            int corner = mesh->triangle[i][k];
            *t += w[k] * s->mesh->along[s->mesh->branch[corner] == *branch ? corner : vertex];
            *wall = vec3_add_scaled(*wall, w[k], mesh->vertex[corner]);
        }
    }
    return nearest > -HUGE_VAL;
}

Vec3 edit_scene_point(const EditScene *scene, GuiRect at, double x, double y, Vec3 through)
{
    Camera camera = edit_scene_projection(scene, at);
    Vec3 p = camera_project(&camera, through);
    return vec3_add_scaled(vec3_add_scaled(through, (x - (double)at.x - p.x) * camera.mm_per_pixel, camera.right),
                           -(y - (double)at.y - p.y) * camera.mm_per_pixel, camera.up);
}
