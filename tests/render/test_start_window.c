// The start window off screen: every page by keys alone, rebinding of keys, learning of a device's axes, letters doubled as a long translation, and the contrast
// of the theme. SELDINGER_PICTURES=FOLDER saves a picture of each page.
#include "render/case_picture.h"
#include "render/gl_canvas.h"
#include "render/gl_context.h"
#include "render/png_file.h"
#include "render/start_pages.h"
#include "render/translation.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>
#include <math.h>
#include <sys/stat.h>

#include "tests/input/fake_hid.h"

static char folder[] = "/tmp/seldinger-start-window-XXXXXX";
#include "tests/folder.h"
#include "tests/render/pseudo.h"

static GlContext *context;

static int begin(void **state)
{
    char message[256] = "";
    if (make_folder(state) != 0 || setenv("XDG_CONFIG_HOME", in_folder("config"), 1) != 0 || setenv("SELDINGER_CACHE", in_folder("cache"), 1) != 0)
        return 1;
    context = gl_context_create(message, sizeof message);
    if (!context)
        print_message("no EGL: %s\n", message);
    return 0;
}

static int end(void **state)
{
    gl_context_destroy(context);
    return remove_folder(state);
}

// ---- a shelf, a joystick

static ShelfCase cases[] = {
    {.path = "/nosuch/a.yaml", .title = "Reach the aneurysm", .text = "Bring the tip of the wire into the aneurysm.", .level = 1, .sessions = 3, .best = 87},
    {.path = "/nosuch/b.yaml", .title = "Exchange for a stiff wire", .text = "", .level = 5},
    {.path = "/nosuch/c", .title = "acase", .missing = "/nosuch/model.h5"},
};
static ShelfSession sessions[] = {
    {.path = "/nosuch/1.json", .recording = "/nosuch/1.h5", .trainee = "Ada", .title = "Reach the aneurysm", .date = "2026-11-28T09:00:00Z", .points = 87}};
static Shelf shelf = {.case_count = 3, .cases = cases, .session_count = 1, .session = sessions, .broken = 2};

// X, Y: 8 bits each, 0 to 255; 4 buttons
static const uint8_t joystick[] = {0x05, 0x01, 0x09, 0x04, 0xa1, 0x01, 0x15, 0x00, 0x26, 0xff, 0x00, 0x75, 0x08, 0x95, 0x01,
                                   0x09, 0x30, 0x81, 0x02, 0x09, 0x31, 0x81, 0x02, 0x05, 0x09, 0x19, 0x01, 0x29, 0x04, 0x15,
                                   0x00, 0x25, 0x01, 0x75, 0x01, 0x95, 0x04, 0x81, 0x02, 0x95, 0x04, 0x81, 0x01, 0xc0};

typedef struct StartStage {
    FakeHid hid;
    HidTransport transport;
    StartOptions options;
    StartState state;
    StartWindow window;
    GlCanvas canvas;
    WindowInput input;
} StartStage;

static StartStage *open_stage(int width, int height, double scale)
{
    char message[256] = "";
    if (!context)
        skip();
    StartStage *s = calloc(1, sizeof *s);
    assert_non_null(s);
    s->transport = fake_transport(&s->hid);
    fake_plug(&s->hid, 0, 0x1209, 0x0042, "A1", 0x00010004, joystick, sizeof joystick);
    s->options = (StartOptions){.shelf = &shelf, .message = "", .transport = &s->transport};
    snprintf(s->state.folder, sizeof s->state.folder, "%s", folder);
    s->window = (StartWindow){.options = &s->options, .state = &s->state, .gui = gui_create(message, sizeof message)};
    assert_non_null(s->window.gui);
    assert_true(gl_canvas_create(&s->canvas, width, height, 1, message, sizeof message));
    s->input = (WindowInput){.width = width, .height = height, .scale = scale, .mouse_x = -1, .mouse_y = -1, .has_focus = true};
    start_open(&s->window);
    return s;
}

static void close_stage(StartStage *s)
{
    start_close(&s->window);
    gui_destroy(s->window.gui);
    gl_canvas_destroy(&s->canvas);
    free(s);
}

static void key(StartStage *s, int code, unsigned modifiers)
{
    const WindowEvent event = {.kind = WINDOW_KEY_DOWN_EVENT, .key = code, .modifiers = modifiers};
    start_press(&s->window, &event);
}

