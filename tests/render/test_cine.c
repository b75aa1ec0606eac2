// The cine loop: a ring buffer of images, replay at the times of the pulses, files that are read back unchanged, and damaged files that are refused.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "render/cine.h"
#include "tests/heap_calls.h"

#include <stdio.h>
#include <string.h>
#include <unistd.h>

enum { NODES = 5, TREE = 7 };
static Faults faults;

static Cine *create_cine(int nodes, int contrast_count, int capacity)
{
    const CineShape shape = {1, {nodes}, contrast_count};
    return cine_create(&shape, capacity);
}

static void fill_pose(Pose *pose, int image, double time_s, double pulses_s)
{
    pose->step = 1000 * image;
    pose->time_s = time_s;
    pose->command = (Command){image, -image};
    pose->xray = xray_default_control();
    pose->xray.pedal = 1;
    pose->xray.pulses_s = (float)pulses_s;
    pose->inserted_mm = 10 + image;
    pose->report = (StepReport){.flags = 4, .candidates = 3, .wall_force_max = 0.1 * image, .proximal_force = -0.5, .newton = 1};
    pose->first_free_node = image % NODES;
    for (int i = 0; i < NODES; i++) {
        pose->position[i] = vec3(i, image, -i);
        pose->quaternion[i] = quat_from_rotation_vector(vec3(0.1 * image, 0.2, i));
        pose->node[i] = (NodeReport){.s = i, .radius = 0.18, .force = vec3(0, 0, image), .gap = i ? 0.5 : HUGE_VAL, .vessel_node = i % TREE};
    }
    pose_fill_single_tool(pose);
}

static bool add(Cine *cine, int image, double time_s, double pulses_s)
{
    Pose *pose = pose_create(NODES, 1, &(int){NODES});
    assert_non_null(pose);
    fill_pose(pose, image, time_s, pulses_s);
    float contrast[TREE];
    for (int i = 0; i < TREE; i++)
        contrast[i] = (float)(image % 10) / 10;
    bool kept = cine_add(cine, &(CineFrame){pose, contrast, (uint32_t)image});
    pose_free(pose);
    return kept;
}

static Cine *loop_of(int count, int capacity, double pulses_s)
{
    Cine *cine = create_cine(NODES, TREE, capacity);
    assert_non_null(cine);
    assert_true(cine_record(cine));
    for (int i = 1; i <= count; i++)
        assert_true(add(cine, i, i / pulses_s, pulses_s));
    cine_stop(cine);
    return cine;
}

static void check_image(const Cine *cine, int index, int image)
{
    Pose *pose = pose_create(NODES, 1, &(int){NODES});
    assert_non_null(pose);
    CineFrame frame = cine_frame(cine, index);
    fill_pose(pose, image, frame.pose->time_s, (double)frame.pose->xray.pulses_s);
    assert_int_equal(frame.pulse, image);
    assert_int_equal(frame.pose->step, pose->step);
    assert_memory_equal(&frame.pose->xray, &pose->xray, sizeof pose->xray);
    assert_true(frame.pose->command.push_mm_s == image && frame.pose->inserted_mm == 10 + image && frame.pose->first_free_node == image % NODES);
    assert_true(frame.pose->report.flags == 4 && frame.pose->report.wall_force_max == pose->report.wall_force_max && frame.pose->report.newton == 1);
    assert_memory_equal(frame.pose->position, pose->position, sizeof(Vec3) * NODES);
    assert_memory_equal(frame.pose->quaternion, pose->quaternion, sizeof(Quat) * NODES);
    for (int i = 0; i < NODES; i++) {
        const NodeReport *a = &frame.pose->node[i], *b = &pose->node[i];
        const ToolNode *c = &frame.pose->tool[0].node[i], *d = &pose->tool[0].node[i];
        assert_true(c->s == d->s && vec3_distance(c->position, d->position) == 0 && c->radius == d->radius && c->carrier == d->carrier);
        assert_true(a->s == b->s && a->radius == b->radius && a->force.z == b->force.z && a->gap == b->gap && a->vessel_node == b->vessel_node);
    }
    for (int i = 0; i < TREE; i++)
        assert_true(frame.contrast[i] == (float)(image % 10) / 10);
    pose_free(pose);
}

