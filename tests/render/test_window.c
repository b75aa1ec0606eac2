// The window under a virtual X server, with keys and mouse by xdotool: the output of the window, the key table and the panel together. Skipped by name if Xvfb
// or xdotool is not installed (packages xvfb, xdotool).
#define _GNU_SOURCE   // dl_iterate_phdr
#include "render/gl_canvas.h"
#include "render/panel.h"
#include "render/window.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>
#include <epoxy/gl.h>
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <link.h>
#include <math.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

extern char **environ;
static const char title[] = "Seldinger window test";
static pid_t server;

typedef struct OperatorControls {
    Window *window;
    Panel *panel;
    PanelState state;
    PanelActions actions;
    const WindowInput *input;
    int pressed[ACTION_COUNT];   // summed since `forget`
    int device_events;
} OperatorControls;
static OperatorControls controls;

static double now_s(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

// ---- a server and a user

static pid_t start(char *const argv[])
{
    pid_t child;
    return posix_spawnp(&child, argv[0], NULL, NULL, argv, environ) == 0 ? child : -1;
}

static bool runs(const char *program)
{
    posix_spawn_file_actions_t quiet;
    posix_spawn_file_actions_init(&quiet);
    posix_spawn_file_actions_addopen(&quiet, 1, "/dev/null", O_WRONLY, 0);
    posix_spawn_file_actions_addopen(&quiet, 2, "/dev/null", O_WRONLY, 0);
    pid_t child;
    char *argv[] = {(char *)program, (char *)"-help", NULL};
    bool is_there = posix_spawnp(&child, program, &quiet, NULL, argv, environ) == 0;
    posix_spawn_file_actions_destroy(&quiet);
    if (is_there)
        waitpid(child, NULL, 0);
    return is_there;
}

// The server finds a free number itself and writes it into a pipe once it listens.
static bool start_server(void)
{
    int end[2];
    if (pipe(end) != 0)
        return false;
    char number[16];
    snprintf(number, sizeof number, "%d", end[1]);
    char *argv[] = {"Xvfb", "-displayfd", number, "-screen", "0", "1920x1080x24", "-nolisten", "tcp", "-noreset", NULL};
    posix_spawn_file_actions_t quiet;
    posix_spawn_file_actions_init(&quiet);
    posix_spawn_file_actions_addopen(&quiet, 2, "/dev/null", O_WRONLY, 0);
    posix_spawn_file_actions_addclose(&quiet, end[0]);
    bool is_started = posix_spawnp(&server, argv[0], &quiet, NULL, argv, environ) == 0;
    posix_spawn_file_actions_destroy(&quiet);
    close(end[1]);
    // the number and its newline may arrive separately, and the server ends if the pipe is closed too early
    char display[16] = ":";
    size_t length = 1;
    struct pollfd wait = {.fd = end[0], .events = POLLIN};
    while (is_started && !strchr(display, '\n') && length < sizeof display - 1 && poll(&wait, 1, 20000) == 1) {
        ssize_t more = read(end[0], display + length, sizeof display - 1 - length);
        if (more <= 0)
            break;
        length += (size_t)more;
    }
    close(end[0]);
    char *line_end = strchr(display, '\n');
    if (!line_end)
        return false;
    *line_end = 0;
    return setenv("DISPLAY", display, 1) == 0;
}

static void hand(const char *what)
{
    char line[256], *argv[24] = {"xdotool"};
    snprintf(line, sizeof line, "%s", what);
    int count = 1;
    for (char *word = strtok(line, " "); word && count < 23; word = strtok(NULL, " "))
        argv[count++] = word;
    pid_t child = start(argv);
    assert_true(child > 0);
    int status = 0;
    waitpid(child, &status, 0);
    assert_int_equal(status, 0);
}

// LeakSanitizer reports the memory of a driver as leaked once the driver is unloaded: it stays loaded.
static int keep_driver(struct dl_phdr_info *library, size_t size, void *unused)
{
    (void)size, (void)unused;
    if (strstr(library->dlpi_name, "_dri.so") || strstr(library->dlpi_name, "libGLX_mesa"))
        dlopen(library->dlpi_name, RTLD_NOW | RTLD_NOLOAD | RTLD_NODELETE);
    return 0;
}

// ---- frames

static void frame(void)
{
    bool is_drawn = window_next_frame(controls.window, &controls.input);
    panel_take_input(controls.panel, controls.input, &controls.actions);
    for (int i = 0; i < ACTION_COUNT; i++)
        controls.pressed[i] += controls.actions.pressed[i];
    for (int i = 0; i < controls.input->event_count; i++)
        controls.device_events += controls.input->event[i].kind == WINDOW_DEVICE_EVENT;
    if (!is_drawn)
        return;
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    glClearColor(0.3f, 0.3f, 0.3f, 1);
    glClear(GL_COLOR_BUFFER_BIT);
    controls.state.time_s += 1.0 / 30;
    panel_draw(controls.panel, controls.input, &controls.state, 0);
    window_swap(controls.window);
}

// Draws frames until the condition holds; false after 5 s.
static bool comes_to(bool (*is_so)(void))
{
    for (double end = now_s() + 5; now_s() < end;) {
        frame();
        if (is_so())
            return true;
    }
    return false;
}

static bool pushes(void) { return controls.actions.held[ACTION_PUSH]; }
static bool is_still(void)
{
    for (int i = 0; i < ACTION_COUNT; i++)
        if (controls.actions.held[i])
            return false;
    return true;
}
static bool pushes_fast_with_xray(void) { return pushes() && controls.actions.held[ACTION_FAST] && controls.actions.held[ACTION_PEDAL]; }
static bool orbits(void) { return controls.actions.held[ACTION_ORBIT_UP] && !pushes(); }
static bool asked_for_help(void) { return controls.pressed[ACTION_HELP] > 0; }
static bool magnified(void) { return controls.pressed[ACTION_MAGNIFY] > 0; }
static bool paused(void) { return controls.pressed[ACTION_PAUSE] > 0; }
static bool has_focus(void) { return controls.input->has_focus; }
static bool lost_focus(void) { return !controls.input->has_focus; }
static bool is_resized(void) { return controls.input->width == 1024 && controls.input->height == 600; }
static bool fills_screen(void) { return controls.input->width == 1920 && controls.input->height == 1080; }
static bool asks(void) { return panel_is_asking(controls.panel); }
static bool asks_no_more(void) { return !asks(); }
static bool quits(void) { return controls.pressed[ACTION_QUIT] > 0; }
static bool has_name(void) { return controls.actions.trainee_set; }
static bool scrolls_in_main_view(void) { return controls.actions.mouse.view == VIEW_FLUOROSCOPY && controls.actions.mouse.scroll > 0; }
static bool drags_up(void) { return controls.actions.mouse.view == VIEW_FLUOROSCOPY && controls.actions.mouse.buttons && controls.actions.mouse.drag_y > 0.02; }

static void forget(void) { memset(controls.pressed, 0, sizeof controls.pressed); }

static int start_all(void **unused)
{
    (void)unused;
    if (!runs("Xvfb") || !runs("xdotool") || !start_server()) {
        print_message("no Xvfb or no xdotool\n");
        return 0;
    }
    char message[256] = "";
    controls.window = window_create(title, 1280, 720, 30, message, sizeof message);
    dl_iterate_phdr(keep_driver, NULL);
    controls.panel = controls.window ? panel_create(message, sizeof message) : NULL;
    if (!controls.panel) {
        print_message("%s\n", message);
        return -1;
    }
    controls.state = (PanelState){.title = "Test", .xray = xray_default_control(), .view = VIEW_FLUOROSCOPY, .real_time_factor = 1};
    return comes_to(has_focus) ? 0 : -1;
}

static int end_all(void **unused)
{
    (void)unused;
    panel_destroy(controls.panel);
    window_destroy(controls.window);
    if (server > 0) {
        kill(server, SIGTERM);
        waitpid(server, NULL, 0);
    }
    return 0;
}

// ---- tests

static void a_missing_display_is_reported(void **unused)
{
    (void)unused;
    char *argv[] = {"/proc/self/exe", "--no-display", NULL};
    int status = 1;
    waitpid(start(argv), &status, 0);
    assert_int_equal(status, 0);
}

static void keys_are_held_and_let_go(void **unused)
{
    (void)unused;
    if (!controls.panel)
        skip();
    assert_true(comes_to(is_still));
    hand("keydown Up");
    assert_true(comes_to(pushes));
    for (int i = 0; i < 20; i++) {   // the server repeats it meanwhile
        frame();
        assert_true(pushes());
    }
    hand("keyup Up");
    assert_true(comes_to(is_still));
    hand("keydown Shift_L keydown f keydown Up");
    assert_true(comes_to(pushes_fast_with_xray));
    hand("keydown Shift_R keyup Shift_L");   // the other Shift continues
    for (int i = 0; i < 3; i++)
        frame();
    assert_true(pushes_fast_with_xray());
    hand("keyup Shift_R keyup f keyup Up");
    assert_true(comes_to(is_still));
    hand("keydown Alt_L keydown Up");
    assert_true(comes_to(orbits));
    hand("keyup Alt_L keyup Up");
    assert_true(comes_to(is_still));
}

static void signs_and_function_keys_are_pressed_once(void **unused)
{
    (void)unused;
    if (!controls.panel)
        skip();
    forget();
    hand("key question");
    assert_true(comes_to(asked_for_help));
    hand("key F1");
    for (int i = 0; i < 5; i++)
        frame();
    assert_int_equal(controls.pressed[ACTION_HELP], 2);
    hand("key plus");
    assert_true(comes_to(magnified));
    assert_int_equal(controls.pressed[ACTION_MAGNIFY], 1);
}

static void buttons_work_by_mouse(void **unused)
{
    (void)unused;
    if (!controls.panel)
        skip();
    PanelLayout layout = panel_layout(controls.input->width, controls.input->height, controls.input->scale, VIEW_FLUOROSCOPY, true);
    forget();
    char line[128];
    // Pause is the first of three buttons at the right of the bar above
    snprintf(line, sizeof line, "mousemove %d %d", (int)(layout.top.width - 250 * layout.scale), (int)(19 * layout.scale));
    hand(line);
    frame();
    frame();
    hand("click 1");
    assert_true(comes_to(paused));
    assert_int_equal(controls.pressed[ACTION_PAUSE], 1);
    // the tool tab's first button pushes while the mouse is down
    snprintf(line, sizeof line, "mousemove %d %d", (int)(layout.right.x + 0.5 * layout.right.width), (int)(layout.right.y + 42 * layout.scale));
    hand(line);
    frame();
    frame();
    hand("mousedown 1");
    assert_true(comes_to(pushes));
    for (int i = 0; i < 10; i++) {
        frame();
        assert_true(pushes());
    }
    hand("mouseup 1");
    assert_true(comes_to(is_still));
}

static void the_mouse_turns_and_scrolls_in_a_view(void **unused)
{
    (void)unused;
    if (!controls.panel)
        skip();
    hand("mousemove 600 400");
    frame();
    hand("click 4");
    assert_true(comes_to(scrolls_in_main_view));
    hand("mousedown 1");
    frame();
    hand("mousemove 600 340");
    assert_true(comes_to(drags_up));
    hand("mouseup 1");
    frame();
    assert_true(comes_to(is_still));
}

static void loss_of_focus_stops_the_tool(void **unused)
{
    (void)unused;
    if (!controls.panel)
        skip();
    hand("keydown Up keydown f");
    assert_true(comes_to(pushes));
    // another window comes to the front
    char *argv[] = {"/proc/self/exe", "--other-window", NULL};
    pid_t other = start(argv);
    assert_true(other > 0);
    assert_true(comes_to(lost_focus));
    assert_true(is_still());
    for (int i = 0; i < 10; i++) {   // and stays so, although the keys are still down
        frame();
        assert_true(is_still());
    }
    hand("keyup Up keyup f");
    kill(other, SIGTERM);
    int status = 1;
    waitpid(other, &status, 0);
    assert_int_equal(status, 0);   // SIGTERM ended its loop in order
    hand("search --name Seldinger.window.test windowfocus --sync");
    assert_true(comes_to(has_focus));
    assert_true(is_still());
}

static void a_name_is_typed(void **unused)
{
    (void)unused;
    if (!controls.panel)
        skip();
    forget();
    hand("key F3");
    assert_true(comes_to(asks));
    frame();
    hand("type --delay 40 Eve");
    hand("key space f");   // f is the pedal, but not here
    for (int i = 0; i < 6; i++) {
        frame();
        assert_true(is_still());
    }
    hand("key Return");
    assert_true(comes_to(has_name));
    assert_string_equal(controls.actions.trainee, "Eve f");
    assert_true(comes_to(asks_no_more));
}

// Process CPU time, including the driver's threads.
static void print_cost(void)
{
    struct timespec t[2];
    enum { FRAMES = 60 };
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t[0]);
    for (int i = 0; i < FRAMES; i++) {
        controls.state.time_s += 1.0 / 30;
        controls.state.tool[0].force_n = 0.06 + 0.02 * sin(0.3 * i);
        panel_draw(controls.panel, controls.input, &controls.state, 0);
        glFinish();
    }
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t[1]);
    double ms = 1e3 * (double)(t[1].tv_sec - t[0].tv_sec) + 1e-6 * (double)(t[1].tv_nsec - t[0].tv_nsec);
    print_message("panel alone in a window of %dx%d: %.2f ms CPU a frame (%s)\n", controls.input->width, controls.input->height, ms / FRAMES,
                  (const char *)glGetString(GL_RENDERER));
}

