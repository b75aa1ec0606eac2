// seldinger info: what a file is and its figures, for people or as JSON. The figures are gathered once as JSON; the text is that, printed plainly.
#include "cli/cli.h"

#include "base/heap.h"
#include "base/sort_doubles.h"
#include "cli/file_kind.h"
#include "cli/junction_sheets.h"
#include "cli/output_plan.h"
#include "recon/fit/reach_report.h"
#include "recon/surface/mesh_check.h"
#include "recon/tree_file.h"
#include "recon/volume/volume_file.h"
#include "render/tree_page.h"
#include "sim/recording.h"
#ifdef SELDINGER_RENDER
#include "render/picture.h"
#endif

#include <cJSON.h>
#include <getopt.h>
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

static const char help[] = "Usage: seldinger info FILE [--json] [--report F.html] [--picture F.png]\n\n"
                           "Says what FILE is (volume or folder of a DICOM series, surface, tree, model, recording, scene or script) and its figures. Lengths mm.\n"
                           "Of a model also where a tool gets to from the inlet, and what is shut and why.\n\n"
                           "  --json           as JSON on standard output\n"
                           "  --report F.html  of a tree or model: a page for readers, all in one file: tree, candidates (narrow places, wide places, aneurysms),\n"
                           "                   branches, radius along each, quality of the fit; for training and research, not a medical device\n"
                           "  --picture F.png  of a model: its surface coloured by the distance to the data, and the paper's Table 4 as a histogram\n"
                           "  --junctions F.png  of a model: a section through each junction, the narrowest first; further pages are F-2.png and so on\n"
                           "  --volume V       the angiogram behind these\n"
                           "  --before M.h5    another model of the same vessels: the ten narrowest junctions in that, beside what they are now\n"
                           "  --tool-radius-mm X  of the tool that is led from a model's inlet through the tree; default 0.18\n"
                           "  --quiet          no figures as text: the report or picture alone\n\n"
                           "Exit codes: 0 done; 2 wrong usage or bad input.\n";

static void add_vector(cJSON *object, const char *name, Vec3 v)
{
    cJSON_AddItemToObject(object, name, cJSON_CreateDoubleArray((double[]){v.x, v.y, v.z}, 3));
}

// {"least", "median", "largest"} of `count` values.
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

static bool draw_model(const char *picture, const char *path, const VesselTree *tree, const TreeFileInfo *info, Faults *faults)
{
    char message[512] = "the tree has no fitted model to draw";
#ifdef SELDINGER_RENDER
    TriangleMesh *mesh = vessel_tree_is_model(tree) ? isosurface_of_tree(tree, isosurface_cell_for(tree)) : NULL;
    double *error = mesh ? malloc(((size_t)mesh->vertex_count + 1) * sizeof *error) : NULL, voxel = tree_file_number(info, "voxel_mm", 0.2);
    PictureOptions options = picture_default_options();
    options.title = path;
    bool drawn = error && surface_point_error(mesh, tree, error, NULL) &&
                 picture_of_error(picture, &options, tree, mesh, error, voxel > 0 ? voxel : 0.2, message, sizeof message);
    free(error);
    triangle_mesh_free(mesh);
#else
    (void)path, (void)tree, (void)info;
    bool drawn = false;
    snprintf(message, sizeof message, "built without pictures");
#endif
    if (!drawn)
        faults_add(faults, picture, 0, 0, "no picture: %s", message);
    return drawn;
}

typedef struct TreeWishes {
    const char *report, *picture;
    JunctionSheets junctions;
    double tool_radius;      // [mm]
    char *reach;             // comes out: where a tool gets to, as text; the caller's to free
} TreeWishes;

static bool add_reach(cJSON *object, const char *path, const VesselTree *tree, TreeWishes *wishes, Faults *faults)
{
    size_t length;
    FILE *out = open_memstream(&wishes->reach, &length);
    if (!out)
        heap_is_empty(BUFSIZ, __FILE__);
    bool good = reach_report(tree, path, wishes->tool_radius, out, object, faults);
    if (fclose(out) != 0)
        heap_is_empty(length, __FILE__);
    return good;
}

static bool describe_tree(cJSON *object, const char *path, TreeWishes *wishes, Faults *faults)
{
    TreeFileInfo info = {0};
    VesselTree *tree = tree_file_load(path, &info, faults);
    if (!tree)
        return false;
    bool model = vessel_tree_is_model(tree);
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
    if (model) {
        cJSON_AddNumberToObject(object, "blobs", (double)tree->blob_count);
        cJSON_AddNumberToObject(object, "blobs_per_node", (double)tree->blob_count / tree->node_count);
        cJSON_AddNumberToObject(object, "iso_level", tree->iso_level);
        add_spread(object, "error_mm", tree->error, tree->node_count);
    }
    if (info.source)
        cJSON_AddStringToObject(object, "source", info.source);
    if (info.created_by)
        cJSON_AddStringToObject(object, "created_by", info.created_by);
    bool good = add_reach(object, path, tree, wishes, faults);
    good = good && (!wishes->report || tree_page_write(wishes->report, path, tree, &info, faults));
    wishes->junctions.tool_radius = wishes->tool_radius;
    good = good && junction_sheets_draw(&wishes->junctions, path, tree, faults);
    good = good && (!wishes->picture || draw_model(wishes->picture, path, tree, &info, faults));
    tree_file_info_free(&info);
    vessel_tree_free(tree);
    return good;
}

