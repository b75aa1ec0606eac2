// Every tracked node is located on the true tree. From the root outwards, a node is good while it lies in the lumen to which its parent leads. Where the
// tracking leaves the lumen, a run of bad nodes begins. A short run that returns to the place where it left is an excursion, not a leak.
#include "bench/track_score.h"

#include "recon/volume/blurred_edge.h"

#include <stdlib.h>

const char *const track_label_name[TRACK_LABELS] = {"ST", "PS", "WT", "KV", "KB", "KA", "LB", "BT"};

enum { GROUP = 16 };
typedef enum Zone { IN_VESSEL, PAST_END, IN_SAC, IN_NEIGHBOUR, IN_BONE, IN_BACKGROUND } Zone;

typedef struct Place {           // on a true tree
    int node;                    // the nearest
    int link;                    // the child of the nearest link
    double arc, radius, away;    // path length from the root, radius there, distance from the centreline
    bool beyond;                 // beyond the end of a tip or of the root
} Place;

typedef struct Ball {
    Vec3 center;
    double reach, widest;
} Ball;

typedef struct Map {             // of a true tree
    const VesselTree *tree;
    double *arc;                 // (N) path length from the root
    int *branch;                 // (N) of the link to the parent
    int *depth;                  // (N)
    int *vessel_children;        // (N)
    Ball *ball;                  // around each GROUP of links
} Map;

typedef struct Run {             // of successive nodes outside the true tree
    int source;                  // the branch that the run left
    Place from;
    double length, limit, kind_mm[TRACK_LABELS];
    bool is_back, is_excursion;
} Run;

typedef struct Step {            // of a tracked node
    Place place;
    Zone zone;
    int run;                     // -1: good
    int furthest;                // the most distal true node on the path to this node
    double since;                // path length since the run began
    bool jumped;
} Step;

// --- The true tree ---

static void map_free(Map *map)
{
    free(map->arc);
    free(map->branch);
    free(map->depth);
    free(map->vessel_children);
    free(map->ball);
}

static bool map_make(const VesselTree *tree, Map *map)
{
    size_t n = (size_t)tree->node_count;
    *map = (Map){.tree = tree,
                 .arc = calloc(n, sizeof(double)),
                 .branch = calloc(n, sizeof(int)),
                 .depth = calloc(n, sizeof(int)),
                 .vessel_children = calloc(n, sizeof(int)),
                 .ball = calloc(n / GROUP + 1, sizeof(Ball))};
    if (!map->arc || !map->branch || !map->depth || !map->vessel_children || !map->ball)
        return false;
    for (int i = 1; i < tree->node_count; i++) {
        int p = tree->parent[i];
        map->arc[i] = map->arc[p] + vec3_distance(tree->center[i], tree->center[p]);
        map->depth[i] = map->depth[p] + 1;
        map->vessel_children[p] += tree->kind[i] == NODE_VESSEL;
    }
    for (int g = 0; g * GROUP < tree->node_count; g++) {
        Ball *ball = &map->ball[g];
        ball->center = tree->center[g * GROUP];
        for (int i = g * GROUP; i < (g + 1) * GROUP && i < tree->node_count; i++)
            for (int end = 0; end < 2; end++) {
                int k = end == 0 || tree->parent[i] < 0 ? i : tree->parent[i];
                ball->reach = fmax(ball->reach, vec3_distance(ball->center, tree->center[k]));
                ball->widest = fmax(ball->widest, tree->radius[k]);
            }
    }
    return true;
}

// The nearest place, with distances in radii.
static Place locate(const Map *map, Vec3 x)
{
    const VesselTree *tree = map->tree;
    Place best = {.node = 0, .link = 0, .radius = tree->radius[0], .away = vec3_distance(x, tree->center[0]), .beyond = true};
    double nearest = best.away / best.radius;
    for (int g = 0; g * GROUP < tree->node_count; g++) {
        if (vec3_distance(x, map->ball[g].center) - map->ball[g].reach >= nearest * map->ball[g].widest)
            continue;
        for (int i = g * GROUP; i < (g + 1) * GROUP && i < tree->node_count; i++) {
            int p = tree->parent[i];
            if (p < 0 || tree->kind[i] != NODE_VESSEL || tree->kind[p] != NODE_VESSEL)
                continue;
            Vec3 a = tree->center[p], along = vec3_sub(tree->center[i], a);
            double length2 = vec3_norm2(along), t = length2 > 0 ? vec3_dot(vec3_sub(x, a), along) / length2 : 0, u = fmin(1, fmax(0, t));
            double r = tree->radius[p] + u * (tree->radius[i] - tree->radius[p]), away = vec3_distance(x, vec3_add_scaled(a, u, along));
            if (away >= nearest * r)
                continue;
            nearest = away / r;
            bool off_tip = t > 1 && map->vessel_children[i] == 0, off_root = t < 0 && p == 0;
            best = (Place){u < 0.5 ? p : i, i, map->arc[p] + u * (map->arc[i] - map->arc[p]), r, away, off_tip || off_root};
        }
    }
    return best;
}

