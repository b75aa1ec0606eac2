// Ribbons: the points of a polyline are projected; each gets two vertices perpendicular to the mean direction of its two pieces in the picture (mitred), and
// each
// piece becomes a quad. Ends get one more quad, on which the distance to the end point gives a half disc. The distance d of a fragment from the axis gives
// its coverage, half + 1/2 - d, and its normal: d / half towards the side, the rest towards the eye, perpendicular to the axis.
// Quads are sorted by depth instead of tested against a depth buffer: smooth edges blend with what is behind them, and the target need not have a depth buffer.
#include "render/vessel_scene_strokes.h"

#include "render/gl_canvas.h"

#include <epoxy/gl.h>
#include <stdlib.h>
#include <string.h>

typedef struct StrokePoint {
    Vec3 pixel;                // x right, y up, depth 0 to 1
    Vec3 eye;                  // right, up, towards the eye [mm]
    double half;
    double side[2], stretch;   // unit normal in the picture, and the factor by which the corner of the mitre lies further out
    Vec3 facing;
    Color color;
} StrokePoint;

static const char *const VERTEX =
    "#version 330 core\n"
    "layout(location = 0) in vec2 place; layout(location = 1) in vec4 shape; layout(location = 2) in vec2 side; layout(location = 3) in vec3 facing;\n"
    "layout(location = 4) in vec4 color; uniform vec2 size; out vec3 s; out vec2 across; out vec3 up; out vec4 c; out float depth;\n"
    "void main() { gl_Position = vec4(2.0 * place / size - 1.0, 0.0, 1.0); s = shape.xyz; depth = shape.w; across = side; up = facing; c = color; }\n";

static const char *const FRAGMENT =
    "#version 330 core\n"
    "in vec3 s; in vec2 across; in vec3 up; in vec4 c; in float depth; out vec4 result;\n"
    "uniform sampler2D front, front_depth, back, back_depth; uniform vec2 corner; uniform float pixel_depth;\n"
    "const vec3 key = vec3(-0.36, 0.55, 0.754), halfway = vec3(-0.192, 0.294, 0.936);\n"
    "void main() {\n"
    "  float d = length(s.xy), a = c.a * clamp(s.z + 0.5 - d, 0.0, 1.0);\n"
    "  if (a <= 0.004) discard;\n"
    "  float u = clamp(s.x / s.z, -0.97, 0.97);\n"
    "  vec3 n = normalize(vec3(across * u, 0.0) + up * sqrt(1.0 - u * u));\n"
    "  float wide = clamp(s.z - 0.8, 0.0, 1.0);\n"   // hairlines are not lit
    "  vec3 k = c.rgb * mix(1.0, 0.52 + 0.56 * max(dot(n, key), 0.0), wide) + vec3(0.20 * wide * pow(max(dot(n, halfway), 0.0), 24.0));\n"
    "  ivec2 p = ivec2(gl_FragCoord.xy - corner);\n"
    "  float z = depth - s.z * pixel_depth;\n"
    // behind a whole vessel, and behind a wall: attenuated, but never so much that a moving object becomes invisible
    "  if (z > texelFetch(back_depth, p, 0).r + 4.0 * s.z * pixel_depth) { vec4 b = 0.7 * texelFetch(back, p, 0); k = b.rgb + (1.0 - b.a) * k; }\n"
    "  if (z > texelFetch(front_depth, p, 0).r) { vec4 f = texelFetch(front, p, 0); f *= min(1.0, 0.5 / max(f.a, 0.01)); k = f.rgb + (1.0 - f.a) * k; }\n"
    "  result = vec4(k, a);\n"
    "}\n";

bool strokes_create(Strokes *strokes, char *message, size_t capacity)
{
    *strokes = (Strokes){0};
    strokes->program = gl_program_create(VERTEX, FRAGMENT, message, capacity);
    if (!strokes->program)
        return false;
    glGenVertexArrays(1, &strokes->array);
    glGenBuffers(1, &strokes->vertices);
    glGenBuffers(1, &strokes->indices);
    glBindVertexArray(strokes->array);
    glBindBuffer(GL_ARRAY_BUFFER, strokes->vertices);
    glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, strokes->indices);
    static const struct {
        GLint size;
        GLenum type;
        size_t offset;
    } field[5] = {{2, GL_FLOAT, offsetof(StrokeVertex, x)},
                  {4, GL_FLOAT, offsetof(StrokeVertex, across)},
                  {2, GL_FLOAT, offsetof(StrokeVertex, side)},
                  {3, GL_FLOAT, offsetof(StrokeVertex, facing)},
                  {4, GL_UNSIGNED_BYTE, offsetof(StrokeVertex, color)}};
    for (unsigned k = 0; k < 5; k++) {
        glEnableVertexAttribArray(k);
        glVertexAttribPointer(k, field[k].size, field[k].type, field[k].type == GL_UNSIGNED_BYTE, sizeof(StrokeVertex),
                              (const void *)(uintptr_t)field[k].offset);
    }
    glBindVertexArray(0);
    return true;
}

