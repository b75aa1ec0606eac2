// Cross-sections of each kind: derivatives, exact curves, the laws of the papers' forms, and invalid contours.
#include "geom/section_row.h"
#include "random_numbers.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

enum { MOST = 720 };

static double star_radius(double theta) { return 1.5 + 0.12 * same_cos(3 * theta + 0.4) + 0.05 * same_sin(5 * theta); }

static int star(int count, SectionPoint *contour)
{
    for (int i = 0; i < count; i++) {
        double theta = 2 * PI * i / count, r = star_radius(theta);
        contour[i] = (SectionPoint){r * same_cos(theta), r * same_sin(theta)};
    }
    return count;
}

static int ellipse(int count, double a, double b, double n0, double b0, double turn, SectionPoint *contour)
{
    for (int i = 0; i < count; i++) {
        double x = a * same_cos(2 * PI * i / count), y = b * same_sin(2 * PI * i / count), c = same_cos(turn), s = same_sin(turn);
        contour[i] = (SectionPoint){n0 + c * x - s * y, b0 + s * x + c * y};
    }
    return count;
}

static Section *make(SectionKind kind, SectionForm form, int count, const SectionPoint *contour)
{
    SectionOptions options = section_default_options(kind, form);
    options.voxel_mm = 0.4;
    Section *section = section_create(&options, count, contour);
    assert_non_null(section);
    return section;
}

// Central differences of C and of its gradient at points around the curve; the raster as printed has a gradient that jumps, so its own derivatives are
// tested within a cell only, by a step that is small against it.
static void derivatives_agree_with_differences(void **state)
{
    (void)state;
    SectionPoint contour[24];
    star(24, contour);
    for (int k = 0; k < 2 * SECTION_KINDS; k++) {
        Section *s = make((SectionKind)(k / 2), k % 2 ? SECTION_AS_PRINTED : SECTION_MENDED, 24, contour);
        const double h = 1e-5;
        double worst_first = 0, worst_second = 0;
        uint64_t seed = 7;
        for (int i = 0; i < 500; i++) {
            double theta = 2 * PI * random_in(&seed, 0, 1), r = star_radius(theta) * (0.9 + 0.2 * random_in(&seed, 0, 1));
            double n = r * same_cos(theta), b = r * same_sin(theta);
            SectionJet j = section_evaluate(s, n, b), e = section_evaluate(s, n + h, b), w = section_evaluate(s, n - h, b), u = section_evaluate(s, n, b + h),
                       d = section_evaluate(s, n, b - h);
            bool smooth = fabs(e.nb - w.nb) + fabs(u.nb - d.nb) < 1 && fabs(e.nn - w.nn) + fabs(u.bb - d.bb) < 1;
            if (!smooth)     // a knot of the kernel or a line of the raster lies between
                continue;
            worst_first = fmax(worst_first, fmax(fabs((e.value - w.value) / (2 * h) - j.n), fabs((u.value - d.value) / (2 * h) - j.b)));
            worst_second =
                fmax(worst_second, fmax(fabs((e.n - w.n) / (2 * h) - j.nn), fmax(fabs((u.b - d.b) / (2 * h) - j.bb), fabs((u.n - d.n) / (2 * h) - j.nb))));
        }
        printf("%s%s: derivatives differ by %.1e and %.1e\n", section_kind_name[k / 2], k % 2 ? " as printed" : "", worst_first, worst_second);
        // differences of step h have an error of h^2 times the third derivative; kernels with knots one of h times its jump
        assert_true(worst_first < 1e-6);
        assert_true(worst_second < 1e-3);
        section_free(s);
    }
}

// Largest distance of a section's curve from the star, along rays.
static double off_star(const Section *s)
{
    double radius[MOST], worst = 0;
    assert_int_equal(section_radii(s, 0, 0, MOST, radius), 0);
    for (int i = 0; i < MOST; i++)
        worst = fmax(worst, fabs(radius[i] - star_radius(2 * PI * i / MOST)));
    return worst;
}

