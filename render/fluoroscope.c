// When each layer is drawn. Each new pulse is compared with the state of the layers:
//   C-arm, table or field moved: redraw everything coarsely (half the resolution, the decimated lumen); finely with the first pulses at rest.
//   contrast agent moved: redraw the lumen from the decimated mesh; finely once it is stationary.
//   any of these, blades, mode, mask: bake the base from the layers.
//   always: copy the base back where the tools were, and multiply the tools in.
// Showing adds the noise of the pulse; a held picture is only shown.
// On a software renderer the base has no lumen, and lumen, tools and noise are added together while showing (render/xray_pixels.h).
#include "render/fluoroscope.h"

#include "render/fluoroscope_parts.h"
#include "render/gl_canvas.h"
#include "render/message.h"
#include "render/shape_raster.h"

#include <epoxy/gl.h>
#include <stdlib.h>
#include <string.h>

static const double least_move_mm = 1e-3;        // of the C-arm
static const double median_transmission = 0.27;  // target of the automatic exposure: brightness 0.68

FluoroscopeOptions fluoroscope_default_options(void)
{
    return (FluoroscopeOptions){.patient = patient_axes_lps(), .contrast_attenuation = 0.105, .quanta = 550, .dsa_gain = 2.2, .dsa_dose = XRAY_DSA_DOSE};
}

// --- create ---

static bool tool_is_sound(const ToolLook *tool, int index, char *message, size_t capacity)
{
    if (tool->stretch_count < 1)
        return message_fail(message, capacity, "tool %d has no stretches", index);
    for (int i = 0; i < tool->stretch_count; i++) {
        const TubeStretch *stretch = &tool->stretch[i];
        bool is_tube = stretch->radius > 0 && isfinite(stretch->radius) && stretch->lumen >= 0 && stretch->lumen < stretch->radius;
        if (!is_tube || !(stretch->attenuation >= 0) || !isfinite(stretch->attenuation))
            return message_fail(
                message, capacity,
                "stretch %d of tool %d has radius %g mm, lumen %g mm and attenuation %g / mm; finite, not negative, the lumen within the radius", i, index,
                stretch->radius, stretch->lumen, stretch->attenuation);
    }
    return true;
}

static bool options_are_sound(const FluoroscopeOptions *options, char *message, size_t capacity)
{
    if (!patient_axes_are_sound(&options->patient))
        return message_fail(message, capacity, "the patient's axes are not perpendicular unit vectors");
    if (options->tools && (!options->pose || options->pose->tool_count != options->tools->count))
        return message_fail(message, capacity, "the pose is not one of the %d tools", options->tools->count);
    for (int k = 0; options->tools && k < options->tools->count; k++)
        for (int which = 0; which <= EXCHANGES_MOST; which++)
            if (!tool_is_sound(tool_looks_of(options->tools, k, which), k, message, capacity))
                return false;
    bool has_dose = options->quanta >= 0 && isfinite(options->quanta) && options->dsa_dose > 0;
    if (!has_dose || !(options->contrast_attenuation >= 0) || !(options->dsa_gain > 0.5))
        return message_fail(message, capacity, "contrast or quanta of fluoroscopy is negative, or DSA's gain not above 0.5, or its dose not above 0");
    return true;
}

static bool mesh_is_sound(const TriangleMesh *mesh, char *message, size_t capacity)
{
    for (int v = 0; v < mesh->vertex_count; v++)
        if (!vec3_is_finite(mesh->vertex[v]))
            return message_fail(message, capacity, "no contrast is drawn: the vessel's wall has a vertex that is not finite");
    for (int t = 0; t < mesh->triangle_count; t++)
        for (int k = 0; k < 3; k++)
            if (mesh->triangle[t][k] < 0 || mesh->triangle[t][k] >= mesh->vertex_count)
                return message_fail(message, capacity, "no contrast is drawn: the vessel's wall has an index out of range");
    return mesh->triangle_count > 0;
}

