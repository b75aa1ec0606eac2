// Numbers, points and words of the command line.
#include "cli/cli.h"

#include <stdlib.h>

bool cli_number(const char *option, const char *text, double least, double most, double *value)
{
    char *end;
    double number = strtod(text, &end);
    if (end == text || *end || !isfinite(number) || number < least || number > most) {
        fprintf(stderr, "%s: '%s' is not valid; a number from %g to %g\n", option, text, least, most);
        return false;
    }
    *value = number;
    return true;
}

bool cli_point(const char *option, const char *text, Vec3 *point)
{
    double v[3];
    char *end = (char *)(size_t)text;
    for (int k = 0; k < 3; k++) {
        const char *at = end;
        v[k] = strtod(at, &end);
        if (end == at || !isfinite(v[k]) || fabs(v[k]) > 1e9 || *end != (k < 2 ? ',' : '\0')) {
            fprintf(stderr, "%s: '%s' is not valid; three numbers X,Y,Z in mm\n", option, text);
            return false;
        }
        end += k < 2;
    }
    *point = vec3(v[0], v[1], v[2]);
    return true;
}

bool cli_whole_number(const char *option, const char *text, double least, double most, double *value)
{
    double number;
    if (!cli_number(option, text, least, most, &number))
        return false;
    if (floor(number) != number) {   // exact: whole numbers have no fraction
        fprintf(stderr, "%s: '%s' is not valid; a whole number from %g to %g\n", option, text, least, most);
        return false;
    }
    *value = number;
    return true;
}

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
