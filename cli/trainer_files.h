// Names and contents of what a session leaves in its folder.
#ifndef SELDINGER_CLI_TRAINER_FILES_H
#define SELDINGER_CLI_TRAINER_FILES_H

#include "sim/session.h"

// The folder of sessions: `wanted`, else $XDG_DATA_HOME/seldinger/sessions, else ~/.local/share/seldinger/sessions; made where it is not there.
// False with a fault.
bool trainer_folder(const char *wanted, char *out, size_t capacity, Faults *faults);
// FOLDER/SCENE-20261121-221100.EXT: local time; a number behind it where that is taken.
void trainer_file_name(const char *folder, const char *scene_path, const char *extension, char *out, size_t capacity);
// Beside a recording: its name with another extension.
void trainer_file_beside(const char *recording, const char *extension, char *out, size_t capacity);
// Writes the session file beside a recording that is closed. False with faults.
bool trainer_save_session(const Scene *scene, const char *trainee, const char *device, time_t when, const Score *score, const char *recording,
                          Faults *faults);

#endif
