// The wall of a real model in contact with a tool: its jump where the point's node changes, identical results on every instruction set, and the time for 80
// points that slide along it. test_lim_scene [MODEL.h5 ...] (default: scenes/aneurism/aneurism-local.h5; skipped if that does not exist).
#include "base/simd.h"
#include "geom/vessel.h"
#include "random_numbers.h"
#include "recon/tree_file.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include <cmocka.h>

static int model_count;
static char **model_path;
static char *default_path[] = {"scenes/aneurism/aneurism-local.h5"};

static int by_size(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return x < y ? -1 : x > y;
}

static VesselTree *load(const char *path)
{
    static Faults faults;
    faults_clear(&faults);
    if (model_path == default_path && access(path, R_OK) != 0)
        return NULL;
    VesselTree *tree = tree_file_load(path, NULL, &faults);
    if (!tree)
        print_message("%s\n", faults.text[0]);
    assert_non_null(tree);
    return tree;
}

static Vessel *make(const VesselTree *tree, LimField field)
{
    LimVesselOptions o = lim_vessel_default_options();
    o.field = field;
    Vessel *v = lim_vessel_create_with(tree, &o);
    assert_non_null(v);
    return v;
}

// Paths parallel to the links between nodes, 0.2 mm inside the wall, in steps of 1 um; the changes of the gap where the node changes. Sorted.
static int collect_jumps(const VesselTree *t, LimField field, double *jump, int capacity)
{
    Vessel *v = make(t, field);
    int count = 0;
    for (int i = 2; i < t->node_count; i += 1 + t->node_count / 300) {
        int p = t->parent[i];
        if (p <= 0 || t->kind[i] != NODE_VESSEL || t->kind[p] != NODE_VESSEL || t->radius[i] > 2.5)
            continue;
        Vec3 d = vec3_sub(t->center[i], t->center[p]), e1, e2;
        int steps = (int)fmin(vec3_norm(d) / 1e-3, 1000);
        d = vec3_unit(d), e1 = vec3_normal_to(d), e2 = vec3_cross(d, e1);
        for (int k = 0; k < 6; k++) {
            Vec3 out = vec3_add(vec3_scale(e1, cos(k * PI / 3)), vec3_scale(e2, sin(k * PI / 3))), x = t->center[p];
            VesselMemory memory = {.node = p};
            VesselHit hit = {.gap = HUGE_VAL};
            for (int s = 0; s < 200 && hit.gap > 0.25; s++, x = vec3_add_scaled(x, 0.02, out))
                vessel_query(v, 1, &x, 3, &memory, &hit);
            for (int s = 0; s < steps && count < capacity; s++) {
                VesselHit before = hit;
                x = vec3_add_scaled(x, 1e-3, d);
                vessel_query(v, 1, &x, 3, &memory, &hit);
                if (before.flags || hit.flags || hit.gap > 0.5 || hit.gap < -0.3)
                    break;
                if (hit.node != before.node)
                    jump[count++] = fabs(hit.gap - before.gap);
            }
        }
    }
    qsort(jump, (size_t)count, sizeof *jump, by_size);
    v->destroy(v);
    return count;
}

static void jumps(void **state)
{
    (void)state;
    enum { CAPACITY = 100000 };
    static double jump[2][CAPACITY];
    for (int m = 0; m < model_count; m++) {
        VesselTree *t = load(model_path[m]);
        if (!t)
            skip();
        int n[2];
        for (int field = 0; field < 2; field++) {
            n[field] = collect_jumps(t, (LimField)field, jump[field], CAPACITY);
            assert_true(n[field] > 100);
            const double *j = jump[field];
            print_message("%s %s: the wall jumps at %d borders by p50 %.5f p90 %.5f p99 %.5f worst %.4f mm\n", model_path[m], field ? "blend " : "switch",
                          n[field], j[n[field] / 2], j[n[field] * 9 / 10], j[n[field] * 99 / 100], j[n[field] - 1]);
        }
        assert_true(jump[LIM_BLEND][n[LIM_BLEND] * 99 / 100] < 0.03);
        assert_true(jump[LIM_BLEND][n[LIM_BLEND] / 2] < 0.1 * jump[LIM_SWITCH][n[LIM_SWITCH] / 2]);
        vessel_tree_free(t);
    }
}

// --- a tool sliding along the deepest branch ---

enum { POINTS = 80, STEPS = 400 };
typedef struct Course {
    int count;
    int *node;
    double *length;          // from the root [mm]
} Course;

