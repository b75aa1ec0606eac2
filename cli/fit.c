// seldinger fit: a tree of point sets to a model (LIM), with the figures of the paper's tables 3 and 4.
#include "cli/cli.h"

#include "base/heap.h"
#include "base/output.h"
#include "base/sort_doubles.h"
#include "cli/junction_sheets.h"
#include "cli/output_plan.h"
#include "recon/fit/field_fit.h"
#include "recon/fit/lim_fit.h"
#include "recon/fit/model_measure.h"
#include "recon/fit/reach_report.h"
#include "recon/tree_file.h"
#include "recon/volume/blurred_edge.h"
#ifdef SELDINGER_RENDER
#include "render/picture.h"
#endif

#include <cjson/cJSON.h>
#include <getopt.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

typedef struct FitCommand {
    const char *tree, *output, *json, *picture, *preset;
    LimFitOptions options;
    double edge_blur;        // [mm] < 0: what the tree's file says
    double voxel;            // [mm] 0: not known
    JunctionSheets junctions;
    double tool_radius;      // [mm] of the tool led from the inlet through the model
    const char *local_option;   // one that only local models have, where it was given
    bool has_voxel, quiet, measure;
} FitCommand;

static bool is_shared_preset(const char *preset) { return !strcmp(preset, "default"); }

static const char help[] =
    "Usage: seldinger fit TREE.h5 -o MODEL.h5 [options]\n"
    "       seldinger fit MODEL.h5 --measure [--json F]\n\n"
    "Fits an implicit wall to the points of a tree: one field of shared blobs of compact support, which is the same from both sides of every border\n"
    "between neighbouring nodes; or, by preset, a local blobby model for each node (LIM, Kerrien et al. 2017).\n\n"
    "  -o, --output F.h5      the model\n"
    "  --preset NAME          default: shared blobs; local: a model for each node, neighbours blended; paper: the published values and method.\n"
    "                         Give it before other options\n"
    "  --target-mm X          how near the wall points should be: a blob is added where their mean distance is more than a fifth of this; by default more\n"
    "                         than 0.05 voxel, where no voxel is known 0.02 r of the node's radius r. local: stop when every point is this near; default max(0.5 voxel, min(0.2 r, 1.5 voxels)), where no\n"
    "                         voxel is known 0.08 r; half of it near an aneurysm. paper: 0.3\n"
    "  --max-blobs N          local, paper: blobs of a local model, at most; default 100\n"
    "  --voxel-mm X           voxel size of the angiogram [mm]; default: what the tree's file says (`voxel_mm`), else not known: the classes of\n"
    "                         d_a are then of 0.2 mm\n"
    "  --edge-blur-mm X       blur (standard deviation) that has moved the points inside the wall; they are first moved out by what it did to a\n"
    "                         vessel of their radius, at most 0.2 X; default: what `segment` found (`edge_blur_mm`); with --preset paper 0\n"
    "  --alpha X              local, paper: weight of the cohesion of blobs; default 0, paper 1e-5\n"
    "  --beta X               local, paper: smoothing: by default 1e-4, which weighs curvature by the noise's variance times r^2 as found from the points (twice:\n"
    "                         twice that, 0: none); paper 1e-3, the weight of curvature itself [mm^4]\n"
    "  --max-points N         local, paper: points of a local model, at most (evenly thinned), five times as many near an aneurysm;\n"
    "                         default 300, paper 1500\n"
    "  --threads N            default 0: all cores; the result does not depend on it\n"
    "  --measure              also: how far neighbouring nodes' walls differ where a tool passes from one to the next, walls that no\n"
    "                         point supports, narrow links; without -o of the model given, which is then not fitted again\n"
    "  --tool-radius-mm X     of the tool that is led from the model's inlet through the tree, for the report at the end; default 0.18\n"
    "  --json F               figures as JSON; - is standard output\n"
    "  --picture F.png        fitted surface coloured by the distance to the points, the worst nodes cut open\n"
    "  --junctions F.png      a section through each junction, the narrowest first; further pages are F-2.png and so on\n"
    "  --volume V             the angiogram behind these\n"
    "  --quiet                no summary, no progress\n\n"
    "Exit codes: 0 done; 2 wrong usage or bad input.\n";

