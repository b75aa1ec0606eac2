// The timeline of a recording off screen: the mouse finds every button, each button has its effect, and the bar leads to the moment under the mouse.
#include "render/gl_canvas.h"
#include "render/gl_context.h"
#include "render/timeline.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>

#include <cmocka.h>

#include "../geom/near.h"

enum { WIDTH = 1280, HEIGHT = 720 };

static PanelRect strip;   // of the layout

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
    it.state = (TimelineState){.time_s = 40, .end_s = 100, .speed = 1, .mark_count = 2, .mark_s = {10, 90}, .note = "session.h5"};
    for (int i = 0; i < 3; i++) {   // without input there is no action
        TimelineActions none = frame(&it, -1, -1, 0);
        assert_true(!none.seek && !none.toggle_play && !none.resume && none.speed == 1);
    }
    int plays = 0, backs = 0, ons = 0, resumes = 0, sought = 0;
    double leftmost_s = 100, rightmost_s = 0, before_s = -1, bar_x = 0, bar_y = 0, speed_x = 0, speed_y = 0;
    for (double y = (double)strip.y + 6; y < (double)(strip.y + strip.height); y += 8)
        for (double x = (double)strip.x + 6; x < (double)(strip.x + strip.width); x += 24, it.state.speed = 1) {
            TimelineActions asked = click(&it, x, y);
            plays += asked.toggle_play;
            resumes += asked.resume;
            assert_true(asked.toggle_play + asked.resume + asked.seek <= 1);
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
    assert_true(plays > 1 && backs > 1 && ons > 1 && resumes > 1 && sought > 40);
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

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(what_is_clicked_is_done)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
