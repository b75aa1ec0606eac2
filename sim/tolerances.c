#include "sim/tolerances.h"

#include "sim/compare.h"

#include <stdlib.h>
#include <string.h>

// Defaults: see COMPARE_TOLERANCE_MM. Forces are derivatives of the path by a stiff tool, so rounding moves them by more than it moves the path; a contact
// that only just touches may come or go without moving anything.
const ToleranceInfo tolerance_info[TOLERANCE_COUNT] = {
    [TOLERANCE_POSITION] = {"position_mm", "position of the tool's nodes", COMPARE_TOLERANCE_MM, 1e6},
    [TOLERANCE_INSERTED] = {"inserted_mm", "inserted length", COMPARE_TOLERANCE_MM, 1e6},
    [TOLERANCE_PUSH] = {"push_n", "push at the hand", 1e-3, 1e6},
    [TOLERANCE_TORQUE] = {"torque_n_mm", "torque at the hand", 1e-3, 1e6},
    [TOLERANCE_CONTACTS] = {"contacts", "contacts with force", 1, 1e6},
    [TOLERANCE_WALL_FORCE] = {"wall_force_n", "sum of the wall's forces", 1e-3, 1e6},
    [TOLERANCE_PENETRATION] = {"penetration_mm", "deepest penetration", COMPARE_TOLERANCE_MM, 1e6},
    [TOLERANCE_TARGET_TIME] = {"target_time_s", "time at which a target is reached", 1e-6, 1e6},
};

void tolerances_read(YamlValue value, Tolerances *tolerances)
{
    const char *keys[TOLERANCE_COUNT + 1] = {0};
    for (int i = 0; i < TOLERANCE_COUNT; i++)
        keys[i] = tolerance_info[i].name;
    YamlMap map = yaml_map(value, keys);
    for (int i = 0; i < TOLERANCE_COUNT; i++)
        tolerances->given[i] = yaml_map_number(&map, keys[i], false, (NumberRange){0, tolerance_info[i].most, false}, &tolerances->value[i]);
}

bool tolerances_load(const char *path, Tolerances *tolerances, Faults *faults)
{
    int before = faults->count;
    size_t length;
    char *text = text_file_read(path, &length, faults);
    YamlReader *reader = text ? yaml_reader_open(text, length, path, faults) : NULL;
    if (reader)
        tolerances_read(yaml_root(reader), tolerances);
    if (reader)
        yaml_reader_close(reader);
    free(text);
    return faults->count == before;
}

Tolerances tolerances_of_scene(const char *text)
{
    Tolerances tolerances = {0};
    Faults *ignored = HEAP_ZEROED(1, sizeof *ignored);
    YamlReader *reader = yaml_reader_open(text, strlen(text), "scene", ignored);
    if (reader) {
        YamlMap map = yaml_map(yaml_root(reader), NULL);
        if (yaml_has(&map, "check"))
            tolerances_read(yaml_get(&map, "check", false), &tolerances);
        yaml_reader_close(reader);
    }
    free(ignored);
    return tolerances;
}

Tolerances tolerances_over(const Tolerances *strong, const Tolerances *weak)
{
    Tolerances both = *weak;
    for (int i = 0; i < TOLERANCE_COUNT; i++)
        if (strong->given[i]) {
            both.given[i] = true;
            both.value[i] = strong->value[i];
        }
    return both;
}

double tolerance_of(const Tolerances *tolerances, ToleranceQuantity quantity)
{
    return tolerances->given[quantity] ? tolerances->value[quantity] : tolerance_info[quantity].usual;
}