static int usage_fault(const char *message, const char *what)
{
    fprintf(stderr, "seldinger fit: %s%s; see `seldinger fit --help`\n", message, what);
    return EXIT_BAD_INPUT;
}

// -1: go on; otherwise the exit code.
static int parse_options(int argc, char **argv, FitCommand *command)
{
    enum { PRESET = 256, EDGE_BLUR, TARGET, BLOBS, VOXEL, ALPHA, BETA, POINTS, THREADS, JSON, PICTURE, QUIET, MEASURE, TOOL_RADIUS, JUNCTIONS, VOLUME };
    static const struct option table[] = {
        {"output", required_argument, NULL, 'o'},      {"preset", required_argument, NULL, PRESET}, {"target-mm", required_argument, NULL, TARGET},
        {"max-blobs", required_argument, NULL, BLOBS}, {"voxel-mm", required_argument, NULL, VOXEL}, {"alpha", required_argument, NULL, ALPHA},
        {"beta", required_argument, NULL, BETA},       {"max-points", required_argument, NULL, POINTS}, {"threads", required_argument, NULL, THREADS},
        {"json", required_argument, NULL, JSON},       {"picture", required_argument, NULL, PICTURE}, {"quiet", no_argument, NULL, QUIET},
        {"measure", no_argument, NULL, MEASURE},       {"help", no_argument, NULL, 'h'},
        {"edge-blur-mm", required_argument, NULL, EDGE_BLUR}, {"tool-radius-mm", required_argument, NULL, TOOL_RADIUS},
        {"junctions", required_argument, NULL, JUNCTIONS}, {"volume", required_argument, NULL, VOLUME}, {0}};
    *command = (FitCommand){.options = lim_fit_default_options(), .preset = "default", .edge_blur = -1, .tool_radius = reach_default_options().tool_radius};
    double number;
    optind = 1;
    for (int choice; (choice = getopt_long(argc, argv, "o:h", table, NULL)) != -1;) {
        LimFitOptions *o = &command->options;
        switch (choice) {
        case 'o': command->output = optarg; break;
        case JSON: command->json = optarg; break;
        case PICTURE: command->picture = optarg; break;
        case QUIET: command->quiet = true; break;
        case MEASURE: command->measure = true; break;
        case JUNCTIONS: command->junctions.picture = optarg; break;
        case VOLUME: command->junctions.volume = optarg; break;
        case TOOL_RADIUS:
            if (!cli_number("--tool-radius-mm", optarg, 0.01, 100, &command->tool_radius))
                return EXIT_BAD_INPUT;
            break;
        case PRESET:
            if (strcmp(optarg, "default") && strcmp(optarg, "local") && strcmp(optarg, "paper"))
                return usage_fault("--preset is default, local or paper, not ", optarg);
            command->preset = optarg;
            command->options = strcmp(optarg, "paper") ? lim_fit_default_options() : lim_fit_paper_options();
            break;
        case TARGET:
            if (!cli_number("--target-mm", optarg, 1e-4, 100, &o->target_mm))
                return EXIT_BAD_INPUT;
            break;
        case EDGE_BLUR:
            if (!cli_number("--edge-blur-mm", optarg, 0, 100, &command->edge_blur))
                return EXIT_BAD_INPUT;
            break;
        case VOXEL:
            if (!cli_number("--voxel-mm", optarg, 1e-4, 100, &o->voxel_mm))
                return EXIT_BAD_INPUT;
            command->has_voxel = true;
            break;
        case ALPHA:
            command->local_option = "--alpha";
            if (!cli_number("--alpha", optarg, 0, 1, &o->alpha))
                return EXIT_BAD_INPUT;
            break;
        case BETA:
            command->local_option = "--beta";
            if (!cli_number("--beta", optarg, 0, 10, &o->beta))
                return EXIT_BAD_INPUT;
            break;
        case BLOBS:
            command->local_option = "--max-blobs";
            if (!cli_whole_number("--max-blobs", optarg, 2, 1000, &number))
                return EXIT_BAD_INPUT;
            o->max_blobs = (int)number;
            break;
        case POINTS:
            command->local_option = "--max-points";
            if (!cli_whole_number("--max-points", optarg, 50, 100000, &number))
                return EXIT_BAD_INPUT;
            o->max_points = (int)number;
            break;
        case THREADS:
            if (!cli_whole_number("--threads", optarg, 0, 256, &number))
                return EXIT_BAD_INPUT;
            o->threads = (int)number;
            break;
        case 'h': fputs(help, stdout); return EXIT_DONE;
        default: return usage_fault("unknown option or lacking value", "");
        }
    }
    if (optind != argc - 1)
        return usage_fault(optind < argc ? "one tree at a time, not also " : "lacks the tree to fit", optind < argc ? argv[optind + 1] : "");
    if (!command->output && !command->measure)
        return usage_fault("lacks -o MODEL.h5", "");
    if (command->local_option && is_shared_preset(command->preset))
        return usage_fault("--preset local or paper is needed for ", command->local_option);
    command->tree = argv[optind];
    return -1;
}

