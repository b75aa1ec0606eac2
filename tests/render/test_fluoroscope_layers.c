// The integrals along the rays of fluoroscopy, compared with ray casters and exact solids in double precision. Skipped by name without EGL.
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

#include "../geom/near.h"
#include "../geom/small_meshes.h"
#include "xray_room.h"

static FluoroscopeOptions empty_room(const TriangleMesh *vessel)
{
    FluoroscopeOptions options = fluoroscope_default_options();
    options.has_no_anatomy = true;
    options.vessel = vessel;
    return options;
}

typedef struct Deviation {
    double rms, most, longest;
    int count;
} Deviation;

// Thickness of each `step`th pixel compared with the ray caster.
static Deviation compare_thickness(XrayRoom *s, const TriangleMesh *mesh, int step)
{
    const CArm *c_arm = &s->view->c_arm;
    float *depth = layer_read(&s->view->lumen_layer);
    Deviation d = {0};
    for (int y = step / 2; y < s->side; y += step)
        for (int x = step / 2; x < s->side; x += step) {
            Vec3 ray = pixel_ray(c_arm, s->side, x, y);
            double slant = 1 / vec3_dot(ray, c_arm->towards), exact = ray_inside(mesh, c_arm_source(c_arm), ray);
            double error = (double)depth[y * s->side + x] * slant - exact;
            d.rms += error * error;
            d.most = fmax(d.most, fabs(error));
            d.longest = fmax(d.longest, exact);
            d.count++;
        }
    d.rms = sqrt(d.rms / d.count);
    free(depth);
    return d;
}

static void thickness_is_that_of_a_ray_caster(void **state)
{
    (void)state;
    // far from the origin, so that depths not relative to the isocentre would lose precision
    const Vec3 place = {900, -700, 1300};
    for (int round = 0; round < 4; round++) {
        TriangleMesh bead = sphere_mesh(10), mesh = mesh_and(torus_mesh(15, 3.5, 70, 30), bead, vec3(0, 0, 6), false);
        mesh_move(&mesh, quat_from_rotation_vector(vec3(0.5, 0.9 + round, -0.3)), place, round % 2 == 1);
        FluoroscopeOptions options = empty_room(&mesh);
        XrayRoom *s = room_open(&options, 200);
        if (!s) {
            mesh_clear(&mesh);
            skip();
        }
        assert_string_equal(s->message, "");
        const float full = 1;
        s->frame.contrast = &full;
        s->frame.xray.lao_deg = 37.0f * (float)(round - 1);
        s->frame.xray.cra_deg = -21;
        s->frame.xray.table_mm[0] = 903, s->frame.xray.table_mm[1] = -702, s->frame.xray.table_mm[2] = 1300;
        room_draw(s);
        Deviation d = compare_thickness(s, &mesh, 5);
        print_message("torus and bead, view %d: rms %.6f mm, at most %.4f of %.2f mm, %d rays\n", round, d.rms, d.most, d.longest, d.count);
        // GL rounds vertices to 1/256 of a pixel of 0.3 mm: 0.0006 mm at a slope of 1. Half precision would leave 0.03 and more
        assert_true(d.longest > 8 && d.rms < 0.0007);
        room_close(s);
        mesh_clear(&mesh);
    }
}

static void finer_meshes_come_closer_to_the_sphere(void **state)
{
    (void)state;
    const double radius = 12;
    double error[2];
    for (int k = 0; k < 2; k++) {
        TriangleMesh ball = sphere_mesh(8 << k);
        for (int v = 0; v < ball.vertex_count; v++)
            ball.vertex[v] = vec3_scale(ball.vertex[v], radius);
        FluoroscopeOptions options = empty_room(&ball);
        XrayRoom *s = room_open(&options, 128);
        if (!s) {
            mesh_clear(&ball);
            skip();
        }
        const float full = 1;
        s->frame.contrast = &full;
        room_draw(s);
        float *depth = layer_read(&s->view->lumen_layer);
        double sum = 0, count = 0;
        for (int y = 50; y < 78; y++)
            for (int x = 50; x < 78; x++) {
                Vec3 ray = pixel_ray(&s->view->c_arm, s->side, x, y), source = c_arm_source(&s->view->c_arm);
                double b = vec3_dot(ray, source), chord = 2 * sqrt(b * b - vec3_norm2(source) + radius * radius);
                sum += chord - (double)depth[y * s->side + x] / vec3_dot(ray, s->view->c_arm.towards);
                count++;
            }
        error[k] = sum / count;
        free(depth);
        room_close(s);
        mesh_clear(&ball);
    }
    print_message("sphere: mean error %.4f and %.4f mm, order %.2f\n", error[0], error[1], log2(error[0] / error[1]));
    assert_true(error[1] > 0);   // an inscribed polyhedron is thinner
    assert_near(log2(error[0] / error[1]), 2, 0.2);
}

