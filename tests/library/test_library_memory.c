// The host's allocator: the library gets all of its memory from it and returns it, and if an allocation fails, the call fails and the program continues.
// usage: test_library_memory [REFUSALS]: number of failed allocations tried in each story, spread over all of its allocations; default 4
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <math.h>
#include <stdbool.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

#include <seldinger/seldinger.h>

static char folder[] = "/tmp/seldinger-memory-XXXXXX";
#include "tests/folder.h"

// --- an allocator that counts and fails; lost memory stays in its list ---

typedef struct Block {
    struct Block *before, *after;
    void *base;
    size_t bytes;
} Block;

static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
static Block all = {.before = &all, .after = &all};
static long live, asked, refused_at;     // refused_at: the allocation that fails, and all after it; 0: none
static bool is_foreign;

static bool may_have(void)
{
    pthread_mutex_lock(&lock);
    bool may = ++asked < refused_at || refused_at == 0;
    pthread_mutex_unlock(&lock);
    return may;
}

static Block *block_of(void *memory) { return (Block *)memory - 1; }

static void list(Block *block)
{
    pthread_mutex_lock(&lock);
    block->before = &all;
    block->after = all.after;
    all.after->before = block;
    all.after = block;
    live++;
    pthread_mutex_unlock(&lock);
}

static void unlist(const Block *block)
{
    pthread_mutex_lock(&lock);
    is_foreign |= block->before->after != block || block->after->before != block;
    block->before->after = block->after;
    block->after->before = block->before;
    live--;
    pthread_mutex_unlock(&lock);
}

static void *allocate(void *user, size_t bytes, size_t alignment)
{
    if (user != &all || !may_have())
        return NULL;
    size_t ahead = (sizeof(Block) + alignment - 1) / alignment * alignment;
    char *base = aligned_alloc(alignment, (ahead + bytes + alignment - 1) / alignment * alignment);
    assert_non_null(base);
    memset(base, 0xa5, ahead + bytes);
    Block *block = block_of(base + ahead);
    *block = (Block){.base = base, .bytes = bytes};
    list(block);
    return base + ahead;
}

static void release(void *user, void *memory)
{
    (void)user;
    unlist(block_of(memory));
    free(block_of(memory)->base);
}

static void *resize(void *user, void *memory, size_t bytes)
{
    void *longer = allocate(user, bytes, 16);
    if (!longer)
        return NULL;
    size_t before = block_of(memory)->bytes;
    memcpy(longer, memory, before < bytes ? before : bytes);
    release(user, memory);
    return longer;
}

// --- stories (sequences of calls); each destroys all its handles at the end and returns its first error ---

static const char tube[] =
    "seldinger: 1\n"
    "vessel: {tube: {radius_mm: 1, path: [{line_mm: 10}, {arc: {radius_mm: 10, angle_deg: 90, plane_deg: 0}}]}, contact: grid, friction: 0.1}\n"
    "wire: {elements: 30, sections: [{length_mm: 60, diameter_mm: 0.4, young_modulus_gpa: 5}]}\n"
    "sheath: {entry_mm: [0, 0, 0], direction: [1, 0, 0], inserted_mm: 8}\n"
    "script: [{t_s: 0, push_mm_s: 50, twist_deg_s: 90}, {t_s: 1, push_mm_s: 0, twist_deg_s: 0}]\n";

static SelStatus run(SelSimulator *simulator, SelStatus status)
{
    char *json = NULL;
    for (int i = 0; status == SEL_OK && i < 50; i++) {
        SelHand hand;
        sel_simulator_script_hand(simulator, &hand);
        status = sel_simulator_step(simulator, &hand);
    }
    if (status == SEL_OK)
        status = sel_simulator_score_json(simulator, &json);
    sel_free(json);
    return status;
}

