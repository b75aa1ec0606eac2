#include "recon/surface/import_figures.h"

static const char *const support_name[IMPORT_SUPPORTS] = {"supported", "doubtful", "refused"};

static void print_junctions(FILE *out, const ImportReport *r)
{
    if (r->junction_count == 0)
        return;
    fprintf(out, "junctions      %d: %d supported by the surface, %d doubtful, %d refused", r->junction_count, r->junctions_with[IMPORT_SUPPORTED],
            r->junctions_with[IMPORT_DOUBTFUL], r->junctions_with[IMPORT_REFUSED]);
    if (r->junctions_moved)
        fprintf(out, "; %d attached to another node", r->junctions_moved);
    if (r->refused_nodes)
        fprintf(out, "; %d nodes removed", r->refused_nodes);
    fprintf(out, "; %d nodes on their links\n", r->link_nodes);
    for (int i = 0; i < r->named_count; i++) {
        const ImportJunction *j = &r->named[i];
        fprintf(out, "  %-9s junction at (%.2f, %.2f, %.2f) mm, link %.2f mm", support_name[j->support], j->place.x, j->place.y, j->place.z, j->length);
        if (j->support == IMPORT_REFUSED)
            fprintf(out, ", leaves the lumen\n");
        else
            fprintf(out, ", narrowest place %.0f %% of the branch's radius\n", 100 * j->share);
    }
    if (r->junction_count - r->junctions_with[IMPORT_SUPPORTED] > r->named_count)
        fprintf(out, "  and %d more\n", r->junction_count - r->junctions_with[IMPORT_SUPPORTED] - r->named_count);
}

// Prints how the centrelines that were read were changed.
static void print_curves(FILE *out, const ImportFigures *f)
{
    const ImportReport *r = &f->report;
    if (!f->computed && r->curves_flipped)
        fprintf(out, "centrelines: lie inside the surface only with x and y negated (LPS for RAS): negated\n");
    if (!f->computed && r->curves_scaled != 1)
        fprintf(out, "centrelines: lie inside the surface only when scaled by %g: scaled\n", r->curves_scaled);
    if (!f->computed && r->inside_percent < 99.5)
        fprintf(out, "centrelines: %.0f %% of their points lie inside the surface\n", r->inside_percent);
    if (!f->computed && r->moved_samples)
        fprintf(out, "centrelines: %.1f %% of their points graze the wall or lie beside the lumen: moved to its middle\n",
                100.0 * r->moved_samples / r->samples);
    if (!f->computed && r->cut_samples)
        fprintf(out, "centrelines: %.1f %% of their points lie beyond a vessel's end or in no vessel: cut off\n", 100.0 * r->cut_samples / r->samples);
    if (r->root_is_cut)
        fprintf(out, "root: the surface is closed there: opened by a cut perpendicular to the vessel, %.2f mm before the end\n", r->root_cut);
    if (r->lost_curves)
        fprintf(out, "centrelines: %d touch no other and were omitted, first at (%.4g, %.4g, %.4g)\n", r->lost_curves, r->lost.x, r->lost.y, r->lost.z);
    if (r->loop_count)
        fprintf(out, "centrelines: %d loops cut, first at (%.4g, %.4g, %.4g); a tool cannot pass there\n", r->loop_count, r->loop.x, r->loop.y, r->loop.z);
}

void import_figures_print(FILE *out, const char *surface, const ImportFigures *f)
{
    const ImportReport *r = &f->report;
    if (r->unused_components)
        fprintf(out, "%s: %d components have no centreline: omitted\n", surface, r->unused_components);
    print_curves(out, f);
    fprintf(out, "surface        %d triangles, %.4g mm^2, lumen %.4g mm^3; %d lids removed\n", f->check.triangle_count, f->check.area, f->check.volume,
            r->lid_count);
    fprintf(out, "centrelines    %d curves %s, %d branches, %.1f mm, radius %.3g to %.3g mm\n", f->curve_count, f->computed ? "computed" : "read",
            r->branch_count, r->length, r->radius_min, r->radius_max);
    fprintf(out, "ends           %d, %d of them open\n", r->end_count, r->open_end_count);
    fprintf(out, "root           (%.5g, %.5g, %.5g) mm, radius %.3g mm, %s\n", r->root.x, r->root.y, r->root.z, r->root_radius,
            r->root_is_open ? "open" : "closed: no tool can enter there; --root X,Y,Z opens an end");
    if (r->closed_radius > 0)
        fprintf(out,
                "               tools enter there because it is the widest open end; the closed end at (%.5g, %.5g, %.5g) mm is wider, radius %.3g mm: "
                "--root %.5g,%.5g,%.5g opens it and makes it the root\n",
                r->closed.x, r->closed.y, r->closed.z, r->closed_radius, r->closed.x, r->closed.y, r->closed.z);
    print_junctions(out, r);
    fprintf(out, "nodes          %d, %ld points; %ld of them visible from no node; removed: %ld that belong to no node, %ld in a tool's path\n", f->nodes,
            f->points, r->unseen_points, r->left_points, r->inner_points);
    fprintf(out, "seconds        %.2f\n", f->seconds);
}

