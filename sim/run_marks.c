#include "sim/run_marks.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static const double same_s = 0.5e-3;

static bool is_pedal_down(const RecordedRun *run, int64_t i) { return run->xray[i].pedal > 0.5F; }
static bool is_injecting(const RecordedRun *run, int64_t i) { return run->xray[i].contrast_ml_s > 0; }

// The end of the span of steps, beginning at `from`, in which `is_on` holds.
static int64_t span_end(const RecordedRun *run, int64_t from, bool (*is_on)(const RecordedRun *, int64_t))
{
    while (from < run->step_count && is_on(run, from))
        from++;
    return from;
}

static int count_spans(const RecordedRun *run, bool (*is_on)(const RecordedRun *, int64_t))
{
    int count = 0;
    for (int64_t i = 0; run->xray && i < run->step_count; i++)
        count += is_on(run, i) && (i == 0 || !is_on(run, i - 1));
    return count;
}

static int count_bookmarks(const RecordedRun *run)
{
    int count = 0;
    for (int64_t i = 1; run->xray && i < run->step_count; i++)
        count += run->xray[i].bookmark != run->xray[i - 1].bookmark;
    return count;
}

static void find_xrays(RunMarks *marks, const RecordedRun *run)
{
    for (int64_t i = 0, end; run->xray && i < run->step_count; i = end + 1) {
        end = span_end(run, i, is_pedal_down);
        if (end > i)
            marks->xray[marks->xray_count++] = (RunSpan){run->time_s[i] - run->step_ms / 1000, run->time_s[end - 1]};
    }
}

static void find_injections(RunMarks *marks, const RecordedRun *run)
{
    int number = 0;
    for (int64_t i = 0, end; run->xray && i < run->step_count; i = end + 1) {
        end = span_end(run, i, is_injecting);
        if (end == i)
            continue;
        RunMark mark = {RUN_MARK_INJECTION, .time_s = run->time_s[i], .tool = -1, .number = ++number, .seconds = (double)(end - i) * run->step_ms / 1000};
        for (int64_t k = i; k < end; k++)
            mark.requested_ml += (double)run->xray[k].contrast_ml_s * run->step_ms / 1000;
        marks->mark[marks->count++] = mark;
    }
}

static void find_bookmarks(RunMarks *marks, const RecordedRun *run)
{
    int number = 0;
    for (int64_t i = 1; run->xray && i < run->step_count; i++)
        if (run->xray[i].bookmark != run->xray[i - 1].bookmark)
            marks->mark[marks->count++] = (RunMark){RUN_MARK_BOOKMARK, .time_s = run->time_s[i], .tool = -1, .number = ++number};
}

// By time; of the same time in the order of the kinds.
static int compare_marks(const void *a, const void *b)
{
    const RunMark *x = a, *y = b;
    if (x->time_s != y->time_s)
        return x->time_s < y->time_s ? -1 : 1;
    int order = (int)x->kind - (int)y->kind;
    return order ? order : x->error != y->error ? (int)x->error - (int)y->error : x->tool - y->tool;
}

bool run_marks_make(RunMarks *marks, const RecordedRun *run, const ScoreEvent *event, int event_count, double reached_s)
{
    size_t most = (size_t)event_count + (size_t)count_bookmarks(run) + (size_t)count_spans(run, is_injecting) + 2;
    *marks =
        (RunMarks){.run = run, .mark = calloc(most, sizeof *marks->mark), .xray = calloc((size_t)count_spans(run, is_pedal_down) + 1, sizeof *marks->xray)};
    if (!marks->mark || !marks->xray)
        return false;
    for (int i = 0; i < event_count; i++)
        marks->mark[marks->count++] = (RunMark){RUN_MARK_ERROR, .time_s = event[i].time_s, .error = event[i].kind, .tool = event[i].tool};
    find_bookmarks(marks, run);
    find_injections(marks, run);
    if (reached_s > 0)
        marks->mark[marks->count++] = (RunMark){RUN_MARK_TARGET, .time_s = reached_s, .tool = -1};
    qsort(marks->mark, (size_t)marks->count, sizeof *marks->mark, compare_marks);
    find_xrays(marks, run);
    return true;
}

void run_marks_free(RunMarks *marks)
{
    free(marks->mark);
    free(marks->xray);
    *marks = (RunMarks){0};
}

int run_marks_after(const RunMarks *marks, double time_s)
{
    for (int i = 0; i < marks->count; i++)
        if (marks->mark[i].time_s > time_s + same_s)
            return i;
    return -1;
}

int run_marks_before(const RunMarks *marks, double time_s)
{
    for (int i = marks->count - 1; i >= 0; i--)
        if (marks->mark[i].time_s < time_s - same_s)
            return i;
    return -1;
}

int run_marks_at(const RunMarks *marks, double time_s)
{
    for (int i = 0; i < marks->count; i++)
        if (fabs(marks->mark[i].time_s - time_s) <= same_s)
            return i;
    return -1;
}

void run_mark_text(const RunMarks *marks, int index, Words words, char *text, size_t capacity)
{
    const RunMark *mark = &marks->mark[index];
    const char *tool = mark->tool >= 0 && mark->tool < marks->run->tool_count && marks->run->tool_count > 1 ? marks->run->tool[mark->tool].name : "";
    switch (mark->kind) {
    case RUN_MARK_ERROR:
        snprintf(text, capacity, "%.2f s: %s%s%s%s", mark->time_s, words(score_error_words[mark->error]), *tool ? " (" : "", tool, *tool ? ")" : "");
        break;
    case RUN_MARK_BOOKMARK: snprintf(text, capacity, words("%.2f s: bookmark %d"), mark->time_s, mark->number); break;
    case RUN_MARK_INJECTION:
        snprintf(text, capacity, words("%.2f s: injection %d, %.1f ml requested in %.1f s"), mark->time_s, mark->number, mark->requested_ml, mark->seconds);
        break;
    case RUN_MARK_TARGET: snprintf(text, capacity, words("%.2f s: target held"), mark->time_s); break;
    }
}

double run_first_action_s(const RecordedRun *run)
{
    for (int64_t i = 0; i < run->step_count; i++) {
        bool is_moved = run->xray && (is_pedal_down(run, i) || is_injecting(run, i));
        for (int k = 0; k < run->tool_count; k++)
            is_moved |= run->tool[k].command[2 * i] != 0 || run->tool[k].command[2 * i + 1] != 0;
        if (is_moved)
            return run->time_s[i] - run->step_ms / 1000;
    }
    return run->step_count > 0 ? run->time_s[run->step_count - 1] : 0;
}