static void all_kinds_hold_a_star(void **state)
{
    (void)state;
    // two to three times what was measured; a polygon of 24 sides lies inside the star
    static const double allowed[SECTION_KINDS][2] = {{1e-6, 1e-6}, {0.015, 0.0015}, {0.006, 0.0005}, {0.06, 0.02}};
    for (int k = 0; k < SECTION_KINDS; k++) {
        double off[2];
        for (int fine = 0; fine < 2; fine++) {
            SectionPoint contour[96];
            Section *s = make((SectionKind)k, SECTION_MENDED, star(fine ? 96 : 24, contour), contour);
            off[fine] = off_star(s);
            section_free(s);
        }
        printf("%s: the star is missed by %.4f mm with 24 points, by %.4f with 96\n", section_kind_name[k], off[0], off[1]);
        assert_true(off[0] < allowed[k][0]);
        assert_true(off[1] < allowed[k][1]);
    }
}

// Points on an ellipse: the quadratic alone is the solution, whatever the stiffness.
static void rbf_reproduces_an_ellipse(void **state)
{
    (void)state;
    SectionPoint contour[24], fine[MOST];
    ellipse(24, 2, 1.1, 0.3, -0.2, 0.5, contour);
    ellipse(MOST, 2, 1.1, 0.3, -0.2, 0.5, fine);
    for (int k = 0; k < 3; k++) {
        SectionOptions o = section_default_options(SECTION_RBF, SECTION_MENDED);
        o.stiffness = k == 0 ? 0 : k == 1 ? 0.1 : 10;
        Section *s = section_create(&o, 24, contour);
        assert_non_null(s);
        double worst = 0;
        for (int i = 0; i < MOST; i++)
            worst = fmax(worst, fabs(section_evaluate(s, fine[i].n, fine[i].b).value));
        printf("mu %g: the ellipse is missed by %.1e mm\n", o.stiffness, worst);
        assert_true(worst < 1e-5);       // limited by the 1e-13 that keeps the singular system regular
        assert_true(section_evaluate(s, 0.3, -0.2).value > 0);
        section_free(s);
    }
}

static void rbf_as_printed_passes_through_its_points(void **state)
{
    (void)state;
    SectionPoint contour[24];
    uint64_t seed = 3;
    star(24, contour);
    for (int i = 0; i < 24; i++)
        contour[i].n += 0.05 * (random_in(&seed, 0, 1) - 0.5), contour[i].b += 0.05 * (random_in(&seed, 0, 1) - 0.5);
    Section *through = make(SECTION_RBF, SECTION_AS_PRINTED, 24, contour), *near = make(SECTION_RBF, SECTION_MENDED, 24, contour);
    double most = 0, least = HUGE_VAL;
    for (int i = 0; i < 24; i++) {
        most = fmax(most, fabs(section_evaluate(through, contour[i].n, contour[i].b).value));
        least = fmin(least, fabs(section_evaluate(near, contour[i].n, contour[i].b).value));
    }
    assert_true(most < 1e-9);
    assert_true(least > 0);
    section_free(through);
    section_free(near);
}

// m delta^2 / (6 r) with m = 3: the law of shared/rivals.md; the next term is of fourth order.
static void pas_as_printed_shrinks_by_its_law(void **state)
{
    (void)state;
    SectionPoint contour[MOST];
    ellipse(MOST, 1, 1, 0, 0, 0, contour);
    double previous = 0;
    for (int k = 0; k < 3; k++) {
        SectionOptions o = section_default_options(SECTION_PAS, SECTION_AS_PRINTED);
        o.delta_mm = 0.2 / (1 << k);
        Section *s = section_create(&o, MOST, contour);
        double radius[8];
        assert_int_equal(section_radii(s, 0, 0, 8, radius), 0);
        double shrunk = 1 - radius[0], law = o.delta_mm * o.delta_mm / 2, rest = fabs(shrunk - law - 0.5 * same_square(PI / MOST));
        printf("delta %.3f: shrunk by %.6f, law %.6f\n", o.delta_mm, shrunk, law);
        assert_true(rest < 0.05 * law);
        if (k > 0)
            assert_true(rest < previous / 3.5 || rest < 3e-6);   // the chords of 720 sides leave 1e-6
        previous = rest;
        section_free(s);
    }
}

