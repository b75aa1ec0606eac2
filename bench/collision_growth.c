// All queries are of points that move slowly along the wall, 0.05 to 0.15 mm from it (collision_course.h).
#include "bench/collision_growth.h"

#include "bench/bench.h"
#include "bench/collision_course.h"
#include "bench/collision_surface.h"
#include "bench/shape_vessel.h"
#include "geom/grid_vessel.h"
#include "geom/mesh_vessel.h"
#include "recon/fit/lim_fit.h"
#include "recon/phantom/phantom.h"
#include "recon/tree_file.h"
#include "sim/contact_surface.h"
#include "sim/tube_tree.h"

#include <stdlib.h>
#include <unistd.h>

enum { WIRE_POINTS = 80, WIRE_STEPS = 60, SPREAD_POINTS = 400, SPREAD_STEPS = 20, SEARCHES = 3 };
static const char *const search_name[SEARCHES] = {"full", "warm", "cached"};
static const MeshSearch search_kind[SEARCHES] = {MESH_SEARCH_FULL, MESH_SEARCH_WARM, MESH_SEARCH_CACHED};

typedef struct Growth {
    FILE *out;
    bool quick;
    int threads, runs;       // runs: the smallest time of these counts
    cJSON *growth, *sizes, *match, *memory;
    Faults *faults;
} Growth;

static bool fault(Growth *g, const char *what)
{
    faults_add(g->faults, "bench collision", 0, 0, "%s", what);
    return false;
}

static void destroy(Vessel *vessel)
{
    if (vessel)
        vessel->destroy(vessel);
}

static VesselTree *fit(Growth *g, const VesselTree *samples, double target_mm, double voxel_mm)
{
    LimFitOptions options = lim_fit_default_options();
    options.target_mm = target_mm;
    options.voxel_mm = voxel_mm;
    options.threads = g->threads;
    return lim_fit(samples, &options, NULL, g->faults);
}

// --- a wall and its queries ---

typedef struct Wall {
    const char *name;
    const Vessel *exact;
    const VesselTree *nodes;
    double area;             // [mm2] cell^2 times triangles of its meshes
    const Vessel *near_exact;        // source for meshing if `exact` is too slow; NULL: `exact` …
    const Shape *shape;      // … the vertices are then moved to the surface of this shape
    Course wire, spread;
} Wall;

typedef struct Figures {
    double wire_ns, spread_ns;
    CourseError error;
} Figures;

// A mesh with about this number of triangles: the first mesh of a wall gives the cell size.
static TriangleMesh *mesh_wall(Wall *wall, double triangles, Faults *faults)
{
    double cell = wall->area > 0 ? sqrt(wall->area / triangles) : contact_surface_cell(wall->nodes, triangles);
    TriangleMesh *mesh = contact_surface_mesh(wall->near_exact ? wall->near_exact : wall->exact, wall->nodes, false, cell, wall->name, cli_note, faults);
    if (mesh)
        wall->area = cell * cell * mesh->triangle_count;
    for (int i = 0; mesh && wall->shape && i < mesh->vertex_count; i++)
        if (!shape_beyond_open_end(wall->shape, mesh->vertex[i]))
            shape_distance(wall->shape, mesh->vertex[i], &mesh->vertex[i]);
    return mesh;
}

// The wire starts beside the tree's axis, two radii from its root; the other points start at the mesh's vertices.
static bool open_wall(Growth *g, Wall *wall, const TriangleMesh *mesh)
{
    const VesselTree *tree = wall->nodes;
    int start = 0;
    while (start + 1 < tree->node_count && vec3_distance(tree->center[start], tree->center[0]) < 2 * tree->radius[0])
        start++;
    Vec3 x = vec3_add_scaled(tree->center[start], 0.8 * tree->radius[start], vec3_normal_to(tree->direction[start]));
    bool good = mesh && course_wire(wall->exact, tree, x, -1, WIRE_POINTS, WIRE_STEPS, &wall->wire) &&
                course_all_over(wall->exact, tree, mesh, SPREAD_POINTS, g->quick ? SPREAD_STEPS / 4 : SPREAD_STEPS, &wall->spread);
    return good || fault(g, "no course along a wall: not enough memory");
}

static void close_wall(Wall *wall)
{
    course_free(&wall->wire);
    course_free(&wall->spread);
}

static bool measure(Growth *g, const Wall *wall, const Vessel *vessel, Figures *figures)
{
    figures->wire_ns = course_ns(vessel, 1, &wall->wire, 2 * g->runs);
    figures->spread_ns = course_ns(vessel, 1, &wall->spread, g->runs);
    return (course_error(vessel, &wall->spread, &figures->error) && figures->wire_ns > 0 && figures->spread_ns > 0) || fault(g, "a wall that gives no answers");
}

static void add_pair(cJSON *row, const char *key, const char *first, double a, const char *second, double b)
{
    cJSON *pair = cJSON_AddObjectToObject(row, key);
    cJSON_AddNumberToObject(pair, first, a);
    cJSON_AddNumberToObject(pair, second, b);
}

