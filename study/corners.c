// A corner has each key at an end of its range, or at one of its values. A corner that the scene refuses is reduced to the keys that matter: a key is left as
// the scene has it if the same fault remains.
#include "study/corners.h"

#include "study/points.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

typedef struct Corners {
    const CornerScenes *scenes;
    const Study *study;
    Faults *faults, found;
    int level[STUDY_FACTORS];
    int sets;                // of several keys, already reported
    uint32_t set[FAULTS_CAPACITY];
} Corners;

static int levels_of(const Distribution *values) { return values->kind == VARY_VALUES ? values->value_count : 2; }

static const char *value_at(const Corners *corners, int factor, char text[VARY_TEXT])
{
    const Study *study = corners->study;
    const Distribution *values = &study->factor[factor].values;
    int level = corners->level[factor];
    if (values->kind == VARY_VALUES)
        return values->value[level];
    if (study->sampling == SAMPLE_GRID)
        return distribution_level(values, level ? distribution_levels(values) - 1 : 0, text);
    return distribution_end(values, level, text);
}

// --- a corner ---

// Adds to `found` what is wrong with the scene whose keys of the set `keys` are at the corner; the other keys are as in the scene.
static void try_scene(Corners *corners, uint32_t keys, Faults *found)
{
    const Study *study = corners->study;
    const char *path = study->scene ? study->scene : study->factor[0].values.value[corners->level[0]];
    char *text = HEAP_TEXT(corners->scenes->text_of(corners->scenes->context, path)), number[VARY_TEXT];
    faults_clear(found);
    for (int i = study->scene ? 0 : 1; text && i < study->factor_count; i++)
        if (keys >> i & 1) {
            char *changed = study_changed_text(study, i, value_at(corners, i, number), text, found);
            free(text);
            text = changed;
        }
    Scene *scene = text ? scene_parse(text, strlen(text), path, found) : NULL;
    const char *needed = scene ? scene_needed_file(scene) : NULL;
    if (needed && access(needed, R_OK) != 0)
        faults_add(found, needed, 0, 0, "cannot be read: %s; expected a readable file", strerror(errno));
    if (scene && open_vessel_suits(scene, found) && found->count == 0)
        corners->scenes->seen(corners->scenes->context, scene);
    scene_free(scene);
    free(text);
}

static bool has_fault(const Faults *faults, const char *text)
{
    for (int i = 0; i < faults->count && i < FAULTS_CAPACITY; i++)
        if (!strcmp(faults->text[i], text))
            return true;
    return false;
}

// The keys without which the fault is gone.
static uint32_t reduce(Corners *corners, uint32_t keys, const char *fault)
{
    Faults *found = HEAP_ZEROED(1, sizeof *found);
    for (int i = 0; i < corners->study->factor_count; i++) {
        uint32_t fewer = keys & ~(UINT32_C(1) << i);
        if (fewer == keys)
            continue;
        try_scene(corners, fewer, found);
        keys = has_fault(found, fault) ? fewer : keys;
    }
    free(found);
    return keys;
}

static bool is_reported(Corners *corners, uint32_t keys)
{
    for (int i = 0; i < corners->sets; i++)
        if (corners->set[i] == keys)
            return true;
    if (corners->sets < FAULTS_CAPACITY)
        corners->set[corners->sets++] = keys;
    return false;
}

static void report(Corners *corners, uint32_t keys, const char *why)
{
    const Study *study = corners->study;
    const Factor *first = NULL;
    char with[200] = "", number[VARY_TEXT];
    Faults *one = HEAP_ZEROED(1, sizeof *one);
    int count = 0;
    for (int i = 0; i < study->factor_count; i++)
        if (keys >> i & 1) {
            size_t used = strlen(with);
            first = first ? first : &study->factor[i];
            snprintf(with + used, sizeof with - used, "%s%s: %.40s", count++ ? " and " : "", study->factor[i].path, value_at(corners, i, number));
        }
    bool is_place = !strncmp(why, study->path, strlen(study->path)) && why[strlen(study->path)] == ':';      // a key that cannot be set
    if (first && !is_place)
        faults_add(one, study->path, first->line, first->column, "with %s the scene is wrong: %.250s%s", with, why,
                   count > 1 ? "; expected ranges that are valid together" : "");
    const char *text = one->count > 0 ? one->text[0] : why;
    bool is_new = !has_fault(corners->faults, text) && (count < 2 || !is_reported(corners, keys));
    if (is_new && corners->faults->count < FAULTS_CAPACITY)
        strcpy(corners->faults->text[corners->faults->count], text);
    corners->faults->count += is_new;
    free(one);
}

// What is wrong with some keys hides what is wrong with others: they are left out, and the rest is tried again.
static void try_corner(Corners *corners)
{
    const Study *study = corners->study;
    uint32_t keys = ((UINT32_C(1) << study->factor_count) - 1) & (study->scene ? ~UINT32_C(0) : ~UINT32_C(1)), wrong = 1;
    for (try_scene(corners, keys, &corners->found); wrong && corners->found.count > 0; try_scene(corners, keys, &corners->found)) {
        char *why = HEAP_TEXT(corners->found.text[0]);
        wrong = reduce(corners, keys, why);
        report(corners, wrong, why);
        keys &= ~wrong;
        free(why);
    }
}

// --- all corners ---

static void try_combinations(Corners *corners, int count)
{
    const Study *study = corners->study;
    for (int row = 0; row < count; row++) {
        int rest = row;
        for (int i = 0; i < study->factor_count; i++) {
            int levels = levels_of(&study->factor[i].values);
            corners->level[i] = rest % levels;
            rest /= levels;
        }
        try_corner(corners);
    }
}

// Two factors have different numbers, which differ in a bit: their levels are equal in the first two rows and different in the two of that bit.
static void try_pairs(Corners *corners, int longest)
{
    enum { BITS = 5 };
    const Study *study = corners->study;
    const int rows = longest > 2 + 2 * BITS ? longest : 2 + 2 * BITS;
    for (int row = 0; row < rows; row++) {
        for (int i = 0; i < study->factor_count; i++) {
            const Distribution *values = &study->factor[i].values;
            int bit = row < 2 ? 0 : i >> (row - 2) / 2 % BITS & 1;
            corners->level[i] = values->kind == VARY_VALUES ? row % values->value_count : row < 2 ? row : bit ^ (row & 1);
        }
        try_corner(corners);
    }
}

void corners_try(const CornerScenes *scenes, Faults *faults)
{
    Corners *corners = HEAP_ZEROED(1, sizeof *corners);
    int combinations = 1, longest = 2;
    *corners = (Corners){.scenes = scenes, .study = scenes->study, .faults = faults};
    for (int i = 0; i < scenes->study->factor_count; i++) {
        int levels = levels_of(&scenes->study->factor[i].values);
        combinations = combinations > CORNERS_MOST ? combinations : combinations * levels;
        longest = levels > longest ? levels : longest;
    }
    if (combinations <= CORNERS_MOST)
        try_combinations(corners, combinations);
    else
        try_pairs(corners, longest);
    free(corners);
}
