#include "sim/score_sheath.h"

static const double MARGIN = 1;              // [mm] over what the clearance takes
enum { DIAMETERS = 5 };                      // of the lumen, in l
static const double UNBENT = 0.1;            // [mm] lost by a tool that slides

void score_sheath_start(ScoreSheath *sheath, const WireOptions *wire, int node_count, double lumen_radius, double inserted)
{
    double thickest = 0, straight = 0;
    for (int i = 0; i < wire->section_count; i++)
        thickest = fmax(thickest, wire->section[i].diameter);
    for (int i = 0; i < wire->section_count && wire->section[i].rest_curvature == 0; i++)
        straight += wire->section[i].length;
    *sheath = (ScoreSheath){.node_count = node_count,
                            .is_judged = wire->has_sheath && lumen_radius > 0 && isfinite(lumen_radius),
                            .mouth = wire->start,
                            .direction = vec3_unit(wire->direction),
                            .lumen_radius = lumen_radius,
                            .clearance = fmax(lumen_radius - thickest / 2, 0),
                            .reach = DIAMETERS * 2 * lumen_radius,
                            .straight = straight,
                            .last_inserted = inserted};
}

// The element that holds arc length `at`, and where in it (0 to 1).
static int element_at(const double *s, int count, double at, double *part)
{
    int low = 0, high = count - 2;
    while (low < high) {
        int middle = (low + high + 1) / 2;
        if (s[middle] <= at)
            low = middle;
        else
            high = middle - 1;
    }
    *part = fmin(fmax((at - s[low]) / (s[low + 1] - s[low]), 0), 1);
    return low;
}

double score_sheath_step(ScoreSheath *sheath, const WireState *state, const double *s, double dt)
{
    double fed = state->inserted - sheath->last_inserted, part;
    sheath->last_inserted = state->inserted;
    if (!sheath->is_judged || state->inserted <= 0)
        return fed;
    // a tip that is curved at rest moves across itself as it is dragged along a wall: it says nothing
    double hidden = s[sheath->node_count - 1] - state->inserted, at = fmin(hidden + sheath->reach, sheath->straight);
    if (at <= hidden)
        return fed;
    int i = element_at(s, sheath->node_count, at, &part);
    Vec3 along = vec3_unit(vec3_sub(state->position[i + 1], state->position[i])), speed = vec3_mix(state->velocity[i], state->velocity[i + 1], part);
    double moved = vec3_dot(speed, along) * dt, fades = fmin(fabs(fed) / (2 * sheath->reach), 1);
    sheath->lost = fmax(sheath->lost * (1 - fades) + fed - moved, 0);
    return fed;
}

// By how much the line through `point` turns, beginning in the sheath's direction.
static double turn_of(const ScoreSheath *sheath, const Vec3 *point, int count)
{
    double turn = 0;
    Vec3 before = sheath->direction;
    for (int i = 1; i < count; i++) {
        Vec3 along = vec3_sub(point[i], point[i - 1]);
        turn += vec3_angle(before, along);
        before = along;
    }
    return turn;
}

void score_sheath_look(ScoreSheath *sheath, const WireState *state, const double *s)
{
    if (!sheath->is_judged || sheath->turn_is_known || sheath->lost > UNBENT)
        return;
    double hidden = s[sheath->node_count - 1] - state->inserted, stride = 2 * sheath->lumen_radius;
    Vec3 point[DIAMETERS + 1] = {sheath->mouth};
    int count = 1;
    for (; count <= DIAMETERS && count * stride <= state->inserted; count++) {
        double part;
        int i = element_at(s, sheath->node_count, hidden + count * stride, &part);
        point[count] = vec3_mix(state->position[i], state->position[i + 1], part);
    }
    sheath->turn = turn_of(sheath, point, count);
}

void score_sheath_set_line(ScoreSheath *sheath, const Vec3 *line, int line_count)
{
    double stride = 2 * sheath->lumen_radius;
    Vec3 point[DIAMETERS + 1] = {sheath->mouth};
    int count = 1;
    sheath->turn_is_known = true;
    for (int i = 0; i < line_count && count <= DIAMETERS; i++)
        if (vec3_distance(line[i], point[count - 1]) >= stride)
            point[count++] = line[i];
    sheath->turn = turn_of(sheath, point, count);
}

void score_sheath_set_pieces(ScoreSheath *sheath, const TubePiece *piece, int count)
{
    double left = sheath->reach;
    sheath->turn_is_known = true;
    sheath->turn = 0;
    for (int i = 0; i < count && left > 0; i++) {
        double length = piece[i].angle > 0 ? piece[i].arc_radius * piece[i].angle : piece[i].length;
        if (piece[i].angle > 0)
            sheath->turn += fmin(length, left) / piece[i].arc_radius;
        left -= length;
    }
}

double score_sheath_limit(const ScoreSheath *sheath)
{
    double c = sheath->clearance;
    return sheath->is_judged ? 2 * c * sheath->turn + PI * PI * c * c / sheath->reach + MARGIN : 0;
}
