// The figures of a session's page (session_page.h), and their data.
#ifndef SELDINGER_RENDER_SESSION_FIGURES_H
#define SELDINGER_RENDER_SESSION_FIGURES_H

#include "sim/sim.h"

#include <stdio.h>

typedef struct SessionPage {
    FILE *out;
    const char *path;            // of the session
    const Session *session;
    const RecordedRun *run;      // NULL: missing
    bool run_is_its;             // the recording's digest is the session's
    const Scene *scene;          // as recorded; NULL: missing
    const VesselTree *tree;      // NULL: none, or missing
    const Session *earlier;      // (earlier_count) of the same trainee and exercise, oldest first, this one among them
    int earlier_count, broken;
} SessionPage;

// Figures, inline SVG; nothing where there is no recording.
void session_time_figure(const SessionPage *page);
void session_path_figure(const SessionPage *page);
void session_trend_figure(const SessionPage *page);
// One letter for an error's kind, for marks in figures and lists.
char session_error_letter(ScoreError kind);

#endif
