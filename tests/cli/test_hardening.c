// Build flags that hinder an attacker who has found a defect in a reader, checked in the program by readelf and objdump. Skipped by name if these are not
// installed.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>

#include "tests/short_run.h"

static char *text;

// Puts the output of `command PROGRAM` into `text`; returns its exit code.
static int of_program(const char *command)
{
    char line[4300];
    size_t room = (size_t)32 << 20, length;
    text = text ? text : malloc(room);
    assert_non_null(text);
    snprintf(line, sizeof line, "%s '%s' 2>&1", command, SELDINGER_PROGRAM);
    FILE *pipe = popen(line, "r");
    assert_non_null(pipe);
    length = fread(text, 1, room - 1, pipe);
    text[length] = 0;
    // surplus output is read too; otherwise the command would be stopped
    for (char rest[4096]; fread(rest, 1, sizeof rest, pipe) > 0;)
        continue;
    return WEXITSTATUS(pclose(pipe));
}

static void need(const char *tool)
{
    NEED_WHOLE_RUNS();
    char command[100];
    snprintf(command, sizeof command, "command -v %s >/dev/null", tool);
    if (system(command) != 0) {
        print_message("skipped: no %s\n", tool);
        skip();
    }
}

static void expect(const char *words)
{
    if (!strstr(text, words))
        fail_msg("the program has no %s", words);
}

static void its_place_changes_with_each_run(void **state)
{
    (void)state;
    need("readelf");
    assert_int_equal(of_program("readelf -Wh"), 0);
    expect("DYN");
    assert_int_equal(of_program("readelf -Wd"), 0);
    expect("PIE");
    assert_null(strstr(text, "TEXTREL"));
}

static void its_tables_are_sealed_at_the_start(void **state)
{
    (void)state;
    need("readelf");
    assert_int_equal(of_program("readelf -Wl"), 0);
    expect("GNU_RELRO");
    assert_int_equal(of_program("readelf -Wd"), 0);
    expect("NOW");
}

static void nothing_can_be_written_and_run(void **state)
{
    (void)state;
    need("readelf");
    assert_int_equal(of_program("readelf -Wl"), 0);
    assert_null(strstr(text, "RWE"));
    char *stack = strstr(text, "GNU_STACK");
    assert_non_null(stack);
    stack[strcspn(stack, "\n")] = 0;
    assert_non_null(strstr(stack, "RW "));
}

static void its_stacks_are_guarded(void **state)
{
    (void)state;
    need("objdump");
    assert_int_equal(of_program("readelf -W --dyn-syms"), 0);
    expect("__stack_chk_fail");
    // large frames touch each of their pages: or $0,(%rsp)
    assert_int_equal(of_program("probed() { objdump -d --no-show-raw-insn -j .text \"$1\" | grep -E 'or[lq]? +[$]0x0,[(]%[re]?sp[)]' | head -n 1; }; probed"),
                     0);
    expect("(%rsp)");
}

static void its_copies_are_checked(void **state)
{
    (void)state;
    need("readelf");
#if !defined(__OPTIMIZE__)
    print_message("skipped: not optimised\n");
    skip();
#else
    assert_int_equal(of_program("readelf -W --dyn-syms"), 0);
    static const char *const checked[] = {"__snprintf_chk", "__memcpy_chk", "__fprintf_chk"};
    for (size_t i = 0; i < sizeof checked / sizeof *checked; i++)
        expect(checked[i]);
#endif
}

static void a_checker_finds_nothing(void **state)
{
    (void)state;
    need("hardening-check");
    if (of_program("hardening-check --nocfprotection") != 0)
        fail_msg("%s", text);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(its_place_changes_with_each_run), cmocka_unit_test(its_tables_are_sealed_at_the_start),
        cmocka_unit_test(nothing_can_be_written_and_run),  cmocka_unit_test(its_stacks_are_guarded),
        cmocka_unit_test(its_copies_are_checked),          cmocka_unit_test(a_checker_finds_nothing),
    };
    setenv("LC_ALL", "C", 1);
    int code = cmocka_run_group_tests(tests, NULL, NULL);
    free(text);
    return code;
}
