// seldinger devices: what is plugged in, what of it can drive the tool, and why the rest cannot.
#include "cli/cli.h"

#include "base/output.h"
#include "cli/devices_watch.h"
#include "cli/output_plan.h"
#include "input/force_feedback.h"
#include "input/hand.h"
#include "input/map_state.h"
#include "input/usb_encoder.h"

#include <cjson/cJSON.h>
#include <dirent.h>
#include <getopt.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { MOST_DEVICES = 64, MOST_MAPS = 16, MOST_NODES = 64 };

static const char help[] =
    "Usage: seldinger devices [--map F.yaml]... [--json F] [--quiet] [--watch [--duration-s S]]\n\n"
    "Lists HID devices, USB serial encoders and joysticks: which can drive the tool, by which map, with force or not, and why not.\n\n"
    "  --map F.yaml      a device map of yours (input/device_map.h explains; examples in scenes/devices); may be given several times;\n"
    "                    the first that fits a device is taken, then the built-in ones for joysticks, gamepads and multi-axis controllers\n"
    "  --json F          the list as JSON; - is standard output\n"
    "  --quiet           no list\n"
    "  --watch           then prints each control's raw value, its least and most so far, and what the tool would be asked; Ctrl-C ends.\n"
    "                    For calibrating: let go for the centre, move each axis to its ends\n"
    "  --duration-s S    ends --watch by itself after S seconds\n\n"
    "Exit codes: 0 done, also where no device is there; 2 wrong usage or a map with faults.\n";

typedef struct InputNode {
    char node[32], name[96];
} InputNode;

typedef struct DeviceList {
    HidListing hid[MOST_DEVICES];
    UsbDeviceInfo usb[MOST_DEVICES];
    const DeviceMap *usb_map[MOST_DEVICES];
    InputNode joystick[MOST_NODES], event[MOST_NODES];
    int hid_count, usb_count, joystick_count, event_count;
    bool has_hidraw, has_libusb;
    DeviceMap *map[MOST_MAPS + BUILT_IN_COUNT];
    int map_count, own_map_count;
} DeviceList;

// --- looking ---

