// The live 3D view, pixel by pixel: moving objects are at their projections, cached walls equal newly drawn ones, sections, arrows, broken input.
#include "geom/blobby.h"
#include "geom/tube_mesh.h"
#include "render/vessel_scene.h"
#include "view_stage.h"

static VesselScene *open_scene(const TriangleMesh *mesh, const VesselTree *tree, int target_count, const SceneTarget *target)
{
    char message[256] = "";
    static const Vec3 frame[2] = {{-12, -9, -9}, {12, 9, 9}};
    VesselSceneOptions options = {.vessel = mesh, .tree = tree, .target_count = target_count, .target = target, .frame_count = 2, .frame = frame};
    VesselScene *scene = vessel_scene_create(&options, message, sizeof message);
    if (!scene)
        fail_msg("%s", message);
    return scene;
}

static TriangleMesh *tube_mesh(Vec3 start, Vec3 direction, double length, double radius)
{
    const TubePiece piece = {.length = length};
    const TubeOptions tube = {
        .start = start, .direction = direction, .normal = vec3_normal_to(direction), .radius = radius, .piece_count = 1, .piece = &piece, .closed_ends = true};
    TriangleMesh *mesh = triangle_mesh_of_tube(&tube);
    assert_non_null(mesh);
    return mesh;
}

static void take(ViewStage *stage, VesselScene *scene, const Pose *pose, const VesselSceneLook *look, StagePixels pixels)
{
    vessel_scene_draw(scene, pose, look, stage->port);
    stage_read(stage, pixels);
}

static double distance_to_segment(double x, double y, Vec3 a, Vec3 b)
{
    double dx = b.x - a.x, dy = b.y - a.y, t = ((x - a.x) * dx + (y - a.y) * dy) / fmax(dx * dx + dy * dy, 1e-12);
    t = fmin(fmax(t, 0), 1);
    return hypot(x - a.x - t * dx, y - a.y - t * dy);
}

static void the_wire_lies_where_the_projection_says(void **state)
{
    (void)state;
    ViewStage stage;
    if (!stage_open(&stage))
        skip();
    static StagePixels with, without;
    VesselScene *scene = open_scene(NULL, NULL, 0, NULL);
    VesselSceneLook look = vessel_scene_default_look(scene);
    Pose *pose = straight_pose(20, vec3(-8, -3, 2), vec3_unit(vec3(0.8, 0.3, -0.4)), vec3_unit(vec3(0.3, -0.8, 0)), 0.7, 0.4);
    const ViewPort port = {stage.canvas.framebuffer, 40, 25, 300, 220};
    for (int v = 0; v < 3; v++) {
        free_camera_orbit(&look.camera, 60.0 * v, -35.0 * v);
        stage_clear(&stage, 1, 0, 1);
        vessel_scene_draw(scene, NULL, &look, port);
        stage_read(&stage, without);
        vessel_scene_draw(scene, pose, &look, port);
        stage_read(&stage, with);
        const Camera *camera = vessel_scene_projection(scene);
        Vec3 a = camera_project(camera, pose->position[0]), b = camera_project(camera, pose->position[19]);
        // the port's upper left corner in the canvas, rows from the top
        double left = port.x, top = STAGE_HEIGHT - port.y - port.height, half = 0.4 / camera->mm_per_pixel;
        assert_true(half > 2);
        int inside = 0;
        for (int y = 0; y < STAGE_HEIGHT; y++)
            for (int x = 0; x < STAGE_WIDTH; x++) {
                double d = distance_to_segment(x + 0.5 - left, y + 0.5 - top, a, b);
                bool differs = pixel_difference(with[y][x], without[y][x]) > 0,
                     is_in_port = x >= left && x < left + port.width && y >= top && y < top + port.height;
                if (d < half - 0.6)
                    assert_true(differs);
                if (d > half + 0.6)
                    assert_false(differs);
                inside += d < half;
                if (!is_in_port)
                    assert_true(with[y][x][0] == 255 && with[y][x][1] == 0 && with[y][x][2] == 255);
            }
        assert_true(inside > 200);
    }
    pose_free(pose);
    vessel_scene_destroy(scene);
    stage_close(&stage);
}

