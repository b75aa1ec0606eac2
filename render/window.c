// Events are collected by GLFW's callbacks and passed on once per frame. Joysticks are polled, because GLFW's joystick callback has no user pointer.
#include "render/window.h"

#include "render/message.h"
#include "render/software_driver.h"

#include <epoxy/gl.h>
#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <errno.h>
#include <math.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

_Static_assert(WINDOW_GAMEPADS == GLFW_JOYSTICK_LAST + 1, "one place for each of GLFW's joysticks");

enum { SIGNALS = 3 };
static const int end_signal[SIGNALS] = {SIGINT, SIGTERM, SIGHUP};
static volatile sig_atomic_t ended_by_signal;   // global, because a signal handler has no argument for it

static double letter_scale = 1;

void window_scale_letters(double factor) { letter_scale = factor; }

struct Window {
    GLFWwindow *window;
    GLFWwindow *previous;
    WindowInput input;
    unsigned clicked;                // buttons pressed since the last poll
    int key_of[GLFW_KEY_LAST + 1];   // key code reported when a physical key was pressed, 0: released
    int64_t period_ns, deadline_ns;
    int64_t skipped;
    int left, top, width, height;    // of the window before full screen
    bool is_present[WINDOW_GAMEPADS];
    char gamepad[WINDOW_GAMEPADS][128];
    char dropped[4096];
    struct sigaction previous_action[SIGNALS];
};

static void on_end_signal(int number)
{
    (void)number;
    ended_by_signal = 1;
}

static int64_t now_ns(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000000000 + now.tv_nsec;
}

// ---- events

static bool must_not_be_lost(WindowEventKind kind) { return kind == WINDOW_KEY_UP_EVENT || kind == WINDOW_FOCUS_LOST_EVENT; }

static void add_event(Window *w, WindowEvent event)
{
    WindowInput *input = &w->input;
    if (input->event_count == WINDOW_EVENTS) {
        input->events_lost++;
        if (!must_not_be_lost(event.kind))
            return;
        // drops the oldest event that may be lost; if all are releases, a focus-lost event stands for all of them
        int drop = 0;
        while (drop < WINDOW_EVENTS && must_not_be_lost(input->event[drop].kind))
            drop++;
        if (drop == WINDOW_EVENTS) {
            input->event[WINDOW_EVENTS - 1] = (WindowEvent){.kind = WINDOW_FOCUS_LOST_EVENT};
            return;
        }
        memmove(input->event + drop, input->event + drop + 1, (size_t)(WINDOW_EVENTS - 1 - drop) * sizeof *input->event);
        input->event_count--;
    }
    input->event[input->event_count++] = event;
}