// Returns true if rays through the wall can be evaluated; adds a remark if lids were needed.
static bool wall_is_fit(const FluoroscopeOptions *options, MeshClosure *closure, MeshLids *lids, char *message, size_t capacity)
{
    if (!options->vessel || !mesh_is_sound(options->vessel, message, capacity))
        return false;
    if (!mesh_closure(options->vessel, closure, lids))
        return message_fail(message, capacity, "no contrast is drawn: out of memory while checking the vessel's wall");
    if (closure->turned_edges > 0)
        return message_fail(message, capacity, "no contrast is drawn: at %lld edges of the vessel's wall, neighbouring triangles have opposite orientations",
                            (long long)closure->turned_edges);
    double span = 0;
    for (int v = 0; v < options->vessel->vertex_count; v++)
        span = fmax(span, vec3_distance(options->vessel->vertex[v], options->vessel->vertex[0]));
    if (!(fabs(closure->volume) > 1e-9 * span * span * span))
        return message_fail(message, capacity, "no contrast is drawn: the vessel's wall encloses no volume");
    const char *facing = closure->volume < 0 ? "; its triangles face inwards, which is taken into account" : "";
    if (closure->rims > 0 && closure->unevenness > 0.25)
        message_fail(message, capacity,
                     "the vessel's wall is open at %d places, not all of them flat (up to %.0f %% of their radius): contrast is wrong there%s", closure->rims,
                     100 * closure->unevenness, facing);
    else if (closure->rims > 0)
        message_fail(message, capacity, "the vessel's wall is open at %d places; flat lids close it for contrast%s", closure->rims, facing);
    else if (closure->volume < 0)
        message_fail(message, capacity, "the triangles of the vessel's wall face inwards, which is taken into account");
    return true;
}

static int lumen_nodes(const Fluoroscope *f) { return f->lumen.is_there ? f->lumen.node_count : 0; }

// The path for a tool with an unchanged number of nodes; NULL if the number changed or if out of memory.
static const RibbonPath *path_of(Fluoroscope *f, int k, const PoseTool *tool)
{
    int fitted = tool->fitted >= 0 && tool->fitted <= EXCHANGES_MOST ? tool->fitted : 0;
    RibbonPath *path = &f->tool[k][fitted];
    if (path->count == 0) {
        const ToolLook *look = tool_looks_of(f->looks, k, fitted);
        double *s = malloc((size_t)tool->node_count * sizeof *s);
        for (int j = 0; s && j < tool->node_count; j++)
            s[j] = tool->node[j].s;
        bool good = s && ribbon_path_make(path, tool->node_count, s, look->stretch_count, look->stretch);
        free(s);
        if (!good)
            return NULL;
    }
    return path->node_count == tool->node_count ? path : NULL;
}

static bool exposure_make(Exposure *exposure, size_t tool_nodes, size_t nodes)
{
    exposure->position = calloc(tool_nodes, sizeof *exposure->position);
    exposure->filling = calloc(tool_nodes, sizeof *exposure->filling);
    exposure->contrast = calloc(nodes, sizeof *exposure->contrast);
    return exposure->position && exposure->filling && exposure->contrast;
}

static void exposure_free(Exposure *exposure)
{
    free(exposure->position);
    free(exposure->filling);
    free(exposure->contrast);
}

static bool take_memory(Fluoroscope *f, const FluoroscopeOptions *options)
{
    size_t tool_nodes = 1, nodes = (size_t)lumen_nodes(f) + 1;
    f->looks = options->tools;
    f->tool_count = options->tools ? options->tools->count : 0;
    for (int k = 0; k < f->tool_count; k++)
        f->tool_capacity[k] = options->pose->tool[k].node_capacity, tool_nodes += (size_t)f->tool_capacity[k];
    f->lumen_contrast = calloc(nodes, sizeof *f->lumen_contrast);
    f->roadmap_contrast = calloc(nodes, sizeof *f->roadmap_contrast);
    bool good = f->lumen_contrast && f->roadmap_contrast && exposure_make(&f->shown, tool_nodes, nodes) && exposure_make(&f->masked, tool_nodes, nodes) &&
                pulse_memory_make(&f->memory, lumen_nodes(f));
    for (int k = 0; good && k < f->tool_count; k++)
        good = path_of(f, k, &options->pose->tool[k]) != NULL;
    const SheathLook *sheath = &options->sheath;
    if (good && sheath->is_there) {
        const TubeStretch stretch = {SHEATH_SHOWN_MM, sheath->radius, sheath->lumen, sheath->attenuation};
        f->sheath_node[0] = vec3_add_scaled(sheath->mouth, -SHEATH_SHOWN_MM, sheath->direction);
        f->sheath_node[1] = sheath->mouth;
        good = ribbon_path_make(&f->sheath, 2, (const double[]){0, SHEATH_SHOWN_MM}, 1, &stretch);
    }
    return good;
}

