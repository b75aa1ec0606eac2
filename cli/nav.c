// seldinger nav: the trainer.
#include "cli/cli.h"

#include "base/base.h"
#include "cli/case_open.h"
#include "cli/output_plan.h"
#include "cli/scene_input.h"
#include "cli/user_settings.h"
#include "render/render.h"
#include "sim/sim.h"

#include <stdlib.h>

typedef struct NavOptions {
    const char *scene, *sessions, *resume, *figures;
    int map_count;
    const char *map[TRAINER_MAPS];
    bool quiet;
    TrainerOptions trainer;
} NavOptions;

#define AT(member) OPTION_AT(NavOptions, member)
static const Option rows[] = {
    {"device", "F.yaml", OPTION_FILE, AT(map),
     "device map (examples: scenes/devices; `seldinger devices` lists the connected devices); up to 8. Joysticks, gamepads and haptic devices have built-in "
     "maps, and maps made in the start window are used too",
     .count = offsetof(NavOptions, map_count), .times = TRAINER_MAPS},
    {"only-mapped", NULL, OPTION_CLEARED, AT(trainer.has_built_in_maps), "uses only devices whose map is given with --device"},
    {"trainee", "NAME", OPTION_TEXT, AT(trainer.trainee), "name of the trainee, for the report"},
    {"sessions", "FOLDER", OPTION_FOLDER, AT(sessions), "where sessions are stored",
     .otherwise = "$XDG_DATA_HOME/seldinger/sessions, else ~/.local/share/seldinger/sessions"},
    {"examination", NULL, OPTION_FLAG, AT(trainer.is_examination), "hides the 3D view and angioscopy; the session's file says so"},
    {"instructor-port", "N", OPTION_INT, AT(trainer.instructor_port),
     "shows the session in a browser on this machine, http://127.0.0.1:N: the window's picture and the score, read-only", .least = 1024, .most = 65535,
     .otherwise = "off"},
    {"no-record", NULL, OPTION_CLEARED, AT(trainer.is_recorded), "writes no recording and no session file"},
    {"resume", "REC.h5", OPTION_FILE, AT(resume), "continues at the end of this recording of the scene …"},
    {"at", "S", OPTION_NUMBER, AT(trainer.resume_s), "… or at this moment of it [s of simulated time]", .most = SCRIPT_LONGEST_S, .otherwise = ""},
    {"tools", "FOLDER", OPTION_FOLDER, AT(trainer.library),
     "device files that the tray offers if the scene lists none under exchange:", .otherwise = "scenes/tools"},
    {"cine", "F.cine", OPTION_FILE, AT(trainer.cine), "a saved cine loop of this scene to replay"},
    CLI_VIEW(NavOptions, trainer.view, "first view"),
    CLI_SIZE(NavOptions, trainer.width, "size of the window"),
    {"full-screen", NULL, OPTION_FLAG, AT(trainer.is_full_screen), "fills the screen"},
    {"duration-s", "S", OPTION_NUMBER, AT(trainer.duration_s), "ends after S seconds of real time", .most = SCRIPT_LONGEST_S, .otherwise = ""},
    {"figures", "F.json", OPTION_FILE, AT(figures), "written at the end: frames, their CPU time, delay of the 1 kHz thread, memory; - is standard output"},
    CLI_THREADS(NavOptions, trainer.threads),
    CLI_QUIET(NavOptions, quiet, "no progress"),
};

static void set_defaults(void *structure)
{
    *(NavOptions *)structure =
        (NavOptions){.trainer = {.is_recorded = true, .has_built_in_maps = true, .trainee = "", .resume_s = SCRIPT_LONGEST_S, .width = 1280, .height = 720}};
}

static const char *check(void *structure)
{
    const NavOptions *nav = structure;
    if (nav->trainer.is_examination && nav->trainer.view != VIEW_FLUOROSCOPY)
        return "an --examination shows the X-ray image alone: no other --view";
    return nav->trainer.resume_s < SCRIPT_LONGEST_S && !nav->resume ? "--at needs --resume REC.h5" : NULL;
}

