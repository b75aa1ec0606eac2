#include "study/spec.h"

#include "study/figures.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const NumberRange any_number = {-1e15, 1e15, false}, above_zero = {0, 1e15, true};

typedef struct Reading {
    Study *study;
    const char *path;
    Faults *faults;
} Reading;

// --- vary ---

static bool is_path(const char *path)
{
    if (!strcmp(path, "scene") || strlen(path) >= STUDY_PATH || !*path)
        return false;
    bool starts = true;      // of a key
    for (const char *c = path; *c; c++) {
        if (*c == '[') {
            size_t digits = strspn(c + 1, "0123456789");
            bool is_spelled_twice = c[1] == '0' && digits > 1;        // [0] and [00]
            if (starts || digits == 0 || digits > 5 || is_spelled_twice || c[digits + 1] != ']' ||
                (c[digits + 2] && c[digits + 2] != '.' && c[digits + 2] != '['))
                return false;
            c += digits + 1;
        } else if (*c == '.') {
            if (starts || !c[1])
                return false;
            starts = true;
            continue;
        } else if (!((*c >= 'a' && *c <= 'z') || (*c >= 'A' && *c <= 'Z') || (*c >= '0' && *c <= '9') || *c == '_' || *c == '-')) {
            return false;
        }
        starts = false;
    }
    return true;
}

static bool read_pair(YamlValue list, NumberRange range, double *a, double *b)
{
    return yaml_count(list, 2, 2) == 2 && yaml_number(yaml_item(list, 0), range, a) && yaml_number(yaml_item(list, 1), range, b);
}

static void read_values(YamlValue list, Distribution *out)
{
    int count = yaml_count(list, 1, STUDY_VALUES);
    out->value = count > 0 ? HEAP_ZEROED((size_t)count, sizeof *out->value) : NULL;
    for (int i = 0; i < count; i++)
        if ((out->value[out->value_count] = yaml_flow(yaml_item(list, i))))
            out->value_count++;
}

static void read_interval(YamlValue list, Distribution *out)
{
    bool is_normal = out->kind == VARY_NORMAL;
    if (!read_pair(list, out->kind == VARY_LOGUNIFORM ? above_zero : any_number, &out->a, &out->b))
        return;
    if (is_normal && !(out->b > 0))
        yaml_fault(list, "the standard deviation is %g; expected [mean, deviation] with a deviation above 0", out->b);
    else if (!is_normal && !(out->a < out->b))
        yaml_fault(list, "the range from %g to %g is empty; expected [least, most] with least < most", out->a, out->b);
    else if (out->kind == VARY_INTEGER && (out->a != floor(out->a) || out->b != floor(out->b) || fabs(out->a) > 1e9 || fabs(out->b) > 1e9))
        yaml_fault(list, "the range is from %g to %g; expected whole numbers of at most 1e9", out->a, out->b);
}

static void read_distribution(YamlValue value, Distribution *out)
{
    static const char *const keys[] = {"uniform", "loguniform", "normal", "integer", "values", "levels", NULL};
    YamlMap map = yaml_map(value, keys);
    int given = 0;
    if (!map.value.node)
        return;
    for (int i = 0; i <= VARY_VALUES; i++)
        if (yaml_has(&map, keys[i])) {
            out->kind = (VaryKind)i;
            given++;
        }
    if (given != 1) {
        yaml_fault(value,
                   "'%s' has %d distributions; expected exactly one of uniform, loguniform, integer: [least, most], normal: [mean, deviation], values: […]",
                   value.name, given);
        return;
    }
    YamlValue list = yaml_get(&map, keys[out->kind], true);
    if (out->kind == VARY_VALUES)
        read_values(list, out);
    else
        read_interval(list, out);
    if (!yaml_has(&map, "levels"))
        return;
    if (out->kind == VARY_VALUES)
        yaml_fault(yaml_get(&map, "levels", false), "'levels' is not for 'values': each value is a level");
    else
        yaml_integer(yaml_get(&map, "levels", false), 1, 1000000, &out->levels);
}

