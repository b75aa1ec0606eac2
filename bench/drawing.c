// seldinger bench drawing: CPU time of an image of the trainer, and the effect of rendering on the 1 kHz thread.
#include "bench/bench.h"

#include "render/gl_canvas.h"
#include "render/gl_context.h"
#include "render/scene_views.h"
#include "render/trainer_panel.h"
#include "sim/clock.h"
#include "sim/live_session.h"

#include <stdlib.h>
#include <string.h>

enum { MOMENTS = 60, PICTURES = 90, WARM_UP = 10, SETTLING = 60, TURNS = 4 };   // SETTLING: until the resolution follows the budget

typedef struct Studio {
    const BenchOptions *options;
    const char *size;                // of the pictures measured; NULL: all
    BenchScene scene;
    GlContext *context;
    GlCanvas canvas;
    Views *views;
    Panel *panel;
    OperatorControls controls;
    TrainerPanel shown;
    TrackerView *tracked;            // (MOMENTS, stride)
    size_t stride;
    Pose *pose[MOMENTS];
    uint32_t pulse;
} Studio;

static TrackerView *tracked_at(const Studio *studio, int moment) { return (TrackerView *)(void *)((char *)studio->tracked + (size_t)moment * studio->stride); }

// Moments 33 ms apart at the end of the script, or from its start if it is shorter; contrast agent flows all the time.
static bool take_moments(Studio *studio, Faults *faults)
{
    const Scene *scene = studio->scene.scene;
    Simulator *simulator = simulator_create(scene, studio->scene.open.vessel, faults);
    SessionTracker *tracker = simulator ? session_tracker_create(simulator, studio->scene.open.tree) : NULL;
    XrayControl xray = studio->controls.xray;
    int cursor = 0;
    xray.pedal = 1;
    xray.contrast_ml_s = 3;
    studio->stride = tracker ? (session_tracker_view_bytes(tracker) + 63) / 64 * 64 : 0;
    studio->tracked = tracker ? calloc(MOMENTS, studio->stride) : NULL;
    bool good = studio->tracked != NULL;
    int64_t steps = bench_steps(scene, 6000), first = steps > MOMENTS * 33 ? steps - MOMENTS * 33 : 0;
    for (int64_t i = 0, taken = 0; good && taken < MOMENTS; i++) {
        ToolCommands commands = scene->script ? script_tools_at(scene->script, (double)i * scene->dt / 1000, &cursor) : (ToolCommands){0};
        simulator_step(simulator, &commands);
        session_tracker_step(tracker, simulator, &commands, &xray);
        if (i < first || (i - first) % 33 != 0)
            continue;
        good = (studio->pose[taken] = pose_create_for(simulator)) != NULL;
        if (good) {
            pose_take(studio->pose[taken], simulator, &commands, &xray);
            session_tracker_publish(tracker, tracked_at(studio, (int)taken));
        }
        taken++;
    }
    session_tracker_free(tracker);
    simulator_destroy(simulator);
    return good;
}

typedef struct Case {
    const char *name;
    PanelView view;
    int width, height;
    bool flows, arm_turns, camera_turns;
    double must_ms;                  // limit [ms]; 0: none
    int only;                        // 0: everything; else 1 + the one view that is drawn, or ONLY_PANELS
    double budget_ms;                // of the resolution; 0: that of the screen
} Case;

enum { ONLY_PANELS = 1 + VIEW_COUNT };

