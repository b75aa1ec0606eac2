// seldinger bench papers: the tables and figures of Kretschmer et al. 2013 and Hong et al. 2012, 2018 that can be repeated, in form, with the papers' figures.
//
// Their angiograms are not public: the volume and tree given on the command line, and shapes whose wall is known, take their place. As in the papers the distance
// is measured from the surface of the segmentation, the points where edges of the voxel grid cross a threshold, to which the models are fitted, too.
#include "bench/vessel_models.h"

#include "base/sort_doubles.h"
#include "geom/random.h"
#include "recon/phantom/phantom.h"
#include "recon/phantom/shaped_tube.h"
#include "recon/tree_file.h"
#include "recon/volume/volume_file.h"

#include <stdlib.h>
#include <string.h>

typedef struct PapersBench {
    BenchOptions common;
    const char *volume, *tree;
    double threshold;
} PapersBench;

// --- Points of the segmentation's surface ---

typedef struct Crossings {
    int64_t count, room;
    Vec3 *point;
    int *node;
} Crossings;

static bool add_crossing(Crossings *c, Vec3 x, int node)
{
    if (c->count == c->room) {
        int64_t room = 2 * c->room + 4096;
        Vec3 *point = realloc(c->point, (size_t)room * sizeof *point);
        if (point)
            c->point = point;
        int *of = point ? realloc(c->node, (size_t)room * sizeof *of) : NULL;
        if (!of)
            return false;
        c->node = of, c->room = room;
    }
    c->point[c->count] = x, c->node[c->count++] = node;
    return true;
}

// Crossings within half a radius and a voxel of a vessel's cylinder.
static bool find_crossings(const Volume *v, const VesselTree *tree, double threshold, Crossings *out)
{
    size_t row = (size_t)v->size[0], slice = row * (size_t)v->size[1], step[3] = {1, row, slice};
    double slack = volume_voxel_size(v);
    for (int k = 0; k + 1 < v->size[2]; k++)
        for (int j = 0; j + 1 < v->size[1]; j++)
            for (int i = 0; i + 1 < v->size[0]; i++) {
                const float *at = v->value + (size_t)k * slice + (size_t)j * row + (size_t)i;
                for (int axis = 0; axis < 3; axis++) {
                    double a = (double)at[0] - threshold, b = (double)at[step[axis]] - threshold, share = a / (a - b);
                    if ((a > 0) == (b > 0))
                        continue;
                    Vec3 x = volume_point_of(v, vec3(i + (axis == 0 ? share : 0), j + (axis == 1 ? share : 0), k + (axis == 2 ? share : 0)));
                    int node = power_nearest(tree, x);
                    double r = tree->radius[node];
                    if (tree->kind[node] == NODE_VESSEL && fabs(vec3_distance(x, tree->center[node]) - r) < 0.5 * r + slack && !add_crossing(out, x, node))
                        return false;
                }
            }
    return true;
}

// The tree with the crossings as its points; sacs are left out of the papers' models and keep theirs.
static VesselTree *tree_with(const VesselTree *tree, const Crossings *c)
{
    int64_t kept = 0, p = 0;
    for (int i = 0; i < tree->node_count; i++)
        kept += tree->kind[i] == NODE_VESSEL ? 0 : tree->point_offset[i + 1] - tree->point_offset[i];
    VesselTree *out = vessel_tree_create(tree->node_count, c->count + kept, 0);
    int64_t *next = calloc((size_t)tree->node_count + 1, sizeof *next);
    if (!out || !next) {
        vessel_tree_free(out);
        free(next);
        return NULL;
    }
    for (int64_t k = 0; k < c->count; k++)
        next[c->node[k] + 1]++;
    for (int i = 0; i < tree->node_count; i++) {
        out->center[i] = tree->center[i], out->radius[i] = tree->radius[i], out->direction[i] = tree->direction[i];
        out->height[i] = tree->height[i], out->parent[i] = tree->parent[i], out->kind[i] = tree->kind[i];
        int64_t own = tree->kind[i] == NODE_VESSEL ? next[i + 1] : tree->point_offset[i + 1] - tree->point_offset[i];
        next[i] = p, p += own;
        out->point_offset[i + 1] = p;
        for (int64_t k = 0; tree->kind[i] != NODE_VESSEL && k < own; k++)
            out->point[next[i] + k] = tree->point[tree->point_offset[i] + k];
    }
    for (int64_t k = 0; k < c->count; k++)
        out->point[next[c->node[k]]++] = c->point[k];
    free(next);
    if (!vessel_tree_link(out)) {
        vessel_tree_free(out);
        return NULL;
    }
    return out;
}

