// Feet on the wall of a swept model, see sweep_feet.h.
//
// A part that cannot matter is not evaluated: with d = |X - S| its field is at most R_largest - d, and M(x, y) = max(x, y) where they differ by more than
// 2 delta. The result is the same to the bit.
#include "geom/sweep_feet.h"

#include "geom/sweep_views.h"

#include <string.h>

void sweep_block_place(const SweepFeet *feet, SweepBlock *b, int i, int segment, int sac, double t)
{
    SEL_ASSERT(segment >= 0 || sac >= 0, "a place lies on a branch or on a sac");
    const SweepField *field = feet->field;
    b->segment[i] = segment;
    b->view[i] = segment >= 0 ? &field->view[segment] : &field->sac[sac].view;
    b->sac[i] = segment >= 0 ? b->view[i]->sac : sac;
    b->own_t[i] = t;
    b->own[i] = -1;
    b->keeps_t[i] = false;
    for (int k = 0; segment >= 0 && k < b->view[i]->count; k++)
        if (b->view[i]->of[k].slope == 1 && b->view[i]->of[k].t == 0 && segment >= field->first_segment[b->view[i]->of[k].branch] &&
            segment < field->first_segment[b->view[i]->of[k].branch + 1])
            b->own[i] = k;
}

// --- t ---

static int neighbour(const SweepField *field, const SweepSegment *s, double t)
{
    int at = (int)(s - field->segment);
    while (t < field->segment[at].from)
        at--;
    while (t > field->segment[at].to)
        at++;
    return at;
}

// Finds t of a part for the lanes of `lanes`.
static void seek_part(const SweepFeet *feet, SweepBlock *b, SweepPartLanes *p, unsigned lanes)
{
    enum { ROUNDS = 12 };
    for (int i = 0; i < FOOT_BLOCK; i++)
        p->settled[i] = lanes >> i & 1 ? 0 : 1;
    for (int round = 0; round < ROUNDS; round++) {
        unsigned outside, again = feet->kernels->seek(p, b->foot.at.x, b->foot.at.y, b->foot.at.z, &outside) & lanes;
        for (outside &= lanes; outside != 0; outside &= outside - 1) {
            int i = __builtin_ctz(outside);
            p->segment[i] = feet->field->segment + neighbour(feet->field, p->segment[i], p->t[i]);
        }
        if (again == 0)
            return;
    }
}

// Prepares part k of the lanes: where its search for t starts.
static void set_part(const SweepFeet *feet, SweepBlock *b, int k, unsigned lanes)
{
    const SweepField *field = feet->field;
    SweepPartLanes *p = &b->part[k];
    for (int i = 0; i < FOOT_BLOCK; i++) {
        const SweepView *view = b->view[i];
        if (!(lanes >> i & 1) && k < view->count)
            continue;    // a lane that is done keeps its parts
        if (k >= view->count) {
            p->absent[i] = 1;
            p->segment[i] = field->segment, p->t[i] = 0, p->longest[i] = 1, p->delta[i] = p->reach_inverse[i] = 0, p->away[i] = 0;
            continue;
        }
        const SweepCandidate *c = &view->of[k];
        const SweepFork *fork = &field->fork[c->branch];
        p->absent[i] = 0;
        p->longest[i] = 2 * field->model->branch[c->branch].radius;
        p->delta[i] = fork->delta, p->reach_inverse[i] = fork->reach > 0 ? 1 / fork->reach : 0;
        if (k == b->own[i]) {
            p->t[i] = b->own_t[i];
            p->segment[i] = field->segment + b->segment[i];
        } else {
            if (!b->keeps_t[i]) {
                double length = b->segment[i] >= 0 ? field->curve[view->of[b->own[i]].branch]->length : 0;
                p->t[i] = c->t + c->slope * fmax(0, fmin(length, b->own_t[i]));
            }
            p->segment[i] = field->segment + sweep_field_segment(field, c->branch, p->t[i]);
        }
    }
}

