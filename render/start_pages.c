#include "render/start_pages.h"

#include "render/case_picture.h"
#include "render/key_list.h"
#include "render/translation.h"

#include <dirent.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

enum { LEVELS = 5 };             // of exercises
static const char *const page_name[PAGES] = {N_("Cases"), N_("My sessions"), N_("Open a file"), N_("Devices"), N_("Settings")};
static const char *const page_hint[PAGES] = {
    N_("{up}, {down}: choose   {open}: steer   {next_page}: next page   {name}: name   {examination}: examination   {leave}: leave"),
    N_("{up}, {down}: choose   {open}: replay   {report}: report   {next_page}: next page   {leave}: leave"),
    N_("{up}, {down}: choose   {open}: open   {folder_above}: folder above   {next_page}: next page   {leave}: leave"),
    N_("{up}, {down}: choose   {learn_push}: learn the push   {learn_turn}: learn the turn   {look_again}: look again   {next_page}: next page   {leave}: "
       "leave"),
    N_("{up}, {down}: choose   {less}, {more}: change   {open}: change, or a new key   {next_page}: next page   {leave}: leave")};

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
        snprintf(w->message, sizeof w->message, tr("%.400s cannot be read"), w->state->folder);
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

void start_choose(StartWindow *w, StartChoice choice, const char *path)
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
        start_choose(w, START_STEER, path);
    }
    free(path);
}

static int row_count(const StartWindow *w)
{
    const Shelf *shelf = w->options->shelf;
    switch ((StartPage)w->state->page) {
    case PAGE_CASES: return shelf->case_count;
    case PAGE_SESSIONS: return shelf->session_count;
    case PAGE_FILES: return w->file_count;
    case PAGE_DEVICES: return w->devices ? devices_page_rows(w->devices) : 0;
    case PAGE_SETTINGS: return settings_page_rows();
    case PAGES: break;
    }
    return 0;
}

static void open_row(StartWindow *w, int row)
{
    const Shelf *shelf = w->options->shelf;
    w->state->row = row;
    w->message[0] = 0;
    if (row < 0 || row >= row_count(w) || w->state->page == PAGE_DEVICES)
        return;
    if (w->state->page == PAGE_FILES)
        open_file(w, &w->file[row]);
    else if (w->state->page == PAGE_SESSIONS)
        start_choose(w, START_REPLAY, shelf->session[row].recording);
    else if (w->state->page == PAGE_SETTINGS)
        settings_page_enter(&w->settings, row);
    else if (shelf->cases[row].missing[0])
        snprintf(w->message, sizeof w->message, tr("%.250s needs %.250s, which is not there. The tutorial says how to make it."), shelf->cases[row].title,
                 shelf->cases[row].missing);
    else
        start_choose(w, START_STEER, shelf->cases[row].path);
}

static void look_at_devices(StartWindow *w)
{
    if (!w->devices)
        w->devices = devices_page_open(w->options->transport);
    if (w->devices)
        devices_page_look(w->devices, w->window);
}

void start_turn_page(StartWindow *w, int page)
{
    w->state->page = (page + PAGES) % PAGES;
    w->state->row = 0;
    w->message[0] = 0;
    w->has_moved = true;
    w->settings.waits_for = -1;
    if (w->state->page == PAGE_FILES)
        list_files(w);
    if (w->state->page == PAGE_DEVICES)
        look_at_devices(w);
}

static void move(StartWindow *w, int by)
{
    int last = row_count(w) - 1, row = w->state->row + by;
    w->state->row = row < 0 ? 0 : row > last ? (last > 0 ? last : 0) : row;
    w->has_moved = true;
}

static void press_on_devices(StartWindow *w, StartKey key)
{
    if (!w->devices)
        return;
    if (key == START_KEY_LOOK_AGAIN)
        look_at_devices(w);
    else if (key == START_KEY_LEARN_PUSH || key == START_KEY_LEARN_TURN)
        devices_page_learn(w->devices, w->state->row, key == START_KEY_LEARN_TURN);
}

