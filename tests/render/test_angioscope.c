// Angioscopy, pixel by pixel: an exact tube is equally bright all around, its far end is where its axis is projected, mirrored scenes give mirrored pictures,
// normals are those of the vessel, the eye stays inside; broken input.
#include "geom/tube_mesh.h"
#include "render/angioscope.h"
#include "view_stage.h"
#include "../geom/near.h"

enum { SIDE = 300 };           // of a square port in the lower left corner of the canvas

static const double tool_radius = 0.18;

typedef struct TubeScene {
    TriangleMesh *mesh;
    Vessel *vessel;
    Angioscope *scope;
} TubeScene;

static TubeScene open_tube(Vec3 start, Vec3 direction, double length, double radius)
{
    const TubePiece piece = {.length = length};
    const TubeOptions tube = {.start = start, .direction = direction, .normal = vec3_normal_to(direction), .radius = radius, .piece_count = 1, .piece = &piece};
    Faults faults;
    faults_clear(&faults);
    char message[256] = "";
    TubeScene scene = {.mesh = triangle_mesh_of_tube(&tube), .vessel = tube_vessel_create(&tube, "tube", &faults)};
    assert_non_null(scene.mesh);
    assert_non_null(scene.vessel);
    scene.scope = angioscope_create(scene.mesh, scene.vessel, NULL, message, sizeof message);
    if (!scene.scope)
        fail_msg("%s", message);
    return scene;
}

static void close_tube(TubeScene *scene)
{
    angioscope_destroy(scene->scope);
    scene->vessel->destroy(scene->vessel);
    triangle_mesh_free(scene->mesh);
}

static ViewPort square(const ViewStage *stage) { return (ViewPort){stage->canvas.framebuffer, 0, 0, SIDE, SIDE}; }

// Pixel of the square port, from its upper left corner.
static double brightness(StagePixels pixels, double x, double y)
{
    const uint8_t *p = pixels[(int)y + STAGE_HEIGHT - SIDE][(int)x];
    return p[0] + p[1] + p[2];
}

// Position of a direction in the square port.
static Vec3 seen_at(const AngioscopeView *view, Vec3 direction)
{
    double z = vec3_dot(direction, view->forward) * view->half_angle_tan;
    return vec3(SIDE / 2.0 * (1 + vec3_dot(direction, view->right) / z), SIDE / 2.0 * (1 - vec3_dot(direction, view->up) / z), 0);
}

// Places a tool in the tube so that the eye lies on the tube's axis, looking along `look`.
static Pose *pose_with_eye_at(const TubeScene *scene, Vec3 eye, Vec3 look, AngioscopeView *view)
{
    Pose *pose = straight_pose(12, vec3_add_scaled(eye, -11, look), look, vec3_normal_to(look), 1, tool_radius);
    for (int k = 0; k < 3; k++) {
        assert_true(angioscope_view(scene->scope, pose, 0, view));
        Vec3 off = vec3_sub(eye, view->eye);
        for (int i = 0; i < 12; i++)
            pose->position[i] = vec3_add(pose->position[i], off);
        pose_fill_single_tool(pose);
    }
    assert_true(angioscope_view(scene->scope, pose, 0, view));
    assert_true(vec3_distance(view->eye, eye) < 1e-9);
    return pose;
}

static void a_straight_tube_is_evenly_round(void **state)
{
    (void)state;
    ViewStage stage;
    if (!stage_open(&stage))
        skip();
    static StagePixels pixels;
    const Vec3 direction[3] = {{1, 0, 0}, {0, 0, -1}, {0.48, -0.6, 0.64}};
    for (int d = 0; d < 3; d++) {
        Vec3 start = {40, -20, 7};
        TubeScene scene = open_tube(start, direction[d], 200, 3);
        AngioscopeView view;
        Pose *pose = pose_with_eye_at(&scene, vec3_add_scaled(start, 50, direction[d]), direction[d], &view);
        angioscope_draw(scene.scope, pose, 0, square(&stage));
        stage_read(&stage, pixels);
        double last = 1e9;
        for (double radius = 130; radius >= 10; radius -= 20) {
            double low = 1e9, high = 0, sum = 0;
            int count = 0;
            // the tool comes in from below
            for (double angle = -20; angle <= 200; angle += 5, count++) {
                double value = brightness(pixels, SIDE / 2.0 + radius * cos(angle * PI / 180), SIDE / 2.0 - radius * sin(angle * PI / 180));
                low = fmin(low, value);
                high = fmax(high, value);
                sum += value;
            }
            // the change of light over a pixel, and the sides of the mesh: 3 percent and 4 grey levels
            assert_true(high - low < 0.03 * high + 12);
            assert_true(sum / count < last);   // brightness falls with distance
            last = sum / count;
        }
        assert_true(last < 60);
        // the tool's end is in the picture, below the middle
        Vec3 tip = seen_at(&view, vec3_sub(pose->position[11], view.eye));
        assert_true(fabs(tip.x - SIDE / 2.0) < 1 && tip.y > 0.55 * SIDE && tip.y < 0.9 * SIDE);
        const uint8_t *steel = pixels[STAGE_HEIGHT - 8][SIDE / 2], *wall = pixels[STAGE_HEIGHT - SIDE + 8][SIDE / 2];
        assert_true(abs(steel[0] - steel[2]) < 30 && wall[0] > wall[2] + 40);
        pose_free(pose);
        close_tube(&scene);
    }
    stage_close(&stage);
}

