// seldinger export: surfaces, centrelines and recordings for other programs.
#include "cli/cli.h"

#include "base/heap.h"
#include "base/output.h"
#include "cli/file_kind.h"
#include "cli/output_plan.h"
#include "geom/surface_parts.h"
#include "recon/tree_file.h"
#include "sim/recording.h"

#include <cJSON.h>
#include <getopt.h>
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

static const char help[] =
    "Usage: seldinger export FILE -o OUT [options]\n\n"
    "Writes what FILE (a tree, model or recording) holds for other programs; the extension of OUT says how. Lengths mm.\n\n"
    "  model, surface         .stl (binary)  .ply  .obj  .vtp; .ply and .vtp also hold for each vertex\n"
    "                         node      whose local model it lies on\n"
    "                         error_mm  signed distance of the nearest data point to that model, > 0 inside: the model is too wide there\n"
    "                         data_mm   distance of the vertex to that data point: large where there are no data, as on caps\n"
    "                         (.stl and .obj have no place for these)\n"
    "  tree or model, centreline  .vtp (lines with Radius)  .mrk.json (3D Slicer curves)  .swc\n"
    "  recording              .csv (a row a node and frame)  .vtp or .pvd (one .vtp a frame and a .pvd that names them); of several\n"
    "                         tools all nodes of each, with what carries them: a column of the .csv, numbers (0 outermost) in a .vtp\n\n"
    "  --what surface|centreline  what a .vtp holds; default: the surface of a model, the centreline of a tree\n"
    "  --cell-mm X                size of the surface's cells [mm]; default: about ten to twenty cells round the thinnest branch\n"
    "  --keep-floating            also the parts of a surface to which no point gets from the inlet; dropped otherwise, which is said\n"
    "  --open-inlet               the surface is cut open at the root's plane; blobs close it otherwise\n"
    "  --frame RAS|LPS            coordinate system that a .mrk.json names; coordinates are never converted; default LPS\n"
    "  -o OUT                     the file to write\n"
    "  --quiet                    does not print what a surface is: parts, open edges, Euler characteristic, area, volume\n"
    "  --threads N                accepted as everywhere; nothing here takes long\n\n"
    "Exit codes: 0 done; 2 wrong usage or bad input.\n";

typedef struct ExportOptions {
    const char *in, *out, *what, *frame;
    double cell_mm;          // 0: automatic
    bool open_inlet, keep_floating, quiet;
} ExportOptions;

// --- text that grows in memory, then one write ---

typedef struct Text {
    FILE *stream;
    char *bytes;
    size_t length;
} Text;

static bool text_open(Text *text)
{
    *text = (Text){0};
    text->stream = open_memstream(&text->bytes, &text->length);
    return text->stream != NULL;
}

static bool text_write(Text *text, const char *path, Faults *faults)
{
    bool whole = !ferror(text->stream) && fclose(text->stream) == 0;
    if (!whole)
        faults_add(faults, path, 0, 0, "cannot be written: no memory");
    whole = whole && output_write(path, text->bytes, text->length, faults);
    free(text->bytes);
    return whole;
}

static bool text_forget(Text *text)
{
    fclose(text->stream);
    free(text->bytes);
    return false;
}

// --- surfaces ---

typedef struct Surface {
    TriangleMesh *mesh;
    double *error, *distance;   // (V) [mm], both NULL where the tree has no points
} Surface;

static void put_float(FILE *out, double value)
{
    float single = (float)value;
    uint32_t bits;
    memcpy(&bits, &single, sizeof bits);
    for (int i = 0; i < 4; i++)
        fputc((int)(bits >> (8 * i) & 0xff), out);
}

static void put_vector(FILE *out, Vec3 v)
{
    put_float(out, v.x);
    put_float(out, v.y);
    put_float(out, v.z);
}

