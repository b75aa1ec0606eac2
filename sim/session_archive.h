// All sessions of a folder, and the files in it that should be sessions but cannot be read, with the reason: no file is left out silently.
#ifndef SELDINGER_SIM_SESSION_ARCHIVE_H
#define SELDINGER_SIM_SESSION_ARCHIVE_H

#include "sim/session.h"

#include <stdio.h>

enum { ARCHIVE_NAME = 256 };

typedef struct ArchivedSession {
    char file[ARCHIVE_NAME];     // its name in the folder
    Session session;
} ArchivedSession;

typedef struct ArchiveGap {
    char file[ARCHIVE_NAME];
    char why[FAULT_LENGTH];
} ArchiveGap;

typedef struct SessionArchive {
    int count;
    ArchivedSession *entry;      // (count) by date, then by name
    int gap_count;
    ArchiveGap *gap;             // (gap_count) by name: JSON files that are no session, recordings of interrupted sessions
} SessionArchive;

// Returns false with a fault if the folder cannot be read or if out of memory; session_archive_free then too.
bool session_archive_read(SessionArchive *archive, const char *folder, Faults *faults);
void session_archive_free(SessionArchive *archive);

// Writes the sessions of a trainee (NULL: of all) as CSV (RFC 4180, UTF-8), one row each, in the archive's order; then a row for each gap, with its reason in the
// last column. Columns, with units in their names: file, trainee, date, title, target, mode, device, version, state; the figures of the session's file under
// their names there; points_PART for each part of the score, empty if it is not judged; errors_KIND; why_unreadable. Numbers are those of the file, digit by digit.
void session_archive_print_csv(const SessionArchive *archive, const char *trainee, FILE *out);

#endif
