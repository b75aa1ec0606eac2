// Implements reach_report.h.
#include "recon/fit/reach_report.h"

#include "geom/geom.h"
#include "base/base.h"

enum { STOPS_SHOWN = 12, GHOSTS_SHOWN = 6 };

static double percent(const Reach *reach, double length) { return reach->length > 0 ? 100 * length / reach->length : 0; }

static void print_stop(FILE *out, const ModelField *model, const Reach *reach, const ReachStop *stop)
{
    Vec3 p = stop->place;
    fprintf(out, "  node %-6d ", model_field_file_node(model, stop->node));
    if (stop->capped)
        fprintf(out, "capped, %.2f mm to the lumen", -stop->clearance);
    else
        fprintf(out, "narrow, %.2f mm free on the centreline", fmin(stop->clearance, model->tree->radius[stop->node]));
    fprintf(out, "%s, at %.2f, %.2f, %.2f; %.1f mm of centreline behind it (%.1f %%)\n", stop->apart ? ", a link longer than the sum of its radii" : "", p.x,
            p.y, p.z, stop->lost, percent(reach, stop->lost));
}

static void reach_print(FILE *out, const ModelField *model, const Reach *reach)
{
    double tool = reach->options.tool_radius;
    fprintf(out,
            "from the inlet a point reaches %.1f %% of %.0f mm of centreline, a tool of %.2f mm radius %.1f %% on the centreline and, up to %.2g r aside, %.1f "
            "%%\n",
            percent(reach, reach->reached[REACH_POINT]), reach->length, tool, percent(reach, reach->reached[REACH_TOOL]), reach->options.aside,
            percent(reach, reach->reached[REACH_ASIDE]));
    fprintf(out, "junctions      %d: %d capped, %d with less than %.2f mm free", reach->junction_count, reach->capped, reach->narrow, tool);
    if (reach->apart_links > 0)
        fprintf(out, "; %d of the capped and %d of the narrow ones over links longer than the sum of their radii", reach->capped_apart, reach->narrow_apart);
    fprintf(out, "\n");
    if (reach->apart_links > 0)
        fprintf(out, "links apart    %d longer than the sum of their radii, without evidence of a vessel, %d of them open; %.1f mm of centreline behind them\n",
                reach->apart_links, reach->apart_open, reach->apart_length);
    if (reach->sac_nodes > 0)
        fprintf(out, "aneurysm nodes %d of %d are reached by a point\n", reach->sac_nodes_reached, reach->sac_nodes);
    if (reach->stop_count > 0)
        fprintf(out, "blocked        %d places, sorted by the centreline behind them:\n", reach->stop_count);
    for (int k = 0; k < reach->stop_count && k < STOPS_SHOWN; k++)
        print_stop(out, model, reach, &reach->stop[k]);
    if (reach->stop_count > STOPS_SHOWN)
        fprintf(out, "  and %d more (--json lists all)\n", reach->stop_count - STOPS_SHOWN);
}

static void add_place(cJSON *object, Vec3 p) { cJSON_AddItemToObject(object, "place_mm", cJSON_CreateDoubleArray((double[]){p.x, p.y, p.z}, 3)); }

static void add_stops(cJSON *object, const ModelField *model, const Reach *reach)
{
    cJSON *list = cJSON_AddArrayToObject(object, "shut");
    for (int k = 0; k < reach->stop_count; k++) {
        const ReachStop *stop = &reach->stop[k];
        cJSON *item = cJSON_CreateObject();
        cJSON_AddNumberToObject(item, "node", model_field_file_node(model, stop->node));
        cJSON_AddStringToObject(item, "why", stop->capped ? "capped" : "narrow");
        cJSON_AddBoolToObject(item, "apart", stop->apart);
        cJSON_AddNumberToObject(item, "clearance_mm", stop->clearance);
        add_place(item, stop->place);
        cJSON_AddNumberToObject(item, "behind_mm", stop->lost);
        cJSON_AddItemToArray(list, item);
    }
}

static void add_junctions(cJSON *object, const ModelField *model, const Reach *reach)
{
    cJSON *list = cJSON_AddArrayToObject(object, "junctions");
    for (int k = 0; k < reach->junction_count; k++) {
        const ReachJunction *j = &reach->junction[k];
        cJSON *item = cJSON_CreateObject();
        cJSON_AddNumberToObject(item, "parent", model_field_file_node(model, j->parent));
        cJSON_AddNumberToObject(item, "node", model_field_file_node(model, j->node));
        cJSON_AddBoolToObject(item, "capped", j->clearance < 0);
        cJSON_AddBoolToObject(item, "apart", j->apart);
        cJSON_AddNumberToObject(item, "clearance_mm", j->clearance);
        add_place(item, j->place);
        cJSON_AddItemToArray(list, item);
    }
}

// Adds each branch with the length that is reached; the link to its first node counts as part of the branch.
static void add_branches(cJSON *object, const ModelField *model, const Reach *reach)
{
    const VesselTree *tree = model->tree;
    VesselBranches *branches = vessel_branches_create(tree);
    if (!branches)
        heap_is_empty((size_t)tree->node_count * sizeof *branches->node, __FILE__);
    cJSON *list = cJSON_AddArrayToObject(object, "branches");
    for (int b = 0; b < branches->count; b++) {
        const VesselBranch *branch = &branches->branch[b];
        double reached[REACH_MODES] = {0}, length = 0;
        for (int k = 0; k < branch->count; k++) {
            int node = branches->node[branch->first + k], parent = tree->parent[node];
            if (parent < 0 || reach_link_is_apart(tree, node))
                continue;
            double link = vec3_distance(tree->center[node], tree->center[parent]);
            length += link;
            for (int mode = 0; mode < REACH_MODES; mode++)
                reached[mode] += reach->share[node][mode] * link;
        }
        cJSON *item = cJSON_CreateObject();
        cJSON_AddNumberToObject(item, "node", model_field_file_node(model, branches->node[branch->first]));
        cJSON_AddNumberToObject(item, "nodes", branch->count);
        cJSON_AddNumberToObject(item, "length_mm", length);
        cJSON_AddNumberToObject(item, "point_mm", reached[REACH_POINT]);
        cJSON_AddNumberToObject(item, "tool_mm", reached[REACH_TOOL]);
        cJSON_AddNumberToObject(item, "tool_aside_mm", reached[REACH_ASIDE]);
        cJSON_AddItemToArray(list, item);
    }
    vessel_branches_free(branches);
}

