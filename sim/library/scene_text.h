// A scene in code as the text of a scene file.
#ifndef SELDINGER_SIM_LIBRARY_SCENE_TEXT_H
#define SELDINGER_SIM_LIBRARY_SCENE_TEXT_H

#include "seldinger/scene.h"

#include <stdbool.h>

// The text, which the caller frees; NULL where memory lacks, or with what is wrong in `*trouble`. Ranges are for the reader of the text to check.
char *scene_text(const SelSceneOptions *options, size_t *length, const char **trouble);

#endif
