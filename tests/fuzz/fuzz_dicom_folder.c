// Up to four files as the folder of a DICOM series, and the first of them as one of its slices.
// Covers: recon/volume/volume_dicom.c
#include "recon/volume/volume_file.h"
#include "tests/fuzz/given_files.h"

#include <math.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void load(const char *path)
{
    static Faults faults;
    faults_clear(&faults);
    Volume *volume = volume_load(path, &faults);
    if (!volume != (faults.count > 0) || (volume && !(volume->minimum <= volume->maximum && isfinite(volume->minimum) && isfinite(volume->maximum))))
        abort();
    volume_free(volume);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static const char *const names[] = {"1.dcm", "2.dcm", "3.dcm", "4", NULL};
    given_files(data, size, names);
    load(given_folder);
    load(given_path(names[0]));
    return 0;
}
