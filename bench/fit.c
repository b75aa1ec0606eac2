// seldinger bench fit: tables 3, 4 and 5 of Kerrien et al. 2017 with the paper's figures, and the time of a local model.
#include "bench/bench.h"

#include "base/simd.h"
#include "base/sort_doubles.h"
#include "bench/lim_trial.h"
#include "cli/output_plan.h"
#include "geom/isosurface.h"
#include "recon/phantom/phantom.h"
#include "recon/track/rbt_track.h"
#include "recon/track/trace.h"
#include "recon/tree_file.h"
#include "recon/volume/volume_file.h"

#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

enum { LEVELS = 10, MOST_TREES = 8, TARGETS = 3, LIMITS = 3 };

typedef struct FitBench {
    BenchOptions common;
    bool table3, tables45;
    const char *tree[MOST_TREES];
    int tree_count, preset;
    LimFitOptions options;
} FitBench;

typedef struct Range {
    double least, median, most;
} Range;

// Sorts `value`.
static Range range_of(double *value, int count)
{
    sort_doubles(value, (size_t)count);
    double median = count % 2 ? value[count / 2] : 0.5 * (value[count / 2 - 1] + value[count / 2]);
    return (Range){value[0], median, value[count - 1]};
}

// One field of a column of trials.
static Range trial_range(const LimTrial *trial, int count, size_t offset, double *scratch)
{
    for (int i = 0; i < count; i++)
        memcpy(&scratch[i], (const char *)&trial[i] + offset, sizeof(double));
    return range_of(scratch, count);
}

// --- Table 3 ---

typedef struct Table3 {
    LimTrialShape *shape[LIM_TRIAL_SHAPES];
    LimTrial *trial;         // (shapes, levels, runs)
    bool *failed;
    int runs;
    const LimFitOptions *options;
} Table3;

static double level_sigma(int level) { return 0.025 * (level + 1); }

static void run_trial(void *context, long index)
{
    Table3 *table = context;
    int run = (int)(index % table->runs), level = (int)(index / table->runs % LEVELS), shape = (int)(index / table->runs / LEVELS);
    uint64_t seed = 1 + (uint64_t)run * 7919 + (uint64_t)level * 104729 + (uint64_t)shape * 1299709;
    table->failed[index] = !lim_trial_run(table->shape[shape], level_sigma(level), seed, table->options, &table->trial[index]);
}

static void json_range(cJSON *row, const char *name, Range range)
{
    cJSON *out = cJSON_AddObjectToObject(row, name);
    cJSON_AddNumberToObject(out, "min", range.least);
    cJSON_AddNumberToObject(out, "median", range.median);
    cJSON_AddNumberToObject(out, "max", range.most);
}