// When which device took a tool's place.
static void add_recorded_exchanges(cJSON *tool, const RecordedRun *run, int index)
{
    cJSON *list = cJSON_AddArrayToObject(tool, "exchanges");
    int before = 0;
    for (int64_t i = 0; i < run->step_count; i++) {
        int fitted = recorded_run_fitted(run, index, i);
        if (fitted != before) {
            cJSON *exchange = cJSON_CreateObject();
            cJSON_AddNumberToObject(exchange, "time_s", run->time_s[i] - run->step_ms / 1000);
            cJSON_AddNumberToObject(exchange, "device", fitted);
            cJSON_AddItemToArray(list, exchange);
        }
        before = fitted;
    }
}

static void add_recorded_tools(cJSON *object, const RecordedRun *run)
{
    cJSON *list = cJSON_AddArrayToObject(object, "tools");
    for (int k = 0; k < run->tool_count; k++) {
        const RecordedTool *own = &run->tool[k];
        cJSON *tool = cJSON_CreateObject();
        cJSON_AddStringToObject(tool, "name", own->name);
        cJSON_AddStringToObject(tool, "kind", own->kind);
        RecordedToolFrame at = {.node_count = own->device_nodes[0], .s = own->s};
        if (run->frame_count > 0)
            at = recorded_run_tool_frame(run, k, run->frame_count - 1);
        cJSON_AddNumberToObject(tool, "length_mm", at.s[at.node_count - 1]);
        if (run->step_count > 0)
            cJSON_AddNumberToObject(tool, "inserted_mm", own->inserted[run->step_count - 1]);
        if (run->frame_count > 0)
            add_vector(tool, "tip_mm", at.position[at.node_count - 1]);
        if (run->exchange)
            add_recorded_exchanges(tool, run, k);
        cJSON_AddItemToArray(list, tool);
    }
}

static bool describe_recording(cJSON *object, const char *path, Faults *faults)
{
    RecordedRun *run = recorded_run_load(path, faults);
    char hash[17] = "";
    if (!run)
        return false;
    cJSON_AddStringToObject(object, "what", "recording");
    cJSON_AddNumberToObject(object, "steps", (double)run->step_count);
    cJSON_AddNumberToObject(object, "frames", (double)run->frame_count);
    cJSON_AddNumberToObject(object, "nodes", run->node_count);
    cJSON_AddNumberToObject(object, "simulated_s", run->step_count > 0 ? run->time_s[run->step_count - 1] : 0);
    RecordedFrame last = recorded_run_frame(run, run->frame_count > 0 ? run->frame_count - 1 : 0);
    if (run->frame_count > 0)
        add_vector(object, "tip_mm", last.position[last.node_count - 1]);
    if (run->tool_count > 1)
        add_recorded_tools(object, run);
    if (run->step_count > 0) {
        snprintf(hash, sizeof hash, "%016" PRIx64, run->state_hash[run->step_count - 1]);
        cJSON_AddStringToObject(object, "state_hash", hash);
    }
    recorded_run_free(run);
    return true;
}

static bool describe_volume(cJSON *object, const char *path, Faults *faults)
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

static void add_count(cJSON *object, const char *name, const MeshFinding *finding)
{
    cJSON_AddNumberToObject(object, name, finding->count);
}

static bool describe_surface(cJSON *object, const char *path, Faults *faults)
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
        faults_add(faults, path, 0, 0, "cannot be checked: no memory");
    }
    surface_free(mesh);
    return good;
}

static void add_tools(cJSON *object, const Scene *scene)
{
    cJSON *list = cJSON_AddArrayToObject(object, "tools");
    for (int k = 0; k < scene->tool_count; k++) {
        WireOptions wire = scene_tool_wire(scene, k);
        cJSON *tool = cJSON_CreateObject();
        cJSON_AddStringToObject(tool, "name", scene->tool[k].name);
        cJSON_AddStringToObject(tool, "kind", tool_kind_name[scene->tool[k].kind]);
        cJSON_AddNumberToObject(tool, "length_mm", wire_length(&wire));
        cJSON_AddNumberToObject(tool, "inserted_mm", wire.inserted);
        cJSON *spares = scene_device_count(scene, k) > 1 ? cJSON_AddArrayToObject(tool, "exchange") : NULL;
        for (int i = 1; spares && i < scene_device_count(scene, k); i++) {
            wire = scene_device_wire(scene, k, i);
            cJSON *spare = cJSON_CreateObject();
            cJSON_AddNumberToObject(spare, "length_mm", wire_length(&wire));
            cJSON_AddItemToArray(spares, spare);
        }
        cJSON_AddItemToArray(list, tool);
    }
}

