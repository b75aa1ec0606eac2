// Hints: about what is happening (sim/hints.h), the present step of a guided exercise, and, for new users, about the keys: each of those is shown until its
// action has been used.
#include "render/panel_internal.h"
#include "render/translation.h"

#include <stdio.h>
#include <string.h>

typedef struct Hint {
    ActionId done_by[4];           // any of these; ACTION_COUNT: none
    double enough_s;
    const char *text;              // names keys as key_table_fill() takes them
    bool is_of_several;            // only if there are several tools
} Hint;

#define NO ACTION_COUNT
static const Hint hint[] = {
    {{ACTION_PEDAL, ACTION_PEDAL_LATCH, NO, NO},
     0.5,
     "Hold {X-ray pedal} for X-ray: the picture is live while you hold it. {X-ray stays on} keeps it on.",
     false},
    {{ACTION_PUSH, ACTION_PULL, NO, NO},
     1,
     "Key {Push} pushes the tool, {Pull} pulls it back; with {Fast} faster, with {Slow} slower. Keep the X-ray on.",
     false},
    {{ACTION_TOOL_1, ACTION_TOOL_2, ACTION_TOOL_3, ACTION_TOOL_4},
     1,
     "{Tool 1}, {Tool 2} \u2026 select the tool that you move, outermost first. The others stay where they are.",
     true},
    {{ACTION_LOCK, ACTION_OTHER_PUSH, ACTION_OTHER_PULL, NO},
     0.5,
     "{Push other} and {Pull other} push and pull the tool inside (or around) yours at the same time. {Lock} locks both together.",
     true},
    {{ACTION_MAGNIFY, ACTION_DEMAGNIFY, NO, NO}, 1, "The tool is thin: {Magnify} magnifies the picture, {Demagnify} shows more of the patient again.", false},
    {{ACTION_CONTRAST, NO, NO, NO},
     0.5,
     "Hold {Inject contrast} with {X-ray pedal} to inject contrast: the vessels downstream of the tip show for a moment.",
     false},
    {{ACTION_ROADMAP, ACTION_DSA, NO, NO}, 1, "{Roadmap} keeps the vessels of the injection on the picture as a roadmap; {DSA} shows only contrast.", false},
    {{ACTION_TWIST_LEFT, ACTION_TWIST_RIGHT, NO, NO},
     0.5,
     "Keys {Twist left} and {Twist right} turn the tool: point the bent tip into the branch you want, then push with {Push}.",
     false},
    {{ACTION_LAO, ACTION_RAO, ACTION_CRA, ACTION_CAU},
     0.3,
     "Branches hide each other? Turn the C-arm: {RAO} and {LAO} to the sides, {CRA} and {CAU} towards head and feet.",
     false},
    {{ACTION_VIEW_3D, ACTION_VIEW_ANGIOSCOPY, ACTION_VIEW_ALL, NO},
     1,
     "{3D view} shows the vessel in 3D, {Angioscopy} looks out from the tip, {All views} shows all, {X-ray view} returns to X-ray. Or click a small view.",
     false},
    {{ACTION_HELP, NO, NO, NO}, 1, "Bring the tip to the target and keep it there until the bar at the left is full. All keys: {Help}", false},
};
enum { HINTS = sizeof hint / sizeof hint[0] };

int panel_current_hint(const Panel *panel, int tool_count)
{
    for (int i = 0; i < HINTS; i++) {
        double used = 0;
        for (int j = 0; j < 4; j++)
            used += hint[i].done_by[j] != NO ? panel->used_s[hint[i].done_by[j]] : 0;
        if (used < hint[i].enough_s - 1e-9 && (tool_count > 1 || !hint[i].is_of_several))
            return i;
    }
    return -1;
}