// Keys with a meaning on one page.
static void press_on_page(StartWindow *w, StartKey key)
{
    if (w->state->page == PAGE_FILES && key == START_KEY_FOLDER_ABOVE)
        go_up(w);
    else if (w->state->page == PAGE_SESSIONS && key == START_KEY_REPORT && w->state->row < row_count(w))
        start_choose(w, START_REPORT, w->options->shelf->session[w->state->row].path);
    else if (w->state->page == PAGE_DEVICES)
        press_on_devices(w, key);
    else if (w->state->page == PAGE_SETTINGS && (key == START_KEY_LESS || key == START_KEY_MORE))
        settings_page_step(&w->settings, w->state->row, key == START_KEY_MORE ? 1 : -1);
}

void start_press(StartWindow *w, const WindowEvent *event)
{
    if (w->state->page == PAGE_SETTINGS && settings_page_take(&w->settings, event))
        return;
    const int key = key_sheet_pressed(SHEET_START, event, NULL);
    if (w->state->page == PAGE_DEVICES && key == START_KEY_LEAVE && devices_page_is_learning(w->devices)) {
        devices_page_stop_learning(w->devices);
        return;
    }
    switch (key) {
    case START_KEY_UP: move(w, -1); break;
    case START_KEY_DOWN: move(w, 1); break;
    case START_KEY_PAGE_UP: move(w, -10); break;
    case START_KEY_PAGE_DOWN: move(w, 10); break;
    case START_KEY_FIRST: move(w, -row_count(w)); break;
    case START_KEY_LAST: move(w, row_count(w)); break;
    case START_KEY_NEXT_PAGE: start_turn_page(w, w->state->page + (event->modifiers & WINDOW_SHIFT ? -1 : 1)); break;
    case START_KEY_OPEN:
        if (!event->is_repeat)
            open_row(w, w->state->row);
        break;
    case START_KEY_LEAVE: w->ends = true; break;
    case START_KEY_NAME: w->takes_name = 2; break;
    case START_KEY_EXAMINATION: w->state->is_examination = !w->state->is_examination; break;
    case -1: break;
    default: press_on_page(w, (StartKey)key); break;
    }
}

// --- drawing ---

// Small pictures that have been drawn meanwhile.
static void load_pictures(StartWindow *w)
{
    double now = clock_s(CLOCK_MONOTONIC);
    if (now - w->looked_s < 0.5)
        return;
    w->looked_s = now;
    for (int i = 0; w->picture && i < w->options->shelf->case_count; i++) {
        int width, height;
        uint8_t *rgb = w->picture[i].file && !w->picture[i].texture ? case_picture_read(w->picture[i].file, &width, &height) : NULL;
        if (rgb)
            w->picture[i].texture = gui_texture_create(width, height, rgb);
        free(rgb);
    }
}

static void describe_case(const ShelfCase *c, char line[100], char right[200])
{
    line[0] = 0;
    if (c->level > 0) {
        size_t used = (size_t)snprintf(line, 100, tr("Level %d of %d  "), c->level, LEVELS);
        for (int i = 0; i < LEVELS && used < 90; i++)
            used += (size_t)snprintf(line + used, 100 - used, "%s", i < c->level ? "\u25cf" : "\u25cb");
    }
    if (c->missing[0])
        snprintf(right, 200, "%s", tr("its model is not made yet"));
    else if (c->sessions)
        snprintf(right, 200, tr_n("best %.0f of 100, %d session", "best %.0f of 100, %d sessions", (unsigned long)c->sessions), c->best, c->sessions);
    else
        snprintf(right, 200, "%s", tr("new"));
}

static bool draw_case(StartWindow *w, int row, const char *id)
{
    char line[100], right[200];
    const ShelfCase *c = &w->options->shelf->cases[row];
    describe_case(c, line, right);
    return gui_card(w->gui, id, w->picture ? w->picture[row].texture : 0, c->title, line, right, row == w->state->row);
}

// The text of a row, left and right.
static void describe(const StartWindow *w, int row, const char **heading, char left[300], char right[200])
{
    *heading = NULL;
    if (w->state->page == PAGE_SESSIONS) {
        const ShelfSession *s = &w->options->shelf->session[row];
        snprintf(left, 300, "%.10s %.5s  %s", s->date, s->date + 11, s->title[0] ? tr(s->title) : tr("without exercise"));
        snprintf(right, 200, tr("%.80s%s%.0f points"), s->trainee, s->trainee[0] ? ", " : "", s->points);
    } else if (w->state->page == PAGE_FILES) {
        snprintf(left, 300, "%s", w->file[row].name);
        snprintf(right, 200, "%s", w->file[row].is_folder ? tr("folder") : "");
    } else if (w->state->page == PAGE_DEVICES) {
        devices_page_describe(w->devices, row, left, right);
    } else {
        settings_page_describe(&w->settings, row, heading, left, right);
    }
}

