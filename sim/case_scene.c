#include "sim/case_scene.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// Wires as in scenes/tools: the shaft's length is what remains.
typedef struct CaseWire {
    const char *name;
    double tip;              // [mm] length of the sections after the shaft
    const char *shaft, *tip_sections, *damping;
} CaseWire;
static const CaseWire wires[] = {
    {"a nitinol wire of 0.014 inch with an angled tip (scenes/tools/wire-014-nitinol.yaml)", 85,
     "diameter_mm: 0.3556, young_modulus_gpa: 59.88, poisson_ratio: 0.3, density_g_cm3: 6.45",
     "    - {length_mm: 50, diameter_mm: 0.3556, young_modulus_gpa: 19.11, poisson_ratio: 0.3, density_g_cm3: 6.45}\n"
     "    - {length_mm: 25, diameter_mm: 0.3556, young_modulus_gpa: 2.548, poisson_ratio: 0.3, density_g_cm3: 6.45, attenuation_1_mm: 3}\n"
     "    - {length_mm: 10, diameter_mm: 0.3556, young_modulus_gpa: 2.548, poisson_ratio: 0.3, density_g_cm3: 6.45, attenuation_1_mm: 3, rest_curvature_1_mm: "
     "0.1}\n",
     "{mass_1_s: 0.1, stiffness_s: 0.0002}"},
    {"a wire of 0.035 inch with an angled tip (scenes/exercises/left-carotid.yaml)", 100,
     "diameter_mm: 0.89, young_modulus_gpa: 9.5, poisson_ratio: 0.3, density_g_cm3: 4",
     "    - {length_mm: 70, diameter_mm: 0.89, young_modulus_gpa: 3, poisson_ratio: 0.3, density_g_cm3: 4, attenuation_1_mm: 3}\n"
     "    - {length_mm: 30, diameter_mm: 0.89, young_modulus_gpa: 2, poisson_ratio: 0.3, density_g_cm3: 4, attenuation_1_mm: 3, rest_curvature_1_mm: 0.03}\n",
     "{mass_1_s: 0.5, stiffness_s: 0.0002}"},
};
static const double WIDE_MM = 2.5;      // mean radius of the vessels from which on the thicker wire is taken
static const double SPARE_MM = 60;      // of wire, beyond the farthest place
static const double DEVICE_SPARE_MM = 300;      // the same of a device, whose soft end alone may be 250 mm long
static const double MICRO_SPARE_MM = 60;        // further for a microcatheter, whose soft end is 350 mm long
static const double AHEAD_MM = 60;      // of the wire beyond its catheter, when both are in as far as they go
static const double ELEMENT_MM = 1.5;
enum { ELEMENTS_LEAST = 60, ELEMENTS_MOST = 400 };

static double *paths_from_root(const VesselTree *tree)
{
    double *path = calloc((size_t)tree->node_count, sizeof *path);
    for (int i = 1; path && i < tree->node_count; i++)
        path[i] = path[tree->parent[i]] + vec3_distance(tree->center[i], tree->center[tree->parent[i]]);
    return path;
}

static int nearest_node(const VesselTree *tree, Vec3 x)
{
    int best = 0;
    for (int i = 1; i < tree->node_count; i++)
        if (vec3_distance(x, tree->center[i]) - tree->radius[i] < vec3_distance(x, tree->center[best]) - tree->radius[best])
            best = i;
    return best;
}

// Mean radius, weighted by length: short twigs have many nodes.
static double mean_radius(const VesselTree *tree)
{
    double sum = 0, length = 0;
    for (int i = 1; i < tree->node_count; i++) {
        double step = tree->kind[i] == NODE_VESSEL ? vec3_distance(tree->center[i], tree->center[tree->parent[i]]) : 0;
        sum += step * tree->radius[i];
        length += step;
    }
    return length > 0 ? sum / length : tree->radius[0];
}

static double elements_of(double length) { return fmin(fmax(ceil(length / ELEMENT_MM), ELEMENTS_LEAST), ELEMENTS_MOST); }

// A device keeps its own sections, damping and shape; only its shaft is cut to length.
static void write_device(FILE *out, const char *name, const char *device, double length)
{
    fprintf(out, "  - {name: %s, device: %s, length_mm: %.0f, elements: %.0f}\n", name, device, length, elements_of(length));
}

