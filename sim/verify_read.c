// The `verify:` key: YAML to a VerifyPlan. Format: scenes/verify/README.md.
#include "sim/verify.h"

#include "sim/yaml_vector.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

const char *const verify_quantity_name[] = {
    "position_mm",  "tangent_deg",      "twist_deg",      "push_force_n", "push_torque_n_mm", "elastic_energy_mj", "kinetic_energy_mj",
    "wall_force_n", "wall_moment_n_mm", "wall_centre_mm", "contacts",     "penetration_mm",   "fastest_mm_s",      NULL};
const char *const verify_take_name[] = {"last", "change", "mean", "least", "most", "jump", "frequency", "decay", NULL};

static const double longest_s = 1e5, largest = 1e12;

// The keys that a quantity takes; a key without effect is a fault.
typedef struct Needs {
    bool s, range, axis_must, axis_may, origin, tool;
} Needs;
static const Needs needs[] = {
    [VERIFY_POSITION] = {.s = true, .axis_may = true, .origin = true, .tool = true},
    [VERIFY_TANGENT] = {.s = true, .axis_must = true, .tool = true},
    [VERIFY_TWIST] = {.range = true, .tool = true},
    [VERIFY_PUSH_FORCE] = {.tool = true},
    [VERIFY_PUSH_TORQUE] = {.tool = true},
    [VERIFY_WALL_FORCE] = {.range = true, .axis_may = true},
    [VERIFY_WALL_MOMENT] = {.range = true, .axis_must = true, .origin = true},
    [VERIFY_WALL_CENTRE] = {.range = true},
    [VERIFY_CONTACTS] = {.range = true},
    [VERIFY_PENETRATION] = {.range = true},
    [VERIFY_SPEED] = {0},
};

static void refuse(const YamlMap *map, const char *key, const char *because)
{
    if (yaml_has(map, key))
        yaml_fault(yaml_get(map, key, false), "'%s' has no effect here; %s", key, because);
}

// A number from 0 to the tool's length, or `end`.
static void read_s(const YamlMap *map, const char *key, bool required, double total_length, double *s)
{
    YamlValue value = yaml_get(map, key, required);
    const char *text = yaml_scalar(value);
    if (text && !strcmp(text, "end"))
        *s = total_length;
    else if (value.node)
        yaml_number(value, (NumberRange){0, total_length, false}, s);
}

static void read_place(const YamlMap *map, const VerifyTools *tools, VerifyCase *c)
{
    Needs need = needs[c->quantity];
    const char *quantity = verify_quantity_name[c->quantity];
    char because[96];
    snprintf(because, sizeof because, "the quantity '%s' does not use it", quantity);
    bool together = tools->names.count > 1 && !need.tool;    // for the quantity of all tools together, which have no common arc length
    if (need.tool && yaml_has(map, "tool"))
        c->tool = yaml_choice(yaml_get(map, "tool", false), tools->names.name);
    else
        refuse(map, "tool", because);
    c->tool = c->tool > 0 ? c->tool : 0;
    double total_length = tools->length[c->tool] > 0 ? tools->length[c->tool] : 1e5;
    if (together && need.range) {
        need.range = false;
        snprintf(because, sizeof because, "'%s' of several tools covers all of them", quantity);
    }
    c->s_mm = together ? HUGE_VAL : total_length;
    if (need.s || need.range)
        read_s(map, "s_mm", need.s, total_length, &c->s_mm);
    else
        refuse(map, "s_mm", because);
    if (need.range)
        read_s(map, "from_s_mm", false, total_length, &c->from_s_mm);
    else
        refuse(map, "from_s_mm", because);
    if (c->from_s_mm > c->s_mm)
        yaml_fault(yaml_get(map, "from_s_mm", false), "'from_s_mm' %g lies beyond 's_mm' %g", c->from_s_mm, c->s_mm);
    if (need.axis_must || need.axis_may)
        c->has_axis = yaml_map_unit_vector(map, "axis", need.axis_must, &c->axis);
    else
        refuse(map, "axis", because);
    if (need.origin)
        yaml_map_vector(map, "origin_mm", false, 1e6, &c->origin);
    else
        refuse(map, "origin_mm", because);
}

static void read_time(const YamlMap *map, VerifyCase *c)
{
    NumberRange time = {0, longest_s, false};
    c->t_s = HUGE_VAL;
    yaml_map_number(map, "t_s", false, time, &c->t_s);
    if (c->take == TAKE_LAST)
        refuse(map, "from_t_s", "'take' is 'last': the value at 't_s', or at the end");
    else
        yaml_map_number(map, "from_t_s", false, time, &c->from_t_s);
    if (c->from_t_s >= c->t_s)
        yaml_fault(map->value, "'from_t_s' %g is not before 't_s' %g", c->from_t_s, c->t_s);
    if (c->take == TAKE_FREQUENCY || c->take == TAKE_DECAY)
        yaml_map_number(map, "level", false, (NumberRange){-largest, largest, false}, &c->level);
    else
        refuse(map, "level", "it applies only to 'take' frequency or decay");
}