// A tube of radius 2 along +x, bent, with nodes every millimetre; concentration falls as a front in the middle.
enum { NODES = 41 };
static double front(double s) { return 1 / (1 + exp((s - 20) / 2)); }

static VesselTree *tube_nodes(void)
{
    VesselTree *tree = vessel_tree_create(NODES, 0, 0);
    for (int n = 0; n < NODES; n++) {
        double turn = fmin(fmax((n - 15) / 10.0, 0), 1.2), past = fmax(n - 15 - 12.0, 0);
        Vec3 p = vec3(fmin(n, 15) + 10 * sin(turn), 10 * (1 - cos(turn)), 0);
        tree->center[n] = vec3_add_scaled(p, past, vec3(cos(turn), sin(turn), 0));
        tree->radius[n] = 2;
        tree->parent[n] = n - 1;
    }
    return tree;
}

// Concentration at a point: that of its foot on the centreline, linear between nodes.
static double concentration_at(const VesselTree *tree, const float *c, Vec3 x)
{
    double least = HUGE_VAL, value = 0;
    for (int n = 1; n < NODES; n++) {
        Vec3 a = tree->center[n - 1], d = vec3_sub(tree->center[n], a);
        double u = fmin(fmax(vec3_dot(vec3_sub(x, a), d) / vec3_norm2(d), 0), 1), square = vec3_norm2(vec3_sub(x, vec3_add_scaled(a, u, d)));
        if (square < least) {
            least = square;
            value = (1 - u) * (double)c[n - 1] + u * (double)c[n];
        }
    }
    return value;
}

// Integral of the concentration along a ray; the tube itself decides what is inside.
static double ray_contrast(const VesselTree *tree, const float *c, Vec3 from, Vec3 along)
{
    const double step = 0.05;
    double sum = 0;
    for (double t = C_ARM_SOURCE_MM - 45; t < C_ARM_SOURCE_MM + 45; t += step) {
        Vec3 x = vec3_add_scaled(from, t, along);
        double least = HUGE_VAL;
        for (int n = 1; n < NODES && least > 4; n++) {
            Vec3 a = tree->center[n - 1], d = vec3_sub(tree->center[n], a);
            double u = vec3_dot(vec3_sub(x, a), d) / vec3_norm2(d);
            if (u > -1e-9 && u < 1 + 1e-9)
                least = fmin(least, vec3_norm2(vec3_sub(x, vec3_add_scaled(a, u, d))));
        }
        if (least <= 4)
            sum += step * concentration_at(tree, c, x);
    }
    return sum;
}

