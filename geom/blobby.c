#include "geom/blobby.h"
