// Joins curves to one rooted tree. All curves are sampled every tenth of the local inscribed radius. The tree starts as the root's curve. Then repeatedly the
// curve that touches the tree nearest to the root (along the tree) contributes the stretches that lie apart from the tree. Two samples belong to the same
// centreline if they are nearer than 0.35 of the smaller radius: overlapping curves differ by less, neighbouring vessels by more.
#include "recon/surface/import_skeleton.h"

#include <stdlib.h>
#include <string.h>

static const double STEP = 0.1, SAME = 0.35, EDGE = 0.1, CORNER = 0.4;
enum { SAMPLES_MAX = 4000000 };

typedef struct Fine {        // the curves, sampled
    int count, curve_count;
    Vec3 *point;
    double *radius, *given;
    int *offset;             // (C+1)
    double *distance;        // distance to the nearest sample of the tree
    int *nearest;            // the nearest sample of the tree
    bool *done;
} Fine;

typedef struct Growing {
    Skeleton *s;
    double *arc;             // [mm] path length from the root along the tree
    int *children;           // number of children
    int capacity;
} Growing;

static void fine_free(Fine *fine)
{
    free(fine->point);
    free(fine->radius);
    free(fine->given);
    free(fine->offset);
    free(fine->distance);
    free(fine->nearest);
    free(fine->done);
}

static double inscribed(const Wall *wall, Vec3 p)
{
    Vec3 foot;
    int triangle = 0;
    return fmax(mesh_tree_nearest(wall->tree, p, INFINITY, &foot, &triangle), 1e-6);
}

// Samples curve c; if `out` is NULL it only counts the samples.
static int sample_curve(const CurveSet *set, const Wall *wall, int c, double floor_step, Vec3 *out, double *radius, double *given)
{
    int count = 0;
    for (int i = set->offset[c]; i + 1 < set->offset[c + 1] && count < SAMPLES_MAX; i++) {
        Vec3 a = set->point[i], b = set->point[i + 1];
        double length = vec3_distance(a, b);
        for (double at = 0; at < length && count < SAMPLES_MAX; count++) {
            Vec3 p = vec3_mix(a, b, at / length);
            double r = inscribed(wall, p);
            if (out) {
                out[count] = p;
                radius[count] = r;
                given[count] = set->radius[i] > 0 && set->radius[i + 1] > 0 ? set->radius[i] + at / length * (set->radius[i + 1] - set->radius[i]) : 0;
            }
            at += fmax(STEP * r, floor_step);
        }
    }
    if (out) {
        out[count] = set->point[set->offset[c + 1] - 1];
        radius[count] = inscribed(wall, out[count]);
        given[count] = set->radius[set->offset[c + 1] - 1];
    }
    return count + 1;
}

static bool fine_create(const CurveSet *set, const Wall *wall, Fine *fine)
{
    double total = 0;
    for (int c = 0; c < set->curve_count; c++)
        for (int i = set->offset[c]; i + 1 < set->offset[c + 1]; i++)
            total += vec3_distance(set->point[i], set->point[i + 1]);
    double floor_step = total / 100000;
    *fine = (Fine){.curve_count = set->curve_count, .offset = calloc((size_t)set->curve_count + 1, sizeof(int))};
    if (!fine->offset)
        return false;
    for (int c = 0; c < set->curve_count; c++)
        fine->offset[c + 1] = fine->offset[c] + sample_curve(set, wall, c, floor_step, NULL, NULL, NULL);
    size_t n = (size_t)fine->offset[set->curve_count] + 1;
    fine->count = (int)n - 1;
    fine->point = calloc(n, sizeof(Vec3));
    fine->radius = calloc(n, sizeof(double));
    fine->given = calloc(n, sizeof(double));
    fine->distance = calloc(n, sizeof(double));
    fine->nearest = calloc(n, sizeof(int));
    fine->done = calloc(n, sizeof(bool));
    if (!fine->point || !fine->radius || !fine->given || !fine->distance || !fine->nearest || !fine->done)
        return false;
    for (int c = 0; c < set->curve_count; c++)
        sample_curve(set, wall, c, floor_step, fine->point + fine->offset[c], fine->radius + fine->offset[c], fine->given + fine->offset[c]);
    for (int i = 0; i < fine->count; i++)
        fine->distance[i] = INFINITY;
    return true;
}

