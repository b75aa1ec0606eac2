// Finite volumes in the order of flow, one sweep per step. A cell of volume V and concentration c receives the volume U with the mean concentration m and
// releases the same volume:
//   U <= V   the cell's own contents leave (upwind): out = c, c' = c + (m - c) U / V;
//   U >  V   all of them leave, then part of the inflow passes through: c' = m, out = (V c + (U - V) m) / U.
// The outflow is the content plus the inflow minus what remains, so mass is conserved; c' and out are means of c and m, so both stay within 0 to 1; at U = V
// contents move by exactly one cell. The scheme is stable for any step length and any cell size, V = 0 included. If more is injected than flows, J > W, the
// branches between the tip and the first fork that carries more run backwards: they are processed first.
#include "sim/contrast.h"

#include "base/base.h"
#include "sim/contrast_network.h"

#include <stdlib.h>
#include <string.h>

enum { SWEEPS_BETWEEN_TIDYINGS = 32 };
static const double NOTHING = 1e-12;       // concentration below which a cell counts as clear: otherwise decay would not end, and denormal numbers are slow
static const double MOST_RATE_ML_S = 100;

struct Contrast {
    FlowNetwork network;
    double step_s, pulsation, heart_rad_s;
    double phase_s;          // real time, modulo heart periods
    double flowed_s;         // since the last sweep: time weighted with the pulse
    double pending;          // [mm3] injected since the last sweep
    double injected, gone;   // [mm3]
    bool clear;
    int sweeps;              // since cells were last cleared
    double *cell;            // (cells) concentration
    double *sac;             // (sacs)
    double *outlet;          // (branches) concentration that leaves its downstream end in this sweep
    double *back;            // (branches) volume entering its downstream end backwards, 0 outside the sweep
    bool *runs_to_tip;       // (branches) between inlet and tip, false outside the sweep
    float *node;             // (nodes) concentration
};

ContrastOptions contrast_default_options(void)
{
    return (ContrastOptions){.step_s = 0.005, .inlet_node = -1, .pulsation = 1, .heart_rate_min = 65, .sac_residence_s = 1.5};
}

static double within(double value, double least, double most) { return value > least ? fmin(value, most) : least; }

Contrast *contrast_create(const VesselTree *tree, const ContrastOptions *options)
{
    ContrastOptions used = options ? *options : contrast_default_options();
    Contrast *contrast = calloc(1, sizeof *contrast);
    if (!contrast)
        return NULL;
    contrast->clear = true;
    contrast->step_s = used.step_s = within(used.step_s, 0.001, 0.1);
    contrast->pulsation = within(used.pulsation, 0, 1);
    contrast->heart_rad_s = 2 * PI * within(used.heart_rate_min, 30, 200) / 60;
    used.sac_residence_s = within(used.sac_residence_s, 0.1, 100);
    if (!tree || tree->node_count < 1)
        return contrast;
    if (used.inlet_node < 0 || used.inlet_node >= tree->node_count)
        used.inlet_node = contrast_find_inlet(tree);
    FlowNetwork *network = &contrast->network;
    if (flow_network_build(network, tree, &used)) {
        size_t branches = (size_t)network->branch_count;
        contrast->cell = calloc((size_t)network->cell_count, sizeof *contrast->cell);
        contrast->sac = calloc((size_t)network->sac_count + 1, sizeof *contrast->sac);
        contrast->outlet = calloc(branches, sizeof *contrast->outlet);
        contrast->back = calloc(branches, sizeof *contrast->back);
        contrast->runs_to_tip = calloc(branches, sizeof *contrast->runs_to_tip);
        contrast->node = calloc((size_t)network->node_count, sizeof *contrast->node);
    }
    if (contrast->cell && contrast->sac && contrast->outlet && contrast->back && contrast->runs_to_tip && contrast->node)
        return contrast;
    contrast_free(contrast);
    return NULL;
}

void contrast_free(Contrast *contrast)
{
    if (!contrast)
        return;
    flow_network_free(&contrast->network);
    free(contrast->cell);
    free(contrast->sac);
    free(contrast->outlet);
    free(contrast->back);
    free(contrast->runs_to_tip);
    free(contrast->node);
    free(contrast);
}