static cJSON *add_row(cJSON *list)
{
    cJSON *row = cJSON_CreateObject();
    cJSON_AddItemToArray(list, row);
    return row;
}

static void add_figures(cJSON *row, const Figures *f)
{
    add_pair(row, "ns_per_query", "wire", f->wire_ns, "spread", f->spread_ns);
    add_pair(row, "gap_error_um", "rms", f->error.gap_rms_um, "max", f->error.gap_max_um);
    add_pair(row, "normal_error_deg", "rms", f->error.normal_rms_deg, "max", f->error.normal_max_deg);
    cJSON_AddNumberToObject(row, "flagged", f->error.flagged);
}

// --- growth of the mesh ---

static void add_growth(Growth *g, const Wall *wall, const char *search, int triangles, const Figures *f, const Vessel *vessel, double surface_s, double build_s)
{
    cJSON *row = add_row(g->growth);
    cJSON_AddStringToObject(row, "surface", wall->name);
    cJSON_AddStringToObject(row, "search", search);
    cJSON_AddNumberToObject(row, "triangles", triangles);
    add_figures(row, f);
    cJSON_AddNumberToObject(row, "bytes", (double)vessel->bytes);
    cJSON_AddNumberToObject(row, "surface_s", surface_s);
    cJSON_AddNumberToObject(row, "build_s", build_s);
}

// Without the last search: "-".
static void print_times(FILE *out, double full, double warm, double cached)
{
    fprintf(out, "|%7.0f %6.0f ", full, warm);
    fprintf(out, cached > 0 ? "%6.0f " : "     - ", cached);
}

static void print_growth(FILE *out, const char *what, const Figures f[SEARCHES], double bytes, double surface_s, double build_s)
{
    fprintf(out, "  %10s ", what);
    print_times(out, f[0].wire_ns, f[1].wire_ns, f[2].wire_ns);
    print_times(out, f[0].spread_ns, f[1].spread_ns, f[2].spread_ns);
    fprintf(out, "| %8.3f %8.3f | %7.4f %7.3f | %8.2f |%6.2f %6.2f\n", f[0].error.gap_rms_um, f[0].error.gap_max_um, f[0].error.normal_rms_deg,
            f[0].error.normal_max_deg, bytes / 1e6, surface_s, build_s);
    fflush(out);
}

static Vessel *mesh_vessel_of(const Wall *wall, const TriangleMesh *mesh, MeshSearch search, Faults *faults)
{
    MeshVesselOptions options = mesh_vessel_default_options();
    options.search = search;
    return mesh_vessel_create(mesh, &options, wall->name, faults);
}

static bool measure_mesh(Growth *g, const Wall *wall, const TriangleMesh *mesh, double surface_s)
{
    enum { LARGEST_CACHED = 2000000 };   // for larger meshes it takes about half a minute to prepare that search
    Figures f[SEARCHES] = {0};
    double bytes = 0, build_s = 0;
    for (int k = 0; k < SEARCHES && (search_kind[k] != MESH_SEARCH_CACHED || mesh->triangle_count <= LARGEST_CACHED); k++) {
        double begin = collision_build_clock_s();
        Vessel *vessel = mesh_vessel_of(wall, mesh, search_kind[k], g->faults);
        if (!vessel)
            return false;
        build_s = collision_build_clock_s() - begin;
        bytes = (double)vessel->bytes;
        bool good = measure(g, wall, vessel, &f[k]);
        if (good)
            add_growth(g, wall, search_name[k], mesh->triangle_count, &f[k], vessel, surface_s, build_s);
        destroy(vessel);
        if (!good)
            return false;
    }
    char count[16];
    snprintf(count, sizeof count, "%d", mesh->triangle_count);
    print_growth(g->out, count, f, bytes, surface_s, build_s);
    return true;
}

// Sampled on the mesh's edge.
static bool measure_grid(Growth *g, const Wall *wall, const TriangleMesh *mesh)
{
    double cell = contact_surface_edge(mesh), begin = collision_build_clock_s();
    GridVesselOptions options = {.cell_mm = cell, .band_mm = fmax(0.25, 2.5 * cell)};
    Vessel *grid = grid_vessel_create(wall->exact, mesh, &options, wall->name, g->faults);
    double build_s = collision_build_clock_s() - begin;
    Figures f[SEARCHES];
    bool good = grid && measure(g, wall, grid, &f[0]);
    if (good) {
        char what[32];
        f[1] = f[2] = f[0];
        snprintf(what, sizeof what, "grid %.2f", cell);
        add_growth(g, wall, "grid", 0, &f[0], grid, 0, build_s);
        print_growth(g->out, what, f, (double)grid->bytes, 0, build_s);
    }
    destroy(grid);
    return good;
}

