// See hdf5_writer.h.
#include "recon/hdf5_writer.h"

#include <string.h>

bool hdf5_write_column(hid_t file, const char *path, hid_t type, int64_t rows, int columns, const void *data)
{
    hsize_t size[2] = {(hsize_t)rows, (hsize_t)columns};
    hid_t space = H5Screate_simple(columns > 0 ? 2 : 1, size, NULL), plist = H5Pcreate(H5P_DATASET_CREATE);
    bool good = space >= 0 && plist >= 0 && H5Pset_obj_track_times(plist, false) >= 0;   // no time stamps: same content, same bytes
    hid_t dataset = good ? H5Dcreate2(file, path, type, space, H5P_DEFAULT, plist, H5P_DEFAULT) : -1;
    good = dataset >= 0 && (rows == 0 || H5Dwrite(dataset, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, data) >= 0);
    if (dataset >= 0)
        good = H5Dclose(dataset) >= 0 && good;
    if (plist >= 0)
        H5Pclose(plist);
    if (space >= 0)
        H5Sclose(space);
    return good;
}

// The string has a fixed length: the heap of variable-length strings has no checksum, and damaged bytes there crash the library.
bool hdf5_write_text(hid_t object, const char *key, const char *text)
{
    hid_t type = H5Tcopy(H5T_C_S1), space = H5Screate(H5S_SCALAR);
    const char *value = text ? text : "";
    bool good = H5Tset_size(type, strlen(value) + 1) >= 0 && H5Tset_cset(type, H5T_CSET_UTF8) >= 0;
    hid_t attribute = good ? H5Acreate2(object, key, type, space, H5P_DEFAULT, H5P_DEFAULT) : -1;
    good = attribute >= 0 && H5Awrite(attribute, type, value) >= 0;
    if (attribute >= 0)
        H5Aclose(attribute);
    H5Sclose(space);
    H5Tclose(type);
    return good;
}

bool hdf5_write_long_text(hid_t file, const char *path, const char *text)
{
    hid_t type = H5Tcopy(H5T_C_S1), space = H5Screate(H5S_SCALAR), plist = H5Pcreate(H5P_DATASET_CREATE);
    bool good = H5Tset_size(type, strlen(text) + 1) >= 0 && H5Tset_cset(type, H5T_CSET_UTF8) >= 0 && H5Pset_obj_track_times(plist, false) >= 0;
    hid_t dataset = good ? H5Dcreate2(file, path, type, space, H5P_DEFAULT, plist, H5P_DEFAULT) : -1;
    good = dataset >= 0 && H5Dwrite(dataset, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, text) >= 0;
    if (dataset >= 0)
        good = H5Dclose(dataset) >= 0 && good;
    H5Pclose(plist);
    H5Sclose(space);
    H5Tclose(type);
    return good;
}

bool hdf5_write_scalar(hid_t file, const char *key, hid_t type, const void *value)
{
    hid_t space = H5Screate(H5S_SCALAR), attribute = H5Acreate2(file, key, type, space, H5P_DEFAULT, H5P_DEFAULT);
    bool good = attribute >= 0 && H5Awrite(attribute, type, value) >= 0;
    if (attribute >= 0)
        H5Aclose(attribute);
    H5Sclose(space);
    return good;
}

bool hdf5_make_group(hid_t file, const char *path)
{
    hid_t plist = H5Pcreate(H5P_GROUP_CREATE);
    H5Pset_obj_track_times(plist, false);
    hid_t group = H5Gcreate2(file, path, H5P_DEFAULT, plist, H5P_DEFAULT);
    H5Pclose(plist);
    return group >= 0 && H5Gclose(group) >= 0;
}
