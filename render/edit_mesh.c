// See edit_mesh.h. A vertex lies on the ray from the curve at angle theta: first on the branch's own wall, R(theta, t); then Newton along the ray for the blended
// field F, which is larger, outwards by at most the blend's width. Within a stretch it lies on the section's contour and moves across that.
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
        m->of[i] = (struct EditMeshBranch){at, count, sweep_curve_at(field->curve[i], 0).s, sweep_curve_at(field->curve[i], length).s};
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

// Moves x along a direction onto F = 0, outwards by at most `most`, inwards by at most -`least`. Leaves it where it is if the wall is not there.
static Vec3 onto_wall(const SweepField *field, SweepPlace place, Vec3 x, Vec3 way, double least, double most, Vec3 *normal)
{
    SweepBlend b;
    double moved = 0;
    for (int round = 0; round < 6; round++) {
        sweep_field_blend(field, place, vec3_add_scaled(x, moved, way), &b);
        double slope = -vec3_dot(b.gradient, way);
        if (!(slope > 0.1) || !isfinite(b.f))
            break;
        moved = fmax(least, moved + b.f / slope);
        if (fabs(b.f) < 1e-4 || moved > most)
            break;
    }
    *normal = vec3_unit_or(vec3_negate(b.gradient), way);
    return moved <= most ? vec3_add_scaled(x, moved, way) : x;
}

// Within a stretch: points at equal distances along the contour. False outside of stretches, or if the section has no closed contour.
static bool make_shaped_ring(const SweepField *field, EditMesh *m, const EditRing *r)
{
    SweepContour contour;
    if (r->polar > 0 || !sweep_stretch_at(field->model, r->branch, r->t) || !sweep_contour_create(field, r->branch, r->t, 4 * AROUND, &contour))
        return false;
    SectionPoint point[AROUND], along[AROUND];
    SweepPlane plane = sweep_plane(field, r->branch, r->t);
    const SweepPlace place = {.branch = r->branch, .t = r->t, .sac = -1};
    double most = 0.5 * sweep_field_mean(field, r->branch, r->t);
    sweep_contour_sample(&contour, AROUND, point, along);
    sweep_contour_free(&contour);
    for (int i = 0; i < AROUND; i++) {
        int vertex = r->first + i;
        Vec3 x = vec3_add_scaled(vec3_add_scaled(plane.s, point[i].n, plane.p), point[i].b, plane.q);
        Vec3 way = vec3_unit(vec3_add_scaled(vec3_scale(plane.p, along[i].b), -along[i].n, plane.q));
        m->surface->vertex[vertex] = onto_wall(field, place, x, way, -0.05 * most, most, &m->surface->normal[vertex]);
        m->surface->node[vertex] = 0;
        m->branch[vertex] = r->branch, m->along[vertex] = r->t;
    }
    return true;
}

static void make_ring(const SweepField *field, EditMesh *m, const EditRing *r)
{
    if (make_shaped_ring(field, m, r))
        return;
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
        m->surface->vertex[vertex] = onto_wall(field, place, x, way, 0, 0.5 * radius, &m->surface->normal[vertex]);
        m->surface->node[vertex] = 0;
        m->branch[vertex] = r->branch, m->along[vertex] = r->t;
    }
}

// --- the mesh ---

// The sacs' part of the closed mesh: three vertices a triangle. Returns the number of triangles; the caller frees the mesh.
static int find_sacs(const SweepField *field, SweepMesh **all)
{
    int triangles = 0;
    *all = field->model->sac ? sweep_mesh_create(field, NULL) : NULL;
    for (int i = 0; *all && i < (*all)->surface->triangle_count; i++) {
        const int *t = (*all)->surface->triangle[i];
        triangles += (*all)->branch[t[0]] < 0 || (*all)->branch[t[1]] < 0 || (*all)->branch[t[2]] < 0;
    }
    return triangles;
}

