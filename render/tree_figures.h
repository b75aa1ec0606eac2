// The figures of a tree's page (tree_page.h), and their data.
#ifndef SELDINGER_RENDER_TREE_FIGURES_H
#define SELDINGER_RENDER_TREE_FIGURES_H

#include "geom/geom.h"
#include "recon/recon.h"

#include <stdio.h>

typedef struct Report {
    FILE *out;
    const char *name;
    const ModelField *model;
    const VesselTree *tree;  // its nodes
    const TreeFileInfo *info;
    const VesselBranches *branches;
    const Finding *finding;
    int finding_count;
    double voxel;            // [mm] of the angiogram
    bool voxel_is_known;     // else the paper's 0.2 mm
} Report;

// "S1", "D2", "A1": findings counted by kind.
void tree_page_label(const Report *report, int finding, char label[16]);

// Figures, inline SVG, each with a title and a description.
void tree_page_branches_figure(const Report *report);                // three projections, branches by order, findings marked
void tree_page_radius_figure(const Report *report, int branch);  // radius along a branch
void tree_page_error_figure(const Report *report);               // the paper's Table 4 as a histogram of d_a in voxels

#endif
