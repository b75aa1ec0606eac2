#include "cli/run_hands.h"

#include "input/input.h"

#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

static const double patience_s = 5;      // wait for the first device

struct RunHands {
    Hands *hands;
    HandSet set;
    double dt;
    unsigned buttons;            // pressed in the last step
    pthread_t printer;
    _Atomic int ending;
};

static void wait_ms(long milliseconds) { nanosleep(&(struct timespec){.tv_nsec = milliseconds * 1000000}, NULL); }

static void print_messages(Hands *hands)
{
    char text[HAND_MESSAGE_LENGTH];
    while (hands_message(hands, text, sizeof text))
        fprintf(stderr, "device: %s\n", text);
}

static void *print_until_end(void *argument)
{
    RunHands *hands = argument;
    while (!atomic_load(&hands->ending)) {
        print_messages(hands->hands);
        wait_ms(50);
    }
    print_messages(hands->hands);
    return NULL;
}

static bool is_any_ready(Hands *hands)
{
    for (int i = 0; i < HANDS_MOST; i++)
        if (atomic_load(&hands_port(hands, i)->state) == HAND_READY)
            return true;
    return false;
}

static Hands *open_devices(int map_count, const char *const *path, const ToolNames *tools, Faults *faults)
{
    DeviceMap *map[RUN_MAPS] = {0};
    HandsOptions options = hands_default_options();
    char text[HAND_MESSAGE_LENGTH];
    int before = faults->count;
    options.use_built_in = false;
    options.map_count = 0;
    for (int i = 0; i < map_count; i++) {
        if (!strcmp(path[i], "auto"))
            options.use_built_in = true;
        else if ((map[options.map_count] = device_map_load(path[i], faults)))
            device_map_find_tools(map[options.map_count++], tools, faults);
    }
    options.map = (const DeviceMap *const *)map;
    Hands *hands = faults->count == before ? hands_open(&options, faults) : NULL;
    for (int k = 0; hands && k < tools->count; k++)
        if (device_maps_share(options.map, options.map_count, tools, k, text, sizeof text))
            fprintf(stderr, "device: %s\n", text);
    for (int i = 0; i < RUN_MAPS; i++)
        free(map[i]);
    return hands;
}

RunHands *run_hands_open(int map_count, const char *const *map, const Scene *scene, Faults *faults)
{
    RunHands *hands = calloc(1, sizeof *hands);
    const ToolNames tools = scene_tool_names(scene);
    if (!hands) {
        faults_add(faults, "--device", 0, 0, "out of memory");
        return NULL;
    }
    hands->dt = scene->dt;
    hands->hands = open_devices(map_count, map, &tools, faults);
    if (!hands->hands) {
        free(hands);
        return NULL;
    }
    for (int waited_ms = 0; waited_ms < patience_s * 1000 && !is_any_ready(hands->hands); waited_ms += 10)
        wait_ms(10);
    if (!is_any_ready(hands->hands)) {
        print_messages(hands->hands);
        faults_add(faults, "--device", 0, 0, "no matching device was connected within %g s; `seldinger devices` lists the connected devices", patience_s);
        hands_close(hands->hands);
        free(hands);
        return NULL;
    }
    hand_set_init(&hands->set, scene->tool_count);
    for (int i = 0; i < HANDS_MOST * MAP_HANDS; i++)
        hand_set_add(&hands->set, hands_port(hands->hands, i / MAP_HANDS) + i % MAP_HANDS);
    if (pthread_create(&hands->printer, NULL, print_until_end, hands) == 0)
        return hands;
    faults_add(faults, "--device", 0, 0, "cannot start a thread for the messages of the devices");
    hands_close(hands->hands);
    free(hands);
    return NULL;
}

ToolCommands run_hands_command(void *context)
{
    RunHands *hands = context;
    HandGrip grip = hands->set.grip;
    unsigned before = hands->buttons;
    hand_grip_obey(&grip, hands->set.tool_count, hand_set_buttons(&hands->set), &hands->buttons);
    if (hands->buttons & ~before)
        hand_set_grip(&hands->set, &grip);
    return hand_set_command(&hands->set, hands->dt);
}

void run_hands_answer(RunHands *hands, const StepReport *report, int64_t step) { hand_set_answer(&hands->set, report, step); }

void run_hands_close(RunHands *hands)
{
    if (!hands)
        return;
    atomic_store(&hands->ending, 1);
    pthread_join(hands->printer, NULL);
    hands_close(hands->hands);
    free(hands);
}
