#include "cli/replay_options.h"

#include "cli/cli.h"

#include <math.h>

#define AT(member) OPTION_AT(ReplayOptions, member)
static const Option options[] = {
    {"verify", NULL, OPTION_FLAG, AT(verify), "simulates it again headless, with the recorded hand, and compares the state's hash at each step"},
    {"scene", "FOLDER", OPTION_FOLDER, AT(scene_folder),
     "makes a regression scene of it: scene.yaml, hand.csv and the golden tool path, for `seldinger check FOLDER`"},
    {"movie", "F.mp4", OPTION_FILE, AT(movie), "all of it as a film (H.264 by ffmpeg), off screen"},
    {"picture", "F.png", OPTION_FILE, AT(picture), "what the trainee saw at the end, off screen …"},
    {"at", "S", OPTION_NUMBER, AT(at_s), "… or at this moment [s of simulated time]; the window begins there", .most = SCRIPT_LONGEST_S, .otherwise = ""},
    {"from", "S", OPTION_NUMBER, AT(from_s), "begin of a film [s of simulated time]", .most = SCRIPT_LONGEST_S},
    {"to", "S", OPTION_NUMBER, AT(to_s), "end of a film [s of simulated time]", .most = SCRIPT_LONGEST_S, .otherwise = "the recording's"},
    {"fps", "N", OPTION_NUMBER, AT(fps), "frames a second of a film", .least = 1, .most = 240},
    {"speed", "X", OPTION_NUMBER, AT(speed), "simulated seconds a second of film", .least = 0.01, .most = 1000},
    CLI_VIEW(ReplayOptions, view, "what is seen"),
    CLI_SIZE(ReplayOptions, width, "of pictures, films and the window"),
    {"no-panels", NULL, OPTION_FLAG, AT(no_panels), "the views alone"},
    {"close-up", "MM", OPTION_NUMBER, AT(close_up_mm),
     "so much around the tools' tips, as they are at the beginning: in 3D, and in X-ray (40 at least) where nobody looked at it", .least = 5, .most = 400,
     .otherwise = ""},
    {"lao", "DEG", OPTION_NUMBER, AT(lao_deg), "C-arm for a recording that nobody looked at (`run --record`); negative: RAO", .least = -90, .most = 90,
     .otherwise = "the scene's"},
    {"cra", "DEG", OPTION_NUMBER, AT(cra_deg), "the same towards the head; negative: CAU", .least = -45, .most = 45, .otherwise = "the scene's"},
    {"sessions", "FOLDER", OPTION_FOLDER, AT(sessions), "where a session that goes on is recorded, as for `nav`"},
    {"duration-s", "S", OPTION_NUMBER, AT(duration_s), "the window closes by itself after S seconds of real time", .most = SCRIPT_LONGEST_S, .otherwise = ""},
    CLI_THREADS(ReplayOptions, threads),
    CLI_QUIET(ReplayOptions, quiet, "no progress; --verify says only what differs"),
};

static void set_defaults(void *structure)
{
    *(ReplayOptions *)structure =
        (ReplayOptions){.lao_deg = NAN, .cra_deg = NAN, .at_s = HUGE_VAL, .to_s = HUGE_VAL, .fps = 30, .speed = 1, .width = 1280, .height = 720};
}

const OptionTable replay_options = {
    .program = "seldinger replay",
    .does = "a recording shown, simulated again and compared, or made into a scene",
    .usage = "REC.h5 [options]",
    .intro = "Shows a recording that `nav` or `run --record` wrote, in a window: play, stop, search (Left, Right, the strip below), and go on from any moment "
             "(F5) as a "
             "new session. With one of the first four options no window is opened.",
    .exits = "0 done, the same; 1 a step differs; 2 wrong usage or bad input; 3 the run diverged",
    CLI_OPTIONS(options, ReplayOptions),
    .set_defaults = set_defaults,
    .takes_argument = true,
    .argument = offsetof(ReplayOptions, recording),
    .missing = "missing the recording to show",
    .too_many = "one recording at a time, not also ",
};
