// The spacing of axis labels on charts, on report pages and in the window.
#ifndef SELDINGER_RENDER_TICK_STEP_H
#define SELDINGER_RENDER_TICK_STEP_H

#include <stddef.h>

// The smallest round step (1, 2 or 5 times a power of ten) that fits into `range` at most `most` times; 1 if the range is not a positive number.
double tick_step(double range, int most);

// The largest of these steps that is not above `most`, for the bar of a scale; `most` itself where it is not a positive number.
double round_length(double most);
// A number on an axis with that step, with as many digits as the step has.
void tick_format(char *text, size_t capacity, double value, double step);

#endif
