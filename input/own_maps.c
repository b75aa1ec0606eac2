#include "input/own_maps.h"

#include <dirent.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static bool own_folder(char *out, size_t capacity)
{
    char config[4000];
    return folders_config(config, sizeof config) && snprintf(out, capacity, "%s/devices", config) < (int)capacity;
}

int own_maps_load(DeviceMap **map, int most, Faults *faults)
{
    char folder[4096];
    struct dirent **entry = NULL;
    int found = own_folder(folder, sizeof folder) ? scandir(folder, &entry, NULL, alphasort) : 0, count = 0;
    for (int i = 0; i < found; i++) {
        const char *ending = strrchr(entry[i]->d_name, '.');
        char *path = ending && !strcmp(ending, ".yaml") && count < most ? text_file_in(folder, entry[i]->d_name) : NULL;
        if (path && (map[count] = device_map_load(path, faults)))
            count++;
        free(path);
        free(entry[i]);
    }
    free(entry);
    return count;
}

char *own_map_file(int vendor_id, int product_id)
{
    char folder[4096], name[32];
    snprintf(name, sizeof name, "%04x-%04x.yaml", (unsigned)vendor_id & 0xffff, (unsigned)product_id & 0xffff);
    return own_folder(folder, sizeof folder) ? text_file_in(folder, name) : NULL;
}

bool own_map_save(int vendor_id, int product_id, const char *text, Faults *faults)
{
    char folder[4096], *file = own_map_file(vendor_id, product_id);
    bool good = false;
    if (!file || !own_folder(folder, sizeof folder))
        faults_add(faults, "devices", 0, 0, "a map cannot be kept: neither XDG_CONFIG_HOME nor HOME is set");
    else if (!folders_create(folder))
        faults_add(faults, folder, 0, 0, "cannot be created: %s", strerror(errno));
    else
        good = whole_file_write(file, text, strlen(text), faults);
    free(file);
    return good;
}
