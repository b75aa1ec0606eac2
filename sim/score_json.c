#include "sim/score_json.h"

#include "sim/score_points.h"

#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

// The plain numbers of ScoreFigures with their ranges.
static const struct Figure {
    const char *name;
    size_t offset;
    double most;                 // the range is 0 to this
    bool is_later;               // not in files of older versions
} figure_table[] = {
#define FIGURE(name, most)                                                                                                                                     \
    {                                                                                                                                                          \
#name, offsetof(ScoreFigures, name), most, false                                                                                                       \
    }
    FIGURE(points, 100),
    FIGURE(start_s, 1e7),
    FIGURE(time_s, 1e7),
    FIGURE(fluoroscopy_s, 1e7),
    FIGURE(dose_area_cm2, 1e15),
    FIGURE(contrast_ml, 1e9),
    FIGURE(path_mm, 1e12),
    FIGURE(way_mm, 1e9),
    FIGURE(remaining_mm, 1e9),
    FIGURE(least_remaining_mm, 1e9),
    FIGURE(efficiency, 1),
    FIGURE(inserted_mm, 1e12),
    FIGURE(withdrawn_mm, 1e12),
    FIGURE(wall_force_peak_n, 1e12),
    FIGURE(wall_impulse_n_s, 1e15),
    FIGURE(tip_force_peak_n, 1e12),
    FIGURE(target_distance_mm, 1e9),
    FIGURE(held_s, 1e7),
    FIGURE(reached_s, 1e7),
    {"blind_total_mm", offsetof(ScoreFigures, blind_total_mm), 1e12, true},
    {"guided_s", offsetof(ScoreFigures, guided_s), 1e7, true},
    {"air_kerma_mgy", offsetof(ScoreFigures, air_kerma_mgy), 1e12, true},
    {"kerma_area_gy_cm2", offsetof(ScoreFigures, kerma_area_gy_cm2), 1e12, true},
    {"second_kerma_mgy", offsetof(ScoreFigures, second_kerma_mgy), 1e12, true},
    {"second_kerma_area_gy_cm2", offsetof(ScoreFigures, second_kerma_area_gy_cm2), 1e12, true},
    {"mean_kv", offsetof(ScoreFigures, mean_kv), 1e6, true},
    {"mean_ma", offsetof(ScoreFigures, mean_ma), 1e6, true},
#undef FIGURE
};
enum { FIGURES = sizeof figure_table / sizeof figure_table[0] };
// the keys after those of the table; "tools" with several tools only
static const char *const other_key[] = {"state",     "has_exercise", "has_xray", "pulses",       "error_total", "parts",
                                        "points_of", "errors",       "tools",    "consequences", "steps"};
// Figures of a tool. An episode still in progress is not written.
static const struct Figure tool_table[] = {
#define FIGURE(name, most)                                                                                                                                     \
    {                                                                                                                                                          \
#name, offsetof(ScoreToolFigures, name), most, false                                                                                                   \
    }
    FIGURE(inserted_mm, 1e12),
    FIGURE(withdrawn_mm, 1e12),
    FIGURE(tip_force_peak_n, 1e12),
    FIGURE(kick_peak_mm_s, 1e12),
    FIGURE(behind_mm, 1e9),
    FIGURE(spare_mm, 1e9),
    {"strayed_mm", offsetof(ScoreToolFigures, strayed_mm), 1e9, true},
#undef FIGURE
};
enum { TOOL_FIGURES = sizeof tool_table / sizeof tool_table[0] };
// Whether files of older versions do not have this error or part.
static bool is_later(ScoreError kind) { return kind > ERROR_CONTRAST; }
static bool is_later_part(ScorePart part) { return part > PART_WALL_IMPULSE; }
enum { OTHERS = sizeof other_key / sizeof other_key[0] };

const char *score_figure_name(int index) { return index >= 0 && index < FIGURES ? figure_table[index].name : NULL; }

double score_figure(const ScoreFigures *figures, int index)
{
    double value;
    memcpy(&value, (const char *)figures + figure_table[index].offset, sizeof value);
    return value;
}

static bool add(cJSON *to, const char *name, double value) { return cJSON_AddNumberToObject(to, name, value) != NULL; }

