// The panel off screen: layout at every size, mouse actions on buttons and views, dialogues, typed names, and the cost of a frame. SELDINGER_PICTURES=FOLDER
// saves a picture of each size and state.
#include "render/gl_canvas.h"
#include "render/gl_context.h"
#include "render/panel.h"
#include "render/panel_internal.h"
#include "render/panel_tray.h"
#include "render/png_file.h"
#include "render/tick_step.h"
#include "render/translation.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>
#include <epoxy/gl.h>
#include <math.h>
#include <time.h>

#include "tests/render/pseudo.h"

static GlContext *context;

static int open_gl(void **state)
{
    (void)state;
    char message[256] = "";
    context = gl_context_create(message, sizeof message);
    if (!context)
        print_message("no EGL: %s\n", message);
    return 0;
}

static int close_gl(void **state)
{
    (void)state;
    gl_context_destroy(context);
    return 0;
}

// ---- an artificial state

static const PanelFigure figures[] = {
    {"Time", 83.4, "s", 1, MARK_NONE},           {"Fluoroscopy", 41.2, "s", 1, MARK_GOOD},     {"Contrast", 12.5, "ml", 1, MARK_WARNING},
    {"Path efficiency", 0.83, "", 2, MARK_GOOD}, {"Wall force, peak", 412, "mN", 0, MARK_BAD}, {"Distance to target", NAN, "mm", 1, MARK_NONE}};
static const char *const errors[] = {"1:02 wrong branch: left vertebral", "1:17 tip force above 300 mN"};
static const PanelDevice devices[] = {{"Keyboard", HAND_READY, NULL},
                                      {"Logitech Extreme 3D", HAND_READY, "y push, z twist, trigger pedal"},
                                      {"Roller encoder", HAND_LOST, "unplugged at 1:20; the tool stands still"}};

static PanelState some_state(void)
{
    return (PanelState){.now_s = 90,
                        .time_s = 83.4,
                        .title = "Reach the aneurysm",
                        .trainee = "A. Müller",
                        .instructions = "Bring the tip from the internal carotid into the aneurysm and hold it there for two seconds. Do not enter the "
                                        "posterior communicating artery.",
                        .target = "aneurysm",
                        .hold_s = 1.2,
                        .hold_needed_s = 2,
                        .figure_count = 6,
                        .figure = figures,
                        .error_count = 2,
                        .error = errors,
                        .tool_count = 1,
                        .tool = {{.name = "wire",
                                  .what = "0.014\" guidewire, J tip, 200 elements",
                                  .inserted_mm = 120.4,
                                  .turned_deg = -35,
                                  .push_mm_s = 12,
                                  .twist_deg_s = -40,
                                  .force_n = 0.061,
                                  .torque_n_mm = 0.0123}},
                        .wall_max_n = 0.18,
                        .wall_sum_n = 0.93,
                        .xray = {.pedal = 1, .pulses_s = 15, .lao_deg = 30, .cra_deg = -10, .field_mm = 160, .collimator = {0.1f, 0.2f, 0, 0.3f}},
                        .mode = PANEL_LIVE,
                        .fluoro_s = 41.2,
                        .contrast_ml = 12.5,
                        .cine_frame = 11,
                        .cine_frames = 120,
                        .view = VIEW_FLUOROSCOPY,
                        .is_following = true,
                        .step_median_us = 182,
                        .step_p999_us = 403,
                        .real_time_factor = 1,
                        .frame_ms = 9.1,
                        .missed_deadlines = 3,
                        .device_count = 3,
                        .device = devices};
}

static WindowInput still_input(int width, int height, double scale)
{
    return (WindowInput){.width = width, .height = height, .scale = scale, .mouse_x = -1, .mouse_y = -1, .has_focus = true};
}

static Panel *new_panel(void)
{
    char message[256] = "";
    Panel *panel = panel_create(message, sizeof message);
    assert_non_null(panel);
    for (int i = 0; i < 2000; i++)   // 20 s of samples
        panel_sample(panel, 0, 63.4 + 0.01 * i, 0.06 + 0.05 * sin(0.02 * i) + (i == 700 ? 0.2 : 0), 0.02 * sin(0.013 * i), 0.1 + 0.08 * cos(0.01 * i));
    panel_message(panel, 12, MARK_NONE, "Session starts: phantom, 0.014\" guidewire");
    panel_message(panel, 62, MARK_BAD, "Wrong branch: left vertebral");
    panel_message(panel, 80, MARK_WARNING, "Roller encoder lost: unplugged");
    return panel;
}

// Fills the views with grey as pictures would, then draws the panel.
static void draw(Panel *panel, const GlCanvas *canvas, const WindowInput *input, const PanelState *state)
{
    const float black[3] = {0, 0, 0};
    gl_canvas_begin(canvas, black);
    PanelLayout layout = panel_layout(input->width, input->height, input->scale, state->view, panel_has_panels(panel));
    glEnable(GL_SCISSOR_TEST);
    for (int i = 0; i < VIEW_COUNT; i++) {
        ViewPort v = layout.view[i];
        glScissor(v.x, v.y, v.width, v.height);
        glClearColor(i == 0 ? 0.7f : 0.1f, i == 0 ? 0.7f : 0.11f, i == 0 ? 0.7f : 0.14f, 1);
        glClear(GL_COLOR_BUFFER_BIT);
    }
    glDisable(GL_SCISSOR_TEST);
    panel_draw(panel, input, state, canvas->framebuffer);
}

static void keep_picture(const GlCanvas *canvas, const char *name)
{
    const char *folder = getenv("SELDINGER_PICTURES");
    if (!folder)
        return;
    char path[512];
    snprintf(path, sizeof path, "%s/panel-%s.png", folder, name);
    uint8_t *rgb = malloc((size_t)canvas->width * (size_t)canvas->height * 3);
    assert_non_null(rgb);
    gl_canvas_read(canvas, rgb);
    assert_true(png_file_write(path, canvas->width, canvas->height, rgb, NULL, 0));
    free(rgb);
}

static GlCanvas new_canvas(int width, int height)
{
    GlCanvas canvas;
    char message[256] = "";
    assert_true(gl_canvas_create(&canvas, width, height, 1, message, sizeof message));
    return canvas;
}

