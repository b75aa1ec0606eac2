#include "base/options_manual.h"

#include <ctype.h>
#include <stdlib.h>
#include <string.h>

// --- manual pages ---

// Escapes a text for troff: dashes are printed literally, and a line that begins with a full stop or a quote is not read as a request.
static void print_text(FILE *out, const char *text, size_t length)
{
    if (length > 0 && (*text == '.' || *text == '\''))
        fputs("\\&", out);
    for (size_t i = 0; i < length; i++) {
        if (text[i] == '\\')
            fputs("\\e", out);
        else if (text[i] == '-')
            fputs("\\-", out);
        else
            fputc(text[i], out);
    }
}

static void print_line(FILE *out, const char *text)
{
    print_text(out, text, strlen(text));
    fputc('\n', out);
}

static void print_paragraphs(FILE *out, const char *text)
{
    bool is_plain = false;
    while (text && *text) {
        size_t length = strcspn(text, "\n");
        bool was_plain = is_plain;
        is_plain = *text == ' ';
        if (is_plain != was_plain)
            fputs(is_plain ? ".PP\n.nf\n" : ".fi\n", out);
        if (!is_plain)
            fputs(".PP\n", out);
        print_text(out, text, length);
        fputc('\n', out);
        text += length + (text[length] == '\n');
        text += !is_plain && *text == '\n';      // skip an empty line: .PP already separates paragraphs
    }
    if (is_plain)
        fputs(".fi\n", out);
}

static void print_option(FILE *out, const Option *option, const void *defaults)
{
    char text[1600], range[400];
    option_sentence(option, defaults, text, sizeof text);
    option_range(option, range, sizeof range);
    fputs(".TP\n", out);
    if (option->letter)
        fprintf(out, "\\fB\\-%c\\fR, ", option->letter);
    fputs("\\fB\\-\\-", out);
    print_text(out, option->name, strlen(option->name));
    fputs("\\fR", out);
    if (option->metavar) {
        fputs(" \\fI", out);
        print_text(out, option->metavar, strlen(option->metavar));
        fputs("\\fR", out);
    }
    fputc('\n', out);
    print_line(out, text);
    if (*range) {
        fputs("(", out);
        print_text(out, range, strlen(range));
        fputs(")\n", out);
    }
}

static void print_head(const OptionTable *table, const char *version, FILE *out)
{
    char name[64], title[64];
    snprintf(name, sizeof name, "%s", table->program);
    for (char *at = name; *at; at++)
        *at = *at == ' ' ? '-' : *at;
    snprintf(title, sizeof title, "%s", name);
    for (char *at = title; *at; at++)
        *at = (char)toupper((unsigned char)*at);
    fprintf(out, ".TH %s 1 \"\" \"Seldinger %s\" \"User Commands\"\n.SH NAME\n", title, version);
    print_text(out, name, strlen(name));
    fputs(" \\- ", out);
    print_line(out, table->does);
}

static void print_synopsis(const OptionTable *table, FILE *out)
{
    fputs(".SH SYNOPSIS\n", out);
    for (const char *form = table->usage; *form;) {
        size_t length = strcspn(form, "\n");
        fprintf(out, "%s\\fB%s\\fR ", form == table->usage ? "" : ".br\n", table->program);
        print_text(out, form, length);
        fputc('\n', out);
        form += length + (form[length] == '\n');
    }
}

void options_manual(const OptionTable *table, const char *version, FILE *out)
{
    void *defaults = options_defaults(table);
    char *more = table->more_notes ? table->more_notes() : NULL;
    print_head(table, version, out);
    print_synopsis(table, out);
    fputs(".SH DESCRIPTION\n", out);
    print_paragraphs(out, table->intro);
    fputs(".SH OPTIONS\n", out);
    for (int i = 0; i < table->option_count; i++) {
        if (table->option[i].group)
            fprintf(out, ".SS %s\n", table->option[i].group);
        if (table->option[i].help)
            print_option(out, &table->option[i], defaults);
    }
    if (table->notes || more)
        fputs(".SH NOTES\n", out);
    print_paragraphs(out, table->notes);
    print_paragraphs(out, more);
    fputs(".SH EXIT STATUS\n", out);
    print_line(out, table->exits);
    free(more);
    free(defaults);
}

