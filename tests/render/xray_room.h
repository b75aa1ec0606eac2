// A fluoroscope in a surfaceless context, and its picture as grey values; for the tests of fluoroscopy.
#ifndef SELDINGER_TESTS_XRAY_ROOM_H
#define SELDINGER_TESTS_XRAY_ROOM_H

#include "render/fluoroscope.h"
#include "render/fluoroscope_parts.h"
#include "render/gl_canvas.h"
#include "render/gl_context.h"

#include <epoxy/gl.h>
#include <stdlib.h>
#include <string.h>

typedef struct XrayRoom {
    GlContext *context;
    Fluoroscope *view;
    GlCanvas canvas;
    FluoroscopeFrame frame;
    uint8_t *rgb;            // (side, side, 3), rows from the top
    int side;
    char message[300];
} XrayRoom;

// NULL without EGL. `options` NULL: an empty room.
static inline XrayRoom *room_open(const FluoroscopeOptions *options, int side)
{
    XrayRoom *s = calloc(1, sizeof *s);
    FluoroscopeOptions none = fluoroscope_default_options();
    none.has_no_anatomy = true;
    s->context = gl_context_create(s->message, sizeof s->message);
    if (!s->context) {
        print_message("no EGL: %s\n", s->message);
        free(s);
        return NULL;
    }
    s->view = fluoroscope_create(options ? options : &none, s->message, sizeof s->message);
    char ignored[100];
    assert_true(gl_canvas_create(&s->canvas, side, side, 1, ignored, sizeof ignored));
    s->side = side;
    s->rgb = malloc((size_t)side * (size_t)side * 3);
    s->frame = (FluoroscopeFrame){.xray = xray_default_control(), .pulse = 1};
    s->frame.xray.pedal = 1;
    s->frame.xray.field_mm = 60;
    return s;
}

static inline void room_close(XrayRoom *s)
{
    fluoroscope_destroy(s->view);
    gl_canvas_destroy(&s->canvas);
    gl_context_destroy(s->context);
    free(s->rgb);
    free(s);
}

static inline bool room_says(const XrayRoom *s, const char *text) { return s && strstr(s->message, text) != NULL; }

static inline void room_draw(XrayRoom *s)
{
    fluoroscope_draw(s->view, &s->frame, (ViewPort){s->canvas.framebuffer, 0, 0, s->side, s->side});
    gl_canvas_read(&s->canvas, s->rgb);
}

// 0 to 255; y up.
static inline int room_grey(const XrayRoom *s, int x, int y) { return s->rgb[((size_t)(s->side - 1 - y) * (size_t)s->side + (size_t)x) * 3]; }

typedef struct PixelMoments {
    double mean, deviation;
} PixelMoments;
static inline PixelMoments room_moments(const XrayRoom *s, int x0, int y0, int x1, int y1)
{
    double sum = 0, square = 0, count = 0;
    for (int y = y0; y < y1; y++)
        for (int x = x0; x < x1; x++) {
            double g = room_grey(s, x, y);
            sum += g;
            square += g * g;
            count++;
        }
    return (PixelMoments){sum / count, sqrt(fmax(square / count - sum / count * sum / count, 0))};
}

// A float layer, rows from the bottom; the caller frees it.
static inline float *layer_read(const Layer *layer)
{
    float *value = malloc((size_t)layer->side * (size_t)layer->side * sizeof *value);
    glBindFramebuffer(GL_FRAMEBUFFER, layer->framebuffer);
    glPixelStorei(GL_PACK_ALIGNMENT, 1);
    glReadPixels(0, 0, layer->side, layer->side, GL_RED, GL_FLOAT, value);
    return value;
}

// Brightness of a transmission in the live picture without anatomy, 0 to 255: automatic exposure sets empty air to 0.27.
static inline double live_grey(double attenuation) { return 255 * 1.75 * pow(0.27 * exp(-attenuation), 0.72); }

// Length of a ray from `from` inside the mesh, in double precision.
static inline double ray_inside(const TriangleMesh *mesh, Vec3 from, Vec3 along)
{
    double sum = 0;
    for (int t = 0; t < mesh->triangle_count; t++) {
        const int *c = mesh->triangle[t];
        Vec3 a = mesh->vertex[c[0]], e = vec3_sub(mesh->vertex[c[1]], a), f = vec3_sub(mesh->vertex[c[2]], a), p = vec3_cross(along, f);
        double det = vec3_dot(e, p);
        if (fabs(det) < 1e-14)
            continue;
        Vec3 d = vec3_sub(from, a), q = vec3_cross(d, e);
        double u = vec3_dot(d, p) / det, v = vec3_dot(along, q) / det, way = vec3_dot(f, q) / det;
        if (u >= 0 && v >= 0 && u + v <= 1)
            sum += det > 0 ? -way : way;   // det > 0: against the normal, inwards
    }
    return sum;
}

static inline Vec3 pixel_ray(const CArm *c_arm, int side, int x, int y) { return c_arm_ray(c_arm, (x + 0.5) / side - 0.5, (y + 0.5) / side - 0.5); }

#endif
