// Internal to import: joins curves to one rooted tree of fine samples with its ends at the openings of the wall.
#ifndef SELDINGER_RECON_SURFACE_IMPORT_SKELETON_H
#define SELDINGER_RECON_SURFACE_IMPORT_SKELETON_H

#include "recon/surface/import_report.h"
#include "recon/surface/import_wall.h"

typedef struct Skeleton {
    int count;
    Vec3 *point;
    double *radius;          // inscribed [mm]
    double *given;           // the curve's own [mm], 0 if it has none
    int *parent;             // -1 at 0, parents before children
    bool *is_open_end;       // at an opening
} Skeleton;

// NULL with faults.
Skeleton *skeleton_join(const CurveSet *set, const Wall *wall, const ImportOptions *options, ImportReport *report, const char *name, Faults *faults);
void skeleton_free(Skeleton *skeleton);

#endif
