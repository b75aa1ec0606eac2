#include "recon/tree_file.h"
