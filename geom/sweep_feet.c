// Feet on the wall of a swept model, see sweep_feet.h.
//
// A part that cannot matter is not evaluated: with d = |X - S| its field is at most R_largest - d, and M(x, y) = max(x, y) where they differ by more than
// 2 delta. The result is the same to the bit.
#include "geom/sweep_feet.h"

#include "geom/field_lanes.h"
#include "geom/power_walk.h"

#include <stdlib.h>
#include <string.h>

// The branch whose own view the segment has.
static int branch_of_segment(const SweepField *field, int segment)
{
    SEL_ASSERT(segment >= 0, "a branch that is alone has a segment");
    const SweepView *view = &field->view[segment];
    for (int k = 0; k < view->count; k++)
        if (segment >= field->first_segment[view->of[k].branch] && segment < field->first_segment[view->of[k].branch + 1])
            return view->of[k].branch;
    return 0;
}

void sweep_block_begin(SweepBlock *b)
{
    memset(&b->ring, 0, sizeof b->ring);
    memset(b->alone, 0, sizeof b->alone);
    b->harmonics = 1;
}

void sweep_block_place(const SweepFeet *feet, SweepBlock *b, int i, int segment, int sac, double t)
{
    SEL_ASSERT(segment >= 0 || sac >= 0, "a place lies on a branch or on a sac");
    const SweepField *field = feet->field;
    b->segment[i] = segment;
    b->view[i] = segment >= 0 ? &field->view[segment] : &field->sac[sac].view;
    if (b->alone[i])
        b->view[i] = &feet->alone[branch_of_segment(field, segment)];
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
    enum { ROUNDS = 60 };
    for (int i = 0; i < FOOT_BLOCK; i++)
        p->settled[i] = lanes >> i & 1 ? 0 : 1, p->far2[i] = HUGE_VAL, p->last[i] = 0;
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
            p->segment[i] = field->segment + neighbour(field, &field->segment[c->segment], p->t[i]);
        }
    }
}

// --- Fields ---

// Sections of another kind are evaluated one by one.
static void apply_stretches(const SweepFeet *feet, SweepBlock *b, int k, unsigned lanes)
{
    SweepPartLanes *p = &b->part[k];
    for (int i = 0; i < FOOT_BLOCK; i++) {
        if (!(lanes >> i & 1) || p->absent[i] > 0 || p->segment[i]->is_shaped == 0)
            continue;
        SweepPart part;
        sweep_branch_evaluate(feet->field, b->view[i]->of[k].branch, p->segment[i], vec3(b->foot.at.x[i], b->foot.at.y[i], b->foot.at.z[i]), p->t[i], &part);
        p->f[i] = part.f;
        p->gx[i] = part.gradient.x, p->gy[i] = part.gradient.y, p->gz[i] = part.gradient.z;
        p->hxx[i] = part.hessian.xx, p->hxy[i] = part.hessian.xy, p->hxz[i] = part.hessian.xz;
        p->hyy[i] = part.hessian.yy, p->hyz[i] = part.hessian.yz, p->hzz[i] = part.hessian.zz;
    }
}

// `bends`: with the Hessian and the ring.
static void evaluate_part(const SweepFeet *feet, SweepBlock *b, int k, unsigned lanes, bool bends)
{
    SweepPartLanes *p = &b->part[k];
    SweepLane own;
    bool any = false;
    int harmonics = 1;
    for (int i = 0; i < FOOT_BLOCK; i++) {
        own[i] = b->own[i] == k && (lanes >> i & 1) ? 1 : 0;
        any |= own[i] > 0;
        if (p->absent[i] == 0 && p->segment[i]->harmonics > harmonics)
            harmonics = (int)p->segment[i]->harmonics;
    }
    if (any && bends)
        harmonics = b->harmonics = harmonics > b->harmonics ? harmonics : b->harmonics;
    if (bends)
        feet->kernels->evaluate(p, b->foot.at.x, b->foot.at.y, b->foot.at.z, harmonics, any ? &b->ring : NULL, own);
    else
        feet->kernels->evaluate_slope(p, b->foot.at.x, b->foot.at.y, b->foot.at.z, harmonics);
    if (feet->field->model->stretch_count > 0)
        apply_stretches(feet, b, k, lanes);
    for (int i = 0; i < FOOT_BLOCK; i++) {
        if (own[i] > 0) {
            b->is_flat[i] = p->segment[i]->rise == 0 && p->segment[i]->is_shaped == 0;
            b->own_t[i] = p->t[i];
            b->ring_x[i] = b->foot.at.x[i], b->ring_y[i] = b->foot.at.y[i], b->ring_z[i] = b->foot.at.z[i];
        }
    }
}

