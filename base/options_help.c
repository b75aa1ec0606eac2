#include "base/options_help.h"

#include "base/heap.h"

#include <stdlib.h>
#include <string.h>

enum { WIDTH = 112, COLUMN_MOST = 28 };

// Counts UTF-8 characters, not bytes.
static int width_of(const char *text, size_t length)
{
    int width = 0;
    for (size_t i = 0; i < length; i++)
        width += (text[i] & 0xc0) != 0x80;
    return width;
}

// Prints words starting at column `at`, with further lines indented by `indent`; ends the line.
static void print_words(FILE *out, const char *text, int at, int indent)
{
    for (bool first = true;; first = false) {
        text += strspn(text, " ");
        size_t length = strcspn(text, " ");
        if (length == 0)
            break;
        int width = width_of(text, length);
        if (!first && at + 1 + width > WIDTH) {
            fprintf(out, "\n%*s", indent, "");
            at = indent;
        } else if (!first) {
            fputc(' ', out);
            at++;
        }
        fprintf(out, "%.*s", (int)length, text);
        at += width;
        text += length;
    }
    fputc('\n', out);
}

static void print_paragraphs(FILE *out, const char *text)
{
    while (text && *text) {
        size_t length = strcspn(text, "\n");
        if (*text == ' ') {
            fprintf(out, "%.*s\n", (int)length, text);
        } else {
            char *line = HEAP_ZEROED(length + 1, 1);
            memcpy(line, text, length);
            print_words(out, line, 0, 0);
            free(line);
        }
        text += length + (text[length] == '\n');
    }
}

static int print_name(char *text, size_t capacity, const Option *option)
{
    char letter[8] = "";
    if (option->letter)
        snprintf(letter, sizeof letter, "-%c, ", option->letter);
    return snprintf(text, capacity, "  %s--%s%s%s", letter, option->name, option->metavar ? " " : "", option->metavar ? option->metavar : "");
}

static int column_of(const OptionTable *table)
{
    int column = 0;
    for (int i = 0; i < table->option_count; i++) {
        char name[80];
        int width = 2 + print_name(name, sizeof name, &table->option[i]);
        if (table->option[i].help && width > column && width <= COLUMN_MOST)
            column = width;
    }
    return column;
}

static void print_option(FILE *out, const Option *option, const void *defaults, int column)
{
    char name[80], text[1600];
    int at = print_name(name, sizeof name, option);
    option_sentence(option, defaults, text, sizeof text);
    fputs(name, out);
    if (at + 2 > column)
        fprintf(out, "\n%*s", column, "");
    else
        fprintf(out, "%*s", column - at, "");
    print_words(out, text, column, column);
}

void options_help(const OptionTable *table, FILE *out)
{
    void *defaults = options_defaults(table);
    int column = column_of(table);
    const char *head = "Usage:";
    for (const char *form = table->usage; *form; head = "      ") {
        size_t length = strcspn(form, "\n");
        fprintf(out, "%s %s %.*s\n", head, table->program, (int)length, form);
        form += length + (form[length] == '\n');
    }
    fputc('\n', out);
    print_paragraphs(out, table->intro);
    fputc('\n', out);
    for (int i = 0; i < table->option_count; i++) {
        if (table->option[i].group)
            fprintf(out, "%s\n", table->option[i].group);
        if (table->option[i].help)
            print_option(out, &table->option[i], defaults, column);
    }
    fputc('\n', out);
    char *more = table->more_notes ? table->more_notes() : NULL;
    print_paragraphs(out, table->notes);
    print_paragraphs(out, more);
    if (table->notes || more)
        fputc('\n', out);
    fputs("Exit codes: ", out);
    print_words(out, table->exits, 12, 0);
    free(more);
    free(defaults);
}