static const Case cases[] = {
    {"fluoroscopy", VIEW_FLUOROSCOPY, 1280, 720, false, false, false, 12, 0, 0},
    {"fluoroscopy", VIEW_FLUOROSCOPY, 1920, 1080, false, false, false, 20, 0, 0},
    {"fluoroscopy, contrast flows", VIEW_FLUOROSCOPY, 1280, 720, true, false, false, 12, 0, 0},
    {"fluoroscopy, contrast flows", VIEW_FLUOROSCOPY, 1920, 1080, true, false, false, 20, 0, 0},
    {"fluoroscopy, C-arm turns", VIEW_FLUOROSCOPY, 1280, 720, true, true, false, 40, 0, 0},
    {"fluoroscopy, C-arm turns", VIEW_FLUOROSCOPY, 1920, 1080, true, true, false, 40, 0, 0},
    {"fluoroscopy, unlimited", VIEW_FLUOROSCOPY, 3840, 2160, false, false, false, 0, 0, 0},
    {"fluoroscopy", VIEW_FLUOROSCOPY, 3840, 2160, false, false, false, 33, 0, DRAWING_BUDGET_MS},
    {"fluoroscopy, contrast flows", VIEW_FLUOROSCOPY, 3840, 2160, true, false, false, 33, 0, DRAWING_BUDGET_MS},
    {"fluoroscopy, C-arm turns", VIEW_FLUOROSCOPY, 3840, 2160, true, true, false, 33, 0, DRAWING_BUDGET_MS},
    {"- of 4K: panels", VIEW_FLUOROSCOPY, 3840, 2160, false, false, false, 0, ONLY_PANELS, 0},
    {"- fluoroscopy", VIEW_FLUOROSCOPY, 3840, 2160, false, false, false, 0, 1 + VIEW_FLUOROSCOPY, 0},
    {"- 3D, inset", VIEW_FLUOROSCOPY, 3840, 2160, false, false, false, 0, 1 + VIEW_3D, 0},
    {"- angioscopy, inset", VIEW_FLUOROSCOPY, 3840, 2160, false, false, false, 0, 1 + VIEW_ANGIOSCOPY, 0},
    {"3D", VIEW_3D, 1280, 720, true, false, false, 0, 0, 0},
    {"3D, camera turns", VIEW_3D, 1280, 720, true, false, true, 0, 0, 0},
    {"angioscopy", VIEW_ANGIOSCOPY, 1280, 720, true, false, false, 33, 0, 0},
    {"all three", VIEW_ALL, 1280, 720, true, false, false, 33, 0, 0},
    {"- of the first: panels", VIEW_FLUOROSCOPY, 1280, 720, false, false, false, 0, ONLY_PANELS, 0},
    {"- fluoroscopy", VIEW_FLUOROSCOPY, 1280, 720, false, false, false, 0, 1 + VIEW_FLUOROSCOPY, 0},
    {"- 3D, inset", VIEW_FLUOROSCOPY, 1280, 720, false, false, false, 0, 1 + VIEW_3D, 0},
    {"- angioscopy, inset", VIEW_FLUOROSCOPY, 1280, 720, false, false, false, 0, 1 + VIEW_ANGIOSCOPY, 0},
};
enum { CASES = sizeof cases / sizeof cases[0] };

static void draw(Studio *studio, const Case *what, int frame)
{
    int at = frame % (2 * MOMENTS - 2), moment = at < MOMENTS ? at : 2 * MOMENTS - 2 - at;   // back and forth
    const Pose *pose = studio->pose[moment];
    TrackerView *tracked = tracked_at(studio, moment);
    XrayControl xray = pose->xray;
    xray.lao_deg = what->arm_turns ? (float)(frame % 60) : 0;
    if (what->camera_turns)
        free_camera_orbit(&studio->controls.look.camera, 3, 0);
    PanelLayout layout = panel_layout(what->width, what->height, 1, what->view, true);
    ViewsFrame views = {.pose = pose,
                        .xray = &xray,
                        .contrast = what->flows && tracked->node_count ? tracked->concentration : NULL,
                        .filling = what->flows ? tracked->concentration + tracked->node_count : NULL,
                        .pulse = ++studio->pulse,
                        .look = &studio->controls.look};
    WindowInput input = {.width = what->width, .height = what->height, .scale = 1, .mouse_x = -1, .mouse_y = -1, .has_focus = true};
    for (int i = 0; what->only && i < VIEW_COUNT; i++)
        if (what->only != 1 + i)
            layout.view[i].width = 0;
    views_draw(studio->views, &views, &layout, what->width, what->height, studio->canvas.framebuffer);
    trainer_panel_show(&studio->shown, studio->scene.scene, pose, &tracked->score, NULL, &xray);
    studio->shown.state.now_s = studio->shown.state.time_s = frame / 30.0;
    studio->controls.view = what->view;
    trainer_panel_views(&studio->shown, &studio->controls, studio->views, &xray);
    if (what->only == 0 || what->only == ONLY_PANELS)
        panel_draw(studio->panel, &input, &studio->shown.state, studio->canvas.framebuffer);
    gl_canvas_finish();
}