Fluoroscope *fluoroscope_create(const FluoroscopeOptions *options, char *message, size_t capacity)
{
    if (message && capacity > 0)
        message[0] = 0;
    if (!options_are_sound(options, message, capacity))
        return NULL;
    Fluoroscope *f = calloc(1, sizeof *f);
    MeshClosure closure = {0};
    MeshLids lids = {0};
    bool good = f != NULL;
    if (!good)
        message_fail(message, capacity, "out of memory for fluoroscopy");
    bool has_wall = good && wall_is_fit(options, &closure, &lids, message, capacity);
    FluoroscopeOptions own = *options;
    if (!has_wall) {
        own.vessel = NULL;
        own.tree = NULL;
    }
    good = good && anatomy_create(&f->anatomy, &own, &lids, message, capacity);
    good = good && layers_create(&f->programs, &f->anatomy, message, capacity);
    good = good && (!has_wall || lumen_layer_create(&f->lumen, &own, &closure, &lids, message, capacity));
    mesh_lids_free(&lids);
    if (good && !take_memory(f, options)) {
        message_fail(message, capacity, "out of memory for fluoroscopy");
        good = false;
    }
    if (!good) {
        fluoroscope_destroy(f);
        return NULL;
    }
    f->options = *options;
    f->options.vessel = NULL;
    f->options.vertex_node = NULL;
    f->options.tree = NULL;
    f->options.tools = NULL;
    f->options.pose = NULL;
    f->options.anatomy_value = NULL;
    f->tone.contrast = options->contrast_attenuation;
    f->tone.gain = options->dsa_gain;
    f->tone.exposure = log(median_transmission);
    f->on_processor = gl_is_software();
    fluoroscope_forget(f);
    return f;
}

void fluoroscope_destroy(Fluoroscope *f)
{
    if (!f)
        return;
    shape_shadows_free(&f->shadows);
    if (!f->is_beside) {
        anatomy_free(&f->anatomy);
        lumen_layer_destroy(&f->lumen);
        layers_destroy(&f->programs);
    }
    Layer *layer[11] = {&f->anatomy_layer, &f->anatomy_next,  &f->lumen_layer,  &f->roadmap_layer, &f->mask,           &f->still.bare,
                        &f->still.base,    &f->still.picture, &f->turning.bare, &f->turning.base,  &f->turning.picture};
    for (int i = 0; i < 11; i++)
        layer_destroy(layer[i]);
    xray_pixels_free(&f->pixels);
    free(f->solids);
    ribbon_free(&f->ribbon);
    ribbon_path_free(&f->sheath);
    for (int k = 0; k < f->tool_count; k++)
        for (int i = 0; i <= EXCHANGES_MOST; i++)
            ribbon_path_free(&f->tool[k][i]);
    exposure_free(&f->shown);
    exposure_free(&f->masked);
    pulse_memory_free(&f->memory);
    free(f->lumen_contrast);
    free(f->roadmap_contrast);
    free(f);
}

Fluoroscope *fluoroscope_create_beside(const Fluoroscope *first, const Pose *pose)
{
    Fluoroscope *f = calloc(1, sizeof *f);
    FluoroscopeOptions options = first->options;
    if (!f)
        return NULL;
    options.tools = pose ? first->looks : NULL;
    options.pose = pose;
    f->is_beside = true;
    f->on_processor = first->on_processor;
    f->options = first->options;
    f->anatomy = first->anatomy;
    f->lumen = first->lumen;
    f->programs = first->programs;
    f->tone.contrast = options.contrast_attenuation;
    f->tone.gain = options.dsa_gain;
    f->tone.exposure = first->tone.exposure;
    if (!take_memory(f, &options)) {
        fluoroscope_destroy(f);
        return NULL;
    }
    fluoroscope_forget(f);
    return f;
}

static void copy_exposure(Exposure *to, const Exposure *from, int tool_nodes, int nodes)
{
    Exposure memory = *to;
    *to = *from;
    to->position = memory.position;
    to->filling = memory.filling;
    to->contrast = memory.contrast;
    memcpy(to->position, from->position, (size_t)tool_nodes * sizeof *to->position);
    memcpy(to->filling, from->filling, (size_t)tool_nodes * sizeof *to->filling);
    memcpy(to->contrast, from->contrast, (size_t)nodes * sizeof *to->contrast);
}