static void draw_fresh(unsigned framebuffer, const WindowInput *input)
{
    char message[256];
    Panel *panel = panel_create(message, sizeof message);
    assert_non_null(panel);
    for (int i = 0; i < 4; i++) {
        glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
        glClearColor(0.2f, 0.4f, 0.6f, 1);
        glClear(GL_COLOR_BUFFER_BIT);
        panel_draw(panel, input, &controls.state, framebuffer);
    }
    panel_destroy(panel);
}

// A window's buffer is filled differently from one off screen (rows, byte order): the picture must be the same.
static void the_window_shows_what_is_drawn_off_screen(void **unused)
{
    (void)unused;
    if (!controls.panel)
        skip();
    WindowInput input = {.width = controls.input->width, .height = controls.input->height, .scale = 1, .mouse_x = -1, .mouse_y = -1, .has_focus = true};
    size_t bytes = (size_t)input.width * (size_t)input.height * 3;
    uint8_t *window = malloc(bytes), *canvas = malloc(bytes);
    assert_true(window && canvas);
    draw_fresh(0, &input);
    glBindFramebuffer(GL_READ_FRAMEBUFFER, 0);
    glPixelStorei(GL_PACK_ALIGNMENT, 1);
    glReadPixels(0, 0, input.width, input.height, GL_RGB, GL_UNSIGNED_BYTE, window);
    GlCanvas off_screen;
    char message[256];
    assert_true(gl_canvas_create(&off_screen, input.width, input.height, 1, message, sizeof message));
    draw_fresh(off_screen.framebuffer, &input);
    gl_canvas_read(&off_screen, canvas);
    size_t row = (size_t)input.width * 3;
    for (int y = 0; y < input.height; y++)   // OpenGL's first row is the lowest, the canvas's is the highest
        assert_memory_equal(window + (size_t)(input.height - 1 - y) * row, canvas + (size_t)y * row, row);
    gl_canvas_destroy(&off_screen);
    free(window);
    free(canvas);
}

