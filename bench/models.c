// seldinger bench models: vessel models fitted to the same points, against the known wall.
//
// The wall's points on which a model is measured are other than those that it was fitted to, without noise; those near open ends are left out. Of a tree given
// on the command line the wall is not known: its own points are used, and the normal's error is not measured.
#include "bench/bench.h"

#include "recon/fit/field_fit.h"
#include "recon/fit/sweep_fit.h"
#include "recon/phantom/phantom.h"
#include "recon/phantom/shaped_tube.h"
#include "recon/tree_file.h"

#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { MOST_TREES = 8, MODEL_LIM = 0, MODEL_SWEEP, MODELS };
static const char *const model_name[MODELS] = {"lim", "sweep"};

typedef struct ModelsBench {
    BenchOptions common;
    const char *tree[MOST_TREES], *shape;
    int tree_count, only;    // the model; MODELS: all
    SweepFitOptions sweep;
} ModelsBench;

typedef struct WallSample {
    Vec3 x, normal;          // normal 0: unknown
    int node;
    bool at_fork;
} WallSample;

typedef struct Case {
    const char *name;
    const char *shape;       // or "star", "ellipse"
    int options;
    char option[3][2][64];
    double noise;
} Case;

static const Case cases[] = {
    {"star", "star", 0, {{""}}, 0},
    {"star .05", "star", 0, {{""}}, 0.05},
    {"ellipse", "ellipse", 0, {{""}}, 0},
    {"ellipse .05", "ellipse", 0, {{""}}, 0.05},
    {"kidney", "kidney", 0, {{""}}, 0},
    {"kidney .05", "kidney", 0, {{""}}, 0.05},
    {"arc", "arc", 0, {{""}}, 0},
    {"y 37.5", "y", 0, {{""}}, 0},
    {"y 37.5 .05", "y", 1, {{"noise_mm", "0.05"}}, 0.05},
    {"y 15", "y", 1, {{"angle_deg", "15"}}, 0},
    {"bifurcation", "bifurcation", 0, {{""}}, 0},
    {"kissing", "kissing", 0, {{""}}, 0},
    {"twig", "twig", 0, {{""}}, 0},
    {"phantom", "phantom", 0, {{""}}, 0},
    {"tree 51", "tree", 0, {{""}}, 0},
};

typedef struct Subject {
    VesselTree *tree;
    WallSample *sample;
    int64_t count;
    double voxel;
} Subject;

static void free_subject(Subject *s)
{
    vessel_tree_free(s->tree);
    free(s->sample);
    *s = (Subject){0};
}

static bool is_near_fork(const VesselTree *tree, int node)
{
    for (int k = tree->near_offset[node] - 1; k < tree->near_offset[node + 1]; k++) {
        int other = k < tree->near_offset[node] ? node : tree->near[k];
        if (tree->neighbour_offset[other + 1] - tree->neighbour_offset[other] > 2 &&
            vec3_distance(tree->center[other], tree->center[node]) < 3 * tree->radius[node])
            return true;
    }
    return false;
}

static bool near_open_end(const Shape *shape, const VesselTree *tree, int node, Vec3 x)
{
    for (int side = -1; side <= 1; side++)
        if (shape_beyond_open_end(shape, vec3_add_scaled(x, 1.5 * side * tree->radius[node], tree->direction[node])))
            return true;
    return false;
}

static bool sample_shape(const Case *c, Subject *out, Faults *faults)
{
    char option[5][2][64] = {{""}};
    for (int i = 0; i < c->options; i++)
        memcpy(option[i], c->option[i], sizeof option[i]);
    Shape *shape = shape_create(c->shape, c->options, (const char(*)[2][64])option, c->name, faults);
    out->tree = shape ? shape_sample(shape, faults) : NULL;
    out->voxel = shape ? shape_voxel_mm(shape) : 0;
    shape_free(shape);
    int n = 0;
    for (int i = 0; i < c->options; i++)
        if (strcmp(c->option[i][0], "noise_mm"))
            memcpy(option[n++], c->option[i], sizeof option[i]);
    if (strcmp(c->shape, "tree"))            // whose seed also decides its course
        memcpy(option[n++], (char[2][64]){"seed", "7"}, sizeof option[0]);
    memcpy(option[n++], (char[2][64]){"spacing", "0.25"}, sizeof option[0]);
    shape = shape_create(c->shape, n, (const char(*)[2][64])option, c->name, faults);
    VesselTree *truth = shape ? shape_sample(shape, faults) : NULL;
    out->sample = truth ? calloc((size_t)truth->point_count + 1, sizeof *out->sample) : NULL;
    bool good = out->tree && out->sample;
    for (int i = 0; good && i < truth->node_count; i++)
        for (int64_t p = truth->point_offset[i]; p < truth->point_offset[i + 1]; p++) {
            WallSample *s = &out->sample[out->count];
            s->x = truth->point[p];
            if (near_open_end(shape, truth, i, s->x))
                continue;
            shape_field(shape, s->x, &s->normal);
            s->normal = vec3_unit_or(s->normal, vec3(0, 0, 0));
            s->at_fork = is_near_fork(truth, i);
            s->node = power_nearest(out->tree, truth->center[i]);
            s->node = power_walk(out->tree, s->x, s->node, 64);
            out->count++;
        }
    vessel_tree_free(truth);
    shape_free(shape);
    return good;
}

