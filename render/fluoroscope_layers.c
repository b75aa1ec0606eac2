// With I = exp(-attenuation), 1 at the white level of the exposure:
//   live: brightness 1.75 I^0.72; N = quanta I are detected, sigma_I = sqrt(I / quanta), so sigma of the brightness is 1.75 0.72 I^0.22 / sqrt(quanta)
//   DSA: brightness 0.62 exp(-g D), D = attenuation now minus attenuation in the mask; sigma = brightness g sqrt(1 / N_now + 1 / N_mask): the noise of the mask
//   does not change as long as the mask
// The blur of the detector is the 3 x 3 binomial kernel, on layers and on the noise, which has unit variance after it. It is applied to attenuation,
// not to intensity: for neighbours that differ by 0.3 the error is 1 % of the difference.
#include "render/fluoroscope_layers.h"

#include "render/gl_canvas.h"
#include "render/message.h"

#include <epoxy/gl.h>
#include <stddef.h>
#include <stdlib.h>

static const double white = 1.75, live_power = 0.72, subtracted = 0.62;
static const double weakest = 1.0 / 64;              // DSA: below this fraction of white, noise does not grow further
static const double room[2] = {8, 4};                // headroom above white in the baked channels, which may later be darkened

static const char *const SQUARE_VERTEX = "#version 330 core\n"
                                         "out vec2 at;\n"   // 0..1 over the square
                                         "void main() { at = vec2(gl_VertexID == 1 ? 2.0 : 0.0, gl_VertexID == 2 ? 2.0 : 0.0);\n"
                                         "  gl_Position = vec4(2.0 * at - 1.0, 0.0, 1.0); }\n";

static const char *const VOLUME_FRAGMENT =
    "#version 330 core\n"
    "in vec2 at; out float result;\n"
    "uniform vec3 ray[3], grid_ray[3], grid_source; uniform int steps; uniform float most; uniform sampler3D volume;\n"   // ray: towards, right, up
    "void main() { vec2 f = at - 0.5; float size = length(ray[0] + f.x * ray[1] + f.y * ray[2]);\n"
    "  vec3 g = grid_ray[0] + f.x * grid_ray[1] + f.y * grid_ray[2];\n"
    "  vec3 s = 1.0 / (abs(g) + 1e-12) * mix(vec3(-1.0), vec3(1.0), greaterThanEqual(g, vec3(0.0)));\n"
    "  vec3 u = -grid_source * s, w = (1.0 - grid_source) * s, a = min(u, w), b = max(u, w);\n"
    "  float t0 = max(max(a.x, a.y), max(a.z, 0.0)), t1 = min(min(b.x, b.y), b.z), step = (t1 - t0) / float(steps), grid = 0.0;\n"
    "  if (t1 > t0) { vec3 p = grid_source + (t0 + 0.5 * step) * g, by = step * g;\n"
    "    for (int i = 0; i < steps; i++, p += by) grid += texture(volume, p).r; }\n"
    "  result = grid * most * step * size; }\n";

// The length of a pixel's ray in a solid (render/body_shape.c), added to the layer.
static const char *const SHAPE_VERTEX =
    "#version 330 core\n"
    "layout(location = 0) in vec2 place; layout(location = 1) in vec3 source; layout(location = 2) in vec3 ray_towards;\n"
    "layout(location = 3) in vec3 ray_right; layout(location = 4) in vec3 ray_up; layout(location = 5) in vec4 plane_0;\n"
    "layout(location = 6) in vec4 plane_1; layout(location = 7) in vec3 density;\n"
    "flat out vec3 from, towards, right, up, solid; flat out vec4 first, second;\n"
    "void main() { gl_Position = vec4(2.0 * place - 1.0, 0.0, 1.0); from = source; towards = ray_towards; right = ray_right; up = ray_up;\n"
    "  first = plane_0; second = plane_1; solid = density; }\n";
static const char *const SHAPE_FRAGMENT =
    "#version 330 core\n"
    "flat in vec3 from, towards, right, up, solid; flat in vec4 first, second; out float result; uniform vec3 size; uniform float side;\n"
    "vec2 cut(vec4 plane, vec2 f) { float rate = plane.x + f.x * plane.y + f.y * plane.z, t = -plane.w / (abs(rate) < 1e-6 ? 1e-6 : rate);\n"
    "  return rate < 0.0 ? vec2(t, 1e9) : vec2(-1e9, t); }\n"
    "void main() { vec2 f = gl_FragCoord.xy / side - 0.5; vec3 v = towards + f.x * right + f.y * up;\n"
    // start from the point of the line closest to the centre: b^2 - a c of large numbers would cancel
    "  float a = max(dot(v, v), 1e-9), middle = -dot(from, v) / a; vec3 p = from + middle * v; float q = dot(p, p);\n"
    "  vec2 c = cut(first, f), d = cut(second, f); float low = max(max(c.x, d.x), 0.0), high = min(c.y, d.y);\n"
    "  vec2 h = sqrt(max(vec2(1.0, solid.z) - q, 0.0) / a), l = max(min(middle + h, high) - max(middle - h, low), 0.0);\n"
    "  result = dot(solid.xy, l) * length(vec3(size.x, f * size.y)); }\n";

