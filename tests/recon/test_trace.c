// Trace files: their contents are read, and every fault is reported with its line and column in one pass.
#include "recon/track/trace.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <stdio.h>
#include <string.h>

static Faults faults;

static Trace *parse(const char *text)
{
    faults_clear(&faults);
    return trace_parse(text, strlen(text), "t.yaml", &faults);
}

static void full_file(void **state)
{
    (void)state;
    Trace *t = parse("branches:\n"
                     "  - {name: a, start_mm: [1, 2, 3], toward_voxel: [2, 2, 3.5], radius_mm: 1.5}\n"
                     "  - {start_voxel: [4, 5, 6]}\n"
                     "aneurysms: [{name: sac, centers_mm: [[1, 2, 3], [3, 4, 5]]}, {centers_voxel: [[7, 8, 9]]}]\n"
                     "p_inl: 0.6\nretry_steps: [1.5, 2]\nseed: 7\nN_r: 642\nparameters: paper\n");
    assert_non_null(t);
    assert_int_equal(t->branch_count, 2);
    assert_true(t->branch[0].start.z == 3 && !t->branch[0].start_is_voxel && t->branch[0].toward_is_voxel && t->branch[0].toward.z == 3.5);
    assert_true(t->branch[0].radius == 1.5 && t->branch[0].has_toward && !strcmp(t->branch[0].name, "a"));
    assert_true(t->branch[1].start_is_voxel && !t->branch[1].has_toward && t->branch[1].line == 3 && t->branch[1].column == 5);
    assert_int_equal(t->aneurysm_count, 2);
    assert_true(t->aneurysm[0].center_count == 2 && t->aneurysm[0].center[1].x == 3 && !t->aneurysm[0].is_voxel && t->aneurysm[1].is_voxel);
    // the parameter set first, then single parameters, in any order in the file
    RbtParameters p = rbt_paper_parameters();
    assert_true(t->parameters.p_inl == 0.6 && t->parameters.seed == 7 && t->parameters.n_r == 642 && t->parameters.n_p == p.n_p &&
                t->parameters.look_ahead == 0);
    assert_true(t->parameters.retry_count == 2 && t->parameters.retry_steps[1] == 2);
    trace_free(t);
}

static void a_start_is_enough(void **state)
{
    (void)state;
    Trace *t = parse("branches: [{start_voxel: [1, 2, 3]}]\n");
    assert_non_null(t);
    assert_true(t->branch[0].start_is_voxel && !t->branch[0].has_toward && t->branch[0].radius == 0 && t->parameters.automatic == 1);
    trace_free(t);
}

// A single start selects automatic tracking of the whole tree; a second start, or the key, switches it off.
static void automatic_and_corrections(void **state)
{
    (void)state;
    static const char one[] = "branches: [{start_mm: [1, 2, 3], toward_mm: [2, 2, 3], radius_mm: 1}]\n";
    static const char two[] = "branches: [{start_mm: [1, 2, 3], toward_mm: [2, 2, 3], radius_mm: 1}, {start_mm: [4, 2, 3]}]\n";
    char text[400];
    Trace *t = parse(one);
    assert_true(t && t->parameters.automatic == 1);
    trace_free(t);
    t = parse(two);
    assert_true(t && t->parameters.automatic == 0);
    trace_free(t);
    snprintf(text, sizeof text, "automatic: 0\n%s", one);
    t = parse(text);
    assert_true(t && t->parameters.automatic == 0);
    trace_free(t);
    snprintf(text, sizeof text,
             "%sautomatic: 1\nforbid: [{center_voxel: [1, 2, 3], radius_mm: 4}, {center_mm: [5, 6, 7], radius_mm: 8}]\ncut: [{point_mm: [9, 10, 11]}]\n", two);
    t = parse(text);
    assert_true(t && t->parameters.automatic == 1 && t->parameters.forbid_count == 2 && t->parameters.cut_count == 1);
    const RbtRegion *forbid = t->parameters.forbid, *cut = t->parameters.cut;
    assert_true(forbid[0].is_voxel && forbid[0].center.z == 3 && forbid[0].radius == 4 && !forbid[1].is_voxel && forbid[1].radius == 8);
    assert_true(cut[0].center.x == 9 && !cut[0].is_voxel && cut[0].line == 4 && cut[0].column == 7);
    trace_free(t);
}

