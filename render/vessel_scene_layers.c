// One pass for the outer faces and one for the inner ones, each with only the depth test: the nearest surface wins, so no sorting is needed. A wall is
// clear where it is seen face on and dense edge on, (1 - |n_z|)^p, like thin-walled glass: outlines stand out, and the tool is visible through the middle.
#include "render/vessel_scene_layers.h"

#include "render/drawable_mesh.h"
#include "render/gl_canvas.h"
#include "render/message.h"

#include <epoxy/gl.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

static const float vessel_scene_background[3] = {0.075f, 0.088f, 0.112f};

typedef struct WallBuffers {
    unsigned array, vertices, indices;
    int index_count;
} WallBuffers;

typedef struct Layer {         // textures, and the framebuffer drawn into: their own, or a multisampled one
    unsigned framebuffer, color, depth;
} Layer;

struct VesselLayers {
    unsigned wall_program, join_program, empty_array;
    WallBuffers wall[2];       // fine, coarse
    Vec3 origin;
    double reach;              // [mm] of the furthest vertex from origin
    int width, height;
    Layer layer[LAYER_COUNT];
    unsigned smooth_framebuffer, smooth_color, smooth_depth;   // multisampled, for both layers in turn; 0: not supported by the driver
    unsigned base_framebuffer, base;
    LayersKey key;
    bool is_drawn;
};

static const char *const WALL_VERTEX = "#version 330 core\n"
                                       "layout(location = 0) in vec3 position; layout(location = 1) in vec3 normal;\n"
                                       "uniform mat4 clip; uniform mat3 eye; uniform vec4 plane; out vec3 n; out float depth; out float cut;\n"
                                       "void main() { vec4 p = clip * vec4(position, 1.0); gl_Position = p; n = eye * normal; depth = 0.5 + 0.5 * p.z;\n"
                                       "  cut = plane.w - dot(plane.xyz, position); gl_ClipDistance[0] = cut; }\n";

static const char *const WALL_FRAGMENT =
    "#version 330 core\n"
    "in vec3 n; in float depth; in float cut; out vec4 result;\n"
    "uniform vec3 color, haze; uniform vec4 opacity; uniform vec3 range; uniform float edge_width;\n"   // opacity: face on, edge on, power, shine
    "const vec3 key = vec3(-0.36, 0.55, 0.754), fill = vec3(0.7, -0.1, 0.7), halfway = vec3(-0.192, 0.294, 0.936);\n"
    "void main() {\n"
    "  vec3 m = normalize(n); bool outer = gl_FrontFacing;\n"
    // at the outline the interpolated normal may point to the wrong side: the facing of the triangle decides
    "  m = outer == (m.z >= 0.0) ? m : normalize(vec3(m.xy, outer ? 0.001 : -0.001));\n"
    "  float z = abs(m.z), edge = pow(1.0 - z, opacity.z);\n"
    "  vec3 toward = outer ? m : -m;\n"
    "  float light = 0.34 + 0.56 * max(dot(toward, key), 0.0) + 0.16 * max(dot(toward, fill), 0.0);\n"
    "  float shiny = opacity.w * pow(max(dot(toward, halfway), 0.0), 40.0);\n"
    // fade out at the very outline, or its pixels would form steps
    "  float a = mix(opacity.x, opacity.y, edge) * smoothstep(-0.10, 0.38, z);\n"
    "  float far = clamp((depth - range.x) / (range.y - range.x), 0.0, 1.0);\n"
    "  vec3 k = mix(color * (light + 0.34 * edge), haze, range.z * far);\n"
    "  float rim = edge_width > 0.0 ? 1.0 - smoothstep(0.0, edge_width, cut / max(fwidth(cut), 1e-9)) : 0.0;\n"
    "  a = max(a, 0.85 * rim); k = mix(k, vec3(0.98, 0.86, 0.80), 0.75 * rim);\n"
    "  result = vec4(k * a, a) + vec4(vec3(shiny * (1.0 - 0.7 * far)), shiny);\n"
    "}\n";

static const char *const SCREEN_VERTEX = "#version 330 core\n"
                                         "void main() { vec2 p = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0;\n"
                                         "  gl_Position = vec4(p, 0.0, 1.0); }\n";

static const char *const JOIN_FRAGMENT = "#version 330 core\n"
                                         "uniform sampler2D front, back; uniform vec3 background; out vec4 result;\n"
                                         "void main() { ivec2 p = ivec2(gl_FragCoord.xy); vec4 f = texelFetch(front, p, 0), b = texelFetch(back, p, 0);\n"
                                         "  result = vec4(f.rgb + (1.0 - f.a) * (b.rgb + (1.0 - b.a) * background), 1.0); }\n";

