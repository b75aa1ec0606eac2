// Internal to import: the nodes of the tree to be, and where its branches leave their parents.
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
// Puts nodes on the links between branches and their parents. What the surface says is counted in the report: a link without a path inside it is refused,
// and the branch hangs on another node in plain sight or goes. False: out of memory.
bool nodes_open_ostia(Nodes *nodes, const Skeleton *skeleton, const Wall *wall, ImportReport *report);
// The lines inside of which no point is wall. NULL where memory lacks.
LumenLines *nodes_lumen_lines(const Nodes *nodes);

#endif