static bool add_figures(cJSON *object, int count, const struct Figure *table, const void *figures)
{
    bool good = true;
    for (int i = 0; good && i < count; i++) {
        double value;
        memcpy(&value, (const char *)figures + table[i].offset, sizeof value);
        good = add(object, table[i].name, value);
    }
    return good;
}

static bool add_tools(cJSON *object, const ScoreFigures *f)
{
    cJSON *list = f->tool_count > 1 ? cJSON_AddArrayToObject(object, "tools") : NULL;
    for (int k = 0; list && k < f->tool_count; k++) {
        cJSON *tool = cJSON_CreateObject();
        if (!tool || !cJSON_AddItemToArray(list, tool) || !cJSON_AddStringToObject(tool, "name", f->tool[k].name) ||
            !add_figures(tool, TOOL_FIGURES, tool_table, &f->tool[k]))
            return false;
    }
    return list || f->tool_count <= 1;
}

static bool add_part(cJSON *to, const ScoreFigures *f, ScorePart part)
{
    const ScorePartFigures *judged = &f->judged[part];
    char why[120];
    score_part_reason(f, part, why, sizeof why);
    cJSON *object = cJSON_AddObjectToObject(to, score_part_name[part]);
    return object && add(object, "points", judged->points) && add(object, "most", judged->most) && add(object, "measured", judged->measured) &&
           add(object, "par", judged->par) && cJSON_AddStringToObject(object, "why", why);
}

static bool add_mark(cJSON *list, const ScoreMark *mark)
{
    cJSON *object = cJSON_CreateObject();
    const double at[3] = {mark->at.x, mark->at.y, mark->at.z};
    if (!object || !cJSON_AddItemToArray(list, object))
        return false;
    cJSON *place = cJSON_CreateDoubleArray(at, 3);
    return place && cJSON_AddStringToObject(object, "kind", score_error_name[mark->kind]) && add(object, "time_s", mark->time_s) &&
           cJSON_AddItemToObject(object, "at_mm", place) && add(object, "force_n", mark->force_n) && add(object, "limit_n", mark->limit_n) &&
           add(object, "leaked_ml", mark->leaked_ml);
}

// Only where consequences happen.
static bool add_consequences(cJSON *object, const ScoreFigures *f)
{
    if (!f->has_consequences)
        return true;
    cJSON *to = cJSON_AddObjectToObject(object, "consequences");
    bool good = to && add(to, "narrowest", f->narrowest);
    cJSON *list = good ? cJSON_AddArrayToObject(to, "marks") : NULL;
    for (int i = 0; list && good && i < f->mark_count; i++)
        good = add_mark(list, &f->mark[i]);
    return list && good;
}

// The times of the steps that were done, if there are any.
static bool add_steps(cJSON *object, const ScoreFigures *f)
{
    if (f->guide.done == 0)
        return true;
    cJSON *list = cJSON_CreateDoubleArray(f->guide.done_s, f->guide.done);
    return list && cJSON_AddItemToObject(object, "steps", list);
}

bool score_add_json(cJSON *object, const ScoreFigures *f)
{
    bool good = cJSON_AddStringToObject(object, "state", score_state_name[f->state]) && cJSON_AddBoolToObject(object, "has_exercise", f->has_exercise) &&
                cJSON_AddBoolToObject(object, "has_xray", f->has_xray);
    good = good && add_figures(object, FIGURES, figure_table, f) && add(object, "pulses", (double)f->pulses) && add(object, "error_total", f->error_total);
    cJSON *parts = good ? cJSON_AddObjectToObject(object, "parts") : NULL, *points = parts ? cJSON_AddObjectToObject(object, "points_of") : NULL;
    cJSON *errors = points ? cJSON_AddObjectToObject(object, "errors") : NULL;
    good = good && errors;
    for (int i = 0; good && i < PART_COUNT; i++)
        good = add(parts, score_part_name[i], f->part[i]) && add_part(points, f, (ScorePart)i);
    for (int i = 0; good && i < ERROR_COUNT; i++) {
        cJSON *error = cJSON_AddObjectToObject(errors, score_error_name[i]);
        good = error && add(error, "count", f->error[i].count) && add(error, "last_s", f->error[i].last_s);
    }
    return good && add_tools(object, f) && add_consequences(object, f) && add_steps(object, f);
}

