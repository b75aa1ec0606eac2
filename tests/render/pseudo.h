// A translation for tests that is twice as long: every letter is doubled, formats remain.
#ifndef SELDINGER_TESTS_PSEUDO_H
#define SELDINGER_TESTS_PSEUDO_H

#include <ctype.h>
#include <stdlib.h>
#include <string.h>

enum { PSEUDO_TEXTS = 2000 };

// Whether most letters are doubled: a text that holds a translation is not one of the catalogue.
static inline int is_doubled(const char *text)
{
    int letters = 0, doubled = 0;
    for (const char *c = text; *c; c++)
        if (isalpha((unsigned char)*c)) {
            letters++;
            if (c[0] == c[1])
                doubled += 2, letters++, c++;
        }
    return letters < 2 || 2 * doubled > letters;
}

// Each text keeps its translation until the end, as a catalogue does; a translation is not translated again.
static inline const char *pseudo_translation(const char *text)
{
    static struct {
        char *text, *translation;
    } known[PSEUDO_TEXTS];
    static int count;
    for (int i = 0; i < count; i++)
        if (!strcmp(known[i].text, text) || !strcmp(known[i].translation, text))
            return known[i].translation;
    char *out = count < PSEUDO_TEXTS && !is_doubled(text) ? calloc(2 * strlen(text) + 1, 1) : NULL;
    if (!out)
        return text;
    size_t length = 0;
    for (const char *c = text; *c; c++) {
        size_t format = *c == '%' ? 1 + strspn(c + 1, "-+ #0123456789.") : 0;
        if (format > 0) {
            format += strspn(c + format, "lhz");
            format += c[format] != 0;
            memcpy(out + length, c, format);
            length += format;
            c += format - 1;
            continue;
        }
        out[length++] = *c;
        if (isalpha((unsigned char)*c))
            out[length++] = *c;
    }
    known[count].text = strdup(text);
    known[count++].translation = out;
    return out;
}

#endif
