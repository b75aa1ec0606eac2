#include "sim/sweep_results.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

const char *const run_status_name[RUN_STATUS_COUNT + 1] = {"done", "diverged", "left", "failed", NULL};

// --- CSV ---

typedef struct Cells {       // of one row, in the copy of the file
    int count;
    char *at[SWEEP_COLUMNS_MOST];
} Cells;

typedef struct Cursor {
    char *at, *end;
    int line;
    const char *path;
    Faults *faults;
    int before;              // faults that were there
} Cursor;

// Reads a row: ends its cells with NUL in place and removes quotes. False at the end of the file or with a fault.
static bool read_row(Cursor *cursor, Cells *cells)
{
    cells->count = 0;
    if (cursor->at >= cursor->end)
        return false;
    cursor->line++;
    for (;;) {
        if (cells->count == SWEEP_COLUMNS_MOST) {
            faults_add(cursor->faults, cursor->path, cursor->line, 0, "has more than %d columns", SWEEP_COLUMNS_MOST);
            return false;
        }
        char *from = cursor->at, *to = from;
        bool is_quoted = from < cursor->end && *from == '"';
        cells->at[cells->count++] = from;
        cursor->at += is_quoted;
        while (cursor->at < cursor->end) {
            char c = *cursor->at;
            if (is_quoted && c == '"' && cursor->at + 1 < cursor->end && cursor->at[1] == '"')
                cursor->at++;
            else if (is_quoted ? c == '"' : c == ',' || c == '\n' || c == '\r')
                break;
            cursor->line += c == '\n';
            *to++ = c;
            cursor->at++;
        }
        if (is_quoted && cursor->at == cursor->end) {
            faults_add(cursor->faults, cursor->path, cursor->line, 0, "a quotation mark is not closed");
            return false;
        }
        cursor->at += is_quoted;
        while (cursor->at < cursor->end && *cursor->at == '\r')
            cursor->at++;
        char end = cursor->at < cursor->end ? *cursor->at++ : '\n';
        if (end != ',' && end != '\n') {
            faults_add(cursor->faults, cursor->path, cursor->line, 0, "a quoted cell is followed by '%c'; expected a comma or the end of the line", end);
            return false;
        }
        *to = 0;
        if (end == '\n')
            return true;
    }
}

// --- the table ---

static int find_status(const char *text)
{
    for (int k = 0; run_status_name[k]; k++)
        if (!strcmp(text, run_status_name[k]))
            return k;
    return -1;
}

static bool read_head(SweepResults *results, Cursor *cursor, Cells *cells)
{
    if (!read_row(cursor, cells)) {
        faults_add(cursor->faults, cursor->path, 1, 0, "is empty; expected the columns run, …, status, message, …");
        return false;
    }
    results->column_count = cells->count;
    results->column = HEAP_ZEROED((size_t)cells->count, sizeof *results->column);
    for (int c = 0; c < cells->count; c++)
        results->column[c].name = cells->at[c];
    results->run = sweep_results_find(results, "run");
    results->status = sweep_results_find(results, "status");
    results->message = sweep_results_find(results, "message");
    int seed = sweep_results_find(results, "hand_seed");
    if (results->run != 0 || results->status < 1 || results->message != results->status + 1 || (seed >= 0 && seed != results->status - 1)) {
        faults_add(cursor->faults, cursor->path, 1, 1,
                   "is no table of a sweep: expected the columns run, the varied keys, hand_seed with random hands, status, message and figures");
        return false;
    }
    results->key_first = 1;
    results->key_count = (seed >= 0 ? seed : results->status) - 1;
    results->figure_first = results->message + 1;
    return true;
}

static void read_body(SweepResults *results, Cursor *cursor, Cells *cells)
{
    int capacity = 0;
    while (cursor->faults->count == cursor->before && read_row(cursor, cells)) {
        int row = results->row_count;
        double number;
        if (cells->count != results->column_count)
            faults_add(cursor->faults, cursor->path, cursor->line, 0, "has %d cells; the heading has %d columns", cells->count, results->column_count);
        else if (!number_of_text(cells->at[0], strlen(cells->at[0]), &number) || number != row)
            faults_add(cursor->faults, cursor->path, cursor->line, 1, "run is '%.40s'; expected %d, one row for each run in order", cells->at[0], row);
        else if (find_status(cells->at[results->status]) < 0)
            faults_add(cursor->faults, cursor->path, cursor->line, 0, "status is '%.40s'; valid: done, diverged, left, failed", cells->at[results->status]);
        if (cursor->faults->count > cursor->before)
            return;
        if (row == capacity) {
            capacity = capacity * 2 + 64;
            for (int c = 0; c < results->column_count; c++)
                results->column[c].text = HEAP_GROWN(results->column[c].text, (size_t)capacity, sizeof *results->column[c].text);
        }
        for (int c = 0; c < results->column_count; c++)
            results->column[c].text[row] = cells->at[c];
        results->row_count++;
    }
}

