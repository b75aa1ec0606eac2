// seldinger bench models: vessel models fitted to the same points, against the known wall.
//
// The wall's points on which a model is measured are other than those that it was fitted to, without noise; those near open ends are left out. Of a tree given
// on the command line the wall is not known: its own points are used, and the normal's error is not measured.
#include "bench/model_runs.h"
#include "bench/models_picture.h"
#include "recon/phantom/phantom.h"
#include "recon/phantom/shaped_tube.h"
#include "recon/tree_file.h"

#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { MOST_TREES = 8, MOST_SHAPES = 8 };

typedef struct ModelsBench {
    BenchOptions common;
    const char *tree[MOST_TREES], *shape[MOST_SHAPES], *picture;
    int tree_count, shape_count, only;    // the model; MODEL_KINDS: all
    SweepFitOptions sweep;
} ModelsBench;

typedef struct WallSample {
    Vec3 x, normal;          // normal 0: unknown
    double curvature;        // [1/mm] mean curvature of the true wall; NAN: unknown
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

// Mean curvature: half the divergence of the field's unit normal, which points into the lumen, by differences.
static double shape_curvature(const Shape *shape, Vec3 x, Vec3 normal, double h)
{
    double sum = 0;
    for (int axis = 0; axis < 3; axis++) {
        Vec3 step = vec3(axis == 0 ? h : 0, axis == 1 ? h : 0, axis == 2 ? h : 0), low, high;
        shape_field(shape, vec3_sub(x, step), &low);
        shape_field(shape, vec3_add(x, step), &high);
        Vec3 change = vec3_sub(vec3_unit_or(high, normal), vec3_unit_or(low, normal));
        sum += axis == 0 ? change.x : axis == 1 ? change.y : change.z;
    }
    return -0.5 * sum / (2 * h);
}

// Mean curvature of the surface x(t, theta), by its first and second fundamental forms, by differences.
static double tube_curvature(ShapedTube tube, double t, double theta)
{
    static const double H = 1e-3;
    Vec3 n[4], x[4] = {shaped_tube_wall(tube, t - H, theta, &n[0]), shaped_tube_wall(tube, t + H, theta, &n[1]), shaped_tube_wall(tube, t, theta - H, &n[2]),
                       shaped_tube_wall(tube, t, theta + H, &n[3])};
    Vec3 xt = vec3_sub(x[1], x[0]), xa = vec3_sub(x[3], x[2]), nt = vec3_sub(n[1], n[0]), na = vec3_sub(n[3], n[2]);
    double E = vec3_norm2(xt), F = vec3_dot(xt, xa), G = vec3_norm2(xa), L = -vec3_dot(nt, xt), M = -0.5 * (vec3_dot(nt, xa) + vec3_dot(na, xt)),
           N = -vec3_dot(na, xa);
    return 0.5 * (E * N - 2 * F * M + G * L) / (E * G - F * F);
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
            s->curvature = s->at_fork ? NAN : shape_curvature(shape, s->x, s->normal, 1e-3 * truth->radius[i]);
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
            s->curvature = tube_curvature(tube, t, 2 * PI * (k + 0.1) / AROUND);
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
            out->sample[out->count++] = (WallSample){.x = out->tree->point[p], .node = i, .curvature = NAN};
    return out->sample != NULL;
}

// --- Measures ---

typedef struct Row {
    double mean, p99, most, bias, normal_deg, bulge;
    double bending;          // mean |mean curvature| over that of the true wall, less 1 (AUMC times 2r, relative to truth's)
    double jump_deg, query_us;
    ModelMesh mesh;
    int64_t count;
} Row;

typedef struct Measuring {
    const Subject *subject;
    const FittedModel *fitted;
    double *gap, *turn, *curvature;
} Measuring;

static void measure_sample(void *context, long i)
{
    Measuring *m = context;
    const WallSample *s = &m->subject->sample[i];
    WallView view = fitted_model_look(m->fitted, m->subject->tree, s->node, s->x);
    m->gap[i] = view.gap;
    m->turn[i] = vec3_norm2(s->normal) > 0 ? vec3_angle(view.normal, s->normal) : 0;
    m->curvature[i] = view.curvature;
}

static bool measure(const ModelsBench *bench, const Subject *subject, const FittedModel *fitted, Row *row)
{
    size_t room = (size_t)subject->count + 1;
    Measuring m = {subject, fitted, calloc(room, sizeof *m.gap), calloc(room, sizeof *m.turn), calloc(room, sizeof *m.curvature)};
    bool good = m.gap && m.turn && m.curvature;
    *row = (Row){0};
    double sum = 0, bias = 0, square = 0, bent = 0, truly_bent = 0;
    if (good)
        parallel_for(bench->common.threads, (long)subject->count, measure_sample, &m, NULL);
    for (int64_t i = 0; good && i < subject->count; i++) {
        double e = fabs(m.gap[i]), r = subject->tree->radius[subject->sample[i].node];
        if (!(e < (vec3_norm2(subject->sample[i].normal) > 0 ? HUGE_VAL : 0.5 * r)))      // of a segmented tree: within another vessel's lumen
            continue;
        if (subject->sample[i].at_fork)
            row->bulge = fmax(row->bulge, m.gap[i] / r);
        if (isfinite(subject->sample[i].curvature) && isfinite(m.curvature[i]))
            bent += fabs(m.curvature[i]), truly_bent += fabs(subject->sample[i].curvature);
        sum += e, bias += m.gap[i], square += m.turn[i] * m.turn[i];
        m.gap[row->count++] = e;
    }
    if (good && row->count > 0) {
        sort_doubles(m.gap, (size_t)row->count);
        row->mean = sum / (double)row->count, row->bias = bias / (double)row->count, row->normal_deg = 180 / PI * sqrt(square / (double)row->count);
        row->p99 = m.gap[(int64_t)(0.99 * (double)(row->count - 1))], row->most = m.gap[row->count - 1];
        row->bending = truly_bent > 0 ? bent / truly_bent - 1 : NAN;
    }
    row->jump_deg = model_jump_deg(fitted, subject->tree);
    row->query_us = model_query_us(fitted, subject->tree);
    // published forms have no wall that is fit for a mesh
    if (!fitted->kind->is_printed)
        good = good && model_mesh(fitted, subject->tree, &row->mesh);
    free(m.gap);
    free(m.turn);
    free(m.curvature);
    return good;
}

static void report(const ModelsBench *bench, const char *name, const FittedModel *fitted, const Row *row, cJSON *rows)
{
    FILE *text = bench_text(&bench->common);
    fprintf(text, "%-12.12s %-11s %8.5f %8.5f %8.5f %+9.5f %7.3f %7.4f %+7.3f %7.2f %8lld %7.2f %7.1f", name, fitted->kind->name, row->mean, row->p99,
            row->most, row->bias, row->normal_deg, row->bulge, row->bending, row->jump_deg, (long long)fitted->numbers, fitted->seconds, row->query_us);
    if (!fitted->kind->is_printed)
        fprintf(text, " %7.3f %7lld %7.2f", row->mesh.seconds, (long long)row->mesh.triangles, 1000 * row->mesh.update_s);
    if (fitted->kind->is_swept)
        fprintf(text, "   noise %.5f, %lld left out, %lld folded, %lld not star-shaped, %d not polar", fitted->figures.noise,
                (long long)fitted->figures.left_out, (long long)fitted->figures.folded, (long long)fitted->figures.not_star_shaped, fitted->figures.shaped);
    fprintf(text, "\n");
    fflush(text);
    cJSON *out = cJSON_CreateObject();
    cJSON_AddStringToObject(out, "case", name);
    cJSON_AddStringToObject(out, "model", fitted->kind->name);
    cJSON_AddNumberToObject(out, "mean_mm", row->mean);
    cJSON_AddNumberToObject(out, "p99_mm", row->p99);
    cJSON_AddNumberToObject(out, "max_mm", row->most);
    cJSON_AddNumberToObject(out, "bias_mm", row->bias);
    cJSON_AddNumberToObject(out, "normal_deg", row->normal_deg);
    cJSON_AddNumberToObject(out, "bulge_radii", row->bulge);
    cJSON_AddNumberToObject(out, "mean_curvature_excess", row->bending);
    cJSON_AddNumberToObject(out, "jump_deg", row->jump_deg);
    cJSON_AddNumberToObject(out, "numbers", (double)fitted->numbers);
    cJSON_AddNumberToObject(out, "build_s", fitted->seconds);
    cJSON_AddNumberToObject(out, "query_80_us", row->query_us);
    cJSON_AddNumberToObject(out, "mesh_s", row->mesh.seconds);
    cJSON_AddNumberToObject(out, "triangles", (double)row->mesh.triangles);
    cJSON_AddNumberToObject(out, "update_s", row->mesh.update_s);
    cJSON_AddItemToArray(rows, out);
}

// Draws the models across the vessel or, where there are any, at a fork and at a sac.
static bool draw(const ModelsBench *bench, const char *name, const Subject *subject, const FittedModel *fitted, ModelsPicture *picture)
{
    PictureView view = {.name = name};
    bool fork = picture_view_fork(subject->tree, &view), good = !fork || models_picture_row(picture, &view, subject->tree, fitted, bench->common.threads);
    bool sac = picture_view_sac(subject->tree, &view);
    good = good && (!sac || models_picture_row(picture, &view, subject->tree, fitted, bench->common.threads));
    return good &&
           (fork || sac || !picture_view_across(subject->tree, &view) || models_picture_row(picture, &view, subject->tree, fitted, bench->common.threads));
}

static bool compare(const ModelsBench *bench, const char *name, const Subject *subject, ModelsPicture *picture, cJSON *rows, Faults *faults)
{
    bool good = true;
    FittedModel fitted[MODEL_KINDS] = {{0}};
    for (int i = 0; i < MODEL_KINDS && good; i++) {
        if (bench->only != MODEL_KINDS && bench->only != i)
            continue;
        Row row;
        good = fitted_model_create(&model_kind[i], subject->tree, subject->voxel, bench->common.threads, &bench->sweep, &fitted[i], faults) &&
               measure(bench, subject, &fitted[i], &row);
        if (good)
            report(bench, name, &fitted[i], &row, rows);
        if (!picture)
            fitted_model_free(&fitted[i]);
    }
    good = good && (!picture || draw(bench, name, subject, fitted, picture));
    for (int i = 0; i < MODEL_KINDS; i++)
        fitted_model_free(&fitted[i]);
    return good;
}

// A wire without friction in the shapes of two scenes, on each model and on the exact wall.
static bool compare_runs(const ModelsBench *bench, cJSON *root, Faults *faults)
{
    static const char *const scene[][2] = {{"spiral", "scenes/collision/spiral.yaml"}, {"phantom", "scenes/collision/phantom.yaml"}};
    FILE *text = bench_text(&bench->common);
    cJSON *rows = cJSON_AddArrayToObject(root, "runs");
    fprintf(text, "\n%-12s %-11s %10s %12s %10s %12s\n", "run", "model", "deepest mm", "push-exact %", "jitter rms", "work lost N");
    for (int k = 0; k < 2; k++)
        for (int i = 0; i < MODEL_KINDS; i++) {
            ModelLoop loop;
            if (bench->only != MODEL_KINDS && bench->only != i)
                continue;
            if (!model_loop(scene[k][1], &model_kind[i], bench->common.threads, &loop, faults))
                return false;
            fprintf(text, "%-12s %-11s %10.4f %+12.2f %10.4f %12.5f%s\n", scene[k][0], model_kind[i].name, loop.deepest_mm, 100 * loop.push_over_exact,
                    loop.jitter_rms, loop.work_n, loop.survived ? "" : "   did not reach the end");
            fflush(text);
            cJSON *out = cJSON_CreateObject();
            cJSON_AddStringToObject(out, "run", scene[k][0]);
            cJSON_AddStringToObject(out, "model", model_kind[i].name);
            cJSON_AddNumberToObject(out, "deepest_mm", loop.deepest_mm);
            cJSON_AddNumberToObject(out, "push_over_exact", loop.push_over_exact);
            cJSON_AddNumberToObject(out, "jitter_rms", loop.jitter_rms);
            cJSON_AddNumberToObject(out, "work_lost_n", loop.work_n);
            cJSON_AddBoolToObject(out, "survived", loop.survived);
            cJSON_AddItemToArray(rows, out);
        }
    return true;
}

static bool is_wanted(const ModelsBench *bench, const char *name)
{
    for (int i = 0; i < bench->shape_count; i++)
        if (!strncmp(bench->shape[i], name, strlen(bench->shape[i])))
            return true;
    return bench->shape_count == 0;
}

static int call(void *structure, Faults *faults)
{
    ModelsBench *bench = structure;
    cJSON *root = cJSON_CreateObject(), *rows = cJSON_AddArrayToObject(root, "rows");
    FILE *text = bench_text(&bench->common);
    fprintf(text, "%s\n%-12s %-11s %8s %8s %8s %9s %7s %7s %7s %7s %8s %7s %7s %7s %7s %7s\n", bench_processor(), "case", "model", "mean mm", "p99", "max",
            "bias", "nrm deg", "bulge r", "bending", "jump", "numbers", "build s", "us/80", "mesh s", "faces", "upd ms");
    ModelsPicture picture = {0};
    bool good = !bench->picture || models_picture_open(&picture, bench->picture, faults);
    int count = (int)(sizeof cases / sizeof cases[0]) - (bench->common.quick ? 2 : 0);
    for (int i = 0; i < count && good && bench->tree_count == 0; i++) {
        Subject subject = {0};
        const Case *c = &cases[i];
        if (!is_wanted(bench, c->name))
            continue;
        static const char *const tube[] = {[SHAPED_STAR] = "star", [SHAPED_ELLIPSE] = "ellipse", [SHAPED_KIDNEY] = "kidney"};
        int which = 0;
        while (which < 3 && strcmp(c->shape, tube[which]))
            which++;
        good = which < 3 ? sample_tube((ShapedTube)which, c->noise, &subject) : sample_shape(c, &subject, faults);
        good = good && compare(bench, c->name, &subject, bench->picture ? &picture : NULL, rows, faults);
        free_subject(&subject);
    }
    for (int i = 0; i < bench->tree_count && good; i++) {
        Subject subject = {0};
        const char *slash = strrchr(bench->tree[i], '/');
        good = take_tree(bench->tree[i], &subject, faults) &&
               compare(bench, slash ? slash + 1 : bench->tree[i], &subject, bench->picture ? &picture : NULL, rows, faults);
        free_subject(&subject);
    }
    if (bench->picture && picture.out)
        good = models_picture_close(&picture, bench->picture, faults) && good;
    good = good && (bench->tree_count > 0 || bench->shape_count > 0 || bench->common.quick || compare_runs(bench, root, faults));
    if (!good && faults->count == 0)
        faults_add(faults, "bench models", 0, 0, "not enough memory");
    good = good && bench_write_json(&bench->common, root, faults);
    cJSON_Delete(root);
    return EXIT_DONE;
}

static void set_defaults(void *structure) { *(ModelsBench *)structure = (ModelsBench){.only = MODEL_KINDS, .sweep = sweep_fit_default_options()}; }

static const char *take_path(void *structure, const Option *option, const char *text)
{
    ModelsBench *bench = structure;
    (void)option;
    if (bench->tree_count == MOST_TREES)
        return "at most eight";
    bench->tree[bench->tree_count++] = text;
    return NULL;
}

static const char *take_shape(void *structure, const Option *option, const char *text)
{
    ModelsBench *bench = structure;
    (void)option;
    if (bench->shape_count == MOST_SHAPES)
        return "at most eight";
    bench->shape[bench->shape_count++] = text;
    return NULL;
}

#define AT(member) OPTION_AT(ModelsBench, member)
static const char *const only_choices[] = {"lim", "lim-paper", "sweep", "raster", "rbf", "pas", "sweep-paper", "rbf-paper", "pas-paper", NULL};
static const Option options[] = {
    {"tree", "F.h5", OPTION_FILE, AT(tree), "a segmented tree instead of the shapes, of a case its CASE/model.h5; may be given several times",
     .take = take_path},
    {"model", "NAME", OPTION_CHOICE, AT(only), "only this model", .choices = only_choices, .otherwise = "all"},
    {"case", "NAME", OPTION_TEXT, AT(shape), "only the cases whose names begin so; may be given several times", .otherwise = "all", .take = take_shape},
    {"picture", "F.svg", OPTION_FILE, AT(picture), "sections through all models, one row of cells for each case, fork and sac (at most eight)"},
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
    .intro = "Fits vessel models to shapes whose wall is known: shared blobs (lim), swept polar sections (sweep), sections of other kinds (raster, rbf, pas), "
             "and each as "
             "published (-paper). Measures them at wall points that they were not fitted to: mean, 99th percentile and largest distance, mean with its sign "
             "(+: too wide), "
             "root mean square of the normal's error, largest bulge outside the true wall at forks in local radii, mean absolute mean curvature over the true "
             "wall's less 1 "
             "(bending; away from forks), largest jump of the normal along the vessels, numbers stored, seconds of the fit, microseconds for 80 contact "
             "queries, CPU seconds and triangles of the mesh, and milliseconds of its update. Then a "
             "wire without friction is pushed through two shapes on each model and on the exact wall.",
    .exits = CLI_BAD_INPUT_EXITS,
    CLI_OPTIONS(options, ModelsBench),
    .set_defaults = set_defaults,
};

const Verb bench_models = {.options = &table, .call = call};
