#include "study/table_file.h"

#include "recon/recon.h"

#include <errno.h>
#include <hdf5.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { BLOCK = 1024 };

typedef struct Column {
    char *name;
    size_t width;            // of a text; 0: a number
    char *block;             // (BLOCK) numbers or texts
    hid_t dataset, type;
} Column;

struct TableFile {
    PartFile part;
    FILE *csv;               // NULL: HDF5
    hid_t file;
    bool good;
    int64_t rows, row;       // expected; written
    int count, at;           // columns; the next of the row
    Column *column;
};

static TableFile *begin(const char *path, Faults *faults)
{
    TableFile *file = HEAP_ZEROED(1, sizeof *file);
    file->file = -1;
    file->good = true;
    if (part_file_begin(&file->part, path))
        return file;
    faults_add(faults, path, 0, 0, "cannot be written: %s", strerror(errno));
    free(file);
    return NULL;
}

TableFile *table_csv(const char *path, Faults *faults)
{
    TableFile *file = begin(path, faults);
    if (!file || (file->csv = part_file_stream(&file->part)))
        return file;
    table_file_close(file, false, faults);
    return NULL;
}

static bool set_text(hid_t object, const char *key, const char *text)
{
    hid_t type = H5Tcopy(H5T_C_S1), space = H5Screate(H5S_SCALAR);
    H5Tset_size(type, strlen(text) + 1);
    H5Tset_cset(type, H5T_CSET_UTF8);
    hid_t attribute = H5Acreate2(object, key, type, space, H5P_DEFAULT, H5P_DEFAULT);
    bool good = attribute >= 0 && H5Awrite(attribute, type, text) >= 0;
    if (attribute >= 0)
        H5Aclose(attribute);
    H5Sclose(space);
    H5Tclose(type);
    return good;
}

TableFile *table_hdf5(const char *path, const char *specification, int64_t rows, Faults *faults)
{
    TableFile *file = begin(path, faults);
    if (!file)
        return NULL;
    Hdf5Silence kept = hdf5_silence_begin();
    hid_t create = H5Pcreate(H5P_FILE_CREATE), group_list = H5Pcreate(H5P_GROUP_CREATE);
    H5Pset_obj_track_times(create, false);
    H5Pset_obj_track_times(group_list, false);
    H5Pset_link_creation_order(group_list, H5P_CRT_ORDER_TRACKED | H5P_CRT_ORDER_INDEXED);   // columns are listed in their order
    file->rows = rows;
    file->file = H5Fcreate(file->part.name, H5F_ACC_TRUNC, create, H5P_DEFAULT);
    hid_t group = file->file >= 0 ? H5Gcreate2(file->file, "/table", H5P_DEFAULT, group_list, H5P_DEFAULT) : -1;
    file->good = group >= 0 && set_text(file->file, "format", "seldinger sweep table") && set_text(file->file, "version", "1");
    if (group >= 0)
        H5Gclose(group);
    H5Pclose(group_list);
    H5Pclose(create);
    hid_t type = H5Tcopy(H5T_C_S1), space = H5Screate(H5S_SCALAR), list = H5Pcreate(H5P_DATASET_CREATE);
    H5Tset_size(type, strlen(specification) + 1);
    H5Tset_cset(type, H5T_CSET_UTF8);
    H5Pset_obj_track_times(list, false);
    hid_t text = file->good ? H5Dcreate2(file->file, "/specification", type, space, H5P_DEFAULT, list, H5P_DEFAULT) : -1;
    file->good = text >= 0 && H5Dwrite(text, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, specification) >= 0 && H5Dclose(text) >= 0;
    H5Pclose(list);
    H5Sclose(space);
    H5Tclose(type);
    hdf5_silence_end(kept);
    if (!file->csv && !file->good) {
        faults_add(faults, path, 0, 0, "cannot be written: the HDF5 library failed (full disk?)");
        table_file_close(file, false, faults);
        return NULL;
    }
    return file;
}

static bool make_dataset(TableFile *file, Column *column)
{
    char path[300];
    hsize_t none = 0, unlimited = H5S_UNLIMITED, chunk = (hsize_t)(file->rows < BLOCK && file->rows > 0 ? file->rows : BLOCK);
    hid_t space = H5Screate_simple(1, &none, &unlimited), list = H5Pcreate(H5P_DATASET_CREATE);
    column->type = column->width ? H5Tcopy(H5T_C_S1) : H5Tcopy(H5T_NATIVE_DOUBLE);
    if (column->width) {
        H5Tset_size(column->type, column->width);
        H5Tset_cset(column->type, H5T_CSET_UTF8);
    }
    H5Pset_chunk(list, 1, &chunk);
    H5Pset_obj_track_times(list, false);
    snprintf(path, sizeof path, "/table/%.280s", column->name);
    column->dataset = H5Dcreate2(file->file, path, column->type, space, H5P_DEFAULT, list, H5P_DEFAULT);
    H5Pclose(list);
    H5Sclose(space);
    return column->dataset >= 0;
}

// RFC 4180
static void put_text(FILE *csv, const char *text)
{
    if (!strpbrk(text, ",\"\r\n")) {
        fputs(text, csv);
        return;
    }
    fputc('"', csv);
    for (; *text; text++)
        fprintf(csv, *text == '"' ? "\"\"" : "%c", *text);
    fputc('"', csv);
}

