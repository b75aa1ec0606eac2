#include "sim/library/wall_query.h"

#include "sim/library/context.h"

typedef struct Query {
    const Vessel *vessel;
    int count;
    const double *point;
    double *gap, *normal;
} Query;

// Each point is located separately, so that no result depends on another.
static VesselHit hit_at(const Vessel *vessel, Vec3 x)
{
    VesselMemory memory = {.node = vessel->locate(vessel, x, -1)};
    VesselHit hit;
    vessel_query(vessel, 1, &x, HUGE_VAL, &memory, &hit);
    return hit;
}

static bool run_query(SelContext *context, void *what)
{
    const Query *query = what;
    for (int i = 0; i < query->count; i++) {
        Vec3 x = vec3(query->point[3 * i], query->point[3 * i + 1], query->point[3 * i + 2]);
        if (!vec3_is_finite(x)) {
            faults_add(&context->faults, "sel_scene_query", 0, 0, "point %d is not finite", i);
            return false;
        }
        VesselHit hit = hit_at(query->vessel, x);
        query->gap[i] = hit.gap;
        if (query->normal)
            query->normal[3 * i] = hit.normal.x, query->normal[3 * i + 1] = hit.normal.y, query->normal[3 * i + 2] = hit.normal.z;
    }
    return true;
}

SelStatus wall_query(SelContext *context, const Vessel *vessel, int count, const double *point_mm, double *gap_mm, double *normal)
{
    return context_call(context, run_query, &(Query){.vessel = vessel, .count = count, .point = point_mm, .gap = gap_mm, .normal = normal}, SEL_ERROR_ARGUMENT);
}