// --- the root ---

typedef struct End {
    int sample, step;        // step: +1 or -1, towards the curve's other end
    Vec3 outward;
    double radius;
    int opening;
} End;

static End end_at(const Fine *fine, const Wall *wall, int curve, bool last)
{
    int first = fine->offset[curve], n = fine->offset[curve + 1] - first;
    End end = {.sample = last ? first + n - 1 : first, .step = last ? -1 : 1};
    double arc = 0;
    int far = end.sample;
    end.radius = fine->radius[far];
    for (int i = 1; i < n && arc < 1.5 * end.radius; i++) {
        arc += vec3_distance(fine->point[far], fine->point[far + end.step]);
        far += end.step;
        end.radius = fmax(end.radius, fine->radius[far]);
    }
    end.outward = vec3_unit(vec3_sub(fine->point[end.sample], fine->point[far]));
    end.opening = wall_opening_near(wall, fine->point[end.sample], end.outward, end.radius);
    return end;
}

static bool are_close(const Fine *fine, int i, int k) { return vec3_distance(fine->point[i], fine->point[k]) < SAME * fmin(fine->radius[i], fine->radius[k]); }

// Returns true if another curve passes or ends at this curve's end. One that ends there too and comes from the same direction overlaps this curve: the end is
// then free.
static bool end_is_joined(const Fine *fine, int curve, int sample)
{
    Vec3 own = vec3_sub(fine->point[sample + (sample == fine->offset[curve] ? 1 : -1)], fine->point[sample]);
    for (int c = 0; c < fine->curve_count; c++) {
        int first = fine->offset[c], last = fine->offset[c + 1] - 1;
        for (int i = first; c != curve && i <= last; i++) {
            if (!are_close(fine, i, sample))
                continue;
            int end = i - first < last - i ? first : last;
            Vec3 others = vec3_sub(fine->point[end + (end == first ? 1 : -1)], fine->point[end]);
            if (!are_close(fine, end, sample) || vec3_dot(own, others) < 0)
                return true;
        }
    }
    return false;
}

// Chooses the end that becomes the root: the one nearest to options->root, else the widest, open ends first.
static bool choose_root(const Fine *fine, const Wall *wall, const ImportOptions *options, ImportReport *report, const char *name, End *root, Faults *faults)
{
    const double wider = 1.26;       // a parent is as much wider than each of two equal children (Murray)
    double best = -INFINITY, closed = 0;
    for (int c = 0; c < fine->curve_count; c++)
        for (int last = 0; last < 2; last++) {
            End end = end_at(fine, wall, c, last);
            if (end_is_joined(fine, c, end.sample))
                continue;
            Vec3 place = end.opening >= 0 ? wall->opening[end.opening].center : fine->point[end.sample];
            double value = options->has_root ? -vec3_distance(place, options->root) : (end.opening >= 0 ? 1e6 + wall->opening[end.opening].radius : end.radius);
            if (value > best) {
                best = value;
                *root = end;
            }
            if (end.opening < 0 && end.radius > closed)
                closed = end.radius, report->closed = place;
        }
    if (best == -INFINITY) {
        faults_add(faults, name, 0, 0, "the centrelines have no free end where a tool could enter: all of them form closed loops");
        return false;
    }
    if (options->has_root && -best > 4 * root->radius + 1) {
        Vec3 p = fine->point[root->sample];
        faults_add(faults, name, 0, 0, "no centreline ends near the root (%g, %g, %g); the nearest end is (%.4g, %.4g, %.4g), %.4g mm away", options->root.x,
                   options->root.y, options->root.z, p.x, p.y, p.z, -best);
        return false;
    }
    report->root_radius = root->opening >= 0 ? wall->opening[root->opening].radius : root->radius;
    report->closed_radius = !options->has_root && root->opening >= 0 && closed > wider * report->root_radius ? closed : 0;
    return true;
}

// --- growing ---