// What the display makes of the attenuation of the anatomy (anatomy_shown).
#define SHOWN                                                                                                                                                  \
    "uniform float mean; uniform vec3 shown;\n"                                                                                                                \
    "float show(float a) { float x = shown.x * (max(a, 0.0) - mean); return shown.y + (x > 0.0 ? x : shown.z * (exp(x / shown.z) - 1.0)); }\n"

// Shared by the shaders that read the lumen. TAPS_4 is the blur of the detector; a layer of half the resolution is blurred by its single tap. llvmpipe
// executes both sides of a branch, so variants are compiled separately.
#define TAPS_4                                                                                                                                                 \
    "#version 330 core\n"                                                                                                                                      \
    "float tap(sampler2D layer, vec2 at) { vec2 h = 0.5 / vec2(textureSize(layer, 0));\n"                                                                      \
    "  vec2 g = vec2(h.x, -h.y);\n"                                                                                                                            \
    "  return 0.25 * (texture(layer, at + h).r + texture(layer, at - h).r + texture(layer, at + g).r + texture(layer, at - g).r); }\n"
#define TAPS_1 "#version 330 core\nfloat tap(sampler2D layer, vec2 at) { return texture(layer, at).r; }\n"
#define WITH_ROADMAP "#define ROADMAP\n"
static const char *const LUMEN_HEAD[2][2] = {{TAPS_4, TAPS_4 WITH_ROADMAP}, {TAPS_1, TAPS_1 WITH_ROADMAP}};   // full or less than full resolution, roadmap

static const char *const TOTAL_FRAGMENT =
    "in vec2 at; out float result; uniform sampler2D anatomy, lumen; uniform float slant, contrast; uniform bvec2 has;\n" SHOWN
    "void main() { vec2 f = slant * (at - 0.5); result = has.x ? show(texture(anatomy, at).r) : 0.0;\n"
    "  if (has.y) result += contrast * max(tap(lumen, at), 0.0) * sqrt(1.0 + dot(f, f)); }\n";

static const char *const OPACIFY_FRAGMENT = "in vec2 at; out vec4 result; uniform sampler2D bare, lumen, roadmap; uniform float slant; uniform vec2 power;\n"
                                            "void main() { vec2 f = slant * (at - 0.5); float along = sqrt(1.0 + dot(f, f)); vec4 b = texture(bare, at);\n"
                                            "  b.xy *= exp2(-power * (max(tap(lumen, at), 0.0) * along));\n"
                                            "#ifdef ROADMAP\n"
                                            "  b.z = b.w * (1.0 - exp2(-0.45 * max(tap(roadmap, at), 0.0) * along));\n"
                                            "#endif\n"
                                            "  result = b; }\n";

static const char *const LIVE_HEAD = "#version 330 core\n";
static const char *const DSA_HEAD = "#version 330 core\n#define SUBTRACTED\n";
static const char *const BAKE_FRAGMENT =
    "in vec2 at; out vec4 result; uniform sampler2D anatomy, mask, noise; uniform bool has_anatomy; uniform ivec3 offset;\n"
    "uniform float exposure, gain, weakest, mask_noise, dark; uniform vec4 blades; uniform vec2 soft; uniform vec2 room;\n" SHOWN
    "void main() { float a = has_anatomy ? show(texture(anatomy, at).r) : 0.0; vec2 r;\n"
    "#ifdef SUBTRACTED\n"
    "  float m = texture(mask, at).r, d = a - m; ivec2 g = ivec2(gl_FragCoord.xy); g = offset.z != 0 ? g.yx : g;\n"
    "  d += mask_noise * inversesqrt(clamp(exp(exposure - m), weakest, 1.0)) * (texelFetch(noise, (g + offset.xy) & 511, 0).r * 8.0 - 4.0);\n"
    "  r.x = dark * exp(-gain * d); r.y = r.x * inversesqrt(clamp(exp(exposure - a), weakest, 1.0)) * sqrt(weakest);\n"
    "#else\n"
    "  r = exp((exposure - a) * vec2(0.72, 0.22));\n"
    "#endif\n"
    "  vec2 p = at - 0.5, middle = 0.5 * (blades.yw + blades.xz), half_side = 0.5 * (blades.yw - blades.xz);\n"
    "  float c = min(soft.x, min(half_side.x, half_side.y)); vec2 q = abs(p - middle) - half_side + c;\n"
    "  float outside = length(max(q, 0.0)) + min(max(q.x, q.y), 0.0) - c, open = smoothstep(soft.y, -soft.y, outside);\n"
    "  result = vec4(r / room * vec2(open, sqrt(open)), 0.0, open); }\n";

