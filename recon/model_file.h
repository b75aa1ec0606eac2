// A file of a tree with its models (tree_file.h, sweep_file.h), and the one of them that a command is about. All commands choose it in the same way: the kind that
// is asked for, otherwise the first of model_names that the file has.
#ifndef SELDINGER_RECON_MODEL_FILE_H
#define SELDINGER_RECON_MODEL_FILE_H

#include "recon/tree_file.h"

enum { MODELS = 1 + SECTION_KINDS };
extern const char *const model_names[MODELS + 1];    // "lim" (blobs), then the swept models in the order of SectionKind: "sweep", "raster", "rbf", "pas", NULL

typedef struct ModelFile {
    VesselTree *tree;
    TreeFileInfo info;
    SweepModels swept;
    int kind;                // of the chosen model, index in model_names; -1: the file has none
    const SweepModel *sweep; // the chosen model if it is swept
    ModelField field;        // of the chosen model; of a tree without a model: its nodes alone
} ModelFile;

// Loads the file and chooses; `kind` -1: the first that the file has. A file without a model is no fault unless `kind` asks for one. Returns false with faults, and
// then nothing is owned.
bool model_file_load(const char *path, int kind, ModelFile *file, Faults *faults);
// The same, but a file without a model is a fault.
bool model_file_load_model(const char *path, int kind, ModelFile *file, Faults *faults);
void model_file_free(ModelFile *file);

#endif
