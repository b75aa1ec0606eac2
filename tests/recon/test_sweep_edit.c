// Edits of swept models (recon/edit/sweep_edit.h): sections exact where they are set and unchanged beyond the neighbourhood, areas kept by smoothing, undo and
// replay to the same bits, cuts, new branches, tags, mirrored models, the box of a change, and faults. `test_sweep_edit MODEL.h5` prints the time of edits of
// that model.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "base/base.h"
#include "recon/edit/contour_terms.h"
#include "recon/edit/edit_file.h"
#include "recon/sweep_file.h"
#include "tests/geom/sweep_models.h"

#include <string.h>
#include <time.h>

static char folder[] = "/tmp/seldinger-sweep-edit-XXXXXX";
#include "tests/folder.h"

static Faults faults;

static void wavy(double t, double length, double *term)
{
    (void)length;
    term[0] = 1 + 0.01 * t, term[3] = 0.1, term[5] = 0.03 * same_sin(t), term[6] = 0.02;
}

// A bent trunk with a child. `side`: -1 mirrors it in the plane z = 0.
static SweepModel *fork_model(double side)
{
    static SweepShape shape[2];
    shape[0] = (SweepShape){.pitch = 1, .parent = -1, .open_start = true, .radius = 1, .section = wavy, .knots = 21};
    for (int i = 0; i < 21; i++)
        shape[0].knot[i] = vec3(i, 0.02 * i * i, side * 0.01 * i * i);
    shape[1] = (SweepShape){.pitch = 0.7, .parent = 0, .radius = 0.7};
    SweepModel *alone = sweep_model_of(shape, 1);
    SweepField *field = sweep_field_create(alone);
    shape[1].parent_t = field->curve[0]->knot_t[10];
    sweep_field_free(field);
    sweep_model_free(alone);
    Vec3 start = shape[0].knot[10];
    sweep_shape_line(&shape[1], start, vec3_add(start, vec3(6, 8, side * 2)), 6);
    // the frame turns with the curve, so the mirrored sections have the opposite sign of sine terms
    SweepModel *m = sweep_model_of(shape, 2);
    for (int i = 0; side < 0 && i < m->row_count; i++)
        for (int k = 1; k <= SWEEP_HARMONICS; k++)
            m->row[(size_t)i * SWEEP_TERMS + 2 * (size_t)k] *= -1;
    return m;
}

static SweepEditor *editor_of(const SweepModel *m)
{
    faults_clear(&faults);
    SweepEditor *e = sweep_editor_create(m);
    assert_non_null(e);
    return e;
}

static EditList *list_of(const char *text)
{
    EditList *list = edit_list_parse(text, strlen(text), "test.yaml", &faults);
    if (!list)
        print_error("%s\n", faults.text[0]);
    assert_non_null(list);
    return list;
}

static void run(SweepEditor *e, const char *text)
{
    EditList *list = list_of(text);
    if (!sweep_editor_replay(e, list, "test.yaml", &faults))
        print_error("%s\n", faults.text[0]);
    assert_int_equal(faults.count, 0);
    edit_list_free(list);
}

// An ellipse's contour by angle.
static void make_ellipse(double a, double b, int count, Vec3 *point)
{
    for (int i = 0; i < count; i++) {
        double theta = 2 * PI * i / count, c = same_cos(theta), s = same_sin(theta), r = 1 / sqrt(c * c / (a * a) + s * s / (b * b));
        point[i] = vec3(r * c, r * s, 0);
    }
}

static void a_contour_becomes_its_fourier_terms(void **state)
{
    (void)state;
    Vec3 point[360];
    double term[SWEEP_TERMS], given[SWEEP_TERMS] = {1.2, 0.1, -0.05, 0.2, 0.03, 0.02, 0.01, -0.03, 0.04, 0, 0.01, 0.005, 0, 0, 0.01, 0.002, -0.003}, misfit;
    // points of a curve that has only these terms, in either direction
    for (int way = 0; way < 2; way++) {
        for (int i = 0; i < 40; i++) {
            double theta = (way ? -1 : 1) * (2 * PI * i / 40 + 0.05 * same_sin(i)), r = sweep_terms_radius(given, theta);
            point[i] = vec3(r * same_cos(theta), r * same_sin(theta), 0);
        }
        assert_null(contour_terms(40, point, term, &misfit));
        for (int k = 0; k < SWEEP_TERMS; k++)
            assert_true(fabs(term[k] - given[k]) < 1e-12);
        assert_true(misfit < 1e-12);
    }
    // an ellipse: the misfit falls with the harmonics that are left out, like ((a - b)/(a + b))^(9/2) and better
    make_ellipse(1.3, 0.9, 360, point);
    assert_null(contour_terms(360, point, term, &misfit));
    assert_true(misfit < 1e-3 && fabs(sweep_terms_area(term) - PI * 1.3 * 0.9) < 1e-4);
    // a few points of a circle, unevenly apart: still the circle
    const double few[] = {0, 0.03, 1.1, 2.9, 3.7, 5.2};
    for (int i = 0; i < 6; i++)
        point[i] = vec3(1.5 * same_cos(few[i]), 1.5 * same_sin(few[i]), 0);
    assert_null(contour_terms(6, point, term, &misfit));
    assert_true(fabs(term[0] - 1.5) < 1e-9 && fabs(term[3]) < 1e-9 && misfit < 1e-9);
    // a kidney is no star
    for (int i = 0; i < 60; i++) {
        double theta = 2 * PI * i / 60;
        point[i] = vec3(2 * same_cos(theta) + 1.5 * same_cos(2 * theta), 2 * same_sin(theta) + 1.5 * same_sin(2 * theta) + 0.1, 0);
    }
    const char *wrong = contour_terms(60, point, term, &misfit);
    assert_non_null(wrong);
    assert_non_null(strstr(wrong, "expected"));
    for (int i = 0; i < 4; i++)
        point[i] = vec3(5 + (i == 1), i == 2, 0);
    assert_non_null(strstr(contour_terms(3, point, term, &misfit), "does not go around"));
}

