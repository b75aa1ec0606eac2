// Self-contact of the tool: points that are far apart along the chain and touch enter the contact solve as pairs (contact.h).
// Internal to solver. Only the create function allocates.
#ifndef SELDINGER_SOLVER_SELF_CONTACT_H
#define SELDINGER_SOLVER_SELF_CONTACT_H

#include "solver/step_internal.h"

// Creates s->self of a stepper whose wire and contact solver exist. Returns false if out of memory.
bool self_contact_create(Stepper *s);
void self_contact_destroy(SelfContact *self);

// All functions below do nothing if s->self is NULL.
// Finds the pairs that are close at the iterate; those that may close in this step become s->system.set.pair.
void self_contact_detect(Stepper *s);
// Whether the solution closes pairs that are not in the contact set. If so, the search range is increased and these pairs are added.
bool self_contact_misses(Stepper *s);
bool self_contact_is_near(const Stepper *s);
// Depth of mutual penetration of strands [mm], >= 0, at the iterate or, if would_go, at the solution. Strands that have crossed count with the whole distance
// back.
double self_contact_depth(Stepper *s, bool would_go);
// Counterpart of stepper_meet_walls() for the pairs.
bool self_contact_meet(Stepper *s, double part);
void self_contact_keep_forces(Stepper *s);
// Reduces the known clearances by the motion since the last search.
void self_contact_use_clearance(Stepper *s);
void self_contact_forget(Stepper *s);
// Work of the pairs [mJ]: adds that of pressure to `wall` and the energy dissipated by friction to `friction`.
void self_contact_work(const Stepper *s, double *wall, double *friction);

// State on which the next step depends, for checkpoints.
size_t self_contact_bytes(const Stepper *s);
void self_contact_save(const Stepper *s, void *to);
void self_contact_restore(Stepper *s, const void *from);
// State variables that exist only while strands touch: their number, and the k-th one.
int self_contact_numbers(const Stepper *s);
double self_contact_number(const Stepper *s, int k);

#endif
