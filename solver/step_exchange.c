// Exchange at the hub: a tool that has been drawn back to its tip is removed, and another takes its place around the tools inside it, which stay where they
// are. Everything that a step needs of the spare tools is created at the start, so that an exchange allocates nothing.
#include "solver/tools_internal.h"

#include "base/base.h"

#include <string.h>

static const double AT_HUB = 1;          // [mm] distance of a tip from the hub at which the tool can be removed …
static const double LEAST_AHEAD = 0.01;  // … and at which the new tip is inserted

const char *step_exchange_refusal(StepExchange outcome)
{
    switch (outcome) {
    case EXCHANGE_INSERTED: return "the tool is still in: draw an inner one back to its hub first, the outermost one to the sheath's mouth";
    case EXCHANGE_TOO_SHORT: return "a tool is too short: an inner one must be as long outside the patient as the tool that goes over it";
    case EXCHANGE_NO_SUCH_TOOL: return "the scene has no such tool under its 'exchange:'";
    case EXCHANGE_DONE: break;
    }
    return "";
}

int stepper_fitted(const Stepper *s, int k) { return s->tools.fitted[k]; }

static void fit(Stepper *s, int k, int which)
{
    SEL_REQUIRE(k >= 0 && k < s->tools.count && which >= 0 && which <= s->tools.spare_count[k], "the tool and its spare exist");
    Tool *t = &s->tools.tool[k];
    Tool was = *t;
    *t = *s->tools.device[k][which];
    t->first = k == 0 ? 0 : t->wire.node_count;      // carries no node of the chain yet
    t->start = was.start;
    t->inside = was.inside;
    t->inserted = was.inserted;
    t->twist = was.twist;
    s->tools.fitted[k] = which;
    s->rest.time = 0;
    s->hands.hand[k].limit = t->hand_limit;
    s->hands.hand[k].valve = t->valve_friction;
    for (int m = 1; m < s->tools.count; m++) {
        s->tools.tool[m].friction = s->tools.tool[m - 1].friction_inside;
        s->tools.tool[m].clearance = tools_clearance(&s->tools.tool[m - 1], &s->tools.tool[m]);
    }
}

void tools_refit(Stepper *s, const int *fitted)
{
    for (int k = 0; s->tools.count > 1 && k < s->tools.count; k++)
        if (s->tools.fitted[k] != fitted[k])
            fit(s, k, fitted[k]);
}

// [mm] The length of tool m behind the hub of the outermost tool.
static double behind_hub(const Stepper *s, int m) { return is_inside(s, 0, m) ? slide_at(s, 0, m) : HUGE_VAL; }

StepExchange stepper_exchange(Stepper *s, int k, int which)
{
    if (k < 0 || k >= s->tools.count || s->tools.count == 1 || which < 0 || which > s->tools.spare_count[k])
        return EXCHANGE_NO_SUCH_TOOL;
    if (which == s->tools.fitted[k])
        return EXCHANGE_DONE;
    const Tool *t = &s->tools.tool[k], *next = s->tools.device[k][which];
    bool is_out = k == 0 ? s->entry.has_sheath && s->first_free >= t->wire.node_count
                         : is_inside(s, 0, k) && t->inside == 1 && slide_at(s, 0, k) > t->wire.total_length - AT_HUB;
    if (!is_out)
        return EXCHANGE_INSERTED;
    // the proximal ends of the tools inside must stay behind the new hub
    double tip = k == 0 ? t->wire.total_length : 0;
    for (int m = k + 1; m < s->tools.count; m++)
        if (behind_hub(s, m) + tip < next->wire.total_length)
            return EXCHANGE_TOO_SHORT;
    for (int m = k - 1; m > 0; m--)      // nor may it be shorter than what a surrounding tool has behind the outermost hub
        if (next->wire.total_length < behind_hub(s, m))
            return EXCHANGE_TOO_SHORT;
    if (k == 0) {
        tools_exchange_outermost(s, next);
        fit(s, 0, which);
        tools_chain(s);
        for (int c = 0; c < s->tools.tool[0].wire.node_count; c++)
            stepper_forget(s, c);
        for (int m = 1; m < s->tools.count; m++) {        // the hands hold the tools at the new hub
            if (!is_inside(s, 0, m))
                continue;
            s->tools.tool[m].inserted = s->tools.tool[m].wire.total_length + stepper_sheath_coordinate(s, 0) - slide_at(s, 0, m);
            s->tools.tool[m].twist = s->state.twist + angle_at(s, 0, m);
        }
    } else {
        int i = k - 1;
        double ahead = fmax(LEAST_AHEAD, t->wire.total_length - s->state.slide[i]);
        fit(s, k, which);
        s->state.slide[i] = t->wire.total_length - ahead;        // the new tip is where the old tip was
        s->state.angle[i] = s->state.slide_velocity[i] = s->state.slide_spin[i] = 0;
        memset(s->state.slide_force + 3 * i, 0, 3 * sizeof(double));
        s->tools.tool[k].inserted = (s->entry.has_sheath ? stepper_sheath_coordinate(s, 0) : 0) + ahead;
        s->tools.tool[k].twist = s->state.twist;
    }
    return EXCHANGE_DONE;
}
