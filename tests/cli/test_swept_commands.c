// Commands on files that hold swept models only, or swept models and blobs: all choose the model by the same rule, and measure the same wall.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "recon/tree_file.h"

#include <stdlib.h>
#include <string.h>

static char folder[] = "/tmp/seldinger-swept-XXXXXX";
#include "tests/folder.h"

#include "json_file.h"
#include "program.h"

static int make_models(void **state)
{
    return make_folder(state) == 0 && run_in("", "synth y --quiet -o tree.h5") == 0 && run_in("", "fit tree.h5 --model sweep --quiet -o swept.h5") == 0 &&
                   run_in("", "fit tree.h5 --quiet -o blobs.h5") == 0 && run_in("", "fit blobs.h5 --model sweep --quiet -o both.h5") == 0
               ? 0
               : -1;
}

static double number(const cJSON *root, const char *name)
{
    const cJSON *item = cJSON_GetObjectItem(root, name);
    assert_true(cJSON_IsNumber(item));
    return item->valuedouble;
}

// Answers of `query` to one point beside the middle of the trunk.
static void query(const char *arguments, Vec3 x, double out[10])
{
    char text[200], command[300];
    snprintf(text, sizeof text, "x_mm,y_mm,z_mm\n%.17g,%.17g,%.17g\n", x.x, x.y, x.z);
    put("points.csv", text);
    snprintf(command, sizeof command, "query %s --points points.csv -o answers.csv --quiet", arguments);
    assert_int_equal(run_in("", command), 0);
    char *answers = text_of(in_folder("answers.csv")), *at = strchr(answers, '\n') + 1;
    for (int i = 0; i < 10; i++, at++)
        out[i] = strtod(at, &at);
    free(answers);
}

static void query_gives_the_distance(void **state)
{
    (void)state;
    static Faults faults;
    VesselTree *tree = tree_file_load(in_folder("tree.h5"), NULL, &faults);
    assert_non_null(tree);
    int node = 4;
    double r = tree->radius[node], swept[10], again[10], blobs[10], both[10];
    Vec3 aside = vec3_normal_to(tree->direction[node]), x = vec3_add_scaled(tree->center[node], 0.8 * r, aside);
    query("swept.h5", x, swept);
    assert_true(fabs(swept[8] - 0.2 * r) < 0.002 && fabs(swept[4] - 0.2 * r) < 0.002);     // f and the distance
    assert_true(vec3_distance(vec3(swept[5], swept[6], swept[7]), vec3_negate(aside)) < 0.02);
    assert_true(abs((int)swept[3] - node) <= 1 && swept[9] == 1);
    query("both.h5 --model sweep", x, again);
    assert_memory_equal(swept, again, sizeof swept);
    // without --model: the blobs, if there are any
    query("blobs.h5", x, blobs);
    query("both.h5", x, both);
    assert_memory_equal(blobs, both, sizeof blobs);
    assert_true(blobs[4] != swept[4]);
    query("swept.h5", vec3_add_scaled(tree->center[node], 1.3 * r, aside), swept);
    assert_true(fabs(swept[8] + 0.3 * r) < 0.005 && swept[9] == 0);
    vessel_tree_free(tree);
}

static void a_model_that_is_not_there_is_named(void **state)
{
    (void)state;
    put("points.csv", "x_mm,y_mm,z_mm\n0,0,0\n");
    assert_int_equal(run_in("", "query swept.h5 --model lim --points points.csv -o q.csv"), 2);
    assert_non_null(strstr(output, "has no model of the kind 'lim'; `seldinger fit --model lim` makes one"));
    assert_int_equal(run_in("", "synth y --measure swept.h5 --model pas"), 2);
    assert_non_null(strstr(output, "has no model of the kind 'pas'"));
    assert_int_equal(run_in("", "info blobs.h5 --sections s.csv"), 2);
    assert_non_null(strstr(output, "has no swept model"));
    assert_int_equal(run_in("", "query tree.h5 --points points.csv -o q.csv"), 2);
    assert_non_null(strstr(output, "is a tree without a model"));
}

