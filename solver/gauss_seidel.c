#include "solver/gauss_seidel.h"
