// A trainee's session as a JSON file next to its recording: who, when, with what, the score, the errors with their times, and a proof that the
// recording belongs to the session (digest of its time series, hash of its last state). Keys are those of the struct, times simulated seconds:
//
//   {"seldinger_session": 1, "trainee": "", "date": "2025-11-21T22:05:00Z", "device": "", "version": "", "mode": "practice" or "examination",
//    "scene": {"path": "", "sha256": "", "title": "", "target": ""},
//    "recording": {"path": "", "steps": 0, "step_ms": 1, "series_sha256": "", "state_hash": ""},
//    "score": {figures of score.h, "parts": {"time": 1, …: fraction of each reached},
//       "points_of": {"time": {"points": 0, "most": 0, "measured": 0, "par": 0, "why": ""}, …}, "errors": {"wrong_branch": {"count": 0, "last_s": 0}, …}, "tools": [{"name": "", …}] of several,
//       "consequences": {"narrowest": 1, "marks": [{"kind": "perforation", "time_s": 0, "at_mm": [x, y, z], "force_n": 0, "limit_n": 0, "leaked_ml": 0}]} if they
//       happen, "steps": [time of each step done] of a guided exercise},
//   "events": [{"kind": "wrong_branch", "time_s": 0}]}       and, with several tools, "tool": the tool that caused it
#ifndef SELDINGER_SIM_SESSION_H
#define SELDINGER_SIM_SESSION_H

#include "sim/recording.h"
#include "sim/score.h"

#include <time.h>

enum { SESSION_DATE = 24, SESSION_NAME = 96, SESSION_PATH = 1024, SESSION_BYTES_MOST = 1 << 20 };

typedef struct Session {
    char trainee[SESSION_NAME], device[SESSION_NAME];
    char date[SESSION_DATE];     // UTC, as above
    char version[SESSION_NAME];  // of the program
    char scene_path[SESSION_PATH], scene_sha256[65];     // of its text
    char title[EXERCISE_TITLE], target[64];              // "" without exercise
    char recording_path[SESSION_PATH];                   // relative to the session's folder
    bool is_examination;         // from its first to its last step
    int64_t steps;
    double step_ms;
    char series_sha256[65];      // of time, command, X-ray controls and state hash of all steps
    uint64_t state_hash;         // of the last step
    ScoreFigures figures;        // those that are written; 0 for an episode still in progress
    int event_count;
    ScoreEvent event[SCORE_EVENTS_MOST];
} Session;

void session_date(time_t when, char text[SESSION_DATE]);     // UTC, as in the file
bool session_is_date(const char *text);
// Sets trainee, date and paths. Strings are truncated at a whole UTF-8 character.
void session_begin(Session *session, const Scene *scene, const char *trainee, const char *device, const char *date);
void session_set_score(Session *session, const Score *score);
// Sets the digest of the recording, read back after it was closed; `path` as written in the file.
void session_set_run(Session *session, const RecordedRun *run, const char *path);
// Whether `run` belongs to the session, by its digest.
bool session_is_of(const Session *session, const RecordedRun *run);
// The text of the session file; the caller frees. NULL if out of memory.
char *session_json(const Session *session);

// `text` need not be NUL-terminated. Returns false with all faults at once: invalid JSON, trailing bytes, unknown, duplicate or missing keys, wrong types and
// ranges; the session is then unchanged.
bool session_parse(const char *text, size_t length, const char *path, Session *session, Faults *faults);
bool session_load(const char *path, Session *session, Faults *faults);
// The sessions in a folder with this trainee and title (the same exercise), oldest first. Other files are ignored; unreadable sessions are counted in *broken.
// The caller frees. Returns NULL with a fault if the folder cannot be read or if out of memory.
Session *session_list(const char *folder, const char *trainee, const char *title, int *count, int *broken, Faults *faults);

#endif
