#include "render/silhouette.h"

#include "render/page.h"
#include "render/tick_step.h"

#include <math.h>

enum { BORDER = 18, FOOT = 14 };
static const double margin_mm = 2;

static double axis_of(Vec3 v, int k) { return k == 0 ? v.x : k == 1 ? v.y : v.z; }

void silhouette_widen(Vec3 point, Vec3 *low, Vec3 *high)
{
    *low = vec3(fmin(low->x, point.x), fmin(low->y, point.y), fmin(low->z, point.z));
    *high = vec3(fmax(high->x, point.x), fmax(high->y, point.y), fmax(high->z, point.z));
}

Silhouette silhouette_frame(Vec3 low, Vec3 high, double side)
{
    int thin = 0;
    for (int k = 1; k < 3; k++)
        if (axis_of(high, k) - axis_of(low, k) < axis_of(high, thin) - axis_of(low, thin))
            thin = k;
    Silhouette view = {.across = thin == 0 ? 1 : 0, .up = thin == 2 ? 1 : 2};
    double wide = axis_of(high, view.across) - axis_of(low, view.across) + 2 * margin_mm, tall = axis_of(high, view.up) - axis_of(low, view.up) + 2 * margin_mm;
    view.scale = side / fmax(wide, tall);
    view.left = axis_of(low, view.across) - margin_mm;
    view.bottom = axis_of(low, view.up) - margin_mm;
    view.width = wide * view.scale;
    view.height = tall * view.scale;
    return view;
}

double silhouette_x(const Silhouette *view, Vec3 point) { return BORDER + (axis_of(point, view->across) - view->left) * view->scale; }
double silhouette_y(const Silhouette *view, Vec3 point) { return BORDER + view->height - (axis_of(point, view->up) - view->bottom) * view->scale; }
char silhouette_axis(const Silhouette *view) { return "xyz"[3 - view->across - view->up]; }

void silhouette_begin(FILE *out, const Silhouette *view, const char *id, const char *title)
{
    int width = (int)view->width + 2 * BORDER, height = (int)view->height + 2 * BORDER + FOOT;
    fprintf(out, "<svg role=\"img\" aria-labelledby=\"%s\" viewBox=\"0 0 %d %d\" width=\"%d\" height=\"%d\"><title id=\"%s\">", id, width, height, width,
            height, id);
    page_text(out, title);
    fprintf(out, "</title>\n");
}

void silhouette_wall(FILE *out, const Silhouette *view, const CheckWall *wall)
{
    fprintf(out, "<g class=\"vessel\">");
    for (int i = 0; i < wall->count; i++) {
        double x = silhouette_x(view, wall->from[i]), y = silhouette_y(view, wall->from[i]), u = silhouette_x(view, wall->to[i]);
        double v = silhouette_y(view, wall->to[i]), r = wall->radius[i] * view->scale;
        if (fmax(x, u) < -r || fmin(x, u) > view->width + 2 * BORDER + r || fmax(y, v) < -r || fmin(y, v) > view->height + 2 * BORDER + r)
            continue;
        if (x == u && y == v)
            fprintf(out, "<circle stroke=\"none\" cx=\"%.1f\" cy=\"%.1f\" r=\"%.1f\"/>", x, y, r);
        else
            fprintf(out, "<path stroke-width=\"%.1f\" d=\"M%.1f %.1fL%.1f %.1f\"/>", 2 * r, x, y, u, v);
    }
    fprintf(out, "</g>\n");
}

void silhouette_end(FILE *out, const Silhouette *view)
{
    double length = round_length(0.3 * view->width / view->scale), y = view->height + 2 * BORDER;
    fprintf(out, "<path class=\"axis\" d=\"M%d %.1f h%.1f\"/><text x=\"%d\" y=\"%.1f\">%g mm</text></svg>\n", BORDER, y + 8, length * view->scale, BORDER,
            y + 3, length);
}
