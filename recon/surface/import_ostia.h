// Internal to import: the nodes of the future tree, and where its branches leave their parents.
#ifndef SELDINGER_RECON_SURFACE_IMPORT_OSTIA_H
#define SELDINGER_RECON_SURFACE_IMPORT_OSTIA_H

#include "recon/surface/import_skeleton.h"
#include "recon/track/lumen_lines.h"

typedef struct Nodes {
    int count;
    Vec3 *center, *direction;
    double *radius;
    int *parent;             // parents before children
    int *sample;             // of the skeleton
    bool *is_end;            // a leaf or the root: kept
    bool *is_link;           // between the parent's axis and a branch's first node
} Nodes;

bool nodes_create(Nodes *nodes, size_t room);   // false: out of memory
void nodes_free(Nodes *nodes);
// Puts nodes on the links between branches and their parents. The report counts the results: a link without a path inside the surface is refused, and
// the branch is attached to another node in line of sight or dropped. False: out of memory.
bool nodes_open_ostia(Nodes *nodes, const Skeleton *skeleton, const Wall *wall, ImportReport *report);
// The lines within whose clearance no point is wall. NULL if out of memory.
LumenLines *nodes_lumen_lines(const Nodes *nodes);

#endif
