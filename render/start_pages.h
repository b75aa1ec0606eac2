// The pages of the start window: keys and drawing, in a window or off screen.
#ifndef SELDINGER_RENDER_START_PAGES_H
#define SELDINGER_RENDER_START_PAGES_H

#include "render/gui.h"
#include "render/start_devices.h"
#include "render/start_settings.h"
#include "render/start_state.h"

typedef enum { PAGE_CASES, PAGE_SESSIONS, PAGE_FILES, PAGE_DEVICES, PAGE_SETTINGS, PAGES } StartPage;

typedef struct FileRow {
    char name[256];
    bool is_folder;
} FileRow;

typedef struct CasePicture {
    char *file;                  // NULL: none can be kept
    GuiTexture texture;          // 0: not there yet
} CasePicture;

typedef struct StartWindow {
    const StartOptions *options;
    StartState *state;
    Window *window;              // NULL: off screen
    Gui *gui;
    int file_count;
    FileRow *file;
    CasePicture *picture;        // of each case
    double looked_s;             // when missing pictures were looked for
    DevicesPage *devices;        // NULL until its page is opened
    SettingsPage settings;
    char message[600];           // shown below the list
    bool has_moved;              // the chosen row must be scrolled to
    int takes_name;              // frames until the field of the trainee's name has the keys
    StartChoice choice;
    bool ends;
} StartWindow;

void start_open(StartWindow *w);
void start_close(StartWindow *w);
void start_turn_page(StartWindow *w, int page);
void start_choose(StartWindow *w, StartChoice choice, const char *path);   // ends the window
void start_press(StartWindow *w, const WindowEvent *event);
void start_draw(StartWindow *w, const WindowInput *input, unsigned framebuffer);

#endif
