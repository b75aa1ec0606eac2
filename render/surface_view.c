// Translucency by painter's sort: triangles are small compared with the vessel, so sorting them by their centroids is accurate enough; it needs one
// pass (depth peeling needs one for each layer) and works with multisampling. A counting sort on 16 bits of depth costs 1 to 2 ms for 100,000 triangles
// and keeps index order within a bucket, so the same scene gives the same pixels.
//
// With n the unit normal in eye space and c = |n_z|: opacity = face + (rim - face) (1 - c)^p, so the outline of the lumen stands out and the tool is visible
// through its
// middle. For the two faces of a tube this is the look of thin-walled glass.
#include "render/surface_view.h"

#include "render/drawable_mesh.h"
#include "render/gl_canvas.h"
#include "render/message.h"

#include <epoxy/gl.h>
#include <stdlib.h>
#include <string.h>

struct SurfaceView {
    unsigned shell_program, solid_program, point_program;
    unsigned shell_array, shell_vertices, shell_indices;
    unsigned list_array, list_vertices, list_indices;
    Vec3 origin;
    int vertex_count, triangle_count;
    float *position;           // (V, 3) relative to origin
    uint32_t *triangle;        // (T, 3)
    uint32_t *sorted;          // (T, 3)
    uint16_t *bucket;          // (T)
};

enum { BUCKETS = 65536 };

static const char *const LIGHT = "const vec3 key = vec3(-0.36, 0.55, 0.754), fill = vec3(0.7, -0.1, 0.7);\n"
                                 "float lit(vec3 n) { return 0.38 + 0.5 * max(dot(n, key), 0.0) + 0.17 * max(dot(n, fill), 0.0); }\n"
                                 "float shine(vec3 n, float p) { return pow(max(dot(n, normalize(key + vec3(0, 0, 1))), 0.0), p); }\n";

static const char *const MESH_VERTEX = "#version 330 core\n"
                                       "layout(location = 0) in vec3 position; layout(location = 1) in vec3 normal; layout(location = 2) in vec4 color;\n"
                                       "uniform mat4 clip; uniform mat3 eye; out vec3 n; out vec4 c; out float depth;\n"
                                       "void main() { gl_Position = clip * vec4(position, 1.0); n = eye * normal; c = color;\n"
                                       "  depth = 0.5 + 0.5 * gl_Position.z; }\n";

static const char *const SHELL_FRAGMENT =
    "in vec3 n; in vec4 c; in float depth; out vec4 result;\n"
    "uniform vec3 front, back, haze; uniform vec4 opacity; uniform float haze_amount; uniform vec2 fade;\n"   // opacity: front, back, rim, power
    "void main() {\n"
    "  vec3 m = normalize(n); bool outer = gl_FrontFacing;\n"
    // at the outline the interpolated normal may point to the wrong side: the facing of the triangle decides
    "  m = outer == (m.z >= 0.0) ? m : normalize(vec3(m.xy, 0.0) + vec3(0.0, 0.0, outer ? 0.001 : -0.001));\n"
    "  float edge = pow(1.0 - abs(m.z), opacity.w);\n"
    "  float a = mix(outer ? opacity.x : opacity.y, opacity.z, edge);\n"
    "  float shiny = outer ? 0.5 * shine(m, 48.0) : 0.0;\n"
    "  vec3 k = outer ? front * lit(m) : back * (0.62 + 0.3 * lit(-m));\n"
    "  k = mix(k, k * 0.62, edge);\n"
    "  k = mix(k, haze, haze_amount * depth);\n"
    "  a = a + (1.0 - a) * shiny; k = mix(k, vec3(1.0), shiny);\n"
    "  result = vec4(k, a * smoothstep(fade.y, fade.x, depth));\n"
    "}\n";

static const char *const SOLID_FRAGMENT = "in vec3 n; in vec4 c; in float depth; out vec4 result;\n"
                                          "uniform vec3 haze; uniform float haze_amount;\n"
                                          "void main() { vec3 m = normalize(n); if (m.z < 0.0) m = -m;\n"
                                          "  vec3 k = c.rgb * (0.55 + 0.55 * lit(m)) + vec3(0.22 * shine(m, 30.0));\n"
                                          "  result = vec4(mix(k, haze, haze_amount * depth), 1.0); }\n";

