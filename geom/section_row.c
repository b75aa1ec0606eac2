#include "geom/section_row.h"

#include "geom/section_kinds.h"

#include <math.h>

// The station at or before t; 0 if t lies before all.
static int station_before(const SectionRow *row, double t)
{
    int low = 0, high = row->count - 1;
    while (low < high) {
        int middle = (low + high + 1) / 2;
        if (row->t[middle] <= t)
            low = middle;
        else
            high = middle - 1;
    }
    return low;
}

static int clamped(const SectionRow *row, int station) { return station < 0 ? 0 : station >= row->count ? row->count - 1 : station; }

static void add_share(SectionShares *shares, int station, double w, double w1, double w2)
{
    int at = station - shares->first;
    SEL_ASSERT(at >= 0 && at < SECTION_ROW_PARTS, "a weight belongs to a section near t");
    shares->w[at] += w, shares->w1[at] += w1, shares->w2[at] += w2;
    shares->count = at + 1 > shares->count ? at + 1 : shares->count;
}

static SectionShares catmull_rom(const SectionRow *row, double t)
{
    int i = station_before(row, t);
    SectionShares shares = {.first = clamped(row, i - 1)};
    if (t <= row->t[0] || i == row->count - 1) {
        add_share(&shares, i, 1, 0, 0);
        return shares;
    }
    double per = 1 / (row->t[i + 1] - row->t[i]), u = (t - row->t[i]) * per, tau = row->tension;
    const double p[4][4] = {{0, -tau, 2 * tau, -tau}, {1, 0, tau - 3, 2 - tau}, {0, tau, 3 - 2 * tau, tau - 2}, {0, 0, -tau, tau}};
    for (int k = 0; k < 4; k++)
        add_share(&shares, clamped(row, i - 1 + k), p[k][0] + u * (p[k][1] + u * (p[k][2] + u * p[k][3])),
                  (p[k][1] + u * (2 * p[k][2] + 3 * u * p[k][3])) * per, (2 * p[k][2] + 6 * u * p[k][3]) * per * per);
    return shares;
}

static SectionShares piecewise(const SectionRow *row, double t)
{
    // The step from section j - 1 to j reaches 3 delta, at most 1.5 of their distance, to either side of the middle.
    int i = station_before(row, t), first = i, last = i;
    while (first > 0 && i - first < SECTION_ROW_PARTS / 2) {
        double d = row->t[first] - row->t[first - 1];
        if (t - 0.5 * (row->t[first] + row->t[first - 1]) >= 3 * row->width * d)
            break;
        first--;
    }
    while (last < row->count - 1 && last - first < SECTION_ROW_PARTS - 1) {
        double d = row->t[last + 1] - row->t[last];
        if (0.5 * (row->t[last + 1] + row->t[last]) - t >= 3 * row->width * d)
            break;
        last++;
    }
    SectionShares shares = {.first = first};
    double before[4] = {1, 0, 0, 0};
    for (int j = first; j <= last; j++) {
        double after[4] = {0, 0, 0, 0};
        if (j < last) {
            double d = row->t[j + 1] - row->t[j], per = 1 / (row->width * d);
            section_step((t - 0.5 * (row->t[j + 1] + row->t[j])) * per, after);
            after[1] *= per, after[2] *= per * per;
        }
        add_share(&shares, j, before[0] - after[0], before[1] - after[1], before[2] - after[2]);
        for (int k = 0; k < 3; k++)
            before[k] = after[k];
    }
    return shares;
}

SectionShares section_row_shares(const SectionRow *row, double t)
{
    SEL_ASSERT(row->count >= 1 && isfinite(t), "a row has a section");
    return row->weights == SECTION_CATMULL_ROM ? catmull_rom(row, t) : piecewise(row, t);
}

SectionRowJet section_row_evaluate(const SectionRow *row, double n, double b, double t)
{
    SectionShares shares = section_row_shares(row, t);
    SectionRowJet jet = {0};
    for (int k = 0; k < shares.count; k++) {
        if (shares.w[k] == 0 && shares.w1[k] == 0 && shares.w2[k] == 0)
            continue;
        SectionJet c = section_evaluate(row->section[shares.first + k], n, b);
        double w = shares.w[k], w1 = shares.w1[k];
        jet.value += w * c.value, jet.n += w * c.n, jet.b += w * c.b;
        jet.nn += w * c.nn, jet.nb += w * c.nb, jet.bb += w * c.bb;
        jet.t += w1 * c.value, jet.nt += w1 * c.n, jet.bt += w1 * c.b, jet.tt += shares.w2[k] * c.value;
    }
    return jet;
}
