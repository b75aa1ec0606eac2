// Marching cubes over a sparse lattice (cube_triangles.h), vertices moved onto the surface by Newton steps along the gradient.
//
// The lattice point (i, j, k) lies at cell * (i, j, k), for every tree the same. Its value is the field of its power-nearest node among those whose model
// reaches it (Kerrien 2017, 5.3.3: each local surface cut to its power cell); -T where none does. A block of the lattice (sparse_march.h) is
// touched only where some model reaches it, and left again where bounds of the kernels say that it is all outside or all inside: work and memory
// grow with the surface.
#include "geom/isosurface.h"

#include "geom/blobby.h"
#include "geom/power_walk.h"
#include "geom/sparse_march.h"

#include <stdlib.h>
#include <string.h>

typedef struct NodeReach {
    int node;
    Blobby model;
    double reach;                    // [mm] no point of the model's surface lies further from the node's centre
} NodeReach;

typedef struct TreeMarch {
    March march;                     // first: a March * to us is a TreeMarch *
    const VesselTree *tree;
    int node_count;
    NodeReach *node;                 // the march's balls
} TreeMarch;

// f > 0 needs a blob that alone gives T / n: rho (1 + x^2 / (5 rho^2))^-2 > T / n, or of compact blobs the support of one that adds.
static double reach_of_model(const Blobby *m, Vec3 center)
{
    double reach = 0;
    for (int j = 0; j < m->count && m->amplitude; j++) {
        int k = blobby_row(m, j);
        if (m->amplitude[k] > 0)
            reach = fmax(reach, vec3_distance(center, m->center[k]) + m->width[k]);
    }
    for (int j = 0; j < m->count && !m->amplitude; j++) {
        double rho = m->width[j], ratio = rho * m->count / m->iso_level;
        if (ratio > 1)
            reach = fmax(reach, vec3_distance(center, m->center[j]) + rho * sqrt(5 * (sqrt(ratio) - 1)));
    }
    return reach;
}

// Bounds of a model's field over the ball of radius h about x.
static void field_bounds(const Blobby *m, Vec3 x, double h, double *low, double *high)
{
    *low = *high = -m->iso_level;
    for (int j = 0; j < m->count; j++) {
        int k = blobby_row(m, j);
        double rho = m->width[k], d = vec3_distance(x, m->center[k]), near = fmax(0, d - h), far = d + h;
        if (m->amplitude) {
            double a = m->amplitude[k], u = fmax(0, 1 - near * near / (rho * rho)), v = fmax(0, 1 - far * far / (rho * rho));
            *high += a * (a > 0 ? u * u * u : v * v * v);
            *low += a * (a > 0 ? v * v * v : u * u * u);
            continue;
        }
        double u = 1 / (1 + near * near / (5 * rho * rho)), v = 1 / (1 + far * far / (5 * rho * rho));
        *high += rho * u * u;
        *low += rho * v * v;
    }
}

// Drops candidates that are nowhere in the block the power-nearest: behind one that reaches all of it.
static void prune_candidates(TreeMarch *job, MarchBlock *b)
{
    double h, least = HUGE_VAL;
    Vec3 middle = march_block_ball(&job->march, b, &h);
    for (int l = b->first; l >= 0; l = job->march.link[l].next) {
        const NodeReach *n = &job->node[job->march.link[l].ball];
        double d = vec3_distance(middle, job->tree->center[n->node]), r = job->tree->radius[n->node];
        if (d + h < n->reach)
            least = fmin(least, (d + h) * (d + h) - r * r);
    }
    for (int *link = &b->first; *link >= 0;) {
        const NodeReach *n = &job->node[job->march.link[*link].ball];
        double d = fmax(0, vec3_distance(middle, job->tree->center[n->node]) - h), r = job->tree->radius[n->node];
        if (d * d - r * r > least + 1e-9)
            *link = job->march.link[*link].next;
        else
            link = &job->march.link[*link].next;
    }
}