void contrast_copy(Contrast *to, const Contrast *from)
{
    Contrast own = *to;
    const FlowNetwork *network = &to->network;
    *to = *from;
    to->network = own.network;
    to->cell = own.cell, to->sac = own.sac, to->outlet = own.outlet, to->back = own.back, to->runs_to_tip = own.runs_to_tip, to->node = own.node;
    if (network->node_count == 0)
        return;
    memcpy(to->cell, from->cell, (size_t)network->cell_count * sizeof *to->cell);
    memcpy(to->sac, from->sac, (size_t)network->sac_count * sizeof *to->sac);
    memcpy(to->node, from->node, (size_t)network->node_count * sizeof *to->node);
}

// --- one sweep ---

// As described at the top of the file; returns the concentration of the outflow.
static double pass(double *cell, double volume, double through, double mean)
{
    double out = *cell;
    if (through <= volume) {
        if (volume > 0)
            *cell += (mean - out) * (through / volume);
        return out;
    }
    *cell = mean;
    return mean + (out - mean) * (volume / through);
}

// Cells [from, to) of a branch, upstream if to < from, with `through` flowing from the first to the last.
static double pass_cells(Contrast *contrast, double volume, int from, int to, double through, double mean)
{
    int step = from < to ? 1 : -1;
    for (int i = from; i != to; i += step)
        mean = pass(&contrast->cell[i], volume, through, mean);
    return mean;
}

// Volume and place of the injection in this sweep.
typedef struct Injection {
    int branch, cell;        // -1: no injection
    int sac;                 // sac into which it flows, -1: none
    double volume;
    double into_sac;         // part of the volume that flows into the sac
} Injection;

// A cell with sacs or with the tip. `through` comes from the neighbouring cell with the concentration `mean`.
static double pass_neck(Contrast *contrast, const FlowBranch *branch, int cell, int first_sac, int end_sac, double through, double mean,
                        const Injection *injection)
{
    const FlowNetwork *network = &contrast->network;
    double direct = injection->cell == cell ? injection->volume - injection->into_sac : 0, volume = through + direct, mass = through * mean + direct;
    for (int s = first_sac; s < end_sac; s++) {
        double out = network->sac[s].exchange_flow * contrast->step_s + (injection->sac == s ? injection->into_sac : 0);
        volume += out;
        mass += out * contrast->sac[s];
    }
    double out = pass(&contrast->cell[cell], branch->cell_volume, volume, volume > 0 ? mass / volume : 0);
    for (int s = first_sac; s < end_sac; s++) {
        double exchanged = network->sac[s].exchange_flow * contrast->step_s, own = injection->sac == s ? injection->into_sac : 0;
        contrast->sac[s] += (exchanged * (out - contrast->sac[s]) + own * (1 - contrast->sac[s])) / network->sac[s].volume;
    }
    return out;
}

// A part of a branch, with cells [from, to) as in pass_cells.
static double pass_part(Contrast *contrast, const FlowBranch *branch, int from, int to, double through, double mean, const Injection *injection)
{
    const FlowSac *sac = contrast->network.sac;
    int first = branch->first_sac, end = branch->first_sac + branch->sac_count, step = from < to ? 1 : -1;
    while (from != to) {
        int s = step > 0 ? first : end - 1;
        bool any = first < end;
        if (any && (step > 0 ? sac[s].cell < from : sac[s].cell > from)) {   // already passed
            first += step > 0;
            end -= step < 0;
            continue;
        }
        int stop = any && (step > 0 ? sac[s].cell < to : sac[s].cell > to) ? sac[s].cell : to;
        mean = pass_cells(contrast, branch->cell_volume, from, stop, through, mean);
        from = stop;
        if (from == to)
            break;
        int same = s;
        while (same + step >= first && same + step < end && sac[same + step].cell == from)
            same += step;
        mean = pass_neck(contrast, branch, from, s < same ? s : same, (s > same ? s : same) + 1, through, mean, injection);
        from += step;
    }
    return mean;
}

static double pass_tip(Contrast *contrast, const FlowBranch *branch, double through, double mean, const Injection *injection)
{
    const FlowSac *sac = contrast->network.sac;
    int first = branch->first_sac, last = branch->first_sac + branch->sac_count;
    while (first < last && sac[first].cell < injection->cell)
        first++;
    int end = first;
    while (end < last && sac[end].cell == injection->cell)
        end++;
    return pass_neck(contrast, branch, injection->cell, first, end, through, mean, injection);
}

static double swept_volume(const Contrast *contrast, const FlowBranch *branch) { return branch->flow * contrast->step_s; }

