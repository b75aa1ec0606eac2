#include "recon/fit/contour_tour.h"

#include "base/base.h"

#include <math.h>

static double distance(SectionPoint a, SectionPoint b) { return same_hypot(a.n - b.n, a.b - b.b); }

// Means of groups: each point belongs to the first group whose first point is nearer than `apart`.
static int thin_points(int count, const SectionPoint *point, double apart, SectionPoint *mean)
{
    SectionPoint leader[CONTOUR_TOUR_MOST];
    int members[CONTOUR_TOUR_MOST], groups = 0;
    for (int i = 0; i < count; i++) {
        int at = 0;
        while (at < groups && distance(leader[at], point[i]) > apart)
            at++;
        if (at == CONTOUR_TOUR_MOST)
            continue;
        if (at == groups)
            leader[groups] = point[i], mean[groups] = (SectionPoint){0, 0}, members[groups++] = 0;
        mean[at].n += point[i].n, mean[at].b += point[i].b, members[at]++;
    }
    for (int i = 0; i < groups; i++)
        mean[i].n /= members[i], mean[i].b /= members[i];
    return groups;
}

static void visit_nearest(int count, SectionPoint *tour)
{
    for (int i = 0; i + 1 < count; i++) {
        int nearest = i + 1;
        for (int k = i + 2; k < count; k++)
            if (distance(tour[i], tour[k]) < distance(tour[i], tour[nearest]))
                nearest = k;
        SectionPoint swap = tour[i + 1];
        tour[i + 1] = tour[nearest], tour[nearest] = swap;
    }
}

// Reverses parts of the tour while that makes it shorter: two sides that cross are always longer than the two that replace them.
static void shorten(int count, SectionPoint *tour)
{
    enum { ROUNDS = 100 };
    bool shorter = true;
    for (int round = 0; round < ROUNDS && shorter; round++) {
        shorter = false;
        for (int i = 0; i + 2 < count; i++)
            for (int k = i + 2; k < count; k++) {
                if (i == 0 && k == count - 1)
                    continue;
                SectionPoint a = tour[i], b = tour[i + 1], c = tour[k], d = tour[(k + 1) % count];
                if (!(distance(a, c) + distance(b, d) < (distance(a, b) + distance(c, d)) * (1 - 1e-12)))
                    continue;
                for (int low = i + 1, high = k; low < high; low++, high--) {
                    SectionPoint swap = tour[low];
                    tour[low] = tour[high], tour[high] = swap;
                }
                shorter = true;
            }
    }
}

int contour_tour(int count, const SectionPoint *point, double apart, SectionPoint *contour)
{
    SEL_ASSERT(apart > 0, "groups have a width");
    int kept = thin_points(count, point, apart, contour);
    if (kept < 3)
        return 0;
    visit_nearest(kept, contour);
    shorten(kept, contour);
    if (polygon_area(kept, contour) < 0)
        for (int low = 0, high = kept - 1; low < high; low++, high--) {
            SectionPoint swap = contour[low];
            contour[low] = contour[high], contour[high] = swap;
        }
    return kept;
}