static void pictures_at_all_sizes(void **unused)
{
    (void)unused;
    if (!context)
        skip();
    static const struct {
        int width, height;
        double scale;
        PanelView view;
        const char *name;
    } size[] = {{1280, 720, 1, VIEW_FLUOROSCOPY, "1280x720"},     {1024, 600, 1, VIEW_FLUOROSCOPY, "1024x600"}, {1920, 1080, 1, VIEW_3D, "1920x1080"},
                {2560, 1440, 2, VIEW_FLUOROSCOPY, "2560x1440@2"}, {1280, 720, 1, VIEW_ALL, "all-views"},        {2560, 1440, 1, VIEW_ALL, "2560x1440"}};
    for (size_t i = 0; i < sizeof size / sizeof size[0]; i++) {
        GlCanvas canvas = new_canvas(size[i].width, size[i].height);
        WindowInput input = still_input(size[i].width, size[i].height, size[i].scale);
        PanelState state = some_state();
        state.view = size[i].view;
        if (i == 1)
            state.warnings = WARN_SLOW | WARN_NO_FIFO | WARN_DEVICE_LOST;
        state.is_finished = i == 3;
        Panel *panel = new_panel();
        draw(panel, &canvas, &input, &state);
        keep_picture(&canvas, size[i].name);
        assert_int_equal(glGetError(), GL_NO_ERROR);
        panel_show_help(panel, true);
        draw(panel, &canvas, &input, &state);
        char name[64];
        snprintf(name, sizeof name, "%s-help", size[i].name);
        keep_picture(&canvas, name);
        panel_destroy(panel);
        gl_canvas_destroy(&canvas);
    }
}

// ---- layout

static bool overlap(PanelRect a, PanelRect b) { return a.x < b.x + b.width && b.x < a.x + a.width && a.y < b.y + b.height && b.y < a.y + a.height; }

// Any window, density and view: everything inside, no overlaps, the main view is the largest, letters have at least 11 pixels.
static void nothing_overlaps_at_any_size(void **unused)
{
    (void)unused;
    static const double scales[] = {1, 1.25, 1.5, 2, 3};
    for (int width = 640; width <= 3840; width += 71)
        for (int height = 400; height <= 2160; height += 53)
            for (int i = 0; i < 5 * 5 * 2; i++) {
                const int which = i / 2 % 5;         // the last: the X-ray image alone
                const PanelView view = which < 4 ? (PanelView)which : VIEW_FLUOROSCOPY;
                bool has_panels = i % 2;
                PanelLayout l = which < 4 ? panel_layout(width, height, scales[i / 10], view, has_panels)
                                          : panel_layout_xray_alone(width, height, scales[i / 10], has_panels);
                assert_true(which < 4 || (l.view[VIEW_3D].width == 0 && l.view[VIEW_ANGIOSCOPY].width == 0));
                assert_true(l.scale >= 0.75 && (width < 1024 || height < 600 || l.scale >= 0.85));
                PanelRect rect[VIEW_COUNT + 4] = {l.view_rect[0], l.view_rect[1], l.view_rect[2], l.top, l.left, l.right, l.bottom};
                for (int a = 0; a < VIEW_COUNT + 4; a++) {
                    assert_true(rect[a].x >= 0 && rect[a].y >= 0 && rect[a].x + rect[a].width <= (float)width && rect[a].y + rect[a].height <= (float)height);
                    for (int b = 0; b < a; b++)
                        if (overlap(rect[a], rect[b]))
                            fail_msg("%d and %d overlap at %dx%d, view %d", a, b, width, height, view);
                }
                for (int v = 0; v < VIEW_COUNT; v++) {
                    ViewPort p = l.view[v];
                    assert_true((float)p.x == rect[v].x && (float)p.width == rect[v].width && (float)p.height == rect[v].height);
                    assert_true((float)(height - p.y - p.height) == rect[v].y || p.width == 0);
                    assert_true(p.width * p.height <= l.view[l.main].width * l.view[l.main].height);
                }
                bool is_usual = has_panels && width >= 1024 && height >= 600 && scales[i / 10] * 1024 <= width && scales[i / 10] * 600 <= height;
                assert_true(!is_usual || l.right.height >= (float)(250 * l.scale));   // room for the longest tab
                assert_true(!is_usual || l.view[l.main].width * l.view[l.main].height * 6 > width * height);
            }
}

// ---- plots

static void plots_keep_every_peak_and_forget_after_their_span(void **unused)
{
    (void)unused;
    RunningPlot plot;
    double least, most;
    plot_clear(&plot);
    assert_false(plot_range(&plot, &least, &most));
    for (int i = 0; i < 5000; i++)   // 50 s; one peak up and one down, each a single sample
        plot_add(&plot, 0.01 * i, i == 3500 ? 9 : i == 4000 ? -4 : 1);
    assert_true(plot_range(&plot, &least, &most));
    assert_true(least == -4 && most == 9);
    for (int i = 5000; i < 5600; i++)   // 3500 is 21 s ago now, 4000 is 16
        plot_add(&plot, 0.01 * i, 1);
    assert_true(plot_range(&plot, &least, &most));
    assert_true(least == -4 && most == 1);
    plot_add(&plot, 56, NAN);   // NaN is left out
    plot_add(&plot, INFINITY, 1);
    assert_true(plot_range(&plot, &least, &most) && least == -4 && most == 1);
    plot_add(&plot, 5, 2);   // a restart
    assert_true(plot_range(&plot, &least, &most) && least == 2 && most == 2 && plot.count == 1);
    plot_add(&plot, 500, 3);   // a jump
    assert_true(plot_range(&plot, &least, &most) && least == 3 && most == 3 && plot.count == 1);
}

static void ticks_are_round(void **unused)
{
    (void)unused;
    for (double span = 1e-6; span < 1e6; span *= 1.07)
        for (int ticks = 2; ticks <= 6; ticks++) {
            double step = tick_step(span, ticks), mantissa = step / pow(10, floor(log10(step) + 1e-9));
            assert_true(fabs(mantissa - 1) < 1e-9 || fabs(mantissa - 2) < 1e-9 || fabs(mantissa - 5) < 1e-9);
            assert_true(span / step <= ticks * (1 + 1e-9) && span / step * 2.5 > ticks * (1 - 1e-9));
        }
}

// ---- the mouse

typedef struct OperatorControls {            // a panel, its canvas, and the resulting actions
    Panel *panel;
    GlCanvas canvas;
    WindowInput input;
    PanelState state;
    PanelActions actions;
} OperatorControls;

static OperatorControls new_controls(int width, int height)
{
    OperatorControls controls = {.panel = new_panel(), .canvas = new_canvas(width, height), .input = still_input(width, height, 1), .state = some_state()};
    draw(controls.panel, &controls.canvas, &controls.input, &controls.state);
    return controls;
}

static void end_controls(OperatorControls *controls)
{
    panel_destroy(controls->panel);
    gl_canvas_destroy(&controls->canvas);
}

static void frame(OperatorControls *controls)
{
    panel_take_input(controls->panel, &controls->input, &controls->actions);
    draw(controls->panel, &controls->canvas, &controls->input, &controls->state);
    controls->input.event_count = 0;
    controls->input.close = WINDOW_OPEN;
}

