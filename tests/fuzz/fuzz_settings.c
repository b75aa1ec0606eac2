// Any bytes as the user's settings: within their ranges, no two actions with one key, and a text that reads back to the same text.
// Covers: render/settings.c render/key_sheet.c render/key_binding.c base/yaml_reader.c
#include "render/settings.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static bool is_factor(double x) { return x >= settings_speed_least && x <= settings_speed_most; }

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static Faults faults;
    Settings settings, again;
    faults_clear(&faults);
    bool good = settings_parse((const char *)data, size, "fuzz.yaml", &settings, &faults);
    if (good != (faults.count == 0))
        abort();
    const SpeedSettings *speed = &settings.speed;
    if (!is_factor(speed->insertion) || !is_factor(speed->rotation) || !is_factor(speed->c_arm) || !(settings.interface_scale >= settings_scale_least) ||
        !(settings.interface_scale <= settings_scale_most))
        abort();
    for (int set = 0; set < KEY_SETS; set++)
        for (int i = 0; i < settings_key_count(set); i++) {
            const KeyBinding *key = settings_key(&settings, set, i);
            if (key->key <= 0 || key->key >= WINDOW_KEYS || settings_key_refused(set, *key) || settings_clash(&settings, set, i) >= 0)
                abort();
        }
    char *text = settings_text(&settings), *same = NULL;
    faults_clear(&faults);
    if (text && (!settings_parse(text, strlen(text), "again.yaml", &again, &faults) || !(same = settings_text(&again)) || strcmp(text, same) != 0))
        abort();
    free(text);
    free(same);
    return 0;
}
