// Vessel and tool: the large view, the close-up of the tip, and several moments side by side.
//
// Several tools share one centreline and are swept along the same points, so each is centred in the one around it.
//
// Depth: the tube of the tool, arrows and target spheres are opaque and write depth; the wall of the vessel, back and front faces, is blended over them from
// far to near, so that a tool inside is seen through exactly the walls in front of it.
#include "render/message.h"
#include "render/picture_page.h"

#include <stdlib.h>

typedef struct RunDrawing {
    PicturePage *page;
    const PictureOptions *options;
    const PictureScene *scene;
    ShellStyle style;
    double force_scale;        // [N] top of the colour map
    Primitives primitives;
    double *radius, *lumen;    // (longest tool and its tip) scratch memory
    Vec3 *point;
    Color *color;
    double thickest;           // [mm] radius of the thickest tool
    int frame_count;
    Vec3 *frame_point;         // points that the camera must show
} RunDrawing;

static const Color TARGET_COLOR = {0, 114, 178, 255}, ARROW_COLOR = {0, 120, 105, 255}, SHEATH_COLOR = {120, 124, 130, 255};

static bool check_input(const PictureScene *scene, int tool_count, const PictureTool *tool, char *message, size_t capacity)
{
    if (tool_count < 1 || tool_count > 6)
        return message_fail(message, capacity, "cannot draw %d moments; expected 1 to 6", tool_count);
    for (int k = 0; k < tool_count; k++) {
        if (tool[k].node_count < 2 || !tool[k].position || !tool[k].radius)
            return message_fail(message, capacity, "a tool of %d nodes cannot be drawn; expected at least 2", tool[k].node_count);
        for (int i = 0; i < tool[k].node_count; i++)
            if (!vec3_is_finite(tool[k].position[i]) || !isfinite(tool[k].radius[i]) || (tool[k].force && !vec3_is_finite(tool[k].force[i])))
                return message_fail(message, capacity, "node %d of the tool is not a finite number: nothing is drawn", i);
    }
    for (int i = 0; i < scene->target_count; i++)
        if (!vec3_is_finite(scene->target[i].point) || !isfinite(scene->target[i].radius))
            return message_fail(message, capacity, "target %d is not a finite number: nothing is drawn", i);
    if (scene->vessel)
        for (int i = 0; i < scene->vessel->vertex_count; i++)
            if (!vec3_is_finite(scene->vessel->vertex[i]))
                return message_fail(message, capacity, "vertex %d of the surface is not a finite number: nothing is drawn", i);
    return true;
}

static int first_free(const PictureTool *tool)
{
    return tool->first_free_node < 0 ? 0 : tool->first_free_node > tool->node_count - 2 ? tool->node_count - 2 : tool->first_free_node;
}

// The points framed by the camera: the vessel or, without one, the free part of the tools; targets; the mouth of the sheath.
static bool gather_frame(RunDrawing *drawing, int tool_count, const PictureTool *tool)
{
    const PictureScene *scene = drawing->scene;
    bool has_vessel = scene->vessel && scene->vessel->vertex_count > 0;
    size_t count = has_vessel ? (size_t)scene->vessel->vertex_count : 0;
    for (int k = 0; k < tool_count && !has_vessel; k++)
        count += (size_t)(tool[k].node_count - first_free(&tool[k]));
    drawing->frame_point = malloc((count + 6 * (size_t)scene->target_count + 1) * sizeof *drawing->frame_point);
    if (!drawing->frame_point)
        return false;
    int n = 0;
    for (int i = 0; has_vessel && i < scene->vessel->vertex_count; i++)
        drawing->frame_point[n++] = scene->vessel->vertex[i];
    for (int k = 0; k < tool_count && !has_vessel; k++)
        for (int i = first_free(&tool[k]); i < tool[k].node_count; i++)
            drawing->frame_point[n++] = tool[k].position[i];
    for (int i = 0; i < scene->target_count; i++) {
        const SceneTarget *target = &scene->target[i];
        const double r = target->radius;
        const Vec3 corner[6] = {{r, 0, 0}, {-r, 0, 0}, {0, r, 0}, {0, -r, 0}, {0, 0, r}, {0, 0, -r}};
        for (int k = 0; k < 6; k++)
            drawing->frame_point[n++] = vec3_add(target->point, corner[k]);
    }
    if (scene->has_entry)
        drawing->frame_point[n++] = scene->entry;
    drawing->frame_count = n;
    return true;
}