static void json_vector(cJSON *root, const char *name, Vec3 v)
{
    double number[3] = {v.x, v.y, v.z};
    cJSON_AddItemToObject(root, name, cJSON_CreateDoubleArray(number, 3));
}

static void add_junctions(cJSON *root, const ImportReport *r)
{
    cJSON *summary = cJSON_AddObjectToObject(root, "junctions"), *list = cJSON_AddArrayToObject(summary, "list");
    cJSON_AddNumberToObject(summary, "count", r->junction_count);
    for (int k = 0; k < IMPORT_SUPPORTS; k++)
        cJSON_AddNumberToObject(summary, support_name[k], r->junctions_with[k]);
    cJSON_AddNumberToObject(summary, "moved", r->junctions_moved);
    cJSON_AddNumberToObject(summary, "nodes", r->link_nodes);
    cJSON_AddNumberToObject(summary, "dropped_nodes", r->refused_nodes);
    for (int i = 0; i < r->named_count; i++) {
        const ImportJunction *j = &r->named[i];
        cJSON *entry = cJSON_CreateObject();
        cJSON_AddStringToObject(entry, "support", support_name[j->support]);
        json_vector(entry, "place_mm", j->place);
        cJSON_AddNumberToObject(entry, "length_mm", j->length);
        cJSON_AddNumberToObject(entry, "narrowest_share", j->share);
        cJSON_AddItemToArray(list, entry);
    }
}

void import_figures_add(cJSON *root, const ImportFigures *f)
{
    const MeshCheck *c = &f->check;
    const ImportReport *r = &f->report;
    cJSON *mesh = cJSON_AddObjectToObject(root, "surface");
    const struct {
        const char *name;
        double value;
    } surface[] = {{"vertices", c->vertex_count},
                   {"triangles", c->triangle_count},
                   {"area_mm2", c->area},
                   {"volume_mm3", c->volume},
                   {"components", c->component_count},
                   {"openings", c->opening_count},
                   {"inside_out_components", c->inside_out_count},
                   {"duplicate_vertices", c->duplicate_vertices.count},
                   {"unreferenced_vertices", c->unreferenced_vertices.count},
                   {"degenerate_triangles", c->degenerate_triangles.count},
                   {"duplicate_triangles", c->duplicate_triangles.count},
                   {"flipped_triangles", c->flipped_triangles.count},
                   {"open_edges", c->open_edges.count},
                   {"nonmanifold_edges", c->nonmanifold_edges.count},
                   {"one_sided_edges", c->one_sided_edges.count}};
    const struct {
        const char *name;
        double value;
    } tree[] = {{"curves", f->curve_count},
                {"nodes", f->nodes},
                {"points", (double)f->points},
                {"branches", r->branch_count},
                {"ends", r->end_count},
                {"open_ends", r->open_end_count},
                {"lids", r->lid_count},
                {"loops_cut", r->loop_count},
                {"curves_lost", r->lost_curves},
                {"components_unused", r->unused_components},
                {"unseen_points", (double)r->unseen_points},
                {"left_points", (double)r->left_points},
                {"inner_points", (double)r->inner_points},
                {"dropped_nodes", r->dropped_nodes},
                {"length_mm", r->length},
                {"radius_min_mm", r->radius_min},
                {"radius_max_mm", r->radius_max},
                {"inside_percent", r->inside_percent},
                {"moved_percent", r->samples ? 100.0 * r->moved_samples / r->samples : 0},
                {"cut_percent", r->samples ? 100.0 * r->cut_samples / r->samples : 0},
                {"root_cut_mm", r->root_cut},
                {"root_radius_mm", r->root_radius},
                {"wider_closed_end_radius_mm", r->closed_radius},
                {"curves_scaled", r->curves_scaled},
                {"seconds", f->seconds}};
    for (size_t i = 0; i < sizeof surface / sizeof surface[0]; i++)
        cJSON_AddNumberToObject(mesh, surface[i].name, surface[i].value);
    for (size_t i = 0; i < sizeof tree / sizeof tree[0]; i++)
        cJSON_AddNumberToObject(root, tree[i].name, tree[i].value);
    cJSON_AddBoolToObject(root, "curves_computed", f->computed);
    cJSON_AddBoolToObject(root, "curves_flipped", r->curves_flipped);
    cJSON_AddBoolToObject(root, "root_is_open", r->root_is_open);
    json_vector(root, "root_mm", r->root);
    add_junctions(root, r);
}