static void cached_walls_are_those_drawn_afresh(void **state)
{
    (void)state;
    ViewStage stage;
    if (!stage_open(&stage))
        skip();
    static StagePixels cached, fresh, turned;
    TriangleMesh *mesh = tube_mesh(vec3(-10, 0, 0), vec3_unit(vec3(1, 0.2, 0.1)), 20, 3),
                 *coarse = tube_mesh(vec3(-10, 0, 0), vec3_unit(vec3(1, 0.2, 0.1)), 20, 2);
    char message[256];
    VesselSceneOptions options = {.vessel = mesh, .coarse = coarse};
    VesselScene *scene = vessel_scene_create(&options, message, sizeof message);
    assert_non_null(scene);
    VesselSceneLook look = vessel_scene_default_look(scene);
    FreeCamera home = look.camera;
    Pose *pose = straight_pose(12, vec3(-9, 0, 0), vec3(1, 0, 0), vec3(0, 1, 0), 1, 0.3);
    vessel_scene_draw(scene, pose, &look, stage.port);
    // the tool moves, the walls stay
    for (int k = 0; k < 10; k++) {
        for (int i = 0; i < 12; i++)
            pose->position[i].x += 0.4;
        pose_fill_single_tool(pose);
        vessel_scene_draw(scene, pose, &look, stage.port);
    }
    assert_int_equal(vessel_scene_layer_draws(scene), 1);
    for (int k = 0; k < 5; k++) {
        free_camera_orbit(&look.camera, 20, 7);
        vessel_scene_draw(scene, pose, &look, stage.port);
    }
    stage_read(&stage, turned);
    assert_int_equal(vessel_scene_layer_draws(scene), 6);
    look.camera = home;
    for (int k = 0; k < 5; k++)
        take(&stage, scene, pose, &look, cached);
    assert_int_equal(vessel_scene_layer_draws(scene), 8);   // rotated back, and the full mesh once the camera rests
    // also after another size in between
    const ViewPort small = {stage.canvas.framebuffer, 10, 10, 120, 90};
    vessel_scene_draw(scene, pose, &look, small);
    for (int k = 0; k < 5; k++)
        take(&stage, scene, pose, &look, fresh);
    assert_int_equal(count_different(cached, fresh, 0), 0);
    vessel_scene_destroy(scene);
    scene = vessel_scene_create(&options, message, sizeof message);
    assert_non_null(scene);
    take(&stage, scene, pose, &look, fresh);
    assert_int_equal(count_different(cached, fresh, 0), 0);
    assert_true(count_different(cached, turned, 8) > 500);
    // while rotating, the coarser mesh was drawn
    look.full_detail = true;
    free_camera_orbit(&look.camera, 100, 35);
    for (int k = 0; k < 2; k++) {
        free_camera_orbit(&look.camera, 0, 0);
        vessel_scene_draw(scene, pose, &look, stage.port);
    }
    stage_read(&stage, fresh);
    assert_true(count_different(fresh, turned, 8) > 500);
    pose_free(pose);
    vessel_scene_destroy(scene);
    triangle_mesh_free(mesh);
    triangle_mesh_free(coarse);
    stage_close(&stage);
}