static void add_event(OperatorControls *controls, WindowEvent event) { controls->input.event[controls->input.event_count++] = event; }

static void tap(OperatorControls *controls, int key)
{
    add_event(controls, (WindowEvent){.kind = WINDOW_KEY_DOWN_EVENT, .key = key});
    add_event(controls, (WindowEvent){.kind = WINDOW_KEY_UP_EVENT, .key = key});
    frame(controls);
}

// Moves there, presses and releases; adds the requested actions to `seen`, which has an entry for each action.
static void click(OperatorControls *controls, double x, double y, bool *seen)
{
    controls->input.mouse_x = x;
    controls->input.mouse_y = y;
    for (int i = 0; i < 3; i++) {
        controls->input.mouse_buttons = i < 2 ? WINDOW_MOUSE_LEFT : 0;
        frame(controls);
        for (int action = 0; action < ACTION_COUNT; action++)
            seen[action] = seen[action] || controls->actions.held[action] || controls->actions.pressed[action] > 0;
        if (i == 2)   // released: nothing is held except the speed, which a click latches
            for (int action = 0; action < ACTION_COUNT; action++)
                assert_true(!controls->actions.held[action] || action == ACTION_FAST || action == ACTION_SLOW);
    }
}

// Clicks on every tab and then at all its positions: every action must be reachable by mouse alone.
static void every_action_has_a_button_that_works(void **unused)
{
    (void)unused;
    if (!context)
        skip();
    OperatorControls controls = new_controls(1024, 600);
    PanelRect right = controls.panel->layout.right;
    float s = (float)controls.panel->layout.scale;
    bool seen[ACTION_COUNT] = {false};
    int dialogues = 0, helps = 0, hidden = 0, xray_sets = 0;
    controls.state.tool_count = PANEL_TOOLS;
    for (int tab = 0; tab < 5; tab++) {
        bool ignored[ACTION_COUNT] = {false};
        click(&controls, right.x + 10 * s + (float)(tab + 0.35) * 45 * s, right.y + 16 * s, ignored);
        char name[32];
        snprintf(name, sizeof name, "tab%d", tab);
        keep_picture(&controls.canvas, name);
        for (float y = right.y + 40 * s; y < right.y + right.height; y += 20 * s)
            for (float x = right.x + 14 * s; x < right.x + right.width - 8 * s; x += 40 * s) {
                click(&controls, x, y, seen);
                xray_sets += controls.actions.xray_set;
                // opened boxes are closed again
                if (panel_is_asking(controls.panel)) {
                    dialogues |= 1 << controls.panel->dialogue;
                    tap(&controls, WINDOW_KEY_ESCAPE);
                    assert_false(panel_is_asking(controls.panel));
                    assert_int_equal(controls.actions.pressed[ACTION_QUIT], 0);
                }
                helps += controls.panel->has_help;
                panel_show_help(controls.panel, false);
                hidden += !controls.panel->has_panels;
                controls.panel->has_panels = true;
            }
    }
    seen[ACTION_QUIT] = seen[ACTION_QUIT] || (dialogues >> DIALOGUE_QUIT & 1);
    seen[ACTION_RESTART] = seen[ACTION_RESTART] || (dialogues >> DIALOGUE_RESTART & 1);
    for (int action = 0; action < ACTION_COUNT; action++)
        if (!seen[action])
            fail_msg("no button does \"%s\"", key_table[action].name);
    assert_true(dialogues >> DIALOGUE_TRAINEE & 1);
    assert_true(helps > 0 && hidden > 0);
    end_controls(&controls);
}

// A translation that is twice as long: on every tab no label and no figure is cut off. (Names of tabs are shortened by dots.)
static void doubled_letters_are_not_cut(void **unused)
{
    (void)unused;
    if (!context)
        skip();
    translation_replace(pseudo_translation);
    OperatorControls controls = new_controls(1280, 720);
    PanelRect right = controls.panel->layout.right;
    float s = (float)controls.panel->layout.scale;
    for (int tab = 0; tab < 5; tab++) {
        bool ignored[ACTION_COUNT] = {false};
        const char *first;
        char name[32];
        click(&controls, right.x + 10 * s + (float)(tab + 0.35) * 45 * s, right.y + 16 * s, ignored);
        frame(&controls);
        snprintf(name, sizeof name, "doubled%d", tab);
        keep_picture(&controls.canvas, name);
        if (gui_cut_texts(controls.panel->gui, &first) > 0)
            fail_msg("tab %d: '%s' is cut off", tab, first);
    }
    end_controls(&controls);
    translation_replace(NULL);
}

// ---- the tray

static PanelTrayDevice tray_device[3];
static const PanelTray some_tray = {.tool = "wire",
                                    .note = "'wire' is still inserted: pull it back 312 mm, to the hub; then another can be inserted",
                                    .device_count = 3,
                                    .device = tray_device};

static void fill_tray(void)
{
    static const char *const name[] = {"0.014 inch wire, steel core", "0.014 inch wire, nitinol core", "0.014 inch wire, steel core, tip shaped to 45\u00b0"};
    for (int i = 0; i < 3; i++) {
        PanelTrayDevice *device = &tray_device[i];
        *device = (PanelTrayDevice){.name = name[i],
                                    .what = "wire, steel core, 0.356 mm thick, 1900 mm long",
                                    .is_in = i == 0,
                                    .can_be_shaped = i != 1,
                                    .point_count = TRAY_POINTS,
                                    .step_count = 3,
                                    .end_mm = {1650, 1850, 1900},
                                    .bending_n_mm2 = {158, 40, 0.5}};
        for (int k = 0; k < TRAY_POINTS; k++) {
            device->point[k][0] = 0.2 * k;
            device->point[k][1] = i * fmax(0, 0.1 * k - 10);
        }
    }
    tray_device[0].remark = "Bent by 87\u00b0 round the mandrel it springs back to 55\u00b0, with a radius of 1.9 mm";
}

static void the_tray_fits_at_any_size(void **unused)
{
    (void)unused;
    if (!context)
        skip();
    fill_tray();
    static const struct {
        int width, height;
        double scale;
    } size[] = {{800, 600, 1}, {1024, 600, 1}, {1280, 720, 1}, {1920, 1080, 1}, {2560, 1440, 2}};
    for (size_t i = 0; i < sizeof size / sizeof size[0]; i++) {
        OperatorControls controls = new_controls(size[i].width, size[i].height);
        controls.input.scale = size[i].scale;
        controls.state.tray = &some_tray;
        panel_open_tray(controls.panel, 3, 0);
        frame(&controls);
        frame(&controls);
        char name[40];
        snprintf(name, sizeof name, "tray-%dx%d", size[i].width, size[i].height);
        keep_picture(&controls.canvas, name);
        if (controls.panel->tray_over > 0)
            fail_msg("%d x %d: the tray is %.0f pixels too high", size[i].width, size[i].height, (double)controls.panel->tray_over);
        assert_int_equal(glGetError(), GL_NO_ERROR);
        end_controls(&controls);
    }
}

