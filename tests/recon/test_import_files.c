// The same box from every surface format, the same curves from every centreline format, and the messages about damaged files.
#include "recon/surface/centreline_file.h"
#include "recon/surface/mesh_check.h"
#include "recon/surface/surface_file.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

static Faults faults;

static const double corner[8][3] = {{0, 0, 0}, {2, 0, 0}, {2, 3, 0}, {0, 3, 0}, {0, 0, 4}, {2, 0, 4}, {2, 3, 4}, {0, 3, 4}};
static const int face[12][3] = {{0, 3, 2}, {0, 2, 1}, {4, 5, 6}, {4, 6, 7}, {0, 1, 5}, {0, 5, 4},
                                {1, 2, 6}, {1, 6, 5}, {2, 3, 7}, {2, 7, 6}, {3, 0, 4}, {3, 4, 7}};

typedef struct Text {
    char byte[16384];
    size_t length;
} Text;

__attribute__((format(printf, 2, 3))) static void add(Text *text, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    text->length += (size_t)vsnprintf(text->byte + text->length, sizeof text->byte - text->length, format, arguments);
    va_end(arguments);
    assert_true(text->length < sizeof text->byte);
}

static void text_stl(Text *t)
{
    add(t, "solid box\n");
    for (int i = 0; i < 12; i++) {
        add(t, "facet normal 0 0 0\n outer loop\n");
        for (int k = 0; k < 3; k++)
            add(t, "  vertex %g %g %g\n", corner[face[i][k]][0], corner[face[i][k]][1], corner[face[i][k]][2]);
        add(t, " endloop\nendfacet\n");
    }
    add(t, "endsolid box\n");
}

static void binary_stl(Text *t)
{
    uint32_t count = 12;
    memset(t->byte, ' ', 80);
    memcpy(t->byte + 80, &count, 4);
    t->length = 84;
    for (int i = 0; i < 12; i++) {
        float number[12] = {0};
        for (int k = 0; k < 9; k++)
            number[3 + k] = (float)corner[face[i][k / 3]][k % 3];
        memcpy(t->byte + t->length, number, 48);
        memset(t->byte + t->length + 48, 0, 2);
        t->length += 50;
    }
}

static void text_ply(Text *t)
{
    add(t, "ply\nformat ascii 1.0\nelement vertex 8\nproperty float x\nproperty float y\nproperty float z\nelement face 12\n"
           "property list uchar int vertex_indices\nend_header\n");
    for (int i = 0; i < 8; i++)
        add(t, "%g %g %g\n", corner[i][0], corner[i][1], corner[i][2]);
    for (int i = 0; i < 12; i++)
        add(t, "3 %d %d %d\n", face[i][0], face[i][1], face[i][2]);
}

static void text_obj(Text *t)
{
    for (int i = 0; i < 8; i++)
        add(t, "v %g %g %g\n", corner[i][0], corner[i][1], corner[i][2]);
    for (int i = 0; i < 12; i++)
        add(t, "f %d//1 %d//1 %d//1\n", face[i][0] + 1, face[i][1] + 1, face[i][2] + 1);
}

// As VTK 9 writes it: the points' range within their array, and empty compressed arrays, which give the usual block size.
static void text_vtp(Text *t)
{
    add(t, "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"0.1\" byte_order=\"LittleEndian\" header_type=\"UInt32\" "
           "compressor=\"vtkZLibDataCompressor\"><PolyData>"
           "<Piece NumberOfPoints=\"8\" NumberOfPolys=\"12\"><Points><DataArray type=\"Float64\" NumberOfComponents=\"3\" format=\"ascii\">\n");
    for (int i = 0; i < 8; i++)
        add(t, "%g %g %g\n", corner[i][0], corner[i][1], corner[i][2]);
    add(t, "<InformationKey name=\"L2_NORM_RANGE\" location=\"vtkDataArray\" length=\"2\"><Value index=\"0\">\n0\n</Value><Value index=\"1\">\n1.7\n</Value>"
           "</InformationKey></DataArray></Points><Lines><DataArray type=\"Int64\" Name=\"connectivity\" format=\"binary\">\nAAAAAACAAAAAAAAA\n</DataArray>"
           "<DataArray type=\"Int64\" Name=\"offsets\" format=\"binary\">\nAAAAAACAAAAAAAAA\n</DataArray></Lines><Polys><DataArray type=\"Int32\" "
           "Name=\"connectivity\" format=\"ascii\">\n");
    for (int i = 0; i < 12; i++)
        add(t, "%d %d %d\n", face[i][0], face[i][1], face[i][2]);
    add(t, "</DataArray><DataArray type=\"Int32\" Name=\"offsets\" format=\"ascii\">\n");
    for (int i = 0; i < 12; i++)
        add(t, "%d\n", 3 * i + 3);
    add(t, "</DataArray></Polys></Piece></PolyData></VTKFile>\n");
}