void strokes_destroy(Strokes *strokes)
{
    if (strokes->program)
        glDeleteProgram(strokes->program);
    glDeleteVertexArrays(1, &strokes->array);
    const unsigned buffer[2] = {strokes->vertices, strokes->indices};
    glDeleteBuffers(2, buffer);
    free(strokes->vertex);
    free(strokes->order);
    free(strokes->index);
    free(strokes->point);
    *strokes = (Strokes){0};
}

void strokes_begin(Strokes *strokes, const Camera *camera)
{
    strokes->camera = *camera;
    strokes->quad_count = 0;
    strokes->is_short_of_memory = false;
}

static bool reserve_quads(Strokes *strokes, int more)
{
    if (strokes->quad_count > 5000000 - more) {
        strokes->is_short_of_memory = true;
        return false;
    }
    if (strokes->quad_count + more <= strokes->quad_capacity)
        return true;
    size_t grown = 2 * (size_t)(strokes->quad_count + more) + 1024;
    StrokeVertex *vertex = realloc(strokes->vertex, grown * 4 * sizeof *vertex);
    strokes->vertex = vertex ? vertex : strokes->vertex;
    uint64_t *order = realloc(strokes->order, grown * 2 * sizeof *order);
    strokes->order = order ? order : strokes->order;
    uint32_t *index = realloc(strokes->index, grown * 6 * sizeof *index);
    strokes->index = index ? index : strokes->index;
    strokes->is_short_of_memory = !vertex || !order || !index;
    if (!strokes->is_short_of_memory)
        strokes->quad_capacity = (int)grown;
    return !strokes->is_short_of_memory;
}

static bool reserve_points(Strokes *strokes, int count)
{
    if (count <= strokes->point_capacity)
        return true;
    StrokePoint *grown = realloc(strokes->point, 2 * (size_t)count * sizeof *grown);
    strokes->is_short_of_memory |= !grown;
    if (!grown)
        return false;
    strokes->point = grown;
    strokes->point_capacity = 2 * count;
    return true;
}

static StrokePoint project(const Camera *camera, Vec3 x, double half, Color color)
{
    Vec3 p = camera_project(camera, x);
    double depth = (camera->near_depth - p.z) / (camera->near_depth - camera->far_depth);
    // lines thinner than a pixel stay a pixel wide and become fainter
    double least = fmax(half, 0.5);
    Color faded = color_with_alpha(color, color.a / 255.0 * fmin(half / least, 1));
    return (StrokePoint){
        .pixel = {p.x, camera->height - p.y, depth}, .eye = {p.x * camera->mm_per_pixel, -p.y * camera->mm_per_pixel, p.z}, .half = least, .color = faded};
}

// Sets sides and facing normals from the pieces before and after each point.
static void orient_points(StrokePoint *point, int count)
{
    double last[2] = {0, 1};
    for (int i = 0; i < count; i++) {
        // a piece that points at the eye has no direction in the picture: it keeps the previous one
        double before[2] = {last[0], last[1]}, after[2] = {last[0], last[1]};
        if (i + 1 < count) {
            double dx = point[i + 1].pixel.x - point[i].pixel.x, dy = point[i + 1].pixel.y - point[i].pixel.y, length = hypot(dx, dy);
            if (length > 1e-3)
                after[0] = -dy / length, after[1] = dx / length;
        }
        if (i == 0)
            memcpy(before, after, sizeof before);
        double sum[2] = {before[0] + after[0], before[1] + after[1]}, length = hypot(sum[0], sum[1]);
        // the line turns back on itself: no mitre
        bool folds = length < 0.6;
        point[i].side[0] = folds ? after[0] : sum[0] / length;
        point[i].side[1] = folds ? after[1] : sum[1] / length;
        point[i].stretch = folds ? 1 : 2 / length;
        Vec3 along = vec3_sub(point[i + 1 < count ? i + 1 : i].eye, point[i > 0 ? i - 1 : i].eye);
        Vec3 side = vec3(point[i].side[0], point[i].side[1], 0);
        Vec3 facing = vec3_unit_or(vec3_cross(along, side), vec3(0, 0, 1));
        point[i].facing = facing.z < 0 ? vec3_negate(facing) : facing;
        memcpy(last, after, sizeof last);
    }
}

