#include "sim/exercise.h"

#include <stdlib.h>
#include <string.h>

const char *const score_part_name[PART_COUNT + 1] = {"time", "fluoroscopy", "contrast", "path", "wall_force", "wall_impulse", NULL};
static const char *const par_name[PART_COUNT + 1] = {"time_s", "fluoroscopy_s", "contrast_ml", "path_ratio", "wall_force_n", "wall_impulse_n_s", NULL};

static const double longest_s = 86400, largest = 1e6;

Exercise exercise_default(void)
{
    Exercise exercise = {.target = -1, .tool = -1, .hold_s = 2, .time_limit_s = 600, .rules = {.tip_length_mm = 5, .buckling = true}, .error_points = 5};
    for (int i = 0; i < PART_COUNT; i++)
        exercise.weight[i] = 1;
    return exercise;
}

static void read_target(YamlValue value, int count, const char *const *names, Exercise *exercise)
{
    const char *name;
    if (!yaml_text(value, &name))
        return;
    for (int i = 0; i < count && exercise->target < 0; i++)
        if (!strcmp(name, names[i]))
            exercise->target = i;
    if (exercise->target < 0 && count > 0)
        yaml_fault(value, "'%.60s' is no target of this scene; the first of its %d is '%s'", name, count, names[0]);
    else if (exercise->target < 0)
        yaml_fault(value, "the scene has no 'targets'; an exercise needs one");
}

static void read_tool(YamlValue value, int count, const char *const *names, Exercise *exercise)
{
    const char *name;
    if (count == 0 || !yaml_text(value, &name))
        return;
    for (int i = 0; i < count; i++)
        if (!strcmp(name, names[i]))
            exercise->tool = i;
    if (exercise->tool < 0)
        yaml_fault(value, "'%.60s' is no tool of this scene; the first of its %d is '%s'", name, count, names[0]);
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
        yaml_fault(map->value, "no memory");
}

static void read_rules(YamlValue value, ExerciseRules *rules)
{
    static const char *const keys[] = {"tip_force_n", "tip_length_mm", "wall_force_n", "wrong_branch_mm", "blind_mm", "contrast_ml",
                                       "wire_behind_mm", "kick_mm_s", "buckling", NULL};
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

void exercise_read(YamlValue value, int target_count, const char *const *target_name, int tool_count, const char *const *tool_name, Exercise *exercise)
{
    static const char *const keys[] = {"title", "instructions", "target", "tool", "hold_s", "time_limit_s", "rules", "par", "weights", "error_points", NULL};
    *exercise = exercise_default();
    YamlMap map = yaml_map(value, keys);
    if (!map.value.node)
        return;
    read_texts(&map, exercise);
    read_target(yaml_get(&map, "target", true), target_count, target_name, exercise);
    if (yaml_has(&map, "tool"))
        read_tool(yaml_get(&map, "tool", false), tool_count, tool_name, exercise);
    yaml_map_number(&map, "hold_s", false, (NumberRange){0, 60, false}, &exercise->hold_s);
    yaml_map_number(&map, "time_limit_s", false, (NumberRange){0, longest_s, true}, &exercise->time_limit_s);
    read_rules(yaml_get(&map, "rules", false), &exercise->rules);
    YamlMap par = yaml_map(yaml_get(&map, "par", false), par_name), weight = yaml_map(yaml_get(&map, "weights", false), score_part_name);
    for (int i = 0; i < PART_COUNT; i++) {
        yaml_map_number(&par, par_name[i], false, (NumberRange){0, largest, false}, &exercise->par[i]);
        yaml_map_number(&weight, score_part_name[i], false, (NumberRange){0, 1000, false}, &exercise->weight[i]);
    }
    yaml_map_number(&map, "error_points", false, (NumberRange){0, 100, false}, &exercise->error_points);
}

void exercise_free(Exercise *exercise)
{
    if (exercise)
        free(exercise->instructions);
}
