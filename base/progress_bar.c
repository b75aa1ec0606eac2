#include "base/progress_bar.h"

#include <stdio.h>
#include <unistd.h>

static void draw_bar(void *context, long done, long total)
{
    ProgressBar *bar = context;
    enum { WIDTH = 40 };
    int filled = total > 0 ? (int)(done * WIDTH / total) : WIDTH;
    fprintf(stderr, "\r%s [%.*s%.*s] %ld/%ld", bar->label, filled, "########################################", WIDTH - filled,
            "                                        ", done, total);
    if (done >= total)
        fputc('\n', stderr);
}

Progress progress_bar(ProgressBar *bar, const char *label, bool quiet)
{
    bar->label = label;
    bar->shown = !quiet && isatty(STDERR_FILENO);
    return (Progress){.call = bar->shown ? draw_bar : NULL, .context = bar};
}