static int grow(Growing *g, Vec3 point, double radius, double given, int parent)
{
    Skeleton *s = g->s;
    int i = s->count++;          // the caller allocated space for every sample and two extensions to openings per curve
    s->point[i] = point;
    s->radius[i] = radius;
    s->given[i] = given;
    s->parent[i] = parent;
    g->arc[i] = parent < 0 ? 0 : g->arc[parent] + vec3_distance(point, s->point[parent]);
    g->children[i] = 0;
    if (parent >= 0)
        g->children[parent]++;
    return i;
}

static void look_again(Fine *fine, const Skeleton *s, int first)
{
    for (int i = 0; i < fine->count; i++) {
        if (fine->done[i])
            continue;
        for (int k = first; k < s->count; k++) {
            double d = vec3_distance(fine->point[i], s->point[k]);
            if (d < fine->distance[i]) {
                fine->distance[i] = d;
                fine->nearest[i] = k;
            }
        }
    }
}

static bool touches(const Fine *fine, const Skeleton *s, int i) { return fine->distance[i] < SAME * fmin(fine->radius[i], s->radius[fine->nearest[i]]); }

// Appends the samples from `at` on, towards `end` (exclusive), while they lie apart from the tree. Returns true if any was added.
static bool grow_run(Growing *g, Fine *fine, int at, int step, int end, ImportReport *report)
{
    while (at != end && touches(fine, g->s, at)) {
        fine->done[at] = true;
        at += step;
    }
    if (at == end || fine->done[at])
        return false;
    int from = at, last = at, parent = fine->nearest[at - step], first = g->s->count;
    while (last != end && !fine->done[last] && !touches(fine, g->s, last))
        last += step;
    bool closes = last != end;
    double length = 0, clear = 0;
    for (int i = from; i != last; i += step) {
        length += i != from ? vec3_distance(fine->point[i], fine->point[i - step]) : 0;
        clear = fmax(clear, fine->distance[i] - g->s->radius[fine->nearest[i]]);
    }
    // a curve that never leaves the tree's spheres is the same vessel drawn twice, or a stub
    bool stub = clear < 0.5 * fine->radius[closes ? from : last - step] && (closes || length < 2 * g->s->radius[parent]);
    for (int i = from; i != last; i += step) {
        fine->done[i] = true;
        if (!stub)
            parent = fine->nearest[i] = grow(g, fine->point[i], fine->radius[i], fine->given[i], parent);
        fine->distance[i] = stub ? fine->distance[i] : 0;
    }
    if (closes && !stub && report->loop_count++ == 0)
        report->loop = fine->point[last];
    if (!stub)
        look_again(fine, g->s, first);
    return !stub;
}

static int curve_of(const Fine *fine, int sample)
{
    int c = 0;
    while (fine->offset[c + 1] <= sample)
        c++;
    return c;
}

static void grow_all(Growing *g, Fine *fine, ImportReport *report)
{
    for (;;) {
        int best = -1;
        for (int i = 0; i < fine->count; i++)
            if (!fine->done[i] && touches(fine, g->s, i) && (best < 0 || g->arc[fine->nearest[i]] < g->arc[fine->nearest[best]]))
                best = i;
        if (best < 0)   // take a curve that begins within a vessel but off its centreline
            for (int i = 0; i < fine->count; i++)
                if (!fine->done[i] && fine->distance[i] < g->s->radius[fine->nearest[i]] + fine->radius[i] &&
                    (best < 0 || fine->distance[i] < fine->distance[best]))
                    best = i;
        if (best < 0)
            return;
        int c = curve_of(fine, best);
        fine->done[best] = true;
        grow_run(g, fine, best + 1, 1, fine->offset[c + 1], report);
        grow_run(g, fine, best - 1, -1, fine->offset[c] - 1, report);
    }
}

// --- ends at openings ---

// Point of the opening at which a curve from `from` ends: straight ahead, unless that is far from the opening's centre.
static Vec3 exit_point(const Opening *opening, Vec3 from)
{
    Vec3 to = vec3_sub(from, opening->center), there = vec3_add_scaled(from, -vec3_dot(to, opening->normal), opening->normal);
    return vec3_distance(there, opening->center) < 0.3 * opening->radius ? there : opening->center;
}