static bool grow_mesh(Growth *g, Wall *wall, int largest, int largest_grid)
{
    enum { LARGEST_MARCHED = 16000 };    // larger meshes are made by splitting each triangle into four
    TriangleMesh *mesh = NULL;
    bool good = true;
    for (int size = 1000; good && size <= largest; size *= 4) {
        double begin = collision_build_clock_s();
        TriangleMesh *next = size <= LARGEST_MARCHED ? mesh_wall(wall, size, g->faults) : triangle_mesh_refine(mesh, wall->exact);
        triangle_mesh_free(mesh);
        mesh = next;
        if (!mesh)
            return size <= LARGEST_MARCHED ? false : fault(g, "not enough memory for a mesh");
        double surface_s = collision_build_clock_s() - begin;
        good = (!mesh_vessel_available() || measure_mesh(g, wall, mesh, surface_s)) && (size < 4000 || size > largest_grid || measure_grid(g, wall, mesh));
    }
    triangle_mesh_free(mesh);
    return good;
}

static bool grow_wall(Growth *g, Wall *wall, const VesselTree *model, double fit_s, int largest)
{
    TriangleMesh *mesh = mesh_wall(wall, 4000, g->faults);
    bool opened = mesh && open_wall(g, wall, mesh);
    triangle_mesh_free(mesh);
    if (!opened)
        return false;
    fprintf(g->out, "\n%s: nanoseconds a query, for 80 points along one stretch (wire) and %d all over; errors against the wall that was meshed\n", wall->name,
            SPREAD_POINTS);
    fputs("   triangles |  wire: full warm cached | all over: full warm cached| gap rms, max um | normal rms, max deg | MB | s: surface, build\n", g->out);
    int largest_grid = g->quick ? 4000 : 64000;
    if (!mesh_vessel_available())
        fputs("  built without Embree: no meshes\n", g->out);
    if (!grow_mesh(g, wall, mesh_vessel_available() ? largest : largest_grid, largest_grid))
        return false;
    double begin = collision_build_clock_s();
    Vessel *lim = collision_lim(model, LIM_BLEND);
    double build_s = collision_build_clock_s() - begin;
    Figures f[SEARCHES];
    bool good = lim ? measure(g, wall, lim, &f[0]) : fault(g, "not enough memory for local models");
    if (good) {
        char count[32];
        f[1] = f[2] = f[0];
        snprintf(count, sizeof count, "LIM %lld", (long long)model->blob_count);
        add_growth(g, wall, "lim", 0, &f[0], lim, fit_s, build_s);
        print_growth(g->out, count, f, (double)lim->bytes, fit_s, build_s);
    }
    destroy(lim);
    return good;
}

typedef struct Phantom {
    Shape *shape;
    VesselTree *samples, *model;
    Vessel *lim;
    double fit_s;
} Phantom;

static bool open_phantom(Growth *g, Phantom *p)
{
    p->shape = shape_create("phantom", 0, NULL, "bench collision", g->faults);
    p->samples = p->shape ? shape_sample(p->shape, g->faults) : NULL;
    double begin = collision_build_clock_s();
    p->model = p->samples ? fit(g, p->samples, 0, shape_voxel_mm(p->shape)) : NULL;
    p->fit_s = collision_build_clock_s() - begin;
    p->lim = p->model ? collision_lim(p->model, LIM_BLEND) : NULL;
    return p->lim || fault(g, "the phantom has no local models");
}

static void close_phantom(Phantom *p)
{
    destroy(p->lim);
    vessel_tree_free(p->model);
    vessel_tree_free(p->samples);
    shape_free(p->shape);
}

// For the fitted phantom the model itself is the truth here; the local models of the exact tube have an error.
static bool grow_phantom(Growth *g, const Phantom *p)
{
    Wall wall = {.name = "phantom, as fitted", .exact = p->lim, .nodes = p->model};
    bool good = grow_wall(g, &wall, p->model, p->fit_s, g->quick ? 64000 : 4096000);
    close_wall(&wall);
    return good;
}

static bool grow_tube(Growth *g)
{
    static const char name[] = "exact tube";
    static const TubePiece piece[] = {
        {.length = 10}, {.arc_radius = 6, .angle = 2 * PI / 3}, {.arc_radius = 8, .angle = 5 * PI / 6, .plane = PI / 2}, {.length = 10}};
    const TubeOptions options = {.direction = {1, 0, 0}, .normal = {0, 1, 0}, .radius = 1.5, .piece_count = 4, .piece = piece, .closed_ends = true};
    Vessel *tube = tube_vessel_create(&options, name, g->faults);
    VesselTree *samples = tube ? tube_tree(tube, &options, name, g->faults) : NULL;
    double begin = collision_build_clock_s();
    VesselTree *model = samples ? fit(g, samples, 0, shape_options_voxel_mm(0, NULL)) : NULL;
    double fit_s = collision_build_clock_s() - begin;
    Wall wall = {.name = name, .exact = tube, .nodes = samples};
    bool good = model && grow_wall(g, &wall, model, fit_s, g->quick ? 16000 : 64000);
    close_wall(&wall);
    vessel_tree_free(model);
    vessel_tree_free(samples);
    destroy(tube);
    return good;
}

