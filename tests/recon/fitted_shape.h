// Shapes and their models for the tests of the fit, with the faults in `faults`. Include after cmocka.h.
#ifndef SELDINGER_TESTS_RECON_FITTED_SHAPE_H
#define SELDINGER_TESTS_RECON_FITTED_SHAPE_H

#include "recon/fit/lim_fit.h"
#include "recon/phantom/phantom.h"

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
static const bool is_slow = true;    // only the small shapes: accuracy is measured in the release build
#else
static const bool is_slow = false;
#endif

static Faults faults;

static inline Shape *make(const char *name, int count, const char (*option)[2][64])
{
    faults_clear(&faults);
    Shape *shape = shape_create(name, count, option, "test", &faults);
    assert_non_null(shape);
    return shape;
}

static inline VesselTree *fit_of(const Shape *shape, LimFitOptions options)
{
    VesselTree *tree = shape_sample(shape, &faults), *model = lim_fit(tree, &options, NULL, &faults);
    assert_non_null(model);
    assert_true(vessel_tree_validate(model, "model", &faults));
    vessel_tree_free(tree);
    return model;
}

#endif
