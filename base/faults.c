#include "base/faults.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

void faults_clear(Faults *faults) { faults->count = 0; }

static void append(Faults *faults, const char *place, const char *format, va_list arguments)
{
    if (faults->count < FAULTS_CAPACITY) {
        char *text = faults->text[faults->count];
        int used = snprintf(text, FAULT_LENGTH, "%s: ", place);
        if (used > 0 && used < FAULT_LENGTH)
            vsnprintf(text + used, FAULT_LENGTH - (size_t)used, format, arguments);
        for (; *text; text++)   // text from a damaged file must not contain terminal escapes or line breaks
            if ((unsigned char)*text < ' ' || *text == 127)
                *text = '?';
    }
    faults->count++;
}

void faults_add(Faults *faults, const char *file, int line, int column, const char *format, ...)
{
    char place[FAULT_LENGTH / 2];
    if (line > 0 && column > 0)
        snprintf(place, sizeof place, "%.200s:%d:%d", file, line, column);
    else if (line > 0)
        snprintf(place, sizeof place, "%.200s:%d", file, line);
    else
        snprintf(place, sizeof place, "%.200s", file);
    va_list arguments;
    va_start(arguments, format);
    append(faults, place, format, arguments);
    va_end(arguments);
}

void faults_add_at_byte(Faults *faults, const char *file, size_t offset, const char *format, ...)
{
    char place[FAULT_LENGTH / 2];
    snprintf(place, sizeof place, "%.200s:byte %zu", file, offset);
    va_list arguments;
    va_start(arguments, format);
    append(faults, place, format, arguments);
    va_end(arguments);
}

void faults_print(const Faults *faults, char *out, size_t capacity)
{
    size_t used = 0;
    if (capacity == 0)
        return;
    out[0] = 0;
    int held = faults->count < FAULTS_CAPACITY ? faults->count : FAULTS_CAPACITY;
    for (int i = 0; i < held && used + 1 < capacity; i++) {
        int wrote = snprintf(out + used, capacity - used, "%s\n", faults->text[i]);
        used += wrote > 0 ? (size_t)wrote : 0;
    }
    if (faults->count > held && used + 1 < capacity)
        snprintf(out + used, capacity - used, "and %d more\n", faults->count - held);
}
