// The exact tube: the union of spheres of one radius along a centreline of lines and arcs, or along a polyline. It is the reference geometry of the mechanics
// tests (docs/references.md "Wire and walls").
//
// With d the distance from X to the centreline and F its foot there: gap = radius - d, normal = (F - X) / d, and the gap's Hessian is -Hess d:
// straight: 1/d about the axis, 0 along it;  arc of radius R, rho the distance to its axis: also (rho - R) / (rho d) along the arc;
//   end or corner (the nearest centreline point is a fixed point): 1/d in both directions.
//
// The centreline is divided into segments, arcs into parts of at most 90 degrees, so that a segment's closest point is unique near the tube. Between two
// segments lies a plane through their joint, perpendicular to the mean of their directions: near the tube a point is closer to the segment on its own side. A
// point walks from its last segment across such planes, only to a neighbour and only if that is closer: it never jumps to another coil that crosses or nearly
// touches its own, and its cost does not depend on the number of segments.
//
// Open ends. Upstream of the first plane the first cross-section continues as a cylinder without end: a coil that bulges back past the sheath is held. The last
// end's wall flares like the bell of a trumpet, a quarter of a circle of radius L = radius: the rim is rounded because a sharp edge can hold a tool only at
// points that happen to lie in its plane. So a wire that leaves at an angle leans on the bell, tangentially at first. There gap = D - L, with D the distance to
// the circle of radius (radius + L) in the end plane. Two radii beyond the end, where the bell is further away than any tool's radius, there is no wall.
#include "geom/vessel.h"
#include "base/base.h"

#include <stdlib.h>

enum { SEGMENTS_MAX = 1000000 };

typedef struct Segment {
    Vec3 start, end;
    Vec3 tangent;            // at the start
    Vec3 end_tangent;
    Vec3 normal;             // transported frame at the start; an arc turns towards it
    Vec3 binormal;           // tangent x normal, the arc's axis
    Vec3 center;             // centre of the arc
    Vec3 joint;              // normal of the plane at the end, in the direction of the tube (not a unit vector)
    double length;           // line
    double arc_radius;       // 0: line
    double angle;            // arc, (0, pi/2] …
    double cosine, sine, half_cosine, half_sine;     // … and of half of it
} Segment;

typedef struct TubeVessel {
    Vessel vessel;           // first: a Vessel * points to its TubeVessel
    double radius;
    bool closed_ends;
    int count;
    Segment *segment;
} TubeVessel;

typedef struct CentrePoint {
    Vec3 foot, tangent, side;    // side: a unit vector perpendicular to the tangent, for a point on the centreline itself
    double distance2;
    double rho;                  // arc: distance of X to its axis
    int end;                     // -1 before the segment's start, +1 beyond its end, 0 between
} CentrePoint;

static CentrePoint closest_on_segment(const Segment *s, Vec3 x)
{
    CentrePoint c = {.end = 0};
    if (s->arc_radius == 0) {
        double t = vec3_dot(vec3_sub(x, s->start), s->tangent);
        c.foot = vec3_add_scaled(s->start, t, s->tangent);
        c.tangent = s->tangent;
        c.side = s->normal;
        c.end = t < 0 ? -1 : t > s->length ? 1 : 0;
    } else {
        // in the plane of the arc, from its centre: u towards the start, v along the tangent there
        Vec3 y = vec3_sub(x, s->center);
        double u = -vec3_dot(y, s->normal), v = vec3_dot(y, s->tangent), rho = sqrt(u * u + v * v);
        double cp = rho > 0 ? u / rho : s->half_cosine, sp = rho > 0 ? v / rho : s->half_sine;
        if (sp < 0 || cp * s->sine < sp * s->cosine)     // outside the arc's sector: the end on X's side of the middle
            c.end = sp * s->half_cosine < cp * s->half_sine ? -1 : 1;
        Vec3 out = vec3_add_scaled(vec3_scale(s->normal, -cp), sp, s->tangent);
        c.rho = rho;
        c.foot = vec3_add_scaled(s->center, s->arc_radius, out);
        c.tangent = vec3_add_scaled(vec3_scale(s->tangent, cp), sp, s->normal);
        c.side = vec3_negate(out);
    }
    if (c.end != 0) {
        c.foot = c.end < 0 ? s->start : s->end;
        c.tangent = c.end < 0 ? s->tangent : s->end_tangent;
    }
    c.distance2 = vec3_norm2(vec3_sub(x, c.foot));
    return c;
}