static void a_section_takes_away_what_lies_before_its_plane(void **state)
{
    (void)state;
    ViewStage stage;
    if (!stage_open(&stage))
        skip();
    static StagePixels whole, cut, empty;
    TriangleMesh *mesh = tube_mesh(vec3(-10, 0, 0), vec3(1, 0, 0), 20, 3);
    VesselScene *scene = open_scene(mesh, NULL, 0, NULL), *nothing = open_scene(NULL, NULL, 0, NULL);
    VesselSceneLook look = vessel_scene_default_look(scene);
    look.full_detail = true;
    free_camera_look_along(&look.camera, vec3(0, 1, 0), vec3(0, 0, 1));   // +x to the right
    take(&stage, nothing, NULL, &look, empty);
    take(&stage, scene, NULL, &look, whole);
    const double offset[3] = {-4, 0, 5.5};
    for (int k = 0; k < 3; k++) {
        look.section = true;
        look.section_normal = vec3(2, 0, 0);
        look.section_offset_mm = offset[k];   // from the scene's middle, which is x = 0
        take(&stage, scene, NULL, &look, cut);
        const Camera *camera = vessel_scene_projection(scene);
        double edge = camera_project(camera, vec3(offset[k], 0, 0)).x;
        int gone = 0, kept = 0;
        for (int y = 0; y < STAGE_HEIGHT; y++)
            for (int x = 0; x < STAGE_WIDTH; x++) {
                bool was = pixel_difference(whole[y][x], empty[y][x]) > 0;
                if (x + 0.5 > edge + 1) {
                    assert_int_equal(pixel_difference(cut[y][x], empty[y][x]), 0);
                    gone += was;
                } else if (x + 0.5 < edge - 4) {
                    assert_int_equal(pixel_difference(cut[y][x], whole[y][x]), 0);
                    kept += was;
                }
            }
        assert_true(gone > 500 && kept > 500);
    }
    // towards the eye: the near wall disappears, the inside of the far one stays, as wide as the tube
    look.section_normal = vec3(0, 0, 0);
    look.section_offset_mm = 0;
    take(&stage, scene, NULL, &look, cut);
    int x = STAGE_WIDTH / 2, y = STAGE_HEIGHT / 2;
    assert_true(pixel_difference(cut[y][x], empty[y][x]) > 10 && pixel_difference(cut[y][x], whole[y][x]) > 5);
    // through the tip: the plane moves with it
    look.section_at_tip = true;
    look.section_normal = vec3(1, 0, 0);
    look.show_arrows = false;
    Pose *pose = straight_pose(5, vec3(-5, 0, 0), vec3(1, 0, 0), vec3(0, 1, 0), 1, 0.2);
    take(&stage, scene, pose, &look, cut);
    double edge = camera_project(vessel_scene_projection(scene), pose->position[4]).x;
    int beyond = (int)edge + 8, before = (int)edge - 8;
    assert_int_equal(pixel_difference(cut[y + 12][beyond], empty[y + 12][beyond]), 0);
    assert_int_equal(pixel_difference(cut[y + 12][before], whole[y + 12][before]), 0);
    pose_free(pose);
    vessel_scene_destroy(scene);
    vessel_scene_destroy(nothing);
    triangle_mesh_free(mesh);
    stage_close(&stage);
}

static void arrows_stand_only_where_there_is_force(void **state)
{
    (void)state;
    ViewStage stage;
    if (!stage_open(&stage))
        skip();
    static StagePixels with, without;
    VesselScene *scene = open_scene(NULL, NULL, 0, NULL);
    VesselSceneLook look = vessel_scene_default_look(scene);
    free_camera_look_along(&look.camera, vec3(0, 1, 0), vec3(0, 0, 1));
    Pose *pose = straight_pose(21, vec3(-10, 0, 0), vec3(1, 0, 0), vec3(0, 1, 0), 1, 0.2);
    // nodes in the sheath have no wall that pushes them
    pose->first_free_node = 3;
    pose->node[1].force = vec3(0, 0, 0.5);
    for (int loaded = 0; loaded < 2; loaded++) {
        if (loaded)
            pose->node[14].force = vec3(0, 0, 0.5);   // the wall pushes upwards: the arrow comes from below
        look.show_arrows = false;
        take(&stage, scene, pose, &look, without);
        look.show_arrows = true;
        take(&stage, scene, pose, &look, with);
        if (!loaded) {
            assert_int_equal(count_different(with, without, 0), 0);
            continue;
        }
        Vec3 node = camera_project(vessel_scene_projection(scene), pose->position[14]);
        int below = 0, count = 0;
        for (int y = 0; y < STAGE_HEIGHT; y++)
            for (int x = 0; x < STAGE_WIDTH; x++)
                if (pixel_difference(with[y][x], without[y][x]) > 0) {
                    assert_true(fabs(x + 0.5 - node.x) < 8 && y + 0.5 > node.y - 6 && y + 0.5 < node.y + 90);
                    below += y + 0.5 > node.y;
                    count++;
                }
        assert_true(count > 60 && below > 0.9 * count);
        // and the tool is yellow there, grey at its free end
        const uint8_t *hot = with[(int)node.y][(int)node.x],
                      *cold = with[(int)node.y][(int)camera_project(vessel_scene_projection(scene), pose->position[20]).x];
        assert_true(hot[0] > hot[2] + 60 && hot[1] > hot[2] + 40);
        assert_true(abs(cold[0] - cold[2]) < 40);
    }
    pose_free(pose);
    vessel_scene_destroy(scene);
    stage_close(&stage);
}

