// The state of an editor, see sweep_edit.h: the models after each edit, so that undoing needs no replay.
#include "recon/edit/sweep_edit.h"

#include "recon/edit/branch_pieces.h"

#include <stdlib.h>
#include <string.h>

struct SweepEditor {
    const SweepModel *base;
    EditList done;           // `count` applied, and those up to `known` undone
    int known;
    SweepModel **after;      // (capacity) the model after each known edit
    EditChange *change;      // (capacity) what each one changed
    SweepField *field;       // of the model now
    SweepModel *tried;       // of sweep_editor_try
    SweepField *tried_field;
    SweepModel *result;      // copy for saving
};

SweepEditor *sweep_editor_create(const SweepModel *model)
{
    SweepEditor *e = calloc(1, sizeof *e);
    if (!e)
        return NULL;
    e->base = model;
    e->field = sweep_field_create(model);
    if (!e->field) {
        sweep_editor_free(e);
        return NULL;
    }
    return e;
}

static void forget_undone(SweepEditor *e)
{
    for (int i = e->done.count; i < e->known; i++) {
        edit_clear(&e->done.edit[i]);
        sweep_model_free(e->after[i]);
    }
    e->known = e->done.count;
}

static void end_try(SweepEditor *e)
{
    sweep_field_free(e->tried_field);
    sweep_model_free(e->tried);
    e->tried_field = NULL, e->tried = NULL;
}

void sweep_editor_free(SweepEditor *e)
{
    if (!e)
        return;
    end_try(e);
    sweep_field_free(e->field);
    e->done.count = 0;
    forget_undone(e);
    free(e->done.edit);
    free(e->after);
    free(e->change);
    sweep_model_free(e->result);
    free(e);
}

static const SweepModel *model_now(const SweepEditor *e) { return e->done.count > 0 ? e->after[e->done.count - 1] : e->base; }
const SweepModel *sweep_editor_model(const SweepEditor *e) { return e->tried ? e->tried : model_now(e); }
const SweepField *sweep_editor_field(const SweepEditor *e) { return e->tried_field ? e->tried_field : e->field; }
const EditList *sweep_editor_list(const SweepEditor *e) { return &e->done; }

// --- the box of a change ---

static void add_ball(EditChange *c, Vec3 x, double r)
{
    c->low = vec3(fmin(c->low.x, x.x - r), fmin(c->low.y, x.y - r), fmin(c->low.z, x.z - r));
    c->high = vec3(fmax(c->high.x, x.x + r), fmax(c->high.y, x.y + r), fmax(c->high.z, x.z + r));
}

// The tube of a branch between two places: at the curve's points, twice a segment, the largest section and the blends.
static void add_tube(const SweepField *field, int branch, double from, double to, EditChange *c)
{
    if (branch >= field->branch_count)
        return;
    int first = sweep_field_segment(field, branch, from), last = sweep_field_segment(field, branch, to);
    bool whole_end = to >= field->curve[branch]->length - 1e-9;
    for (int s = first; s <= last; s++) {
        const SweepSegment *g = &field->segment[s];
        double low = fmax(from, fmax(g->from, 0)), high = fmin(to, fmin(g->to, field->curve[branch]->length));
        for (int k = 0; k <= 2; k++)
            add_ball(c, sweep_curve_at(field->curve[branch], low + 0.5 * k * (high - low)).s, g->largest + field->fork[branch].delta + 0.5 * (high - low));
    }
    if (whole_end)
        add_ball(c, sweep_curve_at(field->curve[branch], field->curve[branch]->length).s, 2 * field->segment[last].largest);
}

static void add_change(const SweepField *field, EditChange *c)
{
    for (int i = 0; i < field->branch_count; i++)
        if (c->branch < 0)
            add_tube(field, i, 0, field->curve[i]->length, c);
    if (c->branch >= 0)
        add_tube(field, c->branch, c->from, c->to, c);
    // a child's blend follows its own mean radius near its start, and the parent's there
    for (int i = 0; c->branch >= 0 && i < field->branch_count; i++)
        if (field->model->branch[i].parent == c->branch && field->model->branch[i].parent_t >= c->from && field->model->branch[i].parent_t <= c->to)
            add_tube(field, i, 0, fmin(field->curve[i]->length, field->fork[i].reach), c);
}

static bool descends(const SweepModel *m, int branch, int from)
{
    while (branch >= 0 && branch != from)
        branch = m->branch[branch].parent;
    return branch == from;
}