static const char *const TOOL_VERTEX = "#version 330 core\n"
                                       "layout(location = 0) in vec2 place; layout(location = 1) in vec3 profile; layout(location = 2) in vec2 density;\n"
                                       "uniform float side; out vec3 tube; out vec2 d;\n"
                                       "void main() { gl_Position = vec4(2.0 * place / side - 1.0, 0.0, 1.0); tube = profile; d = density; }\n";
// for each circle the integral of sqrt(r^2 - x^2) between pixel borders, over three pixels for the blur of the detector
static const char *const TOOL_FRAGMENT = "#version 330 core\n"
                                         "in vec3 tube; in vec2 d; out vec4 result; uniform vec2 power; uniform bool as_attenuation;\n"
                                         "float chord(float r) { vec4 u = clamp((tube.x + vec4(-1.5, -0.5, 0.5, 1.5)) / r, -1.0, 1.0);\n"
                                         "  vec4 area = r * r * (u * sqrt(max(1.0 - u * u, 0.0)) + asin(u));\n"
                                         "  return 0.25 * (area.y - area.x) + 0.5 * (area.z - area.y) + 0.25 * (area.w - area.z); }\n"
                                         "void main() { float a = d.x * chord(max(tube.y, 1e-6)); if (tube.z > 0.0) a += d.y * chord(tube.z);\n"
                                         "  result = as_attenuation ? vec4(a) : vec4(exp(-power * a), 1.0, 1.0); }\n";

// nearest texels by interpolated coordinates: half the time of texelFetch on llvmpipe
static const char *const SHOW_VERTEX =
    "#version 330 core\n"
    "uniform float side; uniform ivec3 offset; out vec2 at, grain;\n"
    "void main() { at = vec2(gl_VertexID == 1 ? 2.0 : 0.0, gl_VertexID == 2 ? 2.0 : 0.0); gl_Position = vec4(2.0 * at - 1.0, 0.0, 1.0);\n"
    "  vec2 p = at * side; grain = ((offset.z != 0 ? p.yx : p) + vec2(offset.xy)) / 512.0; }\n";
static const char *const SHOW_FRAGMENT =
    "in vec2 at, grain; out vec4 result; uniform sampler2D baked, noise; uniform vec2 scale;\n"
    "void main() { vec4 b = texture(baked, at); float grey = scale.x * b.x + scale.y * b.y * (texture(noise, grain).r - 0.5);\n"
    "  result = vec4(grey, grey, grey, 1.0); TINT }\n";
static const char *const NO_TINT = "#version 330 core\n#define TINT\n";
static const char *const TINT = "#version 330 core\n"
                                "#define TINT result.rgb = clamp(result.rgb, 0.0, 1.0) * mix(vec3(1.0), vec3(0.55, 1.10, 1.20), 0.75 * b.z);\n";

// --- random numbers ---

static uint64_t mix_bits(uint64_t x)
{
    x += 0x9e3779b97f4a7c15u;
    x = (x ^ x >> 30) * 0xbf58476d1ce4e5b9u;
    x = (x ^ x >> 27) * 0x94d049bb133111ebu;
    return x ^ x >> 31;
}

// Offset in the noise tile for a pulse, and whether it is rotated.
static void noise_offset(uint32_t pulse, int offset[3])
{
    uint64_t bits = mix_bits(pulse);
    offset[0] = (int)(bits & (NOISE_SIDE - 1));
    offset[1] = (int)(bits >> 16 & (NOISE_SIDE - 1));
    offset[2] = (int)(bits >> 32 & 1);
}