// The section is exact at t, those at stations beside it stay, and everything beyond the stated range.
static void check_section(double t, double length)
{
    SweepModel *m = fork_model(1);
    SweepEditor *e = editor_of(m);
    Vec3 point[48];
    make_ellipse(1.4, 0.9, 48, point);
    SweepEdit edit = {.kind = EDIT_SECTION, .t = t, .count = 48, .point = point};
    EditChange change;
    assert_true(sweep_editor_do(e, &edit, "test", &change, &faults));
    double wanted[SWEEP_TERMS], term[SWEEP_TERMS], before[SWEEP_TERMS], misfit, within;
    contour_terms(48, point, wanted, &misfit);
    sweep_edit_terms(sweep_editor_model(e), 0, t, term);
    for (int k = 0; k < SWEEP_TERMS; k++)
        assert_true(fabs(term[k] - wanted[k]) < 1e-9);
    double station = sweep_edit_station(m, 0, t, &within);
    for (int i = 0; i < m->branch[0].break_count; i++) {
        double at = m->break_t[i];
        if (at == station && fabs(t - at) <= within)
            continue;
        sweep_edit_terms(m, 0, at, before);
        sweep_edit_terms(sweep_editor_model(e), 0, at, term);
        if (fabs(at - t) < 2.2)
            for (int k = 0; k < SWEEP_TERMS; k++)
                assert_true(fabs(term[k] - before[k]) < 1e-9);
    }
    assert_true(change.from <= t && change.to >= t && change.to - change.from < 9.5);
    int outside = 0;
    for (int i = 0; i <= 400; i++) {
        double at = length * i / 400;
        if (at >= change.from - 1e-9 && at <= change.to + 1e-9)
            continue;
        sweep_edit_terms(m, 0, at, before);
        sweep_edit_terms(sweep_editor_model(e), 0, at, term);
        for (int k = 0; k < SWEEP_TERMS; k++)
            assert_true(fabs(term[k] - before[k]) < 1e-14);
        outside++;
    }
    assert_true(outside > 100);
    // the box: the wall elsewhere stays to the bit of rounding
    SweepField *old = sweep_field_create(m);
    for (int i = 0; i < 2000; i++) {
        double at = length * i / 2000, theta = 2.4 * i;
        SweepJet j = sweep_curve_at(old->curve[0], at);
        Vec3 x = vec3_add_scaled(vec3_add_scaled(j.s, same_cos(theta), j.n), same_sin(theta), j.b);
        SweepBlend a, b;
        sweep_field_blend(old, (SweepPlace){.branch = 0, .t = at}, x, &a);
        sweep_field_blend(sweep_editor_field(e), (SweepPlace){.branch = 0, .t = at}, x, &b);
        bool inside = x.x >= change.low.x && x.x <= change.high.x && x.y >= change.low.y && x.y <= change.high.y && x.z >= change.low.z && x.z <= change.high.z;
        assert_true(inside || fabs(a.f - b.f) < 1e-12);
    }
    sweep_field_free(old);
    sweep_editor_free(e);
    sweep_model_free(m);
}

static void a_section_is_exact_and_local(void **state)
{
    (void)state;
    SweepModel *m = fork_model(1);
    double length = sweep_model_length(m, 0);
    // at a station, near one, between two, and at the ends
    const double place[] = {m->break_t[10], m->break_t[7] + 0.1, 0.5 * (m->break_t[12] + m->break_t[13]), 0, 0.4, length, m->break_t[1], length - 0.45};
    for (size_t i = 0; i < sizeof place / sizeof place[0]; i++)
        check_section(place[i], length);
    sweep_model_free(m);
}

