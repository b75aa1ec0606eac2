// A failed allocation ends the program with one message.
#include "base/heap.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

// Under ASan a heap returns null too, with a warning.
const char *__asan_default_options(void);
const char *__asan_default_options(void) { return "allocator_may_return_null=1"; }

// The output of a process that allocates this much; returns its exit code.
static int ask(size_t count, size_t size, char message_text[2000])
{
    int ends[2], status;
    assert_int_equal(pipe(ends), 0);
    pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0) {
        dup2(ends[1], STDERR_FILENO);
        char *memory = heap_zeroed(count, size, "/somewhere/recon/fit/field_fit.c");
        _exit(memory && memory[0] == 0 ? 0 : 1);
    }
    close(ends[1]);
    size_t length = 0;
    for (ssize_t got; length < 1999 && (got = read(ends[0], message_text + length, 1999 - length)) > 0;)
        length += (size_t)got;
    message_text[length] = '\0';
    close(ends[0]);
    assert_int_equal(waitpid(child, &status, 0), child);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

static void what_cannot_be_had_ends_the_program(void **state)
{
    (void)state;
    char message_text[2000];
    assert_int_equal(ask((size_t)1 << 60, 1, message_text), 2);
    assert_non_null(
        strstr(message_text,
               "seldinger: out of memory (could not allocate 1152921504606846976 bytes in fit/field_fit.c); close other programs or use a smaller input\n"));
    assert_int_equal(ask(SIZE_MAX / 4, 24, message_text), 2);     // more than a size_t can hold
    assert_non_null(strstr(message_text, "could not allocate 18446744073709551615 bytes"));
    assert_int_equal(ask(100, 24, message_text), 0);
    assert_int_equal(ask(0, 0, message_text), 0);
    assert_string_equal(message_text, "");
}

static void a_text_is_copied(void **state)
{
    (void)state;
    char *copy = HEAP_TEXT("a text");
    assert_string_equal(copy, "a text");
    free(copy);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(what_cannot_be_had_ends_the_program), cmocka_unit_test(a_text_is_copied)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
