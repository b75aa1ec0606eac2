#include "sim/scene.h"
