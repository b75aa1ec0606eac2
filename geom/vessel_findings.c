#include "geom/vessel_findings.h"

#include "base/base.h"
#include "geom/blobby.h"

#include <stdlib.h>
#include <string.h>

FindingOptions finding_default_options(void) { return (FindingOptions){.narrow = 0.7, .wide = 1.5}; }

static double median(double *value, int count)
{
    sort_doubles(value, (size_t)count);
    return 0.5 * (value[(count - 1) / 2] + value[count / 2]);
}

typedef struct Profile {     // of one branch
    int count;
    const double *along;
    double *radius;          // (count) smoothed
    double *reference;       // (count) 0: unknown
    double *least, *most;    // (count) of the medians of the two sides
    double *scratch;         // (count)
} Profile;

static double flank(const Profile *p, double low, double high)
{
    int n = 0;
    for (int k = 0; k < p->count && p->along[k] <= high; k++)
        if (p->along[k] >= low)
            p->scratch[n++] = p->radius[k];
    return n >= 3 ? median(p->scratch, n) : 0;
}

static void fill_profile(Profile *p, const VesselTree *tree, const VesselBranches *branches, const VesselBranch *branch)
{
    const int *node = branches->node + branch->first;
    p->count = branch->count;
    p->along = branches->along + branch->first;
    for (int k = 0; k < p->count; k++) {
        double a = tree->radius[node[k > 0 ? k - 1 : k]], b = tree->radius[node[k]], c = tree->radius[node[k + 1 < p->count ? k + 1 : k]];
        p->radius[k] = fmax(fmin(a, b), fmin(fmax(a, b), c));
    }
    for (int k = 0; k < p->count; k++)
        p->scratch[k] = tree->radius[node[k]];
    double scale = median(p->scratch, p->count), ostium = branch->from_node >= 0 ? tree->radius[branch->from_node] : 0;
    for (int k = 0; k < p->count; k++) {
        double s = p->along[k], before = flank(p, fmax(s - 8 * scale, ostium), s - 2 * scale), after = flank(p, s + 2 * scale, s + 8 * scale);
        p->reference[k] = s > ostium && before > 0 && after > 0 ? 0.5 * (before + after) : 0;
        p->least[k] = fmin(before, after);
        p->most[k] = fmax(before, after);
    }
}

// Runs of nodes beyond the threshold, each with its extreme.
static int find_runs(const Profile *p, const VesselBranches *branches, int index, FindingKind kind, double bound, Finding *found)
{
    int count = 0, node_of = branches->branch[index].first;
    for (int k = 0; k < p->count; k++) {
        int from = k, most = k;
        double furthest = 0;
        for (; k < p->count && p->reference[k] > 0; k++) {
            double ratio = p->radius[k] / p->reference[k], beyond = kind == FINDING_STENOSIS ? bound - ratio : ratio - bound;
            // next to a widening the mean is large: require half the deviation relative to each side's median too
            double half = 0.5 * (1 + bound);
            if (!(beyond > 0) || (kind == FINDING_STENOSIS ? p->radius[k] > half * p->least[k] : p->radius[k] < half * p->most[k]))
                break;
            if (beyond > furthest)
                furthest = beyond, most = k;
        }
        if (k == from)
            continue;
        double ratio = p->radius[most] / p->reference[most];
        found[count++] = (Finding){.kind = kind,
                                   .branch = index,
                                   .node = branches->node[node_of + most],
                                   .along = p->along[most],
                                   .length = p->along[k - 1] - p->along[from],
                                   .radius = p->radius[most],
                                   .reference = p->reference[most],
                                   .degree = 100 * fabs(1 - ratio),
                                   .neck = NAN};
    }
    return count;
}

// The radius of the circle with the area of the model's section perpendicular to `axis` at `at`; 0 if `at` is outside, HUGE_VAL if the section is not closed.
static double section_radius(const ModelField *model, int node, Vec3 at, Vec3 axis, double longest)
{
    enum { RAYS = 36 };
    Vec3 e1 = vec3_normal_to(axis), e2 = vec3_cross(axis, e1);
    double sum = 0;
    if (!(model_field_at(model, node, at, NULL) > 0))
        return 0;
    for (int i = 0; i < RAYS; i++) {
        double angle = 2 * PI * i / RAYS, step = longest / 64, low = 0, high = step;
        Vec3 ray = vec3_add(vec3_scale(e1, same_cos(angle)), vec3_scale(e2, same_sin(angle)));
        while (high < longest && model_field_at(model, node, vec3_add_scaled(at, high, ray), NULL) > 0)
            low = high, high += step;
        if (!(high < longest))
            return HUGE_VAL;
        for (int k = 0; k < 30; k++) {
            double middle = 0.5 * (low + high);
            *(model_field_at(model, node, vec3_add_scaled(at, middle, ray), NULL) > 0 ? &low : &high) = middle;
        }
        sum += low * low / RAYS;
    }
    return sqrt(sum);
}

