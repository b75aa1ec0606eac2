#include "solver/block_chain.h"