// --- recording ---

static void the_oldest_image_goes(void **state)
{
    (void)state;
    Cine *cine = loop_of(25, 10, 15);
    assert_int_equal(cine_count(cine), 10);
    assert_int_equal(cine_dropped(cine), 15);
    for (int i = 0; i < 10; i++)
        check_image(cine, i, 16 + i);
    assert_false(add(cine, 26, 2, 15));   // stopped
    assert_true(cine_record(cine));
    assert_true(cine_count(cine) == 0 && cine_dropped(cine) == 0 && cine_is_recording(cine));
    assert_true(add(cine, 7, 1, 15));
    assert_false(add(cine, 7, 1.01, 15));   // the image of the same pulse, drawn again
    assert_int_equal(cine_count(cine), 1);
    check_image(cine, 0, 7);
    cine_free(cine);
}

static void a_locked_loop_keeps_what_it_has(void **state)
{
    (void)state;
    Cine *cine = loop_of(9, 10, 15);
    cine_lock(cine, true);
    assert_false(cine_record(cine));
    cine_lock(cine, false);
    assert_true(cine_record(cine));
    for (int i = 1; i <= 9; i++)
        add(cine, i, i, 15);
    cine_lock(cine, true);
    assert_true(add(cine, 10, 10, 15));
    assert_false(add(cine, 11, 11, 15));
    for (int i = 0; i < 10; i++)
        check_image(cine, i, 1 + i);
    cine_lock(cine, false);
    assert_true(add(cine, 11, 11, 15));
    check_image(cine, 0, 2);
    cine_free(cine);
}

static void memory_is_reported_and_bounded(void **state)
{
    (void)state;
    // 30 s at 30/s of a typical tool and tree
    const CineShape usual = {1, {301}, 1372};
    size_t bytes = cine_bytes(&usual, 900);
    assert_true(bytes > (size_t)900 * 300 * 200 && bytes < (size_t)900 * (300 * 210 + 1372 * 4 + 1200));
    const int bad[][3] = {{0, 0, 10}, {-1, 0, 10}, {100001, 0, 10}, {10, -1, 10}, {10, 10000001, 1}, {10, 0, 0}, {10, 0, 1000001}, {100000, 10000000, 1000000}};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        const CineShape shape = {1, {bad[i][0]}, bad[i][1]}, second = {2, {3, bad[i][0]}, bad[i][1]};
        assert_int_equal(cine_bytes(&shape, bad[i][2]), 0);
        assert_int_equal(cine_bytes(&second, bad[i][2]), 0);
        assert_null(create_cine(bad[i][0], bad[i][1], bad[i][2]));
    }
    cine_free(NULL);
}

static void adding_allocates_nothing(void **state)
{
    (void)state;
    need_counting();
    Cine *cine = loop_of(3, 4, 15);
    Pose *pose = pose_create(NODES, 1, &(int){NODES});
    fill_pose(pose, 1, 1, 15);
    cine_record(cine);
    long before = heap_calls();
    heap_watch(true);
    for (uint32_t i = 0; i < 20; i++)
        cine_add(cine, &(CineFrame){pose, NULL, i});
    heap_watch(false);
    assert_int_equal(heap_calls() - before, 0);
    assert_true(cine_frame(cine, 0).contrast[0] == 0);
    pose_free(pose);
    cine_free(cine);
}

static void other_tools_are_not_taken(void **state)
{
    (void)state;
    Cine *cine = create_cine(NODES + 1, 0, 3);
    assert_non_null(cine);
    cine_record(cine);
    assert_false(add(cine, 1, 1, 15));
    cine_free(cine);
}

