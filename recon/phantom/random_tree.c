#include "recon/phantom/random_tree.h"

#include "base/base.h"
#include "recon/phantom/phantom_field.h"

#include <stdlib.h>
#include <string.h>

typedef struct GrowingPart { // a part of the shape while it grows
    double (*knot)[4];       // (KNOTS)
    int count, parent;
    Vec3 start;              // direction at its start
} GrowingPart;

typedef struct Segment {     // a vessel segment from bifurcation to bifurcation
    int part, first, last;   // its part, and the range of its knots
    int parent, sibling;     // -1: none
    double radius, length;
    Vec3 direction;          // direction at its end
    bool is_tip;
} Segment;

typedef struct Bead {        // a ball on a segment that other vessels must keep clear of
    Vec3 center;
    double radius, arc;      // arc: length from the segment's start
    int segment;
} Bead;

enum { SEGMENT_KNOTS = 24 };

typedef struct Draft {       // a proposed segment
    double knot[SEGMENT_KNOTS][4];
    int count;
    Bead bead[SEGMENT_KNOTS];
    Vec3 direction;
    double radius, length;
} Draft;

typedef struct Growth {
    GrowingPart *part;
    Segment *segment;
    Bead *bead;
    int part_count, segment_count, bead_count, bead_capacity;
    double clearance;
    Random random;
} Growth;

static double random_between(Random *random, double low, double high) { return low + (high - low) * random_open(random); }

static Vec3 random_direction(Random *random)
{
    double z = random_between(random, -1, 1), angle = random_between(random, 0, 2 * PI), ring = sqrt(1 - z * z);
    return vec3(ring * same_cos(angle), ring * same_sin(angle), z);
}

// Draws a segment from x along d: first it turns by `turn` towards `side`, then its direction wanders randomly. The radius changes from r0 to r over a length
// of 3 r0.
static void draw(Random *random, Vec3 x, Vec3 d, Vec3 side, double turn, double r0, double r, Draft *out)
{
    double step = r, bend = 3 * r, length = random_between(random, 6, 11) * r + 1.5 * (r0 - r);
    Vec3 curve = {0, 0, 0};
    *out = (Draft){.count = (int)ceil(length / step), .radius = r};
    for (int i = 0; i < out->count; i++) {
        Vec3 before = d;
        if (turn > 0) {
            double by = fmin(turn, step / bend);
            Vec3 across = vec3_unit(vec3_add_scaled(side, -vec3_dot(side, d), d));
            d = vec3_unit(vec3_add(vec3_scale(d, same_cos(by)), vec3_scale(across, same_sin(by))));
            turn -= by;
        } else {
            curve = vec3_add_scaled(vec3_scale(curve, 0.75), 0.12 / r, random_direction(random));
            double sharp = vec3_norm(curve) * 4 * r;   // no bend tighter than four radii
            d = vec3_unit(vec3_add_scaled(d, step / fmax(1, sharp), vec3_add_scaled(curve, -vec3_dot(curve, d), d)));
        }
        x = vec3_add_scaled(x, step, vec3_unit(vec3_add(before, d)));
        out->length += step;
        double u = fmin(1, out->length / (3 * r0)), here = r0 + (r - r0) * u * u * (3 - 2 * u);
        memcpy(out->knot[i], (double[4]){x.x, x.y, x.z, here}, sizeof out->knot[i]);
        out->bead[i] = (Bead){.center = x, .radius = here, .arc = out->length};
    }
    out->direction = d;
}

static bool collides(const Bead *a, const Bead *b, double clearance)
{
    double least = a->radius + b->radius + clearance + 0.5 * fmax(a->radius, b->radius);   // beads are up to a radius apart
    return vec3_norm2(vec3_sub(a->center, b->center)) < least * least;
}

// Returns true if the draft, which grows from segment `parent`, keeps clear of everything except what it must touch: itself, its parent, and `sibling` near
// the bifurcation.
static bool fits(const Growth *g, const Draft *draft, int parent, double zone, const Draft *sibling)
{
    for (int i = 0; i < draft->count; i++) {
        const Bead *bead = &draft->bead[i];
        for (int k = 0; k < i; k++)
            if (bead->arc - draft->bead[k].arc > 6 * draft->radius && collides(bead, &draft->bead[k], g->clearance))
                return false;
        for (int k = 0; sibling && k < sibling->count; k++)
            if (!(bead->arc < zone && sibling->bead[k].arc < zone) && collides(bead, &sibling->bead[k], g->clearance))
                return false;
        for (int k = 0; k < g->bead_count; k++) {
            const Bead *other = &g->bead[k];
            bool near_split = other->segment == parent && bead->arc < zone && g->segment[parent].length - other->arc < zone;
            if (!near_split && collides(bead, other, g->clearance))
                return false;
        }
    }
    return true;
}

