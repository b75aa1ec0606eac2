// See sweep_stretches.h.
#include "recon/fit/sweep_stretches.h"

#include "recon/fit/band_matrix.h"
#include "recon/fit/contour_tour.h"
#include "recon/fit/sweep_sections.h"
#include "recon/fit/sweep_spline.h"

#include <stdlib.h>
#include <string.h>

enum { CONTOUR = 32, PRINTED_CONTOUR = 24, RAYS = 64, AROUND = 16, T = SWEEP_TERMS };
static const double AGREE = 0.01;            // [radii] largest difference of a section from its polar form
static const double TOUR_APART = 0.12, TOUR_NOISE = 4;       // [radii], [noise] distance of the points of a contour through loose points: the larger of the two
static const double SHEETS_APART = 0.35;     // [radii] distance of two sheets of the wall in one direction
// A polar section does not hold the stretch if more than FEW of the station's points are further than OFF [radii] and OFF_NOISE standard deviations of the noise
// from the wall, …
static const double FEW = 0.05, OFF = 0.05, OFF_NOISE = 4;
static const double NEARER = 0.6;            // … and a contour through the points is taken if its mean distance from them is this much less

// A point of a branch in the coordinates of its curve.
typedef struct Loose {
    SectionPoint at;
    double t;
    int station;             // the nearest one of its branch, counted over all branches
    int64_t point;
} Loose;

typedef struct Stations {
    SweepDraft *draft;
    const SweepSystem *system;
    SweepField *field;
    Loose *loose;            // (vessel points) sorted by station
    int64_t *first;          // (stations + 1)
    SweepStation *station;   // (stations) one for each break
    SectionPoint *contour;
    int contour_count, contour_room;
    bool *is_shaped;         // (stations)
    double *polar;           // (stations, T) change of the rows' terms; as printed, the terms
    SweepStretchFigures *figures;
    Faults *faults;
} Stations;

// --- Points by station ---

static void place_point(void *context, long p)
{
    Stations *s = context;
    const SweepDraft *d = s->draft;
    const SweepBranch *b = &d->model->branch[d->owner[p]];
    const double *at = d->model->break_t + b->first_break;
    SweepPart part;
    sweep_field_branch(s->field, d->owner[p], d->point[p], d->t[p], &part);
    int q = 0;
    while (q + 1 < b->break_count && 0.5 * (at[q] + at[q + 1]) < part.t)
        q++;
    s->loose[p] = (Loose){.at = {part.n, part.b}, .t = part.t, .station = part.w == 0 ? b->first_break + q : -1, .point = p};
}

static int compare_loose(const void *a, const void *b)
{
    const Loose *p = a, *q = b;
    return p->station != q->station ? (p->station > q->station) - (p->station < q->station) : (p->point > q->point) - (p->point < q->point);
}

static double station_radius(const Stations *s, int station) { return s->draft->scale[station]; }

// Number of points of a station on the lesser of two sheets of the wall. At forks that is no finding: they lie in the mouth of the other vessel.
static int64_t count_second_sheets(const Stations *s, int station)
{
    double rho[AROUND][64], r = station_radius(s, station);
    int count[AROUND] = {0};
    int64_t found = 0;
    if (s->draft->is_fork[station])
        return 0;
    for (int64_t p = s->first[station]; p < s->first[station + 1]; p++) {
        SectionPoint at = s->loose[p].at;
        int around = (int)((same_atan2(at.b, at.n) / (2 * PI) + 0.5) * AROUND) % AROUND;
        if (count[around] < 64)
            rho[around][count[around]++] = same_hypot(at.n, at.b);
    }
    for (int i = 0; i < AROUND; i++) {
        int step = -1;
        sort_doubles(rho[i], (size_t)count[i]);
        for (int k = 1; k < count[i]; k++)
            if (rho[i][k] - rho[i][k - 1] > SHEETS_APART * r)
                step = k;
        if (step > 0)
            found += step < count[i] - step ? step : count[i] - step;
    }
    return found;
}

// --- Contours ---

