#include "geom/power_blocks.h"
#include "base/base.h"
#include "geom/power_walk.h"

#include <stdlib.h>

// Comparisons instead of fmin and fmax, which are calls; a box's numbers are finite.
static double lower(double a, double b) { return a < b ? a : b; }
static double higher(double a, double b) { return a > b ? a : b; }
static Vec3 least(Vec3 a, Vec3 b) { return vec3(lower(a.x, b.x), lower(a.y, b.y), lower(a.z, b.z)); }
static Vec3 most(Vec3 a, Vec3 b) { return vec3(higher(a.x, b.x), higher(a.y, b.y), higher(a.z, b.z)); }

static PowerBox box_of(const PowerBlocks *blocks, int level, int i)
{
    SEL_ASSERT(level < blocks->levels && i >= 0 && i < (level >= 0 ? blocks->count[level] : blocks->tree->node_count), "the box is one of its level");
    if (level >= 0)
        return blocks->box[level][i];
    const VesselTree *tree = blocks->tree;
    return (PowerBox){tree->center[i], tree->center[i], tree->radius[i]};
}

bool power_blocks_create(PowerBlocks *blocks, const VesselTree *tree)
{
    *blocks = (PowerBlocks){.tree = tree};
    size_t all = 0;
    SEL_ASSERT(tree->node_count > 0, "a tree has a root");
    for (int n = tree->node_count; n > 1 && blocks->levels < POWER_LEVELS; blocks->levels++) {
        n = (n - 1) / POWER_BLOCK + 1;
        blocks->count[blocks->levels] = n;
        all += (size_t)n;
    }
    SEL_ASSERT(blocks->levels == 0 || blocks->count[blocks->levels - 1] == 1, "one box holds all nodes");
    PowerBox *box = calloc(all + 1, sizeof *box);
    blocks->box[0] = box;
    if (!box)
        return false;
    for (int level = 0, below = tree->node_count; level < blocks->levels; below = blocks->count[level++]) {
        blocks->box[level] = box;
        for (int i = 0; i < blocks->count[level]; i++) {
            PowerBox b = box_of(blocks, level - 1, POWER_BLOCK * i);
            for (int k = POWER_BLOCK * i + 1; k < POWER_BLOCK * (i + 1) && k < below; k++) {
                PowerBox other = box_of(blocks, level - 1, k);
                b = (PowerBox){least(b.low, other.low), most(b.high, other.high), fmax(b.radius, other.radius)};
            }
            *box++ = b;
        }
    }
    SEL_REQUIRE(blocks->levels == 0 || (size_t)(box - blocks->box[0]) == all, "the boxes of all levels fill one allocation");
    return true;
}

void power_blocks_free(PowerBlocks *blocks)
{
    free(blocks->box[0]);
    *blocks = (PowerBlocks){0};
}

// Lower bound of the power distance to any node of the box, rounding included.
static double bound(const PowerBox *b, Vec3 x)
{
    Vec3 out = most(most(vec3_sub(b->low, x), vec3_sub(x, b->high)), vec3(0, 0, 0));
    double far2 = vec3_norm2(out), r2 = b->radius * b->radius;
    return far2 - r2 - 1e-14 * (far2 + r2);
}

typedef struct Best {
    double distance;
    int node;
} Best;

// Searches a box, its children in the order of the tree; of equal nodes the first is taken.
static void look(const PowerBlocks *blocks, int level, int i, Vec3 x, Best *best)
{
    const VesselTree *tree = blocks->tree;
    int below = level > 0 ? blocks->count[level - 1] : tree->node_count;
    for (int k = POWER_BLOCK * i; k < POWER_BLOCK * (i + 1) && k < below; k++) {
        if (level > 0) {
            if (bound(&blocks->box[level - 1][k], x) <= best->distance)
                look(blocks, level - 1, k, x, best);
            continue;
        }
        double d = power_distance(x, tree->center[k], tree->radius[k]);
        if (d < best->distance || (d == best->distance && k < best->node))
            *best = (Best){d, k};
    }
}

int power_blocks_nearest_from(const PowerBlocks *blocks, Vec3 x, int near)
{
    const VesselTree *tree = blocks->tree;
    SEL_ASSERT(near >= 0 && near < tree->node_count, "the search begins at a node");
    Best best = {power_distance(x, tree->center[0], tree->radius[0]), 0};
    if (blocks->levels > 0) {
        look(blocks, 0, near / POWER_BLOCK, x, &best);
        look(blocks, blocks->levels - 1, 0, x, &best);
    }
    SEL_ASSERT(best.node >= 0 && best.node < tree->node_count, "the nearest node is one of the tree");
    return best.node;
}

int power_blocks_nearest(const PowerBlocks *blocks, Vec3 x)
{
    int at = 0;
    for (int level = blocks->levels - 2; level >= 0; level--) {   // first find a good candidate: descend through the most promising boxes
        double least_bound = HUGE_VAL;
        int first = POWER_BLOCK * at;
        for (int k = first; k < first + POWER_BLOCK && k < blocks->count[level]; k++) {
            double b = bound(&blocks->box[level][k], x);
            at = b < least_bound ? k : k == first ? first : at;
            least_bound = lower(b, least_bound);
        }
    }
    return power_blocks_nearest_from(blocks, x, POWER_BLOCK * at);
}
