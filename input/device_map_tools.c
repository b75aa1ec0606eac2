// Resolves the tools of device maps in a scene.
#include "input/device_map.h"

#include "input/hand_port.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int tool_named(const ToolNames *tools, const char *name)
{
    for (int k = 0; k < tools->count; k++)
        if (!strcmp(tools->name[k], name))
            return k;
    return -1;
}

// Counts the tools of this kind and finds the outermost of them.
static int tools_of_kind(const ToolNames *tools, const char *kind, int *first)
{
    int count = 0;
    for (int k = tools->count - 1; k >= 0; k--)
        if (tools->kind[k] && !strcmp(tools->kind[k], kind))
            count++, *first = k;
    return count;
}

static void list_names(const ToolNames *tools, char *text, size_t capacity)
{
    size_t used = 0;
    for (int k = 0; k < tools->count && used < capacity; k++)
        used += (size_t)snprintf(text + used, capacity - used, "%s%s", k ? ", " : "", tools->name[k]);
}

static bool find_tool(const DeviceMap *map, MapHand *hand, const ToolNames *tools, Faults *faults)
{
    static const char *const by_choice[] = {"chosen", "outer", "inner"};
    char *end, names[TOOLS_MOST * (TOOL_NAME_SIZE + 2)] = "";
    int number = (int)strtol(hand->tool, &end, 10), index = tool_named(tools, hand->tool);
    for (size_t i = 0; index < 0 && i < sizeof by_choice / sizeof *by_choice; i++)
        if (!strcmp(hand->tool, by_choice[i]))
            return true;
    int of_kind = index < 0 ? tools_of_kind(tools, hand->tool, &index) : 1;
    if (of_kind == 0)
        index = !strcmp(hand->tool, "outermost") ? 0 : !strcmp(hand->tool, "innermost") ? tools->count - 1 : !*end && number <= tools->count ? number - 1 : -1;
    list_names(tools, names, sizeof names);
    if (of_kind > 1)
        faults_add(faults, map->file, hand->line, hand->column, "'tool' is '%s', but the scene has %d of that kind; choose one: %s", hand->tool, of_kind,
                   names);
    else if (index < 0)
        faults_add(faults, map->file, hand->line, hand->column,
                   "'tool' is '%s', but the scene has no such tool; write %s, outermost, innermost, outer, inner or chosen", hand->tool, names);
    else
        hand->drives = DRIVES_TOOL + index;
    return of_kind <= 1 && index >= 0;
}

bool device_map_find_tools(DeviceMap *map, const ToolNames *tools, Faults *faults)
{
    bool good = true;
    for (int i = 0; i < map->hand_count; i++)
        good &= find_tool(map, &map->hand[i], tools, faults);
    return good;
}

bool device_maps_share(const DeviceMap *const *map, int count, const ToolNames *tools, int tool, char *text, size_t capacity)
{
    const DeviceMap *first = NULL;
    for (int i = 0; i < count; i++)
        for (int h = 0; map[i] && h < map[i]->hand_count; h++) {
            if (map[i]->hand[h].drives != DRIVES_TOOL + tool)
                continue;
            if (first && first != map[i]) {
                snprintf(text, capacity, "%s and %s both move '%s': their rates add up", first->file, map[i]->file, tools->name[tool]);
                return true;
            }
            first = map[i];
        }
    return false;
}
