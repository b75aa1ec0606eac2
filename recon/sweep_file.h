// The swept model in a tree's HDF5 file, group /sweep (docs/file-formats.md, "Swept model"). Loading checks every size, type and rule of sweep_model_validate
// before it trusts the file. tree_file_save_with writes it.
#ifndef SELDINGER_RECON_SWEEP_FILE_H
#define SELDINGER_RECON_SWEEP_FILE_H

#include "geom/geom.h"

// The swept model of a file whose tree is `tree`. Returns NULL with faults, among them that the file has no such model and how one is made.
SweepModel *sweep_file_load(const char *path, const VesselTree *tree, Faults *faults);
// The same from memory, without the trial read in a child process; `name` is used in messages.
SweepModel *sweep_file_parse(const void *bytes, size_t length, const char *name, const VesselTree *tree, Faults *faults);
// True if the file has a group /sweep. False with a fault if it cannot be read at all.
bool sweep_file_is_in(const char *path, Faults *faults);
// Writes the group into an open HDF5 file (hid_t). Returns false if the library fails.
bool sweep_file_write(int64_t file, const SweepModel *model);

#endif
