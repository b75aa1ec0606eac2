// seldinger bench collision: implicit models compared with triangles, the exact wall and a sampled distance, in one run (Kerrien 2017, sections 6.3 to 6.5).
//
//   same motion    positions of all free nodes in a run on the exact wall, queried from each representation: time and error of detection
//   closed loop    the same push simulated on each representation; the path of the wire is compared with that on the exact wall
//   no friction    the same with mu = 0: the push is then due to the wall's roughness
//   clamps         the contact solver stopped after 50, 100, 200, 1000 iterations (section 6.5)
#include "bench/bench.h"

#include "bench/collision_chart.h"
#include "bench/collision_growth.h"
#include "bench/collision_run.h"
#include "bench/collision_surface.h"
#include "cli/output_plan.h"
#include "geom/mesh_vessel.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { CASES = 7, SCENES_MOST = 16, CAPS = 4, FORMS = 2, SCENE_TRIANGLES = 105000, QUICK_STEPS = 300, QUICK_TRIANGLES = 12000 };
enum { CLAMP_STEPS = 1000, POINTWISE_STEPS = 600, QUICK_POINTWISE_STEPS = 200 };
enum { LARGE = 100000, TIMES_FASTER = 8 };   // required speed of detection in the field of blobs: this many times faster than on this many triangles …
static const double FLAT = 1.2;              // … and within this ratio whatever the size of the tree

static const CollisionCase cases[CASES] = {
    {.name = "capsule",
     .scene = "scenes/peer/capsule-a-100.yaml",
     .convolution_capsule = true,
     .mesh_count = 1,
     .triangles = {12000},
     .pointwise_steps = 300,
     .paper_name = "Capsule",
     .paper_mesh = {{4.89, 51}},
     .paper_lim = {0.0232, 50}},
    {.name = "spiral",
     .scene = "scenes/collision/spiral.yaml",
     .mesh_count = 3,
     .triangles = {2740, 11300, 45000},
     .pointwise_steps = 300,
     .paper_name = "Spiral",
     .paper_mesh = {{1.09, 79}, {1.84, 80}, {5.58, 80}},
     .paper_lim = {0.0219, 80}},
    {.name = "phantom",
     .scene = "scenes/collision/phantom.yaml",
     .mesh_count = 1,
     .triangles = {SCENE_TRIANGLES},
     .pointwise_steps = POINTWISE_STEPS,
     .paper_name = "Vascular Model (another vessel)",
     .paper_mesh = {{16.23, 80}},
     .paper_lim = {0.133, 82}},
    {.name = "aneurism", .scene = "scenes/collision/aneurism.yaml", .mesh_count = 1, .triangles = {SCENE_TRIANGLES}},
    {.name = "peer a", .scene = "scenes/peer/capsule-a-100.yaml", .mesh_count = 1, .triangles = {12000}},
    {.name = "peer b", .scene = "scenes/peer/tube-b-100.yaml", .mesh_count = 1, .triangles = {44640}, .pointwise_steps = POINTWISE_STEPS},
    {.name = "peer c", .scene = "scenes/peer/tube-c-100.yaml", .mesh_count = 1, .triangles = {44640}}};
static const struct {
    const char *name, *needs, *how;
} needed[] = {{"aneurism", "scenes/aneurism/aneurism.h5", "scenes/aneurism/prepare makes it"},
              {"peer b", "scenes/peer/tube-b-centreline.csv", "scenes/peer/prepare brings it"},
              {"peer c", "scenes/peer/tube-c-centreline.csv", "scenes/peer/prepare brings it"}};
static const char legend[] =
    "exact: the true wall, if it can be queried; lim: one field of shared blobs; lim fine: the same fitted ten times closer; lim-blend: local\n"
    "models, neighbours blended; lim-switch: the paper's method, only a point's own model; mesh full, warm, cached: flat triangles, searched by Embree\n"
    "without a start value, within the last distance, and only if the cached neighbourhood is not enough; mesh curved: triangles with the curvature\n"
    "of the wall as Hessian; mesh smooth: interpolated normals; grid: a sampled distance, trilinear, with the mesh's edge as its cell\n";
static const char *const in_quick[] = {"capsule", "spiral"}, *const clamped[] = {"capsule", "spiral", "phantom", "peer b"},
                         *const clamped_quick[] = {"capsule"};
static const int caps[CAPS] = {50, 100, 200, 1000};
static const char *const form_name[FORMS] = {"block", "pointwise"};

typedef struct Row {
    const CollisionCase *of;
    CollisionWall wall;                  // its vessel is already destroyed
    int64_t primitives;
    double bytes, bytes_per_mm;
    bool truth_is_model, has_loop;
    const char *reference;               // the wall on which the motion was recorded, and whose push is the reference
    CollisionReplay motion;
    CollisionLoop loop, smooth;          // `smooth`: mu = 0
    PushFigures push;
} Row;

typedef struct Clamp {
    const char *surface, *wall;
    int form, cap;
    CollisionLoop loop;
} Clamp;

typedef struct EqualError {              // a mesh with the same error as the model
    const char *surface;
    double lim_um, mesh_um, lim_us, warm_us, cached_us;
    int triangles;
} EqualError;

typedef struct Verdict {
    char item[192];
    double must, measured;
    bool at_most, good;      // at_most: `must` is an upper limit, else a lower limit
} Verdict;

