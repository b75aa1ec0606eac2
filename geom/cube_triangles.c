// See cube_triangles.h. Segments run so that the inside lies to their right on a face seen from outside; triangles reverse that direction.
#include "geom/cube_triangles.h"

#include <stdbool.h>
#include <string.h>

enum { LOOP_MAX = 12 };

static int edge_between(int a, int b)
{
    int low = a & b, axis = (a ^ b) == 1 ? 0 : (a ^ b) == 2 ? 1 : 2;
    return axis * 4 + ((low >> (axis + 1) % 3 & 1) | (low >> (axis + 2) % 3 & 1) << 1);
}

// Corners of a face in counter-clockwise order seen from outside the cube.
static void face_corners(int face, int corner[4])
{
    int axis = face / 2, side = face & 1, u = 1 << (axis + 1) % 3, v = 1 << (axis + 2) % 3, base = side << axis;
    int order[4] = {base, base | u, base | u | v, base | v};
    for (int k = 0; k < 4; k++)
        corner[k] = order[side ? k : (4 - k) % 4];
}

// next[e]: the edge to which the segment that starts at edge e leads; -1 if no segment starts there.
static void face_segments(int mask, int next[12])
{
    for (int e = 0; e < 12; e++)
        next[e] = -1;
    for (int face = 0; face < 6; face++) {
        int c[4];
        face_corners(face, c);
        for (int k = 0; k < 4; k++) {
            bool here = mask >> c[k] & 1, before = mask >> c[(k + 3) % 4] & 1;
            if (!here || before)
                continue;
            // a run of inside corners starts at k and ends before the next outside corner
            int last = k;
            while (mask >> c[(last + 1) % 4] & 1)
                last = (last + 1) % 4;
            next[edge_between(c[last], c[(last + 1) % 4])] = edge_between(c[(k + 3) % 4], c[k]);
        }
    }
}

static bool share_a_face(int e, int f)
{
    int a = cube_edge_start(e), b = cube_edge_end(e), c = cube_edge_start(f), d = cube_edge_end(f);
    return ((a & b & c & d) | (~a & ~b & ~c & ~d & 7)) != 0;   // all four corners agree in a coordinate
}

static bool is_flat(const int *loop, int count, int i, int j)
{
    bool side = j - i == 1 || (i == 0 && j == count - 1);
    return !side && share_a_face(loop[i], loop[j]);
}

// Triangulates a loop with the fewest diagonals in a face (dynamic programming over ranges i … j).
static void cut_loop(const int *loop, int count, CubeCase *out, int *flat)
{
    int cost[LOOP_MAX][LOOP_MAX] = {{0}}, split[LOOP_MAX][LOOP_MAX] = {{0}};
    for (int span = 2; span < count; span++)
        for (int i = 0; i + span < count; i++) {
            int j = i + span, best = 1000;
            for (int k = i + 1; k < j; k++) {
                int c = cost[i][k] + cost[k][j] + is_flat(loop, count, i, k) + is_flat(loop, count, k, j);
                if (c < best) {
                    best = c;
                    split[i][j] = k;
                }
            }
            cost[i][j] = best;
        }
    *flat += cost[0][count - 1];
    int stack[LOOP_MAX * 2][2] = {{0, count - 1}}, depth = 1;
    while (depth > 0) {
        depth--;
        int i = stack[depth][0], j = stack[depth][1], k = split[i][j];
        if (j - i < 2)
            continue;
        int *triangle = out->edge[out->count++];
        triangle[0] = loop[i], triangle[1] = loop[j], triangle[2] = loop[k];
        stack[depth][0] = i, stack[depth++][1] = k;
        stack[depth][0] = k, stack[depth++][1] = j;
    }
}

void cube_table_fill(CubeTable *table)
{
    memset(table, 0, sizeof *table);
    for (int mask = 0; mask < 256; mask++) {
        int next[12];
        face_segments(mask, next);
        for (int e = 0; e < 12; e++) {
            int loop[LOOP_MAX], count = 0;
            for (int at = e; next[at] >= 0;) {
                int to = next[at];
                loop[count++] = at;
                next[at] = -1;
                at = to;
            }
            if (count >= 3)
                cut_loop(loop, count, &table->of[mask], &table->flat_diagonals);
        }
    }
}
