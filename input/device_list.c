#include "input/device_list.h"

#include "input/force_feedback.h"
#include "input/hand.h"
#include "input/map_state.h"
#include "input/own_maps.h"

#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

bool device_list_load_maps(DeviceList *list, int map_count, const char *const *path, Faults *faults)
{
    for (int i = 0; i < map_count; i++) {
        DeviceMap *map = device_map_load(path[i], faults);
        if (map)
            list->map[list->map_count++] = map;
    }
    list->map_count += own_maps_load(list->map + list->map_count, LIST_MAPS - list->map_count, faults);
    list->own_map_count = list->map_count;
    for (int i = 0; i < BUILT_IN_COUNT; i++)
        if (!(list->map[list->map_count++] = device_map_built_in((BuiltInMap)i)))
            faults_add(faults, "devices", 0, 0, "out of memory for the built-in maps");
    return faults->count == 0;
}

// Writes the usages of a device's inputs, "X Y wheel button_1 … button_8", and returns the number of axes.
static int describe_inputs(const HidDescriptor *descriptor, char *out, size_t capacity)
{
    int axes = 0, buttons = 0;
    size_t used = 0;
    out[0] = 0;
    for (int i = 0; i < descriptor->field_count; i++) {
        const HidField *field = &descriptor->field[i];
        uint32_t page = field->usage >> 16;
        char name[32];
        if (field->kind != HID_INPUT || field->flags & HID_CONSTANT || field->usage == 0)
            continue;
        if (page == 9) {
            buttons += field->count;
            continue;
        }
        if (!(field->flags & HID_VARIABLE) || (page != 1 && page != 2) || used + 60 > capacity)
            continue;
        axes++;
        hid_usage_name(field->usage, name, sizeof name);
        used += (size_t)snprintf(out + used, capacity - used, "%s%s%s", used ? ", " : "", name, field->flags & HID_RELATIVE ? " (relative)" : "");
    }
    if (buttons > 0 && used + 40 < capacity)
        snprintf(out + used, capacity - used, "%s%d buttons", used ? ", " : "", buttons);
    return axes;
}

static void explain_without_map(HidListing *listing)
{
    char inputs[600];
    int axes = describe_inputs(listing->descriptor, inputs, sizeof inputs);
    if (axes == 0)
        snprintf(listing->why, sizeof listing->why, "no axes to push or twist with%s%s; a map may use its buttons", inputs[0] ? ", only " : "", inputs);
    else
        snprintf(listing->why, sizeof listing->why, "no map fits; --map with device: {vendor_id: 0x%04x, product_id: 0x%04x} and a choice of %s",
                 (unsigned)listing->info.vendor_id, (unsigned)listing->info.product_id, inputs);
}

static void explain_force(HidListing *listing)
{
    PidLayout layout;
    char why[128];
    if (!pid_is_haptic(listing->descriptor))
        return;
    if (!pid_find(listing->descriptor, &layout, why, sizeof why))
        snprintf(listing->force, sizeof listing->force, "none: %s", why);
    else
        snprintf(listing->force, sizeof listing->force, "constant force, %lld steps in each direction%s", (long long)layout.magnitude.field.logical_max,
                 listing->map && listing->map->force.is_wanted ? "" : "; its map has no 'force'");
}

static void look_at_hid(const DeviceList *list, const HidTransport *transport, HidListing *listing)
{
    uint8_t bytes[HID_DESCRIPTOR_LIMIT];
    char why[320] = "";
    MapState state;
    Faults faults;
    faults_clear(&faults);
    int length = transport->descriptor(transport->context, listing->info.path, bytes, (int)sizeof bytes);
    if (length <= 0) {
        snprintf(listing->why, sizeof listing->why, "its report descriptor cannot be read");
        return;
    }
    listing->descriptor = hid_descriptor_parse(bytes, (size_t)length, "report descriptor", &faults);
    if (!listing->descriptor) {
        snprintf(listing->why, sizeof listing->why, "%s", faults.text[0]);
        return;
    }
    listing->map = hands_choose_map((const DeviceMap *const *)list->map, list->map_count, &listing->info);
    const DeviceMap *haptic = list->map[list->own_map_count + BUILT_IN_HID_HAPTIC];
    if (listing->map == list->map[list->own_map_count + BUILT_IN_HID_JOYSTICK] && listing->map && pid_is_haptic(listing->descriptor))
        listing->map = haptic;
    explain_force(listing);
    if (!listing->map) {
        explain_without_map(listing);
        return;
    }
    if (!map_bind_hid(listing->map, listing->descriptor, listing->info.product, &state, &faults)) {
        snprintf(listing->why, sizeof listing->why, "%s", faults.text[0]);
        return;
    }
    void *device = transport->open(transport->context, listing->info.path, why, sizeof why);
    listing->is_usable = device != NULL;
    if (device)
        transport->close(transport->context, device);
    else
        snprintf(listing->why, sizeof listing->why, "%s", why);
}

// Reads the names of the /dev/input nodes of one kind from sysfs, in the kernel's order.
static int look_at_nodes(const char *prefix, InputNode *out)
{
    int count = 0;
    DIR *folder = opendir("/sys/class/input");
    for (struct dirent *entry; folder && count < LIST_NODES && (entry = readdir(folder));) {
        char path[320];
        size_t n = strlen(prefix);
        if (strncmp(entry->d_name, prefix, n) != 0 || entry->d_name[n] < '0' || entry->d_name[n] > '9')
            continue;
        InputNode *node = &out[count++];
        snprintf(node->node, sizeof node->node, "/dev/input/%.20s", entry->d_name);
        snprintf(path, sizeof path, "/sys/class/input/%s/device/name", entry->d_name);
        FILE *file = fopen(path, "r");
        node->name[0] = 0;
        if (file && fgets(node->name, sizeof node->name, file))
            node->name[strcspn(node->name, "\n")] = 0;
        if (file)
            fclose(file);
    }
    if (folder)
        closedir(folder);
    return count;
}

static void look_at_encoders(DeviceList *list)
{
    UsbContext *usb = usb_context_open();
    list->has_libusb = usb != NULL;
    list->usb_count = usb ? usb_encoder_list(usb, list->usb, LIST_DEVICES) : 0;
    for (int i = 0; i < list->usb_count; i++)
        for (int k = 0; k < list->own_map_count && !list->usb_map[i]; k++)
            if (usb_encoder_fits(list->map[k], &list->usb[i]))
                list->usb_map[i] = list->map[k];
    usb_context_close(usb);
}

void device_list_look(DeviceList *list, const HidTransport *transport)
{
    HidDeviceInfo info[LIST_DEVICES];
    list->has_hidraw = access("/sys/class/hidraw", F_OK) == 0;
    list->hid_count = transport ? transport->list(transport->context, info, LIST_DEVICES) : 0;
    for (int i = 0; i < list->hid_count; i++) {
        list->hid[i].info = info[i];
        look_at_hid(list, transport, &list->hid[i]);
    }
    look_at_encoders(list);
    list->joystick_count = look_at_nodes("js", list->joystick);
    list->event_count = look_at_nodes("event", list->event);
}

void device_list_free(DeviceList *list)
{
    for (int i = 0; list && i < LIST_DEVICES; i++)
        free(list->hid[i].descriptor);
    for (int i = 0; list && i < LIST_MAPS + BUILT_IN_COUNT; i++)
        free(list->map[i]);
    free(list);
}