static void reach_add_json(cJSON *object, const ModelField *model, const Reach *reach)
{
    cJSON *at = cJSON_AddObjectToObject(object, "reach");
    cJSON_AddNumberToObject(at, "tool_radius_mm", reach->options.tool_radius);
    cJSON_AddNumberToObject(at, "aside_radii", reach->options.aside);
    cJSON_AddNumberToObject(at, "centreline_mm", reach->length);
    cJSON_AddNumberToObject(at, "point_percent", percent(reach, reach->reached[REACH_POINT]));
    cJSON_AddNumberToObject(at, "tool_percent", percent(reach, reach->reached[REACH_TOOL]));
    cJSON_AddNumberToObject(at, "tool_aside_percent", percent(reach, reach->reached[REACH_ASIDE]));
    cJSON_AddNumberToObject(at, "junction_count", reach->junction_count);
    cJSON_AddNumberToObject(at, "capped", reach->capped);
    cJSON_AddNumberToObject(at, "capped_apart", reach->capped_apart);
    cJSON_AddNumberToObject(at, "narrow", reach->narrow);
    cJSON_AddNumberToObject(at, "narrow_apart", reach->narrow_apart);
    cJSON_AddNumberToObject(at, "apart_links", reach->apart_links);
    cJSON_AddNumberToObject(at, "apart_open", reach->apart_open);
    cJSON_AddNumberToObject(at, "behind_apart_mm", reach->apart_length);
    cJSON_AddNumberToObject(at, "aneurysm_nodes", reach->sac_nodes);
    cJSON_AddNumberToObject(at, "aneurysm_nodes_reached", reach->sac_nodes_reached);
    add_stops(at, model, reach);
    add_junctions(at, model, reach);
    add_branches(at, model, reach);
}

static void print_ghosts(FILE *out, const GhostLumens *ghosts)
{
    int dissolve = 0;
    double volume = 0;
    for (int k = 0; k < ghosts->count; k++) {
        dissolve += ghosts->ghost[k].dissolves;
        volume += ghosts->ghost[k].volume;
    }
    if (ghosts->count == 0) {
        fprintf(out, "ghost lumens   none: all lumen is connected to the tree\n");
        return;
    }
    fprintf(out, "ghost lumens   %d not connected, %.3g mm3", ghosts->count, volume);
    if (ghosts->drop_count > 0)
        fprintf(out, "; removing %d blobs that contribute to nothing else would remove %d of them", ghosts->drop_count, dissolve);
    fprintf(out, "\n");
    for (int k = 0; k < ghosts->count && k < GHOSTS_SHOWN; k++) {
        const GhostLumen *g = &ghosts->ghost[k];
        fprintf(out, "  %.3g mm3 at %.2f, %.2f, %.2f (node %d)\n", g->volume, g->place.x, g->place.y, g->place.z, g->node);
    }
    if (ghosts->count > GHOSTS_SHOWN)
        fprintf(out, "  and %d smaller ones\n", ghosts->count - GHOSTS_SHOWN);
}

static void add_ghosts(cJSON *object, const GhostLumens *ghosts)
{
    cJSON *at = cJSON_AddObjectToObject(object, "ghosts"), *list = cJSON_AddArrayToObject(at, "lumens");
    cJSON_AddNumberToObject(at, "count", ghosts->count);
    cJSON_AddNumberToObject(at, "blobs_to_drop", ghosts->drop_count);
    for (int k = 0; k < ghosts->count; k++) {
        const GhostLumen *g = &ghosts->ghost[k];
        cJSON *item = cJSON_CreateObject();
        cJSON_AddNumberToObject(item, "node", g->node);
        cJSON_AddNumberToObject(item, "volume_mm3", g->volume);
        add_place(item, g->place);
        cJSON_AddBoolToObject(item, "dissolves", g->dissolves);
        cJSON_AddItemToArray(list, item);
    }
}

bool reach_report(const ModelField *model, const char *file, double tool_radius, FILE *out, cJSON *json, Faults *faults)
{
    if (!model_field_exists(model))
        return true;
    ReachOptions options = reach_default_options();
    options.tool_radius = tool_radius;
    Reach *reach = reach_create(model, &options);
    // sections along curves leave no lumen beside the tree
    GhostLumens *ghosts = model->swept ? NULL : ghost_lumens_find(model->tree);
    bool good = reach && (ghosts || model->swept);
    if (!good)
        faults_add(faults, file, 0, 0, "not enough memory to flood the model from its inlet");
    if (good && out)
        reach_print(out, model, reach);
    if (good && json)
        reach_add_json(json, model, reach);
    if (good && ghosts && out)
        print_ghosts(out, ghosts);
    if (good && ghosts && json)
        add_ghosts(cJSON_GetObjectItem(json, "reach"), ghosts);
    ghost_lumens_free(ghosts);
    reach_free(reach);
    return good;
}