// --- Fields ---

static void evaluate_part(const SweepFeet *feet, SweepBlock *b, int k, unsigned lanes)
{
    SweepPartLanes *p = &b->part[k];
    SweepLane own;
    bool any = false;
    for (int i = 0; i < FOOT_BLOCK; i++) {
        own[i] = b->own[i] == k && (lanes >> i & 1) ? 1 : 0;
        any |= own[i] > 0;
    }
    feet->kernels->evaluate(p, b->foot.at.x, b->foot.at.y, b->foot.at.z, feet->harmonics, any ? &b->ring : NULL, own);
    for (int i = 0; i < FOOT_BLOCK; i++) {
        if (own[i] > 0) {
            b->is_flat[i] = p->segment[i]->rise == 0;
            b->own_t[i] = p->t[i];
            b->ring_x[i] = b->foot.at.x[i], b->ring_y[i] = b->foot.at.y[i], b->ring_z[i] = b->foot.at.z[i];
        }
    }
}

// Blends the sacs of the lanes in.
static void blend_sacs(const SweepFeet *feet, SweepBlock *b, unsigned lanes, unsigned sacs)
{
    SweepPartLanes p = {.f = {0}};
    SweepLane share;
    for (int i = 0; i < FOOT_BLOCK; i++) {
        p.absent[i] = 1, p.f[i] = -1e300;
        if (!(sacs >> i & 1))
            continue;
        SweepPart part;
        sweep_field_sac(feet->field, b->sac[i], vec3(b->foot.at.x[i], b->foot.at.y[i], b->foot.at.z[i]), &part);
        p.absent[i] = 0;
        b->sac[i] = part.sac;
        p.delta[i] = feet->field->sac[part.sac].delta;
        p.f[i] = part.f;
        p.gx[i] = part.gradient.x, p.gy[i] = part.gradient.y, p.gz[i] = part.gradient.z;
        p.hxx[i] = part.hessian.xx, p.hxy[i] = part.hessian.xy, p.hxz[i] = part.hessian.xz;
        p.hyy[i] = part.hessian.yy, p.hyz[i] = part.hessian.yz, p.hzz[i] = part.hessian.zz;
    }
    feet->kernels->blend(&b->foot.at, &p, share);
    for (int i = 0; i < FOOT_BLOCK; i++)
        if ((sacs & lanes) >> i & 1 && share[i] > 0.5)
            b->owner[i] = -1;
}

// Returns whether a part other than the own one may matter in a lane. Exact: see the head of the file.
static bool lanes_need(const SweepBlock *b, int k, unsigned lanes, const double *most)
{
    const SweepPartLanes *p = &b->part[k];
    for (int i = 0; i < FOOT_BLOCK; i++) {
        if (!(lanes >> i & 1) || p->absent[i] > 0 || k == b->own[i])
            continue;
        const SweepSegment *s = p->segment[i];
        // N and B are unit vectors except for small terms
        double away = 0.998 * same_hypot(p->away[i], s->rise * (p->t[i] - s->origin)), slack = 1e-6 * p->longest[i];
        if (b->own[i] < 0 || s->largest - away + slack >= b->part[b->own[i]].f[i] - most[i])
            return true;
    }
    return false;
}

static void clear_sum(FootSample *s)
{
    for (int i = 0; i < FOOT_BLOCK; i++) {
        s->f[i] = -1e300;
        s->gx[i] = s->gy[i] = s->gz[i] = 0;
        s->hxx[i] = s->hxy[i] = s->hxz[i] = s->hyy[i] = s->hyz[i] = s->hzz[i] = 0;
    }
}

