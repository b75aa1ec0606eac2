#include "geom/stretch_list.h"

#include <stdlib.h>
#include <string.h>

void stretch_list_free(StretchList *list)
{
    free(list->stretch);
    free(list->station);
    free(list->contour);
    *list = (StretchList){0};
}

// Makes room for `more` elements after the first `count`; if there is no memory, the list is incomplete.
static void make_room(StretchList *list, void **array, int count, int more, int *room, size_t size)
{
    if (list->is_incomplete || count + more <= *room)
        return;
    int wanted = 2 * *room + more;
    void *grown = realloc(*array, (size_t)wanted * size);
    list->is_incomplete = !grown;
    if (grown)
        *array = grown, *room = wanted;
}

void stretch_list_begin(StretchList *list, const SweepStretch *stretch)
{
    make_room(list, (void **)&list->stretch, list->stretches, 1, &list->stretch_room, sizeof *list->stretch);
    if (list->is_incomplete)
        return;
    SweepStretch *s = &list->stretch[list->stretches++];
    *s = *stretch;
    s->first_station = list->stations, s->station_count = 0;
}

void stretch_list_add(StretchList *list, double t, int count, const SectionPoint *contour)
{
    SEL_ASSERT(list->stretches > 0 || list->is_incomplete, "a station belongs to a stretch");
    make_room(list, (void **)&list->station, list->stations, 1, &list->station_room, sizeof *list->station);
    make_room(list, (void **)&list->contour, list->points, count, &list->point_room, sizeof *list->contour);
    if (list->is_incomplete)
        return;
    list->station[list->stations++] = (SweepStation){t, list->points, count};
    list->stretch[list->stretches - 1].station_count++;
    memcpy(list->contour + list->points, contour, (size_t)count * sizeof *contour);
    list->points += count;
}

void stretch_list_copy(StretchList *list, const SweepStretch *stretch, const SweepStation *station, const SectionPoint *contour)
{
    stretch_list_begin(list, stretch);
    for (int k = stretch->first_station; k < stretch->first_station + stretch->station_count; k++)
        stretch_list_add(list, station[k].t, station[k].point_count, contour + station[k].first_point);
}

void stretch_list_fade(StretchList *list)
{
    if (list->is_incomplete)
        return;
    SEL_ASSERT(list->stretches > 0, "a stretch was begun");
    SweepStretch *s = &list->stretch[list->stretches - 1];
    const SweepStation *first = list->station + s->first_station;
    int last = s->station_count - 1;
    double fade = last > 0 ? fmin(first[1].t - first[0].t, first[last].t - first[last - 1].t) : s->to - s->from;
    s->fade = fmin(fade, 0.5 * (s->to - s->from));
}

bool stretch_list_give(const StretchList *list, SweepModel *model, const char *file, Faults *faults)
{
    if (list->is_incomplete) {
        faults_add(faults, file, 0, 0, "needs more memory than is available (%d stations of sections)", list->stations);
        return false;
    }
    return sweep_model_set_stretches(model, list->stretches, list->stretch, list->stations, list->station, list->points, list->contour, file, faults);
}