static bool is_past(const Segment *s, Vec3 x) { return vec3_dot(vec3_sub(x, s->end), s->joint) > 0; }

// Walks to ever closer neighbours; ends, because the distance decreases strictly.
static int walk(const TubeVessel *tube, Vec3 x, int segment, CentrePoint *closest)
{
    SEL_ASSERT(segment >= 0 && segment < tube->count, "a walk starts on a segment of the tube");
    const Segment *s = tube->segment;
    *closest = closest_on_segment(&s[segment], x);
    for (int step = -1; step <= 1; step += 2)
        for (int next = segment + step; next >= 0 && next < tube->count; next += step) {
            bool on = step > 0 ? closest->end > 0 || is_past(&s[segment], x) : closest->end < 0 || !is_past(&s[next], x);
            if (!on)
                break;
            CentrePoint c = closest_on_segment(&s[next], x);
            if (!(c.distance2 < closest->distance2))
                break;
            *closest = c;
            segment = next;
        }
    return segment;
}

static int nearest_overall(const TubeVessel *tube, Vec3 x)
{
    SEL_ASSERT(tube->count > 0, "a tube has a segment");
    int best = 0;
    double least = HUGE_VAL;
    for (int i = 0; i < tube->count; i++) {
        CentrePoint c = closest_on_segment(&tube->segment[i], x);
        if (c.distance2 < least) {
            least = c.distance2;
            best = i;
        }
    }
    return best;
}

// The gap's curvature grows without bound towards the centreline and, outside, towards the axis of an arc. Contacts occur at neither place, and both curvatures
// are limited to their values at a tenth of the radius.
static Sym3 gap_hessian(const TubeVessel *tube, const Segment *s, const CentrePoint *c, Vec3 normal, double distance)
{
    SEL_ASSERT(distance >= 0, "a distance is a length");
    Sym3 h = {0, 0, 0, 0, 0, 0};
    double least = 0.1 * tube->radius, d = distance > least ? distance : least;
    if (c->end != 0) {
        // a fixed closest point: a sphere about it, -(I - n n') / d
        h.xx = h.yy = h.zz = -1 / d;
        sym3_add_outer(&h, 1 / d, normal);
        return h;
    }
    sym3_add_outer(&h, -1 / d, vec3_cross(c->tangent, normal));
    if (s->arc_radius > 0) {
        double rho = c->rho > least ? c->rho : least;
        sym3_add_outer(&h, -(rho - s->arc_radius) / (rho * d), c->tangent);
    }
    return h;
}

static VesselHit open_end(VesselMemory *memory, int node)
{
    memory->has_foot = false;
    return (VesselHit){.gap = HUGE_VAL, .node = node, .flags = VESSEL_OPEN_END};
}

// Hit at height z > 0 beyond the last end's plane: the bell.
static VesselHit hit_bell(const TubeVessel *tube, Vec3 x, Vec3 end, Vec3 tangent, double z, VesselMemory *memory)
{
    SEL_ASSERT(z > 0, "the bell begins beyond the last plane");
    double r = tube->radius, bell = r;
    Vec3 radial = vec3_add_scaled(vec3_sub(x, end), -z, tangent);
    double rho = vec3_norm(radial), aside = r + bell - rho, far = same_hypot(z, aside);
    if (z > 2 * bell || rho > r + 2 * bell)
        return open_end(memory, memory->node);
    VesselHit hit = {.node = memory->node, .flags = VESSEL_BEYOND};
    if (aside <= 0) {   // before the flange at the end of the bell
        hit.gap = z - bell;
        hit.normal = tangent;
    } else {
        const Segment *last = &tube->segment[tube->count - 1];
        Vec3 side = last->arc_radius > 0 ? vec3_scale(vec3_sub(last->center, last->end), 1 / last->arc_radius) : last->normal;
        Vec3 out = rho > 1e-9 * r ? vec3_scale(radial, 1 / rho) : vec3_negate(side);
        hit.gap = far - bell;
        hit.normal = vec3_add_scaled(vec3_scale(tangent, z / far), -aside / far, out);
        sym3_add_outer(&hit.hessian, 1 / far, vec3_add_scaled(vec3_scale(tangent, aside / far), z / far, out));
        sym3_add_outer(&hit.hessian, -aside / (far * fmax(rho, 0.1 * r)), vec3_cross(tangent, out));
    }
    memory->has_foot = true;
    memory->foot = vec3_add_scaled(x, -hit.gap, hit.normal);
    return hit;
}

