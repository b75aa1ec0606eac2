// Configures Mesa's software driver (llvmpipe), used without a GPU.
#ifndef SELDINGER_RENDER_SOFTWARE_DRIVER_H
#define SELDINGER_RENDER_SOFTWARE_DRIVER_H

#include <stdlib.h>

// Call before the first context is created: makes llvmpipe draw in the calling thread, without threads of its own. Its threads would occupy the core that
// the 1 kHz thread needs, and up to Mesa 22.3.6 (Debian 12) they can write to a freed fence: it is freed as soon as it looks signalled,
// while the thread that signalled it still holds its lock (tests/render/test_software_fences.c). LP_NUM_THREADS in the environment has precedence; the driver
// of a
// GPU ignores it.
static inline void software_driver_without_threads(void) { setenv("LP_NUM_THREADS", "0", 0); }

#endif
