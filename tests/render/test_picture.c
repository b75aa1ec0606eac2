// Whole pictures: bytes, files, bad input, and objects at the positions that the numbers give. Skipped by name without EGL.
#include "geom/tube_mesh.h"
#include "render/color_map.h"
#include "render/picture.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>
#include <dirent.h>
#include <png.h>
#include <signal.h>
#include <sys/resource.h>
#include <unistd.h>

#include "view_stage.h"

static char folder[] = "/tmp/seldinger_picture_XXXXXX";
static bool is_available;

// Whether an EGL context can be created here.
static bool picture_available(char *message, size_t capacity)
{
    GlContext *context = gl_context_create(message, capacity);
    gl_context_destroy(context);
    return context != NULL;
}

static int make_folder(void **state)
{
    (void)state;
    char message[256] = "";
    is_available = picture_available(message, sizeof message);
    if (!is_available)
        print_message("no EGL: %s\n", message);
    return mkdtemp(folder) ? 0 : -1;
}

static int remove_folder(void **state)
{
    (void)state;
    return rmdir(folder);   // fails if a test left a file, including .part files
}

static const char *in_folder(const char *name)
{
    static char path[2][256];
    static int turn;
    turn = !turn;
    snprintf(path[turn], sizeof path[turn], "%s/%s", folder, name);
    return path[turn];
}

static int files_in_folder(void)
{
    int count = 0;
    DIR *d = opendir(folder);
    for (struct dirent *e = readdir(d); e; e = readdir(d))
        count += e->d_name[0] != '.';
    closedir(d);
    return count;
}

typedef struct Image {
    int width, height;
    uint8_t *rgb;
} Image;

static Image load(const char *path)
{
    png_image png = {.version = PNG_IMAGE_VERSION};
    assert_true(png_image_begin_read_from_file(&png, path));
    png.format = PNG_FORMAT_RGB;
    Image image = {(int)png.width, (int)png.height, malloc(PNG_IMAGE_SIZE(png))};
    assert_non_null(image.rgb);
    assert_true(png_image_finish_read(&png, NULL, image.rgb, 0, NULL));
    return image;
}

static const uint8_t *pixel(const Image *image, int x, int y) { return image->rgb + 3 * ((size_t)y * (size_t)image->width + (size_t)x); }

static bool is_close(const uint8_t *p, Color c, int by) { return abs(p[0] - c.r) <= by && abs(p[1] - c.g) <= by && abs(p[2] - c.b) <= by; }

static char *bytes_of(const char *path, size_t *size)
{
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    fseek(file, 0, SEEK_END);
    *size = (size_t)ftell(file);
    rewind(file);
    char *bytes = malloc(*size + 1);
    assert_non_null(bytes);
    assert_int_equal(fread(bytes, 1, *size, file), *size);
    fclose(file);
    return bytes;
}

static const TubePiece PIECES[3] = {{.length = 15}, {.arc_radius = 10, .angle = 1.6, .plane = 0.4}, {.length = 20}};
static TubeOptions tube_options(void)
{
    return (TubeOptions){.start = {1, 2, 3}, .direction = {0, 0, 1}, .normal = {1, 0, 0}, .radius = 1.5, .piece_count = 3, .piece = PIECES};
}

enum { NODES = 41 };
typedef struct Run {
    TriangleMesh *vessel;
    Vec3 position[NODES], force[NODES];
    double radius[NODES];
    SceneTarget target;
    PictureScene scene;
    PictureTool tool;
    PictureOptions options;
} Run;

static void run_open(Run *run)
{
    TubeOptions tube = tube_options();
    *run = (Run){.vessel = triangle_mesh_of_tube(&tube), .options = picture_default_options()};
    assert_non_null(run->vessel);
    for (int i = 0; i < NODES; i++) {
        run->position[i] = vec3(1, 2, 3 + 0.35 * i);
        run->radius[i] = 0.18;
        run->force[i] = i == 30 ? vec3(0.2, 0.1, 0) : vec3(0, 0, 0);
    }
    run->target = (SceneTarget){.name = "bend", .point = {1, 2, 18}, .radius = 1.2};
    run->scene = (PictureScene){.vessel = run->vessel, .target_count = 1, .target = &run->target, .has_entry = true, .entry = {1, 2, 3}};
    run->tool = (PictureTool){.node_count = NODES,
                              .position = run->position,
                              .radius = run->radius,
                              .force = run->force,
                              .time_s = 1.5,
                              .inserted_mm = 14,
                              .push_force_n = 0.3,
                              .torque_n_mm = 0.1,
                              .label = "a moment"};
    run->options.width = 640;
    run->options.height = 400;
    run->options.title = "test";
}