char *score_json(const ScoreFigures *figures, const Scene *scene)
{
    cJSON *json = cJSON_CreateObject();
    const Exercise *exercise = scene->exercise;
    bool good = json != NULL;
    if (good && exercise)
        good = cJSON_AddStringToObject(json, "title", exercise->title) && cJSON_AddStringToObject(json, "target", scene->target[exercise->target].name);
    char *text = good && score_add_json(json, figures) ? cJSON_Print(json) : NULL;
    cJSON_Delete(json);
    return text;
}

// --- reading ---

bool json_keys(const JsonReading *reading, const cJSON *object, const char *where, const char *const *keys)
{
    if (!cJSON_IsObject(object)) {
        faults_add(reading->faults, reading->file, 0, 0, "'%s' is missing or not an object", where);
        return false;
    }
    for (const cJSON *member = object->child; member; member = member->next) {
        int known = 0;
        for (int i = 0; keys[i]; i++)
            known |= !strcmp(keys[i], member->string);
        if (!known)
            faults_add(reading->faults, reading->file, 0, 0, "unknown key '%.60s' in '%s'; the first valid key is '%s'", member->string, where, keys[0]);
        for (const cJSON *before = object->child; known && before != member; before = before->next)
            if (!strcmp(before->string, member->string))
                faults_add(reading->faults, reading->file, 0, 0, "duplicate key '%s.%.60s'", where, member->string);
    }
    return true;
}

double json_number(const JsonReading *reading, const cJSON *object, const char *where, const char *key, double least, double most)
{
    const cJSON *item = cJSON_GetObjectItemCaseSensitive(object, key);
    if (cJSON_IsNumber(item) && item->valuedouble >= least && item->valuedouble <= most)
        return item->valuedouble;
    if (cJSON_IsNumber(item))
        faults_add(reading->faults, reading->file, 0, 0, "'%s.%s' is %g; expected %g to %g", where, key, item->valuedouble, least, most);
    else
        faults_add(reading->faults, reading->file, 0, 0, "'%s.%s' is missing or not a number; expected %g to %g", where, key, least, most);
    return least;
}

int64_t json_count(const JsonReading *reading, const cJSON *object, const char *where, const char *key, int64_t most)
{
    double number = json_number(reading, object, where, key, 0, (double)most);
    if (number != floor(number))
        faults_add(reading->faults, reading->file, 0, 0, "'%s.%s' is %g; expected a whole number", where, key, number);
    return (int64_t)number;
}

int json_choice(const JsonReading *reading, const cJSON *object, const char *where, const char *key, const char *const *names)
{
    const char *text = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(object, key));
    for (int i = 0; text && names[i]; i++)
        if (!strcmp(text, names[i]))
            return i;
    faults_add(reading->faults, reading->file, 0, 0, "'%s.%s' is '%.60s'; expected '%s' or another value of that list", where, key, text ? text : "", names[0]);
    return 0;
}

void json_text(const JsonReading *reading, const cJSON *object, const char *where, const char *key, size_t capacity, char *text)
{
    const char *value = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(object, key));
    text[0] = 0;
    if (value && strlen(value) < capacity)
        strcpy(text, value);
    else
        faults_add(reading->faults, reading->file, 0, 0, "'%s.%s' is missing or not a string of at most %zu bytes", where, key, capacity - 1);
}

static bool read_flag(const JsonReading *reading, const cJSON *object, const char *key)
{
    const cJSON *item = cJSON_GetObjectItemCaseSensitive(object, key);
    if (!cJSON_IsBool(item))
        faults_add(reading->faults, reading->file, 0, 0, "'score.%s' is neither true nor false", key);
    return cJSON_IsTrue(item);
}

static void read_figures(const JsonReading *reading, const cJSON *object, const char *where, int count, const struct Figure *table, void *figures)
{
    for (int i = 0; i < count; i++) {
        if (table[i].is_later && !cJSON_GetObjectItemCaseSensitive(object, table[i].name))
            continue;
        double value = json_number(reading, object, where, table[i].name, 0, table[i].most);
        memcpy((char *)figures + table[i].offset, &value, sizeof value);
    }
}

