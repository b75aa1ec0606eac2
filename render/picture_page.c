#include "render/picture_page.h"

#include "render/message.h"
#include "render/png_file.h"
#include "render/tick_step.h"

#include <epoxy/gl.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

const Color PAGE_INK = {34, 37, 42, 255}, PAGE_MUTED = {104, 108, 115, 255}, PAGE_FAINT = {206, 207, 205, 255};
const Color PAGE_PAPER = {255, 255, 255, 255}, PAGE_PANEL = {248, 248, 246, 255};

double picture_page_scale_of(const PictureOptions *options) { return fmin(fmax(fmin(options->width / 1.6, options->height) / 1000, 0.6), 4); }

bool picture_page_open(PicturePage *page, const PictureOptions *options, int height, char *message, size_t capacity)
{
    int used = height < 64 ? 64 : height < options->height ? height : options->height;
    *page = (PicturePage){.width = options->width, .height = used, .message = message, .capacity = capacity};
    if (options->width < 64 || options->width > 8192 || options->height < 64 || options->height > 8192)
        return message_fail(message, capacity, "a picture of %d x %d pixels; expected 64 to 8192 per side", options->width, options->height);
    page->scale = picture_page_scale_of(options);
    page->context = gl_context_create(message, capacity);
    if (!page->context)
        return false;
    bool made = gl_canvas_create(&page->canvas, page->width, page->height, 1, message, capacity);
    if (made) {
        page->overlay = overlay_create(page->width, page->height, (float)page->scale);
        if (!page->overlay)
            made = message_fail(message, capacity, "cannot start the text renderer; is libgl1 installed?");
    }
    if (made) {
        page->view = surface_view_create(message, capacity);
        made = page->view != NULL;
    }
    if (!made)
        picture_page_close(page);
    return made;
}

bool picture_page_save(PicturePage *page, const char *path)
{
    uint8_t *rgb = malloc((size_t)page->width * (size_t)page->height * 3);
    if (!rgb)
        return message_fail(page->message, page->capacity, "not enough memory for a picture of %d x %d pixels", page->width, page->height);
    const float paper[3] = {(float)PAGE_PAPER.r / 255, (float)PAGE_PAPER.g / 255, (float)PAGE_PAPER.b / 255};
    gl_canvas_begin(&page->canvas, paper);
    overlay_finish(page->overlay);
    gl_canvas_read(&page->canvas, rgb);
    GLenum trouble = glGetError();
    bool written = trouble == GL_NO_ERROR ? png_file_write(path, page->width, page->height, rgb, page->message, page->capacity)
                                          : message_fail(page->message, page->capacity, "OpenGL reports error 0x%x while drawing", trouble);
    free(rgb);
    return written;
}

void picture_page_close(PicturePage *page)
{
    if (!page->context)
        return;
    surface_view_destroy(page->view);
    overlay_destroy(page->overlay);
    for (int i = 0; i < page->panel_count; i++)
        gl_canvas_destroy(&page->panel[i]);
    if (page->texture_count > 0)
        glDeleteTextures(page->texture_count, page->texture);
    gl_canvas_destroy(&page->canvas);
    gl_context_destroy(page->context);
    page->context = NULL;
}

GlCanvas *picture_page_begin_panel(PicturePage *page, int width, int height)
{
    if (page->panel_count == PAGE_PANELS) {
        message_fail(page->message, page->capacity, "more than %d panels in one picture", PAGE_PANELS);
        return NULL;
    }
    GlCanvas *panel = &page->panel[page->panel_count];
    if (!gl_canvas_create(panel, width < 1 ? 1 : width, height < 1 ? 1 : height, 4, page->message, page->capacity))
        return NULL;
    page->panel_count++;
    const float ground[3] = {(float)PAGE_PANEL.r / 255, (float)PAGE_PANEL.g / 255, (float)PAGE_PANEL.b / 255};
    gl_canvas_begin(panel, ground);
    return panel;
}

void picture_page_end_panel(PicturePage *page, const GlCanvas *panel, double x, double y)
{
    gl_canvas_resolve(panel);
    overlay_image(page->overlay, panel->texture, x, y, panel->width, panel->height, true);
}

unsigned picture_page_grey_texture(PicturePage *page, int width, int height, const uint8_t *grey)
{
    if (page->texture_count == PAGE_PANELS)
        return 0;
    unsigned texture;
    glGenTextures(1, &texture);
    page->texture[page->texture_count++] = texture;
    glBindTexture(GL_TEXTURE_2D, texture);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
    glTexImage2D(GL_TEXTURE_2D, 0, GL_R8, width, height, 0, GL_RED, GL_UNSIGNED_BYTE, grey);
    const GLint swizzle[4] = {GL_RED, GL_RED, GL_RED, GL_ONE};
    glTexParameteriv(GL_TEXTURE_2D, GL_TEXTURE_SWIZZLE_RGBA, swizzle);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    return texture;
}

