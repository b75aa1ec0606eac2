// A row of cross-sections along a curve, blended into one function C(n, b, t) = sum_j w_j(t) C_j(n, b), > 0 inside: the tube of a branch in the models of
// Kretschmer et al. 2013 and Hong et al. 2012 and 2018. (n, b, t) are the coordinates of sweep_model.h.
//
// Weights w_j, which add up to 1:
//   Catmull-Rom  of four sections around t, with a tension tau (Kretschmer et al.: 0.7). C1. Only 0.5 is exact for tapers on even stations; with 0.7 the wall of a
//                cone leaves its straight line by 0.0385 of the change per step, and its slope varies between 0.8 and 1.4 of the true one.
//   PSP          H_m((t - a_j)/delta_j) - H_m((t - a_{j+1})/delta_{j+1}), a_j midway between stations j-1 and j (Hong et al., "piecewise polynomial splines";
//                H_m as in section_pas.c). C^(m-1). With delta half the distance of the stations the weights are the B-splines of degree m, which are exact for
//                tapers; smaller delta make steps.
// Before the first and beyond the last station the sections there continue.
#ifndef SELDINGER_GEOM_SECTION_ROW_H
#define SELDINGER_GEOM_SECTION_ROW_H

#include "geom/section.h"

typedef enum { SECTION_CATMULL_ROM, SECTION_PSP } SectionWeights;

typedef struct SectionRow {
    int count;               // >= 1
    const double *t;         // (count) [mm] increasing
    Section *const *section; // (count)
    SectionWeights weights;
    double tension;          // Catmull-Rom: tau, > 0
    double width;            // PSP: delta relative to the distance of the stations, > 0 to 0.5
} SectionRow;

enum { SECTION_ROW_PARTS = 6 };      // most sections that have a weight at one t
typedef struct SectionShares {
    int first, count;        // sections first … first + count - 1
    double w[SECTION_ROW_PARTS], w1[SECTION_ROW_PARTS], w2[SECTION_ROW_PARTS];  // weights and their first two derivatives in t
} SectionShares;
SectionShares section_row_shares(const SectionRow *row, double t);

// C with its first and second derivatives.
typedef struct SectionRowJet {
    double value, n, b, t, nn, nb, bb, nt, bt, tt;
} SectionRowJet;
SectionRowJet section_row_evaluate(const SectionRow *row, double n, double b, double t);

#endif
