#include "recon/volume.h"
