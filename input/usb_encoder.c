// The interface to libusb: find, claim and read devices; ftdi_stream.c decodes the bytes.
#include "input/usb_encoder.h"

#include <libusb-1.0/libusb.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { FTDI_VENDOR = 0x0403, CONTROL_MS = 500, TRANSFER_BYTES = 4096 };
enum { REQUEST_TYPE = LIBUSB_REQUEST_TYPE_VENDOR | LIBUSB_RECIPIENT_DEVICE | LIBUSB_ENDPOINT_OUT };

struct UsbContext {
    libusb_context *libusb;
};

struct UsbEncoder {
    libusb_device_handle *handle;
    FtdiStream stream;
    uint8_t endpoint;
    size_t packet_size;
};

UsbContext *usb_context_open(void)
{
    UsbContext *context = calloc(1, sizeof *context);
    if (context && libusb_init(&context->libusb) != 0) {
        free(context);
        return NULL;
    }
    return context;
}

void usb_context_close(UsbContext *context)
{
    if (!context)
        return;
    libusb_exit(context->libusb);
    free(context);
}

// "usb 1-4.2": the bus and the ports on the path to the device; the same when it is plugged in again at the same port
static void device_path(libusb_device *device, char *out, size_t capacity)
{
    uint8_t port[7];
    int count = libusb_get_port_numbers(device, port, (int)sizeof port);
    size_t used = (size_t)snprintf(out, capacity, "usb %d-", libusb_get_bus_number(device));
    for (int i = 0; i < count && used + 4 < capacity; i++)
        used += (size_t)snprintf(out + used, capacity - used, i ? ".%d" : "%d", port[i]);
}

static void read_strings(libusb_device *device, const struct libusb_device_descriptor *descriptor, UsbDeviceInfo *info)
{
    libusb_device_handle *handle;
    int code = libusb_open(device, &handle);
    info->may_open = code == 0;
    if (code == LIBUSB_ERROR_ACCESS)
        snprintf(info->why, sizeof info->why, "no permission; add the udev rule SUBSYSTEM==\"usb\", ATTR{idVendor}==\"%04x\", TAG+=\"uaccess\"",
                 (unsigned)descriptor->idVendor);
    else if (code != 0)
        snprintf(info->why, sizeof info->why, "%s", libusb_strerror((enum libusb_error)code));
    if (code != 0)
        return;
    libusb_get_string_descriptor_ascii(handle, descriptor->iSerialNumber, (unsigned char *)info->serial, (int)sizeof info->serial);
    libusb_get_string_descriptor_ascii(handle, descriptor->iProduct, (unsigned char *)info->product, (int)sizeof info->product);
    libusb_close(handle);
}

int usb_encoder_list(UsbContext *context, UsbDeviceInfo *out, int capacity)
{
    libusb_device **all;
    ssize_t listed = libusb_get_device_list(context->libusb, &all);
    int count = 0;
    for (ssize_t i = 0; i < listed && count < capacity; i++) {
        struct libusb_device_descriptor descriptor;
        if (libusb_get_device_descriptor(all[i], &descriptor) != 0 || descriptor.idVendor != FTDI_VENDOR)
            continue;
        UsbDeviceInfo *info = &out[count++];
        *info = (UsbDeviceInfo){.vendor_id = descriptor.idVendor, .product_id = descriptor.idProduct};
        device_path(all[i], info->path, sizeof info->path);
        read_strings(all[i], &descriptor, info);
    }
    if (listed >= 0)
        libusb_free_device_list(all, 1);
    return count;
}

bool usb_encoder_fits(const DeviceMap *map, const UsbDeviceInfo *device)
{
    // chips that are serial ports by default; other products with this vendor id are used only if the map selects them
    static const uint16_t serial_chips[] = {0x6001, 0x6010, 0x6011, 0x6014, 0x6015};
    const MapDevice *wanted = &map->device;
    bool is_known = wanted->product_id == device->product_id || (wanted->serial[0] && wanted->product_id < 0);
    for (size_t i = 0; i < sizeof serial_chips / sizeof *serial_chips; i++)
        is_known |= wanted->product_id < 0 && serial_chips[i] == device->product_id;
    return wanted->kind == MAP_FTDI && is_known && (wanted->vendor_id < 0 || wanted->vendor_id == device->vendor_id) &&
           (!wanted->serial[0] || !strcmp(wanted->serial, device->serial));
}