static const void *at_byte(size_t offset) { return (const void *)(uintptr_t)offset; }

static bool upload_wall(VesselLayers *layers, WallBuffers *wall, const TriangleMesh *mesh, char *message, size_t capacity)
{
    if (!mesh || mesh->triangle_count == 0)
        return true;
    if (!drawable_mesh_check(mesh, message, capacity))
        return false;
    size_t vertices = (size_t)mesh->vertex_count, indices = 3 * (size_t)mesh->triangle_count;
    float *interleaved = drawable_mesh_floats(mesh, layers->origin, message, capacity);
    if (!interleaved)
        return false;
    for (size_t i = 0; i < vertices; i++) {
        const float *p = interleaved + 6 * i;
        layers->reach = fmax(layers->reach, vec3_norm(vec3(p[0], p[1], p[2])));
    }
    glGenVertexArrays(1, &wall->array);
    glGenBuffers(1, &wall->vertices);
    glGenBuffers(1, &wall->indices);
    glBindVertexArray(wall->array);
    glBindBuffer(GL_ARRAY_BUFFER, wall->vertices);
    glBufferData(GL_ARRAY_BUFFER, (GLsizeiptr)(vertices * 6 * sizeof *interleaved), interleaved, GL_STATIC_DRAW);
    glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, wall->indices);
    glBufferData(GL_ELEMENT_ARRAY_BUFFER, (GLsizeiptr)(indices * sizeof(int)), mesh->triangle, GL_STATIC_DRAW);
    for (unsigned k = 0; k < 2; k++) {
        glEnableVertexAttribArray(k);
        glVertexAttribPointer(k, 3, GL_FLOAT, GL_FALSE, 6 * sizeof(float), at_byte(3 * k * sizeof(float)));
    }
    glBindVertexArray(0);
    wall->index_count = (int)indices;
    free(interleaved);
    return true;
}

VesselLayers *vessel_layers_create(const TriangleMesh *fine, const TriangleMesh *coarse, char *message, size_t capacity)
{
    VesselLayers *layers = calloc(1, sizeof *layers);
    if (!layers) {
        message_fail(message, capacity, "out of memory for the 3D view");
        return NULL;
    }
    if (fine && fine->vertex_count > 0) {
        Vec3 sum = {0, 0, 0};
        for (int i = 0; i < fine->vertex_count; i++)
            sum = vec3_add_scaled(sum, 1.0 / fine->vertex_count, fine->vertex[i]);
        layers->origin = sum;
    }
    layers->wall_program = gl_program_create(WALL_VERTEX, WALL_FRAGMENT, message, capacity);
    layers->join_program = layers->wall_program ? gl_program_create(SCREEN_VERTEX, JOIN_FRAGMENT, message, capacity) : 0;
    if (!layers->join_program || !upload_wall(layers, &layers->wall[0], fine, message, capacity) ||
        !upload_wall(layers, &layers->wall[1], coarse, message, capacity)) {
        vessel_layers_destroy(layers);
        return NULL;
    }
    glGenVertexArrays(1, &layers->empty_array);
    return layers;
}

static void free_pictures(VesselLayers *layers)
{
    for (int k = 0; k < LAYER_COUNT; k++) {
        glDeleteFramebuffers(1, &layers->layer[k].framebuffer);
        const unsigned texture[2] = {layers->layer[k].color, layers->layer[k].depth};
        glDeleteTextures(2, texture);
        layers->layer[k] = (Layer){0};
    }
    const unsigned framebuffer[2] = {layers->smooth_framebuffer, layers->base_framebuffer};
    glDeleteFramebuffers(2, framebuffer);
    const unsigned buffer[2] = {layers->smooth_color, layers->smooth_depth};
    glDeleteRenderbuffers(2, buffer);
    glDeleteTextures(1, &layers->base);
    layers->smooth_framebuffer = layers->smooth_color = layers->smooth_depth = layers->base_framebuffer = layers->base = 0;
    layers->width = layers->height = 0;
}

void vessel_layers_destroy(VesselLayers *layers)
{
    if (!layers)
        return;
    free_pictures(layers);
    glDeleteProgram(layers->wall_program);
    glDeleteProgram(layers->join_program);
    for (int k = 0; k < 2; k++) {
        const unsigned buffer[2] = {layers->wall[k].vertices, layers->wall[k].indices};
        glDeleteBuffers(2, buffer);
        glDeleteVertexArrays(1, &layers->wall[k].array);
    }
    glDeleteVertexArrays(1, &layers->empty_array);
    free(layers);
}