// Points that the tree does not pass, and points in excluded vessels; the command line adds to both.
static void where_the_tree_ends(void **state)
{
    (void)state;
    Trace *t = parse("branches: [{start_mm: [1, 2, 3]}]\nuntil: [{point_mm: [4, 5, 6]}, {point_voxel: [7, 8, 9]}]\nnot: [{point_voxel: [10, 11, 12]}]\n");
    assert_true(t && t->parameters.until_count == 2 && t->parameters.rival_count == 1);
    assert_true(!t->parameters.until[0].is_voxel && t->parameters.until[1].is_voxel && t->parameters.until[1].center.z == 9 &&
                t->parameters.until[1].line == 2);
    assert_true(t->parameters.rival[0].is_voxel && t->parameters.rival[0].center.x == 10 && t->parameters.rival[0].line == 3);
    assert_true(trace_add_point(t, "until", vec3(1, 1, 1)) && trace_add_point(t, "not", vec3(2, 2, 2)) && trace_add_point(t, "not", vec3(3, 3, 3)));
    assert_true(t->parameters.until_count == 3 && t->parameters.until[2].center.x == 1 && t->parameters.until[0].center.x == 4);
    assert_true(t->parameters.rival_count == 3 && t->parameters.rival[2].center.x == 3 && t->parameters.rival[2].line == 0);
    trace_free(t);
    t = parse("branches: [{start_mm: [1, 2, 3]}]\n");
    assert_true(t && t->parameters.until_count == 0 && trace_add_point(t, "until", vec3(1, 1, 1)) && t->parameters.until_count == 1);
    trace_free(t);
}

static void every_parameter_by_name(void **state)
{
    (void)state;
    for (int i = 0; i < rbt_parameter_count; i++) {
        const RbtParameterName *p = &rbt_parameter_table[i];
        double value = !strcmp(p->name, "N_r") || !strcmp(p->name, "aneurysm_rays") ? 642
                       : !strcmp(p->name, "N_d")                                    ? 21
                       : !strcmp(p->name, "N_min")                                  ? 100
                                                                                    : p->most;
        char text[400];
        snprintf(text, sizeof text, "branches: [{start_mm: [1, 2, 3], toward_mm: [2, 2, 3], radius_mm: 1}]\n%s: %.17g\n", p->name, value);
        Trace *t = parse(text);
        assert_non_null(t);
        assert_true(*(double *)(void *)((char *)&t->parameters + p->offset) == value);
        trace_free(t);
        snprintf(text, sizeof text, "branches: [{start_mm: [1, 2, 3], toward_mm: [2, 2, 3], radius_mm: 1}]\n%s: %.17g\n", p->name, p->most * 1.01 + 1);
        assert_null(parse(text));
        assert_non_null(strstr(faults.text[0], "t.yaml:2:"));
    }
    // the defaults lie within their own ranges
    RbtParameters d = rbt_default_parameters(), p = rbt_paper_parameters();
    for (int i = 0; i < rbt_parameter_count; i++) {
        double a = *(double *)(void *)((char *)&d + rbt_parameter_table[i].offset), b = *(double *)(void *)((char *)&p + rbt_parameter_table[i].offset);
        assert_true(a >= rbt_parameter_table[i].least && a <= rbt_parameter_table[i].most && b >= rbt_parameter_table[i].least &&
                    b <= rbt_parameter_table[i].most);
    }
}

#define GOOD "branches: [{start_mm: [1, 2, 3], toward_mm: [2, 2, 3], radius_mm: 1}]\n"

