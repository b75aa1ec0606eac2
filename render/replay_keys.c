#include "render/replay_keys.h"

#include <stdio.h>

#define OWN ACTION_COUNT
static const struct {
    ActionId action;             // whose key it is; OWN: a key of the timeline alone
    KeyBinding own;
    const char *help;
} row[REPLAY_KEYS] = {
    [REPLAY_PLAY] = {ACTION_PAUSE, {0}, "play; again: stop"},
    [REPLAY_BACK] = {ACTION_TWIST_LEFT, {0}, "back in time while held"},
    [REPLAY_ON] = {ACTION_TWIST_RIGHT, {0}, "on in time while held"},
    [REPLAY_ALONE] = {ACTION_SLOW, {0}, "with back or on: moves the recording beside alone"},
    [REPLAY_MARK_BEFORE] = {ACTION_PUSH, {0}, "the mark before: error, bookmark, injection, target"},
    [REPLAY_MARK_AFTER] = {ACTION_PULL, {0}, "the mark after"},
    [REPLAY_SLOWER] = {OWN, {0, 0, '<'}, "play more slowly"},
    [REPLAY_FASTER] = {OWN, {0, 0, '>'}, "play faster"},
    [REPLAY_PARTS] = {OWN, {'Y', 0, 0}, "the parts of the score at this moment; again: hide them"},
    [REPLAY_STEP] = {OWN, {'9', 0, 0}, "the recording beside: in step, or by its own time"},
    [REPLAY_RESUME] = {ACTION_SAVE, {0}, "continue from here as a new session"},
};

KeyBinding replay_key_binding(ReplayKey id) { return row[id].action == OWN ? row[id].own : key_table_binding(row[id].action); }

const char *replay_key_text(ReplayKey id, char *text, size_t capacity)
{
    const KeyBinding binding = replay_key_binding(id);
    if (binding.key)
        return key_binding_text(binding, text, capacity);
    snprintf(text, capacity, "%c", binding.character);
    return text;
}

const char *replay_key_help(ReplayKey id) { return row[id].help; }

bool replay_key_is_pressed(ReplayKey id, const WindowEvent *event)
{
    const KeyBinding binding = replay_key_binding(id);
    if (event->kind == WINDOW_TEXT_EVENT)
        return binding.character && event->character == (unsigned)binding.character;
    return event->kind == WINDOW_KEY_DOWN_EVENT && binding.key && event->key == binding.key &&
           (event->modifiers & (WINDOW_ALT | WINDOW_SUPER)) == binding.modifiers;
}

bool replay_has_action(ActionId id)
{
    static const ActionId session[] = {ACTION_FULL_SCREEN, ACTION_PANELS, ACTION_BRIEFING, ACTION_HELP, ACTION_QUIT};
    bool has = key_table[id].group == GROUP_VIEW;
    for (size_t i = 0; i < sizeof session / sizeof *session; i++)
        has |= session[i] == id;
    for (int k = 0; k < REPLAY_KEYS; k++)
        has &= row[k].action != OWN || !key_binding_clash(row[k].own, key_table_binding(id));
    return has;
}

bool replay_keys_claim(const WindowInput *input, ActionId id)
{
    bool is_claimed = false;
    for (int k = 0; k < REPLAY_KEYS; k++)
        for (int i = 0; row[k].action == OWN && key_binding_clash(row[k].own, key_table_binding(id)) && i < input->event_count; i++)
            is_claimed |= replay_key_is_pressed((ReplayKey)k, &input->event[i]);
    return is_claimed;
}
