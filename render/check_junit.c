#include "render/check_junit.h"

#include "render/page.h"

#include <string.h>

static double time_of(const CheckLog *log, const char *scene)
{
    double time = 0;
    for (int i = 0; i < log->count; i++)
        if (!scene || !strcmp(scene, log->at[i].scene))
            time += log->at[i].time_s;
    return time;
}

// The attributes of a suite; scene NULL: of all.
static void print_counts(FILE *out, const CheckLog *log, const char *scene)
{
    int count = 0;
    for (int k = 0; k < CHECK_STATUS_COUNT; k++)
        count += check_log_count(log, scene, (CheckStatus)k);
    fprintf(out, " tests=\"%d\" failures=\"%d\" errors=\"%d\" time=\"%.3f\"", count, check_log_count(log, scene, CHECK_FAILED),
            check_log_count(log, scene, CHECK_ERROR), time_of(log, scene));
    if (scene)
        fprintf(out, " skipped=\"%d\"", check_log_count(log, scene, CHECK_SKIPPED));
}

static void print_attribute(FILE *out, const char *name, const char *text)
{
    fprintf(out, " %s=\"", name);
    page_text(out, text);
    fputc('"', out);
}

// Jenkins divides a class name at its last point: the path with points for slashes, without its extension.
static void print_class(FILE *out, const char *scene)
{
    char name[4096];
    snprintf(name, sizeof name, "%s", scene);
    char *point = strrchr(name, '.'), *slash = strrchr(name, '/');
    if (point && (!slash || point > slash))
        *point = 0;
    for (char *c = name; *c; c++)
        *c = *c == '.' ? '_' : *c == '/' ? '.' : *c;
    print_attribute(out, "classname", name);
}

static void print_case(FILE *out, const CheckCase *one)
{
    static const char *const element[CHECK_STATUS_COUNT] = {NULL, "failure", "error", "skipped"};
    fprintf(out, "    <testcase");
    print_attribute(out, "name", one->name);
    print_class(out, one->scene);
    fprintf(out, " time=\"%.3f\"", one->time_s);
    if (!element[one->status]) {
        fprintf(out, "/>\n");
        return;
    }
    // an attribute's line breaks would become spaces: it has the first line, the element all
    char first[FAULT_LENGTH];
    snprintf(first, sizeof first, "%.*s", (int)strcspn(one->message, "\n"), one->message);
    fprintf(out, ">\n      <%s", element[one->status]);
    print_attribute(out, "message", first);
    if (one->status == CHECK_SKIPPED) {
        fprintf(out, "/>\n    </testcase>\n");
        return;
    }
    print_attribute(out, "type", one->status == CHECK_FAILED ? "difference" : "no result");
    fputc('>', out);
    page_text(out, one->message);
    fprintf(out, "</%s>\n    </testcase>\n", element[one->status]);
}

static bool is_first(const CheckLog *log, int index)
{
    for (int i = 0; i < index; i++)
        if (!strcmp(log->at[i].scene, log->at[index].scene))
            return false;
    return true;
}

void check_junit(FILE *out, const CheckLog *log)
{
    fprintf(out, "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites name=\"seldinger check\"");
    print_counts(out, log, NULL);
    fprintf(out, ">\n");
    for (int i = 0; i < log->count; i++) {
        if (!is_first(log, i))
            continue;
        fprintf(out, "  <testsuite");
        print_attribute(out, "name", log->at[i].scene);
        print_counts(out, log, log->at[i].scene);
        fprintf(out, ">\n");
        for (int k = i; k < log->count; k++)
            if (!strcmp(log->at[k].scene, log->at[i].scene))
                print_case(out, &log->at[k]);
        fprintf(out, "  </testsuite>\n");
    }
    fprintf(out, "</testsuites>\n");
}