// Frames everything visible, with extra depth for the thickness of the tools and for arrows, since a planar tool has no depth.
static void frame_all(const RunDrawing *drawing, Camera *camera, int width, int height, double border, double scale)
{
    camera_frame(camera, width, height, border, drawing->frame_count, drawing->frame_point, 0);
    double room = drawing->thickest + 80 * scale * camera->mm_per_pixel;
    camera->near_depth += room;
    camera->far_depth -= room;
}

static double largest_force(int tool_count, const PictureTool *tool)
{
    double largest = 0;
    for (int k = 0; k < tool_count; k++)
        for (int i = 0; tool[k].force && i < tool[k].node_count; i++)
            largest = fmax(largest, vec3_norm(tool[k].force[i]));
    return largest;
}

// [mm] of the arrow for a force at the top of the scale
static double arrow_length(const RunDrawing *drawing, const Camera *camera)
{
    return fmin(64 * drawing->page->scale, 0.12 * (camera->width < camera->height ? camera->width : camera->height)) * camera->mm_per_pixel;
}

// One arrow for each piece of the tool of about 16 pixels: the sum of the forces on its nodes, with its head at the tool where the wall pushes.
static void add_arrows(RunDrawing *drawing, const Camera *camera, const PictureTool *tool, double line)
{
    if (!tool->force || !drawing->options->arrows)
        return;
    double stretch = 16 * drawing->page->scale * camera->mm_per_pixel, longest = arrow_length(drawing, camera);
    for (int i = first_free(tool); i < tool->node_count;) {
        Vec3 sum = {0, 0, 0}, place = {0, 0, 0};
        double weight = 0, radius = 0, length = 0;
        int last = i;
        while (last < tool->node_count && (last == i || length < stretch)) {
            double size = vec3_norm(tool->force[last]);
            sum = vec3_add(sum, tool->force[last]);
            place = vec3_add_scaled(place, size, tool->position[last]);
            weight += size;
            radius = fmax(radius, fmax(tool->radius[last], line));
            if (last + 1 < tool->node_count)
                length += vec3_distance(tool->position[last], tool->position[last + 1]);
            last++;
        }
        i = last;
        double size = vec3_norm(sum);
        if (!(size > 0.02 * drawing->force_scale))
            continue;
        place = vec3_scale(place, 1 / weight);
        Vec3 direction = vec3_scale(sum, 1 / size);
        // square root, so that a tenth of the force is still visible
        double long_as = longest * sqrt(fmin(size / drawing->force_scale, 2));
        Vec3 tip = vec3_add_scaled(place, -radius, direction);
        primitives_arrow(&drawing->primitives, vec3_add_scaled(tip, -long_as, direction), tip, line, ARROW_COLOR);
    }
}

// Fills the points of tool k: the nodes of the centreline up to its end, and its tip if that lies between two nodes; with radius, lumen and colour. Returns
// their number.
// *open_count: number of points up to the last one with another tool inside.
static int lay_tool(RunDrawing *drawing, const PictureTool *tool, int k, const double *end, double thin, int *open_count)
{
    const Pose *pose = tool->pose;
    const PoseTool *own = &pose->tool[k];
    const ToolLook *look = tool_looks_of(tool->looks, k, own->fitted);
    int whole = (int)end[k] + 1, count = whole, node = own->node_count - 2;
    for (int i = 0; i < whole; i++)
        drawing->point[i] = tool->position[i];
    if (end[k] - (whole - 1) > 1e-6)
        drawing->point[count++] = own->node[own->node_count - 1].position;
    *open_count = 0;
    double s = own->node[own->node_count - 1].s;
    for (int i = count - 1; i >= 0; i--) {
        double at = i < whole ? i : end[k];
        int inside = 0;
        bool touches = true;
        for (int other = 0; other < pose->tool_count; other++) {
            inside += other > k && end[other] >= at;
            touches = touches && (other >= k || end[other] < at);
        }
        s -= i + 1 < count ? vec3_distance(drawing->point[i + 1], drawing->point[i]) : 0;
        while (node > 0 && own->node[node].s > s)
            node--;
        *open_count = inside > 0 && i >= *open_count ? i + 1 : *open_count;
        double radius = fmax(own->node[node].radius, thin * (1 + 1.1 * inside)), lumen = tool_look_at(look, s)->lumen;
        drawing->radius[i] = radius;
        drawing->lumen[i] = lumen > 0 ? fmin(fmax(lumen, inside > 0 ? thin * (1.1 * inside + 0.2) : 0), radius - 0.5 * thin) : 0;
        double force = touches && tool->force && i < tool->node_count ? vec3_norm(tool->force[i]) : 0;
        drawing->color[i] = i < first_free(tool) ? SHEATH_COLOR : force > 0 ? color_sequential(force / drawing->force_scale) : look->on_paper;
    }
    return count;
}

