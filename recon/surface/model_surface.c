#include "recon/surface/model_surface.h"

#include "geom/geom.h"

#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

static void print_census(FILE *out, const SurfaceCensus *c, double cell_mm, int bubbles)
{
    fprintf(out, "surface        %d vertices, %d triangles", c->vertices, c->triangles);
    if (cell_mm > 0)
        fprintf(out, ", cells of %.3g mm\n", cell_mm);
    else
        fprintf(out, ", edges of about a quarter of the local radius\n");
    fprintf(out, "parts          %d, Euler characteristic %" PRId64 "%s\n", c->parts, c->euler,
            bubbles ? "; bubbles inside the lumen and specks beside it were removed" : "");
    fprintf(out, "edges          %" PRId64 " open, %" PRId64 " non-manifold, %" PRId64 " between inconsistently oriented triangles\n", c->open_edges,
            c->non_manifold_edges, c->turned_edges);
    fprintf(out, "area, volume   %.6g mm2, %.6g mm3\n", c->area, c->volume);
}

// Prints the number and the positions of the parts that cannot be reached from the inlet.
static void print_dropped(FILE *out, const char *file, const SurfaceParts *parts)
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
    fprintf(out,
            "%s: %d part%s of the surface removed, %.3g mm3: %d with nodes of the tree that are not connected to the inlet, %d that contain%s none "
            "(--keep-floating "
            "keeps them)\n",
            file, count[PART_SHUT] + count[PART_GHOST], count[PART_SHUT] + count[PART_GHOST] == 1 ? "" : "s", volume, count[PART_SHUT], count[PART_GHOST],
            count[PART_GHOST] == 1 ? "s" : "");
    for (int p = 0; p < parts->count && shown < SHOWN; p++) {
        const SurfacePart *part = &parts->part[p];
        if (part->kind != PART_SHUT && part->kind != PART_GHOST)
            continue;
        shown++;
        fprintf(out, "    %.3g mm3 with %d nodes at %.2f, %.2f, %.2f (node %d)\n", part->volume, part->nodes, part->place.x, part->place.y, part->place.z,
                part->node);
    }
    if (count[PART_SHUT] + count[PART_GHOST] > shown)
        fprintf(out, "    and %d smaller ones\n", count[PART_SHUT] + count[PART_GHOST] - shown);
}

// Removes bubbles in the lumen and, unless keep_floating, parts that are not connected to the inlet. Returns false if out of memory.
static bool drop_parts(const ModelSurfaceOptions *options, const char *name, double cell, const ModelField *model, TriangleMesh *mesh, int *bubbles)
{
    ReachOptions flood = reach_default_options();
    Reach *reach = reach_create(model, &flood);
    SurfaceParts *parts = reach ? surface_parts_create(mesh, model->tree, reach) : NULL;
    bool kinds[PART_KINDS] = {[PART_INLET] = true, [PART_SHUT] = options->keep_floating, [PART_GHOST] = options->keep_floating};
    // specks of a few cells beside the lumen are artefacts of the grid, not wall
    for (int p = 1; parts && p < parts->count; p++)
        if (parts->part[p].kind == PART_INLET && parts->part[p].volume < 64 * cell * cell * cell)
            parts->part[p].kind = PART_BUBBLE;
    bool good = parts && surface_parts_keep(mesh, parts, kinds);
    *bubbles = 0;
    for (int p = 0; good && p < parts->count; p++)
        *bubbles += parts->part[p].kind == PART_BUBBLE;
    if (good && !options->keep_floating && options->warnings)
        print_dropped(options->warnings, name, parts);
    surface_parts_free(parts);
    reach_free(reach);
    return good;
}

static bool add_error(const ModelField *model, const TriangleMesh *mesh, SurfaceFigures *surface)
{
    size_t count = (size_t)mesh->vertex_count + 1;
    surface->error = HEAP_ZEROED(count, sizeof *surface->error), surface->distance = HEAP_ZEROED(count, sizeof *surface->distance);
    return surface_point_error(mesh, model, surface->error, surface->distance);
}

// --- Swept models ---

