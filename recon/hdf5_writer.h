// Columns, attributes and groups of our HDF5 files: without time stamps, so that the same content gives the same bytes. Internal to recon. All return false if
// the library fails.
#ifndef SELDINGER_RECON_HDF5_WRITER_H
#define SELDINGER_RECON_HDF5_WRITER_H

#include <hdf5.h>
#include <stdbool.h>
#include <stdint.h>

// `columns` 0: an array of one dimension. The type is the same in memory and in the file.
bool hdf5_write_column(hid_t file, const char *path, hid_t type, int64_t rows, int columns, const void *data);
// An attribute of text; NULL is the empty text.
bool hdf5_write_text(hid_t object, const char *key, const char *text);
// A dataset of one text, which may be long.
bool hdf5_write_long_text(hid_t file, const char *path, const char *text);
bool hdf5_write_scalar(hid_t file, const char *key, hid_t type, const void *value);
bool hdf5_make_group(hid_t file, const char *path);

#endif
