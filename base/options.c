#include "base/options.h"

#include "base/heap.h"
#include "base/nearest_name.h"
#include "base/options_help.h"
#include "base/process.h"

#include <math.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

typedef struct Parse {
    const OptionTable *table;
    void *structure;
    int argc, at, arguments;
    char **argv;
} Parse;

// One line on standard error, "PROGRAM: MESSAGE; see `PROGRAM --help`". Returns EXIT_BAD_INPUT.
static int __attribute__((format(printf, 2, 3))) options_refuse(const OptionTable *table, const char *format, ...)
{
    va_list arguments;
    fprintf(stderr, "%s: ", table->program);
    va_start(arguments, format);
    vfprintf(stderr, format, arguments);
    va_end(arguments);
    fprintf(stderr, "; see `%s --help`\n", table->program);
    return EXIT_BAD_INPUT;
}

// --- values ---

// Returns false and writes what is valid to `valid`.
static bool take_number(const Option *option, const char *text, void *place, char *valid, size_t capacity)
{
    double value;
    if (!option_number(text, &value) || value < option->least || value > option->most) {
        snprintf(valid, capacity, "a number from %.16g to %.16g", option->least, option->most);
        return false;
    }
    if (option->type != OPTION_NUMBER && floor(value) != value) {    // exact: whole numbers have no fraction
        option_range(option, valid, capacity);
        return false;
    }
    if (option->type == OPTION_INT)
        *(int *)place = (int)value;
    else
        *(double *)place = value;
    return true;
}

static bool take_choice(const Option *option, const char *text, void *place, char *valid, size_t capacity)
{
    for (int i = 0; option->choices[i]; i++)
        if (!strcmp(text, option->choices[i])) {
            *(int *)place = i;
            return true;
        }
    option_range(option, valid, capacity);
    return false;
}

static size_t size_of(const Option *option)
{
    switch (option->type) {
    case OPTION_FLAG:
    case OPTION_CLEARED: return sizeof(bool);
    case OPTION_NUMBER:
    case OPTION_WHOLE: return sizeof(double);
    case OPTION_INT:
    case OPTION_CHOICE: return sizeof(int);
    case OPTION_POINT: return 3 * sizeof(double);
    default: return sizeof(const char *);
    }
}

// Returns false and writes what is valid to `valid`.
static bool take_value(const Option *option, void *structure, const char *text, void *place, char *valid, size_t capacity)
{
    if (option->take) {
        const char *expected = option->take(structure, option, text);
        snprintf(valid, capacity, "%s", expected ? expected : "");
        return !expected;
    }
    if (option_is_number(option))
        return take_number(option, text, place, valid, capacity);
    if (option->type == OPTION_CHOICE)
        return take_choice(option, text, place, valid, capacity);
    if (option->type == OPTION_POINT) {
        snprintf(valid, capacity, "--%s takes a point: three numbers X,Y,Z in mm", option->name);
        return option_point(text, place);
    }
    *(const char **)place = text;
    return true;
}

static int take(Parse *parse, const Option *option, const char *text)
{
    char *structure = parse->structure, *place = structure + option->at, valid[400];
    int *count = option->count ? (int *)(void *)(structure + option->count) : NULL;
    if (count && *count >= option->times)
        return options_refuse(parse->table, "--%s: given more than %d times", option->name, option->times);
    if (count)
        place += (size_t)*count * size_of(option);
    if (option->given)
        *(bool *)(structure + option->given) = true;
    if (option->type == OPTION_FLAG || option->type == OPTION_CLEARED)
        *(bool *)place = option->type == OPTION_FLAG;
    else if (!take_value(option, structure, text, place, valid, sizeof valid))
        return options_refuse(parse->table, "--%s: '%s' is not valid; %s", option->name, text, valid);
    if (count)
        ++*count;
    return -1;
}

// --- names ---

static bool has_value(const Option *option) { return option->type != OPTION_FLAG && option->type != OPTION_CLEARED; }

static const Option help_option = {.name = "help", .letter = 'h'};

// Finds an option by its full name or by an unambiguous prefix (second spellings of the same value do not count). NULL if none; *others is set if several
// match.
static const Option *find_long(const OptionTable *table, const char *name, size_t length, bool *others)
{
    const Option *found = NULL;
    *others = false;
    for (int i = -1; i < table->option_count; i++) {
        const Option *option = i < 0 ? &help_option : &table->option[i];
        if (strncmp(option->name, name, length) != 0)
            continue;
        if (!option->name[length])
            return option;
        *others |= found && (found == &help_option || found->at != option->at || found->type != option->type || found->take != option->take);
        found = option;
    }
    return *others || length == 0 ? NULL : found;
}