static bool draw_row(StartWindow *w, int row)
{
    char left[300], right[200], id[32];
    const char *heading;
    snprintf(id, sizeof id, "row %d", row);
    if (w->state->page == PAGE_CASES)
        return draw_case(w, row, id);
    describe(w, row, &heading, left, right);
    if (heading) {
        gui_space(w->gui, floorf(6 * gui_scale(w->gui)));
        gui_text(w->gui, GUI_SMALL, gui_colors.accent, heading);
    }
    return gui_button(w->gui, id, left, right, 0, row == w->state->row).pressed;
}

static void draw_list(StartWindow *w, GuiRect at)
{
    static const char *const empty[PAGES] = {N_("No exercise was found. `seldinger case` makes a case of an angiogram."),
                                             N_("No session yet: each session in the trainer is kept here."), N_("No model, scene or volume in this folder."),
                                             N_("No device is connected. The keyboard steers."), ""};
    Gui *gui = w->gui;
    gui_window_begin(gui, "list", at, 0);
    if (w->state->page == PAGE_FILES && key_list_button(gui, SHEET_START, "up", w->state->folder, START_KEY_FOLDER_ABOVE, 0, false))
        go_up(w);
    if (row_count(w) == 0)
        gui_text_wrapped(gui, GUI_NORMAL, gui_colors.dim, empty[w->state->page]);
    for (int i = 0; i < row_count(w); i++) {
        if (draw_row(w, i)) {
            open_row(w, i);
            break;               // the list may be another one now
        }
        if (i == w->state->row && w->has_moved)
            gui_scroll_here(gui);
    }
    w->has_moved = false;
    if (w->state->page == PAGE_DEVICES && w->devices) {
        gui_space(gui, floorf(8 * gui_scale(gui)));
        devices_page_draw(w->devices, gui, w->window, w->state->row);
    }
    gui_window_end(gui);
}

// Buttons for the chosen row.
static void draw_row_buttons(StartWindow *w)
{
    Gui *gui = w->gui;
    const int row = w->state->row;
    if (w->state->page == PAGE_SESSIONS && row < row_count(w)) {
        const ShelfSession *session = &w->options->shelf->session[row];
        if (key_list_button(gui, SHEET_START, "replay", "Replay", START_KEY_OPEN, 0, false))
            start_choose(w, START_REPLAY, session->recording);
        if (key_list_button(gui, SHEET_START, "report", "Report", START_KEY_REPORT, 0, false))
            start_choose(w, START_REPORT, session->path);
    } else if (w->state->page == PAGE_DEVICES && w->devices) {
        const bool can = devices_page_can_learn(w->devices, row);
        if (can && key_list_button(gui, SHEET_START, "learn push", "Learn the push", START_KEY_LEARN_PUSH, 0, false))
            devices_page_learn(w->devices, row, false);
        if (can && key_list_button(gui, SHEET_START, "learn turn", "Learn the turn", START_KEY_LEARN_TURN, 0, false))
            devices_page_learn(w->devices, row, true);
        if (key_list_button(gui, SHEET_START, "look", "Look again", START_KEY_LOOK_AGAIN, 0, false))
            look_at_devices(w);
    } else if (w->state->page == PAGE_SETTINGS && settings_page_has_steps(row)) {
        if (key_list_button(gui, SHEET_START, "less", "Less", START_KEY_LESS, 0, false))
            settings_page_step(&w->settings, row, -1);
        if (key_list_button(gui, SHEET_START, "more", "More", START_KEY_MORE, 0, false))
            settings_page_step(&w->settings, row, 1);
    }
}

