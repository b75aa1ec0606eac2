// The one-line reason that a drawing function returns to its caller.
#ifndef SELDINGER_RENDER_MESSAGE_H
#define SELDINGER_RENDER_MESSAGE_H

#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>

// Writes the message. Always returns false, so that a function can `return message_fail(…)`. `message` may be NULL.
__attribute__((format(printf, 3, 4))) static inline bool message_fail(char *message, size_t capacity, const char *format, ...)
{
    if (message && capacity > 0) {
        va_list arguments;
        va_start(arguments, format);
        vsnprintf(message, capacity, format, arguments);
        va_end(arguments);
    }
    return false;
}

#endif
