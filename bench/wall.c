// seldinger bench wall: measurements of the wall of fitted trees in one table, each line with its required and desired value.
//
// Trees and models are given on the command line, or made by the program `seldinger` in this program's folder, with the commands of a user (which are printed).
#include "bench/wall_measures.h"

#include "base/heap.h"
#include "base/output.h"
#include "base/simd.h"
#include "bench/wall_runs.h"
#include "cli/output_plan.h"
#include "recon/fit/model_measure.h"
#include "recon/tree_file.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { CLICK, FIVE, ARCH, NAMED, MODELS_MOST = NAMED + 8, PATH = 512 };
enum { JUMPS, POINTS, TRUTH, NOISE, BLOBS, FIT, JUNCTIONS, FLOOD, SPREAD, STIFF, SPIRAL, PUSH, STEP, ROWS };

static const char *const row_names[ROWS] = {"jumps", "points", "truth", "noise",  "blobs", "fit", "junctions",
                                            "flood", "spread", "stiff", "spiral", "push",  "step"};

typedef struct WallLimits {
    double must, aim;        // NAN: none
    bool at_least;           // otherwise: at most
} WallLimits;

typedef struct WallLine {
    char row[24], on[32], what[64], unit[16], note[160];
    double value;            // NAN: could not be measured; the note gives the reason
    WallLimits limits;
} WallLine;

typedef struct WallTable {
    int count, capacity;
    WallLine *line;
    FILE *out;
    const char *row, *on;    // of the lines that are added
} WallTable;

typedef struct WallModel {
    char name[32], tree[PATH], path[PATH];   // "" where there is none
    VesselTree *model;
    WallCost cost;           // of the fit; cpu_s 0: the model was given
    double point_must, point_aim;            // NAN
    double wire_mm;          // diameter of the stiff wire
} WallModel;

typedef struct WallBench {
    BenchOptions common;
    const char *tree[NAMED], *folder;    // of the command line
    char **named;
    int named_count;
    bool any_given, wanted[ROWS];
    int seeds;
    char work[PATH];
    bool owns_work;
    WallModel model[MODELS_MOST];
    int model_count;
    WallTable table;
} WallBench;

static const WallLimits NO_LIMITS = {NAN, NAN, false};

// --- The table ---

static const char *verdict(const WallLine *line)
{
    const WallLimits *l = &line->limits;
    if (isnan(l->must))
        return "";
    if (isnan(line->value))
        return "MISSED";
    return (l->at_least ? line->value >= l->aim : line->value <= l->aim)     ? "aim"
           : (l->at_least ? line->value >= l->must : line->value <= l->must) ? "must"
                                                                             : "MISSED";
}

static void format_limit(char text[16], double value)
{
    if (isnan(value))
        snprintf(text, 16, "-");
    else
        snprintf(text, 16, "%.4g", value);
}

// Adds a line and prints it. `note` may be NULL.
static void wall_add(WallTable *table, const char *what, double value, const char *unit, WallLimits limits, const char *note)
{
    if (table->count == table->capacity) {
        int capacity = 2 * table->capacity + 64;
        table->line = HEAP_GROWN(table->line, (size_t)capacity, sizeof *table->line);
        table->capacity = capacity;
    }
    WallLine *line = &table->line[table->count++];
    *line = (WallLine){.value = value, .limits = limits};
    snprintf(line->row, sizeof line->row, "%s", table->row);
    snprintf(line->on, sizeof line->on, "%s", table->on);
    snprintf(line->what, sizeof line->what, "%s", what);
    snprintf(line->unit, sizeof line->unit, "%s", unit);
    snprintf(line->note, sizeof line->note, "%s", note ? note : "");
    char must[16], aim[16];
    format_limit(must, limits.must);
    format_limit(aim, limits.aim);
    fprintf(table->out, "%-10s %-22s %-34s %10.4g %-7s %8s %8s  %-6s %s\n", line->row, line->on, line->what, value, line->unit, must, aim, verdict(line),
            line->note);
    fflush(table->out);
}

// Prints that a row is skipped, and why.
static void wall_skip(WallTable *table, const char *why) { fprintf(table->out, "%-10s %-22s left out: %s\n", table->row, table->on, why); }

// --- Trees and models ---

static void work_path(const WallBench *bench, const char *name, const char *ending, char path[PATH])
{
    snprintf(path, PATH, "%.400s/%.60s%s", bench->work, name, ending);
}

static void print_command(const WallBench *bench, const char *const *argv)
{
    fprintf(bench->table.out, "  $ seldinger");
    for (int i = 0; argv[i]; i++)
        fprintf(bench->table.out, " %s", argv[i]);
    fprintf(bench->table.out, "\n");
    fflush(bench->table.out);
}

static bool command(const WallBench *bench, const char *const *argv, WallCost *cost, Faults *faults)
{
    print_command(bench, argv);
    return wall_command(argv, cost, faults);
}

