// The share of the screen's resolution at which the views are drawn, so that a picture keeps to a time budget. Plain data: no clock, no OpenGL.
#ifndef SELDINGER_RENDER_TIME_BUDGET_H
#define SELDINGER_RENDER_TIME_BUDGET_H

typedef struct TimeBudget {
    double most_ms;              // CPU time of a picture; 0: unlimited, always the screen's resolution
    int level;                   // 0: the screen's resolution, then coarser
    int pictures;                // at this level
    double mean_ms;              // over the last pictures at this level
    int patience;                // pictures before a finer level is tried; doubled when it was too expensive
} TimeBudget;

// The share of width and height: 1 down to a quarter.
double time_budget_share(const TimeBudget *budget);
// Reports the cost of a picture. The resolution falls soon after the mean exceeds the budget. It rises if the cost would stay below it even if all of it grew
// with the number of pixels; else the finer level is tried after a while, and more and more seldom if it was too expensive.
void time_budget_spend(TimeBudget *budget, double ms);

#endif