static const char *const POINT_VERTEX = "#version 330 core\n"
                                        "layout(location = 0) in vec3 position; layout(location = 2) in vec4 color; layout(location = 3) in float size;\n"
                                        "uniform mat4 clip; out vec4 c;\n"
                                        "void main() { gl_Position = clip * vec4(position, 1.0); gl_PointSize = size; c = color; }\n";

static const char *const POINT_FRAGMENT = "in vec4 c; out vec4 result;\n"
                                          "void main() { vec2 p = 2.0 * gl_PointCoord - 1.0; float r = dot(p, p); if (r > 1.0) discard;\n"
                                          "  result = vec4(c.rgb * (0.62 + 0.42 * sqrt(1.0 - r)), 1.0); }\n";

ShellStyle shell_style_glass(void)
{
    return (ShellStyle){.front = {0.90f, 0.66f, 0.62f},
                        .back = {0.86f, 0.60f, 0.57f},
                        .front_opacity = 0.22f,
                        .back_opacity = 0.34f,
                        .rim = 0.9f,
                        .rim_power = 2.2f,
                        .haze = {0.98f, 0.98f, 0.97f},
                        .haze_amount = 0.35f};
}

static unsigned make_program(const char *vertex, const char *fragment, char *message, size_t capacity)
{
    char text[4096];
    snprintf(text, sizeof text, "#version 330 core\n%s%s", LIGHT, fragment);
    return gl_program_create(vertex, text, message, capacity);
}

SurfaceView *surface_view_create(char *message, size_t capacity)
{
    SurfaceView *view = calloc(1, sizeof *view);
    if (!view) {
        message_fail(message, capacity, "out of memory for a picture");
        return NULL;
    }
    view->shell_program = make_program(MESH_VERTEX, SHELL_FRAGMENT, message, capacity);
    view->solid_program = view->shell_program ? make_program(MESH_VERTEX, SOLID_FRAGMENT, message, capacity) : 0;
    view->point_program = view->solid_program ? make_program(POINT_VERTEX, POINT_FRAGMENT, message, capacity) : 0;
    if (!view->point_program) {
        surface_view_destroy(view);
        return NULL;
    }
    glGenVertexArrays(1, &view->shell_array);
    glGenVertexArrays(1, &view->list_array);
    unsigned buffer[4];
    glGenBuffers(4, buffer);
    view->shell_vertices = buffer[0];
    view->shell_indices = buffer[1];
    view->list_vertices = buffer[2];
    view->list_indices = buffer[3];
    return view;
}

void surface_view_destroy(SurfaceView *view)
{
    if (!view)
        return;
    glDeleteProgram(view->shell_program);
    glDeleteProgram(view->solid_program);
    glDeleteProgram(view->point_program);
    const unsigned buffer[4] = {view->shell_vertices, view->shell_indices, view->list_vertices, view->list_indices};
    glDeleteBuffers(4, buffer);
    glDeleteVertexArrays(1, &view->shell_array);
    glDeleteVertexArrays(1, &view->list_array);
    free(view->position);
    free(view->triangle);
    free(view->sorted);
    free(view->bucket);
    free(view);
}

static const void *at_byte(size_t offset) { return (const void *)(uintptr_t)offset; }

static Vec3 middle_of(const TriangleMesh *mesh)
{
    Vec3 low = mesh->vertex[0], high = low;
    for (int i = 1; i < mesh->vertex_count; i++) {
        Vec3 p = mesh->vertex[i];
        low = vec3(fmin(low.x, p.x), fmin(low.y, p.y), fmin(low.z, p.z));
        high = vec3(fmax(high.x, p.x), fmax(high.y, p.y), fmax(high.z, p.z));
    }
    return vec3_mix(low, high, 0.5);
}