static bool fit(const WallBench *bench, const char *tree, const char *model, WallCost *cost, Faults *faults)
{
    char threads[16];
    snprintf(threads, sizeof threads, "%d", bench->common.threads);
    return command(bench, (const char *const[]){"fit", tree, "-o", model, "--quiet", "--threads", threads, NULL}, cost, faults);
}

static bool open_model(WallBench *bench, WallModel *m, Faults *faults)
{
    const char *given = *m->path ? m->path : m->tree;
    VesselTree *tree = tree_file_load(given, NULL, faults);
    if (tree && vessel_tree_is_model(tree)) {
        if (m->path != given)
            snprintf(m->path, PATH, "%s", given);
        m->model = tree;
        return true;
    }
    vessel_tree_free(tree);
    if (!tree)
        return false;
    if (given != m->tree)
        snprintf(m->tree, PATH, "%s", given);
    char path[PATH], name[48];
    snprintf(name, sizeof name, "model-%d", (int)(m - bench->model));
    work_path(bench, name, ".h5", path);
    if (!fit(bench, m->tree, path, &m->cost, faults))
        return false;
    snprintf(m->path, PATH, "%s", path);
    m->model = tree_file_load(m->path, NULL, faults);
    return m->model != NULL;
}

// The default trees of the table, if their data is available and no files were given.
static bool make_tree(WallBench *bench, int which, Faults *faults)
{
    static const char volume[] = "../shared/data/aneurism.nrrd", trace[] = "scenes/aneurism/trace.yaml", arch[] = "out/arch-tree.h5";
    WallModel *m = &bench->model[which];
    bench->table.row = "tree";
    bench->table.on = m->name;
    if (which == ARCH) {
        if (access(arch, R_OK) == 0)
            snprintf(m->tree, PATH, "%s", arch);
        else
            wall_skip(&bench->table, "out/arch-tree.h5 is not here; scenes/arch/prepare makes it");
        return true;
    }
    if (access(volume, R_OK) != 0) {
        wall_skip(&bench->table, "../shared/data/aneurism.nrrd is not here");
        return true;
    }
    char path[PATH];
    work_path(bench, which == CLICK ? "click" : "five", "-tree.h5", path);
    if (!command(bench,
                 which == CLICK ? (const char *const[]){"segment", volume, "--start", "74.8,12.8,60.8", "-o", path, "--quiet", NULL}
                                : (const char *const[]){"segment", volume, "--trace", trace, "-o", path, "--quiet", NULL},
                 NULL, faults))
        return false;
    snprintf(m->tree, PATH, "%s", path);
    return true;
}

static bool open_models(WallBench *bench, Faults *faults)
{
    static const char *const names[NAMED] = {"one click", "five branches", "arch"};
    static const double must[NAMED] = {0.022, 0.020, 0.05}, aim[NAMED] = {0.018, 0.015, 0.03};
    for (int k = 0; k < bench->model_count; k++) {
        WallModel *m = &bench->model[k];
        m->point_must = k < NAMED ? must[k] : NAN;
        m->point_aim = k < NAMED ? aim[k] : NAN;
        m->wire_mm = k == ARCH ? 0.89 : 0.36;
        if (k < NAMED)
            snprintf(m->name, sizeof m->name, "%s", names[k]);
        if (k < NAMED && !*m->tree && !*m->path && !bench->any_given && !make_tree(bench, k, faults))
            return false;
        if ((*m->tree || *m->path) && !open_model(bench, m, faults))
            return false;
    }
    return true;
}

// --- Rows of one model ---

static void row_jumps(WallBench *bench, const WallModel *m)
{
    ModelMeasure measure;
    if (!model_measure(&(ModelField){.tree = m->model}, NULL, bench->common.threads, &measure))
        return;
    double raw_p99 = 0, raw = 0, gap = 0, cold = 0, normal = 0, unit_most = 0;
    int joins = 0;
    for (int p = 0; p < PLACES; p++) {
        raw_p99 = fmax(raw_p99, measure.raw[p].gap_p99);
        raw = fmax(raw, measure.raw[p].gap_most);
        gap = fmax(gap, measure.met[p].gap_most);
        cold = fmax(cold, measure.cold[p].gap_most);
        normal = fmax(normal, measure.met[p].normal_p99);
        unit_most = fmax(unit_most, measure.met[p].normal_most);
        joins += measure.raw[p].count;
    }
    char note[96];
    snprintf(note, sizeof note, "%d joins, worst kind of place; normal's max %.3g rad", joins, unit_most);
    wall_add(&bench->table, "raw jump of gap, p99", raw_p99, "mm", (WallLimits){1e-4, 1e-5, false}, note);
    wall_add(&bench->table, "raw jump of gap, max", raw, "mm", (WallLimits){0.01, 1e-3, false}, NULL);
    snprintf(note, sizeof note, "from scratch on either side %.3g", cold);
    wall_add(&bench->table, "jump as met, gap, max", gap, "mm", (WallLimits){0.01, 0.001, false}, note);
    wall_add(&bench->table, "jump as met, normal, p99", normal, "rad", (WallLimits){0.02, 0.005, false}, NULL);
}