static bool make_canvas(Studio *studio, int width, int height, Faults *faults)
{
    char message[256];
    gl_canvas_destroy(&studio->canvas);
    if (gl_canvas_create(&studio->canvas, width, height, 1, message, sizeof message))
        return true;
    faults_add(faults, "EGL", 0, 0, "%s", message);
    return false;
}

static bool measure_pictures(Studio *studio, FILE *text, cJSON *root, Faults *faults)
{
    cJSON *rows = cJSON_AddArrayToObject(root, "pictures");
    int pictures = studio->options->quick ? PICTURES / 3 : PICTURES;
    fprintf(text, "\nCPU time of a picture, all drawing threads [ms]; at 30 pictures a second there are 33.3\n");
    fprintf(text, "%-28s %-11s %8s %8s %8s %8s %11s\n", "view with panels", "size", "median", "p99", "max", "must", "X-ray side");
    for (int i = 0; i < CASES; i++) {
        const Case *what = &cases[i];
        static TimeHistogram cpu;
        char size[32], must[16] = "";
        snprintf(size, sizeof size, "%dx%d", what->width, what->height);
        if (studio->size && strcmp(size, studio->size) != 0)
            continue;
        memset(&cpu, 0, sizeof cpu);
        if (!make_canvas(studio, what->width, what->height, faults))
            return false;
        views_set_budget(studio->views, what->budget_ms);
        const int before = what->budget_ms > 0 ? SETTLING : WARM_UP;
        for (int k = 0; k < pictures + before; k++) {
            double begin = clock_s(CLOCK_PROCESS_CPUTIME_ID);
            draw(studio, what, k);
            double spent = clock_s(CLOCK_PROCESS_CPUTIME_ID) - begin;
            views_spend(studio->views, 1000 * spent);
            if (k >= before)
                histogram_add(&cpu, (int64_t)(spent * 1e9));
        }
        int drawn, shown;
        views_xray_sides(studio->views, &drawn, &shown);
        Spread ms = bench_spread(&cpu, 1e6);
        if (what->must_ms > 0)
            snprintf(must, sizeof must, "%.0f", what->must_ms);
        fprintf(text, "%-28s %-11s %8.1f %8.1f %8.1f %8s %5d/%-5d%s\n", what->name, size, ms.median, ms.p99, ms.max, must, drawn, shown,
                what->must_ms > 0 && ms.median > what->must_ms ? "  MISSED" : "");
        cJSON *row = cJSON_CreateObject();
        cJSON_AddStringToObject(row, "view", what->name);
        cJSON_AddStringToObject(row, "size", size);
        cJSON_AddNumberToObject(row, "median_ms", ms.median);
        cJSON_AddNumberToObject(row, "p99_ms", ms.p99);
        cJSON_AddNumberToObject(row, "xray_drawn", drawn);
        cJSON_AddNumberToObject(row, "xray_shown", shown);
        cJSON_AddItemToArray(rows, row);
    }
    return true;
}

typedef struct Turn {
    RealtimeFigures real;
    int pictures;
    double seconds;
} Turn;

