// A clock in seconds, for waiting and measuring; the simulation itself never reads it.
#ifndef SELDINGER_SIM_CLOCK_H
#define SELDINGER_SIM_CLOCK_H

#include <time.h>

static inline double clock_s(clockid_t which)   // CLOCK_MONOTONIC, CLOCK_PROCESS_CPUTIME_ID …
{
    struct timespec now = {0};
    clock_gettime(which, &now);
    return (double)now.tv_sec + (double)now.tv_nsec * 1e-9;
}

#endif
