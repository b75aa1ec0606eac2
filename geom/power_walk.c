#include "geom/power_walk.h"
