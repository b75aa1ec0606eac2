// Any bytes as a golden tool path: an accepted path is written as a text that gives the same path, and does not differ from itself.
// Covers: sim/compare.c
#include "sim/compare.h"

#include <stdint.h>
#include <stdlib.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

// Whether rows stay in order when their times are printed with six digits.
static bool is_apart(const ToolPath *path)
{
    for (int i = 1; i < path->row_count; i++) {
        double gap = path->row[i].t_s - path->row[i - 1].t_s;
        if (gap > 0 && gap < 1e-4 * fmax(1, fabs(path->row[i].t_s)))
            return false;
    }
    return true;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static Faults faults;
    size_t length;
    faults_clear(&faults);
    ToolPath *path = tool_path_parse((const char *)data, size, "a.golden.csv", &faults);
    if (!path != (faults.count > 0))
        abort();
    if (!path)
        return 0;
    char *text = tool_path_print(path, &length);
    ToolPath *again = text ? tool_path_parse(text, length, "again.csv", &faults) : NULL;
    if (is_apart(path) && (!again || again->row_count != path->row_count || again->tool_count != path->tool_count))
        abort();
    PathDifference none = tool_path_compare(path, path, COMPARE_TOLERANCE_MM);
    if (none.differs || none.worst_mm != 0)
        abort();
    tool_path_free(again);
    tool_path_free(path);
    free(text);
    return 0;
}
