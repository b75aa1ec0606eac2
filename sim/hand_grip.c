#include "sim/hand_grip.h"

#include "input/input.h"

// The partner of the chosen tool is the next tool inside it; for the innermost tool, the next one around it; for a single tool, itself. The two are the pair.
static int hand_grip_partner(const HandGrip *grip, int tool_count)
{
    return grip->chosen + 1 < tool_count ? grip->chosen + 1 : grip->chosen > 0 ? grip->chosen - 1 : 0;
}

int hand_grip_tool(const HandGrip *grip, int tool_count, int drives)
{
    int chosen = grip->chosen, partner = hand_grip_partner(grip, tool_count);
    switch (drives) {
    case DRIVES_CHOSEN: return chosen;
    case DRIVES_PARTNER: return partner;
    case DRIVES_OUTER: return chosen < partner ? chosen : partner;
    case DRIVES_INNER: return chosen > partner ? chosen : partner;
    default: return drives - DRIVES_TOOL < tool_count ? drives - DRIVES_TOOL : tool_count - 1;
    }
}

void hand_grip_choose(HandGrip *grip, int tool_count, int tool)
{
    if (tool >= 0 && tool < tool_count)
        grip->chosen = tool;
}

static int inner_of_pair(const HandGrip *grip, int tool_count)
{
    int partner = hand_grip_partner(grip, tool_count);
    return partner > grip->chosen ? partner : grip->chosen;
}

void hand_grip_lock(HandGrip *grip, int tool_count)
{
    int inner = inner_of_pair(grip, tool_count);
    if (inner == 0)
        return;
    grip->locked ^= 1u << inner;
    if (grip->locked >> inner & 1)
        grip->released &= ~(3u << (inner - 1));
}

bool hand_grip_pair_is_locked(const HandGrip *grip, int tool_count) { return grip->locked >> inner_of_pair(grip, tool_count) & 1; }

void hand_grip_release(HandGrip *grip)
{
    grip->released ^= 1u << grip->chosen;
    if (grip->released >> grip->chosen & 1)
        grip->locked &= ~(3u << grip->chosen);   // the lock with the tool around it and the one with the tool inside
}

void hand_grip_fit(HandGrip *grip, int tool_count, int tool, int which)
{
    if (tool < 0 || tool >= tool_count || which < 0 || which > EXCHANGES_MOST || which == grip->fitted[tool])
        return;
    grip->fitted[tool] = which;
    grip->released &= ~(1u << tool);
    grip->locked &= ~(3u << tool);
}

void hand_grip_obey(HandGrip *grip, int tool_count, unsigned buttons, unsigned *before)
{
    unsigned pressed = buttons & ~*before;
    *before = buttons;
    if (pressed & HAND_CHOOSE_OUTER)
        hand_grip_choose(grip, tool_count, grip->chosen - 1);
    if (pressed & HAND_CHOOSE_INNER)
        hand_grip_choose(grip, tool_count, grip->chosen + 1);
    if (pressed & HAND_LOCK)
        hand_grip_lock(grip, tool_count);
    if (pressed & HAND_RELEASE)
        hand_grip_release(grip);
}

int hand_grip_lead(const HandGrip *grip, int tool)
{
    while (tool > 0 && grip->locked >> tool & 1)
        tool--;
    return tool;
}

double hand_grip_sum(const HandGrip *grip, int tool_count, int tool, const double *value)
{
    double sum = 0;
    for (int k = 0; k < tool_count; k++)
        if (hand_grip_lead(grip, k) == hand_grip_lead(grip, tool))
            sum += value[k];
    return sum;
}