static void row_points(WallBench *bench, const WallModel *m)
{
    PointFigures f;
    char note[96];
    if (m->model->point_count < 1 || !wall_points(m->model, &f)) {
        wall_skip(&bench->table, "the model has no points");
        return;
    }
    snprintf(note, sizeof note, "p99 %.3f, max %.2f mm of %d points, %d unsure", f.p99, f.most, f.count, f.unsure);
    wall_add(&bench->table, "points to wall, mean", f.mean, "mm", (WallLimits){m->point_must, m->point_aim, false}, note);
}

static void row_blobs(WallBench *bench, const WallModel *m, bool is_click)
{
    char note[64];
    double length = vessel_tree_length(m->model);
    snprintf(note, sizeof note, "%lld on %.0f mm", (long long)m->model->blob_count, length);
    wall_add(&bench->table, "blobs a mm", (double)m->model->blob_count / fmax(length, 1e-9), "", is_click ? (WallLimits){8.5, 6, false} : NO_LIMITS, note);
}

static void row_fit(WallBench *bench, const WallModel *m, bool is_click)
{
    char note[64];
    if (!(m->cost.cpu_s > 0)) {
        wall_skip(&bench->table, "it came as a model");
        return;
    }
    snprintf(note, sizeof note, "wall %.1f s", m->cost.wall_s);
    wall_add(&bench->table, "fit, CPU of all threads over 2", m->cost.cpu_s / 2, "s", is_click ? (WallLimits){20, 8, false} : NO_LIMITS, note);
}

static void row_junctions(WallBench *bench, const Reach *reach)
{
    char note[128];
    snprintf(note, sizeof note, "of %d; %d more over links longer than their radii; %d with less than %.2f mm (%d of these apart)", reach->junction_count,
             reach->capped_apart, reach->narrow, reach->options.tool_radius, reach->narrow_apart);
    wall_add(&bench->table, "junctions capped", reach->capped - reach->capped_apart, "", (WallLimits){0, 0, false}, note);
    snprintf(note, sizeof note, "of %d longer than the sum of their radii, where no vessel is seen", reach->apart_links);
    wall_add(&bench->table, "links apart that are open", reach->apart_open, "", (WallLimits){0, 0, false}, note);
}

static void row_flood(WallBench *bench, const Reach *reach)
{
    double per = 100 / fmax(reach->length, 1e-9);
    char note[96];
    snprintf(note, sizeof note, "of %.0f mm; %d places shut, %.0f mm behind links apart", reach->length, reach->stop_count, reach->apart_length);
    wall_add(&bench->table, "reached by a point", per * reach->reached[REACH_POINT], "%", (WallLimits){99, 99.9, true}, note);
    wall_add(&bench->table, "by a tool of 0.18 mm on the line", per * reach->reached[REACH_TOOL], "%", NO_LIMITS, NULL);
    wall_add(&bench->table, "by it up to 0.5 r aside", per * reach->reached[REACH_ASIDE], "%", (WallLimits){95, 98, true}, NULL);
}

static bool row_stiff(WallBench *bench, const WallModel *m, Faults *faults)
{
    static const StiffRun runs[] = {{50, 0.04}, {50, 0.1}, {50, 0.15}, {30, 0.04}, {30, 0.1}, {30, 0.15}};
    Vessel *vessel = model_vessel_create(m->model);
    bool good = vessel;
    for (size_t k = 0; good && k < sizeof runs / sizeof runs[0]; k++) {
        StiffFigures f;
        char what[64], note[128];
        double seconds = bench->common.quick ? 1 : 3;
        good = wall_stiff_run(vessel, m->wire_mm, fmax(160, runs[k].speed_mm_s * seconds + 10), seconds, runs[k], &f, faults);
        if (!good)
            break;
        snprintf(what, sizeof what, "%.0f mm/s, mu %.2f: deepest", runs[k].speed_mm_s, runs[k].friction);
        int n = snprintf(note, sizeof note, "%.1f of %.1f mm in%s, push to %.2f N", f.in_mm, f.fed_mm, f.all_in ? "" : ", STOPPED", f.push_max_n);
        for (int bit = 0; bit < STEP_FLAG_COUNT && n < 100; bit++)
            if (f.flags >> bit & 1)
                n += snprintf(note + n, sizeof note - (size_t)n, ", %s", step_flag_name[bit]);
        wall_add(&bench->table, what, f.deepest_mm, "mm", (WallLimits){0.05, 0.02, false}, note);
        wall_add(&bench->table, "  left outside of what was fed", f.fed_mm - f.in_mm, "mm", (WallLimits){0.1, 0.1, false}, NULL);
    }
    if (vessel)
        vessel->destroy(vessel);
    return good;
}

