// The synthetic experiment of Kerrien et al. 2017, section 5.3.2: one local model fitted to 300 noisy points of a known surface (Table 3).
//
// The shapes are in millimetres (the paper says centimetres, but 5 to 15 blobs cannot cover 40 mm). They are convolution surfaces of a skeleton with
// the model's own kernel, one primitive about every millimetre, as the paper builds its capsule of section 6.3.1; radius 1 mm at the midpoint:
//   capsule        segment of 4 mm
//   open-capsule   the same without the points beyond the segment's ends
//   arc            half circle of 4 mm radius
//   bifurcation two quarter arcs of 4 mm radius that start in the same direction and diverge to both sides
// Points are spread evenly (farthest point sampling of a pool on the surface) instead of by the paper's particles; noise moves them along the normal.
// The measure d is the 90th percentile of the distance of the noise-free points to the model, by projection. The paper describes the distance to the nearest
// of 1000 samples of the model; that cannot be less than about half their spacing of 0.2 mm, so its 0.04 must have been measured differently.
#ifndef SELDINGER_BENCH_LIM_TRIAL_H
#define SELDINGER_BENCH_LIM_TRIAL_H

#include "recon/fit/lim_fit.h"

#include <stdint.h>

enum { LIM_TRIAL_SHAPES = 4, LIM_TRIAL_POINTS = 300 };
extern const char *const lim_trial_name[LIM_TRIAL_SHAPES];

typedef struct LimTrialShape LimTrialShape;
// NULL if out of memory. 0 <= shape < LIM_TRIAL_SHAPES.
LimTrialShape *lim_trial_create(int shape);
void lim_trial_free(LimTrialShape *shape);

typedef struct LimTrial {
    double d, d_approximate; // 90th percentile of the true and of Taubin's distance of the noise-free points to the model [mm]
    double bias;             // mean signed distance of them, > 0: the model is too wide [mm]
    double worst;            // largest distance of a noisy point [mm]
    bool met;                // worst <= t_g
    int blobs;               // N_b
    double cpu_s;
    // The result of least squares (linearised, the same noise) in two families of surfaces that contain the truth, started at the truth: d = p90 |H e|
    double d_shape;          // the 8 to 11 parameters of the skeleton: position, rotation, size; a bound for any method that must find the shape
    double d_blobs;          // the blobs of the truth, all free: the error of N_b free blobs without regularisation
} LimTrial;

// One fit. options->target_mm is set to 3 sigma. The same seed gives the same points and noise. False if out of memory.
bool lim_trial_run(const LimTrialShape *shape, double sigma, uint64_t seed, const LimFitOptions *options, LimTrial *out);

#endif