static void copy_part(FootSample *s, const SweepPartLanes *p)
{
    memcpy(s->f, p->f, sizeof p->f);
    memcpy(s->gx, p->gx, sizeof p->gx), memcpy(s->gy, p->gy, sizeof p->gy), memcpy(s->gz, p->gz, sizeof p->gz);
    memcpy(s->hxx, p->hxx, sizeof p->hxx), memcpy(s->hxy, p->hxy, sizeof p->hxy), memcpy(s->hxz, p->hxz, sizeof p->hxz);
    memcpy(s->hyy, p->hyy, sizeof p->hyy), memcpy(s->hyz, p->hyz, sizeof p->hyz), memcpy(s->hzz, p->hzz, sizeof p->hzz);
}

// The own parts of all lanes first, whose fields show which other parts matter.
static unsigned evaluate_parts(const SweepFeet *feet, SweepBlock *b, int parts, unsigned lanes)
{
    unsigned own = 0, evaluated = 0;
    SweepLane most;
    for (int i = 0; i < FOOT_BLOCK; i++)
        if (lanes >> i & 1 && b->own[i] >= 0)
            own |= 1u << b->own[i];
    for (int k = 0; k < parts; k++)
        if (own >> k & 1) {
            evaluate_part(feet, b, k, lanes);
            evaluated |= 1u << k;
        }
    for (int i = 0; i < FOOT_BLOCK && parts > 1; i++) {
        // of two parts, the later one's delta counts; of more, two of them may have blended before they meet the own one
        most[i] = 0;
        for (int k = 1; k < parts; k++)
            if (b->part[k].absent[i] == 0)
                most[i] += (b->view[i]->count == 2 ? 2 : 3) * b->part[k].width[i];
    }
    for (int k = 0; k < parts && parts > 1; k++) {
        if (!(own >> k & 1) && lanes_need(b, k, lanes, most)) {
            evaluate_part(feet, b, k, lanes);
            evaluated |= 1u << k;
        }
    }
    return evaluated;
}

void sweep_block_sample(const SweepFeet *feet, SweepBlock *b, unsigned lanes)
{
    int parts = 0;
    unsigned sacs = 0;
    SweepLane share;
    SEL_ASSERT(lanes != 0, "a sample has lanes");
    // the own branch first: its segment determines what is seen
    SweepPartLanes first;
    for (int i = 0; i < FOOT_BLOCK; i++) {
        bool own = (lanes >> i & 1) && b->own[i] >= 0;
        first.segment[i] = feet->field->segment + (own ? b->segment[i] : 0);
        first.t[i] = own ? b->own_t[i] : 0;
        first.longest[i] = own ? 2 * feet->field->model->branch[b->view[i]->of[b->own[i]].branch].radius : 1;
    }
    seek_part(feet, b, &first, lanes);
    for (int i = 0; i < FOOT_BLOCK; i++) {
        if (!(lanes >> i & 1))
            continue;
        if (b->own[i] >= 0) {
            int segment = (int)(first.segment[i] - feet->field->segment);
            if (segment != b->segment[i])
                sweep_block_place(feet, b, i, segment, -1, first.t[i]);
            b->own_t[i] = first.t[i];
        }
        parts = b->view[i]->count > parts ? b->view[i]->count : parts;
        sacs |= b->sac[i] >= 0 ? 1u << i : 0;
    }
    for (int k = 0; k < parts; k++) {
        unsigned others = 0;
        set_part(feet, b, k, lanes);
        for (int i = 0; i < FOOT_BLOCK; i++) {
            others |= (lanes >> i & 1) && b->part[k].absent[i] == 0 && k != b->own[i] ? 1u << i : 0;
            if ((lanes >> i & 1) && k == b->own[i])
                b->part[k].away[i] = first.away[i];
        }
        if (others != 0)
            seek_part(feet, b, &b->part[k], others);
        if (parts > 1)
            feet->kernels->width(&b->part[k]);
    }
    unsigned evaluated = evaluate_parts(feet, b, parts, lanes);
    if (parts == 1 && sacs == 0) {
        copy_part(&b->foot.at, &b->part[0]);
        for (int i = 0; i < FOOT_BLOCK; i++)
            if (lanes >> i & 1)
                b->owner[i] = 0, b->keeps_t[i] = true;
        return;
    }
    clear_sum(&b->foot.at);
    for (int k = 0; k < parts; k++) {
        if (!(evaluated >> k & 1))
            continue;
        feet->kernels->blend(&b->foot.at, &b->part[k], share);
        for (int i = 0; i < FOOT_BLOCK; i++)
            if ((lanes >> i & 1) && share[i] > 0.5 && b->part[k].absent[i] == 0)
                b->owner[i] = k;
    }
    if (sacs != 0)
        blend_sacs(feet, b, lanes, sacs);
    for (int i = 0; i < FOOT_BLOCK; i++)
        b->keeps_t[i] = b->keeps_t[i] || (lanes >> i & 1);
}

