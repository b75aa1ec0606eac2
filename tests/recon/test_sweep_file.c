// The swept model in a tree's file: a saved model is loaded unchanged, blobs and sweep live together, the same content gives the same bytes, and every violated
// rule is reported.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "base/whole_file.h"
#include "recon/phantom/shaped_tube.h"
#include "recon/sweep_file.h"
#include "recon/tree_file.h"
#include "tests/recon/fitted_shape.h"
#include "tests/recon/swept_shape.h"

#include <hdf5.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static char folder[] = "/tmp/seldinger-sweep-file-XXXXXX";
#include "tests/folder.h"

static VesselTree *tree;
static SweepModel *model;    // with a sac

static int make_all(void **state)
{
    static const char few[3][2][64] = {{"points", "16"}, {"sac_points", "300"}, {"spacing", "1"}};
    Shape *shape = make("phantom", 3, few);
    SweepFitOptions options = sweep_fit_default_options();
    options.rounds = 1;
    tree = shape_sample(shape, &faults);
    model = tree ? swept(tree, options, NULL) : NULL;
    shape_free(shape);
    return model && model->sac ? make_folder(state) : 1;
}

static int remove_all(void **state)
{
    sweep_model_free(model);
    vessel_tree_free(tree);
    return remove_folder(state);
}

// Saves the tree with a model of a kind.
static bool save(const VesselTree *of, SweepModel *swept_model, SectionKind kind, const char *path)
{
    SweepModels models = {{NULL}};
    models.of[kind] = swept_model;
    return tree_file_save_with(of, &models, NULL, path, &faults);
}

static void assert_same(const SweepModel *a, const SweepModel *b)
{
    assert_int_equal(a->branch_count, b->branch_count);
    assert_int_equal(a->knot_count, b->knot_count);
    assert_int_equal(a->break_count, b->break_count);
    assert_int_equal(a->row_count, b->row_count);
    for (int i = 0; i < a->branch_count; i++) {
        const SweepBranch *p = &a->branch[i], *q = &b->branch[i];
        assert_true(p->parent == q->parent && p->parent_t == q->parent_t && p->open_start == q->open_start && p->radius == q->radius);
        assert_true(p->first_knot == q->first_knot && p->first_break == q->first_break && p->first_row == q->first_row && p->knot_count == q->knot_count);
    }
    assert_memory_equal(a->knot, b->knot, (size_t)a->knot_count * sizeof *a->knot);
    assert_memory_equal(a->knot_node, b->knot_node, (size_t)a->knot_count * sizeof *a->knot_node);
    assert_memory_equal(a->break_t, b->break_t, (size_t)a->break_count * sizeof *a->break_t);
    assert_memory_equal(a->row, b->row, (size_t)a->row_count * SWEEP_TERMS * sizeof *a->row);
    assert_true(a->blend == b->blend);
    const VesselTree *s = a->sac, *t = b->sac;
    size_t nodes = (size_t)s->node_count, blobs = (size_t)s->blob_count;
    assert_int_equal(s->node_count, t->node_count);
    assert_int_equal(s->blob_count, t->blob_count);
    assert_memory_equal(s->center, t->center, nodes * sizeof *s->center);
    assert_memory_equal(s->radius, t->radius, nodes * sizeof *s->radius);
    assert_memory_equal(s->parent, t->parent, nodes * sizeof *s->parent);
    assert_memory_equal(a->sac_node, b->sac_node, nodes * sizeof *a->sac_node);
    assert_memory_equal(s->blob_center, t->blob_center, blobs * sizeof *s->blob_center);
    assert_memory_equal(s->blob_width, t->blob_width, blobs * sizeof *s->blob_width);
    assert_memory_equal(s->blob_amplitude, t->blob_amplitude, blobs * sizeof *s->blob_amplitude);
    assert_memory_equal(s->blob_offset, t->blob_offset, (nodes + 1) * sizeof *s->blob_offset);
}

