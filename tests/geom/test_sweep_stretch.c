// Stretches of a swept model with sections of another kind than polar: derivatives against differences, sections that repeat the rows, the fade, contact with a
// kidney-shaped tube against the polygon itself, mirrored contours, and faults.
#include "geom/geom.h"
#include "random_numbers.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "near.h"
#include "sweep_models.h"

static Faults faults;

enum { POINTS = 64 };

static void ellipse(double a, double b, double turned, SectionPoint *out)
{
    for (int i = 0; i < POINTS; i++) {
        double angle = 2 * PI * i / POINTS, n = a * cos(angle), up = b * sin(angle);
        out[i] = (SectionPoint){n * cos(turned) - up * sin(turned), n * sin(turned) + up * cos(turned)};
    }
}

// Half a ring with round ends, about a point of its lumen; from there some rays meet the wall three times.
static void kidney(SectionPoint *out)
{
    static const double RING = 0.9, HALF = 0.5, MIDDLE = 0.65;
    double outer = PI * (RING + HALF), end = PI * HALF, inner = PI * (RING - HALF);
    for (int i = 0; i < POINTS; i++) {
        double way = (outer + 2 * end + inner) * i / POINTS, a = way / (RING + HALF) - PI / 2, r = RING + HALF, up = 0;
        if (way >= outer + end + inner)
            a = (way - outer - end - inner) / HALF + PI / 2, r = HALF, up = -RING;
        else if (way >= outer + end)
            a = PI / 2 - (way - outer - end) / (RING - HALF), r = RING - HALF;
        else if (way >= outer)
            a = (way - outer) / HALF + PI / 2, r = HALF, up = RING;
        out[i] = (SectionPoint){r * cos(a) - MIDDLE, up + r * sin(a)};
    }
}

typedef struct Made {
    SweepModel *model;
    SweepField *field;
} Made;

typedef struct Wanted {
    SectionKind kind;
    SectionForm form;
    SectionWeights weights;
    bool is_straight, is_bent, is_kidney;
    double from, to, fade;   // [part of the length]
} Wanted;

static Made make(Wanted w)
{
    enum { STATIONS = 13 };
    SweepShape s = {.knots = 40, .pitch = 1, .parent = -1, .radius = 1, .open_start = true};
    for (int i = 0; i < s.knots; i++) {
        double a = 0.05 * i;
        s.knot[i] = w.is_bent ? vec3(7 * sin(a), 7 - 7 * cos(a), 0.6 * a) : vec3(0.3 * i, 0, 0);
    }
    Made made = {.model = sweep_model_of(&s, 1)};
    double length = sweep_model_length(made.model, 0);
    SweepStation station[STATIONS];
    SectionPoint contour[STATIONS * POINTS];
    for (int i = 0; i < STATIONS; i++) {
        station[i] = (SweepStation){length * (w.from + (w.to - w.from) * i / (STATIONS - 1)), POINTS * i, POINTS};
        if (w.is_kidney)
            kidney(contour + POINTS * i);
        else
            ellipse(1.1 - 0.01 * i, 0.9, 0.1 * i, contour + POINTS * i);
    }
    SweepStretch stretch = {.from = w.from * length,
                            .to = w.to * length,
                            .fade = w.fade * length,
                            .station_count = STATIONS,
                            .section = section_default_options(w.kind, w.form),
                            .weights = w.weights,
                            .tension = 0.7,
                            .width = 0.5,
                            .is_straight = w.is_straight};
    stretch.section.voxel_mm = 0.3;
    faults_clear(&faults);
    if (!sweep_model_set_stretches(made.model, 1, &stretch, STATIONS, station, STATIONS * POINTS, contour, "model", &faults))
        fail_msg("%s", faults.text[0]);
    made.field = sweep_field_create(made.model);
    assert_non_null(made.field);
    return made;
}

static void discard(Made *made)
{
    sweep_field_free(made->field);
    sweep_model_free(made->model);
}