static void synth_measures_the_distance_from_the_truth(void **state)
{
    (void)state;
    assert_int_equal(run_in("", "synth y --measure swept.h5 --json m.json --quiet"), 0);
    cJSON *root = json_of("m.json");
    const cJSON *to_model = cJSON_GetObjectItem(root, "truth_to_model"), *to_truth = cJSON_GetObjectItem(root, "model_to_truth");
    assert_true(number(to_model, "count") > 1000 && number(to_model, "mean_mm") < 0.001 && number(to_model, "max_mm") < 0.01);
    assert_true(number(to_truth, "count") > 1000 && number(to_truth, "mean_mm") < 0.001 && number(to_truth, "max_mm") < 0.01);
    assert_true(number(cJSON_GetObjectItem(root, "jump"), "max_mm") < 1e-6);
    cJSON_Delete(root);
    // of another shape it is as far as the shapes are apart
    assert_int_equal(run_in("", "synth y --radius-mm 1.1 --measure swept.h5 --json m.json --quiet"), 0);
    root = json_of("m.json");
    assert_true(fabs(number(root, "bias_mm") + 0.1) < 0.03);
    cJSON_Delete(root);
}

static void fit_measures_what_it_fitted(void **state)
{
    (void)state;
    assert_int_equal(run_in("", "fit swept.h5 --measure --json s.json --quiet"), 0);
    assert_int_equal(run_in("", "fit tree.h5 --model sweep -o new.h5 --measure --json n.json --quiet"), 0);
    assert_int_equal(run_in("", "fit both.h5 --measure --json b.json --quiet"), 0);
    cJSON *old = json_of("s.json"), *fresh = json_of("n.json"), *blobs = json_of("b.json");
    // the model that was just fitted and the one in the file are the same; the new one's fit adds its figures
    static const char *const names[] = {"nodes",      "points",     "error_median_mm", "error_max_mm",
                                        "worst_node", "bare_nodes", "narrow_links",    "least_clearance_ratio"};
    for (int i = 0; i < 8; i++)
        assert_true(number(old, names[i]) == number(fresh, names[i]));
    assert_null(cJSON_GetObjectItem(old, "noise_mm"));
    assert_true(number(fresh, "p99_mm") < 0.01 && number(old, "error_median_mm") < 0.005);
    assert_true(number(old, "narrow_links") == 0 && number(old, "least_clearance_ratio") > 0.9);
    const cJSON *fork = cJSON_GetObjectItem(cJSON_GetObjectItem(old, "jumps_as_met"), "bifurcation");
    assert_true(number(fork, "joins") > 50 && number(fork, "gap_max_mm") < 1e-4);
    assert_null(cJSON_GetObjectItem(old, "blobs"));
    assert_true(number(blobs, "blobs") > 10);            // by default what the file has first
    cJSON_Delete(old);
    cJSON_Delete(fresh);
    cJSON_Delete(blobs);
}

static void info_lists_the_forks(void **state)
{
    (void)state;
    assert_int_equal(run_in("", "info swept.h5 --json > i.json"), 0);
    cJSON *root = json_of("i.json"), *reach = cJSON_GetObjectItem(root, "reach"), *junctions = cJSON_GetObjectItem(reach, "junctions");
    assert_string_equal(cJSON_GetObjectItem(root, "what")->valuestring, "model");
    assert_string_equal(cJSON_GetArrayItem(cJSON_GetObjectItem(root, "models"), 0)->valuestring, "sweep");
    assert_int_equal(cJSON_GetArraySize(junctions), 1);
    assert_false(cJSON_IsTrue(cJSON_GetObjectItem(cJSON_GetArrayItem(junctions, 0), "capped")));
    assert_true(number(reach, "tool_percent") > 99.9);
    cJSON_Delete(root);
    assert_int_equal(run_in("", "info swept.h5 --report page.html --quiet"), 0);
    char *page = text_of(in_folder("page.html"));
    assert_non_null(strstr(page, "swept: 2 branches"));
    assert_null(strstr(page, "no fitted model"));
    free(page);
}

static void an_edit_that_cuts_shows(void **state)
{
    (void)state;
    put("cut.yaml", "edits:\n- {edit: cut, branch: 1, t_mm: 0}\n");
    assert_int_equal(run_in("", "edit swept.h5 --do cut.yaml -o cut.h5 --quiet"), 0);
    assert_int_equal(run_in("", "info cut.h5 --json > c.json"), 0);
    assert_int_equal(run_in("", "fit cut.h5 --measure --json cm.json --quiet"), 0);
    cJSON *info = json_of("c.json"), *measure = json_of("cm.json");
    assert_int_equal(number(cJSON_GetObjectItem(info, "reach"), "junction_count"), 0);
    assert_true(number(measure, "points_left_out") > 100);       // those of the branch
    cJSON_Delete(info);
    cJSON_Delete(measure);
}

