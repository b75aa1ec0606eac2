// Numbers, points and words of the command line.
#include "cli/cli.h"

#include <stdlib.h>
#include <string.h>

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

bool cli_size(const char *text, int *width, int *height)
{
    char rest;
    if (sscanf(text, "%dx%d%c", width, height, &rest) == 2 && *width >= 320 && *height >= 240 && *width <= 8192 && *height <= 8192)
        return true;
    fprintf(stderr, "--size: '%s' is not valid; WIDTHxHEIGHT from 320x240 to 8192x8192\n", text);
    return false;
}

bool cli_view(const char *text, int *view)
{
    static const char *const name[] = {"fluoroscopy", "3d", "angioscopy", "all"};
    for (*view = 0; *view < 4; ++*view)
        if (!strcmp(text, name[*view]))
            return true;
    fprintf(stderr, "--view: '%s' is not valid; fluoroscopy, 3d, angioscopy or all\n", text);
    return false;
}
