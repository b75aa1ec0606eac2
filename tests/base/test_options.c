// A table of options: each type, each syntax, each fault, and the printed texts.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "base/options.h"
#include "base/options_help.h"
#include "base/options_manual.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

typedef struct Values {
    const char *scene;
    bool quiet, draws, has_voxel;
    double voxel_mm, seed, point[3], at_s[2];
    int at_count, threads, kind, width;
    const char *output, *curve[3];
    int curve_count;
} Values;

static const char *const kinds[] = {"lim", "mesh", "grid", NULL};

static const char *take_width(void *structure, const Option *option, const char *text)
{
    (void)option;
    ((Values *)structure)->width = atoi(text);
    return atoi(text) > 0 ? NULL : "WIDTH above 0";
}

static const Option options[] = {
    {"output", "F.h5", OPTION_FILE, OPTION_AT(Values, output), "what is written", .letter = 'o'},
    {"quiet", NULL, OPTION_FLAG, OPTION_AT(Values, quiet), "no summary", .letter = 'q'},
    {"no-drawing", NULL, OPTION_CLEARED, OPTION_AT(Values, draws), "no picture"},
    {"voxel-mm", "X", OPTION_NUMBER, OPTION_AT(Values, voxel_mm), "edge of a voxel", .least = 0.01, .most = 10, .unit = "mm",
     .given = offsetof(Values, has_voxel)},
    {"seed", "N", OPTION_WHOLE, OPTION_AT(Values, seed), "of the noise", .most = 9007199254740991.0, .otherwise = "the trace's"},
    {"threads", "N", OPTION_INT, OPTION_AT(Values, threads), "threads; 0: all cores", .most = 256, .group = "machine"},
    {"start", "X,Y,Z", OPTION_POINT, OPTION_AT(Values, point), "one point in a vessel", .unit = "mm"},
    {"kind", "KIND", OPTION_CHOICE, OPTION_AT(Values, kind), "of contact", .choices = kinds},
    {"at", "S", OPTION_NUMBER, OPTION_AT(Values, at_s), "a moment", .most = 100, .count = offsetof(Values, at_count), .times = 2},
    {"curve", "F...", OPTION_FILE, OPTION_AT(Values, curve), "centrelines", .count = offsetof(Values, curve_count), .times = 3, .takes_following = true},
    {"kurve", "F...", OPTION_FILE, OPTION_AT(Values, curve), NULL, .count = offsetof(Values, curve_count), .times = 3, .takes_following = true},
    {"width", "W", OPTION_TEXT, 0, "of the picture", .take = take_width},
};

static void set_defaults(void *structure) { *(Values *)structure = (Values){.draws = true, .voxel_mm = 0.2, .threads = 3, .kind = 1}; }

static const char *check(void *structure) { return ((Values *)structure)->width == 7 ? "a width of 7 needs --quiet" : NULL; }

static const OptionTable table = {.program = "seldinger try",
                                  .does = "tries - what is written",
                                  .usage = "SCENE [options]\nSCENE --quiet",
                                  .intro = "One paragraph.\n  as it is",
                                  .exits = "0 done; 2 wrong usage",
                                  .option = options,
                                  .option_count = sizeof options / sizeof *options,
                                  .size = sizeof(Values),
                                  .set_defaults = set_defaults,
                                  .check = check,
                                  .takes_argument = true,
                                  .argument = offsetof(Values, scene),
                                  .missing = "missing the scene",
                                  .too_many = "one scene at a time, not also "};

static char message[4096];

// Splits `line` at blanks and parses it; standard error goes to `message`.
static int parse(const OptionTable *of, const char *line, void *values)
{
    static char copy[400];
    char *argv[40] = {"try"};
    int argc = 1;
    snprintf(copy, sizeof copy, "%s", line);
    for (char *word = strtok(copy, " "); word; word = strtok(NULL, " "))
        argv[argc++] = word;
    FILE *file = tmpfile();
    int kept = dup(2);
    dup2(fileno(file), 2);
    int code = options_parse(of, argc, argv, values);
    dup2(kept, 2);
    close(kept);
    rewind(file);
    message[fread(message, 1, sizeof message - 1, file)] = 0;
    fclose(file);
    return code;
}

static void values_of_each_type_are_stored(void **state)
{
    (void)state;
    Values v;
    assert_int_equal(parse(&table, "a.yaml", &v), -1);
    assert_string_equal(v.scene, "a.yaml");
    assert_true(v.draws && !v.quiet && !v.has_voxel && v.voxel_mm == 0.2 && v.threads == 3 && v.kind == 1);
    assert_int_equal(parse(&table, "--voxel-mm 0.5 --seed=9007199254740991 -q --no-drawing b.yaml --threads 256 --start 1,-2.5,3e1 --kind grid -oout.h5", &v),
                     -1);
    assert_string_equal(v.scene, "b.yaml");
    assert_string_equal(v.output, "out.h5");
    assert_true(v.voxel_mm == 0.5 && v.has_voxel && v.seed == 9007199254740991.0 && v.quiet && !v.draws && v.threads == 256 && v.kind == 2);
    assert_true(v.point[0] == 1 && v.point[1] == -2.5 && v.point[2] == 30);
}

static void ways_of_writing(void **state)
{
    (void)state;
    Values v;
    assert_int_equal(parse(&table, "--vox 1 -qo x.h5 --at 1 --at=2 --curve a b --kurve c -- -s", &v), -1);
    assert_true(v.voxel_mm == 1 && v.quiet && v.at_count == 2 && v.at_s[0] == 1 && v.at_s[1] == 2 && v.curve_count == 3);
    assert_string_equal(v.output, "x.h5");
    assert_string_equal(v.curve[1], "b");
    assert_string_equal(v.curve[2], "c");
    assert_string_equal(v.scene, "-s");
}

