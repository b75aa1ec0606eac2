// The field is evaluated only where a ball around one of the model's places reaches: centres of nodes for blobs, knots and points between them for swept models.
// Each voxel is judged from the place in whose ball it lies deepest.
#include "recon/surface/model_mask.h"

#include "recon/volume/volume_file.h"

#include <stdlib.h>
#include <string.h>

typedef struct Ball {
    Vec3 center;
    double radius, reach;    // [mm]
    SweepPlace place;        // of a swept model
    int node;                // of blobs
} Ball;

typedef struct Mask {
    const VesselTree *tree;
    const SweepModel *sweep;
    SweepField *field;
    Vessel *vessel;
    VesselBranches *branches;
    int balls, capacity;
    Ball *ball;
} Mask;

static void add_ball(Mask *m, Ball ball)
{
    if (m->balls == m->capacity) {
        m->capacity = m->capacity > 0 ? 2 * m->capacity : 256;
        m->ball = HEAP_GROWN(m->ball, (size_t)m->capacity, sizeof *m->ball);
    }
    m->ball[m->balls++] = ball;
}

static void add_swept(Mask *m)
{
    const SweepField *field = m->field;
    for (int i = 0; i < field->branch_count; i++) {
        double length = field->curve[i]->length;
        for (double t = 0;; t = fmin(length, t + fmax(0.4 * sweep_field_mean(field, i, t), 1e-4 * length))) {
            double largest = sweep_field_largest(field, i, t), blend = 0;
            const SweepView *view = &field->view[sweep_field_segment(field, i, t)];
            for (int k = 0; k < view->count; k++)
                blend = fmax(blend, field->fork[view->of[k].branch].delta);
            add_ball(m, (Ball){.center = sweep_curve_at(field->curve[i], t).s, .radius = largest, .reach = 1.3 * largest + blend,
                               .place = {.branch = i, .t = t, .sac = -1}});
            if (t == length)
                break;
        }
    }
    const VesselTree *sac = m->sweep->sac;
    for (int i = 0; sac && i < sac->node_count; i++)
        add_ball(m, (Ball){.center = sac->center[i], .radius = sac->radius[i], .reach = 2 * sac->radius[i], .place = {.branch = -1, .sac = i}});
}

// 0 outside, 1 + branch inside.
static int label_of(const Mask *m, const Ball *ball, Vec3 x)
{
    if (m->vessel) {
        VesselMemory memory = {.node = ball->node};
        VesselHit hit;
        vessel_query(m->vessel, 1, &x, 0.5 * ball->radius, &memory, &hit);
        if (!(hit.gap > 0) || (hit.flags & (VESSEL_OPEN_END | VESSEL_BEYOND)))
            return 0;
        int branch = hit.node >= 0 ? m->branches->of_node[hit.node] : -1;
        return 1 + (branch >= 0 ? branch : m->branches->count);
    }
    SweepBlend blend;
    sweep_field_blend(m->field, ball->place, x, &blend);
    const SweepPart *part = &blend.part[blend.largest];
    bool upstream = part->branch >= 0 && part->t < 0 && m->sweep->branch[part->branch].open_start;
    if (!(blend.f > 0) || upstream)
        return 0;
    return 1 + (part->branch >= 0 ? part->branch : m->field->branch_count);
}

static double spacing_for(const VesselTree *tree)
{
    double *radius = HEAP_ZEROED((size_t)tree->node_count, sizeof *radius);
    memcpy(radius, tree->radius, (size_t)tree->node_count * sizeof *radius);
    sort_doubles(radius, (size_t)tree->node_count);
    double spacing = radius[tree->node_count / 2] / 6;
    free(radius);
    return spacing;
}

