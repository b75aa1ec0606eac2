// The swept model of a vessel tree: each branch is a centreline curve with cross-sections along it; branches are blended where they meet, and sacs are local
// models that are blended like branches. Kretschmer et al. 2013, Hong et al. 2012 and 2018 use this form with sections of other kinds.
//
// Curve. S(t), t >= 0 [mm of chord], is the natural cubic spline through the branch's knots. On each interval between knots the frame is two cubic Hermite
// polynomials N(t), B(t) through rotation-minimising frames at the knots with their exact derivative there, N' = -(S''.N) S' / |S'|^2; the frame is therefore
// C1, and its derivatives below are exact, whatever its twist. A child's curve begins at the centre of the node that it springs from.
// Coordinates of X. t: the foot on the curve, u.S' = 0 with u = X - S(t); n = u.N, b = u.B. With D = |S'|^2 - u.S'' (limited to at least 0.02 |S'|^2: beyond
// the focal line the nearest root of t is used), a = u.N' - S'.N, c = u.N'' - S''.N - 2 S'.N':
//   grad t = S'/D,   Hess t = (S''S'^T + S'S''^T)/D^2 - (3 S'.S'' - u.S''') S'S'^T/D^3,
//   grad n = N + a grad t,   Hess n = N' grad t^T + grad t N'^T + c grad t grad t^T + a Hess t;   the same for b with B.
// Section. R(theta, t) = Re sum_k c_k(t) zeta^k, zeta = (n + i b)/rho, rho = |(n, b, w)|, k = 0 ... H. The branch's field is f = R - rho [mm], > 0 inside.
// w = 0 along the branch. Beyond a closed end, t > length or t < 0, the curve continues as a straight line and w is the height over the end's plane: a dome,
// smooth at its pole, because zeta^k vanishes there. Upstream of an open inlet w = 0: a cylinder without end. Beyond either end, the section continues with the
// slope that it has there and becomes constant within h, half its mean radius: c_k = c_k(end) + c_k'(end) (s - s^2/h + s^3/(3 h^2)), s = the height over the
// end's plane up to h. So the wall has no crease at an end, however the vessel tapers.
// c_k(t) are cubic B-splines over the branch's breaks (not uniform; the first and the last break are knots of multiplicity four, so the first and the last row
// are the sections at the ends); each row of coefficients is one section of the field's terms.
// Blends. F = M(... M(f_1, f_2) ...) over the candidates of a place, M(x, y) = (x + y + A(x - y))/2, A(d) = delta (2/3 + q^2/2 - q^3/12) for q = |d|/delta <= 2,
// else |d|: C2, and F is the plain maximum where the fields differ by more than 2 delta. Branches are taken in the order of their indices.
// delta = blend * (radius of the child at the fork) * (0.2 + 0.8 (1 - (t_c/(3 r_p))^2)^2) with t_c the child's t and r_p the parent's radius at the fork, and
// 0.2 instead of the bracket beyond 3 r_p: where branches part at a small angle, their walls still meet there, and an edge without any blending has no foot that
// Newton finds. (Radii at a fork are mean radii: the parent's at parent_t, the child's one r_p from its start.)
// Sacs are taken last: f = (r/2) (sum a u^3 - 1), r the radius of the sac's largest node, and delta = blend/2 times the smaller of r and the mean radius of the
// vessel's nodes beside the neck, at most 0.225 r: f does not fall below -r/2, and where it is that low, it must not matter at the vessel's wall.
// Sections of another kind (section.h), where polar ones cannot hold the lumen's shape: on from < t < to of a branch, f = (1 - m) f_rows + m C(n, b, t), C the row
// of sections through the stretch's stations (section_row.h), m = 1 except within `fade` of both ends of the range, where it rises as 6 s^5 - 15 s^4 + 10 s^3. At
// t = 0 of an open inlet there is no fade, and m = 1 upstream. The rows remain the nearest polar sections: their radii serve candidates and starts.
// Candidates are given by topology (sweep_views.c): a child is followed from its start along the branches that are seen at its fork, as long as the tubes,
// enlarged by the width of the blend, overlap; so vessels that touch elsewhere are never blended. In the same way, a sac is seen along the vessel from its neck on
// as long as its wall is near the vessel's.
//
// Lengths mm. A model owns its arrays. It is evaluated through a SweepField (sweep_field.h), which is made from it and borrows it.
#ifndef SELDINGER_GEOM_SWEEP_MODEL_H
#define SELDINGER_GEOM_SWEEP_MODEL_H

#include "geom/section_row.h"
#include "geom/vessel_tree.h"

enum { SWEEP_HARMONICS = 8 };
enum { SWEEP_TERMS = 2 * SWEEP_HARMONICS + 1 };      // of a row: c_0, then Re c_1, -Im c_1, Re c_2, … (factors of cos k theta, sin k theta)
enum { SWEEP_CANDIDATES = 6 };       // most branches and sacs that are blended at one place