static double value(const Made *m, Vec3 x, double t, Vec3 *gradient, Sym3 *hessian)
{
    SweepPart part;
    sweep_field_branch(m->field, 0, x, t, &part);
    if (gradient)
        *gradient = part.gradient;
    if (hessian)
        *hessian = part.hessian;
    return part.f;
}

// The kinds that are smooth: the gradient to 1e-6 and the Hessian to 1e-5 of the largest second derivative (shared/rivals.md, section 7).
static void derivatives_are_exact(void **state)
{
    (void)state;
    static const Wanted wanted[] = {
        {SECTION_POLAR, SECTION_MENDED, SECTION_PSP, false, true, false, 0.1, 0.9, 0.2},
        {SECTION_RASTER, SECTION_MENDED, SECTION_PSP, false, true, true, 0.1, 0.9, 0.2},
        {SECTION_RBF, SECTION_MENDED, SECTION_PSP, false, true, false, 0.0, 1.0, 0.1},
        {SECTION_PAS, SECTION_AS_PRINTED, SECTION_PSP, false, true, false, 0.1, 0.9, 0.1},
        {SECTION_RBF, SECTION_AS_PRINTED, SECTION_PSP, true, true, false, 0.1, 0.9, 0.1},
        {SECTION_POLAR, SECTION_MENDED, SECTION_CATMULL_ROM, false, true, false, 0.1, 0.9, 0.2},
    };
    for (size_t k = 0; k < sizeof wanted / sizeof wanted[0]; k++) {
        Made m = make(wanted[k]);
        uint64_t seed = 5 + k;
        double worst1 = 0, worst2 = 0, length = m.field->curve[0]->length, h = 1e-5;
        for (int i = 0; i < 400; i++) {
            double t = random_in(&seed, -0.02, 0.98) * length, rho = random_in(&seed, 0.7, 1.15), angle = random_in(&seed, 0, 2 * PI);
            SweepJet j = sweep_curve_at(m.field->curve[0], t);
            Vec3 x = vec3_add(j.s, vec3_add(vec3_scale(j.n, rho * cos(angle)), vec3_scale(j.b, rho * sin(angle)))), g;
            Sym3 H;
            value(&m, x, t, &g, &H);
            double big = fmax(1, sqrt(sym3_norm2(&H)));
            for (int axis = 0; axis < 3; axis++) {
                Vec3 step = vec3(axis == 0 ? h : 0, axis == 1 ? h : 0, axis == 2 ? h : 0), low1, high1;
                double low = value(&m, vec3_sub(x, step), t, &low1, NULL), high = value(&m, vec3_add(x, step), t, &high1, NULL);
                double slope = axis == 0 ? g.x : axis == 1 ? g.y : g.z;
                Vec3 column = axis == 0 ? vec3(H.xx, H.xy, H.xz) : axis == 1 ? vec3(H.xy, H.yy, H.yz) : vec3(H.xz, H.yz, H.zz);
                worst1 = fmax(worst1, fabs((high - low) / (2 * h) - slope) / big);
                worst2 = fmax(worst2, vec3_distance(vec3_scale(vec3_sub(high1, low1), 1 / (2 * h)), column) / big);
            }
        }
        print_message("%s%s: gradient %.1e, Hessian %.1e\n", section_kind_name[wanted[k].kind], wanted[k].is_straight ? ", straight frames" : "", worst1,
                      worst2);
        assert_true(worst1 < 1e-6);
        assert_true(worst2 < 1e-5);
        discard(&m);
    }
}