static libusb_device_handle *open_path(UsbContext *context, const char *path, char *why, size_t capacity)
{
    libusb_device **all;
    libusb_device_handle *handle = NULL;
    ssize_t listed = libusb_get_device_list(context->libusb, &all);
    snprintf(why, capacity, "%s was disconnected", path);
    for (ssize_t i = 0; i < listed; i++) {
        char at[32];
        device_path(all[i], at, sizeof at);
        if (strcmp(at, path) != 0)
            continue;
        int code = libusb_open(all[i], &handle);
        if (code != 0) {
            handle = NULL;
            snprintf(why, capacity, "cannot open %s: %s", path, libusb_strerror((enum libusb_error)code));
        }
        break;
    }
    if (listed >= 0)
        libusb_free_device_list(all, 1);
    return handle;
}

// Finds the bulk-in endpoint of interface 0. Returns false if there is none: not a serial chip.
static bool find_endpoint(UsbEncoder *encoder, int *port)
{
    struct libusb_config_descriptor *config;
    if (libusb_get_active_config_descriptor(libusb_get_device(encoder->handle), &config) != 0)
        return false;
    *port = config->bNumInterfaces > 1;
    for (int i = 0; config->bNumInterfaces > 0 && config->interface[0].num_altsetting > 0 && i < config->interface[0].altsetting[0].bNumEndpoints; i++) {
        const struct libusb_endpoint_descriptor *endpoint = &config->interface[0].altsetting[0].endpoint[i];
        if (endpoint->bEndpointAddress & LIBUSB_ENDPOINT_IN && (endpoint->bmAttributes & 3) == LIBUSB_TRANSFER_TYPE_BULK && encoder->packet_size == 0) {
            encoder->endpoint = endpoint->bEndpointAddress;
            encoder->packet_size = endpoint->wMaxPacketSize & 0x7ff;
        }
    }
    libusb_free_config_descriptor(config);
    return encoder->packet_size > 2;
}

// Returns 0 or a libusb error code.
static int set_up(UsbEncoder *encoder, int baud, int port)
{
    FtdiRequest request[FTDI_SET_UP];
    ftdi_set_up(baud, port, request);
    for (int i = 0; i < FTDI_SET_UP; i++) {
        int code = libusb_control_transfer(encoder->handle, REQUEST_TYPE, request[i].request, request[i].value, request[i].index, NULL, 0, CONTROL_MS);
        if (code < 0)
            return code;
    }
    return 0;
}

UsbEncoder *usb_encoder_open(UsbContext *context, const char *path, const MapSerial *serial, char *why, size_t capacity)
{
    UsbEncoder *encoder = calloc(1, sizeof *encoder);
    int port = 0, code = 0;
    if (!encoder || !(encoder->handle = open_path(context, path, why, capacity))) {
        free(encoder);
        return NULL;
    }
    // if detaching fails, claiming the interface reports it
    libusb_set_auto_detach_kernel_driver(encoder->handle, 1);
    bool has_endpoint = find_endpoint(encoder, &port);
    if (!has_endpoint || (code = libusb_claim_interface(encoder->handle, 0)) != 0) {
        snprintf(why, capacity, "%s: %s", path, has_endpoint ? libusb_strerror((enum libusb_error)code) : "has no serial port");
        libusb_close(encoder->handle);
        free(encoder);
        return NULL;
    }
    if ((code = set_up(encoder, serial->baud, port)) != 0) {
        snprintf(why, capacity, "cannot set up %s: %s", path, libusb_strerror((enum libusb_error)code));
        usb_encoder_close(encoder);
        return NULL;
    }
    ftdi_stream_start(&encoder->stream);
    return encoder;
}

int usb_encoder_read(UsbEncoder *encoder, const MapSerial *serial, int timeout_ms, EncoderTake *take, void *context)
{
    uint8_t bytes[TRANSFER_BYTES];
    int length = 0;
    int code = libusb_bulk_transfer(encoder->handle, encoder->endpoint, bytes, (int)sizeof bytes, &length, (unsigned)timeout_ms);
    ftdi_stream_take(&encoder->stream, serial, bytes, (size_t)length, encoder->packet_size, take, context);
    return code == 0 || code == LIBUSB_ERROR_TIMEOUT || code == LIBUSB_ERROR_OVERFLOW || code == LIBUSB_ERROR_INTERRUPTED ? length : -1;
}

const FtdiStream *usb_encoder_stream(const UsbEncoder *encoder) { return &encoder->stream; }

void usb_encoder_close(UsbEncoder *encoder)
{
    if (!encoder)
        return;
    libusb_release_interface(encoder->handle, 0);    // reattaches ftdi_sio
    libusb_close(encoder->handle);
    free(encoder);
}