static int compare_texts(const void *a, const void *b) { return strcmp(*(const char *const *)a, *(const char *const *)b); }

// Numbers texts by the alphabet.
static void number_texts(SweepColumn *column, int rows)
{
    const char **sorted = HEAP_ZEROED((size_t)rows + 1, sizeof *sorted);
    int names = 0;
    for (int i = 0; i < rows; i++)
        sorted[i] = column->text[i];
    qsort(sorted, (size_t)rows, sizeof *sorted, compare_texts);
    for (int i = 0; i < rows; i++)
        if (i == 0 || strcmp(sorted[names - 1], sorted[i]))
            sorted[names++] = sorted[i];
    for (int i = 0; i < rows; i++)
        column->value[i] = (double)((const char **)bsearch(&column->text[i], sorted, (size_t)names, sizeof *sorted, compare_texts) - sorted);
    free(sorted);
}

static void judge_column(const SweepResults *results, SweepColumn *column)
{
    bool has_number = false;
    column->value = HEAP_ZEROED((size_t)results->row_count + 1, sizeof *column->value);
    column->is_number = true;
    for (int i = 0; i < results->row_count; i++) {
        const char *text = column->text[i];
        column->value[i] = NAN;
        if (!*text)
            continue;
        bool is_number = number_of_text(text, strlen(text), &column->value[i]);
        column->is_number &= is_number;
        has_number |= is_number;
    }
    column->is_number &= has_number;
    if (!column->is_number)
        number_texts(column, results->row_count);
    column->least = column->most = NAN;
    for (int i = 0; i < results->row_count; i++)
        if (results->is_done[i]) {
            column->least = fmin(column->least, column->value[i]);
            column->most = fmax(column->most, column->value[i]);
        }
    column->varies = column->most > column->least;
}

SweepResults *sweep_results_parse(const char *text, size_t length, const char *path, Faults *faults)
{
    Cells *cells = HEAP_ZEROED(1, sizeof *cells);
    SweepResults *results = HEAP_ZEROED(1, sizeof *results);
    results->path = HEAP_TEXT(path);
    results->bytes = HEAP_ZEROED(length + 1, 1);
    memcpy(results->bytes, text, length);
    Cursor cursor = {results->bytes, results->bytes + length, 0, path, faults, faults->count};
    if (memchr(text, 0, length))
        faults_add_at_byte(faults, path, (size_t)((const char *)memchr(text, 0, length) - text), "is a zero byte; expected text");
    else if (read_head(results, &cursor, cells))
        read_body(results, &cursor, cells);
    results->is_done = HEAP_ZEROED((size_t)results->row_count + 1, sizeof *results->is_done);
    for (int i = 0; i < results->row_count; i++)
        results->is_done[i] = find_status(results->column[results->status].text[i]) == 0;
    for (int c = 0; c < results->column_count && faults->count == cursor.before; c++)
        judge_column(results, &results->column[c]);
    bool good = faults->count == cursor.before;
    free(cells);
    if (good)
        return results;
    sweep_results_free(results);
    return NULL;
}

SweepResults *sweep_results_load(const char *folder, Faults *faults)
{
    size_t length;
    int before = faults->count;
    char *path = text_file_in(folder, "table.csv"), *text = path ? text_file_read(path, &length, faults) : NULL;
    SweepResults *results = text ? sweep_results_parse(text, length, path, faults) : NULL;
    if (!text && faults->count > before)
        faults_add(faults, folder, 0, 0, "has no table: expected the folder of a finished sweep; `seldinger sweep SPEC.yaml -o %s` begins or goes on", folder);
    free(text);
    free(path);
    return results;
}

void sweep_results_free(SweepResults *results)
{
    if (!results)
        return;
    for (int c = 0; c < results->column_count; c++) {
        free(results->column[c].value);
        free(results->column[c].text);
    }
    free(results->column);
    free(results->is_done);
    free(results->bytes);
    free(results->path);
    free(results);
}

int sweep_results_find(const SweepResults *results, const char *name)
{
    for (int c = 0; c < results->column_count; c++)
        if (!strcmp(results->column[c].name, name))
            return c;
    return -1;
}

int sweep_results_count(const SweepResults *results, const char *status)
{
    int count = 0;
    for (int i = 0; i < results->row_count; i++)
        count += !strcmp(results->column[results->status].text[i], status);
    return count;
}

bool sweep_results_is_figure(const SweepResults *results, int column)
{
    return column >= results->figure_first && column < results->column_count && results->column[column].is_number;
}