static const struct {
    const char *name;
    void (*write)(Text *text);
} format[] = {{"text.stl", text_stl}, {"binary.stl", binary_stl}, {"text.ply", text_ply}, {"text.obj", text_obj}, {"text.vtp", text_vtp}};
enum { FORMATS = sizeof format / sizeof format[0] };

static void test_surfaces(void **state)
{
    (void)state;
    for (int f = 0; f < FORMATS; f++) {
        Text *text = calloc(1, sizeof *text);
        format[f].write(text);
        faults_clear(&faults);
        assert_true(surface_is_known(text->byte, text->length < 512 ? text->length : 512, format[f].name));
        SurfaceMesh *mesh = surface_parse(text->byte, text->length, format[f].name, &faults);
        assert_non_null(mesh);
        MeshCheck check;
        assert_true(mesh_repair(mesh, &check));
        assert_int_equal(mesh->vertex_count, 8);
        assert_int_equal(mesh->triangle_count, 12);
        assert_float_equal(check.volume, 24, 1e-9);
        assert_int_equal(check.open_edges.count, 0);
        surface_free(mesh);
        free(text);
    }
}

// A file truncated anywhere is either refused with a fault that gives its name, or the remaining part is a valid file with fewer triangles.
static void test_cut_short(void **state)
{
    (void)state;
    for (int f = 0; f < FORMATS; f++) {
        Text *text = calloc(1, sizeof *text);
        format[f].write(text);
        int refused = 0;
        for (size_t n = 0; n + 16 < text->length; n++) {
            char *exact = malloc(n + 1);   // so that the sanitizer detects reading past the end
            memcpy(exact, text->byte, n);
            faults_clear(&faults);
            SurfaceMesh *mesh = surface_parse(exact, n, format[f].name, &faults);
            if (mesh) {
                assert_true(mesh->triangle_count <= 12);
                assert_int_equal(faults.count, 0);
                surface_free(mesh);
            } else {
                assert_true(faults.count > 0);
                assert_non_null(strstr(faults.text[0], format[f].name));
                refused++;
            }
            free(exact);
        }
        // an OBJ line is complete by itself; the other formats declare what must follow
        print_message("%s: %d of %zu cuts refused\n", format[f].name, refused, text->length - 16);
        assert_true(f == 3 ? refused > 100 : refused + 16 == (int)text->length);
        free(text);
    }
}

static void refused_surface(const char *name, const char *text, const char *says)
{
    faults_clear(&faults);
    SurfaceMesh *mesh = surface_parse(text, strlen(text), name, &faults);
    print_message("%s\n", faults.count ? faults.text[0] : "taken");
    assert_null(mesh);
    assert_true(faults.count > 0);
    assert_non_null(strstr(faults.text[0], says));
}

static void test_broken_surfaces(void **state)
{
    (void)state;
    refused_surface("empty.stl", "", "empty.stl");
    refused_surface("words.txt", "a letter to a friend\n", "words.txt");
    refused_surface("index.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n", "index.obj:4");
    refused_surface("zero.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n", "zero.obj:4");
    refused_surface("nan.obj", "v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n", "nan.obj:2");
    refused_surface("huge.obj", "v 0 0 0\nv 1e999 0 0\nv 0 1 0\nf 1 2 3\n", "huge.obj:2");
    refused_surface("points.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n", "points.obj");
    refused_surface("word.stl", "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 zero 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid\n",
                    "word.stl:5");
    refused_surface("many.ply", "ply\nformat ascii 1.0\nelement vertex 999999999999\nproperty float x\nproperty float y\nproperty float z\nend_header\n",
                    "many.ply");
    refused_surface("grid.vtp", "<?xml version=\"1.0\"?>\n<VTKFile type=\"ImageData\"></VTKFile>\n", "ImageData");
    refused_surface("open.vtp", "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\"><PolyData>\n", "open.vtp");
}

