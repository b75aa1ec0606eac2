// The linear systems of the swept model's fit: rows of all branches from linearised distances of wall points, with penalties. Internal to recon.
//
// Minimises sum w (e + J x)^2 / s^2 + sum_g l_g (c + x)' S_g (c + x): c the rows, x their step, e [mm] the points' distances from the wall, w their trust,
// s the noise. The penalties S_g, each for one harmonic k: integrals of r c_k''^2 along tubes, the same at forks, and of c_k^2 / r^3 for k > 0. Each l_g is the
// inverse variance of what it penalises, found with the noise by restricted maximum likelihood over all branches (Wood and Fasiolo 2017):
//   l_g <- l_g (tr(S^- S_g) - tr(V^-1 S_g)) / (c' S_g c),   S = sum l_g S_g,   V = J' w J / s^2 + S.
#ifndef SELDINGER_RECON_FIT_SWEEP_ROWS_H
#define SELDINGER_RECON_FIT_SWEEP_ROWS_H

#include "recon/fit/sweep_draft.h"

enum { ROUGH_TUBE, ROUGH_FORK, SIZE, PENALTIES };

typedef struct SweepSight {  // how a point's distance depends on four rows of a branch
    int branch, first;       // the first row, counted from the branch's first
    double weight[4];        // of the rows
    double zeta[2];          // angle: powers of it are the terms' factors
    double share;            // derivative of the distance by the section there
} SweepSight;

typedef struct SweepSystem {
    const SweepDraft *draft;
    int64_t count;           // points and guards
    double *distance;        // (count) [mm]
    double *trust;           // (count) 0 … 1
    int64_t *first;          // (count + 1)
    SweepSight *sight;       // (first[count])
    double noise;            // [mm]
    double strength[PENALTIES][SWEEP_HARMONICS + 1];
    double freedom;          // number of effectively free coefficients, as sweep_system_tune found it

    int64_t *order_first;    // (branches + 1): sights by branch and first row …
    int64_t *order;          // … and the points that they belong to
    int64_t *order_point;
    double **matrix;         // (branches) J' w J as a band, see band_matrix.h
    double **slope;          // (branches) J' w e
    bool failed;
} SweepSystem;

// For the draft's points and guards.
bool sweep_system_create(SweepSystem *system, const SweepDraft *draft);
// Resets the strengths at forks: what sections alone find there is the misfit of tubes to a fork.
void sweep_system_soften_forks(SweepSystem *system);
void sweep_system_free(SweepSystem *system);
// Makes room for `sights`. Returns false if out of memory.
bool sweep_system_reserve(SweepSystem *system, int64_t sights);
// Sums matrices and slopes from distances, trusts and sights. Returns false if out of memory.
bool sweep_system_sum(SweepSystem *system);
// One iteration of noise and strengths, from the model's rows. Returns false if out of memory.
bool sweep_system_tune(SweepSystem *system);
// Adds the step to the model's rows. `coupled`: points that depend on several branches couple these; else the distances are linear, and the slopes are brought
// up to date. Returns false if out of memory.
bool sweep_system_step(SweepSystem *system, bool coupled);

#endif