static void contrast_follows_the_nodes(void **state)
{
    (void)state;
    TriangleMesh tube = bent_tube_mesh(2, 0, 15, 10, 1.2, 13, 0.5, 48);
    VesselTree *tree = tube_nodes();
    FluoroscopeOptions options = empty_room(&tube);
    options.tree = tree;
    float even[NODES], flow[NODES];
    for (int n = 0; n < NODES; n++) {
        even[n] = 0.5f;
        flow[n] = (float)front(n);
    }
    XrayRoom *s = room_open(&options, 160);
    if (!s)
        skip();
    assert_true(room_says(s, "open at 2 places"));
    // from the side, along the first stretch, and between
    const float lao[4] = {0, 90, 45, -70}, cra[4] = {0, 0, 30, -40};
    for (int view = 0; view < 4; view++) {
        s->frame.xray.lao_deg = lao[view];
        s->frame.xray.cra_deg = cra[view];
        s->frame.xray.table_mm[0] = 15;
        s->frame.xray.table_mm[1] = 5;
        fluoroscope_forget(s->view);
        s->frame.contrast = even;
        room_draw(s);
        // a uniform concentration of one half gives half the thickness, including the lids of the flat ends, in any depth order
        float *depth = layer_read(&s->view->lumen_layer);
        fluoroscope_forget(s->view);
        s->frame.contrast = flow;
        room_draw(s);
        float *flowing = layer_read(&s->view->lumen_layer);
        double square_even = 0, square = 0, longest = 0, count = 0;
        for (int y = 1; y < s->side; y += 5)
            for (int x = 1; x < s->side; x += 5) {
                const CArm *c_arm = &s->view->c_arm;
                Vec3 ray = pixel_ray(c_arm, s->side, x, y), from = c_arm_source(c_arm);
                double slant = 1 / vec3_dot(ray, c_arm->towards), exact = ray_contrast(tree, flow, from, ray);
                double half = ray_contrast(tree, even, from, ray);
                double e = (double)flowing[y * s->side + x] * slant - exact, h = (double)depth[y * s->side + x] * slant - half;
                square += e * e;
                square_even += h * h;
                longest = fmax(longest, exact);
                count++;
            }
        double rms = sqrt(square / count), rms_even = sqrt(square_even / count);
        print_message("front in a bent tube, LAO %g CRA %g: rms %.4f mm of up to %.2f mm; even contrast %.4f mm\n", (double)lao[view], (double)cra[view], rms,
                      longest, rms_even);
        // uniform: the difference of polygon and lids from the tube. A front of 2 mm over nodes of 1 mm: each ray's F is taken at its walls' nodes
        assert_true(longest > 2);
        assert_true(rms_even < 0.03);
        assert_true(rms < 0.02 * longest + 0.01);
        free(depth);
        free(flowing);
    }
    room_close(s);
    vessel_tree_free(tree);
    mesh_clear(&tube);
}

// --- the tool ---

// Mean over a pixel and over the detector's kernel of three, of the chord of a circle of `radius` at `x` from its axis [pixel]; by the midpoint rule.
static double exact_chord(double x, double radius)
{
    static const double kernel[3] = {0.25, 0.5, 0.25};
    enum { PARTS = 4000 };
    double sum = 0;
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < PARTS; i++) {
            double u = x + k - 1 - 0.5 + (i + 0.5) / PARTS;
            sum += kernel[k] * (fabs(u) < radius ? 2 * sqrt(radius * radius - u * u) : 0) / PARTS;
        }
    return sum;
}

// Ten pixels per millimetre, from the front.
static CArm close_up(void)
{
    XrayControl xray = {.field_mm = 40};
    PatientAxes axes = patient_axes_lps();
    return c_arm_place(&xray, &axes);
}

static RibbonPath path_of(int count, const Vec3 *position, int stretch_count, const TubeStretch *stretch)
{
    double *s = calloc((size_t)count, sizeof *s);
    RibbonPath path;
    for (int i = 1; i < count; i++)
        s[i] = s[i - 1] + vec3_distance(position[i], position[i - 1]);
    assert_true(ribbon_path_make(&path, count, s, stretch_count, stretch));
    free(s);
    return path;
}

// The attenuation of tools, with `count` nodes and one stretch each.
static float *draw_ribbons(XrayRoom *s, Layer *layer, const CArm *c_arm, int tools, int count, const Vec3 *position, const TubeStretch *stretch, double filling)
{
    Ribbon ribbon = {0};
    assert_true(layer_fit(layer, s->side, LAYER_R32F));
    ribbon_begin(&ribbon);
    for (int k = 0; k < tools; k++) {
        RibbonPath path = path_of(count, position + k * count, 1, &stretch[k]);
        float *full = malloc((size_t)count * sizeof *full);
        for (int i = 0; i < count; i++)
            full[i] = 1;
        assert_true(ribbon_add(&ribbon, c_arm, s->side, &path, position + k * count, full, filling));
        free(full);
        ribbon_path_free(&path);
    }
    ribbon_end(&ribbon, s->side);
    LayerTone tone = {.quanta = 0};
    layer_begin(layer);
    layers_draw_tools(&s->view->programs, &ribbon, &tone, true, layer);
    ribbon_free(&ribbon);
    return layer_read(layer);
}