// What is happening, and what to do. %v is the value with its unit; keys as above.
static const struct Happening {
    const char *text;
    double scale;                  // of the value
    int decimals;
    const char *unit;
} happening[HINT_COUNT] = {
    [HINT_SAC] = {"The tip presses harder and harder on the aneurysm's wall (%v). Stop, and pull back with {Pull}.", 1000, 0, "mN"},
    [HINT_BUCKLES] = {"The tool buckles at the sheath (%v lost): its tip is held. Pull back with {Pull}, turn it, push slowly.", 1, 0, "mm"},
    [HINT_PRESSES] = {"The tip presses on the wall and stays there (%v pushed in vain). Pull back with {Pull}, turn it, push slowly.", 1, 0, "mm"},
    [HINT_COILS] = {"The tool coils up: what you push in does not reach the tip. Pull back with {Pull} until it lies straight.", 1, 0, "mm"},
    [HINT_WRONG_BRANCH] = {"The tip is in a wrong branch, or past the target. Pull back %v with {Pull}, turn the tip, try again.", 1, 0, "mm"},
    [HINT_WIRE_LOST] = {"The wire is inside the catheter. Push the wire, not the catheter, until it leads again.", 1, 0, ""},
    [HINT_UNSEEN] = {"The tool has moved %v without X-rays. Hold {X-ray pedal} while you move it.", 1, 0, "mm"},
    [HINT_NO_CONTRAST] = {"No contrast agent for %v: you do not see the vessel. Inject with {Inject contrast}, or show a roadmap with {Roadmap}.", 1, 0, "s"},
};

// Writes `from` with its keys and with `value` for %v.
static void fill(const char *from, const char *value, char *text, size_t capacity)
{
    char keyed[256];
    const char *rest = key_table_fill(from, keyed, sizeof keyed), *at = strstr(rest, "%v");
    if (at)
        snprintf(text, capacity, "%.*s%s%s", (int)(at - rest), rest, value, at + 2);
    else
        snprintf(text, capacity, "%s", rest);
}

void panel_hint_text(int index, char *text, size_t capacity) { fill(tr(hint[index].text), "", text, capacity); }

bool panel_happening_text(const PanelState *state, char *text, size_t capacity)
{
    char value[32], step[2 * GUIDE_TEXT];
    const bool is_happening = !state->is_examination && state->hint > HINT_NONE && state->hint < HINT_COUNT;
    const Guide *guide = state->guide;
    if (is_happening) {
        const struct Happening *h = &happening[state->hint];
        panel_figure(value, sizeof value, h->scale * state->hint_value, h->decimals, h->unit);
        fill(tr(h->text), value, text, capacity);
    } else if (guide && state->steps_done < guide->count) {
        snprintf(text, capacity, tr("Step %d of %d: %s"), state->steps_done + 1, guide->count,
                 key_table_fill(guide->step[state->steps_done].text, step, sizeof step));
    }
    return is_happening || (guide && state->steps_done < guide->count);
}

// The last step done, the present one and the two after it.
void panel_draw_steps(Panel *panel, const PanelState *state)
{
    enum { AHEAD = 2 };
    const Guide *guide = state->guide;
    char text[2 * GUIDE_TEXT + 16], step[2 * GUIDE_TEXT];
    if (!guide || guide->count == 0)
        return;
    snprintf(text, sizeof text, tr("%d of %d steps done"), state->steps_done, guide->count);
    gui_text(panel->gui, GUI_SMALL, gui_colors.dim, text);
    for (int i = state->steps_done > 0 ? state->steps_done - 1 : 0; i < guide->count && i <= state->steps_done + AHEAD; i++) {
        const bool is_done = i < state->steps_done, is_now = i == state->steps_done;
        snprintf(text, sizeof text, "%s%s",
                 is_done  ? panel_sign[MARK_GOOD]
                 : is_now ? "\u25cf "
                          : "\u25cb ",
                 key_table_fill(guide->step[i].text, step, sizeof step));
        gui_text_wrapped(panel->gui, GUI_SMALL, is_done ? panel_mark_color(MARK_GOOD) : is_now ? gui_colors.text : gui_colors.dim, text);
    }
}