static void draw(StartStage *s)
{
    for (int i = 0; i < 3; i++)      // sizes of contents are known from the frame before
        start_draw(&s->window, &s->input, s->canvas.framebuffer);
}

static void save_picture(StartStage *s, const char *name)
{
    const char *pictures = getenv("SELDINGER_PICTURES");
    if (!pictures)
        return;
    char path[400], message[200];
    size_t size = (size_t)s->input.width * (size_t)s->input.height * 3;
    uint8_t *rgb = malloc(size);
    gl_canvas_read(&s->canvas, rgb);
    snprintf(path, sizeof path, "%s/start-%s.png", pictures, name);
    assert_true(png_file_write(path, s->input.width, s->input.height, rgb, message, sizeof message));
    free(rgb);
}

// ---- tests

static void keys_reach_every_page(void **state)
{
    (void)state;
    static const char *const name[PAGES] = {"cases", "sessions", "files", "devices", "settings"};
    StartStage *s = open_stage(1280, 720, 1);
    put("a.nrrd", "NRRD0004\n");
    for (int page = 0; page < PAGES; page++) {
        assert_int_equal(s->state.page, page);
        key(s, WINDOW_KEY_DOWN, 0);
        draw(s);
        save_picture(s, name[page]);
        key(s, WINDOW_KEY_TAB, 0);
    }
    assert_int_equal(s->state.page, PAGE_CASES);
    key(s, WINDOW_KEY_TAB, WINDOW_SHIFT);
    assert_int_equal(s->state.page, PAGE_SETTINGS);
    key(s, WINDOW_KEY_END, 0);
    draw(s);
    save_picture(s, "settings-end");
    assert_int_equal(s->state.row, settings_page_rows() - 1);
    key(s, WINDOW_KEY_ESCAPE, 0);
    assert_true(s->window.ends);
    close_stage(s);
}

// `replay` takes a recording, `report` a session file.
static void a_session_is_replayed_and_reported(void **state)
{
    (void)state;
    StartStage *s = open_stage(1280, 720, 1);
    start_turn_page(&s->window, PAGE_SESSIONS);
    key(s, WINDOW_KEY_ENTER, 0);
    assert_int_equal(s->window.choice, START_REPLAY);
    assert_string_equal(s->state.path, "/nosuch/1.h5");
    key(s, 'R', 0);
    assert_int_equal(s->window.choice, START_REPORT);
    assert_string_equal(s->state.path, "/nosuch/1.json");
    close_stage(s);
}

static int row_of(ActionId id) { return settings_page_row_of(0, (int)id); }

static void a_key_is_given_refused_and_exchanged(void **state)
{
    (void)state;
    StartStage *s = open_stage(1280, 720, 1);
    SettingsPage *page = &s->window.settings;
    start_turn_page(&s->window, PAGE_SETTINGS);
    for (int i = 0; i < row_of(ACTION_DSA); i++)
        key(s, WINDOW_KEY_DOWN, 0);
    key(s, WINDOW_KEY_ENTER, 0);
    key(s, WINDOW_KEY_ALT, 0);
    key(s, 'Q', WINDOW_ALT);
    assert_true(page->settings.key[ACTION_DSA].key == 'Q' && page->settings.key[ACTION_DSA].modifiers == WINDOW_ALT);
    key(s, WINDOW_KEY_ENTER, 0);
    key(s, 'R', 0);                  // the roadmap's
    assert_int_equal(page->settings.key[ACTION_DSA].key, 'Q');
    assert_non_null(strstr(page->message, "Roadmap"));
    draw(s);
    save_picture(s, "clash");
    key(s, 'R', 0);
    assert_int_equal(page->settings.key[ACTION_DSA].key, 'R');
    assert_int_equal(page->settings.key[ACTION_ROADMAP].key, 'Q');
    key(s, WINDOW_KEY_ENTER, 0);
    key(s, WINDOW_KEY_ESCAPE, 0);    // leaves the key, not the window
    assert_false(s->window.ends);
    assert_true(settings_page_save(page));
    Settings kept;
    static Faults faults;
    assert_true(settings_load(&kept, &faults));
    assert_int_equal(kept.key[ACTION_ROADMAP].key, 'Q');
    // a key of another window, with Ctrl
    s->state.row = settings_page_row_of(1 + SHEET_CASE, CASE_KEY_UNDO);
    key(s, WINDOW_KEY_ENTER, 0);
    key(s, WINDOW_KEY_CTRL, WINDOW_CTRL);
    key(s, 'U', WINDOW_CTRL);
    assert_true(page->settings.sheet_key[SHEET_CASE][CASE_KEY_UNDO].key == 'U' && page->settings.sheet_key[SHEET_CASE][CASE_KEY_UNDO].modifiers == WINDOW_CTRL);
    s->state.row = settings_page_row_of(1 + SHEET_START, START_KEY_LEAVE);
    key(s, WINDOW_KEY_ENTER, 0);
    assert_non_null(strstr(page->message, "Esc remains"));
    draw(s);
    save_picture(s, "sheets");
    // values
    key(s, WINDOW_KEY_HOME, 0);
    key(s, WINDOW_KEY_LEFT, 0);
    key(s, WINDOW_KEY_LEFT, 0);
    assert_true(fabs(page->settings.speed.insertion - 0.8) < 1e-12);
    for (int i = 0; i < 60; i++)
        key(s, WINDOW_KEY_RIGHT, 0);
    assert_true(page->settings.speed.insertion == settings_speed_most);
    for (int i = 0; i < 3; i++)
        key(s, WINDOW_KEY_DOWN, 0);
    key(s, WINDOW_KEY_ENTER, 0);
    assert_true(page->settings.speed.insertion_inverted);
    for (int i = 0; i < 5; i++)
        key(s, WINDOW_KEY_DOWN, 0);
    key(s, WINDOW_KEY_ENTER, 0);     // restores everything
    assert_true(page->settings.speed.insertion == 1 && !page->settings.speed.insertion_inverted && page->settings.key[ACTION_DSA].key == 'T');
    settings_page_save(page);
    close_stage(s);
}

