// The growing tree of hypotheses: `leaf` are templates at the same number of steps from `root`, the branch's last node. Each turn the leaves are extended by
// a step, the path of best mean score is chosen, the root moves one node along it, and leaves that do not descend from it are dropped.
#include "bench/mht_track.h"

#include "base/same_math.h"
#include "bench/mht_template.h"
#include "recon/volume/bspline.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { CIRCLE = 16, CONTRAST_MEMORY = 8, MAX_LEAVES = 24, MAX_ANGLES = 10, MAX_DEPTH = 10, MAX_NODES = 200000 };

MhtParameters mht_paper_parameters(void)
{
    return (MhtParameters){.step = 0.1,
                           .window = 5,
                           .radius_min = 0.25,
                           .radius_max = 1.25,
                           .radius_change = 0.1,
                           .max_angle_deg = 85,
                           .search_angles = 0,
                           .search_depth = 1,
                           .pruning = 1,
                           .termination = 3,
                           .max_steps = 2000,
                           .max_length_mm = 1000,
                           .contrast = 0,
                           .overlap = 0.5,
                           .own_overlap = 0};
}

MhtParameters mht_default_parameters(void)
{
    MhtParameters p = mht_paper_parameters();
    p.step = 0.5;
    p.window = 4;
    p.termination = 5;
    p.max_steps = 20000;
    p.contrast = 0.5;
    p.own_overlap = 0.5;
    return p;
}

// --- nodes ---

typedef struct Node {
    MhtTemplate template;
    int parent, branch;
} Node;

typedef struct Chain {       // nodes, growing
    Node *node;
    int count, capacity;
} Chain;

typedef struct Tracker {
    const Volume *volume;
    const MhtParameters *parameters;
    double voxel;            // [mm]
    MhtWindow *window;
    Chain tree;
    bool out_of_memory;
    const char *why;         // reason for which the last hypothesis was rejected
} Tracker;

static bool chain_append(Chain *chain, const MhtTemplate *template, int parent, int branch)
{
    if (chain->count == chain->capacity) {
        int capacity = chain->capacity ? 2 * chain->capacity : 256;
        Node *grown = realloc(chain->node, (size_t)capacity * sizeof *grown);
        if (!grown)
            return false;
        chain->node = grown;
        chain->capacity = capacity;
    }
    chain->node[chain->count++] = (Node){*template, parent, branch};
    return true;
}

static void chain_free(Chain *chain)
{
    free(chain->node);
    *chain = (Chain){0};
}

static bool inside_volume(const Volume *volume, Vec3 x)
{
    Vec3 v = volume_voxel_of(volume, x);
    return v.x >= 0 && v.y >= 0 && v.z >= 0 && v.x <= volume->size[0] - 1 && v.y <= volume->size[1] - 1 && v.z <= volume->size[2] - 1;
}

static bool is_in_tree(const Tracker *t, Vec3 x, double share)
{
    for (int i = 0; i < t->tree.count; i++)
        if (vec3_distance(x, t->tree.node[i].template.center) < share * t->tree.node[i].template.radius)
            return true;
    return false;
}

// --- hypotheses ---

typedef struct Branch {
    Chain way;               // the accepted nodes
    Chain tried;             // hypotheses, each with its parent; the root is one of them
    int root, leaf[MAX_LEAVES], leaf_count, depth;   // depth: steps from the root to the leaves
    MhtLimits limits;        // of the radius
    bool may_overlap;        // the branch has not yet left its parent's tube
} Branch;

// Sum of the scores from below the root to a hypothesis.
static double path_score(const Branch *branch, int hypothesis)
{
    double sum = 0;
    for (int i = hypothesis; i != branch->root; i = branch->tried.node[i].parent)
        sum += branch->tried.node[i].template.score;
    return sum;
}

