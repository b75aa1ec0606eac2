// The paper's capsule (Kerrien 2017, section 6.3.1): the zero of sum_k rho phi(|X - C_k| / rho) - T for 10 equal blobs on a segment of 10 mm, as a local
// model that all nodes share. Its samples are the vertices of its mesh, each given to its closest centre; a node's radius is the least distance.
#include "bench/collision_surface.h"

#include "bench/shape_vessel.h"
#include "geom/grid_vessel.h"
#include "geom/mesh_vessel.h"
#include "recon/fit/field_fit.h"
#include "recon/fit/lim_fit.h"
#include "recon/tree_file.h"
#include "sim/contact_surface.h"
#include "sim/tube_tree.h"

#include <stdlib.h>
#include <string.h>
#include <time.h>

static const double CAPSULE_LENGTH = 10, CAPSULE_RADIUS = 1.25,
                    CAPSULE_WIDTH = 0.401485;               // [mm]; the width gives the radius half way (docs/references.md, "Blobs")
enum { FINE = 10 };                          // the fine fit has tolerances smaller by this factor
enum { CAPSULE_NODES = 10, TRIAL = 6 };      // the first mesh has 1 / TRIAL of the triangles and gives the cell size for the final mesh
static const double PARTICLE_CELL = 0.2;     // [mm] about the paper's 3000 samples
static const double BAND_CELLS = 2,
                    BAND_BEYOND_TOOL =
                        0.2; // half width of the grid's band: at least both (cells; mm beyond the tool's radius), the range of the solver's queries
static const double ASKED_BEYOND_TOOL = 0.6; // [mm] extent of a shape's lattice: results further from the wall are not judged

double collision_build_clock_s(void)
{
    struct timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return (double)now.tv_sec + (double)now.tv_nsec * 1e-9;
}

// --- the paper's capsule ---

static Vec3 capsule_center(int i) { return vec3(CAPSULE_LENGTH * i / (CAPSULE_NODES - 1), 0, 0); }

static int capsule_nearest(Vec3 x)
{
    int best = 0;
    for (int i = 1; i < CAPSULE_NODES; i++)
        if (vec3_distance(x, capsule_center(i)) < vec3_distance(x, capsule_center(best)))
            best = i;
    return best;
}

static void capsule_points(VesselTree *tree, const TriangleMesh *samples)
{
    int64_t count = 0;
    for (int i = 0; i < CAPSULE_NODES; i++) {
        double least = HUGE_VAL;
        for (int v = 0; v < samples->vertex_count; v++)
            if (capsule_nearest(samples->vertex[v]) == i) {
                tree->point[count++] = samples->vertex[v];
                least = fmin(least, vec3_distance(samples->vertex[v], tree->center[i]));
            }
        tree->radius[i] = least;
        tree->point_offset[i + 1] = count;
    }
}

// The tree with the samples, with or without the blobs; NULL if out of memory.
static VesselTree *capsule_tree(const TriangleMesh *samples, bool is_model)
{
    VesselTree *tree = vessel_tree_create(CAPSULE_NODES, samples ? samples->vertex_count : 0, is_model ? CAPSULE_NODES * CAPSULE_NODES : 0);
    if (!tree)
        return NULL;
    for (int i = 0; i < CAPSULE_NODES; i++) {
        tree->center[i] = capsule_center(i);
        tree->radius[i] = CAPSULE_RADIUS;
        tree->direction[i] = vec3(1, 0, 0);
        tree->height[i] = CAPSULE_LENGTH / (CAPSULE_NODES - 1);
        tree->parent[i] = i - 1;
        for (int k = 0; is_model && k < CAPSULE_NODES; k++) {
            tree->blob_center[i * CAPSULE_NODES + k] = capsule_center(k);
            tree->blob_width[i * CAPSULE_NODES + k] = CAPSULE_WIDTH;
        }
        tree->blob_offset[i + 1] = is_model ? (i + 1) * CAPSULE_NODES : 0;
    }
    if (samples)
        capsule_points(tree, samples);
    if (vessel_tree_link(tree))
        return tree;
    vessel_tree_free(tree);
    return NULL;
}

