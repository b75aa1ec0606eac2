// The 3D passes, pixel by pixel: sizes, depth order, translucency. Skipped without EGL.
#include "render/gl_canvas.h"
#include "render/gl_context.h"
#include "render/surface_view.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

// An opaque surface.
static ShellStyle shell_style_solid(void)
{
    return (ShellStyle){.front = {0.80f, 0.80f, 0.78f},
                        .back = {0.62f, 0.60f, 0.58f},
                        .front_opacity = 1,
                        .back_opacity = 1,
                        .rim = 1,
                        .rim_power = 2,
                        .haze = {0.98f, 0.98f, 0.97f},
                        .haze_amount = 0.35f};
}

enum { WIDTH = 320, HEIGHT = 240 };

typedef struct Stage {
    GlContext *context;
    GlCanvas canvas;
    SurfaceView *view;
    uint8_t rgb[HEIGHT][WIDTH][3];
} Stage;

static Stage *stage_open(int samples)
{
    char message[256] = "";
    GlContext *context = gl_context_create(message, sizeof message);
    if (!context) {
        print_message("no EGL: %s\n", message);
        return NULL;
    }
    Stage *stage = calloc(1, sizeof *stage);
    assert_non_null(stage);
    stage->context = context;
    assert_true(gl_canvas_create(&stage->canvas, WIDTH, HEIGHT, samples, message, sizeof message));
    stage->view = surface_view_create(message, sizeof message);
    if (!stage->view)
        fail_msg("%s", message);
    return stage;
}

static void stage_close(Stage *stage)
{
    surface_view_destroy(stage->view);
    gl_canvas_destroy(&stage->canvas);
    gl_context_destroy(stage->context);
    free(stage);
}

static void stage_clear(Stage *stage)
{
    const float black[3] = {0, 0, 0};
    gl_canvas_begin(&stage->canvas, black);
}

// A ball of (2 n) x n quads. Owned arrays, freed by ball_free.
static TriangleMesh ball(Vec3 center, double radius, int n)
{
    int columns = 2 * n;
    TriangleMesh mesh = {.vertex_count = (n + 1) * columns, .triangle_count = 2 * n * columns};
    mesh.vertex = malloc((size_t)mesh.vertex_count * sizeof *mesh.vertex);
    mesh.normal = malloc((size_t)mesh.vertex_count * sizeof *mesh.normal);
    mesh.triangle = malloc((size_t)mesh.triangle_count * sizeof *mesh.triangle);
    int t = 0;
    for (int j = 0; j <= n; j++)
        for (int i = 0; i < columns; i++) {
            double theta = PI * j / n, phi = 2 * PI * i / columns;
            Vec3 out = {sin(theta) * cos(phi), sin(theta) * sin(phi), cos(theta)};
            int here = j * columns + i, beside = j * columns + (i + 1) % columns;
            mesh.vertex[here] = vec3_add_scaled(center, radius, out);
            mesh.normal[here] = out;
            if (j == n)
                continue;
            const int corner[2][3] = {{here, here + columns, beside}, {beside, here + columns, beside + columns}};
            for (int k = 0; k < 2; k++, t++)
                for (int c = 0; c < 3; c++)
                    mesh.triangle[t][c] = corner[k][c];
        }
    return mesh;
}

static void ball_free(TriangleMesh *mesh)
{
    free(mesh->vertex);
    free(mesh->normal);
    free(mesh->triangle);
}

static Camera camera_at(Vec3 view, Vec3 center, double mm_per_pixel)
{
    Camera camera = {0};
    camera_orient(&camera, view, vec3(0, 0, 0), 0, NULL);
    camera.center = center;
    camera.mm_per_pixel = mm_per_pixel;
    camera.near_depth = 50;
    camera.far_depth = -50;
    camera.width = WIDTH;
    camera.height = HEIGHT;
    return camera;
}

static bool is_lit(Stage *stage, int x, int y) { return stage->rgb[y][x][0] + stage->rgb[y][x][1] + stage->rgb[y][x][2] > 0; }

