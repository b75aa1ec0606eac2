#include "recon/fit/sweep_fit.h"

#include "recon/fit/sweep_refine.h"
#include "recon/fit/sweep_sacs.h"
#include "recon/fit/sweep_sections.h"
#include "recon/fit/sweep_stretches.h"

#include <stdlib.h>
#include <string.h>
#include <time.h>

static const double OUT = 0.5;               // [radii] points further from the wall are left out of the figures

SweepFitOptions sweep_fit_default_options(void)
{
    return (SweepFitOptions){.section = section_default_options(SECTION_POLAR, SECTION_MENDED),
                             .spacing = 1,
                             .fork_spacing = 0.4,
                             .harmonics = SWEEP_HARMONICS,
                             .rounds = 9,
                             .blend = 0.6};
}

SweepFitOptions sweep_fit_paper_options(SectionKind kind)
{
    SweepFitOptions options = sweep_fit_default_options();
    options.section = section_default_options(kind, SECTION_AS_PRINTED);
    options.fork_spacing = 1;
    options.rounds = 0;
    options.blend = 0;
    return options;
}

static bool check_options(const SweepFitOptions *o, Faults *faults)
{
    int before = faults->count;
    const struct {
        const char *name;
        double value, least, most;
    } range[] = {{"spacing", o->spacing, 0.1, 10}, {"fork spacing", o->fork_spacing, 0.1, 10}, {"harmonics", o->harmonics, 1, SWEEP_HARMONICS},
                 {"rounds", o->rounds, 0, 100},    {"voxel-mm", o->voxel_mm, 0, 100},          {"blend", o->blend, 0, 2}};
    for (size_t i = 0; i < sizeof range / sizeof range[0]; i++)
        if (!(range[i].value >= range[i].least && range[i].value <= range[i].most))
            faults_add(faults, "fit", 0, 0, "%s is %g; expected %g to %g", range[i].name, range[i].value, range[i].least, range[i].most);
    return faults->count == before;
}

static double now_seconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static void count_numbers(const SweepDraft *d, const SweepStretchFigures *stretches, SweepFitFigures *figures)
{
    const SweepModel *m = d->model;
    figures->numbers = 3 * (int64_t)m->knot_count + m->break_count;
    if (d->options->section.kind == SECTION_POLAR || stretches->numbers == 0)
        for (int64_t i = 0; i < (int64_t)m->row_count * SWEEP_TERMS; i++)
            figures->numbers += m->row[i] != 0;
    figures->numbers += stretches->numbers > 0 ? stretches->numbers : m->station_count + 2 * (int64_t)m->contour_count;
    if (m->sac)
        figures->numbers += 5 * m->sac->blob_count;
}

static bool take_figures(const SweepDraft *d, const SweepSystem *system, const SweepStretchFigures *stretches, SweepFitFigures *figures)
{
    double *value = malloc(((size_t)d->point_count + 1) * sizeof *value), sum = 0;
    if (!value)
        return false;
    for (int64_t p = 0; p < d->point_count; p++) {
        double e = fabs(system->distance[p]);
        if (!(e < OUT * d->tree->radius[d->node[p]])) {
            figures->left_out++;
            continue;
        }
        value[figures->points++] = e;
        sum += e;
    }
    if (figures->points > 0) {
        sort_doubles(value, (size_t)figures->points);
        figures->mean = sum / (double)figures->points;
        figures->p99 = value[(int64_t)(0.99 * (double)(figures->points - 1))];
        figures->most = value[figures->points - 1];
    }
    figures->noise = system->noise;
    figures->not_star_shaped = stretches->second_sheets, figures->shaped = stretches->stations, figures->mended = stretches->mended;
    for (int64_t p = 0; p < d->vessel_point_count; p++) {
        SweepJet jet = sweep_curve_at(d->curve[d->owner[p]], d->t[p]);
        double speed2 = vec3_norm2(jet.s1);
        figures->folded += speed2 - vec3_dot(vec3_sub(d->point[p], jet.s), jet.s2) < SWEEP_LEAST_D * speed2;
    }
    count_numbers(d, stretches, figures);
    free(value);
    return true;
}

// The system's distances become those of the model with its stretches. Mended ones that gain nothing are dropped.
static bool measure_stretches(SweepDraft *d, SweepSystem *system, SweepStretchFigures *stretches, Faults *faults)
{
    bool printed = d->options->section.form == SECTION_AS_PRINTED;
    if (d->options->section.kind == SECTION_POLAR && stretches->stations == 0)
        return true;
    double *before = malloc(((size_t)d->point_count + 1) * sizeof *before);
    if (!before)
        return false;
    memcpy(before, system->distance, (size_t)d->point_count * sizeof *before);
    bool good = sweep_refine(d, system, 0, faults);
    int dropped = good && !printed ? sweep_stretches_keep_better(d, system, before, stretches, faults) : 0;
    free(before);
    return good && dropped >= 0 && (dropped == 0 || sweep_refine(d, system, 0, faults));
}

static bool fit(SweepDraft *d, SweepSystem *system, SweepStretchFigures *stretches, Faults *faults)
{
    bool good = sweep_sections_lay_curves(d, system) && sweep_draft_divide(d, d->options->spacing) && sweep_sections_fit(d, system, true);
    good = good && sweep_sacs_fit(d->tree, d->options, d->model, faults) && sweep_refine(d, system, d->options->rounds, faults) &&
           sweep_stretches_fit(d, system, stretches, faults);
    return good && measure_stretches(d, system, stretches, faults);
}

SweepModel *sweep_fit(const VesselTree *tree, const SweepFitOptions *options, SweepFitFigures *figures, Faults *faults)
{
    SweepFitFigures found = {0};
    SweepDraft draft;
    SweepSystem system = {0};
    SweepStretchFigures stretches = {0};
    SweepModel *model = NULL;
    double begin = now_seconds();
    int before = faults->count;
    if (!check_options(options, faults))
        return NULL;
    if (tree->point_count < 4 || tree->kind[0] != NODE_VESSEL) {
        faults_add(faults, "fit", 0, 0, "the tree has %lld points and its root is %s; expected at least 4 points on the wall, and a vessel",
                   (long long)tree->point_count, tree->kind[0] == NODE_VESSEL ? "a vessel" : "an aneurysm");
        return NULL;
    }
    if (sweep_draft_create(&draft, tree, options) && fit(&draft, &system, &stretches, faults) && take_figures(&draft, &system, &stretches, &found) &&
        sweep_model_validate(draft.model, "fit", faults)) {
        model = draft.model;
        draft.model = NULL;
    } else if (faults->count == before) {
        faults_add(faults, "fit", 0, 0, "not enough memory");
    }
    sweep_system_free(&system);
    sweep_draft_free(&draft);
    found.seconds = now_seconds() - begin;
    if (figures)
        *figures = found;
    return model;
}