// The node where the paths from the root to a and b diverge.
static int meeting(const Map *map, int a, int b)
{
    while (a != b) {
        if (map->depth[a] >= map->depth[b])
            a = map->tree->parent[a];
        else
            b = map->tree->parent[b];
    }
    return a;
}

static double way_between(const Map *map, const Place *a, const Place *b)
{
    int m = meeting(map, a->node, b->node);
    return m == a->node || m == b->node ? fabs(a->arc - b->arc) : a->arc + b->arc - 2 * map->arc[m];
}

// Branches: a new one at every child of a bifurcation.
static int name_branches(const Map *map, TrackBranch *branch)
{
    const VesselTree *tree = map->tree;
    int count = 0;
    for (int i = 1; i < tree->node_count; i++) {
        int p = tree->parent[i];
        if (tree->kind[i] != NODE_VESSEL)
            continue;
        if (p == 0 || map->vessel_children[p] > 1) {
            branch[count] = (TrackBranch){.first_node = p};
            map->branch[i] = count++;
        } else {
            map->branch[i] = map->branch[p];
        }
        TrackBranch *b = &branch[map->branch[i]];
        double length = map->arc[i] - map->arc[p];
        b->last_node = i;
        b->length += length;
        b->radius += 0.5 * (tree->radius[i] + tree->radius[p]) * length;
    }
    for (int b = 0; b < count; b++)
        branch[b].radius /= branch[b].length;
    return count;
}

// --- The tracked tree ---

typedef struct Judge {
    const TrackTruth *truth;
    const VesselTree *tracked;
    Map map, other;              // the truth, and its neighbour
    Step *step;                  // (tracked nodes)
    Run *run;                    // (tracked nodes at most)
    int run_count;
    double *covered;             // (true nodes) 1: tracked
    TrackScore *score;
} Judge;

static Zone zone_of(const Judge *j, Vec3 x, const Place *place)
{
    const VesselTree *tree = j->truth->tree;
    if (place->away <= place->radius + 0.5 * j->truth->voxel_mm)
        return IN_VESSEL;
    if (place->beyond && place->away <= 2 * place->radius + 0.5 * j->truth->voxel_mm)
        return PAST_END;
    for (int i = 0; i < tree->node_count; i++)
        if (tree->kind[i] == NODE_ANEURYSM && vec3_distance(x, tree->center[i]) <= tree->radius[i])
            return IN_SAC;
    if (j->truth->neighbour) {
        Place other = locate(&j->other, x);
        if (other.away <= other.radius)
            return IN_NEIGHBOUR;
    }
    for (int i = 0; i < j->truth->block_count; i++)
        if (shape_block_distance(&j->truth->block[i], x) > 0)
            return IN_BONE;
    return IN_BACKGROUND;
}

static void begin_run(Judge *j, Step *step, const Step *before, bool is_back)
{
    Run *run = &j->run[j->run_count];
    *run = (Run){.source = before ? j->map.branch[before->place.link] : 0, .from = before ? before->place : step->place, .is_back = is_back};
    run->limit = 2 * run->from.radius;
    step->run = j->run_count++;
    step->since = 0;
}

static void extend_run(Run *run, Zone zone, double length)
{
    static const TrackLabel kind[] = {
        [IN_VESSEL] = TRACK_KV, [PAST_END] = TRACK_LB, [IN_SAC] = TRACK_KA, [IN_NEIGHBOUR] = TRACK_KV, [IN_BONE] = TRACK_KB, [IN_BACKGROUND] = TRACK_LB};
    run->length += length;
    run->kind_mm[kind[zone]] += length;
}

static bool leads_to(const Judge *j, const Place *from, const Place *to, double straight)
{
    return way_between(&j->map, from, to) <= 1.2 * straight + 4 * fmax(from->radius, to->radius);
}