// Polar sections that repeat the rows' circle change nothing; outside the range, nothing changes whatever the sections are.
static void rows_are_repeated(void **state)
{
    (void)state;
    SweepShape s = {.pitch = 1, .parent = -1, .radius = 1};
    sweep_shape_line(&s, vec3(0, 0, 0), vec3(12, 0, 0), 20);
    SweepModel *plain = sweep_model_of(&s, 1);
    SectionPoint circle[2 * POINTS];
    ellipse(1, 1, 0, circle);
    ellipse(1, 1, 0, circle + POINTS);
    SweepStation station[2] = {{3, 0, POINTS}, {8, POINTS, POINTS}};
    SweepStretch stretch = {.from = 3,
                            .to = 8,
                            .fade = 1,
                            .station_count = 2,
                            .section = section_default_options(SECTION_POLAR, SECTION_MENDED),
                            .weights = SECTION_PSP,
                            .tension = 0.5,
                            .width = 0.5};
    SweepModel *same = sweep_model_of(&s, 1);
    faults_clear(&faults);
    assert_true(sweep_model_set_stretches(same, 1, &stretch, 2, station, 2 * POINTS, circle, "model", &faults));
    Made a = {plain, sweep_field_create(plain)}, b = {same, sweep_field_create(same)},
         other = make((Wanted){SECTION_RASTER, SECTION_MENDED, SECTION_PSP, false, false, true, 0.3, 0.6, 0.05});
    uint64_t seed = 1;
    for (int i = 0; i < 500; i++) {
        Vec3 x = vec3(random_in(&seed, -0.5, 12.5), random_in(&seed, -1.2, 1.2), random_in(&seed, -1.2, 1.2));
        assert_near(value(&a, x, x.x, NULL, NULL), value(&b, x, x.x, NULL, NULL), 1e-8);
        double length = other.field->curve[0]->length;
        SweepPart with, without;
        sweep_field_branch(other.field, 0, x, x.x, &with);
        sweep_segment_evaluate(&other.field->segment[sweep_field_segment(other.field, 0, with.t)], x, with.t, &without);
        if (with.t < 0.3 * length || with.t > 0.6 * length)
            assert_true(with.f == without.f);
    }
    discard(&a);
    discard(&b);
    discard(&other);
}

static double polygon_distance(const SectionPoint *p, double n, double b)
{
    double least = HUGE_VAL;
    for (int i = 0; i < POINTS; i++) {
        SectionPoint u = p[i], v = p[(i + 1) % POINTS];
        double dn = v.n - u.n, db = v.b - u.b, s = ((n - u.n) * dn + (b - u.b) * db) / (dn * dn + db * db);
        s = fmax(0, fmin(1, s));
        least = fmin(least, hypot(n - u.n - s * dn, b - u.b - s * db));
    }
    return polygon_contains(POINTS, p, n, b) ? least : -least;
}

// A straight kidney-shaped tube is the kidney's polygon (which a spline of tension 0.7 and a raster of 0.08 mm round off by 0.01 mm) extruded: gap and normal everywhere, also where a polar section has no wall.
static void contact_with_a_kidney(void **state)
{
    (void)state;
    Made m = make((Wanted){SECTION_RASTER, SECTION_MENDED, SECTION_PSP, false, false, true, 0, 1, 0.1});
    Vessel *vessel = sweep_vessel_create(m.model);
    SectionPoint p[POINTS];
    kidney(p);
    uint64_t seed = 2;
    int unsure = 0, asked = 0;
    double worst = 0;
    for (int i = 0; i < 3000; i++) {
        // across the curve as its frame there
        double t = random_in(&seed, 3, 8), n = random_in(&seed, -1.2, 0.8), b = random_in(&seed, -1.6, 1.6), truth = polygon_distance(p, n, b);
        SweepJet j = sweep_curve_at(m.field->curve[0], t);
        Vec3 x = vec3_add(j.s, vec3_add(vec3_scale(j.n, n), vec3_scale(j.b, b)));
        if (truth < -0.15 || truth > 0.4)        // the middle of the lumen has several feet
            continue;
        VesselMemory memory = {.node = vessel->locate(vessel, x, -1)};
        VesselHit hit;
        vessel_query(vessel, 1, &x, HUGE_VAL, &memory, &hit);
        asked++, unsure += (hit.flags & VESSEL_UNSURE) != 0;
        worst = fmax(worst, fabs(hit.gap - truth));
    }
    print_message("kidney: %d points, gap off by %.4f mm at most, %d unsure\n", asked, worst, unsure);
    assert_true(asked > 800 && worst < 0.01 && unsure == 0);
    vessel->destroy(vessel);
    discard(&m);
}

