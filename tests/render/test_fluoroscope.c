// The pictures of fluoroscopy: Beer-Lambert law, noise, blades, DSA, roadmap, held image, mirrored scenes, bad vessels. Skipped by name without EGL.
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

#include "../geom/near.h"
#include "../geom/small_meshes.h"
#include "xray_room.h"

static const float full = 1;

static TriangleMesh ball_of(double radius, Vec3 place)
{
    TriangleMesh ball = sphere_mesh(24);
    for (int v = 0; v < ball.vertex_count; v++)
        ball.vertex[v] = vec3_add_scaled(place, radius, ball.vertex[v]);
    return ball;
}

static FluoroscopeOptions quiet_room(const TriangleMesh *vessel)
{
    FluoroscopeOptions options = fluoroscope_default_options();
    options.has_no_anatomy = true;
    options.quanta = 0;
    options.vessel = vessel;
    return options;
}

// A straight tool of `count` nodes from a to b.
typedef struct Tool {
    Pose *pose;
    TubeStretch stretch;
    ToolLooks looks;
} Tool;
static Tool tool_make(int count, Vec3 a, Vec3 b, double radius, double attenuation)
{
    Tool tool = {
        .pose = pose_create(count, 1, &count), .stretch = {.end = vec3_distance(a, b), .radius = radius, .attenuation = attenuation}, .looks = {.count = 1}};
    for (int i = 0; i < count; i++)
        tool.pose->tool[0].node[i] = (ToolNode){.s = vec3_distance(a, b) * i / (count - 1.0), .position = vec3_mix(a, b, i / (count - 1.0)), .radius = radius};
    return tool;
}

static void tool_give(Tool *tool, FluoroscopeOptions *options)
{
    tool->looks.tool[0] = (ToolLook){.stretch_count = 1, .stretch = &tool->stretch};
    options->tools = &tool->looks;
    options->pose = tool->pose;
}

static void tool_free(Tool *tool) { pose_free(tool->pose); }

// A ball of contrast agent of radius 6 in the middle, a wire from a to b.
typedef struct Patient {
    TriangleMesh ball;
    Tool wire;
    XrayRoom *room;
} Patient;
static XrayRoom *patient_open(Patient *patient, FluoroscopeOptions options, Vec3 a, Vec3 b, int side)
{
    *patient = (Patient){.ball = ball_of(6, vec3(0, 0, 0)), .wire = tool_make(31, a, b, 0.5, 0.6)};
    options.vessel = &patient->ball;
    tool_give(&patient->wire, &options);
    patient->room = room_open(&options, side);
    if (patient->room)
        patient->room->frame.pose = patient->wire.pose;
    return patient->room;
}

static void patient_close(Patient *patient)
{
    if (patient->room)
        room_close(patient->room);
    tool_free(&patient->wire);
    mesh_clear(&patient->ball);
}

static void known_thickness_gives_known_grey(void **state)
{
    (void)state;
    // a ball of contrast agent 16 mm across and a rod of 4 mm, intersecting at the top
    TriangleMesh ball = ball_of(8, vec3(0, 0, 0));
    FluoroscopeOptions options = quiet_room(&ball);
    Tool rod = tool_make(31, vec3(-30, 0, -3), vec3(30, 0, -3), 2, 0.15);
    tool_give(&rod, &options);
    XrayRoom *s = room_open(&options, 240);
    if (!s)
        skip();
    s->frame.pose = rod.pose;
    for (int k = 0; k <= 4; k++) {
        float c = 0.25f * (float)k;
        s->frame.contrast = &c;
        s->frame.pulse++;
        room_draw(s);
        // four pixels per millimetre; rays are almost parallel to the axis. The picture is rounded by half a step, the noise-free base by less
        double slab = 0.105 * (double)c;
        assert_near(room_grey(s, 120, 120 + 16), live_grey(slab * 2 * sqrt(64 - 16)), 1.5);
        assert_near(room_grey(s, 20, 120 - 12), live_grey(0.15 * 4), 1.5);
        assert_near(room_grey(s, 120, 120 - 12), live_grey(0.15 * 4 + slab * 2 * sqrt(64 - 9)), 1.5);
        assert_near(room_grey(s, 40, 200), live_grey(0), 1);
    }
    room_close(s);
    tool_free(&rod);
    mesh_clear(&ball);
}

