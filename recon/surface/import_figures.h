// Reports the results of an import, as text and as JSON.
#ifndef SELDINGER_RECON_SURFACE_IMPORT_FIGURES_H
#define SELDINGER_RECON_SURFACE_IMPORT_FIGURES_H

#include "recon/surface/import_report.h"
#include "recon/surface/mesh_check.h"

#include <cJSON.h>
#include <stdio.h>

typedef struct ImportFigures {
    MeshCheck check;
    ImportReport report;
    bool computed;           // the centrelines were computed; else they were read
    int curve_count, nodes;
    long points;
    double seconds;
} ImportFigures;

// Prints all results except those of mesh_check_text() on the surface. `surface` is its name.
void import_figures_print(FILE *out, const char *surface, const ImportFigures *figures);
void import_figures_add(cJSON *root, const ImportFigures *figures);

#endif