static void bad_stretches_are_refused(void **state)
{
    (void)state;
    SweepShape s = {.pitch = 1, .parent = -1, .radius = 1};
    sweep_shape_line(&s, vec3(0, 0, 0), vec3(12, 0, 0), 20);
    SweepModel *m = sweep_model_of(&s, 1);
    SectionPoint circle[POINTS];
    ellipse(1, 1, 0, circle);
    const SweepStation station = {4, 0, POINTS};
    const SweepStretch good = {.from = 3,
                               .to = 8,
                               .fade = 1,
                               .station_count = 1,
                               .section = section_default_options(SECTION_RBF, SECTION_MENDED),
                               .weights = SECTION_PSP,
                               .tension = 0.5,
                               .width = 0.5};
    struct {
        SweepStretch stretch;
        SweepStation station;
        int points;
        const char *words;
    } bad[] = {{good, station, POINTS, "branch"},
               {good, station, POINTS, "reaches from"},
               {good, station, POINTS, "fades over"},
               {good, station, POINTS, "width"},
               {good, {NAN, 0, POINTS}, POINTS, "lies at t"},
               {good, {4, 0, 2}, POINTS, "points from"},
               {good, station, POINTS - 1, "points from"},
               {good, station, POINTS, "stations"}};
    bad[0].stretch.branch = 1;
    bad[1].stretch.to = 13;
    bad[2].stretch.fade = 3;
    bad[3].stretch.width = 0;
    bad[7].stretch.station_count = 2;
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        faults_clear(&faults);
        assert_false(sweep_model_set_stretches(m, 1, &bad[i].stretch, 1, &bad[i].station, bad[i].points, circle, "model", &faults));
        assert_int_equal(m->stretch_count, 0);
        assert_true(faults.count == 1 && strstr(faults.text[0], bad[i].words));
    }
    // a contour without area
    SectionPoint flat[3] = {{0, 0}, {1, 0}, {2, 0}};
    const SweepStation on_flat = {4, 0, 3};
    faults_clear(&faults);
    assert_false(sweep_model_set_stretches(m, 1, &good, 1, &on_flat, 3, flat, "model", &faults));
    assert_non_null(strstr(faults.text[0], "no section"));
    sweep_model_free(m);
}

// Mean over the angle of the length of a ray from the origin inside a polygon.
static double mean_of_rays(int count, const SectionPoint *polygon)
{
    enum { RAYS = 3600 };
    double sum = 0;
    for (int k = 0; k < RAYS; k++) {
        double c = cos(2 * PI * (k + 0.5) / RAYS), s = sin(2 * PI * (k + 0.5) / RAYS);
        for (int i = 0; i < count; i++) {
            const SectionPoint *p = &polygon[i], *q = &polygon[(i + 1) % count];
            double before = c * p->b - s * p->n, after = c * q->b - s * q->n;
            if ((before > 0) == (after > 0))
                continue;
            double share = before / (before - after), far = c * (p->n + share * (q->n - p->n)) + s * (p->b + share * (q->b - p->b));
            sum += far > 0 ? (after > before ? far : -far) : 0;
        }
    }
    return sum / RAYS;
}

