// What a user can begin with: the exercises and cases of some folders with the best points so far, and the sessions of a folder.
#ifndef SELDINGER_SIM_SHELF_H
#define SELDINGER_SIM_SHELF_H

#include "sim/exercise.h"
#include "sim/session.h"

typedef struct ShelfCase {
    char path[4096];             // of the scene, or of the case's folder
    char title[EXERCISE_TITLE];  // of the exercise, else the name of the file or folder
    char text[1000];             // the start of the exercise's instructions; "": none
    int level;                   // of the exercise, 1 to 5; 0: none
    bool is_guided;              // its exercise has steps
    char missing[4096];          // the model or mesh that its scene needs and that cannot be read; "": none
    int sessions;                // recorded in it
    double best;                 // points; 0 without sessions
} ShelfCase;

typedef struct ShelfSession {
    char path[4096];             // of the session file
    char recording[4096];        // the recording that it is about; "": none is named
    char trainee[SESSION_NAME], title[EXERCISE_TITLE], date[SESSION_DATE];
    double points;
} ShelfSession;

typedef struct Shelf {
    int case_count;
    ShelfCase *cases;            // in the order of the folders, then by name
    int session_count;
    ShelfSession *session;       // newest first
    int broken;                  // number of session files that cannot be read
} Shelf;

// Folders and files that cannot be read are left out. `folder` lists (folder_count) folders of scenes and cases, NULL entries are skipped. Returns false if out of memory;
// shelf_free then too.
bool shelf_read(Shelf *shelf, const char *const *folder, int folder_count, const char *sessions);
void shelf_free(Shelf *shelf);

#endif