// --- growth of the model ---

// A strand of a long helix: the middle of a fitted helix is repeated by a screw motion along itself, so that there is no seam. Strands of 1000 nodes each stand
// side by side; their first nodes are children of the first strand's first node.
enum { STRAND = 1000, FIRST = 30, PERIOD = 90, SPAN = 20 };
static const double STRAND_APART = 12;   // [mm] between axes; a helix is 10 mm wide

typedef struct Motion {      // x -> turn x + shift
    Mat3 turn;
    Vec3 shift;
} Motion;

static Vec3 move(const Motion *m, Vec3 x) { return vec3_add(mat3_mul_vec(&m->turn, x), m->shift); }

// Chord and bend at a node make a frame that turns with the helix.
static Mat3 frame_at(const VesselTree *helix, int node)
{
    Vec3 before = helix->center[node - SPAN], after = helix->center[node + SPAN], chord = vec3_unit(vec3_sub(after, before));
    Vec3 bend = vec3_sub(vec3_mix(before, after, 0.5), helix->center[node]);
    bend = vec3_unit(vec3_add_scaled(bend, -vec3_dot(bend, chord), chord));
    return mat3_from_columns(chord, bend, vec3_cross(chord, bend));
}

static Motion screw(const VesselTree *helix)
{
    Mat3 from = frame_at(helix, FIRST), to = frame_at(helix, FIRST + PERIOD), back = mat3_transpose(&from);
    Motion m = {.turn = mat3_mul(&to, &back)};
    m.shift = vec3_sub(helix->center[FIRST + PERIOD], mat3_mul_vec(&m.turn, helix->center[FIRST]));
    return m;
}

static void copy_node(VesselTree *tree, int node, const VesselTree *helix, int from, const Motion *by)
{
    int64_t first = helix->blob_offset[from], count = helix->blob_offset[from + 1] - first, at = tree->blob_offset[node];
    tree->center[node] = move(by, helix->center[from]);
    tree->direction[node] = mat3_mul_vec(&by->turn, helix->direction[from]);
    tree->radius[node] = helix->radius[from];
    tree->height[node] = helix->height[from];
    tree->error[node] = helix->error[from];
    tree->parent[node] = node == 0 ? -1 : node % STRAND == 0 ? 0 : node - 1;
    for (int64_t k = 0; k < count; k++) {
        tree->blob_center[at + k] = move(by, helix->blob_center[first + k]);
        tree->blob_width[at + k] = helix->blob_width[first + k];
    }
    tree->blob_offset[node + 1] = at + count;
}

static VesselTree *strands(const VesselTree *helix, int nodes)
{
    int64_t blobs = 0;
    for (int i = 0; i < nodes; i++) {
        int from = FIRST + i % STRAND % PERIOD;
        blobs += helix->blob_offset[from + 1] - helix->blob_offset[from];
    }
    VesselTree *tree = vessel_tree_create(nodes, 0, blobs);
    int strand_count = (nodes + STRAND - 1) / STRAND, side = (int)ceil(sqrt(strand_count));
    Motion step = screw(helix), by = {.turn = mat3_identity()};
    for (int i = 0; tree && i < nodes; i++) {
        int strand = i / STRAND, along = i % STRAND;
        if (along == 0)
            by = (Motion){mat3_identity(), vec3(STRAND_APART * (strand % side), STRAND_APART * (strand / side), 0)};
        else if (along % PERIOD == 0) {
            Vec3 shift = mat3_mul_vec(&by.turn, step.shift);   // by o step
            by = (Motion){mat3_mul(&by.turn, &step.turn), vec3_add(by.shift, shift)};
        }
        copy_node(tree, i, helix, FIRST + along % PERIOD, &by);
    }
    if (tree && vessel_tree_link(tree)) {
        tree->iso_level = helix->iso_level;
        return tree;
    }
    vessel_tree_free(tree);
    return NULL;
}

enum { FIELDS = LIM_BLEND + 1, TOOLS = 250, TOOL_STEPS = 4, LOCATIONS = 20 };
enum { STRETCH = 92, INLET = 4 };        // nodes that the 42 mm of a tool may cover; the first nodes, whose walls are too near to that beyond the root's end
typedef struct SizeFigures {
    double warm_ns, cold_ns, strand_ns, first_us, next_us, build_s;
    size_t bytes;
} SizeFigures;

// CPU time to locate a point in the whole tree, and then its neighbour from there; the smallest of several points all over the tree.
static void time_locations(const Vessel *vessel, int tools, const Course *tool, SizeFigures *f)
{
    f->first_us = f->next_us = HUGE_VAL;
    for (int k = 0; k < LOCATIONS; k++) {
        const Course *c = &tool[k * tools / LOCATIONS];
        int64_t begin = bench_cpu_ns();
        int node = vessel->locate(vessel, c->place[0], -1);
        int64_t then = bench_cpu_ns();
        vessel->locate(vessel, c->place[1], node);
        f->first_us = fmin(f->first_us, (double)(then - begin) / 1000);
        f->next_us = fmin(f->next_us, (double)(bench_cpu_ns() - then) / 1000);
    }
}

