// The mesh of the swept model: exact shapes with order of convergence, forks, a sac, the 51-branch tree; closed, of genus 0, on F = 0, with the true normals;
// mirrored and rotated models; an update compared with a fresh mesh; triangles that cross others.
//   test_sweep_mesh --all    also the phantom, the tree of 51 branches and the angiogram of ../shared/data
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>

#include "geom/sweep_mesh.h"
#include "geom/sweep_mesh_parts.h"
#include "geom/tree_surface.h"
#include "recon/recon.h"
#include "tests/geom/sweep_models.h"
#include "tests/recon/fitted_shape.h"
#include "tests/recon/swept_shape.h"

#include <string.h>
#include <time.h>
#include <unistd.h>

static bool all;

static double cpu_s(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static SweepMesh *mesh_of(const SweepModel *model, const SweepMeshOptions *options)
{
    SweepField *field = sweep_field_create(model);
    SweepMesh *mesh = sweep_mesh_create(field, options);
    assert_non_null(mesh);
    sweep_field_free(field);
    return mesh;
}

static SurfaceCensus census_of(const SweepMesh *mesh)
{
    SurfaceCensus census;
    assert_true(surface_census(mesh->surface, &census));
    return census;
}

static void assert_closed(const SweepMesh *mesh)
{
    SurfaceCensus c = census_of(mesh);
    assert_int_equal(mesh->failures, 0);
    assert_int_equal(c.parts, 1);
    assert_int_equal(c.open_edges, 0);
    assert_int_equal(c.non_manifold_edges, 0);
    assert_int_equal(c.turned_edges, 0);
    assert_int_equal(c.euler, 2);            // genus 0
    assert_true(c.volume > 0);
}

// Vertices off F = 0 by more than 1e-9 mm, or with a normal off by more than 1e-6 rad; caps aside.
static int vertices_off_wall(const SweepModel *model, const SweepMesh *mesh)
{
    SweepField *field = sweep_field_create(model);
    int off = 0;
    for (int v = 0; v < mesh->surface->vertex_count; v++) {
        SweepPlace place = {.branch = mesh->branch[v], .t = mesh->along[v], .sac = mesh->sac[v]};
        SweepBlend blend;
        if (mesh->boundary[v] > 0)
            continue;
        sweep_field_blend(field, place, mesh->surface->vertex[v], &blend);
        Vec3 out = vec3_negate(vec3_unit(blend.gradient));
        off += fabs(blend.f) > 1e-9 || vec3_distance(out, mesh->surface->normal[v]) > 1e-6;
        assert_true(fabs(blend.f) < 0.02);
    }
    sweep_field_free(field);
    return off;
}

// --- Exact shapes ---

static const double cone[] = {1.2, 0.6};

static void straight(SweepShape *s)
{
    *s = (SweepShape){.pitch = 1, .parent = -1, .radius = 1, .open_start = true};
    sweep_shape_line(s, vec3(1, 2, 3), vec3(9, 2, 3), 9);
}

// Three quarters of a torus of radius 4 about z.
static void bent(SweepShape *s)
{
    *s = (SweepShape){.pitch = 1, .parent = -1, .radius = 1, .open_start = true, .knots = 300};
    for (int i = 0; i < s->knots; i++) {
        double a = 1.5 * PI * i / (s->knots - 1);
        s->knot[i] = vec3(4 * cos(a), 4 * sin(a), 0);
    }
}

// Largest distance of the triangles' middles from the wall, and the error of the volume, for flat ends.
static void errors(const SweepShape *shape, double (*off)(Vec3 x), double volume, int around, double error[2])
{
    SweepModel *model = sweep_model_of(shape, 1);
    SweepMeshOptions options = sweep_mesh_default_options();
    options.around = around, options.flat_ends = true;
    SweepMesh *mesh = mesh_of(model, &options);
    assert_closed(mesh);
    assert_int_equal(mesh->boundaries, 2);
    error[0] = 0;
    for (int t = 0; t < mesh->surface->triangle_count; t++) {
        const int *v = mesh->surface->triangle[t];
        Vec3 middle = vec3(0, 0, 0);
        bool cap = mesh->boundary[v[0]] > 0 && mesh->boundary[v[1]] == mesh->boundary[v[0]] && mesh->boundary[v[2]] == mesh->boundary[v[0]];
        for (int k = 0; k < 3; k++)
            middle = vec3_add_scaled(middle, 1.0 / 3, mesh->surface->vertex[v[k]]);
        if (!cap)
            error[0] = fmax(error[0], fabs(off(middle)));
    }
    error[1] = fabs(census_of(mesh).volume - volume);
    sweep_mesh_free(mesh);
    sweep_model_free(model);
}

static double off_cylinder(Vec3 x) { return hypot(x.y - 2, x.z - 3) - 1; }
static double off_cone(Vec3 x) { return hypot(x.y - 2, x.z - 3) - (1.2 - 0.6 * (x.x - 1) / 8); }
static double off_torus(Vec3 x) { return hypot(hypot(x.x, x.y) - 4, x.z) - 1; }

static void distance_and_volume_are_of_second_order(void **state)
{
    (void)state;
    SweepShape shape[3];
    straight(&shape[0]), straight(&shape[1]), bent(&shape[2]);
    shape[1].circle = cone;
    double (*const off[])(Vec3) = {off_cylinder, off_cone, off_torus};
    const double volume[] = {8 * PI, PI * 8 * (1.44 + 0.72 + 0.36) / 3, PI * 6 * PI};
    for (int i = 0; i < 3; i++) {
        double coarse[2], fine[2];
        errors(&shape[i], off[i], volume[i], 16, coarse), errors(&shape[i], off[i], volume[i], 64, fine);
        double order[2] = {log2(coarse[0] / fine[0]) / 2, log2(coarse[1] / fine[1]) / 2};
        print_message("shape %d: distance %.3g to %.3g mm, order %.2f; volume %.3g to %.3g mm3, order %.2f\n", i, coarse[0], fine[0], order[0], coarse[1],
                      fine[1], order[1]);
        // places of rings are powers of two, so edges along the branch do not fall evenly
        assert_true(order[0] > 1.8 && order[0] < 2.3 && order[1] > 1.8 && order[1] < 2.3);
    }
}

// --- Triangles that cross others ---

static bool crosses(Vec3 a, Vec3 b, const Vec3 *t)
{
    Vec3 e1 = vec3_sub(t[1], t[0]), e2 = vec3_sub(t[2], t[0]), d = vec3_sub(b, a), p = vec3_cross(d, e2), s = vec3_sub(a, t[0]);
    double det = vec3_dot(e1, p);
    if (fabs(det) < 1e-14)
        return false;
    double u = vec3_dot(s, p) / det;
    Vec3 q = vec3_cross(s, e1);
    double v = vec3_dot(d, q) / det, w = vec3_dot(e2, q) / det;
    return u > 0 && v > 0 && u + v < 1 && w > 0 && w < 1;
}

// Pairs of triangles without a common vertex of which an edge of one passes through the other, by a lattice of cells of the longest edge.
static int self_intersections(const TriangleMesh *m)
{
    double cell = 0;
    Vec3 low = m->vertex[0];
    for (int t = 0; t < m->triangle_count; t++)
        for (int k = 0; k < 3; k++) {
            Vec3 x = m->vertex[m->triangle[t][k]];
            cell = fmax(cell, vec3_distance(x, m->vertex[m->triangle[t][(k + 1) % 3]]));
            low = vec3(fmin(low.x, x.x), fmin(low.y, x.y), fmin(low.z, x.z));
        }
    enum { SIZE = 1 << 16 };
    int *head = malloc(SIZE * sizeof *head), *next = malloc(sizeof *next * (size_t)m->triangle_count), count = 0;
    uint64_t *key = malloc(sizeof *key * (size_t)m->triangle_count);
    memset(head, -1, SIZE * sizeof *head);
    for (int t = 0; t < m->triangle_count; t++) {
        Vec3 x = m->vertex[m->triangle[t][0]];
        int i = (int)((x.x - low.x) / cell) + 2, j = (int)((x.y - low.y) / cell) + 2, k = (int)((x.z - low.z) / cell) + 2;
        for (int n = 0; n < 125; n++) {      // the middles' vertices are at most two edges apart
            uint64_t near = ((uint64_t)(i + n % 5 - 2) << 40) + ((uint64_t)(j + n / 5 % 5 - 2) << 20) + (uint64_t)(k + n / 25 - 2);
            for (int o = head[(near * 0x9e3779b97f4a7c15u >> 40) % SIZE]; o >= 0; o = next[o]) {
                if (key[o] != near)
                    continue;
                const int *a = m->triangle[t], *b = m->triangle[o];
                bool shared = false, crossed = false;
                for (int c = 0; c < 9; c++)
                    shared |= a[c / 3] == b[c % 3];
                Vec3 ta[3] = {m->vertex[a[0]], m->vertex[a[1]], m->vertex[a[2]]}, tb[3] = {m->vertex[b[0]], m->vertex[b[1]], m->vertex[b[2]]};
                for (int e = 0; e < 3 && !shared; e++)
                    crossed |= crosses(ta[e], ta[(e + 1) % 3], tb) || crosses(tb[e], tb[(e + 1) % 3], ta);
                count += crossed;
            }
        }
        key[t] = ((uint64_t)i << 40) + ((uint64_t)j << 20) + (uint64_t)k;
        int *slot = &head[(key[t] * 0x9e3779b97f4a7c15u >> 40) % SIZE];
        next[t] = *slot, *slot = t;
    }
    free(head);
    free(next);
    free(key);
    return count;
}

// --- Fitted shapes ---

static SweepModel *fitted(const char *name, int count, const char (*option)[2][64])
{
    Shape *shape = make(name, count, option);
    VesselTree *tree = shape_sample(shape, &faults);
    SweepModel *model = swept(tree, sweep_fit_default_options(), NULL);
    vessel_tree_free(tree);
    shape_free(shape);
    return model;
}

static void forks_are_closed(void **state)
{
    (void)state;
    static const char narrow[1][2][64] = {{"angle_deg", "15"}};
    static const struct {
        const char *name;
        int options;
    } shape[] = {{"y", 0}, {"y", 1}, {"bifurcation", 0}};
    for (int i = 0; i < 3; i++) {
        SweepModel *model = fitted(shape[i].name, shape[i].options, shape[i].options ? narrow : NULL);
        SweepMesh *mesh = mesh_of(model, NULL);
        assert_closed(mesh);
        int off = vertices_off_wall(model, mesh), crossed = self_intersections(mesh->surface);
        print_message("%s: %d triangles, %d patches; %d vertices off the wall, %d pairs of triangles cross\n", shape[i].name, mesh->surface->triangle_count,
                      mesh->patches, off, crossed);
        // y 15 has two known vertices that are off by up to 0.014 mm: docs/limits.md
        assert_true(off <= (shape[i].options ? 2 : 0));
        assert_int_equal(crossed, 0);
        sweep_mesh_free(mesh);
        sweep_model_free(model);
    }
}

static Vec3 mirrored(Vec3 x) { return vec3(-x.x, x.y, x.z); }
static Vec3 rotated(Vec3 x) { return vec3(0.36 * x.x + 0.48 * x.y - 0.8 * x.z, -0.8 * x.x + 0.6 * x.y, 0.48 * x.x + 0.64 * x.y + 0.6 * x.z); }

// The lattice does not turn with the model, so meshes agree to the second order in the edge: 0.05 of 40 mm3 for edges of a quarter of the radius.
static void moved_models_have_the_same_volume(void **state)
{
    (void)state;
    Vec3 (*const move[])(Vec3) = {mirrored, rotated};
    for (int i = 0; i < 2; i++) {
        double volume[2];
        for (int moved = 0; moved < 2; moved++) {
            Shape *shape = make("y", 0, NULL);
            VesselTree *tree = shape_sample(shape, &faults);
            for (int n = 0; n < tree->node_count && moved; n++)
                tree->center[n] = move[i](tree->center[n]), tree->direction[n] = move[i](tree->direction[n]);
            for (int64_t n = 0; n < tree->point_count && moved; n++)
                tree->point[n] = move[i](tree->point[n]);
            SweepModel *model = swept(tree, sweep_fit_default_options(), NULL);
            SweepMesh *mesh = mesh_of(model, NULL);
            assert_closed(mesh);
            volume[moved] = census_of(mesh).volume;
            sweep_mesh_free(mesh);
            sweep_model_free(model);
            vessel_tree_free(tree);
            shape_free(shape);
        }
        print_message("volume %.4f, moved %.4f mm3\n", volume[0], volume[1]);
        assert_true(fabs(volume[1] - volume[0]) < 0.05);
    }
}

// --- Updates ---

static bool same_mesh(const SweepMesh *a, const SweepMesh *b)
{
    const TriangleMesh *x = a->surface, *y = b->surface;
    size_t n = (size_t)x->vertex_count;
    return x->vertex_count == y->vertex_count && x->triangle_count == y->triangle_count && memcmp(x->vertex, y->vertex, n * sizeof *x->vertex) == 0 &&
           memcmp(x->normal, y->normal, n * sizeof *x->normal) == 0 && memcmp(x->node, y->node, n * sizeof *x->node) == 0 &&
           memcmp(x->triangle, y->triangle, (size_t)x->triangle_count * sizeof *x->triangle) == 0 && memcmp(a->branch, b->branch, n * sizeof *a->branch) == 0 &&
           memcmp(a->along, b->along, n * sizeof *a->along) == 0 && memcmp(a->boundary, b->boundary, n * sizeof *a->boundary) == 0;
}

// A trunk with two children far apart.
static SweepModel *two_forks(void)
{
    SweepShape s[3];
    s[0] = (SweepShape){.pitch = 1, .parent = -1, .radius = 1, .open_start = true};
    sweep_shape_line(&s[0], vec3(0, 0, 0), vec3(30, 0, 0), 31);
    for (int i = 1; i <= 2; i++) {
        s[i] = (SweepShape){.pitch = 1, .parent = 0, .parent_t = i == 1 ? 6 : 22, .radius = 0.6};
        sweep_shape_line(&s[i], vec3(s[i].parent_t, 0, 0), vec3(s[i].parent_t + 4, i == 1 ? 5 : -5, 0), 8);
    }
    return sweep_model_of(s, 3);
}

static void an_update_gives_the_fresh_mesh(void **state)
{
    (void)state;
    SweepModel *model = two_forks();
    SweepField *field = sweep_field_create(model);
    SweepMesh *mesh = sweep_mesh_create(field, NULL);
    assert_closed(mesh);
    assert_int_equal(mesh->patches, 2);
    sweep_field_free(field);
    // rows of the trunk: far from both forks, at the first, at the second; a row of the first child
    const int row[] = {15, 7, 24, model->branch[1].first_row + 5};
    const int patches[] = {0, 1, 1, 1};
    for (int i = 0; i < 4; i++) {
        model->row[row[i] * SWEEP_TERMS] *= 1.1;
        field = sweep_field_create(model);
        SweepMesh *fresh = sweep_mesh_create(field, NULL);
        assert_true(sweep_mesh_update(mesh, field));
        print_message("row %d: %d rings and %d of %d patches made anew\n", row[i], mesh->remade_rings, mesh->remade_patches, mesh->patches);
        assert_true(same_mesh(mesh, fresh));
        assert_true(mesh->remade_patches <= patches[i]);
        sweep_mesh_free(fresh);
        sweep_field_free(field);
    }
    // a model that did not change
    field = sweep_field_create(model);
    assert_true(sweep_mesh_update(mesh, field));
    assert_int_equal(mesh->remade_patches + mesh->remade_rings, 0);
    sweep_field_free(field);
    sweep_mesh_free(mesh);
    sweep_model_free(model);
}

// A trunk with a child far before a bend that is tighter than the trunk is wide, and one at the bend's end, on its inner side: there t jumps, and cuts of the patch
// fail until they have moved outwards.
static SweepModel *fork_in_a_bend(void)
{
    static const double BEND = 0.9, TURN = 2.3, BEFORE = 14, AFTER = 8;
    SweepShape s[3];
    double arc = BEND * TURN, length = BEFORE + arc + AFTER;
    Vec3 along = vec3(cos(TURN), sin(TURN), 0), aside = vec3(-along.y, along.x, 0);
    s[0] = (SweepShape){.pitch = 1, .parent = -1, .radius = 1, .open_start = true, .knots = 73};
    for (int i = 0; i < s[0].knots; i++) {
        double t = length * i / (s[0].knots - 1), turn = fmax(0, fmin(TURN, (t - BEFORE) / BEND)), over = fmax(0, t - BEFORE - arc);
        s[0].knot[i] = vec3_add_scaled(vec3(fmin(t, BEFORE) + BEND * sin(turn), BEND * (1 - cos(turn)), 0), over, along);
    }
    s[1] = (SweepShape){.pitch = 1, .parent = 0, .parent_t = 4, .radius = 0.6};
    sweep_shape_line(&s[1], vec3(4, 0, 0), vec3(7, -5, 0), 8);
    Vec3 fork = vec3(BEFORE + BEND * sin(TURN), BEND * (1 - cos(TURN)), 0);
    s[2] = (SweepShape){.pitch = 1, .parent = 0, .parent_t = BEFORE + arc, .radius = 0.4};
    sweep_shape_line(&s[2], fork, vec3_add_scaled(vec3_add_scaled(fork, 3, aside), 1.5, along), 8);
    return sweep_model_of(s, 3);
}

// A trunk with a child far from its inlet, and one that runs back along the trunk and past the inlet, where the patch of both cannot end.
static SweepModel *fork_past_the_inlet(void)
{
    SweepShape s[3];
    s[0] = (SweepShape){.pitch = 1, .parent = -1, .radius = 1, .open_start = true};
    sweep_shape_line(&s[0], vec3(0, 0, 0), vec3(30, 0, 0), 31);
    s[1] = (SweepShape){.pitch = 1, .parent = 0, .parent_t = 22, .radius = 0.6};
    sweep_shape_line(&s[1], vec3(22, 0, 0), vec3(26, -5, 0), 8);
    s[2] = (SweepShape){.pitch = 1, .parent = 0, .parent_t = 2, .radius = 0.6};
    sweep_shape_line(&s[2], vec3(2, 0, 0), vec3(0.5, 1.2, 0), 8);
    return sweep_model_of(s, 3);
}

// Tries that failed are remembered, whether another one succeeded or none: an update does not repeat them where nothing changed, and makes them anew where something
// did.
static void failed_tries_are_remembered(void **state)
{
    (void)state;
    for (int hopeless = 0; hopeless < 2; hopeless++) {
        SweepModel *model = hopeless ? fork_past_the_inlet() : fork_in_a_bend();
        SweepField *field = sweep_field_create(model);
        SweepMesh *mesh = sweep_mesh_create(field, NULL);
        int tries = mesh->remade_patches, failed = mesh->parts->failed_count;
        print_message("%s: %d patches, %d tries, %d of them failed, %d patches left out\n", hopeless ? "past the inlet" : "bend", mesh->patches, tries, failed,
                      mesh->failures);
        if (!hopeless)
            assert_closed(mesh);
        assert_true(mesh->failures == hopeless && mesh->patches == 2 - hopeless && failed > 0 && tries == mesh->patches + failed);
        assert_true(sweep_mesh_update(mesh, field));
        assert_int_equal(mesh->remade_patches, 0);
        sweep_field_free(field);
        // a row of the far child, then one of the other child, then none
        const int row[] = {model->branch[1].first_row + 2, model->branch[2].first_row + 2, 0};
        const double by[] = {1.1, 1.1, 1};
        for (int i = 0; i < 3; i++) {
            model->row[row[i] * SWEEP_TERMS] *= by[i];
            field = sweep_field_create(model);
            SweepMesh *fresh = sweep_mesh_create(field, NULL);
            assert_true(sweep_mesh_update(mesh, field));
            print_message("row %d: %d of %d tries made anew; %d failed, fresh %d\n", row[i], mesh->remade_patches, fresh->remade_patches,
                          mesh->parts->failed_count, fresh->parts->failed_count);
            assert_true(same_mesh(mesh, fresh));
            assert_true(mesh->failures == fresh->failures && mesh->parts->failed_count == fresh->parts->failed_count && fresh->parts->failed_count > 0);
            // each try belongs to one of the two forks
            assert_int_equal(mesh->remade_patches, i == 0 ? 1 : i == 1 ? fresh->remade_patches - 1 : 0);
            sweep_mesh_free(fresh);
            sweep_field_free(field);
        }
        sweep_mesh_free(mesh);
        sweep_model_free(model);
    }
}

// --- Lanes ---

// F and its gradient without Hessians against those with them, and the sum of the shares, at points around a fork and a sac.
static void slopes_have_the_bits_of_samples(void **state)
{
    (void)state;
    SweepModel *model = two_forks();
    sweep_add_sac(model, 12, vec3(12, 1.6, 0), 1.5);
    SweepField *field = sweep_field_create(model);
    int blended = 0;
    for (int isa = 1; isa <= 3; isa++) {
        SweepFeet feet = {.field = field, .kernels = sweep_kernels(isa), .harmonics = sweep_model_harmonics(model)};
        for (int n = 0; n < 400; n++) {
            SweepBlock slope, sample;
            sweep_block_begin(&slope), sweep_block_begin(&sample);
            for (int i = 0; i < FOOT_BLOCK; i++) {
                double a = 0.7 * n + 2.4 * i, t = 4 + 0.03 * n, rho = 0.7 + 0.1 * (i % 6);
                SweepPlace place = {.branch = 0, .t = t, .sac = -1};
                mesh_set_place(&feet, &slope, i, &place), mesh_set_place(&feet, &sample, i, &place);
                slope.foot.at.x[i] = sample.foot.at.x[i] = t, slope.foot.at.y[i] = sample.foot.at.y[i] = rho * cos(a);
                slope.foot.at.z[i] = sample.foot.at.z[i] = rho * sin(a);
            }
            sweep_block_slope(&feet, &slope, FOOT_ALL), sweep_block_sample(&feet, &sample, FOOT_ALL);
            const FootSample *x = &slope.foot.at, *y = &sample.foot.at;
            for (int i = 0; i < FOOT_BLOCK; i++) {
                double shares = slope.sac_share[i];
                for (int k = 0; k < slope.view[i]->count; k++)
                    shares += slope.share[k][i];
                assert_true(fabs(shares - 1) < 1e-14);
                assert_true(x->f[i] == y->f[i] && x->gx[i] == y->gx[i] && x->gy[i] == y->gy[i] && x->gz[i] == y->gz[i]);
                assert_true(slope.owner[i] == sample.owner[i] && slope.pure[i] == sample.pure[i]);
                blended += !slope.pure[i];
            }
        }
    }
    assert_true(blended > 100);
    sweep_field_free(field);
    sweep_model_free(model);
}

// --- Tags ---

static void ends_are_numbered(void **state)
{
    (void)state;
    SweepModel *model = two_forks();
    SweepMeshOptions options = sweep_mesh_default_options();
    options.flat_ends = true;
    SweepMesh *mesh = mesh_of(model, &options);
    assert_closed(mesh);
    assert_int_equal(mesh->boundaries, 4);
    double area[5] = {0};
    for (int t = 0; t < mesh->surface->triangle_count; t++) {
        const int *v = mesh->surface->triangle[t];
        Vec3 a = mesh->surface->vertex[v[0]], n = vec3_cross(vec3_sub(mesh->surface->vertex[v[1]], a), vec3_sub(mesh->surface->vertex[v[2]], a));
        int b = mesh->boundary[v[0]];
        if (b > 0 && mesh->boundary[v[1]] == b && mesh->boundary[v[2]] == b)
            area[b] += 0.5 * vec3_norm(n);
    }
    // regular polygons of 24 corners: inlet and trunk's end of radius 1, then the two children's
    double round = 12 * sin(2 * PI / 24);
    for (int b = 1; b <= 4; b++)
        assert_true(fabs(area[b] - round * (b < 3 ? 1 : 0.36)) < 1e-9);
    sweep_mesh_free(mesh);
    sweep_model_free(model);
}

static void a_sac_is_part_of_the_mesh(void **state)
{
    (void)state;
    SweepShape s;
    straight(&s);
    SweepModel *model = sweep_model_of(&s, 1);
    sweep_add_sac(model, 4, vec3(5, 3.6, 3), 1.5);
    SweepMesh *mesh = mesh_of(model, NULL);
    assert_closed(mesh);
    assert_int_equal(vertices_off_wall(model, mesh), 0);
    int on_sac = 0;
    for (int v = 0; v < mesh->surface->vertex_count; v++)
        on_sac += mesh->branch[v] < 0;
    assert_true(on_sac > 50);
    sweep_mesh_free(mesh);
    sweep_model_free(model);
}

// A lobe on a sac, with nodes of its own: the sac sees the lobe's blob, the vessel does not.
static void a_lobe_of_a_sac_is_closed(void **state)
{
    (void)state;
    SweepShape s;
    straight(&s);
    SweepModel *model = sweep_model_of(&s, 1);
    sweep_add_sac(model, 4, vec3(5, 3.6, 3), 1.5);
    sweep_add_lobe(model, vec3(5, 5.8, 3), 1.2);
    SweepMesh *mesh = mesh_of(model, NULL);
    assert_closed(mesh);
    assert_int_equal(vertices_off_wall(model, mesh), 0);
    double top = 0;
    for (int v = 0; v < mesh->surface->vertex_count; v++)
        top = fmax(top, mesh->surface->vertex[v].y);
    assert_true(top > 6.9 && top < 7.5);
    sweep_mesh_free(mesh);
    sweep_model_free(model);
}

// A child that turns back at its fork more tightly than its lumen is wide: t jumps across the inner side of the bend, within the patch and at its cut.
static void a_hairpin_is_closed(void **state)
{
    (void)state;
    enum { KNOTS = 60 };
    static const double bend = 0.3, turn = 1.7;
    for (int moved = 0; moved < 3; moved++) {
        SweepShape s[2] = {{.pitch = 1, .parent = -1, .radius = 1, .open_start = true},
                           {.pitch = 0.5, .parent = 0, .parent_t = 6, .radius = 0.5, .knots = KNOTS}};
        sweep_shape_line(&s[0], vec3(0, 0, 0), vec3(14, 0, 0), 15);
        for (int k = 0; k < KNOTS; k++) {
            double way = 6.0 * k / (KNOTS - 1), a = fmax(0, fmin(turn, (way - 1.5) / bend)), rest = fmax(0, way - 1.5 - bend * turn);
            s[1].knot[k] = vec3(6 + bend * (1 - cos(a)) + rest * sin(a), fmin(way, 1.5) + bend * sin(a) + rest * cos(a), 0.4 * fmax(0, way - 1.5));
        }
        for (int i = 0; i < 2 && moved; i++)
            for (int k = 0; k < s[i].knots; k++)
                s[i].knot[k] = moved == 1 ? mirrored(s[i].knot[k]) : rotated(s[i].knot[k]);
        SweepModel *model = sweep_model_of(s, 2);
        SweepMesh *mesh = mesh_of(model, NULL);
        SurfaceCensus c = census_of(mesh);
        print_message("hairpin: %d patches, %d failures, Euler characteristic %d, open %d\n", mesh->patches, mesh->failures, (int)c.euler, (int)c.open_edges);
        assert_closed(mesh);
        sweep_mesh_free(mesh);
        sweep_model_free(model);
    }
}

// --- Sections and masks ---

static double semi_axis[2];

// R = a b / sqrt((b cos)^2 + (a sin)^2), its first 16 harmonics by sums over 256 angles.
static void ellipse(double t, double length, double *term)
{
    enum { ANGLES = 256 };
    (void)t, (void)length;
    for (int i = 0; i < ANGLES; i++) {
        double angle = 2 * PI * i / ANGLES, r = semi_axis[0] * semi_axis[1] / hypot(semi_axis[1] * cos(angle), semi_axis[0] * sin(angle));
        term[0] += r / ANGLES;
        for (int k = 1; k <= SWEEP_HARMONICS; k++)
            term[2 * k - 1] += 2 * r * cos(k * angle) / ANGLES, term[2 * k] += 2 * r * sin(k * angle) / ANGLES;
    }
}

// Harmonics beyond the eighth are missing: of an ellipse, about ((a - b) / (a + b))^5 of the radius.
static void figures_of_an_ellipse_are_exact(void **state)
{
    (void)state;
    static const double axes[][2] = {{1.1, 1}, {1.5, 1}};
    for (int i = 0; i < 2; i++) {
        double a = semi_axis[0] = axes[i][0], b = semi_axis[1] = axes[i][1], perimeter = 0, flat = (a - b) / (a + b), missing = 2 * pow(flat, 5);
        for (int k = 0; k < 4000; k++)
            perimeter += 2 * PI / 4000 * hypot(a * sin(2 * PI * k / 4000), b * cos(2 * PI * k / 4000));
        SweepShape shape;
        straight(&shape);
        shape.section = ellipse;
        SweepModel *model = sweep_model_of(&shape, 1);
        SweepField *field = sweep_field_create(model);
        for (double t = 0; t <= 8; t += 4) {
            SweepSection s;
            assert_true(sweep_section_at(field, 0, t, &s));
            assert_int_equal(s.kind, SECTION_POLAR);
            assert_true(fabs(s.least_diameter - 2 * b) < 2 * missing && fabs(s.largest_diameter - 2 * a) < 2 * missing);
            assert_true(vec3_distance(s.centre, vec3(1 + t, 2, 3)) < 1e-12 && vec3_distance(s.normal, vec3(1, 0, 0)) < 1e-12);
            assert_true(fabs(s.area - PI * a * b) < 2 * PI * missing);
            assert_true(fabs(s.perimeter - perimeter) < 2 * PI * missing);
            assert_true(fabs(s.least - b) < missing && fabs(s.largest - a) < missing);
            assert_true(fabs(s.circularity - 4 * PI * PI * a * b / (perimeter * perimeter)) < 4 * missing);
        }
        sweep_field_free(field);
        sweep_model_free(model);
    }
}

// Voxels of each label, times their volume, against the exact cylinder with a dome: first order in the voxel at most.
static void a_mask_has_the_volume(void **state)
{
    (void)state;
    SweepShape shape;
    straight(&shape);
    SweepModel *model = sweep_model_of(&shape, 1);
    VesselTree *tree = vessel_tree_create(1, 0, 0);
    tree->center[0] = vec3(1, 2, 3), tree->radius[0] = 1, tree->direction[0] = vec3(1, 0, 0), tree->parent[0] = -1;
    assert_true(vessel_tree_link(tree));
    ModelMaskOptions options = {.sweep = model, .spacing_mm = 0.1, .frame = "RAS"};
    static const char path[] = "/tmp/test_sweep_mesh.nrrd";
    faults_clear(&faults);
    assert_true(model_mask_write(path, tree, "model", &options, &faults));
    Volume *volume = volume_load(path, &faults);
    assert_non_null(volume);
    assert_string_equal(volume->frame, "RAS");
    int64_t count = (int64_t)volume->size[0] * volume->size[1] * volume->size[2], inside = 0;
    for (int64_t i = 0; i < count; i++) {
        assert_true(volume->value[i] == 0 || volume->value[i] == 1);
        inside += volume->value[i] > 0;
    }
    double exact = 8 * PI + 2 * PI / 3;
    print_message("mask: %.3f of %.3f mm3\n", (double)inside * 1e-3, exact);
    assert_true(fabs((double)inside * 1e-3 - exact) < 0.02 * exact);
    volume_free(volume);
    unlink(path);
    vessel_tree_free(tree);
    sweep_model_free(model);
}

// --- Larger models ---

static void report(const char *name, const SweepModel *model, int off_allowed)
{
    double start = cpu_s();
    SweepMesh *mesh = mesh_of(model, NULL);
    double seconds = cpu_s() - start;
    assert_closed(mesh);
    int off = vertices_off_wall(model, mesh);
    print_message("%s: %d triangles, %d patches in %.3f s; %d vertices off the wall, %d pairs of triangles cross\n", name, mesh->surface->triangle_count,
                  mesh->patches, seconds, off, self_intersections(mesh->surface));
    assert_true(off <= off_allowed);
    sweep_mesh_free(mesh);
}

static void larger_models_are_closed(void **state)
{
    (void)state;
    if (!all) {
        print_message("skipped: phantom, tree and angiogram need --all\n");
        return;
    }
    static const char *const name[] = {"phantom", "tree"};
    for (int i = 0; i < 2; i++) {
        SweepModel *model = fitted(name[i], 0, NULL);
        report(name[i], model, 0);
        sweep_model_free(model);
    }
    static const char volume[] = SOURCE_DIR "/../shared/data/aneurism.nrrd";
    if (access(volume, R_OK) != 0) {
        print_message("skipped: the angiogram, %s is not here\n", volume);
        return;
    }
    char tree_path[] = "/tmp/test_sweep_mesh_tree.h5", command[512];
    snprintf(command, sizeof command, "build/ci/seldinger segment %s --trace scenes/aneurism/trace.yaml -o %s --quiet", volume, tree_path);
    if (access("build/ci/seldinger", X_OK) != 0 || system(command) != 0) {
        print_message("skipped: the angiogram, build/ci/seldinger is not built\n");
        return;
    }
    VesselTree *tree = tree_file_load(tree_path, NULL, &faults);
    SweepModel *model = swept(tree, sweep_fit_default_options(), NULL);
    // where the curve folds back on itself, F depends on the foot on the curve from which it is seen
    report("angiogram", model, 10);
    sweep_model_free(model);
    vessel_tree_free(tree);
    unlink(tree_path);
}

int main(int count, char **argument)
{
    all = count > 1 && !strcmp(argument[1], "--all");
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(distance_and_volume_are_of_second_order),
        cmocka_unit_test(forks_are_closed),
        cmocka_unit_test(moved_models_have_the_same_volume),
        cmocka_unit_test(an_update_gives_the_fresh_mesh),
        cmocka_unit_test(slopes_have_the_bits_of_samples),
        cmocka_unit_test(ends_are_numbered),
        cmocka_unit_test(a_sac_is_part_of_the_mesh),
        cmocka_unit_test(failed_tries_are_remembered),
        cmocka_unit_test(a_lobe_of_a_sac_is_closed),
        cmocka_unit_test(a_hairpin_is_closed),
        cmocka_unit_test(figures_of_an_ellipse_are_exact),
        cmocka_unit_test(a_mask_has_the_volume),
        cmocka_unit_test(larger_models_are_closed),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