// Returns whether memory sufficed.
static bool sweep_surface(const ModelField *model, const char *name, const ModelSurfaceOptions *options, SurfaceFigures *surface)
{
    SweepMeshOptions wanted = sweep_mesh_default_options();
    wanted.edge_mm = options->cell_mm, wanted.flat_ends = options->tags;
    SweepMesh *mesh = sweep_mesh_create(model->field, &wanted);
    bool good = mesh != NULL;
    if (good && options->with_error && model->tree->point_count > 0) {
        model_mesh_take_nodes(model, mesh);
        good = add_error(model, mesh->surface, surface);
        for (int v = 0; v < mesh->surface->vertex_count; v++)
            mesh->surface->node[v] = model_field_file_node(model, mesh->surface->node[v]);
    }
    if (good && options->open_inlet) {
        TriangleMesh *all = mesh->surface;
        int inlet = sweep_mesh_cap(mesh, 0, 0);
        bool *keep = HEAP_ZEROED((size_t)all->triangle_count + 1, sizeof *keep);
        for (int t = 0; t < all->triangle_count; t++)
            for (int k = 0; k < 3; k++)
                keep[t] |= inlet == 0 || mesh->boundary[all->triangle[t][k]] != inlet;
        int kept = 0;
        for (int t = 0; t < all->triangle_count; t++)
            if (keep[t])
                memmove(all->triangle[kept++], all->triangle[t], sizeof *all->triangle);
        all->triangle_count = kept;
        free(keep);
    }
    if (good && mesh->failures > 0 && options->warnings)
        fprintf(options->warnings, "%s: at %d place%s the branches could not be joined to one surface; there they cross each other\n", name, mesh->failures,
                mesh->failures == 1 ? "" : "s");
    if (good) {
        surface->mesh = mesh->surface, mesh->surface = NULL;
        if (options->tags) {
            surface->branch = mesh->branch, surface->along = mesh->along, surface->boundary = mesh->boundary;
            surface->flow = HEAP_ZEROED((size_t)surface->mesh->vertex_count + 1, sizeof *surface->flow);
            for (int v = 0; v < surface->mesh->vertex_count; v++)
                surface->flow[v] = mesh->boundary[v] > 0 ? (int)mesh->cap[mesh->boundary[v]].flow : 0;
            mesh->branch = mesh->boundary = NULL, mesh->along = NULL;
        }
    }
    sweep_mesh_free(mesh);
    return good;
}

// --- Blobs ---

static bool tag_blobs(const VesselTree *tree, SurfaceFigures *surface)
{
    VesselBranches *branches = vessel_branches_create(tree);
    if (!branches)
        return false;
    double *along = HEAP_ZEROED((size_t)tree->node_count, sizeof *along);
    for (int b = 0; b < branches->count; b++)
        for (int i = branches->branch[b].first; i < branches->branch[b].first + branches->branch[b].count; i++)
            along[branches->node[i]] = branches->along[i];
    size_t count = (size_t)surface->mesh->vertex_count + 1;
    surface->branch = HEAP_ZEROED(count, sizeof *surface->branch), surface->boundary = HEAP_ZEROED(count, sizeof *surface->boundary);
    surface->flow = HEAP_ZEROED(count, sizeof *surface->flow);
    surface->along = HEAP_ZEROED(count, sizeof *surface->along);
    for (int v = 0; v < surface->mesh->vertex_count; v++)
        surface->branch[v] = branches->of_node[surface->mesh->node[v]], surface->along[v] = along[surface->mesh->node[v]];
    free(along);
    vessel_branches_free(branches);
    return true;
}

static bool blob_surface(const ModelField *model, const char *name, double cell, const ModelSurfaceOptions *options, SurfaceFigures *surface, int *bubbles,
                         Faults *faults)
{
    const VesselTree *tree = model->tree;
    TriangleMesh *mesh = surface->mesh = isosurface_of_tree(tree, cell);
    if (!mesh || mesh->triangle_count < 1) {
        faults_add(faults, name, 0, 0, "cannot make a surface: %s",
                   mesh ? "the model is empty at this --cell-mm" : "not enough memory; try a larger --cell-mm");
        return false;
    }
    bool good = drop_parts(options, name, cell, model, mesh, bubbles);
    if (options->open_inlet && !surface_open_inlet(mesh, tree)) {
        faults_add(faults, name, 0, 0, "has no inlet to open: the tree continues upstream of its root, or the root's points close it; omit --open-inlet");
        return false;
    }
    if (good && options->with_error && tree->point_count > 0)
        good = add_error(model, mesh, surface);
    return good && (!options->tags || tag_blobs(tree, surface));
}

bool model_surface(const ModelField *model, const char *name, const ModelSurfaceOptions *options, SurfaceFigures *surface, Faults *faults)
{
    *surface = (SurfaceFigures){0};
    double cell = options->cell_mm > 0 || model->swept ? options->cell_mm : isosurface_cell_for(model->tree);
    int bubbles = 0, before = faults->count;
    SurfaceCensus census;
    bool good = model->swept ? sweep_surface(model, name, options, surface) : blob_surface(model, name, cell, options, surface, &bubbles, faults);
    good = good && surface_census(surface->mesh, &census);
    if (!good && faults->count == before)
        faults_add(faults, name, 0, 0, "cannot make a surface: not enough memory; try a larger --cell-mm");
    else if (good && options->figures)
        print_census(options->figures, &census, cell, bubbles);
    return good;
}

void model_surface_free(SurfaceFigures *surface)
{
    triangle_mesh_free(surface->mesh);
    free(surface->error);
    free(surface->distance);
    free(surface->branch);
    free(surface->boundary);
    free(surface->flow);
    free(surface->along);
}
