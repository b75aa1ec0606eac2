// What is seen from each segment of a swept model and from each node of its sacs: see "Candidates" in sweep_model.h. Part of sweep_field_create.
#ifndef SELDINGER_GEOM_SWEEP_VIEWS_H
#define SELDINGER_GEOM_SWEEP_VIEWS_H

#include "geom/sweep_field.h"

// Fills field->view and the views and scales of field->sac. Curves, segments and forks are filled; the arrays are allocated and zeroed.
void sweep_field_fill_views(SweepField *field);
#endif