static const Option *find_letter(const OptionTable *table, char letter)
{
    for (int i = 0; i < table->option_count; i++)
        if (table->option[i].letter == letter)
            return &table->option[i];
    return letter == 'h' || letter == '?' ? &help_option : NULL;
}

static int refuse_unknown(const OptionTable *table, const char *name, size_t length, bool is_ambiguous)
{
    char text[64];
    const char **names = HEAP_ZEROED((size_t)table->option_count + 2, sizeof *names);
    snprintf(text, sizeof text, "%.*s", (int)(length < 60 ? length : 60), name);
    names[0] = "help";
    for (int i = 0; i < table->option_count; i++)
        names[i + 1] = table->option[i].name;
    int nearest = is_ambiguous ? -1 : nearest_name(text, names);
    const char *meant = nearest >= 0 ? names[nearest] : NULL;
    free(names);
    if (is_ambiguous)
        return options_refuse(table, "several options begin with '--%s'", text);
    return meant ? options_refuse(table, "unknown option '--%s'; did you mean '--%s'?", text, meant) : options_refuse(table, "unknown option '--%s'", text);
}

// --- the command line ---

static int take_following(Parse *parse, const Option *option)
{
    int code = -1;
    while (code < 0 && option->takes_following && parse->at < parse->argc && parse->argv[parse->at][0] != '-')
        code = take(parse, option, parse->argv[parse->at++]);
    return code;
}

// `value`: the text attached to the name, or NULL if the next argument is the value.
static int take_option(Parse *parse, const Option *option, const char *value)
{
    if (option == &help_option) {
        options_help(parse->table, stdout);
        return EXIT_DONE;
    }
    if (has_value(option) && !value) {
        if (parse->at == parse->argc)
            return options_refuse(parse->table, "--%s is missing its value %s", option->name, option->metavar);
        value = parse->argv[parse->at++];
    }
    int code = take(parse, option, value);
    return code < 0 ? take_following(parse, option) : code;
}

static int take_long(Parse *parse, const char *name)
{
    size_t length = strcspn(name, "=");
    bool is_ambiguous;
    const Option *option = find_long(parse->table, name, length, &is_ambiguous);
    if (!option)
        return refuse_unknown(parse->table, name, length, is_ambiguous);
    if (name[length] && !has_value(option))
        return options_refuse(parse->table, "--%s takes no value", option->name);
    return take_option(parse, option, name[length] ? name + length + 1 : NULL);
}

static int take_letters(Parse *parse, const char *letters)
{
    for (; *letters; letters++) {
        const Option *option = find_letter(parse->table, *letters);
        if (!option)
            return options_refuse(parse->table, "unknown option '-%c'", *letters);
        if (has_value(option))
            return take_option(parse, option, letters[1] ? letters + 1 : NULL);
        int code = take_option(parse, option, NULL);
        if (code >= 0)
            return code;
    }
    return -1;
}

static int take_arguments(Parse *parse)
{
    const OptionTable *table = parse->table;
    char *structure = parse->structure, **first = parse->argv + 1;
    int most = !table->takes_argument ? 0 : table->argument_count ? parse->argc : 1;
    if (parse->arguments > most) {
        const char *end = table->too_many + strlen(table->too_many) - 1;
        return options_refuse(table, "%s%s", table->too_many, *end == ' ' ? first[most] : "");
    }
    if (parse->arguments == 0)
        return table->takes_argument && !table->may_be_missing ? options_refuse(table, "%s", table->missing) : -1;
    if (table->argument_count) {
        *(char ***)(void *)(structure + table->argument) = first;
        *(int *)(void *)(structure + table->argument_count) = parse->arguments;
    } else {
        *(const char **)(void *)(structure + table->argument) = *first;
    }
    return -1;
}

int options_parse(const OptionTable *table, int argc, char **argv, void *structure)
{
    Parse parse = {.table = table, .structure = structure, .argc = argc, .argv = argv, .at = 1};
    bool ended = false;
    int code = -1;
    memset(structure, 0, table->size);
    if (table->set_defaults)
        table->set_defaults(structure);
    while (code < 0 && parse.at < argc) {
        char *text = argv[parse.at++];
        if (!ended && !strcmp(text, "--"))
            ended = true;
        else if (ended || text[0] != '-' || !text[1])
            argv[++parse.arguments] = text;      // arguments move to the front: the entries there have already been read
        else
            code = text[1] == '-' ? take_long(&parse, text + 2) : take_letters(&parse, text + 1);
    }
    if (code < 0)
        code = take_arguments(&parse);
    const char *wrong = code < 0 && table->check ? table->check(structure) : NULL;
    return wrong ? options_refuse(table, "%s", wrong) : code;
}
