// Helpers of the simulator: quantiles of the histogram, SHA-256, golden tool paths.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "base/sha256.h"
#include "sim/compare.h"
#include "sim/time_histogram.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// cmocka's own function compares in single precision
#define assert_near(a, b, tolerance) assert_true(fabs((a) - (b)) <= (tolerance))

static int by_value(const void *a, const void *b)
{
    int64_t x = *(const int64_t *)a, y = *(const int64_t *)b;
    return (x > y) - (x < y);
}

static void quantiles_are_exact_to_one_per_cent(void **state)
{
    (void)state;
    static TimeHistogram histogram;
    enum { COUNT = 20001 };
    static int64_t value[COUNT];
    uint64_t seed = 1;
    assert_near(histogram_quantile(&histogram, 0.5), 0, 0);
    for (int i = 0; i < COUNT; i++) {
        seed = seed * UINT64_C(6364136223846793005) + 1442695040888963407u;
        // from 1 ns to 17 s, evenly in the exponent
        value[i] = (int64_t)exp2((double)(seed >> 40) / (double)(1 << 24) * 34);
        histogram_add(&histogram, value[i]);
    }
    qsort(value, COUNT, sizeof *value, by_value);
    const double fraction[] = {0.001, 0.01, 0.1, 0.5, 0.9, 0.99, 0.999, 1};
    for (size_t i = 0; i < sizeof fraction / sizeof *fraction; i++) {
        double exact = (double)value[(int)ceil(fraction[i] * COUNT) - 1];
        assert_true(fabs(histogram_quantile(&histogram, fraction[i]) - exact) <= 0.005 * exact);
    }
}

static void small_counts_and_the_largest_are_exact(void **state)
{
    (void)state;
    static TimeHistogram histogram;
    for (int i = 0; i <= 255; i++)
        histogram_add(&histogram, i);
    for (int i = 0; i <= 255; i++)
        assert_near(histogram_quantile(&histogram, (i + 1) / 256.0), i, 0);
    histogram_add(&histogram, INT64_MAX);
    assert_true(histogram.largest == INT64_MAX);
    // bins are monotone and without gaps
    for (int64_t v = 1; v < 100000; v++)
        assert_true(histogram_bin(v) - histogram_bin(v - 1) <= 1 && histogram_bin(v) >= histogram_bin(v - 1));
}

