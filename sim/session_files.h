// Names and contents of the files of a session.
#ifndef SELDINGER_SIM_SESSION_FILES_H
#define SELDINGER_SIM_SESSION_FILES_H

#include "sim/session.h"

// The folder of sessions: `wanted`, else $XDG_DATA_HOME/seldinger/sessions, else ~/.local/share/seldinger/sessions; created if it does not exist.
// False with a fault.
bool session_folder(const char *wanted, char *out, size_t capacity, Faults *faults);
// FOLDER/SCENE-20261121-221100.EXT: local time; with a number appended if that name is taken. The scene.yaml of a folder has the folder's name.
void session_file_name(const char *folder, const char *scene_path, const char *extension, char *out, size_t capacity);
// The recording's name with another extension.
void session_file_beside(const char *recording, const char *extension, char *out, size_t capacity);
// Writes the session file next to a closed recording. Returns false with faults.
bool session_files_save(const Scene *scene, const char *trainee, const char *device, const char *date, const Score *score, const char *recording,
                        Faults *faults);

typedef struct CutOff {
    int count;
    char (*path)[4096];          // (count) recordings, by name
} CutOff;
// The interrupted sessions in a folder: recordings of a session without a session file that no program is writing. Other files are ignored.
CutOff session_find_cut_off(const char *folder);
void session_free_cut_off(CutOff *found);

#endif
