#include "study/open_study.h"

#include "study/corners.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

// --- files that the runs depend on ---

static void add_input(OpenStudy *open, const char *path)
{
    char digest[65];
    if (!path || cJSON_GetObjectItemCaseSensitive(open->inputs, path))
        return;
    cJSON_AddStringToObject(open->inputs, path, sha256_of_file(path, digest) ? digest : "missing");
}

static void add_inputs(void *context, const Scene *scene)
{
    OpenStudy *open = context;
    add_input(open, scene->model_path);
    add_input(open, scene->mesh_path);
    add_input(open, scene->tube_points_path);
    if (!open->study->hands.wanted)
        add_input(open, scene->script_path);
    for (int k = 0; k < scene->tool_count; k++)
        add_input(open, scene->tool[k].device_path);
    for (int i = 0; i < scene->exchange_count; i++)
        add_input(open, scene->exchange[i].device.device_path);
}

// --- checks ---

static void open_scene(OpenStudy *open, const char *path, Faults *faults)
{
    const Study *study = open->study;
    if (access(path, R_OK) != 0) {
        faults_add(faults, study->path, study->scene_line, study->scene_column, "the scene %.300s cannot be read: %s; expected a path relative to this file",
                   path, strerror(errno));
        return;
    }
    Scene *scene = scene_load(path, faults);
    if (!scene)
        return;
    const char *needed = scene_needed_file(scene);
    if (needed && access(needed, R_OK) != 0)
        faults_add(faults, path, 0, 0, "needs %s, which cannot be read; `prepare` in its folder makes it, if there is one", needed);
    if (!scene->script && !study->hands.wanted && study->duration_s < 0)
        faults_add(faults, path, 0, 0, "has no script; expected 'hands' or 'duration_s' in %s", study->path);
    char *golden = golden_path_of(scene->path);
    if (study->keeps_golden && access(golden, R_OK) != 0)
        faults_add(faults, golden, 0, 0, "cannot be read; `seldinger check --update %s` makes the golden path", path);
    add_input(open, scene->path);
    add_inputs(open, scene);
    if (study->keeps_golden)
        add_input(open, golden);
    open->scene_path[open->scene_count] = HEAP_TEXT(path);
    open->scene_text[open->scene_count++] = HEAP_TEXT(scene->text);
    free(golden);
    scene_free(scene);
}

static const char *text_of(void *open, const char *path) { return open_study_scene_text(open, path); }

OpenStudy *open_study(const Study *study, Faults *faults)
{
    int before = faults->count, count = study->scene ? 1 : study->factor[0].values.value_count;
    OpenStudy *open = HEAP_ZEROED(1, sizeof *open);
    open->study = study;
    open->scene_path = HEAP_ZEROED((size_t)count, sizeof *open->scene_path);
    open->scene_text = HEAP_ZEROED((size_t)count, sizeof *open->scene_text);
    open->inputs = cJSON_CreateObject();
    pthread_mutex_init(&open->files, NULL);
    for (int i = 0; i < count; i++)
        open_scene(open, study->scene ? study->scene : study->factor[0].values.value[i], faults);
    if (faults->count == before)
        corners_try(&(CornerScenes){.study = study, .text_of = text_of, .seen = add_inputs, .context = open}, faults);
    if (faults->count == before)
        return open;
    open_study_close(open);
    return NULL;
}

void open_study_close(OpenStudy *open)
{
    if (!open)
        return;
    for (int i = 0; i < open->scene_count; i++) {
        free(open->scene_path[i]);
        free(open->scene_text[i]);
    }
    vessel_cache_forget();
    pthread_mutex_destroy(&open->files);
    cJSON_Delete(open->inputs);
    free(open->scene_path);
    free(open->scene_text);
    free(open);
}

const char *open_study_scene_text(const OpenStudy *open, const char *path)
{
    for (int i = 0; i < open->scene_count; i++)
        if (!strcmp(open->scene_path[i], path))
            return open->scene_text[i];
    return NULL;
}

SharedVessel *open_study_vessel(OpenStudy *open, const Scene *scene, Faults *faults)
{
    pthread_mutex_lock(&open->files);
    SharedVessel *vessel = vessel_cache_open(scene, &(OpenVesselOptions){0}, faults);
    pthread_mutex_unlock(&open->files);
    return vessel;
}

cJSON *open_study_heading(const OpenStudy *open)
{
    const Study *study = open->study;
    char digest[65], program[PROCESS_CODE_ID];
    cJSON *heading = cJSON_CreateObject();
    Sha256 sha;
    sha256_begin(&sha);
    sha256_add(&sha, study->text, study->length);
    sha256_end(&sha, digest);
    process_code_id(program);
    cJSON_AddNumberToObject(heading, "sweep", 1);
    cJSON_AddStringToObject(heading, "version", SELDINGER_VERSION);
    cJSON_AddStringToObject(heading, "program", program);
    cJSON_AddStringToObject(heading, "specification", digest);
    cJSON_AddItemToObject(heading, "files", cJSON_Duplicate(open->inputs, true));
    return heading;
}