// Numbers and flows of the caps at the start of branch 0 and at the ends of both branches, in `export --tags`; 0: no cap.
static void read_caps(const char *arguments, int boundary[3], int flow[3])
{
    char command[300];
    snprintf(command, sizeof command, "export %s --tags --quiet -o tags.ply", arguments);
    assert_int_equal(run_in("", command), 0);
    char *text = text_of(in_folder("tags.ply")), *at = strstr(text, "end_header\n") + 11;
    int vertices = 0, known = 0;
    assert_int_equal(sscanf(strstr(text, "element vertex"), "element vertex %d", &vertices), 1);
    assert_non_null(strstr(text, "property int branch\nproperty float along_mm\nproperty int boundary\nproperty int flow\n"));
    memset(boundary, 0, 3 * sizeof *boundary), memset(flow, 0, 3 * sizeof *flow);
    for (int v = 0; v < vertices; v++) {
        double number[13];
        for (int i = 0; i < 13; i++)
            number[i] = strtod(at, &at);
        int end = number[9] == 1 ? 2 : number[10] == 0 ? 0 : 1, b = (int)number[11], f = (int)number[12];
        assert_true((b == 0) == (f == 0));
        if (b == 0)
            continue;
        assert_true(boundary[end] == 0 || (boundary[end] == b && flow[end] == f));   // an end is one cap
        known += boundary[end] == 0;
        boundary[end] = b, flow[end] = f;
    }
    assert_true(known == 3 || strstr(arguments, "--open-inlet"));
    free(text);
}

static void tags_of_edits_are_exported(void **state)
{
    (void)state;
    static const struct {
        const char *edits;
        int boundary[3], flow[3];        // start of the root's branch, its end, end of the other
    } cases[] = {
        {"[]", {1, 2, 3}, {1, 2, 2}},
        {"\n- {edit: tag, branch: 1, end: end, as: flip}\n", {1, 3, 2}, {1, 2, 1}},
        {"\n- {edit: tag, branch: 0, end: start, as: out}\n- {edit: tag, branch: 0, end: end, as: in}\n", {2, 1, 3}, {2, 1, 2}},
        {"\n- {edit: tag, branch: 0, end: start, as: flip}\n", {2, 3, 4}, {2, 2, 2}},
        {"\n- {edit: tag, branch: 1, end: end, as: flip}\n- {edit: tag, branch: 1, end: end, as: flip}\n", {1, 2, 3}, {1, 2, 2}},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char text[300];
        int boundary[3], flow[3];
        snprintf(text, sizeof text, "edits: %s", cases[i].edits);
        put("tags.yaml", text);
        assert_int_equal(run_in("", "edit swept.h5 --do tags.yaml -o tags.h5 --quiet"), 0);
        read_caps("tags.h5", boundary, flow);
        assert_memory_equal(boundary, cases[i].boundary, sizeof boundary);
        assert_memory_equal(flow, cases[i].flow, sizeof flow);
        // the root's plane is cut open whatever its tag
        read_caps("tags.h5 --open-inlet", boundary, flow);
        assert_int_equal(boundary[1], cases[i].boundary[1]);
        char *ply = text_of(in_folder("tags.ply"));
        int vertices, faces, rim = 0;
        assert_int_equal(sscanf(strstr(ply, "element vertex"), "element vertex %d", &vertices), 1);
        assert_int_equal(sscanf(strstr(ply, "element face"), "element face %d", &faces), 1);
        rim = 2 * (vertices - 1) - faces;    // of a closed surface V - 2 = F/2; open with n edges at the rim: F = 2 V - 2 - n
        assert_int_equal(rim, 24 + 2);       // of the 24 triangles of the cap; its middle is a vertex without a triangle
        free(ply);
    }
}

