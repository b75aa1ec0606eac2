// The parameters of the tracking: defaults, the paper's values, and the table used by trace files and --help.
#include "recon/track/rbt_parameters.h"

#include "base/base.h"
#include "recon/volume/volume.h"

#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>

// Kerrien et al. 2017, table 1 and section 3; all our extensions are off.
RbtParameters rbt_paper_parameters(void)
{
    return (RbtParameters){
        .p_inl = 0.7,
        .r_t = 0.1,
        .n_r = 162,
        .n_d = 81,
        .n_p = 128,
        .n_min = 220,
        .n_max = 500,
        .s = 0.5,
        .ray_length = 3,
        .height_share = 0.75,
        .back_step = 0.1,
        .relaxed = 0.5,
        .powell = 1,
        .turn_deg = 180,
        .overlap = 0.5,
        .max_length_mm = 1000,
        .aneurysm_rays = 162,
        .aneurysm_reach_mm = 15,
        .seed = 1,
        .find_aneurysms = 1,
        .residue = 0.17,
    };
}

RbtParameters rbt_default_parameters(void)
{
    RbtParameters p = rbt_paper_parameters();
    p.n_p = 64;
    p.powell = 0;
    p.r_t_voxels = 0.4;
    p.r_t_second = 0.2;
    p.refits = 3;
    p.retry_steps[0] = 1.7;
    p.retry_steps[1] = 2.4;
    p.retry_steps[2] = 3.1;
    p.retry_count = 3;
    p.retry_radius = 0.3;
    p.retry_contrast = 0.6;
    p.ray_smoothing_voxels = 1;
    p.ray_edge = 0.1;
    p.contrast = 0.3;
    p.turn_deg = 110;
    p.look_ahead = 12;
    p.bone_hu = (double)CT_NUMBER_BONE;
    p.aneurysm_rays = 642;
    p.ostia = 1;
    return p;
}

#define FIELD(NAME) offsetof(RbtParameters, NAME)
const RbtParameterName rbt_parameter_table[] = {
    {"p_inl", FIELD(p_inl), 0.05, 1, false, "inlier rate above which a cylinder is valid"},
    {"r_t", FIELD(r_t), 0.001, 1, false, "inlier threshold, as a fraction of the predicted radius"},
    {"N_r", FIELD(n_r), 42, 2562, true, "number of rays from a centre: 42, 162, 642 or 2562"},
    {"N_d", FIELD(n_d), 21, 321, true, "number of axis directions: 21, 81 or 321"},
    {"N_p", FIELD(n_p), 8, 1024, true, "number of samples along a ray"},
    {"N_min", FIELD(n_min), 1, 100000, true, "least number of RANSAC trials for a direction"},
    {"N_max", FIELD(n_max), 1, 100000, true, "largest number of RANSAC trials for a direction"},
    {"s", FIELD(s), 0.05, 2, false, "step, in half heights of a node"},
    {"ray_length", FIELD(ray_length), 1.1, 10, false, "length of a ray, in predicted radii"},
    {"height_share", FIELD(height_share), 0.1, 1, false, "fraction of the inliers that a node's height encloses"},
    {"back_step", FIELD(back_step), 0, 1, false, "least distance of a centre from the centreline tracked before, in radii"},
    {"relaxed", FIELD(relaxed), 0.1, 1, false, "fraction of p_inl that the best cylinder needs if none is valid"},
    {"powell", FIELD(powell), 0, 1, true, "1: refine by Powell's method, 0: by Gauss-Newton"},
    {"r_t_voxels", FIELD(r_t_voxels), 0, 5, false, "lower bound of the inlier threshold, in voxels"},
    {"r_t_second", FIELD(r_t_second), 0, 1, false, "inlier threshold of a second attempt, as a fraction of the radius; 0: none"},
    {"refits", FIELD(refits), 0, 20, true, "number of repeated selections of the consensus set with the refined axis"},
    {"retry_radius", FIELD(retry_radius), 0, 1, false, "largest relative change of the radius over a longer step"},
    {"retry_contrast", FIELD(retry_contrast), 0, 1, false, "least contrast after a longer step, as a fraction of the branch's"},
    {"ray_smoothing_voxels", FIELD(ray_smoothing_voxels), 0, 10, false, "width of the moving average along a ray, in voxels"},
    {"ray_edge", FIELD(ray_edge), 0, 1, false, "rays whose fall per voxel is below this fraction of the brightness range are discarded"},
    {"contrast", FIELD(contrast), 0, 1, false, "least contrast of a node, as a fraction of its predecessors'"},
    {"turn_deg", FIELD(turn_deg), 10, 180, false, "largest turn of the axis within two radii of path"},
    {"look_ahead", FIELD(look_ahead), 0, 40, false, "radii ahead to search for the continuation of a branch that widens or ends; 0: none"},
    {"overlap", FIELD(overlap), 0, 1, false, "a branch ends this many radii from the centre of a node of another branch"},
    {"max_length_mm", FIELD(max_length_mm), 1, 100000, false, "largest length of a branch"},
    {"bone_hu", FIELD(bone_hu), 0, 4000, false, "in a CT, CT number above which connected voxels are bone, which is not tracked; 0: nothing is bone"},
    {"aneurysm_rays", FIELD(aneurysm_rays), 42, 2562, true, "number of rays from each centre of an aneurysm: 42, 162, 642 or 2562"},
    {"aneurysm_reach_mm", FIELD(aneurysm_reach_mm), 0.1, 1000, false, "length of the rays from an aneurysm's centres"},
    {"automatic", FIELD(automatic), 0, 1, true, "1: track the whole tree from the first start; 0: only the branches in the trace file"},
    {"find_aneurysms", FIELD(find_aneurysms), 0, 1, true, "1: also search for aneurysms (automatic: 1)"},
    {"residue", FIELD(residue), 0.05, 0.5, false, "least contrast of a vessel found automatically, as a fraction of its parent's"},
    {"ostia", FIELD(ostia), 0, 1, true, "1: add nodes to the links of branches if the image supports them; 0: do not"},
    {"seed", FIELD(seed), 0, 9007199254740991.0, true, "seed of the random numbers"},
};
const int rbt_parameter_count = sizeof rbt_parameter_table / sizeof rbt_parameter_table[0];

