#include "cli/junction_pages.h"

#include "geom/geom.h"
#include "recon/recon.h"
#include "render/render.h"

#include <stdio.h>
#include <stdlib.h>

enum { COMPARED = 10 };

typedef struct Compared {
    double before;           // [mm] clearance in the other model
    int index;
} Compared;

static int by_before(const void *a, const void *b)
{
    const Compared *x = a, *y = b;
    return x->before != y->before ? (x->before > y->before) - (x->before < y->before) : (x->index > y->index) - (x->index < y->index);
}

// Chooses the junctions that are narrowest in the other model. That model may have other nodes, so the joining lines of this model are used. Returns their
// number, or -1 if out
// of memory.
static int choose_compared(const ModelField *model, const Reach *reach, const ModelField *before, double tool_radius, ReachJunction chosen[COMPARED])
{
    Compared *list = malloc(((size_t)reach->junction_count + 1) * sizeof *list);
    int count = 0;
    for (int k = 0; k < reach->junction_count && list; k++) {
        Vec3 place;
        const ReachJunction *j = &reach->junction[k];
        list[k] = (Compared){reach_on_line(model->tree, j, before, fmax(model->tree->radius[j->node], 2 * tool_radius), &place), k};
    }
    if (list && reach->junction_count > 0)
        qsort(list, (size_t)reach->junction_count, sizeof *list, by_before);
    for (; list && count < COMPARED && count < reach->junction_count; count++)
        chosen[count] = reach->junction[list[count].index];
    bool good = list != NULL;
    free(list);
    return good ? count : -1;
}

static bool draw(const JunctionPages *wanted, const char *title, const ModelField *model, const ModelField *before, const Volume *volume, Faults *faults)
{
    ReachOptions flood = reach_default_options();
    flood.tool_radius = wanted->tool_radius;
    Reach *reach = reach_create(model, &flood);
    ReachJunction chosen[COMPARED];
    PictureOptions options = picture_default_options();
    char message[512] = "out of memory";
    int pages = 0;
    bool drawn = false;
    options.title = title;
    options.width = 1920, options.height = 1360;
    if (reach) {
        PictureJunctions what = {
            .model = model, .junction_count = reach->junction_count, .junction = reach->junction, .tool_radius = wanted->tool_radius, .before = before};
        if (before) {
            int count = choose_compared(model, reach, before, wanted->tool_radius, chosen);
            what.junction_count = count > 0 ? count : 0;
            what.junction = chosen;
        }
        if (volume) {
            for (int k = 0; k < 3; k++)
                what.size[k] = volume->size[k], what.axis[k] = volume->axis[k];
            what.origin = volume->origin;
            what.value = volume->value;
        }
        drawn = picture_of_junctions(wanted->picture, &options, &what, &pages, message, sizeof message);
    }
    if (!drawn)
        faults_add(faults, wanted->picture, 0, 0, "no picture: %s", message);
    reach_free(reach);
    return drawn;
}

bool junction_pages_draw(const JunctionPages *wanted, const char *title, const ModelField *model, Faults *faults)
{
    if (!wanted->picture)
        return true;
    if (!model_field_exists(model)) {
        faults_add(faults, wanted->picture, 0, 0, "no picture: the tree has no fitted model to draw");
        return false;
    }
    ModelFile before = {.kind = -1};
    bool good = !wanted->before || model_file_load_model(wanted->before, -1, &before, faults);
    Volume *volume = wanted->volume ? volume_load(wanted->volume, faults) : NULL;
    good = good && (!wanted->volume || volume) && draw(wanted, title, model, wanted->before ? &before.field : NULL, volume, faults);
    volume_free(volume);
    model_file_free(&before);
    return good;
}
