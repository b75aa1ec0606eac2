// Stretches of a swept model (sweep_model.h) that are put together, station by station, before they are given to a model.
#ifndef SELDINGER_GEOM_STRETCH_LIST_H
#define SELDINGER_GEOM_STRETCH_LIST_H

#include "geom/sweep_model.h"

typedef struct StretchList {
    int stretches, stations, points;
    SweepStretch *stretch;   // (stretches)
    SweepStation *station;   // (stations)
    SectionPoint *contour;   // (points)
    int stretch_room, station_room, point_room;
    bool is_incomplete;      // out of memory: stretch_list_give reports it
} StretchList;               // zero: empty

void stretch_list_free(StretchList *list);
// Begins a stretch like `stretch`, without its stations; those added next belong to it.
void stretch_list_begin(StretchList *list, const SweepStretch *stretch);
void stretch_list_add(StretchList *list, double t, int count, const SectionPoint *contour);
// Adds a stretch with its stations, which are those of `station` from stretch->first_station on.
void stretch_list_copy(StretchList *list, const SweepStretch *stretch, const SweepStation *station, const SectionPoint *contour);
// The last stretch fades over its first and its last interval between stations, at most half its range.
void stretch_list_fade(StretchList *list);
// sweep_model_set_stretches with the list. Returns false with faults.
bool stretch_list_give(const StretchList *list, SweepModel *model, const char *file, Faults *faults);

#endif