static SelStatus simulate(SelContext *context)
{
    SelScene *scene = NULL;
    SelSimulator *simulator = NULL;
    SelStatus status = sel_scene_parse(context, tube, sizeof tube - 1, "tube.yaml", NULL, &scene);
    if (status == SEL_OK)
        status = sel_simulator_create(context, scene, NULL, &simulator);
    if (status == SEL_OK)
        status = sel_simulator_record(simulator, in_folder("run.h5"), NULL);
    status = run(simulator, status);
    if (status == SEL_OK)
        status = sel_simulator_end_recording(simulator);
    if (status == SEL_OK)
        status = sel_simulator_reset(simulator);
    sel_simulator_destroy(simulator);
    sel_scene_destroy(scene);
    return status;
}

static SelStatus replay(SelContext *context)
{
    SelRecording *recording = NULL;
    SelScene *scene = NULL;
    SelStatus status = sel_recording_open(context, in_folder("kept.h5"), &recording);
    if (status == SEL_OK)
        status = sel_recording_scene(context, recording, NULL, &scene);
    if (status == SEL_OK)
        status = sel_recording_verify(context, recording, scene, NULL);
    sel_scene_destroy(scene);
    sel_recording_destroy(recording);
    return status;
}

static SelStatus make_volume(SelContext *context, SelVolume **volume)
{
    enum { SIZE = 20, LENGTH = 30 };
    static float value[LENGTH][SIZE][SIZE];
    const int size[3] = {SIZE, SIZE, LENGTH};
    const double origin[3] = {0}, axis[3][3] = {{0.5, 0, 0}, {0, 0.5, 0}, {0, 0, 0.5}};
    for (int k = 0; k < LENGTH; k++)
        for (int j = 0; j < SIZE; j++)
            for (int i = 0; i < SIZE; i++)
                value[k][j][i] = (float)(1000 * fmin(1, fmax(0, 0.5 + (2 - hypot(0.5 * i - 4.75, 0.5 * j - 4.75)) / 0.5)));
    return sel_volume_create(context, size, origin, axis, &value[0][0][0], volume);
}

static SelStatus reconstruct(SelContext *context)
{
    SelVolume *volume = NULL;
    SelTree *tree = NULL, *model = NULL;
    SelSegmentOptions options = sel_segment_defaults();
    options.start_mm[0] = options.start_mm[1] = 4.75;
    options.start_mm[2] = 7;
    SelStatus status = make_volume(context, &volume);
    if (status == SEL_OK)
        status = sel_segment(context, volume, &options, &tree);
    if (status == SEL_OK)
        status = sel_fit(context, tree, NULL, &model);
    if (status == SEL_OK)
        status = sel_tree_save(context, model, in_folder("model.h5"));
    sel_tree_destroy(model);
    sel_tree_destroy(tree);
    sel_volume_destroy(volume);
    return status;
}

typedef SelStatus (*CountedCall)(SelContext *context);
static const CountedCall story[] = {simulate, replay, reconstruct};
enum { STORIES = sizeof story / sizeof *story };
static int refusals = 4;

// --- tests ---

static int set_allocator(void **state)
{
    static SelAllocator allocator = {.size = sizeof(SelAllocator), .user = &all, .allocate = allocate, .resize = resize, .release = release};
    SelAllocator without = allocator;
    without.resize = NULL;
    bool is_set = sel_set_allocator(&without) == SEL_ERROR_ARGUMENT && sel_set_allocator(&allocator) == SEL_OK;
    return is_set && make_folder(state) == 0 ? 0 : -1;
}

static void all_memory_comes_from_the_host_and_goes_back(void **state)
{
    (void)state;
    for (int i = 0; i < STORIES; i++) {
        SelContext *context = NULL;
        long before = asked;
        assert_int_equal(sel_context_create(NULL, &context), SEL_OK);
        SelStatus status = story[i](context);
        if (status != SEL_OK)
            fail_msg("story %d: %s", i, sel_fault(context, 0));
        sel_context_destroy(context);
        sel_vessels_forget();
        print_message("story %d: %ld allocations, %ld are left\n", i, asked - before, live);
        assert_true(asked - before > 100);
        assert_int_equal(live, 0);
        if (i == 0)
            assert_int_equal(rename(in_folder("run.h5"), in_folder("kept.h5")), 0);
    }
    assert_false(is_foreign);
}

