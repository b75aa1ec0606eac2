#include "render/start_window.h"

#include "render/gui.h"
#include "render/redraw.h"
#include "render/window.h"

#include <dirent.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

typedef enum { PAGE_CASES, PAGE_SESSIONS, PAGE_FILES, PAGES } Page;
static const char *const page_name[PAGES] = {"Cases", "My sessions", "Open a file"};
static const char *const page_hint[PAGES] = {"Up, Down: choose   Enter: steer   Tab: next page   Esc: leave",
                                             "Up, Down: choose   Enter: replay   R: report   Tab: next page   Esc: leave",
                                             "Up, Down: choose   Enter: open   Backspace: folder above   Tab: next page   Esc: leave"};

typedef struct FileRow {
    char name[256];
    bool is_folder;
} FileRow;

typedef struct StartWindow {
    const StartOptions *options;
    StartState *state;
    Window *window;
    Gui *gui;
    int file_count;
    FileRow *file;
    char message[600];           // shown below the list
    bool has_moved;              // the chosen row must be scrolled to
    int takes_name;              // frames until the field of the trainee's name has the keys
    StartChoice choice;
    bool ends;
} StartWindow;

// --- files ---

static bool is_shown(const char *name)
{
    static const char *const ending[] = {".yaml", ".yml", ".h5", ".nrrd", ".nhdr", ".mha", ".mhd", ".nii", ".nii.gz", ".stl", ".ply", ".obj", ".dcm"};
    size_t length = strlen(name);
    for (size_t i = 0; i < sizeof ending / sizeof *ending; i++)
        if (length > strlen(ending[i]) && !strcmp(name + length - strlen(ending[i]), ending[i]))
            return true;
    return false;
}

static int folders_first(const void *a, const void *b)
{
    const FileRow *p = a, *q = b;
    return p->is_folder != q->is_folder ? (int)q->is_folder - (int)p->is_folder : strcmp(p->name, q->name);
}

static void list_files(StartWindow *w)
{
    DIR *folder = opendir(w->state->folder);
    w->file_count = 0;
    for (struct dirent *entry; folder && (entry = readdir(folder));) {
        struct stat status;
        char *path = entry->d_name[0] != '.' && strlen(entry->d_name) < sizeof w->file->name ? text_file_in(w->state->folder, entry->d_name) : NULL;
        bool is_there = path && stat(path, &status) == 0, is_folder = is_there && S_ISDIR(status.st_mode);
        free(path);
        if (!is_there || !(is_folder || is_shown(entry->d_name)))
            continue;
        FileRow *more = realloc(w->file, (size_t)(w->file_count + 1) * sizeof *more);
        if (!more)
            break;
        w->file = more;
        w->file[w->file_count].is_folder = is_folder;
        snprintf(w->file[w->file_count++].name, sizeof w->file->name, "%s", entry->d_name);
    }
    if (folder)
        closedir(folder);
    else
        snprintf(w->message, sizeof w->message, "%.400s cannot be read", w->state->folder);
    if (w->file_count > 1)
        qsort(w->file, (size_t)w->file_count, sizeof *w->file, folders_first);
}

static void go_up(StartWindow *w)
{
    char *slash = strrchr(w->state->folder, '/');
    if (slash)
        slash[slash == w->state->folder] = 0;    // "/" stays
    w->state->row = 0;
    list_files(w);
}

// --- choices ---

static void choose(StartWindow *w, StartChoice choice, const char *path)
{
    snprintf(w->state->path, sizeof w->state->path, "%s", path);
    w->choice = choice;
    w->ends = true;
}

static void open_file(StartWindow *w, const FileRow *file)
{
    char *path = text_file_in(w->state->folder, file->name);
    if (path && file->is_folder && !case_is_there(path) && strlen(path) < sizeof w->state->folder) {
        snprintf(w->state->folder, sizeof w->state->folder, "%s", path);
        w->state->row = 0;
        list_files(w);
    } else if (path) {
        choose(w, START_STEER, path);
    }
    free(path);
}

static int row_count(const StartWindow *w)
{
    const Shelf *shelf = w->options->shelf;
    return w->state->page == PAGE_CASES ? shelf->case_count : w->state->page == PAGE_SESSIONS ? shelf->session_count : w->file_count;
}

static void open_row(StartWindow *w, int row)
{
    const Shelf *shelf = w->options->shelf;
    w->state->row = row;
    w->message[0] = 0;
    if (row < 0 || row >= row_count(w))
        return;
    if (w->state->page == PAGE_FILES)
        open_file(w, &w->file[row]);
    else if (w->state->page == PAGE_SESSIONS)
        choose(w, START_REPLAY, shelf->session[row].path);
    else if (shelf->cases[row].missing[0])
        snprintf(w->message, sizeof w->message, "%.250s needs %.250s, which is not there. The tutorial says how to make it.", shelf->cases[row].title,
                 shelf->cases[row].missing);
    else
        choose(w, START_STEER, shelf->cases[row].path);
}

