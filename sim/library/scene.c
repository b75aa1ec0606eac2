#include "base/base.h"
#include "sim/library/context.h"
#include "sim/library/recon.h"
#include "sim/library/scene_text.h"
#include "sim/library/wall_query.h"
#include "sim/simulator.h"

#include <stdlib.h>
#include <string.h>

enum { IDLE_MOST = 4 };      // vessels that stay open while no scene needs them

void sel_open_options_init(SelOpenOptions *options, size_t size)
{
    SelOpenOptions own = {0};
    result_give(options, size, &own, sizeof own);
}

// --- holding ---

// Only the number of holders of a scene and its start ever change.
const SelScene *scene_held(const SelScene *scene)
{
    atomic_fetch_add(&((SelScene *)(size_t)scene)->holders, 1);
    return scene;
}

static void free_scene(SelScene *scene)
{
    checkpoint_free(atomic_load(&scene->start));
    vessel_cache_release(scene->shared, IDLE_MOST);
    scene_free(scene->scene);
    free(scene);
}

void scene_release(const SelScene *scene)
{
    SelScene *held = (SelScene *)(size_t)scene;
    if (held && atomic_fetch_sub(&held->holders, 1) == 1)
        free_scene(held);
}

void sel_scene_destroy(SelScene *scene) { scene_release(scene); }

// --- opening ---

static void take_contact(Scene *scene, const char *name, Faults *faults)
{
    int kind = 0;
    while (kind < CONTACT_COUNT && strcmp(name, contact_name[kind]) != 0)
        kind++;
    if (kind < CONTACT_COUNT)
        scene->contact = (ContactKind)kind;
    else
        faults_add(faults, scene->path, 0, 0, "unknown contact '%.40s'; expected lim, lim_blend, lim_switch, sweep, mesh, smooth_mesh, flat_mesh, grid or tube",
                   name);
}

static void take_script(Scene *scene, const char *path, Faults *faults)
{
    ToolNames tools = scene_tool_names(scene);
    Script *script = script_load(path, &tools, faults);
    if (!script)
        return;
    script_free(scene->script);
    free(scene->script_path);
    scene->script = script;
    scene->script_path = HEAP_TEXT(path);
}

static bool open_with(SelContext *context, SelScene *scene, const SelOpenOptions *options)
{
    Progress progress = context_progress(context);
    OpenVesselOptions how = {.threads = options->threads, .progress = progress.call ? &progress : NULL, .note = context_note};
    if (options->contact)
        take_contact(scene->scene, options->contact, &context->faults);
    if (options->script)
        take_script(scene->scene, options->script, &context->faults);
    scene->shared = context->faults.count == 0 ? vessel_cache_open(scene->scene, &how, &context->faults) : NULL;
    if (!scene->shared)
        return false;
    scene->open = *shared_vessel(scene->shared);
    return open_vessel_inlet(scene->scene, &scene->open, &context->faults);
}

bool scene_open_parsed(SelContext *context, Scene *parsed, const SelOpenOptions *options, SelScene **out)
{
    if (!parsed)
        return false;
    SelScene *scene = HEAP_ZEROED(1, sizeof *scene);
    scene->scene = parsed;
    atomic_init(&scene->holders, 1);
    if (open_with(context, scene, options)) {
        *out = scene;
        return true;
    }
    free_scene(scene);
    return false;
}

typedef struct Opening {
    const char *path, *text; // text NULL: from the file
    size_t length;
    SelOpenOptions options;
    SelScene *scene;
} Opening;

static bool open_scene(SelContext *context, void *what)
{
    Opening *opening = what;
    Scene *scene = opening->text ? scene_parse(opening->text, opening->length, opening->path, &context->faults) : scene_load(opening->path, &context->faults);
    return scene_open_parsed(context, scene, &opening->options, &opening->scene);
}

static SelStatus open_as(SelContext *context, const char *function, Opening *opening, const SelOpenOptions *options, SelScene **out)
{
    if (!options_take(&opening->options, sizeof opening->options, options))
        return context_refuse(context, SEL_ERROR_ARGUMENT, function, "the size of options is not set; begin with sel_open_defaults()");
    SelStatus status = context_call(context, open_scene, opening, SEL_ERROR_INPUT);
    if (status == SEL_OK)
        *out = opening->scene;
    return status;
}

SelStatus sel_scene_open(SelContext *context, const char *path, const SelOpenOptions *options, SelScene **scene)
{
    if (!context || !path || !scene)
        return context_refuse(context, SEL_ERROR_ARGUMENT, __func__, "context, path or scene is NULL");
    return open_as(context, __func__, &(Opening){.path = path}, options, scene);
}

SelStatus sel_scene_parse(SelContext *context, const char *text, size_t length, const char *path, const SelOpenOptions *options, SelScene **scene)
{
    if (!context || !text || !path || !scene)
        return context_refuse(context, SEL_ERROR_ARGUMENT, __func__, "context, text, path or scene is NULL");
    return open_as(context, __func__, &(Opening){.path = path, .text = text, .length = length}, options, scene);
}

typedef struct Building {
    SelSceneOptions options;
    const char *trouble;
    char *text;
    size_t length;
} Building;

static bool write_text(SelContext *context, void *what)
{
    Building *building = what;
    building->text = scene_text(&building->options, &building->length, &building->trouble);
    if (!building->text)
        faults_add(&context->faults, "sel_scene_build", 0, 0, "%s", building->trouble ? building->trouble : "not enough memory");
    return building->text != NULL;
}

