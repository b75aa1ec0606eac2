#include "recon/fit/fit_figures.h"

#include "base/base.h"

#include <stdlib.h>
#include <string.h>

FitFigures fit_figures(const VesselTree *model, double voxel, double seconds)
{
    int n = model->node_count;
    FitFigures figures = {.blobs = (long)model->blob_count, .seconds = seconds};
    double *sorted = HEAP_ZEROED((size_t)n, sizeof *sorted);
    for (int i = 0; i < n; i++) {
        double error = model->error[i];
        int kind = error < 0.5 * voxel ? 0 : error < voxel ? 1 : error < 2 * voxel ? 2 : 3;
        figures.class_percent[kind] += 100.0 / n;
        if (error > model->error[figures.worst_node])
            figures.worst_node = i;
    }
    figures.error_worst = model->error[figures.worst_node];
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

void fit_figures_print(FILE *out, const VesselTree *model, const FitFigures *f, double voxel)
{
    fprintf(out, "nodes          %d, %lld points\n", model->node_count, (long long)model->point_count);
    if (f->left_out > 0)
        fprintf(out, "not fitted     %ld points, in another vessel's lumen\n", f->left_out);
    fprintf(out, "blobs          %ld: %.1f per node, median %d, at most %d\n", f->blobs, (double)f->blobs / model->node_count, f->blobs_median, f->blobs_most);
    fprintf(out, "d_a            median %.4f mm, worst %.4f mm (node %d)\n", f->error_median, f->error_worst, f->worst_node);
    fprintf(out, "d_a classes    C1 < 0.5 voxel %.2f %%, C2 < 1 voxel %.2f %%, C3 < 2 voxels %.2f %%, C4 %.2f %% (voxel %g mm)\n", f->class_percent[0],
            f->class_percent[1], f->class_percent[2], f->class_percent[3], voxel);
    fprintf(out, "seconds        %.2f\n", f->seconds);
}

void fit_figures_add(cJSON *root, const VesselTree *model, const FitFigures *f, double voxel)
{
    cJSON_AddNumberToObject(root, "nodes", model->node_count);
    cJSON_AddNumberToObject(root, "points", (double)model->point_count);
    cJSON_AddNumberToObject(root, "points_left_out", (double)f->left_out);
    cJSON_AddNumberToObject(root, "blobs", (double)f->blobs);
    cJSON_AddNumberToObject(root, "blobs_per_node", (double)f->blobs / model->node_count);
    cJSON_AddNumberToObject(root, "blobs_median", f->blobs_median);
    cJSON_AddNumberToObject(root, "blobs_max", f->blobs_most);
    cJSON_AddNumberToObject(root, "error_median_mm", f->error_median);
    cJSON_AddNumberToObject(root, "error_max_mm", f->error_worst);
    cJSON_AddNumberToObject(root, "worst_node", f->worst_node);
    cJSON_AddNumberToObject(root, "voxel_mm", voxel);
    cJSON *classes = cJSON_AddArrayToObject(root, "class_percent");
    for (int i = 0; i < 4; i++)
        cJSON_AddItemToArray(classes, cJSON_CreateNumber(f->class_percent[i]));
    cJSON_AddNumberToObject(root, "seconds", f->seconds);
}
