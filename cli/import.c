// seldinger import: a surface, with centrelines or alone, to the tree of nodes and local points that `fit` takes (recon/surface/import_surface.h).
#include "cli/cli.h"

#include "base/heap.h"
#include "base/output.h"
#include "cli/output_plan.h"
#include "recon/surface/centreline_file.h"
#include "recon/surface/import_surface.h"
#include "recon/surface/mesh_centreline.h"
#include "recon/tree_file.h"

#include <cjson/cJSON.h>
#include <getopt.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { FILES_MAX = 1024, TEXT_MAX = 4096, UNSEEN_MAX_PERCENT = 10 };

typedef struct ImportCommand {
    const char *surface, *output, *json, *centreline_out;
    const char *centreline[FILES_MAX];
    int centreline_count;
    ImportOptions options;
    double scale;
    bool has_scale, quiet;
} ImportCommand;

static const char help[] =
    "Usage: seldinger import --surface F [--centerline F...] -o TREE.h5 [options]\n\n"
    "A vessel's surface and its centrelines become the tree that `seldinger fit` takes. Without centrelines they are computed; a result\n"
    "that leaves out more than 10 % of the surface is refused. Narrow branches that no centreline runs into are left out.\n"
    "Surface: STL, PLY, OBJ or VTK PolyData (.vtp), open or closed; flat lids over the ends of a closed one are taken off.\n"
    "Centrelines: VTK PolyData (.vtp), 3D Slicer Markups (.mrk.json), SWC; several files and overlapping curves make one tree.\n"
    "What is wrong with the surface is named and mended.\n"
    "A branch whose link to its parent has no path inside the surface hangs on another vessel in plain sight, or is left out; the summary names it.\n\n"
    "  --surface F          the surface (needed)\n"
    "  --centerline F...    centrelines; may be given again\n"
    "  -o, --output F.h5    the tree (needed)\n"
    "  --root X,Y,Z         the vessel's end nearest to this point [mm] is the root, cut open where the surface is closed there; default: the\n"
    "                       widest open end, else the widest, which then stays closed\n"
    "  --scale S            of the surface to mm, 1000 where it is in metres; default 1\n"
    "  --spacing X          distance of nodes in local radii; default 0.5\n"
    "  --points N           points of a node, about; default 108\n"
    "  --centerline-out F   the centrelines that were used, .vtp, .mrk.json or .swc\n"
    "  --threads N          default 0: all cores; the tree does not depend on it\n"
    "  --json F             figures as JSON; - is standard output\n"
    "  --quiet              no summary\n\n"
    "Exit codes: 0 done; 2 wrong usage or bad input.\n";

static int usage_fault(const char *message, const char *what)
{
    fprintf(stderr, "seldinger import: %s%s; see `seldinger import --help`\n", message, what);
    return EXIT_BAD_INPUT;
}

static bool add_centreline(ImportCommand *command, const char *path)
{
    if (command->centreline_count == FILES_MAX)
        return false;
    command->centreline[command->centreline_count++] = path;
    return true;
}

