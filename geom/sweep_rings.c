// Rings of the swept model's mesh (sweep_mesh.h).
//
// Places. t is divided into intervals from i 2^k to (i+1) 2^k, the largest of which are halved until they are no longer than sqrt 2 edges: so a ring's place
// depends on nothing but the radius near it.
// Vertices. A point in the plane of t has n = u.N, b = u.B and u.S' = 0, so u = n p + b q with the dual vectors p = B x S'/d, q = S' x N/d, d = N.(B x S'): the
// vertex at the angle a has n = R cos a, b = R sin a. On a dome the frame is constant, and the ray in the direction (cos c cos a, cos c sin a, sin c) meets the
// wall at rho = R(zeta, t(rho sin c)), found by fixed-point iteration.
#include "geom/sweep_mesh_parts.h"

#include "base/base.h"

#include <stdlib.h>
#include <string.h>

static const double FULL_TURN = 6.283185307179586476925;

double mesh_edge(const SweepMeshParts *parts, int branch, double t)
{
    const SweepField *field = parts->feet.field;
    double radius = fmax(sweep_field_mean(field, branch, t), 0.05 * field->model->branch[branch].radius);
    return parts->options.edge_mm > 0 ? fmin(parts->options.edge_mm, FULL_TURN / 6 * radius) : FULL_TURN * radius / parts->options.around;
}

int mesh_around(const SweepMeshParts *parts, int branch, double t)
{
    enum { LEAST = 6, MOST = 256 };
    if (!(parts->options.edge_mm > 0))
        return parts->options.around;
    double count = FULL_TURN * sweep_field_mean(parts->feet.field, branch, t) / parts->options.edge_mm;
    return count > LEAST ? count < MOST ? (int)(count + 0.5) : MOST : LEAST;
}

bool mesh_carries_rings(const SweepField *field, int segment)
{
    SEL_ASSERT(segment >= 0 && segment < field->first_segment[field->branch_count], "the segment is one of the field");
    return field->segment[segment].is_shaped == 0;
}

// --- Planes ---

static Vec3 cubic(const Vec3 *c, double x) { return vec3_add_scaled(c[0], x, vec3_add_scaled(c[1], x, vec3_add_scaled(c[2], x, c[3]))); }

static void terms_at(const SweepSegment *s, double x, double term[SWEEP_TERMS])
{
    for (int k = 0; k < SWEEP_TERMS; k++)
        term[k] = s->section[k][0] + x * (s->section[k][1] + x * (s->section[k][2] + x * s->section[k][3]));
}

// Re sum_k c_k zeta^k
static double radius_of(const double term[SWEEP_TERMS], double x, double y)
{
    double re = x, im = y, r = term[0];
    for (int k = 1; k <= SWEEP_HARMONICS; k++) {
        r += term[2 * k - 1] * re + term[2 * k] * im;
        double next = re * x - im * y;
        im = re * y + im * x, re = next;
    }
    return r;
}

MeshPlane mesh_plane(const SweepFeet *feet, int branch, double t)
{
    const SweepField *field = feet->field;
    double length = field->curve[branch]->length;
    MeshPlane plane = {.branch = branch, .t = t};
    // the section at an end belongs to the segment before it, which has w = 0
    plane.segment_index = sweep_field_segment(field, branch, t);
    if (t >= length)
        plane.segment_index = field->first_segment[branch + 1] - 3;
    const SweepSegment *s = plane.segment = &field->segment[plane.segment_index];
    double x = t - s->origin;
    plane.s = cubic(s->s, x), plane.n = cubic(s->n, x), plane.b = cubic(s->b, x);
    plane.s1 = vec3_add_scaled(s->s[1], x, vec3_add_scaled(vec3_scale(s->s[2], 2), 3 * x, s->s[3]));
    plane.s2 = vec3_add_scaled(vec3_scale(s->s[2], 2), 6 * x, s->s[3]);
    Vec3 across = vec3_cross(plane.b, plane.s1);
    double inverse = 1 / vec3_dot(plane.n, across);
    plane.p = vec3_scale(across, inverse), plane.q = vec3_scale(vec3_cross(plane.s1, plane.n), inverse);
    terms_at(s, x, plane.term);
    return plane;
}

Vec3 mesh_plane_point(const MeshPlane *plane, double cosine, double sine)
{
    double r = radius_of(plane->term, cosine, sine);
    return vec3_add_scaled(vec3_add_scaled(plane->s, r * cosine, plane->p), r * sine, plane->q);
}