static bool rows_of_model(WallBench *bench, const WallModel *m, Faults *faults)
{
    bool is_click = m == &bench->model[CLICK], good = true;
    Reach *reach = NULL;
    bench->table.on = m->name;
    if (bench->wanted[JUNCTIONS] || bench->wanted[FLOOD]) {
        ReachOptions options = reach_default_options();
        reach = reach_create(&(ModelField){.tree = m->model}, &options);
        if (!reach)
            faults_add(faults, m->path, 0, 0, "not enough memory to flood the model");
        good = reach != NULL;
    }
    for (int row = 0; row < ROWS && good; row++) {
        bench->table.row = row_names[row];
        if (!bench->wanted[row])
            continue;
        switch (row) {
        case JUMPS: row_jumps(bench, m); break;
        case POINTS: row_points(bench, m); break;
        case BLOBS: row_blobs(bench, m, is_click); break;
        case FIT: row_fit(bench, m, is_click); break;
        case JUNCTIONS: row_junctions(bench, reach); break;
        case FLOOD: row_flood(bench, reach); break;
        case STIFF: good = row_stiff(bench, m, faults); break;
        default: break;
        }
    }
    reach_free(reach);
    return good;
}

// --- Rows of synthetic shapes ---

// `synth SHAPE options… -o tree`, fitted; loads the model. `options` ends with NULL.
static VesselTree *fit_synth(WallBench *bench, const char *name, const char *const *options, char model[PATH], Faults *faults)
{
    enum { MOST = 20 };
    char tree[PATH];
    const char *argv[MOST] = {"synth"};
    int count = 1;
    work_path(bench, name, "-tree.h5", tree);
    work_path(bench, name, ".h5", model);
    for (int i = 0; options[i] && count < MOST - 4; i++)
        argv[count++] = options[i];
    argv[count++] = "-o", argv[count++] = tree, argv[count++] = "--quiet", argv[count] = NULL;
    if (!command(bench, argv, NULL, faults) || !fit(bench, tree, model, NULL, faults))
        return NULL;
    return tree_file_load(model, NULL, faults);
}

static bool row_truth(WallBench *bench, bool noisy, Faults *faults)
{
    char path[PATH];
    VesselTree *model = fit_synth(bench, noisy ? "phantom-noisy" : "phantom",
                                  noisy ? (const char *const[]){"phantom", "--noise-mm", "0.05", NULL} : (const char *const[]){"phantom", NULL}, path, faults);
    Shape *shape = model ? shape_create("phantom", 0, NULL, "bench wall", faults) : NULL;
    ModelMeasure measure;
    bool good = shape && model_measure(&(ModelField){.tree = model}, shape, bench->common.threads, &measure);
    if (good) {
        const WallRow *tube = &measure.wall[PLACE_TUBE], *fork = &measure.wall[PLACE_BIFURCATION], *sac = &measure.wall[PLACE_SAC];
        char note[64];
        snprintf(note, sizeof note, "worst %.0f um, bias %.1f um; %lld blobs", 1000 * tube->most, 1000 * tube->bias, (long long)model->blob_count);
        wall_add(&bench->table, "tube, rms", 1000 * tube->rms, "um", noisy ? (WallLimits){12, 8, false} : (WallLimits){3, 2, false}, note);
        wall_add(&bench->table, "bifurcation, rms", 1000 * fork->rms, "um", noisy ? NO_LIMITS : (WallLimits){6, 3, false}, NULL);
        wall_add(&bench->table, "bifurcation, worst", 1000 * fork->most, "um", noisy ? NO_LIMITS : (WallLimits){40, 20, false}, NULL);
        snprintf(note, sizeof note, "worst %.0f um, bias %.1f um", 1000 * sac->most, 1000 * sac->bias);
        wall_add(&bench->table, "sac, rms", 1000 * sac->rms, "um", noisy ? (WallLimits){12, 8, false} : (WallLimits){7, 5, false}, note);
    }
    shape_free(shape);
    vessel_tree_free(model);
    return good;
}

static void judge_synth(WallBench *bench, const VesselTree *model, const Shape *truth, double slack)
{
    ReachOptions options = reach_default_options();
    Reach *reach = reach_create(&(ModelField){.tree = model}, &options);
    if (!reach)
        return;
    TruthFigures f = wall_judge_junctions(model, reach, truth, slack);
    char note[96];
    snprintf(note, sizeof note, "of %d true ones; a point reaches %.1f %%, a tool aside %.1f %%", f.junctions - f.false_links,
             100 * reach->reached[REACH_POINT] / fmax(reach->length, 1e-9), 100 * reach->reached[REACH_ASIDE] / fmax(reach->length, 1e-9));
    wall_add(&bench->table, "true junctions capped", f.capped, "", (WallLimits){0, 0, false}, note);
    snprintf(note, sizeof note, "of %d false ones", f.false_links);
    wall_add(&bench->table, "false links opened", f.false_open, "", (WallLimits){0, 0, false}, note);
    reach_free(reach);
}

