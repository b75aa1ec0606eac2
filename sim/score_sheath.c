#include "sim/score_sheath.h"

static const double MARGIN = 1;              // [mm] in addition to what the clearance takes
enum { DIAMETERS = 5 };                      // l, in lumen diameters
static const double UNBENT = 0.1;            // [mm] lost at most by a tool that slides

void score_sheath_start(ScoreSheath *sheath, const WireOptions *wire, double lumen_radius, double inserted)
{
    double thickest = 0, straight = 0;
    for (int i = 0; i < wire->section_count; i++)
        thickest = fmax(thickest, wire->section[i].diameter);
    for (int i = 0; i < wire->section_count && wire->section[i].rest_curvature == 0; i++)
        straight += wire->section[i].length;
    *sheath = (ScoreSheath){.is_judged = wire->has_sheath && lumen_radius > 0 && isfinite(lumen_radius),
                            .mouth = wire->start,
                            .direction = vec3_unit(wire->direction),
                            .lumen_radius = lumen_radius,
                            .clearance = fmax(lumen_radius - thickest / 2, 0),
                            .reach = DIAMETERS * 2 * lumen_radius,
                            .straight = straight,
                            .last_inserted = inserted};
}

void score_sheath_refit(ScoreSheath *sheath, const WireOptions *wire, double inserted)
{
    const ScoreSheath before = *sheath;
    score_sheath_start(sheath, wire, before.lumen_radius, inserted);
    sheath->turn = before.turn;
    sheath->turn_is_known = before.turn_is_known;
}

double score_sheath_step(ScoreSheath *sheath, const Stepper *stepper, int tool, double dt)
{
    double inserted = stepper_tool_inserted(stepper, tool), fed = inserted - sheath->last_inserted;
    sheath->last_inserted = inserted;
    if (!sheath->is_judged || inserted <= 0)
        return fed;
    // a tip that is curved at rest moves sideways as it is dragged along a wall, so it cannot be used
    double hidden = stepper_tool_length(stepper, tool) - inserted, at = fmin(hidden + sheath->reach, sheath->straight);
    if (at <= hidden)
        return fed;
    ToolPlace place = stepper_tool_place(stepper, tool, at);
    double moved = vec3_dot(place.velocity, place.along) * dt, fades = fmin(fabs(fed) / (2 * sheath->reach), 1);
    sheath->lost = fmax(sheath->lost * (1 - fades) + fed - moved, 0);
    return fed;
}

// Total turn of the line through `point`, starting from the sheath's direction.
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

void score_sheath_look(ScoreSheath *sheath, const Stepper *stepper, int tool)
{
    if (!sheath->is_judged || sheath->turn_is_known || sheath->lost > UNBENT)
        return;
    double inserted = stepper_tool_inserted(stepper, tool), hidden = stepper_tool_length(stepper, tool) - inserted, stride = 2 * sheath->lumen_radius;
    Vec3 point[DIAMETERS + 1] = {sheath->mouth};
    int count = 1;
    for (; count <= DIAMETERS && count * stride <= inserted; count++)
        point[count] = stepper_tool_place(stepper, tool, hidden + count * stride).position;
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
