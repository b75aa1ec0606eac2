// Hints for new users, each shown until its action has been used.
#include "render/panel_internal.h"

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

void panel_hint_text(int index, char *text, size_t capacity)
{
    const Hint *h = &hint[index];
    size_t length = 0;
    int key = 0;
    for (const char *c = h->text; *c && length + 1 < capacity;) {
        if (c[0] == '%' && c[1] == 's') {
            char name[32];
            int more = snprintf(text + length, capacity - length, "%s", key_table_text(h->key[key++], name, sizeof name));
            length = length + (size_t)more < capacity ? length + (size_t)more : capacity - 1;
            c += 2;
        } else {
            text[length++] = *c++;
        }
    }
    text[length] = 0;
}
