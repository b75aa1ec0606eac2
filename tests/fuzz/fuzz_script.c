// Any bytes as a script: a valid script, or faults.
// Covers: input/script.c base/number_table.c
#include "input/script.h"

#include <stdint.h>
#include <stdlib.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static Faults faults;
    faults_clear(&faults);
    const ToolNames tools = {.count = 3, .name = {"guide", "micro", "wire"}};
    Script *script = script_parse((const char *)data, size, "script", &tools, &faults);
    if (!script != (faults.count > 0))
        abort();
    if (script) {
        int cursor = 0;
        for (int i = 0; i < script->count; i++) {
            ToolCommands commands = script_tools_at(script, script->row[i].t_s, &cursor);
            if (i && !(script->row[i].t_s > script->row[i - 1].t_s))
                abort();
            if (commands.released >> tools.count)
                abort();
            for (int k = 0; k < TOOLS_MOST; k++)
                if (!(commands.tool[k].push_mm_s >= -1000 && commands.tool[k].push_mm_s <= 1000) || (k == tools.count && commands.tool[k].push_mm_s != 0))
                    abort();
        }
        script_free(script);
    }
    return 0;
}
