// A volume whose samples are in other files: its header, then the files to which a header can refer (a.raw, 1.raw, 2.raw, the pair's image).
// Covers: recon/volume/volume_file.c recon/volume/volume_format.c recon/volume/volume_nrrd.c recon/volume/volume_metaimage.c recon/volume/volume_nifti.c
#include "recon/volume/volume_file.h"
#include "tests/fuzz/given_files.h"

#include <math.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void count_file(void *context, const char *path)
{
    if (!*path || ++*(int *)context > 1000000)
        abort();
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static const char *const names[] = {"v.hdr", "a.raw", "1.raw", "2.raw", "v.img", NULL};
    static Faults faults;
    int files = 0;
    faults_clear(&faults);
    given_files(data, size, names);
    Volume *volume = volume_load(given_path(names[0]), &faults);
    if (!volume != (faults.count > 0) || (volume && !(volume->minimum <= volume->maximum && isfinite(volume->minimum) && isfinite(volume->maximum))))
        abort();
    volume_each_data_file(given_path(names[0]), count_file, &files);
    volume_free(volume);
    return 0;
}