static void save_load_is_equality(void **state)
{
    (void)state;
    faults_clear(&faults);
    assert_true(save(tree, model, SECTION_POLAR, in_folder("a.h5")));
    VesselTree *back = tree_file_load(in_folder("a.h5"), NULL, &faults);
    assert_non_null(back);
    SweepModel *swept_back = sweep_file_load(in_folder("a.h5"), SECTION_POLAR, back, &faults);
    assert_non_null(swept_back);
    assert_same(model, swept_back);
    assert_true(save(back, swept_back, SECTION_POLAR, in_folder("b.h5")));
    size_t na, nb;
    char *a = whole_file_read(in_folder("a.h5"), &na, &faults), *b = whole_file_read(in_folder("b.h5"), &nb, &faults);
    assert_int_equal(na, nb);
    assert_memory_equal(a, b, na);
    free(a);
    free(b);
    vessel_tree_free(back);
    sweep_model_free(swept_back);
}

static bool has_fault(const char *words)
{
    for (int i = 0; i < faults.count && i < FAULTS_CAPACITY; i++)
        if (strstr(faults.text[i], words))
            return true;
    print_error("wanted '%s', got '%s'\n", words, faults.count > 0 ? faults.text[0] : "no fault");
    return false;
}

static void a_file_without_the_model_says_how_to_make_it(void **state)
{
    (void)state;
    faults_clear(&faults);
    assert_true(tree_file_save(tree, NULL, in_folder("bare.h5"), &faults));
    SweepModels models;
    assert_true(sweep_models_load(in_folder("bare.h5"), tree, &models, &faults));
    for (int kind = 0; kind < SECTION_KINDS; kind++)
        assert_null(models.of[kind]);
    assert_null(sweep_file_load(in_folder("bare.h5"), SECTION_POLAR, tree, &faults));
    assert_true(has_fault("--model sweep -o"));
    faults_clear(&faults);
    assert_null(sweep_file_load(in_folder("bare.h5"), SECTION_RBF, tree, &faults));
    assert_true(has_fault("--model rbf -o"));
}

static hid_t fresh_file(const char *path)
{
    faults_clear(&faults);
    assert_true(save(tree, model, SECTION_POLAR, path));
    hid_t file = H5Fopen(path, H5F_ACC_RDWR, H5P_DEFAULT);
    assert_true(file >= 0);
    return file;
}

static void expect_fault(const char *path, const char *words)
{
    faults_clear(&faults);
    assert_null(sweep_file_load(path, SECTION_POLAR, tree, &faults));
    assert_true(has_fault(words));
}

static void missing_datasets_are_named(void **state)
{
    (void)state;
    static const char *const names[] = {"/sweep/branch/parent",
                                        "/sweep/branch/parent_t",
                                        "/sweep/branch/open_start",
                                        "/sweep/branch/radius",
                                        "/sweep/branch/knot_offset",
                                        "/sweep/branch/break_offset",
                                        "/sweep/curve/knot",
                                        "/sweep/curve/node",
                                        "/sweep/section/break_t",
                                        "/sweep/section/row",
                                        "/sweep/blend",
                                        "/sweep/sac/center",
                                        "/sweep/sac/node",
                                        "/sweep/sac/blob_center",
                                        "/sweep/sac/blob_amplitude"};
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
        hid_t file = fresh_file(in_folder("m.h5"));
        H5Ldelete(file, names[i], H5P_DEFAULT);
        H5Fclose(file);
        expect_fault(in_folder("m.h5"), names[i]);
    }
}

// Overwrites the first value of a dataset.
static void poke(hid_t file, const char *path, hid_t type, const void *value)
{
    hid_t dataset = H5Dopen2(file, path, H5P_DEFAULT), space = H5Dget_space(dataset), one = H5Screate(H5S_SCALAR);
    hsize_t start[2] = {0, 0}, count[2] = {1, 1};
    assert_true(dataset >= 0 && H5Sselect_hyperslab(space, H5S_SELECT_SET, start, NULL, count, NULL) >= 0);
    assert_true(H5Dwrite(dataset, type, one, space, H5P_DEFAULT, value) >= 0);
    H5Sclose(one);
    H5Sclose(space);
    H5Dclose(dataset);
}

