#include "render/trainer_cine.h"

#include "base/base.h"
#include "render/gl_canvas.h"
#include "render/translation.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { LOOP_IMAGES = 900, FILM_SIDE = 768, CINE_BYTES_MOST = 1 << 30 };

bool trainer_cine_open(TrainerCine *cine, const CineShape *shape, const char *path, Faults *faults)
{
    *cine = (TrainerCine){.tree_nodes = shape->contrast_count};
    for (int k = 0; k < shape->tool_count; k++)
        cine->tree_nodes -= shape->tool_nodes[k];
    if (!path) {
        cine->cine = cine_create(shape, LOOP_IMAGES);
        if (!cine->cine)
            faults_add(faults, "cine", 0, 0, "out of memory for a loop of %d images", LOOP_IMAGES);
        return cine->cine != NULL;
    }
    size_t length;
    char *bytes = whole_file_read_most(path, CINE_BYTES_MOST, &length, faults);
    cine->cine = bytes ? cine_unpack((const uint8_t *)bytes, length, path, faults) : NULL;
    free(bytes);
    CineShape found = cine->cine ? cine_shape(cine->cine) : *shape;
    if (cine->cine && !cine_shapes_same(&found, shape)) {
        faults_add(faults, path, 0, 0, "is a loop with %d tools, %d nodes in the first tool and %d in the vessel; this scene has %d, %d and %d",
                   found.tool_count, found.tool_nodes[0], found.contrast_count, shape->tool_count, shape->tool_nodes[0], shape->contrast_count);
        trainer_cine_close(cine);
    }
    return cine->cine != NULL;
}

void trainer_cine_close(TrainerCine *cine)
{
    cine_free(cine->cine);
    *cine = (TrainerCine){0};
}

bool trainer_cine_obey(TrainerCine *cine, const PanelActions *actions, char *remark, size_t capacity)
{
    *remark = 0;
    if (actions->pressed[ACTION_CINE_RECORD] & 1) {
        bool was_shown = cine->is_shown;
        cine->is_shown = false;
        cine_lock(cine->cine, false);
        if (cine_is_recording(cine->cine)) {
            cine_stop(cine->cine);
            snprintf(remark, capacity, tr("cine: %d images, %.1f s; F7 shows it, F8 saves it"), cine_count(cine->cine), cine_duration_s(cine->cine));
        } else {
            cine_record(cine->cine);
            snprintf(remark, capacity, tr("cine is recorded while the X-ray is on; the last %d images are kept"), cine_capacity(cine->cine));
        }
        return was_shown;
    }
    if (!(actions->pressed[ACTION_CINE_REPLAY] & 1))
        return false;
    if (!cine->is_shown && cine_count(cine->cine) == 0) {
        snprintf(remark, capacity, "no cine yet: F6 records while the X-ray is on");
        return false;
    }
    cine->is_shown = !cine->is_shown;
    cine_stop(cine->cine);
    cine_lock(cine->cine, cine->is_shown);
    cine->player = cine_player_start(cine->cine);
    return true;
}

static void trainer_cine_contrast(const TrainerCine *cine, const float *concentration, ViewsFrame *frame)
{
    frame->contrast = cine->tree_nodes > 0 ? concentration : NULL;
    frame->filling = concentration ? concentration + cine->tree_nodes : NULL;
}

void trainer_cine_frame(TrainerCine *cine, double passed_s, const float *concentration, ViewsFrame *frame)
{
    if (!cine->is_shown) {
        CineFrame live = {.pose = frame->pose, .contrast = concentration, .pulse = frame->pulse};
        trainer_cine_contrast(cine, concentration, frame);
        if (frame->pose->xray.pedal > 0)
            cine_add(cine->cine, &live);
        return;
    }
    CineFrame image = cine_frame(cine->cine, cine_player_advance(&cine->player, cine->cine, passed_s));
    frame->pose = image.pose;
    frame->xray = &image.pose->xray;
    trainer_cine_contrast(cine, image.contrast, frame);
    frame->pulse = image.pulse;
}

typedef struct Drawing {
    const TrainerCine *cine;
    Views *views;
    GlCanvas canvas;
} Drawing;

static bool draw_image(void *context, const CineFrame *image, uint8_t *rgb, char *message, size_t capacity)
{
    (void)message, (void)capacity;
    Drawing *drawing = context;
    ViewsFrame seen = {0};
    trainer_cine_contrast(drawing->cine, image->contrast, &seen);
    FluoroscopeFrame frame = {.pose = image->pose, .xray = image->pose->xray, .contrast = seen.contrast, .filling = seen.filling, .pulse = image->pulse};
    fluoroscope_draw(views_fluoroscope(drawing->views), &frame, (ViewPort){drawing->canvas.framebuffer, 0, 0, FILM_SIDE, FILM_SIDE});
    gl_canvas_read(&drawing->canvas, rgb);
    return true;
}

bool trainer_cine_save(TrainerCine *cine, Views *views, const char *stem, char *remark, size_t capacity, Faults *faults)
{
    char path[4096], message[256] = "";
    size_t length;
    if (cine_count(cine->cine) == 0) {
        snprintf(remark, capacity, "no cine to save: F6 records while the X-ray is on");
        return false;
    }
    uint8_t *bytes = cine_pack(cine->cine, &length);
    snprintf(path, sizeof path, "%.4000s.cine", stem);
    bool good = bytes && output_write(path, bytes, length, faults);
    free(bytes);
    Drawing drawing = {.cine = cine, .views = views};
    snprintf(path, sizeof path, "%.4000s.mp4", stem);
    bool film = good && gl_canvas_create(&drawing.canvas, FILM_SIDE, FILM_SIDE, 1, message, sizeof message);
    if (film) {
        cine_lock(cine->cine, true);
        fluoroscope_forget(views_fluoroscope(views));
        film = cine_movie(cine->cine, path, FILM_SIDE, FILM_SIDE, draw_image, &drawing, message, sizeof message);
        fluoroscope_forget(views_fluoroscope(views));
        cine_lock(cine->cine, cine->is_shown);
    }
    gl_canvas_destroy(&drawing.canvas);
    if (good)
        snprintf(remark, capacity, film ? tr("cine %.200s.cine and .mp4%s") : tr("cine %.200s.cine; no video: %s"), stem, film ? "" : message);
    else
        snprintf(remark, capacity, tr("the cine could not be saved: %.200s"), faults->count ? faults->text[0] : "out of memory");
    return good;
}
