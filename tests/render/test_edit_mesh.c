// The surface that the editor shows: its vertices lie on the blended wall, and after each edit an update gives the mesh that a new one is. `test_edit_mesh MODEL.h5`
// prints the time from an edit to its surface on that model, and the time that the closed mesh (geom/sweep_mesh.h) takes to follow.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "recon/edit/edit_file.h"
#include "render/edit_mesh.h"
#include "tests/geom/sweep_models.h"

#include <string.h>
#include <time.h>

static Faults faults;

static SweepModel *fork_model(void)
{
    static SweepShape shape[2] = {{.pitch = 1, .parent = -1, .open_start = true, .radius = 2}, {.pitch = 1, .parent_t = 15, .radius = 1.4}};
    sweep_shape_line(&shape[0], vec3(0, 0, 0), vec3(40, 0, 0), 21);
    sweep_shape_line(&shape[1], vec3(15, 0, 0), vec3(25, 0, 20), 11);
    return sweep_model_of(shape, 2);
}

static void assert_same_mesh(const EditMesh *a, const EditMesh *b)
{
    size_t vertices = (size_t)a->surface->vertex_count;
    assert_int_equal(a->surface->vertex_count, b->surface->vertex_count);
    assert_int_equal(a->surface->triangle_count, b->surface->triangle_count);
    assert_memory_equal(a->surface->vertex, b->surface->vertex, vertices * sizeof(Vec3));
    assert_memory_equal(a->surface->normal, b->surface->normal, vertices * sizeof(Vec3));
    assert_memory_equal(a->branch, b->branch, vertices * sizeof *a->branch);
    assert_memory_equal(a->along, b->along, vertices * sizeof *a->along);
    assert_memory_equal(a->surface->triangle, b->surface->triangle, (size_t)a->surface->triangle_count * sizeof *a->surface->triangle);
}

static void an_update_is_a_new_mesh(void **state)
{
    (void)state;
    static const char text[] = "edits:\n"
                               "- {edit: section, branch: 0, t_mm: 30, contour_nb_mm: [[2.4, 0], [0, 1.8], [-2.2, 0], [0, -1.9]]}\n"
                               "- {edit: smooth, to: circle, strength: 0.5, branch: 0}\n"
                               "- {edit: section, branch: 0, t_mm: 15, contour_nb_mm: [[2.2, 0], [0, 2.2], [-2.2, 0], [0, -2.2]]}\n"
                               "- {edit: blend, branch: 1, width: 0.2}\n"
                               "- {edit: branch, parent: 0, t_mm: 30, points_mm: [[30, 3, 0], [30, 8, 0], [32, 14, 0]], radii_mm: [1, 0.8, 0.7]}\n"
                               "- {edit: section, branch: 2, t_mm: 7, contour_nb_mm: [[0.9, 0], [0, 1], [-0.9, 0], [0, -1]]}\n"
                               "- {edit: cut, branch: 1, t_mm: 0}\n";
    SweepModel *m = fork_model();
    SweepEditor *e = sweep_editor_create(m);
    EditList *list = edit_list_parse(text, sizeof text - 1, "test.yaml", &faults);
    assert_non_null(list);
    EditMesh *mesh = edit_mesh_create(sweep_editor_field(e), NULL, vec3(0, 0, 0), vec3(0, 0, 0));
    for (int i = 0; i < list->count; i++) {
        EditChange change;
        assert_true(sweep_editor_do(e, &list->edit[i], "test.yaml", &change, &faults));
        const SweepField *field = sweep_editor_field(e);
        bool is_local = edit_mesh_update(mesh, field, change.low, change.high);
        assert_true(is_local == (list->edit[i].kind != EDIT_BRANCH && list->edit[i].kind != EDIT_CUT));
        if (!is_local) {
            EditMesh *next = edit_mesh_create(field, mesh, change.low, change.high);
            edit_mesh_free(mesh);
            mesh = next;
        }
        assert_non_null(mesh);
        assert_true(mesh->made > 0);
        if (list->edit[i].kind == EDIT_SECTION)
            assert_true(mesh->made < mesh->ring_count);
        EditMesh *fresh = edit_mesh_create(field, NULL, change.low, change.high);
        assert_same_mesh(mesh, fresh);
        edit_mesh_free(fresh);
    }
    edit_mesh_free(mesh);
    edit_list_free(list);
    sweep_editor_free(e);
    sweep_model_free(m);
}

// Outside the other branch, each vertex is on the blended wall.
static void vertices_are_on_the_wall(void **state)
{
    (void)state;
    SweepModel *m = fork_model();
    SweepField *field = sweep_field_create(m);
    EditMesh *mesh = edit_mesh_create(field, NULL, vec3(0, 0, 0), vec3(0, 0, 0));
    int on = 0, inside = 0;
    for (int i = 0; i < mesh->surface->vertex_count; i++) {
        SweepBlend b;
        sweep_field_blend(field, (SweepPlace){.branch = mesh->branch[i], .t = mesh->along[i], .sac = -1}, mesh->surface->vertex[i], &b);
        assert_true(b.f > -1e-3);
        if (b.f < 1e-3)
            on++;
        else
            inside++;
    }
    assert_true(on > 8 * inside && inside > 0);   // inside: what the other branch hides
    edit_mesh_free(mesh);
    sweep_field_free(field);
    sweep_model_free(m);
}

