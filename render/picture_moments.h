// The picture of a run: vessel and tool at its end, or several moments side by side.
#ifndef SELDINGER_RENDER_PICTURE_MOMENTS_H
#define SELDINGER_RENDER_PICTURE_MOMENTS_H

#include "sim/sim.h"

// Returns false with a fault if no picture can be drawn; this does not make the run fail.
bool picture_moments(const char *path, const char *title, const Scene *scene, OpenVessel *open, const Moments *moments, Faults *faults);

#endif
