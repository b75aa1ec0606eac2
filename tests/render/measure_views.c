// Measures the live 3D view and angioscopy: median CPU time of a frame [ms]. Not a test, because clocks are noisy. LP_NUM_THREADS=1 measure_views
//
// The vessel is a coiled tube of about 93,000 triangles, the tool a wire of 200 nodes along it that moves at each frame.
#include "geom/mesh_decimate.h"
#include "geom/tube_mesh.h"
#include "render/angioscope.h"
#include "render/vessel_scene.h"
#include "view_stage.h"

enum { NODES = 200, FRAMES = 41, COARSE = 25000 };

typedef struct Bench {
    TriangleMesh *mesh, *coarse;
    Vessel *vessel;
    Pose *pose;
    Vec3 *place;               // (NODES) of the pose before it moved
} Bench;

static double median(double *value, int count)
{
    qsort(value, (size_t)count, sizeof *value, ascending);
    return value[count / 2];
}

static bool set_up(Bench *bench)
{
    enum { TURNS = 40 };
    TubePiece piece[TURNS];
    for (int i = 0; i < TURNS; i++)
        piece[i] = (TubePiece){.arc_radius = 12, .angle = 1.9, .plane = i == 0 ? 0 : 0.35};
    TubeOptions tube = {.direction = {1, 0, 0}, .normal = {0, 1, 0}, .radius = 2, .piece_count = TURNS, .piece = piece};
    Faults faults;
    faults_clear(&faults);
    TriangleMesh *mesh = triangle_mesh_of_tube(&tube);
    bench->vessel = tube_vessel_create(&tube, "tube", &faults);
    bench->mesh = mesh && bench->vessel && mesh->triangle_count < 93000 ? triangle_mesh_refine(mesh, bench->vessel) : NULL;
    if (mesh && bench->mesh)
        triangle_mesh_free(mesh);
    else
        bench->mesh = mesh;
    if (bench->mesh && bench->mesh->triangle_count > 93000) {
        TriangleMesh *fewer = mesh_decimate(bench->mesh, 93000, HUGE_VAL);
        triangle_mesh_free(bench->mesh);
        bench->mesh = fewer;
    }
    bench->coarse = bench->mesh ? mesh_decimate(bench->mesh, COARSE, HUGE_VAL) : NULL;
    bench->pose = straight_pose(NODES, vec3(0, 0, 0), vec3(1, 0, 0), vec3(0, 1, 0), 0.1, 0.18);
    bench->place = calloc(NODES, sizeof *bench->place);
    for (int i = 0; i < NODES; i++) {
        // along the first two arcs' middle line
        double a = 0.0095 * i;
        bench->pose->position[i] = vec3(12 * sin(a), 12 * (1 - cos(a)), 0);
        bench->pose->quaternion[i] = quat_from_rotation_vector(vec3(0, 0, a));
        bench->pose->node[i].force = i % 20 == 0 ? vec3(0, 0.1, 0.1) : vec3(0, 0, 0);
        bench->place[i] = bench->pose->position[i];
    }
    return bench->mesh && bench->coarse && bench->vessel && bench->place;
}

static void move_tool(Bench *bench, int frame)
{
    for (int i = 0; i < NODES; i++)
        bench->pose->position[i] = vec3_add(bench->place[i], vec3(0, 0, 0.3 * sin(0.3 * frame)));
    pose_fill_single_tool(bench->pose);
}

static bool measure(Bench *bench, int width, int height)
{
    char message[256] = "";
    GlCanvas canvas;
    if (!gl_canvas_create(&canvas, width, height, 1, message, sizeof message)) {
        printf("%s\n", message);
        return false;
    }
    const ViewPort port = {canvas.framebuffer, 0, 0, width, height};
    VesselSceneOptions options = {.vessel = bench->mesh, .coarse = bench->coarse};
    VesselScene *scene = vessel_scene_create(&options, message, sizeof message);
    Angioscope *scope = angioscope_create(bench->mesh, bench->vessel, NULL, message, sizeof message);
    if (scene && scope) {
        VesselSceneLook look = vessel_scene_default_look(scene);
        double cost[4][FRAMES];
        for (int kind = 0; kind < 4; kind++)   // still, turning, turning with the full mesh, angioscopy
            for (int k = -8; k < FRAMES; k++) {
                move_tool(bench, k);
                if (kind == 1 || kind == 2)
                    free_camera_orbit(&look.camera, 2, 1);
                look.full_detail = kind == 2;
                double before = cpu_ms();
                if (kind == 3)
                    angioscope_draw(scope, bench->pose, 0, port);
                else
                    vessel_scene_draw(scene, bench->pose, &look, port);
                glFinish();
                if (k >= 0)
                    cost[kind][k] = cpu_ms() - before;
            }
        printf("%4d x %-4d  3D still %5.2f   turning %5.2f   full detail %6.2f   angioscopy %5.2f\n", width, height, median(cost[0], FRAMES),
               median(cost[1], FRAMES), median(cost[2], FRAMES), median(cost[3], FRAMES));
    } else {
        printf("%s\n", message);
    }
    angioscope_destroy(scope);
    vessel_scene_destroy(scene);
    gl_canvas_destroy(&canvas);
    return scene && scope;
}

int main(void)
{
    char message[256] = "";
    GlContext *context = gl_context_create(message, sizeof message);
    if (!context) {
        printf("no EGL: %s\n", message);
        return 77;
    }
    Bench bench = {0};
    bool good = set_up(&bench);
    if (good) {
        printf("%s; %d triangles, %d while turning; median CPU ms a frame\n", gl_context_renderer(context), bench.mesh->triangle_count,
               bench.coarse->triangle_count);
        const int size[4][2] = {{400, 300}, {640, 480}, {1280, 720}, {1920, 1080}};
        for (int k = 0; k < 4 && good; k++)
            good = measure(&bench, size[k][0], size[k][1]);
    }
    triangle_mesh_free(bench.mesh);
    triangle_mesh_free(bench.coarse);
    if (bench.vessel)
        bench.vessel->destroy(bench.vessel);
    pose_free(bench.pose);
    free(bench.place);
    gl_context_destroy(context);
    return good ? 0 : 1;
}
