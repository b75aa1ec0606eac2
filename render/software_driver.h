// Configures Mesa's software driver (llvmpipe), used without a GPU.
#ifndef SELDINGER_RENDER_SOFTWARE_DRIVER_H
#define SELDINGER_RENDER_SOFTWARE_DRIVER_H

#include <stdlib.h>

// To be called before the first context: makes llvmpipe draw in the calling thread, without threads of its own. Its threads would take the core that
// the 1 kHz thread needs, and up to Mesa 22.3.6 (Debian 12) they can write to a fence that was freed: it is freed as soon as it looks signalled,
// while the thread that signalled it still holds its lock (tests/render/test_software_fences.c). LP_NUM_THREADS in the environment has precedence; a
// GPU's driver ignores it.
static inline void software_driver_without_threads(void) { setenv("LP_NUM_THREADS", "0", 0); }

#endif
