#include "sim/case_marks.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

typedef struct Marks {
    CaseMark *mark;
    int count, of_kind[MARK_KINDS];
    Words words;
} Marks;

static void add(Marks *marks, CaseMarkKind kind, const Vec3 *place, const char *format, ...) __attribute__((format(printf, 4, 5)));
static void add(Marks *marks, CaseMarkKind kind, const Vec3 *place, const char *format, ...)
{
    enum { OF_EACH = CASE_MARKS / MARK_KINDS };
    va_list arguments;
    if (marks->of_kind[kind] == OF_EACH)
        return;
    CaseMark *mark = &marks->mark[marks->count++];
    marks->of_kind[kind]++;
    *mark = (CaseMark){.kind = kind, .has_place = place != NULL, .place = place ? *place : vec3(0, 0, 0)};
    va_start(arguments, format);
    vsnprintf(mark->text, sizeof mark->text, marks->words(format), arguments);
    va_end(arguments);
}

static bool add_findings(Marks *marks, const ModelField *wall)
{
    VesselBranches *branches = vessel_branches_create(wall->tree);
    FindingOptions options = finding_default_options();
    int count = 0;
    Finding *finding = branches ? vessel_findings(wall, branches, &options, &count) : NULL;
    for (int i = 0; finding && i < count; i++) {
        const Finding *f = &finding[i];
        const Vec3 *place = &wall->tree->center[f->node];
        if (f->kind == FINDING_ANEURYSM && isfinite(f->neck))
            add(marks, MARK_SAC, place, "sac of %.1f mm, neck %.1f mm, on a vessel of %.1f mm", f->extent, f->neck, 2 * f->reference);
        else if (f->kind == FINDING_ANEURYSM)
            add(marks, MARK_SAC, place, "sac of %.1f mm, on a vessel of %.1f mm", f->extent, 2 * f->reference);
        else if (f->kind == FINDING_STENOSIS)
            add(marks, MARK_NARROW_PLACE, place, "narrow: %.2f mm wide over %.1f mm, beside it %.2f mm", 2 * f->radius, f->length, 2 * f->reference);
    }
    free(finding);
    vessel_branches_free(branches);
    return branches != NULL;
}

static bool add_stops(Marks *marks, const ModelField *wall, double tool_radius)
{
    ReachOptions options = reach_default_options();
    options.tool_radius = tool_radius;
    Reach *reach = reach_create(wall, &options);
    for (int i = 0; reach && i < reach->stop_count; i++) {
        const ReachStop *s = &reach->stop[i];
        const char *where = marks->words(s->node == 0 ? "no tool enters" : "no tool goes on");
        if (s->apart)
            add(marks, MARK_NO_ENTRY, &s->place, "%s: the image shows no vessel in this gap; %.0f mm beyond", where, s->lost);
        else if (s->capped)
            add(marks, MARK_NO_ENTRY, &s->place, "%s: the wall closes the vessel; %.0f mm beyond", where, s->lost);
        else
            add(marks, MARK_NO_ENTRY, &s->place, "%s: %.2f mm wide, the tool %.2f mm; %.0f mm beyond", where, 2 * fmax(s->clearance, 0), 2 * tool_radius,
                s->lost);
    }
    bool good = reach != NULL;
    reach_free(reach);
    return good;
}

int case_marks_find(const CaseWork *work, const ModelField *wall, const Missed *missed, double tool_radius, Words words, CaseMark *mark)
{
    Marks marks = {.mark = mark, .words = words ? words : words_english};
    for (int i = 0; i < work->report.check.warning_count; i++)
        add(&marks, MARK_DOUBT, NULL, "%s", work->report.check.warning[i].text);
    for (int i = 0; i < work->report.junction_count; i++) {
        const RbtJunction *j = &work->report.junction[i];
        if (j->support == RBT_DOUBTFUL && !j->is_inner)
            add(&marks, MARK_DOUBT, &j->place, "the image hardly shows how this branch is connected (%.0f %% of its brightness)", 100 * j->share);
    }
    for (int i = 0; i < missed->count; i++)
        add(&marks, MARK_MISSED, &missed->part[i].place, "as bright as the vessels, %.0f mm3: a vessel that is missing, or bone", missed->part[i].volume);
    return add_findings(&marks, wall) && add_stops(&marks, wall, tool_radius) ? marks.count : -1;
}