// Judges node i after its nearest ancestor that is a vessel.
static void judge_node(Judge *j, int i)
{
    const VesselTree *tracked = j->tracked;
    Step *step = &j->step[i];
    int p = tracked->parent[i];
    while (p >= 0 && tracked->kind[p] != NODE_VESSEL)
        p = tracked->parent[p];
    const Step *before = p >= 0 ? &j->step[p] : NULL;
    Vec3 x = tracked->center[i];
    double straight = before ? vec3_distance(x, tracked->center[p]) : 0;
    *step = (Step){.place = locate(&j->map, x), .run = -1};
    step->zone = zone_of(j, x, &step->place);
    step->furthest = step->place.node;
    bool inside = step->zone == IN_VESSEL || step->zone == PAST_END;
    if (before && before->run >= 0) {
        Run *run = &j->run[before->run];
        step->since = before->since + straight;
        if (!run->is_back && inside && step->since <= run->limit + 2 * j->truth->voxel_mm && leads_to(j, &run->from, &step->place, step->since)) {
            run->is_excursion = true;
            return;
        }
        step->run = before->run;
        extend_run(run, step->zone, straight);
        return;
    }
    if (!inside) {
        begin_run(j, step, before, false);
        extend_run(&j->run[step->run], step->zone, straight);
        return;
    }
    if (!before)
        return;
    if (!leads_to(j, &before->place, &step->place, straight)) {
        step->jumped = true;
        return;
    }
    // back along the same path by more than three radii; a sister branch does not count
    int m = meeting(&j->map, before->furthest, step->place.node);
    if (m == step->place.node && j->map.arc[before->furthest] - step->place.arc > 3 * fmax(step->place.radius, j->truth->tree->radius[before->furthest])) {
        begin_run(j, step, before, true);
        extend_run(&j->run[step->run], step->zone, straight);
    } else if (m == step->place.node) {
        step->furthest = before->furthest;
    }
}

// Marks the part of the true tree that the link from node i's parent covers, and checks whether the link stays inside.
static void follow_link(Judge *j, int i)
{
    const VesselTree *tracked = j->tracked;
    int p = tracked->parent[i];
    if (p < 0 || tracked->kind[i] != NODE_VESSEL || tracked->kind[p] != NODE_VESSEL)
        return;
    Vec3 a = tracked->center[p], b = tracked->center[i];
    double length = vec3_distance(a, b);
    bool good = j->step[i].run < 0 && j->step[p].run < 0, inside = true;
    int n = 2 + (int)(length / (0.2 * fmin(j->step[i].place.radius, tracked->radius[i])));
    n = n > 400 ? 400 : n;
    for (int k = 0; k <= n; k++) {
        Vec3 x = vec3_mix(a, b, (double)k / n);
        Place place = locate(&j->map, x);
        Zone zone = zone_of(j, x, &place);
        inside = inside && (zone == IN_VESSEL || zone == PAST_END || zone == IN_SAC);
        if (good && !j->step[i].jumped && place.away <= fmax(0.6 * place.radius, j->truth->voxel_mm))
            j->covered[place.node] = 1;
    }
    j->score->links++;
    j->score->background_links += good && !inside;
    j->score->tracked_mm += length;
    j->score->wrong_attachments += j->step[i].jumped;
}

static void take_sample(Judge *j, int i)
{
    const Step *step = &j->step[i];
    if (j->tracked->kind[i] != NODE_VESSEL || step->run >= 0 || step->zone != IN_VESSEL)
        return;
    int b = j->map.branch[step->place.link];
    const TrackBranch *branch = &j->score->branch[b];
    const VesselTree *tree = j->truth->tree;
    double before = step->place.arc - j->map.arc[branch->first_node], after = j->map.arc[branch->last_node] - step->place.arc;
    bool inlet = branch->first_node == 0;
    if ((!inlet && before < 2 * tree->radius[branch->first_node]) || (inlet && before < 0.5 * tree->radius[0]) || after < 2 * tree->radius[branch->last_node])
        return;
    double r = step->place.radius, expected = r - j->truth->blur_mm * j->truth->blur_mm / (2 * r), found = j->tracked->radius[i];
    j->score->sample[j->score->sample_count++] = (TrackSample){b, step->place.away, found - expected, found - blurred_edge_of(r, j->truth->blur_mm), r};
}

static TrackLabel run_kind(const Run *run)
{
    if (run->is_back)
        return TRACK_BT;
    for (TrackLabel kind = TRACK_KV; kind <= TRACK_KA; kind++)
        if (run->kind_mm[kind] > 0)
            return kind;
    return TRACK_LB;
}