static void faults_with_their_place(void **state)
{
    (void)state;
    static const struct {
        const char *text, *place, *words;
    } cases[] = {
        {"", "t.yaml:1:1", "empty"},
        {"- a\n", "t.yaml:1:1", "the trace is not a map"},
        {"branches: [\n", "t.yaml:2", "is not YAML"},
        {"p_inl: 0.5\n", "t.yaml:1:1", "there is no branch"},
        {"branches: []\n", "t.yaml:1:1", "there is no branch"},
        {"branches: [3]\n", "t.yaml:1:12", "a branch is not valid"},
        {"branches: [{toward_mm: [1, 2, 3], radius_mm: 1}]\n", "t.yaml:1:12", "no start"},
        {"branches: [{start_mm: [1, 2], toward_mm: [2, 2, 3], radius_mm: 1}]\n", "t.yaml:1:23", "three numbers"},
        {"branches: [{start_mm: [1, 2, x], toward_mm: [2, 2, 3], radius_mm: 1}]\n", "t.yaml:1:30", "'x' is not valid"},
        {"branches: [{start_mm: [1, 2, .nan], toward_mm: [2, 2, 3], radius_mm: 1}]\n", "t.yaml:1:30", "is not valid"},
        {"branches: [{start_mm: [1, 2, 3], toward_mm: [2, 2, 3], radius_mm: 0}]\n", "t.yaml:1:67", "radius_mm '0' is not valid"},
        {"branches: [{start_mm: [1, 2, 3], start_voxel: [1, 2, 3], toward_mm: [2, 2, 3], radius_mm: 1}]\n", "t.yaml:1:47", "given twice"},
        {"branches: [{start_mm: [1, 2, 3], toward_mm: [2, 2, 3], radius_mm: 1, radius_mm: 2}]\n", "t.yaml:1:70", "the first is on line 1"},
        {GOOD "forbid: 3\n", "t.yaml:2:9", "forbid is not valid"},
        {GOOD "forbid: [{center_mm: [1, 2, 3]}]\n", "t.yaml:2:10", "has no radius"},
        {GOOD "forbid: [{radius_mm: 3}]\n", "t.yaml:2:10", "has no position"},
        {GOOD "forbid: [{center_mm: [1, 2, 3], center_voxel: [1, 2, 3], radius_mm: 3}]\n", "t.yaml:2:47", "given twice"},
        {GOOD "forbid: [{center_mm: [1, 2, 3], radius_mm: 0}]\n", "t.yaml:2:44", "radius_mm '0' is not valid"},
        {GOOD "forbid: [7]\n", "t.yaml:2:10", "a forbidden region is not valid"},
        {GOOD "cut: [{point_mm: [1, 2]}]\n", "t.yaml:2:18", "three numbers"},
        {GOOD "cut: [{point_mm: [1, 2, 3], radius_mm: 1}]\n", "t.yaml:2:40", "in a cut"},
        {GOOD "cut: [{}]\n", "t.yaml:2:7", "has no position"},
        {GOOD "cut: [x]\n", "t.yaml:2:7", "a cut is not valid"},
        {GOOD "until: {point_mm: [1, 2, 3]}\n", "t.yaml:2:8", "until is not valid"},
        {GOOD "until: [{point_mm: [1, 2]}]\n", "t.yaml:2:20", "three numbers"},
        {GOOD "until: [{radius_mm: 1}]\n", "t.yaml:2:21", "in a point of `until`"},
        {GOOD "not: [{start_mm: [1, 2, 3]}]\n", "t.yaml:2:18", "in a point of `not`"},
        {GOOD "not: [{}]\n", "t.yaml:2:7", "has no position"},
        {GOOD "not: [{point_mm: [1, 2, 3], point_voxel: [1, 2, 3]}]\n", "t.yaml:2:42", "given twice"},
        {GOOD "not: [[1, 2, 3]]\n", "t.yaml:2:7", "a point of `not` is not valid"},
        {GOOD "automatic: 2\n", "t.yaml:2:12", "automatic '2' is not valid"},
        {"branches: [{start_mm: [1, 2, 3], toward_mm: [2, 2, 3], radius: 1}]\n", "t.yaml:1:64", "unknown key 'radius' in a branch"},
        {GOOD "colour: red\n", "t.yaml:2:9", "unknown key 'colour' in a trace"},
        {GOOD "seed: 1\nseed: 2\n", "t.yaml:3:1", "the first is on line 2"},
        {GOOD "N_r: 100\n", "t.yaml:2:6", "42, 162, 642 or 2562"},
        {GOOD "N_d: 100\n", "t.yaml:2:6", "21, 81 or 321"},
        {GOOD "N_p: 64.5\n", "t.yaml:2:6", "whole number"},
        {GOOD "N_max: 10\n", "t.yaml:1:1", "less than N_min"},
        {GOOD "parameters: best\n", "t.yaml:2:13", "default or paper"},
        {GOOD "aneurysms: [{}]\n", "t.yaml:2:13", "no centres"},
        {GOOD "aneurysms: [{centers_mm: []}]\n", "t.yaml:2:26", "a list of points"},
        {GOOD "retry_steps: [1, 2, 3, 4, 5, 6, 7, 8, 9]\n", "t.yaml:2:14", "at most 8"},
        {GOOD "---\n" GOOD, "t.yaml:3:1", "a second document"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        Trace *t = parse(cases[i].text);
        if (t || !strstr(faults.text[0], cases[i].words) || !strstr(faults.text[0], cases[i].place))
            print_message("case %zu: got '%s'\n", i, t ? "a trace" : faults.text[0]);
        assert_null(t);
        assert_non_null(strstr(faults.text[0], cases[i].words));
        assert_non_null(strstr(faults.text[0], cases[i].place));
    }
    // all in one pass
    assert_null(parse("branches: [{start_mm: [1, 2], toward_mm: 3, radius_mm: -1}]\nseed: x\nwhat: 1\n"));
    assert_int_equal(faults.count, 5);
    // an anchor that contains itself
    assert_null(parse("branches: &a [*a]\n"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(full_file),           cmocka_unit_test(a_start_is_enough),       cmocka_unit_test(automatic_and_corrections),
        cmocka_unit_test(where_the_tree_ends), cmocka_unit_test(every_parameter_by_name), cmocka_unit_test(faults_with_their_place)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