// A step with score and recording, and functions that read its results.
static void a_step_allocates_nothing(void **state)
{
    (void)state;
    SelContext *context = NULL;
    SelScene *scene = NULL;
    SelSimulator *simulator = NULL;
    SelReport report;
    SelScore score;
    SelNode node[31];
    SelContact contact[31];
    int count;
    assert_int_equal(sel_context_create(NULL, &context), SEL_OK);
    assert_int_equal(sel_scene_parse(context, tube, sizeof tube - 1, "tube.yaml", NULL, &scene), SEL_OK);
    assert_int_equal(sel_simulator_create(context, scene, NULL, &simulator), SEL_OK);
    assert_int_equal(sel_simulator_record(simulator, in_folder("step.h5"), NULL), SEL_OK);
    long before = asked;
    for (int i = 0; i < 500; i++) {
        SelHand hand;
        sel_simulator_script_hand(simulator, &hand);
        assert_int_equal(sel_simulator_step(simulator, &hand), SEL_OK);
        assert_int_equal(sel_simulator_report(simulator, &report, sizeof report), SEL_OK);
        assert_int_equal(sel_simulator_score(simulator, &score, sizeof score), SEL_OK);
        assert_int_equal(sel_simulator_nodes(simulator, 0, node, 31, &count), SEL_OK);
        assert_int_equal(sel_simulator_contacts(simulator, contact, 31, &count), SEL_OK);
    }
    assert_int_equal(asked, before);
    assert_true(report.contacts > 0);
    assert_int_equal(sel_simulator_end_recording(simulator), SEL_OK);
    sel_simulator_destroy(simulator);
    sel_scene_destroy(scene);
    sel_context_destroy(context);
    assert_int_equal(live, 0);
}

static void it_cannot_be_changed_later(void **state)
{
    (void)state;
    assert_int_equal(sel_set_allocator(NULL), SEL_ERROR_STATE);
}

static long count_of(CountedCall call)
{
    SelContext *context = NULL;
    assert_int_equal(sel_context_create(NULL, &context), SEL_OK);
    long before = asked;
    assert_int_equal(call(context), SEL_OK);
    sel_context_destroy(context);
    return asked - before;
}

// The last failures of a story may be in a thread that needs less memory than it requests.
static void a_refusal_is_an_error(void **state)
{
    (void)state;
    int errors = 0, unseen = 0;
    for (int i = 0; i < STORIES; i++) {
        long count = count_of(story[i]);
        for (int k = 0; k < refusals; k++) {
            SelContext *context = NULL;
            assert_int_equal(sel_context_create(NULL, &context), SEL_OK);
            asked = 0;
            refused_at = 1 + count * k / refusals;
            SelStatus status = story[i](context);
            refused_at = 0;
            if (status != SEL_OK && (status == SEL_ERROR_ARGUMENT || sel_fault_count(context) == 0))
                fail_msg("story %d, refused from %ld on: %s without a message", i, 1 + count * k / refusals, sel_status_name(status));
            errors += status != SEL_OK;
            unseen += status == SEL_OK;
            sel_context_destroy(context);
        }
        assert_int_equal(count_of(story[i]) > 0, 1);     // everything works as before
    }
    print_message("%d refusals: %d errors, %d without effect\n", errors + unseen, errors, unseen);
    assert_true(unseen * 10 <= errors);
    assert_false(is_foreign);
}

int main(int argc, char **argv)
{
    if (argc > 1)
        refusals = atoi(argv[1]);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(all_memory_comes_from_the_host_and_goes_back),
        cmocka_unit_test(a_step_allocates_nothing),
        cmocka_unit_test(it_cannot_be_changed_later),
        cmocka_unit_test(a_refusal_is_an_error),
    };
    return cmocka_run_group_tests(tests, set_allocator, remove_folder);
}