static bool describe_scene(cJSON *object, const char *path, Faults *faults)
{
    static const char *const sources[] = {"model", "shape", "tube", "plane", "mesh", "none"};
    Scene *scene = scene_load(path, faults);
    if (!scene)
        return false;
    double length = wire_length(&scene->wire);
    cJSON_AddStringToObject(object, "what", "scene");
    cJSON_AddStringToObject(object, "vessel", sources[scene->source]);
    if (scene->model_path)
        cJSON_AddStringToObject(object, "model", scene->model_path);
    if (scene->mesh_path)
        cJSON_AddStringToObject(object, "mesh", scene->mesh_path);
    cJSON_AddStringToObject(object, "contact", contact_name[scene->contact]);
    if (scene->source == SOURCE_SHAPE)
        cJSON_AddStringToObject(object, "shape", scene->shape_name);
    cJSON_AddNumberToObject(object, "friction", scene->friction);
    if (scene->tool_count > 1)
        add_tools(object, scene);
    cJSON_AddNumberToObject(object, "elements", scene->wire.elements);
    cJSON_AddNumberToObject(object, "sections", scene->wire.section_count);
    cJSON_AddNumberToObject(object, "length_mm", length);
    cJSON_AddNumberToObject(object, "step_ms", scene->dt);
    cJSON_AddBoolToObject(object, "sheath", scene->wire.has_sheath);
    cJSON_AddNumberToObject(object, "script_s", scene->script ? script_duration_s(scene->script) : 0);
    cJSON_AddNumberToObject(object, "targets", scene->target_count);
    scene_free(scene);
    return true;
}

// What a script does with one tool, in sum.
static void add_hand(cJSON *object, const Script *script, int tool)
{
    double push = 0, twist = 0, released = 0;
    int exchanges = 0, before = 0;
    for (int i = 0; i + 1 < script->count; i++) {
        double seconds = script->row[i + 1].t_s - script->row[i].t_s;
        const Command *command = script_row_command(&script->row[i], tool);
        push += command->push_mm_s * seconds;
        twist += command->twist_deg_s * seconds;
        released += script->row[i].released >> tool & 1 ? seconds : 0;
        exchanges += script->row[i].fitted[tool] != before;
        before = script->row[i].fitted[tool];
    }
    cJSON_AddNumberToObject(object, "push_mm", push);
    cJSON_AddNumberToObject(object, "twist_deg", twist);
    if (released > 0)
        cJSON_AddNumberToObject(object, "released_s", released);
    if (exchanges > 0)
        cJSON_AddNumberToObject(object, "exchanges", exchanges);
}

static bool describe_script(cJSON *object, const char *path, Faults *faults)
{
    ScriptTools tools;
    Script *script = script_load_any(path, &tools, faults);
    if (!script)
        return false;
    bool named = *tools.names.name[0];
    cJSON_AddStringToObject(object, "what", "script");
    cJSON_AddNumberToObject(object, "rows", script->count);
    cJSON_AddNumberToObject(object, "duration_s", script_duration_s(script));
    cJSON *list = named ? cJSON_AddArrayToObject(object, "tools") : NULL;
    for (int k = 0; k < tools.names.count; k++) {
        cJSON *tool = named ? cJSON_CreateObject() : object;
        if (named) {
            cJSON_AddStringToObject(tool, "name", tools.names.name[k]);
            cJSON_AddItemToArray(list, tool);
        }
        add_hand(tool, script, k);
    }
    script_free(script);
    return true;
}

static void print_value(const cJSON *value)
{
    if (cJSON_IsString(value)) {
        printf("%s", value->valuestring);
    } else if (cJSON_IsBool(value)) {
        printf("%s", cJSON_IsTrue(value) ? "yes" : "no");
    } else if (cJSON_IsNumber(value)) {
        printf("%.6g", value->valuedouble);
    } else {
        for (const cJSON *item = value->child; item; item = item->next) {
            if (item->string)
                printf("%s ", item->string);
            print_value(item);
            if (item->next)
                printf(", ");
        }
    }
}

// Where a tool gets to has its own words.
static void print_text(const cJSON *object, const char *reach)
{
    for (const cJSON *item = object->child; item; item = item->next) {
        if (!strcmp(item->string, "reach"))
            continue;
        printf("%-16s ", item->string);
        print_value(item);
        printf("\n");
    }
    fputs(reach ? reach : "", stdout);
}

