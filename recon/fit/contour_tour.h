// A closed contour through loose points of a plane, whatever its shape. Internal to recon.
#ifndef SELDINGER_RECON_FIT_CONTOUR_TOUR_H
#define SELDINGER_RECON_FIT_CONTOUR_TOUR_H

#include "geom/geom.h"

enum { CONTOUR_TOUR_MOST = 128 };

// Points nearer to each other than about `apart` [mm] > 0 are replaced by their mean; the shortest closed polygon through the rest, found by exchanging pairs of
// sides, does not cross itself. `contour`: room for CONTOUR_TOUR_MOST points. Returns the number of its points, counter-clockwise; 0: fewer than three.
int contour_tour(int count, const SectionPoint *point, double apart, SectionPoint *contour);

#endif
