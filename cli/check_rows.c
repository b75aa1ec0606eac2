#include "cli/check_rows.h"

#include "sim/sim.h"

#include <stdarg.h>
#include <string.h>

bool check_differs(const GoldenComparison *comparison)
{
    bool differs = comparison->path.differs || comparison->remark[0];
    for (int k = 0; k < TOLERANCE_COUNT; k++)
        differs |= comparison->quantity[k].is_compared && comparison->quantity[k].first_t_s >= 0;
    return differs;
}

static __attribute__((format(printf, 3, 4))) void append(char *text, size_t capacity, const char *format, ...)
{
    size_t used = strlen(text);
    if (used > 0 && used + 3 < capacity) {
        strcpy(text + used, "; ");
        used += 2;
    }
    va_list values;
    va_start(values, format);
    vsnprintf(text + used, capacity - used, format, values);
    va_end(values);
}

void check_describe(const GoldenComparison *comparison, char *text, size_t capacity)
{
    text[0] = 0;
    for (int k = 0; k < TOLERANCE_COUNT; k++) {
        const FigureDifference *difference = &comparison->quantity[k];
        if (difference->is_compared && difference->first_t_s >= 0)
            append(text, capacity, "%s differs by %.3g at %.3f s and by %.3g at most, tolerance %g", tolerance_info[k].name, difference->first,
                   difference->first_t_s, difference->worst, difference->tolerance);
    }
    if (comparison->path.remark[0])
        append(text, capacity, "%s", comparison->path.remark);
    if (comparison->remark[0])
        append(text, capacity, "%s", comparison->remark);
}

void check_print_row(FILE *out, const Scene *scene, const GoldenComparison *comparison, bool quiet)
{
    const PathDifference *difference = &comparison->path;
    char text[1000];
    if (!check_differs(comparison)) {
        if (!quiet)
            fprintf(out, "%-44s same      %12.7f\n", scene->path, difference->worst_mm);
        return;
    }
    fprintf(out, "%-44s DIFFERS   %12.7f", scene->path, difference->worst_mm);
    if (difference->first_node >= 0)
        fprintf(out, "  %9.3f %5d %12.7f", difference->first_t_s, difference->first_node, difference->first_mm);
    else
        fprintf(out, "  %9s %5s %12s", "-", "-", "-");
    if (difference->first_node >= 0 && scene->tool_count > 1 && difference->first_tool < scene->tool_count)
        fprintf(out, "  of %s", scene->tool[difference->first_tool].name);
    // the columns already say what the position does
    GoldenComparison others = *comparison;
    others.quantity[TOLERANCE_POSITION].is_compared = false;
    check_describe(&others, text, sizeof text);
    fprintf(out, "%s%s\n", *text ? "  " : "", text);
}