// A session of `seconds` that is driven by the scene's script, with or without concurrent rendering.
static bool take_turn(Studio *studio, double seconds, bool draws, Turn *turn, Faults *faults)
{
    static HandPort hand[TOOLS_MOST];
    HandPort *hands[TOOLS_MOST];
    for (int k = 0; k < TOOLS_MOST; k++) {
        hands[k] = &hand[k];
        atomic_store(&hand[k].drives, DRIVES_TOOL + k);
    }
    LiveSession session;
    LiveSessionOptions options = {.hand_count = studio->scene.scene->tool_count, .hand = hands, .xray = studio->controls.xray};
    if (!live_session_open(&session, studio->scene.scene, &studio->scene.open, &options, faults))
        return false;
    double begin = clock_s(CLOCK_MONOTONIC), next = begin;
    int cursor = 0, frame = 0;
    while (clock_s(CLOCK_MONOTONIC) < begin + seconds) {
        const Moment *moment = realtime_moment(session.realtime);
        ToolCommands commands = {0};
        if (studio->scene.scene->script && moment)
            commands = script_tools_at(studio->scene.scene->script, moment->pose->time_s, &cursor);
        for (int k = 0; k < options.hand_count; k++) {
            atomic_store(&hand[k].push_mm_s, commands.tool[k].push_mm_s);
            atomic_store(&hand[k].twist_deg_s, commands.tool[k].twist_deg_s);
        }
        if (draws)
            draw(studio, &cases[0], frame);
        frame++;
        next = fmax(next + 1.0 / 30, clock_s(CLOCK_MONOTONIC));
        struct timespec until = {.tv_sec = (time_t)next, .tv_nsec = (long)((next - floor(next)) * 1e9)};
        clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, NULL);
    }
    turn->pictures = draws ? frame : 0;
    turn->seconds = clock_s(CLOCK_MONOTONIC) - begin;
    bool whole = live_session_stop(&session, &turn->real, faults);
    live_session_free(&session);
    return whole;
}

static bool measure_disturbance(Studio *studio, double seconds, FILE *text, cJSON *root, Faults *faults)
{
    cJSON *rows = cJSON_AddArrayToObject(root, "real_time");
    fprintf(text, "\nThe 1 kHz thread beside pictures of 1280x720 and beside none, %.0f s each\n", seconds);
    fprintf(text, "%-12s %12s %24s %30s %8s %10s\n", "", "pictures/s", "woke late by [us]", "CPU time of a step [us]", "missed", "SCHED_FIFO");
    fprintf(text, "%-12s %12s %8s %7s %7s %10s %9s %9s\n", "", "", "median", "p99", "max", "median", "p99.9", "max");
    if (!make_canvas(studio, cases[0].width, cases[0].height, faults))
        return false;
    for (int i = 0; i < TURNS; i++) {
        Turn turn;
        bool draws = i & 1;
        if (!take_turn(studio, seconds, draws, &turn, faults))
            return false;
        const RealtimeFigures *real = &turn.real;
        fprintf(text, "%-12s %12.1f %8.0f %7.0f %7.0f %10.0f %9.0f %9.0f %8lld %10s\n", draws ? "drawing" : "not drawing", turn.pictures / turn.seconds,
                real->late_us[0], real->late_us[1], real->late_us[2], real->step_us[0], real->step_us[1], real->step_us[2], (long long)real->deadline_misses,
                real->real_time_priority ? "yes" : "no");
        cJSON *row = cJSON_CreateObject();
        cJSON_AddBoolToObject(row, "drawing", draws);
        cJSON_AddNumberToObject(row, "pictures_s", turn.pictures / turn.seconds);
        cJSON_AddNumberToObject(row, "late_median_us", real->late_us[0]);
        cJSON_AddNumberToObject(row, "late_p99_us", real->late_us[1]);
        cJSON_AddNumberToObject(row, "step_median_us", real->step_us[0]);
        cJSON_AddNumberToObject(row, "step_p999_us", real->step_us[1]);
        cJSON_AddNumberToObject(row, "deadline_misses", (double)real->deadline_misses);
        cJSON_AddBoolToObject(row, "real_time_priority", real->real_time_priority);
        cJSON_AddItemToArray(rows, row);
    }
    return true;
}

