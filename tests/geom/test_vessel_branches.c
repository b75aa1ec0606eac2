// Branches and findings on them: a Y, a sac, narrow and wide places of known degree, tapers that are neither.
#include "geom/blobby.h"
#include "geom/vessel_findings.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

#include "near.h"

static VesselTree *chain(int count, double spacing, double (*radius)(double s))
{
    VesselTree *t = vessel_tree_create(count, 0, 0);
    for (int i = 0; i < count; i++) {
        t->center[i] = vec3(spacing * i, 0, 0);
        t->radius[i] = radius(spacing * i);
        t->direction[i] = vec3(1, 0, 0);
        t->parent[i] = i - 1;
    }
    vessel_tree_link(t);
    return t;
}

static double even(double s) { return 2 + 0 * s; }
static double narrowed(double s) { return 2 - 0.9 * exp(-0.5 * (s - 30) * (s - 30) / 4); }
static double widened(double s) { return 1 + 1.2 * exp(-0.5 * (s - 31) * (s - 31)); }
static double tapered(double s) { return 2.5 - 0.03 * s; }

static void a_y_has_two_branches(void **state)
{
    (void)state;
    // trunk 0..9, thin child 10..14 first by index, wide child 15..19; 20 a sac on the trunk, 21 a twig out of the sac
    VesselTree *t = vessel_tree_create(22, 0, 0);
    for (int i = 0; i < 22; i++) {
        t->parent[i] = i == 10 || i == 15 ? 9 : i == 20 ? 4 : i == 21 ? 20 : i - 1;
        t->radius[i] = i < 10 ? 2 : i < 15 ? 0.8 : i < 20 ? 1.5 : 3;
        t->center[i] = i < 10 ? vec3(i, 0, 0) : i < 15 ? vec3(9, i - 9, 0) : i < 20 ? vec3(i - 5, 0, 0) : i == 20 ? vec3(4, -5, 0) : vec3(4, -9, 0);
        t->direction[i] = vec3(1, 0, 0);
    }
    t->kind[20] = NODE_ANEURYSM;
    vessel_tree_link(t);
    VesselBranches *b = vessel_branches_create(t);
    assert_non_null(b);
    assert_int_equal(b->count, 3);
    assert_int_equal(b->branch[0].count, 15);   // continues through the wide child
    assert_int_equal(b->of_node[17], 0);
    assert_int_equal(b->of_node[12], 1);
    assert_int_equal(b->of_node[20], -1);
    assert_true(b->branch[1].from_node == 9 && b->branch[1].parent == 0 && b->branch[1].order == 2);
    assert_true(b->branch[2].from_node == 20 && b->branch[2].parent == 0 && b->branch[2].order == 2);
    assert_near(b->branch[0].length, 14, 1e-12);
    assert_near(b->branch[1].length, 5, 1e-12);   // from the fork's centre on
    assert_near(b->branch[0].tortuosity, 1, 1e-12);
    assert_near(b->branch[0].radius_least, 1.5, 0);
    assert_near(b->branch[0].radius_mean, (20 + 7.5) / 15, 1e-12);
    int seen[22] = {0};
    for (int i = 0; i < 21; i++)
        seen[b->node[i]]++;
    for (int i = 0; i < 22; i++)
        assert_int_equal(seen[i], i != 20);
    FindingOptions options = finding_default_options();
    int count;
    Finding *f = vessel_findings(&(ModelField){.tree = t}, b, &options, &count);
    assert_int_equal(count, 1);
    assert_true(f[0].kind == FINDING_ANEURYSM && f[0].node == 20 && f[0].branch == 0);
    assert_near(f[0].along, 4, 1e-12);
    assert_near(f[0].extent, 6, 1e-12);   // no points: its ball
    assert_true(isnan(f[0].neck));
    free(f);
    vessel_branches_free(b);
    vessel_tree_free(t);
}

static Finding *findings_of(double (*radius)(double), int *count)
{
    VesselTree *t = chain(121, 0.5, radius);
    VesselBranches *b = vessel_branches_create(t);
    FindingOptions options = finding_default_options();
    Finding *f = vessel_findings(&(ModelField){.tree = t}, b, &options, count);
    assert_non_null(f);
    vessel_branches_free(b);
    vessel_tree_free(t);
    return f;
}