static void lies_are_found(void **state)
{
    (void)state;
    const char *path = in_folder("lie.h5");
    const int32_t five = 5, many = 1 << 30;
    const int64_t seven = 7;
    const double negative = -1, nan = NAN;
    const struct {
        const char *dataset, *words;
        hid_t type;
        const void *value;
    } lie[] = {
        {"/sweep/branch/parent", "parent", H5T_NATIVE_INT32, &five},
        {"/sweep/branch/knot_offset", "offset", H5T_NATIVE_INT32, &five},
        {"/sweep/branch/break_offset", "offset", H5T_NATIVE_INT32, &five},
        {"/sweep/branch/radius", "radius", H5T_NATIVE_DOUBLE, &negative},
        {"/sweep/curve/node", "node of the tree", H5T_NATIVE_INT32, &many},
        {"/sweep/curve/knot", "/sweep/curve/knot", H5T_NATIVE_DOUBLE, &nan},
        {"/sweep/section/row", "radius", H5T_NATIVE_DOUBLE, &negative},
        {"/sweep/section/break_t", "break_t", H5T_NATIVE_DOUBLE, &negative},
        {"/sweep/blend", "blend", H5T_NATIVE_DOUBLE, &negative},
        {"/sweep/sac/node", "node of the tree", H5T_NATIVE_INT32, &many},
        {"/sweep/sac/parent", "parent", H5T_NATIVE_INT32, &five},
        {"/sweep/sac/radius", "radius", H5T_NATIVE_DOUBLE, &negative},
        {"/sweep/sac/blob_offset", "offset", H5T_NATIVE_INT64, &seven},
    };
    for (size_t i = 0; i < sizeof lie / sizeof lie[0]; i++) {
        hid_t file = fresh_file(path);
        poke(file, lie[i].dataset, lie[i].type, lie[i].value);
        H5Fclose(file);
        expect_fault(path, lie[i].words);
    }
    hid_t file = fresh_file(path);
    H5Adelete_by_name(file, "/sweep", "profile", H5P_DEFAULT);
    H5Fclose(file);
    expect_fault(path, "profile");
}

// A kidney-shaped tube has stretches with rasters; with rbf and pas models beside it in one file, each comes back as it was.
static void stretches_and_several_models_live_in_one_file(void **state)
{
    (void)state;
    VesselTree *tube = shaped_tube_sample(SHAPED_KIDNEY, 0, 1);
    SweepModels models = {{NULL}}, back;
    static const SectionKind kinds[] = {SECTION_POLAR, SECTION_RBF, SECTION_PAS};
    for (int i = 0; i < 3; i++) {
        SweepFitOptions options = kinds[i] == SECTION_PAS ? sweep_fit_paper_options(SECTION_PAS) : sweep_fit_default_options();
        if (kinds[i] == SECTION_RBF)
            options.section = section_default_options(SECTION_RBF, SECTION_MENDED);
        models.of[kinds[i]] = swept(tube, options, NULL);
        assert_true(models.of[kinds[i]]->stretch_count > 0);
    }
    faults_clear(&faults);
    assert_true(tree_file_save_with(tube, &models, NULL, in_folder("all.h5"), &faults));
    assert_true(sweep_models_load(in_folder("all.h5"), tube, &back, &faults));
    assert_null(back.of[SECTION_RASTER]);
    for (int i = 0; i < 3; i++) {
        const SweepModel *a = models.of[kinds[i]], *b = back.of[kinds[i]];
        assert_non_null(b);
        assert_true(a->stretch_count == b->stretch_count && a->station_count == b->station_count && a->contour_count == b->contour_count);
        assert_memory_equal(a->row, b->row, (size_t)a->row_count * SWEEP_TERMS * sizeof *a->row);
        assert_memory_equal(a->contour, b->contour, (size_t)a->contour_count * sizeof *a->contour);
        for (int k = 0; k < a->stretch_count; k++) {
            const SweepStretch *p = &a->stretch[k], *q = &b->stretch[k];
            assert_true(p->branch == q->branch && p->from == q->from && p->to == q->to && p->fade == q->fade && p->station_count == q->station_count);
            assert_true(p->section.kind == q->section.kind && p->section.form == q->section.form && p->weights == q->weights &&
                        p->is_straight == q->is_straight);
            assert_true(p->section.delta_mm == q->section.delta_mm && p->section.stiffness == q->section.stiffness && p->width == q->width);
        }
        for (int k = 0; k < a->station_count; k++)
            assert_true(a->station[k].t == b->station[k].t && a->station[k].point_count == b->station[k].point_count);
    }
    // every dataset of a stretch is needed, and checked
    static const char *const names[] = {"branch", "range", "kind", "parameter", "station_offset", "station_t", "contour_offset", "contour"};
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
        char path[64];
        snprintf(path, sizeof path, "/rbf/stretch/%s", names[i]);
        faults_clear(&faults);
        assert_true(tree_file_save_with(tube, &models, NULL, in_folder("cut.h5"), &faults));
        hid_t file = H5Fopen(in_folder("cut.h5"), H5F_ACC_RDWR, H5P_DEFAULT);
        H5Ldelete(file, path, H5P_DEFAULT);
        H5Fclose(file);
        assert_null(sweep_file_load(in_folder("cut.h5"), SECTION_RBF, tube, &faults));
        assert_true(has_fault(path));
    }
    sweep_models_free(&models);
    sweep_models_free(&back);
    vessel_tree_free(tube);
}