static Factor *new_factor(Reading *reading, YamlValue value, const char *path)
{
    Study *study = reading->study;
    if (study->factor_count == STUDY_FACTORS) {
        yaml_fault(value, "more than %d keys are varied, with the scene; expected fewer", STUDY_FACTORS);
        return NULL;
    }
    Factor *factor = &study->factor[study->factor_count++];
    snprintf(factor->path, sizeof factor->path, "%s", path);
    yaml_place(value, &factor->line, &factor->column);
    return factor;
}

static void read_vary(Reading *reading, YamlValue value)
{
    YamlMap map = yaml_map(value, NULL);
    const char *path;
    YamlValue item;
    for (int i = 0; yaml_pair(&map, i, &path, &item); i++) {
        Factor *factor;
        if (!path || !is_path(path))
            yaml_fault(item, "'%.60s' is not the path of a scene's key; expected one such as wire.sections[0].young_modulus_gpa, of at most %d letters",
                       path ? path : "", STUDY_PATH - 1);
        else if (!(factor = new_factor(reading, item, path)))
            return;
        else
            read_distribution(item, &factor->values);
    }
}

// --- the rest ---

static char *resolved(const Reading *reading, YamlValue value)
{
    const char *name;
    char *path = yaml_text(value, &name) ? text_file_beside(reading->path, name) : NULL;
    return path;
}

// One scene, or several: then the first factor.
static void read_scenes(Reading *reading, YamlValue value)
{
    Study *study = reading->study;
    yaml_place(value, &study->scene_line, &study->scene_column);
    if (!yaml_is_list(value)) {
        study->scene = resolved(reading, value);
        return;
    }
    int count = yaml_count(value, 1, STUDY_SCENES);
    Factor *factor = new_factor(reading, value, "scene");
    factor->values.kind = VARY_VALUES;
    factor->values.value = count > 0 ? HEAP_ZEROED((size_t)count, sizeof(char *)) : NULL;
    for (int i = 0; i < count; i++)
        if ((factor->values.value[factor->values.value_count] = resolved(reading, yaml_item(value, i))))
            factor->values.value_count++;
}

// [least, most], or a number for [-number, number].
static void read_speeds(const YamlMap *map, const char *key, double fastest, double *least, double *most)
{
    YamlValue value = yaml_get(map, key, false);
    NumberRange range = {-fastest, fastest, false};
    if (!value.node)
        return;
    if (yaml_is_list(value)) {
        if (read_pair(value, range, least, most) && *least > *most)
            yaml_fault(value, "the range from %g to %g is empty; expected [least, most]", *least, *most);
    } else if (yaml_number(value, (NumberRange){0, fastest, false}, most)) {
        *least = -*most;
    }
}

static void read_hands(Reading *reading, YamlValue value)
{
    static const char *const keys[] = {"seed", "count", "duration_s", "push_mm_s", "twist_deg_s", "hold_s", NULL};
    RandomHands *hands = &reading->study->hands;
    YamlMap map = yaml_map(value, keys);
    int seed = 1;
    *hands = (RandomHands){
        .wanted = true, .duration_s = 5, .push_least = -20, .push_most = 50, .twist_least = -360, .twist_most = 360, .hold_least = 0.05, .hold_most = 0.5};
    yaml_integer(yaml_get(&map, "seed", false), 0, 2147483647, &seed);
    hands->seed = (uint32_t)seed;
    yaml_integer(yaml_get(&map, "count", false), 1, 10000000, &hands->count);
    yaml_map_number(&map, "duration_s", false, (NumberRange){0, 3600, true}, &hands->duration_s);
    read_speeds(&map, "push_mm_s", 1000, &hands->push_least, &hands->push_most);
    read_speeds(&map, "twist_deg_s", 36000, &hands->twist_least, &hands->twist_most);
    YamlValue hold = yaml_get(&map, "hold_s", false);
    if (hold.node && read_pair(hold, (NumberRange){0.001, 3600, false}, &hands->hold_least, &hands->hold_most) && hands->hold_least > hands->hold_most)
        yaml_fault(hold, "the range from %g to %g s is empty; expected [least, most]", hands->hold_least, hands->hold_most);
}