// Half a ring of radii 0.4 and 1.4 with round ends: its figures are known. The contour is a polygon of 64 points, which cuts 0.0024 off its curves.
static void figures_are_those_of_the_contour(void **state)
{
    (void)state;
    static const SectionKind kinds[] = {SECTION_RASTER, SECTION_RBF, SECTION_PAS};
    for (int k = 0; k < 3; k++)
        for (int bent = 0; bent < 2; bent++) {
            Made m = make((Wanted){kinds[k], SECTION_MENDED, SECTION_PSP, false, bent, true, 0.1, 0.9, 0.1});
            double length = sweep_model_length(m.model, 0);
            SectionPoint polygon[POINTS];
            SweepSection s;
            kidney(polygon);
            assert_true(sweep_section_at(m.field, 0, 0.5 * length, &s));
            assert_int_equal(s.kind, kinds[k]);
            assert_near(s.area, 1.15 * PI, 0.03);
            assert_near(s.perimeter, 2.8 * PI, 0.06);
            assert_near(s.circularity, 4 * 1.15 / (2.8 * 2.8), 0.01);
            assert_near(s.least_diameter, 1.9, 0.02);
            assert_near(s.largest_diameter, 2.8, 0.02);
            assert_near(s.least, 0.25, 0.02);
            assert_near(s.largest, 0.5 + sqrt(0.65 * 0.65 + 0.9 * 0.9), 0.02);
            assert_near(s.mean, mean_of_rays(POINTS, polygon), 0.02);
            // outside the stretch the rows are circles of radius 1
            assert_true(sweep_section_at(m.field, 0, 0.05 * length, &s));
            assert_int_equal(s.kind, SECTION_POLAR);
            assert_near(s.area, PI, 1e-8);
            assert_near(s.perimeter, 2 * PI, 1e-8);
            assert_near(s.mean, 1, 1e-8);
            assert_near(s.least_diameter, 2, 1e-8);
            discard(&m);
        }
}

// Every point of a contour is on the branch's wall, its way is along the wall, and it goes once around; in the fade, too.
static void contours_lie_on_the_wall(void **state)
{
    (void)state;
    for (int form = SECTION_MENDED; form <= SECTION_AS_PRINTED; form++)
        for (int kidneys = 0; kidneys < 2; kidneys++) {
            Made m = make(
                (Wanted){SECTION_RASTER, (SectionForm)form, form == SECTION_MENDED ? SECTION_PSP : SECTION_CATMULL_ROM, false, true, kidneys, 0.1, 0.9, 0.2});
            double length = sweep_model_length(m.model, 0);
            for (double part = 0; part <= 1; part += 0.0625) {
                SweepContour c;
                double t = part * length;
                assert_true(sweep_contour_create(m.field, 0, t, SWEEP_CONTOUR, &c));
                SweepPlane plane = sweep_plane(m.field, 0, t);
                assert_true(polygon_area(c.count, c.point) > 2);
                double turned = 0;
                for (int i = 0; i < c.count; i++) {
                    Vec3 x = vec3_add_scaled(vec3_add_scaled(plane.s, c.point[i].n, plane.p), c.point[i].b, plane.q), g;
                    Vec3 way = vec3_add_scaled(vec3_scale(plane.p, c.way[i].n), c.way[i].b, plane.q);
                    const SectionPoint *next = &c.way[(i + 1) % c.count];
                    assert_near(vec3_dot(vec3_sub(x, plane.s), plane.normal), 0, 1e-12);
                    assert_near(value(&m, x, t, &g, NULL), 0, 1e-6);
                    assert_near(vec3_dot(g, way), 0, 1e-6);
                    turned += atan2(c.way[i].n * next->b - c.way[i].b * next->n, c.way[i].n * next->n + c.way[i].b * next->b);
                }
                assert_near(turned, 2 * PI, 1e-9);
                sweep_contour_free(&c);
            }
            discard(&m);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(derivatives_are_exact),
                                       cmocka_unit_test(rows_are_repeated),
                                       cmocka_unit_test(contact_with_a_kidney),
                                       cmocka_unit_test(bad_stretches_are_refused),
                                       cmocka_unit_test(figures_are_those_of_the_contour),
                                       cmocka_unit_test(contours_lie_on_the_wall)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
