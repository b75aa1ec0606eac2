// Opens what a scene's `vessel:` refers to: a fitted model, a shape that is fitted on the fly and cached, an exact tube, a plane, a mesh; and
// converts it into triangles or a grid if `contact:` requires that.
#include "sim/open_vessel.h"

#include "geom/geom.h"
#include "recon/recon.h"
#include "sim/contact_surface.h"
#include "sim/fitted_shape.h"
#include "sim/surface_cache.h"
#include "sim/tube_tree.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { CELLS_ROUND_TUBE = 40 };

static bool open_tree(VesselTree *tree, ContactKind contact, const char *path, OpenVessel *out, Faults *faults)
{
    if (!tree)
        return false;
    out->tree = tree;
    if (!vessel_tree_is_model(tree)) {
        faults_add(faults, path, 0, 0, "is a tree without a model; make one with `seldinger fit`");
        return false;
    }
    if (contact_is_local(contact) && vessel_tree_is_shared(tree)) {
        faults_add(faults, path, 0, 0,
                   "holds one field of shared blobs, where contact '%s' needs a local model for each node; `seldinger fit --preset local` makes "
                   "these, contact 'lim' takes either",
                   contact_name[contact]);
        return false;
    }
    LimVesselOptions local = lim_vessel_default_options();
    local.field = contact == CONTACT_LIM_SWITCH ? LIM_SWITCH : LIM_BLEND;
    out->vessel = vessel_tree_is_shared(tree) ? field_vessel_create(tree) : lim_vessel_create_with(tree, &local);
    if (!out->vessel)
        faults_add(faults, path, 0, 0, "not enough memory for its contact");
    return out->vessel != NULL;
}

// `tree` and `sweep` may be NULL after a fault.
static bool open_swept(VesselTree *tree, SweepModel *sweep, const char *path, OpenVessel *out, Faults *faults)
{
    out->tree = tree;
    out->sweep = sweep;
    if (!tree || !sweep)
        return false;
    out->vessel = sweep_vessel_create(sweep);
    if (!out->vessel)
        faults_add(faults, path, 0, 0, "not enough memory for its contact");
    return out->vessel != NULL;
}

static bool open_model(const Scene *scene, OpenVessel *out, Faults *faults)
{
    VesselTree *tree = tree_file_load(scene->model_path, NULL, faults);
    if (!contact_is_swept(scene->contact))
        return open_tree(tree, scene->contact, scene->model_path, out, faults);
    return open_swept(tree, tree ? sweep_file_load(scene->model_path, contact_section(scene->contact), tree, faults) : NULL, scene->model_path, out, faults);
}

static bool open_shape(const Scene *scene, const OpenVesselOptions *options, OpenVessel *out, Faults *faults)
{
    SweepModel *sweep = NULL;
    VesselTree *tree = fitted_shape(scene, options->threads, options->progress, contact_is_swept(scene->contact) ? &sweep : NULL, faults);
    if (contact_is_swept(scene->contact))
        return open_swept(tree, sweep, scene->path, out, faults);
    return open_tree(tree, scene->contact, scene->path, out, faults);
}

// Fitted contacts of a tube: samples the exact tube and replaces it by the fit.
static bool fit_tube(const Scene *scene, const OpenVesselOptions *options, OpenVessel *out, Faults *faults)
{
    LimFitOptions fit = lim_fit_default_options();
    fit.voxel_mm = shape_options_voxel_mm(0, NULL);
    fit.threads = options->threads;
    VesselTree *sampled = tube_tree(out->vessel, &scene->tube, scene->path, faults);
    out->vessel->destroy(out->vessel);
    out->vessel = NULL;
    if (contact_is_swept(scene->contact)) {
        SweepModel *sweep = sampled ? sweep_samples(sampled, contact_section(scene->contact), fit.voxel_mm, options->threads, faults) : NULL;
        return open_swept(sampled, sweep, scene->path, out, faults);
    }
    VesselTree *model = sampled ? fit_samples(sampled, scene->contact, &fit, options->progress, faults) : NULL;
    vessel_tree_free(sampled);
    return open_tree(model, scene->contact, scene->path, out, faults);
}