static void keys_choose_shape_and_take_from_the_tray(void **unused)
{
    (void)unused;
    if (!context)
        skip();
    fill_tray();
    OperatorControls controls = new_controls(1024, 600);
    controls.state.tray = &some_tray;
    tap(&controls, 'X');
    assert_int_equal(controls.actions.pressed[ACTION_EXCHANGE], 1);      // the caller opens it, or gives the reason if it does not
    assert_false(panel_is_asking(controls.panel));
    panel_open_tray(controls.panel, 3, 0);
    tap(&controls, WINDOW_KEY_DOWN);
    assert_true(controls.actions.tray.is_open && controls.actions.tray.device == 1 && !controls.actions.held[ACTION_PULL]);
    tap(&controls, WINDOW_KEY_UP);
    for (int i = 0; i < 2; i++)          // in one frame
        add_event(&controls, (WindowEvent){.kind = WINDOW_KEY_DOWN_EVENT, .key = WINDOW_KEY_DOWN});
    frame(&controls);
    assert_int_equal(controls.actions.tray.device, 2);
    tap(&controls, WINDOW_KEY_UP);
    tap(&controls, WINDOW_KEY_UP);
    tap(&controls, WINDOW_KEY_UP);
    assert_int_equal(controls.actions.tray.device, 0);
    assert_false(controls.actions.tray.is_shaped);
    double angle = controls.actions.tray.angle_deg;
    const double length = controls.actions.tray.length_mm, mandrel = controls.actions.tray.mandrel_mm;
    tap(&controls, WINDOW_KEY_PAGE_UP);
    tap(&controls, WINDOW_KEY_PAGE_UP);
    tap(&controls, WINDOW_KEY_PAGE_DOWN);
    for (int i = 0; i < 20; i++)
        tap(&controls, WINDOW_KEY_HOME);
    assert_true(controls.actions.tray.length_mm == length + 1 && fabs(controls.actions.tray.mandrel_mm - 0.3) < 1e-6);
    for (int i = 0; i < 7; i++)
        tap(&controls, WINDOW_KEY_END);
    assert_true(fabs(controls.actions.tray.mandrel_mm - mandrel) < 1e-6);
    tap(&controls, 'S');
    tap(&controls, WINDOW_KEY_RIGHT);
    assert_true(controls.actions.tray.is_shaped && controls.actions.tray.angle_deg == angle + 5 && controls.actions.held[ACTION_TWIST_RIGHT] == 0);
    tap(&controls, WINDOW_KEY_ENTER);
    assert_true(controls.actions.tray.is_taken && controls.actions.tray.is_open && controls.actions.tray.device == 0 && controls.actions.tray.is_shaped);
    frame(&controls);
    assert_false(controls.actions.tray.is_taken);
    tap(&controls, WINDOW_KEY_DOWN);
    assert_false(controls.actions.tray.is_shaped);               // the other device is unchanged
    tap(&controls, 'S');
    frame(&controls);
    assert_false(controls.actions.tray.is_shaped);               // and cannot be shaped
    tap(&controls, 'X');
    assert_false(controls.actions.tray.is_open || panel_is_asking(controls.panel));
    panel_open_tray(controls.panel, 3, 0);
    tap(&controls, WINDOW_KEY_ESCAPE);
    assert_false(controls.actions.tray.is_open || panel_is_asking(controls.panel));
    assert_int_equal(controls.actions.pressed[ACTION_QUIT], 0);
    end_controls(&controls);
}

static void the_mouse_chooses_on_the_tray(void **unused)
{
    (void)unused;
    if (!context)
        skip();
    fill_tray();
    OperatorControls controls = new_controls(800, 600);
    controls.state.tray = &some_tray;
    panel_open_tray(controls.panel, 3, 0);
    frame(&controls);
    bool chosen[3] = {false}, taken = false, shaped = false, closed = false;
    for (float y = 10; y < 590; y += 14)
        for (float x = 40; x < 790; x += 100) {
            if (!panel_is_asking(controls.panel))
                panel_open_tray(controls.panel, 3, 0);
            controls.input.mouse_x = x;
            controls.input.mouse_y = y;
            for (int i = 0; i < 3; i++) {
                controls.input.mouse_buttons = i < 2 ? WINDOW_MOUSE_LEFT : 0;
                frame(&controls);
                taken |= controls.actions.tray.is_taken;
                shaped |= controls.actions.tray.is_shaped;
                chosen[controls.actions.tray.device] = true;
                closed |= !panel_is_asking(controls.panel);
            }
        }
    assert_true(chosen[0] && chosen[1] && chosen[2] && taken && shaped && closed);
    end_controls(&controls);
}

static void words_do_not_lie_on_words(void **unused)
{
    (void)unused;
    srand(3);
    for (int round = 0; round < 200; round++) {
        GuiRect taken[24];
        for (int i = 0; i < 24; i++) {
            GuiRect wanted = {(float)(rand() % 60), (float)(rand() % 40), (float)(20 + rand() % 80), 15};
            taken[i] = panel_free_place(wanted, taken, i);
            assert_true(taken[i].x == wanted.x && taken[i].width == wanted.width);
            for (int j = 0; j < i; j++)
                assert_true(taken[i].y + 15 <= taken[j].y || taken[j].y + 15 <= taken[i].y || taken[i].x + taken[i].width <= taken[j].x ||
                            taken[j].x + taken[j].width <= taken[i].x);
        }
    }
    // without others it has its preferred position
    const GuiRect far = {500, 500, 50, 15}, wanted = {10, 20, 30, 15};
    assert_true(panel_free_place(wanted, &far, 1).y == 20);
}

// The log shows its newest message even if it has more of them than lines.
static void the_newest_message_is_seen(void **unused)
{
    (void)unused;
    if (!context)
        skip();
    size_t bytes = (size_t)1024 * 600 * 3;
    uint8_t *rgb[2] = {malloc(bytes), malloc(bytes)};
    assert_true(rgb[0] && rgb[1]);
    for (int i = 0; i < 2; i++) {
        OperatorControls controls = new_controls(1024, 600);
        for (int k = 0; k < 30; k++) {
            panel_message(controls.panel, 90, MARK_NONE, k < 29 || i == 0 ? "one of many" : "the newest");
            frame(&controls);
        }
        frame(&controls);
        frame(&controls);
        gl_canvas_read(&controls.canvas, rgb[i]);
        if (i == 1)
            keep_picture(&controls.canvas, "log");
        end_controls(&controls);
    }
    assert_memory_not_equal(rgb[0], rgb[1], bytes);
    free(rgb[0]);
    free(rgb[1]);
}

