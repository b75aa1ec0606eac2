// See edit_stretch.h.
#include "recon/edit/edit_stretch.h"

#include "recon/edit/contour_terms.h"
#include "recon/edit/edit_rows.h"

#include <stdlib.h>
#include <string.h>

enum { ROW_POINTS = 32 };
static const double SAME = 1e-6;             // [mm] stations closer together are one

int edit_stretch_at(const SweepModel *m, int branch, double from, double to)
{
    for (int i = 0; i < m->stretch_count; i++)
        if (m->stretch[i].branch == branch && m->stretch[i].from < to && m->stretch[i].to > from)
            return i;
    return -1;
}

// Stretches being put together for a model.
typedef struct Draft {
    SweepStretch *stretch;
    SweepStation *station;
    SectionPoint *contour;
    int stretches, stations, points;
} Draft;

static bool draft_create(const SweepModel *m, int more_points, Draft *d)
{
    *d = (Draft){.stretch = calloc((size_t)m->stretch_count + 1, sizeof *d->stretch),
                 .station = calloc((size_t)m->station_count + 3, sizeof *d->station),
                 .contour = calloc((size_t)m->contour_count + (size_t)more_points + 2 * ROW_POINTS, sizeof *d->contour)};
    return d->stretch && d->station && d->contour;
}

static void draft_free(Draft *d)
{
    free(d->stretch);
    free(d->station);
    free(d->contour);
}

static void add_station(Draft *d, double t, int count, const SectionPoint *contour)
{
    d->station[d->stations++] = (SweepStation){t, d->points, count};
    memcpy(d->contour + d->points, contour, (size_t)count * sizeof *contour);
    d->points += count;
}

static void add_stretch(Draft *d, const SweepModel *m, const SweepStretch *s)
{
    d->stretch[d->stretches] = *s;
    d->stretch[d->stretches++].first_station = d->stations;
    for (int k = s->first_station; k < s->first_station + s->station_count; k++)
        add_station(d, m->station[k].t, m->station[k].point_count, m->contour + m->station[k].first_point);
}

static void add_row_station(Draft *d, const SweepModel *m, int branch, double t)
{
    const SweepBranch *b = &m->branch[branch];
    const EditRows rows = {b->break_count, m->break_t + b->first_break, m->row + (size_t)b->first_row * SWEEP_TERMS};
    SectionPoint contour[ROW_POINTS];
    double term[SWEEP_TERMS];
    edit_rows_section(&rows, t, term);
    for (int i = 0; i < ROW_POINTS; i++) {
        double angle = 2 * PI * i / ROW_POINTS, r = terms_radius(term, angle);
        contour[i] = (SectionPoint){r * same_cos(angle), r * same_sin(angle)};
    }
    add_station(d, t, ROW_POINTS, contour);
}

// The fade covers the first and the last interval, at most half the range.
static void finish_stretch(Draft *d, SweepStretch *s)
{
    const SweepStation *first = d->station + s->first_station;
    s->station_count = d->stations - s->first_station;
    int last = s->station_count - 1;
    double fade = last > 0 ? fmin(first[1].t - first[0].t, first[last].t - first[last - 1].t) : s->to - s->from;
    s->fade = fmin(fade, 0.5 * (s->to - s->from));
}

// The new stretch with the stations of those that it replaces: the one at t, and the ends of the range by the rows unless there is a station.
static void add_merged(Draft *d, const SweepModel *m, SweepStretch s, const int *old, int olds, double t, double within, int count, const SectionPoint *contour)
{
    bool is_set = false, has_end = false;
    s.first_station = d->stations;
    if (fabs(t - s.from) > SAME && !(olds > 0 && fabs(m->station[m->stretch[old[0]].first_station].t - s.from) < SAME))
        add_row_station(d, m, s.branch, s.from);
    for (int i = 0; i < olds; i++) {
        const SweepStretch *o = &m->stretch[old[i]];
        for (int k = o->first_station; k < o->first_station + o->station_count; k++) {
            const SweepStation *at = &m->station[k];
            if (!is_set && at->t > t - within)
                add_station(d, t, count, contour), is_set = true;
            if (fabs(at->t - t) <= within || (d->stations > s.first_station && at->t - d->station[d->stations - 1].t < SAME))
                continue;
            add_station(d, at->t, at->point_count, m->contour + at->first_point);
            has_end |= fabs(at->t - s.to) < SAME;
        }
    }
    if (!is_set)
        add_station(d, t, count, contour);
    if (!has_end && s.to - t > SAME)
        add_row_station(d, m, s.branch, s.to);
    finish_stretch(d, &s);
    d->stretch[d->stretches++] = s;
}