// Half a ring of radii 0.8 and 2.8 with round ends about the curve: within its notch, points of the surface are 0.5 mm from the curve, and the lumen behind them is
// more than 1.2 mm away.
static void a_notch_is_shown(void **state)
{
    (void)state;
    enum { POINTS = 64 };
    Vec3 contour[POINTS];
    for (int i = 0; i < POINTS; i++) {
        double way = 2.8 * PI * i / POINTS, angle = way / 1.4 - PI / 2, r = 1.4, up = 0;
        if (way >= 2.3 * PI)
            angle = (way - 2.3 * PI) / 0.5 + PI / 2, r = 0.5, up = -0.9;
        else if (way >= 1.9 * PI)
            angle = PI / 2 - (way - 1.9 * PI) / 0.4, r = 0.4;
        else if (way >= 1.4 * PI)
            angle = (way - 1.4 * PI) / 0.5 + PI / 2, r = 0.5, up = 0.9;
        contour[i] = vec3(2 * (r * cos(angle) - 0.65), 2 * (up + r * sin(angle)), 0);
    }
    SweepModel *m = fork_model();
    SweepEditor *e = sweep_editor_create(m);
    EditMesh *mesh = edit_mesh_create(sweep_editor_field(e), NULL, vec3(0, 0, 0), vec3(0, 0, 0));
    for (int i = 0; i < 5; i++) {
        EditChange change;
        assert_true(
            sweep_editor_do(e, &(SweepEdit){.kind = EDIT_SECTION, .branch = 0, .t = 28 + i, .count = POINTS, .point = contour}, "edit", &change, &faults));
        assert_true(edit_mesh_update(mesh, sweep_editor_field(e), change.low, change.high));
        EditMesh *fresh = edit_mesh_create(sweep_editor_field(e), NULL, change.low, change.high);
        assert_same_mesh(mesh, fresh);
        edit_mesh_free(fresh);
    }
    const SweepField *field = sweep_editor_field(e);
    int notch = 0, shaped = 0;
    for (int i = 0; i < mesh->surface->vertex_count; i++) {
        Vec3 x = mesh->surface->vertex[i];
        if (mesh->branch[i] != 0 || fabs(mesh->along[i] - 30) > 1)
            continue;
        SweepBlend b;
        sweep_field_blend(field, (SweepPlace){.branch = 0, .t = mesh->along[i], .sac = -1}, x, &b);
        assert_true(fabs(b.f) < 1e-3 && vec3_dot(b.gradient, mesh->surface->normal[i]) < 0);
        shaped++;
        notch += hypot(x.y, x.z) < 0.7;
    }
    assert_true(shaped >= 40 && notch >= 2);
    edit_mesh_free(mesh);
    sweep_editor_free(e);
    sweep_model_free(m);
}

static double cpu_ms(void) { return 1e3 * (double)clock() / CLOCKS_PER_SEC; }

static int measure(const char *path)
{
    EditFile file;
    if (!edit_file_load(path, &file, &faults)) {
        print_error("%s\n", faults.text[0]);
        return 2;
    }
    double most = 0, sum = 0, start = cpu_ms();
    SweepEditor *e = sweep_editor_create(file.model);
    EditMesh *mesh = edit_mesh_create(sweep_editor_field(e), NULL, vec3(0, 0, 0), vec3(0, 0, 0));
    print_message("%d vertices, %d triangles, first mesh with sacs %.0f ms\n", mesh->surface->vertex_count, mesh->surface->triangle_count, cpu_ms() - start);
    int count = 0, slow = 0;
    EditChange change;
    double closed_most = 0, closed_sum = 0;
    start = cpu_ms();
    SweepMesh *closed = sweep_mesh_create(sweep_editor_field(e), NULL);
    print_message("closed mesh: %d triangles, %.0f ms\n", closed->surface->triangle_count, cpu_ms() - start);
    for (int i = 0; i < file.model->branch_count; i++)
        for (int k = 5; k < file.model->branch[i].break_count - 5; k += 10, count++) {
            Vec3 point[32];
            double t = file.model->break_t[file.model->branch[i].first_break + k];
            sweep_edit_contour(file.model, i, t, 32, point);
            for (int p = 0; p < 32; p++)
                point[p].x *= 1.05;
            start = cpu_ms();
            sweep_editor_do(e, &(SweepEdit){.kind = EDIT_SECTION, .branch = i, .t = t, .count = 32, .point = point}, "edit", &change, &faults);
            edit_mesh_update(mesh, sweep_editor_field(e), change.low, change.high);
            most = fmax(most, cpu_ms() - start), sum += cpu_ms() - start;
            start = cpu_ms();
            sweep_mesh_update(closed, sweep_editor_field(e));
            double took = cpu_ms() - start;
            closed_most = fmax(closed_most, took), closed_sum += took, slow += took > 50;
        }
    print_message("%d sections replaced, surface included: mean %.1f ms, largest %.1f ms\n", count, sum / count, most);
    print_message("the closed mesh follows: mean %.1f ms, largest %.1f ms, %d of %d over 50 ms\n", closed_sum / count, closed_most, slow, count);
    start = cpu_ms();
    sweep_editor_do(e, &(SweepEdit){.kind = EDIT_SMOOTH, .extent = SMOOTH_TREE, .amount = 0.5}, "edit", &change, &faults);
    edit_mesh_update(mesh, sweep_editor_field(e), change.low, change.high);
    print_message("the tree smoothed: %.1f ms", cpu_ms() - start);
    start = cpu_ms();
    sweep_mesh_update(closed, sweep_editor_field(e));
    print_message(", the closed mesh %.1f ms\n", cpu_ms() - start);
    sweep_mesh_free(closed);
    edit_mesh_free(mesh);
    sweep_editor_free(e);
    edit_file_free(&file);
    return 0;
}

int main(int argc, char **argv)
{
    if (argc > 1)
        return measure(argv[1]);
    const struct CMUnitTest tests[] = {cmocka_unit_test(an_update_is_a_new_mesh), cmocka_unit_test(vertices_are_on_the_wall),
                                       cmocka_unit_test(a_notch_is_shown)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