typedef struct CollisionBench {
    BenchOptions common;
    const char *chart;
    char **scene;            // on the command line
    int scene_count;
    bool given;
    int case_count;
    CollisionCase list[SCENES_MOST];     // of the command line, or `cases`
    FILE *out;
    int row_count, clamp_count, equal_count, verdict_count;
    Row *row;
    Clamp *clamp;
    EqualError *equal;
    Verdict *verdict;
} CollisionBench;

static bool is_listed(const char *name, const char *const *list, size_t count)
{
    for (size_t i = 0; i < count; i++)
        if (!strcmp(name, list[i]))
            return true;
    return false;
}

// Appends a zeroed element to a growing array; NULL with a fault.
static void *further(void **array, int *count, size_t size, Faults *faults)
{
    char *bigger = realloc(*array, ((size_t)*count + 1) * size);
    if (!bigger) {
        faults_add(faults, "bench collision", 0, 0, "not enough memory");
        return NULL;
    }
    *array = bigger;
    return memset(bigger + size * (size_t)(*count)++, 0, size);
}

// --- one surface ---

typedef struct Run {         // of one surface
    const CollisionSurface *surface;
    const CollisionWalls *walls;
    int64_t most_steps;
    int first_row;           // its rows in the bench
    CollisionMotion motion;
    double *push, *reference_push;   // (steps)
    int64_t reference_steps;
} Run;

static bool is_mesh_search(const char *name) { return !strcmp(name, "mesh full") || !strcmp(name, "mesh warm") || !strcmp(name, "mesh cached"); }

// In closed loop the mesh uses the fastest search: all searches give the same result.
static bool is_fastest_search(const CollisionBench *bench, const Run *run, const Row *row)
{
    for (int i = run->first_row; i < bench->row_count; i++) {
        const Row *other = &bench->row[i];
        if (other != row && other->wall.mesh == row->wall.mesh && is_mesh_search(other->wall.name) && other->motion.us_per_step < row->motion.us_per_step)
            return false;
    }
    return true;
}

static bool run_loops(CollisionBench *bench, Run *run, int index, Faults *faults)
{
    Row *row = &bench->row[index];
    const CollisionSurface *s = run->surface;
    const Vessel *wall = run->walls->wall[index - run->first_row].vessel;
    LoopOptions options = {.most_steps = run->most_steps, .contact = s->scene->contact_options};
    row->has_loop = true;
    bool is_reference = index == run->first_row;
    if (!is_reference && !collision_loop(s->scene, wall, s->truth, s->truth_gap, &options, &row->loop, faults))
        return false;
    options.without_friction = true;
    options.push_n = is_reference ? run->reference_push : run->push;
    if (!collision_loop(s->scene, wall, s->truth, s->truth_gap, &options, &row->smooth, faults))
        return false;
    if (is_reference)
        run->reference_steps = row->smooth.steps;
    // if the wire is stuck in the wall, or has left it, the push is not friction
    row->push = collision_push(options.push_n, row->smooth.survived ? row->smooth.steps : row->smooth.failed_step, run->reference_push, run->reference_steps);
    return true;
}

static bool no_memory(const char *name, Faults *faults)
{
    faults_add(faults, name, 0, 0, "not enough memory for the recorded motion");
    return false;
}

// A shape's own distance is too slow for simulation: its cost is measured in a few steps, and its error is zero.
static bool replay(const CollisionSurface *s, const CollisionWall *wall, const CollisionMotion *motion, int repeats, CollisionReplay *out, Faults *faults)
{
    enum { STEPS = 100 };
    bool is_slow = s->shape && wall->vessel == s->truth;
    CollisionMotion last = *motion;
    if (is_slow && motion->steps > STEPS) {
        last.steps = STEPS;
        last.first_node += motion->steps - STEPS;
        last.offset += motion->steps - STEPS;
        last.reach += motion->steps - STEPS;
    }
    return collision_replay(wall->vessel, &last, is_slow ? 1 : repeats, out) || no_memory(s->of->name, faults);
}

static bool measure_walls(CollisionBench *bench, Run *run, const Progress *progress, Faults *faults)
{
    const CollisionSurface *s = run->surface;
    const CollisionWalls *walls = run->walls;
    LoopOptions record = {.most_steps = run->most_steps, .contact = s->scene->contact_options, .record = &run->motion};
    run->first_row = bench->row_count;
    for (int i = 0; i < walls->count; i++) {
        Row *row = further((void **)&bench->row, &bench->row_count, sizeof *row, faults);
        if (!row)
            return false;
        const CollisionWall *wall = &walls->wall[i];
        *row = (Row){.of = s->of,
                     .wall = *wall,
                     .primitives = wall->vessel->primitives,
                     .bytes = (double)wall->vessel->bytes,
                     .bytes_per_mm = (double)wall->vessel->bytes / s->length_mm,
                     .truth_is_model = s->truth_is_model,
                     .reference = walls->wall[0].name};
    }
    if (!collision_loop(s->scene, walls->wall[0].vessel, s->truth, s->truth_gap, &record, &bench->row[run->first_row].loop, faults))
        return false;
    if (!collision_motion_judge(&run->motion, s->truth))
        return no_memory(s->of->name, faults);
    for (int i = 0; i < walls->count; i++)
        if (!replay(s, &walls->wall[i], &run->motion, bench->common.quick ? 1 : 3, &bench->row[run->first_row + i].motion, faults))
            return false;
    for (int i = run->first_row; i < bench->row_count; i++) {
        if (progress->call)
            progress->call(progress->context, i - run->first_row, walls->count);
        if (is_mesh_search(bench->row[i].wall.name) && !is_fastest_search(bench, run, &bench->row[i]))
            continue;
        if (!run_loops(bench, run, i, faults))
            return false;
    }
    return true;
}