// A tree of one node with one blob: its model's surface is a sphere.
static VesselTree *sphere_tree(Vec3 center, double radius)
{
    VesselTree *tree = vessel_tree_create(1, 0, 1);
    assert_non_null(tree);
    tree->center[0] = center;
    tree->radius[0] = radius;
    tree->direction[0] = vec3(1, 0, 0);
    tree->height[0] = radius;
    tree->parent[0] = -1;
    tree->blob_center[0] = center;
    tree->blob_width[0] = blob_width_for_radius(radius, tree->iso_level);
    tree->blob_offset[1] = 1;
    return vessel_tree_link(tree) ? tree : NULL;
}

static void the_tip_s_own_model_is_a_wireframe(void **state)
{
    (void)state;
    ViewStage stage;
    if (!stage_open(&stage))
        skip();
    static StagePixels with, without;
    const Vec3 center = {2, 1, -1};
    VesselTree *tree = sphere_tree(center, 4);
    VesselScene *scene = open_scene(NULL, tree, 0, NULL);
    VesselSceneLook look = vessel_scene_default_look(scene);
    Pose *pose = straight_pose(10, vec3(-6, 0, 0), vec3(1, 0, 0), vec3(0, 1, 0), 1, 0.2);
    const int node[4] = {0, -1, 1, -7};
    for (int k = 0; k < 4; k++) {
        pose->node[9].vessel_node = node[k];
        look.show_model = false;
        take(&stage, scene, pose, &look, without);
        look.show_model = true;
        take(&stage, scene, pose, &look, with);
        if (node[k] != 0) {
            assert_int_equal(count_different(with, without, 0), 0);
            continue;
        }
        const Camera *camera = vessel_scene_projection(scene);
        Vec3 middle = camera_project(camera, center);
        double furthest = 0, radius = 4 / camera->mm_per_pixel;
        int lit = 0, inside = 0;
        for (int y = 0; y < STAGE_HEIGHT; y++)
            for (int x = 0; x < STAGE_WIDTH; x++) {
                double d = hypot(x + 0.5 - middle.x, y + 0.5 - middle.y);
                bool differs = pixel_difference(with[y][x], without[y][x]) > 12;
                furthest = differs ? fmax(furthest, d) : furthest;
                inside += d < radius;
                lit += differs;
            }
        assert_true(furthest < radius + 1.5 && furthest > 0.95 * radius);
        assert_true(lit > 0.15 * inside && lit < 0.8 * inside);   // lines, not a filled area
    }
    pose_free(pose);
    vessel_scene_destroy(scene);
    vessel_tree_free(tree);
    stage_close(&stage);
}

static void a_tool_is_dimmed_by_the_walls_before_it(void **state)
{
    (void)state;
    ViewStage stage;
    if (!stage_open(&stage))
        skip();
    static StagePixels with, without;
    TriangleMesh *mesh = tube_mesh(vec3(-8, 0, 0), vec3(1, 0, 0), 16, 3);
    VesselScene *scene = open_scene(mesh, NULL, 0, NULL);
    VesselSceneLook look = vessel_scene_default_look(scene);
    look.full_detail = true;
    for (int from = 1; from >= -1; from -= 2) {
        free_camera_look_along(&look.camera, vec3(0, from, 0), vec3(0, 0, 1));
        take(&stage, scene, NULL, &look, without);
        const double depth[3] = {5, 0, -5};   // towards the eye: in front, inside, behind
        double contrast[3];
        for (int k = 0; k < 3; k++) {
            Vec3 back = vessel_scene_projection(scene)->back;
            Pose *pose = straight_pose(9, vec3_add(vec3(-4, 0, 0), vec3_scale(back, depth[k])), vec3(1, 0, 0), vec3(0, 1, 0), 1, 0.4);
            take(&stage, scene, pose, &look, with);
            contrast[k] = pixel_difference(with[STAGE_HEIGHT / 2][STAGE_WIDTH / 2], without[STAGE_HEIGHT / 2][STAGE_WIDTH / 2]);
            pose_free(pose);
        }
        assert_true(contrast[0] > 1.05 * contrast[1] && contrast[1] > 1.1 * contrast[2] && contrast[2] > 20);
    }
    vessel_scene_destroy(scene);
    triangle_mesh_free(mesh);
    stage_close(&stage);
}