// --- Measures ---

typedef struct Figures {
    double mean, p99, aumc, aumc2r;      // aumc: mean |mean curvature| [1/mm]; aumc2r: of it times twice the node's radius
} Figures;

typedef struct Looking {
    const FittedModel *model;
    const VesselTree *tree;
    const int *node;         // (points)
    WallView *view;          // (points)
} Looking;

static void look(void *context, long p)
{
    Looking *l = context;
    l->view[p] = fitted_model_look(l->model, l->tree, l->node[p], l->tree->point[p]);
}

static bool measure(const FittedModel *model, const VesselTree *tree, int threads, Figures *out)
{
    size_t room = (size_t)tree->point_count + 1;
    double *e = malloc(room * sizeof *e);
    int *node = malloc(room * sizeof *node);
    WallView *view = malloc(room * sizeof *view);
    bool good = e && node && view;
    int64_t count = 0;
    double sum = 0, bent = 0, bent2r = 0;
    for (int i = 0; good && i < tree->node_count; i++)
        for (int64_t p = tree->point_offset[i]; p < tree->point_offset[i + 1]; p++)
            node[p] = i;
    if (good)
        parallel_for(threads, (long)tree->point_count, look, &(Looking){model, tree, node, view}, NULL);
    for (int64_t p = 0; good && p < tree->point_count; p++) {
        double d = fabs(view[p].gap), h = fabs(view[p].curvature), r = tree->radius[node[p]];
        if (tree->kind[node[p]] != NODE_VESSEL || !(d < r) || !isfinite(h))      // within another vessel's lumen
            continue;
        sum += d, bent += h, bent2r += 2 * r * h;
        e[count++] = d;
    }
    *out = (Figures){0};
    if (good && count > 0) {
        sort_doubles(e, (size_t)count);
        *out = (Figures){sum / (double)count, e[(int64_t)(0.99 * (double)(count - 1))], bent / (double)count, bent2r / (double)count};
    }
    free(e);
    free(node);
    free(view);
    return good;
}

// --- Hong et al. 2018, tables 1 and 2; Hong et al. 2012, tables I and II ---