static unsigned make_texture(GLint kind, GLenum format, GLenum type, int width, int height)
{
    unsigned texture = 0;
    glGenTextures(1, &texture);
    glBindTexture(GL_TEXTURE_2D, texture);
    glTexImage2D(GL_TEXTURE_2D, 0, kind, width, height, 0, format, type, NULL);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    return texture;
}

static void make_pictures(VesselLayers *layers, int width, int height)
{
    free_pictures(layers);
    layers->width = width;
    layers->height = height;
    for (int k = 0; k < LAYER_COUNT; k++) {
        Layer *layer = &layers->layer[k];
        layer->color = make_texture(GL_RGBA8, GL_RGBA, GL_UNSIGNED_BYTE, width, height);
        layer->depth = make_texture(GL_DEPTH_COMPONENT32F, GL_DEPTH_COMPONENT, GL_FLOAT, width, height);
        glGenFramebuffers(1, &layer->framebuffer);
        glBindFramebuffer(GL_FRAMEBUFFER, layer->framebuffer);
        glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, layer->color, 0);
        glFramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, layer->depth, 0);
    }
    layers->base = make_texture(GL_RGBA8, GL_RGBA, GL_UNSIGNED_BYTE, width, height);
    glGenFramebuffers(1, &layers->base_framebuffer);
    glBindFramebuffer(GL_FRAMEBUFFER, layers->base_framebuffer);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, layers->base, 0);
    GLint samples = 0;
    glGetIntegerv(GL_MAX_SAMPLES, &samples);
    if (samples < 2)
        return;
    glGenRenderbuffers(1, &layers->smooth_color);
    glBindRenderbuffer(GL_RENDERBUFFER, layers->smooth_color);
    glRenderbufferStorageMultisample(GL_RENDERBUFFER, samples < 4 ? samples : 4, GL_RGBA8, width, height);
    glGenRenderbuffers(1, &layers->smooth_depth);
    glBindRenderbuffer(GL_RENDERBUFFER, layers->smooth_depth);
    glRenderbufferStorageMultisample(GL_RENDERBUFFER, samples < 4 ? samples : 4, GL_DEPTH_COMPONENT32F, width, height);
    glGenFramebuffers(1, &layers->smooth_framebuffer);
    glBindFramebuffer(GL_FRAMEBUFFER, layers->smooth_framebuffer);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, layers->smooth_color);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, layers->smooth_depth);
}

typedef struct WallStyle {
    GLenum culled;
    float color[3];
    float opacity[4];          // face on, edge on, power, shine
} WallStyle;

static const WallStyle wall_style[LAYER_COUNT] = {
    [LAYER_FRONT] = {GL_BACK, {1.00f, 0.62f, 0.56f}, {0.16f, 0.82f, 1.8f, 0.22f}},
    [LAYER_BACK] = {GL_FRONT, {0.88f, 0.36f, 0.36f}, {0.42f, 0.85f, 1.8f, 0.0f}},
};

static void set_wall_uniforms(const VesselLayers *layers, const LayersKey *key)
{
    unsigned program = layers->wall_program;
    const Camera *camera = &key->camera;
    glUseProgram(program);
    float clip[16];
    camera_matrix(camera, layers->origin, clip);
    glUniformMatrix4fv(glGetUniformLocation(program, "clip"), 1, GL_FALSE, clip);
    float eye[9];
    camera_axes(camera, eye);
    glUniformMatrix3fv(glGetUniformLocation(program, "eye"), 1, GL_FALSE, eye);
    Vec3 n = key->section_normal;
    double offset = key->section_offset - vec3_dot(n, layers->origin);
    if (key->has_section)
        glUniform4f(glGetUniformLocation(program, "plane"), (float)n.x, (float)n.y, (float)n.z, (float)offset);
    else
        glUniform4f(glGetUniformLocation(program, "plane"), 0, 0, 0, 1);
    glUniform1f(glGetUniformLocation(program, "edge_width"), key->has_section ? 1.6f : 0);
    glUniform3fv(glGetUniformLocation(program, "haze"), 1, vessel_scene_background);
    // depth range of the vessel, in clip space, 0 near to 1 far
    double deep = camera->near_depth - camera->far_depth, middle = vec3_dot(camera->back, vec3_sub(layers->origin, camera->center));
    double nearest = (camera->near_depth - middle - layers->reach) / deep, furthest = nearest + 2 * layers->reach / deep;
    glUniform3f(glGetUniformLocation(program, "range"), (float)nearest, (float)fmax(furthest, nearest + 1e-6), 0.55f);
}