static bool make_noise(LayerPrograms *programs)
{
    const size_t n = NOISE_SIDE, cells = n * n;
    double *raw = malloc(cells * sizeof *raw), *soft = malloc(cells * sizeof *soft), square = 0;
    uint8_t *tile = programs->tile[0] = malloc(cells), *turned = programs->tile[1] = malloc(cells);
    bool good = raw && soft && tile && turned;
    for (size_t i = 0; good && i < cells; i++) {
        // Box-Muller method
        double u = (double)((mix_bits(2 * i) >> 11) + 1) / 9007199254740993.0, v = (double)(mix_bits(2 * i + 1) >> 11) / 9007199254740992.0;
        raw[i] = sqrt(-2 * log(u)) * cos(2 * PI * v);
    }
    static const double kernel[3] = {0.25, 0.5, 0.25};
    for (size_t i = 0; good && i < cells; i++) {
        soft[i] = 0;
        for (size_t k = 0; k < 9; k++)
            soft[i] += kernel[k % 3] * kernel[k / 3] * raw[(i / n + k / 3 + n - 1) % n * n + (i % n + k % 3 + n - 1) % n];
        square += soft[i] * soft[i];
    }
    for (size_t i = 0; good && i < cells; i++)
        tile[i] = (uint8_t)lround(fmin(fmax((soft[i] / sqrt(square / (double)cells) + 4) / 8, 0), 1) * 255);
    if (good) {
        for (size_t i = 0; i < cells; i++)
            turned[i % n * n + i / n] = tile[i];
        glGenTextures(1, &programs->noise);
        glBindTexture(GL_TEXTURE_2D, programs->noise);
        glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
        glTexImage2D(GL_TEXTURE_2D, 0, GL_R8, NOISE_SIDE, NOISE_SIDE, 0, GL_RED, GL_UNSIGNED_BYTE, tile);
        glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
        glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    }
    free(raw);
    free(soft);
    return good;
}

// --- create ---

static unsigned square_program(const char *vertex, const char *head, const char *fragment, char *message, size_t capacity)
{
    char text[8192];
    snprintf(text, sizeof text, "%s%s", head, fragment);
    return gl_program_create(vertex, text, message, capacity);
}

