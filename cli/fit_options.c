#include "cli/fit_options.h"

#include "cli/cli.h"

#include <string.h>

static const char *take_preset(void *structure, const Option *option, const char *text)
{
    FitCommand *command = structure;
    for (int i = 0; option->choices[i]; i++)
        if (!strcmp(text, option->choices[i])) {
            command->fit.preset = (FitPreset)i;
            command->fit.local = i == FIT_PAPER ? lim_fit_paper_options() : lim_fit_default_options();
            return NULL;
        }
    return "valid: default, local, paper";
}

#define AT(member) OPTION_AT(FitCommand, member)
static const char *const presets[] = {"default", "local", "paper", NULL};
static const Option options[] = {
    {"output", "F.h5", OPTION_FILE, AT(output), "the model", .letter = 'o'},
    {"preset", "NAME", OPTION_CHOICE, AT(fit.preset),
     "default: shared blobs; local: a model for each node, neighbours blended; paper: the published values and method. Give it before other options",
     .choices = presets, .take = take_preset},
    {"target-mm", "X", OPTION_NUMBER, AT(fit.local.target_mm),
     "how near the wall points should be: a blob is added where their mean distance is more than a fifth of this; by default more than 0.05 voxel, where no "
     "voxel "
     "is known 0.02 r of the node's radius r. local: stop when every point is this near; default max(0.5 voxel, min(0.2 r, 1.5 voxels)), where no voxel is "
     "known "
     "0.08 r; half of it near an aneurysm. paper: 0.3",
     .least = 1e-4, .most = 100, .otherwise = ""},
    {"max-blobs", "N", OPTION_INT, AT(fit.local.max_blobs), "local, paper: blobs of a local model, at most", .least = 2, .most = 1000,
     .given = offsetof(FitCommand, has_max_blobs)},
    {"voxel-mm", "X", OPTION_NUMBER, AT(fit.local.voxel_mm), "voxel size of the angiogram [mm]", .least = 1e-4, .most = 100,
     .given = offsetof(FitCommand, fit.has_voxel),
     .otherwise = "what the tree's file says (`voxel_mm`), else not known: the classes of d_a are then of 0.2 mm"},
    {"edge-blur-mm", "X", OPTION_NUMBER, AT(fit.edge_blur),
     "blur (standard deviation) that has moved the points inside the wall; they are first moved out by what it did to a vessel of their radius, at most 0.2 X",
     .most = 100, .otherwise = "what `segment` found (`edge_blur_mm`); with --preset paper 0"},
    {"alpha", "X", OPTION_NUMBER, AT(fit.local.alpha), "local, paper: weight of the cohesion of blobs", .most = 1, .otherwise = "0, paper 1e-5",
     .given = offsetof(FitCommand, has_alpha)},
    {"beta", "X", OPTION_NUMBER, AT(fit.local.beta),
     "local, paper: smoothing: by default 1e-4, which weighs curvature by the noise's variance times r^2 as found from the points (twice: twice that, 0: "
     "none); "
     "paper 1e-3, the weight of curvature itself [mm^4]",
     .most = 10, .otherwise = "", .given = offsetof(FitCommand, has_beta)},
    {"max-points", "N", OPTION_INT, AT(fit.local.max_points),
     "local, paper: points of a local model, at most (evenly thinned), five times as many near an aneurysm", .least = 50, .most = 100000,
     .otherwise = "300, paper 1500", .given = offsetof(FitCommand, has_max_points)},
    CLI_THREADS(FitCommand, fit.local.threads),
    {"measure", NULL, OPTION_FLAG, AT(measure),
     "also: how far neighbouring nodes' walls differ where a tool passes from one to the next, walls that no point supports, narrow links; without -o of the "
     "model "
     "given, which is then not fitted again"},
    {"tool-radius-mm", "X", OPTION_NUMBER, AT(junctions.tool_radius),
     "of the tool that is led from the model's inlet through the tree, for the report at the end", .least = 0.01, .most = 100},
    {"json", "F.json", OPTION_FILE, AT(json), "figures as JSON; - is standard output"},
    {"picture", "F.png", OPTION_FILE, AT(picture), "fitted surface coloured by the distance to the points, the worst nodes cut open"},
    {"junctions", "F.png", OPTION_FILE, AT(junctions.picture), "a section through each junction, the narrowest first; further pages are F-2.png and so on"},
    {"volume", "V", OPTION_FILE, AT(junctions.volume), "the angiogram behind these"},
    CLI_QUIET(FitCommand, quiet, "no summary, no progress"),
};

static void set_defaults(void *structure)
{
    *(FitCommand *)structure = (FitCommand){.fit = tree_fit_default_options(), .junctions = {.tool_radius = reach_default_options().tool_radius}};
}

static const char *check(void *structure)
{
    const FitCommand *command = structure;
    bool is_local = command->fit.preset != FIT_DEFAULT;
    return !command->output && !command->measure  ? "missing -o MODEL.h5"
           : command->has_alpha && !is_local      ? "--preset local or paper is needed for --alpha"
           : command->has_beta && !is_local       ? "--preset local or paper is needed for --beta"
           : command->has_max_blobs && !is_local  ? "--preset local or paper is needed for --max-blobs"
           : command->has_max_points && !is_local ? "--preset local or paper is needed for --max-points"
                                                  : NULL;
}

const OptionTable fit_options = {
    .program = "seldinger fit",
    .does = "LIM: a local blobby model for each node",
    .usage = "TREE.h5 -o MODEL.h5 [options]\nMODEL.h5 --measure [--json F]",
    .intro = "Fits an implicit wall to the points of a tree: one field of shared blobs of compact support, which is the same from both sides of every border "
             "between neighbouring nodes; or, by preset, a local blobby model for each node (LIM, Kerrien et al. 2017).",
    .exits = CLI_BAD_INPUT_EXITS,
    CLI_OPTIONS(options, FitCommand),
    .set_defaults = set_defaults,
    .check = check,
    .takes_argument = true,
    .argument = offsetof(FitCommand, tree),
    .missing = "missing the tree to fit",
    .too_many = "one tree at a time, not also ",
};