static bool fit(Tracker *t, MhtTemplate *template, const MhtTemplate *previous, const MhtLimits *range)
{
    const MhtParameters *p = t->parameters;
    MhtLimits limits = *range;
    if (previous) {
        limits.previous = previous;
        limits.max_angle = p->max_angle_deg * PI / 180;
        limits.radius_min = fmax(limits.radius_min, previous->radius * (1 - p->radius_change));
        limits.radius_max = fmin(limits.radius_max, previous->radius * (1 + p->radius_change));
    }
    if (mht_window_open(t->window, t->volume, template, p->window) == 0)
        return false;
    mht_template_fit(t->window, template, &limits);
    return vec3_is_finite(template->center) && template->contrast > 0;
}

// Is a fitted template a valid next step after hypothesis `from`?
static bool is_progress(Tracker *t, const Branch *branch, int from, const MhtTemplate *next)
{
    const MhtParameters *p = t->parameters;
    t->why = "leaves the volume";
    if (!inside_volume(t->volume, next->center))
        return false;
    t->why = "the score is too low";
    bool is_single = p->search_depth == 1 && p->search_angles == 0;
    if (!(is_single || next->score > p->pruning) || !((path_score(branch, from) + next->score) / (branch->depth + 1) > p->termination))
        return false;
    t->why = "the contrast is lost";
    double sum = 0;
    int count = 0;
    for (int i = from; i >= 0 && count < CONTRAST_MEMORY; i = branch->tried.node[i].parent, count++)
        sum += branch->tried.node[i].template.contrast;
    if (next->contrast * count < p->contrast * sum)
        return false;
    t->why = "runs into itself";
    double way = vec3_distance(next->center, branch->tried.node[from].template.center);
    for (int i = branch->way.count - 1; p->own_overlap > 0 && i >= 0; i--) {
        const MhtTemplate *passed = &branch->way.node[i].template;
        way += i + 1 < branch->way.count ? vec3_distance(passed->center, branch->way.node[i + 1].template.center) : 0;
        if (way > 4 * passed->radius && vec3_distance(next->center, passed->center) < p->own_overlap * passed->radius)
            return false;
    }
    t->why = "runs into another branch";
    return branch->may_overlap || !is_in_tree(t, next->center, p->overlap);
}

// Templates one step ahead of hypothesis `from`, not yet fitted, best first: straight on, or the fan's local maxima of the score.
static int predict(Tracker *t, const MhtTemplate *from, MhtTemplate *out, int capacity)
{
    enum { SIDE = 2 * MAX_ANGLES + 1 };
    const MhtParameters *p = t->parameters;
    int n = p->search_angles, side = 2 * n + 1, found = 0;
    MhtTemplate fan[SIDE * SIDE];
    Vec3 e1 = vec3_normal_to(from->axis), e2 = vec3_cross(from->axis, e1);
    double widest = p->max_angle_deg * PI / 180;
    for (int i = 0; i < side; i++)
        for (int j = 0; j < side; j++) {
            double a = n > 0 ? widest * (i - n) / n : 0, b = n > 0 ? widest * (j - n) / n : 0, angle = sqrt(a * a + b * b);
            MhtTemplate *guess = &fan[i * side + j];
            *guess = *from;
            guess->score = -HUGE_VAL;
            if (angle > widest * (1 + 1e-9))
                continue;
            if (angle > 0)
                guess->axis = vec3_unit(
                    vec3_add_scaled(vec3_scale(from->axis, same_cos(angle)), same_sin(angle) / angle, vec3_add(vec3_scale(e1, a), vec3_scale(e2, b))));
            guess->center = vec3_add_scaled(from->center, p->step * from->radius, guess->axis);
            if (n > 0 && mht_window_open(t->window, t->volume, guess, p->window) > 0)
                mht_template_score(t->window, guess);
        }
    if (n == 0) {
        out[0] = fan[0];
        return 1;
    }
    for (int i = 0; i < side; i++)
        for (int j = 0; j < side; j++) {
            const MhtTemplate *guess = &fan[i * side + j];
            bool is_peak = guess->score > p->pruning;
            for (int k = 0; k < 9 && is_peak; k++) {
                int u = i + k / 3 - 1, v = j + k % 3 - 1, other = u * side + v;
                if (k != 4 && u >= 0 && v >= 0 && u < side && v < side)
                    is_peak = guess->score > fan[other].score || (guess->score == fan[other].score && i * side + j < other);
            }
            if (!is_peak)
                continue;
            if (found == capacity && out[found - 1].score >= guess->score)
                continue;
            int at = found < capacity ? found++ : capacity - 1;
            for (; at > 0 && out[at - 1].score < guess->score; at--)
                out[at] = out[at - 1];
            out[at] = *guess;
        }
    return found;
}