static float *draw_ribbon(XrayRoom *s, Layer *layer, const CArm *c_arm, int count, const Vec3 *position, double radius, double attenuation)
{
    const TubeStretch wire = {.radius = radius, .attenuation = attenuation};
    return draw_ribbons(s, layer, c_arm, 1, count, position, &wire, 0);
}

static void the_ribbon_has_the_chord_of_a_cylinder(void **state)
{
    (void)state;
    XrayRoom *s = room_open(NULL, 400);
    if (!s)
        skip();
    Layer layer = {0};
    CArm c_arm = close_up();
    const double pixel_mm = 0.1, attenuation = 0.7;
    for (int k = 0; k < 24; k++) {
        double radius = 0.05 * pow(1.25, k), off = 0.37 * k - floor(0.37 * k);   // 0.05 to 8.5 pixels, between pixel centres
        Vec3 position[21];
        for (int i = 0; i < 21; i++)
            position[i] = vec3((i - 10) * 2.5, 0, off * pixel_mm);
        float *drawn = draw_ribbon(s, &layer, &c_arm, 21, position, radius * pixel_mm, attenuation);
        for (int y = 180; y < 220; y++) {
            double expected = exact_chord(y + 0.5 - 200 - off, radius) * pixel_mm * attenuation, peak = 2 * radius * pixel_mm * attenuation;
            assert_near(drawn[y * s->side + 200], expected, 1e-3 * peak + 1e-6);
        }
        free(drawn);
    }
    layer_destroy(&layer);
    room_close(s);
}

// A catheter of R 1.0 and lumen 0.6 mm with a wire of 0.3 mm in it, ten pixels per millimetre, from the side: two dark lines, a fainter lumen, and the dark
// wire in it; each pixel is the exact integral for any size in pixels, and the contents of the lumen add up.
static void a_tube_is_its_wall_s_chord_and_tools_add_up(void **state)
{
    (void)state;
    XrayRoom *s = room_open(NULL, 400);
    if (!s)
        skip();
    Layer layer = {0};
    CArm c_arm = close_up();
    const double pixel_mm = 0.1;
    for (int k = 0; k < 10; k++) {
        double size = 0.06 * pow(1.45, k), off = 0.43 * k - floor(0.43 * k);     // outer radius 0.6 to 17 pixels
        const TubeStretch tube[2] = {{.radius = size, .lumen = 0.6 * size, .attenuation = 0.4}, {.radius = 0.3 * size, .attenuation = 0.9}};
        Vec3 position[42];
        for (int i = 0; i < 42; i++)
            position[i] = vec3((i % 21 - 10) * 2.5, 0, off * pixel_mm);
        for (int kind = 0; kind < 3; kind++) {       // tube, tube filled, tube and wire
            double filling = kind == 1 ? 0.3 : 0;
            float *drawn = draw_ribbons(s, &layer, &c_arm, kind == 2 ? 2 : 1, 21, position, tube, filling);
            for (int y = 170; y < 230; y++) {
                double x = y + 0.5 - 200 - off, wall = exact_chord(x, size / pixel_mm), lumen = exact_chord(x, 0.6 * size / pixel_mm);
                double expected = (0.4 * (wall - lumen) + filling * lumen + (kind == 2 ? 0.9 * exact_chord(x, 0.3 * size / pixel_mm) : 0)) * pixel_mm;
                assert_near(drawn[y * s->side + 200], expected, 1e-3 * 2 * size * 0.9 + 1e-6);
            }
            if (k == 9 && kind < 2) {
                const float *axis = drawn + 200 * s->side + 200, *wall_line = axis + 11 * s->side;
                assert_true(kind == 1 || *wall_line > 1.5F * *axis);
            }
            free(drawn);
        }
    }
    layer_destroy(&layer);
    room_close(s);
}

