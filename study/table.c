// Three passes over the results, by run: the names and widths of the columns; the rows of the CSV; the rows of the HDF5 file, a block at a time. Memory: eight
// bytes for each run and a block of rows.
#include "study/table.h"

#include "recon/recon.h"
#include "study/figures.h"
#include "study/points.h"
#include "study/table_file.h"

#include <limits.h>
#include <stdlib.h>
#include <string.h>

typedef struct Table {
    const Study *study;
    Journal *journal;
    int64_t runs, *offset;   // (runs) of its line in the journal
    size_t message_width;
    bool has_ends;           // a run that did not fail
    cJSON *columns;          // object: name of figure -> number of column
    Faults *faults;
} Table;

static void note_offset(void *context, int64_t run, const char *text, int64_t offset)
{
    (void)text;
    Table *table = context;
    if (table->offset[run] == 0)
        table->offset[run] = offset;
}

// The result of a run; the caller deletes it. NULL with a fault.
static cJSON *result_of(Table *table, int64_t run)
{
    char *text = table->offset[run] ? journal_at(table->journal, table->offset[run]) : NULL;
    cJSON *result = text ? cJSON_Parse(text) : NULL;
    free(text);
    if (!result)
        faults_add(table->faults, journal_path(table->journal), 0, 0, "the result of run %lld is missing or damaged; the same command repeats it",
                   (long long)run);
    return result;
}

static const char *text_in(const cJSON *result, const char *key)
{
    const char *text = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(result, key));
    return text ? text : "";
}

static bool find_columns(Table *table)
{
    for (int64_t run = 0; run < table->runs; run++) {
        cJSON *result = result_of(table, run);
        if (!result)
            return false;
        size_t width = strlen(text_in(result, "message")) + 1;
        table->message_width = width > table->message_width ? width : table->message_width;
        table->has_ends |= *text_in(result, "state_hash") != 0;
        const cJSON *figures = cJSON_GetObjectItemCaseSensitive(result, "figures");
        for (const cJSON *item = figures ? figures->child : NULL; item; item = item->next)
            if (!cJSON_GetObjectItemCaseSensitive(table->columns, item->string))
                cJSON_AddNumberToObject(table->columns, item->string, 0);
        cJSON_Delete(result);
    }
    return true;
}

// A run without a flag has it as 0; any other figure that a run lacks is empty.
static bool is_flag(const char *name) { return !strncmp(name, "flags.", 6); }

static bool write_row(Table *table, TableFile *file, int64_t run)
{
    const Study *study = table->study;
    cJSON *result = result_of(table, run);
    char number[VARY_TEXT];
    if (!result)
        return false;
    table_file_number(file, (double)run);
    for (int i = 0; i < study->factor_count; i++)
        table_file_value(file, study_value(study, run, i, number));
    if (study->hands.wanted)
        table_file_number(file, (double)study_hand_seed(study, run));
    table_file_text(file, text_in(result, "status"));
    table_file_text(file, text_in(result, "message"));
    table_file_text(file, text_in(result, "state_hash"));
    const cJSON *figures = cJSON_GetObjectItemCaseSensitive(result, "figures");
    bool has_figures = figures && figures->child;
    for (const cJSON *column = table->columns->child; column; column = column->next) {
        const cJSON *figure = cJSON_GetObjectItemCaseSensitive(figures, column->string);
        if (figure)
            table_file_number(file, figure->valuedouble);
        else if (is_flag(column->string) && has_figures)
            table_file_number(file, 0);
        else
            table_file_nothing(file);
    }
    cJSON_Delete(result);
    return table_file_end_row(file);
}

static size_t value_width(const Distribution *values)
{
    size_t width = 0;
    for (int i = 0; i < values->value_count; i++)
        width = strlen(values->value[i]) + 1 > width ? strlen(values->value[i]) + 1 : width;
    return width;
}

static void write_heading(Table *table, TableFile *file)
{
    const Study *study = table->study;
    table_file_column(file, "run", 0);
    for (int i = 0; i < study->factor_count; i++)
        table_file_column(file, study->factor[i].path, value_width(&study->factor[i].values));
    if (study->hands.wanted)
        table_file_column(file, "hand_seed", 0);
    table_file_column(file, "status", 16);
    table_file_column(file, "message", table->message_width);
    table_file_column(file, "state_hash", 20);
    for (const cJSON *column = table->columns->child; column; column = column->next)
        table_file_column(file, column->string, 0);
}

// What is to be kept and no run has is likely to be misspelt.
static void warn_of_figures(const Table *table)
{
    const Study *study = table->study;
    for (int i = 0; i < study->figure_count; i++) {
        const cJSON *column = table->columns->child;
        while (column && !path_is_part_of(column->string, study->figure[i]))
            column = column->next;
        if (!column && table->has_ends && !path_is_part_of(study->figure[i], "flags"))
            fprintf(stderr, "%s: warning: no run has a figure '%.100s' of keep.figures; table.csv names those that there are if 'figures' is left out\n",
                    study->path, study->figure[i]);
    }
}

static bool write_file(Table *table, TableFile *file)
{
    bool good = file != NULL;
    if (good)
        write_heading(table, file);
    for (int64_t run = 0; good && run < table->runs; run++)
        good = write_row(table, file, run);
    return table_file_close(file, good, table->faults) && good;
}

bool table_write(const char *folder, const Study *study, Journal *journal, int64_t runs, Faults *faults)
{
    Table table = {.study = study, .journal = journal, .runs = runs, .faults = faults, .columns = cJSON_CreateObject()};
    char csv[PATH_MAX], h5[PATH_MAX];
    table.offset = HEAP_ZEROED((size_t)runs, sizeof *table.offset);
    snprintf(csv, sizeof csv, "%.4000s/table.csv", folder);
    snprintf(h5, sizeof h5, "%.4000s/table.h5", folder);
    journal_read(journal, note_offset, &table);
    bool good = find_columns(&table);
    if (good)
        warn_of_figures(&table);
    good = good && write_file(&table, table_csv(csv, faults)) && write_file(&table, table_hdf5(h5, study->text, runs, faults));
    free(table.offset);
    cJSON_Delete(table.columns);
    return good;
}