Vec3 mesh_plane_blended(const SweepFeet *feet, const MeshPlane *plane, Vec3 x)
{
    enum { ROUNDS = 30 };
    Vec3 normal = vec3_unit(plane->s1);
    SweepPlace place = {.branch = plane->branch, .t = plane->t};
    SweepBlend blend;
    x = vec3_add_scaled(x, -vec3_dot(vec3_sub(x, plane->s), normal), normal);
    for (int round = 0; round < ROUNDS; round++) {
        sweep_field_blend(feet->field, place, x, &blend);
        Vec3 g = vec3_add_scaled(blend.gradient, -vec3_dot(blend.gradient, normal), normal);
        double step = -blend.f / fmax(vec3_norm2(g), 1e-6);
        x = vec3_add_scaled(x, step, g);
        if (fabs(step) < 1e-13 * plane->term[0])
            break;
    }
    return x;
}

// --- Normals ---

void mesh_set_place(const SweepFeet *feet, SweepBlock *b, int lane, const SweepPlace *place)
{
    if (place->branch >= 0)
        sweep_block_place(feet, b, lane, sweep_field_segment(feet->field, place->branch, place->t), -1, place->t);
    else
        sweep_block_place(feet, b, lane, -1, place->sac, 0);
}

SweepPlace mesh_owner(const SweepBlock *b, int lane)
{
    int owner = b->owner[lane];
    if (owner < 0)
        return (SweepPlace){.branch = -1, .sac = b->sac[lane]};
    return (SweepPlace){.branch = b->view[lane]->of[owner].branch, .t = b->part[owner].t[lane], .sac = -1};
}

void mesh_normals(const SweepFeet *feet, int count, const Vec3 *at, SweepPlace *place, Vec3 *normal)
{
    for (int first = 0; first < count; first += FOOT_BLOCK) {
        SweepBlock b;
        sweep_block_begin(&b);
        for (int i = 0; i < FOOT_BLOCK; i++) {
            int v = first + i < count ? first + i : first;
            mesh_set_place(feet, &b, i, &place[v]);
            b.foot.at.x[i] = at[v].x, b.foot.at.y[i] = at[v].y, b.foot.at.z[i] = at[v].z;
        }
        sweep_block_slope(feet, &b, FOOT_ALL);
        for (int i = 0; i < FOOT_BLOCK && first + i < count; i++) {
            normal[first + i] = vec3_unit(vec3(-b.foot.at.gx[i], -b.foot.at.gy[i], -b.foot.at.gz[i]));
            place[first + i] = mesh_owner(&b, i);
        }
    }
}

// --- Rings ---

static MeshRing *add_ring(MeshRings *rings, MeshRing ring)
{
    if (rings->count == rings->capacity) {
        rings->capacity = rings->capacity > 0 ? 2 * rings->capacity : 64;
        rings->ring = HEAP_GROWN(rings->ring, (size_t)rings->capacity, sizeof *rings->ring);
    }
    ring.first = rings->vertices;
    rings->vertices += ring.count;
    if (rings->vertices > rings->vertex_capacity) {
        rings->vertex_capacity = 2 * rings->vertices + 1024;
        rings->at = HEAP_GROWN(rings->at, (size_t)rings->vertex_capacity, sizeof *rings->at);
        rings->normal = HEAP_GROWN(rings->normal, (size_t)rings->vertex_capacity, sizeof *rings->normal);
    }
    rings->ring[rings->count] = ring;
    return &rings->ring[rings->count++];
}

static void add_mark(MeshRings *rings, MeshMark mark)
{
    MeshMark *last = rings->marks > 0 ? &rings->mark[rings->marks - 1] : NULL;
    for (int i = rings->marks - 1; i >= 0 && rings->mark[i].ring == mark.ring; i--) {
        last = &rings->mark[i];
        if (last->branch == mark.branch && last->sac == mark.sac) {
            last->from = fmin(last->from, mark.from), last->to = fmax(last->to, mark.to);
            return;
        }
    }
    if (rings->marks == rings->mark_capacity) {
        rings->mark_capacity = rings->mark_capacity > 0 ? 2 * rings->mark_capacity : 64;
        rings->mark = HEAP_GROWN(rings->mark, (size_t)rings->mark_capacity, sizeof *rings->mark);
    }
    rings->mark[rings->marks++] = mark;
}