// Compared with the chord through a pixel's middle, the error is due to the width of pixel and detector and falls with the square of the pixel.
static void the_tube_converges_with_the_pixels(void **state)
{
    (void)state;
    const int side[3] = {200, 400, 800};
    double error[3];
    for (int k = 0; k < 3; k++) {
        XrayRoom *s = room_open(NULL, side[k]);
        if (!s)
            skip();
        Layer layer = {0};
        CArm c_arm = close_up();
        const TubeStretch tube = {.radius = 2, .lumen = 1.25, .attenuation = 0.4};
        Vec3 position[21];
        for (int i = 0; i < 21; i++)
            position[i] = vec3((i - 10) * 2.5, 0, 0);
        float *drawn = draw_ribbons(s, &layer, &c_arm, 1, 21, position, &tube, 0);
        double square = 0, count = 0;
        for (int y = side[k] / 2; y < side[k]; y++) {
            double z = ((y + 0.5) / side[k] - 0.5) * 40;
            if (z > 0.85)                // at the lumen's border the profile has no slope
                break;
            double e = (double)drawn[y * side[k] + side[k] / 2] - 0.4 * 2 * (sqrt(4 - z * z) - sqrt(1.25 * 1.25 - z * z));
            square += e * e;
            count++;
        }
        error[k] = sqrt(square / count);
        free(drawn);
        layer_destroy(&layer);
        room_close(s);
    }
    print_message("tube against its chord: %.2e, %.2e, %.2e, order %.2f and %.2f\n", error[0], error[1], error[2], log2(error[0] / error[1]),
                  log2(error[1] / error[2]));
    assert_near(log2(error[0] / error[1]), 2, 0.2);
    assert_near(log2(error[1] / error[2]), 2, 0.2);
}

// A marker band of 1 mm on a tool with nodes every 2.5 mm has its exact length and attenuation at any place between nodes; from the side and at 50 degrees.
static void marker_bands_are_as_long_as_they_are(void **state)
{
    (void)state;
    XrayRoom *s = room_open(NULL, 400);
    if (!s)
        skip();
    Layer layer = {0};
    CArm c_arm = close_up();
    const double radius = 0.4, lumen = 0.25, wall = 0.3, band = 4;
    for (int k = 0; k < 12; k++) {
        double slope = k % 2 * 50 * PI / 180, begin = 20 + 0.31 * k, sum = 0, first = HUGE_VAL, last = 0;
        Vec3 position[21], along = vec3(cos(slope), sin(slope), 0);
        for (int i = 0; i < 21; i++)
            position[i] = vec3_scale(along, (i - 10) * 2.5);
        float *drawn[2];
        for (int with = 0; with < 2; with++) {
            const TubeStretch tube[3] = {{begin, radius, lumen, wall}, {begin + 1, radius, lumen, with ? band : wall}, {50, radius, lumen, wall}};
            RibbonPath path = path_of(21, position, 3, tube);
            Ribbon ribbon = {0};
            assert_true(layer_fit(&layer, s->side, LAYER_R32F));
            ribbon_begin(&ribbon);
            assert_true(ribbon_add(&ribbon, &c_arm, s->side, &path, position, NULL, 0));
            ribbon_end(&ribbon, s->side);
            LayerTone tone = {.quanta = 0};
            layer_begin(&layer);
            layers_draw_tools(&s->view->programs, &ribbon, &tone, true, &layer);
            drawn[with] = layer_read(&layer);
            ribbon_free(&ribbon);
            ribbon_path_free(&path);
        }
        for (int y = 0; y < s->side; y++)
            for (int x = 0; x < s->side; x++) {
                double more = (double)(drawn[1][y * s->side + x] - drawn[0][y * s->side + x]);
                sum += more * 0.1 * 0.1;
                if (y == 200 && more > 0.1 * band) {
                    first = fmin(first, x);
                    last = fmax(last, x + 1);
                }
            }
        // magnified by its distance
        double depth = c_arm_project(&c_arm, vec3_scale(along, begin + 0.5 - 25)).z, larger = C_ARM_SOURCE_MM / (C_ARM_SOURCE_MM + depth);
        assert_near(sum / (PI * (radius * radius - lumen * lumen) * larger * larger * (band - wall)), 1, 0.07);   // whole pixels of 10 or 6.4
        assert_near(last - first, 10 * larger * cos(slope), 1.01);
        assert_near((first + last) / 2, 200 + 10 * larger * cos(slope) * (begin + 0.5 - 25), 0.6);
        free(drawn[0]);
        free(drawn[1]);
    }
    layer_destroy(&layer);
    room_close(s);
}

