// The options of `replay`.
#ifndef SELDINGER_CLI_REPLAY_OPTIONS_H
#define SELDINGER_CLI_REPLAY_OPTIONS_H

#include "base/base.h"

typedef struct ReplayOptions {
    const char *recording, *scene_folder, *picture, *movie, *sessions, *beside;
    double duration_s, at_s, from_s, to_s, fps, speed, lao_deg, cra_deg, close_up_mm;
    int width, height, view;         // index in cli_view_name
    int threads;
    bool verify, quiet, no_panels;
} ReplayOptions;
extern const OptionTable replay_options;

#endif
