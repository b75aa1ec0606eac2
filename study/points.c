#include "study/points.h"

#include "geom/geom.h"
#include "input/input.h"
#include "study/sobol.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// The number of hands that take part in a grid.
static int64_t grid_hands(const Study *study) { return study->hands.wanted && study->hands.count > 0 ? study->hands.count : 1; }

// The last factor changes fastest, with the hands as a last one.
static const char *grid_value(const Study *study, int64_t run, int factor, char text[VARY_TEXT])
{
    int64_t rest = run / grid_hands(study);
    for (int i = study->factor_count - 1; i > factor; i--)
        rest /= distribution_levels(&study->factor[i].values);
    const Distribution *values = &study->factor[factor].values;
    return distribution_level(values, (long)(rest % distribution_levels(values)), text);
}

const char *study_value(const Study *study, int64_t run, int factor, char text[VARY_TEXT])
{
    SEL_ASSERT(run >= 0 && factor >= 0 && factor < study->factor_count, "the run has this factor");
    const Distribution *values = &study->factor[factor].values;
    if (study->sampling == SAMPLE_GRID)
        return grid_value(study, run, factor, text);
    if (study->sampling == SAMPLE_RANDOM) {
        // one series of numbers, STUDY_FACTORS of them for each run
        Random random = {study->seed};
        random.state = random_next(&random) + ((uint64_t)run * STUDY_FACTORS + (uint64_t)factor) * RANDOM_STEP;
        return distribution_at(values, random_open(&random), text);
    }
    Random shift = {((uint64_t)study->seed << 32) + (uint64_t)factor};
    return distribution_at(values, sobol_unit((uint32_t)run, factor, study->seed ? (uint32_t)(random_next(&shift) >> 32) : 0), text);
}

const char *study_scene(const Study *study, int64_t run)
{
    char unused[VARY_TEXT];
    return study->scene ? study->scene : study_value(study, run, 0, unused);
}

uint64_t study_hand_seed(const Study *study, int64_t run)
{
    int64_t count = study->hands.count > 0 ? study->hands.count : study->sampling == SAMPLE_GRID ? 1 : INT64_MAX;
    return study->hands.seed + (uint64_t)(run % count);
}

// wire.sections[0].young_modulus_gpa as yaml_edit.h writes it: wire.sections.0.young_modulus_gpa
static void edit_path(const char *path, char out[STUDY_PATH])
{
    int n = 0;
    for (; *path; path++)
        if (*path != ']')
            out[n++] = *path == '[' ? '.' : *path;
    out[n] = 0;
}

// Sets the value at `path`. Maps that the scene lacks are added with it: what it does not say has its default.
static char *with_value(const char *text, const char *path, const char *value)
{
    char *out = yaml_edit_flow(text, path, value, true), *dot;
    char outer[STUDY_PATH], *wrapped = out ? NULL : HEAP_TEXT(value);
    snprintf(outer, sizeof outer, "%s", path);
    while (!out && (dot = strrchr(outer, '.')) && strspn(dot + 1, "0123456789") != strlen(dot + 1)) {
        size_t length = strlen(wrapped) + strlen(dot + 1) + 8;
        char *next = HEAP_ZEROED(length, 1);
        snprintf(next, length, "{%s: %s}", dot + 1, wrapped);
        free(wrapped);
        wrapped = next;
        *dot = 0;
        out = yaml_edit_flow(text, outer, wrapped, true);
    }
    free(wrapped);
    return out;
}

// Takes `text` and frees it.
static char *changed(const Study *study, int factor, const char *value, char *text, Faults *faults)
{
    const Factor *f = &study->factor[factor];
    char path[STUDY_PATH];
    edit_path(f->path, path);
    char *out = text ? with_value(text, path, value) : NULL;
    if (text && !out)
        faults_add(faults, study->path, f->line, f->column,
                   "the scene has no place '%s' for the value %.60s; expected the path of a key, as wire.sections[0].diameter_mm, in a list that is that long",
                   f->path, value);
    free(text);
    return out;
}

char *study_changed_text(const Study *study, int factor, const char *value, const char *scene_text, Faults *faults)
{
    return changed(study, factor, value, HEAP_TEXT(scene_text), faults);
}

char *study_scene_text(const Study *study, int64_t run, const char *scene_text, Faults *faults)
{
    char *text = HEAP_TEXT(scene_text), number[VARY_TEXT];
    for (int i = study->scene ? 0 : 1; text && i < study->factor_count; i++)
        text = changed(study, i, study_value(study, run, i, number), text, faults);
    return text;
}

static double draw(Random *random, double least, double most) { return least + (most - least) * random_unit(random); }

char *study_hands(const RandomHands *hands, uint64_t seed, const ToolNames *tools)
{
    char *text = NULL;
    size_t length;
    Random random = {seed << 20};
    FILE *out = open_memstream(&text, &length);
    if (!out)
        return NULL;
    fprintf(out, "t_s");
    for (int k = 0; k < tools->count; k++)
        tools->count == 1 ? fprintf(out, ",push_mm_s,twist_deg_s") : fprintf(out, ",%s.push_mm_s,%s.twist_deg_s", tools->name[k], tools->name[k]);
    for (double t = 0; t < hands->duration_s - 1e-3; t += draw(&random, hands->hold_least, hands->hold_most)) {
        fprintf(out, "\n%.4f", t);
        for (int k = 0; k < tools->count; k++) {
            double push = draw(&random, hands->push_least, hands->push_most), twist = draw(&random, hands->twist_least, hands->twist_most);
            fprintf(out, ",%.3f,%.3f", push, twist);
        }
    }
    fprintf(out, "\n%.4f", hands->duration_s);
    for (int k = 0; k < tools->count; k++)
        fprintf(out, ",0,0");
    fputc('\n', out);
    if (fclose(out) == 0)
        return text;
    free(text);
    return NULL;
}