// Letters follow the user's layout, so that W A S D are where they are printed; all other keys follow their position.
static int key_named(int key, int scancode)
{
    static const struct {
        int glfw, key;
    } special[] = {{GLFW_KEY_UP, WINDOW_KEY_UP},
                   {GLFW_KEY_DOWN, WINDOW_KEY_DOWN},
                   {GLFW_KEY_LEFT, WINDOW_KEY_LEFT},
                   {GLFW_KEY_RIGHT, WINDOW_KEY_RIGHT},
                   {GLFW_KEY_PAGE_UP, WINDOW_KEY_PAGE_UP},
                   {GLFW_KEY_PAGE_DOWN, WINDOW_KEY_PAGE_DOWN},
                   {GLFW_KEY_HOME, WINDOW_KEY_HOME},
                   {GLFW_KEY_END, WINDOW_KEY_END},
                   {GLFW_KEY_INSERT, WINDOW_KEY_INSERT},
                   {GLFW_KEY_DELETE, WINDOW_KEY_DELETE},
                   {GLFW_KEY_BACKSPACE, WINDOW_KEY_BACKSPACE},
                   {GLFW_KEY_ENTER, WINDOW_KEY_ENTER},
                   {GLFW_KEY_KP_ENTER, WINDOW_KEY_ENTER},
                   {GLFW_KEY_TAB, WINDOW_KEY_TAB},
                   {GLFW_KEY_ESCAPE, WINDOW_KEY_ESCAPE},
                   {GLFW_KEY_LEFT_SHIFT, WINDOW_KEY_SHIFT},
                   {GLFW_KEY_RIGHT_SHIFT, WINDOW_KEY_SHIFT},
                   {GLFW_KEY_LEFT_CONTROL, WINDOW_KEY_CTRL},
                   {GLFW_KEY_RIGHT_CONTROL, WINDOW_KEY_CTRL},
                   {GLFW_KEY_LEFT_ALT, WINDOW_KEY_ALT},
                   {GLFW_KEY_KP_ADD, WINDOW_KEY_KEYPAD_ADD},
                   {GLFW_KEY_KP_SUBTRACT, WINDOW_KEY_KEYPAD_SUBTRACT}};
    for (size_t i = 0; i < sizeof special / sizeof special[0]; i++)
        if (special[i].glfw == key)
            return special[i].key;
    if (key >= GLFW_KEY_F1 && key <= GLFW_KEY_F12)
        return WINDOW_KEY_F1 + key - GLFW_KEY_F1;
    if (key < GLFW_KEY_SPACE || key > GLFW_KEY_GRAVE_ACCENT)
        return WINDOW_KEY_NONE;
    const char *name = glfwGetKeyName(key, scancode);
    if (name && name[0] && !name[1]) {
        if (name[0] >= 'a' && name[0] <= 'z')
            return name[0] - 'a' + 'A';
        if (key >= 'A' && key <= 'Z' && (unsigned char)name[0] < 128)
            return name[0];   // another sign is at this position (the M of AZERTY): not the letter of a US keyboard
    }
    return key;
}

static unsigned modifiers_of(int bits)
{
    return (bits & GLFW_MOD_SHIFT ? (unsigned)WINDOW_SHIFT : 0) | (bits & GLFW_MOD_CONTROL ? (unsigned)WINDOW_CTRL : 0) |
           (bits & GLFW_MOD_ALT ? (unsigned)WINDOW_ALT : 0) | (bits & GLFW_MOD_SUPER ? (unsigned)WINDOW_SUPER : 0);
}

static void on_key(GLFWwindow *window, int key, int scancode, int action, int bits)
{
    Window *w = glfwGetWindowUserPointer(window);
    if (key < 0 || key > GLFW_KEY_LAST)
        return;
    if (action == GLFW_RELEASE) {
        int was = w->key_of[key];
        w->key_of[key] = 0;
        for (int i = 0; i <= GLFW_KEY_LAST; i++)
            if (was && w->key_of[i] == was)
                return;   // the other Shift or Ctrl is still pressed
        if (was)
            add_event(w, (WindowEvent){.kind = WINDOW_KEY_UP_EVENT, .key = was, .modifiers = modifiers_of(bits)});
        return;
    }
    int named = w->key_of[key] ? w->key_of[key] : key_named(key, scancode);
    w->key_of[key] = named;
    if (named)
        add_event(w, (WindowEvent){.kind = WINDOW_KEY_DOWN_EVENT, .key = named, .modifiers = modifiers_of(bits), .is_repeat = action == GLFW_REPEAT});
}

static void on_character(GLFWwindow *window, unsigned character)
{
    Window *w = glfwGetWindowUserPointer(window);
    // GLFW reports the key before its character
    const WindowInput *input = &w->input;
    bool is_repeat =
        input->event_count > 0 && input->event[input->event_count - 1].kind == WINDOW_KEY_DOWN_EVENT && input->event[input->event_count - 1].is_repeat;
    add_event(w, (WindowEvent){.kind = WINDOW_TEXT_EVENT, .character = character, .is_repeat = is_repeat});
}

static void on_scroll(GLFWwindow *window, double x, double y)
{
    add_event(glfwGetWindowUserPointer(window), (WindowEvent){.kind = WINDOW_SCROLL_EVENT, .scroll_x = (float)x, .scroll_y = (float)y});
}

