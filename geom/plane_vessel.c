// A half space: gap = (x - point) . normal, exact everywhere, no node, no inlet. For friction tests (incline, stick, slip).
#include "geom/vessel.h"

#include "base/base.h"

#include <stdlib.h>

typedef struct PlaneVessel {
    Vessel vessel;           // first: a Vessel * points to its PlaneVessel
    Vec3 point, normal;
} PlaneVessel;

static void plane_query(const Vessel *vessel, int count, const Vec3 *point, double reach, VesselMemory *memory, VesselHit *hit)
{
    const PlaneVessel *plane = (const PlaneVessel *)vessel;
    (void)reach;
    for (int i = 0; i < count; i++) {
        double gap = vec3_dot(vec3_sub(point[i], plane->point), plane->normal);
        hit[i] = (VesselHit){.gap = gap, .normal = plane->normal, .node = 0};
        if (!isfinite(gap))
            hit[i] = (VesselHit){.normal = plane->normal, .flags = VESSEL_UNSURE};
        memory[i] = (VesselMemory){.node = 0, .has_foot = true, .foot = vec3_add_scaled(point[i], -gap, plane->normal)};
    }
}

static int plane_locate(const Vessel *vessel, Vec3 point, int from)
{
    (void)vessel, (void)point, (void)from;
    return 0;
}

static bool plane_inlet(const Vessel *vessel, Vec3 *point, Vec3 *direction)
{
    (void)vessel, (void)point, (void)direction;
    return false;
}

static void plane_destroy(Vessel *vessel) { free(vessel); }

Vessel *plane_vessel_create(Vec3 point, Vec3 normal)
{
    double length = vec3_norm(normal);
    if (!vec3_is_finite(point) || !isfinite(length) || !(length > 0))
        return NULL;
    PlaneVessel *plane = calloc(1, sizeof *plane);
    if (!plane)
        return NULL;
    plane->vessel = (Vessel){
        .kind = "plane", .query = plane_query, .locate = plane_locate, .inlet = plane_inlet, .destroy = plane_destroy, .primitives = 1, .bytes = sizeof *plane};
    plane->point = point;
    plane->normal = vec3_scale(normal, 1 / length);
    SEL_ASSERT(fabs(vec3_norm2(plane->normal) - 1) < 1e-12, "normals are unit vectors");
    return &plane->vessel;
}