static void turn_page(StartWindow *w, int page)
{
    w->state->page = (page + PAGES) % PAGES;
    w->state->row = 0;
    w->message[0] = 0;
    if (w->state->page == PAGE_FILES)
        list_files(w);
}

static void move(StartWindow *w, int by)
{
    int last = row_count(w) - 1, row = w->state->row + by;
    w->state->row = row < 0 ? 0 : row > last ? (last > 0 ? last : 0) : row;
    w->has_moved = true;
}

static void press(StartWindow *w, const WindowEvent *event)
{
    switch (event->key) {
    case WINDOW_KEY_UP: move(w, -1); break;
    case WINDOW_KEY_DOWN: move(w, 1); break;
    case WINDOW_KEY_PAGE_UP: move(w, -10); break;
    case WINDOW_KEY_PAGE_DOWN: move(w, 10); break;
    case WINDOW_KEY_HOME: move(w, -row_count(w)); break;
    case WINDOW_KEY_END: move(w, row_count(w)); break;
    case WINDOW_KEY_TAB: turn_page(w, w->state->page + (event->modifiers & WINDOW_SHIFT ? -1 : 1)); break;
    case WINDOW_KEY_ENTER: open_row(w, w->state->row); break;
    case WINDOW_KEY_ESCAPE: w->ends = true; break;
    case WINDOW_KEY_BACKSPACE:
        if (w->state->page == PAGE_FILES)
            go_up(w);
        break;
    case 'R':
        if (w->state->page == PAGE_SESSIONS && w->state->row < row_count(w))
            choose(w, START_REPORT, w->options->shelf->session[w->state->row].path);
        break;
    case 'N': w->takes_name = 2; break;
    case 'X': w->state->is_examination = !w->state->is_examination; break;
    default: break;
    }
}

// --- drawing ---

// The text of a row, left and right.
static void describe(const StartWindow *w, int row, char left[300], char right[200])
{
    const Shelf *shelf = w->options->shelf;
    if (w->state->page == PAGE_CASES) {
        const ShelfCase *c = &shelf->cases[row];
        char level[20] = "";
        if (c->level)
            snprintf(level, sizeof level, "level %d, ", c->level);
        snprintf(left, 300, "%s", c->title);
        if (c->missing[0])
            snprintf(right, 200, "%sits model is not made yet", level);
        else if (c->sessions)
            snprintf(right, 200, "%sbest %.0f of 100, %d session%s", level, c->best, c->sessions, c->sessions == 1 ? "" : "s");
        else
            snprintf(right, 200, "%snew", level);
    } else if (w->state->page == PAGE_SESSIONS) {
        const ShelfSession *s = &shelf->session[row];
        snprintf(left, 300, "%.10s %.5s  %s", s->date, s->date + 11, s->title[0] ? s->title : "without exercise");
        snprintf(right, 200, "%.80s%s%.0f points", s->trainee, s->trainee[0] ? ", " : "", s->points);
    } else {
        snprintf(left, 300, "%s", w->file[row].name);
        snprintf(right, 200, "%s", w->file[row].is_folder ? "folder" : "");
    }
}

static void draw_list(StartWindow *w, GuiRect at)
{
    static const char *const empty[PAGES] = {"No exercise was found. `seldinger case` makes a case of an angiogram.",
                                             "No session yet: each session in the trainer is kept here.", "No model, scene or volume in this folder."};
    Gui *gui = w->gui;
    gui_window_begin(gui, "list", at, 0);
    if (w->state->page == PAGE_FILES && gui_button(gui, "up", w->state->folder, "Backspace", 0, false).pressed)
        go_up(w);
    if (row_count(w) == 0)
        gui_text_wrapped(gui, GUI_NORMAL, gui_colors.dim, empty[w->state->page]);
    for (int i = 0; i < row_count(w); i++) {
        char left[300], right[200], id[32];
        describe(w, i, left, right);
        snprintf(id, sizeof id, "row %d", i);
        if (gui_button(gui, id, left, right, 0, i == w->state->row).pressed) {
            open_row(w, i);
            break;               // the list may be another one now
        }
        if (i == w->state->row && w->has_moved)
            gui_scroll_here(gui);
    }
    w->has_moved = false;
    gui_window_end(gui);
}