static bool table_of_segmentation(const PapersBench *bench, double threshold, FILE *text, cJSON *rows, Faults *faults)
{
    VesselTree *tree = tree_file_load(bench->tree, NULL, faults), *own = NULL;
    Volume *volume = tree ? volume_load(bench->volume, faults) : NULL;
    Crossings crossings = {0};
    if (volume && find_crossings(volume, tree, threshold, &crossings))
        own = tree_with(tree, &crossings);
    bool good = own != NULL;
    double voxel = volume ? volume_voxel_size(volume) : 1;
    double diagonal = volume ? vec3_norm(vec3_add(volume->axis[0], vec3_add(volume->axis[1], volume->axis[2]))) : 1;
    fprintf(text, "\nHong 2018, tables 1 and 2; Hong 2012, tables I and II: %s at %g, %lld points, voxel diagonal %.3f mm\n%-11s %9s %9s %9s %9s %9s %8s %8s\n",
            bench->volume, threshold, (long long)crossings.count, diagonal, "model", "mean mm", "diagonals", "p99 mm", "AUMC", "AUMC 2r", "numbers", "build s");
    SweepFitOptions sweep = sweep_fit_default_options();
    for (int i = 0; i < MODEL_KINDS && good; i++) {
        FittedModel model;
        Figures f;
        good =
            fitted_model_create(&model_kind[i], own, voxel, bench->common.threads, &sweep, &model, faults) && measure(&model, own, bench->common.threads, &f);
        if (good) {
            fprintf(text, "%-11s %9.4f %9.3f %9.3f %9.3f %9.3f %8lld %8.2f\n", model_kind[i].name, f.mean, f.mean / diagonal, f.p99, f.aumc, f.aumc2r,
                    (long long)model.numbers, model.seconds);
            cJSON *row = cJSON_CreateObject();
            cJSON_AddStringToObject(row, "model", model_kind[i].name);
            cJSON_AddNumberToObject(row, "threshold", threshold);
            cJSON_AddNumberToObject(row, "mean_diagonals", f.mean / diagonal);
            cJSON_AddNumberToObject(row, "aumc_1_mm", f.aumc);
            cJSON_AddNumberToObject(row, "aumc_2r", f.aumc2r);
            cJSON_AddNumberToObject(row, "build_s", model.seconds);
            cJSON_AddItemToArray(rows, row);
        }
        fflush(text);
        fitted_model_free(&model);
    }
    fprintf(text, "the papers' (carotid, liver vein, cerebral): RBF .26 .33 .28 diagonals, AUMC .26 .16 .25; PAS .33 .36 .33, .21 .12 .28; MPUI .51 .47 .35, "
                  ".26 .19 .54\n"
                  "their seconds to a mesh of 131,788 to 137,324 faces: RBF 20, 82, 36 (i5, 1.6 GHz); PAS 86 to 190\n");
    vessel_tree_free(tree);
    vessel_tree_free(own);
    volume_free(volume);
    free(crossings.point);
    free(crossings.node);
    return good;
}

// --- Hong et al. 2012, figure 13; Kretschmer et al. 2013, table 1; Hong et al. 2018, figure 8 ---

// Sections as printed, of a width delta.
static bool fit_printed(const VesselTree *tree, SectionKind kind, double delta, bool straight, int threads, FittedModel *out, Faults *faults)
{
    SweepFitOptions options = sweep_fit_paper_options(kind);
    options.threads = threads;
    options.section.delta_mm = delta;
    *out = (FittedModel){.kind = &model_kind[MODEL_KINDS - 1]};
    out->sweep = sweep_fit(tree, &options, &out->figures, faults);
    for (int i = 0; out->sweep && i < out->sweep->stretch_count; i++)
        out->sweep->stretch[i].is_straight = straight;
    out->field = out->sweep ? sweep_field_create(out->sweep) : NULL;
    return out->field != NULL;
}

