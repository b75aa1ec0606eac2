// seldinger devices: lists the connected devices, which of them can drive the tool, and why the others cannot.
#include "cli/cli.h"

#include "base/base.h"
#include "cli/output_plan.h"
#include "input/input.h"

#include <stdlib.h>

typedef struct DevicesCommand {
    const char *json, *map[LIST_MAPS];
    int map_count;
    bool watch, quiet;
    double duration_s;               // of --watch; 0: until stopped
} DevicesCommand;

#define AT(member) OPTION_AT(DevicesCommand, member)
static const Option options[] = {
    {"map", "F.yaml", OPTION_FILE, AT(map),
     "your own device map (format: input/device_map.h; examples: scenes/devices); may be repeated; the first map that fits a device is used, before the "
     "built-in maps for joysticks, gamepads and multi-axis controllers",
     .count = offsetof(DevicesCommand, map_count), .times = LIST_MAPS},
    {"json", "F.json", OPTION_FILE, AT(json), "the list as JSON; - is standard output"},
    CLI_QUIET(DevicesCommand, quiet, "no list"),
    {"watch", NULL, OPTION_FLAG, AT(watch),
     "then prints each control's raw value, its minimum and maximum so far, and the resulting tool command; Ctrl-C ends. To calibrate: release for the "
     "centre, then move each axis to both ends"},
    {"duration-s", "S", OPTION_NUMBER, AT(duration_s), "ends --watch after S seconds", .least = 0.01, .most = 86400, .otherwise = ""},
};

static const char *check(void *structure)
{
    const DevicesCommand *command = structure;
    return command->duration_s > 0 && !command->watch ? "--duration-s needs --watch" : NULL;
}

static const OptionTable table = {
    .program = "seldinger devices",
    .does = "lists connected devices, which of them can drive the tool, and why the others cannot",
    .usage = "[options]",
    .intro = "Lists HID devices, USB serial encoders and joysticks: which of them can drive the tool, by which map, whether with force feedback, and why the "
             "others cannot.",
    .exits = "0 done, also if no device is connected; 2 wrong usage or a map with faults",
    CLI_OPTIONS(options, DevicesCommand),
    .check = check,
    .too_many = "takes files only with --map",
};

static bool plan_files(const DevicesCommand *command, Faults *faults)
{
    OutputPlan plan = {.faults = faults};
    output_plan_write(&plan, "--json", command->json);
    for (int i = 0; i < command->map_count; i++)
        output_plan_read(&plan, "--map", command->map[i]);
    return faults->count == 0;
}

static int call(void *structure, Faults *faults)
{
    const DevicesCommand *command = structure;
    DeviceList *list = calloc(1, sizeof *list);
    HidTransport *transport = hid_transport_hidapi();
    if (!list) {
        faults_add(faults, "devices", 0, 0, "out of memory");
    } else if (plan_files(command, faults) && device_list_load_maps(list, command->map_count, command->map, faults)) {
        device_list_look(list, transport);
        if (command->json)
            output_write_line(command->json, device_list_json(list), faults);
        if (!command->quiet && !cli_is_standard_output(command->json))
            device_list_print(stdout, list);
        if (command->watch && transport && !devices_watch(transport, list->hid, list->hid_count, command->duration_s))
            fprintf(stderr, "seldinger devices: no readable device to watch\n");
    }
    device_list_free(list);
    hid_transport_hidapi_free(transport);
    return EXIT_DONE;
}

const Verb devices_verb = {.options = &table, .call = call};
