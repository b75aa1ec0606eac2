// The picture of a run: vessel and tool at its end, or moments of it side by side.
#ifndef SELDINGER_RENDER_PICTURE_MOMENTS_H
#define SELDINGER_RENDER_PICTURE_MOMENTS_H

#include "sim/sim.h"

// False with a fault where there is none, the run being as good as it was.
bool picture_moments(const char *path, const char *title, const Scene *scene, OpenVessel *open, const Moments *moments, Faults *faults);

#endif