static void it_is_resized_and_fills_the_screen(void **unused)
{
    (void)unused;
    if (!controls.panel)
        skip();
    print_cost();
    hand("search --name Seldinger.window.test windowsize --sync 1024 600");
    assert_true(comes_to(is_resized));
    assert_int_equal(glGetError(), GL_NO_ERROR);
    window_set_full_screen(controls.window, true);
    assert_true(comes_to(fills_screen));
    assert_true(window_is_full_screen(controls.window));
    print_cost();
    window_set_full_screen(controls.window, false);
    assert_true(comes_to(is_resized));
    assert_int_equal(glGetError(), GL_NO_ERROR);
}

static void quitting_is_asked_back_and_a_signal_is_not(void **unused)
{
    (void)unused;
    if (!controls.panel)
        skip();
    forget();
    hand("keydown Up");
    assert_true(comes_to(pushes));
    hand("key Escape");
    assert_true(comes_to(asks));
    assert_true(is_still());   // a question stops the tool
    hand("key Escape");
    assert_true(comes_to(asks_no_more));
    hand("keyup Up");
    hand("key Escape");
    assert_true(comes_to(asks));
    assert_int_equal(controls.pressed[ACTION_QUIT], 0);
    hand("key Return");
    assert_true(comes_to(quits));
    forget();
    raise(SIGTERM);
    frame();
    assert_int_equal(controls.input->close, WINDOW_ENDED);
    assert_true(quits());
    assert_false(asks());
}

