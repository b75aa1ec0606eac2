// Any bytes as a script: a script that keeps its promises, or faults.
#include "input/input.h"

#include <stdint.h>
#include <stdlib.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static Faults faults;
    faults_clear(&faults);
    Script *script = script_parse((const char *)data, size, "script", &faults);
    if (!script != (faults.count > 0))
        abort();
    if (script) {
        int cursor = 0;
        for (int i = 0; i < script->count; i++) {
            Command command = script_at(script, script->row[i].t_s, &cursor);
            if (i && !(script->row[i].t_s > script->row[i - 1].t_s))
                abort();
            if (!(command.push_mm_s >= -1000 && command.push_mm_s <= 1000))
                abort();
        }
        script_free(script);
    }
    return 0;
}
