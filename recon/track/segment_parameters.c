#include "recon/track/segment_parameters.h"

#include "base/base.h"
#include "recon/volume/blurred_edge.h"
#include "recon/volume/volume_noise.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// Blur b [mm] (standard deviation) of everything that shifted the tracked edges: the image's blur (or at least that of its voxels and the spline), the
// smoothing of a noisy volume, and the moving average along the rays.
static double edge_blur(const RbtParameters *parameters, const Volume *volume, double smoothing, const VesselTree *tree)
{
    Volume *smooth = smoothing > 0 ? volume_smoothed(volume, smoothing, 0) : NULL;
    double v2 = same_square(volume_voxel_size(volume)), image = blurred_edge_measure(smooth ? smooth : volume, tree);
    volume_free(smooth);
    return sqrt((image > 0 ? image * image : blurred_edge_grid2(v2) + smoothing * smoothing) + blurred_edge_average2(parameters->ray_smoothing_voxels, v2));
}

char *segment_parameters_text(const RbtParameters *parameters, const RbtReport *report, const Volume *volume, const VesselTree *tree)
{
    enum { LINE = 120 };
    char *text = rbt_parameters_text(parameters, volume_voxel_size(volume));
    size_t used = strlen(text), capacity = used + LINE * ((size_t)report->branch_count + 3);
    for (int i = 0; i < tree->node_count; i++)
        capacity += tree->kind[i] == NODE_ANEURYSM ? LINE : 0;
    char *longer = realloc(text, capacity);
    if (!longer)
        heap_is_empty(capacity, __FILE__);
    used += (size_t)snprintf(longer + used, capacity - used, "edge_blur_mm: %.4f\n", edge_blur(parameters, volume, report->check.smoothing_mm, tree));
    const char *head = "aneurysms_found:\n";
    for (int i = 0; i < report->branch_count; i++) {
        const RbtBranchReport *b = &report->branch[i];
        if (!b->is_aneurysm || !b->is_found)
            continue;
        used += (size_t)snprintf(longer + used, capacity - used, "%s  - {centers_mm: [", head);
        head = "";
        const char *comma = "";
        for (int k = b->first_node; k < b->first_node + b->node_count; k++)
            if (tree->kind[k] == NODE_ANEURYSM) {
                Vec3 c = tree->center[k];
                used += (size_t)snprintf(longer + used, capacity - used, "%s[%.9g, %.9g, %.9g]", comma, c.x, c.y, c.z);
                comma = ", ";
            }
        used += (size_t)snprintf(longer + used, capacity - used, "]}\n");
    }
    return longer;
}