static bool add_contour(Stations *s, int station, int count, const SectionPoint *point)
{
    if (s->contour_count + count > s->contour_room) {
        int room = 2 * s->contour_room + count;
        SectionPoint *more = realloc(s->contour, (size_t)room * sizeof *more);
        if (!more)
            return false;
        s->contour = more, s->contour_room = room;
    }
    memcpy(s->contour + s->contour_count, point, (size_t)count * sizeof *point);
    s->station[station].first_point = s->contour_count, s->station[station].point_count = count;
    s->contour_count += count;
    return true;
}

static bool contour_of_rows(Stations *s, int branch, int station)
{
    double term[T];
    SectionPoint point[CONTOUR];
    for (int k = 0; k < T; k++)
        term[k] = sweep_draft_term(s->draft, branch, k, s->station[station].t);
    sweep_terms_contour(term, CONTOUR, point);
    return add_contour(s, station, CONTOUR, point);
}

// The shortest closed polygon through the points beside a station. Returns the number of its points, 0: none around the curve, -1: out of memory.
static int tour_of_points(const Stations *s, int station, double apart_mm, SectionPoint tour[CONTOUR_TOUR_MOST])
{
    int64_t count = s->first[station + 1] - s->first[station];
    SectionPoint *point = malloc(((size_t)count + 1) * sizeof *point);
    if (!point)
        return -1;
    for (int64_t i = 0; i < count; i++)
        point[i] = s->loose[s->first[station] + i].at;
    int kept = contour_tour((int)count, point, apart_mm, tour);
    free(point);
    return kept >= 8 && polygon_contains(kept, tour, 0, 0) ? kept : 0;
}

// A contour as the papers have it: of this station alone, without regard to forks. Points within 0.8 of the distance to the next stations, robust least squares of
// rho = sum_k a_k cos k theta + b_k sin k theta, k <= 5, with a ridge k^4 (shared/rivals.md, section 1); a child's first part repeats the tree's radius, and so
// does a station with hardly any points. No ray is shorter than LEAST of that radius: the contour surrounds the curve. The station's terms are those of the contour.
static bool contour_of_station(Stations *s, int branch, int station, bool *is_mended)
{
    enum { HARMONICS = 5, TERMS = 2 * HARMONICS + 1, ROUNDS = 4 };
    static const double REACH = 0.8, RIDGE = 1e-4, KNEE = 0.1, SKIP = 0.7, LEAST = 0.1;
    const SweepBranch *b = &s->draft->model->branch[branch];
    int first = station > b->first_break ? station - 1 : station, last = station + 1 < b->first_break + b->break_count ? station + 1 : station;
    double t = s->station[station].t, reach = REACH * (s->station[last].t - s->station[first].t) / (last - first), term[T] = {0}, matrix[TERMS * TERMS],
           c[TERMS] = {0};
    double hidden = b->parent >= 0 ? SKIP * sweep_draft_radius(s->draft, b->parent, b->parent_t) : -HUGE_VAL, r = sweep_draft_radius(s->draft, branch, t);
    *is_mended = false;
    c[0] = r;
    for (int round = 0; round < ROUNDS && t >= hidden; round++) {
        double next[TERMS] = {0}, basis[TERMS], sum = 0;
        memset(matrix, 0, sizeof matrix);
        for (int64_t p = s->first[first]; p < s->first[last + 1]; p++) {
            double y = (s->loose[p].t - t) / reach, rho = same_hypot(s->loose[p].at.n, s->loose[p].at.b),
                   theta = same_atan2(s->loose[p].at.b, s->loose[p].at.n), e = -rho;
            if (!(fabs(y) < 1))
                continue;
            for (int k = 0; k < TERMS; k++) {
                int harmonic = (k + 1) / 2;
                basis[k] = k % 2 ? same_cos(harmonic * theta) : k > 0 ? same_sin(harmonic * theta) : 1;
                e += c[k] * basis[k];
            }
            double w = same_square(1 - y * y) * (round > 0 ? sweep_trust_of(e, s->system->noise, KNEE * r) : 1);
            sum += w;
            for (int k = 0; k < TERMS; k++) {
                next[k] += w * basis[k] * rho;
                for (int j = k; j < TERMS; j++)
                    matrix[k * TERMS + j - k] += w * basis[k] * basis[j];
            }
        }
        for (int k = 1; k < TERMS; k++)
            matrix[k * TERMS] += RIDGE * sum * same_square(same_square((k + 1) / 2));
        if (!(sum > 1) || !band_factor(matrix, TERMS, TERMS - 1)) {
            *is_mended = round == 0;
            break;
        }
        band_solve(matrix, TERMS, TERMS - 1, next);
        memcpy(c, next, sizeof c);
    }
    memcpy(term, c, sizeof c);
    SectionPoint point[PRINTED_CONTOUR];
    double radius[PRINTED_CONTOUR];
    for (int i = 0; i < PRINTED_CONTOUR; i++) {
        double theta = 2 * PI * i / PRINTED_CONTOUR, rho = sweep_terms_radius(term, theta);
        *is_mended |= rho < LEAST * r;
        radius[i] = fmax(rho, LEAST * r);
        point[i] = (SectionPoint){radius[i] * same_cos(theta), radius[i] * same_sin(theta)};
    }
    sweep_terms_of_radii(PRINTED_CONTOUR, radius, s->polar + (size_t)station * T);
    return add_contour(s, station, PRINTED_CONTOUR, point);
}