static void labels_and_scale_bar_are_those_of_the_picture(void **state)
{
    (void)state;
    ViewStage stage;
    if (!stage_open(&stage))
        skip();
    const SceneTarget target[2] = {{.name = "near", .point = {3, 1, 2}, .radius = 1.5}, {.name = "far away", .point = {900, 0, 0}, .radius = 1}};
    VesselSceneOptions options = {.target_count = 2, .target = target, .has_entry = true, .entry = {-5, 0, 0}, .entry_direction = {1, 0, 0}};
    char message[256];
    VesselScene *scene = vessel_scene_create(&options, message, sizeof message);
    assert_non_null(scene);
    VesselSceneLook look = vessel_scene_default_look(scene);
    look.camera.focus = vec3(0, 0, 0);
    look.camera.width_mm = look.camera.height_mm = 30;
    VesselSceneLabel label[8];
    vessel_scene_draw(scene, NULL, &look, stage.port);
    assert_int_equal(vessel_scene_labels(scene, label, 8), 3);
    assert_true(isnan(label[0].distance_mm));
    Pose *pose = straight_pose(8, vec3(-5, 0, 0), vec3(1, 0, 0), vec3(0, 1, 0), 1, 0.2);
    vessel_scene_draw(scene, pose, &look, stage.port);
    assert_int_equal(vessel_scene_labels(scene, label, 2), 2);
    assert_int_equal(vessel_scene_labels(scene, label, 8), 4);
    const Camera *camera = vessel_scene_projection(scene);
    Vec3 p = camera_project(camera, target[0].point);
    assert_true(fabs(label[0].x - p.x) < 1e-9 && fabs(label[0].y - p.y) < 1e-9 && label[0].is_in_view);
    assert_true(fabs(label[0].radius * camera->mm_per_pixel - 1.5) < 1e-9);
    assert_true(fabs(label[0].distance_mm - vec3_distance(target[0].point, pose->position[7])) < 1e-9);
    assert_false(label[1].is_in_view);
    assert_int_equal(label[2].kind, LABEL_SHEATH);
    assert_int_equal(label[3].kind, LABEL_TIP);
    for (int k = 0; k < 40; k++) {
        free_camera_zoom(&look.camera, k % 2 ? -k : k, 10, 20, STAGE_WIDTH, STAGE_HEIGHT);
        vessel_scene_draw(scene, pose, &look, stage.port);
        ScaleBar bar = vessel_scene_scale_bar(scene, 120);
        double power = pow(10, floor(log10(bar.length_mm * 1.0001))), head = bar.length_mm / power;
        assert_true(fabs(head - 1) < 1e-6 || fabs(head - 2) < 1e-6 || fabs(head - 5) < 1e-6);
        assert_true(bar.pixels <= 120 + 1e-9 && bar.pixels > 120 / 2.5 - 1e-9);
        assert_true(fabs(bar.pixels * vessel_scene_projection(scene)->mm_per_pixel - bar.length_mm) < 1e-9 * bar.length_mm);
    }
    pose_free(pose);
    vessel_scene_destroy(scene);
    stage_close(&stage);
}

