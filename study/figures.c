#include "study/figures.h"

#include "base/base.h"

#include <stdio.h>
#include <string.h>

enum { NAME = 200, ENTRIES_MOST = 8 };

// of the computer, not of the simulation
static const char *const left_out[] = {
    "wall_s",        "real_time_factor",   "step_us", "stage_us", "stage_p99_us", "stage_p999_us", "deadline_misses", "slowed_s",
    "worst_miss_ms", "real_time_priority", NULL};

static bool is_left_out(const char *name)
{
    for (int i = 0; left_out[i]; i++)
        if (!strcmp(name, left_out[i]))
            return true;
    return false;
}

static void add_value(cJSON *to, const cJSON *value, const char *name);

static void add_list(cJSON *to, const cJSON *list, const char *name)
{
    char entry[NAME];
    int i = 0;
    for (const cJSON *item = list->child; item && i < ENTRIES_MOST; item = item->next, i++) {
        if (cJSON_IsString(item)) {
            snprintf(entry, sizeof entry, "%.120s.%.60s", name, item->valuestring);
            cJSON_AddNumberToObject(to, entry, 1);
        } else {
            snprintf(entry, sizeof entry, "%.180s[%d]", name, i);
            add_value(to, item, entry);
        }
    }
}

static void add_value(cJSON *to, const cJSON *value, const char *name)
{
    char prefix[NAME];
    if (cJSON_IsNumber(value) || cJSON_IsBool(value)) {
        cJSON_AddNumberToObject(to, name, cJSON_IsNumber(value) ? value->valuedouble : cJSON_IsTrue(value));
    } else if (cJSON_IsArray(value)) {
        add_list(to, value, name);
    } else if (cJSON_IsObject(value)) {
        snprintf(prefix, sizeof prefix, "%.190s.", name);
        figures_add(to, value, prefix);
    }
}

void figures_add(cJSON *to, const cJSON *from, const char *prefix)
{
    char name[NAME];
    for (const cJSON *item = from ? from->child : NULL; item; item = item->next) {
        if (!*prefix && is_left_out(item->string))
            continue;
        snprintf(name, sizeof name, "%.140s%.55s", prefix, item->string);
        add_value(to, item, name);
    }
}

bool path_is_part_of(const char *path, const char *whole)
{
    size_t length = strlen(whole);
    return !strncmp(path, whole, length) && (!path[length] || path[length] == '.' || path[length] == '[');
}
