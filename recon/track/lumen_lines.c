// A spatial hash of cubic cells. A line is listed in every cell that its capsule's bounding box touches. A cell is as wide as the average capsule.
#include "recon/track/lumen_lines.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

struct LumenLines {
    double cell;             // [mm]
    uint64_t mask;           // slots - 1, a power of two
    int *start;              // (slots + 1) slot s holds entries [start[s], start[s + 1])
    int *entry;              // line numbers
    LumenLine *line;
};

static uint64_t slot_of(const LumenLines *lines, int64_t x, int64_t y, int64_t z)
{
    uint64_t h = (uint64_t)x * 0x9e3779b97f4a7c15u ^ (uint64_t)y * 0xc2b2ae3d27d4eb4fu ^ (uint64_t)z * 0x165667b19e3779f9u;
    return (h ^ h >> 29) & lines->mask;
}

static int64_t place(double x, double cell) { return (int64_t)floor(x / cell); }

typedef struct Range {
    int64_t low[3], high[3];
} Range;

static Range range_of(const LumenLine *line, double cell)
{
    const double a[3] = {line->from.x, line->from.y, line->from.z}, b[3] = {line->to.x, line->to.y, line->to.z};
    Range range;
    for (int i = 0; i < 3; i++) {
        range.low[i] = place(fmin(a[i], b[i]) - line->clear, cell);
        range.high[i] = place(fmax(a[i], b[i]) + line->clear, cell);
    }
    return range;
}

// Counts the entries of each slot or, with `fill`, stores them; start[s] is then the next free position of slot s.
static void each_cell(LumenLines *lines, int count, bool fill)
{
    for (int i = 0; i < count; i++) {
        Range r = range_of(&lines->line[i], lines->cell);
        for (int64_t z = r.low[2]; z <= r.high[2]; z++)
            for (int64_t y = r.low[1]; y <= r.high[1]; y++)
                for (int64_t x = r.low[0]; x <= r.high[0]; x++) {
                    uint64_t s = slot_of(lines, x, y, z);
                    if (fill)
                        lines->entry[lines->start[s]++] = i;
                    else
                        lines->start[s + 1]++;
                }
    }
}

// The mean width of the capsules, which is close enough to the median; limited so that no line fills more than a few thousand cells.
static double cell_size(const LumenLine *line, int count)
{
    double sum = 0, longest = 0;
    for (int i = 0; i < count; i++) {
        double size = 2 * line[i].clear + vec3_distance(line[i].from, line[i].to);
        sum += size / count;
        longest = fmax(longest, size);
    }
    return fmax(fmax(sum, longest / 16), 1e-6);
}

LumenLines *lumen_lines_create(const LumenLine *line, int count)
{
    LumenLines *lines = calloc(1, sizeof *lines);
    size_t slots = 64;
    while (slots < 4 * (size_t)count)
        slots *= 2;
    if (!lines)
        return NULL;
    lines->cell = cell_size(line, count);
    lines->mask = slots - 1;
    lines->start = calloc(slots + 1, sizeof *lines->start);
    lines->line = malloc(((size_t)count + 1) * sizeof *lines->line);
    if (lines->start && lines->line) {
        if (count > 0)
            memcpy(lines->line, line, (size_t)count * sizeof *line);
        each_cell(lines, count, false);
        for (size_t s = 0; s < slots; s++)
            lines->start[s + 1] += lines->start[s];
        lines->entry = malloc(((size_t)lines->start[slots] + 1) * sizeof *lines->entry);
    }
    if (!lines->entry) {
        lumen_lines_free(lines);
        return NULL;
    }
    each_cell(lines, count, true);
    for (size_t s = slots; s > 0; s--)   // filling advanced each start to the slot's end
        lines->start[s] = lines->start[s - 1];
    lines->start[0] = 0;
    return lines;
}

void lumen_lines_free(LumenLines *lines)
{
    if (!lines)
        return;
    free(lines->start);
    free(lines->entry);
    free(lines->line);
    free(lines);
}

static double line_distance2(const LumenLine *line, Vec3 x)
{
    Vec3 along = vec3_sub(line->to, line->from), d = vec3_sub(x, line->from);
    double l2 = vec3_norm2(along), s = l2 > 0 ? fmax(0, fmin(1, vec3_dot(d, along) / l2)) : 0;
    return vec3_norm2(vec3_add_scaled(d, -s, along));
}

bool lumen_lines_hold(const LumenLines *lines, Vec3 x)
{
    uint64_t s = slot_of(lines, place(x.x, lines->cell), place(x.y, lines->cell), place(x.z, lines->cell));
    for (int k = lines->start[s]; k < lines->start[s + 1]; k++) {
        const LumenLine *line = &lines->line[lines->entry[k]];
        if (line_distance2(line, x) < line->clear * line->clear)
            return true;
    }
    return false;
}
