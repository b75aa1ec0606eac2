#include "bench/vessel_models.h"

#include "recon/fit/field_fit.h"
#include "recon/fit/lim_fit.h"

#include <time.h>

const ModelKind model_kind[MODEL_KINDS] = {
    {"lim", false, false, SECTION_POLAR},        {"lim-paper", false, true, SECTION_POLAR}, {"sweep", true, false, SECTION_POLAR},
    {"raster", true, false, SECTION_RASTER},     {"rbf", true, false, SECTION_RBF},         {"pas", true, false, SECTION_PAS},
    {"sweep-paper", true, true, SECTION_RASTER}, {"rbf-paper", true, true, SECTION_RBF},    {"pas-paper", true, true, SECTION_PAS},
};

static bool fit_lim(const VesselTree *tree, double voxel, int threads, FittedModel *out, Faults *faults)
{
    if (out->kind->is_printed) {
        LimFitOptions options = lim_fit_paper_options();
        options.voxel_mm = voxel > 0 ? voxel : options.voxel_mm;
        options.threads = threads;
        out->lim = lim_fit(tree, &options, NULL, faults);
        out->vessel = out->lim ? lim_vessel_create(out->lim) : NULL;
        out->numbers = out->lim ? 4 * out->lim->blob_count : 0;
        return out->vessel != NULL;
    }
    FieldFitOptions options = field_fit_default_options();
    options.voxel_mm = voxel;
    options.threads = threads;
    out->lim = field_fit(tree, &options, NULL, faults);
    out->vessel = out->lim ? field_vessel_create(out->lim) : NULL;
    out->numbers = out->lim ? 5 * out->lim->blob_count : 0;
    return out->vessel != NULL;
}

static bool fit_swept(const VesselTree *tree, double voxel, int threads, const SweepFitOptions *sweep, FittedModel *out, Faults *faults)
{
    SweepFitOptions options = out->kind->is_printed ? sweep_fit_paper_options(out->kind->section) : *sweep;
    if (!out->kind->is_printed)
        options.section = section_default_options(out->kind->section, SECTION_MENDED);
    options.threads = threads;
    options.voxel_mm = voxel;
    if (voxel > 0)
        options.section.voxel_mm = voxel;
    out->sweep = sweep_fit(tree, &options, &out->figures, faults);
    out->field = out->sweep ? sweep_field_create(out->sweep) : NULL;
    out->vessel = out->sweep ? sweep_vessel_create(out->sweep) : NULL;
    out->numbers = out->figures.numbers;
    return out->field && out->vessel;
}

bool fitted_model_create(const ModelKind *kind, const VesselTree *tree, double voxel_mm, int threads, const SweepFitOptions *sweep, FittedModel *out,
                         Faults *faults)
{
    struct timespec a, b;
    *out = (FittedModel){.kind = kind};
    clock_gettime(CLOCK_MONOTONIC, &a);
    bool good = kind->is_swept ? fit_swept(tree, voxel_mm, threads, sweep, out, faults) : fit_lim(tree, voxel_mm, threads, out, faults);
    clock_gettime(CLOCK_MONOTONIC, &b);
    out->seconds = (double)(b.tv_sec - a.tv_sec) + 1e-9 * (double)(b.tv_nsec - a.tv_nsec);
    return good;
}

void fitted_model_free(FittedModel *f)
{
    if (f->vessel)
        f->vessel->destroy(f->vessel);
    vessel_tree_free(f->lim);
    sweep_field_free(f->field);
    sweep_model_free(f->sweep);
    *f = (FittedModel){0};
}

// The branch and t where a node lies on the swept model: its nearest knot.
static SweepPlace place_of(const SweepModel *model, const VesselTree *tree, int node, Vec3 x)
{
    SweepPlace place = {.branch = 0, .sac = -1};
    double least = HUGE_VAL;
    for (int i = 0; model->sac && tree->kind[node] != NODE_VESSEL && i < model->sac->node_count; i++)
        if (model->sac_node[i] == node)
            return (SweepPlace){.branch = -1, .sac = i};
    for (int i = 0; i < model->branch_count; i++) {
        double t = 0;
        const SweepBranch *b = &model->branch[i];
        for (int k = b->first_knot; k < b->first_knot + b->knot_count; k++) {
            t += k > b->first_knot ? vec3_distance(model->knot[k], model->knot[k - 1]) : 0;
            double far = vec3_distance(model->knot[k], x) / tree->radius[model->knot_node[k]];
            if (far < least)
                least = far, place.branch = i, place.t = t;
        }
    }
    return place;
}

WallView fitted_model_look(const FittedModel *model, const VesselTree *tree, int node, Vec3 x)
{
    if (!model->field) {
        VesselMemory memory = {.node = node};
        VesselHit hit;
        vessel_query(model->vessel, 1, &x, HUGE_VAL, &memory, &hit);
        return (WallView){hit.gap, -0.5 * sym3_trace(&hit.hessian), hit.normal};
    }
    SweepBlend blend;
    sweep_field_blend(model->field, place_of(model->sweep, tree, node, x), x, &blend);
    double slope = fmax(vec3_norm(blend.gradient), 0.1);
    Vec3 normal = vec3_unit_or(blend.gradient, vec3(0, 0, 0));
    return (WallView){blend.f / slope, -0.5 * (sym3_trace(&blend.hessian) - sym3_quadratic(&blend.hessian, normal)) / slope, normal};
}
