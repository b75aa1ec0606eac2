#include "sim/exercise.h"

#include <stdlib.h>
#include <string.h>

static const double longest_s = 86400, largest = 1e6;

Exercise exercise_default(void)
{
    Exercise exercise = {.target = -1, .tool = -1, .hold_s = 2, .time_limit_s = 600, .rules = {.tip_length_mm = 5, .buckling = true}, .error_points = 5};
    exercise.stays = exercise.stays_at = -1;
    exercise.consequences = consequence_rules_default();
    for (int k = 0; k < TOOLS_MOST; k++)
        exercise.device[k] = -1;
    for (int i = 0; i < PART_COUNT; i++)
        exercise.weight[i] = 1;
    return exercise;
}

// Index of the value in `names`; -1 with a fault. `what`: "target", "tool".
static int read_name(YamlValue value, const char *what, int count, const char *const *names)
{
    const char *name;
    if (!yaml_text(value, &name))
        return -1;
    for (int i = 0; i < count; i++)
        if (!strcmp(name, names[i]))
            return i;
    if (count > 0)
        yaml_fault(value, "'%.60s' is not a %s of this scene; it has %d, the first is '%s'", name, what, count, names[0]);
    return -1;
}

static int read_target(YamlValue value, const ExerciseScene *scene)
{
    int target = read_name(value, "target", scene->target_count, scene->target);
    if (value.node && scene->target_count == 0)
        yaml_fault(value, "the scene has no 'targets'; an exercise needs one");
    return target;
}

// Reads the device required for each tool.
static void read_devices(YamlValue value, const ExerciseScene *scene, int device[TOOLS_MOST])
{
    const char *keys[TOOLS_MOST + 1] = {0};
    for (int k = 0; k < scene->tool_count; k++)
        keys[k] = scene->tool[k];
    if (scene->tool_count == 0)
        return;
    YamlMap map = yaml_map(value, keys);
    for (int k = 0; map.value.node && k < scene->tool_count; k++)
        if (yaml_has(&map, keys[k]))
            yaml_integer(yaml_get(&map, keys[k], false), 0, scene->device_count[k] - 1, &device[k]);
}

static void read_stay(YamlValue value, const ExerciseScene *scene, Exercise *exercise)
{
    static const char *const keys[] = {"tool", "target", NULL};
    YamlMap map = yaml_map(value, keys);
    if (!map.value.node)
        return;
    if (scene->tool_count > 0)
        exercise->stays = read_name(yaml_get(&map, "tool", true), "tool", scene->tool_count, scene->tool);
    exercise->stays_at = read_target(yaml_get(&map, "target", true), scene);
}

static void read_texts(const YamlMap *map, Exercise *exercise)
{
    const char *text = "";
    if (yaml_text(yaml_get(map, "title", true), &text)) {
        if (strlen(text) < sizeof exercise->title)
            strcpy(exercise->title, text);
        else
            yaml_fault(yaml_get(map, "title", false), "a title has at most %zu bytes", sizeof exercise->title - 1);
    }
    text = "";
    if (yaml_has(map, "instructions") && yaml_text(yaml_get(map, "instructions", false), &text) && strlen(text) > EXERCISE_TEXT_MOST) {
        yaml_fault(yaml_get(map, "instructions", false), "instructions have at most %d bytes", EXERCISE_TEXT_MOST);
        text = "";
    }
    exercise->instructions = strdup(text);
    if (!exercise->instructions)
        yaml_fault(map->value, "out of memory");
}

static void read_rules(YamlValue value, ExerciseRules *rules)
{
    static const char *const keys[] = {"tip_force_n", "tip_length_mm",  "wall_force_n", "wrong_branch_mm", "blind_mm",
                                       "contrast_ml", "wire_behind_mm", "kick_mm_s",    "buckling",        NULL};
    const NumberRange limit = {0, largest, false};
    YamlMap map = yaml_map(value, keys);
    yaml_map_number(&map, "tip_force_n", false, limit, &rules->tip_force_n);
    yaml_map_number(&map, "tip_length_mm", false, (NumberRange){0, largest, true}, &rules->tip_length_mm);
    yaml_map_number(&map, "wall_force_n", false, limit, &rules->wall_force_n);
    yaml_map_number(&map, "wrong_branch_mm", false, limit, &rules->wrong_branch_mm);
    yaml_map_number(&map, "blind_mm", false, limit, &rules->blind_mm);
    yaml_map_number(&map, "contrast_ml", false, limit, &rules->contrast_ml);
    yaml_map_number(&map, "wire_behind_mm", false, limit, &rules->wire_behind_mm);
    yaml_map_number(&map, "kick_mm_s", false, limit, &rules->kick_mm_s);
    if (yaml_has(&map, "buckling"))
        yaml_boolean(yaml_get(&map, "buckling", false), &rules->buckling);
}

void exercise_read(YamlValue value, const ExerciseScene *scene, Exercise *exercise)
{
    static const char *const keys[] = {"title", "instructions", "level",   "target",       "tool", "exchange",     "stays", "hold_s", "time_limit_s",
                                       "rules", "par",          "weights", "error_points", "mode", "consequences", "steps", NULL};
    static const char *const mode[] = {"practice", "examination", NULL};
    *exercise = exercise_default();
    YamlMap map = yaml_map(value, keys);
    if (!map.value.node)
        return;
    read_texts(&map, exercise);
    if (yaml_has(&map, "level"))
        yaml_integer(yaml_get(&map, "level", false), 1, 5, &exercise->level);
    exercise->target = read_target(yaml_get(&map, "target", true), scene);
    if (yaml_has(&map, "tool") && scene->tool_count > 0)
        exercise->tool = read_name(yaml_get(&map, "tool", false), "tool", scene->tool_count, scene->tool);
    if (yaml_has(&map, "exchange"))
        read_devices(yaml_get(&map, "exchange", false), scene, exercise->device);
    if (yaml_has(&map, "stays"))
        read_stay(yaml_get(&map, "stays", false), scene, exercise);
    yaml_map_number(&map, "hold_s", false, (NumberRange){0, 60, false}, &exercise->hold_s);
    yaml_map_number(&map, "time_limit_s", false, (NumberRange){0, longest_s, true}, &exercise->time_limit_s);
    read_rules(yaml_get(&map, "rules", false), &exercise->rules);
    YamlMap par = yaml_map(yaml_get(&map, "par", false), score_part_par_name), weight = yaml_map(yaml_get(&map, "weights", false), score_part_name);
    for (int i = 0; i < PART_COUNT; i++) {
        yaml_map_number(&par, score_part_par_name[i], false, (NumberRange){0, largest, false}, &exercise->par[i]);
        yaml_map_number(&weight, score_part_name[i], false, (NumberRange){0, 1000, false}, &exercise->weight[i]);
    }
    yaml_map_number(&map, "error_points", false, (NumberRange){0, 100, false}, &exercise->error_points);
    if (yaml_has(&map, "mode"))
        exercise->is_examination = yaml_choice(yaml_get(&map, "mode", false), mode) == 1;
    if (yaml_has(&map, "consequences"))
        consequence_rules_read(yaml_get(&map, "consequences", false), &exercise->consequences);
    if (yaml_has(&map, "steps"))
        guide_read(yaml_get(&map, "steps", false), scene->target_count, scene->target, scene->tool_count, scene->tool, &exercise->guide);
}

void exercise_free(Exercise *exercise)
{
    if (exercise)
        free(exercise->instructions);
}