// Trees with known truth: from exact samples, and from a click on their angiograms.
static bool row_synth_junctions(WallBench *bench, Faults *faults)
{
    bool good = true;
    for (int seed = 1; seed <= (bench->common.quick ? 1 : 3) && good; seed++)
        for (int image = 0; image < (bench->common.quick ? 1 : 2) && good; image++) {
            char number[16], name[48], path[PATH], tree[PATH], volume[PATH], start[96], voxel[] = "0.2";
            snprintf(number, sizeof number, "%d", seed);
            snprintf(name, sizeof name, "synth-%d%s", seed, image ? "-image" : "");
            char label[32];
            snprintf(label, sizeof label, "synth tree %d%s", seed, image ? ", image" : "");
            bench->table.on = label;
            const char option[2][2][64] = {{"branches", "51"}, {"seed", ""}};
            char options[2][2][64];
            memcpy(options, option, sizeof options);
            snprintf(options[1][1], 64, "%d", seed);
            Shape *shape = shape_create("tree", 2, (const char(*)[2][64])options, "bench wall", faults);
            VesselTree *model = NULL;
            if (shape && !image) {
                model = fit_synth(bench, name, (const char *const[]){"tree", "--branches", "51", "--seed", number, NULL}, path, faults);
            } else if (shape) {
                VesselTree *truth = shape_sample(shape, faults);
                work_path(bench, name, ".nrrd", volume);
                work_path(bench, name, "-tree.h5", tree);
                work_path(bench, name, ".h5", path);
                Vec3 at = truth ? vec3_add_scaled(truth->center[0], 2 * truth->radius[0], truth->direction[0]) : vec3(0, 0, 0);
                snprintf(start, sizeof start, "%.4f,%.4f,%.4f", at.x, at.y, at.z);
                vessel_tree_free(truth);
                const char *const synth[] = {"synth", "tree", "--branches", "51", "--seed", number, "--voxel-mm", voxel, "-o", volume, "--quiet", NULL};
                if (command(bench, synth, NULL, faults) &&
                    command(bench, (const char *const[]){"segment", volume, "--start", start, "-o", tree, "--quiet", NULL}, NULL, faults) &&
                    fit(bench, tree, path, NULL, faults))
                    model = tree_file_load(path, NULL, faults);
            }
            good = model != NULL;
            if (good)
                judge_synth(bench, model, shape, image ? 0.3 : 0.02);
            vessel_tree_free(model);
            shape_free(shape);
        }
    return good;
}

// --- Spread ---

static void add_spread(WallBench *bench, int count, const double *blobs, const double *flood)
{
    double least = HUGE_VAL, most = 0, mean = 0, low = HUGE_VAL, high = 0;
    for (int k = 0; k < count; k++) {
        least = fmin(least, blobs[k]), most = fmax(most, blobs[k]), mean += blobs[k] / count;
        low = fmin(low, flood[k]), high = fmax(high, flood[k]);
    }
    char note[96];
    snprintf(note, sizeof note, "%.0f to %.0f in %d fits", least, most, count);
    wall_add(&bench->table, "spread of blobs", 100 * (most - least) / mean, "%", (WallLimits){5, 2, false}, note);
    snprintf(note, sizeof note, "%.2f to %.2f %% by a tool aside", low, high);
    wall_add(&bench->table, "spread of flood", high - low, "%", (WallLimits){1, 0.3, false}, note);
}

static bool row_spread(WallBench *bench, const WallModel *m, Faults *faults)
{
    double blobs[20], flood[20];
    bool good = true;
    for (int seed = 0; seed < bench->seeds && good; seed++) {
        char tree[PATH], path[PATH];
        VesselTree *model = NULL;
        if (m) {
            work_path(bench, "spread", "-tree.h5", tree);
            work_path(bench, "spread", ".h5", path);
            // a tenth of a voxel: the shift of an edge between noise realisations
            good = wall_write_jittered(m->tree, 0.02, (uint64_t)seed + 1, tree, faults) && fit(bench, tree, path, NULL, faults);
            model = good ? tree_file_load(path, NULL, faults) : NULL;
        } else {
            // the positions of the samples must not change, so the noise is added here
            char exact[PATH];
            work_path(bench, "spread", "-exact.h5", exact);
            work_path(bench, "spread", "-tree.h5", tree);
            work_path(bench, "spread", ".h5", path);
            good = seed > 0 || command(bench, (const char *const[]){"synth", "tree", "--branches", "51", "-o", exact, "--quiet", NULL}, NULL, faults);
            good = good && wall_write_jittered(exact, 0.04, (uint64_t)seed + 1, tree, faults) && fit(bench, tree, path, NULL, faults);
            model = good ? tree_file_load(path, NULL, faults) : NULL;
        }
        ReachOptions options = reach_default_options();
        Reach *reach = model ? reach_create(&(ModelField){.tree = model}, &options) : NULL;
        good = reach != NULL;
        if (good) {
            blobs[seed] = (double)model->blob_count;
            flood[seed] = 100 * reach->reached[REACH_ASIDE] / fmax(reach->length, 1e-9);
        }
        reach_free(reach);
        vessel_tree_free(model);
    }
    if (good)
        add_spread(bench, bench->seeds, blobs, flood);
    return good;
}