// --- Feet ---

static Vec3 lane_foot(const FootBatch *f, int i) { return vec3(f->at.x[i], f->at.y[i], f->at.z[i]); }

// The place of a lane's foot: on the part of largest share.
static void foot_place(const SweepFeet *feet, const SweepBlock *b, int i, SweepFoot *foot)
{
    int owner = b->owner[i];
    if (owner < 0) {
        foot->segment = -1, foot->sac = b->sac[i], foot->t = 0;
        return;
    }
    foot->segment = (int)(b->part[owner].segment[i] - feet->field->segment);
    foot->sac = -1, foot->t = b->part[owner].t[i];
}

SweepFoot sweep_block_foot(const SweepFeet *feet, const SweepBlock *b, int i)
{
    const FootBatch *f = &b->foot;
    SweepFoot foot = {.at = lane_foot(f, i),
                      .normal = vec3(f->nx[i], f->ny[i], f->nz[i]),
                      .gap = f->gap[i],
                      .sure = true,
                      .pure = b->owner[i] >= 0 && f->at.f[i] == b->part[b->owner[i]].f[i],
                      .hessian = {f->axx[i], f->axy[i], f->axz[i], f->ayy[i], f->ayz[i], f->azz[i]}};
    foot_place(feet, b, i, &foot);
    return foot;
}

double sweep_place_radius(const SweepFeet *feet, int segment, int sac)
{
    const SweepField *field = feet->field;
    if (segment < 0)
        return field->model->sac->radius[sac];
    return field->segment[segment].largest;
}

void sweep_block_set_point(const SweepFeet *feet, SweepBlock *b, int i, Vec3 x)
{
    FootBatch *f = &b->foot;
    double radius = sweep_place_radius(feet, b->segment[i], b->sac[i]);
    f->xx[i] = x.x, f->xy[i] = x.y, f->xz[i] = x.z;
    f->radius[i] = radius, f->bend[i] = 1 / radius;
}

static void add_foot(SweepFoot *foot, int *count, const SweepFoot *more)
{
    static const double SAME = 1e-4;         // [mm]
    int at = 0;
    for (int i = 0; i < *count; i++) {
        if (vec3_distance(foot[i].at, more->at) < SAME)
            return;
        at += fabs(foot[i].gap) <= fabs(more->gap);
    }
    if (at == SWEEP_FEET)
        return;
    *count = *count < SWEEP_FEET ? *count + 1 : SWEEP_FEET;
    memmove(foot + at + 1, foot + at, (size_t)(*count - 1 - at) * sizeof *foot);
    foot[at] = *more;
}

static const double REST_FRESH = 1e-10;      // [mm] error of the gap that Newton may leave for a foot found from scratch

