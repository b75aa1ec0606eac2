#include "recon/hdf5_source.h"

#include <errno.h>
#include <stdbool.h>
#include <string.h>
#include <unistd.h>

static H5FD_t *driver_open(const char *name, unsigned flags, hid_t access, haddr_t most)
{
    (void)name, (void)most;
    Hdf5Source *const *source = H5Pget_driver_info(access);
    return source && !(flags & (H5F_ACC_RDWR | H5F_ACC_TRUNC | H5F_ACC_CREAT)) ? &(*source)->driver : NULL;
}

static herr_t driver_close(H5FD_t *driver)
{
    (void)driver;
    return 0;
}

// Sets the driver's flags: no metadata accumulator and no other buffer.
static herr_t driver_query(const H5FD_t *driver, unsigned long *flags)
{
    (void)driver;
    *flags = 0;
    return 0;
}

static haddr_t driver_get_eoa(const H5FD_t *driver, H5FD_mem_t type)
{
    (void)type;
    return ((const Hdf5Source *)driver)->end;
}

static herr_t driver_set_eoa(H5FD_t *driver, H5FD_mem_t type, haddr_t end)
{
    (void)type;
    ((Hdf5Source *)driver)->end = end;
    return 0;
}

static haddr_t driver_get_eof(const H5FD_t *driver, H5FD_mem_t type)
{
    (void)type;
    return ((const Hdf5Source *)driver)->length;
}

static bool read_file(Hdf5Source *source, char *data, size_t size, haddr_t address)
{
    while (size > 0) {
        ssize_t got = pread(source->file, data, size, (off_t)address);
        if (got < 0 && errno == EINTR)
            continue;
        if (got <= 0) {
            source->reason = got < 0 ? errno : EIO;      // got 0: the file became shorter
            return false;
        }
        data += got, address += (haddr_t)got, size -= (size_t)got;
    }
    return true;
}

static herr_t driver_read(H5FD_t *driver, H5FD_mem_t type, hid_t transfer, haddr_t address, size_t size, void *data)
{
    (void)type, (void)transfer;
    Hdf5Source *source = (Hdf5Source *)driver;
    if (size > source->length || address > source->length - size)
        return -1;
    if (source->file >= 0)
        return read_file(source, data, size, address) ? 0 : -1;
    memcpy(data, (const char *)source->bytes + address, size);
    return 0;
}

static herr_t driver_write(H5FD_t *driver, H5FD_mem_t type, hid_t transfer, haddr_t address, size_t size, const void *data)
{
    (void)driver, (void)type, (void)transfer, (void)address, (void)size, (void)data;
    return -1;
}

static const H5FD_class_t driver_class = {
    .name = "seldinger-source",
    .maxaddr = INT64_MAX,
    .fc_degree = H5F_CLOSE_STRONG,
    .fapl_size = sizeof(Hdf5Source *),
    .open = driver_open,
    .close = driver_close,
    .query = driver_query,
    .get_eoa = driver_get_eoa,
    .set_eoa = driver_set_eoa,
    .get_eof = driver_get_eof,
    .read = driver_read,
    .write = driver_write,
    .fl_map = H5FD_FLMAP_DICHOTOMY,
};

// The driver stays registered until the program ends: a damaged file makes the library release its driver once too often.
static hid_t driver_id(void)
{
    static hid_t driver = -1;
    if (driver < 0 || H5Iis_valid(driver) <= 0)
        driver = H5FDregister(&driver_class);
    else
        H5Iinc_ref(driver);
    return driver;
}

hid_t hdf5_source_open(Hdf5Source *source)
{
    hid_t driver = driver_id(), access = H5Pcreate(H5P_FILE_ACCESS);
    bool good = driver >= 0 && access >= 0 && H5Pset_driver(access, driver, &source) >= 0;
    hid_t file = good ? H5Fopen("source", H5F_ACC_RDONLY, access) : -1;
    if (access >= 0)
        H5Pclose(access);
    return file;
}