// --- Forces at the hand, and the time of a step ---

static bool row_felt(WallBench *bench, bool spiral, Faults *faults)
{
    char path[PATH], note[112];
    PushFelt felt;
    const char *name = spiral ? "spiral" : "phantom-push";
    VesselTree *model = fit_synth(bench, name, spiral ? (const char *const[]){"spiral", NULL} : (const char *const[]){"phantom", NULL}, path, faults);
    bool good = model && wall_push_felt(spiral ? "scenes/collision/spiral.yaml" : "scenes/collision/phantom.yaml", path, &felt, faults);
    vessel_tree_free(model);
    if (!good)
        return false;
    bench->table.on = spiral ? "spiral" : "phantom";
    snprintf(note, sizeof note, "without friction; %.3g %% on the exact wall%s", 100 * felt.exact_rms, felt.survived ? "" : "; the run failed before its end");
    if (spiral)
        wall_add(&bench->table, felt.over_exact < 0 ? "push below exact" : "push over exact", 100 * fabs(felt.over_exact), "%", (WallLimits){3, 0.5, false},
                 note);
    else
        wall_add(&bench->table, "change of push a step over mean", 100 * felt.change_rms, "%", (WallLimits){1, 0.3, false}, note);
    return true;
}

static bool time_scene(WallBench *bench, const char *scene_path, const VesselTree *model, Faults *faults)
{
    SimdLevel widest = simd_level();
    bool good = true;
    for (int level = (int)widest; level >= SIMD_AVX2 && good; level--) {
        simd_force((SimdLevel)level);
        Scene *scene = scene_load(scene_path, faults);
        OpenVessel open = {.vessel = model_vessel_create(model)};
        StepFigures run;
        double detection = 0;
        int points = 0;
        char what[64], note[96];
        good = scene && open.vessel && open_vessel_inlet(scene, &open, faults) && bench_run(scene, open.vessel, INT64_MAX, NULL, &run, faults);
        if (good) {
            bench_detection(scene, open.vessel, run.crowded_step, &detection, &points, faults);
            snprintf(what, sizeof what, "80 points near the wall, %s", simd_name[level]);
            snprintf(note, sizeof note, "%.2f us for %d points", detection, points);
            wall_add(&bench->table, what, detection * 80 / fmax(1, points), "us",
                     level == SIMD_AVX512 ? (WallLimits){5.5, 4, false} : (WallLimits){7, 5, false}, note);
        }
        if (good && level == (int)widest && !strcmp(bench->table.on, "five branches")) {
            snprintf(note, sizeof note, "p99 %.0f, max %.0f us; deepest %.0f um", run.step_us.p99, run.step_us.max, run.penetration_um.max);
            wall_add(&bench->table, "whole step, median", run.step_us.median, "us", (WallLimits){80, 60, false}, note);
            wall_add(&bench->table, "whole step, p99.9", run.step_us.p999, "us", (WallLimits){600, 400, false}, NULL);
        }
        if (open.vessel)
            open.vessel->destroy(open.vessel);
        scene_free(scene);
    }
    simd_force(widest);
    return good;
}

static bool row_step(WallBench *bench, Faults *faults)
{
    char path[PATH];
    VesselTree *phantom = fit_synth(bench, "phantom-step", (const char *const[]){"phantom", NULL}, path, faults);
    bench->table.on = "phantom";
    bool good = phantom && time_scene(bench, "scenes/phantom/scene.yaml", phantom, faults);
    vessel_tree_free(phantom);
    bench->table.on = "five branches";
    if (good && bench->model[FIVE].model)
        good = time_scene(bench, "scenes/aneurism/sac.yaml", bench->model[FIVE].model, faults);
    else if (good)
        wall_skip(&bench->table, "no such model");
    return good;
}

