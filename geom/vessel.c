#include "geom/vessel.h"

bool vessel_hit_is_sound(const VesselHit *hit)
{
    if (isnan(hit->gap))
        return false;
    if (hit->flags & (VESSEL_FAR | VESSEL_OPEN_END | VESSEL_UNSURE))
        return true;
    const Sym3 *h = &hit->hessian;
    return fabs(vec3_norm2(hit->normal) - 1) < 1e-6 && isfinite(h->xx + h->xy + h->xz + h->yy + h->yz + h->zz);
}
