#include "bench/collision_course.h"

#include "bench/bench.h"
#include "geom/power_walk.h"

#include <stdlib.h>

static const double STEP = 0.05, GAP = 0.1, GAP_SWING = 0.05, SWING_LENGTH = 7;    // [mm]
static const double NEAR_ENOUGH = 1e-3;   // [mm]
static const double REACH = 0.5;         // [mm] all points are nearer to the wall than this
enum { STEPS_APART = 10 };               // a wire's points, half a millimetre

typedef struct Walker {
    Vec3 x, heading;         // unit, along the wall; 0 before the first step
    double sense;            // with or against the nodes' directions
    double way;              // [mm] travelled since the start
    int node;                // of the tree of directions
    VesselMemory memory;
    VesselHit hit;
} Walker;

static bool has_wall(const VesselHit *hit) { return hit->flags == 0 && isfinite(hit->gap); }

// Moves along the normal to the depth required by this stretch.
static bool pull(const Vessel *exact, Walker *w)
{
    enum { ROUNDS = 8 };
    double wanted = GAP + GAP_SWING * sin(2 * PI * w->way / SWING_LENGTH);
    for (int round = 0; round < ROUNDS; round++) {
        vessel_query(exact, 1, &w->x, REACH, &w->memory, &w->hit);
        if (!has_wall(&w->hit))
            return false;
        if (fabs(w->hit.gap - wanted) < NEAR_ENOUGH)
            return true;
        w->x = vec3_add_scaled(w->x, wanted - w->hit.gap, w->hit.normal);
    }
    return false;
}

static bool begin_walk(const Vessel *exact, const VesselTree *nodes, Vec3 x, int from, double way, Walker *w)
{
    *w = (Walker){.x = x, .sense = 1, .way = way, .node = from >= 0 ? power_walk(nodes, x, from, nodes->node_count) : power_nearest(nodes, x)};
    w->memory = (VesselMemory){.node = exact->locate(exact, x, from)};
    return pull(exact, w);
}

// A step along the node's direction, or straight on past a blind end; never back, except where the wall ends.
static void walk(const Vessel *exact, const VesselTree *nodes, Walker *w)
{
    Walker before = *w;
    Vec3 n = w->hit.normal;
    w->node = power_walk(nodes, w->x, w->node, 4);
    Vec3 ahead = vec3_scale(nodes->direction[w->node], w->sense);
    if (fabs(vec3_dot(ahead, n)) > 0.85)
        ahead = w->heading;
    ahead = vec3_unit_or(vec3_add_scaled(ahead, -vec3_dot(ahead, n), n), vec3_normal_to(n));
    if (vec3_dot(ahead, w->heading) < 0) {
        ahead = vec3_negate(ahead);
        w->sense = -w->sense;
    }
    w->heading = ahead;
    w->x = vec3_add_scaled(w->x, STEP, ahead);
    w->way += STEP;
    if (pull(exact, w))
        return;
    *w = before;
    w->sense = -w->sense;
    w->heading = vec3_negate(w->heading);
}

static bool reserve(Course *c, int points, int steps)
{
    size_t count = (size_t)points * (size_t)steps;
    *c = (Course){points, steps, false, calloc(count, sizeof *c->place), calloc(count, sizeof *c->truth)};
    return c->place && c->truth;
}

void course_free(Course *course)
{
    free(course->place);
    free(course->truth);
    *course = (Course){0};
}

static void record(Course *c, int point, int step, const Walker *w)
{
    size_t at = (size_t)step * (size_t)c->points + (size_t)point;
    c->place[at] = w->x;
    c->truth[at] = w->hit;
}

bool course_wire(const Vessel *exact, const VesselTree *nodes, Vec3 start, int from, int points, int steps, Course *out)
{
    Walker w;
    if (!reserve(out, points, steps) || !begin_walk(exact, nodes, start, from, 0, &w))
        return false;
    out->in_line = true;
    // the k-th place of the track is point p's at step s for all p and s with p * STEPS_APART + s = k
    for (int k = 0; k < (points - 1) * STEPS_APART + steps; k++) {
        for (int p = k / STEPS_APART; p >= 0 && k - p * STEPS_APART < steps; p--)
            if (p < points)
                record(out, p, k - p * STEPS_APART, &w);
        walk(exact, nodes, &w);
    }
    return true;
}

