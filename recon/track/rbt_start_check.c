// Limits: a click lies within one radius of the axis of its vessel, at most within two; half of the edge points lie on the cylinder; the vessel is narrower
// than the volume; inside and outside differ by five standard errors (the best of all tubes in pure noise differs by less: see test_starts).
#include "recon/track/rbt_start_check.h"

#include "base/base.h"
#include "recon/track/rbt_scan.h"
#include "recon/track/rbt_start.h"
#include "recon/volume/volume_noise.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

static const double least_certainty = 5, least_inliers = 0.5, least_contrast = 4, certain_contrast = 8, least_evenness = 0.5, least_length = 6;
enum { NOISE_LAG = 3 };      // [voxel] distance for the noise estimate, because the noise of neighbours may be correlated

static void doubt(const Tracker *t, RbtStartCheck *check, RbtDoubt kind, double measured, double limit, const char *format, ...)
    __attribute__((format(printf, 6, 7)));
static void doubt(const Tracker *t, RbtStartCheck *check, RbtDoubt kind, double measured, double limit, const char *format, ...)
{
    if (check->warning_count == RBT_MAX_WARNINGS)
        return;
    const RbtWatch *watch = t->parameters->watch;
    RbtWarning *w = &check->warning[check->warning_count++];
    va_list arguments;
    *w = (RbtWarning){.kind = kind, .measured = measured, .limit = limit};
    va_start(arguments, format);
    vsnprintf(w->text, sizeof w->text, watch && watch->words ? watch->words(format) : format, arguments);
    va_end(arguments);
}

static double least_extent(const Volume *volume)
{
    double least = HUGE_VAL;
    for (int i = 0; i < 3; i++)
        least = fmin(least, vec3_norm(volume->axis[i]) * volume->size[i]);
    return least;
}

typedef struct Verdict {
    RbtStartCheck check;
    char refusal[300];       // reason of a refusal; empty: accepted
} Verdict;

// Distance of the click from the cylinder's axis. An offset along the tube counts only above four radii, because the cylinder may be searched further along
// the vessel.
static double drift_of(Vec3 click, const Cylinder *c)
{
    Vec3 q = vec3_sub(click, c->center);
    double along = vec3_dot(q, c->axis), across = sqrt(fmax(0, vec3_norm2(q) - along * along));
    return same_hypot(across, fmax(0, fabs(along) - 4 * c->radius));
}

// Noise of the copy that is tracked.
static double level_noise(const Tracker *t, RbtLevels *levels)
{
    for (int i = RBT_LEVELS - 1; i > 0; i--)
        if (levels->smooth[i] == t->volume)
            return rbt_level_noise(levels, i);
    return rbt_level_noise(levels, 0);
}

static Verdict judge(Tracker *t, RbtLevels *levels, Vec3 click, const Cylinder *c, double inlier_rate)
{
    Verdict v = {.check = {.click = click, .cylinder = *c, .drift = drift_of(click, c), .inlier_rate = inlier_rate, .noise = rbt_level_noise(levels, 0)}};
    RbtSight sight = rbt_sight_of(levels->volume, v.check.noise, c);
    double extent = least_extent(t->volume);
    v.check.contrast = sight.contrast;
    v.check.certainty = sight.certainty;
    v.check.smoothing_mm = t->check.smoothing_mm;
    if (v.check.drift > 2 * c->radius + t->voxel)
        snprintf(v.refusal, sizeof v.refusal,
                 "the vessel found there lies %.2f mm from the click and has a radius of %.2f mm; expected a click within one radius of its axis",
                 v.check.drift, c->radius);
    else if (2 * c->radius > extent)
        snprintf(v.refusal, sizeof v.refusal,
                 "the radius found there, %.2f mm, is more than half of the volume's smallest extent of %.1f mm; click in a vessel, or give its radius_mm",
                 c->radius, extent);
    else if (v.check.noise > 0 && v.check.certainty < least_certainty)
        snprintf(
            v.refusal, sizeof v.refusal,
            "noise hides the edge: the tube found there (radius %.2f mm) is %.3g grey values brighter than its surroundings at a noise of %.3g, %.1f standard "
            "errors; expected a place with at least %g, or a less noisy volume",
            c->radius, sight.contrast, v.check.noise, v.check.certainty, least_certainty);
    else if (t->is_noisy && sight.contrast < least_contrast * level_noise(t, levels))
        snprintf(v.refusal, sizeof v.refusal,
                 "noise hides the edge: the tube found there (radius %.2f mm) is %.3g grey values brighter than its surroundings, but the smoothed copy that "
                 "suits it has a noise "
                 "of %.3g; expected a contrast %g times that, or a less noisy volume",
                 c->radius, sight.contrast, level_noise(t, levels), least_contrast);
    if (v.check.drift > c->radius + 0.5 * t->voxel) {
        doubt(t, &v.check, RBT_DRIFT, v.check.drift, c->radius, "the click lies %.2f mm from the axis of the vessel found, outside its radius of %.2f mm",
              v.check.drift, c->radius);
    }
    if (inlier_rate < least_inliers) {
        doubt(t, &v.check, RBT_INLIERS, inlier_rate, least_inliers,
              "%.0f %% of the edge points at the start lie on its cylinder; expected %.0f %% or more for a vessel", 100 * inlier_rate, 100 * least_inliers);
    }
    if (4 * c->radius > extent && 2 * c->radius <= extent) {
        doubt(t, &v.check, RBT_RADIUS, c->radius, extent / 4,
              "the radius found at the start, %.2f mm, is more than a quarter of the volume's smallest extent of %.1f mm", c->radius, extent);
    }
    if (sight.evenness < least_evenness) {
        doubt(t, &v.check, RBT_SHAPE, sight.evenness, least_evenness,
              "the volume beside the tube found at the start is bright on both sides (only %.0f %% of the tube's contrast there): a band, a sheet or "
              "touching vessels?",
              100 * fmax(0, sight.evenness));
    }
    return v;
}