// A part with a share was blended in: what is left of the shares of those before it.
static void keep_shares(SweepBlock *b, int part, const double *share)
{
    for (int k = 0; k < part; k++)
        for (int i = 0; i < FOOT_BLOCK; i++)
            b->share[k][i] *= 1 - share[i];
}

// The sacs of the lanes without Hessians, in lanes for each node that they see.
static void slope_sacs(const SweepFeet *feet, SweepBlock *b, unsigned sacs, SweepPartLanes *p)
{
    const VesselTree *tree = feet->field->model->sac;
    const FootSample *at = &b->foot.at;
    for (unsigned left = sacs; left != 0; left &= left - 1) {
        int i = __builtin_ctz(left);
        b->sac[i] = power_walk(tree, vec3(at->x[i], at->y[i], at->z[i]), b->sac[i], 1 << 20);
    }
    for (unsigned left = sacs; left != 0;) {
        int node = b->sac[__builtin_ctz(left)];
        const SweepSac *sac = &feet->field->sac[node];
        Blobby blobs = blobby_of(tree, node);
        SweepLane f, gx, gy, gz;
        feet->kernels->blobs_slope(&blobs, at->x, at->y, at->z, f, gx, gy, gz);
        for (int i = 0; i < FOOT_BLOCK; i++) {
            if (!(left >> i & 1) || b->sac[i] != node)
                continue;
            left &= ~(1u << i);
            p->absent[i] = 0, p->delta[i] = sac->delta;
            p->f[i] = sac->scale * f[i];
            p->gx[i] = sac->scale * gx[i], p->gy[i] = sac->scale * gy[i], p->gz[i] = sac->scale * gz[i];
        }
    }
}

