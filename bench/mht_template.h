// The vessel template of Friman et al. 2010 (Medical Image Analysis 14, section 2) and its fit: a bright tube on a darker background,
// I(x) = k T(x) + m, T = r^8 / (d^8 + r^8) with d the distance from the axis, so that T is 1/2 on the wall. Lengths mm in the volume's frame.
//
// The fit is weighted least squares over the voxels of a window about the template: weights are a Gaussian of the distance from the window's
// middle, half as long along the vessel as across it, cut where they fall below a tenth. The score is the t statistic of k.
#ifndef SELDINGER_BENCH_MHT_TEMPLATE_H
#define SELDINGER_BENCH_MHT_TEMPLATE_H

#include "recon/volume/volume.h"

typedef struct MhtTemplate {
    Vec3 center, axis;       // axis: unit
    double radius;           // [mm]
    double contrast, background;   // k and m, in the volume's units
    double score;            // t of k; assumes independent noise of the voxels
} MhtTemplate;

// Voxels with their weights, as arrays for vector units. Memory is reused from window to window; one owner.
typedef struct MhtWindow MhtWindow;
MhtWindow *mht_window_create(void);   // NULL if out of memory
void mht_window_free(MhtWindow *window);
// Collects the voxels around a template, with weights exp(-x^2 / sigma^2), sigma = `size` * radius across it. If there are more than about 12,000, only every
// second, third … voxel along each axis is used, and the score is the t statistic of these. Voxels outside the volume are left out. Returns the number of
// voxels; a fit needs at least 32.
int mht_window_open(MhtWindow *window, const Volume *volume, const MhtTemplate *about, double size);

// Least squares for contrast and background only, and the score (0 if they are not defined).
void mht_template_score(const MhtWindow *window, MhtTemplate *template);

typedef struct MhtLimits {
    double radius_min, radius_max;   // [mm]
    const MhtTemplate *previous;     // the distance between both centres is fixed, the angle between the axes at most max_angle; NULL: free
    double max_angle;        // [rad]
} MhtLimits;
// Least squares for all parameters, by Levenberg-Marquardt with analytic derivatives; the centre moves only across the axis. Computes the score at the end.
void mht_template_fit(const MhtWindow *window, MhtTemplate *template, const MhtLimits *limits);
// The sum of the weighted squares, [volume's units^2], and its gradient for the template's (log r, centre along e1 and e2 in radii, axis tilted towards e1
// and e2), with e1 = vec3_normal_to(axis), e2 = axis x e1 with its contrast and background held: for tests.
double mht_template_cost(const MhtWindow *window, const MhtTemplate *template, double gradient[5]);

#endif