static void fill(const Mask *m, Volume *v, double spacing)
{
    size_t voxels = (size_t)v->size[0] * (size_t)v->size[1] * (size_t)v->size[2];
    int32_t *best = HEAP_ZEROED(voxels, sizeof *best);       // 1 + ball
    for (int b = 0; b < m->balls; b++) {
        const Ball *ball = &m->ball[b];
        Vec3 middle = volume_voxel_of(v, ball->center);
        double at[3] = {middle.x, middle.y, middle.z}, reach = ball->reach / spacing;
        int low[3], high[3];
        for (int a = 0; a < 3; a++)
            low[a] = (int)fmax(0, ceil(at[a] - reach)), high[a] = (int)fmin(v->size[a] - 1, floor(at[a] + reach));
        for (int k = low[2]; k <= high[2]; k++)
            for (int j = low[1]; j <= high[1]; j++)
                for (int i = low[0]; i <= high[0]; i++) {
                    size_t n = ((size_t)k * (size_t)v->size[1] + (size_t)j) * (size_t)v->size[0] + (size_t)i;
                    Vec3 x = volume_point_of(v, vec3(i, j, k));
                    double far = vec3_distance(x, ball->center);
                    if (far > ball->reach)
                        continue;
                    const Ball *now = best[n] > 0 ? &m->ball[best[n] - 1] : NULL;
                    if (!now || ball->radius - far > now->radius - vec3_distance(x, now->center))
                        best[n] = b + 1;
                }
    }
    for (int k = 0; k < v->size[2]; k++)
        for (int j = 0; j < v->size[1]; j++)
            for (int i = 0; i < v->size[0]; i++) {
                size_t n = ((size_t)k * (size_t)v->size[1] + (size_t)j) * (size_t)v->size[0] + (size_t)i;
                if (best[n] > 0)
                    v->value[n] = (float)label_of(m, &m->ball[best[n] - 1], volume_point_of(v, vec3(i, j, k)));
            }
    free(best);
}

bool model_mask_write(const char *path, const VesselTree *tree, const char *name, const ModelMaskOptions *options, Faults *faults)
{
    enum { LABELS_MOST = 32766 };
    Mask m = {.tree = tree, .sweep = options->sweep};
    double spacing = options->spacing_mm > 0 ? options->spacing_mm : spacing_for(tree);
    Vec3 low = tree->center[0], high = low;
    m.branches = vessel_branches_create(tree);
    m.field = m.sweep ? sweep_field_create(m.sweep) : NULL;
    m.vessel = m.sweep ? NULL : model_vessel_create(tree);
    bool good = m.branches && (m.field || m.vessel);
    if (good && m.sweep)
        add_swept(&m);
    for (int i = 0; good && !m.sweep && i < tree->node_count; i++)
        add_ball(&m, (Ball){.center = tree->center[i], .radius = tree->radius[i], .reach = 2 * tree->radius[i], .node = i});
    for (int b = 0; b < m.balls; b++) {
        Vec3 c = m.ball[b].center;
        double r = m.ball[b].reach;
        low = vec3(fmin(low.x, c.x - r), fmin(low.y, c.y - r), fmin(low.z, c.z - r)), high = vec3(fmax(high.x, c.x + r), fmax(high.y, c.y + r), fmax(high.z, c.z + r));
    }
    double span[3] = {(high.x - low.x) / spacing, (high.y - low.y) / spacing, (high.z - low.z) / spacing};
    Volume *volume = NULL;
    if (good && (span[0] + 2) * (span[1] + 2) * (span[2] + 2) > 2e9) {
        faults_add(faults, name, 0, 0, "needs more than 2e9 voxels of %.3g mm; give a larger --spacing-mm", spacing);
    } else if (good && m.branches->count > LABELS_MOST) {
        faults_add(faults, name, 0, 0, "has too many branches for labels of 16 bits");
    } else if (good) {
        int size[3] = {(int)span[0] + 2, (int)span[1] + 2, (int)span[2] + 2};
        Vec3 axis[3] = {{spacing, 0, 0}, {0, spacing, 0}, {0, 0, spacing}};
        volume = volume_create(size, low, axis);
        if (volume) {
            fill(&m, volume, spacing);
            snprintf(volume->frame, sizeof volume->frame, "%s", options->frame);
        }
    }
    if (!volume && (!good || faults->count == 0))
        faults_add(faults, name, 0, 0, "cannot make a mask: not enough memory; try a larger --spacing-mm");
    good = volume && volume_save_nrrd(volume, path, "int16", faults);
    volume_free(volume);
    free(m.ball);
    if (m.vessel)
        m.vessel->destroy(m.vessel);
    sweep_field_free(m.field);
    vessel_branches_free(m.branches);
    return good;
}
