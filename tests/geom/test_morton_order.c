// The order is that of keys whose bits alternate, computed here bit by bit and sorted by comparison.
#include "geom/morton_order.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

#include "small_meshes.h"

typedef struct Place {
    uint64_t key;
    int triangle;
} Place;

static int by_place(const void *a, const void *b)
{
    const Place *x = a, *y = b;
    return x->key != y->key ? (x->key < y->key ? -1 : 1) : x->triangle - y->triangle;
}

static uint64_t alternate(Vec3 p)
{
    const uint64_t at[3] = {(uint64_t)p.x, (uint64_t)p.y, (uint64_t)p.z};
    uint64_t key = 0;
    for (int b = 0; b < 60; b++)
        key |= (at[b % 3] >> b / 3 & 1) << b;
    return key;
}

static void compare_with_sorting(const TriangleMesh *mesh)
{
    Place *place = calloc((size_t)mesh->triangle_count, sizeof *place);
    Vec3 low = mesh->vertex[0], high = low;
    for (int v = 0; v < mesh->vertex_count; v++) {
        const Vec3 p = mesh->vertex[v];
        low = vec3(fmin(low.x, p.x), fmin(low.y, p.y), fmin(low.z, p.z));
        high = vec3(fmax(high.x, p.x), fmax(high.y, p.y), fmax(high.z, p.z));
    }
    const double side = fmax(high.x - low.x, fmax(high.y - low.y, high.z - low.z));
    for (int t = 0; t < mesh->triangle_count; t++) {
        const int *c = mesh->triangle[t];
        Vec3 middle = vec3_scale(vec3_add(vec3_add(mesh->vertex[c[0]], mesh->vertex[c[1]]), mesh->vertex[c[2]]), 1 / 3.0);
        place[t] = (Place){alternate(vec3_scale(vec3_sub(middle, low), ((1 << 20) - 1) / side)), t};
    }
    qsort(place, (size_t)mesh->triangle_count, sizeof *place, by_place);
    int *order = morton_order(mesh);
    assert_non_null(order);
    for (int t = 0; t < mesh->triangle_count; t++)
        assert_int_equal(order[t], place[t].triangle);
    free(order);
    free(place);
}

static void it_is_that_of_sorted_keys(void **state)
{
    (void)state;
    TriangleMesh ball = sphere_mesh(20), torus = torus_mesh(5, 1, 60, 30);
    compare_with_sorting(&ball);
    compare_with_sorting(&torus);
    // equal places: every triangle twice
    TriangleMesh twice = mesh_and(ball, torus_mesh(5, 1, 60, 30), vec3(0, 0, 0), false), again = mesh_and(twice, sphere_mesh(20), vec3(0, 0, 0), false);
    compare_with_sorting(&again);
    mesh_clear(&torus), mesh_clear(&again);
}

static void without_triangles_there_is_none(void **state)
{
    (void)state;
    TriangleMesh none = mesh_room(1, 1);
    assert_null(morton_order(&none));
    mesh_clear(&none);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(it_is_that_of_sorted_keys), cmocka_unit_test(without_triangles_there_is_none)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
