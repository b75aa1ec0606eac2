#include "bench/model_runs.h"

#include "base/sort_doubles.h"
#include "bench/collision_run.h"
#include "bench/shape_vessel.h"
#include "geom/random.h"
#include "recon/phantom/phantom.h"

#include <stdlib.h>
#include <time.h>

// --- Jumps ---

// A point beside the line from node to node, `off` radii from it.
static Vec3 point_beside(const VesselTree *tree, int from, int to, double share, double angle, double off)
{
    Vec3 along = vec3_unit_or(vec3_sub(tree->center[to], tree->center[from]), vec3(1, 0, 0)), across = vec3_normal_to(along);
    double r = off * ((1 - share) * tree->radius[from] + share * tree->radius[to]);
    Vec3 out = vec3_add(vec3_scale(across, same_cos(angle)), vec3_scale(vec3_cross(along, across), same_sin(angle)));
    return vec3_add_scaled(vec3_mix(tree->center[from], tree->center[to], share), r, out);
}

typedef struct Line {
    const FittedModel *model;
    const VesselTree *tree;
    int from, to;
    double angle;
} Line;

static WallView look(const Line *line, double share)
{
    static const double OFF = 0.97;          // [radii] near the wall: the normal is that of its level
    return fitted_model_look(line->model, line->tree, line->from, point_beside(line->tree, line->from, line->to, share, line->angle, OFF));
}

static Vec3 foot(const Line *line, double share, const WallView *view)
{
    return vec3_add_scaled(point_beside(line->tree, line->from, line->to, share, line->angle, 1), -view->gap, view->normal);
}

// The turn left when the interval between two places is halved down, always towards the larger turn. A foot that changes to another part of the wall is no edge.
static double narrow_down(const Line *line, double low, double high)
{
    enum { HALVINGS = 22 };
    static const double SAME = 0.02;         // [radii]
    WallView a = look(line, low), b = look(line, high);
    for (int i = 0; i < HALVINGS; i++) {
        double middle = 0.5 * (low + high);
        WallView m = look(line, middle);
        if (vec3_angle(a.normal, m.normal) > vec3_angle(m.normal, b.normal))
            high = middle, b = m;
        else
            low = middle, a = m;
    }
    bool same_foot = line->model->field || vec3_distance(foot(line, low, &a), foot(line, high, &b)) < SAME * line->tree->radius[line->from];
    return same_foot ? 180 / PI * vec3_angle(a.normal, b.normal) : 0;
}

double model_jump_deg(const FittedModel *model, const VesselTree *tree)
{
    enum { STEPS = 16, LINES = 6, NODES_MOST = 400 };
    static const double TURN = 0.01;         // [rad] between neighbouring places that is looked at
    double worst = 0;
    int every = tree->node_count / NODES_MOST + 1;
    for (int i = 1; i < tree->node_count; i += every) {
        Line line = {model, tree, tree->parent[i], i, 0};
        if (line.from < 0 || tree->kind[i] != NODE_VESSEL || tree->kind[line.from] != NODE_VESSEL)
            continue;
        for (int k = 0; k < LINES; k++) {
            line.angle = 2 * PI * (k + 0.3) / LINES;
            WallView last = look(&line, 0);
            for (int step = 1; step <= STEPS; step++) {
                WallView next = look(&line, (double)step / STEPS);
                if (vec3_angle(last.normal, next.normal) > TURN)
                    worst = fmax(worst, narrow_down(&line, (step - 1.0) / STEPS, (double)step / STEPS));
                last = next;
            }
        }
    }
    return worst;
}

// --- Queries ---

double model_query_us(const FittedModel *model, const VesselTree *tree)
{
    enum { POINTS = 80, ROUNDS = 60 };
    Vec3 start[POINTS], x[POINTS], along[POINTS];
    VesselMemory memory[POINTS];
    VesselHit hit[POINTS];
    double us[ROUNDS];
    Random random = {11};
    for (int i = 0; i < POINTS; i++) {
        int node = 0;
        for (int trial = 0; trial < 100 && (trial == 0 || tree->parent[node] < 0 || tree->kind[node] != NODE_VESSEL); trial++)
            node = (int)(random_open(&random) * tree->node_count);
        int from = tree->parent[node] >= 0 ? tree->parent[node] : node;
        start[i] = x[i] = point_beside(tree, from, node, random_open(&random), 2 * PI * random_open(&random), 0.7);
        along[i] = vec3_scale(tree->direction[node], 0.05);
        memory[i] = (VesselMemory){.node = node};
    }
    for (int round = 0; round < ROUNDS; round++) {
        struct timespec a, b;
        for (int i = 0; i < POINTS; i++)
            x[i] = vec3_add_scaled(start[i], round % 20 < 10 ? round % 20 : 20 - round % 20, along[i]);
        clock_gettime(CLOCK_THREAD_CPUTIME_ID, &a);
        vessel_query(model->vessel, POINTS, x, HUGE_VAL, memory, hit);
        clock_gettime(CLOCK_THREAD_CPUTIME_ID, &b);
        us[round] = 1e6 * (double)(b.tv_sec - a.tv_sec) + 1e-3 * (double)(b.tv_nsec - a.tv_nsec);
    }
    sort_doubles(us, ROUNDS);
    return us[ROUNDS / 2];
}

