// Swept models of trees, and their distance from given points, for tests. Include after cmocka.h and fitted_shape.h.
#ifndef SELDINGER_TESTS_RECON_SWEPT_SHAPE_H
#define SELDINGER_TESTS_RECON_SWEPT_SHAPE_H

#include "geom/sweep_field.h"
#include "recon/fit/sweep_fit.h"

static inline SweepModel *swept(const VesselTree *tree, SweepFitOptions options, SweepFitFigures *figures)
{
    faults_clear(&faults);
    SweepModel *model = sweep_fit(tree, &options, figures, &faults);
    if (!model)
        print_error("%s\n", faults.text[0]);
    assert_non_null(model);
    assert_true(sweep_model_validate(model, "model", &faults));
    return model;
}

// The place from which a point at the tree's node is sought: the knot nearest to it, in radii.
static inline SweepPlace swept_place(const SweepModel *model, const VesselTree *tree, Vec3 x)
{
    SweepPlace place = {.sac = -1};
    double least = HUGE_VAL;
    for (int i = 0; i < model->branch_count; i++) {
        const SweepBranch *b = &model->branch[i];
        double t = 0;
        for (int k = b->first_knot; k < b->first_knot + b->knot_count; k++) {
            t += k > b->first_knot ? vec3_distance(model->knot[k], model->knot[k - 1]) : 0;
            double far = vec3_distance(model->knot[k], x) / tree->radius[model->knot_node[k]];
            if (far < least)
                least = far, place.branch = i, place.t = t;
        }
    }
    return place;
}

// F/|grad F| [mm]; > 0 inside.
static inline double swept_distance(const SweepField *field, SweepPlace place, Vec3 x, Vec3 *normal)
{
    SweepBlend blend;
    sweep_field_blend(field, place, x, &blend);
    double slope = vec3_norm(blend.gradient);
    if (normal)
        *normal = vec3_unit(blend.gradient);
    return blend.f / slope;
}

#endif
