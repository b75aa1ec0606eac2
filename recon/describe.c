#include "recon/describe.h"

#include "base/base.h"
#include "recon/surface/mesh_check.h"
#include "recon/volume/volume_file.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static void add_vector(cJSON *object, const char *name, Vec3 v) { cJSON_AddItemToObject(object, name, cJSON_CreateDoubleArray((double[]){v.x, v.y, v.z}, 3)); }

// Adds the object {"least", "median", "largest"} of `count` values.
static void add_spread(cJSON *object, const char *name, const double *value, int count)
{
    if (count == 0)
        return;
    double *sorted = HEAP_ZEROED((size_t)count, sizeof *sorted);
    memcpy(sorted, value, (size_t)count * sizeof *sorted);
    sort_doubles(sorted, (size_t)count);
    cJSON *spread = cJSON_AddObjectToObject(object, name);
    cJSON_AddNumberToObject(spread, "least", sorted[0]);
    cJSON_AddNumberToObject(spread, "median", sorted[(count - 1) / 2]);
    cJSON_AddNumberToObject(spread, "largest", sorted[count - 1]);
    free(sorted);
}

static void add_box(cJSON *object, const Vec3 *point, int count)
{
    Vec3 low = point[0], high = point[0];
    for (int i = 1; i < count; i++) {
        low = vec3(fmin(low.x, point[i].x), fmin(low.y, point[i].y), fmin(low.z, point[i].z));
        high = vec3(fmax(high.x, point[i].x), fmax(high.y, point[i].y), fmax(high.z, point[i].z));
    }
    add_vector(object, "low_mm", low);
    add_vector(object, "high_mm", high);
}

static void add_models(cJSON *object, const ModelFile *file)
{
    cJSON *list = cJSON_AddArrayToObject(object, "models");
    for (int i = 0; i < MODELS; i++)
        if (i == 0 ? vessel_tree_is_model(file->tree) : file->swept.of[i - 1] != NULL)
            cJSON_AddItemToArray(list, cJSON_CreateString(model_names[i]));
    if (file->sweep) {
        cJSON_AddStringToObject(object, "model", model_names[file->kind]);
        cJSON_AddNumberToObject(object, "model_branches", file->sweep->branch_count);
        cJSON_AddNumberToObject(object, "model_sections", file->sweep->break_count);
    }
}

void describe_tree(cJSON *object, const ModelFile *file)
{
    const VesselTree *tree = file->tree;
    const TreeFileInfo *info = &file->info;
    bool model = file->kind >= 0;
    int *children = HEAP_ZEROED((size_t)tree->node_count, sizeof *children), branches = 1, ends = 0, aneurysm = 0;
    for (int i = 1; i < tree->node_count; i++)
        if (children[tree->parent[i]]++ > 0)
            branches++;
    for (int i = 0; i < tree->node_count; i++) {
        ends += children[i] == 0;
        aneurysm += tree->kind[i] == NODE_ANEURYSM;
    }
    free(children);
    cJSON_AddStringToObject(object, "what", model ? "model" : "tree");
    cJSON_AddNumberToObject(object, "nodes", tree->node_count);
    cJSON_AddNumberToObject(object, "branches", branches);
    cJSON_AddNumberToObject(object, "ends", ends);
    cJSON_AddNumberToObject(object, "aneurysm_nodes", aneurysm);
    cJSON_AddNumberToObject(object, "points", (double)tree->point_count);
    cJSON_AddNumberToObject(object, "centreline_mm", vessel_tree_length(tree));
    add_spread(object, "radius_mm", tree->radius, tree->node_count);
    add_box(object, tree->center, tree->node_count);
    add_vector(object, "root_mm", tree->center[0]);
    if (model)
        add_models(object, file);
    if (file->kind == 0) {
        cJSON_AddNumberToObject(object, "blobs", (double)tree->blob_count);
        cJSON_AddNumberToObject(object, "blobs_per_node", (double)tree->blob_count / tree->node_count);
        cJSON_AddNumberToObject(object, "iso_level", tree->iso_level);
    }
    if (model)
        add_spread(object, "error_mm", file->field.tree->error, file->field.tree->node_count);
    if (info->source)
        cJSON_AddStringToObject(object, "source", info->source);
    if (info->created_by)
        cJSON_AddStringToObject(object, "created_by", info->created_by);
}

bool describe_volume(cJSON *object, const char *path, Faults *faults)
{
    Volume *volume = volume_load(path, faults);
    if (!volume)
        return false;
    cJSON_AddStringToObject(object, "what", "volume");
    cJSON_AddStringToObject(object, "format", volume->format);
    cJSON_AddItemToObject(object, "size", cJSON_CreateIntArray(volume->size, 3));
    double edge[3];
    for (int i = 0; i < 3; i++)
        edge[i] = vec3_norm(volume->axis[i]);
    cJSON_AddItemToObject(object, "voxel_mm", cJSON_CreateDoubleArray(edge, 3));
    add_vector(object, "origin_mm", volume->origin);
    for (int i = 0; i < 3; i++)
        add_vector(object, (const char *const[]){"axis_i_mm", "axis_j_mm", "axis_k_mm"}[i], volume->axis[i]);
    cJSON_AddStringToObject(object, "frame", volume->frame);
    cJSON_AddNumberToObject(object, "minimum", volume->minimum);
    cJSON_AddNumberToObject(object, "maximum", volume->maximum);
    volume_free(volume);
    return true;
}

static void add_count(cJSON *object, const char *name, const MeshFinding *finding) { cJSON_AddNumberToObject(object, name, finding->count); }

bool describe_surface(cJSON *object, const char *path, Faults *faults)
{
    SurfaceMesh *mesh = surface_load(path, faults);
    MeshCheck check;
    if (!mesh)
        return false;
    bool good = mesh_check(mesh, &check);
    if (good) {
        cJSON_AddStringToObject(object, "what", "surface");
        cJSON_AddNumberToObject(object, "vertices", check.vertex_count);
        cJSON_AddNumberToObject(object, "triangles", check.triangle_count);
        cJSON_AddNumberToObject(object, "parts", check.component_count);
        cJSON_AddNumberToObject(object, "openings", check.opening_count);
        add_vector(object, "low_mm", check.low);
        add_vector(object, "high_mm", check.high);
        cJSON_AddNumberToObject(object, "area_mm2", check.area);
        cJSON_AddNumberToObject(object, "volume_mm3", check.volume);
        add_count(object, "open_edges", &check.open_edges);
        add_count(object, "nonmanifold_edges", &check.nonmanifold_edges);
        add_count(object, "one_sided_edges", &check.one_sided_edges);
        add_count(object, "flipped_triangles", &check.flipped_triangles);
        add_count(object, "degenerate_triangles", &check.degenerate_triangles);
        add_count(object, "duplicate_triangles", &check.duplicate_triangles);
        add_count(object, "duplicate_vertices", &check.duplicate_vertices);
        add_count(object, "unreferenced_vertices", &check.unreferenced_vertices);
        cJSON_AddNumberToObject(object, "inside_out_parts", check.inside_out_count);
        cJSON_AddBoolToObject(object, "unit_is_doubtful", check.unit_is_doubtful);
    } else {
        faults_add(faults, path, 0, 0, "not enough memory to check the surface");
    }
    surface_free(mesh);
    return good;
}
