// `run` with several tools: an exact reference from a scene file, what the summary and the final state say of each tool, and what is refused so far.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <cJSON.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

static char folder[] = "/tmp/seldinger-tools-XXXXXX";
#include "tests/cli/folder.h"

static int make_folder(void **state)
{
    (void)state;
    return mkdtemp(folder) ? 0 : -1;
}

static int run(const char *arguments)
{
    char command[1200];
    snprintf(command, sizeof command, "cd '%s' && %s %s > '%s' 2>&1", SOURCE_DIR, SELDINGER_PROGRAM, arguments, in_folder("output.txt"));
    int status = system(command);
    assert_true(WIFEXITED(status));
    return WEXITSTATUS(status);
}

static cJSON *summary(const char *scene, const char *more)
{
    char arguments[800];
    snprintf(arguments, sizeof arguments, "run scenes/coaxial/%s --summary '%s' --final '%s' %s", scene, in_folder("summary.json"), in_folder("final.csv"), more);
    assert_int_equal(run(arguments), 0);
    char *text = text_of(in_folder("summary.json"));
    cJSON *root = cJSON_Parse(text);
    assert_non_null(root);
    free(text);
    return root;
}

static double value(const cJSON *tool, const char *part, const char *name)
{
    const cJSON *object = part ? cJSON_GetObjectItem(tool, part) : tool;
    return cJSON_GetObjectItem(object, name)->valuedouble;
}

// Reference 1 of the coaxial tools: 0.03 N, tip (23.953622, 39.793075) mm; the tools' own stretch is 1.6e-3 mm.
static void a_reference_from_a_scene(void **state)
{
    (void)state;
    cJSON *root = summary("insert.yaml", ""), *tools = cJSON_GetObjectItem(root, "tools");
    assert_int_equal(cJSON_GetArraySize(tools), 2);
    const cJSON *tube = cJSON_GetArrayItem(tools, 0), *wire = cJSON_GetArrayItem(tools, 1), *tip = cJSON_GetObjectItem(tube, "tip_mm");
    double push = value(wire, "proximal", "force_n");
    double off = hypot(cJSON_GetArrayItem(tip, 0)->valuedouble - 23.953622, cJSON_GetArrayItem(tip, 1)->valuedouble - 39.793075);
    print_message("push %.7f N, tip %.2e mm off\n", push, off);
    assert_string_equal(cJSON_GetObjectItem(wire, "name")->valuestring, "wire");
    assert_true(fabs(push - 0.03) < 1e-5 && off < 2e-3);
    assert_true(fabs(value(wire, NULL, "inserted_mm") - 30) < 1e-9);
    cJSON_Delete(root);
    // one row a node of every tool, and a head
    char *text = text_of(in_folder("final.csv"));
    int lines = 0;
    for (const char *c = text; *c; c++)
        lines += *c == '\n';
    assert_int_equal(lines, 1 + 31 + 61);
    assert_true(!strncmp(text, "tool,node,s_mm,x_mm", 19));
    assert_non_null(strstr(text, "\nwire,60,"));
    free(text);
}

static void two_tools_in_a_model_repeat(void **state)
{
    (void)state;
    char *hash[2];
    for (int i = 0; i < 2; i++) {
        cJSON *root = summary("phantom.yaml", i ? "--duration-s 1.8 --threads 2" : "--duration-s 1.8");
        hash[i] = strdup(cJSON_GetObjectItem(root, "state_hash")->valuestring);
        assert_true(value(root, "penetration_mm", "max") < 0.05);
        cJSON_Delete(root);
    }
    assert_string_equal(hash[0], hash[1]);
    free(hash[0]);
    free(hash[1]);
}

static void what_takes_one_tool_says_so(void **state)
{
    (void)state;
    static const char *const command[] = {"run scenes/coaxial/insert.yaml --record /tmp/never.h5", "run scenes/coaxial/insert.yaml --picture /tmp/never.png",
                                          "run scenes/coaxial/insert.yaml --score -", "nav scenes/coaxial/insert.yaml"};
    for (int i = 0; i < 4; i++) {
        int code = run(command[i]);
        char *text = text_of(in_folder("output.txt"));
        if (!strstr(text, "has 2 tools"))
            print_message("%s: %s", command[i], text);
        // a build without a window knows no nav
        if (i < 3 || strstr(text, "tools"))
            assert_true(code == 2 && strstr(text, "has 2 tools; "));
        free(text);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_reference_from_a_scene), cmocka_unit_test(two_tools_in_a_model_repeat), cmocka_unit_test(what_takes_one_tool_says_so),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
