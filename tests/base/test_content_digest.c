// A digest changes with every bit of what it covers, with the borders between its parts and with their order; the identity of the program is in its file.
#include "base/content_digest.h"
#include "base/process.h"
#include "base/whole_file.h"

#include <limits.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { BYTES = 200 };

static uint8_t content[BYTES];

static int fill(void **state)
{
    (void)state;
    for (int i = 0; i < BYTES; i++)
        content[i] = (uint8_t)(i * 37 + 11);
    return 0;
}

static ContentDigest digest_of(size_t first, size_t second)
{
    ContentDigest digest = content_digest_begin();
    content_digest_add(&digest, content, first);
    content_digest_add(&digest, content + first, second);
    return digest;
}

static bool differ(ContentDigest a, ContentDigest b) { return memcmp(&a, &b, sizeof a) != 0; }

static void every_bit_counts(void **state)
{
    (void)state;
    const ContentDigest whole = digest_of(BYTES, 0);
    assert_false(differ(whole, digest_of(BYTES, 0)));
    for (int bit = 0; bit < 8 * BYTES; bit++) {
        content[bit / 8] ^= (uint8_t)(1 << bit % 8);
        const ContentDigest changed = digest_of(BYTES, 0);
        content[bit / 8] ^= (uint8_t)(1 << bit % 8);
        for (int lane = 0; lane < 4; lane++)
            assert_true(changed.lane[lane] != whole.lane[lane]);
    }
}

static void borders_and_lengths_count(void **state)
{
    (void)state;
    for (size_t a = 0; a <= BYTES; a++)
        for (size_t b = 0; b < a; b++)
            assert_true(differ(digest_of(a, BYTES - a), digest_of(b, BYTES - b)));
    memset(content, 0, sizeof content);
    for (size_t length = 0; length < BYTES; length++)
        assert_true(differ(digest_of(length, 0), digest_of(length + 1, 0)));
}

static void a_text_has_all_digits(void **state)
{
    (void)state;
    char hex[65];
    content_digest_hex(&(ContentDigest){{1, 2, UINT64_MAX, 0xabc}}, hex);
    assert_string_equal(hex, "0000000000000001"
                             "0000000000000002"
                             "ffffffffffffffff"
                             "0000000000000abc");
}

static void the_program_is_identified_by_its_content(void **state)
{
    (void)state;
    char id[PROCESS_CODE_ID], path[PATH_MAX];
    uint8_t byte[PROCESS_CODE_ID / 2];
    size_t count, length;
    Faults faults = {0};
    assert_true(process_code_id(id));
    assert_true(process_code_file(path, sizeof path));
    assert_int_equal(strspn(id, "0123456789abcdef"), strlen(id));
    count = strlen(id) / 2;
    assert_in_range(count, 16, 32);
    if (count == 32)
        skip();      // linked without a build ID: the hash of the file, which is not in the file
    for (size_t i = 0; i < count; i++)
        byte[i] = (uint8_t)strtoul((char[]){id[2 * i], id[2 * i + 1], 0}, NULL, 16);
    char *program = whole_file_read(path, &length, &faults);
    assert_non_null(program);
    bool is_in_it = false;
    for (size_t i = 0; i + count <= length && !is_in_it; i++)
        is_in_it = memcmp(program + i, byte, count) == 0;
    assert_true(is_in_it);
    free(program);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test_setup(every_bit_counts, fill), cmocka_unit_test_setup(borders_and_lengths_count, fill),
                                       cmocka_unit_test(a_text_has_all_digits), cmocka_unit_test(the_program_is_identified_by_its_content)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
