// Violated assumptions end the program with a message; assumptions that hold cost nothing and change nothing.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "base/assert.h"
#include "geom/power_walk.h"
#include "solver/block_chain.h"

#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

// Runs `breaks` in its own process; returns its standard error and its signal (0: none).
static int dies_of(void (*breaks)(void), char *message_text, size_t capacity)
{
    int ends[2];
    assert_int_equal(pipe(ends), 0);
    pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0) {
        signal(SIGABRT, SIG_DFL);
        dup2(ends[1], STDERR_FILENO);
        breaks();
        _exit(0);
    }
    close(ends[1]);
    size_t used = 0;
    for (ssize_t part; used + 1 < capacity && (part = read(ends[0], message_text + used, capacity - 1 - used)) > 0;)
        used += (size_t)part;
    message_text[used] = '\0';
    close(ends[0]);
    int status;
    assert_int_equal(waitpid(child, &status, 0), child);
    return WIFSIGNALED(status) ? WTERMSIG(status) : 0;
}

static void requires_what_is_false(void) { SEL_REQUIRE(1 + 1 == 3, "sums are wrong"); }
static void requires_what_is_true(void) { SEL_REQUIRE(1 + 1 == 2, "sums are right"); }
static void asserts_what_is_false(void) { SEL_ASSERT(1 + 1 == 3, "sums are wrong"); }

static void a_message_says_where_and_what(void **state)
{
    (void)state;
    char message_text[2000], expected[200];
    assert_int_equal(dies_of(requires_what_is_false, message_text, sizeof message_text), SIGABRT);
    snprintf(expected, sizeof expected, "tests/base/test_assert.c:%d: assertion failed: 1 + 1 == 3; assumed: sums are wrong\n", __LINE__ - 9);
    if (!strstr(message_text, expected))
        fail_msg("the message is '%s', not '%s'", message_text, expected);
    assert_int_equal(dies_of(requires_what_is_true, message_text, sizeof message_text), 0);
    assert_string_equal(message_text, "");
}

// In a build without assertions the condition is not evaluated.
static void assertions_are_on_where_the_build_says(void **state)
{
    (void)state;
    char message_text[2000];
    int looked = 0;
    assert_int_equal(dies_of(asserts_what_is_false, message_text, sizeof message_text), SELDINGER_ASSERTS ? SIGABRT : 0);
    SEL_ASSERT(++looked == 1, "conditions are looked at once");
    assert_int_equal(looked, SELDINGER_ASSERTS);
}

// A chain that is longer than its factor's capacity: the factor would be written beyond its end.
static void factors_too_long_a_chain(void)
{
    BlockChain chain;
    BlockFactor *factor = block_factor_create(3, 6);
    if (factor && block_chain_create(&chain, 4, 6))
        block_chain_factor(&chain, factor);
}

static void walks_on_an_unlinked_tree(void)
{
    VesselTree *tree = vessel_tree_create(2, 0, 0);
    if (tree)
        power_walk(tree, vec3(0, 0, 0), 0, 1);
}

static void borders_are_guarded(void **state)
{
    (void)state;
    char message_text[2000];
    assert_int_equal(dies_of(factors_too_long_a_chain, message_text, sizeof message_text), SIGABRT);
    assert_non_null(strstr(message_text, "solver/block_chain.c:"));
    assert_non_null(strstr(message_text, "a factor has room for the nodes of its chain"));
    if (SELDINGER_ASSERTS) {
        assert_int_equal(dies_of(walks_on_an_unlinked_tree, message_text, sizeof message_text), SIGABRT);
        assert_non_null(strstr(message_text, "the tree is linked"));
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(a_message_says_where_and_what), cmocka_unit_test(assertions_are_on_where_the_build_says),
                                       cmocka_unit_test(borders_are_guarded)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
