// Writes a scene built in code as the text of a scene file.
#ifndef SELDINGER_SIM_LIBRARY_SCENE_TEXT_H
#define SELDINGER_SIM_LIBRARY_SCENE_TEXT_H

#include "seldinger/scene.h"

#include <stdbool.h>

// Returns the text, which the caller frees; NULL if out of memory, or with a description of the error in `*trouble`. Ranges are checked by the reader of the
// text.
char *scene_text(const SelSceneOptions *options, size_t *length, const char **trouble);

#endif