// Whether the block is certainly without surface: every candidate says outside, or every one inside and one covers all of it.
static bool block_is_plain(const TreeMarch *job, const MarchBlock *b)
{
    double h;
    Vec3 middle = march_block_ball(&job->march, b, &h);
    bool all_out = true, all_in = true, covered = false;
    for (int l = b->first; l >= 0 && (all_out || all_in); l = job->march.link[l].next) {
        const NodeReach *n = &job->node[job->march.link[l].ball];
        double low, high;
        field_bounds(&n->model, middle, h, &low, &high);
        all_out = all_out && high < -1e-9;
        all_in = all_in && low > 1e-9;
        covered = covered || vec3_distance(middle, job->tree->center[n->node]) + h < n->reach;
    }
    return all_out || (all_in && covered);
}

// The power-nearest of a block's candidates that reach x, -1 where none does.
static int owner_of(const TreeMarch *job, const MarchBlock *b, Vec3 x)
{
    int best = -1;
    double least = HUGE_VAL;
    for (int l = b->first; l >= 0; l = job->march.link[l].next) {
        const NodeReach *n = &job->node[job->march.link[l].ball];
        double d2 = vec3_norm2(vec3_sub(x, job->tree->center[n->node])), r = job->tree->radius[n->node];
        if (d2 <= n->reach * n->reach && d2 - r * r < least) {
            least = d2 - r * r;
            best = job->march.link[l].ball;
        }
    }
    return best;
}

static void sample_block(TreeMarch *job, const MarchBlock *b)
{
    for (int i = 0; i < MARCH_SIDE; i++)
        for (int j = 0; j < MARCH_SIDE; j++)
            for (int k = 0; k < MARCH_SIDE; k++) {
                Vec3 x = march_point(&job->march, b, i, j, k);
                int at = march_index(i, j, k), owner = owner_of(job, b, x);
                job->march.owner[at] = owner;
                job->march.value[at] = owner >= 0 ? blobby_field(&job->node[owner].model, x) : -job->tree->iso_level;
            }
}

// Onto the model's surface, by at most three quarters of a cell: where neighbouring models disagree there may be none near, and p stays.
static Vec3 settle(const TreeMarch *job, const Blobby *m, Vec3 p, Vec3 *normal)
{
    Vec3 g, x = p;
    for (int i = 0; i < 20; i++) {
        double f = blobby_gradient(m, x, &g), g2 = vec3_norm2(g);
        if (!(g2 > 1e-200))
            break;
        Vec3 step = vec3_scale(g, -f / g2);
        x = vec3_add(x, step);
        if (vec3_distance(x, p) > 0.75 * job->march.cell)
            break;
        if (vec3_norm(step) < 1e-12) {
            *normal = vec3_unit(vec3_negate(g));
            return x;
        }
    }
    blobby_gradient(m, p, &g);
    *normal = vec3_unit_or(vec3_negate(g), vec3(1, 0, 0));
    return p;
}

static void place_vertex(March *march, const MarchBlock *b, Vec3 p, int inside, Vec3 *vertex, Vec3 *normal, int *node)
{
    const TreeMarch *job = (const TreeMarch *)march;
    int owner = owner_of(job, b, p);
    owner = owner >= 0 ? owner : inside;   // the inside end has one
    *vertex = settle(job, &job->node[owner].model, p, normal);
    *node = job->node[owner].node;
}

static bool find_blocks(TreeMarch *job, int first, int end)
{
    const VesselTree *tree = job->tree;
    job->node = calloc((size_t)(end - first), sizeof *job->node);
    if (!job->node)
        return false;
    for (int i = first; i < end; i++) {
        NodeReach n = {i, blobby_of(tree, i), 0};
        n.reach = reach_of_model(&n.model, tree->center[i]);
        if (!(n.reach > 0))
            continue;
        n.reach += 2 * job->march.cell;   // so that the outer end of a crossed edge has the model's value too
        job->node[job->node_count++] = n;
    }
    for (int n = 0; n < job->node_count; n++)
        if (!march_add_ball(&job->march, n, tree->center[job->node[n].node], job->node[n].reach))
            return false;
    return true;
}