bool surface_view_set_mesh(SurfaceView *view, const TriangleMesh *mesh, char *message, size_t capacity)
{
    view->vertex_count = view->triangle_count = 0;
    if (!mesh || mesh->vertex_count == 0)
        return true;
    if (!drawable_mesh_check(mesh, message, capacity))
        return false;
    size_t vertices = (size_t)mesh->vertex_count, triangles = (size_t)mesh->triangle_count;
    free(view->position), free(view->triangle), free(view->sorted), free(view->bucket);
    view->position = malloc(vertices * 3 * sizeof *view->position);
    view->triangle = malloc((triangles + 1) * 3 * sizeof *view->triangle);
    view->sorted = malloc((triangles + 1) * 3 * sizeof *view->sorted);
    view->bucket = malloc((triangles + 1) * sizeof *view->bucket);
    if (!view->position || !view->triangle || !view->sorted || !view->bucket)
        return message_fail(message, capacity, "out of memory for a surface of %d triangles", mesh->triangle_count);
    view->origin = middle_of(mesh);
    float *interleaved = drawable_mesh_floats(mesh, view->origin, message, capacity);
    if (!interleaved)
        return false;
    for (size_t i = 0; i < vertices; i++)
        memcpy(view->position + 3 * i, interleaved + 6 * i, 3 * sizeof *interleaved);
    for (size_t i = 0; i < triangles; i++)
        for (size_t k = 0; k < 3; k++)
            view->triangle[3 * i + k] = (uint32_t)mesh->triangle[i][k];
    glBindVertexArray(view->shell_array);
    glBindBuffer(GL_ARRAY_BUFFER, view->shell_vertices);
    glBufferData(GL_ARRAY_BUFFER, (GLsizeiptr)(vertices * 6 * sizeof *interleaved), interleaved, GL_STATIC_DRAW);
    glEnableVertexAttribArray(0);
    glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, 6 * sizeof(float), at_byte(0));
    glEnableVertexAttribArray(1);
    glVertexAttribPointer(1, 3, GL_FLOAT, GL_FALSE, 6 * sizeof(float), at_byte(3 * sizeof(float)));
    glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, view->shell_indices);
    glBindVertexArray(0);
    free(interleaved);
    view->vertex_count = mesh->vertex_count;
    view->triangle_count = mesh->triangle_count;
    return true;
}

// Sorts the triangles from far to near into view->sorted.
static void sort_triangles(SurfaceView *view, const Camera *camera)
{
    static _Thread_local int start[BUCKETS + 1];
    const float back[3] = {(float)camera->back.x, (float)camera->back.y, (float)camera->back.z};
    float low = HUGE_VALF, high = -HUGE_VALF;
    for (int pass = 0; pass < 2; pass++) {
        float scale = high > low ? (float)(BUCKETS - 1) / (high - low) : 0;
        for (int i = 0; i < view->triangle_count; i++) {
            const uint32_t *t = view->triangle + 3 * (size_t)i;
            float depth = 0;
            for (int k = 0; k < 3; k++) {
                const float *p = view->position + 3 * (size_t)t[k];
                depth += back[0] * p[0] + back[1] * p[1] + back[2] * p[2];
            }
            if (pass == 0) {
                low = fminf(low, depth);
                high = fmaxf(high, depth);
            } else
                view->bucket[i] = (uint16_t)fminf((depth - low) * scale, BUCKETS - 1);
        }
    }
    memset(start, 0, sizeof start);
    for (int i = 0; i < view->triangle_count; i++)
        start[view->bucket[i] + 1]++;
    for (int b = 0; b < BUCKETS; b++)
        start[b + 1] += start[b];
    for (int i = 0; i < view->triangle_count; i++)
        memcpy(view->sorted + 3 * (size_t)start[view->bucket[i]]++, view->triangle + 3 * (size_t)i, 3 * sizeof *view->sorted);
}

static void set_camera(unsigned program, const Camera *camera, Vec3 origin)
{
    glUseProgram(program);
    float clip[16];
    camera_matrix(camera, origin, clip);
    glUniformMatrix4fv(glGetUniformLocation(program, "clip"), 1, GL_FALSE, clip);
    float eye[9];
    camera_axes(camera, eye);
    glUniformMatrix3fv(glGetUniformLocation(program, "eye"), 1, GL_FALSE, eye);
}