static void the_far_end_lies_where_the_axis_is_seen(void **state)
{
    (void)state;
    ViewStage stage;
    if (!stage_open(&stage))
        skip();
    static StagePixels pixels;
    const Vec3 axis = {0.48, 0.36, 0.8};
    TubeScene scene = open_tube(vec3(0, 0, 0), axis, 300, 2.5);
    const double side[3] = {0, 0.2, -0.3}, below[3] = {0.2, 0.3, 0.1};   // so that the tool, at the lower rim, does not hide it
    for (int k = 0; k < 3; k++) {
        AngioscopeView view;
        Vec3 up = vec3_normal_to(axis), look = vec3_add_scaled(vec3_add_scaled(axis, -below[k], up), side[k], vec3_cross(axis, up));
        Pose *pose = pose_with_eye_at(&scene, vec3_scale(axis, 60), vec3_unit(look), &view);
        angioscope_draw(scene.scope, pose, 0, square(&stage));
        stage_read(&stage, pixels);
        Vec3 expected = seen_at(&view, axis);
        double x = 0, y = 0, count = 0;
        for (int j = 0; j < SIDE; j++)
            for (int i = 0; i < SIDE; i++)
                if (brightness(pixels, i, j) < 30) {
                    x += i + 0.5;
                    y += j + 0.5;
                    count++;
                }
        assert_true(expected.y < 0.47 * SIDE && count > 40);
        assert_true(hypot(x / count - expected.x, y / count - expected.y) < 3);
        pose_free(pose);
    }
    close_tube(&scene);
    stage_close(&stage);
}

static Vec3 mirror(Vec3 v) { return vec3(-v.x, v.y, v.z); }

static void a_mirrored_scene_gives_a_mirrored_picture(void **state)
{
    (void)state;
    ViewStage stage;
    if (!stage_open(&stage))
        skip();
    static StagePixels one, other;
    const TubePiece piece[2] = {{.length = 20}, {.arc_radius = 12, .angle = 1.6}};
    TubeOptions tube = {.start = {3, 0, 0}, .direction = vec3_unit(vec3(0.5, 0.7, 0.2)), .radius = 2, .piece_count = 2, .piece = piece};
    tube.normal = vec3_unit(vec3_cross(tube.direction, vec3(0.1, 0.2, 0.9)));
    TubeOptions reflected = tube;
    reflected.start = mirror(tube.start), reflected.direction = mirror(tube.direction), reflected.normal = mirror(tube.normal);
    Faults faults;
    faults_clear(&faults);
    Vessel *vessel[2] = {tube_vessel_create(&tube, "a", &faults), tube_vessel_create(&reflected, "b", &faults)};
    TriangleMesh *mesh = triangle_mesh_of_tube(&tube);
    Vec3 up = vec3_unit(vec3_add_scaled(tube.normal, 0.4, vec3_cross(tube.direction, tube.normal)));
    Vec3 from = vec3_add_scaled(vec3_add_scaled(tube.start, 6, tube.direction), 0.9, tube.normal);
    Pose *pose = straight_pose(12, from, tube.direction, up, 0.8, tool_radius);
    for (int side = 0; side < 2; side++) {
        if (side == 1) {
            for (int i = 0; i < mesh->vertex_count; i++) {
                mesh->vertex[i] = mirror(mesh->vertex[i]);
                mesh->normal[i] = mirror(mesh->normal[i]);
            }
            for (int t = 0; t < mesh->triangle_count; t++) {
                int swap = mesh->triangle[t][1];
                mesh->triangle[t][1] = mesh->triangle[t][2];
                mesh->triangle[t][2] = swap;
            }
            pose_free(pose);
            pose = straight_pose(12, mirror(from), mirror(tube.direction), mirror(up), 0.8, tool_radius);
        }
        char message[256];
        Angioscope *scope = angioscope_create(mesh, vessel[side], NULL, message, sizeof message);
        assert_non_null(scope);
        angioscope_draw(scope, pose, 0, stage.port);
        if (side == 0)
            stage_read(&stage, one);
        else
            stage_read(&stage, other);
        angioscope_destroy(scope);
    }
    int differ = 0, lopsided = 0;
    for (int y = 0; y < STAGE_HEIGHT; y++)
        for (int x = 0; x < STAGE_WIDTH; x++) {
            differ += pixel_difference(one[y][x], other[y][STAGE_WIDTH - 1 - x]) > 4;
            lopsided += pixel_difference(one[y][x], one[y][STAGE_WIDTH - 1 - x]) > 4;
        }
    assert_true(lopsided > 20000);                               // a picture that is not mirrored would be detected
    assert_true(differ < STAGE_WIDTH * STAGE_HEIGHT / 200);      // pixels on edges of triangles
    pose_free(pose);
    triangle_mesh_free(mesh);
    vessel[0]->destroy(vessel[0]);
    vessel[1]->destroy(vessel[1]);
    stage_close(&stage);
}