// Adds nodes `first` to `last` of the filled points, cut open or whole.
static void add_stretch(RunDrawing *drawing, int first, int last, bool is_open, const Camera *camera)
{
    Color inside = color_rgb(232, 234, 238);
    int count = last - first + 1;
    bool is_hollow = false;
    for (int i = first; i <= last; i++)
        is_hollow |= drawing->lumen[i] > 0;
    if (is_hollow)
        primitives_pipe(&drawing->primitives, count, drawing->point + first, drawing->radius + first, drawing->lumen + first, drawing->color + first, inside,
                        is_open ? &camera->back : NULL);
    else
        primitives_tube(&drawing->primitives, count, drawing->point + first, drawing->radius + first, drawing->color + first);
}

static void add_coaxial_tools(RunDrawing *drawing, const Camera *camera, const PictureTool *tool, double thin, int stub)
{
    double end[STEP_TOOLS_MAX];
    for (int k = 0; k < tool->pose->tool_count; k++)
        end[k] = pose_tool_end(tool->pose, k);
    for (int k = 0; k < tool->pose->tool_count; k++) {
        int open_count, count = lay_tool(drawing, tool, k, end, thin, &open_count), mouth = first_free(tool);
        if (k == 0 && stub < mouth)
            add_stretch(drawing, stub, mouth < count ? mouth : count - 1, false, camera);
        if (open_count - 1 > mouth)
            add_stretch(drawing, mouth, open_count - 1, true, camera);
        int closed = open_count - 1 > mouth ? open_count - 1 : mouth;
        if (closed < count - 1)
            add_stretch(drawing, closed, count - 1, false, camera);
    }
}

static bool has_several(const PictureTool *tool) { return tool->pose && tool->looks && tool->pose->tool_count > 1; }

static void add_tool(RunDrawing *drawing, const Camera *camera, const PictureTool *tool)
{
    double thin = 1.0 * drawing->page->scale * camera->mm_per_pixel;   // at least two pixels wide
    int free_node = first_free(tool);
    for (int i = 0; i < tool->node_count; i++) {
        drawing->radius[i] = fmax(tool->radius[i], thin);
        drawing->color[i] = i < free_node ? SHEATH_COLOR : color_sequential(tool->force ? vec3_norm(tool->force[i]) / drawing->force_scale : 0);
    }
    // only a short stub is shown behind the mouth
    int first = free_node;
    double stub = 0, most = 30 * drawing->page->scale * camera->mm_per_pixel;
    while (first > 0 && stub < most) {
        stub += vec3_distance(tool->position[first], tool->position[first - 1]);
        first--;
    }
    if (has_several(tool))
        add_coaxial_tools(drawing, camera, tool, thin, first);
    else
        primitives_tube(&drawing->primitives, tool->node_count - first, tool->position + first, drawing->radius + first, drawing->color + first);
    add_arrows(drawing, camera, tool, thin);
}

static void add_targets(RunDrawing *drawing, const Camera *camera)
{
    double line = 0.75 * drawing->page->scale * camera->mm_per_pixel;
    for (int i = 0; i < drawing->scene->target_count; i++) {
        const SceneTarget *target = &drawing->scene->target[i];
        primitives_circle(&drawing->primitives, target->point, camera->back, target->radius, line, TARGET_COLOR);
        const Vec3 tilted[2] = {vec3_unit(vec3_add_scaled(camera->right, 0.35, camera->back)), vec3_unit(vec3_add_scaled(camera->up, 0.35, camera->back))};
        for (int k = 0; k < 2; k++)
            primitives_circle(&drawing->primitives, target->point, tilted[k], target->radius, 0.6 * line, TARGET_COLOR);
    }
}

