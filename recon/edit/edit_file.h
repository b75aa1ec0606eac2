// A model file opened for editing, and its edits as text.
#ifndef SELDINGER_RECON_EDIT_EDIT_FILE_H
#define SELDINGER_RECON_EDIT_EDIT_FILE_H

#include "recon/edit/sweep_edit.h"
#include "recon/sweep_file.h"
#include "recon/tree_file.h"

#include <stdio.h>

typedef struct EditFile {
    VesselTree *tree;
    SweepModels models;      // all that the file has
    const SweepModel *model; // the one with polar sections, which is edited
    TreeFileInfo info;
} EditFile;

// False with faults; free it anyway.
bool edit_file_load(const char *path, EditFile *file, Faults *faults);
void edit_file_free(EditFile *file);
// Saves the tree with the edited model. The same model and edits give the same bytes, wherever they were made.
bool edit_file_save(const EditFile *file, SweepEditor *editor, const char *path, Faults *faults);
// Prints branches with their stations and tags, and the edits since the fit.
void edit_file_list(const SweepModel *model, FILE *out);

#endif