static void balls_are_as_large_as_the_projection_says(void **state)
{
    (void)state;
    Stage *stage = stage_open(4);
    if (!stage)
        skip();
    const Vec3 center = {120, -45, 300}, view[3] = {{0, 1, 0}, {0.3, -0.5, 0.8}, {-1, 0.2, 0.1}};
    const double radius[2] = {3.7, 8.2};
    ShellStyle style = shell_style_solid();
    for (int v = 0; v < 3; v++)
        for (int k = 0; k < 2; k++) {
            // off centre by a known number of pixels; the ball has 90 triangles around: its chord error is r (1 - cos(pi / 180)), below 0.02 px
            Camera camera = camera_at(view[v], center, 0.1);
            camera.center = vec3_add_scaled(vec3_add_scaled(center, -1.55, camera.right), 0.72, camera.up);
            TriangleMesh mesh = ball(center, radius[k], 90);
            char message[256];
            assert_true(surface_view_set_mesh(stage->view, &mesh, message, sizeof message));
            stage_clear(stage);
            surface_view_draw_shell(stage->view, &camera, &style);
            gl_canvas_read(&stage->canvas, &stage->rgb[0][0][0]);
            int left = WIDTH, right = -1, top = HEIGHT, bottom = -1, area = 0;
            for (int y = 0; y < HEIGHT; y++)
                for (int x = 0; x < WIDTH; x++)
                    if (is_lit(stage, x, y)) {
                        left = x < left ? x : left, right = x > right ? x : right;
                        top = y < top ? y : top, bottom = y > bottom ? y : bottom;
                        area++;
                    }
            Vec3 p = camera_project(&camera, center);
            assert_true(fabs(p.x - (WIDTH / 2.0 + 15.5)) < 1e-6);
            assert_true(fabs(p.y - (HEIGHT / 2.0 + 7.2)) < 1e-6);
            double r = radius[k] / 0.1;
            // a pixel is lit if any of its samples is: its edge lies within one pixel of the outline
            assert_true(fabs(left - (p.x - r)) < 1 && fabs(right + 1 - (p.x + r)) < 1 && fabs(top - (p.y - r)) < 1 && fabs(bottom + 1 - (p.y + r)) < 1);
            double rim = 2 * PI * r;
            assert_true(area > PI * r * r && area < PI * r * r + rim);
            ball_free(&mesh);
        }
    stage_close(stage);
}

// Draws a short red bar across the view at `depth` towards the eye; returns how red the middle pixel is compared with its surroundings on the ball.
static double redness(Stage *stage, const Camera *camera, const ShellStyle *style, double depth)
{
    Vec3 middle = vec3_add_scaled(camera->center, depth, camera->back);
    const Vec3 point[3] = {vec3_add_scaled(middle, -2, camera->right), middle, vec3_add_scaled(middle, 2, camera->right)};
    const double radius[3] = {0.5, 0.5, 0.5};
    const Color red[3] = {{255, 0, 0, 255}, {255, 0, 0, 255}, {255, 0, 0, 255}};
    Primitives primitives = {.origin = camera->center};
    primitives_tube(&primitives, 3, point, radius, red);
    stage_clear(stage);
    surface_view_draw_primitives(stage->view, camera, &primitives, style);
    surface_view_draw_shell(stage->view, camera, style);
    gl_canvas_read(&stage->canvas, &stage->rgb[0][0][0]);
    primitives_free(&primitives);
    const uint8_t *on = stage->rgb[HEIGHT / 2][WIDTH / 2], *off = stage->rgb[HEIGHT / 2 + 30][WIDTH / 2];
    return (on[0] - (on[1] + on[2]) / 2.0) - (off[0] - (off[1] + off[2]) / 2.0);
}