static Course deepest_branch(const VesselTree *t)
{
    double *far = calloc((size_t)t->node_count, sizeof *far);
    Course c = {0, calloc((size_t)t->node_count, sizeof(int)), calloc((size_t)t->node_count, sizeof(double))};
    int leaf = 0;
    for (int i = 1; i < t->node_count; i++) {
        far[i] = far[t->parent[i]] + vec3_distance(t->center[i], t->center[t->parent[i]]);
        leaf = far[i] > far[leaf] ? i : leaf;
    }
    for (int i = leaf; i >= 0; i = t->parent[i])
        c.count++;
    for (int i = leaf, k = c.count - 1; i >= 0; i = t->parent[i], k--)
        c.node[k] = i, c.length[k] = far[i];
    free(far);
    return c;
}

static Vec3 place(const VesselTree *t, const Course *c, double s)
{
    int k = 0;
    while (k + 2 < c->count && c->length[k + 1] < s)
        k++;
    return vec3_mix(t->center[c->node[k]], t->center[c->node[k + 1]], (s - c->length[k]) / (c->length[k + 1] - c->length[k]));
}

static double now_us(void)
{
    struct timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return 1e6 * (double)t.tv_sec + 1e-3 * (double)t.tv_nsec;
}

// Points 0.2 mm from the wall move 0.05 mm per step back and forth. `path` (STEPS x POINTS) is filled by the first run and used by the others.
static double slide(const VesselTree *t, const Course *c, LimField field, Vec3 (*path)[POINTS], bool fill, VesselHit *last)
{
    Vessel *v = make(t, field);
    Vec3 x[POINTS], out[POINTS];
    double s[POINTS], used[STEPS];
    VesselMemory memory[POINTS];
    VesselHit hit[POINTS];
    uint64_t seed = 41;
    memset(hit, 0, sizeof hit);
    for (int i = 0; i < POINTS; i++) {
        s[i] = 3 + (c->length[c->count - 1] - 18) * i / POINTS;
        x[i] = place(t, c, s[i]);
        out[i] = random_unit_vector(&seed);
        memory[i] = (VesselMemory){.node = -1};
    }
    for (int step = 0; step < STEPS; step++) {
        if (fill)
            memcpy(path[step], x, sizeof x);
        double start = now_us();
        vessel_query(v, POINTS, path[step], 0.5, memory, hit);
        used[step] = now_us() - start;
        double way = step / 100 % 2 ? -0.05 : 0.05;
        for (int i = 0; i < POINTS && fill; i++) {
            Vec3 from = place(t, c, s[i]), to = place(t, c, s[i] += way), along = vec3_sub(to, from);
            Vec3 aside = vec3_sub(x[i], from), tangent = vec3_unit(along);
            x[i] = vec3_add_scaled(vec3_add(x[i], along), -0.1 * vec3_dot(aside, tangent), tangent);   // stays at the same place along the vessel
            x[i] = hit[i].flags ? vec3_add_scaled(x[i], 0.05, out[i]) : vec3_add_scaled(x[i], fmax(-0.03, fmin(0.03, 0.2 - hit[i].gap)), hit[i].normal);
        }
    }
    memcpy(last, hit, sizeof hit);
    qsort(used, STEPS, sizeof *used, by_size);
    v->destroy(v);
    return used[STEPS / 2];
}

static void cost_and_same_bits(void **state)
{
    (void)state;
    static Vec3 path[STEPS][POINTS];
    double clock = HUGE_VAL;
    for (int i = 0; i < 100; i++) {
        double start = now_us();
        clock = fmin(clock, now_us() - start);
    }
    SimdLevel usual = simd_level();
    for (int m = 0; m < model_count; m++) {
        VesselTree *t = load(model_path[m]);
        if (!t)
            skip();
        Course c = deepest_branch(t);
        VesselHit first[2][POINTS], hit[POINTS];
        slide(t, &c, LIM_BLEND, path, true, hit);
        for (int level = 0; level <= (int)simd_widest(); level++) {
            simd_force((SimdLevel)level);
            double us[2];
            for (int field = 0; field < 2; field++) {
                us[field] = slide(t, &c, (LimField)field, path, false, hit) - clock;
                if (level == 0)
                    memcpy(first[field], hit, sizeof hit);
                assert_memory_equal(first[field], hit, sizeof hit);
            }
            print_message("%s %-6s: %d points near the wall, median of %d queries: switch %.2f us, blend %.2f us\n", model_path[m], simd_name[level], POINTS,
                          STEPS, us[LIM_SWITCH], us[LIM_BLEND]);
        }
        simd_force(usual);
        free(c.node);
        free(c.length);
        vessel_tree_free(t);
    }
}

int main(int argc, char **argv)
{
    model_count = argc > 1 ? argc - 1 : 1;
    model_path = argc > 1 ? argv + 1 : default_path;
    const struct CMUnitTest tests[] = {cmocka_unit_test(jumps), cmocka_unit_test(cost_and_same_bits)};
    return cmocka_run_group_tests_name("lim_scene", tests, NULL, NULL);
}
