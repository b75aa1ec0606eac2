// Where the numbers of an axis stand: on charts, on report pages and in the window alike.
#ifndef SELDINGER_RENDER_TICK_STEP_H
#define SELDINGER_RENDER_TICK_STEP_H

// The least round step (1, 2 or 5 times a power of ten) that fits into `range` at most `most` times; 1 where the range is not a positive number.
double tick_step(double range, int most);

#endif