static void on_button(GLFWwindow *window, int button, int action, int bits)
{
    (void)bits;
    Window *w = glfwGetWindowUserPointer(window);
    if (button < 3 && action == GLFW_PRESS)
        w->clicked |= 1u << button;   // GLFW's order is the same: left, right, middle
}

static void on_focus(GLFWwindow *window, int has_focus)
{
    Window *w = glfwGetWindowUserPointer(window);
    if (has_focus)
        return;
    memset(w->key_of, 0, sizeof w->key_of);
    w->clicked = 0;
    add_event(w, (WindowEvent){.kind = WINDOW_FOCUS_LOST_EVENT});
}

static void on_drop(GLFWwindow *window, int count, const char **path)
{
    Window *w = glfwGetWindowUserPointer(window);
    if (count < 1 || (size_t)snprintf(w->dropped, sizeof w->dropped, "%s", path[0]) >= sizeof w->dropped)
        return;
    add_event(w, (WindowEvent){.kind = WINDOW_DROP_EVENT});
}

static void look_for_joysticks(Window *w)
{
    for (int i = 0; i < WINDOW_GAMEPADS; i++) {
        bool is_present = glfwJoystickPresent(i);
        if (is_present) {
            const char *name = glfwJoystickIsGamepad(i) ? glfwGetGamepadName(i) : glfwGetJoystickName(i);
            snprintf(w->gamepad[i], sizeof w->gamepad[i], "%s", name ? name : "");
        }
        if (is_present != w->is_present[i])
            add_event(w, (WindowEvent){.kind = WINDOW_DEVICE_EVENT, .device = i, .is_present = is_present});
        w->is_present[i] = is_present;
    }
}

static const WindowInput *window_poll(Window *w)
{
    WindowInput *input = &w->input;
    input->event_count = input->events_lost = 0;
    glfwPollEvents();
    look_for_joysticks(w);

    glfwGetFramebufferSize(w->window, &input->width, &input->height);
    float scale_x, scale_y;
    glfwGetWindowContentScale(w->window, &scale_x, &scale_y);
    input->scale = letter_scale * fmax(1, fmax(scale_x, scale_y));
    int width, height;
    glfwGetWindowSize(w->window, &width, &height);
    double x, y;
    glfwGetCursorPos(w->window, &x, &y);   // screen coordinates, which equal pixels on X11 but not everywhere
    input->mouse_x = width > 0 ? x * input->width / width : -1;
    input->mouse_y = height > 0 ? y * input->height / height : -1;
    input->has_focus = glfwGetWindowAttrib(w->window, GLFW_FOCUSED);
    input->is_iconified = glfwGetWindowAttrib(w->window, GLFW_ICONIFIED);
    input->mouse_buttons = w->clicked;
    for (int i = 0; i < 3; i++)
        if (glfwGetMouseButton(w->window, i) == GLFW_PRESS)
            input->mouse_buttons |= 1u << i;
    w->clicked = 0;
    input->close = WINDOW_OPEN;
    if (glfwWindowShouldClose(w->window)) {
        input->close = WINDOW_CLOSE_REQUESTED;
        glfwSetWindowShouldClose(w->window, GLFW_FALSE);
    }
    if (ended_by_signal)
        input->close = WINDOW_ENDED;
    return input;
}

// ---- frames

bool window_next_frame(Window *w, const WindowInput **input)
{
    int64_t now = now_ns();
    if (w->deadline_ns <= now) {
        int64_t left_out = (now - w->deadline_ns) / w->period_ns;
        w->skipped += left_out;
        w->deadline_ns += left_out * w->period_ns;
    } else {
        const struct timespec until = {w->deadline_ns / 1000000000, w->deadline_ns % 1000000000};
        while (!ended_by_signal && clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, NULL) == EINTR) {
        }
    }
    w->deadline_ns += w->period_ns;
    *input = window_poll(w);
    return !(*input)->is_iconified && (*input)->width > 0 && (*input)->height > 0;
}

