#include "sim/hand_set.h"

#include <math.h>
#include <string.h>

void hand_set_init(HandSet *set)
{
    memset(set, 0, sizeof *set);
    set->fastest_mm_s = 200;
    set->fastest_deg_s = 1440;
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

// Part of the way from `taken` to `total` that fits beside `moved`, both in one step; moves `taken` on.
static double take_way(double total, double *taken, double moved, double most)
{
    double way = total - *taken;
    if (!isfinite(way)) {
        *taken = isfinite(total) ? total : *taken;
        return moved;
    }
    double sum = limited(moved + way, most);
    *taken += sum - moved;
    return sum;
}

Command hand_set_command(HandSet *set, double dt)
{
    double seconds = dt / 1000, most_mm = set->fastest_mm_s * seconds, most_deg = set->fastest_deg_s * seconds, moved_mm = 0, turned_deg = 0;
    bool stopped = hand_set_buttons(set) & HAND_STOP;
    for (int i = 0; i < set->count; i++) {
        const HandPort *port = set->port[i];
        moved_mm = limited(moved_mm + limited(atomic_load_explicit(&port->push_mm_s, memory_order_relaxed), set->fastest_mm_s) * seconds, most_mm);
        turned_deg = limited(turned_deg + limited(atomic_load_explicit(&port->twist_deg_s, memory_order_relaxed), set->fastest_deg_s) * seconds, most_deg);
    }
    for (int i = 0; i < set->count; i++) {
        double mm = atomic_load_explicit(&set->port[i]->advanced_mm, memory_order_relaxed);
        double deg = atomic_load_explicit(&set->port[i]->turned_deg, memory_order_relaxed);
        if (stopped) {
            set->taken_mm[i] = mm;
            set->taken_deg[i] = deg;
        }
        moved_mm = take_way(mm, &set->taken_mm[i], moved_mm, most_mm);
        turned_deg = take_way(deg, &set->taken_deg[i], turned_deg, most_deg);
    }
    return stopped ? (Command){0, 0} : (Command){moved_mm / seconds, turned_deg / seconds};
}

unsigned hand_set_buttons(const HandSet *set)
{
    unsigned buttons = 0;
    for (int i = 0; i < set->count; i++)
        buttons |= atomic_load_explicit(&set->port[i]->buttons, memory_order_relaxed);
    return buttons;
}

void hand_set_answer(HandSet *set, const StepReport *report, int64_t step)
{
    for (int i = 0; i < set->count; i++) {
        HandPort *port = set->port[i];
        atomic_store_explicit(&port->force_n, report->proximal_force, memory_order_relaxed);
        atomic_store_explicit(&port->torque_n_mm, report->proximal_torque, memory_order_relaxed);
        atomic_store_explicit(&port->step, step, memory_order_release);
    }
}