// A place's blend must be the same number in both models.
static void assert_same_field(const VesselTree *of, SweepModel *a, SweepModel *b)
{
    SweepField *field = sweep_field_create(a), *other = sweep_field_create(b);
    assert_true(field && other);
    for (int64_t p = 0; p < of->point_count; p += 11) {
        SweepPlace place = swept_place(a, of, of->point[p]);
        SweepBlend there, back;
        sweep_field_blend(field, place, of->point[p], &there);
        sweep_field_blend(other, place, of->point[p], &back);
        assert_true(there.f == back.f && vec3_distance(there.gradient, back.gradient) == 0);
    }
    sweep_field_free(field);
    sweep_field_free(other);
}

// What a fit has made is loaded, for each kind, mended and as printed. The phantom's children begin inside their parents, where no point is, and it has a sac; few
// noisy points do not surround the curve everywhere.
static void every_fit_is_loaded(void **state)
{
    (void)state;
    static const char few[2][2][64] = {{"points", "24"}, {"sac_points", "300"}}, noisy[2][2][64] = {{"points", "8"}, {"noise_mm", "0.3"}};
    int departed = 0;
    for (int noise = is_slow; noise < 2; noise++) {
        Shape *shape = make(noise ? "y" : "phantom", 2, noise ? noisy : few);
        VesselTree *sampled = shape_sample(shape, &faults);
        for (int kind = 0; kind < SECTION_KINDS; kind++)
            for (int printed = 0; printed < (kind == SECTION_POLAR ? 1 : 2); printed++) {
                SweepFitOptions options = printed ? sweep_fit_paper_options((SectionKind)kind) : sweep_fit_default_options();
                SweepFitFigures figures;
                if (!printed)
                    options.section = section_default_options((SectionKind)kind, SECTION_MENDED);
                SweepModel *there = swept(sampled, options, &figures);
                assert_true(save(sampled, there, (SectionKind)kind, in_folder("fit.h5")));
                SweepModel *back = sweep_file_load(in_folder("fit.h5"), (SectionKind)kind, sampled, &faults);
                print_message("%s, %s %s: %d of %d sections depart from the method, mean %.4f, most %.4f mm%s%s\n", noise ? "y" : "phantom",
                              section_kind_name[kind], printed ? "as printed" : "mended", figures.mended, there->station_count, figures.mean, figures.most,
                              back ? "" : "; ", back ? "" : faults.text[0]);
                assert_non_null(back);
                assert_same_field(sampled, there, back);
                assert_true(printed || figures.mended == 0);
                departed += figures.mended;
                sweep_model_free(there);
                sweep_model_free(back);
            }
        vessel_tree_free(sampled);
        shape_free(shape);
    }
    assert_true(departed > 0);
}

static void every_part_of_a_file_is_refused(void **state)
{
    (void)state;
    H5Fclose(fresh_file(in_folder("cut.h5")));
    size_t length;
    char *bytes = whole_file_read(in_folder("cut.h5"), &length, &faults);
    for (size_t n = 0; n < length; n += length / 100) {
        faults_clear(&faults);
        assert_null(sweep_file_parse(bytes, n, "cut.h5", SECTION_POLAR, tree, &faults));
        assert_true(faults.count > 0);
    }
    free(bytes);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(save_load_is_equality),
        cmocka_unit_test(a_file_without_the_model_says_how_to_make_it),
        cmocka_unit_test(missing_datasets_are_named),
        cmocka_unit_test(lies_are_found),
        cmocka_unit_test(every_part_of_a_file_is_refused),
        cmocka_unit_test(stretches_and_several_models_live_in_one_file),
        cmocka_unit_test(every_fit_is_loaded),
    };
    return cmocka_run_group_tests(tests, make_all, remove_all);
}