static bool sample_tube(ShapedTube tube, double noise, Subject *out)
{
    enum { ALONG = 400, AROUND = 48 };
    out->tree = shaped_tube_sample(tube, noise, 1);
    out->voxel = fmax(0.05, 2 * noise);
    out->sample = calloc((size_t)ALONG * AROUND, sizeof *out->sample);
    if (!out->tree || !out->sample)
        return false;
    double length = shaped_tube_length();
    for (int i = 0; i < ALONG; i++)
        for (int k = 0; k < AROUND; k++) {
            double t = 2 + (length - 4) * (i + 0.5) / ALONG;
            WallSample *s = &out->sample[out->count++];
            s->x = shaped_tube_wall(tube, t, 2 * PI * (k + 0.1) / AROUND, &s->normal);
            s->node = (int)(t / length * (out->tree->node_count - 1) + 0.5);
        }
    return true;
}

static bool take_tree(const char *path, Subject *out, Faults *faults)
{
    TreeFileInfo info = {0};
    out->tree = tree_file_load(path, &info, faults);
    if (!out->tree)
        return false;
    double voxel = tree_file_number(&info, "voxel_mm", 0);
    out->voxel = voxel;
    tree_file_info_free(&info);
    out->sample = calloc((size_t)out->tree->point_count + 1, sizeof *out->sample);
    for (int i = 0; out->sample && i < out->tree->node_count; i++)
        for (int64_t p = out->tree->point_offset[i]; p < out->tree->point_offset[i + 1] && out->tree->kind[i] == NODE_VESSEL; p++)
            out->sample[out->count++] = (WallSample){.x = out->tree->point[p], .node = i};
    return out->sample != NULL;
}

// --- Models ---

typedef struct Fitted {
    VesselTree *lim;
    SweepModel *sweep;
    SweepField *field;
    Vessel *vessel;
    SweepFitFigures figures;
    int64_t numbers;
    double seconds;
} Fitted;

static bool fit_model(const ModelsBench *bench, int model, const Subject *subject, Fitted *out, Faults *faults)
{
    struct timespec a, b;
    clock_gettime(CLOCK_MONOTONIC, &a);
    if (model == MODEL_LIM) {
        FieldFitOptions options = field_fit_default_options();
        options.voxel_mm = subject->voxel;
        options.threads = bench->common.threads;
        out->lim = field_fit(subject->tree, &options, NULL, faults);
        out->vessel = out->lim ? field_vessel_create(out->lim) : NULL;
        out->numbers = out->lim ? 5 * out->lim->blob_count : 0;
    } else {
        SweepFitOptions options = bench->sweep;
        options.threads = bench->common.threads;
        options.voxel_mm = subject->voxel;
        out->sweep = sweep_fit(subject->tree, &options, &out->figures, faults);
        out->field = out->sweep ? sweep_field_create(out->sweep) : NULL;
        out->numbers = out->figures.numbers;
    }
    clock_gettime(CLOCK_MONOTONIC, &b);
    out->seconds = (double)(b.tv_sec - a.tv_sec) + 1e-9 * (double)(b.tv_nsec - a.tv_nsec);
    return out->vessel || out->field;
}

static void free_fitted(Fitted *f)
{
    if (f->vessel)
        f->vessel->destroy(f->vessel);
    vessel_tree_free(f->lim);
    sweep_field_free(f->field);
    sweep_model_free(f->sweep);
    *f = (Fitted){0};
}

// The branch and t where a node lies on the swept model: its nearest knot.
static SweepPlace place_of(const SweepModel *model, const VesselTree *tree, int node, Vec3 x)
{
    SweepPlace place = {.branch = 0, .sac = -1};
    double least = HUGE_VAL;
    for (int i = 0; model->sac && tree->kind[node] != NODE_VESSEL && i < model->sac->node_count; i++)
        if (model->sac_node[i] == node)
            return (SweepPlace){.branch = -1, .sac = i};
    for (int i = 0; i < model->branch_count; i++) {
        double t = 0;
        const SweepBranch *b = &model->branch[i];
        for (int k = b->first_knot; k < b->first_knot + b->knot_count; k++) {
            t += k > b->first_knot ? vec3_distance(model->knot[k], model->knot[k - 1]) : 0;
            double far = vec3_distance(model->knot[k], x) / tree->radius[model->knot_node[k]];
            if (far < least)
                least = far, place.branch = i, place.t = t;
        }
    }
    return place;
}