// Returns true if a curve has run into the corner between an opening and its wall, or past the opening's plane.
static bool is_in_corner(const Opening *opening, Vec3 p)
{
    Vec3 to = vec3_sub(p, opening->center);
    double depth = -vec3_dot(to, opening->normal), aside = sqrt(fmax(0, vec3_norm2(to) - depth * depth));
    return depth < EDGE * opening->radius || (depth < opening->radius && aside > CORNER * opening->radius);
}

// Removes the end's last samples that lie in the corner or past the opening's plane, and extends the curve straight to the opening.
static bool lead_to_opening(Growing *g, const Wall *wall, int end, bool *kept, double reach)
{
    Skeleton *s = g->s;
    double arc = 0, radius = s->radius[end];
    int far = end;
    for (; s->parent[far] >= 0 && arc < 1.5 * radius; far = s->parent[far]) {
        arc += vec3_distance(s->point[far], s->point[s->parent[far]]);
        radius = fmax(radius, s->radius[far]);
    }
    Vec3 outward = vec3_unit(vec3_sub(s->point[end], s->point[far]));
    int o = wall_opening_near(wall, s->point[end], outward, radius);
    if (o < 0)
        return false;
    const Opening *opening = &wall->opening[o];
    int at = end;
    while (s->parent[at] >= 0 && g->children[end] == 0 && is_in_corner(opening, s->point[at])) {
        int up = s->parent[at];
        bool branches = false;
        for (int k = up + 1; k < s->count && !branches; k++)
            branches = kept[k] && k != at && s->parent[k] == up;
        if (branches)
            break;
        kept[at] = false;
        at = up;
    }
    Vec3 from = s->point[at], out = exit_point(opening, from);
    int steps = (int)fmin(ceil(vec3_distance(from, out) / fmax(STEP * opening->radius, reach)), 200);
    for (int k = 1; k <= steps; k++) {
        Vec3 p = vec3_mix(from, out, (double)k / steps);
        at = grow(g, p, inscribed(wall, p), s->given[at], at);
        kept[at] = true;
    }
    s->is_open_end[at] = steps > 0;
    return true;
}

// Removes the narrow last piece of a closed end, with less than half of the width before it: there the end tapers or its curve runs into the wall. The nodes
// before it cover this piece.
static void blunt_end(const Growing *g, int end, bool *kept)
{
    const Skeleton *s = g->s;
    for (int from = end, to;; from = to) {
        double widest = s->radius[from], arc = 0;
        for (int i = from; s->parent[i] > 0 && g->children[s->parent[i]] < 2 && arc < 15 * widest; i = s->parent[i]) {
            arc += vec3_distance(s->point[i], s->point[s->parent[i]]);
            widest = fmax(widest, s->radius[s->parent[i]]);
        }
        for (to = from; s->radius[to] < 0.5 * widest && s->parent[to] > 0 && g->children[s->parent[to]] < 2; to = s->parent[to])
            kept[to] = false;
        if (to == from)
            return;
    }
}

static void drop_samples(Skeleton *s, const bool *kept, int *place)
{
    int n = 0;
    for (int i = 0; i < s->count; i++) {
        place[i] = n;
        if (!kept[i])
            continue;
        s->point[n] = s->point[i];
        s->radius[n] = s->radius[i];
        s->given[n] = s->given[i];
        s->is_open_end[n] = s->is_open_end[i];
        s->parent[n] = s->parent[i] < 0 ? -1 : place[s->parent[i]];
        n++;
    }
    s->count = n;
}

static Skeleton *skeleton_create(size_t room)
{
    Skeleton *s = calloc(1, sizeof *s);
    if (!s)
        return NULL;
    s->point = calloc(room, sizeof *s->point);
    s->radius = calloc(room, sizeof *s->radius);
    s->given = calloc(room, sizeof *s->given);
    s->parent = calloc(room, sizeof *s->parent);
    s->is_open_end = calloc(room, sizeof *s->is_open_end);
    if (s->point && s->radius && s->given && s->parent && s->is_open_end)
        return s;
    skeleton_free(s);
    return NULL;
}