void fluoroscope_take_picture(Fluoroscope *f, const Fluoroscope *from)
{
    int tool_nodes = 0;
    for (int k = 0; k < f->tool_count; k++)
        tool_nodes += f->tool_capacity[k];
    copy_exposure(&f->shown, &from->shown, tool_nodes, lumen_nodes(f));
    copy_exposure(&f->masked, &from->masked, tool_nodes, lumen_nodes(f));
    pulse_memory_copy(&f->memory, &from->memory);
    f->has_picture = from->has_picture;
    f->has_mask = from->has_mask;
    f->mask_is_due = from->has_mask;
    f->layers_are_stale = true;
}

void fluoroscope_forget(Fluoroscope *f)
{
    f->has_picture = f->has_mask = f->mask_is_due = false;
    f->layers_are_stale = true;
    pulse_memory_clear(&f->memory);
}

// --- a pulse ---

static bool has_these_tools(Fluoroscope *f, Exposure *exposure, const Pose *pose)
{
    bool same = pose && pose->tool_count == f->tool_count;
    for (int k = 0; same && k < f->tool_count; k++)
        same = pose->tool[k].node_count <= f->tool_capacity[k] && (exposure->tool[k] = path_of(f, k, &pose->tool[k]));
    return same;
}

// Stores what the pulse shows.
static void take_exposure(Fluoroscope *f, Exposure *exposure, const FluoroscopeFrame *frame)
{
    const Pose *pose = frame->pose;
    exposure->xray = frame->xray;
    exposure->pulse = frame->pulse;
    exposure->has_tools = has_these_tools(f, exposure, pose);
    const float *filling = frame->filling;
    for (int k = 0, i = 0; exposure->has_tools && k < f->tool_count; k++) {
        for (int j = 0; j < pose->tool[k].node_count; j++, i++) {
            exposure->position[i] = pose->tool[k].node[j].position;
            exposure->filling[i] = filling && filling[j] > 0 ? fminf(filling[j], 1) : 0;
        }
        filling = filling ? filling + f->tool_capacity[k] : NULL;
    }
    for (int n = 0; n < lumen_nodes(f); n++) {
        float c = frame->contrast ? frame->contrast[n] : 0;
        exposure->contrast[n] = c > 0 ? fminf(c, 1) : 0;   // NaN counts as none
    }
}

static bool c_arms_differ(const CArm *a, const CArm *b, double least_mm)
{
    double shift = vec3_distance(a->isocentre, b->isocentre) + fabs(a->field_mm - b->field_mm);
    return shift > least_mm || vec3_distance(a->towards, b->towards) > 0.01 * least_mm || vec3_distance(a->up, b->up) > 0.01 * least_mm;
}

// The mean attenuation in the beam, from rays between the blades, which the automatic exposure compensates.
static double find_mean(const Fluoroscope *f, const CArm *c_arm)
{
    double sum = 0;
    int count = 0;
    for (int j = -4; j <= 4; j++)
        for (int i = -4; i <= 4; i++) {
            double a = shape_shadows_along(&f->shadows, &f->anatomy, c_arm, i * 0.11, j * 0.11);
            if (a > 0.1) {
                sum += a;
                count++;
            }
        }
    return count > 0 ? sum / count : 0;
}

static bool has_anatomy(const Fluoroscope *f) { return f->anatomy.level || f->anatomy.body.count > 0; }

enum { ANATOMY_STRIPS = 4, SOLIDS_FINE = 384, SOLIDS_COARSE = 160 };

// A volume is marched through by a shader.
static void draw_anatomy(Fluoroscope *f, const CArm *c_arm, const Layer *to, int first, int rows, int steps)
{
    if (f->on_processor && !f->anatomy.level && !f->solids)
        f->solids = malloc(SOLIDS_FINE * SOLIDS_FINE * sizeof *f->solids);
    if (!f->on_processor || f->anatomy.level || !f->solids) {
        layers_draw_anatomy(&f->programs, &f->anatomy, &f->shadows, c_arm, to, first, rows, steps);
        return;
    }
    shape_raster(&f->shadows, c_arm, to->side, first, rows, f->solids);
    layer_put(to, first, rows, f->solids + (size_t)first * (size_t)to->side);
}

static void draw_coarse_anatomy(Fluoroscope *f, const CArm *c_arm)
{
    int side = f->anatomy.level ? 96 : SOLIDS_COARSE;
    f->anatomy_rows = 0;
    if (has_anatomy(f) && layer_fit(&f->anatomy_layer, side, LAYER_R32F))
        draw_anatomy(f, c_arm, &f->anatomy_layer, 0, side, ANATOMY_GRID / 2);
}