// With a single tool there is no list.
static void read_tools(const JsonReading *reading, const cJSON *list, ScoreFigures *f)
{
    const char *keys[TOOL_FIGURES + 2] = {"name"};
    for (int i = 0; i < TOOL_FIGURES; i++)
        keys[i + 1] = tool_table[i].name;
    int count = cJSON_IsArray(list) ? cJSON_GetArraySize(list) : 0;
    if (list && (count < 2 || count > TOOLS_MOST)) {
        faults_add(reading->faults, reading->file, 0, 0, "'score.tools' is not a list of 2 to %d entries", TOOLS_MOST);
        return;
    }
    f->tool_count = list ? count : 1;
    for (int k = 0; k < count; k++) {
        const cJSON *tool = cJSON_GetArrayItem(list, k);
        f->tool[k].tip_node = -1;
        if (!json_keys(reading, tool, "score.tools", keys))
            continue;
        json_text(reading, tool, "score.tools", "name", sizeof f->tool[k].name, f->tool[k].name);
        read_figures(reading, tool, "score.tools", TOOL_FIGURES, tool_table, &f->tool[k]);
    }
}

// Absent from files of older versions. `why` follows from the rest.
static void read_points(const JsonReading *reading, const cJSON *points, ScoreFigures *f)
{
    static const char *const keys[] = {"points", "most", "measured", "par", "why", NULL};
    if (!points || !json_keys(reading, points, "score.points_of", score_part_name))
        return;
    for (int i = 0; i < PART_COUNT; i++) {
        const char *name = score_part_name[i];
        const cJSON *part = cJSON_GetObjectItemCaseSensitive(points, name);
        if (!json_keys(reading, part, name, keys))
            continue;
        f->judged[i] = (ScorePartFigures){.measured = json_number(reading, part, name, "measured", 0, 1e15),
                                          .par = json_number(reading, part, name, "par", 0, 1e6),
                                          .most = json_number(reading, part, name, "most", 0, 100),
                                          .points = json_number(reading, part, name, "points", 0, 100)};
    }
}

static void read_place(const JsonReading *reading, const cJSON *list, Vec3 *at)
{
    double value[3] = {0};
    bool good = cJSON_IsArray(list) && cJSON_GetArraySize(list) == 3;
    for (int i = 0; good && i < 3; i++) {
        const cJSON *item = cJSON_GetArrayItem(list, i);
        good = cJSON_IsNumber(item) && fabs(item->valuedouble) <= 1e9;
        value[i] = good ? item->valuedouble : 0;
    }
    if (!good)
        faults_add(reading->faults, reading->file, 0, 0, "'score.consequences.at_mm' is not a list of three numbers within 1e9");
    *at = vec3(value[0], value[1], value[2]);
}

static void read_consequences(const JsonReading *reading, const cJSON *object, ScoreFigures *f)
{
    static const char *const keys[] = {"narrowest", "marks", NULL}, *const mark_keys[] = {"kind", "time_s", "at_mm", "force_n", "limit_n", "leaked_ml", NULL};
    const char *const where = "score.consequences";
    f->narrowest = 1;
    if (!object || !json_keys(reading, object, where, keys))
        return;
    f->has_consequences = true;
    f->narrowest = json_number(reading, object, where, "narrowest", 0, 1);
    const cJSON *list = cJSON_GetObjectItemCaseSensitive(object, "marks");
    if (!cJSON_IsArray(list) || cJSON_GetArraySize(list) > SCORE_MARKS_MOST) {
        faults_add(reading->faults, reading->file, 0, 0, "'%s.marks' is not a list of at most %d entries", where, SCORE_MARKS_MOST);
        return;
    }
    for (const cJSON *item = list->child; item; item = item->next) {
        if (!json_keys(reading, item, where, mark_keys))
            continue;
        ScoreMark *mark = &f->mark[f->mark_count++];
        mark->kind = (ScoreError)(ERROR_PERFORATION + json_choice(reading, item, where, "kind", score_error_name + ERROR_PERFORATION));
        mark->time_s = json_number(reading, item, where, "time_s", 0, 1e7);
        mark->force_n = json_number(reading, item, where, "force_n", 0, 1e12);
        mark->limit_n = json_number(reading, item, where, "limit_n", 0, 1e12);
        mark->leaked_ml = json_number(reading, item, where, "leaked_ml", 0, 1e9);
        read_place(reading, cJSON_GetObjectItemCaseSensitive(item, "at_mm"), &mark->at);
    }
}