static void pas_is_an_indicator_away_from_its_contour(void **state)
{
    (void)state;
    SectionPoint contour[24];
    SectionOptions o = section_default_options(SECTION_PAS, SECTION_AS_PRINTED);
    o.delta_mm = 0.1;
    Section *s = section_create(&o, star(24, contour), contour);
    assert_true(fabs(section_evaluate(s, 0.1, 0.2).value - 0.5) < 1e-12);      // P = 1
    assert_true(fabs(section_evaluate(s, 2.5, 0).value + 0.5) < 1e-12);        // P = 0
    section_free(s);
}

static void pas_keeps_the_contours_area(void **state)
{
    (void)state;
    // the area of the smooth curve that 48 points of it stand for: the polygon through many
    SectionPoint contour[48], curve[MOST];
    double radius[MOST], area = 0;
    star(MOST, curve);
    area = polygon_area(MOST, curve);
    star(48, contour);
    for (int form = 0; form < 2; form++) {
        Section *s = make(SECTION_PAS, (SectionForm)form, 48, contour);
        section_radii(s, 0, 0, MOST, radius);
        for (int i = 0; i < MOST; i++)
            curve[i] = (SectionPoint){radius[i] * same_cos(2 * PI * i / MOST), radius[i] * same_sin(2 * PI * i / MOST)};
        double change = polygon_area(MOST, curve) / area - 1;
        printf("pas%s: area changed by %.5f\n", form ? " as printed" : "", change);
        if (form == SECTION_MENDED)
            assert_true(fabs(change) < 2e-4);
        else
            assert_true(change < -0.01);
        section_free(s);
    }
}

// On a circle the raster of exact distances is off by the interpolation's error only.
static void raster_gives_distances(void **state)
{
    (void)state;
    SectionPoint contour[MOST];
    ellipse(MOST, 1.2, 1.2, 0, 0, 0, contour);
    double worst[2] = {0, 0};
    for (int form = 0; form < 2; form++) {
        Section *s = make(SECTION_RASTER, (SectionForm)form, MOST, contour);
        uint64_t seed = 5;
        for (int i = 0; i < 2000; i++) {
            double theta = 2 * PI * random_in(&seed, 0, 1), r = 0.6 + 0.9 * random_in(&seed, 0, 1);
            worst[form] = fmax(worst[form], fabs(section_evaluate(s, r * same_cos(theta), r * same_sin(theta)).value - (1.2 - r)));
        }
        section_free(s);
    }
    printf("raster: distances off by %.6f mm, as printed by %.4f mm\n", worst[0], worst[1]);
    assert_true(worst[0] < 5e-5);
    assert_true(worst[1] > 0.01 && worst[1] < 0.1);      // chamfer distances, in cells of 0.06 mm
}

static void a_kidney_is_not_star_shaped(void **state)
{
    (void)state;
    enum { SIDE = 60 };
    SectionPoint contour[2 * SIDE];
    for (int i = 0; i < SIDE; i++) {     // a bent sausage: an arc of 240 degrees, 0.8 wide
        double a = (-120 + 240.0 * i / (SIDE - 1)) * PI / 180;
        contour[i] = (SectionPoint){1.4 * same_cos(a), 1.4 * same_sin(a)};
        contour[2 * SIDE - 1 - i] = (SectionPoint){0.6 * same_cos(a), 0.6 * same_sin(a)};
    }
    Section *s = make(SECTION_RASTER, SECTION_MENDED, 2 * SIDE, contour);
    double radius[90];
    assert_true(section_radii(s, 1, 0, 90, radius) > 0);
    assert_int_equal(section_radii(s, 0, 0, 90, radius), -1);
    assert_true(polygon_contains(2 * SIDE, contour, 1, 0) && !polygon_contains(2 * SIDE, contour, 0, 0));
    section_free(s);
}

