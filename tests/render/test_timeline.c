// The timeline of a recording off screen: the mouse finds every button, each button has its effect, and the bar leads to the moment under the mouse. Marks are drawn
// at their times in the colours of their kinds; buttons and keys lead from one to the next.
#include "render/gl_canvas.h"
#include "render/gl_context.h"
#include "render/replay_keys.h"
#include "render/timeline.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "../geom/near.h"

enum { WIDTH = 1280, HEIGHT = 720 };

static PanelRect strip;   // of the layout
static RunMark mark[] = {{RUN_MARK_ERROR, .time_s = 10.3, .error = ERROR_KICK, .tool = -1},
                         {RUN_MARK_INJECTION, .time_s = 55.7, .tool = -1, .number = 1, .seconds = 5},
                         {RUN_MARK_BOOKMARK, .time_s = 90.1, .tool = -1, .number = 1}};
static RunSpan pedal[] = {{20, 30}};
static RecordedRun recorded = {.tool_count = 1};
static const RunMarks marks = {.count = 3, .mark = mark, .xray_count = 1, .xray = pedal, .run = &recorded};

typedef struct Strip {
    Timeline *timeline;
    GlCanvas canvas;
    TimelineState state;
} Strip;

static TimelineActions frame(Strip *it, double x, double y, unsigned buttons)
{
    static const float black[3] = {0, 0, 0};
    WindowInput input = {.width = WIDTH, .height = HEIGHT, .scale = 1, .mouse_x = x, .mouse_y = y, .mouse_buttons = buttons, .has_focus = true};
    gl_canvas_begin(&it->canvas, black);
    return timeline_draw(it->timeline, &input, &it->state, 1, strip, it->canvas.framebuffer);
}

// Moves there, presses and releases; returns the actions of all frames.
static TimelineActions click(Strip *it, double x, double y)
{
    TimelineActions all = frame(it, x, y, 0);
    for (int i = 0; i < 3; i++) {
        TimelineActions now = frame(it, x, y, i == 0 ? WINDOW_MOUSE_LEFT : 0);
        all.toggle_play |= now.toggle_play;
        all.resume |= now.resume;
        all.toggle_parts |= now.toggle_parts;
        all.stop |= now.stop;
        if (now.seek) {
            all.seek = true;
            all.seek_s = now.seek_s;
        }
        all.speed = now.speed;
        it->state.speed = now.speed;
    }
    return all;
}

