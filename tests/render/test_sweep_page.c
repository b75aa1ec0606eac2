// The report of a sweep from a table of known shape: well-formed, nothing from a network, indices as computed, the worst runs first with their commands.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "render/sweep_page.h"

#include <expat.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static Faults faults;

// 600 runs: the distance depends on the modulus alone, the force on both keys; run 7 diverged, 8 left, and the device is a name with markup.
static SweepResults *results(const char *path)
{
    char *text = NULL;
    size_t length;
    FILE *out = open_memstream(&text, &length);
    uint64_t state = 3;
    fprintf(out, "run,wire.sections[0].young_modulus_gpa,vessel.friction,device,hand_seed,status,message,state_hash,steps,targets[0].distance_mm,proximal."
                 "force_most_n\n");
    for (int i = 0; i < 600; i++) {
        state = state * 6364136223846793005U + 1442695040888963407U;
        double a = (double)(state >> 40) / (1 << 24);
        state = state * 6364136223846793005U + 1442695040888963407U;
        double b = (double)(state >> 40) / (1 << 24);
        const char *status = i == 7 ? "diverged" : i == 8 ? "left" : "done";
        fprintf(out, "%d,%.9g,%.9g,%s,%d,%s,%s,c4,500,%.9g,%.9g\n", i, 5 + 195 * a, 0.15 * b, i % 2 ? "\"a <b> & \"\"c\"\"\"" : "d", i, status,
                i == 7   ? "diverged at 2 s"
                : i == 8 ? "\"left, far\""
                         : "",
                3 * a, a + b);
    }
    fclose(out);
    SweepResults *read = sweep_results_parse(text, length, path, &faults);
    free(text);
    assert_non_null(read);
    return read;
}

static char *page_of(const SweepResults *table)
{
    char *text = NULL;
    size_t length;
    FILE *out = open_memstream(&text, &length);
    sweep_page(out, &(SweepPage){"results", table, "scene: a.yaml\nvary: {k: [1, 2]} # <&>\n", "my/spec.yaml"});
    fclose(out);
    return text;
}

static void the_page_is_whole(void **unused)
{
    (void)unused;
    SweepResults *table = results("results/table.csv");
    char *page = page_of(table), *again = page_of(table);
    const char *name = getenv("SWEEP_PAGE");
    FILE *keep = name ? fopen(name, "w") : NULL;     // to look at it
    if (keep) {
        fputs(page, keep);
        fclose(keep);
    }
    assert_string_equal(page, again);
    XML_Parser parser = XML_ParserCreate("UTF-8");
    if (XML_Parse(parser, page, (int)strlen(page), 1) == XML_STATUS_ERROR)
        fail_msg("line %lu: %s", XML_GetCurrentLineNumber(parser), XML_ErrorString(XML_GetErrorCode(parser)));
    XML_ParserFree(parser);
    assert_null(strstr(page, "http:"));
    assert_null(strstr(page, "https:"));
    assert_null(strstr(page, "url("));
    assert_null(strstr(page, "<b>"));
    assert_null(strstr(page, "nan"));
    assert_null(strstr(page, "inf\""));
    assert_non_null(strstr(page, "600: 598 done, 1 diverged, 1 left, 0 failed"));
    free(page);
    free(again);
    sweep_results_free(table);
}

static void indices_and_worst_runs(void **unused)
{
    (void)unused;
    SweepResults *table = results("results/table.csv");
    char *page = page_of(table), *row = strstr(page, "<th scope=\"row\">targets[0].distance_mm</th>"), *bar;
    assert_non_null(row);
    bar = strstr(row, "</svg> ");
    double index, low, high;
    assert_int_equal(sscanf(bar, "</svg> %lf (%lf to %lf)", &index, &low, &high), 3);
    assert_true(index > 0.98 && high >= index && low <= index);
    // friction and device explain nothing of it
    bar = strstr(bar + 1, "</svg> ");
    assert_int_equal(sscanf(bar, "</svg> %lf", &index), 1);
    assert_true(index < 0.15 && index > -0.15);
    row = strstr(page, "<th scope=\"row\">proximal.force_most_n</th>");
    assert_int_equal(sscanf(strstr(row, "</svg> "), "</svg> %lf (%lf to %lf)", &index, &low, &high), 3);
    assert_true(low < 0.5 && 0.5 < high && index > 0.4 && index < 0.6);
    // left before diverged, as the section says, then by distance
    char *left = strstr(page, "Run 8: left"), *diverged = strstr(page, "Run 7: diverged");
    assert_true(left && diverged && left < diverged);
    assert_non_null(strstr(page, "seldinger sweep my/spec.yaml --run 8 -o run-8"));
    int articles = 0;
    for (char *at = page; (at = strstr(at, "<article")); at++)
        articles++;
    assert_int_equal(articles, 10);
    assert_non_null(strstr(page, "<p>598 runs are done: on a grid or on Sobol's points an index can be too low by up to 0.04"));
    free(page);
    sweep_results_free(table);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(the_page_is_whole), cmocka_unit_test(indices_and_worst_runs)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
