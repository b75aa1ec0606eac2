// Writes VTP as XML with numbers as text, which every reader accepts. The functions write a file's sections and must be called in this order.
#ifndef SELDINGER_RECON_SURFACE_VTP_WRITE_H
#define SELDINGER_RECON_SURFACE_VTP_WRITE_H

#include "geom/geom.h"

#include <stdio.h>

void vtp_begin(FILE *out, int points, int lines, int polygons);
void vtp_array(FILE *out, const char *type, const char *name, int components);   // opens an array; the caller prints the numbers
void vtp_array_end(FILE *out);
void vtp_numbers(FILE *out, const char *name, const double *value, int count);
void vtp_vectors(FILE *out, const char *name, const Vec3 *value, int count);
void vtp_points(FILE *out, const Vec3 *value, int count);
void vtp_end(FILE *out);

#endif