static StrokeVertex corner_of(const StrokePoint *p, double across, double past, const double along[2])
{
    double out = across * p->stretch;
    return (StrokeVertex){.x = (float)(p->pixel.x + out * p->side[0] + past * along[0]),
                          .y = (float)(p->pixel.y + out * p->side[1] + past * along[1]),
                          .across = (float)across,
                          .past = (float)past,
                          .half = (float)p->half,
                          .depth = (float)p->pixel.z,
                          .side = {(float)p->side[0], (float)p->side[1]},
                          .facing = {(float)p->facing.x, (float)p->facing.y, (float)p->facing.z},
                          .color = p->color};
}

static void add_quad(Strokes *strokes, const StrokePoint *a, const StrokePoint *b, double past, const double along[2])
{
    double reach = fmax(a->half, b->half) + 1;
    const Camera *camera = &strokes->camera;
    if (fmax(a->pixel.x, b->pixel.x) < -2 * reach || fmin(a->pixel.x, b->pixel.x) > camera->width + 2 * reach || fmax(a->pixel.y, b->pixel.y) < -2 * reach ||
        fmin(a->pixel.y, b->pixel.y) > camera->height + 2 * reach)
        return;
    if (!reserve_quads(strokes, 1))
        return;
    StrokeVertex *v = strokes->vertex + 4 * (size_t)strokes->quad_count;
    v[0] = corner_of(a, a->half + 1, 0, along);
    v[1] = corner_of(a, -a->half - 1, 0, along);
    v[2] = corner_of(b, b->half + 1, past, along);
    v[3] = corner_of(b, -b->half - 1, past, along);
    // positive floats sort like their bits; far ones first, then in the order in which they were added
    float key = (float)fmin(fmax(1 - (a->pixel.z + b->pixel.z) / 2, 0), 1);
    uint32_t bits;
    memcpy(&bits, &key, sizeof bits);
    strokes->order[strokes->quad_count] = (uint64_t)bits << 32 | (uint32_t)strokes->quad_count;
    strokes->quad_count++;
}

// Adds half a disc beyond an end.
static void add_cap(Strokes *strokes, StrokePoint end, double sign)
{
    const double along[2] = {sign * end.side[1], -sign * end.side[0]};
    end.stretch = 1;
    add_quad(strokes, &end, &end, end.half + 1, along);
}

static void add_run(Strokes *strokes, int count, const Vec3 *point, const double *half, const Color *color, bool caps)
{
    if (count < 2 || !reserve_points(strokes, count))
        return;
    for (int i = 0; i < count; i++)
        strokes->point[i] = project(&strokes->camera, point[i], half[i], color[i]);
    orient_points(strokes->point, count);
    const double none[2] = {0, 0};
    for (int i = 0; i + 1 < count; i++)
        add_quad(strokes, &strokes->point[i], &strokes->point[i + 1], 0, none);
    if (caps) {
        add_cap(strokes, strokes->point[0], -1);
        add_cap(strokes, strokes->point[count - 1], +1);
    }
}

void strokes_polyline(Strokes *strokes, int count, const Vec3 *point, const double *half_pixels, const Color *color, bool has_round_ends)
{
    for (int first = 0; first < count;) {
        int end = first;
        while (end < count && vec3_is_finite(point[end]) && isfinite(half_pixels[end]) && half_pixels[end] > 0)
            end++;
        add_run(strokes, end - first, point + first, half_pixels + first, color + first, has_round_ends);
        first = end + 1;
    }
}

void strokes_line(Strokes *strokes, Vec3 a, Vec3 b, double half_pixels, Color color)
{
    const Vec3 point[2] = {a, b};
    const double half[2] = {half_pixels, half_pixels};
    const Color both[2] = {color, color};
    add_run(strokes, 2, point, half, both, false);
}

void strokes_circle(Strokes *strokes, Vec3 center, Vec3 axis, double radius, double half_pixels, Color color)
{
    enum { PARTS = 64 };
    Vec3 point[PARTS + 1], u = vec3_normal_to(axis), v = vec3_cross(axis, u);
    double half[PARTS + 1];
    Color tint[PARTS + 1];
    for (int k = 0; k <= PARTS; k++) {
        double angle = 2 * PI * k / PARTS;
        Vec3 out = vec3_add_scaled(vec3_scale(u, cos(angle)), sin(angle), v);
        point[k] = vec3_add_scaled(center, radius, out);
        half[k] = half_pixels;
        tint[k] = color_with_alpha(color, color.a / 255.0 * (0.68 + 0.32 * vec3_dot(out, strokes->camera.back)));
    }
    add_run(strokes, PARTS + 1, point, half, tint, false);
}

