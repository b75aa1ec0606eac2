#include "cli/segment_options.h"

#include "cli/cli.h"
#include "recon/recon.h"

// The report shows the point as it was typed.
static const char *take_start(void *structure, const Option *option, const char *text)
{
    SegmentCommand *command = structure;
    double point[3];
    (void)option;
    if (!option_point(text, point))
        return "--start takes a point: three numbers X,Y,Z in mm";
    command->start = text;
    command->start_mm = vec3(point[0], point[1], point[2]);
    return NULL;
}

#define AT(member) OPTION_AT(SegmentCommand, member)
static const Option options[] = {
    {"trace", "F.yaml", OPTION_FILE, AT(trace), "file with the starts of branches, aneurysms and parameters", .letter = 't'},
    {"start", "X,Y,Z", OPTION_POINT, AT(start), "instead of a trace: one point in a vessel, from which the whole tree is tracked", .unit = "mm",
     .take = take_start},
    {"until", "X,Y,Z", OPTION_POINT, AT(until), "the tree ends at this point in a vessel; may be repeated", .unit = "mm",
     .count = offsetof(SegmentCommand, until_count), .times = SEGMENT_POINTS},
    {"not", "X,Y,Z", OPTION_POINT, AT(rival), "a point in an unwanted vessel: it is tracked too, and the tree ends where the two meet; may be repeated",
     .unit = "mm", .count = offsetof(SegmentCommand, rival_count), .times = SEGMENT_POINTS},
    {"output", "TREE.h5", OPTION_FILE, AT(out), "the tree (required)", .letter = 'o'},
    CLI_THREADS(SegmentCommand, threads),
    {"seed", "N", OPTION_WHOLE, AT(seed), "seed of the random numbers", .most = 9007199254740991.0, .otherwise = "that of the trace, else 1"},
    {"json", "F", OPTION_FILE, AT(json), "figures of the table and further ones as JSON"},
    {"picture", "F.png", OPTION_FILE, AT(picture), "maximum intensity projections along the three axes, with the tree drawn over them"},
    {"quiet", NULL, OPTION_FLAG, AT(quiet), "no table, no progress bar", .letter = 'q'},
};

static void set_defaults(void *structure) { *(SegmentCommand *)structure = (SegmentCommand){.seed = -1}; }

static const char *check(void *structure)
{
    const SegmentCommand *command = structure;
    return !command->out ? "missing -o TREE.h5" : !command->trace == !command->start ? "expected either --trace F.yaml or --start X,Y,Z" : NULL;
}

const OptionTable segment_options = {
    .program = "seldinger segment",
    .does = "tracks the vessels of an angiogram (RBT) from one point or a trace to a tree of nodes with local points",
    .usage = "VOLUME --start X,Y,Z -o TREE.h5\nVOLUME --trace F.yaml -o TREE.h5",
    .intro = "Tracks vessels through an angiogram (RBT, Kerrien et al. 2017, section 3): from VOLUME to a tree of cylinders, each with its points on the wall.",
    .notes =
        "VOLUME is NRRD (raw, gzip or text, attached or detached), MetaImage, NIfTI-1, or DICOM (the folder of a series, one of its files, or a multi-frame "
        "file), recognised by its content.\n\n"
        "The trace is YAML. The first branch needs a start; its direction (toward, a point further down the vessel) and radius_mm are estimated if not "
        "given. The start becomes the root of the tree; without `toward` one end of the branch does: the one at the border of the volume, or the wider one. "
        "If this is the only branch (or with automatic: 1), the rest of the tree is found from it, downstream, including aneurysms. Further branches need "
        "only a start: it is projected onto the tree tracked so far, and tracking starts beside the parent; with `toward` it starts at the point itself and "
        "runs in both directions. All coordinates may be in voxels instead of mm (start_voxel, toward_voxel, centers_voxel):\n\n"
        "  branches:\n"
        "    - {name: carotid, start_mm: [74.8, 12.8, 60.8], toward_mm: [72.8, 16, 61.6], radius_mm: 2}\n"
        "    - {start_voxel: [95, 118, 172]}\n"
        "  aneurysms:\n"
        "    - {centers_mm: [[44, 42.4, 64]]}\n"
        "  parameters: default        # or paper: the published values, without later additions\n"
        "  p_inl: 0.7                 # and any of the parameters below\n\n"
        "The image decides where a branch leaves its parent. The best path near the straight link is supported if its darkest place keeps at least half of "
        "the branch's contrast, and doubtful down to a quarter. Below that the branch is attached to another vessel with a path to it, or it is left out "
        "with everything attached to it (a branch named in the trace is kept with a warning, but no tool can pass into it). The summary lists all links that "
        "are not supported.\n\n"
        "Corrections leave the rest of the tree unchanged, bit for bit; with automatic: 1 further branches are corrections too, tracked after the automatic "
        "ones:\n\n"
        "  automatic: 1\n"
        "  forbid: [{center_voxel: [120, 90, 60], radius_mm: 3}]   # no node in this ball\n"
        "  cut: [{point_mm: [40, 31, 22]}]                        # the nearest branch ends here, and everything attached beyond is removed; a remaining "
        "stub too\n"
        "  until: [{point_mm: [44, 20, 70]}]                      # (--until) tracking does not pass this point of a vessel\n"
        "  not: [{point_voxel: [150, 40, 90]}]                    # (--not) in an unwanted vessel, such as a sinus: it competes for the lumen\n\n"
        "A vessel of `not` is tracked with its branches and removed at the end: the tree ends where it meets that vessel; a lumen that contains both points "
        "is divided at its narrowest place between them. Where the end of a branch meets another branch of the tree, a loop is reported, because a tree has "
        "none. `until` or `not` can remove the unwanted side.\n\n"
        "Starts are checked. They are refused if the vessel found lies more than two of its radii from the point, is wider than the volume, or does not "
        "stand out from the noise. A warning is given (on standard error, and in --json) if the point lies outside the vessel's radius, if less than half of "
        "the edge points lie on the cylinders, and in other doubtful cases. A volume in which the noise exceeds the contrast of the vessel is smoothed "
        "first, and this is reported.\n\n"
        "Parameters of the tracking (default; paper):\n",
    .more_notes = rbt_parameters_help,
    .exits = CLI_BAD_INPUT_EXITS,
    CLI_OPTIONS(options, SegmentCommand),
    .set_defaults = set_defaults,
    .check = check,
    .takes_argument = true,
    .argument = offsetof(SegmentCommand, volume),
    .missing = "missing the volume",
    .too_many = "one volume, not also ",
};
