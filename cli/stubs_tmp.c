#include "geom/mesh_vessel.h"
#include "geom/grid_vessel.h"
TriangleMesh *isosurface_of_vessel(const Vessel *v, int n, const Vec3 *c, const double *r, const int *f, double e) { (void)v,(void)n,(void)c,(void)r,(void)f,(void)e; return NULL; }
Vessel *grid_vessel_create(const Vessel *e, const TriangleMesh *s, const GridVesselOptions *o, const char *n, Faults *f) { (void)e,(void)s,(void)o,(void)n,(void)f; return NULL; }