static void normals_are_the_vessel_s_own(void **state)
{
    (void)state;
    ViewStage stage;
    if (!stage_open(&stage))
        skip();
    static StagePixels exact, bent, lost;
    TubeScene scene = open_tube(vec3(0, 0, 0), vec3(0, 0, 1), 100, 2);
    Pose *pose = straight_pose(12, vec3(0.3, 0.2, 30), vec3_unit(vec3(0.1, 0, 1)), vec3(0, 1, 0), 1, tool_radius);
    angioscope_draw(scene.scope, pose, 0, stage.port);
    stage_read(&stage, exact);
    // a mesh whose normals are off by 40 degrees
    for (int i = 0; i < scene.mesh->vertex_count; i++)
        scene.mesh->normal[i] = vec3_unit(vec3_add_scaled(scene.mesh->normal[i], i % 2 ? 0.8 : -0.8, vec3(0, 0, 1)));
    char message[256];
    const Vessel *vessel[2] = {scene.vessel, NULL};
    for (int k = 0; k < 2; k++) {
        Angioscope *scope = angioscope_create(scene.mesh, vessel[k], NULL, message, sizeof message);
        assert_non_null(scope);
        angioscope_draw(scope, pose, 0, stage.port);
        if (k == 0)
            stage_read(&stage, bent);
        else
            stage_read(&stage, lost);
        angioscope_destroy(scope);
    }
    assert_int_equal(count_different(exact, bent, 2), 0);
    assert_true(count_different(exact, lost, 8) > 20000);
    pose_free(pose);
    close_tube(&scene);
    stage_close(&stage);
}

static void the_eye_stays_inside_and_sees_the_tip(void **state)
{
    (void)state;
    ViewStage stage;
    if (!stage_open(&stage))
        skip();
    const double lumen[4] = {0.3, 0.6, 1, 4};
    for (int k = 0; k < 4; k++) {
        TubeScene scene = open_tube(vec3(0, 0, 0), vec3(0, 1, 0), 60, lumen[k]);
        AngioscopeView before = {0};
        double furthest = 0;
        for (int turn = 0; turn <= 720; turn++) {
            // the tool lies on the wall and rotates: the eye must stay out of the wall
            double a = turn * PI / 360, off = lumen[k] - tool_radius - 0.01;
            Pose *pose = straight_pose(20, vec3(off, 10, 0), vec3(0, 1, 0), vec3(cos(a), 0, sin(a)), 1, tool_radius);
            AngioscopeView view;
            assert_true(angioscope_view(scene.scope, pose, 0, &view));
            VesselMemory memory = {.node = -1};
            VesselHit hit;
            vessel_query(scene.vessel, 1, &view.eye, 10, &memory, &hit);
            assert_true(hit.gap > 0.5 * tool_radius);
            Vec3 tip = seen_at(&view, vec3_sub(pose->position[19], view.eye));
            assert_true(fabs(tip.x - SIDE / 2.0) < 0.5 * SIDE && tip.y > SIDE / 2.0 - 1 && tip.y < SIDE);
            assert_true(fabs(vec3_norm(view.up) - 1) < 1e-9 && fabs(vec3_dot(view.up, view.forward)) < 1e-9);
            if (turn > 0)
                furthest = fmax(furthest, vec3_distance(view.eye, before.eye));
            before = view;
            pose_free(pose);
        }
        assert_true(furthest < 0.1);   // half a degree of rotation causes no jump
        close_tube(&scene);
    }
    stage_close(&stage);
}

