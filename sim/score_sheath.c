#include "sim/score_sheath.h"

static const double MARGIN = 1;              // [mm] over what the clearance takes
static const double DIAMETERS = 5;           // of the lumen, in l

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
    double hidden = s[state->node_count - 1] - state->inserted, at = fmin(hidden + sheath->reach, sheath->straight);
    if (at <= hidden)
        return fed;
    int i = element_at(s, state->node_count, at, &part);
    Vec3 along = vec3_unit(vec3_sub(state->position[i + 1], state->position[i])), speed = vec3_mix(state->velocity[i], state->velocity[i + 1], part);
    double moved = vec3_dot(speed, along) * dt, fades = fmin(fabs(fed) / (2 * sheath->reach), 1);
    sheath->lost = fmax(sheath->lost * (1 - fades) + fed - moved, 0);
    return fed;
}

void score_sheath_look(ScoreSheath *sheath, const WireState *state, const double *s)
{
    if (!sheath->is_judged || sheath->lost > 0.25 * score_sheath_limit(sheath))
        return;
    double end = s[state->node_count - 1], turn = 0, stride = 2 * sheath->lumen_radius;
    Vec3 from = sheath->mouth, before = sheath->direction;
    for (int k = 1; k <= (int)DIAMETERS && k * stride <= state->inserted; k++) {
        double part;
        int i = element_at(s, state->node_count, end - state->inserted + k * stride, &part);
        Vec3 to = vec3_mix(state->position[i], state->position[i + 1], part), along = vec3_sub(to, from);
        turn += vec3_angle(before, along);
        before = along;
        from = to;
    }
    sheath->turn = turn;
}

double score_sheath_limit(const ScoreSheath *sheath)
{
    double c = sheath->clearance;
    return sheath->is_judged ? 2 * c * sheath->turn + PI * PI * c * c / sheath->reach + MARGIN : 0;
}