// A tool starts on the wall of a node from which the strand is still long enough for it.
static bool place_tool(const Vessel *vessel, const VesselTree *tree, int node, int steps, Course *tool)
{
    Vec3 x = vec3_add_scaled(tree->center[node], 0.8 * tree->radius[node], vec3_normal_to(tree->direction[node]));
    return course_wire(vessel, tree, x, node, WIRE_POINTS, steps, tool);
}

// In the middle of the tree's middle strand.
static bool place_wire(const Vessel *vessel, const VesselTree *tree, Course *wire)
{
    int strand = tree->node_count < STRAND ? tree->node_count : STRAND;
    return place_tool(vessel, tree, tree->node_count / STRAND / 2 * STRAND + (strand - STRETCH) / 2, WIRE_STEPS, wire);
}

// A scattered sequence over `nodes` nodes from `first` on, by steps of the golden ratio.
static bool place_tools(const Vessel *vessel, const VesselTree *tree, int first, int nodes, int tools, Course *tool)
{
    int strand = nodes < STRAND ? nodes : STRAND;
    bool good = true;
    for (int k = 0; good && k < tools; k++) {
        int node = (int)(fmod(k * 0.6180339887498949, 1) * (nodes - STRETCH)), along = node % STRAND;
        node += along > strand - STRETCH ? strand - STRETCH - along : along < INLET ? INLET - along : 0;
        good = place_tool(vessel, tree, first + node, TOOL_STEPS, &tool[k]);
    }
    return good;
}

typedef struct Size {
    VesselTree *tree;
    Vessel *vessel[FIELDS];
    Course wire;             // both fields are queried at the same places
    int tools;
    Course *tool, *close;    // (tools) all over the tree, and within its middle strand
    SizeFigures figures[FIELDS];
} Size;

static bool open_size(Growth *g, const VesselTree *helix, int nodes, Size *s)
{
    s->tools = g->quick ? TOOLS / 5 : TOOLS;
    s->tool = calloc((size_t)s->tools, sizeof *s->tool);
    s->close = calloc((size_t)s->tools, sizeof *s->close);
    s->tree = strands(helix, nodes);
    for (int field = 0; s->tree && field < FIELDS; field++) {
        double begin = collision_build_clock_s();
        s->vessel[field] = collision_lim(s->tree, (LimField)field);
        s->figures[field] = (SizeFigures){.build_s = collision_build_clock_s() - begin, .warm_ns = HUGE_VAL};
    }
    const Vessel *blend = s->vessel[LIM_BLEND];
    int strand = nodes < STRAND ? nodes : STRAND;
    return (s->tool && s->close && s->vessel[LIM_SWITCH] && blend && place_wire(blend, s->tree, &s->wire) &&
            place_tools(blend, s->tree, 0, nodes, s->tools, s->tool) && place_tools(blend, s->tree, nodes / STRAND / 2 * STRAND, strand, s->tools, s->close)) ||
           fault(g, "not enough memory for a large tree");
}

static void close_size(Size *s)
{
    for (int field = 0; field < FIELDS; field++)
        destroy(s->vessel[field]);
    course_free(&s->wire);
    for (int k = 0; s->tool && s->close && k < s->tools; k++) {
        course_free(&s->tool[k]);
        course_free(&s->close[k]);
    }
    free(s->tool);
    free(s->close);
    vessel_tree_free(s->tree);
}

// The wire is measured on all sizes in turn, repeatedly, so that load on the machine affects all of them.
static bool measure_sizes(Growth *g, int count, Size *size)
{
    bool good = true;
    for (int round = 0; good && round < 5 * g->runs; round++)
        for (int k = 0; k < count * FIELDS; k++) {
            Size *s = &size[k / FIELDS];
            double ns = course_ns(s->vessel[k % FIELDS], 1, &s->wire, 2);
            s->figures[k % FIELDS].warm_ns = fmin(s->figures[k % FIELDS].warm_ns, ns);
            good = good && ns > 0;
        }
    for (int k = 0; k < count * FIELDS; k++) {
        Size *s = &size[k / FIELDS];
        SizeFigures *f = &s->figures[k % FIELDS];
        f->bytes = s->vessel[k % FIELDS]->bytes;
        f->cold_ns = course_ns(s->vessel[k % FIELDS], s->tools, s->tool, g->runs);
        f->strand_ns = course_ns(s->vessel[k % FIELDS], s->tools, s->close, g->runs);
        time_locations(s->vessel[k % FIELDS], s->tools, s->tool, f);
        good = good && f->cold_ns > 0 && f->strand_ns > 0;
    }
    return good || fault(g, "not enough memory for a large tree");
}

