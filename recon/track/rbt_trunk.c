#include "recon/track/rbt_trunk.h"

#include "recon/track/rbt_branch.h"
#include "recon/track/rbt_start.h"

#include <stdio.h>

// Where to attach a subtree that starts at x: the node of least power distance whose straight link stays inside the lumen (at least half as bright as
// its ends); if no link does, the brightest one among the near nodes.
int tracker_attachment(const Tracker *t, Vec3 x, int node_count)
{
    int best = -1, brightest = -1;
    double least = HUGE_VAL, most = -HUGE_VAL, reach = HUGE_VAL;
    for (int i = 0; i < node_count; i++)
        reach = fmin(reach, vec3_distance(x, t->tree.node[i].cylinder.center));
    for (int i = 0; i < node_count; i++) {
        const TrackNode *n = &t->tree.node[i];
        double distance = vec3_distance(x, n->cylinder.center), power = distance * distance - n->cylinder.radius * n->cylinder.radius;
        if (distance > 2 * reach + 4 * n->cylinder.radius)
            continue;
        double link = tracker_link_brightness(t, x, n->cylinder.center);
        if (link >= 0.5 && power < least) {
            least = power;
            best = i;
        }
        if (link > most) {
            most = link;
            brightest = i;
        }
    }
    return best >= 0 ? best : brightest;
}

// Appends a branch's nodes: those of the return path reversed, then those of the outgoing path.
bool tracker_adopt(Tracker *t, const Track *out, const Track *back, int number)
{
    int before = t->tree.count;
    for (int i = 0; i < back->count + out->count; i++) {
        bool is_back = i < back->count;
        const Track *from = is_back ? back : out;
        TrackNode node = from->node[is_back ? back->count - 1 - i : i - back->count];
        const Vec3 *point = from->point + node.point_start;
        if (is_back)
            node.cylinder.axis = vec3_negate(node.cylinder.axis);
        node.branch = number;
        node.parent = i > 0 ? t->tree.count - 1 : before > 0 ? tracker_attachment(t, node.cylinder.center, before) : -1;
        if (!track_append(&t->tree, &node, point))
            return false;
    }
    return true;
}

// What was estimated at the first start, for the report.
void tracker_say_start(Tracker *t, const RbtSeed *seed, const Cylinder *start, const char *root)
{
    char radius[48] = "", direction[80] = "";
    if (!(seed->radius > 0))
        snprintf(radius, sizeof radius, ", radius %.2f mm", start->radius);
    if (!seed->has_toward)
        snprintf(direction, sizeof direction, ", direction (%.2f, %.2f, %.2f)", start->axis.x, start->axis.y, start->axis.z);
    snprintf(t->start, sizeof t->start, "first start estimated: middle (%.2f, %.2f, %.2f) mm, %.2f mm from the click%s%s; %s", start->center.x, start->center.y,
             start->center.z, vec3_distance(start->center, seed->start), radius, direction, root);
}

// Number of nodes of `way` before it meets `other`, which starts at the same place: a loop of vessels closes there.
static int nodes_before_meeting(const Track *way, const Track *other, double share)
{
    double length = 0;
    for (int i = 1; i < way->count; i++) {
        length += vec3_distance(way->node[i].cylinder.center, way->node[i - 1].cylinder.center);
        for (int k = 0; length > 4 * way->node[0].cylinder.radius && k < other->count; k++)
            if (vec3_distance(way->node[i].cylinder.center, other->node[k].cylinder.center) < share * other->node[k].cylinder.radius)
                return i;
    }
    return way->count;
}

// The first branch from a start without direction: it may lie anywhere along the vessel.
bool tracker_both_ways(Tracker *t, const RbtSeed *seed, const Cylinder *start, int number)
{
    Track way[2] = {{0}, {0}}, back = {0};
    const char *end[2], *why = "the vessel was tracked one way only";
    for (int i = 0; i < 2 && !t->out_of_memory; i++) {
        Cylinder from = *start;
        from.axis = i ? vec3_negate(from.axis) : from.axis;
        tracker_run(t, &from, &way[i], false);
        end[i] = t->why;
    }
    if (way[0].count > 0 && way[1].count > 0)
        track_cut(&way[1], nodes_before_meeting(&way[1], &way[0], t->parameters->overlap));
    int out = way[0].count == 0 || (way[1].count > 0 && rbt_root_is_at_end_of(t, &way[0], &way[1], &why));
    bool found = way[out].count > 0 && !t->out_of_memory;
    // the first node of both is the same, in opposite directions
    for (int i = 1; found && i < way[1 - out].count && !t->out_of_memory; i++)
        t->out_of_memory = !track_append(&back, &way[1 - out].node[i], way[1 - out].point + way[1 - out].node[i].point_start);
    if (found && !t->out_of_memory)
        t->out_of_memory = !tracker_adopt(t, &way[out], &back, number);
    if (found) {
        char root[120];
        snprintf(root, sizeof root, "tracked both ways, the root is %s", why);
        tracker_say_start(t, seed, start, way[1 - out].count > 0 ? root : why);
        t->why = end[out];
    }
    for (int i = 0; i < 2; i++)
        track_free(&way[i]);
    track_free(&back);
    return found && !t->out_of_memory;
}