// One 3D panel with its upper left corner at (x, y) of the page.
static bool draw_panel(RunDrawing *drawing, const Camera *camera, const ShellStyle *style, const PictureTool *tool, double x, double y)
{
    GlCanvas *panel = picture_page_begin_panel(drawing->page, camera->width, camera->height);
    if (!panel)
        return false;
    primitives_clear(&drawing->primitives);
    drawing->primitives.origin = camera->center;
    add_tool(drawing, camera, tool);
    add_targets(drawing, camera);
    if (drawing->scene->has_entry)
        primitives_sphere(&drawing->primitives, drawing->scene->entry, 4 * drawing->page->scale * camera->mm_per_pixel, SHEATH_COLOR);
    if (drawing->primitives.is_short_of_memory)
        return message_fail(drawing->page->message, drawing->page->capacity, "out of memory for a picture");
    surface_view_draw_primitives(drawing->page->view, camera, &drawing->primitives, style);
    surface_view_draw_shell(drawing->page->view, camera, style);
    picture_page_end_panel(drawing->page, panel, x, y);
    return true;
}

// Writes the names beside the target spheres and the entry, kept inside the panel.
static void label_panel(RunDrawing *drawing, const Camera *camera, double x, double y)
{
    PicturePage *page = drawing->page;
    double s = page->scale;
    for (int i = 0; i < drawing->scene->target_count + drawing->scene->has_entry; i++) {
        bool is_target = i < drawing->scene->target_count;
        const char *name = is_target ? drawing->scene->target[i].name : "sheath";
        Vec3 place = is_target ? drawing->scene->target[i].point : drawing->scene->entry, p = camera_project(camera, place);
        if (p.x < 0 || p.y < 0 || p.x > camera->width || p.y > camera->height)
            continue;
        double width, height, away = is_target ? drawing->scene->target[i].radius / camera->mm_per_pixel + 4 * s : 8 * s;
        overlay_text_size(page->overlay, TEXT_NORMAL, name, &width, &height);
        bool fits_right = p.x + away + width < camera->width - 4 * s;
        double left = fits_right ? p.x + away : fmax(p.x - away - width, 2 * s), top = fmin(fmax(p.y - height / 2, 2 * s), camera->height - height - 2 * s);
        picture_page_label(page, x + left, y + top, 0, TEXT_NORMAL, is_target ? TARGET_COLOR : PAGE_MUTED, name);
    }
}

// Width of the lumen at the tip: distance to the nearest wall plus distance to the wall opposite. 0 if there is no vessel.
static double lumen_width_at(const TriangleMesh *mesh, Vec3 tip)
{
    double near_wall = HUGE_VAL, far_wall = HUGE_VAL;
    Vec3 outward = {1, 0, 0};
    for (int i = 0; mesh && i < mesh->vertex_count; i++) {
        double d = vec3_distance(mesh->vertex[i], tip);
        if (d < near_wall) {
            near_wall = d;
            outward = mesh->normal[i];
        }
    }
    for (int i = 0; mesh && i < mesh->vertex_count; i++) {
        Vec3 d = vec3_sub(mesh->vertex[i], tip);
        double along = -vec3_dot(d, outward), off = vec3_norm(vec3_add_scaled(d, along, outward));
        if (along > 0 && off < 0.2 * along + 0.1 && vec3_dot(mesh->normal[i], outward) < -0.5)
            far_wall = fmin(far_wall, along);
    }
    return isfinite(near_wall) && isfinite(far_wall) ? near_wall + far_wall : 0;
}

static double inset_radius_of(const RunDrawing *drawing, Vec3 tip)
{
    if (drawing->options->inset_radius > 0)
        return drawing->options->inset_radius;
    double width = lumen_width_at(drawing->scene->vessel, tip);
    return width > 0 ? fmin(fmax(2.2 * width, 4), 12) : 6;
}

static Camera close_up_camera(const Camera *whole, Vec3 tip, double radius, int side)
{
    Camera camera = *whole;
    camera_frame_sphere(&camera, side, side, 0, tip, radius);
    return camera;
}

// Fades branches in front of the tip so that they do not hide it.
static ShellStyle close_up_style(const RunDrawing *drawing, double radius)
{
    ShellStyle style = drawing->style;
    style.fade_from = (float)(0.8 * radius);
    style.fade_to = (float)(1.4 * radius);
    return style;
}