static void add_size(Growth *g, const char *field, const VesselTree *tree, const SizeFigures *f)
{
    cJSON *row = add_row(g->sizes);
    cJSON_AddStringToObject(row, "field", field);
    cJSON_AddNumberToObject(row, "nodes", tree->node_count);
    cJSON_AddNumberToObject(row, "blobs", (double)tree->blob_count);
    cJSON_AddNumberToObject(row, "ns_warm", f->warm_ns);
    cJSON_AddNumberToObject(row, "ns_cold", f->cold_ns);
    cJSON_AddNumberToObject(row, "ns_one_strand", f->strand_ns);
    cJSON_AddNumberToObject(row, "first_us", f->first_us);
    cJSON_AddNumberToObject(row, "next_us", f->next_us);
    cJSON_AddNumberToObject(row, "bytes", (double)f->bytes);
    cJSON_AddNumberToObject(row, "build_s", f->build_s);
    fprintf(g->out, "  %-6s %7d %8lld | %6.1f %9.1f %12.1f | %8.1f %6.2f | %8.2f %6.2f\n", field, tree->node_count, (long long)tree->blob_count, f->warm_ns,
            f->cold_ns, f->strand_ns, f->first_us, f->next_us, (double)f->bytes / 1e6, f->build_s);
    fflush(g->out);
}

static void print_sizes(Growth *g, int count, const Size *size)
{
    static const char *const field_name[FIELDS] = {[LIM_SWITCH] = "switch", [LIM_BLEND] = "blend"};
    fprintf(g->out,
            "\nLocal models of a long helix, 1000 nodes per strand: nanoseconds per query, for one wire of %d points, for %d wires all over the "
            "tree in turn\n(far apart: their data is larger than the caches), and for as many in one strand\n",
            WIRE_POINTS, size[0].tools);
    fputs("  field    nodes    blobs |   wire far apart   one strand | us: first location, next from there | MB, s to build\n", g->out);
    for (int field = 0; field < FIELDS; field++) {
        double least = HUGE_VAL, most = 0;
        for (int k = 0; k < count; k++) {
            add_size(g, field_name[field], size[k].tree, &size[k].figures[field]);
            least = fmin(least, size[k].figures[field].warm_ns);
            most = fmax(most, size[k].figures[field].warm_ns);
        }
        fprintf(g->out, "  %-6s the slowest of these sizes takes %.2f times as long for the wire as the fastest\n", field_name[field], most / least);
    }
}

static bool grow_model(Growth *g)
{
    enum { SIZES = 4 };
    static const char option[3][2][64] = {{"turns", "3.5"}, {"rise_mm", "21"}, {"points", "60"}};
    static const int nodes[SIZES] = {100, 1000, 10000, 100000};
    VesselTree *samples = shape_tree("helix", 3, option, "bench collision", g->faults);
    VesselTree *helix = samples ? fit(g, samples, 0, shape_options_voxel_mm(0, NULL)) : NULL;
    Size size[SIZES] = {0};
    int count = g->quick ? SIZES - 1 : SIZES;
    bool good = helix && (helix->node_count > FIRST + PERIOD + SPAN || fault(g, "the helix is too short to be continued"));
    for (int k = 0; good && k < count; k++)
        good = open_size(g, helix, nodes[k], &size[k]);
    good = good && measure_sizes(g, count, size);
    if (good)
        print_sizes(g, count, size);
    for (int k = 0; k < count; k++)
        close_size(&size[k]);
    vessel_tree_free(samples);
    vessel_tree_free(helix);
    return good;
}

// --- blobs to match ---

typedef struct MeshPoint {   // a mesh of the true wall
    int triangles;
    double bytes;
    Figures figures;
} MeshPoint;

static bool measure_true_mesh(Growth *g, const Wall *wall, const TriangleMesh *mesh, MeshPoint *out)
{
    Vessel *vessel = mesh_vessel_of(wall, mesh, MESH_SEARCH_CACHED, g->faults);
    bool good = vessel && measure(g, wall, vessel, &out->figures);
    if (good) {
        out->triangles = mesh->triangle_count;
        out->bytes = (double)vessel->bytes;
    }
    destroy(vessel);
    return good;
}

// A mesh whose gap error is `error_um` within a tenth, found from a mesh of another size: the error is proportional to one over the number of triangles, for
// coarse meshes only roughly.
static bool match_mesh(Growth *g, Wall *wall, double error_um, MeshPoint *point)
{
    enum { ROUNDS = 3, MOST = 400000 };
    bool good = true;
    for (int round = 0; good && round < ROUNDS; round++) {
        double ratio = point->figures.error.gap_rms_um / error_um, wanted = point->triangles * ratio;
        if (fabs(ratio - 1) < 0.1 || wanted > MOST)
            return true;
        TriangleMesh *mesh = mesh_wall(wall, wanted, g->faults);
        good = mesh && measure_true_mesh(g, wall, mesh, point);
        triangle_mesh_free(mesh);
    }
    return good;
}

