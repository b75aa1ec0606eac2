// An edit changes the given values and leaves all other bytes, in block and flow style.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "base/yaml_edit.h"

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
    becomes("# a\nvessel: {model: a.h5, friction: 0.1}   # b\n", "vessel.model", "../x \"y\".h5",
            "# a\nvessel: {model: \"../x \\\"y\\\".h5\", friction: 0.1}   # b\n");
    becomes("vessel:\n  model: a.h5  # c\n  friction: 0\nscript: s.csv\n", "script", "hand.csv",
            "vessel:\n  model: a.h5  # c\n  friction: 0\nscript: \"hand.csv\"\n");
    becomes("tools:\n  - {device: a.yaml}\n  - {name: x, device: b.yaml}  # c\n", "tools.1.device", "d",
            "tools:\n  - {device: a.yaml}\n  - {name: x, device: \"d\"}  # c\n");
    becomes("script: [[0, 1, 2],\n  [3, 4, 5]]\nwire: 1\n", "script", "h", "script: \"h\"\nwire: 1\n");
    becomes("script:\n  - {t_s: 0}\n  - {t_s: 1}\nwire: 1\n", "script", "h", "script:\n  \"h\"\nwire: 1\n");
    becomes("a:\nb: 1\n", "a", "2", "a: \"2\"\nb: 1\n");
    becomes("x: {a: , b: 1}\n", "x.a", "2", "x: {a:  \"2\", b: 1}\n");
    becomes("\xEF\xBB\xBF# \xC3\xA4\xC3\xB6\na: \xC3\xBC\nb: 1\n", "b", "2", "\xEF\xBB\xBF# \xC3\xA4\xC3\xB6\na: \xC3\xBC\nb: \"2\"\n");
}

static void becomes_flow(const char *text, const char *path, const char *flow, const char *expected)
{
    char *out = yaml_edit_flow(text, path, flow, true);
    assert_non_null(out);
    assert_string_equal(out, expected);
    free(out);
}

static void values_in_flow_style_are_written(void **state)
{
    (void)state;
    becomes_flow("a: {b: 1}   # c\nd: 2\n", "a.b", "[1, {x: y}]", "a: {b: [1, {x: y}]}   # c\nd: 2\n");
    becomes_flow("a: [1, 2, 3]\n", "a.2", "0.5", "a: [1, 2, 0.5]\n");
    becomes_flow("w:\n  - {e: 1}\n  - {e: 2}\n\n# of d\nd: 2\n", "w", "[{e: 3}]", "w:\n  [{e: 3}]\n\n# of d\nd: 2\n");
    becomes_flow("w:\n  e: 1\nd: 2\n", "w.f", "80", "w:\n  f: 80\n  e: 1\nd: 2\n");
    assert_null(yaml_edit_flow("a: 1\n", "a", "[1", true));
    assert_null(yaml_edit_flow("a: {b: 1}\n", "a.b", "1, c: 2", true));
    assert_null(yaml_edit_flow("a: [1, 2]\n", "a.2", "3", true));
    assert_null(yaml_edit_flow("v: {a: 1, b: 2\n}\n", "v.a", "3 # b is gone", true));
    assert_null(yaml_edit_flow("a: &x [1]\nb: *x\n", "b.0", "2", true));     // would change a
}

static void keys_are_added(void **state)
{
    (void)state;
    becomes("# a\nvessel: {model: a.h5}\n", "vessel.contact", "mesh", "# a\nvessel: {contact: \"mesh\", model: a.h5}\n");
    becomes("seldinger: 1\nvessel:\n  model: a\n", "vessel.contact", "mesh", "seldinger: 1\nvessel:\n  contact: \"mesh\"\n  model: a\n");
    becomes("seldinger: 1\n", "script", "h", "script: \"h\"\nseldinger: 1\n");
    becomes("{}", "script", "h", "{script: \"h\"}");
}

static void grows(const char *text, const char *path, const char *expected)
{
    char *out = yaml_edit_append(text, path, "{a: 9}");
    assert_non_null(out);
    assert_string_equal(out, expected);
    free(out);
}

static void items_are_appended(void **state)
{
    (void)state;
    grows("t: [{a: 1}]\n", "t", "t: [{a: 1}, {a: 9}]\n");
    grows("t: []   # c\n", "t", "t: [{a: 9}]   # c\n");
    grows("t: [\n  {a: 1},  # c\n  {a: 2}\n]\nb: 1\n", "t", "t: [\n  {a: 1},  # c\n  {a: 2}\n, {a: 9}]\nb: 1\n");
    grows("t:\n  - {a: 1}   # c\n\n# of b\nb: 1\n", "t", "t:\n  - {a: 1}   # c\n  - {a: 9}\n\n# of b\nb: 1\n");
    grows("t:\n- a: 1\n  b:\n    - 2\nb: 1\n", "t", "t:\n- a: 1\n  b:\n    - 2\n- {a: 9}\nb: 1\n");
    grows("t:\n  - a: 1", "t", "t:\n  - a: 1\n  - {a: 9}");
    grows("x:\n  - n: a\n    t:\n      - {a: 1}\n  - n: b\n", "x.0.t", "x:\n  - n: a\n    t:\n      - {a: 1}\n      - {a: 9}\n  - n: b\n");
    grows("x:\n  - n: a\n  - n: b\n", "x.1.t", "x:\n  - n: a\n  - t: [{a: 9}]\n    n: b\n");
    grows("x: [{n: a}, {}]\n", "x.0.t", "x: [{t: [{a: 9}], n: a}, {}]\n");
    grows("x: [{n: a}, {}]\n", "x.1.t", "x: [{n: a}, {t: [{a: 9}]}]\n");
    assert_null(yaml_edit_append("t: 1\n", "t", "1"));
    assert_null(yaml_edit_append("t: {}\n", "u.v", "1"));
}

static void what_cannot_be_edited_is_reported(void **state)
{
    (void)state;
    assert_null(yaml_edit("a: 1\n", "b", "2", false));
    assert_null(yaml_edit("a: 1\n", "a.b", "2", true));
    assert_null(yaml_edit("x: {a: 1}\n", "y.b", "2", true));
    const char *const no_item[] = {"a.2.b", "a.x.b", "a.-1.b", "a..b", "a.1x.b", "a.0.b.c", "a.2"};
    for (size_t i = 0; i < sizeof no_item / sizeof *no_item; i++)
        assert_null(yaml_edit("a: [{b: 1}, {b: 2}]\n", no_item[i], "2", false));
    assert_null(yaml_edit("a: [1\n", "a", "2", true));
    assert_null(yaml_edit("", "a", "2", true));
    assert_null(yaml_edit("a: &x 1\nb: *x\n", "a", "2", true));
    assert_null(yaml_edit("? a\n? b\n", "b", "2", true));
    assert_null(yaml_edit("a: 1\n---\nb: 2\n", "a", "2", true));
    assert_null(yaml_edit("a: 1\n", "a", "two\nlines", true));
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(values_are_replaced_where_they_stand), cmocka_unit_test(values_in_flow_style_are_written),
                                       cmocka_unit_test(keys_are_added), cmocka_unit_test(items_are_appended),
                                       cmocka_unit_test(what_cannot_be_edited_is_reported)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
