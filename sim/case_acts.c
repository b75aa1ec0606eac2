#include "sim/case_acts.h"

#include "base/base.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void case_acts_free(CaseActs *acts)
{
    for (int i = 0; i < acts->count + acts->undone; i++)
        edit_clear(&acts->act[i].edit);
    free(acts->act);
    *acts = (CaseActs){0};
}

bool case_acts_add(CaseActs *acts, const CaseAct *act)
{
    if (acts->count == acts->capacity) {
        int capacity = 2 * acts->capacity + 16;
        CaseAct *grown = realloc(acts->act, (size_t)capacity * sizeof *grown);
        if (!grown)
            return false;
        acts->act = grown;
        acts->capacity = capacity;
    }
    CaseAct copy = *act;
    if (!edit_copy(&act->edit, &copy.edit))
        return false;
    for (; acts->undone > 0; acts->undone--)
        edit_clear(&acts->act[acts->count + acts->undone - 1].edit);
    acts->act[acts->count++] = copy;
    return true;
}

bool case_acts_undo(CaseActs *acts)
{
    bool can = acts->count > 0;
    acts->count -= can;
    acts->undone += can;
    return can;
}

bool case_acts_redo(CaseActs *acts)
{
    bool can = acts->undone > 0;
    acts->count += can;
    acts->undone -= can;
    return can;
}

static int first_that_counts(const CaseActs *acts)
{
    int first = acts->count;
    while (first > 0 && acts->act[first - 1].kind != CASE_START)
        first--;
    return first > 0 ? first - 1 : acts->count;
}

const CaseAct *case_acts_last(const CaseActs *acts, CaseActKind kind)
{
    for (int i = acts->count; i-- > first_that_counts(acts);)
        if (acts->act[i].kind == kind)
            return &acts->act[i];
    return NULL;
}

bool case_act_changes_tree(CaseActKind kind) { return kind <= CASE_ENTRY || kind == CASE_MODEL || kind == CASE_BONE; }

int case_acts_first_edit(const CaseActs *acts)
{
    int first = acts->count;
    while (first > 0 && !case_act_changes_tree(acts->act[first - 1].kind))
        first--;
    return first;
}

int case_acts_edits(const CaseActs *acts)
{
    int count = 0;
    for (int i = case_acts_first_edit(acts); i < acts->count; i++)
        count += acts->act[i].kind == CASE_EDIT;
    return count;
}

const char *case_acts_model(const CaseActs *acts)
{
    const CaseAct *act = case_acts_last(acts, CASE_MODEL);
    const char *name = act ? act->name : acts->model ? acts->model : "";
    return strcmp(name, model_names[0]) ? name : "";
}

static void describe_edit(const SweepEdit *edit, Words words, char *out, size_t capacity)
{
    static const char *const name[EDIT_KINDS] = {"edit: section", "edit: section deleted", "edit: smoothed", "edit: blend", "edit: new branch", "edit: cut",
                                                 "edit: flow"};
    const bool is_placed = edit->kind != EDIT_BLEND && edit->kind != EDIT_TAG && (edit->kind != EDIT_SMOOTH || edit->extent == SMOOTH_SECTION);
    if (edit->kind == EDIT_SMOOTH && edit->extent == SMOOTH_TREE)
        snprintf(out, capacity, "%s", words(name[edit->kind]));
    else if (is_placed)
        snprintf(out, capacity, words("%s, branch %d at %.2f mm"), words(name[edit->kind]), edit->branch, edit->t);
    else
        snprintf(out, capacity, words("%s, branch %d"), words(name[edit->kind]), edit->branch);
}

void case_act_describe(const CaseAct *act, Words words, char *out, size_t capacity)
{
    static const char *const name[CASE_ACTS] = {"start", "branch",   "forbid",  "cut",        "end here", "sac",  "entry", "target",
                                                "tool",  "catheter", "anatomy", "background", "model",    "bone", "edit"};
    Vec3 x = act->place;
    words = words ? words : words_english;
    if (act->kind == CASE_DEVICE)
        snprintf(out, capacity, words("tool: %s"), act->name[0] ? act->name : words("a wire that suits the vessels"));
    else if (act->kind == CASE_CATHETER || act->kind == CASE_ANATOMY)
        snprintf(out, capacity, "%s: %s", words(name[act->kind]), act->name[0] ? act->name : words("none"));
    else if (act->kind == CASE_MODEL)
        snprintf(out, capacity, words("model: %s"), act->name[0] ? act->name : model_names[0]);
    else if (act->kind == CASE_EDIT)
        describe_edit(&act->edit, words, out, capacity);
    else if (act->kind == CASE_BEHIND)
        snprintf(out, capacity, words("background: %s"), act->is_on ? words("the volume") : words("a plain patient"));
    else if (act->kind == CASE_BONE)
        snprintf(out, capacity, act->is_on ? words("forbid bone: more than %.0f HU") : words("bone may be tracked: more than %.0f HU"), (double)CT_NUMBER_BONE);
    else if (act->kind == CASE_FORBID)
        snprintf(out, capacity, words("forbid %.1f mm around %.1f, %.1f, %.1f"), act->radius, x.x, x.y, x.z);
    else
        snprintf(out, capacity, words("%s at %.1f, %.1f, %.1f"), words(name[act->kind]), x.x, x.y, x.z);
}