// One more step from every leaf. False if none is left.
static bool extend(Tracker *t, Branch *branch)
{
    enum { MAX_GUESSES = 8 };
    int leaf[MAX_LEAVES], count = 0;
    double score[MAX_LEAVES];
    const char *why = t->why;
    for (int i = 0; i < branch->leaf_count; i++) {
        MhtTemplate guess[MAX_GUESSES], from = branch->tried.node[branch->leaf[i]].template;
        int guesses = predict(t, &from, guess, MAX_GUESSES), kept = 0;
        for (int k = 0; k < guesses; k++) {
            t->why = "no template fits";
            bool good = fit(t, &guess[k], &from, &branch->limits) && is_progress(t, branch, branch->leaf[i], &guess[k]);
            why = good ? why : t->why;
            // several fits often converge to the same template
            for (int other = 0; other < kept && good; other++)
                if (vec3_distance(guess[other].center, guess[k].center) < t->voxel && vec3_dot(guess[other].axis, guess[k].axis) > 0.9) {
                    good = false;
                    if (guess[k].score > guess[other].score)
                        guess[other] = guess[k];
                }
            if (good)
                guess[kept++] = guess[k];
        }
        double before = path_score(branch, branch->leaf[i]);
        for (int k = 0; k < kept; k++) {
            double sum = before + guess[k].score;
            int at = count;
            if (count == MAX_LEAVES) {
                if (score[MAX_LEAVES - 1] >= sum)
                    continue;
                at = MAX_LEAVES - 1;
            } else
                count++;
            if (!chain_append(&branch->tried, &guess[k], branch->leaf[i], 0)) {
                t->out_of_memory = true;
                return false;
            }
            for (; at > 0 && score[at - 1] < sum; at--) {
                score[at] = score[at - 1];
                leaf[at] = leaf[at - 1];
            }
            score[at] = sum;
            leaf[at] = branch->tried.count - 1;
        }
    }
    t->why = why;
    if (count == 0)
        return false;
    memcpy(branch->leaf, leaf, (size_t)count * sizeof *leaf);
    branch->leaf_count = count;
    branch->depth++;
    return true;
}

// The hypothesis one step below the root on the path to another.
static int first_towards(const Branch *branch, int hypothesis)
{
    while (branch->tried.node[hypothesis].parent != branch->root)
        hypothesis = branch->tried.node[hypothesis].parent;
    return hypothesis;
}

static bool take(Tracker *t, Branch *branch, int next)
{
    int kept = 0;
    for (int i = 0; i < branch->leaf_count; i++)
        if (first_towards(branch, branch->leaf[i]) == next)
            branch->leaf[kept++] = branch->leaf[i];
    branch->leaf_count = kept;
    branch->root = next;
    branch->depth--;
    t->out_of_memory = !chain_append(&branch->way, &branch->tried.node[next].template, -1, 0);
    return !t->out_of_memory;
}