// Draws the next strip of the fine anatomy, or all the rest. Returns true if it is complete and in use.
static bool draw_fine_anatomy(Fluoroscope *f, const CArm *c_arm, bool at_once)
{
    int side = f->anatomy.level ? 256 : SOLIDS_FINE, rows = at_once ? side - f->anatomy_rows : side / ANATOMY_STRIPS;
    if (!has_anatomy(f) || !layer_fit(&f->anatomy_next, side, LAYER_R32F))
        return true;
    draw_anatomy(f, c_arm, &f->anatomy_next, f->anatomy_rows, rows, ANATOMY_GRID);
    f->anatomy_rows += rows;
    if (f->anatomy_rows < side)
        return false;
    Layer whole = f->anatomy_next;
    f->anatomy_next = f->anatomy_layer;
    f->anatomy_layer = whole;
    f->anatomy_rows = 0;
    return true;
}

static void draw_lumen(Fluoroscope *f, Layer *layer, PixelField *field, const CArm *c_arm, const float *contrast, bool coarse, bool *is_empty)
{
    *is_empty = !f->lumen.is_there || f->lumen_out_of_beam || !contrast_is_seen(contrast, f->lumen.node_count) ||
                !layer_fit(layer, coarse ? (f->side + 1) / 2 : f->side, LAYER_R32F);
    float *value = !*is_empty && f->on_processor ? pixel_field_begin(field, layer->side) : NULL;
    *is_empty |= f->on_processor && !value;
    if (*is_empty)
        return;
    if (value) {
        lumen_add(&f->lumen, c_arm, contrast, coarse, layer->side, value);
        pixel_field_end(field);
        layer_put(layer, 0, layer->side, value);     // for the mask of DSA
        return;
    }
    layer_begin(layer);
    lumen_layer_draw(&f->lumen, c_arm, contrast, coarse);
}

static bool contrast_differs(const Fluoroscope *f, const float *a, const float *b)
{
    float least = f->is_exact ? 0 : least_contrast;
    for (int n = 0; n < lumen_nodes(f); n++)
        if (fabsf(a[n] - b[n]) > least)
            return true;
    return false;
}

typedef struct LayerChanges {
    bool anatomy, lumen;
} LayerChanges;

// Updates anatomy, lumen and roadmap to the exposure. After a move of the C-arm the fine anatomy is drawn in strips over the next pulses, then the fine lumen,
// so that no single
// frame takes too long.
static LayerChanges update_layers(Fluoroscope *f, const Exposure *exposure, bool is_fresh)
{
    CArm c_arm = c_arm_place(&exposure->xray, &f->options.patient);
    bool at_once = is_fresh || f->is_exact, moved = is_fresh || c_arms_differ(&c_arm, &f->c_arm, f->is_exact ? 0 : least_move_mm);
    bool flowed = contrast_differs(f, exposure->contrast, f->lumen_contrast), is_roadmap = lroundf(exposure->xray.mode) == XRAY_ROADMAP;
    bool anatomy = moved || f->anatomy_is_coarse, refine = !anatomy && !flowed && f->lumen_is_coarse;
    bool lumen = moved || flowed || refine, coarse = !at_once && !refine && (lumen || f->lumen_is_coarse);
    f->roadmap_is_stale |= lumen || contrast_differs(f, f->memory.roadmap, f->roadmap_contrast);
    bool roadmap = is_roadmap && f->roadmap_is_stale;
    f->c_arm = c_arm;
    f->lumen_out_of_beam = f->lumen.is_there && !lumen_is_in_beam(&f->lumen, &c_arm);
    if (moved) {
        if (!shape_shadows_cast(&f->shadows, &f->anatomy, &c_arm))
            f->shadows.count = 0;
        f->tone.mean = find_mean(f, &c_arm);
        f->anatomy_rows = 0;
    }
    if (moved && !at_once)
        draw_coarse_anatomy(f, &c_arm);
    else if (anatomy)
        anatomy = draw_fine_anatomy(f, &c_arm, at_once);
    if (anatomy) {
        f->anatomy_is_coarse = moved && !at_once;
        f->now = f->anatomy_is_coarse ? &f->turning : &f->still;
    }
    if (lumen) {
        f->lumen_is_coarse = coarse;
        draw_lumen(f, &f->lumen_layer, &f->pixels.lumen, &c_arm, exposure->contrast, coarse, &f->lumen_is_empty);
        memcpy(f->lumen_contrast, exposure->contrast, (size_t)lumen_nodes(f) * sizeof *f->lumen_contrast);
    }
    if (roadmap) {
        draw_lumen(f, &f->roadmap_layer, &f->pixels.roadmap, &c_arm, f->memory.roadmap, coarse, &f->roadmap_is_empty);
        memcpy(f->roadmap_contrast, f->memory.roadmap, (size_t)lumen_nodes(f) * sizeof *f->roadmap_contrast);
        f->roadmap_is_stale = false;
    }
    return (LayerChanges){anatomy, lumen || roadmap};
}