static const Row *row_of(const CollisionBench *bench, const CollisionCase *of, const char *name, int mesh)
{
    for (int i = 0; i < bench->row_count; i++)
        if (bench->row[i].of == of && !strcmp(bench->row[i].wall.name, name) && bench->row[i].wall.mesh == mesh)
            return &bench->row[i];
    return NULL;
}

// The closed-loop row of the finest mesh; NULL without meshes.
static const Row *mesh_in_loop(const CollisionBench *bench, const CollisionCase *of)
{
    for (int i = 0; i < bench->row_count; i++) {
        const Row *row = &bench->row[i];
        if (row->of == of && is_mesh_search(row->wall.name) && row->wall.mesh + 1 == of->mesh_count && row->has_loop)
            return row;
    }
    return NULL;
}

// --- equal error ---

static Vessel *mesh_searched(const TriangleMesh *mesh, MeshSearch search, const char *name, Faults *faults)
{
    MeshVesselOptions options = mesh_vessel_default_options();
    options.search = search;
    return mesh_vessel_create(mesh, &options, name, faults);
}

static bool try_mesh(const Run *run, double wanted, EqualError *equal, Faults *faults)
{
    const CollisionSurface *s = run->surface;
    CollisionMesh made;
    CollisionReplay warm, cached;
    TriangleMesh *mesh = collision_mesh(s, wanted, &made, faults);
    Vessel *warm_wall = mesh ? mesh_searched(mesh, MESH_SEARCH_WARM, s->of->name, faults) : NULL;
    Vessel *cached_wall = warm_wall ? mesh_searched(mesh, MESH_SEARCH_CACHED, s->of->name, faults) : NULL;
    bool good = cached_wall && ((collision_replay(warm_wall, &run->motion, 2, &warm) && collision_replay(cached_wall, &run->motion, 2, &cached)) ||
                                no_memory(s->of->name, faults));
    if (good) {
        equal->triangles = mesh->triangle_count;
        equal->mesh_um = warm.gap_um.rms;
        equal->warm_us = warm.us_per_80_points;
        equal->cached_us = cached.us_per_80_points;
    }
    if (warm_wall)
        warm_wall->destroy(warm_wall);
    if (cached_wall)
        cached_wall->destroy(cached_wall);
    triangle_mesh_free(mesh);
    return good;
}

// A mesh's error is proportional to its triangles' size squared, i.e. to one over their number, which gives the mesh with the required error.
static bool find_equal_error(CollisionBench *bench, const Run *run, Faults *faults)
{
    enum { ROUNDS = 3, LEAST = 300, MOST = 1000000 };
    const CollisionSurface *s = run->surface;
    const Row *lim = row_of(bench, s->of, "lim", -1), *mesh = row_of(bench, s->of, "mesh warm", s->of->mesh_count - 1);
    if (!lim || !mesh || s->truth_is_model || !(lim->motion.gap_um.rms > 0) || !(mesh->motion.gap_um.rms > 0))
        return true;
    EqualError trial = {.surface = s->of->name,
                        .lim_um = lim->motion.gap_um.rms,
                        .lim_us = lim->motion.us_per_80_points,
                        .triangles = mesh->wall.triangles,
                        .mesh_um = mesh->motion.gap_um.rms,
                        .warm_us = mesh->motion.us_per_80_points};
    const Row *cached = row_of(bench, s->of, "mesh cached", s->of->mesh_count - 1);
    trial.cached_us = cached ? cached->motion.us_per_80_points : NAN;
    EqualError best = trial;
    for (int round = 0; round < ROUNDS && fabs(best.mesh_um / best.lim_um - 1) > 0.1; round++) {
        double wanted = fmin(MOST, fmax(LEAST, best.triangles * best.mesh_um / best.lim_um));
        if (!try_mesh(run, wanted, &trial, faults))
            return false;
        if (fabs(log(trial.mesh_um / trial.lim_um)) >= fabs(log(best.mesh_um / best.lim_um)))
            break;
        best = trial;
    }
    EqualError *equal = further((void **)&bench->equal, &bench->equal_count, sizeof *equal, faults);
    if (equal)
        *equal = best;
    return equal != NULL;
}

// --- clamps ---