// With a tree the eye looks along the centreline ahead, into the branch to which the tool points, and sees a small tip; without one it looks along the tool.
static void the_eye_looks_along_the_lumen(void **state)
{
    (void)state;
    ViewStage stage;
    if (!stage_open(&stage))
        skip();
    enum { STEM = 21, BRANCH = 20, NODES = STEM + 2 * BRANCH };
    Vec3 center[NODES];
    double radius[NODES];
    int parent[NODES];
    char message[256] = "";
    for (int i = 0; i < NODES; i++) {        // a stem along x to (20, 0, 0), then one branch straight on and one at 60 degrees towards y
        double along = i < STEM ? i : (i - STEM) % BRANCH + 1;
        Vec3 towards = i < STEM + BRANCH ? vec3(1, 0, 0) : vec3(0.5, sqrt(0.75), 0);
        center[i] = vec3_add_scaled(vec3(i < STEM ? 0 : 20, 0, 0), along, towards);
        radius[i] = 2;
        parent[i] = i == STEM + BRANCH ? STEM - 1 : i - 1;
    }
    VesselTree tree = {.node_count = NODES, .center = center, .radius = radius, .parent = parent};
    Angioscope *plain = angioscope_create(NULL, NULL, NULL, message, sizeof message), *scope = angioscope_create(NULL, NULL, &tree, message, sizeof message);
    assert_non_null(plain);
    assert_non_null(scope);
    for (int side = 0; side < 2; side++) {
        // the tip at (19, 0, 0), bent by 40 degrees to either side
        Vec3 look = vec3(cos(0.7), side ? -sin(0.7) : sin(0.7), 0);
        Pose *pose = straight_pose(20, vec3_add_scaled(vec3(19, 0, 0), -19, look), look, vec3(0, 0, 1), 1, tool_radius);
        for (int i = 0; i < 20; i++)
            pose->node[i].vessel_node = 19;
        AngioscopeView view, before;
        assert_true(angioscope_view(scope, pose, 0, &view) && angioscope_view(plain, pose, 0, &before));
        assert_near(vec3_distance(before.forward, look), 0, 1e-9);
        // six millimetres ahead: in the branch at 60 degrees, or straight on
        Vec3 ahead = side ? vec3(25, 0, 0) : vec3_add_scaled(vec3(20, 0, 0), 5, vec3(0.5, sqrt(0.75), 0));
        Vec3 wanted = vec3_unit(vec3_sub(ahead, view.eye));
        assert_true(vec3_dot(view.forward, wanted) > vec3_dot(before.forward, wanted) + 0.01);
        assert_true(vec3_dot(view.forward, wanted) > 0.97);
        Vec3 tip = vec3(19, 0, 0);
        assert_true(vec3_distance(view.eye, tip) > 1.2 * vec3_distance(before.eye, tip));        // farther, so smaller
        pose_free(pose);
    }
    angioscope_destroy(plain);
    angioscope_destroy(scope);
    stage_close(&stage);
}

// A catheter of R 0.5 and lumen 0.3 mm with a wire of 0.18 mm in a vessel of radius 2.5 along x.
static Pose *wire_in_catheter(double catheter, double wire) { return coaxial_pose(catheter, wire, 0.5, 0.5, tool_radius); }