// --- Mended kinds ---

static SectionOptions station_options(const Stations *s)
{
    SectionOptions options = s->draft->options->section;
    if (options.kind == SECTION_POLAR)
        options.kind = SECTION_RASTER;
    return options;
}

// Whether the section agrees with a polar one; its terms less those of the rows.
static bool compile(Stations *s, int branch, int station, const Section *section)
{
    double radius[RAYS], *change = s->polar + (size_t)station * T, most = 0;
    if (section_radii(section, 0, 0, RAYS, radius) != 0)
        return false;
    sweep_terms_of_radii(RAYS, radius, change);
    for (int i = 0; i < RAYS; i++)
        most = fmax(most, fabs(sweep_terms_radius(change, 2 * PI * i / RAYS) - radius[i]));
    for (int k = 0; k < T; k++)
        change[k] -= sweep_draft_term(s->draft, branch, k, s->station[station].t);
    return most <= AGREE * station_radius(s, station);
}

// Whether the rows leave points of a station on a tube off the wall. At forks that is no finding: they lie in the mouth of the other vessel.
static bool rows_miss_points(const Stations *s, int station)
{
    double off = fmax(OFF * station_radius(s, station), OFF_NOISE * s->system->noise);
    int64_t missed = 0, points = s->first[station + 1] - s->first[station];
    for (int64_t p = s->first[station]; p < s->first[station + 1]; p++)
        missed += fabs(s->system->distance[s->loose[p].point]) > off;
    return !s->draft->is_fork[station] && (double)missed > FEW * (double)points;
}

// Mean distance of a station's points from a section's curve, and from the wall of the rows.
static void mean_distances(const Stations *s, int station, const Section *section, double *of_section, double *of_rows)
{
    *of_section = *of_rows = 0;
    for (int64_t p = s->first[station]; p < s->first[station + 1]; p++) {
        *of_section += fabs(section_evaluate(section, s->loose[p].at.n, s->loose[p].at.b).value);
        *of_rows += fabs(s->system->distance[s->loose[p].point]);
    }
}