// A key or an item of `tools`.
static void write_wire(FILE *out, const char *begin, const char *indent, const CaseWire *wire, double length)
{
    fprintf(out, "%s   # %s\n%selements: %.0f\n%ssections:\n    - {length_mm: %.0f, %s}\n%s%stip_marker: {length_mm: 3, attenuation_1_mm: 6}\n%sdamping: %s\n",
            begin, wire->name, indent, elements_of(length), indent, length - wire->tip, wire->shaft, wire->tip_sections, indent, indent, wire->damping);
}

// The catheter outside, and its wire, which is longer by what is beyond its tip.
static void write_tools(FILE *out, const VesselTree *tree, const CaseScene *options, double farthest)
{
    const bool is_thin = options->catheter ? options->is_micro : mean_radius(tree) < WIDE_MM;
    const CaseWire *wire = &wires[!is_thin];
    const double device = 10 * ceil((farthest + DEVICE_SPARE_MM) / 10), catheter = options->is_micro ? device + MICRO_SPARE_MM : device;
    const double plain = fmax(10 * ceil((farthest + SPARE_MM) / 10), wire->tip + 20);
    const double length = options->catheter ? catheter + AHEAD_MM : options->device ? device : plain;
    if (options->catheter || options->device)
        fputs("tools:\n", out);
    if (options->catheter)
        write_device(out, "catheter", options->catheter, catheter);
    if (options->device)
        write_device(out, "wire", options->device, length);
    else if (options->catheter)
        write_wire(out, "  - kind: wire\n    name: wire", "    ", wire, length);
    else
        write_wire(out, "wire:", "  ", wire, length);
}

// The axis of the model whose positive direction is `letter`, or whose negative one is `opposite`.
static bool direction_in(const char *frame, char letter, char opposite, int axis[3])
{
    for (int k = 0; strlen(frame) == 3 && k < 3; k++)
        if (frame[k] == letter || frame[k] == opposite) {
            axis[k] = frame[k] == letter ? 1 : -1;
            return true;
        }
    return false;
}

// The centre of the vessels by length, less their centre by volume: it points to where they are thin. [mm]
static Vec3 way_to_thin_vessels(const VesselTree *tree)
{
    Vec3 by_length = {0}, by_volume = {0};
    double length = 0, volume = 0;
    for (int i = 1; i < tree->node_count; i++) {
        Vec3 a = tree->center[i], b = tree->center[tree->parent[i]];
        double part = tree->kind[i] == NODE_VESSEL ? vec3_distance(a, b) : 0, size = part * tree->radius[i] * tree->radius[i];
        by_length = vec3_add_scaled(by_length, part, vec3_mix(a, b, 0.5)), length += part;
        by_volume = vec3_add_scaled(by_volume, size, vec3_mix(a, b, 0.5)), volume += size;
    }
    return length > 0 && volume > 0 ? vec3_sub(vec3_scale(by_length, 1 / length), vec3_scale(by_volume, 1 / volume)) : vec3(0, 0, 0);
}

// How the patient lies if the file does not say it: arteries of the trunk and the head become thinner upwards, and reach further to the sides than forwards. That does not
// depend on the end where the tools enter. Where all are about equally wide, they lead upwards from there.
static void guess_patient(const VesselTree *tree, int front[3], int up[3])
{
    const double even = 0.03;        // of the vessels' extent: less says nothing
    double low[3] = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, high[3] = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL}, extent = 0;
    Vec3 thin = way_to_thin_vessels(tree), sum = {0};
    int along = 0;
    for (int i = 0; i < tree->node_count; i++) {
        const double at[3] = {tree->center[i].x, tree->center[i].y, tree->center[i].z};
        sum = vec3_add(sum, vec3_sub(tree->center[i], tree->center[0]));
        for (int k = 0; k < 3; k++)
            low[k] = fmin(low[k], at[k]), high[k] = fmax(high[k], at[k]);
    }
    for (int k = 0; k < 3; k++)
        extent = fmax(extent, high[k] - low[k]);
    Vec3 upwards = vec3_norm(thin) > even * extent ? thin : sum;
    const double way[3] = {upwards.x, upwards.y, upwards.z};
    for (int k = 1; k < 3; k++)
        along = fabs(way[k]) > fabs(way[along]) ? k : along;
    int a = (along + 1) % 3, b = (along + 2) % 3;
    up[along] = way[along] < 0 ? -1 : 1;
    front[high[a] - low[a] < high[b] - low[b] ? a : b] = 1;
}

