#include "cli/import_options.h"

#include "cli/cli.h"

#define AT(member) OPTION_AT(ImportCommand, member)
#define CURVES AT(centreline), .count = offsetof(ImportCommand, centreline_count), .times = IMPORT_FILES, .takes_following = true
static const Option options[] = {
    {"surface", "F", OPTION_FILE, AT(surface), "the surface (needed)"},
    {"centerline", "F...", OPTION_FILE, CURVES, .help = "centrelines; may be given again"},
    {"centreline", "F...", OPTION_FILE, CURVES},
    {"output", "F.h5", OPTION_FILE, AT(output), "the tree (needed)", .letter = 'o'},
    {"root", "X,Y,Z", OPTION_POINT, AT(options.root), "the vessel's end nearest to this point [mm] is the root, cut open where the surface is closed there",
     .given = offsetof(ImportCommand, options.has_root), .otherwise = "the widest open end, else the widest, which then stays closed"},
    {"scale", "S", OPTION_NUMBER, AT(scale), "of the surface to mm, 1000 where it is in metres", .least = 1e-9, .most = 1e9,
     .given = offsetof(ImportCommand, has_scale)},
    {"spacing", "X", OPTION_NUMBER, AT(options.spacing), "distance of nodes in local radii", .least = 0.05, .most = 4},
    {"points", "N", OPTION_WHOLE, AT(options.points_per_node), "points of a node, about", .least = 20, .most = 2000},
    {"centerline-out", "F", OPTION_FILE, AT(centreline_out), "the centrelines that were used, .vtp, .mrk.json or .swc"},
    CLI_THREADS(ImportCommand, options.threads),
    {"json", "F.json", OPTION_FILE, AT(json), "figures as JSON; - is standard output"},
    CLI_QUIET(ImportCommand, quiet, "no summary"),
};

static void set_defaults(void *structure) { *(ImportCommand *)structure = (ImportCommand){.options = import_default_options(), .scale = 1}; }

static const char *check(void *structure)
{
    const ImportCommand *command = structure;
    return !command->surface ? "missing --surface F" : !command->output ? "missing -o TREE.h5" : NULL;
}

const OptionTable import_options = {
    .program = "seldinger import",
    .does = "the same tree from a surface, with centrelines or alone",
    .usage = "--surface F -o TREE.h5 [options]",
    .intro = "A vessel's surface and its centrelines become the tree that `seldinger fit` takes. Without centrelines they are computed; a result that leaves "
             "out more "
             "than 10 % of the surface is refused. Narrow branches that no centreline runs into are left out.\n"
             "Surface: STL, PLY, OBJ or VTK PolyData (.vtp), open or closed; flat lids over the ends of a closed one are taken off.\n"
             "Centrelines: VTK PolyData (.vtp), 3D Slicer Markups (.mrk.json), SWC; several files and overlapping curves make one tree.\n"
             "Reports defects of the surface and repairs them.\n"
             "A branch whose link to its parent has no path inside the surface hangs on another vessel in plain sight, or is left out; the summary names it.",
    .exits = CLI_BAD_INPUT_EXITS,
    CLI_OPTIONS(options, ImportCommand),
    .set_defaults = set_defaults,
    .check = check,
    .too_many = "what is this argument for: ",
};
