#include "recon/surface/model_surface.h"

#include "geom/geom.h"

#include <inttypes.h>
#include <stdlib.h>

static void print_census(FILE *out, const SurfaceCensus *c, double cell_mm, int bubbles)
{
    fprintf(out, "surface        %d vertices, %d triangles, cells of %.3g mm\n", c->vertices, c->triangles, cell_mm);
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
static bool drop_parts(const ModelSurfaceOptions *options, const char *name, double cell, const VesselTree *tree, TriangleMesh *mesh, int *bubbles)
{
    ReachOptions flood = reach_default_options();
    Reach *reach = reach_create(tree, &flood);
    SurfaceParts *parts = reach ? surface_parts_create(mesh, tree, reach) : NULL;
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

bool model_surface(const VesselTree *tree, const char *name, const ModelSurfaceOptions *options, SurfaceFigures *surface, Faults *faults)
{
    *surface = (SurfaceFigures){0};
    double cell = options->cell_mm > 0 ? options->cell_mm : isosurface_cell_for(tree);
    TriangleMesh *mesh = surface->mesh = isosurface_of_tree(tree, cell);
    if (!mesh || mesh->triangle_count < 1) {
        faults_add(faults, name, 0, 0, "cannot make a surface: %s",
                   mesh ? "the model is empty at this --cell-mm" : "not enough memory; try a larger --cell-mm");
        return false;
    }
    SurfaceCensus census;
    int bubbles;
    bool good = drop_parts(options, name, cell, tree, mesh, &bubbles);
    if (options->open_inlet && !surface_open_inlet(mesh, tree)) {
        faults_add(faults, name, 0, 0, "has no inlet to open: the tree continues upstream of its root, or the root's points close it; omit --open-inlet");
        return false;
    }
    good = good && surface_census(mesh, &census);
    if (good && options->with_error && tree->point_count > 0) {
        surface->error = malloc(((size_t)mesh->vertex_count + 1) * sizeof *surface->error);
        surface->distance = malloc(((size_t)mesh->vertex_count + 1) * sizeof *surface->distance);
        good = surface->error && surface->distance && surface_point_error(mesh, tree, surface->error, surface->distance);
    }
    if (!good)
        faults_add(faults, name, 0, 0, "cannot make a surface: not enough memory; try a larger --cell-mm");
    else if (options->figures)
        print_census(options->figures, &census, cell, bubbles);
    return good;
}

void model_surface_free(SurfaceFigures *surface)
{
    triangle_mesh_free(surface->mesh);
    free(surface->error);
    free(surface->distance);
}
