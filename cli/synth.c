// seldinger synth: synthetic shapes with known truth, as point sets, surfaces or noisy volumes; and a fitted model measured against truth.
#include "cli/cli.h"

#include "base/output.h"
#include "cli/output_plan.h"
#include "recon/fit/lim_fit.h"
#include "recon/phantom/phantom_measure.h"
#include "recon/tree_file.h"
#include "recon/volume/volume_file.h"

#include <cjson/cJSON.h>
#include <getopt.h>
#include <stdlib.h>
#include <string.h>

enum { SHAPE_OPTIONS = 19, FIRST_SHAPE_OPTION = 400 };

typedef struct SynthCommand {
    const char *shape, *output, *measure, *json;
    int option_count;
    char option[SHAPE_OPTIONS][2][64];
    double cell_mm, seed, gap_voxels;
    double noise_grey, band_grey;    // noise -1: not given
    VolumeOptions volume;
    bool quiet;
} SynthCommand;

static const char help[] =
    "Usage: seldinger synth SHAPE [options] -o F\n"
    "       seldinger synth SHAPE [options] --measure MODEL.h5\n\n"
    "Shapes: capsule, open-capsule, arc, bifurcation, spiral, phantom, helix, y, kissing, bone, twig, tree, aorta.\n"
    "F.h5 is a tree of point sets, F.stl or F.ply the surface, F.nrrd a noisy volume; beside the last two stands the true centreline with exact\n"
    "surface points, F-truth.h5, and F-neighbour.h5 that of a kissing neighbour, which is no part of the truth.\n\n"
    "  -o, --output F       what to write, by its extension\n"
    "  --measure MODEL.h5   instead: how far a model fitted to this shape is from the truth\n"
    "  --json F             figures of --measure as JSON; - is standard output\n"
    "  --quiet              no summary\n"
    "shape\n"
    "  --points N           samples of a vessel node; default 108\n"
    "  --sac-points N       samples of an aneurysm node; default 1500\n"
    "  --noise-mm X         standard deviation of the samples' noise along the normal [mm]; default 0\n"
    "  --seed N             of noise and of the samples' places; default 1\n"
    "  --spacing X          distance of nodes in local radii; default 0.5\n"
    "  --blend-mm X         width of the joints [mm]; default 0: 0.6 times the branch's radius\n"
    "  --length-mm X        capsules: segment [mm]; default 4; y: trunk and daughters, twig: vessel\n"
    "  --radius-mm X        of the tube [mm]; default 1; tree: of the trunk, default 1.6\n"
    "  --bend-radius-mm X   arc, bifurcation, helix: centreline [mm]; default 4\n"
    "  --rise-mm X          spiral: how far it winds out of its plane [mm], default 0; helix: its rise, default 12\n"
    "  --turns X            helix; default 2\n"
    "  --angle-deg X        y: of each daughter against the trunk; default 37.5\n"
    "  --twig-radius-mm X   twig: the tiny vessel; default 0.2\n"
    "  --branches N         tree: segments between bifurcations, up to 200; default 51\n"
    "  --sacs N             tree: aneurysms on its branches; default 0\n"
    "  --blocks N           bone, tree: dense blocks beside the vessels; default 6, 0\n"
    "  --gap-mm X           kissing: from wall to wall [mm], default 0.2; bone, tree: from wall to block, default 0\n"
    "  --gap-voxels X       the same in voxels (the least edge)\n"
    "  --crossing-deg X     kissing: angle of the two vessels; default 0: side by side\n"
    "  --scale X            of the whole shape; default 1\n"
    "surface\n"
    "  --cell-mm X          grid of the triangles [mm]; default 0.25\n"
    "volume\n"
    "  --voxel-mm X|X,Y,Z   [mm], edges along the grid's axes; default 0.2\n"
    "  --psf-mm X           standard deviation of the blur [mm]; default 0.2\n"
    "  --noise X            standard deviation of the noise in contrasts (vessel 1, background 0); default 0.05\n"
    "  --rotate-deg X       the grid is turned by this much about (1, 2, 3); default 0\n"
    "  --clip X             values below are cut; default none\n"
    "  --saturate X         values above are cut; default none\n"
    "  --fade X             share of the brightness that is lost from the root to the furthest tip; default 0\n"
    "  --bone X             brightness of the blocks in contrasts; default 1.2\n"
    "  --contrast-grey X    grey values: whole numbers from 0 to 255, vessels so many levels brighter than the background; default: not\n"
    "  --background-grey X  grey value of the background, default 60; needs --contrast-grey\n"
    "  --noise-grey X       standard deviation of the noise in grey values instead of --noise; needs --contrast-grey\n"
    "  --band-grey X        a slab across the trunk is brighter by so many grey values, default 0: none; needs --contrast-grey\n"
    "  --band-mm X          thickness of this slab [mm]; default 4; its place and direction come from the seed\n"
    "  --threads N          default 0: all cores; the volume does not depend on them\n\n"
    "Exit codes: 0 done; 2 wrong usage or bad input.\n";

