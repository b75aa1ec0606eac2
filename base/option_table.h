// The options of a command as a table: used to parse the command line (base/options.h), to print --help and to write manual pages (base/options_manual.h).
//
// The table says where each value is stored in a structure defined by the command. One function sets the defaults of that structure, so each default is defined
// once
// and the help shows it.
#ifndef SELDINGER_BASE_OPTION_TABLE_H
#define SELDINGER_BASE_OPTION_TABLE_H

#include <stdbool.h>
#include <stddef.h>

typedef enum OptionType {    // the comment gives the type of the value at Option.at
    OPTION_FLAG,             // bool; takes no value and becomes true
    OPTION_CLEARED,          // bool; takes no value and becomes false
    OPTION_NUMBER,           // double: finite, from `least` to `most`
    OPTION_WHOLE,            // double without a fraction, from `least` to `most`
    OPTION_INT,              // int, from `least` to `most`
    OPTION_POINT,            // double[3] or Vec3 [mm]: three numbers X,Y,Z
    OPTION_CHOICE,           // int or an enumeration: the index in `choices`
    OPTION_TEXT,             // const char *, into argv
    OPTION_FILE,             // const char *, into argv: a path; whether it exists is not checked
    OPTION_FOLDER
} OptionType;

typedef struct Option Option;
// Parses a value that has none of the types above. Returns NULL, or a description of valid values ("WIDTHxHEIGHT").
typedef const char *OptionTaker(void *structure, const Option *option, const char *text);

struct Option {
    const char *name;        // without the leading dashes
    const char *metavar;     // placeholder of the value in the help; NULL: a flag
    OptionType type;
    size_t at;               // offset of the value in the structure
    const char *help;        // NULL: a second spelling, which the help omits
    char letter;             // the short option; 0: none
    double least, most;      // range of a number
    const char *unit;        // NULL: none, or the help text gives it
    const char *otherwise;   // the default in words; "": not shown; NULL: the value in the default structure is shown
    const char *const *choices;  // NULL-terminated
    // Offsets in the structure. 0 means none, so neither may be the first member of the structure.
    size_t given;            // offset of a bool that becomes true when the option is given
    size_t count;            // offset of an int: the option may be repeated, and `at` is an array of `times` values
    int times;
    bool takes_following;    // with `count`: the arguments after the value, up to the next option, are values too
    OptionTaker *take;       // parses and stores the value instead of the rule of its type; NULL: none
    const char *group;       // heading above this option and those that follow; NULL: none
};

// A row: {"voxel-mm", "X", OPTION_NUMBER, OPTION_AT(Values, voxel_mm), "edge of a voxel", .least = 0.01, .most = 10, .unit = "mm"}
#define OPTION_AT(structure, member) .at = offsetof(structure, member)

typedef struct OptionTable {
    const char *program;     // "seldinger fit"
    const char *does;        // one line without a full stop
    const char *usage;       // the text after the program name; one line per form of the command
    // One paragraph per line; a line that begins with a space is printed as it is.
    const char *intro, *notes;           // before and after the options; NULL: none
    char *(*more_notes)(void);           // further notes, made when the help is shown; the caller frees them; NULL: none
    const char *exits;       // "0 done; 2 wrong usage or bad input"
    int option_count;
    const Option *option;
    size_t size;             // of the structure [bytes]
    void (*set_defaults)(void *structure);       // gets a zeroed structure; NULL: zeros are the defaults
    const char *(*check)(void *structure);       // called after all options: returns NULL, or what is wrong with their combination; NULL: no check
    // Positional arguments: one const char * at `argument`, or, with `argument_count` (the offset of an int), any number as a char **.
    bool takes_argument, may_be_missing;
    size_t argument, argument_count;
    const char *missing;     // message if there is no argument
    const char *too_many;    // message printed before the first surplus argument; a text that ends with a space is followed by that argument
} OptionTable;

// Allocates the structure of the table with its defaults. The caller frees it.
void *options_defaults(const OptionTable *table);
// Writes the help text of the option with its unit and default.
void option_sentence(const Option *option, const void *defaults, char *text, size_t capacity);
// Describes the valid values: "a number from 0 to 1", "valid: lim, mesh, grid"; "" if any value is valid.
void option_range(const Option *option, char *text, size_t capacity);

bool option_is_number(const Option *option);
// Parses the whole text as a finite number; false if it is not one.
bool option_number(const char *text, double *value);
// Parses X,Y,Z: three finite numbers, at most 1e9 in magnitude.
bool option_point(const char *text, double point[3]);

#endif
