// Describes trees, models, volumes and surfaces: adds their figures to a JSON object, for the verb `info`.
#ifndef SELDINGER_RECON_DESCRIBE_H
#define SELDINGER_RECON_DESCRIBE_H

#include "recon/model_file.h"

#include <cJSON.h>

void describe_tree(cJSON *object, const ModelFile *file);
// `path` is a file, or the folder of a DICOM series. Returns false, with faults, if it cannot be read.
bool describe_volume(cJSON *object, const char *path, Faults *faults);
bool describe_surface(cJSON *object, const char *path, Faults *faults);

#endif
