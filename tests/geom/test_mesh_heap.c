// Queries of a mesh make no heap calls, including those by Embree.
#include "geom/mesh_vessel.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#include "../heap_calls.h"
#include "small_meshes.h"

static void questions_make_no_heap_call(void **state)
{
    (void)state;
    need_counting();
    if (!mesh_vessel_available()) {
        print_message("skipped: built without Embree\n");
        skip();
    }
    TriangleMesh mesh = sphere_mesh(24);
    static Faults faults;
    MeshVesselOptions options = mesh_vessel_default_options();
    for (int search = MESH_SEARCH_FULL; search <= MESH_SEARCH_CACHED; search++)
        for (int normals = MESH_FACES; normals <= MESH_SMOOTH; normals++) {
            options.search = (MeshSearch)search;
            options.normals = (MeshNormals)normals;
            Vessel *vessel = mesh_vessel_create(&mesh, &options, "test", &faults);
            assert_non_null(vessel);
            uint64_t seed = 1;
            VesselMemory memory = {.node = -1};
            VesselHit hit;
            Vec3 x = {0, 0, 0};
            long before = heap_calls();
            heap_watch(true);
            for (int i = 0; i < 2000; i++) {     // including the first query, and large jumps
                x = i % 100 ? vec3_add(x, vec3_scale(random_unit_vector(&seed), 0.05)) : random_in_box(&seed, 3);
                vessel_query(vessel, 1, &x, i % 2 ? 0.2 : HUGE_VAL, &memory, &hit);
                vessel->locate(vessel, x, i % 3 ? memory.node : -1);
            }
            heap_watch(false);
            assert_int_equal(heap_calls() - before, 0);
            vessel->destroy(vessel);
        }
    mesh_clear(&mesh);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(the_counter_counts), cmocka_unit_test(questions_make_no_heap_call)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
