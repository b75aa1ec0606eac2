// Trees and models as HDF5 files (docs/file-formats.md, "Trees and models"), float64, mm. Loading checks every size, type and rule of vessel_tree_validate
// before it trusts the file. Saving writes a temporary file and renames it, so no partial file remains.
#ifndef SELDINGER_RECON_TREE_FILE_H
#define SELDINGER_RECON_TREE_FILE_H

#include "geom/geom.h"
#include "recon/sweep_file.h"

typedef struct TreeFileInfo {  // root attributes
    char *source;            // the input files
    char *parameters;        // YAML text of all parameters
    char *created_by;        // "seldinger VERSION segment" …
} TreeFileInfo;

// Loads a tree or a model. Returns NULL with faults. `info` may be NULL; free it with tree_file_info_free.
VesselTree *tree_file_load(const char *path, TreeFileInfo *info, Faults *faults);
// The same from memory, without the trial read in a child process (recon/hdf5_reader.h); `name` is used in messages.
VesselTree *tree_file_parse(const void *bytes, size_t length, const char *name, TreeFileInfo *info, Faults *faults);
bool tree_file_save(const VesselTree *tree, const TreeFileInfo *info, const char *path, Faults *faults);
// The same with swept models of the tree (recon/sweep_file.h) beside its blobs, if it has any. `sweep` may be NULL.
bool tree_file_save_with(const VesselTree *tree, const SweepModels *sweep, const TreeFileInfo *info, const char *path, Faults *faults);
void tree_file_info_free(TreeFileInfo *info);
// Returns the number on the line `key: number` of the parameters (any indentation), or `otherwise` if there is none.
double tree_file_number(const TreeFileInfo *info, const char *key, double otherwise);

#endif
