// Hints: about what is happening (sim/hints.h), the present step of a guided exercise, and, for new users, about the keys: each of those is shown until its
// action has been used.
#include "render/panel_internal.h"
#include "render/translation.h"

#include <stdio.h>

typedef struct Hint {
    ActionId done_by[4];           // any of these; ACTION_COUNT: none
    double enough_s;
    ActionId key[4];               // for the %s in the text, in this order
    const char *text;
    bool is_of_several;            // only if there are several tools
} Hint;

#define NO ACTION_COUNT
static const Hint hint[] = {
    {{ACTION_PEDAL, ACTION_PEDAL_LATCH, NO, NO},
     0.5,
     {ACTION_PEDAL, ACTION_PEDAL_LATCH, NO, NO},
     "Hold %s for X-ray: the picture is live while you hold it. %s keeps it on.",
     false},
    {{ACTION_PUSH, ACTION_PULL, NO, NO},
     1,
     {ACTION_PUSH, ACTION_PULL, ACTION_FAST, ACTION_SLOW},
     "Arrow %s pushes the tool, %s pulls it back; with %s faster, with %s slower. Keep the X-ray on.",
     false},
    {{ACTION_TOOL_1, ACTION_TOOL_2, ACTION_TOOL_3, ACTION_TOOL_4},
     1,
     {ACTION_TOOL_1, ACTION_TOOL_2, NO, NO},
     "%s, %s \u2026 select the tool that you move, outermost first. The others stay where they are.",
     true},
    {{ACTION_LOCK, ACTION_OTHER_PUSH, ACTION_OTHER_PULL, NO},
     0.5,
     {ACTION_OTHER_PUSH, ACTION_OTHER_PULL, ACTION_LOCK, NO},
     "%s and %s push and pull the tool inside (or around) yours at the same time. %s locks both together.",
     true},
    {{ACTION_MAGNIFY, ACTION_DEMAGNIFY, NO, NO},
     1,
     {ACTION_MAGNIFY, ACTION_DEMAGNIFY, NO, NO},
     "The tool is thin: %s magnifies the picture, %s shows more of the patient again.",
     false},
    {{ACTION_CONTRAST, NO, NO, NO},
     0.5,
     {ACTION_CONTRAST, ACTION_PEDAL, NO, NO},
     "Hold %s with %s to inject contrast: the vessels downstream of the tip show for a moment.",
     false},
    {{ACTION_ROADMAP, ACTION_DSA, NO, NO},
     1,
     {ACTION_ROADMAP, ACTION_DSA, NO, NO},
     "%s keeps the vessels of the injection on the picture as a roadmap; %s shows only contrast.",
     false},
    {{ACTION_TWIST_LEFT, ACTION_TWIST_RIGHT, NO, NO},
     0.5,
     {ACTION_TWIST_LEFT, ACTION_TWIST_RIGHT, ACTION_PUSH, NO},
     "Arrows %s and %s turn the tool: point the bent tip into the branch you want, then push with %s.",
     false},
    {{ACTION_LAO, ACTION_RAO, ACTION_CRA, ACTION_CAU},
     0.3,
     {ACTION_RAO, ACTION_LAO, ACTION_CRA, ACTION_CAU},
     "Branches hide each other? Turn the C-arm: %s and %s to the sides, %s and %s towards head and feet.",
     false},
    {{ACTION_VIEW_3D, ACTION_VIEW_ANGIOSCOPY, ACTION_VIEW_ALL, NO},
     1,
     {ACTION_VIEW_3D, ACTION_VIEW_ANGIOSCOPY, ACTION_VIEW_ALL, ACTION_VIEW_FLUOROSCOPY},
     "%s shows the vessel in 3D, %s looks out from the tip, %s shows all, %s returns to X-ray. Or click a small view.",
     false},
    {{ACTION_HELP, NO, NO, NO},
     1,
     {ACTION_HELP, NO, NO, NO},
     "Bring the tip to the target and keep it there until the bar at the left is full. All keys: %s",
     false},
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

// What is happening, and what to do. %v is the value with its unit.
static const struct Happening {
    const char *text;
    double scale;                  // of the value
    int decimals;
    const char *unit;
    ActionId key[2];
} happening[HINT_COUNT] = {
    [HINT_SAC] = {"The tip presses harder and harder on the aneurysm's wall (%v). Stop, and pull back with %s.", 1000, 0, "mN", {ACTION_PULL, NO}},
    [HINT_BUCKLES] = {"The tool buckles at the sheath (%v lost): its tip is held. Pull back with %s, turn it, push slowly.", 1, 0, "mm", {ACTION_PULL, NO}},
    [HINT_PRESSES] =
        {"The tip presses on the wall and stays there (%v pushed in vain). Pull back with %s, turn it, push slowly.", 1, 0, "mm", {ACTION_PULL, NO}},
    [HINT_COILS] = {"The tool coils up: what you push in does not reach the tip. Pull back with %s until it lies straight.", 1, 0, "mm", {ACTION_PULL, NO}},
    [HINT_WRONG_BRANCH] = {"The tip is in a wrong branch, or past the target. Pull back %v with %s, turn the tip, try again.", 1, 0, "mm", {ACTION_PULL, NO}},
    [HINT_WIRE_LOST] = {"The wire is inside the catheter. Push the wire, not the catheter, until it leads again.", 1, 0, "", {NO, NO}},
    [HINT_UNSEEN] = {"The tool has moved %v without X-rays. Hold %s while you move it.", 1, 0, "mm", {ACTION_PEDAL, NO}},
    [HINT_NO_CONTRAST] =
        {"No contrast agent for %v: you do not see the vessel. Inject with %s, or show a roadmap with %s.", 1, 0, "s", {ACTION_CONTRAST, ACTION_ROADMAP}},
};

// Writes `from` with the names of keys for each %s and the value for %v.
static void fill(const char *from, const ActionId *key, const char *value, char *text, size_t capacity)
{
    size_t length = 0;
    for (const char *c = from; *c && length + 1 < capacity;) {
        char name[32];
        const bool is_key = c[0] == '%' && c[1] == 's', is_value = c[0] == '%' && c[1] == 'v';
        if (is_key || is_value) {
            int more = snprintf(text + length, capacity - length, "%s", is_key ? key_table_text(*key++, name, sizeof name) : value);
            length = length + (size_t)more < capacity ? length + (size_t)more : capacity - 1;
            c += 2;
        } else {
            text[length++] = *c++;
        }
    }
    text[length] = 0;
}

void panel_hint_text(int index, char *text, size_t capacity) { fill(tr(hint[index].text), hint[index].key, "", text, capacity); }

bool panel_happening_text(const PanelState *state, char *text, size_t capacity)
{
    char value[32];
    const bool is_happening = !state->is_examination && state->hint > HINT_NONE && state->hint < HINT_COUNT;
    const Guide *guide = state->guide;
    if (is_happening) {
        const struct Happening *h = &happening[state->hint];
        panel_figure(value, sizeof value, h->scale * state->hint_value, h->decimals, h->unit);
        fill(tr(h->text), h->key, value, text, capacity);
    } else if (guide && state->steps_done < guide->count) {
        snprintf(text, capacity, tr("Step %d of %d: %s"), state->steps_done + 1, guide->count, guide->step[state->steps_done].text);
    }
    return is_happening || (guide && state->steps_done < guide->count);
}

// The last step done, the present one and the two after it.
void panel_draw_steps(Panel *panel, const PanelState *state)
{
    enum { AHEAD = 2 };
    const Guide *guide = state->guide;
    char text[GUIDE_TEXT + 16];
    if (!guide || guide->count == 0)
        return;
    snprintf(text, sizeof text, tr("%d of %d steps done"), state->steps_done, guide->count);
    gui_text(panel->gui, GUI_SMALL, gui_colors.dim, text);
    for (int i = state->steps_done > 0 ? state->steps_done - 1 : 0; i < guide->count && i <= state->steps_done + AHEAD; i++) {
        const bool is_done = i < state->steps_done, is_now = i == state->steps_done;
        snprintf(text, sizeof text, "%s%s", is_done ? panel_sign[MARK_GOOD] : is_now ? "\u25cf " : "\u25cb ", guide->step[i].text);
        gui_text_wrapped(panel->gui, GUI_SMALL, is_done ? panel_mark_color(MARK_GOOD) : is_now ? gui_colors.text : gui_colors.dim, text);
    }
}
