// See edit_mesh.h. A vertex lies on the ray from the curve at angle theta: first on the branch's own wall, R(theta, t); then Newton along the ray for the blended
// field F, which is larger, outwards by at most the blend's width.
#include "render/edit_mesh.h"

#include <stdlib.h>
#include <string.h>

enum { AROUND = 20, DOME_RINGS = 3 };
static const double PITCH = 0.4;     // of rings, in mean radii of the branch

// --- rings ---

static int rings_of(const SweepField *field, int branch)
{
    enum { MOST = 20000 };
    double spans = ceil(field->curve[branch]->length / (PITCH * field->model->branch[branch].radius));
    return (int)fmax(2, fmin(MOST, spans)) + 1 + DOME_RINGS + (field->model->branch[branch].open_start ? 0 : DOME_RINGS);
}

static void place_rings(const SweepField *field, EditMesh *m)
{
    int at = 0;
    for (int i = 0; i < field->branch_count; i++) {
        bool open = field->model->branch[i].open_start;
        int count = rings_of(field, i), before = open ? 0 : DOME_RINGS, sections = count - DOME_RINGS - before;
        double length = field->curve[i]->length;
        for (int k = 0; k < count; k++, at++) {
            EditRing *r = &m->ring[at];
            int section = k - before;
            *r = (EditRing){.branch = i, .first = at * AROUND, .t = length * fmax(0, fmin(1, (double)section / (sections - 1)))};
            if (section < 0)
                r->polar = -section * 0.5 * PI / DOME_RINGS;
            else if (section >= sections)
                r->polar = (section - sections + 1) * 0.5 * PI / DOME_RINGS;
        }
    }
}

// Moves x along a direction onto F = 0, outwards by at most `most`. Leaves it where it is if the wall is not there.
static Vec3 onto_wall(const SweepField *field, SweepPlace place, Vec3 x, Vec3 way, double most, Vec3 *normal)
{
    SweepBlend b;
    double moved = 0;
    for (int round = 0; round < 6; round++) {
        sweep_field_blend(field, place, vec3_add_scaled(x, moved, way), &b);
        double slope = -vec3_dot(b.gradient, way);
        if (!(slope > 0.1) || !isfinite(b.f))
            break;
        moved = fmax(0, moved + b.f / slope);
        if (fabs(b.f) < 1e-4 || moved > most)
            break;
    }
    *normal = vec3_unit_or(vec3_negate(b.gradient), way);
    return moved <= most ? vec3_add_scaled(x, moved, way) : x;
}

static void make_ring(const SweepField *field, EditMesh *m, const EditRing *r)
{
    bool far = r->t > 0.5 * field->curve[r->branch]->length;
    double term[SWEEP_TERMS], out = r->polar > 0 ? same_sin(r->polar) : 0, flat = r->polar > 0 ? same_cos(r->polar) : 1;
    SweepJet j = sweep_curve_at(field->curve[r->branch], r->t);
    Vec3 ahead = vec3_scale(vec3_unit(j.s1), far ? 1 : -1);
    sweep_edit_terms(field->model, r->branch, r->t, term);
    for (int i = 0; i < AROUND; i++) {
        double theta = 2 * PI * i / AROUND, radius = term[0], power = flat;
        for (int k = 1; k <= SWEEP_HARMONICS; k++, power *= flat)
            radius += power * (term[2 * k - 1] * same_cos(k * theta) + term[2 * k] * same_sin(k * theta));
        Vec3 across = vec3_add_scaled(vec3_scale(j.n, same_cos(theta)), same_sin(theta), j.b);
        Vec3 way = vec3_add_scaled(vec3_scale(across, flat), out, ahead), x = vec3_add_scaled(j.s, radius, way);
        int vertex = r->first + i;
        const SweepPlace place = {.branch = r->branch, .t = r->t, .sac = -1};
        m->surface->vertex[vertex] = onto_wall(field, place, x, way, 0.5 * radius, &m->surface->normal[vertex]);
        m->surface->node[vertex] = 0;
        m->branch[vertex] = r->branch, m->along[vertex] = r->t;
    }
}

// --- the mesh ---

// The sacs' part of the closed mesh.
static SweepMesh *sacs_of(const SweepField *field, int *triangles)
{
    SweepMesh *all = field->model->sac ? sweep_mesh_create(field, NULL) : NULL;
    *triangles = 0;
    for (int i = 0; all && i < all->surface->triangle_count; i++) {
        const int *t = all->surface->triangle[i];
        *triangles += all->branch[t[0]] < 0 || all->branch[t[1]] < 0 || all->branch[t[2]] < 0;
    }
    return all;
}