static void send_volume(LayerPrograms *programs, const Anatomy *anatomy)
{
    glGenTextures(1, &programs->volume);
    glBindTexture(GL_TEXTURE_3D, programs->volume);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
    glTexImage3D(GL_TEXTURE_3D, 0, GL_R8, anatomy->size[0], anatomy->size[1], anatomy->size[2], 0, GL_RED, GL_UNSIGNED_BYTE, anatomy->level);
    glTexParameteri(GL_TEXTURE_3D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_3D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    for (int k = 0; k < 3; k++)
        glTexParameteri(GL_TEXTURE_3D, (const GLenum[]){GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T, GL_TEXTURE_WRAP_R}[k], GL_CLAMP_TO_EDGE);
}

static void add_attribute(unsigned location, int floats, size_t stride, size_t offset)
{
    glEnableVertexAttribArray(location);
    glVertexAttribPointer(location, floats, GL_FLOAT, GL_FALSE, (GLsizei)stride, (const void *)offset);
}

static void make_shape_array(LayerPrograms *programs)
{
    const size_t stride = sizeof(ShadowVertex);
    glGenVertexArrays(1, &programs->shape_array);
    glGenBuffers(1, &programs->shape_vertices);
    glBindVertexArray(programs->shape_array);
    glBindBuffer(GL_ARRAY_BUFFER, programs->shape_vertices);
    add_attribute(0, 2, stride, offsetof(ShadowVertex, place));
    add_attribute(1, 3, stride, offsetof(ShadowVertex, from));
    for (unsigned k = 0; k < 3; k++)
        add_attribute(2 + k, 3, stride, offsetof(ShadowVertex, ray) + k * 3 * sizeof(float));
    for (unsigned k = 0; k < 2; k++)
        add_attribute(5 + k, 4, stride, offsetof(ShadowVertex, plane) + k * 4 * sizeof(float));
    add_attribute(7, 3, stride, offsetof(ShadowVertex, solid));
    glBindVertexArray(0);
}

static void make_tool_array(LayerPrograms *programs)
{
    glGenVertexArrays(1, &programs->tool_array);
    glGenBuffers(1, &programs->tool_vertices);
    glBindVertexArray(programs->tool_array);
    glBindBuffer(GL_ARRAY_BUFFER, programs->tool_vertices);
    add_attribute(0, 2, sizeof(RibbonVertex), 0);
    add_attribute(1, 3, sizeof(RibbonVertex), offsetof(RibbonVertex, across));
    add_attribute(2, 2, sizeof(RibbonVertex), offsetof(RibbonVertex, density));
    glBindVertexArray(0);
}

bool layers_create(LayerPrograms *programs, const Anatomy *anatomy, char *message, size_t capacity)
{
    *programs = (LayerPrograms){0};
    struct {
        unsigned *program;
        const char *vertex, *head, *fragment;
    } wanted[] = {{&programs->volume_march, SQUARE_VERTEX, "", VOLUME_FRAGMENT},
                  {&programs->shape, SHAPE_VERTEX, "", SHAPE_FRAGMENT},
                  {&programs->total, SQUARE_VERTEX, LUMEN_HEAD[0][0], TOTAL_FRAGMENT},
                  {&programs->bake[0], SQUARE_VERTEX, LIVE_HEAD, BAKE_FRAGMENT},
                  {&programs->bake[1], SQUARE_VERTEX, DSA_HEAD, BAKE_FRAGMENT},
                  {&programs->opacify[0][0], SQUARE_VERTEX, LUMEN_HEAD[0][0], OPACIFY_FRAGMENT},
                  {&programs->opacify[0][1], SQUARE_VERTEX, LUMEN_HEAD[0][1], OPACIFY_FRAGMENT},
                  {&programs->opacify[1][0], SQUARE_VERTEX, LUMEN_HEAD[1][0], OPACIFY_FRAGMENT},
                  {&programs->opacify[1][1], SQUARE_VERTEX, LUMEN_HEAD[1][1], OPACIFY_FRAGMENT},
                  {&programs->tool, TOOL_VERTEX, "", TOOL_FRAGMENT},
                  {&programs->show[0], SHOW_VERTEX, NO_TINT, SHOW_FRAGMENT},
                  {&programs->show[1], SHOW_VERTEX, TINT, SHOW_FRAGMENT}};
    for (size_t i = 0; i < sizeof wanted / sizeof *wanted; i++)
        if (!(*wanted[i].program = square_program(wanted[i].vertex, wanted[i].head, wanted[i].fragment, message, capacity)))
            return false;
    if (!make_noise(programs))
        return message_fail(message, capacity, "out of memory for the noise of fluoroscopy");
    glGenVertexArrays(1, &programs->empty_array);
    make_tool_array(programs);
    make_shape_array(programs);
    if (anatomy->level)
        send_volume(programs, anatomy);
    return true;
}

void layers_destroy(LayerPrograms *programs)
{
    const unsigned program[12] = {programs->volume_march,  programs->shape,         programs->total,         programs->bake[0],
                                  programs->bake[1],       programs->opacify[0][0], programs->opacify[0][1], programs->opacify[1][0],
                                  programs->opacify[1][1], programs->tool,          programs->show[0],       programs->show[1]};
    for (int i = 0; i < 12; i++)
        if (program[i])
            glDeleteProgram(program[i]);
    glDeleteVertexArrays(1, &programs->empty_array);
    glDeleteVertexArrays(1, &programs->tool_array);
    glDeleteBuffers(1, &programs->tool_vertices);
    glDeleteVertexArrays(1, &programs->shape_array);
    glDeleteBuffers(1, &programs->shape_vertices);
    glDeleteTextures(1, &programs->noise);
    glDeleteTextures(1, &programs->volume);
    free(programs->tile[0]);
    free(programs->tile[1]);
    *programs = (LayerPrograms){0};
}

bool layer_fit(Layer *layer, int side, LayerFormat format)
{
    if (layer->side == side)
        return true;
    GLint filter = format == LAYER_RGBA16 || format == LAYER_RG16 ? GL_NEAREST : GL_LINEAR;
    layer_destroy(layer);
    glGenTextures(1, &layer->texture);
    glBindTexture(GL_TEXTURE_2D, layer->texture);
    if (format == LAYER_R32F)
        glTexImage2D(GL_TEXTURE_2D, 0, GL_R32F, side, side, 0, GL_RED, GL_FLOAT, NULL);
    else if (format == LAYER_RG16)
        glTexImage2D(GL_TEXTURE_2D, 0, GL_RG16, side, side, 0, GL_RG, GL_UNSIGNED_SHORT, NULL);
    else
        glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA16, side, side, 0, GL_RGBA, GL_UNSIGNED_SHORT, NULL);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, filter);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, filter);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    glGenFramebuffers(1, &layer->framebuffer);
    glBindFramebuffer(GL_FRAMEBUFFER, layer->framebuffer);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, layer->texture, 0);
    if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE) {
        layer_destroy(layer);
        return false;
    }
    layer->side = side;
    return true;
}

void layer_destroy(Layer *layer)
{
    if (layer->framebuffer)
        glDeleteFramebuffers(1, &layer->framebuffer);
    if (layer->texture)
        glDeleteTextures(1, &layer->texture);
    *layer = (Layer){0};
}

// --- passes ---