// A section of the station's contour, at first through its points if the rows missed them. NULL with faults.
static Section *make_section(Stations *s, int branch, int station, bool missed)
{
    SectionOptions options = station_options(s);
    SweepStation *at = &s->station[station];
    Section *section = NULL;
    if (missed) {
        double of_section, of_rows;
        SectionPoint tour[CONTOUR_TOUR_MOST];
        int kept = s->contour_count, points = tour_of_points(s, station, fmax(TOUR_APART * station_radius(s, station), TOUR_NOISE * s->system->noise), tour);
        if (points < 0 || !(points > 0 ? add_contour(s, station, points, tour) : contour_of_rows(s, branch, station)))
            return NULL;
        section = section_create(&options, at->point_count, s->contour + at->first_point);
        if (section)
            mean_distances(s, station, section, &of_section, &of_rows);
        s->is_shaped[station] = section && of_section < NEARER * of_rows;
        if (s->is_shaped[station])
            return section;
        section_free(section);
        s->contour_count = kept;
    }
    if (!contour_of_rows(s, branch, station))
        return NULL;
    section = section_create(&options, at->point_count, s->contour + at->first_point);
    if (!section)
        faults_add(s->faults, "fit", 0, 0, "no section of kind %s can be made from %d points at t = %g mm of branch %d", section_kind_name[options.kind],
                   at->point_count, at->t, branch);
    return section;
}

static bool fit_station(Stations *s, int branch, int station)
{
    SweepStretchFigures *f = s->figures;
    f->second_sheets += count_second_sheets(s, station);
    bool missed = rows_miss_points(s, station);
    if (s->draft->options->section.kind == SECTION_POLAR && !missed)
        return contour_of_rows(s, branch, station);
    Section *section = make_section(s, branch, station, missed);
    if (!section)
        return false;
    if (s->draft->options->section.kind == SECTION_POLAR) {
        section_free(section);
        return true;
    }
    f->numbers += section_numbers(section);
    s->is_shaped[station] |= !compile(s, branch, station, section);
    if (s->is_shaped[station])
        memset(s->polar + (size_t)station * T, 0, T * sizeof(double));
    section_free(section);
    return true;
}

// Adds to the rows of a branch the cubic spline through the stations' changes of one term, with slope 0 at both ends.
static void move_rows(Stations *s, int branch, int term, double *x, double *upper)
{
    const SweepBranch *b = &s->draft->model->branch[branch];
    const double *at = s->draft->model->break_t + b->first_break, *change = s->polar + (size_t)b->first_break * T + term;
    int m = b->break_count;
    double value[4], slope[4], bend[4];
    x[0] = x[1] = change[0], x[m] = x[m + 1] = change[(size_t)(m - 1) * T];
    upper[1] = 0;
    for (int q = 1; q < m - 1; q++) {        // unknown q + 1
        sweep_spline(at, m, at[q], value, slope, bend);
        double pivot = value[1] - value[0] * upper[q];
        upper[q + 1] = value[2] / pivot;
        x[q + 1] = (change[(size_t)q * T] - value[0] * x[q]) / pivot;
    }
    for (int q = m - 2; q >= 1; q--)
        x[q + 1] -= upper[q + 1] * x[q + 2];
    for (int k = 0; k < m + 2; k++)
        s->draft->model->row[(size_t)(b->first_row + k) * T + (size_t)term] += x[k];
}

static int within(int k, int last) { return k < 0 ? 0 : k > last ? last : k; }

// Lays the rows of a branch between the stations' terms, by Schoenberg's operator: each row has the terms of its place, the mean of its three knots, on the line
// between the stations beside it. Exact for tapers, and never beyond the stations: the spline through them swings below 0 at a child's start, whose rows no point
// has seen.
static void lay_rows(const Stations *s, int branch)
{
    const SweepBranch *b = &s->draft->model->branch[branch];
    const double *at = s->draft->model->break_t + b->first_break;
    int last = b->break_count - 1;
    for (int k = 0, q = 0; k < b->break_count + 2; k++) {
        double place = (at[within(k - 2, last)] + at[within(k - 1, last)] + at[within(k, last)]) / 3;
        while (q + 1 < last && at[q + 1] < place)
            q++;
        double share = (place - at[q]) / (at[q + 1] - at[q]);
        const double *before = s->polar + (size_t)(b->first_break + q) * T;
        for (int j = 0; j < T; j++)
            s->draft->model->row[(size_t)(b->first_row + k) * T + (size_t)j] = before[j] + share * (before[T + j] - before[j]);
    }
}

// --- Stretches ---