static void a_section_of_its_own_points_changes_nothing(void **state)
{
    (void)state;
    SweepModel *m = fork_model(1);
    SweepEditor *e = editor_of(m);
    Vec3 point[32];
    double t = 0.5 * (m->break_t[6] + m->break_t[7]);
    sweep_edit_contour(m, 0, t, 32, point);
    assert_true(sweep_editor_do(e, &(SweepEdit){.kind = EDIT_SECTION, .t = t, .count = 32, .point = point}, "test", NULL, &faults));
    const SweepModel *after = sweep_editor_model(e);
    assert_int_equal(after->break_count, m->break_count + 1);    // inserted
    for (int i = 0; i <= 300; i++) {
        double a[SWEEP_TERMS], b[SWEEP_TERMS], at = m->break_t[m->branch[0].break_count - 1] * i / 300;
        sweep_edit_terms(m, 0, at, a);
        sweep_edit_terms(after, 0, at, b);
        for (int k = 0; k < SWEEP_TERMS; k++)
            assert_true(fabs(a[k] - b[k]) < 1e-12);
    }
    // deleting it again, too: the inserted break carries nothing
    assert_true(sweep_editor_do(e, &(SweepEdit){.kind = EDIT_DELETE_SECTION, .t = t}, "test", NULL, &faults));
    assert_int_equal(sweep_editor_model(e)->break_count, m->break_count);
    for (int i = 0; i < m->branch[0].break_count; i++) {
        double a[SWEEP_TERMS], b[SWEEP_TERMS];
        sweep_edit_terms(m, 0, m->break_t[i], a);
        sweep_edit_terms(sweep_editor_model(e), 0, m->break_t[i], b);
        for (int k = 0; k < SWEEP_TERMS; k++)
            assert_true(fabs(a[k] - b[k]) < 2e-3);
    }
    sweep_editor_free(e);
    sweep_model_free(m);
}

static void smoothing_keeps_the_area(void **state)
{
    (void)state;
    double term[SWEEP_TERMS] = {1, 0.1, 0, 0.2, 0.1, 0.05, 0, 0, 0.05}, round[SWEEP_TERMS], again[SWEEP_TERMS];
    for (int ellipse = 0; ellipse < 2; ellipse++)
        for (int s = 0; s <= 4; s++) {
            memcpy(round, term, sizeof term);
            terms_smooth(round, ellipse, s / 4.0);
            assert_true(fabs(sweep_terms_area(round) - sweep_terms_area(term)) < 1e-12);
            for (int k = 1; !ellipse && k < SWEEP_TERMS; k++)
                assert_true(fabs(round[k] - (1 - s / 4.0) * term[k]) < 1e-15);
        }
    // an ellipse stays itself: to the harmonics that are left out
    Vec3 point[360];
    double misfit;
    make_ellipse(1.2, 0.9, 360, point);
    assert_null(contour_terms(360, point, term, &misfit));
    memcpy(again, term, sizeof term);
    terms_smooth(again, true, 1);
    for (int k = 0; k < SWEEP_TERMS; k++)
        assert_true(fabs(again[k] - term[k]) < 1e-4);
    // one section of a model, exactly; a branch, in every row
    SweepModel *m = fork_model(1);
    SweepEditor *e = editor_of(m);
    double before[SWEEP_TERMS], after[SWEEP_TERMS];
    sweep_edit_terms(m, 0, m->break_t[5], before);
    assert_true(sweep_editor_do(e, &(SweepEdit){.kind = EDIT_SMOOTH, .t = m->break_t[5], .amount = 1}, "test", NULL, &faults));
    sweep_edit_terms(sweep_editor_model(e), 0, m->break_t[5], after);
    assert_true(fabs(sweep_terms_area(after) - sweep_terms_area(before)) < 1e-9 && fabs(after[3]) < 1e-9);
    run(e, "edits:\n- {edit: smooth, to: circle, strength: 0.5, branch: 0}\n");
    const SweepModel *now = sweep_editor_model(e);
    sweep_editor_free(e);
    e = editor_of(m);
    run(e, "edits:\n- {edit: smooth, to: circle, strength: 0.5}\n");
    now = sweep_editor_model(e);
    for (int i = 0; i < now->row_count; i++)
        assert_true(fabs(sweep_terms_area(&now->row[(size_t)i * SWEEP_TERMS]) - sweep_terms_area(&m->row[(size_t)i * SWEEP_TERMS])) < 1e-12);
    sweep_editor_free(e);
    sweep_model_free(m);
}

static void assert_same_model(const SweepModel *a, const SweepModel *b)
{
    assert_int_equal(a->branch_count, b->branch_count);
    assert_int_equal(a->knot_count, b->knot_count);
    assert_int_equal(a->row_count, b->row_count);
    assert_memory_equal(a->knot, b->knot, (size_t)a->knot_count * sizeof *a->knot);
    assert_memory_equal(a->break_t, b->break_t, (size_t)a->break_count * sizeof *a->break_t);
    assert_memory_equal(a->row, b->row, (size_t)a->row_count * SWEEP_TERMS * sizeof *a->row);
    for (int i = 0; i < a->branch_count; i++) {
        const SweepBranch *p = &a->branch[i], *q = &b->branch[i];
        assert_true(p->parent == q->parent && p->parent_t == q->parent_t && p->has_blend == q->has_blend && p->blend == q->blend);
        assert_memory_equal(p->tag, q->tag, sizeof p->tag);
    }
}