static bool run_clamps(CollisionBench *bench, const Run *run, Faults *faults)
{
    const CollisionSurface *s = run->surface;
    const CollisionWalls *walls = run->walls;
    const Row *mesh = mesh_in_loop(bench, s->of);
    int finest = s->of->mesh_count - 1;
    const CollisionWall *list[] = {collision_wall_find(walls, "lim", -1), mesh ? collision_wall_find(walls, mesh->wall.name, finest) : NULL,
                                   collision_wall_find(walls, "mesh curved", finest), collision_wall_find(walls, "mesh smooth", finest),
                                   collision_wall_find(walls, "grid", -1)};
    for (int form = 0; form < FORMS; form++)
        for (size_t w = 0; w < (bench->common.quick ? 2 : sizeof list / sizeof list[0]); w++)
            for (int c = 0; list[w] && c < CAPS; c++) {
                Clamp *clamp = further((void **)&bench->clamp, &bench->clamp_count, sizeof *clamp, faults);
                if (!clamp)
                    return false;
                *clamp = (Clamp){.surface = s->of->name, .wall = list[w]->name, .form = form, .cap = caps[c]};
                LoopOptions options = {.most_steps = form == 0             ? CLAMP_STEPS
                                                     : bench->common.quick ? QUICK_POINTWISE_STEPS
                                                                           : s->of->pointwise_steps,
                                       .stop_at_failure = true,
                                       .contact = s->scene->contact_options};
                options.most_steps = options.most_steps < run->most_steps ? options.most_steps : run->most_steps;
                options.contact.form = form ? CONTACT_POINTWISE : CONTACT_BLOCK;
                options.contact.max_iterations = caps[c];
                if (!collision_loop(s->scene, list[w]->vessel, s->truth, s->truth_gap, &options, &clamp->loop, faults))
                    return false;
            }
    return true;
}

// --- text ---

static void text_of_mesh(const Row *row, char *text, size_t size)
{
    if (row->wall.triangles > 0)
        snprintf(text, size, "%s, %.1fk", row->wall.name, row->wall.triangles / 1000.0);
    else if (row->wall.cell_mm > 0)
        snprintf(text, size, "%s, %.3f mm", row->wall.name, row->wall.cell_mm);
    else
        snprintf(text, size, "%s", row->wall.name);
}

static void text_of_seconds(double seconds, char text[16])
{
    if (isfinite(seconds))
        snprintf(text, 16, "%.2f", seconds);
    else
        snprintf(text, 16, "-");
}

static void print_motion(FILE *out, const CollisionBench *bench, int first)
{
    fprintf(out, "  the same motion        primitives       MB  kB a mm   made of [s]  vessel [s]   us a step  us of 80 near  "
                 "gap error [um] rms, max    normal [deg] rms, max   lost\n");
    for (int i = first; i < bench->row_count; i++) {
        const Row *row = &bench->row[i];
        const CollisionReplay *m = &row->motion;
        char name[48], made[16], built[16];
        text_of_mesh(row, name, sizeof name);
        text_of_seconds(row->wall.surface_s, made);
        text_of_seconds(row->wall.build_s, built);
        fprintf(out, "    %-20s %10lld %8.2f %8.1f    %10s  %10s  %10.2f     %10.2f    %10.3f %10.2f       %8.3f %8.2f %6lld\n", name,
                (long long)row->primitives, row->bytes / 1e6, row->bytes_per_mm / 1e3, made, built, m->us_per_step, m->us_per_80_points, m->gap_um.rms,
                m->gap_um.max, m->normal_deg.rms, m->normal_deg.max, (long long)m->lost);
    }
}

// The excess of the push without friction over the reference; undefined if the wire was stuck in the wall or left it.
static double artificial_friction(const Row *row) { return row->smooth.survived ? row->push.mean_n - row->push.reference_n : NAN; }

static void print_loops(FILE *out, const CollisionBench *bench, int first)
{
    fprintf(out, "  closed loop            detect  contact     step us (p99)   candidates (max)  with force (max)  iterations  not converged  deepest [um]\n");
    for (int i = first; i < bench->row_count; i++) {
        const Row *row = &bench->row[i];
        const CollisionLoop *l = &row->loop;
        char name[48];
        text_of_mesh(row, name, sizeof name);
        if (row->has_loop)
            fprintf(out, "    %-20s %6.1f %8.1f  %7.1f (%7.1f)         %3.0f (%3.0f)         %3.0f (%3.0f)  %10.0f     %10lld    %10.1f  %s%s\n", name,
                    l->detect_us, l->contact_us, l->step_us.median, l->step_us.p99, l->candidates, l->candidates_max, l->contacts, l->contacts_max,
                    l->iterations, (long long)l->not_converged, l->penetration_um, l->survived ? "survived" : "FAILED: ", l->why);
    }
    fprintf(out, "  the same, mu = 0       push [N]  artificial [N]    (%%)   jitter rms     p99   work lost [N]  as a mu   deepest [um]; push against %s\n",
            bench->row[first].reference);
    for (int i = first; i < bench->row_count; i++) {
        const Row *row = &bench->row[i];
        const CollisionLoop *l = &row->smooth;
        char name[48], artificial[32];
        text_of_mesh(row, name, sizeof name);
        if (l->survived)
            snprintf(artificial, sizeof artificial, "%10.4f %6.1f", artificial_friction(row), 100 * artificial_friction(row) / row->push.reference_n);
        else
            snprintf(artificial, sizeof artificial, "%10s %6s", "-", "-");
        if (row->has_loop)
            fprintf(out, "    %-20s %9.4f      %s     %8.4f %7.4f      %10.5f %8.5f     %10.1f  %s%s\n", name, row->push.mean_n, artificial,
                    row->push.jitter_rms, row->push.jitter_p99, l->work_n, l->work_mu, l->penetration_um, l->survived ? "survived" : "FAILED: ", l->why);
    }
}

