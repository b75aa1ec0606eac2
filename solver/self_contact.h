// A tool does not pass through itself: places of the chain that lie far apart along it and touch, as pairs of the contact solve (contact.h).
// Internal to solver. Nothing allocates but create.
#ifndef SELDINGER_SOLVER_SELF_CONTACT_H
#define SELDINGER_SOLVER_SELF_CONTACT_H

#include "solver/step_internal.h"

// Room for it in a stepper whose wire and solver are made: s->self. False: no memory.
bool self_contact_create(Stepper *s);
void self_contact_destroy(SelfContact *self);

// All of these do nothing where s->self is NULL.
// Pairs that are near at the iterate; those that this step may close become s->system.set.pair.
void self_contact_detect(Stepper *s);
// Does the solution close pairs that are not in the set? They are looked for that far, and in it now.
bool self_contact_misses(Stepper *s);
bool self_contact_is_near(const Stepper *s);
// How deep strands would be in each other [mm], >= 0, at the iterate or (would_go) where the solution has them; through each other counts as all the way.
double self_contact_depth(Stepper *s, bool would_go);
// Like stepper_meet_walls().
bool self_contact_meet(Stepper *s, double part);
void self_contact_keep_forces(Stepper *s);
// What has been travelled since the last look is taken off what is known to be free.
void self_contact_use_clearance(Stepper *s);
void self_contact_forget(Stepper *s);
// [mJ] of the pairs: the work of pressure is added to `wall`, what friction took to `friction`.
void self_contact_work(const Stepper *s, double *wall, double *friction);

// What the next step depends on.
size_t self_contact_bytes(const Stepper *s);
void self_contact_save(const Stepper *s, void *to);
void self_contact_restore(Stepper *s, const void *from);
// Numbers of the state that are not there where nothing touches: their count, and each.
int self_contact_numbers(const Stepper *s);
double self_contact_number(const Stepper *s, int k);

#endif