int sweep_settle(const SweepFeet *feet, Vec3 x, const SweepStart *start, int count, SweepFoot *foot)
{
    enum { ROUNDS = 24 };
    static const double LEFT = 1e-4, OFF = 1e-6;     // relative to the radius: tangential and normal residual of a foot that is one of many on a circle
    SEL_ASSERT(count > 0 && count <= SWEEP_FEET, "starts fit into a block");
    SweepBlock b;
    FootBatch *f = &b.foot;
    unsigned all = (1u << count) - 1, done = 0;
    int found = 0;
    memset(&b.ring, 0, sizeof b.ring);
    for (int i = 0; i < FOOT_BLOCK; i++) {
        const SweepStart *s = &start[i < count ? i : 0];
        sweep_block_place(feet, &b, i, s->segment, s->sac, s->t);
        sweep_block_set_point(feet, &b, i, x);
        f->at.x[i] = s->at.x, f->at.y[i] = s->at.y, f->at.z[i] = s->at.z;
        f->longest[i] = fmin(0.5 * f->radius[i], fmax(0.1 * f->radius[i], 0.4 * s->far));
        f->allowed[i] = REST_FRESH;
        f->state[i] = FOOT_PENDING;
    }
    for (int round = 0; round < ROUNDS && (done & all) != all; round++) {
        sweep_block_sample(feet, &b, round == 0 ? FOOT_ALL : all & ~done);
        done = feet->kernels->newton(f, true);
    }
    if ((done & all) != all)
        sweep_block_sample(feet, &b, all & ~done);
    feet->kernels->finish(f);
    for (int i = 0; i < count; i++) {
        SweepFoot one = sweep_block_foot(feet, &b, i);
        if (!(done >> i & 1)) {
            // on the axis of a round vessel all feet around are equally near, and the tangential step never ends
            Vec3 g = {f->at.gx[i], f->at.gy[i], f->at.gz[i]}, n = vec3_unit_or(g, vec3(0, 0, 0)), away = vec3_sub(one.at, x);
            double gap = -vec3_dot(away, n), left = vec3_norm(vec3_add_scaled(away, gap, n)), slope = vec3_norm(g), radius = f->radius[i];
            if (!(slope > 0.1 && gap > 0.3 * radius && left < LEFT * radius && fabs(f->at.f[i]) < OFF * radius))
                continue;
            one.normal = n, one.gap = gap;
        }
        if (vec3_is_finite(one.at) && vec3_is_finite(one.normal) && isfinite(one.gap))
            add_foot(foot, &found, &one);
    }
    return found;
}

// --- Starts ---

// The nearest starts, kept apart so that they lead to different feet.
static void add_start(SweepStart *start, int *count, int most, const SweepStart *more, double apart)
{
    int at = 0;
    for (int i = 0; i < *count; i++) {
        if (start[i].far <= more->far) {
            if (vec3_distance(start[i].at, more->at) < apart)
                return;
            at = i + 1;
        }
    }
    if (at == most)
        return;
    // farther ones beside it are replaced
    int kept = at;
    SweepStart held[SWEEP_FEET];
    int rest = 0;
    for (int i = at; i < *count; i++)
        if (vec3_distance(start[i].at, more->at) >= apart)
            held[rest++] = start[i];
    start[kept++] = *more;
    for (int i = 0; i < rest && kept < most; i++)
        start[kept++] = held[i];
    *count = kept;
}

// Rings around a branch at several t: points of its wall and their distances from x.
enum { RINGS = 5 };
typedef struct Rings {
    Vec3 at[RINGS][SWEEP_RING];
    double far2[RINGS][SWEEP_RING];
    int segment[RINGS];
    double t[RINGS], radius;     // radius: c_0 of the middle ring
} Rings;

