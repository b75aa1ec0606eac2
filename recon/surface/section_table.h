// The sections of a swept model as a table (CSV).
#ifndef SELDINGER_RECON_SURFACE_SECTION_TABLE_H
#define SELDINGER_RECON_SURFACE_SECTION_TABLE_H

#include "base/base.h"
#include "recon/model_file.h"

// One row for each break of the sections' B-splines: branch, t_mm, centre, normal, area_mm2, radii, perimeter_mm, circularity, diameters, kind
// (geom/sweep_section.h). A section without a closed contour has no figures.
bool section_table_write(const char *path, const SweepModel *model, Faults *faults);
// The table of the chosen model of a file, or of its first swept one. True if `path` is NULL.
bool section_table_of_file(const char *path, const char *name, const ModelFile *file, Faults *faults);

#endif