static bool table_of_widths(const PapersBench *bench, FILE *text, cJSON *rows, Faults *faults)
{
    static const double delta[] = {0.05, 0.1, 0.2, 0.3, 0.4, 0.6};
    VesselTree *tree = shaped_tube_sample(SHAPED_ELLIPSE, 0, 1);
    FittedModel raster = {0};
    Figures f, exact;
    bool good =
        tree && fit_printed(tree, SECTION_RASTER, 0, false, bench->common.threads, &raster, faults) && measure(&raster, tree, bench->common.threads, &exact);
    fprintf(text,
            "\nHong 2012, figure 13; Kretschmer 2013, table 1: an ellipse of 1.2 and 0.8 mm along a helix, PAS as printed on the curve\n"
            "%8s %9s %9s %9s %11s   law delta^2/2 <1/r>: the curve's shift on a circle\n",
            "delta mm", "mean mm", "p99 mm", "AUMC 2r", "to raster");
    for (size_t i = 0; i < sizeof delta / sizeof delta[0] && good; i++) {
        FittedModel model;
        good = fit_printed(tree, SECTION_PAS, delta[i], false, bench->common.threads, &model, faults) && measure(&model, tree, bench->common.threads, &f);
        double sum = 0;
        for (int k = 0; good && k < tree->node_count; k++)
            for (int64_t p = tree->point_offset[k]; p < tree->point_offset[k + 1]; p++)
                sum += fabs(fitted_model_look(&model, tree, k, tree->point[p]).gap - fitted_model_look(&raster, tree, k, tree->point[p]).gap) /
                       (double)tree->point_count;
        if (good)
            fprintf(text, "%8.2f %9.4f %9.4f %9.3f %11.4f   %.4f\n", delta[i], f.mean, f.p99, f.aumc2r, sum, 0.5 * delta[i] * delta[i]);
        cJSON *row = cJSON_CreateObject();
        cJSON_AddNumberToObject(row, "delta_mm", delta[i]);
        cJSON_AddNumberToObject(row, "mean_mm", f.mean);
        cJSON_AddNumberToObject(row, "to_raster_mm", sum);
        cJSON_AddItemToArray(rows, row);
        fitted_model_free(&model);
    }
    if (good)
        fprintf(text,
                "raster as printed: mean %.4f mm, p99 %.4f mm\nthe papers': .12 to .31 mm over smoothing (Hong); sweep to PAS .074 .140 .210 mm at sigma 2, 5, "
                "6 (Kretschmer, arterial)\n",
                exact.mean, exact.p99);
    fitted_model_free(&raster);
    vessel_tree_free(tree);
    return good;
}

static bool table_of_frames(const PapersBench *bench, FILE *text, Faults *faults)
{
    static const char *const name[] = {"star tube, bend radius 4 mm", "ellipse tube, bend radius 4 mm"};
    fprintf(text, "\nHong 2018, figure 8: sections in straight frames of their stations tear where the vessel bends; mean / p99 mm\n");
    bool good = true;
    for (int k = 0; k < 2 && good; k++) {
        VesselTree *tree = shaped_tube_sample(k == 0 ? SHAPED_STAR : SHAPED_ELLIPSE, 0, 1);
        Figures f[2];
        memset(f, 0, sizeof f);
        for (int straight = 0; straight < 2 && good; straight++) {
            FittedModel model = {0};
            good = tree && fit_printed(tree, SECTION_PAS, 0.1, straight, bench->common.threads, &model, faults) &&
                   measure(&model, tree, bench->common.threads, &f[straight]);
            fitted_model_free(&model);
        }
        fprintf(text, "%-32s on the curve %.4f / %.4f, straight frames %.4f / %.4f\n", name[k], f[0].mean, f[0].p99, f[1].mean, f[1].p99);
        vessel_tree_free(tree);
    }
    return good;
}

// --- Hong et al. 2018, figure 7; Kretschmer et al. 2013, figures 5, 6 and 13 ---

static double roughness(const Section *section, int count, const SectionPoint *truth)
{
    double worst = 0;
    for (int i = 0; i < count; i++) {
        SectionJet j = section_evaluate(section, truth[i].n, truth[i].b);
        worst = fmax(worst, fabs(j.value) / fmax(same_hypot(j.n, j.b), 0.1));
    }
    return worst;
}

static void ellipse(int count, double noise, SectionPoint *out)
{
    Random random = {3};
    for (int i = 0; i < count; i++) {
        double a = 2 * PI * i / count, off = noise > 0 ? noise * random_normal(&random) : 0, n = 1.2 * same_cos(a), b = 0.8 * same_sin(a),
               size = same_hypot(n, b);
        out[i] = (SectionPoint){n * (1 + off / size), b * (1 + off / size)};
    }
}

