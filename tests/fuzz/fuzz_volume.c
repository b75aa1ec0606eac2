// Any bytes as a volume: NRRD, MetaImage, NIfTI headers and data. Detached files are searched in a folder that does not exist.
// Covers: recon/volume/volume_file.c recon/volume/volume_format.c recon/volume/volume_nrrd.c recon/volume/volume_metaimage.c recon/volume/volume_nifti.c
// Covers: recon/volume/volume_dicom.c
#include "recon/volume/volume_file.h"

#include <stdint.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static Faults faults;
    faults_clear(&faults);
    Volume *volume = volume_parse(data, size, "/nowhere/fuzz.hdr", &faults);
    // a volume or a fault, never both, never neither
    if ((volume != NULL) == (faults.count > 0))
        __builtin_trap();
    volume_free(volume);
    return 0;
}
