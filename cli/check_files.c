#include "cli/check_files.h"

#include "cli/cli.h"
#include "render/render.h"

void check_files_plan(const CheckFiles *files, OutputPlan *plan)
{
    output_plan_write(plan, "--json", files->json);
    output_plan_write(plan, "--junit", files->junit);
    output_plan_write(plan, "--page", files->page);
}

static bool write_text(const char *path, const CheckLog *log, void (*print)(FILE *out, const CheckLog *log), Faults *faults)
{
    OutputText text;
    if (!output_text_open(&text)) {
        faults_add(faults, path, 0, 0, "out of memory");
        return false;
    }
    print(text.stream, log);
    return output_text_write(&text, path, faults);
}

bool check_files_write(const CheckFiles *files, const CheckLog *log, Faults *faults)
{
    bool good = true;
    if (files->json) {
        cJSON *root = check_log_json(log);
        good = root && cli_write_json(files->json, root, faults);
        if (!root)
            faults_add(faults, files->json, 0, 0, "out of memory");
        cJSON_Delete(root);
    }
    good = (!files->junit || write_text(files->junit, log, check_junit, faults)) && good;
    return (!files->page || write_text(files->page, log, check_page, faults)) && good;
}