static void print_surface(FILE *out, const CollisionBench *bench, const Run *run)
{
    const CollisionSurface *s = run->surface;
    const Row *first = &bench->row[run->first_row], *last = &bench->row[bench->row_count - 1];
    fprintf(out, "\n%s: truth is %s; %.0f mm of centreline; motion recorded on %s: %lld steps, %.1f points a step, of which %.1f near\n", s->of->name,
            s->truth_is, s->length_mm, first->reference, (long long)last->motion.steps, last->motion.points_per_step,
            (double)last->motion.near_points / fmax(1, (double)last->motion.steps));
    if (run->walls->without_mesh)
        fprintf(out, "  mesh rows: %s\n", run->walls->without_mesh);
    print_motion(out, bench, run->first_row);
    print_loops(out, bench, run->first_row);
    fflush(out);
}

static void print_clamps(FILE *out, const CollisionBench *bench)
{
    if (bench->clamp_count == 0)
        return;
    fprintf(out,
            "\nclamped contact iterations (paper, section 6.5): survived, or the step at which it failed: how (um outside); deepest [um]; steps not "
            "converged\n"
            "  surface                  form       wall          %27d %27d %27d %27d\n",
            caps[0], caps[1], caps[2], caps[3]);
    for (int i = 0; i < bench->clamp_count; i++) {
        const Clamp *c = &bench->clamp[i];
        char text[128] = "survived";
        if (i % CAPS == 0)
            fprintf(out, "  %-24.24s %-10s %-13s ", c->surface, form_name[c->form], c->wall);
        if (!c->loop.survived)
            snprintf(text, sizeof text, "%lld: %.*s", (long long)c->loop.failed_step, (int)strcspn(c->loop.why, " ,"), c->loop.why);
        fprintf(out, "  %14s %6.1f %4lld%s", text, c->loop.penetration_um, (long long)c->loop.not_converged, i % CAPS == CAPS - 1 ? "\n" : "");
    }
}

static PaperRow paper_row(const Row *row)
{
    if (!row->of->paper_name)
        return (PaperRow){0};
    if (row->wall.mesh >= 0 && is_mesh_search(row->wall.name))
        return row->of->paper_mesh[row->wall.mesh];
    return !strcmp(row->wall.name, "lim") || !strcmp(row->wall.name, "lim-switch") ? row->of->paper_lim : (PaperRow){0};
}

static void print_paper(FILE *out, const CollisionBench *bench)
{
    bool head = false;
    for (int i = 0; i < bench->row_count; i++) {
        const Row *row = &bench->row[i];
        PaperRow paper = paper_row(row);
        char name[48];
        if (!(paper.ms > 0) || !row->has_loop)
            continue;
        if (!head)
            fprintf(out, "\nbeside Table 6 of the paper (2017, its machine)          detect and contact [ms]  candidates, most       paper 2017 [ms]  "
                         "contacts\n");
        head = true;
        text_of_mesh(row, name, sizeof name);
        fprintf(out, "  %-32s %-20s      %14.4f  %10.0f, %4.0f        %14.4f  %8d\n", row->of->paper_name, name,
                (row->loop.detect_us + row->loop.contact_us) / 1000, row->loop.candidates, row->loop.candidates_max, paper.ms, paper.contacts);
    }
}

// --- verdicts ---

static bool add_verdict(CollisionBench *bench, const char *item, bool at_most, double must, double measured, Faults *faults)
{
    Verdict *v = further((void **)&bench->verdict, &bench->verdict_count, sizeof *v, faults);
    if (!v)
        return false;
    snprintf(v->item, sizeof v->item, "%s", item);
    v->must = must;
    v->measured = measured;
    v->at_most = at_most;
    v->good = at_most ? measured <= must : measured >= must;
    return true;
}

enum { NEAR_POINTS, ALL_POINTS, TIMES };

static double time_of(const Row *row, int what) { return what == NEAR_POINTS ? row->motion.us_per_80_points : row->motion.us_per_step; }

// Time for the near points of the same motion, which matter for contact, and for all points (the solver skips most of those far away). The field is compared
// with Embree; cached triangles (geom/triangle_groups.h) must be at least as fast as Embree.
static bool judge_surface(CollisionBench *bench, const CollisionCase *of, Faults *faults)
{
    static const char *const what[TIMES] = {"80 near points", "all points"};
    const Row *lim = row_of(bench, of, "lim", -1);
    for (int m = 0; m < of->mesh_count; m++) {
        const Row *full = row_of(bench, of, "mesh full", m), *warm = row_of(bench, of, "mesh warm", m), *cached = row_of(bench, of, "mesh cached", m);
        if (!lim || !full || !warm || !cached || warm->wall.triangles < LARGE)
            continue;
        for (int k = 0; k < 2 * TIMES; k++) {
            double us = k < TIMES ? fmin(time_of(full, k), time_of(warm, k)) : time_of(cached, k - TIMES);
            char item[192];
            snprintf(item, sizeof item, "%.40s, %dk triangles, %s: %s over lim; errors %.3g and %.3g um rms", of->name, warm->wall.triangles / 1000,
                     what[k % TIMES], k < TIMES ? "Embree in each step" : "cached triangles", warm->motion.gap_um.rms, lim->motion.gap_um.rms);
            if (!add_verdict(bench, item, false, k < TIMES ? TIMES_FASTER : 1, us / time_of(lim, k % TIMES), faults))
                return false;
        }
    }
    return true;
}

