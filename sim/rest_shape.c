// In a wire without applied twist, the material frame is transported along the rest curve without torsion, as is the frame of a path of lines and arcs. An arc
// of radius R, with its plane rotated by the sum of all plane angles up to it, is therefore a rest curvature 1 / R in that direction.
#include "sim/rest_shape.h"

#include "base/base.h"

#include <stdlib.h>

static const double sliver_mm = 0.01;

static double piece_length(const TubePiece *piece) { return piece->angle > 0 ? piece->arc_radius * piece->angle : piece->length; }

double rest_shape_length(const TubePiece *piece, int piece_count)
{
    double sum = 0;
    for (int i = 0; i < piece_count; i++)
        sum += piece_length(&piece[i]);
    return sum;
}

// Lists the ends of sections, each moved to a piece's border if that is very close, and the ends of pieces, in rising order.
static int lay_borders(const double *section_end, int section_count, const double *piece_end, int piece_count, double *moved_end, double *border)
{
    int count = 0;
    for (int i = 0; i < section_count; i++) {
        moved_end[i] = section_end[i];
        for (int k = 0; k <= piece_count && i + 1 < section_count; k++)
            if (fabs(section_end[i] - piece_end[k]) < sliver_mm)
                moved_end[i] = piece_end[k];
        border[count++] = moved_end[i];
    }
    double total = section_end[section_count - 1];
    for (int k = 0; k <= piece_count; k++)
        if (piece_end[k] > 0 && piece_end[k] < total)
            border[count++] = piece_end[k];
    sort_doubles(border, (size_t)count);
    return count;
}

WireSection *rest_shape_sections(const WireSection *section, int section_count, const TubePiece *piece, int piece_count, int *count)
{
    size_t most = (size_t)section_count + (size_t)piece_count + 1;
    double *memory = calloc(4 * most, sizeof *memory), *section_end = memory, *moved_end = memory + most, *piece_end = memory + 2 * most;
    double *border = calloc(2 * most, sizeof *border);
    WireSection *cut = calloc(2 * most, sizeof *cut);
    *count = 0;
    if (memory && border && cut) {
        double total = 0;
        for (int i = 0; i < section_count; i++)
            section_end[i] = total += section[i].length;
        // piece_end[0]: end of the straight proximal part; the last piece ends with the wire, bit for bit
        piece_end[piece_count] = total;
        for (int k = piece_count; k > 0; k--)
            piece_end[k - 1] = piece_end[k] - piece_length(&piece[k - 1]);
        if (piece_end[0] < sliver_mm)
            piece_end[0] = 0;
        int borders = lay_borders(section_end, section_count, piece_end, piece_count, moved_end, border), s = 0, p = 0;
        double at = 0, plane = 0;
        for (int i = 0; i < borders; i++) {
            if (border[i] <= at)
                continue;
            double middle = (at + border[i]) / 2;
            while (s + 1 < section_count && moved_end[s] < middle)
                s++;
            while (p < piece_count && piece_end[p] < middle)
                plane += piece[p++].plane;
            WireSection *to = &cut[(*count)++];
            *to = section[s];
            to->length = border[i] - at;
            to->rest_curvature = p > 0 && piece[p - 1].angle > 0 ? 1 / piece[p - 1].arc_radius : 0;
            to->rest_plane = plane;
            at = border[i];
        }
    }
    free(memory);
    free(border);
    if (*count == 0) {
        free(cut);
        cut = NULL;
    }
    return cut;
}