// Outlines the square of the large view that the close-up shows.
static void outline_close_up(RunDrawing *drawing, const Camera *whole, const Camera *close, double x, double y)
{
    Vec3 p = camera_project(whole, close->center);
    double half = 0.5 * close->width * close->mm_per_pixel / whole->mm_per_pixel;
    overlay_push_clip(drawing->page->overlay, x, y, whole->width, whole->height);
    overlay_rectangle(drawing->page->overlay, x + p.x - half, y + p.y - half, 2 * half, 2 * half, PAGE_MUTED, 1.2 * drawing->page->scale);
    overlay_pop_clip(drawing->page->overlay);
}

static void force_bar(RunDrawing *drawing, double x, double y, double width)
{
    bool milli = drawing->force_scale < 1;
    picture_page_color_bar(drawing->page, x, y, width, 14 * drawing->page->scale, color_sequential, 0, 0, drawing->force_scale * (milli ? 1000 : 1),
                           milli ? "wall force on a node [mN]" : "wall force on a node [N]");
}

static void readings_text(char *text, size_t capacity, const PictureTool *tool)
{
    if (has_several(tool)) {     // the legend shows these figures for each tool
        snprintf(text, capacity, "t %.2f s", tool->time_s);
        return;
    }
    snprintf(text, capacity, "t %.2f s   inserted %.1f mm   push %.3g N   torque %.3g N mm", tool->time_s, tool->inserted_mm, tool->push_force_n,
             tool->torque_n_mm);
}

// Lists each tool with its colour and the forces on its hand. Returns the height.
static double write_tools(RunDrawing *drawing, const PictureTool *tool, double x, double y)
{
    PicturePage *page = drawing->page;
    double s = page->scale, line = 23 * s;
    for (int k = 0; k < tool->pose->tool_count; k++, y += 2 * line) {
        const PoseTool *own = &tool->pose->tool[k];
        const ToolLook *look = &tool->looks->tool[k];
        overlay_fill(page->overlay, x, y + 3 * s, 14 * s, 14 * s, look->on_paper);
        picture_page_text(page, x + 22 * s, y, TEXT_NORMAL, PAGE_INK, "%s, %.1f mm inserted", look->name, own->inserted_mm);
        picture_page_text(page, x + 22 * s, y + 0.9 * line, TEXT_NORMAL, PAGE_MUTED, "push %.3g N, torque %.3g N mm", own->push_n, own->torque_n_mm);
    }
    return 2 * line * tool->pose->tool_count + 6 * s;
}

// Writes the figures. Returns the height of the text.
static double write_facts(RunDrawing *drawing, const PictureTool *tool, double x, double y, double width)
{
    PicturePage *page = drawing->page;
    double line = 23 * page->scale;
    int touching = 0, targets = drawing->scene->target_count < 6 ? drawing->scene->target_count : 6;
    double largest = largest_force(1, tool);
    for (int i = 0; tool->force && i < tool->node_count; i++)
        touching += vec3_norm2(tool->force[i]) > 0;
    picture_page_text(page, x, y, TEXT_NORMAL, PAGE_INK, "largest %.3g %s, %d nodes touch the wall", largest < 1 ? 1000 * largest : largest,
                      largest < 1 ? "mN" : "N", touching);
    Vec3 tip = tool->position[tool->node_count - 1];
    picture_page_text(page, x, y + line, TEXT_NORMAL, PAGE_INK, "tip (%.1f, %.1f, %.1f) mm", tip.x, tip.y, tip.z);
    overlay_push_clip(page->overlay, x, y, width, page->height - y);
    for (int i = 0; i < targets; i++) {
        const SceneTarget *target = &drawing->scene->target[i];
        double away = vec3_distance(tip, target->point);
        picture_page_text(page, x, y + (2 + i) * line, TEXT_NORMAL, TARGET_COLOR, "%s: %.1f mm from the tip%s", target->name, away,
                          away <= target->radius ? ", reached" : "");
    }
    overlay_pop_clip(page->overlay);
    return (2 + targets) * line;
}