static bool table_of_points(FILE *text)
{
    enum { POINTS = 24, TRUTH = 360 };
    static const double mu[] = {0, 0.001, 0.01, 0.1, 1};
    SectionPoint point[2][POINTS], truth[TRUTH];
    ellipse(POINTS, 0, point[0]), ellipse(POINTS, 0.05, point[1]), ellipse(TRUTH, 0, truth);
    fprintf(text,
            "\nHong 2018, figure 7: 24 points of an ellipse of 1.2 and 0.8 mm, exact and with 0.05 mm of noise; largest distance from the ellipse [mm]\n");
    for (size_t i = 0; i < sizeof mu / sizeof mu[0]; i++) {
        SectionOptions options = section_default_options(SECTION_RBF, SECTION_MENDED);
        options.stiffness = mu[i];
        Section *exact = section_create(&options, POINTS, point[0]), *noisy = section_create(&options, POINTS, point[1]);
        if (exact && noisy)
            fprintf(text, "mu %5g: %.5f, %.5f%s\n", mu[i], roughness(exact, TRUTH, truth), roughness(noisy, TRUTH, truth),
                    i == 0 ? " (through the points, as printed)" : "");
        section_free(exact);
        section_free(noisy);
        if (!exact || !noisy)
            return false;
    }
    return true;
}

// The wall's distance from the curve at t in the direction (n, b); 0 if there is none.
static double wall_of(const SectionRow *row, double t, double n, double b)
{
    double low = 0, high = 6;
    for (int i = 0; i < 50; i++) {
        double middle = 0.5 * (low + high);
        if (section_row_evaluate(row, n * middle, b * middle, t).value > 0)
            low = middle;
        else
            high = middle;
    }
    return low;
}

static bool table_of_rows(FILE *text)
{
    enum { STATIONS = 7, POINTS = 48 };
    static const double shift[] = {0, 0.3, 0.6, 0.9, 1.2};
    static const struct {
        const char *name;
        SectionWeights weights;
        double tension, width;
    } how[] = {{"Catmull-Rom 0.7 (as printed)", SECTION_CATMULL_ROM, 0.7, 0.5},
               {"Catmull-Rom 0.5", SECTION_CATMULL_ROM, 0.5, 0.5},
               {"B-spline (PSP, delta d/2)", SECTION_PSP, 0.5, 0.5},
               {"PSP, delta d/4", SECTION_PSP, 0.5, 0.25}};
    double t[STATIONS];
    Section *section[STATIONS] = {NULL};
    SectionOptions options = section_default_options(SECTION_RASTER, SECTION_MENDED);
    bool good = true;
    fprintf(text, "\nKretschmer 2013, figure 5: a cone that narrows by 0.1 a station; largest distance of the wall from the straight line [of 0.1], range of "
                  "the slope [of the true one]\n");
    for (size_t h = 0; h < sizeof how / sizeof how[0] && good; h++) {
        double worst = 0, least = HUGE_VAL, most = 0;
        for (int i = 0; i < STATIONS && good; i++) {
            SectionPoint circle[POINTS];
            for (int k = 0; k < POINTS; k++)
                circle[k] = (SectionPoint){(1.5 - 0.1 * i) * same_cos(2 * PI * k / POINTS), (1.5 - 0.1 * i) * same_sin(2 * PI * k / POINTS)};
            t[i] = i;
            section_free(section[i]);
            good = (section[i] = section_create(&options, POINTS, circle)) != NULL;
        }
        const SectionRow row = {STATIONS, t, section, how[h].weights, how[h].tension, how[h].width};
        for (double at = 2; good && at <= 4; at += 0.02) {
            double wall = wall_of(&row, at, 1, 0), slope = (wall_of(&row, at + 1e-3, 1, 0) - wall_of(&row, at - 1e-3, 1, 0)) / 2e-3;
            worst = fmax(worst, fabs(wall - (1.5 - 0.1 * at)));
            least = fmin(least, -slope / 0.1), most = fmax(most, -slope / 0.1);
        }
        fprintf(text, "%-30s %.4f, %.2f to %.2f\n", how[h].name, worst / 0.1, least, most);
    }
    fprintf(text, "\nKretschmer 2013, figure 6: circles of radius 1 shifted to either side in turn; height of the lumen between two stations (2: kept)\n");
    for (size_t s = 0; s < sizeof shift / sizeof shift[0] && good; s++) {
        for (int i = 0; i < STATIONS && good; i++) {
            SectionPoint circle[POINTS];
            for (int k = 0; k < POINTS; k++)
                circle[k] = (SectionPoint){same_cos(2 * PI * k / POINTS) + 0.5 * shift[s] * (i % 2 ? 1 : -1), same_sin(2 * PI * k / POINTS)};
            section_free(section[i]);
            good = (section[i] = section_create(&options, POINTS, circle)) != NULL;
        }
        const SectionRow row = {STATIONS, t, section, SECTION_CATMULL_ROM, 0.7, 0.5};
        if (good)
            fprintf(text, "shifted by %.1f radii: %.3f\n", shift[s], wall_of(&row, 2.5, 0, 1) + wall_of(&row, 2.5, 0, -1));
    }
    for (int i = 0; i < STATIONS; i++)
        section_free(section[i]);
    return good;
}

