// Options and report of a surface import. Lengths mm.
#ifndef SELDINGER_RECON_SURFACE_IMPORT_REPORT_H
#define SELDINGER_RECON_SURFACE_IMPORT_REPORT_H

#include "geom/geom.h"

#include <stdbool.h>

typedef struct ImportOptions {
    double spacing;          // of nodes, in local radii; 0.5
    double points_per_node;  // 108, as the rays of RBT keep them
    bool has_root;           // else the widest open end
    Vec3 root;               // [mm] the end nearest to it is the root, and is cut open where the surface is closed there
    int threads;             // 0: all cores; the tree does not depend on it
} ImportOptions;

// How well the surface supports a link between a branch and its parent: the narrowest place of the path inside it, as a share of the branch's radius.
typedef enum ImportSupport {
    IMPORT_SUPPORTED,        // at least a quarter: it has nodes, none further from the next than the sum of their radii
    IMPORT_DOUBTFUL,         // less: the same, but should be checked
    IMPORT_REFUSED,          // no path inside, and no other vessel in line of sight: the branch was dropped with its subtree
    IMPORT_SUPPORTS
} ImportSupport;

typedef struct ImportJunction {
    Vec3 place;              // [mm] where the link leaves the parent's lumen; of a refused one the branch's first node
    double length;           // [mm] of the link
    double share;            // 0 … 1
    ImportSupport support;
} ImportJunction;

enum { IMPORT_NAMED_MOST = 64 };

typedef struct ImportReport {
    bool curves_flipped;     // x and y of the curves were negated (LPS for RAS): only so they lie inside
    double curves_scaled;    // scale factor with which they lie inside; 1
    double inside_percent;   // of the curves' points inside the surface, in the frame that was taken
    int samples, moved_samples;          // of the curves; moved: they grazed the wall, or lay beside the lumen
    int cut_samples;         // that lay beyond a vessel's end, or in no vessel
    int branch_count, end_count, open_end_count, lid_count;
    int loop_count;          // places where a loop was cut
    Vec3 loop;               // the first of them
    int lost_curves;         // isolated curves, left out
    Vec3 lost;
    int unused_components;   // of the surface: no node sees them; they are left out
    bool root_is_open, root_is_cut;      // cut: no opening was there
    double root_cut;         // [mm] of the root's curve that was left out for it
    double radius_min, radius_max, length;   // [mm]; length of all branches
    long sampled_points;     // of the surface
    long unseen_points;      // visible from no node: assigned to the nearest by power distance within 2.5 of its radii
    long left_points;        // and these to none: out of reach, beyond the root's cut, or of a narrow branch that has no centreline
    int dropped_nodes;       // whose sphere lies within their parent's
    int junction_count, junctions_with[IMPORT_SUPPORTS];
    int junctions_moved;     // attached to another node, because the curves' own link leaves the lumen
    ImportJunction named[IMPORT_NAMED_MOST];   // the first that are not supported
    int named_count;
    int link_nodes;          // between parents' axes and the first nodes of branches
    int refused_nodes;       // left out with refused links
    long inner_points;       // left out, because a tool passes there
    Vec3 root;
} ImportReport;

#endif