static void print_stl(FILE *out, const Surface *surface)
{
    const TriangleMesh *mesh = surface->mesh;
    char head[81] = "seldinger " SELDINGER_VERSION ", mm";
    fwrite(head, 1, 80, out);
    for (int i = 0; i < 4; i++)
        fputc((int)((unsigned)mesh->triangle_count >> (8 * i) & 0xff), out);
    for (int i = 0; i < mesh->triangle_count; i++) {
        Vec3 corner[3];
        for (int j = 0; j < 3; j++)
            corner[j] = mesh->vertex[mesh->triangle[i][j]];
        put_vector(out, vec3_unit_or(vec3_cross(vec3_sub(corner[1], corner[0]), vec3_sub(corner[2], corner[0])), vec3(0, 0, 0)));
        for (int j = 0; j < 3; j++)
            put_vector(out, corner[j]);
        fputc(0, out);
        fputc(0, out);
    }
}

static void print_ply(FILE *out, const Surface *surface)
{
    const TriangleMesh *mesh = surface->mesh;
    fprintf(out,
            "ply\nformat ascii 1.0\ncomment seldinger " SELDINGER_VERSION ", mm\nelement vertex %d\nproperty float x\nproperty float y\nproperty float z\n"
            "property float nx\nproperty float ny\nproperty float nz\nproperty int node\n%selement face %d\nproperty list uchar int vertex_indices\n"
            "end_header\n",
            mesh->vertex_count, surface->error ? "property float error_mm\nproperty float data_mm\n" : "", mesh->triangle_count);
    for (int i = 0; i < mesh->vertex_count; i++) {
        fprintf(out, "%.9g %.9g %.9g %.6g %.6g %.6g %d", mesh->vertex[i].x, mesh->vertex[i].y, mesh->vertex[i].z, mesh->normal[i].x, mesh->normal[i].y,
                mesh->normal[i].z, mesh->node[i]);
        if (surface->error)
            fprintf(out, " %.6g %.6g", surface->error[i], surface->distance[i]);
        fputc('\n', out);
    }
    for (int i = 0; i < mesh->triangle_count; i++)
        fprintf(out, "3 %d %d %d\n", mesh->triangle[i][0], mesh->triangle[i][1], mesh->triangle[i][2]);
}

static void print_obj(FILE *out, const Surface *surface)
{
    const TriangleMesh *mesh = surface->mesh;
    fprintf(out, "# seldinger " SELDINGER_VERSION ", mm\n");
    for (int i = 0; i < mesh->vertex_count; i++)
        fprintf(out, "v %.9g %.9g %.9g\n", mesh->vertex[i].x, mesh->vertex[i].y, mesh->vertex[i].z);
    for (int i = 0; i < mesh->vertex_count; i++)
        fprintf(out, "vn %.6g %.6g %.6g\n", mesh->normal[i].x, mesh->normal[i].y, mesh->normal[i].z);
    for (int i = 0; i < mesh->triangle_count; i++) {
        const int *t = mesh->triangle[i];
        fprintf(out, "f %d//%d %d//%d %d//%d\n", t[0] + 1, t[0] + 1, t[1] + 1, t[1] + 1, t[2] + 1, t[2] + 1);
    }
}

// --- VTP: XML with the numbers as text, which every reader takes ---

static void vtp_begin(FILE *out, int points, int lines, int polygons)
{
    fprintf(out,
            "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"0.1\" byte_order=\"LittleEndian\">\n<PolyData>\n"
            "<Piece NumberOfPoints=\"%d\" NumberOfVerts=\"0\" NumberOfLines=\"%d\" NumberOfStrips=\"0\" NumberOfPolys=\"%d\">\n",
            points, lines, polygons);
}

static void vtp_array(FILE *out, const char *type, const char *name, int components)
{
    fprintf(out, "<DataArray type=\"%s\" Name=\"%s\" NumberOfComponents=\"%d\" format=\"ascii\">\n", type, name, components);
}

static void vtp_array_end(FILE *out) { fprintf(out, "</DataArray>\n"); }

