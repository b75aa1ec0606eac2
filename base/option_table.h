// The options of a command as a table: parsed from a command line (base/options.h), printed as --help, walked for manual pages (base/options_manual.h).
//
// The table says where each value goes in a structure of the command's own, whose default values a function sets. So a default stands in one place, and the
// help shows it.
#ifndef SELDINGER_BASE_OPTION_TABLE_H
#define SELDINGER_BASE_OPTION_TABLE_H

#include <stdbool.h>
#include <stddef.h>

typedef enum OptionType {    // and what lies at Option.at
    OPTION_FLAG,             // bool; takes no value and becomes true
    OPTION_CLEARED,          // bool; takes no value and becomes false
    OPTION_NUMBER,           // double: finite, from `least` to `most`
    OPTION_WHOLE,            // double without a fraction, from `least` to `most`
    OPTION_INT,              // int, from `least` to `most`
    OPTION_POINT,            // double[3] or Vec3 [mm]: three numbers X,Y,Z
    OPTION_CHOICE,           // int or an enumeration: the index in `choices`
    OPTION_TEXT,             // const char *, into argv
    OPTION_FILE,             // the same; a path, which is not looked at
    OPTION_FOLDER
} OptionType;

typedef struct Option Option;
// Takes a value that is of no type above. NULL, or what would be valid ("WIDTHxHEIGHT").
typedef const char *OptionTaker(void *structure, const Option *option, const char *text);

struct Option {
    const char *name;        // without the dashes
    const char *metavar;     // what stands for the value in the help; NULL: a flag
    OptionType type;
    size_t at;               // of the value in the structure
    const char *help;        // NULL: a second spelling, which the help does not list
    char letter;             // a short option; 0: none
    double least, most;      // of a number
    const char *unit;        // NULL: none, or the text says it
    const char *otherwise;   // the default in words; "": none is shown; NULL: what the structure's default holds
    const char *const *choices;  // ends with NULL
    // Offsets in the structure; 0: none, so that neither may be its first member.
    size_t given;            // of a bool: becomes true
    size_t count;            // of an int: the option may be repeated, `at` is an array of `times`
    int times;
    bool takes_following;    // with `count`: the arguments after its value too, up to the next option
    OptionTaker *take;       // instead of storing by type; NULL
    const char *group;       // heading above this option and the next ones; NULL: none
};

// A row: {"voxel-mm", "X", OPTION_NUMBER, OPTION_AT(Values, voxel_mm), "edge of a voxel", .least = 0.01, .most = 10, .unit = "mm"}
#define OPTION_AT(structure, member) .at = offsetof(structure, member)

typedef struct OptionTable {
    const char *program;     // "seldinger fit"
    const char *does;        // one line without a full stop
    const char *usage;       // what follows the program's name; a line for each form
    // Paragraphs, one a line of the text; a line that begins with a blank is left as it is.
    const char *intro, *notes;           // before and after the options; NULL: none
    char *(*more_notes)(void);           // further notes that are made when they are shown, to be freed; NULL: none
    const char *exits;       // "0 done; 2 wrong usage or bad input"
    int option_count;
    const Option *option;
    size_t size;             // of the structure
    void (*set_defaults)(void *structure);       // which comes zeroed; NULL: zeros are the defaults
    const char *(*check)(void *structure);       // after all options: NULL, or what is wrong with them together; NULL: nothing can be
    // Arguments that are no options: const char * at `argument`, or with `argument_count` (an int's offset) any number, as a char **.
    bool takes_argument, may_be_missing;
    size_t argument, argument_count;
    const char *missing;     // message if there is none
    const char *too_many;    // message before one too many; ends with a blank where that shall follow
} OptionTable;

// The table's structure with its defaults, to be freed.
void *options_defaults(const OptionTable *table);
// The option's help with its unit and default.
void option_sentence(const Option *option, const void *defaults, char *text, size_t capacity);
// What may be given, in words: "a number from 0 to 1", "valid: lim, mesh, grid". "" where anything may.
void option_range(const Option *option, char *text, size_t capacity);

bool option_is_number(const Option *option);
// A whole text as a finite number; false where it is none.
bool option_number(const char *text, double *value);
// X,Y,Z, finite and below 1e9.
bool option_point(const char *text, double point[3]);

#endif