static void the_eye_goes_from_one_lumen_to_the_next(void **state)
{
    (void)state;
    ViewStage stage;
    if (!stage_open(&stage))
        skip();
    TubeScene scene = open_tube(vec3(-5, 0, 0), vec3(1, 0, 0), 60, 2.5);
    CoaxialLooks two;
    coaxial_looks(&two, 0.5, 0.3, tool_radius);
    angioscope_set_tools(scene.scope, &two.looks);
    AngioscopeView view, before = {0};
    double most = 0;
    for (int k = 0; k <= 900; k++) {
        Pose *pose = wire_in_catheter(20, 16 + 0.01 * k);
        assert_true(angioscope_view(scene.scope, pose, 1, &view));
        double off = hypot(view.eye.y, view.eye.z);
        if (view.eye.x < 20)
            assert_true(off > tool_radius + 0.03 && off < 0.3 - 0.03);
        else
            assert_true(off > tool_radius + 0.03 && off < 2.5);
        if (view.eye.x > 22)
            assert_near(off, 2.8 * tool_radius, 1e-6);       // as without a catheter
        most = k > 0 ? fmax(most, vec3_distance(view.eye, before.eye)) : 0;
        before = view;
        // from the tool that reaches furthest
        AngioscopeView furthest;
        assert_true(angioscope_view(scene.scope, pose, -1, &furthest));
        AngioscopeView same;
        assert_true(angioscope_view(scene.scope, pose, 16 + 0.01 * k < 20 ? 0 : 1, &same));
        assert_true(vec3_distance(furthest.eye, same.eye) < 1e-12);
        pose_free(pose);
    }
    assert_true(most < 0.05);
    close_tube(&scene);
    stage_close(&stage);
}

static bool is_red(const uint8_t *p) { return p[0] > p[2] + 25; }
static bool is_grey(const uint8_t *p, int least, int most) { return abs(p[0] - p[2]) < 25 && p[0] >= least && p[0] <= most; }

static void tools_are_seen_from_in_each_other(void **state)
{
    (void)state;
    ViewStage stage;
    if (!stage_open(&stage))
        skip();
    static StagePixels pixels;
    TubeScene scene = open_tube(vec3(-5, 0, 0), vec3(1, 0, 0), 60, 2.5);
    CoaxialLooks two;
    coaxial_looks(&two, 0.5, 0.3, tool_radius);
    angioscope_set_tools(scene.scope, &two.looks);
    AngioscopeView view;
    // inside the catheter: its dark lumen all around, and in its open end a vessel that crosses
    TubeScene crossing = open_tube(vec3(11.5, -17.3, 0), vec3_unit(vec3(1, sqrt(3), 0)), 40, 2.5);
    angioscope_set_tools(crossing.scope, &two.looks);
    Pose *pose = wire_in_catheter(20, 17);
    assert_true(angioscope_view(crossing.scope, pose, 1, &view));
    angioscope_draw(crossing.scope, pose, 1, square(&stage));
    close_tube(&crossing);
    stage_read(&stage, pixels);
    int red = 0, dark = 0, outside = 0;
    Vec3 mouth = seen_at(&view, vec3_sub(vec3(20, 0, 0), view.eye));
    double mouth_radius = SIDE / 2.0 * 0.3 / ((20 - view.eye.x) * view.half_angle_tan);
    for (int y = 0; y < SIDE; y++)
        for (int x = 0; x < SIDE; x++) {
            const uint8_t *p = pixels[y + STAGE_HEIGHT - SIDE][x];
            double off = hypot(x + 0.5 - mouth.x, y + 0.5 - mouth.y);
            red += off < mouth_radius - 1 && is_red(p);
            outside += off > mouth_radius + 1.5 && is_red(p);
            dark += off > mouth_radius + 1.5 && is_grey(p, 8, 110);
        }
    assert_true(mouth_radius > 5 && red > 0.3 * PI * mouth_radius * mouth_radius);
    assert_int_equal(outside, 0);
    assert_true(dark > 0.5 * SIDE * SIDE);
    pose_free(pose);
    // from the catheter with a wire ahead: steel along the vessel's axis, and nothing without the wire
    static StagePixels without;
    pose = wire_in_catheter(20, 30);
    angioscope_draw(scene.scope, pose, 0, square(&stage));
    stage_read(&stage, pixels);
    pose_free(pose);
    pose = wire_in_catheter(20, 15);
    assert_true(angioscope_view(scene.scope, pose, 0, &view));
    angioscope_draw(scene.scope, pose, 0, square(&stage));
    stage_read(&stage, without);
    for (double x = 22.4; x < 24; x += 0.4) {
        Vec3 at = seen_at(&view, vec3_sub(vec3(x, 0, 0), view.eye));
        int row = (int)at.y + STAGE_HEIGHT - SIDE, column = (int)at.x;
        assert_true(is_grey(pixels[row][column], 20, 255));
        assert_true(brightness(pixels, at.x, at.y) > brightness(without, at.x, at.y) + 25);
    }
    pose_free(pose);
    close_tube(&scene);
    stage_close(&stage);
}