// `tolerance` or `tolerance_percent` of the reference: a number, or a list with one for each number of elements.
static void read_tolerance(const YamlMap *map, const VerifyPlan *plan, VerifyCase *c)
{
    bool percent = yaml_has(map, "tolerance_percent");
    if (percent && yaml_has(map, "tolerance"))
        yaml_fault(yaml_get(map, "tolerance", false), "a second tolerance; expected either 'tolerance' or 'tolerance_percent'");
    YamlValue value = yaml_get(map, percent ? "tolerance_percent" : "tolerance", true);
    int runs = plan->element_count > 0 ? plan->element_count : 1, count = yaml_is_list(value) ? yaml_count(value, runs, runs) : 1;
    for (int i = 0; i < count; i++) {
        YamlValue item = yaml_is_list(value) ? yaml_item(value, i) : value;
        if (value.node && yaml_number(item, (NumberRange){0, largest, true}, &c->tolerance[i]) && percent)
            c->tolerance[i] *= fabs(c->reference) / 100;
    }
    c->tolerance_count = count > 0 ? count : 1;
    if (percent && c->reference == 0)
        yaml_fault(value, "a percentage of a reference of 0 is meaningless; use 'tolerance', which is absolute");
}

static void read_case(YamlValue value, const VerifyTools *tools, const VerifyPlan *plan, VerifyCase *c)
{
    static const char *const keys[] = {"name",     "quantity", "tool",  "take",      "s_mm",      "from_s_mm",         "axis",  "origin_mm", "t_s",
                                       "from_t_s", "level",    "scale", "reference", "tolerance", "tolerance_percent", "order", "floor",     NULL};
    YamlMap map = yaml_map(value, keys);
    const char *name;
    c->scale = 1;
    if (!map.value.node)
        return;
    if (yaml_text(yaml_get(&map, "name", true), &name)) {
        if (strlen(name) < sizeof c->name)
            strcpy(c->name, name);
        else
            yaml_fault(yaml_get(&map, "name", false), "a case's name has at most %zu letters", sizeof c->name - 1);
    }
    YamlValue quantity = yaml_get(&map, "quantity", true);
    int choice = quantity.node ? yaml_choice(quantity, verify_quantity_name) : -1;
    int take = yaml_has(&map, "take") ? yaml_choice(yaml_get(&map, "take", false), verify_take_name) : TAKE_LAST;
    c->take = take >= 0 ? (VerifyTake)take : TAKE_LAST;
    if (choice >= 0) {
        c->quantity = (VerifyQuantity)choice;
        read_place(&map, tools, c);
    }
    if (take >= 0)
        read_time(&map, c);
    yaml_map_number(&map, "reference", true, (NumberRange){-largest, largest, false}, &c->reference);
    if (yaml_map_number(&map, "scale", false, (NumberRange){-largest, largest, false}, &c->scale) && c->scale == 0)
        yaml_fault(yaml_get(&map, "scale", false), "'scale' is 0; the result is divided by it");
    read_tolerance(&map, plan, c);
    yaml_map_number(&map, "order", false, (NumberRange){0, 20, true}, &c->order);
    yaml_map_number(&map, "floor", false, (NumberRange){0, largest, false}, &c->floor);
    if (c->order > 0 && plan->element_count < 2)
        yaml_fault(yaml_get(&map, "order", false), "an order needs at least two numbers in 'verify.elements'");
}

void verify_read(YamlValue value, const VerifyTools *tools, bool has_script, VerifyPlan *plan)
{
    static const char *const keys[] = {"elements", "duration_s", "rest_s", "rest_speed_mm_s", "cases", NULL};
    YamlMap map = yaml_map(value, keys);
    *plan = (VerifyPlan){.duration_s = -1, .rest_speed_mm_s = 1e-3};
    if (!map.value.node)
        return;
    bool timed = yaml_map_number(&map, "duration_s", false, (NumberRange){0, longest_s, false}, &plan->duration_s);
    plan->rest_s = timed || has_script ? 0 : 20;
    yaml_map_number(&map, "rest_s", false, (NumberRange){0, longest_s, false}, &plan->rest_s);
    yaml_map_number(&map, "rest_speed_mm_s", false, (NumberRange){0, 1e3, true}, &plan->rest_speed_mm_s);
    YamlValue elements = yaml_get(&map, "elements", false);
    int count = elements.node ? yaml_count(elements, 1, VERIFY_MOST_ELEMENTS) : 0;
    for (int i = 0; i < count; i++)
        if (yaml_integer(yaml_item(elements, i), 1, 10000, &plan->element[i]) && i > 0 && plan->element[i] <= plan->element[i - 1])
            yaml_fault(yaml_item(elements, i), "'elements' falls from %d to %d; expected rising numbers", plan->element[i - 1], plan->element[i]);
    plan->element_count = count > 0 ? count : 0;

    YamlValue list = yaml_get(&map, "cases", true);
    count = yaml_count(list, 1, VERIFY_MOST_CASES);
    plan->cases = count > 0 ? calloc((size_t)count, sizeof *plan->cases) : NULL;
    if (count > 0 && !plan->cases)
        yaml_fault(list, "out of memory");
    plan->case_count = plan->cases ? count : 0;
    for (int i = 0; i < plan->case_count; i++)
        read_case(yaml_item(list, i), tools, plan, &plan->cases[i]);
}