static void read_keep(Reading *reading, YamlValue value)
{
    static const char *const keys[] = {"figures", "score", "golden", "recordings", NULL}, *const records[] = {"none", "failures", "all", NULL};
    Study *study = reading->study;
    YamlMap map = yaml_map(value, keys);
    YamlValue record = yaml_get(&map, "recordings", false), figures = yaml_get(&map, "figures", false);
    if (yaml_has(&map, "score"))
        yaml_boolean(yaml_get(&map, "score", false), &study->keeps_score);
    if (yaml_has(&map, "golden"))
        yaml_boolean(yaml_get(&map, "golden", false), &study->keeps_golden);
    int kind = record.node ? yaml_choice(record, records) : 0;
    study->record = kind > 0 ? (RecordKind)kind : RECORD_NONE;
    int count = figures.node ? yaml_count(figures, 1, STUDY_FIGURES) : 0;
    for (int i = 0; i < count; i++) {
        const char *name;
        if (yaml_text(yaml_item(figures, i), &name))
            study->figure[study->figure_count++] = HEAP_TEXT(name);
    }
}

static double grid_runs(const Reading *reading, YamlValue value)
{
    const Study *study = reading->study;
    double runs = study->hands.wanted && study->hands.count > 0 ? study->hands.count : 1;
    for (int i = 0; i < study->factor_count; i++) {
        const Factor *factor = &study->factor[i];
        long levels = distribution_levels(&factor->values);
        if (levels == 0 && factor->values.b != factor->values.a)
            faults_add(reading->faults, reading->path, factor->line, factor->column,
                       "'%s' has no levels for the grid; expected a further key, as {%s: [%g, %g], levels: 5}", factor->path, vary_name[factor->values.kind],
                       factor->values.a, factor->values.b);
        runs *= (double)(levels > 0 ? levels : 1);
    }
    if (runs > 0x1p53)
        yaml_fault(value, "the grid has %.3g runs; expected at most %lld", runs, (long long)STUDY_RUNS_MOST);
    return runs;
}

static void read_sampling(Reading *reading, YamlValue value)
{
    static const char *const keys[] = {"kind", "runs", "seed", NULL}, *const kinds[] = {"grid", "random", "sobol", NULL};
    Study *study = reading->study;
    bool is_word = value.node && !yaml_is_map(value);
    YamlMap map = is_word ? (YamlMap){.value = {.reader = value.reader}} : yaml_map(value, keys);
    YamlValue word = is_word ? value : yaml_get(&map, "kind", true);
    int seed = 1, kind = word.node ? yaml_choice(word, kinds) : 0;
    study->sampling = kind > 0 ? (SamplingKind)kind : SAMPLE_GRID;
    YamlValue runs = yaml_get(&map, "runs", false), seeded = yaml_get(&map, "seed", false);
    if (seeded.node)
        yaml_integer(seeded, 0, 2147483647, &seed);
    study->seed = (uint32_t)seed;
    if (study->sampling == SAMPLE_GRID) {
        if (runs.node || seeded.node)
            yaml_fault(runs.node ? runs : seeded, "a grid has as many runs as combinations of its levels; 'runs' and 'seed' are for random and sobol");
        study->runs = grid_runs(reading, value);
    } else if (!runs.node) {
        yaml_fault(value, "'sampling' has no key 'runs'; expected the number of runs, as {kind: sobol, runs: 1000}");
    } else if (yaml_number(runs, (NumberRange){1, 4294967295.0, false}, &study->runs) && study->runs != floor(study->runs)) {
        yaml_fault(runs, "'runs' is %g; expected a whole number", study->runs);
    }
    yaml_place(runs.node ? runs : value, &study->runs_line, &study->runs_column);
}

