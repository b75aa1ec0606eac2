// seldinger replay: a recording shown, simulated again, made into a scene.
#include "cli/cli.h"

#include "cli/replay_beside.h"
#include "cli/replay_options.h"
#include "cli/output_plan.h"
#include "cli/user_settings.h"
#include "render/render.h"

#include <inttypes.h>
#include <math.h>
#include <unistd.h>

static int report(const ReplayOptions *options, const RecordedRun *run, const ReplayVerdict *verdict)
{
    if (verdict->first_different >= 0) {
        fprintf(stderr, "%s: differs from step %" PRId64 " (%.3f s) on: recorded %016" PRIx64 ", simulated %016" PRIx64 "\n", options->recording,
                verdict->first_different, run->time_s[verdict->first_different], verdict->recorded, verdict->simulated);
        replay_print_changed_files(stderr, run);
        return EXIT_DIFFERENT;
    }
    if (!options->quiet)
        printf("%s: %" PRId64 " steps (%.3f s) simulated again, the same state at each; the last is %016" PRIx64 "\n", options->recording, verdict->steps,
               run->step_count ? run->time_s[run->step_count - 1] : 0, verdict->simulated);
    return EXIT_DONE;
}

static int simulate_again(const ReplayOptions *options, const RecordedRun *run, const Scene *scene, const OpenVessel *open, Faults *faults)
{
    ReplayAgain again;
    if (!replay_again(run, scene, open, options->scene_folder, options->recording, &again, faults))
        return EXIT_BAD_INPUT;
    int code = report(options, run, &again.verdict);
    if (again.is_written && !options->quiet)
        printf("%s: scene.yaml, hand.csv, scene.golden.csv; `seldinger check %s` compares\n", options->scene_folder, options->scene_folder);
    return again.diverged ? EXIT_UNTRUSTED : code;
}

// Pictures and films.
static bool draw(const ReplayOptions *options, const RecordedRun *run, Scene *scene, OpenVessel *open, Faults *faults)
{
    FilmOptions film = film_default_options();
    film.width = options->width;
    film.height = options->height;
    film.view = (PanelView)options->view;
    film.has_panels = !options->no_panels;
    film.to_s = options->to_s;
    film.fps = options->fps;
    film.speed = options->speed;
    film.is_quiet = options->quiet;
    film.lao_deg = options->lao_deg;
    film.cra_deg = options->cra_deg;
    film.close_up_mm = options->close_up_mm;
    film.from_s = fmin(options->at_s, run->step_count > 0 ? run->time_s[run->step_count - 1] : 0);
    bool good = !options->picture || film_picture(options->picture, &film, run, scene, open, faults);
    film.from_s = options->from_s;
    return (!options->movie || film_movie(options->movie, &film, run, scene, open, faults)) && good;
}

// The window; a session can be continued from any moment of the recording.
static int show(const ReplayOptions *options, const RecordedRun *run, Scene *scene, OpenVessel *open, Faults *faults)
{
    ReplayBeside beside = {0};
    if (options->beside && !replay_beside_open(&beside, options->beside, run, options->recording, options->threads, options->quiet, faults)) {
        replay_beside_close(&beside);
        return EXIT_BAD_INPUT;
    }
    ReplayRecording other = {options->beside, beside.run, beside.scene, &beside.open};
    ReplayWindowOptions window = {.name = options->recording,
                                  .beside = options->beside ? &other : NULL,
                                  .width = options->width,
                                  .height = options->height,
                                  .view = (PanelView)options->view,
                                  .at_s = isfinite(options->at_s) ? options->at_s : 0,
                                  .duration_s = options->duration_s,
                                  .lao_deg = options->lao_deg,
                                  .cra_deg = options->cra_deg};
    bool resumes = false;
    double resume_s = 0;
    cli_use_settings();
    bool is_shown = replay_window_run(&window, run, scene, open, &resumes, &resume_s, faults);
    replay_beside_close(&beside);
    if (!is_shown)
        return EXIT_BAD_INPUT;
    if (!resumes)
        return EXIT_DONE;
    char folder[4096];
    TrainerFigures figures = {0};
    TrainerOptions trainer = {.folder = folder,
                              .note = cli_note,
                              .is_recorded = true,
                              .trainee = "",
                              .has_built_in_maps = true,
                              .resume = run,
                              .resume_s = resume_s,
                              .width = options->width,
                              .height = options->height,
                              .view = window.view,
                              .duration_s = options->duration_s};
    if (!session_folder(options->sessions, folder, sizeof folder, faults))
        return EXIT_BAD_INPUT;
    int code = trainer_run(scene, open, &trainer, &figures, faults);
    if (figures.recording[0] && !options->quiet)
        printf("%s\n", figures.recording);
    return code;
}

// The scene's folder gets three files; the recording's own scene may lie in it.
static void plan_outputs(const ReplayOptions *options, const RecordedRun *run, const Scene *scene, Faults *faults)
{
    static const char *const part[] = {"scene.yaml", "hand.csv", "scene.golden.csv"};
    char path[3][PATH_MAX];
    OutputPlan plan = {.faults = faults};
    output_plan_picture(&plan, "--picture", options->picture);
    output_plan_picture(&plan, "--movie", options->movie);
    bool is_there = options->scene_folder && access(options->scene_folder, F_OK) == 0;
    for (int i = 0; is_there && i < 3; i++)
        if (snprintf(path[i], sizeof path[i], "%s/%s", options->scene_folder, part[i]) < (int)sizeof path[i])
            output_plan_write_file(&plan, "--scene", path[i]);
    output_plan_read(&plan, "the recording", options->recording);
    output_plan_read(&plan, "--beside", options->beside);
    output_plan_read_scene(&plan, scene);
    if (run && run->scene_path)
        output_plan_read(&plan, "the recording's scene", run->scene_path);
}

static int call(void *structure, Faults *faults)
{
    const ReplayOptions *options = structure;
    OpenVessel open = {0};
    int code = EXIT_BAD_INPUT;
    recording_prepare_process();
    RecordedRun *run = recorded_run_load(options->recording, faults);
    Scene *scene = run ? replay_scene(run, options->recording, faults) : NULL;
    plan_outputs(options, run, scene, faults);
    if (scene && faults->count == 0 && cli_open_scene(scene, options->threads, options->quiet, &open, faults)) {
        code = EXIT_DONE;
        if (options->verify || options->scene_folder)
            code = simulate_again(options, run, scene, &open, faults);
        else if (!options->picture && !options->movie)
            code = show(options, run, scene, &open, faults);
        draw(options, run, scene, &open, faults);
    }
    open_vessel_close(&open);
    scene_free(scene);
    recorded_run_free(run);
    return faults->count > 0 ? EXIT_BAD_INPUT : code;
}

const Verb replay_verb = {.options = &replay_options, .call = call};