Vessel *collision_lim(const VesselTree *tree, LimField field)
{
    LimVesselOptions options = lim_vessel_default_options();
    options.field = field;
    return lim_vessel_create_with(tree, &options);
}

static bool open_capsule(CollisionSurface *s, Faults *faults)
{
    VesselTree *blobs = capsule_tree(NULL, true);
    TriangleMesh *samples = blobs ? isosurface_of_model(blobs, 0, PARTICLE_CELL) : NULL;
    if (samples) {
        s->exact_tree = capsule_tree(samples, true);
        s->nodes = capsule_tree(samples, false);
    }
    s->exact = s->exact_tree ? collision_lim(s->exact_tree, LIM_SWITCH) : NULL;
    s->truth = s->exact;
    s->truth_is = "the convolution surface itself";
    vessel_tree_free(blobs);
    triangle_mesh_free(samples);
    if (!s->exact || !s->nodes)
        faults_add(faults, s->of->name, 0, 0, "no memory for the convolution surface");
    return s->exact && s->nodes;
}

// --- vessels of scenes ---

// `closer`: divisor of the usual tolerances.
static VesselTree *fit(const VesselTree *nodes, double voxel_mm, double closer, int threads, double *cpu_s, Faults *faults)
{
    FieldFitOptions options = field_fit_default_options();
    options.voxel_mm = voxel_mm / closer;    // tolerance and smallest reach are multiples of this
    options.tolerance /= closer;
    options.threads = threads;
    double begin = collision_build_clock_s();
    VesselTree *model = field_fit(nodes, &options, NULL, faults);
    *cpu_s = collision_build_clock_s() - begin;
    return model;
}

static VesselTree *fit_local(const VesselTree *nodes, double voxel_mm, int threads, double *cpu_s, Faults *faults)
{
    LimFitOptions options = lim_fit_default_options();
    options.voxel_mm = voxel_mm;
    options.threads = threads;
    double begin = collision_build_clock_s();
    VesselTree *model = lim_fit(nodes, &options, NULL, faults);
    *cpu_s = collision_build_clock_s() - begin;
    return model;
}

// The wall of a shape without curvature, which takes half the time.
typedef struct GapVessel {
    Vessel vessel;           // first: a Vessel * to us is a GapVessel *
    const Shape *shape;
    const Vessel *whole;     // gives the result beyond open ends
    double limit;            // [mm] further from the wall the shape's field is used, which never exceeds the distance
} GapVessel;

static void gap_query(const Vessel *vessel, int count, const Vec3 *point, double reach, VesselMemory *memory, VesselHit *hit)
{
    const GapVessel *v = (const GapVessel *)vessel;
    for (int i = 0; i < count; i++) {
        Vec3 foot;
        if (!vec3_is_finite(point[i]) || shape_beyond_open_end(v->shape, point[i])) {
            vessel_query(v->whole, 1, &point[i], reach, &memory[i], &hit[i]);
            continue;
        }
        Vec3 slope;
        double field = shape_field(v->shape, point[i], &slope);
        if (fabs(field) > v->limit || field > reach) {
            hit[i] = (VesselHit){.gap = field, .normal = vec3_unit_or(slope, vec3(0, 0, 0)), .flags = field > reach ? VESSEL_FAR : 0};
            continue;
        }
        hit[i] = (VesselHit){.gap = shape_distance(v->shape, point[i], &foot)};
        hit[i].normal = vec3_unit_or(vec3_scale(vec3_sub(point[i], foot), hit[i].gap), vec3(0, 0, 0));
    }
}

static int gap_locate(const Vessel *vessel, Vec3 point, int from)
{
    const Vessel *whole = ((const GapVessel *)vessel)->whole;
    return whole->locate(whole, point, from);
}

static bool gap_inlet(const Vessel *vessel, Vec3 *point, Vec3 *direction)
{
    const Vessel *whole = ((const GapVessel *)vessel)->whole;
    return whole->inlet(whole, point, direction);
}

static void gap_destroy(Vessel *vessel) { free(vessel); }

static Vessel *gap_vessel_create(const Shape *shape, const Vessel *whole, double limit)
{
    GapVessel *v = calloc(1, sizeof *v);
    if (!v)
        return NULL;
    *v = (GapVessel){{.kind = "shape", .query = gap_query, .locate = gap_locate, .inlet = gap_inlet, .destroy = gap_destroy}, shape, whole, limit};
    return &v->vessel;
}

