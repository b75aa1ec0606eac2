// Builds the contact rows, sorted along the chain, with the stiffness of their nodes.
#include "solver/contact_rows.h"

static Sym3 block_at(const double *d, int n) { return (Sym3){d[0], d[n], d[2 * n], d[n + 1], d[2 * n + 1], d[2 * n + 2]}; }

// Stiffness at a contact: that of its node, or that of two nodes and their rotations in series, each with its weight.
static void own_stiffness(const BlockChain *chain, ContactRow *c)
{
    SEL_ASSERT(c->node >= 0 && c->node + c->nodes <= chain->count, "a contact is at nodes of the chain");
    double kn = 0, kt = 0, yields = 0, give_n = 0, give_t = 0;
    Vec3 n = c->normal;
    for (int e = 0; e < c->nodes; e++) {
        const int size = chain->size;
        const double *d = chain->diag + (size_t)(size * size) * (size_t)(c->node + e), w = c->weight[e];
        unsigned mask = c->mask[e] = contact_free_dofs(chain, c->node + e);
        Sym3 k = block_at(d, size), turn = block_at(d + 3 * (size + 1), size);
        double normal = sym3_quadratic(&k, n), free = (mask & 1 ? n.x * n.x : 0) + (mask & 2 ? n.y * n.y : 0) + (mask & 4 ? n.z * n.z : 0);
        yields += w * w * free;
        kn += normal;
        kt += (sym3_trace(&k) - normal) / 2;
        double levered = mask >> 3 == 7 ? 3 * vec3_norm2(c->lever[e]) / sym3_trace(&turn) : 0;
        give_n += w * w * free / normal + levered;
        give_t += w * w * 2 / (sym3_trace(&k) - normal) + levered;
    }
    c->stiffness_n = c->nodes == 1 ? kn : 1 / give_n;
    c->stiffness_t = c->nodes == 1 ? kt : 1 / give_t;
    c->inert = !(yields > 1e-8) || !isfinite(c->gap) || !vec3_is_finite(n);
}

// Mean stiffness over the free directions, as for the tangential directions at a wall.
static void slide_stiffness(const BlockChain *chain, double give, ContactRow *c)
{
    SEL_ASSERT(c->node >= 0 && c->node < chain->count && c->slide + 1 < chain->size, "a slide has two unknowns of a node of the chain");
    SEL_ASSERT(give > 0, "the elastic displacement of a slide is positive");
    const size_t n = (size_t)chain->size, at = (size_t)c->slide;
    const double *d = chain->diag + n * n * (size_t)c->node + (n + 1) * at;
    c->mask[0] = (contact_is_free(chain, c->node, c->slide) ? 1u : 0) | (c->radius > 0 && contact_is_free(chain, c->node, c->slide + 1) ? 2u : 0);
    double s = c->mask[0] & 1 ? d[0] : 0, phi = c->mask[0] & 2 ? d[n + 1] / (c->radius * c->radius) : 0;
    c->stiffness_n = c->stiffness_t = (s + phi) / (c->mask[0] == 3 ? 2 : 1);
    c->inert = c->mask[0] == 0 || !(c->bound > 0) || !isfinite(c->bound) || !isfinite(c->radius);
    c->spring = c->inert ? 0 : c->bound / give;
}

// The compliances of both ends add up.
static void pair_stiffness(const BlockChain *chain, ContactRow *c, ContactRow *far)
{
    double give_n = 0, give_t = 0;
    ContactRow *end[2] = {c, far};
    for (int e = 0; e < 2; e++) {
        own_stiffness(chain, end[e]);
        give_n += end[e]->inert ? 0 : 1 / end[e]->stiffness_n;
        give_t += end[e]->inert ? 0 : 1 / end[e]->stiffness_t;
    }
    c->inert &= far->inert;
    c->stiffness_n = 1 / give_n;
    c->stiffness_t = 1 / give_t;
}