static const char session[] = "edits:\n"
                              "- {edit: section, branch: 0, t_mm: 4.6, contour_nb_mm: [[1.3, 0], [0, 0.8], [-1.1, 0], [0, -0.9]]}\n"
                              "- {edit: smooth, to: ellipse, strength: 0.3, branch: 0, from_mm: 3, to_mm: 9}\n"
                              "- {edit: blend, branch: 1, width: 0.25}\n"
                              "- {edit: branch, parent: 0, t_mm: 15, points_mm: [[15, 7, 2], [15, 10, 3], [16, 13, 4]], radii_mm: [0.5, 0.4, 0.3]}\n"
                              "- {edit: tag, branch: 2, end: end, as: flip}\n"
                              "- {edit: cut, branch: 1, t_mm: 6}\n"
                              "- {edit: delete_section, branch: 0, t_mm: 4.6}\n";

static void undo_and_replay_give_the_same_bits(void **state)
{
    (void)state;
    SweepModel *m = fork_model(1);
    SweepEditor *e = editor_of(m), *other = editor_of(m);
    EditList *list = list_of(session);
    EditChange change;
    for (int i = 0; i < list->count; i++)
        assert_true(sweep_editor_do(e, &list->edit[i], "test", NULL, &faults));
    // a look does not count
    assert_true(sweep_editor_try(e, &(SweepEdit){.kind = EDIT_SMOOTH, .extent = SMOOTH_TREE, .amount = 1}, &change, &faults));
    assert_true(sweep_editor_model(e)->row[3] == 0);
    assert_true(sweep_editor_try(e, NULL, &change, &faults));
    for (int i = list->count; i > 0; i--) {
        assert_true(sweep_editor_undo(e, &change));
        EditList part = {.count = i - 1, .edit = list->edit};
        sweep_editor_free(other);
        other = editor_of(m);
        assert_true(sweep_editor_replay(other, &part, "test", &faults));
        assert_same_model(sweep_editor_model(e), sweep_editor_model(other));
    }
    assert_false(sweep_editor_undo(e, &change));
    assert_ptr_equal(sweep_editor_model(e), m);
    for (int i = 0; i < list->count; i++)
        assert_true(sweep_editor_redo(e, &change));
    assert_false(sweep_editor_redo(e, &change));
    sweep_editor_free(other);
    other = editor_of(m);
    assert_true(sweep_editor_replay(other, list, "test", &faults));
    assert_same_model(sweep_editor_model(e), sweep_editor_model(other));
    // the text of the edits is the list again
    const SweepModel *result = sweep_editor_result(e);
    assert_non_null(result);
    sweep_editor_free(other);
    other = editor_of(m);
    run(other, result->edits);
    assert_same_model(sweep_editor_model(e), sweep_editor_model(other));
    // an edit after an undo forgets what was undone
    assert_true(sweep_editor_undo(e, &change));
    assert_true(sweep_editor_do(e, &list->edit[2], "test", NULL, &faults));
    assert_false(sweep_editor_redo(e, &change));
    edit_list_free(list);
    sweep_editor_free(e);
    sweep_editor_free(other);
    sweep_model_free(m);
}