static void add_sacs(const SweepMesh *sacs, EditMesh *m, int vertex)
{
    const TriangleMesh *from = sacs->surface;
    for (int i = 0; i < from->triangle_count; i++) {
        const int *t = from->triangle[i];
        if (sacs->branch[t[0]] >= 0 && sacs->branch[t[1]] >= 0 && sacs->branch[t[2]] >= 0)
            continue;
        for (int k = 0; k < 3; k++, vertex++)
            m->surface->vertex[vertex] = from->vertex[t[k]], m->surface->normal[vertex] = from->normal[t[k]];
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

static EditMesh *allocate(int branches, int rings, int sac_triangles)
{
    size_t vertices = (size_t)rings * AROUND + 3 * (size_t)sac_triangles, triangles = 2 * (size_t)rings * AROUND + (size_t)sac_triangles;
    EditMesh *m = calloc(1, sizeof *m);
    TriangleMesh *surface = calloc(1, sizeof *surface);
    if (m && surface) {
        *m = (EditMesh){.surface = surface, .ring_count = rings, .branch_count = branches, .sac_triangles = sac_triangles};
        m->ring = calloc((size_t)rings, sizeof *m->ring);
        m->of = calloc((size_t)branches, sizeof *m->of);
        m->branch = calloc(vertices, sizeof *m->branch);
        m->along = calloc(vertices, sizeof *m->along);
        surface->vertex = calloc(vertices, sizeof *surface->vertex);
        surface->normal = calloc(vertices, sizeof *surface->normal);
        surface->node = calloc(vertices, sizeof *surface->node);
        surface->triangle = calloc(triangles, sizeof *surface->triangle);
        surface->vertex_count = (int)vertices;
    } else {
        free(surface);
    }
    if (m && m->ring && m->of && m->branch && m->along && surface->vertex && surface->normal && surface->node && surface->triangle)
        return m;
    edit_mesh_free(m);
    return NULL;
}

static bool is_apart(const SweepField *field, const EditRing *r, Vec3 low, Vec3 high)
{
    Vec3 x = sweep_curve_at(field->curve[r->branch], r->t).s;
    double reach = 1.5 * sweep_field_largest(field, r->branch, r->t);
    return x.x + reach < low.x || x.y + reach < low.y || x.z + reach < low.z || x.x - reach > high.x || x.y - reach > high.y || x.z - reach > high.z;
}

// The old mesh's branch with the same rings; NULL if there is none.
static const struct EditMeshBranch *known(const EditMesh *old, const struct EditMeshBranch *b)
{
    for (int i = 0; old && i < old->branch_count; i++)
        if (old->of[i].ring_count == b->ring_count && vec3_distance(old->of[i].start, b->start) == 0 && vec3_distance(old->of[i].end, b->end) == 0)
            return &old->of[i];
    return NULL;
}

static void make_branch(const SweepField *field, const EditMesh *old, Vec3 low, Vec3 high, EditMesh *m, int branch)
{
    const struct EditMeshBranch *b = &m->of[branch], *same = known(old, b);
    for (int i = 0; i < b->ring_count; i++) {
        const EditRing *r = &m->ring[b->first_ring + i];
        if (!same || !is_apart(field, r, low, high)) {
            make_ring(field, m, r);
            m->made++;
            continue;
        }
        int from = old->ring[same->first_ring + i].first;
        memcpy(m->surface->vertex + r->first, old->surface->vertex + from, AROUND * sizeof *m->surface->vertex);
        memcpy(m->surface->normal + r->first, old->surface->normal + from, AROUND * sizeof *m->surface->normal);
        for (int k = 0; k < AROUND; k++)
            m->branch[r->first + k] = branch, m->along[r->first + k] = r->t;
    }
}

EditMesh *edit_mesh_create(const SweepField *field, const EditMesh *old, Vec3 low, Vec3 high)
{
    int rings = 0;
    for (int i = 0; i < field->branch_count; i++)
        rings += rings_of(field, i);
    SweepMesh *sacs = NULL;
    int sac_triangles = old ? old->sac_triangles : find_sacs(field, &sacs);
    EditMesh *m = allocate(field->branch_count, rings, sac_triangles);
    if (!m) {
        sweep_mesh_free(sacs);
        return NULL;
    }
    place_rings(field, m);
    for (int i = 0; i < field->branch_count; i++)
        make_branch(field, old, low, high, m, i);
    int strips = add_strips(m), first = rings * AROUND;
    if (sacs)
        add_sacs(sacs, m, first);
    for (int i = 0; old && i < 3 * sac_triangles; i++) {
        int from = old->ring_count * AROUND + i;
        m->surface->vertex[first + i] = old->surface->vertex[from], m->surface->normal[first + i] = old->surface->normal[from];
    }
    for (int i = 0; i < 3 * sac_triangles; i++)
        m->branch[first + i] = -1, m->surface->triangle[strips + i / 3][i % 3] = first + i;
    m->surface->triangle_count = strips + sac_triangles;
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
        const EditRing *r = &m->ring[i];
        if (is_apart(field, r, low, high))
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
    free(m->of);
    free(m);
}
