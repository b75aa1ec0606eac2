#include "cli/replay_options.h"

#include "cli/cli.h"

#include <math.h>

#define AT(member) OPTION_AT(ReplayOptions, member)
static const Option options[] = {
    {"verify", NULL, OPTION_FLAG, AT(verify),
     "simulates it again headless, with the recorded commands of the hand, and compares the state's hash at each step"},
    {"scene", "FOLDER", OPTION_FOLDER, AT(scene_folder),
     "makes a regression scene from it: scene.yaml, hand.csv and the golden tool path, for `seldinger check FOLDER`"},
    {"movie", "F.mp4", OPTION_FILE, AT(movie), "the whole recording as a video (H.264 by ffmpeg), rendered off screen"},
    {"picture", "F.png", OPTION_FILE, AT(picture), "what the trainee saw at the end, rendered off screen …"},
    {"at", "S", OPTION_NUMBER, AT(at_s), "… or at this moment [s of simulated time]; the window opens there", .most = SCRIPT_LONGEST_S, .otherwise = ""},
    {"from", "S", OPTION_NUMBER, AT(from_s), "start of a video [s of simulated time]", .most = SCRIPT_LONGEST_S},
    {"to", "S", OPTION_NUMBER, AT(to_s), "end of a video [s of simulated time]", .most = SCRIPT_LONGEST_S, .otherwise = "the end of the recording"},
    {"fps", "N", OPTION_NUMBER, AT(fps), "frames per second of a video", .least = 1, .most = 240},
    {"speed", "X", OPTION_NUMBER, AT(speed), "simulated seconds per second of video", .least = 0.01, .most = 1000},
    CLI_VIEW(ReplayOptions, view, "the view shown"),
    CLI_SIZE(ReplayOptions, width, "size of pictures, videos and the window"),
    {"no-panels", NULL, OPTION_FLAG, AT(no_panels), "shows only the views"},
    {"close-up", "MM", OPTION_NUMBER, AT(close_up_mm),
     "shows this many mm around the initial positions of the tool tips: in 3D, and, for a recording without a viewer, in fluoroscopy (at least 40)", .least = 5,
     .most = 400, .otherwise = ""},
    {"lao", "DEG", OPTION_NUMBER, AT(lao_deg), "C-arm angle for a recording without a viewer (`run --record`); negative: RAO", .least = -90, .most = 90,
     .otherwise = "that of the scene"},
    {"cra", "DEG", OPTION_NUMBER, AT(cra_deg), "cranial C-arm angle for such a recording; negative: CAU", .least = -45, .most = 45,
     .otherwise = "that of the scene"},
    {"beside", "REC.h5|HAND.csv", OPTION_FILE, AT(beside),
     "in the window: another recording beside it, or the script of a hand, such as the one that solves an exercise, in the same scene"},
    {"sessions", "FOLDER", OPTION_FOLDER, AT(sessions), "where a continued session is recorded, as for `nav`"},
    {"duration-s", "S", OPTION_NUMBER, AT(duration_s), "the window closes after S seconds of real time", .most = SCRIPT_LONGEST_S, .otherwise = ""},
    CLI_THREADS(ReplayOptions, threads),
    CLI_QUIET(ReplayOptions, quiet, "no progress; --verify reports only differences"),
};

static void set_defaults(void *structure)
{
    *(ReplayOptions *)structure =
        (ReplayOptions){.lao_deg = NAN, .cra_deg = NAN, .at_s = HUGE_VAL, .to_s = HUGE_VAL, .fps = 30, .speed = 1, .width = 1280, .height = 720};
}

const OptionTable replay_options = {
    .program = "seldinger replay",
    .does = "shows a recording, simulates it again and compares, or makes a scene from it",
    .usage = "REC.h5 [options]",
    .intro = "Shows a recording of `nav` or `run --record` in a window: play, pause, seek (the strip below), jump to what happened (errors, "
             "bookmarks, injections, the target), see the parts of the score at each moment, and continue from any moment as a new session. With "
             "--beside a second recording runs in step with it, counted from the first action in each, or by its own time. The window's help lists the keys. "
             "With one of the first four options no window is opened.",
    .exits = "0 done, the same; 1 a step differs; 2 wrong usage or bad input; 3 the run diverged",
    CLI_OPTIONS(options, ReplayOptions),
    .set_defaults = set_defaults,
    .takes_argument = true,
    .argument = offsetof(ReplayOptions, recording),
    .missing = "missing the recording to show",
    .too_many = "one recording at a time, not also ",
};