static void a_saved_session_replays_to_the_same_bytes(void **state)
{
    (void)state;
    // a tree of one node is enough for a file
    VesselTree *tree = vessel_tree_create(40, 0, 0);
    for (int i = 0; i < 40; i++)
        tree->center[i] = vec3(i, 0, 0), tree->radius[i] = 1, tree->direction[i] = vec3(1, 0, 0), tree->parent[i] = i - 1;
    EditFile made = {.tree = tree, .models = {{fork_model(1)}}}, first, second;
    made.model = made.models.of[SECTION_POLAR];
    SweepEditor *e = editor_of(made.model);
    assert_true(edit_file_save(&made, e, in_folder("fit.h5"), &faults));
    EditList *list = list_of(session);
    size_t size[2];
    char *bytes[2];
    // at once, and in two sittings with an undo and a redo
    assert_true(edit_file_load(in_folder("fit.h5"), &first, &faults));
    SweepEditor *all = editor_of(first.model);
    assert_true(sweep_editor_replay(all, list, "test", &faults));
    assert_true(edit_file_save(&first, all, in_folder("a.h5"), &faults));
    SweepEditor *half = editor_of(first.model);
    EditList part = {.count = 3, .edit = list->edit}, rest = {.count = list->count - 3, .edit = list->edit + 3};
    EditChange change;
    assert_true(sweep_editor_replay(half, &part, "test", &faults) && sweep_editor_undo(half, &change) && sweep_editor_redo(half, &change));
    assert_true(edit_file_save(&first, half, in_folder("half.h5"), &faults));
    assert_true(edit_file_load(in_folder("half.h5"), &second, &faults));
    SweepEditor *later = editor_of(second.model);
    assert_true(sweep_editor_replay(later, &rest, "test", &faults));
    assert_true(edit_file_save(&second, later, in_folder("b.h5"), &faults));
    bytes[0] = whole_file_read(in_folder("a.h5"), &size[0], &faults), bytes[1] = whole_file_read(in_folder("b.h5"), &size[1], &faults);
    assert_int_equal(size[0], size[1]);
    assert_memory_equal(bytes[0], bytes[1], size[0]);
    // blend, tags and edits come back
    EditFile back;
    assert_true(edit_file_load(in_folder("b.h5"), &back, &faults));
    assert_true(back.model->branch[1].has_blend && back.model->branch[1].blend == 0.25 && back.model->branch[2].tag[1] == SWEEP_TAG_IN);
    assert_string_equal(back.model->edits, session);
    edit_file_free(&back);
    free(bytes[0]);
    free(bytes[1]);
    edit_list_free(list);
    sweep_editor_free(e), sweep_editor_free(all), sweep_editor_free(half), sweep_editor_free(later);
    edit_file_free(&first), edit_file_free(&second), edit_file_free(&made);
}

static void branches_are_cut_and_drawn(void **state)
{
    (void)state;
    SweepModel *m = fork_model(1);
    SweepEditor *e = editor_of(m);
    double length = sweep_model_length(m, 0), fork = m->branch[1].parent_t, cut = fork + 3.3;
    char text[200];
    snprintf(text, sizeof text, "edits:\n- {edit: cut, branch: 0, t_mm: %.17g}\n", cut);
    run(e, text);
    const SweepModel *now = sweep_editor_model(e);
    assert_int_equal(now->branch_count, 2);
    assert_true(fabs(sweep_model_length(now, 0) - cut) < 1e-3 && length > cut + 1);
    for (int i = 0; i <= 100; i++) {
        double a[SWEEP_TERMS], b[SWEEP_TERMS], t = cut * i / 100;
        sweep_edit_terms(m, 0, t, a);
        sweep_edit_terms(now, 0, t < sweep_model_length(now, 0) ? t : sweep_model_length(now, 0), b);
        for (int k = 0; k < SWEEP_TERMS; k++)
            assert_true(fabs(a[k] - b[k]) < 1e-3);   // the new end's t is the chord's
    }
    // below the fork the child goes, too; and drawn again, it is the last branch, round and as thick as stated
    snprintf(text, sizeof text, "edits:\n- {edit: cut, branch: 0, t_mm: %.17g}\n", fork - 2);
    run(e, text);
    assert_int_equal(sweep_editor_model(e)->branch_count, 1);
    run(e, "edits:\n- {edit: branch, parent: 0, t_mm: 5, points_mm: [[5, 2, 0], [5, 5, 0], [6, 8, 0]], radii_mm: [0.5, 0.5, 0.3]}\n");
    now = sweep_editor_model(e);
    assert_int_equal(now->branch_count, 2);
    assert_true(now->branch[1].parent == 0 && now->branch[1].parent_t == 5 && !now->branch[1].open_start);
    double term[SWEEP_TERMS], end = sweep_model_length(now, 1);
    sweep_edit_terms(now, 1, 0, term);
    assert_true(fabs(term[0] - 0.5) < 1e-12 && term[3] == 0);
    sweep_edit_terms(now, 1, end, term);
    assert_true(fabs(term[0] - 0.3) < 1e-12);
    assert_int_equal(sweep_editor_field(e)->crowded, 0);
    // tags: what the centreline suggests, then what is said
    assert_true(sweep_model_tag(now, 0, 0) == SWEEP_TAG_IN && sweep_model_tag(now, 1, 1) == SWEEP_TAG_OUT && sweep_model_tag(now, 1, 0) == SWEEP_TAG_NONE);
    run(e, "edits:\n- {edit: tag, branch: 1, end: end, as: flip}\n- {edit: tag, branch: 0, end: start, as: out}\n");
    now = sweep_editor_model(e);
    assert_true(sweep_model_tag(now, 0, 0) == SWEEP_TAG_OUT && sweep_model_tag(now, 1, 1) == SWEEP_TAG_IN);
    run(e, "edits:\n- {edit: cut, branch: 1, t_mm: 0}\n");
    assert_int_equal(sweep_editor_model(e)->branch_count, 1);
    sweep_editor_free(e);
    sweep_model_free(m);
}