static const Layer *anatomy_of(const Fluoroscope *f) { return has_anatomy(f) ? &f->anatomy_layer : NULL; }
static const Layer *lumen_of(const Fluoroscope *f) { return f->lumen_is_empty ? NULL : &f->lumen_layer; }

static void lay_tools(Fluoroscope *f, const Exposure *exposure, int side)
{
    const Vec3 *position = exposure->position;
    const float *filling = exposure->filling;
    ribbon_begin(&f->ribbon);
    if (f->sheath.count > 0)
        ribbon_add(&f->ribbon, &f->c_arm, side, &f->sheath, f->sheath_node, NULL, f->tone.contrast);
    for (int k = 0; exposure->has_tools && k < f->tool_count; k++) {
        ribbon_add(&f->ribbon, &f->c_arm, side, exposure->tool[k], position, filling, f->tone.contrast);
        position += exposure->tool[k]->node_count;
        filling += exposure->tool[k]->node_count;
    }
    ribbon_end(&f->ribbon, side);
}

static void take_mask(Fluoroscope *f)
{
    if (!layer_fit(&f->mask, f->side, LAYER_R32F))
        return;
    lay_tools(f, &f->masked, f->side);
    layers_draw_total(&f->programs, anatomy_of(f), lumen_of(f), &f->c_arm, &f->tone, &f->mask);
    layers_draw_tools(&f->programs, &f->ribbon, &f->tone, true, &f->mask);
    f->has_mask = true;
    f->mask_is_due = false;
    f->mask_c_arm = f->c_arm;
}

static bool blades_or_mode_differ(const XrayControl *a, const XrayControl *b)
{
    return memcmp(a->collimator, b->collimator, sizeof a->collimator) != 0 || lroundf(a->mode) != lroundf(b->mode);
}

static void copy_box(const Layer *from, const Layer *to, const int low[2], const int high[2])
{
    if (high[0] <= low[0] || high[1] <= low[1])
        return;
    glBindFramebuffer(GL_READ_FRAMEBUFFER, from->framebuffer);
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, to->framebuffer);
    glBlitFramebuffer(low[0], low[1], high[0], high[1], low[0], low[1], high[0], high[1], GL_COLOR_BUFFER_BIT, GL_NEAREST);
}

static void bake(Fluoroscope *f)
{
    // DSA has its own dose
    f->tone.quanta = f->options.quanta * (f->tone.is_subtracted ? f->options.dsa_dose : 1);
    layers_bake(&f->programs, anatomy_of(f), f->tone.is_subtracted ? &f->mask : NULL, &f->tone, f->shown.xray.collimator, f->masked.pulse, &f->now->bare);
    f->baked = f->shown.xray;
}

static void copy_all(const Layer *from, const Layer *to)
{
    const int none[2] = {0, 0}, all[2] = {from->side, from->side};
    copy_box(from, to, none, all);
}

static void opacify(Fluoroscope *f)
{
    int low[2], high[2];
    lumen_box(&f->lumen, &f->c_arm, f->now->base.side, low, high);
    copy_all(&f->now->bare, &f->now->base);
    const Layer *lumen = &f->lumen_layer, *roadmap = f->tone.has_roadmap ? &f->roadmap_layer : NULL;
    if (f->lumen_is_empty && layer_fit(&f->lumen_layer, f->roadmap_layer.side, LAYER_R32F))
        layer_begin(lumen);
    layers_opacify(&f->programs, &f->now->bare, lumen, roadmap, &f->c_arm, &f->tone, low, high, &f->now->base);
}

// Hands the layers that changed to the processor.
static void take_pixels(Fluoroscope *f, bool is_baked)
{
    const PictureLayers *now = f->now;
    if (is_baked)
        xray_pixels_take_bare(&f->pixels, now->bare.framebuffer, now->bare.side);
    lay_tools(f, &f->shown, now->bare.side);
    layers_take_tools(&f->programs, &f->ribbon, &f->tone, &now->picture, &f->pixels);
}

