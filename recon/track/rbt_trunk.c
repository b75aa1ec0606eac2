#include "recon/track/rbt_trunk.h"

#include "recon/track/rbt_branch.h"
#include "recon/track/rbt_start.h"

#include <stdio.h>

// Returns the node to which a subtree that starts at x is attached: the node of least power distance whose straight link stays inside the lumen (at least
// half as bright as its ends); if no link does, the node with the brightest link among those nearby.
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

void tracker_report_start(Tracker *t, const RbtSeed *seed, const Cylinder *start, const char *root)
{
    char radius[48] = "", direction[80] = "";
    if (!(seed->radius > 0))
        snprintf(radius, sizeof radius, ", radius %.2f mm", start->radius);
    if (!seed->has_toward)
        snprintf(direction, sizeof direction, ", direction (%.2f, %.2f, %.2f)", start->axis.x, start->axis.y, start->axis.z);
    snprintf(t->start, sizeof t->start, "first start estimated: centre (%.2f, %.2f, %.2f) mm, %.2f mm from the click%s%s; %s", start->center.x, start->center.y,
             start->center.z, vec3_distance(start->center, seed->start), radius, direction, root);
}

// Number of nodes of `path` before it touches `other`, which starts at the same place: the vessels form a loop there.
static int nodes_before_meeting(const Track *path, const Track *other, double share)
{
    double length = 0;
    for (int i = 1; i < path->count; i++) {
        length += vec3_distance(path->node[i].cylinder.center, path->node[i - 1].cylinder.center);
        for (int k = 0; length > 4 * path->node[0].cylinder.radius && k < other->count; k++)
            if (vec3_distance(path->node[i].cylinder.center, other->node[k].cylinder.center) < share * other->node[k].cylinder.radius)
                return i;
    }
    return path->count;
}

// Tracks the first branch from a start without direction, which may lie anywhere along the vessel.
bool tracker_both_ways(Tracker *t, const RbtSeed *seed, const Cylinder *start, int number)
{
    Track side[2] = {{0}, {0}}, back = {0};
    const char *end[2], *why = "the vessel was tracked in one direction only";
    for (int i = 0; i < 2 && !t->out_of_memory; i++) {
        Cylinder from = *start;
        from.axis = i ? vec3_negate(from.axis) : from.axis;
        tracker_run(t, &from, &side[i], false);
        end[i] = t->why;
    }
    if (side[0].count > 0 && side[1].count > 0)
        track_cut(&side[1], nodes_before_meeting(&side[1], &side[0], t->parameters->overlap));
    int out = side[0].count == 0 || (side[1].count > 0 && rbt_root_is_at_end_of(t, &side[0], &side[1], &why));
    bool found = side[out].count > 0 && !t->out_of_memory;
    // both have the same first node, in opposite directions
    for (int i = 1; found && i < side[1 - out].count && !t->out_of_memory; i++)
        t->out_of_memory = !track_append(&back, &side[1 - out].node[i], side[1 - out].point + side[1 - out].node[i].point_start);
    if (found && !t->out_of_memory)
        t->out_of_memory = !tracker_adopt(t, &side[out], &back, number);
    if (found) {
        char root[120];
        snprintf(root, sizeof root, "tracked in both directions, the root is %s", why);
        tracker_report_start(t, seed, start, side[1 - out].count > 0 ? root : why);
        t->why = end[out];
    }
    for (int i = 0; i < 2; i++)
        track_free(&side[i]);
    track_free(&back);
    return found && !t->out_of_memory;
}
