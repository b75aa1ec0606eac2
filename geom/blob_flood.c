// Cell i meets the ball (c, R) only if, for each near node k, the ball reaches the half space in which node i has the lesser power distance. Testing each half
// space separately accepts slightly more cells than the ball meets; extra cells do no harm to the agreement between near cells.
#include "geom/blob_flood.h"

#include "base/base.h"

#include "geom/power_walk.h"

#include <stdlib.h>

bool blob_flood_create(BlobFlood *flood, int node_count)
{
    SEL_ASSERT(node_count > 0, "a tree has a root");
    *flood = (BlobFlood){.node_count = node_count};
    flood->mark = calloc((size_t)node_count, sizeof *flood->mark);
    flood->node = calloc((size_t)node_count, sizeof *flood->node);
    if (flood->mark && flood->node)
        return true;
    blob_flood_free(flood);
    return false;
}

void blob_flood_free(BlobFlood *flood)
{
    free(flood->mark);
    free(flood->node);
    *flood = (BlobFlood){0};
}

static bool meets_cell(const VesselTree *tree, int node, Vec3 c, double reach)
{
    SEL_ASSERT(node >= 0 && node < tree->node_count, "a cell belongs to a node of the tree");
    double own = power_distance(c, tree->center[node], tree->radius[node]), far = 2 * (reach + BLOB_FLOOD_MARGIN * tree->radius[node]);
    for (int k = tree->near_offset[node]; k < tree->near_offset[node + 1]; k++) {
        int other = tree->near[k];
        double beyond = own - power_distance(c, tree->center[other], tree->radius[other]);
        if (beyond > 0 && beyond * beyond > far * far * vec3_norm2(vec3_sub(tree->center[other], tree->center[node])))
            return false;
    }
    return true;
}

int blob_flood_nodes(BlobFlood *flood, const VesselTree *tree, int owner, Vec3 center, double reach)
{
    int count = 1, stamp = ++flood->stamp;
    SEL_REQUIRE(flood->node_count == tree->node_count, "the flood has capacity for each node once");
    SEL_ASSERT(owner >= 0 && owner < tree->node_count, "a blob belongs to a node of the tree");
    SEL_ASSERT(reach > 0, "a blob has a radius of support");
    flood->node[0] = owner;
    flood->mark[owner] = stamp;
    for (int i = 0; i < count; i++) {
        int at = flood->node[i];
        for (int k = tree->near_offset[at]; k < tree->near_offset[at + 1]; k++) {
            int next = tree->near[k];
            if (flood->mark[next] == stamp)
                continue;
            flood->mark[next] = stamp;
            if (meets_cell(tree, next, center, reach))
                flood->node[count++] = next;
        }
    }
    SEL_ASSERT(count <= tree->node_count, "a node sees a blob once");
    return count;
}

// All pairs of a blob and a node that sees it, ordered by blob.
typedef struct Sightings {
    int64_t count, capacity;
    int32_t *node;
    int64_t *offset;         // (B+1)
} Sightings;

// A fitted tree has about ten per blob. Without a limit, a corrupt file with blobs as large as the tree would take hours and all memory.
static const int64_t SIGHTINGS_MAX = (int64_t)1 << 28;

static bool add_sightings(Sightings *s, const int *node, int count)
{
    if (s->count > SIGHTINGS_MAX)
        return false;
    if (s->count + count > s->capacity) {
        int64_t capacity = 2 * s->capacity + count + 1024;
        int32_t *more = realloc(s->node, (size_t)capacity * sizeof *more);
        if (!more)
            return false;
        s->node = more;
        s->capacity = capacity;
    }
    for (int k = 0; k < count; k++)
        s->node[s->count++] = node[k];
    return true;
}

static bool flood_all(const VesselTree *tree, Sightings *s)
{
    BlobFlood flood;
    bool good = blob_flood_create(&flood, tree->node_count);
    for (int i = 0; i < tree->node_count && good; i++)
        for (int64_t b = tree->blob_offset[i]; b < tree->blob_offset[i + 1] && good; b++) {
            int count = blob_flood_nodes(&flood, tree, i, tree->blob_center[b], tree->blob_width[b]);
            good = add_sightings(s, flood.node, count);
            s->offset[b + 1] = s->count;
        }
    blob_flood_free(&flood);
    return good;
}

bool blob_flood_list(VesselTree *tree)
{
    SEL_ASSERT(tree->near_offset && tree->near, "near nodes are known before blobs are listed");
    SEL_ASSERT(tree->blob_count <= INT32_MAX, "lists index blobs by 32 bits");
    Sightings s = {.offset = calloc((size_t)tree->blob_count + 1, sizeof *s.offset)};
    int64_t *offset = calloc((size_t)tree->node_count + 1, sizeof *offset);
    int32_t *seen = NULL;
    bool good = s.offset && offset && flood_all(tree, &s) && (seen = calloc((size_t)s.count + 1, sizeof *seen));
    if (good) {
        // counting sort by node: offset[i + 1] is node i's count, then the position of its next entry, finally its end
        for (int64_t k = 0; k < s.count; k++)
            offset[s.node[k] + 1]++;
        int64_t sum = 0;
        for (int i = 0; i < tree->node_count; i++) {
            int64_t own = offset[i + 1];
            offset[i + 1] = sum;
            sum += own;
        }
        SEL_REQUIRE(sum == s.count, "each pair's node is one of the tree");
        for (int64_t b = 0; b < tree->blob_count; b++)
            for (int64_t k = s.offset[b]; k < s.offset[b + 1]; k++)
                seen[offset[s.node[k] + 1]++] = (int32_t)b;
    }
    free(s.node);
    free(s.offset);
    free(tree->seen_offset);
    free(tree->seen);
    tree->seen_offset = offset;
    tree->seen = seen;
    return good;
}
