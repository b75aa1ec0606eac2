// Contrast agent in the lumens of the tools: what the injector's pressure drives through one, where the column in it stands, what comes out of its tip.
//
// Flow is laminar, from the hub (proximal end) to the tip (Hagen and Poiseuille); beside an inner tool it goes through the annulus between the two,
// concentric (Bird, Stewart and Lightfoot, Transport Phenomena, section 2.4):
//   P / Q = sum 8 eta l / (pi R^4 share(k)),   share(k) = 1 - k^4 - (1 - k^2)^2 / ln(1 / k),   k = inner tool's radius / lumen's radius R
// A tool that lies at the lumen's wall leaves more: in a narrow gap up to 2.5 times as much (the mean of (1 + cos)^3). Turbulence is left out, so a wide
// short catheter passes more here than on the table. The injector gives the asked rate as long as its pressure suffices.
// The column moves as a plug, flow over area, with sharp fronts. Once nothing is injected, the saline that keeps lumens open washes it out at the tip.
// An inner tool that comes in pushes its volume out at the tip; one that is drawn back sucks blood in there, which is taken to be clear.
//
// A pure function of the calls; no call after create allocates. One thread at a time. Lengths mm, volumes mm3.
#ifndef SELDINGER_SIM_CONTRAST_LUMEN_H
#define SELDINGER_SIM_CONTRAST_LUMEN_H

#include "sim/scene.h"

typedef struct LumenOptions {
    double pressure_mpa;     // the injector's, default 2.07 (300 psi, what microcatheters bear)
    double viscosity_mpa_s;  // of what flows [MPa s], default 6.3e-9 (iohexol 300 mg/ml at 37 degrees)
    double flush_ml_s;       // saline through every lumen in which nothing is injected, default 0.05 (a drop a second); 0: the column stays
} LumenOptions;
LumenOptions lumen_default_options(void);

// The share of the flow through a circular lumen that is left beside a concentric tool of `ratio` of its radius: 1 at 0, 0 from 1 on.
double lumen_annulus_share(double ratio);

typedef struct ContrastLumens ContrastLumens;

// Of the scene's tools, at whose own nodes (`node_count`[k] of them, at arc lengths `s`[k] from the proximal end) the lumen is read; copied. `options` NULL:
// default. NULL when out of memory.
ContrastLumens *contrast_lumens_create(const Scene *scene, const int *node_count, const double *const *s, const LumenOptions *options);
void contrast_lumens_free(ContrastLumens *lumens);
void contrast_lumens_copy(ContrastLumens *to, const ContrastLumens *from);   // both made of the same tools

// The tool through whose lumen one injects where `tool` is asked for: it, or the next around it that has a lumen all along; -1: none has.
int contrast_lumens_tool(const ContrastLumens *lumens, int tool);
// [ml/s] that the injector's pressure drives through the lumen of `tool`, with the tools `inserted` [mm] (tool_count) as they are.
double contrast_lumens_passes(ContrastLumens *lumens, int tool, const double *inserted);
// `dt_s` on, while `volume` of agent comes in at the hub of `tool` (-1: of none) and saline at the others'. Adds to `out` (tool_count) the agent that has left
// at each tip.
void contrast_lumens_advance(ContrastLumens *lumens, double dt_s, const double *inserted, int tool, double volume, double *out);
double contrast_lumens_within(const ContrastLumens *lumens, int tool);      // agent in its lumen
double contrast_lumens_front(ContrastLumens *lumens, int tool, const double *inserted);   // [mm] from its hub to where the agent ends, 0: none
// Device `which` of `tool` (0: the scene's, 1, 2, … those under its `exchange:`) is in, from now on; it comes in full of saline. Returns the agent that went out
// with another.
double contrast_lumens_fit(ContrastLumens *lumens, int tool, int which);
// At the nodes of all tools, one tool after the other, with room for whichever device has most of them: agent in the lumen about each over the lumen's volume there, 0 to 1. Its sum over the lumen is what is
// within.
int contrast_lumens_node_count(const ContrastLumens *lumens);
void contrast_lumens_read(ContrastLumens *lumens, const double *inserted, float *filling);

#endif