static VesselHit hit_at(const TubeVessel *tube, Vec3 x, VesselMemory *memory)
{
    VesselHit hit = {.node = memory->node};
    if (!(vec3_norm2(x) < 1e200)) {
        hit.flags = VESSEL_UNSURE;
        return hit;
    }
    CentrePoint c;
    if (memory->node < 0 || memory->node >= tube->count)
        memory->node = nearest_overall(tube, x);
    int k = hit.node = memory->node = walk(tube, x, memory->node, &c);
    const Segment *s = &tube->segment[k];
    if (c.end != 0) {
        double forward = vec3_dot(vec3_sub(x, c.foot), c.tangent);
        // on the plane of a smooth joint, rounding may put a point before one segment and beyond the other: that is no corner
        if (fabs(forward) <= 1e-9 * tube->radius)
            c.end = 0;
        else if (!tube->closed_ends && k == 0 && c.end < 0 && forward < 0) {
            c = (CentrePoint){.foot = vec3_add_scaled(c.foot, forward, c.tangent), .tangent = c.tangent, .side = s->normal, .rho = s->arc_radius};
            c.distance2 = vec3_norm2(vec3_sub(x, c.foot));
            hit.flags = VESSEL_BEYOND;
        } else if (!tube->closed_ends && k == tube->count - 1 && c.end > 0 && forward > 0)
            return hit_bell(tube, x, c.foot, c.tangent, forward, memory);
    }
    double d = sqrt(c.distance2);
    hit.gap = tube->radius - d;
    hit.normal = d > 1e-9 * tube->radius ? vec3_scale(vec3_sub(c.foot, x), 1 / d) : c.side;
    hit.hessian = gap_hessian(tube, s, &c, hit.normal, d);
    memory->has_foot = true;
    memory->foot = vec3_add_scaled(c.foot, -tube->radius, hit.normal);
    return hit;
}

static void tube_query(const Vessel *vessel, int count, const Vec3 *point, double reach, VesselMemory *memory, VesselHit *hit)
{
    (void)reach;   // the exact result costs no more than a bound
    for (int i = 0; i < count; i++)
        hit[i] = hit_at((const TubeVessel *)vessel, point[i], &memory[i]);
}

static int tube_locate(const Vessel *vessel, Vec3 point, int from)
{
    const TubeVessel *tube = (const TubeVessel *)vessel;
    CentrePoint c;
    if (!vec3_is_finite(point))
        return from < 0 || from >= tube->count ? 0 : from;
    return from < 0 || from >= tube->count ? nearest_overall(tube, point) : walk(tube, point, from, &c);
}

static bool tube_inlet(const Vessel *vessel, Vec3 *point, Vec3 *direction)
{
    const TubeVessel *tube = (const TubeVessel *)vessel;
    *point = tube->segment[0].start;
    *direction = tube->segment[0].tangent;
    return true;
}

static void tube_destroy(Vessel *vessel)
{
    if (vessel)
        free(((TubeVessel *)vessel)->segment);
    free(vessel);
}

// --- Creation ---

