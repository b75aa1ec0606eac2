// See edit_rows.h. With weights A (stations x rows) of the held sections and the errors e, the smallest change is A' (A A')^-1 e.
#include "recon/edit/edit_rows.h"

#include "recon/fit/sweep_spline.h"

#include <stdlib.h>
#include <string.h>

static double knot(const EditRows *r, int i) { return r->at[i < 3 ? 0 : i - 3 >= r->breaks ? r->breaks - 1 : i - 3]; }

bool edit_rows_take(const SweepModel *m, int branch, EditRows *r)
{
    SEL_ASSERT(branch >= 0 && branch < m->branch_count, "the branch is one of the model");
    const SweepBranch *b = &m->branch[branch];
    size_t rows = (size_t)b->break_count + 2;
    *r = (EditRows){b->break_count, calloc(rows, sizeof *r->at), calloc((rows + 1) * SWEEP_TERMS, sizeof *r->row)};
    if (!r->at || !r->row) {
        edit_rows_free(r);
        return false;
    }
    memcpy(r->at, m->break_t + b->first_break, (size_t)b->break_count * sizeof *r->at);
    memcpy(r->row, m->row + (size_t)b->first_row * SWEEP_TERMS, rows * SWEEP_TERMS * sizeof *r->row);
    return true;
}

void edit_rows_free(EditRows *r)
{
    free(r->at);
    free(r->row);
    *r = (EditRows){0};
}

void edit_rows_section(const EditRows *r, double t, double term[SWEEP_TERMS])
{
    double weight[4], slope[4], bend[4];
    int first = sweep_spline(r->at, r->breaks, t, weight, slope, bend);
    for (int k = 0; k < SWEEP_TERMS; k++) {
        term[k] = 0;
        for (int j = 0; j < 4; j++)
            term[k] += weight[j] * r->row[(size_t)(first + j) * SWEEP_TERMS + (size_t)k];
    }
}

// The span that holds t: at[span] <= t < at[span + 1], except at the end.
static int span_of(const EditRows *r, double t)
{
    int low = 0, high = r->breaks - 1;
    while (high - low > 1) {
        int middle = (low + high) / 2;
        if (r->at[middle] <= t)
            low = middle;
        else
            high = middle;
    }
    return low;
}

int edit_rows_station(const EditRows *r, double t, double *within)
{
    int span = span_of(r, t);
    *within = 0.25 * (r->at[span + 1] - r->at[span]);
    return t - r->at[span] <= r->at[span + 1] - t ? span : span + 1;
}

void edit_rows_insert(EditRows *r, double t)
{
    int span = span_of(r, t), rows = r->breaks + 2;
    SEL_ASSERT(t > r->at[span] && t < r->at[span + 1], "a break is inserted between two others");
    double blend[3][SWEEP_TERMS];
    for (int j = 0; j < 3; j++) {
        int i = span + 1 + j;
        double a = (t - knot(r, i)) / (knot(r, i + 3) - knot(r, i));
        for (int k = 0; k < SWEEP_TERMS; k++)
            blend[j][k] = (1 - a) * r->row[(size_t)(i - 1) * SWEEP_TERMS + (size_t)k] + a * r->row[(size_t)i * SWEEP_TERMS + (size_t)k];
    }
    double *from = r->row + (size_t)(span + 3) * SWEEP_TERMS;
    memmove(from + SWEEP_TERMS, from, (size_t)(rows - span - 3) * SWEEP_TERMS * sizeof *from);
    memcpy(r->row + (size_t)(span + 1) * SWEEP_TERMS, blend, sizeof blend);
    memmove(r->at + span + 2, r->at + span + 1, (size_t)(r->breaks - span - 1) * sizeof *r->at);
    r->at[span + 1] = t;
    r->breaks++;
}