static ContactRow pair_end(const ContactPair *p, int e, int stride)
{
    const ContactEnd *end = &p->end[e];
    double sign = e ? -1 : 1;
    ContactRow c = {.node = end->node,
                    .chain_node = end->node,
                    .stride = stride,
                    .nodes = 2,
                    .normal = p->normal,
                    .gap = p->gap,
                    .radius = sign * end->radius,
                    .friction = fmax(0, p->friction)};
    for (int k = 0; k < 2; k++) {
        c.weight[k] = sign * end->weight[k];
        c.lever[k] = vec3_scale(end->lever[k], sign);
    }
    return c;
}

static void insert(ContactRow *row, int k, const ContactRow *c)
{
    for (; k > 0 && (row[k - 1].node > c->node || (row[k - 1].node == c->node && contact_row_place(&row[k - 1]) > contact_row_place(c))); k--)
        row[k] = row[k - 1];
    row[k] = *c;
}

int contact_rows_fill(const ContactSet *set, const BlockChain *chain, bool slides_apart, ContactRow *row, ContactRow *far)
{
    SEL_ASSERT(set->count >= 0 && set->slide_count >= 0 && set->pair_count >= 0, "a set holds contacts, slides and pairs, or none");
    SEL_REQUIRE(set->pair_count == 0 || far, "there is room for the second ends of pairs");
    const Vec3 none = {0, 0, 0};
    int count = set->count, behind = set->count + set->pair_count;
    for (int i = 0; i < set->count; i++) {
        const ContactPoint *p = &set->point[i];
        ContactRow c = {.node = p->node,
                        .chain_node = p->node,
                        .stride = chain->size,
                        .point = i,
                        .nodes = p->is_between && p->node + 1 < chain->count ? 2 : 1,
                        .weight = {1, 0},
                        .normal = p->normal,
                        .gap = p->gap,
                        .radius = p->tool_radius,
                        .friction = fmax(0, p->friction)};
        if (c.nodes == 2)
            for (int e = 0; e < 2; e++) {
                c.weight[e] = e ? p->xi : 1 - p->xi;
                c.lever[e] = p->lever[e];
            }
        own_stiffness(chain, &c);
        if (c.inert)
            c.gap = HUGE_VAL;
        c.force = c.inert || !vec3_is_finite(p->force) ? none : contact_project(&c, p->force);
        insert(row, i, &c);
    }
    for (int i = 0; i < set->slide_count; i++) {
        const ContactSlide *p = &set->slide[i];
        ContactRow c = {.node = p->node,
                        .chain_node = p->node,
                        .stride = chain->size,
                        .slide = p->unknown,
                        .point = i,
                        .nodes = 1,
                        .weight = {1, 0},
                        .normal = {0, 0, 1},
                        .radius = p->radius,
                        .bound = p->bound};
        slide_stiffness(chain, p->give, &c);
        Vec3 force = vec3(c.mask[0] & 1 ? p->force[0] : 0, c.mask[0] & 2 ? p->force[1] : 0, 0);
        c.force = c.inert || !vec3_is_finite(force) ? none : contact_project(&c, force);
        Vec3 held = vec3(c.mask[0] & 1 ? p->held[0] : 0, c.mask[0] & 2 ? p->held[1] : 0, 0);
        c.held = c.inert || !vec3_is_finite(held) ? none : contact_project(&c, held);
        if (slides_apart)
            row[behind++] = c;
        else
            insert(row, count++, &c);
    }
    for (int i = 0; i < set->pair_count; i++) {
        const ContactPair *p = &set->pair[i];
        far[i] = pair_end(p, 1, chain->size);
        ContactRow c = pair_end(p, 0, chain->size);
        c.point = i;
        c.far = &far[i];
        pair_stiffness(chain, &c, &far[i]);
        if (c.inert)
            c.gap = HUGE_VAL;
        c.force = c.inert || !vec3_is_finite(p->force) ? none : contact_project(&c, p->force);
        row[count + i] = c;
    }
    return count + set->pair_count;
}