// Sections perpendicular to the line from the vessel's axis to the sac's middle, starting at the vessel's wall.
static double neck_width(const ModelField *model, int sac, int vessel)
{
    const VesselTree *tree = model->tree;
    enum { SECTIONS = 40 };
    Vec3 to = vec3_sub(tree->center[sac], tree->center[vessel]);
    double distance = vec3_norm(to), start = 0.7 * tree->radius[vessel], least = HUGE_VAL;
    if ((!model->swept && blobby_of(tree, sac).count < 1) || !(distance > start))
        return NAN;
    Vec3 axis = vec3_scale(to, 1 / distance);
    for (int i = 0; i <= SECTIONS; i++) {
        double s = start + (distance - start) * i / SECTIONS,
               r = section_radius(model, sac, vec3_add_scaled(tree->center[vessel], s, axis), axis, 3 * tree->radius[sac]);
        least = r > 0 ? fmin(least, r) : least;
    }
    return least < HUGE_VAL ? 2 * least : NAN;
}

static double extent_of(const VesselTree *tree, const int *top, int sac)
{
    // farthest pair by a few iterations from a point to its farthest point: accurate enough for a size
    Vec3 at = tree->center[sac];
    double extent = 0;
    for (int hop = 0; hop < 6; hop++) {
        double far = -1;
        Vec3 to = at;
        for (int i = 0; i < tree->node_count; i++)
            for (int64_t k = tree->point_offset[i]; top[i] == top[sac] && k < tree->point_offset[i + 1]; k++) {
                double d = vec3_distance(at, tree->point[k]);
                if (d > far)
                    far = d, to = tree->point[k];
            }
        extent = hop > 0 ? fmax(extent, far) : extent;
        at = to;
    }
    return extent > 0 ? extent : 2 * tree->radius[sac];
}

// One finding for each connected group of aneurysm nodes, at its largest node.
static int find_sacs(const ModelField *model, const VesselBranches *branches, int *top, Finding *found)
{
    const VesselTree *tree = model->tree;
    int count = 0;
    for (int i = 0; i < tree->node_count; i++) {   // top[i]: the first node of i's group
        int p = tree->parent[i];
        top[i] = tree->kind[i] != NODE_ANEURYSM ? -1 : p >= 0 && tree->kind[p] == NODE_ANEURYSM ? top[p] : i;
        if (top[i] == i) {
            int of = p >= 0 ? branches->of_node[p] : -1;
            double along = 0;
            for (int k = 0; of >= 0 && k < branches->branch[of].count; k++)
                if (branches->node[branches->branch[of].first + k] == p)
                    along = branches->along[branches->branch[of].first + k];
            found[count++] = (Finding){.kind = FINDING_ANEURYSM,
                                       .branch = of,
                                       .node = i,
                                       .along = along,
                                       .radius = tree->radius[i],
                                       .reference = p >= 0 ? tree->radius[p] : 0,
                                       .neck = NAN};
        }
    }
    for (int i = 0; i < tree->node_count; i++)
        for (int k = 0; k < count; k++)
            if (top[i] == found[k].node && i != found[k].node && tree->radius[i] > found[k].radius)
                found[k].radius = tree->radius[i];
    for (int k = 0; k < count; k++) {
        int first = found[k].node, vessel = tree->parent[first];
        found[k].extent = extent_of(tree, top, first);
        if (model_field_exists(model) && vessel >= 0)
            found[k].neck = neck_width(model, first, vessel);
    }
    return count;
}

Finding *vessel_findings(const ModelField *model, const VesselBranches *branches, const FindingOptions *options, int *count)
{
    const VesselTree *tree = model->tree;
    size_t n = (size_t)tree->node_count;
    double *numbers = malloc(5 * n * sizeof *numbers);
    Profile p = {.radius = numbers};
    int *top = malloc(n * sizeof *top);
    Finding *found = malloc((2 * n + 1) * sizeof *found);   // runs of the same kind are separated by at least one node
    bool good = numbers && top && found;
    *count = 0;
    if (good)
        p.reference = numbers + n, p.least = numbers + 2 * n, p.most = numbers + 3 * n, p.scratch = numbers + 4 * n;
    for (int b = 0; good && b < branches->count; b++) {
        fill_profile(&p, tree, branches, &branches->branch[b]);
        *count += find_runs(&p, branches, b, FINDING_STENOSIS, options->narrow, found + *count);
        *count += find_runs(&p, branches, b, FINDING_DILATATION, options->wide, found + *count);
    }
    if (good)
        *count += find_sacs(model, branches, top, found + *count);
    free(numbers);
    free(top);
    if (!good) {
        free(found);
        return NULL;
    }
    return found;
}
