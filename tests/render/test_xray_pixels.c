// The picture that the processor makes of the layers of fluoroscopy is that of the shaders, for all modes, and the same bits on each instruction set. Skipped by name
// without EGL.
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

#include "../geom/small_meshes.h"
#include "base/base.h"
#include "xray_room.h"

enum { NODES = 31, WIRE = 25, FRAMES = 30 };

typedef struct Pair {
    TriangleMesh mesh;
    VesselTree *tree;
    Pose *pose;
    TubeStretch stretch;
    ToolLooks looks;
    XrayRoom *room;          // drawn by the processor
    Fluoroscope *shaders;
    GlCanvas canvas;
    float contrast[NODES];
} Pair;

// A bent tube with a wire in it, in a patient made of solids; `width` x `height`: of the port.
static bool pair_open(Pair *s, int width, int height)
{
    s->mesh = bent_tube_mesh(2.5, 0, 12, 14, 1.9, 12, 0.5, 40);
    s->tree = vessel_tree_create(NODES, 0, 0);
    for (int n = 0; n < NODES; n++) {
        const double a = 1.9 * fmin(fmax((n - 7.0) / 16, 0), 1), past = fmax(n - 23.0, 0) * 1.7;
        const Vec3 bend = vec3(fmin(n, 7) * 12 / 7 + 14 * sin(a), 14 * (1 - cos(a)), 0);
        s->tree->center[n] = vec3_add_scaled(bend, past, vec3(cos(a), sin(a), 0));
        s->tree->radius[n] = 2.5;
        s->tree->parent[n] = n - 1;
    }
    s->pose = pose_create(WIRE, 1, &(int){WIRE});
    s->stretch = (TubeStretch){.end = 2 * WIRE, .radius = 0.4, .lumen = 0.2, .attenuation = 0.55};
    s->looks = (ToolLooks){.count = 1, .tool = {{.stretch_count = 1, .stretch = &s->stretch}}};
    for (int i = 0; i < WIRE; i++)
        s->pose->tool[0].node[i] = (ToolNode){.s = 2.0 * i, .position = s->tree->center[i], .radius = 0.4};
    FluoroscopeOptions options = fluoroscope_default_options();
    options.vessel = &s->mesh;
    options.tree = s->tree;
    options.tools = &s->looks;
    options.pose = s->pose;
    s->room = room_open(&options, 64);
    if (!s->room)
        return false;
    char message[300];
    s->shaders = fluoroscope_create(&options, message, sizeof message);
    s->shaders->on_processor = false;
    s->room->view->on_processor = true;
    s->room->frame.pose = s->pose;
    s->room->frame.xray.table_mm[0] = 12;
    s->room->frame.xray.table_mm[1] = 8;
    return gl_canvas_create(&s->canvas, width, height, 1, message, sizeof message);
}

static void pair_close(Pair *s)
{
    if (s->room) {
        fluoroscope_destroy(s->shaders);
        gl_canvas_destroy(&s->canvas);
        room_close(s->room);
    }
    pose_free(s->pose);
    vessel_tree_free(s->tree);
    mesh_clear(&s->mesh);
}

// Contrast agent runs in, rests, the C-arm turns and rests, a mask and its subtraction, a roadmap and the blades.
static void set_frame(Pair *s, int i)
{
    XrayControl *xray = &s->room->frame.xray;
    const double front = i < 6 ? 4.0 * i : i < 16 ? 20 : i < 19 ? 0 : 3.0 * (i - 18);
    for (int n = 0; n < NODES; n++)
        s->contrast[n] = front > 0 ? (float)(1 / (1 + exp(n - front))) : 0;
    for (int k = 0; k < WIRE; k++)
        s->pose->tool[0].node[k].position = vec3_add(s->tree->center[k], vec3(0, 0, 0.05 * i));
    xray->lao_deg = i < 8 ? 10 : i < 12 ? 10 + 7.0f * (float)(i - 7) : 38;
    xray->mode = i < 18 ? XRAY_LIVE : i < 24 ? XRAY_DSA : XRAY_ROADMAP;
    xray->collimator[0] = i < 27 ? 0 : 0.2f;
    s->room->frame.contrast = s->contrast;
    s->room->frame.pulse = (uint32_t)(i + 1);
}

static void draw_both(Pair *s, uint8_t *rgb[2])
{
    const ViewPort port = {s->canvas.framebuffer, 0, 0, s->canvas.width, s->canvas.height};
    Fluoroscope *view[2] = {s->room->view, s->shaders};
    for (int k = 0; k < 2; k++) {
        fluoroscope_draw(view[k], &s->room->frame, port);
        gl_canvas_read(&s->canvas, rgb[k]);
    }
}

static void pictures_are_those_of_the_shaders(void **state)
{
    (void)state;
    // squares of even and odd side; beside the square, below and above it
    static const int size[3][2] = {{330, 240}, {241, 241}, {200, 263}};
    for (int k = 0; k < 3; k++) {
        Pair s = {0};
        if (!pair_open(&s, size[k][0], size[k][1])) {
            pair_close(&s);
            skip();
        }
        const size_t bytes = (size_t)size[k][0] * (size_t)size[k][1] * 3;
        uint8_t *rgb[2] = {malloc(bytes), malloc(bytes)};
        double worst = 0;
        int most = 0, bright = 0;
        for (int i = 0; i < FRAMES; i++) {
            set_frame(&s, i);
            draw_both(&s, rgb);
            for (int view = 0; view < 2; view++) {
                const FluoroscopeState now = fluoroscope_state(view ? s.shaders : s.room->view);
                assert_true(now.has_mask == (i >= 18) && now.has_roadmap == (i >= 24));
            }
            size_t differ = 0;
            for (size_t b = 0; b < bytes; b++) {
                const int step = abs(rgb[0][b] - rgb[1][b]);
                most = step > most ? step : most;
                differ += step != 0;
                bright = rgb[1][b] > bright ? rgb[1][b] : bright;
            }
            worst = fmax(worst, (double)differ / (double)bytes);
        }
        print_message("%d x %d: at most %d of 255, in at most %.2f %% of the channels\n", size[k][0], size[k][1], most, 100 * worst);
        // shaders round what lumen and tools darken to 16 bits of 14 times white, by up to 0.03 of 255: 3 % of the values lie so near to a half
        assert_true(bright > 200 && most <= 1);
        assert_true(worst < 0.03);
        free(rgb[0]);
        free(rgb[1]);
        pair_close(&s);
    }
}

static void each_instruction_set_gives_the_same_bits(void **state)
{
    (void)state;
    Pair s = {0};
    if (!pair_open(&s, 330, 240)) {
        pair_close(&s);
        skip();
    }
    const size_t bytes = 330 * 240 * 3;
    uint8_t *rgb[2] = {malloc(bytes), malloc(bytes)}, *first[FRAMES];
    for (int level = SIMD_SSE2; level <= (int)simd_widest(); level++) {
        simd_force((SimdLevel)level);
        fluoroscope_forget(s.room->view);
        for (int i = 0; i < FRAMES; i++) {
            set_frame(&s, i);
            draw_both(&s, rgb);
            if (level == SIMD_SSE2)
                first[i] = memcpy(malloc(bytes), rgb[0], bytes);
            assert_memory_equal(rgb[0], first[i], bytes);
        }
    }
    simd_force(simd_widest());
    for (int i = 0; i < FRAMES; i++)
        free(first[i]);
    free(rgb[0]);
    free(rgb[1]);
    pair_close(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(pictures_are_those_of_the_shaders),
        cmocka_unit_test(each_instruction_set_gives_the_same_bits),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