static void refuse(Tracker *t, const Verdict *v)
{
    t->check = v->check;
    memcpy(t->refusal, v->refusal, sizeof t->refusal);
}

static int scan_at(Tracker *t, RbtLevels *levels, const RbtSeed *seed, Cylinder *out)
{
    Vec3 axis = seed->has_toward ? vec3_unit_or(vec3_sub(seed->toward, seed->start), vec3(0, 0, 1)) : vec3(0, 0, 1);
    return rbt_scan(t, levels, seed->start, seed->radius, seed->has_toward ? &axis : NULL, out);
}

bool rbt_look_at_noise(Tracker *t, RbtLevels *levels, const RbtSeed *first)
{
    double noise = rbt_level_noise(levels, 0);
    t->check.noise = noise;
    if (!(noise > 0) || tracker_brightness(t, first->start) - t->background > certain_contrast * noise)
        return true;
    t->scan_count = scan_at(t, levels, first, t->scan);
    if (t->out_of_memory)
        return false;
    RbtSight best = {0, 0, 0};
    double radius = 0;
    for (int i = 0; i < t->scan_count; i++) {
        RbtSight sight = rbt_sight_of(levels->volume, noise, &t->scan[i]);
        if (sight.certainty >= least_certainty && sight.evenness * sight.contrast >= least_contrast * noise)
            return true;
        if (sight.certainty > best.certainty) {
            best = sight;
            radius = t->scan[i].radius;
        }
    }
    if (best.certainty < least_certainty && tracker_brightness(t, first->start) < t->dark)
        return true;   // on background: reported later, with all starts
    t->is_noisy = true;
    if (best.certainty < least_certainty) {
        snprintf(t->refusal, sizeof t->refusal,
                 "noise hides the edge: the clearest tube around it (radius %.2f mm) is %.3g grey values brighter than its surroundings at a "
                 "noise of %.3g, %.1f standard errors; expected a place with at least %g, or a less noisy volume",
                 radius, best.contrast, noise, best.certainty, least_certainty);
        return false;
    }
    return true;
}

// Switches the tracking to the copy that suits this tube.
static bool take_level(Tracker *t, RbtLevels *levels, const Cylinder *tube)
{
    int level = t->is_noisy ? rbt_level_for(levels, tube) : 0;
    const Volume *volume = rbt_level(levels, level);
    t->out_of_memory = !volume;
    t->volume = volume ? volume : levels->volume;
    t->check.smoothing_mm = rbt_level_voxels[level] * t->voxel;
    return volume != NULL;
}

bool rbt_stands_out(Tracker *t, RbtLevels *levels, const RbtSeed *seed)
{
    Cylinder tubes[RBT_SCANS];
    double noise = rbt_level_noise(levels, 0);
    if (scan_at(t, levels, seed, tubes) == 0)
        return false;
    Cylinder tube = tubes[0];
    RbtSight sight = rbt_sight_of(levels->volume, noise, &tube);
    double beside = tracker_brightness(t, tube.center) - sight.contrast;
    bool is_inside = tracker_brightness(t, seed->start) > beside + 0.4 * sight.contrast;
    return sight.certainty >= least_certainty &&
           (t->is_noisy || (is_inside && sight.contrast > 0.02 * ((double)t->volume->maximum - (double)t->volume->minimum)));
}

