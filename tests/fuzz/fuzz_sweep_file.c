// Any bytes as a tree file with a swept model: tree_file_parse and sweep_file_parse return valid models or faults. As for fuzz_tree_file.c, the HDF5 library is
// not tested.
// Covers: recon/sweep_file.c geom/sweep_model.c geom/sweep_stretch.c
#include "recon/sweep_file.h"
#include "recon/tree_file.h"

#include <stdint.h>
#include <stdlib.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);
const char *__lsan_default_suppressions(void);

// libhdf5 1.10 loses 400 bytes of its own with every file that it refuses to open
const char *__lsan_default_suppressions(void) { return "leak:libhdf5"; }

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static Faults faults;
    faults_clear(&faults);
    VesselTree *tree = tree_file_parse(data, size, "fuzz.h5", NULL, &faults);
    if (!tree)
        return 0;
    for (int kind = 0; kind < SECTION_KINDS; kind++) {
        faults_clear(&faults);
        SweepModel *model = sweep_file_parse(data, size, "fuzz.h5", (SectionKind)kind, tree, &faults);
        if (!model == (faults.count == 0))
            abort();
        if (model && !sweep_model_validate(model, "fuzz.h5", &faults))
            abort();
        sweep_model_free(model);
    }
    vessel_tree_free(tree);
    return 0;
}