static void add_match(Growth *g, double target, const VesselTree *model, const Vessel *lim, double fit_s, const Figures *f, const MeshPoint *mesh)
{
    cJSON *row = add_row(g->match);
    cJSON_AddNumberToObject(row, "gap_error_um", f->error.gap_rms_um);
    cJSON_AddNumberToObject(row, "normal_error_deg", f->error.normal_rms_deg);
    cJSON_AddNumberToObject(row, "target_mm", target);
    cJSON_AddNumberToObject(row, "blobs", (double)model->blob_count);
    cJSON_AddNumberToObject(row, "bytes", (double)lim->bytes);
    add_pair(row, "ns_per_query", "wire", f->wire_ns, "spread", f->spread_ns);
    cJSON_AddNumberToObject(row, "fit_s", fit_s);
    fprintf(g->out, "  %8.3f %7.3f | %5.3f %6lld %8.3f %6.0f %6.0f %6.2f |", f->error.gap_rms_um, f->error.normal_rms_deg, target, (long long)model->blob_count,
            (double)lim->bytes / 1e6, f->wire_ns, f->spread_ns, fit_s);
    if (mesh->triangles > 0) {
        cJSON *at = cJSON_AddObjectToObject(row, "mesh");
        cJSON_AddNumberToObject(at, "triangles", mesh->triangles);
        cJSON_AddNumberToObject(at, "bytes", mesh->bytes);
        add_figures(at, &mesh->figures);
        fprintf(g->out, " %8.3f %7.3f %8d %8.2f %6.0f %6.0f\n", mesh->figures.error.gap_rms_um, mesh->figures.error.normal_rms_deg, mesh->triangles,
                mesh->bytes / 1e6, mesh->figures.wire_ns, mesh->figures.spread_ns);
    } else
        fputs(" no meshes\n", g->out);
    fflush(g->out);
}

static bool match_target(Growth *g, Wall *wall, double target, double voxel, MeshPoint *mesh)
{
    double begin = collision_build_clock_s();
    VesselTree *model = fit(g, wall->nodes, target, voxel);
    double fit_s = collision_build_clock_s() - begin;
    Vessel *lim = model ? collision_lim(model, LIM_BLEND) : NULL;
    Figures f;
    bool good = lim && measure(g, wall, lim, &f) && (mesh->triangles == 0 || match_mesh(g, wall, f.error.gap_rms_um, mesh));
    if (good)
        add_match(g, target, model, lim, fit_s, &f, mesh);
    destroy(lim);
    vessel_tree_free(model);
    return good;
}

static bool match_blobs(Growth *g, const Phantom *p)
{
    enum { FIRST_MESH = 16000 };
    static const double target[] = {0.4, 0.2, 0.1, 0.05, 0.025};
    Vessel *exact = shape_vessel_create(p->shape);
    Wall wall = {.name = "phantom", .exact = exact, .nodes = p->samples, .near_exact = p->lim, .shape = p->shape};
    TriangleMesh *first = exact ? mesh_wall(&wall, FIRST_MESH, g->faults) : NULL;
    MeshPoint mesh = {0};
    bool good = first && open_wall(g, &wall, first) && (!mesh_vessel_available() || measure_true_mesh(g, &wall, first, &mesh));
    triangle_mesh_free(first);
    if (good) {
        fputs("\nThe phantom's true wall: blobs, and triangles of the mesh (cached) with the same rms error of the gap\n", g->out);
        fputs("  LIM: gap um, normal deg | target mm, blobs, MB, ns wire, all over, s to fit | mesh: gap um, normal deg, triangles, MB, ns wire, all over\n",
              g->out);
    }
    for (size_t k = 0; good && k < sizeof target / sizeof target[0]; k++)
        good = match_target(g, &wall, target[k], shape_voxel_mm(p->shape), &mesh);
    close_wall(&wall);
    destroy(exact);
    return good;
}

// --- memory of the largest tree ---

// Single precision, over the box about the surface.
static double dense_grid_bytes(const TriangleMesh *mesh, double cell)
{
    Vec3 low = mesh->vertex[0], high = low;
    for (int i = 1; i < mesh->vertex_count; i++) {
        Vec3 v = mesh->vertex[i];
        low = vec3(fmin(low.x, v.x), fmin(low.y, v.y), fmin(low.z, v.z));
        high = vec3(fmax(high.x, v.x), fmax(high.y, v.y), fmax(high.z, v.z));
    }
    return (double)sizeof(float) * (ceil((high.x - low.x) / cell) + 1) * (ceil((high.y - low.y) / cell) + 1) * (ceil((high.z - low.z) / cell) + 1);
}

typedef struct MemoryRow {
    const char *name;
    const Vessel *vessel;    // NULL: none, only its number of bytes is known
    double edge, bytes, primitives, build_s;
} MemoryRow;

