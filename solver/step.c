#include "solver/step.h"
