// The guarded reader of HDF5: datasets like ours are read; data that are stored elsewhere, compressed by filters other than deflate, of another type, or
// missing in the file are refused with a message.
#include "recon/hdf5_reader.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <hdf5.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

static Faults faults;
static char folder[] = "/tmp/seldinger-hdf5-reader-XXXXXX";
#include "tests/folder.h"

enum { ROWS = 50 };
static const double numbers[ROWS] = {1, 2, 3};

static hid_t new_file(void) { return H5Fcreate(in_folder("a.h5"), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT); }

// Writes a dataset of ROWS values, with the numbers unless `data` is NULL; takes ownership of `creation`.
static void put_with(hid_t file, const char *name, hid_t type, hsize_t rows, hid_t creation, const void *data)
{
    hid_t space = H5Screate_simple(1, &rows, NULL), set = H5Dcreate2(file, name, type, space, H5P_DEFAULT, creation, H5P_DEFAULT);
    assert_true(set >= 0);
    if (data)
        assert_true(H5Dwrite(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, data) >= 0);
    H5Dclose(set);
    H5Sclose(space);
    if (creation != H5P_DEFAULT)
        H5Pclose(creation);
}
static void put_numbers(hid_t file, const char *name, hid_t type) { put_with(file, name, type, ROWS, H5P_DEFAULT, numbers); }

static hid_t chunks(hsize_t rows)
{
    hid_t creation = H5Pcreate(H5P_DATASET_CREATE);
    H5Pset_chunk(creation, 1, &rows);
    return creation;
}

static Hdf5Reader *open_file(hid_t file)
{
    assert_true(H5Fclose(file) >= 0);
    faults_clear(&faults);
    Hdf5Reader *reader = hdf5_reader_open(in_folder("a.h5"), "a test has it", &faults);
    assert_non_null(reader);
    return reader;
}

// Checks that reading the dataset is refused with these words; closes the file.
static void refused(hid_t file, Hdf5Dataset dataset, const char *words)
{
    Hdf5Reader *reader = open_file(file);
    void *values = hdf5_read(reader, &dataset);
    if (values || faults.count != 1 || !strstr(faults.text[0], words) || !strstr(faults.text[0], dataset.path) || !strstr(faults.text[0], "a.h5: "))
        fail_msg("expected '%s', got '%s'", words, values ? "values" : faults.text[0]);
    hdf5_reader_close(reader);
}

static const Hdf5Dataset plain = {"/x", HDF5_DOUBLE, 1, {0}, false};

static void what_is_plain_is_read(void **state)
{
    (void)state;
    const hid_t stored[] = {H5T_IEEE_F64LE, H5T_IEEE_F64BE, H5T_IEEE_F32LE, H5T_IEEE_F32BE};
    for (int i = 0; i < 4; i++) {
        hid_t file = new_file();
        put_numbers(file, "/x", stored[i]);
        put_with(file, "/n", i % 2 ? H5T_STD_I16BE : H5T_STD_U64LE, ROWS, chunks(7), numbers);
        Hdf5Reader *reader = open_file(file);
        Hdf5Dataset x = {"/x", HDF5_DOUBLE, 1, {ROWS}, true}, n = {"/n", HDF5_INT32, 1, {0}, false};
        double *values = hdf5_read(reader, &x);
        int32_t *counts = hdf5_read(reader, &n);
        assert_non_null(values);
        assert_non_null(counts);
        assert_int_equal(n.size[0], ROWS);
        for (int k = 0; k < ROWS; k++)
            assert_true(values[k] == numbers[k] && counts[k] == (int)numbers[k]);
        assert_true(hdf5_has(reader, "/x") && !hdf5_has(reader, "/y") && !hdf5_has(reader, "/x/y"));
        assert_int_equal(faults.count, 0);
        free(values);
        free(counts);
        hdf5_reader_close(reader);
    }
}