static FieldFitOptions shared_options(const FitCommand *command)
{
    FieldFitOptions options = field_fit_default_options();
    options.threads = command->options.threads;
    options.target_mm = command->options.target_mm;
    options.voxel_mm = command->voxel;
    return options;
}

static int describe_fit(const FitCommand *command, char *text, size_t room)
{
    const LimFitOptions *o = &command->options;
    if (is_shared_preset(command->preset)) {
        FieldFitOptions f = shared_options(command);
        return snprintf(text, room,
                        "fit:\n  preset: %s\n  edge_blur_mm: %g\n  target_mm: %g\n  voxel_mm: %g\n  tolerance_voxels: %g\n  tolerance_radii: %g\n"
                        "  tolerance_without_voxel_radii: %g\n  least_reach_voxels: %g\n  significance: %g\n  levels: %d\ntree:\n",
                        command->preset, command->edge_blur, f.target_mm, f.voxel_mm, f.tolerance_voxels, f.tolerance, f.tolerance_unknown,
                        f.least_reach_voxels, f.significance, f.levels);
    }
    return snprintf(text, room,
                    "fit:\n  preset: %s\n  edge_blur_mm: %g\n  alpha: %g\n  beta: %g\n  s: %g\n  iso_level: %g\n  max_blobs: %d\n  target_mm: %g\n  voxel_mm: %g\n"
                    "  topological_distance: %d\n  max_loops: %d\n  line_searches: %d\n  weigh_distance: %d\n  project_points: %d\n"
                    "  sweep_all_blobs: %d\n  give_up_splits: %d\n  extend_inlet: %d\n  guard_shape: %d\n  agree: %d\n  max_points: %d\ntree:\n",
                    command->preset, command->edge_blur, o->alpha, o->beta, o->s, o->iso_level, o->max_blobs, o->target_mm, o->voxel_mm,
                    o->topological_distance, o->max_loops, o->line_searches, o->weigh_distance, o->project_points, o->sweep_all_blobs, o->give_up_splits,
                    o->extend_inlet, o->guard_shape, o->agree, o->max_points);
}

// What was done, as YAML; the tree's own parameters below.
static char *describe(const FitCommand *command, const TreeFileInfo *tree)
{
    size_t room = 1024 + 4 * (tree->parameters ? strlen(tree->parameters) : 0);
    char *text = HEAP_ZEROED(room, 1);
    int n = describe_fit(command, text, room);
    char *out = text + n;
    bool line_start = true;
    for (const char *in = tree->parameters; in && *in && out < text + room - 4; in++) {
        if (line_start)
            *out++ = ' ', *out++ = ' ';
        *out++ = *in;
        line_start = *in == '\n';
    }
    *out = '\0';
    return text;
}

typedef struct FitFigures {
    long blobs, left_out;    // left_out: points
    int blobs_median, blobs_most;
    double error_median, error_worst, class_percent[4], seconds;
    int worst_node;
} FitFigures;

