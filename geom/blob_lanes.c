#include "geom/blob_lanes.h"

#include "base/base.h"

#include <string.h>

void blob_groups_fill(BlobGroup *group, const Blobby *model)
{
    SEL_ASSERT(!model->amplitude && !model->index, "groups hold local blobs, in their rows' order");
    int groups = blob_groups_needed(model->count);
    memset(group, 0, (size_t)groups * sizeof *group);
    for (int j = 0; j < model->count; j++) {
        BlobGroup *to = &group[j / BLOB_GROUP];
        int lane = j % BLOB_GROUP;
        double rho = model->width[j];
        SEL_ASSERT(rho > 0, "a blob has a width");
        to->cx[lane] = model->center[j].x;
        to->cy[lane] = model->center[j].y;
        to->cz[lane] = model->center[j].z;
        to->inverse[lane] = 1 / (5 * rho * rho);
        to->rho[lane] = rho;
    }
}