static const OptionTable table = {
    .program = "seldinger nav",
    .does = "opens the trainer: steer the tools in a window; sessions are recorded and scored",
    .usage = "SCENE [options]",
    .intro = "Opens the trainer's window in a scene, a case (`seldinger case`), a tree or a model (of a volume, the window of `seldinger case` first): steer "
             "the tools by keyboard, gamepad, HID or USB device. The window's help lists the keys. Each session is recorded, and its "
             "score written beside the recording; `seldinger report` makes a report of it, `seldinger replay` shows it again.",
    .exits = "0 done; 2 wrong usage, bad input or no display; 3 the simulation diverged or the recording is incomplete",
    CLI_OPTIONS(rows, NavOptions),
    .set_defaults = set_defaults,
    .check = check,
    .takes_argument = true,
    .argument = offsetof(NavOptions, scene),
    .missing = "missing the scene to steer in",
    .too_many = "one scene at a time, not also ",
};

static int steer(const NavOptions *options, Scene *scene, OpenVessel *open, const RecordedRun *resume, Faults *faults)
{
    TrainerOptions trainer = options->trainer;
    TrainerFigures figures = {0};
    DeviceMap *map[TRAINER_MAPS] = {0};
    const ToolNames tools = scene_tool_names(scene);
    char folder[4096] = "";
    int code = EXIT_BAD_INPUT;
    for (int i = 0; i < options->map_count; i++)
        if ((map[i] = device_map_load(options->map[i], faults)) && device_map_find_tools(map[i], &tools, faults))
            trainer.map_count++;
    if (trainer.has_built_in_maps && faults->count == 0)
        trainer.map_count += cli_own_maps(map + trainer.map_count, TRAINER_MAPS - trainer.map_count);
    if (trainer.is_recorded)
        session_folder(options->sessions, folder, sizeof folder, faults);
    trainer.folder = folder;
    trainer.note = cli_note;
    trainer.map = map;
    trainer.resume = resume;
    if (faults->count == 0) {
        code = trainer_run(scene, open, &trainer, &figures, faults);
        if (options->figures && figures.frames > 0)
            trainer_figures_write(options->figures, &figures, faults);
        if (figures.recording[0] && !options->quiet)
            printf("%s\n", figures.recording);
    }
    for (int i = 0; i < TRAINER_MAPS; i++)
        free(map[i]);
    return code;
}

// A volume becomes a case first, in a window; its child steers.
static int open_volume(const NavOptions *nav, Faults *faults)
{
    char library[PATH_MAX];
    const char *given = nav->trainer.library, *tools = given || !process_scenes("tools", library) ? given : library;
    const CaseOptions made = {.input = nav->scene, .threads = nav->trainer.threads, .library = tools};
    return case_open(&(CaseWindowOptions){.made = &made, .width = nav->trainer.width, .height = nav->trainer.height, .duration_s = nav->trainer.duration_s},
                     nav->trainer.trainee, nav->trainer.is_examination, faults);
}

static int call(void *structure, Faults *faults)
{
    const NavOptions *nav = structure;
    if (case_can_open(nav->scene))
        return open_volume(nav, faults);
    OpenVessel open = {0};
    int code = EXIT_BAD_INPUT;
    recording_prepare_process();
    cli_use_settings();
    Scene *scene = cli_scene_input(nav->scene, nav->trainer.threads, nav->quiet, faults);
    OutputPlan plan = {.faults = faults};
    output_plan_write(&plan, "--figures", nav->figures);
    output_plan_read_scene(&plan, scene);
    output_plan_read(&plan, "--resume", nav->resume);
    for (int i = 0; i < nav->map_count; i++)
        output_plan_read(&plan, "--device", nav->map[i]);
    RecordedRun *resume = scene && nav->resume ? recorded_run_load_series(nav->resume, faults) : NULL;
    if (scene && (!resume || replay_is_of(resume, scene, nav->resume, faults)) && faults->count == 0 &&
        cli_open_scene(scene, nav->trainer.threads, nav->quiet, &open, faults))
        code = steer(nav, scene, &open, resume, faults);
    recorded_run_free(resume);
    open_vessel_close(&open);
    scene_free(scene);
    return code;
}

const Verb nav_verb = {.options = &table, .call = call};