static bool open_source(CollisionSurface *s, Faults *faults)
{
    Scene *scene = s->scene;
    const char(*option)[2][64] = (const char(*)[2][64])scene->shape_option;
    if (scene->source == SOURCE_TUBE) {
        s->exact = tube_vessel_create(&scene->tube, scene->path, faults);
        s->nodes = s->exact ? tube_tree(s->exact, &scene->tube, scene->path, faults) : NULL;
        s->truth = s->exact;
        s->truth_is = "the exact tube";
        return s->nodes != NULL;
    }
    if (scene->source == SOURCE_SHAPE) {
        s->shape = shape_create(scene->shape_name, scene->shape_option_count, option, scene->path, faults);
        s->nodes = s->shape ? shape_sample(s->shape, faults) : NULL;
        s->exact = s->nodes ? shape_vessel_create(s->shape) : NULL;
        s->gap_only = s->exact ? gap_vessel_create(s->shape, s->exact, HUGE_VAL) : NULL;
        s->truth = s->exact;
        s->truth_gap = s->gap_only;
        s->truth_is = "the shape's own distance";
        if (s->nodes && !s->gap_only)
            faults_add(faults, scene->path, 0, 0, "no memory for the shape's wall");
        return s->gap_only != NULL;
    }
    if (scene->source == SOURCE_MODEL) {
        s->model = tree_file_load(scene->model_path, NULL, faults);
        s->nodes = s->model;
        s->fit_s = NAN;
        s->truth_is = "the model itself";
        s->truth_is_model = true;
        if (s->model && !vessel_tree_is_model(s->model))
            faults_add(faults, scene->model_path, 0, 0, "is a tree without a model; make one with `seldinger fit`");
        return s->model && vessel_tree_is_model(s->model);
    }
    faults_add(faults, scene->path, 0, 0, "has no vessel that can be compared; expected tube, shape or model");
    return false;
}

bool collision_surface_open(const CollisionCase *of, int threads, CollisionSurface *out, Faults *faults)
{
    *out = (CollisionSurface){.of = of, .scene = scene_load(of->scene, faults)};
    if (!out->scene || !(of->convolution_capsule ? open_capsule(out, faults) : open_source(out, faults)))
        return false;
    double voxel = shape_options_voxel_mm(out->scene->shape_option_count, (const char(*)[2][64])out->scene->shape_option);
    if (!out->model) {
        out->model = fit(out->nodes, voxel, 1, threads, &out->fit_s, faults);
        out->local = out->model ? fit_local(out->nodes, voxel, threads, &out->local_s, faults) : NULL;
        out->fine = out->local ? fit(out->nodes, voxel, FINE, threads, &out->fine_s, faults) : NULL;
        if (!out->fine)
            return false;
    }
    out->length_mm = vessel_tree_length(out->nodes);
    out->lim = model_vessel_create(out->model);
    if (!out->lim) {
        faults_add(faults, of->scene, 0, 0, "not enough memory for the model's vessel");
        return false;
    }
    if (!out->truth)
        out->truth = out->lim;
    if (!out->truth_gap)
        out->truth_gap = out->truth;
    // the tool enters at the same place in all representations
    return open_vessel_inlet(out->scene, &(OpenVessel){.vessel = out->scene->source == SOURCE_TUBE ? out->exact : out->lim}, faults);
}

void collision_surface_close(CollisionSurface *s)
{
    Vessel *owned[] = {s->gap_only, s->exact, s->lim};
    for (size_t i = 0; i < sizeof owned / sizeof owned[0]; i++)
        if (owned[i])
            owned[i]->destroy(owned[i]);
    if (s->nodes != s->model)
        vessel_tree_free(s->nodes);
    vessel_tree_free(s->model);
    vessel_tree_free(s->local);
    vessel_tree_free(s->fine);
    vessel_tree_free(s->exact_tree);
    shape_free(s->shape);
    if (s->scene)
        scene_free(s->scene);
    *s = (CollisionSurface){0};
}

// --- representations ---

