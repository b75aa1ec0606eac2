// See junction_sheets.h.
#include "cli/junction_sheets.h"

#include "geom/power_walk.h"
#include "geom/reach.h"
#include "recon/tree_file.h"
#include "recon/volume.h"
#ifdef SELDINGER_RENDER
#include "render/picture.h"
#endif

#include <stdio.h>
#include <stdlib.h>

enum { COMPARED = 10 };

#ifdef SELDINGER_RENDER
// The junctions next to the ten narrowest of the other model, which may have other nodes: by their branches' first nodes, each once.
static int choose_compared(const VesselTree *model, const Reach *reach, const VesselTree *before, const Reach *other, ReachJunction *chosen)
{
    int count = 0;
    for (int k = 0; k < other->junction_count && count < COMPARED; k++) {
        Vec3 x = before->center[other->junction[k].node];
        double reach_mm = 2 * before->radius[other->junction[k].node] + vec3_distance(x, before->center[other->junction[k].parent]), least = reach_mm;
        int best = -1;
        for (int i = 0; i < reach->junction_count; i++) {
            double far = vec3_distance(model->center[reach->junction[i].last], x);
            bool known = false;
            for (int c = 0; c < count; c++)
                known = known || chosen[c].node == reach->junction[i].node;
            if (far < least && !known)
                least = far, best = i;
        }
        if (best >= 0)
            chosen[count++] = reach->junction[best];
    }
    return count;
}

static void draw(const JunctionSheets *sheets, const char *title, const VesselTree *model, const VesselTree *before, const Volume *volume)
{
    ReachOptions flood = reach_default_options();
    flood.tool_radius = sheets->tool_radius;
    Reach *reach = reach_create(model, &flood), *other = before ? reach_create(before, &flood) : NULL;
    ReachJunction chosen[COMPARED];
    PictureOptions options = picture_default_options();
    char message[512] = "not enough memory";
    int pages = 0;
    bool drawn = false;
    options.title = title;
    options.width = 1920, options.height = 1360;
    if (reach && (!before || other)) {
        PictureJunctions what = {.tree = model, .junction_count = reach->junction_count, .junction = reach->junction, .tool_radius = sheets->tool_radius, .before = before};
        if (before)
            what.junction_count = choose_compared(model, reach, before, other, chosen), what.junction = chosen;
        if (volume) {
            for (int k = 0; k < 3; k++)
                what.size[k] = volume->size[k], what.axis[k] = volume->axis[k];
            what.origin = volume->origin;
            what.value = volume->value;
        }
        drawn = picture_of_junctions(sheets->picture, &options, &what, &pages, message, sizeof message);
    }
    if (!drawn)
        fprintf(stderr, "%s: no picture: %s\n", sheets->picture, message);
    reach_free(reach);
    reach_free(other);
}
#endif

bool junction_sheets_draw(const JunctionSheets *sheets, const char *title, const VesselTree *model, Faults *faults)
{
    if (!sheets->picture)
        return true;
    if (!vessel_tree_is_model(model)) {
        fprintf(stderr, "%s: no picture: the tree has no fitted model to draw\n", sheets->picture);
        return true;
    }
#ifdef SELDINGER_RENDER
    VesselTree *before = sheets->before ? tree_file_load(sheets->before, NULL, faults) : NULL;
    Volume *volume = sheets->volume ? volume_load(sheets->volume, faults) : NULL;
    bool good = (!sheets->before || before) && (!sheets->volume || volume);
    if (before && !vessel_tree_is_model(before)) {
        faults_add(faults, sheets->before, 0, 0, "is a tree without a model; `seldinger fit` makes one");
        good = false;
    }
    if (good)
        draw(sheets, title, model, before, volume);
    volume_free(volume);
    vessel_tree_free(before);
    return good;
#else
    (void)title, (void)faults;
    fprintf(stderr, "%s: no picture: built without pictures\n", sheets->picture);
    return true;
#endif
}
