#include "cli/point_table.h"

#include "base/base.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { COLUMNS_MOST = 64, POINTS_BYTES_MOST = 1 << 30 };

static bool append(PointTable *table, Vec3 p)
{
    if (table->count == table->capacity) {
        int capacity = table->capacity ? 2 * table->capacity : 1024;
        Vec3 *more = realloc(table->point, (size_t)capacity * sizeof *more);
        if (!more)
            return false;
        table->point = more;
        table->capacity = capacity;
    }
    table->point[table->count++] = p;
    return true;
}

// Splits a line at its commas (in place) and removes blanks around the cells. Returns the number of cells, at most COLUMNS_MOST + 1.
static int cut_cells(char *line, char *cell[COLUMNS_MOST + 1])
{
    int count = 0;
    for (char *at = line; count <= COLUMNS_MOST;) {
        char *end = strchr(at, ',');
        if (end)
            *end = '\0';
        at += strspn(at, " \t\r");
        size_t length = strlen(at);
        while (length > 0 && strchr(" \t\r", at[length - 1]))
            at[--length] = '\0';
        cell[count++] = at;
        if (!end)
            break;
        at = end + 1;
    }
    return count;
}

static bool read_header(char *const *cell, int count, int which[3], const char *path, int line, Faults *faults)
{
    static const char *const name[3] = {"x_mm", "y_mm", "z_mm"};
    int before = faults->count;
    for (int k = 0; k < 3; k++) {
        which[k] = -1;
        for (int i = 0; i < count; i++)
            if (!strcmp(cell[i], name[k])) {
                if (which[k] >= 0)
                    faults_add(faults, path, line, 0, "column %s appears twice; expected once", name[k]);
                which[k] = i;
            }
        if (which[k] < 0)
            faults_add(faults, path, line, 0, "the header has no column %s; expected x_mm,y_mm,z_mm", name[k]);
    }
    return faults->count == before;
}

bool point_table_parse(char *text, size_t length, const char *path, PointTable *table, Faults *faults)
{
    int before = faults->count, which[3], columns = 0, line = 0;
    char *next = text;
    if (memchr(text, '\0', length)) {
        faults_add_at_byte(faults, path, strlen(text), "unexpected zero byte; expected text");
        return false;
    }
    if (!strncmp(next, "\xEF\xBB\xBF", 3))
        next += 3;
    while (*next && faults->count < FAULTS_CAPACITY) {
        char *at = next, *cell[COLUMNS_MOST + 1];
        char *end = strchr(at, '\n');
        next = end ? end + 1 : at + strlen(at);
        if (end)
            *end = '\0';
        line++;
        at[strcspn(at, "#")] = '\0';
        if (at[strspn(at, " \t\r")] == '\0')
            continue;
        char *line_begin = at;
        int count = cut_cells(at, cell);
        if (columns == 0) {
            if (!read_header(cell, count, which, path, line, faults))
                break;
            columns = count;
            continue;
        }
        double x[3];
        bool good = count == columns;
        if (!good)
            faults_add(faults, path, line, 0, "has %d cells; expected %d, as in the header", count, columns);
        for (int k = 0; k < 3 && good; k++) {
            char *stop;
            const char *from = cell[which[k]];
            x[k] = strtod(from, &stop);
            if (stop == from || *stop || !isfinite(x[k]) || fabs(x[k]) > 1e9) {
                faults_add(faults, path, line, (int)(from - line_begin) + 1, "'%.40s' is not a coordinate; expected a finite number of mm", from);
                good = false;
            }
        }
        if (good && !append(table, vec3(x[0], x[1], x[2]))) {
            faults_add(faults, path, line, 0, "out of memory");
            break;
        }
    }
    if (columns == 0 && faults->count == before)
        faults_add(faults, path, 1, 1, "is empty; expected a header x_mm,y_mm,z_mm");
    return faults->count == before;
}

bool point_table_read(const char *path, PointTable *table, Faults *faults)
{
    size_t length;
    char *text = whole_file_read_most(path, POINTS_BYTES_MOST, &length, faults);
    bool good = text && point_table_parse(text, length, path, table, faults);
    free(text);
    return good;
}