// Adds a warning about the noise, which alone is not a reason to refuse a start.
static void report_noise(Tracker *t)
{
    RbtStartCheck *check = &t->check;
    if (!t->is_noisy || !(check->noise > 0))
        return;
    doubt(t, check, RBT_NOISE, check->contrast / check->noise, least_contrast,
          "at the start the contrast is %.3g at a noise of %.3g grey values a voxel (%.0f standard errors): a copy smoothed by %.2f mm was tracked; "
          "thin branches may be missing",
          check->contrast, check->noise, check->certainty, check->smoothing_mm);
}

// Returns true if a tube around the click stands out much more than the one found, or if a much thinner one stands out inside it. The one found is then, for
// example, a band in which the vessel lies; inside a wide vessel hardly anything stands out.
static bool is_outdone(Tracker *t, RbtLevels *levels, const RbtSeed *seed, RbtStartCheck *check)
{
    RbtSight own = rbt_sight_of(levels->volume, check->noise, &check->cylinder);
    // the search is slow: skip it if the click lies in the middle of a good cylinder
    bool is_good = check->drift < 0.6 * check->cylinder.radius && check->inlier_rate > 0.6 && own.evenness > 0.6;
    if (!(check->noise > 0) || (t->scan_count < 0 && is_good))
        return false;
    if (t->scan_count < 0)
        t->scan_count = scan_at(t, levels, seed, t->scan);
    for (int i = 0; i < t->scan_count; i++) {
        RbtSight sight = rbt_sight_of(levels->volume, check->noise, &t->scan[i]);
        bool is_thin = t->scan[i].radius < 0.5 * check->cylinder.radius;
        double share = is_thin && check->drift > 0.6 * check->cylinder.radius ? 0.2 : is_thin ? 0.5 : 1.5;
        if (sight.certainty < certain_contrast || sight.evenness * sight.contrast < share * own.evenness * own.contrast)
            continue;
        doubt(t, check, RBT_RADIUS, check->cylinder.radius, t->scan[i].radius,
              "a tube of radius %.2f mm stands out at the click, which is not the one of %.2f mm that was found (%.3g and %.3g grey values)", t->scan[i].radius,
              check->cylinder.radius, sight.evenness * sight.contrast, own.evenness * own.contrast);
        return true;
    }
    return false;
}

bool rbt_first_start(Tracker *t, RbtLevels *levels, const RbtSeed *seed, Cylinder *out)
{
    Verdict best;
    Cylinder c;
    double rate;
    bool found = false;
    if (!t->is_noisy && rbt_estimate_start(t, seed, &c, &rate)) {
        best = judge(t, levels, seed->start, &c, rate);
        *out = c;
        found = true;
    }
    if (t->out_of_memory)
        return false;
    bool is_clean = found && !best.refusal[0] && best.check.warning_count == 0 && !is_outdone(t, levels, seed, &best.check);
    const Cylinder *suited = NULL;
    if (!is_clean && t->scan_count < 0)
        t->scan_count = scan_at(t, levels, seed, t->scan);
    for (int i = 0; !is_clean && i < t->scan_count; i++) {
        if (!take_level(t, levels, &t->scan[i]))
            return false;
        double beside = tracker_brightness(t, t->scan[i].center) - 0.5 * rbt_sight_of(t->volume, 0, &t->scan[i]).contrast;
        if (!rbt_refine_start(t, &t->scan[i], seed->radius > 0, beside, &c, &rate))
            continue;
        Verdict other = judge(t, levels, seed->start, &c, rate);
        if (!found || (best.refusal[0] && !other.refusal[0]) ||
            (!best.refusal[0] == !other.refusal[0] && other.check.warning_count < best.check.warning_count)) {
            best = other;
            *out = c;
            suited = &t->scan[i];
        }
        found = true;
        is_clean = !best.refusal[0] && best.check.warning_count == 0;
    }
    if (!found) {
        t->why = "no tube found there";
        return false;
    }
    if (suited && !take_level(t, levels, suited))
        return false;
    refuse(t, &best);
    report_noise(t);
    return !t->refusal[0];
}

bool rbt_suit_given(Tracker *t, RbtLevels *levels, const Cylinder *given) { return take_level(t, levels, given); }

bool rbt_check_given(Tracker *t, RbtLevels *levels, const RbtSeed *seed, const TrackNode *first)
{
    Verdict v = judge(t, levels, seed->start, &first->cylinder, first->inlier_rate);
    refuse(t, &v);
    report_noise(t);
    return !t->refusal[0];
}