char *rbt_parameters_text(const RbtParameters *parameters, double voxel_mm)
{
    size_t capacity = 64 * (size_t)(rbt_parameter_count + RBT_MAX_RETRIES + 1), used = 0;
    char *text = HEAP_ZEROED(capacity, 1);
    used += (size_t)snprintf(text, capacity, "voxel_mm: %.17g\n", voxel_mm);
    for (int i = 0; i < rbt_parameter_count; i++) {
        double value = *(const double *)(const void *)((const char *)parameters + rbt_parameter_table[i].offset);
        used += (size_t)snprintf(text + used, capacity - used, "%s: %.17g\n", rbt_parameter_table[i].name, value);
    }
    used += (size_t)snprintf(text + used, capacity - used, "retry_steps: [");
    for (int i = 0; i < parameters->retry_count; i++)
        used += (size_t)snprintf(text + used, capacity - used, "%s%.17g", i ? ", " : "", parameters->retry_steps[i]);
    snprintf(text + used, capacity - used, "]\n");
    return text;
}

char *rbt_parameters_help(void)
{
    enum { LINE = 260 };
    RbtParameters ours = rbt_default_parameters(), paper = rbt_paper_parameters();
    size_t capacity = LINE * (size_t)(rbt_parameter_count + 2), used = 0;
    char *text = HEAP_ZEROED(capacity, 1);
    for (int i = 0; i < rbt_parameter_count; i++) {
        const RbtParameterName *p = &rbt_parameter_table[i];
        double a = *(const double *)(const void *)((const char *)&ours + p->offset), b = *(const double *)(const void *)((const char *)&paper + p->offset);
        used += (size_t)snprintf(text + used, capacity - used, "  %-20s %s (%g; %g)\n", p->name, p->meaning, a, b);
    }
    snprintf(text + used, capacity - used, "  %-20s %s\n", "retry_steps", "multiples of the step that are tried after a failed step ([1.7, 2.4, 3.1]; [])");
    return text;
}
