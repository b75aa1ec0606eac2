// Joins curves to one rooted tree of fine samples whose ends lie at the openings of the wall. Internal to the import.
#ifndef SELDINGER_RECON_SURFACE_IMPORT_SKELETON_H
#define SELDINGER_RECON_SURFACE_IMPORT_SKELETON_H

#include "recon/surface/import_report.h"
#include "recon/surface/import_wall.h"

typedef struct Skeleton {
    int count;
    Vec3 *point;
    double *radius;          // [mm] radius of the inscribed sphere
    double *given;           // [mm] radius given by the curve, 0 if none
    int *parent;             // -1 for sample 0; parents precede children
    bool *is_open_end;       // the sample lies at an opening
} Skeleton;

// Returns NULL with faults.
Skeleton *skeleton_join(const CurveSet *set, const Wall *wall, const ImportOptions *options, ImportReport *report, const char *name, Faults *faults);
void skeleton_free(Skeleton *skeleton);

#endif