static void a_mirrored_model_is_edited_alike(void **state)
{
    (void)state;
    SweepModel *m[2] = {fork_model(1), fork_model(-1)};
    SweepEditor *e[2];
    for (int side = 0; side < 2; side++) {
        e[side] = editor_of(m[side]);
        SweepJet j = sweep_curve_at(sweep_editor_field(e[side])->curve[0], 6.4);
        Vec3 point[40];
        for (int i = 0; i < 40; i++) {
            // a fixed direction in space, mirrored
            double theta = 2 * PI * i / 40, r = 1.1 + 0.2 * same_cos(theta) + 0.1 * same_sin(2 * theta);
            Vec3 tangent = vec3_unit(j.s1), up = vec3_unit(vec3_add_scaled(vec3(0, 1, 0), -tangent.y, tangent)), aside = vec3_cross(tangent, up);
            point[i] = vec3_add_scaled(vec3_add_scaled(j.s, r * same_cos(theta), up), (side ? -1 : 1) * r * same_sin(theta), aside);
        }
        SweepEdit edit = {.kind = EDIT_SECTION, .t = 6.4, .in_space = true, .count = 40, .point = point};
        assert_true(sweep_editor_do(e[side], &edit, "test", NULL, &faults));
        run(e[side], "edits:\n- {edit: smooth, to: ellipse, strength: 0.5, branch: 0}\n");
    }
    for (int i = 0; i < 200; i++) {
        double t = 3 + 0.03 * i;
        Vec3 x = vec3_add_scaled(sweep_curve_at(sweep_editor_field(e[0])->curve[0], t).s, 1, vec3(0, same_cos(i), same_sin(i))), y = vec3(x.x, x.y, -x.z);
        SweepBlend a, b;
        sweep_field_blend(sweep_editor_field(e[0]), (SweepPlace){.branch = 0, .t = t}, x, &a);
        sweep_field_blend(sweep_editor_field(e[1]), (SweepPlace){.branch = 0, .t = t}, y, &b);
        assert_true(fabs(a.f - b.f) < 1e-9);
    }
    for (int side = 0; side < 2; side++) {
        sweep_editor_free(e[side]);
        sweep_model_free(m[side]);
    }
}

static void every_fault_is_reported_and_changes_nothing(void **state)
{
    (void)state;
    static const struct {
        const char *text, *says;
    } bad[] = {{"{edit: cut, branch: 5, t_mm: 1}", "there is no branch 5; expected 0 to 1"},
               {"{edit: cut, branch: 0, t_mm: 0}", "the root cannot be removed"},
               {"{edit: cut, branch: 1, t_mm: 500}", "is beyond branch 1; expected 0 to"},
               {"{edit: blend, branch: 0, width: 1}", "springs from no fork"},
               {"{edit: tag, branch: 1, end: start, as: in}", "is a fork, not an open end"},
               {"{edit: delete_section, branch: 0, t_mm: 0}", "at an end of the branch"},
               {"{edit: delete_section, branch: 0, t_mm: 5.6}", "has no section at 5.6 mm"},
               {"{edit: section, branch: 0, t_mm: 5, contour_nb_mm: [[3, 0], [4, 0], [3, 1]]}", "does not go around"},
               {"{edit: branch, parent: 0, t_mm: 0, points_mm: [[0, 0, 0]], radii_mm: [1]}", "coincide"}};
    SweepModel *m = fork_model(1);
    char text[2000] = "edits:\n";
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++)
        snprintf(text + strlen(text), sizeof text - strlen(text), "- %s\n", bad[i].text);
    SweepEditor *e = editor_of(m);
    EditList *list = list_of(text);
    assert_false(sweep_editor_replay(e, list, "test.yaml", &faults));
    assert_int_equal(faults.count, sizeof bad / sizeof bad[0]);
    for (int i = 0; i < faults.count; i++) {
        char place[40];
        snprintf(place, sizeof place, "test.yaml:%d:", i + 2);
        assert_true(strstr(faults.text[i], bad[i].says) && strstr(faults.text[i], place));
    }
    assert_int_equal(sweep_editor_list(e)->count, 0);
    assert_ptr_equal(sweep_editor_model(e), m);
    edit_list_free(list);
    sweep_editor_free(e);
    // a sac hangs on what would be cut
    sweep_add_sac(m, 15, vec3_add(m->knot[15], vec3(0, -2, 0)), 1.5);
    e = editor_of(m);
    list = list_of("edits:\n- {edit: cut, branch: 0, t_mm: 12}\n- {edit: section, branch: 0, t_mm: 2, contour_nb_mm: [[1, 0], [0, 1], [-1, 0], [0, -1]]}\n");
    assert_false(sweep_editor_replay(e, list, "test.yaml", &faults));
    assert_true(faults.count == 1 && strstr(faults.text[0], "a sac hangs"));
    int branch;
    double t;
    assert_false(sweep_edit_place(sweep_editor_field(e), vec3_add(m->knot[15], vec3(0, -3.5, 0)), &branch, &t));
    assert_true(sweep_edit_place(sweep_editor_field(e), vec3(3, 1.2, 0), &branch, &t) && branch == 0 && fabs(t - 3) < 0.3);
    edit_list_free(list);
    sweep_editor_free(e);
    sweep_model_free(m);
}

