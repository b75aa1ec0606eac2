// What is edited is changed, what is not stays byte for byte, in block and flow style.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "input/yaml_edit.h"

#include <stdlib.h>

static void becomes(const char *text, const char *path, const char *value, const char *expected)
{
    char *out = yaml_edit(text, path, value, true);
    assert_non_null(out);
    assert_string_equal(out, expected);
    free(out);
}

static void values_are_replaced_where_they_stand(void **state)
{
    (void)state;
    becomes("# a\nvessel: {model: a.h5, friction: 0.1}   # b\n", "vessel.model", "../x \"y\".h5", "# a\nvessel: {model: \"../x \\\"y\\\".h5\", friction: 0.1}   # b\n");
    becomes("vessel:\n  model: a.h5  # c\n  friction: 0\nscript: s.csv\n", "script", "hand.csv", "vessel:\n  model: a.h5  # c\n  friction: 0\nscript: \"hand.csv\"\n");
    becomes("tools:\n  - {device: a.yaml}\n  - {name: x, device: b.yaml}  # c\n", "tools.1.device", "d", "tools:\n  - {device: a.yaml}\n  - {name: x, device: \"d\"}  # c\n");
    becomes("script: [[0, 1, 2],\n  [3, 4, 5]]\nwire: 1\n", "script", "h", "script: \"h\"\nwire: 1\n");
    becomes("script:\n  - {t_s: 0}\n  - {t_s: 1}\nwire: 1\n", "script", "h", "script:\n  \"h\"\nwire: 1\n");
    becomes("\xEF\xBB\xBF# \xC3\xA4\xC3\xB6\na: \xC3\xBC\nb: 1\n", "b", "2", "\xEF\xBB\xBF# \xC3\xA4\xC3\xB6\na: \xC3\xBC\nb: \"2\"\n");
}

static void keys_are_added(void **state)
{
    (void)state;
    becomes("# a\nvessel: {model: a.h5}\n", "vessel.contact", "mesh", "# a\nvessel: {contact: \"mesh\", model: a.h5}\n");
    becomes("seldinger: 1\nvessel:\n  model: a\n", "vessel.contact", "mesh", "seldinger: 1\nvessel:\n  contact: \"mesh\"\n  model: a\n");
    becomes("seldinger: 1\n", "script", "h", "script: \"h\"\nseldinger: 1\n");
    becomes("{}", "script", "h", "{script: \"h\"}");
}

static void what_cannot_be_edited_is_told(void **state)
{
    (void)state;
    assert_null(yaml_edit("a: 1\n", "b", "2", false));
    assert_null(yaml_edit("a: 1\n", "a.b", "2", true));
    assert_null(yaml_edit("x: {a: 1}\n", "y.b", "2", true));
    const char *const no_item[] = {"a.2.b", "a.x.b", "a.-1.b", "a..b", "a.1x.b", "a.0.b.c", "a.1"};
    for (size_t i = 0; i < sizeof no_item / sizeof *no_item; i++)
        assert_null(yaml_edit("a: [{b: 1}, {b: 2}]\n", no_item[i], "2", false));
    assert_null(yaml_edit("a: [1\n", "a", "2", true));
    assert_null(yaml_edit("", "a", "2", true));
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(values_are_replaced_where_they_stand), cmocka_unit_test(keys_are_added),
                                       cmocka_unit_test(what_cannot_be_edited_is_told)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