static void measure_change(const SweepField *before, const SweepField *after, EditChange *c)
{
    c->low = vec3(HUGE_VAL, HUGE_VAL, HUGE_VAL), c->high = vec3(-HUGE_VAL, -HUGE_VAL, -HUGE_VAL);
    add_change(before, c);
    add_change(after, c);
    // what was cut off
    for (int i = 0; after->branch_count < before->branch_count && i < before->branch_count; i++)
        if (descends(before->model, i, c->branch))
            add_tube(before, i, 0, before->curve[i]->length, c);
}

// --- applying ---

static bool make_room(SweepEditor *e)
{
    EditList *list = &e->done;
    if (list->count < list->capacity)
        return true;
    size_t more = 2 * (size_t)list->capacity + 16;
    SweepEdit *edit = realloc(list->edit, more * sizeof *edit);
    list->edit = edit ? edit : list->edit;
    SweepModel **after = realloc(e->after, more * sizeof(SweepModel *));
    e->after = after ? after : e->after;
    EditChange *change = realloc(e->change, more * sizeof *change);
    e->change = change ? change : e->change;
    if (!edit || !after || !change)
        return false;
    list->capacity = (int)more;
    return true;
}

bool sweep_editor_do(SweepEditor *e, const SweepEdit *edit, const char *name, EditChange *change, Faults *faults)
{
    end_try(e);
    EditChange here;
    SweepModel *model = sweep_edit_apply(model_now(e), e->field, edit, name, &here, faults);
    SweepField *field = model ? sweep_field_create(model) : NULL;
    SweepEdit copy = {0};
    if (!field || !edit_copy(edit, &copy) || !make_room(e)) {
        if (model)
            faults_add(faults, name, edit->line, edit->column, "the edit needs more memory than is available");
        sweep_field_free(field);
        sweep_model_free(model);
        edit_clear(&copy);
        return false;
    }
    forget_undone(e);
    measure_change(e->field, field, &here);
    sweep_field_free(e->field);
    e->field = field;
    e->done.edit[e->done.count] = copy;
    e->after[e->done.count] = model;
    e->change[e->done.count] = here;
    e->known = ++e->done.count;
    if (change)
        *change = here;
    return true;
}

bool sweep_editor_try(SweepEditor *e, const SweepEdit *edit, EditChange *change, Faults *faults)
{
    end_try(e);
    if (!edit)
        return true;
    EditChange here;
    e->tried = sweep_edit_apply(model_now(e), e->field, edit, "the edit", &here, faults);
    e->tried_field = e->tried ? sweep_field_create(e->tried) : NULL;
    if (!e->tried_field) {
        end_try(e);
        return false;
    }
    measure_change(e->field, e->tried_field, &here);
    *change = here;
    return true;
}

bool sweep_editor_replay(SweepEditor *e, const EditList *list, const char *name, Faults *faults)
{
    int before = faults->count;
    for (int i = 0; i < list->count; i++)
        sweep_editor_do(e, &list->edit[i], name, NULL, faults);
    return faults->count == before;
}

// Goes to the state after `count` edits.
static bool go_to(SweepEditor *e, int count)
{
    SweepField *field = sweep_field_create(count > 0 ? e->after[count - 1] : e->base);
    if (!field)
        return false;
    end_try(e);
    sweep_field_free(e->field);
    e->field = field;
    e->done.count = count;
    return true;
}

bool sweep_editor_undo(SweepEditor *e, EditChange *change)
{
    if (e->done.count == 0 || !go_to(e, e->done.count - 1))
        return false;
    *change = e->change[e->done.count];
    return true;
}

bool sweep_editor_redo(SweepEditor *e, EditChange *change)
{
    if (e->done.count == e->known || !go_to(e, e->done.count + 1))
        return false;
    *change = e->change[e->done.count - 1];
    return true;
}

const SweepModel *sweep_editor_result(SweepEditor *e)
{
    const SweepModel *now = model_now(e);
    sweep_model_free(e->result);
    BranchPiece *piece = branch_pieces(now, 0);
    SweepModel *m = e->result = piece ? branch_pieces_join(now, now->branch_count, piece) : NULL;
    free(piece);
    if (!m)
        return NULL;
    m->edits = e->base->edits ? malloc(strlen(e->base->edits) + 1) : NULL;
    if (e->base->edits && !m->edits)
        return NULL;
    if (m->edits)
        memcpy(m->edits, e->base->edits, strlen(e->base->edits) + 1);
    for (int i = 0; i < e->done.count; i++)
        if (!(m->edits = edit_text_add(m->edits, &e->done.edit[i])))
            return NULL;
    return m;
}