// Detection in local models for trees of different size: the slowest time over the fastest, from the figures of collision_growth.
static bool judge_growth(CollisionBench *bench, const cJSON *sizes, Faults *faults)
{
    static const char *const times[] = {"ns_warm", "ns_cold"}, *const what[] = {"one wire", "wires all over the tree"};
    for (size_t k = 0; k < 2; k++) {
        double least = HUGE_VAL, most = 0, nodes = 0;
        const cJSON *at;
        cJSON_ArrayForEach(at, sizes)
        {
            const cJSON *field = cJSON_GetObjectItem(at, "field"), *time = cJSON_GetObjectItem(at, times[k]), *size = cJSON_GetObjectItem(at, "nodes");
            if (!cJSON_IsString(field) || strcmp(field->valuestring, "blend") != 0 || !cJSON_IsNumber(time) || !cJSON_IsNumber(size))
                continue;
            least = fmin(least, time->valuedouble);
            most = fmax(most, time->valuedouble);
            nodes = fmax(nodes, size->valuedouble);
        }
        char item[192];
        snprintf(item, sizeof item, "a query in local models of 100 to %.0f nodes, %s: slowest over fastest", nodes, what[k]);
        if (most > 0 && !add_verdict(bench, item, true, FLAT, most / least, faults))
            return false;
    }
    return true;
}

static bool judge(CollisionBench *bench, const cJSON *root, Faults *faults)
{
    for (int i = 0; i < bench->row_count; i++)
        if ((i == 0 || bench->row[i].of != bench->row[i - 1].of) && !judge_surface(bench, bench->row[i].of, faults))
            return false;
    return judge_growth(bench, cJSON_GetObjectItem(root, "sizes"), faults);
}

static void print_verdicts(FILE *out, const CollisionBench *bench)
{
    for (int i = 0; i < bench->equal_count; i++) {
        const EqualError *e = &bench->equal[i];
        fprintf(out,
                "\nequal error, %s: the rms error of the model is %.3g um, that of a mesh of %d triangles %.3g um.\n  80 near points: lim %.2f us, "
                "Embree in each step %.2f us (%.1f times), cached triangles %.2f us (%.1f times)\n",
                e->surface, e->lim_um, e->triangles, e->mesh_um, e->lim_us, e->warm_us, e->warm_us / e->lim_us, e->cached_us, e->cached_us / e->lim_us);
    }
    if (bench->verdict_count > 0)
        fprintf(out, "\n%-124s must    measured\n", "verdicts");
    for (int i = 0; i < bench->verdict_count; i++) {
        const Verdict *v = &bench->verdict[i];
        fprintf(out, "  %-120s %s %-6.3g  %8.3g  %s\n", v->item, v->at_most ? "<=" : ">=", v->must, v->measured, v->good ? "good" : "MISSED");
    }
}

// --- JSON ---

static void put(cJSON *at, const char *name, double value)
{
    if (isfinite(value))
        cJSON_AddNumberToObject(at, name, value);
    else
        cJSON_AddNullToObject(at, name);
}

static void put_error(cJSON *at, const char *name, ErrorFigures figures)
{
    cJSON *error = cJSON_AddObjectToObject(at, name);
    put(error, "rms", figures.rms);
    put(error, "max", figures.max);
}

static cJSON *put_loop(cJSON *at, const char *name, const CollisionLoop *loop)
{
    cJSON *l = cJSON_AddObjectToObject(at, name), *step = cJSON_AddObjectToObject(l, "step_us");
    put(l, "steps", (double)loop->steps);
    put(l, "wanted_steps", (double)loop->wanted);
    put(l, "detect_us", loop->detect_us);
    put(l, "contact_us", loop->contact_us);
    put(step, "median", loop->step_us.median);
    put(step, "p99", loop->step_us.p99);
    put(l, "candidates", loop->candidates);
    put(l, "candidates_max", loop->candidates_max);
    put(l, "contacts", loop->contacts);
    put(l, "contacts_max", loop->contacts_max);
    put(l, "iterations", loop->iterations);
    put(l, "not_converged_steps", (double)loop->not_converged);
    put(l, "penetration_um", loop->penetration_um);
    put(l, "stalled_mm", loop->stalled_mm);
    cJSON_AddBoolToObject(l, "survived", loop->survived);
    put(l, "failed_step", loop->survived ? NAN : (double)loop->failed_step);
    cJSON_AddStringToObject(l, "why", loop->why);
    return l;
}