static void what_is_wrong_is_named(void **state)
{
    (void)state;
    static const char *const lines[][2] = {
        {"", "seldinger try: missing the scene; see `seldinger try --help`\n"},
        {"a b", "one scene at a time, not also b; see"},
        {"a --quite", "unknown option '--quite'; did you mean '--quiet'?; see"},
        {"a --banana", "unknown option '--banana'; see"},
        {"a -x", "unknown option '-x'"},
        {"a --", ""},
        {"a --k 1", "several options begin with '--k'"},
        {"a --quiet=yes", "--quiet takes no value"},
        {"a --seed", "--seed is missing its value N"},
        {"a --voxel-mm 0", "--voxel-mm: '0' is not valid; a number from 0.01 to 10"},
        {"a --voxel-mm nan", "a number from 0.01 to 10"},
        {"a --voxel-mm 1x", "a number from 0.01 to 10"},
        {"a --threads 257", "--threads: '257' is not valid; a number from 0 to 256"},
        {"a --threads 1.5", "--threads: '1.5' is not valid; a whole number from 0 to 256"},
        {"a --seed 1e99", "from 0 to 9007199254740991"},
        {"a --start 1,2", "--start takes a point"},
        {"a --start 1,2,3,4", "--start takes a point"},
        {"a --start 1,2,inf", "--start takes a point"},
        {"a --kind msh", "--kind: 'msh' is not valid; valid: lim, mesh, grid"},
        {"a --at 1 --at 2 --at 3", "--at: given more than 2 times"},
        {"a --curve 1 2 3 4", "--curve: given more than 3 times"},
        {"a --width 0", "--width: '0' is not valid; WIDTH above 0"},
        {"a --width 7", "seldinger try: a width of 7 needs --quiet"},
    };
    for (size_t i = 0; i < sizeof lines / sizeof *lines; i++) {
        Values v;
        int code = parse(&table, lines[i][0], &v);
        if (code != (*lines[i][1] ? 2 : -1) || !strstr(message, lines[i][1]))
            fail_msg("`%s` ended with %d and printed: %s", lines[i][0], code, message);
    }
}

static void any_number_of_arguments(void **state)
{
    (void)state;
    typedef struct Paths {
        bool quiet;
        char **path;
        int count;
    } Paths;
    static const Option quiet[] = {{"quiet", NULL, OPTION_FLAG, OPTION_AT(Paths, quiet), "no summary"}};
    OptionTable many = {.program = "seldinger many",
                        .does = "many",
                        .usage = "PATH...",
                        .exits = "0",
                        .option = quiet,
                        .option_count = 1,
                        .size = sizeof(Paths),
                        .takes_argument = true,
                        .argument = offsetof(Paths, path),
                        .argument_count = offsetof(Paths, count),
                        .missing = "missing a path"};
    Paths p;
    assert_int_equal(parse(&many, "a --quiet b c", &p), -1);
    assert_true(p.quiet && p.count == 3);
    assert_string_equal(p.path[0], "a");
    assert_string_equal(p.path[2], "c");
    many.takes_argument = false;
    many.too_many = "takes no file";
    assert_int_equal(parse(&many, "a", &p), 2);
    assert_non_null(strstr(message, "seldinger many: takes no file; see"));
}

static char *printed(void (*print)(FILE *))
{
    char *text;
    size_t length;
    FILE *out = open_memstream(&text, &length);
    print(out);
    fclose(out);
    return text;
}

static void print_help(FILE *out) { options_help(&table, out); }
static void print_manual(FILE *out) { options_manual(&table, "1.2", out); }
static void print_completion(FILE *out) { options_completion("seldinger", (const OptionTable *const[]){&table, NULL}, out); }

static void has(const char *text, const char *part)
{
    if (!strstr(text, part))
        fail_msg("'%s' is not in: %s", part, text);
}

static void help_shows_units_and_defaults(void **state)
{
    (void)state;
    char *text = printed(print_help);
    has(text, "Usage: seldinger try SCENE [options]\n       seldinger try SCENE --quiet\n\nOne paragraph.\n  as it is\n");
    has(text, "  -o, --output F.h5  what is written\n");
    has(text, "edge of a voxel [mm]; default 0.2\n");
    has(text, "of the noise; default: the trace's\n");
    has(text, "machine\n  --threads N        threads; 0: all cores; default 3\n");
    has(text, "of contact; default mesh\n");
    has(text, "Exit codes: 0 done; 2 wrong usage\n");
    assert_null(strstr(text, "kurve"));
    free(text);
}

static void manual_and_completion_have_every_option(void **state)
{
    (void)state;
    char *text = printed(print_manual);
    has(text, ".TH SELDINGER-TRY 1 \"\" \"Seldinger 1.2\"");
    has(text, "seldinger\\-try \\- tries \\- what is written\n");
    has(text, "\\fB\\-\\-voxel\\-mm\\fR \\fIX\\fR\nedge of a voxel [mm]; default 0.2\n(a number from 0.01 to 10)\n");
    has(text, ".nf\n  as it is\n.fi\n");
    free(text);
    text = printed(print_completion);
    has(text, "'try --kind') COMPREPLY=($(compgen -W 'lim mesh grid'");
    has(text, "try) names='--output --quiet --no-drawing");
    free(text);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(values_of_each_type_are_stored), cmocka_unit_test(ways_of_writing),
        cmocka_unit_test(what_is_wrong_is_named),         cmocka_unit_test(any_number_of_arguments),
        cmocka_unit_test(help_shows_units_and_defaults),  cmocka_unit_test(manual_and_completion_have_every_option),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