// -1: go on; otherwise the exit code.
static int parse_options(int argc, char **argv, ImportCommand *command)
{
    enum { SURFACE = 256, CENTRELINE, ROOT, SCALE, SPACING, POINTS, CENTRELINE_OUT, THREADS, JSON, QUIET };
    static const struct option table[] = {{"surface", required_argument, NULL, SURFACE},
                                          {"centerline", required_argument, NULL, CENTRELINE},
                                          {"centreline", required_argument, NULL, CENTRELINE},
                                          {"output", required_argument, NULL, 'o'},
                                          {"root", required_argument, NULL, ROOT},
                                          {"scale", required_argument, NULL, SCALE},
                                          {"spacing", required_argument, NULL, SPACING},
                                          {"points", required_argument, NULL, POINTS},
                                          {"centerline-out", required_argument, NULL, CENTRELINE_OUT},
                                          {"threads", required_argument, NULL, THREADS},
                                          {"json", required_argument, NULL, JSON},
                                          {"quiet", no_argument, NULL, QUIET},
                                          {"help", no_argument, NULL, 'h'},
                                          {0}};
    *command = (ImportCommand){.options = import_default_options(), .scale = 1};
    double number;
    optind = 1;
    for (int choice; (choice = getopt_long(argc, argv, "o:h", table, NULL)) != -1;) {
        bool good = true;
        switch (choice) {
        case SURFACE: command->surface = optarg; break;
        case 'o': command->output = optarg; break;
        case JSON: command->json = optarg; break;
        case CENTRELINE_OUT: command->centreline_out = optarg; break;
        case QUIET: command->quiet = true; break;
        case CENTRELINE:
            good = add_centreline(command, optarg);
            while (good && optind < argc && argv[optind][0] != '-')
                good = add_centreline(command, argv[optind++]);
            if (!good)
                return usage_fault("takes 1024 files of centrelines at most", "");
            break;
        case ROOT: good = command->options.has_root = cli_point("--root", optarg, &command->options.root); break;
        case SCALE:
            good = cli_number("--scale", optarg, 1e-9, 1e9, &command->scale);
            command->has_scale = true;
            break;
        case SPACING: good = cli_number("--spacing", optarg, 0.05, 4, &command->options.spacing); break;
        case POINTS: good = cli_whole_number("--points", optarg, 20, 2000, &command->options.points_per_node); break;
        case THREADS:
            good = cli_whole_number("--threads", optarg, 0, 256, &number);
            command->options.threads = good ? (int)number : 0;
            break;
        case 'h': fputs(help, stdout); return EXIT_DONE;
        default: return usage_fault("unknown option or lacking value", "");
        }
        if (!good)
            return EXIT_BAD_INPUT;
    }
    if (optind != argc)
        return usage_fault("what is this argument for: ", argv[optind]);
    if (!command->surface || !command->output)
        return usage_fault(command->surface ? "lacks -o TREE.h5" : "lacks --surface F", "");
    return -1;
}

// --- what was found ---

typedef struct Found {
    MeshCheck check;
    ImportReport report;
    bool computed;
    int curve_count, nodes;
    long points;
    double seconds;
} Found;

static const char *const support_name[IMPORT_SUPPORTS] = {"supported", "doubtful", "refused"};

static void print_junctions(const ImportReport *r)
{
    if (r->junction_count == 0)
        return;
    printf("junctions      %d: %d supported by the surface, %d doubtful, %d refused", r->junction_count, r->junctions_with[IMPORT_SUPPORTED],
           r->junctions_with[IMPORT_DOUBTFUL], r->junctions_with[IMPORT_REFUSED]);
    if (r->junctions_moved)
        printf("; %d hung on another node", r->junctions_moved);
    if (r->refused_nodes)
        printf("; %d nodes left out", r->refused_nodes);
    printf("; %d nodes on their links\n", r->link_nodes);
    for (int i = 0; i < r->named_count; i++) {
        const ImportJunction *j = &r->named[i];
        printf("  %-9s junction at (%.2f, %.2f, %.2f) mm, link %.2f mm", support_name[j->support], j->place.x, j->place.y, j->place.z, j->length);
        if (j->support == IMPORT_REFUSED)
            printf(", leaves the lumen\n");
        else
            printf(", narrowest place %.0f %% of the branch's radius\n", 100 * j->share);
    }
    if (r->junction_count - r->junctions_with[IMPORT_SUPPORTED] > r->named_count)
        printf("  and %d more\n", r->junction_count - r->junctions_with[IMPORT_SUPPORTED] - r->named_count);
}