// A pipe that ends at its mouth, with or without a tool; of the thickness of its wall on both sides.
static void the_sheath_is_seen_up_to_its_mouth(void **state)
{
    (void)state;
    FluoroscopeOptions options = quiet_room(NULL);
    options.sheath = (SheathLook){.is_there = true, .mouth = {0, 0, -3}, .direction = {1, 0, 0}, .radius = 6, .lumen = 3, .attenuation = 0.05};
    XrayRoom *s = room_open(&options, 240);
    if (!s)
        skip();
    room_draw(s);
    assert_near(room_grey(s, 120 - 40, 120 - 12), live_grey(0.05 * 6), 1.5);
    const double beside = 18.5 / 4;           // [mm] of that pixel's centre: beside the lumen the ray has the whole wall
    assert_near(room_grey(s, 120 - 40, 120 - 12 + 18), live_grey(0.05 * 2 * sqrt(36 - beside * beside)), 1.5);
    assert_near(room_grey(s, 120 + 20, 120 - 12), live_grey(0), 1);
    assert_near(room_grey(s, 120 - 40, 120 + 20), live_grey(0), 1);
    room_close(s);
}

// The reference is the image that was shown when it was taken, pixel by pixel, whatever the live one shows later; it has no memory of its own.
static void a_reference_image_stays(void **state)
{
    (void)state;
    Patient patient;
    XrayRoom *s = patient_open(&patient, quiet_room(NULL), vec3(-30, 0, -3), vec3(30, 0, -3), 200);
    if (!s)
        skip();
    const size_t bytes = (size_t)200 * 200 * 3;
    uint8_t *before = malloc(bytes);
    float half = 0.5F;
    assert_non_null(before);
    s->frame.contrast = &half;
    room_draw(s);
    memcpy(before, s->rgb, bytes);
    Fluoroscope *live = s->view, *reference = fluoroscope_create_beside(live, patient.wire.pose);
    assert_non_null(reference);
    fluoroscope_take_picture(reference, live);
    s->frame.contrast = NULL;
    s->frame.xray.lao_deg = 40;
    s->frame.pulse = 9;
    room_draw(s);
    assert_true(memcmp(before, s->rgb, bytes) != 0);
    s->view = reference;
    s->frame.xray.pedal = 0;
    room_draw(s);
    int differ = 0;
    for (int y = 0; y < 200; y++)            // except the sign of a held image in the corner
        for (int x = 0; x < 200; x++)
            differ += (y >= 40 || x < 160) && before[3 * (200 * y + x)] != s->rgb[3 * (200 * y + x)];
    assert_int_equal(differ, 0);
    // as a second plane it takes pulses of its own, and the first one is not disturbed
    s->view = live;
    s->frame.xray.pedal = 1;
    s->frame.pulse = 10;
    room_draw(s);
    memcpy(before, s->rgb, bytes);
    s->view = reference;
    s->frame.xray.lao_deg = -50;
    room_draw(s);
    assert_true(memcmp(before, s->rgb, bytes) != 0);
    s->view = live;
    s->frame.xray.pedal = 0;
    room_draw(s);
    differ = 0;
    for (int y = 40; y < 200; y++)
        for (int x = 0; x < 200; x++)
            differ += before[3 * (200 * y + x)] != s->rgb[3 * (200 * y + x)];
    assert_int_equal(differ, 0);
    fluoroscope_destroy(reference);
    free(before);
    patient_close(&patient);
}

