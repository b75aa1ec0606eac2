#include "input/device_report.h"

#include <cJSON.h>

static void print_hid(FILE *out, const HidListing *listing)
{
    char usage[32];
    fprintf(out, "%-14s %04x:%04x  %s", listing->info.path, (unsigned)listing->info.vendor_id, (unsigned)listing->info.product_id,
            listing->info.product[0] ? listing->info.product : "(no name)");
    for (int i = 0; i < listing->info.usage_count; i++) {
        hid_usage_name(listing->info.usage[i], usage, sizeof usage);
        fprintf(out, "%s%s%s", i ? ", " : " (", usage, i + 1 == listing->info.usage_count ? ")" : "");
    }
    if (listing->info.serial[0])
        fprintf(out, ", serial %s", listing->info.serial);
    if (listing->is_usable)
        fprintf(out, "\n    usable as '%s' (%s)\n", listing->map->name, listing->map->file);
    else
        fprintf(out, "\n    not usable: %s\n", listing->why);
    if (listing->force[0])
        fprintf(out, "    force: %s\n", listing->force);
}

static void print_encoder(FILE *out, const UsbDeviceInfo *device, const DeviceMap *map)
{
    fprintf(out, "%-14s %04x:%04x  %s%s%s\n", device->path, (unsigned)device->vendor_id, (unsigned)device->product_id,
            device->product[0] ? device->product : "(no name)", device->serial[0] ? ", serial " : "", device->serial);
    if (!device->may_open)
        fprintf(out, "    not usable: %s\n", device->why);
    else if (map)
        fprintf(out, "    usable as '%s' (%s), %d baud\n", map->name, map->file, map->serial.baud);
    else
        fprintf(out, "    not usable: no map fits; --map with device: {usb: ftdi} and serial: {baud, counts}\n");
}

static void print_nodes(FILE *out, const char *title, const InputNode *node, int count)
{
    fprintf(out, "\n%s\n%s", title, count > 0 ? "" : "none\n");
    for (int i = 0; i < count; i++)
        fprintf(out, "%-20s %s\n", node[i].node, node[i].name);
}

static int devices_with(const DeviceList *list, const DeviceMap *map)
{
    int count = 0;
    for (int i = 0; i < list->hid_count; i++)
        count += list->hid[i].map == map;
    for (int i = 0; i < list->usb_count; i++)
        count += list->usb_map[i] == map;
    return count;
}

// The maps of --map, so that the user sees that a file is valid even if its device is not connected.
static void print_maps(FILE *out, const DeviceList *list)
{
    if (list->own_map_count > 0)
        fprintf(out, "Maps given\n");
    for (int i = 0; i < list->own_map_count; i++) {
        int count = devices_with(list, list->map[i]);
        fprintf(out, "%s: '%s', without faults; it fits %d connected device%s\n", list->map[i]->file, list->map[i]->name, count, count == 1 ? "" : "s");
    }
    if (list->own_map_count > 0)
        fputc('\n', out);
}

void device_list_print(FILE *out, const DeviceList *list)
{
    print_maps(out, list);
    fprintf(out, "HID devices\n");
    for (int i = 0; i < list->hid_count; i++)
        print_hid(out, &list->hid[i]);
    if (list->hid_count == 0)
        fprintf(out, "none: %s\n", list->has_hidraw ? "none is plugged in" : "this system has no hidraw (/sys/class/hidraw), so no HID device can be read");
    fprintf(out, "\nUSB serial encoders (FTDI)\n");
    for (int i = 0; i < list->usb_count; i++)
        print_encoder(out, &list->usb[i], list->usb_map[i]);
    if (list->usb_count == 0)
        fprintf(out, "none: %s\n", list->has_libusb ? "none is plugged in" : "libusb does not start here");
    print_nodes(out, "Joysticks (read by the trainer's window through GLFW, so only with a display; a gamepad of a known layout needs no map)", list->joystick,
                list->joystick_count);
    print_nodes(out, "Other input devices of the system (not read directly)", list->event, list->event_count);
}