static void vtp_numbers(FILE *out, const char *name, const double *value, int count)
{
    vtp_array(out, "Float64", name, 1);
    for (int i = 0; i < count; i++)
        fprintf(out, "%.9g\n", value[i]);
    vtp_array_end(out);
}

static void vtp_vectors(FILE *out, const char *name, const Vec3 *value, int count)
{
    vtp_array(out, "Float64", name, 3);
    for (int i = 0; i < count; i++)
        fprintf(out, "%.9g %.9g %.9g\n", value[i].x, value[i].y, value[i].z);
    vtp_array_end(out);
}

static void vtp_points(FILE *out, const Vec3 *value, int count)
{
    fprintf(out, "<Points>\n");
    vtp_vectors(out, "Points", value, count);
    fprintf(out, "</Points>\n");
}

static void vtp_end(FILE *out) { fprintf(out, "</Piece>\n</PolyData>\n</VTKFile>\n"); }

static void print_surface_vtp(FILE *out, const Surface *surface)
{
    const TriangleMesh *mesh = surface->mesh;
    vtp_begin(out, mesh->vertex_count, 0, mesh->triangle_count);
    fprintf(out, "<PointData Normals=\"Normals\" Scalars=\"%s\">\n", surface->error ? "error_mm" : "node");
    vtp_vectors(out, "Normals", mesh->normal, mesh->vertex_count);
    vtp_array(out, "Int32", "node", 1);
    for (int i = 0; i < mesh->vertex_count; i++)
        fprintf(out, "%d\n", mesh->node[i]);
    vtp_array_end(out);
    if (surface->error) {
        vtp_numbers(out, "error_mm", surface->error, mesh->vertex_count);
        vtp_numbers(out, "data_mm", surface->distance, mesh->vertex_count);
    }
    fprintf(out, "</PointData>\n");
    vtp_points(out, mesh->vertex, mesh->vertex_count);
    fprintf(out, "<Polys>\n");
    vtp_array(out, "Int64", "connectivity", 1);
    for (int i = 0; i < mesh->triangle_count; i++)
        fprintf(out, "%d %d %d\n", mesh->triangle[i][0], mesh->triangle[i][1], mesh->triangle[i][2]);
    vtp_array_end(out);
    vtp_array(out, "Int64", "offsets", 1);
    for (int i = 0; i < mesh->triangle_count; i++)
        fprintf(out, "%d\n", 3 * (i + 1));
    vtp_array_end(out);
    fprintf(out, "</Polys>\n");
    vtp_end(out);
}

static void print_census(const SurfaceCensus *c, double cell_mm, int bubbles)
{
    printf("surface        %d vertices, %d triangles, cells of %.3g mm\n", c->vertices, c->triangles, cell_mm);
    printf("parts          %d, Euler characteristic %" PRId64 "%s\n", c->parts, c->euler,
           bubbles ? "; bubbles inside the lumen and specks beside it were dropped" : "");
    printf("edges          %" PRId64 " open, %" PRId64 " non-manifold, %" PRId64 " between triangles turned against each other\n", c->open_edges,
           c->non_manifold_edges, c->turned_edges);
    printf("area, volume   %.6g mm2, %.6g mm3\n", c->area, c->volume);
}

