#include "recon/surface/centreline_write.h"

#include "base/base.h"
#include "recon/surface/vtp_write.h"

#include <cJSON.h>
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

// Calls `branch(context, nodes, count)` for each branch of a tree. A branch is a chain from a child of a fork (or the root) to the next fork or end; it
// begins with the fork's node, so that lines join.
static void each_branch(const VesselTree *tree, void (*branch)(void *context, const int *node, int count), void *context)
{
    size_t nodes = (size_t)tree->node_count;
    int *children = HEAP_ZEROED(nodes, sizeof *children), *only = HEAP_ZEROED(nodes, sizeof *only), *chain = HEAP_ZEROED(nodes + 1, sizeof *chain);
    for (int i = 1; i < tree->node_count; i++) {
        children[tree->parent[i]]++;
        only[tree->parent[i]] = i;
    }
    for (int i = 0; i < tree->node_count; i++) {
        int parent = tree->parent[i], count = 0;
        if (parent >= 0 && children[parent] == 1)
            continue;
        if (parent >= 0)
            chain[count++] = parent;
        for (int at = i;; at = only[at]) {
            chain[count++] = at;
            if (children[at] != 1)
                break;
        }
        branch(context, chain, count);
    }
    free(children);
    free(only);
    free(chain);
}

typedef struct Lines {
    FILE *connectivity, *offsets;
    int count;
    int64_t points;
} Lines;

static void add_line(void *context, const int *node, int count)
{
    Lines *lines = context;
    for (int i = 0; i < count; i++)
        fprintf(lines->connectivity, "%d%c", node[i], i + 1 < count ? ' ' : '\n');
    lines->points += count;
    lines->count++;
    fprintf(lines->offsets, "%" PRId64 "\n", lines->points);
}

static bool centreline_print_vtp(FILE *out, const VesselTree *tree)
{
    OutputText connectivity, offsets;
    bool first = output_text_open(&connectivity), second = output_text_open(&offsets), good = first && second;
    Lines lines = {.connectivity = connectivity.stream, .offsets = offsets.stream};
    if (good)
        each_branch(tree, add_line, &lines);
    good &= !first || fclose(connectivity.stream) == 0;
    good &= !second || fclose(offsets.stream) == 0;
    if (good) {
        vtp_begin(out, tree->node_count, lines.count, 0);
        fprintf(out, "<PointData Scalars=\"Radius\">\n");
        vtp_array(out, "Float64", "Radius", 1);
        for (int i = 0; i < tree->node_count; i++)
            fprintf(out, "%.9g\n", tree->radius[i]);
        vtp_array_end(out);
        vtp_array(out, "Int32", "kind", 1);
        for (int i = 0; i < tree->node_count; i++)
            fprintf(out, "%d\n", tree->kind[i]);
        vtp_array_end(out);
        fprintf(out, "</PointData>\n");
        vtp_points(out, tree->center, tree->node_count);
        fprintf(out, "<Lines>\n");
        vtp_array(out, "Int64", "connectivity", 1);
        fputs(connectivity.bytes, out);
        vtp_array_end(out);
        vtp_array(out, "Int64", "offsets", 1);
        fputs(offsets.bytes, out);
        vtp_array_end(out);
        fprintf(out, "</Lines>\n");
        vtp_end(out);
    }
    free(connectivity.bytes);
    free(offsets.bytes);
    return good;
}

static bool centreline_print_swc(FILE *out, const VesselTree *tree)
{
    fprintf(out, "# seldinger " SELDINGER_VERSION ", mm: id type x y z radius parent; type 0: vessel, 5: aneurysm\n");
    for (int i = 0; i < tree->node_count; i++)
        fprintf(out, "%d %d %.9g %.9g %.9g %.9g %d\n", i + 1, tree->kind[i] == NODE_ANEURYSM ? 5 : 0, tree->center[i].x, tree->center[i].y, tree->center[i].z,
                tree->radius[i], tree->parent[i] < 0 ? -1 : tree->parent[i] + 1);
    return true;
}

