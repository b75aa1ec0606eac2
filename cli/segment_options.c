#include "cli/segment_options.h"

#include "cli/cli.h"
#include "recon/recon.h"

// The figures name the point as it was written.
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
    {"trace", "F.yaml", OPTION_FILE, AT(trace), "where branches start, aneurysms, parameters", .letter = 't'},
    {"start", "X,Y,Z", OPTION_POINT, AT(start), "instead of a trace: one point in a vessel; the whole tree is found from it", .unit = "mm", .take = take_start},
    {"until", "X,Y,Z", OPTION_POINT, AT(until), "the tree ends at this point in a vessel; may be given several times", .unit = "mm",
     .count = offsetof(SegmentCommand, until_count), .times = SEGMENT_POINTS},
    {"not", "X,Y,Z", OPTION_POINT, AT(rival), "a point in a vessel that is not wanted: it is tracked too, and the tree ends where it meets it; several times",
     .unit = "mm", .count = offsetof(SegmentCommand, rival_count), .times = SEGMENT_POINTS},
    {"output", "TREE.h5", OPTION_FILE, AT(out), "the tree (needed)", .letter = 'o'},
    CLI_THREADS(SegmentCommand, threads),
    {"seed", "N", OPTION_WHOLE, AT(seed), "seed of the random numbers", .most = 9007199254740991.0, .otherwise = "1 or the trace's"},
    {"json", "F", OPTION_FILE, AT(json), "the figures of the table, and more, as JSON"},
    {"picture", "F.png", OPTION_FILE, AT(picture), "maximum intensity projections along the three axes with the tree drawn over"},
    {"quiet", NULL, OPTION_FLAG, AT(quiet), "no table, no progress bar", .letter = 'q'},
};

static void set_defaults(void *structure) { *(SegmentCommand *)structure = (SegmentCommand){.seed = -1}; }

static const char *check(void *structure)
{
    const SegmentCommand *command = structure;
    return !command->out ? "missing -o TREE.h5" : !command->trace == !command->start ? "either --trace F.yaml or --start X,Y,Z is needed" : NULL;
}

const OptionTable segment_options = {
    .program = "seldinger segment",
    .does = "RBT: an angiogram, from one click or --trace F.yaml, to a tree of nodes with local points",
    .usage = "VOLUME --start X,Y,Z -o TREE.h5\nVOLUME --trace F.yaml -o TREE.h5",
    .intro = "Tracks vessels through an angiogram (RBT, Kerrien et al. 2017, section 3): VOLUME to a tree of cylinders, each with its points on the wall.",
    .notes =
        "VOLUME is NRRD (raw, gzip or text, attached or detached), MetaImage, NIfTI-1, or DICOM (the folder of a series, one of its files, or a "
        "multi-frame file), recognised by its content.\n\n"
        "The trace is YAML. The first branch needs a start; its direction (toward, a point further down the vessel) and radius_mm are estimated where they are "
        "not given. It becomes the root of the tree, and without a toward one of its two ends does, at the volume's border or wider than the other. Where it "
        "is "
        "the only one (or with automatic: 1) the rest of the tree is found from it, downstream, aneurysms too. Further branches need a start alone: it is "
        "projected to the tree tracked so far and the tracking starts beside the parent; with a `toward` it starts at the point itself and runs both ways. All "
        "of mm may be voxels (start_voxel, toward_voxel, centers_voxel):\n\n"
        "  branches:\n"
        "    - {name: carotid, start_mm: [74.8, 12.8, 60.8], toward_mm: [72.8, 16, 61.6], radius_mm: 2}\n"
        "    - {start_voxel: [95, 118, 172]}\n"
        "  aneurysms:\n"
        "    - {centers_mm: [[44, 42.4, 64]]}\n"
        "  parameters: default        # or paper: the values of the paper, without what was added\n"
        "  p_inl: 0.7                 # and any of these by name\n\n"
        "Where a branch leaves its parent the image decides: the best path beside the straight link is supported where its darkest place keeps half of the "
        "branch's contrast, doubtful down to a quarter; with less the branch hangs on another vessel that a path leads to, or is left out with what hangs on "
        "it (one that the trace names stays, with a warning, and nothing opens into it). The summary names all but the supported ones.\n\n"
        "Corrections leave the rest of the tree as it is, bit for bit; with automatic: 1 further branches are one, tracked after all that was found:\n\n"
        "  automatic: 1\n"
        "  forbid: [{center_voxel: [120, 90, 60], radius_mm: 3}]   # no node in this ball\n"
        "  cut: [{point_mm: [40, 31, 22]}]                        # the nearest branch ends here, and what hangs on it goes; a stub of it goes too\n"
        "  until: [{point_mm: [44, 20, 70]}]                      # (--until) tracking does not pass this point of a vessel\n"
        "  not: [{point_voxel: [150, 40, 90]}]                    # (--not) in a vessel that is not wanted, say a sinus: it competes for the lumen\n\n"
        "A vessel of `not` is tracked with its branches, and left out at the end: the tree ends where it meets it; one lumen that holds both points is divided "
        "at its "
        "narrowest place between them. Where a branch's end meets another branch of the tree a loop is reported: the tree has none. `until` or `not` can take "
        "out the side "
        "that is not wanted.\n\n"
        "Starts are judged: refused where the vessel found lies more than two of its radii from the click, is wider than the volume, or does not stand out of "
        "the noise; "
        "warned of (on standard error, and in --json) where the click lies outside its radius, where less than half of the edge points lie on the cylinders, "
        "and more. A volume "
        "whose voxels are noisier than the vessel is bright is smoothed first, and that is said.\n\n"
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