// Parts that the flood from the inlet does not reach: how many and where, on standard error, so that it is seen whatever is asked for.
static void say_dropped(const char *file, const SurfaceParts *parts)
{
    enum { SHOWN = 6 };
    int count[PART_KINDS] = {0}, shown = 0;
    double volume = 0;
    for (int p = 0; p < parts->count; p++) {
        const SurfacePart *part = &parts->part[p];
        count[part->kind]++;
        volume += part->kind == PART_SHUT || part->kind == PART_GHOST ? part->volume : 0;
    }
    if (count[PART_SHUT] + count[PART_GHOST] == 0)
        return;
    fprintf(stderr, "%s: %d part%s of the surface dropped, %.3g mm3: %d with nodes of the tree that are shut off from the inlet, %d that hold%s none (--keep-floating keeps them)\n",
            file, count[PART_SHUT] + count[PART_GHOST], count[PART_SHUT] + count[PART_GHOST] == 1 ? "" : "s", volume, count[PART_SHUT], count[PART_GHOST],
            count[PART_GHOST] == 1 ? "s" : "");
    for (int p = 0; p < parts->count && shown < SHOWN; p++) {
        const SurfacePart *part = &parts->part[p];
        if (part->kind != PART_SHUT && part->kind != PART_GHOST)
            continue;
        shown++;
        fprintf(stderr, "    %.3g mm3 with %d nodes at %.2f, %.2f, %.2f (node %d)\n", part->volume, part->nodes, part->place.x, part->place.y, part->place.z,
                part->node);
    }
    if (count[PART_SHUT] + count[PART_GHOST] > shown)
        fprintf(stderr, "    and %d smaller ones\n", count[PART_SHUT] + count[PART_GHOST] - shown);
}

// Bubbles in the lumen, and what hangs on nothing unless that is wanted. False where there is no memory.
static bool drop_parts(const ExportOptions *options, double cell, const VesselTree *tree, TriangleMesh *mesh, int *bubbles)
{
    ReachOptions flood = reach_default_options();
    Reach *reach = reach_create(tree, &flood);
    SurfaceParts *parts = reach ? surface_parts_create(mesh, tree, reach) : NULL;
    bool kinds[PART_KINDS] = {[PART_INLET] = true, [PART_SHUT] = options->keep_floating, [PART_GHOST] = options->keep_floating};
    // specks of a few cells beside the lumen proper come from the lattice, not from the wall
    for (int p = 1; parts && p < parts->count; p++)
        if (parts->part[p].kind == PART_INLET && parts->part[p].volume < 64 * cell * cell * cell)
            parts->part[p].kind = PART_BUBBLE;
    bool good = parts && surface_parts_keep(mesh, parts, kinds);
    *bubbles = 0;
    for (int p = 0; good && p < parts->count; p++)
        *bubbles += parts->part[p].kind == PART_BUBBLE;
    if (good && !options->keep_floating)
        say_dropped(options->in, parts);
    surface_parts_free(parts);
    reach_free(reach);
    return good;
}

// The surface as it will be written, what there is to say of it told. False with faults.
static bool make_surface(const ExportOptions *options, bool with_error, const VesselTree *tree, Surface *surface, Faults *faults)
{
    double cell = options->cell_mm > 0 ? options->cell_mm : isosurface_cell_for(tree);
    TriangleMesh *mesh = surface->mesh = isosurface_of_tree(tree, cell);
    if (!mesh || mesh->triangle_count < 1) {
        faults_add(faults, options->in, 0, 0, "gives no surface: %s", mesh ? "the model is empty at this --cell-mm" : "no memory; a larger --cell-mm may do");
        return false;
    }
    SurfaceCensus census;
    int bubbles;
    bool good = drop_parts(options, cell, tree, mesh, &bubbles);
    if (options->open_inlet && !surface_open_inlet(mesh, tree)) {
        faults_add(faults, options->in, 0, 0, "has no inlet to open: the tree goes on upstream of its root, or the root's points close it; leave --open-inlet away");
        return false;
    }
    good = good && surface_census(mesh, &census);
    if (good && with_error && tree->point_count > 0) {
        surface->error = malloc(((size_t)mesh->vertex_count + 1) * sizeof *surface->error);
        surface->distance = malloc(((size_t)mesh->vertex_count + 1) * sizeof *surface->distance);
        good = surface->error && surface->distance && surface_point_error(mesh, tree, surface->error, surface->distance);
    }
    if (!good)
        faults_add(faults, options->in, 0, 0, "gives no surface: no memory; a larger --cell-mm may do");
    else if (!options->quiet && strcmp(options->out, "-"))
        print_census(&census, cell, bubbles);
    return good;
}