// A thicker device replaces the tool, with fewer nodes at other places: the picture is as if it had been there from the start; then the first one again.
static void an_exchanged_tool_is_seen_as_it_is(void **state)
{
    (void)state;
    TriangleMesh ball = ball_of(8, vec3(0, 0, 0));
    FluoroscopeOptions options = quiet_room(&ball);
    const Vec3 a = vec3(-30, 0, -3), b = vec3(30, 0, -3);
    Tool rod = tool_make(31, a, b, 2, 0.15), thick = tool_make(21, a, b, 4, 0.1);
    tool_give(&thick, &options);
    XrayRoom *s = room_open(&options, 240);
    if (!s)
        skip();
    s->frame.pose = thick.pose;
    s->frame.pulse = 1;
    room_draw(s);
    double expected[2] = {room_grey(s, 20, 120 - 12), room_grey(s, 20, 120 - 12 + 12)}, first[2];
    room_close(s);
    tool_give(&rod, &options);
    rod.looks.spare[0][0] = (ToolLook){.stretch_count = 1, .stretch = &thick.stretch};
    s = room_open(&options, 240);
    for (int turn = 0; turn < 3; turn++) {
        Pose *pose = rod.pose;
        if (turn == 1) {
            pose->tool[0].fitted = 1;
            pose->tool[0].node_count = thick.pose->tool[0].node_count;
            memcpy(pose->tool[0].node, thick.pose->tool[0].node, (size_t)pose->tool[0].node_count * sizeof *pose->tool[0].node);
        } else if (turn == 2) {
            Tool again = tool_make(31, a, b, 2, 0.15);
            pose_copy(pose, again.pose);
            tool_free(&again);
        }
        s->frame.pose = pose;
        s->frame.pulse++;
        room_draw(s);
        double seen[2] = {room_grey(s, 20, 120 - 12), room_grey(s, 20, 120 - 12 + 12)};
        if (turn == 0)
            memcpy(first, seen, sizeof first);
        for (int i = 0; i < 2; i++)
            assert_near(seen[i], turn == 1 ? expected[i] : first[i], 0);
    }
    assert_near(first[0], live_grey(0.15 * 4), 1.5);
    assert_near(expected[0], live_grey(0.1 * 8), 1.5);
    assert_true(first[1] > expected[1] + 5);       // 3 mm off the axis there is only the thick one
    room_close(s);
    tool_free(&rod);
    tool_free(&thick);
    mesh_clear(&ball);
}

static void noise_is_that_of_the_quanta(void **state)
{
    (void)state;
    TriangleMesh slab;
    const Vec3 corner[4] = {{-40, -10, 0}, {40, -10, 0}, {40, 10, 0}, {-40, 10, 0}};
    slab = prism_mesh(corner, 4, 40);   // 20 mm of contrast agent in the upper half
    FluoroscopeOptions options = quiet_room(&slab);
    for (int k = 0; k < 2; k++) {
        options.quanta = k ? 2000 : 550;
        XrayRoom *s = room_open(&options, 400);
        if (!s)
            skip();
        float part = 0.6f;
        s->frame.contrast = &part;
        room_draw(s);
        PixelMoments half[2] = {room_moments(s, 40, 40, 360, 180), room_moments(s, 40, 220, 360, 360)};
        for (int h = 0; h < 2; h++) {
            double attenuation = h ? 0.6 * 0.105 * 20 : 0, transmission = 0.27 * exp(-attenuation);
            // sigma of 1.75 I^0.72 where sigma of I is sqrt(I / quanta); a step of 255 adds 1/12
            double sigma = 255 * 1.75 * 0.72 * pow(transmission, 0.72 - 1) * sqrt(transmission / options.quanta);
            print_message("quanta %g, I %.3f: grey %.2f (%.2f), sigma %.3f (%.3f)\n", options.quanta, transmission, half[h].mean, live_grey(attenuation),
                          half[h].deviation, sqrt(sigma * sigma + 1.0 / 12));
            // 44,800 pixels; noise is correlated over about seven: the estimate's own sigma is 0.9 %; rays through the slab's edges are a little longer
            assert_near(half[h].deviation / sqrt(sigma * sigma + 1.0 / 12), 1, 0.03);
            assert_near(half[h].mean, live_grey(attenuation), h ? 1.5 : 0.5);
        }
        room_close(s);
    }
    mesh_clear(&slab);
}