static void check_pieces(const TubeOptions *o, const char *file, Faults *faults)
{
    double parts = 0;
    for (int i = 0; i < o->piece_count; i++) {
        const TubePiece *p = &o->piece[i];
        if (!isfinite(p->angle) || p->angle < 0)
            faults_add(faults, file, 0, 0, "tube: path[%d] turns by %g deg; expected an arc's angle above 0", i, p->angle * 180 / PI);
        else if (p->angle == 0 && (!isfinite(p->length) || !(p->length > 0)))
            faults_add(faults, file, 0, 0, "tube: path[%d] is %g mm long; expected a line's length above 0 (or an arc's angle)", i, p->length);
        else if (p->angle > 0 && (!isfinite(p->arc_radius) || !(p->arc_radius > o->radius)))
            faults_add(faults, file, 0, 0, "tube: path[%d] has an arc of radius %g mm; it must be larger than the lumen's radius, %g mm", i, p->arc_radius,
                       o->radius);
        if (!isfinite(p->plane))
            faults_add(faults, file, 0, 0, "tube: path[%d] has an arc's plane that is not a number; expected degrees", i);
        parts += p->angle > 0 ? 1 + p->angle / (PI / 2) : 1;
    }
    if (!(parts < SEGMENTS_MAX))
        faults_add(faults, file, 0, 0, "tube: the path turns %g quarter turns; expected fewer than %d lines and quarter turns", parts, (int)SEGMENTS_MAX);
}

static void check_polyline(const TubeOptions *o, const char *file, Faults *faults)
{
    if (o->point_count < 2 || o->point_count > SEGMENTS_MAX) {
        faults_add(faults, file, 0, 0, "tube: the centreline has %d points; expected 2 to %d", o->point_count, (int)SEGMENTS_MAX);
        return;
    }
    for (int i = 0; i < o->point_count; i++) {
        if (!vec3_is_finite(o->point[i])) {
            faults_add(faults, file, 0, 0, "tube: point %d is (%g, %g, %g); expected finite coordinates in mm", i, o->point[i].x, o->point[i].y, o->point[i].z);
            return;
        }
        if (i > 0 && !(vec3_distance(o->point[i - 1], o->point[i]) > 1e-9)) {
            faults_add(faults, file, 0, 0, "tube: points %d and %d coincide; expected distinct neighbours", i - 1, i);
            return;
        }
    }
}

static bool check_options(const TubeOptions *o, const char *file, Faults *faults)
{
    int before = faults->count;
    bool pieces = o->piece_count > 0 && o->piece, points = o->point_count > 0 && o->point;
    if (!isfinite(o->radius) || !(o->radius > 0))
        faults_add(faults, file, 0, 0, "tube: radius_mm is %g; expected a number above 0", o->radius);
    if (pieces == points)
        faults_add(faults, file, 0, 0, "tube: %s; expected exactly one of `path` and `points`",
                   pieces ? "both a path and points are given" : "neither a path nor points are given");
    else if (points)
        check_polyline(o, file, faults);
    else {
        check_pieces(o, file, faults);
        double length = vec3_norm(o->direction), across = vec3_norm(vec3_cross(o->direction, o->normal));
        bool turns = false;
        for (int i = 0; i < o->piece_count; i++)
            turns = turns || o->piece[i].angle > 0;
        if (!vec3_is_finite(o->start))
            faults_add(faults, file, 0, 0, "tube: start_mm is not finite; expected coordinates in mm");
        if (!isfinite(length) || !(length > 1e-12))
            faults_add(faults, file, 0, 0, "tube: direction has no length; expected a vector into the tube");
        else if (turns && !(across > 1e-9 * length * vec3_norm(o->normal)))
            faults_add(faults, file, 0, 0, "tube: normal is zero or along direction; arcs turn towards it, so expected a vector across direction");
    }
    return faults->count == before;
}

static Vec3 unit_across(Vec3 v, Vec3 tangent)
{
    Vec3 across = vec3_add_scaled(v, -vec3_dot(v, tangent), tangent);
    return vec3_is_finite(v) && vec3_norm(across) > 1e-9 * vec3_norm(v) ? vec3_unit(across) : vec3_normal_to(tangent);
}