void window_modifiers_take(WindowModifiers *modifiers, const WindowEvent *event)
{
    if (event->kind == WINDOW_KEY_DOWN_EVENT || event->kind == WINDOW_KEY_UP_EVENT) {
        bool is_down = event->kind == WINDOW_KEY_DOWN_EVENT;
        modifiers->shift = event->key == WINDOW_KEY_SHIFT ? is_down : modifiers->shift;
        modifiers->control = event->key == WINDOW_KEY_CTRL ? is_down : modifiers->control;
    } else if (event->kind == WINDOW_FOCUS_LOST_EVENT) {
        *modifiers = (WindowModifiers){0};
    }
}

void window_swap(Window *w)
{
    if (!glfwGetWindowAttrib(w->window, GLFW_VISIBLE))
        glfwShowWindow(w->window);
    glfwSwapBuffers(w->window);
}

const char *window_dropped(const Window *w) { return w->dropped; }

int64_t window_frames_skipped(const Window *w) { return w->skipped; }

// ---- joysticks

bool window_gamepad(Window *w, int index, WindowGamepad *out)
{
    if (index < 0 || index >= WINDOW_GAMEPADS || !glfwJoystickPresent(index))
        return false;
    *out = (WindowGamepad){0};
    snprintf(out->name, sizeof out->name, "%s", w->gamepad[index]);
    const char *guid = glfwGetJoystickGUID(index);
    snprintf(out->guid, sizeof out->guid, "%s", guid ? guid : "");
    GLFWgamepadstate state;
    if (glfwGetGamepadState(index, &state)) {
        out->is_mapped = true;
        out->axis_count = GLFW_GAMEPAD_AXIS_LAST + 1;
        out->button_count = GLFW_GAMEPAD_BUTTON_LAST + 1;
        memcpy(out->axis, state.axes, sizeof state.axes);
        memcpy(out->button, state.buttons, sizeof state.buttons);
        return true;
    }
    const float *axis = glfwGetJoystickAxes(index, &out->axis_count);
    const unsigned char *button = glfwGetJoystickButtons(index, &out->button_count);
    if (!axis || !button)
        return false;   // unplugged in the meantime
    if (out->axis_count > WINDOW_AXES)
        out->axis_count = WINDOW_AXES;
    if (out->button_count > WINDOW_BUTTONS)
        out->button_count = WINDOW_BUTTONS;
    memcpy(out->axis, axis, (size_t)out->axis_count * sizeof *axis);
    for (int i = 0; i < out->button_count; i++)
        out->button[i] = button[i] == GLFW_PRESS;
    return true;
}

const char *window_gamepad_name(const Window *w, int index) { return index >= 0 && index < WINDOW_GAMEPADS ? w->gamepad[index] : ""; }

// ---- full screen

// The monitor that shows most of the window.
static GLFWmonitor *monitor_of(const Window *w)
{
    int x, y, width, height, count;
    glfwGetWindowPos(w->window, &x, &y);
    glfwGetWindowSize(w->window, &width, &height);
    GLFWmonitor **monitor = glfwGetMonitors(&count), *best = glfwGetPrimaryMonitor();
    int best_area = 0;
    for (int i = 0; i < count; i++) {
        int left, top;
        glfwGetMonitorPos(monitor[i], &left, &top);
        const GLFWvidmode *mode = glfwGetVideoMode(monitor[i]);
        if (!mode)
            continue;
        int across = (x + width < left + mode->width ? x + width : left + mode->width) - (x > left ? x : left);
        int down = (y + height < top + mode->height ? y + height : top + mode->height) - (y > top ? y : top);
        if (across > 0 && down > 0 && across * down > best_area) {
            best_area = across * down;
            best = monitor[i];
        }
    }
    return best;
}

bool window_is_full_screen(const Window *w) { return glfwGetWindowMonitor(w->window); }

void window_set_full_screen(Window *w, bool is_full)
{
    if (is_full == window_is_full_screen(w))
        return;
    if (!is_full) {
        glfwSetWindowMonitor(w->window, NULL, w->left, w->top, w->width, w->height, GLFW_DONT_CARE);
        return;
    }
    GLFWmonitor *monitor = monitor_of(w);
    const GLFWvidmode *mode = monitor ? glfwGetVideoMode(monitor) : NULL;
    if (!mode)
        return;
    glfwGetWindowPos(w->window, &w->left, &w->top);
    glfwGetWindowSize(w->window, &w->width, &w->height);
    glfwSetWindowMonitor(w->window, monitor, 0, 0, mode->width, mode->height, mode->refreshRate);
}