static int usage_fault(const char *message, const char *what)
{
    fprintf(stderr, "seldinger synth: %s%s; see `seldinger synth --help`\n", message, what);
    return EXIT_BAD_INPUT;
}

static void set_option(SynthCommand *command, const char *key, const char *value)
{
    int at = 0;
    while (at < command->option_count && strcmp(command->option[at][0], key))
        at++;
    command->option_count += at == command->option_count;
    snprintf(command->option[at][0], 64, "%s", key);
    snprintf(command->option[at][1], 64, "%s", value);
}

// One number for all edges, or three.
static bool voxel_edges(const char *text, double edge[3])
{
    char part[3][64];
    int count = sscanf(text, "%63[^,],%63[^,],%63s", part[0], part[1], part[2]);
    for (int k = 0; k < 3; k++)
        if (!cli_number("--voxel-mm", count == 3 ? part[k] : text, 0.01, 10, &edge[k]))
            return false;
    return true;
}

// What was given in grey values, in contrasts. False with a message where it needs a contrast in grey values.
static bool take_grey_values(SynthCommand *command, double background)
{
    VolumeOptions *volume = &command->volume;
    if (!(volume->contrast_grey > 0))
        return background < 0 && command->noise_grey < 0 && command->band_grey == 0;
    volume->background_grey = background < 0 ? volume->background_grey : background;
    if (command->noise_grey >= 0)
        volume->noise = command->noise_grey / volume->contrast_grey;
    volume->band = command->band_grey / volume->contrast_grey;
    return true;
}

