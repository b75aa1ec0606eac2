#include "cli/synth_options.h"

#include "cli/cli.h"

#include <string.h>

static void set_option(SynthCommand *command, const char *key, const char *value)
{
    int at = 0, *count = &command->files.option_count;
    while (at < *count && strcmp(command->option[at][0], key))
        at++;
    *count += at == *count;
    snprintf(command->option[at][0], 64, "%s", key);
    snprintf(command->option[at][1], 64, "%s", value);
}

// By the option's name with _ for -. The shape itself says what is valid.
static const char *take_shape_option(void *structure, const Option *option, const char *text)
{
    char key[64];
    snprintf(key, sizeof key, "%s", option->name);
    for (char *at = key; *at; at++)
        *at = *at == '-' ? '_' : *at;
    set_option(structure, key, text);
    return NULL;
}

// One number for all edges, or three.
static const char *take_voxel(void *structure, const Option *option, const char *text)
{
    double *edge = ((SynthCommand *)structure)->files.volume.voxel_mm;
    char part[3][64];
    (void)option;
    int count = sscanf(text, "%63[^,],%63[^,],%63s", part[0], part[1], part[2]);
    for (int k = 0; k < 3; k++)
        if (!option_number(count == 3 ? part[k] : text, &edge[k]) || edge[k] < 0.01 || edge[k] > 10)
            return "a number from 0.01 to 10, or three X,Y,Z";
    return NULL;
}

#define AT(member) OPTION_AT(SynthCommand, member)
#define SHAPE(name, value, default, text)                                                                                                                      \
    {                                                                                                                                                          \
        name, value, OPTION_NUMBER, AT(option), text, .otherwise = default, .take = take_shape_option                                                          \
    }
static const Option options[] = {
    {"output", "F", OPTION_FILE, AT(output), "what to write, by its extension", .letter = 'o'},
    {"measure", "MODEL.h5", OPTION_FILE, AT(measure), "instead: how far a model fitted to this shape is from the truth"},
    CLI_MODEL(SynthCommand, model, "the model that is measured"),
    {"json", "F.json", OPTION_FILE, AT(json), "figures of --measure as JSON; - is standard output"},
    CLI_QUIET(SynthCommand, quiet, "no summary"),
    {"points", "N", OPTION_NUMBER, AT(option), "samples of a vessel node", .otherwise = "108", .take = take_shape_option, .group = "shape"},
    SHAPE("sac-points", "N", "1500", "samples of an aneurysm node"),
    SHAPE("noise-mm", "X", "0", "standard deviation of the samples' noise along the normal [mm]"),
    SHAPE("seed", "N", "1", "of noise and of the samples' places; tree, arch: of the vessels"),
    SHAPE("spacing", "X", "0.5", "distance of nodes in local radii"),
    SHAPE("blend-mm", "X", "0: 0.6 times the branch's radius", "width of the joints [mm]"),
    SHAPE("length-mm", "X", "4", "capsules: segment [mm]; y: trunk and daughters, twig: vessel"),
    SHAPE("radius-mm", "X", "1; tree: of the trunk, default 1.6", "of the tube [mm]"),
    SHAPE("bend-radius-mm", "X", "4", "arc, bifurcation, helix: centreline [mm]"),
    SHAPE("rise-mm", "X", "0; helix: its rise, default 12", "spiral: how far it winds out of its plane [mm]"),
    SHAPE("turns", "X", "2", "helix"),
    SHAPE("angle-deg", "X", "37.5", "y: of each daughter against the trunk"),
    SHAPE("twig-radius-mm", "X", "0.2", "twig: the tiny vessel"),
    SHAPE("branches", "N", "51", "tree: segments between bifurcations, up to 200"),
    SHAPE("sacs", "N", "0", "tree: aneurysms on its branches"),
    SHAPE("blocks", "N", "6, 0", "bone, tree: dense blocks beside the vessels"),
    SHAPE("gap-mm", "X", "0.2; bone, tree: from wall to block, default 0", "kissing: from wall to wall [mm]"),
    {"gap-voxels", "X", OPTION_NUMBER, AT(gap_voxels), "the same in voxels (the least edge)", .most = 100, .otherwise = ""},
    SHAPE("crossing-deg", "X", "0: side by side", "kissing: angle of the two vessels"),
    SHAPE("arch-type", "N", "1", "arch: variant of the branches: 1 (usual), 2, 4, 5, 6, 7"),
    SHAPE("spread", "X", "1", "arch: factor of the standard deviations; 0: the mean arch"),
    SHAPE("diameter-scale", "X", "1", "arch: of all diameters"),
    SHAPE("scale", "X", "1", "of the whole shape"),
    {"cell-mm", "X", OPTION_NUMBER, AT(files.cell_mm), "grid of the triangles", .least = 0.005, .most = 10, .unit = "mm", .group = "surface"},
    {"voxel-mm", "X|X,Y,Z", OPTION_NUMBER, AT(files.volume.voxel_mm), "edges along the grid's axes", .unit = "mm", .otherwise = "0.2", .take = take_voxel,
     .group = "volume"},
    {"psf-mm", "X", OPTION_NUMBER, AT(files.volume.psf_mm), "standard deviation of the blur", .most = 10, .unit = "mm"},
    {"noise", "X", OPTION_NUMBER, AT(files.volume.noise), "standard deviation of the noise in contrasts (vessel 1, background 0)", .most = 10},
    {"rotate-deg", "X", OPTION_NUMBER, AT(files.volume.rotate_deg), "the grid is turned by this much about (1, 2, 3)", .least = -180, .most = 180},
    {"clip", "X", OPTION_NUMBER, AT(files.volume.clip), "values below are cut", .least = -10, .most = 10, .otherwise = "none"},
    {"saturate", "X", OPTION_NUMBER, AT(files.volume.saturate), "values above are cut", .least = -10, .most = 10, .otherwise = "none"},
    {"fade", "X", OPTION_NUMBER, AT(files.volume.fade), "share of the brightness that is lost from the root to the furthest tip", .most = 1},
    {"bone", "X", OPTION_NUMBER, AT(files.volume.bone), "brightness of the blocks in contrasts", .most = 10},
    {"contrast-grey", "X", OPTION_NUMBER, AT(files.volume.contrast_grey),
     "grey values: whole numbers from 0 to 255, vessels so many levels brighter than the background", .least = 1, .most = 255, .otherwise = "not"},
    {"background-grey", "X", OPTION_NUMBER, AT(background_grey), "grey value of the background; needs --contrast-grey", .most = 255, .otherwise = "60"},
    {"noise-grey", "X", OPTION_NUMBER, AT(noise_grey), "the noise in grey values instead of --noise; needs --contrast-grey", .most = 255, .otherwise = ""},
    {"band-grey", "X", OPTION_NUMBER, AT(band_grey), "a slab across the trunk is brighter by so many grey values; needs --contrast-grey", .least = -255,
     .most = 255, .otherwise = "0: none"},
    {"band-mm", "X", OPTION_NUMBER, AT(files.volume.band_mm), "thickness of this slab, placed by the seed", .least = 0.01, .most = 1000, .unit = "mm"},
    CLI_THREADS(SynthCommand, files.volume.threads),
};