typedef struct Curves {
    const VesselTree *tree;
    const char *frame;
    cJSON *list;
} Curves;

static void add_curve(void *context, const int *node, int count)
{
    Curves *curves = context;
    const VesselTree *tree = curves->tree;
    cJSON *curve = cJSON_CreateObject(), *points, *measurements, *radius, *values;
    char name[48];
    snprintf(name, sizeof name, "branch at node %d", node[count > 1 ? 1 : 0]);
    cJSON_AddStringToObject(curve, "type", "Curve");
    cJSON_AddStringToObject(curve, "name", name);
    cJSON_AddStringToObject(curve, "coordinateSystem", curves->frame);
    cJSON_AddStringToObject(curve, "coordinateUnits", "mm");
    cJSON_AddBoolToObject(curve, "locked", false);
    cJSON_AddStringToObject(curve, "labelFormat", "%N-%d");
    cJSON_AddNumberToObject(curve, "lastUsedControlPointNumber", count);
    points = cJSON_AddArrayToObject(curve, "controlPoints");
    values = cJSON_CreateArray();
    for (int i = 0; i < count; i++) {
        cJSON *point = cJSON_CreateObject();
        Vec3 x = tree->center[node[i]];
        char id[16];
        snprintf(id, sizeof id, "%d", i + 1);
        cJSON_AddStringToObject(point, "id", id);
        cJSON_AddStringToObject(point, "label", id);
        cJSON_AddItemToObject(point, "position", cJSON_CreateDoubleArray((double[]){x.x, x.y, x.z}, 3));
        cJSON_AddStringToObject(point, "positionStatus", "defined");
        cJSON_AddItemToArray(points, point);
        cJSON_AddItemToArray(values, cJSON_CreateNumber(tree->radius[node[i]]));
    }
    measurements = cJSON_AddArrayToObject(curve, "measurements");
    radius = cJSON_CreateObject();
    cJSON_AddStringToObject(radius, "name", "Radius");
    cJSON_AddBoolToObject(radius, "enabled", true);
    cJSON_AddStringToObject(radius, "units", "mm");
    cJSON_AddItemToObject(radius, "controlPointValues", values);
    cJSON_AddItemToArray(measurements, radius);
    cJSON_AddItemToArray(curves->list, curve);
}

// Prints 3D Slicer Markups, one curve per branch; `frame`: "RAS" or "LPS".
static bool centreline_print_markups(FILE *out, const VesselTree *tree, const char *frame)
{
    cJSON *root = cJSON_CreateObject();
    cJSON_AddStringToObject(root, "@schema",
                            "https://raw.githubusercontent.com/slicer/slicer/master/Modules/Loadable/Markups/Resources/Schema/markups-schema-v1.0.3.json#");
    Curves curves = {.tree = tree, .frame = frame, .list = cJSON_AddArrayToObject(root, "markups")};
    if (curves.list)
        each_branch(tree, add_curve, &curves);
    char *text = curves.list ? cJSON_Print(root) : NULL;
    if (text)
        fprintf(out, "%s\n", text);
    free(text);
    cJSON_Delete(root);
    return text != NULL;
}

bool centreline_write_file(const char *path, const char *extension, const VesselTree *tree, const char *frame, Faults *faults)
{
    OutputText text;
    if (!output_text_open(&text)) {
        faults_add(faults, path, 0, 0, "cannot be written: out of memory");
        return false;
    }
    bool good = !strcmp(extension, ".vtp")   ? centreline_print_vtp(text.stream, tree)
                : !strcmp(extension, ".swc") ? centreline_print_swc(text.stream, tree)
                                             : centreline_print_markups(text.stream, tree, frame);
    if (!good)
        faults_add(faults, path, 0, 0, "cannot be written: out of memory");
    return good ? output_text_write(&text, path, faults) : output_text_forget(&text);
}