static void links_out_are_not_followed(void **state)
{
    (void)state;
    hid_t other = H5Fcreate(in_folder("other.h5"), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
    put_numbers(other, "/x", H5T_IEEE_F64LE);
    H5Fclose(other);
    hid_t file = new_file();
    H5Lcreate_external(in_folder("other.h5"), "/x", file, "/x", H5P_DEFAULT, H5P_DEFAULT);
    refused(file, plain, "soft or external link");
    file = new_file();
    H5Lcreate_external(in_folder("other.h5"), "/", file, "/group", H5P_DEFAULT, H5P_DEFAULT);
    refused(file, (Hdf5Dataset){"/group/x", HDF5_DOUBLE, 1, {0}, false}, "soft or external link");
    file = new_file();
    H5Lcreate_external(in_folder("other.h5"), "/x", file, "/out", H5P_DEFAULT, H5P_DEFAULT);
    H5Lcreate_soft("/out", file, "/x", H5P_DEFAULT, H5P_DEFAULT);
    refused(file, plain, "soft or external link");
    file = new_file();
    H5Gclose(H5Gcreate2(file, "/x", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT));
    refused(file, plain, "cannot be opened");
    refused(new_file(), plain, "has no dataset /x; a test has it");
}

static void data_elsewhere_are_not_read(void **state)
{
    (void)state;
    hid_t file = new_file(), creation = H5Pcreate(H5P_DATASET_CREATE);
    H5Pset_external(creation, "/etc/passwd", 0, 400);
    put_with(file, "/x", H5T_IEEE_F64LE, ROWS, creation, NULL);
    refused(file, plain, "is stored in another file");
    const hsize_t rows = ROWS;
    hid_t space = H5Screate_simple(1, &rows, NULL);
    creation = H5Pcreate(H5P_DATASET_CREATE);
    H5Pset_virtual(creation, space, in_folder("other.h5"), "/x", space);
    H5Sclose(space);
    file = new_file();
    put_with(file, "/x", H5T_IEEE_F64LE, ROWS, creation, NULL);
    refused(file, plain, "assembled from other files");
    creation = H5Pcreate(H5P_DATASET_CREATE);
    H5Pset_external(creation, "/etc/passwd", 0, 400);
    hid_t text = H5Tcopy(H5T_C_S1);
    H5Tset_size(text, 400);
    file = new_file();
    put_with(file, "/text", text, 1, creation, NULL);
    H5Tclose(text);
    Hdf5Reader *reader = open_file(file);
    assert_null(hdf5_text(reader, "/text"));
    assert_true(faults.count == 1 && strstr(faults.text[0], "/text is not a string"));
    hdf5_reader_close(reader);
}

// --- compressed chunks ---

enum { PART = 20 };          // values per chunk: the last of the three chunks ends at ROWS
static hid_t packed(bool is_shuffled)
{
    hid_t creation = chunks(PART);
    if (is_shuffled)
        H5Pset_shuffle(creation);
    H5Pset_deflate(creation, 6);
    return creation;
}

static double wave(int i) { return i % 7 ? 0.1 * i : -1e-300 * i; }

// Datasets compressed by the library, in each type, rank and byte order.
static void what_is_packed_is_read(void **state)
{
    (void)state;
    const hid_t stored[] = {H5T_IEEE_F64LE, H5T_IEEE_F64BE, H5T_IEEE_F32LE, H5T_STD_I16BE, H5T_STD_U8LE, H5T_STD_I64LE};
    const hsize_t size[3] = {11, 5, 3}, part[3] = {4, 2, 3};
    double values[11 * 5 * 3];
    for (int i = 0; i < 165; i++)
        values[i] = wave(i);
    for (int t = 0; t < 6; t++)
        for (int rank = 1; rank <= 3; rank++)
            for (int shuffled = 0; shuffled < 2; shuffled++) {
                bool is_float = t < 3;
                hid_t file = new_file(), space = H5Screate_simple(rank, size, NULL), creation = H5Pcreate(H5P_DATASET_CREATE);
                H5Pset_chunk(creation, rank, part);
                if (shuffled)
                    H5Pset_shuffle(creation);
                H5Pset_deflate(creation, (unsigned)(1 + t));
                hid_t set = H5Dcreate2(file, "/x", stored[t], space, H5P_DEFAULT, creation, H5P_DEFAULT);
                assert_true(H5Dwrite(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values) >= 0);
                double expected[165];        // values as read by the library
                int32_t expected_counts[165];
                assert_true(H5Dread(set, is_float ? H5T_NATIVE_DOUBLE : H5T_NATIVE_INT32, H5S_ALL, H5S_ALL, H5P_DEFAULT,
                                    is_float ? (void *)expected : expected_counts) >= 0);
                H5Dclose(set);
                H5Sclose(space);
                H5Pclose(creation);
                Hdf5Reader *reader = open_file(file);
                Hdf5Dataset x = {"/x", is_float ? HDF5_DOUBLE : HDF5_INT32, rank, {0}, is_float};
                void *read = hdf5_read(reader, &x);
                if (!read)
                    fail_msg("type %d, rank %d: %s", t, rank, faults.text[0]);
                size_t count = rank == 1 ? 11 : rank == 2 ? 55 : 165;
                assert_memory_equal(read, is_float ? (void *)expected : expected_counts, count * (is_float ? sizeof(double) : sizeof(int32_t)));
                free(read);
                hdf5_reader_close(reader);
            }
}

static size_t pass_filter(unsigned flags, size_t parameter_count, const unsigned parameters[], size_t bytes, size_t *size, void **buffer)
{
    (void)flags, (void)parameter_count, (void)parameters, (void)size, (void)buffer;
    return bytes;
}

static void other_packings_are_refused(void **state)
{
    (void)state;
    static const H5Z_class2_t own = {H5Z_CLASS_T_VERS, 300, 1, 1, "own", NULL, NULL, pass_filter};
    assert_true(H5Zregister(&own) >= 0);
    for (int i = 0; i < 7; i++) {
        hid_t file = new_file(), creation = chunks(PART);
        if (i == 0)
            H5Pset_filter(creation, 300, H5Z_FLAG_OPTIONAL, 0, NULL);
        if (i == 1)
            H5Pset_fletcher32(creation);
        if (i == 2)
            H5Pset_shuffle(creation);
        if (i == 3 || i == 4)
            H5Pset_deflate(creation, 6);
        if (i == 3)
            H5Pset_shuffle(creation);            // filters in the wrong order
        if (i == 4)
            H5Pset_deflate(creation, 6);         // twice
        if (i == 5)
            H5Pset_scaleoffset(creation, H5Z_SO_FLOAT_DSCALE, 2);
        if (i == 6) {
            H5Pset_shuffle(creation);
            H5Pset_deflate(creation, 6);
            H5Pset_fletcher32(creation);
        }
        put_with(file, "/x", H5T_IEEE_F64LE, ROWS, creation, numbers);
        refused(file, plain, "is compressed by filters other than deflate");
    }
    // while the file is open no plug-in may be loaded; afterwards the program's own settings apply again
    const unsigned set = H5PL_FILTER_PLUGIN;
    unsigned may_load = 1;
    H5PLset_loading_state(set);
    Hdf5Reader *reader = open_file(new_file());
    assert_non_null(reader);
    H5PLget_loading_state(&may_load);
    assert_int_equal(may_load, 0);
    hdf5_reader_close(reader);
    H5PLget_loading_state(&may_load);
    assert_int_equal(may_load, set);
}

// A dataset whose first chunk holds these bytes; the other chunks are valid.
static hid_t with_chunk(const void *bytes, size_t length, unsigned left_out)
{
    hid_t file = new_file();
    double values[ROWS];
    for (int i = 0; i < ROWS; i++)
        values[i] = wave(i);
    put_with(file, "/x", H5T_IEEE_F64LE, ROWS, packed(true), values);
    hid_t set = H5Dopen2(file, "/x", H5P_DEFAULT);
    assert_true(H5Dwrite_chunk(set, H5P_DEFAULT, left_out, (const hsize_t[]){0}, length, bytes) >= 0);
    H5Dclose(set);
    return file;
}

static void damaged_chunks_are_refused(void **state)
{
    (void)state;
    enum { BYTES = PART * sizeof(double) };
    unsigned char values[BYTES + 1], stream[1000];
    for (int i = 0; i <= BYTES; i++)
        values[i] = (unsigned char)(i * 37 % 251);
    uLongf length = sizeof stream;
    assert_int_equal(compress(stream, &length, values, BYTES), Z_OK);
    // the whole stream is read; any prefix, an extra byte, or a flipped bit is refused
    Hdf5Reader *reader = open_file(with_chunk(stream, length, 0));
    Hdf5Dataset x = plain;
    void *read = hdf5_read(reader, &x);
    assert_non_null(read);
    free(read);
    hdf5_reader_close(reader);
    for (size_t cut = 1; cut < length; cut += 7)
        refused(with_chunk(stream, cut, 0), plain, "damaged or truncated");
    stream[length] = 0;
    refused(with_chunk(stream, length + 1, 0), plain, "damaged or truncated");
    for (size_t i = 0; i < length; i += 11) {
        stream[i] ^= 4;
        refused(with_chunk(stream, length, 0), plain, "damaged or truncated");
        stream[i] ^= 4;
    }
    // one byte less and one byte more than the chunk's size
    for (int more = -1; more <= 1; more += 2) {
        length = sizeof stream;
        assert_int_equal(compress(stream, &length, values, (uLong)(BYTES + more)), Z_OK);
        refused(with_chunk(stream, length, 0), plain, "damaged or truncated");
    }
    // a chunk whose filters were skipped must hold exactly its plain bytes
    reader = open_file(with_chunk(values, BYTES, 3));
    x = plain;
    double *same = hdf5_read(reader, &x);
    assert_non_null(same);
    assert_memory_equal(same, values, BYTES);
    free(same);
    hdf5_reader_close(reader);
    refused(with_chunk(values, BYTES - 1, 3), plain, "damaged or truncated");
    refused(with_chunk(values, BYTES, 0), plain, "damaged or truncated");
    // longer than any chunk of this size compressed by deflate
    refused(with_chunk(stream, sizeof stream, 0), plain, "truncated");
}

// Decompression bombs: deflate yields up to 1032 bytes per byte.
static void bombs_are_refused(void **state)
{
    (void)state;
    const hsize_t rows = 1 << 24;
    unsigned char *zeros = calloc(rows, sizeof(double));
    hid_t file = new_file(), creation = chunks(rows);
    H5Pset_deflate(creation, 9);
    put_with(file, "/x", H5T_STD_U8LE, rows, creation, zeros);
    Hdf5Dataset x = {"/x", HDF5_UINT8, 1, {0}, false};
    refused(file, x, "decompresses to more than 256 times the file");
    file = new_file();
    put_with(file, "/x", H5T_IEEE_F64LE, (hsize_t)1 << 40, chunks(1 << 20), NULL);
    refused(file, plain, "more or larger chunks");
    // chunks that were never written imply as many bytes, but are missing
    file = new_file();
    put_with(file, "/x", H5T_IEEE_F64LE, ROWS, packed(false), NULL);
    refused(file, plain, "never written");
    free(zeros);
}

static void what_is_not_there_is_refused(void **state)
{
    (void)state;
    hid_t file = new_file();
    put_with(file, "/x", H5T_IEEE_F64LE, (hsize_t)1 << 40, H5P_DEFAULT, NULL);
    refused(file, plain, "has fewer bytes");
    file = new_file();
    put_with(file, "/x", H5T_IEEE_F64LE, ROWS, chunks(10), NULL);
    refused(file, plain, "never written");
    file = new_file();
    put_with(file, "/x", H5T_IEEE_F64LE, (hsize_t)1 << 30, chunks(1), NULL);
    refused(file, plain, "more or larger chunks");
    file = new_file();
    put_with(file, "/x", H5T_IEEE_F64LE, (hsize_t)1 << 28, chunks((hsize_t)1 << 28), NULL);
    refused(file, plain, "more or larger chunks");
    // one dataset with many names uses the file's bytes only once
    file = new_file();
    put_with(file, "/x", H5T_IEEE_F64LE, ROWS, chunks(ROWS), numbers);
    H5Lcreate_hard(file, "/x", file, "/y", H5P_DEFAULT, H5P_DEFAULT);
    Hdf5Reader *reader = open_file(file);
    int read = 0;
    for (int i = 0; i < 100 && faults.count == 0; i++) {
        Hdf5Dataset x = {i % 2 ? "/x" : "/y", HDF5_DOUBLE, 1, {0}, false};
        read += hdf5_inspect(reader, &x);
    }
    struct stat status;
    assert_int_equal(stat(in_folder("a.h5"), &status), 0);
    assert_int_equal(read, status.st_size / (off_t)sizeof numbers);
    hdf5_reader_close(reader);
}

static void what_is_no_number_is_refused(void **state)
{
    (void)state;
    hid_t odd = H5Tcopy(H5T_IEEE_F64LE), pair = H5Tcreate(H5T_COMPOUND, 16), list = H5Tvlen_create(H5T_IEEE_F64LE);
    H5Tset_ebias(odd, 7);
    H5Tinsert(pair, "a", 0, H5T_IEEE_F64LE);
    const hid_t type[] = {odd, pair, list, H5T_STD_REF_OBJ, H5T_STD_I32LE, H5T_STD_B64LE};
    for (int i = 0; i < 6; i++) {
        hid_t file = new_file();
        put_with(file, "/x", type[i], ROWS, H5P_DEFAULT, NULL);
        refused(file, plain, "wrong type; expected IEEE floats");
    }
    hid_t file = new_file();
    put_numbers(file, "/x", H5T_IEEE_F64LE);
    refused(file, (Hdf5Dataset){"/x", HDF5_INT32, 1, {0}, false}, "wrong type; expected integers");
    file = new_file();
    put_numbers(file, "/x", H5T_IEEE_F64LE);
    refused(file, (Hdf5Dataset){"/x", HDF5_DOUBLE, 1, {ROWS - 1}, false}, "wrong shape (50); expected (49)");
    file = new_file();
    put_numbers(file, "/x", H5T_IEEE_F64LE);
    refused(file, (Hdf5Dataset){"/x", HDF5_DOUBLE, 2, {0, 3}, false}, "wrong shape (50); expected (any, 3)");
    static const double bad[] = {(double)NAN, (double)INFINITY, -(double)INFINITY};
    for (int i = 0; i < 3; i++) {
        double some[ROWS] = {0};
        some[17] = bad[i];
        file = new_file();
        put_with(file, "/x", i ? H5T_IEEE_F32BE : H5T_IEEE_F64LE, ROWS, H5P_DEFAULT, some);
        refused(file, (Hdf5Dataset){"/x", i ? HDF5_FLOAT : HDF5_DOUBLE, 1, {0}, true}, "in row 17; expected finite numbers");
    }
    H5Tclose(odd);
    H5Tclose(pair);
    H5Tclose(list);
}

// --- attributes ---

static void put_text(hid_t file, const char *name, const char *text, bool is_variable)
{
    hid_t type = H5Tcopy(H5T_C_S1), space = H5Screate(H5S_SCALAR);
    H5Tset_size(type, is_variable ? H5T_VARIABLE : strlen(text));
    hid_t attribute = H5Acreate2(file, name, type, space, H5P_DEFAULT, H5P_DEFAULT);
    assert_true(H5Awrite(attribute, type, is_variable ? (const void *)&text : text) >= 0);
    H5Aclose(attribute);
    H5Sclose(space);
    H5Tclose(type);
}

static void put_number(hid_t file, const char *name, hsize_t count)
{
    hid_t space = H5Screate_simple(1, &count, NULL), attribute = H5Acreate2(file, name, H5T_STD_I32BE, space, H5P_DEFAULT, H5P_DEFAULT);
    assert_true(H5Awrite(attribute, H5T_NATIVE_DOUBLE, numbers + 1) >= 0);
    H5Aclose(attribute);
    H5Sclose(space);
}

static void attributes_are_texts_or_numbers(void **state)
{
    (void)state;
    hid_t file = new_file();
    put_text(file, "fixed", "unterminated", false);
    put_text(file, "variable", "of any length", true);
    put_number(file, "two", 1);
    put_number(file, "several", 3);
    Hdf5Reader *reader = open_file(file);
    char *fixed = hdf5_text_attribute(reader, "/", "fixed"), *variable = hdf5_text_attribute(reader, "/", "variable");
    assert_string_equal(fixed, "unterminated");
    assert_string_equal(variable, "of any length");
    assert_null(hdf5_text_attribute(reader, "/", "none"));
    assert_null(hdf5_text_attribute(reader, "/none", "none"));
    assert_true(hdf5_number(reader, "two", 7) == 2 && hdf5_number(reader, "none", 7) == 7);
    assert_int_equal(faults.count, 0);
    assert_null(hdf5_text_attribute(reader, "/", "two"));
    assert_true(hdf5_number(reader, "fixed", 7) == 7 && hdf5_number(reader, "several", 7) == 7);
    assert_int_equal(faults.count, 3);
    free(fixed);
    free(variable);
    hdf5_reader_close(reader);
}

int main(void)
{
    H5Eset_auto2(H5E_DEFAULT, NULL, NULL);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_is_plain_is_read),
        cmocka_unit_test(links_out_are_not_followed),
        cmocka_unit_test(data_elsewhere_are_not_read),
        cmocka_unit_test(what_is_packed_is_read),
        cmocka_unit_test(other_packings_are_refused),
        cmocka_unit_test(damaged_chunks_are_refused),
        cmocka_unit_test(bombs_are_refused),
        cmocka_unit_test(what_is_not_there_is_refused),
        cmocka_unit_test(what_is_no_number_is_refused),
        cmocka_unit_test(attributes_are_texts_or_numbers),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