// The branches that run backwards, upstream from the tip: their cells above the tip. Returns the concentration that leaves the tip's cell to both sides.
static double sweep_back(Contrast *contrast, const Injection *injection)
{
    const FlowNetwork *network = &contrast->network;
    const FlowBranch *branch = &network->branch[injection->branch];
    double tip = pass_tip(contrast, branch, 0, 0, injection), mean = tip;
    int from = injection->cell - 1;
    for (int i = injection->branch; i >= 0; i = branch->parent, from = i >= 0 ? network->branch[i].first_cell + network->branch[i].cell_count - 1 : 0) {
        branch = &network->branch[i];
        double up = injection->volume - swept_volume(contrast, branch);
        if (up <= 0)
            break;
        mean = pass_part(contrast, branch, from, branch->first_cell - 1, up, mean, injection);
        if (branch->parent < 0) {
            contrast->gone += up * mean;
        } else {
            contrast->back[branch->parent] = up;
            contrast->outlet[branch->parent] = mean;   // flows into the fork's other branches, and further upstream
        }
    }
    return tip;
}

// A branch in the direction of flow; for a branch that runs backwards, the part below the tip.
static void sweep_branch(Contrast *contrast, int index, const Injection *injection, double tip_mean)
{
    const FlowNetwork *network = &contrast->network;
    const FlowBranch *branch = &network->branch[index];
    int end = branch->first_cell + branch->cell_count;
    bool has_tip = index == injection->branch;
    double full = swept_volume(contrast, branch), through = contrast->runs_to_tip[index] ? full - injection->volume : full;
    double mean = branch->parent >= 0 ? contrast->outlet[branch->parent] : 0;
    if (through < 0) {
        if (!has_tip)
            return;   // its outlet is set by the backward flow
        mean = pass_part(contrast, branch, injection->cell + 1, end, full, tip_mean, injection);
    } else if (has_tip) {
        mean = pass_part(contrast, branch, branch->first_cell, injection->cell, through, mean, injection);
        mean = pass_tip(contrast, branch, through, mean, injection);
        mean = pass_part(contrast, branch, injection->cell + 1, end, full, mean, injection);
    } else {
        mean = pass_part(contrast, branch, branch->first_cell, end, through, mean, injection);
    }
    double down = has_tip ? full : through;
    if (branch->child_count == 0)
        contrast->gone += down * mean;
    else if (contrast->back[index] > 0)
        mean = (down * mean + contrast->back[index] * contrast->outlet[index]) / (down + contrast->back[index]);
    contrast->outlet[index] = mean;
}

static Injection inject(const Contrast *contrast, int tip_node, double volume)
{
    const FlowNetwork *network = &contrast->network;
    if (!(volume > 0))
        return (Injection){-1, -1, -1, 0, 0};
    const FlowPlace *place = &network->place[tip_node];
    Injection injection = {place->branch, place->weight < 0.5f ? place->first : place->second, place->sac, volume, 0};
    if (place->sac >= 0) {
        const FlowSac *sac = &network->sac[place->sac];
        injection.branch = sac->branch;
        injection.cell = sac->cell;
        injection.into_sac = fmin(volume, fmax(sac->volume - sac->exchange_flow * contrast->step_s, 0));
    }
    return injection;
}

static void sweep(Contrast *contrast, int tip_node, double volume)
{
    const FlowNetwork *network = &contrast->network;
    Injection injection = inject(contrast, tip_node, volume);
    double tip_mean = 0;
    for (int i = injection.branch; i >= 0; i = network->branch[i].parent)
        contrast->runs_to_tip[i] = true;
    if (injection.branch >= 0 && injection.volume > swept_volume(contrast, &network->branch[injection.branch]))
        tip_mean = sweep_back(contrast, &injection);
    for (int i = 0; i < network->branch_count; i++)
        sweep_branch(contrast, i, &injection, tip_mean);
    for (int i = injection.branch; i >= 0; i = network->branch[i].parent) {
        contrast->runs_to_tip[i] = false;
        contrast->back[i] = 0;
    }
}