void surface_view_draw_shell(SurfaceView *view, const Camera *camera, const ShellStyle *style)
{
    if (view->triangle_count == 0)
        return;
    unsigned program = view->shell_program;
    set_camera(program, camera, view->origin);
    glUniform3fv(glGetUniformLocation(program, "front"), 1, style->front);
    glUniform3fv(glGetUniformLocation(program, "back"), 1, style->back);
    glUniform3fv(glGetUniformLocation(program, "haze"), 1, style->haze);
    glUniform1f(glGetUniformLocation(program, "haze_amount"), style->haze_amount);
    glUniform4f(glGetUniformLocation(program, "opacity"), style->front_opacity, style->back_opacity, style->rim, style->rim_power);
    // as depth in clip space, 0 near to 1 far
    double range = camera->near_depth - camera->far_depth, from = (camera->near_depth - style->fade_from) / range;
    double to = (camera->near_depth - style->fade_to) / range;
    bool fades = style->fade_to > style->fade_from;
    glUniform2f(glGetUniformLocation(program, "fade"), fades ? (float)from : -1, fades ? (float)to : -2);
    bool is_opaque = style->front_opacity >= 1 && style->back_opacity >= 1 && style->rim >= 1;
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_LEQUAL);
    glDepthMask(is_opaque);
    glDisable(GL_CULL_FACE);
    const uint32_t *order = view->triangle;
    if (is_opaque)
        glDisable(GL_BLEND);
    else {
        sort_triangles(view, camera);
        order = view->sorted;
        glEnable(GL_BLEND);
        glBlendFuncSeparate(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA, GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
    }
    glBindVertexArray(view->shell_array);
    glBufferData(GL_ELEMENT_ARRAY_BUFFER, (GLsizeiptr)((size_t)view->triangle_count * 3 * sizeof *order), order, GL_STREAM_DRAW);
    glDrawElements(GL_TRIANGLES, 3 * view->triangle_count, GL_UNSIGNED_INT, at_byte(0));
    glBindVertexArray(0);
    glDepthMask(GL_TRUE);
    glDisable(GL_BLEND);
}

void surface_view_draw_primitives(SurfaceView *view, const Camera *camera, const Primitives *primitives, const ShellStyle *style)
{
    if (primitives->index_count == 0)
        return;
    set_camera(view->solid_program, camera, primitives->origin);
    glUniform3fv(glGetUniformLocation(view->solid_program, "haze"), 1, style->haze);
    glUniform1f(glGetUniformLocation(view->solid_program, "haze_amount"), 0);
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_LEQUAL);
    glDepthMask(GL_TRUE);
    glDisable(GL_BLEND);
    glDisable(GL_CULL_FACE);
    glBindVertexArray(view->list_array);
    glBindBuffer(GL_ARRAY_BUFFER, view->list_vertices);
    glBufferData(GL_ARRAY_BUFFER, (GLsizeiptr)((size_t)primitives->vertex_count * sizeof *primitives->vertex), primitives->vertex, GL_STREAM_DRAW);
    glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, view->list_indices);
    glBufferData(GL_ELEMENT_ARRAY_BUFFER, (GLsizeiptr)((size_t)primitives->index_count * sizeof *primitives->index), primitives->index, GL_STREAM_DRAW);
    const GLsizei stride = sizeof(PrimitiveVertex);
    glEnableVertexAttribArray(0);
    glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, stride, at_byte(offsetof(PrimitiveVertex, position)));
    glEnableVertexAttribArray(1);
    glVertexAttribPointer(1, 3, GL_FLOAT, GL_FALSE, stride, at_byte(offsetof(PrimitiveVertex, normal)));
    glEnableVertexAttribArray(2);
    glVertexAttribPointer(2, 4, GL_UNSIGNED_BYTE, GL_TRUE, stride, at_byte(offsetof(PrimitiveVertex, color)));
    glDisableVertexAttribArray(3);
    glDrawElements(GL_TRIANGLES, primitives->index_count, GL_UNSIGNED_INT, at_byte(0));
    glBindVertexArray(0);
}

void surface_view_draw_points(SurfaceView *view, const Camera *camera, Vec3 origin, int count, const ViewPoint *point)
{
    if (count < 1)
        return;
    set_camera(view->point_program, camera, origin);
    glEnable(GL_PROGRAM_POINT_SIZE);
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_LEQUAL);
    glDepthMask(GL_TRUE);
    glDisable(GL_BLEND);
    glBindVertexArray(view->list_array);
    glBindBuffer(GL_ARRAY_BUFFER, view->list_vertices);
    glBufferData(GL_ARRAY_BUFFER, (GLsizeiptr)((size_t)count * sizeof *point), point, GL_STREAM_DRAW);
    const GLsizei stride = sizeof(ViewPoint);
    glEnableVertexAttribArray(0);
    glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, stride, at_byte(offsetof(ViewPoint, position)));
    glDisableVertexAttribArray(1);
    glEnableVertexAttribArray(2);
    glVertexAttribPointer(2, 4, GL_UNSIGNED_BYTE, GL_TRUE, stride, at_byte(offsetof(ViewPoint, color)));
    glEnableVertexAttribArray(3);
    glVertexAttribPointer(3, 1, GL_FLOAT, GL_FALSE, stride, at_byte(offsetof(ViewPoint, size)));
    glDrawArrays(GL_POINTS, 0, count);
    glBindVertexArray(0);
}