// Labels the branches after nodes and links are judged. `lost`: kind of the longest run that left each branch, or TRACK_ST; `hung`: reached by a jump.
static void label_branches(Judge *j, const TrackLabel *lost, const bool *hung)
{
    const VesselTree *tree = j->truth->tree;
    TrackScore *score = j->score;
    for (int b = 0; b < score->branch_count; b++) {
        TrackBranch *branch = &score->branch[b];
        double skip = fmin(2 * tree->radius[branch->first_node], 0.5 * branch->length), seen = 0, all = 0;
        double r = tree->radius[branch->last_node];
        bool reached = false;
        for (int i = branch->last_node; i != branch->first_node; i = tree->parent[i]) {
            double length = j->map.arc[i] - j->map.arc[tree->parent[i]], left = j->map.arc[branch->last_node] - j->map.arc[i];
            branch->covered += j->covered[i] * length;
            if (j->map.arc[i] - j->map.arc[branch->first_node] > skip)
                all += length, seen += j->covered[i] * length;
            reached = reached || (j->covered[i] > 0 && left <= 2 * r && j->map.arc[i] - j->map.arc[branch->first_node] > 0.5 * skip);
        }
        double share = all > 0 ? seen / all : 0;
        branch->skip = skip;
        branch->hangs_wrong = hung[b];
        branch->label = hung[b] ? TRACK_WT : reached && share >= 0.8 ? TRACK_ST : lost[b] != TRACK_ST ? lost[b] : share < 0.1 ? TRACK_WT : TRACK_PS;
        score->true_mm += branch->length;
        score->covered_mm += branch->covered;
    }
}

static void judge(Judge *j, TrackLabel *lost, double *lost_mm, bool *hung)
{
    const VesselTree *tracked = j->tracked;
    TrackScore *score = j->score;
    for (int i = 0; i < tracked->node_count; i++) {
        if (tracked->kind[i] == NODE_VESSEL) {
            judge_node(j, i);
            continue;
        }
        Place place = locate(&j->map, tracked->center[i]);
        Zone zone = zone_of(j, tracked->center[i], &place);
        score->false_sacs += zone != IN_VESSEL && zone != IN_SAC;
    }
    for (int i = 0; i < tracked->node_count; i++) {
        follow_link(j, i);
        take_sample(j, i);
    }
    for (int k = 0; k < j->run_count; k++) {
        const Run *run = &j->run[k];
        TrackLabel kind = run_kind(run);
        if (run->is_excursion || run->length < run->limit)
            continue;
        score->invented[kind]++;
        score->invented_mm[kind] += run->length;
        if (run->length > lost_mm[run->source])
            lost_mm[run->source] = run->length, lost[run->source] = kind;
    }
    for (int i = 1; i < tracked->node_count; i++) {
        const Step *step = &j->step[i];
        if (tracked->kind[i] != NODE_VESSEL || !step->jumped)
            continue;
        // a branch that the tracking left, and that was not tracked otherwise, was lost into a vessel in contact
        int p = tracked->parent[i];
        while (tracked->kind[p] != NODE_VESSEL)
            p = tracked->parent[p];
        int source = j->map.branch[j->step[p].place.link];
        if (lost[source] == TRACK_ST)
            lost[source] = TRACK_KV;
        hung[j->map.branch[step->place.link]] = true;
    }
}

bool track_score(const TrackTruth *truth, const VesselTree *tracked, TrackScore *out)
{
    *out = (TrackScore){0};
    Judge j = {.truth = truth, .tracked = tracked, .score = out};
    size_t nodes = (size_t)truth->tree->node_count, found = tracked ? (size_t)tracked->node_count : 0;
    bool good = map_make(truth->tree, &j.map) && (!truth->neighbour || map_make(truth->neighbour, &j.other));
    TrackLabel *lost = calloc(nodes, sizeof *lost);
    double *lost_mm = calloc(nodes, sizeof *lost_mm);
    bool *hung = calloc(nodes, sizeof *hung);
    out->branch = calloc(nodes, sizeof *out->branch);
    out->sample = calloc(found + 1, sizeof *out->sample);
    j.covered = calloc(nodes, sizeof *j.covered);
    j.step = calloc(found + 1, sizeof *j.step);
    j.run = calloc(found + 1, sizeof *j.run);
    good = good && lost && lost_mm && hung && out->branch && out->sample && j.covered && j.step && j.run;
    if (good) {
        out->branch_count = name_branches(&j.map, out->branch);
        if (tracked)
            judge(&j, lost, lost_mm, hung);
        label_branches(&j, lost, hung);
    }
    map_free(&j.map);
    map_free(&j.other);
    free(lost);
    free(lost_mm);
    free(hung);
    free(j.covered);
    free(j.step);
    free(j.run);
    if (!good)
        track_score_free(out);
    return good;
}

void track_score_free(TrackScore *score)
{
    free(score->branch);
    free(score->sample);
    *score = (TrackScore){0};
}
