#include "render/case_picture.h"

#include "render/gl_canvas.h"
#include "render/gl_context.h"
#include "render/png_file.h"
#include "render/scene_views.h"

#include <png.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

char *case_picture_file(const char *path)
{
    static const char drawing[] = "320x200, 1";      // to be changed with the drawing
    char cache[4096], hex[65], name[80];
    Faults *ignored = calloc(1, sizeof *ignored);
    size_t length = 0;
    char *file = case_is_there(path) ? text_file_in(path, "scene.yaml") : strdup(path), *text = file && ignored ? text_file_read(file, &length, ignored) : NULL;
    bool good = text && folders_cache(cache, sizeof cache - 10);
    if (good) {
        Sha256 sha;
        sha256_begin(&sha);
        sha256_add(&sha, drawing, sizeof drawing);
        sha256_add(&sha, path, strlen(path) + 1);
        sha256_add(&sha, text, length);
        sha256_end(&sha, hex);
        snprintf(name, sizeof name, "%.24s.png", hex);
        strcat(cache, "/pictures");
        good = folders_create(cache);
    }
    free(text);
    free(file);
    free(ignored);
    return good ? text_file_in(cache, name) : NULL;
}

// Means of squares of `by` x `by` pixels.
static void shrink(const uint8_t *from, int width, int height, int by, uint8_t *to)
{
    for (int y = 0; y < height; y++)
        for (int x = 0; x < 3 * width; x++) {
            int sum = 0;
            for (int k = 0; k < by * by; k++)
                sum += from[((by * y + k / by) * by * width + by * (x / 3) + k % by) * 3 + x % 3];
            to[y * 3 * width + x] = (uint8_t)((sum + by * by / 2) / (by * by));
        }
}

static bool draw_views(Scene *scene, OpenVessel *open, const GlCanvas *canvas, Faults *faults)
{
    char note[512];
    OperatorControls controls;
    Views *views = scene_views_create(scene, open, &controls, note, sizeof note, faults);
    Simulator *simulator = views ? simulator_create(scene, open->vessel, faults) : NULL;
    Pose *pose = simulator ? pose_create_for(simulator) : NULL;
    if (pose) {
        const ViewPort all = {.width = canvas->width, .height = canvas->height, .framebuffer = canvas->framebuffer};
        const PanelLayout layout = {.scale = 1, .main = VIEW_3D, .view = {[VIEW_3D] = all}};
        pose_take(pose, simulator, &(ToolCommands){0}, &controls.xray);
        controls.look.full_detail = true;
        views_draw(views, &(ViewsFrame){.pose = pose, .xray = &controls.xray, .look = &controls.look, .is_still = true}, &layout, canvas->width, canvas->height,
                   canvas->framebuffer);
    }
    bool good = pose != NULL;
    pose_free(pose);
    simulator_destroy(simulator);
    views_destroy(views);
    return good;
}

bool case_picture_draw(const char *file, Scene *scene, OpenVessel *open, Faults *faults)
{
    enum { BY = 2, WIDTH = CASE_PICTURE_WIDTH, HEIGHT = CASE_PICTURE_HEIGHT };
    char message[512] = "out of memory";
    GlCanvas canvas = {0};
    GlContext *context = gl_context_create(message, sizeof message);
    uint8_t *large = malloc((size_t)BY * BY * WIDTH * HEIGHT * 3), *rgb = malloc((size_t)WIDTH * HEIGHT * 3);
    bool good = context && large && rgb && gl_canvas_create(&canvas, BY * WIDTH, BY * HEIGHT, 1, message, sizeof message);
    if (good && draw_views(scene, open, &canvas, faults)) {
        gl_canvas_read(&canvas, large);
        shrink(large, WIDTH, HEIGHT, BY, rgb);
        good = png_file_write(file, WIDTH, HEIGHT, rgb, message, sizeof message);
    } else if (good) {
        good = false;
        snprintf(message, sizeof message, "the scene cannot be shown");
    }
    if (!good)
        faults_add(faults, file, 0, 0, "no picture: %s", message);
    gl_canvas_destroy(&canvas);
    gl_context_destroy(context);
    free(large);
    free(rgb);
    return good;
}

uint8_t *case_picture_read(const char *file, int *width, int *height)
{
    enum { MOST = 2048 };
    png_image image = {.version = PNG_IMAGE_VERSION};
    uint8_t *rgb = NULL;
    if (png_image_begin_read_from_file(&image, file)) {
        image.format = PNG_FORMAT_RGB;
        if (image.width <= MOST && image.height <= MOST && (rgb = malloc(PNG_IMAGE_SIZE(image))) && !png_image_finish_read(&image, NULL, rgb, 0, NULL)) {
            free(rgb);
            rgb = NULL;
        }
        *width = (int)image.width;
        *height = (int)image.height;
    }
    png_image_free(&image);
    return rgb;
}