// --- replay ---

static void replay_keeps_the_pulses_times(void **state)
{
    (void)state;
    Cine *cine = loop_of(30, 30, 15);
    assert_true(fabs(cine_duration_s(cine) - 2) < 1e-9);
    CinePlayer player = cine_player_start(cine);
    for (int i = 0; i < 500; i++) {   // 5 s in steps of 10 ms: two and a half rounds
        int image = cine_player_advance(&player, cine, 0.01), due = (int)floor(0.01 * (i + 1) * 15 + 1e-6) % 30;
        assert_true(image == due || image == (due + 29) % 30);   // rounding at a border
    }
    player = cine_player_start(cine);
    player.speed = 0.5;
    assert_int_equal(cine_player_advance(&player, cine, 1.01), 7);
    player.speed = 2;
    assert_int_equal(cine_player_advance(&player, cine, 0.5), 22);
    player.is_playing = false;
    assert_int_equal(cine_player_advance(&player, cine, 10), 22);
    player.loops = false;
    player.is_playing = true;
    player.speed = 1;
    assert_int_equal(cine_player_advance(&player, cine, 1e6), 29);
    assert_false(player.is_playing);
    // invalid values do no harm
    player = cine_player_start(cine);
    player.speed = NAN;
    player.frame = 1000;
    assert_true(cine_player_advance(&player, cine, 1e9) < 30);
    assert_true(cine_player_advance(&player, cine, NAN) < 30);
    cine_free(cine);
}

static void pauses_of_the_pedal_are_left_out(void **state)
{
    (void)state;
    Cine *cine = create_cine(NODES, TREE, 20);
    cine_record(cine);
    for (int i = 0; i < 5; i++)
        add(cine, 1 + i, 1 + 0.1 * i, 10);
    for (int i = 0; i < 5; i++)
        add(cine, 6 + i, 60 + 0.1 * i, 10);
    assert_true(fabs(cine_frame_s(cine, 4) - 0.1) < 1e-9);
    assert_true(fabs(cine_duration_s(cine) - 1) < 1e-9);
    cine_free(cine);
}

static void an_empty_loop_shows_nothing(void **state)
{
    (void)state;
    Cine *cine = create_cine(NODES, 0, 4);
    CinePlayer player = cine_player_start(cine);
    assert_int_equal(player.frame, -1);
    assert_int_equal(cine_player_advance(&player, cine, 1), -1);
    assert_true(cine_duration_s(cine) == 0);
    // an image that arrives while the loop is shown is shown too
    cine_record(cine);
    add(cine, 3, 1, 15);
    player.is_playing = true;
    assert_int_equal(cine_player_advance(&player, cine, 0.01), 0);
    cine_free(cine);
}

// --- files ---

static void a_file_comes_back_the_same(void **state)
{
    (void)state;
    Cine *cine = loop_of(25, 10, 15);   // a ring that begins in the middle
    size_t length, again;
    uint8_t *bytes = cine_pack(cine, &length);
    assert_non_null(bytes);
    faults_clear(&faults);
    Cine *read = cine_unpack(bytes, length, "a.cine", &faults);
    if (!read)
        fail_msg("%s", faults.text[0]);
    assert_true(cine_count(read) == 10 && cine_shape(read).tool_nodes[0] == NODES && cine_shape(read).contrast_count == TREE && cine_capacity(read) == 10);
    for (int i = 0; i < 10; i++)
        check_image(read, i, 16 + i);
    uint8_t *second = cine_pack(read, &again);
    assert_int_equal(again, length);
    assert_memory_equal(bytes, second, length);
    free(second);
    free(bytes);
    cine_free(read);
    cine_free(cine);
    cine = create_cine(NODES, 0, 3);   // no images, no tree
    bytes = cine_pack(cine, &length);
    read = cine_unpack(bytes, length, "empty.cine", &faults);
    assert_true(read && cine_count(read) == 0);
    free(bytes);
    cine_free(read);
    cine_free(cine);
}

