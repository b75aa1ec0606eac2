#include "cli/run_options.h"

#include "cli/cli.h"

const char *const run_contact[] = {"lim", "lim_blend", "lim_switch", "sweep", "raster", "rbf", "pas", "mesh", "smooth_mesh", "flat_mesh", "grid", "tube", NULL};
const ContactKind run_contact_kind[] = {CONTACT_LIM, CONTACT_LIM_BLEND, CONTACT_LIM_SWITCH,  CONTACT_SWEEP,     CONTACT_RASTER, CONTACT_RBF,
                                        CONTACT_PAS, CONTACT_MESH,      CONTACT_SMOOTH_MESH, CONTACT_FLAT_MESH, CONTACT_GRID,   CONTACT_TUBE};

static const Option options[] = {
    {"script", "F.csv", OPTION_FILE, OPTION_AT(RunOptions, script),
     "script of the hand (CSV t_s,push_mm_s,twist_deg_s) instead of the scene's; for several tools t_s,NAME.push_mm_s,NAME.twist_deg_s,…; in a further column, "
     "released or NAME.released, 1 means that no hand holds the tool"},
    {"device", "F.yaml", OPTION_FILE, OPTION_AT(RunOptions, device),
     "a device drives the tool instead of a script, by this map or (auto) a built-in one: the first tool, or that of the map's key `tool`; implies --paced; "
     "may be repeated for up to 8 maps. Needs --duration-s",
     .count = offsetof(RunOptions, device_count), .times = RUN_MAPS},
    {"duration-s", "S", OPTION_NUMBER, OPTION_AT(RunOptions, headless.duration_s), "simulated time", .most = SCRIPT_LONGEST_S, .unit = "s",
     .otherwise = "that of the script; required without a script"},
    {"settle-s", "S", OPTION_NUMBER, OPTION_AT(RunOptions, headless.settle_s),
     "afterwards continues without input for at most S, until nothing moves faster than 0.01 mm/s", .most = SCRIPT_LONGEST_S, .unit = "s", .otherwise = "0"},
    {"record", "F.h5", OPTION_FILE, OPTION_AT(RunOptions, files.record),
     "recording (HDF5): figures of every step, the wire every 10 ms; readable while it is being written"},
    {"summary", "F.json", OPTION_FILE, OPTION_AT(RunOptions, files.summary), "figures of the run; - is standard output (also: --json)"},
    {"json", "F.json", OPTION_FILE, OPTION_AT(RunOptions, files.summary), NULL},
    {"score", "F.json", OPTION_FILE, OPTION_AT(RunOptions, files.score),
     "the score of the hand: times, path lengths, forces, handling errors, points (`exercise:` of the scene)"},
    {"final", "F.csv", OPTION_FILE, OPTION_AT(RunOptions, files.final), "the last state, one row per node"},
    {"picture", "F.png", OPTION_FILE, OPTION_AT(RunOptions, files.picture), "vessel and tool at the end"},
    {"picture-at", "S", OPTION_NUMBER, OPTION_AT(RunOptions, headless.moment_s), "shows this moment instead of the end; up to 6 moments are drawn side by side",
     .most = SCRIPT_LONGEST_S, .unit = "s", .count = offsetof(RunOptions, headless.moment_count), .times = MOMENTS_MOST},
    {"chart", "F.png", OPTION_FILE, OPTION_AT(RunOptions, files.chart),
     "forces at the hand and the wall, contacts, depth, CPU time, iterations and residual over time"},
    {"contact", "KIND", OPTION_CHOICE, OPTION_AT(RunOptions, contact),
     "the surface used for contact: lim, lim_blend, lim_switch, sweep, raster, rbf, pas, mesh, smooth_mesh, flat_mesh, grid or tube", .choices = run_contact,
     .otherwise = "that of the scene"},
    {"paced", NULL, OPTION_FLAG, OPTION_AT(RunOptions, headless.paced),
     "one step per millisecond of real time, with SCHED_FIFO if permitted. Under overload simulated time slows down and the summary reports it "
     "(deadline_misses, slowed_s); no step is skipped or made up for later"},
    CLI_THREADS(RunOptions, threads),
    CLI_QUIET(RunOptions, quiet, "no summary, no progress"),
};

static void set_defaults(void *structure) { *(RunOptions *)structure = (RunOptions){.headless = {.duration_s = -1, .settle_s = -1}, .contact = -1}; }

static const char *check(void *structure)
{
    RunOptions *run = structure;
    HeadlessOptions *headless = &run->headless;
    headless->record = run->files.record;
    headless->scores = run->files.score;
    headless->has_moments = run->files.picture;
    headless->paced |= run->device_count > 0;
    return headless->moment_count && !run->files.picture   ? "--picture-at needs --picture F.png"
           : run->device_count && run->script              ? "give either --device or --script, not both"
           : run->device_count && headless->duration_s < 0 ? "--device needs --duration-s S"
                                                           : NULL;
}

const OptionTable run_options = {
    .program = "seldinger run",
    .does = "runs a scene headless: summary, final state, recording, picture",
    .usage = "SCENE [options]",
    .intro = "Runs a scene (YAML) headless, as fast as possible, and prints a short summary.",
    .notes = "Scene defaults: 200 elements, poisson_ratio 0.3, density 6.45 g/cm3, no damping, no friction, no gravity, inserted 0 mm, step 1 ms, "
             "contact tolerance 1e-6, `normal` (where a rest curvature with plane 0 bends) the coordinate axis after the direction's largest "
             "component, made perpendicular. docs/scene-format.md describes every key of a scene.",
    .exits = "0 done (also when stopped by SIGINT or SIGTERM); 2 wrong usage or bad input; 3 the run diverged, left the vessel, or a file could not "
             "be written completely",
    CLI_OPTIONS(options, RunOptions),
    .set_defaults = set_defaults,
    .check = check,
    .takes_argument = true,
    .argument = offsetof(RunOptions, scene),
    .missing = "missing the scene to run",
    .too_many = "one scene at a time, not also ",
};
