// Checkpoints hold everything on which the next step depends: a restored run repeats bit for bit.
// The hash is FNV-1a by 8-byte words in four lanes, with a shift that mixes high bits into low ones; hashing by bytes would take 100 us.
#include "solver/self_contact.h"
#include "base/base.h"
#include "solver/tools_internal.h"

#include <stdlib.h>
#include <string.h>

struct Checkpoint {
    int point_capacity, point_count, first_free;
    int first[STEP_TOOLS_MAX], inside[STEP_TOOLS_MAX], fitted[STEP_TOOLS_MAX];
    double tool_inserted[STEP_TOOLS_MAX], tool_twist[STEP_TOOLS_MAX];
    size_t memory_count;
    double time, inserted, twist;
    StepReport report;
    Rest rest;
    double hand_force[STEP_TOOLS_MAX][2];
    VesselMemory *place;
    double *memory;
    size_t self_bytes;
    void *self;
};

void checkpoint_free(Checkpoint *c)
{
    if (!c)
        return;
    free(c->place);
    free(c->memory);
    free(c->rest.moved);
    free(c->self);
    free(c);
}

static void copy_rest(Rest *to, const Rest *from)
{
    double *moved = to->moved;
    memcpy(moved, from->moved, from->rows * sizeof *moved);
    *to = *from;
    to->moved = moved;
}

Checkpoint *stepper_save(const Stepper *s, Checkpoint *reuse)
{
    Checkpoint *c = reuse;
    if (c && (c->memory_count != s->memory_count || c->point_capacity != s->points.capacity || c->self_bytes != self_contact_bytes(s))) {
        checkpoint_free(c);
        c = NULL;
    }
    if (!c) {
        c = calloc(1, sizeof *c);
        if (!c)
            return NULL;
        c->point_capacity = s->points.capacity;
        c->memory_count = s->memory_count;
        c->place = calloc((size_t)c->point_capacity, sizeof *c->place);
        c->memory = calloc(c->memory_count, sizeof *c->memory);
        c->self_bytes = self_contact_bytes(s);
        c->self = malloc(c->self_bytes + 1);
        c->rest.moved = calloc(s->rest.rows, sizeof *c->rest.moved);
        if (!c->place || !c->memory || !c->self || !c->rest.moved) {
            checkpoint_free(c);
            return NULL;
        }
    }
    c->first_free = s->first_free;
    c->time = s->state.time;
    c->inserted = s->state.inserted;
    c->twist = s->state.twist;
    c->report = s->report;
    copy_rest(&c->rest, &s->rest);
    for (int k = 0; k < s->tools.count; k++)
        memcpy(c->hand_force[k], s->hands.hand[k].force, sizeof c->hand_force[k]);
    for (int k = 0; s->tools.count > 1 && k < s->tools.count; k++) {
        c->first[k] = s->tools.tool[k].first;
        c->fitted[k] = s->tools.fitted[k];
        c->inside[k] = s->tools.tool[k].inside;
        c->tool_inserted[k] = s->tools.tool[k].inserted;
        c->tool_twist[k] = s->tools.tool[k].twist;
    }
    SEL_REQUIRE(s->points.count <= c->point_capacity, "a checkpoint has room for all contact points");
    // what lies behind the points that exist is not read before it is written: pages that are never touched take no memory
    c->point_count = s->points.count;
    memcpy(c->place, s->points.place, (size_t)c->point_count * sizeof *c->place);
    memcpy(c->memory, s->memory, c->memory_count * sizeof *c->memory);
    self_contact_save(s, c->self);
    return c;
}

void stepper_restore(Stepper *s, const Checkpoint *c)
{
    SEL_ASSERT(c->first_free >= 0, "a checkpoint holds a state");
    if (c->memory_count != s->memory_count || c->point_capacity != s->points.capacity || c->self_bytes != self_contact_bytes(s))
        return;
    s->first_free = c->first_free;
    s->state.time = c->time;
    s->state.inserted = c->inserted;
    s->state.twist = c->twist;
    s->report = c->report;
    copy_rest(&s->rest, &c->rest);
    for (int k = 0; k < s->tools.count; k++)
        memcpy(s->hands.hand[k].force, c->hand_force[k], sizeof c->hand_force[k]);
    tools_refit(s, c->fitted);
    for (int k = 0; s->tools.count > 1 && k < s->tools.count; k++) {
        s->tools.tool[k].first = c->first[k];
        s->tools.tool[k].inserted = c->tool_inserted[k];
        s->tools.tool[k].twist = c->tool_twist[k];
    }
    if (s->tools.count > 1)
        tools_chain(s);
    for (int k = 1; k < s->tools.count; k++)
        s->tools.tool[k].inside = c->inside[k];
    SEL_REQUIRE(s->points.count == c->point_count, "a restored chain has the points of its checkpoint");
    memcpy(s->points.place, c->place, (size_t)c->point_count * sizeof *c->place);
    memcpy(s->memory, c->memory, c->memory_count * sizeof *c->memory);
    self_contact_restore(s, c->self);
    SEL_ASSERT(s->first_free <= s->state.node_count, "the sheath holds nodes of the chain");
}

typedef struct Hash {
    uint64_t lane[4];
    size_t next;
} Hash;

static void hash_double(Hash *hash, double value)
{
    uint64_t word, *lane = &hash->lane[hash->next++ % 4];
    memcpy(&word, &value, sizeof word);
    *lane = (*lane ^ word) * UINT64_C(0x100000001b3);
    *lane ^= *lane >> 29;
}

uint64_t stepper_hash(const Stepper *s)
{
    const uint64_t basis = UINT64_C(0xcbf29ce484222325);
    Hash hash = {.lane = {basis, basis + 1, basis + 2, basis + 3}};
    hash_double(&hash, s->state.time);
    hash_double(&hash, s->state.inserted);
    hash_double(&hash, s->state.twist);
    hash_double(&hash, s->first_free);
    for (int k = 0; k < s->tools.count && s->tools.spare_count[k] > 0; k++)
        hash_double(&hash, s->tools.fitted[k]);
    for (int k = 1; k < s->tools.count; k++) {
        hash_double(&hash, s->tools.tool[k].first);
        hash_double(&hash, s->tools.tool[k].inside);
        hash_double(&hash, s->tools.tool[k].inserted);
        hash_double(&hash, s->tools.tool[k].twist);
    }
    for (size_t i = 0; i < s->memory_count; i++)
        hash_double(&hash, s->memory[i]);
    // field by field, because padding is indeterminate
    for (int i = 0; i < s->points.count; i++) {
        const VesselMemory *p = &s->points.place[i];
        hash_double(&hash, p->node);
        hash_double(&hash, p->has_foot);
        hash_double(&hash, p->has_foot ? p->foot.x : 0);
        hash_double(&hash, p->has_foot ? p->foot.y : 0);
        hash_double(&hash, p->has_foot ? p->foot.z : 0);
    }
    for (int i = 0; i < self_contact_numbers(s); i++)
        hash_double(&hash, self_contact_number(s, i));
    uint64_t result = basis;
    for (int k = 0; k < 4; k++) {
        result = (result ^ hash.lane[k]) * UINT64_C(0x100000001b3);
        result ^= result >> 29;
    }
    return result;
}
