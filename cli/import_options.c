#include "cli/import_options.h"

#include "cli/cli.h"

#define AT(member) OPTION_AT(ImportCommand, member)
#define CURVES AT(centreline), .count = offsetof(ImportCommand, centreline_count), .times = IMPORT_FILES, .takes_following = true
static const Option options[] = {
    {"surface", "F", OPTION_FILE, AT(surface), "the surface (required)"},
    {"centerline", "F...", OPTION_FILE, CURVES, .help = "centrelines; may be repeated"},
    {"centreline", "F...", OPTION_FILE, CURVES},
    {"output", "F.h5", OPTION_FILE, AT(output), "the tree (required)", .letter = 'o'},
    {"root", "X,Y,Z", OPTION_POINT, AT(options.root),
     "the vessel end nearest to this point [mm] becomes the root; it is cut open if the surface is closed there",
     .given = offsetof(ImportCommand, options.has_root), .otherwise = "the widest open end; without one the widest end, which stays closed"},
    {"scale", "S", OPTION_NUMBER, AT(scale), "factor from the unit of the surface to mm; 1000 for metres", .least = 1e-9, .most = 1e9,
     .given = offsetof(ImportCommand, has_scale)},
    {"spacing", "X", OPTION_NUMBER, AT(options.spacing), "distance between nodes in local radii", .least = 0.05, .most = 4},
    {"points", "N", OPTION_WHOLE, AT(options.points_per_node), "approximate number of points per node", .least = 20, .most = 2000},
    {"centerline-out", "F", OPTION_FILE, AT(centreline_out), "writes the centrelines that were used: .vtp, .mrk.json or .swc"},
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
    .does = "makes a tree from a surface, with or without centrelines",
    .usage = "--surface F -o TREE.h5 [options]",
    .intro =
        "Makes from the surface of a vessel and its centrelines the tree that `seldinger fit` takes. Without given centrelines they are computed; a result "
        "that misses more than 10 % of the surface is refused. Narrow branches without a centreline are left out.\n"
        "Surface: STL, PLY, OBJ or VTK PolyData (.vtp), open or closed; flat caps over the ends of a closed surface are removed.\n"
        "Centrelines: VTK PolyData (.vtp), 3D Slicer Markups (.mrk.json), SWC; several files and overlapping curves give one tree.\n"
        "Reports defects of the surface and repairs them.\n"
        "If the link from a branch to its parent has no path inside the surface, the branch is attached to another visible vessel or left out; the summary "
        "lists it.",
    .exits = CLI_BAD_INPUT_EXITS,
    CLI_OPTIONS(options, ImportCommand),
    .set_defaults = set_defaults,
    .check = check,
    .too_many = "unexpected argument ",
};