static void the_free_camera_does_what_the_mouse_does(void **state)
{
    (void)state;
    const Vec3 point[4] = {{10, 20, 30}, {14, 22, 60}, {11, 25, 45}, {30, 21, 40}};
    FreeCamera home = free_camera_framing(4, point), camera = home;
    const int width = 640, height = 360;
    Camera view = free_camera_projection(&home, width, height, 100);
    for (int i = 0; i < 4; i++) {
        Vec3 p = camera_project(&view, point[i]);
        assert_true(p.x > 0 && p.x < width && p.y > 0 && p.y < height);
    }
    // pan: the point under the mouse stays under it
    Vec3 before = camera_project(&view, point[2]);
    free_camera_pan(&camera, 31, -17, width, height);
    view = free_camera_projection(&camera, width, height, 100);
    Vec3 after = camera_project(&view, point[2]);
    assert_true(fabs(after.x - before.x - 31) < 1e-9 && fabs(after.y - before.y + 17) < 1e-9);
    // zoom about a pixel: it stays, and all other points move away from it by the factor
    free_camera_zoom(&camera, 3, after.x, after.y, width, height);
    view = free_camera_projection(&camera, width, height, 100);
    Vec3 zoomed = camera_project(&view, point[2]);
    assert_true(fabs(zoomed.x - after.x) < 1e-9 && fabs(zoomed.y - after.y) < 1e-9);
    assert_true(fabs(home.width_mm / camera.width_mm - pow(1.15, 3)) < 1e-9);
    // orbit: the focus stays, nearer points follow the mouse, lengths stay
    Vec3 near = vec3_add_scaled(camera.focus, 5, view.back);
    free_camera_orbit(&camera, 10, 4);
    view = free_camera_projection(&camera, width, height, 100);
    Vec3 focus = camera_project(&view, camera.focus), moved = camera_project(&view, near);
    assert_true(fabs(focus.x - width / 2.0) < 1e-9 && fabs(focus.y - height / 2.0) < 1e-9);
    assert_true(moved.x > focus.x + 1 && moved.y > focus.y + 0.3);
    for (int k = 0; k < 5000; k++)
        free_camera_orbit(&camera, 7, -3);
    view = free_camera_projection(&camera, width, height, 100);
    assert_true(fabs(vec3_norm(view.right) - 1) < 1e-12 && fabs(vec3_dot(view.right, view.up)) < 1e-12);
    assert_true(vec3_distance(vec3_cross(view.right, view.up), view.back) < 1e-12);
    // zooming has a limit
    for (int k = 0; k < 500; k++)
        free_camera_zoom(&camera, 5, 0, 0, width, height);
    assert_true(camera.width_mm > home.width_mm / 401 && camera.width_mm < home.width_mm / 399);
    for (int k = 0; k < 500; k++)
        free_camera_zoom(&camera, -5, 0, 0, width, height);
    assert_true(camera.width_mm < 20.1 * home.width_mm);
    free_camera_look_along(&camera, vec3(-1, 0, 0), vec3(0, 0, 1));
    view = free_camera_projection(&camera, width, height, 100);
    assert_true(vec3_distance(view.back, vec3(1, 0, 0)) < 1e-12 && vec3_distance(view.up, vec3(0, 0, 1)) < 1e-12);
    for (int i = 0; i < 4; i++) {
        Vec3 p = camera_project(&view, point[i]);
        assert_true(p.x > 0 && p.x < width && p.y > 0 && p.y < height);
    }
    free_camera_look_along(&camera, vec3(0, 0, -1), vec3(0, -1, 0));
    view = free_camera_projection(&camera, width, height, 100);
    assert_true(vec3_distance(view.back, vec3(0, 0, 1)) < 1e-12 && vec3_distance(view.up, vec3(0, -1, 0)) < 1e-12);
    free_camera_reset(&camera);
    assert_memory_equal(&camera, &home, sizeof home);
}

static void the_view_follows_the_tip_without_redrawing_at_each_step(void **state)
{
    (void)state;
    ViewStage stage;
    if (!stage_open(&stage))
        skip();
    TriangleMesh *mesh = tube_mesh(vec3(-60, 0, 0), vec3(1, 0, 0), 120, 3);
    VesselScene *scene = open_scene(mesh, NULL, 0, NULL);
    VesselSceneLook look = vessel_scene_default_look(scene);
    look.camera.width_mm = look.camera.height_mm = 20;
    look.follow_tip = true;
    Pose *pose = straight_pose(10, vec3(-55, 0, 0), vec3(1, 0, 0), vec3(0, 1, 0), 1, 0.2);
    const int frames = 400;
    for (int k = 0; k < frames; k++) {
        for (int i = 0; i < 10; i++)
            pose->position[i].x += 0.2;
        pose_fill_single_tool(pose);
        vessel_scene_draw(scene, pose, &look, stage.port);
        VesselSceneLabel label[2];
        assert_int_equal(vessel_scene_labels(scene, label, 2), 1);
        assert_true(fabs(label[0].x - STAGE_WIDTH / 2) < STAGE_WIDTH / 4.0 && fabs(label[0].y - STAGE_HEIGHT / 2) < STAGE_HEIGHT / 4.0);
    }
    assert_true(vessel_scene_layer_draws(scene) < 0.6 * frames);
    pose_free(pose);
    vessel_scene_destroy(scene);
    triangle_mesh_free(mesh);
    stage_close(&stage);
}