static TriangleMesh *mesh_of(const CollisionSurface *s, const Vessel *wall, double cell_mm, Faults *faults)
{
    bool open_end = s->scene->source == SOURCE_TUBE && !s->of->convolution_capsule && !s->scene->tube.closed_ends;
    return contact_surface_mesh(wall, s->nodes, open_end, cell_mm, s->of->name, cli_note, faults);
}

// Moves all vertices onto the wall, to 1e-9 mm. False if a vertex would move by more than half a cell, or the iteration does not converge.
static bool project(TriangleMesh *mesh, const Vessel *wall, double cell_mm)
{
    enum { ROUNDS = 20 };
    for (int v = 0; v < mesh->vertex_count; v++) {
        Vec3 x = mesh->vertex[v];
        VesselMemory memory = {.node = wall->locate(wall, x, -1)};
        VesselHit hit = {.gap = HUGE_VAL};
        for (int round = 0; round < ROUNDS && !(fabs(hit.gap) < 1e-9); round++) {
            vessel_query(wall, 1, &x, HUGE_VAL, &memory, &hit);
            if (!isfinite(hit.gap) || !(fabs(hit.gap) < cell_mm / 2))
                return false;
            x = vec3_add_scaled(x, -hit.gap, hit.normal);
        }
        if (!(fabs(hit.gap) < 1e-9) || vec3_distance(x, mesh->vertex[v]) > cell_mm / 2)
            return false;
        mesh->vertex[v] = x;
        mesh->normal[v] = vec3_negate(hit.normal);
    }
    return true;
}

TriangleMesh *collision_mesh(const CollisionSurface *s, double triangles, CollisionMesh *out, Faults *faults)
{
    const Vessel *wall = s->shape ? s->lim : s->truth;
    double trial = triangles / TRIAL;
    out->cell_mm = contact_surface_cell(s->nodes, trial);
    TriangleMesh *mesh = mesh_of(s, wall, out->cell_mm, faults);
    if (!mesh)
        return NULL;
    out->cell_mm *= sqrt(mesh->triangle_count / triangles);
    triangle_mesh_free(mesh);
    double begin = collision_build_clock_s();
    mesh = mesh_of(s, wall, out->cell_mm, faults);
    if (mesh && wall != s->truth && !project(mesh, s->truth, out->cell_mm)) {
        triangle_mesh_free(mesh);
        mesh = mesh_of(s, s->truth, out->cell_mm, faults);
    }
    out->made_s = collision_build_clock_s() - begin;
    return mesh;
}

static CollisionWall *add_wall(CollisionWalls *walls, const char *name, Vessel *vessel, bool owned)
{
    CollisionWall *wall = &walls->wall[walls->count++];
    *wall = (CollisionWall){.name = name, .vessel = vessel, .mesh = -1, .surface_s = NAN, .build_s = NAN};
    if (owned)
        walls->owned[walls->owned_count++] = vessel;
    return wall;
}

static bool add_mesh(const CollisionSurface *s, CollisionWalls *walls, const TriangleMesh *mesh, int index, CollisionMesh made, Faults *faults)
{
    static const struct {
        const char *name;
        MeshNormals normals;
        MeshSearch search;
    } kinds[] = {{"mesh full", MESH_FACES, MESH_SEARCH_FULL},
                 {"mesh warm", MESH_FACES, MESH_SEARCH_WARM},
                 {"mesh cached", MESH_FACES, MESH_SEARCH_CACHED},
                 {"mesh curved", MESH_CURVED, MESH_SEARCH_CACHED},
                 {"mesh smooth", MESH_SMOOTH, MESH_SEARCH_CACHED}};
    for (size_t i = 0; i < sizeof kinds / sizeof kinds[0]; i++) {
        MeshVesselOptions options = mesh_vessel_default_options();
        options.normals = kinds[i].normals;
        options.search = kinds[i].search;
        double begin = collision_build_clock_s();
        Vessel *vessel = mesh_vessel_create(mesh, &options, s->of->name, faults);
        if (!vessel)
            return false;
        CollisionWall *wall = add_wall(walls, kinds[i].name, vessel, true);
        wall->build_s = collision_build_clock_s() - begin;
        wall->surface_s = made.made_s;
        wall->triangles = mesh->triangle_count;
        wall->mesh = index;
        wall->cell_mm = made.cell_mm;
    }
    return true;
}

