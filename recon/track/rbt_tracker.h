// The state of a tracking run, and operations shared by its steps. A tracker belongs to one thread; several may read one tree (`tree` is then a shallow copy
// and nothing is appended to it). Internal to recon.
#ifndef SELDINGER_RECON_TRACK_RBT_TRACKER_H
#define SELDINGER_RECON_TRACK_RBT_TRACKER_H

#include "geom/geom.h"
#include "recon/track/ransac_cylinder.h"
#include "recon/track/rbt_parameters.h"
#include "recon/track/rbt_report.h"
#include "recon/volume/volume.h"

enum { MAX_RAYS = 2562, MAX_AXES = 321 };

typedef struct TrackNode {
    Cylinder cylinder;
    double inlier_rate, contrast;
    int parent, kind, branch;
    bool retried, is_junction;
    bool is_on_voxels;       // placed on a path over the image's voxels (rbt_links.h), not measured
    bool is_link;            // lies between the parent's axis and the branch's first node (rbt_ostia.h)
    int64_t point_start;
    int point_count;
} TrackNode;

typedef struct Estimate {    // a node before it is accepted
    TrackNode node;
    Vec3 point[MAX_RAYS];
} Estimate;

typedef struct Track {       // nodes with their points
    TrackNode *node;
    int count, capacity;
    Vec3 *point;
    int64_t point_count, point_capacity;
} Track;

typedef struct RbtStop {     // a point of `until`: a disc across a vessel
    Vec3 center, axis;
    double radius, half;     // [mm] radius of the disc, and half of its thickness
} RbtStop;

typedef struct Tracker {
    const Volume *volume;
    const RbtParameters *parameters;
    double voxel;            // [mm] mean edge of a voxel
    double background;       // brightness of most of the volume
    double dark;             // brightness below which a start lies on background
    int ray_count, axis_count;
    Vec3 ray[MAX_RAYS];
    Vec3 axis[MAX_AXES];     // unit vectors of half a sphere around +z, by increasing angle with it
    Random random;
    Vec3 candidate[MAX_RAYS]; // wall points around the last prediction …
    struct {
        const Volume *volume;
        Vec3 center;
        double length;       // [mm] of the rays
        int count;
    } cast;                  // … which is tried with a second threshold; volume: NULL before the first
    int inlier[MAX_RAYS];
    double along[MAX_RAYS];
    Estimate estimate;
    Track tree;
    const struct RbtPaint *paint;  // spatial index of the tree; NULL: search all nodes
    bool is_guarded;         // the branch was found automatically: it must not grow wider or brighter than its vessel
    double longest;          // [mm] largest length of the branch
    double noise;            // four standard deviations of the spline's values in the background
    double floor, ceiling;   // brightness below which a guarded branch has ended, and above which nothing is vessel
    double usual_inliers;    // mean inlier rate of the first branch
    bool out_of_memory;
    const char *why;         // reason why the last estimate was refused
    char start[256];         // description of the estimate at the first start; may be empty
    struct RbtLevels *levels; // the volume and its smoothed copies, for the first start
    bool is_noisy;           // the noise of a voxel exceeds the contrast of the first vessel
    int scan_count;          // number of tubes around the first start that stand out, best first; -1: not searched yet
    Cylinder scan[12];
    RbtStartCheck check;
    RbtStop *stop;           // (parameters->until_count)
    int stop_count;
    char refusal[300];       // reason why the first start is refused; empty: accepted
} Tracker;

bool track_append(Track *track, const TrackNode *node, const Vec3 *point);   // returns false if out of memory
void track_cut(Track *track, int count);
// Keeps the nodes for which keep[i] is true; no kept node may be attached to a removed one. `place`: space for one int per node.
void track_keep(Track *track, const bool *keep, int *place);
void track_free(Track *track);

// Shows the tree with `branch`, which is not yet part of it (may be NULL), to the watch of the tracking.
void tracker_show(const Tracker *t, const Track *branch);
static inline bool tracker_is_stopped_by_user(const Tracker *t) { return rbt_watch_is_stopped(t->parameters->watch); }

double tracker_usual_radius(const Track *branch);   // median radius of its last nodes
double tracker_segment_distance(Vec3 x, Vec3 a, Vec3 b);
double tracker_brightness(const Tracker *t, Vec3 point);   // the spline's value
Vec3 tracker_in_mm(const Volume *volume, Vec3 x, bool is_voxel);
bool tracker_is_inside(const Volume *volume, Vec3 x);
bool tracker_is_forbidden(const Tracker *t, Vec3 x);   // true if x lies in a region of `forbid`
bool tracker_is_stopped(const Tracker *t, Vec3 a, Vec3 b);   // true if the line from a to b crosses a disc of `until`
// Brightness of the darkest place on the line from a to b.
double tracker_darkest(const Tracker *t, Vec3 a, Vec3 b);
// The same, as a fraction of the lumen's brightness at the darker of both ends.
double tracker_link_brightness(const Tracker *t, Vec3 a, Vec3 b);

#endif