// At 30 Hz with absolute deadlines: frames never come sooner, and a late frame skips whole periods instead of catching up.
static void frames_are_paced(void **unused)
{
    (void)unused;
    if (!controls.panel)
        skip();
    window_next_frame(controls.window, &controls.input);
    double begin = now_s();
    for (int i = 0; i < 12; i++)
        window_next_frame(controls.window, &controls.input);
    assert_true(now_s() - begin > 11.0 / 30);
    int64_t skipped = window_frames_skipped(controls.window);
    const struct timespec pause = {0, 250000000};
    nanosleep(&pause, NULL);
    window_next_frame(controls.window, &controls.input);   // at once
    assert_true(window_frames_skipped(controls.window) - skipped >= 6);
    begin = now_s();
    for (int i = 0; i < 6; i++)
        window_next_frame(controls.window, &controls.input);
    assert_true(now_s() - begin > 4.0 / 30);
}

static void no_joystick_is_no_joystick(void **unused)
{
    (void)unused;
    if (!controls.panel)
        skip();
    WindowGamepad gamepad;
    assert_false(window_gamepad(controls.window, -1, &gamepad));
    assert_false(window_gamepad(controls.window, WINDOW_GAMEPADS, &gamepad));
    assert_string_equal(window_gamepad_name(controls.window, -1), "");
    for (int i = 0; i < WINDOW_GAMEPADS; i++)
        if (window_gamepad(controls.window, i, &gamepad)) {
            assert_in_range(gamepad.axis_count, 0, WINDOW_AXES);
            assert_in_range(gamepad.button_count, 0, WINDOW_BUTTONS);
            assert_true(controls.device_events > 0);
        }
}

