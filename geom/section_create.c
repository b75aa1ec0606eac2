#include "geom/section_kinds.h"

#include <stdlib.h>

const char *const section_kind_name[SECTION_KINDS + 1] = {"polar", "raster", "rbf", "pas", NULL};

enum { CONTOUR_MOST = 4096 };

SectionOptions section_default_options(SectionKind kind, SectionForm form)
{
    return (SectionOptions){.kind = kind, .form = form, .harmonics = 8, .stiffness = form == SECTION_AS_PRINTED ? 0 : 1e-3, .voxel_mm = 1};
}

static double mean_radius(int count, const SectionPoint *contour)
{
    double sum = 0;
    for (int i = 0; i < count; i++)
        sum += same_hypot(contour[i].n, contour[i].b);
    return sum / count;
}

static bool options_are_valid(const SectionOptions *o)
{
    return o->harmonics >= 0 && o->harmonics <= 16 && o->stiffness >= 0 && o->stiffness < 1e6 && o->delta_mm >= 0 && o->delta_mm < 1e3 && o->voxel_mm > 0 &&
           o->voxel_mm < 1e3;
}

Section *section_create(const SectionOptions *options, int count, const SectionPoint *contour)
{
    static Section *(*const create[SECTION_KINDS])(const SectionOptions *, int, const SectionPoint *, double) = {section_polar_create, section_raster_create,
                                                                                                                 section_rbf_create, section_pas_create};
    if ((unsigned)options->kind >= SECTION_KINDS || !options_are_valid(options) || count < 3 || count > CONTOUR_MOST)
        return NULL;
    for (int i = 0; i < count; i++)
        if (!(fabs(contour[i].n) < 1e6 && fabs(contour[i].b) < 1e6))
            return NULL;
    double area = polygon_area(count, contour), radius = mean_radius(count, contour);
    if (!(fabs(area) > 1e-9 * radius * radius))
        return NULL;
    SectionPoint *turned = malloc((size_t)count * sizeof *turned);
    if (!turned)
        return NULL;
    for (int i = 0; i < count; i++)
        turned[i] = contour[area > 0 ? i : count - 1 - i];
    Section *section = create[options->kind](options, count, turned, radius);
    free(turned);
    return section;
}