static cJSON *row_json(const Row *row)
{
    cJSON *at = cJSON_CreateObject(), *motion;
    const CollisionReplay *m = &row->motion;
    PaperRow paper = paper_row(row);
    cJSON_AddStringToObject(at, "surface", row->of->name);
    cJSON_AddStringToObject(at, "representation", row->wall.name);
    if (row->wall.triangles > 0)
        put(at, "triangles", row->wall.triangles);
    put(at, "primitives", (double)row->primitives);
    put(at, "bytes", row->bytes);
    put(at, "bytes_per_mm", row->bytes_per_mm);
    put(at, "surface_s", row->wall.surface_s);
    put(at, "vessel_s", row->wall.build_s);
    put(at, "build_s", row->wall.surface_s + row->wall.build_s);
    put(at, "cell_mm", row->wall.cell_mm > 0 ? row->wall.cell_mm : NAN);
    cJSON_AddBoolToObject(at, "is_truth", (row->truth_is_model && !strcmp(row->wall.name, "lim")) || !strcmp(row->wall.name, "exact"));
    motion = cJSON_AddObjectToObject(at, "motion");
    put(motion, "steps", (double)m->steps);
    put(motion, "points_per_step", m->points_per_step);
    put(motion, "us_per_step", m->us_per_step);
    put(motion, "near_points", (double)m->near_points);
    put(motion, "us_per_80_points", m->us_per_80_points);
    put(motion, "lost_points", (double)m->lost);
    put_error(motion, "gap_error_um", m->gap_um);
    put_error(motion, "normal_error_deg", m->normal_deg);
    if (row->has_loop) {
        put_loop(at, "loop", &row->loop);
        cJSON *smooth = put_loop(at, "frictionless", &row->smooth);
        put(smooth, "push_force_n", row->push.mean_n);
        put(smooth, "artificial_friction_n", artificial_friction(row));
        put(smooth, "artificial_friction_percent", 100 * artificial_friction(row) / row->push.reference_n);
        put(smooth, "jitter_rms", row->push.jitter_rms);
        put(smooth, "jitter_p99", row->push.jitter_p99);
        put(smooth, "work_lost_n", row->smooth.work_n);
        put(smooth, "artificial_mu", row->smooth.work_mu);
    }
    if (paper.ms > 0) {
        cJSON *p = cJSON_AddObjectToObject(at, "paper");
        put(p, "ms", paper.ms);
        put(p, "contacts", paper.contacts);
    }
    return at;
}

static void add_lists(cJSON *root, const CollisionBench *bench)
{
    cJSON *rows = cJSON_AddArrayToObject(root, "rows"), *clamps = cJSON_AddArrayToObject(root, "clamps");
    cJSON *equals = cJSON_AddArrayToObject(root, "equal_error"), *verdicts = cJSON_AddArrayToObject(root, "verdicts"), *at;
    for (int i = 0; i < bench->row_count; i++)
        cJSON_AddItemToArray(rows, row_json(&bench->row[i]));
    for (int i = 0; i < bench->clamp_count; i++) {
        const Clamp *c = &bench->clamp[i];
        cJSON_AddItemToArray(clamps, at = cJSON_CreateObject());
        cJSON_AddStringToObject(at, "surface", c->surface);
        cJSON_AddStringToObject(at, "representation", c->wall);
        cJSON_AddStringToObject(at, "form", form_name[c->form]);
        put(at, "max_iterations", c->cap);
        put(at, "steps", (double)c->loop.steps);
        cJSON_AddBoolToObject(at, "survived", c->loop.survived);
        put(at, "failed_step", c->loop.survived ? NAN : (double)c->loop.failed_step);
        cJSON_AddStringToObject(at, "why", c->loop.why);
        put(at, "penetration_um", c->loop.penetration_um);
        put(at, "not_converged_steps", (double)c->loop.not_converged);
        put(at, "step_us_median", c->loop.step_us.median);
    }
    for (int i = 0; i < bench->equal_count; i++) {
        const EqualError *e = &bench->equal[i];
        cJSON_AddItemToArray(equals, at = cJSON_CreateObject());
        cJSON_AddStringToObject(at, "surface", e->surface);
        put(at, "lim_gap_error_um", e->lim_um);
        put(at, "triangles", e->triangles);
        put(at, "mesh_gap_error_um", e->mesh_um);
        put(at, "lim_us_per_80_points", e->lim_us);
        put(at, "warm_us_per_80_points", e->warm_us);
        put(at, "cached_us_per_80_points", e->cached_us);
    }
    for (int i = 0; i < bench->verdict_count; i++) {
        const Verdict *v = &bench->verdict[i];
        cJSON_AddItemToArray(verdicts, at = cJSON_CreateObject());
        cJSON_AddStringToObject(at, "item", v->item);
        put(at, "must", v->must);
        cJSON_AddBoolToObject(at, "must_be_at_most", v->at_most);
        put(at, "measured", v->measured);
        cJSON_AddBoolToObject(at, "good", v->good);
    }
}

// --- the verb ---

static bool run_surface(CollisionBench *bench, const CollisionCase *of, Faults *faults)
{
    CollisionSurface surface = {0};
    CollisionWalls walls = {0};
    ProgressBar bar;
    Progress progress = progress_bar(&bar, of->name, false);
    bool good = collision_surface_open(of, bench->common.threads, &surface, faults) && collision_walls_open(&surface, &walls, faults);
    Run run = {.surface = &surface, .walls = &walls, .most_steps = bench->common.quick ? QUICK_STEPS : INT64_MAX};
    if (good) {
        size_t steps = (size_t)bench_steps(surface.scene, run.most_steps) + 1;
        run.push = calloc(steps, sizeof *run.push);
        run.reference_push = calloc(steps, sizeof *run.reference_push);
        good = (run.push && run.reference_push) || no_memory(of->name, faults);
    }
    good = good && measure_walls(bench, &run, &progress, faults);
    if (good)
        print_surface(bench->out, bench, &run);
    if (good && !bench->common.quick && (bench->given || of->paper_name))
        good = find_equal_error(bench, &run, faults);
    bool is_clamped = bench->common.quick ? is_listed(of->name, clamped_quick, sizeof clamped_quick / sizeof clamped_quick[0])
                                          : is_listed(of->name, clamped, sizeof clamped / sizeof clamped[0]);
    if (good && (bench->given || is_clamped))
        good = run_clamps(bench, &run, faults);
    if (good && progress.call)
        progress.call(progress.context, 1, 1);
    free(run.push);
    free(run.reference_push);
    collision_motion_free(&run.motion);
    collision_walls_close(&walls);
    collision_surface_close(&surface);
    return good;
}