static void send(StartStage *s, uint8_t x, uint8_t y)
{
    fake_report(&s->hid, 0, (const uint8_t[]){x, y, 0}, 3);
    draw(s);
}

static void a_moved_axis_pushes(void **state)
{
    (void)state;
    StartStage *s = open_stage(1280, 720, 1);
    start_turn_page(&s->window, PAGE_DEVICES);
    draw(s);
    send(s, 128, 128);
    assert_true(devices_page_can_learn(s->window.devices, 0));
    key(s, 'P', 0);
    draw(s);
    save_picture(s, "learn");
    send(s, 190, 128);               // not far enough
    assert_true(devices_page_is_learning(s->window.devices));
    send(s, 250, 128);               // X rises
    assert_false(devices_page_is_learning(s->window.devices));
    draw(s);
    send(s, 128, 128);
    key(s, 'T', 0);
    send(s, 128, 5);                 // Y falls
    assert_false(devices_page_is_learning(s->window.devices));
    DeviceMap *map[4];
    static Faults faults;
    assert_int_equal(own_maps_load(map, 4, &faults), 1);
    assert_int_equal(map[0]->axis_count, 2);
    for (int i = 0; i < 2; i++) {
        const MapAxis *axis = &map[0]->axis[i];
        assert_int_equal(axis->source.usage, axis->is_twist ? 0x10031 : 0x10030);
        assert_int_equal(axis->invert, axis->is_twist);
    }
    free(map[0]);
    // the map applies at once: X pushes
    char left[300], right[200];
    devices_page_describe(s->window.devices, 0, left, right);
    assert_string_equal(right, "my map of 1209-0042");
    send(s, 255, 128);
    draw(s);
    save_picture(s, "learned");
    close_stage(s);
}

static void no_permission_is_explained(void **state)
{
    (void)state;
    StartStage *s = open_stage(1280, 720, 1);
    s->hid.device[0].may_not_open = true;
    start_turn_page(&s->window, PAGE_DEVICES);
    draw(s);
    assert_non_null(strstr(devices_page_about(s->window.devices, 0), "no permission"));
    assert_false(devices_page_can_learn(s->window.devices, 0));
    close_stage(s);
}