// A tooltip names the key once the mouse has rested, and disappears when the mouse moves.
static void a_tooltip_names_the_key(void **unused)
{
    (void)unused;
    if (!context)
        skip();
    OperatorControls controls = new_controls(1280, 720);
    PanelRect right = controls.panel->layout.right;
    size_t bytes = (size_t)1280 * 720 * 3;
    uint8_t *rgb[2] = {malloc(bytes), malloc(bytes)};
    assert_true(rgb[0] && rgb[1]);
    controls.input.mouse_x = right.x + right.width / 2;
    controls.input.mouse_y = right.y + 42 * controls.panel->layout.scale;
    for (int i = 0; i < 6; i++)   // hot, but not for long enough
        frame(&controls);
    gl_canvas_read(&controls.canvas, rgb[0]);
    for (int i = 0; i < 15; i++)
        frame(&controls);
    keep_picture(&controls.canvas, "tooltip");
    gl_canvas_read(&controls.canvas, rgb[1]);
    assert_memory_not_equal(rgb[0], rgb[1], bytes);
    controls.input.mouse_x = controls.input.mouse_y = -1;
    for (int i = 0; i < 5; i++)
        frame(&controls);
    gl_canvas_read(&controls.canvas, rgb[1]);
    for (size_t i = 0; i < bytes; i++)   // the button is no longer hot: everything else is unchanged
        if (rgb[0][i] != rgb[1][i]) {
            size_t x = i / 3 % 1280, y = i / 3 / 1280;
            assert_true((float)x >= right.x && (float)y >= right.y && (float)y < right.y + 70 * (float)controls.panel->layout.scale);
        }
    free(rgb[0]);
    free(rgb[1]);
    end_controls(&controls);
}

static void views_are_chosen_turned_and_scrolled_by_mouse(void **unused)
{
    (void)unused;
    if (!context)
        skip();
    OperatorControls controls = new_controls(1280, 720);
    PanelRect main = controls.panel->layout.view_rect[VIEW_FLUOROSCOPY], inset = controls.panel->layout.view_rect[VIEW_3D];
    bool seen[ACTION_COUNT] = {false};
    click(&controls, inset.x + inset.width / 2, inset.y + inset.height / 2, seen);
    for (int i = 0; i < ACTION_COUNT; i++)
        assert_int_equal(seen[i], i == ACTION_VIEW_3D);
    // a drag that begins in a view stays with it, also beyond its edge
    controls.input.mouse_x = main.x + 0.25 * main.width;
    controls.input.mouse_y = main.y + 0.75 * main.height;
    controls.input.mouse_buttons = WINDOW_MOUSE_RIGHT;
    frame(&controls);
    assert_int_equal(controls.actions.mouse.view, VIEW_FLUOROSCOPY);
    assert_true(fabs(controls.actions.mouse.x - 0.25) < 1e-9 && fabs(controls.actions.mouse.y - 0.25) < 1e-6);
    assert_int_equal(controls.actions.mouse.buttons, WINDOW_MOUSE_RIGHT);
    assert_true(controls.actions.mouse.drag_x == 0 && controls.actions.mouse.drag_y == 0);
    controls.input.mouse_x -= 0.5 * main.height;   // out into the left column
    controls.input.mouse_y -= 0.1 * main.height;
    frame(&controls);
    assert_int_equal(controls.actions.mouse.view, VIEW_FLUOROSCOPY);
    assert_true(fabs(controls.actions.mouse.drag_x + 0.5) < 1e-6 && fabs(controls.actions.mouse.drag_y - 0.1) < 1e-6);
    controls.input.mouse_buttons = 0;
    frame(&controls);
    assert_int_equal(controls.actions.mouse.view, -1);
    // a press that began on the panel never becomes a drag in a view
    controls.input.mouse_buttons = WINDOW_MOUSE_LEFT;
    frame(&controls);
    controls.input.mouse_x = main.x + 0.5 * main.width;
    frame(&controls);
    assert_int_equal(controls.actions.mouse.buttons, 0);
    controls.input.mouse_buttons = 0;
    add_event(&controls, (WindowEvent){.kind = WINDOW_SCROLL_EVENT, .scroll_y = -2});
    frame(&controls);
    assert_true(controls.actions.mouse.view == VIEW_FLUOROSCOPY && controls.actions.mouse.scroll == -2);
    end_controls(&controls);
}

static void a_button_lets_go_when_the_focus_goes(void **unused)
{
    (void)unused;
    if (!context)
        skip();
    OperatorControls controls = new_controls(1280, 720);
    PanelRect right = controls.panel->layout.right;
    controls.input.mouse_x = right.x + right.width / 2;
    controls.input.mouse_y = right.y + 42 * controls.panel->layout.scale;
    controls.input.mouse_buttons = WINDOW_MOUSE_LEFT;
    frame(&controls);
    frame(&controls);
    assert_true(controls.actions.held[ACTION_PUSH]);
    controls.input.has_focus = false;
    frame(&controls);
    assert_false(controls.actions.held[ACTION_PUSH]);
    end_controls(&controls);
}

static void names_are_typed_and_trimmed(void **unused)
{
    (void)unused;
    if (!context)
        skip();
    OperatorControls controls = new_controls(1024, 600);
    tap(&controls, WINDOW_KEY_F1 + 2);
    assert_true(panel_is_asking(controls.panel));
    frame(&controls);
    static const unsigned typed[] = {' ', 'J', 0xfc, 'r', 'g', ' ', 'f', ' '};   // Jürg f
    for (size_t i = 0; i < sizeof typed / sizeof typed[0]; i++) {
        add_event(&controls, (WindowEvent){.kind = WINDOW_TEXT_EVENT, .character = typed[i]});
        if (typed[i] == 'f')
            add_event(&controls, (WindowEvent){.kind = WINDOW_KEY_DOWN_EVENT, .key = 'F'});
        frame(&controls);
        assert_false(controls.actions.held[ACTION_PEDAL]);
    }
    keep_picture(&controls.canvas, "trainee");
    tap(&controls, WINDOW_KEY_ENTER);
    for (int i = 0; i < 3 && !controls.actions.trainee_set; i++)
        frame(&controls);
    assert_true(controls.actions.trainee_set);
    assert_string_equal(controls.actions.trainee, "J\u00fcrg f");
    assert_false(panel_is_asking(controls.panel));
    end_controls(&controls);
}

