#include "sim/hand_set.h"

#include <math.h>
#include <string.h>

void hand_set_init(HandSet *set, int tool_count)
{
    memset(set, 0, sizeof *set);
    set->tool_count = tool_count;
    set->fastest_mm_s = 200;
    set->fastest_deg_s = 1440;
}

static int tool_of(const HandSet *set, const HandPort *port)
{
    return hand_grip_tool(&set->grip, set->tool_count, atomic_load_explicit(&port->drives, memory_order_relaxed));
}

bool hand_set_add(HandSet *set, HandPort *port)
{
    if (set->count == HANDS_SAMPLED)
        return false;
    set->taken_mm[set->count] = atomic_load(&port->advanced_mm);
    set->taken_deg[set->count] = atomic_load(&port->turned_deg);
    set->port[set->count++] = port;
    return true;
}

static double limited(double value, double most) { return isfinite(value) ? fmax(-most, fmin(most, value)) : 0; }

// The part of `total` - `taken` that may be fed in this step in addition to `moved`; advances `taken`.
static double take_displacement(double total, double *taken, double moved, double most)
{
    double pending = total - *taken;
    if (!isfinite(pending)) {
        *taken = isfinite(total) ? total : *taken;
        return moved;
    }
    double sum = limited(moved + pending, most);
    *taken += sum - moved;
    return sum;
}

// Discards the outstanding displacement of a port.
static void forget_displacement(HandSet *set, int i)
{
    set->taken_mm[i] = atomic_load_explicit(&set->port[i]->advanced_mm, memory_order_relaxed);
    set->taken_deg[i] = atomic_load_explicit(&set->port[i]->turned_deg, memory_order_relaxed);
}

void hand_set_grip(HandSet *set, const HandGrip *grip)
{
    int held[HANDS_SAMPLED];
    for (int i = 0; i < set->count; i++)
        held[i] = tool_of(set, set->port[i]);
    set->grip = *grip;
    for (int i = 0; i < set->count; i++)
        if (tool_of(set, set->port[i]) != held[i])
            forget_displacement(set, i);
}

void hand_set_let_go(HandSet *set, bool is_let_go) { set->is_let_go = is_let_go; }

ToolCommands hand_set_command(HandSet *set, double dt)
{
    double seconds = dt / 1000, most_mm = set->fastest_mm_s * seconds, most_deg = set->fastest_deg_s * seconds;
    double moved_mm[TOOLS_MOST] = {0}, turned_deg[TOOLS_MOST] = {0};     // of the outermost of the tools locked together
    const HandGrip *grip = &set->grip;
    bool is_stopped = set->is_let_go || (hand_set_buttons(set) & HAND_STOP);
    for (int i = 0; i < set->count; i++) {
        const HandPort *port = set->port[i];
        double mm_s = atomic_load_explicit(&port->push_mm_s, memory_order_relaxed), deg_s = atomic_load_explicit(&port->twist_deg_s, memory_order_relaxed);
        if (mm_s == 0 && deg_s == 0)         // most ports have no device
            continue;
        int lead = hand_grip_lead(grip, tool_of(set, port));
        moved_mm[lead] = limited(moved_mm[lead] + limited(mm_s, set->fastest_mm_s) * seconds, most_mm);
        turned_deg[lead] = limited(turned_deg[lead] + limited(deg_s, set->fastest_deg_s) * seconds, most_deg);
    }
    for (int i = 0; i < set->count; i++) {
        double mm = atomic_load_explicit(&set->port[i]->advanced_mm, memory_order_relaxed);
        double deg = atomic_load_explicit(&set->port[i]->turned_deg, memory_order_relaxed);
        if (mm == set->taken_mm[i] && deg == set->taken_deg[i])
            continue;
        int tool = tool_of(set, set->port[i]), lead = hand_grip_lead(grip, tool);
        if (is_stopped || (grip->released >> tool & 1)) {
            set->taken_mm[i] = mm;
            set->taken_deg[i] = deg;
        }
        moved_mm[lead] = take_displacement(mm, &set->taken_mm[i], moved_mm[lead], most_mm);
        turned_deg[lead] = take_displacement(deg, &set->taken_deg[i], turned_deg[lead], most_deg);
    }
    ToolCommands commands = {.released = grip->released & ((1u << set->tool_count) - 1)};
    memcpy(commands.fitted, grip->fitted, (size_t)set->tool_count * sizeof *commands.fitted);
    for (int k = 0; k < set->tool_count && !is_stopped; k++) {
        int lead = hand_grip_lead(grip, k);
        if (!(commands.released >> k & 1))
            commands.tool[k] = (Command){moved_mm[lead] / seconds, turned_deg[lead] / seconds};
    }
    return commands;
}

unsigned hand_set_buttons(const HandSet *set)
{
    unsigned buttons = 0;
    for (int i = 0; i < set->count; i++)
        buttons |= atomic_load_explicit(&set->port[i]->buttons, memory_order_relaxed);
    return buttons;
}

bool hand_set_has_device(const HandSet *set)
{
    bool has_device = false;
    for (int i = 0; i < set->count; i++)
        has_device |= atomic_load_explicit(&set->port[i]->state, memory_order_relaxed) != HAND_ABSENT;
    return has_device;
}

void hand_set_answer(HandSet *set, const StepReport *report, int64_t step)
{
    double force[TOOLS_MOST], torque[TOOLS_MOST];
    for (int k = 0; k < set->tool_count; k++) {
        force[k] = hand_grip_sum(&set->grip, set->tool_count, k, report->push);
        torque[k] = hand_grip_sum(&set->grip, set->tool_count, k, report->torque);
    }
    for (int i = 0; i < set->count; i++) {
        HandPort *port = set->port[i];
        int tool = tool_of(set, port);
        atomic_store_explicit(&port->force_n, force[tool], memory_order_relaxed);
        atomic_store_explicit(&port->torque_n_mm, torque[tool], memory_order_relaxed);
        atomic_store_explicit(&port->step, step, memory_order_release);
    }
}
