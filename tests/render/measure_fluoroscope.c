// Measures fluoroscopy: median process CPU time of a frame [ms]. Not a test, because clocks are noisy. LP_NUM_THREADS=1 measure_fluoroscope
//
// The vessel is a coil of 93,000 triangles and 400 nodes in a plain head, the tool a wire of 200 nodes along it.
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

#include "../geom/small_meshes.h"
#include "base/sort_doubles.h"
#include "xray_room.h"

#include <time.h>

enum { RINGS = 970, AROUND = 48, NODES = 400, WIRE = 200, FRAMES = 41 };

static double cpu_ms(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec * 1e3 + (double)t.tv_nsec * 1e-6;
}

static Vec3 coil_at(double u, Vec3 *tangent)
{
    double a = 14 * PI * u, r = 30 - 12 * u;
    if (tangent)
        *tangent = vec3_unit(vec3(-r * sin(a), r * cos(a), 80 / (14 * PI)));
    return vec3(r * cos(a), r * sin(a), 80 * u - 40);
}

static TriangleMesh coil_mesh(void)
{
    TriangleMesh m = mesh_room(RINGS * AROUND, 2 * RINGS * AROUND);
    for (int j = 0; j < RINGS; j++) {
        Vec3 t, p = coil_at(j / (RINGS - 1.0), &t), n = vec3_unit(vec3_cross(vec3(0, 0, 1), t)), b = vec3_cross(t, n);
        for (int i = 0; i < AROUND; i++) {
            double a = 2 * PI * i / AROUND;
            Vec3 out = vec3_add_scaled(vec3_scale(n, cos(a)), sin(a), b);
            mesh_vertex(&m, vec3_add_scaled(p, 2, out), out);
        }
        if (j > 0)
            mesh_join_rings(&m, (j - 1) * AROUND, j * AROUND, AROUND);
    }
    return m;
}

static VesselTree *coil_tree(void)
{
    VesselTree *tree = vessel_tree_create(NODES, 0, 0);
    for (int n = 0; n < NODES; n++) {
        tree->center[n] = coil_at(n / (NODES - 1.0), NULL);
        tree->radius[n] = 2;
        tree->parent[n] = n - 1;
    }
    return tree;
}

typedef enum { STILL, HELD, FLOWING, DSA_FLOWING, TURNING, KINDS } Kind;

static double measure(XrayRoom *s, Kind kind, int width, int height, float *contrast)
{
    GlCanvas canvas;
    double spent[FRAMES];
    assert_true(gl_canvas_create(&canvas, width, height, 1, NULL, 0));
    fluoroscope_forget(s->view);
    s->frame.xray = xray_default_control();
    s->frame.contrast = contrast;
    for (int i = -5; i < FRAMES; i++) {
        s->frame.xray.pedal = kind != HELD;
        s->frame.xray.mode = kind == DSA_FLOWING ? XRAY_DSA : XRAY_LIVE;
        s->frame.xray.lao_deg = kind == TURNING ? (float)i : 0;
        s->frame.pulse++;
        for (int n = 0; n < NODES; n++)
            contrast[n] = kind == FLOWING || kind == DSA_FLOWING ? (float)exp(-0.0002 * (n - 8 * i) * (n - 8 * i)) : 1;
        for (int k = 0; k < WIRE; k++)
            s->frame.pose->tool[0].node[k].position = coil_at((k + 0.05 * i) / (WIRE + 5.0), NULL);
        double from = cpu_ms();
        fluoroscope_draw(s->view, &s->frame, (ViewPort){canvas.framebuffer, 0, 0, width, height});
        glFinish();
        if (i >= 0)
            spent[i] = cpu_ms() - from;
    }
    gl_canvas_destroy(&canvas);
    sort_doubles(spent, FRAMES);
    return spent[FRAMES / 2];
}

int main(void)
{
    static float contrast[NODES];
    TriangleMesh mesh = coil_mesh();
    VesselTree *tree = coil_tree();
    Pose *pose = pose_create(WIRE, 1, &(int){WIRE});
    TubeStretch stretch = {.end = WIRE, .radius = 0.18, .attenuation = 0.55};
    ToolLooks looks = {.count = 1, .tool = {{.stretch_count = 1, .stretch = &stretch}}};
    for (int i = 0; i < WIRE; i++)
        pose->tool[0].node[i].s = i;
    FluoroscopeOptions options = fluoroscope_default_options();
    options.vessel = &mesh;
    options.tree = tree;
    options.tools = &looks;
    options.pose = pose;
    double from = cpu_ms();
    XrayRoom *s = room_open(&options, 64);
    if (!s)
        return 77;
    s->frame.pose = pose;
    print_message("%d triangles, opened in %.0f ms CPU; median CPU ms of a frame:\n", mesh.triangle_count, cpu_ms() - from);
    static const char *const name[KINDS] = {"C-arm still", "held", "contrast flows", "contrast flows in DSA", "C-arm turns"};
    for (int kind = 0; kind < KINDS; kind++) {
        double small = measure(s, (Kind)kind, 1280, 720, contrast), large = measure(s, (Kind)kind, 1920, 1080, contrast);
        print_message("%-22s 1280x720 %6.2f   1920x1080 %6.2f\n", name[kind], small, large);
    }
    room_close(s);
    pose_free(pose);
    vessel_tree_free(tree);
    mesh_clear(&mesh);
    return 0;
}