static void draw_walls(const VesselLayers *layers, const LayersKey *key)
{
    const WallBuffers *wall = &layers->wall[key->is_quick && layers->wall[1].index_count > 0];
    bool smooth = layers->smooth_framebuffer && !key->is_quick;
    set_wall_uniforms(layers, key);
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_LESS);
    glDepthMask(GL_TRUE);
    glDisable(GL_BLEND);
    glDisable(GL_SCISSOR_TEST);
    glDisable(GL_POLYGON_OFFSET_FILL);
    glEnable(GL_CULL_FACE);
    glFrontFace(GL_CCW);
    glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    if (key->has_section)
        glEnable(GL_CLIP_DISTANCE0);
    glViewport(0, 0, layers->width, layers->height);
    for (int k = 0; k < LAYER_COUNT; k++) {
        glBindFramebuffer(GL_FRAMEBUFFER, smooth ? layers->smooth_framebuffer : layers->layer[k].framebuffer);
        glClearColor(0, 0, 0, 0);
        glClearDepth(1);
        glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
        if (wall->index_count > 0) {
            glCullFace(wall_style[k].culled);
            glUniform3fv(glGetUniformLocation(layers->wall_program, "color"), 1, wall_style[k].color);
            glUniform4fv(glGetUniformLocation(layers->wall_program, "opacity"), 1, wall_style[k].opacity);
            glBindVertexArray(wall->array);
            glDrawElements(GL_TRIANGLES, wall->index_count, GL_UNSIGNED_INT, at_byte(0));
        }
        if (smooth) {
            glBindFramebuffer(GL_DRAW_FRAMEBUFFER, layers->layer[k].framebuffer);
            glBlitFramebuffer(0, 0, layers->width, layers->height, 0, 0, layers->width, layers->height, GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT, GL_NEAREST);
        }
    }
    glDisable(GL_CLIP_DISTANCE0);
    glDisable(GL_CULL_FACE);
    glDisable(GL_DEPTH_TEST);
    glBindVertexArray(0);
}

void vessel_layers_bind(const VesselLayers *layers)
{
    const unsigned texture[4] = {layers->layer[LAYER_FRONT].color, layers->layer[LAYER_FRONT].depth, layers->layer[LAYER_BACK].color,
                                 layers->layer[LAYER_BACK].depth};
    for (int k = 3; k >= 0; k--) {
        glActiveTexture(GL_TEXTURE0 + (GLenum)k);
        glBindTexture(GL_TEXTURE_2D, texture[k]);
    }
}

static void join_layers(const VesselLayers *layers)
{
    glBindFramebuffer(GL_FRAMEBUFFER, layers->base_framebuffer);
    glUseProgram(layers->join_program);
    glUniform1i(glGetUniformLocation(layers->join_program, "front"), 0);
    glUniform1i(glGetUniformLocation(layers->join_program, "back"), 2);
    glUniform3fv(glGetUniformLocation(layers->join_program, "background"), 1, vessel_scene_background);
    vessel_layers_bind(layers);
    glBindVertexArray(layers->empty_array);
    glDrawArrays(GL_TRIANGLES, 0, 3);
    glBindVertexArray(0);
}

bool layers_key_same(const LayersKey *a, const LayersKey *b)
{
    // there is no padding between the members of a camera
    return !memcmp(&a->camera, &b->camera, sizeof a->camera) && a->has_section == b->has_section &&
           (!a->has_section || (!memcmp(&a->section_normal, &b->section_normal, sizeof(Vec3)) && a->section_offset == b->section_offset));
}

bool vessel_layers_update(VesselLayers *layers, const LayersKey *key)
{
    if (layers->is_drawn && layers->key.is_quick == key->is_quick && layers_key_same(&layers->key, key))
        return false;
    if (layers->width != key->camera.width || layers->height != key->camera.height)
        make_pictures(layers, key->camera.width, key->camera.height);
    draw_walls(layers, key);
    join_layers(layers);
    layers->key = *key;
    layers->is_drawn = true;
    return true;
}

void vessel_layers_show(const VesselLayers *layers, ViewPort port)
{
    glBindFramebuffer(GL_READ_FRAMEBUFFER, layers->base_framebuffer);
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, port.framebuffer);
    glDisable(GL_SCISSOR_TEST);
    glBlitFramebuffer(0, 0, layers->width, layers->height, port.x, port.y, port.x + port.width, port.y + port.height, GL_COLOR_BUFFER_BIT, GL_NEAREST);
    glBindFramebuffer(GL_FRAMEBUFFER, port.framebuffer);
}
