// hidapi 0.13 stores its last error in one global string, so listing and opening take a lock; reading and writing access only their own device.
#include "input/hid_device.h"

#include <errno.h>
#include <fcntl.h>
#include <hidapi/hidapi.h>
#include <linux/hidraw.h>
#include <pthread.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <unistd.h>
#include <wchar.h>

typedef struct Hidapi {
    pthread_mutex_t lock;
} Hidapi;

// Converts wide characters of any value to UTF-8, truncated if they do not fit.
static void utf8(const wchar_t *wide, char *out, size_t capacity)
{
    size_t used = 0;
    for (; wide && *wide && used + 5 < capacity; wide++) {
        uint32_t c = (uint32_t)*wide;
        if (c < 0x20 || c == 0x7f || (c >= 0xd800 && c < 0xe000) || c > 0x10ffff)
            c = '?';
        if (c < 0x80) {
            out[used++] = (char)c;
        } else {
            int more = c < 0x800 ? 1 : c < 0x10000 ? 2 : 3;
            out[used++] = (char)((0xff00u >> (more + 1) & 0xff) | c >> 6 * more);
            while (more--)
                out[used++] = (char)(0x80 | (c >> 6 * more & 0x3f));
        }
    }
    out[used] = 0;
}

static void add_usage(HidDeviceInfo *info, uint32_t usage)
{
    for (int i = 0; i < info->usage_count; i++)
        if (info->usage[i] == usage)
            return;
    if (usage && info->usage_count < HID_USAGES_LISTED)
        info->usage[info->usage_count++] = usage;
}

// hidapi lists a device once for each of its collections; this merges them into one.
static int list(void *context, HidDeviceInfo *out, int capacity)
{
    Hidapi *hidapi = context;
    int count = 0;
    pthread_mutex_lock(&hidapi->lock);
    struct hid_device_info *all = hid_enumerate(0, 0);
    for (const struct hid_device_info *one = all; one; one = one->next) {
        int at = 0;
        if (!one->path || strlen(one->path) >= sizeof out->path)
            continue;
        while (at < count && strcmp(out[at].path, one->path) != 0)
            at++;
        if (at == capacity)
            continue;
        if (at == count) {
            count++;
            out[at] = (HidDeviceInfo){.vendor_id = one->vendor_id, .product_id = one->product_id, .interface_number = one->interface_number};
            snprintf(out[at].path, sizeof out[at].path, "%s", one->path);
            utf8(one->serial_number, out[at].serial, sizeof out[at].serial);
            utf8(one->product_string, out[at].product, sizeof out[at].product);
        }
        add_usage(&out[at], (uint32_t)one->usage_page << 16 | one->usage);
    }
    hid_free_enumeration(all);
    pthread_mutex_unlock(&hidapi->lock);
    return count;
}

// The udev rule that gives the logged-in user access to this device and to no other (keyboards must stay private).
static void udev_rule(const char *path, char *out, size_t capacity)
{
    char name[256], line[160];
    const char *base = strrchr(path, '/');
    unsigned bus, vendor, product;
    snprintf(out, capacity, "KERNEL==\"hidraw*\", TAG+=\"uaccess\"");
    snprintf(name, sizeof name, "/sys/class/hidraw/%.100s/device/uevent", base ? base + 1 : path);
    FILE *file = fopen(name, "r");
    while (file && fgets(line, (int)sizeof line, file))
        if (sscanf(line, "HID_ID=%x:%x:%x", &bus, &vendor, &product) == 3)
            snprintf(out, capacity, "KERNEL==\"hidraw*\", KERNELS==\"*:%04X:%04X.*\", TAG+=\"uaccess\"", vendor & 0xffff, product & 0xffff);
    if (file)
        fclose(file);
}