static FitFigures figures_of(const VesselTree *model, double voxel, double seconds)
{
    int n = model->node_count;
    FitFigures figures = {.blobs = (long)model->blob_count, .seconds = seconds};
    double *sorted = HEAP_ZEROED((size_t)n, sizeof *sorted);
    for (int i = 0; i < n; i++) {
        double error = model->error[i];
        int kind = error < 0.5 * voxel ? 0 : error < voxel ? 1 : error < 2 * voxel ? 2 : 3;
        figures.class_percent[kind] += 100.0 / n;
        if (error > model->error[figures.worst_node])
            figures.worst_node = i;
    }
    figures.error_worst = model->error[figures.worst_node];
    memcpy(sorted, model->error, (size_t)n * sizeof *sorted);
    sort_doubles(sorted, (size_t)n);
    figures.error_median = sorted[n / 2];
    for (int i = 0; i < n; i++)
        sorted[i] = (double)(model->blob_offset[i + 1] - model->blob_offset[i]);
    sort_doubles(sorted, (size_t)n);
    figures.blobs_median = (int)sorted[n / 2];
    figures.blobs_most = (int)sorted[n - 1];
    free(sorted);
    return figures;
}

static void print_jumps(const char *what, const JumpRow *row)
{
    for (int place = 0; place < PLACES; place++)
        if (row[place].count > 0)
            printf("%-8s %-12s %7d %9.4f %8.4f %8.4f %9.4f %8.4f %8.4f   %d, %d\n", what, model_place_name[place], row[place].count, row[place].gap_median,
                   row[place].gap_p99, row[place].gap_most, row[place].normal_median, row[place].normal_p99, row[place].normal_most,
                   row[place].worst_node, row[place].worst_other);
}

static void print_measure(const ModelMeasure *m)
{
    printf("jumps between  place          joins   gap p50      p99  max [mm] normal p50      p99 max [rad]   worst pair of nodes\n");
    print_jumps("raw", m->raw);
    print_jumps("as met", m->met);
    print_jumps("cold", m->cold);
    printf("bare walls     %d nodes with wall further than 0.6 r from data", m->bare_nodes);
    if (m->bare_nodes > 0)
        printf(", at most %.3f mm (node %d)", m->bare_most_mm, m->bare_worst);
    printf("\nghost sheets   %d nodes", m->ghost_nodes);
    if (m->ghost_nodes > 0)
        printf(", at most %.3f mm from data (node %d)", m->ghost_most_mm, m->ghost_worst);
    printf("\nnarrow links   %d of %d have less than half the radius free", m->narrow_links, m->links);
    if (m->links > 0)
        printf("; least %.3f r (node %d)", m->least_clearance, m->narrowest_node);
    printf("\n");
}

static void json_jumps(cJSON *root, const char *name, const JumpRow *row)
{
    cJSON *object = cJSON_AddObjectToObject(root, name);
    for (int place = 0; place < PLACES; place++) {
        cJSON *item = cJSON_AddObjectToObject(object, model_place_name[place]);
        cJSON_AddNumberToObject(item, "joins", row[place].count);
        cJSON_AddNumberToObject(item, "gap_p50_mm", row[place].gap_median);
        cJSON_AddNumberToObject(item, "gap_p99_mm", row[place].gap_p99);
        cJSON_AddNumberToObject(item, "gap_max_mm", row[place].gap_most);
        cJSON_AddNumberToObject(item, "normal_p50_rad", row[place].normal_median);
        cJSON_AddNumberToObject(item, "normal_p99_rad", row[place].normal_p99);
        cJSON_AddNumberToObject(item, "normal_max_rad", row[place].normal_most);
        cJSON_AddNumberToObject(item, "worst_node", row[place].worst_node);
        cJSON_AddNumberToObject(item, "worst_other", row[place].worst_other);
    }
}

static void json_measure(cJSON *root, const ModelMeasure *m)
{
    json_jumps(root, "jumps_raw", m->raw);
    json_jumps(root, "jumps_as_met", m->met);
    json_jumps(root, "jumps_cold", m->cold);
    cJSON_AddNumberToObject(root, "bare_nodes", m->bare_nodes);
    cJSON_AddNumberToObject(root, "bare_max_mm", m->bare_most_mm);
    cJSON_AddNumberToObject(root, "bare_worst_node", m->bare_worst);
    cJSON_AddNumberToObject(root, "ghost_nodes", m->ghost_nodes);
    cJSON_AddNumberToObject(root, "ghost_max_mm", m->ghost_most_mm);
    cJSON_AddNumberToObject(root, "ghost_worst_node", m->ghost_worst);
    cJSON_AddNumberToObject(root, "narrow_links", m->narrow_links);
    cJSON_AddNumberToObject(root, "least_clearance_ratio", m->links > 0 ? m->least_clearance : 1);
    cJSON_AddNumberToObject(root, "narrowest_node", m->narrowest_node);
}