static bool rows_of_shapes(WallBench *bench, Faults *faults)
{
    bool good = true;
    for (int row = 0; row < ROWS && good; row++) {
        if (!bench->wanted[row])
            continue;
        bench->table.row = row_names[row];
        bench->table.on = row == NOISE ? "phantom, 0.05 mm" : "phantom";
        switch (row) {
        case TRUTH: good = row_truth(bench, false, faults); break;
        case NOISE: good = row_truth(bench, true, faults); break;
        case JUNCTIONS: good = (bench->any_given && bench->common.quick) || row_synth_junctions(bench, faults); break;
        case SPREAD:
            bench->table.on = "synth tree, 0.04 mm";
            good = row_spread(bench, NULL, faults);
            for (int k = CLICK; k <= FIVE && good; k++)
                if (*bench->model[k].tree) {
                    bench->table.on = bench->model[k].name;
                    good = row_spread(bench, &bench->model[k], faults);
                }
            break;
        case SPIRAL: good = row_felt(bench, true, faults); break;
        case PUSH: good = row_felt(bench, false, faults); break;
        case STEP: good = row_step(bench, faults); break;
        default: break;
        }
    }
    return good;
}

// --- The verb ---

static const char *take_rows(void *structure, const Option *option, const char *list)
{
    WallBench *bench = structure;
    (void)option;
    memset(bench->wanted, 0, sizeof bench->wanted);
    for (const char *at = list; *at;) {
        size_t length = strcspn(at, ",");
        bool known = false;
        for (int row = 0; row < ROWS; row++)
            if (strlen(row_names[row]) == length && !strncmp(at, row_names[row], length))
                bench->wanted[row] = known = true;
        if (!known)
            return "valid, between commas: jumps points truth noise blobs fit junctions flood spread stiff spiral push step";
        at += length + (at[length] == ',');
    }
    return NULL;
}

static void set_defaults(void *structure)
{
    WallBench *bench = structure;
    bench->seeds = 10;
    memset(bench->wanted, true, sizeof bench->wanted);
}

static const char *check(void *structure)
{
    WallBench *bench = structure;
    if (bench->named_count > MODELS_MOST - NAMED)
        return "at most 8 files";
    bench->model_count = NAMED + bench->named_count;
    for (int k = 0; k < bench->model_count; k++) {
        const char *path = k < NAMED ? bench->tree[k] : bench->named[k - NAMED];
        if (!path)
            continue;
        const char *slash = strrchr(path, '/');
        snprintf(bench->model[k].tree, PATH, "%s", path);
        if (k >= NAMED)
            snprintf(bench->model[k].name, sizeof bench->model[k].name, "%.31s", slash ? slash + 1 : path);
        bench->any_given = true;
    }
    return NULL;
}

static bool needs_models(const WallBench *bench)
{
    static const int of_models[] = {JUMPS, POINTS, BLOBS, FIT, JUNCTIONS, FLOOD, SPREAD, STIFF, STEP};
    for (size_t k = 0; k < sizeof of_models / sizeof of_models[0]; k++)
        if (bench->wanted[of_models[k]])
            return true;
    return false;
}

static bool make_work(WallBench *bench, Faults *faults)
{
    if (bench->folder) {
        snprintf(bench->work, PATH, "%s", bench->folder);
        if (access(bench->work, W_OK) == 0)
            return true;
        faults_add(faults, bench->work, 0, 0, "is not a writable folder");
        return false;
    }
    const char *folder = getenv("TMPDIR");
    snprintf(bench->work, PATH, "%.400s/seldinger-wall-XXXXXX", folder && *folder ? folder : "/tmp");
    bench->owns_work = mkdtemp(bench->work) != NULL;
    if (!bench->owns_work)
        faults_add(faults, bench->work, 0, 0, "cannot be made; --work names a folder");
    return bench->owns_work;
}

static void remove_work(const WallBench *bench)
{
    static const char *const endings[] = {"-tree.h5", ".h5", "-exact.h5", ".nrrd", "-truth.h5"};
    static const char *const names[] = {"click", "five", "phantom", "phantom-noisy", "phantom-push", "phantom-step", "spiral", "spread"};
    char path[PATH], name[48];
    for (size_t e = 0; e < sizeof endings / sizeof endings[0]; e++) {
        for (size_t k = 0; k < sizeof names / sizeof names[0]; k++) {
            work_path(bench, names[k], endings[e], path);
            unlink(path);
        }
        for (int k = 0; k < MODELS_MOST; k++) {
            enum { FORMS = 3 };
            for (int f = 0; f < FORMS; f++) {
                snprintf(name, sizeof name, f == 0 ? "model-%d" : f == 1 ? "synth-%d" : "synth-%d-image", k);
                work_path(bench, name, endings[e], path);
                unlink(path);
            }
        }
    }
    rmdir(bench->work);
}