static bool give(SweepModel *m, const Draft *d, const char *name, Faults *faults)
{
    return sweep_model_set_stretches(m, d->stretches, d->stretch, d->stations, d->station, d->points, d->contour, name, faults);
}

bool edit_stretch_set(SweepModel *m, int branch, double t, double within, int count, const SectionPoint *contour, const char *name, Faults *faults)
{
    const SweepBranch *b = &m->branch[branch];
    const double *at = m->break_t + b->first_break;
    int near = 0, olds = 0, *old = calloc((size_t)m->stretch_count + 1, sizeof *old);
    Draft d;
    for (int i = 1; i < b->break_count; i++)
        near = fabs(at[i] - t) < fabs(at[near] - t) ? i : near;
    SweepStretch s = {.branch = branch,
                      .from = at[near > 0 ? near - 1 : 0],
                      .to = at[near + 1 < b->break_count ? near + 1 : near],
                      .section = section_default_options(SECTION_RASTER, SECTION_MENDED),
                      .weights = SECTION_PSP,
                      .tension = 0.5,
                      .width = 0.5};
    bool good = draft_create(m, count, &d) && old;
    for (int i = 0; good && i < m->stretch_count; i++)
        if (m->stretch[i].branch == branch && m->stretch[i].from < s.to && m->stretch[i].to > s.from)
            old[olds++] = i;
    if (olds > 0)
        s.from = fmin(s.from, m->stretch[old[0]].from), s.to = fmax(s.to, m->stretch[old[olds - 1]].to), s.section = m->stretch[old[0]].section;
    bool is_in = false;
    for (int i = 0; good && i < m->stretch_count; i++) {
        const SweepStretch *o = &m->stretch[i];
        if (!is_in && (o->branch > branch || (o->branch == branch && o->to > s.from)))
            add_merged(&d, m, s, old, olds, t, within, count, contour), is_in = true;
        if (o->branch != branch || o->to <= s.from || o->from >= s.to)
            add_stretch(&d, m, o);
    }
    if (good && !is_in)
        add_merged(&d, m, s, old, olds, t, within, count, contour);
    if (!good)
        faults_add(faults, name, 0, 0, "the edit needs more memory than is available");
    good = good && give(m, &d, name, faults);
    draft_free(&d);
    free(old);
    return good;
}

bool edit_stretch_delete(SweepModel *m, int branch, double t, double within, const char *name, Faults *faults)
{
    Draft d;
    bool good = draft_create(m, 0, &d);
    for (int i = 0; good && i < m->stretch_count; i++) {
        SweepStretch s = m->stretch[i];
        int first = s.first_station, inner = 0;
        if (s.branch != branch || s.to <= t - within || s.from >= t + within) {
            add_stretch(&d, m, &s);
            continue;
        }
        int stations = d.stations, points = d.points;
        s.first_station = d.stations;
        for (int k = first; k < first + s.station_count; k++) {
            const SweepStation *at = &m->station[k];
            if (fabs(at->t - t) <= within)
                continue;
            inner += at->t > s.from + SAME && at->t < s.to - SAME;
            add_station(&d, at->t, at->point_count, m->contour + at->first_point);
        }
        if (inner == 0) {
            d.stations = stations, d.points = points;
            continue;
        }
        finish_stretch(&d, &s);
        d.stretch[d.stretches++] = s;
    }
    if (!good)
        faults_add(faults, name, 0, 0, "the edit needs more memory than is available");
    good = good && give(m, &d, name, faults);
    draft_free(&d);
    return good;
}