static int add_arc(Segment *out, Vec3 *p, Vec3 *t, Vec3 *n, double arc_radius, double angle)
{
    int parts = (int)ceil(angle / (PI / 2) - 1e-9);
    parts = parts < 1 ? 1 : parts;
    double part = angle / parts, cs = same_cos(part), sn = same_sin(part), half_cs = same_cos(0.5 * part), half_sn = same_sin(0.5 * part);
    for (int k = 0; k < parts; k++) {
        SEL_ASSERT(part > 0 && part < 0.51 * PI && arc_radius > 0, "an arc is cut into parts of 90 degrees at most");
        Segment s = {.start = *p,
                     .tangent = *t,
                     .normal = *n,
                     .arc_radius = arc_radius,
                     .angle = part,
                     .cosine = cs,
                     .sine = sn,
                     .half_cosine = half_cs,
                     .half_sine = half_sn};
        s.binormal = vec3_cross(*t, *n);
        s.center = vec3_add_scaled(*p, arc_radius, *n);
        s.end_tangent = vec3_unit(vec3_add_scaled(vec3_scale(*t, cs), sn, *n));
        *n = unit_across(vec3_add_scaled(vec3_scale(*n, cs), -sn, *t), s.end_tangent);
        *t = s.end_tangent;
        *p = s.end = vec3_add_scaled(s.center, -arc_radius, *n);
        out[k] = s;
    }
    return parts;
}

static int add_line(Segment *out, Vec3 *p, Vec3 t, Vec3 n, double length)
{
    SEL_ASSERT(length > 0 && fabs(vec3_norm2(t) - 1) < 1e-12, "a line has a length and a unit direction");
    Segment s = {.start = *p, .tangent = t, .end_tangent = t, .normal = n, .binormal = vec3_cross(t, n), .length = length};
    *p = s.end = vec3_add_scaled(*p, length, t);
    *out = s;
    return 1;
}

static int lay_pieces(const TubeOptions *o, Segment *out)
{
    int count = 0;
    Vec3 p = o->start, t = vec3_unit(o->direction), n = unit_across(o->normal, t);
    for (int i = 0; i < o->piece_count; i++) {
        const TubePiece *piece = &o->piece[i];
        if (piece->angle > 0) {
            n = unit_across(quat_rotate(quat_from_rotation_vector(vec3_scale(t, piece->plane)), n), t);
            count += add_arc(out + count, &p, &t, &n, piece->arc_radius, piece->angle);
        } else
            count += add_line(out + count, &p, t, n, piece->length);
    }
    SEL_ASSERT(count > 0, "a path has a line or an arc");
    return count;
}

static int lay_polyline(const TubeOptions *o, Segment *out)
{
    Vec3 n = o->normal;
    for (int i = 0; i + 1 < o->point_count; i++) {
        Vec3 p = o->point[i], step = vec3_sub(o->point[i + 1], p), t = vec3_unit(step);
        n = unit_across(n, t);
        add_line(out + i, &p, t, n, vec3_norm(step));
        out[i].end = o->point[i + 1];   // the exact value, so that neighbours share their corner bit for bit
    }
    return o->point_count - 1;
}

Vessel *tube_vessel_create(const TubeOptions *options, const char *file, Faults *faults)
{
    if (!check_options(options, file, faults))
        return NULL;
    bool pieces = options->piece_count > 0 && options->piece;
    size_t capacity = 0;
    for (int i = 0; pieces && i < options->piece_count; i++)
        capacity += 2 + (size_t)(options->piece[i].angle / (PI / 2));
    if (!pieces)
        capacity = (size_t)options->point_count;
    TubeVessel *tube = calloc(1, sizeof *tube);
    Segment *segment = calloc(capacity, sizeof *segment);
    if (!tube || !segment) {
        faults_add(faults, file, 0, 0, "tube: not enough memory for %zu segments", capacity);
        free(tube);
        free(segment);
        return NULL;
    }
    tube->vessel = (Vessel){.kind = "tube", .query = tube_query, .locate = tube_locate, .inlet = tube_inlet, .destroy = tube_destroy};
    tube->radius = options->radius;
    tube->closed_ends = options->closed_ends;
    tube->segment = segment;
    tube->count = pieces ? lay_pieces(options, segment) : lay_polyline(options, segment);
    SEL_REQUIRE(tube->count > 0 && (size_t)tube->count <= capacity, "the lines and parts of arcs fit into the counted capacity");
    tube->vessel.primitives = tube->count;
    tube->vessel.bytes = sizeof *tube + (size_t)tube->count * sizeof *segment;
    for (int i = 0; i + 1 < tube->count; i++)
        segment[i].joint = vec3_add(segment[i].end_tangent, segment[i + 1].tangent);
    return &tube->vessel;
}