static void run_close(Run *run) { triangle_mesh_free(run->vessel); }

static void the_same_run_gives_the_same_bytes(void **state)
{
    (void)state;
    if (!is_available)
        skip();
    Run run;
    run_open(&run);
    char message[256] = "";
    assert_true(picture_of_run(in_folder("a.png"), &run.options, &run.scene, &run.tool, message, sizeof message));
    assert_true(picture_of_run(in_folder("b.png"), &run.options, &run.scene, &run.tool, message, sizeof message));
    size_t a_size, b_size;
    char *a = bytes_of(in_folder("a.png"), &a_size), *b = bytes_of(in_folder("b.png"), &b_size);
    assert_int_equal(a_size, b_size);
    assert_memory_equal(a, b, a_size);
    free(b);
    // and another run gives other bytes
    run.position[NODES - 1].x += 0.7;
    assert_true(picture_of_run(in_folder("b.png"), &run.options, &run.scene, &run.tool, message, sizeof message));
    b = bytes_of(in_folder("b.png"), &b_size);
    assert_true(a_size != b_size || memcmp(a, b, a_size) != 0);
    Image image = load(in_folder("a.png"));
    assert_int_equal(image.width, 640);
    assert_int_equal(image.height, 400);
    free(image.rgb);
    free(a), free(b);
    remove(in_folder("a.png"));
    remove(in_folder("b.png"));
    run_close(&run);
}

static void moments_share_one_picture(void **state)
{
    (void)state;
    if (!is_available)
        skip();
    Run run;
    run_open(&run);
    char message[256] = "";
    PictureTool tool[3] = {run.tool, run.tool, run.tool};
    tool[0].node_count = 12;
    tool[1].force = NULL;
    tool[2].first_free_node = 5;
    if (!picture_of_moments(in_folder("m.png"), &run.options, &run.scene, 3, tool, message, sizeof message))
        fail_msg("%s", message);
    Image image = load(in_folder("m.png"));
    assert_int_equal(image.width, 640);
    assert_true(image.height <= 400);
    free(image.rgb);
    assert_false(picture_of_moments(in_folder("n.png"), &run.options, &run.scene, 0, tool, message, sizeof message));
    assert_false(picture_of_moments(in_folder("n.png"), &run.options, &run.scene, 7, tool, message, sizeof message));
    // no vessel, as on a test rig
    run.scene = (PictureScene){0};
    assert_true(picture_of_run(in_folder("m.png"), &run.options, &run.scene, &run.tool, message, sizeof message));
    assert_int_equal(files_in_folder(), 1);
    remove(in_folder("m.png"));
    run_close(&run);
}

static bool is_blue(const uint8_t *p) { return p[2] > p[0] + 60; }
static bool is_dark(const uint8_t *p) { return p[0] < 90 && p[1] < 90 && p[2] < 90; }