void layers_set_state(void)
{
    static const GLenum off[] = {GL_SCISSOR_TEST, GL_DEPTH_TEST, GL_STENCIL_TEST, GL_CULL_FACE, GL_BLEND, GL_FRAMEBUFFER_SRGB, GL_COLOR_LOGIC_OP};
    for (size_t i = 0; i < sizeof off / sizeof *off; i++)
        glDisable(off[i]);
    glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    glPolygonMode(GL_FRONT_AND_BACK, GL_FILL);
    glFrontFace(GL_CCW);
}

static void bind_layer(const Layer *layer)
{
    glBindFramebuffer(GL_FRAMEBUFFER, layer->framebuffer);
    glViewport(0, 0, layer->side, layer->side);
}

void layer_put(const Layer *layer, int first, int rows, const float *value)
{
    glActiveTexture(GL_TEXTURE0);
    glBindTexture(GL_TEXTURE_2D, layer->texture);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
    glTexSubImage2D(GL_TEXTURE_2D, 0, 0, first, layer->side, rows, GL_RED, GL_FLOAT, value);
}

void layer_begin(const Layer *layer)
{
    bind_layer(layer);
    glClearColor(0, 0, 0, 0);
    glClear(GL_COLOR_BUFFER_BIT);
}

static void draw_square(const LayerPrograms *programs)
{
    glBindVertexArray(programs->empty_array);
    glDrawArrays(GL_TRIANGLES, 0, 3);
    glBindVertexArray(0);
}

static void set_vec3(unsigned program, const char *name, Vec3 v) { glUniform3f(glGetUniformLocation(program, name), (float)v.x, (float)v.y, (float)v.z); }
static void set_float(unsigned program, const char *name, double v) { glUniform1f(glGetUniformLocation(program, name), (float)v); }
static void set_int(unsigned program, const char *name, int v) { glUniform1i(glGetUniformLocation(program, name), v); }

static void set_texture(unsigned program, const char *name, int unit, GLenum target, unsigned texture)
{
    set_int(program, name, unit);
    glActiveTexture(GL_TEXTURE0 + (GLenum)unit);
    glBindTexture(target, texture);
    glActiveTexture(GL_TEXTURE0);
}

static void march_volume(const LayerPrograms *programs, const Anatomy *anatomy, const CArm *c_arm, int steps)
{
    unsigned program = programs->volume_march;
    static const char *const ray[2][3] = {{"ray[0]", "ray[1]", "ray[2]"}, {"grid_ray[0]", "grid_ray[1]", "grid_ray[2]"}};
    const Vec3 along[3] = {vec3_scale(c_arm->towards, C_ARM_SOURCE_MM), vec3_scale(c_arm->right, c_arm->field_mm), vec3_scale(c_arm->up, c_arm->field_mm)};
    glUseProgram(program);
    for (int k = 0; k < 3; k++) {
        set_vec3(program, ray[0][k], along[k]);
        set_vec3(program, ray[1][k], mat3_mul_vec(&anatomy->to_grid, along[k]));
    }
    set_vec3(program, "grid_source", mat3_mul_vec(&anatomy->to_grid, vec3_sub(c_arm_source(c_arm), anatomy->origin)));
    set_int(program, "steps", steps);
    set_float(program, "most", anatomy->most);
    set_texture(program, "volume", 0, GL_TEXTURE_3D, programs->volume);
    draw_square(programs);
}

static void add_shapes(const LayerPrograms *programs, const ShapeShadows *shadows, const CArm *c_arm, int side)
{
    unsigned program = programs->shape;
    glUseProgram(program);
    set_vec3(program, "size", vec3(C_ARM_SOURCE_MM, c_arm->field_mm, 0));
    set_float(program, "side", side);
    glEnable(GL_BLEND);
    glBlendEquation(GL_FUNC_ADD);
    glBlendFunc(GL_ONE, GL_ONE);
    glBindVertexArray(programs->shape_array);
    glBindBuffer(GL_ARRAY_BUFFER, programs->shape_vertices);
    glBufferData(GL_ARRAY_BUFFER, (GLsizeiptr)((size_t)shadows->count * sizeof *shadows->vertex), shadows->vertex, GL_STREAM_DRAW);
    glDrawArrays(GL_TRIANGLES, 0, shadows->count);
    glBindVertexArray(0);
    glDisable(GL_BLEND);
}

void layers_draw_anatomy(const LayerPrograms *programs, const Anatomy *anatomy, const ShapeShadows *shadows, const CArm *c_arm, const Layer *to, int first,
                         int rows, int steps)
{
    bind_layer(to);
    glEnable(GL_SCISSOR_TEST);
    glScissor(0, first, to->side, rows);
    glClearColor(0, 0, 0, 0);
    glClear(GL_COLOR_BUFFER_BIT);
    if (programs->volume)
        march_volume(programs, anatomy, c_arm, steps);
    if (shadows->count > 0)
        add_shapes(programs, shadows, c_arm, to->side);
    glDisable(GL_SCISSOR_TEST);
}

