// Between hold and release a stop by the user (SIGINT, SIGTERM, SIGHUP) waits: what has begun a part of a file can finish or remove it.
// The calling thread alone holds: others must not be running.
#ifndef SELDINGER_GEOM_STOPS_H
#define SELDINGER_GEOM_STOPS_H

#include <signal.h>
#include <stddef.h>

static inline void stops_hold(sigset_t *before)
{
    sigset_t stops;
    sigemptyset(&stops);
    sigaddset(&stops, SIGINT);
    sigaddset(&stops, SIGTERM);
    sigaddset(&stops, SIGHUP);
    pthread_sigmask(SIG_BLOCK, &stops, before);
}

static inline void stops_release(const sigset_t *before) { pthread_sigmask(SIG_SETMASK, before, NULL); }

#endif
