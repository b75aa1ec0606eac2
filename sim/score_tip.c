#include "sim/score_tip.h"

#include <stdlib.h>

// Finds the element behind the tip of a single tool.
static bool find_element(ScoreTip *tip, const WireOptions *options, double tip_length)
{
    char why[256];
    Wire wire;
    if (!wire_create(&wire, options, why, (int)sizeof why))
        return false;
    size_t count = (size_t)wire.element_count;
    double *scratch = calloc(BEAM_REST_ARRAYS * count, sizeof *scratch);
    if (scratch) {
        BeamRest r = {0};
        double **array[BEAM_REST_ARRAYS] = {&r.length, &r.extend, &r.axial,  &r.near,      &r.far,     &r.twist,
                                            &r.half_w, &r.half_y, &r.half_z, &r.curvature, &r.bending, &r.shear};
        for (size_t i = 0; i < BEAM_REST_ARRAYS; i++)
            *array[i] = scratch + i * count;
        wire_rest(&wire, options, &r);
        int i = wire.element_count - 1;
        while (i > 0 && wire.total_length - wire.s[i] <= tip_length)
            i--;
        if (wire.total_length - wire.s[i] > tip_length) {
            tip->element = i;
            tip->s = wire.s[i];
            tip->rest = (BeamInput){.length = r.length[i],
                                    .extend = r.extend[i],
                                    .axial = r.axial[i],
                                    .near = r.near[i],
                                    .far = r.far[i],
                                    .twist = r.twist[i],
                                    .half_w = r.half_w[i],
                                    .half_y = r.half_y[i],
                                    .half_z = r.half_z[i]};
        }
    }
    free(scratch);
    wire_destroy(&wire);
    return scratch != NULL;
}

bool score_tip_create(ScoreTip *tip, const Stepper *stepper, int tool, const WireOptions *options, double tip_length)
{
    *tip = (ScoreTip){.from = stepper_tool_length(stepper, tool) - tip_length, .is_single = stepper_tool_count(stepper) == 1, .element = -1};
    return !tip->is_single || find_element(tip, options, tip_length);
}

double score_tip_force(ScoreTip *tip, const Stepper *stepper, int tool)
{
    if (!tip->is_single)
        return vec3_norm(stepper_tool_wall_force(stepper, tool, tip->from));
    // an element partly in the sheath carries the sheath's reaction
    const WireState *state = stepper_state(stepper);
    int i = tip->element;
    if (i < 0 || tip->s < stepper_tool_length(stepper, tool) - state->inserted - 1e-9)
        return 0;
    BeamOutput out;
    tip->rest.x1 = state->position[i];
    tip->rest.x2 = state->position[i + 1];
    tip->rest.q1 = state->orientation[i];
    tip->rest.q2 = state->orientation[i + 1];
    beam_element(&tip->rest, &out);
    return vec3_norm(out.force2);
}