// Replaces the wall of the open vessel by triangles or a grid. A tree stays, because it describes the vessel's course.
static bool turn_into_surface(const Scene *scene, const OpenVesselOptions *options, OpenVessel *out, Faults *faults)
{
    bool is_tube = scene->source == SOURCE_TUBE;
    Vessel *exact = out->vessel;
    VesselTree *nodes = is_tube ? tube_tree(exact, &scene->tube, scene->path, faults) : out->tree;
    double cell = scene->mesh_cell;
    if (nodes && !(cell > 0))
        cell = is_tube ? 2 * PI * scene->tube.radius / CELLS_ROUND_TUBE : isosurface_cell_for(nodes);
    out->mesh = nodes ? contact_surface_mesh(exact, nodes, is_tube && !scene->tube.closed_ends, cell, scene->path, options->note, faults) : NULL;
    out->vessel = out->mesh ? contact_surface_vessel(scene->contact, exact, out->mesh, cell, scene->path, faults) : NULL;
    exact->destroy(exact);
    if (is_tube)
        vessel_tree_free(nodes);
    return out->vessel != NULL;
}

// A mouth outside the lumen shows that the mesh has another frame or unit.
bool open_vessel_holds_entry(const Scene *scene, const OpenVessel *open, Faults *faults)
{
    const Vessel *vessel = open->vessel;
    if (!scene->wire.has_sheath || scene->source != SOURCE_MESH)
        return true;
    Vec3 x = vec3_add_scaled(scene->wire.start, fmax(scene->wire.inserted, 0.5), scene->wire.direction);
    VesselMemory memory = {.node = vessel->locate(vessel, x, -1)};
    VesselHit hit;
    vessel_query(vessel, 1, &x, 1, &memory, &hit);
    if (!(hit.flags & VESSEL_OPEN_END) && hit.gap > 0)
        return true;
    faults_add(faults, scene->path, 0, 0, "the tool's tip at the start, (%g, %g, %g) mm, is not inside the mesh %s; put the sheath's entry into its lumen", x.x,
               x.y, x.z, scene->mesh_path);
    return false;
}

static bool open_mesh(const Scene *scene, const OpenVesselOptions *options, OpenVessel *out, Faults *faults)
{
    out->mesh = contact_surface_load(scene->mesh_path, scene->mesh_scale, options->note, faults);
    if (!out->mesh)
        return false;
    ContactKind kind = scene->contact == CONTACT_GRID ? CONTACT_MESH : scene->contact;
    Vessel *mesh = out->vessel = contact_surface_vessel(kind, NULL, out->mesh, 0, scene->mesh_path, faults);
    if (mesh && scene->contact == CONTACT_GRID) {
        double cell = scene->mesh_cell > 0 ? scene->mesh_cell : contact_surface_edge(out->mesh);
        out->vessel = contact_surface_vessel(CONTACT_GRID, mesh, out->mesh, cell, scene->mesh_path, faults);
        mesh->destroy(mesh);
    }
    return out->vessel && open_vessel_holds_entry(scene, out, faults);
}

// A file that is not in the project is made by the script `prepare` in its folder. Any other missing file is left to its reader.
static bool is_prepared(const char *path, Faults *faults)
{
    if (access(path, F_OK) == 0)
        return true;
    char *script = text_file_beside(path, "prepare");
    bool can_be_made = script && access(script, X_OK) == 0;
    if (can_be_made)
        faults_add(faults, path, 0, 0, "does not exist; make it with `%s%s`", strchr(script, '/') ? "" : "./", script);
    free(script);
    return !can_be_made;
}

static bool open_source(const Scene *scene, const OpenVesselOptions *options, OpenVessel *out, Faults *faults)
{
    switch (scene->source) {
    case SOURCE_NONE: return true;
    case SOURCE_MODEL: return open_model(scene, out, faults);
    case SOURCE_SHAPE: return open_shape(scene, options, out, faults);
    case SOURCE_MESH: return open_mesh(scene, options, out, faults);
    case SOURCE_TUBE:
        out->vessel = tube_vessel_create(&scene->tube, scene->path, faults);
        return out->vessel && (!contact_is_fitted(scene->contact) || fit_tube(scene, options, out, faults));
    case SOURCE_PLANE:
        out->vessel = plane_vessel_create(scene->plane_point, scene->plane_normal);
        if (!out->vessel)
            faults_add(faults, scene->path, 0, 0, "not enough memory for the plane");
        return out->vessel != NULL;
    }
    return false;
}

