// See edit_file.h.
#include "recon/edit/edit_file.h"

bool edit_file_load(const char *path, EditFile *file, Faults *faults)
{
    *file = (EditFile){0};
    file->tree = tree_file_load(path, &file->info, faults);
    if (!file->tree || !sweep_models_load(path, file->tree, &file->models, faults))
        return false;
    file->model = file->models.of[SECTION_POLAR];
    if (!file->model)
        faults_add(faults, path, 0, 0, "has no swept model with polar sections; `seldinger fit %s --model sweep -o OUT.h5` makes one", path);
    return file->model != NULL;
}

void edit_file_free(EditFile *file)
{
    sweep_models_free(&file->models);
    vessel_tree_free(file->tree);
    tree_file_info_free(&file->info);
    *file = (EditFile){0};
}

bool edit_file_save(const EditFile *file, SweepEditor *editor, const char *path, Faults *faults)
{
    SEL_ASSERT(file->tree && file->model, "the file was loaded");
    const SweepModel *model = sweep_editor_result(editor);
    if (!model) {
        faults_add(faults, path, 0, 0, "the edited model needs more memory than is available");
        return false;
    }
    const TreeFileInfo info = {
        .source = file->info.source, .parameters = file->info.parameters, .created_by = (char *)(size_t) "seldinger " SELDINGER_VERSION " edit"};
    SweepModels models = file->models;
    models.of[SECTION_POLAR] = (SweepModel *)(size_t)model;
    return tree_file_save_with(file->tree, &models, &info, path, faults);
}

void edit_file_list(const SweepModel *m, FILE *out)
{
    static const char *const tag[SWEEP_TAGS] = {"fork", "in", "out"};
    for (int i = 0; i < m->branch_count; i++) {
        const SweepBranch *b = &m->branch[i];
        fprintf(out, "branch %d: length_mm %.6g, radius_mm %.4g, ", i, sweep_model_length(m, i), b->radius);
        if (b->parent >= 0)
            fprintf(out, "from branch %d at t_mm %.6g, blend %.4g, ", b->parent, b->parent_t, sweep_model_blend(m, i));
        fprintf(out, "start %s, end %s, %d sections\n", tag[sweep_model_tag(m, i, 0)], tag[sweep_model_tag(m, i, 1)], b->break_count);
        for (int k = 0; k < b->break_count; k++) {
            double term[SWEEP_TERMS], t = m->break_t[b->first_break + k];
            sweep_edit_terms(m, i, t, term);
            fprintf(out, "  t_mm %.6f  mean_radius_mm %.4f  area_mm2 %.4f\n", t, term[0], sweep_terms_area(term));
        }
    }
    if (m->edits)
        fprintf(out, "%s", m->edits);
}
