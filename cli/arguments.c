// Values of command-line options that several verbs take.
#include "cli/cli.h"

const char *const cli_view_name[] = {"fluoroscopy", "3d", "angioscopy", "all", NULL};

const char *cli_take_size(void *structure, const Option *option, const char *text)
{
    int *size = (int *)(void *)((char *)structure + option->at), width, height;
    char rest;
    if (sscanf(text, "%dx%d%c", &width, &height, &rest) != 2 || width < 320 || height < 240 || width > 8192 || height > 8192)
        return "WIDTHxHEIGHT from 320x240 to 8192x8192";
    size[0] = width;
    size[1] = height;
    return NULL;
}