// Blends the sacs of the lanes in.
static void blend_sacs(const SweepFeet *feet, SweepBlock *b, unsigned lanes, unsigned sacs, SweepPartLanes *sac, bool bends)
{
    SweepPartLanes p = {.f = {0}};
    SweepLane share;
    for (int i = 0; i < FOOT_BLOCK; i++) {
        p.absent[i] = 1, p.f[i] = -1e300;
        if (!(sacs >> i & 1) || !bends)
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
    if (!bends)
        slope_sacs(feet, b, sacs, &p);
    if (bends)
        feet->kernels->blend(&b->foot.at, &p, share);
    else
        feet->kernels->blend_slope(&b->foot.at, &p, share);
    if (!bends)
        keep_shares(b, SWEEP_PARTS, share), memcpy(b->sac_share, share, sizeof share);
    for (int i = 0; i < FOOT_BLOCK; i++)
        if ((sacs & lanes) >> i & 1 && share[i] > 0.5)
            b->owner[i] = -1;
    *sac = p;
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

// How far the foot of a pure lane may move until another part can matter. With its motion m, that part's distance falls by no more than m; the rest of the
// factor is for what `most` and the own field change.
static double lane_apart(const SweepFeet *feet, const SweepBlock *b, int i, double most, const SweepPartLanes *sac)
{
    static const double FACTOR = 3;
    double least = 0.25 * b->foot.radius[i] * FACTOR;
    for (int k = 0; k < b->view[i]->count; k++) {
        const SweepPartLanes *p = &b->part[k];
        const SweepSegment *s = p->segment[i];
        if (k != b->own[i])
            least = fmin(least, 0.998 * same_hypot(p->away[i], s->rise * (p->t[i] - s->origin)) - s->around - most);
    }
    if (b->sac[i] >= 0)
        least = fmin(least, sac ? -sac->f[i] - 2 * feet->field->sac[b->sac[i]].delta - most : 0);
    return fmax(0, least / FACTOR);
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
static unsigned evaluate_parts(const SweepFeet *feet, SweepBlock *b, int parts, unsigned lanes, double *most, bool bends)
{
    unsigned own = 0, evaluated = 0;
    for (int i = 0; i < FOOT_BLOCK; i++)
        if (lanes >> i & 1 && b->own[i] >= 0)
            own |= 1u << b->own[i];
    for (int k = 0; k < parts; k++)
        if (own >> k & 1) {
            evaluate_part(feet, b, k, lanes, bends);
            evaluated |= 1u << k;
        }
    for (int i = 0; i < FOOT_BLOCK; i++) {
        // of two parts, the later one's delta counts; of more, two of them may have blended before they meet the own one
        most[i] = 0;
        for (int k = 1; k < parts; k++)
            if (b->part[k].absent[i] == 0)
                most[i] += (b->view[i]->count == 2 ? 2 : 3) * b->part[k].width[i];
    }
    for (int k = 0; k < parts; k++) {
        if (!(own >> k & 1) && lanes_need(b, k, lanes, most)) {
            evaluate_part(feet, b, k, lanes, bends);
            evaluated |= 1u << k;
        }
    }
    return evaluated;
}

static void sample(const SweepFeet *feet, SweepBlock *b, unsigned lanes, bool bends)
{
    int parts = 0;
    unsigned sacs = 0;
    SweepLane share, most;
    SweepPartLanes sac;
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
    unsigned evaluated = evaluate_parts(feet, b, parts, lanes, most, bends);
    if (!bends)
        memset(b->share, 0, sizeof b->share), memset(b->sac_share, 0, sizeof b->sac_share);
    if (parts == 1 && sacs == 0) {
        copy_part(&b->foot.at, &b->part[0]);
        for (int i = 0; i < FOOT_BLOCK; i++)
            if (lanes >> i & 1)
                b->owner[i] = 0, b->pure[i] = b->keeps_t[i] = true, b->apart[i] = 0, b->share[0][i] = 1;
        return;
    }
    clear_sum(&b->foot.at);
    for (int k = 0; k < parts; k++) {
        if (!(evaluated >> k & 1))
            continue;
        if (bends)
            feet->kernels->blend(&b->foot.at, &b->part[k], share);
        else
            feet->kernels->blend_slope(&b->foot.at, &b->part[k], b->share[k]), keep_shares(b, k, b->share[k]), memcpy(share, b->share[k], sizeof share);
        for (int i = 0; i < FOOT_BLOCK; i++)
            if ((lanes >> i & 1) && share[i] > 0.5 && b->part[k].absent[i] == 0)
                b->owner[i] = k;
    }
    if (sacs != 0)
        blend_sacs(feet, b, lanes, sacs, &sac, bends);
    for (int i = 0; i < FOOT_BLOCK; i++)
        if (lanes >> i & 1) {
            b->keeps_t[i] = true;
            b->pure[i] = b->owner[i] >= 0 && b->foot.at.f[i] == b->part[b->owner[i]].f[i];
            b->apart[i] = bends && b->pure[i] && b->owner[i] == b->own[i] ? lane_apart(feet, b, i, most[i] - b->foot.at.f[i], sacs != 0 ? &sac : NULL) : 0;
        }
}

void sweep_block_sample(const SweepFeet *feet, SweepBlock *b, unsigned lanes) { sample(feet, b, lanes, true); }

void sweep_block_slope(const SweepFeet *feet, SweepBlock *b, unsigned lanes) { sample(feet, b, lanes, false); }

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
                      .pure = b->pure[i],
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
        at += foot[i].doubtful < more->doubtful || (foot[i].doubtful == more->doubtful && fabs(foot[i].gap) <= fabs(more->gap));
    }
    if (at == SWEEP_FEET)
        return;
    *count = *count < SWEEP_FEET ? *count + 1 : SWEEP_FEET;
    memmove(foot + at + 1, foot + at, (size_t)(*count - 1 - at) * sizeof *foot);
    foot[at] = *more;
}

static const double OFF_WALL = 1e-4;        // relative to the radius: |F| of what is no foot
static const double REST_FRESH = 1e-10;      // [mm] error of the gap that Newton may leave for a foot found from scratch

// Prepares a block for careful steps; lanes beyond `count` repeat the first.
static void start_block(const SweepFeet *feet, SweepBlock *b, const Vec3 *x, const SweepStart *start, int count)
{
    FootBatch *f = &b->foot;
    sweep_block_begin(b);
    for (int i = 0; i < FOOT_BLOCK; i++) {
        int from = i < count ? i : 0;
        const SweepStart *s = &start[from];
        sweep_block_place(feet, b, i, s->segment, s->sac, s->t);
        sweep_block_set_point(feet, b, i, x[from]);
        f->at.x[i] = s->at.x, f->at.y[i] = s->at.y, f->at.z[i] = s->at.z;
        f->longest[i] = fmin(0.5 * f->radius[i], fmax(0.1 * f->radius[i], 0.4 * s->far));
        f->allowed[i] = REST_FRESH;
        f->state[i] = FOOT_PENDING;
    }
}

// On a ridge that is narrower than a step, Newton leaps from one flank to the other: a lane whose step turns back takes shorter ones.
// A lane that comes close to its `known` foot (NULL: none) will end there: it is taken out of `all`.
static unsigned run_block(const SweepFeet *feet, SweepBlock *b, const Vec3 *x, const Vec3 *known, unsigned *all, int rounds)
{
    static const double CLOSE = 0.02, NEAR = 0.1;    // relative to the radius, and to the distance of x from the known foot

    static const double BACK = -0.25;        // of the last step's square: the next one leads back
    FootBatch *f = &b->foot;
    unsigned done = 0;
    Vec3 last[FOOT_BLOCK] = {{0, 0, 0}};
    for (int round = 0; round < rounds && (done & *all) != *all; round++) {
        Vec3 from[FOOT_BLOCK];
        for (int i = 0; i < FOOT_BLOCK; i++)
            from[i] = lane_foot(f, i);
        sweep_block_sample(feet, b, round == 0 ? FOOT_ALL : *all & ~done);
        done = feet->kernels->newton(f, true);
        for (int i = 0; i < FOOT_BLOCK; i++) {
            Vec3 step = vec3_sub(lane_foot(f, i), from[i]);
            if (vec3_dot(step, last[i]) < BACK * vec3_norm2(last[i]))
                f->longest[i] = fmin(f->longest[i], 0.5 * vec3_norm(step));
            last[i] = step;
        }
        for (int i = 0; known && i < FOOT_BLOCK; i++)
            if (*all >> i & 1 && vec3_distance(lane_foot(f, i), known[i]) < fmin(CLOSE * f->radius[i], NEAR * vec3_distance(x[i], known[i])))
                *all &= ~(1u << i);
    }
    return done & *all;
}

static bool is_number(const SweepFoot *foot) { return vec3_is_finite(foot->at) && vec3_is_finite(foot->normal) && isfinite(foot->gap); }

// A lane that has not converged may still hold a foot: on the axis of a round vessel all feet around are equally near, and the tangential step never ends.
static bool is_one_of_many(const SweepBlock *b, int i, Vec3 x, SweepFoot *foot)
{
    static const double LEFT = 1e-4, OFF = 1e-6;     // relative to the radius: tangential and normal residual
    const FootBatch *f = &b->foot;
    Vec3 g = {f->at.gx[i], f->at.gy[i], f->at.gz[i]}, n = vec3_unit_or(g, vec3(0, 0, 0)), away = vec3_sub(foot->at, x);
    double gap = -vec3_dot(away, n), left = vec3_norm(vec3_add_scaled(away, gap, n)), slope = vec3_norm(g), radius = f->radius[i];
    foot->normal = n, foot->gap = gap;
    return slope > 0.1 && gap > 0.3 * radius && left < LEFT * radius && fabs(f->at.f[i]) < OFF * radius;
}

unsigned sweep_follow(const SweepFeet *feet, const Vec3 *x, const SweepStart *start, const Vec3 *known, int count, int rounds, SweepFoot *foot)
{
    SEL_ASSERT(count > 0 && count <= SWEEP_FEET && rounds > 0, "points fit into a block");
    SweepBlock b;
    start_block(feet, &b, x, start, count);
    unsigned all = (1u << count) - 1, done = run_block(feet, &b, x, known, &all, rounds), sound = 0;
    if (done != all)
        sweep_block_sample(feet, &b, all & ~done);
    feet->kernels->finish(&b.foot);
    for (int i = 0; i < count; i++)
        foot[i] = sweep_block_foot(feet, &b, i);
    // On the way from a distant start, t of another branch may have been caught at a place where that branch comes near again: F as seen from the foot decides.
    unsigned several = 0;
    for (int i = 0; i < count; i++)
        if (all >> i & 1 && b.view[i]->count > 1 && is_number(&foot[i])) {
            sweep_block_place(feet, &b, i, foot[i].segment, foot[i].sac, foot[i].t);
            several |= 1u << i;
        }
    if (several != 0)
        sweep_block_sample(feet, &b, several);
    for (int i = 0; i < count; i++) {
        foot[i].doubtful = several >> i & 1 && fabs(b.foot.at.f[i]) > OFF_WALL * b.foot.radius[i];
        if (all >> i & 1 && is_number(&foot[i]) && (done >> i & 1 || is_one_of_many(&b, i, x[i], &foot[i])))
            sound |= 1u << i;
    }
    return sound;
}

int sweep_settle(const SweepFeet *feet, Vec3 x, const SweepStart *start, int count, SweepFoot *foot)
{
    Vec3 same[SWEEP_FEET];
    SweepFoot one[SWEEP_FEET];
    int found = 0;
    for (int i = 0; i < SWEEP_FEET; i++)
        same[i] = x;
    unsigned sound = sweep_follow(feet, same, start, NULL, count, SWEEP_ROUNDS, one);
    for (int i = 0; i < count; i++)
        if (sound >> i & 1)
            add_foot(foot, &found, &one[i]);
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

// The branches that are seen, with t of x on them, and the branch there.
typedef struct Seen {
    int count, sac;
    int branch[SWEEP_CANDIDATES], segment[SWEEP_CANDIDATES];
    double t[SWEEP_CANDIDATES];
    SweepNear near[SWEEP_CANDIDATES];
} Seen;

enum { RINGS = 5 };          // around a branch at several t; the last one is repeated

static Vec3 curve_part(const Vec3 c[4], double x) { return vec3_add_scaled(c[0], x, vec3_add_scaled(c[1], x, vec3_add_scaled(c[2], x, c[3]))); }
static Vec3 curve_slope(const Vec3 c[4], double x) { return vec3_add_scaled(c[1], x, vec3_add_scaled(vec3_scale(c[2], 2), 3 * x, c[3])); }

static void fill_near(const SweepFeet *feet, int branch, int segment, double t, SweepNear *near)
{
    const SweepField *field = feet->field;
    double length = field->curve[branch]->length, from = field->model->branch[branch].open_start ? -HUGE_VAL : 0, at = fmax(from, fmin(length, t));
    const SweepSegment *s = &field->segment[neighbour(field, &field->segment[segment], at)];
    double x = at - s->origin;
    Vec3 s1 = curve_slope(s->s, x);
    double speed = vec3_norm(s1), by = 1 / speed;
    near->s = curve_part(s->s, x), near->tangent = vec3_scale(s1, by), near->bend = vec3_scale(vec3_add_scaled(s->s[2], 3 * x, s->s[3]), 2 * by * by);
    near->n = curve_part(s->n, x), near->n1 = vec3_scale(curve_slope(s->n, x), by);
    near->b = curve_part(s->b, x), near->b1 = vec3_scale(curve_slope(s->b, x), by);
    near->from = (from - at) * speed, near->to = (length - at) * speed;
    for (int k = 0; k <= 2 * feet->harmonics; k++) {
        const double *c = s->section[k];
        near->term[k] = c[0] + x * (c[1] + x * (c[2] + x * c[3])), near->term1[k] = by * (c[1] + x * (2 * c[2] + x * 3 * c[3]));
    }
}

// Removes the points of a branch's rings that lie inside another branch or a sac: they are no wall.
static void drop_inner(const SweepFeet *feet, SweepRings *rings, const SweepNear *other, int sac)
{
    for (int k = 0; k < SWEEP_RING; k++) {
        double f[SWEEP_RINGS];
        if (other && rings->near[k] != 0)
            feet->kernels->near_field(other, feet->harmonics, SWEEP_RINGS, rings->x[k], rings->y[k], rings->z[k], f);
        for (unsigned left = rings->near[k]; left != 0; left &= left - 1) {
            int i = __builtin_ctz(left);
            SweepPart part = {.f = other ? f[i] : -1};
            if (!other)
                sweep_field_sac(feet->field, sac, vec3(rings->x[k][i], rings->y[k][i], rings->z[k][i]), &part);
            if (part.f > 0)
                rings->far2[k][i] = HUGE_VAL, rings->near[k] &= ~(1u << i);
        }
    }
}

// How much shorter the wall is than the curve on x's side of a bend: there, the walls near x lie further away along the curve.
static double inner_share(const SweepSegment *s, double t, Vec3 x)
{
    static const double LEAST = 0.4;
    double at = t - s->origin;
    Vec3 s1 = curve_slope(s->s, at), out = vec3_unit_or(vec3_sub(x, curve_part(s->s, at)), vec3(0, 0, 0)),
         bend = vec3_add_scaled(vec3_scale(s->s[2], 2), 6 * at, s->s[3]);
    return fmax(LEAST, fmin(1, 1 - s->largest * vec3_dot(out, bend) / vec3_norm2(s1)));
}

static void add_rings(const SweepFeet *feet, Vec3 x, const Seen *seen, int which, double reach, const SweepSearch *search, SweepStart *start, int *count)
{
    static const double ASIDE = 0.5;         // between rings, relative to `reach`
    SweepRings rings;
    double limit2 = search->limit * search->limit;
    const SweepSegment *near = &feet->field->segment[seen->segment[which]];
    double half_angle = 0.2 * near->largest, half_step = 0.5 * ASIDE * reach, slack2 = half_angle * half_angle + half_step * half_step;
    double apart = ASIDE * reach / inner_share(near, seen->t[which], x);
    for (int i = 0; i < SWEEP_RINGS; i++) {
        rings.t[i] = seen->t[which] + ((i < RINGS ? i : RINGS - 1) - RINGS / 2) * apart;
        rings.segment[i] = feet->field->segment + neighbour(feet->field, near, rings.t[i]);
    }
    feet->kernels->rings(&rings, feet->harmonics, x, limit2);
    for (int i = 0; i < seen->count; i++)
        if (i != which)
            drop_inner(feet, &rings, &seen->near[i], -1);
    if (seen->sac >= 0)
        drop_inner(feet, &rings, NULL, seen->sac);
    double beyond2 = feet->kernels->minima(&rings, search->from, search->own * search->own, search->zone * search->zone, limit2);
    *search->nearest_beyond = fmin(*search->nearest_beyond, sqrt(beyond2));
    for (int k = 0; k < SWEEP_RING; k++)
        for (unsigned left = rings.least[k] & ((1u << RINGS) - 1); left != 0; left &= left - 1) {
            int i = __builtin_ctz(left);
            double far2 = rings.far2[k][i];
            SweepStart more = {.at = {rings.x[k][i], rings.y[k][i], rings.z[k][i]}, .sac = -1, .t = rings.t[i], .far = sqrt(far2)};
            more.segment = (int)(rings.segment[i] - feet->field->segment), more.least = sqrt(fmax(0, far2 - slack2));
            add_start(start, count, search->most, &more, 0.2 * rings.radius[RINGS / 2]);
        }
}

// Points of a sac's wall that lie in no branch.
static void add_sac(const SweepFeet *feet, Vec3 x, const Seen *seen, const SweepSearch *search, SweepStart *start, int *count)
{
    static const double HALF = 0.27;         // half the distance between neighbouring points, relative to the radius
    const SweepSacPoints *all = &feet->sacs;
    const VesselTree *tree = feet->field->model->sac;
    int group = feet->field->sac_group[seen->sac];
    double limit = search->limit;
    for (int first = 0; first < all->count; first += FOOT_BLOCK) {
        double far2[FOOT_BLOCK], f[FOOT_BLOCK], least2 = HUGE_VAL;
        for (int l = 0; l < FOOT_BLOCK; l++) {
            far2[l] = vec3_norm2(vec3_sub(vec3(all->x[first + l], all->y[first + l], all->z[first + l]), x));
            least2 = fmin(least2, far2[l]);
        }
        if (!(least2 < limit * limit))
            continue;
        for (int k = 0; k < seen->count; k++) {
            feet->kernels->near_field(&seen->near[k], feet->harmonics, FOOT_BLOCK, all->x + first, all->y + first, all->z + first, f);
            for (int l = 0; l < FOOT_BLOCK; l++)
                far2[l] = f[l] > 0 ? HUGE_VAL : far2[l];
        }
        for (int l = 0; l < FOOT_BLOCK; l++) {
            int node = all->node[first + l];
            if (!(far2[l] < limit * limit) || feet->field->sac_group[node] != group)
                continue;
            SweepStart more = {.at = {all->x[first + l], all->y[first + l], all->z[first + l]}, .far = sqrt(far2[l]), .segment = -1, .sac = node};
            more.least = sqrt(fmax(0, far2[l] - HALF * HALF * tree->radius[node] * tree->radius[node]));
            double aside = vec3_distance(more.at, search->from);
            if (aside > search->zone)
                *search->nearest_beyond = fmin(*search->nearest_beyond, more.far);
            if (aside > search->own)
                add_start(start, count, search->most, &more, 0.5 * tree->radius[node]);
        }
    }
}

enum { RAYS = 96 };

// The distance from a node's centre at which a ray leaves the sac's blobs; 0: the centre is outside.
static double leave_sac(const SweepField *field, int node, Vec3 way)
{
    enum { STEPS = 60, HALVINGS = 30 };
    const VesselTree *tree = field->model->sac;
    double step = 0.1 * tree->radius[node], low = 0, high = 0;
    SweepPart part;
    for (int i = 0; i < STEPS; i++, low = high, high += step) {
        sweep_field_sac(field, node, vec3_add_scaled(tree->center[node], high, way), &part);
        if (!(part.f > 0))
            break;
    }
    for (int i = 0; i < HALVINGS; i++) {
        double middle = 0.5 * (low + high);
        sweep_field_sac(field, node, vec3_add_scaled(tree->center[node], middle, way), &part);
        if (part.f > 0)
            low = middle;
        else
            high = middle;
    }
    return low;
}

// A point belongs to the node in whose power cell it lies.
bool sweep_sac_points_create(const SweepField *field, SweepSacPoints *points)
{
    *points = (SweepSacPoints){0};
    const VesselTree *tree = field->model->sac;
    if (!tree)
        return true;
    size_t room = (size_t)tree->node_count * RAYS + FOOT_BLOCK;
    points->x = calloc(3 * room, sizeof *points->x);
    points->node = calloc(room, sizeof *points->node);
    if (!points->x || !points->node)
        return false;
    points->y = points->x + room, points->z = points->y + room;
    Vec3 way[RAYS];
    field_directions(way, RAYS);
    for (int i = 0; i < tree->node_count; i++)
        for (int k = 0; k < RAYS && tree->kind[i] == NODE_ANEURYSM; k++) {
            double far = leave_sac(field, i, way[k]);
            Vec3 at = vec3_add_scaled(tree->center[i], far, way[k]);
            if (!(far > 0) || power_walk(tree, at, i, 1 << 20) != i)
                continue;
            points->x[points->count] = at.x, points->y[points->count] = at.y, points->z[points->count] = at.z;
            points->node[points->count++] = i;
        }
    for (; points->count % FOOT_BLOCK != 0; points->count++) {
        int last = points->count - 1;
        points->x[points->count] = points->x[last], points->y[points->count] = points->y[last], points->z[points->count] = points->z[last];
        points->node[points->count] = points->node[last];
    }
    return true;
}

void sweep_sac_points_free(SweepSacPoints *points)
{
    free(points->x);
    free(points->node);
    *points = (SweepSacPoints){0};
}

// t of x on a branch, to about a hundredth of the radius: for starts.
static double near_t(const SweepField *field, Vec3 x, double t, double longest, int *segment)
{
    enum { ROUNDS = 12 };
    for (int round = 0; round < ROUNDS; round++) {
        const SweepSegment *s = &field->segment[*segment];
        double at = t - s->origin;
        Vec3 u = vec3_sub(x, curve_part(s->s, at)), s1 = curve_slope(s->s, at), s2 = vec3_add_scaled(vec3_scale(s->s[2], 2), 6 * at, s->s[3]);
        double speed2 = vec3_norm2(s1), d = speed2 - vec3_dot(u, s2), step = vec3_dot(u, s1) / (d > SWEEP_LEAST_D * speed2 ? d : SWEEP_LEAST_D * speed2);
        step = step > longest ? longest : step < -longest ? -longest : step;
        t += step;
        *segment = neighbour(field, s, t);
        if (fabs(step) < 0.02 * longest)
            break;
    }
    return t;
}

int sweep_starts(const SweepFeet *feet, Vec3 x, SweepPlace place, int segment, const SweepSearch *search, SweepStart *start)
{
    SEL_ASSERT(search->most > 0 && search->most <= SWEEP_FEET && search->limit > 0, "starts fit into a block");
    const SweepField *field = feet->field;
    const SweepView *view = place.branch >= 0 ? &field->view[segment] : &field->sac[place.sac].view;
    double own_t = place.branch >= 0 ? fmax(0, fmin(field->curve[place.branch]->length, place.t)) : 0;
    Seen seen;
    int count = 0;
    seen.count = 0, seen.sac = search->alone ? -1 : place.branch >= 0 ? view->sac : place.sac;
    for (int i = 0; i < view->count; i++) {
        const SweepCandidate *c = &view->of[i];
        bool own = c->branch == place.branch;
        if (search->alone && !own)
            continue;
        double t = own ? place.t : c->t + c->slope * own_t;
        int k = seen.count++;
        seen.branch[k] = c->branch;
        seen.segment[k] = own ? segment : neighbour(field, &field->segment[c->segment], t);
        seen.t[k] = near_t(field, x, t, 2 * field->model->branch[c->branch].radius, &seen.segment[k]);
    }
    for (int i = 0; i < seen.count && (seen.count > 1 || seen.sac >= 0); i++)
        fill_near(feet, seen.branch[i], seen.segment[i], seen.t[i], &seen.near[i]);
    for (int i = 0; i < seen.count; i++) {
        const SweepSegment *s = &field->segment[seen.segment[i]];
        if (vec3_distance(x, curve_part(s->s, seen.t[i] - s->origin)) - s->largest < search->limit)
            add_rings(feet, x, &seen, i, fmin(search->limit, s->largest), search, start, &count);
    }
    if (seen.sac >= 0)
        add_sac(feet, x, &seen, search, start, &count);
    return count;
}

// --- Places ---

SweepPlace sweep_descend(const SweepFeet *feet, Vec3 x, SweepPlace place, double *f, Vec3 *gradient)
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
    *f = blend.f, *gradient = blend.gradient;
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
