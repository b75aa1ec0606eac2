// Closed polygons as contours of sections.
#include "geom/section.h"

double polygon_area(int count, const SectionPoint *contour)
{
    double twice = 0;
    for (int i = 0, k = count - 1; i < count; k = i++)
        twice += (contour[k].n - contour[0].n) * (contour[i].b - contour[0].b) - (contour[i].n - contour[0].n) * (contour[k].b - contour[0].b);
    return 0.5 * twice;
}

SectionPoint polygon_centre(int count, const SectionPoint *contour)
{
    SectionPoint sum = {0, 0}, from = contour[0];
    double twice = 0;
    for (int i = 0, k = count - 1; i < count; k = i++) {
        double n0 = contour[k].n - from.n, b0 = contour[k].b - from.b, n1 = contour[i].n - from.n, b1 = contour[i].b - from.b, part = n0 * b1 - n1 * b0;
        twice += part;
        sum.n += part * (n0 + n1) / 3, sum.b += part * (b0 + b1) / 3;
    }
    return twice != 0 ? (SectionPoint){from.n + sum.n / twice, from.b + sum.b / twice} : from;
}

bool polygon_contains(int count, const SectionPoint *contour, double n, double b)
{
    bool inside = false;
    for (int i = 0, k = count - 1; i < count; k = i++) {
        const SectionPoint *p = &contour[k], *q = &contour[i];
        if ((p->b > b) != (q->b > b) && n < p->n + (b - p->b) / (q->b - p->b) * (q->n - p->n))
            inside = !inside;
    }
    return inside;
}

void polygon_smooth(int count, const SectionPoint *contour, double tension, int steps, SectionPoint *curve)
{
    SEL_ASSERT(count >= 3 && steps >= 1, "a closed contour has three points");
    for (int i = 0; i < count; i++) {
        const SectionPoint *p0 = &contour[(i + count - 1) % count], *p1 = &contour[i], *p2 = &contour[(i + 1) % count], *p3 = &contour[(i + 2) % count];
        for (int s = 0; s < steps; s++) {
            double u = (double)s / steps, u2 = u * u, u3 = u2 * u, t = tension;
            double w0 = -t * u + 2 * t * u2 - t * u3, w1 = 1 + (t - 3) * u2 + (2 - t) * u3, w2 = t * u + (3 - 2 * t) * u2 + (t - 2) * u3, w3 = -t * u2 + t * u3;
            curve[i * steps + s] = (SectionPoint){w0 * p0->n + w1 * p1->n + w2 * p2->n + w3 * p3->n, w0 * p0->b + w1 * p1->b + w2 * p2->b + w3 * p3->b};
        }
    }
}