// Draws the same scene from the right.
static bool draw_side_view(RunDrawing *drawing, const Camera *whole, const PictureTool *tool, double x, double y, double width, double height)
{
    PicturePage *page = drawing->page;
    double s = page->scale;
    Camera side = {.right = vec3_negate(whole->back), .up = whole->up, .back = whole->right};
    frame_all(drawing, &side, (int)width, (int)height, 12 * s, s);
    if (!draw_panel(drawing, &side, &drawing->style, tool, x, y))
        return false;
    picture_page_label(page, x + 8 * s, y + 6 * s, 0, TEXT_SMALL, PAGE_MUTED, "from the right");
    picture_page_scale_bar(page, x + 14 * s, y + (int)height - 10 * s, 0.2 * width, side.mm_per_pixel, PAGE_INK);
    return true;
}

static bool draw_run(RunDrawing *drawing, const PictureTool *tool)
{
    PicturePage *page = drawing->page;
    const PictureOptions *options = drawing->options;
    double s = page->scale, gap = 20 * s, top = 62 * s, column = fmin(0.32 * page->width, 0.56 * page->height);
    int width = (int)(page->width - column - 3 * gap), height = (int)(page->height - top - gap);
    Camera whole = {0};
    camera_orient(&whole, options->view, options->up, drawing->frame_count, drawing->frame_point);
    frame_all(drawing, &whole, width, height, 34 * s, s);
    if (options->focus_radius > 0)
        camera_frame_sphere(&whole, width, height, 8 * s, options->focus, options->focus_radius);
    if (!draw_panel(drawing, &whole, &drawing->style, tool, gap, top))
        return false;
    label_panel(drawing, &whole, gap, top);
    picture_page_scale_bar(page, gap + 16 * s, top + height - 14 * s, 0.22 * width, whole.mm_per_pixel, PAGE_INK);

    double left = page->width - gap - column, below = top;
    if (options->inset) {
        Vec3 tip = tool->position[tool->node_count - 1];
        double radius = inset_radius_of(drawing, tip);
        Camera close = close_up_camera(&whole, tip, radius, (int)column);
        ShellStyle style = close_up_style(drawing, radius);
        if (!draw_panel(drawing, &close, &style, tool, left, top))
            return false;
        label_panel(drawing, &close, left, top);
        overlay_rectangle(page->overlay, left, top, (int)column, (int)column, PAGE_MUTED, 1.2 * s);
        outline_close_up(drawing, &whole, &close, gap, top);
        picture_page_scale_bar(page, left + 14 * s, top + column - 12 * s, 0.3 * column, close.mm_per_pixel, PAGE_INK);
        below += column + 18 * s;
    }
    force_bar(drawing, left, below, column);
    below += 62 * s;
    if (has_several(tool))
        below += write_tools(drawing, tool, left, below);
    below += write_facts(drawing, tool, left, below, column) + 14 * s;
    double room_below = page->height - gap - below;
    if (room_below > 140 * s && !draw_side_view(drawing, &whole, tool, left, below, column, room_below))
        return false;

    char text[256];
    readings_text(text, sizeof text, tool);
    double wide;
    overlay_text_size(page->overlay, TEXT_NORMAL, text, &wide, NULL);
    double title = picture_page_title(page, gap, 18 * s, page->width - 2 * gap - wide - 28 * s, options->title);
    double start = gap + (title > 0 ? title + 28 * s : 0);
    overlay_text(page->overlay, start, 23 * s, TEXT_NORMAL, PAGE_INK, text);
    overlay_push_clip(page->overlay, start + wide, 0, page->width - gap - start - wide, top);
    if (tool->label)
        picture_page_text(page, start + wide + 24 * s, 23 * s, TEXT_NORMAL, PAGE_MUTED, "%s", tool->label);
    overlay_pop_clip(page->overlay);
    return true;
}

// The corner of a panel (0 to 3: upper left, upper right, lower left, lower right) whose square of `side` pixels hides least.
static int emptiest_corner(const RunDrawing *drawing, const Camera *camera, const PictureTool *tool, double side)
{
    int hidden[4] = {0};
    int tool_nodes = tool->node_count - first_free(tool);
    for (int i = 0; i < drawing->frame_count + tool_nodes; i++) {
        bool is_tool = i >= drawing->frame_count;
        Vec3 p = camera_project(camera, is_tool ? tool->position[first_free(tool) + i - drawing->frame_count] : drawing->frame_point[i]);
        bool left = p.x<side, right = p.x> camera->width - side, upper = p.y<side, lower = p.y> camera->height - side;
        int weight = is_tool ? 50 : 1;
        hidden[0] += weight * (left && upper);
        hidden[1] += weight * (right && upper);
        hidden[2] += weight * (left && lower) + (left && lower);   // the scale bar is there
        hidden[3] += weight * (right && lower);
    }
    int best = 3;
    for (int k = 2; k >= 0; k--)
        if (hidden[k] < hidden[best])
            best = k;
    return best;
}