static void fill_ring(const SweepFeet *feet, Vec3 x, int branch, double t, Rings *rings, int which)
{
    const SweepField *field = feet->field;
    int segment = sweep_field_segment(field, branch, t);
    const SweepSegment *s = &field->segment[segment];
    const SweepInterval line = {
        .origin = s->origin, .s = {s->s[0], s->s[1], s->s[2], s->s[3]}, .n = {s->n[0], s->n[1], s->n[2], s->n[3]}, .b = {s->b[0], s->b[1], s->b[2], s->b[3]}};
    SweepJet j = sweep_interval_at(&line, s->rise != 0 ? s->origin : t);
    double term[SWEEP_TERMS], radius[SWEEP_RING], at = t - s->origin, up = 0, out = 1;
    for (int k = 0; k <= 2 * feet->harmonics; k++)
        term[k] = s->section[k][0] + at * (s->section[k][1] + at * (s->section[k][2] + at * s->section[k][3]));
    if (s->rise != 0) {      // the direction of the ring: at its height over the end's plane, as far as the dome reaches
        double power = 1;
        up = fmax(-0.98, fmin(0.98, s->rise * at / fmax(term[0], 1e-9))), out = sqrt(1 - up * up);
        for (int k = 1; k <= feet->harmonics; k++)
            power *= out, term[2 * k - 1] *= power, term[2 * k] *= power;
    }
    Vec3 along = vec3_unit(j.s1), u = vec3_sub(x, j.s);
    feet->kernels->ring_about(term, feet->harmonics, vec3_dot(u, j.n), vec3_dot(u, j.b), vec3_dot(u, along), radius, rings->far2[which]);
    for (int k = 0; k < SWEEP_RING; k++) {
        Vec3 way = vec3_add(vec3_scale(j.n, out * sweep_ring_cos[k]), vec3_scale(j.b, out * sweep_ring_sin[k]));
        rings->at[which][k] = vec3_add_scaled(j.s, radius[k], vec3_add_scaled(way, up, along));
        if (up != 0)
            rings->far2[which][k] = vec3_norm2(vec3_sub(x, rings->at[which][k]));
    }
    rings->segment[which] = segment, rings->t[which] = t;
    rings->radius = which == RINGS / 2 ? term[0] : rings->radius;
}

// Removes the points of a branch's rings that lie inside another branch, which is seen from t on it, or inside a sac: they are no wall.
static void drop_inner(const SweepFeet *feet, Rings *rings, double limit, int branch, double t, int sac)
{
    SweepPartLanes p = {.absent = {0}};
    SweepLane x, y, z;
    for (int i = 0; i < RINGS; i++)
        for (int k = 0; k < SWEEP_RING; k += FOOT_BLOCK) {
            unsigned near = 0, outside;
            for (int l = 0; l < FOOT_BLOCK; l++) {
                Vec3 at = rings->at[i][k + l];
                near |= rings->far2[i][k + l] < limit * limit ? 1u << l : 0;
                x[l] = at.x, y[l] = at.y, z[l] = at.z;
            }
            if (near == 0)
                continue;
            for (int l = 0; l < FOOT_BLOCK && branch >= 0; l++) {
                p.t[l] = t, p.longest[l] = 2 * feet->field->model->branch[branch].radius, p.settled[l] = near >> l & 1 ? 0 : 1;
                p.segment[l] = feet->field->segment + sweep_field_segment(feet->field, branch, t);
            }
            for (int round = 0; round < 6 && branch >= 0; round++) {
                unsigned again = feet->kernels->seek(&p, x, y, z, &outside) & near;
                for (outside &= near; outside != 0; outside &= outside - 1) {
                    int l = __builtin_ctz(outside);
                    p.segment[l] = feet->field->segment + neighbour(feet->field, p.segment[l], p.t[l]);
                }
                if (again == 0)
                    break;
            }
            if (branch >= 0)
                feet->kernels->depth(&p, x, y, z, feet->harmonics);
            for (; near != 0; near &= near - 1) {
                int l = __builtin_ctz(near);
                SweepPart part = {.f = p.f[l]};
                if (branch < 0)
                    sweep_field_sac(feet->field, sac, rings->at[i][k + l], &part);
                if (part.f > 0)
                    rings->far2[i][k + l] = HUGE_VAL;
            }
        }
}