// -1: go on; otherwise the exit code. Long because it holds the whole list of options.
static int parse_options(int argc, char **argv, SynthCommand *command)
{
    enum { MEASURE = 256, JSON, QUIET, CELL, VOXEL, PSF, NOISE, ROTATE, CLIP, SATURATE, FADE, BONE, THREADS, GAP_VOXELS, CONTRAST_GREY, BACKGROUND_GREY, NOISE_GREY,
           BAND_GREY, BAND };
    static const char *const keys[SHAPE_OPTIONS] = {"points",   "sac_points", "noise_mm",  "seed",           "spacing",
                                                    "blend_mm", "length_mm",  "radius_mm", "bend_radius_mm", "scale",  "rise_mm",
                                                    "turns",    "angle_deg",  "twig_radius_mm", "branches",  "sacs",   "blocks",    "gap_mm",
                                                    "crossing_deg"};
    static const struct option table[] = {{"output", required_argument, NULL, 'o'},
                                          {"measure", required_argument, NULL, MEASURE},
                                          {"json", required_argument, NULL, JSON},
                                          {"quiet", no_argument, NULL, QUIET},
                                          {"cell-mm", required_argument, NULL, CELL},
                                          {"voxel-mm", required_argument, NULL, VOXEL},
                                          {"psf-mm", required_argument, NULL, PSF},
                                          {"noise", required_argument, NULL, NOISE},
                                          {"points", required_argument, NULL, FIRST_SHAPE_OPTION},
                                          {"sac-points", required_argument, NULL, FIRST_SHAPE_OPTION + 1},
                                          {"noise-mm", required_argument, NULL, FIRST_SHAPE_OPTION + 2},
                                          {"seed", required_argument, NULL, FIRST_SHAPE_OPTION + 3},
                                          {"spacing", required_argument, NULL, FIRST_SHAPE_OPTION + 4},
                                          {"blend-mm", required_argument, NULL, FIRST_SHAPE_OPTION + 5},
                                          {"length-mm", required_argument, NULL, FIRST_SHAPE_OPTION + 6},
                                          {"radius-mm", required_argument, NULL, FIRST_SHAPE_OPTION + 7},
                                          {"bend-radius-mm", required_argument, NULL, FIRST_SHAPE_OPTION + 8},
                                          {"scale", required_argument, NULL, FIRST_SHAPE_OPTION + 9},
                                          {"rise-mm", required_argument, NULL, FIRST_SHAPE_OPTION + 10},
                                          {"turns", required_argument, NULL, FIRST_SHAPE_OPTION + 11},
                                          {"angle-deg", required_argument, NULL, FIRST_SHAPE_OPTION + 12},
                                          {"twig-radius-mm", required_argument, NULL, FIRST_SHAPE_OPTION + 13},
                                          {"branches", required_argument, NULL, FIRST_SHAPE_OPTION + 14},
                                          {"sacs", required_argument, NULL, FIRST_SHAPE_OPTION + 15},
                                          {"blocks", required_argument, NULL, FIRST_SHAPE_OPTION + 16},
                                          {"gap-mm", required_argument, NULL, FIRST_SHAPE_OPTION + 17},
                                          {"crossing-deg", required_argument, NULL, FIRST_SHAPE_OPTION + 18},
                                          {"gap-voxels", required_argument, NULL, GAP_VOXELS},
                                          {"rotate-deg", required_argument, NULL, ROTATE},
                                          {"clip", required_argument, NULL, CLIP},
                                          {"saturate", required_argument, NULL, SATURATE},
                                          {"fade", required_argument, NULL, FADE},
                                          {"bone", required_argument, NULL, BONE},
                                          {"contrast-grey", required_argument, NULL, CONTRAST_GREY},
                                          {"background-grey", required_argument, NULL, BACKGROUND_GREY},
                                          {"noise-grey", required_argument, NULL, NOISE_GREY},
                                          {"band-grey", required_argument, NULL, BAND_GREY},
                                          {"band-mm", required_argument, NULL, BAND},
                                          {"threads", required_argument, NULL, THREADS},
                                          {"help", no_argument, NULL, 'h'},
                                          {0}};
    *command = (SynthCommand){.cell_mm = 0.25, .seed = 1, .gap_voxels = -1, .noise_grey = -1, .volume = volume_default_options()};
    VolumeOptions *volume = &command->volume;
    double threads = 0, background = -1;
    optind = 1;
    for (int choice; (choice = getopt_long(argc, argv, "o:h", table, NULL)) != -1;) {
        if (choice >= FIRST_SHAPE_OPTION) {   // the shape itself says what is valid
            set_option(command, keys[choice - FIRST_SHAPE_OPTION], optarg);
            continue;
        }
        bool good = true;
        switch (choice) {
        case 'o': command->output = optarg; break;
        case MEASURE: command->measure = optarg; break;
        case JSON: command->json = optarg; break;
        case QUIET: command->quiet = true; break;
        case CELL: good = cli_number("--cell-mm", optarg, 0.005, 10, &command->cell_mm); break;
        case VOXEL: good = voxel_edges(optarg, volume->voxel_mm); break;
        case PSF: good = cli_number("--psf-mm", optarg, 0, 10, &volume->psf_mm); break;
        case NOISE: good = cli_number("--noise", optarg, 0, 10, &volume->noise); break;
        case ROTATE: good = cli_number("--rotate-deg", optarg, -180, 180, &volume->rotate_deg); break;
        case CLIP: good = cli_number("--clip", optarg, -10, 10, &volume->clip); break;
        case SATURATE: good = cli_number("--saturate", optarg, -10, 10, &volume->saturate); break;
        case FADE: good = cli_number("--fade", optarg, 0, 1, &volume->fade); break;
        case BONE: good = cli_number("--bone", optarg, 0, 10, &volume->bone); break;
        case CONTRAST_GREY: good = cli_number("--contrast-grey", optarg, 1, 255, &volume->contrast_grey); break;
        case BACKGROUND_GREY: good = cli_number("--background-grey", optarg, 0, 255, &background); break;
        case NOISE_GREY: good = cli_number("--noise-grey", optarg, 0, 255, &command->noise_grey); break;
        case BAND_GREY: good = cli_number("--band-grey", optarg, -255, 255, &command->band_grey); break;
        case BAND: good = cli_number("--band-mm", optarg, 0.01, 1000, &volume->band_mm); break;
        case THREADS: good = cli_whole_number("--threads", optarg, 0, 256, &threads); break;
        case GAP_VOXELS: good = cli_number("--gap-voxels", optarg, 0, 100, &command->gap_voxels); break;
        case 'h': fputs(help, stdout); return EXIT_DONE;
        default: return usage_fault("unknown option or lacking value", "");
        }
        if (!good)
            return EXIT_BAD_INPUT;
    }
    if (optind != argc - 1)
        return usage_fault(optind < argc ? "one shape at a time, not also " : "lacks a shape: ", optind < argc ? argv[optind + 1] : shape_names());
    if (!command->output == !command->measure)
        return usage_fault("give either -o F or --measure MODEL.h5", "");
    if (!take_grey_values(command, background))
        return usage_fault("--background-grey, --noise-grey and --band-grey need --contrast-grey X", "");
    if (command->json && !command->measure)
        return usage_fault("--json goes with --measure MODEL.h5", "");
    command->shape = argv[optind];
    volume->threads = (int)threads;
    if (command->gap_voxels >= 0) {
        char gap[64];
        snprintf(gap, sizeof gap, "%.17g", command->gap_voxels * fmin(volume->voxel_mm[0], fmin(volume->voxel_mm[1], volume->voxel_mm[2])));
        set_option(command, "gap_mm", gap);
    }
    for (int i = 0; i < command->option_count; i++)
        if (!strcmp(command->option[i][0], "seed"))
            command->seed = strtod(command->option[i][1], NULL);
    volume->seed = (uint64_t)command->seed + 1;
    return -1;
}