static void draw_side(StartWindow *w, GuiRect at)
{
    Gui *gui = w->gui;
    gui_window_begin(gui, "side", at, 0);
    gui_text(gui, GUI_HUGE, gui_colors.text, "Seldinger");
    gui_text_wrapped(gui, GUI_SMALL, gui_colors.dim,
                     "Steer guide wires and catheters through a patient's arteries. For training and research; not a medical device.");
    gui_space(gui, floorf(14 * gui_scale(gui)));
    for (int i = 0; i < PAGES; i++)
        if (gui_button(gui, page_name[i], page_name[i], NULL, 0, i == w->state->page).pressed)
            turn_page(w, i);
    gui_space(gui, floorf(14 * gui_scale(gui)));
    gui_text(gui, GUI_SMALL, gui_colors.dim, "Your name, for the report (N; Enter ends)");
    gui_text_field(gui, "trainee", w->state->trainee, sizeof w->state->trainee, w->takes_name > 0);
    w->takes_name -= w->takes_name > 0;
    gui_space(gui, floorf(14 * gui_scale(gui)));
    if (gui_button(gui, "examination", "Examination: X-ray alone", "X", 0, w->state->is_examination).pressed)
        w->state->is_examination = !w->state->is_examination;
    gui_space(gui, floorf(14 * gui_scale(gui)));
    if (w->state->page == PAGE_SESSIONS && w->state->row < row_count(w)) {
        const char *path = w->options->shelf->session[w->state->row].path;
        if (gui_button(gui, "replay", "Replay", "Enter", 0, false).pressed)
            choose(w, START_REPLAY, path);
        if (gui_button(gui, "report", "Report", "R", 0, false).pressed)
            choose(w, START_REPORT, path);
    }
    if (w->options->shelf->broken > 0) {
        char text[100];
        snprintf(text, sizeof text, "%d session file%s cannot be read.", w->options->shelf->broken, w->options->shelf->broken == 1 ? "" : "s");
        gui_text_wrapped(gui, GUI_SMALL, gui_colors.warning, text);
    }
    if (gui_button(gui, "leave", "Leave", "Esc", 0, false).pressed)
        w->ends = true;
    gui_window_end(gui);
}

// What the chosen exercise asks for.
static const char *about_row(const StartWindow *w)
{
    return w->state->page == PAGE_CASES && w->state->row < row_count(w) ? w->options->shelf->cases[w->state->row].text : "";
}

static void draw(StartWindow *w, const WindowInput *input)
{
    float k = (float)input->scale, side = floorf(300 * k), foot = floorf(190 * k), width = (float)input->width, height = (float)input->height;
    gui_begin(w->gui, input, input->scale, false);
    draw_side(w, (GuiRect){0, 0, side, height});
    draw_list(w, (GuiRect){side, 0, width - side, height - foot});
    gui_window_begin(w->gui, "foot", (GuiRect){side, height - foot, width - side, foot}, 0);
    gui_text(w->gui, GUI_SMALL, gui_colors.dim, page_hint[w->state->page]);
    gui_text_wrapped(w->gui, GUI_NORMAL, gui_colors.text, w->message[0] ? w->message : about_row(w));
    gui_window_end(w->gui);
    gui_end(w->gui, 0);
}

static void run_frames(StartWindow *w)
{
    const WindowInput *input;
    Redraw redraw = {0};
    for (double begun = clock_s(CLOCK_MONOTONIC); !w->ends;) {
        bool visible = window_next_frame(w->window, &input);
        for (int i = 0; i < input->event_count && !w->ends; i++) {
            const WindowEvent *event = &input->event[i];
            if (event->kind == WINDOW_KEY_DOWN_EVENT && !gui_takes_text(w->gui) && w->takes_name == 0)
                press(w, event);
            else if (event->kind == WINDOW_DROP_EVENT)
                choose(w, START_STEER, window_dropped(w->window));
        }
        w->ends |= input->close != WINDOW_OPEN || (w->options->duration_s > 0 && clock_s(CLOCK_MONOTONIC) - begun > w->options->duration_s);
        if (!visible || w->ends || !redraw_is_due(&redraw, input, NULL, 0, clock_s(CLOCK_MONOTONIC), 0.5))
            continue;
        draw(w, input);
        window_swap(w->window);
    }
}

StartChoice start_window_run(const StartOptions *options, StartState *state, Faults *faults)
{
    StartWindow w = {.options = options, .state = state};
    char message[512] = "";
    snprintf(w.message, sizeof w.message, "%s", options->message);
    if ((w.window = window_create("Seldinger", options->width, options->height, 0, message, sizeof message)) && (w.gui = gui_create(message, sizeof message))) {
        if (state->page == PAGE_FILES)
            list_files(&w);
        run_frames(&w);
    } else {
        faults_add(faults, "seldinger", 0, 0, "no window: %s", message);
    }
    if (w.gui)
        gui_destroy(w.gui);
    if (w.window)
        window_destroy(w.window);
    free(w.file);
    return w.choice;
}