// What a vertex that is not on its branch's own wall blends with.
static void mark_vertex(const SweepMeshParts *parts, MeshRings *rings, int branch, double t, const SweepBlock *b, int lane)
{
    const SweepView *view = b->view[lane];
    double margin = mesh_edge(parts, branch, t);
    for (int k = 0; k < view->count; k++) {
        double there = b->part[k].t[lane];
        if (b->share[k][lane] > 0 && view->of[k].branch != branch)
            add_mark(rings, (MeshMark){.ring = rings->count - 1, .branch = view->of[k].branch, .sac = -1, .from = there - margin, .to = there + margin});
    }
    if (b->sac_share[lane] > 0)
        add_mark(rings, (MeshMark){.ring = rings->count - 1, .branch = -1, .sac = parts->feet.field->sac_group[b->sac[lane]]});
}

// Normals of a ring's vertices on the branch's own wall, and whether something else is blended there.
static void finish_ring(const SweepMeshParts *parts, int branch, MeshRings *rings, MeshRing *ring, int segment, double t)
{
    const SweepField *field = parts->feet.field;
    const SweepSegment *s = &field->segment[segment];
    bool alone = field->view[segment].count == 1 && field->view[segment].sac < 0;
    for (int first = 0; first < ring->count; first += FOOT_BLOCK) {
        SweepBlock b;
        sweep_block_begin(&b);
        FootSample *at = &b.foot.at;
        SweepPartLanes *p = &b.part[0];
        for (int i = 0; i < FOOT_BLOCK; i++) {
            Vec3 x = rings->at[ring->first + (first + i < ring->count ? first + i : first)];
            at->x[i] = x.x, at->y[i] = x.y, at->z[i] = x.z;
            double there = t;
            if (s->rise > 0)
                there = s->origin + vec3_dot(vec3_sub(x, s->s[0]), s->s[1]) / vec3_norm2(s->s[1]);
            p->segment[i] = &field->segment[sweep_field_segment(field, branch, there)];
            if (s->rise == 0)
                p->segment[i] = s;
            p->t[i] = there, p->absent[i] = 0;
            if (!alone)
                sweep_block_place(&parts->feet, &b, i, (int)(p->segment[i] - field->segment), -1, there);
        }
        if (alone)
            parts->feet.kernels->evaluate_slope(p, at->x, at->y, at->z, parts->feet.harmonics);
        else
            sweep_block_slope(&parts->feet, &b, FOOT_ALL);
        for (int i = 0; i < FOOT_BLOCK && first + i < ring->count; i++) {
            int v = ring->first + first + i;
            Vec3 g = alone ? vec3(p->gx[i], p->gy[i], p->gz[i]) : vec3(at->gx[i], at->gy[i], at->gz[i]);
            rings->normal[v] = vec3_unit(vec3_negate(g));
            if (alone || (b.pure[i] && b.owner[i] == b.own[i]))
                continue;
            ring->is_blended = true;
            mark_vertex(parts, rings, branch, t, &b, i);
        }
    }
}

// The circle's `count` cosines and sines.
typedef struct Circle {
    int count;
    double cosine[256], sine[256];
} Circle;

static void turn_circle(Circle *circle, int count)
{
    if (circle->count == count)
        return;
    circle->count = count;
    for (int i = 0; i < count; i++)
        circle->cosine[i] = same_cos(FULL_TURN * i / count), circle->sine[i] = same_sin(FULL_TURN * i / count);
}

static void add_section(const SweepMeshParts *parts, int branch, double t, Circle *circle, MeshRings *rings)
{
    static const double LEAST = 0.1;         // of |S'|^2: the section's points would be beyond the focal line of the curve
    MeshPlane plane = mesh_plane(&parts->feet, branch, t);
    turn_circle(circle, mesh_around(parts, branch, t));
    MeshRing *ring = add_ring(rings, (MeshRing){.kind = RING_SECTION, .t = t, .count = circle->count});
    double speed2 = vec3_norm2(plane.s1);
    bool is_folded = false;
    for (int i = 0; i < circle->count; i++) {
        Vec3 x = mesh_plane_point(&plane, circle->cosine[i], circle->sine[i]);
        rings->at[ring->first + i] = x;
        is_folded |= speed2 - vec3_dot(vec3_sub(x, plane.s), plane.s2) < LEAST * speed2;
    }
    // the planes of the rings at the cuts must not meet inside the bend
    if (is_folded) {
        ring->is_blended = true;
        add_mark(rings, (MeshMark){.ring = rings->count - 1, .branch = branch, .sac = -1, .from = t - plane.term[0], .to = t + plane.term[0]});
    }
    finish_ring(parts, branch, rings, ring, plane.segment_index, t);
    ring->is_blended |= !mesh_carries_rings(parts->feet.field, plane.segment_index);
}