static void what_is_clicked_is_done(void **state)
{
    (void)state;
    char message[256] = "";
    GlContext *context = gl_context_create(message, sizeof message);
    if (!context) {
        print_message("skipped: no EGL: %s\n", message);
        skip();
    }
    strip = panel_layout(WIDTH, HEIGHT, 1, VIEW_FLUOROSCOPY, true).bottom;
    Strip it = {.timeline = timeline_create(message, sizeof message)};
    assert_non_null(it.timeline);
    assert_true(gl_canvas_create(&it.canvas, WIDTH, HEIGHT, 1, message, sizeof message));
    it.state = (TimelineState){.time_s = 40, .end_s = 100, .speed = 1, .marks = &marks, .known_s = 100, .note = "session.h5"};
    for (int i = 0; i < 3; i++) {   // without input there is no action
        TimelineActions none = frame(&it, -1, -1, 0);
        assert_true(!none.seek && !none.toggle_play && !none.resume && none.speed == 1);
    }
    int plays = 0, backs = 0, ons = 0, resumes = 0, sought = 0, parts = 0, befores = 0, afters = 0;
    double leftmost_s = 100, rightmost_s = 0, before_s = -1, bar_x = 0, bar_y = 0, speed_x = 0, speed_y = 0;
    for (double y = (double)strip.y + 6; y < (double)(strip.y + strip.height); y += 8)
        for (double x = (double)strip.x + 6; x < (double)(strip.x + strip.width); x += 24, it.state.speed = 1) {
            TimelineActions asked = click(&it, x, y);
            plays += asked.toggle_play;
            resumes += asked.resume;
            parts += asked.toggle_parts;
            assert_true(asked.toggle_play + asked.resume + asked.seek + asked.toggle_parts <= 1);
            if (asked.stop) {        // to the mark before or after the current time
                assert_true(asked.seek_s == 10.3 || asked.seek_s == 55.7);
                befores += asked.seek_s == 10.3;
                afters += asked.seek_s == 55.7;
                continue;
            }
            if (asked.speed != 1) {
                speed_x = x;
                speed_y = y;
            }
            before_s = x < (double)strip.x + 24 ? -1 : before_s;
            if (!asked.seek)
                continue;
            bool is_back = asked.seek_s == 35, is_on = asked.seek_s == 45;   // 5 s from the current time; the bar gives no round times
            backs += is_back;
            ons += is_on;
            if (is_back || is_on)
                continue;
            // the bar: from left to right in time
            assert_true(asked.seek_s >= 0 && asked.seek_s <= 100 && asked.seek_s >= before_s);
            assert_near(asked.seek_s, 100 * (x - (double)strip.x) / (double)strip.width, 3);
            before_s = asked.seek_s;
            leftmost_s = fmin(leftmost_s, asked.seek_s);
            rightmost_s = fmax(rightmost_s, asked.seek_s);
            sought++;
            bar_x = x;
            bar_y = y;
        }
    assert_true(plays > 1 && backs > 1 && ons > 1 && resumes > 1 && sought > 40 && parts > 1 && befores > 1 && afters > 1);
    assert_true(leftmost_s < 2 && rightmost_s > 98);
    // dragged beyond its end the time stays within
    frame(&it, bar_x, bar_y, 0);
    frame(&it, bar_x, bar_y, WINDOW_MOUSE_LEFT);
    TimelineActions asked = frame(&it, 5000, 50, WINDOW_MOUSE_LEFT);
    assert_true(asked.seek && asked.seek_s == 100);
    it.state.time_s = 100;
    asked = frame(&it, -300, 50, WINDOW_MOUSE_LEFT);
    assert_true(asked.seek && asked.seek_s == 0);
    frame(&it, -300, 50, 0);
    frame(&it, speed_x, speed_y, 0);
    frame(&it, speed_x, speed_y, WINDOW_MOUSE_LEFT);
    assert_true(frame(&it, 5000, speed_y, WINDOW_MOUSE_LEFT).speed == 8);
    assert_true(frame(&it, -300, speed_y, WINDOW_MOUSE_LEFT).speed == 0.1F);
    timeline_destroy(it.timeline);
    gl_canvas_destroy(&it.canvas);
    gl_context_destroy(context);
}

static TimelineActions press(int key, unsigned character, const TimelineState *state)
{
    static WindowInput input;
    input = (WindowInput){.width = WIDTH, .height = HEIGHT, .scale = 1, .has_focus = true, .event_count = 2};
    input.event[0] = (WindowEvent){.kind = WINDOW_KEY_DOWN_EVENT, .key = key};
    input.event[1] = (WindowEvent){.kind = WINDOW_TEXT_EVENT, .character = character};
    return timeline_take_keys(&input, state);
}

static void keys_lead_from_mark_to_mark(void **state)
{
    (void)state;
    TimelineSide side = {.is_in_step = true};
    TimelineState at = {.time_s = 0, .end_s = 100, .speed = 1, .marks = &marks};
    for (int i = 0; i < 3; i++) {
        TimelineActions asked = press(WINDOW_KEY_DOWN, 0, &at);
        assert_true(asked.seek && asked.stop && asked.seek_s == mark[i].time_s);
        at.time_s = asked.seek_s;
    }
    assert_false(press(WINDOW_KEY_DOWN, 0, &at).seek);       // the last one
    for (int i = 1; i >= 0; i--) {
        TimelineActions asked = press(WINDOW_KEY_UP, 0, &at);
        assert_true(asked.seek && asked.seek_s == mark[i].time_s);
        at.time_s = asked.seek_s;
    }
    assert_false(press(WINDOW_KEY_UP, 0, &at).seek);
    assert_true(press('Y', 'y', &at).toggle_parts);
    assert_false(press('9', '9', &at).toggle_step);          // nothing is beside it
    at.side = &side;
    assert_true(press('9', '9', &at).toggle_step);
    assert_true(press(WINDOW_KEY_NONE, '>', &at).speed > 1 && press(WINDOW_KEY_NONE, '<', &at).speed < 1);
    for (int i = 0; i < 40; i++)
        at.speed = press(WINDOW_KEY_NONE, '>', &at).speed;
    assert_true(at.speed == 8);
}