static void nothing_breaks_it(void **state)
{
    (void)state;
    ViewStage stage;
    if (!stage_open(&stage))
        skip();
    static StagePixels pixels;
    TubeScene scene = open_tube(vec3(0, 0, 0), vec3(0, 0, 1), 50, 2);
    char message[256] = "";
    Angioscope *empty = angioscope_create(NULL, NULL, NULL, message, sizeof message);
    assert_non_null(empty);
    Pose *pose = straight_pose(12, vec3(0, 0, 20), vec3(0, 0, 1), vec3(0, 1, 0), 1, tool_radius);
    for (int k = 0; k < 8; k++) {
        bool is_dark = false;
        switch (k) {
        case 1:   // far outside the vessel
            for (int i = 0; i < 12; i++)
                pose->position[i].x += 500;
            is_dark = true;
            break;
        case 2:   // just outside
            for (int i = 0; i < 12; i++)
                pose->position[i].x -= 497;
            break;
        case 3:   // beyond the open end
            for (int i = 0; i < 12; i++)
                pose->position[i] = vec3(0, 0, 60 + i);
            break;
        case 4:   // in the sheath
            for (int i = 0; i < 12; i++)
                pose->position[i] = vec3(0, 0, 10 + i);
            pose->first_free_node = 11;
            pose->inserted_mm = 0;
            is_dark = true;
            break;
        case 5:   // all nodes in one place
            for (int i = 0; i < 12; i++)
                pose->position[i] = vec3(0, 0, 10);
            pose->first_free_node = 0;
            break;
        case 6:
            pose->position[11].y = NAN;
            is_dark = true;
            break;
        case 7:
            pose->position[11].y = 0;
            pose->quaternion[11].w = NAN;
            is_dark = true;
            break;
        default: break;
        }
        pose_fill_single_tool(pose);
        const ViewPort port = {stage.canvas.framebuffer, 30, 20, 200, 150}, tiny = {stage.canvas.framebuffer, 0, 0, 1, 1}, none = {0};
        stage_clear(&stage, 1, 0, 1);
        angioscope_draw(scene.scope, pose, 0, port);
        stage_read(&stage, pixels);
        bool is_lit = false;
        for (int y = 0; y < STAGE_HEIGHT; y++)
            for (int x = 0; x < STAGE_WIDTH; x++) {
                bool is_in_port = x >= 30 && x < 230 && y >= STAGE_HEIGHT - 170 && y < STAGE_HEIGHT - 20;
                const uint8_t *p = pixels[y][x];
                assert_true(is_in_port != (p[0] == 255 && p[1] == 0 && p[2] == 255));
                is_lit |= is_in_port && p[0] > 40 && p[0] > p[2] + 20;
            }
        if (is_dark)
            assert_false(is_lit);
        if (k == 0 || k == 5)
            assert_true(is_lit);
        angioscope_draw(empty, pose, 0, port);
        angioscope_draw(scene.scope, NULL, 0, port);
        angioscope_draw(scene.scope, pose, 0, tiny);
        angioscope_draw(scene.scope, pose, 0, none);
        assert_int_equal(glGetError(), GL_NO_ERROR);
    }
    // a surface that cannot be drawn
    scene.mesh->triangle[5][2] = -1;
    assert_null(angioscope_create(scene.mesh, NULL, NULL, message, sizeof message));
    assert_true(strlen(message) > 0);
    pose_free(pose);
    angioscope_destroy(empty);
    close_tube(&scene);
    stage_close(&stage);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_straight_tube_is_evenly_round),
        cmocka_unit_test(the_far_end_lies_where_the_axis_is_seen),
        cmocka_unit_test(a_mirrored_scene_gives_a_mirrored_picture),
        cmocka_unit_test(normals_are_the_vessel_s_own),
        cmocka_unit_test(the_eye_stays_inside_and_sees_the_tip),
        cmocka_unit_test(the_eye_goes_from_one_lumen_to_the_next),
        cmocka_unit_test(tools_are_seen_from_in_each_other),
        cmocka_unit_test(nothing_breaks_it),
        cmocka_unit_test(the_eye_looks_along_the_lumen),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