static void broken_lines_are_joined(void **unused)
{
    (void)unused;
    static const struct {
        const char *from, *to;
    } text[] = {{"", ""},
                {"\n\n", ""},
                {"One.", "One."},
                {"One.\nTwo", "One.\nTwo"},
                {"one\ntwo\n", "one two"},
                {"along the\n   outside", "along the outside"},
                {"Do:\n1. this\n   and that\n2. more", "Do:\n1. this and that\n2. more"},
                {"a\n\nb", "a\n\nb"},
                {"a\n- b", "a\n- b"}};
    char out[64];
    for (size_t i = 0; i < sizeof text / sizeof text[0]; i++) {
        panel_reflow(text[i].from, out, sizeof out);
        assert_string_equal(out, text[i].to);
    }
    panel_reflow("more than fits", out, 5);
    assert_string_equal(out, "more");
}

static void instructions_are_shown_until_followed(void **unused)
{
    (void)unused;
    if (!context)
        skip();
    OperatorControls controls = new_controls(1280, 720);
    controls.state.instructions = "Bring the tip into the aneurysm.\n1. Hold the pedal.\n2. Push the wire past the bend, which lies\nabout 40 mm in.\n";
    Panel *panel = controls.panel;
    draw(panel, &controls.canvas, &controls.input, &controls.state);
    assert_true(panel->briefing_at.width == 0);   // a video: nobody can close it
    frame(&controls);
    assert_true(panel->briefing_at.width > 0);
    keep_picture(&controls.canvas, "briefing");
    // no drag begins in the view below it
    controls.input.mouse_x = panel->briefing_at.x + panel->briefing_at.width / 2;
    controls.input.mouse_y = panel->briefing_at.y + 4;
    controls.input.mouse_buttons = WINDOW_MOUSE_LEFT;
    frame(&controls);
    assert_int_equal(controls.actions.mouse.view, -1);
    controls.input.mouse_buttons = 0;
    // following it closes it
    add_event(&controls, (WindowEvent){.kind = WINDOW_KEY_DOWN_EVENT, .key = 'F'});
    for (int i = 0; i < 20; i++)
        frame(&controls);
    assert_true(panel->briefing_at.width == 0);
    tap(&controls, 'O');
    assert_true(panel->briefing_at.width > 0);
    tap(&controls, WINDOW_KEY_ESCAPE);
    assert_true(panel->briefing_at.width == 0 && !panel_is_asking(panel));
    tap(&controls, WINDOW_KEY_ESCAPE);
    assert_true(panel_is_asking(panel));
    end_controls(&controls);
}

// It opens by itself, stays closed once it was closed, and goes when the exercise begins again.
static void the_result_is_shown_once(void **unused)
{
    (void)unused;
    if (!context)
        skip();
    OperatorControls controls = new_controls(1280, 720);
    Panel *panel = controls.panel;
    controls.state.instructions = "One line.";
    controls.state.is_finished = false;
    frame(&controls);
    frame(&controls);
    assert_true(panel->briefing_at.width == 0);
    controls.state.is_finished = true;
    frame(&controls);
    assert_true(panel->briefing_at.width > 0);
    tap(&controls, WINDOW_KEY_ESCAPE);
    frame(&controls);
    assert_true(panel->briefing_at.width == 0 && !panel_is_asking(panel));
    tap(&controls, 'O');
    assert_true(panel->briefing_at.width > 0);
    controls.state.is_finished = false;
    frame(&controls);
    assert_true(panel->briefing_at.width == 0);
    end_controls(&controls);
}

// Following the hints one after the other ends them; each names its keys and fits its place.
static void hints_lead_on_with_use(void **unused)
{
    (void)unused;
    if (!context)
        skip();
    for (int tools = 1; tools <= 2; tools++) {
        OperatorControls controls = new_controls(1024, 600);
        static const ActionId follow[] = {ACTION_PEDAL,   ACTION_PUSH,        ACTION_TOOL_2, ACTION_OTHER_PUSH, ACTION_MAGNIFY, ACTION_CONTRAST,
                                          ACTION_ROADMAP, ACTION_TWIST_RIGHT, ACTION_LAO,    ACTION_VIEW_3D,    ACTION_HELP};
        int count = sizeof follow / sizeof follow[0];
        for (int i = 0; i < count; i++) {
            const KeyAction *action = &key_table[follow[i]];
            char text[256], key[32];
            if (tools == 1 && (i == 2 || i == 3))     // of several tools
                continue;
            assert_int_equal(panel_current_hint(controls.panel, tools), i);
            panel_hint_text(i, text, sizeof text);
            assert_non_null(strstr(text, key_table_text(follow[i], key, sizeof key)));
            assert_null(strchr(text, '%'));
            assert_in_range(strlen(text), 20, 120);   // two lines
            add_event(&controls, (WindowEvent){.kind = WINDOW_KEY_DOWN_EVENT, .key = action->key});
            for (int k = 0; k < (action->kind == ACTION_HOLD ? 40 : 1); k++)
                panel_take_input(controls.panel, &controls.input, &controls.actions), controls.input.event_count = 0;
            add_event(&controls, (WindowEvent){.kind = WINDOW_KEY_UP_EVENT, .key = action->key});
            frame(&controls);
        }
        assert_int_equal(panel_current_hint(controls.panel, tools), -1);
        end_controls(&controls);
    }
}

// What is happening comes before a hint about the keys, also when those are used up; an examination tells nothing, but a guided one its step.
static void what_happens_is_told(void **unused)
{
    (void)unused;
    static const Guide guide = {.count = 3, .step = {{.text = "Push."}, {.text = "Turn."}, {.text = "Hold still."}}};
    PanelState state = some_state();
    char text[256], key[32];
    assert_false(panel_happening_text(&state, text, sizeof text));
    for (int kind = HINT_NONE + 1; kind < HINT_COUNT; kind++) {
        state.hint = (HintKind)kind;
        state.hint_value = 12.3;
        assert_true(panel_happening_text(&state, text, sizeof text));
        assert_in_range(strlen(text), 20, 120);
        assert_null(strchr(text, '%'));
    }
    state.hint = HINT_WRONG_BRANCH;
    assert_true(panel_happening_text(&state, text, sizeof text));
    assert_true(strstr(text, "12 mm") && strstr(text, key_table_text(ACTION_PULL, key, sizeof key)));
    state.guide = &guide;
    state.steps_done = 1;
    assert_true(panel_happening_text(&state, text, sizeof text) && strstr(text, "wrong branch"));
    state.is_examination = true;
    assert_true(panel_happening_text(&state, text, sizeof text));
    assert_string_equal(text, "Step 2 of 3: Turn.");
    state.steps_done = 3;
    assert_false(panel_happening_text(&state, text, sizeof text));
}

