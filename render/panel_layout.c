#include "render/panel_layout.h"

#include <math.h>

// Letters are then 10 to 11 pixels high; below that they cannot be read, and the views of a small window rather give way.
static const double least_scale = 0.78;

// 1 at 1280x720; grows more slowly than the window so that views gain more than text. Multiplied by the display density, as far as 1024x600 points fit into the
// window.
static double text_scale(double width, double height, double density)
{
    double fits = fmin(width / 1024, height / 600);
    density = fmax(0.6, fmin(density, fmax(fits, 0.6)));
    double wide = 1 + 0.00042 * (width / density - 1280), high = 1 + 0.00075 * (height / density - 720);
    return fmax(least_scale, density * fmax(0.85, fmin(wide, high)));
}

static PanelRect place_view(PanelLayout *layout, PanelView view, PanelRect rect, int window_height)
{
    int left = (int)floor(rect.x), top = (int)floor(rect.y), right = (int)floor(rect.x + rect.width), bottom = (int)floor(rect.y + rect.height);
    if (right <= left || bottom <= top)
        right = left, bottom = top;
    layout->view[view] = (ViewPort){0, left, window_height - bottom, right - left, bottom - top};
    return layout->view_rect[view] = (PanelRect){(float)left, (float)top, (float)(right - left), (float)(bottom - top)};
}

// The main view at the left, the other two one above the other.
static void place_all_views(PanelLayout *layout, PanelRect centre, float gap, int window_height)
{
    float main_width = floorf(centre.width * 0.62f), side = centre.width - main_width - gap, half = floorf((centre.height - gap) / 2);
    place_view(layout, VIEW_FLUOROSCOPY, (PanelRect){centre.x, centre.y, main_width, centre.height}, window_height);
    place_view(layout, VIEW_3D, (PanelRect){centre.x + main_width + gap, centre.y, side, half}, window_height);
    place_view(layout, VIEW_ANGIOSCOPY, (PanelRect){centre.x + main_width + gap, centre.y + half + gap, side, centre.height - half - gap}, window_height);
}

PanelLayout panel_layout(int width, int height, double scale, PanelView view, bool has_panels)
{
    PanelLayout layout = {.scale = text_scale(width, height, scale), .main = view == VIEW_ALL ? VIEW_FLUOROSCOPY : view};
    float s = (float)layout.scale, w = (float)width, h = (float)height, gap = ceilf(2 * s);
    if (!has_panels) {
        PanelRect whole = {0, 0, w, h};
        if (view == VIEW_ALL)
            place_all_views(&layout, whole, gap, height);
        else
            place_view(&layout, view, whole, height);
        return layout;
    }
    layout.top = (PanelRect){0, 0, w, floorf(40 * s)};
    float bottom = floorf(66 * s), y = layout.top.height + gap, middle = h - y - bottom - gap;
    layout.bottom = (PanelRect){0, h - bottom, w, bottom};
    float left = floorf(268 * s);
    // the main view keeps slightly more than a square; the insets take the remaining width
    float most = view == VIEW_ALL ? 268 * s : 380 * s;
    float right = floorf(fminf(fmaxf(w - left - 1.15f * middle, 268 * s), most)), right_x = w - right;
    layout.left = (PanelRect){0, y, left, middle};
    layout.right = (PanelRect){right_x, y, right, middle};
    PanelRect centre = {left + gap, y, right_x - left - 2 * gap, middle};
    if (view == VIEW_ALL) {
        place_all_views(&layout, centre, gap, height);
        return layout;
    }
    place_view(&layout, view, centre, height);
    float inset = floorf(fminf(0.75f * right, (middle - 286 * s) / 2 - gap)), inset_y = y;
    for (int i = 0; i < VIEW_COUNT; i++)
        if (i != (int)view) {
            place_view(&layout, (PanelView)i, (PanelRect){right_x, inset_y, right, inset}, height);
            inset_y += inset + gap;
        }
    layout.right.y = inset_y;
    layout.right.height = y + middle - inset_y;
    return layout;
}

static void hide(PanelLayout *layout, PanelView view)
{
    layout->view[view] = (ViewPort){0};
    layout->view_rect[view] = (PanelRect){0};
}

void panel_layout_add_second(PanelLayout *layout, int window_height)
{
    PanelRect *xray = &layout->view_rect[VIEW_FLUOROSCOPY], *top = &layout->view_rect[VIEW_3D], *low = &layout->view_rect[VIEW_ANGIOSCOPY], at;
    const float gap = ceilf(2 * (float)layout->scale);
    if (layout->main != VIEW_FLUOROSCOPY || xray->width <= 0)
        return;
    if (top->width > 0) {
        at = (PanelRect){top->x, top->y, top->width, low->y + low->height - top->y};
        hide(layout, VIEW_3D);
        hide(layout, VIEW_ANGIOSCOPY);
    } else if (layout->right.width > 0) {
        at = layout->right;
        at.height = floorf(fminf(at.width, at.height / 2));
        layout->right.y += at.height + gap;
        layout->right.height -= at.height + gap;
    } else {
        at = *xray;
        float half = floorf((at.width - gap) / 2);
        at.x += half + gap;
        at.width -= half + gap;
        place_view(layout, VIEW_FLUOROSCOPY, (PanelRect){xray->x, xray->y, half, xray->height}, window_height);
    }
    layout->second_rect = at;
    layout->second = (ViewPort){0, (int)at.x, window_height - (int)(at.y + at.height), (int)at.width, (int)at.height};
}

PanelLayout panel_layout_xray_alone(int width, int height, double scale, bool has_panels)
{
    PanelLayout layout = panel_layout(width, height, scale, VIEW_FLUOROSCOPY, has_panels);
    for (int i = 0; i < VIEW_COUNT; i++)
        if (i != VIEW_FLUOROSCOPY)
            place_view(&layout, (PanelView)i, (PanelRect){0}, height);
    layout.right.y = layout.left.y;
    layout.right.height = layout.left.height;
    return layout;
}