static void add_inputs(cJSON *object, const HidDescriptor *descriptor)
{
    cJSON *inputs = cJSON_AddArrayToObject(object, "inputs");
    for (int i = 0; i < descriptor->field_count; i++) {
        const HidField *field = &descriptor->field[i];
        char name[32];
        if (field->kind != HID_INPUT || field->flags & HID_CONSTANT || field->usage == 0)
            continue;
        cJSON *item = cJSON_CreateObject();
        hid_usage_name(field->usage, name, sizeof name);
        cJSON_AddStringToObject(item, "usage", name);
        cJSON_AddNumberToObject(item, "report_id", field->report_id);
        cJSON_AddNumberToObject(item, "bit", field->bit);
        cJSON_AddNumberToObject(item, "bits", field->size);
        cJSON_AddNumberToObject(item, "count", field->count);
        cJSON_AddNumberToObject(item, "logical_min", (double)field->logical_min);
        cJSON_AddNumberToObject(item, "logical_max", (double)field->logical_max);
        cJSON_AddBoolToObject(item, "relative", (field->flags & HID_RELATIVE) != 0);
        cJSON_AddItemToArray(inputs, item);
    }
}

static cJSON *device_json(const char *path, int vendor_id, int product_id, const char *product, const char *serial, bool usable, const char *why,
                          const DeviceMap *map)
{
    cJSON *object = cJSON_CreateObject();
    cJSON_AddStringToObject(object, "path", path);
    cJSON_AddNumberToObject(object, "vendor_id", vendor_id);
    cJSON_AddNumberToObject(object, "product_id", product_id);
    cJSON_AddStringToObject(object, "product", product);
    cJSON_AddStringToObject(object, "serial", serial);
    cJSON_AddBoolToObject(object, "usable", usable);
    cJSON_AddStringToObject(object, "why", usable ? "" : why);
    cJSON_AddStringToObject(object, "map", map ? map->name : "");
    return object;
}

static void add_nodes(cJSON *object, const char *name, const InputNode *node, int count)
{
    cJSON *array = cJSON_AddArrayToObject(object, name);
    for (int i = 0; i < count; i++) {
        cJSON *item = cJSON_CreateObject();
        cJSON_AddStringToObject(item, "node", node[i].node);
        cJSON_AddStringToObject(item, "name", node[i].name);
        cJSON_AddItemToArray(array, item);
    }
}

char *device_list_json(const DeviceList *list)
{
    cJSON *object = cJSON_CreateObject();
    cJSON_AddBoolToObject(object, "has_hidraw", list->has_hidraw);
    cJSON *maps = cJSON_AddArrayToObject(object, "maps");
    for (int i = 0; i < list->own_map_count; i++) {
        cJSON *item = cJSON_CreateObject();
        cJSON_AddStringToObject(item, "file", list->map[i]->file);
        cJSON_AddStringToObject(item, "name", list->map[i]->name);
        cJSON_AddNumberToObject(item, "devices", devices_with(list, list->map[i]));
        cJSON_AddItemToArray(maps, item);
    }
    cJSON *hid = cJSON_AddArrayToObject(object, "hid"), *usb = cJSON_AddArrayToObject(object, "usb");
    for (int i = 0; i < list->hid_count; i++) {
        const HidListing *one = &list->hid[i];
        cJSON *item =
            device_json(one->info.path, one->info.vendor_id, one->info.product_id, one->info.product, one->info.serial, one->is_usable, one->why, one->map);
        cJSON *usages = cJSON_AddArrayToObject(item, "usages");
        for (int k = 0; k < one->info.usage_count; k++) {
            char name[32];
            hid_usage_name(one->info.usage[k], name, sizeof name);
            cJSON_AddItemToArray(usages, cJSON_CreateString(name));
        }
        cJSON_AddStringToObject(item, "force", one->force);
        if (one->descriptor)
            add_inputs(item, one->descriptor);
        cJSON_AddItemToArray(hid, item);
    }
    for (int i = 0; i < list->usb_count; i++) {
        const UsbDeviceInfo *one = &list->usb[i];
        bool usable = one->may_open && list->usb_map[i];
        cJSON_AddItemToArray(usb, device_json(one->path, one->vendor_id, one->product_id, one->product, one->serial, usable,
                                              one->may_open ? "no map fits" : one->why, list->usb_map[i]));
    }
    add_nodes(object, "joysticks", list->joystick, list->joystick_count);
    add_nodes(object, "events", list->event, list->event_count);
    char *text = cJSON_Print(object);
    cJSON_Delete(object);
    return text;
}
