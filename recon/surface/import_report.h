// Options and report of a surface import. Lengths in mm.
#ifndef SELDINGER_RECON_SURFACE_IMPORT_REPORT_H
#define SELDINGER_RECON_SURFACE_IMPORT_REPORT_H

#include "geom/geom.h"

#include <stdbool.h>

typedef struct ImportOptions {
    double spacing;          // spacing of nodes, in local radii; default 0.5
    double points_per_node;  // default 108, about as many as RBT's rays yield
    bool has_root;           // `root` is given; else the root is the widest open end
    Vec3 root;               // [mm] the end nearest to it is the root; it is cut open if the surface is closed there
    int threads;             // 0: all cores; the result does not depend on it
} ImportOptions;

// How well the surface supports a link between a branch and its parent: the narrowest place of the path inside it, as a fraction of the branch's radius.
typedef enum ImportSupport {
    IMPORT_SUPPORTED,        // at least a quarter: the link has nodes, none further from the next than the sum of their radii
    IMPORT_DOUBTFUL,         // less: treated like a supported one, but should be checked by the user
    IMPORT_REFUSED,          // no path inside, and no other vessel in line of sight: the branch was removed with its subtree
    IMPORT_SUPPORTS
} ImportSupport;

typedef struct ImportJunction {
    Vec3 place;              // [mm] where the link leaves the parent's lumen; of a refused link, the branch's first node
    double length;           // [mm] length of the link
    double share;            // clearance of the narrowest place, 0 … 1
    ImportSupport support;
} ImportJunction;

enum { IMPORT_NAMED_MOST = 64 };

typedef struct ImportReport {
    bool curves_flipped;     // x and y of the curves were negated (LPS for RAS), because only then they lie inside
    double curves_scaled;    // scale factor with which they lie inside; 1: unchanged
    double inside_percent;   // percentage of the curves' points inside the surface, in the chosen frame
    int samples, moved_samples;          // samples of the curves; moved: they grazed the wall, or lay beside the lumen
    int cut_samples;         // samples removed because they lay beyond a vessel's end, or in no vessel
    int branch_count, end_count, open_end_count, lid_count;
    int loop_count;          // number of places where a loop was cut
    Vec3 loop;               // the first of these places
    int lost_curves;         // isolated curves, which were omitted
    Vec3 lost;
    int unused_components;   // components of the surface that no node sees; they were omitted
    bool root_is_open, root_is_cut;      // cut: there was no opening, so one was cut
    double root_cut;         // [mm] length removed from the root's curve by the cut
    double root_radius;      // [mm] of the vessel at its end
    double closed_radius;    // [mm] of the widest closed end, if it is clearly wider than an open root that nobody asked for; else 0
    Vec3 closed;             // [mm] that end
    double radius_min, radius_max, length;   // [mm] length: of all branches
    long sampled_points;     // points sampled on the surface
    long unseen_points;      // points visible from no node: assigned to the nearest node by power distance within 2.5 of its radii
    long left_points;        // points assigned to no node: out of reach, beyond the root's cut, or on a narrow branch that has no centreline
    int dropped_nodes;       // nodes removed because their sphere lies within their parent's
    int junction_count, junctions_with[IMPORT_SUPPORTS];
    int junctions_moved;     // branches attached to another node, because the curves' own link leaves the lumen
    ImportJunction named[IMPORT_NAMED_MOST];   // the first junctions that are not supported
    int named_count;
    int link_nodes;          // nodes between parents' axes and the first nodes of branches
    int refused_nodes;       // nodes removed with refused links
    long inner_points;       // points removed because they lie in a tool's path
    Vec3 root;
} ImportReport;

#endif