static bool draw_moment(RunDrawing *drawing, const Camera *whole, const PictureTool *tool, double x, double y, double header)
{
    PicturePage *page = drawing->page;
    double s = page->scale;
    char text[256];
    int length = snprintf(text, sizeof text, "t %.2f s", tool->time_s), tools = has_several(tool) ? tool->pose->tool_count : 0;
    if (tools == 0)
        snprintf(text + length, sizeof text - (size_t)length, "   inserted %.1f mm   push %.3g N", tool->inserted_mm, tool->push_force_n);
    for (int k = 0; k < tools; k++)
        length += snprintf(text + length, sizeof text - (size_t)length, "   %.31s %.1f mm, %.3g N", tool->looks->tool[k].name, tool->pose->tool[k].inserted_mm,
                           tool->pose->tool[k].push_n);
    overlay_push_clip(page->overlay, x, y, whole->width, header);
    if (tool->label)
        picture_page_text(page, x, y, TEXT_NORMAL, PAGE_INK, "%s", tool->label);
    picture_page_text(page, x, y + (tool->label ? 22 * s : 4 * s), tool->label ? TEXT_SMALL : TEXT_NORMAL, tool->label ? PAGE_MUTED : PAGE_INK, "%s", text);
    overlay_pop_clip(page->overlay);
    double top = y + header;
    if (!draw_panel(drawing, whole, &drawing->style, tool, x, top))
        return false;
    label_panel(drawing, whole, x, top);
    picture_page_scale_bar(page, x + 12 * s, top + whole->height - 12 * s, 0.22 * whole->width, whole->mm_per_pixel, PAGE_INK);
    if (!drawing->options->inset)
        return true;
    Vec3 tip = tool->position[tool->node_count - 1];
    int side = (int)(0.38 * fmin(whole->width, whole->height));
    // at least twice the scale of the view beside it
    double radius = inset_radius_of(drawing, tip), largest = side * whole->mm_per_pixel / 4.5;
    if (!(drawing->options->inset_radius > 0))
        radius = fmin(radius, largest);
    Camera close = close_up_camera(whole, tip, radius, side);
    int corner = emptiest_corner(drawing, whole, tool, side);
    double left = x + (corner & 1 ? whole->width - side : 0), above = top + (corner & 2 ? whole->height - side : 0);
    outline_close_up(drawing, whole, &close, x, top);
    ShellStyle style = close_up_style(drawing, radius);
    if (!draw_panel(drawing, &close, &style, tool, left, above))
        return false;
    overlay_rectangle(page->overlay, left, above, side, side, PAGE_MUTED, 1.2 * s);
    picture_page_scale_bar(page, left + 10 * s, above + side - 8 * s, 0.36 * side, close.mm_per_pixel, PAGE_INK);
    return true;
}

typedef struct MomentLayout {
    Camera camera;
    int columns;
    double top, header, gap, height;   // [pixel]; height: of the page
} MomentLayout;

// Chooses the number of rows for which the vessel is largest.
static MomentLayout lay_out_moments(const RunDrawing *drawing, int tool_count)
{
    const PictureOptions *options = drawing->options;
    double s = picture_page_scale_of(options), foot = 66 * s, border = 26 * s;
    MomentLayout layout = {.columns = tool_count, .header = 46 * s, .gap = 16 * s, .top = options->title ? 54 * s : 14 * s};
    Camera camera = {0};
    camera_orient(&camera, options->view, options->up, drawing->frame_count, drawing->frame_point);
    double best = HUGE_VAL;
    for (int columns = tool_count; columns >= 1; columns--) {
        int rows = (tool_count + columns - 1) / columns;
        int width = (int)fmax((options->width - layout.gap * (columns + 1)) / columns, 16);
        int height = (int)fmax((options->height - layout.top - foot) / rows - layout.header, 16);
        frame_all(drawing, &camera, width, height, border, s);
        if (options->focus_radius > 0)
            camera_frame_sphere(&camera, width, height, 4 * s, options->focus, options->focus_radius);
        else {
            // no higher than the contents, but never flatter than 3 to 1
            double tall = camera_height_of(&camera, drawing->frame_count, drawing->frame_point) + 2 * border;
            camera.height = (int)fmin(height, fmax(tall, width / 3.0));
        }
        if (camera.mm_per_pixel < 0.97 * best) {
            best = camera.mm_per_pixel;
            layout.columns = columns;
            layout.camera = camera;
            layout.height = layout.top + foot + rows * (layout.header + camera.height);
        }
    }
    return layout;
}

