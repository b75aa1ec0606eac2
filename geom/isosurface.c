#include "geom/isosurface.h"
