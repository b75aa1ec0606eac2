// The chart of `seldinger bench collision`: one SVG with light ground, drawn from the JSON that the bench writes.
#ifndef SELDINGER_BENCH_COLLISION_CHART_H
#define SELDINGER_BENCH_COLLISION_CHART_H

#include "base/faults.h"

#include <cJSON.h>
#include <stdbool.h>

// `root` as the bench writes it: rows[{surface, representation, motion: {us_per_80_points, gap_error_um: {rms}, normal_error_deg: {rms}}, loop:
// {survived}, frictionless: {artificial_mu, work_lost_n}, paper: {ms}}], and growth and sizes as collision_growth.h says. What is missing, or is no
// number above 0 on a logarithmic axis, has no mark; of friction and work the magnitude is drawn. The same bytes for the same root. False with a
// fault where the file cannot be written or memory runs out.
bool collision_chart(const cJSON *root, const char *path, Faults *faults);

#endif