static void print_figures(const VesselTree *model, const FitFigures *f, double voxel)
{
    printf("nodes          %d, %lld points\n", model->node_count, (long long)model->point_count);
    if (f->left_out > 0)
        printf("left out       %ld points, in another vessel's lumen\n", f->left_out);
    printf("blobs          %ld: %.1f a node, median %d, most %d\n", f->blobs, (double)f->blobs / model->node_count, f->blobs_median, f->blobs_most);
    printf("d_a            median %.4f mm, worst %.4f mm (node %d)\n", f->error_median, f->error_worst, f->worst_node);
    printf("d_a classes    C1 < 0.5 voxel %.2f %%, C2 < 1 voxel %.2f %%, C3 < 2 voxels %.2f %%, C4 %.2f %% (voxel %g mm)\n", f->class_percent[0],
           f->class_percent[1], f->class_percent[2], f->class_percent[3], voxel);
    printf("seconds        %.2f\n", f->seconds);
}

// `root` becomes the file's.
static bool write_json(const char *path, cJSON *root, const VesselTree *model, const FitFigures *f, const ModelMeasure *measure, double voxel, Faults *faults)
{
    cJSON_AddNumberToObject(root, "nodes", model->node_count);
    cJSON_AddNumberToObject(root, "points", (double)model->point_count);
    cJSON_AddNumberToObject(root, "points_left_out", (double)f->left_out);
    cJSON_AddNumberToObject(root, "blobs", (double)f->blobs);
    cJSON_AddNumberToObject(root, "blobs_per_node", (double)f->blobs / model->node_count);
    cJSON_AddNumberToObject(root, "blobs_median", f->blobs_median);
    cJSON_AddNumberToObject(root, "blobs_max", f->blobs_most);
    cJSON_AddNumberToObject(root, "error_median_mm", f->error_median);
    cJSON_AddNumberToObject(root, "error_max_mm", f->error_worst);
    cJSON_AddNumberToObject(root, "worst_node", f->worst_node);
    cJSON_AddNumberToObject(root, "voxel_mm", voxel);
    cJSON *classes = cJSON_AddArrayToObject(root, "class_percent");
    for (int i = 0; i < 4; i++)
        cJSON_AddItemToArray(classes, cJSON_CreateNumber(f->class_percent[i]));
    cJSON_AddNumberToObject(root, "seconds", f->seconds);
    if (measure)
        json_measure(root, measure);
    char *text = cJSON_Print(root);
    bool good = text && output_write(path, text, strlen(text), faults);
    if (!text)
        faults_add(faults, path, 0, 0, "not enough memory");
    free(text);
    return good;
}

// False with a fault where there is none; the model is written all the same.
static bool make_picture(const char *path, const VesselTree *model, Faults *faults)
{
#ifdef SELDINGER_RENDER
    char message[256] = "";
    TriangleMesh *mesh = isosurface_of_tree(model, isosurface_cell_for(model));
    PictureOptions options = picture_default_options();
    bool drawn = picture_of_fit(path, &options, model, mesh, NULL, message, sizeof message);
    if (!drawn)
        faults_add(faults, path, 0, 0, "no picture: %s", message);
    triangle_mesh_free(mesh);
    return drawn;
#else
    (void)model;
    faults_add(faults, path, 0, 0, "this build has no pictures; build with -DSELDINGER_RENDER=ON");
    return false;
#endif
}