static void write_patient(FILE *out, const VesselTree *tree, const CaseScene *options)
{
    int front[3] = {0}, up[3] = {0};
    bool is_known = direction_in(options->frame, 'A', 'P', front) && direction_in(options->frame, 'S', 'I', up);
    if (!is_known) {
        memset(front, 0, sizeof front), memset(up, 0, sizeof up);
        guess_patient(tree, front, up);
    }
    fprintf(out, "fluoroscopy:%s\n  anterior: [%d, %d, %d]\n  superior: [%d, %d, %d]\n",
            is_known ? "" : "   # guessed: the file does not say how the patient lies", front[0], front[1], front[2], up[0], up[1], up[2]);
}

static void write_exercise(FILE *out, const VesselTree *tree, const CaseScene *options, int node, double path)
{
    double radius = fmin(fmax(tree->radius[node], 1), 3), seconds = 5 * ceil((20 + path / 3) / 5);
    Vec3 x = options->target;
    fprintf(out, "targets:\n  - {name: target, point_mm: [%.9g, %.9g, %.9g], radius_mm: %.2g}\n", x.x, x.y, x.z, radius);
    fprintf(
        out,
        "exercise:\n  title: Reach the target\n  instructions: Bring the tip of the wire to the target, %.0f mm along the vessels, and keep it there for 2 s.\n"
        "  target: target\n  rules: {wrong_branch_mm: %.2g, tip_force_n: 0.5, blind_mm: 10}\n"
        "  par: {time_s: %.0f, fluoroscopy_s: %.0f, path_ratio: 1.5, wall_force_n: 0.5, blind_mm: 5, guidance_s: 2}\n",
        path, fmax(5, 2 * tree->radius[node]), seconds, seconds);
}

// The node of the target, 0 without one; -1 with a fault if it lies in no vessel.
static int target_node(const VesselTree *tree, const CaseScene *options, Faults *faults)
{
    int node = options->has_target ? nearest_node(tree, options->target) : 0;
    Vec3 at = tree->center[node];
    double gap = vec3_distance(options->target, at) - tree->radius[node];
    if (!options->has_target || gap <= tree->radius[node])
        return node;
    faults_add(faults, "--target", 0, 0, "lies %.1f mm outside the nearest vessel, which passes (%.2f, %.2f, %.2f); expected a point in a vessel or a sac", gap,
               at.x, at.y, at.z);
    return -1;
}

static bool write_scene(OutputText *text, const VesselTree *tree, const CaseScene *options, int node)
{
    double *path = paths_from_root(tree), farthest = 0;
    if (!path)
        return output_text_forget(text);
    for (int i = 0; i < tree->node_count; i++)
        farthest = fmax(farthest, path[i]);
    fprintf(text->stream,
            "# A case: `seldinger nav` opens its folder. Change what you like (docs/scene-format.md).\n"
            "seldinger: 1\nvessel:\n  model: %s\n  contact: %s\n  friction: 0.04\n",
            options->model, contact_name[options->contact]);
    write_tools(text->stream, tree, options, farthest);
    fprintf(text->stream, "sheath: {inlet: root, inserted_mm: 2}\n");
    write_patient(text->stream, tree, options);
    if (options->anatomy)
        fprintf(text->stream, "anatomy: %s\n", options->anatomy);
    if (options->has_target)
        write_exercise(text->stream, tree, options, node, path[node]);
    free(path);
    if (!ferror(text->stream) && fclose(text->stream) == 0)
        return true;
    free(text->bytes);
    return false;
}

char *case_scene_text(const VesselTree *tree, const CaseScene *options, Faults *faults)
{
    OutputText text;
    int node = target_node(tree, options, faults);
    if (node < 0)
        return NULL;
    char *written = output_text_open(&text) && write_scene(&text, tree, options, node) ? text.bytes : NULL, *whole = written;
    if (written && options->behind) {        // the path may need quotes
        whole = yaml_edit(written, "fluoroscopy.volume", options->behind, true);
        free(written);
    }
    if (!whole)
        faults_add(faults, options->model, 0, 0, "the scene of the case cannot be written: out of memory, or the name of its volume has a line break");
    return whole;
}