typedef struct Row {
    double mean, p99, most, bias, normal_deg, bulge;
    int64_t count;
} Row;

typedef struct Measuring {
    const Subject *subject;
    const Fitted *fitted;
    double *gap, *turn;
} Measuring;

static void measure_sample(void *context, long i)
{
    Measuring *m = context;
    const WallSample *s = &m->subject->sample[i];
    Vec3 normal;
    if (m->fitted->vessel) {
        VesselMemory memory = {.node = s->node};
        VesselHit hit;
        vessel_query(m->fitted->vessel, 1, &s->x, HUGE_VAL, &memory, &hit);
        m->gap[i] = hit.gap, normal = hit.normal;
    } else {
        SweepBlend blend;
        sweep_field_blend(m->fitted->field, place_of(m->fitted->sweep, m->subject->tree, s->node, s->x), s->x, &blend);
        m->gap[i] = blend.f / fmax(vec3_norm(blend.gradient), 0.1);
        normal = vec3_unit_or(blend.gradient, vec3(0, 0, 0));
    }
    m->turn[i] = vec3_norm2(s->normal) > 0 ? vec3_angle(normal, s->normal) : 0;
}

static bool measure(const ModelsBench *bench, const Subject *subject, const Fitted *fitted, Row *row)
{
    size_t room = (size_t)subject->count + 1;
    Measuring m = {subject, fitted, calloc(room, sizeof *m.gap), calloc(room, sizeof *m.turn)};
    bool good = m.gap && m.turn;
    *row = (Row){0};
    double sum = 0, bias = 0, square = 0;
    if (good)
        parallel_for(bench->common.threads, (long)subject->count, measure_sample, &m, NULL);
    for (int64_t i = 0; good && i < subject->count; i++) {
        double e = fabs(m.gap[i]), r = subject->tree->radius[subject->sample[i].node];
        if (!(e < (vec3_norm2(subject->sample[i].normal) > 0 ? HUGE_VAL : 0.5 * r)))      // of a segmented tree: within another vessel's lumen
            continue;
        if (subject->sample[i].at_fork)
            row->bulge = fmax(row->bulge, m.gap[i] / r);
        sum += e, bias += m.gap[i], square += m.turn[i] * m.turn[i];
        m.gap[row->count++] = e;
    }
    if (good && row->count > 0) {
        sort_doubles(m.gap, (size_t)row->count);
        row->mean = sum / (double)row->count, row->bias = bias / (double)row->count, row->normal_deg = 180 / PI * sqrt(square / (double)row->count);
        row->p99 = m.gap[(int64_t)(0.99 * (double)(row->count - 1))], row->most = m.gap[row->count - 1];
    }
    free(m.gap);
    free(m.turn);
    return good;
}

static void report(const ModelsBench *bench, const char *name, int model, const Fitted *fitted, const Row *row, cJSON *rows)
{
    FILE *text = bench_text(&bench->common);
    fprintf(text, "%-12.12s %-6s %8.5f %8.5f %8.5f %+9.5f %7.3f %7.4f %8lld %7.2f", name, model_name[model], row->mean, row->p99, row->most, row->bias,
            row->normal_deg, row->bulge, (long long)fitted->numbers, fitted->seconds);
    if (model == MODEL_SWEEP)
        fprintf(text, "   noise %.5f, %lld left out, %lld folded, %lld not star-shaped, %d shaped", fitted->figures.noise, (long long)fitted->figures.left_out,
                (long long)fitted->figures.folded, (long long)fitted->figures.not_star_shaped, fitted->figures.shaped);
    fprintf(text, "\n");
    fflush(text);
    cJSON *out = cJSON_CreateObject();
    cJSON_AddStringToObject(out, "case", name);
    cJSON_AddStringToObject(out, "model", model_name[model]);
    cJSON_AddNumberToObject(out, "mean_mm", row->mean);
    cJSON_AddNumberToObject(out, "p99_mm", row->p99);
    cJSON_AddNumberToObject(out, "max_mm", row->most);
    cJSON_AddNumberToObject(out, "bias_mm", row->bias);
    cJSON_AddNumberToObject(out, "normal_deg", row->normal_deg);
    cJSON_AddNumberToObject(out, "bulge_radii", row->bulge);
    cJSON_AddNumberToObject(out, "numbers", (double)fitted->numbers);
    cJSON_AddNumberToObject(out, "build_s", fitted->seconds);
    cJSON_AddItemToArray(rows, out);
}

