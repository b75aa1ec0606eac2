// Names and contents of what a session leaves in its folder.
#ifndef SELDINGER_SIM_SESSION_FILES_H
#define SELDINGER_SIM_SESSION_FILES_H

#include "sim/session.h"

// The folder of sessions: `wanted`, else $XDG_DATA_HOME/seldinger/sessions, else ~/.local/share/seldinger/sessions; made where it is not there.
// False with a fault.
bool session_folder(const char *wanted, char *out, size_t capacity, Faults *faults);
// FOLDER/SCENE-20261121-221100.EXT: local time; a number behind it where that is taken.
void session_file_name(const char *folder, const char *scene_path, const char *extension, char *out, size_t capacity);
// Beside a recording: its name with another extension.
void session_file_beside(const char *recording, const char *extension, char *out, size_t capacity);
// Writes the session file beside a recording that is closed. False with faults.
bool session_files_save(const Scene *scene, const char *trainee, const char *device, const char *date, const Score *score, const char *recording,
                          Faults *faults);

typedef struct CutOff {
    int count;
    char (*path)[4096];          // (count) recordings, by name
} CutOff;
// The sessions in a folder that were cut off: recordings that hold a session, have no session file beside them, and are written by no program at the
// moment. Other files are passed over.
CutOff session_find_cut_off(const char *folder);
void session_free_cut_off(CutOff *found);

#endif