static double seconds_now(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static VesselTree *run_fit(FitCommand *command, TreeFileInfo *info, double *seconds, int64_t *left_out, Faults *faults)
{
    OutputPlan plan = {.faults = faults};
    output_plan_write_file(&plan, "-o", command->output);
    output_plan_write(&plan, "--json", command->json);
    output_plan_write_file(&plan, "--picture", command->picture);
    output_plan_write_file(&plan, "--junctions", command->junctions.picture);
    output_plan_series(&plan, "--junctions", ".png");
    output_plan_read(&plan, "the tree", command->tree);
    output_plan_read_volume(&plan, "--volume", command->junctions.volume);
    VesselTree *tree = tree_file_load(command->tree, info, faults), *model = NULL;
    if (tree && tree->point_count < 4)
        faults_add(faults, command->tree, 0, 0, "has %d nodes and %lld points; at least 4 points on the wall are needed", tree->node_count,
                   (long long)tree->point_count);
    if (tree && !command->output && !vessel_tree_is_model(tree))
        faults_add(faults, command->tree, 0, 0, "is a tree without a model; fit it with -o MODEL.h5");
    if (tree && faults->count == 0) {
        if (!command->has_voxel) {
            double said = tree_file_number(info, "voxel_mm", 0);
            command->options.voxel_mm = said > 1e-4 && said < 100 ? said : 0;
        }
        command->voxel = command->options.voxel_mm;
        if (!command->output)
            return tree;
        if (command->edge_blur < 0)      // a model's points are where its fit has put them
            command->edge_blur = vessel_tree_is_model(tree) || !strcmp(command->preset, "paper") ? 0 : fmax(tree_file_number(info, "edge_blur_mm", 0), 0);
        if (!blurred_edge_correct(tree, command->edge_blur)) {
            faults_add(faults, command->tree, 0, 0, "not enough memory");
            vessel_tree_free(tree);
            return NULL;
        }
        ProgressBar bar;
        Progress progress = progress_bar(&bar, "fit", command->quiet);
        double begin = seconds_now();
        if (is_shared_preset(command->preset)) {
            FieldFitOptions options = shared_options(command);
            options.left_out = left_out;
            model = field_fit(tree, &options, &progress, faults);
        } else {
            model = lim_fit(tree, &command->options, &progress, faults);
        }
        *seconds = seconds_now() - begin;
    }
    vessel_tree_free(tree);
    return model;
}

int verb_fit(int argc, char **argv)
{
    static Faults faults;
    FitCommand command;
    int code = parse_options(argc, argv, &command);
    if (code >= 0)
        return code;
    TreeFileInfo from = {0};
    double seconds = 0;
    int64_t left_out = 0;
    VesselTree *model = run_fit(&command, &from, &seconds, &left_out, &faults);
    bool good = model != NULL;
    if (good) {
        double voxel = command.options.voxel_mm > 0 ? command.options.voxel_mm : lim_fit_default_options().voxel_mm;
        FitFigures figures = figures_of(model, voxel, seconds);
        figures.left_out = (long)left_out;
        ModelMeasure measure;
        if (command.measure && !model_measure(model, NULL, command.options.threads, &measure)) {
            faults_add(&faults, command.tree, 0, 0, "not enough memory to measure the model");
            good = false;
        }
        TreeFileInfo info = {.source = from.source, .parameters = describe(&command, &from),
                             .created_by = (char *)(size_t) "seldinger " SELDINGER_VERSION " fit"};
        if (command.output)
            good = good && tree_file_save(model, &info, command.output, &faults);
        free(info.parameters);
        bool spoken = good && !command.quiet && !(command.json && !strcmp(command.json, "-"));
        if (spoken)
            print_figures(model, &figures, voxel);
        if (spoken && command.measure)
            print_measure(&measure);
        cJSON *root = cJSON_CreateObject();
        if (spoken || command.json)
            good = good && reach_report(model, command.tree, command.tool_radius, spoken ? stdout : NULL, root, &faults);
        if (good && command.json)
            good = write_json(command.json, root, model, &figures, command.measure ? &measure : NULL, voxel, &faults);
        cJSON_Delete(root);
        command.junctions.tool_radius = command.tool_radius;
        good = good && junction_sheets_draw(&command.junctions, command.output ? command.output : command.tree, model, &faults);
        good = good && (!command.picture || make_picture(command.picture, model, &faults));
    }
    vessel_tree_free(model);
    tree_file_info_free(&from);
    return good ? EXIT_DONE : cli_bad_input(&faults);
}