bool course_all_over(const Vessel *exact, const VesselTree *nodes, const TriangleMesh *mesh, int points, int steps, Course *out)
{
    if (!reserve(out, points, steps))
        return false;
    int found = 0, count = mesh->vertex_count;
    for (int tried = 0; tried < 4 * points && found < points; tried++) {
        Walker w;
        int v = (int)(((int64_t)tried * count / points + tried / points * 7) % count);   // several passes over the mesh, with other vertices each time
        if (!begin_walk(exact, nodes, mesh->vertex[v], -1, 0.37 * tried, &w))
            continue;
        for (int s = 0; s < steps; s++) {
            record(out, found, s, &w);
            walk(exact, nodes, &w);
        }
        found++;
    }
    return found == points;
}

// --- queries ---

typedef struct Asker {
    int count;
    const Course *course;
    VesselMemory *memory;    // of all courses' points
    VesselHit *hit;          // of one course's
} Asker;

static bool asker_begin(Asker *a, const Vessel *vessel, int count, const Course *course)
{
    size_t points = 0, most = 0;
    for (int k = 0; k < count; k++) {
        points += (size_t)course[k].points;
        most = (size_t)course[k].points > most ? (size_t)course[k].points : most;
    }
    *a = (Asker){count, course, calloc(points, sizeof *a->memory), calloc(most, sizeof *a->hit)};
    if (!a->memory || !a->hit)
        return false;
    VesselMemory *memory = a->memory;
    for (int k = 0; k < count; memory += course[k++].points)
        for (int p = 0; p < course[k].points; p++)
            memory[p].node = vessel->locate(vessel, course[k].place[p], p > 0 && course[k].in_line ? memory[p - 1].node : -1);
    return true;
}

static void asker_end(Asker *a)
{
    free(a->memory);
    free(a->hit);
}

static void ask(const Vessel *vessel, Asker *a, int step)
{
    VesselMemory *memory = a->memory;
    for (const Course *c = a->course; c < a->course + a->count; memory += c++->points)
        vessel_query(vessel, c->points, c->place + (size_t)step * (size_t)c->points, REACH, memory, a->hit);
}

double course_ns(const Vessel *vessel, int count, const Course *course, int runs)
{
    Asker a;
    double least = NAN, queries = 0;
    int steps = course[0].steps;
    bool good = asker_begin(&a, vessel, count, course);
    for (int k = 0; k < count; k++)
        queries += (double)course[k].points * steps;
    for (int run = 0; good && run <= runs; run++) {
        int64_t begin = bench_cpu_ns();
        for (int s = 0; s < steps; s++)
            ask(vessel, &a, run % 2 ? steps - 1 - s : s);
        double ns = (double)(bench_cpu_ns() - begin) / queries;
        least = run > 0 ? fmin(least, ns) : NAN;   // fmin leaves out NAN
    }
    asker_end(&a);
    return least;
}

bool course_error(const Vessel *vessel, const Course *course, CourseError *out)
{
    Asker a;
    double gap2 = 0, turn2 = 0;
    int count = 0;
    bool good = asker_begin(&a, vessel, 1, course);
    *out = (CourseError){0};
    for (int s = 0; good && s < course->steps; s++) {
        ask(vessel, &a, s);
        const VesselHit *truth = course->truth + (size_t)s * (size_t)course->points;
        for (int p = 0; p < course->points; p++) {
            const VesselHit *h = &a.hit[p], *t = &truth[p];
            if (!has_wall(h)) {
                out->flagged++;
                continue;
            }
            double gap = 1000 * fabs(h->gap - t->gap);
            double turn = vec3_angle(h->normal, t->normal) * 180 / PI;
            gap2 += gap * gap;
            turn2 += turn * turn;
            out->gap_max_um = fmax(out->gap_max_um, gap);
            out->normal_max_deg = fmax(out->normal_max_deg, turn);
            count++;
        }
    }
    asker_end(&a);
    out->gap_rms_um = sqrt(gap2 / count);
    out->normal_rms_deg = sqrt(turn2 / count);
    return good && count > 0;
}