static bool move_all_rows(Stations *s)
{
    const SweepModel *m = s->draft->model;
    double *scratch = malloc(2 * ((size_t)m->row_count + 2) * sizeof *scratch);
    for (int i = 0; scratch && i < m->branch_count; i++)
        for (int k = 0; k < T; k++)
            move_rows(s, i, k, scratch, scratch + m->row_count + 2);
    free(scratch);
    return scratch != NULL;
}

// The stretches of one branch: runs of shaped stations, each with a neighbour on either side, over which it fades.
static int find_stretches(const Stations *s, int branch, SweepStretch *stretch)
{
    const SweepBranch *b = &s->draft->model->branch[branch];
    const double *at = s->draft->model->break_t + b->first_break;
    int last = b->break_count - 1, found = 0;
    for (int q = 0; q <= last; q++) {
        if (!s->is_shaped[b->first_break + q])
            continue;
        int end = q;
        while (end < last && (s->is_shaped[b->first_break + end + 1] || (end + 2 <= last && s->is_shaped[b->first_break + end + 2])))
            end++;
        int from = q > 0 ? q - 1 : 0, to = end < last ? end + 1 : last;
        double fade = fmin(at[from + 1] - at[from], at[to] - at[to - 1]);
        stretch[found++] = (SweepStretch){.branch = branch,
                                          .from = at[from],
                                          .to = at[to],
                                          .fade = fmin(fade, 0.5 * (at[to] - at[from])),
                                          .first_station = b->first_break + from,
                                          .station_count = to - from + 1,
                                          .section = station_options(s),
                                          .weights = SECTION_PSP,
                                          .tension = 0.5,
                                          .width = 0.5};
        q = to;
    }
    return found;
}

// As printed: one stretch for the whole branch, except for the domes at closed ends.
static SweepStretch whole_branch(const Stations *s, int branch)
{
    static const double TENSION = 0.7, WIDTH = 0.25;     // Kretschmer et al.; Hong et al. leave delta open, half of what would be exact for tapers is taken
    const SweepBranch *b = &s->draft->model->branch[branch];
    double length = s->draft->model->break_t[b->first_break + b->break_count - 1];
    SectionKind kind = s->draft->options->section.kind;
    return (SweepStretch){.branch = branch,
                          .to = length,
                          .fade = fmin(b->radius, 0.25 * length),
                          .first_station = b->first_break,
                          .station_count = b->break_count,
                          .section = s->draft->options->section,
                          .weights = kind == SECTION_RASTER ? SECTION_CATMULL_ROM : SECTION_PSP,
                          .tension = TENSION,
                          .width = WIDTH,
                          .is_straight = kind == SECTION_PAS};
}

// Gives the model the stretches, whose first stations are those of the breaks.
static bool set_stretches(Stations *s, int count, const SweepStretch *stretch)
{
    StretchList list = {0};
    for (int i = 0; i < count; i++)
        stretch_list_copy(&list, &stretch[i], s->station, s->contour);
    s->figures->stations = list.stations;
    bool good = stretch_list_give(&list, s->draft->model, "fit", s->faults);
    stretch_list_free(&list);
    return good;
}

static bool fit_mended(Stations *s)
{
    SweepModel *m = s->draft->model;
    SweepStretch *stretch = malloc(((size_t)m->break_count + 1) * sizeof *stretch);
    int stretches = 0;
    bool good = stretch != NULL;
    for (int i = 0; good && i < m->branch_count; i++) {
        for (int q = m->branch[i].first_break; good && q < m->branch[i].first_break + m->branch[i].break_count; q++)
            good = fit_station(s, i, q);
        stretches += good ? find_stretches(s, i, stretch + stretches) : 0;
    }
    good = good && (s->draft->options->section.kind == SECTION_POLAR || move_all_rows(s));
    good = good && set_stretches(s, stretches, stretch);
    free(stretch);
    return good;
}

