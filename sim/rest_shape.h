// A tool's stress-free shape, given by lines and arcs like a tube's path: divided into sections of constant curvature.
#ifndef SELDINGER_SIM_REST_SHAPE_H
#define SELDINGER_SIM_REST_SHAPE_H

#include "geom/geom.h"
#include "solver/solver.h"

// The pieces end at the tip; the rest of the wire, at its proximal end, is straight. The plane of an arc is given relative to that of the previous arc. Divides
// the wire's sections at the pieces' borders and sets their rest curvature. A section's border closer than 0.01 mm to a piece's border is moved there, because
// a sliver would become an element. The pieces may be longer than the wire by less than 0.01 mm; the first one is then shortened. Returns new sections, which
// the caller frees, and their count; NULL if out of memory.
WireSection *rest_shape_sections(const WireSection *section, int section_count, const TubePiece *piece, int piece_count, int *count);
double rest_shape_length(const TubePiece *piece, int piece_count);      // [mm]

#endif