// Warns about a bright band or bone across the first branch: branches are compared with its brightness, and missed where that changes.
static void judge_background(Tracker *t, int count)
{
    enum { MOST = 512 };
    double beside[MOST], contrast[MOST];
    int n = 0, stride = count / MOST + 1;
    for (int i = 0; i < count && n < MOST; i += stride) {
        contrast[n] = t->tree.node[i].contrast;
        beside[n++] = tracker_brightness(t, t->tree.node[i].cylinder.center) - t->tree.node[i].contrast;
    }
    sort_doubles(beside, (size_t)n);
    sort_doubles(contrast, (size_t)n);
    double low = beside[n / 10], high = beside[n - 1 - n / 10];
    if (high - low <= contrast[n / 2])
        return;
    doubt(t, &t->check, RBT_BACKGROUND, high - low, contrast[n / 2],
          "beside the first branch the volume changes from %.3g to %.3g grey values, by more than its contrast of %.3g (a bright band?): it may end early "
          "there, and branches may be missing",
          low, high, contrast[n / 2]);
}

// Warns if the first branch ends in front of something much brighter than itself, such as the face of a band in which it may continue.
static void judge_ends(Tracker *t, int count)
{
    for (int end = 0; end < 2 && count > 3; end++) {
        const TrackNode *n = &t->tree.node[end ? count - 1 : 0], *before = &t->tree.node[end ? count - 4 : 3];
        Vec3 ahead = vec3_unit_or(vec3_sub(n->cylinder.center, before->cylinder.center), n->cylinder.axis), c = n->cylinder.center;
        double brighter = 0;
        for (int k = 2; k <= 5; k++) {
            Vec3 x = vec3_add_scaled(c, k * n->cylinder.radius, ahead);
            if (tracker_is_inside(t->volume, x))
                brighter = fmax(brighter, tracker_brightness(t, x) - tracker_brightness(t, before->cylinder.center));
        }
        if (brighter <= 1.5 * before->contrast + 4 * level_noise(t, t->levels))
            continue;
        doubt(t, &t->check, RBT_BACKGROUND, brighter, 1.5 * before->contrast,
              "the first branch ends at (%.1f, %.1f, %.1f) mm next to something %.3g grey values brighter than itself, at a contrast of %.3g (a bright "
              "band?): it may continue there",
              c.x, c.y, c.z, brighter, before->contrast);
    }
}

void rbt_judge_branch(Tracker *t, RbtLevels *levels, int count)
{
    enum { ROOT = 3 };
    double sum = 0, root = 0, length = 0;
    int faint = 0;
    const Track *tree = &t->tree;
    for (int i = 0; i < count; i++) {
        const TrackNode *n = &tree->node[i];
        sum += n->inlier_rate;
        root += i < ROOT ? n->inlier_rate : 0;
        length += i > 0 ? vec3_distance(n->cylinder.center, tree->node[i - 1].cylinder.center) : 0;
        faint += t->check.noise > 0 && rbt_sight_of(levels->volume, t->check.noise, &n->cylinder).certainty < RBT_NODE_CERTAINTY;
    }
    if (count == 0)
        return;
    if (sum < least_inliers * count) {
        doubt(t, &t->check, RBT_INLIERS, sum / count, least_inliers,
              "over the first branch %.0f %% of the edge points lie on its cylinders; expected %.0f %% or more for a vessel", 100 * sum / count,
              100 * least_inliers);
    } else if (root < least_inliers * (count < ROOT ? count : ROOT)) {
        doubt(t, &t->check, RBT_INLIERS, root / (count < ROOT ? count : ROOT), least_inliers,
              "at the root %.0f %% of the edge points lie on its cylinders; expected %.0f %% or more for a vessel", 100 * root / (count < ROOT ? count : ROOT),
              100 * least_inliers);
    }
    judge_background(t, count);
    judge_ends(t, count);
    double radius = tree->node[count / 2].cylinder.radius;
    if (length < least_length * radius) {
        doubt(t, &t->check, RBT_LENGTH, length / radius, least_length, "the first branch is %.1f mm long, %.1f of its radii; expected %g or more for a vessel",
              length, length / radius, least_length);
    }
    if (faint > 0.2 * count) {
        doubt(t, &t->check, RBT_NOISE, (double)faint / count, 0.2, "%.0f %% of the first branch does not stand out of the noise by %g standard errors",
              100.0 * faint / count, RBT_NODE_CERTAINTY);
    }
}

void rbt_report_sac_start(Tracker *t, Vec3 start, double sac_radius, Vec3 vessel)
{
    doubt(t, &t->check, RBT_SAC, sac_radius, t->check.cylinder.radius,
          "the start (%.2f, %.2f, %.2f) mm lies in a sac of %.1f mm on a vessel of %.1f mm; the tree begins at the vessel beside it, at (%.2f, %.2f, %.2f) mm",
          start.x, start.y, start.z, 2 * sac_radius, 2 * t->check.cylinder.radius, vessel.x, vessel.y, vessel.z);
}
