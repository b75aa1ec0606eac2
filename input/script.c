#include "input/script.h"

#include "base/base.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { PUSH, TWIST, RELEASED, EXCHANGE, CONTRAST, QUANTITIES };
static const char header[] = "t_s,push_mm_s,twist_deg_s", header_with_release[] = "t_s,push_mm_s,twist_deg_s,released";
static const char *const quantity[QUANTITIES + 1] = {"push_mm_s", "twist_deg_s", "released", "exchange", "contrast_ml_s", NULL};

// The meaning of the columns after t_s: the tool and the quantity of each.
typedef struct Columns {
    int count;
    int tool[QUANTITIES * TOOLS_MOST], quantity[QUANTITIES * TOOLS_MOST];
    char header[(TOOL_NAME_SIZE + 16) * QUANTITIES * TOOLS_MOST];
} Columns;

Command *script_row_command(ScriptRow *row, int tool) { return tool == 0 ? &row->command : &row->inner[tool - 1]; }

static void check_speed(double speed, int fastest, const char *name, const char *unit, const ToolNames *tools, int tool, const char *file, int line, int column,
                        Faults *faults)
{
    bool named = tools && tools->count > 1;
    if (fabs(speed) > fastest)
        faults_add(faults, file, line, column, "%s%s%s %g is out of range; expected -%d to %d %s", named ? tools->name[tool] : "", named ? "." : "", name,
                   speed, fastest, fastest, unit);
}

bool script_check_row(const ScriptRow *row, const ScriptRow *before, const ToolNames *tools, const char *file, int line, int column, Faults *faults)
{
    int already = faults->count, injecting = 0;
    if (row->t_s < 0)
        faults_add(faults, file, line, column, "t_s %g is negative; expected 0 or more", row->t_s);
    if (before && row->t_s <= before->t_s)
        faults_add(faults, file, line, column, "t_s %g does not follow %g; expected rising times", row->t_s, before->t_s);
    if (row->t_s > SCRIPT_LONGEST_S)
        faults_add(faults, file, line, column, "t_s %g is too late; expected at most %g s", row->t_s, (double)SCRIPT_LONGEST_S);
    for (int k = 0; k < (tools ? tools->count : 1); k++) {
        const Command *command = k == 0 ? &row->command : &row->inner[k - 1];
        check_speed(command->push_mm_s, SCRIPT_FASTEST_MM_S, quantity[0], "mm/s", tools, k, file, line, column, faults);
        check_speed(command->twist_deg_s, SCRIPT_FASTEST_DEG_S, quantity[1], "deg/s", tools, k, file, line, column, faults);
        injecting += row->contrast_ml_s[k] > 0;
        if (!(row->contrast_ml_s[k] >= 0 && row->contrast_ml_s[k] <= SCRIPT_MOST_ML_S))
            faults_add(faults, file, line, column, "contrast_ml_s %g is out of range; expected 0 to %d ml/s", row->contrast_ml_s[k], SCRIPT_MOST_ML_S);
    }
    if (injecting > 1)
        faults_add(faults, file, line, column, "contrast agent is injected through %d tools at once; expected one tool per row, since there is one injector",
                   injecting);
    return faults->count == already;
}

bool script_check_end(const Script *script, const char *file, int line, int column, Faults *faults)
{
    if (script_duration_s(script) > 0)
        return true;
    faults_add(faults, file, line, column, "the script ends at 0 s, the time of its last row; expected another row with a later time");
    return false;
}

static bool is_word(const char *text, size_t length, const char *word) { return length == strlen(word) && !memcmp(text, word, length); }

static int find_word(const char *text, size_t length, const char *const *words)
{
    for (int i = 0; words[i]; i++)
        if (is_word(text, length, words[i]))
            return i;
    return -1;
}

static void fault_unknown_tool(const char *name, const NumberColumn *column, int line, const ToolNames *tools, const char *file, Faults *faults)
{
    char all[TOOLS_MOST * (TOOL_NAME_SIZE + 2)];
    size_t used = 0;
    int nearest = nearest_name(name, tools->name);
    for (int i = 0; i < tools->count; i++)
        used += (size_t)snprintf(all + used, sizeof all - used, "%s%s", i ? ", " : "", tools->name[i]);
    if (nearest >= 0)
        faults_add(faults, file, line, column->column, "no tool of the scene is named '%s'; did you mean '%s'?", name, tools->name[nearest]);
    else
        faults_add(faults, file, line, column->column, "no tool of the scene is named '%s'; it has: %s", name, all);
}

