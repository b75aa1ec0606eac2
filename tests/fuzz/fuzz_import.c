// A surface and its centrelines, as for `import`: the result is a valid tree, or faults. The computation of centrelines takes seconds and is left out.
// Covers: recon/surface/import_surface.c recon/surface/import_skeleton.c recon/surface/import_ostia.c recon/surface/import_wall.c recon/surface/mesh_tree.c
#include "recon/surface/import_surface.h"
#include "tests/fuzz/given_files.h"

enum { MOST_TRIANGLES = 300 };

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static CurveSet *load_curves(const SurfaceMesh *mesh, ImportReport *report, Faults *faults)
{
    CurveSet *set = curve_set_create();
    if (centreline_load(given_path("curves"), set, faults) && import_place_curves(mesh, 1, set, report, "curves", faults))
        return set;
    curve_set_free(set);
    return NULL;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static const char *const names[] = {"surface", "curves", NULL};
    static Faults faults;
    MeshCheck check;
    ImportReport report = {.curves_scaled = 1, .inside_percent = 100};
    ImportOptions options = import_default_options();
    options.threads = 1;
    options.spacing = 1;
    options.points_per_node = 8;     // for speed
    faults_clear(&faults);
    given_files(data, size, names);
    SurfaceMesh *mesh = mesh_load_repaired(given_path("surface"), 1, "--scale ", &check, &faults);
    if (!mesh != (faults.count > 0))
        abort();
    bool is_small = mesh && check.triangle_count <= MOST_TRIANGLES;
    CurveSet *set = is_small ? load_curves(mesh, &report, &faults) : NULL;
    VesselTree *tree = set ? import_surface(mesh, set, &options, &report, "surface", &faults) : NULL;
    if (is_small && !tree != (faults.count > 0))
        abort();
    if (tree && !vessel_tree_validate(tree, "tree", &faults))
        abort();
    vessel_tree_free(tree);
    curve_set_free(set);
    surface_free(mesh);
    return 0;
}