// Returns whether no neighbour on the rings is nearer.
static bool is_least(const Rings *r, int ring, int k)
{
    for (int i = -1; i <= 1; i++)
        for (int j = -1; j <= 1; j++)
            if (ring + i >= 0 && ring + i < RINGS && r->far2[ring + i][(k + j + SWEEP_RING) % SWEEP_RING] < r->far2[ring][k])
                return false;
    return true;
}

// The branches that are seen, with t of x on them.
typedef struct Seen {
    int count, sac;
    int branch[SWEEP_CANDIDATES];
    double t[SWEEP_CANDIDATES];
} Seen;

static void add_rings(const SweepFeet *feet, Vec3 x, const Seen *seen, int which, double reach, double limit, SweepStart *start, int *count, int most)
{
    static const double ASIDE = 0.5;         // between rings, relative to `reach`
    Rings rings;
    double half_angle = 0.2 * sweep_field_largest(feet->field, seen->branch[which], seen->t[which]), half_step = 0.5 * ASIDE * reach;
    double slack2 = half_angle * half_angle + half_step * half_step;
    for (int i = 0; i < RINGS; i++)
        fill_ring(feet, x, seen->branch[which], seen->t[which] + ASIDE * (i - RINGS / 2) * reach, &rings, i);
    for (int i = 0; i < seen->count; i++)
        if (i != which)
            drop_inner(feet, &rings, limit, seen->branch[i], seen->t[i], -1);
    if (seen->sac >= 0)
        drop_inner(feet, &rings, limit, -1, 0, seen->sac);
    for (int i = 0; i < RINGS; i++)
        for (int k = 0; k < SWEEP_RING; k++) {
            if (!(rings.far2[i][k] < limit * limit) || !is_least(&rings, i, k))
                continue;
            SweepStart more = {.at = rings.at[i][k], .far = sqrt(rings.far2[i][k]), .segment = rings.segment[i], .sac = -1, .t = rings.t[i]};
            more.least = sqrt(fmax(0, rings.far2[i][k] - slack2));
            add_start(start, count, most, &more, 0.2 * rings.radius);
        }
}

// Points of the spheres of a sac's nodes.
static void add_sac(const SweepFeet *feet, Vec3 x, int sac, double limit, SweepStart *start, int *count, int most)
{
    const VesselTree *tree = feet->field->model->sac;
    int group = feet->field->sac_group[sac];
    for (int i = 0; i < tree->node_count; i++) {
        if (feet->field->sac_group[i] != group)
            continue;
        Vec3 out = vec3_unit_or(vec3_sub(x, tree->center[i]), tree->direction[i]);
        SweepStart more = {.at = vec3_add_scaled(tree->center[i], tree->radius[i], out), .segment = -1, .sac = i};
        more.far = vec3_distance(x, more.at);
        more.least = fmax(0, more.far - 0.5 * tree->radius[i]);      // a sac is no union of its nodes' spheres
        if (more.far < limit)
            add_start(start, count, most, &more, 0.4 * tree->radius[i]);
    }
}

static const SweepView *view_of(const SweepField *field, SweepPlace place)
{
    return place.branch >= 0 ? &field->view[sweep_field_segment(field, place.branch, place.t)] : &field->sac[place.sac].view;
}