// ---- create and destroy

static GLFWwindow *open_window(const char *title, int width, int height)
{
    glfwDefaultWindowHints();
    glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
    glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 3);
    glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
    glfwWindowHint(GLFW_OPENGL_FORWARD_COMPAT, GLFW_TRUE);
    glfwWindowHint(GLFW_SAMPLES, 0);   // views do their own antialiasing
    glfwWindowHint(GLFW_SCALE_TO_MONITOR, GLFW_TRUE);
    glfwWindowHint(GLFW_AUTO_ICONIFY, GLFW_FALSE);
    glfwWindowHint(GLFW_VISIBLE, GLFW_FALSE);   // until there is a picture to show: keys pressed before that would take effect late
    GLFWmonitor *monitor = glfwGetPrimaryMonitor();
    if (monitor) {
        int x, y, most_wide, most_high;
        glfwGetMonitorWorkarea(monitor, &x, &y, &most_wide, &most_high);
        if (most_wide > 0 && most_high > 0) {
            width = width < most_wide ? width : most_wide;
            height = height < most_high ? height : most_high;
        }
    }
    return glfwCreateWindow(width, height, title, NULL, NULL);
}

Window *window_create(const char *title, int width, int height, double hz, char *message, size_t capacity)
{
    const char *reason = NULL;
    software_driver_without_threads();
    if (!glfwInit()) {
        int code = glfwGetError(&reason);
        if (code == GLFW_PLATFORM_ERROR)
            message_fail(message, capacity, "no display; seldinger run works without one, or start under Xvfb");
        else
            message_fail(message, capacity, "cannot initialise GLFW: %s", reason ? reason : "no reason given");
        return NULL;
    }
    Window *w = calloc(1, sizeof *w);
    GLFWwindow *previous = glfwGetCurrentContext();
    GLFWwindow *window = w ? open_window(title, width, height) : NULL;
    if (!window) {
        if (w)
            glfwGetError(&reason);
        message_fail(message, capacity, "cannot open a window with OpenGL 3.3: %s", w ? (reason ? reason : "no reason given") : "out of memory");
        free(w);
        glfwTerminate();
        return NULL;
    }
    w->window = window;
    w->previous = previous;
    glfwSetWindowUserPointer(window, w);
    glfwSetWindowSizeLimits(window, 640, 400, GLFW_DONT_CARE, GLFW_DONT_CARE);
    glfwMakeContextCurrent(window);
    glfwSwapInterval(0);   // frames are paced by their own deadlines; a swap that waits would shift them
    glfwSetKeyCallback(window, on_key);
    glfwSetCharCallback(window, on_character);
    glfwSetScrollCallback(window, on_scroll);
    glfwSetMouseButtonCallback(window, on_button);
    glfwSetWindowFocusCallback(window, on_focus);
    glfwSetDropCallback(window, on_drop);

    ended_by_signal = 0;
    struct sigaction action = {.sa_handler = on_end_signal, .sa_flags = (int)SA_RESETHAND};   // a second signal ends the program at once
    sigemptyset(&action.sa_mask);
    for (int i = 0; i < SIGNALS; i++)
        sigaction(end_signal[i], &action, &w->previous_action[i]);
    w->period_ns = (int64_t)llround(1e9 / (hz > 0 ? hz : 30));
    w->deadline_ns = now_ns();
    return w;
}

void window_destroy(Window *w)
{
    if (!w)
        return;
    for (int i = 0; i < SIGNALS; i++)
        sigaction(end_signal[i], &w->previous_action[i], NULL);
    glfwMakeContextCurrent(w->previous);
    glfwDestroyWindow(w->window);
    glfwTerminate();
    free(w);
}