static double cpu_ms(void) { return 1e3 * (double)clock() / CLOCKS_PER_SEC; }

// The largest and the mean time of edits of sections all over a model, in ms of CPU time.
static int measure(const char *path)
{
    EditFile file;
    faults_clear(&faults);
    if (!edit_file_load(path, &file, &faults)) {
        print_error("%s\n", faults.text[0]);
        return 2;
    }
    SweepEditor *e = editor_of(file.model);
    double most = 0, sum = 0;
    int count = 0;
    for (int i = 0; i < file.model->branch_count; i++)
        for (int k = 5; k < file.model->branch[i].break_count - 5; k += 10, count++) {
            Vec3 point[48];
            double t = file.model->break_t[file.model->branch[i].first_break + k];
            sweep_edit_contour(file.model, i, t, 48, point);
            for (int p = 0; p < 48; p++)
                point[p].x *= 1.05;
            EditChange change;
            double start = cpu_ms();
            if (!sweep_editor_do(e, &(SweepEdit){.kind = EDIT_SECTION, .branch = i, .t = t, .count = 48, .point = point}, "edit", &change, &faults))
                print_message("%s\n", faults.text[faults.count - 1]);
            double took = cpu_ms() - start;
            most = fmax(most, took), sum += took;
        }
    print_message("%d sections replaced: mean %.2f ms, largest %.2f ms (terms, rows, model, evaluation, box)\n", count, sum / count, most);
    sweep_editor_free(e);
    edit_file_free(&file);
    return 0;
}

// Half a ring with round ends around the curve's point.
static void make_kidney(int count, Vec3 *point)
{
    double outer = PI * 1.4, end = PI * 0.5, inner = PI * 0.4;
    for (int i = 0; i < count; i++) {
        double way = (outer + 2 * end + inner) * i / count, a = way / 1.4 - PI / 2, r = 1.4, up = 0;
        if (way >= outer + end + inner)
            a = (way - outer - end - inner) / 0.5 + PI / 2, r = 0.5, up = -0.9;
        else if (way >= outer + end)
            a = PI / 2 - (way - outer - end) / 0.4, r = 0.4;
        else if (way >= outer)
            a = (way - outer) / 0.5 + PI / 2, r = 0.5, up = 0.9;
        point[i] = vec3(r * same_cos(a) - 0.7, up + r * same_sin(a), 0);
    }
}

static double field_at(const SweepField *f, double t, Vec3 nb)
{
    SweepJet j = sweep_curve_at(f->curve[0], t);
    SweepPart part;
    sweep_field_branch(f, 0, vec3_add_scaled(vec3_add_scaled(j.s, nb.x, j.n), nb.y, j.b), t, &part);
    return part.f;
}

// Contours that polar terms cannot hold become a stretch of rasters: between equal ones the wall passes through their points, elsewhere it is that of the rows, and
// a tool feels the notch. Smoothing is refused there; deleting them takes the stretch away.
static void a_kidney_becomes_a_raster(void **state)
{
    (void)state;
    enum { POINTS = 64, DRAWN = 3 };
    SweepModel *m = fork_model(1);
    SweepEditor *e = editor_of(m);
    Vec3 point[POINTS];
    double t[DRAWN], within, worst = 0;
    EditChange change;
    make_kidney(POINTS, point);
    for (int i = 0; i < DRAWN; i++) {
        t[i] = sweep_edit_station(m, 0, 4 + i, &within);
        SweepEdit edit = {.kind = EDIT_SECTION, .t = t[i], .count = POINTS, .point = point};
        assert_true(sweep_editor_do(e, &edit, "test", &change, &faults));
        const SweepModel *now = sweep_editor_model(e);
        assert_int_equal(now->stretch_count, 1);
        assert_int_equal(now->stretch[0].station_count, 3 + i);
        assert_true(change.from <= now->stretch[0].from && change.to >= now->stretch[0].to && now->stretch[0].to > t[i]);
    }
    const SweepModel *now = sweep_editor_model(e);
    const SweepField *field = sweep_editor_field(e);
    for (int i = 0; i < POINTS; i++)
        worst = fmax(worst, fabs(field_at(field, t[1], point[i])));
    print_message("kidney: the wall passes by its points within %.4f mm\n", worst);
    assert_true(worst < 0.02);
    assert_true(field_at(field, t[1], vec3(-0.55, 0, 0)) < 0);
    SweepField *old = sweep_field_create(m);
    for (double at = 12; at < 20; at += 0.37) {     // rows change up to four stations away
        Vec3 nb = vec3(0.7 * same_cos(at), 0.7 * same_sin(at), 0);
        assert_true(fabs(field_at(old, at, nb) - field_at(field, at, nb)) < 1e-12);
    }
    sweep_field_free(old);
    Vessel *vessel = sweep_vessel_create(now);
    SweepJet j = sweep_curve_at(field->curve[0], t[1]);
    Vec3 x = vec3_add_scaled(j.s, -0.15, j.n);
    VesselMemory memory = {.node = vessel->locate(vessel, x, -1)};
    VesselHit hit;
    vessel_query(vessel, 1, &x, HUGE_VAL, &memory, &hit);
    assert_true(hit.gap > 0 && hit.gap < 0.25 && !(hit.flags & VESSEL_UNSURE));
    vessel->destroy(vessel);
    faults_clear(&faults);
    SweepEdit smooth = {.kind = EDIT_SMOOTH, .extent = SMOOTH_BRANCH, .branch = 0, .amount = 0.5};
    assert_false(sweep_editor_do(e, &smooth, "test", &change, &faults));
    assert_non_null(strstr(faults.text[0], "raster"));
    faults_clear(&faults);
    for (int i = 0; i < DRAWN; i++) {
        SweepEdit remove = {.kind = EDIT_DELETE_SECTION, .t = t[i]};
        assert_true(sweep_editor_do(e, &remove, "test", &change, &faults));
    }
    assert_int_equal(sweep_editor_model(e)->stretch_count, 0);
    for (int i = 0; i < DRAWN; i++)
        assert_true(sweep_editor_undo(e, &change));
    assert_int_equal(sweep_editor_model(e)->stretch[0].station_count, 2 + DRAWN);
    sweep_editor_free(e);
    sweep_model_free(m);
}