static void shadows_keep_what_the_tool_takes_away(void **state)
{
    (void)state;
    XrayRoom *s = room_open(NULL, 400);
    if (!s)
        skip();
    Layer layer = {0};
    CArm c_arm = close_up();
    const double radius = 0.18, attenuation = 0.5, length = 15;
    // straight tools at all slopes to the rays, up to end-on, and at all angles in the picture
    for (int k = 0; k < 12; k++)
        for (int j = 0; j < 3; j++) {
            double slope = k * PI / 22, turn = 0.3 + 0.7 * j;
            Vec3 along = vec3(cos(slope) * cos(turn), -sin(slope), cos(slope) * sin(turn)), position[31];
            for (int i = 0; i < 31; i++)
                position[i] = vec3_scale(along, length * (i / 30.0 - 0.5));
            float *drawn = draw_ribbon(s, &layer, &c_arm, 31, position, radius, attenuation);
            double sum = 0;
            for (int i = 0; i < s->side * s->side; i++)
                sum += (double)drawn[i] * 0.1 * 0.1;
            double expected = attenuation * PI * radius * radius * length;
            // an end begins and ends at pixel centres, which is at most one pixel of the shadow's length; a spot has only a few
            assert_near(sum / expected, 1, k < 11 ? 0.02 + 0.1 / (length * cos(slope)) : 0.35);
            free(drawn);
        }
    // a coil: overlaps add up
    Vec3 coil[400];
    double way = 0;
    for (int i = 0; i < 400; i++) {
        coil[i] = vec3(6 * cos(0.1 * i), 0.02 * i, 6 * sin(0.1 * i));
        way += i > 0 ? vec3_distance(coil[i], coil[i - 1]) : 0;
    }
    float *drawn = draw_ribbon(s, &layer, &c_arm, 400, coil, radius, attenuation);
    double sum = 0;
    for (int i = 0; i < s->side * s->side; i++)
        sum += (double)drawn[i] * 0.1 * 0.1;
    assert_near(sum / (attenuation * PI * radius * radius * way), 1, 0.02);
    free(drawn);
    layer_destroy(&layer);
    room_close(s);
}

// --- anatomy ---

static void bodies_and_volumes_are_integrated(void **state)
{
    (void)state;
    enum { NX = 40, NY = 31, NZ = 50 };
    float *hounsfield = malloc(NX * NY * NZ * sizeof *hounsfield);
    for (int k = 0; k < NZ; k++)
        for (int j = 0; j < NY; j++)
            for (int i = 0; i < NX; i++) {
                double x = (i - 19.5) / 16, y = (j - 15) / 13, z = (k - 24.5) / 21, r = sqrt(x * x + y * y + z * z);
                hounsfield[(k * NY + j) * NX + i] = r > 1 ? -1000 : r > 0.85 ? 900 : (float)(40 + 30 * sin(3 * x) * cos(4 * z));
            }
    FluoroscopeOptions options[2] = {fluoroscope_default_options(), fluoroscope_default_options()};
    options[1].anatomy_value = hounsfield;
    options[1].anatomy_size[0] = NX, options[1].anatomy_size[1] = NY, options[1].anatomy_size[2] = NZ;
    options[1].anatomy_origin = vec3(-60, -40, -70);
    // an oblique, left-handed, anisotropic grid
    options[1].anatomy_axis[0] = vec3(3, 0.4, 0), options[1].anatomy_axis[1] = vec3(-0.4, 2.8, 0.3), options[1].anatomy_axis[2] = vec3(0, -0.3, 2.9);
    for (int kind = 0; kind < 2; kind++) {
        XrayRoom *s = room_open(&options[kind], 64);
        if (!s) {
            free(hounsfield);
            skip();
        }
        s->frame.xray.field_mm = 250;
        s->frame.xray.lao_deg = 25;
        s->frame.xray.cra_deg = -12;
        room_draw(s);
        float *drawn = layer_read(&s->view->anatomy_layer);
        int side = s->view->anatomy_layer.side;
        double square = 0, most = 0, count = 0;
        for (int y = 2; y < side; y += 7)
            for (int x = 2; x < side; x += 7) {
                double exact = anatomy_along(&s->view->anatomy, c_arm_source(&s->view->c_arm), pixel_ray(&s->view->c_arm, side, x, y));
                double error = (double)drawn[y * side + x] - exact;
                square += error * error;
                most = fmax(most, exact);
                count++;
            }
        print_message("%s: rms %.5f of up to %.3f\n", kind ? "volume" : "patient made of solids", sqrt(square / count), most);
        assert_true(most > 0.5);
        // the volume's steps are half as fine as the reference's, across bone
        assert_true(sqrt(square / count) < (kind ? 0.01 : 1e-4) * most);
        free(drawn);
        room_close(s);
    }
    // a line through the middles of voxels, by hand
    options[1].anatomy_axis[0] = vec3(3, 0, 0), options[1].anatomy_axis[1] = vec3(0, 3, 0), options[1].anatomy_axis[2] = vec3(0, 0, 3);
    XrayRoom *s = room_open(&options[1], 64);
    double by_hand = 0;
    for (int j = 0; j < NY; j++) {
        double value = (double)hounsfield[(24 * NY + j) * NX + 19];
        double water = ATTENUATION_WATER;
        by_hand += 3 * (value < 150 ? water * (1 + value / 1000) : 1.15 * water + (ATTENUATION_BONE - 1.15 * water) * (value - 150) / 1350);
    }
    // a level of 255 is 2 % of soft tissue
    assert_near(anatomy_along(&s->view->anatomy, vec3(-60 + 19 * 3, -1000, -70 + 24 * 3), vec3(0, 1, 0)) / by_hand, 1, 0.02);
    room_close(s);
    free(hounsfield);
}