static void print_found(const ImportCommand *command, const Found *f)
{
    char text[TEXT_MAX];
    const ImportReport *r = &f->report;
    mesh_check_text(&f->check, true, text, sizeof text);
    cli_notes(stdout, command->surface, text);
    if (r->unused_components)
        printf("%s: %d components have no centreline: left out\n", command->surface, r->unused_components);
    if (!f->computed && r->curves_flipped)
        printf("centrelines: lie inside the surface only with x and y negated (LPS for RAS): negated\n");
    if (!f->computed && r->curves_scaled != 1)
        printf("centrelines: lie inside the surface only when scaled by %g: scaled\n", r->curves_scaled);
    if (!f->computed && r->inside_percent < 99.5)
        printf("centrelines: %.0f %% of their points lie inside the surface\n", r->inside_percent);
    if (!f->computed && r->moved_samples)
        printf("centrelines: %.1f %% of their points graze the wall or lie beside the lumen: moved to its middle\n", 100.0 * r->moved_samples / r->samples);
    if (!f->computed && r->cut_samples)
        printf("centrelines: %.1f %% of their points lie over a vessel's end or in no vessel: cut off\n", 100.0 * r->cut_samples / r->samples);
    if (r->root_is_cut)
        printf("root: the surface is closed there: opened by a cut square to the vessel, %.2f mm before the end\n", r->root_cut);
    if (r->lost_curves)
        printf("centrelines: %d touch no other and were left out, first at (%.4g, %.4g, %.4g)\n", r->lost_curves, r->lost.x, r->lost.y, r->lost.z);
    if (r->loop_count)
        printf("centrelines: %d loops cut, first at (%.4g, %.4g, %.4g); a tool cannot pass there\n", r->loop_count, r->loop.x, r->loop.y, r->loop.z);
    printf("surface        %d triangles, %.4g mm^2, lumen %.4g mm^3; %d lids taken off\n", f->check.triangle_count, f->check.area, f->check.volume, r->lid_count);
    printf("centrelines    %d curves %s, %d branches, %.1f mm, radius %.3g to %.3g mm\n", f->curve_count, f->computed ? "computed" : "read", r->branch_count,
           r->length, r->radius_min, r->radius_max);
    printf("ends           %d, %d of them open\n", r->end_count, r->open_end_count);
    printf("root           (%.5g, %.5g, %.5g) mm, %s\n", r->root.x, r->root.y, r->root.z, r->root_is_open ? "open" : "closed: no tool can enter there; --root X,Y,Z opens an end");
    print_junctions(r);
    printf("nodes          %d, %ld points; %ld of them out of every node's sight; %ld more belong to no node, %ld lie where a tool passes\n", f->nodes, f->points,
           r->unseen_points, r->left_points, r->inner_points);
    printf("seconds        %.2f\n", f->seconds);
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

static bool write_json(const ImportCommand *command, const Found *f, Faults *faults)
{
    const MeshCheck *c = &f->check;
    const ImportReport *r = &f->report;
    cJSON *root = cJSON_CreateObject(), *mesh = cJSON_AddObjectToObject(root, "surface");
    const struct { const char *name; double value; } surface[] = {
        {"vertices", c->vertex_count}, {"triangles", c->triangle_count}, {"area_mm2", c->area}, {"volume_mm3", c->volume}, {"components", c->component_count},
        {"openings", c->opening_count}, {"inside_out_components", c->inside_out_count}, {"duplicate_vertices", c->duplicate_vertices.count},
        {"unreferenced_vertices", c->unreferenced_vertices.count}, {"degenerate_triangles", c->degenerate_triangles.count},
        {"duplicate_triangles", c->duplicate_triangles.count}, {"flipped_triangles", c->flipped_triangles.count}, {"open_edges", c->open_edges.count},
        {"nonmanifold_edges", c->nonmanifold_edges.count}, {"one_sided_edges", c->one_sided_edges.count}};
    const struct { const char *name; double value; } tree[] = {
        {"curves", f->curve_count}, {"nodes", f->nodes}, {"points", (double)f->points}, {"branches", r->branch_count}, {"ends", r->end_count},
        {"open_ends", r->open_end_count}, {"lids", r->lid_count}, {"loops_cut", r->loop_count}, {"curves_lost", r->lost_curves},
        {"components_unused", r->unused_components}, {"unseen_points", (double)r->unseen_points}, {"left_points", (double)r->left_points}, {"inner_points", (double)r->inner_points}, {"dropped_nodes", r->dropped_nodes},
        {"length_mm", r->length}, {"radius_min_mm", r->radius_min}, {"radius_max_mm", r->radius_max}, {"inside_percent", r->inside_percent},
        {"moved_percent", r->samples ? 100.0 * r->moved_samples / r->samples : 0},
        {"cut_percent", r->samples ? 100.0 * r->cut_samples / r->samples : 0}, {"root_cut_mm", r->root_cut}, {"curves_scaled", r->curves_scaled}, {"seconds", f->seconds}};
    for (size_t i = 0; i < sizeof surface / sizeof surface[0]; i++)
        cJSON_AddNumberToObject(mesh, surface[i].name, surface[i].value);
    for (size_t i = 0; i < sizeof tree / sizeof tree[0]; i++)
        cJSON_AddNumberToObject(root, tree[i].name, tree[i].value);
    cJSON_AddBoolToObject(root, "curves_computed", f->computed);
    cJSON_AddBoolToObject(root, "curves_flipped", r->curves_flipped);
    cJSON_AddBoolToObject(root, "root_is_open", r->root_is_open);
    json_vector(root, "root_mm", r->root);
    add_junctions(root, r);
    char *text = cJSON_Print(root);
    bool good = text && output_write(command->json, text, strlen(text), faults);
    cJSON_free(text);
    cJSON_Delete(root);
    return good;
}

// --- doing ---

static CurveSet *get_curves(const ImportCommand *command, const SurfaceMesh *mesh, ImportReport *report, Faults *faults)
{
    if (command->centreline_count == 0)
        return mesh_centreline(mesh, &command->options, report, command->surface, faults);
    CurveSet *set = curve_set_create();
    bool good = set != NULL;
    for (int i = 0; set && i < command->centreline_count; i++)
        good = centreline_load(command->centreline[i], set, faults) && good;
    if (!set)
        faults_add(faults, command->surface, 0, 0, "not enough memory");
    if (good && import_place_curves(mesh, command->scale, set, report, command->centreline[0], faults))
        return set;
    curve_set_free(set);
    return NULL;
}

static bool write_curves(const ImportCommand *command, const CurveSet *set, Faults *faults)
{
    size_t length;
    char *text = centreline_text(set, command->centreline_out, &length, faults);
    bool good = text && output_write(command->centreline_out, text, length, faults);
    free(text);
    return good;
}

static bool save(const ImportCommand *command, const VesselTree *tree, Faults *faults)
{
    char parameters[512], created_by[] = "seldinger " SELDINGER_VERSION " import", source[] = "surface";
    snprintf(parameters, sizeof parameters, "surface: %.200s\ncentrelines: %d\nscale: %g\nspacing: %g\npoints_per_node: %g\n", command->surface,
             command->centreline_count, command->scale, command->options.spacing, command->options.points_per_node);
    TreeFileInfo info = {.source = source, .parameters = parameters, .created_by = created_by};
    return tree_file_save(tree, &info, command->output, faults);
}

static bool import(const ImportCommand *command, Faults *faults)
{
    Found found = {.computed = command->centreline_count == 0, .report = {.curves_scaled = 1, .inside_percent = 100}};
    struct timespec start, end;
    clock_gettime(CLOCK_MONOTONIC, &start);
    SurfaceMesh *mesh = mesh_load_mended(command->surface, command->has_scale ? command->scale : 0, "--scale ", &found.check, faults);
    CurveSet *set = mesh ? get_curves(command, mesh, &found.report, faults) : NULL;
    VesselTree *tree = set ? import_surface(mesh, set, &command->options, &found.report, command->surface, faults) : NULL;
    double unseen = 100.0 * (double)found.report.left_points / (double)(found.report.sampled_points + 1);
    if (tree && found.computed && unseen > UNSEEN_MAX_PERCENT)
        faults_add(faults, command->surface, 0, 0, "the computed centrelines leave %.0f %% of the surface out, more than %d %%: no tree is written; give --centerline F", unseen,
                   UNSEEN_MAX_PERCENT);
    bool good = tree && faults->count == 0 && save(command, tree, faults) && (!command->centreline_out || write_curves(command, set, faults));
    clock_gettime(CLOCK_MONOTONIC, &end);
    if (good) {
        found.seconds = (double)(end.tv_sec - start.tv_sec) + 1e-9 * (double)(end.tv_nsec - start.tv_nsec);
        found.curve_count = set->curve_count;
        found.nodes = tree->node_count;
        found.points = (long)tree->point_count;
        good = !command->json || write_json(command, &found, faults);
        if (good && !command->quiet && !(command->json && !strcmp(command->json, "-")))
            print_found(command, &found);
    }
    vessel_tree_free(tree);
    curve_set_free(set);
    surface_free(mesh);
    return good;
}

int verb_import(int argc, char **argv)
{
    ImportCommand *command = HEAP_ZEROED(1, sizeof *command);
    Faults *faults = HEAP_ZEROED(1, sizeof *faults);
    int code = parse_options(argc, argv, command);
    if (code < 0) {
        OutputPlan plan = {.faults = faults};
        output_plan_write_file(&plan, "-o", command->output);
        output_plan_write(&plan, "--json", command->json);
        output_plan_write(&plan, "--centerline-out", command->centreline_out);
        output_plan_read(&plan, "--surface", command->surface);
        for (int k = 0; k < command->centreline_count; k++)
            output_plan_read(&plan, "--centreline", command->centreline[k]);
        code = faults->count == 0 && import(command, faults) ? EXIT_DONE : cli_bad_input(faults);
    }
    free(command);
    free(faults);
    return code;
}
