// Contrast agent in the lumens of the tools: the flow that the injector's pressure drives, the position of the column, and the outflow at the tip.
//
// Flow is laminar, from the hub (proximal end) to the tip (Hagen and Poiseuille); around an inner tool it is the flow through the annulus between the
// two, concentric (Bird, Stewart and Lightfoot, Transport Phenomena, section 2.4):
//   P / Q = sum 8 eta l / (pi R^4 share(k)),   share(k) = 1 - k^4 - (1 - k^2)^2 / ln(1 / k),   k = inner tool's radius / lumen's radius R
// A tool touching the lumen's wall lets more pass: in a narrow gap up to 2.5 times as much (the mean of (1 + cos)^3). Turbulence is neglected, so a wide, short
// catheter passes more here than in reality. The injector delivers the requested rate as long as its pressure suffices. The column moves as a plug, flow over
// area, with sharp fronts. After an injection, the saline that keeps lumens open washes the agent out at the tip. An advancing inner tool displaces its volume
// at the tip; a retracted one draws in blood, which is assumed to be clear.
//
// Deterministic; no call after create allocates. One thread at a time. Lengths mm, volumes mm3.
#ifndef SELDINGER_SIM_CONTRAST_LUMEN_H
#define SELDINGER_SIM_CONTRAST_LUMEN_H

#include "sim/scene.h"

typedef struct LumenOptions {
    double pressure_mpa;     // the injector's pressure, default 2.07 (300 psi, the limit of microcatheters)
    double viscosity_mpa_s;  // viscosity [MPa s], default 6.3e-9 (iohexol 300 mg/ml at 37 degrees)
    double flush_ml_s;       // saline through every lumen in which nothing is injected, default 0.05 (a drop a second); 0: the column stays
} LumenOptions;
LumenOptions lumen_default_options(void);

// The fraction of the flow through a circular lumen that remains around a concentric tool of `ratio` times its radius: 1 at 0, 0 from 1 on.
double lumen_annulus_share(double ratio);

typedef struct ContrastLumens ContrastLumens;

// For the scene's tools. Concentrations are reported at their nodes (`node_count`[k] of them, at arc lengths `s`[k] from the proximal end; copied). `options`
// NULL: default. Returns NULL if out of memory.
ContrastLumens *contrast_lumens_create(const Scene *scene, const int *node_count, const double *const *s, const LumenOptions *options);
void contrast_lumens_free(ContrastLumens *lumens);
void contrast_lumens_copy(ContrastLumens *to, const ContrastLumens *from);   // both made of the same tools

// The tool through whose lumen an injection into `tool` flows: `tool` itself, or the next one around it with a continuous lumen; -1: none.
int contrast_lumens_tool(const ContrastLumens *lumens, int tool);
// [ml/s] driven through the lumen of `tool` by the injector's pressure, for the present insertions `inserted` [mm] (tool_count).
double contrast_lumens_passes(ContrastLumens *lumens, int tool, const double *inserted);
// Advances by `dt_s`, while `volume` of agent enters at the hub of `tool` (-1: none) and saline at the others. Adds the agent that left each tip to
// `out` (tool_count).
void contrast_lumens_advance(ContrastLumens *lumens, double dt_s, const double *inserted, int tool, double volume, double *out);
double contrast_lumens_within(const ContrastLumens *lumens, int tool);      // agent in its lumen
double contrast_lumens_front(ContrastLumens *lumens, int tool, const double *inserted);   // [mm] from its hub to the front of the agent, 0: none
// Device `which` of `tool` (0: the scene's, 1, 2, … those under its `exchange:`) is inserted from now on; it starts full of saline. Returns the agent
// removed with the previous device.
double contrast_lumens_fit(ContrastLumens *lumens, int tool, int which);
// Concentration at the nodes of all tools, one tool after the other, with space for the device with most nodes: agent in the lumen around each node divided by
// the lumen's volume there, 0 to 1. Its sum over the lumen is the amount within.
int contrast_lumens_node_count(const ContrastLumens *lumens);
void contrast_lumens_read(ContrastLumens *lumens, const double *inserted, float *filling);

#endif