// Contours that rays from the curve meet three times become rasters: the table shows their figures, not those of the rows under them. Around the middle one the
// stations beside it have the same contour.
static void sections_are_those_of_the_raster(void **state)
{
    (void)state;
    enum { POINTS = 48 };
    char text[4000] = "", edits[16000] = "edits:\n";
    static const double places[] = {1, 1.9, 2.7, 3.2, 3.6};
    // half a ring of radii 0.4 and 1.4 with round ends, about a point of its lumen
    for (int i = 0; i < POINTS; i++) {
        double way = 2.8 * PI * i / POINTS, angle = way / 1.4 - PI / 2, r = 1.4, up = 0;
        if (way >= 2.3 * PI)
            angle = (way - 2.3 * PI) / 0.5 + PI / 2, r = 0.5, up = -0.9;
        else if (way >= 1.9 * PI)
            angle = PI / 2 - (way - 1.9 * PI) / 0.4, r = 0.4;
        else if (way >= 1.4 * PI)
            angle = (way - 1.4 * PI) / 0.5 + PI / 2, r = 0.5, up = 0.9;
        snprintf(text + strlen(text), sizeof text - strlen(text), "%s[%.5f, %.5f]", i > 0 ? ", " : "", r * cos(angle) - 0.65, up + r * sin(angle));
    }
    for (int i = 0; i < 5; i++)
        snprintf(edits + strlen(edits), sizeof edits - strlen(edits), "- {edit: section, branch: 0, t_mm: %g, contour_nb_mm: [%s]}\n", places[i], text);
    put("raster.yaml", edits);
    assert_int_equal(run_in("", "edit swept.h5 --do raster.yaml -o raster.h5 --quiet"), 0);
    assert_int_equal(run_in("", "info raster.h5 --sections sections.csv --quiet"), 0);
    char *table = text_of(in_folder("sections.csv")), kind[20] = "";
    int rasters = 0, polar = 0, found = 0;
    for (char *row = strchr(table, '\n') + 1; *row; row = strchr(row, '\n') + 1) {
        int branch;
        double t, x[6], area, mean, least, largest, around, round, thin, wide;
        assert_int_equal(sscanf(row, "%d,%lf,%lf,%lf,%lf,%lf,%lf,%lf,%lf,%lf,%lf,%lf,%lf,%lf,%lf,%lf,%19[a-z]", &branch, &t, x, x + 1, x + 2, x + 3, x + 4,
                                x + 5, &area, &mean, &least, &largest, &around, &round, &thin, &wide, kind),
                         17);
        rasters += !strcmp(kind, "raster"), polar += !strcmp(kind, "polar");
        if (branch != 0 || fabs(t - places[2]) > 0.1)
            continue;
        found++;
        assert_string_equal(kind, "raster");
        assert_true(fabs(area - 1.15 * PI) < 0.05 && fabs(around - 2.8 * PI) < 0.1);
        assert_true(fabs(round - 4 * PI * area / (around * around)) < 1e-6);
        assert_true(fabs(wide - 2.8) < 0.03 && fabs(thin - 1.9) < 0.03);
        assert_true(fabs(least - 0.25) < 0.03 && fabs(largest - 1.61) < 0.03);
    }
    assert_int_equal(found, 1);
    assert_true(rasters >= 5 && polar > 20);
    free(table);
}

#ifdef SELDINGER_RENDER
static void pictures_are_drawn(void **state)
{
    (void)state;
    static const char *const made[] = {"j.png", "f.png", "e.png", "fj.png", "two.png"};
    assert_int_equal(run_in("", "info swept.h5 --junctions j.png --picture e.png --quiet"), 0);
    assert_int_equal(run_in("", "fit tree.h5 --model sweep -o new.h5 --picture f.png --junctions fj.png --quiet"), 0);
    assert_int_equal(run_in("", "info both.h5 --model sweep --junctions two.png --before blobs.h5 --quiet"), 0);
    for (int i = 0; i < 5; i++) {
        char *bytes = text_of(in_folder(made[i]));
        assert_memory_equal(bytes, "\x89PNG", 4);
        free(bytes);
    }
}
#endif

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(query_gives_the_distance),
        cmocka_unit_test(a_model_that_is_not_there_is_named),
        cmocka_unit_test(synth_measures_the_distance_from_the_truth),
        cmocka_unit_test(fit_measures_what_it_fitted),
        cmocka_unit_test(info_lists_the_forks),
        cmocka_unit_test(an_edit_that_cuts_shows),
        cmocka_unit_test(tags_of_edits_are_exported),
        cmocka_unit_test(sections_are_those_of_the_raster),
#ifdef SELDINGER_RENDER
        cmocka_unit_test(pictures_are_drawn),
#endif
    };
    return cmocka_run_group_tests_name("swept_commands", tests, make_models, remove_folder);
}
