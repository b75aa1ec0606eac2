// Any bytes as a surface: STL, PLY, OBJ, VTP; accepted surfaces are repaired.
// Covers: recon/surface/surface_file.c recon/surface/vtp_file.c recon/surface/mesh_check.c
#include "recon/surface/mesh_check.h"

#include <stdint.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static Faults faults;
    static char text[4096];
    MeshCheck check;
    faults_clear(&faults);
    SurfaceMesh *mesh = surface_parse(data, size, "fuzz", &faults);
    // a mesh or a fault, never both, never neither
    if ((mesh != NULL) == (faults.count > 0))
        __builtin_trap();
    if (mesh && mesh_repair(mesh, &check))
        mesh_check_text(&check, true, text, sizeof text);
    surface_free(mesh);
    return 0;
}
