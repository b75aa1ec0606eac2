// See edit_stretch.h.
#include "recon/edit/edit_stretch.h"

#include "recon/edit/edit_rows.h"

#include <stdlib.h>

enum { ROW_POINTS = 32 };
static const double SAME = 1e-6;             // [mm] stations closer together are one

// At an end of the branch, a stretch has all that lies beyond.
static bool overlaps(const SweepModel *m, const SweepStretch *s, int branch, double from, double to)
{
    const SweepBranch *b = &m->branch[branch];
    double end = m->break_t[b->first_break + b->break_count - 1];
    return s->branch == branch && (s->from <= 0 || s->from < to) && (s->to >= end || s->to > from);
}

int edit_stretch_at(const SweepModel *m, int branch, double from, double to)
{
    for (int i = 0; i < m->stretch_count; i++)
        if (overlaps(m, &m->stretch[i], branch, from, to))
            return i;
    return -1;
}

static void add_row_station(StretchList *list, const SweepModel *m, int branch, double t)
{
    const SweepBranch *b = &m->branch[branch];
    const EditRows rows = {b->break_count, m->break_t + b->first_break, m->row + (size_t)b->first_row * SWEEP_TERMS};
    SectionPoint contour[ROW_POINTS];
    double term[SWEEP_TERMS];
    edit_rows_section(&rows, t, term);
    sweep_terms_contour(term, ROW_POINTS, contour);
    stretch_list_add(list, t, ROW_POINTS, contour);
}

// The new stretch with the stations of those that it replaces: the one at t, and the ends of the range by the rows unless there is a station.
static void add_merged(StretchList *list, const SweepModel *m, const SweepStretch *s, const int *old, int olds, double t, double within, int count,
                       const SectionPoint *contour)
{
    bool is_set = false, has_end = false;
    stretch_list_begin(list, s);
    int first = list->stations;
    if (fabs(t - s->from) > SAME && !(olds > 0 && fabs(m->station[m->stretch[old[0]].first_station].t - s->from) < SAME))
        add_row_station(list, m, s->branch, s->from);
    for (int i = 0; i < olds; i++) {
        const SweepStretch *o = &m->stretch[old[i]];
        for (int k = o->first_station; k < o->first_station + o->station_count; k++) {
            const SweepStation *at = &m->station[k];
            if (!is_set && at->t > t - within)
                stretch_list_add(list, t, count, contour), is_set = true;
            if (fabs(at->t - t) <= within || (list->stations > first && at->t - list->station[list->stations - 1].t < SAME))
                continue;
            stretch_list_add(list, at->t, at->point_count, m->contour + at->first_point);
            has_end |= fabs(at->t - s->to) < SAME;
        }
    }
    if (!is_set)
        stretch_list_add(list, t, count, contour);
    if (!has_end && s->to - t > SAME)
        add_row_station(list, m, s->branch, s->to);
    stretch_list_fade(list);
}

bool edit_stretch_set(SweepModel *m, int branch, double t, double within, int count, const SectionPoint *contour, const char *name, Faults *faults)
{
    const SweepBranch *b = &m->branch[branch];
    const double *at = m->break_t + b->first_break;
    int near = 0, olds = 0, *old = calloc((size_t)m->stretch_count + 1, sizeof *old);
    StretchList list = {.is_incomplete = !old};
    for (int i = 1; i < b->break_count; i++)
        near = fabs(at[i] - t) < fabs(at[near] - t) ? i : near;
    SweepStretch s = {.branch = branch,
                      .from = at[near > 0 ? near - 1 : 0],
                      .to = at[near + 1 < b->break_count ? near + 1 : near],
                      .section = section_default_options(SECTION_RASTER, SECTION_MENDED),
                      .weights = SECTION_PSP,
                      .tension = 0.5,
                      .width = 0.5};
    for (int i = 0; old && i < m->stretch_count; i++)
        if (overlaps(m, &m->stretch[i], branch, s.from, s.to))
            old[olds++] = i;
    if (olds > 0)
        s.from = fmin(s.from, m->stretch[old[0]].from), s.to = fmax(s.to, m->stretch[old[olds - 1]].to), s.section = m->stretch[old[0]].section;
    bool is_in = false;
    for (int i = 0; i < m->stretch_count; i++) {
        const SweepStretch *o = &m->stretch[i];
        if (!is_in && (o->branch > branch || (o->branch == branch && o->to > s.from)))
            add_merged(&list, m, &s, old, olds, t, within, count, contour), is_in = true;
        if (!overlaps(m, o, branch, s.from, s.to))
            stretch_list_copy(&list, o, m->station, m->contour);
    }
    if (!is_in)
        add_merged(&list, m, &s, old, olds, t, within, count, contour);
    bool good = stretch_list_give(&list, m, name, faults);
    stretch_list_free(&list);
    free(old);
    return good;
}

bool edit_stretch_delete(SweepModel *m, int branch, double t, double within, const char *name, Faults *faults)
{
    StretchList list = {0};
    for (int i = 0; i < m->stretch_count; i++) {
        const SweepStretch *s = &m->stretch[i];
        const SweepStation *at = m->station + s->first_station;
        if (!overlaps(m, s, branch, t - within, t + within)) {
            stretch_list_copy(&list, s, m->station, m->contour);
            continue;
        }
        int inner = 0;       // stations that stay between the ends
        for (int k = 0; k < s->station_count; k++)
            inner += fabs(at[k].t - t) > within && at[k].t > s->from + SAME && at[k].t < s->to - SAME;
        if (inner == 0)
            continue;
        stretch_list_begin(&list, s);
        for (int k = 0; k < s->station_count; k++)
            if (fabs(at[k].t - t) > within)
                stretch_list_add(&list, at[k].t, at[k].point_count, m->contour + at[k].first_point);
        stretch_list_fade(&list);
    }
    bool good = stretch_list_give(&list, m, name, faults);
    stretch_list_free(&list);
    return good;
}