static CurveSet *two_curves(void)
{
    CurveSet *set = curve_set_create();
    const Vec3 a[3] = {{0, 0, 0}, {1, 2, 3}, {1.5, 2.25, 7}}, b[2] = {{1, 2, 3}, {-4, 0.125, 3}};
    const double ra[3] = {1, 0.5, 0.25}, rb[2] = {0.5, 2};
    assert_true(curve_set_add(set, a, ra, 3));
    assert_true(curve_set_add(set, b, rb, 2));
    return set;
}

static double total_length(const CurveSet *set)
{
    double length = 0;
    for (int c = 0; c < set->curve_count; c++)
        for (int i = set->offset[c] + 1; i < set->offset[c + 1]; i++)
            length += vec3_distance(set->point[i - 1], set->point[i]);
    return length;
}

static void test_curves(void **state)
{
    (void)state;
    const char *const name[] = {"curves.vtp", "curves.mrk.json", "curves.swc"};
    for (size_t f = 0; f < sizeof name / sizeof name[0]; f++) {
        CurveSet *set = two_curves(), *again = curve_set_create();
        size_t length;
        faults_clear(&faults);
        char *text = centreline_text(set, name[f], &length, &faults);
        assert_non_null(text);
        assert_true(centreline_parse(text, length, name[f], again, &faults));
        // SWC has no curves, only samples and their parents: a curve that begins on another one divides it there
        assert_int_equal(again->curve_count, f == 2 ? 3 : 2);
        assert_float_equal(total_length(again), total_length(set), 1e-9);
        for (int i = 0; i < again->point_count; i++) {
            int same = -1;
            for (int k = 0; k < set->point_count; k++)
                if (vec3_distance(again->point[i], set->point[k]) < 1e-9)
                    same = k;
            assert_true(same >= 0);
            assert_float_equal(again->radius[i], set->radius[same], 1e-9);
        }
        // cut short: refused, and nothing of it is in the set
        for (size_t n = 0; n + 2 < length; n++) {
            char *exact = malloc(n + 1);
            memcpy(exact, text, n);
            faults_clear(&faults);
            int before = again->point_count;
            if (!centreline_parse(exact, n, name[f], again, &faults)) {
                assert_true(faults.count > 0);
                assert_int_equal(again->point_count, before);
            } else
                assert_int_equal(f, 2);   // a whole line less is SWC too
            free(exact);
        }
        free(text);
        curve_set_free(set);
        curve_set_free(again);
    }
}

static void refused_curves(const char *name, const char *text, const char *says)
{
    CurveSet *set = curve_set_create();
    faults_clear(&faults);
    assert_false(centreline_parse(text, strlen(text), name, set, &faults));
    print_message("%s\n", faults.count ? faults.text[0] : "no fault");
    assert_true(faults.count > 0);
    assert_non_null(strstr(faults.text[0], says));
    assert_int_equal(set->curve_count, 0);
    curve_set_free(set);
}

static void test_broken_curves(void **state)
{
    (void)state;
    refused_curves("empty.swc", "", "empty.swc");
    refused_curves("orphan.swc", "1 0 0 0 0 1 -1\n2 0 1 0 0 1 7\n", "parent 7");
    refused_curves("twice.swc", "1 0 0 0 0 1 -1\n1 0 1 0 0 1 1\n", "twice.swc:2");
    refused_curves("ring.swc", "1 0 0 0 0 1 3\n2 0 1 0 0 1 1\n3 0 2 0 0 1 2\n", "ring.swc");
    refused_curves("nan.swc", "1 0 0 0 0 1 -1\n2 0 inf 0 0 1 1\n", "nan.swc:2");
    refused_curves("none.mrk.json", "{\"markups\": []}", "markups");
    refused_curves("point.mrk.json", "{\"markups\": [{\"type\": \"Fiducial\", \"controlPoints\": []}]}", "Fiducial");
    refused_curves("short.mrk.json", "{\"markups\": [{\"type\": \"Curve\", \"controlPoints\": [{\"position\": [0, 0, 0]}]}]}", "1 control points");
    refused_curves("word.mrk.json", "{\"markups\": [{\"type\": \"Curve\", \"controlPoints\": [{\"position\": [0, 0, 0]}, {\"position\": [1, \"a\", 0]}]}]}",
                   "control point 1");
    refused_curves("torn.mrk.json", "{\"markups\": [{\"type\": \"Curve\",\n", "torn.mrk.json");
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_surfaces), cmocka_unit_test(test_cut_short), cmocka_unit_test(test_broken_surfaces),
                                       cmocka_unit_test(test_curves), cmocka_unit_test(test_broken_curves)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