// Replaces a station's contour by one through the raw points beside it, unless they give no section around the curve. Returns false if out of memory.
static bool take_raw_points(Stations *s, int station, bool *is_mended)
{
    SectionPoint tour[CONTOUR_TOUR_MOST];
    int points = tour_of_points(s, station, 1e-9 * station_radius(s, station), tour);
    Section *section = points > 0 ? section_create(&s->draft->options->section, points, tour) : NULL;
    *is_mended = !section;
    section_free(section);
    return points >= 0 && (!section || add_contour(s, station, points, tour));
}

static bool fit_printed(Stations *s)
{
    SweepModel *m = s->draft->model;
    SweepStretch *stretch = malloc((size_t)m->branch_count * sizeof *stretch);
    bool good = stretch != NULL, raw = s->draft->options->section.kind == SECTION_RBF;
    for (int i = 0; good && i < m->branch_count; i++) {
        stretch[i] = whole_branch(s, i);
        for (int q = m->branch[i].first_break; good && q < m->branch[i].first_break + m->branch[i].break_count; q++) {
            bool is_mended;
            good = contour_of_station(s, i, q, &is_mended) && (!raw || take_raw_points(s, q, &is_mended));
            s->figures->mended += good && is_mended;
        }
        if (good)
            lay_rows(s, i);
    }
    good = good && set_stretches(s, m->branch_count, stretch);
    for (int i = 0; good && i < m->station_count; i++)
        s->figures->numbers += section_numbers(m->section[i]);
    free(stretch);
    return good;
}

int sweep_stretches_keep_better(SweepDraft *d, const SweepSystem *system, const double *before, SweepStretchFigures *figures, Faults *faults)
{
    SweepModel *m = d->model;
    StretchList list = {0};
    for (int i = 0; i < m->stretch_count; i++) {
        double with = 0, without = 0;
        const SweepStretch *s = &m->stretch[i];
        for (int64_t p = 0; p < d->vessel_point_count; p++)
            if (d->owner[p] == s->branch && d->t[p] > s->from && d->t[p] < s->to)
                with += fabs(system->distance[p]), without += fabs(before[p]);
        if (with < NEARER * without)
            stretch_list_copy(&list, s, m->station, m->contour);
    }
    int dropped = m->stretch_count - list.stretches;
    bool good = dropped == 0 || stretch_list_give(&list, m, "fit", faults);
    figures->stations = m->station_count;
    stretch_list_free(&list);
    return good ? dropped : -1;
}

bool sweep_stretches_fit(SweepDraft *d, const SweepSystem *system, SweepStretchFigures *figures, Faults *faults)
{
    SweepModel *m = d->model;
    size_t stations = (size_t)m->break_count;
    *figures = (SweepStretchFigures){0};
    Stations s = {.draft = d, .system = system, .field = sweep_field_create(m), .figures = figures, .faults = faults};
    s.loose = malloc(((size_t)d->vessel_point_count + 1) * sizeof *s.loose);
    s.first = calloc(stations + 1, sizeof *s.first);
    s.station = calloc(stations, sizeof *s.station);
    s.is_shaped = calloc(stations, sizeof *s.is_shaped);
    s.polar = calloc(stations * T, sizeof *s.polar);
    bool good = s.field && s.loose && s.first && s.station && s.is_shaped && s.polar;
    if (good) {
        parallel_for(d->options->threads, (long)d->vessel_point_count, place_point, &s, NULL);
        qsort(s.loose, (size_t)d->vessel_point_count, sizeof *s.loose, compare_loose);
        int64_t p = 0;
        for (int i = 0; i <= m->break_count; i++) {
            while (p < d->vessel_point_count && s.loose[p].station < i)
                p++;
            s.first[i] = p;
        }
        for (int i = 0; i < m->break_count; i++)
            s.station[i].t = m->break_t[i];
        good = d->options->section.form == SECTION_AS_PRINTED ? fit_printed(&s) : fit_mended(&s);
    }
    if (!good && faults->count == 0)
        faults_add(faults, "fit", 0, 0, "not enough memory");
    sweep_field_free(s.field);
    free(s.loose);
    free(s.first);
    free(s.station);
    free(s.contour);
    free(s.is_shaped);
    free(s.polar);
    return good;
}
