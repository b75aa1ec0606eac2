// Measurements of a model for `bench wall`: points to wall, junctions against truth, noise.
#include "bench/wall_measures.h"

#include "base/process.h"
#include "base/sort_doubles.h"
#include "geom/random.h"
#include "recon/phantom/phantom.h"
#include "recon/tree_file.h"

#include <errno.h>
#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

enum { POINTS_MOST = 60000 };

static double seconds_now(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

// CPU time of all child processes that have ended.
static double children_cpu_s(void)
{
    struct rusage used = {0};
    getrusage(RUSAGE_CHILDREN, &used);
    return (double)(used.ru_utime.tv_sec + used.ru_stime.tv_sec) + 1e-6 * (double)(used.ru_utime.tv_usec + used.ru_stime.tv_usec);
}

bool wall_command(const char *const *argv, WallCost *cost, Faults *faults)
{
    enum { ARGUMENTS_MAX = 24 };
    char *list[ARGUMENTS_MAX + 2] = {(char *)(size_t) "seldinger"};
    int count = 1, status = 0;
    for (; argv[count - 1] && count < ARGUMENTS_MAX; count++)
        list[count] = (char *)(size_t)argv[count - 1];
    char program[PATH_MAX];
    if (!process_beside("seldinger", program, sizeof program)) {
        faults_add(faults, argv[0], 0, 0, "cannot be started: the folder of this program is not known");
        return false;
    }
    double begin = seconds_now(), cpu = children_cpu_s();
    fflush(NULL);
    pid_t child = fork();
    if (child == 0) {
        dup2(STDERR_FILENO, STDOUT_FILENO);
        execv(program, list);
        _exit(127);
    }
    pid_t ended;
    do
        ended = child > 0 ? waitpid(child, &status, 0) : -1;
    while (ended < 0 && errno == EINTR);
    if (ended < 0 || !WIFEXITED(status) || WEXITSTATUS(status) != 0) {
        faults_add(faults, argv[0], 0, 0, "ended with exit code %d; see its output above", ended > 0 && WIFEXITED(status) ? WEXITSTATUS(status) : -1);
        return false;
    }
    if (cost)
        *cost = (WallCost){children_cpu_s() - cpu, seconds_now() - begin};
    return true;
}

bool wall_points(const VesselTree *model, PointFigures *out)
{
    *out = (PointFigures){0};
    Vessel *vessel = model_vessel_create(model);
    double *far = malloc((POINTS_MOST + 1) * sizeof *far);
    int64_t every = model->point_count / POINTS_MOST + 1;
    for (int i = 0; vessel && far && i < model->node_count; i++)
        for (int64_t k = model->point_offset[i]; k < model->point_offset[i + 1]; k++) {
            if (k % every != 0 || out->count == POINTS_MOST)
                continue;
            VesselMemory memory = {.node = i};
            VesselHit hit;
            vessel_query(vessel, 1, &model->point[k], HUGE_VAL, &memory, &hit);
            if (hit.flags & (VESSEL_OPEN_END | VESSEL_BEYOND))
                continue;
            out->unsure += (hit.flags & VESSEL_UNSURE) != 0;
            far[out->count++] = fabs(hit.gap);
        }
    bool good = vessel && far;
    if (good && out->count > 0) {
        sort_doubles(far, (size_t)out->count);
        for (int k = 0; k < out->count; k++)
            out->mean += far[k] / out->count;
        out->p99 = far[(int)(0.99 * (out->count - 1))];
        out->most = far[out->count - 1];
    }
    free(far);
    if (vessel)
        vessel->destroy(vessel);
    return good;
}

// The parent's axis may differ slightly from the true one: only the line outside the parent's ball is judged.
static bool is_false_link(const VesselTree *tree, const ReachJunction *junction, const Shape *truth, double slack)
{
    enum { SAMPLES = 40 };
    Vec3 from = tree->center[junction->parent], to = tree->center[junction->node];
    for (int k = 0; k <= SAMPLES; k++)
        if (shape_distance(truth, vec3_mix(from, to, (double)k / SAMPLES), NULL) < -slack)
            return true;
    return false;
}

TruthFigures wall_judge_junctions(const VesselTree *model, const Reach *reach, const Shape *truth, double slack_mm)
{
    TruthFigures out = {0};
    for (int k = 0; k < reach->junction_count; k++) {
        const ReachJunction *j = &reach->junction[k];
        bool is_false = is_false_link(model, j, truth, slack_mm);
        out.junctions++;
        out.capped += !is_false && j->clearance < 0;
        out.false_links += is_false;
        out.false_open += is_false && j->clearance >= 0;
    }
    return out;
}

bool wall_write_jittered(const char *tree_path, double sigma_mm, uint64_t seed, const char *out_path, Faults *faults)
{
    TreeFileInfo info = {0};
    VesselTree *tree = tree_file_load(tree_path, &info, faults);
    Random random = {seed * 1000003};
    for (int64_t k = 0; tree && k < tree->point_count; k++) {
        double x = random_normal(&random), y = random_normal(&random), z = random_normal(&random);
        tree->point[k] = vec3_add_scaled(tree->point[k], sigma_mm, vec3(x, y, z));
    }
    bool good = tree && tree_file_save(tree, &info, out_path, faults);
    vessel_tree_free(tree);
    tree_file_info_free(&info);
    return good;
}