static bool contact_is_surface(ContactKind contact)
{
    return contact == CONTACT_MESH || contact == CONTACT_SMOOTH_MESH || contact == CONTACT_FLAT_MESH || contact == CONTACT_GRID;
}

bool open_vessel_suits(const Scene *scene, Faults *faults)
{
    int before = faults->count;
    bool as_mesh = contact_is_surface(scene->contact) && scene->contact != CONTACT_GRID;
    bool exact = scene->source == SOURCE_TUBE || scene->source == SOURCE_PLANE;
    const char *name = contact_name[scene->contact];
    if (scene->source == SOURCE_NONE)
        return true;
    if (scene->contact == CONTACT_TUBE && !exact)
        faults_add(faults, scene->path, 0, 0,
                   "contact 'tube' needs the source 'tube'; a model or shape has lim, lim_blend, lim_switch, sweep, raster, rbf, pas, mesh, smooth_mesh, "
                   "flat_mesh and grid, a mesh the last four");
    else if (contact_is_fitted(scene->contact) && scene->source == SOURCE_MESH)
        faults_add(faults, scene->path, 0, 0,
                   "contact '%s' needs a fitted model: make it with `seldinger import` and `fit`; a mesh has mesh, smooth_mesh, "
                   "flat_mesh and grid",
                   name);
    else if (contact_is_surface(scene->contact) && scene->source == SOURCE_PLANE)
        faults_add(faults, scene->path, 0, 0, "contact '%s' needs a bounded wall; use 'tube' for a plane, which is the exact plane", name);
    else if ((as_mesh || scene->source == SOURCE_MESH) && !mesh_vessel_available())
        faults_add(faults, scene->path, 0, 0,
                   "contact '%s' of this vessel needs Embree, and this program was built without it; install libembree-dev and "
                   "build again, or take another contact",
                   name);
    return faults->count == before;
}

bool open_vessel(const Scene *scene, const OpenVesselOptions *options, OpenVessel *out, Faults *faults)
{
    *out = (OpenVessel){0};
    if (scene->source == SOURCE_NONE)
        return true;
    bool as_surface = contact_is_surface(scene->contact);
    const char *needed = scene_needed_file(scene);
    return open_vessel_suits(scene, faults) && (!needed || is_prepared(needed, faults)) && open_source(scene, options, out, faults) &&
           (!as_surface || scene->source == SOURCE_MESH || turn_into_surface(scene, options, out, faults));
}

const TriangleMesh *open_vessel_mesh(const Scene *scene, OpenVessel *open)
{
    if (open->mesh)
        return open->mesh;
    if (open->tree && open->sweep)
        open->mesh = triangle_mesh_of_sweep(open->sweep, NULL);
    else if (open->tree)
        open->mesh = cached_isosurface_of_tree(open->tree, isosurface_cell_for(open->tree));
    else if (scene->source == SOURCE_TUBE)
        open->mesh = triangle_mesh_of_tube(&scene->tube);
    else if (scene->source == SOURCE_PLANE)
        open->mesh = triangle_mesh_of_plane(scene->plane_point, scene->plane_normal, 50);
    return open->mesh;
}

bool open_vessel_inlet(Scene *scene, const OpenVessel *open, Faults *faults)
{
    if (!scene->inlet_is_root)
        return true;
    if (open->vessel && open->vessel->inlet && open->vessel->inlet(open->vessel, &scene->wire.start, &scene->wire.direction))
        return true;
    faults_add(faults, scene->path, 0, 0, "'inlet: root' needs a vessel with an inlet; give 'entry_mm' and 'direction'");
    return false;
}

void open_vessel_close(OpenVessel *open)
{
    if (open->vessel)
        open->vessel->destroy(open->vessel);
    sweep_model_free(open->sweep);
    vessel_tree_free(open->tree);
    triangle_mesh_free(open->mesh);
    *open = (OpenVessel){0};
}