// --- what cannot be meant together ---

static void check_together(const Reading *reading)
{
    const Study *study = reading->study;
    for (int i = 0; i < study->factor_count; i++) {
        const Factor *f = &study->factor[i];
        if (study->hands.wanted && path_is_part_of(f->path, "script"))
            faults_add(reading->faults, reading->path, f->line, f->column, "'%s' is varied, but random 'hands' replace the script; expected one of them",
                       f->path);
        for (int k = 0; k < i; k++)
            if (path_is_part_of(study->factor[k].path, f->path))
                faults_add(reading->faults, reading->path, f->line, f->column,
                           "'%s' replaces '%s', which is set before it and would have no effect; expected it first, or only one of them", f->path,
                           study->factor[k].path);
    }
}

static void read_study(Reading *reading, YamlReader *reader)
{
    static const char *const keys[] = {"sweep", "scene", "vary", "hands", "sampling", "duration_s", "settle_s", "keep", NULL};
    Study *study = reading->study;
    YamlValue root = yaml_root(reader);
    snprintf(root.name, sizeof root.name, "sweep");
    YamlMap map = yaml_map(root, keys);
    NumberRange seconds = {0, 86400, false};
    int version, before = reading->faults->count;
    if (!map.value.node)
        return;
    yaml_integer(yaml_get(&map, "sweep", true), 1, 1, &version);
    read_scenes(reading, yaml_get(&map, "scene", true));
    if (yaml_has(&map, "vary"))
        read_vary(reading, yaml_get(&map, "vary", false));
    if (yaml_has(&map, "hands"))
        read_hands(reading, yaml_get(&map, "hands", false));
    yaml_map_number(&map, "duration_s", false, seconds, &study->duration_s);
    yaml_map_number(&map, "settle_s", false, seconds, &study->settle_s);
    if (yaml_has(&map, "keep"))
        read_keep(reading, yaml_get(&map, "keep", false));
    read_sampling(reading, yaml_get(&map, "sampling", true));
    if (study->factor_count == 0 && !study->hands.wanted && reading->faults->count == before)
        yaml_fault(root, "nothing varies; expected 'vary', 'hands' or several scenes");
    if (study->keeps_golden && study->hands.wanted)
        yaml_fault(yaml_get(&map, "keep", false), "'golden' compares with the path of the scene's script, which random 'hands' replace; expected one of them");
    check_together(reading);
}

Study *study_parse(const char *text, size_t length, const char *path, Faults *faults)
{
    int before = faults->count;
    YamlReader *reader = yaml_reader_open(text, length, path, faults);
    if (!reader)
        return NULL;
    Study *study = HEAP_ZEROED(1, sizeof *study);
    Reading reading = {.study = study, .path = path, .faults = faults};
    study->path = HEAP_TEXT(path);
    study->text = HEAP_ZEROED(length + 1, 1);
    memcpy(study->text, text, length);
    study->length = length;
    study->duration_s = study->settle_s = -1;
    read_study(&reading, reader);
    yaml_reader_close(reader);
    if (faults->count == before)
        return study;
    study_free(study);
    return NULL;
}

Study *study_load(const char *path, Faults *faults)
{
    size_t length;
    char *text = text_file_read(path, &length, faults);
    Study *study = text ? study_parse(text, length, path, faults) : NULL;
    free(text);
    return study;
}

void study_free(Study *study)
{
    if (!study)
        return;
    for (int i = 0; i < study->factor_count; i++) {
        for (int k = 0; k < study->factor[i].values.value_count; k++)
            free(study->factor[i].values.value[k]);
        free(study->factor[i].values.value);
    }
    for (int i = 0; i < study->figure_count; i++)
        free(study->figure[i]);
    free(study->scene);
    free(study->text);
    free(study->path);
    free(study);
}
