// The nodes of the future tree, and the ostia at which its branches leave their parents. Internal to the import.
#ifndef SELDINGER_RECON_SURFACE_IMPORT_OSTIA_H
#define SELDINGER_RECON_SURFACE_IMPORT_OSTIA_H

#include "recon/surface/import_skeleton.h"
#include "recon/track/lumen_lines.h"

typedef struct Nodes {
    int count;
    Vec3 *center, *direction;
    double *radius;
    int *parent;             // parents precede children
    int *sample;             // sample of the skeleton
    bool *is_end;            // a leaf or the root: never removed
    bool *is_link;           // lies between the parent's axis and a branch's first node
} Nodes;

bool nodes_create(Nodes *nodes, size_t room);   // returns false if out of memory
void nodes_free(Nodes *nodes);
// Adds nodes to the links between branches and their parents, and counts the results in the report. A link without a path inside the surface is refused: the
// branch is attached to another node in line of sight, or removed. Returns false if out of memory.
bool nodes_open_ostia(Nodes *nodes, const Skeleton *skeleton, const Wall *wall, ImportReport *report);
// Returns the lines within whose clearance no point is wall, or NULL if out of memory.
LumenLines *nodes_lumen_lines(const Nodes *nodes);

#endif