int verb_info(int argc, char **argv)
{
    enum { JSON = 256, REPORT, PICTURE, TOOL_RADIUS, JUNCTIONS, VOLUME, BEFORE, QUIET, HELP };
    static const struct option table[] = {{"json", no_argument, NULL, JSON}, {"report", required_argument, NULL, REPORT},
                                          {"picture", required_argument, NULL, PICTURE},
                                          {"tool-radius-mm", required_argument, NULL, TOOL_RADIUS}, {"junctions", required_argument, NULL, JUNCTIONS},
                                          {"volume", required_argument, NULL, VOLUME}, {"before", required_argument, NULL, BEFORE}, {"quiet", no_argument, NULL, QUIET}, {"help", no_argument, NULL, HELP}, {0}};
    static Faults faults;
    const char *report = NULL, *picture = NULL;
    bool json = false, quiet = false;
    TreeWishes wishes = {.tool_radius = reach_default_options().tool_radius};
    optind = 1;
    for (int choice; (choice = getopt_long(argc, argv, "h", table, NULL)) != -1;) {
        switch (choice) {
        case JSON: json = true; break;
        case REPORT: report = optarg; break;
        case PICTURE: picture = optarg; break;
        case JUNCTIONS: wishes.junctions.picture = optarg; break;
        case VOLUME: wishes.junctions.volume = optarg; break;
        case BEFORE: wishes.junctions.before = optarg; break;
        case TOOL_RADIUS:
            if (!cli_number("--tool-radius-mm", optarg, 0.01, 100, &wishes.tool_radius))
                return EXIT_BAD_INPUT;
            break;
        case QUIET: quiet = true; break;
        case HELP:
        case 'h': fputs(help, stdout); return EXIT_DONE;
        default: fprintf(stderr, "seldinger info: unknown option; see `seldinger info --help`\n"); return EXIT_BAD_INPUT;
        }
    }
    if (optind != argc - 1) {
        fprintf(stderr, "seldinger info: one file is needed; see `seldinger info --help`\n");
        return EXIT_BAD_INPUT;
    }
    const char *path = argv[optind];
    cJSON *object = cJSON_CreateObject();
    faults_clear(&faults);
    cJSON_AddStringToObject(object, "file", path);
    bool good = false;
    wishes.report = report, wishes.picture = picture;
    FileKind kind = file_kind(path);
    if ((report || picture || wishes.junctions.picture) && kind != FILE_TREE && kind != FILE_MISSING)
        faults_add(&faults, path, 0, 0, "is no tree or model; %s is made of those", report ? "--report" : picture ? "--picture" : "--junctions");
    OutputPlan plan = {.faults = &faults};
    output_plan_write(&plan, "--report", report);
    output_plan_write_file(&plan, "--picture", picture);
    output_plan_write_file(&plan, "--junctions", wishes.junctions.picture);
    output_plan_series(&plan, "--junctions", ".png");
    output_plan_read(&plan, "the file", path);
    output_plan_read(&plan, "--before", wishes.junctions.before);
    output_plan_read_volume(&plan, "--volume", wishes.junctions.volume);
    if ((wishes.junctions.volume || wishes.junctions.before) && !wishes.junctions.picture)
        faults_add(&faults, path, 0, 0, "--volume and --before belong to the pictures of --junctions F.png");
    if (faults.count > 0) {
        cJSON_Delete(object);
        return cli_bad_input(&faults);
    }
    switch (kind) {
    case FILE_TREE: good = describe_tree(object, path, &wishes, &faults); break;
    case FILE_RECORDING: good = describe_recording(object, path, &faults); break;
    case FILE_SCENE: good = describe_scene(object, path, &faults); break;
    case FILE_SCRIPT: good = describe_script(object, path, &faults); break;
    case FILE_MISSING: faults_add(&faults, path, 0, 0, "cannot be opened; a file that is there and may be read, or a folder with a DICOM series"); break;
    case FILE_VOLUME: good = describe_volume(object, path, &faults); break;
    case FILE_SURFACE: good = describe_surface(object, path, &faults); break;
    case FILE_UNKNOWN:
        faults_add(&faults, path, 0, 0, "is of no kind that `info` can describe; it reads volumes (NRRD, MetaImage, NIfTI, DICOM), surfaces (STL, PLY, OBJ, VTP), trees, models, "
                                       "recordings, scenes and scripts");
        break;
    }
    if (good && json && !(report && !strcmp(report, "-"))) {
        char *text = cJSON_Print(object);
        printf("%s\n", text ? text : "{}");
        free(text);
    } else if (good && !quiet && !(report && !strcmp(report, "-"))) {
        print_text(object, wishes.reach);
    }
    free(wishes.reach);
    cJSON_Delete(object);
    return good ? EXIT_DONE : cli_bad_input(&faults);
}