static void set_defaults(void *structure)
{
    *(SynthCommand *)structure =
        (SynthCommand){.files = {.cell_mm = 0.25, .volume = volume_default_options()}, .model = -1, .gap_voxels = -1, .background_grey = -1, .noise_grey = -1};
}

// What was given in grey values, in contrasts. False where it needs a contrast in grey values.
static bool take_grey_values(SynthCommand *command)
{
    VolumeOptions *volume = &command->files.volume;
    if (!(volume->contrast_grey > 0))
        return command->background_grey < 0 && command->noise_grey < 0 && command->band_grey == 0;
    volume->background_grey = command->background_grey < 0 ? volume->background_grey : command->background_grey;
    if (command->noise_grey >= 0)
        volume->noise = command->noise_grey / volume->contrast_grey;
    volume->band = command->band_grey / volume->contrast_grey;
    return true;
}

static const char *check(void *structure)
{
    SynthCommand *command = structure;
    const double *voxel = command->files.volume.voxel_mm;
    if (!command->files.name)
        return "missing a shape: " SHAPE_NAMES;
    if (!command->output == !command->measure)
        return "give either -o F or --measure MODEL.h5";
    if (!take_grey_values(command))
        return "--background-grey, --noise-grey and --band-grey need --contrast-grey X";
    if ((command->json || command->model >= 0) && !command->measure)
        return "--json and --model go with --measure MODEL.h5";
    if (command->gap_voxels >= 0) {
        char gap[64];
        snprintf(gap, sizeof gap, "%.17g", command->gap_voxels * fmin(voxel[0], fmin(voxel[1], voxel[2])));
        set_option(command, "gap_mm", gap);
    }
    command->files.option = (const char(*)[2][64])command->option;
    return NULL;
}

const OptionTable synth_options = {
    .program = "seldinger synth",
    .does = "synthetic shapes with known truth",
    .usage = "SHAPE [options] -o F\nSHAPE [options] --measure MODEL.h5",
    .intro = "Shapes: " SHAPE_NAMES ".\n"
             "F.h5 is a tree of point sets, F.stl or F.ply the surface, F.nrrd a noisy volume; beside the last two stands the true centreline with exact "
             "surface points, F-truth.h5, and F-neighbour.h5 that of a kissing neighbour, which is no part of the truth.",
    .exits = CLI_BAD_INPUT_EXITS,
    CLI_OPTIONS(options, SynthCommand),
    .set_defaults = set_defaults,
    .check = check,
    .takes_argument = true,
    .argument = offsetof(SynthCommand, files.name),
    .may_be_missing = true,
    .too_many = "one shape at a time, not also ",
};
