#include "sim/library/recon.h"

#include "base/base.h"
#include "recon/recon.h"

#include <stdio.h>
#include <stdlib.h>

typedef struct Importing {
    const char *surface;
    int count;
    const char *const *centreline;
    SelTree *tree;
} Importing;

static TreeFileInfo info_of(const Importing *what)
{
    char parameters[512];
    snprintf(parameters, sizeof parameters, "surface: %.300s\ncentrelines: %d\n", what->surface, what->count);
    return (TreeFileInfo){
        .source = HEAP_TEXT("surface"), .parameters = HEAP_TEXT(parameters), .created_by = HEAP_TEXT("seldinger " SELDINGER_VERSION " import")};
}

static bool import(SelContext *context, void *argument)
{
    enum { TEXT_MAX = 4096 };
    Importing *what = argument;
    char text[TEXT_MAX];
    MeshCheck check = {0};
    const ImportOptions options = import_default_options();
    ImportReport report = {.curves_scaled = 1, .inside_percent = 100};
    SurfaceMesh *mesh = mesh_load_repaired(what->surface, 0, "", &check, &context->faults);
    CurveSet *set = mesh ? import_load_curves(mesh, 1, what->count, what->centreline, &options, &report, what->surface, &context->faults) : NULL;
    VesselTree *tree = set ? import_surface(mesh, set, &options, &report, what->surface, &context->faults) : NULL;
    const double left = import_left_percent(&report);
    if (tree && what->count == 0 && left > IMPORT_LEFT_MOST_PERCENT)
        faults_add(&context->faults, what->surface, 0, 0, "the computed centrelines miss %.0f %% of the surface, more than %d %%; give centrelines", left,
                   IMPORT_LEFT_MOST_PERCENT);
    if (tree && context->faults.count == 0) {
        mesh_check_text(&check, true, text, sizeof text);
        context_message(context, SEL_NOTE, what->surface, text);
        what->tree = tree_handle(tree, info_of(what));
    } else {
        vessel_tree_free(tree);
    }
    curve_set_free(set);
    surface_free(mesh);
    return what->tree != NULL;
}

SelStatus sel_import_surface(SelContext *context, const char *surface, int count, const char *const *centreline, SelTree **tree)
{
    Importing what = {.surface = surface, .count = count, .centreline = centreline};
    if (!context || !surface || !tree || count < 0 || (count > 0 && !centreline))
        return context_refuse(context, SEL_ERROR_ARGUMENT, __func__, "context, surface, centreline or tree is NULL, or count is negative");
    for (int i = 0; i < count; i++)
        if (!centreline[i])
            return context_refuse(context, SEL_ERROR_ARGUMENT, __func__, "the path of a centreline is NULL");
    SelStatus status = context_call(context, import, &what, SEL_ERROR_INPUT);
    if (status == SEL_OK)
        *tree = what.tree;
    return status;
}