static bool write_json(const WallBench *bench, Faults *faults)
{
    cJSON *root = cJSON_CreateObject(), *lines = cJSON_AddArrayToObject(root, "lines");
    cJSON_AddStringToObject(root, "processor", bench_processor());
    cJSON_AddStringToObject(root, "simd", simd_name[simd_level()]);
    for (int k = 0; k < bench->table.count; k++) {
        const WallLine *line = &bench->table.line[k];
        cJSON *at = cJSON_CreateObject();
        cJSON_AddStringToObject(at, "row", line->row);
        cJSON_AddStringToObject(at, "on", line->on);
        cJSON_AddStringToObject(at, "what", line->what);
        cJSON_AddNumberToObject(at, "value", line->value);
        cJSON_AddStringToObject(at, "unit", line->unit);
        if (!isnan(line->limits.must)) {
            cJSON_AddNumberToObject(at, "must", line->limits.must);
            cJSON_AddNumberToObject(at, "aim", line->limits.aim);
            cJSON_AddStringToObject(at, "verdict", verdict(line));
        }
        cJSON_AddStringToObject(at, "note", line->note);
        cJSON_AddItemToArray(lines, at);
    }
    bool good = bench_write_json(&bench->common, root, faults);
    cJSON_Delete(root);
    return good;
}

static bool plan_output(const WallBench *bench, Faults *faults)
{
    OutputPlan plan = {.faults = faults};
    output_plan_write(&plan, "--json", bench->common.json);
    for (int i = 0; i < NAMED; i++)
        output_plan_read(&plan, "the tree", bench->model[i].tree[0] ? bench->model[i].tree : NULL);
    return faults->count == 0;
}

static int call(void *options, Faults *faults)
{
    WallBench *bench = options;
    int missed = 0;
    if (!plan_output(bench, faults) || !make_work(bench, faults))
        return EXIT_BAD_INPUT;
    bench->table.out = bench_text(&bench->common);
    fprintf(bench->table.out, "%s, %s\n%-10s %-22s %-34s %10s %-7s %8s %8s\n", bench_processor(), simd_name[simd_level()], "row", "on", "what", "value", "",
            "must", "aim");
    bool good = !needs_models(bench) || open_models(bench, faults);
    for (int k = 0; good && k < bench->model_count; k++)
        if (bench->model[k].model)
            good = rows_of_model(bench, &bench->model[k], faults);
    good = good && rows_of_shapes(bench, faults) && write_json(bench, faults);
    for (int k = 0; k < bench->table.count; k++)
        missed += !strcmp(verdict(&bench->table.line[k]), "MISSED");
    if (good)
        fprintf(bench->table.out, "%d lines, %d missed\n", bench->table.count, missed);
    if (bench->owns_work)
        remove_work(bench);
    for (int k = 0; k < bench->model_count; k++)
        vessel_tree_free(bench->model[k].model);
    free(bench->table.line);
    return !good ? EXIT_BAD_INPUT : missed > 0 ? EXIT_DIFFERENT : EXIT_DONE;
}

static const Option rows[] = {
    {"click", "F", OPTION_FILE, OPTION_AT(WallBench, tree[CLICK]), "replaces the one-click tree (a tree or a model)"},
    {"five", "F", OPTION_FILE, OPTION_AT(WallBench, tree[FIVE]), "replaces the tree of the five branches"},
    {"arch", "F", OPTION_FILE, OPTION_AT(WallBench, tree[ARCH]), "replaces the tree of the arch"},
    {"rows", "A,B", OPTION_TEXT, OPTION_AT(WallBench, wanted), "any of: jumps points truth noise blobs fit junctions flood spread stiff spiral push step",
     .take = take_rows, .otherwise = "all"},
    {"seeds", "N", OPTION_INT, OPTION_AT(WallBench, seeds), "number of fits for `spread`", .least = 2, .most = 20},
    {"work", "DIR", OPTION_FOLDER, OPTION_AT(WallBench, folder), "folder in which trees and models are written and kept", .otherwise = "a temporary folder"},
    BENCH_OPTIONS(WallBench, common, "only the given files, no synthetic angiograms, stiff wires for 1 s"),
};

static const OptionTable table = {
    .program = "seldinger bench wall",
    .does = "one table about the wall of fitted trees: agreement, accuracy, ostia, reach, tools in it",
    .usage = "[options] [TREE.h5|MODEL.h5 ...]",
    .intro = "The wall of fitted trees in one table: value, required value, desired value, met or missed. Trees are first fitted by `seldinger fit`; models "
             "are used "
             "unchanged. Without files: one click on ../shared/data/aneurism.nrrd, the five branches of scenes/aneurism and the arch; those without data are "
             "skipped. Run it from the project's folder. Rows are printed as they are measured; CPU times are those of the commands.",
    .exits = "0 done; 1 a required value was missed; 2 wrong usage or bad input",
    CLI_OPTIONS(rows, WallBench),
    .set_defaults = set_defaults,
    .check = check,
    .takes_argument = true,
    .may_be_missing = true,
    .argument = offsetof(WallBench, named),
    .argument_count = offsetof(WallBench, named_count),
};

const Verb bench_wall = {.options = &table, .call = call};
