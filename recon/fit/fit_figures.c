#include "recon/fit/fit_figures.h"

#include "base/base.h"
#include "recon/sweep_file.h"

#include <stdlib.h>
#include <string.h>

FitFigures fit_figures(const ModelField *field, double voxel, double seconds)
{
    const VesselTree *model = field->tree;
    int n = model->node_count, worst = 0;
    FitFigures figures = {.blobs = (long)model->blob_count, .left_out = (long)field->left_out, .seconds = seconds};
    double *sorted = HEAP_ZEROED((size_t)n, sizeof *sorted);
    for (int i = 0; i < n; i++) {
        double error = model->error[i];
        int kind = error < 0.5 * voxel ? 0 : error < voxel ? 1 : error < 2 * voxel ? 2 : 3;
        figures.class_percent[kind] += 100.0 / n;
        if (error > model->error[worst])
            worst = i;
    }
    figures.error_worst = model->error[worst];
    figures.worst_node = model_field_file_node(field, worst);
    memcpy(sorted, model->error, (size_t)n * sizeof *sorted);
    sort_doubles(sorted, (size_t)n);
    figures.error_median = sorted[n / 2];
    for (int i = 0; i < n; i++)
        sorted[i] = (double)(model->blob_offset[i + 1] - model->blob_offset[i]);
    sort_doubles(sorted, (size_t)n);
    figures.blobs_median = (int)sorted[n / 2];
    figures.blobs_most = (int)sorted[n - 1];
    free(sorted);
    return figures;
}

void fit_figures_print(FILE *out, const ModelField *field, const FitFigures *f, double voxel)
{
    const VesselTree *model = field->tree;
    fprintf(out, "nodes          %d%s, %lld points\n", model->node_count, field->swept ? " along the branches" : "", (long long)model->point_count);
    if (f->left_out > 0)
        fprintf(out, "not fitted     %ld points, in another vessel's lumen\n", f->left_out);
    if (f->blobs > 0)
        fprintf(out, "blobs          %ld: %.1f per node, median %d, at most %d\n", f->blobs, (double)f->blobs / model->node_count, f->blobs_median,
                f->blobs_most);
    fprintf(out, "d_a            median %.4f mm, worst %.4f mm (node %d)\n", f->error_median, f->error_worst, f->worst_node);
    fprintf(out, "d_a classes    C1 < 0.5 voxel %.2f %%, C2 < 1 voxel %.2f %%, C3 < 2 voxels %.2f %%, C4 %.2f %% (voxel %g mm)\n", f->class_percent[0],
            f->class_percent[1], f->class_percent[2], f->class_percent[3], voxel);
    if (f->seconds > 0)
        fprintf(out, "seconds        %.2f\n", f->seconds);
}

void fit_figures_add(cJSON *root, const ModelField *field, const FitFigures *f, double voxel)
{
    const VesselTree *model = field->tree;
    cJSON_AddNumberToObject(root, "nodes", model->node_count);
    cJSON_AddNumberToObject(root, "points", (double)model->point_count);
    cJSON_AddNumberToObject(root, "points_left_out", (double)f->left_out);
    if (!field->swept) {
        cJSON_AddNumberToObject(root, "blobs", (double)f->blobs);
        cJSON_AddNumberToObject(root, "blobs_per_node", (double)f->blobs / model->node_count);
        cJSON_AddNumberToObject(root, "blobs_median", f->blobs_median);
        cJSON_AddNumberToObject(root, "blobs_max", f->blobs_most);
    }
    cJSON_AddNumberToObject(root, "error_median_mm", f->error_median);
    cJSON_AddNumberToObject(root, "error_max_mm", f->error_worst);
    cJSON_AddNumberToObject(root, "worst_node", f->worst_node);
    cJSON_AddNumberToObject(root, "voxel_mm", voxel);
    cJSON *classes = cJSON_AddArrayToObject(root, "class_percent");
    for (int i = 0; i < 4; i++)
        cJSON_AddItemToArray(classes, cJSON_CreateNumber(f->class_percent[i]));
    cJSON_AddNumberToObject(root, "seconds", f->seconds);
}

void sweep_figures_print(FILE *out, const SweepModel *model, SectionKind kind, const SweepFitFigures *f)
{
    fprintf(out,
            "swept model with sections of kind %s: %d branches, %d sections, %lld numbers, %.1f s\n"
            "distance of %lld points from the wall: mean %.4f, 99 %% %.4f, largest %.4f mm; noise %.4f mm\n"
            "%lld points left out (another vessel's lumen, outliers), %lld beyond the focal line of a bend, %lld where a section is not star-shaped\n"
            "%d sections are stored as %s: a polar section does not hold them\n",
            section_kind_name[kind], model->branch_count, model->row_count, (long long)f->numbers, f->seconds, (long long)f->points, f->mean, f->p99, f->most,
            f->noise, (long long)f->left_out, (long long)f->folded, (long long)f->not_star_shaped, f->shaped,
            section_kind_name[kind == SECTION_POLAR ? SECTION_RASTER : kind]);
    if (f->mended > 0)
        fprintf(out, "%d sections depart from the published method: the points beside them give no contour around the centreline\n", f->mended);
}

void sweep_figures_add(cJSON *root, const SweepModel *model, SectionKind kind, const SweepFitFigures *f)
{
    cJSON_AddStringToObject(root, "model", sweep_file_group(kind));
    cJSON_AddNumberToObject(root, "branches", model->branch_count);
    cJSON_AddNumberToObject(root, "sections", model->row_count);
    cJSON_AddNumberToObject(root, "numbers", (double)f->numbers);
    cJSON_AddNumberToObject(root, "points_near", (double)f->points);
    cJSON_AddNumberToObject(root, "mean_mm", f->mean);
    cJSON_AddNumberToObject(root, "p99_mm", f->p99);
    cJSON_AddNumberToObject(root, "max_mm", f->most);
    cJSON_AddNumberToObject(root, "noise_mm", f->noise);
    cJSON_AddNumberToObject(root, "folded", (double)f->folded);
    cJSON_AddNumberToObject(root, "not_star_shaped", (double)f->not_star_shaped);
    cJSON_AddNumberToObject(root, "shaped_sections", f->shaped);
    cJSON_AddNumberToObject(root, "mended_sections", f->mended);
}