// Makes the picture without noise for the exposure taken. The mask comes first, since both use the same layers.
static void make_picture(Fluoroscope *f, bool is_fresh)
{
    LayerChanges changes = {0};
    bool has_new_mask = f->mask_is_due, is_mask = has_new_mask && f->masked.pulse == f->shown.pulse;
    if (has_new_mask) {
        changes = update_layers(f, &f->masked, is_fresh);
        take_mask(f);
    }
    if (!is_mask) {
        LayerChanges more = update_layers(f, &f->shown, is_fresh);
        changes = (LayerChanges){changes.anatomy || more.anatomy, changes.lumen || more.lumen};
    }
    PictureLayers *now = f->now;
    long mode = lroundf(f->shown.xray.mode);
    bool has_roadmap = mode == XRAY_ROADMAP && f->lumen.is_there && !f->roadmap_is_empty;
    changes.lumen |= has_roadmap != f->tone.has_roadmap;
    f->tone.has_roadmap = has_roadmap;
    f->tone.is_subtracted = mode == XRAY_DSA && f->has_mask;
    bool is_baked = changes.anatomy || has_new_mask || is_fresh || blades_or_mode_differ(&f->baked, &f->shown.xray);
    if (is_baked)
        bake(f);
    if (f->on_processor) {
        take_pixels(f, is_baked);
        return;
    }
    const Layer *base = f->lumen_is_empty && !has_roadmap ? &now->bare : &now->base;
    if (base == &now->base && (is_baked || changes.lumen))
        opacify(f);
    if (is_baked || changes.lumen)
        copy_all(base, &now->picture);
    else
        copy_box(base, &now->picture, f->drawn_low, f->drawn_high);
    lay_tools(f, &f->shown, now->picture.side);
    layers_draw_tools(&f->programs, &f->ribbon, &f->tone, false, &now->picture);
    memcpy(f->drawn_low, f->ribbon.low, sizeof f->drawn_low);
    memcpy(f->drawn_high, f->ribbon.high, sizeof f->drawn_high);
    if (f->ribbon.count == 0)
        f->drawn_high[0] = f->drawn_low[0];
}

// --- showing ---

static void fill(int x, int y, int width, int height, float red, float green, float blue)
{
    if (width < 1 || height < 1)
        return;
    glScissor(x, y, width, height);
    glClearColor(red, green, blue, 1);
    glClear(GL_COLOR_BUFFER_BIT);
}

// Draws the area outside the square, and the pause sign of a held picture (two bars) in the corner without text.
static void draw_surroundings(const Fluoroscope *f, ViewPort port, bool leaves_surroundings)
{
    int x = f->corner[0], y = f->corner[1], side = f->side;
    const float dark = SURROUNDINGS_GREY;
    glEnable(GL_SCISSOR_TEST);
    if (!leaves_surroundings && !f->on_processor) {
        fill(port.x, port.y, x - port.x, port.height, dark, dark, dark);
        fill(x + side, port.y, port.x + port.width - x - side, port.height, dark, dark, dark);
        fill(x, port.y, side, y - port.y, dark, dark, dark);
        fill(x, y + side, side, port.y + port.height - y - side, dark, dark, dark);
    }
    if (f->is_held) {
        int unit = side / 90 > 2 ? side / 90 : 2, left = x + side - 8 * unit, bottom = y + side - 8 * unit;
        fill(left - unit, bottom - unit, 5 * unit, 5 * unit, 0.05f, 0.05f, 0.05f);
        fill(left, bottom, unit, 3 * unit, 1.0f, 0.78f, 0.2f);
        fill(left + 2 * unit, bottom, unit, 3 * unit, 1.0f, 0.78f, 0.2f);
    }
    glDisable(GL_SCISSOR_TEST);
}

static bool fit_picture(const Fluoroscope *f, PictureLayers *layers, int side, LayerFormat format)
{
    if (f->on_processor)
        return layer_fit(&layers->bare, side, format) && layer_fit(&layers->picture, side, LAYER_RG16);
    return layer_fit(&layers->bare, side, format) && layer_fit(&layers->base, side, format) && layer_fit(&layers->picture, side, format);
}

static bool fit_pictures(Fluoroscope *f, int side)
{
    return fit_picture(f, &f->still, side, LAYER_RGBA16) && fit_picture(f, &f->turning, (side + 1) / 2, LAYER_RGBA16_SMOOTH) &&
           (!f->on_processor || xray_pixels_fit(&f->pixels, side));
}