static void direction_of_the_contour_does_not_matter(void **state)
{
    (void)state;
    SectionPoint contour[24], reversed[24];
    star(24, contour);
    for (int i = 0; i < 24; i++)
        reversed[i] = contour[23 - i];
    assert_true(fabs(polygon_area(24, contour) + polygon_area(24, reversed)) < 1e-15);
    for (int k = 0; k < SECTION_KINDS; k++) {
        Section *a = make((SectionKind)k, SECTION_MENDED, 24, contour), *b = make((SectionKind)k, SECTION_MENDED, 24, reversed);
        for (int i = 0; i < 24; i++) {
            double n = 1.05 * contour[i].n, c = 1.05 * contour[i].b;
            assert_true(fabs(section_evaluate(a, n, c).value - section_evaluate(b, n, c).value) < 1e-9);
        }
        section_free(a);
        section_free(b);
    }
}

static void invalid_contours_are_rejected(void **state)
{
    (void)state;
    SectionPoint line[4] = {{0, 0}, {1, 1}, {2, 2}, {3, 3}}, bad[4] = {{1, 0}, {0, 1}, {NAN, 0}, {0, -1}}, good[4] = {{1, 0}, {0, 1}, {-1, 0}, {0, -1}};
    for (int k = 0; k < SECTION_KINDS; k++) {
        SectionOptions o = section_default_options((SectionKind)k, SECTION_MENDED);
        assert_null(section_create(&o, 4, line));
        assert_null(section_create(&o, 4, bad));
        assert_null(section_create(&o, 2, good));
        o.harmonics = 17;
        assert_null(section_create(&o, 4, good));
        o = section_default_options((SectionKind)k, SECTION_MENDED);
        o.delta_mm = -1;
        assert_null(section_create(&o, 4, good));
    }
}

// --- Rows of sections ---

enum { STATIONS = 9 };

// Circles whose radius grows along the row: a cone.
static void make_cone(SectionRow *row, Section **section, double *t, double slope, double uneven)
{
    for (int j = 0; j < STATIONS; j++) {
        SectionPoint contour[24];
        t[j] = j + uneven * same_sin(2.0 * j);
        ellipse(24, 1 + slope * t[j], 1 + slope * t[j], 0, 0, 0, contour);
        section[j] = make(SECTION_POLAR, SECTION_MENDED, 24, contour);
    }
    *row = (SectionRow){.count = STATIONS, .t = t, .section = section, .weights = SECTION_PSP, .tension = 0.7, .width = 0.5};
}

static void free_all(Section **section)
{
    for (int j = 0; j < STATIONS; j++)
        section_free(section[j]);
}

static void weights_of_a_row_add_up_to_one(void **state)
{
    (void)state;
    SectionRow row;
    Section *section[STATIONS];
    double t[STATIONS];
    make_cone(&row, section, t, 0.1, 0.3);
    for (int k = 0; k < 4; k++) {
        row.weights = k < 3 ? SECTION_PSP : SECTION_CATMULL_ROM;
        row.width = k == 0 ? 0.5 : k == 1 ? 0.25 : 0.1;
        for (double x = -1; x < 9.5; x += 0.01) {
            SectionShares s = section_row_shares(&row, x);
            double sum = 0, sum1 = 0, sum2 = 0;
            for (int i = 0; i < s.count; i++)
                sum += s.w[i], sum1 += s.w1[i], sum2 += s.w2[i];
            assert_true(s.first >= 0 && s.first + s.count <= STATIONS);
            assert_true(fabs(sum - 1) < 1e-14 && fabs(sum1) < 1e-12 && fabs(sum2) < 1e-11);
        }
    }
    free_all(section);
}