// Two tools whose shared centreline has a different number of nodes in each image.
static Pose *coaxial_image(int image)
{
    const int nodes[2] = {4, 6};
    Pose *pose = pose_create(10, 2, nodes);
    assert_non_null(pose);
    pose->node_count = 6 + image % 3;
    pose->time_s = image;
    pose->xray = xray_default_control();
    pose->first_free_node = 2;
    for (int i = 0; i < pose->node_count; i++) {
        pose->position[i] = vec3(i, image, 0);
        pose->quaternion[i] = quat_from_rotation_vector(vec3(0.1 * i, 0, image));
        pose->node[i] = (NodeReport){.s = i, .radius = 0.2, .force = vec3(0, image, i), .vessel_node = -1};
    }
    for (int k = 0; k < 2; k++) {
        pose->tool[k].inserted_mm = 3 * k + image;
        pose->tool[k].push_n = 0.1 * k;
        // the inner one was exchanged for one with fewer nodes
        if (k == 1 && image % 2) {
            pose->tool[k].fitted = 2;
            pose->tool[k].node_count = 5;
        }
        for (int j = 0; j < pose->tool[k].node_count; j++)
            pose->tool[k].node[j] = (ToolNode){j, vec3(j, image, k), quat_from_rotation_vector(vec3(0, j, k)), 0.4 - 0.2 * k, k - 1};
    }
    return pose;
}

static Cine *coaxial_loop(void)
{
    Pose *pose = coaxial_image(0);
    CineShape shape = cine_shape_for(pose, 0);
    Cine *cine = cine_create(&shape, 4);
    assert_true(cine && cine_record(cine));
    for (int i = 1; i <= 6; i++) {
        pose_free(pose);
        pose = coaxial_image(i);
        assert_true(cine_add(cine, &(CineFrame){pose, NULL, (uint32_t)i}));
    }
    pose_free(pose);
    return cine;
}

static void several_tools_are_kept(void **state)
{
    (void)state;
    Cine *cine = coaxial_loop();
    size_t length, again;
    uint8_t *bytes = cine_pack(cine, &length);
    faults_clear(&faults);
    Cine *read = cine_unpack(bytes, length, "two.cine", &faults);
    assert_non_null(read);
    uint8_t *second = cine_pack(read, &again);
    assert_int_equal(again, length);
    assert_memory_equal(bytes, second, length);
    for (int i = 0; i < 4; i++) {
        Pose *expected = coaxial_image(3 + i);
        const Pose *pose = cine_frame(read, i).pose;
        assert_int_equal(pose->node_count, expected->node_count);
        assert_memory_equal(pose->position, expected->position, (size_t)pose->node_count * sizeof *pose->position);
        for (int k = 0; k < 2; k++) {
            assert_true(pose->tool[k].inserted_mm == expected->tool[k].inserted_mm && pose->tool[k].push_n == expected->tool[k].push_n);
            assert_true(pose->tool[k].fitted == expected->tool[k].fitted && pose->tool[k].node_count == expected->tool[k].node_count);
            for (int j = 0; j < pose->tool[k].node_count; j++) {
                const ToolNode *a = &pose->tool[k].node[j], *b = &expected->tool[k].node[j];
                assert_true(a->s == b->s && vec3_distance(a->position, b->position) == 0 && a->orientation.z == b->orientation.z && a->radius == b->radius &&
                            a->carrier == b->carrier);
            }
        }
        pose_free(expected);
    }
    // a pose of other tools is ignored
    Pose *other = pose_create(10, 1, &(int){10});
    assert_false(cine_add(read, &(CineFrame){other, NULL, 99}));
    pose_free(other);
    for (size_t n = 0; n < length; n++) {
        faults_clear(&faults);
        assert_null(cine_unpack(bytes, n, "cut.cine", &faults));
        assert_int_equal(faults.count, 1);
        bytes[n] ^= (uint8_t)(1u << n % 8);
        faults_clear(&faults);
        assert_null(cine_unpack(bytes, length, "flipped.cine", &faults));
        assert_int_equal(faults.count, 1);
        bytes[n] ^= (uint8_t)(1u << n % 8);
    }
    free(second);
    free(bytes);
    cine_free(read);
    cine_free(cine);
}

