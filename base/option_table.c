#include "base/option_table.h"

#include "base/heap.h"

#include <ctype.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

bool option_is_number(const Option *option) { return option->type == OPTION_NUMBER || option->type == OPTION_WHOLE || option->type == OPTION_INT; }

bool option_number(const char *text, double *value)
{
    char *end;
    double number = strtod(text, &end);
    if (end == text || *end || !isfinite(number))
        return false;
    *value = number;
    return true;
}

bool option_point(const char *text, double point[3])
{
    for (int k = 0; k < 3; k++) {
        char *end;
        point[k] = strtod(text, &end);
        if (end == text || !isfinite(point[k]) || fabs(point[k]) > 1e9 || *end != (k < 2 ? ',' : '\0'))
            return false;
        text = end + 1;
    }
    return true;
}

void option_range(const Option *option, char *text, size_t capacity)
{
    size_t used = 0;
    *text = 0;
    if (option_is_number(option) && !option->take)
        snprintf(text, capacity, "a %snumber from %.16g to %.16g", option->type == OPTION_NUMBER ? "" : "whole ", option->least, option->most);
    for (int i = 0; option->type == OPTION_CHOICE && option->choices[i] && used < capacity; i++)
        used += (size_t)snprintf(text + used, capacity - used, "%s%s", i == 0 ? "valid: " : ", ", option->choices[i]);
}

void *options_defaults(const OptionTable *table)
{
    void *structure = HEAP_ZEROED(table->size + 1, 1);
    if (table->set_defaults)
        table->set_defaults(structure);
    return structure;
}

// Writes the default in words: from the table, or from `defaults`. "" if it is not to be shown.
static void option_default(const Option *option, const void *defaults, char *text, size_t capacity)
{
    const char *place = (const char *)defaults + option->at;
    *text = 0;
    if (option->otherwise)
        snprintf(text, capacity, "%s", option->otherwise);
    else if (option->take || option->count)
        return;
    else if (option->type == OPTION_INT)
        snprintf(text, capacity, "%d", *(const int *)(const void *)place);
    else if (option_is_number(option))
        snprintf(text, capacity, "%.10g", *(const double *)(const void *)place);
    else if (option->type == OPTION_CHOICE)
        snprintf(text, capacity, "%s", option->choices[*(const int *)(const void *)place]);
}

void option_sentence(const Option *option, const void *defaults, char *text, size_t capacity)
{
    char value[200];
    option_default(option, defaults, value, sizeof value);
    snprintf(text, capacity, "%s%s%s%s%s%s", option->help, option->unit ? " [" : "", option->unit ? option->unit : "", option->unit ? "]" : "",
             !*value                                               ? ""
             : isalpha((unsigned char)*value) && option->otherwise ? "; default: "
                                                                   : "; default ",
             value);
}
