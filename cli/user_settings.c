#include "cli/user_settings.h"

#include "render/render.h"

#include <stdio.h>

static void print_faults(const Faults *faults)
{
    static char text[(FAULTS_CAPACITY + 1) * FAULT_LENGTH];
    faults_print(faults, text, sizeof text);
    fputs(text, stderr);
}

void cli_use_settings(void)
{
    static Faults faults;
    Settings settings;
    translation_begin();
    faults_clear(&faults);
    settings_load(&settings, &faults);
    print_faults(&faults);
    settings_put_in_force(&settings);
}

int cli_own_maps(DeviceMap **map, int most)
{
    static Faults faults;
    faults_clear(&faults);
    int count = own_maps_load(map, most, &faults);
    print_faults(&faults);
    return count;
}
