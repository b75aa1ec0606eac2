#include "cli/check_verify.h"

#include "cli/verify_rows.h"

#include "sim/sim.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

// --- all scenes ---

static int runs_of(const Scene *scene) { return scene->verify.element_count > 0 ? scene->verify.element_count : 1; }

static bool open_scene(const char *path, int threads, bool quiet, VerifyScene *out, Faults *faults)
{
    int before = faults->count;
    Scene *scene = out->scene = scene_load(path, faults);
    if (!scene)
        return false;
    const char *needed = scene_needed_file(scene);
    if (needed && access(needed, F_OK) != 0) {
        printf("# %s: skipped, %s is missing\n", path, needed);
        return false;
    }
    return cli_open_vessel(scene, threads, quiet, &out->open, faults) && open_vessel_inlet(scene, &out->open, faults) && faults->count == before;
}

// Its golden run has said so already.
static bool is_unreadable(const CheckLog *log, const char *scene)
{
    for (int i = 0; i < log->count; i++)
        if (log->at[i].code == EXIT_BAD_INPUT && !strcmp(log->at[i].scene, scene))
            return true;
    return false;
}

int check_verify(int count, char *const *path, int threads, bool quiet, CheckLog *log, Faults *faults)
{
    VerifyScene *scene = calloc((size_t)count + 1, sizeof *scene);
    int scenes = 0, runs = 0, code = EXIT_DONE;
    for (int i = 0; scene && i < count; i++) {
        if (!scene_has_verify(path[i]) || is_unreadable(log, path[i]))
            continue;
        int before = faults->count;
        if (open_scene(path[i], threads, quiet, &scene[scenes], faults) && scene[scenes].scene->verify.case_count > 0)
            runs += runs_of(scene[scenes++].scene);
        else {
            bool is_wrong = faults->count > before;
            check_log_add(log, &(CheckCase){.scene = path[i],
                                            .name = "verification",
                                            .status = is_wrong ? CHECK_ERROR : CHECK_SKIPPED,
                                            .message = is_wrong && before < FAULTS_CAPACITY ? faults->text[before] : "a file that it needs is missing",
                                            .code = is_wrong ? EXIT_BAD_INPUT : EXIT_DONE});
            open_vessel_close(&scene[scenes].open);
            scene_free(scene[scenes].scene);
            scene[scenes] = (VerifyScene){0};
        }
    }
    VerifyRun *run = scene ? calloc((size_t)runs + 1, sizeof *run) : NULL;
    if (!run)
        faults_add(faults, "seldinger check", 0, 0, "out of memory");
    for (int i = 0, k = 0; run && i < scenes; i++)
        for (int n = 0; n < runs_of(scene[i].scene); n++, k++) {
            const VerifyPlan *plan = &scene[i].scene->verify;
            run[k].of = &scene[i];
            run[k].elements = plan->element_count > 0 ? plan->element[n] : scene[i].scene->wire.elements;
        }
    ProgressBar bar;
    Progress progress = progress_bar(&bar, "verify", quiet);
    if (run && runs > 0) {
        parallel_for(threads, runs, verify_run_job, run, &progress);
        if (!quiet)
            verify_print_heading();
        for (int i = 0, k = 0; i < scenes; k += runs_of(scene[i].scene), i++) {
            int one = verify_print_scene(run + k, runs_of(scene[i].scene), quiet, log);
            code = one > code ? one : code;
        }
    }
    for (int i = 0; i < scenes; i++) {
        open_vessel_close(&scene[i].open);
        scene_free(scene[i].scene);
    }
    free(scene);
    free(run);
    return code;
}