void picture_page_text(PicturePage *page, double x, double y, TextSize size, Color color, const char *format, ...)
{
    char text[512];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    overlay_text(page->overlay, x, y, size, color, text);
}

double picture_page_text_anchored(PicturePage *page, double x, double y, double anchor, TextSize size, Color color, const char *text)
{
    double width;
    overlay_text_size(page->overlay, size, text, &width, NULL);
    overlay_text(page->overlay, x - anchor * width, y, size, color, text);
    return width;
}

double picture_page_title(PicturePage *page, double x, double y, double room, const char *text)
{
    if (!text)
        return 0;
    char shown[512];
    double width;
    snprintf(shown, sizeof shown, "%s", text);
    overlay_text_size(page->overlay, TEXT_LARGE, shown, &width, NULL);
    for (size_t cut = 1; width > room && cut < strlen(text); cut++) {
        if (((unsigned char)text[cut] & 0xc0) == 0x80)   // inside a UTF-8 letter
            continue;
        snprintf(shown, sizeof shown, "...%s", text + cut);
        overlay_text_size(page->overlay, TEXT_LARGE, shown, &width, NULL);
    }
    overlay_text(page->overlay, x, y, TEXT_LARGE, PAGE_INK, shown);
    return width;
}

void picture_page_label(PicturePage *page, double x, double y, double anchor, TextSize size, Color color, const char *text)
{
    const Color halo = color_with_alpha(PAGE_PANEL, 0.55);
    for (int i = -1; i <= 1; i++)
        for (int j = -1; j <= 1; j++)
            if (i || j)
                picture_page_text_anchored(page, x + 1.2 * i * page->scale, y + 1.2 * j * page->scale, anchor, size, halo, text);
    picture_page_text_anchored(page, x, y, anchor, size, color, text);
}

void picture_page_scale_bar(PicturePage *page, double x, double y, double longest, double mm_per_pixel, Color color)
{
    double length = round_length(longest * mm_per_pixel);
    double pixels = length / mm_per_pixel, s = page->scale;
    overlay_fill(page->overlay, x, y - 4 * s, pixels, 4 * s, color);
    char text[64];
    snprintf(text, sizeof text, "%g mm", length);
    double height;
    overlay_text_size(page->overlay, TEXT_NORMAL, text, NULL, &height);
    picture_page_label(page, x, y - 7 * s - height, 0, TEXT_NORMAL, color, text);
}

void picture_page_color_bar(PicturePage *page, double x, double y, double width, double height, Color (*map)(double), double map_low, double low, double high,
                            const char *title)
{
    double s = page->scale, text_height;
    overlay_text_size(page->overlay, TEXT_SMALL, title, NULL, &text_height);
    picture_page_text(page, x, y, TEXT_SMALL, PAGE_INK, "%s", title);
    double top = y + text_height + 4 * s;
    int parts = (int)width;
    for (int i = 0; i < parts; i++)
        overlay_fill(page->overlay, x + width * i / parts, top, width / parts, height, map(map_low + (1 - map_low) * (i + 0.5) / parts));
    double step = tick_step(high - low, 5);
    for (double first = ceil(low / step - 1e-9), k = first; k * step <= high * (1 + 1e-9) + 1e-12; k++) {
        char text[32];
        tick_format(text, sizeof text, k * step, step);
        double at = x + width * (k * step - low) / (high - low);
        overlay_line(page->overlay, at, top + height, at, top + height + 4 * s, PAGE_INK, s);
        double text_width;
        overlay_text_size(page->overlay, TEXT_SMALL, text, &text_width, NULL);
        double left = fmin(fmax(at - text_width / 2, x), x + width - text_width);
        overlay_text(page->overlay, left, top + height + 5 * s, TEXT_SMALL, PAGE_INK, text);
    }
}

double picture_page_scale_end(double x)
{
    if (!(x > 0) || !isfinite(x))
        return x;
    double power = pow(10, floor(log10(x)));
    const double step[10] = {1, 1.2, 1.5, 2, 2.5, 3, 4, 5, 6, 8};
    for (int i = 0; i < 10; i++)
        if (x <= step[i] * power * (1 + 1e-9))
            return step[i] * power;
    return 10 * power;
}
