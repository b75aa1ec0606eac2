// See section_view.h.
#include "render/section_view.h"

#include <epoxy/gl.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { SIDE = 192 };         // samples of the image

struct SectionView {
    const Volume *volume;
    double half;             // [mm] from the middle to the nearer edge
    double zoom;
    unsigned texture, framebuffer;
    int drawn_branch;        // what the texture shows
    double drawn_t, drawn_half, drawn_wide;
    uint8_t pixel[SIDE][SIDE][4];
};

SectionView *section_view_create(const Volume *volume)
{
    SectionView *v = calloc(1, sizeof *v);
    if (!v)
        return NULL;
    v->volume = volume, v->half = 3, v->zoom = 1, v->drawn_branch = -1;
    glGenTextures(1, &v->texture);
    glGenFramebuffers(1, &v->framebuffer);
    glBindTexture(GL_TEXTURE_2D, v->texture);
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, SIDE, SIDE, 0, GL_RGBA, GL_UNSIGNED_BYTE, NULL);
    glBindTexture(GL_TEXTURE_2D, 0);
    glBindFramebuffer(GL_FRAMEBUFFER, v->framebuffer);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, v->texture, 0);
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    return v;
}

void section_view_destroy(SectionView *v)
{
    if (!v)
        return;
    glDeleteFramebuffers(1, &v->framebuffer);
    glDeleteTextures(1, &v->texture);
    free(v);
}

// Trilinear; the least value outside.
static double sample(const Volume *v, Vec3 x)
{
    Vec3 p = volume_voxel_of(v, x);
    double at[3] = {p.x, p.y, p.z}, part[3], sum = 0;
    int low[3];
    for (int k = 0; k < 3; k++) {
        if (!(at[k] >= 0 && at[k] <= v->size[k] - 1))
            return (double)v->minimum;
        low[k] = (int)fmin(floor(at[k]), v->size[k] > 1 ? v->size[k] - 2 : 0);
        part[k] = at[k] - low[k];
    }
    for (int c = 0; c < 8; c++) {
        double weight = 1;
        size_t index = 0;
        for (int k = 2; k >= 0; k--) {
            int upper = c >> k & 1, i = low[k] + upper < v->size[k] ? low[k] + upper : low[k];
            weight *= upper ? part[k] : 1 - part[k];
            index = index * (size_t)v->size[k] + (size_t)i;
        }
        sum += weight * (double)v->value[index];
    }
    return sum;
}

// The view shows the middle two and a half times as wide as the section.
static void fit(SectionView *v, const EditState *s)
{
    double most = 0;
    for (int i = 0; i < EDIT_CONTOUR; i++)
        most = fmax(most, vec3_norm(s->contour[i]));
    // it follows in steps, so that the picture is still while a point is dragged
    double wanted = 2.2 * most;
    if (v->half < 0.75 * wanted || v->half > 1.6 * wanted)
        v->half = wanted;
}

static double scale_of(const SectionView *v, GuiRect at) { return 0.5 * fmin((double)at.width, (double)at.height) * v->zoom / v->half; }

Vec3 section_view_place(const SectionView *v, GuiRect at, double x, double y)
{
    double scale = scale_of(v, at);
    return vec3((x - (double)(at.x + at.width / 2)) / scale, ((double)(at.y + at.height / 2) - y) / scale, 0);
}

void section_view_zoom(SectionView *v, double notches) { v->zoom = fmax(0.3, fmin(8, v->zoom * pow(1.15, notches))); }

void section_view_draw_image(SectionView *v, const EditState *s, GuiRect at, int height)
{
    fit(v, s);
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, 0);
    if (!v->volume)
        return;
    double scale = scale_of(v, at), wide = (double)at.width / scale / 2, high = (double)at.height / scale / 2;
    if (s->branch != v->drawn_branch || s->t != v->drawn_t || high != v->drawn_half || wide != v->drawn_wide) {
        double least = (double)v->volume->minimum, range = 0.85 * ((double)v->volume->maximum - least);
        for (int j = 0; j < SIDE; j++)
            for (int i = 0; i < SIDE; i++) {
                Vec3 x = edit_state_in_space(s, vec3(wide * ((2 * i + 1.0) / SIDE - 1), high * ((2 * j + 1.0) / SIDE - 1), 0));
                double grey = range > 0 ? fmax(0, fmin(1, (sample(v->volume, x) - least) / range)) : 0;
                for (int k = 0; k < 3; k++)
                    v->pixel[j][i][k] = (uint8_t)(255 * grey + 0.5);
                v->pixel[j][i][3] = 255;
            }
        glBindTexture(GL_TEXTURE_2D, v->texture);
        glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, SIDE, SIDE, GL_RGBA, GL_UNSIGNED_BYTE, v->pixel);
        glBindTexture(GL_TEXTURE_2D, 0);
        v->drawn_branch = s->branch, v->drawn_t = s->t, v->drawn_half = high, v->drawn_wide = wide;
    }
    int left = (int)at.x, bottom = height - (int)(at.y + at.height);
    glBindFramebuffer(GL_READ_FRAMEBUFFER, v->framebuffer);
    glBlitFramebuffer(0, 0, SIDE, SIDE, left, bottom, left + (int)at.width, bottom + (int)at.height, GL_COLOR_BUFFER_BIT, GL_LINEAR);
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
}