static void draw_side(StartWindow *w, GuiRect at)
{
    Gui *gui = w->gui;
    const float gap = floorf(12 * gui_scale(gui));
    char text[200];
    gui_window_begin(gui, "side", at, 0);
    gui_text(gui, GUI_HUGE, gui_colors.text, "Seldinger");
    gui_text_wrapped(gui, GUI_SMALL, gui_colors.dim,
                     "Steer guide wires and catheters through a patient's arteries. For training and research; not a medical device.");
    gui_space(gui, gap);
    for (int i = 0; i < PAGES; i++)
        if (gui_button(gui, page_name[i], page_name[i], NULL, 0, i == w->state->page).pressed)
            start_turn_page(w, i);
    gui_space(gui, gap);
    gui_text_wrapped(gui, GUI_SMALL, gui_colors.dim, key_sheet_fill(SHEET_START, tr("Your name, for the report ({name}; Enter ends)"), text, sizeof text));
    gui_text_field(gui, "trainee", w->state->trainee, sizeof w->state->trainee, w->takes_name > 0);
    w->takes_name -= w->takes_name > 0;
    gui_space(gui, gap);
    if (key_list_button(gui, SHEET_START, "examination", "Examination: X-ray alone", START_KEY_EXAMINATION, 0, w->state->is_examination))
        w->state->is_examination = !w->state->is_examination;
    gui_space(gui, gap);
    draw_row_buttons(w);
    if (w->options->shelf->broken > 0) {
        snprintf(text, sizeof text, tr_n("%d session file cannot be read.", "%d session files cannot be read.", (unsigned long)w->options->shelf->broken),
                 w->options->shelf->broken);
        gui_text_wrapped(gui, GUI_SMALL, gui_colors.warning, text);
    }
    if (key_list_button(gui, SHEET_START, "leave", "Leave", START_KEY_LEAVE, 0, false))
        w->ends = true;
    gui_window_end(gui);
}

// What the chosen row is about.
static const char *about_row(const StartWindow *w, char *text, size_t capacity)
{
    if (w->state->page == PAGE_DEVICES && w->devices)
        return key_sheet_fill(SHEET_START, devices_page_about(w->devices, w->state->row), text, capacity);
    if (w->state->page == PAGE_SETTINGS)
        return settings_page_about(&w->settings, w->state->row);
    // texts of exercises name keys of the trainer
    return w->state->page == PAGE_CASES && w->state->row < row_count(w) ? key_table_fill(tr(w->options->shelf->cases[w->state->row].text), text, capacity) : "";
}

void start_draw(StartWindow *w, const WindowInput *input, unsigned framebuffer)
{
    const float width = (float)input->width, height = (float)input->height;
    // letters that leave room for the list
    const float k = fminf((float)input->scale, fminf(width / 760, height / 520)), side = floorf(300 * k), foot = floorf(height / 4);
    if (w->state->page == PAGE_CASES)
        load_pictures(w);
    if (w->state->page == PAGE_DEVICES && w->devices)
        devices_page_read(w->devices, w->state->row);
    gui_begin(w->gui, input, (double)k, false);
    draw_side(w, (GuiRect){0, 0, side, height});
    draw_list(w, (GuiRect){side, 0, width - side, height - foot});
    gui_window_begin(w->gui, "foot", (GuiRect){side, height - foot, width - side, foot}, 0);
    char about[1200];
    gui_text_wrapped(w->gui, GUI_SMALL, gui_colors.dim, key_sheet_fill(SHEET_START, tr(page_hint[w->state->page]), about, sizeof about));
    gui_text_wrapped(w->gui, GUI_NORMAL, gui_colors.text, w->message[0] ? w->message : about_row(w, about, sizeof about));
    gui_window_end(w->gui);
    gui_end(w->gui, framebuffer);
}

void start_open(StartWindow *w)
{
    const Shelf *shelf = w->options->shelf;
    settings_page_open(&w->settings);
    w->picture = calloc((size_t)shelf->case_count + 1, sizeof *w->picture);
    for (int i = 0; w->picture && i < shelf->case_count; i++)
        w->picture[i].file = case_picture_file(shelf->cases[i].path);
    if (w->state->page == PAGE_FILES)
        list_files(w);
    if (w->state->page == PAGE_DEVICES)
        look_at_devices(w);
}

void start_close(StartWindow *w)
{
    for (int i = 0; w->picture && i < w->options->shelf->case_count; i++) {
        free(w->picture[i].file);
        if (w->picture[i].texture)
            gui_texture_destroy(w->picture[i].texture);
    }
    free(w->picture);
    devices_page_close(w->devices);
    free(w->file);
}