static bool take(Growth *g, const Draft *draft, int part, int parent)
{
    if (g->bead_count + draft->count > g->bead_capacity) {
        int capacity = 2 * g->bead_capacity + 1024;
        Bead *more = realloc(g->bead, (size_t)capacity * sizeof *more);
        if (!more)
            return false;
        g->bead = more;
        g->bead_capacity = capacity;
    }
    GrowingPart *w = &g->part[part];
    Segment *s = &g->segment[g->segment_count];
    *s = (Segment){.part = part,
                   .first = w->count,
                   .parent = parent,
                   .sibling = -1,
                   .radius = draft->radius,
                   .length = draft->length,
                   .direction = draft->direction,
                   .is_tip = true};
    memcpy(w->knot + w->count, draft->knot, (size_t)draft->count * sizeof draft->knot[0]);
    w->count += draft->count;
    s->last = w->count - 1;
    for (int i = 0; i < draft->count; i++) {
        g->bead[g->bead_count] = draft->bead[i];
        g->bead[g->bead_count++].segment = g->segment_count;
    }
    g->segment_count++;
    return true;
}

static Vec3 knot_center(const double knot[4]) { return vec3(knot[0], knot[1], knot[2]); }

static bool start_part(Growth *g, int parent, const double knot[4], Vec3 direction)
{
    GrowingPart *w = &g->part[g->part_count];
    *w = (GrowingPart){.knot = calloc(KNOTS, sizeof *w->knot), .count = 1, .parent = parent, .start = direction};
    if (!w->knot)
        return false;
    g->part_count++;
    memcpy(w->knot[0], knot, sizeof w->knot[0]);
    return true;
}

// Splits the tip. Returns false if no split fits; sets `*failed` if out of memory.
static bool split(Growth *g, int tip, bool *failed)
{
    Segment parent = g->segment[tip];
    const GrowingPart *part = &g->part[parent.part];
    Vec3 x = knot_center(part->knot[parent.last]), d = parent.direction, e1 = vec3_normal_to(d), e2 = vec3_cross(d, e1);
    double r0 = parent.radius, zone = 5 * r0;
    for (int attempt = 0; attempt < 60 && part->count + SEGMENT_KNOTS < KNOTS; attempt++) {
        double ratio = random_between(&g->random, 0.5, 1), r1 = r0 / same_cbrt(1 + ratio * ratio * ratio), r2 = ratio * r1;
        double q0 = same_square(same_square(r0)), q1 = same_square(same_square(r1)), q2 = same_square(same_square(r2));
        double angle = random_between(&g->random, 0, 2 * PI);
        Vec3 side = vec3_add(vec3_scale(e1, same_cos(angle)), vec3_scale(e2, same_sin(angle)));
        Draft one, two;
        draw(&g->random, x, d, side, same_acos((q0 + q1 - q2) / (2 * r0 * r0 * r1 * r1)), r0, r1, &one);
        draw(&g->random, x, d, vec3_negate(side), same_acos((q0 + q2 - q1) / (2 * r0 * r0 * r2 * r2)), r2, r2, &two);
        if (!fits(g, &one, tip, zone, NULL) || !fits(g, &two, tip, zone, &one))
            continue;
        double first[4] = {x.x, x.y, x.z, r2};
        *failed = !take(g, &one, parent.part, tip) || !start_part(g, parent.part, first, d) || !take(g, &two, g->part_count - 1, tip);
        g->segment[tip].is_tip = false;
        return true;
    }
    return false;
}

// Adds a sac on the side of a random branch: a neck, and a sphere a third of a vessel's radius off the wall.
static bool add_sac(Growth *g, Shape *shape)
{
    for (int attempt = 0; attempt < 300; attempt++) {
        const Bead *seat = &g->bead[(int)(random_open(&g->random) * g->bead_count)];
        const Segment *s = &g->segment[seat->segment];
        double r = seat->radius, size = random_between(&g->random, 1.4, 2.2) * r, far = 1.35 * r + size;
        int k = s->first + (int)(seat->arc / s->radius + 0.5) - 1;
        if (seat->arc < 4 * r || s->length - seat->arc < 4 * r || k <= s->first || k >= s->last)
            continue;
        Vec3 along = vec3_unit(vec3_sub(knot_center(g->part[s->part].knot[k + 1]), knot_center(g->part[s->part].knot[k - 1])));
        Vec3 side = random_direction(&g->random);
        side = vec3_unit(vec3_add_scaled(side, -vec3_dot(side, along), along));
        Bead ball = {.center = vec3_add_scaled(seat->center, far, side), .radius = size, .segment = seat->segment};
        bool good = true;
        for (int i = 0; i < g->bead_count && good; i++) {
            bool own = g->bead[i].segment == seat->segment;
            double least = size + g->bead[i].radius + (own ? 0.2 * r : 1.5 * g->clearance);
            good = vec3_distance(ball.center, g->bead[i].center) > least;
        }
        if (!good)
            continue;
        double knot[5][4];
        const double at[5] = {0, 0.9 * r, 1.7 * r, far - 0.26 * size, far}, radius[5] = {0.7 * r, 0.7 * r, 0.72 * size, 0.96 * size, size};
        for (int i = 0; i < 5; i++) {
            Vec3 c = vec3_add_scaled(seat->center, at[i], side);
            memcpy(knot[i], (double[4]){c.x, c.y, c.z, radius[i]}, sizeof knot[i]);
        }
        if (g->bead_count == g->bead_capacity) {
            Bead *more = realloc(g->bead, (size_t)(g->bead_capacity + 1024) * sizeof *more);
            if (!more)
                return false;
            g->bead = more;
            g->bead_capacity += 1024;
        }
        int part = s->part;
        g->bead[g->bead_count++] = ball;   // arc 0: no other sac is placed on it
        return shape_add(shape, (const double(*)[4])knot, 5, false, false, part, NODE_ANEURYSM, NULL);
    }
    return true;
}

