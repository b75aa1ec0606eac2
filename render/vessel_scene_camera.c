// The axes of the projection are the rows of the rotation matrix: right = q x q*, up = q y q*, back = q z q*.
#include "render/vessel_scene_camera.h"

#include <stddef.h>

static const double turn_per_pixel = 0.4 * PI / 180, zoom_per_notch = 1.15, extent_least = 1 / 400.0, extent_most = 20;

static Vec3 right_of(const FreeCamera *camera) { return quat_rotate(camera->turn, vec3(1, 0, 0)); }
static Vec3 up_of(const FreeCamera *camera) { return quat_rotate(camera->turn, vec3(0, 1, 0)); }
static Vec3 back_of(const FreeCamera *camera) { return quat_rotate(camera->turn, vec3(0, 0, 1)); }

static Quat turn_of(Vec3 right, Vec3 up, Vec3 back)
{
    Mat3 axes = mat3_from_columns(right, up, back);
    return quat_from_mat3(&axes);
}

static double mm_per_pixel(const FreeCamera *camera, int width, int height)
{
    return fmax(camera->width_mm / (width > 1 ? width : 1), camera->height_mm / (height > 1 ? height : 1));
}

static const double margin = 1.10;   // relative to the framed extent

// The rectangle around the points for the current orientation of the camera.
static void frame_points(FreeCamera *camera, int count, const Vec3 *point)
{
    Camera view = {.right = right_of(camera), .up = up_of(camera), .back = back_of(camera)};
    // a view of one by one pixel, made far too wide or too high, gives the other extent; both are computed
    const int side = 1000000;
    camera_frame(&view, 1, side, 0, count, point, count > 0 ? 0 : 10);
    camera->width_mm = fmax(margin * view.mm_per_pixel, 1e-3);
    camera_frame(&view, side, 1, 0, count, point, count > 0 ? 0 : 10);
    camera->height_mm = fmax(margin * view.mm_per_pixel, 1e-3);
    camera->focus = view.center;
}

FreeCamera free_camera_framing(int count, const Vec3 *point)
{
    Camera view = {0};
    camera_orient(&view, vec3(0, 0, 0), vec3(0, 0, 0), count, point);
    FreeCamera camera = {.turn = turn_of(view.right, view.up, view.back), .low = {-10, -10, -10}, .high = {10, 10, 10}};
    for (int i = 0; i < count; i++) {
        Vec3 p = point[i], low = i ? camera.low : p, high = i ? camera.high : p;
        camera.low = vec3(fmin(low.x, p.x), fmin(low.y, p.y), fmin(low.z, p.z));
        camera.high = vec3(fmax(high.x, p.x), fmax(high.y, p.y), fmax(high.z, p.z));
    }
    frame_points(&camera, count, point);
    free_camera_set_home(&camera);
    return camera;
}

// Multiplies the rotation from the left: about an axis fixed in space.
static void turn_about(FreeCamera *camera, Vec3 axis, double angle)
{
    camera->turn = quat_unit(quat_mul(quat_from_rotation_vector(vec3_scale(axis, angle)), camera->turn));
}

void free_camera_orbit(FreeCamera *camera, double dx, double dy)
{
    Vec3 right = right_of(camera), up = up_of(camera);
    // the scene rotates about +up and +right, so the camera rotates in the opposite sense
    turn_about(camera, vec3_add(vec3_scale(up, dx), vec3_scale(right, dy)), -turn_per_pixel);
}

void free_camera_pan(FreeCamera *camera, double dx, double dy, int width, int height)
{
    double scale = mm_per_pixel(camera, width, height);
    camera->focus = vec3_add_scaled(vec3_add_scaled(camera->focus, -dx * scale, right_of(camera)), dy * scale, up_of(camera));
}

void free_camera_zoom(FreeCamera *camera, double notch, double x, double y, int width, int height)
{
    double size = camera->width_mm / camera->home_width_mm, scaled = size * pow(zoom_per_notch, -notch);
    double factor = fmin(fmax(scaled, extent_least), extent_most) / size;
    double before = mm_per_pixel(camera, width, height), away = x - width / 2.0, below = y - height / 2.0;
    camera->width_mm *= factor;
    camera->height_mm *= factor;
    double moved = before - mm_per_pixel(camera, width, height);
    camera->focus = vec3_add_scaled(vec3_add_scaled(camera->focus, away * moved, right_of(camera)), -below * moved, up_of(camera));
}

void free_camera_reset(FreeCamera *camera)
{
    camera->focus = camera->home_focus;
    camera->turn = camera->home_turn;
    camera->width_mm = camera->home_width_mm;
    camera->height_mm = camera->home_height_mm;
}

void free_camera_set_home(FreeCamera *camera)
{
    camera->home_focus = camera->focus;
    camera->home_turn = camera->turn;
    camera->home_width_mm = camera->width_mm;
    camera->home_height_mm = camera->height_mm;
}

void free_camera_turn_along(FreeCamera *camera, Vec3 view, Vec3 up)
{
    Camera axes = {0};
    camera_orient(&axes, view, up, 0, NULL);
    camera->turn = turn_of(axes.right, axes.up, axes.back);
}

void free_camera_look_along(FreeCamera *camera, Vec3 view, Vec3 up)
{
    free_camera_turn_along(camera, view, up);
    Vec3 corner[8];
    for (int k = 0; k < 8; k++)
        corner[k] = vec3(k & 1 ? camera->high.x : camera->low.x, k & 2 ? camera->high.y : camera->low.y, k & 4 ? camera->high.z : camera->low.z);
    frame_points(camera, 8, corner);
}

Camera free_camera_projection(const FreeCamera *camera, int width, int height, double depth)
{
    return (Camera){.right = right_of(camera),
                    .up = up_of(camera),
                    .back = back_of(camera),
                    .center = camera->focus,
                    .mm_per_pixel = mm_per_pixel(camera, width, height),
                    .near_depth = depth,
                    .far_depth = -depth,
                    .width = width,
                    .height = height};
}
