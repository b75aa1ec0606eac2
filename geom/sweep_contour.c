// Polar: R(theta) at equal angles, tangent (R', R) turned by theta. Of other kinds the curve is followed: a step along the tangent, then Newton across it for
// f = 0, halved where the curve turns by more than 40 degrees; it is closed when it comes back to its start. It starts at the contour of the nearest station.
// Published rasters have corners in every cell: short steps may turn by up to 100 degrees.
#include "geom/sweep_contour.h"

#include "base/base.h"
#include "geom/sweep_stretch.h"
#include "geom/sweep_terms.h"

#include <stdlib.h>

enum { LONGER = 16 };        // at most so many times `around` points

SweepPlane sweep_plane(const SweepField *field, int branch, double t)
{
    SweepJet j = sweep_curve_at(field->curve[branch], t);
    Vec3 across = vec3_cross(j.b, j.s1);
    double inverse = 1 / vec3_dot(j.n, across);
    return (SweepPlane){j.s, vec3_unit(j.s1), vec3_scale(across, inverse), vec3_scale(vec3_cross(j.s1, j.n), inverse)};
}

const SweepStretch *sweep_stretch_at(const SweepModel *model, int branch, double t)
{
    for (int i = 0; i < model->stretch_count; i++)
        if (model->stretch[i].branch == branch && sweep_stretch_share(model, &model->stretch[i], t).m > 0)
            return &model->stretch[i];
    return NULL;
}

// --- Polar ---

static void fill_polar(const SweepSegment *s, double t, int around, SweepContour *out)
{
    double x = t - s->origin, term[SWEEP_TERMS];
    for (int k = 0; k < SWEEP_TERMS; k++)
        term[k] = s->section[k][0] + x * (s->section[k][1] + x * (s->section[k][2] + x * s->section[k][3]));
    out->count = around;
    for (int i = 0; i < around; i++) {
        double angle = 2 * PI * i / around, cosine = same_cos(angle), sine = same_sin(angle), radius = sweep_terms_radius(term, angle), slope = 0;
        for (int k = 1; k <= SWEEP_HARMONICS; k++)
            slope += k * (term[2 * k] * same_cos(k * angle) - term[2 * k - 1] * same_sin(k * angle));
        double n = slope * cosine - radius * sine, b = slope * sine + radius * cosine, speed = same_hypot(n, b);
        out->point[i] = (SectionPoint){radius * cosine, radius * sine};
        out->way[i] = speed > 0 ? (SectionPoint){n / speed, b / speed} : (SectionPoint){-sine, cosine};
    }
}

// --- Other kinds ---

typedef struct Tracer {
    const SweepField *field;
    const SweepSegment *segment;
    int branch;
    double t;
    SweepPlane plane;
} Tracer;

static double value_at(const Tracer *c, SectionPoint at, SectionPoint *gradient)
{
    SweepPart part = {.branch = c->branch};
    Vec3 x = vec3_add_scaled(vec3_add_scaled(c->plane.s, at.n, c->plane.p), at.b, c->plane.q);
    sweep_branch_evaluate(c->field, c->branch, c->segment, x, c->t, &part);
    *gradient = (SectionPoint){vec3_dot(part.gradient, c->plane.p), vec3_dot(part.gradient, c->plane.q)};
    return part.f;
}

// Moves a point onto f = 0 along the gradient by at most `most` altogether; *way comes out as the tangent.
static bool settle(const Tracer *c, double most, SectionPoint *at, SectionPoint *way)
{
    SectionPoint from = *at, g;
    for (int i = 0; i < 20; i++) {
        double f = value_at(c, *at, &g), slope2 = g.n * g.n + g.b * g.b;
        if (!(slope2 > 1e-12) || !isfinite(f))
            return false;
        double slope = sqrt(slope2);
        *way = (SectionPoint){g.b / slope, -g.n / slope};    // the lumen, where f grows, is on the left
        if (fabs(f) < 1e-10 * slope)
            return true;
        at->n -= f * g.n / slope2, at->b -= f * g.b / slope2;
        if (same_hypot(at->n - from.n, at->b - from.b) > most)
            return false;
    }
    return fabs(value_at(c, *at, &g)) < 1e-6 * same_hypot(g.n, g.b);
}

static bool start_at(const Tracer *c, const SweepStretch *stretch, double radius, SectionPoint *at, SectionPoint *way)
{
    const SweepModel *m = c->field->model;
    const SweepStation *near = &m->station[stretch->first_station];
    for (int k = stretch->first_station; k < stretch->first_station + stretch->station_count; k++)
        near = fabs(m->station[k].t - c->t) < fabs(near->t - c->t) ? &m->station[k] : near;
    for (int i = 0; i < near->point_count; i++) {
        *at = m->contour[near->first_point + i];
        if (settle(c, radius, at, way))
            return true;
    }
    return false;
}