// With every action on a key of its own, no hint and no step keeps the usual one.
static void texts_follow_the_users_keys(void **unused)
{
    (void)unused;
    static Faults faults;
    KeyBinding bound[ACTION_COUNT];
    PanelState state = some_state();
    char usual[256], text[256];
    Scene *scene = scene_load(SOURCE_DIR "/scenes/exercises/first-case.yaml", &faults);
    assert_non_null(scene);
    for (int i = 0; i < ACTION_COUNT; i++)
        bound[i] = (KeyBinding){WINDOW_KEY_F1, WINDOW_ALT, 0};
    for (int i = 0; i < 11; i++) {
        panel_hint_text(i, usual, sizeof usual);
        key_table_bind(bound);
        panel_hint_text(i, text, sizeof text);
        key_table_bind(NULL);
        assert_non_null(strstr(text, "Alt+F1"));
        assert_null(strpbrk(text, "{}"));
        assert_null(strpbrk(usual, "{}"));
        assert_string_not_equal(text, usual);
    }
    state.hint = HINT_COILS;
    key_table_bind(bound);
    panel_happening_text(&state, text, sizeof text);
    key_table_bind(NULL);
    assert_non_null(strstr(text, "Alt+F1"));
    state.hint = HINT_NONE;
    state.guide = &scene->exercise->guide;
    panel_happening_text(&state, usual, sizeof usual);
    key_table_bind(bound);
    panel_happening_text(&state, text, sizeof text);
    key_table_bind(NULL);
    assert_non_null(strstr(usual, "Hold F, the X-ray pedal"));
    assert_non_null(strstr(text, "Hold Alt+F1, the X-ray pedal"));
    // each brace is an action's name
    for (int i = 0; i < scene->exercise->guide.count; i++)
        assert_null(strpbrk(key_table_fill(scene->exercise->guide.step[i].text, text, sizeof text), "{}"));
    scene_free(scene);
}

static const char *marked(const char *text)
{
    static char translated[300];
    snprintf(translated, sizeof translated, "<%s>", text);
    return translated;
}

// Both kinds of hint are looked up before keys and values are filled in.
static void hints_are_translated(void **unused)
{
    (void)unused;
    PanelState state = some_state();
    char text[256];
    translation_replace(marked);
    state.hint = HINT_COILS;
    const bool happens = panel_happening_text(&state, text, sizeof text);
    const char first = text[0];
    panel_hint_text(0, text, sizeof text);
    translation_replace(NULL);
    assert_true(happens);
    assert_int_equal(first, '<');
    assert_int_equal(text[0], '<');
}

// Marks of consequences change the picture at their places, the leaked agent darkens the X-ray image around; the list of steps needs its place.
static void consequences_and_steps_are_drawn(void **unused)
{
    (void)unused;
    if (!context)
        skip();
    static const Guide guide = {.count = 4,
                                .step = {{.text = "Hold F, the X-ray pedal."},
                                         {.text = "Hold the left arrow key to turn the wire by a quarter turn: its curved tip looks outwards."},
                                         {.text = "Push."},
                                         {.text = "Hold still."}}};
    enum { WIDTH = 1280, HEIGHT = 800 };
    GlCanvas canvas = new_canvas(WIDTH, HEIGHT);
    Panel *panel = new_panel();
    WindowInput input = still_input(WIDTH, HEIGHT, 1);
    PanelState state = some_state();
    state.guide = &guide;
    state.steps_done = 1;
    uint8_t *with = malloc((size_t)WIDTH * HEIGHT * 3), *without = malloc((size_t)WIDTH * HEIGHT * 3);
    assert_true(with && without);
    for (int i = 0; i < 3; i++)
        draw(panel, &canvas, &input, &state);
    gl_canvas_read(&canvas, without);
    state.spot_count = 1;
    state.spot[0] = (PanelSpot){.text = "vessel perforated", .is_in_xray = true, .xray = {0.1, 0.2}, .blot = 0.05};
    draw(panel, &canvas, &input, &state);
    gl_canvas_read(&canvas, with);
    keep_picture(&canvas, "consequences");
    const PanelLayout layout = panel_layout(WIDTH, HEIGHT, 1, state.view, true);
    const GuiRect at = layout.view_rect[VIEW_FLUOROSCOPY];
    const float side = fminf(at.width, at.height), x = at.x + at.width / 2 + 0.1F * side, y = at.y + at.height / 2 - 0.2F * side;
    const size_t middle = 3 * ((size_t)y * WIDTH + (size_t)x), edge = 3 * ((size_t)y * WIDTH + (size_t)(x - 0.045F * side)),
                 outside = 3 * ((size_t)y * WIDTH + (size_t)(x - 0.06F * side));
    assert_true(with[middle] < without[middle] - 60);
    assert_true(with[edge] < without[edge] - 10 && with[edge] > with[middle] + 20);    // denser in the middle
    assert_int_equal(with[outside], without[outside]);
    free(with);
    free(without);
    panel_destroy(panel);
    gl_canvas_destroy(&canvas);
}

static void strange_states_draw(void **unused)
{
    (void)unused;
    if (!context)
        skip();
    OperatorControls controls = new_controls(640, 400);
    controls.state = (PanelState){.time_s = NAN,
                                  .tool_count = 1,
                                  .tool = {{.inserted_mm = INFINITY, .force_n = NAN}},
                                  .hold_needed_s = 1,
                                  .hold_s = NAN,
                                  .warning = "x",
                                  .warnings = ~0u,
                                  .fluoro_s = -1,
                                  .contrast_ml = NAN,
                                  .step_median_us = NAN,
                                  .real_time_factor = NAN,
                                  .xray = {.lao_deg = NAN, .field_mm = NAN},
                                  .view = VIEW_ALL};
    static const PanelFigure nameless = {0};
    controls.state.figure_count = 1;
    controls.state.figure = &nameless;
    for (int i = 0; i < 300; i++)
        panel_message(controls.panel, i, (PanelMark)(i % 4), i % 2 ? "" : "%s%n a message with a sign that is no format");
    frame(&controls);
    frame(&controls);
    assert_int_equal(glGetError(), GL_NO_ERROR);
    end_controls(&controls);
}