// The keys of a replay follow the user's; the list of keys has those that act and no other, and none of them twice.
static void keys_are_those_of_a_replay(void **state)
{
    (void)state;
    KeyBinding bound[ACTION_COUNT];
    TimelineState at = {.end_s = 120, .speed = 1, .time_s = 20, .marks = &marks};
    for (int i = 0; i < ACTION_COUNT; i++)
        bound[i] = key_table_default((ActionId)i);
    bound[ACTION_PULL] = (KeyBinding){'B', 0, 0};
    key_table_bind(bound);
    char text[32];
    const bool is_named = !strcmp(replay_key_text(REPLAY_MARK_AFTER, text, sizeof text), "B");
    const bool seeks = press('B', 'b', &at).seek, seeks_usual = press(WINDOW_KEY_DOWN, 0, &at).seek;
    key_table_bind(NULL);
    assert_true(is_named && seeks && !seeks_usual);
    for (int i = 0; i < REPLAY_KEYS; i++) {
        assert_in_range(strlen(replay_key_help((ReplayKey)i)), 8, 75);
        for (int k = 0; k < ACTION_COUNT; k++)
            assert_false(replay_has_action((ActionId)k) && key_binding_clash(replay_key_binding((ReplayKey)i), key_table_binding((ActionId)k)));
    }
    assert_true(replay_has_action(ACTION_VIEW_3D) && replay_has_action(ACTION_HELP));
    assert_false(replay_has_action(ACTION_CONTRAST) || replay_has_action(ACTION_LAO) || replay_has_action(ACTION_RESTART));
    // Y lists the parts of the score, and the 3D view stays as it is
    WindowInput input = {.event_count = 1, .event = {{.kind = WINDOW_KEY_DOWN_EVENT, .key = 'Y'}}};
    assert_true(replay_keys_claim(&input, ACTION_CAMERA_C_ARM));
    assert_false(replay_keys_claim(&input, ACTION_MODEL) || replay_keys_claim(&input, ACTION_LATERAL));
}

// Columns of the strip in which some pixel has a colour, to 40 of 255.
static int columns_of(const uint8_t *rgb, Color color, double from_x, double to_x)
{
    int count = 0;
    for (int x = (int)from_x; x < (int)to_x; x++) {
        bool has = false;
        for (int y = (int)strip.y; y < HEIGHT; y++) {
            const uint8_t *p = &rgb[3 * (y * WIDTH + x)];
            has |= abs(p[0] - color.r) < 40 && abs(p[1] - color.g) < 40 && abs(p[2] - color.b) < 40;
        }
        count += has;
    }
    return count;
}

static void marks_are_drawn_at_their_times(void **state)
{
    (void)state;
    static uint8_t rgb[3 * WIDTH * HEIGHT];
    char message[256] = "";
    GlContext *context = gl_context_create(message, sizeof message);
    if (!context) {
        print_message("skipped: no EGL: %s\n", message);
        skip();
    }
    strip = panel_layout(WIDTH, HEIGHT, 1, VIEW_FLUOROSCOPY, true).bottom;
    Strip it = {.timeline = timeline_create(message, sizeof message)};
    assert_non_null(it.timeline);
    assert_true(gl_canvas_create(&it.canvas, WIDTH, HEIGHT, 1, message, sizeof message));
    it.state = (TimelineState){.time_s = 40, .end_s = 100, .speed = 1, .marks = &marks, .known_s = 100};
    frame(&it, -1, -1, 0);
    frame(&it, -1, -1, 0);
    gl_canvas_read(&it.canvas, rgb);
    const double left = 8, per_s = (WIDTH - 16) / 100.0;
    const Color kick = color_qualitative(ERROR_KICK);
    assert_in_range(columns_of(rgb, kick, left + 10.3 * per_s - 8, left + 10.3 * per_s + 8), 1, 16);
    assert_int_equal(columns_of(rgb, kick, left + 15 * per_s, left + 19 * per_s), 0);
    // the band of the X-rays is as long as the pedal was down
    const int band = columns_of(rgb, gui_colors.warning, left + 18 * per_s, left + 32 * per_s);
    assert_near(band, 10 * per_s, 3);
    timeline_destroy(it.timeline);
    gl_canvas_destroy(&it.canvas);
    gl_context_destroy(context);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(what_is_clicked_is_done), cmocka_unit_test(keys_are_those_of_a_replay),
                                       cmocka_unit_test(keys_lead_from_mark_to_mark), cmocka_unit_test(marks_are_drawn_at_their_times)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