static int call(void *structure, Faults *faults)
{
    PapersBench *bench = structure;
    cJSON *root = cJSON_CreateObject(), *segmentation = cJSON_AddArrayToObject(root, "segmentation"), *widths = cJSON_AddArrayToObject(root, "widths");
    FILE *text = bench_text(&bench->common);
    fprintf(
        text,
        "%s\nNot repeated: clinical data, flow, CUDA times. Kretschmer's table 2 and figure 7 are in `bench models`, figure 13 is the smoothing of `edit`.\n",
        bench_processor());
    bool good = table_of_points(text) && table_of_rows(text) && table_of_frames(bench, text, faults) && table_of_widths(bench, text, widths, faults);
    if (good && bench->volume)
        good = table_of_segmentation(bench, bench->threshold, text, segmentation, faults);
    if (!good && faults->count == 0)
        faults_add(faults, "bench papers", 0, 0, "not enough memory");
    good = good && bench_write_json(&bench->common, root, faults);
    cJSON_Delete(root);
    return EXIT_DONE;
}

static void set_defaults(void *structure) { *(PapersBench *)structure = (PapersBench){.threshold = 80}; }

static const char *check(void *structure)
{
    const PapersBench *bench = structure;
    return !bench->volume != !bench->tree ? "--volume needs --tree, and --tree --volume" : NULL;
}

#define AT(member) OPTION_AT(PapersBench, member)
static const Option options[] = {
    {"volume", "V", OPTION_FILE, AT(volume), "an angiogram, for the tables of distances from the segmentation's surface"},
    {"tree", "F.h5", OPTION_FILE, AT(tree), "the tree segmented from it; of a case its CASE/model.h5"},
    {"threshold", "X", OPTION_NUMBER, AT(threshold), "value of the angiogram at the segmentation's surface", .least = -1e9, .most = 1e9},
    BENCH_OPTIONS(PapersBench, common, "not used"),
};

static const OptionTable table = {
    .program = "seldinger bench papers",
    .does = "tables and figures of the papers on vessel models, repeated in form",
    .usage = "[--volume V --tree F.h5] [options]",
    .intro = "Repeats tables and figures of Kretschmer et al. 2013 and Hong et al. 2012 and 2018 on shapes whose wall is known and on an angiogram, with the "
             "papers' "
             "figures beside them.",
    .exits = CLI_BAD_INPUT_EXITS,
    CLI_OPTIONS(options, PapersBench),
    .set_defaults = set_defaults,
    .check = check,
};

const Verb bench_papers = {.options = &table, .call = call};