static bool set_studio(Studio *studio, const char *path, Faults *faults)
{
    char message[512] = "";
    if (!bench_open(path, studio->options->threads, &studio->scene, faults))
        return false;
    studio->context = gl_context_create(message, sizeof message);
    studio->panel = studio->context ? panel_create(message, sizeof message) : NULL;
    if (!studio->panel) {
        faults_add(faults, path, 0, 0, "nothing can be drawn: %s", message);
        return false;
    }
    studio->views = scene_views_create(studio->scene.scene, &studio->scene.open, &studio->controls, message, sizeof message, faults);
    if (!studio->views)
        return false;
    trainer_panel_begin(&studio->shown, studio->scene.scene, "");
    return take_moments(studio, faults);
}

typedef struct DrawingBench {
    BenchOptions common;
    const char *scene, *size;
    double seconds;
} DrawingBench;

static int call(void *options, Faults *faults)
{
    const DrawingBench *bench = options;
    Studio studio = {.options = &bench->common, .size = bench->size};
    cJSON *root = cJSON_CreateObject();
    FILE *text = bench_text(&bench->common);
    const char *path = bench->scene ? bench->scene : "scenes/phantom/scene.yaml";
    bool good = set_studio(&studio, path, faults);
    if (good) {
        fprintf(text, "%s, %s, %s\n", path, bench_processor(), gl_context_renderer(studio.context));
        cJSON_AddStringToObject(root, "scene", path);
        cJSON_AddStringToObject(root, "renderer", gl_context_renderer(studio.context));
        const double seconds = bench->seconds > 0 ? bench->seconds : bench->common.quick ? 3 : 10;
        good = measure_pictures(&studio, text, root, faults) && (studio.size || measure_disturbance(&studio, seconds, text, root, faults)) &&
               bench_write_json(&bench->common, root, faults);
    }
    cJSON_Delete(root);
    for (int i = 0; i < MOMENTS; i++)
        pose_free(studio.pose[i]);
    free(studio.tracked);
    views_destroy(studio.views);
    if (studio.panel)
        panel_destroy(studio.panel);
    if (studio.context)
        gl_canvas_destroy(&studio.canvas);
    gl_context_destroy(studio.context);
    bench_close(&studio.scene);
    return good ? EXIT_DONE : EXIT_BAD_INPUT;
}

static const Option rows[] = {
    {"seconds", "S", OPTION_NUMBER, OPTION_AT(DrawingBench, seconds), "duration of each part of the second table", .least = 1, .most = 3600, .otherwise = "10"},
    {"size", "WxH", OPTION_TEXT, OPTION_AT(DrawingBench, size), "only images of this size, and no second table"},
    BENCH_OPTIONS(DrawingBench, common, "a third of the images, parts of 3 s"),
};

static const OptionTable table = {
    .program = "seldinger bench drawing",
    .does = "images of the trainer: CPU time, and the 1 kHz thread with and without rendering",
    .usage = "[SCENE] [options]",
    .intro =
        "Renders the trainer off screen (EGL), views and panels together, at moments of the scene's script: CPU time of all drawing threads for an image, with "
        "C-arm and camera still and rotating. Then, alternately with and without 30 images a second: the latency of the 1 kHz thread and the time of a step.\n"
        "SCENE: default scenes/phantom/scene.yaml.",
    .exits = "0 done; 2 wrong usage, bad input, or no EGL",
    CLI_OPTIONS(rows, DrawingBench),
    .takes_argument = true,
    .may_be_missing = true,
    .argument = offsetof(DrawingBench, scene),
    .too_many = "one scene at a time, not also ",
};

const Verb bench_drawing = {.options = &table, .call = call};