// Tracks a branch from its fitted first node to its end; t->why gives the reason for the end. `until_tree`: the branch is on its return path to its parent and
// ends inside another branch's tube.
static void follow(Tracker *t, Branch *branch, const MhtTemplate *first, bool until_tree)
{
    const MhtParameters *p = t->parameters;
    double length = 0;
    branch->may_overlap = is_in_tree(t, first->center, 1);
    t->out_of_memory = !chain_append(&branch->tried, first, -1, 0) || !chain_append(&branch->way, first, -1, 0);
    branch->leaf[0] = branch->root = 0;
    branch->leaf_count = 1;
    for (int steps = 0; !t->out_of_memory;) {
        bool going = true;
        while (going && branch->depth < p->search_depth)
            going = extend(t, branch);
        if (t->out_of_memory || branch->depth == 0)
            return;
        Vec3 before = branch->tried.node[branch->root].template.center;
        if (!take(t, branch, first_towards(branch, branch->leaf[0])))
            return;
        const MhtTemplate *here = &branch->way.node[branch->way.count - 1].template;
        length += vec3_distance(before, here->center);
        const char *why = t->why;
        t->why = "is as long as may be";
        if (length >= p->max_length_mm || ++steps >= p->max_steps || branch->way.count >= MAX_NODES)
            return;
        t->why = "reached its parent";
        if (until_tree && is_in_tree(t, here->center, 0.9))
            return;
        t->why = "does not leave its parent";
        branch->may_overlap = branch->may_overlap && is_in_tree(t, here->center, 1);
        if (branch->may_overlap && length > 6 * first->radius)
            return;
        t->why = why;
    }
}

static void branch_free(Branch *branch)
{
    chain_free(&branch->way);
    chain_free(&branch->tried);
}

// Fits the first template at the requested place and tracks from it. False if its score is too low.
static bool track_branch(Tracker *t, const MhtTemplate *start, const MhtLimits *limits, Branch *out, bool until_tree)
{
    const MhtParameters *p = t->parameters;
    MhtTemplate first = *start;
    *out = (Branch){.limits = *limits};
    t->why = "no template fits";
    // the window follows the template, because the start is a click
    for (int i = 0; i < 4; i++) {
        Vec3 before = first.center;
        if (!fit(t, &first, NULL, limits))
            return false;
        if (vec3_distance(before, first.center) < 0.1 * t->voxel)
            break;
    }
    t->why = "the first template scores too low";
    if (vec3_dot(first.axis, start->axis) < 0)
        first.axis = vec3_negate(first.axis);
    if (!(first.score > p->termination) || !inside_volume(t->volume, first.center) || vec3_distance(first.center, start->center) > 2 * start->radius)
        return false;
    follow(t, out, &first, until_tree);
    return !t->out_of_memory;
}

// --- the tree ---

// Lowest brightness on the line between two points, divided by the brightness at the darker end; both above the volume's minimum.
static double link_brightness(const Tracker *t, Vec3 a, Vec3 b)
{
    double base = (double)t->volume->minimum, least = HUGE_VAL, ends = HUGE_VAL;
    int steps = 2 + (int)fmin(4000, vec3_distance(a, b) / (0.5 * t->voxel));
    for (int i = 0; i <= steps; i++) {
        double value = (double)bspline_sample(t->volume, volume_voxel_of(t->volume, vec3_mix(a, b, (double)i / steps))) - base;
        least = fmin(least, value);
        ends = i == 0 || i == steps ? fmin(ends, value) : ends;
    }
    return ends > 0 ? least / ends : 0;
}

// Where to attach a branch that starts at x: the node of least power distance in line of sight, or the one with the brightest line.
static int attachment(const Tracker *t, Vec3 x)
{
    int best = -1, brightest = 0;
    double least = HUGE_VAL, most = -HUGE_VAL, reach = HUGE_VAL;
    for (int i = 0; i < t->tree.count; i++)
        reach = fmin(reach, vec3_distance(x, t->tree.node[i].template.center));
    for (int i = 0; i < t->tree.count; i++) {
        const MhtTemplate *n = &t->tree.node[i].template;
        double distance = vec3_distance(x, n->center), power = distance * distance - n->radius * n->radius;
        if (distance > 2 * reach + 4 * n->radius || (best >= 0 && power >= least))
            continue;
        double link = link_brightness(t, x, n->center);
        if (link >= 0.5) {
            least = power;
            best = i;
        }
        if (link > most) {
            most = link;
            brightest = i;
        }
    }
    return best >= 0 ? best : brightest;
}