static void the_same_pulse_gives_the_same_picture(void **state)
{
    (void)state;
    FluoroscopeOptions options = fluoroscope_default_options();
    options.has_no_anatomy = true;     // whose structure all pulses share
    XrayRoom *s = room_open(&options, 160), *other = room_open(&options, 160);
    if (!s || !other)
        skip();
    size_t bytes = 160 * 160 * 3;
    uint8_t *first = malloc(bytes);
    // `other` is the current context
    for (uint32_t pulse = 1; pulse < 4; pulse++) {
        other->frame.pulse = pulse;
        room_draw(other);
        if (pulse == 2)
            memcpy(first, other->rgb, bytes);
    }
    assert_true(memcmp(first, other->rgb, bytes) != 0);
    // independent pulses
    double product = 0, square = 0;
    uint8_t *last = malloc(bytes);
    memcpy(last, other->rgb, bytes);
    other->frame.pulse = 2;
    room_draw(other);
    assert_memory_equal(first, other->rgb, bytes);
    PixelMoments m = room_moments(other, 60, 60, 100, 100);
    for (int y = 60; y < 100; y++)
        for (int x = 60; x < 100; x++) {
            size_t at = (size_t)(y * 160 + x) * 3;
            product += (first[at] - m.mean) * (last[at] - m.mean);
            square += (first[at] - m.mean) * (first[at] - m.mean);
        }
    assert_true(fabs(product / square) < 0.25);   // 1,600 pixels, about 230 independent: three sigmas are 0.2
    free(first);
    free(last);
    room_close(other);
    room_close(s);
}

static void blades_cover_what_they_are_set_to(void **state)
{
    (void)state;
    FluoroscopeOptions options = quiet_room(NULL);
    XrayRoom *s = room_open(&options, 400);
    if (!s)
        skip();
    s->frame.xray.collimator[0] = 0.5f;    // left half of the left half
    s->frame.xray.collimator[3] = 0.25f;   // an eighth at the top
    room_draw(s);
    double open = live_grey(0);
    assert_near(room_grey(s, 200, 200), open, 1);
    assert_near(room_grey(s, 380, 20), open, 1);
    assert_true(room_grey(s, 80, 200) < 12 && room_grey(s, 200, 370) < 12);
    // the soft edge is half open where the blade ends, and rises over a few pixels
    assert_near(room_grey(s, 100, 200) / open, 0.5, 0.1);
    assert_near(room_grey(s, 200, 350) / open, 0.5, 0.1);
    assert_true(room_grey(s, 92, 200) < 0.1 * open && room_grey(s, 108, 200) > 0.9 * open);
    // rounded: in the corner, the opening is dark for a pixel or two
    assert_true(room_grey(s, 103, 346) < 0.3 * open);
    room_close(s);
}

static void dsa_shows_the_vessel_alone(void **state)
{
    (void)state;
    Patient patient;
    XrayRoom *s = patient_open(&patient, fluoroscope_default_options(), vec3(-30, 0, 15), vec3(30, 0, 15), 320);   // a head without bones
    if (!s) {
        patient_close(&patient);
        skip();
    }
    s->frame.xray.field_mm = 80;
    room_draw(s);
    s->frame.pulse++;
    s->frame.xray.mode = XRAY_DSA;
    s->frame.xray.mask = 1;
    room_draw(s);
    assert_true(fluoroscope_state(s->view).has_mask && !fluoroscope_state(s->view).mask_has_moved);
    s->frame.pulse++;
    room_draw(s);
    // without contrast agent: flat within the noise of picture and mask, in front of bones, air cells and the wire
    double flat = 255 * 0.62;
    const CArm *c_arm = &s->view->c_arm;
    for (int y = 30; y < 290; y += 20)
        for (int x = 30; x < 290; x += 20) {
            PixelMoments m = room_moments(s, x, y, x + 20, y + 20);
            double a = anatomy_along(&s->view->anatomy, c_arm_source(c_arm), pixel_ray(c_arm, 320, x + 10, y + 10));
            double transmission = fmin(exp(s->view->tone.exposure - anatomy_shown(a, s->view->tone.mean)), 1);
            double sigma = flat * s->view->options.dsa_gain * sqrt(2 / (s->view->options.quanta * s->view->options.dsa_dose * transmission));
            assert_near(m.mean, flat, 5 * sigma * 2.7 / 20 + 0.5);   // 400 pixels, with noise correlated over 2.7
            assert_near(m.deviation / sigma, 1, 0.35);
        }
    // contrast agent: only the ball
    s->frame.contrast = &full;
    s->frame.pulse++;
    room_draw(s);
    assert_near(room_moments(s, 157, 157, 163, 163).mean / (flat * exp(-s->view->options.dsa_gain * 0.105 * 12)), 1, 0.12);
    assert_near(room_moments(s, 40, 40, 80, 80).mean, flat, 2);
    // the mask stays while the tool moves: white where the tool was, dark where it is
    s->frame.contrast = NULL;
    for (int i = 0; i < 31; i++)
        patient.wire.pose->tool[0].node[i].position.z -= 5;
    s->frame.pulse++;
    room_draw(s);
    int was = 160 + 15 * 4, is = 160 + 10 * 4;
    assert_true(room_moments(s, 60, was - 1, 260, was + 1).mean > flat + 20 && room_moments(s, 60, is - 1, 260, is + 1).mean < flat - 20);
    // after a rotation the mask no longer fits
    s->frame.xray.lao_deg = 10;
    s->frame.pulse++;
    room_draw(s);
    assert_true(fluoroscope_state(s->view).mask_has_moved);
    s->frame.xray.mask = 2;
    s->frame.pulse++;
    room_draw(s);
    assert_false(fluoroscope_state(s->view).mask_has_moved);
    patient_close(&patient);
}