// Clears negligible concentrations, so that a washed-out vessel is clear.
static void tidy(Contrast *contrast)
{
    const FlowNetwork *network = &contrast->network;
    bool clear = true;
    for (int i = 0; i < network->branch_count; i++) {
        const FlowBranch *branch = &network->branch[i];
        for (int k = branch->first_cell; k < branch->first_cell + branch->cell_count; k++)
            if (contrast->cell[k] < NOTHING) {
                contrast->gone += contrast->cell[k] * branch->cell_volume;
                contrast->cell[k] = 0;
            } else {
                clear = false;
            }
    }
    for (int i = 0; i < network->sac_count; i++)
        if (contrast->sac[i] < NOTHING) {
            contrast->gone += contrast->sac[i] * network->sac[i].volume;
            contrast->sac[i] = 0;
        } else {
            clear = false;
        }
    contrast->clear = clear;
    contrast->sweeps = 0;
}

static void read_nodes(Contrast *contrast)
{
    const FlowNetwork *network = &contrast->network;
    for (int i = 0; i < network->node_count; i++) {
        const FlowPlace *place = &network->place[i];
        float first = (float)contrast->cell[place->first], second = (float)contrast->cell[place->second];
        float value = place->sac >= 0 ? (float)contrast->sac[place->sac] : first + place->weight * (second - first);
        contrast->node[i] = value < 1 ? value : 1;
    }
}

// Integral of the pulse 1 + 0.4 p (cos + half the cosine of twice the phase): 1.6 at the maximum, 0.7 at the minimum for p = 1.
static double pulse_integral(const Contrast *contrast, double time_s)
{
    double angle = contrast->heart_rad_s * time_s;
    return time_s + 0.4 * contrast->pulsation / contrast->heart_rad_s * (same_sin(angle) + 0.25 * same_sin(2 * angle));
}

void contrast_advance(Contrast *contrast, double dt_s, int tip_node, double rate_ml_s)
{
    const FlowNetwork *network = &contrast->network;
    if (!(dt_s > 0) || !isfinite(dt_s))
        return;
    double rest = 1000 * within(rate_ml_s, 0, MOST_RATE_ML_S) * dt_s;
    contrast->injected += rest;
    if (network->node_count == 0) {
        contrast->gone += rest;
        return;
    }
    int tip = tip_node >= 0 && tip_node < network->node_count ? tip_node : 0;
    double flow = pulse_integral(contrast, contrast->phase_s + dt_s) - pulse_integral(contrast, contrast->phase_s), period = 2 * PI / contrast->heart_rad_s;
    contrast->phase_s = fmod(contrast->phase_s + dt_s, period);
    bool swept = false;
    for (double part; !(contrast->clear && rest == 0) && (part = contrast->step_s - contrast->flowed_s) <= flow * (1 + 1e-12); swept = true) {
        double volume = flow > part ? rest * (part / flow) : rest;
        contrast->clear = false;
        sweep(contrast, tip, contrast->pending + volume);
        rest -= volume;
        flow = fmax(flow - part, 0);
        contrast->flowed_s = contrast->pending = 0;
        if (++contrast->sweeps >= SWEEPS_BETWEEN_TIDYINGS)
            tidy(contrast);
    }
    contrast->flowed_s = fmod(contrast->flowed_s + flow, contrast->step_s);
    contrast->pending += rest;
    contrast->clear = contrast->clear && contrast->pending == 0;
    if (swept)
        read_nodes(contrast);
}

// --- figures ---

int contrast_node_count(const Contrast *contrast) { return contrast->network.node_count; }
const float *contrast_concentration(const Contrast *contrast) { return contrast->node; }
double contrast_injected_ml(const Contrast *contrast) { return contrast->injected / 1000; }
double contrast_gone_ml(const Contrast *contrast) { return contrast->gone / 1000; }
bool contrast_is_clear(const Contrast *contrast) { return contrast->clear; }

double contrast_within_ml(const Contrast *contrast)
{
    const FlowNetwork *network = &contrast->network;
    double volume = contrast->pending;
    for (int i = 0; i < network->branch_count; i++) {
        const FlowBranch *branch = &network->branch[i];
        double sum = 0;
        for (int k = branch->first_cell; k < branch->first_cell + branch->cell_count; k++)
            sum += contrast->cell[k];
        volume += sum * branch->cell_volume;
    }
    for (int i = 0; i < network->sac_count; i++)
        volume += contrast->sac[i] * network->sac[i].volume;
    return volume / 1000;
}

double contrast_flow_ml_s(const Contrast *contrast, int node)
{
    const FlowPlace *place = &contrast->network.place[node];
    return place->sac >= 0 ? 0 : contrast->network.branch[place->branch].flow / 1000;
}

double contrast_transit_s(const Contrast *contrast, int node) { return contrast->network.place[node].transit; }