static int nearest_node(const Tracker *t, Vec3 x)
{
    int nearest = 0;
    for (int i = 1; i < t->tree.count; i++)
        if (vec3_distance(x, t->tree.node[i].template.center) < vec3_distance(x, t->tree.node[nearest].template.center))
            nearest = i;
    return nearest;
}

// Gap between a template's tube and the nearest one of the tree; < 0 where they overlap.
static double gap_to_tree(const Tracker *t, const MhtTemplate *template)
{
    double least = HUGE_VAL;
    for (int i = 0; i < t->tree.count; i++)
        least = fmin(least, vec3_distance(template->center, t->tree.node[i].template.center) - t->tree.node[i].template.radius);
    return least - template->radius;
}

// Appends a branch's nodes: those of the return path reversed, then those of the outgoing path. A return path that missed its parent is joined where it was
// nearest, and the rest becomes a separate limb there: a link from its far end would cross the background.
static bool adopt(Tracker *t, const Chain *out, const Chain *back, int number)
{
    bool is_first = t->tree.count == 0, good = true;
    int joint = back->count - 1, first = t->tree.count;
    double least = HUGE_VAL;
    for (int i = back->count - 1; i >= 0 && least > 0; i--) {
        double gap = gap_to_tree(t, &back->node[i].template);
        if (gap < least) {
            least = gap;
            joint = i;
        }
    }
    for (int i = 0; good && i < joint + 1 + out->count; i++) {
        MhtTemplate node = i <= joint ? back->node[joint - i].template : out->node[i - joint - 1].template;
        if (i <= joint)
            node.axis = vec3_negate(node.axis);
        int parent = i > 0 ? t->tree.count - 1 : is_first ? -1 : attachment(t, node.center);
        good = chain_append(&t->tree, &node, parent, number);
    }
    for (int i = joint + 1; good && i < back->count; i++)
        good = chain_append(&t->tree, &back->node[i].template, i == joint + 1 ? first : t->tree.count - 1, number);
    return good;
}

static MhtLimits limits_of(const Tracker *t, double radius)
{
    const MhtParameters *p = t->parameters;
    double least = fmax(0.5 * t->voxel, p->radius_min * radius);
    return (MhtLimits){.radius_min = least, .radius_max = fmax(least, p->radius_max * radius)};
}

static bool track_seed(Tracker *t, const RbtSeed *seed, int number)
{
    Branch out = {0}, behind = {0};
    bool is_first = t->tree.count == 0, both_ways = !is_first, found = false;
    MhtTemplate start = {.center = seed->start, .radius = seed->radius};
    if (seed->has_toward)
        start.axis = vec3_unit(vec3_sub(seed->toward, seed->start));
    if (!is_first) {
        const MhtTemplate parent = t->tree.node[nearest_node(t, seed->start)].template;
        Vec3 away = vec3_unit_or(vec3_sub(seed->start, parent.center), parent.axis);
        if (!(start.radius > 0))
            start.radius = parent.radius;
        if (!seed->has_toward) {
            MhtTemplate beside = {.center = vec3_add_scaled(parent.center, 1.25 * parent.radius, away), .radius = start.radius, .axis = away};
            MhtLimits limits = limits_of(t, start.radius);
            start.axis = away;
            found = track_branch(t, &beside, &limits, &out, false);
            // the maximum length of an attempt that leads to the given point
            double length = 0;
            for (int i = 1; i < out.way.count; i++)
                length += vec3_distance(out.way.node[i].template.center, out.way.node[i - 1].template.center);
            found = found && length > vec3_distance(beside.center, seed->start) + start.radius;
            both_ways = !found;
            if (!found)
                branch_free(&out);
        }
    }
    MhtLimits limits = limits_of(t, start.radius);
    found = found || (!t->out_of_memory && track_branch(t, &start, &limits, &out, false));
    const char *why = t->why;
    Chain none = {0};
    if (found && both_ways) {
        MhtTemplate first = out.way.node[0].template;
        first.axis = vec3_negate(first.axis);
        behind = (Branch){.limits = limits};
        follow(t, &behind, &first, true);
    }
    // its first node is that of the branch, in the opposite direction
    Chain back = behind.way.count > 1 ? (Chain){behind.way.node + 1, behind.way.count - 1, 0} : none;
    if (found && !t->out_of_memory)
        t->out_of_memory = !adopt(t, &out.way, &back, number);
    t->why = why;
    branch_free(&out);
    branch_free(&behind);
    return found;
}