void edit_rows_remove(EditRows *r, int at)
{
    SEL_ASSERT(at > 0 && at < r->breaks - 1, "the sections at the ends stay");
    double *gone = r->row + (size_t)(at + 1) * SWEEP_TERMS;
    memmove(gone, gone + SWEEP_TERMS, (size_t)(r->breaks - at) * SWEEP_TERMS * sizeof *gone);
    memmove(r->at + at, r->at + at + 1, (size_t)(r->breaks - at - 1) * sizeof *r->at);
    r->breaks--;
}

double edit_rows_place(const EditRows *r, int row) { return (knot(r, row + 1) + knot(r, row + 2) + knot(r, row + 3)) / 3; }

// Solves a x = b for SWEEP_TERMS right sides at once, with the largest pivot. False if a is singular.
static bool solve(int n, double a[EDIT_MOST_HELD][EDIT_MOST_HELD], double b[EDIT_MOST_HELD][SWEEP_TERMS])
{
    for (int c = 0; c < n; c++) {
        int pivot = c;
        for (int i = c + 1; i < n; i++)
            if (fabs(a[i][c]) > fabs(a[pivot][c]))
                pivot = i;
        if (!(fabs(a[pivot][c]) > 1e-12))
            return false;
        for (int k = 0; k < n; k++) {
            double kept = a[c][k];
            a[c][k] = a[pivot][k], a[pivot][k] = kept;
        }
        for (int k = 0; k < SWEEP_TERMS; k++) {
            double kept = b[c][k];
            b[c][k] = b[pivot][k], b[pivot][k] = kept;
        }
        for (int i = c + 1; i < n; i++) {
            double factor = a[i][c] / a[c][c];
            for (int k = c; k < n; k++)
                a[i][k] -= factor * a[c][k];
            for (int k = 0; k < SWEEP_TERMS; k++)
                b[i][k] -= factor * b[c][k];
        }
    }
    for (int c = n - 1; c >= 0; c--)
        for (int k = 0; k < SWEEP_TERMS; k++) {
            for (int i = c + 1; i < n; i++)
                b[c][k] -= a[c][i] * b[i][k];
            b[c][k] /= a[c][c];
        }
    return true;
}

bool edit_rows_hold(EditRows *r, int first, int last, const HeldSections *held)
{
    enum { MOST_ROWS = 8 };
    first = first < 0 ? 0 : first, last = last > r->breaks + 1 ? r->breaks + 1 : last;
    SEL_ASSERT(held->count >= 1 && held->count <= EDIT_MOST_HELD && last >= first && last - first < MOST_ROWS, "a few sections, held by a few rows");
    double weight[EDIT_MOST_HELD][MOST_ROWS] = {{0}}, product[EDIT_MOST_HELD][EDIT_MOST_HELD] = {{0}}, error[EDIT_MOST_HELD][SWEEP_TERMS];
    int n = 0;
    for (int i = 0; i < held->count; i++) {
        double value[4], slope[4], bend[4], now[SWEEP_TERMS], reach = 0;
        int at = sweep_spline(r->at, r->breaks, held->t[i], value, slope, bend);
        for (int j = 0; j < 4; j++)
            if (at + j >= first && at + j <= last)
                weight[n][at + j - first] = value[j], reach += value[j];
        // a section that these rows do not touch stays anyway
        if (reach < 1e-9) {
            memset(weight[n], 0, sizeof weight[n]);
            continue;
        }
        edit_rows_section(r, held->t[i], now);
        for (int k = 0; k < SWEEP_TERMS; k++)
            error[n][k] = held->target[i][k] - now[k];
        n++;
    }
    for (int i = 0; i < n; i++)
        for (int k = 0; k < n; k++)
            for (int j = 0; j <= last - first; j++)
                product[i][k] += weight[i][j] * weight[k][j];
    if (!solve(n, product, error))
        return false;
    for (int j = 0; j <= last - first; j++)
        for (int k = 0; k < SWEEP_TERMS; k++)
            for (int i = 0; i < n; i++)
                r->row[(size_t)(first + j) * SWEEP_TERMS + (size_t)k] += weight[i][j] * error[i][k];
    return true;
}