static TriangleMesh *surface_of_nodes(const VesselTree *tree, int first, int end, double cell_mm)
{
    if (!tree || !vessel_tree_is_model(tree) || !isfinite(cell_mm) || !(cell_mm > 0))
        return NULL;
    TreeMarch *job = calloc(1, sizeof *job);
    if (!job)
        return NULL;
    job->tree = tree;
    job->march.place = place_vertex;
    March *march = &job->march;
    bool good = march_begin(march, cell_mm, 0.001) && find_blocks(job, first, end);
    for (int i = 0; good && i < march->block_count; i++) {
        prune_candidates(job, &march->block[i]);
        if (block_is_plain(job, &march->block[i]))
            continue;
        sample_block(job, &march->block[i]);
        good = march_block(march, &march->block[i]);
    }
    TriangleMesh *mesh = march->mesh;
    if (!good) {
        triangle_mesh_free(mesh);
        mesh = NULL;
    }
    march_end(march);
    free(job->node);
    free(job);
    return mesh;
}

TriangleMesh *isosurface_of_model(const VesselTree *tree, int node, double cell_mm)
{
    if (!tree || node < 0 || node >= tree->node_count)
        return NULL;
    return surface_of_nodes(tree, node, node + 1, cell_mm);
}

TriangleMesh *isosurface_of_tree(const VesselTree *tree, double cell_mm)
{
    return tree ? surface_of_nodes(tree, 0, tree->node_count, cell_mm) : NULL;
}

bool triangle_mesh_keep(TriangleMesh *mesh, const bool *keep)
{
    int *renamed = malloc(((size_t)mesh->vertex_count + 1) * sizeof *renamed), vertices = 0, triangles = 0;
    if (!renamed)
        return false;
    memset(renamed, 0xff, (size_t)mesh->vertex_count * sizeof *renamed);
    for (int t = 0; t < mesh->triangle_count; t++)
        for (int k = 0; keep[t] && k < 3; k++)
            renamed[mesh->triangle[t][k]] = 0;
    for (int v = 0; v < mesh->vertex_count; v++) {
        if (renamed[v] < 0)
            continue;
        renamed[v] = vertices;
        mesh->vertex[vertices] = mesh->vertex[v];
        mesh->normal[vertices] = mesh->normal[v];
        mesh->node[vertices++] = mesh->node[v];
    }
    for (int t = 0; t < mesh->triangle_count; t++) {
        if (!keep[t])
            continue;
        for (int k = 0; k < 3; k++)
            mesh->triangle[triangles][k] = renamed[mesh->triangle[t][k]];
        triangles++;
    }
    mesh->vertex_count = vertices;
    mesh->triangle_count = triangles;
    free(renamed);
    return true;
}

void triangle_mesh_free(TriangleMesh *mesh)
{
    if (!mesh)
        return;
    free(mesh->vertex);
    free(mesh->normal);
    free(mesh->node);
    free(mesh->triangle);
    free(mesh);
}

double isosurface_cell_for(const VesselTree *tree)
{
    double least = HUGE_VAL, area = 0;
    for (int i = 0; i < tree->node_count; i++) {
        int parent = tree->parent[i];
        least = fmin(least, tree->radius[i]);
        area += parent < 0 ? 0 : 2 * PI * tree->radius[i] * vec3_distance(tree->center[i], tree->center[parent]);
    }
    // marching cubes cut a cell's face in 2.3 triangles on the average
    double wanted = sqrt(2.3 * area / 300000);
    return fmax(fmin(fmax(wanted, 0.3 * least), 0.6 * least), 0.02);
}
