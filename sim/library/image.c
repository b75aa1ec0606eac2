#include "base/base.h"
#include "sim/library/simulator.h"
#include "sim/tube_tree.h"
#include "sim/xray_image.h"

#include <stdlib.h>
#include <string.h>

void sel_image_options_init(SelImageOptions *options, size_t size)
{
    SelImageOptions own = {.contrast = 0.3, .pixels = 256};
    result_give(options, size, &own, sizeof own);
}

void image_memory_free(ImageMemory *memory)
{
    free(memory->vessels);
    free(memory->tools);
    free(memory->bare);
    *memory = (ImageMemory){0};
}

static bool is_within(double value, double least, double most) { return value >= least && value <= most; }

static const char *image_trouble(const SelImageOptions *o)
{
    if (!is_within(o->lao_deg, -90, 90) || !is_within(o->cra_deg, -45, 45))
        return "lao_deg is not within -90 to 90, or cra_deg not within -45 to 45";
    if (!is_within(o->field_mm, 40, 400) && !(o->field_mm >= 0 && o->field_mm <= 0))
        return "field_mm is neither 0 nor within 40 to 400";
    for (int i = 0; o->has_centre && i < 3; i++)
        if (!is_within(o->centre_mm[i], -1e6, 1e6))
            return "centre_mm is not finite";
    if (!is_within(o->contrast, 0, 1))
        return "contrast is not within 0 to 1";
    return o->pixels < 8 || o->pixels > 4096 ? "pixels is not within 8 to 4096" : NULL;
}

static XrayControl view_of(const SelImageOptions *o, const VesselTree *tree, const Scene *scene)
{
    XrayControl xray = xray_default_control();
    xray.lao_deg = (float)o->lao_deg, xray.cra_deg = (float)o->cra_deg;
    XrayControl all = xray_view_all(tree, scene, &xray);
    for (int i = 0; o->has_centre && i < 3; i++)
        all.table_mm[i] = (float)o->centre_mm[i];
    if (o->field_mm > 0)
        all.field_mm = (float)o->field_mm;
    return all;
}

static bool is_same_view(const SelImageOptions *a, const SelImageOptions *b)
{
    return a->pixels == b->pixels && !memcmp(&a->lao_deg, &b->lao_deg, sizeof a->lao_deg) && !memcmp(&a->cra_deg, &b->cra_deg, sizeof a->cra_deg) &&
           !memcmp(&a->field_mm, &b->field_mm, sizeof a->field_mm) && !memcmp(&a->contrast, &b->contrast, sizeof a->contrast) &&
           a->has_centre == b->has_centre && (!a->has_centre || !memcmp(a->centre_mm, b->centre_mm, sizeof a->centre_mm));
}

static unsigned char transmitted(float attenuation) { return (unsigned char)(255 * same_exp(-(double)attenuation) + 0.5); }

static void draw_vessels(SelSimulator *s, const SelImageOptions *o, Faults *faults)
{
    const Scene *scene = s->scene->scene;
    size_t pixels = (size_t)o->pixels * (size_t)o->pixels;
    image_memory_free(&s->image);
    s->image.vessels = HEAP_ZEROED(pixels, sizeof *s->image.vessels);
    s->image.tools = HEAP_ZEROED(pixels, sizeof *s->image.tools);
    s->image.bare = HEAP_ZEROED(pixels, sizeof *s->image.bare);
    VesselTree *tube = !s->scene->open.tree && scene->source == SOURCE_TUBE && scene->contact == CONTACT_TUBE
                           ? tube_tree(s->scene->open.vessel, &scene->tube, scene->path, faults)
                           : NULL;
    const VesselTree *tree = tube ? tube : s->scene->open.tree;
    s->image.options = *o;
    s->image.xray = view_of(o, tree, scene);
    xray_image_vessels(tree, scene, &(XrayView){.xray = s->image.xray, .pixels = o->pixels}, s->image.vessels);
    vessel_tree_free(tube);
    for (size_t i = 0; i < pixels; i++) {
        s->image.vessels[i] *= (float)o->contrast;
        s->image.bare[i] = transmitted(s->image.vessels[i]);
    }
}

typedef struct Drawing {
    SelSimulator *simulator;
    SelImageOptions options;
    unsigned char *pixel;
} Drawing;

static bool draw(SelContext *context, void *what)
{
    const Drawing *drawing = what;
    SelSimulator *s = drawing->simulator;
    const SelImageOptions *o = &drawing->options;
    if (!s->image.vessels || !is_same_view(&s->image.options, o))
        draw_vessels(s, o, &context->faults);
    const XrayView view = {.xray = s->image.xray, .pixels = o->pixels};
    const Stepper *stepper = simulator_stepper(s->simulator);
    size_t pixels = (size_t)o->pixels * (size_t)o->pixels;
    memset(s->image.tools, 0, pixels * sizeof *s->image.tools);
    for (int k = 0; k < s->scene->scene->tool_count; k++)
        xray_image_tool(s->scene->scene, k, stepper_fitted(stepper, k), s->own, stepper_tool_nodes(stepper, k, s->own), &view, s->image.tools);
    memcpy(drawing->pixel, s->image.bare, pixels);
    for (size_t i = 0; i < pixels; i++)
        if (s->image.tools[i] > 0)
            drawing->pixel[i] = transmitted(s->image.vessels[i] + s->image.tools[i]);
    return context->faults.count == 0;
}

SelStatus sel_simulator_image(SelSimulator *s, const SelImageOptions *options, unsigned char *pixel)
{
    Drawing drawing = {.simulator = s, .pixel = pixel};
    sel_image_options_init(&drawing.options, sizeof drawing.options);
    if (!s || !pixel)
        return context_refuse(s ? s->context : NULL, SEL_ERROR_ARGUMENT, __func__, "simulator or pixel is NULL");
    if (!options_take(&drawing.options, sizeof drawing.options, options))
        return context_refuse(s->context, SEL_ERROR_ARGUMENT, __func__, "the size of options is not set; begin with sel_image_defaults()");
    const char *trouble = image_trouble(&drawing.options);
    if (trouble)
        return context_refuse(s->context, SEL_ERROR_ARGUMENT, __func__, trouble);
    return context_call(s->context, draw, &drawing, SEL_ERROR_MEMORY);
}
