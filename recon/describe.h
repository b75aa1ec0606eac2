// What a tree, a model, a volume or a surface is: its figures as JSON, for `info`.
#ifndef SELDINGER_RECON_DESCRIBE_H
#define SELDINGER_RECON_DESCRIBE_H

#include "recon/tree_file.h"

#include <cJSON.h>

void describe_tree(cJSON *object, const VesselTree *tree, const TreeFileInfo *info);
// Of a file, or the folder of a DICOM series. False with faults.
bool describe_volume(cJSON *object, const char *path, Faults *faults);
bool describe_surface(cJSON *object, const char *path, Faults *faults);

#endif
