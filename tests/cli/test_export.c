// `export` as a user runs it: the four surface formats contain the same closed surface with outward normals, with vertex fields if the format has them; our own
// readers give back the centrelines that were written.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "recon/surface/centreline_file.h"
#include "recon/surface/mesh_check.h"
#include "recon/tree_file.h"

#include <expat.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>

static char folder[] = "/tmp/seldinger-export-XXXXXX";
#include "tests/folder.h"

static int seldinger(const char *verb, const char *in, const char *more, const char *out)
{
    char command[1000];
    snprintf(command, sizeof command, "%s %s '%s' %s -o '%s' >'%s' 2>&1", SELDINGER_PROGRAM, verb, in, more, out, in_folder("said.txt"));
    int status = system(command);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

static int make_model(void **state)
{
    char command[1000];
    if (make_folder(state) != 0)
        return -1;
    snprintf(command, sizeof command, "%s synth bifurcation --points 40 --quiet -o '%s'", SELDINGER_PROGRAM, in_folder("tree.h5"));
    return system(command) == 0 ? seldinger("fit", in_folder("tree.h5"), "--target-mm 0.1 --quiet", in_folder("model.h5")) : -1;
}

static void all_formats_hold_the_same_surface(void **state)
{
    (void)state;
    static const char *const names[] = {"s.stl", "s.ply", "s.obj", "s.vtp"};
    static Faults faults;
    double area = 0, volume = 0;
    int triangles = 0;
    for (int k = 0; k < 4; k++) {
        MeshCheck check;
        assert_int_equal(seldinger("export", in_folder("model.h5"), "--cell-mm 0.2", in_folder(names[k])), 0);
        SurfaceMesh *mesh = surface_load(in_folder(names[k]), &faults);
        assert_non_null(mesh);
        assert_true(mesh_repair(mesh, &check));
        assert_int_equal(check.component_count, 1);
        assert_int_equal(check.open_edges.count + check.nonmanifold_edges.count + check.one_sided_edges.count + check.flipped_triangles.count, 0);
        assert_int_equal(check.inside_out_count, 0);
        if (k > 0) {   // numbers have nine digits; seven in an STL
            assert_true(fabs(check.area - area) < 1e-5 * area);
            assert_true(fabs(check.volume - volume) < 1e-5 * volume);
            assert_int_equal(check.triangle_count, triangles);
        }
        area = check.area, volume = check.volume, triangles = check.triangle_count;
        surface_free(mesh);
    }
    char *message = text_of(in_folder("said.txt")), expected[100];
    snprintf(expected, sizeof expected, "%d triangles", triangles);
    assert_non_null(strstr(message, expected));
    assert_non_null(strstr(message, "parts          1, Euler characteristic 2"));
    assert_non_null(strstr(message, "0 open, 0 non-manifold"));
    free(message);
}

static void vertices_carry_their_errors(void **state)
{
    (void)state;
    static Faults faults;
    VesselTree *tree = tree_file_load(in_folder("model.h5"), NULL, &faults);
    assert_non_null(tree);
    assert_int_equal(seldinger("export", in_folder("model.h5"), "--cell-mm 0.3 --open-inlet", in_folder("o.ply")), 0);
    char *message = text_of(in_folder("said.txt")), *text = text_of(in_folder("o.ply"));
    assert_non_null(strstr(message, "Euler characteristic 1")); // a closed tree with one opening
    assert_non_null(strstr(text, "property int node\nproperty float error_mm\nproperty float data_mm\nelement face"));
    int vertices = 0, close = 0;
    assert_int_equal(sscanf(strstr(text, "element vertex"), "element vertex %d", &vertices), 1);
    char *at = strstr(text, "end_header\n") + 11;
    for (int v = 0; v < vertices; v++) {
        double x[9];
        int node;
        for (int i = 0; i < 6; i++)
            x[i] = strtod(at, &at);
        node = (int)strtol(at, &at, 10);
        x[6] = strtod(at, &at), x[7] = strtod(at, &at);
        assert_true(node >= 0 && node < tree->node_count);
        assert_true(isfinite(x[6]) && x[7] >= 0);
        close += fabs(x[6]) < 0.1;
        // around the root, not upstream of it
        Vec3 away = vec3_sub(vec3(x[0], x[1], x[2]), tree->center[0]);
        if (vec3_norm(away) < 2 * tree->radius[0])
            assert_true(vec3_dot(away, tree->direction[0]) > -1e-6);
    }
    assert_true(close > 0.9 * vertices);   // fitted to a tenth of a mm
    free(text);
    free(message);
    assert_int_equal(seldinger("export", in_folder("model.h5"), "--cell-mm 0.3", in_folder("o.vtp")), 0);
    text = text_of(in_folder("o.vtp"));
    XML_Parser parser = XML_ParserCreate(NULL);
    assert_int_equal(XML_Parse(parser, text, (int)strlen(text), 1), XML_STATUS_OK);
    XML_ParserFree(parser);
    assert_non_null(strstr(text, "Name=\"error_mm\" NumberOfComponents=\"1\""));
    assert_non_null(strstr(text, "Name=\"data_mm\""));
    assert_non_null(strstr(text, "Name=\"node\""));
    free(text);
    vessel_tree_free(tree);
}

static void centrelines_come_back(void **state)
{
    (void)state;
    static const char *const names[] = {"c.vtp", "c.mrk.json", "c.swc"};
    static Faults faults;
    VesselTree *tree = tree_file_load(in_folder("tree.h5"), NULL, &faults);
    assert_non_null(tree);
    double length = 0;
    for (int i = 1; i < tree->node_count; i++)
        length += vec3_distance(tree->center[i], tree->center[tree->parent[i]]);
    for (int k = 0; k < 3; k++) {
        assert_int_equal(seldinger("export", in_folder("tree.h5"), "", in_folder(names[k])), 0);
        CurveSet *set = curve_set_create();
        assert_true(centreline_load(in_folder(names[k]), set, &faults));
        double read = 0;
        for (int c = 0; c < set->curve_count; c++)
            for (int i = set->offset[c]; i < set->offset[c + 1]; i++) {
                int near = -1;
                for (int n = 0; n < tree->node_count && near < 0; n++)
                    near = vec3_distance(set->point[i], tree->center[n]) < 1e-6 && fabs(set->radius[i] - tree->radius[n]) < 1e-6 ? n : -1;
                assert_true(near >= 0);   // each point is a node, with its radius
                read += i > set->offset[c] ? vec3_distance(set->point[i], set->point[i - 1]) : 0;
            }
        assert_true(fabs(read - length) < 1e-5 * length);   // each link exists once
        curve_set_free(set);
    }
    vessel_tree_free(tree);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(all_formats_hold_the_same_surface),
        cmocka_unit_test(vertices_carry_their_errors),
        cmocka_unit_test(centrelines_come_back),
    };
    return cmocka_run_group_tests_name("export", tests, make_model, remove_folder);
}
