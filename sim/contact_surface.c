#include "sim/contact_surface.h"

#include "geom/geom.h"
#include "recon/recon.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

// Balls about the nodes that cover the wall. Upstream of the root there are some more where the wall continues there.
enum { UPSTREAM = 8 };       // half radii

typedef struct Balls {
    int count;
    Vec3 *center;
    double *reach;
    int *from;
} Balls;

static void add_ball(Balls *balls, Vec3 center, double reach, int from)
{
    balls->center[balls->count] = center;
    balls->reach[balls->count] = reach;
    balls->from[balls->count++] = from;
}

static double farthest_point(const VesselTree *tree, int node)
{
    double far2 = tree->radius[node] * tree->radius[node];
    for (int64_t k = tree->point_offset[node]; k < tree->point_offset[node + 1]; k++)
        far2 = fmax(far2, vec3_norm2(vec3_sub(tree->point[k], tree->center[node])));
    return sqrt(far2);
}

static bool continues_upstream(const Vessel *exact, Vec3 inlet, Vec3 direction, double radius)
{
    Vec3 x = vec3_add_scaled(inlet, -2 * radius, direction);
    VesselMemory memory = {.node = exact->locate(exact, x, -1)};
    VesselHit hit;
    vessel_query(exact, 1, &x, 4 * radius, &memory, &hit);
    return hit.gap > 0 && hit.gap < HUGE_VAL;
}

static bool fill_balls(Balls *balls, const Vessel *exact, const VesselTree *nodes, bool open_end, double cell)
{
    size_t capacity = (size_t)nodes->node_count + UPSTREAM;
    *balls = (Balls){0, calloc(capacity, sizeof(Vec3)), calloc(capacity, sizeof(double)), calloc(capacity, sizeof(int))};
    if (!balls->center || !balls->reach || !balls->from)
        return false;
    for (int i = 0; i < nodes->node_count; i++) {
        int before = nodes->parent[i] >= 0 ? balls->from[nodes->parent[i]] : -1;
        double reach = 1.2 * farthest_point(nodes, i) + 2 * cell;
        if (open_end && i == nodes->node_count - 1)
            reach = fmax(reach, 2.2 * nodes->radius[i]);     // for the flared end of an exact tube
        add_ball(balls, nodes->center[i], reach, exact->locate(exact, nodes->center[i], before));
    }
    Vec3 inlet, direction;
    double r = nodes->radius[0];
    if (exact->inlet && exact->inlet(exact, &inlet, &direction) && continues_upstream(exact, inlet, direction, r))
        for (int k = 1; k <= UPSTREAM; k++)
            add_ball(balls, vec3_add_scaled(inlet, -0.5 * r * k, direction), 1.2 * r + 2 * cell, balls->from[0]);
    return true;
}

static double thinnest_radius(const VesselTree *nodes)
{
    double thinnest = nodes->radius[0];
    for (int i = 1; i < nodes->node_count; i++)
        thinnest = fmin(thinnest, nodes->radius[i]);
    return thinnest;
}

static void write_note(NoteFunction note, const char *name, const char *format, ...) __attribute__((format(printf, 3, 4)));
static void write_note(NoteFunction note, const char *name, const char *format, ...)
{
    char text[200];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    if (note)
        note(name, text);
}

// Where neighbouring local models disagree, there are small bubbles of wall in the lumen: parts smaller than a ball of the thinnest radius are not vessels.
static void drop_specks(TriangleMesh *mesh, double thinnest, const char *name, NoteFunction note)
{
    int dropped = surface_drop_specks(mesh, 4 * PI / 3 * thinnest * thinnest * thinnest);
    if (dropped > 0)
        write_note(note, name, "removed %d specks of its mesh, where neighbouring local models disagree", dropped);
}

TriangleMesh *contact_surface_mesh(const Vessel *exact, const VesselTree *nodes, bool open_end, double cell_mm, const char *name, NoteFunction note,
                                   Faults *faults)
{
    static const double COARSE = 0.6;        // radii
    Balls balls;
    TriangleMesh *mesh = NULL;
    double thinnest = thinnest_radius(nodes);
    if (cell_mm > COARSE * thinnest)
        write_note(note, name, "its mesh has cells of %g mm, which are coarse for a radius of %g mm: thin vessels lose their shape", cell_mm, thinnest);
    if (fill_balls(&balls, exact, nodes, open_end, cell_mm))
        mesh = isosurface_of_vessel(exact, balls.count, balls.center, balls.reach, balls.from, cell_mm);
    if (!mesh)
        faults_add(faults, name, 0, 0, "cannot be meshed with cells of %g mm: not enough memory, or the cell is too small for this vessel", cell_mm);
    else if (mesh->triangle_count == 0) {
        faults_add(faults, name, 0, 0, "has no wall to mesh with cells of %g mm; use smaller cells", cell_mm);
        triangle_mesh_free(mesh);
        mesh = NULL;
    }
    if (mesh)
        drop_specks(mesh, thinnest, name, note);
    free(balls.center);
    free(balls.reach);
    free(balls.from);
    return mesh;
}