// A catheter of 10 mm, cut open, with a wire of 16 mm in it: dark between two blue lines, then only dark.
static void tools_are_cut_open_where_another_lies_in_them(void **state)
{
    (void)state;
    if (!is_available)
        skip();
    Run run;
    run_open(&run);
    char message[256] = "";
    CoaxialLooks two;
    coaxial_looks(&two, 0.6, 0.45, 0.2);
    Pose *pose = coaxial_pose(10, 16, 0.5, 0.6, 0.2);
    double radius[100];
    for (int i = 0; i < pose->node_count; i++)
        radius[i] = pose->node[i].radius;
    run.scene = (PictureScene){0};
    run.options.inset = false;
    PictureTool tool = {.node_count = pose->node_count, .position = pose->position, .radius = radius, .pose = pose, .looks = &two.looks};
    if (!picture_of_run(in_folder("two.png"), &run.options, &run.scene, &tool, message, sizeof message))
        fail_msg("%s", message);
    Image image = load(in_folder("two.png"));
    int nested = 0, alone = 0, whole = 0;
    for (int x = 0; x < image.width * 3 / 5; x++) {
        int first = -1, last = -1, dark = 0, before = 0;
        for (int y = 50; y < image.height - 60; y++) {   // between the title and the scale bar
            const uint8_t *p = image.rgb + 3 * ((size_t)y * (size_t)image.width + (size_t)x);
            first = first < 0 && is_blue(p) ? y : first;
            last = is_blue(p) ? y : last;
            before = dark > 0 && is_blue(p) ? dark : before;
            dark += is_dark(p);
        }
        nested += first >= 0 && before >= 3 && last > first + 8;
        whole += first >= 0 && dark == 0;
        alone += first < 0 && dark >= 3;
    }
    assert_true(nested > 100 && alone > 50 && whole < 8);
    free(image.rgb);
    remove(in_folder("two.png"));
    pose_free(pose);
    run_close(&run);
}

static void files_that_cannot_be_written_leave_nothing_behind(void **state)
{
    (void)state;
    if (!is_available)
        skip();
    Run run;
    run_open(&run);
    char message[256] = "";
    assert_false(picture_of_run("/nonexistent/folder/a.png", &run.options, &run.scene, &run.tool, message, sizeof message));
    assert_non_null(strstr(message, "/nonexistent/folder/a.png"));
    // a folder at the file's path: a temporary file is written, but not renamed
    assert_false(picture_of_run(folder, &run.options, &run.scene, &run.tool, message, sizeof message));
    char beside[300];
    snprintf(beside, sizeof beside, "%s.part%ld", folder, (long)getpid());
    assert_int_equal(access(beside, F_OK), -1);

    // a disk that becomes full while writing: the older picture stays
    assert_true(picture_of_run(in_folder("old.png"), &run.options, &run.scene, &run.tool, message, sizeof message));
    size_t size, size_after;
    char *before = bytes_of(in_folder("old.png"), &size);
    struct rlimit limit, small;
    getrlimit(RLIMIT_FSIZE, &limit);
    small = limit;
    small.rlim_cur = 4000;
    signal(SIGXFSZ, SIG_IGN);
    setrlimit(RLIMIT_FSIZE, &small);
    run.position[5].x += 0.5;
    message[0] = 0;
    bool written = picture_of_run(in_folder("old.png"), &run.options, &run.scene, &run.tool, message, sizeof message);
    setrlimit(RLIMIT_FSIZE, &limit);
    signal(SIGXFSZ, SIG_DFL);
    assert_false(written);
    assert_true(strlen(message) > 0);
    char *after = bytes_of(in_folder("old.png"), &size_after);
    assert_int_equal(size, size_after);
    assert_memory_equal(before, after, size);
    assert_int_equal(files_in_folder(), 1);
    free(before), free(after);
    remove(in_folder("old.png"));
    run_close(&run);
}