static void sha256_gives_the_standards_vectors(void **state)
{
    (void)state;
    // FIPS 180-4 examples and the empty message
    const char *text[] = {"", "abc", "abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"};
    const char *want[] = {"e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855",
                          "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad",
                          "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1"};
    char hex[65];
    Sha256 sha;
    for (int i = 0; i < 3; i++) {
        sha256_begin(&sha);
        sha256_add(&sha, text[i], strlen(text[i]));
        sha256_end(&sha, hex);
        assert_string_equal(hex, want[i]);
    }
    sha256_begin(&sha);
    for (int i = 0; i < 1000000; i++)
        sha256_add(&sha, "a", 1);
    sha256_end(&sha, hex);
    assert_string_equal(hex, "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

// --- golden paths ---

// `shift` moves node 2 of the last tool at the third moment.
static ToolPath *path_of_tools(int tools, int node_count, int moments, double shift)
{
    ToolPath *path = calloc(1, sizeof *path);
    assert_non_null(path);
    path->tool_count = tools;
    path->duration_s = 0.05 * moments;
    path->row = calloc((size_t)(tools * node_count * moments), sizeof *path->row);
    assert_non_null(path->row);
    for (int k = 0; k < tools; k++)
        path->node_count[k] = node_count;
    for (int t = 1; t <= moments; t++)
        for (int k = 0; k < tools; k++)
            for (int i = 0; i < node_count; i++)
                path->row[path->row_count++] = (PathRow){0.05 * t, k, i, vec3(i + (t == 3 && k == tools - 1 && i == 2 ? shift : 0), sin(t) + k, -i / 3.0)};
    return path;
}

static ToolPath *path_of(int node_count, int moments, double shift) { return path_of_tools(1, node_count, moments, shift); }

static void print_and_parse(int tools)
{
    static Faults faults;
    ToolPath *path = path_of_tools(tools, 4, 5, 0);
    size_t length;
    char *text = tool_path_print(path, &length);
    assert_non_null(text);
    faults_clear(&faults);
    ToolPath *again = tool_path_parse(text, length, "g.csv", &faults);
    assert_non_null(again);
    assert_int_equal(again->row_count, path->row_count);
    PathDifference difference = tool_path_compare(again, path, 1e-5);
    assert_false(difference.differs);
    assert_true(difference.worst_mm < 1e-5);
    // printing twice gives the same text
    size_t second_length;
    char *second = tool_path_print(again, &second_length);
    assert_non_null(second);
    assert_string_equal(text, second);
    free(second);
    free(text);
    tool_path_free(again);
    tool_path_free(path);
}

static void printing_and_parsing_keeps_a_path(void **state)
{
    (void)state;
    for (int tools = 1; tools <= 3; tools += 2)
        print_and_parse(tools);
}

// A file that an editor has saved with the line ends of another system, and with spaces behind its figures.
static void line_ends_and_spaces_do_not_matter(void **state)
{
    (void)state;
    static Faults faults;
    static const char text[] = "# nodes: 5 \r\n# duration_s:  1.5\r\nt_s,node,x_mm,y_mm,z_mm\r\n0.05,4,1,2,3\r\n";
    ToolPath *path = tool_path_parse(text, sizeof text - 1, "g.csv", &faults);
    assert_non_null(path);
    assert_true(path->tool_count == 1 && path->node_count[0] == 5 && path->duration_s == 1.5);
    assert_true(path->row_count == 1 && path->row[0].node == 4 && path->row[0].position.z == 3);
    tool_path_free(path);
}

static void a_comparison_names_first_time_node_and_distance(void **state)
{
    (void)state;
    ToolPath *golden = path_of(4, 5, 0), *run = path_of(4, 5, 0.25);
    PathDifference difference = tool_path_compare(golden, run, 0.1);
    assert_true(difference.differs);
    assert_near(difference.worst_mm, 0.25, 1e-12);
    assert_near(difference.first_t_s, 0.15, 1e-12);
    assert_int_equal(difference.first_node, 2);
    assert_false(tool_path_compare(golden, run, 0.3).differs);
    // a shorter run and another number of nodes are differences
    run->row_count -= 4;
    difference = tool_path_compare(golden, run, 1);
    assert_true(difference.differs);
    assert_non_null(strstr(difference.remark, "4 of 20"));
    ToolPath *finer = path_of(5, 5, 0);
    assert_true(tool_path_compare(golden, finer, 1).differs);
    // NaN is never within a tolerance
    run->row_count += 4;
    run->row[0].position.x = NAN;
    assert_true(tool_path_compare(golden, run, 1).differs);
    tool_path_free(finer);
    tool_path_free(run);
    tool_path_free(golden);
}

// A place is compared only with that of the same node of the same tool, even if another is nearer.
static void another_node_in_its_place_is_no_counterpart(void **state)
{
    (void)state;
    ToolPath *golden = path_of_tools(2, 4, 5, 0), *run = path_of_tools(2, 4, 5, 0);
    run->row[39].node = 4;
    assert_string_equal(tool_path_compare(golden, run, 1).remark, "1 of 40 golden rows have no counterpart, the first at 0.25 s");
    run->row[39].node = 3;
    assert_false(tool_path_compare(golden, run, 0).differs);
    for (int i = 36; i < 40; i++)
        run->row[i].tool = 2;
    assert_string_equal(tool_path_compare(golden, run, 1).remark, "4 of 40 golden rows have no counterpart, the first at 0.25 s");
    tool_path_free(run);
    tool_path_free(golden);
}

static void a_comparison_of_several_tools_names_the_tool(void **state)
{
    (void)state;
    ToolPath *golden = path_of_tools(2, 4, 5, 0), *run = path_of_tools(2, 4, 5, 0.25), *single = path_of(4, 5, 0);
    PathDifference difference = tool_path_compare(golden, run, 0.1);
    assert_true(difference.differs && difference.first_tool == 1 && difference.first_node == 2);
    assert_near(difference.first_t_s, 0.15, 1e-12);
    difference = tool_path_compare(golden, single, 1);
    assert_true(difference.differs);
    assert_string_equal(difference.remark, "1 tools, the golden has 2; 20 of 40 golden rows have no counterpart, the first at 0.05 s");
    run->node_count[1] = 5;
    assert_non_null(strstr(tool_path_compare(golden, run, 1).remark, "5 nodes, the golden has 4"));
    tool_path_free(single);
    tool_path_free(run);
    tool_path_free(golden);
}

static void a_broken_golden_is_a_fault(void **state)
{
    (void)state;
    static Faults faults;
    const char *text[] = {"",
                          "t_s,node,x_mm,y_mm,z_mm\n0,0,0,0,0\n",
                          "# nodes: 5\n# duration_s: 1\nt_s,node,x_mm,y_mm,z_mm\n",
                          "# nodes: 5\n# duration_s: 1\nt_s,node,x_mm,y_mm,z_mm\n0,1.5,0,0,0\n",
                          "# nodes: 5\n# duration_s: 1\nt_s,node,x,y,z\n0,1,0,0,0\n",
                          "# tools: 5\n# nodes: 5\n# duration_s: 1\nt_s,node,x_mm,y_mm,z_mm\n0,1,0,0,0\n",
                          "# tools: 2\n# nodes of tool 0: 5\n# duration_s: 1\nt_s,tool,node,x_mm,y_mm,z_mm\n0,0,1,0,0,0\n",
                          "# tools: 2\n# nodes of tool 0: 5\n# nodes of tool 1: 5\n# duration_s: 1\nt_s,node,x_mm,y_mm,z_mm\n0,1,0,0,0\n",
                          "# tools: 2\n# nodes of tool 0: 5\n# nodes of tool 1: 5\n# duration_s: 1\nt_s,tool,node,x_mm,y_mm,z_mm\n0,2,1,0,0,0\n",
                          "# nodes: 5\n# duration_s: 1\nt_s,node,x_mm,y_mm,z_mm\n0.1,1,0,0,0\n0.05,1,0,0,0\n",
                          "# nodes: 5\n# duration_s: 1\nt_s,node,x_mm,y_mm,z_mm\n0.1,1,0,0,0\n0.1,1,0,0,0\n",
                          "# nodes: 5\n# duration_s: 1\nt_s,node,x_mm,y_mm,z_mm\n0.1,1,0,1e90,0\n"};
    for (size_t i = 0; i < sizeof text / sizeof *text; i++) {
        faults_clear(&faults);
        assert_null(tool_path_parse(text[i], strlen(text[i]), "g.csv", &faults));
        assert_true(faults.count > 0);
    }
    char *path = golden_path_of("a/b.yaml/scene.yaml");
    assert_string_equal(path, "a/b.yaml/scene.golden.csv");
    free(path);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(quantiles_are_exact_to_one_per_cent),
        cmocka_unit_test(small_counts_and_the_largest_are_exact),
        cmocka_unit_test(sha256_gives_the_standards_vectors),
        cmocka_unit_test(printing_and_parsing_keeps_a_path),
        cmocka_unit_test(line_ends_and_spaces_do_not_matter),
        cmocka_unit_test(a_comparison_names_first_time_node_and_distance),
        cmocka_unit_test(another_node_in_its_place_is_no_counterpart),
        cmocka_unit_test(a_comparison_of_several_tools_names_the_tool),
        cmocka_unit_test(a_broken_golden_is_a_fault),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