// A window that takes the focus, until SIGTERM.
static int other_window(void)
{
    char message[256];
    Window *window = window_create("other", 300, 200, 30, message, sizeof message);
    dl_iterate_phdr(keep_driver, NULL);
    const WindowInput *input = NULL;
    double end = now_s() + 60;
    window_swap(window);   // it is visible from its first picture on
    do {
        window_next_frame(window, &input);
    } while (input->close != WINDOW_ENDED && now_s() < end);
    bool is_ended = input->close == WINDOW_ENDED;
    window_destroy(window);
    return is_ended ? 0 : 1;
}

static int no_display(void)
{
    unsetenv("DISPLAY");
    unsetenv("WAYLAND_DISPLAY");
    char message[256] = "";
    Window *window = window_create(title, 640, 480, 30, message, sizeof message);
    return !window && strcmp(message, "no display; seldinger run works without one, or start under Xvfb") == 0 ? 0 : 1;
}

int main(int argc, char **argv)
{
    if (argc == 2 && strcmp(argv[1], "--no-display") == 0)
        return no_display();
    if (argc == 2 && strcmp(argv[1], "--other-window") == 0)
        return other_window();
    const struct CMUnitTest tests[] = {cmocka_unit_test(a_missing_display_is_reported),
                                       cmocka_unit_test(keys_are_held_and_let_go),
                                       cmocka_unit_test(signs_and_function_keys_are_pressed_once),
                                       cmocka_unit_test(buttons_work_by_mouse),
                                       cmocka_unit_test(the_mouse_turns_and_scrolls_in_a_view),
                                       cmocka_unit_test(loss_of_focus_stops_the_tool),
                                       cmocka_unit_test(a_name_is_typed),
                                       cmocka_unit_test(the_window_shows_what_is_drawn_off_screen),
                                       cmocka_unit_test(it_is_resized_and_fills_the_screen),
                                       cmocka_unit_test(no_joystick_is_no_joystick),
                                       cmocka_unit_test(frames_are_paced),
                                       cmocka_unit_test(quitting_is_asked_back_and_a_signal_is_not)};
    return cmocka_run_group_tests(tests, start_all, end_all);
}