// --- what is written ---

static bool save_tree(const SynthCommand *command, const Shape *shape, const VesselTree *tree, const char *path, Faults *faults)
{
    char *parameters = NULL;
    size_t length = 0;
    FILE *out = open_memstream(&parameters, &length);
    int blocks;
    const ShapeBlock *block = shape_blocks(shape, &blocks);
    if (out) {
        fprintf(out, "shape: %s\n", command->shape);
        for (int i = 0; i < command->option_count; i++)
            fprintf(out, "%s: %s\n", command->option[i][0], command->option[i][1]);
        fprintf(out, "voxel_mm: %g\n", shape_voxel_mm(shape));
        for (int i = 0; i < blocks; i++) {   // bone: no part of the truth
            fprintf(out, "block_%d: {center_mm: [%.9g, %.9g, %.9g], half_mm: [%.9g, %.9g, %.9g], axes: [", i, block[i].center.x, block[i].center.y,
                    block[i].center.z, block[i].half.x, block[i].half.y, block[i].half.z);
            for (int k = 0; k < 3; k++)
                fprintf(out, "%s[%.9g, %.9g, %.9g]", k ? ", " : "", block[i].axis[k].x, block[i].axis[k].y, block[i].axis[k].z);
            fprintf(out, "]}\n");
        }
    }
    bool good = out && fclose(out) == 0;
    TreeFileInfo info = {.source = (char *)(size_t)command->shape, .parameters = parameters,
                         .created_by = (char *)(size_t) "seldinger " SELDINGER_VERSION " synth"};
    if (!good)
        faults_add(faults, path, 0, 0, "not enough memory");
    good = good && tree_file_save(tree, &info, path, faults);
    free(parameters);
    return good;
}

