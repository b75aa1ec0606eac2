// The appearance of a scene's tools in the views: stretches between the borders of sections and markers, distinct colours.
#include "render/tool_look.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "../geom/near.h"

static const char text[] =
    "seldinger: 1\n"
    "tools:\n"
    "  - name: outer\n"
    "    kind: catheter\n"
    "    elements: 20\n"
    "    sections:\n"
    "      - {length_mm: 50, diameter_mm: 1, inner_diameter_mm: 0.8, young_modulus_gpa: 1, attenuation_1_mm: 0.3}\n"
    "      - {length_mm: 10, diameter_mm: 1, inner_diameter_mm: 0.8, young_modulus_gpa: 2, attenuation_1_mm: 0.3}\n"
    "      - {length_mm: 20, diameter_mm: 0.9, inner_diameter_mm: 0.7, young_modulus_gpa: 1, attenuation_1_mm: 0.2}\n"
    "    tip_marker: {length_mm: 1.5, attenuation_1_mm: 5}\n"
    "  - name: wire\n"
    "    kind: wire\n"
    "    elements: 20\n"
    "    sections: [{length_mm: 90, diameter_mm: 0.4, young_modulus_gpa: 20}]\n"
    "    tip_marker: {length_mm: 0}\n"
    "    exchange: [{sections: [{length_mm: 100, diameter_mm: 0.6, young_modulus_gpa: 20}], tip_marker: {length_mm: 5, attenuation_1_mm: 7}}]\n"
    "rig: {start_mm: [0, 0, 0], direction: [1, 0, 0], normal: [0, 1, 0], fix: [{s_mm: 0, dof: all}]}\n";

static void stretches_end_where_sections_and_markers_do(void **state)
{
    (void)state;
    Faults faults;
    faults_clear(&faults);
    Scene *scene = scene_parse(text, strlen(text), "test.yaml", &faults);
    if (!scene || faults.count)
        fail_msg("%s", faults.count ? faults.text[0] : "no scene");
    ToolLooks looks;
    assert_true(tool_looks_make(&looks, scene));
    assert_int_equal(looks.count, 2);
    const ToolLook *outer = &looks.tool[0], *wire = &looks.tool[1];
    // the first two sections look the same; the marker divides the third
    const TubeStretch expected[3] = {{60, 0.5, 0.4, 0.3}, {78.5, 0.45, 0.35, 0.2}, {80, 0.45, 0.35, 5}};
    assert_int_equal(outer->stretch_count, 3);
    for (int i = 0; i < 3; i++) {
        assert_near(outer->stretch[i].end, expected[i].end, 1e-9);
        assert_near(outer->stretch[i].radius, expected[i].radius, 1e-9);
        assert_near(outer->stretch[i].lumen, expected[i].lumen, 1e-9);
        assert_near(outer->stretch[i].attenuation, expected[i].attenuation, 1e-9);
    }
    assert_true(wire->stretch_count == 1 && wire->stretch[0].lumen <= 0);
    assert_string_equal(wire->name, "wire");
    assert_ptr_equal(tool_look_at(outer, -3), &outer->stretch[0]);
    assert_ptr_equal(tool_look_at(outer, 60.001), &outer->stretch[1]);
    assert_ptr_equal(tool_look_at(outer, 1000), &outer->stretch[2]);
    // an alternative to the wire has its own section and marker; name and colours stay
    const ToolLook *other = tool_looks_of(&looks, 1, 1);
    assert_true(other != wire && other->stretch_count == 2 && other->name == wire->name && memcmp(&other->color, &wire->color, sizeof other->color) == 0);
    assert_near(other->stretch[0].radius, 0.3, 1e-12);
    assert_near(other->stretch[0].end, 95, 1e-12);
    assert_near(other->stretch[1].attenuation, 7, 1e-12);
    assert_ptr_equal(tool_looks_of(&looks, 1, 0), wire);
    assert_ptr_equal(tool_looks_of(&looks, 1, 2), wire);
    assert_ptr_equal(tool_looks_of(&looks, 0, 1), outer);
    tool_looks_free(&looks);
    scene_free(scene);
}

static double luminance(Color c) { return 0.2126 * c.r + 0.7152 * c.g + 0.0722 * c.b; }

// As deuteranopes see them (Vienot 1999): red and green become equal.
static void as_seen(Color c, double out[2])
{
    out[0] = 0.29275 * c.r + 0.70725 * c.g;
    out[1] = c.b;
}

static void colors_differ(void **state)
{
    (void)state;
    for (int paper = 0; paper < 2; paper++)
        for (int first = 0; first < TOOL_KIND_COUNT; first++) {
            const ToolKind same[4] = {(ToolKind)first, (ToolKind)first, (ToolKind)first, (ToolKind)first};
            const ToolKind each[4] = {TOOL_GUIDE_CATHETER, TOOL_CATHETER, TOOL_MICROCATHETER, TOOL_WIRE};
            for (int set = 0; set < 2; set++) {
                Color color[4];
                tool_colors(4, set ? same : each, paper, color);
                for (int a = 0; a < 4; a++) {
                    assert_true(paper ? luminance(color[a]) < 160 : luminance(color[a]) > 110);
                    for (int b = 0; b < a; b++) {
                        double x[2], y[2];
                        as_seen(color[a], x);
                        as_seen(color[b], y);
                        assert_true(hypot(x[0] - y[0], x[1] - y[1]) > 40);
                    }
                }
            }
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(stretches_end_where_sections_and_markers_do), cmocka_unit_test(colors_differ)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