static void to_pixel(const SectionView *v, GuiRect at, Vec3 nb, float *x, float *y)
{
    double scale = scale_of(v, at);
    *x = at.x + at.width / 2 + (float)(nb.x * scale);
    *y = at.y + at.height / 2 - (float)(nb.y * scale);
}

int section_view_handle(const SectionView *v, const EditState *s, GuiRect at, double x, double y, double near)
{
    int best = -1;
    for (int i = 0; i < EDIT_HANDLES; i++) {
        float px, py;
        to_pixel(v, at, s->contour[i * (EDIT_CONTOUR / EDIT_HANDLES)], &px, &py);
        double far = hypot(x - (double)px, y - (double)py);
        if (far < near)
            near = far, best = i;
    }
    return best;
}

static void draw_closed(const SectionView *v, Gui *gui, GuiRect at, int count, const Vec3 *point, Color color, float thick, bool is_open)
{
    for (int i = 0; i + (is_open ? 1 : 0) < count; i++) {
        float x0, y0, x1, y1;
        to_pixel(v, at, point[i], &x0, &y0);
        to_pixel(v, at, point[(i + 1) % count], &x1, &y1);
        gui_draw_line(gui, x0, y0, x1, y1, color, thick);
    }
}

// Lines a millimetre apart (less or more when zoomed), and what that is.
static void draw_grid(const SectionView *v, Gui *gui, GuiRect at)
{
    static const double steps[] = {0.1, 0.2, 0.5, 1, 2, 5, 10};
    double scale = scale_of(v, at), step = 20;
    for (size_t i = sizeof steps / sizeof steps[0]; i-- > 0;)
        if (steps[i] * scale > 28)
            step = steps[i];
    Color line = {90, 98, 116, 70};
    int columns = (int)((double)at.width / 2 / scale / step), rows = (int)((double)at.height / 2 / scale / step);
    for (int i = -columns; i <= columns; i++) {
        float x = at.x + at.width / 2 + (float)(i * step * scale);
        gui_draw_line(gui, x, at.y, x, at.y + at.height, line, 1);
    }
    for (int i = -rows; i <= rows; i++) {
        float y = at.y + at.height / 2 + (float)(i * step * scale);
        gui_draw_line(gui, at.x, y, at.x + at.width, y, line, 1);
    }
    char text[40];
    float s = gui_scale(gui), bar = (float)(step * scale), left = at.x + 10 * s, low = at.y + at.height - 12 * s;
    gui_draw_line(gui, left, low, left + bar, low, gui_colors.text, 2 * s);
    snprintf(text, sizeof text, "%g mm", step);
    gui_draw_text(gui, left, low - 18 * s, GUI_SMALL, gui_colors.text, text);
}

void section_view_draw_contour(const SectionView *v, Gui *gui, const EditState *s, GuiRect at)
{
    enum { FINE = 192 };
    float k = gui_scale(gui);
    Vec3 fine[FINE];
    SectionPoint point[FINE];
    draw_grid(v, gui, at);
    if (s->outline.count > 0)
        sweep_contour_sample(&s->outline, FINE, point, NULL);
    for (int i = 0; i < FINE && s->outline.count > 0; i++)
        fine[i] = vec3(point[i].n, point[i].b, 0);
    draw_closed(v, gui, at, s->outline.count > 0 ? FINE : 0, fine, gui_colors.accent, 2 * k, false);
    if (s->stroke_count > 1)
        draw_closed(v, gui, at, s->stroke_count, s->stroke, gui_colors.warning, 2 * k, true);
    for (int i = 0; s->draws_contour && i <= s->stroke_count; i++) {
        bool is_pen = i == s->stroke_count;
        Vec3 at_point = is_pen ? s->pen : s->stroke[i];
        float x, y, size = 4 * k;
        to_pixel(v, at, at_point, &x, &y);
        gui_draw_line(gui, x - size, y - size, x + size, y + size, is_pen ? gui_colors.text : gui_colors.warning, 2 * k);
        gui_draw_line(gui, x - size, y + size, x + size, y - size, is_pen ? gui_colors.text : gui_colors.warning, 2 * k);
    }
    for (int i = 0; i < EDIT_HANDLES && !s->draws_contour; i++) {
        float x, y, size = (i == s->handle ? 9 : 6) * k;
        to_pixel(v, at, s->contour[i * (EDIT_CONTOUR / EDIT_HANDLES)], &x, &y);
        gui_draw_fill(gui, (GuiRect){x - size / 2 - k, y - size / 2 - k, size + 2 * k, size + 2 * k}, gui_colors.window);
        gui_draw_fill(gui, (GuiRect){x - size / 2, y - size / 2, size, size}, i == s->handle ? gui_colors.warning : gui_colors.accent);
    }
    // the curve's point
    float x = at.x + at.width / 2, y = at.y + at.height / 2;
    gui_draw_line(gui, x - 5 * k, y, x + 6 * k, y, gui_colors.good, k);
    gui_draw_line(gui, x, y - 5 * k, x, y + 6 * k, gui_colors.good, k);
}