static bool draw_moments(RunDrawing *drawing, const MomentLayout *layout, int tool_count, const PictureTool *tool)
{
    PicturePage *page = drawing->page;
    double s = page->scale, gap = layout->gap;
    picture_page_title(page, gap, 14 * s, page->width - 2 * gap, drawing->options->title);
    for (int k = 0; k < tool_count; k++) {
        double x = gap + (k % layout->columns) * (layout->camera.width + gap);
        double y = layout->top + (k / layout->columns) * (layout->camera.height + layout->header);
        if (!draw_moment(drawing, &layout->camera, &tool[k], x, y, layout->header))
            return false;
    }
    force_bar(drawing, gap, page->height - 56 * s, fmin(420 * s, page->width - 2 * gap));
    return true;
}

static bool draw_on(PicturePage *page, RunDrawing *drawing, const char *path, int tool_count, const PictureTool *tool, const MomentLayout *layout)
{
    drawing->page = page;
    return surface_view_set_mesh(page->view, drawing->scene->vessel, page->message, page->capacity) &&
           (layout ? draw_moments(drawing, layout, tool_count, tool) : draw_run(drawing, tool)) && picture_page_save(page, path);
}

static bool draw(const char *path, const PictureOptions *options, const PictureScene *scene, int tool_count, const PictureTool *tool, bool is_single,
                 char *message, size_t capacity)
{
    if (!check_input(scene, tool_count, tool, message, capacity))
        return false;
    RunDrawing drawing = {.options = options, .scene = scene, .style = shell_style_glass()};
    double largest = largest_force(tool_count, tool);
    drawing.force_scale = options->force_full_scale > 0 ? options->force_full_scale : largest > 0 ? picture_page_scale_end(largest) : 0.1;
    int longest = 0;
    for (int k = 0; k < tool_count; k++)
        for (int i = 0; i < tool[k].node_count; i++)
            drawing.thickest = fmax(drawing.thickest, tool[k].radius[i]);
    for (int k = 0; k < tool_count; k++)
        longest = tool[k].node_count > longest ? tool[k].node_count : longest;
    size_t points = (size_t)longest + 1;
    drawing.radius = malloc(points * sizeof *drawing.radius);
    drawing.lumen = malloc(points * sizeof *drawing.lumen);
    drawing.point = malloc(points * sizeof *drawing.point);
    drawing.color = malloc(points * sizeof *drawing.color);
    bool drawn = false;
    if (!drawing.radius || !drawing.lumen || !drawing.point || !drawing.color || !gather_frame(&drawing, tool_count, tool))
        message_fail(message, capacity, "out of memory for a picture");
    else {
        PicturePage page;
        MomentLayout layout = lay_out_moments(&drawing, tool_count);
        if (picture_page_open(&page, options, is_single ? options->height : (int)ceil(layout.height), message, capacity)) {
            drawn = draw_on(&page, &drawing, path, tool_count, tool, is_single ? NULL : &layout);
            picture_page_close(&page);
        }
    }
    free(drawing.radius);
    free(drawing.lumen);
    free(drawing.point);
    free(drawing.color);
    free(drawing.frame_point);
    primitives_free(&drawing.primitives);
    return drawn;
}

bool picture_of_run(const char *path, const PictureOptions *options, const PictureScene *scene, const PictureTool *tool, char *message, size_t capacity)
{
    return draw(path, options, scene, 1, tool, true, message, capacity);
}

bool picture_of_moments(const char *path, const PictureOptions *options, const PictureScene *scene, int tool_count, const PictureTool *tool, char *message,
                        size_t capacity)
{
    return draw(path, options, scene, tool_count, tool, false, message, capacity);
}