static bool is_here(const CollisionBench *bench, const CollisionCase *of)
{
    for (size_t k = 0; !bench->given && k < sizeof needed / sizeof needed[0]; k++)
        if (!strcmp(needed[k].name, of->name) && access(needed[k].needs, R_OK) != 0) {
            fprintf(bench->out, "\n%s: skipped, %s is not here; %s\n", of->name, needed[k].needs, needed[k].how);
            return false;
        }
    return true;
}

static bool run_all(CollisionBench *bench, Faults *faults)
{
    for (int i = 0; i < bench->case_count; i++)
        if (is_here(bench, &bench->list[i]) && !run_surface(bench, &bench->list[i], faults))
            return false;
    return true;
}

static int call(void *options, Faults *faults)
{
    CollisionBench *bench = options;
    OutputPlan plan = {.faults = faults};
    output_plan_write(&plan, "--json", bench->common.json);
    output_plan_write(&plan, "--chart", bench->chart);
    if (faults->count > 0)
        return EXIT_BAD_INPUT;
    bench->out = bench_text(&bench->common);
    fprintf(bench->out, "%s\n%s", bench_processor(), legend);
    cJSON *root = cJSON_CreateObject();
    cJSON_AddStringToObject(root, "processor", bench_processor());
    cJSON_AddBoolToObject(root, "embree", mesh_vessel_available());
    bool good = run_all(bench, faults);
    if (good) {
        print_clamps(bench->out, bench);
        print_paper(bench->out, bench);
        fflush(bench->out);
        good = bench->given || collision_growth(bench->out, root, bench->common.quick, bench->common.threads, faults);
    }
    good = good && judge(bench, root, faults);
    if (good) {
        print_verdicts(bench->out, bench);
        add_lists(root, bench);
        good = (!bench->chart || collision_chart(root, bench->chart, faults)) && bench_write_json(&bench->common, root, faults);
    }
    cJSON_Delete(root);
    bool missed = false;
    for (int i = 0; i < bench->verdict_count; i++)
        missed |= !bench->verdict[i].good;
    free(bench->row);
    free(bench->clamp);
    free(bench->equal);
    free(bench->verdict);
    if (!good)
        return EXIT_BAD_INPUT;
    return missed ? EXIT_DIFFERENT : EXIT_DONE;
}

static const char *check(void *structure)
{
    CollisionBench *bench = structure;
    if (bench->scene_count > SCENES_MOST)
        return "at most 16 scenes";
    for (int i = 0; i < bench->scene_count; i++)
        bench->list[bench->case_count++] = (CollisionCase){
            .name = bench->scene[i], .scene = bench->scene[i], .mesh_count = 1, .triangles = {SCENE_TRIANGLES}, .pointwise_steps = POINTWISE_STEPS};
    bench->given = bench->case_count > 0;
    for (int i = 0; !bench->given && i < CASES; i++)
        if (!bench->common.quick || is_listed(cases[i].name, in_quick, sizeof in_quick / sizeof in_quick[0]))
            bench->list[bench->case_count++] = cases[i];
    for (int i = 0; bench->common.quick && i < bench->case_count; i++) {
        CollisionCase *of = &bench->list[i];
        while (of->mesh_count > 1 && of->triangles[of->mesh_count - 1] > QUICK_TRIANGLES)
            of->mesh_count--;
        if (of->triangles[of->mesh_count - 1] > QUICK_TRIANGLES)
            of->triangles[of->mesh_count - 1] = QUICK_TRIANGLES;
    }
    return NULL;
}

static const Option rows[] = {
    BENCH_OPTIONS(CollisionBench, common, "only capsule and spiral, or SCENE; 300 steps, meshes to 12,000 triangles, fewer iteration limits"),
    {"chart", "F.svg", OPTION_FILE, OPTION_AT(CollisionBench, chart), "a chart of the figures"},
};

static const OptionTable table = {
    .program = "seldinger bench collision",
    .does = "implicit models compared with meshes searched by Embree, the exact wall and a sampled distance: time, error, artificial friction",
    .usage = "[SCENE...] [options]",
    .intro =
        "Implicit models (LIM: one field of blobs, and local models) compared with triangle meshes searched by Embree, the exact wall and a sampled distance: "
        "the surfaces of Kerrien 2017, Table 6, the phantom, the aneurysm and the peer tubes; time and error on the same recorded motion, closed-loop runs, "
        "artificial friction, limited contact iterations, growth with the size. Run it from the project's folder. Times are CPU times.\n"
        "SCENE, instead of these: its vessel (tube, shape or model) as about 100,000 triangles, with its own tool and script.",
    .exits = "0 done; 1 the model missed a verdict; 2 wrong usage or bad input",
    CLI_OPTIONS(rows, CollisionBench),
    .check = check,
    .takes_argument = true,
    .may_be_missing = true,
    .argument = offsetof(CollisionBench, scene),
    .argument_count = offsetof(CollisionBench, scene_count),
};

const Verb bench_collision = {.options = &table, .call = call};
