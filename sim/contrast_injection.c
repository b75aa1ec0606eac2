#include "sim/contrast_injection.h"

#include <stdlib.h>
#include <string.h>

struct ContrastInjection {
    Contrast *vessel;
    ContrastLumens *lumens;
    int tool_count;
    double injected;                 // [mm3] at hubs
    double waiting[TOOLS_MOST];      // [mm3] of agent that has left a tip and that the vessel has not yet accepted
    double taken_out;                // [mm3] of agent removed with exchanged tools
    double inserted[TOOLS_MOST];     // at the last advance
};

ContrastInjection *contrast_injection_create(const VesselTree *tree, const Scene *scene, const int *node_count, const double *const *s)
{
    ContrastInjection *injection = calloc(1, sizeof *injection);
    if (!injection)
        return NULL;
    injection->tool_count = scene->tool_count;
    injection->vessel = contrast_create(tree, NULL);
    injection->lumens = contrast_lumens_create(scene, node_count, s, NULL);
    if (injection->vessel && injection->lumens)
        return injection;
    contrast_injection_free(injection);
    return NULL;
}

void contrast_injection_free(ContrastInjection *injection)
{
    if (!injection)
        return;
    contrast_free(injection->vessel);
    contrast_lumens_free(injection->lumens);
    free(injection);
}

void contrast_injection_copy(ContrastInjection *to, const ContrastInjection *from)
{
    ContrastInjection own = *to;
    *to = *from;
    to->vessel = own.vessel;
    to->lumens = own.lumens;
    contrast_copy(to->vessel, from->vessel);
    contrast_lumens_copy(to->lumens, from->lumens);
}

void contrast_injection_fit(ContrastInjection *injection, const int *fitted)
{
    for (int k = 0; k < injection->tool_count; k++)
        injection->taken_out += contrast_lumens_fit(injection->lumens, k, fitted[k]);
}

int contrast_injection_tool(const ContrastInjection *injection, const XrayControl *xray)
{
    int requested = (int)lroundf(xray->contrast_tool) - 1;
    return contrast_lumens_tool(injection->lumens, requested < injection->tool_count ? requested : injection->tool_count - 1);
}

double contrast_injection_flow(ContrastInjection *injection, const XrayControl *xray, const double *inserted)
{
    double requested = fmax((double)xray->contrast_ml_s, 0);
    int tool = requested > 0 ? contrast_injection_tool(injection, xray) : -1;
    return tool < 0 ? requested : fmin(requested, contrast_lumens_passes(injection->lumens, tool, inserted));
}

void contrast_injection_advance(ContrastInjection *injection, double dt_s, const XrayControl *xray, double volume_ml, const TipPlaces *places)
{
    double *waiting = injection->waiting, volume = 1000 * volume_ml;
    int tool = contrast_injection_tool(injection, xray), from = 0;
    memcpy(injection->inserted, places->inserted, sizeof injection->inserted);
    injection->injected += volume;
    contrast_lumens_advance(injection->lumens, dt_s, places->inserted, tool, volume, waiting);
    for (int k = 1; k < injection->tool_count; k++)
        from = waiting[k] > waiting[from] ? k : from;
    if (tool < 0 && volume > 0) {
        contrast_advance(injection->vessel, dt_s, places->foremost_node, volume / 1000 / dt_s);
        return;
    }
    contrast_advance(injection->vessel, dt_s, places->node[from], waiting[from] / 1000 / dt_s);
    waiting[from] = 0;
}

int contrast_injection_tree_nodes(const ContrastInjection *injection) { return contrast_node_count(injection->vessel); }

int contrast_injection_node_count(const ContrastInjection *injection)
{
    return contrast_node_count(injection->vessel) + contrast_lumens_node_count(injection->lumens);
}

void contrast_injection_read(ContrastInjection *injection, float *concentration)
{
    size_t nodes = (size_t)contrast_node_count(injection->vessel);
    if (nodes > 0)
        memcpy(concentration, contrast_concentration(injection->vessel), nodes * sizeof *concentration);
    contrast_lumens_read(injection->lumens, injection->inserted, concentration + nodes);
}

double contrast_injection_injected_ml(const ContrastInjection *injection) { return injection->injected / 1000; }
double contrast_injection_gone_ml(const ContrastInjection *injection) { return contrast_gone_ml(injection->vessel) + injection->taken_out / 1000; }

double contrast_injection_within_ml(const ContrastInjection *injection)
{
    double within = 0;
    for (int k = 0; k < injection->tool_count; k++)
        within += contrast_lumens_within(injection->lumens, k) + injection->waiting[k];
    return within / 1000 + contrast_within_ml(injection->vessel);
}
