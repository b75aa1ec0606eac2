// Swept models in a tree's HDF5 file, one for each kind of sections: groups /sweep (polar), /raster, /rbf and /pas (docs/file-formats.md, "Swept model"). Loading checks every size, type and rule of sweep_model_validate
// before it trusts the file. tree_file_save_with writes it.
#ifndef SELDINGER_RECON_SWEEP_FILE_H
#define SELDINGER_RECON_SWEEP_FILE_H

#include "geom/geom.h"

// Name of the group, and of `fit --model` and `contact:`: "sweep", "raster", "rbf", "pas".
const char *sweep_file_group(SectionKind kind);

// The model of a file whose tree is `tree`. Returns NULL with faults, among them that the file has no such model and how one is made.
SweepModel *sweep_file_load(const char *path, SectionKind kind, const VesselTree *tree, Faults *faults);
// The same from memory, without the trial read in a child process; `name` is used in messages.
SweepModel *sweep_file_parse(const void *bytes, size_t length, const char *name, SectionKind kind, const VesselTree *tree, Faults *faults);

// The models of one file; NULL: it has none of that kind. sweep_models_free frees them.
typedef struct SweepModels {
    SweepModel *of[SECTION_KINDS];
} SweepModels;
// Loads all models that the file has. Returns false with faults, and then none.
bool sweep_models_load(const char *path, const VesselTree *tree, SweepModels *models, Faults *faults);
void sweep_models_free(SweepModels *models);
// Writes the groups into an open HDF5 file (hid_t). Returns false if the library fails.
bool sweep_models_write(int64_t file, const SweepModels *models);

#endif