static int blueness(const XrayRoom *s, int x, int y)
{
    const uint8_t *p = s->rgb + ((size_t)(s->side - 1 - y) * (size_t)s->side + (size_t)x) * 3;
    return p[2] - p[0];
}

static void the_roadmap_keeps_the_last_bolus(void **state)
{
    (void)state;
    Patient patient;
    XrayRoom *s = patient_open(&patient, quiet_room(NULL), vec3(-30, 0, 0), vec3(30, 0, 0), 240);
    if (!s) {
        patient_close(&patient);
        skip();
    }
    // before any contrast agent there is nothing to overlay
    s->frame.xray.mode = XRAY_ROADMAP;
    room_draw(s);
    assert_false(fluoroscope_state(s->view).has_roadmap);
    assert_int_equal(blueness(s, 120, 130), 0);
    // a bolus passes in live fluoroscopy; then the mask is taken
    s->frame.xray.mode = XRAY_LIVE;
    for (int k = 0; k < 5; k++) {
        const float c[5] = {0, 0.5f, 1, 0.3f, 0};
        s->frame.contrast = &c[k];
        s->frame.pulse++;
        room_draw(s);
        assert_int_equal(blueness(s, 120, 130), 0);
    }
    s->frame.contrast = NULL;
    s->frame.xray.mode = XRAY_ROADMAP;
    s->frame.xray.mask = 1;
    s->frame.pulse++;
    room_draw(s);
    assert_true(fluoroscope_state(s->view).has_roadmap);
    assert_true(blueness(s, 120, 130) > 40);
    assert_int_equal(blueness(s, 120, 200), 0);
    // the live tool is visible over it, and the overlay rotates with the C-arm
    assert_true(room_grey(s, 120, 120) < 0.85 * room_grey(s, 120, 130));
    s->frame.xray.lao_deg = 60;
    s->frame.xray.field_mm = 100;
    for (int k = 0; k < 2; k++) {
        s->frame.pulse++;
        room_draw(s);
        assert_true(blueness(s, 120, 120 + 8) > 40 && blueness(s, 120, 120 + 19) == 0);
    }
    fluoroscope_forget(s->view);
    s->frame.pulse++;
    room_draw(s);
    assert_false(fluoroscope_state(s->view).has_roadmap);
    // the other order: first the roadmap, then the bolus; the vessels that it reached stay visible
    s->frame.xray.mask = 2;
    for (int k = 0; k < 4; k++) {
        const float c[4] = {0, 0.4f, 1, 0};
        s->frame.contrast = &c[k];
        s->frame.pulse++;
        room_draw(s);
        assert_true(fluoroscope_state(s->view).has_roadmap == (k > 0));
    }
    assert_true(blueness(s, 120, 120 + 8) > 40 && blueness(s, 120, 120 + 19) == 0);
    patient_close(&patient);
}

