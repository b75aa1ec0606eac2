// The journal of a sweep: every prefix of it, as a kill leaves it, is opened and goes on; a flipped bit costs one result; another heading is refused.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "study/journal.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static char folder[] = "/tmp/seldinger-journal-XXXXXX";
#include "tests/folder.h"

enum { RUNS = 4 };
static Faults faults;
static int seen[RUNS];

static cJSON *heading(const char *version)
{
    cJSON *object = cJSON_CreateObject();
    cJSON_AddStringToObject(object, "version", version);
    return object;
}

static Journal *open_it(const char *version)
{
    cJSON *object = heading(version);
    faults_clear(&faults);
    Journal *journal = journal_open(in_folder("r"), object, RUNS, &faults);
    cJSON_Delete(object);
    return journal;
}

static void see(void *context, int64_t run, const char *text, int64_t offset)
{
    char *again = journal_at(context, offset);
    assert_string_equal(again, text);
    free(again);
    seen[run]++;
}

static void add(Journal *journal, int run)
{
    char text[80];
    snprintf(text, sizeof text, "{\"run\":%d,\"status\":\"done\",\"message\":\"\\\"%d\\\"\"}", run, run * 7);
    assert_true(journal_add(journal, text, &faults));
}

static void make_journal(void)
{
    unlink(in_folder("r/journal.txt"));
    Journal *journal = open_it("1");
    assert_non_null(journal);
    for (int run = 0; run < RUNS; run++)
        add(journal, run);
    journal_close(journal);
}

static void every_prefix_goes_on(void **state)
{
    (void)state;
    make_journal();
    char *whole = text_of(in_folder("r/journal.txt"));
    for (size_t length = 0; length <= strlen(whole); length++) {
        put_bytes("r/journal.txt", whole, length);
        Journal *journal = open_it("1");
        if (!journal)
            fail_msg("%zu bytes: %s", length, faults.text[0]);
        memset(seen, 0, sizeof seen);
        assert_int_equal(journal_read(journal, see, journal), 0);
        for (int run = 0; run < RUNS; run++)
            if (!seen[run])
                add(journal, run);
        memset(seen, 0, sizeof seen);
        assert_int_equal(journal_read(journal, see, journal), 0);
        for (int run = 0; run < RUNS; run++)
            assert_int_equal(seen[run], 1);
        journal_close(journal);
        char *again = text_of(in_folder("r/journal.txt"));
        assert_string_equal(again, whole);
        free(again);
    }
    free(whole);
}

static void a_flipped_bit_costs_one_result(void **state)
{
    (void)state;
    make_journal();
    char *whole = text_of(in_folder("r/journal.txt"));
    size_t first = strcspn(whole, "\n") + 1;
    for (size_t at = first; at < strlen(whole); at++) {
        if (whole[at] == '\n')
            continue;        // joins two lines
        whole[at] ^= 1;
        put("r/journal.txt", whole);
        whole[at] ^= 1;
        Journal *journal = open_it("1");
        memset(seen, 0, sizeof seen);
        assert_int_equal(journal_read(journal, see, journal), 1);
        assert_int_equal(seen[0] + seen[1] + seen[2] + seen[3], RUNS - 1);
        journal_close(journal);
    }
    free(whole);
}

static void another_heading_is_refused(void **state)
{
    (void)state;
    make_journal();
    assert_null(open_it("2"));
    assert_non_null(strstr(faults.text[0], "the version was 1 when the sweep began and is 2 now"));
    put("r/journal.txt", "something else\nand more\n");
    assert_null(open_it("1"));
    assert_non_null(strstr(faults.text[0], "is not the journal of a sweep"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(every_prefix_goes_on), cmocka_unit_test(a_flipped_bit_costs_one_result),
                                       cmocka_unit_test(another_heading_is_refused)};
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