static void set_shown(unsigned program, const LayerTone *tone)
{
    set_float(program, "mean", tone->mean);
    set_vec3(program, "shown", vec3(SHOWN_SLOPE, SHOWN_SHIFT, SHOWN_BRIGHTEST));
}

static unsigned texture_of(const Layer *layer) { return layer ? layer->texture : 0; }

void layers_draw_total(const LayerPrograms *programs, const Layer *anatomy, const Layer *lumen, const CArm *c_arm, const LayerTone *tone, const Layer *to)
{
    unsigned program = programs->total;
    bind_layer(to);
    glUseProgram(program);
    set_texture(program, "anatomy", 0, GL_TEXTURE_2D, texture_of(anatomy));
    set_texture(program, "lumen", 1, GL_TEXTURE_2D, texture_of(lumen));
    glUniform2i(glGetUniformLocation(program, "has"), anatomy != NULL, lumen != NULL);
    set_float(program, "slant", c_arm->field_mm / C_ARM_SOURCE_MM);
    set_float(program, "contrast", tone->contrast);
    set_shown(program, tone);
    draw_square(programs);
}

// The exponents of transmission for brightness and noise.
static void tone_powers(const LayerTone *tone, double power[2])
{
    power[0] = tone->is_subtracted ? tone->gain : live_power;
    power[1] = power[0] - 0.5;
}

// The powers of two by which a millimetre of contrast agent darkens brightness and noise.
static void lumen_powers(const LayerTone *tone, double power[2])
{
    tone_powers(tone, power);
    for (int k = 0; k < 2; k++)
        power[k] *= tone->contrast / log(2);
}

// Full scale of the baked brightness, and of the baked noise for a tile that stores n / 8, in units of the screen's white.
static void shown_units(const LayerTone *tone, double unit[2])
{
    const double noise = tone->is_subtracted ? white * tone->gain / sqrt(weakest) : white * live_power;
    unit[0] = white * room[0];
    unit[1] = tone->quanta > 0 ? 8 * room[1] * noise / sqrt(tone->quanta) : 0;
}

void layers_bake(const LayerPrograms *programs, const Layer *anatomy, const Layer *mask, const LayerTone *tone, const float blades[4], uint32_t mask_pulse,
                 const Layer *to)
{
    unsigned program = programs->bake[tone->is_subtracted];
    double edge[4];
    int offset[3];
    for (int k = 0; k < 4; k++) {
        // fully open blades still frame the picture
        double covered = isfinite(blades[k]) ? fmin(fmax(blades[k], 0), 0.95) : 0;
        edge[k] = (k % 2 ? 0.5 : -0.5) * fmin(1 - covered, 0.965);
    }
    noise_offset(mask_pulse, offset);
    bind_layer(to);
    glUseProgram(program);
    set_texture(program, "anatomy", 0, GL_TEXTURE_2D, texture_of(anatomy));
    set_texture(program, "mask", 1, GL_TEXTURE_2D, texture_of(mask));
    set_texture(program, "noise", 2, GL_TEXTURE_2D, programs->noise);
    set_int(program, "has_anatomy", anatomy != NULL);
    set_float(program, "exposure", tone->exposure);
    set_shown(program, tone);
    set_float(program, "gain", tone->gain);
    set_float(program, "weakest", weakest);
    set_float(program, "mask_noise", tone->quanta > 0 ? 1 / sqrt(tone->quanta) : 0);
    set_float(program, "dark", subtracted / white);
    glUniform4f(glGetUniformLocation(program, "blades"), (float)edge[0], (float)edge[1], (float)edge[2], (float)edge[3]);
    glUniform2f(glGetUniformLocation(program, "soft"), 0.05f, 10.0f / 720);
    glUniform2f(glGetUniformLocation(program, "room"), (float)room[0], (float)room[1]);
    glUniform3iv(glGetUniformLocation(program, "offset"), 1, offset);
    draw_square(programs);
}