static void input_that_cannot_be_drawn_is_refused(void **state)
{
    (void)state;
    if (!is_available)
        skip();
    Run run;
    char message[256] = "";
    const char *path = in_folder("bad.png");
    for (int kind = 0; kind < 9; kind++) {
        run_open(&run);
        if (kind == 0)
            run.position[3].y = NAN;
        else if (kind == 1)
            run.force[3].y = HUGE_VAL;
        else if (kind == 2)
            run.tool.node_count = 1;
        else if (kind == 3)
            run.vessel->vertex[7].z = NAN;
        else if (kind == 4)
            run.target.radius = NAN;
        else if (kind == 5)
            run.options.width = 0;
        else if (kind == 6)
            run.options.height = 100000;
        else if (kind == 7)
            run.tool.position = NULL;
        else
            run.vessel->triangle[0][0] = -1;
        message[0] = 0;
        assert_false(picture_of_run(path, &run.options, &run.scene, &run.tool, message, sizeof message));
        assert_true(strlen(message) > 10);
        assert_false(picture_of_run(path, &run.options, &run.scene, &run.tool, NULL, 0));
        run_close(&run);
    }
    const double time[3] = {0, 1, 0.5}, value[3] = {1, 2, 3};
    PictureLine line = {"a", value};
    PicturePanel panel = {.title = "a", .line_count = 1, .line = &line};
    PictureOptions options = picture_default_options();
    assert_false(picture_of_series(path, &options, 3, time, 1, &panel, 0, NULL, message, sizeof message));
    assert_false(picture_of_series(path, &options, 1, time, 1, &panel, 0, NULL, message, sizeof message));
    assert_false(picture_of_fit(path, &options, &(ModelField){0}, NULL, NULL, message, sizeof message));
    const int size[3] = {0, 2, 2};
    const Vec3 axis[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    assert_false(picture_of_tree(path, &options, size, vec3(0, 0, 0), axis, NULL, 0, 0, NULL, 0, NULL, message, sizeof message));
    assert_int_equal(files_in_folder(), 0);
}

static void the_tube_drawn_is_the_tube_touched(void **state)
{
    (void)state;
    TubeOptions tube = tube_options();
    Faults faults;
    faults_clear(&faults);
    Vessel *vessel = tube_vessel_create(&tube, "test", &faults);
    TriangleMesh *mesh = triangle_mesh_of_tube(&tube);
    assert_non_null(vessel);
    assert_non_null(mesh);
    for (int i = 0; i < mesh->vertex_count; i++) {
        // slightly inside: on the wall itself a gap of rounding size has either sign
        Vec3 inside = vec3_add_scaled(mesh->vertex[i], -0.5, mesh->normal[i]);
        VesselMemory memory = {.node = vessel->locate(vessel, inside, -1)};
        VesselHit hit;
        vessel_query(vessel, 1, &inside, 10, &memory, &hit);
        assert_true(fabs(hit.gap - 0.5) < 1e-9);
        assert_true(vec3_norm(vec3_add(hit.normal, mesh->normal[i])) < 1e-9);
    }
    for (int t = 0; t < mesh->triangle_count; t++) {
        const int *c = mesh->triangle[t];
        Vec3 area = vec3_cross(vec3_sub(mesh->vertex[c[1]], mesh->vertex[c[0]]), vec3_sub(mesh->vertex[c[2]], mesh->vertex[c[0]]));
        if (vec3_norm(area) > 1e-9)   // two parts meet in two rings at one place
            assert_true(vec3_dot(area, mesh->normal[c[0]]) > 0);
    }
    triangle_mesh_free(mesh);
    vessel->destroy(vessel);
    tube.radius = 0;
    assert_null(triangle_mesh_of_tube(&tube));
    assert_null(triangle_mesh_of_plane(vec3(0, 0, 0), vec3(0, 0, 0), 1));
    mesh = triangle_mesh_of_plane(vec3(1, 2, 3), vec3(0, 0, 2), 5);
    assert_non_null(mesh);
    for (int i = 0; i < mesh->vertex_count; i++)
        assert_true(fabs(mesh->vertex[i].z - 3) < 1e-12 && mesh->normal[i].z < -0.99);
    triangle_mesh_free(mesh);
}

// Mean column of the pixels from column `first` to `last` that `wanted` selects; their number in *count.
static void centroid(const Image *image, bool (*wanted)(const Image *, int, int), int first, int last, double *x, double *y, int *count)
{
    double sx = 0, sy = 0;
    *count = 0;
    for (int j = 0; j < image->height; j++)
        for (int i = first; i < last; i++)
            if (wanted(image, i, j)) {
                sx += i + 0.5, sy += j + 0.5;
                (*count)++;
            }
    *x = sx / *count;
    *y = sy / *count;
}

static bool is_on_black(const Image *image, int x, int y)
{
    for (int k = -14; k <= 14; k += 28) {
        int i = x + k, j = y + k;
        if (i < 0 || i >= image->width || j < 0 || j >= image->height || pixel(image, i, y)[0] > 12 || pixel(image, x, j)[0] > 12)
            return false;
    }
    return true;
}
static bool is_voxel(const Image *image, int x, int y) { return pixel(image, x, y)[0] > 90 && is_on_black(image, x, y); }
static bool is_mark(const Image *image, int x, int y) { return pixel(image, x, y)[0] > 250 && is_on_black(image, x, y); }

// One bright voxel in an anisotropic, partly mirrored, oblique grid: the mark at its position must cover it in all three projections.
static void marks_lie_on_the_voxels_that_they_name(void **state)
{
    (void)state;
    if (!is_available)
        skip();
    const int size[3] = {40, 32, 24}, bright[3] = {29, 11, 17};
    const Quat turn[2] = {quat_identity(), quat_from_rotation_vector((Vec3){0.3, -0.2, 0.5})};
    float *value = calloc(40 * 32 * 24, sizeof *value);
    assert_non_null(value);
    value[(bright[2] * size[1] + bright[1]) * size[0] + bright[0]] = 100;
    for (int k = 0; k < 2; k++) {
        const Vec3 axis[3] = {quat_rotate(turn[k], vec3(-0.6, 0, 0)), quat_rotate(turn[k], vec3(0, 0.5, 0)), quat_rotate(turn[k], vec3(0, 0, 0.9))};
        const Vec3 origin = {40, -25, 7};
        Vec3 place = origin;
        for (int d = 0; d < 3; d++)
            place = vec3_add_scaled(place, bright[d], axis[d]);
        PictureMark mark = {place, NULL};
        PictureOptions options = picture_default_options();
        options.width = 960;
        options.height = 600;
        char message[256] = "";
        if (!picture_of_tree(in_folder("plain.png"), &options, size, origin, axis, value, 0, 100, NULL, 0, NULL, message, sizeof message) ||
            !picture_of_tree(in_folder("marked.png"), &options, size, origin, axis, value, 0, 100, NULL, 1, &mark, message, sizeof message))
            fail_msg("%s", message);
        Image plain = load(in_folder("plain.png")), marked = load(in_folder("marked.png"));
        for (int panel = 0; panel < 3; panel++) {
            double x[2], y[2];
            int count[2], first = panel * 960 / 3, last = (panel + 1) * 960 / 3;
            centroid(&plain, is_voxel, first, last, &x[0], &y[0], &count[0]);
            centroid(&marked, is_mark, first, last, &x[1], &y[1], &count[1]);
            assert_true(count[0] > 4 && count[1] > 4);
            assert_true(fabs(x[0] - x[1]) < 1 && fabs(y[0] - y[1]) < 1);
        }
        free(plain.rgb), free(marked.rgb);
        remove(in_folder("plain.png"));
        remove(in_folder("marked.png"));
    }
    free(value);
}

static void one_spike_among_many_samples_is_seen(void **state)
{
    (void)state;
    if (!is_available)
        skip();
    enum { SAMPLES = 100000 };
    double *time = malloc(SAMPLES * sizeof *time), *value = calloc(SAMPLES, sizeof *value);
    assert_non_null(time);
    assert_non_null(value);
    for (int i = 0; i < SAMPLES; i++)
        time[i] = 1e-3 * i;
    value[61803] = 5;
    value[10] = NAN;
    PictureLine line = {NULL, value};
    PicturePanel panel = {.title = "force [N]", .line_count = 1, .line = &line};
    PictureOptions options = picture_default_options();
    options.width = 800;
    options.height = 300;
    char message[256] = "";
    if (!picture_of_series(in_folder("s.png"), &options, SAMPLES, time, 1, &panel, 0, NULL, message, sizeof message))
        fail_msg("%s", message);
    Image image = load(in_folder("s.png"));
    // the columns with the line's colour in the upper half of the picture: only the peak, at 61.8 % of the axis
    int found = 0, x_low = 800, x_high = 0, axis_low = 800, axis_high = 0;
    for (int y = 0; y < image.height; y++)
        for (int x = 0; x < image.width; x++)
            if (is_close(pixel(&image, x, y), color_qualitative(6), 40)) {
                axis_low = x < axis_low ? x : axis_low, axis_high = x > axis_high ? x : axis_high;
                if (y < image.height / 2) {
                    found++;
                    x_low = x < x_low ? x : x_low, x_high = x > x_high ? x : x_high;
                }
            }
    assert_true(found > 20);
    assert_true(x_high - x_low <= 3);
    assert_true(fabs((x_low + x_high) / 2.0 - (axis_low + 0.618 * (axis_high - axis_low))) < 3);
    free(image.rgb);
    remove(in_folder("s.png"));
    free(time), free(value);
}

static VesselTree *made_up_model(void)
{
    enum { N = 12, PER = 40 };
    VesselTree *tree = vessel_tree_create(N, N * PER, 2 * N);
    assert_non_null(tree);
    for (int i = 0; i < N; i++) {
        tree->center[i] = vec3(1.5 * i, 0, 0);
        tree->radius[i] = 1;
        tree->direction[i] = vec3(1, 0, 0);
        tree->height[i] = 1.5;
        tree->parent[i] = i - 1;
        tree->error[i] = 0.01 * (i + 1);
        tree->point_offset[i + 1] = (i + 1) * PER;
        tree->blob_offset[i + 1] = 2 * (i + 1);
        for (int b = 0; b < 2; b++) {
            tree->blob_center[2 * i + b] = vec3(1.5 * i + b - 0.5, 0, 0);
            tree->blob_width[2 * i + b] = blob_width_for_radius(0.8, tree->iso_level);
        }
        for (int k = 0; k < PER; k++) {
            double angle = 2.4 * k, r = 1 + 0.05 * (k % 3);
            tree->point[i * PER + k] = vec3(1.5 * (i + (double)k / PER - 0.5), r * cos(angle), r * sin(angle));
        }
    }
    vessel_tree_link(tree);
    return tree;
}

// Points that are all outside are blue, all inside red, in the large view and in the histogram.
static void distances_choose_the_colour(void **state)
{
    (void)state;
    if (!is_available)
        skip();
    VesselTree *tree = made_up_model();
    double *distance = malloc((size_t)tree->point_count * sizeof *distance);
    assert_non_null(distance);
    PictureOptions options = picture_default_options();
    options.width = 640;
    options.height = 400;
    char message[256] = "";
    if (!picture_of_fit(in_folder("f.png"), &options, &(ModelField){.tree = tree}, NULL, NULL, message, sizeof message))
        fail_msg("%s", message);
    for (int sign = -1; sign <= 1; sign += 2) {
        for (int64_t k = 0; k < tree->point_count; k++)
            distance[k] = 0.1 * sign;
        options.distance_full_scale = 0.12;
        if (!picture_of_fit(in_folder("f.png"), &options, &(ModelField){.tree = tree}, NULL, distance, message, sizeof message))
            fail_msg("%s", message);
        Image image = load(in_folder("f.png"));
        int red = 0, blue = 0;
        for (int y = 40; y < 380; y++)
            for (int x = 8; x < 350; x++) {
                const uint8_t *p = pixel(&image, x, y);
                red += p[0] > p[2] + 60;
                blue += p[2] > p[0] + 60;
            }
        assert_true(sign > 0 ? red > 200 && blue == 0 : blue > 200 && red == 0);
        free(image.rgb);
    }
    remove(in_folder("f.png"));
    // a tree without a model is refused
    free(distance);
    vessel_tree_free(tree);
    tree = vessel_tree_create(2, 0, 0);
    assert_false(picture_of_fit(in_folder("f.png"), &options, &(ModelField){.tree = tree}, NULL, NULL, message, sizeof message));
    assert_non_null(strstr(message, "model"));
    vessel_tree_free(tree);
}

// Errors colour the surface at their places, and the bars of the classes are left of their borders.
static void errors_colour_the_surface(void **state)
{
    (void)state;
    if (!is_available)
        skip();
    VesselTree *tree = made_up_model();
    TriangleMesh *mesh = isosurface_of_tree(tree, isosurface_cell_for(tree));
    assert_non_null(mesh);
    double *error = malloc((size_t)mesh->vertex_count * sizeof *error);
    PictureOptions options = picture_default_options();
    options.width = 640;
    options.height = 400;
    options.distance_full_scale = 0.12;
    char message[256] = "";
    int bars[2][2];
    for (int k = 0; k < 2; k++) {
        for (int v = 0; v < mesh->vertex_count; v++)
            error[v] = k ? 0.1 : -0.1;
        for (int i = 0; i < tree->node_count; i++)
            tree->error[i] = k ? 0.3 : 0.1;   // C3 or C1 of voxels of 0.25 mm
        if (!picture_of_error(in_folder("e.png"), &options, &(ModelField){.tree = tree}, mesh, error, 0.25, message, sizeof message))
            fail_msg("%s", message);
        Image image = load(in_folder("e.png"));
        int red = 0, blue = 0;
        bars[k][0] = bars[k][1] = 0;
        for (int y = 40; y < 380; y++)
            for (int x = 8; x < 632; x++) {
                const uint8_t *p = pixel(&image, x, y);
                red += x < 400 && p[0] > p[2] + 60;
                blue += x < 400 && p[2] > p[0] + 60;
                bars[k][0] += x > 430 && is_close(p, color_rgb(0, 114, 90), 8);
                bars[k][1] += x > 430 && is_close(p, color_rgb(213, 94, 0), 8);
            }
        assert_true(k ? red > 500 && blue == 0 : blue > 500 && red == 0);
        free(image.rgb);
    }
    assert_true(bars[0][0] > 100 && bars[0][0] > 2 * bars[1][0]);   // the name of the class in its colour is always there
    assert_true(bars[1][1] > 100 && bars[1][1] > 2 * bars[0][1]);
    remove(in_folder("e.png"));
    assert_false(picture_of_error(in_folder("e.png"), &options, &(ModelField){.tree = tree}, mesh, error, 0, message, sizeof message));
    assert_false(picture_of_error(in_folder("e.png"), &options, &(ModelField){.tree = tree}, NULL, error, 1, message, sizeof message));
    free(error);
    triangle_mesh_free(mesh);
    vessel_tree_free(tree);
}

static int open_descriptors(void)
{
    int count = 0;
    DIR *d = opendir("/proc/self/fd");
    if (!d)
        return 0;
    while (readdir(d))
        count++;
    closedir(d);
    return count;
}

static void contexts_come_and_go(void **state)
{
    (void)state;
    if (!is_available)
        skip();
    assert_true(picture_available(NULL, 0));
    int before = open_descriptors();
    for (int i = 0; i < 20; i++)
        assert_true(picture_available(NULL, 0));
    assert_int_equal(open_descriptors(), before);
}

static void colours_tell_order(void **state)
{
    (void)state;
    // the brightness of the sequential map increases everywhere, so that it is readable in grey and for the colour-blind
    double last = -1;
    for (int i = 0; i <= 100; i++) {
        Color c = color_sequential(i / 100.0);
        double brightness = 0.2126 * c.r + 0.7152 * c.g + 0.0722 * c.b;
        assert_true(brightness > last);
        last = brightness;
    }
    assert_true(color_diverging(-1).b > color_diverging(-1).r && color_diverging(1).r > color_diverging(1).b);
    Color beyond = color_sequential(7), top = color_sequential(1), none = color_sequential(NAN), bottom = color_sequential(0);
    assert_memory_equal(&beyond, &top, sizeof top);
    assert_memory_equal(&none, &bottom, sizeof none);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_same_run_gives_the_same_bytes),
        cmocka_unit_test(moments_share_one_picture),
        cmocka_unit_test(tools_are_cut_open_where_another_lies_in_them),
        cmocka_unit_test(files_that_cannot_be_written_leave_nothing_behind),
        cmocka_unit_test(input_that_cannot_be_drawn_is_refused),
        cmocka_unit_test(the_tube_drawn_is_the_tube_touched),
        cmocka_unit_test(marks_lie_on_the_voxels_that_they_name),
        cmocka_unit_test(one_spike_among_many_samples_is_seen),
        cmocka_unit_test(distances_choose_the_colour),
        cmocka_unit_test(errors_colour_the_surface),
        cmocka_unit_test(contexts_come_and_go),
        cmocka_unit_test(colours_tell_order),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
