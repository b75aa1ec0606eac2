#include "geom/vessel_tree.h"
