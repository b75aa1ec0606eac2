// Any bytes as a list of edits of a swept model: faults, or edits that print to a text that reads back to the same text; and each edit, applied to a small model
// with a fork, gives a valid model or a fault.
// Covers: recon/edit/edit_list.c recon/edit/sweep_edit.c recon/edit/edit_rows.c recon/edit/contour_terms.c recon/edit/branch_pieces.c recon/edit/sweep_editor.c
#include "recon/edit/edit_list.h"
#include "recon/edit/sweep_edit.h"
#include "tests/geom/sweep_models.h"

#include <stdint.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static SweepModel *fork_model(void)
{
    static SweepShape shape[2] = {{.pitch = 1, .parent = -1, .open_start = true, .radius = 1}, {.pitch = 1, .parent_t = 10, .radius = 0.7}};
    sweep_shape_line(&shape[0], vec3(0, 0, 0), vec3(20, 0, 0), 11);
    sweep_shape_line(&shape[1], vec3(10, 0, 0), vec3(16, 8, 0), 6);
    return sweep_model_of(shape, 2);
}

static char *print_all(const EditList *list)
{
    char *text = NULL;
    for (int i = 0; i < list->count; i++)
        if (!(text = edit_text_add(text, &list->edit[i])))
            __builtin_trap();
    return text;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static Faults faults;
    faults_clear(&faults);
    EditList *list = edit_list_parse((const char *)data, size, "fuzz.yaml", &faults);
    if ((list != NULL) == (faults.count > 0))
        __builtin_trap();
    char *text = list ? print_all(list) : NULL;
    if (text) {
        EditList *again = edit_list_parse(text, strlen(text), "again.yaml", &faults);
        char *same = again ? print_all(again) : NULL;
        if (!same || strcmp(text, same) != 0)
            __builtin_trap();
        free(same);
        edit_list_free(again);
        SweepModel *model = fork_model();
        SweepEditor *editor = model ? sweep_editor_create(model) : NULL;
        if (editor)
            sweep_editor_replay(editor, list, "fuzz.yaml", &faults);
        faults_clear(&faults);
        if (editor && !sweep_model_validate(sweep_editor_model(editor), "fuzz.yaml", &faults))
            __builtin_trap();
        sweep_editor_free(editor);
        sweep_model_free(model);
    }
    free(text);
    edit_list_free(list);
    return 0;
}