static void the_lumen_is_taken_out_of_the_volume(void **state)
{
    (void)state;
    enum { N = 48 };
    float *bright = calloc(N * N * N, sizeof *bright);
    for (int k = 0; k < N; k++)
        for (int j = 0; j < N; j++)
            for (int i = 0; i < N; i++) {
                double r = sqrt((i - 23.5) * (i - 23.5) + (j - 23.5) * (j - 23.5) + (k - 23.5) * (k - 23.5));
                bright[(k * N + j) * N + i] = r < 10 || (k < 4 && j > 20 && j < 27) ? 255 : 0;
            }
    TriangleMesh ball = sphere_mesh(16);
    for (int v = 0; v < ball.vertex_count; v++)
        ball.vertex[v] = vec3_scale(ball.vertex[v], 10);
    FluoroscopeOptions options = fluoroscope_default_options();
    options.anatomy_value = bright;
    options.anatomy_size[0] = options.anatomy_size[1] = options.anatomy_size[2] = N;
    options.anatomy_origin = vec3(-23.5, -23.5, -23.5);
    options.anatomy_axis[0] = vec3(1, 0, 0), options.anatomy_axis[1] = vec3(0, 1, 0), options.anatomy_axis[2] = vec3(0, 0, 1);
    double along[2][2];
    for (int k = 0; k < 2; k++) {
        options.vessel = k ? &ball : NULL;
        Anatomy anatomy;
        MeshLids none = {0};
        char message[100] = "";
        assert_true(anatomy_create(&anatomy, &options, &none, message, sizeof message));
        body_free(&anatomy.body);
        along[k][0] = anatomy_along(&anatomy, vec3(0.1, -500, 0.2), vec3(0, 1, 0));
        along[k][1] = anatomy_along(&anatomy, vec3(-500, 0.1, -22), vec3(1, 0, 0));
        anatomy_free(&anatomy);
    }
    assert_near(along[0][0] / (20 * ATTENUATION_BONE), 1, 0.05);
    assert_near(along[1][0], 0, 1e-12);               // the lumen is visible only by the contrast agent that flows
    assert_near(along[1][1], along[0][1], 1e-12);     // tissue outside the model stays
    assert_true(along[1][1] > 1);
    free(bright);
    mesh_clear(&ball);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(thickness_is_that_of_a_ray_caster),
        cmocka_unit_test(finer_meshes_come_closer_to_the_sphere),
        cmocka_unit_test(contrast_follows_the_nodes),
        cmocka_unit_test(the_ribbon_has_the_chord_of_a_cylinder),
        cmocka_unit_test(a_tube_is_its_wall_s_chord_and_tools_add_up),
        cmocka_unit_test(the_tube_converges_with_the_pixels),
        cmocka_unit_test(marker_bands_are_as_long_as_they_are),
        cmocka_unit_test(shadows_keep_what_the_tool_takes_away),
        cmocka_unit_test(bodies_and_volumes_are_integrated),
        cmocka_unit_test(the_lumen_is_taken_out_of_the_volume),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