int sweep_starts(const SweepFeet *feet, Vec3 x, SweepPlace place, bool alone, double limit, SweepStart *start, int most)
{
    SEL_ASSERT(most > 0 && most <= SWEEP_FEET && limit > 0, "starts fit into a block");
    const SweepField *field = feet->field;
    const SweepView *view = view_of(field, place);
    Seen seen = {.count = view->count, .sac = place.branch >= 0 ? view->sac : place.sac};
    int count = 0;
    if (alone) {
        SEL_ASSERT(place.branch >= 0, "a branch alone is one of the branches");
        seen = (Seen){.count = 1, .sac = -1, .branch = {place.branch}};
        seen.t[0] = sweep_curve_project(field->curve[place.branch], x, place.t, 2 * field->model->branch[place.branch].radius);
    }
    for (int i = 0; i < view->count && !alone; i++) {
        const SweepCandidate *c = &view->of[i];
        double at = place.branch >= 0 ? fmax(0, fmin(field->curve[place.branch]->length, place.t)) : 0;
        double from = c->branch == place.branch ? place.t : c->t + c->slope * at;
        seen.branch[i] = c->branch;
        seen.t[i] = sweep_curve_project(field->curve[c->branch], x, from, 2 * field->model->branch[c->branch].radius);
    }
    for (int i = 0; i < seen.count; i++) {
        double largest = sweep_field_largest(field, seen.branch[i], seen.t[i]);
        if (vec3_distance(x, sweep_curve_at(field->curve[seen.branch[i]], seen.t[i]).s) - largest < limit)
            add_rings(feet, x, &seen, i, fmin(limit, largest), limit, start, &count, most);
    }
    if (seen.sac >= 0)
        add_sac(feet, x, seen.sac, limit, start, &count, most);
    return count;
}

// --- Places ---

SweepPlace sweep_descend(const SweepFeet *feet, Vec3 x, SweepPlace place, double *f)
{
    enum { MOVES = 6 };
    SweepBlend blend;
    for (int move = 0; move < MOVES; move++) {
        sweep_field_blend(feet->field, place, x, &blend);
        const SweepPart *best = &blend.part[blend.largest];
        bool same = best->branch == place.branch &&
                    (best->branch >= 0 ? sweep_field_segment(feet->field, place.branch, place.t) == sweep_field_segment(feet->field, place.branch, best->t)
                                       : best->sac == place.sac);
        place = (SweepPlace){.branch = best->branch, .t = best->t, .sac = best->sac};
        if (same)
            break;
    }
    *f = blend.f;
    return place;
}

SweepFoot sweep_bisect(const SweepFeet *feet, Vec3 x, SweepPlace place)
{
    enum { GROWS = 40, HALVINGS = 45 };
    const SweepField *field = feet->field;
    Vec3 from, direction;
    double radius;
    SweepBlend blend;
    if (place.branch >= 0) {
        double end = fmax(0, fmin(field->curve[place.branch]->length, place.t));
        bool open = field->model->branch[place.branch].open_start && place.t < 0;
        SweepJet j = sweep_curve_at(field->curve[place.branch], open ? place.t : end);
        from = j.s, direction = vec3_unit_or(vec3_sub(x, from), j.n), radius = field->model->branch[place.branch].radius;
    } else {
        const VesselTree *tree = field->model->sac;
        from = tree->center[place.sac], direction = vec3_unit_or(vec3_sub(x, from), tree->direction[place.sac]), radius = tree->radius[place.sac];
    }
    double low = 0, high = 0.25 * radius;
    for (int i = 0; i < GROWS; i++) {
        sweep_field_blend(field, place, vec3_add_scaled(from, high, direction), &blend);
        if (!(blend.f > 0))
            break;
        low = high, high *= 1.3;
    }
    for (int i = 0; i < HALVINGS; i++) {
        double middle = 0.5 * (low + high);
        sweep_field_blend(field, place, vec3_add_scaled(from, middle, direction), &blend);
        if (blend.f > 0)
            low = middle;
        else
            high = middle;
    }
    Vec3 at = vec3_add_scaled(from, low, direction);
    sweep_field_blend(field, place, at, &blend);
    const SweepPart *best = &blend.part[blend.largest];
    Vec3 normal = vec3_unit_or(blend.gradient, vec3_negate(direction));
    double far = vec3_distance(x, at), side = vec3_dot(vec3_sub(x, from), direction) < low ? 1 : -1;
    return (SweepFoot){.at = at,
                       .normal = normal,
                       .gap = side * far,
                       .segment = best->branch >= 0 ? sweep_field_segment(field, best->branch, best->t) : -1,
                       .sac = best->branch >= 0 ? -1 : best->sac,
                       .t = best->t,
                       .sure = false};
}