// Version 2 had no exchange: all nodes of each tool.
static void loops_of_before_exchanges_are_read(void **state)
{
    (void)state;
    Pose *pose = coaxial_image(0);
    CineShape shape = cine_shape_for(pose, 0);
    Cine *cine = cine_create(&shape, 4);
    assert_true(cine && cine_record(cine) && cine_add(cine, &(CineFrame){pose, NULL, 1}));
    size_t length;
    uint8_t *bytes = cine_pack(cine, &length);
    // the two counts of each tool follow its five figures, and its nodes follow the counts: 4 and 6 of 76 bytes, then the checksum
    size_t second = length - 8 - 6 * 76 - 8, first = second - 5 * 8 - 4 * 76 - 8;
    const int32_t counts[2][2] = {{0, 4}, {0, 6}};
    assert_memory_equal(bytes + first, counts[0], 8);
    assert_memory_equal(bytes + second, counts[1], 8);
    memmove(bytes + second, bytes + second + 8, length - second - 8);
    memmove(bytes + first, bytes + first + 8, length - first - 16);
    length -= 16;
    const uint32_t version = 2;
    memcpy(bytes + 8, &version, sizeof version);
    uint64_t hash = 0xcbf29ce484222325u;
    for (size_t i = 0; i < length - 8; i++)
        hash = (hash ^ bytes[i]) * 0x100000001b3u;
    memcpy(bytes + length - 8, &hash, sizeof hash);
    faults_clear(&faults);
    Cine *read = cine_unpack(bytes, length, "two.cine", &faults);
    if (!read)
        fail_msg("%s", faults.text[0]);
    const Pose *found = cine_frame(read, 0).pose;
    assert_true(found->tool[1].node_count == 6 && found->tool[1].fitted == 0 &&
                vec3_distance(found->tool[1].node[5].position, pose->tool[1].node[5].position) == 0);
    free(bytes);
    cine_free(read);
    cine_free(cine);
    pose_free(pose);
}

static void a_damaged_file_is_refused(void **state)
{
    (void)state;
    Cine *cine = loop_of(3, 3, 15);
    size_t length;
    uint8_t *bytes = cine_pack(cine, &length);
    for (size_t n = 0; n < length; n++) {
        faults_clear(&faults);
        assert_null(cine_unpack(bytes, n, "cut.cine", &faults));
        assert_int_equal(faults.count, 1);
    }
    for (size_t n = 0; n < length; n++) {
        bytes[n] ^= (uint8_t)(1u << n % 8);
        faults_clear(&faults);
        assert_null(cine_unpack(bytes, length, "flipped.cine", &faults));
        assert_true(faults.count == 1 && strncmp(faults.text[0], "flipped.cine:", 13) == 0);
        bytes[n] ^= (uint8_t)(1u << n % 8);
    }
    free(bytes);
    cine_free(cine);
}