double contact_surface_cell(const VesselTree *nodes, double triangles)
{
    double area = 0;
    for (int i = 0; i < nodes->node_count; i++) {
        int parent = nodes->parent[i];
        double length = parent < 0 ? 0 : vec3_distance(nodes->center[i], nodes->center[parent]);
        area += 2 * PI * nodes->radius[i] * fmax(length, parent < 0 ? nodes->radius[i] : 0);
    }
    return sqrt(2.3 * area / triangles);     // marching cubes give 2.3 triangles per cell face on average
}

double contact_surface_edge(const TriangleMesh *mesh)
{
    double sum = 0;
    for (int t = 0; t < mesh->triangle_count; t++)
        for (int k = 0; k < 3; k++)
            sum += vec3_distance(mesh->vertex[mesh->triangle[t][k]], mesh->vertex[mesh->triangle[t][(k + 1) % 3]]);
    return sum / (3.0 * mesh->triangle_count);
}

Vessel *contact_surface_vessel(ContactKind kind, const Vessel *exact, const TriangleMesh *mesh, double cell_mm, const char *name, Faults *faults)
{
    Vec3 inlet = {0, 0, 0}, direction = {0, 0, 0};
    bool has_inlet = exact && exact->inlet && exact->inlet(exact, &inlet, &direction);
    if (kind == CONTACT_GRID) {
        GridVesselOptions options = {.cell_mm = cell_mm, .band_mm = 6 * cell_mm, .has_inlet = has_inlet, .inlet = inlet, .direction = direction};
        return grid_vessel_create(exact, mesh, &options, name, faults);
    }
    MeshVesselOptions options = mesh_vessel_default_options();
    options.normals = kind == CONTACT_SMOOTH_MESH ? MESH_SMOOTH : kind == CONTACT_FLAT_MESH ? MESH_FACES : MESH_CURVED;
    options.has_inlet = has_inlet;
    options.inlet = inlet;
    options.direction = direction;
    return mesh_vessel_create(mesh, &options, name, faults);
}

// Vertex normals out of the lumen, weighted by the faces' angles at the vertex.
static void add_normals(TriangleMesh *mesh)
{
    for (int t = 0; t < mesh->triangle_count; t++)
        for (int k = 0; k < 3; k++) {
            const int *v = mesh->triangle[t];
            Vec3 a = vec3_sub(mesh->vertex[v[(k + 1) % 3]], mesh->vertex[v[k]]), b = vec3_sub(mesh->vertex[v[(k + 2) % 3]], mesh->vertex[v[k]]);
            mesh->normal[v[k]] = vec3_add_scaled(mesh->normal[v[k]], vec3_angle(a, b), vec3_unit_or(vec3_cross(a, b), vec3(0, 0, 0)));
        }
    for (int i = 0; i < mesh->vertex_count; i++)
        mesh->normal[i] = vec3_unit_or(mesh->normal[i], vec3(1, 0, 0));
}

TriangleMesh *contact_surface_load(const char *path, double scale, NoteFunction note, Faults *faults)
{
    MeshCheck check;
    SurfaceMesh *surface = mesh_load_repaired(path, scale, "mesh_scale: ", &check, faults);
    if (!surface)
        return NULL;
    char text[4096];
    mesh_check_text(&check, true, text, sizeof text);
    if (note)
        note(path, text);
    TriangleMesh *mesh = NULL;
    if (check.nonmanifold_edges.count)
        faults_add(faults, path, 0, 0,
                   "has %d edges of three triangles or more, first at triangle %d: inside and outside cannot be distinguished; an edge has "
                   "one or two",
                   check.nonmanifold_edges.count, check.nonmanifold_edges.first);
    else if ((mesh = calloc(1, sizeof *mesh)) != NULL) {
        *mesh = (TriangleMesh){.vertex_count = surface->vertex_count,
                               .triangle_count = surface->triangle_count,
                               .vertex = surface->vertex,
                               .triangle = surface->triangle,
                               .normal = calloc((size_t)surface->vertex_count, sizeof(Vec3)),
                               .node = calloc((size_t)surface->vertex_count, sizeof(int))};
        surface->vertex = NULL;
        surface->triangle = NULL;
    }
    surface_free(surface);
    if (mesh && mesh->normal && mesh->node) {
        add_normals(mesh);
        return mesh;
    }
    if (!check.nonmanifold_edges.count)
        faults_add(faults, path, 0, 0, "not enough memory");
    triangle_mesh_free(mesh);
    return NULL;
}
