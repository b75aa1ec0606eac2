// The spacing of axis labels on charts, on report pages and in the window.
#ifndef SELDINGER_RENDER_TICK_STEP_H
#define SELDINGER_RENDER_TICK_STEP_H

// The smallest round step (1, 2 or 5 times a power of ten) that fits into `range` at most `most` times; 1 if the range is not a positive number.
double tick_step(double range, int most);

#endif