static bool follow(const Tracer *c, const SweepStretch *stretch, double radius, int around, SweepContour *out)
{
    const double step = 2 * PI * radius / around, turn = 0.766, sharp = -0.17, SHORT = 0.1;     // cosines of 40 and 100 degrees
    SectionPoint at, way, next, ahead;
    if (!start_at(c, stretch, radius, &at, &way))
        return false;
    for (out->count = 0; out->count < LONGER * around;) {
        out->point[out->count] = at, out->way[out->count++] = way;
        bool taken = false;
        for (double length = step; !taken && length > 1e-3 * step; length *= 0.5) {
            next = (SectionPoint){at.n + length * way.n, at.b + length * way.b};
            taken = settle(c, length, &next, &ahead) && ahead.n * way.n + ahead.b * way.b > (length < SHORT * step ? sharp : turn);
        }
        if (!taken)
            return false;
        // the start lies between the two: the curve is closed
        double n = out->point[0].n - at.n, b = out->point[0].b - at.b, along = n * way.n + b * way.b;
        double length = same_hypot(next.n - at.n, next.b - at.b);
        if (out->count > 8 && along > 0 && along <= length * (1 + 1e-9) && same_hypot(n, b) < 1.5 * length) {
            // not two points in the same place
            out->count -= same_hypot(n, b) < 1e-6 * step;
            return polygon_area(out->count, out->point) > 0;
        }
        at = next, way = ahead;
    }
    return false;
}

bool sweep_contour_create(const SweepField *field, int branch, double t, int around, SweepContour *out)
{
    double length = field->curve[branch]->length;
    SEL_ASSERT(t >= 0 && t <= length && around >= 16, "the section lies on the branch, and has points around it");
    // the section at the end belongs to the segment before it
    const SweepSegment *s = &field->segment[t < length ? sweep_field_segment(field, branch, t) : field->first_segment[branch + 1] - 3];
    const SweepStretch *stretch = sweep_stretch_at(field->model, branch, t);
    int room = stretch ? LONGER * around : around;
    *out = (SweepContour){.kind = stretch ? stretch->section.kind : SECTION_POLAR,
                          .point = calloc((size_t)room, sizeof *out->point),
                          .way = calloc((size_t)room, sizeof *out->way)};
    bool good = out->point && out->way;
    if (good && stretch) {
        Tracer tracer = {field, s, branch, t, sweep_plane(field, branch, t)};
        good = follow(&tracer, stretch, sweep_field_mean(field, branch, t), around, out);
    } else if (good) {
        fill_polar(s, t, around, out);
    }
    if (!good)
        sweep_contour_free(out);
    return good;
}

static double span(const SweepContour *c, int i)
{
    const SectionPoint *p = &c->point[i % c->count], *q = &c->point[(i + 1) % c->count];
    return same_hypot(q->n - p->n, q->b - p->b);
}

void sweep_contour_sample(const SweepContour *c, int count, SectionPoint *point, SectionPoint *way)
{
    if (c->kind == SECTION_POLAR && c->count % count == 0) {
        for (int i = 0; i < count; i++) {
            point[i] = c->point[i * (c->count / count)];
            if (way)
                way[i] = c->way[i * (c->count / count)];
        }
        return;
    }
    // the first point lies in the direction n, the outermost one if there are several
    int first = 0;
    double perimeter = 0, least = HUGE_VAL, before = 0;
    for (int i = 0; i < c->count; i++) {
        double n = c->point[i].n, b = c->point[i].b, aside = fabs(b) - 0.01 * n;
        if (n > 0 && aside < least)
            least = aside, first = i;
        perimeter += span(c, i);
    }
    for (int i = 0, at = first; i < count; i++) {
        double wanted = perimeter * i / count, here = span(c, at);
        while (before + here < wanted)
            before += here, here = span(c, ++at);
        const SectionPoint *p = &c->point[at % c->count], *q = &c->point[(at + 1) % c->count];
        double part = here > 0 ? (wanted - before) / here : 0;
        point[i] = (SectionPoint){p->n + part * (q->n - p->n), p->b + part * (q->b - p->b)};
        if (way)
            way[i] = c->way[at % c->count];
    }
}

void sweep_contour_free(SweepContour *contour)
{
    free(contour->point);
    free(contour->way);
    *contour = (SweepContour){0};
}