static void a_tool_shows_through_exactly_the_walls_before_it(void **state)
{
    (void)state;
    Stage *stage = stage_open(4);
    if (!stage)
        skip();
    TriangleMesh mesh = ball(vec3(0, 0, 0), 8, 40);
    char message[256];
    const Vec3 view[3] = {{0, 1, 0}, {0, -1, 0}, {0.5, 0.4, -0.7}};
    for (int v = 0; v < 3; v++) {
        Camera camera = camera_at(view[v], vec3(0, 0, 0), 0.1);
        assert_true(surface_view_set_mesh(stage->view, &mesh, message, sizeof message));
        ShellStyle glass = shell_style_glass(), solid = shell_style_solid();
        double before = redness(stage, &camera, &glass, 15), inside = redness(stage, &camera, &glass, 0), behind = redness(stage, &camera, &glass, -15);
        assert_true(before > 1.1 * inside && inside > 1.1 * behind && behind > 20);
        // each wall takes its opacity from what lies behind it
        assert_true(fabs(inside / before - (1 - glass.front_opacity)) < 0.12);
        before = redness(stage, &camera, &solid, 15);
        assert_true(before > 150);
        assert_true(fabs(redness(stage, &camera, &solid, 0)) < 10 && fabs(redness(stage, &camera, &solid, -15)) < 10);
    }
    // a fading near wall: the tool inside is as red as without it, and the far wall still hides a second one behind it
    Camera camera = camera_at(view[2], vec3(0, 0, 0), 0.1);
    ShellStyle glass = shell_style_glass();
    double before = redness(stage, &camera, &glass, 15);
    glass.fade_from = 2;
    glass.fade_to = 4;
    assert_true(fabs(redness(stage, &camera, &glass, 0) / before - 1) < 0.12);
    assert_true(redness(stage, &camera, &glass, -15) < 0.8 * before);
    ball_free(&mesh);
    stage_close(stage);
}

static void translucency_does_not_depend_on_the_order_of_triangles(void **state)
{
    (void)state;
    Stage *stage = stage_open(1);
    if (!stage)
        skip();
    // two balls in one mesh, one in front of the other
    TriangleMesh a = ball(vec3(0, -6, 0), 5, 30), b = ball(vec3(2, 7, 1), 4, 30), both = {0};
    both.vertex_count = a.vertex_count + b.vertex_count;
    both.triangle_count = a.triangle_count + b.triangle_count;
    both.vertex = malloc((size_t)both.vertex_count * sizeof *both.vertex);
    both.normal = malloc((size_t)both.vertex_count * sizeof *both.normal);
    both.triangle = malloc((size_t)both.triangle_count * sizeof *both.triangle);
    memcpy(both.vertex, a.vertex, (size_t)a.vertex_count * sizeof *a.vertex);
    memcpy(both.normal, a.normal, (size_t)a.vertex_count * sizeof *a.normal);
    memcpy(both.vertex + a.vertex_count, b.vertex, (size_t)b.vertex_count * sizeof *b.vertex);
    memcpy(both.normal + a.vertex_count, b.normal, (size_t)b.vertex_count * sizeof *b.normal);
    static uint8_t first[HEIGHT][WIDTH][3];
    Camera camera = camera_at(vec3(0.1, 1, -0.2), vec3(0, 0, 0), 0.1);
    ShellStyle glass = shell_style_glass();
    char message[256];
    for (int order = 0; order < 3; order++) {
        for (int t = 0; t < both.triangle_count; t++) {
            // original order; reversed; permuted (7919 is coprime to the count)
            int from = order == 0 ? t : order == 1 ? both.triangle_count - 1 - t : (int)((long)t * 7919 % both.triangle_count);
            for (int c = 0; c < 3; c++)
                both.triangle[t][c] = from < a.triangle_count ? a.triangle[from][c] : b.triangle[from - a.triangle_count][c] + a.vertex_count;
        }
        assert_true(surface_view_set_mesh(stage->view, &both, message, sizeof message));
        stage_clear(stage);
        surface_view_draw_shell(stage->view, &camera, &glass);
        gl_canvas_read(&stage->canvas, &stage->rgb[0][0][0]);
        if (order == 0) {
            memcpy(first, stage->rgb, sizeof first);
            continue;
        }
        int differ = 0, lit = 0;
        for (int y = 0; y < HEIGHT; y++)
            for (int x = 0; x < WIDTH; x++) {
                lit += is_lit(stage, x, y);
                for (int c = 0; c < 3; c++)
                    differ += abs(first[y][x][c] - stage->rgb[y][x][c]) > 1;
            }
        assert_true(lit > 7000);
        assert_true(differ < lit / 1000);   // the rims of the two walls may fall into one bucket of depth
    }
    ball_free(&a), ball_free(&b), ball_free(&both);
    stage_close(stage);
}