static void without_pedal_the_last_image_holds(void **state)
{
    (void)state;
    Patient patient;
    XrayRoom *s = patient_open(&patient, fluoroscope_default_options(), vec3(-30, 0, 0), vec3(30, 0, 10), 200);
    if (!s) {
        patient_close(&patient);
        skip();
    }
    size_t row = 200 * 3, bytes = 200 * row;
    uint8_t *before = malloc(bytes);
    room_draw(s);
    assert_false(fluoroscope_state(s->view).is_held);
    memcpy(before, s->rgb, bytes);
    // the pedal is off, everything moves, pulses are counted on: the picture stays except for the sign in its corner
    s->frame.xray.pedal = 0;
    s->frame.pulse += 5;
    s->frame.contrast = &full;
    s->frame.xray.lao_deg = 30;
    patient.wire.pose->tool[0].node[30].position.z += 10;
    room_draw(s);
    assert_true(fluoroscope_state(s->view).is_held);
    assert_near(fluoroscope_state(s->view).shown.lao_deg, 0, 0);
    assert_memory_equal(before + 40 * row, s->rgb + 40 * row, bytes - 40 * row);
    assert_true(memcmp(before, s->rgb, 40 * row) != 0);
    // on again
    s->frame.xray.pedal = 1;
    s->frame.pulse++;
    room_draw(s);
    assert_true(memcmp(before + 40 * row, s->rgb + 40 * row, bytes - 40 * row) != 0);
    assert_false(fluoroscope_state(s->view).is_held);
    free(before);
    patient_close(&patient);
}

static void a_mirrored_scene_gives_the_mirrored_picture(void **state)
{
    (void)state;
    uint8_t *picture[2] = {NULL, NULL};
    for (int mirrored = 0; mirrored < 2; mirrored++) {
        TriangleMesh mesh = bent_tube_mesh(2, -10, 5, 10, 1.4, 10, 0.5, 32);
        if (mirrored)
            mesh_move(&mesh, quat_identity(), vec3(0, 0, 0), true);
        double side = mirrored ? -1 : 1;
        FluoroscopeOptions options = quiet_room(&mesh);
        Tool wire = tool_make(41, vec3(-25 * side, 3, -8), vec3(18 * side, -5, 20), 0.3, 0.8);
        tool_give(&wire, &options);
        XrayRoom *s = room_open(&options, 200);
        if (!s)
            skip();
        s->frame.pose = wire.pose;
        s->frame.contrast = &full;
        s->frame.xray.lao_deg = (float)(25 * side);
        s->frame.xray.cra_deg = 15;
        room_draw(s);
        picture[mirrored] = malloc(200 * 200 * 3);
        memcpy(picture[mirrored], s->rgb, 200 * 200 * 3);
        room_close(s);
        tool_free(&wire);
        mesh_clear(&mesh);
    }
    int differ = 0, dark = 0;
    for (int y = 0; y < 200; y++)
        for (int x = 0; x < 200; x++) {
            int a = picture[0][(y * 200 + x) * 3], b = picture[1][(y * 200 + 199 - x) * 3];
            differ += abs(a - b) > 2;
            dark += a < live_grey(0.15);
        }
    assert_true(dark > 800);
    assert_true(differ < 8);   // a tool's end halfway between pixels
    free(picture[0]);
    free(picture[1]);
}

static void unfit_vessels_are_reported(void **state)
{
    (void)state;
    TriangleMesh tube = bent_tube_mesh(3, -15, 15, 10, 0.1, 1, 0.5, 32);
    FluoroscopeOptions options = quiet_room(&tube);
    XrayRoom *s = room_open(&options, 200);
    if (!s)
        skip();
    // open: closed by lids, with a message
    assert_true(room_says(s, "open at 2 places"));
    s->frame.contrast = &full;
    room_draw(s);
    assert_near(room_grey(s, 100, 100), live_grey(0.105 * 6), 2);
    // in front of the source: nothing is drawn, with a message
    s->frame.xray.table_mm[1] = -790;   // the patient's front is -y
    s->frame.pulse++;
    room_draw(s);
    assert_true(fluoroscope_state(s->view).is_out_of_beam);
    assert_near(room_grey(s, 100, 100), live_grey(0), 1);
    room_close(s);
    // oriented inwards as a whole
    for (int t = 0; t < tube.triangle_count; t++) {
        int b = tube.triangle[t][1];
        tube.triangle[t][1] = tube.triangle[t][2], tube.triangle[t][2] = b;
    }
    s = room_open(&options, 200);
    assert_true(room_says(s, "inwards"));
    s->frame.contrast = &full;
    room_draw(s);
    assert_near(room_grey(s, 100, 100), live_grey(0.105 * 6), 2);
    room_close(s);
    // one flipped triangle: whole rays would be wrong
    int b = tube.triangle[300][1];
    tube.triangle[300][1] = tube.triangle[300][2], tube.triangle[300][2] = b;
    s = room_open(&options, 200);
    assert_non_null(s->view);
    assert_true(room_says(s, "no contrast is drawn"));
    s->frame.contrast = &full;
    room_draw(s);
    assert_near(room_grey(s, 100, 100), live_grey(0), 1);
    room_close(s);
    tube.vertex[5].x = NAN;
    s = room_open(&options, 200);
    assert_true(room_says(s, "no contrast is drawn"));
    room_close(s);
    mesh_clear(&tube);
    // invalid options are refused with a reason
    FluoroscopeOptions bad = quiet_room(NULL);
    bad.patient.right = vec3(1, 1, 0);
    s = room_open(&bad, 64);
    assert_null(s->view);
    assert_true(room_says(s, "axes"));
    room_close(s);
}

