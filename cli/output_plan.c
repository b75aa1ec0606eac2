#include "cli/output_plan.h"

#include "base/base.h"
#include "recon/recon.h"

#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static bool is_same_file(const PlannedOutput *output, const char *path)
{
    struct stat a, b;
    char whole[PATH_MAX];
    if (!output->whole[0])
        return false;
    if (stat(output->whole, &a) == 0)
        return stat(path, &b) == 0 && a.st_dev == b.st_dev && a.st_ino == b.st_ino;
    return path_resolve(path, whole) && !strcmp(whole, output->whole);
}

// True for NAME, a number after - or _, and the ending.
static bool is_of_series(const PlannedOutput *output, const char *path)
{
    char whole[PATH_MAX];
    const char *slash = strrchr(output->whole, '/'), *dot = strrchr(output->whole, '.');
    size_t stem = dot && dot > slash ? (size_t)(dot - output->whole) : strlen(output->whole);
    if (!output->ending || !output->whole[0] || !path_resolve(path, whole) || strncmp(whole, output->whole, stem) != 0)
        return false;
    const char *rest = whole + stem;
    size_t number = strspn(rest, "-_0123456789");
    return number > 0 && !strcmp(rest + number, output->ending);
}

static void add(OutputPlan *plan, const char *option, const char *path, bool is_good)
{
    struct stat status;
    bool special = !strcmp(path, "-") || (stat(path, &status) == 0 && !S_ISREG(status.st_mode));
    for (int i = 0; i < plan->count && !special; i++)
        if (is_same_file(&plan->output[i], path))
            faults_add(plan->faults, path, 0, 0, "%s and %s would write the same file; choose another name for one of them", plan->output[i].option, option);
    if (!is_good || plan->count == OUTPUT_PLAN_MOST)
        return;
    PlannedOutput *output = &plan->output[plan->count++];
    output->option = option;
    output->path = path;
    output->ending = NULL;
    output->whole[0] = 0;
    if (!special && !path_resolve(path, output->whole))
        output->whole[0] = 0;
}

void output_plan_write(OutputPlan *plan, const char *option, const char *path)
{
    if (path)
        add(plan, option, path, output_check(path, plan->faults));
}

void output_plan_write_file(OutputPlan *plan, const char *option, const char *path)
{
    if (path)
        add(plan, option, path, output_check_file(path, plan->faults));
}

void output_plan_picture(OutputPlan *plan, const char *option, const char *path)
{
    output_plan_write_file(plan, option, path);
#ifndef SELDINGER_RENDER
    if (path)
        faults_add(plan->faults, option, 0, 0, "this build has no pictures; build with -DSELDINGER_RENDER=ON");
#endif
}

void output_plan_series(OutputPlan *plan, const char *option, const char *ending)
{
    for (int i = 0; i < plan->count; i++)
        if (!strcmp(plan->output[i].option, option))
            plan->output[i].ending = ending;
}

void output_plan_read(OutputPlan *plan, const char *what, const char *path)
{
    for (int i = 0; path && i < plan->count; i++)
        if (is_same_file(&plan->output[i], path) || is_of_series(&plan->output[i], path))
            faults_add(plan->faults, plan->output[i].path, 0, 0, "%s would overwrite %s %s; choose another name", plan->output[i].option, what, path);
}

void output_plan_read_folder(OutputPlan *plan, const char *what, const char *folder, const char *ending)
{
    DIR *directory = plan->count > 0 ? opendir(folder) : NULL;
    for (struct dirent *entry; directory && (entry = readdir(directory));) {
        char path[PATH_MAX];
        size_t length = strlen(entry->d_name), end = strlen(ending);
        if (length >= end && !strcmp(entry->d_name + length - end, ending) && snprintf(path, sizeof path, "%s/%s", folder, entry->d_name) < (int)sizeof path)
            output_plan_read(plan, what, path);
    }
    if (directory)
        closedir(directory);
}

typedef struct VolumePart {
    OutputPlan *plan;
    const char *what;
} VolumePart;

static void read_part(void *context, const char *path)
{
    const VolumePart *part = context;
    output_plan_read(part->plan, part->what, path);
}

void output_plan_read_volume(OutputPlan *plan, const char *what, const char *path)
{
    VolumePart part = {plan, what};
    output_plan_read(plan, what, path);
    if (path && plan->count > 0)
        volume_each_data_file(path, read_part, &part);
}

void output_plan_read_scene(OutputPlan *plan, const Scene *scene)
{
    if (!scene)
        return;
    output_plan_read(plan, "the scene", scene->path);
    output_plan_read(plan, "the scene's model", scene->model_path);
    output_plan_read(plan, "the scene's surface", scene->mesh_path);
    output_plan_read(plan, "the scene's centreline", scene->tube_points_path);
    output_plan_read(plan, "the scene's script", scene->script_path);
    output_plan_read_volume(plan, "the scene's volume", scene->anatomy_path);
    for (int k = 0; k < scene->tool_count; k++)
        for (int i = 0; i < scene_device_count(scene, k); i++)
            output_plan_read(plan, "the scene's device", scene_device(scene, k, i)->device_path);
}