static void add_sacs(const SweepMesh *sacs, EditMesh *m, int vertex, int triangle)
{
    const TriangleMesh *from = sacs->surface;
    for (int i = 0; i < from->triangle_count; i++) {
        const int *t = from->triangle[i];
        if (sacs->branch[t[0]] >= 0 && sacs->branch[t[1]] >= 0 && sacs->branch[t[2]] >= 0)
            continue;
        for (int k = 0; k < 3; k++, vertex++) {
            m->surface->vertex[vertex] = from->vertex[t[k]], m->surface->normal[vertex] = from->normal[t[k]];
            m->branch[vertex] = sacs->branch[t[k]], m->along[vertex] = sacs->along[t[k]];
            m->surface->triangle[triangle][k] = vertex;
        }
        triangle++;
    }
}

static int add_strips(EditMesh *m)
{
    int count = 0;
    for (int r = 0; r + 1 < m->ring_count; r++) {
        if (m->ring[r].branch != m->ring[r + 1].branch)
            continue;
        for (int i = 0; i < AROUND; i++) {
            int a = m->ring[r].first + i, b = m->ring[r].first + (i + 1) % AROUND, c = m->ring[r + 1].first + i, d = m->ring[r + 1].first + (i + 1) % AROUND;
            const int corner[2][3] = {{a, b, c}, {b, d, c}};
            memcpy(m->surface->triangle[count], corner, sizeof corner);
            count += 2;
        }
    }
    return count;
}

EditMesh *edit_mesh_create(const SweepField *field)
{
    int rings = 0, sac_triangles;
    for (int i = 0; i < field->branch_count; i++)
        rings += rings_of(field, i);
    SweepMesh *sacs = sacs_of(field, &sac_triangles);
    size_t vertices = (size_t)rings * AROUND + 3 * (size_t)sac_triangles, triangles = 2 * (size_t)rings * AROUND + (size_t)sac_triangles;
    EditMesh *m = calloc(1, sizeof *m);
    TriangleMesh *surface = calloc(1, sizeof *surface);
    if (m && surface) {
        m->surface = surface;
        m->ring = calloc((size_t)rings, sizeof *m->ring);
        m->branch = calloc(vertices, sizeof *m->branch);
        m->along = calloc(vertices, sizeof *m->along);
        surface->vertex = calloc(vertices, sizeof *surface->vertex);
        surface->normal = calloc(vertices, sizeof *surface->normal);
        surface->node = calloc(vertices, sizeof *surface->node);
        surface->triangle = calloc(triangles, sizeof *surface->triangle);
    } else {
        free(surface);
    }
    if (!m || !m->ring || !m->branch || !m->along || !surface->vertex || !surface->normal || !surface->node || !surface->triangle) {
        sweep_mesh_free(sacs);
        edit_mesh_free(m);
        return NULL;
    }
    m->ring_count = m->made = rings;
    place_rings(field, m);
    for (int i = 0; i < rings; i++)
        make_ring(field, m, &m->ring[i]);
    int strips = add_strips(m);
    if (sacs)
        add_sacs(sacs, m, rings * AROUND, strips);
    surface->vertex_count = (int)vertices;
    surface->triangle_count = strips + sac_triangles;
    sweep_mesh_free(sacs);
    return m;
}

// Whether the rings of the field would lie where those of the mesh do.
static bool has_same_rings(const EditMesh *m, const SweepField *field)
{
    int at = 0;
    for (int i = 0; i < field->branch_count; i++) {
        int count = rings_of(field, i);
        if (at + count > m->ring_count || m->ring[at].branch != i || m->ring[at + count - 1].branch != i ||
            m->ring[at + count - 1].t != field->curve[i]->length)
            return false;
        at += count;
    }
    return at == m->ring_count;
}

bool edit_mesh_update(EditMesh *m, const SweepField *field, Vec3 low, Vec3 high)
{
    if (!has_same_rings(m, field))
        return false;
    m->made = 0;
    for (int i = 0; i < m->ring_count; i++) {
        EditRing *r = &m->ring[i];
        Vec3 x = sweep_curve_at(field->curve[r->branch], r->t).s;
        double reach = 1.5 * sweep_field_largest(field, r->branch, r->t);
        if (x.x + reach < low.x || x.y + reach < low.y || x.z + reach < low.z || x.x - reach > high.x || x.y - reach > high.y || x.z - reach > high.z)
            continue;
        make_ring(field, m, r);
        m->made++;
    }
    return true;
}

void edit_mesh_free(EditMesh *m)
{
    if (!m)
        return;
    if (m->surface)
        triangle_mesh_free(m->surface);
    free(m->branch);
    free(m->along);
    free(m->ring);
    free(m);
}