typedef struct SweepBranch {
    int parent;              // branch that it springs from; -1 for the first
    double parent_t;         // t on the parent there
    bool open_start;         // the root's branch, if the root is an open end: the lumen continues upstream
    double radius;           // [mm] mean; the scale of steps and tolerances
    int first_knot, knot_count;      // >= 2 knots of the curve
    int first_break, break_count;    // >= 2 breaks of the B-splines; the first is t = 0 and the last t = length
    int first_row;                   // its break_count + 2 rows of coefficients
    bool has_blend;          // delta at its fork relative to its radius is `blend`, 0 to 2; false: that of the model
    double blend;
    uint8_t tag[2];          // SweepTag of its start and of its end
} SweepBranch;

// What crosses an open end. Ends without a tag: see sweep_model_tag.
typedef enum { SWEEP_TAG_NONE, SWEEP_TAG_IN, SWEEP_TAG_OUT, SWEEP_TAGS } SweepTag;

typedef struct SweepStation {
    double t;                // [mm] on the branch's curve
    int first_point, point_count;    // its contour in the plane (n, b): 3 to 4096 points, not crossing itself
} SweepStation;

typedef struct SweepStretch {
    int branch;
    double from, to;         // [mm] range of t
    double fade;             // [mm] > 0, at most half the range
    int first_station, station_count;        // >= 1 stations, t increasing
    SectionOptions section;
    SectionWeights weights;
    double tension, width;   // of the weights, see SectionRow
    bool is_straight;        // as in Hong et al. 2012: each section in the straight frame of its own station, PSP weights over its own interval only
} SweepStretch;

typedef struct SweepModel {
    int branch_count;        // >= 1; parents before children
    SweepBranch *branch;
    int knot_count;          // over all branches
    Vec3 *knot;              // (knots) [mm]
    int32_t *knot_node;      // (knots) the tree's node nearest to it, reported as the place of a hit
    int break_count;
    double *break_t;         // (breaks) [mm] increasing within a branch
    int row_count;
    double *row;             // (rows, SWEEP_TERMS) [mm]
    int stretch_count;         // 0: rows alone; the stretches of a branch follow each other and do not overlap
    SweepStretch *stretch;
    int station_count;
    SweepStation *station;
    double *station_t;       // (stations) their t
    int contour_count;
    SectionPoint *contour;   // (contours) [mm]
    Section **section;       // (stations) made from the contours
    double blend;            // delta at a fork relative to the child's radius; default 0.6, 0: plain maximum
    VesselTree *sac;         // shared blobs of the sacs and the vessels beside their necks; NULL: the tree has no sacs
    int32_t *sac_node;       // (nodes of `sac`) the node of the tree that each one is
    bool borrows_sac;        // another model owns `sac` and `sac_node`, and lives longer
    char *edits;             // YAML of the edits that made it from its fit (docs/file-formats.md, "Edits"); NULL: none
} SweepModel;

// Allocates all arrays for the counts, zeroed, and sets blend to its default. Returns NULL if a count is out of range (branches, knots and breaks at least one)
// or if out of memory. `sac` and `sac_node` are NULL; a model that is given them owns them.
SweepModel *sweep_model_create(int branch_count, int knot_count, int break_count, int row_count);
void sweep_model_free(SweepModel *model);
// Gives the model sections of another kind: copies the arrays and makes the sections; stretches that it had are dropped. The model, without its stretches, is valid.
// Returns false with faults (ranges, contours that give no section, out of memory).
bool sweep_model_set_stretches(SweepModel *model, int stretch_count, const SweepStretch *stretch, int station_count, const SweepStation *station,
                               int contour_count, const SectionPoint *contour, const char *file, Faults *faults);
// Checks the properties stated above: ranges of branches follow each other and cover the arrays, parents come before children, places on parents exist, knots
// are apart, breaks increase from 0 to the curve's length (to 1e-6 of it), numbers are finite, radii positive, sac nodes linked. Adds one fault per broken rule,
// with the first offending index.
bool sweep_model_validate(const SweepModel *model, const char *file, Faults *faults);
// The highest harmonic that any row uses, at least 1.
int sweep_model_harmonics(const SweepModel *model);
// [mm] length of a branch's curve: t of its last knot.
double sweep_model_length(const SweepModel *model, int branch);
// delta at the fork of a branch relative to its radius.
static inline double sweep_model_blend(const SweepModel *model, int branch)
{
    return model->branch[branch].has_blend ? model->branch[branch].blend : model->blend;
}
// What crosses the start (end = 0) or the end (end = 1) of a branch: its tag, otherwise what the centreline suggests (Kretschmer et al. 2013, section 5.1):
// blood enters at the root and leaves at every end. A child's start is no end: SWEEP_TAG_NONE.
SweepTag sweep_model_tag(const SweepModel *model, int branch, int end);

#endif
