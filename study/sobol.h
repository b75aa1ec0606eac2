// Sobol's sequence in up to 20 dimensions, with the direction numbers of Joe and Kuo (2008, file new-joe-kuo-6.21201): points that fill the unit cube evenly.
// The first 2^m points have one in each of the 2^m equal intervals of every axis, and so has each further block of 2^m.
// Own code: the GNU Scientific Library's generator is under the GPL, which a program under the MIT licence cannot link, and gives a point only after all before.
#ifndef SELDINGER_STUDY_SOBOL_H
#define SELDINGER_STUDY_SOBOL_H

#include <stdint.h>

enum { SOBOL_DIMENSIONS = 20 };

// 32 binary digits of coordinate `dimension` of point `index`, in the order of Gray's code; point 0 is the origin.
uint32_t sobol_digits(uint32_t index, int dimension);
// The same as a number in (0, 1), in the middle of its interval of 2^-32. `shift` is exclusive-ored with the digits: a random shift keeps the evenness and takes
// the first point off the corner.
double sobol_unit(uint32_t index, int dimension, uint32_t shift);

#endif
