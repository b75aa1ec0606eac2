// A closed box of 12 triangles with one kind of damage at a time: the report is right, and the repaired mesh has the box's volume again.
#include "recon/surface/mesh_check.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

static const char box[] = "v 0 0 0\nv 2 0 0\nv 2 3 0\nv 0 3 0\nv 0 0 4\nv 2 0 4\nv 2 3 4\nv 0 3 4\n"
                          "f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\n";
static const char last[] = "f 4 1 5 8\n";

static SurfaceMesh *spoilt(const char *more)
{
    static Faults faults;
    char text[1024];
    strcpy(text, box);
    strcat(text, more);
    faults_clear(&faults);
    SurfaceMesh *mesh = surface_parse(text, strlen(text), "box.obj", &faults);
    assert_non_null(mesh);
    return mesh;
}

static MeshCheck repaired(SurfaceMesh *mesh)
{
    MeshCheck first, second;
    assert_true(mesh_repair(mesh, &first));
    assert_true(mesh_check(mesh, &second));
    // repairing once is enough
    assert_int_equal(second.flipped_triangles.count + second.inside_out_count + second.duplicate_triangles.count + second.duplicate_vertices.count +
                         second.unreferenced_vertices.count,
                     0);
    surface_free(mesh);
    return first;
}

static void test_whole(void **state)
{
    (void)state;
    char text[512];
    MeshCheck c = repaired(spoilt(last));
    assert_int_equal(mesh_check_text(&c, true, text, sizeof text), 0);
    assert_float_equal(c.volume, 24, 1e-12);
    assert_float_equal(c.area, 52, 1e-12);
}

static void test_spoilt(void **state)
{
    (void)state;
    MeshCheck c = repaired(spoilt("f 8 5 1 4\n")); // the last face is flipped
    assert_int_equal(c.flipped_triangles.count, 2);
    assert_int_equal(c.flipped_triangles.first, 10);
    assert_float_equal(c.volume, 24, 1e-12);
    c = repaired(spoilt(""));                      // the last face is missing
    assert_int_equal(c.open_edges.count, 4);
    assert_int_equal(c.opening_count, 1);
    assert_float_equal(c.volume, 24, 1e-12);
    c = repaired(spoilt("f 4 1 5 8\nf 1 5 4\nv 9 9 9\nv 0 0 0\nf 1 1 2\n"));
    assert_int_equal(c.unreferenced_vertices.count, 1);
    assert_int_equal(c.duplicate_vertices.count, 0 + 1);
    assert_int_equal(c.degenerate_triangles.count, 1);
    c = repaired(spoilt("f 4 1 5 8\nf 4 1 5\n"));
    assert_int_equal(c.duplicate_triangles.count, 1);
    assert_int_equal(c.duplicate_triangles.first, 12);
    assert_float_equal(c.volume, 24, 1e-12);
}

static void test_inside_out_and_units(void **state)
{
    (void)state;
    SurfaceMesh *mesh = spoilt(last);
    for (int t = 0; t < mesh->triangle_count; t++) {
        int swap = mesh->triangle[t][0];
        mesh->triangle[t][0] = mesh->triangle[t][1];
        mesh->triangle[t][1] = swap;
    }
    for (int i = 0; i < mesh->vertex_count; i++)
        mesh->vertex[i] = vec3_scale(mesh->vertex[i], 0.001);
    MeshCheck c = repaired(mesh);
    assert_int_equal(c.inside_out_count, 1);
    assert_int_equal(c.flipped_triangles.count, 0);
    assert_true(c.unit_is_doubtful);
    assert_float_equal(c.volume, 24e-9, 1e-20);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_whole), cmocka_unit_test(test_spoilt), cmocka_unit_test(test_inside_out_and_units)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