void layers_opacify(const LayerPrograms *programs, const Layer *bare, const Layer *lumen, const Layer *roadmap, const CArm *c_arm, const LayerTone *tone,
                    const int low[2], const int high[2], const Layer *to)
{
    unsigned program = programs->opacify[lumen->side < to->side][roadmap != NULL];
    double power[2];
    lumen_powers(tone, power);
    if (high[0] <= low[0] || high[1] <= low[1])
        return;
    bind_layer(to);
    glUseProgram(program);
    set_texture(program, "bare", 0, GL_TEXTURE_2D, bare->texture);
    set_texture(program, "lumen", 1, GL_TEXTURE_2D, lumen->texture);
    set_texture(program, "roadmap", 2, GL_TEXTURE_2D, texture_of(roadmap));
    set_float(program, "slant", c_arm->field_mm / C_ARM_SOURCE_MM);
    glUniform2f(glGetUniformLocation(program, "power"), (float)power[0], (float)power[1]);
    glEnable(GL_SCISSOR_TEST);
    glScissor(low[0], low[1], high[0] - low[0], high[1] - low[1]);
    draw_square(programs);
    glDisable(GL_SCISSOR_TEST);
}

void layers_draw_tools(const LayerPrograms *programs, const Ribbon *ribbon, const LayerTone *tone, bool as_attenuation, const Layer *to)
{
    if (ribbon->count < 1)
        return;
    unsigned program = programs->tool;
    double power[2];
    tone_powers(tone, power);
    bind_layer(to);
    glUseProgram(program);
    set_float(program, "side", to->side);
    glUniform2f(glGetUniformLocation(program, "power"), (float)power[0], (float)power[1]);
    set_int(program, "as_attenuation", as_attenuation);
    glEnable(GL_BLEND);
    glBlendEquation(GL_FUNC_ADD);
    glBlendFunc(as_attenuation ? GL_ONE : GL_ZERO, as_attenuation ? GL_ONE : GL_SRC_COLOR);
    glBindVertexArray(programs->tool_array);
    glBindBuffer(GL_ARRAY_BUFFER, programs->tool_vertices);
    glBufferData(GL_ARRAY_BUFFER, (GLsizeiptr)((size_t)ribbon->count * sizeof *ribbon->vertex), ribbon->vertex, GL_STREAM_DRAW);
    glDrawArrays(GL_TRIANGLES, 0, ribbon->count);
    glBindVertexArray(0);
    glDisable(GL_BLEND);
}

void layers_show(const LayerPrograms *programs, const Layer *baked, const LayerTone *tone, uint32_t pulse, unsigned framebuffer, int x, int y, int side)
{
    unsigned program = programs->show[tone->has_roadmap];
    int offset[3];
    double unit[2];
    noise_offset(pulse, offset);
    shown_units(tone, unit);
    bind_layer(baked);
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
    glViewport(x, y, side, side);
    glUseProgram(program);
    set_texture(program, "baked", 0, GL_TEXTURE_2D, baked->texture);
    set_texture(program, "noise", 1, GL_TEXTURE_2D, programs->noise);
    set_float(program, "side", side);
    glUniform3iv(glGetUniformLocation(program, "offset"), 1, offset);
    glUniform2f(glGetUniformLocation(program, "scale"), (float)unit[0], (float)unit[1]);
    draw_square(programs);
}

void layers_take_tools(const LayerPrograms *programs, const Ribbon *ribbon, const LayerTone *tone, const Layer *tools, XrayPixels *to)
{
    const int *low = ribbon->low, *high = ribbon->high, none[2] = {0, 0};
    if (ribbon->count < 1 || high[0] <= low[0] || high[1] <= low[1]) {
        xray_pixels_take_tools(to, tools->framebuffer, none, none);
        return;
    }
    bind_layer(tools);
    glEnable(GL_SCISSOR_TEST);
    glScissor(low[0], low[1], high[0] - low[0], high[1] - low[1]);
    glClearColor(1, 1, 1, 1);
    glClear(GL_COLOR_BUFFER_BIT);
    glDisable(GL_SCISSOR_TEST);
    layers_draw_tools(programs, ribbon, tone, false, tools);
    xray_pixels_take_tools(to, tools->framebuffer, low, high);
}

bool layers_show_pixels(const LayerPrograms *programs, XrayPixels *pixels, bool has_lumen, const CArm *c_arm, const LayerTone *tone, uint32_t pulse,
                        ViewPort port, const int corner[2], int side)
{
    int offset[3];
    noise_offset(pulse, offset);
    const bool is_rotated = offset[2] != 0;
    PixelLook look = {.slant = c_arm->field_mm / C_ARM_SOURCE_MM,
                      .noise = programs->tile[is_rotated],
                      .offset = {offset[is_rotated], offset[!is_rotated]},
                      .has_lumen = has_lumen,
                      .has_roadmap = tone->has_roadmap};
    lumen_powers(tone, look.power);
    shown_units(tone, look.unit);
    return xray_pixels_show(pixels, &look, port, corner, side, SURROUNDINGS_GREY);
}