SelStatus sel_scene_build(SelContext *context, const SelSceneOptions *scene_options, const SelOpenOptions *options, SelScene **scene)
{
    Building building = {0};
    sel_scene_options_init(&building.options, sizeof building.options);
    if (!context || !scene_options || !scene)
        return context_refuse(context, SEL_ERROR_ARGUMENT, __func__, "context, scene_options or scene is NULL");
    if (!options_take(&building.options, sizeof building.options, scene_options) || !building.options.path)
        return context_refuse(context, SEL_ERROR_ARGUMENT, __func__, "the size or the path of scene_options is not set; begin with sel_scene_defaults()");
    SelStatus status = context_call(context, write_text, &building, SEL_ERROR_MEMORY);
    if (status != SEL_OK)
        return building.trouble ? SEL_ERROR_ARGUMENT : status;
    status = open_as(context, __func__, &(Opening){.path = building.options.path, .text = building.text, .length = building.length}, options, scene);
    free(building.text);
    return status;
}

// --- reading ---

const char *sel_scene_text(const SelScene *scene) { return scene ? scene->scene->text : NULL; }
double sel_scene_step_s(const SelScene *scene) { return scene ? scene->scene->dt / 1000 : 0; }
double sel_scene_script_s(const SelScene *scene) { return scene && scene->scene->script ? script_duration_s(scene->scene->script) : 0; }
int sel_scene_tool_count(const SelScene *scene) { return scene ? scene->scene->tool_count : 0; }

const char *sel_scene_tool_name(const SelScene *scene, int tool)
{
    return tool >= 0 && tool < sel_scene_tool_count(scene) ? scene->scene->tool[tool].name : NULL;
}

static void give_vector(Vec3 v, double out[3]) { out[0] = v.x, out[1] = v.y, out[2] = v.z; }

SelStatus sel_scene_entry(const SelScene *scene, double point_mm[3], double direction[3])
{
    if (!scene || !point_mm || !direction)
        return SEL_ERROR_ARGUMENT;
    give_vector(scene->scene->wire.start, point_mm);
    give_vector(scene->scene->wire.direction, direction);
    return SEL_OK;
}

SelStatus sel_scene_view(const SelScene *scene, double *lao_deg, double *cra_deg, double anterior[3], double superior[3])
{
    if (!scene || !lao_deg || !cra_deg || !anterior || !superior)
        return SEL_ERROR_ARGUMENT;
    const Scene *read = scene->scene;
    bool is_given = vec3_norm(read->patient_superior) > 0;
    *lao_deg = read->lao;
    *cra_deg = read->cra;
    give_vector(is_given ? read->patient_anterior : vec3(0, -1, 0), anterior);
    give_vector(is_given ? read->patient_superior : vec3(0, 0, 1), superior);
    return SEL_OK;
}

int sel_scene_target_count(const SelScene *scene) { return scene ? scene->scene->target_count : 0; }

SelStatus sel_scene_target(const SelScene *scene, int index, SelTarget *target)
{
    if (index < 0 || index >= sel_scene_target_count(scene) || !target)
        return SEL_ERROR_ARGUMENT;
    const SceneTarget *from = &scene->scene->target[index];
    *target = (SelTarget){.name = from->name, .radius_mm = from->radius};
    give_vector(from->point, target->point_mm);
    return SEL_OK;
}

SelStatus sel_scene_query(SelContext *context, const SelScene *scene, int count, const double *point_mm, double *gap_mm, double *normal)
{
    if (!context || !scene || count < 0 || !point_mm || !gap_mm)
        return context_refuse(context, SEL_ERROR_ARGUMENT, __func__, "context, scene, point_mm or gap_mm is NULL, or count is negative");
    if (!scene->open.vessel)
        return context_refuse(context, SEL_ERROR_STATE, __func__, "the scene has no wall");
    return wall_query(context, scene->open.vessel, count, point_mm, gap_mm, normal);
}

int sel_scene_node_count(const SelScene *scene) { return scene && scene->open.tree ? scene->open.tree->node_count : 0; }

SelStatus sel_scene_node(const SelScene *scene, int index, SelTreeNode *node)
{
    if (index < 0 || index >= sel_scene_node_count(scene) || !node)
        return SEL_ERROR_ARGUMENT;
    *node = tree_node(scene->open.tree, index);
    return SEL_OK;
}

// --- other values ---

typedef struct Change {
    const char *text, *key, *value;
    char *changed;
} Change;

static bool is_yaml(const char *text, const char *name, Faults *faults)
{
    YamlReader *reader = yaml_reader_open(text, strlen(text), name, faults);
    yaml_reader_close(reader);
    return reader != NULL;
}

static bool change_text(SelContext *context, void *what)
{
    Change *change = what;
    char name[100];
    snprintf(name, sizeof name, "value of %.80s", change->key);
    if (!is_yaml(change->text, "scene", &context->faults) || !is_yaml(change->value, name, &context->faults))
        return false;
    change->changed = yaml_edit_flow(change->text, change->key, change->value, true);
    if (!change->changed)
        faults_add(&context->faults, "scene", 0, 0,
                   "cannot set '%.80s' to '%.80s'; expected a key that the scene has, such as vessel.friction, and one line of YAML", change->key,
                   change->value);
    return change->changed != NULL;
}

SelStatus sel_scene_text_with(SelContext *context, const char *text, const char *key, const char *value, char **changed)
{
    if (!context || !text || !key || !value || !changed)
        return context_refuse(context, SEL_ERROR_ARGUMENT, __func__, "context, text, key, value or changed is NULL");
    Change change = {.text = text, .key = key, .value = value};
    SelStatus status = context_call(context, change_text, &change, SEL_ERROR_INPUT);
    if (status == SEL_OK)
        *changed = change.changed;
    return status;
}

void sel_vessels_forget(void) { vessel_cache_forget(); }