static const char *verb_of(const OptionTable *table)
{
    const char *blank = strrchr(table->program, ' ');
    return blank ? blank + 1 : table->program;
}

void options_overview(const OptionTable *program, const OptionTable *const *verb, const char *version, FILE *out)
{
    print_head(program, version, out);
    print_synopsis(program, out);
    fputs(".SH DESCRIPTION\n", out);
    print_paragraphs(out, program->intro);
    fputs(".SH VERBS\n", out);
    for (int i = 0; verb[i]; i++) {
        fprintf(out, ".TP\n\\fB%s\\fR ", verb_of(verb[i]));
        print_text(out, verb[i]->usage, strcspn(verb[i]->usage, "\n"));
        fputc('\n', out);
        print_line(out, verb[i]->does);
    }
    fputs(".SH NOTES\n", out);
    print_paragraphs(out, program->notes);
    fputs(".SH EXIT STATUS\n", out);
    print_line(out, program->exits);
    fputs(".SH SEE ALSO\n", out);
    for (int i = 0; verb[i]; i++)
        fprintf(out, ".BR %s\\-%s (1)%s\n", program->program, verb_of(verb[i]), verb[i + 1] ? "," : "");
}

// --- completion ---

// Prints the completion of the value of an option, as a case of the bash script.
static void print_value_case(FILE *out, const OptionTable *table, const Option *option)
{
    if (!option->metavar)
        return;
    fprintf(out, "        '%s --%s'", verb_of(table), option->name);
    if (option->letter)
        fprintf(out, "|'%s -%c'", verb_of(table), option->letter);
    if (option->type == OPTION_CHOICE) {
        fputs(") COMPREPLY=($(compgen -W '", out);
        for (int i = 0; option->choices[i]; i++)
            fprintf(out, "%s%s", i ? " " : "", option->choices[i]);
        fputs("' -- \"$word\")); return ;;\n", out);
    } else if (option->type == OPTION_FILE || option->type == OPTION_FOLDER) {
        fprintf(out, ") COMPREPLY=($(compgen -%c -- \"$word\")); return ;;\n", option->type == OPTION_FILE ? 'f' : 'd');
    } else {
        fputs(") return ;;\n", out);
    }
}

static void print_names(FILE *out, const OptionTable *table)
{
    fprintf(out, "        %s) names='", verb_of(table));
    for (int i = 0; i < table->option_count; i++)
        if (table->option[i].help)
            fprintf(out, "--%s ", table->option[i].name);
    fputs("--help' ;;\n", out);
}

void options_completion(const char *program, const OptionTable *const *table, FILE *out)
{
    fprintf(out, "# bash completion of %s, made by `%s --completion`\n_%s()\n{\n", program, program, program);
    fputs("    local word=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD-1]} verb=${COMP_WORDS[1]} names=\n    COMPREPLY=()\n"
          "    if [ \"$COMP_CWORD\" -eq 1 ]; then\n        COMPREPLY=($(compgen -W '",
          out);
    for (int i = 0; table[i]; i++)
        fprintf(out, "%s ", verb_of(table[i]));
    fputs("--help --version' -- \"$word\"))\n        return\n    fi\n    case \"$verb $before\" in\n", out);
    for (int i = 0; table[i]; i++)
        for (int k = 0; k < table[i]->option_count; k++)
            print_value_case(out, table[i], &table[i]->option[k]);
    fputs("    esac\n    case $verb in\n", out);
    for (int i = 0; table[i]; i++)
        print_names(out, table[i]);
    fputs("    esac\n    if [[ $word == -* ]]; then\n        COMPREPLY=($(compgen -W \"$names\" -- \"$word\"))\n    else\n"
          "        COMPREPLY=($(compgen -f -- \"$word\"))\n    fi\n}\n",
          out);
    fprintf(out, "complete -o filenames -F _%s %s\n", program, program);
}