// One column that is not t_s: NAME.push_mm_s, NAME.twist_deg_s, NAME.released, NAME.exchange or NAME.contrast_ml_s.
static bool read_column(const NumberColumn *column, int line, const ToolNames *tools, const char *file, int *tool, int *which, Faults *faults)
{
    int shown = (int)(column->length < 80 ? column->length : 80);
    const char *dot = memchr(column->name, '.', column->length);
    size_t name_length = dot ? (size_t)(dot - column->name) : 0;
    *which = dot ? find_word(dot + 1, column->length - name_length - 1, quantity) : -1;
    if (*which < 0) {
        const char *example = tools->name[0];
        if (dot && (*tool = find_word(column->name, name_length, tools->name)) >= 0)
            example = tools->name[*tool];
        faults_add(faults, file, line, column->column,
                   "unknown column '%.*s'; with named tools expected NAME.push_mm_s, NAME.twist_deg_s, NAME.released, NAME.exchange or "
                   "NAME.contrast_ml_s, such as '%s.push_mm_s'",
                   shown, column->name, example);
        return false;
    }
    *tool = find_word(column->name, name_length, tools->name);
    if (*tool < 0) {
        char name[80];
        snprintf(name, sizeof name, "%.*s", (int)(name_length < sizeof name ? name_length : sizeof name - 1), column->name);
        fault_unknown_tool(name, column, line, tools, file, faults);
    }
    return *tool >= 0;
}

// Reads a header with tool names and reports all its faults.
static bool read_columns(const NumberColumn *field, int count, int line, const ToolNames *tools, const char *file, Columns *columns, Faults *faults)
{
    int before = faults->count, place[TOOLS_MOST][QUANTITIES] = {{0}};
    size_t used = (size_t)snprintf(columns->header, sizeof columns->header, "t_s");
    if (count > NUMBER_TABLE_COLUMNS) {
        faults_add(faults, file, line, 1, "has %d columns; expected t_s and up to five for each of the scene's %d tools", count, tools->count);
        return false;
    }
    if (!is_word(field[0].name, field[0].length, "t_s"))
        faults_add(faults, file, line, field[0].column, "column 1 is headed '%.*s'; expected 't_s'", (int)(field[0].length < 40 ? field[0].length : 40),
                   field[0].name);
    for (int i = 1; i < count; i++) {
        int tool, which;
        if (!read_column(&field[i], line, tools, file, &tool, &which, faults))
            continue;
        if (place[tool][which]) {
            faults_add(faults, file, line, field[i].column, "duplicate column '%s.%s'", tools->name[tool], quantity[which]);
            continue;
        }
        place[tool][which] = field[i].column;
        columns->tool[columns->count] = tool;
        columns->quantity[columns->count++] = which;
        used += (size_t)snprintf(columns->header + used, sizeof columns->header - used, ",%s.%s", tools->name[tool], quantity[which]);
    }
    for (int k = 0; k < tools->count; k++)
        for (int q = PUSH; q <= TWIST; q++)
            if (place[k][q] && !place[k][1 - q])
                faults_add(faults, file, line, place[k][q], "'%s.%s' needs the column '%s.%s' too", tools->name[k], quantity[q], tools->name[k],
                           quantity[1 - q]);
    return faults->count == before;
}

// Reads the columns of a text; only those of the first tool if the header has no names.
static bool find_columns(const char *text, size_t length, const char *file, const ToolNames *tools, Columns *columns, Faults *faults)
{
    NumberColumn field[NUMBER_TABLE_COLUMNS];
    int line, count = number_table_columns(text, length, field, NUMBER_TABLE_COLUMNS, &line);
    bool named = false;
    for (int i = 0; i < count && i < NUMBER_TABLE_COLUMNS; i++)
        named |= memchr(field[i].name, '.', field[i].length) != NULL;
    *columns = (Columns){0};
    if (tools && named)
        return read_columns(field, count, line, tools, file, columns, faults);
    bool has_release = count == 4 && is_word(field[3].name, field[3].length, quantity[RELEASED]);
    columns->count = has_release ? 3 : 2;
    columns->quantity[1] = TWIST;
    columns->quantity[2] = RELEASED;
    strcpy(columns->header, has_release ? header_with_release : header);
    return true;
}

static void put_value(ScriptRow *row, int tool, int which, double value)
{
    Command *command = script_row_command(row, tool);
    if (which == RELEASED)
        row->released |= value != 0 ? 1u << tool : 0;
    else if (which == EXCHANGE)
        row->fitted[tool] = (int)fmax(0, fmin(value, EXCHANGES_MOST));
    else if (which == CONTRAST)
        row->contrast_ml_s[tool] = value;
    else
        *(which == TWIST ? &command->twist_deg_s : &command->push_mm_s) = value;
}