static void kept_layers_give_the_same_as_new_ones(void **state)
{
    (void)state;
    Patient patient;
    XrayRoom *s = patient_open(&patient, fluoroscope_default_options(), vec3(-30, 0, 0), vec3(30, 0, 10), 150);
    if (!s) {
        patient_close(&patient);
        skip();
    }
    size_t bytes = 150 * 150 * 3;
    uint8_t *kept = malloc(bytes);
    uint64_t seed = 11;
    float c = 0;
    s->frame.contrast = &c;
    for (int round = 0; round < 25; round++) {
        // some pulses with motion, some at rest; cached parts must not show
        for (int pulse = 0; pulse < 9; pulse++) {
            bool moves = pulse < 3;
            if (moves && random_in(&seed, 0, 1) < 0.5)
                s->frame.xray.lao_deg = (float)random_in(&seed, -90, 90);
            if (moves && random_in(&seed, 0, 1) < 0.3)
                s->frame.xray.field_mm = (float)random_in(&seed, 40, 120);
            if (moves && random_in(&seed, 0, 1) < 0.5)
                c = random_in(&seed, 0, 1) < 0.4 ? 0 : (float)random_in(&seed, 0.1, 1);
            if (moves && random_in(&seed, 0, 1) < 0.3)
                s->frame.xray.collimator[(int)random_in(&seed, 0, 3.99)] = (float)random_in(&seed, 0, 0.6);
            if (random_in(&seed, 0, 1) < 0.5)
                patient.wire.pose->tool[0].node[(int)random_in(&seed, 0, 30.99)].position.z += 1;
            s->frame.pulse++;
            room_draw(s);
        }
        memcpy(kept, s->rgb, bytes);
        fluoroscope_forget(s->view);
        room_draw(s);
        assert_memory_equal(kept, s->rgb, bytes);
    }
    free(kept);
    patient_close(&patient);
}

static void whatever_state_gl_is_in(void **state)
{
    (void)state;
    Patient patient;
    XrayRoom *s = patient_open(&patient, fluoroscope_default_options(), vec3(-30, 0, 0), vec3(30, 0, 10), 120);
    if (!s) {
        patient_close(&patient);
        skip();
    }
    size_t bytes = 120 * 120 * 3;
    uint8_t *clean = malloc(bytes);
    s->frame.contrast = &full;
    for (int k = 0; k < 2; k++) {
        fluoroscope_forget(s->view);
        s->frame.pulse = 3;
        for (int pulse = 0; pulse < 3; pulse++) {
            s->frame.pulse++;
            if (k == 1) {
                static const GLenum on[] = {GL_SCISSOR_TEST, GL_DEPTH_TEST, GL_STENCIL_TEST, GL_CULL_FACE, GL_BLEND};
                for (int i = 0; i < 5; i++)
                    glEnable(on[i]);
                glScissor(0, 0, 7, 5);
                glBlendFunc(GL_DST_ALPHA, GL_ONE_MINUS_SRC_COLOR);
                glBlendEquation(GL_MAX);
                glFrontFace(GL_CW);
                glPolygonMode(GL_FRONT_AND_BACK, GL_LINE);
                glColorMask(GL_TRUE, GL_FALSE, GL_TRUE, GL_FALSE);
                glDepthFunc(GL_NEVER);
                glActiveTexture(GL_TEXTURE3);
            }
            room_draw(s);
        }
        if (k == 0)
            memcpy(clean, s->rgb, bytes);
    }
    assert_memory_equal(clean, s->rgb, bytes);
    assert_false(glIsEnabled(GL_SCISSOR_TEST));
    assert_int_equal(glGetError(), GL_NO_ERROR);
    free(clean);
    patient_close(&patient);
}