// True if the shape meets all limits.
static bool report_shape(const Table3 *table, int s, FILE *text, cJSON *rows)
{
    static const struct {
        double d[3], approximate[3], blobs[3], limit;
    } paper[LIM_TRIAL_SHAPES] = {{{0.015, 0.042, 0.189}, {0.015, 0.041, 0.164}, {5, 7, 89}, 7},
                                 {{0.039, 0.119, 0.233}, {0.038, 0.103, 0.175}, {5, 9, 83}, 9},
                                 {{0.016, 0.063, 0.174}, {0.016, 0.064, 0.146}, {8, 15, 102}, 15},
                                 {{0.048, 0.078, 0.334}, {0.046, 0.079, 0.211}, {12, 15, 15}, 15}};
    int count = LEVELS * table->runs, met = 0;
    const LimTrial *trial = table->trial + s * count;
    double *scratch = malloc((size_t)count * sizeof *scratch), worst_ratio = 0, cpu = 0, bias = 0;
    if (!scratch)
        return false;
    Range d = trial_range(trial, count, offsetof(LimTrial, d), scratch), approximate = trial_range(trial, count, offsetof(LimTrial, d_approximate), scratch);
    Range known = trial_range(trial, count, offsetof(LimTrial, d_shape), scratch), freely = trial_range(trial, count, offsetof(LimTrial, d_blobs), scratch);
    for (int i = 0; i < count; i++) {
        scratch[i] = trial[i].blobs;
        met += trial[i].met;
        cpu += trial[i].cpu_s / count;
        bias += trial[i].bias / count;
    }
    Range blobs = range_of(scratch, count);
    fprintf(text, "%-13s d   %.3f %.3f %.3f   paper %.3f %.3f %.3f   | least squares: shape known %.3f, its blobs free %.3f\n", lim_trial_name[s], d.least,
            d.median, d.most, paper[s].d[0], paper[s].d[1], paper[s].d[2], known.median, freely.median);
    fprintf(text, "%-13s d_a %.3f %.3f %.3f   paper %.3f %.3f %.3f\n", "", approximate.least, approximate.median, approximate.most, paper[s].approximate[0],
            paper[s].approximate[1], paper[s].approximate[2]);
    fprintf(text, "%-13s N_b %5.0f %5.1f %5.0f   paper %5.0f %5.0f %5.0f\n%-13s median d / sigma a level:", "", blobs.least, blobs.median, blobs.most,
            paper[s].blobs[0], paper[s].blobs[1], paper[s].blobs[2], "");
    cJSON *row = cJSON_CreateObject(), *levels = cJSON_CreateArray();
    for (int level = 0; level < LEVELS; level++) {
        Range at = trial_range(trial + level * table->runs, table->runs, offsetof(LimTrial, d), scratch);
        double ratio = at.median / level_sigma(level);
        fprintf(text, " %.2f", ratio);
        worst_ratio = fmax(worst_ratio, ratio);
        cJSON_AddItemToArray(levels, cJSON_CreateNumber(ratio));
    }
    double share = (double)met / count;
    bool few = blobs.median <= paper[s].limit, enough = share >= 0.85, close = worst_ratio < 1, aim = d.median <= paper[s].d[1];
    fprintf(text, "\n%-13s t_g met in %.1f %%, bias %+.4f mm, %.2f ms a model\n", "", 100 * share, bias, 1000 * cpu);
    fprintf(text, "%-13s N_b <= %.0f: %s; t_g met in 85 %%: %s; d < sigma: %s; aim d <= %.3f: %s\n", "", paper[s].limit, few ? "yes" : "NO",
            enough ? "yes" : "NO", close ? "yes" : "NO", paper[s].d[1], aim ? "yes" : "no");
    cJSON_AddStringToObject(row, "shape", lim_trial_name[s]);
    json_range(row, "d_mm", d);
    json_range(row, "d_a_mm", approximate);
    json_range(row, "blobs", blobs);
    cJSON_AddNumberToObject(row, "paper_d_median_mm", paper[s].d[1]);
    cJSON_AddItemToObject(row, "median_d_over_sigma", levels);
    cJSON_AddNumberToObject(row, "share_met", share);
    cJSON_AddNumberToObject(row, "bias_mm", bias);
    cJSON_AddNumberToObject(row, "bound_shape_known_mm", known.median);
    cJSON_AddNumberToObject(row, "bound_blobs_free_mm", freely.median);
    cJSON_AddNumberToObject(row, "cpu_ms", 1000 * cpu);
    cJSON_AddBoolToObject(row, "limits_kept", few && enough && close);
    cJSON_AddBoolToObject(row, "aim_reached", aim);
    cJSON_AddItemToArray(rows, row);
    free(scratch);
    return few && enough && close;
}

static int table_3(const FitBench *bench, FILE *text, cJSON *root, Faults *faults)
{
    Table3 table = {.runs = bench->common.quick ? 6 : 30, .options = &bench->options};
    long count = (long)LIM_TRIAL_SHAPES * LEVELS * table.runs;
    bool good = true, kept = true;
    table.trial = calloc((size_t)count, sizeof *table.trial);
    table.failed = calloc((size_t)count, sizeof *table.failed);
    for (int s = 0; s < LIM_TRIAL_SHAPES; s++)
        good = (table.shape[s] = lim_trial_create(s)) != NULL && good;
    good = good && table.trial && table.failed;
    if (good)
        parallel_for(bench->common.threads, count, run_trial, &table, NULL);
    for (long i = 0; i < count && good; i++)
        good = !table.failed[i];
    if (good) {
        fprintf(text, "Table 3: 300 points, sigma 0.025 to 0.25 mm, t_g = 3 sigma, %d runs a level; min median max [mm]\n\n", table.runs);
        cJSON *rows = cJSON_AddArrayToObject(root, "table3");
        for (int s = 0; s < LIM_TRIAL_SHAPES; s++)
            kept = report_shape(&table, s, text, rows) && kept;
        fputs("\nBounds: p90 of the distance by which the same noise moves the surface in a least-squares fit that starts at the truth.\n", text);
    } else {
        faults_add(faults, "bench fit", 0, 0, "not enough memory");
    }
    for (int s = 0; s < LIM_TRIAL_SHAPES; s++)
        lim_trial_free(table.shape[s]);
    free(table.trial);
    free(table.failed);
    return !good ? EXIT_BAD_INPUT : kept ? EXIT_DONE : EXIT_DIFFERENT;
}