// Rings of the dome over an end, from the first ring inwards of the pole to the one next to the section; side -1: before the start.
static void add_dome(const SweepMeshParts *parts, int branch, double side, Circle *circle, MeshRings *rings)
{
    enum { ROUNDS = 60 };
    const SweepField *field = parts->feet.field;
    int first = field->first_segment[branch], last = field->first_segment[branch + 1] - 1, near = side > 0 ? last - 1 : first + 1,
        far = side > 0 ? last : first;
    const SweepSegment *s = &field->segment[near];
    double end = side > 0 ? field->curve[branch]->length : 0;
    int around = mesh_around(parts, branch, end), quarter = around > 7 ? (around + 2) / 4 : 2;
    Vec3 up = vec3_scale(s->s[1], side / s->rise);           // unit, over the end's plane
    turn_circle(circle, around);
    for (int step = 0; step < quarter; step++) {
        int level = side > 0 ? step + 1 : quarter - step;    // 1 … quarter, the pole
        bool pole = level == quarter;
        double polar = 0.25 * FULL_TURN * level / quarter, high = pole ? 1 : same_sin(polar), wide = pole ? 0 : same_cos(polar);
        MeshRing *ring = add_ring(rings, (MeshRing){.kind = pole ? RING_POLE : RING_DOME, .t = end, .polar = polar, .count = pole ? 1 : around});
        for (int i = 0; i < ring->count; i++) {
            double x = wide * circle->cosine[i], y = wide * circle->sine[i], rho = s->section[0][0], term[SWEEP_TERMS];
            for (int round = 0; round < ROUNDS; round++) {
                double t = s->origin + side * rho * high / s->rise, before = rho;
                const SweepSegment *here = t >= s->from && t <= s->to ? s : &field->segment[far];
                terms_at(here, t - here->origin, term);
                rho = radius_of(term, x, y);
                if (fabs(rho - before) <= 1e-15 * rho)
                    break;
            }
            Vec3 in = vec3_add_scaled(vec3_scale(s->n[0], x), y, s->b[0]);
            rings->at[ring->first + i] = vec3_add_scaled(vec3_add_scaled(s->s[0], rho, in), rho * high, up);
        }
        finish_ring(parts, branch, rings, ring, near, end + side * 1e-9);
    }
}

static void add_middle(const SweepMeshParts *parts, int branch, double t, MeshRings *rings)
{
    MeshPlane plane = mesh_plane(&parts->feet, branch, t);
    MeshRing *ring = add_ring(rings, (MeshRing){.kind = RING_MIDDLE, .t = t, .count = 1});
    rings->at[ring->first] = plane.s;
    rings->normal[ring->first] = vec3_scale(vec3_unit(plane.s1), t > 0 ? 1 : -1);
}

// The sections of from … from + size, without its end.
static void add_interval(const SweepMeshParts *parts, int branch, double from, double size, Circle *circle, MeshRings *rings)
{
    static const double LONGEST = 1.4142135623730951, SHORTEST = 0.4;
    double length = parts->feet.field->curve[branch]->length;
    if (from >= length)
        return;
    double edge = mesh_edge(parts, branch, fmin(length, from + 0.5 * size));
    if (size > LONGEST * edge) {
        add_interval(parts, branch, from, 0.5 * size, circle, rings);
        add_interval(parts, branch, from + 0.5 * size, 0.5 * size, circle, rings);
    } else if (from == 0 || length - from > SHORTEST * edge) {
        add_section(parts, branch, from, circle, rings);
    }
}

void mesh_rings_fill(const SweepMeshParts *parts, int branch, MeshRings *rings)
{
    const SweepField *field = parts->feet.field;
    const SweepBranch *b = &field->model->branch[branch];
    double length = field->curve[branch]->length, size = 1;
    Circle circle = {.count = 0};
    while (size < length)
        size *= 2;
    if (b->open_start)
        add_middle(parts, branch, 0, rings);
    else
        add_dome(parts, branch, -1, &circle, rings);
    rings->first_section = rings->count;
    add_interval(parts, branch, 0, size, &circle, rings);
    rings->last_section = rings->count;
    add_section(parts, branch, length, &circle, rings);
    if (parts->options.flat_ends)
        add_middle(parts, branch, length, rings);
    else
        add_dome(parts, branch, 1, &circle, rings);
    rings->in_patch = HEAP_ZEROED((size_t)rings->count, sizeof *rings->in_patch);
}

void mesh_rings_free(MeshRings *rings)
{
    free(rings->ring);
    free(rings->at);
    free(rings->normal);
    free(rings->in_patch);
    free(rings->mark);
    *rings = (MeshRings){0};
}
