#include "sim/library/recon.h"

#include "base/base.h"
#include "sim/library/wall_query.h"

#include <stdlib.h>
#include <string.h>

SelTree *tree_handle(VesselTree *tree, TreeFileInfo info)
{
    SelTree *handle = HEAP_ZEROED(1, sizeof *handle);
    *handle = (SelTree){.tree = tree, .info = info};
    if (vessel_tree_is_model(tree) && !(handle->vessel = model_vessel_create(tree)))
        heap_is_empty(0, __FILE__);
    return handle;
}

void sel_tree_destroy(SelTree *tree)
{
    if (!tree)
        return;
    if (tree->vessel)
        tree->vessel->destroy(tree->vessel);
    vessel_tree_free(tree->tree);
    tree_file_info_free(&tree->info);
    free(tree);
}

// --- files ---

typedef struct TreeFile {
    const char *path;
    const SelTree *saved;
    SelTree *loaded;
} TreeFile;

static bool load(SelContext *context, void *what)
{
    TreeFile *file = what;
    TreeFileInfo info = {0};
    VesselTree *tree = tree_file_load(file->path, &info, &context->faults);
    if (tree)
        file->loaded = tree_handle(tree, info);
    return tree != NULL;
}

SelStatus sel_tree_open(SelContext *context, const char *path, SelTree **tree)
{
    TreeFile file = {.path = path};
    if (!context || !path || !tree)
        return context_refuse(context, SEL_ERROR_ARGUMENT, __func__, "context, path or tree is NULL");
    SelStatus status = context_call(context, load, &file, SEL_ERROR_INPUT);
    if (status == SEL_OK)
        *tree = file.loaded;
    return status;
}

static bool save(SelContext *context, void *what)
{
    const TreeFile *file = what;
    return tree_file_save(file->saved->tree, &file->saved->info, file->path, &context->faults);
}

SelStatus sel_tree_save(SelContext *context, const SelTree *tree, const char *path)
{
    if (!context || !tree || !path)
        return context_refuse(context, SEL_ERROR_ARGUMENT, __func__, "context, tree or path is NULL");
    return context_call(context, save, &(TreeFile){.path = path, .saved = tree}, SEL_ERROR_OUTPUT);
}

// --- reading ---

int sel_tree_node_count(const SelTree *tree) { return tree ? tree->tree->node_count : 0; }
int64_t sel_tree_point_count(const SelTree *tree) { return tree ? tree->tree->point_count : 0; }
SelStatus sel_tree_points(const SelTree *tree, double *point_mm)
{
    if (!tree || !point_mm)
        return SEL_ERROR_ARGUMENT;
    memcpy(point_mm, tree->tree->point, (size_t)tree->tree->point_count * sizeof *tree->tree->point);
    return SEL_OK;
}

int sel_tree_is_model(const SelTree *tree) { return tree && tree->vessel; }

SelTreeNode tree_node(const VesselTree *t, int index)
{
    Vec3 c = t->center[index], d = t->direction[index];
    return (SelTreeNode){.center_mm = {c.x, c.y, c.z},
                         .direction = {d.x, d.y, d.z},
                         .radius_mm = t->radius[index],
                         .parent = t->parent[index],
                         .is_aneurysm = t->kind[index] == NODE_ANEURYSM};
}

SelStatus sel_tree_node(const SelTree *tree, int index, SelTreeNode *node)
{
    if (index < 0 || index >= sel_tree_node_count(tree) || !node)
        return SEL_ERROR_ARGUMENT;
    *node = tree_node(tree->tree, index);
    return SEL_OK;
}

SelStatus sel_tree_query(SelContext *context, const SelTree *tree, int count, const double *point_mm, double *gap_mm, double *normal)
{
    if (!context || !tree || count < 0 || !point_mm || !gap_mm)
        return context_refuse(context, SEL_ERROR_ARGUMENT, __func__, "context, tree, point_mm or gap_mm is NULL, or count is negative");
    if (!tree->vessel)
        return context_refuse(context, SEL_ERROR_STATE, __func__, "the tree has no wall; sel_fit() makes one");
    return wall_query(context, tree->vessel, count, point_mm, gap_mm, normal);
}