// --- Tables 4 and 5 ---

static double process_cpu_s(void)
{
    struct timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

// Triangles per blob. As in the paper: marching cubes of the tree's surface on the volume's grid. At equal error: equilateral triangles on each node's piece of
// tube whose sag in the middle of an edge, h^2 / (8 r), equals the model's d_a, i.e. a mesh as accurate as the model if it had no other error.
static bool count_triangles(const VesselTree *model, double voxel, double *on_grid, double *equal)
{
    TriangleMesh *mesh = isosurface_of_tree(model, voxel);
    *equal = 0;
    if (!mesh)
        return false;
    *on_grid = (double)mesh->triangle_count / (double)model->blob_count;
    triangle_mesh_free(mesh);
    for (int i = 0; i < model->node_count; i++) {
        int parent = model->parent[i];
        double r = model->radius[i], length = parent >= 0 ? fmin(vec3_distance(model->center[i], model->center[parent]), 2 * r) : r;
        double area = 2 * PI * r * length, edge2 = 8 * r * fmax(model->error[i], 1e-4 * r);
        *equal += area / (0.25 * sqrt(3) * edge2) / (double)model->blob_count;
    }
    return true;
}

static bool report_tree(const FitBench *bench, const VesselTree *tree, const char *name, double voxel, FILE *text, cJSON *rows, bool *kept, Faults *faults)
{
    static const struct {
        double voxels, paper[4], blobs, triangles;   // the paper's at N_s = 100
    } target[TARGETS] = {{1, {97.15, 2.60, 0.15, 0.09}, 9.5, 58}, {1.5, {88.65, 11.00, 0.25, 0.10}, 6.4, 104}, {2.5, {51.37, 47.67, 0.84, 0.12}, 3.9, 234}};
    static const int limit[LIMITS] = {30, 50, 100};
    fprintf(text, "\n%s: %d nodes, %lld points, voxel %.3f mm\n", name, tree->node_count, (long long)tree->point_count, voxel);
    fputs("  t_g    N_s |    C1     C2     C3     C4 % | blobs | triangles a blob: voxel grid, equal error | ms a model\n", text);
    for (int t = 0; t < TARGETS; t++) {
        for (int l = 0; l < LIMITS; l++) {
            if (bench->common.quick && (t != 1 || l != 2))
                continue;
            LimFitOptions options = bench->options;
            options.target_mm = target[t].voxels * voxel;
            options.voxel_mm = voxel;
            options.max_blobs = limit[l];
            options.threads = bench->common.threads;
            double begin = process_cpu_s(), share[4] = {0}, equal, on_grid;
            VesselTree *model = lim_fit(tree, &options, NULL, faults);
            if (!model)
                return false;
            double ms = 1000 * (process_cpu_s() - begin) / model->node_count, blobs = (double)model->blob_count / model->node_count;
            for (int i = 0; i < model->node_count; i++) {
                double e = model->error[i] / voxel;
                share[e < 0.5 ? 0 : e < 1 ? 1 : e < 2 ? 2 : 3] += 100.0 / model->node_count;
            }
            bool counted = count_triangles(model, voxel, &on_grid, &equal);
            vessel_tree_free(model);
            if (!counted) {
                faults_add(faults, "bench fit", 0, 0, "not enough memory");
                return false;
            }
            fprintf(text, "  %3.1f v  %3d | %6.2f %6.2f %6.2f %6.2f | %5.2f | %6.1f %6.1f | %.2f\n", target[t].voxels, limit[l], share[0], share[1], share[2],
                    share[3], blobs, on_grid, equal, ms);
            if (l == LIMITS - 1) {
                fprintf(text, "  paper   100 | %6.2f %6.2f %6.2f %6.2f | %5.2f | %6.0f        |\n", target[t].paper[0], target[t].paper[1], target[t].paper[2],
                        target[t].paper[3], target[t].blobs, target[t].triangles);
                if (t == 1)
                    *kept = *kept && share[0] + share[1] >= 99 && share[0] >= 97 && blobs <= 6.4;
            }
            cJSON *row = cJSON_CreateObject(), *classes = cJSON_CreateDoubleArray(share, 4);
            cJSON_AddStringToObject(row, "tree", name);
            cJSON_AddNumberToObject(row, "target_voxels", target[t].voxels);
            cJSON_AddNumberToObject(row, "max_blobs", limit[l]);
            cJSON_AddItemToObject(row, "classes_percent", classes);
            cJSON_AddNumberToObject(row, "blobs_a_node", blobs);
            cJSON_AddNumberToObject(row, "triangles_a_blob_equal_error", equal);
            cJSON_AddNumberToObject(row, "triangles_a_blob_voxel_grid", on_grid);
            cJSON_AddNumberToObject(row, "cpu_ms_a_model", ms);
            cJSON_AddItemToArray(rows, row);
        }
    }
    return true;
}

// The tree of the scene's angiogram; NULL without a fault if the angiogram is missing.
static VesselTree *segment_aneurism(int threads, Faults *faults)
{
    static const char volume_path[] = "../shared/data/aneurism.nrrd", trace_path[] = "scenes/aneurism/trace.yaml";
    if (access(volume_path, R_OK) != 0 || access(trace_path, R_OK) != 0)
        return NULL;
    Volume *volume = volume_load(volume_path, faults);
    Trace *trace = trace_load(trace_path, faults);
    VesselTree *tree = NULL;
    if (volume && trace)
        tree = rbt_track(volume, &trace->parameters, trace->branch, trace->branch_count, trace->aneurysm, trace->aneurysm_count, threads, NULL, NULL,
                         trace_path, faults);
    volume_free(volume);
    trace_free(trace);
    return tree;
}

// The paper's average patient: models of 540 points and 10 blobs. Five nodes of a noisy arc, fitted until there are 10 blobs; the smallest time of some runs.
static bool time_model(const FitBench *bench, FILE *text, cJSON *root, Faults *faults)
{
    enum { MIDDLE = 8, RUNS = 15, BLOBS = 10 };
    static const char option[2][2][64] = {{"noise_mm", "0.03"}, {"seed", "3"}};
    VesselTree *tree = shape_tree("arc", 2, option, "bench fit", faults);
    if (!tree)
        return false;
    int64_t first = tree->point_offset[MIDDLE - 2], count = tree->point_offset[MIDDLE + 3] - first;
    LimFitTask task = {.point_count = (int)count,
                       .point = tree->point + first,
                       .center = tree->center[MIDDLE],
                       .direction = tree->direction[MIDDLE],
                       .radius = tree->radius[MIDDLE]};
    LimFitOptions options = bench->options;
    options.target_mm = 1e-4;   // out of reach
    options.max_blobs = BLOBS;
    options.give_up_splits = 0;
    Vec3 center[BLOBS + 1];
    double width[BLOBS + 1], least = HUGE_VAL;
    int blobs = 0;
    for (int run = 0; run < RUNS; run++) {
        struct timespec begin, end;
        clock_gettime(CLOCK_THREAD_CPUTIME_ID, &begin);
        blobs = lim_fit_model(&task, &options, center, width);
        clock_gettime(CLOCK_THREAD_CPUTIME_ID, &end);
        least = fmin(least, 1e3 * (double)(end.tv_sec - begin.tv_sec) + 1e-6 * (double)(end.tv_nsec - begin.tv_nsec));
    }
    vessel_tree_free(tree);
    fprintf(text, "\none local model of %lld points, from 2 to %d blobs: %.2f ms of one core, least of %d runs\n", (long long)count, blobs, least, RUNS);
    cJSON *row = cJSON_AddObjectToObject(root, "one_model");
    cJSON_AddNumberToObject(row, "points", (double)count);
    cJSON_AddNumberToObject(row, "blobs", blobs);
    cJSON_AddNumberToObject(row, "cpu_ms", least);
    if (blobs == 0)
        faults_add(faults, "bench fit", 0, 0, "not enough memory");
    return blobs > 0;
}

static int tables_45(const FitBench *bench, FILE *text, cJSON *root, Faults *faults)
{
    static const struct {
        const char *name, *shape, option[3][2][64];
    } synthetic[] = {{"random tree of 51 branches, 0.04 mm of noise", "tree", {{"noise_mm", "0.04"}, {"branches", "51"}, {"sacs", "1"}}},
                     {"phantom, 0.02 mm of noise", "phantom", {{"noise_mm", "0.02"}, {"seed", "5"}, {"spacing", "0.5"}}}};
    cJSON *rows = cJSON_AddArrayToObject(root, "tables45");
    bool kept = true, good = true;
    fprintf(text, "Tables 4 and 5: classes of d_a (under half a voxel, under one, under two, more); %s\n", simd_name[simd_level()]);
    if (bench->tree_count == 0) {
        VesselTree *tree = segment_aneurism(bench->common.threads, faults);
        good = faults->count == 0;
        if (tree)
            good = report_tree(bench, tree, "scenes/aneurism", 0.4, text, rows, &kept, faults);
        else if (good)
            fputs("\n../shared/data/aneurism.nrrd is not here: its table is skipped\n", text);
        vessel_tree_free(tree);
    }
    for (size_t i = 0; i < sizeof synthetic / sizeof synthetic[0] && bench->tree_count == 0 && good; i++) {
        VesselTree *tree = shape_tree(synthetic[i].shape, 3, synthetic[i].option, "bench fit", faults);
        good = tree && report_tree(bench, tree, synthetic[i].name, 0.2, text, rows, &kept, faults);
        vessel_tree_free(tree);
    }
    for (int i = 0; i < bench->tree_count && good; i++) {
        TreeFileInfo info = {0};
        VesselTree *tree = tree_file_load(bench->tree[i], &info, faults);
        good = tree && report_tree(bench, tree, bench->tree[i], tree_file_number(&info, "voxel_mm", 0.2), text, rows, &kept, faults);
        vessel_tree_free(tree);
        tree_file_info_free(&info);
    }
    good = good && time_model(bench, text, root, faults);
    if (good)
        fprintf(text, "\nat 1.5 voxels: 99 %% under one voxel, 97 %% under half, at most 6.4 blobs a node: %s\n", kept ? "yes" : "NO");
    return !good ? EXIT_BAD_INPUT : kept ? EXIT_DONE : EXIT_DIFFERENT;
}

static int call(void *options, Faults *faults)
{
    FitBench *bench = options;
    OutputPlan plan = {.faults = faults};
    output_plan_write(&plan, "--json", bench->common.json);
    for (int i = 0; i < bench->tree_count; i++)
        output_plan_read(&plan, "--tree", bench->tree[i]);
    if (faults->count > 0)
        return EXIT_BAD_INPUT;
    cJSON *root = cJSON_CreateObject();
    FILE *text = bench_text(&bench->common);
    int code = bench->table3 ? table_3(bench, text, root, faults) : tables_45(bench, text, root, faults);
    if (code != EXIT_BAD_INPUT && !bench_write_json(&bench->common, root, faults))
        code = EXIT_BAD_INPUT;
    cJSON_Delete(root);
    return code;
}

static const char *const presets[] = {"default", "paper", NULL};
static const Option options[] = {
    {"table3", NULL, OPTION_FLAG, OPTION_AT(FitBench, table3),
     "one local model of 300 noisy points, four shapes, 10 levels of noise, 30 runs each (section 5.3.2), with the limit of least squares; exit code 1 if a "
     "median "
     "of blobs, the share that meets t_g, or d compared with the noise misses its limit"},
    {"tables45", NULL, OPTION_FLAG, OPTION_AT(FitBench, tables45),
     "whole trees for t_g of 1, 1.5, 2.5 voxels and N_s of 30, 50, 100: classes of d_a, blobs per node, triangles per blob, time; the angiogram of "
     "scenes/aneurism (segmented first, if it is in ../shared/data), a random tree and the phantom; and the time of one local model of 540 points and 10 "
     "blobs"},
    {"tree", "F.h5", OPTION_FILE, OPTION_AT(FitBench, tree), "for --tables45, instead: a tree of points (`segment`, `synth`); may be given several times",
     .count = offsetof(FitBench, tree_count), .times = MOST_TREES},
    {"preset", "NAME", OPTION_CHOICE, OPTION_AT(FitBench, preset), "default, or paper: the published values and method", .choices = presets, .otherwise = ""},
    BENCH_OPTIONS(FitBench, common, "6 runs per level; only t_g of 1.5 voxels and N_s of 100"),
};

static const char *check(void *structure)
{
    FitBench *bench = structure;
    bench->options = bench->preset == 0 ? lim_fit_default_options() : lim_fit_paper_options();
    return bench->table3 == bench->tables45 ? "give either --table3 or --tables45" : NULL;
}

static const OptionTable table = {
    .program = "seldinger bench fit",
    .does = "local models: the paper's tables 3, 4 and 5 with its figures",
    .intro = "Tables 3, 4 and 5 of Kerrien et al. 2017 with the paper's figures.",
    .usage = "--table3 [options]\n--tables45 [--tree TREE.h5]... [options]",
    .exits = "0 done; 1 a limit is missed; 2 wrong usage or bad input",
    CLI_OPTIONS(options, FitBench),
    .check = check,
    .too_many = "unexpected argument ",
};

const Verb bench_fit = {.options = &table, .call = call};
