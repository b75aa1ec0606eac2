// Any bytes as the specification of a sweep: a result exactly if there is no fault, and then values of any run, and hands that are a valid script.
// Covers: study/spec.c study/points.c study/distribution.c
#include "input/input.h"
#include "study/points.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void use_hands(const RandomHands *hands)
{
    static const ToolNames tools = {.count = 2, .name = {"a", "b"}};
    static Faults faults;
    faults_clear(&faults);
    if (!hands->wanted || hands->duration_s > 100 * hands->hold_least)
        return;
    char *text = study_hands(hands, hands->seed, &tools);
    Script *script = text ? script_parse(text, strlen(text), "hands", &tools, &faults) : NULL;
    if (!script)
        __builtin_trap();
    script_free(script);
    free(text);
}

static void use(const Study *study)
{
    use_hands(&study->hands);
    char text[VARY_TEXT];
    double last = study->runs - 1;
    const int64_t run[] = {0, (int64_t)(last / 2), (int64_t)last};
    for (int k = 0; k < 3; k++) {
        for (int i = 0; i < study->factor_count; i++)
            if (!*study_value(study, run[k], i, text) && study->factor[i].values.kind != VARY_VALUES)
                __builtin_trap();
        static Faults ignored;
        faults_clear(&ignored);
        free(study_scene_text(study, run[k], "seldinger: 1\nwire: {sections: [{length_mm: 1}, {length_mm: 2}]}\nvessel:\n  friction: 0\n", &ignored));
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static Faults faults;
    faults_clear(&faults);
    Study *study = study_parse((const char *)data, size, "fuzz.yaml", &faults);
    if ((study != NULL) == (faults.count > 0))
        __builtin_trap();
    if (study)
        use(study);
    study_free(study);
    return 0;
}
