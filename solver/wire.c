#include "solver/wire.h"
