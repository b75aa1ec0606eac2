// A run's poses at moments chosen before the run, for its pictures.
#ifndef SELDINGER_SIM_MOMENTS_H
#define SELDINGER_SIM_MOMENTS_H

#include "sim/pose.h"

enum { MOMENTS_MOST = 6 };

typedef struct Moments {
    int count;
    double at_s[MOMENTS_MOST];       // of simulated time; HUGE_VAL: the end of the run
    bool is_taken[MOMENTS_MOST];     // a run may end before its moments
    Pose *pose[MOMENTS_MOST];
} Moments;

// `at_s` (count); if it is empty, the end of the run. Returns false if out of memory; moments_close() must be called in either case.
bool moments_open(Moments *moments, Simulator *simulator, int count, const double *at_s);
// To be called after each step; allocates nothing.
void moments_step(Moments *moments, Simulator *simulator, const ToolCommands *commands);
void moments_end(Moments *moments, Simulator *simulator);
void moments_close(Moments *moments);

#endif