static bool write_stl(const TriangleMesh *mesh, const char *path, Faults *faults)
{
    size_t room = 84 + 50 * (size_t)mesh->triangle_count;
    unsigned char *bytes = calloc(room, 1);
    if (!bytes) {
        faults_add(faults, path, 0, 0, "not enough memory");
        return false;
    }
    snprintf((char *)bytes, 80, "seldinger " SELDINGER_VERSION " synth, mm");
    uint32_t count = (uint32_t)mesh->triangle_count;
    memcpy(bytes + 80, &count, 4);   // little-endian, as this machine is
    for (int t = 0; t < mesh->triangle_count; t++) {
        const int *v = mesh->triangle[t];
        Vec3 a = mesh->vertex[v[0]], b = mesh->vertex[v[1]], c = mesh->vertex[v[2]];
        Vec3 n = vec3_unit_or(vec3_cross(vec3_sub(b, a), vec3_sub(c, a)), vec3(0, 0, 0));
        const float number[12] = {(float)n.x, (float)n.y, (float)n.z, (float)a.x, (float)a.y, (float)a.z,
                                  (float)b.x, (float)b.y, (float)b.z, (float)c.x, (float)c.y, (float)c.z};
        memcpy(bytes + 84 + 50 * (size_t)t, number, sizeof number);
    }
    bool good = output_write(path, bytes, room, faults);
    free(bytes);
    return good;
}

static bool write_ply(const TriangleMesh *mesh, const char *path, Faults *faults)
{
    char *text = NULL;
    size_t length = 0;
    FILE *out = open_memstream(&text, &length);
    if (out) {
        fprintf(out,
                "ply\nformat ascii 1.0\ncomment seldinger " SELDINGER_VERSION
                " synth, mm\nelement vertex %d\nproperty double x\nproperty double y\nproperty double z\nproperty float nx\nproperty float ny\n"
                "property float nz\nelement face %d\nproperty list uchar int vertex_indices\nend_header\n",
                mesh->vertex_count, mesh->triangle_count);
        for (int i = 0; i < mesh->vertex_count; i++)
            fprintf(out, "%.9g %.9g %.9g %.6g %.6g %.6g\n", mesh->vertex[i].x, mesh->vertex[i].y, mesh->vertex[i].z, mesh->normal[i].x,
                    mesh->normal[i].y, mesh->normal[i].z);
        for (int t = 0; t < mesh->triangle_count; t++)
            fprintf(out, "3 %d %d %d\n", mesh->triangle[t][0], mesh->triangle[t][1], mesh->triangle[t][2]);
    }
    bool written = out && !ferror(out);
    written = out && fclose(out) == 0 && written;
    if (!written)
        faults_add(faults, path, 0, 0, "not enough memory");
    written = written && output_write(path, text, length, faults);
    free(text);
    return written;
}

// F.stl -> F-truth.h5
static void beside(const char *output, const char *extension, const char *what, char *path, size_t capacity)
{
    snprintf(path, capacity, "%.*s-%s.h5", (int)(strlen(output) - strlen(extension)), output, what);
}

static bool write_output(const SynthCommand *command, const Shape *shape, Faults *faults)
{
    char extension[16], truth[4096];
    output_extension(command->output, extension);
    bool is_tree = !strcmp(extension, ".h5") || !strcmp(extension, ".hdf5"), is_volume = !strcmp(extension, ".nrrd");
    bool is_stl = !strcmp(extension, ".stl"), is_ply = !strcmp(extension, ".ply");
    if (!is_tree && !is_volume && !is_stl && !is_ply) {
        faults_add(faults, command->output, 0, 0, "has no known extension; valid: .h5, .stl, .ply, .nrrd");
        return false;
    }
    VesselTree *tree = shape_sample(shape, faults);
    bool good = tree != NULL;
    if (good && is_tree) {
        good = save_tree(command, shape, tree, command->output, faults);
        if (good && !command->quiet)
            printf("%d nodes, %lld points\n", tree->node_count, (long long)tree->point_count);
    } else if (good && is_volume) {
        Volume *volume = shape_volume_with(shape, &command->volume, faults);
        good = volume && volume_save_nrrd(volume, command->output, command->volume.contrast_grey > 0 ? "uint8" : "float", faults);
        if (good && !command->quiet)
            printf("%d x %d x %d voxels of %g x %g x %g mm\n", volume->size[0], volume->size[1], volume->size[2], command->volume.voxel_mm[0],
                   command->volume.voxel_mm[1], command->volume.voxel_mm[2]);
        volume_free(volume);
    } else if (good) {
        TriangleMesh *mesh = shape_surface(shape, command->cell_mm, faults);
        good = mesh && (is_stl ? write_stl(mesh, command->output, faults) : write_ply(mesh, command->output, faults));
        if (good && !command->quiet)
            printf("%d vertices, %d triangles\n", mesh->vertex_count, mesh->triangle_count);
        triangle_mesh_free(mesh);
    }
    if (good && !is_tree) {
        beside(command->output, extension, "truth", truth, sizeof truth);
        good = save_tree(command, shape, tree, truth, faults);
    }
    const Shape *neighbour = shape_neighbour(shape);
    if (good && neighbour) {
        VesselTree *other = shape_sample(neighbour, faults);
        beside(command->output, extension, "neighbour", truth, sizeof truth);
        good = other && save_tree(command, neighbour, other, truth, faults);
        vessel_tree_free(other);
    }
    vessel_tree_free(tree);
    return good;
}