static bool build(Growing *g, Fine *fine, const Wall *wall, const ImportOptions *options, ImportReport *report, bool *kept, int *place, const char *name,
                  Faults *faults)
{
    End root = {.opening = -1};
    if (!choose_root(fine, wall, options, report, name, &root, faults))
        return false;
    Skeleton *s = g->s;
    int c = curve_of(fine, root.sample), at = root.sample, parent = -1;
    if (root.opening >= 0) {
        const Opening *opening = &wall->opening[root.opening];
        int last = root.step > 0 ? fine->offset[c + 1] - 1 : fine->offset[c];
        for (; at != last && is_in_corner(opening, fine->point[at]); at += root.step)
            fine->done[at] = true;
        Vec3 out = exit_point(opening, fine->point[at]);
        double length = vec3_distance(fine->point[at], out);
        int steps = (int)fmin(fmax(ceil(length / (STEP * opening->radius)), 1), 200);
        for (int k = 0; k < steps; k++) {
            Vec3 p = vec3_mix(out, fine->point[at], (double)k / steps);
            parent = grow(g, p, inscribed(wall, p), fine->given[at], parent);
        }
        s->is_open_end[0] = true;
    } else if (options->has_root) {
        // cut behind the tip's taper, at the first place that is nearly as wide as the vessel
        int last = root.step > 0 ? fine->offset[c + 1] - 1 : fine->offset[c];
        for (bool narrow = true; narrow;) {
            double widest = fine->radius[at], arc = 0;
            for (int k = at; k != last && arc < 2 * fmax(widest, fine->given[at]); k += root.step) {
                widest = fmax(widest, fine->radius[k]);
                arc += vec3_distance(fine->point[k], fine->point[k + root.step]);
            }
            narrow = at != last && fine->radius[at] < 0.7 * widest;
            if (narrow) {
                report->root_cut += vec3_distance(fine->point[at], fine->point[at + root.step]);
                fine->done[at] = true;
                at += root.step;
            }
        }
        report->root_is_cut = s->is_open_end[0] = true;
    }
    for (int end = root.step > 0 ? fine->offset[c + 1] : fine->offset[c] - 1; at != end; at += root.step) {
        parent = fine->nearest[at] = grow(g, fine->point[at], fine->radius[at], fine->given[at], parent);
        fine->distance[at] = 0;
        fine->done[at] = true;
    }
    look_again(fine, s, 0);
    grow_all(g, fine, report);
    for (int k = 0; k < fine->curve_count; k++) {
        bool lost = true;
        for (int i = fine->offset[k]; i < fine->offset[k + 1]; i++)
            lost = lost && !fine->done[i];
        if (lost && report->lost_curves++ == 0)
            report->lost = fine->point[fine->offset[k]];
    }
    for (int i = 0; i < s->count; i++)
        kept[i] = true;
    for (int i = 1, grown = s->count; i < grown; i++)
        if (g->children[i] == 0 && !lead_to_opening(g, wall, i, kept, 1e-6))
            blunt_end(g, i, kept);
    drop_samples(s, kept, place);
    return true;
}

Skeleton *skeleton_join(const CurveSet *set, const Wall *wall, const ImportOptions *options, ImportReport *report, const char *name, Faults *faults)
{
    Fine fine;
    Growing g = {0};
    bool *kept = NULL, good = fine_create(set, wall, &fine);
    int *place = NULL;
    if (good) {
        size_t room = (size_t)fine.count + 201 * (2 * (size_t)set->curve_count + 2);
        g.s = skeleton_create(room);
        g.arc = calloc(room, sizeof *g.arc);
        g.children = calloc(room, sizeof *g.children);
        kept = calloc(room, sizeof *kept);
        place = calloc(room, sizeof *place);
        good = g.s && g.arc && g.children && kept && place;
    }
    if (!good)
        faults_add(faults, name, 0, 0, "not enough memory");
    good = good && build(&g, &fine, wall, options, report, kept, place, name, faults);
    free(g.arc);
    free(g.children);
    free(kept);
    free(place);
    fine_free(&fine);
    if (good)
        return g.s;
    skeleton_free(g.s);
    return NULL;
}

void skeleton_free(Skeleton *s)
{
    if (!s)
        return;
    free(s->point);
    free(s->radius);
    free(s->given);
    free(s->parent);
    free(s->is_open_end);
    free(s);
}
