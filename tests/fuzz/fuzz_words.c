// Words of the command line and of devices: each line of the input as each of them. Accepted values are within their ranges.
// Covers: base/option_table.c cli/arguments.c base/options.c input/gamepad.c
#include "cli/cli.h"
#include "input/gamepad.h"
#include "input/hid_report.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static const Option number_row = {"x", "X", OPTION_NUMBER, .help = "", .least = 0, .most = 1e6},
                    whole_row = {"n", "N", OPTION_WHOLE, .help = "", .least = -256, .most = 256};
static const OptionTable numbers[2] = {{.program = "x", .usage = "", .option = &number_row, .option_count = 1, .size = sizeof(double)},
                                       {.program = "n", .usage = "", .option = &whole_row, .option_count = 1, .size = sizeof(double)}};

static void try_word(const char *word)
{
    double number = -1, point[3];
    int size[2] = {0}, vendor, product;
    const Option option = {.name = "size"};
    char name[32];
    char *argv[] = {"", "--x", (char *)word, NULL};
    if (options_parse(&numbers[0], 3, argv, &number) < 0 && !(number >= 0 && number <= 1e6))
        abort();
    argv[1] = "--n";
    if (options_parse(&numbers[1], 3, argv, &number) < 0 && (!(number >= -256 && number <= 256) || (double)(int)number != number))
        abort();
    if (option_point(word, point) && !(vec3_is_finite(vec3(point[0], point[1], point[2])) && fabs(point[0]) <= 1e9))
        abort();
    if (!cli_take_size(size, &option, word) && (size[0] < 320 || size[0] > 8192 || size[1] < 240 || size[1] > 8192))
        abort();
    if (gamepad_ids_of_guid(word, &vendor, &product) && (vendor < 1 || vendor > 0xffff || product < 0 || product > 0xffff))
        abort();
    uint32_t usage = hid_usage_of_name(word);
    hid_usage_name(usage, name, sizeof name);
    if (usage && hid_usage_of_name(name) != usage)
        abort();
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    char *copy = malloc(size + 1), *next = copy;
    static FILE *nowhere;
    if (!nowhere)
        stderr = nowhere = fopen("/dev/null", "w");     // messages about invalid words
    memcpy(copy, data, size);
    copy[size] = '\0';
    for (char *line; (line = strsep(&next, "\n"));)
        try_word(line);
    free(copy);
    return 0;
}