// At the ends of a branch, too: between equal contours the wall at an open inlet passes through their points, whether polar terms can hold them or not; smoothing
// is refused there. Towards a closed end a stretch fades, and the nearest polar section takes its place.
static void ends_are_drawn(void **state)
{
    (void)state;
    enum { POINTS = 64, DRAWN = 3 };
    SweepModel *m = fork_model(1);
    for (int end = 0; end < 2; end++) {
        SweepEditor *e = editor_of(m);
        const SweepBranch *b = &m->branch[0];
        Vec3 point[POINTS];
        EditChange change;
        for (int round = 0; round < 2; round++) {
            if (round == 0)
                make_kidney(POINTS, point);
            else
                make_ellipse(1.1, 0.9, POINTS, point);
            double worst = 0, t = m->break_t[b->first_break + (end ? b->break_count - 1 : 0)];
            for (int i = 0; i < DRAWN; i++) {
                double at = m->break_t[b->first_break + (end ? b->break_count - 1 - i : i)];
                SweepEdit edit = {.kind = EDIT_SECTION, .t = at, .count = POINTS, .point = point};
                assert_true(sweep_editor_do(e, &edit, "test", &change, &faults));
                const SweepModel *now = sweep_editor_model(e);
                assert_int_equal(now->stretch_count, 1);
                assert_true(change.from <= now->stretch[0].from && change.to >= now->stretch[0].to);
            }
            const SweepModel *now = sweep_editor_model(e);
            const SweepStation *drawn = &now->station[end ? now->station_count - 1 : 0];
            assert_true(drawn->t == t && drawn->point_count == POINTS && now->contour[drawn->first_point].n == point[0].x);
            for (int i = 0; i < POINTS; i++)
                worst = fmax(worst, fabs(field_at(sweep_editor_field(e), t, point[i])));
            print_message("%s at the %s: the wall passes by its points within %.4f mm\n", round ? "ellipse" : "kidney", end ? "closed end" : "inlet", worst);
            assert_true((end && round == 0) || worst < 0.02);
            faults_clear(&faults);
            SweepEdit smooth = {.kind = EDIT_SMOOTH, .extent = SMOOTH_SECTION, .t = t, .amount = 0.5};
            assert_false(sweep_editor_do(e, &smooth, "test", &change, &faults));
            assert_non_null(strstr(faults.text[0], "raster"));
            faults_clear(&faults);
        }
        sweep_editor_free(e);
    }
    sweep_model_free(m);
}

int main(int argc, char **argv)
{
    if (argc > 1)
        return measure(argv[1]);
    const struct CMUnitTest tests[] = {cmocka_unit_test(a_contour_becomes_its_fourier_terms),
                                       cmocka_unit_test(a_section_is_exact_and_local),
                                       cmocka_unit_test(a_section_of_its_own_points_changes_nothing),
                                       cmocka_unit_test(smoothing_keeps_the_area),
                                       cmocka_unit_test(undo_and_replay_give_the_same_bits),
                                       cmocka_unit_test(a_saved_session_replays_to_the_same_bytes),
                                       cmocka_unit_test(branches_are_cut_and_drawn),
                                       cmocka_unit_test(a_mirrored_model_is_edited_alike),
                                       cmocka_unit_test(a_kidney_becomes_a_raster),
                                       cmocka_unit_test(ends_are_drawn),
                                       cmocka_unit_test(every_fault_is_reported_and_changes_nothing)};
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