// --- measuring ---

static void print_row(const char *name, const MeasureRow *row)
{
    printf("%-28s %8d %8.4f %8.4f %8.4f %8.4f %8.4f %8.4f\n", name, row->count, row->mean, row->rms, row->median, row->p90, row->p99, row->most);
}

static void json_row(cJSON *root, const char *name, const MeasureRow *row)
{
    cJSON *item = cJSON_AddObjectToObject(root, name);
    cJSON_AddNumberToObject(item, "count", row->count);
    cJSON_AddNumberToObject(item, "mean_mm", row->mean);
    cJSON_AddNumberToObject(item, "rms_mm", row->rms);
    cJSON_AddNumberToObject(item, "p50_mm", row->median);
    cJSON_AddNumberToObject(item, "p90_mm", row->p90);
    cJSON_AddNumberToObject(item, "p99_mm", row->p99);
    cJSON_AddNumberToObject(item, "max_mm", row->most);
}

static bool measure(const SynthCommand *command, const Shape *shape, Faults *faults)
{
    VesselTree *model = tree_file_load(command->measure, NULL, faults);
    ShapeMeasure figures;
    if (model && !vessel_tree_is_model(model))
        faults_add(faults, command->measure, 0, 0, "is a tree without a model; make one with `seldinger fit`");
    bool good = faults->count == 0 && shape_measure(shape, model, &figures);
    if (!good && faults->count == 0)
        faults_add(faults, command->measure, 0, 0, "not enough memory");
    if (good && command->json) {
        cJSON *root = cJSON_CreateObject();
        json_row(root, "truth_to_model", &figures.to_model);
        json_row(root, "model_to_truth", &figures.to_truth);
        json_row(root, "jump", &figures.jump);
        cJSON_AddNumberToObject(root, "bias_mm", figures.bias);
        cJSON_AddNumberToObject(root, "least_clearance_ratio", figures.least_clearance);
        cJSON_AddNumberToObject(root, "worst_node", figures.worst_node);
        char *text = cJSON_Print(root);
        good = text && output_write(command->json, text, strlen(text), faults);
        free(text);
        cJSON_Delete(root);
    }
    if (good && !command->quiet && !(command->json && !strcmp(command->json, "-"))) {
        printf("%-28s %8s %8s %8s %8s %8s %8s %8s\n", "distance [mm]", "count", "mean", "rms", "p50", "p90", "p99", "max");
        print_row("true surface to model", &figures.to_model);
        print_row("model in its cell to truth", &figures.to_truth);
        print_row("jump between neighbours", &figures.jump);
        printf("bias %+.4f mm, least clearance at node centres %.3f of the true, worst node %d\n", figures.bias, figures.least_clearance,
               figures.worst_node);
    }
    vessel_tree_free(model);
    return good;
}

int verb_synth(int argc, char **argv)
{
    static Faults faults;
    SynthCommand command;
    int code = parse_options(argc, argv, &command);
    if (code >= 0)
        return code;
    Shape *shape = shape_create(command.shape, command.option_count, (const char(*)[2][64])command.option, "synth", &faults);
    OutputPlan plan = {.faults = &faults};
    output_plan_write_file(&plan, "-o", command.output);
    output_plan_write(&plan, "--json", command.json);
    output_plan_read(&plan, "--measure", command.measure);
    bool good = faults.count == 0 && (command.measure ? measure(&command, shape, &faults) : write_output(&command, shape, &faults));
    shape_free(shape);
    return good ? EXIT_DONE : cli_bad_input(&faults);
}