void table_file_column(TableFile *file, const char *name, size_t width)
{
    file->column = HEAP_GROWN(file->column, (size_t)file->count + 1, sizeof *file->column);
    Column *column = &file->column[file->count++];
    *column = (Column){.name = HEAP_TEXT(name), .width = width, .dataset = -1, .type = -1};
    if (file->csv) {
        fputs(file->count > 1 ? "," : "", file->csv);
        put_text(file->csv, name);
        return;
    }
    column->block = HEAP_ZEROED(BLOCK, width ? width : sizeof(double));
    Hdf5Silence kept = hdf5_silence_begin();
    file->good = file->good && make_dataset(file, column);
    hdf5_silence_end(kept);
}

// The place of the next value in its column's block.
static char *place(TableFile *file, const Column **column)
{
    SEL_ASSERT(file->at < file->count, "a row has no more values than the table has columns");
    *column = &file->column[file->at++];
    if (!file->csv)
        return (*column)->block + (size_t)(file->row % BLOCK) * ((*column)->width ? (*column)->width : sizeof(double));
    fputs(file->at > 1 ? "," : "\n", file->csv);
    return NULL;
}

void table_file_number(TableFile *file, double value)
{
    const Column *column;
    char *at = place(file, &column), text[40];
    if (at) {
        memcpy(at, &value, sizeof value);
        return;
    }
    // as few digits as give the same number
    snprintf(text, sizeof text, "%.15g", value);
    if (strtod(text, NULL) != value)
        snprintf(text, sizeof text, "%.17g", value);
    fputs(text, file->csv);
}

void table_file_text(TableFile *file, const char *text)
{
    const Column *column;
    char *at = place(file, &column);
    if (!at) {
        put_text(file->csv, text);
        return;
    }
    size_t length = strlen(text);
    SEL_ASSERT(length < column->width, "the column is as wide as its longest text");
    memset(at, 0, column->width);
    memcpy(at, text, length < column->width ? length : column->width - 1);
}

void table_file_value(TableFile *file, const char *text)
{
    if (file->csv || file->column[file->at].width)
        table_file_text(file, text);
    else
        table_file_number(file, strtod(text, NULL));
}

void table_file_nothing(TableFile *file)
{
    const Column *column;
    char *at = place(file, &column);
    const double none = NAN;
    if (at && column->width)
        memset(at, 0, column->width);
    else if (at)
        memcpy(at, &none, sizeof none);
}

static bool flush(TableFile *file)
{
    hsize_t rows = (hsize_t)file->row, count = (rows - 1) % BLOCK + 1, start = rows - count;
    Hdf5Silence kept = hdf5_silence_begin();
    hid_t memory = H5Screate_simple(1, &count, NULL);
    for (int i = 0; file->good && i < file->count; i++) {
        Column *column = &file->column[i];
        file->good = H5Dset_extent(column->dataset, &rows) >= 0;
        hid_t space = file->good ? H5Dget_space(column->dataset) : -1;
        file->good = space >= 0 && H5Sselect_hyperslab(space, H5S_SELECT_SET, &start, NULL, &count, NULL) >= 0 &&
                     H5Dwrite(column->dataset, column->type, memory, space, H5P_DEFAULT, column->block) >= 0;
        if (space >= 0)
            H5Sclose(space);
    }
    H5Sclose(memory);
    hdf5_silence_end(kept);
    return file->good;
}

bool table_file_end_row(TableFile *file)
{
    SEL_ASSERT(file->at == file->count, "a row has a value for each column");
    file->at = 0;
    file->row++;
    if (file->csv)
        return !ferror(file->csv);
    return file->row % BLOCK != 0 || flush(file);
}

static bool close_hdf5(TableFile *file)
{
    bool good = file->good && (file->row == 0 || file->row % BLOCK == 0 || flush(file));
    Hdf5Silence kept = hdf5_silence_begin();
    for (int i = 0; i < file->count; i++) {
        if (file->column[i].dataset >= 0)
            good = H5Dclose(file->column[i].dataset) >= 0 && good;
        if (file->column[i].type >= 0)
            H5Tclose(file->column[i].type);
    }
    good = file->file >= 0 && H5Fclose(file->file) >= 0 && good;
    hdf5_silence_end(kept);
    return good;
}

bool table_file_close(TableFile *file, bool good, Faults *faults)
{
    if (!file)
        return false;
    bool written = true;
    if (file->csv)
        written = fputc('\n', file->csv) != EOF && !ferror(file->csv);
    else if (file->file >= 0)
        written = close_hdf5(file);
    char *path = HEAP_TEXT(file->part.path);
    errno = 0;
    if (!good || !written)
        part_file_drop(&file->part);
    else
        written = part_file_finish_synced(&file->part);
    if (good && !written)
        faults_add(faults, path, 0, 0, "cannot be written: %s; the results are in the journal, and the same command writes it",
                   errno ? strerror(errno) : "full disk?");
    free(path);
    for (int i = 0; i < file->count; i++) {
        free(file->column[i].name);
        free(file->column[i].block);
    }
    free(file->column);
    free(file);
    return written;
}