static bool compare(const ModelsBench *bench, const char *name, const Subject *subject, cJSON *rows, Faults *faults)
{
    bool good = true;
    for (int model = 0; model < MODELS && good; model++) {
        if (bench->only != MODELS && bench->only != model)
            continue;
        Fitted fitted = {0};
        Row row;
        good = fit_model(bench, model, subject, &fitted, faults) && measure(bench, subject, &fitted, &row);
        if (good)
            report(bench, name, model, &fitted, &row, rows);
        free_fitted(&fitted);
    }
    return good;
}

static int call(void *structure, Faults *faults)
{
    ModelsBench *bench = structure;
    cJSON *root = cJSON_CreateObject(), *rows = cJSON_AddArrayToObject(root, "rows");
    FILE *text = bench_text(&bench->common);
    fprintf(text, "%s\n%-12s %-6s %8s %8s %8s %9s %7s %7s %8s %7s\n", bench_processor(), "case", "model", "mean mm", "p99", "max", "bias", "nrm deg", "bulge r",
            "numbers", "build s");
    bool good = true;
    int count = (int)(sizeof cases / sizeof cases[0]) - (bench->common.quick ? 2 : 0);
    for (int i = 0; i < count && good && bench->tree_count == 0; i++) {
        Subject subject = {0};
        const Case *c = &cases[i];
        if (bench->shape && strncmp(bench->shape, c->name, strlen(bench->shape)))
            continue;
        static const char *const tube[] = {[SHAPED_STAR] = "star", [SHAPED_ELLIPSE] = "ellipse", [SHAPED_KIDNEY] = "kidney"};
        int which = 0;
        while (which < 3 && strcmp(c->shape, tube[which]))
            which++;
        good = which < 3 ? sample_tube((ShapedTube)which, c->noise, &subject) : sample_shape(c, &subject, faults);
        good = good && compare(bench, c->name, &subject, rows, faults);
        free_subject(&subject);
    }
    for (int i = 0; i < bench->tree_count && good; i++) {
        Subject subject = {0};
        const char *slash = strrchr(bench->tree[i], '/');
        good = take_tree(bench->tree[i], &subject, faults) && compare(bench, slash ? slash + 1 : bench->tree[i], &subject, rows, faults);
        free_subject(&subject);
    }
    if (!good && faults->count == 0)
        faults_add(faults, "bench models", 0, 0, "not enough memory");
    good = good && bench_write_json(&bench->common, root, faults);
    cJSON_Delete(root);
    return EXIT_DONE;
}

static void set_defaults(void *structure) { *(ModelsBench *)structure = (ModelsBench){.only = MODELS, .sweep = sweep_fit_default_options()}; }

static const char *take_path(void *structure, const Option *option, const char *text)
{
    ModelsBench *bench = structure;
    (void)option;
    if (bench->tree_count == MOST_TREES)
        return "at most eight";
    bench->tree[bench->tree_count++] = text;
    return NULL;
}

#define AT(member) OPTION_AT(ModelsBench, member)
static const char *const only_choices[] = {"lim", "sweep", NULL};
static const Option options[] = {
    {"tree", "F.h5", OPTION_FILE, AT(tree), "a segmented tree instead of the shapes; may be given several times", .take = take_path},
    {"model", "NAME", OPTION_CHOICE, AT(only), "only this model", .choices = only_choices, .otherwise = "both"},
    {"case", "NAME", OPTION_TEXT, AT(shape), "only the cases whose names begin so", .otherwise = "all"},
    {"spacing", "X", OPTION_NUMBER, AT(sweep.spacing), "sections along a tube, in radii", .least = 0.1, .most = 10},
    {"fork-spacing", "X", OPTION_NUMBER, AT(sweep.fork_spacing), "the same at forks", .least = 0.1, .most = 10},
    {"rounds", "N", OPTION_INT, AT(sweep.rounds), "of the joint refinement", .least = 0, .most = 100},
    {"harmonics", "N", OPTION_INT, AT(sweep.harmonics), "highest harmonic along tubes", .least = 1, .most = 8},
    BENCH_OPTIONS(ModelsBench, common, "without the phantom and the tree"),
};

static const OptionTable table = {
    .program = "seldinger bench models",
    .does = "models of vessels fitted to the same points, against the known wall",
    .usage = "[options]",
    .intro =
        "Fits shared blobs (lim) and the swept model (sweep) to shapes whose wall is known, and measures them at wall points that they were not fitted to: "
        "mean, 99th percentile and largest distance, mean with its sign (+: too wide), root mean square of the normal's error, largest bulge outside the "
        "true wall at forks in local radii, numbers stored, and seconds of the fit.",
    .exits = CLI_BAD_INPUT_EXITS,
    CLI_OPTIONS(options, ModelsBench),
    .set_defaults = set_defaults,
};

const Verb bench_models = {.options = &table, .call = call};
