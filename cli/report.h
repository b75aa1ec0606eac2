// The report of a tree or model: one HTML5 file that needs nothing else (no script, no picture file, no network), for the screen in light and dark
// and for paper. The same bytes for the same input.
#ifndef SELDINGER_CLI_REPORT_H
#define SELDINGER_CLI_REPORT_H

#include "geom/geom.h"
#include "recon/tree_file.h"

#include <stdio.h>

// `name` is what the tree was loaded from. False with faults where the file cannot be written or memory lacks.
bool report_write(const char *path, const char *name, const VesselTree *tree, const TreeFileInfo *info, Faults *faults);

// What the parts of the report share.
typedef struct Report {
    FILE *out;
    const char *name;
    const VesselTree *tree;
    const TreeFileInfo *info;
    const VesselBranches *branches;
    const Finding *finding;
    int finding_count;
    double voxel;            // [mm] of the angiogram
    bool voxel_is_known;     // else the paper's 0.2 mm
} Report;

extern const char report_style[];                              // of every page: light, dark and paper
// A round step (1, 2, 5 times a power of ten) so that at most `most` fit into `range`.
double report_tick_step(double range, int most);
// Text as HTML: markup escaped, bytes that are no UTF-8 and control characters replaced.
void report_text(FILE *out, const char *text);
// "S1", "D2", "A1": findings counted by kind.
void report_label(const Report *report, int finding, char label[16]);

// Figures, inline SVG, each with a title and a description (report_figures.c).
void report_tree_figure(const Report *report);                // three projections, branches by order, findings marked
void report_radius_figure(const Report *report, int branch);  // radius along a branch
void report_error_figure(const Report *report);               // the paper's Table 4 as a histogram of d_a in voxels

#endif