bool shape_add_block(Shape *shape, Vec3 x, Vec3 d, Vec3 half, double gap_mm, Random *random)
{
    Vec3 turned = random_direction(random);
    ShapeBlock block = {.half = half, .axis = {d}};
    bool settled = false;
    block.axis[1] = vec3_unit(vec3_add_scaled(turned, -vec3_dot(turned, d), d));
    block.axis[2] = vec3_cross(block.axis[0], block.axis[1]);
    block.center = vec3_add_scaled(x, half.x, d);
    for (int round = 0; round < 60 && !settled; round++) {
        double least = HUGE_VAL;
        for (int p = 0; p < shape->part_count; p++)
            for (int i = 0; i < shape->part[p].sample_count; i++)
                least = fmin(least, -shape_block_distance(&block, shape->part[p].sample[i]) - shape->part[p].sample_radius[i]);
        settled = fabs(least - gap_mm) < 1e-6;
        block.center = vec3_add_scaled(block.center, gap_mm - least, d);
    }
    ShapeBlock *more = !settled ? NULL : realloc(shape->block, (size_t)(shape->block_count + 1) * sizeof *more);
    if (!more)
        return false;
    shape->block = more;
    shape->block[shape->block_count++] = block;
    return true;
}

bool random_tree_grow(Shape *shape, const RandomTreeOptions *o, const char *file, Faults *faults)
{
    int most = o->branches + 2, before = faults->count;
    Growth g = {.part = calloc((size_t)most, sizeof(GrowingPart)),
                .segment = calloc((size_t)most, sizeof(Segment)),
                .clearance = 0.5 * o->radius_mm,
                .random = {o->seed}};
    bool failed = !g.part || !g.segment;
    const double root[4] = {0, 0, 0, o->radius_mm};
    if (!failed) {
        Draft trunk;
        draw(&g.random, vec3(0, 0, 0), vec3(0, 0, 1), vec3(1, 0, 0), 0, o->radius_mm, o->radius_mm, &trunk);
        failed = !start_part(&g, -1, root, vec3(0, 0, 1)) || !take(&g, &trunk, 0, -1);
    }
    while (!failed && g.segment_count + 2 <= o->branches) {
        int tip = -1;
        for (int i = 0; i < g.segment_count; i++)
            if (g.segment[i].is_tip && (tip < 0 || g.segment[i].radius > g.segment[tip].radius))
                tip = i;
        if (tip < 0) {
            faults_add(faults, file, 0, 0, "no space for %d branches: only %d fit; try another seed", o->branches, g.segment_count);
            break;
        }
        if (!split(&g, tip, &failed))
            g.segment[tip].is_tip = false;
    }
    for (int w = 0; w < g.part_count && !failed; w++) {
        const GrowingPart *part = &g.part[w];
        const double slope[2][4] = {{part->start.x, part->start.y, part->start.z, 0}, {(double)NAN, (double)NAN, (double)NAN, (double)NAN}};
        failed = !shape_add(shape, (const double(*)[4])part->knot, part->count, w == 0, false, part->parent, NODE_VESSEL, slope);
    }
    for (int i = 0; i < o->sacs && !failed; i++)
        failed = !add_sac(&g, shape);
    for (int i = 0, left = 40; i < o->blocks && !failed; failed = left == 0) {
        const Bead *seat = &g.bead[(int)(random_open(&g.random) * g.bead_count)];
        double size = 2 * o->radius_mm;
        double half[3];   // drawn in separate statements, because the order within an initialiser is unspecified
        for (int k = 0; k < 3; k++)
            half[k] = random_between(&g.random, 0.5, 1.5) * size;
        bool added = shape_add_block(shape, seat->center, random_direction(&g.random), vec3(half[0], half[1], half[2]), o->gap_mm, &g.random);
        i += added;
        left = added ? 40 : left - 1;
    }
    if (failed && faults->count == before)
        faults_add(faults, file, 0, 0, "cannot build a tree of %d branches with %d blocks: no free space, or out of memory", o->branches, o->blocks);
    for (int w = 0; w < g.part_count; w++)
        free(g.part[w].knot);
    free(g.part);
    free(g.segment);
    free(g.bead);
    return !failed && faults->count == before;
}