static bool add_memory(Growth *g, const Wall *wall, double length, const MemoryRow *m)
{
    Figures f = {0};
    if (m->vessel && !measure(g, wall, m->vessel, &f))
        return false;
    cJSON *row = add_row(g->memory);
    cJSON_AddStringToObject(row, "tree", wall->name);
    cJSON_AddStringToObject(row, "representation", m->name);
    cJSON_AddNumberToObject(row, "length_mm", length);
    cJSON_AddNumberToObject(row, "edge_mm", m->edge);
    cJSON_AddNumberToObject(row, "primitives", m->primitives);
    cJSON_AddNumberToObject(row, "bytes", m->bytes);
    cJSON_AddNumberToObject(row, "bytes_per_mm", m->bytes / length);
    fprintf(g->out, "  %-12s | %10.0f %9.2f %10.0f |", m->name, m->primitives, m->bytes / 1e6, m->bytes / length);
    if (m->vessel) {
        cJSON_AddNumberToObject(row, "build_s", m->build_s);
        add_figures(row, &f);
        fprintf(g->out, " %6.0f %6.0f | %8.3f %8.3f %7.3f | %6.2f", f.wire_ns, f.spread_ns, f.error.gap_rms_um, f.error.gap_max_um, f.error.normal_rms_deg,
                m->build_s);
    }
    fputc('\n', g->out);
    fflush(g->out);
    return true;
}

static bool add_made(Growth *g, const Wall *wall, double length, const char *name, Vessel *vessel, double edge, double begin)
{
    MemoryRow row = {name, vessel, edge, vessel ? (double)vessel->bytes : 0, vessel ? (double)vessel->primitives : 0, collision_build_clock_s() - begin};
    bool good = vessel && add_memory(g, wall, length, &row);
    destroy(vessel);
    return good;
}

static bool compare_memory(Growth *g, const Wall *wall, const TriangleMesh *mesh)
{
    double length = vessel_tree_length(wall->nodes), edge = contact_surface_edge(mesh), dense = dense_grid_bytes(mesh, edge), begin = collision_build_clock_s();
    GridVesselOptions options = {.cell_mm = edge, .band_mm = fmax(0.25, 2.5 * edge)};
    fprintf(g->out, "\n%s: %.0f mm of vessel, %d nodes; mesh and grid with edges of %.3f mm; errors against the model\n", wall->name, length,
            wall->nodes->node_count, edge);
    fputs("                 | primitives      MB   bytes/mm | ns: wire, all over | gap rms, max um, normal deg | s to build\n", g->out);
    Vessel *lim = model_vessel_create(wall->nodes);
    bool good = add_made(g, wall, length, "LIM", lim, 0, begin);
    for (int k = 0; good && k < SEARCHES && mesh_vessel_available(); k++) {
        char name[32];
        begin = collision_build_clock_s();
        snprintf(name, sizeof name, "mesh %s", search_name[k]);
        good = add_made(g, wall, length, name, mesh_vessel_of(wall, mesh, search_kind[k], g->faults), edge, begin);
    }
    begin = collision_build_clock_s();
    good = good && add_made(g, wall, length, "grid", grid_vessel_create(wall->exact, mesh, &options, wall->name, g->faults), edge, begin);
    return good && add_memory(g, wall, length, &(MemoryRow){"dense grid", NULL, edge, dense, dense / sizeof(float), 0});
}

static bool largest_tree(Growth *g)
{
    static const char path[] = "scenes/aneurism/aneurism.h5";
    if (access(path, R_OK) != 0) {
        fprintf(g->out, "\n%s: skipped, it is not here; scenes/aneurism/prepare makes it\n", path);
        return true;
    }
    VesselTree *model = tree_file_load(path, NULL, g->faults);
    if (model && !vessel_tree_is_model(model)) {
        faults_add(g->faults, path, 0, 0, "is a tree without a model; make one with `seldinger fit`");
        vessel_tree_free(model);
        return false;
    }
    Vessel *lim = model ? model_vessel_create(model) : NULL;
    Wall wall = {.name = path, .exact = lim, .nodes = model};
    if (model && !lim)
        fault(g, "not enough memory for the largest tree");
    TriangleMesh *mesh = lim ? mesh_wall(&wall, 100000, g->faults) : NULL;
    bool good = mesh && open_wall(g, &wall, mesh) && compare_memory(g, &wall, mesh);
    triangle_mesh_free(mesh);
    close_wall(&wall);
    destroy(lim);
    vessel_tree_free(model);
    return good;
}

bool collision_growth(FILE *out, cJSON *into, bool quick, int threads, Faults *faults)
{
    Growth g = {.out = out, .quick = quick, .threads = threads, .runs = quick ? 3 : 7, .faults = faults};
    g.growth = cJSON_AddArrayToObject(into, "growth");
    g.sizes = cJSON_AddArrayToObject(into, "sizes");
    g.match = cJSON_AddArrayToObject(into, "blobs_to_match");
    g.memory = cJSON_AddArrayToObject(into, "memory");
    Phantom phantom = {0};
    bool good = open_phantom(&g, &phantom) && grow_phantom(&g, &phantom) && grow_tube(&g) && grow_model(&g) &&
                (quick ? fputs("\nBlobs and triangles for the same error, and the memory of the largest tree: left out where quick\n", out) >= 0
                       : match_blobs(&g, &phantom) && largest_tree(&g));
    close_phantom(&phantom);
    return good;
}