// Of one tool and of two; the vessel is brighter than the ground.
static void a_case_has_a_picture(void **state)
{
    (void)state;
    static const char *const name[] = {"aneurysm", "microcatheter"};
    static Faults faults;
    if (!context)
        skip();
    for (int i = 0; i < 2; i++) {
        char path[500];
        int width = 0, height = 0, bright = 0;
        snprintf(path, sizeof path, "%s/scenes/exercises/%s.yaml", SOURCE_DIR, name[i]);
        char *file = case_picture_file(path), *again = case_picture_file(path);
        assert_non_null(file);
        assert_string_equal(file, again);
        assert_null(case_picture_read(file, &width, &height));
        OpenVessel open = {0};
        Scene *scene = scene_load(path, &faults);
        bool good = scene && open_vessel(scene, &(OpenVesselOptions){.threads = 1}, &open, &faults) && open_vessel_inlet(scene, &open, &faults) &&
                    case_picture_draw(file, scene, &open, &faults);
        if (!good)
            fail_msg("%s", faults.text[0]);
        uint8_t *rgb = case_picture_read(file, &width, &height);
        assert_non_null(rgb);
        assert_true(width == CASE_PICTURE_WIDTH && height == CASE_PICTURE_HEIGHT);
        for (int k = 0; k < width * height; k++)
            bright += rgb[3 * k] > 60;
        assert_in_range(bright, width * height / 200, width * height / 2);
        free(rgb);
        free(file);
        free(again);
        open_vessel_close(&open);
        scene_free(scene);
    }
}

static void doubled_letters_are_not_cut(void **state)
{
    (void)state;
    static const struct {
        int width, height;
        double scale;
    } size[] = {{1280, 720, 1}, {800, 600, 1}, {1920, 1080, 1.5}, {1280, 720, 3}};
    translation_replace(pseudo_translation);
    for (size_t i = 0; i < sizeof size / sizeof *size; i++) {
        StartStage *s = open_stage(size[i].width, size[i].height, size[i].scale);
        for (int page = 0; page < PAGES; page++) {
            const char *first;
            char name[40];
            start_turn_page(&s->window, page);
            draw(s);
            snprintf(name, sizeof name, "doubled-%d-%zu", page, i);
            save_picture(s, name);
            if (gui_cut_texts(s->window.gui, &first) > 0)
                fail_msg("page %d at %d x %d: '%s' is cut off", page, size[i].width, size[i].height, first);
        }
        close_stage(s);
    }
    translation_replace(NULL);
}

static void a_cut_text_is_noticed(void **state)
{
    (void)state;
    StartStage *s = open_stage(1280, 720, 1);
    const char *first;
    gui_begin(s->window.gui, &s->input, 1, false);
    gui_window_begin(s->window.gui, "narrow", (GuiRect){0, 0, 100, 100}, 0);
    gui_button(s->window.gui, "a", "a label that is much wider than this", NULL, 40, false);
    gui_text(s->window.gui, GUI_NORMAL, gui_colors.text, "a line that is much wider than the window");
    gui_window_end(s->window.gui);
    gui_end(s->window.gui, s->canvas.framebuffer);
    assert_int_equal(gui_cut_texts(s->window.gui, &first), 2);
    assert_string_equal(first, "a label that is much wider than this");
    close_stage(s);
}

// ---- contrast: WCAG 2.1, 1.4.3 and 1.4.11

static double linear(int value)
{
    double c = value / 255.0;
    return c <= 0.03928 ? c / 12.92 : pow((c + 0.055) / 1.055, 2.4);
}

static double luminance(Color c) { return 0.2126 * linear(c.r) + 0.7152 * linear(c.g) + 0.0722 * linear(c.b); }

static double contrast(Color a, Color b)
{
    double x = luminance(a), y = luminance(b);
    return (fmax(x, y) + 0.05) / (fmin(x, y) + 0.05);
}

static void the_theme_has_contrast(void **state)
{
    (void)state;
    const GuiContrast *pair;
    int count = gui_contrasts(&pair);
    assert_true(fabs(contrast((Color){255, 255, 255, 255}, (Color){0, 0, 0, 255}) - 21) < 1e-9);
    assert_true(count > 15);
    for (int i = 0; i < count; i++) {
        double ratio = contrast(pair[i].front, pair[i].back);
        print_message("%-26s %5.2f, at least %.1f\n", pair[i].what, ratio, pair[i].least);
        if (ratio < pair[i].least)
            fail_msg("%s: contrast %.2f, at least %.1f", pair[i].what, ratio, pair[i].least);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(keys_reach_every_page),
        cmocka_unit_test(a_key_is_given_refused_and_exchanged),
        cmocka_unit_test(a_session_is_replayed_and_reported),
        cmocka_unit_test(a_moved_axis_pushes),
        cmocka_unit_test(no_permission_is_explained),
        cmocka_unit_test(a_case_has_a_picture),
        cmocka_unit_test(doubled_letters_are_not_cut),
        cmocka_unit_test(a_cut_text_is_noticed),
        cmocka_unit_test(the_theme_has_contrast),
    };
    return cmocka_run_group_tests(tests, begin, end);
}