static Vec3 in_mm(const Volume *volume, Vec3 x, bool is_voxel) { return is_voxel ? volume_point_of(volume, x) : x; }

static bool check_seed(const Tracker *t, RbtSeed *seed, int number, const char *path, Faults *faults)
{
    int before = faults->count;
    double extent = 0;
    const int *size = t->volume->size;
    seed->start = in_mm(t->volume, seed->start, seed->start_is_voxel);
    seed->toward = in_mm(t->volume, seed->toward, seed->toward_is_voxel);
    seed->start_is_voxel = seed->toward_is_voxel = false;
    for (int i = 0; i < 3; i++)
        extent = fmax(extent, vec3_norm(t->volume->axis[i]) * size[i]);
    if (!inside_volume(t->volume, seed->start))
        faults_add(faults, path, seed->line, seed->column,
                   "the start of branch %d (%g, %g, %g) mm lies outside the volume; expected voxel (0, 0, 0) to (%d, %d, %d)", number + 1, seed->start.x,
                   seed->start.y, seed->start.z, size[0] - 1, size[1] - 1, size[2] - 1);
    if (number == 0 && !seed->has_toward)
        faults_add(faults, path, seed->line, seed->column, "the first branch has no direction; expected a point further down the vessel");
    if (seed->has_toward && !(vec3_distance(seed->start, seed->toward) > 1e-6 * t->voxel))
        faults_add(faults, path, seed->line, seed->column,
                   "the start and the toward of branch %d are the same point; expected a toward further down the vessel", number + 1);
    if (number == 0 && !(seed->radius > 0))
        faults_add(faults, path, seed->line, seed->column, "the first branch has no radius; expected about that of the vessel at its start");
    if (seed->radius > extent / 2)
        faults_add(faults, path, seed->line, seed->column, "the radius %g mm of branch %d is larger than the volume; expected at most %g mm", seed->radius,
                   number + 1, extent / 2);
    return faults->count == before;
}

static bool check_parameters(const MhtParameters *p, const char *path, Faults *faults)
{
    int before = faults->count;
    if (!(p->step >= 0.01 && p->step <= 5))
        faults_add(faults, path, 0, 0, "the step is %g radii; expected 0.01 to 5", p->step);
    if (!(p->window >= 1 && p->window <= 10))
        faults_add(faults, path, 0, 0, "the window is %g radii; expected 1 to 10", p->window);
    if (!(p->radius_min > 0 && p->radius_min <= p->radius_max))
        faults_add(faults, path, 0, 0, "the radius ranges from %g to %g; expected above 0, and the first not above the second", p->radius_min, p->radius_max);
    if (!(p->max_angle_deg > 0 && p->max_angle_deg <= 90))
        faults_add(faults, path, 0, 0, "the largest angle is %g degrees; expected above 0, at most 90", p->max_angle_deg);
    if (p->search_angles < 0 || p->search_angles > MAX_ANGLES || p->search_depth < 1 || p->search_depth > MAX_DEPTH)
        faults_add(faults, path, 0, 0, "search angles %d, depth %d; expected 0 to %d and 1 to %d", p->search_angles, p->search_depth, MAX_ANGLES, MAX_DEPTH);
    return faults->count == before;
}

