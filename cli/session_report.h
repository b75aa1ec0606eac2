// The report of a trainee's session (`seldinger report`): one HTML5 page that stands alone, as cli/report.h's, in its style: points and their parts,
// errors, plots over time, the tip's path over the vessel, earlier sessions. What cannot be had (recording, vessel, scene) is left out and said.
#ifndef SELDINGER_CLI_SESSION_REPORT_H
#define SELDINGER_CLI_SESSION_REPORT_H

#include "cli/cli.h"
#include "sim/session.h"

typedef struct SessionPage {
    FILE *out;
    const char *path;            // of the session
    const Session *session;
    const RecordedRun *run;      // NULL: not there
    bool run_is_its;             // the recording's digest is the session's
    const Scene *scene;          // as recorded; NULL: not there
    const VesselTree *tree;      // NULL: none, or not there
    const Session *earlier;      // (earlier_count) of the same trainee and exercise, oldest first, this one among them
    int earlier_count, broken;
} SessionPage;

// Writes the whole page to page->out.
void session_page(const SessionPage *page);

// Figures, inline SVG (session_figures.c); nothing where there is no recording.
void session_time_figure(const SessionPage *page);
void session_path_figure(const SessionPage *page);
void session_trend_figure(const SessionPage *page);
// One letter for an error's kind, for marks in figures and lists.
char session_error_letter(ScoreError kind);

#endif