void strokes_arrow(Strokes *strokes, Vec3 tail, Vec3 tip, double half_pixels, Color color)
{
    Vec3 along = vec3_sub(tip, tail);
    double length = vec3_norm(along), head = fmin(9 * half_pixels * strokes->camera.mm_per_pixel, 0.6 * length);
    if (!(length > 0))
        return;
    Vec3 neck = vec3_add_scaled(tip, -head / length, along);
    const Vec3 point[4] = {tail, neck, neck, tip};
    const double half[4] = {half_pixels, half_pixels, 3.4 * half_pixels, 0.3};
    const Color tint[4] = {color, color, color, color_rgb(color.r, color.g, color.b)};
    add_run(strokes, 2, point, half, tint, false);
    add_run(strokes, 2, point + 2, half + 2, tint + 2, false);
}

// Radix sort by the upper 32 bits, which contain the depth; least significant digits first, so that equal ones keep their order.
static const uint64_t *sort_quads(Strokes *strokes)
{
    size_t count = (size_t)strokes->quad_count;
    uint64_t *from = strokes->order, *to = strokes->order + strokes->quad_capacity;
    for (int shift = 32; shift < 64; shift += 8) {
        size_t start[257] = {0};
        for (size_t i = 0; i < count; i++)
            start[(from[i] >> shift & 255) + 1]++;
        for (int b = 0; b < 256; b++)
            start[b + 1] += start[b];
        for (size_t i = 0; i < count; i++)
            to[start[from[i] >> shift & 255]++] = from[i];
        uint64_t *swap = from;
        from = to;
        to = swap;
    }
    return from;
}

static void set_uniforms(const Strokes *strokes, ViewPort port)
{
    const Camera *camera = &strokes->camera;
    glUseProgram(strokes->program);
    static const char *const sampler[4] = {"front", "front_depth", "back", "back_depth"};
    for (int k = 0; k < 4; k++)
        glUniform1i(glGetUniformLocation(strokes->program, sampler[k]), k);
    glUniform2f(glGetUniformLocation(strokes->program, "size"), (float)port.width, (float)port.height);
    glUniform2f(glGetUniformLocation(strokes->program, "corner"), (float)port.x, (float)port.y);
    glUniform1f(glGetUniformLocation(strokes->program, "pixel_depth"), (float)(camera->mm_per_pixel / (camera->near_depth - camera->far_depth)));
}

void strokes_draw(Strokes *strokes, const VesselLayers *layers, ViewPort port)
{
    if (strokes->quad_count == 0)
        return;
    const uint64_t *order = sort_quads(strokes);
    for (int i = 0; i < strokes->quad_count; i++) {
        uint32_t v = 4 * (uint32_t)order[i];
        const uint32_t corner[6] = {v, v + 1, v + 2, v + 2, v + 1, v + 3};
        memcpy(strokes->index + 6 * (size_t)i, corner, sizeof corner);
    }
    set_uniforms(strokes, port);
    vessel_layers_bind(layers);
    glBindFramebuffer(GL_FRAMEBUFFER, port.framebuffer);
    glViewport(port.x, port.y, port.width, port.height);
    glScissor(port.x, port.y, port.width, port.height);
    glEnable(GL_SCISSOR_TEST);
    glDisable(GL_DEPTH_TEST);
    glDisable(GL_CULL_FACE);
    glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    glEnable(GL_BLEND);
    glBlendFuncSeparate(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA, GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
    glBindVertexArray(strokes->array);
    size_t quads = (size_t)strokes->quad_count;
    glBindBuffer(GL_ARRAY_BUFFER, strokes->vertices);
    glBufferData(GL_ARRAY_BUFFER, (GLsizeiptr)(quads * 4 * sizeof *strokes->vertex), strokes->vertex, GL_STREAM_DRAW);
    glBufferData(GL_ELEMENT_ARRAY_BUFFER, (GLsizeiptr)(quads * 6 * sizeof *strokes->index), strokes->index, GL_STREAM_DRAW);
    glDrawElements(GL_TRIANGLES, 6 * strokes->quad_count, GL_UNSIGNED_INT, NULL);
    glBindVertexArray(0);
    glDisable(GL_BLEND);
    glDisable(GL_SCISSOR_TEST);
}