static void degrees_are_those_made(void **state)
{
    (void)state;
    int count;
    free(findings_of(even, &count));
    assert_int_equal(count, 0);
    free(findings_of(tapered, &count));   // to less than half, slowly
    assert_int_equal(count, 0);
    Finding *f = findings_of(narrowed, &count);
    assert_int_equal(count, 1);
    assert_int_equal(f->kind, FINDING_STENOSIS);
    assert_near(f->along, 30, 0.51);
    assert_near(f->degree, 100 * (1 - narrowed(30.5) / 2), 0.5);   // the median of three at a peak is its neighbour
    assert_near(f->reference, 2, 0.02);
    free(f);
    f = findings_of(widened, &count);
    assert_true(count >= 1);
    for (int i = 0; i < count; i++)
        assert_int_equal(f[i].kind, FINDING_DILATATION);   // its flanks do not count as narrow places
    assert_near(f->along, 31, 0.51);
    assert_near(f->degree, 100 * (widened(31.5) - 1), 0.5);
    free(f);
}

// Beside a place of another width, the mean of both sides is not a good reference: a run must also be narrow, or wide, relative to the nearer side, by
// half the bound.
static double change_between, width_beyond;
static double beside(double s) { return s > 33 ? width_beyond : s > 20 && s < 26 ? 2 + change_between : 2; }

static void count_beside(double change, double beyond, int expected, FindingKind kind)
{
    int count, of_kind = 0;
    change_between = change, width_beyond = beyond;
    Finding *f = findings_of(beside, &count);
    for (int i = 0; i < count; i++)
        of_kind += f[i].kind == kind && f[i].along < 33;
    assert_int_equal(of_kind, expected);
    free(f);
}

static void another_width_beside_is_no_finding(void **state)
{
    (void)state;
    count_beside(0, 4.4, 0, FINDING_STENOSIS);         // 0.63 of the mean
    count_beside(-0.2, 4.4, 0, FINDING_STENOSIS);      // 0.9 of the near side: above 0.85
    count_beside(-0.4, 4.4, 1, FINDING_STENOSIS);      // 0.8 of it
    count_beside(0, 0.6, 0, FINDING_DILATATION);       // 1.54 of the mean
    count_beside(0.4, 0.6, 0, FINDING_DILATATION);     // 1.2 of the near side: below 1.25
    count_beside(0.6, 0.6, 1, FINDING_DILATATION);     // 1.3 of it
}

static void a_sac_has_the_neck_of_its_section(void **state)
{
    (void)state;
    const double r = 1.5, far = 4, sac = 3.6;
    VesselTree *t = vessel_tree_create(2, 6, 2);
    t->parent[0] = -1;
    t->center[1] = vec3(0, far, 0);
    t->kind[1] = NODE_ANEURYSM;
    for (int i = 0; i < 2; i++) {
        t->radius[i] = i ? sac : r;
        t->direction[i] = vec3(1, 0, 0);
        t->blob_center[i] = t->center[i];
        t->blob_width[i] = blob_width_for_radius(t->radius[i], 0.1);
        t->blob_offset[i + 1] = i + 1;
    }
    for (int k = 0; k < 6; k++) {
        double s = k & 1 ? -sac : sac;
        t->point[k] = vec3_add(t->center[1], vec3(k / 2 == 0 ? s : 0, k / 2 == 1 ? s : 0, k / 2 == 2 ? s : 0));
    }
    t->point_offset[2] = 6;
    vessel_tree_link(t);
    VesselBranches *b = vessel_branches_create(t);
    FindingOptions options = finding_default_options();
    int count;
    Finding *f = vessel_findings(&(ModelField){.tree = t}, b, &options, &count);
    assert_int_equal(count, 1);
    assert_near(f->extent, 2 * sac, 1e-12);
    assert_near(f->neck, 2 * sqrt(sac * sac - (far - 0.7 * r) * (far - 0.7 * r)), 1e-6);   // a sphere's section
    free(f);
    vessel_branches_free(b);
    vessel_tree_free(t);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_y_has_two_branches),
        cmocka_unit_test(another_width_beside_is_no_finding),
        cmocka_unit_test(degrees_are_those_made),
        cmocka_unit_test(a_sac_has_the_neck_of_its_section),
    };
    return cmocka_run_group_tests_name("vessel_branches", tests, NULL, NULL);
}