// Names of the usages of a device's inputs, "X Y wheel button_1 … button_8"; the number of axes.
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
        snprintf(listing->force, sizeof listing->force, "constant force, %lld steps each way%s", (long long)layout.magnitude.field.logical_max,
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

// Names of /dev/input's nodes of one kind by sysfs, sorted as the system gives them.
static int look_at_nodes(const char *prefix, InputNode *out)
{
    int count = 0;
    DIR *folder = opendir("/sys/class/input");
    for (struct dirent *entry; folder && count < MOST_NODES && (entry = readdir(folder));) {
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
    list->usb_count = usb ? usb_encoder_list(usb, list->usb, MOST_DEVICES) : 0;
    for (int i = 0; i < list->usb_count; i++)
        for (int k = 0; k < list->own_map_count && !list->usb_map[i]; k++)
            if (usb_encoder_fits(list->map[k], &list->usb[i]))
                list->usb_map[i] = list->map[k];
    usb_context_close(usb);
}

static void look(DeviceList *list, const HidTransport *transport)
{
    HidDeviceInfo info[MOST_DEVICES];
    list->has_hidraw = access("/sys/class/hidraw", F_OK) == 0;
    list->hid_count = transport ? transport->list(transport->context, info, MOST_DEVICES) : 0;
    for (int i = 0; i < list->hid_count; i++) {
        list->hid[i].info = info[i];
        look_at_hid(list, transport, &list->hid[i]);
    }
    look_at_encoders(list);
    list->joystick_count = look_at_nodes("js", list->joystick);
    list->event_count = look_at_nodes("event", list->event);
}

// --- telling ---

static void print_hid(const HidListing *listing)
{
    char usage[32];
    printf("%-14s %04x:%04x  %s", listing->info.path, (unsigned)listing->info.vendor_id, (unsigned)listing->info.product_id,
           listing->info.product[0] ? listing->info.product : "(no name)");
    for (int i = 0; i < listing->info.usage_count; i++) {
        hid_usage_name(listing->info.usage[i], usage, sizeof usage);
        printf("%s%s%s", i ? ", " : " (", usage, i + 1 == listing->info.usage_count ? ")" : "");
    }
    if (listing->info.serial[0])
        printf(", serial %s", listing->info.serial);
    if (listing->is_usable)
        printf("\n    usable as '%s' (%s)\n", listing->map->name, listing->map->file);
    else
        printf("\n    not usable: %s\n", listing->why);
    if (listing->force[0])
        printf("    force: %s\n", listing->force);
}

static void print_encoder(const UsbDeviceInfo *device, const DeviceMap *map)
{
    printf("%-14s %04x:%04x  %s%s%s\n", device->path, (unsigned)device->vendor_id, (unsigned)device->product_id,
           device->product[0] ? device->product : "(no name)", device->serial[0] ? ", serial " : "", device->serial);
    if (!device->may_open)
        printf("    not usable: %s\n", device->why);
    else if (map)
        printf("    usable as '%s' (%s), %d baud\n", map->name, map->file, map->serial.baud);
    else
        printf("    not usable: no map fits; --map with device: {usb: ftdi} and serial: {baud, counts}\n");
}

static void print_nodes(const char *title, const InputNode *node, int count)
{
    printf("\n%s\n%s", title, count > 0 ? "" : "none\n");
    for (int i = 0; i < count; i++)
        printf("%-20s %s\n", node[i].node, node[i].name);
}

static void print_list(const DeviceList *list)
{
    printf("HID devices\n");
    for (int i = 0; i < list->hid_count; i++)
        print_hid(&list->hid[i]);
    if (list->hid_count == 0)
        printf("none: %s\n", list->has_hidraw ? "none is plugged in" : "this system has no hidraw (/sys/class/hidraw), so no HID device can be read");
    printf("\nUSB serial encoders (FTDI)\n");
    for (int i = 0; i < list->usb_count; i++)
        print_encoder(&list->usb[i], list->usb_map[i]);
    if (list->usb_count == 0)
        printf("none: %s\n", list->has_libusb ? "none is plugged in" : "libusb does not start here");
    print_nodes("Joysticks (read by the trainer's window through GLFW, so only with a display; a gamepad of a known layout needs no map)", list->joystick,
                list->joystick_count);
    print_nodes("Other input devices of the system (not read directly)", list->event, list->event_count);
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

static char *list_json(const DeviceList *list)
{
    cJSON *object = cJSON_CreateObject();
    cJSON_AddBoolToObject(object, "has_hidraw", list->has_hidraw);
    cJSON *hid = cJSON_AddArrayToObject(object, "hid"), *usb = cJSON_AddArrayToObject(object, "usb");
    for (int i = 0; i < list->hid_count; i++) {
        const HidListing *one = &list->hid[i];
        cJSON *item = device_json(one->info.path, one->info.vendor_id, one->info.product_id, one->info.product, one->info.serial,
                                  one->is_usable, one->why, one->map);
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

// --- the verb ---

typedef struct DevicesOptions {
    const char *map[MOST_MAPS], *json;
    int map_count;
    bool watch, quiet;
    double duration_s;
} DevicesOptions;

// False where the verb ends here; *code is its exit code.
static bool read_options(int argc, char **argv, DevicesOptions *options, int *code)
{
    enum { MAP = 256, JSON, WATCH, DURATION, QUIET, HELP };
    static const struct option table[] = {{"map", required_argument, NULL, MAP}, {"json", required_argument, NULL, JSON}, {"watch", no_argument, NULL, WATCH},
                                          {"duration-s", required_argument, NULL, DURATION}, {"quiet", no_argument, NULL, QUIET},
                                          {"help", no_argument, NULL, HELP}, {0}};
    *code = EXIT_BAD_INPUT;
    optind = 1;
    for (int choice; (choice = getopt_long(argc, argv, "h", table, NULL)) != -1;) {
        switch (choice) {
        case MAP:
            if (options->map_count == MOST_MAPS) {
                fprintf(stderr, "seldinger devices: at most %d maps\n", MOST_MAPS);
                return false;
            }
            options->map[options->map_count++] = optarg;
            break;
        case JSON: options->json = optarg; break;
        case QUIET: options->quiet = true; break;
        case WATCH: options->watch = true; break;
        case DURATION:
            if (!cli_number("--duration-s", optarg, 0.01, 86400, &options->duration_s))
                return false;
            break;
        case HELP:
        case 'h': fputs(help, stdout); *code = EXIT_DONE; return false;
        default: fprintf(stderr, "seldinger devices: unknown option; see `seldinger devices --help`\n"); return false;
        }
    }
    if (optind != argc || (options->duration_s > 0 && !options->watch)) {
        fprintf(stderr, "%s", optind != argc ? "seldinger devices: takes no file but by --map; see `seldinger devices --help`\n"
                                             : "--duration-s goes with --watch\n");
        return false;
    }
    return true;
}

static bool load_maps(DeviceList *list, const DevicesOptions *options, Faults *faults)
{
    for (int i = 0; i < options->map_count; i++) {
        DeviceMap *map = device_map_load(options->map[i], faults);
        if (map)
            list->map[list->map_count++] = map;
    }
    list->own_map_count = list->map_count;
    for (int i = 0; i < BUILT_IN_COUNT; i++)
        if (!(list->map[list->map_count++] = device_map_built_in((BuiltInMap)i)))
            faults_add(faults, "devices", 0, 0, "no memory for the built-in maps");
    return faults->count == 0;
}

static bool plan_output(const DevicesOptions *options, Faults *faults)
{
    OutputPlan plan = {.faults = faults};
    output_plan_write(&plan, "--json", options->json);
    for (int i = 0; i < options->map_count; i++)
        output_plan_read(&plan, "--map", options->map[i]);
    return faults->count == 0;
}

int verb_devices(int argc, char **argv)
{
    static Faults faults;
    DevicesOptions options = {0};
    int code;
    if (!read_options(argc, argv, &options, &code))
        return code;
    DeviceList *list = calloc(1, sizeof *list);
    HidTransport *transport = hid_transport_hidapi();
    faults_clear(&faults);
    if (!list) {
        faults_add(&faults, "devices", 0, 0, "no memory");
    } else if (plan_output(&options, &faults) && load_maps(list, &options, &faults)) {
        look(list, transport);
        if (options.json)
            output_write_line(options.json, list_json(list), &faults);
        if (!options.quiet && (!options.json || strcmp(options.json, "-") != 0))
            print_list(list);
        if (options.watch && transport && !devices_watch(transport, list->hid, list->hid_count, options.duration_s))
            fprintf(stderr, "seldinger devices: no device to watch that may be read\n");
    }
    for (int i = 0; list && i < MOST_DEVICES; i++)
        free(list->hid[i].descriptor);
    for (int i = 0; list && i < MOST_MAPS + BUILT_IN_COUNT; i++)
        free(list->map[i]);
    free(list);
    hid_transport_hidapi_free(transport);
    return faults.count > 0 ? cli_bad_input(&faults) : EXIT_DONE;
}