static bool export_surface(const ExportOptions *options, const char *extension, const VesselTree *tree, Faults *faults)
{
    Surface surface = {0};
    Text text;
    bool good = make_surface(options, !strcmp(extension, ".ply") || !strcmp(extension, ".vtp"), tree, &surface, faults);
    if (good && !text_open(&text)) {
        faults_add(faults, options->out, 0, 0, "cannot be written: no memory");
        good = false;
    }
    if (good) {
        void (*print)(FILE *, const Surface *) = !strcmp(extension, ".stl")   ? print_stl
                                                 : !strcmp(extension, ".ply") ? print_ply
                                                 : !strcmp(extension, ".obj") ? print_obj
                                                                              : print_surface_vtp;
        print(text.stream, &surface);
        good = text_write(&text, options->out, faults);
    }
    triangle_mesh_free(surface.mesh);
    free(surface.error);
    free(surface.distance);
    return good;
}

// --- centrelines ---

// The branches of a tree: a branch is a chain from a child of a fork (or the root) to the next fork or end; it begins with the fork's node, so
// that lines join. Calls `branch(context, nodes, count)` for each.
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

static bool print_centreline_vtp(FILE *out, const VesselTree *tree)
{
    Text connectivity, offsets;
    bool first = text_open(&connectivity), second = text_open(&offsets), good = first && second;
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

static bool print_swc(FILE *out, const VesselTree *tree)
{
    fprintf(out, "# seldinger " SELDINGER_VERSION ", mm: id type x y z radius parent; type 0: vessel, 5: aneurysm\n");
    for (int i = 0; i < tree->node_count; i++)
        fprintf(out, "%d %d %.9g %.9g %.9g %.9g %d\n", i + 1, tree->kind[i] == NODE_ANEURYSM ? 5 : 0, tree->center[i].x, tree->center[i].y,
                tree->center[i].z, tree->radius[i], tree->parent[i] < 0 ? -1 : tree->parent[i] + 1);
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

static bool print_markups(FILE *out, const VesselTree *tree, const char *frame)
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

static bool export_centreline(const ExportOptions *options, const char *extension, const VesselTree *tree, Faults *faults)
{
    Text text;
    if (!text_open(&text)) {
        faults_add(faults, options->out, 0, 0, "cannot be written: no memory");
        return false;
    }
    bool good = !strcmp(extension, ".vtp")   ? print_centreline_vtp(text.stream, tree)
                : !strcmp(extension, ".swc") ? print_swc(text.stream, tree)
                                             : print_markups(text.stream, tree, options->frame);
    if (!good)
        faults_add(faults, options->out, 0, 0, "cannot be written: no memory");
    return good ? text_write(&text, options->out, faults) : text_forget(&text);
}

static bool export_tree(const ExportOptions *options, const char *extension, Faults *faults)
{
    VesselTree *tree = tree_file_load(options->in, NULL, faults);
    if (!tree)
        return false;
    bool model = vessel_tree_is_model(tree), good = false;
    bool line_only = !strcmp(extension, ".swc") || !strcmp(extension, ".json");
    bool surface_only = !strcmp(extension, ".stl") || !strcmp(extension, ".ply") || !strcmp(extension, ".obj");
    bool surface = options->what ? !strcmp(options->what, "surface") : surface_only || (model && !line_only);
    if (!line_only && !surface_only && strcmp(extension, ".vtp"))
        faults_add(faults, options->out, 0, 0, "extension '%s' is no format of a tree or model; valid: .stl .ply .obj .vtp .mrk.json .swc", extension);
    else if (surface ? line_only : surface_only)
        faults_add(faults, options->out, 0, 0, "'%s' cannot hold a %s; valid: %s", extension, surface ? "surface" : "centreline",
                   surface ? ".stl .ply .obj .vtp" : ".vtp .mrk.json .swc");
    else if (surface && !model)
        faults_add(faults, options->in, 0, 0, "is a tree without a model, so it has no surface; `seldinger fit` makes one, or export the centreline");
    else
        good = surface ? export_surface(options, extension, tree, faults) : export_centreline(options, extension, tree, faults);
    vessel_tree_free(tree);
    return good;
}

// --- recordings ---

static void print_place(FILE *out, Vec3 x, Quat q) { fprintf(out, "%.9g,%.9g,%.9g,%.9g,%.9g,%.9g,%.9g", x.x, x.y, x.z, q.w, q.x, q.y, q.z); }

static void print_frame_rows(FILE *out, const RecordedRun *run, int64_t frame)
{
    RecordedFrame at = recorded_run_frame(run, frame);
    int64_t step = run->frame_step[frame];
    for (int i = 0; i < at.node_count; i++) {
        fprintf(out, "%.9g,%" PRId64 ",%d,", run->time_s[step], step, i);
        print_place(out, at.position[i], at.quaternion[i]);
        fputc('\n', out);
    }
}

// Of several tools all their own nodes, as in the final state that `run` writes.
static void print_tool_rows(FILE *out, const RecordedRun *run, int64_t frame)
{
    int64_t step = run->frame_step[frame];
    for (int k = 0; k < run->tool_count; k++) {
        const RecordedToolFrame at = recorded_run_tool_frame(run, k, frame);
        for (int i = 0; i < at.node_count; i++) {
            fprintf(out, "%.9g,%" PRId64 ",%s,%d,", run->time_s[step], step, run->tool[k].name, i);
            print_place(out, at.position[i], at.quaternion[i]);
            fprintf(out, ",%s", at.carrier[i] < 0 ? "-" : run->tool[at.carrier[i]].name);
            if (run->exchange)
                fprintf(out, ",%d", recorded_run_fitted(run, k, step));
            fputc('\n', out);
        }
    }
}

static bool export_rows(const ExportOptions *options, const RecordedRun *run, Faults *faults)
{
    Text text;
    bool several = run->tool_count > 1;
    if (!text_open(&text)) {
        faults_add(faults, options->out, 0, 0, "cannot be written: no memory");
        return false;
    }
    fprintf(text.stream, "t_s,step,%snode,x_mm,y_mm,z_mm,qw,qx,qy,qz%s%s\n", several ? "tool," : "", several ? ",carrier" : "", run->exchange ? ",exchange" : "");
    for (int64_t k = 0; k < run->frame_count; k++)
        (several ? print_tool_rows : print_frame_rows)(text.stream, run, k);
    return text_write(&text, options->out, faults);
}

// A line of a frame: the single tool, or one of several with all its own nodes.
typedef struct FrameLine {
    int count;
    const Vec3 *position;
    const double *radius;
    const int8_t *carrier;   // NULL: a single tool
} FrameLine;

static int lines_of(const RecordedRun *run, int64_t frame, FrameLine line[STEP_TOOLS_MAX])
{
    RecordedFrame at = recorded_run_frame(run, frame);
    line[0] = (FrameLine){at.node_count, at.position, at.radius, NULL};
    for (int k = 0; run->tool_count > 1 && k < run->tool_count; k++) {
        const RecordedToolFrame own = recorded_run_tool_frame(run, k, frame);
        line[k] = (FrameLine){own.node_count, own.position, own.radius, own.carrier};
    }
    return run->tool_count;
}

static void print_tool_numbers(FILE *out, const FrameLine *line, int lines)
{
    vtp_array(out, "Int32", "tool", 1);
    for (int k = 0; k < lines; k++)
        for (int i = 0; i < line[k].count; i++)
            fprintf(out, "%d\n", k);
    vtp_array_end(out);
    vtp_array(out, "Int32", "carrier", 1);
    for (int k = 0; k < lines; k++)
        for (int i = 0; i < line[k].count; i++)
            fprintf(out, "%d\n", line[k].carrier[i]);
    vtp_array_end(out);
}

static void print_frame_vtp(FILE *out, const RecordedRun *run, int64_t frame)
{
    FrameLine line[STEP_TOOLS_MAX];
    int lines = lines_of(run, frame, line), points = 0, end = 0;
    for (int k = 0; k < lines; k++)
        points += line[k].count;
    vtp_begin(out, points, lines, 0);
    fprintf(out, "<PointData Scalars=\"Radius\">\n");
    vtp_array(out, "Float64", "Radius", 1);
    for (int k = 0; k < lines; k++)
        for (int i = 0; i < line[k].count; i++)
            fprintf(out, "%.9g\n", line[k].radius[i]);
    vtp_array_end(out);
    if (line[0].carrier)
        print_tool_numbers(out, line, lines);
    fprintf(out, "</PointData>\n<Points>\n");
    vtp_array(out, "Float64", "Points", 3);
    for (int k = 0; k < lines; k++)
        for (int i = 0; i < line[k].count; i++)
            fprintf(out, "%.9g %.9g %.9g\n", line[k].position[i].x, line[k].position[i].y, line[k].position[i].z);
    vtp_array_end(out);
    fprintf(out, "</Points>\n<Lines>\n");
    vtp_array(out, "Int64", "connectivity", 1);
    for (int i = 0; i < points; i++)
        fprintf(out, "%d\n", i);
    vtp_array_end(out);
    vtp_array(out, "Int64", "offsets", 1);
    for (int k = 0; k < lines; k++)
        fprintf(out, "%d\n", end += line[k].count);
    vtp_array_end(out);
    fprintf(out, "</Lines>\n");
    vtp_end(out);
}

static bool export_frame(const char *path, const RecordedRun *run, int64_t frame, Faults *faults)
{
    Text text;
    if (!text_open(&text)) {
        faults_add(faults, path, 0, 0, "cannot be written: no memory");
        return false;
    }
    print_frame_vtp(text.stream, run, frame);
    return text_write(&text, path, faults);
}

// OUT.pvd names OUT_00000.vtp and on, each with its time; the .pvd comes last, so what it names is there.
static bool export_series(const ExportOptions *options, const RecordedRun *run, Faults *faults)
{
    int stem = (int)(strlen(options->out) - 4);
    size_t room = strlen(options->out) + 32;
    char *path = malloc(room);
    const char *slash = strrchr(options->out, '/'), *name = slash ? slash + 1 : options->out;
    Text list;
    bool good = path && text_open(&list);
    if (!good) {
        faults_add(faults, options->out, 0, 0, "cannot be written: no memory");
        free(path);
        return false;
    }
    fprintf(list.stream, "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\" byte_order=\"LittleEndian\">\n<Collection>\n");
    for (int64_t k = 0; good && k < run->frame_count; k++) {
        snprintf(path, room, "%.*s_%05" PRId64 ".vtp", stem, options->out, k);
        good = export_frame(path, run, k, faults);
        fprintf(list.stream, "<DataSet timestep=\"%.9g\" group=\"\" part=\"0\" file=\"%.*s_%05" PRId64 ".vtp\"/>\n", run->time_s[run->frame_step[k]],
                stem - (int)(name - options->out), name, k);
    }
    fprintf(list.stream, "</Collection>\n</VTKFile>\n");
    snprintf(path, room, "%.*s.pvd", stem, options->out);
    if (good) {
        good = text_write(&list, path, faults);
    } else {
        fclose(list.stream);
        free(list.bytes);
    }
    free(path);
    return good;
}

static bool export_recording(const ExportOptions *options, const char *extension, Faults *faults)
{
    bool rows = !strcmp(extension, ".csv"), series = !strcmp(extension, ".vtp") || !strcmp(extension, ".pvd");
    if (!rows && !series) {
        faults_add(faults, options->out, 0, 0, "extension '%s' is no format of a recording here%s; valid: .csv .vtp .pvd", extension,
                   !strcmp(extension, ".vtkhdf") || !strcmp(extension, ".hdf") ? " (VTKHDF is not built yet)" : "");
        return false;
    }
    RecordedRun *run = recorded_run_load(options->in, faults);
    bool good = run && (rows ? export_rows(options, run, faults) : export_series(options, run, faults));
    recorded_run_free(run);
    return good;
}

// --- the verb ---

static int parse_options(int argc, char **argv, ExportOptions *options)
{
    enum { WHAT = 256, CELL, FRAME, OPEN, FLOATING, THREADS, QUIET, HELP };
    static const struct option table[] = {{"what", required_argument, NULL, WHAT},       {"cell-mm", required_argument, NULL, CELL},
                                          {"frame", required_argument, NULL, FRAME},     {"output", required_argument, NULL, 'o'},
                                          {"threads", required_argument, NULL, THREADS}, {"quiet", no_argument, NULL, QUIET},
                                          {"open-inlet", no_argument, NULL, OPEN},       {"keep-floating", no_argument, NULL, FLOATING},
                                          {"help", no_argument, NULL, HELP},
                                          {0}};
    *options = (ExportOptions){.frame = "LPS"};
    double number;
    optind = 1;
    for (int choice; (choice = getopt_long(argc, argv, "ho:", table, NULL)) != -1;) {
        switch (choice) {
        case 'o': options->out = optarg; break;
        case WHAT:
            options->what = optarg;
            if (!strcmp(optarg, "centerline"))
                options->what = "centreline";
            if (strcmp(options->what, "surface") && strcmp(options->what, "centreline")) {
                fprintf(stderr, "--what: '%s' is not valid; surface or centreline\n", optarg);
                return EXIT_BAD_INPUT;
            }
            break;
        case FRAME:
            options->frame = optarg;
            if (strcmp(optarg, "RAS") && strcmp(optarg, "LPS")) {
                fprintf(stderr, "--frame: '%s' is not valid; RAS or LPS\n", optarg);
                return EXIT_BAD_INPUT;
            }
            break;
        case CELL:
            if (!cli_number("--cell-mm", optarg, 0.001, 1000, &options->cell_mm))
                return EXIT_BAD_INPUT;
            break;
        case THREADS:
            if (!cli_whole_number("--threads", optarg, 0, 256, &number))
                return EXIT_BAD_INPUT;
            break;
        case OPEN: options->open_inlet = true; break;
        case FLOATING: options->keep_floating = true; break;
        case QUIET: options->quiet = true; break;
        case HELP:
        case 'h': fputs(help, stdout); return EXIT_DONE;
        default: fprintf(stderr, "seldinger export: unknown option or lacking value; see `seldinger export --help`\n"); return EXIT_BAD_INPUT;
        }
    }
    if (optind != argc - 1 || !options->out) {
        fprintf(stderr, "seldinger export: one file and `-o OUT` are needed; see `seldinger export --help`\n");
        return EXIT_BAD_INPUT;
    }
    options->in = argv[optind];
    return -1;
}

int verb_export(int argc, char **argv)
{
    static Faults faults;
    ExportOptions options;
    char extension[16];
    int code = parse_options(argc, argv, &options);
    if (code >= 0)
        return code;
    faults_clear(&faults);
    output_extension(options.out, extension);
    OutputPlan plan = {.faults = &faults};
    output_plan_write(&plan, "-o", options.out);
    output_plan_series(&plan, "-o", ".vtp");
    output_plan_read(&plan, "the file", options.in);
    bool good = faults.count == 0;
    switch (good ? file_kind(options.in) : FILE_UNKNOWN) {
    case FILE_TREE: good = export_tree(&options, extension, &faults); break;
    case FILE_RECORDING: good = export_recording(&options, extension, &faults); break;
    case FILE_MISSING:
        faults_add(&faults, options.in, 0, 0, "cannot be opened; give a tree, model or recording");
        good = false;
        break;
    default:
        if (good)
            faults_add(&faults, options.in, 0, 0, "is no tree, model or recording; those can be exported");
        good = false;
    }
    return good ? EXIT_DONE : cli_bad_input(&faults);
}
