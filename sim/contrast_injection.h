// An injection: contrast agent enters at the hub of a tool, flows down its lumen (sim/contrast_lumen.h), leaves at its tip and travels with the blood
// (sim/contrast.h). A session and its replay use the same code.
//
// The agent flows through the requested tool, or through the next one around it that has a lumen (for a wire, the catheter around it). If none has one, as in
// scenes with a wire alone and in recordings from before a tool could be chosen, agent leaves the foremost tip at the requested rate, as if through an
// imaginary catheter. The vessel accepts agent from one tip at a time, the one with the largest waiting amount; during an injection the small amount that
// saline drives out of another tool therefore arrives in bursts.
//
// Deterministic; no call after create allocates. One thread at a time.
#ifndef SELDINGER_SIM_CONTRAST_INJECTION_H
#define SELDINGER_SIM_CONTRAST_INJECTION_H

#include "sim/contrast.h"
#include "sim/contrast_lumen.h"
#include "sim/xray.h"

typedef struct ContrastInjection ContrastInjection;

// Where tools are: their lengths beyond the mouth [mm], the tree's nodes nearest to their tips (-1: in the sheath), and which tip is foremost.
typedef struct TipPlaces {
    double inserted[TOOLS_MOST];
    int node[TOOLS_MOST];
    int foremost_node;
} TipPlaces;

// `tree` may be NULL. `node_count` and `s`: see contrast_lumens_create. Returns NULL if out of memory.
ContrastInjection *contrast_injection_create(const VesselTree *tree, const Scene *scene, const int *node_count, const double *const *s);
void contrast_injection_free(ContrastInjection *injection);
void contrast_injection_copy(ContrastInjection *to, const ContrastInjection *from);   // both made of the same scene

// Which device each tool is from now on (tool_count); agent in a replaced device leaves with it.
void contrast_injection_fit(ContrastInjection *injection, const int *fitted);
// The tool through which `xray` injects, -1: none; see above.
int contrast_injection_tool(const ContrastInjection *injection, const XrayControl *xray);
// [ml/s] the actual flow for the rate requested by `xray`, limited by the tool's lumen.
double contrast_injection_flow(ContrastInjection *injection, const XrayControl *xray, const double *inserted);
// Advances by `dt_s` (some ms), while `volume_ml` flowed as given by contrast_injection_flow for the controls `xray`.
void contrast_injection_advance(ContrastInjection *injection, double dt_s, const XrayControl *xray, double volume_ml, const TipPlaces *places);

// Nodes of the tree, 0 without, and of all tools: of each tool as many as its device with the most nodes.
int contrast_injection_tree_nodes(const ContrastInjection *injection);
int contrast_injection_node_count(const ContrastInjection *injection);   // of both
// Concentrations, 0 to 1: (tree nodes) in the vessel, then (tools' nodes) in the lumens, one tool after the other.
void contrast_injection_read(ContrastInjection *injection, float *concentration);
double contrast_injection_injected_ml(const ContrastInjection *injection);   // injected = within + gone
double contrast_injection_within_ml(const ContrastInjection *injection);     // in lumens and vessel
double contrast_injection_gone_ml(const ContrastInjection *injection);

#endif
