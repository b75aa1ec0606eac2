// Sections, layout, mass, and rejected options.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "wire_scene.h"

static void borders_fall_on_nodes(void **state)
{
    (void)state;
    Bench b;
    bench_start(&b, 270, 200, 1);
    b.section[1] = standard_section(29);
    b.section[2] = standard_section(0.3);
    b.options.wire.section_count = 3;
    int count[3];
    assert_true(wire_divide(&b.options.wire, count));
    assert_int_equal(count[0] + count[1] + count[2], 200);
    assert_true(count[0] >= 179 && count[0] <= 181 && count[1] >= 18 && count[1] <= 20 && count[2] == 1);
    Wire w;
    char why[256];
    assert_true(wire_create(&w, &b.options.wire, why, sizeof why));
    assert_true(w.s[count[0]] == 270 && fabs(w.s[count[0] + count[1]] - 299) < 1e-12 && fabs(w.s[200] - 299.3) < 1e-12);
    assert_true(fabs(w.total_length - 299.3) < 1e-12);
    double mass = 0;
    for (int i = 0; i <= 200; i++)
        mass += w.mass[i];
    assert_true(fabs(mass / (6.5653e-4 * 299.3) - 1) < 1e-5);
    wire_destroy(&w);

    b.options.wire.elements = 3;
    assert_true(wire_divide(&b.options.wire, count) && count[0] == 1 && count[1] == 1 && count[2] == 1);
    b.options.wire.elements = 2;
    assert_false(wire_divide(&b.options.wire, count));
    assert_false(wire_create(&w, &b.options.wire, why, sizeof why));
}

// With enough elements each bends by at most 0.3 rad at rest; otherwise in proportion.
static void curved_sections_get_more_elements(void **state)
{
    (void)state;
    Bench b;
    bench_start(&b, 285, 200, 1);
    b.section[1] = standard_section(15 * PI), b.section[1].rest_curvature = -0.2;          // three half turns of radius 5
    b.section[2] = standard_section(PI / 4), b.section[2].rest_curvature = 1;              // 45 degrees of radius 1
    b.options.wire.section_count = 3;
    int count[3];
    assert_true(wire_divide(&b.options.wire, count));
    assert_int_equal(count[0] + count[1] + count[2], 200);
    assert_true(3 * PI / count[1] < 0.31 && PI / 4 / count[2] < 0.31);
    b.options.wire.elements = 24;
    assert_true(wire_divide(&b.options.wire, count));
    assert_int_equal(count[0] + count[1] + count[2], 24);
    assert_true(count[0] >= 8 && count[1] >= 10 && count[2] >= 1 && fabs(3 * PI / count[1] - PI / 4 / count[2]) < 0.5);
}

static void stiffness_of_the_standard_wire(void **state)
{
    (void)state;
    WireSection section = standard_section(1);
    WireStiffness k = wire_stiffness(&section);
    assert_true(fabs(k.bending / EI_STANDARD - 1) < 1e-8 && fabs(k.torsion / GJ_STANDARD - 1) < 1e-6);
    assert_true(fabs(k.line_mass / 6.5653e-4 - 1) < 1e-4);
    // a thin tube: kappa = 2 (1 + nu) / (4 + 3 nu), about a half
    section.inner_diameter = 0.999 * section.diameter;
    k = wire_stiffness(&section);
    double g = section.young_modulus / 2.6;
    assert_true(fabs(k.shear / (g * k.area) / (2 * 1.3 / 4.9) - 1) < 1e-3);
}

typedef void (*Spoil)(Bench *b);
static void no_elements(Bench *b) { b->options.wire.elements = 0; }
static void many_elements(Bench *b) { b->options.wire.elements = 10001; }
static void no_length(Bench *b) { b->section[0].length = 0; }
static void nan_length(Bench *b) { b->section[0].length = NAN; }
static void no_diameter(Bench *b) { b->section[0].diameter = -1; }
static void wide_bore(Bench *b) { b->section[0].inner_diameter = 0.36; }
static void no_modulus(Bench *b) { b->section[0].young_modulus = 0; }
static void endless_modulus(Bench *b) { b->section[0].young_modulus = INFINITY; }
static void incompressible(Bench *b) { b->section[0].poisson_ratio = 0.5; }
static void no_density(Bench *b) { b->section[0].density = 0; }
static void tight_curl(Bench *b) { b->section[0].rest_curvature = 3; }
static void few_elements_a_turn(Bench *b) { b->section[0].rest_curvature = 0.5; }
static void nan_friction(Bench *b) { b->section[0].friction = NAN; }
static void far_fix(Bench *b) { b->fix[0].s = 101; }
static void nan_load(Bench *b) { bench_load(b, 100, vec3(NAN, 0, 0), vec3(0, 0, 0), 0); }
static void far_load(Bench *b) { bench_load(b, -1, vec3(0, 0, 0), vec3(0, 0, 0), 0); }
static void no_direction(Bench *b) { b->options.wire.direction = vec3(0, 0, 0); }
static void too_far_in(Bench *b) { b->options.wire.has_sheath = true, b->options.wire.inserted = 101; }
static void nan_step(Bench *b) { b->options.dt = NAN; }
static void bad_friction(Bench *b) { b->options.wall_friction = -1; }

static void wrong_options_are_refused(void **state)
{
    (void)state;
    static const Spoil spoil[] = {no_elements,    many_elements, no_length,  nan_length,          no_diameter,  wide_bore, no_modulus, endless_modulus,
                                  incompressible, no_density,    tight_curl, few_elements_a_turn, nan_friction, far_fix,   nan_load,   far_load,
                                  no_direction,   too_far_in,    nan_step,   bad_friction};
    for (size_t k = 0; k < sizeof spoil / sizeof *spoil; k++) {
        Bench b;
        bench_start(&b, 100, 20, 1);
        spoil[k](&b);
        char why[256] = "";
        assert_null(stepper_create(&b.options, why, (int)sizeof why));
        assert_true(strlen(why) > 10 && strstr(why, "valid") != NULL);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(borders_fall_on_nodes),
        cmocka_unit_test(curved_sections_get_more_elements),
        cmocka_unit_test(stiffness_of_the_standard_wire),
        cmocka_unit_test(wrong_options_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