static void *open_device(void *context, const char *path, char *why, size_t capacity)
{
    Hidapi *hidapi = context;
    if (access(path, R_OK | W_OK) != 0) {
        int code = errno;
        char rule[120];
        udev_rule(path, rule, sizeof rule);
        if (code == EACCES || code == EPERM)
            snprintf(why, capacity,
                     "you have no permission to read and write %s; as root: echo '%s' >> /etc/udev/rules.d/70-seldinger.rules && udevadm control --reload; "
                     "then plug it in again",
                     path, rule);
        else
            snprintf(why, capacity, "%s: %s", path, strerror(code));
        return NULL;
    }
    pthread_mutex_lock(&hidapi->lock);
    hid_device *device = hid_open_path(path);
    pthread_mutex_unlock(&hidapi->lock);
    if (!device)
        snprintf(why, capacity, "hidapi cannot open %s", path);
    return device;
}

static int read_sysfs_descriptor(const char *path, uint8_t *bytes, int capacity)
{
    char name[256];
    const char *base = strrchr(path, '/');
    snprintf(name, sizeof name, "/sys/class/hidraw/%.100s/device/report_descriptor", base ? base + 1 : path);
    int file = open(name, O_RDONLY | O_CLOEXEC), length = 0;
    if (file < 0)
        return -1;
    for (ssize_t n; length < capacity && (n = read(file, bytes + length, (size_t)(capacity - length))) > 0;)
        length += (int)n;
    close(file);
    return length > 0 ? length : -1;
}

static int read_descriptor(void *context, const char *path, uint8_t *bytes, int capacity)
{
    (void)context;
    int length = read_sysfs_descriptor(path, bytes, capacity), size = 0;
    if (length > 0)
        return length;
    struct hidraw_report_descriptor descriptor = {0};
    int file = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (file < 0)
        return -1;
    bool good = ioctl(file, HIDIOCGRDESCSIZE, &size) >= 0 && size > 0 && size <= (int)sizeof descriptor.value && size <= capacity;
    descriptor.size = (uint32_t)size;
    good = good && ioctl(file, HIDIOCGRDESC, &descriptor) >= 0;
    close(file);
    if (!good)
        return -1;
    memcpy(bytes, descriptor.value, (size_t)size);
    return size;
}

static int read_report(void *context, void *device, uint8_t *bytes, int capacity, int timeout_ms)
{
    (void)context;
    return hid_read_timeout(device, bytes, (size_t)capacity, timeout_ms);
}

static int write_report(void *context, void *device, const uint8_t *bytes, int length)
{
    (void)context;
    return hid_write(device, bytes, (size_t)length);
}

static int send_feature(void *context, void *device, const uint8_t *bytes, int length)
{
    (void)context;
    return hid_send_feature_report(device, bytes, (size_t)length);
}

static int get_feature(void *context, void *device, uint8_t *bytes, int capacity)
{
    (void)context;
    return hid_get_feature_report(device, bytes, (size_t)capacity);
}

static void close_device(void *context, void *device)
{
    (void)context;
    hid_close(device);
}

HidTransport *hid_transport_hidapi(void)
{
    HidTransport *transport = calloc(1, sizeof *transport);
    Hidapi *hidapi = calloc(1, sizeof *hidapi);
    if (!transport || !hidapi || hid_init() != 0 || pthread_mutex_init(&hidapi->lock, NULL) != 0) {
        free(transport);
        free(hidapi);
        return NULL;
    }
    *transport = (HidTransport){.context = hidapi,
                                .list = list,
                                .open = open_device,
                                .descriptor = read_descriptor,
                                .read = read_report,
                                .write = write_report,
                                .send_feature = send_feature,
                                .get_feature = get_feature,
                                .close = close_device};
    return transport;
}

void hid_transport_hidapi_free(HidTransport *transport)
{
    if (!transport)
        return;
    Hidapi *hidapi = transport->context;
    pthread_mutex_destroy(&hidapi->lock);
    free(hidapi);
    free(transport);
    hid_exit();
}
