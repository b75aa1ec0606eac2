#include "sim/guide.h"

#include <math.h>
#include <string.h>

static const char *const condition_key[GUIDE_CONDITIONS] = {"xray_s", "contrast_ml", "turned_deg", "inserted_mm", "tip_in", "held_s"};
static const double condition_most[GUIDE_CONDITIONS] = {3600, 1000, 36000, 10000, 0, 60};

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

// The condition of a step; a fault if there is none or more than one.
static GuideCondition find_condition(const YamlMap *map)
{
    int found = 0;
    GuideCondition condition = GUIDE_XRAY;
    for (int i = 0; i < GUIDE_CONDITIONS; i++)
        if (yaml_has(map, condition_key[i])) {
            condition = (GuideCondition)i;
            found++;
        }
    if (found != 1)
        yaml_fault(map->value, "a step has %d conditions; expected one of xray_s, contrast_ml, turned_deg, inserted_mm, tip_in, held_s", found);
    return condition;
}

void guide_read(YamlValue value, int target_count, const char *const *target, int tool_count, const char *const *tool, Guide *guide)
{
    static const char *const keys[] = {"text", "tool", "xray_s", "contrast_ml", "turned_deg", "inserted_mm", "tip_in", "held_s", NULL};
    const int count = yaml_count(value, 1, GUIDE_STEPS);
    for (int i = 0; i < count; i++) {
        GuideStep *step = &guide->step[i];
        const char *text = "";
        YamlMap map = yaml_map(yaml_item(value, i), keys);
        *step = (GuideStep){.target = -1, .tool = -1};
        if (!map.value.node)
            continue;
        YamlValue said = yaml_get(&map, "text", true);
        if (yaml_text(said, &text) && strlen(text) >= sizeof step->text)
            yaml_fault(said, "the text of a step has at most %zu bytes", sizeof step->text - 1);
        else
            strcpy(step->text, text);
        step->condition = find_condition(&map);
        if (step->condition == GUIDE_TIP_IN)
            step->target = read_name(yaml_get(&map, "tip_in", false), "target", target_count, target);
        else
            yaml_map_number(&map, condition_key[step->condition], false, (NumberRange){0, condition_most[step->condition], true}, &step->least);
        if (yaml_has(&map, "tool"))
            step->tool = read_name(yaml_get(&map, "tool", false), "tool", tool_count, tool);
    }
    guide->count = count > 0 ? count : 0;
}

const GuideStep *guide_now(const Guide *guide, const GuideProgress *progress) { return progress->done < guide->count ? &guide->step[progress->done] : NULL; }

static bool is_met(const GuideStep *step, const GuideProgress *progress, const GuideSigns *signs)
{
    const double enough = step->least * (1 - 1e-9);
    switch (step->condition) {
    case GUIDE_XRAY: return signs->xray_s - progress->from.xray_s >= enough;
    case GUIDE_CONTRAST: return signs->contrast_ml - progress->from.contrast_ml >= enough;
    case GUIDE_TURNED: return fabs(signs->turned_deg - progress->from.turned_deg) >= enough;
    case GUIDE_INSERTED: return signs->inserted_mm >= enough;
    case GUIDE_TIP_IN: return signs->is_tip_in;
    case GUIDE_HELD:
    case GUIDE_CONDITIONS: break;
    }
    return signs->held_s >= enough;
}

void guide_watch(const Guide *guide, GuideProgress *progress, const GuideSigns *signs, double now_s)
{
    const GuideStep *step = guide_now(guide, progress);
    if (!step)
        return;
    if (progress->begun == progress->done) {
        progress->begun++;
        progress->from = *signs;
    }
    if (is_met(step, progress, signs))
        progress->done_s[progress->done++] = now_s;
}