static void primitives_are_closed_and_face_outwards(void **state)
{
    (void)state;
    const Vec3 point[5] = {{0, 0, 0}, {3, 0.5, 0}, {5, 3, 1}, {5, 6, 1}, {2, 8, 0}};
    const double radius[5] = {0.4, 0.5, 0.5, 0.3, 0.4};
    const Color c = {1, 2, 3, 255}, color[5] = {c, c, c, c, c};
    for (int kind = 0; kind < 4; kind++) {
        Primitives primitives = {.origin = {1, 1, 1}};
        double volume = 0, expected = 0;
        if (kind == 0)
            primitives_tube(&primitives, 5, point, radius, color);
        else if (kind == 1) {
            primitives_sphere(&primitives, vec3(2, 3, 4), 1.5, c);
            expected = 4 * PI / 3 * 1.5 * 1.5 * 1.5;
        } else if (kind == 2)
            primitives_arrow(&primitives, vec3(0, 1, 0), vec3(4, 2, 1), 0.2, c);
        else {
            primitives_circle(&primitives, vec3(0, 0, 0), vec3(0, 0, 1), 4, 0.3, c);
            expected = 2 * PI * 4 * PI * 0.09;
        }
        for (int i = 0; i < primitives.index_count; i += 3) {
            Vec3 p[3], n = {0, 0, 0};
            for (int k = 0; k < 3; k++) {
                const PrimitiveVertex *v = &primitives.vertex[primitives.index[i + k]];
                p[k] = vec3(v->position[0], v->position[1], v->position[2]);
                n = vec3_add(n, vec3(v->normal[0], v->normal[1], v->normal[2]));
            }
            Vec3 area = vec3_cross(vec3_sub(p[1], p[0]), vec3_sub(p[2], p[0]));
            volume += vec3_dot(p[0], area) / 6;
            if (vec3_norm(area) > 1e-6)
                assert_true(vec3_dot(area, n) > -1e-6 * vec3_norm(area));
        }
        assert_true(volume > 0);   // a closed surface has a positive volume only if its normals point outwards
        if (expected > 0)          // 14-gons in 16 rings: 14/(2 pi) sin(2 pi/14) = 0.967 and less
            assert_true(volume > 0.93 * expected && volume < expected);
        primitives_free(&primitives);
    }
}

static void broken_meshes_are_refused(void **state)
{
    (void)state;
    Stage *stage = stage_open(1);
    if (!stage)
        skip();
    char message[256] = "";
    TriangleMesh mesh = ball(vec3(0, 0, 0), 1, 4);
    mesh.triangle[3][1] = mesh.vertex_count;
    assert_false(surface_view_set_mesh(stage->view, &mesh, message, sizeof message));
    assert_true(strlen(message) > 0);
    mesh.triangle[3][1] = 0;
    mesh.vertex[2].y = NAN;
    assert_false(surface_view_set_mesh(stage->view, &mesh, message, sizeof message));
    Camera camera = camera_at(vec3(0, 1, 0), vec3(0, 0, 0), 0.1);
    ShellStyle style = shell_style_glass();
    stage_clear(stage);
    surface_view_draw_shell(stage->view, &camera, &style);   // draws nothing, and does not crash
    gl_canvas_read(&stage->canvas, &stage->rgb[0][0][0]);
    assert_false(is_lit(stage, WIDTH / 2, HEIGHT / 2));
    ball_free(&mesh);
    stage_close(stage);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(balls_are_as_large_as_the_projection_says),
        cmocka_unit_test(a_tool_shows_through_exactly_the_walls_before_it),
        cmocka_unit_test(translucency_does_not_depend_on_the_order_of_triangles),
        cmocka_unit_test(primitives_are_closed_and_face_outwards),
        cmocka_unit_test(broken_meshes_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
