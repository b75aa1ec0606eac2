#include "base/number_table.h"

#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef struct Cursor {
    const char *at, *end;    // the rest of the file
    const char *file, *header;
    Faults *faults;
    int line;
} Cursor;

typedef NumberColumn Field;

bool number_of_text(const char *text, size_t length, double *value)
{
    char copy[64];
    if (length == 0 || length >= sizeof copy)
        return false;
    bool has_digit = false;
    for (size_t i = 0; i < length; i++) {
        char c = text[i];
        if (!((c >= '0' && c <= '9') || c == '+' || c == '-' || c == '.' || c == 'e' || c == 'E'))
            return false;
        has_digit |= c >= '0' && c <= '9';
        copy[i] = c;
    }
    copy[length] = 0;
    char *stop;
    double number = strtod(copy, &stop);
    if (!has_digit || stop != copy + length || !isfinite(number))
        return false;
    *value = number;
    return true;
}

static bool is_space(char c) { return c == ' ' || c == '\t' || c == '\r'; }

static int split_fields(const char *line, const char *end, Field *field, int capacity)
{
    int count = 0;
    for (const char *start = line;; start++) {
        const char *stop = start;
        while (stop < end && *stop != ',')
            stop++;
        const char *first = start, *last = stop;
        while (first < last && is_space(*first))
            first++;
        while (last > first && is_space(last[-1]))
            last--;
        if (count < capacity)
            field[count] = (Field){first, (size_t)(last - first), (int)(first - line) + 1};
        count++;
        if (stop == end)
            return count;
        start = stop;
    }
}

// The next line that is neither blank nor a comment; false at the end.
static bool next_line(Cursor *cursor, const char **line, const char **end)
{
    while (cursor->at < cursor->end) {
        const char *start = cursor->at, *stop = memchr(start, '\n', (size_t)(cursor->end - start));
        cursor->at = stop ? stop + 1 : cursor->end;
        if (!stop)
            stop = cursor->end;
        cursor->line++;
        const char *first = start;
        while (first < stop && is_space(*first))
            first++;
        if (first == stop || *first == '#')
            continue;
        *line = start;
        *end = stop;
        return true;
    }
    return false;
}

// A UTF-8 byte-order mark is not part of the header.
static void skip_mark(Cursor *cursor)
{
    if (cursor->end - cursor->at >= 3 && !memcmp(cursor->at, "\xef\xbb\xbf", 3))
        cursor->at += 3;
}

int number_table_columns(const char *text, size_t length, NumberColumn *column, int capacity, int *line)
{
    Cursor cursor = {.at = text, .end = text + length};
    const char *start, *end;
    skip_mark(&cursor);
    int count = next_line(&cursor, &start, &end) ? split_fields(start, end, column, capacity) : 0;
    *line = cursor.line;
    return count;
}

static bool read_header(Cursor *cursor, int *column_count)
{
    Field expected[NUMBER_TABLE_COLUMNS], got[NUMBER_TABLE_COLUMNS];
    *column_count = split_fields(cursor->header, cursor->header + strlen(cursor->header), expected, NUMBER_TABLE_COLUMNS);
    const char *line, *end;
    if (!next_line(cursor, &line, &end)) {
        faults_add(cursor->faults, cursor->file, cursor->line ? cursor->line : 1, 1, "is empty; expected the first line '%s'", cursor->header);
        return false;
    }
    int count = split_fields(line, end, got, NUMBER_TABLE_COLUMNS);
    for (int i = 0; i < *column_count || i < count; i++) {
        if (i < *column_count && i < count && i < NUMBER_TABLE_COLUMNS && got[i].length == expected[i].length &&
            !memcmp(got[i].name, expected[i].name, expected[i].length))
            continue;
        int column = i < count && i < NUMBER_TABLE_COLUMNS ? got[i].column : (int)(end - line) + 1;
        int shown = i < count && i < NUMBER_TABLE_COLUMNS ? (int)(got[i].length < 40 ? got[i].length : 40) : 0;
        faults_add(cursor->faults, cursor->file, cursor->line, column, "column %d is headed '%.*s'; expected the header '%s'", i + 1, shown,
                   shown ? got[i].name : "", cursor->header);
        return false;
    }
    return true;
}

static bool append_row(NumberTable *table, int *capacity, const double *row, int line)
{
    if (table->row_count == *capacity) {
        int wanted = *capacity ? *capacity * 2 : 256;
        if (*capacity > INT_MAX / 4 / NUMBER_TABLE_COLUMNS)
            return false;
        double *value = realloc(table->value, (size_t)wanted * (size_t)table->column_count * sizeof *value);
        if (value)
            table->value = value;
        int *lines = realloc(table->line, (size_t)wanted * sizeof *lines);
        if (lines)
            table->line = lines;
        if (!value || !lines)
            return false;
        *capacity = wanted;
    }
    memcpy(table->value + (size_t)table->row_count * (size_t)table->column_count, row, (size_t)table->column_count * sizeof *row);
    table->line[table->row_count++] = line;
    return true;
}

NumberTable *number_table_parse(const char *text, size_t length, const char *file, const char *header, Faults *faults)
{
    Cursor cursor = {.at = text, .end = text + length, .file = file, .header = header, .faults = faults};
    int faults_before = faults->count, capacity = 0;
    NumberTable *table = calloc(1, sizeof *table);
    if (!table) {
        faults_add(faults, file, 0, 0, "out of memory");
        return NULL;
    }
    const char *line, *end;
    skip_mark(&cursor);
    if (!read_header(&cursor, &table->column_count)) {
        number_table_free(table);
        return NULL;
    }
    while (next_line(&cursor, &line, &end)) {
        Field field[NUMBER_TABLE_COLUMNS];
        double row[NUMBER_TABLE_COLUMNS];
        int count = split_fields(line, end, field, NUMBER_TABLE_COLUMNS);
        if (count != table->column_count) {
            faults_add(faults, file, cursor.line, 1, "has %d fields; expected %d: %s", count, table->column_count, header);
            continue;
        }
        bool good = true;
        for (int i = 0; i < count; i++)
            if (!number_of_text(field[i].name, field[i].length, &row[i])) {
                faults_add(faults, file, cursor.line, field[i].column, "'%.*s' is not a number; expected a finite decimal number such as 1.5 or 2e-3",
                           (int)(field[i].length < 40 ? field[i].length : 40), field[i].name);
                good = false;
            }
        if (good && !append_row(table, &capacity, row, cursor.line)) {
            faults_add(faults, file, cursor.line, 1, "out of memory");
            break;
        }
    }
    if (faults->count > faults_before) {
        number_table_free(table);
        return NULL;
    }
    return table;
}

void number_table_free(NumberTable *table)
{
    if (!table)
        return;
    free(table->value);
    free(table->line);
    free(table);
}