static void read_steps(const JsonReading *reading, const cJSON *list, ScoreFigures *f)
{
    if (!list)
        return;
    const int count = cJSON_IsArray(list) ? cJSON_GetArraySize(list) : -1;
    bool good = count >= 1 && count <= GUIDE_STEPS;
    for (int i = 0; good && i < count; i++) {
        const cJSON *item = cJSON_GetArrayItem(list, i);
        good = cJSON_IsNumber(item) && item->valuedouble >= 0 && item->valuedouble <= 1e7;
        f->guide.done_s[i] = good ? item->valuedouble : 0;
    }
    f->guide.done = good ? count : 0;
    if (!good)
        faults_add(reading->faults, reading->file, 0, 0, "'score.steps' is not a list of 1 to %d times in s", GUIDE_STEPS);
}

void score_read_json(const JsonReading *reading, const cJSON *object, ScoreFigures *f)
{
    static const char *const error_key[] = {"count", "last_s", NULL};
    const char *keys[FIGURES + OTHERS + 1] = {0};
    for (int i = 0; i < FIGURES; i++)
        keys[i] = figure_table[i].name;
    for (int i = 0; i < OTHERS; i++)
        keys[FIGURES + i] = other_key[i];
    *f = (ScoreFigures){.tip_node = -1, .narrowest = 1};
    if (!json_keys(reading, object, "score", keys))
        return;
    read_figures(reading, object, "score", FIGURES, figure_table, f);
    read_tools(reading, cJSON_GetObjectItemCaseSensitive(object, "tools"), f);
    f->state = (ScoreState)json_choice(reading, object, "score", "state", score_state_name);
    f->has_exercise = read_flag(reading, object, "has_exercise");
    f->has_xray = read_flag(reading, object, "has_xray");
    f->pulses = json_count(reading, object, "score", "pulses", INT64_C(1) << 50);
    f->error_total = (int)json_count(reading, object, "score", "error_total", INT32_MAX);
    const cJSON *parts = cJSON_GetObjectItemCaseSensitive(object, "parts"), *errors = cJSON_GetObjectItemCaseSensitive(object, "errors");
    if (json_keys(reading, parts, "score.parts", score_part_name))
        for (int i = 0; i < PART_COUNT; i++)
            f->part[i] = is_later_part((ScorePart)i) && !cJSON_GetObjectItemCaseSensitive(parts, score_part_name[i])
                             ? 1
                             : json_number(reading, parts, "score.parts", score_part_name[i], 0, 1);
    read_points(reading, cJSON_GetObjectItemCaseSensitive(object, "points_of"), f);
    read_consequences(reading, cJSON_GetObjectItemCaseSensitive(object, "consequences"), f);
    read_steps(reading, cJSON_GetObjectItemCaseSensitive(object, "steps"), f);
    int64_t sum = 0;
    if (!json_keys(reading, errors, "score.errors", score_error_name))
        return;
    for (int i = 0; i < ERROR_COUNT; i++) {
        const cJSON *error = cJSON_GetObjectItemCaseSensitive(errors, score_error_name[i]);
        if ((!error && is_later((ScoreError)i)) || !json_keys(reading, error, score_error_name[i], error_key))
            continue;
        f->error[i].count = (int)json_count(reading, error, score_error_name[i], "count", INT32_MAX);
        f->error[i].last_s = json_number(reading, error, score_error_name[i], "last_s", 0, 1e7);
        sum += f->error[i].count;
    }
    if (sum != f->error_total)
        faults_add(reading->faults, reading->file, 0, 0, "'score.error_total' is %d; expected %lld, the sum of the error counts", f->error_total,
                   (long long)sum);
}
