// The trainer's window: GLFW 3.3 with an OpenGL 3.3 core context, behind plain C. All calls must come from the thread that created it.
// Positions and sizes are framebuffer pixels, y down from the upper left corner, for any display density.
#ifndef SELDINGER_RENDER_WINDOW_H
#define SELDINGER_RENDER_WINDOW_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

// Letters ('A' to 'Z') follow the user's keyboard layout; digits and signs are named by their position on a US keyboard.
typedef enum WindowKey {
    WINDOW_KEY_NONE = 0,
    WINDOW_KEY_SPACE = ' ', // printable keys: their ASCII capital
    WINDOW_KEY_UP = 256,
    WINDOW_KEY_DOWN,
    WINDOW_KEY_LEFT,
    WINDOW_KEY_RIGHT,
    WINDOW_KEY_PAGE_UP,
    WINDOW_KEY_PAGE_DOWN,
    WINDOW_KEY_HOME,
    WINDOW_KEY_END,
    WINDOW_KEY_INSERT,
    WINDOW_KEY_DELETE,
    WINDOW_KEY_BACKSPACE,
    WINDOW_KEY_ENTER,
    WINDOW_KEY_TAB,
    WINDOW_KEY_ESCAPE,
    WINDOW_KEY_SHIFT,
    WINDOW_KEY_CTRL,
    WINDOW_KEY_ALT, // left or right
    WINDOW_KEY_KEYPAD_ADD,
    WINDOW_KEY_KEYPAD_SUBTRACT,
    WINDOW_KEY_F1 = 290,
    WINDOW_KEY_F12 = WINDOW_KEY_F1 + 11,
    WINDOW_KEYS = 320
} WindowKey;

enum { WINDOW_SHIFT = 1, WINDOW_CTRL = 2, WINDOW_ALT = 4, WINDOW_SUPER = 8 };      // bits of modifiers
enum { WINDOW_MOUSE_LEFT = 1, WINDOW_MOUSE_RIGHT = 2, WINDOW_MOUSE_MIDDLE = 4 };   // bits of mouse buttons

typedef enum WindowEventKind {
    WINDOW_KEY_DOWN_EVENT,   // `key`, `modifiers`; `is_repeat` if the keyboard repeats it
    WINDOW_KEY_UP_EVENT,
    WINDOW_TEXT_EVENT,       // `character`, for text fields and for signs at other positions on other keyboards; `is_repeat`
    WINDOW_SCROLL_EVENT,     // `scroll_x`, `scroll_y`: notches, y > 0 away from the user
    WINDOW_FOCUS_LOST_EVENT, // counts as a release of all keys and mouse buttons
    WINDOW_DROP_EVENT,       // a file was dropped on the window: window_dropped
    WINDOW_DEVICE_EVENT      // `device`, `is_present`: a joystick was connected or removed; its name by window_gamepad or window_gamepad_name
} WindowEventKind;

typedef struct WindowEvent {
    WindowEventKind kind;
    int key;
    unsigned modifiers;
    unsigned character;      // Unicode
    bool is_repeat, is_present;
    int device;
    float scroll_x, scroll_y;
} WindowEvent;

typedef enum { WINDOW_OPEN, WINDOW_CLOSE_REQUESTED, WINDOW_ENDED } WindowClose; // by the title bar; by SIGINT, SIGTERM or SIGHUP

enum { WINDOW_EVENTS = 256, WINDOW_GAMEPADS = 16, WINDOW_AXES = 16, WINDOW_BUTTONS = 64 };

// Input since the last poll. It can also be filled by code to drive the panel off screen: zeros with width, height and scale give a still frame.
typedef struct WindowInput {
    int width, height;       // of the framebuffer [pixel]
    double scale;            // of letters: content scale (1, 2 on a high-density display) times the user's factor
    double mouse_x, mouse_y; // [pixel], y down; negative if there is no mouse
    unsigned mouse_buttons;  // pressed now; a click between two polls is visible for at least one poll
    bool has_focus, is_iconified;
    WindowClose close;       // CLOSE_ASKED for one poll, ENDED permanently
    int event_count;
    WindowEvent event[WINDOW_EVENTS];
    int events_lost;         // number of events beyond WINDOW_EVENTS in one poll; releases and loss of focus are never lost
} WindowInput;

typedef struct WindowGamepad {
    char name[128], guid[40];
    bool is_mapped;          // axes and buttons in the standard order: left x, left y, right x, right y, left and right trigger; A B X Y …
    int axis_count, button_count;
    float axis[WINDOW_AXES];          // [-1, 1]; y down
    uint8_t button[WINDOW_BUTTONS];   // 0 or 1; the hats of a joystick follow its buttons: up, right, down, left
} WindowGamepad;

typedef struct Window Window;

// The user's factor of all letters in the windows of this process, default 1.
void window_scale_letters(double factor);
// Creates a window with a current context and signal handlers, at most as large as the screen. `hz`: frames per second (0: 30). One window per process.
// Returns NULL with a reason, such as "no display; seldinger run works without one, or start under Xvfb".
Window *window_create(const char *title, int width, int height, double hz, char *message, size_t capacity);
void window_destroy(Window *window);   // restores signal handlers and the previous context

// Sleeps until the deadline of the next frame (absolute: a late frame does not shift later ones; whole periods are skipped if needed), then polls. Returns
// false if nothing should be drawn: iconified or of zero size. *input is valid until the next call.
bool window_next_frame(Window *window, const WindowInput **input);
// Keys that change what other keys and the mouse do.
typedef struct WindowModifiers {
    bool shift, control;     // held down
} WindowModifiers;
void window_modifiers_take(WindowModifiers *modifiers, const WindowEvent *event);
void window_swap(Window *window);   // the first call also shows the window, which is hidden until then
const char *window_dropped(const Window *window);   // the path of the file that was dropped last; "" if none was
int64_t window_frames_skipped(const Window *window);   // periods skipped because a frame took longer

// The present state of a joystick, `index` 0 to 15. Returns false if there is none.
bool window_gamepad(Window *window, int index, WindowGamepad *out);
const char *window_gamepad_name(const Window *window, int index);   // also of one just removed; "" if there never was one

void window_set_full_screen(Window *window, bool is_full);
bool window_is_full_screen(const Window *window);

#endif
