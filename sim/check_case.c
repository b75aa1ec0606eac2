#include "sim/check_case.h"

#include "base/base.h"
#include "sim/tube_tree.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

const char *const check_status_name[CHECK_STATUS_COUNT] = {"passed", "failed", "error", "skipped"};

int check_log_add(CheckLog *log, const CheckCase *one)
{
    if (log->count == log->capacity) {
        log->capacity = log->capacity * 2 + 32;
        log->at = HEAP_GROWN(log->at, (size_t)log->capacity, sizeof *log->at);
    }
    CheckCase *copy = &log->at[log->count++];
    *copy = *one;
    copy->scene = HEAP_TEXT(one->scene);
    copy->name = HEAP_TEXT(one->name);
    copy->message = HEAP_TEXT(one->message ? one->message : "");
    return one->code;
}

void golden_comparison_free(GoldenComparison *comparison)
{
    if (!comparison)
        return;
    tool_path_free(comparison->golden);
    tool_path_free(comparison->run);
    golden_figures_free(&comparison->figures);
    check_wall_free(&comparison->wall);
    free(comparison);
}

static void free_text(const char *text) { free((char *)(uintptr_t)text); }

void check_log_free(CheckLog *log)
{
    for (int i = 0; i < log->count; i++) {
        free_text(log->at[i].scene);
        free_text(log->at[i].name);
        free_text(log->at[i].message);
        golden_comparison_free(log->at[i].comparison);
    }
    free(log->at);
    *log = (CheckLog){0};
}

int check_log_count(const CheckLog *log, const char *scene, CheckStatus status)
{
    int count = 0;
    for (int i = 0; i < log->count; i++)
        count += log->at[i].status == status && (!scene || !strcmp(scene, log->at[i].scene));
    return count;
}

// --- JSON ---

// JSON has no infinity: such a difference is null.
static void add_number(cJSON *object, const char *name, double value)
{
    if (isfinite(value))
        cJSON_AddNumberToObject(object, name, value);
    else
        cJSON_AddNullToObject(object, name);
}

static void add_quantities(cJSON *object, const GoldenComparison *comparison)
{
    cJSON *quantities = cJSON_AddObjectToObject(object, "quantities");
    for (int k = 0; k < TOLERANCE_COUNT; k++) {
        const FigureDifference *difference = &comparison->quantity[k];
        if (!difference->is_compared)
            continue;
        cJSON *one = cJSON_AddObjectToObject(quantities, tolerance_info[k].name);
        add_number(one, "worst", difference->worst);
        add_number(one, "tolerance", difference->tolerance);
        cJSON_AddBoolToObject(one, "passed", difference->first_t_s < 0);
        if (difference->first_t_s >= 0)
            add_number(one, "first_t_s", difference->first_t_s);
    }
    if (comparison->path.first_node >= 0)
        cJSON_AddNumberToObject(object, "first_node", comparison->path.first_node);
}

cJSON *check_log_json(const CheckLog *log)
{
    cJSON *root = cJSON_CreateObject(), *counts = cJSON_AddObjectToObject(root, "counts"), *list = cJSON_AddArrayToObject(root, "cases");
    if (!root || !counts || !list) {
        cJSON_Delete(root);
        return NULL;
    }
    cJSON_AddStringToObject(root, "version", SELDINGER_VERSION);
    for (int k = 0; k < CHECK_STATUS_COUNT; k++)
        cJSON_AddNumberToObject(counts, check_status_name[k], check_log_count(log, NULL, (CheckStatus)k));
    for (int i = 0; i < log->count; i++) {
        const CheckCase *one = &log->at[i];
        cJSON *object = cJSON_CreateObject();
        cJSON_AddStringToObject(object, "scene", one->scene);
        cJSON_AddStringToObject(object, "name", one->name);
        cJSON_AddStringToObject(object, "status", check_status_name[one->status]);
        cJSON_AddStringToObject(object, "message", one->message);
        cJSON_AddNumberToObject(object, "time_s", one->time_s);
        if (one->comparison)
            add_quantities(object, one->comparison);
        cJSON_AddItemToArray(list, object);
    }
    return root;
}

// --- the wall ---

static void reserve(CheckWall *wall, int count)
{
    wall->from = HEAP_ZEROED((size_t)count + 1, sizeof *wall->from);
    wall->to = HEAP_ZEROED((size_t)count + 1, sizeof *wall->to);
    wall->radius = HEAP_ZEROED((size_t)count + 1, sizeof *wall->radius);
}

static void copy_tree(CheckWall *wall, const VesselTree *tree)
{
    reserve(wall, tree->node_count);
    for (int i = 0; i < tree->node_count; i++) {
        bool is_sac = tree->parent[i] < 0 || tree->kind[i] == NODE_ANEURYSM;
        wall->from[i] = tree->center[is_sac ? i : tree->parent[i]];
        wall->to[i] = tree->center[i];
        wall->radius[i] = tree->radius[i];
    }
    wall->count = tree->node_count;
}

void check_wall_copy(CheckWall *wall, const Scene *scene, OpenVessel *open)
{
    enum { DOTS = 3000 };
    Faults *ignored = HEAP_ZEROED(1, sizeof *ignored);
    VesselTree *tube = !open->tree && scene->source == SOURCE_TUBE && open->vessel ? tube_tree(open->vessel, &scene->tube, scene->path, ignored) : NULL;
    free(ignored);
    if (open->tree || tube) {
        copy_tree(wall, open->tree ? open->tree : tube);
    } else if (open->mesh) {
        int stride = open->mesh->vertex_count / DOTS + 1;
        reserve(wall, open->mesh->vertex_count / stride + 1);
        for (int i = 0; i < open->mesh->vertex_count; i += stride) {
            wall->from[wall->count] = wall->to[wall->count] = open->mesh->vertex[i];
            wall->radius[wall->count++] = 0.15;
        }
    }
    vessel_tree_free(tube);
}

void check_wall_free(CheckWall *wall)
{
    free(wall->from);
    free(wall->to);
    free(wall->radius);
    *wall = (CheckWall){0};
}
