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
    {"model", "KIND", OPTION_CHOICE, AT(fit.model),
     "lim: blobs; sweep: curves with polar cross-sections along them, blended at forks; raster, rbf, pas: the same with sections of Kretschmer et al. 2013, "
     "Hong et al. 2018 and 2012. The file keeps the models of other kinds that TREE.h5 holds. "
     "Without -o: the model that is measured, by default the first of these that the file has",
     .choices = model_names, .given = offsetof(FitCommand, has_model)},
    {"preset", "NAME", OPTION_CHOICE, AT(fit.preset),
     "default: the recommended form of each model; local (lim): a model for each node, neighbours blended; paper: the published values and method (sweep: as "
     "raster). Must come before the other options",
     .choices = presets, .take = take_preset},
    {"target-mm", "X", OPTION_NUMBER, AT(fit.local.target_mm),
     "target distance of the wall from the points. default: a blob is added where the mean distance exceeds a fifth of this; without --target-mm where it "
     "exceeds 0.05 voxel, or, if the voxel size is unknown, 0.02 r, r the radius of the node. local: the fit stops when every point is this near; by default "
     "max(0.5 voxel, min(0.2 r, 1.5 voxels)), or 0.08 r if the voxel size is unknown; half of it near an aneurysm. paper: 0.3",
     .least = 1e-4, .most = 100, .otherwise = ""},
    {"max-blobs", "N", OPTION_INT, AT(fit.local.max_blobs), "local, paper: largest number of blobs of a local model", .least = 2, .most = 1000,
     .given = offsetof(FitCommand, has_max_blobs)},
    {"voxel-mm", "X", OPTION_NUMBER, AT(fit.local.voxel_mm), "voxel size of the angiogram [mm]", .least = 1e-4, .most = 100,
     .given = offsetof(FitCommand, fit.has_voxel), .otherwise = "`voxel_mm` of the tree's file; if unknown, the classes of d_a are 0.2 mm wide"},
    {"edge-blur-mm", "X", OPTION_NUMBER, AT(fit.edge_blur),
     "standard deviation of the blur that has shifted the points inwards; before the fit they are moved outwards by the shift that this blur causes for a "
     "vessel of their radius, at most 0.2 X",
     .most = 100, .otherwise = "`edge_blur_mm` of the tree's file, as `segment` estimated it; with --preset paper 0"},
    {"alpha", "X", OPTION_NUMBER, AT(fit.local.alpha), "local, paper: weight of the cohesion of blobs", .most = 1, .otherwise = "0, paper 1e-5",
     .given = offsetof(FitCommand, has_alpha)},
    {"beta", "X", OPTION_NUMBER, AT(fit.local.beta),
     "local, paper: smoothing. local: relative weight of curvature in units of the noise's variance, estimated from the points, times r^2 (0: none); default "
     "1e-4. paper: weight of curvature itself [mm^4]; default 1e-3",
     .most = 10, .otherwise = "", .given = offsetof(FitCommand, has_beta)},
    {"max-points", "N", OPTION_INT, AT(fit.local.max_points),
     "local, paper: largest number of points of a local model (thinned evenly); five times as many near an aneurysm", .least = 50, .most = 100000,
     .otherwise = "300, paper 1500", .given = offsetof(FitCommand, has_max_points)},
    CLI_THREADS(FitCommand, fit.local.threads),
    {"measure", NULL, OPTION_FLAG, AT(measure),
     "also measures how far the walls of neighbouring nodes differ where a tool passes from one to the next, walls that no point supports, and narrow links; "
     "without -o the model of the given file is measured and not fitted again"},
    {"tool-radius-mm", "X", OPTION_NUMBER, AT(junctions.tool_radius), "radius of the tool whose reach from the model's inlet is reported at the end",
     .least = 0.01, .most = 100},
    {"json", "F.json", OPTION_FILE, AT(json), "figures as JSON; - is standard output"},
    {"picture", "F.png", OPTION_FILE, AT(picture), "the fitted surface, coloured by the distance to the points, with the worst nodes cut open"},
    {"junctions", "F.png", OPTION_FILE, AT(junctions.picture),
     "a section through each junction, the narrowest first; further pages are written to F-2.png, F-3.png, …"},
    {"volume", "V", OPTION_FILE, AT(junctions.volume), "the angiogram, shown behind these sections"},
    CLI_QUIET(FitCommand, quiet, "no summary, no progress"),
};

static void set_defaults(void *structure)
{
    *(FitCommand *)structure = (FitCommand){.fit = tree_fit_default_options(), .junctions = {.tool_radius = reach_default_options().tool_radius}};
}

static const char *check(void *structure)
{
    const FitCommand *command = structure;
    bool is_swept = fit_model_is_swept(command->fit.model), is_local = command->fit.preset != FIT_DEFAULT && !is_swept;
    return !command->output && !command->measure          ? "missing -o MODEL.h5"
           : is_swept && command->fit.preset == FIT_LOCAL ? "--preset local needs --model lim"
           : command->has_alpha && !is_local              ? "--alpha needs --preset local or paper"
           : command->has_beta && !is_local               ? "--beta needs --preset local or paper"
           : command->has_max_blobs && !is_local          ? "--max-blobs needs --preset local or paper"
           : command->has_max_points && !is_local         ? "--max-points needs --preset local or paper"
                                                          : NULL;
}

const OptionTable fit_options = {
    .program = "seldinger fit",
    .does = "fits a vessel wall to the points of a tree (LIM)",
    .usage = "TREE.h5 -o MODEL.h5 [options]\nMODEL.h5 --measure [--json F]",
    .intro = "Fits an implicit wall to the points of a tree: one field of shared blobs of compact support, which is continuous across every border "
             "between neighbouring nodes; or, by preset, a local blobby model for each node (LIM, Kerrien et al. 2017). --model sweep: a centreline curve with "
             "cross-sections for each branch.",
    .exits = CLI_BAD_INPUT_EXITS,
    CLI_OPTIONS(options, FitCommand),
    .set_defaults = set_defaults,
    .check = check,
    .takes_argument = true,
    .argument = offsetof(FitCommand, tree),
    .missing = "missing the tree to fit",
    .too_many = "one tree at a time, not also ",
};
