// The keys of a replay's timeline: those of actions that move the tool or the session otherwise, as the user has bound them, and keys of its own.
#ifndef SELDINGER_RENDER_REPLAY_KEYS_H
#define SELDINGER_RENDER_REPLAY_KEYS_H

#include "render/key_table.h"

typedef enum {
    REPLAY_PLAY,
    REPLAY_BACK,
    REPLAY_ON,
    REPLAY_ALONE,                // with back and on: the recording beside alone
    REPLAY_MARK_BEFORE,
    REPLAY_MARK_AFTER,
    REPLAY_SLOWER,
    REPLAY_FASTER,
    REPLAY_PARTS,                // of the score
    REPLAY_STEP,                 // of the recording beside: in step
    REPLAY_RESUME,
    REPLAY_KEYS
} ReplayKey;

KeyBinding replay_key_binding(ReplayKey id);
const char *replay_key_text(ReplayKey id, char *text, size_t capacity);
const char *replay_key_help(ReplayKey id);
// Whether this event presses the key.
bool replay_key_is_pressed(ReplayKey id, const WindowEvent *event);
// Whether an action of the key table acts in a replay, by its own meaning.
bool replay_has_action(ActionId id);
// Whether one of the timeline's own keys was pressed, which this action has, too: the action is not meant then.
bool replay_keys_claim(const WindowInput *input, ActionId id);

#endif