static bool is_white(const uint8_t *p) { return p[0] > 110 && p[1] > 110 && p[2] > 110; }
static bool is_blue(const uint8_t *p) { return p[2] > p[0] + 40 && p[2] > 80; }
static bool is_dark(const uint8_t *p) { return p[0] < 70 && p[1] < 70 && p[2] < 110; }

// A catheter of R 1.0 and lumen 0.6 with a wire of 0.25 mm, close up and from far away, from many sides: the wire is white along the axis up to its tip,
// between blue walls, with the dark lumen beside it; where there is no wire the catheter is not cut open; labels are at both tips.
static void a_tool_is_seen_in_the_one_around_it(void **state)
{
    (void)state;
    ViewStage stage;
    if (!stage_open(&stage))
        skip();
    static StagePixels pixels;
    static const Vec3 frame[2] = {{-1, -6, -6}, {17, 6, 6}};
    CoaxialLooks two;
    coaxial_looks(&two, 1, 0.6, 0.25);
    char message[256];
    VesselSceneOptions options = {.tools = &two.looks, .frame_count = 2, .frame = frame};
    VesselScene *scene = vessel_scene_create(&options, message, sizeof message);
    assert_non_null(scene);
    const double wire[3] = {16, 6.3, 10};
    for (int view = 0; view < 18; view++) {
        VesselSceneLook look = vessel_scene_default_look(scene);
        free_camera_orbit(&look.camera, 21.0 * view, -17.0 * view);
        bool is_far = view % 2 == 1;         // all widths are the smallest ones
        look.camera.width_mm *= is_far ? 6 : 1;
        look.camera.height_mm *= is_far ? 6 : 1;
        Pose *pose = coaxial_pose(10, wire[view / 2 % 3], 0.7, 1, 0.25);
        double wire_tip = wire[view / 2 % 3];
        take(&stage, scene, pose, &look, pixels);
        const Camera *camera = vessel_scene_projection(scene);
        double pixel = camera->mm_per_pixel;
        for (double x = 0.8; x < fmax(10, wire_tip) - 0.3; x += 0.31) {
            Vec3 p = camera_project(camera, vec3(x, 0, 0)), q = camera_project(camera, vec3(x + 1, 0, 0));
            double dx = q.x - p.x, dy = q.y - p.y, length = hypot(dx, dy), margin = 1.5 * pixel;
            if (length * pixel < 0.3)        // nearly along the axis
                continue;
            double across[2] = {-dy / length, dx / length};
            const uint8_t *axis = pixels[(int)p.y][(int)p.x];
            if (x < wire_tip - margin && !is_white(axis))
                fail_msg("view %d: the wire is not seen at %.2f mm: %d %d %d", view, x, axis[0], axis[1], axis[2]);
            if (x > wire_tip + 0.3 + 3 * margin && x < 10 - 0.3)
                assert_true(is_blue(axis));
            if (is_far || x > 9.5)
                continue;
            for (int side = -1; side <= 1; side += 2) {
                double wall = side * 0.8 / pixel, lumen = side * 0.45 / pixel;
                assert_true(is_blue(pixels[(int)(p.y + wall * across[1])][(int)(p.x + wall * across[0])]));
                if (x < wire_tip - 0.5)
                    assert_true(is_dark(pixels[(int)(p.y + lumen * across[1])][(int)(p.x + lumen * across[0])]));
            }
        }
        VesselSceneLabel label[4];
        assert_int_equal(vessel_scene_labels(scene, label, 4), 2);
        for (int k = 0; k < 2; k++) {
            Vec3 tip = camera_project(camera, vec3(k ? wire_tip : 10, 0, 0));
            assert_true(label[k].kind == LABEL_TIP && fabs(label[k].x - tip.x) < 1e-9 && fabs(label[k].y - tip.y) < 1e-9);
            assert_string_equal(label[k].name, k ? "wire" : "catheter");
        }
        pose_free(pose);
    }
    // the force on the catheter's wall colours the catheter, not the wire in it
    VesselSceneLook look = vessel_scene_default_look(scene);
    look.show_arrows = false;
    free_camera_look_along(&look.camera, vec3(0, 1, 0), vec3(0, 0, 1));
    Pose *pose = coaxial_pose(10, 16, 0.5, 1, 0.25);
    for (int i = 8; i < 13; i++)
        pose->node[i].force = vec3(0, 0, 0.5);
    take(&stage, scene, pose, &look, pixels);
    Vec3 p = camera_project(vessel_scene_projection(scene), vec3(5, 0, 0));
    const uint8_t *wall = pixels[(int)(p.y + 0.8 / vessel_scene_projection(scene)->mm_per_pixel)][(int)p.x];
    assert_true(wall[0] > wall[2] + 60 && is_white(pixels[(int)p.y][(int)p.x]));
    pose_free(pose);
    vessel_scene_destroy(scene);
    stage_close(&stage);
}