Script *script_parse(const char *text, size_t length, const char *file, const ToolNames *tools, Faults *faults)
{
    Columns columns;
    NumberTable *table = find_columns(text, length, file, tools, &columns, faults) ? number_table_parse(text, length, file, columns.header, faults) : NULL;
    if (!table)
        return NULL;
    int faults_before = faults->count;
    Script *script = calloc(1, sizeof *script);
    if (script)
        script->row = calloc((size_t)table->row_count + 1, sizeof *script->row);
    if (!script || !script->row)
        faults_add(faults, file, 0, 0, "out of memory");
    else if (table->row_count == 0)
        faults_add(faults, file, 1, 1, "has no row; expected at least one '%s' (the last row's time ends the script)", columns.header);
    else
        for (int i = 0; i < table->row_count; i++) {
            const double *value = table->value + (size_t)i * (size_t)table->column_count;
            ScriptRow *row = &script->row[i];
            row->t_s = value[0];
            for (int c = 0; c < columns.count; c++) {
                put_value(row, columns.tool[c], columns.quantity[c], value[1 + c]);
                if (columns.quantity[c] == RELEASED && value[1 + c] != 0 && value[1 + c] != 1)
                    faults_add(faults, file, table->line[i], 1, "released is %g; expected 0 (the tool is held) or 1 (it is released)", value[1 + c]);
                if (columns.quantity[c] == EXCHANGE && (value[1 + c] < 0 || value[1 + c] > EXCHANGES_MOST || value[1 + c] != floor(value[1 + c])))
                    faults_add(faults, file, table->line[i], 1, "exchange is %g; expected 0 (the scene's tool) or 1 to %d (those under its 'exchange:')",
                               value[1 + c], EXCHANGES_MOST);
            }
            script_check_row(row, i ? row - 1 : NULL, tools, file, table->line[i], 1, faults);
            script->count = i + 1;
        }
    if (faults->count == faults_before)
        script_check_end(script, file, table->line[script->count - 1], 1, faults);
    number_table_free(table);
    if (faults->count > faults_before) {
        script_free(script);
        return NULL;
    }
    return script;
}

Script *script_load(const char *path, const ToolNames *tools, Faults *faults)
{
    size_t length;
    char *text = text_file_read(path, &length, faults);
    if (!text)
        return NULL;
    Script *script = script_parse(text, length, path, tools, faults);
    free(text);
    return script;
}

// Collects the names before the dots of a header. Surplus names are skipped here; parsing reports them.
static void find_names(const char *text, size_t length, ScriptTools *tools)
{
    NumberColumn field[NUMBER_TABLE_COLUMNS];
    int line, count = number_table_columns(text, length, field, NUMBER_TABLE_COLUMNS, &line);
    *tools = (ScriptTools){0};
    for (int i = 0; i < count && i < NUMBER_TABLE_COLUMNS && tools->names.count < TOOLS_MOST; i++) {
        const char *dot = memchr(field[i].name, '.', field[i].length);
        size_t size = dot ? (size_t)(dot - field[i].name) : 0;
        if (size == 0 || size >= TOOL_NAME_SIZE || find_word(field[i].name, size, tools->names.name) >= 0)
            continue;
        char *name = tools->text[tools->names.count];
        memcpy(name, field[i].name, size);
        tools->names.name[tools->names.count++] = name;
    }
    if (tools->names.count == 0)
        tools->names = (ToolNames){.count = 1, .name = {tools->text[0]}};
}

Script *script_load_any(const char *path, ScriptTools *tools, Faults *faults)
{
    size_t length;
    char *text = text_file_read(path, &length, faults);
    if (!text)
        return NULL;
    find_names(text, length, tools);
    Script *script = script_parse(text, length, path, &tools->names, faults);
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

ToolCommands script_tools_at(const Script *script, double t_s, int *cursor)
{
    int i = *cursor;
    if (i < 0 || i >= script->count || script->row[i].t_s > t_s)
        i = 0;
    while (i + 1 < script->count && script->row[i + 1].t_s <= t_s)
        i++;
    *cursor = i;
    // before the first row and after the end nothing moves, but exchanged tools stay inserted
    ToolCommands commands = {0};
    if (script->count == 0 || t_s < script->row[0].t_s)
        return commands;
    memcpy(commands.fitted, script->row[i].fitted, sizeof commands.fitted);
    if (i == script->count - 1)
        return commands;
    commands.tool[0] = script->row[i].command;
    commands.released = script->row[i].released;
    for (int k = 0; k < TOOLS_MOST; k++)
        if (script->row[i].contrast_ml_s[k] > 0) {
            commands.contrast_ml_s = script->row[i].contrast_ml_s[k];
            commands.contrast_tool = k + 1;
        }
    memcpy(commands.tool + 1, script->row[i].inner, sizeof script->row[i].inner);
    return commands;
}

Command script_at(const Script *script, double t_s, int *cursor) { return script_tools_at(script, t_s, cursor).tool[0]; }
