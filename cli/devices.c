// seldinger devices: what is plugged in, what of it can drive the tool, and why the rest cannot.
#include "cli/cli.h"

#include "base/base.h"
#include "cli/output_plan.h"
#include "input/input.h"

#include <stdlib.h>

typedef struct DevicesCommand {
    const char *json, *map[LIST_MAPS];
    int map_count;
    bool watch, quiet;
    double duration_s;               // of --watch; 0: until it is stopped
} DevicesCommand;

#define AT(member) OPTION_AT(DevicesCommand, member)
static const Option options[] = {
    {"map", "F.yaml", OPTION_FILE, AT(map),
     "a device map of yours (input/device_map.h explains; examples in scenes/devices); may be given several times; the first that fits a device is taken, then "
     "the "
     "built-in ones for joysticks, gamepads and multi-axis controllers",
     .count = offsetof(DevicesCommand, map_count), .times = LIST_MAPS},
    {"json", "F.json", OPTION_FILE, AT(json), "the list as JSON; - is standard output"},
    CLI_QUIET(DevicesCommand, quiet, "no list"),
    {"watch", NULL, OPTION_FLAG, AT(watch),
     "then prints each control's raw value, its least and most so far, and what the tool would be asked; Ctrl-C ends. For calibrating: let go for the centre, "
     "move "
     "each axis to its ends"},
    {"duration-s", "S", OPTION_NUMBER, AT(duration_s), "ends --watch by itself after S seconds", .least = 0.01, .most = 86400, .otherwise = ""},
};

static const char *check(void *structure)
{
    const DevicesCommand *command = structure;
    return command->duration_s > 0 && !command->watch ? "--duration-s goes with --watch" : NULL;
}

static const OptionTable table = {
    .program = "seldinger devices",
    .does = "what is plugged in, what of it drives the tool, and why the rest does not",
    .usage = "[options]",
    .intro = "Lists HID devices, USB serial encoders and joysticks: which can drive the tool, by which map, with force or not, and why not.",
    .exits = "0 done, also where no device is there; 2 wrong usage or a map with faults",
    CLI_OPTIONS(options, DevicesCommand),
    .check = check,
    .too_many = "takes no file but by --map",
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
            fprintf(stderr, "seldinger devices: no device to watch that may be read\n");
    }
    device_list_free(list);
    hid_transport_hidapi_free(transport);
    return EXIT_DONE;
}

const Verb devices_verb = {.options = &table, .call = call};