static void odd_frames_are_survived(void **state)
{
    (void)state;
    Patient patient;
    XrayRoom *s = patient_open(&patient, fluoroscope_default_options(), vec3(-30, 0, 0), vec3(30, 0, 10), 120);
    if (!s) {
        patient_close(&patient);
        skip();
    }
    const float lost = NAN;
    s->frame.contrast = &lost;
    patient.wire.pose->tool[0].node[7].position = vec3(NAN, 0, 0);
    patient.wire.pose->tool[0].node[15].position = vec3(0, 5000, 0);   // behind the source
    s->frame.xray.field_mm = INFINITY;
    s->frame.xray.mode = 77;
    s->frame.xray.collimator[0] = NAN;
    s->frame.xray.collimator[1] = 7;
    for (int k = 0; k < 6; k++) {
        s->frame.pulse++;
        s->frame.xray.lao_deg = k == 3 ? NAN : 500.0f * (float)k;
        fluoroscope_draw(s->view, &s->frame, (ViewPort){s->canvas.framebuffer, 3, 5, 110 - 20 * k, 60 + 10 * k});
    }
    fluoroscope_draw(s->view, &s->frame, (ViewPort){s->canvas.framebuffer, 0, 0, 0, 0});
    assert_int_equal(glGetError(), GL_NO_ERROR);
    patient_close(&patient);
}

// Where marks are drawn: in the picture that is shown, also while it is held and the C-arm turns.
static void a_point_is_located_in_the_picture(void **state)
{
    (void)state;
    XrayRoom *s = room_open(NULL, 96);
    if (!s)
        skip();
    double at[2];
    assert_true(fluoroscope_locate(s->view, vec3(0, 0, 0), at) == 0);          // no picture yet
    room_draw(s);
    for (int held = 0; held < 2; held++) {
        assert_true(fabs(fluoroscope_locate(s->view, vec3(0, 0, 0), at) - 1.0 / 60) < 1e-12);
        assert_true(fabs(at[0]) < 1e-12 && fabs(at[1]) < 1e-12);
        assert_true(fluoroscope_locate(s->view, vec3(6, 0, 12), at) > 0);      // the patient's left is on the right, the head is up
        assert_true(fabs(at[0] - 0.1) < 1e-12 && fabs(at[1] - 0.2) < 1e-12);
        assert_true(fluoroscope_locate(s->view, vec3(40, 0, 0), at) == 0);     // outside the field
        s->frame.xray.pedal = 0;
        s->frame.xray.lao_deg = 90;
        s->frame.pulse++;
        room_draw(s);
    }
    room_close(s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(known_thickness_gives_known_grey),
        cmocka_unit_test(the_sheath_is_seen_up_to_its_mouth),
        cmocka_unit_test(a_reference_image_stays),
        cmocka_unit_test(an_exchanged_tool_is_seen_as_it_is),
        cmocka_unit_test(noise_is_that_of_the_quanta),
        cmocka_unit_test(the_same_pulse_gives_the_same_picture),
        cmocka_unit_test(blades_cover_what_they_are_set_to),
        cmocka_unit_test(dsa_shows_the_vessel_alone),
        cmocka_unit_test(the_roadmap_keeps_the_last_bolus),
        cmocka_unit_test(without_pedal_the_last_image_holds),
        cmocka_unit_test(a_mirrored_scene_gives_the_mirrored_picture),
        cmocka_unit_test(unfit_vessels_are_reported),
        cmocka_unit_test(odd_frames_are_survived),
        cmocka_unit_test(a_point_is_located_in_the_picture),
        cmocka_unit_test(whatever_state_gl_is_in),
        cmocka_unit_test(kept_layers_give_the_same_as_new_ones),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
