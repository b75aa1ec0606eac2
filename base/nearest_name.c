#include "base/nearest_name.h"

#include <ctype.h>
#include <string.h>

enum { LONGEST_NAME = 40 };

// Edit distance (Levenshtein), ignoring case; 1000 if a name is longer than LONGEST_NAME.
static int edit_distance(const char *a, const char *b)
{
    int n = (int)strnlen(a, LONGEST_NAME + 1), m = (int)strnlen(b, LONGEST_NAME + 1), row[LONGEST_NAME + 2];
    if (n > LONGEST_NAME || m > LONGEST_NAME)
        return 1000;
    for (int j = 0; j <= m; j++)
        row[j] = j;
    for (int i = 1; i <= n; i++) {
        int diagonal = row[0];
        row[0] = i;
        for (int j = 1; j <= m; j++) {
            int change = diagonal + (tolower((unsigned char)a[i - 1]) != tolower((unsigned char)b[j - 1]));
            diagonal = row[j];
            int drop = row[j] + 1, insert = row[j - 1] + 1;
            row[j] = change < drop ? change : drop;
            row[j] = row[j] < insert ? row[j] : insert;
        }
    }
    return row[m];
}

int nearest_name(const char *name, const char *const *names)
{
    int nearest = -1, least = 1000;
    for (int i = 0; names[i]; i++) {
        int distance = edit_distance(name, names[i]);
        if (distance < least)
            least = distance, nearest = i;
    }
    return nearest >= 0 && least <= 1 + (int)strlen(names[nearest]) / 4 ? nearest : -1;
}