static void broken_input_is_refused_or_left_out(void **state)
{
    (void)state;
    ViewStage stage;
    if (!stage_open(&stage))
        skip();
    char message[256] = "";
    TriangleMesh *mesh = tube_mesh(vec3(-5, 0, 0), vec3(1, 0, 0), 10, 2);
    int good = mesh->triangle[3][1];
    mesh->triangle[3][1] = mesh->vertex_count;
    VesselSceneOptions options = {.vessel = mesh};
    assert_null(vessel_scene_create(&options, message, sizeof message));
    assert_true(strlen(message) > 0);
    mesh->triangle[3][1] = good;
    SceneTarget target = {.name = "nowhere", .point = {NAN, 0, 0}, .radius = 1};
    options = (VesselSceneOptions){.vessel = mesh, .target_count = 1, .target = &target, .has_entry = true, .entry = {0, INFINITY, 0}};
    VesselScene *scene = vessel_scene_create(&options, message, sizeof message);
    assert_non_null(scene);
    VesselSceneLook look = vessel_scene_default_look(scene);
    look.follow_tip = look.section = look.section_at_tip = true;
    Pose *pose = straight_pose(12, vec3(-3, 0, 0), vec3(1, 0, 0), vec3(0, 1, 0), 1, 0.2);
    static StagePixels pixels;
    for (int k = 0; k < 4; k++) {
        if (k == 1)
            pose->position[5].y = NAN;
        if (k == 2)
            pose->position[11].x = INFINITY, pose->node[3].force = vec3(NAN, 0, 1), pose->node[4].radius = NAN;
        if (k == 3)
            pose->first_free_node = 11;
        pose_fill_single_tool(pose);
        vessel_scene_draw(scene, pose, &look, stage.port);
        const ViewPort tiny = {stage.canvas.framebuffer, 3, 3, 1, 1}, none = {stage.canvas.framebuffer, 0, 0, 0, 20};
        vessel_scene_draw(scene, pose, &look, tiny);
        vessel_scene_draw(scene, pose, &look, none);
        assert_int_equal(glGetError(), GL_NO_ERROR);
        take(&stage, scene, pose, &look, pixels);
        assert_true(pixels[0][0][0] < 60 && pixels[0][0][2] > 10);   // the background is visible again
    }
    pose_free(pose);
    vessel_scene_destroy(scene);
    triangle_mesh_free(mesh);
    stage_close(&stage);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_wire_lies_where_the_projection_says),
        cmocka_unit_test(cached_walls_are_those_drawn_afresh),
        cmocka_unit_test(a_section_takes_away_what_lies_before_its_plane),
        cmocka_unit_test(arrows_stand_only_where_there_is_force),
        cmocka_unit_test(the_tip_s_own_model_is_a_wireframe),
        cmocka_unit_test(a_tool_is_dimmed_by_the_walls_before_it),
        cmocka_unit_test(labels_and_scale_bar_are_those_of_the_picture),
        cmocka_unit_test(the_free_camera_does_what_the_mouse_does),
        cmocka_unit_test(the_view_follows_the_tip_without_redrawing_at_each_step),
        cmocka_unit_test(a_tool_is_seen_in_the_one_around_it),
        cmocka_unit_test(broken_input_is_refused_or_left_out),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