// With as few digits as give the same number again.
static void write_number(FILE *out, double x)
{
    char text[32];
    for (int digits = 1; digits <= 17; digits++) {
        snprintf(text, sizeof text, "%.*g", digits, x);
        if (strtod(text, NULL) == x)
            break;
    }
    fputs(text, out);
}

static void write_place(FILE *out, const char *key, Vec3 x)
{
    fprintf(out, "%s: [", key);
    write_number(out, x.x);
    fputs(", ", out);
    write_number(out, x.y);
    fputs(", ", out);
    write_number(out, x.z);
    fputc(']', out);
}

// A list of the trace with all acts of one kind; the start is the first of the branches.
static int write_list(FILE *out, const CaseActs *acts, const char *list, CaseActKind kind, const char *key)
{
    int count = 0;
    for (int i = first_that_counts(acts); i < acts->count; i++) {
        const CaseAct *act = &acts->act[i];
        if (act->kind != kind && !(kind == CASE_BRANCH && act->kind == CASE_START))
            continue;
        if (count++ == 0)
            fprintf(out, "%s:\n", list);
        fputs("  - {", out);
        if (kind == CASE_SAC) {
            fputs("centers_mm: [[", out);
            write_number(out, act->place.x);
            fputs(", ", out);
            write_number(out, act->place.y);
            fputs(", ", out);
            write_number(out, act->place.z);
            fputs("]]", out);
        } else {
            write_place(out, key, act->place);
        }
        if (kind == CASE_FORBID) {
            fputs(", radius_mm: ", out);
            write_number(out, act->radius);
        }
        fputs("}\n", out);
    }
    return count;
}

static void write_choices(FILE *out, const CaseActs *acts)
{
    static const struct {
        CaseActKind kind;
        const char *key;
    } row[] = {{CASE_ENTRY, "entry_mm"},    {CASE_TARGET, "target_mm"}, {CASE_DEVICE, "device"},
               {CASE_CATHETER, "catheter"}, {CASE_ANATOMY, "anatomy"},  {CASE_BEHIND, "behind"}};
    const char *model = case_acts_model(acts);
    int count = 0;
    for (size_t i = 0; i < sizeof row / sizeof *row; i++) {
        const CaseAct *act = case_acts_last(acts, row[i].kind);
        bool is_place = row[i].kind <= CASE_TARGET, is_switch = row[i].kind == CASE_BEHIND;
        if (!act || (is_switch ? !act->is_on : !is_place && !act->name[0]))
            continue;
        fputs(count++ == 0 ? "case: {" : ", ", out);
        if (is_place)
            write_place(out, row[i].key, act->place);
        else
            fprintf(out, "%s: %s", row[i].key, is_switch ? "true" : act->name);
    }
    if (model[0])
        fprintf(out, "%s%s", count++ == 0 ? "case: {model: " : ", model: ", model);
    if (count > 0)
        fputs("}\n", out);
}

// After a model of another kind or tree no edit counts.
static bool write_edits(FILE *out, const CaseActs *acts)
{
    char *text = NULL;
    int count = 0;
    for (int i = case_acts_first_edit(acts); i < acts->count; i++)
        if (acts->act[i].kind == CASE_EDIT) {
            count++;
            text = count == 1 || text ? edit_text_add(text, &acts->act[i].edit) : NULL;
        }
    if (text)
        fputs(text, out);
    bool good = count == 0 || text;
    free(text);
    return good;
}

char *case_acts_trace(const CaseActs *acts)
{
    OutputText text;
    if (first_that_counts(acts) == acts->count || !output_text_open(&text))
        return NULL;
    FILE *out = text.stream;
    int branches = write_list(out, acts, "branches", CASE_BRANCH, "start_mm");
    write_list(out, acts, "forbid", CASE_FORBID, "center_mm");
    write_list(out, acts, "cut", CASE_CUT, "point_mm");
    write_list(out, acts, "until", CASE_END, "point_mm");
    write_list(out, acts, "aneurysms", CASE_SAC, "");
    if (branches > 1)        // a trace of several branches is tracked by hand otherwise
        fputs("automatic: 1\n", out);
    const CaseAct *bone = case_acts_last(acts, CASE_BONE);
    if (bone && !bone->is_on)
        fputs("bone_hu: 0\n", out);
    write_choices(out, acts);
    if (!write_edits(out, acts)) {
        output_text_forget(&text);
        return NULL;
    }
    if (!ferror(out) && fclose(out) == 0)
        return text.bytes;
    free(text.bytes);
    return NULL;
}
