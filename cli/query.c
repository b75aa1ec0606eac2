#include "cli/cli.h"

int verb_query(int argc, char **argv)
{
    (void)argc, (void)argv;
    return EXIT_BAD_INPUT;
}