// Derivatives in all three coordinates against differences, and their continuity where a weight begins.
static void derivatives_of_a_row_agree_with_differences(void **state)
{
    (void)state;
    SectionRow row;
    Section *section[STATIONS];
    double t[STATIONS], worst = 0;
    make_cone(&row, section, t, 0.1, 0.2);
    uint64_t seed = 11;
    for (int i = 0; i < 2000; i++) {
        row.weights = i % 2 ? SECTION_PSP : SECTION_CATMULL_ROM;
        const double h = 1e-5;
        double n = random_in(&seed, -1.5, 1.5), b = random_in(&seed, -1.5, 1.5), x = random_in(&seed, 0.2, 7.8);
        SectionRowJet j = section_row_evaluate(&row, n, b, x), u = section_row_evaluate(&row, n, b, x + h), d = section_row_evaluate(&row, n, b, x - h);
        worst = fmax(worst, fabs((u.value - d.value) / (2 * h) - j.t));
        worst = fmax(worst, fmax(fabs((u.n - d.n) / (2 * h) - j.nt), fabs((u.b - d.b) / (2 * h) - j.bt)));
        if (fabs(u.tt - d.tt) < 1e-3)        // no station between: Catmull-Rom's second derivative jumps there
            worst = fmax(worst, fabs((u.t - d.t) / (2 * h) - j.tt));
    }
    printf("row: derivatives differ by %.1e\n", worst);
    assert_true(worst < 1e-4);       // h times the jump of the third derivative
    free_all(section);
}

// B-splines on even stations hold a cone exactly; the printed Catmull-Rom curve leaves it by 0.0375 of a step's change (shared/rivals.md, section 6).
static void tapers_along_a_row(void **state)
{
    (void)state;
    SectionRow row;
    Section *section[STATIONS];
    double t[STATIONS], worst[4] = {0};
    make_cone(&row, section, t, 0.1, 0);
    for (int k = 0; k < 4; k++) {
        row.weights = k < 2 ? SECTION_PSP : SECTION_CATMULL_ROM;
        row.width = k == 0 ? 0.5 : 0.25;
        row.tension = k == 2 ? 0.5 : 0.7;
        for (double x = 2; x < 6; x += 0.01)
            worst[k] = fmax(worst[k], fabs(section_row_evaluate(&row, 1.2, 0, x).value - (1 + 0.1 * x - 1.2)));
    }
    printf("cone: off by %.1e (B-spline), %.4f (delta a quarter), %.1e (Catmull-Rom 0.5), %.5f (0.7)\n", worst[0], worst[1], worst[2], worst[3]);
    assert_true(worst[0] < 1e-9 && worst[2] < 1e-9);
    assert_true(worst[1] > 1e-3);
    assert_true(fabs(worst[3] / 0.1 - 0.0385) < 0.002);      // the largest of (2 tau - 1) u (1 - u) (1 - 2u): 0.4 times 0.0962
    free_all(section);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(derivatives_agree_with_differences),
        cmocka_unit_test(all_kinds_hold_a_star),
        cmocka_unit_test(rbf_reproduces_an_ellipse),
        cmocka_unit_test(rbf_as_printed_passes_through_its_points),
        cmocka_unit_test(pas_as_printed_shrinks_by_its_law),
        cmocka_unit_test(pas_is_an_indicator_away_from_its_contour),
        cmocka_unit_test(pas_keeps_the_contours_area),
        cmocka_unit_test(raster_gives_distances),
        cmocka_unit_test(a_kidney_is_not_star_shaped),
        cmocka_unit_test(direction_of_the_contour_does_not_matter),
        cmocka_unit_test(invalid_contours_are_rejected),
        cmocka_unit_test(weights_of_a_row_add_up_to_one),
        cmocka_unit_test(derivatives_of_a_row_agree_with_differences),
        cmocka_unit_test(tapers_along_a_row),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