// Four tools are all listed, the selected one with its own plots; in the smallest usual window nothing is cut off.
static void several_tools_are_listed(void **unused)
{
    (void)unused;
    if (!context)
        skip();
    const int size[2][2] = {{1280, 800}, {1024, 600}};
    for (int s = 0; s < 2; s++) {
        int width = size[s][0], height = size[s][1];
        OperatorControls controls = new_controls(width, height);
        size_t bytes = (size_t)width * (size_t)height * 3;
        uint8_t *before = malloc(bytes), *after = malloc(bytes);
        assert_true(before && after);
        static const char *const name[4] = {"guide", "catheter", "microcatheter", "wire"};
        controls.state.tool_count = 4;
        for (int k = 0; k < 4; k++)
            controls.state.tool[k] = (PanelTool){.name = name[k],
                                                 .what = "catheter 0.70 mm x 1500 mm, curved tip",
                                                 .color = {80, 160, 220, 255},
                                                 .inserted_mm = 100 + k,
                                                 .turned_deg = 20,
                                                 .force_n = 0.1 * k,
                                                 .torque_n_mm = 0.02 * k,
                                                 .note = k == 1 ? "let go" : NULL,
                                                 .mark = k == 1 ? MARK_WARNING : MARK_NONE};
        for (int i = 0; i < 8; i++)
            frame(&controls);
        keep_picture(&controls.canvas, s ? "four-tools-small" : "four-tools");
        gl_canvas_read(&controls.canvas, before);
        for (int what = 0; what < 5; what++) {
            PanelState kept = controls.state;
            if (what < 4)
                controls.state.tool[what].inserted_mm = 55.5;
            else
                controls.state.chosen_tool = 3;
            for (int i = 0; i < 3; i++)
                frame(&controls);
            gl_canvas_read(&controls.canvas, after);
            assert_true(memcmp(before, after, bytes) != 0);
            controls.state = kept;
        }
        free(before);
        free(after);
        end_controls(&controls);
    }
}

// Cached pixels must equal those of a newly created panel.
static void kept_windows_show_what_a_new_panel_shows(void **unused)
{
    (void)unused;
    if (!context)
        skip();
    OperatorControls controls = new_controls(1280, 720);
    size_t bytes = (size_t)1280 * 720 * 3;
    uint8_t *rgb[2] = {malloc(bytes), malloc(bytes)};
    assert_true(rgb[0] && rgb[1]);
    for (int i = 0; i < 40; i++) {   // things change, appear and disappear
        controls.state.view = (PanelView)(i / 10);
        controls.state.tool[0].inserted_mm += 1;
        controls.state.error_count = i % 3;
        controls.state.xray.lao_deg = (float)i;
        panel_show_help(controls.panel, i % 7 == 3);
        frame(&controls);
    }
    controls.state.view = VIEW_FLUOROSCOPY;
    for (int i = 0; i < 4; i++)   // parts that are drawn less often catch up
        frame(&controls);
    gl_canvas_read(&controls.canvas, rgb[0]);
    Panel *fresh = new_panel();
    memcpy(fresh->force, controls.panel->force, sizeof fresh->force);
    memcpy(fresh->torque, controls.panel->torque, sizeof fresh->torque);
    fresh->wall = controls.panel->wall;
    fresh->is_dense = controls.panel->is_dense;
    for (int i = 0; i < 4; i++)
        draw(fresh, &controls.canvas, &controls.input, &controls.state);
    gl_canvas_read(&controls.canvas, rgb[1]);
    assert_memory_equal(rgb[0], rgb[1], bytes);
    free(rgb[0]);
    free(rgb[1]);
    panel_destroy(fresh);
    end_controls(&controls);
}

// Process CPU time, including the driver's threads.
static double cpu_ms(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return 1e3 * (double)t.tv_sec + 1e-6 * (double)t.tv_nsec;
}

static int by_size(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static void what_a_frame_costs(void **unused)
{
    (void)unused;
    if (!context)
        skip();
    for (int i = 0; i < 2; i++) {
        enum { FRAMES = 60 };
        GlCanvas canvas = i ? new_canvas(1920, 1080) : new_canvas(1280, 720);
        WindowInput input = still_input(canvas.width, canvas.height, 1);
        PanelState state = some_state();
        Panel *panel = new_panel();
        double ms[FRAMES];
        for (int k = 0; k < FRAMES; k++) {
            state.time_s += 1.0 / 30;
            state.tool[0].force_n = 0.06 + 0.02 * sin(0.3 * k);
            state.tool[0].inserted_mm += 0.4;
            double start = cpu_ms();
            panel_draw(panel, &input, &state, canvas.framebuffer);
            glFinish();
            ms[k] = cpu_ms() - start;
        }
        double mean = 0;
        for (int k = 10; k < FRAMES; k++)
            mean += ms[k] / (FRAMES - 10);
        qsort(ms + 10, FRAMES - 10, sizeof *ms, by_size);
        print_message("panel alone, %dx%d: first frame %.1f ms CPU, then mean %.2f, median %.2f, most %.2f\n", canvas.width, canvas.height, ms[0], mean,
                      ms[10 + (FRAMES - 10) / 2], ms[FRAMES - 1]);
        panel_destroy(panel);
        gl_canvas_destroy(&canvas);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(nothing_overlaps_at_any_size),
                                       cmocka_unit_test(plots_keep_every_peak_and_forget_after_their_span),
                                       cmocka_unit_test(ticks_are_round),
                                       cmocka_unit_test(pictures_at_all_sizes),
                                       cmocka_unit_test(every_action_has_a_button_that_works),
                                       cmocka_unit_test(doubled_letters_are_not_cut),
                                       cmocka_unit_test(the_tray_fits_at_any_size),
                                       cmocka_unit_test(keys_choose_shape_and_take_from_the_tray),
                                       cmocka_unit_test(the_mouse_chooses_on_the_tray),
                                       cmocka_unit_test(words_do_not_lie_on_words),
                                       cmocka_unit_test(the_newest_message_is_seen),
                                       cmocka_unit_test(a_tooltip_names_the_key),
                                       cmocka_unit_test(views_are_chosen_turned_and_scrolled_by_mouse),
                                       cmocka_unit_test(a_button_lets_go_when_the_focus_goes),
                                       cmocka_unit_test(names_are_typed_and_trimmed),
                                       cmocka_unit_test(broken_lines_are_joined),
                                       cmocka_unit_test(instructions_are_shown_until_followed),
                                       cmocka_unit_test(the_result_is_shown_once),
                                       cmocka_unit_test(hints_lead_on_with_use),
                                       cmocka_unit_test(hints_are_translated),
                                       cmocka_unit_test(texts_follow_the_users_keys),
                                       cmocka_unit_test(what_happens_is_told),
                                       cmocka_unit_test(consequences_and_steps_are_drawn),
                                       cmocka_unit_test(strange_states_draw),
                                       cmocka_unit_test(several_tools_are_listed),
                                       cmocka_unit_test(kept_windows_show_what_a_new_panel_shows),
                                       cmocka_unit_test(what_a_frame_costs)};
    return cmocka_run_group_tests(tests, open_gl, close_gl);
}
