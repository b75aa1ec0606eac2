// A library that runs out of memory: the call is aborted, on whichever thread it runs, and the program continues.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <stdatomic.h>
#include <stdlib.h>

#include "base/heap.h"
#include "base/parallel.h"

enum { MUCH = 12345, JOBS = 64, BAD_JOB = 17 };

static void succeed(void *context) { *(int *)context += 1; }
static void allocate_all(void *context)
{
    *(int *)context += 1;
    heap_is_empty(MUCH, __FILE__);
}

static void a_whole_call_is_whole(void **state)
{
    (void)state;
    int calls = 0;
    size_t lacking = 7;
    assert_false(heap_is_tried());
    assert_true(heap_try(succeed, &calls, &lacking));
    assert_int_equal(calls, 1);
    assert_int_equal(lacking, 7);
}

static void a_call_without_memory_is_broken_off(void **state)
{
    (void)state;
    int calls = 0;
    size_t lacking = 0;
    assert_false(heap_try(allocate_all, &calls, &lacking));
    assert_int_equal(calls, 1);
    assert_int_equal(lacking, MUCH);
    assert_false(heap_is_tried());
}

// The inner call is aborted, the outer one continues.
static void nest(void *context)
{
    size_t lacking = 0;
    assert_false(heap_try(allocate_all, context, &lacking));
    assert_true(heap_is_tried());
    *(int *)context += 10;
}

static void only_the_innermost_call_is_broken_off(void **state)
{
    (void)state;
    int calls = 0;
    size_t lacking = 0;
    assert_true(heap_try(nest, &calls, &lacking));
    assert_int_equal(calls, 11);
}

static atomic_int jobs_done;

static void job(void *context, long index)
{
    (void)context;
    if (index == BAD_JOB)
        heap_is_empty(MUCH, __FILE__);
    atomic_fetch_add(&jobs_done, 1);
}

static void watch(void *context, long done, long total) { (void)context, (void)done, (void)total; }

static void run_jobs(void *progress)
{
    parallel_for(4, JOBS, job, NULL, progress);
    abort();      // never reached
}

static void threads_are_broken_off_with_their_call(void **state)
{
    (void)state;
    Progress progress = {.call = watch};
    for (int i = 0; i < 2; i++) {
        size_t lacking = 0;
        atomic_store(&jobs_done, 0);
        assert_false(heap_try(run_jobs, i ? &progress : NULL, &lacking));
        assert_int_equal(lacking, MUCH);
        assert_in_range(atomic_load(&jobs_done), 0, JOBS - 1);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_whole_call_is_whole),
        cmocka_unit_test(a_call_without_memory_is_broken_off),
        cmocka_unit_test(only_the_innermost_call_is_broken_off),
        cmocka_unit_test(threads_are_broken_off_with_their_call),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
