#include "input/input.h"

#include "input/number_table.h"
#include "input/text_file.h"

#include <math.h>
#include <stdlib.h>

static const char header[] = "t_s,push_mm_s,twist_deg_s";

bool script_check_row(const ScriptRow *row, const ScriptRow *before, const char *file, int line, int column, Faults *faults)
{
    int already = faults->count;
    if (row->t_s < 0)
        faults_add(faults, file, line, column, "t_s %g is negative; a script starts at 0 or later", row->t_s);
    if (before && row->t_s <= before->t_s)
        faults_add(faults, file, line, column, "t_s %g does not follow %g; times grow from row to row", row->t_s, before->t_s);
    if (row->t_s > SCRIPT_LONGEST_S)
        faults_add(faults, file, line, column, "t_s %g is too late; at most %g s", row->t_s, (double)SCRIPT_LONGEST_S);
    if (fabs(row->command.push_mm_s) > SCRIPT_FASTEST_MM_S)
        faults_add(faults, file, line, column, "push_mm_s %g is out of range; -%d to %d mm/s", row->command.push_mm_s, SCRIPT_FASTEST_MM_S,
                   SCRIPT_FASTEST_MM_S);
    if (fabs(row->command.twist_deg_s) > SCRIPT_FASTEST_DEG_S)
        faults_add(faults, file, line, column, "twist_deg_s %g is out of range; -%d to %d deg/s", row->command.twist_deg_s,
                   SCRIPT_FASTEST_DEG_S, SCRIPT_FASTEST_DEG_S);
    return faults->count == already;
}

Script *script_parse(const char *text, size_t length, const char *file, Faults *faults)
{
    NumberTable *table = number_table_parse(text, length, file, header, faults);
    if (!table)
        return NULL;
    int faults_before = faults->count;
    Script *script = calloc(1, sizeof *script);
    if (script)
        script->row = calloc((size_t)table->row_count + 1, sizeof *script->row);
    if (!script || !script->row)
        faults_add(faults, file, 0, 0, "no memory for its rows");
    else if (table->row_count == 0)
        faults_add(faults, file, 1, 1, "has no row; at least one '%s', the last row's time ends the script", header);
    else
        for (int i = 0; i < table->row_count; i++) {
            const double *value = table->value + (size_t)i * 3;
            script->row[i] = (ScriptRow){value[0], {value[1], value[2]}};
            script_check_row(&script->row[i], i ? &script->row[i - 1] : NULL, file, table->line[i], 1, faults);
            script->count = i + 1;
        }
    number_table_free(table);
    if (faults->count > faults_before) {
        script_free(script);
        return NULL;
    }
    return script;
}

Script *script_load(const char *path, Faults *faults)
{
    size_t length;
    char *text = text_file_read(path, &length, faults);
    if (!text)
        return NULL;
    Script *script = script_parse(text, length, path, faults);
    free(text);
    return script;
}

void script_free(Script *script)
{
    if (!script)
        return;
    free(script->row);
    free(script);
}

double script_duration_s(const Script *script) { return script->count > 0 ? script->row[script->count - 1].t_s : 0; }

Command script_at(const Script *script, double t_s, int *cursor)
{
    int i = *cursor;
    if (i < 0 || i >= script->count || script->row[i].t_s > t_s)
        i = 0;
    while (i + 1 < script->count && script->row[i + 1].t_s <= t_s)
        i++;
    *cursor = i;
    // before the first row and from the last row's time on nothing moves
    if (script->count < 2 || t_s < script->row[0].t_s || i == script->count - 1)
        return (Command){0, 0};
    return script->row[i].command;
}