// Prepares the square of a port. Returns false if it is too small or the driver fails.
static bool begin_drawing(Fluoroscope *f, ViewPort port)
{
    int side = port.width < port.height ? port.width : port.height;
    bool is_resized = side != f->side;
    if (side < 8)
        return false;
    if (is_resized && !fit_pictures(f, side))
        return false;
    layers_set_state();
    f->side = side;
    f->corner[0] = port.x + (port.width - side) / 2;
    f->corner[1] = port.y + (port.height - side) / 2;
    f->layers_are_stale |= is_resized;
    f->mask_is_due |= is_resized && f->has_mask;
    return true;
}

static void show_pixels(Fluoroscope *f, ViewPort port, bool leaves_surroundings)
{
    const ViewPort square = {port.framebuffer, f->corner[0], f->corner[1], f->side, f->side};
    const int corner[2] = {leaves_surroundings ? 0 : f->corner[0] - port.x, leaves_surroundings ? 0 : f->corner[1] - port.y};
    layers_show_pixels(&f->programs, &f->pixels, !f->lumen_is_empty, &f->c_arm, &f->tone, f->shown.pulse, leaves_surroundings ? square : port, corner, f->side);
}

static void finish_drawing(Fluoroscope *f, bool is_pulse, bool is_held, ViewPort port, bool leaves_surroundings)
{
    if (is_pulse || f->layers_are_stale)
        make_picture(f, f->layers_are_stale);
    f->is_held = is_held;
    f->has_picture = true;
    f->layers_are_stale = false;
    if (f->on_processor)
        show_pixels(f, port, leaves_surroundings);
    else
        layers_show(&f->programs, &f->now->picture, &f->tone, f->shown.pulse, port.framebuffer, f->corner[0], f->corner[1], f->side);
    draw_surroundings(f, port, leaves_surroundings);
}

void fluoroscope_draw(Fluoroscope *f, const FluoroscopeFrame *frame, ViewPort port)
{
    bool has_pedal = frame->xray.pedal > 0.5f, is_pulse = !f->has_picture || (has_pedal && frame->pulse != f->shown.pulse);
    if (!begin_drawing(f, port))
        return;
    f->is_exact = false;
    if (is_pulse) {
        take_exposure(f, &f->shown, frame);
        if (pulse_memory_take(&f->memory, &f->shown.xray, f->shown.contrast)) {
            take_exposure(f, &f->masked, frame);
            f->mask_is_due = true;
        }
    }
    finish_drawing(f, is_pulse, !has_pedal, port, frame->leaves_surroundings);
}

void fluoroscope_recall(Fluoroscope *f, const FluoroscopePast *past, ViewPort port, bool leaves_surroundings)
{
    bool is_pulse = !f->has_picture || !f->is_exact || past->last.pulse != f->shown.pulse, has_mask = past->memory->has_mask;
    if (!begin_drawing(f, port))
        return;
    f->layers_are_stale |= !f->is_exact;
    f->is_exact = true;
    if (is_pulse) {
        take_exposure(f, &f->shown, &past->last);
        f->mask_is_due = has_mask && (f->mask_is_due || !f->has_mask || past->mask.pulse != f->masked.pulse);
        f->has_mask &= has_mask;
        if (f->mask_is_due)
            take_exposure(f, &f->masked, &past->mask);
        pulse_memory_copy(&f->memory, past->memory);
    }
    finish_drawing(f, is_pulse, past->is_held, port, leaves_surroundings);
}

FluoroscopeState fluoroscope_state(const Fluoroscope *f)
{
    return (FluoroscopeState){.is_held = f->is_held,
                              .has_mask = f->has_mask,
                              .mask_has_moved = f->has_mask && c_arms_differ(&f->mask_c_arm, &f->c_arm, least_move_mm),
                              .has_roadmap = f->tone.has_roadmap,
                              .is_out_of_beam = f->lumen_out_of_beam,
                              .shown = f->shown.xray,
                              .square = {f->corner[0], f->corner[1], f->side}};
}

double fluoroscope_locate(const Fluoroscope *f, Vec3 point, double at[2])
{
    const CArm arm = c_arm_place(&f->shown.xray, &f->options.patient);
    const Vec3 p = c_arm_project(&arm, point);
    const bool is_inside = fabs(p.x) < 0.5 && fabs(p.y) < 0.5;
    at[0] = p.x;
    at[1] = p.y;
    return f->has_picture && is_inside ? 1 / arm.field_mm : 0;
}