static VesselTree *finish_tree(const Tracker *t)
{
    const Chain *chain = &t->tree;
    VesselTree *tree = vessel_tree_create(chain->count, (int64_t)CIRCLE * chain->count, 0);
    if (!tree)
        return NULL;
    for (int i = 0; i < chain->count; i++) {
        const MhtTemplate *n = &chain->node[i].template;
        Vec3 e1 = vec3_normal_to(n->axis), e2 = vec3_cross(n->axis, e1);
        tree->center[i] = n->center;
        tree->radius[i] = n->radius;
        tree->direction[i] = n->axis;
        tree->height[i] = t->parameters->step * n->radius;
        tree->parent[i] = chain->node[i].parent;
        tree->kind[i] = NODE_VESSEL;
        tree->point_offset[i] = (int64_t)CIRCLE * i;
        for (int k = 0; k < CIRCLE; k++) {
            double a = 2 * PI * k / CIRCLE;
            tree->point[CIRCLE * (int64_t)i + k] = vec3_add_scaled(vec3_add_scaled(n->center, n->radius * same_cos(a), e1), n->radius * same_sin(a), e2);
        }
    }
    tree->point_offset[chain->count] = (int64_t)CIRCLE * chain->count;
    if (!vessel_tree_link(tree)) {
        vessel_tree_free(tree);
        return NULL;
    }
    return tree;
}

static void report_branch(const Tracker *t, int number, const RbtSeed *seed, RbtBranchReport *report)
{
    for (int i = 0; i < t->tree.count; i++)
        if (t->tree.node[i].branch == number) {
            int parent = t->tree.node[i].parent;
            report->first_node = report->node_count++ == 0 ? i : report->first_node;
            report->length += parent >= 0 ? vec3_distance(t->tree.node[i].template.center, t->tree.node[parent].template.center) : 0;
        }
    memcpy(report->name, seed->name, sizeof report->name);
    snprintf(report->end, sizeof report->end, "%s", t->why ? t->why : "");
}

static bool track_all(Tracker *t, const RbtSeed *seed, int seed_count, const Progress *progress, RbtReport *report, const char *path, Faults *faults)
{
    for (int i = 0; i < seed_count; i++) {
        bool found = track_seed(t, &seed[i], i);
        if (t->out_of_memory) {
            faults_add(faults, path, 0, 0, "out of memory at branch %d", i + 1);
            return false;
        }
        if (!found) {
            faults_add(faults, path, seed[i].line, seed[i].column,
                       "nothing could be tracked from the start of branch %d (%s); expected a point well inside the vessel, about its "
                       "true radius and direction",
                       i + 1, t->why);
            return false;
        }
        report_branch(t, i, &seed[i], &report->branch[i]);
        if (progress && progress->call)
            progress->call(progress->context, i + 1, seed_count);
    }
    return true;
}

VesselTree *mht_track(const Volume *volume, const MhtParameters *parameters, const RbtSeed *given, int seed_count, int threads, const Progress *progress,
                      RbtReport *report, const char *path, Faults *faults)
{
    (void)threads;
    int before = faults->count;
    Tracker t = {.volume = volume, .parameters = parameters, .voxel = volume_voxel_size(volume), .window = mht_window_create()};
    RbtSeed *seed = malloc((size_t)(seed_count > 0 ? seed_count : 1) * sizeof *seed);
    RbtReport own = {.branch_count = seed_count, .branch = calloc((size_t)(seed_count > 0 ? seed_count : 1), sizeof *own.branch)};
    VesselTree *tree = NULL;
    if (!t.window || !seed || !own.branch)
        faults_add(faults, path, 0, 0, "out of memory");
    else if (seed_count < 1)
        faults_add(faults, path, 0, 0, "there is no branch to track; expected `branches` with at least one start");
    else if (check_parameters(parameters, path, faults)) {
        memcpy(seed, given, (size_t)seed_count * sizeof *seed);
        for (int i = 0; i < seed_count; i++)
            check_seed(&t, &seed[i], i, path, faults);
        if (faults->count == before && track_all(&t, seed, seed_count, progress, &own, path, faults) && !(tree = finish_tree(&t)))
            faults_add(faults, path, 0, 0, "out of memory for a tree of %d nodes", t.tree.count);
    }
    chain_free(&t.tree);
    mht_window_free(t.window);
    free(seed);
    if (tree && report)
        *report = own;
    else
        free(own.branch);
    return tree;
}
