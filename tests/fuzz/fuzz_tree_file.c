// Any bytes as a tree file: tree_file_parse returns a valid tree or faults. The HDF5 library is not tested: the corpus avoids damaged bytes on which it is
// known to crash (metadata of version 1.10 has checksums, so that it rejects changed headers).
// Covers: recon/tree_file.c recon/hdf5_reader.c
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
    TreeFileInfo info = {0};
    faults_clear(&faults);
    VesselTree *tree = tree_file_parse(data, size, "fuzz.h5", &info, &faults);
    if (!tree == (faults.count == 0))
        abort();
    if (tree && !vessel_tree_validate(tree, "fuzz.h5", &faults))
        abort();
    vessel_tree_free(tree);
    tree_file_info_free(&info);
    return 0;
}