static bool add_grid(const CollisionSurface *s, CollisionWalls *walls, const TriangleMesh *mesh, double cell, Faults *faults)
{
    double tool = 0;
    for (int i = 0; i < s->scene->wire.section_count; i++)
        tool = fmax(tool, s->scene->wire.section[i].diameter / 2);
    GridVesselOptions options = {.cell_mm = cell, .band_mm = fmax(BAND_CELLS * cell, tool + BAND_BEYOND_TOOL)};
    double begin = collision_build_clock_s();
    Vessel *near_wall = s->shape ? gap_vessel_create(s->shape, s->exact, fmax(options.band_mm + cell, tool + ASKED_BEYOND_TOOL)) : NULL;
    Vessel *grid = grid_vessel_create(near_wall ? near_wall : s->truth_gap, mesh, &options, s->of->name, faults);
    if (near_wall)
        near_wall->destroy(near_wall);
    if (!grid)
        return false;
    CollisionWall *wall = add_wall(walls, "grid", grid, true);
    wall->build_s = collision_build_clock_s() - begin;
    wall->cell_mm = cell;
    return true;
}

static bool add_meshes(const CollisionSurface *s, CollisionWalls *walls, Faults *faults)
{
    for (int m = 0; m < s->of->mesh_count; m++) {
        CollisionMesh made;
        TriangleMesh *mesh = collision_mesh(s, s->of->triangles[m], &made, faults);
        bool good = mesh && (walls->without_mesh || add_mesh(s, walls, mesh, m, made, faults));
        if (good && m + 1 == s->of->mesh_count)
            good = add_grid(s, walls, mesh, made.cell_mm, faults);
        triangle_mesh_free(mesh);
        if (!good)
            return false;
    }
    return true;
}

static bool add_lim(const CollisionSurface *s, CollisionWalls *walls, const char *name, Vessel *vessel, double begun_s, double fit_s, Faults *faults)
{
    if (!vessel) {
        faults_add(faults, s->of->name, 0, 0, "not enough memory for the model's vessel");
        return false;
    }
    CollisionWall *wall = add_wall(walls, name, vessel, true);
    wall->build_s = collision_build_clock_s() - begun_s;
    wall->surface_s = fit_s;
    return true;
}

// Vessels are built again to measure the time.
static bool add_model(const CollisionSurface *s, CollisionWalls *walls, const char *name, const VesselTree *model, double fit_s, Faults *faults)
{
    double begin = collision_build_clock_s();
    return !model || add_lim(s, walls, name, model_vessel_create(model), begin, fit_s, faults);
}

static bool add_local(const CollisionSurface *s, CollisionWalls *walls, const char *name, LimField field, Faults *faults)
{
    const VesselTree *local = s->local ? s->local : vessel_tree_is_shared(s->model) ? NULL : s->model;
    double begin = collision_build_clock_s();
    return !local || add_lim(s, walls, name, collision_lim(local, field), begin, s->local ? s->local_s : s->fit_s, faults);
}

bool collision_walls_open(const CollisionSurface *s, CollisionWalls *out, Faults *faults)
{
    *out = (CollisionWalls){.without_mesh = mesh_vessel_available() ? NULL : "built without Embree"};
    if (s->exact)
        add_wall(out, "exact", s->exact, false);
    return add_model(s, out, "lim", s->model, s->fit_s, faults) && add_model(s, out, "lim fine", s->fine, s->fine_s, faults) &&
           add_local(s, out, "lim-blend", LIM_BLEND, faults) && add_local(s, out, "lim-switch", LIM_SWITCH, faults) && add_meshes(s, out, faults);
}

void collision_walls_close(CollisionWalls *walls)
{
    for (int i = 0; i < walls->owned_count; i++)
        walls->owned[i]->destroy(walls->owned[i]);
    *walls = (CollisionWalls){0};
}

const CollisionWall *collision_wall_find(const CollisionWalls *walls, const char *name, int mesh)
{
    for (int i = 0; i < walls->count; i++)
        if (!strcmp(walls->wall[i].name, name) && walls->wall[i].mesh == mesh)
            return &walls->wall[i];
    return NULL;
}