// --- Meshes ---

static double cpu_seconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static bool update_mesh(const FittedModel *model, SweepMesh *mesh, double *seconds)
{
    const SweepBranch *b = &model->sweep->branch[0];
    double *row = model->sweep->row + (size_t)(b->first_row + b->break_count / 2) * SWEEP_TERMS, before = row[0], begin = cpu_seconds();
    row[0] *= 1.01;
    SweepField *changed = sweep_field_create(model->sweep);
    bool good = changed && sweep_mesh_update(mesh, changed);
    *seconds = cpu_seconds() - begin;
    row[0] = before;
    sweep_field_free(changed);
    return good;
}

bool model_mesh(const FittedModel *model, const VesselTree *tree, ModelMesh *out)
{
    double begin = cpu_seconds();
    *out = (ModelMesh){NAN, NAN, 0};
    if (model->lim) {
        TriangleMesh *mesh = isosurface_of_tree(model->lim, isosurface_cell_for(tree));
        *out = (ModelMesh){cpu_seconds() - begin, NAN, mesh ? mesh->triangle_count : 0};
        triangle_mesh_free(mesh);
        return mesh != NULL;
    }
    SweepMesh *mesh = sweep_mesh_create(model->field, NULL);
    bool good = mesh != NULL;
    if (good)
        *out = (ModelMesh){cpu_seconds() - begin, NAN, mesh->surface->triangle_count};
    good = good && update_mesh(model, mesh, &out->update_s);
    sweep_mesh_free(mesh);
    return good;
}

// --- Runs ---

// One run; the pushes are in push_n. stop: at the first failure, because a published model that is unfit for contact takes minutes to go on.
static bool run(const Scene *scene, const Vessel *wall, const Vessel *exact, bool stop, double *push_n, CollisionLoop *loop, Faults *faults)
{
    LoopOptions options = {.most_steps = INT64_MAX, .without_friction = true, .stop_at_failure = stop, .contact = scene->contact_options, .push_n = push_n};
    return collision_loop(scene, wall, exact, exact, &options, loop, faults);
}

bool model_loop(const char *scene_path, const ModelKind *kind, int threads, ModelLoop *out, Faults *faults)
{
    *out = (ModelLoop){NAN, NAN, NAN, NAN, false};
    Scene *scene = scene_load(scene_path, faults);
    Shape *shape = scene ? shape_create(scene->shape_name, scene->shape_option_count, (const char(*)[2][64])scene->shape_option, scene_path, faults) : NULL;
    VesselTree *tree = shape ? shape_sample(shape, faults) : NULL;
    Vessel *exact = shape ? shape_vessel_create(shape) : NULL;
    SweepFitOptions sweep = sweep_fit_default_options();
    FittedModel model = {0};
    bool good = tree && exact && fitted_model_create(kind, tree, shape_voxel_mm(shape), threads, &sweep, &model, faults);
    OpenVessel open = {.vessel = model.vessel};
    good = good && open_vessel_inlet(scene, &open, faults);
    int64_t steps = good ? bench_steps(scene, INT64_MAX) : 0;
    double *felt = calloc((size_t)steps + 1, sizeof *felt), *right = calloc((size_t)steps + 1, sizeof *right);
    CollisionLoop loop, truth;
    good = good && felt && right && run(scene, model.vessel, exact, kind->is_printed, felt, &loop, faults) &&
           run(scene, exact, exact, false, right, &truth, faults);
    if (good) {
        int64_t felt_steps = loop.survived ? loop.steps : loop.failed_step, right_steps = truth.survived ? truth.steps : truth.failed_step;
        PushFigures push = collision_push(felt, felt_steps, right, right_steps);
        *out = (ModelLoop){loop.penetration_um / 1000, push.mean_n / push.reference_n - 1, push.jitter_rms, loop.work_n, loop.survived};
    }
    free(felt);
    free(right);
    if (exact)
        exact->destroy(exact);
    fitted_model_free(&model);
    vessel_tree_free(tree);
    shape_free(shape);
    scene_free(scene);
    return good;
}