// Values that cannot be drawn are refused even if the checksum is right.
static void what_cannot_be_drawn_is_refused(void **state)
{
    (void)state;
    for (int what = 0; what < 9; what++) {
        Cine *cine = create_cine(NODES, TREE, 3);
        cine_record(cine);
        Pose *pose = pose_create(NODES, 1, &(int){NODES});
        float contrast[TREE] = {0};
        fill_pose(pose, 1, 1, 15);
        if (what == 0)
            pose->position[2].y = NAN;
        else if (what == 1)
            pose->quaternion[3] = (Quat){2, 0, 0, 0};
        else if (what == 2)
            pose->node[1].radius = -1;
        else if (what == 3)
            pose->node[1].vessel_node = TREE;
        else if (what == 4)
            pose->first_free_node = NODES;
        else if (what == 5)
            pose->xray.lao_deg = HUGE_VALF;
        else if (what == 6)
            pose->xray.field_mm = 0;
        else if (what == 7)
            contrast[4] = 1.5f;
        else
            pose->time_s = HUGE_VAL;
        cine_add(cine, &(CineFrame){pose, contrast, 1});
        size_t length;
        uint8_t *bytes = cine_pack(cine, &length);
        faults_clear(&faults);
        assert_null(cine_unpack(bytes, length, "wild.cine", &faults));
        assert_non_null(strstr(faults.text[0], "is invalid"));
        free(bytes);
        pose_free(pose);
        cine_free(cine);
    }
}

// --- movies ---

static bool draw_grey(void *context, const CineFrame *frame, uint8_t *rgb, char *message, size_t capacity)
{
    int *images = context;
    if (++*images == 7 && frame->pose->xray.pulses_s == 10) {
        snprintf(message, capacity, "no picture of image 7");
        return false;
    }
    memset(rgb, 20 * (int)frame->pulse % 256, 32 * 24 * 3);
    return true;
}

static void a_movie_lasts_as_long_as_the_loop(void **state)
{
    (void)state;
    char path[] = "/tmp/seldinger-cine-XXXXXX", message[512] = "", command[200], line[100] = "";
    if (system("ffprobe -version >/dev/null 2>&1") != 0) {
        print_message("skipped: no ffmpeg\n");
        skip();
    }
    int file = mkstemp(path), images = 0;
    assert_true(file >= 0);
    close(file);
    Cine *cine = create_cine(NODES, TREE, 40);
    cine_record(cine);
    for (int i = 0; i < 10; i++)   // a second at 10/s …
        add(cine, 1 + i, 0.1 * i, 10);
    for (int i = 0; i < 30; i++)   // … and one at 30/s
        add(cine, 11 + i, 1 + i / 30.0, 30);
    images = 10;
    if (!cine_movie(cine, path, 32, 24, draw_grey, &images, message, sizeof message))
        fail_msg("%s", message);
    assert_int_equal(images, 50);
    snprintf(command, sizeof command, "ffprobe -v error -count_frames -show_entries stream=r_frame_rate,nb_read_frames -of csv=p=0 %s", path);
    FILE *probe = popen(command, "r");
    assert_non_null(fgets(line, sizeof line, probe));
    pclose(probe);
    assert_string_equal(line, "30/1,60\n");
    unlink(path);
    images = 0;
    assert_false(cine_movie(cine, path, 32, 24, draw_grey, &images, message, sizeof message));
    assert_string_equal(message, "no picture of image 7");
    assert_int_equal(access(path, F_OK), -1);
    cine_record(cine);
    assert_false(cine_movie(cine, path, 32, 24, draw_grey, &images, message, sizeof message));
    assert_non_null(strstr(message, "empty"));
    cine_free(cine);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_counter_counts),
        cmocka_unit_test(the_oldest_image_goes),
        cmocka_unit_test(a_locked_loop_keeps_what_it_has),
        cmocka_unit_test(memory_is_reported_and_bounded),
        cmocka_unit_test(adding_allocates_nothing),
        cmocka_unit_test(other_tools_are_not_taken),
        cmocka_unit_test(replay_keeps_the_pulses_times),
        cmocka_unit_test(pauses_of_the_pedal_are_left_out),
        cmocka_unit_test(an_empty_loop_shows_nothing),
        cmocka_unit_test(a_file_comes_back_the_same),
        cmocka_unit_test(several_tools_are_kept),
        cmocka_unit_test(loops_of_before_exchanges_are_read),
        cmocka_unit_test(a_damaged_file_is_refused),
        cmocka_unit_test(what_cannot_be_drawn_is_refused),
        cmocka_unit_test(a_movie_lasts_as_long_as_the_loop),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
